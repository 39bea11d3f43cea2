"""Bivectors as Lie algebras, their exponentials, and U(n): against matrices, scipy and known dimensions."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
import scipy.linalg
import scipy.stats
from selection import some_slow

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, G33, PGA2, PGA3, STA, VGA3, orthogonal
from gacompiler.algebra.multivector import Multivector
from gacompiler.algebra.versors import commutator
from gacompiler.errors import AlgebraError
from gacompiler.structure.exponential import exponential, matrix_exponential, product_of_exponentials
from gacompiler.structure.groups import membership
from gacompiler.structure.lie import (
    LieAlgebra,
    bivector_algebra,
    bivector_of_matrix,
    generated_lie_algebra,
    vector_matrix,
)
from gacompiler.structure.unitary import (
    bivector_of_skew_hermitian,
    complex_of_vector,
    complex_space,
    complex_structure,
    hermitian_product,
    real_matrix,
    rotor_of_unitary,
    skew_hermitian_of_bivector,
    special_unitary_algebra,
    times_i,
    unitary_algebra,
    unitary_of_rotor,
    vector_of_complex,
)
from tests.support.all_cases import all_cases

RNG = np.random.default_rng(50)
ALGEBRAS = [VGA3, PGA2, PGA3, STA, CGA3, G33, orthogonal(4), orthogonal(2, 2), orthogonal(1, 1, 2)]


def metric_matrices(algebra: Algebra) -> list[np.ndarray]:
    """``v -> a (b . v) - b (a . v)`` for all pairs of basis vectors, from the Gram matrix alone."""
    gram = np.array([[int(x) for x in row] for row in algebra.gram])
    n = len(gram)
    found = []
    for a, b in sorted(combinations(range(n), 2), key=lambda pair: 1 << pair[0] | 1 << pair[1]):
        matrix = np.zeros((n, n), dtype=int)
        matrix[a] += gram[b]
        matrix[b] -= gram[a]
        found.append(matrix)
    return found


def floats(algebra: Algebra, scale: float = 1.0) -> Multivector:
    return Multivector(algebra, {blade: float(RNG.normal()) * scale for blade in algebra.blades(2)})


def distance(a: Multivector, b: Multivector) -> float:
    return max((abs(value) for value in (a - b).terms.values()), default=0.0)


@all_cases("algebra", ALGEBRAS)
def test_structure_constants_are_those_of_matrices(algebra: Algebra) -> None:
    """Brackets of bivectors are commutators of their matrices on vectors; exact."""
    lie = bivector_algebra(algebra)
    n = algebra.dimension
    assert lie.dimension == n * (n - 1) // 2
    matrices = metric_matrices(algebra)
    for bivector, matrix in zip(lie.basis, matrices, strict=True):
        assert np.array_equal(vector_matrix(bivector), matrix)
    c = lie.structure_constants
    for i, a in enumerate(matrices):
        for j, b in enumerate(matrices):
            expected = sum((c[i, j, k] * m for k, m in enumerate(matrices)), np.zeros((n, n), dtype=int))
            assert np.array_equal(a @ b - b @ a, expected)


@all_cases("algebra", ALGEBRAS)
def test_jacobi_and_killing_form(algebra: Algebra) -> None:
    """``K(a, b) = (n - 2) tr(M_a M_b)`` for so(p, q) in any metric (Helgason 1978, ch. III)."""
    lie = bivector_algebra(algebra)
    c = lie.structure_constants
    twice = np.einsum("ijm,mkl->ijkl", c, c)
    assert not np.any(twice + twice.transpose(1, 2, 0, 3) + twice.transpose(2, 0, 1, 3))
    matrices = metric_matrices(algebra)
    expected = [[(algebra.dimension - 2) * np.trace(a @ b) for b in matrices] for a in matrices]
    assert np.array_equal(lie.killing_form, expected)
    x, y = lie.basis[0] + 2 * lie.basis[1], lie.basis[-1] - lie.basis[0]
    image = lie.adjoint(x) @ np.array(lie.coordinates(y), dtype=object)
    assert lie.element(image.tolist()) == commutator(x, y)


@pytest.mark.parametrize(
    ("algebra", "signature", "semisimple"),
    [
        (VGA3, (0, 3, 0), True), (orthogonal(4), (0, 6, 0), True), (STA, (3, 3, 0), True), (CGA3, (4, 6, 0), True),
        (G33, (9, 6, 0), True), (PGA3, (0, 3, 3), False), (PGA2, (0, 1, 2), False),
    ],
    ids=lambda value: getattr(value, "name", None),
)  # fmt: skip
def test_compact_and_semisimple(algebra: Algebra, signature: tuple[int, int, int], semisimple: bool) -> None:
    """so(p, q) has p q boosts, and the rest are rotations; motions also have translations."""
    lie = bivector_algebra(algebra)
    assert lie.killing_signature == signature
    assert lie.is_semisimple == semisimple and lie.is_compact == (signature[1] == lie.dimension)
    assert lie.derived.dimension == (lie.dimension if semisimple or algebra is PGA3 else 2)


def test_four_dimensions_decompose() -> None:
    """so(4) = su(2) + su(2): self-dual and anti-self-dual bivectors commute."""
    e1, e2, e3, e4 = orthogonal(4).basis()
    lie = bivector_algebra(orthogonal(4))
    plus = [e1 * e2 + e3 * e4, e1 * e3 - e2 * e4, e1 * e4 + e2 * e3]
    minus = [e1 * e2 - e3 * e4, e1 * e3 + e2 * e4, e1 * e4 - e2 * e3]
    half = generated_lie_algebra(plus[:2])
    assert half.dimension == 3 and half.is_compact
    other = lie.commutant(*plus)
    assert other.dimension == 3 and all(x == other.element(other.coordinates(x)) for x in minus)
    with pytest.raises(AlgebraError, match="span"):
        half.coordinates(minus[0])
    with pytest.raises(AlgebraError, match="span"):
        LieAlgebra(orthogonal(4), (e1 * e2, e2 * e3))
    with pytest.raises(AlgebraError, match="depend"):
        LieAlgebra(orthogonal(4), (e1 * e2, e1 * e2 * 2))


def test_centre_and_generated() -> None:
    translations = PGA3.layout("T", "e01 e02 e03")
    lie = bivector_algebra(PGA3)
    ideal = [PGA3.multivector({name: 1}) for name in translations.blades]
    assert lie.commutant(*ideal).dimension == 3 and lie.centre == ()
    assert len(generated_lie_algebra(ideal).centre) == 3
    screw = PGA3.multivector({"e12": 1, "e03": 2})
    assert generated_lie_algebra([screw, PGA3.multivector({"e23": 1})]).dimension == 6
    with pytest.raises(AlgebraError, match="largest"):
        generated_lie_algebra([*bivector_algebra(CGA3).basis], largest=5)


@all_cases("algebra", [VGA3, STA, CGA3, G33, PGA3, orthogonal(6), orthogonal(0, 3)])
def test_exponentials_move_vectors_by_exponentials(algebra: Algebra) -> None:
    """``exp(B / 2)`` is in Spin+, and its action the exponential of the matrix of B, by scipy."""
    for scale in (1e-6, 0.3, 2.0):
        bivector = floats(algebra, scale)
        versor = exponential(bivector * 0.5)
        found = membership(versor)
        expected = scipy.linalg.expm(vector_matrix(bivector).astype(float))
        size = max(1.0, np.abs(expected).max())
        assert found.is_spin_plus
        assert np.abs(np.array(found.action, float) - expected).max() < 2e-13 * size**2
        assert distance(versor * exponential(bivector * -0.5), versor.lift(1)) < 1e-13 * size**2


def test_exponentials_are_exact_where_series_end() -> None:
    e1, _, _, e0 = PGA3.basis()
    assert exponential(e1 * e0 * 3) == 1 + e1 * e0 * 3
    w = G33.basis()
    nilpotent = Fraction(1, 2) * (w[0] * w[4]) + Fraction(1, 3) * (w[1] * w[5])  # products of two survive, of three not
    assert exponential(nilpotent) == 1 + nilpotent + nilpotent * nilpotent * Fraction(1, 2)
    assert exponential(VGA3.scalar(0)) == 1


def test_exponentials_of_the_plane_and_of_numbers() -> None:
    """Rotors of G(2), G(1, 1) and G(0, 2) in closed form; complex, double and dual numbers; any other element."""
    for (p, q), even, odd in (((2, 0), np.cos, np.sin), ((1, 1), np.cosh, np.sinh), ((0, 2), np.cos, np.sin)):
        algebra = orthogonal(p, q)
        found = exponential(algebra.multivector({"e12": 1.3}))
        assert distance(found, algebra.multivector({"1": float(even(1.3)), "e12": float(odd(1.3))})) < 1e-15
    size = np.exp(0.4)
    numbers = {(0, 1, 0): (np.cos(2.0), np.sin(2.0)), (1, 0, 0): (np.cosh(2.0), np.sinh(2.0)), (0, 0, 1): (1.0, 2.0)}
    for three, (real, imaginary) in numbers.items():
        algebra = orthogonal(*three)
        found = exponential(algebra.multivector({"1": 0.4, "e1": 2.0}))
        assert distance(found, algebra.multivector({"1": float(size * real), "e1": float(size * imaginary)})) < 4e-15
    for algebra in (PGA3, STA):
        x = Multivector(algebra, {blade: float(RNG.normal()) * 0.5 for blade in algebra.blades()})
        total = term = algebra.scalar(1.0)
        for k in range(1, 40):
            term = term * x / k
            total = total + term
        assert distance(exponential(x), total) < 1e-13


def test_matrix_exponential_is_that_of_scipy() -> None:
    for n, scale in ((1, 3.0), (4, 1e-9), (8, 0.7), (8, 20.0)):
        matrix = RNG.normal(size=(n, n)) * scale
        matrix = (matrix - matrix.T) if scale > 10 else matrix
        expected = scipy.linalg.expm(matrix)
        assert np.abs(matrix_exponential(matrix) - expected).max() < 1e-13 * max(1.0, np.abs(expected).max(), scale)
    assert np.array_equal(matrix_exponential(np.zeros((3, 3))), np.eye(3))
    with pytest.raises(AlgebraError, match="finite"):
        matrix_exponential(np.array([[np.nan]]))


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_exponential_reaches_all_rotations(n: int) -> None:
    """Spin of a definite metric is compact: each rotor is an exponential, of half of scipy's logarithm."""
    algebra = orthogonal(n)
    for seed in range(5):
        rotation = scipy.stats.special_ortho_group.rvs(n, random_state=seed)
        skew = np.real(scipy.linalg.logm(rotation))
        rotor = exponential(bivector_of_matrix(algebra, ((skew - skew.T) / 2).tolist()) * 0.5)
        assert np.abs(np.array(membership(rotor).action, float) - rotation).max() < 1e-12


