"""The passes that find cheaper programs: each preserves the meaning exactly and has its intended effect."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import combinations_with_replacement
from random import Random

import numpy as np
import pytest
from exact_elements import GRASSMANN, OBLIQUE, name_of
from expressions import element, outputs_at, same_value, symbol, value

from gacompiler import (
    SCALAR,
    Algebra,
    absolute,
    atan2,
    clifford_conjugate,
    commutator,
    cos,
    inner_product,
    inverse,
    kernel,
    left_contraction,
    norm_squared,
    reverse,
    right_contraction,
    sandwich,
    sqrt,
)
from gacompiler.algebra.catalog import CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3, null_pairs, orthogonal
from gacompiler.algebra.products import product
from gacompiler.frontend.expression import evaluate
from gacompiler.frontend.kernel import Kernel, trace
from gacompiler.ir.interpret import interpret
from gacompiler.ir.scalar import Op
from gacompiler.passes.accuracy import run_in_double, ulps
from gacompiler.passes.associate import associate
from gacompiler.passes.divide import divide_once
from gacompiler.passes.expand import expand_contraction, expand_meet, expand_square
from gacompiler.passes.kernel_extraction import Sum, best_divisor
from gacompiler.passes.loop_accuracy import results_ulps
from gacompiler.passes.lower import Lowering, Reduction, Slot
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.resubstitute import resubstitute
from gacompiler.passes.rewrite import rewrite, split_conjugation, split_sandwich
from gacompiler.passes.samples import SPREADS, sample, samples
from gacompiler.passes.sandwich_differences import (
    reflection_as_difference,
    sandwich_as_difference,
    sandwich_of_difference,
)
from gacompiler.passes.shift import shift
from gacompiler.passes.squares import solvable, solve, square_of
from gacompiler.passes.system import Definition, System
from gacompiler.rings.polynomial import Polynomial, PolynomialRing
from gacompiler.rings.sparse import IndexedRelations, simplify
from gacompiler.structure.blocks import matrix_product
from gacompiler.structure.levels import COMPLEX, HALVES, plans
from tests.support.all_cases import all_cases


@pytest.mark.parametrize(
    "algebra",
    [
        CGA3,
        PGA3,
        VGA3,
        STA,
        null_pairs(2),
        null_pairs(3),
        orthogonal(4),
        orthogonal(0, 4),
        orthogonal(6),
        orthogonal(2, 1, 2),
        orthogonal(4, 0, 1),
    ],
    ids=lambda algebra: algebra.name,
)
def test_matrix_product_equals_the_geometric_product(algebra: Algebra) -> None:
    """Test every plan with any number of its levels, for two and three factors, dense and sparse."""
    random = Random(4)
    even, vectors = algebra.blades(*range(0, algebra.dimension + 1, 2)), algebra.blades(1)
    assert plans(algebra)
    for kinds in ((algebra.blades(),) * 2, (even, even), (algebra.blades(1, 2),) * 2, (even, vectors, even)):
        if algebra.dimension > 5 and len(kinds[0]) > 32:
            continue
        drawn = [{blade: Fraction(random.randint(-9, 9), random.randint(1, 4)) for blade in blades} for blades in kinds]
        factors = [{k: v for k, v in x.items() if v} for x in drawn]
        expected = factors[0]
        for factor in factors[1:]:
            expected = product(algebra, "geometric_product", expected, factor)
        for plan in plans(algebra, *map(frozenset, kinds)):
            for depth in range(1, len(plan) + 1):
                assert matrix_product(algebra, factors, plan[:depth], algebra.blades()) == expected
                assert matrix_product(algebra, factors, plan[:depth], expected) == expected


def test_algebras_without_matrices_have_no_levels() -> None:
    oblique = Algebra("oblique", "a b", [[1, Fraction(1, 2)], [Fraction(1, 2), 1]])
    assert plans(oblique) == () == plans(orthogonal(0, 1)) == plans(orthogonal(0, 0, 3)) == plans(orthogonal(11))


def test_matrices_of_the_algebra_that_occurs() -> None:
    """G(8, 0) is the algebra of real 16 x 16 matrices; the even elements of G(4, 0) are two quaternions."""

    def kinds(algebra: Algebra, *grades: int) -> list[list[bool | None]]:
        blades = frozenset(algebra.blades(*grades))
        names = {id(HALVES): True, id(COMPLEX): False}
        return [[names.get(id(level.kind)) for level in plan] for plan in plans(algebra, blades, blades)]

    assert kinds(orthogonal(8), *range(9)) == [[None] * 4]
    assert kinds(orthogonal(4), 0, 2, 4)[0] == [True]
    assert kinds(orthogonal(5), *range(6))[0] == [True, None]
    assert kinds(orthogonal(5), 0, 2, 4)[0] == [None]
    assert [False, None, None] in kinds(orthogonal(4, 1), *range(6))


@pytest.mark.slow
def test_counts_through_matrices() -> None:
    """Two products of quaternions; two quaternions applied to a 4D vector; matrices applied to a vector of G(2, 2)."""
    four, split = orthogonal(4), null_pairs(2)

    @kernel(a=four.even, b=four.even)
    def even_product(a, b):  # type: ignore[no-untyped-def]
        return a * b

    @kernel(r=four.UNIT_EVEN, v=four.layout("V", "e1 e2 e3 e4"))
    def turned(r, v):  # type: ignore[no-untyped-def]
        return sandwich(r, v)

    @kernel(r=split.UNIT_EVEN, v=split.VECTOR)
    def turned_in_null_pairs(r, v):  # type: ignore[no-untyped-def]
        return sandwich(r, v)

    for each, most in ((even_product, (40, 48)), (turned, (32, 32)), (turned_in_null_pairs, (27, 18))):
        cost = compile_kernel(each, forms=False).cost
        assert (cost.mul, cost.add) == most


@pytest.mark.parametrize("algebra", [VGA3, PGA3, CGA3, STA, null_pairs(2), OBLIQUE, GRASSMANN], ids=name_of)
def test_reflections_and_sandwiches_as_differences(algebra: Algebra) -> None:
    """Test every metric, vectors and even elements of any norm, and every grade that is reflected."""
    random = Random(algebra.name)
    v, m, full = element("v", algebra, 1), element("m", algebra, 0, 2, 4), element("x", algebra)
    for x in (full, *(element("x", algebra, grade) for grade in range(algebra.dimension + 1))):
        for reflection in (sandwich(v, x), v * x * v, v * (x * v), v * x * ~v):
            rewritten = reflection_as_difference(reflection)
            assert rewritten is not None and same_value(rewritten, reflection, random)
        rewritten = sandwich_as_difference(sandwich(m, x))
        assert rewritten is not None and same_value(rewritten, sandwich(m, x), random)
        for a, b in ((v, m), (m, v), (v, v), (m, m)):
            rewritten = split_sandwich(sandwich(a * b, x))
            assert rewritten is not None and same_value(rewritten, sandwich(a * b, x), random)


def test_only_reflections_are_written_as_reflections() -> None:
    a, b, x = (element(name, VGA3, 1) for name in "abx")
    even = element("m", VGA3, 0, 2)
    for other in (sandwich(even, x), a * x * b, even * x * even, a * x, a ^ x ^ a, a * (x ^ a)):
        assert reflection_as_difference(other) is None


@all_cases("algebra", [VGA2, VGA3, PGA2, PGA3, CGA3, STA, null_pairs(2), OBLIQUE, GRASSMANN])
def test_meets_of_three_vectors_are_expanded(algebra: Algebra) -> None:
    random, dimension = Random(algebra.name), algebra.dimension
    a, b, v = (element(name, algebra, 1) for name in "abv")
    p, q, n = (element(name, algebra, dimension - 1) for name in "pqn")
    for product_of_three in ((p & q) ^ v, v ^ (p & q), (a ^ b) & n, n & (a ^ b)):
        expanded = expand_meet(product_of_three)
        assert expanded is not None and same_value(expanded, product_of_three, random)


def test_only_products_of_three_vectors_are_expanded() -> None:
    a, b, v, p, q = (element(name, PGA3, grade) for name, grade in zip("abvpq", (1, 1, 1, 3, 3), strict=True))
    line, full = element("l", PGA3, 2), element("x", PGA3)
    for other in ((p & q) ^ line, (p & line) ^ v, (a ^ b) ^ v, (a ^ b) & line, (p ^ q) & v, (a & b) ^ v, full ^ v):
        assert expand_meet(other) is None
    for other in (
        left_contraction(a ^ b, v),
        right_contraction(v, a ^ b),
        inner_product(v, line),
        v ^ a ^ b,
        v * (a ^ b),
    ):
        assert expand_contraction(other) is None
    assert expand_contraction(inner_product(v, a ^ line)) is None is expand_contraction(inner_product(full, a ^ b))
    assert expand_square(norm_squared(a ^ line)) is None is expand_square(norm_squared(a * b))


def test_chains_in_the_cheapest_order() -> None:
    """Small factors are multiplied first; the value of a chain does not depend on its brackets."""
    m, r, t, u = (
        symbol(*each) for each in zip("mrtu", (PGA3.MOTOR, PGA3.ROTOR, PGA3.TRANSLATOR, PGA3.TRANSLATOR), strict=True)
    )
    random = Random(3)
    assert associate(m * t * u) == m * (t * u)
    assert associate(m * r * t * u) == (m * r) * (t * u)
    for chain in (m * t * u, m * r * t * u, m * (r * t * u)):
        cheapest = associate(chain)
        assert cheapest is not None and same_value(cheapest, chain, random) and associate(cheapest) is None
    p, q, plane, full = (element(name, PGA3, *g) for name, g in zip("pqlx", ((3,), (3,), (1,), ()), strict=True))
    a, b, c = (element(name, PGA3, 1) for name in "abc")
    for chain in (full & p & q, full ^ a ^ b, full ^ a ^ b ^ c):
        cheapest = associate(chain)
        assert cheapest is not None and same_value(cheapest, chain, random)
    for other in (m * t, m * (t * u), left_contraction(left_contraction(a, b), c), a + b + c, (p & q) ^ plane):
        assert associate(other) is None


def test_conjugations_in_sequence() -> None:
    p, q, v = (element(name, QUATERNIONS) for name in "pqv")
    for conjugate in (clifford_conjugate, reverse):
        together = p * q * v * conjugate(p * q)
        apart = split_conjugation(together)
        assert apart == p * (q * v * conjugate(q)) * conjugate(p) and same_value(apart, together, Random(2))
    for other in (
        p * q * v * clifford_conjugate(q * p), p * v * clifford_conjugate(p), p * q * v * inverse(p * q), p * q * v,
    ):  # fmt: skip
        assert split_conjugation(other) is None


@kernel(m=PGA3.MOTOR, a=PGA3.LINE, b=PGA3.LINE)
def bracket(m, a, b):  # type: ignore[no-untyped-def]
    return commutator(sandwich(m, a), sandwich(m, b))


def test_versors_are_factored_out_before_sandwiches_become_sums() -> None:
    (moved,) = trace(bracket).expressions
    m, a = moved.arguments[0].arguments
    b = moved.arguments[1].arguments[1]
    (difference,) = rewrite((moved,))["pulled out, as differences"]
    assert difference == sandwich_as_difference(sandwich(m, commutator(a, b)))
    first, second = evaluate([moved, difference], sample(bracket, Random(1)))
    assert first.terms == second.terms


@pytest.mark.slow
def test_counts_of_a_moved_bracket() -> None:
    """The bracket takes 18 and 12 operations, the motor 51 and 39."""
    assert str(compile_kernel(bracket, forms=False).cost) == "69 mul, 51 add"


def test_counts_of_chains() -> None:
    @kernel(m=PGA3.MOTOR, a=PGA3.TRANSLATOR, b=PGA3.TRANSLATOR, c=PGA3.TRANSLATOR)
    def translated(m, a, b, c):  # type: ignore[no-untyped-def]
        return m * a * b * c

    assert str(compile_kernel(translated, forms=False).cost) == "12 mul, 18 add"


@pytest.mark.slow
def test_counts_of_expanded_products() -> None:
    """The plane through a point and a line given by two planes; contractions in five dimensions."""

    @kernel(a=PGA3.PLANE, b=PGA3.PLANE, p=PGA3.POINT)
    def plane(a, b, p):  # type: ignore[no-untyped-def]
        return (a ^ b) & p

    @kernel(v=CGA3.VECTOR, a=CGA3.VECTOR, b=CGA3.VECTOR)
    def contracted(v, a, b):  # type: ignore[no-untyped-def]
        return left_contraction(v, a ^ b)

    @kernel(a=PGA3.POINT, b=PGA3.POINT, n=PGA3.PLANE)
    def through_points(a, b, n):  # type: ignore[no-untyped-def]
        return (a & b) ^ n

    assert str(compile_kernel(plane, forms=False).cost) == "14 mul, 10 add"
    assert str(compile_kernel(contracted, forms=False).cost) == "20 mul, 13 add"
    assert str(compile_kernel(through_points, forms=False).cost) == "12 mul, 10 add"


def test_counts_of_reflections() -> None:
    @kernel(line=PGA2.UNIT_LINE, p=PGA2.POINT)
    def reflected(line, p):  # type: ignore[no-untyped-def]
        return -sandwich(line, p)

    @kernel(a=VGA3.VECTOR, x=VGA3.VECTOR)
    def scaled(a, x):  # type: ignore[no-untyped-def]
        return a * x * a

    assert str(compile_kernel(reflected, forms=False).cost) == "5 mul, 4 add"
    assert compile_kernel(scaled, forms=False).cost.total <= 21


def test_differences_with_values_computed_from_them_are_not_circular() -> None:
    """All inputs and the first name may be shifted; the name is computed from differences, so an input is set to 0.

    The product ``(a - b) c`` has the name ``s``, which only ever occurs in the difference ``a - s``.
    """
    ring = PolynomialRing()
    a, b, c = (ring.variable(name) for name in "abc")
    s = ring.variable("s")
    system = System(ring, 3, (Definition(3, (a - b) * c),), ((a - s) * c,))
    shifted = shift(system)
    assert shifted is not None
    point = [Fraction(7), Fraction(3), Fraction(5)]
    assert outputs_at(shifted, point) == outputs_at(system, point)


def test_known_squares() -> None:
    m, n, d, p = (
        symbol(*each) for each in zip("mndp", (CGA3.MOTOR, CGA3.ROTOR, CGA3.DILATOR, CGA3.POINT), strict=True)
    )
    moved = sandwich(m, p)
    for null in (p, moved, -moved, reverse(p), sandwich(d * m, p), sandwich(d, sandwich(n, p))):
        assert square_of(null) == 0
    difference = sandwich_as_difference(moved)
    assert difference is not None and sandwich_of_difference(difference) == moved and square_of(difference) == 0
    unit = symbol("u", VGA3.UNIT_VECTOR)
    assert square_of(unit) == 1 == square_of(sandwich(symbol("r", VGA3.ROTOR), unit))
    free, sphere = symbol("f", CGA3.even), symbol("s", CGA3.VECTOR)
    for unknown in (sandwich(free, p), sandwich(m, sphere), p + p, moved * m, symbol("v", VGA3.VECTOR), m, p ^ moved):
        assert square_of(unknown) is None
    assert sandwich_of_difference(p + moved) is None is sandwich_of_difference(moved)


def test_a_coefficient_follows_from_the_square() -> None:
    ring = PolynomialRing()
    x, y, z = (ring.variable(name) for name in "xyz")
    point = {1: x, 2: y, 4: z, 8: ring.constant(1), 16: x * y + z * z * x}
    assert solvable(CGA3, point) == 16
    assert solve(CGA3, 16, point, 0) == (x * x + y * y + z * z) / 2
    assert solve(CGA3, 16, point, 3) == (x * x + y * y + z * z - 3) / 2
    assert solve(CGA3, 16, point | {8: ring.constant(-2)}, 0) == (x * x + y * y + z * z) / -4
    assert solvable(CGA3, point | {8: x}) is None, "the weight is not constant"
    assert solvable(CGA3, point | {3: y}) is None, "not a vector"
    assert solvable(CGA3, point | {16: x}) is None, "nothing would be saved"
    assert solvable(VGA3, {1: x, 2: y * y, 4: ring.constant(1)}) is None, "a square defined by the user"


def test_counts_of_moved_conformal_points() -> None:
    """A point of PGA3 is moved by 21 products and 18 sums; its square takes 4 products and 2 sums more."""

    @kernel(m=CGA3.MOTOR, x=CGA3.POINT)
    def moved(m, x):  # type: ignore[no-untyped-def]
        return sandwich(m, x)

    record = compile_kernel(moved, forms=False)
    assert (record.cost.mul, record.cost.add) == (25, 20)
    assert record.decision is not None and dict(record.decision.layouts[0].fixed) != {}


def test_sparse_gives_each_result_its_own_square() -> None:
    ring = PolynomialRing()
    x, a, b, c = (ring.variable(name) for name in "xabc")
    relation = a * a + b * b + c * c - 1
    assert simplify(x * b * b + x * c * c, IndexedRelations([relation])) == x - x * a * a
    assert simplify(x * a * a + x * c * c, IndexedRelations([relation])) == x - x * b * b
    assert simplify(a * b, IndexedRelations([relation])) == a * b


def test_sparse_remains_equal_on_the_relations() -> None:
    ring = PolynomialRing()
    s, p = ring.variable("s"), ring.variable("p")
    relation = s * s + p * p - 1
    random = Random(1)
    for _ in range(50):
        polynomial = sum(
            (random.randint(-3, 3) * _power(s, i) * _power(p, j) for i in range(4) for j in range(3)),
            ring.constant(0),
        )
        simple = simplify(polynomial, IndexedRelations([relation]))
        t = Fraction(random.randint(1, 9), random.randint(1, 9))
        at = {0: (1 - t * t) / (1 + t * t), 1: 2 * t / (1 + t * t)}
        assert value(simple, at) == value(polynomial, at)


def test_changes_reach_arguments_of_functions() -> None:
    """``x`` becomes ``3 y`` in ``sin(x sqrt(x + 1)) + x``, also inside the root."""
    ring = PolynomialRing()
    x, y = ring.variable("x"), ring.variable("y")

    def function(x: Polynomial) -> Polynomial:
        return ring.atom(Op.SIN, x * ring.atom(Op.SQRT, x + 1)) + x

    changed = System(ring, 2, (), (function(x),)).changed(lambda p, _: p.substitute({0: y * 3}))
    assert changed.outputs == (function(y * 3),)


def _power(x: Polynomial, n: int) -> Polynomial:
    result = x.ring.constant(1)
    for _ in range(n):
        result = result * x
    return result


def test_long_divisor_is_found_up_to_sign() -> None:
    """``x (a + b + c)`` and ``d - y (a + b + c)``: variables 0..5 are a, b, c, d, x, y."""
    sums = [{(0, 4): 1, (1, 4): 1, (2, 4): 1}, {(3,): 1, (0, 5): -1, (1, 5): -1, (2, 5): -1}]
    found = best_divisor(sums)
    assert found is not None
    divisor, places = found
    assert divisor == (((0,), 1), ((1,), 1), ((2,), 1))
    assert sorted(places) == [(0, (4,), 1), (1, (5,), -1)]
    assert best_divisor([{(0,): 1, (1,): 1, (2,): 1}]) is None


def operations(sums: list[Sum]) -> int:
    return sum(len(terms) - 1 + sum(max(len(cube) - 1, 0) for cube in terms) for terms in sums)


@all_cases("seed", range(40))
def test_a_divisor_saves_operations(seed: int) -> None:
    """Few literals have divisors that overlap in one sum: ``p + r`` twice in ``p + x p + r + x**2 p + x r``."""
    random = Random(seed)
    cubes = [cube for size in (1, 2, 3) for cube in combinations_with_replacement(range(4), size)]
    sums: list[Sum] = [{cube: random.choice((-1, 1)) for cube in random.sample(cubes, 9)} for _ in range(2)]
    if seed == 0:
        sums = [{(0,): 1, (0, 1): 1, (2,): 1, (0, 1, 1): 1, (1, 2): 1}]
    while found := best_divisor(sums):
        divisor, places = found
        before, name = operations(sums), 100 + len(sums)
        for index, cofactor, sign in places:
            for cube, factor in divisor:
                assert sums[index].pop(tuple(sorted(cofactor + cube))) == sign * factor
            sums[index][tuple(sorted((*cofactor, name)))] = sign
        sums.append(dict(divisor))
        assert operations(sums) < before


def plane_system() -> System:
    @kernel(a=PGA3.POINT, b=PGA3.POINT, c=PGA3.POINT)
    def plane(a, b, c):  # type: ignore[no-untyped-def]
        return a & b & c

    record = compile_kernel(plane, forms=False)
    assert record.trace is not None and record.decision is not None
    lowering = Lowering(plane, record.trace.expressions, reduction=Reduction.NONE)
    return lowering.system(record.decision.slots[0])


def test_offset_of_a_plane_is_divided_by_its_normal() -> None:
    system = plane_system()
    divided = resubstitute(system)
    assert divided is not None
    assert sum(len(p.terms) for p in divided.outputs) < sum(len(p.terms) for p in system.outputs)
    random = Random(5)
    for _ in range(10):
        inputs = [Fraction(random.randint(-9, 9), random.randint(1, 5)) for _ in range(9)]
        assert outputs_at(divided, inputs) == outputs_at(system, inputs)


def test_the_normal_is_written_in_differences_though_the_offset_is_not() -> None:
    system = plane_system()
    divided = resubstitute(system)
    assert divided is not None
    shifted = shift(divided)
    assert shifted is not None
    random = Random(6)
    for _ in range(10):
        inputs = [Fraction(random.randint(-9, 9), random.randint(1, 5)) for _ in range(9)]
        assert outputs_at(shifted, inputs) == outputs_at(system, inputs)


def test_differences_reach_into_functions() -> None:
    @kernel(p=CGA3.POINT, q=CGA3.POINT)
    def distance(p, q):  # type: ignore[no-untyped-def]
        return sqrt(-2 * (p * q).grade(0))

    cost = compile_kernel(distance, forms=False).cost
    assert (cost.mul, cost.add, cost.sqrt) == (3, 5, 1)


def test_divisors_and_their_roots_divide_once() -> None:
    @kernel(a=VGA3.VECTOR, b=VGA3.VECTOR)
    def both(a, b):  # type: ignore[no-untyped-def]
        return a / sqrt(norm_squared(a)) + b / norm_squared(a)

    record = compile_kernel(both, forms=False)
    assert record.cost.div == 1 and record.candidates[0].cost.div == 6
    assert divide_once(record.program) is None, "the program already has this form"
    at = {"a": [Fraction(2), Fraction(3), Fraction(6)], "b": [Fraction(k) for k in (49, 98, 0)]}
    assert interpret(record.program, at)["out"] == (Fraction(9, 7), Fraction(17, 7), Fraction(6, 7))


@pytest.mark.parametrize("size", [0.0, 1e-150, 1e150, np.inf])
def test_dividing_once_keeps_zeros_and_infinities(size: float) -> None:
    @kernel(a=VGA3.VECTOR, b=VGA3.VECTOR)
    def both(a, b):  # type: ignore[no-untyped-def]
        return b / sqrt(norm_squared(a)) + 3 * b / norm_squared(a)

    record = compile_kernel(both, forms=False)
    at = {"a": [np.array([size])] * 3, "b": [np.array([x]) for x in (1.0, -2.0, 1e-160)]}
    with np.errstate(all="ignore"):
        found, author = (
            interpret(each, at, np.float64)["out"] for each in (record.program, record.candidates[0].program)
        )
    assert record.cost.div == 1 and not np.isnan(author).any()
    np.testing.assert_allclose(found, author, rtol=1e-14)


def test_divisors_that_occur_once_are_kept() -> None:
    @kernel(a=VGA3.VECTOR, b=VGA3.VECTOR)
    def apart(a, b):  # type: ignore[no-untyped-def]
        return inner_product(a, b) / sqrt(norm_squared(a)) + 1 / norm_squared(b)

    assert compile_kernel(apart, forms=False).cost.div == 2


def test_a_cheap_form_that_loses_digits_is_not_taken() -> None:
    """Close to the identity ``1 - s**2`` loses all digits of the angle, though it is exact for unit rotors."""

    @kernel(r=VGA3.ROTOR)
    def sine_squared(r):  # type: ignore[no-untyped-def]
        return norm_squared(r.grade(2))

    record = compile_kernel(sine_squared, forms=False)
    cheapest = min(record.candidates, key=lambda candidate: candidate.cost.total)
    assert cheapest.cost.total < record.cost.total
    assert record.gate is not None and record.best is not None
    assert record.gate.accepts(record.best.program) and not record.gate.accepts(cheapest.program)
    assert run_in_double(record.program, [[1.0, 1e-9, 0.0, 0.0]]) == [1e-18]
    assert run_in_double(cheapest.program, [[1.0, 1e-9, 0.0, 0.0]]) == [0.0]


def test_many_times_a_small_motion_keeps_its_digits() -> None:
    """An angle from a rounded cosine suffices for small powers of small rotations, and is wrong for large powers."""

    @kernel(r=VGA3.ROTOR, t=SCALAR)
    def cosine_of_power(r, t):  # type: ignore[no-untyped-def]
        return cos(t * atan2(sqrt(norm_squared(r.grade(2))), absolute(r["1"])))

    record = compile_kernel(cosine_of_power, forms=False)
    cheapest = min(record.candidates, key=lambda candidate: candidate.cost.total)
    assert cheapest.cost.total < record.cost.total
    assert record.gate is not None and not record.gate.accepts(cheapest.program)
    turn = [math.cos(1e-7), 1e-7, 0.0, 0.0]
    assert run_in_double(record.program, [turn, [1e7]])[0] == pytest.approx(math.cos(1.0), abs=1e-14)
    assert run_in_double(cheapest.program, [turn, [1e7]])[0] != pytest.approx(math.cos(1.0), abs=1e-6)


def test_ulps_are_those_of_the_largest_result() -> None:
    assert ulps([1.0, 1e-20], [Fraction(1), Fraction(0)]) < 1
    assert ulps([1.0 + 2**-52], [Fraction(1)]) == 1
    assert ulps([0.0], [Fraction(0)]) == 0


def test_errors_of_results_that_cancel_are_relative_to_the_other_results() -> None:
    # The second derivative of one pixel: its taps have the sum 0, but not after rounding.
    exact = {"value": [[Fraction(1)]], "curvature": [[Fraction(1, 2**300)]]}
    assert results_ulps({"value": [[1.0]], "curvature": [[2.0**-54]]}, exact) < 1
    assert results_ulps({"value": [[1.0]], "curvature": [[-0.5]]}, exact) > 1e15
    # A small result that another one does not hide keeps its own unit.
    small = {"value": [[Fraction(1)]], "curvature": [[Fraction(1, 2**40)]]}
    assert results_ulps({"value": [[1.0]], "curvature": [[2.0**-40 + 2.0**-54]]}, small) > 1e10


def kernel_with_domain() -> Kernel:
    @kernel(v=VGA3.VECTOR)
    def gamma(v):  # type: ignore[no-untyped-def]
        return 1 / sqrt(1 - norm_squared(v))

    return gamma


def test_samples_are_in_a_bounded_domain() -> None:
    definition = kernel_with_domain()
    record = compile_kernel(definition, forms=False)
    assert record.trace is not None
    found = list(samples(definition, record.trace.expressions, Random(1), 5))
    assert len(found) == 5
    assert all(sum(x * x for x in inputs.values()) < 1 for inputs, _ in found)


@pytest.mark.parametrize("spread", sorted(set(SPREADS)))
def test_samples_satisfy_the_relations_at_every_spread(spread: Fraction) -> None:
    @kernel(m=PGA3.MOTOR, n=CGA3.UNIT_EVEN)
    def both(m, n):  # type: ignore[no-untyped-def]
        return m["1"] * n["1"]

    at = sample(both, Random(2), spread=spread)
    for parameter in both.parameters:
        element = parameter.layout.element([at[name] for name in parameter.components])
        assert element * ~element == 1


def test_a_slot_of_the_other_orientation_changes_sign() -> None:
    @kernel(m=PGA3.MOTOR, p=PGA3.POINT)
    def move(m, p):  # type: ignore[no-untyped-def]
        return sandwich(m, p)

    record = compile_kernel(move, forms=False)
    assert record.trace is not None
    lowering = Lowering(move, record.trace.expressions)
    plus, minus = lowering.system([Slot(0, 7)]).outputs, lowering.system([Slot(0, 7, -1)]).outputs
    assert plus[0] == -minus[0]
