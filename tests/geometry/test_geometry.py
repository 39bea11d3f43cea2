"""Geometry of any two kinds, fits and surfaces, against vector formulas, sampled curves and implicit equations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares
from toolkit_truth import N, close, dot, length, perpendicular, unit

from algorithms.geometry import (
    KINDS,
    angle,
    cone,
    cone_over,
    conic,
    conic_type,
    conoid,
    cycloidal_curve,
    distance,
    ellipsoid,
    fit_circle,
    fit_line,
    fit_plane,
    fit_sphere,
    helicoid,
    hyperboloid,
    meet,
    nearest_on_circles,
    project,
    similarity_between,
    sphere_cone_curve,
    versor_between,
)
from algorithms.geometry.circles import nearest_angles
from algorithms.geometry.pairs import ANGLES, DISTANCES, MEETS, PROJECTIONS
from generated import cga2, cga3, pga3
from tests.support.all_cases import all_cases

RNG = np.random.default_rng(11)
UP = np.array([0, 0, 40.0])
TURN = np.linspace(0, 2 * np.pi, 721)[:-1]


def circles(n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Centres, normals, radii, coefficients."""
    centre, normal, radius = rng.normal(size=(n, 3)), unit(rng.normal(size=(n, 3))), np.exp(rng.normal(size=n))
    return centre, normal, radius, cga3.circle_from_centre(centre, normal, radius**2)


def on_circle(centre: Any, normal: Any, radius: Any, turn: Any) -> np.ndarray:
    """Points of a circle, from an independent frame."""
    u = perpendicular(normal)
    v = np.cross(normal, u)
    turn = np.asarray(turn)
    return np.asarray(
        centre[..., None, :]
        + radius[..., None, None]
        * (np.cos(turn)[..., None] * u[..., None, :] + np.sin(turn)[..., None] * v[..., None, :])
    )


def to_circle(p: np.ndarray, centre: Any, normal: Any, radius: Any) -> np.ndarray:
    away = p - centre
    height = dot(away, normal)
    return np.hypot(height, length(away - height[..., None] * normal) - radius)


def least_of_circles(one: Any, two: Any) -> np.ndarray:
    """Sample, then refine the best samples by golden section search, without derivatives and polynomials."""
    parts = [x[:, None] for x in two]
    turn = np.broadcast_to(TURN, (len(one[0]), len(TURN)))
    best = np.argsort(to_circle(on_circle(*one, turn), *parts), -1)[:, :24]
    low = np.take_along_axis(turn, best, -1) - TURN[1]
    high = low + 2 * TURN[1]
    ratio = (np.sqrt(5) - 1) / 2
    for _ in range(60):
        c, d = high - ratio * (high - low), low + ratio * (high - low)
        left = to_circle(on_circle(*one, c), *parts) < to_circle(on_circle(*one, d), *parts)
        low, high = np.where(left, low, c), np.where(left, d, high)
    return to_circle(on_circle(*one, (low + high) / 2), *parts).min(-1)


def test_points_of_circles() -> None:
    centre, normal, radius, circle = circles(N, RNG)
    turn = RNG.uniform(-7, 7, N)
    p, q = cga3.point_on_circle(circle, turn), cga3.point_on_circle(circle, turn + np.pi / 2)
    close(length(p - centre) / radius, 1.0)
    close(dot(p - centre, normal) / radius, 0.0, 1e-11)
    close(dot(np.cross(p - centre, q - centre), normal) / radius**2, 1.0, 1e-11)


@pytest.mark.slow
def test_distances_of_circles_are_those_of_nearest_points() -> None:
    rng = np.random.default_rng(3)
    (*one, a), (*two, b) = circles(N, rng), circles(N, rng)
    found = nearest_on_circles(a, b)
    expected = least_of_circles(one, two)
    close(found.distance, expected, 1e-9)
    close(to_circle(found.on_a, *one), 0.0, 1e-11)
    close(to_circle(found.on_b, *two), 0.0, 1e-11)
    assert not found.everywhere.any()
    close(nearest_on_circles(b, a).distance, found.distance, 1e-12)
    radius, curve = cga3.circle_relative_to_circle(a, b)
    close(radius, two[2], 1e-12)
    close(length(curve[..., 0]), length(one[0] - two[0]), 1e-11)


