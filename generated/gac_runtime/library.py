"""The compiled C library of a generated module."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from .foreign import Loop, foreign

_SUFFIX = {4: "f32", 8: "f64"}


class Library:
    """A library, opened when its first function is wanted.

    Attributes
    ----------
    name : str
        The name of the module, with which the names of its functions begin.
    path : str
        The file.
    """

    def __init__(self, name: str, path: str) -> None:
        self.name, self.path = name, path
        self._opened: Any = None

    @property
    def is_built(self) -> bool:
        """Whether the file is there."""
        return os.path.exists(self.path)

    def address(self, function: str) -> int:
        """The address of a function.

        Raises
        ------
        ImportError
            When the library cannot be loaded.
        """
        import ctypes

        if self._opened is None:
            try:
                self._opened = ctypes.CDLL(self.path)
            except OSError as error:
                raise ImportError(f"{error}; build it again with `gac build`, or set GAC_BACKEND=numba") from None
        address = ctypes.cast(getattr(self._opened, f"{self.name}_{function}"), ctypes.c_void_p).value
        assert address is not None
        return address

    def loop_addresses(self, kernel: str) -> list[tuple[int, int, int]]:
        """The addresses of the loops of doubles and of floats, as the extension takes them."""
        return [(self.address(f"{kernel}_loop_{_SUFFIX[size]}"), 0, 0) for size in (8, 4)]

    def loop(self, kernel: str, dtype: np.dtype[Any]) -> Loop:
        """The loop over batches of one type."""
        address = self.address(f"{kernel}_loop_{_SUFFIX[dtype.itemsize]}")
        return foreign().cast("void(*)(void *, void *, void *)", address)  # type: ignore[no-any-return]
