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
    close(cga2.line_direction(2 * line), 2 * d)
    normal, distance = cga2.line_to_normal(3 * line)
    close(normal, n)
    close(distance, dot(n, a))
    close(cga2.line_support(line), dot(n, a)[:, None] * n)
    close(cga2.line_polarity(line), cga2.dual_line_from_normal(left(d), dot(left(d), a)))
    close(cga2.line_from_dual(cga2.line_polarity(line)), line, 0)
    close(cga2.circle_kind(cga2.circle_from_line(line)), 2, 0)
    bisector = cga2.bisector_line(a, b)
    close(cga2.reflect_point(a, bisector), b)
    close(cga2.point_from_flat_point(-2 * cga2.flat_point_from_point(a)), a)


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
    dual = cga2.circle_polarity(circle)
    close(dual, cga2.embed_point(c) - r2[:, None] / 2 * np.eye(4)[3])
    close(cga2.circle_from_dual(dual), circle)
    close(cga2.point_pair_line(pair), cga2.line_from_point_direction(c, d))


def test_rounds_through_points(rng: np.random.Generator) -> None:
    a, b, c = vectors(rng, 3)
    pair = cga2.point_pair_from_points(a, b)
    p, q = cga2.point_pair_points(pair)
    close(p, a, 1e-7)
    close(q, b, 1e-7)
    circle = cga2.circle_from_points(a, b, c)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    close(cga2.circle_weight(circle), area)
    squares = np.stack([dot(b, b) - dot(a, a), dot(c, c) - dot(a, a)], -1)[..., None]
    centre = np.linalg.solve(2 * np.stack([b - a, c - a], 1), squares)[..., 0]
    good = np.abs(area) > 0.05
    close(cga2.circle_centre(circle)[good], centre[good], 1e-7)
    close(cga2.circle_radius_squared(circle)[good], dot(a - centre, a - centre)[good], 1e-6)
    close(cga2.point_pair_kind(cga2.point_pair_from_centre(a, b, 0.0)), 0, 0)
    close(cga2.point_pair_kind([0, 0, 0, 1, 2, 1.0]), 2, 0)


def test_distances_projections_and_angles(rng: np.random.Generator) -> None:
    x = vectors(rng, 1)[0]
    (p, d, line), (q, e, other) = lines(rng), lines(rng)
    (c, r, circle), (k, s, two) = circles(rng), circles(rng)
    n = left(d)
    height = dot(x - p, n)
    close(cga2.signed_distance_point_line(x, line), height)
    close(cga2.project_point_on_line(x, line), x - height[:, None] * n)
    nearest = c + r[:, None] * unit(x - c)
    close(cga2.signed_distance_point_circle(x, circle), length(x - c) - r)
    close(cga2.project_point_on_circle(x, circle), nearest)
    close(cga2.power_of_point(x, 2 * cga2.circle_polarity(circle)), dot(x - c, x - c) - r**2)
    close(cga2.signed_distance_lines(line, other), 0, 0)
    close(cga2.signed_distance_lines(line, cga2.line_from_point_direction(q, -3 * d)), dot(q - p, n))
    close(cga2.signed_distance_lines(line, cga2.line_from_point_direction(q, 3 * d)), dot(q - p, n))
    close(cga2.distance_line_circle(line, circle), np.maximum(0, np.abs(dot(c - p, n)) - r))
    gap = length(c - k)
    close(cga2.distance_circles(circle, two), np.max([0 * r, gap - r - s, np.abs(r - s) - gap], 0))
    angle = np.angle((e @ [1, 1j]) / (d @ [1, 1j]))
    close(cga2.angle_between_lines(line, other), angle)
    ratio = (gap**2 - r**2 - s**2) / (2 * r * s)
    duals = cga2.circle_polarity(circle) / -1.5, cga2.circle_polarity(two) / -1.5
    close(cga2.inversive_distance(*duals), ratio)
    meets = np.abs(ratio) < 1
    close(cga2.angle_between_dual_circles(*duals)[meets], np.arccos(-ratio[meets]), 1e-7)


