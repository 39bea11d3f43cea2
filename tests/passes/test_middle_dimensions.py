"""Algebras of 9 to 16 dimensions with typed layouts: no step may cost 2**n, and every result is compared with
plain linear algebra.

- G(6,3): three conformal lines, quadrics along the axes (Zamora-Esquivel, *Adv. Appl. Clifford Algebras* 24, 2014).
- G(8,2): two conformal spaces, Darboux cyclides (Easter & Hitzer, *Adv. Appl. Clifford Algebras* 27, 2017).
- G(9,6): general quadrics (Breuils, Nozick, Sugimoto & Hitzer, *Adv. Appl. Clifford Algebras* 28:35, 2018).
- G(8,8): eight null pairs, where bivectors are the matrices of so(8, 8).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import reduce
from math import comb, cos, sin
from random import Random
from typing import Any

import numpy as np
import pytest
from selection import some_slow

from gacompiler import SCALAR, Algebra, Layout, array, commutator, inner_product, sandwich, scalar_product
from gacompiler.algebra.catalog import null_pairs, orthogonal
from gacompiler.algebra.coefficients import scale
from gacompiler.frontend.kernel import ArrayOf, Kernel, Parameter, Type
from gacompiler.ir.interpret import interpret
from gacompiler.passes.pipeline import compile_kernel

HALF = Fraction(1, 2)
AXES = range(3)

Coefficients = Mapping[str, Any]


@pytest.fixture(autouse=True)
def no_list_of_all_blades(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise an error if all ``2**n`` blades of a large algebra are listed."""
    blades = Algebra.blades

    def refusing(self: Algebra, *grades: int) -> tuple[int, ...]:
        assert grades or self.dimension <= 10, f"all {2**self.dimension} blades of {self.name} are listed"
        return blades(self, *grades)

    monkeypatch.setattr(Algebra, "blades", refusing)


def touched(algebra: Algebra) -> set[int]:
    """All blades that have occurred in products of this algebra."""
    found = {blade for pair in algebra._products._memory for blade in pair}
    found |= {blade for terms in algebra._products._memory.values() for blade in terms}
    for (_, left), row in algebra._rows.items():
        found |= {left, *row, *(blade for targets in row.values() for blade, _ in targets)}
    return found


def typed(algebra: Algebra) -> tuple[Layout, Layout]:
    """Vectors and bivectors of an algebra."""
    pairs = " ".join(algebra.spelling(blade)[1] for blade in algebra.blades(2))
    return algebra.layout("VECTOR", " ".join(algebra.vectors)), algebra.layout("BIVECTOR", pairs)


def define(function: Callable[..., Any], returns: Type | None = None, **types: Type) -> Kernel:
    parameters = tuple(Parameter(name, kind) for name, kind in types.items())
    return Kernel("middle", function, parameters, returns, "")


class Compiled:
    """A compiled kernel, run on integers and compared as arrays."""

    def __init__(self, definition: Kernel, highest_grade: int) -> None:
        self.record = compile_kernel(definition, forms=False)
        layouts = [p.layout for p in definition.parameters]
        algebra = next(layout.algebra for layout in layouts if layout.algebra.dimension)
        grades = [blade.bit_count() for blade in touched(algebra)]
        assert max(grades) <= highest_grade, f"blades of grade {max(grades)} in a product of {highest_grade} vectors"
        assert len(grades) <= sum(comb(algebra.dimension, k) for k in range(highest_grade + 1))
        assert self.record.decision is not None
        self.layout = self.record.decision.layouts[0]

    def __call__(self, *values: Any) -> np.ndarray:
        program = self.record.program
        flat = {a.name: [Fraction(x) for x in np.ravel(v)] for a, v in zip(program.arguments, values, strict=True)}
        return np.array([float(x) for (result,) in [interpret(program, flat).values()] for x in result])

    def expected(self, coefficient: Callable[[Sequence[int]], float]) -> np.ndarray:
        """The result's array from a function of the basis vectors in a blade."""
        blades = [[k for k in range(16) if slot.blade >> k & 1] for slot in self.layout.stored]
        return np.array([s.sign * coefficient(b) for s, b in zip(self.layout.stored, blades, strict=True)])


def whole(seed: int, *shape: int) -> np.ndarray:
    random = Random(seed)
    return np.array([random.randint(-9, 9) for _ in range(int(np.prod(shape)))]).reshape(shape)


