"""Factors of polynomials over the rational numbers.

Most polynomials have none, which is proved on lines modulo small primes. A factor has a degree, and on a line on which
the degree of the polynomial does not fall it is a product of some factors modulo the prime. If no degree is possible on
all lines, the polynomial is irreducible. SymPy factorises the others.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from math import gcd, lcm
from random import Random

from ..algebra.blades import exact
from .polynomial import Key, Polynomial, quotient

TERM_LIMIT = 200
"""Polynomials with more terms than this are not factorised, which may take seconds."""
PRIMES = (101, 103, 107, 109, 113, 127, 131, 137, 139, 149, 151, 157)
"""One line is tried modulo each of them. All polynomials with few terms have a small degree, compared with these."""

KEPT = 4_096
"""Number of polynomials that are known to be irreducible, or not: systems of one kernel share most of them."""

Row = list[int]
"""Coefficients of a polynomial in one variable modulo a prime, the constant first, and the last one not zero."""


def factors(polynomial: Polynomial) -> list[tuple[Polynomial, int]]:
    """Return the irreducible factors with more than one term, and their exponents.

    Their product is the polynomial up to a number and a monomial. The coefficients of a factor are whole numbers
    without a common divisor, and the first one is positive.
    """
    rest = _primitive(_without_monomial(polynomial))
    if not 2 < len(rest.terms) <= TERM_LIMIT or is_irreducible(rest.key):
        return [(rest, 1)]
    found = [
        (_primitive(Polynomial(polynomial.ring, dict(terms))), exponent) for terms, exponent in _factor_list(rest.key)
    ]
    return sorted(found, key=lambda pair: (pair[0].degree, pair[0].key))


@lru_cache(maxsize=KEPT)
def _factor_list(terms: Key) -> list[tuple[Key, int]]:
    """Return the terms of the factors that SymPy finds, and their exponents."""
    from sympy import ZZ
    from sympy.polys.rings import PolyRing

    variables = sorted({variable for monomial, _ in terms for variable in monomial})
    ring = PolyRing([f"x{k}" for k in range(len(variables))], ZZ)
    given = ring.from_dict({tuple(map(monomial.count, variables)): int(value) for monomial, value in terms})
    found: list[tuple[Key, int]] = []
    for factor, exponent in given.factor_list()[1]:
        rows = [
            (tuple(v for v, power in zip(variables, powers, strict=True) for _ in range(power)), int(value))
            for powers, value in factor.items()
        ]
        found.append((tuple(rows), exponent))
    return found


@lru_cache(maxsize=KEPT)
def is_irreducible(terms: Key) -> bool:
    """Return whether a proof was found that a polynomial with whole coefficients has no factor of a lower degree."""
    degree, random = len(terms[0][0]), Random(1)
    possible = set(range(1, degree))
    for prime in PRIMES:
        line = _on_line(terms, prime, random)
        if len(line) == degree + 1:
            sums = {0}
            for part in _degrees_of_factors(line, prime):
                sums |= {known + part for known in sums}
            possible &= sums
        if not possible:
            return True
    return False


def _primitive(polynomial: Polynomial) -> Polynomial:
    """Return a multiple with whole coefficients without a common divisor, and a positive first one."""
    values = [Fraction(value) for value in polynomial.terms.values()]
    size = Fraction(lcm(*(v.denominator for v in values)), gcd(*(v.numerator for v in values)))
    sign = 1 if polynomial.terms[polynomial.leading] > 0 else -1
    return Polynomial(polynomial.ring, {m: exact(sign * size * value) for m, value in polynomial.terms.items()})


def _without_monomial(polynomial: Polynomial) -> Polynomial:
    """Return a polynomial divided by the monomial that all its terms have in common."""
    first, *others = polynomial.terms
    common = tuple(v for v in dict.fromkeys(first) for _ in range(min(m.count(v) for m in (first, *others))))
    terms = {quotient(m, common) or (): value for m, value in polynomial.terms.items()} if common else polynomial.terms
    return Polynomial(polynomial.ring, terms)


def _on_line(terms: Key, prime: int, random: Random) -> Row:
    """Return a polynomial on a random line, modulo a prime."""
    variables = sorted({variable for monomial, _ in terms for variable in monomial})
    points = {v: (random.randrange(prime), random.randrange(1, prime)) for v in variables}
    total = [0] * (len(terms[0][0]) + 1)
    for monomial, value in terms:
        row = [int(value) % prime]
        for variable in monomial:
            start, step = points[variable]
            row = [(start * a + step * b) % prime for a, b in zip([*row, 0], [0, *row], strict=True)]
        for k, a in enumerate(row):
            total[k] += a
    return _trimmed([a % prime for a in total])


def _degrees_of_factors(row: Row, prime: int) -> list[int]:
    """Return the degrees of the factors modulo a prime (distinct-degree factorisation).

    Only one of several equal factors is found; it is repeated until the degrees add up.
    """
    found: list[int] = []
    rest, power, degree = row, [0, 1], 0
    while len(rest) - 1 >= 2 * (degree + 1):
        degree += 1
        power = _power(power, prime, rest, prime)
        common = _gcd(rest, _minus_x(power, prime), prime)
        while len(common) > 1:
            found += [degree] * ((len(common) - 1) // degree)
            rest = _divided(rest, common, prime)[0]
            common = _gcd(rest, common, prime)
        power = _divided(power, rest, prime)[1] if len(rest) > 1 else power
    return found + ([len(rest) - 1] if len(rest) > 1 else [])


def _power(base: Row, exponent: int, modulus: Row, prime: int) -> Row:
    result = [1]
    for bit in f"{exponent:b}":
        result = _divided(_product(result, result, prime), modulus, prime)[1]
        if bit == "1":
            result = _divided(_product(result, base, prime), modulus, prime)[1]
    return result


def _product(a: Row, b: Row, prime: int) -> Row:
    total = [0] * max(len(a) + len(b) - 1, 0)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            total[i + j] += x * y
    return _trimmed([value % prime for value in total])


def _divided(a: Row, b: Row, prime: int) -> tuple[Row, Row]:
    """Return the quotient and the remainder."""
    rest, inverse = list(a), pow(b[-1], -1, prime)
    result = [0] * max(len(a) - len(b) + 1, 0)
    for k in reversed(range(len(result))):
        result[k] = rest[k + len(b) - 1] * inverse % prime
        for j, y in enumerate(b):
            rest[k + j] = (rest[k + j] - result[k] * y) % prime
    return result, _trimmed(rest[: len(b) - 1])


def _gcd(a: Row, b: Row, prime: int) -> Row:
    while b:
        a, b = b, _divided(a, b, prime)[1]
    return a


def _minus_x(row: Row, prime: int) -> Row:
    padded = [*row, *[0] * (2 - len(row))]
    padded[1] = (padded[1] - 1) % prime
    return _trimmed(padded)


def _trimmed(row: Row) -> Row:
    while row and not row[-1]:
        row.pop()
    return row