def test_meets_lie_on_both(rng: np.random.Generator) -> None:
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


def duals(rng: np.random.Generator) -> Any:
    one, two = np.array([1.0, 0]), np.array([0, 1.0])
    circle = [cga2.circle_polarity(cga2.circle_from_centre(c, r)) for c, r in (
        (O, 1.0), (X, 1.0), (2 * X, 1.0), (X / 2, 0.5), (3 * X, 1.0), (X / 4, 0.5), (O, 2.0))]  # fmt: skip
    normals = (one, 0.5), (one, 1.0), (-one, 2.0), (two, 0.0), (one, 0.0), (two + 1e-9 * one, 0.0), (-3 * one, 0.0)
    line = [np.insert(cga2.dual_line_from_normal(n, d), 2, 0) for n, d in normals]
    ring, axis = circle[0], line[4]
    cases = [(ring, circle[1], 1), (ring, circle[2], 0), (ring, circle[3], 0), (ring, circle[4], -1)]
    cases += [(ring, circle[5], -1), (ring, circle[6], 2), (ring, ring, 3), (ring, line[0], 1), (ring, line[1], 0)]
    cases += [(ring, line[2], -1), (axis, line[3], 1), (line[3], line[5], 1), (axis, line[1], 2)]
    return [*cases, (axis, line[6], 3)]


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e3])
def test_kinds_of_meets(rng: np.random.Generator, scale: float) -> None:
    """Test the objects also translated, rotated, scaled, with other weights and exchanged."""
    v, _ = random_versors(rng)
    motor = cga2.motor_from_rotor_translation(cga2.versor_decomposition(v)[1], 3 * rng.normal(size=(N, 2)))
    dilator = cga2.versor_from_dilator(cga2.dilator_from_scale(np.full(N, scale)))
    v = cga2.even_product(dilator, cga2.versor_from_motor(motor))
    weights = rng.choice([-1, 1], (2, N, 1)) * 10 ** rng.uniform(-3, 3, (2, N, 1))
    for first, second, expected in duals(rng):
        assert cga2.meet_dual_circles_kind(first, second) == expected
        one, two = (weight * cga2.transform_vector(v, x) for weight, x in zip(weights, (first, second), strict=True))
        close(cga2.meet_dual_circles_kind(one, two), expected, 0)
        close(cga2.meet_dual_circles_kind(two, one), expected, 0)
    (c, r, circle), (k, s, two) = circles(rng), circles(rng)
    p, d, line = lines(rng)
    gap = length(c - k)
    one, two, line = (cga2.circle_polarity(x) for x in (circle, two, cga2.circle_from_line(line)))
    close(cga2.meet_dual_circles_kind(one, two), np.where((gap < r + s) & (gap > np.abs(r - s)), 1, -1), 0)
    close(cga2.meet_dual_circles_kind(one, line), np.where(np.abs(dot(c - p, left(d))) < r, 1, -1), 0)
    assert np.isnan(cga2.meet_dual_circles_kind(np.full(4, np.nan), np.ones(4)))


def test_first_hits(rng: np.random.Generator) -> None:
    o, d = vectors(rng, 2)
    c, r, circle = circles(rng)
    b, q = dot(d, o - c), dot(o - c, o - c) - r**2
    with np.errstate(invalid="ignore"):
        root = np.sqrt(b * b - dot(d, d) * q)
        low, high = (-b - root) / dot(d, d), (-b + root) / dot(d, d)
        expected = np.where(low >= 0, low, np.where(high >= 0, high, np.nan))
        close(cga2.hit_ray_circle(o, d, circle), expected, 1e-7)


def as_complex(x: Any) -> Any:
    return x[..., 0] + 1j * x[..., 1]


