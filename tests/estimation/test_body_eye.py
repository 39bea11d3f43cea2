"""Axes of joints from circles of tracked points, and the pose of an eye on a pan-tilt head."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.estimation import BodyEyeStatus, body_eye, joint_axis, stereo_information
from generated import body_eye as kernels
from generated import pga3

Array = np.ndarray[Any, Any]
FOCAL_LENGTH, BASELINE = 800.0, 0.12
PAN_ANGLES, TILT_ANGLES = np.linspace(-0.5, 0.5, 20), np.linspace(-0.4, 0.4, 20)


def line(direction: Array, point: Array) -> Array:
    """A unit line in the order e12 e13 e23 e01 e02 e03."""
    d = np.asarray(direction, float) / np.linalg.norm(direction)
    return np.array([d[2], -d[1], d[0], *np.cross(point, d)])


class Rig(NamedTuple):
    """A head whose axes do not meet, and points that it sees; matrices act on columns."""

    axes: Array
    directions: Array
    places: Array
    turn: Rotation
    place: Array
    points: Array

    def sweep(self, joint: int, angles: Array) -> Array:
        """The points in the frame of the eye while one joint moves."""
        frames = []
        for angle in angles:
            moved = Rotation.from_rotvec(-angle * self.directions[joint])
            still = moved.apply(self.points - self.places[joint]) + self.places[joint]
            frames.append(self.turn.inv().apply(still - self.place))
        return np.array(frames)

    def axis_in_eye(self, joint: int) -> Array:
        inverse = self.turn.inv()
        return line(inverse.apply(self.directions[joint]), inverse.apply(self.places[joint] - self.place))


def rig(seed: int = 0, scale: float = 1.0, shift: float = 0.0, n_points: int = 20) -> Rig:
    rng = np.random.default_rng(seed)
    directions = np.array([[0.02, 0.03, 1.0], [0.01, 1.0, -0.02]])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    places = scale * np.array([[0.0, 0.0, 0.0], [0.03, 0.0, 0.1]]) + shift
    # The eye looks along x of the body, with y down.
    turn = Rotation.from_matrix([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]) * Rotation.from_rotvec(0.1 * rng.normal(size=3))
    place = scale * np.array([0.05, 0.02, 0.15]) + shift
    seen = scale * rng.uniform([-0.7, -0.5, 0.7], [0.7, 0.5, 2.0], (n_points, 3))
    axes = np.stack([line(d, p) for d, p in zip(directions, places, strict=True)])
    return Rig(axes, directions, places, turn, place, turn.apply(seen) + place)


def stereo(rng: np.random.Generator, points: Array, pixel: float) -> Array:
    """Points measured by a stereo camera."""
    x, y, z = np.moveaxis(points, -1, 0)
    left = FOCAL_LENGTH * x / z + pixel * rng.normal(size=x.shape)
    right = FOCAL_LENGTH * (x - BASELINE) / z + pixel * rng.normal(size=x.shape)
    row = FOCAL_LENGTH * y / z + pixel * rng.normal(size=x.shape) / np.sqrt(2)
    depth = FOCAL_LENGTH * BASELINE / (left - right)
    return np.stack([left * depth / FOCAL_LENGTH, row * depth / FOCAL_LENGTH, depth], -1)


def angle(a: Array, b: Array) -> float:
    """In degrees, of directed lines."""
    one, two = (np.array([e[2], -e[1], e[0]]) for e in (a, b))
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(one, two)), one @ two)))


def matrix_of(rig: Rig) -> Array:
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = rig.turn.as_matrix(), rig.place
    return found


@pytest.mark.parametrize("seed", range(3))
def test_clean_points(seed: int) -> None:
    """Axes to 1e-10, and the pose of the eye, with and without refinement."""
    head = rig(seed)
    pan, tilt = head.sweep(0, PAN_ANGLES), head.sweep(1, TILT_ANGLES)
    for refine in (True, False):
        found = body_eye(pan, tilt, head.axes, refine=refine)
        assert found.status == BodyEyeStatus.OK and found.residual < 1e-13
        assert np.abs(found.pan.line - head.axis_in_eye(0)).max() < 1e-13
        assert np.abs(found.tilt.line - head.axis_in_eye(1)).max() < 1e-13
        assert np.abs(pga3.motor_to_matrix(found.motor) - matrix_of(head)).max() < 1e-12
    radii = np.linalg.norm(np.cross(head.points - head.places[0], head.directions[0]), axis=1)
    assert np.allclose(found.pan.radii, radii, atol=1e-12)
    q = np.array([[0.3, -0.2], [0.0, 0.0]])
    seen = head.turn.inv().apply(head.points - head.place)
    moved = Rotation.from_rotvec(0.3 * head.directions[0]), Rotation.from_rotvec(-0.2 * head.directions[1])
    tilted = moved[1].apply(head.points - head.places[1]) + head.places[1]
    expected = moved[0].apply(tilted - head.places[0]) + head.places[0]
    assert np.allclose(found.locate(q[:, None], seen), [expected, head.points], atol=1e-12)


@pytest.mark.parametrize(("scale", "shift"), [(1e-3, 0.0), (1e3, 0.0), (1.0, 1e3)])
def test_units_and_far_frames(scale: float, shift: float) -> None:
    head = rig(scale=scale, shift=shift)
    found = body_eye(head.sweep(0, PAN_ANGLES), head.sweep(1, TILT_ANGLES), head.axes)
    assert found.status == BodyEyeStatus.OK
    off = pga3.motor_to_matrix(found.motor) - matrix_of(head)
    assert np.abs(off[:3, :3]).max() < 1e-10 and np.abs(off[:3, 3]).max() < 1e-10 * (scale + shift)


def test_noise_of_a_tenth_of_a_pixel() -> None:
    """Axes to 0.05 degrees in all of 20 trials, with errors as large as the estimated deviations."""
    rng = np.random.default_rng(1)
    head = rig()
    clean = head.sweep(0, PAN_ANGLES), head.sweep(1, TILT_ANGLES)
    truth = head.axis_in_eye(0), head.axis_in_eye(1)
    angles, ratios, poses = [], [], []
    for _ in range(20):
        points = [stereo(rng, each, 0.1) for each in clean]
        information = [stereo_information(each, FOCAL_LENGTH, BASELINE, 0.1) for each in points]
        found = body_eye(*points, head.axes, pan_information=information[0], tilt_information=information[1])
        assert found.status == BodyEyeStatus.OK
        for axis, right in zip((found.pan, found.tilt), truth, strict=True):
            angles.append(angle(axis.line, right))
            ratios.append(np.radians(angles[-1]) / axis.deviation[0])
        poses.append(np.linalg.norm(pga3.motor_to_matrix(found.motor)[:3, 3] - head.place))
    assert max(angles) < 0.05
    assert 0.6 < np.sqrt(np.mean(np.square(ratios))) < 1.7
    assert np.sqrt(np.mean(np.square(poses))) < 5e-4


@pytest.mark.slow
def test_refinement_improves_the_line_of_bisector_planes() -> None:
    rng = np.random.default_rng(2)
    head = rig(n_points=8)
    clean, truth = head.sweep(1, np.linspace(-0.2, 0.2, 10)), head.axis_in_eye(1)
    errors = {True: 0.0, False: 0.0}
    for _ in range(20):
        points = stereo(rng, clean, 0.1)
        information = stereo_information(points, FOCAL_LENGTH, BASELINE, 0.1)
        for refine in errors:
            errors[refine] += angle(joint_axis(points, information=information, refine=refine).line, truth) ** 2
    assert errors[True] < 0.25 * errors[False]


def test_direction_follows_the_readings() -> None:
    head = rig()
    pan = head.sweep(0, PAN_ANGLES)
    backwards = joint_axis(pan[::-1])
    assert angle(backwards.line, head.axis_in_eye(0)) > 179.9
    assert angle(joint_axis(pan[::-1], PAN_ANGLES[::-1]).line, head.axis_in_eye(0)) < 1e-6
    order = np.random.default_rng(0).permutation(len(pan))
    assert angle(joint_axis(pan[order], PAN_ANGLES[order]).line, head.axis_in_eye(0)) < 1e-6


def test_simplified_method_needs_no_design() -> None:
    head = rig()
    found = body_eye(head.sweep(0, PAN_ANGLES), head.sweep(1, TILT_ANGLES))
    assert found.status == BodyEyeStatus.OK
    assert np.allclose(found.axes[0], [1, 0, 0, 0, 0, 0], atol=1e-12)
    direction = np.array([found.axes[1, 2], -found.axes[1, 1], found.axes[1, 0]])
    assert abs(direction[0]) < 1e-12 and direction[1] > 0.99
    foot = np.cross(direction, found.axes[1, 3:])
    normal = np.cross(head.directions[0], head.directions[1])
    apart = abs((head.places[1] - head.places[0]) @ normal) / np.linalg.norm(normal)
    assert np.isclose(found.distance, apart, atol=1e-12) and np.isclose(abs(foot[0]), apart, atol=1e-12)
    assert np.isclose(found.angle, np.arccos(head.directions[0] @ head.directions[1]), atol=1e-12)


def test_missing_points_are_left_out() -> None:
    head = rig()
    pan = head.sweep(0, PAN_ANGLES)
    rng = np.random.default_rng(0)
    pan[rng.random(pan.shape[:2]) < 0.4] = np.nan
    pan[:, 3], pan[2:, 4] = np.nan, np.inf
    found = joint_axis(pan)
    assert found.status == BodyEyeStatus.OK and np.abs(found.line - head.axis_in_eye(0)).max() < 1e-12
    assert np.isnan(found.radii[[3, 4]]).all() and np.isfinite(np.delete(found.radii, [3, 4])).all()


def test_unusable_covariances() -> None:
    head = rig()
    pan = head.sweep(0, PAN_ANGLES)
    information = np.tile(np.eye(3), (20, 20, 1, 1))
    information[:, 2], information[3], information[5, 6] = np.nan, 0.0, -np.eye(3)
    found = joint_axis(pan, information=information)
    assert found.status == BodyEyeStatus.OK and np.abs(found.line - head.axis_in_eye(0)).max() < 1e-12
    assert np.isnan(found.radii[2]) and np.isfinite(found.radii).sum() == 19
    assert joint_axis(pan, information=0 * information).status == BodyEyeStatus.TOO_FEW
    assert joint_axis(1e200 * pan).status == BodyEyeStatus.TOO_FEW


def test_degenerate_points() -> None:
    """Every status, with finite lines and motors."""
    head = rig()
    pan, tilt = head.sweep(0, PAN_ANGLES), head.sweep(1, TILT_ANGLES)
    rng = np.random.default_rng(0)
    straight = head.points + np.linspace(0, 1, 20)[:, None, None] * np.array([1.0, 2.0, 0.0])
    still = np.tile(head.points, (20, 1, 1))
    on_axis = np.zeros((20, 1, 3)) + head.places[0]
    cases = {
        "two frames": (pan[:2], BodyEyeStatus.TOO_FEW),
        "no frame": (pan[:0], BodyEyeStatus.TOO_FEW),
        "no point": (pan[:, :0], BodyEyeStatus.TOO_FEW),
        "not seen": (np.full_like(pan, np.nan), BodyEyeStatus.TOO_FEW),
        "collinear": (straight, BodyEyeStatus.COLLINEAR),
        "no motion": (still, BodyEyeStatus.COLLINEAR),
        "radius 0": (on_axis, BodyEyeStatus.COLLINEAR),
        "noise only": (still + 1e-3 * rng.normal(size=still.shape), BodyEyeStatus.COLLINEAR),
    }
    for name, (points, status) in cases.items():
        axis = joint_axis(points)
        assert axis.status == status, name
        assert not axis.line.any() and np.isnan(axis.radii).all(), name
        found = body_eye(points, tilt, head.axes)
        assert found.status == status and np.isfinite(found.motor).all(), name
    turn = np.linspace(0, 2 * np.pi, 20, endpoint=False)[:, None]
    ellipse = np.stack([np.cos(turn), 0.1 * np.sin(turn), 0 * turn], -1)
    assert joint_axis(ellipse).status == BodyEyeStatus.NOT_CIRCLES
    one_point = joint_axis(pan[:, :1])
    assert one_point.status == BodyEyeStatus.OK and angle(one_point.line, head.axis_in_eye(0)) < 1e-6


def test_parallel_axes() -> None:
    head = rig()
    pan = head.sweep(0, PAN_ANGLES)
    found = body_eye(pan, pan[:, ::-1], np.stack([head.axes[0], head.axes[0]]))
    assert found.status == BodyEyeStatus.PARALLEL_AXES
    assert found.distance < 1e-12 and np.isfinite(found.motor).all()
    assert np.abs(pga3.move_line(found.motor, head.axis_in_eye(0)) - head.axes[0]).max() < 1e-9
    assert body_eye(pan, pan).status == BodyEyeStatus.PARALLEL_AXES


def test_axes_of_few_points() -> None:
    """The meet of two bisector planes is the axis, directed by the rotation."""
    head = rig()
    a, b, c = (head.sweep(0, [x])[0] for x in (0.0, -0.3, -0.7))
    axes = pga3.normalize_line(kernels.axis_of_three_points(a, b, c))
    assert np.abs(axes - head.axis_in_eye(0)).max() < 1e-10
    two = pga3.normalize_line(kernels.axis_of_two_displacements(a[0], b[0], a[1], b[1]))
    assert np.abs(two * np.sign(two[0] * axes[0, 0]) - axes[0]).max() < 1e-10
    assert not kernels.axis_of_three_points([0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0])[:3].any()


def test_wrong_arguments() -> None:
    pan = rig().sweep(0, PAN_ANGLES)
    with pytest.raises(ValueError, match=r"points: shape \(20, 3\)"):
        joint_axis(pan[:, 0])
    with pytest.raises(ValueError, match=r"angles: shape \(3,\)"):
        joint_axis(pan, [1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="information: shape"):
        joint_axis(pan, information=np.eye(3))
    with pytest.raises(ValueError, match="axes: not lines"):
        body_eye(pan, pan, np.zeros((2, 6)))
    with pytest.raises(TypeError, match="points: dtype"):
        joint_axis(pan + 1j)
