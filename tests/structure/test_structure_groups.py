"""Pin and Spin, finite groups of versors, and the dictionaries of Gibbs and of Grassmann and Cayley."""

from __future__ import annotations

import random
from collections import Counter
from fractions import Fraction
from itertools import combinations, pairwise, permutations, product
from math import factorial

import numpy as np
import pytest
import scipy.linalg
import scipy.stats
import sympy
from scipy.spatial.transform import Rotation

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, PGA3, VGA3, orthogonal
from gacompiler.algebra.multivector import Multivector
from gacompiler.errors import AlgebraError
from gacompiler.structure.finite_groups import cube_group, generated_group, polyhedral_group, reflection_group
from gacompiler.structure.gibbs import GIBBS, table
from gacompiler.structure.grassmann_cayley import (
    GRASSMANN_CAYLEY,
    bracket,
    extensor,
    exterior_algebra,
    shuffle_product,
    straighten,
    van_der_waerden,
)
from gacompiler.structure.groups import membership, spinor_norm, versor_of_isometry
from gacompiler.structure.quadratic import QuadraticNumber
from tests.support.all_cases import all_cases

RNG = np.random.default_rng(20)


def vector(algebra: Algebra, values: object) -> Multivector:
    return Multivector(algebra, {1 << k: v for k, v in enumerate(values)})  # type: ignore[arg-type]


def product_of(vectors: list[Multivector]) -> Multivector:
    result = vectors[0]
    for v in vectors[1:]:
        result = result * v
    return result


@all_cases("three", [(3, 0, 0), (1, 3, 0), (2, 2, 0), (4, 1, 0), (3, 0, 1), (0, 6, 0)])
def test_products_of_vectors_are_members(three: tuple[int, int, int]) -> None:
    """Exactly, with the product of reflections as action and the product of squares as norm."""
    algebra = orthogonal(*three)
    rng = random.Random(str(three))
    squares = [algebra.gram[i][i] for i in range(algebra.dimension)]
    for count in (1, 2, 3, 4):
        rows = []
        while len(rows) < count:
            row = [rng.randint(-4, 4) for _ in squares]
            if sum(s * x * x for s, x in zip(squares, row, strict=True)):
                rows.append(row)
        found = membership(product_of([vector(algebra, row) for row in rows]))
        expected = np.eye(len(squares), dtype=int).astype(object)
        norm = Fraction(1)
        for row in rows:
            square = sum(s * x * x for s, x in zip(squares, row, strict=True))
            norm *= square
            mirror = np.array(
                [[Fraction(-2 * x * s * y, square) for s, y in zip(squares, row, strict=True)] for x in row]
            )
            expected = expected @ (np.eye(len(squares), dtype=int).astype(object) + mirror)
        assert found.is_lipschitz and found.spinor_norm == norm
        assert np.array_equal(np.array(found.action, dtype=object), expected)
        assert found.is_pin == (abs(norm) == 1) and found.is_spin == (abs(norm) == 1 and count % 2 == 0)


def test_elements_that_are_not_members() -> None:
    e = orthogonal(6).basis()
    pseudoscalar = orthogonal(6).pseudoscalar
    trap = 1 + pseudoscalar  # x ~x is a number, but vectors are not mapped to vectors
    assert trap * ~trap == 2 and not membership(trap).is_lipschitz
    assert not membership(e[0] + e[1] * e[2]).is_lipschitz
    assert not membership(1 + e[0]).is_lipschitz
    assert not membership(1 + e[0] * e[1] + e[2] * e[3]).is_lipschitz
    assert not membership(e[0] * 0).is_lipschitz
    null = orthogonal(1, 1).basis()
    assert not membership(null[0] + null[1]).is_lipschitz
    with pytest.raises(AlgebraError, match="spinor norm"):
        spinor_norm(trap)


def test_the_four_components_of_pin_of_spacetime() -> None:
    t, x, y, _ = orthogonal(1, 3).basis()
    kinds = {name: membership(v) for name, v in {"t": t, "x": x, "tx": t * x, "xy": x * y}.items()}
    assert [m.spinor_norm for m in kinds.values()] == [1, -1, -1, 1]
    assert [m.is_spin for m in kinds.values()] == [False, False, True, True]
    assert [m.is_spin_plus for m in kinds.values()] == [False, False, False, True]


