"""The parameters of kernels: multivectors, arrays of them, and index tables."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

from ..algebra.layout import Layout
from ..algebra.operations import Operation
from ..errors import KernelError
from .expression import Expression, Input
from .rows import IndexOf, RowsOf, nested


@dataclass(frozen=True, slots=True)
class ArrayOf:
    """Several elements of one layout in an array of the given shape; in a kernel, nested tuples."""

    layout: Layout
    shape: tuple[int, ...]


Type = Layout | ArrayOf | RowsOf | IndexOf


def array(layout: Layout, *shape: str | int, shared: bool = False) -> ArrayOf | RowsOf:
    """A parameter or result that is an array of elements.

    Parameters
    ----------
    layout : Layout
    *shape : int or str
        ``array(SCALAR, 4, 4)`` is a matrix, ``array(POINT, 3)`` three points. Leading axes may have names of lengths
        that are known when the kernel runs: ``array(POINT, "n")``. Such kernels contain loops.
    shared : bool
        Whether all elements of a batch share the array; for arrays with a named length.

    Raises
    ------
    KernelError
        When a size is not positive, a name is no identifier, or a name stands behind a size.
    """
    names = tuple(each for each in shape if isinstance(each, str))
    sizes = tuple(each for each in shape if isinstance(each, int))
    in_order = (*names, *sizes) == shape
    if not shape or not in_order or not all(n > 0 for n in sizes) or not all(map(str.isidentifier, names)):
        raise KernelError(
            "array()",
            f"shape {shape}",
            'positive sizes behind names of lengths, as in array(SCALAR, 4, 4), array(POINT, "n")',
        )
    return RowsOf(layout, names, sizes, shared) if names else ArrayOf(layout, sizes)


def index(length: str, into: str | None = None) -> IndexOf:
    """A parameter that is an index table: whole numbers, each the row of an array, or -1 for none.

    Parameters
    ----------
    length : str
        The name of the table's length.
    into : str, optional
        The length of the arrays that it refers to; by default its own.
    """
    if not all(isinstance(name, str) and name.isidentifier() for name in (length, into or length)):
        raise KernelError("index()", f"lengths {length!r} and {into!r}", 'names, as in index("n", into="m")')
    return IndexOf(length, into or length)


@dataclass(frozen=True, slots=True)
class Parameter:
    """One argument of a kernel: an array of shape `shape`, blades last."""

    name: str
    type: Type

    @property
    def layout(self) -> Layout:
        """The layout of each element."""
        if isinstance(self.type, IndexOf):
            raise KernelError(self.name, "an index table", "an array of multivectors or numbers")
        return self.type.layout if isinstance(self.type, (ArrayOf, RowsOf)) else self.type

    @property
    def outer_shape(self) -> tuple[int, ...]:
        """Shape without the blade axis, and without named lengths."""
        return self.type.shape if isinstance(self.type, (ArrayOf, RowsOf)) else ()

    @property
    def has_rows(self) -> bool:
        """Whether its length is known only when the kernel runs."""
        return isinstance(self.type, (RowsOf, IndexOf))

    @property
    def shape(self) -> tuple[int, ...]:
        """Core shape of the array."""
        return self.outer_shape + (() if self.layout.is_scalar else (self.layout.size,))

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the entries, in C order."""
        return tuple(name for names in self._elements() for name in names)

    def _elements(self) -> list[tuple[str, ...]]:
        found = []
        for place in product(*map(range, self.outer_shape)):
            stem = "_".join([self.name, *map(str, place)])
            blades = [name.replace("^", "_") for name in self.layout.blades]
            found.append((stem,) if self.layout.is_scalar else tuple(f"{stem}_{blade}" for blade in blades))
        return found

    def symbols(self) -> Any:
        """What the kernel's function is called with: an expression, or nested tuples of them.

        Raises
        ------
        KernelError
            When its length is known only when the kernel runs.
        """
        if self.has_rows:
            raise KernelError(
                f"parameter {self.name}",
                "an array whose length is known only when the kernel runs",
                "a parameter of a kernel without loops",
            )
        elements = [
            Expression(Operation.INPUT, (), Input(self.name, self.layout, names), self.layout.algebra)
            for names in self._elements()
        ]
        return nested(elements, self.outer_shape)
