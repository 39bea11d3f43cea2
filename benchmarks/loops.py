"""Compare kernels over arrays of several axes with the same loops written by hand for numba, and with numpy."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np

from gacompiler import (
    SCALAR,
    array,
    compile,
    each,
    equal,
    fold,
    kernel,
    minimum,
    pick,
    row_numbers,
    select,
    total,
    transpose,
)

from . import pages
from .machine import version
from .markdown import paragraph
from .timing import FULL, QUICK, Effort, median_times

PAGE = Path("docs/loop-speed.md")
N, M = array(SCALAR, "n"), array(SCALAR, "m")
CLOSE = 1e-9
"""Largest relative difference of results, which are computed in different orders: 1e-16 for each of 1e6 operations."""


@dataclass(frozen=True, slots=True)
class Task:
    """A computation in three implementations, and arguments for them."""

    title: str
    ours: Callable[..., Any]
    by_hand: Callable[..., Any]
    in_numpy: Callable[..., Any]
    arguments: tuple[Any, ...]


def _product(a: Any, b: Any) -> Any:
    return each(lambda row: each(lambda other: total(lambda x, y: x * y, row, other), b), a)


def _solved(a: Any, b: Any) -> Any:
    numbers = row_numbers(a)

    def step(equations: Any, k: Any) -> Any:
        matrix, right = equations
        pivots, own = pick(matrix, k, 0), pick(right, k, 0)
        pivot = pick(pivots, k, 0)

        def eliminated(row: Any, values: Any, i: Any) -> Any:
            factor = select(equal(i, k), 0, pick(row, k, 0) / pivot)

            def reduced(x: Any, y: Any) -> Any:
                return select(equal(i, k), x / pivot, x - factor * y)

            return each(reduced, row, pivots), each(reduced, values, own)

        return each(eliminated, matrix, right, numbers)

    return fold(step, (a, b), numbers)[1]


@kernel(x=N, p=array(SCALAR, "n", "n"), h=array(SCALAR, "m", "n"), r=array(SCALAR, "m", "m"), z=M)
def kalman(x: Any, p: Any, h: Any, r: Any, z: Any) -> Any:
    """The mean and the covariance after a measurement."""
    moved = _product(h, p)
    innovation = each(lambda a, b: each(lambda u, v: u + v, a, b), _product(moved, h), r)
    gain = _solved(innovation, moved)
    residual = each(lambda row, value: value - total(lambda u, v: u * v, row, x), h, z)
    mean = each(lambda column, a: a + total(lambda u, v: u * v, column, residual), transpose(gain), x)
    change = _product(transpose(moved), transpose(gain))
    return mean, each(lambda a, b: each(lambda u, v: u - v, a, b), p, change)


@numba.njit(cache=False, fastmath=False)
def _kalman_by_hand(x: Any, p: Any, h: Any, r: Any, z: Any) -> Any:
    n, m = len(x), len(z)
    moved, s = np.zeros((m, n)), r.copy()
    for i in range(m):
        for k in range(n):
            for j in range(n):
                moved[i, j] += h[i, k] * p[k, j]
    for i in range(m):
        for j in range(m):
            for k in range(n):
                s[i, j] += moved[i, k] * h[j, k]
    gain = moved.copy()
    for k in range(m):
        pivot = s[k, k]
        for j in range(m):
            s[k, j] /= pivot
        for j in range(n):
            gain[k, j] /= pivot
        for i in range(m):
            if i != k:
                factor = s[i, k]
                for j in range(m):
                    s[i, j] -= factor * s[k, j]
                for j in range(n):
                    gain[i, j] -= factor * gain[k, j]
    mean, covariance = x.copy(), p.copy()
    for i in range(m):
        residual = z[i]
        for k in range(n):
            residual -= h[i, k] * x[k]
        for j in range(n):
            mean[j] += gain[i, j] * residual
    for k in range(m):
        for i in range(n):
            for j in range(n):
                covariance[i, j] -= moved[k, i] * gain[k, j]
    return mean, covariance


def _kalman_in_numpy(x: Any, p: Any, h: Any, r: Any, z: Any) -> Any:
    moved = h @ p
    gain = np.linalg.solve(moved @ h.T + r, moved)
    return x + (z - h @ x) @ gain, p - moved.T @ gain


def _score(line: Any, point: Any, limit: Any) -> Any:
    distance = line[0] * point[0] + line[1] * point[1] + line[2]
    return minimum(distance * distance, limit)


@kernel(models=array(SCALAR, "m", 3), points=array(SCALAR, "n", 2), limit=SCALAR)
def best_line(models: Any, points: Any, limit: Any) -> Any:
    """The line with the smallest truncated sum of squared distances, and that sum."""

    def scored(best: Any, line: Any) -> Any:
        lowest, row, number = best
        found = fold(lambda s, p: s + _score(line, p, limit), 0, points, until=lambda s: s > lowest)
        is_better = found < lowest
        return select(is_better, found, lowest), select(is_better, number, row), number + 1

    lowest, row, _ = fold(scored, (1e300, -1, 0), models)
    return row, lowest


@numba.njit(cache=False, fastmath=False)
def _best_line_by_hand(models: Any, points: Any, limit: Any) -> Any:
    lowest, row = 1e300, -1
    for k in range(len(models)):
        a, b, c = models[k]
        found = 0.0
        for j in range(len(points)):
            distance = a * points[j, 0] + b * points[j, 1] + c
            found += min(distance * distance, limit)
        if found < lowest:
            lowest, row = found, k
    return row, lowest


def _best_line_in_numpy(models: Any, points: Any, limit: Any) -> Any:
    distances = points @ models[:, :2].T + models[:, 2]
    scores = np.minimum(distances**2, limit).sum(axis=0)
    row = scores.argmin()
    return row, scores[row]


def _squared(f: Any, pair: Any) -> Any:
    """Sampson's approximation of the squared distance of two points from the nearest ones of a fundamental matrix."""
    x, y, u, v = (pair[k] for k in range(4))
    a, b, c = (f[k] * x + f[k + 1] * y + f[k + 2] for k in (0, 3, 6))
    d, e = (f[k] * u + f[k + 3] * v + f[k + 6] for k in (0, 1))
    r = u * a + v * b + c
    return r * r / (a * a + b * b + d * d + e * e)


