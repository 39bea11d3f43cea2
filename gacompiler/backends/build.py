"""Build generated C files: the functions of `gac_runtime.build`, with errors converted to `BackendError`."""

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
    """Wrap a function so that it raises `BackendError` instead of `RuntimeProblem`."""

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
    only: str = "",
    progress: Callable[[Path], None] = lambda library: None,
) -> list[Path | None]:
    """Compile C files whose libraries do not exist yet, in parallel on all processors.

    Parameters
    ----------
    c_paths : sequence of Path
        Generated C files; the header of each must be in the same folder.
    force : bool
        Compile even if the library exists.
    portable : bool
        Compile for all machines, with loops for each vector width, instead of for machines like this one.
    only : str
        The precision whose functions suffice, "f64" or "f32"; empty for both.
    progress : callable
        Called with the path of each compiled library.

    Returns
    -------
    list of Path or None
        The library of each file, or None if it does not exist and there is no compiler (`no_compiler` gives the
        reason).

    Raises
    ------
    BackendError
        If a file cannot be read, a folder cannot be written, or the compiler fails; the other files are built.

    Notes
    -----
    The extension module that calls kernels is built in the same folder if the headers of Python are installed.
    """
    return _build.build_modules(c_paths, force=force, portable=portable, only=only, progress=progress)


@_raising
def build_for_level(targets: dict[Path, Path], level: int, progress: Callable[[Path], None]) -> None:
    """Compile C files to the given libraries for a processor level; see `build_libraries`."""
    _build.build(targets, progress, level)


def build_library(c_path: Path, *, force: bool = False) -> Path | None:
    """Compile a C file unless its library exists; see `build_libraries`."""
    return build_libraries([c_path], force=force)[0]
