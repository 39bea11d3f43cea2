"""The conformal toolkit of space against vector formulas: 1000 random cases each, and the degenerate ones."""

from __future__ import annotations

from itertools import combinations_with_replacement
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
    d = b - a
    line = cga3.line_from_points(a, b)
    close(cga3.line_from_direction_moment(d, np.cross(a, d)), line)
    direction, moment = cga3.line_to_direction_moment(2 * line)
    close(direction, 2 * d)
    close(moment, np.cross(a, 2 * d))
    close(cga3.translate_point(cga3.translator_between_points(a, c), a), c)
    close(cga3.line_support(line), a - dot(a, unit(d))[:, None] * unit(d), 1e-8)
    n = np.cross(b - a, c - a)
    plane = cga3.plane_from_points(a, b, c)
    others = cga3.plane_from_point_normal(c, n), cga3.plane_from_normal(n, dot(n, b)), cga3.join_point_line(c, line)
    for same in others:
        close(same, plane, 1e-9)
    normal, distance = cga3.plane_to_normal(5 * plane)
    close(normal, unit(n), 1e-9)
    close(distance, dot(a, unit(n)), 1e-9)
    close(cga3.plane_support(plane), dot(a, unit(n))[:, None] * unit(n), 1e-9)


def test_duals_and_their_inverses(rng: np.random.Generator) -> None:
    line, plane, sphere = lines(rng)[2], planes(rng)[2], spheres(rng)[2]
    circle, pair = circles(rng)[3], pairs(rng)[2]
    close(cga3.line_from_dual(cga3.line_polarity(line)), line, 0)
    close(cga3.plane_from_dual(cga3.plane_polarity(plane)), plane, 0)
    close(cga3.sphere_from_dual(cga3.sphere_polarity(sphere)), sphere, 0)
    close(cga3.circle_from_dual(cga3.circle_polarity(circle)), circle, 0)
    close(cga3.point_pair_from_dual(cga3.point_pair_polarity(pair)), pair, 0)
    p, q, n, m = vectors(rng, 4)
    duals = (np.insert(cga3.dual_plane_from_normal(*x), 3, 0, -1) for x in ((n, dot(n, p)), (m, dot(m, q))))
    meet = cga3.circle_from_dual_spheres(*duals)
    close(meet[:, :4], np.zeros((N, 4)), 0)
    meet = meet[:, 4:]
    close(unit(cga3.line_to_direction_moment(meet)[0]), unit(np.cross(n, m)), 1e-9)
    point = cga3.line_support(meet)
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
    dual = cga3.sphere_polarity(sphere)
    close(dual, cga3.embed_point(c) - r2[:, None] / 2 * np.eye(5)[4])
    for surround in (cga3.circle_surround_sphere(circle), cga3.point_pair_surround_sphere(pair)):
        close(surround, dual, 1e-9)
    close(cga3.dual_sphere_radius_squared(-3 * dual), r2)
    close(cga3.point_pair_line(pair), cga3.line_from_point_direction(c, n))


def test_rounds_through_points(rng: np.random.Generator) -> None:
    a, b, c, d = vectors(rng, 4)
    pair, circle = cga3.point_pair_from_points(a, b), cga3.circle_from_points(a, b, c)
    close(pair, cga3.point_pair_from_centre((a + b) / 2, b - a, dot(b - a, b - a) / 4))
    close(cga3.circle_normal(circle), unit(np.cross(b - a, c - a)), 1e-9)
    close(cga3.circle_weight(circle), length(np.cross(b - a, c - a)))
    volume = dot(np.cross(b - a, c - a), d - a)
    close(cga3.sphere_weight(cga3.sphere_from_points(a, b, c, d)), -volume)
    p, q = cga3.point_pair_points(pair)
    close(p, a, 1e-8)
    close(q, b, 1e-8)


