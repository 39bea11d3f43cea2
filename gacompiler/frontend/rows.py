"""Arrays whose length is known only when a kernel runs, as parameters and as values during tracing.

``array(PGA3.LINE, "n")`` is an array of n lines. A kernel with such a parameter contains loops (`frontend.loops`). The
same function can be traced with arrays of known lengths, `Unrolled`; the result is an ordinary kernel without loops.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Any, NoReturn

from ..algebra.layout import Layout
from ..errors import KernelError
from ..ir.procedure import Place
from ..ir.rows import Counter, Numbered, Row, Shifted, Through, row_at


@dataclass(frozen=True, slots=True)
class RowsOf:
    """The type of an array of rows. Each row is an element of `layout`, or an array of elements of the given shape.

    Attributes
    ----------
    layout : Layout
    lengths : tuple of str
        The names of the leading axes, ``("n",)``.
    shape : tuple of int
        The shape of a row, without the blade axis.
    shared : bool
        Whether all elements of a batch share one array, as the configurations of a robot share its axes.
    """

    layout: Layout
    lengths: tuple[str, ...]
    shape: tuple[int, ...] = ()
    shared: bool = False

    def __str__(self) -> str:
        return f"array({', '.join([str(self.layout), *map(repr, self.lengths), *map(str, self.shape)])})"


@dataclass(frozen=True, slots=True)
class IndexOf:
    """The type of an index table of length `length`: entries are row indices in arrays of length `into`, or -1.

    All elements of a batch share an index table. If `columns` is not 0, each row has so many entries.
    """

    length: str
    into: str
    columns: int = 0

    def __str__(self) -> str:
        parts = [repr(self.length), *([str(self.columns)] if self.columns else [])]
        parts += [repr(self.into)] if self.into != self.length else []
        return f"index({', '.join(parts)})"


@dataclass(frozen=True, slots=True)
class Leaf:
    """A multivector in a row of a table: its layout, and the offset of its first coefficient in the row."""

    layout: Layout
    start: int


class Array:
    """Base class of arrays of rows, which raises an error for any arithmetic on whole arrays."""

    __slots__ = ()

    def refuse(self, *_: Any) -> NoReturn:
        """Raise the error that an array cannot be used in an expression."""
        raise KernelError(
            "a kernel with loops",
            "an array of rows in an expression",
            "a loop over its rows",
            "use each(lambda row: ..., rows), fold, scan or total, or pick(rows, number, otherwise) for one row",
        )

    __array_ufunc__ = None  # so that a numpy number as the left operand defers to the array
    _takes_over_multivector = True

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = refuse
    __neg__ = __pos__ = __xor__ = __rxor__ = __and__ = __rand__ = __invert__ = __getitem__ = __pow__ = refuse
    __lt__ = __le__ = __gt__ = __ge__ = refuse

    def __bool__(self) -> bool:
        self.refuse()

    def __len__(self) -> int:
        raise KernelError(
            "a kernel with loops",
            "len() of an array of rows",
            "an expression, since the number is known only when the kernel runs",
            "use total(lambda row: 1, rows)",
        )

    def __iter__(self) -> Iterator[Any]:
        self.refuse()


@dataclass(frozen=True, slots=True)
class Index(Array):
    """An index table, or one of its columns, during the tracing of a kernel with loops."""

    name: str
    length: str
    into: str
    column: int = 0


@dataclass(frozen=True, slots=True)
class Shift:
    """The rows of an axis as neighbours of others, see `ir.procedure.Shifted`."""

    by: int
    boundary: str
    stride: int
    start: str

    def at(self, loop: str) -> Shifted:
        """Return the row in the current iteration of a loop."""
        return Shifted(loop, self.by, self.boundary, self.stride, self.start)


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis of a table that is an axis of an array, too.

    Attributes
    ----------
    length : str
        The name of the length of the array along the axis.
    through : Index, optional
        If given, row i of the array is the row of the table that is given by entry i of this index table.
    shift : Shift, optional
        If given, row i of the array is a row of the table at a distance.
    """

    length: str
    through: Index | None = None
    shift: Shift | None = None