def test_circles_that_cross_touch_and_lie_about_one_axis() -> None:
    rng = np.random.default_rng(4)
    centre, normal, radius, a = circles(N, rng)
    # through a point of the first, in any direction there
    through = on_circle(centre, normal, radius, np.zeros((N, 1)))[:, 0]
    other, size = unit(rng.normal(size=(N, 3))), np.exp(rng.normal(size=N))
    b = cga3.circle_from_centre(through + size[:, None] * perpendicular(other), other, size**2)
    found = nearest_on_circles(a, b)
    close(found.distance / (radius + size), 0.0, 1e-13)
    # in one plane: apart, touching, inside
    outward = (through - centre) / radius[:, None]
    for gap in (2.0, 0.5, 1e-3, 0.0):
        beside = cga3.circle_from_centre(centre + ((radius + size + gap)[:, None]) * outward, normal, size**2)
        close(nearest_on_circles(a, beside).distance, gap, 1e-7 if gap == 0 else 1e-9)
    inside = cga3.circle_from_centre(centre + 0.25 * radius[:, None] * outward, normal, (radius / 2) ** 2)
    close(nearest_on_circles(a, inside).distance / radius, 0.25, 1e-12)
    # about one axis
    for height, ratio in ((0.0, 1.0), (0.7, 1.0), (0.0, 0.3), (0.7, 0.3)):
        above = cga3.circle_from_centre(centre + height * normal, normal, (ratio * radius) ** 2)
        found = nearest_on_circles(a, above)
        close(
            found.distance / np.maximum(1, radius),
            np.hypot(height, (1 - ratio) * radius) / np.maximum(1, radius),
            1e-10,
        )
        assert found.everywhere.all()
    # linked at right angles through each other's centres, radius 1
    one = cga3.circle_from_centre([0.0, 0, 0], [0.0, 0, 1], 1.0)
    two = cga3.circle_from_centre([1.0, 0, 0], [0.0, 1, 0], 1.0)
    expected = least_of_circles(
        (np.zeros((1, 3)), np.array([[0.0, 0, 1]]), np.ones(1)),
        (np.array([[1.0, 0, 0]]), np.array([[0.0, 1, 0]]), np.ones(1)),
    )
    close(nearest_on_circles(one, two).distance, expected[0], 1e-12)
    point = nearest_on_circles(cga3.circle_from_centre([3.0, 0, 4], [1.0, 0, 0], 0.0), one)
    close(point.distance, np.hypot(2, 4), 1e-12)


def test_imaginary_circles_and_lines_have_no_nearest_points() -> None:
    real = cga3.circle_from_centre([0.0, 0, 0], [0.0, 0, 1], 1.0)
    imaginary = cga3.circle_from_centre([0.0, 0, 0], [0.0, 0, 1], -1.0)
    line = cga3.circle_from_line(cga3.line_from_points([0.0, 0, 0], [1.0, 0, 0]))
    for other in (imaginary, line):
        found = nearest_on_circles(real, other)
        assert np.isnan(found.distance) and np.isnan(found.on_a).all() and not found.everywhere
    assert nearest_on_circles(np.zeros((0, 10)), real).distance.shape == (0,)
    spots = cga3.circle_from_centre([3.0, 0, 4], [[1.0, 0, 0], [0, 2, 0]], 0.0)
    same = nearest_on_circles(spots, spots[::-1])  # two points, coincident
    close(same.distance, np.zeros(2), 1e-15)
    close(same.on_a, np.tile([3.0, 0, 4], (2, 1)), 1e-14)


def test_half_squares_of_distances_and_their_derivatives() -> None:
    """Compare with the distance by vectors and central differences."""
    rng = np.random.default_rng(9)
    curves, up, h = rng.normal(size=(40, 3, 3)), np.array([0, 0, 1.0]), 1e-5
    for e, (radius, turn) in enumerate(rng.uniform(0.2, 3, (40, 2))):
        at = lambda t, e=e: curves[e] @ [1, np.cos(t), np.sin(t)]  # noqa: E731
        value, slope, bend = cga3.distance_to_circle(curves[e], radius, turn)
        before, after = (cga3.distance_to_circle(curves[e], radius, turn + step) for step in (-h, h))
        close(value, to_circle(at(turn), np.zeros(3), up, radius) ** 2 / 2)
        close(slope, (after[0] - before[0]) / (2 * h), 1e-6 * (1 + abs(bend)))
        close(bend, (after[1] - before[1]) / (2 * h), 1e-5 * (1 + abs(bend)))


def test_steps_lead_to_the_least_distance_nearby() -> None:
    """None of 2,000 angles within the range of a step is nearer, and the distance is that by vectors."""
    rng = np.random.default_rng(10)
    up, span = np.array([0, 0, 1.0]), np.pi / 24
    for curve, radius in zip(rng.normal(size=(20, 3, 3)), rng.uniform(0.2, 3, 20), strict=True):
        at = lambda t, curve=curve: curve @ [np.ones_like(t), np.cos(t), np.sin(t)]  # noqa: E731
        every = np.linspace(0, 2 * np.pi, 2001)
        rough = to_circle(at(every).T, np.zeros(3), up, radius) ** 2 / 2
        starts = every[[rough.argmin(), 100]]
        angles, least = cga3.least_distances_to_circle(curve, radius, starts, span)
        close(least, to_circle(at(angles).T, np.zeros(3), up, radius) ** 2 / 2, 1e-12)
        assert least[0] <= rough.min() + 1e-15 and least[0] > rough.min() - 1e-3 * (1 + rough.min())
        slopes = [cga3.distance_to_circle(curve, radius, angle)[1] for angle in angles]
        close(slopes, np.zeros(2), 1e-7)