def test_membership_of_floats_has_a_tolerance() -> None:
    e1, e2, _ = VGA3.basis()
    rotor = 0.6 + 0.8 * (e1 * e2)
    assert membership(rotor).is_spin_plus
    assert membership(rotor * (1 + 1e-12)).is_spin_plus
    assert not membership(rotor * 1.001).is_pin and membership(rotor * 1.001).is_lipschitz
    four = orthogonal(4)
    bent = membership(four.scalar(1.0) + 1e-4 * four.pseudoscalar)
    assert not bent.is_lipschitz
    assert membership(four.scalar(1.0) + 1e-4 * four.pseudoscalar, tolerance=1e-3).is_lipschitz


@pytest.mark.parametrize("three", [(3, 0, 0), (5, 0, 0), (1, 3, 0), (2, 2, 0)], ids=str)
def test_versor_of_isometry(three: tuple[int, int, int]) -> None:
    """Floats against exponentials of scipy, with both determinants; rationals by Cayley's transform, exactly."""
    algebra = orthogonal(*three)
    n = algebra.dimension
    metric = np.diag([algebra.gram[i][i] for i in range(n)]).astype(float)
    for case in range(6):
        skew = RNG.normal(size=(n, n))
        matrix = scipy.linalg.expm(metric @ (skew - skew.T) * 0.5)
        matrix[:, 0] *= (-1) ** case
        versor = versor_of_isometry(algebra, matrix.tolist())
        found = membership(versor)
        assert found.is_pin and np.abs(np.array(found.action, float) - matrix).max() < 1e-12 * np.abs(matrix).max() ** 2
        assert found.is_spin == (case % 2 == 0)
    whole = RNG.integers(-3, 4, (n, n))
    skew = metric.astype(int) @ (whole - whole.T)
    one = np.eye(n, dtype=int)
    exact = (sympy.Matrix((one + skew).tolist()) * sympy.Matrix((one - skew).tolist()).inv()).tolist()
    rational = [[Fraction(int(x.p), int(x.q)) for x in row] for row in exact]
    versor = versor_of_isometry(algebra, rational)
    assert [list(row) for row in membership(versor).action or ()] == rational


def test_versor_of_isometry_where_the_difference_is_null() -> None:
    """A null rotation and minus the identity, exactly, in a null basis too."""
    algebra = CGA3
    e1, _, _, _, einf = algebra.basis()
    translator = 1 - e1 * einf * Fraction(1, 2)
    for versor in (translator, algebra.pseudoscalar):
        action = membership(versor).action
        assert action is not None
        assert membership(versor_of_isometry(algebra, action)).action == action
    with pytest.raises(AlgebraError, match="inner product"):
        versor_of_isometry(VGA3, [[1, 0, 0], [0, 2, 0], [0, 0, 1]])
    with pytest.raises(AlgebraError, match="degenerate"):
        versor_of_isometry(PGA3, np.eye(4).tolist())


def test_versor_of_random_rotation() -> None:
    for n in (2, 3, 6):
        matrix = scipy.stats.special_ortho_group.rvs(n, random_state=1)
        found = membership(versor_of_isometry(orthogonal(n), matrix))
        assert found.is_spin_plus and np.abs(np.array(found.action, float) - matrix).max() < 1e-14 * n


def order(x: Multivector) -> int:
    power, k = x, 1
    while power != 1:
        power, k = power * x, k + 1
    return k


@pytest.mark.parametrize(
    ("name", "size", "orders"),
    [
        ("tetrahedral", 24, {1: 1, 2: 1, 3: 8, 4: 6, 6: 8}),
        ("octahedral", 48, {1: 1, 2: 1, 3: 8, 4: 18, 6: 8, 8: 12}),
        ("icosahedral", 120, {1: 1, 2: 1, 3: 20, 4: 30, 5: 24, 6: 20, 10: 24}),
    ],
)
def test_binary_polyhedral_groups(name: str, size: int, orders: dict[int, int]) -> None:
    """Sizes and orders of elements as in the tables of these groups; minus each element belongs too."""
    group = polyhedral_group(name)
    assert len(group) == size and Counter(map(order, group)) == orders
    keys = {frozenset(x.terms.items()) for x in group}
    assert {frozenset((-x).terms.items()) for x in group} == keys
    assert {frozenset((~x).terms.items()) for x in group} == keys
    assert all(x * ~x == 1 for x in group)


def signed_permutations(n: int) -> set[tuple[tuple[int, ...], ...]]:
    found = set()
    for order_, signs in product(permutations(range(n)), product((1, -1), repeat=n)):
        matrix = np.zeros((n, n), dtype=int)
        matrix[list(order_), range(n)] = signs
        if round(np.linalg.det(matrix)) == 1:
            found.add(tuple(map(tuple, matrix.tolist())))
    return found


