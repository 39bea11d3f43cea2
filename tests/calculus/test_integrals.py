"""Integrals over simplicial meshes, against closed forms, exact moments, scipy's hulls and the fundamental theorem."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import product as every
from math import factorial, prod

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from algorithms.calculus import (
    SimplicialMesh,
    box_mesh,
    cauchy_in_plane,
    cauchy_integral,
    circulation,
    directed_integral,
    embed,
    flux,
    integral,
    product_of,
    residues_in_plane,
    simplex_rule,
)
from tests.support.all_cases import all_cases

Polynomial = Callable[[np.ndarray], np.ndarray]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(8)


def crooked(n: int, rng: np.random.Generator, cells: int = 2) -> SimplicialMesh:
    """A box with all its points moved by an invertible map."""
    mesh = box_mesh((cells,) * n, np.ones(n))
    turn = np.eye(n) + 0.2 * rng.normal(size=(n, n))
    if np.linalg.det(turn) < 0:
        turn[0] = -turn[0]
    return SimplicialMesh(mesh.points @ turn.T + 0.03 * rng.uniform(-1, 1, mesh.points.shape), mesh.cells)


def cubic(n: int, size: int, rng: np.random.Generator) -> tuple[Polynomial, Polynomial]:
    """A polynomial field of degree 3 and its partial derivatives, ``(..., n, size)``."""
    powers = np.array([p for p in every(range(4), repeat=n) if sum(p) <= 3])
    coefficients = rng.normal(size=(len(powers), size))

    def value(x: np.ndarray) -> np.ndarray:
        return np.prod(x[..., None, :] ** powers, -1) @ coefficients

    def partial(x: np.ndarray) -> np.ndarray:
        parts = []
        for i in range(n):
            lower = powers.copy()
            lower[:, i] = np.maximum(lower[:, i] - 1, 0)
            parts.append((np.prod(x[..., None, :] ** lower, -1) * powers[:, i]) @ coefficients)
        return np.stack(parts, -2)

    return value, partial


@all_cases("dimension", range(5))
def test_rules_integrate_monomials(dimension: int) -> None:
    """The mean of a product of barycentric coordinates is ``d! prod(p!) / (d + sum(p))!`` (Dirichlet)."""
    for degree in range(6 if dimension < 4 else 4):
        points, weights = simplex_rule(dimension, degree)
        assert (weights > 0).all() and (points >= 0).all()
        np.testing.assert_allclose(points.sum(1), 1, atol=1e-15)
        for powers in every(range(degree + 1), repeat=dimension + 1):
            if sum(powers) <= degree:
                top = factorial(dimension) * prod(factorial(p) for p in powers)
                exact = Fraction(top, factorial(dimension + sum(powers)))
                assert np.prod(points**powers, -1) @ weights == pytest.approx(float(exact), abs=1e-15)


def test_contents_are_those_of_hulls_and_of_cayley_and_menger(rng: np.random.Generator) -> None:
    for n in (2, 3, 4):
        points = rng.normal(size=(30, n))
        mesh = SimplicialMesh(points, Delaunay(points).simplices.astype(int))
        hull = ConvexHull(points)
        assert mesh.contents().sum() == pytest.approx(hull.volume, rel=1e-12)
        whole = mesh.oriented()
        assert whole.measures().sum() == pytest.approx(hull.volume, rel=1e-12)
        assert whole.boundary().contents().sum() == pytest.approx(hull.area, rel=1e-12)
    corners = rng.normal(size=(4, 6))
    squared = ((corners[:, None] - corners) ** 2).sum(-1)
    bordered = np.block([[np.zeros((1, 1)), np.ones((1, 4))], [np.ones((4, 1)), squared]])
    cayley_menger = np.sqrt(np.linalg.det(bordered) / 8) / 6
    assert SimplicialMesh(corners, [[0, 1, 2, 3]]).contents() == pytest.approx(cayley_menger, rel=1e-12)


@all_cases("n", [2, 3, 4, 5])
def test_a_boundary_has_no_boundary(n: int, rng: np.random.Generator) -> None:
    cells = np.array([rng.permutation(9)[: n + 1] for _ in range(12)])
    mesh = SimplicialMesh(rng.normal(size=(9, n)), cells, rng.integers(-3, 4, 12))
    facets, first = mesh.boundary_matrix()
    second = SimplicialMesh(mesh.points, facets).boundary_matrix()[1]
    assert not (second @ first).toarray().any()
    assert len(mesh.boundary().boundary().cells) == 0
    # the directed measure of a closed surface vanishes
    np.testing.assert_allclose(mesh.boundary().measures().sum(0), 0, atol=1e-12)


def test_boundaries_are_outward() -> None:
    triangle = SimplicialMesh([[0, 0], [1, 0], [0, 1.0]], [[0, 1, 2]])
    boundary = triangle.boundary()
    signed_cells = zip(boundary.cells.tolist(), boundary.weights.tolist(), strict=True)
    assert sorted(signed_cells) == [([0, 1], 1), ([0, 2], -1), ([1, 2], 1)]
    tetrahedron = SimplicialMesh(np.concatenate([np.zeros((1, 3)), np.eye(3)]), [[0, 1, 2, 3]]).boundary()
    slanted = tetrahedron.cells.tolist().index([1, 2, 3])
    # e12 e13 e23: the face opposite the origin has the normal (1, 1, 1)
    np.testing.assert_allclose(tetrahedron.measures()[slanted], [0.5, -0.5, 0.5])
    ends = SimplicialMesh([[0.0], [2.0]], [[0, 1]]).boundary()
    assert ends.cells.ravel().tolist() == [0, 1] and ends.weights.tolist() == [-1, 1]


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_the_fundamental_theorem(n: int, rng: np.random.Generator) -> None:
    mesh, product = crooked(n, rng, 2 if n < 4 else 1), product_of(n)
    value, partial = cubic(n, 1 << n, rng)
    left, left_partial = cubic(n, 1 << n, rng)
    axes = embed(np.eye(n), n, 1)

    def derivative(x: np.ndarray) -> np.ndarray:
        return np.sum(product(axes, partial(x)), -2)

    boundary = mesh.boundary()
    sign = (-1) ** (n - 1)
    one, other = directed_integral(boundary, value, 3), sign * directed_integral(mesh, derivative, 2)
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * max(1, np.abs(one).max()))
    # with fields on both sides: the derivative acts on both
    both = directed_integral(boundary, value, 6, left)
    right = sign * directed_integral(mesh, derivative, 5, left)
    x_left = np.zeros(1 << n)
    for axis in range(n):
        # (d_i G) e_i dX F
        def turned(x: np.ndarray, axis: int = axis) -> np.ndarray:
            return np.asarray(product(left_partial(x)[..., axis, :], axes[axis]))

        x_left = x_left + directed_integral(mesh, value, 5, turned)
    np.testing.assert_allclose(both, right + x_left, rtol=0, atol=2e-12 * max(1, np.abs(both).max()))


def test_divergence_on_tetrahedra(rng: np.random.Generator) -> None:
    mesh = crooked(3, rng, 3)
    value, partial = cubic(3, 3, rng)
    divergence = integral(mesh, lambda x: np.trace(partial(x), axis1=-2, axis2=-1), 2)
    assert flux(mesh.boundary(), value, 3) == pytest.approx(float(divergence), abs=1e-12)
    assert flux(mesh.boundary(), lambda x: x, 1) == pytest.approx(3 * mesh.contents().sum(), rel=1e-13)
    square = box_mesh((2, 2), (2, 3))
    assert flux(square.boundary(), lambda x: x, 1) == pytest.approx(12, rel=1e-14)


def test_stokes_on_a_surface_in_space(rng: np.random.Generator) -> None:
    flat = box_mesh((4, 4), (1, 1))
    height = np.sin(3 * flat.points[:, :1]) * flat.points[:, 1:]
    surface = SimplicialMesh(np.concatenate([flat.points, height], 1), flat.cells)
    value, partial = cubic(3, 3, rng)

    def curl(x: np.ndarray) -> np.ndarray:
        d = partial(x)
        return np.stack([d[..., 1, 2] - d[..., 2, 1], d[..., 2, 0] - d[..., 0, 2], d[..., 0, 1] - d[..., 1, 0]], -1)

    around = circulation(surface.boundary(), value, 3)
    assert around == pytest.approx(flux(surface, curl, 2), abs=1e-12)
    assert abs(around) > 0.1
    # a circle: its area twice, as closed polygons have it
    t = np.linspace(0, 2 * np.pi, 50, endpoint=False)
    around = np.stack([np.arange(50), (np.arange(50) + 1) % 50], -1)
    circle = SimplicialMesh(np.stack([np.cos(t), np.sin(t)], -1), around)
    turned = circulation(circle, lambda x: np.stack([-x[..., 1], x[..., 0]], -1), 1)
    assert turned == pytest.approx(50 * np.sin(2 * np.pi / 50), rel=1e-13)


def test_integrals_converge_on_a_sphere() -> None:
    """Embedded surfaces: area 4 pi, and directed area 0, of a sphere in space; both at second order."""
    errors = []
    for cells in (4, 8, 16):
        box = box_mesh((cells,) * 3, (2, 2, 2)).boundary()
        points = box.points - 1
        points = points / np.linalg.norm(points, axis=1, keepdims=True).clip(0.1)
        sphere = SimplicialMesh(points, box.cells, box.weights)
        errors.append(4 * np.pi - sphere.contents().sum())
        np.testing.assert_allclose(sphere.measures().sum(0), 0, atol=1e-13)
        volume = flux(sphere, lambda x: x / 3, 1)
        assert 0 < 4 * np.pi / 3 - volume < 2 * errors[-1]
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2, abs=0.1)


def test_derivatives_of_linear_fields_are_exact(rng: np.random.Generator) -> None:
    for n in (2, 3, 4):
        mesh, product = crooked(n, rng), product_of(n)
        slopes, constant = rng.normal(size=(n, 1 << n)), rng.normal(size=1 << n)
        values = mesh.points @ slopes + constant
        expected = product(embed(np.eye(n), n, 1), slopes).sum(0)
        for at in ("cells", "points"):
            found = mesh.vector_derivative(values, at)
            np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=1e-11)
        # D x = n
        np.testing.assert_allclose(
            mesh.vector_derivative(embed(mesh.points, n, 1))[:, 0], np.full(len(mesh.cells), n), atol=1e-11
        )


def test_a_derivative_is_the_integral_over_the_boundary_of_a_cell(rng: np.random.Generator) -> None:
    corners = rng.normal(size=(3, 3))
    triangle = SimplicialMesh(corners, [[0, 1, 2]])
    values = rng.normal(size=(3, 8))
    gradient = np.linalg.pinv(corners[1:] - corners[0]) @ (values[1:] - values[0])
    around = directed_integral(triangle.boundary(), lambda x: values[0] + (x - corners[0]) @ gradient, 1)
    found = product_of(3)(embed(triangle.measures(), 3, 2), triangle.vector_derivative(values))[0]
    np.testing.assert_allclose(-found, around, atol=1e-13)


def test_derivatives_on_triangles_are_of_first_order() -> None:
    errors = []
    for cells in (8, 16, 32):
        mesh = box_mesh((cells, cells), (1, 1))
        x, y = mesh.points.T
        field = embed(np.stack([np.sin(x) * y, np.cos(y + x)], -1), 2, 1)
        x, y = mesh.points[mesh.cells].mean(1).T
        divergence, curl = np.cos(x) * y - np.sin(y + x), -np.sin(y + x) - np.sin(x)
        found = mesh.vector_derivative(field)
        errors.append(np.abs(found[:, [0, 3]] - np.stack([divergence, curl], -1)).max())
    assert 0.9 < np.log2(errors[1] / errors[2]) < 2.1


def analytic(z: np.ndarray, order: int = 0) -> np.ndarray:
    """``exp(2 z) + z**3`` and its derivatives."""
    powers = [z**3, 3 * z**2, 6 * z, 6 + 0 * z, 0 * z]
    return 2.0**order * np.exp(2 * z) + powers[min(order, 4)]


def pairs(z: np.ndarray) -> np.ndarray:
    return np.stack([z.real, z.imag], -1)


def test_cauchy_in_the_plane() -> None:
    t = np.linspace(0, 2 * np.pi, 256, endpoint=False)
    for curve in (np.exp(1j * t), np.exp(-1j * t), (1.5 + 0.4 * np.cos(3 * t)) * np.exp(1j * t) - 0.2j):
        inside = np.array([0, 0.3 + 0.4j, -0.5j, 0.8, -0.85 + 0.1j])
        for order in range(5):
            found = cauchy_in_plane(pairs(curve), pairs(analytic(curve)), pairs(inside), order)
            np.testing.assert_allclose(found, pairs(analytic(inside, order)), atol=1e-10)
        assert np.isnan(cauchy_in_plane(pairs(curve), pairs(analytic(curve)), [[3.0, 0]])).all()


def test_residues_in_the_plane() -> None:
    t = np.linspace(0, 2 * np.pi, 256, endpoint=False)
    circle = np.exp(1j * t)
    poles, strengths = np.array([0.8, -0.3 + 0.5j, 0.1j]), np.array([1.0, 2 - 1j, -0.5j])
    simple = (strengths / (circle[:, None] - poles)).sum(1)
    double = np.exp(3 * circle) / (circle - 0.4) ** 2  # exp has the residue 3 exp(1.2) there
    for values, known in (
        (simple, strengths.sum()),
        (double, 3 * np.exp(1.2)),
        (analytic(circle), 0.0),
        (1 / np.tan(2 * circle), 0.5),
        (1 / (circle - 3), 0.0),
    ):
        np.testing.assert_allclose(residues_in_plane(pairs(circle), pairs(values)), pairs(np.array(known)), atol=1e-10)
        back = residues_in_plane(pairs(circle[::-1]), pairs(values[::-1]))
        np.testing.assert_allclose(back, -pairs(np.array(known)), atol=1e-10)
    with pytest.raises(ValueError, match=r"curve, values: .*expected \(N, 2\) both, N from 3"):
        residues_in_plane(pairs(circle), pairs(circle[:9]))


def test_cauchy_in_space(rng: np.random.Generator) -> None:
    """Gradients of harmonic polynomials, also multiplied by constants from the right."""
    for n, degree in ((2, 24), (3, 16)):
        surface = box_mesh((2,) * n, np.ones(n)).boundary()
        traceless = np.diag(np.arange(n) - (n - 1) / 2) + np.eye(n)[::-1] - np.diag(np.diag(np.eye(n)[::-1]))
        constant = rng.normal(size=1 << n)

        def monogenic(x: np.ndarray, map_: np.ndarray = traceless, right: np.ndarray = constant) -> np.ndarray:
            n = len(map_)
            return np.asarray(product_of(n)(embed(x @ map_, n, 1), right))

        places = 0.5 + 0.15 * rng.uniform(-1, 1, (6, n))
        found = cauchy_integral(surface, monogenic, places, degree)
        np.testing.assert_allclose(found, monogenic(places), atol=1e-8)
        np.testing.assert_allclose(cauchy_integral(surface, monogenic, np.full(n, 2.0), degree), 0, atol=1e-8)


def test_wrong_arguments_are_rejected() -> None:
    points = np.eye(3)
    with pytest.raises(ValueError, match="cells: index 0 or 3; expected 0 to 2"):
        SimplicialMesh(points, [[0, 1, 3]])
    with pytest.raises(ValueError, match="cells: 0 has a point twice"):
        SimplicialMesh(points, [[0, 1, 1]])
    with pytest.raises(ValueError, match="a mesh of points"):
        SimplicialMesh(points, [[0]]).boundary_matrix()
    mesh = SimplicialMesh(points, [[0, 1, 2]])
    with pytest.raises(ValueError, match=r"field: values of shape \(1, 1, 2\); expected \(1, 1, 3\)"):
        flux(mesh, lambda x: x[..., :2], 0)
    with pytest.raises(ValueError, match="dimension 2; expected 1, a curve"):
        circulation(mesh, lambda x: x, 0)
    with pytest.raises(ValueError, match="surface: it has a boundary"):
        cauchy_integral(mesh, lambda x: np.zeros((*x.shape[:-1], 8)), np.zeros(3), 2)
    with pytest.raises(ValueError, match="cells of dimension 2 in space of 3"):
        mesh.oriented()
    with pytest.raises(ValueError, match="cell 0 is flat"):
        SimplicialMesh([[0.0, 0], [1, 1], [2, 2]], [[0, 1, 2]]).vector_derivative(np.zeros((3, 4)))
    with pytest.raises(ValueError, match="field: infinite values"):
        integral(mesh, lambda x: np.full(x.shape[:-1], np.inf), 1)
    with pytest.raises(ValueError, match="degree: -1"):
        simplex_rule(2, -1)