def test_angles_that_are_nan_do_not_affect_others() -> None:
    """Half axes along x and y of a circle about (3, 0, 0): nearest to the unit circle at half a turn, 1 from it."""
    curve = np.tile(np.array([[3.0, 1, 0], [0, 0, 1], [0, 0, 0]]), (4, 1, 1))
    curve[2] = np.nan
    roots = np.array([[0.1] * 8, [np.nan] * 7 + [0.3], [0.2] * 8, [np.nan] * 8])
    angles, spread = nearest_angles(curve, np.ones(4), roots)
    good = [0, 1, 3]
    close(np.cos(angles[good]), -np.ones(3), 1e-14)
    close(spread[good], np.full(3, 4.0), 1e-14)  # half the squares of 3 and 1
    assert angles[2] == 0.2 and np.isnan(spread[2]), "nothing to compare"


def objects(kind: str, n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, Any]:
    """Coefficients, points on each object, and the nearest points of it to points, by vectors."""
    p, d, e = rng.normal(size=(n, 3)), unit(rng.normal(size=(n, 3))), rng.normal(size=(n, 3))
    r = np.exp(rng.normal(size=n) / 2)
    o, axis, size = p[:, None], d[:, None], r[:, None, None]
    t = np.linspace(-3, 3, 13)
    turn = np.linspace(0, 2 * np.pi, 25)
    u = perpendicular(d)
    flat_on = lambda x: x - dot(x - o, axis)[..., None] * axis  # noqa: E731
    if kind == "point":
        return p, o, lambda x: np.broadcast_to(o, x.shape)
    if kind == "point pair":
        q = e[:, None]
        nearer = lambda x: np.where((length(x - o) < length(x - q))[..., None], o, q)  # noqa: E731
        return cga3.point_pair_from_points(p, e), np.stack([p, e], 1), nearer
    if kind == "line":
        foot = lambda x: o + dot(x - o, axis)[..., None] * axis  # noqa: E731
        return cga3.line_from_point_direction(p, d), o + t[:, None] * axis, foot
    if kind == "circle":
        nearest = lambda x: o + size * unit(flat_on(x) - o)  # noqa: E731
        return cga3.circle_from_centre(p, d, r**2), on_circle(p, d, r, turn), nearest
    if kind == "plane":
        x, y = (each.reshape(-1, 1) for each in np.meshgrid(t[::2], t[::2]))
        return cga3.plane_from_point_normal(p, d), o + x * u[:, None] + y * np.cross(d, u)[:, None], flat_on
    turn, high = (each.reshape(-1) for each in np.meshgrid(turn[::3], np.linspace(0.1, 3, 6)))
    net = np.stack([np.sin(high) * np.cos(turn), np.sin(high) * np.sin(turn), np.cos(high)], -1)
    return cga3.sphere_from_centre(p, r), o + size * net, lambda x: o + size * unit(x - o)


PAIRS = [(a, b) for k, a in enumerate(KINDS) for b in list(KINDS)[k:]]


def test_every_pair_of_kinds_has_a_distance() -> None:
    assert len(PAIRS) == 21 and set(DISTANCES) == set(PAIRS)


@all_cases("kinds", PAIRS)
def test_distances_are_least(kinds: tuple[str, str]) -> None:
    """Alternating projections from many points of both objects reach the distance and never a smaller one."""
    rng = np.random.default_rng(5)
    n = 10
    (one, samples, on_one), (two, others, on_two) = objects(kinds[0], n, rng), objects(kinds[1], n, rng)
    found = distance(kinds[0], one, kinds[1], two)
    close(distance(kinds[1], two, kinds[0], one), found, 1e-12)
    x = np.concatenate([samples, on_one(others)], 1)
    for _ in range(200):
        y = on_two(x)
        x = on_one(y)
    near = length(x - y).min(-1)
    assert (found <= near + 1e-12).all()
    assert np.quantile(near - found, 0.75) < 1e-3, "slow where nearly parallel"


