"""The conformal toolkit of space against clifford.tools.g3c, to 1e-12 of the largest coefficient that enters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.geometry import distance, nearest_on_circles, similarity_between
from gacompiler.algebra.catalog import CGA3
from generated import cga3

pytestmark = pytest.mark.peers

TOLERANCE = 1e-12
N = 20
"""Scenes, all in general position: a wrong coefficient fails in the first."""


@pytest.fixture(scope="module")
def g3c() -> Any:
    pytest.importorskip("clifford")
    return pytest.importorskip("clifford.tools.g3c")


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(53)


def close(found: Any, expected: Any, size: float = 1.0) -> None:
    np.testing.assert_allclose(found, expected, rtol=TOLERANCE, atol=TOLERANCE * max(1.0, size))


def theirs(g3c: Any, layout: Any, coefficients: Any) -> Any:
    """Coefficients in a layout as a multivector of clifford, whose no and ninf are e0 and einf."""
    vectors = (g3c.e1, g3c.e2, g3c.e3, g3c.eo, g3c.einf)
    total = 0 * g3c.e1
    for blade, coefficient in layout.element([float(c) for c in coefficients]).terms.items():
        product = 1 + 0 * g3c.e1
        for factor in [vector for k, vector in enumerate(vectors) if blade >> k & 1]:
            product = product ^ factor
        total += float(coefficient) * product
    return total


def same(found: Any, expected: Any) -> None:
    close(found.value, expected.value, np.abs(expected.value).max())


def same_object(found: Any, expected: Any) -> None:
    """Up to a factor."""
    one, two = found.value / np.linalg.norm(found.value), expected.value / np.linalg.norm(expected.value)
    close(one * np.sign(one @ two), two)


def euclidean(g3c: Any, point: Any) -> Any:
    return g3c.down(g3c.normalise_n_minus_1(point)).value[1:4]


def objects(g3c: Any, rng: np.random.Generator) -> dict[str, tuple[Any, Any]]:
    """One of each kind, ours and theirs, of the same points."""
    points = rng.normal(size=(4, 3))
    a, b, c, d = (g3c.up(p[0] * g3c.e1 + p[1] * g3c.e2 + p[2] * g3c.e3) for p in points)
    made = {
        "pair": (cga3.point_pair_from_points(*points[:2]), a ^ b),
        "circle": (cga3.circle_from_points(*points[:3]), a ^ b ^ c),
        "sphere": (cga3.sphere_from_points(*points), a ^ b ^ c ^ d),
        "line": (cga3.line_from_points(*points[:2]), a ^ b ^ g3c.einf),
        "plane": (cga3.plane_from_points(*points[:3]), a ^ b ^ c ^ g3c.einf),
    }
    return {"point": (points[0], a), **made}


LAYOUTS = {
    "pair": CGA3.POINT_PAIR,
    "circle": CGA3.CIRCLE,
    "sphere": CGA3.SPHERE,
    "line": CGA3.LINE,
    "plane": CGA3.PLANE,
}


def test_objects_of_points_are_the_same_blades(g3c: Any, rng: np.random.Generator) -> None:
    for _ in range(N):
        made = objects(g3c, rng)
        for kind, layout in LAYOUTS.items():
            ours, other = made[kind]
            same(theirs(g3c, layout, ours), other)


def test_what_objects_are_made_of(g3c: Any, rng: np.random.Generator) -> None:
    for _ in range(N):
        made = objects(g3c, rng)
        sphere, circle, plane, line = (made[kind] for kind in ("sphere", "circle", "plane", "line"))
        size = np.abs(cga3.sphere_centre(sphere[0])).max() ** 2
        close(cga3.sphere_centre(sphere[0]), euclidean(g3c, g3c.get_center_from_sphere(sphere[1])), 10 * size)
        close(np.sqrt(cga3.sphere_radius_squared(sphere[0])), g3c.get_radius_from_sphere(sphere[1]), 10 * size)
        centre, normal, radius = g3c.get_circle_in_euc(circle[1])
        size = radius**2
        close(cga3.circle_centre(circle[0]), centre.value[1:4], 10 * size)
        close(np.abs(cga3.circle_normal(circle[0]) @ normal.value[1:4]), 1.0)
        close(np.sqrt(cga3.circle_radius_squared(circle[0])), radius, 10 * size)
        unit = plane[1].normal()
        normal, distance = cga3.plane_to_normal(plane[0])
        close(np.abs(normal @ g3c.get_plane_normal(unit).value[1:4]), 1.0)
        close(np.abs(distance), np.abs(g3c.get_plane_origin_distance(unit)))
        close(cga3.plane_support(plane[0]), euclidean(g3c, g3c.get_nearest_plane_point(unit)))
        ends = [euclidean(g3c, point) for point in g3c.point_pair_to_end_points(made["pair"][1])]
        close(cga3.point_pair_points(made["pair"][0]), ends, 10.0)
        point, direction = g3c.line_to_point_and_direction(line[1].normal())
        along = cga3.line_to_direction_moment(line[0])[0]
        close(np.abs(along @ direction.value[1:4]), np.linalg.norm(along))
        close(cga3.line_support(line[0]), point.value[1:4], np.abs(line[0]).max())


def test_meets_and_distances(g3c: Any, rng: np.random.Generator) -> None:
    for _ in range(N):
        one, two = objects(g3c, rng), objects(g3c, rng)
        for kernel, first, second, layout in (
            (cga3.meet_spheres, "sphere", "sphere", CGA3.CIRCLE),
            (cga3.meet_sphere_plane, "sphere", "plane", CGA3.CIRCLE),
            (cga3.meet_line_sphere, "line", "sphere", CGA3.POINT_PAIR),
            (cga3.meet_circle_plane, "circle", "plane", CGA3.POINT_PAIR),
            (cga3.meet_circle_sphere, "circle", "sphere", CGA3.POINT_PAIR),
            (cga3.meet_planes, "plane", "plane", CGA3.LINE),
        ):
            (a, b), (c, d) = one[first], two[second]
            same_object(theirs(g3c, layout, kernel(a, c)), g3c.meet(b, d))
        circle = cga3.circle_from_line(one["line"][0])
        crosses = cga3.meet_circle_dual_sphere_kind(circle, cga3.sphere_polarity(two["sphere"][0])) == 1
        assert crosses == g3c.sphere_line_intersect(two["sphere"][1], one["line"][1])
        close(cga3.distance_points(one["point"][0], two["point"][0]), g3c.euc_dist(one["point"][1], two["point"][1]))
        distance = g3c.val_distance_point_to_line(two["point"][1].value, one["line"][1].normal().value)
        close(cga3.distance_point_line(two["point"][0], one["line"][0]), distance, 10.0)


def test_projections(g3c: Any, rng: np.random.Generator) -> None:
    for _ in range(N):
        made, (p, point) = objects(g3c, rng), objects(g3c, rng)["point"]
        for ours, their, kind in (
            (cga3.project_point_on_line, g3c.project_points_to_line, "line"),
            (cga3.project_point_on_plane, g3c.project_points_to_plane, "plane"),
            (cga3.project_point_on_sphere, g3c.project_points_to_sphere, "sphere"),
            (cga3.project_point_on_circle, g3c.project_points_to_circle, "circle"),
        ):
            found = [euclidean(g3c, their([point], made[kind][1].normal())[0])]
            if kind in ("sphere", "circle"):  # which of the two is nearer depends there on the sign of the sphere
                found.append(euclidean(g3c, their([point], made[kind][1].normal(), closest=False)[0]))
            expected = min(found, key=lambda x: float(np.linalg.norm(x - p)))
            size = 1.0
            if kind in ("sphere", "circle"):
                size = 10 * float(getattr(cga3, f"{kind}_radius_squared")(made[kind][0]))
            close(ours(p, made[kind][0]), expected, 10 * size)


def test_versors_between_objects(g3c: Any, rng: np.random.Generator) -> None:
    """The same versor up to its sign, where both exist."""
    for _ in range(N):
        one, two = objects(g3c, rng), objects(g3c, rng)
        for kernel, kind, layout in (
            (cga3.motor_between_lines, "line", CGA3.MOTOR),
            (cga3.motor_between_planes, "plane", CGA3.MOTOR),
            (cga3.versor_between_circles, "circle", CGA3.UNIT_EVEN),
        ):
            (a, b), (c, d) = one[kind], two[kind]
            first, second = b.normal(), d.normal()
            expected = g3c.rotor_between_objects(first, second)
            found = theirs(g3c, layout, kernel(a, c))
            if (second * first)[()] / (first * first)[()] > -0.9:
                size = np.abs(expected.value).max()
                sign = np.sign(found.value @ expected.value)
                close(sign * found.value, expected.value, 100 * size**2)


def test_versors_of_numbers(g3c: Any, rng: np.random.Generator) -> None:
    for _ in range(N):
        t, scale = rng.normal(size=3), np.exp(rng.normal())
        vector = t[0] * g3c.e1 + t[1] * g3c.e2 + t[2] * g3c.e3
        motor = cga3.motor_from_rotor_translation([1.0, 0, 0, 0], t)
        same(theirs(g3c, CGA3.MOTOR, motor), g3c.generate_translation_rotor(vector))
        dilator = theirs(g3c, CGA3.DILATOR, cga3.dilator_from_scale(scale))
        same(dilator, g3c.generate_dilation_rotor(scale))


def test_similarities_between_rounds(g3c: Any, rng: np.random.Generator) -> None:
    """clifford's takes an object to the other up to its sign; both scale all distances alike.

    Spheres are left out: clifford reads out of bounds there, which ends the program.
    """
    compared = 0
    for _ in range(N // 2):
        one, two = objects(g3c, rng), objects(g3c, rng)
        for kind in ("point pair", "circle", "sphere"):
            (a, b), (c, d) = one[kind.removeprefix("point ")], two[kind.removeprefix("point ")]
            versor = theirs(g3c, CGA3.UNIT_EVEN, similarity_between(kind, a, c))
            same_object_to(versor * b * ~versor, d, 1e-9)
            if kind == "sphere":
                continue
            expected = g3c.TRS_between_rounds(b.normal(), d.normal())
            image = (expected * b.normal() * ~expected).normal()
            if min(np.abs((image - d.normal()).value).max(), np.abs((image + d.normal()).value).max()) > 1e-9:
                continue
            ends = [[euclidean(g3c, v * point * ~v) for point in (g3c.eo, g3c.up(g3c.e1))] for v in (versor, expected)]
            near, there = (np.linalg.norm(first - second) for first, second in ends)
            close(near / there, 1.0, 1e4 * max(1.0, *np.abs(ends).ravel()) / near)
            compared += 1
    assert compared > N // 2


def same_object_to(found: Any, expected: Any, tolerance: float) -> None:
    """Up to a factor, relative to the largest coefficient."""
    one, two = found.value / np.abs(found.value).max(), expected.value / np.abs(expected.value).max()
    np.testing.assert_allclose(one * np.sign(one @ two), two, rtol=0, atol=tolerance)


def test_closest_points(g3c: Any, rng: np.random.Generator) -> None:
    """For lines, clifford gives the midpoint; for circles its iteration may end elsewhere, but is never nearer."""
    as_near = 0
    for _ in range(20):
        one, two = objects(g3c, rng), objects(g3c, rng)
        (a, b), (c, d) = one["line"], two["line"]
        first, second = cga3.closest_points_of_lines(a, c)
        middle = euclidean(g3c, g3c.midpoint_between_lines(b.normal(), d.normal()))
        close((first + second) / 2, middle, 100 * np.abs([first, second]).max() ** 2)
        (a, b), (c, d) = one["circle"], two["circle"]
        found = nearest_on_circles(a, c).distance
        points = g3c.iterative_closest_points_on_circles(b.normal(), d.normal(), niterations=20)
        apart = np.linalg.norm(euclidean(g3c, points[0]) - euclidean(g3c, points[1]))
        assert found <= apart + 1e-6
        as_near += abs(found - apart) < 1e-3
        (a, b), (c, d) = one["line"], two["plane"]
        met = euclidean(g3c, g3c.intersect_line_and_plane_to_point(b.normal(), d.normal()))
        close(cga3.meet_line_plane(a, c), met, 100 * np.linalg.norm(met) ** 2)
        assert distance("line", a, "plane", c) == 0
    assert as_near >= 10


def test_roots_and_logarithms_of_motors(g3c: Any, rng: np.random.Generator) -> None:
    from clifford.tools.g3c.rotor_parameterisation import ga_exp, ga_log

    for _ in range(N):
        rotor = cga3.rotor_from_axis_angle(rng.normal(size=3), rng.uniform(0.1, 3))
        motor = cga3.motor_from_rotor_translation(rotor, rng.normal(size=3))
        versor = theirs(g3c, CGA3.MOTOR, motor)
        logarithm = theirs(g3c, CGA3.layout("LOG", "e12 e13 e23 e1inf e2inf e3inf"), cga3.motor_logarithm(motor))
        same(logarithm, ga_log(versor))
        same(theirs(g3c, CGA3.MOTOR, cga3.motor_exponential(cga3.motor_logarithm(motor))), ga_exp(ga_log(versor)))
        root = theirs(g3c, CGA3.MOTOR, cga3.motor_square_root(motor))
        expected = g3c.square_roots_of_rotor(versor)[0]
        close(np.sign(root.value @ expected.value) * expected.value, root.value)
        line = g3c.up(g3c.e1) ^ g3c.up(2 * g3c.e2) ^ g3c.einf
        ours = theirs(g3c, CGA3.LINE, cga3.move_line(motor, cga3.line_from_points([1.0, 0, 0], [0.0, 2, 0])))
        same(ours, g3c.apply_rotor(line, versor))


def test_the_benchmark_writes_its_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("clifford")
    monkeypatch.syspath_prepend(str(Path(__file__).parent.parent.parent))
    from benchmarks import toolkit

    monkeypatch.setattr(toolkit, "THEIRS", 1)
    assert toolkit.main(["--quick", "--out", str(tmp_path / "page.md")]) == 0
    rows = [line for line in (tmp_path / "page.md").read_text().splitlines() if line.startswith("| ")]
    assert len(rows) == 2 + len(toolkit.cases()) + 2 + len(toolkit.OPERATIONS), "two tables with their heads"
