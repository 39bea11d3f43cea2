"""The operations of the algebra on symbolic multivectors, with the same names as in the rest of the package."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy

from ..algebra.coefficients import is_zero
from ..algebra.functions import binary, unary
from ..algebra.meanings import MEANINGS
from ..algebra.multivector import Multivector
from ..algebra.operations import BY_NAME, Operation
from ..errors import AlgebraError
from ..rings.symbolic import Expanded
from .multivector import SymbolicMultivector, required, symbolic
from .printing import common_factor
from .relations import reduce

__all__ = [
    "anticommutator", "clifford_conjugate", "commutator", "determinant", "dual", "exp", "geometric_product",
    "grade", "grade_involution", "hestenes_product", "inner_product", "inverse", "left_contraction", "log", "norm",
    "norm_squared", "normalize", "outer_product", "polarity", "power", "regressive_product", "reverse",
    "right_contraction", "sandwich", "scalar_product", "sqrt", "undual",
]  # fmt: skip


def _apply(operation: Operation, *arguments: Any) -> SymbolicMultivector:
    first = next((a for a in arguments if isinstance(a, Multivector)), None)
    if first is None:
        raise AlgebraError(f"{operation}()", ", ".join(type(a).__name__ for a in arguments), "at least one multivector")
    lifted = tuple(map(symbolic(first).lift, arguments))
    return symbolic(MEANINGS[operation](*lifted), operation, *lifted)


geometric_product = binary(_apply, Operation.GEOMETRIC_PRODUCT)
outer_product = binary(_apply, Operation.OUTER_PRODUCT)
regressive_product = binary(_apply, Operation.REGRESSIVE_PRODUCT)
left_contraction = binary(_apply, Operation.LEFT_CONTRACTION)
right_contraction = binary(_apply, Operation.RIGHT_CONTRACTION)
inner_product = binary(_apply, Operation.INNER_PRODUCT)
hestenes_product = binary(_apply, Operation.HESTENES_PRODUCT)
scalar_product = binary(_apply, Operation.SCALAR_PRODUCT)
commutator = binary(_apply, Operation.COMMUTATOR)
anticommutator = binary(_apply, Operation.ANTICOMMUTATOR)

reverse = unary(_apply, Operation.REVERSE)
grade_involution = unary(_apply, Operation.GRADE_INVOLUTION)
clifford_conjugate = unary(_apply, Operation.CLIFFORD_CONJUGATE)
dual = unary(_apply, Operation.DUAL)
undual = unary(_apply, Operation.UNDUAL)
polarity = unary(_apply, Operation.POLARITY)

inverse = unary(_apply, Operation.INVERSE)
determinant = unary(_apply, Operation.DETERMINANT)
norm_squared = unary(_apply, Operation.NORM_SQUARED)
norm = unary(_apply, Operation.NORM)
normalize = unary(_apply, Operation.NORMALIZE)


def run_operation(name: str, *operands: Any) -> Any:
    """Apply the function `name` of this module, or any other operation of the table."""
    if name in OWN:
        return OWN[name](*operands)
    return _apply(BY_NAME[name], *operands)


def sandwich(versor: Any, x: Any) -> SymbolicMultivector:
    """Return ``v x ~v``, or ``v grade_involution(x) ~v`` for an odd versor."""
    return _apply(Operation.SANDWICH, versor, x)


def grade(a: Any, *grades: int) -> SymbolicMultivector:
    """Return the part of the given grades."""
    return required("grade()", a).grade(*grades)


def exp(a: Any) -> Any:
    """Return the exponential in closed form.

    Parameters
    ----------
    a : scalar or SymbolicMultivector
        A scalar plus a part `b`. The square of `b` must be a scalar, or a scalar plus an element that squares to zero
        and commutes with `b`. This holds for all blades, and for all bivectors in up to three dimensions and in
        projective algebras.

    Raises
    ------
    AlgebraError
        When the square has another form. In this case, split `a` into commuting blades and multiply their exponentials.

    Notes
    -----
    With ``b**2 = s + p`` and ``p**2 = 0``: ``exp(b) = C(s) + C'(s) p + (S(s) + S'(s) p) b`` where ``C(s) =
    cosh(sqrt(s))`` and ``S(s) = sinh(sqrt(s)) / sqrt(s)``. Where `s` has a negative sign, these are written as
    trigonometric functions.
    """
    if not isinstance(a, Multivector):
        return sympy.exp(a)
    lifted = required("exp()", a)
    b = lifted.keep(bool)
    size, rest = factor_of(b)
    square = reduce(rest * rest)
    p = square.keep(bool)
    if not (_vanishes(p * p) and _vanishes(rest * p - p * rest)):
        raise AlgebraError(
            f"exp({lifted})",
            f"a square of {square}",
            "a scalar, optionally plus a part that squares to zero",
            "split it into commuting blades and multiply their exponentials",
        )
    s = square["1"]
    cosine, sine = even_and_odd(s, size)
    result = cosine + sine * rest
    if p.terms:
        derivative = size**3 / 6 if s == 0 else (size * cosine - sine) / (2 * s)
        result = result + size * sine / 2 * p + derivative * (p * rest)
    return symbolic(sympy.exp(lifted["1"]) * result)


def factor_of(b: SymbolicMultivector) -> tuple[Any, SymbolicMultivector]:
    """Split `b` into a scalar and an element whose product is `b`; the element has as few symbols as possible."""
    if len(b.terms) == 1:
        ((blade, value),) = b.expressions.items()
        return value, SymbolicMultivector(b.algebra, {blade: 1})
    size, _ = common_factor(b)
    return size, symbolic(b / size)


def even_and_odd(s: Any, size: Any) -> tuple[Any, Any]:
    """Return ``cosh(size sqrt(s))`` and ``sinh(size sqrt(s)) / sqrt(s)``; the sign of the root is arbitrary."""
    if s == 0:
        return sympy.Integer(1), size
    negative, root = _signed_root(s)
    cosine, sine = (sympy.cos, sympy.sin) if negative else (sympy.cosh, sympy.sinh)
    return cosine(size * root), sine(size * root) / root


def _signed_root(s: Any) -> tuple[bool, Any]:
    """Return whether `s` has a negative sign, and the root of its absolute value, of any sign."""
    negative = s.is_negative or (s.is_positive is not True and s.could_extract_minus_sign())
    return negative, signless(sympy.sqrt(sympy.factor(-s if negative else s)))


def signless(root: Any) -> Any:
    """Return a root of arbitrary sign without the absolute values of its factors."""
    factors = [power.as_base_exp() for power in sympy.Mul.make_args(root)]
    return sympy.Mul(*((b.args[0] if isinstance(b, sympy.Abs) else b) ** e for b, e in factors))


def log(a: Any) -> Any:
    """Return the principal logarithm of a scalar, of a scalar plus a part `b` whose square is a scalar, or of a motor.

    This is half the logarithm of the squared size, and the angle in [0, pi] along `b`; see `exp` for the forms of `b`.
    The exponential is `a` itself, never ``-a``. For `b` with a positive square, it is real where the scalar is larger
    than the root of that square, and otherwise complex.

    Parameters
    ----------
    a : scalar or SymbolicMultivector
        Of grades 0, 2 and 4, as a screw motion, it must satisfy ``a ~a = 1``, and its part of grade 4 must be null.

    Raises
    ------
    AlgebraError
        If `a` has another form, or is a motor whose ``a ~a`` is a number other than 1.
    """
    if not isinstance(a, Multivector):
        return sympy.log(a)
    if (screw := _screw(a)) is not None:
        w, b, p, s = screw
        negative, root = _signed_root(s)
        ratio = (sympy.atan2(root, w) if negative else sympy.atanh(root / w)) / root
        return symbolic(b * ratio + (p * b).grade(2) * ((1 - w * ratio) / s))
    w, b, s = split_number("log()", a)
    if s == 0:
        return symbolic(b / w + sympy.log(w)) if b.terms else symbolic(b + sympy.log(w))
    negative, root = _signed_root(s)
    if not negative and w == 0:  # the values root and -root have the logarithms of two real numbers, one negative
        return symbolic(
            b * ((sympy.log(root) - sympy.log(-root)) / (2 * root)) + sympy.log(s) / 2 + sympy.I * sympy.pi / 2
        )
    angle = sympy.atan2(root, w) if negative else sympy.atanh(root / w)
    return symbolic(b * (angle / root) + sympy.log(sympy.simplify(w**2 - s)) / 2)


def sqrt(a: Any) -> Any:
    """Return the square root with a positive scalar part, of the elements that `log` takes.

    The square of the root is `a` itself, never ``-a``.
    """
    if not isinstance(a, Multivector):
        return sympy.sqrt(a)
    if (screw := _screw(a)) is not None:
        size = 2 + 2 * screw[0]
        return symbolic((a + 1) * (1 - screw[2] / size) / sympy.sqrt(size))
    w, b, s = split_number("sqrt()", a)
    root = sympy.sqrt(sympy.simplify((w + sympy.sqrt(sympy.simplify(w**2 - s))) / 2))
    return symbolic(b / (2 * root) + root)


def power(a: Any, t: Any) -> Any:
    """Return a product of equal factors, the square root, or ``exp(t * log(a))`` for any other exponent."""
    exponent = Expanded.of(t).expression
    if not isinstance(a, Multivector):
        return sympy.sympify(a) ** exponent
    if exponent.is_Integer:
        return symbolic(a ** int(exponent))
    return sqrt(a) if exponent == sympy.Rational(1, 2) else exp(symbolic(log(a) * exponent))


def _screw(a: Multivector) -> tuple[Any, SymbolicMultivector, SymbolicMultivector, Any] | None:
    """Split a motor into its parts of grades 0, 2 and 4, and the scalar part of the square of that of grade 2.

    The result is None if the part of grade 4 is zero or not null.
    """
    lifted = reduce(symbolic(a))
    b, p = lifted.grade(2), lifted.grade(4)
    if not p.terms or not set(lifted.grades) <= {0, 2, 4} or not _vanishes(reduce(p * p)):
        return None
    rest = reduce(lifted * ~lifted - 1)
    if not _vanishes(rest) and all(sympy.sympify(x).is_number for x in rest.expressions.values()):
        raise AlgebraError("log()", f"a ~a = {rest + 1}", "a unit motor", "divide it by its norm")
    return lifted["1"], b, p, sympy.factor(reduce(b * b)["1"])


def split_number(where: str, a: Any) -> tuple[Any, SymbolicMultivector, Any]:
    """Split `a` into a scalar and a part whose square is the scalar that is returned last."""
    lifted = required(where, a)
    b = lifted.keep(bool)
    square = reduce(b * b)
    if not _vanishes(square.keep(bool)):
        raise AlgebraError(
            where, f"a part whose square is {square}", "a scalar as its square", "use a kernel or numeric objects"
        )
    return lifted["1"], b, sympy.factor(square["1"])


OWN: dict[str, Callable[..., SymbolicMultivector]] = {"exp": exp, "log": log, "sqrt": sqrt, "power": power}
"""Functions with closed forms of their own; `gacompiler.symbolic.waves` adds the sine and the cosine."""
SymbolicMultivector._run_operation = staticmethod(run_operation)


def _vanishes(x: SymbolicMultivector) -> bool:
    return all(is_zero(Expanded.of(sympy.simplify(value))) for value in x.expressions.values())
