"""What a kernel is, as the parts of the runtime hand it to each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from .layout import Layout

INTERFACE = 1
"""Modules and runtime must have the same number. It grows when modules of earlier versions would not run."""

Shape = tuple[int, ...]

COUNTS = ("mul", "add", "div", "sqrt", "call", "choice", "fma")
"""The operations that a cost counts, in the order in which it lists them."""


@dataclass(frozen=True, slots=True)
class Form:
    """A kernel in two steps, for batches in which some arguments are the same for every element."""

    same: tuple[str, ...]
    """The arguments that are the same."""
    least: int
    """The least number of elements for which it takes fewer operations."""
    n_prepared: int
    """How many numbers the first step prepares for the second."""
    prepare: Callable[..., Any]
    apply: Callable[..., Any]
    once: str
    each: str
    """The operations of both steps, for readers."""


@dataclass(frozen=True, slots=True, eq=False)
class Definition:
    """A kernel: its function on one element, the shapes of its arguments and results, and its forms."""

    name: str
    function: Callable[..., Any]
    inputs: Sequence[tuple[str, Shape]]
    outputs: Sequence[tuple[str, Shape]]
    layouts: Mapping[str, Layout]
    """By the name of an argument or a result."""
    cost: Mapping[str, int]
    is_generated: bool = True
    """Whether numba may keep its machine code on disk, under the name of the function."""
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
        """As a generalised ufunc has it: ``(8),(3)->(3)``."""
        parts = (self.shapes, self.out_shapes)
        return "->".join(",".join(f"({','.join(map(str, shape))})" for shape in shapes) for shapes in parts)

    def blades(self, name: str) -> str:
        """The blades of an argument or a result, at the end of an error message."""
        layout = self.layouts.get(name)
        return f" with last axis {' '.join(layout.blades)}" if layout is not None and layout.blades else ""

    @property
    def is_polynomial(self) -> bool:
        """Whether it has ring operations only, so that complex numbers make sense."""
        return self.is_generated and not any(self.cost[name] for name in ("div", "sqrt", "call", "choice"))

    @property
    def work(self) -> int:
        """Bytes of one element in doubles, and its operations as so many bytes: what decides about threads."""
        return 8 * sum(map(math.prod, (*self.shapes, *self.out_shapes))) + 4 * sum(self.cost.values())


def counted(cost: str) -> dict[str, int]:
    """The counts in ``21 mul, 18 add``; operations that are not in it are not needed."""
    found = dict.fromkeys(COUNTS, 0)
    for item in cost.split(", ") if cost else ():
        count, name = item.split()
        found[name] = int(count)
    return found


def result_names(count: int) -> list[str]:
    """The names of results that have no others."""
    return ["out"] if count == 1 else [f"out_{k}" for k in range(count)]


def shapes_in(signature: str) -> list[list[tuple[int, ...]]]:
    """The shapes in a signature that is known to be right."""
    return [
        [tuple(int(size) for size in shape.split(",") if size) for shape in part[1:-1].split("),(")] if part else []
        for part in signature.split("->")
    ]
