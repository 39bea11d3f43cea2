"""Polynomials against sympy, and ideals against points of their relations."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations
from random import Random
from typing import Any

import pytest
import sympy
from exact_elements import NULL_PAIRS

from gacompiler.algebra.catalog import CATALOG, CGA3, PGA2, PGA3, STA, VGA3
from gacompiler.algebra.coefficients import scalar_function
from gacompiler.algebra.layout import Layout
from gacompiler.algebra.versors import sandwich
from gacompiler.errors import KernelError, TooLargeError, ZeroDivisorError
from gacompiler.ir.scalar import Op
from gacompiler.rings.groebner import completed, union
from gacompiler.rings.ideal import Ideal, s_polynomial
from gacompiler.rings.points import point
from gacompiler.rings.polynomial import Polynomial, PolynomialRing, total_terms
from tests.support.all_cases import all_cases

SYMBOLS = sympy.symbols("x0:4")


def new_ring() -> tuple[PolynomialRing, list[Polynomial]]:
    ring = PolynomialRing()
    return ring, [ring.variable(f"x{k}") for k in range(4)]


def random_pair(random: Random, ring: PolynomialRing, n: int = 5) -> tuple[Polynomial, Any]:
    """The same random polynomial here and in sympy."""
    terms: dict[tuple[int, ...], Fraction] = {}
    for _ in range(random.randint(0, n)):
        monomial = tuple(sorted(random.choices(range(4), k=random.randint(0, 3))))
        terms[monomial] = Fraction(random.choice((-1, 1)) * random.randint(1, 9), random.randint(1, 4))
    theirs = sympy.Add(*(_rational(v) * sympy.Mul(*(SYMBOLS[k] for k in m)) for m, v in terms.items()))
    return Polynomial(ring, {m: v.numerator if v.denominator == 1 else v for m, v in terms.items()}), theirs


def _rational(value: Any) -> Any:
    value = Fraction(value)
    return sympy.Rational(value.numerator, value.denominator)


def as_sympy(p: Polynomial) -> Any:
    return sympy.Add(*(_rational(v) * sympy.Mul(*(SYMBOLS[k] for k in m)) for m, v in p.terms.items()))


def value_at(p: Polynomial, point_: Sequence[Any]) -> Any:
    total: Any = Fraction(0)
    for monomial, value in p.terms.items():
        term: Any = value
        for variable in monomial:
            term = term * point_[variable]
        total = total + term
    return total


@pytest.mark.parametrize("seed", range(12))
def test_ring_operations_agree_with_sympy(seed: int) -> None:
    random = Random(seed)
    ring, _ = new_ring()
    (p, a), (q, b), (r, c) = (random_pair(random, ring) for _ in range(3))
    for mine, theirs in (
        (p + q, a + b),
        (p - q, a - b),
        (p * q, a * b),
        (-p, -a),
        (p * q + r * p - q, a * b + c * a - b),
        (p + 1, a + 1),
        (Fraction(1, 3) - p, sympy.Rational(1, 3) - a),
        (p * 2 / 3, a * 2 / 3),
        (p * p * p, a**3),
    ):
        assert sympy.expand(as_sympy(mine) - theirs) == 0
        assert mine.degree == (sympy.Poly(theirs, *SYMBOLS).total_degree() if sympy.expand(theirs) != 0 else -1)
        assert all(value != 0 for value in mine.terms.values())
        assert all(list(monomial) == sorted(monomial) for monomial in mine.terms)


@all_cases("seed", range(6))
def test_ring_axioms(seed: int) -> None:
    random = Random(100 + seed)
    ring, _ = new_ring()
    p, q, r = (random_pair(random, ring)[0] for _ in range(3))
    assert (p + q) + r == p + (q + r) and p + q == q + p
    assert (p * q) * r == p * (q * r) and p * q == q * p
    assert p * (q + r) == p * q + p * r
    assert p - p == 0 and (p - p).is_zero and p * 0 == 0 and p * 1 == p
    assert hash(p * q) == hash(q * p) and (p * q).key == (q * p).key


@all_cases("seed", range(6))
def test_substitution_agrees_with_sympy(seed: int) -> None:
    random = Random(200 + seed)
    ring, _ = new_ring()
    (p, a), (q, b), (r, c) = (random_pair(random, ring, 4) for _ in range(3))
    mine = p.substitute({0: q, 2: r})
    theirs = a.subs({SYMBOLS[0]: b, SYMBOLS[2]: c}, simultaneous=True)
    assert sympy.expand(as_sympy(mine) - theirs) == 0


def test_monomials_are_ordered_by_degree_and_then_by_variable() -> None:
    ring, (x, y, z, _) = new_ring()
    assert (x * y + z * z + y * y * z).leading == (1, 1, 2)
    assert (x * x + x * y + y * y).leading == (0, 0)
    assert (x + ring.atom(Op.SQRT, x)).leading == (-1,)
    assert str(2 * x * y - x * x + Fraction(1, 2)) == "-x0**2 + 2*x0*x1 + 1/2"
    assert (x * y + 3).variables == (0, 1) and ring.constant(3).constant_value == 3
    assert x.constant_value is None and (x - x).constant_value == 0 and (x - x).degree == -1
    assert total_terms([x + y, z]) == 3


def test_polynomials_are_values() -> None:
    _, (x, y, *_) = new_ring()
    p = x + y
    before = dict(p.terms)
    _ = p * p, p + 1, p - y, -p, p / 2, p.substitute({0: y})
    assert dict(p.terms) == before
    assert x + y - y == x and x != y and x - x + 3 == 3 and x != 3


def test_inexact_numbers_are_rejected() -> None:
    _, (x, *_) = new_ring()
    with pytest.raises(KernelError, match="expected an exact number"):
        _ = x + 0.5
    for value in ("x", None, 1j):
        with pytest.raises((KernelError, TypeError)):
            _ = x + value


def test_whole_floats_are_numbers() -> None:
    _, (x, *_) = new_ring()
    assert x * 2.0 == x + x


def test_products_that_explode_are_stopped() -> None:
    ring = PolynomialRing(budget=50)
    total = ring.constant(0)
    for k in range(12):
        total = total + ring.variable(f"x{k}")
    with pytest.raises(TooLargeError, match="terms"):
        _ = total * total * total


# Atoms


def test_atoms_are_shared_and_named() -> None:
    ring, (x, y, *_) = new_ring()
    a, b = scalar_function("sqrt", x + y), scalar_function("sqrt", y + x)
    assert a == b and a != scalar_function("sqrt", x - y)
    assert str(a) == "sqrt(x0 + x1)"
    assert ring.atom_of(a.variables[0]).op is Op.SQRT


@all_cases(
    "name, arguments, value", [("sqrt", (9,), 3), ("cos", (0,), 1), ("less", (1, 2), 1), ("select", (0, 4, 5), 5)]
)
def test_functions_of_numbers_are_numbers(name: str, arguments: tuple[int, ...], value: int) -> None:
    ring, _ = new_ring()
    assert scalar_function(name, *map(ring.constant, arguments)) == value


def test_functions_with_irrational_values_are_kept() -> None:
    ring, (x, y, *_) = new_ring()
    root = scalar_function("sqrt", ring.constant(2))
    assert root.constant_value is None
    ideal = Ideal(ring.atom_relations(), 4)
    assert ideal.reduce(root * root) == 2
    assert ideal.reduce(root * root * root * root) == 4
    chosen = scalar_function("select", ring.constant(1), x, y)
    assert chosen == x


def test_relations_of_atoms() -> None:
    """``sqrt(x)**2 = x``, ``x / x = 1``, ``sin**2 + cos**2 = 1``."""
    ring, (x, y, z, _) = new_ring()
    root = scalar_function("sqrt", x * x + y)
    sine, cosine = scalar_function("sin", z), scalar_function("cos", z)
    quotient = (x + y) / (y - z)
    ideal = Ideal(ring.atom_relations(), 6)
    assert ideal.reduce(root * root - x * x - y).is_zero
    assert ideal.reduce(root * root * root * z - (x * x + y) * root * z).is_zero
    assert ideal.reduce(sine * sine + cosine * cosine - 1).is_zero
    assert ideal.reduce(quotient * (y - z) - x - y).is_zero
    assert not ideal.reduce(root - x).is_zero and not ideal.reduce(sine - cosine).is_zero
    assert not ideal.reduce(sine * sine - cosine * cosine).is_zero


def test_a_division_by_multiples_shares_one_reciprocal() -> None:
    ring, (x, y, *_) = new_ring()
    assert (1 / (x - y)) * Fraction(1, 2) == 1 / (2 * x - 2 * y)
    assert 1 / (x - y) == -(1 / (y - x))
    assert len(ring.atoms) == 1


def test_division() -> None:
    ring, (x, *_) = new_ring()
    assert x / 2 == x * Fraction(1, 2) and x / ring.constant(4) == x * Fraction(1, 4)
    with pytest.raises(ZeroDivisorError, match="the divisor is identically zero"):
        _ = 1 / (x - x)


# Ideals


def elements(layout: Layout) -> tuple[PolynomialRing, Any, list[Polynomial]]:
    ring = PolynomialRing()
    symbols = [ring.variable(name) for name in layout.blades]
    element = layout.element(symbols)
    return ring, element, [ring.lift(value) for value in layout.relations(element)]


UNIT_LAYOUTS = [
    layout
    for algebra in CATALOG.values()
    if algebra.dimension <= 5
    for layout in (*algebra.layouts.values(), algebra.UNIT_EVEN)
    if layout.has_relations
]


@all_cases("layout", UNIT_LAYOUTS)
def test_normal_forms_keep_values_on_the_relations(layout: Layout) -> None:
    """A polynomial and its normal form agree wherever the relations hold; relations and multiples reduce to zero."""
    random = Random(str(layout))
    ring, _, relations = elements(layout)
    ideal = Ideal(relations, 4)
    points = [point(layout, random) for _ in range(3)]
    n = layout.size
    for _ in range(6):
        terms = {
            tuple(sorted(random.choices(range(n), k=random.randint(0, 4)))): random.randint(1, 9) for _ in range(5)
        }
        p = Polynomial(ring, terms)
        reduced = ideal.reduce(p)
        assert all(value_at(p, at) == value_at(reduced, at) for at in points)
        assert ideal.reduce(reduced) == reduced, "a normal form is its own normal form"
        factor = Polynomial(ring, {tuple(sorted(random.choices(range(n), k=random.randint(0, 2)))): 1})
        for relation in relations:
            assert ideal.reduce(relation * factor).is_zero
    for member in ideal.basis:
        assert all(value_at(member, at) == 0 for at in points)


@all_cases("layout", [VGA3.ROTOR, PGA2.MOTOR, PGA3.MOTOR, CGA3.MOTOR, STA.ROTOR, CGA3.UNIT_EVEN])
def test_versors_move_vectors_to_vectors(layout: Layout) -> None:
    """Normal forms prove properties of ``m v ~m``: other grades vanish, and lengths are preserved."""
    ring, versor, relations = elements(layout)
    algebra = layout.algebra
    components = [ring.variable(f"v{k}") for k in range(algebra.dimension)]
    v = algebra.multivector(dict(zip(algebra.vectors, components, strict=True)))
    moved = sandwich(versor, v)
    if algebra.dimension <= 4 or layout is CGA3.MOTOR:
        ideal = Ideal(relations, 5)
        assert all(ideal.reduce(value).is_zero for blade, value in moved.terms.items() if blade.bit_count() != 1)
        assert not all(ideal.reduce(value).is_zero for blade, value in moved.terms.items() if blade.bit_count() == 1)
    assert Ideal(relations, 4).reduce(ring.lift((versor * ~versor).scalar)) == 1


def test_ideals_complete_their_relations() -> None:
    """``x y = 1`` and ``x z = 1`` imply ``y = z`` only through an S-polynomial."""
    _, (x, y, z, _) = new_ring()
    ideal = Ideal([x * y - 1, x * z - 1], 3)
    assert ideal.reduce(y - z).is_zero
    assert not ideal.reduce(x - y).is_zero


@all_cases("seed", range(8))
def test_leading_terms_of_s_polynomials_cancel(seed: int) -> None:
    """Against ``lcm / LT(p) p - lcm / LT(q) q`` of sympy."""
    random = Random(300 + seed)
    ring, variables = new_ring()
    (p, _), (q, _) = (random_pair(random, ring) for _ in range(2))
    p, q = (each + variables[0] * variables[seed % 4] for each in (p, q))
    p, q = (each * (1 / Fraction(each.terms[each.leading])) for each in (p, q))
    a, b = (sympy.Poly(as_sympy(each), *SYMBOLS) for each in (p, q))
    first, second = (sympy.Mul(*(SYMBOLS[k] for k in each.leading)) for each in (p, q))
    whole = sympy.lcm(first, second)
    theirs = sympy.expand(whole / first * a.as_expr() - whole / second * b.as_expr())
    assert sympy.expand(as_sympy(s_polynomial(p, q)) - theirs) == 0
    assert sympy.Poly(theirs, *SYMBOLS).coeff_monomial(whole) == 0


@all_cases(
    "relations",
    [
        lambda x, y, z, w: [x * y - 1, x * z - 1],
        lambda x, y, z, w: [x + y + z, x * y + y * z + z * x, x * y * z - 1],
        lambda x, y, z, w: [x * z - y * y, y * w - z * z, x * w - y * z],
        lambda x, y, z, w: [x * x + y * y - 1, x * y - 2 * z, z * z - w],
        lambda x, y, z, w: [x * x * y - 3 * z, x * y * y + 2 * w - 1],
    ],
)
def test_completed_relations_are_the_groebner_basis_of_sympy(relations: Any) -> None:
    """Which is unique, in one order of monomials; and all S-polynomials are zero (Buchberger's criterion)."""
    _, variables = new_ring()
    given = relations(*variables)
    basis = Ideal(given, 8).basis
    theirs = sympy.groebner([as_sympy(p) for p in given], *SYMBOLS, order="grlex")
    ours = {sympy.Poly(as_sympy(p), *SYMBOLS, domain="QQ").monic() for p in basis}
    assert ours == {sympy.Poly(p, *SYMBOLS, domain="QQ").monic() for p in theirs.exprs}
    ideal = Ideal(given, 8)
    assert all(ideal.reduce(s_polynomial(p, q)).is_zero for p in basis for q in basis)


def test_a_basis_of_forms_ends_at_its_degree() -> None:
    """Of homogeneous relations, the elements up to a degree need no others: they are those of the whole basis."""
    _, (x, y, z, w) = new_ring()
    given = [x * x * y - z * z * z, x * y * y - w * w * z]
    found = sympy.groebner([as_sympy(p) for p in given], *SYMBOLS, order="grlex").exprs
    theirs = [sympy.Poly(p, *SYMBOLS, domain="QQ").monic() for p in found]
    sizes = [p.total_degree() for p in theirs]
    assert len(set(sizes)) == 3
    for degree in range(3, max(sizes) + 2):
        ours = {sympy.Poly(as_sympy(p), *SYMBOLS, domain="QQ") for p in Ideal(given, degree).basis}
        assert ours == {p for p, size in zip(theirs, sizes, strict=True) if size <= degree}


def test_an_empty_ideal_changes_nothing() -> None:
    _, (x, y, *_) = new_ring()
    assert Ideal([], 4).reduce(x * y - 1) == x * y - 1
    assert Ideal([x - x], 4).basis == ()


@pytest.mark.parametrize("order", [1, -1])
def test_contradictions_are_rejected(order: int) -> None:
    _, (x, y, *_) = new_ring()
    with pytest.raises(KernelError, match=r"they contradict each other \(they imply 1 = 0\)"):
        Ideal([x * y - 1, x][::order], 3)
    with pytest.raises(KernelError, match="contradict"):
        Ideal([x - x + 2], 3)


def test_ideals_agree_with_sympy() -> None:
    """Membership against sympy's Groebner bases, in the same order, with no bound on the degree."""
    random = Random(9)
    for _ in range(6):
        ring, _ = new_ring()
        pairs = [random_pair(random, ring, 3) for _ in range(2)]
        pairs = [(p, a) for p, a in pairs if p.degree >= 1]
        if not pairs:
            continue
        theirs = sympy.groebner([a for _, a in pairs], *SYMBOLS, order="grlex")
        if theirs.exprs == [1]:
            continue
        ideal = Ideal([p for p, _ in pairs], 8)
        for _ in range(4):
            p, a = random_pair(random, ring)
            q = sum((p * m for m, _ in pairs), ring.constant(0))
            assert ideal.reduce(q).is_zero
            if ideal.reduce(p).is_zero:
                assert theirs.contains(a)


def test_the_order_of_relations_does_not_matter() -> None:
    ring, element, relations = elements(PGA3.MOTOR)
    p = ring.lift(sandwich(element, NULL_FREE)["e1"])
    assert Ideal(relations, 3).reduce(p) == Ideal(relations[::-1], 3).reduce(p)


NULL_FREE = PGA3.basis()[0]


def test_ideals_of_null_pairs() -> None:
    layout = NULL_PAIRS.UNIT_EVEN
    ring, versor, relations = elements(layout)
    w1, w2, v1, _ = NULL_PAIRS.basis()
    moved = [sandwich(versor, x) for x in (w1, w2, v1)]
    ideal = Ideal(relations, 4)
    products = [[ideal.reduce(ring.lift(a.product("scalar_product", b).scalar)) for b in moved] for a in moved]
    assert products == [[0, 0, 1], [0, 0, 0], [1, 0, 0]]


def test_ideals_of_one_layout_are_completed_once() -> None:
    """Under other names of the variables, and together with unrelated relations."""
    ring = PolynomialRing()
    versors = []
    for name in ("m", "n"):
        symbols = [ring.variable(f"{name}_{blade}") for blade in PGA3.MOTOR.blades]
        versors.append(PGA3.MOTOR.element(symbols))
    first, second = ([ring.lift(value) for value in PGA3.MOTOR.relations(versor)] for versor in versors)
    alone = Ideal(first, 4)
    before = completed.cache_info().misses
    other, both = Ideal(second, 4), Ideal([*second, *first], 4)
    assert completed.cache_info().misses == before
    assert len(other.basis) == len(alone.basis) and len(both.basis) == 2 * len(alone.basis)
    assert both.reduce((versors[0] * ~versors[0]).scalar * (versors[1] * ~versors[1]).scalar) == 1


@pytest.mark.parametrize("degree", [3, 4, 5])
def test_all_s_polynomials_up_to_the_degree_are_zero(degree: int) -> None:
    """Discarded pairs are superfluous: the basis satisfies Buchberger's criterion for every pair."""
    _, _, relations = elements(CGA3.MOTOR)
    ideal = Ideal(relations, degree)
    for p, q in combinations(ideal.basis, 2):
        s = s_polynomial(p, q)
        whole = union(p.leading, q.leading)
        assert len(whole) > degree or ideal.reduce(s).is_zero
