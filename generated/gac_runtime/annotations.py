"""Types for annotations and for the stubs of generated modules; nothing here is used when a program runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[Any]
"""An array of floats, in the precision of the arguments."""

_Number: TypeAlias = float | np.number[Any] | np.bool_
_Row: TypeAlias = Sequence[_Number | Array]
Numbers: TypeAlias = _Number | Array | _Row | Sequence[_Row] | Sequence[Sequence[_Row]]
"""Numbers, arrays, and nested sequences of them.

`numpy.typing.ArrayLike` also accepts texts and whatever numpy reads as an array, such as a motor in place of a point.
The depth is limited, since a text is a sequence of texts.
"""

if TYPE_CHECKING:

    class Real(NDArray[Any], float):  # type: ignore[misc]
        """A float for one element, an array of floats for several; it may be used as both."""

        def __getitem__(self, key: Any, /) -> Any: ...
        def __iter__(self) -> Iterator[Any]: ...
        def __add__(self, other: Numbers, /) -> Real: ...  # type: ignore[override]
        def __radd__(self, other: Numbers, /) -> Real: ...  # type: ignore[override]
        def __sub__(self, other: Numbers, /) -> Real: ...  # type: ignore[override]
        def __rsub__(self, other: Numbers, /) -> Real: ...  # type: ignore[override]
        def __mul__(self, other: Numbers, /) -> Real: ...  # type: ignore[override]
        def __rmul__(self, other: Numbers, /) -> Real: ...  # type: ignore[override]
        def __truediv__(self, other: Numbers, /) -> Real: ...  # type: ignore[override]
        def __rtruediv__(self, other: Numbers, /) -> Real: ...  # type: ignore[override]
        def __pow__(self, other: Numbers, mod: None = None, /) -> Real: ...  # type: ignore[override]
        def __neg__(self) -> Real: ...
        def __abs__(self) -> Real: ...

    class Truth(NDArray[np.bool_], bool):  # type: ignore[misc]
        """A bool for one element, an array of bools for several; it may be used as both."""

else:
    Real = Truth = Any


class Stored(Protocol):
    """An element or several: objects of `gacompiler.objects`, and values of generated modules."""

    @property
    def stored(self) -> tuple[Array, Any]:
        """The coefficients and their layout, which is of a class of its own in each copy of this package."""


class Elements(Stored, Protocol):
    """A multivector with numbers as coefficients, or an array of these, as in `gacompiler.objects`."""

    def reshape(self, *shape: Any) -> Any:
        """Return the same elements in another shape; single values of generated modules have none."""

    def like(self, layout: Any, values: Any) -> Any:
        """Return elements of the same kind from a layout and coefficients."""


class Tensor(Protocol):
    """An array of torch, jax or cupy."""

    def __dlpack__(self, *, stream: Any = None) -> Any: ...


E = TypeVar("E", bound=Elements)
T = TypeVar("T", bound=Tensor)
