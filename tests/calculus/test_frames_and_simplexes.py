"""Reciprocal frames, barycentric coordinates and facets, against numpy's inverses and scipy's hulls."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from algorithms.calculus import (
    LinearFunction,
    LinearStatus,
    SimplicialMesh,
    barycentric_coordinates,
    facets,
    reciprocal_frame,
)
from algorithms.subspaces import Blade, outer_product
from tests.support.all_cases import all_cases


@all_cases("k, n", [(1, 1), (1, 3), (2, 3), (3, 3), (2, 5), (4, 6), (8, 8), (3, 12)])
def test_reciprocal_frames(k: int, n: int) -> None:
    rng = np.random.default_rng(k)
    frame = rng.normal(size=(40, k, n)) * 10.0 ** rng.uniform(-9, 9, (40, k, 1))
    found = reciprocal_frame(frame)
    assert (found.status == LinearStatus.OK).all()
    units = frame / np.linalg.norm(frame, axis=-1, keepdims=True)
    lengths = np.linalg.norm(frame, axis=-1)[:, None, :]
    products = found.vectors @ np.swapaxes(frame, -1, -2)
    scaled = products * np.swapaxes(lengths, -1, -2) / lengths
    assert (np.abs(scaled - np.eye(k)).max((1, 2)) < 2e-15 * n * np.linalg.cond(units)).all()
    truth = np.swapaxes(np.linalg.pinv(units), -1, -2) / np.swapaxes(lengths, -1, -2)
    error = np.abs((found.vectors - truth) * np.swapaxes(lengths, -1, -2)).max((1, 2))
    assert (error < 1e-14 * np.linalg.cond(units) ** 2).all()


@pytest.mark.parametrize("squares", [(1, 1, -1), (1, -1, -1, -1), (1, 1, 1, 1, -1)])
def test_other_metrics(squares: tuple[int, ...]) -> None:
    n = len(squares)
    rng = np.random.default_rng(n)
    for k in (2, n):
        frame = rng.normal(size=(30, k, n))
        for gram in (squares, np.diag(squares)):
            found = reciprocal_frame(frame, gram).vectors
            products = found @ np.diag(squares) @ np.swapaxes(frame, -1, -2)
            size = np.linalg.norm(found, axis=(1, 2)) * np.linalg.norm(frame, axis=(1, 2))
            assert (np.abs(products - np.eye(k)).max((1, 2)) < 1e-14 * size * np.linalg.cond(frame)).all()
            projected = found @ np.linalg.pinv(frame) @ frame
            assert np.allclose(projected, found, 0, 1e-10 * np.abs(found).max()), "they are in the span of the frame"


def test_ill_conditioned_frames_lose_no_digit_twice() -> None:
    """Solving with the matrix of inner products would be wrong in all digits here."""
    frame = np.array([[1.0, 0, 0], [1, 1e-9, 0]])
    np.testing.assert_allclose(reciprocal_frame(frame).vectors, [[1, -1e9, 0], [0, 1e9, 0]], 1e-6)


def test_frames_without_a_reciprocal() -> None:
    cases = [[[1.0, 2, 3], [2, 4, 6]], [[0.0, 0, 0], [1, 0, 0]], [[np.nan, 0, 0], [1, 0, 0]], [[1.0, 0, 0], [0, 1, 0]]]
    found = reciprocal_frame(cases)
    assert found.status.tolist() == [1, 1, 1, 0] and np.isnan(found.vectors[:3]).all()
    null = reciprocal_frame([[1.0, 1]], [1, -1])
    assert null.status == LinearStatus.SINGULAR and np.isnan(null.vectors).all()
    assert reciprocal_frame(np.empty((0, 2, 3))).vectors.shape == (0, 2, 3)
    np.testing.assert_allclose(reciprocal_frame([[1e300, 0.0], [0, 1e-300]]).vectors, [[1e-300, 0], [0, 1e300]])
    with pytest.raises(ValueError, match="k from 1 to n"):
        reciprocal_frame(np.ones((3, 2)))


@all_cases("k, n", [(1, 1), (1, 3), (2, 2), (2, 3), (3, 3), (3, 5), (5, 5)])
def test_barycentric_coordinates(k: int, n: int) -> None:
    rng = np.random.default_rng(k)
    simplex = rng.normal(size=(25, k + 1, n)) * 1e3 + 1e5
    weights = rng.normal(size=(25, k + 1))
    weights[:, 0] += 1 - weights.sum(-1)
    points = (weights[..., None] * simplex).sum(1)
    found = barycentric_coordinates(simplex, points)
    np.testing.assert_allclose(found, weights, 0, 1e-7)
    np.testing.assert_allclose(found.sum(-1), 1, 0, 1e-12)
    if k < n:
        edges = simplex[:, 1:] - simplex[:, :1]
        off = rng.normal(size=(25, n))
        flat = np.swapaxes(edges, 1, 2)
        off -= (flat @ np.linalg.pinv(flat) @ off[..., None])[..., 0]
        np.testing.assert_allclose(barycentric_coordinates(simplex, points + 1e3 * off), weights, 0, 1e-6)


def test_barycentric_coordinates_agree_with_scipy_on_the_simplex() -> None:
    rng = np.random.default_rng(5)
    mesh = Delaunay(rng.normal(size=(60, 3)))
    points = rng.normal(size=(200, 3)) / 2
    where = mesh.find_simplex(points)
    inside = barycentric_coordinates(mesh.points[mesh.simplices][None], points[:, None]).min(-1) > 0
    assert (np.argmax(inside, 1)[where >= 0] == where[where >= 0]).all() and not inside[where < 0].any()


@all_cases("k, n", [(1, 1), (1, 2), (2, 2), (2, 3), (3, 3), (3, 4), (4, 4)])
def test_facets(k: int, n: int) -> None:
    rng = np.random.default_rng(10 + k)
    simplex = rng.normal(size=(20, k + 1, n))
    found = facets(simplex)
    np.testing.assert_allclose(found.measures.sum(1), 0, 0, 1e-14)
    np.testing.assert_allclose((found.contents[..., None] * found.normals).sum(1), 0, 0, 1e-10)
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=-1), 1, 0, 1e-14)
    volume = SimplicialMesh(simplex.reshape(-1, n), np.arange(20 * (k + 1)).reshape(20, -1)).contents()
    np.testing.assert_allclose(found.heights * found.contents / k, volume[:, None] * np.ones(k + 1), 1e-9)
    for i in range(k + 1):
        kept = np.delete(simplex, i, axis=1)
        np.testing.assert_array_equal(found.corners[:, i], kept)
        away = ((kept - simplex[:, i : i + 1]) * found.normals[:, i : i + 1]).sum(-1)
        np.testing.assert_allclose(away, found.heights[:, i : i + 1] * np.ones(k), 1e-9)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_facets_are_those_of_qhull(n: int) -> None:
    simplex = np.random.default_rng(n).normal(size=(n + 1, n))
    found, hull = facets(simplex), ConvexHull(simplex)
    for corners, equation in zip(hull.simplices, hull.equations, strict=True):
        (i,) = set(range(n + 1)) - set(corners.tolist())
        np.testing.assert_allclose(found.normals[i], equation[:-1], 0, 1e-12)
    assert np.isclose(found.contents.sum(), hull.area)
    assert np.isclose((found.heights * found.contents)[0] / n, hull.volume)


def test_facets_have_the_orientation_of_their_measures() -> None:
    """The measure of a facet, from outside, together with the outward normal has the orientation of the simplex."""
    simplex = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    found = facets(simplex)
    for normal, measure in zip(found.normals, found.measures, strict=True):
        assert outer_product(Blade(normal, 3, 1), Blade(measure, 3, 2)).coefficients > 0
    assert LinearFunction(simplex[1:]).matrix.shape == (3, 3)


def test_degenerate_simplexes() -> None:
    flat = np.array([[0.0, 0], [1, 1], [2, 2]])
    assert np.isnan(barycentric_coordinates(flat, [0.5, 0.5])).all()
    found = facets(flat)
    assert np.isnan(found.normals).all() and np.isnan(found.heights).all()
    np.testing.assert_allclose(found.contents, np.sqrt(2) * np.array([1, 2, 1]))
    assert barycentric_coordinates(np.ones((0, 3, 2)), np.ones((0, 2))).shape == (0, 3)
    for wrong in (np.ones((4, 2)), np.ones((1, 2)), np.ones(3)):
        with pytest.raises(ValueError, match="simplex: shape"):
            facets(wrong)


def as_float32(value: Any) -> Any:
    return np.asarray(value, np.float32)


def test_single_precision_and_read_only_arrays() -> None:
    simplex = as_float32([[0, 0], [1, 0], [0, 1]])
    simplex.setflags(write=False)
    np.testing.assert_allclose(barycentric_coordinates(simplex, as_float32([0.25, 0.25])), [0.5, 0.25, 0.25])
