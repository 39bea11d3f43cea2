"""Kernels with derivatives of every order by every parameter: what the operators of torch and jax share."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np

from .algebra.layout import Layout
from .derivatives.derived_kernels import jvp, vjp
from .derivatives.results import (
    differentiated,
    elements,
    free,
    layout_of_type,
    multivector,
    numbers,
    over,
    tangent_type,
)
from .errors import KernelError
from .frontend.expression import lift
from .frontend.kernel import Kernel, Parameter
from .frontend.rows import IndexOf
from .runtime import compile

Shapes = tuple[tuple[int | str, ...], ...]
"""The last axes of arguments or of results: numbers, and names of lengths."""


class Differentiable:
    """A compiled kernel, and its derivatives, which are compiled when they are first needed.

    Parameters
    ----------
    kernel : Kernel
        Its parameters must have no relations, see `with_free_parameters`.

    Attributes
    ----------
    definition : Kernel
        The kernel from which operators are made again when they are unpickled.
    """

    def __init__(self, kernel: Kernel) -> None:
        self.kernel, self.function = kernel, compile(kernel)
        self.definition = kernel
        self.given, self.results = _shapes(self.function.signature)
        self._derivatives: dict[tuple[Any, int], Self] = {}

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memory: object) -> Self:
        return self

    @property
    def identity(self) -> str:
        """The name of the kernel with the digest of its emitted text."""
        return str(self.function.__module__.rpartition("._gac_")[2])

    def is_index(self, place: int) -> bool:
        """Whether an argument is a table of row numbers."""
        return isinstance(self.kernel.parameters[place].type, IndexOf)

    def check_number(self, arguments: Sequence[Any]) -> None:
        """Raise `KernelError` unless there is one argument for each parameter."""
        if len(arguments) != len(self.kernel.parameters):
            names = ", ".join(parameter.name for parameter in self.kernel.parameters)
            raise KernelError(self.kernel.name, f"{len(arguments)} of {len(self.kernel.parameters)} arguments", names)

    def result_shapes(self, shapes: Sequence[tuple[int, ...]]) -> list[tuple[int, ...]]:
        """Return the shapes of the results for arguments of these shapes, whose leading axes broadcast."""
        leading, lengths = [], dict[str, int]()
        for found, shape, parameter in zip(shapes, self.given, self.kernel.parameters, strict=True):
            n = len(found) - len(shape)
            own = found[n:] if n >= 0 else ()
            if n < 0 or any(isinstance(size, int) and size != at for size, at in zip(shape, own, strict=True)):
                core = ", ".join(map(str, shape))
                raise KernelError(f"{self.kernel.name}: {parameter.name}", f"shape {tuple(found)}", f"(..., {core})")
            lengths.update({name: size for name, size in zip(shape, own, strict=True) if isinstance(name, str)})
            leading.append(tuple(found[:n]))
        batch = np.broadcast_shapes(*leading)
        return [
            (*batch, *(size if isinstance(size, int) else lengths[size] for size in shape)) for shape in self.results
        ]

    def evaluated(self, arrays: Sequence[Any]) -> list[Any]:
        """Return the results for arrays of numpy."""
        found = self.function(*arrays)
        return [np.asarray(each) for each in (found if len(self.results) > 1 else (found,))]

    def one_or_all(self, results: Sequence[Any]) -> Any:
        """Return the only result, or a tuple of several."""
        return tuple(results) if len(self.results) > 1 else results[0]

    def pull(self, place: int) -> Self:
        """Return `vjp` with respect to one parameter: arguments and cotangents to results and the gradient."""
        return self._derivative(vjp, place)

    def push(self, place: int) -> Self:
        """Return `jvp` with respect to one parameter: arguments and a tangent to results and their tangents."""
        return self._derivative(jvp, place)

    def has_rows_of_one_number(self, place: int) -> bool:
        """Whether the gradient with respect to numbers has an axis of length 1 more than they have."""
        return self.pull(place).results[-1] == (*self.given[place], 1)

    def ranks_of_batches(self, ranks: Sequence[int]) -> list[int]:
        """Return how many axes to insert behind a batch axis in front, for arguments of these ranks without it."""
        own = [rank - len(shape) for rank, shape in zip(ranks, self.given, strict=True)]
        return [max(own) - n for n in own]

    def _derivative(self, transform: Callable[[Kernel, str], Kernel], place: int) -> Self:
        key = transform, place
        if key not in self._derivatives:
            self._derivatives[key] = type(self)(transform(self.kernel, self.kernel.parameters[place].name))
        return self._derivatives[key]


def _shapes(signature: str) -> tuple[Shapes, Shapes]:
    given, results = (
        tuple(
            tuple(int(size) if size.isdigit() else size for size in shape.split(",") if size)
            for shape in re.findall(r"\(([^)]*)\)", side)
        )
        for side in signature.split("->")
    )
    return given, results


def with_free_parameters(kernel: Any, where: str) -> Kernel:
    """Return the kernel without relations between the coefficients of its parameters, and with the same results.

    What relations imply of a result, such as the weight 1 of a moved point, is left out.
    """
    if not isinstance(kernel, Kernel):
        raise KernelError(where, f"an object of type {type(kernel).__name__}", "a function decorated with @kernel")
    parameters = tuple(map(_free, kernel.parameters))
    if parameters == kernel.parameters:
        return kernel
    d = differentiated(kernel, next(p.name for p in kernel.parameters if not isinstance(p.type, IndexOf)))
    results = tuple(map(tangent_type, d.results))

    def function(*arguments: Any) -> Any:
        found = kernel.function(*arguments)
        rebuilt = []
        for value, result in zip(found if len(results) > 1 else (found,), d.results, strict=True):
            layout = layout_of_type(result)
            rebuilt.append(over(value, [multivector(numbers(lift(e), layout), free(layout)) for e in elements(value)]))
        return tuple(rebuilt) if len(rebuilt) > 1 else rebuilt[0]

    return replace(
        kernel, parameters=parameters, function=function, returns=results if len(results) > 1 else results[0]
    )


def _free(parameter: Parameter) -> Parameter:
    if isinstance(parameter.type, IndexOf) or parameter.layout.implied or not parameter.layout.has_relations:
        return parameter
    layout = replace(parameter.layout, unit=False, user_relations=None)
    given: Any = parameter.type
    return replace(parameter, type=layout if isinstance(given, Layout) else replace(given, layout=layout))