def test_kinds_of_flat_and_null_rounds(rng: np.random.Generator) -> None:
    a, b, n = vectors(rng, 3)
    zero = np.zeros(N)
    close(cga3.point_pair_kind(cga3.point_pair_from_centre(a, n, 0.0)), zero, 0)
    close(cga3.circle_kind(cga3.circle_from_centre(a, n, 0.0)), zero, 0)
    close(cga3.sphere_kind(cga3.sphere_from_centre(a, 0.0)), zero, 0)
    close(cga3.sphere_kind(cga3.sphere_from_plane(cga3.plane_from_point_normal(a, n))), zero + 2, 0)
    close(cga3.circle_kind(cga3.circle_from_line(cga3.line_from_points(a, b))), zero + 2, 0)
    close(cga3.circle_kind(cga3.circle_from_points([0, 0, 1.0], [0, 0, 2.0], [0, 0, 3.0])), 2, 0)
    close(cga3.point_pair_kind([0, 0, 0, 0, 0, 0, *a[0], 1.0]), 2, 0)
    assert np.isnan(cga3.sphere_kind(np.full(5, np.nan)))


def test_tangent_planes_touch(rng: np.random.Generator) -> None:
    c, r, sphere = spheres(rng)
    p = c + r[:, None] * unit(vectors(rng, 1)[0])
    normal, distance = cga3.plane_to_normal(cga3.tangent_plane_of_sphere(sphere, p))
    close(np.abs(dot(normal, unit(p - c))), np.ones(N))
    close(dot(p, normal), distance, 1e-9)


# Metrics


def test_distances_from_points(rng: np.random.Generator) -> None:
    x = vectors(rng, 1)[0]
    p, n, plane = planes(rng)
    close(cga3.project_point_on_plane(x, plane), x - dot(x - p, n)[:, None] * n)
    p, d, line = lines(rng)
    away = point_to_line(x, p, d)
    close(cga3.project_point_on_line(x, line), x - away, 1e-8)
    c, r, sphere = spheres(rng)
    nearest = c + r[:, None] * unit(x - c)
    close(cga3.signed_distance_point_sphere(x, sphere), length(x - c) - r)
    close(cga3.project_point_on_sphere(x, sphere), nearest)
    c, n, r, circle = circles(rng)
    nearest = to_circle(x, c, n, r)
    close(cga3.distance_point_circle(x, circle), length(x - nearest))
    close(cga3.project_point_on_circle(x, circle), nearest, 1e-9)


def test_nearest_points_that_are_not_unique_are_not_numbers() -> None:
    circle, sphere = cga3.circle_from_centre(X, Z, 1.0), cga3.sphere_from_centre(X, 2.0)
    assert np.isnan(cga3.project_point_on_circle(X + 2 * Z, circle)).any()
    assert np.isnan(cga3.project_point_on_sphere(X, sphere)).any()
    close(cga3.distance_point_circle(X + 2 * Z, circle), np.sqrt(5))
    imaginary = cga3.circle_from_centre(X, Z, -1.0)
    assert np.isnan(cga3.distance_point_circle(O, imaginary))