def test_angles_of_kinds() -> None:
    rng = np.random.default_rng(6)
    d, e = unit(rng.normal(size=(2, N, 3)))
    p, q = rng.normal(size=(2, N, 3))
    between = np.arctan2(length(np.cross(d, e)), dot(d, e))
    line, plane = cga3.line_from_point_direction(p, d), cga3.plane_from_point_normal(q, e)
    pair = cga3.point_pair_from_points(p - d, p + d)
    other_line, other_plane = cga3.line_from_point_direction(q, e), cga3.plane_from_point_normal(p, d)
    circle, other = cga3.circle_from_centre(p, d, 1.5), cga3.circle_from_centre(q, e, 0.7)
    for first in (("line", line), ("point pair", pair)):
        close(angle(*first, "line", other_line), between)
        for second in (("plane", plane), ("circle", other)):
            close(angle(*first, *second), np.pi / 2 - between)
    close(angle("plane", other_plane, "plane", plane), between)
    close(angle("circle", circle, "circle", other), between)
    close(angle("circle", circle, "plane", plane), between, 1e-11)
    # spheres: the angle of radii where they meet, by the law of cosines
    r, s = np.exp(rng.normal(size=(2, N)) / 3)
    apart = length(p - q)
    cosine = (r * r + s * s - apart**2) / (2 * r * s)
    with np.errstate(invalid="ignore"):
        expected = np.arccos(np.where(np.abs(cosine) < 0.999, cosine, np.nan))
    found = angle("sphere", cga3.sphere_from_centre(p, r), "sphere", cga3.sphere_from_centre(q, s))
    known = np.isfinite(expected)
    assert known.sum() > 100 and np.isnan(found[np.abs(cosine) > 1.001]).all()
    close(found[known], expected[known], 1e-11)
    # a plane or a line at the height h over the centre crosses a sphere at acos(h / r)
    h = rng.uniform(0, 0.99, N) * r
    sphere = cga3.sphere_from_centre(p, r)
    close(angle("plane", cga3.plane_from_point_normal(p + h[:, None] * e, e), "sphere", sphere), np.arccos(h / r), 1e-9)
    beside = perpendicular(d)
    chord = cga3.line_from_point_direction(p + h[:, None] * beside, d)
    close(angle("line", chord, "sphere", sphere), np.arccos(h / r), 1e-9)
    close(angle("circle", cga3.circle_from_line(chord), "sphere", sphere), np.arccos(h / r), 1e-9)
    ends = cga3.point_pair_from_points(p + h[:, None] * beside, p + h[:, None] * beside + d)
    close(angle("point pair", ends, "sphere", sphere), np.arccos(h / r), 1e-9)
    assert np.isnan(
        angle("line", cga3.line_from_point_direction(p + 2 * r[:, None] * beside, d), "sphere", sphere)
    ).all()


@all_cases("kinds", [pair for pair in PAIRS if "point" not in pair[0]])
def test_meets_lie_on_both(kinds: tuple[str, str]) -> None:
    """Objects through a common point meet there, and their intersection lies on both."""
    rng = np.random.default_rng(7)
    n = 200
    common, far = rng.normal(size=(2, n, 3))

    def through(kind: str) -> np.ndarray:
        d, r = unit(rng.normal(size=(n, 3))), np.exp(rng.normal(size=n) / 2)
        centre = common + r[:, None] * perpendicular(d)
        made = {
            "line": lambda: cga3.line_from_point_direction(common, d),
            "circle": lambda: cga3.circle_from_centre(centre, d, r**2),
            "plane": lambda: cga3.plane_from_point_normal(common, d),
            "sphere": lambda: cga3.sphere_from_centre(centre, r),
        }
        return np.asarray(made[kind]())

    one, two = through(kinds[0]), through(kinds[1])
    found = meet(kinds[0], one, kinds[1], two)
    assert np.isin(found.how, (0, 1)).all()
    if found.kind == "point":
        close(found.common, common, 1e-7)
    elif kinds in (("circle", "circle"), ("line", "circle")):  # on one sphere only by chance: they meet in one point
        assert (found.how == 0).all()
    else:
        usual = np.abs(distance("point", common, found.kind, found.common))
        assert np.quantile(usual, 0.95) < 1e-7
    assert (meet(kinds[1], two, kinds[0], one).how == found.how).all()
    moved = cga3.translator_from_vector([0.0, 0.0, 40.0])
    away = {
        "line": lambda: cga3.line_from_points(cga3.translate_point(moved, common), cga3.translate_point(moved, far)),
        "circle": lambda: cga3.circle_from_centre(common + UP, unit(far), 1.0),
        "sphere": lambda: cga3.sphere_from_centre(common + UP, 1.0),
    }
    if kinds[1] in away and kinds != ("line", "line"):
        how = meet(kinds[0], one, kinds[1], away[kinds[1]]()).how
        assert (how[distance(kinds[0], one, kinds[1], away[kinds[1]]()) > 1e-6] == -1).all()


def test_intersections_of_points_and_pairs() -> None:
    rng = np.random.default_rng(8)
    p, q, d = rng.normal(size=(3, N, 3))
    line, pair = cga3.line_from_point_direction(p, d), cga3.point_pair_from_points(p, q)
    on, off = meet("point", p, "line", line), meet("line", line, "point", q)
    assert (on.how == 3).all() and (off.how == -1).all() and np.isnan(off.common).all()
    close(on.common, p)
    touch = meet("point pair", pair, "line", line)
    assert touch.kind == "points" and (touch.how == 0).all()
    close(touch.common[:, 0], p, 1e-9)
    assert np.isnan(touch.common[:, 1]).all()
    assert (meet("point pair", pair, "point pair", pair).how == 3).all()
    assert (meet("line", cga3.line_from_points(p, q), "point pair", pair).how == 1).all()
    parallel = meet("line", line, "line", cga3.line_from_point_direction(q, d))
    assert (parallel.how == 2).all()
    assert (meet("line", line, "line", line).how == 3).all()
    plane = cga3.plane_from_point_normal(p, d)
    assert (meet("plane", plane, "plane", cga3.plane_from_point_normal(q, d)).how == 2).all()
    ball = cga3.sphere_from_centre(p, 1.0)
    touching = cga3.sphere_from_centre(p + 3 * unit(d), 2.0)
    assert (meet("sphere", ball, "sphere", touching).how == 0).all()


