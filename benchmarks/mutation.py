"""Mutation testing: change one operator, sign or comparison at a time, and run the tests to see whether one fails.

    python benchmarks/mutation.py rings --count 40
    python benchmarks/mutation.py rings passes algebra motors subspaces geometry vision kinematics
    python benchmarks/mutation.py --only gacompiler/rings/ideal.py

First, the quick tests of a package run once on the unchanged source, while the functions that each test calls and its
duration are recorded. Then each mutant is tested in a separate process by the tests that call the mutated function,
fastest first, until one fails. If a mutant is left, further tests are recorded and run for it: those of other folders
that import its file or what its package exports from it, then slow tests, which `--quick` omits. A mutant that no test
detects survives. Mutants that cannot change any result are listed with a reason in `mutation_equivalent.txt`; only the
first tests are run for them.

Calls of functions that numba compiles cannot be recorded; the tests that call a function that mentions their name are
run. For constants of modules and for functions called by an import, all tests of the package are run, those that call a
function that mentions the name first. For a function that no test calls, only the tests that start a process are run.

If results are cached (`functools.cache`), a call is recorded only for the first test that needs the result. Check a
survivor in such a function by hand with the other tests, too.

A Python process that a test starts uses the mutant as well, unless it has its own environment. Its calls are not
recorded.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import functools
import importlib.abc
import importlib.machinery
import importlib.util
import io
import itertools
import json
import os
import random
import re
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
EQUIVALENT = ROOT / "benchmarks" / "mutation_equivalent.txt"

PACKAGES: dict[str, tuple[str, tuple[str, ...]]] = {
    "rings": ("gacompiler/rings", ("rings/test_*", "test_equations", "test_optimiser", "test_symbolic")),
    "passes": ("gacompiler/passes", ("passes/test_*", "test_prove", "test_loop_specs", "test_loops", "test_functions")),
    "algebra": ("gacompiler/algebra", ("algebra/test_*", "test_inverses", "test_one_vocabulary", "test_pickling")),
    "backends": ("gacompiler/backends", ("backends/test_*", "test_loop_specs", "test_values", "test_no_arguments")),
    "gac_runtime": (
        "gacompiler/gac_runtime",
        (
            "gac_runtime/test_*",
            "test_one_call",
            "test_kernel_calls",
            "test_backend_calls",
            "test_values",
            "test_numba_kernels",
            "test_transcendental",
            "test_batches",
        ),
    ),
    "generation": ("gacompiler/generation", ("generation/test_*", "cli/test_*")),
    "motors": ("algorithms/motors", ("test_motors", "test_determined")),
    "subspaces": ("algorithms/subspaces", ("subspaces/test_*",)),
    "geometry": ("algorithms/geometry", ("geometry/test_*",)),
    "vision": ("algorithms/vision", ("vision/test_*",)),
    "estimation": ("algorithms/estimation", ("estimation/test_*",)),
    "kinematics": ("algorithms/kinematics", ("kinematics/test_*", "robots/test_*")),
    "evidence": ("algorithms/evidence", ("evidence/test_*",)),
    "mapping": ("algorithms/mapping", ("mapping/test_*",)),
    "registration": ("algorithms/registration", ("registration/test_*",)),
    "grasping": ("algorithms/grasping", ("grasping/test_*",)),
}
"""Source folder, and the test files (patterns) of each package that are run first."""

RUNTIME = "gac_runtime"
"""The folder of the runtime, which is copied beside generated modules, also by tests; all copies are mutated."""

HEAVY = ("numpy", "scipy.linalg", "scipy.optimize", "scipy.spatial", "scipy.ndimage", "sympy", "mpmath")
"""Modules that are imported once, before processes are forked."""

LONGEST = 120.0
"""Time limit of a mutant in seconds, in addition to five times the duration of its tests; then it is detected."""

SWAPS: dict[type[ast.AST], tuple[type[ast.AST], ...]] = {
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.FloorDiv: (ast.Mult,),
    ast.Mod: (ast.FloorDiv,),
    ast.Pow: (ast.Mult,),
    ast.LShift: (ast.RShift,),
    ast.RShift: (ast.LShift,),
    ast.BitAnd: (ast.BitOr,),
    ast.BitOr: (ast.BitAnd,),
    ast.BitXor: (ast.BitOr,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Lt: (ast.Gt,),
    ast.LtE: (ast.Gt,),
    ast.Gt: (ast.Lt,),
    ast.GtE: (ast.Lt,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of one file."""

    path: str
    """Relative to the root of the repository."""
    number: int
    """Index of the changed node among the nodes of the file that can be mutated, in the order of `sites`."""
    function: tuple[str, int]
    """Name and first line of the innermost function; ("", 0) at module level."""
    names: tuple[str, ...]
    """The name of the function, or those that the mutated statement of a module defines."""
    line: int
    before: str
    after: str

    @property
    def key(self) -> str:
        """The key of the mutant in the list of equivalent ones. It does not depend on line numbers."""
        return f"{self.path} | {self.function[0]} | {self.before} | {self.after}"