@kernel(models=array(SCALAR, "m", 9), blocks=array(SCALAR, "n", "k", 4), limit=SCALAR)
def best_matrix(models: Any, blocks: Any, limit: Any) -> Any:
    """The matrix with the smallest truncated sum of Sampson's squared distances, and that sum.

    The pairs come in blocks, and one sum is kept for each place in a block. Therefore a block is computed in vectors,
    and the sums are compared with the smallest one once for each block.
    """
    zeros = each(lambda column: 0, transpose(blocks))

    def scored(best: Any, f: Any) -> Any:
        lowest, row, number = best

        def added(sums: Any, block: Any) -> Any:
            return each(lambda s, p: s + minimum(_squared(f, p), limit), sums, block)

        found = total(lambda s: s, fold(added, zeros, blocks, until=lambda sums: total(lambda s: s, sums) > lowest))
        is_better = found < lowest
        return select(is_better, found, lowest), select(is_better, number, row), number + 1

    lowest, row, _ = fold(scored, (1e300, -1, 0), models)
    return row, lowest


def _best_matrix_of_pairs(scored: Callable[..., Any], models: Any, pairs: Any, limit: Any) -> Any:
    """Return the best matrix for pairs in blocks of 20."""
    return scored(models, pairs.reshape(-1, 20, 4), limit)


@kernel(f=array(SCALAR, 9), pairs=array(SCALAR, "n", 4, shared=True), limit=SCALAR)
def score(f: Any, pairs: Any, limit: Any) -> Any:
    """The truncated sum of Sampson's squared distances."""
    return total(lambda p: minimum(_squared(f, p), limit), pairs)


@numba.njit(cache=False, fastmath=False)
def _best_matrix_by_hand(models: Any, pairs: Any, limit: Any) -> Any:
    lowest, row = 1e300, -1
    for k in range(len(models)):
        f, found = models[k], 0.0
        for j in range(len(pairs)):
            x, y, u, v = pairs[j]
            a, b, c = f[0] * x + f[1] * y + f[2], f[3] * x + f[4] * y + f[5], f[6] * x + f[7] * y + f[8]
            d, e = f[0] * u + f[3] * v + f[6], f[1] * u + f[4] * v + f[7]
            r = u * a + v * b + c
            found += min(r * r / (a * a + b * b + d * d + e * e), limit)
        if found < lowest:
            lowest, row = found, k
    return row, lowest


def _best_matrix_in_numpy(models: Any, pairs: Any, limit: Any) -> Any:
    first, second = (np.column_stack([part, np.ones(len(pairs))]) for part in (pairs[:, :2], pairs[:, 2:]))
    f = models.reshape(-1, 3, 3)
    lines, others = f @ first.T, np.swapaxes(f, 1, 2) @ second.T
    r = (lines * second.T).sum(1)
    sizes = (lines[:, :2] ** 2).sum(1) + (others[:, :2] ** 2).sum(1)
    scores = np.minimum(r * r / sizes, limit).sum(1)
    row = scores.argmin()
    return row, scores[row]


def _pairs_and_models(rng: np.random.Generator) -> tuple[Any, ...]:
    """Return 1,000 essential matrices, 500 pairs of points, 200 of them wrong, and the square of the largest distance.

    Nearly .6**7 of the matrices are close to that of the pairs, as if each came from seven random pairs.
    """

    def essential() -> Any:
        turn, t = np.linalg.qr(np.eye(3) + 0.2 * rng.normal(size=(3, 3)))[0], rng.normal(size=3)
        return np.cross(np.eye(3), t / np.linalg.norm(t)) @ turn, turn, t / np.linalg.norm(t)

    true, turn, t = essential()
    points = np.column_stack([rng.uniform(-2, 2, (500, 2)), rng.uniform(4, 8, 500)])
    moved = points @ turn.T + t
    pairs = np.column_stack([points[:, :2] / points[:, 2:], moved[:, :2] / moved[:, 2:]])
    pairs += rng.normal(0, 1e-3, (500, 4))
    pairs[:200, 2:] = rng.uniform(-0.5, 0.5, (200, 2))
    pairs = np.ascontiguousarray(rng.permutation(pairs))
    near = rng.random(1000) < 0.6**7
    models = [true + rng.normal(0, 3e-3, (3, 3)) if is_near else essential()[0] for is_near in near]
    return np.ascontiguousarray(np.reshape(models, (1000, 9))), pairs, 3e-3**2


