"""GL(n) and gl(n) in G(n, n), the affine plane and the horosphere: against matrices, scipy and plain vectors."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
import scipy.linalg

from gacompiler.algebra.catalog import VGA3, null_pairs
from gacompiler.algebra.multivector import Multivector
from gacompiler.algebra.versors import commutator
from gacompiler.errors import AlgebraError
from gacompiler.structure.affine import AffineSpace, Horosphere
from gacompiler.structure.exponential import exponential
from gacompiler.structure.general_linear import (
    bivector_of_linear_map,
    general_linear_algebra,
    linear_map_of_bivector,
    linear_map_of_versor,
    null_cones,
    orthogonal_subalgebra,
    orthonormal_frame,
    polar_versors,
    special_linear_algebra,
    versor_blades,
    versor_coefficients,
    versor_of_linear_map,
)
from gacompiler.structure.groups import membership
from gacompiler.structure.representation import representation
from tests.support.all_cases import all_cases

RNG = np.random.default_rng(70)


def integers(*shape: int) -> np.ndarray:
    return RNG.integers(-5, 6, shape)


def regular(n: int) -> np.ndarray:
    while True:
        matrix = integers(n, n)
        if round(np.linalg.det(matrix)):
            return matrix


def distance(a: Multivector, b: Multivector) -> float:
    return max((abs(value) for value in (a - b).terms.values()), default=0.0)


@all_cases("n", [1, 2, 3, 4])
def test_reciprocal_null_cones(n: int) -> None:
    """``w_i w_j + w_j w_i = 0``, ``w_i v_j + v_j w_i = 2 delta``: creation and annihilation, up to a factor."""
    vectors = null_cones(n).basis()
    assert null_cones(n) == null_pairs(n)
    for i, j in product(range(2 * n), repeat=2):
        assert vectors[i] * vectors[j] + vectors[j] * vectors[i] == 2 * int(abs(i - j) == n)
    plus, minus = orthonormal_frame(n)
    for i, j in product(range(n), repeat=2):
        assert (plus[i] * plus[j] + plus[j] * plus[i]) == 2 * (i == j)
        assert (minus[i] * minus[j] + minus[j] * minus[i]) == -2 * (i == j)
        assert plus[i] * minus[j] == -minus[j] * plus[i]
    assert str(representation(null_cones(n)).kind) == f"R({2**n})"


@all_cases("n", [1, 2, 3, 4])
def test_matrices_as_bivectors(n: int) -> None:
    """Exact: brackets are commutators of matrices, the first cone moves by A, the second by minus A transposed."""
    a, b = integers(n, n), integers(n, n)
    x, y = bivector_of_linear_map(a.tolist()), bivector_of_linear_map(b.tolist())
    assert commutator(x, y) == bivector_of_linear_map((a @ b - b @ a).tolist())
    assert np.array_equal(linear_map_of_bivector(x), a)
    vectors = null_cones(n).basis()
    for k in range(n):
        assert commutator(x, vectors[k]) == sum((vectors[i] * int(a[i, k]) for i in range(n)), x * 0)
        assert commutator(x, vectors[n + k]) == -sum((vectors[n + i] * int(a[k, i]) for i in range(n)), x * 0)


@pytest.mark.parametrize("n", [2, 3])
def test_general_and_special_linear_algebras(n: int) -> None:
    """``[E_ij, E_kl] = delta_jk E_il - delta_li E_kj``; sl(n) is simple, and Killing's form is 2 n tr(A B)."""
    gl, sl = general_linear_algebra(n), special_linear_algebra(n)
    c = gl.structure_constants.reshape((n,) * 6)
    one = np.eye(n, dtype=int)
    expected = np.einsum("jk,ia,lb->ijklab", one, one, one) - np.einsum("li,ka,jb->ijklab", one, one, one)
    assert np.array_equal(c, expected)
    (centre,) = gl.centre
    assert np.array_equal(linear_map_of_bivector(centre), linear_map_of_bivector(centre)[0, 0] * one)
    assert sl.dimension == n * n - 1 == gl.derived.dimension and sl.is_semisimple
    matrices = [linear_map_of_bivector(x) for x in sl.basis]
    assert np.array_equal(sl.killing_form, [[2 * n * np.trace(a @ b) for b in matrices] for a in matrices])
    assert sl.killing_signature[1] == n * (n - 1) // 2
    for squares in ([1] * n, [1] * (n - 1) + [-1]):
        so = orthogonal_subalgebra(squares)
        assert so.dimension == n * (n - 1) // 2
        for x in so.basis:
            a = linear_map_of_bivector(x)
            metric = np.diag(squares)
            assert not np.any(a.T @ metric + metric @ a)
            moved = exponential(x * 0.4)
            t = linear_map_of_versor(moved).astype(float)
            assert np.abs(t.T @ metric @ t - metric).max() < 1e-13


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_versors_of_integer_matrices(n: int) -> None:
    """Exactly: the first cone moves by T, the second by its inverse transposed, the norm is det T."""
    for _ in range(3):
        t = regular(n)
        versor = versor_of_linear_map(t.tolist())
        determinant = round(np.linalg.det(t))
        assert all(isinstance(x, (int, Fraction)) for x in versor.terms.values())
        assert versor * ~versor == determinant
        vectors = null_cones(n).basis()
        columns = [sum((vectors[i] * int(t[i, k]) for i in range(n)), versor * 0) for k in range(n)]
        for k in range(n):
            assert versor * vectors[k] == columns[k] * versor
            back = sum((vectors[n + i] * int(t[k, i]) for i in range(n)), versor * 0)  # T^T of the image is v_k
            assert versor * back == vectors[n + k] * versor
        assert np.array_equal(linear_map_of_versor(versor), t)
        found = membership(versor)
        assert found.is_lipschitz and found.spinor_norm == determinant


