"""Eigenvectors, singular vectors, null vectors and roots, beside LAPACK and mpmath, also for degenerate matrices."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
import scipy

import gacompiler
from gacompiler import SCALAR, array, jvp, kernel
from gacompiler.matrices import eigenvalues, three_singular_vectors
from generated import matrices
from tests.support.all_cases import all_cases

Reals = np.ndarray[Any, Any]

MANY = 60
SPECTRA = {
    "normal": lambda rng, n: rng.normal(size=(MANY, n)),
    "equal": lambda rng, n: np.repeat(rng.normal(size=(MANY, 1)), n, 1),
    "pairs": lambda rng, n: np.repeat(rng.normal(size=(MANY, n)), 2, 1)[:, :n],
    "nearly equal": lambda rng, n: 1 + 1e-12 * rng.normal(size=(MANY, n)),
    "opposite": lambda rng, n: np.sign(rng.normal(size=(MANY, n))),
    "one": lambda rng, n: np.eye(1, n) * np.ones((MANY, 1)),
    "all but one": lambda rng, n: np.where(np.arange(n) == n // 2, 0, rng.normal(size=(MANY, n))),
    "graded": lambda rng, n: 10.0 ** rng.uniform(-30, 0, (MANY, n)),
    "large": lambda rng, n: 1e200 * rng.normal(size=(MANY, n)),
    "small": lambda rng, n: 1e-200 * rng.normal(size=(MANY, n)),
    "none": lambda rng, n: np.zeros((MANY, n)),
}


def bases(rng: np.random.Generator, n: int) -> Reals:
    return np.linalg.qr(rng.normal(size=(MANY, n, n)))[0]


def symmetric(spectrum: str, n: int) -> Reals:
    rng = np.random.default_rng(n)
    q = bases(rng, n)
    a = (q * SPECTRA[spectrum](rng, n)[:, None, :]) @ np.swapaxes(q, 1, 2)
    return (a + np.swapaxes(a, 1, 2)) / 2


def norms(a: Reals) -> Reals:
    size = np.abs(a).max((1, 2), initial=1e-320)
    return size * np.linalg.norm(a / size[:, None, None], axis=(1, 2)) + 1e-320


def errors(a: Reals, values: Reals, vectors: Reals) -> tuple[Any, Any]:
    """The largest relative residual, and the largest deviation of the vectors from an orthonormal basis."""
    n = a.shape[-1]
    residual = norms(a @ vectors - vectors * values[:, None, :]) / norms(a)
    return residual.max(), norms(np.swapaxes(vectors, 1, 2) @ vectors - np.eye(n)).max()


@all_cases("n", [1, 2, 3, 9, 16])
@all_cases("spectrum", SPECTRA)
def test_eigenvectors_are_as_accurate_as_those_of_lapack(spectrum: str, n: int) -> None:
    a = symmetric(spectrum, n)
    values, vectors, converged = matrices.eigenvectors(a)
    assert converged.all() and (np.diff(values) >= 0).all()
    own, other = errors(a, values, vectors), errors(a, *np.linalg.eigh(a))
    least = 1e-15 if n < 3 else 0  # LAPACK has two rows in closed form.
    assert own[0] <= 2 * other[0] + least and own[1] <= 2 * other[1] + least


def paths(rng: np.random.Generator, n: int) -> Reals:
    a = np.zeros((MANY, n, n))
    a[:, range(n - 1), range(1, n)] = rng.integers(0, 2, (MANY, n - 1))
    return a


EXACT = {
    "integers": lambda rng, n: 2.0 * rng.integers(-1, 2, (MANY, n, n)),
    "no diagonal": lambda rng, n: 2.0 * rng.integers(-1, 2, (MANY, n, n)) * (1 - np.eye(n)),
    "paths": paths,
    "permutations": lambda rng, n: np.stack([np.eye(n)[rng.permutation(n)] for _ in range(MANY)]),
    "scaled rows": lambda rng, n: rng.normal(size=(MANY, n, n)) * 10.0 ** rng.uniform(-20, 0, (MANY, n, 1)),
    "one above noise": lambda rng, n: 10.0 ** rng.uniform(-25, -10, (MANY, n, n)) + np.diag(np.eye(n)[0]),
}


@all_cases("n", [2, 5, 9])
@all_cases("kind", EXACT)
def test_pivots_that_vanish(kind: str, n: int) -> None:
    """Shifts that are eigenvalues of leading rows, exactly or to rounding, leave pivots of 0."""
    a = EXACT[kind](np.random.default_rng(n), n)
    a = a + np.swapaxes(a, 1, 2)
    a = a[np.abs(a).max((1, 2)) > 0]
    values, vectors, converged = matrices.eigenvectors(a)
    own, other = errors(a, values, vectors), errors(a, *np.linalg.eigh(a))
    assert converged.all() and own[0] <= 2 * max(other[0], 2e-16 * n) and own[1] <= 2 * max(other[1], 2e-16 * n)


@all_cases("rows, columns", [(1, 1), (2, 2), (3, 3), (9, 9), (20, 5), (4, 7)])
@all_cases("spectrum", SPECTRA)
def test_singular_vectors_are_as_accurate_as_those_of_lapack(spectrum: str, rows: int, columns: int) -> None:
    rng, few = np.random.default_rng(rows), min(rows, columns)
    values = SPECTRA[spectrum](rng, few)
    a = (bases(rng, rows)[:, :, :few] * values[:, None, :]) @ np.swapaxes(bases(rng, columns)[:, :, :few], 1, 2)
    found, vectors, converged = matrices.singular_vectors(a)
    assert converged.all() and (np.diff(found) <= 0).all()
    wanted = np.zeros((MANY, columns))
    wanted[:, :few] = np.linalg.svd(a)[1]  # Without vectors, LAPACK's errors are larger.
    size = norms(a)
    assert (np.abs(found - wanted).max(1) <= 4e-15 * size).all()
    assert norms(np.swapaxes(vectors, 1, 2) @ vectors - np.eye(columns)).max() <= 1e-15 * (columns + 4)
    images = np.linalg.norm(a / size[:, None, None] @ vectors, axis=1)
    assert np.abs(images - found / size[:, None]).max() <= 4e-15


@all_cases("rows, columns", [(9, 9), (8, 9), (50, 9), (3, 2)])
@all_cases("noise", [0, 1e-9, 1])
def test_null_vectors(rows: int, columns: int, noise: float) -> None:
    rng = np.random.default_rng(rows)
    a = rng.normal(size=(MANY, rows, columns)) * 10.0 ** np.arange(columns)
    x = rng.normal(size=(MANY, columns, 1))
    a[:, :, -1:] -= (1 - noise) * (a @ x) / x[:, -1:]
    vector, second, last = matrices.null_vector(a)
    _, values, right = np.linalg.svd(a)
    values = np.concatenate([values, np.zeros((MANY, columns - values.shape[1]))], 1)
    own = np.linalg.norm(a @ vector[..., None], axis=(1, 2))
    assert (own <= values[:, -1] + 2e-15 * values[:, 0]).all()
    assert np.abs(np.linalg.norm(vector, axis=1) - 1).max() < 2e-15
    assert np.abs(second - values[:, -2] / values[:, 0]).max() < 4e-15
    assert np.abs(last - values[:, -1] / values[:, 0]).max() < 4e-15
    error = 1 - np.abs((vector * right[:, -1]).sum(1))
    assert (error <= 1e-14 + (1e-14 * values[:, 0] / (values[:, -2] - values[:, -1])) ** 2).all()


@pytest.mark.parametrize("name", ["eigenvectors", "null_vector"])
def test_batches_equal_single_matrices_bit_for_bit(name: str) -> None:
    """Matrices of a block need different numbers of steps; those that need none are among them."""
    a = np.concatenate([symmetric("normal", 6)[:9], symmetric("none", 6)[:5], symmetric("graded", 6)[:9]])
    function = getattr(matrices, name)
    together = function(a)
    for k, matrix in enumerate(a):
        for one, many in zip(function(matrix), together, strict=True):
            assert np.array_equal(one, many[k])


@pytest.mark.slow  # The module is compiled for single precision.
def test_single_precision() -> None:
    a = symmetric("graded", 9).astype(np.float32)
    values, vectors, converged = matrices.eigenvectors(a)
    assert values.dtype == np.float32 and converged.all()
    other_values, other_vectors = zip(*(scipy.linalg.eigh(matrix, driver="ev") for matrix in a), strict=True)
    assert other_values[0].dtype == np.float32
    other = errors(a.astype(float), np.array(other_values, float), np.array(other_vectors, float))
    own = errors(a.astype(float), values.astype(float), vectors.astype(float))
    assert own[0] <= 2 * other[0] and own[1] <= 2 * other[1]


def test_numbers_that_are_not_finite_are_reported() -> None:
    a = symmetric("normal", 5)[:3]
    a[1, 2, 3] = a[1, 3, 2] = np.nan
    assert matrices.eigenvectors(a)[2].tolist() == matrices.singular_vectors(a)[2].tolist() == [1, 0, 1]
    assert np.all(matrices.null_vector(a)[1] > 0) == (matrices.null_vector(a)[1][1] > 0)


@kernel(matrix=array(SCALAR, 3, 3), returns=(array(SCALAR, 3), array(SCALAR, 3, 3)))
def three(matrix: Any) -> Any:
    """The closed form for three rows."""
    return three_singular_vectors(matrix)


@all_cases("spectrum", [*SPECTRA, "far apart"])
def test_three_singular_vectors(spectrum: str) -> None:
    rng = np.random.default_rng(3)
    values = np.tile([1, 1e-9, 1e-10], (MANY, 1)) if spectrum == "far apart" else SPECTRA[spectrum](rng, 3)
    a = (bases(rng, 3) * values[:, None, :]) @ bases(rng, 3)
    found, vectors = gacompiler.compile(three, backend="arrays", effort=0)(a)
    size = norms(a)
    assert (np.abs(found - np.linalg.svd(a, compute_uv=False)).max(1) <= 2e-15 * size).all()
    assert norms(np.swapaxes(vectors, 1, 2) @ vectors - np.eye(3)).max() <= 4e-15
    images = a / size[:, None, None] @ vectors
    off = np.swapaxes(images, 1, 2) @ images - np.eye(3) * (images**2).sum(1)[:, None, :]
    assert np.abs(off).max() <= 2e-15
    assert (np.diff(found) <= 2e-15 * size[:, None]).all()


# Roots.


def coefficients(roots: Any) -> Reals:
    with mpmath.workdps(60):
        found = [mpmath.mpf(1)]
        for root in roots:
            r = mpmath.mpmathify(root)
            found = [a - r * b for a, b in zip([*found, 0], [0, *found], strict=True)]
        return np.array([float(mpmath.re(c)) for c in found[1:]])


def distance(found: Reals, wanted: Any) -> float:
    """The largest distance of the roots from others, each matched with one."""
    left, worst = list(found), 0.0
    for root in wanted:
        k = int(np.argmin(np.abs(np.array(left) - root)))
        worst = max(worst, abs(left.pop(k) - root))
    return worst


@all_cases(
    "roots, n_real, bound",
    [
        ([5.0], 1, 0),
        ([1, 2, 3], 3, 1e-14),
        ([1j, -1j, 2], 1, 1e-15),
        ([1e-6, 1, 1e6], 3, 1e-9),
        ([0, 0, 1, 2], 4, 1e-15),
        ([0, 0, 0], 3, 0),
        ([3, 3, 3 + 1e-3j, 3 - 1e-3j, 3 + 1], None, 1e-2),
        (list(range(1, 11)), 10, 1e-8),
        (list(np.exp(2j * np.pi * np.arange(16) / 16)), 2, 1e-14),
        (list(np.cos(np.pi * (np.arange(16) + 0.5) / 16)), 16, 1e-11),
    ],
)
def test_roots(roots: Any, n_real: int | None, bound: float) -> None:
    real, imaginary, found_real, converged = matrices.polynomial_roots(coefficients(roots))
    assert converged and distance(real + 1j * imaginary, roots) <= bound
    assert n_real is None or found_real == n_real
    assert (imaginary == 0).sum() == found_real


@pytest.mark.slow
def test_roots_are_as_accurate_as_their_condition_allows() -> None:
    """Errors are at most a small multiple of those from rounding the coefficients, with mpmath's roots as the truth."""
    c = np.random.default_rng(4).normal(size=(20, 9)) * 10.0 ** np.random.default_rng(5).integers(-3, 4, (20, 9))
    real, imaginary, n_real, converged = matrices.polynomial_roots(c)
    assert converged.all()
    for k in range(len(c)):
        with mpmath.workdps(40):
            wanted = [complex(z) for z in mpmath.polyroots([1, *map(float, c[k])], maxsteps=500, extraprec=400)]
        own = np.array(real[k] + 1j * imaginary[k])
        for z in wanted:
            powers = np.abs(z) ** np.arange(9, -1, -1)
            slope = abs(np.polyval(np.polyder([1, *c[k]]), z))
            condition = (np.abs([1, *c[k]]) * powers).sum() / slope
            assert np.abs(own - z).min() <= 2e-15 * 9 * condition
        assert n_real[k] == sum(abs(z.imag) < 1e-12 * abs(z) for z in wanted)


