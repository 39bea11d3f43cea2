"""The conformal toolkit of the plane against vector formulas and complex numbers: 1000 random and degenerate cases."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from generated import cga2

N = 1000
X, Y, O = np.array([1.0, 0]), np.array([0, 1.0]), np.zeros(2)  # noqa: E741


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(47)


def dot(a: Any, b: Any) -> Any:
    return np.sum(np.asarray(a) * b, -1)


def length(a: Any) -> Any:
    return np.linalg.norm(a, axis=-1)


def unit(a: Any) -> Any:
    return a / length(a)[..., None]


def left(a: Any) -> Any:
    return np.stack([-a[..., 1], a[..., 0]], -1)


def close(found: Any, expected: Any, tolerance: float = 1e-9) -> None:
    np.testing.assert_allclose(found, np.broadcast_to(expected, np.shape(found)), rtol=tolerance, atol=tolerance)


def same_blade(found: Any, expected: Any, tolerance: float = 1e-8) -> None:
    close(unit(found), unit(expected), tolerance)


def vectors(rng: np.random.Generator, n: int) -> Any:
    return rng.normal(size=(n, N, 2))


def lines(rng: np.random.Generator) -> Any:
    p, d = vectors(rng, 2)
    return p, unit(d), cga2.line_from_point_direction(p, d)


def circles(rng: np.random.Generator) -> Any:
    c, r = vectors(rng, 1)[0], rng.uniform(0.2, 3, N)
    return c, r, -1.5 * cga2.circle_from_centre(c, r)


def test_lines(rng: np.random.Generator) -> None:
    a, b = vectors(rng, 2)
    d = b - a
    line = cga2.line_from_points(a, b)
    n = left(unit(d))
    close(cga2.line_from_point_direction(a, d), line)
    close(cga2.line_from_normal(left(d), dot(left(d), a)), line)
    close(cga2.line_direction(2 * line), unit(d))
    close(cga2.line_normal(line), n)
    close(cga2.line_distance(line), dot(n, a))
    close(cga2.line_weight(line), length(d))
    close(cga2.line_support_point(line), dot(n, a)[:, None] * n)
    close(cga2.line_polarity(line), cga2.dual_line_from_point_normal(a, left(d)))
    close(cga2.line_from_dual(cga2.line_polarity(line)), line, 0)
    close(cga2.dual_line_from_normal(d, dot(d, a)), cga2.dual_line_from_point_normal(a, d))
    close(cga2.circle_kind(cga2.circle_from_line(line)), 2, 0)
    bisector = cga2.bisector_line(a, b)
    close(cga2.reflect_point(a, bisector), b)
    close(cga2.point_from_flat_point(-2 * cga2.flat_point_from_point(a)), a)
    close(cga2.direction_from_points(a, b), d)


@pytest.mark.parametrize("sign", [1, -1])
def test_rounds(rng: np.random.Generator, sign: int) -> None:
    c, d = vectors(rng, 2)
    r2 = sign * rng.uniform(0.1, 4, N)
    pair, circle = cga2.point_pair_from_centre(c, d, r2), cga2.circle_from_centre_radius_squared(c, r2)
    for name, x in (("point_pair", pair), ("circle", circle)):
        close(getattr(cga2, f"{name}_centre")(-2 * x), c)
        close(getattr(cga2, f"{name}_radius_squared")(-2 * x), r2)
        close(getattr(cga2, f"{name}_kind")(-2 * x), sign, 0)
    close(cga2.point_pair_direction(pair), unit(d))
    close(cga2.point_pair_weight(pair), length(d))
    dual = cga2.dual_circle_from_centre_radius_squared(c, r2)
    close(cga2.circle_polarity(circle), dual)
    close(cga2.circle_from_dual(dual), circle)
    close(cga2.point_pair_surround_circle(pair), dual)
    close(cga2.dual_circle_radius_squared(-3 * dual), r2)
    same_blade(cga2.point_pair_bisector(pair), cga2.dual_line_from_point_normal(c, d))
    close(cga2.point_pair_line(pair), cga2.line_from_point_direction(c, d))


def test_rounds_through_points(rng: np.random.Generator) -> None:
    a, b, c, x = vectors(rng, 4)
    pair = cga2.point_pair_from_points(a, b)
    p, q = cga2.point_pair_points(pair)
    close(p, a, 1e-7)
    close(q, b, 1e-7)
    circle = cga2.circle_from_points(a, b, c)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    close(cga2.circle_weight(circle), area)
    close(cga2.collinearity(a, b, c), area)
    squares = np.stack([dot(b, b) - dot(a, a), dot(c, c) - dot(a, a)], -1)[..., None]
    centre = np.linalg.solve(2 * np.stack([b - a, c - a], 1), squares)[..., 0]
    good = np.abs(area) > 0.05
    close(cga2.circle_centre(circle)[good], centre[good], 1e-7)
    close(cga2.circle_radius_squared(circle)[good], dot(a - centre, a - centre)[good], 1e-6)
    power = dot(x - centre, x - centre) - dot(a - centre, a - centre)
    close(cga2.cocircularity(a, b, c, x), area * power / 2, 1e-6)
    close(cga2.circle_through_point(a, b), cga2.circle_from_centre(a, length(b - a)))
    tangent = cga2.tangent_line_of_circle(cga2.circle_through_point(a, b), b)
    close(np.abs(dot(cga2.line_normal(tangent), unit(b - a))), 1)
    close(cga2.signed_distance_point_line(b, tangent), 0, 1e-8)
    close(cga2.point_pair_kind(cga2.tangent_from_point_direction(a, b)), 0, 0)
    close(cga2.point_pair_kind([0, 0, 0, 1, 2, 1.0]), 2, 0)


def test_distances_projections_and_angles(rng: np.random.Generator) -> None:
    x, a, b = vectors(rng, 3)
    (p, d, line), (q, e, other) = lines(rng), lines(rng)
    (c, r, circle), (k, s, two) = circles(rng), circles(rng)
    n = left(d)
    height = dot(x - p, n)
    close(cga2.signed_distance_point_line(x, line), height)
    close(cga2.project_point_on_line(x, line), x - height[:, None] * n)
    close(cga2.reject_point_from_line(x, line), height[:, None] * n)
    nearest = c + r[:, None] * unit(x - c)
    close(cga2.distance_point_circle(x, circle), length(x - c) - r)
    close(cga2.project_point_on_circle(x, circle), nearest)
    close(cga2.reject_point_from_circle(x, circle), x - nearest)
    close(cga2.power_of_point(x, 2 * cga2.circle_polarity(circle)), dot(x - c, x - c) - r**2)
    close(cga2.distance_lines(line, other), 0, 0)
    close(cga2.distance_lines(line, cga2.line_from_point_direction(q, -3 * d)), np.abs(dot(q - p, n)))
    close(cga2.distance_line_circle(line, circle), np.maximum(0, np.abs(dot(c - p, n)) - r))
    gap = length(c - k)
    close(cga2.distance_circles(circle, two), np.max([0 * r, gap - r - s, np.abs(r - s) - gap], 0))
    pair = cga2.point_pair_from_points(a, b)
    for found, distance in (
        (cga2.distance_point_point_pair(x, pair), lambda y: length(x - y)),
        (cga2.distance_line_point_pair(line, pair), lambda y: np.abs(dot(y - p, n))),
        (cga2.distance_circle_point_pair(circle, pair), lambda y: np.abs(length(y - c) - r)),
    ):
        both = np.stack([distance(a), distance(b)])
        close(found, np.stack([both.min(0), both.max(0)]), 1e-7)
    near = np.min([length(y - z) for y in (a, b) for z in (x, q)], 0)
    close(cga2.distance_point_pairs(pair, cga2.point_pair_from_points(x, q)), near, 1e-7)
    angle = np.angle((e @ [1, 1j]) / (d @ [1, 1j]))
    close(cga2.angle_between_lines(line, other), angle)
    ratio = (gap**2 - r**2 - s**2) / (2 * r * s)
    duals = cga2.circle_polarity(circle) / -1.5, cga2.circle_polarity(two) / -1.5
    close(cga2.inversive_distance(*duals), ratio)
    meets = np.abs(ratio) < 1
    close(cga2.angle_between_dual_circles(*duals)[meets], np.arccos(-ratio[meets]), 1e-7)
    on_line, on_circle = cga2.closest_points_line_circle(line, circle)
    close(on_line, c - dot(c - p, n)[:, None] * n)
    close(on_circle, c + r[:, None] * unit(on_line - c), 1e-7)
    first, second = cga2.closest_points_circles(circle, two)
    close(first, c + r[:, None] * unit(k - c))
    close(second, k + s[:, None] * unit(c - k))
    close(cga2.reflect_point_in_point(x, a), 2 * a - x)


def test_meets_and_their_kinds(rng: np.random.Generator) -> None:
    (p, d, line), (q, e, other) = lines(rng), lines(rng)
    point = cga2.meet_lines(line, other)
    good = np.abs(dot(left(d), e)) > 0.05
    close(dot(point - p, left(d))[good], 0 * d[good, 0], 1e-8)
    close(dot(point - q, left(e))[good], 0 * d[good, 0], 1e-8)
    c, r, circle = circles(rng)
    with np.errstate(invalid="ignore"):
        for hit in cga2.point_pair_points(cga2.meet_line_circle(line, circle)):
            cut = np.isfinite(hit[:, 0])
            assert np.array_equal(cut, np.abs(dot(c - p, left(d))) < r)
            close(np.abs(length(hit - c) - r)[cut], 0 * r[cut], 1e-6)
            close(dot(hit - p, left(d))[cut], 0 * r[cut], 1e-6)
        k, s, two = circles(rng)
        pair = cga2.meet_circles(circle, two)
        for hit in cga2.point_pair_points(pair):
            cut = np.isfinite(hit[:, 0])
            close(np.abs(length(hit - c) - r)[cut], 0 * r[cut], 1e-5)
            close(np.abs(length(hit - k) - s)[cut], 0 * r[cut], 1e-5)
    gap = length(c - k)
    kind = np.where((gap < r + s) & (gap > np.abs(r - s)), 1, -1)
    close(cga2.meet_circles_kind(circle, two), kind, 0)
    dual = cga2.point_pair_from_dual_circles(cga2.circle_polarity(circle), cga2.circle_polarity(two))
    close(np.abs(dot(unit(dual), unit(pair))), 1)
    n = unit(vectors(rng, 1)[0])
    for touching in (r + s, np.abs(r - s)):
        close(cga2.meet_circles_kind(circle, cga2.circle_from_centre(c + touching[:, None] * n, s)), 0, 0)
    close(cga2.meet_circles_kind(circle, cga2.circle_from_centre(c, 2 * r)), 2, 0)
    close(cga2.meet_circles_kind(circle, circle), 3, 0)
    close(cga2.meet_line_circle_kind(cga2.line_from_point_direction(c + r[:, None] * n, left(n)), circle), 0, 0)
    close(cga2.meet_line_circle_kind(line, circle), np.where(np.abs(dot(c - p, left(d))) < r, 1, -1), 0)
    close(cga2.meet_lines_kind(line, other), 1, 0)
    close(cga2.meet_lines_kind(line, cga2.line_from_point_direction(q, -d)), 2, 0)
    close(cga2.meet_lines_kind(line, -line), 3, 0)


def test_first_hits(rng: np.random.Generator) -> None:
    o, d = vectors(rng, 2)
    c, r, circle = circles(rng)
    b, q = dot(d, o - c), dot(o - c, o - c) - r**2
    with np.errstate(invalid="ignore"):
        root = np.sqrt(b * b - dot(d, d) * q)
        low, high = (-b - root) / dot(d, d), (-b + root) / dot(d, d)
        expected = np.where(low >= 0, low, np.where(high >= 0, high, np.nan))
    t, point = cga2.ray_hits_circle(o, d, circle)
    close(t, expected, 1e-7)
    close(point, o + expected[:, None] * d, 1e-7)
    p, e, line = lines(rng)
    expected = dot(p - o, left(e)) / dot(d, left(e))
    close(cga2.ray_hits_line(o, d, line)[0], np.where(expected >= 0, expected, np.nan), 1e-6)
    assert np.isnan(cga2.ray_hits_line(O, X, cga2.line_from_point_direction(Y, X))[0])


def as_complex(x: Any) -> Any:
    return x[..., 0] + 1j * x[..., 1]


def random_versors(rng: np.random.Generator) -> tuple[Any, Any]:
    """Versors and the same maps of complex numbers: ``z -> a z / (1 - conj(b) z) + t``."""
    scale, angle = np.exp(rng.normal(size=N) / 2), rng.uniform(-3, 3, N)
    t, b = vectors(rng, 2)
    v = cga2.versor_from_parts(scale, cga2.rotor_from_angle(angle), t, b)
    a, t, b = scale * np.exp(1j * angle), as_complex(t), as_complex(b)
    return v, lambda z: a * z / (1 - np.conj(b) * z) + t


def test_versors_are_moebius_maps(rng: np.random.Generator) -> None:
    v, image = random_versors(rng)
    a, b, c = vectors(rng, 3)
    w = image(as_complex(a))
    found = as_complex(cga2.transform_point(v, a))
    assert np.median(np.abs(found - w)) < 1e-14 * 100
    close(found / np.maximum(1, np.abs(w)), w / np.maximum(1, np.abs(w)), 1e-7)
    close(cga2.versor_from_parts(*cga2.versor_decomposition(-v)), -v, 1e-8)
    general = cga2.versor_exponential(rng.normal(size=(N, 6)) / 2)
    close(cga2.versor_from_parts(*cga2.versor_decomposition(general)), general, 1e-6)
    close(cga2.versor_exponential(cga2.versor_logarithm(general)), general * np.where(general[:, :1] < 0, -1, 1), 1e-7)
    half = cga2.versor_square_root(general)
    close(cga2.versor_product(half, half), general * np.where(general[:, :1] < 0, -1, 1), 1e-7)
    close(cga2.normalize_versor(3 * general), general, 1e-8)
    x, y, z = (cga2.transform_point(v, p) for p in (a, b, c))
    same_blade(cga2.transform_point_pair(v, cga2.point_pair_from_points(a, b)), cga2.point_pair_from_points(x, y), 1e-5)
    same_blade(cga2.transform_circle(v, cga2.circle_from_points(a, b, c)), cga2.circle_from_points(x, y, z), 1e-4)
    same_blade(cga2.transform_vector(v, cga2.embed_point(a)), cga2.embed_point(x), 1e-7)
    p, q = cga2.point_pair_from_points(a, b), cga2.point_pair_from_points(b + 1, c)
    moved = cga2.transform_point_pair(v, p), cga2.transform_point_pair(v, q)
    close(cga2.inversive_product_point_pairs(*moved), cga2.inversive_product_point_pairs(p, q), 1e-4)


def test_motors(rng: np.random.Generator) -> None:
    angle = np.r_[rng.uniform(-3, 3, N - 5), 0, 1e-12, np.pi - 1e-12, np.pi / 2, 1e-7]
    p, x, t = vectors(rng, 3)
    turn = np.exp(1j * angle)
    m = cga2.motor_from_point(p, angle)
    moved = turn * as_complex(x - p) + as_complex(p)
    close(as_complex(cga2.move_point(m, x)), moved, 1e-11)
    close(as_complex(cga2.rotate_point(cga2.rotor_from_angle(angle), x)), turn * as_complex(x), 1e-12)
    close(cga2.rotor_to_angle(cga2.rotor_from_angle(angle)), angle, 1e-14)
    close(cga2.motor_exponential(cga2.motor_logarithm(m)), m, 1e-13)
    half = cga2.motor_square_root(m)
    close(cga2.motor_product(half, half), m, 1e-12)
    close(cga2.motor_power(m, 0.5), half, 1e-12)
    close(cga2.interpolate_motors(m, cga2.motor_product(m, m), 0.0), m, 1e-12)
    rotor, translation = cga2.motor_to_rotor_translation(m)
    close(cga2.motor_from_rotor_translation(rotor, translation), m, 1e-12)
    matrix = cga2.motor_to_matrix(m)
    close(np.einsum("nij,nj->ni", matrix, np.c_[x, np.ones(N)])[:, :2], cga2.move_point(m, x), 1e-11)
    close(cga2.move_direction(m, t), np.stack([(turn * as_complex(t)).real, (turn * as_complex(t)).imag], -1), 1e-12)
    ends = cga2.move_point(m, x), cga2.move_point(m, t)
    same_blade(cga2.move_line(m, cga2.line_from_points(x, t)), cga2.line_from_points(*ends))
    flat = cga2.flat_point_from_point
    close(cga2.move_flat_point(m, flat(x)), flat(cga2.move_point(m, x)), 1e-11)
    close(cga2.move_point(cga2.motor_inverse(m), cga2.move_point(m, x)), x, 1e-11)
    scale = np.exp(rng.normal(size=N))
    close(cga2.transform_point(cga2.dilator_about_point(p, scale), x), p + scale[:, None] * (x - p))
    dilator = cga2.dilator_from_scale(scale)
    close(cga2.dilator_to_scale(dilator), scale, 1e-12)
    close(cga2.dilate_point(dilator, x), scale[:, None] * x)
    close(cga2.translate_point(cga2.translator_from_vector(t), x), x + t)
    c, r, circle = circles(rng)
    centre = cga2.move_point(m, c)
    close(cga2.move_circle(m, circle), -1.5 * cga2.circle_from_centre(centre, r), 1e-10)
    close(cga2.move_vector(m, cga2.circle_polarity(circle)), cga2.circle_polarity(cga2.move_circle(m, circle)), 1e-10)
    pair = cga2.point_pair_from_points(x, t)
    close(cga2.move_point_pair(m, pair), cga2.point_pair_from_points(*ends), 1e-9)


def test_inversions(rng: np.random.Generator) -> None:
    a, b, c = vectors(rng, 3)
    k, r, circle = circles(rng)
    s = cga2.circle_polarity(circle)

    def image(x: Any) -> Any:
        return k + (r**2 / dot(x - k, x - k))[:, None] * (x - k)

    close(cga2.invert_point(a, s), image(a), 1e-7)
    same_blade(cga2.invert_vector(-cga2.embed_point(a), s), cga2.embed_point(image(a)), 1e-7)
    pair, ring = cga2.point_pair_from_points, cga2.circle_from_points
    same_blade(cga2.invert_point_pair(pair(a, b), s), pair(image(a), image(b)), 1e-5)
    same_blade(cga2.invert_circle(ring(a, b, c), s), ring(image(a), image(b), image(c)), 1e-4)
    p, d, line = lines(rng)
    n = left(d)
    mirror = cga2.line_polarity(line)
    x, y = (z - 2 * dot(z - p, n)[:, None] * n for z in (a, b))
    close(cga2.reflect_point(a, mirror), x, 1e-8)
    same_blade(cga2.reflect_line(cga2.line_from_points(a, b), mirror), cga2.line_from_points(x, y), 1e-7)


def test_versors_between_objects(rng: np.random.Generator) -> None:
    (p, d, line), (_, _, other) = lines(rng), lines(rng)
    circle, two = circles(rng)[2], circles(rng)[2]
    a, b, c, e = vectors(rng, 4)
    pair, second = cga2.point_pair_from_points(a, b), cga2.point_pair_from_points(c, e)
    for between, move, x, y in (
        (cga2.motor_between_lines, cga2.move_line, line, other),
        (cga2.versor_between_circles, cga2.transform_circle, circle, two),
        (cga2.versor_between_point_pairs, cga2.transform_point_pair, pair, second),
    ):
        for start, end in ((x, y), (x, x), (x, -2 * x), (x, -y)):
            v = between(start, end)
            error = np.max(np.abs(unit(move(v, start)) - unit(end)), -1)
            assert np.isfinite(v).all()
            assert np.median(error) < 1e-12
            assert np.max(error) < 1e-4
    for angle in (1e-12, 1e-8, 1e-4, 0.1):
        back = -np.cos(angle) * d + np.sin(angle) * left(d)
        end = cga2.line_from_point_direction(p + a, back)
        close(unit(cga2.move_line(cga2.motor_between_lines(line, end), line)), unit(end), 1e-9)
    v = cga2.similarity_between_circles(circle, two)
    close(unit(cga2.transform_circle(v, circle)), unit(two), 1e-9)
    assert np.isnan(cga2.versor_between_circles(circle, cga2.circle_from_centre_radius_squared(a, -1.0))).all()


def test_products_are_consistent(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, N, 16))
    close(cga2.reverse(cga2.geometric_product(a, b)), cga2.geometric_product(cga2.reverse(b), cga2.reverse(a)))
    close(cga2.undual(cga2.dual(a)), a, 0)
    meet = cga2.dual(cga2.regressive_product(a, b))
    close(meet, cga2.outer_product(cga2.dual(a), cga2.dual(b)))
    x, y = vectors(rng, 2)
    close(cga2.distance_points(x, y), length(x - y))
    close(cga2.distance_squared_points(x, y), dot(x - y, x - y))
    close(cga2.inner_product_of_points(x, y), -dot(x - y, x - y) / 2)
    close(cga2.extract_point(-3 * cga2.embed_point(x)), x)
    close(cga2.normalize_vector(-3 * cga2.embed_point(x)), cga2.embed_point(x))
    close(cga2.inner_product_of_vectors(cga2.embed_point(x), cga2.embed_point(x)), 0, 1e-12)