@all_cases("algebra", ALGEBRAS)
def test_bivectors_and_skew_matrices(algebra: Algebra) -> None:
    bivector = Multivector(algebra, {b: int(RNG.integers(-9, 10)) for b in algebra.blades(2)})
    matrix = vector_matrix(bivector).tolist()
    if algebra.is_degenerate:
        with pytest.raises(AlgebraError, match="degenerate"):
            bivector_of_matrix(algebra, matrix)
        return
    assert bivector_of_matrix(algebra, matrix) == bivector
    matrix[0][0] += 1
    with pytest.raises(AlgebraError, match="skew"):
        bivector_of_matrix(algebra, matrix)


@all_cases("order", [1, 2, 3, 4])
def test_baker_campbell_hausdorff(order: int) -> None:
    """The truncation error decreases with the power of the next order, against logarithms of scipy."""
    algebra = orthogonal(4)
    a, b = floats(algebra), floats(algebra)
    errors = []
    for scale in (0.04, 0.02):
        x, y = a * scale, b * scale
        matrices = [scipy.linalg.expm(vector_matrix(2 * z).astype(float)) for z in (x, y)]
        exact = np.real(scipy.linalg.logm(matrices[0] @ matrices[1])) / 2
        found = vector_matrix(product_of_exponentials(x, y, order)).astype(float)
        errors.append(np.abs(found - exact).max())
    assert order + 0.7 < np.log2(errors[0] / errors[1]) < order + 1.3
    with pytest.raises(AlgebraError, match="order"):
        product_of_exponentials(a, b, 7)


