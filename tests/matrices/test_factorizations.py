"""Factorizations of matrices in kernels: in exact arithmetic, beside LAPACK, and for matrices without one."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest
from exact_runs import run_exactly

import gacompiler
from gacompiler import SCALAR, array, jvp, kernel, matrices, total
from gacompiler.ir.procedure import Procedure
from gacompiler.passes.loops import compile_loops
from tests.support.all_cases import all_cases

SQUARE, MATRIX, VECTOR = array(SCALAR, "n", "n"), array(SCALAR, "n", "m"), array(SCALAR, "n")


@kernel(a=MATRIX, b=array(SCALAR, "m", "k"), x=array(SCALAR, "m"))
def products(a: Any, b: Any, x: Any) -> Any:
    """Products of matrices and vectors."""
    return matrices.product(a, b), matrices.times(a, x), matrices.gram(a), matrices.identity(a)


@kernel(a=SQUARE, b=VECTOR)
def triangular(a: Any, b: Any) -> Any:
    """Solutions of triangular equations."""
    return matrices.solve_lower(a, b), matrices.solve_upper(a, b)


@kernel(a=SQUARE)
def ldlt(a: Any) -> Any:
    """A factorization without roots."""
    return matrices.ldlt(a)


@kernel(a=SQUARE, b=VECTOR)
def positive(a: Any, b: Any) -> Any:
    """A factorization, and the solution of equations."""
    lower, failed = matrices.cholesky(a)
    return lower, failed, *matrices.solve_positive(a, b)


@kernel(a=MATRIX, b=VECTOR)
def orthogonal(a: Any, b: Any) -> Any:
    """A factorization, and the solution of least squares."""
    return *matrices.qr(a), *matrices.least_squares(a, b)


@kernel(a=SQUARE)
def determinant(a: Any) -> Any:
    """The determinant."""
    return matrices.determinant(a)


@cache
def procedure_of(definition: Any) -> Procedure:
    return compile_loops(definition, effort=0).procedure


def run(definition: Any, **given: Any) -> list[np.ndarray[Any, Any]]:
    """Compile a kernel, which proves it, and interpret it in the arithmetic of the arguments."""
    return run_exactly(procedure_of(definition), given)


def floats(results: list[np.ndarray[Any, Any]]) -> list[np.ndarray[Any, Any]]:
    return [result.astype(float) for result in results]


def fractions(seed: int, *shape: int) -> np.ndarray[Any, Any]:
    numbers = np.random.default_rng(seed).integers(-9, 10, shape)
    return np.vectorize(Fraction, otypes=[object])(numbers)


def normal(seed: int, *shape: int) -> np.ndarray[Any, Any]:
    return np.random.default_rng(seed).normal(size=shape)


def exact_determinant(a: np.ndarray[Any, Any]) -> Fraction:
    """Leibniz' sum by expansion along the first row."""
    if len(a) == 1:
        return Fraction(a[0, 0])
    minors = (np.delete(np.delete(a, 0, 0), k, 1) for k in range(len(a)))
    return sum(((-1) ** k * a[0, k] * exact_determinant(m) for k, m in enumerate(minors)), Fraction(0))


def test_products_are_exact() -> None:
    a, b, x = fractions(1, 3, 4), fractions(2, 4, 2), fractions(3, 4)
    found = run(products, a=a, b=b, x=x)
    for one, other in zip(found, (a @ b, a @ x, a.T @ a, np.eye(3, dtype=int)), strict=True):
        assert np.array_equal(one, other)


@pytest.mark.parametrize("n", [1, 2, 5])
def test_triangular_equations_are_solved_exactly(n: int) -> None:
    a, b = fractions(n, n, n) + 20 * np.eye(n, dtype=int), fractions(n + 9, n)
    lower, upper = run(triangular, a=a, b=b)
    assert np.array_equal(np.tril(a) @ lower, b) and np.array_equal(np.triu(a) @ upper, b)


@pytest.mark.parametrize("n", [1, 3, 5])
def test_the_factorization_without_roots_is_exact(n: int) -> None:
    half = fractions(n, n, n)
    a = half + half.T + 5 * np.eye(n, dtype=int)  # Not definite.
    lower, pivots, failed = run(ldlt, a=a)
    assert failed == -1 and np.array_equal(lower @ np.diag(pivots) @ lower.T, a)
    assert np.array_equal(np.triu(lower), np.eye(n, dtype=int))


@pytest.mark.parametrize(("entries", "row"), [([[0, 1], [1, 0]], 0), ([[1, 2], [2, 4]], 1), ([[1, 2], [2, 5]], -1)])
def test_a_pivot_of_zero_is_reported(entries: list[list[int]], row: int) -> None:
    assert run(ldlt, a=np.vectorize(Fraction, otypes=[object])(entries))[2] == row