@dataclass(frozen=True, slots=True)
class Rows(Array):
    """An array over named lengths, during the tracing of a kernel with loops: some or all rows of a table.

    Attributes
    ----------
    table : str
        The name of the table that holds the coefficients.
    axes : tuple of Axis or Row
        For each axis of the table, an axis of the array, or the row that the array consists of.
    leaf : Leaf
        The multivector in each row of the table.
    order : tuple of int
        The axes of the table that are axes of the array, from the outermost loop over the array to the innermost.
    """

    table: str
    axes: tuple[Any, ...]
    leaf: Leaf
    order: tuple[int, ...]

    @classmethod
    def whole(cls, table: str, lengths: tuple[str, ...], leaf: Leaf) -> Rows:
        """Return the array of all rows of a table."""
        return cls(table, tuple(map(Axis, lengths)), leaf, tuple(range(len(lengths))))

    @property
    def lengths(self) -> tuple[str, ...]:
        """The names of the lengths of the array. A single row has none."""
        return tuple(self.axes[k].length for k in self.order)

    @property
    def length(self) -> str:
        """The name of the length over which a loop over the array iterates."""
        return self.lengths[0]

    def is_selected(self, axis: int = 0) -> bool:
        """Return whether index tables or distances select the rows of an axis, or another row stands for missing ones.

        Such rows cannot be selected again.
        """
        own = self.axes[self.order[axis]]
        shifts = [each if isinstance(each, Shifted) else getattr(each, "shift", None) for each in self.axes]
        return own.through is not None or own.shift is not None or any(each and each.start for each in shifts)

    @property
    def is_whole(self) -> bool:
        """Whether the array consists of all rows of its table, in their order."""
        return self == Rows.whole(self.table, self.lengths, self.leaf)

    @property
    def place(self) -> Place:
        """The row of the table that a single row consists of."""
        return Place(self.table, row_at(self.axes))

    @property
    def start(self) -> str:
        """The table whose only row stands for rows with computed numbers that do not exist, or an empty string."""
        return next((each.start for each in self.axes if isinstance(each, Numbered)), "")

    def at(self, row: Row) -> Rows:
        """Return a row of the array along its first axis, which is an array over the other axes."""
        first, *others = self.order
        axis = self.axes[first]
        if axis.through is not None and isinstance(row, Counter):
            row = Through(axis.through.name, row.loop, axis.through.column)
        if axis.shift is not None and isinstance(row, Counter):
            row = axis.shift.at(row.loop)
        return self._with(first, row, tuple(others))

    def numbered(self, number: str, start: str) -> Rows:
        """Return the row of the array whose number is computed, see `ir.procedure.Numbered`."""
        first, *others = self.order
        return self._with(first, Numbered(number, start), tuple(others))

    def gathered(self, index: Index) -> Rows:
        """Return the array of the rows that are given by an index table."""
        return self._with(self.order[0], Axis(index.length, index), self.order)

    def along(self, axis: int, chosen: Axis) -> Rows:
        """Return the array with another choice of rows along an axis."""
        return self._with(self.order[axis], chosen, self.order)

    def transposed(self) -> Rows:
        """Return the array with the first two axes exchanged."""
        first, second, *others = self.order
        return replace(self, order=(second, first, *others))

    def _with(self, axis: int, found: Any, order: tuple[int, ...]) -> Rows:
        return replace(self, axes=(*self.axes[:axis], found, *self.axes[axis + 1 :]), order=order)


@dataclass(frozen=True, slots=True)
class Unrolled(Array):
    """An array of known length, during tracing without loops.

    The elements of an index table are integers, and those of an array with several axes are arrays. If an index table
    without rows selects none of the rows of an array, `other` is one of them.
    """

    elements: tuple[Any, ...]
    other: Any = None

    @property
    def length(self) -> int:
        """Number of rows."""
        return len(self.elements)


def leaves_of(structure: Any) -> list[Any]:
    """Return the leaves of nested tuples, in order."""
    if isinstance(structure, (tuple, list)):
        return [leaf for each in structure for leaf in leaves_of(each)]
    return [structure]


def elements_of(value: Any) -> list[Any]:
    """Return the multivectors of an array of known length, row by row, or a list of a multivector."""
    if isinstance(value, Unrolled):
        return [each for element in value.elements for each in elements_of(element)]
    return [value]


def with_elements(value: Any, given: Iterator[Any]) -> Any:
    """Return an array of known length, or a multivector, with the next of the given elements in place of its own."""
    if isinstance(value, Unrolled):
        return Unrolled(tuple(with_elements(element, given) for element in value.elements))
    return next(given)


def like(structure: Any, flat: Sequence[Any]) -> Any:
    """Return nested tuples of the given structure with other leaves; the types of named tuples are kept."""
    remaining = iter(flat)

    def made(part: Any) -> Any:
        if not isinstance(part, (tuple, list)):
            return next(remaining)
        inner = [made(each) for each in part]
        return type(part)(*inner) if hasattr(part, "_fields") else tuple(inner)

    return made(structure)


def nested(flat: Sequence[Any], shape: tuple[int, ...]) -> Any:
    """Return the elements of a flat sequence as nested tuples of the given shape."""
    if not shape:
        return flat[0]
    step = prod(shape[1:])
    return tuple(nested(flat[k * step : (k + 1) * step], shape[1:]) for k in range(shape[0]))


def same_structure(a: Any, b: Any) -> bool:
    """Return whether nested tuples have the same structure, apart from their leaves."""
    if isinstance(a, (tuple, list)) and isinstance(b, (tuple, list)):
        return len(a) == len(b) and all(map(same_structure, a, b))
    return not isinstance(a, (tuple, list)) and not isinstance(b, (tuple, list))


SHORTEST = 3
"""Minimum number of scalars in a tuple that is stored as one array; shorter tuples are stored as separate results."""


def packing(structure: Any, layouts: Sequence[Layout]) -> list[tuple[int, tuple[int, ...]]]:
    """Return how the leaves of a structure are packed into tables: for each table, the number of leaves and the shape.

    A vector of numbers is packed into one table, and so are nested tuples of equal lengths of multivectors of one
    layout. Every other multivector, and every field of a named tuple, has its own table.
    """
    remaining = list(layouts)

    def packed(part: Any) -> list[tuple[int, tuple[int, ...]]]:
        shape = _array_shape(part)
        own = remaining[: prod(shape)]
        is_vector = len(shape) == 1 and shape[0] >= SHORTEST and own[0].is_scalar
        if shape and len(set(own)) == 1 and (is_vector or len(shape) > 1):
            del remaining[: len(own)]
            return [(len(own), shape)]
        if not isinstance(part, (tuple, list)):
            del remaining[:1]
            return [(1, ())]
        return [group for each in part for group in packed(each)]

    return packed(structure)


def _array_shape(part: Any) -> tuple[int, ...]:
    """Return the shape of nested tuples of equal lengths without named tuples, or an empty tuple."""

    def shape(part: Any) -> tuple[int, ...] | None:
        if not isinstance(part, (tuple, list)):
            return ()
        inner = {shape(each) for each in part}
        (found, *others) = inner or {None}
        return None if others or found is None or hasattr(part, "_fields") else (len(part), *found)

    return shape(part) or ()