def gram(algebra: Algebra) -> np.ndarray:
    return np.array(algebra.gram, dtype=float)


def minors(*rows: np.ndarray) -> Callable[[Sequence[int]], float]:
    """The coefficient of a blade in the outer product of vectors: a minor of the matrix of their coefficients."""
    return lambda blade: float(np.linalg.det(np.array(rows, dtype=float)[:, list(blade)]))


def antisymmetric(n: int, coefficients: np.ndarray) -> np.ndarray:
    """Bivector coefficients, in the order of `typed`, as a matrix."""
    matrix = np.zeros((n, n))
    columns, rows = np.tril_indices(n, -1)
    matrix[rows, columns], matrix[columns, rows] = coefficients, -coefficients
    return matrix


# Arbitrary metrics.


def with_null_pairs(name: str, pairs: int) -> Algebra:
    """Euclidean e1 e2 e3, then null o1 ..., then null n1 ..., with ``o_k . n_k = -1``."""
    n = 3 + 2 * pairs
    matrix = [[int(i == j and i < 3) for j in range(n)] for i in range(n)]
    for k in range(3, 3 + pairs):
        matrix[k][k + pairs] = matrix[k + pairs][k] = -1
    names = [f"{letter}{k + 1}" for letter, count in (("e", 3), ("o", pairs), ("n", pairs)) for k in range(count)]
    return Algebra(name, names, matrix)


def double_conformal() -> Algebra:
    """Two copies of the conformal algebra of space, ``eo . en = -1``."""
    matrix = [[int(i == j and i % 5 < 3) for j in range(10)] for i in range(10)]
    for k in (3, 8):
        matrix[k][k + 1] = matrix[k + 1][k] = -1
    return Algebra("G(8,2)", [*FIRST, *SECOND], matrix)


FIRST, SECOND = ("e1", "e2", "e3", "eo", "en"), ("f1", "f2", "f3", "fo", "fn")

METRICS: dict[str, Callable[[], Algebra]] = {
    "G(6,3) null": lambda: with_null_pairs("G(6,3)", 3),
    "G(6,3)": lambda: orthogonal(6, 3),
    "G(8,2) null": double_conformal,
    "G(8,2)": lambda: orthogonal(8, 2),
    "G(9,6) null": lambda: with_null_pairs("G(9,6)", 6),
    "G(9,6)": lambda: orthogonal(9, 6),
    "G(8,8) null": lambda: null_pairs(8),
}


SOME = some_slow(METRICS, *(METRICS.keys() - {"G(6,3) null", "G(8,2)", "G(8,8) null"}))
"""Quick ones: an oblique metric, an orthogonal one, and the largest."""


def test_creating_an_algebra_lists_no_blades() -> None:
    for algebra in (
        null_pairs(8),
        orthogonal(9, 6),
        with_null_pairs("G(9,6)", 6),
        Algebra("G(0,0,16)", list("abcdefghijklmnop"), [0] * 16),
    ):
        assert hash(algebra) and algebra == algebra and not touched(algebra)
        typed(algebra)
        assert not touched(algebra)
        assert len(algebra._names._spelled) <= 2 + comb(algebra.dimension, 1) + comb(algebra.dimension, 2)


@pytest.mark.parametrize("metric", SOME)
def test_outer_product_of_vectors(metric: str) -> None:
    algebra = METRICS[metric]()
    vector, _ = typed(algebra)
    a, b = whole(1, 2, algebra.dimension)
    found = Compiled(define(lambda a, b: a ^ b, a=vector, b=vector), 2)
    assert found.layout.size == comb(algebra.dimension, 2)
    assert np.allclose(found(a, b), found.expected(minors(a, b)))


@pytest.mark.parametrize("metric", SOME)
def test_bivectors_move_vectors(metric: str) -> None:
    """``[B, v] / 2`` of ``B = sum B_ij e_i ^ e_j`` is the matrix ``B G`` times v."""
    algebra = METRICS[metric]()
    vector, bivector = typed(algebra)
    b, v = whole(2, bivector.size), whole(3, vector.size)
    found = Compiled(define(commutator, returns=vector, b=bivector, v=vector), 3)
    assert np.allclose(found(b, v), antisymmetric(algebra.dimension, b) @ gram(algebra) @ v)