@pytest.mark.parametrize("n", [1, 2, 3])
def test_versors_multiply_as_matrices(n: int) -> None:
    """A homomorphism, no sign left open, for all signs of the determinants."""
    for _ in range(4):
        s, t = regular(n), regular(n)
        assert versor_of_linear_map((s @ t).tolist()) == versor_of_linear_map(s) * versor_of_linear_map(t)
    assert versor_of_linear_map(np.eye(n, dtype=int)) == 1


def test_elementary_matrices() -> None:
    """Transvections are exponentials that end; exchanges, signs and scalings have no real logarithm or an easy one."""
    n = 3
    w, v = null_cones(n).basis()[:n], null_cones(n).basis()[n:]
    for i, j in product(range(n), repeat=2):
        if i == j:
            continue
        shear = np.eye(n, dtype=int)
        shear[i, j] = 7
        expected = exponential((w[i] ^ v[j]) * Fraction(7, 2))
        assert expected == 1 + (w[i] ^ v[j]) * Fraction(7, 2) and versor_of_linear_map(shear) == expected
        exchange = np.eye(n, dtype=int)[[j if k == i else i if k == j else k for k in range(n)]]
        assert versor_of_linear_map(exchange) * ~versor_of_linear_map(exchange) == -1
        assert np.array_equal(linear_map_of_versor(versor_of_linear_map(exchange)), exchange)
    for i in range(n):
        sign = np.eye(n, dtype=int)
        sign[i, i] = -1
        assert versor_of_linear_map(sign) == -(w[i] ^ v[i])
        scaling = np.eye(n, dtype=int)
        scaling[i, i] = 9
        assert versor_of_linear_map(scaling) == 5 + 4 * (w[i] ^ v[i])  # 3 times a unit versor


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_versors_are_exponentials_of_logarithms(n: int) -> None:
    """``exp(B / 2)``, B the bivector of scipy's logarithm; GL(3) in G(3, 3) to 5e-14."""
    for _ in range(3):
        a = RNG.normal(size=(n, n)) * 0.5
        t = scipy.linalg.expm(a)
        logarithm = np.real(scipy.linalg.logm(t))
        versor = versor_of_linear_map(t, normalized=True)
        by_series = exponential(bivector_of_linear_map(logarithm.tolist()) * 0.5)
        assert distance(versor, by_series) < 5e-14
        assert membership(versor).is_spin_plus
        for found in (versor, by_series):
            assert np.abs(linear_map_of_versor(found).astype(float) - t).max() < 5e-14 * max(1, np.abs(t).max())


