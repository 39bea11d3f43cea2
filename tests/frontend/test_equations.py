"""Linear equations, eigenvalues and roots of polynomials in kernels, against exact rationals, numpy and mpmath."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cache
from itertools import permutations, product
from math import prod
from random import Random
from typing import Any

import mpmath
import numpy as np
import pytest
from selection import some_slow

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import VGA3
from gacompiler.errors import KernelError
from tests.support.all_cases import all_cases

N = 10_000
SIZES = range(1, 7)


def random(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


# Linear equations.


def exact_matrix(n: int, random: Random) -> list[list[Fraction]]:
    return [[Fraction(random.randint(-9, 9), random.randint(1, 5)) for _ in range(n)] for _ in range(n)]


def exact_determinant(matrix: list[list[Fraction]]) -> Fraction:
    """Leibniz's sum."""
    total = Fraction(0)
    for order in permutations(range(len(matrix))):
        inversions = sum(a > b for k, a in enumerate(order) for b in order[k + 1 :])
        term = Fraction(-1 if inversions % 2 else 1)
        for row, column in enumerate(order):
            term *= matrix[row][column]
        total += term
    return total


def times(a: Any, b: Any) -> list[list[Any]]:
    return [[sum(x * y for x, y in zip(row, column, strict=True)) for column in zip(*b, strict=True)] for row in a]


def identity(n: int) -> list[list[int]]:
    return [[int(row == column) for column in range(n)] for row in range(n)]


@pytest.mark.parametrize("n", SIZES)
def test_rationals_are_solved_exactly(n: int) -> None:
    numbers = Random(n)
    for _ in range(20 if n < 6 else 5):
        matrix = exact_matrix(n, numbers)
        expected = exact_determinant(matrix)
        assert ga.matrix_determinant(matrix) == expected
        right = [Fraction(numbers.randint(-9, 9)) for _ in range(n)]
        solution, determinant = ga.solve_linear(matrix, right)
        inverse, same = ga.inverse_matrix(matrix)
        assert determinant == same == expected
        if expected:
            assert times(matrix, [[x] for x in solution]) == [[x] for x in right]
            assert times(matrix, inverse) == identity(n)
            several, _ = ga.solve_linear(matrix, matrix)
            assert [list(row) for row in several] == identity(n)


@all_cases("n", [*SIZES, 7, 8])
def test_symmetric_rationals_are_solved_exactly(n: int) -> None:
    numbers = Random(n)
    for _ in range(20 if n < 6 else 9 - n):
        root = [[x * (k <= row) for k, x in enumerate(line)] for row, line in enumerate(exact_matrix(n, numbers))]
        matrix = times(root, list(zip(*root, strict=True)))
        if not (expected := prod(root[k][k] for k in range(n)) ** 2):
            continue
        right = exact_matrix(n, numbers)
        lower = [[x if column <= row else None for column, x in enumerate(line)] for row, line in enumerate(matrix)]
        solution, determinant = ga.solve_symmetric(lower, right)
        assert determinant == expected
        assert times(matrix, solution) == right
        alone, _ = ga.solve_symmetric(matrix, [row[0] for row in right])
        assert alone == tuple(row[0] for row in solution)


@all_cases("n", SIZES)
def test_singular_matrices_are_reported(n: int) -> None:
    zero = [[0] * n for _ in range(n)]
    ones = [[1] * n for _ in range(n)]
    for matrix in [zero, ones] if n > 1 else [zero]:
        assert ga.matrix_determinant(matrix) == 0
        assert ga.solve_linear(matrix, [1] * n)[1] == 0
        assert ga.inverse_matrix(matrix)[1] == 0
    assert ga.solve_symmetric(zero, [1] * n)[1] == 0


@cache
def linear(n: int) -> Any:
    @kernel(m=array(SCALAR, n, n), b=array(SCALAR, n), returns=(array(SCALAR, n), SCALAR))
    def solve(m, b):  # type: ignore[no-untyped-def]
        return ga.solve_linear(m, b)

    return ga.compile(solve, effort=0)


@cache
def positive(n: int) -> Any:
    @kernel(m=array(SCALAR, n, n), b=array(SCALAR, n), returns=(array(SCALAR, n), SCALAR))
    def solve_positive(m, b):  # type: ignore[no-untyped-def]
        return ga.solve_symmetric(m, b)

    return ga.compile(solve_positive, effort=0)


