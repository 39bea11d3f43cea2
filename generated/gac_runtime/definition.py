"""The definition of a kernel, as it is passed between the parts of the runtime."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the compiler reads definitions without numpy
    from .layout import Layout

INTERFACE = 1
"""Version of the interface between modules and runtime, incremented by incompatible changes; both must be equal."""

Shape = tuple[int, ...]

COUNTS = ("mul", "add", "div", "sqrt", "call", "choice", "fma")
"""The operations that are counted in a cost, in order."""


@dataclass(frozen=True, slots=True)
class Form:
    """A kernel in two steps, for batches in which some arguments are the same for every element.

    Without functions, the first step computes what depends on these arguments only, by the operations of the kernel.
    """

    same: tuple[str, ...]
    """The arguments that are the same."""
    least: int
    """The smallest number of elements for which the form takes fewer operations."""
    n_prepared: int
    """The number of values that the first step prepares for the second; 0 without functions."""
    prepare: Callable[..., Any] | None
    apply: Callable[..., Any] | None
    once: str
    each: str
    """The operation counts of both steps, as text for documentation."""


def needs_doubles(function: Callable[..., Any]) -> bool:
    """Whether a function computes with integers that single precision rounds, as the random numbers of kernels do."""
    code = function.__code__
    integers = (value for value in code.co_consts if type(value) is int and value)
    return "floor" in code.co_names and any(abs(value) // (value & -value) >= 1 << 24 for value in integers)


@dataclass(frozen=True, slots=True, eq=False)
class Definition:
    """A kernel: its function on one element, the shapes of its arguments and results, and its forms."""

    name: str
    function: Callable[..., Any]
    inputs: Sequence[tuple[str, Shape]]
    outputs: Sequence[tuple[str, Shape]]
    layouts: Mapping[str, Layout]
    """Layouts by name of argument or result."""
    cost: Mapping[str, int]
    is_generated: bool = True
    """Whether numba may cache its machine code on disk under the name of the function."""
    forms: list[Form] = field(default_factory=list)

    @property
    def shapes(self) -> list[Shape]:
        """The shapes of the arguments."""
        return [shape for _, shape in self.inputs]

    @property
    def out_shapes(self) -> list[Shape]:
        """The shapes of the results."""
        return [shape for _, shape in self.outputs]

    @property
    def signature(self) -> str:
        """The signature in the form of a generalised ufunc, ``(8),(3)->(3)``."""
        parts = (self.shapes, self.out_shapes)
        return "->".join(",".join(f"({','.join(map(str, shape))})" for shape in shapes) for shapes in parts)

    def blades(self, name: str) -> str:
        """Return the blades of an argument or a result, as the end of an error message."""
        layout = self.layouts.get(name)
        return f" with last axis {' '.join(layout.blades)}" if layout is not None and layout.blades else ""

    @property
    def is_polynomial(self) -> bool:
        """Whether the kernel has ring operations only, so that it is defined for complex numbers."""
        return self.is_generated and not any(self.cost[name] for name in ("div", "sqrt", "call", "choice"))

    @property
    def in_doubles(self) -> bool:
        """Whether arguments are converted to double precision."""
        return self.is_generated and needs_doubles(self.function)

    def refuse_single(self, name: str, array: Any) -> None:
        """Raise an error if an array of another library than numpy has to be converted to double precision."""
        if self.in_doubles and not str(array.dtype).endswith("float64"):
            raise TypeError(f"{self.name}: argument {name} has dtype {array.dtype}; expected float64")

    @property
    def work(self) -> int:
        """The work for one element, which decides about threads: its bytes as doubles, and four for each operation."""
        return 8 * sum(map(math.prod, (*self.shapes, *self.out_shapes))) + 4 * sum(self.cost.values())


def counted(cost: str) -> dict[str, int]:
    """Parse the counts in ``21 mul, 18 add``; operations that are not listed have count 0."""
    found = dict.fromkeys(COUNTS, 0)
    for item in cost.split(", ") if cost else ():
        count, name = item.split()
        found[name] = int(count)
    return found


def result_names(count: int) -> list[str]:
    """Return the default names of results."""
    return ["out"] if count == 1 else [f"out_{k}" for k in range(count)]


def shapes_in(signature: str) -> list[list[tuple[int, ...]]]:
    """Return the shapes in a signature that is known to be well-formed."""
    return [
        [tuple(int(size) for size in shape.split(",") if size) for shape in part[1:-1].split("),(")] if part else []
        for part in signature.split("->")
    ]
