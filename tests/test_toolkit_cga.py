"""The conformal toolkit of space against vector formulas: 1000 random cases each, and the degenerate ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from generated import cga3

N = 1000
X, Y, Z, O = np.eye(3)[0], np.eye(3)[1], np.eye(3)[2], np.zeros(3)  # noqa: E741


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(41)


def dot(a: Any, b: Any) -> Any:
    return np.sum(np.asarray(a) * b, -1)


def length(a: Any) -> Any:
    return np.linalg.norm(a, axis=-1)


def unit(a: Any) -> Any:
    return a / length(a)[..., None]


def close(found: Any, expected: Any, tolerance: float = 1e-10) -> None:
    np.testing.assert_allclose(found, np.broadcast_to(expected, np.shape(found)), rtol=tolerance, atol=tolerance)


def vectors(rng: np.random.Generator, n: int) -> Any:
    return rng.normal(size=(n, N, 3))


def point_to_line(x: Any, p: Any, d: Any) -> Any:
    """The vector from the foot on the line through p along the unit d."""
    return x - p - dot(x - p, d)[..., None] * d


def to_circle(x: Any, c: Any, n: Any, r: Any) -> Any:
    """Nearest point of the circle by centre, unit normal and radius."""
    flat = x - c - dot(x - c, n)[..., None] * n
    return c + r[..., None] * unit(flat)


def circles(rng: np.random.Generator) -> tuple[Any, Any, Any, Any]:
    c, n = vectors(rng, 2)
    n, r = unit(n), rng.uniform(0.2, 3, N)
    return c, n, r, cga3.circle_from_centre(c, 2 * n, r**2)


def pairs(rng: np.random.Generator) -> tuple[Any, Any, Any]:
    a, b = vectors(rng, 2)
    return a, b, cga3.point_pair_from_points(a, b)


def spheres(rng: np.random.Generator) -> tuple[Any, Any, Any]:
    (c,), r = vectors(rng, 1), rng.uniform(0.2, 3, N)
    return c, r, -1.5 * cga3.sphere_from_centre(c, r)


def lines(rng: np.random.Generator) -> tuple[Any, Any, Any]:
    p, d = vectors(rng, 2)
    return p, unit(d), cga3.line_from_point_direction(p, d)


def planes(rng: np.random.Generator) -> tuple[Any, Any, Any]:
    p, n = vectors(rng, 2)
    return p, unit(n), cga3.plane_from_point_normal(p, n)


def same_blade(found: Any, expected: Any, tolerance: float = 1e-9) -> None:
    """Up to a positive factor."""
    close(found / length(found)[..., None], expected / length(expected)[..., None], tolerance)


# Constructors and extractors


def test_flats_give_back_what_they_were_made_of(rng: np.random.Generator) -> None:
    a, b, c = vectors(rng, 3)
    close(cga3.point_from_flat_point(-3 * cga3.flat_point_from_point(a)), a)
    close(cga3.direction_from_points(a, b), b - a)
    d = b - a
    line = cga3.line_from_points(a, b)
    close(cga3.line_from_pluecker(d, np.cross(a, d)), line)
    close(cga3.line_direction(2 * line), unit(d))
    close(cga3.line_moment(line), np.cross(a, unit(d)))
    close(cga3.line_weight(line), length(d))
    close(cga3.line_support_point(line), a - dot(a, unit(d))[:, None] * unit(d), 1e-8)
    n = np.cross(b - a, c - a)
    plane = cga3.plane_from_points(a, b, c)
    others = cga3.plane_from_point_normal(c, n), cga3.plane_from_normal(n, dot(n, b)), cga3.join_point_line(c, line)
    for same in others:
        close(same, plane, 1e-9)
    close(cga3.plane_normal(5 * plane), unit(n), 1e-9)
    close(cga3.plane_distance(plane), dot(a, unit(n)), 1e-9)
    close(cga3.plane_weight(plane), length(n))
    close(cga3.plane_support_point(plane), dot(a, unit(n))[:, None] * unit(n), 1e-9)
    close(cga3.dual_plane_from_point_normal(a, n), cga3.dual_plane_from_normal(n, dot(a, n)))


def test_duals_and_their_inverses(rng: np.random.Generator) -> None:
    line, plane, sphere = lines(rng)[2], planes(rng)[2], spheres(rng)[2]
    circle, pair = circles(rng)[3], pairs(rng)[2]
    close(cga3.line_from_dual(cga3.line_polarity(line)), line, 0)
    close(cga3.plane_from_dual(cga3.plane_polarity(plane)), plane, 0)
    close(cga3.sphere_from_dual(cga3.sphere_polarity(sphere)), sphere, 0)
    close(cga3.circle_from_dual(cga3.circle_polarity(circle)), circle, 0)
    close(cga3.point_pair_from_dual(cga3.point_pair_polarity(pair)), pair, 0)
    p, q, n, m = vectors(rng, 4)
    meet = cga3.line_from_dual_planes(cga3.dual_plane_from_point_normal(p, n), cga3.dual_plane_from_point_normal(q, m))
    close(cga3.line_direction(meet), unit(np.cross(n, m)), 1e-9)
    point = cga3.line_support_point(meet)
    close(dot(point - p, n) / length(n), np.zeros(N), 1e-7)
    close(dot(point - q, m) / length(m), np.zeros(N), 1e-7)
    close(cga3.circle_from_line(line)[:, 4:], line, 0)
    close(cga3.circle_from_line(line)[:, :4], np.zeros((N, 4)), 0)
    close(cga3.sphere_from_plane(plane), np.c_[np.zeros(N), plane], 0)


@pytest.mark.parametrize("sign", [1, -1])
def test_rounds_give_back_centre_direction_and_squared_radius(rng: np.random.Generator, sign: int) -> None:
    c, n = vectors(rng, 2)
    r2 = sign * rng.uniform(0.1, 4, N)
    pair, circle = cga3.point_pair_from_centre(c, n, r2), cga3.circle_from_centre(c, n, r2)
    sphere = cga3.sphere_from_centre_radius_squared(c, r2)
    for name, x in (("point_pair", pair), ("circle", circle), ("sphere", sphere)):
        close(getattr(cga3, f"{name}_centre")(-2 * x), c)
        close(getattr(cga3, f"{name}_radius_squared")(-2 * x), r2)
        close(getattr(cga3, f"{name}_kind")(-2 * x), np.full(N, sign), 0)
    close(cga3.point_pair_direction(pair), unit(n))
    close(cga3.point_pair_weight(pair), length(n))
    close(cga3.circle_normal(circle), unit(n))
    close(cga3.circle_weight(circle), length(n))
    close(cga3.sphere_weight(-2 * sphere), np.full(N, -2.0))
    dual = cga3.dual_sphere_from_centre_radius_squared(c, r2)
    close(cga3.sphere_polarity(sphere), dual)
    for surround in (cga3.circle_surround_sphere(circle), cga3.point_pair_surround_sphere(pair)):
        close(surround, dual, 1e-9)
    close(cga3.dual_sphere_radius_squared(-3 * dual), r2)
    close(cga3.dual_sphere_kind(-3 * dual), np.full(N, sign), 0)
    close(cga3.point_pair_line(pair), cga3.line_from_point_direction(c, n))
    bisector = cga3.point_pair_bisector(pair)
    same_blade(bisector, cga3.dual_plane_from_point_normal(c, n))


def test_rounds_through_points(rng: np.random.Generator) -> None:
    a, b, c, d = vectors(rng, 4)
    pair, circle = cga3.point_pair_from_points(a, b), cga3.circle_from_points(a, b, c)
    close(pair, cga3.point_pair_from_centre((a + b) / 2, b - a, dot(b - a, b - a) / 4))
    close(cga3.join_point_pair_point(pair, c), circle)
    close(cga3.join_circle_point(circle, d), cga3.sphere_from_points(a, b, c, d))
    close(cga3.circle_normal(circle), unit(np.cross(b - a, c - a)), 1e-9)
    close(cga3.circle_weight(circle), length(np.cross(b - a, c - a)))
    close(cga3.sphere_through_point(a, b), cga3.sphere_from_centre(a, length(b - a)))
    volume = dot(np.cross(b - a, c - a), d - a)
    close(cga3.sphere_weight(cga3.sphere_from_points(a, b, c, d)), -volume)
    p, q = cga3.point_pair_points(pair)
    close(p, a, 1e-8)
    close(q, b, 1e-8)


def test_kinds_of_flat_and_null_rounds(rng: np.random.Generator) -> None:
    a, b, n = vectors(rng, 3)
    zero = np.zeros(N)
    close(cga3.point_pair_kind(cga3.tangent_from_point_direction(a, n)), zero, 0)
    close(cga3.circle_kind(cga3.tangent_from_point_normal(a, n)), zero, 0)
    close(cga3.sphere_kind(cga3.sphere_from_centre(a, 0.0)), zero, 0)
    close(cga3.dual_sphere_kind(cga3.embed_point(a)), zero, 0)
    close(cga3.sphere_kind(cga3.sphere_from_plane(cga3.plane_from_point_normal(a, n))), zero + 2, 0)
    close(cga3.circle_kind(cga3.circle_from_line(cga3.line_from_points(a, b))), zero + 2, 0)
    close(cga3.circle_kind(cga3.circle_from_points([0, 0, 1.0], [0, 0, 2.0], [0, 0, 3.0])), 2, 0)
    close(cga3.point_pair_kind([0, 0, 0, 0, 0, 0, *a[0], 1.0]), 2, 0)
    assert np.isnan(cga3.sphere_kind(np.full(5, np.nan)))


def test_tangents_touch(rng: np.random.Generator) -> None:
    c, n, r, circle = circles(rng)
    p = to_circle(vectors(rng, 1)[0], c, n, r)
    tangent = cga3.tangent_line_of_circle(circle, p)
    close(cga3.line_direction(tangent), unit(np.cross(n, p - c)), 1e-9)
    close(point_to_line(p, cga3.line_support_point(tangent), cga3.line_direction(tangent)), np.zeros((N, 3)), 1e-8)
    s = cga3.sphere_from_centre(c, r)
    plane = cga3.tangent_plane_of_sphere(s, p)
    close(np.abs(dot(cga3.plane_normal(plane), unit(p - c))), np.ones(N))
    close(dot(p, cga3.plane_normal(plane)), cga3.plane_distance(plane), 1e-9)
    x = vectors(rng, 1)[0]
    polar = cga3.polar_plane_of_sphere(x, 3 * cga3.sphere_polarity(s))
    close(polar[:, :3], x - c)
    close(polar[:, 3], r**2 + dot(x - c, c))


# Metrics


def test_distances_from_points(rng: np.random.Generator) -> None:
    x = vectors(rng, 1)[0]
    p, n, plane = planes(rng)
    close(cga3.distance_point_plane(x, plane), dot(x - p, n))
    close(cga3.reject_point_from_plane(x, plane), dot(x - p, n)[:, None] * n)
    close(cga3.project_point_on_plane(x, plane), x - dot(x - p, n)[:, None] * n)
    p, d, line = lines(rng)
    away = point_to_line(x, p, d)
    close(cga3.reject_point_from_line(x, line), away, 1e-8)
    close(cga3.project_point_on_line(x, line), x - away, 1e-8)
    close(cga3.reflect_point_in_line(x, line), x - 2 * away, 1e-8)
    c, r, sphere = spheres(rng)
    nearest = c + r[:, None] * unit(x - c)
    close(cga3.distance_point_sphere(x, sphere), length(x - c) - r)
    close(cga3.project_point_on_sphere(x, sphere), nearest)
    close(cga3.reject_point_from_sphere(x, sphere), x - nearest)
    c, n, r, circle = circles(rng)
    nearest = to_circle(x, c, n, r)
    close(cga3.distance_point_circle(x, circle), length(x - nearest))
    close(cga3.project_point_on_circle(x, circle), nearest, 1e-9)
    close(cga3.reject_point_from_circle(x, circle), x - nearest, 1e-9)
    a, b, pair = pairs(rng)
    one, two = length(x - a), length(x - b)
    found = cga3.distance_point_point_pair(x, pair)
    close(found[0], np.minimum(one, two))
    close(found[1], np.maximum(one, two))
    close(cga3.project_point_on_point_pair(x, pair), np.where((one <= two)[:, None], a, b), 1e-9)
    close(cga3.reflect_point_in_point(x, a), 2 * a - x)


def test_nearest_points_that_are_not_unique_are_not_numbers() -> None:
    circle, sphere = cga3.circle_from_centre(X, Z, 1.0), cga3.sphere_from_centre(X, 2.0)
    assert np.isnan(cga3.project_point_on_circle(X + 2 * Z, circle)).any()
    assert np.isnan(cga3.project_point_on_sphere(X, sphere)).any()
    close(cga3.distance_point_circle(X + 2 * Z, circle), np.sqrt(5))
    imaginary = cga3.circle_from_centre(X, Z, -1.0)
    assert np.isnan(cga3.distance_point_circle(O, imaginary))


def test_distances_of_point_pairs_to_all_else(rng: np.random.Generator) -> None:
    a, b, pair = pairs(rng)
    p, d, line = lines(rng)
    q, n, plane = planes(rng)
    c, r, sphere = spheres(rng)
    k, m, s, circle = circles(rng)
    for name, other, distance in (
        ("line", line, lambda x: length(point_to_line(x, p, d))),
        ("plane", plane, lambda x: np.abs(dot(x - q, n))),
        ("sphere", sphere, lambda x: np.abs(length(x - c) - r)),
        ("circle", circle, lambda x: length(x - to_circle(x, k, m, s))),
    ):
        near, far = getattr(cga3, f"distance_{name}_point_pair")(other, pair)
        both = np.stack([distance(a), distance(b)])
        close(near, both.min(0), 1e-8)
        close(far, both.max(0), 1e-8)
    e, f, two = pairs(rng)
    expected = np.min([length(x - y) for x in (a, b) for y in (e, f)], 0)
    close(cga3.distance_point_pairs(pair, two), expected, 1e-8)


def test_distances_of_lines(rng: np.random.Generator) -> None:
    (p, d, one), (q, e, two) = lines(rng), lines(rng)
    across = np.cross(d, e)
    close(cga3.distance_lines(one, two), np.abs(dot(q - p, unit(across))), 1e-8)
    near, other = cga3.closest_points_lines(one, two)
    close(point_to_line(near, p, d), np.zeros((N, 3)), 1e-7)
    close(point_to_line(other, q, e), np.zeros((N, 3)), 1e-7)
    good = length(across) > 0.01
    close(dot(near - other, d)[good], 0 * d[good, 0], 1e-7)
    close(dot(near - other, e)[good], 0 * d[good, 0], 1e-7)
    close(cga3.meet_lines(one, two), (near + other) / 2, 1e-7)
    parallel = cga3.line_from_point_direction(q, -2 * d)
    close(cga3.distance_lines(one, parallel), length(point_to_line(q, p, d)), 1e-8)
    near, other = cga3.closest_points_lines(one, parallel)
    close(length(near - other), length(point_to_line(q, p, d)), 1e-8)
    close(cga3.distance_lines(one, one), np.zeros(N), 1e-12)


def test_distances_that_are_intervals(rng: np.random.Generator) -> None:
    p, d, line = lines(rng)
    q, n, plane = planes(rng)
    c, r, sphere = spheres(rng)
    k, m, s, circle = circles(rng)
    zero = np.zeros(N)
    close(cga3.distance_line_sphere(line, sphere), np.maximum(0, length(point_to_line(c, p, d)) - r), 1e-9)
    close(cga3.distance_plane_sphere(plane, sphere), np.maximum(0, np.abs(dot(c - q, n)) - r), 1e-9)
    tilt = length(np.cross(m, n))
    close(cga3.distance_plane_circle(plane, circle), np.maximum(0, np.abs(dot(k - q, n)) - s * tilt), 1e-9)
    height, flat = dot(c - k, m), length(point_to_line(c, k, m))
    near, far = np.hypot(height, flat - s), np.hypot(height, flat + s)
    close(cga3.distance_circle_sphere(circle, sphere), np.maximum(0, np.maximum(near - r, r - far)), 1e-9)
    c2, r2, other = spheres(rng)
    gap = length(c - c2)
    close(cga3.distance_spheres(sphere, other), np.max([zero, gap - r - r2, np.abs(r - r2) - gap], 0), 1e-9)
    other_plane = cga3.plane_from_point_normal(c, -3 * n)
    close(cga3.distance_planes(plane, other_plane), np.abs(dot(c - q, n)), 1e-9)
    close(cga3.distance_planes(plane, cga3.plane_from_point_normal(c, d)), zero, 0)
    inside = cga3.line_from_point_direction(p, np.cross(n, d))
    close(cga3.distance_line_plane(inside, plane), dot(p - q, n), 1e-9)
    close(cga3.distance_line_plane(line, other_plane), zero, 0)
    on_plane, on_sphere = cga3.closest_points_plane_sphere(plane, sphere)
    close(on_plane, c - dot(c - q, n)[:, None] * n, 1e-9)
    close(on_sphere, c + r[:, None] * unit(on_plane - c), 1e-8)
    on_line, on_sphere = cga3.closest_points_line_sphere(line, sphere)
    close(on_line, c - point_to_line(c, p, d), 1e-8)
    close(on_sphere, c + r[:, None] * unit(on_line - c), 1e-7)
    first, second = cga3.closest_points_spheres(sphere, other)
    close(first, c + r[:, None] * unit(c2 - c), 1e-9)
    close(second, c2 + r2[:, None] * unit(c - c2), 1e-9)


def test_closest_points_of_lines_and_circles(rng: np.random.Generator) -> None:
    p, d, line = lines(rng)
    c, n, r, circle = circles(rng)
    on_line, on_circle = cga3.closest_points_line_circle(line, circle)
    close(point_to_line(on_line, p, d), np.zeros((N, 3)), 1e-8)
    close(to_circle(on_circle, c, n, r), on_circle, 1e-8)
    found = cga3.distance_points(on_line, on_circle)
    u = unit(np.cross(n, d))
    v = np.cross(n, u)
    angles = np.linspace(0, 2 * np.pi, 721)[:, None, None]
    around = c + r[:, None] * (np.cos(angles) * u + np.sin(angles) * v)
    distances = length(point_to_line(around, p, d))
    assert np.all(found <= distances.min(0) + 1e-9)
    for k in range(50):
        best = angles[distances[:, k].argmin(), 0, 0]

        def distance(t: float, k: int = k) -> Any:
            x = c[k] + r[k] * (np.cos(t) * u[k] + np.sin(t) * v[k])
            return length(point_to_line(x, p[k], d[k]))

        exact = minimize_scalar(distance, bounds=(best - 0.01, best + 0.01), method="bounded", options={"xatol": 1e-13})
        close(found[k], exact.fun, 1e-7)
    whole = cga3.circle_from_centre(O, Z, 4.0)
    for point, direction, expected in ((O, Z, 2.0), (3 * X, Z, 1.0), (3 * X, Y, 1.0), (X, Y, 0.0), (3 * Z, X, 3.0)):
        a, b = cga3.closest_points_line_circle(cga3.line_from_point_direction(point, direction), whole)
        close(length(a - b), expected, 1e-7)


def test_angles(rng: np.random.Generator) -> None:
    d, e = lines(rng), lines(rng)
    n, m = planes(rng), planes(rng)
    c, k = circles(rng), circles(rng)
    a, b, pair = pairs(rng)
    _, _, other = pairs(rng)
    close(cga3.angle_between_lines(d[2], e[2]), np.arccos(dot(d[1], e[1])), 1e-7)
    close(cga3.angle_between_planes(n[2], m[2]), np.arccos(dot(n[1], m[1])), 1e-7)
    close(cga3.angle_between_line_and_plane(d[2], n[2]), np.arcsin(dot(d[1], n[1])), 1e-7)
    close(cga3.angle_between_circles(c[3], k[3]), np.arccos(dot(c[1], k[1])), 1e-7)
    close(cga3.angle_between_circle_and_plane(c[3], n[2]), np.arccos(dot(c[1], n[1])), 1e-7)
    close(cga3.angle_between_line_and_circle(d[2], c[3]), np.arcsin(dot(d[1], c[1])), 1e-7)
    along = unit(b - a)
    close(cga3.angle_between_point_pairs(pair, pair), np.zeros(N), 1e-12)
    close(cga3.angle_between_point_pairs(pair, other), np.arccos(dot(along, cga3.point_pair_direction(other))), 1e-7)
    close(cga3.angle_between_point_pair_and_line(pair, d[2]), np.arccos(dot(along, d[1])), 1e-7)
    close(cga3.angle_between_point_pair_and_plane(pair, n[2]), np.arcsin(dot(along, n[1])), 1e-7)
    close(cga3.angle_between_point_pair_and_circle(pair, c[3]), np.arcsin(dot(along, c[1])), 1e-7)
    tiny = cga3.line_from_point_direction(X, X + 1e-9 * Y)
    close(cga3.angle_between_lines(cga3.line_from_point_direction(O, X), tiny), 1e-9, 1e-14)


def test_what_conformal_maps_keep(rng: np.random.Generator) -> None:
    c, k = vectors(rng, 2)
    r, s = rng.uniform(0.5, 3, (2, N))
    one, two = cga3.dual_sphere_from_centre(c, r), cga3.dual_sphere_from_centre(k, s)
    gap = dot(c - k, c - k)
    close(cga3.inversive_distance(one, two), (gap - r**2 - s**2) / (2 * r * s))
    meets = np.abs(gap - r**2 - s**2) < 2 * r * s
    angle = np.arccos(((r**2 + s**2 - gap) / (2 * r * s))[meets])
    close(cga3.angle_between_dual_spheres(one, two)[meets], angle, 1e-7)
    p, n, plane = planes(rng)
    dual = np.insert(-cga3.plane_polarity(plane), 3, 0, axis=-1)
    close(cga3.inversive_distance(one, dual), -dot(c - p, n) / r, 1e-9)
    v = random_versors(rng)
    for name, (x, y), move in (
        ("inversive_distance", (one, two), cga3.transform_vector),
        ("inversive_product_circles", (circles(rng)[3], circles(rng)[3]), cga3.transform_circle),
        ("inversive_product_point_pairs", (pairs(rng)[2], pairs(rng)[2]), cga3.transform_point_pair),
    ):
        before = getattr(cga3, name)(x, y)
        after = getattr(cga3, name)(move(v, x), move(v, y))
        close(after, before, 1e-6)
    t = np.linspace(0.3, 5, 4)
    a, b, e, f = (np.array([np.cos(x), np.sin(x), 0]) for x in t)
    ratio = (length(a - e) * length(b - f)) / (length(a - f) * length(b - e))
    found = cga3.inversive_product_point_pairs(cga3.point_pair_from_points(a, b), cga3.point_pair_from_points(e, f))
    close(abs(found), abs((1 + ratio) / (1 - ratio)), 1e-9)
    circle = cga3.circle_from_centre(O, Z, 1.0)
    for centre, radius, sine in ((O, 1.0, 0.0), (Z, np.sqrt(2.0), 0.0), (X, 1.0, np.sqrt(3) / 2), (2 * X, 1.0, 0.0)):
        sphere = cga3.dual_sphere_from_centre(centre, radius)
        close(cga3.conformal_sine_circle_sphere(circle, sphere), sine, 1e-7)


# Containment


def test_residuals_of_points(rng: np.random.Generator) -> None:
    a, b, c, d, e = vectors(rng, 5)
    close(cga3.collinearity(a, b, c), length(np.cross(b - a, c - a)))
    volume = dot(np.cross(b - a, c - a), d - a)
    close(cga3.coplanarity(a, b, c, d), volume)
    x, y, z = (length(a - b) * length(c - d), length(a - c) * length(b - d), length(a - d) * length(b - c))
    ptolemy = (x + y + z) * (-x + y + z) * (x - y + z) * (x + y - z)
    close(cga3.cocircularity(a, b, c, d), np.sqrt(ptolemy) / 4, 1e-8)
    sphere = cga3.sphere_from_points(a, b, c, d)
    power = dot(e - (m := cga3.sphere_centre(sphere)), e - m) - cga3.sphere_radius_squared(sphere)
    close(cga3.cosphericity(np.stack([a, b, c, d, e], 1)), volume * power / 2, 1e-6)
    centre, n, r, _ = circles(rng)
    four = [to_circle(x, centre, n, r) for x in (a, b, c, d)]
    close(cga3.cocircularity(*four), np.zeros(N), 1e-10)
    close(cga3.coplanarity(*four), np.zeros(N), 1e-10)
    close(cga3.cosphericity(np.stack([*four, e], 1)), np.zeros(N), 1e-10)
    t = rng.normal(size=N)[:, None]
    close(cga3.collinearity(a, b, a + t * (b - a)), np.zeros(N), 1e-7)
    assert cga3.coplanarity(O, X, Y, Z) == 1


def test_containment(rng: np.random.Generator) -> None:
    p, n, plane = planes(rng)
    q, d, line = lines(rng)
    sine, height = cga3.containment_line_in_plane(line, plane)
    close(sine, dot(d, n))
    close(height, dot(q - dot(q, d)[:, None] * d - p, n), 1e-8)
    inside = cga3.line_from_point_direction(p, np.cross(n, d))
    close(cga3.containment_line_in_plane(inside, plane), np.zeros((2, N)), 1e-8)
    k, m, s, circle = circles(rng)
    close(cga3.containment_circle_in_plane(circle, cga3.plane_from_point_normal(k, m)), np.zeros((2, N)), 1e-7)
    sine, height = cga3.containment_circle_in_plane(circle, plane)
    close(sine, length(np.cross(m, n)))
    close(height, dot(k - p, n))
    h = rng.normal(size=N)
    around = cga3.sphere_from_centre(k + h[:, None] * m, np.hypot(h, s))
    close(cga3.containment_circle_in_sphere(circle, around), np.zeros((2, N)), 1e-7)
    c, r, sphere = spheres(rng)
    aside, gap = cga3.containment_circle_in_sphere(circle, sphere)
    close(aside, length(point_to_line(c, k, m)), 1e-9)
    close(gap, r - np.hypot(s, dot(c - k, m)), 1e-9)


# Meets


def test_meets_lie_on_both(rng: np.random.Generator) -> None:
    (p, n, one), (q, m, two), (o, k, three) = planes(rng), planes(rng), planes(rng)
    point = cga3.meet_three_planes(one, two, three)
    distances = np.stack([dot(p, n), dot(q, m), dot(o, k)], -1)[..., None]
    close(point, np.linalg.solve(np.stack([n, m, k], 1), distances)[..., 0], 1e-7)
    c, u, r, circle = circles(rng)
    x, y = vectors(rng, 2)
    a, b = to_circle(x, c, u, r), to_circle(y, c, u, r)
    hits = cga3.point_pair_points(cga3.meet_line_circle(cga3.line_from_points(a, b), circle))
    for hit in hits:
        close(np.minimum(length(hit - a), length(hit - b)), np.zeros(N), 1e-5)
    e = vectors(rng, 1)[0]
    for third in (e, to_circle(e, (a + b) / 2, u, length(a - b) / 2 + 1)):
        pair = cga3.meet_circles(circle, cga3.circle_from_points(a, b, third))
        found = cga3.point_pair_points(pair)
        apart = np.minimum(length(found[0] - a), length(found[0] - b))
        close(np.median(apart), 0, 1e-9)
        assert np.mean(apart < 1e-5) > 0.98


def test_kinds_of_meets() -> None:
    def sphere(c: Any, r: float) -> Any:
        return cga3.sphere_from_centre(np.array(c, float), r)

    def circle(c: Any, n: Any, r: float) -> Any:
        return cga3.circle_from_centre(np.array(c, float), np.array(n, float), r * r)

    def line(p: Any, d: Any) -> Any:
        return cga3.line_from_point_direction(np.array(p, float), np.array(d, float))

    def plane(p: Any, n: Any) -> Any:
        return cga3.plane_from_point_normal(np.array(p, float), np.array(n, float))

    unit_sphere, flat, axis, ring = sphere(O, 1), plane(O, Z), line(O, Z), circle(O, Z, 1)
    table = [
        (cga3.meet_spheres_kind, unit_sphere,
         [(sphere(X, 1), 1), (sphere(2 * X, 1), 0), (sphere(X / 2, 0.5), 0), (sphere(3 * X, 1), -1),
          (sphere(X / 4, 0.5), -1), (sphere(O, 2), 2), (sphere(O, 1), 3)]),
        (cga3.meet_sphere_plane_kind, unit_sphere, [(plane(Z / 2, Z), 1), (plane(Z, Z), 0), (plane(-2 * Z, Z), -1)]),
        (cga3.meet_planes_kind, flat, [(plane(O, X), 1), (plane(Z, -Z), 2), (plane(X, -3 * Z), 3)]),
        (cga3.meet_line_plane_kind, axis, [(plane(Z, Z), 1), (plane(X, X), 2), (plane(O, X), 3)]),
        (cga3.meet_line_sphere_kind, axis, [(sphere(X / 2, 1), 1), (sphere(X, 1), 0), (sphere(2 * X, 1), -1)]),
        (cga3.meet_lines_kind, axis, [(line(Z, X), 1), (line(Y, X), -1), (line(X, -Z), 2), (line(3 * Z, -2 * Z), 3)]),
        (cga3.meet_circle_plane_kind, ring,
         [(plane(X / 2, X), 1), (plane(X, X), 0), (plane(2 * X, X), -1), (plane(Z, Z), 2), (plane(O, -Z), 3),
          (plane([1, 0, 0], [1, 0, 1]), 0)]),
        (cga3.meet_circle_sphere_kind, ring,
         [(sphere(X, 1), 1), (sphere(2 * X, 1), 0), (sphere(3 * X, 1), -1), (sphere(O, 2), 2), (sphere(O, 1), 3),
          (sphere(Z, np.sqrt(2)), 3)]),
        (cga3.meet_circles_kind, ring,
         [(circle(X, Z, 1), 1), (circle(2 * X, -Z, 1), 0), (circle(3 * X, Z, 1), -1), (circle(O, Z, 2), 2),
          (circle(O, -Z, 1), 3), (circle(O, X, 1), 1), (circle(2 * X, Y, 1), 0), (circle(X, Y, 1), -1),
          (circle(Z, Z, 1), -1), (circle(X + Z, X, 1), 0), (circle(3 * X, X, 1), -1),
          (circle([2, 0, 0], [0, 1, 1], 1), 0)]),
    ]  # fmt: skip
    for kind, first, rows in table:
        for second, expected in rows:
            assert kind(first, second) == expected, (kind, expected)
    found = {1: [line(X / 2, Y)], 0: [line(X, Y), line(X, Z)], -1: [line(2 * X, Y), line(O, Z), line(Z, X)]}
    for second, expected in ((second, kind) for kind, all_ in found.items() for second in all_):
        assert cga3.meet_line_circle_kind(second, ring) == expected
    assert cga3.meet_three_planes_kind(flat, plane(O, X), plane(O, Y)) == 1
    assert cga3.meet_three_planes_kind(flat, plane(O, X), plane(O, X + Z)) == 2


def test_kinds_of_moved_and_scaled_tangents(rng: np.random.Generator) -> None:
    c, n = vectors(rng, 2)
    n, (r, s) = unit(n), rng.uniform(0.2, 3, (2, N))
    scale, shift = 10 ** rng.uniform(-2, 2, N), vectors(rng, 1)[0]
    r, s, c = r * scale, s * scale, scale[:, None] * (c + shift)
    one = cga3.sphere_from_centre(c, r)
    zero = np.zeros(N)
    for gap in (r + s, np.abs(r - s)):
        close(cga3.meet_spheres_kind(one, cga3.sphere_from_centre(c + gap[:, None] * n, s)), zero, 0)
    touching = cga3.plane_from_point_normal(c + r[:, None] * n, n)
    close(cga3.meet_sphere_plane_kind(one, touching), zero, 0)
    side = unit(np.cross(n, shift))
    close(cga3.meet_line_sphere_kind(cga3.line_from_point_direction(c + r[:, None] * n, side), one), zero, 0)
    gap = 0.9 * (r + s)
    overlapping = cga3.sphere_from_centre(c + gap[:, None] * n, s)
    close(cga3.meet_spheres_kind(one, overlapping), np.where(gap > np.abs(r - s), 1, -1), 0)


# Rays


def test_first_hits_of_spheres_planes_and_triangles(rng: np.random.Generator) -> None:
    o, d, a, b, c = vectors(rng, 5)
    centre, r, sphere = spheres(rng)
    half_b, q = dot(d, o - centre), dot(o - centre, o - centre) - r**2
    discriminant = half_b**2 - dot(d, d) * q
    with np.errstate(invalid="ignore"):
        roots = np.stack([-half_b - np.sqrt(discriminant), -half_b + np.sqrt(discriminant)]) / dot(d, d)
        first = np.where(roots[0] >= 0, roots[0], np.where(roots[1] >= 0, roots[1], np.nan))
        t, point = cga3.ray_hits_sphere(o, d, sphere)
    close(t, first, 1e-8)
    close(point, o + first[:, None] * d, 1e-8)
    assert 0.1 < np.mean(np.isnan(t)) < 0.9
    p, n, plane = planes(rng)
    expected = dot(p - o, n) / dot(d, n)
    t, point = cga3.ray_hits_plane(o, d, plane)
    close(t, np.where(expected >= 0, expected, np.nan), 1e-7)
    t, point = cga3.ray_hits_triangle(o, d, a, b, c)
    weights = np.linalg.solve(np.stack([-d, b - a, c - a], -1), (o - a)[..., None])[..., 0]
    inside = (weights[:, 0] >= 0) & (weights[:, 1] >= 0) & (weights[:, 2] >= 0) & (weights[:, 1] + weights[:, 2] <= 1)
    close(t, np.where(inside, weights[:, 0], np.nan), 1e-7)
    assert np.any(inside)
    away = cga3.ray_hits_sphere(O, X, cga3.sphere_from_centre(-3 * X, 1.0))
    assert np.isnan(away[0]) and np.isnan(away[1]).all()
    close(cga3.ray_hits_sphere(O, X, cga3.sphere_from_centre(X / 2, 1.0))[0], 1.5)
    close(cga3.ray_hits_sphere(O, 2 * X, cga3.sphere_from_centre(3 * X + Y, 1.0))[0], 1.5)
    assert np.isnan(cga3.ray_hits_plane(O, X, cga3.plane_from_normal(Z, 1.0))[0])
    close(cga3.ray_hits_triangle(Z, -Z, O, X, Y)[1], O)
    assert np.isnan(cga3.ray_hits_triangle(Z, X, O, X, Y)[0])


# Reflections and versors


def invert(x: Any, c: Any, r: Any) -> Any:
    return c + (r**2 / dot(x - c, x - c))[..., None] * (x - c)


def test_inversions_and_reflections_are_those_of_points(rng: np.random.Generator) -> None:
    a, b, c, d, k = vectors(rng, 5)
    r = rng.uniform(0.5, 3, N)
    p, n, plane = planes(rng)
    s = 2 * cga3.dual_sphere_from_centre(k, r)
    mirror = np.insert(cga3.plane_polarity(plane), 3, 0, axis=-1)
    for dual, image in ((s, lambda x: invert(x, k, r)), (mirror, lambda x: x - 2 * dot(x - p, n)[:, None] * n)):
        w, x, y, z = (image(q) for q in (a, b, c, d))
        same_blade(cga3.invert_vector(-cga3.embed_point(a), dual), cga3.embed_point(w), 1e-7)
        pair, circle, sphere = cga3.point_pair_from_points, cga3.circle_from_points, cga3.sphere_from_points
        same_blade(cga3.invert_point_pair(pair(a, b), dual), pair(w, x), 1e-6)
        same_blade(cga3.invert_circle(circle(a, b, c), -dual), circle(w, x, y), 1e-5)
        same_blade(cga3.invert_sphere(sphere(a, b, c, d), dual), sphere(w, x, y, z), 1e-4)
    flat = cga3.plane_polarity(plane)
    same_blade(cga3.reflect_line(cga3.line_from_points(a, b), flat), cga3.line_from_points(w, x), 1e-7)
    same_blade(cga3.reflect_plane(cga3.plane_from_points(a, b, c), flat), cga3.plane_from_points(w, x, y), 1e-6)
    line = cga3.circle_from_line(cga3.line_from_points(a, b))
    through = cga3.invert_circle(line, s)
    close(cga3.circle_radius_squared(through), (r**2 / length(point_to_line(k, a, unit(b - a))) / 2) ** 2, 1e-5)
    centre, n, r, ring = circles(rng)
    on = to_circle(a, centre, n, r)
    close(cga3.reflect_point_in_circle(on, ring), on, 1e-7)
    height = rng.uniform(0.5, 4, N)[:, None]
    image = centre - (r[:, None] ** 2 / height) * n
    close(cga3.reflect_point_in_circle(centre + height * n, ring), image, 1e-7)


def random_versors(rng: np.random.Generator) -> Any:
    scale = np.exp(rng.normal(size=N) / 2)
    rotor = np.roll(Rotation.random(N, random_state=3).as_quat(), 1, -1)
    return cga3.versor_from_parts(scale, rotor, *(vectors(rng, 2) / 3))


def transversion(x: Any, b: Any) -> Any:
    x2, b2 = dot(x, x), dot(b, b)
    return (x - x2[:, None] * b) / (1 - 2 * dot(b, x) + b2 * x2)[:, None]


def test_versors_of_parts_do_what_parts_do(rng: np.random.Generator) -> None:
    scale = np.exp(rng.normal(size=N))
    rotation = Rotation.random(N, random_state=5)
    w = rotation.as_quat()
    rotor = np.stack([w[:, 3], -w[:, 2], w[:, 1], -w[:, 0]], -1)
    t, b, x = vectors(rng, 3)
    v = cga3.versor_from_parts(scale, rotor, t, b)
    close(cga3.transform_point(v, x), rotation.apply(scale[:, None] * transversion(x, b)) + t, 1e-6)
    parts = cga3.versor_decomposition(-v)
    close(parts[0], scale, 1e-9)
    close(parts[1], -rotor, 1e-9)
    close(parts[2], t, 1e-9)
    close(parts[3], b, 1e-8)
    close(cga3.versor_from_parts(*parts), -v, 1e-8)
    general = cga3.versor_exponential(rng.normal(size=(N, 10)) / 2)
    close(cga3.versor_from_parts(*cga3.versor_decomposition(general)), general, 1e-6)
    close(cga3.versor_product(v, v)[:, 0], cga3.even_product(v, v)[:, 0], 1e-6)
    moved = cga3.transform_point(cga3.dilator_about_point(t, scale), x)
    close(moved, t + scale[:, None] * (x - t), 1e-8)
    close(cga3.dilator_to_scale(cga3.dilator_from_scale(scale)), scale, 1e-12)
    k = np.zeros((N, 16))
    k[:, 0], k[:, 4:7] = 1, cga3.transversor_from_vector(b)
    close(cga3.transform_point(k, x), transversion(x, b), 1e-6)
