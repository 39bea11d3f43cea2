"""The last line of a page of figures: where it was measured, and a digest of the code that it measures."""

from __future__ import annotations

import ast
import hashlib
import os
import re
import subprocess
from functools import cache
from pathlib import Path

from .sources import ROOT, files, imports, is_module

_STAMP = re.compile(r"^Measured at commit \S+ on .*; digest of the measured code: ([0-9a-f]{16})\.$", re.MULTILINE)
_RUNTIME = Path("generated/gac_runtime")
_C = ("gac_runtime.c", "gac_runtime.h", "extension.c")


def stamped(text: str, command: str) -> str:
    """Return the text of a page with the stamp of a command that measures now, on this machine."""
    from .machine import processor

    place = f"{processor()}, {os.cpu_count()} processors"
    return f"{text.rstrip()}\n\n{stamp(command, _commit(), place)}\n"


def stamp(command: str, commit: str, place: str, root: Path = ROOT) -> str:
    """Return the stamp of a command for a commit, which is checked out at `root`."""
    return f"Measured at commit {commit} on {place}; digest of the measured code: {digest(command, root)}."


def is_outdated(text: str, command: str) -> bool:
    """Whether a page has no stamp, or the code that it measures has changed since."""
    found = _STAMP.search(text)
    return found is None or found[1] != digest(command)


def digest(command: str, root: Path = ROOT) -> str:
    """Return a digest of the code that a command measures: what it imports of the project, without docstrings.

    The compiler counts only if the module of the command imports it. The C of generated modules and of their runtime
    counts too.
    """
    texts = [f"{path}\n{_code(path, root)}" for path in measured(command, root)]
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]


def measured(command: str, root: Path = ROOT) -> list[Path]:
    """Return the files whose code a command measures, sorted."""
    start = Path("benchmarks", f"{command}.py")
    folders = {"benchmarks", "generated", "algorithms"}
    if any(path.parts[0] == "gacompiler" for path in _imports(start, root)):
        folders.add("gacompiler")
    found, waiting = {start}, [start]
    while waiting:
        new = {path for path in _imports(waiting.pop(), root) if path.parts[0] in folders} - found
        found |= new
        waiting += new
    return sorted(path for path in found if path.parts[0] != "benchmarks" or path == start)


@cache
def _imports(path: Path, root: Path) -> set[Path]:
    return imports(path, _files(root), root)


_files = cache(files)


@cache
def _code(path: Path, root: Path) -> str:
    """Return what determines the machine code of a file: for generated modules their C, else the syntax tree."""
    c_file = root / path.with_suffix(".c")
    if is_module(path) and c_file.is_file():
        return c_file.read_text()
    if path.parent == _RUNTIME and path.stem == "__init__":
        return "".join(
            (root / _RUNTIME / name).read_text() for name in ("gac_runtime.c", "gac_runtime.h", "extension.c")
        )
    tree = ast.parse((root / path).read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [line for line in node.body if not _is_text(line)]
    return ast.dump(tree)


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _commit() -> str:
    command = ["git", "describe", "--always", "--dirty=-with-changes", "--exclude=*"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    return done.stdout.strip() or "unknown"