@pytest.mark.parametrize("metric", some_slow(["G(6,3) null", "G(8,2) null"], "G(8,2) null"))
def test_bivectors_commute_as_matrices(metric: str) -> None:
    algebra = METRICS[metric]()
    _, bivector = typed(algebra)
    b, c = whole(4, 2, bivector.size)
    found = Compiled(define(commutator, b=bivector, c=bivector), 4)
    left, right = (antisymmetric(algebra.dimension, x) for x in (b, c))
    bracket = left @ gram(algebra) @ right - right @ gram(algebra) @ left
    assert np.allclose(found(b, c), found.expected(lambda blade: bracket[blade[0], blade[1]]))


def reflected(metric: np.ndarray, a: np.ndarray, x: np.ndarray) -> np.ndarray:
    """``-a x a``."""
    return np.array((a @ metric @ a) * x - 2 * (a @ metric @ x) * a)


@pytest.mark.parametrize("metric", ["G(6,3)", "G(9,6) null"])
@pytest.mark.slow
def test_two_reflections(metric: str) -> None:
    algebra = METRICS[metric]()
    vector, _ = typed(algebra)
    a, b, x = whole(5, 3, vector.size)
    g = gram(algebra)
    found = Compiled(define(lambda a, b, x: sandwich(a, sandwich(b, x)), vector, a=vector, b=vector, x=vector), 5)
    assert np.allclose(found(a, b, x), reflected(g, a, reflected(g, b, x)))


@pytest.mark.slow
def test_a_rotor_from_two_vectors() -> None:
    algebra = METRICS["G(6,3) null"]()
    vector, _ = typed(algebra)
    a, b, x = whole(6, 3, vector.size)
    g = gram(algebra)
    found = Compiled(define(lambda a, b, x: sandwich(a * b, x), vector, a=vector, b=vector, x=vector), 5)
    assert np.allclose(found(a, b, x), reflected(g, a, reflected(g, b, x)))


# Quadrics along the axes, G(6,3).


def half_square(name: str) -> Callable[[Coefficients], Any]:
    return lambda coefficient: scale(coefficient[name] * coefficient[name], HALF)


def axis_point(algebra: Algebra) -> Layout:
    squares = {f"n{k + 1}": half_square(f"e{k + 1}") for k in AXES}
    return algebra.layout("POINT", "e1 e2 e3", fixed={f"o{k + 1}": 1 for k in AXES}, implied=squares)


def axis_coefficients(x: np.ndarray) -> np.ndarray:
    return np.concatenate([x, np.ones(3), x * x / 2])


def move_along_axes(t: Any, x: Any) -> Any:
    """Move by a translator of each conformal line, ``1 - t e n / 2``."""
    vector = dict(zip(x.algebra.vectors, x.algebra.basis(), strict=True))
    for k in AXES:
        x = sandwich(1 - t[k] * (vector[f"e{k + 1}"] * vector[f"n{k + 1}"]) * HALF, x)
    return x


def test_point_on_a_quadric_along_the_axes() -> None:
    algebra = with_null_pairs("G(6,3)", 3)
    vector, _ = typed(algebra)
    p, q = whole(1, 3), whole(2, 9)
    found = Compiled(define(inner_product, p=axis_point(algebra), q=vector), 2)
    assert np.allclose(found(p, q), q[:3] @ p - q[3:6] @ (p * p) / 2 - q[6:].sum())


@pytest.mark.parametrize("n", some_slow([2, 3, 4], 3, 4))
def test_outer_products_of_points_on_axes(n: int) -> None:
    algebra = with_null_pairs("G(6,3)", 3)
    point = axis_point(algebra)
    found = Compiled(define(lambda points: reduce(lambda a, b: a ^ b, points), points=array(point, n)), n)
    points = whole(3, n, 3)
    assert np.allclose(found(points), found.expected(minors(*map(axis_coefficients, points))))


@pytest.mark.slow
def test_translators_of_axes_move_points() -> None:
    algebra = with_null_pairs("G(6,3)", 3)
    t, p, point = whole(4, 3), whole(5, 3), axis_point(algebra)
    move_point = Compiled(define(move_along_axes, point, t=array(SCALAR, 3), x=point), 7)
    assert np.allclose(move_point(t, p), p + t)


@pytest.mark.slow
def test_translators_of_axes_move_quadrics() -> None:
    algebra = with_null_pairs("G(6,3)", 3)
    vector, _ = typed(algebra)
    point = axis_point(algebra)
    t, p, q = whole(4, 3), whole(5, 3), whole(6, 9)
    move_quadric = Compiled(define(move_along_axes, vector, t=array(SCALAR, 3), x=vector), 7)
    test = Compiled(define(inner_product, p=point, q=vector), 7)
    assert np.allclose(test(p + t, move_quadric(t, q)), test(p, q))