def random_skew_hermitian(n: int) -> np.ndarray:
    matrix = RNG.normal(size=(n, n)) + 1j * RNG.normal(size=(n, n))
    return matrix - matrix.conj().T


@pytest.mark.parametrize("n", some_slow([1, 2, 3, 4], 4))
def test_the_commutant_of_j_is_u_n(n: int) -> None:
    """``n**2`` generators, found as a commutant, are those written down; su(n) is compact and has ``n**2 - 1``."""
    found = bivector_algebra(complex_space(n)).commutant(complex_structure(n))
    known = unitary_algebra(n)
    assert found.dimension == known.dimension == n**2
    assert all(found.element(found.coordinates(x)) == x for x in known.basis)
    (centre,) = known.centre
    assert centre * known.coordinates(complex_structure(n))[-1] in (complex_structure(n), -complex_structure(n))
    special = special_unitary_algebra(n)
    assert special.dimension == n**2 - 1
    if n > 1:
        assert special.is_compact
    if 1 < n < 4:
        assert known.derived.dimension == n**2 - 1
        assert all(known.derived.element(known.derived.coordinates(x)) == x for x in special.basis)
    for x in special.basis:
        assert abs(np.trace(skew_hermitian_of_bivector(x))) == 0


@all_cases("n", [1, 2, 3, 4])
def test_brackets_are_commutators_of_complex_matrices(n: int) -> None:
    a, b = random_skew_hermitian(n), random_skew_hermitian(n)
    x, y = bivector_of_skew_hermitian(a), bivector_of_skew_hermitian(b)
    assert np.abs(skew_hermitian_of_bivector(x) - a).max() < 1e-15
    assert np.abs(skew_hermitian_of_bivector(commutator(x, y)) - (a @ b - b @ a)).max() < 1e-13
    with pytest.raises(AlgebraError, match="skew"):
        bivector_of_skew_hermitian(np.eye(n))


