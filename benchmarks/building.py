"""How long it takes to compile the C of the generated modules, and how large the libraries are."""

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
    """Bytes of the C of a module, and of its library."""

    module: str
    source: int
    library: int


@dataclass(frozen=True, slots=True)
class Building:
    """What was measured.

    Attributes
    ----------
    cold : float
        Seconds from nothing to all libraries, on all processors.
    again : float
        Seconds where nothing has changed.
    """

    cold: float
    again: float
    libraries: tuple[LibrarySize, ...]


def building(modules: Iterable[str], processors: Collection[int], progress: Callable[[str], None]) -> Building | None:
    """Compile the C of these modules in a folder of their own; None where there is no compiler.

    Parameters
    ----------
    modules : iterable of str
    processors : collection of int
        Those that the compiler may use; empty where the system does not say.
    progress : function of str
        Called with what comes next.
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
