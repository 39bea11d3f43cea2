"""Emitted text is the same on every machine: its numbers are added and multiplied in one order, and rounded once.

The order of sums in BLAS and its use of fused operations depend on the processor, and numpy's vectors of sines
differ in the last digit from processor to processor. So the source between a spec, or a robot's file, and the text is
searched for them. `tests/peers/test_processors.py` repeats the tests of text under other kernels of BLAS and without
vectors.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from algorithms.kinematics.named import TABLES
from gacompiler.robots.descriptions import robot_spec
from tests.support.all_cases import all_cases

ROOT = Path(__file__).parents[2]
STARTS = (
    "gacompiler.generation.compiling",
    "gacompiler.generation.rendering",
    "gacompiler.robots",
    "gacompiler.robots.descriptions",
    "gacompiler.specs",
)
"""Modules that write text and their input, including everything that they import, also inside functions."""

_SUMS = "dot vdot inner matmul einsum tensordot linalg sum nansum mean std var cumsum cumprod prod"
ARRAYS = frozenset(_SUMS.split())
"""Names of numpy and of methods of its arrays that add or multiply many numbers in an unspecified order."""
_MORE = """
average trace trapezoid reduce reduceat accumulate kron convolve correlate lapack blas fma
sin cos tan sinc sinh cosh tanh asin acos atan atan2 arcsin arccos arctan arctan2 asinh acosh atanh arcsinh arccosh
arctanh exp exp2 expm1 log log2 log10 log1p logaddexp power float_power cbrt pow gamma lgamma erf erfc
"""
LIBRARIES_OWN = frozenset(_MORE.split())
"""More of these, and functions whose last digit is the machine's, where they are a library's."""
LIBRARIES = frozenset({"numpy", "scipy", "math", "cmath", "numba"})

READERS = frozenset(f"algorithms/kinematics/{name}.py" for name in ("bodies", "denavit_hartenberg", "named", "urdf"))
"""Modules that read robots, in which no exception is allowed."""
ALLOWED: Mapping[str, str] = {
    "gacompiler/objects": "numeric objects, which are names of the package, and which no spec uses",
    "gacompiler/algebra/coefficients.py": "the table of functions of numbers in double; constants are exact, and "
    "errors that are printed are measured with functions that are rounded correctly (`passes.accuracy.run_in_double`)",
    "algorithms/evidence": "names the statuses of methods that no text calls",
    "algorithms/kinematics": "takes joint variables, which no text has: see the test of lines that run",
}
"""Files and folders that may use them elsewhere, and why no text depends on it."""


def file_of(module: str) -> Path | None:
    path = ROOT / Path(*module.split("."))
    for found in (path.with_suffix(".py"), path / "__init__.py"):
        if found.is_file():
            return found
    return None


@cache
def nodes_of(path: Path) -> tuple[ast.AST, ...]:
    return tuple(ast.walk(ast.parse(path.read_text())))


def imports(path: Path) -> Iterator[str]:
    """The modules that a file imports, with everything that may be a module of a package."""
    package = ".".join(path.relative_to(ROOT).parts[:-1]).split(".")
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*start, *([node.module] if node.module else [])])
            yield base
            yield from (f"{base}.{alias.name}" for alias in node.names)


@cache
def closure() -> tuple[Path, ...]:
    todo, found = list(STARTS), set[Path]()
    todo += [f"gacompiler.specs.{path.stem}" for path in (ROOT / "gacompiler" / "specs").glob("*.py")]
    while todo:
        module = todo.pop()
        path = file_of(module)
        if path is None or path in found or module.split(".")[0] not in ("gacompiler", "algorithms"):
            continue
        found.add(path)
        todo += imports(path)
    return tuple(sorted(found))


def findings(nodes: Sequence[ast.AST]) -> Iterator[tuple[int, str]]:
    """Expressions whose results depend on the machine, with their lines."""
    modules, functions = dict[str, str](), dict[str, str]()
    for node in nodes:
        if isinstance(node, ast.Import):
            modules |= {alias.asname or alias.name.split(".")[0]: alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in LIBRARIES and not node.level:
            functions |= {alias.asname or alias.name: alias.name for alias in node.names}
            modules |= {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
    for node in nodes:
        what = _what(node, modules, functions)
        if what:
            yield getattr(node, "lineno", 0), what


def _what(node: ast.AST, modules: Mapping[str, str], functions: Mapping[str, str]) -> str:
    if isinstance(node, (ast.BinOp, ast.AugAssign)) and isinstance(node.op, ast.MatMult):
        return "@"
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
        parts = [*ast.walk(node.left), *ast.walk(node.right)]
        has_float = any(isinstance(part, ast.Constant) and isinstance(part.value, float) for part in parts)
        below = isinstance(node.left, ast.Constant) and isinstance(node.right, ast.UnaryOp)
        return f"{ast.unparse(node)}, which is pow of the C library" if has_float or below else ""
    if isinstance(node, ast.Attribute):
        root = node.value
        while isinstance(root, ast.Attribute):
            root = root.value
        library = modules.get(root.id, "").split(".")[0] if isinstance(root, ast.Name) else ""
        # `math` goes from the first to the last
        own = node.attr in LIBRARIES_OWN and library in LIBRARIES
        found = own or (node.attr in ARRAYS and library != "math")
        return ast.unparse(node) if found else ""
    if isinstance(node, ast.Name) and functions.get(node.id) in ARRAYS | LIBRARIES_OWN and node.id != "prod":
        return node.id
    return ""


@cache
def everything() -> tuple[tuple[str, int, str, str], ...]:
    """File, line and text of every finding, with the entry of `ALLOWED` that covers it, or none."""
    all_of_them = []
    for path in closure():
        file = str(path.relative_to(ROOT))
        for line, what in findings(nodes_of(path)):
            covering = () if file in READERS else (file, *map(str, Path(file).parents))
            all_of_them.append((file, line, what, next((name for name in covering if name in ALLOWED), "")))
    return tuple(all_of_them)


@pytest.mark.slow
def test_no_number_of_the_text_depends_on_the_machine() -> None:
    read = {str(path.relative_to(ROOT)) for path in closure()}
    assert {"gacompiler/specs/ur5.py", "gacompiler/passes/search.py", "gacompiler/structure/levels.py"} <= read
    assert {"gacompiler/backends/c.py", "algorithms/kinematics/urdf.py", "algorithms/arguments.py"} <= read
    found = everything()
    assert [f"{file}:{line}: {what}" for file, line, what, entry in found if not entry] == []
    assert {entry for *_, entry in found} == set(ALLOWED)  # remove entries that are not needed


@all_cases(
    "source, what",
    [
        ("def f(h, c):\n    return h @ c", "@"),
        ("import numpy as np\nx = np.dot(a, b)", "np.dot"),
        ("def f(h, c):\n    return h.dot(c)", "h.dot"),
        ("from numpy import einsum\nx = einsum('i,i', a, b)", "einsum"),
        ("import numpy as np\nx = np.add.reduce(a)", "np.add.reduce"),
        ("import numpy as np\nx = np.linalg.norm(a)", "np.linalg"),
        ("x = a.sum()", "a.sum"),
        ("import numpy\nx = numpy.sin(a)", "numpy.sin"),
        ("from math import cos as c\nx = c(1)", "c"),
        ("x = 10.0**k", "10.0 ** k, which is pow of the C library"),
        ("x = 10**-k", "10 ** (-k), which is pow of the C library"),
        ("import math\nx = math.prod([1, 2]) + math.sqrt(2) + 3**2 + sum([1, 2])", ""),
        ("import gacompiler as ga\nx = ga.cos(q)", ""),
    ],
)
def test_findings(source: str, what: str) -> None:
    assert [text for _, text in findings(list(ast.walk(ast.parse(source))))] == [what] * bool(what)


INERTIAL = """<inertial><origin xyz="0.1 -0.2 0.3" rpy="0.2 0.1 -0.4"/><mass value="1.5"/>
<inertia ixx="0.3" ixy="0.01" ixz="-0.02" iyy="0.4" iyz="0.03" izz="0.2"/></inertial>"""
JOINTS = {
    "a": '<parent link="base"/><child link="one"/><origin rpy="0.3 0 0.1" xyz="0 0 0.3"/><axis xyz="1 2 2"/>',
    "b": '<parent link="one"/><child link="two"/><origin xyz="0.5 0.02 0"/><axis xyz="0.1 1 0"/>',
    "c": '<parent link="one"/><child link="three"/><axis xyz="0 -1 3"/><mimic joint="b" multiplier="0.7"/>',
    "d": '<parent link="two"/><child link="four"/><origin rpy="0.1 0.2 0.3"/><axis xyz="1 1 1"/>',
    "e": '<parent link="four"/><child link="five"/><origin rpy="1 2 3" xyz="0.1 0.2 0.7"/><axis xyz="1 0 1"/>',
}
TYPES = {"a": "revolute", "b": "prismatic", "c": "prismatic", "d": "planar", "e": "floating"}


@pytest.mark.slow
def test_what_is_allowed_does_not_run_when_a_robot_is_read(tmp_path: Path) -> None:
    """Line by line: what the list above calls unused is unused for every kind of joint and every robot with a name."""
    lines = {(str(ROOT / file), line) for file, line, _, entry in everything() if entry.startswith("algorithms")}
    files, ran = {file for file, _ in lines}, set[tuple[str, int]]()

    def trace(frame: Any, event: str, _: Any) -> Any:
        if frame.f_code.co_filename not in files or frame.f_code.co_name == "<module>":
            return None
        ran.add((frame.f_code.co_filename, frame.f_lineno))
        return trace

    path = tmp_path / "all.urdf"
    links = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in ("one", "two", "three", "four", "five"))
    joints = "".join(f'<joint name="{name}" type="{TYPES[name]}">{text}</joint>' for name, text in JOINTS.items())
    path.write_text(f'<robot name="all"><link name="base"/>{links}{joints}</robot>')
    before = sys.gettrace()
    sys.settrace(trace)
    try:
        texts = [robot_spec(name, None, None, ())[1] for name in (*list(TABLES)[:5], str(path))]
    finally:
        sys.settrace(before)
    assert all("inertias" in text for text in texts[:4]) and "inertias" in texts[-1] and ran
    assert sorted(lines & ran) == []
