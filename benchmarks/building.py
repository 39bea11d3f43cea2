"""Measure the time to compile the C of the generated modules, and the sizes of the libraries."""

from __future__ import annotations

import importlib
import shutil
import tempfile
import time
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

from gacompiler.backends.build import build_libraries, find_compiler

from .affinity import on_processors


@dataclass(frozen=True, slots=True)
class LibrarySize:
    """The sizes of the C source of a module and of its library, in bytes."""

    module: str
    source: int
    library: int


@dataclass(frozen=True, slots=True)
class Building:
    """Times and sizes of a build.

    Attributes
    ----------
    cold : float
        Seconds to build all libraries from scratch, on all processors.
    again : float
        Seconds to find that nothing has changed.
    libraries : tuple of LibrarySize
    """

    cold: float
    again: float
    libraries: tuple[LibrarySize, ...]


def building(modules: Iterable[str], processors: Collection[int], progress: Callable[[str], None]) -> Building | None:
    """Compile the C of these modules in a temporary folder. Return None if there is no compiler.

    Parameters
    ----------
    modules : iterable of str
    processors : collection of int
        The processors that the compiler may use; empty if the system does not report them.
    progress : function of str
        Called with the name of the next step.
    """
    if find_compiler() is None:
        return None
    progress("C build")
    with tempfile.TemporaryDirectory() as folder, on_processors(processors):
        paths = []
        for name in modules:
            file = importlib.import_module(f"generated.{name}").__file__
            assert file is not None
            for ending in (".h", ".c"):
                paths.append(Path(shutil.copy(Path(file).with_suffix(ending), folder)))
        sources = paths[1::2]
        begin = time.perf_counter()
        libraries = build_libraries(sources)
        cold = time.perf_counter() - begin
        build_libraries(sources)
        again = time.perf_counter() - begin - cold
        sizes = [
            LibrarySize(source.stem, source.stat().st_size, library.stat().st_size)
            for source, library in zip(sources, libraries, strict=True)
            if library is not None
        ]
    return Building(cold, again, tuple(sizes))
