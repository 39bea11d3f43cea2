"""The functions that kernels are written with. On multivectors they compute; on expressions they build.

Operators ``+ - * ^ & ~ /`` do the same as ``add`` ... ``divide``; everything else has its full name here, once.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.layout import SCALARS
from ..algebra.multivector import Multivector
from ..algebra.operations import OPERATIONS
from ..algebra.versors import SMALL_DIMENSION, conjugate_factors
from ..errors import AlgebraError
from .expression import ASSEMBLE, Expression, lift, node


def apply(operation: str, *arguments: Any) -> Any:
    """`operation` on anything: an expression if any argument is one, else the value."""
    if any(isinstance(argument, Expression) for argument in arguments):
        return node(operation, *arguments)
    algebra = next((a.algebra for a in arguments if isinstance(a, Multivector)), None)
    if algebra is None:
        result = OPERATIONS[operation](*(SCALARS.scalar(argument) for argument in arguments))
        return result.scalar
    return OPERATIONS[operation](*(a if isinstance(a, Multivector) else algebra.scalar(a) for a in arguments))


def geometric_product(a: Any, b: Any) -> Any:
    """``a * b``."""
    return apply("geometric_product", a, b)


def outer_product(a: Any, b: Any) -> Any:
    """``a ^ b``: of grades p and q, the part of grade p + q."""
    return apply("outer_product", a, b)


def left_contraction(a: Any, b: Any) -> Any:
    """Of grades p and q, the part of grade q - p of the geometric product."""
    return apply("left_contraction", a, b)


def right_contraction(a: Any, b: Any) -> Any:
    """Of grades p and q, the part of grade p - q of the geometric product."""
    return apply("right_contraction", a, b)


def inner_product(a: Any, b: Any) -> Any:
    """Of grades p and q, the part of grade \\|p - q\\| of the geometric product; scalars take part."""
    return apply("inner_product", a, b)


def hestenes_product(a: Any, b: Any) -> Any:
    """`inner_product`, but zero where one factor is a scalar."""
    return apply("hestenes_product", a, b)


def scalar_product(a: Any, b: Any) -> Any:
    """The scalar part of the geometric product."""
    return apply("scalar_product", a, b)


def regressive_product(a: Any, b: Any) -> Any:
    """``a & b``: ``undual(dual(a) ^ dual(b))``, in every metric."""
    return apply("regressive_product", a, b)


def join(a: Any, b: Any) -> Any:
    """The smallest object that contains both, where points are pseudovectors (plane-based algebras): ``a & b``."""
    return apply("regressive_product", a, b)


def meet(a: Any, b: Any) -> Any:
    """The common part of two objects, where planes are vectors (plane-based algebras): ``a ^ b``."""
    return apply("outer_product", a, b)


def commutator(a: Any, b: Any) -> Any:
    """``(a b - b a) / 2``."""
    return apply("commutator", a, b)


def anticommutator(a: Any, b: Any) -> Any:
    """``(a b + b a) / 2``."""
    return apply("anticommutator", a, b)


def reverse(a: Any) -> Any:
    """``~a``."""
    return apply("reverse", a)


def grade_involution(a: Any) -> Any:
    """Every vector negated."""
    return apply("grade_involution", a)


def clifford_conjugate(a: Any) -> Any:
    """Reverse and grade involution."""
    return apply("clifford_conjugate", a)


def dual(a: Any) -> Any:
    """Right complement, metric-free: ``b ^ dual(b) = I`` for basis blades."""
    return apply("dual", a)


def undual(a: Any) -> Any:
    """The inverse of `dual`."""
    return apply("undual", a)


def polarity(a: Any) -> Any:
    """The metric dual ``a I**-1``; raises in a degenerate metric."""
    return apply("polarity", a)


def sandwich(versor: Any, x: Any) -> Any:
    """``v x ~v``; for an odd versor ``v grade_involution(x) ~v``."""
    return apply("sandwich", versor, x)


def inverse(a: Any) -> Any:
    """``b`` with ``a b = 1``."""
    return apply("inverse", a)


def determinant(a: Any) -> Any:
    """A scalar that is zero exactly where `a` has no inverse: the determinant of its matrix (Shirokov 2021).

    Of degree ``2**ceil(n/2)`` in the coefficients, where `n` is the dimension of the algebra.
    """
    if isinstance(a, Expression) and a.algebra.dimension <= SMALL_DIMENSION:
        return conjugate_factors(a, clifford_conjugate, complete=True)[1]["1"]
    return apply("determinant", a)


def norm_squared(a: Any) -> Any:
    """The scalar part of ``a ~a``."""
    return apply("norm_squared", a)


def norm(a: Any) -> Any:
    """``sqrt(|a ~a|)``: the root of the absolute value of `norm_squared`.

    The absolute value costs an operation only where squares of both signs can occur: in conformal and Minkowski's
    metrics, not in Euclidean ones, with or without null vectors.
    """
    return apply("norm", a)


def normalize(a: Any) -> Any:
    """``a / norm(a)``: then ``a ~a`` has the scalar part 1, or -1 where it was negative.

    It is negative for real conformal spheres, circles, lines and planes that are outer products of points, and for
    spacelike vectors where one square is positive. A null element has the norm 0: its quotient is infinite, or not a
    number where a coefficient is 0 too.
    """
    return apply("normalize", a)


def grade(a: Any, *grades: int) -> Any:
    """The part of the given grades."""
    return a.grade(*grades)


def coefficient(a: Any, blade: str) -> Any:
    """The coefficient of a blade, in any spelling."""
    return a[blade]


def assemble(algebra: Algebra, coefficients: Mapping[str, Any]) -> Any:
    """A multivector from scalar expressions or numbers by blade: ``assemble(PGA3, {"e12": sin(a)})``."""
    if not any(isinstance(value, Expression) for value in coefficients.values()):
        return algebra.multivector(coefficients)
    arguments = tuple(lift(value) for value in coefficients.values())
    return Expression(ASSEMBLE, arguments, tuple(algebra.blade(name) for name in coefficients), algebra)


def sqrt(a: Any) -> Any:
    """Square root of a scalar."""
    return apply("sqrt", a)


def sin(a: Any) -> Any:
    """Sine of a scalar, radians."""
    return apply("sin", a)


def cos(a: Any) -> Any:
    """Cosine of a scalar, radians."""
    return apply("cos", a)


def atan2(y: Any, x: Any) -> Any:
    """Angle of the point (x, y), in (-pi, pi]."""
    return apply("atan2", y, x)


def acos(a: Any) -> Any:
    """Arc cosine of a scalar, in [0, pi]."""
    return apply("acos", a)


def exp(a: Any) -> Any:
    """Exponential of a scalar."""
    return apply("exp", a)


def log(a: Any) -> Any:
    """Natural logarithm of a scalar."""
    return apply("log", a)


def absolute(a: Any) -> Any:
    """Absolute value of a scalar."""
    return apply("abs", a)


def minimum(a: Any, b: Any) -> Any:
    """The smaller of two scalars."""
    return apply("minimum", a, b)


def maximum(a: Any, b: Any) -> Any:
    """The larger of two scalars."""
    return apply("maximum", a, b)


def equal(a: Any, b: Any) -> Any:
    """1 where two scalars are equal, else 0."""
    return apply("equal", a, b)


def select(condition: Any, a: Any, b: Any) -> Any:
    """`a` where the scalar `condition` is not zero, else `b`; blade by blade when they are multivectors."""
    if not any(isinstance(x, Expression) for x in (condition, a, b)):
        return a if _is_true(condition) else b
    x, y = lift(a), lift(b)
    if x.is_scalar and y.is_scalar:
        return node("select", condition, x, y)
    algebra = x.algebra if x.algebra != SCALARS else y.algebra
    names = [algebra.spelling(blade)[1] for blade in sorted(x.blades | y.blades)]
    return assemble(algebra, {name: node("select", condition, _part(x, name), _part(y, name)) for name in names})


def _is_true(condition: Any) -> bool:
    try:
        return bool(condition)
    except TypeError as error:
        raise AlgebraError(
            "select()",
            f"whether {condition} is not known",
            "numbers, or parameters of a kernel",
            "functions of formulas, such as exp, are in gacompiler.symbolic",
        ) from error


def _part(x: Expression, name: str) -> Expression:
    return x[name] if x.algebra != SCALARS else x if name == "1" else lift(0)