def from_parts(scale: Any, rotor: Any, t: Any, b: Any) -> Any:
    """Transversion, dilation, rotation, translation."""
    dilator = cga2.versor_from_dilator(cga2.dilator_from_scale(scale))
    transversor = cga2.versor_from_transversor(cga2.transversor_from_vector(b))
    motor = cga2.versor_from_motor(cga2.motor_from_rotor_translation(rotor, t))
    return cga2.even_product(motor, cga2.even_product(dilator, transversor))


def random_versors(rng: np.random.Generator) -> tuple[Any, Any]:
    """Versors and the same maps of complex numbers: ``z -> a z / (1 - conj(b) z) + t``."""
    scale, angle = np.exp(rng.normal(size=N) / 2), rng.uniform(-3, 3, N)
    t, b = vectors(rng, 2)
    v = from_parts(scale, cga2.rotor_from_angle(angle), t, b)
    a, t, b = scale * np.exp(1j * angle), as_complex(t), as_complex(b)
    return v, lambda z: a * z / (1 - np.conj(b) * z) + t


def test_versors_are_moebius_maps(rng: np.random.Generator) -> None:
    v, image = random_versors(rng)
    a, b, c = vectors(rng, 3)
    w = image(as_complex(a))
    found = as_complex(cga2.transform_point(v, a))
    assert np.median(np.abs(found - w)) < 1e-14 * 100
    close(found / np.maximum(1, np.abs(w)), w / np.maximum(1, np.abs(w)), 1e-7)
    close(from_parts(*cga2.versor_decomposition(-v)), -v, 1e-8)
    general = cga2.versor_exponential(rng.normal(size=(N, 6)) / 2)
    close(from_parts(*cga2.versor_decomposition(general)), general, 1e-6)
    close(cga2.versor_exponential(cga2.versor_logarithm(general)), general * np.where(general[:, :1] < 0, -1, 1), 1e-7)
    close(cga2.normalize_versor(3 * general), general, 1e-8)
    x, y, z = (cga2.transform_point(v, p) for p in (a, b, c))
    same_blade(cga2.transform_point_pair(v, cga2.point_pair_from_points(a, b)), cga2.point_pair_from_points(x, y), 1e-5)
    same_blade(cga2.transform_circle(v, cga2.circle_from_points(a, b, c)), cga2.circle_from_points(x, y, z), 1e-4)
    same_blade(cga2.transform_vector(v, cga2.embed_point(a)), cga2.embed_point(x), 1e-7)
    p, q = cga2.point_pair_from_points(a, b), cga2.point_pair_from_points(b + 1, c)
    moved = cga2.transform_point_pair(v, p), cga2.transform_point_pair(v, q)
    close(cga2.inner_product_of_point_pairs(*moved), cga2.inner_product_of_point_pairs(p, q), 1e-4)


def test_transversions_are_those_of_complex_numbers(rng: np.random.Generator) -> None:
    b, x = vectors(rng, 2)
    k = cga2.versor_from_transversor(cga2.transversor_from_vector(b))
    z = as_complex(x)
    image = z / (1 - np.conj(as_complex(b)) * z)
    size = np.maximum(1, np.abs(image))
    close(as_complex(cga2.transform_point(k, x)) / size, image / size, 1e-8)
    pair = cga2.point_pair_from_points(b, x)
    close(cga2.point_pair_centre(-3 * pair), (b + x) / 2)
    close(cga2.point_pair_radius_squared(-3 * pair), dot(b - x, b - x) / 4)