@all_cases("n", [1, 2, 3, 4])
def test_negative_determinants_and_no_real_logarithm(n: int) -> None:
    """The norm is the sign of the determinant; minus the identity, with eigenvalues -1, is no exception."""
    t = RNG.normal(size=(n, n))
    t[0] *= -np.sign(np.linalg.det(t))
    found = membership(versor_of_linear_map(t, normalized=True))
    assert found.is_spin and not found.is_spin_plus and found.spinor_norm == pytest.approx(-1)
    assert np.abs(linear_map_of_versor(versor_of_linear_map(t)).astype(float) - t).max() < 1e-12
    opposite = versor_of_linear_map(-np.eye(n))
    assert np.array_equal(linear_map_of_versor(opposite).astype(float), -np.eye(n))
    assert distance(opposite, versor_of_linear_map(-np.eye(n, dtype=int))) < 1e-14


def test_coefficients_in_batches() -> None:
    matrices = RNG.normal(size=(5, 2, 3, 3))
    found = versor_coefficients(matrices)
    assert found.shape == (5, 2, len(versor_blades(3))) and len(versor_blades(3)) == 20
    for k in np.ndindex(5, 2):
        versor = versor_of_linear_map(matrices[k])
        assert np.array_equal([versor[b] for b in versor_blades(3)], found[k])


def test_polar_factors() -> None:
    """Rotations are rotors of the plus vectors and of the minus vectors alike; stretches mix the two."""
    t = RNG.normal(size=(3, 3))
    rotation, stretch = polar_versors(t)
    q, s = (linear_map_of_versor(x).astype(float) for x in (rotation, stretch))
    known_q, known_s = scipy.linalg.polar(t)
    assert np.abs(q - known_q).max() < 1e-13 and np.abs(s - known_s).max() < 1e-13
    assert distance(rotation * stretch, versor_of_linear_map(t, normalized=True)) < 1e-13
    plus, minus = orthonormal_frame(3)
    for frame in (plus, minus):
        for k in range(3):
            image = sum((frame[i] * q[i, k] for i in range(3)), rotation * 0)
            assert distance(rotation * frame[k], image * rotation) < 1e-13


def test_invalid_linear_maps_are_rejected() -> None:
    with pytest.raises(AlgebraError, match="determinant 0"):
        versor_of_linear_map([[1, 2], [2, 4]])
    with pytest.raises(AlgebraError, match="square"):
        versor_of_linear_map([[1, 2]])
    w1, w2, v1, v2 = null_cones(2).basis()
    with pytest.raises(AlgebraError, match="mixes"):
        linear_map_of_versor(w1 + v1)
    with pytest.raises(AlgebraError, match="not a versor"):
        linear_map_of_versor(w1 + w1 * w2 * v2)
    with pytest.raises(AlgebraError, match="w_i"):
        linear_map_of_bivector(w1 ^ w2)
    with pytest.raises(AlgebraError, match="null_pairs"):
        linear_map_of_bivector(VGA3.basis()[0] ^ VGA3.basis()[1])


