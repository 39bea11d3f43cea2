"""Transcendental functions without branches, with the steps of the C files: at most 2 ulp from the exact values."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

from ..functions import OF_ANGLES
from .llvm import intrinsic, widest
from .terms import Term

CONSTANTS: dict[str, dict[str, float]] = {
    "float64": {
        "quarter_inverse": 0.6366197723675814,
        "log_inverse": 1.4426950408889634,
        "quarter_0": 1.5707963267948966,
        "quarter_1": 6.123233995736766e-17,
        "quarter_2": -1.4973849048591698e-33,
        "log_0": 0.6931471805599453,
        "log_1": 2.3190468138462996e-17,
    },
    "float32": {
        "quarter_inverse": 0.6366197466850281,
        "log_inverse": 1.4426950216293335,
        "quarter_0": 1.5707963705062866,
        "quarter_1": -4.371138828673793e-08,
        "quarter_2": -1.7151245100058819e-15,
        "log_0": 0.6931471824645996,
        "log_1": -1.9046542121259336e-09,
    },
}
"""Constants of the transcendental functions for each dtype, split into parts."""
FARTHEST = 65536
"""Sines and cosines of larger arguments are computed by the C library."""


class _Format:
    """Parameters of the floating-point format of a dtype."""

    def __init__(self, x: Term) -> None:
        double = x.is_double
        self.constants = CONSTANTS[x.type_name]
        self.width, self.fraction, self.bias = (64, 52, 1023) if double else (32, 23, 127)
        """Bits of a number and of its fraction, and the bias of exponents."""
        self.shift = 1.5 * 2**self.fraction
        """A number so large that the last bits of its sum with an integer up to half a million are that integer."""
        self.least = 2.0 ** (1 - self.bias)
        """The smallest normal number."""
        self.below, self.above = (-746, 710) if double else (-105, 89)
        """Exponentials of numbers less than the first are 0, of numbers greater than the second infinite."""
        self.one, self.root = self.bias << self.fraction, 0x3FE6A09E667F3BCD if double else 0x3F3504F3
        """1 and the root of 1/2 as words."""


def _is_far(x: Term) -> Term:
    return x.absolute() > FARTHEST


def _quarters_of(x: Term) -> tuple[Term, Term]:
    """Return the nearest multiple of pi/2 to an angle, as an integer modulo 4, and the remainder, at most pi/4.

    pi/2 is split into three parts. The first difference is exact, so that rounding occurs only in small remainders.
    """
    form = _Format(x)
    known, shift = form.constants, x.like(form.shift)
    shifted = x.fused(known["quarter_inverse"], shift)
    k = shift - shifted
    rest = k.fused(known["quarter_2"], k.fused(known["quarter_1"], k.fused(known["quarter_0"], x)))
    return shifted.bits(), rest


def _sin_of_rest(x: Term) -> Term:
    z = x * x
    return (x * z).fused(z.polynomial("sin"), x)


def _cos_of_rest(x: Term) -> Term:
    z = x * x
    return z.fused(z.fused(z.polynomial("cos"), -0.5), 1)


def _sin_of(x: Term) -> Term:
    n, rest = _quarters_of(x.absolute())
    y = n.is_odd().chosen(_cos_of_rest(rest), _sin_of_rest(rest))
    return y.flipped_by(x.bits() ^ (n << (_Format(x).width - 2)))


def _cos_of(x: Term) -> Term:
    n, rest = _quarters_of(x.absolute())
    y = n.is_odd().chosen(_sin_of_rest(rest), _cos_of_rest(rest))
    return y.flipped_by((n + 1) << (_Format(x).width - 2))


def _exp_of(x: Term) -> Term:
    """Compute exp; the power of 2 is split into two factors, so that the largest and smallest results are reached."""
    form = _Format(x)
    known, bias, fraction, shift = form.constants, form.bias, form.fraction, x.like(form.shift)
    y = (x > form.above).chosen(form.above, (x < form.below).chosen(form.below, x))
    shifted = y.fused(known["log_inverse"], shift)
    k = shift - shifted
    z = k.fused(known["log_1"], k.fused(known["log_0"], y))
    n = shifted.bits() - shift.bits()
    half = ((n + 2 * bias) >> 1) - bias
    a, b = ((half + bias) << fraction).number(), ((n - half + bias) << fraction).number()
    return (z * z).fused(z.polynomial("exp"), z).fused(a, a) * b


def _log_of(x: Term) -> Term:
    """``x = 2^k (1 + f)``, ``1 + f`` between the roots of 1/2 and 2; numbers below the normal ones are scaled first."""
    form = _Format(x)
    known, fraction = form.constants, form.fraction
    tiny = x < form.least
    y = x * tiny.chosen(x.like(2.0 ** (fraction + 2)), 1)
    n = y.bits() + (form.one - form.root)
    shift, bias = x.like(2.0**fraction), tiny.chosen(x.like(form.bias + fraction + 2), form.bias)
    k = ((n >> fraction) + shift.bits()).number() - (shift + bias)
    f = ((n & ((1 << fraction) - 1)) + form.root).number() - 1
    half, s = f * f * 0.5, f / (f + 2)
    z = s * s
    low = s.fused(z.fused(z.polynomial("log"), half), k * known["log_1"])
    finite = k.fused(known["log_0"], f - (half - low))
    positive = x > 0
    other = x.equals(0).chosen(x.like(-math.inf), positive.chosen(x, math.nan))
    return (positive & (x < math.inf)).chosen(finite, other)


def _atan2_of(y: Term, x: Term) -> Term:
    known = _Format(x).constants
    u, v = x.absolute(), y.absolute()
    swapped, left = v > u, x.is_negative()
    most, least = swapped.chosen(v, u), swapped.chosen(u, v)
    # Two infinities have the ratio 1, two zeros 0.
    t = u.equals(v).chosen((u > 0).chosen(x.like(1), 0), least / most)
    z = t * t
    angle = (t * z).fused((z - 0.5).polynomial("atan"), t)
    quarters = swapped.chosen(x.like(1), left.chosen(x.like(2), 0))
    turned = (left ^ swapped).chosen(-angle, angle)
    return quarters.fused(known["quarter_0"], quarters.fused(known["quarter_1"], turned)).flipped_by(y.bits())


def _acos_of(x: Term) -> Term:
    known = _Format(x).constants
    u = x.absolute()
    large = u > 0.5
    z = large.chosen((u.like(1) - u) * 0.5, x * x)
    s = large.chosen(z.root(), x)
    more = s * (z * z.polynomial("asin"))
    middle = x.like(known["quarter_0"]) - (s - (x.like(known["quarter_1"]) - more))
    right = (s + more) * 2
    left = x.like(2 * known["quarter_0"]) - (right - 2 * known["quarter_1"])
    return large.chosen((x < 0).chosen(left, right), middle)


FORMULAS: dict[str, Callable[..., Term]] = {
    "sin": _sin_of,
    "cos": _cos_of,
    "exp": _exp_of,
    "log": _log_of,
    "atan2": _atan2_of,
    "acos": _acos_of,
}


@functools.cache
def transcendental_functions(near: bool) -> dict[str, Any]:
    """Return the functions for numba.

    If `near`, sines and cosines take an additional pointer, to which they write 1 if an angle is too large.
    """

    def exact(name: str, context: Any, builder: Any, real: Any, x: Term, found: Term) -> Any:
        before = builder.block
        with builder.if_then(_is_far(x).value, likely=False):
            library = context.get_function(getattr(math, name), real(real))(builder, [x.value])
            inside = builder.block
        chosen = builder.phi(x.value.type)
        chosen.add_incoming(found.value, before)
        chosen.add_incoming(library, inside)
        return chosen

    def note(builder: Any, place: Any, x: Term) -> None:
        noted = _is_far(x).chosen(1, Term(builder, builder.load(place)))
        builder.store(noted.value, place)

    def made(name: str, formula: Callable[..., Term]) -> Any:
        is_turn = name in OF_ANGLES

        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            values = arguments[:1] if is_turn else arguments
            terms = [Term(builder, value) for value in values]
            found = formula(*terms)
            if is_turn and near:
                note(builder, arguments[1], terms[0])
            elif is_turn:
                return exact(name, context, builder, signature.args[0], terms[0], found)
            return found.value

        def one(typing: Any, x: Any) -> Any:
            real = widest([x])
            return real(real), code

        def two(typing: Any, y: Any, x: Any) -> Any:
            real = widest([y, x])
            return real(real, real), code

        def noting(typing: Any, x: Any, noted: Any) -> Any:
            return noted.dtype(noted.dtype, noted), code

        return intrinsic(noting if is_turn and near else two if name == "atan2" else one)

    return {name: made(name, formula) for name, formula in FORMULAS.items()}
