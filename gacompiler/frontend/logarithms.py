"""Logarithms and square roots of unit versors, and of numbers, whose non-scalar part has a scalar square.

A unit versor ``r = w + p + b`` of grades 0, 4 and 2 is ``exp(b1 + b2)`` with commuting simple bivectors, so that
``w = C1 C2`` and ``p = S1 S2 b1 b2`` in the notation of `gacompiler.frontend.exponentials`. With ``s = <b b>``,
``P = p p``, the squares ``h1 = S1**2 x1 > h2 = S2**2 x2`` of the hyperbolic sines (of circular ones, negated) have the
sum ``s - 2 P``, the difference ``D = sqrt(s**2 - 4 P w**2)`` and the product ``P``. With ``T = 1 / S`` the logarithm is

    (H0 + H1 p) b,    H1 = (C2 T2 - C1 T1)/D,    K = (C1 T2 - C2 T1)/D,    H0 = C2 T1 - h2 K,

without division by a cosine, so rotations by pi in one plane are not singular. ``D`` is small for isoclinic rotations,
and for rotations by nearly pi in both planes. There, the cosines are the eigenvalues ``w +- sqrt P`` of ``w + p``. They
act on the parts ``b (1 +- p / sqrt P) / 2`` of `b`. Near two half turns, `w` has no correct digit. The sine of the part
whose cosine is nearly -1 then follows from `b` alone, and ``<b p b> = 2 w P`` has the sign of `w`. If `p` can be a null
element, a power series is used near 1.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

from ..algebra.signs import Signs
from ..errors import KernelError
from .exponentials import HALF, NEARLY_ZERO, ONE, TINY, Pair, circle_of, divided, length_of, polynomial_of_pair
from .exponentials import polynomial as polynomial_of
from .expression import Expression, lift
from .operations import absolute, assemble, atan2, equal, log, maximum, select, sqrt
from .squares import Form, Value, blades_of, form_of

CLOSE = Fraction(1, 64)
"""Limit of ``tanh**2`` below which the area function is a polynomial: ``log(1 + u)`` loses the digits of a small u."""
NEAR = Fraction(1, 1024)
"""Limit of ``s**2`` and ``4 P`` for the power series; the squares of both half hyperbolic tangents are below 1/64."""
MOST_CLOSED = 5
"""Number of basis vectors up to which logarithms have closed forms."""
_MANY = (
    "over six to eight vectors, use a metric that is diagonal with the squares 1 and -1 after a rational change of "
    "basis; write a vector with the square 0 as e0 = e+ + e-, in units of length that make translations about 1"
)
_AREAS = tuple(Fraction(1, 2 * k + 1) for k in range(9))


def unit_versor_logarithm(r: Any) -> Any:
    """Return the bivector with the smallest angles whose exponential is the unit versor `r` or ``-r``."""
    w, b, form = r["1"], r.grade(2), form_of_versor(r)
    left, cosine = w < 0, absolute(w)
    circle, length = circle_of(b, form), length_of(b, form)
    if circle is not None:
        sine, blade = circle
        return atan2(select(left, -sine, sine), cosine) * blade
    s = 0 if form.s.zero else (b * b)["1"]
    if not form.rest:
        h0 = stretch(s, cosine, form.s, form.vanishing, length)
        return select(left, -h0, h0) * b
    p = r.grade(4)
    if form.q.zero:
        h0, h1 = _with_null_square(s, cosine, length, form)
    elif form.isoclinic:
        turned, left, h, b, part = _turned_part(r, s, form)
        h0, h1 = _of_two_numbers(s, cosine, (p * p)["1"], form, turned, h)
        return select(left, -h0, h0) * b + h1 * part
    else:
        h0, h1 = _of_two_numbers(s, cosine, (p * p)["1"], form)
    return select(left, -h0, h0) * b + (h1 * p * b).grade(2)


def _turned_part(r: Any, s: Value, form: Form) -> tuple[Value, Value, Value, Any, Any]:
    """Return what is known of the part of the bivector `b` of `r` whose cosine ``w - sqrt P`` is below -1/2.

    The values are whether there is such a part, whether `r` is to be negated, ``h`` of the part, and two bivectors: `b`
    and `q`, the product ``p b``. There, `b` is without rounding errors in planes beside those of `p`, which the
    logarithm would multiply. If `b` can also turn by an angle and a boost, as in G(2, 2), the part can be far smaller
    than `b`, and twice the part takes the place of `q`.
    """
    w, b, p = r["1"], r.grade(2), r.grade(4)
    p2, q, cosine = (p * p)["1"], (p * b).grade(2), absolute(w) + HALF
    turned = p2 > cosine * cosine
    root = sqrt(select(turned, p2, ONE))
    sign = (b * q)["1"]
    left = select(turned, sign, w) < 0
    if len(blades_of(p)) > 1:
        b = select(turned, (p * q).grade(2) / (root * root), b)
    if not form.second.positive:
        s = (b * b)["1"] if len(blades_of(p)) > 1 else s
        return turned, left, s - absolute(sign) / root, b, q
    part = select(turned, select(left, -1, 1) * b - q / root, q)
    return turned, left, (part * part)["1"] / 2, b, part


def form_of_versor(r: Any) -> Form:
    """Return the form of the squares of bivectors over the basis vectors of `r`.

    Raises
    ------
    KernelError
        If the blades of `r` are not those of a versor over up to five basis vectors.
    """
    algebra, blades = r.algebra, blades_of(r)
    bivectors = frozenset(blade for blade in blades if blade.bit_count() == 2)
    used = 0
    for blade in blades:
        used |= blade
    if any(blade.bit_count() == 4 for blade in blades):
        bivectors = frozenset(blade for blade in algebra.blades(2) if blade & used == blade)
    form = form_of(algebra, bivectors)
    if form is None or any(blade.bit_count() not in (0, 2, 4) for blade in blades) or not bivectors:
        grades = " ".join(map(str, sorted({blade.bit_count() for blade in blades})))
        raise KernelError(
            "log, sqrt, power or interpolate",
            f"an element of grades {grades} over {used.bit_count()} basis vectors",
            "a scalar, a scalar plus a part whose square is one, or a unit versor of grades 0, 2 and 4 over up to "
            "five basis vectors",
            _MANY if used.bit_count() > MOST_CLOSED else "",
        )
    if any(blade.bit_count() == 4 for blade in blades):
        return form
    return replace(form, rest=frozenset(), vanishing=form.s.both)


def stretch(
    h: Value, c: Value, signs: Signs, vanishing: bool = True, length: Value | None = None, left: bool = False
) -> Value:
    """Return ``T = 1 / S(x)`` from ``h = S**2 x`` of the given signs and ``c = C(x)``.

    `c` may have any sign if `h` is negative, and may be near -1 if `left` is true: then the result grows without
    bounds, and is not finite where `h` is 0. `length` is a known square root of `h` or ``-h``, of any sign.
    """
    if signs.zero:
        return 1
    if not signs.positive and not vanishing:
        tiny = -h < (select(c < 0, 0, NEARLY_ZERO) if left else NEARLY_ZERO)
        u = sqrt(select(tiny, ONE, -h)) if length is None else select(tiny, ONE, length)
        return select(tiny, 1, atan2(u, c) / u)
    inverse = 1 / (1 + absolute(c))
    tangent = h * inverse * inverse
    close = (absolute(tangent) if signs.both else tangent if signs.positive else -tangent) < select(c < 0, 0, CLOSE)
    size = absolute(h) if signs.both else h if signs.positive else -h
    u = sqrt(select(close, ONE, size)) if length is None else absolute(select(close, ONE, length))
    if signs.positive:
        angle = log(select(h < 0, 1, u + c) if signs.negative else u + c)
    if signs.both:
        angle = select(h < 0, atan2(u, c), angle)
    elif signs.negative:
        angle = atan2(u, c)
    return select(close, 2 * inverse * polynomial_of(_AREAS, select(close, tangent, 0)), angle / u)


def _with_null_square(s: Value, c: Value, length: Value | None, form: Form) -> Pair:
    """Return ``H`` if ``p p`` is always 0, so that one of the commuting parts has the square 0."""
    if form.s.zero:
        return 1, -Fraction(1, 3)
    t = stretch(s, c, form.s, form.vanishing, length)
    second = divided(1 - c * t, s, form.s, -Fraction(1, 3))
    if form.nilpotent:
        near = absolute(s) < CLOSE
        second = select(near, _near_one(select(near, s, 0), c, 0)[1], second)
    return t, second


def _of_two_numbers(s: Value, w: Value, p2: Value, form: Form, turned: Value = 0, h: Value = 0) -> Pair:
    """Return ``H`` of ``w + p`` with ``w >= 0`` and ``p p = p2``; `turned` and `h` are those of `_turned_part`."""
    near = maximum(s * s, 4 * absolute(p2)) < NEAR if form.nilpotent else 0
    isoclinic = 0
    if form.isoclinic:
        isoclinic = select(turned, 1, select(near, 0, maximum(s * s, 8 * TINY) < 8 * p2 * w * w))
    square = select(isoclinic, p2, s * s - 4 * p2 * w * w)
    tiny = square < TINY
    root = sqrt(select(tiny, ONE, square))
    difference = select(tiny, 0, root)
    total = s - 2 * p2
    large = (absolute(total) + difference) / 2
    small = p2 / select(large < NEARLY_ZERO, 1, large)
    small = select(large < NEARLY_ZERO, p2, small)
    h1, h2 = select(total < 0, -small, large), select(total < 0, -large, small)
    c1 = sqrt(maximum(select(isoclinic, ONE, (2 * w * w - s + difference) / 2), TINY))
    c2 = w / c1
    if form.isoclinic:
        h = select(turned, h, s - 2 * w * root)
        h1, h2 = select(isoclinic, 2 * s - h, h1), select(isoclinic, h, h2)
        c1, c2 = select(isoclinic, w + root, c1), select(isoclinic, w - root, c2)
    t1, t2 = stretch(h1, c1, form.first), stretch(h2, c2, form.second, left=form.isoclinic)
    k = select(tiny, Fraction(2, 3), (c1 * t2 - c2 * t1) / root)
    first, second = c2 * t1 - h2 * k, select(tiny, -Fraction(1, 3), (c2 * t2 - c1 * t1) / root)
    if form.isoclinic:
        half = (t1 - t2) / 2
        first, second = select(isoclinic, t2 + half, first), select(isoclinic, half / root, second)
        if form.second.positive:
            first, second = select(turned, t1, first), select(turned, -half, second)
    if not form.nilpotent:
        return first, second
    h0, h1 = _near_one(select(near, s, 0), w, select(near, p2, 0))
    return select(near, h0, first), select(near, h1, second)


def _near_one(s: Value, w: Value, p2: Value) -> Pair:
    """Return ``H`` by the power series of artanh of ``tanh(half)``, whose square is ``(s + 2 w p)/(1 + w + p)**2``."""
    inverse = _inverse((1 + w, 1), p2)
    tangent = _product(_product((s, 2 * w), inverse, p2), inverse, p2)
    area = _product(inverse, polynomial_of_pair(_AREAS, tangent, p2), p2)
    return 2 * area[0], 2 * area[1]


def _product(a: Pair, b: Pair, square: Value) -> Pair:
    return a[0] * b[0] + a[1] * b[1] * square, a[0] * b[1] + a[1] * b[0]


def _inverse(a: Pair, square: Value) -> Pair:
    norm = a[0] * a[0] - a[1] * a[1] * square
    return a[0] / norm, -a[1] / norm


def unit_versor_square_root(r: Any) -> Any:
    """Return ``(1 + r)/sqrt((1 + r)(1 + ~r))`` of `r` or ``-r``, whichever has a non-negative scalar part.

    With ``a = 2 + 2 w``, the norm ``(1 + r)(1 + ~r) = a + 2 p`` has the eigenvalues ``a +- 2 sqrt P``. Near two half
    turns, the smaller one loses its digits, and follows from the sine, as in logarithms.
    """
    form, w = form_of_versor(r), r["1"]
    left, cosine = w < 0, absolute(w)
    a = 2 + 2 * cosine
    if not form.rest:
        return (1 + select(left, -1, 1) * r) / sqrt(a)
    b, p = r.grade(2), r.grade(4)
    if form.q.zero:
        flip = select(left, -1, 1)
        p = 2 * flip * p
        return (1 + flip * r) * (1 - p / (2 * a)) / sqrt(a)
    p2 = (p * p)["1"]
    square = a * a - 4 * p2
    if not form.isoclinic:
        part = (p * b).grade(2)
    else:
        turned, left, h, b, part = _turned_part(r, (b * b)["1"], form)
        sine = sqrt(select(turned, p2, ONE))
        smaller = select(turned, -2 * h / (1 - cosine + sine), 1)
        square = select(turned, (a + 2 * sine) * smaller, square)
        square = select(square > 0, square, -ONE)  # half turns in both planes have many roots
    size = sqrt(square)
    root = sqrt((a + size) / 2)
    flip = select(left, -1, 1)
    first, second = root / size, -1 / (root * size)
    if form.isoclinic and form.second.positive:
        larger = 1 / sqrt(a + 2 * sine)
        first, second = select(turned, larger, first), select(turned, (1 / sqrt(smaller) - larger) / 2, second)
    return root / 2 + flip * p / (2 * root) + flip * first * b + second * part


def number_logarithm(a: Any, along: Any = None) -> Any:
    """Return the principal logarithm of ``w + v``, where ``v v`` is a scalar."""
    v, form = number_part(a)
    w, imaginary = a["1"], imaginary_unit_of(v) if along is None else along
    if form.s.zero:
        return log(w) + v / w
    s = (v * v)["1"]
    circle = circle_of(v, form)
    if circle is not None:
        y, blade = circle
        return log(w * w - s) / 2 + atan2(y, w) * blade
    if not form.s.positive:
        none = equal(s, 0)
        u = sqrt(select(none, ONE, -s))
        angle = atan2(select(none, 0, u), w)
        factor = select(none, 1, angle) / select(none, w, u)
        return log(defined(w * w - s, w, v, form)) / 2 + factor * v + select(none, angle, 0) * imaginary
    close = CLOSE * w * absolute(w)
    small = absolute(s) < close if form.s.both else s < close
    u = sqrt(select(small, ONE, absolute(s)))
    ratio = select(small, s, 0) / select(small, w * w, 1)
    circle = s < 0
    hyperbolic = select(small, 1, select(circle, 1, w + u)), select(small, 1, select(circle, 1, w - u))
    angle = (log(hyperbolic[0]) - log(hyperbolic[1])) / 2
    norm = select(small, w * w - s, select(circle, w * w - s, hyperbolic[0] * hyperbolic[1]))
    result = log(defined(norm, w, v, form)) / 2
    if form.s.negative:
        on_line = equal(s, 0) * (w < 0)
        angle = select(circle, atan2(u, w), select(on_line, 0, angle))
        u = select(on_line, 1, u)
        result = result + select(on_line, atan2(0, select(on_line, w, 1)), 0) * imaginary
    area = polynomial_of(_AREAS, ratio) / select(small, w, 1)
    return result + select(small, area, angle / u) * v


def number_square_root(a: Any, along: Any = None) -> Any:
    """Return the principal square root of ``w + v``, where ``v v`` is a scalar."""
    v, form = number_part(a)
    w, imaginary = a["1"], imaginary_unit_of(v) if along is None else along
    if form.s.zero:
        root = sqrt(w)
        return root + v / (2 * root)
    s = (v * v)["1"]
    square = w * w - s
    if form.s.positive and not form.s.negative:
        root = sqrt(select(w < 0, -ONE, (w + sqrt(square)) / 2))
        return root + v / (2 * root)
    left = w < 0
    if form.s.positive:  # both of the numbers w + u and w - u must have a root
        square = select(left * (s > 0), -ONE, square)
    root = sqrt((absolute(w) + sqrt(defined(square, w, v, form, at_zero=True))) / 2)
    none = equal(s, 0)
    u = sqrt(select(none, ONE, absolute(s)))
    nothing = equal(root, 0)
    twice = select(nothing, 1, 2 * root)
    real = select(left, select(none, 0, u) / twice, root)
    part = select(left, root / u, 1 / twice)
    return real + part * v + select(left * none, root, 0) * imaginary


def defined(value: Value, w: Value, v: Any, form: Form, at_zero: bool = False) -> Value:
    """Return `value`, or -1 where ``w + v`` has a null part `v` and ``w < 0``, or ``w <= 0`` with `at_zero`.

    Such numbers have neither a logarithm nor a root, like the Jordan block of a negative eigenvalue.
    """
    if not form.null:
        return value
    size = sum(absolute(v[v.algebra.spelling(blade)[1]]) for blade in sorted(blades_of(v)))
    return select(equal((v * v)["1"], 0) * (size > 0) * (w <= 0 if at_zero else w < 0), -ONE, value)


def number_part(a: Any) -> tuple[Any, Form]:
    """Return the non-scalar part of `a`, and the form of its square.

    Raises
    ------
    KernelError
        If the square of that part is not a scalar.
    """
    blades = frozenset(blade for blade in blades_of(a) if blade)
    v = a.grade(*sorted({blade.bit_count() for blade in blades}))
    form = form_of(a.algebra, blades)
    if form is None or form.rest or not (0 in blades_of(a) or form.s.negative):
        names = " ".join(a.algebra.spelling(blade)[1] for blade in sorted(blades_of(a)))
        raise KernelError(
            "log, sqrt or power",
            f"an element with blades {names}",
            "a scalar, a scalar plus a part whose square is one, or a unit versor",
        )
    return v, form


def imaginary_unit_of(v: Any) -> Any:
    """Return the first blade of `v` with a negative square, normalized to the square -1; 0 if there is none."""
    algebra = v.algebra
    for blade in sorted(blades_of(v), key=lambda blade: (blade.bit_count(), blade)):
        square = algebra.blade_product(blade, blade).get(0, 0)
        if square < 0:
            length = 1 if square == -1 else sqrt(lift(-square) if isinstance(v, Expression) else float(-square))
            return assemble(algebra, {algebra.spelling(blade)[1]: 1 / length})
    return 0
