"""The parameters of kernels: multivectors, arrays of them, and index tables."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product
from typing import Any

from ..algebra.layout import Layout
from ..algebra.operations import Operation
from ..errors import KernelError
from .expression import Expression, Input
from .rows import IndexOf, RowsOf, nested


@dataclass(frozen=True, slots=True)
class ArrayOf:
    """The type of an array of elements of one layout, of a fixed shape. In a kernel, it is given as nested tuples."""

    layout: Layout
    shape: tuple[int, ...]

    def __str__(self) -> str:
        return f"array({', '.join(map(str, (self.layout, *self.shape)))})"


Type = Layout | ArrayOf | RowsOf | IndexOf


def array(layout: Layout, *shape: str | int, shared: bool = False) -> ArrayOf | RowsOf:
    """Declare a parameter or result that is an array of elements.

    Parameters
    ----------
    layout : Layout
        The layout of each element.
    *shape : int or str
        ``array(SCALAR, 4, 4)`` is a matrix, ``array(POINT, 3)`` three points. Leading axes may be given by the name of
        a length that is known only when the kernel runs: ``array(POINT, "n")``. Kernels with named lengths contain
        loops.
    shared : bool
        Whether all elements of a batch share the array. Only for arrays with a named length.

    Raises
    ------
    KernelError
        If a size is not positive, a name is not an identifier, or a name follows a size.
    """
    names = tuple(each for each in shape if isinstance(each, str))
    sizes = tuple(each for each in shape if isinstance(each, int))
    in_order = (*names, *sizes) == shape
    if not shape or not in_order or not all(n > 0 for n in sizes) or not all(map(str.isidentifier, names)):
        raise KernelError(
            "array()",
            f"shape {shape}",
            'names of lengths followed by positive sizes, as in array(SCALAR, 4, 4), array(POINT, "n")',
        )
    return RowsOf(layout, names, sizes, shared) if names else ArrayOf(layout, sizes)


def index(length: str, *further: int | str, into: str | None = None) -> IndexOf:
    """Declare a parameter that is an index table: integers, each the index of a row of an array, or -1 for no row.

    ``index("samples", 7, into="points")`` has seven integers in each row. The kernel's function gets a tuple of seven
    index tables for it.

    Parameters
    ----------
    length : str
        The name of the length of the table.
    *further : int, str
        The number of columns, and `into`, if it is not given by name.
    into : str, optional
        The name of the length of the arrays that the table refers to; by default `length`.

    Raises
    ------
    KernelError
        If a name is not an identifier, or the number of columns is not positive.
    """
    columns = [each for each in further if isinstance(each, int) and not isinstance(each, bool)]
    others = [each for each in further if each not in columns] + ([] if into is None else [into])
    if len(columns) > 1 or len(others) > 1 or not all(n > 0 for n in columns):
        raise KernelError(
            "index()", f"{further} after the length", 'a number of columns, as in index("n", 3, into="m")'
        )
    names = [length, *others]
    if not all(isinstance(name, str) and name.isidentifier() for name in names):
        raise KernelError("index()", f"lengths {names}", 'names, as in index("n", into="m")')
    return IndexOf(length, str(names[-1]), *columns)


@lru_cache(maxsize=4096)
def _components(name: str, shape: tuple[int, ...], blades: tuple[str, ...] | None) -> tuple[str, ...]:
    """Return the names of the entries of an array. They are cached, because every evaluation needs them."""
    endings = [""] if blades is None else ["_" + blade.replace("^", "_") for blade in blades]
    stems = ("_".join([name, *map(str, place)]) for place in product(*map(range, shape)))
    return tuple(stem + ending for stem in stems for ending in endings)


@dataclass(frozen=True)
class Parameter:
    """A parameter of a kernel: an array of shape `shape`, with the blade axis last.

    Kernels with many numbers ask for these attributes hundreds of thousands of times, so that some are cached.
    """

    name: str
    type: Type

    def __str__(self) -> str:
        return f"{self.name}: {self.type}"

    @cached_property
    def layout(self) -> Layout:
        """The layout of each element."""
        if isinstance(self.type, IndexOf):
            raise KernelError(self.name, "an index table", "an array of multivectors or numbers")
        return self.type.layout if isinstance(self.type, (ArrayOf, RowsOf)) else self.type

    @property
    def outer_shape(self) -> tuple[int, ...]:
        """Shape without the blade axis and without named lengths."""
        return self.type.shape if isinstance(self.type, (ArrayOf, RowsOf)) else ()

    @property
    def has_rows(self) -> bool:
        """Whether the length of the array is known only when the kernel runs."""
        return isinstance(self.type, (RowsOf, IndexOf))

    @property
    def shape(self) -> tuple[int, ...]:
        """Core shape of the array."""
        return self.outer_shape + (() if self.layout.is_scalar else (self.layout.size,))

    @cached_property
    def components(self) -> tuple[str, ...]:
        """Names of the entries, in C order."""
        layout = self.layout
        return _components(self.name, self.outer_shape, None if layout.is_scalar else layout.blades)

    @cached_property
    def elements(self) -> tuple[tuple[str, ...], ...]:
        """Names of the entries of each element of the array."""
        names, step = self.components, self.layout.size
        return tuple(names[start : start + step] for start in range(0, len(names), step))

    def symbols(self) -> Any:
        """Return the symbols that the kernel's function is called with: an expression, or nested tuples of expressions.

        Raises
        ------
        KernelError
            If the length of the array is known only when the kernel runs.
        """
        if self.has_rows:
            raise KernelError(
                f"parameter {self.name}",
                "an array whose length is known only when the kernel runs",
                "a parameter of a kernel without loops",
            )
        elements = [
            Expression(Operation.INPUT, (), Input(self.name, self.layout, names), self.layout.algebra)
            for names in self.elements
        ]
        return nested(elements, self.outer_shape)
