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

from collections.abc import Sequence
from typing import Any

from ..algebra.layout import SCALAR, Layout
from ..algebra.operations import Operation
from ..errors import KernelError
from ..frontend.expression import Expression, lift, topological
from ..frontend.kernel import ArrayOf, Kernel, Parameter
from ..frontend.rows import Unrolled, leaves_of, nested
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
    """The layout of the one result that a kernel has."""
    if len(d.results) != 1 or outer_of(d.results[0]):
        raise KernelError(d.kernel.where, "several results", "one multivector or scalar to differentiate")
    return layout_of_type(d.results[0])


def _check_one(d: Differentiated) -> None:
    if d.parameter.outer_shape:
        raise KernelError(
            d.kernel.where, f"{d.parameter.name} is an array", "one multivector or scalar to differentiate by"
        )


def _check_stored(d: Differentiated, where: str) -> None:
    layout = d.parameter.layout
    if d.loops is not None and layout.implied:
        raise KernelError(
            where, f"{layout} has implied coefficients", "a layout that stores what it has",
            "rebuild the element inside the kernel",
        )  # fmt: skip


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
        If the result is an array of rows, there is a matrix for each row of it; if the parameter is one, there is a
        matrix for each row of the parameter.

    Raises
    ------
    KernelError
        When both the result and the parameter have named lengths: use `jvp` or `vjp`.
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
        ]  # of row 0 those of all matrices, then of row 1
        flat: list[Any] = []
        for of_row in parts(entries, len(matrices)):
            for places in zip(*of_row, strict=True):
                flat.append(Unrolled(places) if lengths or own_lengths else places[0])
        return [value, nested(flat, (layout.size, len(sample)))]

    def function(*arguments: Any) -> Any:
        if loops.is_recorded(d, arguments):
            return tuple((loops.matrices if own_lengths else loops.columns)(d, arguments, kind))
        return tuple(d.with_variables(arguments, derived))

    summary = f"Value and Jacobian of `{definition.name}` by {wrt} ({tangent})."
    matrix = type_of(SCALAR, lengths or own_lengths, (layout.size, len(sample)))
    return Kernel(f"{definition.name}_jacobian_{wrt}", function, definition.parameters, (d.results[0], matrix), summary)


def matrix_of(definition: Kernel, wrt: str) -> Kernel:
    """A kernel that gives the matrix of `definition`, which must be linear in the parameter `wrt`.

    ``f(..., x, ...)`` is the matrix times the stored coefficients of `x`; the parameter itself is no longer one.

    Raises
    ------
    KernelError
        When the result is not linear in `wrt`.
    """
    if definition.has_loops:
        raise KernelError(definition.where, "matrix_of() of a kernel with loops", "a kernel without", "use jacobian()")
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
            if any(e.operation is Operation.INPUT and e == variable for e in topological([column])):
                raise KernelError(definition.where, f"the result is not linear in {wrt}", "a linear expression")
            columns.append(numbers(column, layout))
        return tuple(tuple(column[row] for column in columns) for row in range(layout.size))

    summary = f"Matrix of `{definition.name}` as a linear map of {wrt}."
    matrix = ArrayOf(SCALAR, (layout.size, parameter.layout.size))
    return Kernel(f"{definition.name}_matrix", function, others, matrix, summary)


def jvp(definition: Kernel, wrt: str) -> Kernel:
    """A kernel that gives the values of `definition` and their derivatives along a tangent of the parameter `wrt`.

    The tangent is a further parameter ``<wrt>_tangent``, of the same coefficients and without relations. The results
    are those of `definition`, and then their derivatives in the same order.
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
            slopes = []
            for value, result in zip(values, d.results, strict=True):
                layout = layout_of_type(result)
                found = derivative(elements(value), tangents)
                slopes.append(over(value, [multivector(numbers(slope, layout), free(layout)) for slope in found]))
            return [*values, *slopes]

        return tuple(d.with_variables(own, derived))

    summary = f"Value of `{definition.name}` and its derivative along {tangent.name}."
    results = (*d.results, *map(tangent_type, d.results))
    return Kernel(f"{definition.name}_jvp_{wrt}", function, (*definition.parameters, tangent), results, summary)


def vjp(definition: Kernel, wrt: str) -> Kernel:
    """A kernel that gives the values of `definition` and the gradient of their product with a cotangent.

    The cotangent is a further parameter ``cotangent`` with the result's coefficients, or one for each result,
    ``cotangent_0`` and so on; the gradient is an array of one number for each stored coefficient of `wrt`: the
    transposed Jacobian times the cotangent. No metric takes part. By an array of numbers the gradient is an array of
    the same shape. A loop is run once and its transpose once, whatever the length is.
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

    summary = f"Value of `{definition.name}` and the gradient by {wrt} of its product with the cotangent."
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
    """The derivatives of ``weights . values`` by every stored coefficient of a parameter, in its structure."""
    flat = [
        (e, layout_of_type(result)) for value, result in zip(values, d.results, strict=True) for e in elements(value)
    ]
    of_weights = [weight for each in weights for weight in each]
    found: list[list[Expression]] = []
    for variable in variables:
        entries = []
        for t in coefficient_tangents(variable, d.parameter.layout):
            slopes = derivative([element for element, _ in flat], {variable: t})
            column = [x for slope, (_, layout) in zip(slopes, flat, strict=True) for x in numbers(slope, layout)]
            entries.append(weighted(of_weights, column))
        found.append(entries)
    remaining = iter(found)
    columns: list[Any] = []
    for leaf in leaves_of(argument):
        if isinstance(leaf, Unrolled):
            rows = [next(remaining) for _ in leaf.elements]
            columns += [Unrolled(column) for column in zip(*rows, strict=True)]
        else:
            columns += next(remaining)
    return nested(columns, shape)


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
    d = differentiated(definition, wrt)
    _one_result(d)
    gradient = vjp(definition, wrt)
    along = jvp(gradient, wrt)
    is_scalar = d.results[0] == SCALAR
    *own, cotangent, tangent = along.parameters
    further = [tangent] if is_scalar else [cotangent, tangent]

    def function(*arguments: Any) -> Any:
        *given, last = arguments
        value, slope, _, second = along.function(*given, *([lift(1)] if is_scalar else []), last)
        return value, slope, second

    of = f"`{definition.name}`" if is_scalar else f"the product of `{definition.name}` with the cotangent"
    return Kernel(
        f"{definition.name}_hessian_vector_{wrt}",
        function,
        (*own, *further),
        (d.results[0], gradient.returns[-1], gradient.returns[-1]),  # type: ignore[index]
        f"Value, gradient by {wrt}, and Hessian times {wrt}_tangent, of {of}.",
    )
