"""The compiled C library of a generated module, which is built when it is first needed."""

from __future__ import annotations

import contextlib
import importlib.util
import os
from pathlib import Path
from typing import Any

import numpy as np

from .cache import CacheError, RuntimeProblem, cache_folder
from .foreign import LOCK, Loop, foreign
from .names import FOLDER, library_files, lower_library_files

_SUFFIX = {4: "f32", 8: "f64"}


class Library:
    """A library, opened when its first function is wanted.

    Attributes
    ----------
    label : str
        Name of the module, with which the names of its functions begin, and digest of its C file: ``pga3-0123...``.
    c_file : Path
        What it is compiled from.
    """

    def __init__(self, label: str, c_file: Path) -> None:
        self.label, self.c_file = label, c_file
        self._opened: Any = None

    def find(self) -> Path | None:
        """The library where it is built: beside the module or in the user's cache.

        It is one for this machine or for all. One for a lower level is taken where none can be built for this machine,
        as from a wheel that has only that.
        """
        names = library_files(self.label, Path(__file__).parent)
        found = self._beside(names)
        if found is not None:
            return found
        with contextlib.suppress(CacheError):
            folder = cache_folder("libraries")
            # A digest of the compiler follows, of hexadecimal digits: the "v" of a level is none.
            patterns = [f"{name.removesuffix('.so')}-[0-9a-f]*.so" for name in names]
            cached = [path for pattern in patterns for path in sorted(folder.glob(pattern))]
            if cached:
                return cached[0]
        lower = self._beside(lower_library_files(self.label, Path(__file__).parent))
        return lower if lower is not None and not self.can_be_built() else None

    def _beside(self, names: tuple[str, ...]) -> Path | None:
        """The first of these files that is beside the module."""
        places = (self.c_file.parent / FOLDER / name for name in names)
        return next((path for path in places if path.exists()), None)

    def can_be_built(self) -> bool:
        """Whether there are its C file and a compiler."""
        if not self.c_file.exists():
            return False
        from .build import find_compiler

        return find_compiler() is not None

    def open(self) -> None:
        """Build the library if it is not there, and open it.

        Raises
        ------
        RuntimeProblem
            When it cannot be built or loaded.
        """
        import ctypes

        with LOCK:
            if self._opened is not None:
                return
            path = self.find()
            if path is None:
                path = self._build()
            if path is None or not path.name.startswith(f"{self.label}-"):
                found = "it is not what the module was generated with" if path else "no library and no C compiler"
                raise RuntimeProblem(str(self.c_file), found, "the file of this module", "generate both again")
            try:
                opened = ctypes.CDLL(str(path))
            except OSError as error:
                remedy = f"delete {path}, or set GAC_BACKEND=numba"
                raise RuntimeProblem(str(path), str(error), "a library for this machine", remedy) from None
            # The name says which machines it is for; the library knows.
            runs_here = getattr(opened, "gac_runs_here", None)
            if runs_here is not None and not runs_here():
                remedy = f"delete {path} and run `gac build --portable`, or set GAC_BACKEND=numba"
                raise RuntimeProblem(
                    str(path), "this processor lacks its instructions", "a library for this machine", remedy
                )
            self._opened = opened

    def _build(self) -> Path | None:
        """Build the library, and the extension for the processes to come."""
        from .build import build_extension, build_module

        path = build_module(self.c_file)
        if path is not None:
            with contextlib.suppress(RuntimeProblem):
                build_extension(self.c_file.parent if path.parent.name == FOLDER else cache_folder())
        return path

    def address(self, function: str) -> int:
        """The address of a function; the library is open."""
        import ctypes

        symbol = getattr(self._opened, f"{self.label.rpartition('-')[0]}_{function}")
        address = ctypes.cast(symbol, ctypes.c_void_p).value
        assert address is not None
        return address

    def loop_addresses(self, kernel: str) -> list[tuple[int, int, int]]:
        """The addresses of the loops of doubles and of floats, as the extension takes them."""
        return [(self.address(f"{kernel}_loop_{_SUFFIX[size]}"), 0, 0) for size in (8, 4)]

    def loop(self, kernel: str, dtype: np.dtype[Any]) -> Loop:
        """The loop over batches of one type."""
        address = self.address(f"{kernel}_loop_{_SUFFIX[dtype.itemsize]}")
        return foreign().cast("void(*)(void *, void *, void *)", address)  # type: ignore[no-any-return]


def chosen_backend(library: Library) -> str:
    """``c`` if the library is built or can be, else that of `without_library`, unless GAC_BACKEND says otherwise.

    Raises
    ------
    ImportError
        When GAC_BACKEND is no backend, or asks for a library that is not there and cannot be built.
    """
    chosen = os.environ.get("GAC_BACKEND", "")
    if chosen not in ("", "c", "numba", "arrays"):
        raise ImportError(f"GAC_BACKEND: {chosen!r}; expected c, numba or arrays")
    if chosen == "numba" and without_library() != "numba":
        raise ImportError("GAC_BACKEND=numba, but numba is not installed; install it, or unset GAC_BACKEND")
    if chosen in ("numba", "arrays"):
        return chosen
    if library.find() is not None or library.can_be_built():
        return "c"
    if chosen == "c":
        raise ImportError(
            f"GAC_BACKEND=c, but the library of {library.c_file} is not built, and there is no C compiler; "
            "install one and run `gac build`, or unset GAC_BACKEND"
        )
    return without_library()


def without_library() -> str:
    """What runs kernels where there is no library: ``numba``, or ``arrays`` where that is not installed."""
    return "numba" if importlib.util.find_spec("numba") else "arrays"