# Darboux cyclides, G(8,2).


def conformal(x: Sequence[Any]) -> list[Any]:
    """Coefficients of a conformal point, ``x + eo + x.x / 2 en``."""
    return [*x, 1, scale(sum(value * value for value in x), HALF)]


def cyclide(algebra: Algebra) -> Layout:
    return algebra.layout("CYCLIDE", " ".join(f"{a}^{b}" for a in FIRST for b in SECOND))


def double_point(algebra: Algebra) -> Layout:
    """The outer product of the two conformal points at x, which stores x."""

    def coefficient(i: int, j: int) -> Callable[[Coefficients], Any]:
        def function(stored: Coefficients) -> Any:
            x = conformal([stored[f"{FIRST[k]}^fo"] for k in AXES])
            return x[i] * x[j]

        return function

    stored = [f"{name}^fo" for name in FIRST[:3]]
    implied = {
        f"{a}^{b}": coefficient(i, j)
        for i, a in enumerate(FIRST)
        for j, b in enumerate(SECOND)
        if f"{a}^{b}" not in (*stored, "eo^fo")
    }
    return algebra.layout("POINT", " ".join(stored), fixed={"eo^fo": 1}, implied=implied)


def embed(algebra: Algebra) -> Callable[[Any], Any]:
    one, other = algebra.basis()[:5], algebra.basis()[5:]

    def vector(x: Any, basis: Sequence[Any]) -> Any:
        square = (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) * HALF
        return x[0] * basis[0] + x[1] * basis[1] + x[2] * basis[2] + basis[3] + square * basis[4]

    return lambda x: vector(x, one) ^ vector(x, other)


def move_twice(t: Any, x: Any) -> Any:
    """Move by the product of the two conformal translators ``1 - t en / 2``."""
    basis = x.algebra.basis()
    for first in (0, 5):
        direction = t[0] * basis[first] + t[1] * basis[first + 1] + t[2] * basis[first + 2]
        x = sandwich(1 - direction * basis[first + 4] * HALF, x)
    return x


def torus(large: float, small: float) -> np.ndarray:
    """The cyclide whose product with a point is ``4 R**2 (x**2 + y**2) - (x**2 + y**2 + z**2 + R**2 - r**2)**2``."""
    c, matrix = large**2 - small**2, np.zeros((5, 5))
    matrix[3, 3], matrix[3, 4], matrix[4, 3], matrix[4, 4] = 4, 2 * c, 2 * c, c * c
    matrix[0, 0] = matrix[1, 1] = -4 * large**2
    return matrix


def test_a_double_point_is_its_coordinates() -> None:
    """The compiler proves the implied coefficients of the layout, so no operations remain."""
    algebra = double_conformal()
    made = embed(algebra)
    record = compile_kernel(define(made, double_point(algebra), x=array(SCALAR, 3)), forms=False)
    assert record.cost.total == 0
    whole_point = compile_kernel(define(made, cyclide(algebra), x=array(SCALAR, 3)), forms=False).program
    x = whole(1, 3)
    (found,) = interpret(whole_point, {"x": [Fraction(int(value)) for value in x]}).values()
    coefficients = np.array(conformal([int(value) for value in x]), dtype=float)
    assert np.allclose([float(value) for value in found], np.outer(coefficients, coefficients).ravel())


def test_point_on_a_torus() -> None:
    algebra = double_conformal()
    found = Compiled(define(scalar_product, p=double_point(algebra), s=cyclide(algebra)), 4)
    assert found.record.cost.mul <= 30
    for u, v in ((0.3, 1.1), (2.0, -0.4), (4.5, 2.8)):
        on = [(5 + 2 * cos(u)) * cos(v), (5 + 2 * cos(u)) * sin(v), 2 * sin(u)]
        assert abs(found(on, torus(5, 2))[0]) < 1e-10
    x, y, z = whole(2, 3)
    expected = 4 * 25 * (x * x + y * y) - (x * x + y * y + z * z + 21) ** 2
    assert np.allclose(found([x, y, z], torus(5, 2)), expected)


@pytest.mark.slow
def test_translators_move_points() -> None:
    algebra = double_conformal()
    t, p, point = whole(3, 3), whole(4, 3), double_point(algebra)
    assert np.allclose(Compiled(define(move_twice, point, t=array(SCALAR, 3), x=point), 6)(t, p), p + t)


