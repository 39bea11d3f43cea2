"""Derivatives of expressions along tangents of inputs.

Every product is bilinear. By the product rule, the derivative of an expression along a tangent is therefore an
expression that does not depend on coefficients or the metric.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from ..algebra.algebra import Algebra
from ..algebra.layout import SCALARS
from ..algebra.operations import Derivative, Operation
from ..algebra.signs import norm_signs
from ..errors import KernelError
from ..frontend.expression import Expression, lift, node, topological


def derivative(expressions: Sequence[Expression], tangents: Mapping[Expression, Expression]) -> list[Expression]:
    """Return the derivatives of expressions along `tangents`, by input node; other inputs are constant.

    The derivative of the square of a norm or of a root is that of its argument. It exists where that of the root does
    not, at zero.
    """
    zero = lift(0)
    found: dict[Expression, Expression] = {}
    for expression in topological(expressions):
        if expression.operation in (Operation.INPUT, Operation.CONSTANT):
            found[expression] = tangents.get(expression, zero)
            continue
        same = _without_root(expression)
        for each in topological([same], found):
            found[each] = _rule(each, [found[argument] for argument in each.arguments])
        found[expression] = found[same]
    return [found[expression] for expression in expressions]


def _without_root(expression: Expression) -> Expression:
    """Return the argument of a root for the product of the root with itself, else the expression."""
    if expression.operation is not Operation.GEOMETRIC_PRODUCT or len({*map(id, expression.arguments)}) > 1:
        return expression
    root = expression.arguments[0]
    if root.operation is Operation.SQRT:
        return root.arguments[0]
    if root.operation is not Operation.NORM:
        return expression
    square = node(Operation.NORM_SQUARED, *root.arguments)
    signs = norm_signs(root.arguments[0].algebra, root.arguments[0].blades)
    if signs.both:
        return node(Operation.ABS, square)
    return -square if signs.negative else square


def is_zero(expression: Expression) -> bool:
    """Return whether an expression is the constant zero."""
    return expression.operation is Operation.CONSTANT and not expression.data.terms


def added(parts: Sequence[Expression]) -> Expression:
    """Return the sum of expressions, without zero terms."""
    kept = [part for part in parts if not is_zero(part)]
    total = kept[0] if kept else lift(0)
    for part in kept[1:]:
        total = total + part
    return total


def without_ones(expressions: Sequence[Expression]) -> list[Expression]:
    """Remove products with the number 1, which occur in derivatives along basis blades."""
    one = lift(1)
    found: dict[Expression, Expression] = {}
    for each in topological(expressions):
        arguments = tuple(found[argument] for argument in each.arguments)
        others = [a for a in arguments if a != one]
        if each.operation is Operation.GEOMETRIC_PRODUCT and len(others) == 1 and others[0].algebra == each.algebra:
            found[each] = others[0]
        else:
            found[each] = each if not arguments else Expression(each.operation, arguments, each.data, each.algebra)
    return [found[expression] for expression in expressions]


def _rule(expression: Expression, d: list[Expression]) -> Expression:
    """Return the derivative of one node from the derivatives of its arguments."""
    if all(map(is_zero, d)):
        return lift(0)
    operation, x = expression.operation, expression.arguments
    match operation.row.derivative:
        case Derivative.BILINEAR:
            algebra = SCALARS if operation is Operation.GEOMETRIC_PRODUCT else expression.algebra
            left = lift(0) if is_zero(d[0]) else node(operation, _within(algebra, d[0]), x[1])
            right = lift(0) if is_zero(d[1]) else node(operation, x[0], _within(algebra, d[1]))
            return added([left, right])
        case Derivative.LINEAR:
            return node(operation, _within(expression.algebra, d[0]))
        case Derivative.ZERO:
            return lift(0)
        case Derivative.OWN:
            return _own_rule(expression, d)


def _within(algebra: Algebra, d: Expression) -> Expression:
    """A derivative as a multivector of the algebra: that of ``s + e12`` by s is a number, whose dual is none."""
    if d.algebra == algebra or algebra == SCALARS:
        return d
    return Expression(Operation.ASSEMBLE, (d,), (algebra.blade("1"),), algebra)


def _same(expression: Expression, d: list[Expression]) -> Expression:
    return Expression(expression.operation, tuple(d), expression.data, expression.algebra)


def _own_rule(expression: Expression, d: list[Expression]) -> Expression:
    """The rules of single operations; the value itself is reused where it occurs in its derivative."""
    x = expression.arguments
    value, half = expression, Fraction(1, 2)
    match expression.operation:
        case Operation.GRADE | Operation.COEFFICIENT:
            return _same(expression, [_within(x[0].algebra, d[0])])
        case Operation.ASSEMBLE:
            return _same(expression, d)
        case Operation.ADD:
            return added(d)
        case Operation.SUBTRACT:
            return added([d[0], lift(0) if is_zero(d[1]) else -d[1]])
        case Operation.SANDWICH:
            return _sandwich_rule(x[0], x[1], d[0], d[1])
        case Operation.DIVIDE:
            first = lift(0) if is_zero(d[0]) else d[0] / x[1]
            return first if is_zero(d[1]) else added([first, -(value * d[1]) / x[1]])
        case Operation.INVERSE:
            return -(value * d[0] * value)
        case Operation.DETERMINANT:
            return node(Operation.SCALAR_PRODUCT, _adjugate(x[0]), d[0])
        case Operation.NORM_SQUARED:
            return node(Operation.SCALAR_PRODUCT, d[0], ~x[0]) + node(Operation.SCALAR_PRODUCT, x[0], ~d[0])
        case Operation.NORM:
            square = node(Operation.NORM_SQUARED, x[0])
            square_derivative = _rule(square, d)
            signs = norm_signs(x[0].algebra, x[0].blades)
            if signs.both:
                square_derivative = node(Operation.SELECT, square > 0, square_derivative, -square_derivative)
            elif signs.negative:
                square_derivative = -square_derivative
            return half * square_derivative / value
        case Operation.NORMALIZE:
            size = node(Operation.NORM, x[0])
            return d[0] / size - value * _rule(size, d) / size
        case Operation.SQRT:
            return half * d[0] / value
        case Operation.SIN:
            return node(Operation.COS, x[0]) * d[0]
        case Operation.COS:
            return -(node(Operation.SIN, x[0]) * d[0])
        case Operation.EXP:
            return value * d[0]
        case Operation.LOG:
            return d[0] / x[0]
        case Operation.ACOS:
            return -d[0] / node(Operation.SQRT, 1 - x[0] * x[0])
        case Operation.ATAN2:
            return (x[1] * d[0] - x[0] * d[1]) / (x[0] * x[0] + x[1] * x[1])
        case Operation.ABS:
            return node(Operation.SELECT, x[0] > 0, d[0], -d[0])
        case Operation.MINIMUM:
            return node(Operation.SELECT, x[0] < x[1], d[0], d[1])
        case Operation.MAXIMUM:
            return node(Operation.SELECT, x[1] < x[0], d[0], d[1])
        case Operation.SELECT:
            return node(Operation.SELECT, x[0], d[1], d[2])
        case operation:
            raise KernelError("derivative", f"no rule for {operation}", "an operation with a derivative")


def _sandwich_rule(v: Expression, x: Expression, dv: Expression, dx: Expression) -> Expression:
    odd = {blade.bit_count() & 1 for blade in v.blades} == {1}
    moved = node(Operation.GRADE_INVOLUTION, x) if odd else x
    found = [lift(0) if is_zero(dx) else node(Operation.SANDWICH, v, dx)]
    if not is_zero(dv):
        found += [dv * moved * ~v, v * moved * ~dv]
    return added(found)


def _adjugate(a: Expression) -> Expression:
    """Return the gradient of the determinant, whose derivative is ``scalar_product(adjugate, da)``.

    It is also valid for singular elements. It is computed by the recursion for the determinant in more than
    `SMALL_DIMENSION` dimensions. In fewer dimensions, the determinant is a product of conjugates, and its derivative
    follows from the product rule.
    """
    size = 2 ** ((a.algebra.dimension + 1) // 2)
    power = adjugate = a
    for k in range(1, size):
        adjugate = power - Fraction(size, k) * power["1"]
        power = a * adjugate
    return lift(-size) * adjugate