def test_motors(rng: np.random.Generator) -> None:
    angle = np.r_[rng.uniform(-3, 3, N - 5), 0, 1e-12, np.pi - 1e-12, np.pi / 2, 1e-7]
    p, x, t = vectors(rng, 3)
    turn = np.exp(1j * angle)
    m = cga2.motor_from_point(p, angle)
    moved = turn * as_complex(x - p) + as_complex(p)
    close(as_complex(cga2.move_point(m, x)), moved, 1e-11)
    close(cga2.rotor_to_angle(cga2.rotor_from_angle(angle)), angle, 1e-14)
    v = cga2.versor_from_motor(m)
    close(cga2.versor_exponential(cga2.versor_logarithm(v)), v, 1e-12)
    back = cga2.even_product(cga2.even_reverse(v), v)
    close(back, np.eye(8)[0], 1e-12)
    close(cga2.transform_point(v, x), cga2.move_point(m, x), 1e-11)
    ends = cga2.move_point(m, x), cga2.move_point(m, t)
    same_blade(cga2.move_line(m, cga2.line_from_points(x, t)), cga2.line_from_points(*ends))
    scale = np.exp(rng.normal(size=N))
    dilator = cga2.dilator_from_scale(scale)
    close(cga2.dilator_to_scale(dilator), scale, 1e-12)
    close(cga2.transform_point(cga2.versor_from_dilator(dilator), x), scale[:, None] * x)
    close(cga2.translator_from_vector(t), cga2.translator_between_points(x, x + t), 1e-12)
    close(cga2.versor_from_motor(cga2.motor_from_rotor_translation([1, 0], t))[:, 4:6], cga2.translator_from_vector(t))
    c, r, circle = circles(rng)
    centre = cga2.move_point(m, c)
    close(cga2.move_circle(m, circle), -1.5 * cga2.circle_from_centre(centre, r), 1e-10)


def test_parts_and_powers_of_motors(rng: np.random.Generator) -> None:
    """Compare with complex numbers ``turn z + t``; full turns, half turns, pure translations and 1e-12 from them."""
    ends = [0, 1e-12, -1e-12, 2 * np.pi - 1e-12, np.pi - 1e-12, 1e-7, 6.0, -6.0]
    angle = np.r_[rng.uniform(-2 * np.pi, 2 * np.pi, N - len(ends)), ends]
    x, t, u = vectors(rng, 3)
    turn = np.exp(1j * angle)
    m = cga2.motor_from_rotor_translation(cga2.rotor_from_angle(angle), t)
    rotor, translation = cga2.motor_to_rotor_translation(m)
    close(rotor, np.stack([np.cos(angle / 2), -np.sin(angle / 2)], -1), 1e-14)
    close(translation, t, 1e-13)
    moved = turn * as_complex(x) + as_complex(t)
    column = np.concatenate([x, np.ones((N, 1))], -1)[..., None]
    close(as_complex((cga2.motor_to_matrix(m) @ column)[..., 0]), moved, 1e-13)
    close(cga2.motor_product(cga2.motor_inverse(m), m), np.eye(4)[0], 1e-14)
    logarithm = cga2.motor_logarithm(m)
    back = cga2.motor_exponential(logarithm)
    close(np.minimum(np.abs(back - m).max(-1), np.abs(back + m).max(-1)) / (1 + length(t)), 0, 1e-14)
    close(np.abs(logarithm[:, 0]), np.abs(np.angle(turn)) / 2, 1e-13)
    root = cga2.motor_square_root(m)
    twice = cga2.motor_product(root, root)
    close(as_complex(cga2.move_point(twice, x)), moved, 1e-9)
    part = rng.uniform(-2, 2, N)
    clear = np.abs(np.abs(angle) - np.pi) > 1e-6  # half turns have two senses
    power = cga2.motor_power(m, part)
    near = np.angle(turn)
    close(as_complex(power[:, :2])[clear], (np.exp(-0.5j * part * near))[clear], 1e-12)
    close(
        cga2.motor_product(power, cga2.motor_power(m, 1 - part))[clear],
        (np.sign(np.cos(angle / 2))[:, None] * m)[clear],
        1e-9,
    )
    other = cga2.motor_from_rotor_translation(cga2.rotor_from_angle(angle + 0.5), u)
    middle = cga2.interpolate_motors(m, -other, 0.25)
    close(as_complex(middle[:, :2]) ** 2, np.exp(-1j * (angle + 0.125)), 1e-12)
    for at, end in ((0.0, m), (1.0, other)):
        reached = cga2.interpolate_motors(m, other, at)
        close(cga2.move_point(reached, x), cga2.move_point(end, x), 1e-9)
    v, _ = random_versors(rng)
    half = cga2.versor_square_root(v)
    good = v[:, 0] > 0.1
    close(cga2.even_product(half, half)[good], v[good], 1e-8)


