"""Types of parameters and results for derivatives, and access to the multivectors in values."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from ..algebra.layout import SCALAR, SCALARS, Layout
from ..algebra.operations import Operation
from ..errors import KernelError, OperandError
from ..frontend.expression import Expression, lift, outside_functions
from ..frontend.kernel import ArrayOf, Kernel, Parameter, trace
from ..frontend.loop_trace import LoopTrace, trace_loops
from ..frontend.operations import assemble
from ..frontend.rows import IndexOf, RowsOf, elements_of, leaves_of, like, with_elements
from ..frontend.traced import substituted
from ..passes.decide import decide
from ..passes.inference import LayoutInference
from ..passes.rewrite import rewrite
from .rules import added, is_zero

Type = Layout | ArrayOf | RowsOf


@dataclass(frozen=True, slots=True)
class Differentiated:
    """A kernel that is differentiated with respect to one parameter, traced once.

    Attributes
    ----------
    kernel : Kernel
    place : int
        The position of the parameter.
    parameter : Parameter
    results : tuple of types
    loops : LoopTrace or None
        The statements of a kernel with loops.
    """

    kernel: Kernel
    place: int
    parameter: Parameter
    results: tuple[Type, ...]
    loops: LoopTrace | None

    def values(self, arguments: Sequence[Any]) -> list[Any]:
        """Return the results for arguments without loops: expressions, or nested tuples of expressions or arrays."""
        value = self.kernel.function(*arguments)
        pinned = self.kernel.returns
        is_one = not isinstance(value, tuple) or isinstance(pinned, (ArrayOf, RowsOf))
        found = [value] if is_one else list(value)
        return [over(result, map(lift, elements(result))) for result in found]

    def with_variables(
        self, arguments: Sequence[Any], derived: Callable[[list[Any], list[Expression]], list[Any]]
    ) -> list[Any]:
        """Call `derived` with the arguments and with symbols for the elements of the parameter.

        The symbols are replaced by the elements in the returned values.
        """
        given = elements(arguments[self.place])
        others = [e for k, a in enumerate(arguments) if k != self.place for e in elements(a)]
        if _are_symbols(given) and set(given).isdisjoint(others):
            return derived(list(arguments), given)
        layout = self.parameter.layout
        symbols = [Parameter(f"{self.parameter.name}_variable_{k}", layout).symbols() for k in range(len(given))]
        own = list(arguments)
        own[self.place] = over(arguments[self.place], symbols)
        by = dict(zip(symbols, map(lift, given), strict=True))
        return [over(value, substituted(elements(value), by)) for value in derived(own, symbols)]


def _are_symbols(given: Sequence[Any]) -> bool:
    return all(isinstance(e, Expression) and e.operation is Operation.INPUT for e in given)


def differentiated(definition: Kernel, wrt: str) -> Differentiated:
    """Trace a kernel to differentiate it with respect to one parameter.

    Raises
    ------
    KernelError
        When it has no such parameter, or the parameter is an index table.
    """
    place, parameter = parameter_of(definition, wrt)
    if not definition.has_loops:
        return Differentiated(definition, place, parameter, _results(definition), None)
    traced = trace_loops(definition, LayoutInference())
    types = []
    for _, record in traced.results:
        layout = record.leaves[0].layout
        outer = record.shape if layout.is_scalar else record.shape[:-1]
        types.append(type_of(layout, record.lengths, outer))
    return Differentiated(definition, place, parameter, tuple(types), traced)


def parameter_of(definition: Kernel, wrt: str) -> tuple[int, Parameter]:
    """Return the position of the parameter with a name, and the parameter.

    Raises
    ------
    KernelError
        When there is no such parameter, or it is an index table.
    """
    if not isinstance(definition, Kernel):
        raise OperandError("a derivative", f"of {type(definition).__name__}", "a kernel and the name of a parameter")
    for k, parameter in enumerate(definition.parameters):
        if parameter.name == wrt:
            if isinstance(parameter.type, IndexOf):
                raise KernelError(definition.where, f"{wrt} is an index table", "multivectors or numbers")
            return k, parameter
    names = " ".join(parameter.name for parameter in definition.parameters)
    raise KernelError(definition.where, f"no parameter {wrt}", f"one of {names}")


def _results(definition: Kernel) -> tuple[Type, ...]:
    traced = trace(definition)
    with outside_functions():
        layouts = decide(traced, tuple(rewrite(traced.expressions).values())).layouts
    return tuple(
        type_of(layout, (), output.outer_shape) for layout, output in zip(layouts, traced.outputs, strict=True)
    )


# Types.

_TANGENT = "_TANGENT"


def type_of(layout: Layout, lengths: tuple[str, ...] = (), outer: tuple[int, ...] = (), shared: bool = False) -> Type:
    """Return the type of multivectors over named lengths and a shape."""
    if lengths:
        return RowsOf(layout, lengths, outer, shared)
    return ArrayOf(layout, outer) if outer else layout


def layout_of_type(given: Type) -> Layout:
    """Return the layout of each element."""
    return given if isinstance(given, Layout) else given.layout


def lengths_of(given: Type | IndexOf) -> tuple[str, ...]:
    """Return the named lengths."""
    return given.lengths if isinstance(given, RowsOf) else ()


def outer_of(given: Type) -> tuple[int, ...]:
    """Return the shape of an element, or of a row, without the blade axis."""
    return () if isinstance(given, Layout) else given.shape


def free(layout: Layout) -> Layout:
    """Return the layout of tangents: the stored coefficients without relations."""
    if layout.is_scalar or layout.name.endswith(_TANGENT):
        return layout
    return layout.algebra.layout(layout.name + _TANGENT, " ".join(layout.blades))


def tangent_type(given: Type) -> Type:
    """Return the type of tangents: the same shape with free coefficients."""
    shared = isinstance(given, RowsOf) and given.shared
    return type_of(free(layout_of_type(given)), lengths_of(given), outer_of(given), shared)


def gradient_type(parameter: Parameter) -> Type:
    """Return the type of gradients: one number for each stored coefficient; arrays of numbers keep their shape."""
    given: Any = parameter.type
    layout, lengths = parameter.layout, lengths_of(given)
    size = () if lengths and layout.is_scalar else (layout.size,)
    return type_of(SCALAR, lengths, (*outer_of(given), *size))


def unused(definition: Kernel, name: str) -> str:
    """Return a name that no parameter of the kernel has, by adding a number to `name` if necessary."""
    taken = {parameter.name for parameter in definition.parameters}
    names = (name if k == 1 else f"{name}_{k}" for k in range(1, len(taken) + 2))
    return next(each for each in names if each not in taken)


# Values without loops.


def elements(structure: Any) -> list[Any]:
    """Return the multivectors in a value, including the elements of arrays."""
    found: list[Any] = []
    for leaf in leaves_of(structure):
        found += elements_of(leaf)
    return found


def over(structure: Any, given: Any) -> Any:
    """Return a value of the same structure with other multivectors."""
    remaining = iter(given)
    return like(structure, [with_elements(leaf, remaining) for leaf in leaves_of(structure)])


# Coefficients.


def numbers(value: Expression, layout: Layout) -> list[Expression]:
    """Return the stored coefficients of a multivector as scalar expressions."""
    if value.algebra == SCALARS:
        return [value if slot.blade == 0 else lift(0) for slot in layout.stored]
    return [Expression(Operation.COEFFICIENT, (value,), (slot.sign, slot.blade), SCALARS) for slot in layout.stored]


def multivector(given: Sequence[Expression], layout: Layout) -> Expression:
    """Return the multivector with the given stored coefficients."""
    if layout.is_scalar:
        return given[0]
    return lift(assemble(layout.algebra, dict(zip(layout.blades, given, strict=True))))


def weighted(weights: Sequence[Expression], values: Sequence[Expression]) -> Expression:
    """Return the sum of products, without zero terms."""
    pairs = [(w, v) for w, v in zip(weights, values, strict=True) if not is_zero(v) and not is_zero(w)]
    return added([v if w is lift(1) else w * v for w, v in pairs])


def parts(flat: Sequence[Any], size: int) -> Iterator[tuple[Any, ...]]:
    """Yield consecutive parts of length `size`."""
    for k in range(0, len(flat), size):
        yield tuple(flat[k : k + size])
