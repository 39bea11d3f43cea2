"""What the compiler is: a digest of the sources that decide what is compiled and printed, and of what they run on."""

from __future__ import annotations

import hashlib
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
"""What decides which program a kernel gets, and how it is kept."""
TEXT_SOURCES = (*PROGRAM_SOURCES, "backends", "gac_runtime")
"""What decides how it is printed too: printers ask the runtime what it understands."""

_PACKAGE = Path(__file__).parent.parent


@cache
def fingerprint(sources: tuple[str, ...] = TEXT_SOURCES) -> str | None:
    """A digest of files and folders of this package, and of the versions of Python and of the libraries that they use.

    None when it is not known which sources this process runs: they are not there, or were changed after it began.
    """
    found = digest(_PACKAGE, sources, LOADED)
    if found is None:
        return None
    versions = (platform.python_implementation(), platform.python_version(), mpmath.__version__, mpmath.libmp.BACKEND)
    return hashlib.sha256(repr((found, versions, jinja2.__version__)).encode()).hexdigest()


def digest(root: Path, names: Iterable[str], newest: int) -> str | None:
    """A digest of the names and contents of files below `root`; None if there is none, or one is newer than `newest`.

    Parameters
    ----------
    root : Path
    names : iterable of str
        Files and folders in `root`; folders with all that is in them.
    newest : int
        In nanoseconds.
    """
    whole, n_files = hashlib.sha256(), 0
    for path in _files(root, names):
        content = path.read_bytes()
        whole.update(f"{path.relative_to(root).as_posix()}\n{len(content)}\n".encode())
        whole.update(content)
        n_files += 1
        if path.stat().st_mtime_ns > newest:
            return None
    return whole.hexdigest() if n_files else None


def _files(root: Path, names: Iterable[str]) -> Iterator[Path]:
    for name in names:
        paths = [root / name] if (root / name).is_file() else sorted((root / name).rglob("*"))
        yield from (path for path in paths if path.is_file() and "__pycache__" not in path.parts)
