"""Sine and its kin without branches, step for step as in the C files: at most 2 ulp from the exact values.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

from .runtime_functions import _OF_ANGLES
from .runtime_llvm import _tools
from .runtime_terms import _Term

_CONSTANTS: dict[str, dict[str, float]] = {}
"""Of the transcendental functions, in parts, for each type."""
_FARTHEST = 0
"""Sines and cosines of larger arguments are those of the C library."""


class _Format:
    """Of the numbers of a type."""

    def __init__(self, x: _Term) -> None:
        double = x.is_double
        self.constants = _CONSTANTS[x.type_name]
        self.width, self.fraction, self.bias = (64, 52, 1023) if double else (32, 23, 127)
        """Bits of a number and of its fraction, and what is added to exponents."""
        self.shift = 1.5 * 2**self.fraction
        """A number so large that the bits of what is added to it, up to half a million, are its last."""
        self.least, self.most = 2.0 ** (1 - self.bias), (2 - 2.0**-self.fraction) * 2.0**self.bias
        """The smallest number that has all bits, and the largest."""
        self.below, self.above = (-746, 710) if double else (-105, 89)
        """Exponentials of what is below are 0, of what is above infinite."""
        self.one, self.root = self.bias << self.fraction, 0x3FE6A09E667F3BCD if double else 0x3F3504F3
        """1 and the root of 1/2 as words."""


def _is_far(x: _Term) -> _Term:
    return x.absolute() > _FARTHEST


def _quarters_of(x: _Term) -> tuple[_Term, _Term, _Term]:
    """How many quarter turns an angle has, modulo 4, and what is left in two parts, up to an eighth of a turn."""
    wide = x.to_double()
    form = _Format(wide)
    known, shift = form.constants, form.shift
    shifted = wide * known["turn_inverse"] + shift
    k = shifted - shift
    a, b = wide - k * known["turn_0"], k * known["turn_1"]
    if not x.is_double:
        return (k.to_float() + _Format(x).shift).bits(), (a - b).to_float(), x.like(0)
    whole = a - b
    back = a - whole
    error = ((back - b) + (a - (whole + back))) - k * known["turn_2"]
    rest = whole + error
    return shifted.bits(), rest, (whole - rest) + error


def _sin_of_rest(x: _Term, low: _Term) -> _Term:
    z = x * x
    return x + (x * (z * z.polynomial("sin")) + low)


def _cos_of_rest(x: _Term, low: _Term) -> _Term:
    z = x * x
    half, first = z * 0.5, z.like(1)
    one = first - half
    return one + (((first - one) - half) + (z * z * z.polynomial("cos") - x * low))


def _sin_of(x: _Term) -> _Term:
    n, rest, low = _quarters_of(x.absolute())
    y = n.is_odd().chosen(_cos_of_rest(rest, low), _sin_of_rest(rest, low))
    return y.flipped_by(x.bits() ^ (n << (_Format(x).width - 2)))


def _cos_of(x: _Term) -> _Term:
    n, rest, low = _quarters_of(x.absolute())
    y = n.is_odd().chosen(_sin_of_rest(rest, low), _cos_of_rest(rest, low))
    return y.flipped_by((n + 1) << (_Format(x).width - 2))


def _exp_of(x: _Term) -> _Term:
    """The power of 2 comes in two factors, so that the largest and the smallest results are reached."""
    form = _Format(x)
    known, bias, fraction, shift = form.constants, form.bias, form.fraction, x.like(form.shift)
    y = (x > form.above).chosen(form.above, (x < form.below).chosen(form.below, x))
    shifted = y * known["log_inverse"] + shift
    k = shifted - shift
    z = (y - k * known["log_high"]) - k * known["log_low"]
    n = shifted.bits() - shift.bits()
    half = ((n + 2 * bias) >> 1) - bias
    a, b = ((half + bias) << fraction).number(), ((n - half + bias) << fraction).number()
    return (x.like(1) + (z + z * z * z.polynomial("exp"))) * a * b


def _log_of(x: _Term) -> _Term:
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
    low = s * (half + z * z.polynomial("log")) + k * known["log_low"]
    finite = k * known["log_high"] - ((half - low) - f)
    positive = x > 0
    other = x.equals(0).chosen(x.like(-math.inf), positive.chosen(x, math.nan))
    return (positive & (x < math.inf)).chosen(finite, other)


def _atan2_of(y: _Term, x: _Term) -> _Term:
    form = _Format(x)
    known = form.constants
    u, v = x.absolute(), y.absolute()
    swapped, left = v > u, x.is_negative()
    most, least = swapped.chosen(v, u), swapped.chosen(u, v)
    # Sums of the largest numbers would overflow; two zeros, and two infinities, have the ratio 0 and 1.
    same, none = u.equals(math.inf) & v.equals(math.inf), most.equals(0)
    scale = (most > form.most / 64).chosen(x.like(1 / 64), 1)
    big, small = none.chosen(1, same.chosen(1, most * scale)), same.chosen(1, least * scale)
    # Above 0.55 an eighth of a turn is taken away: results below 1/2 come from one division. The factor 16 is for
    # the smallest numbers, whose products are rounded to few bits.
    upper = small * 16 > big * 8.8
    t = (small - upper.chosen(big, 0)) / (big + upper.chosen(small, 0))
    z = t * t
    angle = t + t * (z * z.polynomial("atan"))
    near = upper.chosen(x.like(1), 0)
    first = swapped.chosen(x.like(2) - near, near)
    eighths = left.chosen(x.like(4) - first, first)
    turned = (left ^ swapped).chosen(-angle, angle)
    return (eighths * known["eighth_high"] + (eighths * known["eighth_low"] + turned)).flipped_by(y.bits())


def _acos_of(x: _Term) -> _Term:
    known = _Format(x).constants
    u = x.absolute()
    large = u > 0.5
    z = large.chosen((u.like(1) - u) * 0.5, x * x)
    s = large.chosen(z.root(), x)
    more = s * (z * z.polynomial("asin"))
    middle = x.like(2 * known["eighth_high"]) - (s - (x.like(2 * known["eighth_low"]) - more))
    right = (s + more) * 2
    left = x.like(4 * known["eighth_high"]) - (right - 4 * known["eighth_low"])
    return large.chosen((x < 0).chosen(left, right), middle)


_FORMULAS: dict[str, Callable[..., _Term]] = {
    "sin": _sin_of,
    "cos": _cos_of,
    "exp": _exp_of,
    "log": _log_of,
    "atan2": _atan2_of,
    "acos": _acos_of,
}


@functools.cache
def _numba_transcendental(near: bool) -> dict[str, Any]:
    """The functions under numba.

    Near sines and cosines take an array too, behind which they write 1 where an angle is too far for them.
    """
    tools = _tools()

    def exact(name: str, context: Any, builder: Any, real: Any, x: _Term, found: _Term) -> Any:
        before = builder.block
        with builder.if_then(_is_far(x).value, likely=False):
            library = context.get_function(getattr(math, name), real(real))(builder, [x.value])
            inside = builder.block
        chosen = builder.phi(x.value.type)
        chosen.add_incoming(found.value, before)
        chosen.add_incoming(library, inside)
        return chosen

    def note(context: Any, builder: Any, kind: Any, value: Any, x: _Term) -> None:
        array = context.make_array(kind)(context, builder, value)
        place = builder.gep(array.data, [array.nitems])
        noted = _is_far(x).chosen(1, _Term(builder, builder.load(place)))
        builder.store(noted.value, place)

    def made(name: str, formula: Callable[..., _Term]) -> Any:
        is_turn = name in _OF_ANGLES

        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            values = arguments[:1] if is_turn else arguments
            terms = [_Term(builder, value) for value in values]
            found = formula(*terms)
            if is_turn and near:
                note(context, builder, signature.args[1], arguments[1], terms[0])
            elif is_turn:
                return exact(name, context, builder, signature.args[0], terms[0], found)
            return found.value

        def one(typing: Any, x: Any) -> Any:
            real = tools.widest([x])
            return real(real), code

        def two(typing: Any, y: Any, x: Any) -> Any:
            real = tools.widest([y, x])
            return real(real, real), code

        def noting(typing: Any, x: Any, noted: Any) -> Any:
            return noted.dtype(noted.dtype, noted), code

        return tools.intrinsic(noting if is_turn and near else two if name == "atan2" else one)

    return {name: made(name, formula) for name, formula in _FORMULAS.items()}