@kernel(c=N, x=SCALAR)
def horner(c: Any, x: Any) -> Any:
    """The value of a polynomial."""
    return fold(lambda value, coefficient: value * x + coefficient, 0, c)


@numba.njit(cache=False, fastmath=False)
def _horner_by_hand(c: Any, x: Any) -> Any:
    value = 0.0
    for k in range(len(c)):
        value = value * x + c[k]
    return value


def _best_of_batch(scored: Callable[..., Any], models: Any, pairs: Any, limit: Any) -> Any:
    """Return the row of the least score of a batch, and that score."""
    scores = scored(models, pairs, limit)
    row = scores.argmin()
    return row, scores[row]


def tasks() -> list[Task]:
    """Return the computations on random numbers of a fixed seed."""
    rng = np.random.default_rng(0)
    found = []
    for n, m in ((12, 6), (4, 2)):
        half, noise, h, x, z = (rng.normal(size=shape) for shape in [(n, n), (m, m), (m, n), (n,), (m,)])
        given: tuple[Any, ...] = (x, half @ half.T + np.eye(n), h, noise @ noise.T + np.eye(m), z)
        title = f"Kalman step, {n} states, {m} measured numbers"
        found.append(Task(title, compile(kalman), _kalman_by_hand, _kalman_in_numpy, given))
    models = rng.normal(size=(1000, 3))
    models[:, :2] /= np.hypot(models[:, 0], models[:, 1])[:, None]
    along = rng.uniform(-1, 1, (500, 1)) * [[models[300, 1], -models[300, 0]]] - models[300, 2] * models[300, :2]
    points = along + rng.normal(0, 0.01, (500, 2))
    given = (models, points, 0.05**2)
    title = "scores of 1,000 lines on 500 points; only the kernel ends early"
    found.append(Task(title, compile(best_line), _best_line_by_hand, _best_line_in_numpy, given))
    given = _pairs_and_models(rng)
    found += [
        Task(
            "scores of 1,000 fundamental matrices on 500 pairs (Sampson); only the kernel ends early, by blocks of 20",
            partial(_best_matrix_of_pairs, compile(best_matrix)),
            _best_matrix_by_hand,
            _best_matrix_in_numpy,
            given,
        ),
        Task(
            "the same scores as a batch, without an early end",
            partial(_best_of_batch, compile(score)),
            _best_matrix_by_hand,
            _best_matrix_in_numpy,
            given,
        ),
    ]
    coefficients = rng.normal(size=201)
    title = "Horner's scheme of degree 200"
    found.append(Task(title, compile(horner), _horner_by_hand, np.polyval, (coefficients, 0.99)))
    return found


def measure(task: Task, effort: Effort) -> str:
    """Return the row of a task.

    Raises
    ------
    RuntimeError
        If the implementations give different results.
    """
    calls = {"ours": task.ours, "by hand": task.by_hand, "numpy": task.in_numpy}
    results = [_numbers(call(*task.arguments)) for call in calls.values()]
    for result in results[1:]:
        if not np.allclose(result, results[0], rtol=CLOSE, atol=CLOSE):
            raise RuntimeError(f"{task.title}: the implementations give different results")
    times = median_times({name: partial(call, *task.arguments) for name, call in calls.items()}, effort)
    cells = [f"{1e6 * times[name]:.2f}" for name in calls]
    ratios = [f"{times['ours'] / times[name]:.2f}" for name in ("by hand", "numpy")]
    return f"| {task.title} | {' | '.join(cells)} | {' | '.join(ratios)} |"


def _numbers(result: Any) -> Any:
    """Return all numbers of the results of a call in one array."""
    parts = result if isinstance(result, tuple) else (result,)
    return np.concatenate([np.ravel(part) for part in parts])


def page(rows: list[str]) -> str:
    """Return the text of the page."""
    lines = [
        "# Kernels over several axes: times",
        "",
        paragraph(
            f"`python -m benchmarks loops` writes this page; numba {version('numba')}, numpy {version('numpy')}.",
            "Microseconds of one call on doubles and one thread: medians of repeated runs, measured alternately.",
            "The ratios are the time of the kernel divided by that of the loops written by hand for numba, and by that "
            "of numpy.",
        ),
        "",
        "| | kernel | by hand | numpy | ratio | to numpy |",
        "|---|---:|---:|---:|---:|---:|",
        *rows,
    ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("loops", __doc__, PAGE).parse_args(arguments)
    effort = QUICK if options.quick else FULL
    return pages.publish("loops", options.out, page([measure(task, effort) for task in tasks()]), "6 rows")


if __name__ == "__main__":
    sys.exit(main())
