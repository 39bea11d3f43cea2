"""The import table and the house rules, read from the source.

Parsing all files takes many seconds, so that lines of imports are found by a pattern first. Files where these are not
enough, as texts may have such lines too, are parsed.
"""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
STANDARD = sys.stdlib_module_names

ALLOWED: dict[str, set[str]] = {
    "errors": set(),
    "algebra": {"algebra", "errors"},
    "ir": {"ir", "errors", "algebra.coefficients"},
    "rings": {"rings", "errors", "algebra", "ir.scalar", "mpmath", "sympy"},
    "symbolic": {"symbolic", "errors", "algebra", "rings", "frontend", "ir.interpret", "passes.pipeline", "sympy"},
    "calculus": {"calculus", "symbolic", "frontend", "errors", "algebra", "rings", "sympy"},
    "frontend": {
        *("frontend", "errors", "algebra", "rings"),
        *("ir.boundaries", "ir.scalar", "ir.procedure", "ir.reserved", "ir.rows"),
    },
    "matrices": {"matrices", "errors", "algebra", "frontend"},
    "structure": {"structure", "errors", "algebra", "numpy"},
    "passes": {
        *("passes", "errors", "algebra", "rings", "frontend", "ir", "mpmath"),
        *("structure.levels", "structure.blocks", "structure.frames"),
    },
    "cluscript": {"cluscript", "errors", "algebra", "frontend", "ir.scalar"},
    "robots": {"robots", "errors", "algebra", "frontend", "specs"},
    "gac_runtime": {"gac_runtime", "numpy", "numba", "_cffi_backend"},
    "backends": {"backends", "errors", "ir", "gac_runtime", "jinja2"},
    "derivatives": {"derivatives", "errors", "algebra", "ir.procedure", "ir.rows", "frontend", "passes"},
    "cache_folder": {"errors", "gac_runtime.cache"},
    "extras": set(),
    "load_time": set(),
    "packages": set(),
    "wheels": {
        *("wheels", "errors", "backends", "gac_runtime.names", "gac_runtime.processor", "__version__"),
        *("elftools", "packaging", "wheel"),
    },
    "generation": {
        *("generation", "errors", "algebra", "rings", "ir", "frontend", "passes", "cluscript", "backends"),
        *("cache_folder", "gac_runtime.layout", "load_time", "mpmath", "jinja2"),
    },
    "program_text": {"ir", "passes", "backends"},
    "verify_loops": {"errors", "ir", "frontend", "passes", "backends", "generation", "program_text", "numpy"},
    "verify": {
        *("errors", "ir", "frontend", "passes", "backends", "generation", "program_text", "verify_loops", "numpy"),
    },
    "inspect_loops": {"errors", "frontend", "ir", "passes", "backends", "generation", "inspect"},
    "inspect": {"errors", "algebra", "frontend", "ir", "passes", "backends", "generation"},
    "runtime": {"errors", "frontend", "ir.cost_models", "passes", "backends", "generation", "cache_folder"},
    "scripts": {"algebra", "frontend", "cluscript", "runtime"},
    "differentiable": {"algebra", "errors", "frontend", "derivatives", "runtime", "numpy"},
    "torch": {"errors", "frontend", "differentiable", "torch", "torch_devices"},
    "torch_devices": {
        *("errors", "ir", "frontend", "backends", "generation", "runtime", "cache_folder"),
        *("gac_runtime.loop_arguments", "torch"),
    },
    "jax": {"errors", "frontend", "differentiable", "numpy", "jax"},
    "objects": {
        *("objects", "errors", "algebra", "rings", "ir", "frontend", "passes", "backends", "generation", "runtime"),
        *(
            "cache_folder",
            "gac_runtime.annotations",
            "gac_runtime.array_element",
            "gac_runtime.arrays",
            "gac_runtime.extension_file",
            "gac_runtime.layout",
            "gac_runtime.names",
            "gacompiler",
            "numpy",
            "scipy",
            "matplotlib",
            "mpl_toolkits",
            "plotly",
        ),
    },
    "cli": {
        *(
            "gac_runtime.names",
            "cli",
            "errors",
            "algebra",
            "frontend",
            "ir.cost_models",
            "ir.procedure_cost",
            "passes",
            "backends",
            "robots",
            "structure",
            "objects.recording",
            "wheels",
        ),
        *(
            "cache_folder",
            "generation",
            "inspect",
            "inspect_loops",
            "verify",
            "runtime",
            "__version__",
            "click",
            "rich",
        ),
    },
    "__init__": {"extras", "load_time", "packages", "vocabulary", "runtime", "scripts"},
    "vocabulary": {"algebra", "frontend", "derivatives"},
    "__main__": {"cli"},
}
"""The imports, in addition to the standard library, that are allowed in each package and file of the compiler."""