def test_spin_group_of_the_cube() -> None:
    """48 elements, which are twice the 24 signed permutations of determinant 1; 384 in four dimensions."""
    group = cube_group(3)
    assert len(group) == 48
    actions = Counter(tuple(tuple(int(float(x)) for x in row) for row in membership(x).action or ()) for x in group)
    assert set(actions) == signed_permutations(3) and set(actions.values()) == {2}
    assert len(cube_group(4)) == 2**4 * factorial(4)


def test_reflection_groups() -> None:
    """Twice the orders of A3 (24), B3 (48) and H3 (120), roots as in Humphreys 1990."""
    e1, e2, e3 = VGA3.basis()
    half = Fraction(1, 2)
    root = QuadraticNumber.root(2) * half
    golden = (1 + QuadraticNumber.root(5)) * half
    unit = [(a - b) * root for a, b in ((e1, e2), (e2, e3))]
    assert len(reflection_group([*unit, (e2 + e3) * root])) == 2 * 24
    assert len(reflection_group([*unit, e3])) == 2 * 48
    assert len(reflection_group([e1, (e1 * golden + e2 + e3 * (golden - 1)) * -half, e2])) == 2 * 120
    with pytest.raises(AlgebraError, match="unit"):
        reflection_group([e1 + e2])
    with pytest.raises(AlgebraError, match="floats"):
        generated_group([e1 * 1.0])
    with pytest.raises(AlgebraError, match="finite"):
        generated_group([1 + e1 * e2], largest=50)


def test_quadratic_numbers() -> None:
    rng = random.Random(5)

    def draw() -> QuadraticNumber:
        return QuadraticNumber(Fraction(rng.randint(-9, 9), 7), Fraction(rng.randint(-9, 9), 5), 2)

    for _ in range(50):
        x, y = draw(), draw()
        for exact, real in ((x + y, float(x) + float(y)), (x * y, float(x) * float(y)), (x - 2, float(x) - 2)):
            assert abs(float(exact) - real) < 1e-12
        assert (x < y) == (float(x) < float(y)) and float(abs(x)) == pytest.approx(abs(float(x)))
        if not y.is_zero:
            assert x / y * y == x
    with pytest.raises(AlgebraError, match="sqrt"):
        QuadraticNumber.root(2) + QuadraticNumber.root(3)
    assert str(QuadraticNumber.root(2) + 1) == "1 + 1*sqrt(2)"


def triples(count: int) -> list[list[int]]:
    return RNG.integers(-9, 10, (count, 3)).tolist()


def test_gibbs_against_numpy() -> None:
    for _ in range(20):
        a, b, c, d = triples(4)
        n = [*a[:2], abs(a[2]) + 1]
        u, v, w, x, m = map(np.array, (a, b, c, d, n))
        assert GIBBS["dot product"](a, b) == u @ v
        assert GIBBS["cross product"](a, b) == tuple(np.cross(u, v))
        assert GIBBS["triple product"](a, b, c) == round(np.linalg.det([u, v, w]))
        assert GIBBS["double cross product"](a, b, c) == tuple(np.cross(u, np.cross(v, w)))
        assert GIBBS["product of areas"](a, b, c, d) == np.cross(u, v) @ np.cross(w, x)
        assert GIBBS["line of two planes"](a, b, c, d) == tuple(np.cross(np.cross(u, v), np.cross(w, x)))
        along = [Fraction(int(v @ m), int(m @ m)) * k for k in n]
        assert GIBBS["projection"](b, n) == tuple(along)
        assert GIBBS["rejection"](b, n) == tuple(p - q for p, q in zip(b, along, strict=True))
        assert GIBBS["reflection"](b, n) == tuple(p - 2 * q for p, q in zip(b, along, strict=True))
        turned = Rotation.from_rotvec(0.7 * m / np.linalg.norm(m)).apply(v)
        assert np.abs(np.array(GIBBS["rotation"](b, n, 0.7)) - turned).max() < 1e-13
        assert GIBBS["area of a triangle"](a, b, c) == pytest.approx(np.linalg.norm(np.cross(v - u, w - u)) / 2)
        if np.linalg.det([u, v, w]):
            frame = np.array(GIBBS["reciprocal frame"](a, b, c), dtype=object)
            assert np.array_equal(frame @ np.array([a, b, c], dtype=object).T, np.eye(3))
        q, r = [2, *a], [3, *b]
        expected = (6 - u @ v, *(2 * v + 3 * u + np.cross(u, v)))
        assert GIBBS["quaternion product"](q, r) == expected
    assert len(table(GIBBS)) == len(GIBBS) and all(len(row) == 3 for row in table(GIBBS))
    with pytest.raises(AlgebraError, match="3"):
        GIBBS["cross product"]([1, 2], [3, 4])


