"""Fingerprint of the compiler: a digest of the sources that determine its output, and of their dependencies."""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import jinja2
import mpmath

from ..load_time import LOADED

PROGRAM_SOURCES = (
    *("errors.py", "algebra", "rings", "structure", "frontend", "ir", "passes", "generation"),
    "backends/module.py",
)
"""Sources that determine the program of a kernel and how it is stored."""
TEXT_SOURCES = (*PROGRAM_SOURCES, "backends", "gac_runtime")
"""Sources that determine the printed text too. The runtime is included because the printers depend on its formats."""

_PACKAGE = Path(__file__).parent.parent


@cache
def fingerprint(sources: tuple[str, ...] = TEXT_SOURCES) -> str | None:
    """Compute a digest of files and folders of this package, and of the versions of Python and of the libraries used.

    Return None if it is not known which sources this process runs, because they are missing or were changed after it
    started.
    """
    found = digest(_PACKAGE, sources, LOADED)
    if found is None:
        return None
    versions = (platform.python_implementation(), platform.python_version(), mpmath.__version__, mpmath.libmp.BACKEND)
    return hashlib.sha256(repr((found, versions, jinja2.__version__)).encode()).hexdigest()


@cache
def stamp(sources: tuple[str, ...]) -> str | None:
    """Compute a digest of the names, sizes and times of files of this package, which reads none of them.

    It differs between copies of the same sources. Return None under the same conditions as `fingerprint`, and if a file
    vanishes meanwhile.
    """
    try:
        states = [(path, os.stat(path)) for path in _paths(str(_PACKAGE), sources)]
    except OSError:  # a file that has just been removed
        return None
    if not states or any(state.st_mtime_ns > LOADED for _, state in states):
        return None
    rows = [(path, state.st_size, state.st_mtime_ns, state.st_ctime_ns) for path, state in states]
    return hashlib.sha256(repr((rows, platform.python_version(), mpmath.__version__)).encode()).hexdigest()


def digest(root: Path, names: Iterable[str], newest: int) -> str | None:
    """Compute a digest of the names and contents of files below `root`.

    Return None if there are no files, or if one was modified after `newest`.

    Parameters
    ----------
    root : Path
    names : iterable of str
        Files and folders in `root`; folders are included with all their contents.
    newest : int
        A modification time in nanoseconds.
    """
    whole, n_files = hashlib.sha256(), 0
    for path in map(Path, _paths(str(root), names)):
        content = path.read_bytes()
        whole.update(f"{path.relative_to(root).as_posix()}\n{len(content)}\n".encode())
        whole.update(content)
        n_files += 1
        if path.stat().st_mtime_ns > newest:
            return None
    return whole.hexdigest() if n_files else None


def _paths(root: str, names: Iterable[str]) -> Iterator[str]:
    for name in names:
        path = os.path.join(root, name)
        if os.path.isfile(path):
            yield path
        for folder, folders, files in os.walk(path):
            folders[:] = sorted(set(folders) - {"__pycache__"})
            paths = (os.path.join(folder, file) for file in sorted(files))
            yield from filter(os.path.isfile, paths)  # locks of editors are links that lead nowhere