EXCEPTIONS: dict[str, set[str]] = {
    "algebra/coefficients.py": {"numpy", "mpmath", "sympy"},
    "backends/approximations.py": {"mpmath"},
    "rings/symbolic.py": {"sympy"},
    "robots/descriptions.py": {"algorithms.kinematics"},
}
"""Single files that may import more, and what."""

ONLY_INSIDE_FUNCTIONS = {"algebra/coefficients.py": {"sympy", "mpmath"}, "rings/factors.py": {"sympy"}}

GENERATED = {"numpy", "_cffi_backend", "numba", "generated", "gac_runtime"}
ALGORITHMS = {
    "generated", "algorithms", "numpy", "numba", "scipy", "matplotlib", "skimage", "rich", "nibabel", "pydicom",
    "torch", "jax",
}  # fmt: skip
LINES = 400

MUTUAL = frozenset(f"gacompiler.algebra.{name}" for name in ("algebra", "layout", "multivector"))
"""An algebra makes its multivectors and its layouts, and each of these knows its algebra: the one circle of imports."""


IMPORT = re.compile(r"^\s*(?:from\s+(\S+)\s+import\s+(\([^)]*\)|[^\n#]*)|import\s+([^\n#]*))", re.MULTILINE)


@cache
def modules(folder: str) -> list[Path]:
    return sorted((ROOT / folder).rglob("*.py"))


@cache
def tree_of(path: Path) -> ast.Module:
    """A file of the project, read once for all tests."""
    return ast.parse(path.read_text())


def relative(path: Path) -> str:
    return str(path.relative_to(ROOT / path.relative_to(ROOT).parts[0]))


def statements(parent: ast.AST, later: bool = False) -> Iterator[tuple[ast.AST, bool]]:
    """All statements but those for type checkers, and whether they run later than when the file is loaded."""
    for node in ast.iter_child_nodes(parent):
        if not isinstance(node, (ast.stmt, ast.excepthandler, ast.match_case)):
            continue
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            continue
        yield node, later
        yield from statements(node, later or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)))


@cache
def imports(path: Path) -> tuple[tuple[str, bool], ...]:
    """Full names of what a file imports, and whether that happens when it is loaded."""
    return tuple(_imports(path))


