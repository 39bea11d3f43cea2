"""Residues modulo a prime: a field, in which rational numbers keep their sums, products and quotients."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import pytest

from gacompiler.algebra.catalog import PGA3
from gacompiler.algebra.coefficients import divide, is_zero, scalar_function
from gacompiler.algebra.multivector import Multivector
from gacompiler.errors import InexactError, ZeroDivisorError
from gacompiler.rings.residues import PRIME, residue


def fraction(random: Random) -> Fraction:
    return Fraction(random.randint(-99, 99), random.randint(1, 99))


def test_rational_numbers_are_mapped_to_a_field() -> None:
    random = Random(1)
    for _ in range(50):
        a, b = fraction(random), fraction(random) or Fraction(1)
        x, y = residue(a), residue(b)
        assert x + y == a + b and x - y == a - b and x * y == a * b and x / y == a / b and -x == -a
        assert a + y == a + b and a - y == a - b and a * y == a * b and divide(a, y) == a / b and divide(x, b) == a / b
        assert (x == y) == (a == b) and hash(x) == hash(residue(a))


def test_small_rational_numbers_are_recognised() -> None:
    assert residue(Fraction(-5, 6)).near(12) == Fraction(-5, 6)
    assert residue(Fraction(1, 7)).near(12) is None
    assert is_zero(residue(PRIME)) and not is_zero(residue(1))


def test_other_functions_and_zero_divisors_are_refused() -> None:
    with pytest.raises(InexactError, match="sqrt"):
        scalar_function("sqrt", residue(4))
    with pytest.raises(InexactError, match="less"):
        scalar_function("less", residue(4), residue(5))
    with pytest.raises(ZeroDivisorError):
        _ = residue(1) / residue(0)


def test_products_of_multivectors_agree_with_rational_ones() -> None:
    random = Random(2)
    a, b = (Multivector(PGA3, {blade: fraction(random) for blade in PGA3.blades()}) for _ in range(2))
    product = a * b * a
    found = a.map(residue) * b.map(residue) * a.map(residue)
    assert all(found.terms[blade] == value for blade, value in product.terms.items())
    assert found.terms.keys() == product.terms.keys()