def test_distances_of_lines(rng: np.random.Generator) -> None:
    (p, d, one), (q, e, two) = lines(rng), lines(rng)
    across = np.cross(d, e)
    close(cga3.distance_lines(one, two), np.abs(dot(q - p, unit(across))), 1e-8)
    near, other = cga3.closest_points_of_lines(one, two)
    close(point_to_line(near, p, d), np.zeros((N, 3)), 1e-7)
    close(point_to_line(other, q, e), np.zeros((N, 3)), 1e-7)
    good = length(across) > 0.01
    close(dot(near - other, d)[good], 0 * d[good, 0], 1e-7)
    close(dot(near - other, e)[good], 0 * d[good, 0], 1e-7)
    parallel = cga3.line_from_point_direction(q, -2 * d)
    close(cga3.distance_lines(one, parallel), length(point_to_line(q, p, d)), 1e-8)
    near, other = cga3.closest_points_of_lines(one, parallel)
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
    inside = cga3.line_from_point_direction(p, np.cross(n, d))
    close(cga3.signed_distance_line_plane(inside, plane), dot(p - q, n), 1e-9)
    close(cga3.signed_distance_line_plane(line, other_plane), zero, 0)


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
    close(cga3.angle_between_lines(d[2], e[2]), np.arccos(dot(d[1], e[1])), 1e-7)
    close(cga3.angle_between_planes(n[2], m[2]), np.arccos(dot(n[1], m[1])), 1e-7)
    close(cga3.signed_angle_line_plane(d[2], n[2]), np.arcsin(dot(d[1], n[1])), 1e-7)
    close(cga3.angle_between_circles(c[3], k[3]), np.arccos(dot(c[1], k[1])), 1e-7)
    along = unit(b - a)
    directions = {
        "line": (cga3.line_to_direction_moment(d[2])[0], d[1]), "plane": (cga3.plane_to_normal(n[2])[0], n[1]),
        "circle": (cga3.circle_normal(c[3]), c[1]), "pair": (cga3.point_pair_direction(pair), along),
    }  # fmt: skip
    for (one, x), (two, y) in combinations_with_replacement(directions.values(), 2):
        close(cga3.angle_between_directions(one, two), 2 * np.arcsin(np.minimum(1, length(x - y) / 2)), 1e-7)
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
        ("inner_product_of_circles", (circles(rng)[3], circles(rng)[3]), cga3.transform_circle),
        ("inner_product_of_point_pairs", (pairs(rng)[2], pairs(rng)[2]), cga3.transform_point_pair),
    ):
        before = getattr(cga3, name)(x, y)
        after = getattr(cga3, name)(move(v, x), move(v, y))
        close(after, before, 1e-6)
    t = np.linspace(0.3, 5, 4)
    a, b, e, f = (np.array([np.cos(x), np.sin(x), 0]) for x in t)
    ratio = (length(a - e) * length(b - f)) / (length(a - f) * length(b - e))
    p, q = cga3.point_pair_from_points(a, b), cga3.point_pair_from_points(e, f)
    product, size = cga3.inner_product_of_point_pairs(p, q), (length(a - b) * length(e - f)) ** 2 / 4
    close(abs(product / size), abs((1 + ratio) / (1 - ratio)), 1e-9)
    x, y = (cga3.circle_from_centre(O, normal, 1.0) for normal in (Z, Y + Z))
    close(cga3.inner_product_of_circles(x, y), 1.0)
    close(cga3.inner_product_of_circles(y, y), 2.0)
    circle = cga3.circle_from_centre(O, Z, 1.0)
    for centre, radius, sine in ((O, 1.0, 0.0), (Z, np.sqrt(2.0), 0.0), (X, 1.0, np.sqrt(3) / 2), (2 * X, 1.0, 0.0)):
        sphere = cga3.dual_sphere_from_centre(centre, radius)
        close(cga3.conformal_sine_circle_sphere(circle, sphere), sine, 1e-7)


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


def sphere_at(c: Any, r: float) -> Any:
    return cga3.sphere_polarity(cga3.sphere_from_centre(np.array(c, float), r))


def circle_at(c: Any, n: Any, r: float) -> Any:
    return cga3.circle_from_centre(np.array(c, float), np.array(n, float), r * r)


def line_at(p: Any, d: Any) -> Any:
    """A line as a circle."""
    return cga3.circle_from_line(cga3.line_from_point_direction(np.array(p, float), np.array(d, float)))


def plane_at(p: Any, n: Any) -> Any:
    """A plane as a dual sphere."""
    plane = cga3.plane_from_point_normal(np.array(p, float), np.array(n, float))
    return cga3.sphere_polarity(cga3.sphere_from_plane(plane))


