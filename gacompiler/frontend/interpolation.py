"""Interpolation of unit versors: ``a (~a b)**t`` as a sum of `a` and `b`, without their ratio.

A unit versor ``r = w + p + B`` of grades 0, 4 and 2 with ``p p = 0`` turns by a dual angle, ``cos x = w + p``, and
``r**t = cos(t x) + (r - cos x) sin(t x) / sin x``. With the angle ``cos y = w``, its sine ``u``, and ``C = cos(t y)``:

    sin(t x) / sin x = S + p (S w - t C) / u**2,    cos(t x) = C + t S p,    S = sin(t y) / u.

So ``a r**t`` is the sum of `a` and of ``b = a r`` with such numbers, of which `r` has only the parts `w` and `p`.
Where ``u`` vanishes, errors of `u` matter little, since both quotients have limits, `t` and ``(t**3 - t) / 3``.
"""

from __future__ import annotations

from typing import Any

from .exponentials import NEARLY_ZERO, ONE, circle_of, length_of
from .logarithms import form_of_versor
from .operations import absolute, atan2, cos, select, sin, sqrt


def weights(ratio: Any, t: Any) -> tuple[Any, Any] | None:
    """What `a` and `b` are multiplied by, from the right, to give ``a (~a b)**t``.

    None of a ratio in one plane, whose power is short, and of one that is neither a rotation nor a screw.
    """
    form, bivector = form_of_versor(ratio), ratio.grade(2)
    if form.s.positive or form.s.zero or form.nilpotent or not form.q.zero or circle_of(bivector, form) is not None:
        return None
    w, length = ratio["1"], length_of(bivector, form)
    flip, cosine = select(w < 0, -1, 1), absolute(w)
    square = 1 - w * w if length is None else length * length
    tiny = square < NEARLY_ZERO
    sine = sqrt(select(tiny, ONE, square)) if length is None else select(tiny, ONE, length)
    angle = t * atan2(sine, cosine)
    turned = select(tiny, 1, cos(angle))
    share = select(tiny, t, sin(angle) / sine)
    start = turned - share * cosine
    if not form.rest:
        return start, flip * share
    p = ratio.grade(4)
    slope = select(tiny, (t * t * t - t) / 3, (share * cosine - t * turned) / select(tiny, ONE, square))
    return start + flip * (t * share - share - slope * cosine) * p, flip * share + slope * p