class _Sites(ast.NodeVisitor):
    """Collects the nodes that can be mutated, with the function around each."""

    def __init__(self) -> None:
        self.found: list[tuple[ast.expr, int, tuple[str, int]]] = []
        self._function: list[tuple[str, int]] = [("", 0)]

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
        self._function.append((node.name, first))
        for each in node.body:
            self.visit(each)
        self._function.pop()

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_Assign(self, node: ast.Assign) -> None:
        # an alias of a type at module level, such as `int | Fraction`, computes nothing
        union = isinstance(node.value, ast.BinOp) and isinstance(node.value.op, ast.BitOr)
        if not (union and len(self._function) == 1):
            self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> None:
        """Do not mutate messages."""

    def visit_Assert(self, node: ast.Assert) -> None:
        """Do not mutate assertions."""

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Do not mutate text."""

    def _add(self, node: ast.expr, count: int) -> None:
        self.found += [(node, choice, self._function[-1]) for choice in range(count)]

    def visit_BinOp(self, node: ast.BinOp) -> None:
        text = any(isinstance(side, ast.Constant | ast.JoinedStr) and isinstance(getattr(side, "value", ""), str)
                   for side in (node.left, node.right))  # fmt: skip
        if not text:
            self._add(node, len(SWAPS.get(type(node.op), ())))
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        self._add(node, len(SWAPS[type(node.op)]))
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.USub | ast.Not | ast.Invert):
            self._add(node, 1)
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        self._add(node, len(SWAPS[type(node.ops[0])]))
        self.generic_visit(node)


def sites(tree: ast.Module) -> list[tuple[ast.expr, int, tuple[str, int]]]:
    """Return the nodes that can be mutated, the number of the mutation, and the function around the node."""
    visitor = _Sites()
    visitor.visit(tree)
    return visitor.found


def _swap(node: ast.expr, choice: int) -> ast.expr:
    if isinstance(node, ast.UnaryOp):
        return node.operand
    if isinstance(node, ast.Compare):
        swapped = SWAPS[type(node.ops[0])][choice]()
        return ast.Compare(node.left, [swapped, *node.ops[1:]], node.comparators)  # type: ignore[list-item]
    if isinstance(node, ast.BoolOp):
        return ast.BoolOp(SWAPS[type(node.op)][choice](), node.values)  # type: ignore[arg-type]
    assert isinstance(node, ast.BinOp)
    return ast.BinOp(node.left, SWAPS[type(node.op)][choice](), node.right)  # type: ignore[arg-type]


class _Replace(ast.NodeTransformer):
    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self._old, self._new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self._new if node is self._old else super().generic_visit(node)


def mutants(path: str) -> list[Mutant]:
    """Return all mutants of a file."""
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))

    @functools.cache
    def stored(statement: ast.stmt) -> tuple[str, ...]:
        if isinstance(statement, ast.ClassDef):
            return (statement.name,)
        names = (each for each in ast.walk(statement) if isinstance(each, ast.Name))
        return tuple(each.id for each in names if isinstance(each.ctx, ast.Store))

    def names(function: str, line: int) -> tuple[str, ...]:
        if function:
            return (function,)
        return stored(next(each for each in tree.body if each.lineno <= line <= (each.end_lineno or line)))

    found = []
    for number, (node, choice, function) in enumerate(sites(tree)):
        before, after = ast.unparse(node), ast.unparse(_swap(node, choice))
        found.append(Mutant(path, number, function, names(function[0], node.lineno), node.lineno, before, after))
    return found


def mutated_code(mutant: Mutant) -> CodeType:
    """Return the compiled code of a mutated file."""
    file = ROOT / mutant.path
    tree = ast.parse(file.read_text(encoding="utf-8"))
    node, choice, _ = sites(tree)[mutant.number]
    new = ast.fix_missing_locations(ast.copy_location(_swap(node, choice), node))
    return compile(_Replace(node, new).visit(tree), str(file), "exec", dont_inherit=True)


class _Finder(importlib.abc.MetaPathFinder):
    """Finds the mutated code of one module; other modules are found by the usual finders."""

    def __init__(self, mutant: Mutant) -> None:
        self._name = mutant.path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        self._is_package = mutant.path.endswith("__init__.py")
        self._code = mutated_code(mutant)

    def find_spec(self, fullname: str, path: Sequence[str] | None = None, target: object = None) -> Any:
        parts = fullname.split(".")
        own = ["gacompiler", *parts[parts.index(RUNTIME) :]] if RUNTIME in parts else parts
        if ".".join(own) != self._name:
            return None
        code = self._code
        place = Path(path[0] if path else ROOT, parts[-1])
        file = place / "__init__.py" if self._is_package else place.with_suffix(".py")

        class Loader(importlib.machinery.SourceFileLoader):
            def get_code(self, fullname: str) -> CodeType:
                return code

        return importlib.util.spec_from_file_location(
            fullname,
            file,
            loader=Loader(fullname, str(file)),
            submodule_search_locations=[str(place)] if self._is_package else None,
        )


STARTUP = """
import sys
sys.path.insert(0, {folder!r})
from mutation import Mutant, _Finder
sys.path.remove({folder!r})
sys.meta_path.insert(0, _Finder({mutant!r}))
"""
"""Start-up code of processes that tests start."""


@functools.cache
def _own_path(name: str) -> str:
    """Return the path of a file relative to the root, that of the runtime for a file of a copy; empty for others."""
    _, found, rest = name.partition(f"{os.sep}{RUNTIME}{os.sep}")
    root = str(ROOT) + os.sep
    return f"gacompiler/{RUNTIME}/{rest}" if found else name.removeprefix(root) if name.startswith(root) else ""


class _Recorder:
    """A pytest plugin that records the functions of a folder that each test calls, and the duration of the test."""

    def __init__(self, folder: str) -> None:
        self._folder = folder + os.sep
        self._called: set[tuple[str, int]] = set()
        self._starts = False
        self._of_fixtures: dict[object, tuple[set[tuple[str, int]], bool]] = {}
        self.imported = self._called
        """Functions that are called while modules are imported."""
        self.calls: dict[str, set[tuple[str, int]]] = {}
        self.starts: set[str] = set()
        """Tests that start a process."""
        self.seconds: dict[str, float] = {}
        self.failed: list[str] = []

    def start(self) -> None:
        """Record from now on."""
        sys.addaudithook(self._audit)
        sys.settrace(self._trace)
        threading.settrace(self._trace)

    def _audit(self, event: str, arguments: object) -> None:
        if event in {"subprocess.Popen", "os.fork", "os.posix_spawn"}:
            self._starts = True

    def _trace(self, frame: FrameType, event: str, argument: object) -> None:
        name = _own_path(frame.f_code.co_filename)
        if name.startswith(self._folder):
            self._called.add((name, frame.f_code.co_firstlineno))

    @pytest.hookimpl(hookwrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Iterator[None]:
        """Record the calls of a fixture for all tests that use it."""
        before = self._called, self._starts
        self._called, self._starts = set(), False
        yield
        self._of_fixtures[fixturedef] = self._called, self._starts
        self._called, self._starts = before[0] | self._called, before[1] or self._starts

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Iterator[None]:
        """Record the calls and the duration of a test."""
        self._called, self._starts = set(), False
        start = time.perf_counter()
        yield
        self.seconds[item.nodeid] = time.perf_counter() - start
        for fixtures in item._fixtureinfo.name2fixturedefs.values():
            called, starts = self._of_fixtures.get(fixtures[-1], (set(), False))
            self._called |= called
            self._starts |= starts
        self.calls[item.nodeid] = self._called
        if self._starts:
            self.starts.add(item.nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Record failures."""
        if report.failed:
            self.failed.append(report.nodeid)