def test_projections_of_kinds() -> None:
    rng = np.random.default_rng(9)
    n = 200
    p = rng.normal(size=(n, 3))
    for kind in KINDS:
        other = objects(kind, n, rng)[0]
        found = project("point", p, kind, other)
        close(distance("point", found, kind, other), 0.0, 1e-8)
        close(length(found - p), distance("point", p, kind, other), 1e-8)
        pair = cga3.point_pair_from_points(p, p + 1)
        first, second = cga3.point_pair_points(project("point pair", pair, kind, other))
        apart = length(first - second) > 1e-6
        close(first[apart], project("point", p, kind, other)[apart], 1e-7)
        close(second[apart], project("point", p + 1, kind, other)[apart], 1e-7)
    d, normal = unit(rng.normal(size=(2, n, 3)))
    line, plane = cga3.line_from_point_direction(p, d), cga3.plane_from_point_normal(p, normal)
    shadow = project("line", line, "plane", plane)
    flat = d - dot(d, normal)[:, None] * normal
    close(unit(cga3.line_to_direction_moment(shadow)[0]), unit(flat), 1e-9)
    close(distance("point", p, "line", shadow), 0.0, 1e-9)
    q = rng.normal(size=(n, 3))
    close(distance("point", q, "line", project("line", line, "point", q)), 0.0, 1e-10)
    assert (meet("line", line, "line", project("line", line, "point", q)).how == 2).all()
    close(distance("point", q, "plane", project("plane", plane, "point", q)), 0.0, 1e-10)
    assert (meet("plane", plane, "plane", project("plane", plane, "point", q)).how == 2).all()
    circle, sphere = objects("circle", n, rng)[0], cga3.sphere_from_centre(q, 1.3)
    for first in (("circle", circle), ("line", line)):
        found = project(*first, "sphere", sphere)
        real = cga3.circle_kind(found) == 1
        ends = cga3.point_on_circle(found[real], np.array([0.0, 2.0, 4.0])[:, None])
        close(length(ends - q[real]), 1.3, 1e-7)
    found = project("circle", circle, "plane", plane)
    close(np.abs(dot(cga3.circle_normal(found), normal)), 1.0, 1e-9)


def test_similarities_take_rounds_to_rounds() -> None:
    rng = np.random.default_rng(10)
    p, q = rng.normal(size=(2, N, 3))
    n, m = unit(rng.normal(size=(2, N, 3)))
    m[:10], m[10:20] = n[:10], -n[10:20]
    r, s = np.exp(rng.normal(size=(2, N)))
    for sign in (1, -1):
        made = {
            "circle": [cga3.circle_from_centre(*x) for x in ((p, n, sign * r**2), (q, m, sign * s**2))],
            "point pair": [cga3.point_pair_from_centre(*x) for x in ((p, n, sign * r**2), (q, m, sign * s**2))],
            "sphere": [cga3.sphere_from_centre_radius_squared(*x) for x in ((p, sign * r**2), (q, sign * s**2))],
        }
        for kind, (a, b) in made.items():
            versor = similarity_between(kind, a, b)
            moved = getattr(cga3, f"transform_{kind.replace(' ', '_')}")(versor, a)
            found = dot(moved, b) / dot(b, b)
            close((moved - found[:, None] * b) / length(b)[:, None], 0.0, 1e-11)
            assert (found > 0).all(), "with its sense"
            scale, _, _, transversion = cga3.versor_decomposition(versor)
            close(scale / (s / r), 1.0, 1e-11)
            close(transversion, 0.0, 1e-12)
            x, y = rng.normal(size=(2, N, 3))
            apart = length(cga3.transform_point(versor, x) - cga3.transform_point(versor, y))
            close(apart / (length(x - y) * s / r), 1.0, 1e-9)
    mixed = similarity_between("sphere", made["sphere"][0], cga3.sphere_from_centre(q, s))
    assert np.isnan(mixed).all()
    x, y = rng.normal(size=(2, N, 2))
    along, other = unit(rng.normal(size=(2, N, 2)))
    versor = cga2.similarity_between_rounds(x, y, along, other, s / r)
    a, b = cga2.point_pair_from_centre(x, along, r**2), cga2.point_pair_from_centre(y, other, s**2)
    moved = cga2.transform_point_pair(versor, a)
    found = dot(moved, b) / dot(b, b)
    close((moved - found[:, None] * b) / length(b)[:, None], 0.0, 1e-11)
    assert (found > 0).all()