@pytest.mark.parametrize("n", some_slow([1, 2, 3, 4], 4))
def test_rotors_of_unitary_matrices(n: int) -> None:
    """Rotors by exponentials and by reflections, against scipy: U(2) and U(3) to 1e-12."""
    for _ in range(4 if n < 4 else 1):
        matrix = random_skew_hermitian(n)
        unitary = scipy.linalg.expm(matrix)
        rotors = [exponential(bivector_of_skew_hermitian(matrix) * 0.5), rotor_of_unitary(unitary)]
        z = RNG.normal(size=n) + 1j * RNG.normal(size=n)
        v = vector_of_complex(z)
        for rotor in rotors:
            assert membership(rotor).is_spin_plus
            assert np.abs(unitary_of_rotor(rotor) - unitary).max() < 1e-12
            assert np.abs(complex_of_vector((rotor * v * ~rotor).grade(1)) - unitary @ z).max() < 1e-12
            j = complex_structure(n)
            assert distance(rotor * j * ~rotor, j * 1.0) < 1e-12
        assert min(distance(rotors[0], rotors[1]), distance(rotors[0], -rotors[1])) < 1e-12
    special = scipy.stats.unitary_group.rvs(max(n, 2), random_state=4)
    assert np.abs(unitary_of_rotor(rotor_of_unitary(special)) - special).max() < 1e-13


def test_maps_that_are_not_unitary_are_rejected() -> None:
    e = complex_space(2).basis()
    with pytest.raises(AlgebraError, match="complex linear"):
        unitary_of_rotor((1 + e[0] * e[1]) * 0.5**0.5)
    with pytest.raises(AlgebraError, match="complex linear"):
        skew_hermitian_of_bivector(e[0] * e[1])
    with pytest.raises(AlgebraError, match="inner product"):
        rotor_of_unitary([[1, 1], [0, 1]])
    with pytest.raises(AlgebraError, match="square"):
        real_matrix([[1, 2]])


def test_hermitian_product() -> None:
    """``a . b + i (a ^ b) . J`` is the sum of ``a conj(b)``, exactly; and i acts as it should."""
    for n in (1, 2, 3):
        a, b = (RNG.integers(-9, 10, n) + 1j * RNG.integers(-9, 10, n) for _ in range(2))
        x, y = vector_of_complex(a), vector_of_complex(b)
        real, imaginary = hermitian_product(x, y)
        assert complex(real, imaginary) == np.sum(a * b.conj())
        assert np.array_equal(complex_of_vector(times_i(x)), 1j * a)
        assert times_i(times_i(x)) == -x
    with pytest.raises(AlgebraError, match="Euclidean"):
        times_i(STA.basis()[0])
