"""Derivatives and matrices of kernels, as kernels. They are compiled, counted and proved like other kernels.

Every product is bilinear. By the product rule, the derivative of an expression along a tangent is therefore an
expression that does not depend on coefficients or the metric. A column of a Jacobian is the derivative along a basis
blade or, for versors, along the product of a bivector and the versor, which is tangent to the manifold of versors.

The derivative of `select` is that of the selected operand. The derivative of ``abs`` at zero is that of the negative
side, and the derivative of ``minimum`` and ``maximum`` at equal arguments is that of the second argument. The
derivative of ``sqrt`` at zero is infinite, or NaN if the derivative of its argument vanishes as well. The same holds
for `norm` where the norm is zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..algebra.layout import SCALAR, Layout
from ..errors import KernelError
from ..frontend.expression import Expression, lift, topological
from ..frontend.kernel import ArrayOf, Kernel, Parameter
from ..frontend.rows import Unrolled, elements_of, leaves_of, nested, with_elements
from . import loops
from .directions import KINDS, coefficient_tangents
from .results import (
    Differentiated,
    differentiated,
    elements,
    free,
    gradient_type,
    layout_of_type,
    lengths_of,
    multivector,
    numbers,
    outer_of,
    over,
    parts,
    tangent_type,
    type_of,
    unused,
    weighted,
)
from .rules import derivative


def _one_result(d: Differentiated) -> Layout:
    """Return the layout of the only result of a kernel."""
    if len(d.results) != 1 or outer_of(d.results[0]):
        raise KernelError(d.kernel.where, "several results", "one multivector or scalar to differentiate")
    return layout_of_type(d.results[0])


def _check_one(d: Differentiated) -> None:
    if d.parameter.outer_shape:
        raise KernelError(
            d.kernel.where, f"{d.parameter.name} is an array", "a parameter that is one multivector or scalar"
        )


def _check_stored(d: Differentiated, where: str) -> None:
    layout = d.parameter.layout
    if d.loops is not None and layout.implied:
        raise KernelError(
            where, f"{layout} has implied coefficients", "a layout that stores all its coefficients",
            "rebuild the element inside the kernel",
        )  # fmt: skip


def jacobian(definition: Kernel, wrt: str, tangent: str = "coefficients") -> Kernel:
    """Return a kernel that computes the value of `definition` and its Jacobian with respect to one parameter.

    Parameters
    ----------
    definition : Kernel
        A kernel with one result.
    wrt : str
        The name of a parameter.
    tangent : {"coefficients", "left", "right"}
        The directions of the derivatives. ``"coefficients"`` are the stored coefficients. ``"left"`` and ``"right"``
        are ``B m`` and ``m B`` for each basis bivector `B`, which are tangent to the manifold of versors. The columns
        of the left Jacobian are the derivatives for ``exp(B) m`` at ``B = 0``.

    Returns
    -------
    Kernel
        A kernel named ``<name>_jacobian_<wrt>``. Its results are ``out`` and the matrix, with one row for each
        coefficient of the value and one column for each coefficient of the parameter. Named lengths of the result or
        of the parameter come first, as those of every argument: the shape is (coefficients of the result, coefficients
        of the parameter) without named lengths, and (n, coefficients of the result, coefficients of the parameter) if
        the result or the parameter has the length n.

    Raises
    ------
    KernelError
        When both the result and the parameter have named lengths. In this case, use `jvp` or `vjp`.
    """
    if tangent not in KINDS:
        raise KernelError("jacobian()", f"tangent {tangent!r}", "one of " + ", ".join(KINDS))
    d = differentiated(definition, wrt)
    _check_one(d)
    _check_stored(d, "jacobian()")
    layout, kind = _one_result(d), KINDS[tangent]
    lengths, own_lengths = lengths_of(d.results[0]), lengths_of(d.parameter.type)
    if lengths and own_lengths:
        raise KernelError(
            definition.where, f"the Jacobian of rows over {', '.join(lengths)} by rows over {', '.join(own_lengths)}",
            "a result or a parameter without named lengths", "use jvp(), for a column, or vjp(), for a row",
        )  # fmt: skip
    sample = kind(Parameter(wrt, d.parameter.layout).symbols(), d.parameter.layout)

    def derived(given: list[Any], variables: list[Expression]) -> list[Any]:
        (value,) = d.values(given)
        matrices = [
            [numbers(derivative([element], {variable: t})[0], layout) for t in kind(variable, d.parameter.layout)]
            for element in elements(value)
            for variable in variables
        ]
        entries = [
            [column[row] for column in matrix] for row in range(layout.size) for matrix in matrices
        ]  # Row 0 of all matrices, then row 1 of all matrices, and so on.
        flat: list[Any] = []
        for of_row in parts(entries, len(matrices)):
            for places in zip(*of_row, strict=True):
                flat.append(Unrolled(places) if lengths or own_lengths else places[0])
        return [value, nested(flat, (layout.size, len(sample)))]

    def function(*arguments: Any) -> Any:
        if loops.is_recorded(d, arguments):
            return tuple((loops.matrices if own_lengths else loops.columns)(d, arguments, kind))
        return tuple(d.with_variables(arguments, derived))

    summary = f"Return the value of `{definition.name}` and its Jacobian with respect to {wrt} ({tangent})."
    matrix = type_of(SCALAR, lengths or own_lengths, (layout.size, len(sample)))
    return Kernel(f"{definition.name}_jacobian_{wrt}", function, definition.parameters, (d.results[0], matrix), summary)


def matrix_of(definition: Kernel, wrt: str) -> Kernel:
    """Return a kernel that computes the matrix of `definition`, which must be linear in the parameter `wrt`.

    ``f(..., x, ...)`` is the matrix times the stored coefficients of `x`. The returned kernel has all parameters of
    `definition` except `wrt`.

    Raises
    ------
    KernelError
        When the result is not linear in `wrt`.
    """
    if isinstance(definition, Kernel) and definition.has_loops:
        raise KernelError(definition.where, "matrix_of() of a kernel with loops", "no loops", "use jacobian()")
    d = differentiated(definition, wrt)
    _check_one(d)
    layout, parameter, place = _one_result(d), d.parameter, d.place
    others = tuple(p for p in definition.parameters if p.name != wrt)

    def function(*arguments: Expression) -> Any:
        variable = parameter.symbols()
        value = lift(definition.function(*arguments[:place], variable, *arguments[place:]))
        columns = []
        for t in coefficient_tangents(variable, parameter.layout):
            (column,) = derivative([value], {variable: t})
            if any(e is variable for e in topological([column])):
                raise KernelError(definition.where, f"the result is not linear in {wrt}", "a linear expression")
            columns.append(numbers(column, layout))
        return tuple(tuple(column[row] for column in columns) for row in range(layout.size))

    summary = f"Return the matrix of `{definition.name}` as a linear map of {wrt}."
    matrix = ArrayOf(SCALAR, (layout.size, parameter.layout.size))
    return Kernel(f"{definition.name}_matrix", function, others, matrix, summary)


def jvp(definition: Kernel, wrt: str) -> Kernel:
    """Return a kernel that computes the values of `definition` and their derivatives along a tangent of `wrt`.

    The tangent is an additional parameter ``<wrt>_tangent`` with the same coefficients and without relations. The
    results are those of `definition`, followed by their derivatives in the same order.
    """
    d = differentiated(definition, wrt)
    _check_stored(d, "jvp()")
    tangent = Parameter(unused(definition, f"{wrt}_tangent"), tangent_type(d.parameter.type))  # type: ignore[arg-type]

    def function(*arguments: Any) -> Any:
        *own, along = arguments
        if loops.is_recorded(d, arguments):
            return tuple(loops.forward(d, own, tangent, along))

        def derived(given: list[Any], variables: list[Expression]) -> list[Any]:
            values = d.values(given)
            tangents = dict(zip(variables, map(lift, elements(along)), strict=True))
            derivatives = []
            for value, result in zip(values, d.results, strict=True):
                layout = layout_of_type(result)
                found = derivative(elements(value), tangents)
                derivatives.append(over(value, [multivector(numbers(each, layout), free(layout)) for each in found]))
            return [*values, *derivatives]

        return tuple(d.with_variables(own, derived))

    summary = f"Return the value of `{definition.name}` and its derivative along {tangent.name}."
    results = (*d.results, *map(tangent_type, d.results))
    return Kernel(f"{definition.name}_jvp_{wrt}", function, (*definition.parameters, tangent), results, summary)


def vjp(definition: Kernel, wrt: str) -> Kernel:
    """Return a kernel that computes the values of `definition` and the gradient of their product with a cotangent.

    The cotangent is an additional parameter ``cotangent`` with the coefficients of the result. For several results,
    there are parameters ``cotangent_0``, ``cotangent_1`` and so on. The gradient is the transposed Jacobian times the
    cotangent, an array of one number for each stored coefficient of `wrt`. It does not involve the metric. The gradient
    with respect to an array of numbers has the shape of the array. Every loop and its transpose run once, independently
    of the length.
    """
    d = differentiated(definition, wrt)
    _check_stored(d, "vjp()")
    names = [f"cotangent_{k}" for k in range(len(d.results))] if len(d.results) > 1 else ["cotangent"]
    cotangents = tuple(
        Parameter(unused(definition, name), tangent_type(result)) for name, result in zip(names, d.results, strict=True)
    )
    type_ = gradient_type(d.parameter)
    n = len(cotangents)

    def function(*arguments: Any) -> Any:
        own, given = arguments[:-n], arguments[-n:]
        if loops.is_recorded(d, arguments):
            pairs = list(zip(cotangents, given, strict=True))
            return tuple(loops.reverse(d, own, pairs, outer_of(type_)))

        def derived(own: list[Any], variables: list[Expression]) -> list[Any]:
            values = d.values(own)
            weights = [
                numbers(lift(each), layout_of_type(result))
                for cotangent, result in zip(given, d.results, strict=True)
                for each in elements(cotangent)
            ]
            return [*values, _gradient(d, values, own[d.place], variables, weights, outer_of(type_))]

        return tuple(d.with_variables(own, derived))

    summary = (
        f"Return the value of `{definition.name}` and the gradient of its product with the cotangent "
        f"with respect to {wrt}."
    )
    return Kernel(
        f"{definition.name}_vjp_{wrt}", function, (*definition.parameters, *cotangents), (*d.results, type_), summary
    )


def _gradient(
    d: Differentiated,
    values: Sequence[Any],
    argument: Any,
    variables: Sequence[Expression],
    weights: Sequence[Sequence[Expression]],
    shape: tuple[int, ...],
) -> Any:
    """Return the derivatives of ``weights . values`` with respect to all stored coefficients of a parameter.

    The result has the structure of the parameter.
    """
    flat = [
        (e, layout_of_type(result)) for value, result in zip(values, d.results, strict=True) for e in elements(value)
    ]
    of_weights = [weight for each in weights for weight in each]
    found: list[list[Expression]] = []
    for variable in variables:
        entries = []
        for t in coefficient_tangents(variable, d.parameter.layout):
            derivatives = derivative([element for element, _ in flat], {variable: t})
            column = [x for each, (_, layout) in zip(derivatives, flat, strict=True) for x in numbers(each, layout)]
            entries.append(weighted(of_weights, column))
        found.append(entries)
    remaining = iter(found)
    columns: list[Any] = []
    for leaf in leaves_of(argument):
        if isinstance(leaf, Unrolled):
            rows = [next(remaining) for _ in elements_of(leaf)]
            columns += [with_elements(leaf, iter(column)) for column in zip(*rows, strict=True)]
        else:
            columns += next(remaining)
    return nested(columns, shape)


def hessian_vector(definition: Kernel, wrt: str) -> Kernel:
    """Return a kernel that computes the value, the gradient, and the Hessian times a tangent, of a scalar `definition`.

    Parameters
    ----------
    definition : Kernel
        A kernel with one result. If the result is not a scalar, its product with a cotangent is differentiated, as in
        `vjp`.
    wrt : str
        The name of a parameter. Its coefficients are treated as independent variables. The metric is not involved.

    Returns
    -------
    Kernel
        A kernel named ``<name>_hessian_vector_<wrt>``. Its parameters are those of `definition`, then ``cotangent``
        unless the result is a scalar, then ``<wrt>_tangent``, both without relations. Its results are the value of
        `definition`, the gradient, and the derivative of the gradient along the tangent. The latter two are arrays of
        one number for each stored coefficient of `wrt`.
    """
    d = differentiated(definition, wrt)
    _one_result(d)
    gradient = vjp(definition, wrt)
    along = jvp(gradient, wrt)
    is_scalar = d.results[0] == SCALAR
    *own, cotangent, tangent = along.parameters
    further = [tangent] if is_scalar else [cotangent, tangent]

    def function(*arguments: Any) -> Any:
        *given, last = arguments
        value, first, _, second = along.function(*given, *([lift(1)] if is_scalar else []), last)
        return value, first, second

    of = f"`{definition.name}`" if is_scalar else f"the product of `{definition.name}` with the cotangent"
    return Kernel(
        f"{definition.name}_hessian_vector_{wrt}",
        function,
        (*own, *further),
        (d.results[0], gradient.returns[-1], gradient.returns[-1]),  # type: ignore[index]
        f"Return value, gradient with respect to {wrt}, and Hessian times {wrt}_tangent, of {of}.",
    )