QUIET = ["-q", "-x", "--no-header", "-p", "no:cacheprovider", "-p", "no:randomly", "-p", "no:xdist"]

QUICK, SLOW = "not slow and not peers", "slow and not peers"


def record(folder: str, files: Sequence[str], mark: str) -> _Recorder:
    """Run the tests of a package that have a mark on the unchanged source, in a separate process."""
    with tempfile.TemporaryDirectory() as scratch:
        answer = Path(scratch) / "calls.json"
        if os.fork() == 0:
            recorder = _Recorder(folder)
            with contextlib.redirect_stdout(io.StringIO()):
                recorder.start()
                pytest.main([*QUIET, "-m", mark, *files], plugins=[recorder])
                sys.settrace(None)
                threading.settrace(None)  # type: ignore[arg-type]
            calls = {test: sorted(called) for test, called in recorder.calls.items()}
            found = [calls, sorted(recorder.imported), sorted(recorder.starts), recorder.seconds, recorder.failed]
            answer.write_text(json.dumps(found))
            os._exit(0)
        os.wait()
        calls, imported, starts, seconds, failed = json.loads(answer.read_text())
    recorder = _Recorder(folder)
    recorder.calls = {test: {(name, line) for name, line in called} for test, called in calls.items()}
    recorder.imported, recorder.starts = {(name, line) for name, line in imported}, set(starts)
    recorder.seconds, recorder.failed = seconds, failed
    if failed:
        raise SystemExit(f"{', '.join(failed)}: fails on the unchanged source; make the tests pass first")
    return recorder