@pytest.mark.slow
def test_translators_move_cyclides() -> None:
    algebra = double_conformal()
    t, s, surface = whole(3, 3), whole(5, 5, 5), cyclide(algebra)
    matrix = np.eye(5)
    matrix[:3, 3], matrix[4, :3], matrix[4, 3] = t, t, t @ t / 2
    moved = Compiled(define(move_twice, surface, t=array(SCALAR, 3), x=surface), 6)(t, s)
    assert np.allclose(moved, (matrix @ s @ matrix.T).ravel())


@pytest.mark.slow
def test_outer_product_of_double_points() -> None:
    algebra = double_conformal()
    point = double_point(algebra)
    found = Compiled(define(lambda a, b: a ^ b, a=point, b=point), 4)
    a, b = whole(6, 2, 3)
    p, q = (np.array(conformal([int(value) for value in x]), dtype=float) for x in (a, b))
    zero = np.zeros(5)
    rows = [np.concatenate(pair) for pair in ((p, zero), (zero, p), (q, zero), (zero, q))]
    assert np.allclose(found(a, b), found.expected(minors(*rows)))


# General quadrics, G(9,6).

MIXED = ((4, 0, 1), (5, 0, 2), (6, 1, 2))
"""Number of the null pair, and the two axes whose product it carries."""


def quadric_point(algebra: Algebra) -> Layout:
    def mixed(i: int, j: int) -> Callable[[Coefficients], Any]:
        return lambda coefficient: coefficient[f"e{i + 1}"] * coefficient[f"e{j + 1}"]

    implied = {f"n{k + 1}": half_square(f"e{k + 1}") for k in AXES} | {f"n{k}": mixed(i, j) for k, i, j in MIXED}
    return algebra.layout("POINT", "e1 e2 e3", fixed={"o1": 1, "o2": 1, "o3": 1}, implied=implied)


def quadric_coefficients(x: np.ndarray) -> np.ndarray:
    mixed = [x[i] * x[j] for _, i, j in MIXED]
    return np.concatenate([x, np.ones(3), np.zeros(3), x * x / 2, mixed])


def on_quadric(algebra: Algebra) -> Callable[[Any, Any], Any]:
    """``p . q`` with the vector of a x x + b y y + c z z + d x y + e x z + f y z + g x + h y + i z + j = 0."""
    vector = dict(zip(algebra.vectors, algebra.basis(), strict=True))

    def test(p: Any, c: Any) -> Any:
        parts = [-2 * c[k] * vector[f"o{k + 1}"] for k in AXES]
        parts += [-c[3 + k] * vector[f"o{4 + k}"] for k in AXES]
        parts += [c[6 + k] * vector[f"e{k + 1}"] for k in AXES]
        parts += [-c[9] * Fraction(1, 3) * vector[f"n{k + 1}"] for k in AXES]
        return inner_product(p, reduce(lambda a, b: a + b, parts))

    return test


def test_point_on_a_general_quadric() -> None:
    algebra = with_null_pairs("G(9,6)", 6)
    found = Compiled(define(on_quadric(algebra), p=quadric_point(algebra), c=array(SCALAR, 10)), 2)
    (x, y, z), c = whole(1, 3), whole(2, 10)
    monomials = np.array([x * x, y * y, z * z, x * y, x * z, y * z, x, y, z, 1])
    assert np.allclose(found([x, y, z], c), monomials @ c)
    assert found.record.cost.mul <= 20


def test_distance_of_quadric_points() -> None:
    algebra = with_null_pairs("G(9,6)", 6)
    point = quadric_point(algebra)
    found = Compiled(define(lambda a, b: -2 * inner_product(a, b), a=point, b=point), 2)
    a, b = whole(3, 2, 3)
    assert np.allclose(found(a, b), (a - b) @ (a - b))
    assert (found.record.cost.mul, found.record.cost.add) <= (3, 5)


@pytest.mark.parametrize("n", some_slow([2, 3], 3))
def test_outer_products_of_quadric_points(n: int) -> None:
    algebra = with_null_pairs("G(9,6)", 6)
    point = quadric_point(algebra)
    found = Compiled(define(lambda points: reduce(lambda a, b: a ^ b, points), points=ArrayOf(point, (n,))), n)
    points = whole(4, n, 3)
    assert np.allclose(found(points), found.expected(minors(*map(quadric_coefficients, points))))
