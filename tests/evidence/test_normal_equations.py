"""Sparse normal equations beside dense ones of numpy: narrow bands, wide graphs, held parameters, and their inverse."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from algorithms.arguments import Reals
from algorithms.evidence.normal_equations import NormalEquations, Parts, blocks_of_inverse
from algorithms.evidence.sparse_factors import factorized, factorized_band, least_directions


def graph(n: int, pairs: Reals, seed: int) -> tuple[list[Reals], Reals, Parts]:
    """Nodes of two and three parameters, of which some are held, with parts of one node and of two."""
    rng = np.random.default_rng(seed)
    sizes = rng.integers(2, 4, n)
    nodes = np.repeat(np.arange(n), sizes)
    starts = np.cumsum(sizes) - sizes
    first = starts[:, None] + np.arange(2)
    held = rng.random(n) < 0.2
    nodes_of_free = nodes[~held[nodes]]
    number = np.where(held[nodes], -1, np.cumsum(~held[nodes]) - 1)
    tables = [number[first], number[np.concatenate([first[pairs[:, 0]], first[pairs[:, 1]]], 1)]]
    last = np.flatnonzero(sizes == 3)
    tables.append(number[(starts + sizes - 1)[last]][:, None])
    parts = []
    for table in tables:
        rows = rng.normal(size=(len(table), 4, table.shape[1]))
        weights = rng.uniform(0.5, 2, len(table))
        parts.append((rng.normal(size=(len(table), 4)), rows, weights[:, None, None] * rows))
    return tables, nodes_of_free, parts


def dense(tables: list[Reals], parts: Parts, n: int) -> tuple[Reals, Reals]:
    matrix, gradient = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
    for table, (rest, rows, weighed) in zip(tables, parts, strict=True):
        for place, r, a, b in zip(table, rest, rows, weighed, strict=True):
            matrix[np.ix_(place, place)] += a.T @ b
            gradient[place] += b.T @ r
    return matrix[:-1, :-1], gradient[:-1]


CHAIN = np.column_stack([np.arange(39), np.arange(1, 40)])
PAIRS = np.random.default_rng(0).permutation(40 * 39)[:120]
WIDE = np.column_stack([PAIRS // 39, PAIRS % 39])
WIDE = WIDE[WIDE[:, 0] != WIDE[:, 1]]


@pytest.mark.parametrize(("pairs", "is_band"), [(CHAIN, True), (WIDE, False)])
def test_steps_are_those_of_dense_equations(pairs: Reals, is_band: bool) -> None:
    tables, nodes, parts = graph(40, pairs, 1)
    equations = NormalEquations(tables, nodes)
    n = len(nodes)
    matrix, gradient = dense(tables, parts, n)
    assert (equations._width is not None) == is_band
    assert np.allclose(equations.gradient(parts), gradient, rtol=1e-12)
    assert np.allclose(equations.diagonal(parts), np.diag(matrix), rtol=1e-12)
    sparse = np.asarray(equations.matrix(parts).todense())
    assert np.allclose(sparse, matrix[np.ix_(equations.order, equations.order)], rtol=1e-12, atol=1e-12)
    damped = matrix + np.diag(0.1 * np.diag(matrix) + 0.01)
    step = equations.step(parts, 0.1, False, 0.01)
    assert step is not None and np.allclose(step, -np.linalg.solve(damped, gradient), rtol=1e-9)
    doubled = [(2 * rest, rows, weighed) for rest, rows, weighed in parts]
    again = equations.step(doubled, 0.1, True)
    assert again is not None and np.allclose(again, 2 * step, rtol=1e-12)
    factor = equations.factor(parts)
    places = np.array([[0, 1, -1], [n - 1, 4, 2]])
    assert factor is not None
    found, inverse = blocks_of_inverse(factor, places, n), np.linalg.inv(matrix)
    assert np.allclose(found[1], inverse[np.ix_(places[1], places[1])], rtol=1e-9)
    assert np.allclose(found[0, :2, :2], inverse[:2, :2], rtol=1e-9) and not found[0, 2].any()
    along = np.random.default_rng(2).normal(size=n)
    assert equations.change(parts, along) == pytest.approx(along @ matrix @ along, rel=1e-10)


def test_singular_equations_have_no_factors() -> None:
    assert NormalEquations([np.zeros((0, 2), int)], np.zeros(0, int)).step([], 0.0, False) is not None
    assert factorized(np.ones((2, 2)) - 2 * np.eye(2)) is None
    assert factorized(np.full((2, 2), np.nan)) is None
    assert factorized_band(np.asfortranarray([[1.0, 0.5], [1.0, 0.0]])) is None
    assert factorized_band(np.asfortranarray([[np.nan, 1.0]])) is None


def test_least_directions_are_eigenvectors() -> None:
    """Two eigenvalues far below the others, and one of a direction that is undetermined."""
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(40, 40)))[0]
    sizes = np.r_[0.0, 1e-6, 1e-5, np.linspace(0.5, 1, 37)]
    scale = np.random.default_rng(4).uniform(0.5, 2, 40)
    matrix = scipy.sparse.csc_array((turn * sizes) @ turn.T / np.outer(scale, scale))
    values, vectors = least_directions(matrix, scale, 1e-13)
    assert values[:3] == pytest.approx(sizes[:3], abs=1e-14, rel=1e-6)
    assert np.abs(vectors[:, :3].T @ turn[:, :3]) == pytest.approx(np.eye(3), abs=1e-6)
