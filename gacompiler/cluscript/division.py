"""``a / b`` of multivectors: multiplication by the inverse of ``b``, computed by the cheapest exact formula."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..algebra.versors import SMALL_DIMENSION, n_vectors
from ..errors import ZeroDivisorError
from ..frontend.expression import Expression, evaluate, topological
from ..frontend.operations import apply, inverse, norm_squared, reverse
from ..ir.scalar import Graph


def zero_divisors(divisors: Sequence[Expression]) -> list[bool]:
    """Return the scalars and vectors among the arguments of divisions that are zero for every input."""
    found, graph, memory = [], Graph(), dict[Expression, Multivector]()
    for divisor in divisors:
        checked = divisor if divisor.is_scalar else norm_squared(divisor)
        names = [e.data.components[0] for e in topological([checked], memory) if e.operation is Operation.INPUT]
        inputs = {name: graph.variable(name) for name in names}
        (value,) = evaluate([checked], inputs, memory, graph.lift)
        number = graph.lift(value.scalar)
        found.append(number.is_constant and number.value == 0)
        if found[-1]:
            break
    return found


_KEEPS = (
    Operation.REVERSE,
    Operation.NEGATE,
    Operation.OUTER_PRODUCT,
    Operation.HESTENES_PRODUCT,
    Operation.GRADE_INVOLUTION,
    Operation.DUAL,
    Operation.UNDUAL,
)
"""Operations that map blades to blades."""


def quotient(a: Any, b: Any) -> Any:
    """Return ``a b**-1``.

    The inverse of blades, versors and their multiples is ``~b / (b ~b)``. For other elements over up to five basis
    vectors it is the full inverse; over more, ``~b`` divided by the scalar part of ``b ~b``, as in Gaalop.

    Raises
    ------
    ZeroDivisorError
        If the form of `b` shows that it has no inverse.
    """
    if isinstance(b, (int, Fraction)) and b == 0:
        raise ZeroDivisorError("division", "a division by zero", "a divisor other than zero")
    if isinstance(b, (Expression, Multivector)) and not b.blades:
        raise ZeroDivisorError("division", f"a division by {b}, which is zero", "a divisor other than zero")
    if not isinstance(b, (Expression, Multivector)) or (isinstance(b, Expression) and b.is_scalar):
        return apply(Operation.DIVIDE, a, b)
    if isinstance(b, Multivector):
        return apply(Operation.GEOMETRIC_PRODUCT, a, inverse(b))
    if n_vectors(b.blades) > SMALL_DIMENSION or _is_blade_or_versor(b):
        square = norm_squared(b)
        if not square.blades:
            raise ZeroDivisorError("division", f"{b}, whose square is zero", "an element with an inverse")
        return apply(Operation.DIVIDE, apply(Operation.GEOMETRIC_PRODUCT, a, reverse(b)), square)
    return apply(Operation.GEOMETRIC_PRODUCT, a, inverse(b))


def _is_blade_or_versor(b: Expression) -> bool:
    """Return whether the construction of `b` shows that ``b ~b`` is a scalar.

    Products of versors are versors; inner and outer products, and duals, of blades are blades.
    """
    blade: dict[Expression, bool] = {}
    versor: dict[Expression, bool] = {}
    for node in topological([b]):
        simple = node.is_scalar or all(each.bit_count() == 1 for each in node.blades)
        if not simple and isinstance(node.data, Multivector):
            square = node.data * reverse(node.data)
            simple = not any(square.terms) and len({each.bit_count() for each in node.data.terms}) == 1
        inner = node.arguments
        scaled = node.operation is Operation.GEOMETRIC_PRODUCT and any(x.is_scalar for x in inner)
        blades = all(blade[x] for x in inner)
        blade[node] = simple or (
            bool(inner)
            and blades
            and (scaled or node.operation in _KEEPS or _is_dual(node) or node.operation is Operation.DIVIDE)
        )
        versors = bool(inner) and all(versor[x] for x in inner)
        versor[node] = blade[node] or (
            versors
            and node.operation
            in (Operation.GEOMETRIC_PRODUCT, Operation.REVERSE, Operation.NEGATE, Operation.DIVIDE, Operation.SANDWICH)
        )
    return versor[b]


def _is_dual(node: Expression) -> bool:
    """Return whether a product has a pseudoscalar as one factor."""
    everything = {node.algebra.everything}
    return node.operation is Operation.GEOMETRIC_PRODUCT and any(set(x.blades) == everything for x in node.arguments)