@pytest.mark.parametrize("n", [1, 2, 3])
def test_affine_maps(n: int) -> None:
    """Versors of G(n + 1, n + 1) move points, lines and planes as ``x -> A x + t``, exactly."""
    space = AffineSpace(n)
    for _ in range(2):
        a, t = regular(n), integers(n)
        versor = space.versor(a.tolist(), t.tolist())
        points = integers(n + 1, n)
        moved = [space.move(versor, space.point(p.tolist())) for p in points]
        for p, image in zip(points, moved, strict=True):
            assert space.coordinates(image) == tuple(a @ p + t)
        join, image = space.point(points[0].tolist()), moved[0]
        for p, q in zip(points[1:], moved[1:], strict=True):
            join, image = join ^ space.point(p.tolist()), image ^ q
            assert space.move(versor, join) == image
        translator = space.translator(t.tolist())
        assert translator == space.versor(np.eye(n, dtype=int).tolist(), t.tolist())
        direction = space.direction(points[0].tolist())
        assert space.move(translator, direction) == direction
        with pytest.raises(AlgebraError, match="weight 0"):
            space.coordinates(direction)
    with pytest.raises(AlgebraError, match="coordinates"):
        space.point([1] * (n + 1))


def test_rigid_motions_are_homogeneous_matrices() -> None:
    """``exp`` of a twist in se(3) against scipy, 1e-12."""
    space = AffineSpace(3)
    lie = space.euclidean_algebra()
    twist = RNG.normal(size=6)
    versor = exponential(lie.element((twist / 2).tolist()))
    matrix = sum(x * linear_map_of_bivector(b).astype(float) for x, b in zip(twist, lie.basis, strict=True))
    expected = scipy.linalg.expm(matrix)
    assert np.abs(linear_map_of_versor(versor).astype(float) - expected).max() < 1e-12
    assert np.abs(expected[:3, :3].T @ expected[:3, :3] - np.eye(3)).max() < 1e-13


def test_lie_algebras_of_the_affine_plane() -> None:
    """aff(2): six generators whose brackets are those of matrices without a last row; translations are an ideal."""
    space = AffineSpace(2)
    aff, motions = space.affine_algebra(), space.euclidean_algebra()
    assert aff.dimension == 6 and aff.derived.dimension == 5 and motions.dimension == 3
    assert motions.killing_signature == (0, 1, 2)
    for x, y in product(aff.basis, repeat=2):
        a, b = linear_map_of_bivector(x), linear_map_of_bivector(y)
        assert not a[2].any()
        assert np.array_equal(linear_map_of_bivector(aff.element(aff.coordinates(commutator(x, y)))), a @ b - b @ a)


@all_cases("p, q", [(1, 0), (2, 0), (3, 0), (1, 3)])
def test_horosphere(p: int, q: int) -> None:
    """Null, of product 1 with ``ebar``, distances as products, there and back; translators exactly."""
    space = Horosphere(p, q)
    n = p + q
    metric = np.diag([1] * p + [-1] * q)
    for _ in range(5):
        x, y, t = integers(3, n)
        a, b = space.conformal(x.tolist()), space.conformal(y.tolist())
        assert a * a == 0 and a.product("scalar_product", space.ebar) == 1
        assert a.product("scalar_product", b).scalar == Fraction(-int((x - y) @ metric @ (x - y)), 2)
        assert space.lift(space.drop(a)) == a and space.drop(a) == space.affine(x.tolist())
        assert space.coordinates(a) == tuple(x)
        translator = space.translator(t.tolist())
        assert translator * a * ~translator == space.conformal((x + t).tolist())
        assert translator * ~translator == 1