def test_parts_of_rounds_and_simple_motions(rng: np.random.Generator) -> None:
    a, b, n = vectors(rng, 3)
    close(cga2.inner_product_of_points(a, b), -dot(a - b, a - b) / 2)
    close(cga2.line_from_point_normal(a, n), cga2.line_from_normal(n, dot(n, a)))
    c, r, circle = circles(rng)
    dual = cga2.dual_circle_from_centre(c, r)
    close(dual, np.c_[c, np.ones(N), (dot(c, c) - r**2) / 2])
    close(cga2.dual_circle_through_point(c, c + r[:, None] * unit(n)), dual)
    close(cga2.dual_circle_radius_squared(-3 * dual), r**2)
    close(cga2.dual_circle_radius_squared(dual + 10 * np.eye(4)[3]), r**2 - 20)
    touching = c + r[:, None] * unit(n)
    same_line = cga2.tangent_line_of_circle(circle, touching)
    close(np.abs(cga2.signed_distance_point_line(touching, same_line)), 0, 1e-8)
    close(np.abs(cga2.signed_distance_point_line(c, same_line)), r, 1e-8)
    around = cga2.point_pair_surround_circle(-2 * cga2.point_pair_from_points(a, b))
    close(around, cga2.dual_circle_from_centre((a + b) / 2, length(a - b) / 2), 1e-8)
    angle, scale = rng.uniform(-6, 6, N), np.exp(rng.normal(size=N))
    close(as_complex(cga2.rotate_point(cga2.rotor_from_angle(angle), a)), np.exp(1j * angle) * as_complex(a), 1e-12)
    close(cga2.translate_point(cga2.translator_from_vector(b), a), a + b, 1e-12)
    close(cga2.dilate_point(cga2.dilator_from_scale(scale), a), scale[:, None] * a, 1e-11)
    m = cga2.motor_from_rotor_translation(cga2.rotor_from_angle(angle), n)
    x, y = cga2.move_point(m, a), cga2.move_point(m, b)
    close(cga2.move_vector(m, cga2.embed_point(a)), cga2.embed_point(x), 1e-11)
    close(cga2.move_point_pair(m, cga2.point_pair_from_points(a, b)), cga2.point_pair_from_points(x, y), 1e-9)


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
    image_of = cga2.invert_circle(cga2.circle_from_line(cga2.line_from_points(a, b)), np.insert(mirror, 2, 0, -1))
    same_blade(image_of, cga2.circle_from_line(cga2.line_from_points(x, y)), 1e-7)


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
    assert np.isnan(cga2.versor_between_circles(circle, cga2.circle_from_centre_radius_squared(a, -1.0))).all()


def test_products_are_consistent(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, N, 16))
    close(cga2.reverse(cga2.geometric_product(a, b)), cga2.geometric_product(cga2.reverse(b), cga2.reverse(a)))
    close(cga2.undual(cga2.dual(a)), a, 0)
    meet = cga2.dual(cga2.regressive_product(a, b))
    close(meet, cga2.outer_product(cga2.dual(a), cga2.dual(b)))
    close(cga2.polarity(cga2.polarity(a)), -a)
    x, y = vectors(rng, 2)
    close(cga2.distance_points(x, y), length(x - y))
    close(cga2.distance_squared_points(x, y), dot(x - y, x - y))
    close(cga2.extract_point(-3 * cga2.embed_point(x)), x)
    close(cga2.normalize_vector(-3 * cga2.embed_point(x)), cga2.embed_point(x))
    close(cga2.inner_product_of_vectors(cga2.embed_point(x), cga2.embed_point(x)), 0, 1e-12)
