"""Operations on coefficients, for all types of numbers that a multivector can hold.

Coefficients need the operators ``+``, ``-`` and ``*``, and little else. Integers and Fractions are exact; floats,
complex numbers and numpy arrays are numeric; mpmath numbers are numeric to any precision. Symbolic rings
(`gacompiler.rings.Polynomial`, `gacompiler.ir.Scalar`) define their own ``scalar_function``. Sympy expressions can be
used because they have these operators.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from decimal import ROUND_FLOOR, Decimal
from fractions import Fraction
from typing import Any

from ..errors import InexactError, OperandError, ZeroDivisorError

try:
    import numpy as np
except ImportError:  # in browsers, where the compiler runs without it; then there are no such numbers
    _INTEGERS: tuple[type[Any], ...] = ()
    _FLOATS: tuple[type[Any], ...] = ()
    _REST: tuple[type[Any], ...] = ()
    _ARRAYS: tuple[type[Any], ...] = ()
else:
    _INTEGERS, _FLOATS, _REST, _ARRAYS = (np.integer,), (np.floating,), (np.number,), (np.ndarray, np.generic)

Coefficient = Any

_RATIONALS = frozenset({int, Fraction})
_NUMBERS = frozenset({int, Fraction, float, complex})
"""Types that are recognised without `isinstance`, which is slow for subclasses of abstract classes such as Fraction."""


_ROUNDED = (Decimal, float, complex, *_ARRAYS)
_CLASSES = (int, float, complex, Fraction, Decimal, *_REST)
_FOREIGN = ("sympy", "mpmath")
"""Packages whose numbers and formulas may be coefficients; they are not imported for the test."""


def is_number(value: Coefficient) -> bool:
    """Return whether a value is a number, or a formula of a ring that coefficients can have."""
    kind = type(value)
    return (
        isinstance(value, _CLASSES)
        or hasattr(kind, "scalar_function")
        or any(base.__module__.partition(".")[0] in _FOREIGN for base in kind.__mro__)
    )


def is_array_of_numbers(value: Coefficient) -> bool:
    """Return whether a value is an array that can be a coefficient."""
    return isinstance(value, _ARRAYS[:1]) and value.dtype.kind in "biufcO"


def is_exact(value: Coefficient) -> bool:
    """Return whether `value` is an integer or a fraction."""
    return type(value) in _RATIONALS or (isinstance(value, (int, Fraction)) and not isinstance(value, bool))


def as_exact(value: Coefficient) -> Coefficient:
    """Convert a number of Python or numpy to an exact number.

    A float is converted by its shortest decimal representation: 0.1 becomes 1/10. Other values are returned unchanged.

    Raises
    ------
    InexactError
        If the value is infinite or NaN.
    """
    if isinstance(value, _INTEGERS):
        return int(value)
    if not isinstance(value, (float, *_FLOATS)):
        return value
    text = float.__repr__(value) if isinstance(value, float) else str(value)
    if text.lstrip("-") in ("inf", "nan"):
        raise InexactError("constant in a kernel", text, "a finite number")
    found = Fraction(text)
    return found.numerator if found.denominator == 1 else found


def are_floats(values: Iterable[Coefficient]) -> bool:
    """Return whether values are numbers of Python or numpy, and one of them is not exact."""
    listed = [type(value) for value in values]
    return all(issubclass(kind, (int, Fraction, float, complex, *_REST)) for kind in listed) and not all(
        issubclass(kind, (int, Fraction)) for kind in listed
    )


def solved(rows: Sequence[Sequence[Coefficient]], right: Sequence[Coefficient]) -> list[Coefficient]:
    """Return the solution of linear equations in floating point; NaN if the matrix is singular."""
    try:
        return np.linalg.solve(np.array(rows, complex), np.array(right, complex)).tolist()  # type: ignore[no-any-return]
    except np.linalg.LinAlgError:
        return [math.nan] * len(right)


def is_representable(value: int | Fraction) -> bool:
    """Return whether an exact number is within the range of doubles and does not have thousands of digits."""
    bits = max(value.numerator.bit_length(), value.denominator.bit_length())
    return bits <= _MOST_BITS and abs(Fraction(value)) <= _LARGEST


_MOST_BITS = 8192
_LONGEST = 4096
"""Number of bits from which messages give only the size of a number; Python prints no more than 4300 digits."""
_LARGEST = Fraction(sys.float_info.max)


def is_zero(value: Coefficient) -> bool:
    """Return whether `value` is exactly zero by its form. Arrays never are: sparsity must not depend on data."""
    if type(value) in _NUMBERS:
        return not value
    own = getattr(value, "is_zero", None)
    if own is not None:
        return own is True
    return isinstance(value, (int, Fraction, float, complex)) and value == 0


def scale(value: Coefficient, factor: int | Fraction) -> Coefficient:
    """Return `value` times an exact number, with the type of `value`."""
    if factor == 1:
        return value
    if factor == -1:
        return -value
    if isinstance(factor, Fraction) and (isinstance(value, _ROUNDED) or _is_mpmath(value)):
        return value * factor.numerator / factor.denominator
    return value * factor


def divide(a: Coefficient, b: Coefficient) -> Coefficient:
    """Return ``a / b``, exact if both are exact.

    Raises
    ------
    ZeroDivisorError
        If both are exact and `b` is zero.
    """
    if is_exact(b) and is_exact(a):
        if b == 0:
            raise ZeroDivisorError("division", f"{a} / 0", "a divisor other than zero")
        quotient = Fraction(a) / b
        return quotient.numerator if quotient.denominator == 1 else quotient
    if is_exact(b):
        return scale(a, 1 / Fraction(b))
    if type(b) is Decimal and not b:
        raise ZeroDivisionError("division by zero")  # For 0 / 0, decimals give NaN.
    if isinstance(a, Fraction) and (type(b) is Decimal or _is_mpmath(b)):
        return a.numerator / (b * a.denominator)
    return a / b


def _is_mpmath(value: Coefficient) -> bool:
    return type(value).__module__.startswith("mpmath")


def _text(x: Any) -> str:
    """Return a number for a message: Python refuses to print exact numbers of thousands of digits."""
    x = Fraction(x)
    size = max(x.numerator.bit_length(), x.denominator.bit_length())
    return str(x) if size < _LONGEST else f"a number of {size} bits"


def _exact_sqrt(x: Any) -> Fraction:
    x = Fraction(x)
    root = Fraction(math.isqrt(abs(x.numerator)), math.isqrt(x.denominator))
    if root * root != x:
        raise InexactError("sqrt", f"{_text(x)} has no rational root", remedy="use floats or mpmath numbers")
    return root


def _exact_at(point: int, value: int, name: str) -> Callable[[Any], Fraction]:
    def function(x: Any) -> Fraction:
        if x != point:
            raise InexactError(name, f"{name}({_text(x)}) is not rational", remedy="use floats or mpmath numbers")
        return Fraction(value)

    return function


def _exact_atan2(y: Any, x: Any) -> Fraction:
    if y != 0 or x <= 0:
        found = f"atan2({_text(y)}, {_text(x)}) is not rational"
        raise InexactError("atan2", found, remedy="use floats or mpmath numbers")
    return Fraction(0)


_ANY: dict[str, Callable[..., Any]] = {
    "abs": abs,
    # NaN if either argument is NaN, and the second of two zeros, as in the backends.
    "minimum": lambda a, b: a if a < b or a != a else b,
    "maximum": lambda a, b: a if a > b or a != a else b,
    "less": lambda a, b: int(a < b),
    "less_equal": lambda a, b: int(a <= b),
    "equal": lambda a, b: int(a == b),
    "select": lambda condition, a, b: a if condition else b,
}


def _floor(x: float) -> float:
    """Return the floor of a float as a float, with the sign of zero, infinity and NaN preserved."""
    return math.copysign(math.floor(x), x) if math.isfinite(x) else x


EXACT: Mapping[str, Callable[..., Any]] = _ANY | {
    "floor": math.floor,
    "sqrt": _exact_sqrt,
    "sin": _exact_at(0, 0, "sin"),
    "cos": _exact_at(0, 1, "cos"),
    "exp": _exact_at(0, 1, "exp"),
    "log": _exact_at(1, 0, "log"),
    "acos": _exact_at(1, 0, "acos"),
    "atan2": _exact_atan2,
}

FLOAT: Mapping[str, Callable[..., Any]] = (
    _ANY
    | {name: getattr(math, name) for name in ("sqrt", "sin", "cos", "exp", "log", "acos", "atan2")}
    | {"floor": _floor}
)

ARRAY: Mapping[str, Callable[..., Any]] = (
    {}
    if not _ARRAYS
    else {
        "abs": np.abs,
        "floor": np.floor,
        "minimum": lambda a, b: np.where(np.less(a, b) | np.not_equal(a, a), a, b),
        "maximum": lambda a, b: np.where(np.greater(a, b) | np.not_equal(a, a), a, b),
        "less": lambda a, b: np.less(a, b) * 1.0,
        "less_equal": lambda a, b: np.less_equal(a, b) * 1.0,
        "equal": lambda a, b: np.equal(a, b) * 1.0,
        "select": lambda condition, a, b: np.where(np.asarray(condition) != 0, a, b),
        "sqrt": np.sqrt,
        "sin": np.sin,
        "cos": np.cos,
        "exp": np.exp,
        "log": np.log,
        "acos": np.arccos,
        "atan2": np.arctan2,
    }
)


def scalar_function(name: str, *arguments: Coefficient) -> Coefficient:
    """Apply the scalar function `name` in the ring of the arguments.

    Raises
    ------
    InexactError
        If all arguments are exact and the value is not rational.
    """
    kinds = set(map(type, arguments))
    if Decimal in kinds:
        return _decimal_function(name, arguments)
    if kinds <= _RATIONALS:
        return EXACT[name](*arguments)
    for argument in arguments:
        own = getattr(argument, "scalar_function", None)
        if own is not None:
            return own(name, arguments)
    if any(isinstance(argument, _ARRAYS) for argument in arguments):
        return ARRAY[name](*arguments)
    if any(_is_mpmath(argument) for argument in arguments):
        return _mpmath_function(name, arguments)
    if any(type(argument).__module__.startswith("sympy") for argument in arguments):
        return _sympy_function(name, arguments)
    if all(is_exact(argument) for argument in arguments):
        return EXACT[name](*arguments)
    try:
        return FLOAT[name](*arguments)
    except TypeError as error:  # complex numbers
        raise OperandError(f"{name}()", ", ".join(map(str, arguments)), "real numbers") from error


def _decimal_function(name: str, arguments: tuple[Any, ...]) -> Any:
    """Apply a function to decimals; the value is NaN if it is not real.

    Raises
    ------
    ValueError
        If a comparison or a choice has an argument that is not real.
    """
    lifted = [
        a if type(a) is Decimal else Decimal(a.numerator) / a.denominator if type(a) is Fraction else Decimal(a)
        for a in arguments
    ]
    if any(map(Decimal.is_nan, lifted)):
        if name in _ANY or name in ("atan2", "floor"):
            raise ValueError(f"{name} of a number that is not real")
        return lifted[0] if lifted[0].is_nan() else lifted[1]
    if name in _ANY:
        return _ANY[name](*lifted)
    if name == "sqrt":
        return lifted[0].sqrt()
    if name == "floor":
        return lifted[0].to_integral_value(ROUND_FLOOR)
    import mpmath

    found = getattr(mpmath, name)(*(mpmath.mpf(str(a) if a.is_finite() else float(a)) for a in lifted))
    if isinstance(found, mpmath.mpc) or not mpmath.isfinite(found):
        return Decimal("NaN") if isinstance(found, mpmath.mpc) else Decimal(float(found))
    return binary_to_decimal(found)


def binary_to_decimal(value: Any) -> Decimal:
    """Convert a finite number of mpmath to a decimal of the current precision."""
    sign, mantissa, exponent, _ = value._mpf_
    # Exponents can have ten digits, for example those of exponentials, so powers are computed as decimals.
    return Decimal(-int(mantissa) if sign else int(mantissa)) * Decimal(2) ** int(exponent)


def _mpmath_function(name: str, arguments: tuple[Any, ...]) -> Any:
    import mpmath

    lifted = [
        mpmath.mpf(a.numerator) / a.denominator if isinstance(a, Fraction) else mpmath.mpmathify(a) for a in arguments
    ]
    if (name in _ANY or name in ("atan2", "floor")) and any(isinstance(value, mpmath.mpc) for value in lifted):
        raise ValueError(f"{name} of a number that is not real")
    return _ANY[name](*lifted) if name in _ANY else getattr(mpmath, name)(*lifted)


def _sympy_function(name: str, arguments: tuple[Any, ...]) -> Any:
    import sympy

    names = {"abs": "Abs", "minimum": "Min", "maximum": "Max"}
    if name in ("less", "less_equal", "equal"):
        relation = {"less": sympy.Lt, "less_equal": sympy.Le, "equal": sympy.Eq}[name](*arguments)
        return sympy.Piecewise((1, relation), (0, True))
    if name == "select":
        return sympy.Piecewise((arguments[1], sympy.Ne(arguments[0], 0)), (arguments[2], True))
    return getattr(sympy, names.get(name, name))(*arguments)