@kernel(matrix=array(SCALAR, "n", "n"))
def spectrum(matrix: Any) -> Any:
    """The eigenvalues only."""
    return eigenvalues(matrix)[0]


@pytest.mark.slow
def test_derivatives_of_eigenvalues() -> None:
    rng = np.random.default_rng(6)
    a, change = rng.normal(size=(2, 4, 4))
    a, change = a + a.T, change + change.T
    values, derivatives = gacompiler.compile(jvp(spectrum, "matrix"), backend="arrays")(a, change)
    wanted, vectors = np.linalg.eigh(a)
    assert np.abs(values - wanted).max() < 4e-15
    assert np.abs(derivatives - (vectors * (change @ vectors)).sum(0)).max() < 1e-13


@pytest.mark.parametrize("shape", [(), (7,)])
def test_derivatives_of_a_solution(shape: tuple[int, ...]) -> None:
    """The solution of ``(a + x b) v = r + x c`` changes at x = 0 as a quotient of differences says."""
    rng = np.random.default_rng(5)
    a, right = rng.normal(size=(*shape, 4, 4)) + 4 * np.eye(4), rng.normal(size=(*shape, 4, 1))
    b, c = rng.normal(size=(2, *shape, 4, 4)), rng.normal(size=(2, *shape, 4, 1))
    v, step = np.linalg.solve(a, right), 1e-6
    found = matrices.derivatives_of_solution(np.linalg.inv(a), b[0] @ v - c[0], b[1] @ v - c[1])
    for k, one in enumerate(found):
        ahead = np.linalg.solve(a + step * b[k], right + step * c[k])
        behind = np.linalg.solve(a - step * b[k], right - step * c[k])
        assert np.abs(one - (ahead - behind) / (2 * step)).max() < 1e-8
