"""The functions for writing kernels. On multivectors they compute values; on expressions they build expressions.

The operators ``+ - * ^ & ~ /`` are equivalent to the operations of their names. Every other operation has one function
here, under its full name. The operations are defined in the table of operations, `gacompiler.algebra.operations`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.coefficients import is_number
from ..algebra.functions import binary, unary
from ..algebra.layout import SCALARS
from ..algebra.meanings import MEANINGS
from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..algebra.versors import SMALL_DIMENSION, conjugate_factors
from ..errors import AlgebraError, InexactError, OperandError
from .expression import IN_FUNCTION, Expression, lift, node
from .operands import checked, own_operations, refuse, without_values
from .recording import is_recording
from .rows import Array

__all__ = [
    "absolute", "acos", "anticommutator", "assemble", "atan2", "clifford_conjugate", "coefficient", "commutator",
    "determinant", "dual", "equal", "floor", "geometric_product", "grade", "grade_involution", "hestenes_product",
    "inner_product", "inverse", "join", "left_contraction", "maximum", "meet", "minimum", "norm", "norm_squared",
    "normalize", "outer_product", "polarity", "regressive_product", "reverse", "right_contraction", "sandwich",
    "scalar_product", "select", "undual",
]  # fmt: skip


_OF_ALGEBRA = (Operation.DUAL, Operation.UNDUAL, Operation.POLARITY, Operation.REGRESSIVE_PRODUCT)
"""Operations whose results depend on the algebra of a number."""


def apply(operation: Operation, *arguments: Any) -> Any:
    """Apply `operation`: return an expression if any argument is an expression, else the value.

    Numeric objects apply their own operation of the same name.

    Raises
    ------
    OperandError
        If an argument is neither a multivector nor a number.
    AlgebraError
        If the result depends on the algebra, and all arguments are numbers.
    """
    if operation in _OF_ALGEBRA and all(is_number(a) or getattr(a, "algebra", None) is SCALARS for a in arguments):
        remedy = "multiply the number by algebra.pseudoscalar, or write algebra.scalar(x)"
        raise AlgebraError(f"{operation}()", "numbers, which belong to no algebra", "a multivector", remedy)
    if any(isinstance(argument, Expression) for argument in arguments):
        return node(operation, *arguments)
    for argument in arguments:
        if isinstance(argument, Array):
            argument.refuse()
    run = own_operations(arguments)
    if run is not None:
        return run(operation, *arguments)
    checked(operation, arguments)
    try:
        return _value(operation, arguments)
    except InexactError:
        if IN_FUNCTION.get() or is_recording():  # The kernel rounds the value of sqrt(2).
            return node(operation, *arguments)
        raise


def _value(operation: Operation, arguments: tuple[Any, ...]) -> Any:
    """Return the value of an operation on numbers and multivectors."""
    algebra = next((a.algebra for a in arguments if isinstance(a, Multivector)), None)
    if algebra is None:
        result = MEANINGS[operation](*(SCALARS.scalar(argument) for argument in arguments))
        return result.scalar
    return MEANINGS[operation](*(a if isinstance(a, Multivector) else algebra.scalar(a) for a in arguments))


geometric_product = binary(apply, Operation.GEOMETRIC_PRODUCT)
outer_product = binary(apply, Operation.OUTER_PRODUCT)
regressive_product = binary(apply, Operation.REGRESSIVE_PRODUCT)
left_contraction = binary(apply, Operation.LEFT_CONTRACTION)
right_contraction = binary(apply, Operation.RIGHT_CONTRACTION)
inner_product = binary(apply, Operation.INNER_PRODUCT)
hestenes_product = binary(apply, Operation.HESTENES_PRODUCT)
scalar_product = binary(apply, Operation.SCALAR_PRODUCT)
commutator = binary(apply, Operation.COMMUTATOR)
anticommutator = binary(apply, Operation.ANTICOMMUTATOR)

reverse = unary(apply, Operation.REVERSE)
grade_involution = unary(apply, Operation.GRADE_INVOLUTION)
clifford_conjugate = unary(apply, Operation.CLIFFORD_CONJUGATE)
dual = unary(apply, Operation.DUAL)
undual = unary(apply, Operation.UNDUAL)
polarity = unary(apply, Operation.POLARITY)

inverse = unary(apply, Operation.INVERSE)
norm_squared = unary(apply, Operation.NORM_SQUARED)
norm = unary(apply, Operation.NORM)
normalize = unary(apply, Operation.NORMALIZE)

sqrt = unary(apply, Operation.SQRT)
sin = unary(apply, Operation.SIN)
cos = unary(apply, Operation.COS)
acos = unary(apply, Operation.ACOS)
exp = unary(apply, Operation.EXP)
log = unary(apply, Operation.LOG)
absolute = unary(apply, Operation.ABS, "absolute")
floor = unary(apply, Operation.FLOOR)
minimum = binary(apply, Operation.MINIMUM)
maximum = binary(apply, Operation.MAXIMUM)
equal = binary(apply, Operation.EQUAL)


def join(a: Any, b: Any) -> Any:
    """Compute the smallest object that contains both: ``a & b`` in plane-based algebras (PGA), ``a ^ b`` in others.

    An algebra is plane-based if a basis vector is orthogonal to all basis vectors. There points are pseudovectors. In
    conformal algebras the join of two points is a point pair. It is 0 for objects that have something in common.
    """
    a, b = without_values("join()", (a, b))
    return apply(Operation.REGRESSIVE_PRODUCT if _is_plane_based(a, b) else Operation.OUTER_PRODUCT, a, b)


def meet(a: Any, b: Any) -> Any:
    """Compute the intersection of two objects: ``a ^ b`` in plane-based algebras (PGA), ``a & b`` in others.

    It is the intersection if both objects together span the whole space: two lines of space that meet give 0.
    """
    a, b = without_values("meet()", (a, b))
    return apply(Operation.OUTER_PRODUCT if _is_plane_based(a, b) else Operation.REGRESSIVE_PRODUCT, a, b)


def _is_plane_based(*operands: Any) -> bool:
    """Whether a basis vector of the algebra of the operands is orthogonal to all basis vectors."""
    for each in operands:
        gram = getattr(getattr(each, "algebra", None), "gram", ())
        if any(not any(row) for row in gram):
            return True
    return False


def sandwich(versor: Any, x: Any) -> Any:
    """Compute the sandwich product ``v x ~v``, or ``v grade_involution(x) ~v`` for an odd versor."""
    return apply(Operation.SANDWICH, versor, x)


def determinant(a: Any) -> Any:
    """Compute the determinant of the matrix of `a` (Shirokov 2021), a scalar.

    It is zero exactly if `a` has no inverse. It is a polynomial of degree ``2**ceil(n/2)`` in the coefficients, where
    `n` is the dimension of the algebra.
    """
    if isinstance(a, Expression) and a.algebra.dimension <= SMALL_DIMENSION:
        return conjugate_factors(a, clifford_conjugate, complete=True)[1]["1"]
    return apply(Operation.DETERMINANT, a)


def atan2(y: Any, x: Any) -> Any:
    """Compute the angle of the point (x, y), in (-pi, pi]."""
    return apply(Operation.ATAN2, y, x)


def grade(a: Any, *grades: int) -> Any:
    """Return the part of the given grades."""
    return as_element("grade()", a).grade(*grades)


def coefficient(a: Any, blade: str) -> Any:
    """Return the coefficient of a blade, given in any spelling."""
    if not isinstance(blade, str):
        raise OperandError(
            "coefficient()", f"{blade!r} as a blade", "the name of a blade", 'as in coefficient(x, "e12")'
        )
    return as_element("coefficient()", a)[blade]


def as_element(where: str, a: Any) -> Any:
    """Return `a` with the methods of a multivector: a number as an element of the algebra of scalars."""
    (a,) = without_values(where, (a,))
    if isinstance(a, (Expression, Multivector)) or own_operations((a,)) is not None:
        return a
    if not is_number(a):
        refuse(where, a)
    return SCALARS.scalar(a)


def assemble(algebra: Algebra, coefficients: Mapping[str, Any]) -> Any:
    """Create a multivector from scalar expressions or numbers by blade: ``assemble(PGA3, {"e12": sin(a)})``."""
    algebra = getattr(algebra, "algebra", algebra)  # of a space
    if not (isinstance(algebra, Algebra) and isinstance(coefficients, Mapping)):
        found = f"{type(algebra).__name__} and {type(coefficients).__name__}"
        raise OperandError("assemble()", found, 'an algebra and scalars by blade, as in assemble(PGA3, {"e12": x})')
    if not any(isinstance(value, Expression) for value in coefficients.values()):
        return algebra.multivector(coefficients)
    arguments = tuple(lift(value) for value in coefficients.values())
    return Expression(Operation.ASSEMBLE, arguments, tuple(algebra.blade(name) for name in coefficients), algebra)


def select(condition: Any, a: Any, b: Any) -> Any:
    """Return `a` where the scalar `condition` is not zero, else `b`.

    For multivectors, the selection is made for each coefficient.
    """
    if not any(isinstance(x, Expression) for x in (condition, a, b)):
        for x in (condition, a, b):
            if isinstance(x, Array):
                x.refuse()
        checked(Operation.SELECT, tuple(x for x in (condition, a, b) if own_operations((x,)) is None))
        return a if _is_true(condition) else b
    x, y = lift(a), lift(b)
    if x.is_scalar and y.is_scalar:
        return node(Operation.SELECT, condition, x, y)
    algebra = x.algebra if x.algebra != SCALARS else y.algebra
    names = [algebra.spelling(blade)[1] for blade in sorted(x.blades | y.blades)]
    return assemble(
        algebra, {name: node(Operation.SELECT, condition, _part(x, name), _part(y, name)) for name in names}
    )


def _is_true(condition: Any) -> bool:
    try:
        return bool(condition)
    except (TypeError, ValueError) as error:
        raise AlgebraError(
            "select()",
            f"a condition of unknown truth value, {condition}",
            "a number, or an expression of the parameters of a kernel",
            "use the functions of gacompiler.symbolic for symbolic formulas",
        ) from error


def _part(x: Expression, name: str) -> Expression:
    return x[name] if x.algebra != SCALARS else x if name == "1" else lift(0)
