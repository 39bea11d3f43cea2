"""Powers of unit versors and of numbers by one angle; ways between two unit versors as sums of both.

A unit versor ``r = w + p + B`` of grades 0, 4 and 2 with ``p p = 0`` turns by a dual angle, ``cos x = w + p``, and
``r**t = cos(t x) + B sin(t x) / sin x``. With the angle ``cos y = w``, its sine ``u``, and ``C = cos(t y)``:

    sin(t x) / sin x = S + p (S w - t C) / u**2,    cos(t x) = C + t S p,    S = sin(t y) / u.

Where ``u`` vanishes, both quotients have limits, `t` and ``(t**3 - t) / 3``. As ``B = r - cos x``, the way ``a r**t``
to ``b = a r`` is a sum of `a` and `b` with such numbers, which need only the parts `w` and `p` of ``r = ~a b``.
"""

from __future__ import annotations

from typing import Any

from .exponentials import NEARLY_ZERO, ONE, TINY, circle_of, length_of
from .logarithms import form_of_versor, number_part, turn_of
from .operations import absolute, atan2, cos, equal, exp, log, select, sin, sqrt
from .squares import Form, Value


def unit_versor_power(r: Any, t: Any) -> Any | None:
    """``r**t`` of `r` or ``-r``, the one with a positive scalar part; None where `weights` gives none."""
    form, bivector = form_of_versor(r), r.grade(2)
    if not _has_dual_angle(form, bivector):
        return None
    w, length = r["1"], length_of(bivector, form)
    flip = select(w < 0, -1, 1)
    square = -(bivector * bivector)["1"] if length is None else length * length
    turned, share, slope = _parts(absolute(w), square, length, _is_flat(form, square, t), t)
    if not form.rest:
        return turned + flip * share * bivector
    p = r.grade(4)
    return turned + flip * t * share * p + flip * share * bivector + (slope * p * bivector).grade(2)


def weights(ratio: Any, t: Any) -> tuple[Any, Any] | None:
    """What `a` and `b` are multiplied by, from the right, to give ``a (~a b)**t``.

    None of a ratio in one plane, whose power is short, and of one that is neither a rotation nor a screw.
    """
    form, bivector = form_of_versor(ratio), ratio.grade(2)
    if not _has_dual_angle(form, bivector):
        return None
    w, length = ratio["1"], length_of(bivector, form)
    flip, cosine = select(w < 0, -1, 1), absolute(w)
    # errors of the sine matter little where it vanishes, and 1 - w w is shorter than the bivector's square
    square = 1 - w * w if length is None else length * length
    flat = square < TINY if length is None else _is_flat(form, square, t)
    turned, share, slope = _parts(cosine, square, length, flat, t)
    start = turned - share * cosine
    if not form.rest:
        return start, flip * share
    p = ratio.grade(4)
    return start + flip * (t * share - share - slope * cosine) * p, flip * share + slope * p


def number_power(a: Any, t: Any, along: Any = None) -> Any | None:
    """The principal value of ``(w + v)**t`` where ``v v`` is never positive and `v` is in more than one plane."""
    v, form = number_part(a)
    if form.s.positive or form.s.zero or circle_of(v, form) is not None:
        return None
    w, s = a["1"], (v * v)["1"]
    none = equal(s, 0)
    u = sqrt(select(none, ONE, -s))
    angle = t * atan2(select(none, 0, u), w)
    sine, cosine = sin(angle), cos(angle)
    factor = select(none, t * cosine, sine) / select(none, w, u)
    turn = turn_of(v) if along is None else along
    return exp(t / 2 * log(w * w - s)) * (cosine + factor * v + select(none, sine, 0) * turn)


def _has_dual_angle(form: Form, bivector: Any) -> bool:
    """Whether ``cos x = w + p`` with a null `p`, in more than one plane: rotations and screws."""
    turns = form.s.negative and not form.s.positive and form.q.zero and not form.nilpotent
    return turns and circle_of(bivector, form) is None


def _is_flat(form: Form, square: Value, t: Value) -> Value:
    """Whether ``S`` is `t` to the last digit.

    With translations beside a rotation, their derivatives have those of ``S``, which lose digits before ``S`` does.
    """
    return (1 + t * t) * square < NEARLY_ZERO if form.shifts else square < TINY


def _parts(cosine: Value, square: Value, length: Value | None, flat: Value, t: Value) -> tuple[Value, Value, Value]:
    """``C``, ``S`` and ``(S w - t C) / u**2`` of the angle with this cosine, the last two by limits where `flat`.

    `square` is ``u**2``, and `length` is `u`, of either sign, where it is known without a root. What does not depend on
    `t` is apart, so that it is computed once for many of them.
    """
    tiny = square < TINY
    sine = sqrt(select(tiny, ONE, square)) if length is None else select(tiny, ONE, length)
    inverse, angle = 1 / sine, t * atan2(sine, cosine)
    turned = select(tiny, 1, cos(angle))
    share = select(flat, t, sin(angle) * inverse)
    slope = select(flat, (t * t * t - t) / 3, (share * cosine - t * turned) * inverse * inverse)
    return turned, share, slope
