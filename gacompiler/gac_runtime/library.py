"""The compiled C library of a generated module, which is built on first use, one precision at a time."""

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
    """The library of a module, which is opened on first use.

    Attributes
    ----------
    label : str
        Name of the module, which is the prefix of its functions, and digest of its C file: ``pga3-0123...``.
    c_file : Path
        The C file from which it is compiled.
    """

    def __init__(self, label: str, c_file: Path) -> None:
        self.label, self.c_file = label, c_file
        self._opened: dict[str, Any] = {}

    def find(self, precision: str = "f64") -> Path | None:
        """Return the path of the built library, next to the module or in the user's cache; None if it is not built.

        The library is one for this machine or a portable one. A library for a lower level is used if none can be built
        for this machine, for example if a wheel contains no other. One for both precisions is preferred.
        """
        for only in ("", precision):
            names = library_files(self.label, Path(__file__).parent, only)
            found = self._beside(names)
            if found is not None:
                return found
            with contextlib.suppress(CacheError):
                folder = cache_folder("libraries")
                # The name continues with a digest of the compiler, which cannot be mistaken for "v4" or "f64".
                patterns = [f"{name.removesuffix('.so')}-[0-9a-f]*.so" for name in names]
                cached = [path for pattern in patterns for path in sorted(folder.glob(pattern))]
                if cached:
                    return cached[0]
        lower = self._beside(lower_library_files(self.label, Path(__file__).parent))
        return lower if lower is not None and not self.can_be_built() else None

    def _beside(self, names: tuple[str, ...]) -> Path | None:
        """Return the first of these files that exists next to the module."""
        places = (self.c_file.parent / FOLDER / name for name in names)
        return next((path for path in places if path.exists()), None)

    def can_be_built(self) -> bool:
        """Whether the C file and a compiler exist."""
        if not self.c_file.exists():
            return False
        from .build import find_compiler

        return find_compiler() is not None

    def open(self, precision: str = "f64") -> Any:
        """Return the open library that contains the functions of a precision, after building it if necessary.

        Raises
        ------
        RuntimeProblem
            If it cannot be built or loaded.
        """
        with LOCK:
            if precision not in self._opened:
                self._open(precision)
            return self._opened[precision]

    def _open(self, precision: str) -> None:
        import ctypes

        path = self.find(precision)
        if path is None:
            path = self._build(precision)
        if path is None or not path.name.startswith(f"{self.label}-"):
            found = "its text is not that of the generated module" if path else "no library and no C compiler"
            expected = f"the C file of this module, compiled for {precision}"
            remedy = "regenerate both files" if path else "install a compiler, or copy what `gac build --floats` builds"
            raise RuntimeProblem(str(self.c_file), found, expected, remedy)
        try:
            opened = ctypes.CDLL(str(path))
        except OSError as error:
            remedy = f"delete {path}, or set GAC_BACKEND=numba"
            raise RuntimeProblem(str(path), str(error), "a library for this machine", remedy) from None
        # The level in the file name may be wrong; the library itself checks the processor.
        runs_here = getattr(opened, "gac_runs_here", None)
        if runs_here is not None and not runs_here():
            remedy = f"delete {path} and run `gac build --portable`, or set GAC_BACKEND=numba"
            raise RuntimeProblem(
                str(path), "this processor lacks its instructions", "a library for this machine", remedy
            )
        both = not path.stem.endswith(("-f64", "-f32"))
        self._opened |= dict.fromkeys(("f64", "f32") if both else (precision,), opened)

    def _build(self, precision: str) -> Path | None:
        """Build the library, and the extension for later processes."""
        from .build import build_extension, build_module

        path = build_module(self.c_file, precision)
        if path is not None:
            with contextlib.suppress(RuntimeProblem):
                build_extension(self.c_file.parent if path.parent.name == FOLDER else cache_folder())
        return path

    def address(self, function: str) -> int:
        """Return the address of a function; the first one of floats may open, and build, another library.

        Raises
        ------
        RuntimeProblem
            If that library cannot be built or loaded.
        """
        import ctypes

        library = self.open("f32" if function.endswith("_f32") else "f64")
        symbol = getattr(library, f"{self.label.rpartition('-')[0]}_{function}")
        address = ctypes.cast(symbol, ctypes.c_void_p).value
        assert address is not None
        return address

    def loop_addresses(self, kernel: str) -> list[tuple[int, int, int]]:
        """Return the addresses of the loops for doubles and for floats, in the form that the extension expects.

        The second is 0 as long as no library for floats is open.
        """
        floats = self.address(f"{kernel}_loop_f32") if "f32" in self._opened else 0
        return [(self.address(f"{kernel}_loop_f64"), 0, 0), (floats, 0, 0)]

    def loop(self, kernel: str, dtype: np.dtype[Any]) -> Loop:
        """Return the loop over batches of one dtype."""
        address = self.address(f"{kernel}_loop_{_SUFFIX[dtype.itemsize]}")
        return foreign().cast("void(*)(void *, void *, void *)", address)  # type: ignore[no-any-return]


def chosen_backend(library: Library) -> str:
    """Return the backend selected by GAC_BACKEND, or a default.

    The default is ``c`` if the library is built or can be built, else the result of `without_library`.

    Raises
    ------
    ImportError
        If GAC_BACKEND is not a backend, or selects a backend that is not available.
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
    """Return the fallback backend without a library: ``numba``, or ``arrays`` if numba is not installed."""
    return "numba" if importlib.util.find_spec("numba") else "arrays"
