"""Derivatives and matrices of kernels, as kernels: they are compiled, counted and proved like any other.

Every product is bilinear, so the derivative of an expression along a tangent is again an expression, by the product
rule, and nothing is said here about coefficients or metrics. A column of a Jacobian is the derivative along a basis
blade; for a versor, along a bivector times the versor, which stays on the manifold.

At the switch of a `select` the derivative is that of the side taken; of ``abs`` at zero that of the negative side,
of ``minimum`` and ``maximum`` at equal arguments that of the second. Where a function has no finite derivative there is
no finite number: that of ``sqrt`` at zero is infinite, or not a number where the argument's derivative vanishes too,
and so is that of `norm` where the norm is zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from .algebra.layout import SCALAR, SCALARS, Layout
from .algebra.multivector import Multivector
from .algebra.operations import Derivative, Operation
from .algebra.signs import norm_signs
from .errors import KernelError
from .frontend.expression import Expression, lift, node, topological
from .frontend.kernel import ArrayOf, Kernel, Parameter, trace
from .frontend.operations import assemble
from .passes.decide import decide
from .passes.rewrite import rewrite


def derivative(expressions: Sequence[Expression], tangents: Mapping[Expression, Expression]) -> list[Expression]:
    """Derivatives of expressions along `tangents` (input node -> its tangent); other inputs are held."""
    zero = lift(0)
    found: dict[Expression, Expression] = {}
    for expression in topological(expressions):
        if expression.operation in (Operation.INPUT, Operation.CONSTANT):
            found[expression] = tangents.get(expression, zero)
        else:
            found[expression] = _rule(expression, [found[argument] for argument in expression.arguments])
    return [found[expression] for expression in expressions]


def _is_zero(expression: Expression) -> bool:
    return expression.operation is Operation.CONSTANT and not expression.data.terms


def _sum(parts: Sequence[Expression]) -> Expression:
    kept = [part for part in parts if not _is_zero(part)]
    total = kept[0] if kept else lift(0)
    for part in kept[1:]:
        total = total + part
    return total


def _rule(expression: Expression, d: list[Expression]) -> Expression:
    """The derivative of one node, given those of its arguments."""
    if all(map(_is_zero, d)):
        return lift(0)
    operation, x = expression.operation, expression.arguments
    match operation.row.derivative:
        case Derivative.BILINEAR:
            left = lift(0) if _is_zero(d[0]) else node(operation, d[0], x[1])
            right = lift(0) if _is_zero(d[1]) else node(operation, x[0], d[1])
            return _sum([left, right])
        case Derivative.LINEAR:
            return node(operation, d[0])
        case Derivative.ZERO:
            return lift(0)
        case Derivative.OWN:
            return _own_rule(expression, d)


def _same(expression: Expression, d: list[Expression]) -> Expression:
    return Expression(expression.operation, tuple(d), expression.data, expression.algebra)


def _own_rule(expression: Expression, d: list[Expression]) -> Expression:
    """The rules of single operations; the value itself is reused where it occurs in its derivative."""
    x = expression.arguments
    value, half = expression, Fraction(1, 2)
    match expression.operation:
        case Operation.GRADE | Operation.COEFFICIENT:
            return lift(0) if d[0].algebra == SCALARS != x[0].algebra else _same(expression, d)
        case Operation.ASSEMBLE:
            return _same(expression, d)
        case Operation.ADD:
            return _sum(d)
        case Operation.SUBTRACT:
            return _sum([d[0], lift(0) if _is_zero(d[1]) else -d[1]])
        case Operation.SANDWICH:
            return _sandwich_rule(x[0], x[1], d[0], d[1])
        case Operation.DIVIDE:
            first = lift(0) if _is_zero(d[0]) else d[0] / x[1]
            return first if _is_zero(d[1]) else _sum([first, -(value * d[1]) / x[1]])
        case Operation.INVERSE:
            return -(value * d[0] * value)
        case Operation.DETERMINANT:
            return node(Operation.SCALAR_PRODUCT, _adjugate(x[0]), d[0])
        case Operation.NORM_SQUARED:
            return node(Operation.SCALAR_PRODUCT, d[0], ~x[0]) + node(Operation.SCALAR_PRODUCT, x[0], ~d[0])
        case Operation.NORM:
            square = node(Operation.NORM_SQUARED, x[0])
            slope = _rule(square, d)
            signs = norm_signs(x[0].algebra, x[0].blades)
            if signs.both:
                slope = node(Operation.SELECT, square > 0, slope, -slope)
            elif signs.negative:
                slope = -slope
            return half * slope / value
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
    parts = [lift(0) if _is_zero(dx) else node(Operation.SANDWICH, v, dx)]
    if not _is_zero(dv):
        parts += [dv * moved * ~v, v * moved * ~dv]
    return _sum(parts)


def _adjugate(a: Expression) -> Expression:
    """The gradient of the determinant: ``scalar_product(adjugate, da)`` is its derivative, singular elements included.

    By the recursion that gives the determinant in more than `SMALL_DIMENSION` dimensions; in fewer it is a product of
    conjugates already, with a derivative by the product rule.
    """
    size = 2 ** ((a.algebra.dimension + 1) // 2)
    power = adjugate = a
    for k in range(1, size):
        adjugate = power - Fraction(size, k) * power["1"]
        power = a * adjugate
    return lift(-size) * adjugate


Tangents = Callable[[Expression, Layout], list[Expression]]


def _coefficient_tangents(_: Expression, layout: Layout) -> list[Expression]:
    """One basis blade for each stored coefficient."""
    if layout.implied:
        raise KernelError(
            "jacobian()",
            f"{layout} has implied coefficients",
            "a layout that stores what it has",
            "rebuild the element inside the kernel",
        )
    return [lift(Multivector(layout.algebra, {slot.blade: slot.sign})) for slot in layout.stored]


def _bivector_tangents(side: str) -> Tangents:
    def tangents(versor: Expression, layout: Layout) -> list[Expression]:
        blades = [lift(Multivector(layout.algebra, {blade: 1})) for blade in layout.algebra.blades(2)]
        return [blade * versor if side == "left" else versor * blade for blade in blades]

    return tangents


_KINDS: Mapping[str, Tangents] = {
    "coefficients": _coefficient_tangents,
    "left": _bivector_tangents("left"),
    "right": _bivector_tangents("right"),
}


def _parameter(definition: Kernel, wrt: str) -> tuple[int, Parameter]:
    for k, parameter in enumerate(definition.parameters):
        if parameter.name == wrt:
            if parameter.outer_shape:
                raise KernelError(
                    definition.where, f"{wrt} is an array", "one multivector or scalar to differentiate by"
                )
            return k, parameter
    names = " ".join(parameter.name for parameter in definition.parameters)
    raise KernelError(definition.where, f"no parameter {wrt}", f"one of {names}")


def _numbers(value: Expression, layout: Layout) -> list[Expression]:
    """The stored coefficients of a result, as scalar expressions."""
    if value.algebra == SCALARS:
        return [value if slot.blade == 0 else lift(0) for slot in layout.stored]
    return [Expression(Operation.COEFFICIENT, (value,), (slot.sign, slot.blade), SCALARS) for slot in layout.stored]


def _result_layout(definition: Kernel) -> Layout:
    """The layout of the one result that a kernel has."""
    traced = trace(definition)
    if len(traced.outputs) != 1 or traced.outputs[0].outer_shape:
        raise KernelError(definition.where, "several results", "one multivector or scalar to differentiate")
    return decide(traced, tuple(rewrite(traced.expressions).values())).layouts[0]


def jacobian(definition: Kernel, wrt: str, tangent: str = "coefficients") -> Kernel:
    """A kernel that gives the value of `definition` and its Jacobian with respect to one parameter.

    Parameters
    ----------
    definition : Kernel
        With one result.
    wrt : str
        Name of a parameter.
    tangent : {"coefficients", "left", "right"}
        Derivatives by each stored coefficient; or along ``B m`` or ``m B`` for each basis bivector `B`, which stays on
        the manifold of versors. A motor ``exp(B) m`` has the left Jacobian's columns as derivatives at ``B = 0``.

    Returns
    -------
    Kernel
        Named ``<name>_jacobian_<wrt>``, with results ``out`` and the matrix, one row for each coefficient of the value.
    """
    if tangent not in _KINDS:
        raise KernelError("jacobian()", f"tangent {tangent!r}", "one of " + ", ".join(_KINDS))
    place, parameter = _parameter(definition, wrt)
    layout = _result_layout(definition)
    sample = _KINDS[tangent](parameter.symbols(), parameter.layout)

    def function(*arguments: Expression) -> Any:
        value = lift(definition.function(*arguments))
        variable = arguments[place]
        columns = [
            _numbers(derivative([value], {variable: t})[0], layout) for t in _KINDS[tangent](variable, parameter.layout)
        ]
        return value, tuple(tuple(column[row] for column in columns) for row in range(layout.size))

    summary = f"Value and Jacobian of `{definition.name}` by {wrt} ({tangent})."
    matrix = ArrayOf(SCALAR, (layout.size, len(sample)))
    return Kernel(f"{definition.name}_jacobian_{wrt}", function, definition.parameters, (layout, matrix), summary)


def matrix_of(definition: Kernel, wrt: str) -> Kernel:
    """A kernel that gives the matrix of `definition`, which must be linear in the parameter `wrt`.

    ``f(..., x, ...)`` is the matrix times the stored coefficients of `x`; the parameter itself is no longer one.

    Raises
    ------
    KernelError
        When the result is not linear in `wrt`.
    """
    place, parameter = _parameter(definition, wrt)
    layout = _result_layout(definition)
    others = tuple(p for p in definition.parameters if p.name != wrt)

    def function(*arguments: Expression) -> Any:
        variable = parameter.symbols()
        value = lift(definition.function(*arguments[:place], variable, *arguments[place:]))
        columns = []
        for t in _coefficient_tangents(variable, parameter.layout):
            (column,) = derivative([value], {variable: t})
            if any(e.operation is Operation.INPUT and e == variable for e in topological([column])):
                raise KernelError(definition.where, f"the result is not linear in {wrt}", "a linear expression")
            columns.append(_numbers(column, layout))
        return tuple(tuple(column[row] for column in columns) for row in range(layout.size))

    summary = f"Matrix of `{definition.name}` as a linear map of {wrt}."
    matrix = ArrayOf(SCALAR, (layout.size, parameter.layout.size))
    return Kernel(f"{definition.name}_matrix", function, others, matrix, summary)


def jvp(definition: Kernel, wrt: str) -> Kernel:
    """A kernel that gives the value of `definition` and its derivative along a tangent of the parameter `wrt`.

    The tangent is a further parameter ``<wrt>_tangent``, of the same coefficients and without relations.
    """
    place, parameter = _parameter(definition, wrt)
    layout = _result_layout(definition)
    tangent = Parameter(f"{wrt}_tangent", _free(parameter.layout))

    def function(*arguments: Expression) -> Any:
        value = lift(definition.function(*arguments[:-1]))
        (slope,) = derivative([value], {arguments[place]: arguments[-1]})
        numbers = _numbers(slope, layout)
        return value, numbers[0] if layout.is_scalar else assemble(
            layout.algebra, dict(zip(layout.blades, numbers, strict=True))
        )

    summary = f"Value of `{definition.name}` and its derivative along {tangent.name}."
    return Kernel(
        f"{definition.name}_jvp_{wrt}", function, (*definition.parameters, tangent), (layout, _free(layout)), summary
    )


def vjp(definition: Kernel, wrt: str) -> Kernel:
    """A kernel that gives the value of `definition` and the gradient of its product with a cotangent.

    The cotangent is a further parameter ``cotangent`` with the result's coefficients; the gradient is an array of one
    number for each stored coefficient of `wrt`: the transposed Jacobian times the cotangent. No metric takes part.
    """
    place, parameter = _parameter(definition, wrt)
    layout = _result_layout(definition)
    cotangent = Parameter("cotangent", _free(layout))

    def function(*arguments: Expression) -> Any:
        value = lift(definition.function(*arguments[:-1]))
        weights = _numbers(arguments[-1], layout)
        return value, tuple(_gradient(value, arguments[place], parameter.layout, layout, weights))

    summary = f"Value of `{definition.name}` and the gradient by {wrt} of its product with the cotangent."
    return Kernel(
        f"{definition.name}_vjp_{wrt}",
        function,
        (*definition.parameters, cotangent),
        (layout, ArrayOf(SCALAR, (parameter.layout.size,))),
        summary,
    )


def hessian_vector(definition: Kernel, wrt: str) -> Kernel:
    """A kernel that gives value, gradient, and the Hessian times a tangent, of a scalar `definition`.

    Parameters
    ----------
    definition : Kernel
        With one result. If that is no scalar, what is differentiated is its product with a cotangent, as in `vjp`.
    wrt : str
        Name of a parameter. Its coefficients are differentiated by as if they were free; no metric takes part.

    Returns
    -------
    Kernel
        Named ``<name>_hessian_vector_<wrt>``. Its parameters are those of `definition`, then ``cotangent`` unless the
        result is a scalar, then ``<wrt>_tangent``, both without relations. Its results are the value of `definition`,
        the gradient, and the derivative of the gradient along the tangent: arrays of one number for each stored
        coefficient of `wrt`.
    """
    place, parameter = _parameter(definition, wrt)
    layout = _result_layout(definition)
    n, size = len(definition.parameters), parameter.layout.size
    further = [] if layout.is_scalar else [Parameter("cotangent", _free(layout))]
    further.append(Parameter(f"{wrt}_tangent", _free(parameter.layout)))

    def function(*arguments: Expression) -> Any:
        value, variable = lift(definition.function(*arguments[:n])), arguments[place]
        weights = [lift(1)] if layout.is_scalar else _numbers(arguments[n], layout)
        gradient = _gradient(value, variable, parameter.layout, layout, weights)
        return value, tuple(gradient), tuple(derivative(gradient, {variable: arguments[-1]}))

    of = f"`{definition.name}`" if layout.is_scalar else f"the product of `{definition.name}` with the cotangent"
    return Kernel(
        f"{definition.name}_hessian_vector_{wrt}",
        function,
        (*definition.parameters, *further),
        (layout, ArrayOf(SCALAR, (size,)), ArrayOf(SCALAR, (size,))),
        f"Value, gradient by {wrt}, and Hessian times {wrt}_tangent, of {of}.",
    )


def _gradient(
    value: Expression, variable: Expression, by: Layout, layout: Layout, weights: Sequence[Expression]
) -> list[Expression]:
    """The derivatives of ``weights . value`` by every stored coefficient of `variable`."""
    gradient = []
    for t in _coefficient_tangents(variable, by):
        column = _numbers(derivative([value], {variable: t})[0], layout)
        gradient.append(_sum([weight * entry for weight, entry in zip(weights, column, strict=True)]))
    return gradient


def _free(layout: Layout) -> Layout:
    """The stored coefficients of a layout alone: what its tangents have."""
    if layout.is_scalar:
        return SCALAR
    return layout.algebra.layout(f"{layout.name}_TANGENT", " ".join(layout.blades))