def _imports(path: Path) -> Iterator[tuple[str, bool]]:
    package = list(path.relative_to(ROOT).with_suffix("").parts[:-1])
    for node, later in statements(tree_of(path)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, not later
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            name = ".".join([*base, *([node.module] if node.module else [])])
            if node.module:
                yield name, not later
            else:
                for alias in node.names:
                    yield f"{name}.{alias.name}", not later


def may(name: str, allowed: set[str]) -> bool:
    return any(name == one or name.startswith(one + ".") for one in allowed)


@cache
def names_in(text: str, package: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Modules of lines that import, each with the full name of what is imported from it; also of lines within texts."""
    found = []
    for base, names, whole in IMPORT.findall(text):
        each = [name.split()[0] for name in (whole or names.strip("()")).split(",") if name.strip()]
        if whole:
            found += [(name, name) for name in each]
            continue
        level = len(base) - len(base.lstrip("."))
        parts = [*(package[: len(package) + 1 - level] if level else ()), *filter(None, [base[level:]])]
        module = ".".join(parts)
        found += [(module if base[level:] else f"{module}.{name}", f"{module}.{name}") for name in each]
    return tuple(found)


def wrong_imports(path: Path, is_right: Callable[[str], bool]) -> list[str]:
    """Names of what a file imports, other than for type checkers, that are not right."""
    if all(is_right(name) for name, _ in names_in(path.read_text(), path.relative_to(ROOT).parts[:-1])):
        return []
    return [name for name, _ in imports(path) if not is_right(name)]


def test_the_import_table() -> None:
    for path in modules("gacompiler"):
        own = relative(path)
        package = path.relative_to(ROOT / "gacompiler").parts[0].removesuffix(".py")
        if package not in ALLOWED:
            continue
        allowed = ALLOWED[package] | EXCEPTIONS.get(own, set())

        def is_right(name: str, allowed: set[str] = allowed) -> bool:
            inside = name.removeprefix("gacompiler.")
            return (inside == name and name.split(".")[0] in STANDARD) or may(inside, allowed)

        assert not (wrong := wrong_imports(path, is_right)), f"{own} imports {', '.join(wrong)}"


def test_sympy_and_numpy_have_their_places() -> None:
    for path in modules("gacompiler"):
        own = relative(path)
        if not re.search(r"^\s*(?:from|import) (?:sympy|numpy|mpmath)", path.read_text(), re.MULTILINE):
            continue
        for name, at_load in imports(path):
            top = name.split(".")[0]
            if top == "sympy":
                places = ("calculus/", "symbolic/", "rings/symbolic.py", "rings/factors.py", "algebra/coefficients.py")
                assert own.startswith(places), own
            if top == "numpy" and own.startswith("algebra/"):
                assert own == "algebra/coefficients.py", own
            if top in ONLY_INSIDE_FUNCTIONS.get(own, set()):
                assert not at_load, f"{own} loads {top} at import"


def test_every_package_and_file_is_in_the_table() -> None:
    folders = {path.parent.name for path in (ROOT / "gacompiler").glob("*/__init__.py")}
    files = {path.stem for path in (ROOT / "gacompiler").glob("*.py")}
    assert (folders | files) - {"specs"} == set(ALLOWED)


def test_one_file_of_the_compiler_imports_algorithms() -> None:
    found = {
        module
        for module, others in graph_of_the_project().items()
        if module.startswith("gacompiler") and any(other.startswith("algorithms") for other in others)
    }
    assert found == {"gacompiler.robots.descriptions"}


def graph_of(root: Path, *folders: str) -> dict[str, set[str]]:
    """The modules that each module imports: when loaded, inside functions, and for type checkers only."""
    paths = {
        ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__"): path
        for folder in folders
        for path in (root / folder).rglob("*.py")
    }
    graph: dict[str, set[str]] = {}
    for module, path in paths.items():
        text = re.sub(r'"""[\s\S]*?"""', "", path.read_text())
        pairs = names_in(text, path.relative_to(root).parts[:-1])
        found = graph[module] = {name if name in paths else name.rpartition(".")[0] for _, name in pairs}
        found &= paths.keys() - {module}
    return graph


def circle(graph: Mapping[str, set[str]]) -> list[str]:
    """Modules that import one another in a circle, the first one at both ends; none where there is no circle."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


@cache
def graph_of_the_project() -> dict[str, set[str]]:
    """`graph_of` the compiler and the algorithms, read once for all tests."""
    return graph_of(ROOT, "gacompiler", "algorithms")


def test_nothing_imports_in_a_circle() -> None:
    graph = graph_of_the_project()
    assert circle(graph) and set(circle(graph)) <= MUTUAL, " <- ".join(circle(graph))
    joined = {module: set(others) for module, others in graph.items() if module not in MUTUAL}
    for others in joined.values():
        if others & MUTUAL:
            others -= MUTUAL
            others.add("MUTUAL")
    joined["MUTUAL"] = set().union(*(graph[module] for module in MUTUAL)) - MUTUAL
    assert not circle(joined), " <- ".join(circle(joined))


@pytest.mark.parametrize(
    "line",
    ["from .b import B", "def f():\n    from . import b", "if TYPE_CHECKING:\n    from p.b import B", "import p.b"],
)
def test_circles_are_found(tmp_path: Path, line: str) -> None:
    (tmp_path / "p").mkdir()
    (tmp_path / "p" / "__init__.py").write_text("from .a import A\n")
    (tmp_path / "p" / "a.py").write_text(line)
    (tmp_path / "p" / "b.py").write_text("import sys\n")
    assert circle(graph_of(tmp_path, "p")) == []
    (tmp_path / "p" / "b.py").write_text("from .a import A\n")
    assert set(circle(graph_of(tmp_path, "p"))) == {"p.a", "p.b"}


def test_specs_use_public_names() -> None:
    """A spec is what a user would write: the package, its catalog, its errors; other specs."""
    for path in modules("gacompiler/specs"):

        def is_public(name: str) -> bool:
            public = ("gacompiler", "gacompiler.algebra.catalog", "gacompiler.algebra.algebra")
            return not name.startswith("gacompiler") or name in public or name.startswith("gacompiler.specs")

        assert not (wrong := wrong_imports(path, is_public)), f"{relative(path)} imports {', '.join(wrong)}"


@pytest.mark.parametrize(("folder", "allowed"), [("generated", GENERATED), ("algorithms", ALGORITHMS)])
def test_users_code_never_loads_the_compiler(folder: str, allowed: set[str]) -> None:
    def is_right(name: str) -> bool:
        top = name.split(".")[0]
        return top not in ("gacompiler", "sympy") and (top in STANDARD or top in allowed)

    for path in modules(folder):
        assert not (wrong := wrong_imports(path, is_right)), f"{relative(path)} imports {', '.join(wrong)}"


def test_loading_the_compiler_does_not_load_sympy() -> None:
    code = "import sys, gacompiler, gacompiler.passes.pipeline; print(sorted({'sympy', 'numba'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "[]"


def source_files() -> list[Path]:
    return modules("gacompiler") + modules("algorithms")


def test_files_are_short() -> None:
    """A file passes 400 lines only with a reason in its docstring."""
    for path in source_files():
        text = path.read_text()
        if len(text.splitlines()) > LINES:
            docstring = text.split('"""')[1] if text.startswith('"""') else ""
            assert "lines" in docstring or "one file" in docstring, (
                f"{path.relative_to(ROOT)} gives no reason for its length"
            )


def test_everything_public_is_documented() -> None:
    """Checked by ruff, whose rules about docstrings count ``__call__`` among the public methods."""
    rules = ["--isolated", "--no-cache", "--output-format", "json", "--select", "D100,D101,D102,D103,D106"]
    command = [sys.executable, "-m", "ruff", "check", *rules, "gacompiler", "algorithms"]
    found = json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, text=True).stdout)
    for each in found:
        path, row = Path(each["filename"]), each["location"]["row"]
        line = path.read_text().splitlines()[row - 1]
        assert "def __" in line, f"{path.relative_to(ROOT)}:{row}: {line.strip()}: {each['message']}"
    for path in source_files():
        if path.name == "__init__.py" and (text := path.read_text().strip()):
            assert text.startswith('"""'), f"{path.relative_to(ROOT)} has no docstring"


def test_nothing_printed_comes_from_a_set() -> None:
    """Text must never depend on the order of a set: no loop or comprehension in what prints iterates over one."""
    perhaps = re.compile(r"\bin\s+(?:\{|set\(|frozenset\()")
    for folder in ("gacompiler/backends", "gacompiler/ir", "gacompiler/passes"):
        for path in modules(folder):
            if not perhaps.search(path.read_text()):
                continue
            for node in ast.walk(tree_of(path)):
                over = node.iter if isinstance(node, (ast.For, ast.comprehension)) else None
                literal = isinstance(over, (ast.Set, ast.SetComp))
                called = (
                    isinstance(over, ast.Call)
                    and isinstance(over.func, ast.Name)
                    and over.func.id in ("set", "frozenset")
                )
                assert not literal and not called, f"{relative(path)}:{getattr(over, 'lineno', 0)} iterates over a set"