def plain_distance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The shortest vector from one flat to another, each given by points as rows, by least squares."""
    directions = np.concatenate([a[1:] - a[0], b[1:] - b[0]]).T
    gap = b[0] - a[0]
    if not directions.size:
        return gap.astype(float)
    weights = np.linalg.lstsq(directions, gap, rcond=None)[0]
    return np.asarray(gap - directions @ weights)


CASES = {
    "point, point": ([[1, 2, 3]], [[4, 0, -1]]),
    "point, line": ([[1, 2, 3]], [[0, 0, 1], [2, 1, 0]]),
    "point, plane": ([[1, 2, 3]], [[0, 0, 1], [2, 1, 0], [1, 1, 5]]),
    "point on line": ([[1, 1, 1]], [[0, 0, 0], [2, 2, 2]]),
    "skew lines": ([[0, 0, 0], [1, 0, 0]], [[0, 5, 3], [1, 6, 3]]),
    "lines that meet": ([[0, 0, 0], [1, 2, 3]], [[1, 2, 3], [4, 4, 4]]),
    "parallel lines": ([[0, 0, 0], [1, 2, 2]], [[3, 0, 0], [5, 4, 4]]),
    "line parallel to plane": ([[0, 0, 7], [1, 1, 7]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]]),
    "line through plane": ([[0, 0, 7], [1, 1, 8]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]]),
    "parallel planes": ([[0, 0, 3], [1, 0, 2], [0, 1, 2]], [[0, 0, -1], [1, 0, -2], [0, 1, -2]]),
    "planes that meet": ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [1, 0, 0], [0, 1, 1]]),
}


@all_cases("case", CASES)
def test_directed_distances(case: str) -> None:
    """Compare with least squares on plain vectors, in both orders, for all pairs of points, lines and planes."""
    space = Horosphere(3)
    one, two = CASES[case]
    a, b = space.flat(*one), space.flat(*two)
    found = space.directed_distance(a, b)
    assert all(isinstance(x, (int, Fraction)) for x in found.terms.values())
    values = [float(found[1 << k]) for k in range(3)]
    assert np.abs(np.array(values) - plain_distance(np.array(one), np.array(two))).max() < 1e-12
    assert space.directed_distance(b, a) == -found
    if case in ("point, line", "point, plane", "skew lines"):  # the quotient of the book, for independent directions
        span = space.direction(a) ^ space.direction(b)
        quotient = space.direction(a ^ b) * ~span * Fraction(1, (span * ~span).scalar)
        assert quotient in (found, -found)


def test_support_is_nearest_to_the_origin() -> None:
    space = Horosphere(3)
    line = space.flat([1, 2, 3], [2, 4, 0])
    point = np.array([float(x) for x in space.coordinates(space.support(line))])
    assert abs(point @ [1, 2, -3]) < 1e-12
    assert space.lies_on(space.support(line), line)
    with pytest.raises(AlgebraError, match="infinity"):
        space.support(space.direction(line))


def test_flags_and_incidence() -> None:
    """Incidence of a point, a line and a plane is preserved exactly by rigid motions."""
    space = Horosphere(3)
    points = [[1, 0, 2], [3, 1, -1], [0, 4, 5]]
    flag = [space.flat(*points[:k]) for k in (1, 2, 3)]
    assert space.is_flag(*flag) and not space.is_flag(*reversed(flag))
    assert not space.lies_on(space.flat([9, 9, 9]), flag[2])
    e1, e2, e3 = space.vectors
    rotor = (3 + 4 * (e1 * e2)) * Fraction(1, 5) * ((12 + 5 * (e2 * e3)) * Fraction(1, 13))
    motion = space.translator([2, -1, 7]) * rotor
    moved = [space.move(motion, flat) for flat in flag]
    assert space.is_flag(*moved)
    rotation = np.array(membership(rotor).action, dtype=object)[:3, :3]
    for point in points:
        expected = rotation @ np.array(point, dtype=object) + [2, -1, 7]
        image = space.move(motion, space.conformal(point))
        assert space.coordinates(image) == tuple(expected)
        assert space.lies_on(image, moved[2])
    plane = space.flat([0, 0, 0], [1, 0, 0], [0, 1, 0])
    shared, is_finite = space.meet(plane, space.flat([1, 2, 1], [3, 4, -1]))
    assert is_finite and space.coordinates(shared) == (2, 3, 0)
    shared, is_finite = space.meet(plane, space.flat([0, 0, 2], [1, 1, 2]))
    assert not is_finite and shared.blades <= {1, 2}
    near = space.flat([1.0, 2.0, 1e-13])
    assert space.lies_on(near, plane * 1.0) and not space.lies_on(space.flat([1.0, 2.0, 1e-3]), plane * 1.0)
