"""Protocol of numeric objects for functions that `MultivectorArray` uses, and that therefore cannot import it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol, Self

import numpy as np

from ..algebra.layout import Layout


class Elements(Protocol):
    """A multivector, or an array of them, with numbers as coefficients."""

    @property
    def layout(self) -> Layout:
        """The layout of every element."""

    @property
    def values(self) -> np.ndarray[Any, Any]:
        """The stored coefficients, along the last axis."""

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape without the axis of coefficients."""

    @property
    def ndim(self) -> int:
        """The number of axes of `shape`."""

    def reshape(self, *shape: Any) -> Self:
        """Return the same elements in another shape."""

    def __len__(self) -> int: ...

    def __iter__(self) -> Iterator[Any]: ...

    def __getitem__(self, key: Any) -> Any: ...
