"""Lines in bundle adjustment: minima beside scipy's, truth, covariances, statuses and lenses."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from algorithms.vision import BundleAdjustment, Camera, VisionStatus, bundle_adjust
from generated import pga3

K = np.array([[700.0, 3.0, 320.0], [0.0, 690.0, 240.0], [0.0, 0.0, 1.0]])
Array = NDArray[Any]


class World(NamedTuple):
    """Cameras around points and lines, and what they see."""

    rotations: Array
    centres: Array
    points: Array
    lines: Array

    @property
    def motors(self) -> Array:
        quaternions = np.roll(Rotation.from_matrix(self.rotations).as_quat(), 1, axis=1)
        return np.asarray(pga3.motor_from_quaternion_translation(quaternions, self.centres))

    def pixels(self, camera: int | np.integer[Any], places: Array) -> Array:
        there = (places - self.centres[camera]) @ self.rotations[camera]
        seen = there @ K.T
        return np.asarray(seen[..., :2] / seen[..., 2:])

    def image_lines(self, rng: np.random.Generator, noise: float) -> tuple[Array, Array, Array]:
        """Return pixels of other points of the lines than those that they are given by."""
        c, n = len(self.centres), len(self.lines)
        camera, line = np.repeat(np.arange(c), n), np.tile(np.arange(n), c)
        along = rng.uniform((0, 0.8), (0.2, 1.0), (c * n, 2))[..., None]
        ends = self.lines[line]
        places = ends[:, :1] * (1 - along) + ends[:, 1:] * along
        pixels = np.array([self.pixels(i, each) for i, each in zip(camera, places, strict=True)])
        return camera, line, pixels + noise * rng.normal(size=pixels.shape)

    def observations(self, rng: np.random.Generator, noise: float) -> tuple[Array, Array, Array]:
        c, n = len(self.centres), len(self.points)
        pixels = np.concatenate([self.pixels(i, self.points) for i in range(c)])
        return np.repeat(np.arange(c), n), np.tile(np.arange(n), c), pixels + noise * rng.normal(size=pixels.shape)

    def adjusted(self, rng: np.random.Generator, sigma: float, start: float = 0.01, **options: Any) -> BundleAdjustment:
        """Return the result from a start that is off."""
        observations = self.observations(rng, sigma)
        image_lines = options.pop("image_lines", None) or self.image_lines(rng, sigma)
        c = len(self.centres)
        shift = pga3.motor_from_rotation_vector_translation(*(start * rng.normal(size=(2, c, 3))))
        shift[:2] = np.eye(8)[0]
        motors = pga3.motor_product(self.motors, shift)
        points, lines = (each + start * rng.normal(size=each.shape) for each in (self.points, self.lines))
        options = {"fixed_cameras": [0, 1]} | options
        cameras = [Camera(K, motor) for motor in motors]
        return bundle_adjust(cameras, points, observations, lines=lines, image_lines=image_lines, **options)


def world(rng: np.random.Generator, cameras: int = 5, points: int = 8, lines: int = 12) -> World:
    """Return cameras on a sphere that look at its middle."""
    centres = rng.normal(size=(cameras, 3))
    centres *= 6 / np.linalg.norm(centres, axis=1)[:, None]
    rotations = []
    for centre in centres:
        z = -centre / np.linalg.norm(centre)
        x = np.cross(rng.normal(size=3), z)
        x /= np.linalg.norm(x)
        rotations.append(np.column_stack([x, np.cross(z, x), z]))
    return World(np.array(rotations), centres, rng.normal(size=(points, 3)), rng.normal(size=(lines, 2, 3)))


def distances(lines: Array, truth: Array) -> Array:
    """Return the distances (l, 2) of the true ends from lines."""
    along = lines[:, 1] - lines[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    off = truth - lines[:, :1]
    return np.asarray(np.linalg.norm(off - (off @ along[..., None]) * along[:, None], axis=2))


@pytest.mark.parametrize("points", [0, 3, 8])
def test_exact_pixels_give_the_truth(points: int) -> None:
    rng = np.random.default_rng(points)
    for _ in range(5):
        truth = world(rng, points=points)
        found = truth.adjusted(rng, 0.0)
        assert found.status == VisionStatus.OK and not found.line_status.any()
        assert distances(found.lines, truth.lines).max() < 1e-7
        assert np.abs(pga3.motor_to_matrix(found.poses) - pga3.motor_to_matrix(truth.motors)).max() < 1e-7
        assert found.line_residuals.max() < 1e-6


@pytest.mark.parametrize("loss", [None, "huber", "cauchy"])
def test_the_minimum_is_that_of_scipy(loss: str | None) -> None:
    """The sum of losses has no lower value for any cameras, points and lines near the result."""
    rng = np.random.default_rng(6)
    truth = world(rng, cameras=4, points=6, lines=6)
    camera, line, pixels = truth.image_lines(rng, 0.6)
    if loss:
        pixels[5] += 30
    table = truth.observations(np.random.default_rng(1), 0.6)
    cameras = [Camera(K, motor) for motor in truth.motors]
    found = bundle_adjust(
        cameras, truth.points, table, lines=truth.lines, image_lines=(camera, line, pixels), fixed_cameras=[0, 1],
        loss=loss, scale=1.5,
    )  # fmt: skip
    poses = pga3.motor_to_matrix(found.poses)
    rotations, centres = poses[:, :3, :3], poses[:, :3, 3]
    homogeneous = np.concatenate([pixels, np.ones((*pixels.shape[:2], 1))], 2)

    def squares(x: Array) -> Array:
        turns = np.concatenate([rotations[:2], rotations[2:] @ Rotation.from_rotvec(x[:6].reshape(2, 3)).as_matrix()])
        places = np.concatenate([centres[:2], centres[2:] + x[6:12].reshape(2, 3)])
        points = found.points + x[12:30].reshape(-1, 3)
        ends = found.lines + x[30:].reshape(-1, 2, 3)
        own = World(turns, places, points, ends)
        off = np.concatenate([own.pixels(i, points) for i in range(4)]) - table[2]
        seen = np.einsum("kij,kej->kei", np.swapaxes(turns, 1, 2)[camera], ends[line] - places[camera][:, None])
        image = seen @ K.T
        normal = np.cross(image[:, 0], image[:, 1])
        away = np.einsum("ki,kpi->kp", normal, homogeneous) / np.linalg.norm(normal[:, :2], axis=1)[:, None]
        return np.concatenate([(off**2).sum(1), (away**2).sum(1)])

    def roots(x: Array) -> Array:
        s = squares(x)
        if loss == "huber":
            s = np.where(s > 1.5**2, 2 * 1.5 * np.sqrt(s) - 1.5**2, s)
        elif loss == "cauchy":
            s = 1.5**2 * np.log1p(s / 1.5**2)
        return np.asarray(np.sqrt(s))

    start = np.zeros(12 + 18 + 36)
    k = len(table[0])
    assert np.sqrt(squares(start)) == pytest.approx(np.append(found.residuals, found.line_residuals), rel=1e-9)
    assert 0.5 * (roots(start) ** 2).sum() == pytest.approx(found.cost, rel=1e-12)
    best = scipy.optimize.least_squares(roots, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac")
    assert found.cost <= best.cost * (1 + 1e-9)
    assert found.line_weights.shape == (24,) and found.weights.shape == (k,)
    assert bool(found.line_weights.min() < 0.3) == (loss is not None)


def test_covariances_are_those_of_errors() -> None:
    """Squares of errors of a camera and of lines, in units of covariances, have the means of chi-square."""
    rng = np.random.default_rng(8)
    of_cameras, of_lines = [], []
    for _ in range(80):
        truth = world(rng, cameras=4, points=2, lines=10)
        found = truth.adjusted(rng, 0.1, start=0.003, noise=0.1, covariance="points")
        assert found.status == VisionStatus.OK
        off = pga3.motor_relative(truth.motors[2], found.poses[2])
        error = np.concatenate([pga3.rotor_to_rotation_vector(off[:4]), pga3.motor_to_matrix(off)[:3, 3]])
        of_cameras.append(error @ np.linalg.solve(found.camera_covariance[2], error))
        for line, (a, b), covariance in zip(found.lines, truth.lines, found.line_covariance, strict=True):
            along = line[1] - line[0]
            direction = (b - a) / ((b - a) @ along)
            # The points of the true line next to those of the result, across which both may move.
            met = [a + direction * ((p - a) @ along) for p in line]
            error = (line - met).ravel()
            of_lines.append(error @ np.linalg.pinv(covariance, rcond=1e-6, hermitian=True) @ error)
    # Means of 80 and 800 squares with 6 and 4 degrees of freedom; residuals can only raise the variance that is stated,
    # by a tenth on average, and lines of a scene share the errors of cameras.
    assert 4.2 < np.mean(of_cameras) < 6.9 and 3.2 < np.mean(of_lines) < 4.3


def test_lines_that_say_nothing_are_named() -> None:
    """They are seen by two cameras, have a start of length 0, or are in a plane with all cameras that see them."""
    rng = np.random.default_rng(9)
    truth = world(rng, cameras=4, points=12, lines=5)
    camera, line, pixels = truth.image_lines(rng, 0.3)
    keep = (line != 1) | (camera < 2)
    truth.lines[2, 1] = truth.lines[2, 0]
    found = truth.adjusted(rng, 0.3, image_lines=(camera[keep], line[keep], pixels[keep]), start=0.0)
    assert found.line_status.tolist() == [0, VisionStatus.TOO_FEW, VisionStatus.NOT_FINITE, 0, 0]
    assert found.status == VisionStatus.OK and (found.lines[1] == truth.lines[1]).all()
    assert (found.line_weights[line[keep] == 1] == 0).all() and (found.line_weights[line[keep] == 0] == 1).all()
    flat = world(rng, cameras=4, points=12, lines=3)
    flat.centres[:] = flat.centres[0] + np.arange(4)[:, None] * np.array([0.4, 0.1, 0.0])
    flat.rotations[:] = flat.rotations[0]
    epipolar = flat.points[0] + np.array([[0.0, 0, 0], [0.4, 0.1, 0]])
    flat.lines[1] = epipolar
    found = flat.adjusted(rng, 0.0, start=0.0)
    assert found.line_status[1] == VisionStatus.DEGENERATE and found.line_status[0] == VisionStatus.OK


def test_a_wrong_image_of_a_line_is_not_accepted() -> None:
    rng = np.random.default_rng(10)
    for _ in range(10):
        truth = world(rng, cameras=6, points=10, lines=10)
        camera, line, pixels = truth.image_lines(rng, 0.4)
        pixels[13] += rng.uniform(10, 30, 2) * rng.choice([-1, 1], 2)
        assert truth.adjusted(rng, 0.4, image_lines=(camera, line, pixels), noise=0.4).status != VisionStatus.OK
        robust = truth.adjusted(rng, 0.4, image_lines=(camera, line, pixels), noise=0.4, loss="huber", scale=0.4)
        assert robust.line_weights[13] < 0.2


def test_a_wrong_focal_length_that_is_held_contradicts_lines() -> None:
    """Poses and lines compensate most of it, so that residuals are of the size of the noise, but follow the lens."""
    rng = np.random.default_rng(13)
    refused = 0
    for _ in range(12):
        truth = world(rng, cameras=6, points=4, lines=20)
        factor = rng.uniform(1.1, 1.3) ** rng.choice([-1, 1])
        wrong = K * np.array([[factor, 1, 1], [1, factor, 1], [1, 1, 1]])
        cameras = [Camera(wrong, motor) for motor in truth.motors]
        table, image_lines = truth.observations(rng, 0.4), truth.image_lines(rng, 0.4)
        found = bundle_adjust(cameras, truth.points, table, lines=truth.lines, image_lines=image_lines)
        refused += found.status != VisionStatus.OK
    assert refused >= 11


def test_lenses_without_distortion_are_estimated_from_lines_too() -> None:
    """The focal length from lines alone; lenses with distortion must be known, and their pixels are those they show."""
    rng = np.random.default_rng(11)
    truth = world(rng, cameras=6, points=0, lines=20)
    image_lines = truth.image_lines(rng, 0.0)
    wrong = K * np.array([[1.02], [1.02], [1.0]])
    wrong[0, 1], wrong[:2, 2] = K[0, 1], K[:2, 2]
    cameras = [Camera(wrong, motor) for motor in truth.motors]
    none: Any = np.zeros((0, 3)), ([], [], np.zeros((0, 2)))
    found = bundle_adjust(
        cameras, *none, lines=truth.lines, image_lines=image_lines, intrinsics="shared", estimated=["f"],
        fixed_cameras=[0, 1],
    )  # fmt: skip
    assert found.status == VisionStatus.OK and found.cameras[3].intrinsics[0, 0] == pytest.approx(700, abs=1e-5)
    assert found.lens_covariance.shape == (1, 1, 1) and found.lens_covariance[0, 0, 0] > 0
    bent = [Camera.from_intrinsics((700.0, 690.0), (320.0, 240.0), motor, 3.0) for motor in truth.motors]
    lens: dict[str, Any] = {"distortion": "brown", "coefficients": [-0.2, 0.05]}
    homogeneous = np.concatenate([image_lines[2], np.ones((*image_lines[2].shape[:2], 1))], 2)
    x = (homogeneous @ np.linalg.inv(K).T)[..., :2]
    s = (x**2).sum(-1, keepdims=True)
    seen = np.concatenate([x * (1 - 0.2 * s + 0.05 * s**2), np.ones((*x.shape[:2], 1))], 2) @ K.T
    table = image_lines[0], image_lines[1], seen[..., :2]
    found = bundle_adjust(bent, *none, lines=truth.lines + 0.01, image_lines=table, fixed_cameras=[0, 1], **lens)
    assert found.status == VisionStatus.OK and distances(found.lines, truth.lines).max() < 1e-6
    with pytest.raises(ValueError, match="lenses with distortion are estimated"):
        bundle_adjust(bent, *none, lines=truth.lines, image_lines=table, intrinsics="shared", **lens)


def test_arguments_are_checked() -> None:
    rng = np.random.default_rng(12)
    truth = world(rng)
    camera, line, pixels = truth.image_lines(rng, 0.1)
    with pytest.raises(ValueError, match="lines, image_lines: one of both"):
        bundle_adjust([Camera(K, m) for m in truth.motors], truth.points, truth.observations(rng, 0), lines=truth.lines)
    for table, message in (
        ((camera, line), "2 arrays; expected 3"),
        ((camera, line + 12, pixels), r"lines 12 to 23; expected 0 to 11"),
        ((camera[1:], line, pixels), r"cameras of shape \(59,\)"),
        ((camera, line, pixels[:, 0]), "expected .*two pixels of each line"),
    ):
        with pytest.raises(ValueError, match=message):
            truth.adjusted(rng, 0.1, image_lines=table)
    nan = pixels.copy()
    nan[3] = np.nan
    found = truth.adjusted(rng, 0.1, image_lines=(camera, line, nan))
    assert found.status == VisionStatus.OK and found.line_weights[3] == 0 and np.isnan(found.line_residuals[3])
