"""Circular and hyperbolic functions of scalars and multivectors, by the closed forms of exponentials.

With ``b b = s + 2 p`` as in `gacompiler.frontend.exponentials`, ``cosh b`` and ``sinh b`` are the parts of ``exp(b)``
with even and odd powers, ``C(s + 2 p)`` and ``S(s + 2 p) b``. ``cos b`` and ``sin b`` are these for ``-s - 2 p``. A
scalar part follows from the theorems for sums.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib import import_module
from typing import Any

from ..algebra.coefficients import is_array_of_numbers
from ..algebra.multivector import Multivector
from ..algebra.signs import Signs
from ..errors import KernelError, OperandError
from ..rings.precise import is_precise, waves
from . import operations as scalar
from .exponentials import circular, even_and_odd, length_of
from .expression import Expression
from .operands import check_operand, own_operations
from .rows import Array
from .squares import Form, blades_of, form_of

LARGE = 20
"""Number from which hyperbolic tangents are 1 up to rounding: ``2 exp(-2 LARGE)`` is below 2**-54."""

Pair = tuple[Any, Any]


def sin(a: Any) -> Any:
    """Compute the sine ``a - a**3 / 6 + ...`` of a scalar or a multivector.

    Parameters
    ----------
    a : scalar or multivector
        A scalar plus a part whose square is a scalar, or a bivector over up to five basis vectors. With numbers of
        mpmath, any multivector.

    Returns
    -------
    scalar or multivector

    Raises
    ------
    KernelError
        If the blades of `a` have another form.
    """
    return _function("sin", a, _sine, circle=True)


def cos(a: Any) -> Any:
    """Compute the cosine ``1 - a**2 / 2 + ...`` of a scalar or a multivector; `a` as in `sin`."""
    return _function("cos", a, lambda w, b: w[0] * b[0] - w[1] * b[1], circle=True)


def tan(a: Any) -> Any:
    """Compute the tangent, the sine divided by the cosine, which must have an inverse; `a` as in `sin`."""
    return _function("tan", a, lambda w, b: _quotient(_sine(w, b), w[0] * b[0] - w[1] * b[1]), circle=True)


def sinh(a: Any) -> Any:
    """Compute the hyperbolic sine ``a + a**3 / 6 + ...`` of a scalar or a multivector; `a` as in `sin`."""
    return _function("sinh", a, _sine, circle=False)


def cosh(a: Any) -> Any:
    """Compute the hyperbolic cosine ``1 + a**2 / 2 + ...`` of a scalar or a multivector; `a` as in `sin`."""
    return _function("cosh", a, lambda w, b: w[0] * b[0] + w[1] * b[1], circle=False)


def tanh(a: Any) -> Any:
    """Compute the hyperbolic tangent, the hyperbolic sine divided by the hyperbolic cosine; `a` as in `sin`."""
    return _function("tanh", a, lambda w, b: _quotient(_sine(w, b), w[0] * b[0] + w[1] * b[1]), circle=False)


def _sine(w: Pair, b: Pair) -> Any:
    return w[1] * b[0] + w[0] * b[1]


def _quotient(a: Any, b: Any) -> Any:
    return a * scalar.inverse(b)


def _function(name: str, a: Any, combined: Callable[[Pair, Pair], Any], circle: bool) -> Any:
    """Return a function of `a`, combined from the cosines and sines of its scalar part and of its other part."""
    if isinstance(a, Array):
        a.refuse()
    if (run := own_operations((a,))) is not None:
        return run(name, a)
    check_operand(f"{name}()", a)
    if not hasattr(type(a), "norm_squared"):
        return _of_number(name, a)
    blades = blades_of(a)
    if not any(blades):
        if isinstance(a, Expression):
            return _of_scalar(name, a)
        w = a["1"]
        return a.lift(_of_number(name, w)) if isinstance(a, Multivector) else _of_number(name, w)
    if is_precise(a):
        return combined((1, 0), waves(a, circle))
    b = a.grade(*sorted({blade.bit_count() for blade in blades if blade}))
    form = form_of(a.algebra, frozenset(blade for blade in blades if blade))
    if form is None:
        names = " ".join(a.algebra.spelling(blade)[1] for blade in sorted(blades))
        expected = "a scalar plus a part whose square is a scalar, or a bivector over up to five basis vectors"
        raise KernelError(f"{name}()", f"an element with blades {names}", expected)
    if name == "tanh" and 0 not in blades and form.s.positive and not form.rest:
        b = _shortened(b, form)
    parts = even_and_odd(b, form, -1 if circle else 1)
    if 0 not in blades:
        return combined((1, 0), parts)
    w = a["1"]
    return combined((scalar.cos(w), scalar.sin(w)) if circle else _hyperbolic(w), parts)


def _shortened(b: Any, form: Form) -> Any:
    """Return `b`, or its multiple of the length LARGE if it is longer, whose tangent is the same up to rounding."""
    length = length_of(b, form)
    size = scalar.sqrt(scalar.maximum((b * b)["1"], 0)) if length is None else scalar.absolute(length)
    return LARGE / scalar.maximum(size, LARGE) * b


def _hyperbolic(w: Any) -> Pair:
    """Return the hyperbolic cosine and sine of a scalar."""
    if not isinstance(w, Expression):
        return _of_number("cosh", w), _of_number("sinh", w)
    cosine, ratio = circular(w * w, Signs(False, True), True, w)
    return cosine, ratio * w


def _of_scalar(name: str, w: Any) -> Any:
    """Return a function of a scalar expression."""
    if name in ("sin", "cos"):
        return scalar.sin(w) if name == "sin" else scalar.cos(w)
    if name == "tan":
        return scalar.sin(w) / scalar.cos(w)
    if name != "tanh":
        return _hyperbolic(w)[name == "sinh"]
    cosine, sine = _hyperbolic(scalar.maximum(scalar.minimum(w, LARGE), -LARGE))
    return sine / cosine


def _of_number(name: str, value: Any) -> Any:
    """Return a function of a number, or of an array of numbers."""
    if name in ("sin", "cos"):
        return scalar.sin(value) if name == "sin" else scalar.cos(value)
    if is_array_of_numbers(value):
        return getattr(import_module("numpy"), name)(value)
    library = type(value).__module__.partition(".")[0]
    try:
        return getattr(import_module(library) if library in ("mpmath", "sympy") else math, name)(value)
    except TypeError as error:  # complex numbers
        raise OperandError(f"{name}()", str(value), "real numbers") from error