def test_similarities_between_centres() -> None:
    """Points move as by matrices: the least rotation between two directions by Rodrigues' formula."""
    rng = np.random.default_rng(17)
    p, q, x = rng.normal(size=(3, N, 3))
    n, m = unit(rng.normal(size=(2, N, 3)))
    scale = np.exp(rng.normal(size=N))
    found = cga3.transform_point(cga3.similarity_between_rounds(p, q, n, m, scale), x)
    w, c = np.cross(n, m), dot(n, m)
    y = x - p
    turned = c[:, None] * y + np.cross(w, y) + (dot(w, y) / (1 + c))[:, None] * w
    off = (found - q - scale[:, None] * turned) / (1 + scale * length(y))[:, None]
    close(off[c > -0.9], 0.0, 1e-10)
    close((length(found - q) - scale * length(y)) / (1 + scale * length(y)), 0.0, 1e-12)


def test_versors_between_objects_of_every_kind() -> None:
    rng = np.random.default_rng(12)
    n = 300
    for kind in KINDS:
        a, b = objects(kind, n, rng)[0], objects(kind, n, rng)[0]
        versor = versor_between(kind, a, b)
        if kind == "point":
            close(cga3.transform_point(versor, a), b)
            continue
        if kind in ("line", "plane"):
            moved = getattr(cga3, f"move_{kind}")(motor_of(versor), a)
        else:
            moved = getattr(cga3, f"transform_{kind.replace(' ', '_')}")(versor, a)
        known = np.isfinite(versor).all(-1)
        assert known.mean() > 0.5
        off = moved / length(moved)[:, None] - b / length(b)[:, None]
        assert np.quantile(np.abs(off[known]).max(-1), 0.98) < 1e-8


def motor_of(versor: np.ndarray) -> np.ndarray:
    """The motor equal to a versor, from the motion of four points."""
    frame = np.vstack([np.zeros(3), np.eye(3)])
    images = cga3.transform_point(versor[:, None], frame)
    matrix = np.zeros((len(versor), 4, 4))
    matrix[:, :3, 3], matrix[:, 3, 3] = images[:, 0], 1
    matrix[:, :3, :3] = np.swapaxes(images[:, 1:] - images[:, :1], -1, -2)
    return np.asarray(pga3.motor_from_matrix(matrix))


def test_parallel_planes() -> None:
    p, n = RNG.normal(size=(N, 3)), unit(RNG.normal(size=(N, 3)))
    gap = RNG.normal(size=N)
    for sign in (1, -1):
        a, b = cga3.plane_from_point_normal(p, n), cga3.plane_from_point_normal(p + gap[:, None] * n, sign * n)
        close(cga3.signed_distance_planes(a, b), gap, 1e-12)
        close(distance("plane", a, "plane", b), np.abs(gap), 1e-12)


def test_fits_of_exact_points() -> None:
    rng = np.random.default_rng(13)
    for size in (1e-3, 1.0, 1e3):
        centre, normal, radius, _ = circles(50, rng)
        centre, radius = centre * size * 10, radius * size
        turn = rng.uniform(0, 2 * np.pi, (50, 12))
        found = fit_circle(on_circle(centre, normal, radius, turn))
        assert found.determined.all()
        close(found.residual / size, 0.0, 1e-10)
        close((cga3.circle_centre(found.object) - centre) / size, 0.0, 1e-8)
        close(np.abs(dot(cga3.circle_normal(found.object), normal)), 1.0, 1e-9)
        close(cga3.circle_radius_squared(found.object) / radius**2, 1.0, 1e-7)
        points = centre[:, None] + radius[:, None, None] * unit(rng.normal(size=(50, 12, 3)))
        ball = fit_sphere(points)
        assert ball.determined.all()
        close((cga3.sphere_centre(ball.object) - centre) / size, 0.0, 1e-8)
        close(cga3.sphere_radius_squared(ball.object) / radius**2, 1.0, 1e-8)


def test_fits_of_noisy_points_are_least_squares() -> None:
    """scipy minimises the same sums from the true figures."""
    rng = np.random.default_rng(14)
    for _ in range(4):
        centre, normal, radius, _ = circles(1, rng)
        points = on_circle(centre, normal, radius, rng.uniform(0, 4, (1, 30)))[0] + 0.03 * rng.normal(size=(30, 3))

        def off_circle(x: np.ndarray, points: np.ndarray = points) -> np.ndarray:
            n = unit(x[3:6])
            away = points - x[:3]
            height = away @ n
            return np.concatenate([height, length(away - height[:, None] * n) - x[6]])

        best = least_squares(off_circle, [*centre[0], *normal[0], *radius], xtol=1e-15, ftol=1e-15, gtol=1e-15)
        found = fit_circle(points)
        close(found.residual, np.sqrt(2 * best.cost / 30), 1e-9)
        points = centre[0] + radius * unit(np.abs(rng.normal(size=(30, 3)))) + 0.03 * rng.normal(size=(30, 3))

        def off_sphere(x: np.ndarray, points: np.ndarray = points) -> np.ndarray:
            return length(points - x[:3]) - x[3]

        best = least_squares(off_sphere, [*centre[0], *radius], xtol=1e-15, ftol=1e-15, gtol=1e-15)
        ball = fit_sphere(points)
        close(ball.residual, np.sqrt(2 * best.cost / 30), 1e-9)
        close(cga3.sphere_centre(ball.object), best.x[:3], 1e-6)
        flat = points * [1, 1, 0.01] @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + centre
        away = flat - flat.mean(0)
        _, values, axes = np.linalg.svd(away)
        plane = fit_plane(flat)
        close(plane.residual, values[2] / np.sqrt(30), 1e-12)
        close(np.abs(cga3.plane_to_normal(plane.object)[0] @ axes[2]), 1.0, 1e-12)
        line = fit_line(flat)
        close(line.residual, np.hypot(*values[1:]) / np.sqrt(30), 1e-12)