UNIT_SPHERE, FLAT, AXIS, RING = sphere_at(O, 1), plane_at(O, Z), line_at(O, Z), circle_at(O, Z, 1)
SPHERES = [
    (UNIT_SPHERE, sphere_at(X, 1), 1), (UNIT_SPHERE, sphere_at(2 * X, 1), 0), (UNIT_SPHERE, sphere_at(X / 2, 0.5), 0),
    (UNIT_SPHERE, sphere_at(3 * X, 1), -1), (UNIT_SPHERE, sphere_at(X / 4, 0.5), -1),
    (UNIT_SPHERE, sphere_at(O, 2), 2), (UNIT_SPHERE, UNIT_SPHERE, 3), (UNIT_SPHERE, plane_at(Z / 2, Z), 1),
    (UNIT_SPHERE, plane_at(Z, Z), 0), (UNIT_SPHERE, plane_at(-2 * Z, Z), -1), (FLAT, plane_at(O, X), 1),
    (FLAT, plane_at(O, Z + 1e-9 * X), 1), (FLAT, plane_at(Z, -Z), 2), (FLAT, plane_at(X, -3 * Z), 3),
]  # fmt: skip
CIRCLES_AND_SPHERES = [
    (AXIS, plane_at(Z, Z), 1), (AXIS, plane_at(X, X), 2), (AXIS, plane_at(O, X), 3), (AXIS, sphere_at(X / 2, 1), 1),
    (AXIS, sphere_at(X, 1), 0), (AXIS, sphere_at(2 * X, 1), -1), (RING, plane_at(X / 2, X), 1),
    (RING, plane_at(X, X), 0), (RING, plane_at(2 * X, X), -1), (RING, plane_at(Z, Z), 2), (RING, plane_at(O, -Z), 3),
    (RING, plane_at(X, X + Z), 0), (RING, sphere_at(X, 1), 1), (RING, sphere_at(2 * X, 1), 0),
    (RING, sphere_at(3 * X, 1), -1), (RING, sphere_at(O, 2), 2), (RING, UNIT_SPHERE, 3),
    (RING, sphere_at(Z, np.sqrt(2)), 3),
]  # fmt: skip
CIRCLES = [
    (RING, circle_at(X, Z, 1), 1), (RING, circle_at(2 * X, -Z, 1), 0), (RING, circle_at(3 * X, Z, 1), -1),
    (RING, circle_at(O, Z, 2), 2), (RING, circle_at(O, -Z, 1), 3), (RING, circle_at(O, X, 1), 1),
    (RING, circle_at(2 * X, Y, 1), 0), (RING, circle_at(X, Y, 1), -1), (RING, circle_at(Z, Z, 1), -1),
    (RING, circle_at(X + Z, X, 1), 0), (RING, circle_at(3 * X, X, 1), -1), (RING, circle_at(2 * X, Y + Z, 1), 0),
    (AXIS, line_at(Z, X), 1), (AXIS, line_at(Y, X), -1), (AXIS, line_at(X, -Z), 2), (AXIS, line_at(3 * Z, -2 * Z), 3),
    (RING, line_at(X / 2, Y), 1), (RING, line_at(X, Y), 0), (RING, line_at(X, Z), 0), (RING, line_at(2 * X, Y), -1),
    (RING, line_at(O, Z), -1), (RING, line_at(Z, X), -1),
]  # fmt: skip


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e3])
def test_kinds_of_meets(rng: np.random.Generator, scale: float) -> None:
    """Test the objects also translated, rotated, scaled, with other weights and exchanged arguments."""
    w = np.roll(Rotation.random(N, random_state=11).as_quat(), 1, -1)
    motors = cga3.motor_from_rotor_translation(w, rng.normal(size=(N, 3)) * 3)
    dilator = cga3.versor_from_dilator(cga3.dilator_from_scale(np.full(N, scale)))
    v = cga3.even_product(dilator, cga3.versor_from_motor(motors))
    weights = rng.choice([-1, 1], (2, N, 1)) * 10 ** rng.uniform(-3, 3, (2, N, 1))
    vector, circle = cga3.transform_vector, cga3.transform_circle
    for kind, cases, moves in (
        (cga3.meet_dual_spheres_kind, SPHERES, (vector, vector)),
        (cga3.meet_circle_dual_sphere_kind, CIRCLES_AND_SPHERES, (circle, vector)),
        (cga3.meet_circles_kind, CIRCLES, (circle, circle)),
    ):
        for number, (first, second, expected) in enumerate(cases):
            assert kind(first, second) == expected, (kind, number)
            moved = [weight * move(v, x) for weight, move, x in zip(weights, moves, (first, second), strict=True)]
            close(kind(*moved), np.full(N, expected), 0)
            if moves[0] is moves[1]:
                close(kind(*moved[::-1]), np.full(N, expected), 0)
    for kind, first, second in ((cga3.meet_dual_spheres_kind, 5, 5), (cga3.meet_circle_dual_sphere_kind, 10, 5)):
        assert np.isnan(kind(np.full(first, np.nan), np.ones(second)))


