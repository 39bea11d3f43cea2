"""Powers of unit versors and of numbers with one angle, and interpolation of two unit versors by linear combination.

A unit versor ``r = w + p + B`` of grades 0, 4 and 2 with ``p p = 0`` has a dual angle x with ``cos x = w + p``, and
``r**t = cos(t x) + B sin(t x) / sin x``. With the angle y, ``cos y = w``, its sine ``u``, and ``C = cos(t y)``:

    sin(t x) / sin x = S + p (S w - t C) / u**2,    cos(t x) = C + t S p,    S = sin(t y) / u.

Where ``u`` vanishes, both quotients have limits, `t` and ``(t**3 - t) / 3``. Because ``B = r - cos x``, the path
``a r**t`` to ``b = a r`` is a combination of `a` and `b` with dual numbers as weights, which need only the parts `w`
and `p` of ``r = ~a b``.
"""

from __future__ import annotations

from typing import Any

from .exponentials import NEARLY_ZERO, ONE, TINY, circle_of, length_of
from .logarithms import defined, form_of_versor, imaginary_unit_of, number_part
from .operations import absolute, atan2, cos, equal, exp, log, select, sin, sqrt
from .squares import Form, Value


def unit_versor_power(r: Any, t: Any) -> Any | None:
    """Return ``r**t`` of `r` or ``-r``, whichever has a non-negative scalar part; None if `r` has no dual angle."""
    form, bivector = form_of_versor(r), r.grade(2)
    if not _has_dual_angle(form, bivector):
        return None
    w, length = r["1"], length_of(bivector, form)
    flip = select(w < 0, -1, 1)
    square = -(bivector * bivector)["1"] if length is None else length * length
    power_cosine, sine_ratio, dual_part = _parts(absolute(w), square, length, _is_flat(form, square, t), t)
    if not form.rest:
        return power_cosine + flip * sine_ratio * bivector
    p = r.grade(4)
    return power_cosine + flip * t * sine_ratio * p + flip * sine_ratio * bivector + (dual_part * p * bivector).grade(2)


def weights(ratio: Any, t: Any) -> tuple[Any, Any] | None:
    """Return the weights of `a` and `b`, multiplied from the right, whose combination is ``a (~a b)**t``.

    The result is None for a ratio in one plane, whose power is short, and for one that is neither a rotation nor a
    screw motion.
    """
    form, bivector = form_of_versor(ratio), ratio.grade(2)
    if not _has_dual_angle(form, bivector):
        return None
    w, length = ratio["1"], length_of(bivector, form)
    flip, cosine = select(w < 0, -1, 1), absolute(w)
    # Errors of the sine matter little where it vanishes, and 1 - w w is shorter than the bivector's square.
    square = 1 - w * w if length is None else length * length
    flat = square < TINY if length is None else _is_flat(form, square, t)
    power_cosine, sine_ratio, dual_part = _parts(cosine, square, length, flat, t)
    start = power_cosine - sine_ratio * cosine
    if not form.rest:
        return start, flip * sine_ratio
    p = ratio.grade(4)
    return start + flip * (t * sine_ratio - sine_ratio - dual_part * cosine) * p, flip * sine_ratio + dual_part * p


def number_power(a: Any, t: Any, along: Any = None) -> Any | None:
    """Return the principal value of ``(w + v)**t``.

    The result is None if ``v v`` can be positive or is always 0, or if `v` is a multiple of one blade."""
    v, form = number_part(a)
    if form.s.positive or form.s.zero or circle_of(v, form) is not None:
        return None
    w, s = a["1"], (v * v)["1"]
    none = equal(s, 0)
    u = sqrt(select(none, ONE, -s))
    angle = t * atan2(select(none, 0, u), w)
    sine, cosine = sin(angle), cos(angle)
    factor = select(none, t * cosine, sine) / select(none, w, u)
    imaginary = imaginary_unit_of(v) if along is None else along
    return exp(t / 2 * log(defined(w * w - s, w, v, form))) * (cosine + factor * v + select(none, sine, 0) * imaginary)


def _has_dual_angle(form: Form, bivector: Any) -> bool:
    """Return whether ``cos x = w + p`` with a null `p`, in more than one plane: rotations and screw motions."""
    turns = form.s.negative and not form.s.positive and form.q.zero and not form.nilpotent
    return turns and circle_of(bivector, form) is None


def _is_flat(form: Form, square: Value, t: Value) -> Value:
    """Return whether ``S`` is equal to `t` up to rounding.

    For translations together with a rotation, the derivatives contain those of ``S``, which lose digits before ``S``.
    """
    return (1 + t * t) * square < NEARLY_ZERO if form.shifts else square < TINY


def _parts(cosine: Value, square: Value, length: Value | None, flat: Value, t: Value) -> tuple[Value, Value, Value]:
    """Return ``C``, ``S`` and ``(S w - t C) / u**2`` of the angle with this cosine, with limits where `flat`.

    `square` is ``u**2``, and `length` is `u`, of either sign, if it is known without a square root. Terms that do not
    depend on `t` are separate, so that they are computed once for many values of `t`.
    """
    tiny = square < TINY
    sine = sqrt(select(tiny, ONE, square)) if length is None else select(tiny, ONE, length)
    inverse, angle = 1 / sine, t * atan2(sine, cosine)
    power_cosine = select(tiny, 1, cos(angle))
    sine_ratio = select(flat, t, sin(angle) * inverse)
    dual_part = select(flat, (t * t * t - t) / 3, (sine_ratio * cosine - t * power_cosine) * inverse * inverse)
    return power_cosine, sine_ratio, dual_part
