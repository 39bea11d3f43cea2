"""Exponential, logarithm, root, power and interpolation of scalars, numbers and versors, from products and `select`.

The functions build expressions and compute nothing themselves. They write the closed forms of
`gacompiler.frontend.exponentials` and `gacompiler.frontend.logarithms` with the operations of the kernel language, so
derivatives and proofs need no rules for them.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

from ..algebra.operations import Operation
from ..errors import AlgebraError, OperandError
from ..rings.precise import by_doubles, corrected_logarithm, is_precise
from ..rings.precise import exponential as precise_exponential
from . import operations as scalar
from .exponentials import exponential
from .expression import Expression
from .facts import is_unit
from .logarithms import number_logarithm, number_square_root, unit_versor_logarithm, unit_versor_square_root
from .many_vectors import has_many_vectors, versor_logarithm
from .operands import check_operand, own_operations, without_values
from .powers import number_power, unit_versor_power, weights
from .squares import blades_of, form_of

_LARGEST_PRODUCT = 64
"""Largest exponent for which a power of a scalar is a product."""


def exp(a: Any) -> Any:
    """Compute the exponential of a scalar, a bivector, or any other multivector.

    Parameters
    ----------
    a : scalar or multivector
        A closed form is used for a bivector over up to five basis vectors, in any metric, and for any multivector whose
        square is a scalar (complex and other numbers, quaternions). A scalar part contributes a factor.

    Returns
    -------
    scalar or multivector
        For a bivector, the even versor that moves `x` to ``exp(a) x exp(-a)``.

    Notes
    -----
    The closed forms are accurate to a few units in the last place of the largest coefficient, also near 0 and at full
    rotations. The square of `a` must not overflow, and a boost is limited by the range of the exponential.

    For bivectors over six to eight orthogonal basis vectors with the squares 1 and -1, a kernel needs ``loops=True``.
    Their exponentials are computed by matrices (`gacompiler.frontend.many_vectors`). With ``loops=True``, this also
    holds for null and oblique bases that a rational change of basis makes orthogonal.

    Every other argument is evaluated by scaling and squaring of a Taylor polynomial in more than double precision
    (`gacompiler.frontend.scaling`), with about fifty products. The error is at most 3e-14 of the largest coefficient
    where the root of the sum of squared coefficients is up to 1000, as measured by
    ``tests/frontend/test_large_exponentials.py``. Above 1024 the result may be NaN, and far above it always is. The
    result is also NaN or infinite if a coefficient overflows, for example for a boost by 710. It is never finite and
    wrong.

    For multivectors with numbers of mpmath, `exp`, `log`, `sqrt` and `power` have all digits of mpmath.
    """
    if (run := own_operations((a,))) is not None:
        return run(Operation.EXP, a)
    if _is_scalar(a):
        return scalar.exp(a)
    if is_precise(a):
        return precise_exponential(a)
    blades = blades_of(a)
    if 0 not in blades:
        return exponential(a)
    return scalar.exp(a["1"]) * exponential(_without_scalar(a))


def log(a: Any, *, unit: bool | None = None, along: Any = None) -> Any:
    """Compute the logarithm of a scalar, a unit versor or a number.

    Parameters
    ----------
    a : scalar or multivector
        An even versor over up to five basis vectors, or a scalar plus a part whose square is a scalar. In kernels with
        ``loops=True``, also an even unit versor over six to eight vectors that are orthogonal with the squares 1 and
        -1, or become so by a rational change of basis, such as null pairs.
    unit : bool, optional
        Whether `a` is a unit versor. By default this is inferred from its layout and the operations on it. With a part
        of grade 4, `a` must be a unit versor.
    along : multivector, optional
        An element with the square -1 along which the angle of a negative number is taken; by default, the first blade
        of `a` with a negative square.

    Returns
    -------
    scalar or multivector
        For a unit versor, the bivector with the smallest angles whose exponential is `a` or ``-a``; both represent the
        same motion. The angles of its commuting parts are in [0, pi/2], and those of the motion in [0, pi]. Otherwise
        the principal logarithm: half the logarithm of the squared norm, and the angle in [0, pi] along the other part.

    Raises
    ------
    KernelError
        If the blades of `a` are those of neither a versor nor a number.
    AlgebraError
        If the coefficients are numbers, and `a` has no logarithm or many.

    Notes
    -----
    Where the scalar part is 0, that is, at rotations by pi, both signs are equally near and the result is
    discontinuous. In definite metrics, and in metrics with one sign against all others (Minkowski, conformal), every
    unit versor has a logarithm, with one exception: a unit versor that is a blade of grade 4, a rotation by pi in two
    planes at once, for which the pair of planes is not unique. In metrics with at least two squares of each sign, some
    versors have no logarithm, and neither do some double numbers. The result is then NaN in kernels and in arrays of
    objects; a single object or exact multivector raises an error.
    """
    if (run := own_operations((a,))) is not None:
        return run(Operation.LOG, a)
    if _is_scalar(a):
        return scalar.log(a)
    return _value("logarithm", a, lambda: _logarithm(a, unit, along))


def _logarithm(a: Any, unit: bool | None, along: Any) -> Any:
    if is_precise(a):
        found = by_doubles(lambda x: _logarithm(x, unit, along), a)
        return corrected_logarithm(a, found) if _is_versor(a, unit) else found
    if has_many_vectors(a):
        _need_unit_versor("log", unit, along)
        return versor_logarithm(a)
    return unit_versor_logarithm(a) if _is_versor(a, unit) else number_logarithm(a, along)


def _need_unit_versor(what: str, unit: bool | None, along: Any) -> None:
    """Raise an error for options of numbers over six vectors or more, of which only unit versors have a logarithm."""
    if unit is False or along is not None:
        raise OperandError(f"{what}()", "unit=False or along= over six vectors or more", "a unit versor")


def _value(what: str, a: Any, run: Callable[[], Any]) -> Any:
    """Return the value of a function of `a`; raise if it is not determined for coefficients that are numbers."""
    try:
        return run()
    except (ZeroDivisionError, ValueError) as error:  # of Python's division and functions, which do not return NaN
        found = f"{a}, which has no {what}, or many"
        raise AlgebraError(what, found, f"a versor or number with one {what}") from error


def sqrt(a: Any, *, unit: bool | None = None, along: Any = None) -> Any:
    """Compute the square root of a scalar, a unit versor or a number.

    Parameters
    ----------
    a : scalar or multivector
    unit, along : optional
        As in `log`.

    Returns
    -------
    scalar or multivector
        For a unit versor, the versor half way from 1 to `a` or ``-a``: ``exp(log(a) / 2)``, computed without angles.
        Otherwise the root with a non-negative scalar part.
    """
    if (run := own_operations((a,))) is not None:
        return run(Operation.SQRT, a)
    if _is_scalar(a):
        return scalar.sqrt(a)
    return _value("square root", a, lambda: _square_root(a, unit, along))


def _square_root(a: Any, unit: bool | None, along: Any) -> Any:
    if is_precise(a):
        if _is_versor(a, unit):
            return precise_exponential(_logarithm(a, unit, along).map(lambda x: x / 2))
        return by_doubles(lambda x: _square_root(x, unit, along), a)
    if has_many_vectors(a):
        _need_unit_versor("sqrt", unit, along)
        return exponential(versor_logarithm(a) / 2)
    return unit_versor_square_root(a) if _is_versor(a, unit) else number_square_root(a, along)


def power(a: Any, t: Any, *, unit: bool | None = None, along: Any = None) -> Any:
    """Compute the power ``exp(t log(a))``.

    For a unit versor this is the versor at the fraction `t` of the shorter path from 1 to `a` or ``-a``.

    Parameters
    ----------
    a : scalar or multivector
        As in `log`.
    t : scalar
    unit, along : optional
        As in `log`.

    Notes
    -----
    Powers of rotations in space, screw motions (also of the plane) and quaternions need a single angle, and large
    powers are as accurate as the sine of that large angle. All other powers are computed by `log` and `exp`. Close to
    the identity, first derivatives in double precision have errors of up to 3e-7 (1 + t) of the largest one.
    """
    check_operand("power(), exponent", t)
    if not _is_scalar(t):
        raise OperandError("power(), exponent", str(t), "a scalar")
    if (run := own_operations((a,))) is not None:
        return run("power", a, t)
    check_operand("power()", a)
    if _is_scalar(a):
        return _power_of_scalar(a, t)
    if isinstance(t, (float, Fraction)) and t == Fraction(1, 2):
        return sqrt(a, unit=unit, along=along)
    if is_precise(a) or has_many_vectors(a):
        return exp(t * log(a, unit=unit, along=along))
    found = unit_versor_power(a, t) if _is_versor(a, unit) else number_power(a, t, along)
    return exp(t * log(a, unit=unit, along=along)) if found is None else found


def _power_of_scalar(a: Any, t: Any) -> Any:
    """Return a power, as a product where the exponent is a small multiple of 1/2, so that the base can be 0."""
    if isinstance(t, (int, float, Fraction)) and -_LARGEST_PRODUCT <= t <= _LARGEST_PRODUCT and 2 * t == int(2 * t):
        return a ** int(t) if t == int(t) else scalar.sqrt(a) ** int(2 * t)
    return exp(t * log(a))


def even_part(a: Any) -> Any:
    """Return the part of all even grades of `a`."""
    return _of_grades("even_part", a, 0)


def odd_part(a: Any) -> Any:
    """Return the part of all odd grades of `a`."""
    return _of_grades("odd_part", a, 1)


def _of_grades(name: str, a: Any, first: int) -> Any:
    element = scalar.as_element(f"{name}()", a)
    return element.grade(*range(first, max(first, element.algebra.dimension) + 1, 2))


def outer_exp(a: Any) -> Any:
    """Compute the outer exponential, ``1 + a + (a ^ a) / 2 + (a ^ a ^ a) / 6 + ...``, a finite sum for every blade.

    A scalar part contributes its exponential as a factor.
    """
    (a,) = without_values("outer_exp()", (a,))
    if _is_scalar(a):
        return exp(a)
    rest = _without_scalar(a)
    total, term = 1 + rest, rest
    for k in range(2, a.algebra.dimension + 1):
        term = (term ^ rest) / k
        if _is_scalar(term):  # zero
            break
        total = total + term
    return scalar.exp(a["1"]) * total if 0 in blades_of(a) else total


def outer_sin(a: Any) -> Any:
    """Compute the sum of the odd terms of `outer_exp`, which has no alternating signs (Roelfs & De Keninck 2023)."""
    (a,) = without_values("outer_sin()", (a,))
    return (outer_exp(a) - outer_exp(-a)) / 2


def outer_cos(a: Any) -> Any:
    """Compute the sum of the even terms of `outer_exp`, which has no alternating signs (Roelfs & De Keninck 2023)."""
    (a,) = without_values("outer_cos()", (a,))
    return (outer_exp(a) + outer_exp(-a)) / 2


def outer_tan(a: Any) -> Any:
    """Compute the quotient of `outer_sin` by `outer_cos`, which must have an inverse (Roelfs & De Keninck 2023)."""
    return outer_sin(a) * scalar.inverse(outer_cos(a))


def interpolate(a: Any, b: Any, t: Any, *, unit: bool | None = None) -> Any:
    """Interpolate between two unit versors along the shorter path: ``a (~a b)**t``.

    Parameters
    ----------
    a, b : multivector
        Unit versors. The motion between them, ``~a b``, must have a logarithm (see `log`).
    t : scalar
        0 gives `a` and 1 gives `b` or ``-b``, whichever is nearer. Any other number gives a point of the same path,
        which is traversed at constant speed.
    unit : bool, optional
        Whether `a` and `b` are unit versors, as in `log`.

    Notes
    -----
    For rotations in space and screw motions the result is a linear combination of `a` and `b` (Shoemake's slerp; with
    dual numbers, Kavan's ScLERP), which takes a third to a half of the operations of the power of ``~a b``. It is as
    accurate between `a` and `b`. Far beyond them, errors grow as the square of `t`. Deviations of `a` and `b` from unit
    norm carry over to the result.
    """
    check_operand("interpolate(), fraction", t)
    a, b = without_values("interpolate()", (a, b))
    a, b = (x if hasattr(type(x), "norm_squared") else scalar.as_element("interpolate()", x) for x in (a, b))
    ratio = ~a * b
    is_own = own_operations((ratio,)) is not None
    is_own = is_own or has_many_vectors(ratio)
    found = None if is_own or _is_scalar(ratio) or not _is_versor(ratio, unit) else weights(ratio, t)
    return a * power(ratio, t, unit=unit) if found is None else a * found[0] + b * found[1]


def _is_scalar(a: Any) -> bool:
    return not hasattr(type(a), "norm_squared") or not any(blades_of(a))


def _without_scalar(a: Any) -> Any:
    return a.grade(*sorted({blade.bit_count() for blade in blades_of(a) if blade}))


def _is_versor(a: Any, unit: bool | None) -> bool:
    """Whether `a` counts as a unit versor: it is known to be one, or has a part of grade 4."""
    blades = frozenset(blade for blade in blades_of(a) if blade)
    form = form_of(a.algebra, blades)
    if form is None or form.rest:
        return True
    known = is_unit(a) if unit is None and isinstance(a, Expression) else bool(unit)
    return known and all(blade.bit_count() in (0, 2, 4) for blade in blades)
