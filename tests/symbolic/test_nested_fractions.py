"""Normal forms of sums whose denominators contain sums in denominators."""

from __future__ import annotations

import sympy

from gacompiler.algebra.catalog import VGA2, VGA3
from gacompiler.symbolic import SymbolicMultivector, equal, inverse, multivector, reduce, scalar_product, symbols

A, B, C = symbols("a b c")
E1, E2, E3 = (multivector(VGA3, each) for each in VGA3.basis())


def scalar(value: object) -> SymbolicMultivector:
    return multivector(VGA2, {"1": value})


def test_continued_fractions() -> None:
    first = 1 / (1 + 1 / (1 + A))
    assert reduce(scalar(first - (1 + A) / (2 + A))) == 0
    second = 1 / (B + 1 / (A + 1 / (C + 1)))
    assert reduce(scalar(second - (A * (C + 1) + 1) / (B * (A * (C + 1) + 1) + C + 1))) == 0
    assert reduce(scalar(first - second)) != 0 and equal(scalar(first), scalar(second)) is False


def test_resistors_in_parallel() -> None:
    parallel = 1 / (1 / (A + B) + 1 / (A - B))
    assert reduce(scalar(parallel - (A**2 - B**2) / (2 * A))) == 0
    root = 1 / sympy.sqrt(1 + 1 / (1 + A**2))
    assert reduce(scalar(root**2 - (1 + A**2) / (2 + A**2))) == 0


def test_inverses_of_quotients() -> None:
    """A point of the plane moved to the sphere and back, and twice inverted in a sphere about another point."""
    point = A * E1 + B * E2
    up = E3 + 2 * inverse(point * point + 1) * (point - E3)
    down = (E3 ^ up) * inverse(E3 - E3 * scalar_product(E3, up)["1"])
    assert reduce(down + point) == 0
    center = E1 + C * E3
    once = center + inverse(point - center)
    assert reduce(center + inverse(once - center) - point) == 0
