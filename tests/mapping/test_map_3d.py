"""Maps in space: points, lines, planes and spheres of a stereo head, vertical planes, and exported files."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from algorithms.estimation import aim, body_eye, calibrated_head, pan_tilt_head
from algorithms.mapping.export_3d import write_ply, write_svg
from algorithms.mapping.floor_plans import FloorPlan
from algorithms.mapping.map_3d import (
    Map3D,
    SolidKind,
    pose_in_space,
    stereo_lines,
    stereo_points,
    vertical_planes,
)
from algorithms.mapping.navigation_status import FitStatus
from algorithms.mapping.solids import fit_solid
from algorithms.vision.stereo import RectifiedPair
from generated import pga2, pga3

PAIR = RectifiedPair(700.0, (320.0, 240.0), 2.0, 0.12)
HEAD = pan_tilt_head()
ROBOT = pga2.motor_from_angle_translation(0.7, np.array([2.0, 1.0]))
MOUNT = pga3.motor_from_rotor_translation(np.array([1.0, 0, 0, 0]), np.array([0.1, 0.0, 1.2]))
BASE = np.asarray(pga3.motor_product(pose_in_space(ROBOT), MOUNT))


def camera(q: np.ndarray) -> np.ndarray:
    return np.asarray(pga3.motor_product(BASE, HEAD.forward(q)))


def images(points: np.ndarray, pose: np.ndarray, sigma: float = 0.0, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Pixels and disparities by the pinhole camera."""
    rng = np.random.default_rng(seed)
    x, y, z = np.asarray(pga3.move_point_back(pose, points)).T
    pixels = 700 * np.stack([x / z, y / z], 1) + [320, 240]
    right = 700 * (x - 0.12) / z + 322
    pixels, right = pixels + rng.normal(scale=sigma, size=pixels.shape), right + rng.normal(scale=sigma, size=x.shape)
    return pixels, pixels[:, 0] - right