def test_fits_of_too_few_points() -> None:
    line = np.outer(np.linspace(-1, 1, 9), [1.0, 2, 3])
    flat = RNG.normal(size=(9, 3)) * [1, 1, 0]
    assert not fit_plane(line).determined and not fit_circle(line).determined and not fit_sphere(flat).determined
    assert np.isnan(fit_circle(line).object).all() and np.isnan(fit_sphere(flat).object).all()
    assert fit_line(line).determined and fit_plane(flat).determined
    assert not fit_line(np.ones((5, 3))).determined
    mixed = fit_circle(np.stack([line, flat]))
    assert list(mixed.determined) == [False, True] and np.isfinite(mixed.object[1]).all()
    for fit, least in ((fit_line, 2), (fit_plane, 3), (fit_circle, 3), (fit_sphere, 4)):
        with pytest.raises(ValueError, match=r"points: nan at \(2, 1\); expected finite"):
            fit([[0, 0, 0], [1, 0, 0], [0, np.nan, 0], [0, 0, 1]])
        with pytest.raises(ValueError, match=f"expected at least {least}"):
            fit(np.zeros((least - 1, 3)))


ANGLES_OF = np.linspace(-3, 7, 101)
LENGTHS = np.linspace(-2, 3, 53)


def test_cycloidal_curves() -> None:
    t = ANGLES_OF
    for big, small in ((3.0, 1.0), (2.0, 0.7), (1.0, 2.5)):
        epi = cycloidal_curve(t, -small, (big + small) / small, big + small)
        x = (big + small) * np.cos(t) - small * np.cos((big + small) / small * t)
        y = (big + small) * np.sin(t) - small * np.sin((big + small) / small * t)
        close(epi, np.stack([x, y, 0 * t], -1), 1e-12)
        hypo = cycloidal_curve(t, small, -(big - small) / small, big - small)
        x = (big - small) * np.cos(t) + small * np.cos((big - small) / small * t)
        y = (big - small) * np.sin(t) - small * np.sin((big - small) / small * t)
        close(hypo, np.stack([x, y, 0 * t], -1), 1e-12)
    astroid = cycloidal_curve(t, 1.0, -3.0, 3.0) / 4
    close(np.cbrt(astroid[:, 0] ** 2) + np.cbrt(astroid[:, 1] ** 2), 1.0, 1e-9)
    ellipse = cycloidal_curve(t, 0.5, -1, 2.5)
    close((ellipse[:, 0] / 3) ** 2 + (ellipse[:, 1] / 2) ** 2, 1.0, 1e-13)


def test_ruled_surfaces_satisfy_their_equations() -> None:
    x, y, z = np.moveaxis(cone(ANGLES_OF, LENGTHS, 0.6), -1, 0)
    assert x.shape == (101, 53)
    close(x * x + y * y - (np.tan(0.6) * z) ** 2, 0.0, 1e-13)
    close(z, np.broadcast_to(LENGTHS * np.cos(0.6), x.shape), 1e-13)
    x, y, z = np.moveaxis(hyperboloid(ANGLES_OF, LENGTHS, 1.5, 0.8), -1, 0)
    close((x * x + y * y) / 1.5**2 - z * z / (1.5 / 0.8) ** 2, 1.0, 1e-12)
    close(z, np.broadcast_to(LENGTHS, z.shape), 1e-13)
    x, y, z = np.moveaxis(helicoid(ANGLES_OF, LENGTHS, 0.3), -1, 0)
    close(x * np.sin(z / 0.3) - y * np.cos(z / 0.3), 0.0, 1e-12)
    close(z, np.broadcast_to(0.3 * ANGLES_OF[:, None], z.shape), 1e-13)
    x, y, z = np.moveaxis(conoid(ANGLES_OF, LENGTHS, np.sin(2 * ANGLES_OF)), -1, 0)
    close(z * (x * x + y * y), 2 * x * y, 1e-12)
    latitude = np.linspace(-1.5, 1.5, 31)
    x, y, z = np.moveaxis(ellipsoid(ANGLES_OF, latitude, [3.0, 2, 0.5]), -1, 0)
    close((x / 3) ** 2 + (y / 2) ** 2 + (z / 0.5) ** 2, 1.0, 1e-12)
    directrix = cycloidal_curve(ANGLES_OF, 0.5, -1, 2.5) + UP / 40
    found = cone_over(directrix, LENGTHS, [1.0, 2, 3])
    apex = np.array([1.0, 2, 3])
    close(found, apex + LENGTHS[:, None] * (directrix - apex)[:, None], 1e-12)