def test_kinds_of_random_meets(rng: np.random.Generator) -> None:
    (c, r, one), (k, s, two) = spheres(rng), spheres(rng)
    p, n, plane = planes(rng)
    q, d, line = lines(rng)
    m, u, t, circle = circles(rng)
    one, two, plane = (cga3.sphere_polarity(x) for x in (one, two, cga3.sphere_from_plane(plane)))
    gap = length(c - k)
    close(cga3.meet_dual_spheres_kind(one, two), np.where((gap < r + s) & (gap > np.abs(r - s)), 1, -1), 0)
    close(cga3.meet_dual_spheres_kind(one, plane), np.where(np.abs(dot(c - p, n)) < r, 1, -1), 0)
    line = cga3.circle_from_line(line)
    near = length(point_to_line(c, q, d))
    close(cga3.meet_circle_dual_sphere_kind(line, one), np.where(near < r, 1, -1), 0)
    close(cga3.meet_circle_dual_sphere_kind(line, plane), np.full(N, 1), 0)
    tilt = length(np.cross(u, n))
    close(cga3.meet_circle_dual_sphere_kind(circle, plane), np.where(np.abs(dot(m - p, n)) < t * tilt, 1, -1), 0)
    height, flat = dot(c - m, u), length(point_to_line(c, m, u))
    near, far = np.hypot(height, flat - t), np.hypot(height, flat + t)
    close(cga3.meet_circle_dual_sphere_kind(circle, one), np.where((near < r) & (r < far), 1, -1), 0)
    a, b, e, f = vectors(rng, 4)
    on = [to_circle(x, m, u, t) for x in (a, b, e, f)]
    level = cga3.circle_from_points(a, b, to_circle(e, (a + b) / 2, unit(np.cross(a - b, e)), length(a - b) / 2))
    secant = cga3.circle_from_line(cga3.line_from_points(on[0], on[1]))
    close(cga3.meet_circles_kind(secant, circle), np.full(N, 1), 0)
    through = cga3.circle_from_line(cga3.line_from_points(on[0], f))
    close(cga3.meet_circles_kind(circle, through), np.full(N, 0), 0)
    close(cga3.meet_circles_kind(circle, line), np.full(N, -1), 0)
    close(cga3.meet_circles_kind(circle, level), np.full(N, -1), 0)
    close(cga3.meet_circles_kind(cga3.circle_from_points(on[0], on[1], f), circle), np.full(N, 1), 0)
    for touching in (r + s, np.abs(r - s)):
        other = cga3.dual_sphere_from_centre(c + touching[:, None] * n, s)
        close(cga3.meet_dual_spheres_kind(one, other), np.zeros(N), 0)


