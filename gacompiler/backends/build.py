"""Build generated C files: `gac_runtime.build`, whose errors are this package's here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

from ..errors import BackendError
from ..gac_runtime import build as _build
from ..gac_runtime.build import compiler_flags, find_compiler, library_name, no_compiler, processors
from ..gac_runtime.cache import RuntimeProblem
from ..gac_runtime.names import FLAGS, GCC_FLAGS

__all__ = [
    "FLAGS",
    "GCC_FLAGS",
    "build_extension",
    "build_for_level",
    "build_libraries",
    "build_library",
    "build_module",
    "compiler_flags",
    "find_compiler",
    "library_name",
    "library_path",
    "no_compiler",
    "processors",
]

P = ParamSpec("P")
R = TypeVar("R")


def _raising(function: Callable[P, R]) -> Callable[P, R]:
    """`function`, with a `BackendError` for what it raises."""

    @wraps(function)
    def raising(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return function(*args, **kwargs)
        except RuntimeProblem as error:
            raise BackendError(error.where, error.found, error.expected, error.remedy) from error

    return raising


library_path = _raising(_build.library_path)
build_module = _raising(_build.build_module)
build_extension = _raising(_build.build_extension)


@_raising
def build_libraries(
    c_paths: Sequence[Path],
    *,
    force: bool = False,
    portable: bool = False,
    progress: Callable[[Path], None] = lambda library: None,
) -> list[Path | None]:
    """Compile C files whose libraries are not there, on all processors.

    Parameters
    ----------
    c_paths : sequence of Path
        Generated C files; the header of each is beside it.
    force : bool
        Compile even if the library is there.
    portable : bool
        Compile for every machine, with loops for each width of vectors, instead of for machines like this one.
    progress : callable
        Called with each library that has been compiled.

    Returns
    -------
    list of Path or None
        The library of each, or None where it is not there and neither is a compiler (`no_compiler` says why).

    Raises
    ------
    BackendError
        When a file cannot be read, a folder not be written, or the compiler fails; the other files are built.

    Notes
    -----
    The extension that calls kernels is built beside them, if the headers of Python are there.
    """
    return _build.build_modules(c_paths, force=force, portable=portable, progress=progress)


@_raising
def build_for_level(targets: dict[Path, Path], level: int, progress: Callable[[Path], None]) -> None:
    """Compile C files into the libraries named for each, for the machines of a level; as `build_libraries` else."""
    _build.build(targets, progress, level)


def build_library(c_path: Path, *, force: bool = False) -> Path | None:
    """Compile `c_path` unless its library is there; as `build_libraries` of one file."""
    return build_libraries([c_path], force=force)[0]