def mentions(folder: str) -> dict[str, list[tuple[str, str, int]]]:
    """Return the functions that mention each name: their files, names and first lines."""
    found: dict[str, list[tuple[str, str, int]]] = {}
    for path in sorted((ROOT / folder).rglob("*.py")):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.FunctionDef):
                first = min([function.lineno, *(d.lineno for d in function.decorator_list)])
                nodes = list(ast.walk(function))
                names = {each.id for each in nodes if isinstance(each, ast.Name)}
                names |= {each.attr for each in nodes if isinstance(each, ast.Attribute)}
                for name in names - {function.name}:
                    found.setdefault(name, []).append((str(path.relative_to(ROOT)), function.name, first))
    return found


def relevant(mutant: Mutant, recorder: _Recorder, mentioned: Mapping[str, Sequence[tuple[str, str, int]]]) -> list[str]:
    """Return the tests that can notice a mutant, the nearest and fastest first; see the start of the module."""
    place = (mutant.path, mutant.function[1])
    tests = {test for test, called in recorder.calls.items() if place in called}
    constant = not mutant.function[0] or place in recorder.imported
    waiting, seen = list(mutant.names), set(mutant.names)
    while waiting and not tests and (constant or is_compiled(mutant)):
        found = [each for name in waiting for each in mentioned.get(name, ())]
        callers = {(path, line) for path, _, line in found}
        tests = {test for test, called in recorder.calls.items() if called & callers}
        waiting = list(dict.fromkeys(name for _, name, _ in found if name not in seen))
        seen.update(waiting)
    every = constant or (is_compiled(mutant) and not tests)
    ranked = sorted(recorder.calls, key=lambda test: (test not in tests, recorder.seconds[test], test))
    return [test for test in ranked if every or test in tests or (not tests and test in recorder.starts)]


def is_compiled(mutant: Mutant) -> bool:
    """Return whether numba may compile the mutated function, or the function prints or compiles what numba compiles."""
    return "/jit/" in mutant.path or "njit" in (ROOT / mutant.path).read_text(encoding="utf-8")


def survives(mutant: Mutant, tests: Sequence[str], longest: float) -> bool:
    """Return whether all `tests` pass on the mutant, within `longest` seconds."""
    # constants and functions compiled by numba: cached machine code of the unchanged source must not be used
    recompiled = not mutant.function[0] or is_compiled(mutant)
    scratch = tempfile.mkdtemp()
    child = os.fork()
    if child == 0:
        os.setsid()
        if recompiled:
            os.environ["NUMBA_CACHE_DIR"] = scratch
        Path(scratch, "sitecustomize.py").write_text(STARTUP.format(folder=str(Path(__file__).parent), mutant=mutant))
        os.environ["PYTHONPATH"] = os.pathsep.join([scratch, os.environ.get("PYTHONPATH", "")])
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 1)
        os.dup2(null, 2)
        status = 1
        try:
            sys.meta_path.insert(0, _Finder(mutant))
            status = int(pytest.main([*QUIET, "-m", "", *tests]))
        finally:
            os._exit(status)
    end = time.monotonic() + longest
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            break
        time.sleep(0.02)
    else:
        os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)
        status = 1
    shutil.rmtree(scratch, ignore_errors=True)
    return status == 0


def equivalent() -> dict[str, str]:
    """Return the mutants that cannot change a result, with the reasons."""
    lines = EQUIVALENT.read_text(encoding="utf-8").splitlines()
    rows = (line.split(" ## ", 1) for line in lines if line and not line.startswith("#"))
    return {key.strip(): reason.strip() for key, reason in rows}


