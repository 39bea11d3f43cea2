"""Exponential, logarithm, root, power and interpolation of scalars, numbers and versors, from products and `select`.

Nothing here computes: the functions write the closed forms of `gacompiler.frontend.exponentials` and
`gacompiler.frontend.logarithms` with the operations of the kernel language, so derivatives and proofs need no more.
"""

from __future__ import annotations

from typing import Any

from ..algebra.layout import SCALARS
from ..algebra.multivector import Multivector
from . import operations as scalar
from .exponentials import exponential
from .expression import Expression
from .facts import is_unit
from .logarithms import number_logarithm, number_square_root, unit_versor_logarithm, unit_versor_square_root
from .powers import number_power, unit_versor_power, weights
from .squares import blades_of, form_of


def exp(a: Any) -> Any:
    """The exponential of a scalar, a bivector, or any other multivector.

    Parameters
    ----------
    a : scalar or multivector
        A bivector over up to five basis vectors, in any metric: the even versor that moves by ``exp(a) x exp(-a)``.
        Anything whose square is a scalar (complex and other numbers, quaternions). A scalar part is a factor.

    Notes
    -----
    These are closed forms, exact to a few units of the last place of the largest coefficient, near 0 and at full turns
    as well. The square of `a` must not overflow, and a boost is limited by the exponential.

    All else, bivectors over six and more basis vectors among them, goes by Taylor's polynomial and squarings in more
    than double precision (`gacompiler.frontend.scaling`), some fifty products. The error is at most 3e-14 of the
    largest coefficient where the root of the sum of squared coefficients is up to 1000, as measured by
    ``tests/frontend/test_large_exponentials.py``. Above 1024 the result may be not a
    number, and far above it always is; so it is, or infinite, where a coefficient is above all doubles, as of a boost
    by 710. It is never finite and wrong.
    """
    if _is_scalar(a):
        return scalar.exp(a)
    blades = blades_of(a)
    if 0 not in blades:
        return exponential(a)
    return scalar.exp(a["1"]) * exponential(_without_scalar(a))


def log(a: Any, *, unit: bool | None = None, along: Any = None) -> Any:
    """The logarithm of a scalar, a unit versor or a number.

    Parameters
    ----------
    a : scalar or multivector
        An even versor over up to five basis vectors, or scalar plus a part whose square is a scalar.
    unit : bool, optional
        Whether `a` is a unit versor; by default, whether its layout and the operations on it say so. With a part of
        grade 4 it must be one.
    along : multivector, optional
        An element with the square -1 along which the angle of a negative number is taken; by default, the first blade
        of `a` with a negative square.

    Returns
    -------
    scalar or multivector
        Of a unit versor, the bivector of least angles whose exponential is `a` or ``-a``, which move alike: angles
        of its commuting parts are in [0, pi/2], so those of the motion are in [0, pi]. Else the principal logarithm:
        half the logarithm of the norm squared, and the angle in [0, pi] along the other part.

    Notes
    -----
    Where a scalar part is 0, at half turns, the two signs are equally near and the result jumps. With angles only, and
    in metrics with one sign against all others (Minkowski's, conformal ones), every unit versor has a logarithm; not
    so a unit versor that is a blade of grade 4, a half turn in two planes at once, for which no pair of planes is
    nearer than another. Where squares have two signs each there are versors without a logarithm, as there are double
    numbers without; the result is then not a number.

    Raises
    ------
    KernelError
        When `a` is neither, by its blades.
    """
    if _is_scalar(a):
        return scalar.log(a)
    return unit_versor_logarithm(a) if _is_versor(a, unit) else number_logarithm(a, along)


def sqrt(a: Any, *, unit: bool | None = None, along: Any = None) -> Any:
    """The square root of a scalar, a unit versor or a number.

    Parameters
    ----------
    a : scalar or multivector
    unit, along : optional
        As in `log`.

    Returns
    -------
    scalar or multivector
        Of a unit versor, the one half way to it or to ``-a``: ``exp(log(a) / 2)``, without angles. Else the root
        with a scalar part that is not negative.
    """
    if _is_scalar(a):
        return scalar.sqrt(a)
    return unit_versor_square_root(a) if _is_versor(a, unit) else number_square_root(a, along)


def power(a: Any, t: Any, *, unit: bool | None = None, along: Any = None) -> Any:
    """``exp(t log(a))``: of a unit versor, the part `t` of the shorter way to it.

    Parameters
    ----------
    a : scalar or multivector
        As in `log`.
    t : scalar
    unit, along : optional
        As in `log`.

    Notes
    -----
    Of rotations in space, screws (also of the plane) and quaternions this takes one angle, and large powers are as
    exact as the sine of so large an angle; everything else goes through both functions. Close to no turn at all, first
    derivatives in double precision have errors of up to 3e-7 (1 + t) of the largest one.
    """
    found = None
    if not _is_scalar(a):
        found = unit_versor_power(a, t) if _is_versor(a, unit) else number_power(a, t, along)
    return exp(t * log(a, unit=unit, along=along)) if found is None else found


def interpolate(a: Any, b: Any, t: Any, *, unit: bool | None = None) -> Any:
    """The unit versor at the part `t` of the way from `a` to `b` or ``-b``, whichever is nearer: ``a (~a b)**t``.

    Parameters
    ----------
    a, b : multivector
        Unit versors; `b` moves from where `a` does by a motion that has a logarithm (see `log`).
    t : scalar
        0 gives `a`, 1 gives `b` or ``-b``; any other number is on the same way, which goes at constant speed.
    unit : bool, optional
        As in `log`, of both.

    Notes
    -----
    Of rotations in space and of screw motions this is a sum of `a` and `b` (Shoemake's slerp; with dual numbers,
    Kavan's ScLERP), a third to a half of the operations of the ratio's power. It is as exact between `a` and `b`; far
    beyond them, errors grow as the square of `t`, and where `a` and `b` are not quite unit, the result is as wrong.
    """
    ratio = ~a * b
    found = None if _is_scalar(ratio) or not _is_versor(ratio, unit) else weights(ratio, t)
    return a * power(ratio, t, unit=unit) if found is None else a * found[0] + b * found[1]


def _is_scalar(a: Any) -> bool:
    if isinstance(a, Expression):
        return a.is_scalar
    return not isinstance(a, Multivector) or a.algebra == SCALARS or not any(a.terms)


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
