"""Why a definition is undefined at random points: the first operation without a real value, and its arguments."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

import mpmath

from ..algebra.multivector import Multivector
from ..errors import InexactError
from ..frontend.expression import Expression, apply_operation, topological
from ..frontend.kernel import Kernel
from ..rings.decimals import digits, from_decimal, to_decimal
from .samples import is_real, sample

LONGEST = 60
"""Longest text of an expression that is shown; a longer one fills more than a line of a terminal."""
DIGITS = 50
"""Enough for the sign of an argument, since coefficients of random points are of moderate size."""


def reason(kernel: Kernel, expressions: Sequence[Expression], random: Random) -> str:
    """Return which operation of a definition has no real value at an ordinary random point.

    Returns
    -------
    str
        A clause such as ``sqrt(a | b) is not defined where a | b = -1.25``, or an empty text if there is none.
    """
    inputs = sample(kernel, random)
    values: dict[Expression, Multivector] = {}
    with digits(DIGITS):
        lifted = {name: to_decimal(value) for name, value in inputs.items()}
        for node in topological(expressions):
            arguments = [values[argument] for argument in node.arguments]
            try:
                values[node] = apply_operation(node, arguments, lifted, to_decimal)
                is_defined = all(is_real(from_decimal(value)) for value in values[node].terms.values())
            except (ArithmeticError, ValueError, InexactError, mpmath.libmp.ComplexResult):
                is_defined = False
            if not is_defined:
                pairs = zip(node.arguments, arguments, strict=True)
                where = [f"{_short(each)} = {_number(value)}" for each, value in pairs if each.arguments]
                return f"{_short(node)} is not defined where {' and '.join(where) or 'its arguments are ordinary'}"
    return ""


def _short(expression: Expression) -> str:
    text = str(expression)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


def _number(value: Multivector) -> str:
    terms = value.map(from_decimal)
    return str(terms.map(lambda x: float(mpmath.nstr(mpmath.mpf(x), 3)))) if terms.terms else "0"