@pytest.mark.parametrize("n", [1, 4, 9])
def test_positive_definite_matrices(n: int) -> None:
    half, b = normal(n, n + 2, n), normal(n + 1, n)
    a = half.T @ half
    lower, failed, solution, also = floats(run(positive, a=a, b=b))
    assert failed == also == -1
    assert np.abs(lower - np.linalg.cholesky(a)).max() < 1e-13 * np.abs(lower).max()
    assert np.abs(a @ solution - b).max() <= 1e-15 * n * np.linalg.norm(a) * np.linalg.norm(solution)


@all_cases("row", range(4))
def test_the_first_pivot_that_is_not_positive_is_reported(row: int) -> None:
    half = normal(row, 6, 4)
    a = half.T @ half
    a[row, row] = -1
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(a)
    assert run(positive, a=a, b=np.ones(4))[1] == row


@pytest.mark.parametrize(("n", "m"), [(1, 1), (6, 3), (3, 5), (7, 7)])
def test_reflections(n: int, m: int) -> None:
    a, b = normal(n, n, m), normal(m, n)
    q, r, solution, failed = floats(run(orthogonal, a=a, b=b))
    assert np.abs(q @ r - a).max() < 4e-15 and np.abs(q.T @ q - np.eye(n)).max() < 4e-15
    assert np.array_equal(r, np.triu(r))
    if n >= m:
        wanted = np.linalg.lstsq(a, b, rcond=None)[0]
        assert failed == -1 and np.abs(solution - wanted).max() < 1e-12 * np.abs(wanted).max()


@all_cases("scales", [(1, 1, 1), (1e-12, 1, 1e12)])
@all_cases("column", [0, 1, 2, -1])
def test_dependent_columns_are_reported_at_any_scale(column: int, scales: tuple[float, ...]) -> None:
    a = normal(7, 6, 3)
    if column >= 0:
        a[:, column] = a[:, :column] @ np.arange(1.0, column + 1)
    assert run(orthogonal, a=a * scales, b=np.ones(6))[3] == column


def test_columns_that_are_nearly_dependent_are_not_reported() -> None:
    a = normal(7, 6, 3)
    a[:, 2] = a[:, 0] + 1e-13 * a[:, 2]
    assert run(orthogonal, a=a, b=np.ones(6))[3] == -1


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_determinants(n: int) -> None:
    a = fractions(n, n, n)
    wanted = exact_determinant(a)
    found = float(run(determinant, a=a.astype(float))[0])
    assert abs(found - wanted) < 1e-14 * float(np.prod(np.linalg.norm(a.astype(float), axis=1)))
    if n > 1:
        a[1] = a[0] * 2
        assert abs(float(run(determinant, a=a.astype(float))[0])) < 1e-14 * np.prod(
            np.linalg.norm(a.astype(float), axis=1)
        )
        upper = np.triu(fractions(n + 50, n, n)).astype(float)  # Without anything to reflect.
        assert float(run(determinant, a=upper)[0]) == pytest.approx(np.prod(np.diag(upper)), rel=1e-14)


@pytest.mark.slow
def test_the_derivative_of_the_determinant() -> None:
    """Jacobi's formula, det A tr(A^-1 dA)."""
    a, da = normal(1, 4, 4), normal(2, 4, 4)
    value, change = gacompiler.compile(jvp(determinant, "a"), backend="arrays")(a, da)
    assert change == pytest.approx(value * np.trace(np.linalg.solve(a, da)), rel=1e-12)


@pytest.mark.slow
def test_the_gradient_of_a_solution() -> None:
    @kernel(a=SQUARE, b=VECTOR)
    def energy(a: Any, b: Any) -> Any:
        solution, _ = matrices.solve_positive(a, b)
        return total(lambda x, y: x * y, solution, b)

    half, b = normal(1, 6, 4), normal(2, 4)
    a = half.T @ half
    run_it: Callable[..., Any] = gacompiler.compile(gacompiler.vjp(energy, "b"), backend="arrays")
    _, gradient = run_it(a, b, 1.0)
    assert np.allclose(gradient, 2 * np.linalg.solve(a, b), rtol=1e-12)


def test_matrices_of_known_size_are_unrolled() -> None:
    """The same functions give a kernel without loops, with the result of the kernel with loops."""

    @kernel(a=array(SCALAR, 3, 3), b=array(SCALAR, 3), returns=array(SCALAR, 3))
    def solved(a: Any, b: Any) -> Any:
        return matrices.entries(matrices.solve_positive(matrices.fixed(a), matrices.fixed(b))[0])

    run = gacompiler.compile(solved, "arrays", effort=0)
    assert run.signature == "(3,3),(3)->(3)"
    rows = np.random.default_rng(3).normal(size=(5, 3))
    a, b = rows.T @ rows, np.array([1.0, -2, 3])
    assert np.abs(run(a, b) - np.linalg.solve(a, b)).max() < 1e-13