@cache
def inverting(n: int) -> Any:
    @kernel(m=array(SCALAR, n, n), returns=(array(SCALAR, n, n), SCALAR))
    def invert(m):  # type: ignore[no-untyped-def]
        return ga.inverse_matrix(m)

    return ga.compile(invert, effort=0)


@cache
def conditioned(n: int, condition: float, seed: int) -> np.ndarray:
    """Matrices with a given condition number and logarithmically spaced singular values."""
    numbers = random(seed)
    left, right = (np.linalg.qr(numbers.standard_normal((N, n, n)))[0] for _ in range(2))
    return (left * np.geomspace(1, 1 / condition, n)) @ right


def residual(matrix: np.ndarray, solution: np.ndarray, right: np.ndarray) -> float:
    wide = np.longdouble
    lack = (matrix.astype(wide) * solution.astype(wide)[:, None]).sum(axis=-1) - right
    sizes = np.linalg.norm(matrix, axis=(1, 2)) * np.linalg.norm(solution, axis=1) + np.linalg.norm(right, axis=1)
    return float((np.abs(lack).max(axis=1) / sizes).max())


@pytest.mark.parametrize("n", some_slow([3, 6], 6))
@pytest.mark.slow
def test_elimination_is_backward_stable(n: int) -> None:
    right = random(9).standard_normal((N, n))
    for condition in (10, 1e13):
        matrix = conditioned(n, condition, seed=n)
        assert residual(matrix, linear(n)(matrix, right)[0], right) < 5e-16
    graded = random(1).standard_normal((N, n, n)) * 10.0 ** random(2).uniform(-6, 6, (N, n, 1))
    solution = linear(n)(graded, right)[0]
    expected = np.linalg.solve(graded, right[..., None])[..., 0]
    error = np.linalg.norm(solution - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert np.median(error) < 1e-14
    single = linear(n)(conditioned(n, 10, seed=n).astype(np.float32), right.astype(np.float32))[0]
    assert single.dtype == np.float32
    assert residual(conditioned(n, 10, seed=n).astype(np.float32).astype(float), single.astype(float), right) < 5e-7


def test_two_rows() -> None:
    right = random(9).standard_normal((N, 2))
    matrix = conditioned(2, 1e6, seed=2)
    expected = np.linalg.solve(matrix, right[:, :, None])[..., 0]
    error = np.linalg.norm(linear(2)(matrix, right)[0] - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert error.max() < 1e-15 * 1e6


@pytest.mark.parametrize("n", some_slow([3, 6], 6))
@pytest.mark.slow
def test_positive_definite_matrices(n: int) -> None:
    right = random(9).standard_normal((N, n))
    for condition in (10, 1e6):
        root = conditioned(n, condition, seed=n)
        matrix = root @ root.swapaxes(1, 2)
        assert residual(matrix, positive(n)(matrix, right)[0], right) < 5e-16


@pytest.mark.slow
def test_inverse_of_moderate_matrices() -> None:
    for n, condition in product((3, 4), (10, 100)):
        matrix = conditioned(n, condition, seed=n)
        inverse, determinant = inverting(n)(matrix)
        expected = np.linalg.inv(matrix)
        assert np.abs(inverse - expected).max() < 2e-15 * condition**2
        assert np.abs(determinant - np.linalg.det(matrix)).max() < 1e-15


def test_pivots_and_singular_floats() -> None:
    anti = np.eye(3)[::-1] * [1.0, 2.0, 4.0]
    solution, determinant = linear(3)(anti, [8.0, 8.0, 8.0])
    np.testing.assert_array_equal(solution, [8.0, 4.0, 2.0])
    assert determinant == -8
    for matrix in (np.zeros((3, 3)), np.ones((3, 3))):
        solution, determinant = linear(3)(matrix, np.ones(3))
        assert determinant == 0 and np.isfinite(solution).all()


def vector(x: Any, y: Any, z: Any) -> Any:
    """Three results as one vector, which can be differentiated."""
    return ga.assemble(VGA3, {"e1": x, "e2": y, "e3": z})


def moved(a: Any, t: Any, b: Any) -> Any:
    """``a + t b`` for nested sequences: derivatives with respect to t are derivatives along b."""
    if isinstance(a, tuple):
        return tuple(moved(x, t, y) for x, y in zip(a, b, strict=True))
    return a + t * b


@pytest.mark.slow
def test_derivative_of_a_solution() -> None:
    matrix_type, column = array(SCALAR, 3, 3), array(SCALAR, 3)

    @kernel(m=matrix_type, b=column, t=SCALAR, d=matrix_type)
    def moved_solution(m, b, t, d):  # type: ignore[no-untyped-def]
        return vector(*ga.solve_linear(moved(m, t, d), b)[0])

    matrix, direction, right = (random(5).standard_normal(shape) for shape in ((9, 3, 3), (9, 3, 3), (9, 3)))
    value, derivative = ga.compile(ga.jacobian(moved_solution, "t"), effort=0)(matrix, right, np.zeros(9), direction)
    expected = np.linalg.solve(matrix, right[..., None])
    np.testing.assert_allclose(value, expected[..., 0], rtol=1e-12)
    slope = np.linalg.solve(matrix, -direction @ expected)[..., 0]
    np.testing.assert_allclose(derivative.reshape(9, 3), slope, rtol=1e-10)


@all_cases(
    "call",
    [
        lambda: ga.matrix_determinant([[1, 2]]),
        lambda: ga.solve_linear(identity(7), [0] * 7),
        lambda: ga.solve_linear(identity(2), [1, 2, 3]),
        lambda: ga.solve_symmetric(identity(2), [[1, 2], [3]]),
        lambda: ga.eigenvalues_symmetric(identity(5)),
        lambda: ga.eigenvectors_symmetric([[1, 2], [3]]),
    ],
)
def test_wrong_sizes_are_rejected(call: Callable[[], Any]) -> None:
    with pytest.raises(KernelError, match=r"expected"):
        call()


# Eigenvalues.


@cache
def eigen(n: int) -> Any:
    @kernel(m=array(SCALAR, n, n), returns=(array(SCALAR, n), array(SCALAR, n, n)))
    def eigenvectors(m):  # type: ignore[no-untyped-def]
        return ga.eigenvectors_symmetric(m)

    return ga.compile(eigenvectors, effort=0)


def with_eigenvalues(values: np.ndarray, seed: int = 0) -> np.ndarray:
    count, n = values.shape
    basis = np.linalg.qr(random(seed).standard_normal((count, n, n)))[0]
    matrix = (basis * values[:, None, :]) @ basis.swapaxes(1, 2)
    return np.asarray((matrix + matrix.swapaxes(1, 2)) / 2)


def symmetric_matrices(n: int, count: int) -> Iterator[tuple[str, np.ndarray]]:
    numbers = random(n)
    general = numbers.standard_normal((count, n, n))
    yield "random", general + general.swapaxes(1, 2)
    signs = numbers.choice([-1.0, 1.0], (count, n))
    yield "graded", with_eigenvalues(signs * 10 ** numbers.uniform(-15, 0, (count, n)))
    scales = 10 ** numbers.uniform(-8, 0, (count, n))
    yield "graded entries", (general + general.swapaxes(1, 2)) * scales[:, :, None] * scales[:, None, :]
    yield "nearly equal", with_eigenvalues(1 + 10 ** numbers.uniform(-16, -1, (count, n)))
    pairs = numbers.standard_normal((count, n))
    pairs[:, 1::2] = pairs[:, : n // 2 * 2 : 2] * (1 + 10 ** numbers.uniform(-17, -3, (count, n // 2)))
    yield "pairs", with_eigenvalues(pairs)
    opposite = pairs.copy()
    opposite[:, 1::2] *= -1
    yield "opposite", with_eigenvalues(opposite)
    yield "projections", with_eigenvalues(numbers.integers(0, 2, (count, n)).astype(float))
    integers = numbers.integers(-2, 3, (count, n, n)).astype(float)
    yield "integers", integers + integers.swapaxes(1, 2)
    yield "diagonal", integers * np.eye(n)
    yield "tiny", (general + general.swapaxes(1, 2)) * 1e-70


@pytest.mark.parametrize("n", some_slow([2, 3, 4], 4))
@pytest.mark.slow
def test_eigenvectors_of_many_matrices(n: int) -> None:
    for name, matrix in symmetric_matrices(n, N):
        values, vectors = eigen(n)(matrix)
        norms = np.maximum(np.linalg.norm(matrix, axis=(1, 2)), 1e-300)
        assert (np.diff(values) >= 0).all(), name
        assert (np.abs(values - np.linalg.eigvalsh(matrix)).max(axis=1) / norms).max() < 5e-15, name
        assert np.abs(vectors.swapaxes(1, 2) @ vectors - np.eye(n)).max() < 2e-15, name
        lack = np.abs(matrix @ vectors - vectors * values[:, None, :]).max(axis=(1, 2))
        assert (lack / norms).max() < 2e-15, name


@pytest.mark.parametrize("n", some_slow([2, 3, 4], 4))
def test_eigenvalues_to_forty_digits(n: int) -> None:
    for name, matrices in symmetric_matrices(n, 8):
        for matrix, values in zip(matrices, eigen(n)(matrices)[0], strict=True):
            with mpmath.workdps(40):
                expected = sorted(mpmath.eigsy(mpmath.matrix(matrix.tolist()), eigvals_only=True))
                errors = [abs(a - b) for a, b in zip(values.tolist(), expected, strict=True)]
            assert max(errors) <= 3e-15 * np.linalg.norm(matrix), name


@pytest.mark.parametrize("n", some_slow([2, 3, 4], 4))
def test_special_matrices_and_single_precision(n: int) -> None:
    for matrix in (np.zeros((n, n)), np.eye(n), -3 * np.eye(n)):
        values, vectors = eigen(n)(matrix)
        np.testing.assert_array_equal(values, np.diag(matrix))
        np.testing.assert_allclose(vectors.T @ vectors, np.eye(n), atol=1e-15)
    general = random(3).standard_normal((N, n, n)).astype(np.float32)
    values, vectors = eigen(n)(general + general.swapaxes(1, 2))
    assert values.dtype == np.float32
    assert np.abs(vectors.swapaxes(1, 2) @ vectors - np.eye(n)).max() < 2e-6
    expected = np.linalg.eigvalsh((general + general.swapaxes(1, 2)).astype(float))
    assert (np.abs(values - expected).max(axis=1) / np.linalg.norm(general, axis=(1, 2))).max() < 2e-6


@pytest.mark.slow
def test_eigenvalues_alone_and_their_derivative() -> None:
    @kernel(m=array(SCALAR, 3, 3), t=SCALAR, d=array(SCALAR, 3, 3))
    def moved_eigenvalues(m, t, d):  # type: ignore[no-untyped-def]
        return vector(*ga.eigenvalues_symmetric(moved(m, t, d)))

    (_, matrix), (_, direction) = next(symmetric_matrices(3, 100)), next(symmetric_matrices(3, 100))
    direction = direction[::-1]
    values, derivative = ga.compile(ga.jacobian(moved_eigenvalues, "t"), effort=0)(matrix, np.zeros(100), direction)
    expected, vectors = np.linalg.eigh(matrix)
    np.testing.assert_allclose(values, expected, atol=1e-14 * np.abs(matrix).max())
    slope = np.einsum("kir,kij,kjr->kr", vectors, direction, vectors)
    np.testing.assert_allclose(derivative.reshape(100, 3), slope, atol=1e-9)


# Roots.

SOLVERS: dict[int, Callable[..., Any]] = {2: ga.quadratic_roots, 3: ga.cubic_roots, 4: ga.quartic_roots}


@cache
def roots(degree: int, backend: str | None = None) -> Any:
    @kernel(c=array(SCALAR, degree + 1), returns=(array(SCALAR, degree), array(SCALAR, degree), SCALAR))
    def roots_of_polynomial(c):  # type: ignore[no-untyped-def]
        return SOLVERS[degree](*c)

    return ga.compile(roots_of_polynomial, backend, effort=0)


def with_roots(values: np.ndarray) -> np.ndarray:
    """Coefficients of monic polynomials, real ones where complex roots are in pairs."""
    coefficients = np.ones((len(values), 1), dtype=complex)
    for root in values.T:
        coefficients = np.pad(coefficients, ((0, 0), (0, 1)))
        coefficients[:, 1:] -= coefficients[:, :-1] * root[:, None]
    return np.ascontiguousarray(coefficients.real)


def paired(values: np.ndarray) -> np.ndarray:
    """Pairs of conjugate roots from pairs of columns; a last single column is kept."""
    result = values.astype(complex)
    for k in range(0, values.shape[1] - 1, 2):
        result[:, k], result[:, k + 1] = values[:, k] + 1j * values[:, k + 1], values[:, k] - 1j * values[:, k + 1]
    return result


def polynomials(degree: int) -> Iterator[tuple[str, np.ndarray]]:
    """Coefficients for which residuals must be of the size of rounding errors."""
    numbers = random(degree)
    general = numbers.standard_normal((N, degree + 1))
    yield "random", general
    yield "integers", numbers.integers(-3, 4, (N, degree + 1)).astype(float)
    values = numbers.standard_normal((N, degree))
    yield "real roots", with_roots(values)
    yield "complex roots", with_roots(paired(values))
    yield "graded roots", with_roots(values * 10 ** numbers.uniform(-2, 2, (N, degree)))
    yield "equal roots", with_roots(np.repeat(values[:, :1], degree, axis=1))
    for count in range(1, degree + 2):
        yield f"first {count} zero", np.where(np.arange(degree + 1) < count, 0.0, general[:1000])
        yield f"last {count} zero", np.where(np.arange(degree + 1) > degree - count, 0.0, general[:1000])
    yield "ends only", np.where(np.arange(degree + 1) % degree, 0.0, general)
    yield "even powers only", np.where(np.arange(degree, -1, -1) % 2, 0.0, general)


def difficult_polynomials(degree: int) -> Iterator[tuple[str, np.ndarray]]:
    """Coefficients for which quartics are not always solved to the last digit."""
    numbers = random(degree)
    values = numbers.standard_normal((N, degree))
    double = values.copy()
    double[:, 1] = values[:, 0]
    yield "double root", with_roots(double)
    yield "nearly real roots", with_roots(paired(values * np.resize([1, 1e-8], degree)))
    near = values.copy()
    near[:, 1] = values[:, 0] * (1 + 10 ** numbers.uniform(-15, -1, N))
    yield "nearly double root", with_roots(near)
    yield "two pairs", with_roots(np.resize(values[:, :2], (N, degree)) if degree == 4 else double)
    yield "cluster", with_roots(values[:, :1] * (1 + 10 ** numbers.uniform(-10, -1, (N, degree))))
    yield "far apart", with_roots(values * 10 ** numbers.uniform(-6, 6, (N, degree)))
    yield "small leading", numbers.standard_normal((N, degree + 1)) * np.r_[1e-12, np.ones(degree)]


def degrees(coefficients: np.ndarray) -> np.ndarray:
    leading_zeros = np.cumprod(coefficients == 0, axis=1).sum(axis=1)
    return np.asarray(np.maximum(coefficients.shape[1] - 1 - leading_zeros, 0))


def residuals(coefficients: np.ndarray, found: Any) -> np.ndarray:
    """``|p(x)|`` over the sum of ``|a_k x**k|``, the largest of a polynomial's roots."""
    real, imaginary, _ = found
    x = real.astype(np.longdouble) + 1j * imaginary.astype(np.longdouble)
    value, size = np.zeros_like(x), np.zeros(x.shape, dtype=np.longdouble)
    for coefficient in coefficients.astype(np.longdouble).T:
        value, size = value * x + coefficient[:, None], size * abs(x) + abs(coefficient[:, None])
    relative = np.abs(value) / np.where(size == 0, 1, size)
    exists = np.arange(real.shape[1]) < degrees(coefficients)[:, None]
    return np.asarray(np.where(exists, relative, 0).max(axis=1).astype(float))


def check_order(coefficients: np.ndarray, found: Any) -> None:
    real, imaginary, number = found
    assert np.isfinite(real).all() and np.isfinite(imaginary).all()
    degree, places = degrees(coefficients), np.arange(real.shape[1])
    is_real = places < number[:, None]
    exists = places < degree[:, None]
    assert ((imaginary == 0) == (is_real | ~exists)).all()
    assert (real[~exists] == 0).all()
    assert (np.diff(real, axis=1) >= 0)[is_real[:, 1:]].all()
    first = (exists & ~is_real) & ((places - number[:, None]) % 2 == 0)
    assert (imaginary[first] > 0).all()
    np.testing.assert_array_equal(imaginary[:, 1:][first[:, :-1]], -imaginary[:, :-1][first[:, :-1]])
    np.testing.assert_array_equal(real[:, 1:][first[:, :-1]], real[:, :-1][first[:, :-1]])


@pytest.mark.parametrize("degree", some_slow([2, 3, 4], 4))
@pytest.mark.slow
def test_residuals_of_roots(degree: int) -> None:
    for name, coefficients in polynomials(degree):
        found = roots(degree)(coefficients)
        check_order(coefficients, found)
        assert residuals(coefficients, found).max() < 2e-15, name


@pytest.mark.parametrize("degree", some_slow([2, 3, 4], 4))
def test_residuals_of_difficult_roots(degree: int) -> None:
    for name, coefficients in difficult_polynomials(degree):
        found = roots(degree)(coefficients)
        check_order(coefficients, found)
        errors = residuals(coefficients, found)
        if degree < 4:
            assert errors.max() < 2e-15, name
        else:
            assert np.quantile(errors, 0.99) < 5e-13, name


@pytest.mark.parametrize("degree", some_slow([2, 3, 4], 4))
def test_roots_to_forty_digits(degree: int) -> None:
    numbers = random(degree)
    coefficients = numbers.standard_normal((40, degree + 1))
    real, imaginary, number = roots(degree)(coefficients)
    for row, x, y, count in zip(coefficients.tolist(), real, imaginary, number, strict=True):
        with mpmath.workdps(40):
            expected = mpmath.polyroots([mpmath.mpf(c) for c in row], maxsteps=200, extraprec=200)
            rest = list(expected)
            for k, value in enumerate(map(complex, x, y)):
                nearest = min(rest, key=lambda root, value=value: abs(root - value))
                rest.remove(nearest)
                slope = abs(row[0] * mpmath.fprod(nearest - other for other in expected if other != nearest))
                size = sum(abs(c) * abs(nearest) ** power for power, c in enumerate(reversed(row)))
                assert abs(nearest - value) < 4e-15 * size / slope, (row, k)
            assert count == sum(abs(root.imag) < 1e-30 for root in expected)


@pytest.mark.parametrize("degree", some_slow(SOLVERS, 4))
def test_roots_in_single_precision(degree: int) -> None:
    coefficients = random(degree).standard_normal((N, degree + 1)).astype(np.float32)
    found = roots(degree)(coefficients)
    assert found[0].dtype == np.float32
    assert residuals(coefficients, found).max() < 2e-6


def test_roots_of_polynomials_of_lower_degree() -> None:
    coefficients = np.array([[1, -6, 11, -6], [1, 0, 0, 8], [0, 1, -3, 2], [0, 0, 2, 1], [0, 0, 0, 1], [0, 0, 0, 0.0]])
    real, imaginary, number = roots(3)(coefficients)
    np.testing.assert_allclose(real, [[1, 2, 3], [-2, 1, 1], [1, 2, 0], [-0.5, 0, 0], [0] * 3, [0] * 3], atol=1e-15)
    np.testing.assert_allclose(imaginary[1], [0, np.sqrt(3), -np.sqrt(3)], atol=1e-15)
    assert not imaginary[[0, 2, 3, 4, 5]].any()
    np.testing.assert_array_equal(number, [3, 1, 2, 1, 0, 0])
    for backend in (None, "numba"):
        real, imaginary, number = roots(2, backend)(coefficients[:, 1:])
        np.testing.assert_allclose(real[2:], [[1, 2], [-0.5, 0], [0, 0], [0, 0]], atol=1e-15)
        np.testing.assert_array_equal(number[2:], [2, 1, 0, 0])


@pytest.mark.slow
def test_derivative_of_a_root() -> None:
    @kernel(c=array(SCALAR, 4), t=SCALAR, d=array(SCALAR, 4))
    def moved_roots(c, t, d):  # type: ignore[no-untyped-def]
        return vector(*ga.cubic_roots(*moved(c, t, d))[0])

    coefficients, direction = np.array([2.0, -12.0, 22.0, -12.0]), np.array([1.0, -1.0, 2.0, 3.0])
    value, derivative = ga.compile(ga.jacobian(moved_roots, "t"), effort=0)(coefficients, 0.0, direction)
    np.testing.assert_allclose(value, [1, 2, 3], rtol=1e-14)
    slope = np.polyval(np.polyder(coefficients), value)
    np.testing.assert_allclose(derivative.ravel(), -np.polyval(direction, value) / slope, rtol=1e-9)