def choose(files: Sequence[str], count: int, seed: int) -> list[Mutant]:
    """Return `count` mutants of the files. The choice depends only on the source and the seed."""
    every = [mutant for file in files for mutant in mutants(file)]
    return random.Random(seed).sample(every, min(count, len(every)))


def importers(changed: set[Path]) -> set[Path]:
    """Return the tests that import a file, or that import its package and mention what the file defines."""
    from benchmarks.sources import imports_of_files  # not by processes that tests start

    found = set()
    tests = {path: targets for path, targets in imports_of_files().items() if path.match("tests/*/test_*")}
    words = {path: set(re.findall(r"\w+", (ROOT / path).read_text(encoding="utf-8"))) for path in tests}
    for file in (each for each in changed if each.name != "__init__.py"):
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        public = {each.name for each in tree.body if isinstance(each, ast.FunctionDef | ast.ClassDef)}
        for path, targets in tests.items():
            if file in targets or (file.with_name("__init__.py") in targets and words[path] & public):
                found.add(path)
    return found


def run(package: str, only: str, count: int, seed: int, marks: Sequence[str]) -> tuple[int, list[Mutant], list[Mutant]]:
    """Test the mutants of a package. Return their number, the survivors, and the equivalent ones."""
    folder, patterns = PACKAGES[package]
    files = sorted(str(p.relative_to(ROOT)) for p in (ROOT / folder).rglob("*.py"))
    chosen = choose([f for f in files if only in f], count, seed)
    own = {path.relative_to(ROOT) for pattern in patterns for path in (ROOT / "tests").glob(f"**/{pattern}.py")}
    mentioned, known = mentions(folder), equivalent()
    left, same = dict(enumerate(chosen, 1)), list[Mutant]()
    for mark, further in itertools.product(marks, (False, True)):
        found = importers({Path(mutant.path) for mutant in left.values()}) - own if further else own
        tests = sorted(str(path) for path in found if path.parent.name != "peers")
        if not left or not tests:
            continue
        print(f"{package}: {len(left)} mutants; recording {len(tests)} test files ({mark})", flush=True)
        recorder = record(folder, tests, mark)
        for number, mutant in list(left.items()):
            covering = relevant(mutant, recorder, mentioned)
            longest = LONGEST + 5 * sum(recorder.seconds[test] for test in covering)
            start = time.perf_counter()
            word = "left"
            if covering and not survives(mutant, covering, longest):
                del left[number]
                word = "detected"
            elif mutant.key in known:
                same.append(left.pop(number))
                word = "equivalent"
            change = f"{mutant.before}  ->  {mutant.after}".replace("\n", " ")
            print(f"{number:4} {word:10} {time.perf_counter() - start:5.1f} s of {len(covering):4} tests  "
                  f"{mutant.path}:{mutant.line} {mutant.function[0]}: {change}", flush=True)  # fmt: skip
    return len(chosen), list(left.values()), same


def _has(folder: str, part: str) -> bool:
    return any(part in str(path.relative_to(ROOT)) for path in (ROOT / folder).rglob("*.py"))


def main() -> None:
    """Print the surviving mutants. The exit status is 1 if there are any."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("packages", nargs="*", metavar="package", help=f"one of {', '.join(PACKAGES)} [all]")
    parser.add_argument("--count", type=int, default=40, help="number of mutants of each package [%(default)s]")
    parser.add_argument("--seed", type=int, default=0, help="seed of the random choice of mutants [%(default)s]")
    parser.add_argument("--only", default="", help="mutate only files whose path contains this text")
    parser.add_argument("--quick", action="store_true", help="omit slow tests")
    options = parser.parse_args()
    unknown = [name for name in options.packages if name not in PACKAGES]
    if unknown:
        parser.error(f"{', '.join(unknown)}: no such package; expected packages among {', '.join(PACKAGES)}")
    sys.path[:0] = [str(ROOT)]
    os.chdir(ROOT)
    for name in HEAVY:
        importlib.import_module(name)
    packages = options.packages or [name for name, (folder, _) in PACKAGES.items() if _has(folder, options.only)]
    marks = (QUICK,) if options.quick else (QUICK, SLOW)
    results = {package: run(package, options.only, options.count, options.seed, marks) for package in packages}
    print()
    for package, (tried, survivors, same) in results.items():
        print(f"{package}: {tried} mutants, {tried - len(survivors) - len(same)} detected, {len(same)} equivalent")
        for mutant in survivors:
            print(f"  survived  {mutant.key}  (line {mutant.line})")
    sys.exit(any(survivors for _, survivors, _ in results.values()))


if __name__ == "__main__":
    main()
