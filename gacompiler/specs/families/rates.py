"""Numbers and multivectors with their derivatives by several variables, for kernels that linearise residuals.

A derivative that is identically zero is None, and no operation is emitted for it.
"""

from typing import Any, NamedTuple

import gacompiler as ga


class Rated(NamedTuple):
    """A value and its derivatives, or None for each that is zero."""

    value: Any
    rates: tuple[Any, ...]


def constant(value, n):
    """Return a value that depends on none of n variables."""
    return Rated(value, (None,) * n)


def _sum(a, b):
    if a is None or b is None:
        return b if a is None else a
    return a + b


def _times(a, b):
    return None if a is None or b is None else a * b


def plus(a, b):
    """Return a sum."""
    return Rated(a.value + b.value, tuple(map(_sum, a.rates, b.rates)))


def scaled(factor, a):
    """Return the product with a constant."""
    return Rated(factor * a.value, tuple(_times(factor, rate) for rate in a.rates))


def bilinear(operation, a, b):
    """Return ``operation(a, b)``, which is linear in each argument."""

    def rate(da, db):
        first = None if da is None else operation(da, b.value)
        return _sum(first, None if db is None else operation(a.value, db))

    return Rated(operation(a.value, b.value), tuple(map(rate, a.rates, b.rates)))


def linear(operation, a):
    """Return ``operation(a)``, which is linear."""
    return Rated(operation(a.value), tuple(None if rate is None else operation(rate) for rate in a.rates))


def quotient(a, b):
    """Return the quotient of two numbers, or of a multivector and a number."""
    value = a.value / b.value

    def rate(da, db):
        top = _sum(da, None if db is None else -(value * db))
        return None if top is None else top / b.value

    return Rated(value, tuple(map(rate, a.rates, b.rates)))


def length(parts):
    """Return the Euclidean norm of numbers."""
    value = ga.sqrt(sum(part.value * part.value for part in parts))

    def rate(*rates):
        terms = [part.value * r for part, r in zip(parts, rates, strict=True) if r is not None]
        return sum(terms[1:], terms[0]) / value if terms else None

    return Rated(value, tuple(map(rate, *(part.rates for part in parts))))


def components(element, names):
    """Return coefficients of a multivector as numbers with derivatives."""
    return [linear(lambda x, name=name: x[name], element) for name in names]
