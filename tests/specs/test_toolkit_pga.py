"""Points, lines and planes of the generated G(3,0,1) and G(2,0,1) against vector algebra, degenerate cases included."""

from __future__ import annotations

import numpy as np
import pytest
from toolkit_truth import (
    N,
    along,
    apply,
    close,
    directions,
    dot,
    length,
    line_of,
    perpendicular,
    plane_of,
    poses,
    turn,
    unit,
    up_to_sign,
)

from generated import pga2, pga3, projective3

ORIGIN = np.zeros(3)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(301)


def planar(rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Points p, q, unit directions d and their normals to the left, of the plane."""
    p, q = rng.normal(size=(2, N, 2)) * 3
    d = directions(rng, N, 2)
    return p, q, d, np.stack([-d[:, 1], d[:, 0]], -1)


# Numbers into lines and planes, and back


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_lines_and_planes_from_numbers_and_back(rng: np.random.Generator, scale: float) -> None:
    p, d, n = rng.normal(size=(N, 3)) * scale, directions(rng), directions(rng)
    factor = rng.uniform(0.1, 5, N)
    lines = line_of(p, along(factor, d))
    close(pga3.line_from_direction_moment(along(factor, d), np.cross(p, along(factor, d))), lines, 0)
    direction, moment = pga3.line_to_direction_moment(lines)
    close(direction, along(factor, d), 0)
    close(moment, np.cross(p, along(factor, d)), 0)
    close(pga3.plucker_residual(lines), 0, 1e-13 * scale * 5)
    bivectors = rng.normal(size=(N, 6))
    z, y, x, u, v, w = bivectors.T
    close(pga3.plucker_residual(bivectors), x * u - y * v + z * w, 1e-14)
    support = p - along(dot(p, d), d)
    close(pga3.line_support(lines), support, 1e-13 * scale)
    s = rng.normal(size=N) * scale
    close(pga3.point_on_line(line_of(p, d), s), support + along(s, d), 1e-13 * scale)
    close(pga3.position_along_line(p, line_of(p, d)), dot(p, d), 1e-14 * scale)
    planes = plane_of(along(factor, n), p)
    close(pga3.plane_from_normal(n, s), np.column_stack([n, -s]), 0)
    close(pga3.plane_from_point_normal(p, along(factor, n)), planes, 1e-13 * scale)
    normal, distance = pga3.plane_to_normal(planes)
    close(normal, n, 1e-15)
    close(distance, dot(n, p), 1e-14 * scale)
    close(pga3.plane_support(planes), along(dot(n, p), n), 1e-13 * scale)
    plane = pga3.join_point_directions(p, d, n)
    close(plane, plane_of(np.cross(d, n), p), 1e-13 * scale)
    close(pga3.join_point_directions(p, d, 2 * d), np.zeros((N, 4)), 1e-15 * scale)


def test_bisectors_and_midpoints(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, N, 3)) * 3
    close(pga3.midpoint(a, b), (a + b) / 2, 1e-15)
    close(pga3.bisector_plane(a, b), plane_of(b - a, (a + b) / 2), 1e-13)
    close(pga3.bisector_plane(a, a), np.zeros((N, 4)), 0)
    n, m = directions(rng), directions(rng)[::-1]
    p, q = plane_of(n, a), plane_of(m, b)
    equal, opposite = pga3.bisectors_of_planes(p, q)
    x = rng.normal(size=(N, 3))
    close(dot(equal[:, :3], x) + equal[:, 3], dot(x - a, n) - dot(x - b, m), 1e-13)
    close(dot(opposite[:, :3], x) + opposite[:, 3], dot(x - a, n) + dot(x - b, m), 1e-13)


# Distances, angles, closest points


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_distances_and_closest_points_of_skew_and_crossing_lines(rng: np.random.Generator, scale: float) -> None:
    a, offset = rng.normal(size=(N, 3)) * scale, np.abs(rng.normal(size=N)) * scale
    offset[:50] = 0
    d = directions(rng)
    across = perpendicular(d)
    turned = rng.uniform(0.1, 3.0, N)
    e = along(np.cos(turned), d) + along(np.sin(turned), np.cross(across, d))
    one, other = a + along(rng.normal(size=N) * scale, d), a + along(offset, across)
    first, second = line_of(one, d), line_of(other + along(rng.normal(size=N) * scale, e), e)
    tolerance = 3e-13 * scale
    close(pga3.distance_lines(first, second), offset, tolerance)
    close(pga3.signed_distance_lines(first, second), dot(other - a, unit(np.cross(d, e))), tolerance)
    p, q = pga3.closest_points_of_lines(first, second)
    close(p, a, 10 * tolerance)
    close(q, other, 10 * tolerance)
    close(pga3.common_perpendicular(first, second)[:, :3], line_of(a, unit(np.cross(d, e)))[:, :3], 1e-13)
    close(pga3.common_perpendicular(first, second), line_of(a, unit(np.cross(d, e))), max(1e-12, 10 * tolerance))
    weighted = pga3.meet_lines(first, second)
    close(weighted[:, 0], np.sin(turned) ** 2, 1e-14)
    close(pga3.point_from_trivector(weighted), (a + other) / 2, 10 * tolerance)
    met = offset == 0
    kinds = pga3.relation_of_lines(first, second, 1e-9 * scale, 1e-9)
    assert np.array_equal(kinds, np.where(met, 2, 3))
    plane = pga3.join_lines(first[met], second[met])
    close(plane, plane_of(unit(np.cross(d, e)), a)[met], max(1e-12, 10 * tolerance))


@pytest.mark.parametrize("sign", [1, -1])
def test_parallel_and_coincident_lines(rng: np.random.Generator, sign: int) -> None:
    a, d = rng.normal(size=(N, 3)) * 3, directions(rng)
    across = perpendicular(d)
    offset = np.abs(rng.normal(size=N)) + 0.01
    offset[::2] = 0
    first = line_of(a, d)
    second = line_of(a + along(offset, across) + along(rng.normal(size=N), d), sign * d)
    same = offset == 0
    close(pga3.distance_lines(first, second), offset, 1e-13)
    close(pga3.signed_distance_lines(first, second), offset, 1e-13)
    p, q = pga3.closest_points_of_lines(first, second)
    support = a - along(dot(a, d), d)
    close(p, support, 1e-13)
    close(q, support + along(offset, across), 1e-13)
    close(pga3.common_perpendicular(first, second)[~same], line_of(support, across)[~same], 1e-11)
    kinds = pga3.relation_of_lines(first, second, 1e-9, 1e-9)
    assert np.array_equal(kinds, np.where(same, 0, 1))
    close(pga3.meet_lines(first, second)[:, 0], 0, 1e-30)
    close(pga3.join_lines(first, second)[~same], plane_of(np.cross(d, across), a)[~same], 1e-10)
    exact = line_of(np.array([1.0, 2, 3]), np.array([0.0, 0, 1]))
    assert np.isnan(pga3.join_lines(exact, exact)).all()
    assert np.isnan(pga3.common_perpendicular(exact, exact)).all()


def test_nearly_parallel_lines_keep_the_distance_that_their_directions_determine() -> None:
    """x axis, and a line above it turned by a small angle about z: the distance is the height, at the z axis."""
    angle = np.array([1e-2, 1e-5, 1e-8, 1e-10, 1e-11])
    turned = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
    lines = line_of(np.array([0, 0, 0.5]), turned)
    axis = line_of(ORIGIN, np.array([1.0, 0, 0]))
    close(pga3.distance_lines(axis, lines), 0.5, 1e-15)
    p, q = pga3.closest_points_of_lines(axis, lines)
    close(p, np.zeros((5, 3)), 1e-15)
    close(q, np.tile([0, 0, 0.5], (5, 1)), 1e-15)
    close(pga3.angle_between_lines(axis, lines), angle, 1e-16)


def test_distances_and_angles_of_lines_and_planes(rng: np.random.Generator) -> None:
    p, q = rng.normal(size=(2, N, 3)) * 3
    n, d = directions(rng), rng.permutation(directions(rng))
    plane, line = plane_of(n, p), line_of(q, d)
    close(pga3.signed_angle_line_plane(line, plane), np.arcsin(np.clip(dot(n, d), -1, 1)), 1e-7)
    general = np.abs(dot(n, d)) < 0.9
    close(pga3.signed_angle_line_plane(line, plane)[general], np.arcsin(dot(n, d))[general], 1e-15)
    skew = np.abs(dot(n, d)) > 1e-3
    assert np.all(pga3.signed_distance_line_plane(line, plane)[skew] == 0)
    flat = perpendicular(n)
    beside = line_of(q, flat)
    close(pga3.signed_distance_line_plane(beside, plane), dot(q - p, n), 1e-13)
    inside = line_of(p, flat)
    close(pga3.signed_distance_line_plane(inside, plane), 0, 1e-14)
    close(pga3.signed_angle_line_plane(beside, plane), 0, 1e-15)
    close(pga3.signed_angle_line_plane(line_of(q, -n), plane), -np.pi / 2, 1e-15)
    assert np.all(pga3.relation_of_line_plane(line, plane, 1e-9, 1e-9)[skew] == 2)
    assert np.all(pga3.relation_of_line_plane(beside, plane, 1e-9, 1e-9) == 1)
    assert np.all(pga3.relation_of_line_plane(inside, plane, 1e-9, 1e-9) == 0)


def test_distances_angles_and_relations_of_planes(rng: np.random.Generator) -> None:
    p, q = rng.normal(size=(2, N, 3)) * 3
    n, m = directions(rng), rng.permutation(directions(rng))
    one, other = plane_of(n, p), plane_of(m, q)
    skew = np.abs(dot(n, m)) < 1 - 1e-6
    assert np.all(pga3.signed_distance_planes(one, other)[skew] == 0)
    assert np.all(pga3.relation_of_planes(one, other, 1e-9, 1e-9)[skew] == 2)
    for sign in (1, -1):
        beside, same = plane_of(sign * n, q), plane_of(sign * n, p)
        close(pga3.signed_distance_planes(one, beside), dot(q - p, n), 1e-13)
        assert np.all(pga3.relation_of_planes(one, beside, 1e-9, 1e-9) == 1)
        assert np.all(pga3.relation_of_planes(one, same, 1e-9, 1e-9) == 0)
    angle = rng.uniform(-3.1, 3.1, N)
    axis = perpendicular(n)
    turned = along(np.cos(angle), n) + along(np.sin(angle), np.cross(axis, n))
    for factor in (1, 1e-3):
        close(pga3.signed_angle_between_planes(one, plane_of(turned, q), factor * axis), angle, 1e-14)
        close(pga3.signed_angle_between_lines(line_of(p, n), line_of(q, turned), factor * axis), angle, 1e-14)
        close(pga3.signed_angle_between_lines(line_of(p, n), line_of(q, turned), -factor * axis), -angle, 1e-14)


def test_what_three_planes_have_in_common(rng: np.random.Generator) -> None:
    p, n, m = rng.normal(size=(N, 3)) * 3, directions(rng), rng.permutation(directions(rng))
    m = np.where(np.abs(dot(n, m))[:, None] > 0.99, perpendicular(n), m)
    axis = unit(np.cross(n, m))
    third = unit(along(rng.normal(size=N), n) + along(rng.normal(size=N), m))
    off = along(rng.uniform(0.1, 3, N), unit(third))
    tilted = unit(third + along(rng.uniform(0.1, 1, N), axis))
    one, other = plane_of(n, p), plane_of(m, p)
    cases = (
        (0, one, -one, one),
        (1, one, plane_of(-n, p + n), one),
        (1, one, plane_of(n, p - n), plane_of(-n, p + n)),
        (2, one, other, plane_of(third, p)),
        (2, one, one, other),
        (3, one, other, plane_of(third, p + off)),
        (3, one, plane_of(-n, p + n), other),
        (4, one, other, plane_of(tilted, p)),
    )
    for kind, *planes in cases:
        for order in ((0, 1, 2), (1, 2, 0), (2, 1, 0)):
            found = pga3.relation_of_three_planes(*(planes[k] for k in order), 1e-9, 1e-9)
            assert np.all(found == kind), (kind, order, np.unique(found))
    close(pga3.point_from_trivector(pga3.meet_three_planes(one, other, plane_of(tilted, p))), p, 1e-9)


# Projections, rejections, reflections


def test_rejections_complete_projections(rng: np.random.Generator) -> None:
    p, q = rng.normal(size=(2, N, 3)) * 3
    n, d = directions(rng), rng.permutation(directions(rng))
    plane, line, base = plane_of(n, p), line_of(q, d), line_of(p, n)
    close(pga3.reject_point_from_plane(q, plane), along(dot(q - p, n), n), 1e-13)
    close(pga3.reject_point_from_line(q, base), q - p - along(dot(q - p, n), n), 1e-13)
    close(pga3.project_line_on_unit_plane(line, plane) + pga3.reject_line_from_plane(line, plane), line, 1e-12)
    meets = np.abs(dot(n, d)) > 1e-3
    where = q + along(dot(p - q, n) / np.where(meets, dot(n, d), 1), d)
    close(pga3.reject_line_from_plane(line, plane)[meets], line_of(where, along(dot(n, d), n))[meets], 1e-11)
    close(pga3.reject_line_from_plane(line_of(p, perpendicular(n)), plane), np.zeros((N, 6)), 1e-13)
    close(pga3.project_line_on_point(line, p), line_of(p, d), 1e-14)
    m = rng.permutation(n)
    any_plane = plane_of(m, q)
    projected, rejected = pga3.project_plane_on_line(any_plane, base), pga3.reject_plane_from_line(any_plane, base)
    close(projected, plane_of(m - along(dot(m, n), n), p), 1e-12)
    close(projected + rejected, any_plane, 1e-12)
    close(rejected[:, :3], along(dot(m, n), n), 1e-14)


def test_reflections_in_planes_lines_and_points(rng: np.random.Generator) -> None:
    a, p = rng.normal(size=(2, N, 3)) * 3
    n, d, m = directions(rng), rng.permutation(directions(rng)), rng.permutation(directions(rng))
    mirror, axis = plane_of(n, a), line_of(a, n)

    def in_plane(v: np.ndarray) -> np.ndarray:
        return np.asarray(v - along(2 * dot(v, n), n))

    def about_line(v: np.ndarray) -> np.ndarray:
        return np.asarray(along(2 * dot(v, n), n) - v)

    image = a + in_plane(p - a)
    close(pga3.reflect_point(p, mirror), image, 1e-12)
    close(pga3.reflect_line(line_of(p, d), mirror), line_of(image, in_plane(d)), 1e-12)
    close(pga3.reflect_plane(plane_of(m, p), mirror), plane_of(in_plane(m), image), 1e-12)
    image = a + about_line(p - a)
    close(pga3.reflect_point_in_line(p, axis), image, 1e-12)
    close(pga3.reflect_line_in_line(line_of(p, d), axis), line_of(image, about_line(d)), 1e-12)
    close(pga3.reflect_plane_in_line(plane_of(m, p), axis), plane_of(about_line(m), image), 1e-12)
    image = 2 * a - p
    close(pga3.reflect_point_in_point(p, a), image, 1e-14)
    close(pga3.reflect_line_in_point(line_of(p, d), a), line_of(image, -d), 1e-13)
    close(pga3.reflect_plane_in_point(plane_of(m, p), a), plane_of(-m, image), 1e-13)


# Containment and orientation


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_collinear_and_coplanar_residuals_are_heights(rng: np.random.Generator, scale: float) -> None:
    a, b, c, d = rng.normal(size=(4, N, 3)) * scale
    twice = length(np.cross(b - a, c - a))
    sides = np.max([length(b - a), length(c - b), length(a - c)], 0)
    close(pga3.collinearity_residual(a, b, c), twice / sides, 1e-14 * scale)
    volume = dot(np.cross(b - a, c - a), d - a)
    corners = ((a, b, d), (a, c, d), (b, c, d))
    faces = np.max([twice, *(length(np.cross(y - x, z - x)) for x, y, z in corners)], 0)
    close(pga3.coplanarity_residual(a, b, c, d), volume / faces, 2e-14 * scale)
    t = rng.normal(size=N)
    close(pga3.collinearity_residual(a, b, a + along(t, b - a)), 0, 1e-13 * scale)
    close(pga3.coplanarity_residual(a, b, c, a + along(t, b - a) + c - b), 0, 1e-13 * scale)
    assert np.all(pga3.collinearity_residual(a, a, a) == 0) and np.all(pga3.coplanarity_residual(a, a, a, a) == 0)


def test_flags(rng: np.random.Generator) -> None:
    matrices = poses(rng)
    motors = pga3.motor_from_matrix(matrices)
    p, line, plane = pga3.flag_from_motor(motors)
    t, x, z = matrices[:, :3, 3], matrices[:, :3, 0], matrices[:, :3, 2]
    close(p, t, 1e-13)
    close(line, line_of(t, x), 1e-13)
    close(plane, plane_of(z, t), 1e-13)
    up_to_sign(pga3.motor_from_flag(p, line, plane), motors, 1e-13)
    for residual in pga3.flag_residuals(p, line, plane):
        close(residual, 0, 1e-13)
    off, above, sine = pga3.flag_residuals(t + 2 * z, line, plane_of(unit(x + z), t))
    close(off, 2, 1e-13)
    close(above, np.sqrt(2), 1e-13)
    close(sine, np.sqrt(0.5), 1e-14)
    b = t + along(rng.uniform(0.1, 3, N), x)
    c = t + along(rng.normal(size=N), x) + along(rng.uniform(0.1, 3, N), matrices[:, :3, 1])
    point, through, side = pga3.flag_from_points(t, b, c)
    close(point, t, 0)
    close(through, line_of(t, x), 2e-12)
    close(side, plane_of(z, t), 1e-11)
    close(pga3.motor_to_matrix(pga3.motor_from_points(t, b, c)), matrices, 1e-11)
    assert np.isnan(pga3.motor_from_points(ORIGIN, [1, 0, 0], [2, 0, 0])).any()


# Rays


def test_rays_hit_planes_and_triangles(rng: np.random.Generator) -> None:
    p, a, b, c = rng.normal(size=(4, N, 3))
    d = directions(rng)
    normal = np.cross(b - a, c - a)
    plane = plane_of(normal, a)
    t, where = pga3.hit_ray_plane(p, d, plane)
    fine = np.abs(dot(unit(normal), d)) > 1e-3
    expected = dot(a - p, normal) / dot(d, normal)
    close(t[fine], expected[fine], 1e-9)
    close(where[fine], (p + along(expected, d))[fine], 1e-9)
    weights = rng.dirichlet([1, 1, 1], N)
    weights[:20] = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0]] * 5)
    target = np.einsum("nk,nkj->nj", weights, np.stack([a, b, c], 1))
    good = length(normal) > 0.1
    t, found = pga3.hit_ray_triangle(p, target - p, a, b, c)
    steep = good & (np.abs(dot(unit(target - p), unit(normal))) > 1e-2)
    assert steep.sum() > 900
    close(t[steep], 1, 1e-10)
    close(found[steep], weights[steep], 1e-10)
    t, found = pga3.hit_ray_triangle(target, target - p, a, b, c)
    close(t[steep], 0, 1e-10)
    outside = along(1.5 * np.ones(N), a) - 0.25 * b - 0.25 * c
    t, found = pga3.hit_ray_triangle(p, outside - p, a, b, c)
    assert np.all(found[steep].min(-1) < -0.2)
    with np.errstate(all="ignore"):
        t, found = pga3.hit_ray_triangle([0, 0, 1], [1, 0, 0], ORIGIN, [1, 0, 0], [0, 1, 0])
        assert not np.isfinite(t) and not np.isfinite(found).any()
        assert np.isinf(pga3.hit_ray_plane([0, 0, 1], [1, 0, 0], [0, 0, 1, 0])[0])
        assert np.isnan(pga3.hit_ray_plane([0, 0, 0], [1, 0, 0], [0, 0, 1, 0])[0])


# Other algebras


def test_forms_in_vectors_of_space_are_exact(rng: np.random.Generator) -> None:
    p, d, e = rng.normal(size=(3, N, 3))
    lines = line_of(p, d)
    vector, moment = pga3.line_to_vector_algebra(lines)
    close(vector, d, 0)
    x, y, z = np.moveaxis(np.cross(p, d), -1, 0)
    close(moment, np.stack([z, -y, x], -1), 0)
    close(pga3.line_from_vector_algebra(vector, moment), lines, 0)
    planes = plane_of(np.cross(d, e), p)
    blade, trivector = pga3.plane_to_vector_algebra(planes)
    wedge = [d[:, i] * e[:, j] - d[:, j] * e[:, i] for i, j in ((0, 1), (0, 2), (1, 2))]
    close(blade, np.stack(wedge, -1), 0)
    close(trivector[:, 0], np.linalg.det(np.stack([p, d, e], 1)), 1e-13)
    close(pga3.plane_from_vector_algebra(blade, trivector), planes, 0)


def test_forms_in_homogeneous_coordinates_are_exact(rng: np.random.Generator) -> None:
    a, b, c = rng.integers(-9, 10, size=(3, N, 3)).astype(float)
    first, second, third = (pga3.point_to_projective(x) for x in (a, b, c))
    close(first, np.column_stack([a, np.ones(N)]), 0)
    close(pga3.direction_to_projective(a), np.column_stack([a, np.zeros(N)]), 0)
    close(pga3.point_from_trivector(pga3.trivector_from_projective(2 * first)), a, 0)
    line = pga3.line_to_projective(pga3.join_points(a, b))
    pairs = ((0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3))
    close(line, np.stack([first[:, i] * second[:, j] - first[:, j] * second[:, i] for i, j in pairs], -1), 0)
    close(line, projective3.join_points(first, second), 0)
    close(pga3.line_from_projective(line), pga3.join_points(a, b), 0)
    plane = pga3.plane_to_projective(pga3.join_three_points(a, b, c))
    for point in (first, second, third):
        close(dot(plane, point), 0, 0)
    close(np.abs(plane), np.abs(projective3.join_three_points(first, second, third)), 0)
    close(pga3.plane_from_projective(plane), pga3.join_three_points(a, b, c), 0)


def test_the_motor_algebra_of_the_book_moves_points_lines_and_planes(rng: np.random.Generator) -> None:
    """``1 + I x``, ``n + I m`` and ``n - I d`` by dual quaternions written as 2 x 2 blocks of quaternion matrices."""
    matrices = poses(rng)
    motors = pga3.motor_from_matrix(matrices)
    p, n = rng.normal(size=(2, N, 3))
    image, turned = apply(matrices, p), turn(matrices, n)
    x = pga3.point_to_motor_algebra(p)
    close(x, -p, 0)
    close(pga3.point_from_motor_algebra(x), p, 0)
    close(pga3.point_from_motor_algebra(pga3.move_point_of_motor_algebra(motors, x)), image, 1e-13)
    lines = line_of(p, n)
    direction, moment = pga3.line_to_motor_algebra(lines)
    close(direction, n, 0)
    close(moment, -np.cross(p, n), 0)
    close(pga3.line_from_motor_algebra(direction, moment), lines, 0)
    planes = plane_of(n, p)
    h = pga3.plane_to_motor_algebra(planes)
    close(h, np.stack([n[:, 2], -n[:, 1], n[:, 0], -dot(n, p)], -1), 0)
    close(pga3.plane_from_motor_algebra(h), planes, 0)
    moved = pga3.plane_from_motor_algebra(pga3.move_plane_of_motor_algebra(motors, h))
    close(moved, plane_of(turned, image), 1e-12)


# The plane


def test_lines_of_the_plane_from_numbers_and_back(rng: np.random.Generator) -> None:
    p, q, d, n = planar(rng)
    factor, s = rng.uniform(0.1, 5, N), rng.normal(size=N)
    line = plane_of(n, p)
    close(pga2.line_from_normal(n, s), np.column_stack([n, -s]), 0)
    close(pga2.line_from_point_normal(p, along(factor, n)), plane_of(along(factor, n), p), 1e-13)
    normal, distance = pga2.line_to_normal(plane_of(along(factor, n), p))
    close(normal, n, 1e-15)
    close(distance, dot(n, p), 1e-14)
    close(pga2.line_direction(line), d, 0)
    close(pga2.join_points(p, p + d), line, 1e-14)
    close(pga2.line_support(plane_of(along(factor, n), p)), along(dot(n, p), n), 1e-13)
    close(pga2.point_on_line(line, s), along(dot(n, p), n) + along(s, d), 1e-13)
    close(pga2.position_along_line(q, line), dot(q, d), 1e-14)
    close(pga2.midpoint(p, q), (p + q) / 2, 0)
    close(pga2.bisector_line(p, q), plane_of(q - p, (p + q) / 2), 1e-13)
    m = rng.permutation(n)
    equal, opposite = pga2.bisectors_of_lines(line, plane_of(m, q))
    close(dot(equal[:, :2], q) + equal[:, 2], dot(q - p, n), 1e-13)
    close(dot(opposite[:, :2], p) + opposite[:, 2], dot(p - q, m), 1e-13)


def test_relations_of_lines_of_the_plane(rng: np.random.Generator) -> None:
    p, q, d, n = planar(rng)
    line = plane_of(n, p)
    tilt = rng.uniform(0.1, 3, N)
    m = along(np.cos(tilt), n) + along(np.sin(tilt), d)
    crossing = plane_of(m, p)
    assert np.all(pga2.signed_distance_lines(line, crossing) == 0)
    assert np.all(pga2.relation_of_lines(line, crossing, 1e-9, 1e-9) == 2)
    for sign in (1, -1):
        beside = plane_of(sign * n, q)
        close(pga2.signed_distance_lines(line, beside), dot(q - p, n), 1e-13)
        assert np.all(pga2.relation_of_lines(line, beside, 1e-9, 1e-9) == 1)
        assert np.all(pga2.relation_of_lines(line, sign * line, 1e-9, 1e-9) == 0)
    third = unit(n + m)
    for kind, *lines in (
        (0, line, -line, line),
        (1, line, plane_of(-n, p + n), line),
        (2, line, crossing, plane_of(third, p)),
        (2, line, line, crossing),
        (3, line, crossing, plane_of(third, p + third)),
        (3, line, plane_of(-n, p + n), crossing),
    ):
        for order in ((0, 1, 2), (1, 2, 0), (2, 1, 0)):
            found = pga2.relation_of_three_lines(*(lines[k] for k in order), 1e-9, 1e-9)
            assert np.all(found == kind), (kind, order, np.unique(found))


def test_projections_and_reflections_of_the_plane(rng: np.random.Generator) -> None:
    p, q, d, n = planar(rng)
    line, m = plane_of(n, p), rng.permutation(n)
    close(pga2.project_line_on_point(line, q), plane_of(n, q), 1e-14)
    close(pga2.reject_point_from_line(q, line), along(dot(q - p, n), n), 1e-13)
    image = q - along(2 * dot(q - p, n), n)
    close(pga2.reflect_point(q, line), image, 1e-13)
    close(pga2.reflect_line(plane_of(m, q), line), plane_of(m - along(2 * dot(m, n), n), image), 1e-12)
    close(pga2.reflect_point_in_point(q, p), 2 * p - q, 1e-14)
    close(pga2.reflect_line_in_point(plane_of(m, q), p), plane_of(-m, 2 * p - q), 1e-13)
    twice = d[:, 0] * (q - p)[:, 1] - d[:, 1] * (q - p)[:, 0]
    sides = np.max([np.ones(N), length(q - p), length(q - p - d)], 0)
    close(pga2.collinearity_residual(p, p + d, q), twice / sides, 1e-13)
    assert np.all(pga2.collinearity_residual(p, p, p) == 0)


def test_flags_and_rays_of_the_plane(rng: np.random.Generator) -> None:
    p, q, d, n = planar(rng)
    angle = np.arctan2(d[:, 1], d[:, 0])
    motors = pga2.motor_from_angle_translation(angle, p)
    point, line = pga2.flag_from_motor(motors)
    close(point, p, 1e-14)
    close(line, plane_of(n, p), 1e-14)
    up_to_sign(pga2.motor_from_flag(p, plane_of(n, p)), motors, 1e-14)
    t, where = pga2.hit_ray_line(q, n, 3 * plane_of(n, p))
    close(t, dot(p - q, n), 1e-13)
    close(where, q + along(t, n), 1e-13)
    s, u = rng.uniform(0, 1, N), rng.uniform(0.5, 2, N)
    b = p + along(u, d)
    target = p + along(s, b - p)
    t, found = pga2.hit_ray_segment(target - 2 * n + 0.3 * d, n - 0.15 * d, p, b)
    close(t, 2, 1e-12)
    close(found, s, 1e-12)
    with np.errstate(all="ignore"):
        assert not np.isfinite(pga2.hit_ray_segment([0, 1], [1, 0], [0, 0], [1, 0])).any()
        assert np.isinf(pga2.hit_ray_line([0, 1], [1, 0], [0, 1, 0])[0])