def integers(count: int, n: int, seed: int) -> list[list[int]]:
    return np.random.default_rng(seed).integers(-6, 7, (count, n)).tolist()


@all_cases("n", [2, 3, 4, 5])
def test_brackets_and_meets(n: int) -> None:
    points = integers(2 * n, n, n)
    assert bracket(*points[:n]) == round(np.linalg.det(points[:n]))
    for j in range(1, n + 1):
        for k in range(max(1, n - j), n + 1):
            a, b = points[:j], points[n : n + k]
            assert shuffle_product(a, b) == GRASSMANN_CAYLEY["meet"](extensor(*a), extensor(*b))
    x, *frame = points[: n + 1]
    if bracket(*frame):
        weights = GRASSMANN_CAYLEY["coordinates"](x, *frame)
        assert [sum(w * p[k] for w, p in zip(weights, frame, strict=True)) for k in range(n)] == x
    assert shuffle_product(points[:1], points[1:2]) == 0 or n == 2


def test_meet_of_lines_and_planes() -> None:
    """Two lines of the projective plane meet in the point by numpy; two planes of space in a line on both."""
    a, b, c, d = integers(4, 3, 9)
    found = shuffle_product([a, b], [c, d])
    expected = np.cross(np.cross(a, b), np.cross(c, d))
    assert np.linalg.matrix_rank([expected, [found[1], found[2], found[4]]]) == 1
    p = integers(6, 4, 2)
    one, two = extensor(*p[:3]), extensor(*p[3:])
    line = GRASSMANN_CAYLEY["intersection of spaces"](one, two)
    assert line.grades == (2,) and GRASSMANN_CAYLEY["union of spaces"](one, two).grades == (4,)
    meet = GRASSMANN_CAYLEY["meet"](one, two)
    ratios = {Fraction(meet[k], 1) / line[k] for k in line.blades}
    assert len(ratios) == 1 and meet.blades == line.blades
    star = GRASSMANN_CAYLEY["Hodge star"]
    assert GRASSMANN_CAYLEY["inverse star"](star(meet)) == meet and exterior_algebra(4).is_degenerate


def test_cross_ratio_is_invariant() -> None:
    points = integers(4, 2, 11)
    matrix = np.array([[3, 1], [-2, 5]])
    moved = (np.array(points) @ matrix.T).tolist()
    assert GRASSMANN_CAYLEY["cross ratio"](*moved) == GRASSMANN_CAYLEY["cross ratio"](*points)


LETTERS = "abcdefgh"


def value(polynomial: dict, points: dict[str, list[int]]) -> int:
    total = 0
    for monomial, factor in polynomial.items():
        for row in monomial:
            factor *= bracket(*(points[x] for x in row))
        total += factor
    return total


@pytest.mark.parametrize("n", [2, 3, 4])
def test_straightening_keeps_the_value_and_gives_standard_tableaux(n: int) -> None:
    rng = random.Random(n)
    points = dict(zip(LETTERS, integers(8, n, 30 + n), strict=True))
    for _ in range(10):
        monomial = tuple(tuple(rng.sample(LETTERS, n)) for _ in range(3))
        normal = straighten({monomial: 3})
        assert value(normal, points) == value({monomial: 3}, points)
        for rows in normal:
            assert all(list(row) == sorted(set(row)) for row in rows)
            assert all(x <= y for up, low in pairwise(rows) for x, y in zip(up, low, strict=True))


def test_relations_of_brackets_straighten_to_zero() -> None:
    """The three-term relation; and van der Waerden's syzygies, for any letters."""
    ab_cd = {(("a", "b"), ("c", "d")): 1, (("a", "c"), ("b", "d")): -1, (("a", "d"), ("b", "c")): 1}
    assert straighten(ab_cd) == {}
    for column in range(3):
        syzygy: dict = {}
        for sign, one, two in van_der_waerden(("a", "d", "e"), ("b", "c", "f"), column):
            syzygy[one, two] = syzygy.get((one, two), 0) + sign
        assert len(syzygy) > 1 and straighten(syzygy) == {}
    assert straighten({(("a", "a"),): 1}) == {}
    with pytest.raises(AlgebraError, match="one length"):
        straighten({(("a", "b"), ("c",)): 1})


def test_normal_forms_are_a_basis() -> None:
    """Standard tableaux of all letters once: the hook length formula counts them, and all products reduce to these."""
    found = set()
    letters = "abcdef"
    for one in combinations(letters, 3):
        rest = tuple(x for x in letters if x not in one)
        found |= set(straighten({(one, rest): 1}))
    assert len(found) == 5  # 6! / (4 3 2 3 2 1)