def test_first_hits_of_spheres(rng: np.random.Generator) -> None:
    o, d = vectors(rng, 2)
    centre, r, sphere = spheres(rng)
    half_b, q = dot(d, o - centre), dot(o - centre, o - centre) - r**2
    discriminant = half_b**2 - dot(d, d) * q
    with np.errstate(invalid="ignore"):
        roots = np.stack([-half_b - np.sqrt(discriminant), -half_b + np.sqrt(discriminant)]) / dot(d, d)
        first = np.where(roots[0] >= 0, roots[0], np.where(roots[1] >= 0, roots[1], np.nan))
        t = cga3.hit_ray_sphere(o, d, sphere)
    close(t, first, 1e-8)
    assert 0.1 < np.mean(np.isnan(t)) < 0.9
    assert np.isnan(cga3.hit_ray_sphere(O, X, cga3.sphere_from_centre(-3 * X, 1.0)))
    close(cga3.hit_ray_sphere(O, X, cga3.sphere_from_centre(X / 2, 1.0)), 1.5)
    close(cga3.hit_ray_sphere(O, 2 * X, cga3.sphere_from_centre(3 * X + Y, 1.0)), 1.5)


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
    mirrored = cga3.invert_circle(cga3.circle_from_line(cga3.line_from_points(a, b)), mirror)
    same_blade(mirrored, cga3.circle_from_line(cga3.line_from_points(w, x)), 1e-7)
    mirrored = cga3.invert_sphere(cga3.sphere_from_plane(cga3.plane_from_points(a, b, c)), mirror)
    same_blade(mirrored, cga3.sphere_from_plane(cga3.plane_from_points(w, x, y)), 1e-6)
    line = cga3.circle_from_line(cga3.line_from_points(a, b))
    through = cga3.invert_circle(line, s)
    close(cga3.circle_radius_squared(through), (r**2 / length(point_to_line(k, a, unit(b - a))) / 2) ** 2, 1e-5)


def from_parts(scale: Any, rotor: Any, t: Any, b: Any) -> Any:
    """Transversion, dilation, rotation, translation."""
    dilator = cga3.versor_from_dilator(cga3.dilator_from_scale(scale))
    transversor = cga3.versor_from_transversor(cga3.transversor_from_vector(b))
    motor = cga3.versor_from_motor(cga3.motor_from_rotor_translation(rotor, t))
    return cga3.even_product(motor, cga3.even_product(dilator, transversor))


def random_versors(rng: np.random.Generator) -> Any:
    scale = np.exp(rng.normal(size=N) / 2)
    rotor = np.roll(Rotation.random(N, random_state=3).as_quat(), 1, -1)
    return from_parts(scale, rotor, *(vectors(rng, 2) / 3))


def transversion(x: Any, b: Any) -> Any:
    x2, b2 = dot(x, x), dot(b, b)
    return (x - x2[:, None] * b) / (1 - 2 * dot(b, x) + b2 * x2)[:, None]


def test_versors_of_parts_do_what_parts_do(rng: np.random.Generator) -> None:
    scale = np.exp(rng.normal(size=N))
    rotation = Rotation.random(N, random_state=5)
    w = rotation.as_quat()
    rotor = np.stack([w[:, 3], -w[:, 2], w[:, 1], -w[:, 0]], -1)
    t, b, x = vectors(rng, 3)
    v = from_parts(scale, rotor, t, b)
    close(cga3.transform_point(v, x), rotation.apply(scale[:, None] * transversion(x, b)) + t, 1e-6)
    parts = cga3.versor_decomposition(-v)
    close(parts[0], scale, 1e-9)
    close(parts[1], -rotor, 1e-9)
    close(parts[2], t, 1e-9)
    close(parts[3], b, 1e-8)
    close(from_parts(*parts), -v, 1e-8)
    general = cga3.versor_exponential(rng.normal(size=(N, 10)) / 2)
    close(from_parts(*cga3.versor_decomposition(general)), general, 1e-6)
    close(cga3.dilator_to_scale(cga3.dilator_from_scale(scale)), scale, 1e-12)
    k = cga3.versor_from_transversor(cga3.transversor_from_vector(b))
    close(cga3.transform_point(k, x), transversion(x, b), 1e-6)