def test_conics_are_sections_of_cones() -> None:
    """The type by the discriminant of the section's equation in coordinates of its plane."""
    rng = np.random.default_rng(15)
    for _ in range(200):
        half, normal, offset = rng.uniform(0.2, 1.3), unit(rng.normal(size=3)), rng.uniform(0.5, 2)
        plane = pga3.plane_from_normal(normal, offset)
        points = conic(ANGLES_OF, half, plane)
        size = np.maximum(1, length(points))
        close((points @ normal - offset) / size, 0.0, 1e-9)
        close((points[:, 0] ** 2 + points[:, 1] ** 2 - (np.tan(half) * points[:, 2]) ** 2) / size**2, 0.0, 1e-9)
        form = np.diag([1, 1, -(np.tan(half) ** 2)])
        u = perpendicular(normal[None])[0]
        frame = np.stack([u, np.cross(normal, u)])
        discriminant = np.linalg.det(frame @ form @ frame.T)
        assert conic_type(half, plane) == ("ellipse" if discriminant > 0 else "hyperbola")
    tilted = pga3.plane_from_normal([np.cos(0.6), 0, np.sin(0.6)], 1.0)
    assert conic_type(0.6, tilted) == "parabola"
    close(conic(ANGLES_OF, 0.6, pga3.plane_from_normal([0.0, 0, 1], 2.0))[:, 2], 2.0, 1e-12)


def test_spheres_meet_cones() -> None:
    sphere = cga3.sphere_from_centre([0.3, -0.2, 1.0], 1.5)
    points = sphere_cone_curve(ANGLES_OF, 0.5, sphere)
    assert points.shape == (101, 2, 3)
    close(length(points - [0.3, -0.2, 1.0]), 1.5, 1e-12)
    close(points[..., 0] ** 2 + points[..., 1] ** 2, (np.tan(0.5) * points[..., 2]) ** 2, 1e-12)
    assert np.isnan(sphere_cone_curve(ANGLES_OF, 0.5, cga3.sphere_from_centre([9.0, 0, 0], 1.0))).any()


BAD = (
    (lambda: distance("cube", [0.0], "point", [0.0] * 3), ValueError, "kind 'cube'; expected point, point pair"),
    (lambda: distance("line", np.zeros(5), "point", np.zeros(3)), ValueError, "one: shape .5,.; expected .*6.*a line"),
    (lambda: distance("point", ["a"] * 3, "point", np.zeros(3)), TypeError, "one: dtype"),
    (lambda: angle("point", np.zeros(3), "line", np.ones(6)), ValueError, "not defined for point and line"),
    (
        lambda: project("sphere", np.ones(5), "line", np.ones(6)),
        ValueError,
        "not defined for a sphere on a line; expected it on nothing",
    ),
    (lambda: project("line", np.ones(6), "circle", np.ones(10)), ValueError, "expected it on point, plane or sphere"),
    (lambda: similarity_between("line", np.ones(6), np.ones(6)), ValueError, "point pair, circle or sphere"),
    (lambda: versor_between("motor", np.ones(6), np.ones(6)), ValueError, "expected point, point pair"),
    (lambda: nearest_on_circles(np.ones(9), np.ones(10)), ValueError, "a: shape .9,.; expected .*10.*a circle"),
    (lambda: cone([0.0], [1.0], 2.0), ValueError, "half_angle: 2.0; expected an angle between"),
    (lambda: ellipsoid([0.0], [0.0], [1.0, -1, 1]), ValueError, "semi_axes: -1.0; expected positive"),
    (lambda: helicoid([0.0], [0.0], float("nan")), ValueError, "pitch: nan; expected a finite number"),
    (lambda: conoid([0.0, 1], [0.0], [1.0]), ValueError, "heights: shape"),
    (lambda: fit_sphere(np.zeros((4, 2))), ValueError, "points: shape .4, 2."),
)


@all_cases("case", BAD)
def test_bad_input(case: Any) -> None:
    call, error, text = case
    with pytest.raises(error, match=text):
        call()


def test_empty_arrays() -> None:
    for kind, other in PAIRS:
        one, two = np.zeros((0, KINDS[kind])), np.zeros((0, KINDS[other]))
        assert distance(kind, one, other, two).shape == (0,)
        assert meet(kind, one, other, two).how.shape == (0,)
        if (kind, other) in ANGLES:
            assert angle(kind, one, other, two).shape == (0,)
        if (kind, other) in PROJECTIONS:
            assert len(project(kind, one, other, two)) == 0
    assert cone([], [], 0.5).shape == (0, 0, 3) and fit_line(np.zeros((0, 5, 3))).residual.shape == (0,)
    assert set(MEETS) == {pair for pair in PAIRS if "point" not in pair[0]}