def sphere_points(centre: np.ndarray, radius: float, eye: np.ndarray, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(4000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    towards = (eye - centre) / np.linalg.norm(eye - centre)
    return centre + radius * normals[normals @ towards > 0.3][:800]


def test_poses_in_space() -> None:
    motor = pose_in_space(np.stack([ROBOT, ROBOT]), 0.5)
    point = pga3.move_point(motor, np.array([1.0, 2.0, 3.0]))
    flat = pga2.move_point(ROBOT, np.array([1.0, 2.0]))
    np.testing.assert_allclose(point, np.tile([*flat, 3.5], (2, 1)), atol=1e-12)


def test_stereo_points_are_exact_without_noise() -> None:
    rng = np.random.default_rng(1)
    q = np.array([0.3, -0.2])
    seen = rng.uniform([-0.5, -0.4, 1.0], [0.5, 0.4, 4.0], (30, 3))
    points = np.asarray(pga3.move_point(camera(q), seen))
    found, _ = stereo_points(PAIR, *images(points, camera(q)), camera(q))
    np.testing.assert_allclose(found, points, atol=1e-10)
    nothing, _ = stereo_points(PAIR, np.zeros((3, 2)), np.array([-3.0, np.nan, -2.0]), camera(q))
    assert np.isnan(nothing).all()


def test_covariances_of_stereo_points() -> None:
    q = np.array([0.4, 0.1])
    point = np.asarray(pga3.move_point(camera(q), np.array([0.2, -0.1, 2.0])))
    pixels, disparity = images(point[None], camera(q))
    rng = np.random.default_rng(0)
    noisy, _ = stereo_points(PAIR, pixels + rng.normal(scale=0.2, size=(20000, 2)),
                             disparity + rng.normal(scale=0.3, size=20000), camera(q))  # fmt: skip
    _, spread = stereo_points(PAIR, pixels, disparity, camera(q), 0.2, 0.3)
    expected = np.cov(noisy.T)[np.triu_indices(3)]
    assert np.abs(spread[0] - expected).max() < 0.05 * np.abs(expected).max()


def test_stereo_lines_pass_through_the_points() -> None:
    pose = camera(np.array([0.1, 0.2]))
    ends = np.asarray(pga3.move_point(pose, np.array([[0.2, -0.3, 2.0], [-0.1, 0.4, 2.7]])))
    other = np.asarray(pga3.move_point(pose, np.array([[0.14, -0.16, 2.14], [-0.04, 0.26, 2.56]])))
    pixels, _ = images(ends, pose)
    beside, disparity = images(other, pose)
    right = beside - np.stack([disparity, 0 * disparity], 1)
    line = stereo_lines(PAIR, pixels, right, pose)
    np.testing.assert_allclose(pga3.distance_point_line(ends, line), 0, atol=1e-9)
    level = np.asarray(pga3.move_point(pose, np.array([[-0.2, 0.1, 2.0], [0.3, 0.15, 3.0]])))
    flat, disparity = images(level, pose)
    assert np.isnan(stereo_lines(PAIR, flat, flat - np.stack([disparity, 0 * disparity], 1), pose)).all()


def test_sphere_within_a_centimetre_at_half_a_pixel() -> None:
    errors = []
    for seed in range(3):
        centre = np.asarray(pga3.move_point(pose_in_space(ROBOT), np.array([1.6, 0.3, 0.8])))
        q = aim(HEAD, pga3.move_point_back(BASE, centre)).q
        pose = camera(q)
        points = sphere_points(centre, 0.15, np.asarray(pga3.move_point(pose, np.zeros(3))), seed)
        found = fit_solid(*stereo_points(PAIR, *images(points, pose, 0.5, seed), pose), SolidKind.SPHERE)
        assert found.status == FitStatus.OK and 0.8 < found.square < 1.5
        errors.append([np.linalg.norm(found.solid.centre - centre), abs(found.solid.radius - 0.15)])
    assert np.max(errors) < 0.01


def test_wall_within_a_centimetre_at_half_a_pixel() -> None:
    rng = np.random.default_rng(0)
    q, normal = np.zeros(2), np.array([np.cos(0.7), np.sin(0.7), 0.0])
    for seed in range(4):
        own = np.stack([np.full(800, 2.3), rng.uniform(-0.7, 0.7, 800), rng.uniform(0.7, 1.7, 800)], 1)
        points = np.asarray(pga3.move_point(pose_in_space(ROBOT), own))
        found = fit_solid(
            *stereo_points(PAIR, *images(points, camera(q), 0.5, seed), camera(q)), SolidKind.PLANE, "wall"
        )
        assert found.status == FitStatus.OK and found.solid.name == "wall" and 0.85 < found.square < 1.15
        plane = found.solid.plane
        assert abs(abs(plane[:3] @ normal) - 1) < 1e-3
        off = np.abs(pga3.signed_distance_point_plane(points, plane))
        assert off.mean() < 0.01 and abs(off[np.argmin(np.abs(own[:, 1]))]) < 0.01
        np.testing.assert_allclose(pga3.signed_distance_point_plane(found.solid.corners, plane), 0, atol=1e-9)


def test_equal_weights_would_be_worse() -> None:
    """Depths are uncertain: the fit with covariances is nearer to the truth than that with equal weights."""
    errors = []
    for seed in range(3):
        centre = np.asarray(pga3.move_point(pose_in_space(ROBOT), np.array([1.8, 0.0, 1.2])))
        points = sphere_points(centre, 0.2, np.asarray(pga3.move_point(camera(np.zeros(2)), np.zeros(3))), seed)
        seen, spreads = stereo_points(PAIR, *images(points, camera(np.zeros(2)), 0.5, seed), camera(np.zeros(2)))
        even = np.tile(spreads[:, [0, 3, 5]].sum(1).mean() * np.array([1.0, 0, 0, 1, 0, 1]), (len(seen), 1))
        fits = [fit_solid(seen, s, SolidKind.SPHERE, gate=20) for s in (spreads, even)]
        errors.append([np.linalg.norm(fit.solid.centre - centre) for fit in fits])
    assert np.mean(errors, axis=0)[0] < 0.5 * np.mean(errors, axis=0)[1]


def test_calibrated_head_locates_points() -> None:
    """The chain of 19.2: a head measured by body-eye calibration gives the same points."""
    rng = np.random.default_rng(0)
    world = np.asarray(pga3.move_point(HEAD.tool, rng.uniform([-0.7, -0.5, 0.7], [0.7, 0.5, 2.0], (20, 3))))
    sweeps = []
    for joint in range(2):
        q = np.zeros((15, 2))
        q[:, joint] = np.linspace(-0.5, 0.5, 15)
        sweeps.append(pga3.move_point_back(HEAD.forward(q)[:, None], world))
    head = calibrated_head(body_eye(sweeps[0], sweeps[1], HEAD.axes))
    q = np.array([0.5, -0.3])
    points = np.asarray(pga3.move_point(camera(q), np.array([[0.1, 0.2, 1.5], [-0.3, 0.0, 3.0]])))
    pose = np.asarray(pga3.motor_product(BASE, head.forward(q)))
    found, _ = stereo_points(PAIR, *images(points, camera(q)), pose)
    np.testing.assert_allclose(found, points, atol=1e-9)


def test_degenerate_points() -> None:
    spreads = np.tile([1e-4, 0, 0, 1e-4, 0, 1e-4], (20, 1))
    line = np.outer(np.arange(20.0), [1, 2, 3])
    for kind in SolidKind:
        assert fit_solid(line, spreads, kind).status == FitStatus.DEGENERATE
        assert fit_solid(np.full((20, 3), np.nan), spreads, kind).status == FitStatus.TOO_FEW
        assert fit_solid(np.zeros((0, 3)), np.zeros((0, 6)), kind).status == FitStatus.TOO_FEW
    sphere = Map3D().with_solids(vertical_planes(FloorPlan.from_walls([[[0, 0], [1, 0]]]).segments, 0, 2)).solids[0]
    assert sphere.radius == np.inf and np.allclose(sphere.centre, [0.5, 0, 1])


def example() -> Map3D:
    walls = FloorPlan.from_walls([[[0, 0], [4, 0]], [[4, 0], [4, 3]]]).segments
    rng = np.random.default_rng(0)
    points = np.array([2.0, 1.0, 0.5]) + 0.3 * (lambda n: n / np.linalg.norm(n, axis=1)[:, None])(
        rng.normal(size=(50, 3))
    )
    ball = fit_solid(points, np.tile([1e-6, 0, 0, 1e-6, 0, 1e-6], (50, 1)), SolidKind.SPHERE, "ball <1>").solid
    assert ball is not None
    found = Map3D().with_solids([*vertical_planes(walls, 0.0, 2.5), ball])
    return found.with_points([[1, 1, 1], [np.nan, 0, 0], [2, 2, 0]]).with_segments([[[0, 0, 0], [0, 0, 1]]])


def test_vertical_planes() -> None:
    planes = vertical_planes(FloorPlan.from_walls([[[0, 1], [4, 3]]]).segments, 0.2, 2.0)
    (plane,) = planes
    np.testing.assert_allclose(pga3.signed_distance_point_plane(plane.corners, plane.plane), 0, atol=1e-12)
    assert plane.corners[:, 2].tolist() == [0.2, 0.2, 2.0, 2.0]


def test_ply(tmp_path: Path) -> None:
    found = example()
    lines = write_ply(found, tmp_path / "map.ply").read_text().splitlines()
    counts = {word[1]: int(word[2]) for line in lines if (word := line.split())[0] == "element"}
    body = lines[lines.index("end_header") + 1 :]
    assert len(body) == sum(counts.values()) and counts["edge"] == 1
    vertices = np.array([[float(x) for x in line.split()[:3]] for line in body[: counts["vertex"]]])
    faces = [[int(x) for x in line.split()[1:]] for line in body[counts["vertex"] : counts["vertex"] + counts["face"]]]
    assert faces[0] == [0, 1, 2, 3] and max(map(max, faces)) < counts["vertex"]
    np.testing.assert_allclose(vertices[:4], found.solids[0].corners)
    ball = vertices[faces[2]]
    np.testing.assert_allclose(np.linalg.norm(ball - [2, 1, 0.5], axis=1), 0.3, atol=1e-3)


def test_ply_keeps_all_digits(tmp_path: Path) -> None:
    """Coordinates of UTM are read back exactly."""
    points = np.array([[454321.123456789, 5412345.987654321, 0.1], [1 / 3, -2e-9, 7e5]])
    lines = write_ply(Map3D().with_points(points), tmp_path / "map.ply").read_text().splitlines()
    body = lines[lines.index("end_header") + 1 :]
    assert "property double x" in lines
    assert [[float(x) for x in line.split()[:3]] for line in body] == points.tolist()


def test_svg(tmp_path: Path) -> None:
    root = ElementTree.parse(write_svg(example(), tmp_path / "map.svg")).getroot()
    kinds = [child.tag.rpartition("}")[2] for child in root]
    assert sorted(kinds) == ["circle", "circle", "circle", "line", "polygon", "polygon"]
    titles = [element.text for element in root.iter() if element.tag.endswith("title")]
    assert titles == ["ball <1>"]
    with pytest.raises(ValueError, match="nothing to draw"):
        write_svg(Map3D(), tmp_path / "empty.svg")


def wall_in_view(rng: np.random.Generator, depth: float, turn: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of a wall in front of a camera at the origin, and its plane."""
    normal = np.array([np.sin(turn), 0.0, np.cos(turn)])
    rays = np.column_stack([rng.uniform([-0.45, -0.34], [0.45, 0.34], (count, 2)), np.ones(count)])
    return rays * (depth * normal[2] / (rays @ normal))[:, None], np.append(normal, -depth * normal[2])


@pytest.mark.parametrize("depth", [4.0, 10.0])
def test_far_walls_are_not_too_near(depth: float) -> None:
    """The mean of 8 fits at half a pixel is within 4 standard deviations, by the error of disparities, of the truth.

    Weights of the noisy points themselves place a wall at 10 m by 20 cm too near.
    """
    eye, errors = np.array([1.0, 0, 0, 0, 0, 0, 0, 0]), []
    for seed in range(8):
        points, plane = wall_in_view(np.random.default_rng(seed), depth, 0.3, 500)
        found = fit_solid(*stereo_points(PAIR, *images(points, eye, 0.5, seed), eye, 0.5), SolidKind.PLANE)
        assert found.status == FitStatus.OK and found.inliers.mean() > 0.98
        errors.append(float(pga3.signed_distance_point_plane(points.mean(0), found.solid.plane))
                      * np.sign(found.solid.plane[:3] @ plane[:3]))  # fmt: skip
    one = np.sqrt(0.5 / 500) * depth**2 / (700 * 0.12)
    assert abs(np.mean(errors)) < 4 * one / np.sqrt(8)


def test_walls_with_points_of_the_floor() -> None:
    """A fifteenth to a third of foreign points leaves the normal within a degree, and outside the inliers."""
    eye = np.array([1.0, 0, 0, 0, 0, 0, 0, 0])
    for seed, count in enumerate([20, 60, 140]):
        rng = np.random.default_rng(seed)
        points, plane = wall_in_view(rng, 2.5, 0.4, 294)
        floor = np.column_stack([rng.uniform(-1, 1, count), np.full(count, 1.1), rng.uniform(1.0, 1.8, count)])
        both = np.concatenate([points, floor])
        found = fit_solid(*stereo_points(PAIR, *images(both, eye, 0.3, seed), eye, 0.3), SolidKind.PLANE)
        assert found.status == FitStatus.OK and abs(found.solid.plane[:3] @ plane[:3]) > np.cos(np.radians(1))
        assert not found.inliers[294:].any() and found.inliers[:294].mean() > 0.98


def test_unrelated_points_are_no_solid() -> None:
    spreads = np.tile([4e-4, 0, 0, 4e-4, 0, 4e-4], (80, 1))
    for seed in range(2):
        points = np.random.default_rng(seed).uniform(-1, 1, (80, 3))
        for kind in SolidKind:
            found = fit_solid(points, spreads, kind)
            assert found.status != FitStatus.OK and found.solid is None
    for wrong in ({"viewpoint": [0, 0]}, {"viewpoint": [[0, 0, 0]] * 3}, {"gate": 0}):
        with pytest.raises((TypeError, ValueError), match=next(iter(wrong))):
            fit_solid(points, spreads, SolidKind.PLANE, **wrong)


def test_a_viewpoint_replaces_the_axes_of_covariances() -> None:
    """Points with the covariances of disparities, seen from two places, are fitted with both places."""
    rng, parts = np.random.default_rng(3), []
    for k, eye in enumerate((np.zeros(3), np.array([1.0, 0, 0]))):
        seen, _ = wall_in_view(rng, 10.0, 0.0, 300)
        motor = pga3.motor_from_rotor_translation(np.array([1.0, 0, 0, 0]), eye)
        parts.append((*stereo_points(PAIR, *images(seen + eye, motor, 0.5, k), motor, 0.5), np.tile(eye, (300, 1))))
    points, spreads, eyes = (np.concatenate(each) for each in zip(*parts, strict=True))
    planes = [fit_solid(points, spreads, SolidKind.PLANE, viewpoint=v).solid for v in (eyes, None)]
    assert planes[0] is not None and planes[1] is not None
    off = [abs(abs(each.plane[3]) - 10) for each in planes]
    assert off[0] < 0.12 < off[1]
