"""Factors of polynomials, against products of known irreducible factors and against SymPy."""

from __future__ import annotations

from random import Random

import pytest
import sympy

from gacompiler.rings.factors import factors, is_irreducible
from gacompiler.rings.polynomial import Polynomial, PolynomialRing


def random_polynomial(ring: PolynomialRing, variables: list[Polynomial], random: Random) -> Polynomial:
    """A polynomial with two to four terms of degree one or two."""
    total = ring.constant(0)
    for _ in range(random.randint(2, 4)):
        term = ring.constant(random.choice((-3, -2, -1, 1, 2, 3)))
        for variable in random.choices(variables, k=random.randint(1, 2)):
            term = term * variable
        total = total + term
    return total


@pytest.mark.parametrize("seed", range(12))
def test_factors_of_products(seed: int) -> None:
    """The factors multiply to the polynomial, and are those of SymPy."""
    random, ring = Random(seed), PolynomialRing()
    names = ["x", "y", "z", "u"]
    variables = [ring.variable(name) for name in names]
    parts = [random_polynomial(ring, variables, random) for _ in range(random.randint(1, 3))]
    product = ring.constant(random.choice((-2, 1, 3)))
    for part in parts:
        product = product * part
    if len(product.terms) < 2:
        return
    found = factors(product)
    rest = sympy.sympify(str(product).replace("**", "^").replace("^", "**"))
    total = ring.constant(1)
    for factor, exponent in found:
        assert len(factor.terms) > 1
        for _ in range(exponent):
            total = total * factor
    ratio = sympy.factor(rest / sympy.sympify(str(total)))
    assert sympy.fraction(ratio)[1].is_number and len(sympy.Add.make_args(ratio)) == 1
    expected = [(f, e) for f, e in sympy.factor_list(rest)[1] if len(sympy.Add.make_args(f.expand())) > 1]
    assert sorted(e for _, e in found) == sorted(e for _, e in expected)


def test_a_proof_of_irreducibility_holds() -> None:
    """No product is proved to be irreducible, and most polynomials without factors are."""
    ring = PolynomialRing()
    x, y, z = (ring.variable(name) for name in "xyz")
    for product in ((x - y) * (x + y), (x - y) * (x - y), (x * x + y * y) * (y + z), (x + 1) * (x * y - 1)):
        assert not is_irreducible(product.key)
    for single in (x * x + y * y + z * z, x * y - z, x * x - 2, x * x + x * y + y * y, x * y * z - 1):
        assert is_irreducible(single.key)
