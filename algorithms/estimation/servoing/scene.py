"""A simulation of a hand with two fingers, a box and two cameras."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from generated import pga3

from ...arguments import Reals, real_array
from .status import GraspStage, VisualStatus
from .steps import GraspSettings, GraspState, GraspStep, grasp_step


def camera_matrix(place: Reals, target: Reals, focal: Reals, centre: Reals, roll: float = 0.0) -> Reals:
    """Compute the matrix of a camera at a place that looks at a target.

    Parameters
    ----------
    place, target : array, (3,)
        In metres.
    focal, centre : array, (2,)
        Focal lengths and principal point in pixels.
    roll : float
        Rotation about the axis of the camera in radians. With 0, the rows of the image are horizontal; if the camera
        looks up or down, they are along the x axis.

    Returns
    -------
    array, (3, 4)

    Raises
    ------
    ValueError
        If the place is the target.
    """
    distance = float(np.linalg.norm(target - place))
    if not distance > 0:
        raise ValueError(f"place and target: both {place.tolist()}; expected two points")
    ahead = (target - place) / distance
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    length = float(np.linalg.norm(right))
    right = right / length if length > 0 else np.array([1.0, 0.0, 0.0])
    down = np.cross(ahead, right)
    c, s = np.cos(roll), np.sin(roll)
    rows = np.stack([c * right + s * down, -s * right + c * down, ahead])
    inner = np.array([[focal[0], 0, centre[0]], [0, focal[1], centre[1]], [0, 0, 1]])
    return np.asarray(inner @ np.column_stack([rows, -rows @ place]))


@dataclass(frozen=True, eq=False)
class VisualScene:
    """A hand, a box and two cameras.

    Attributes
    ----------
    hand : array, (8,)
        The motor of the hand: the middle of the tips is its origin, they are on its first axis, and the bases of the
        fingers are in the direction of its third axis.
    opening, length : float
        The distance of the fingers, and their length, in metres.
    box : array, (8,)
        The motor of the box, from its centre.
    size : array, (3,)
        The lengths of the edges of the box.
    cameras : array, (2, 3, 4)
    """

    hand: Reals
    opening: float
    length: float
    box: Reals
    size: Reals
    cameras: Reals

    def points(self) -> Reals:
        """Compute the marks of the hand and the corners of the box in space, (12, 3)."""
        half = self.opening / 2
        marks = np.array([[-half, 0, 0], [half, 0, 0], [-half, 0, self.length], [half, 0, self.length]])
        ends = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])
        return np.concatenate([pga3.move_point(self.hand, marks), pga3.move_point(self.box, ends * self.size)])

    def images(self, rng: np.random.Generator | None = None, noise: float = 0.0) -> Reals:
        """Compute images in pixels.

        Parameters
        ----------
        rng : numpy.random.Generator, optional
            The source of noise; left out, there is none.
        noise : float
            The standard deviation of the noise in pixels.

        Returns
        -------
        array, (2, 12, 2)
            Points behind a camera are NaN.
        """
        seen = np.einsum("cij,pj->cpi", self.cameras[..., :3], self.points()) + self.cameras[:, None, :, 3]
        depth = seen[..., 2:]
        found = seen[..., :2] / np.where(depth > 0, depth, np.nan)
        return np.asarray(found if rng is None or noise == 0 else found + noise * rng.normal(size=found.shape))

    def moved(self, motion: Reals, closing: float = 1.0) -> VisualScene:
        """Return the scene after a motion of the hand, as in `GraspStep`."""
        motion = real_array(motion, "motion", (6,), "a twist")
        turn, origin = motion[:3], pga3.move_point(self.hand, np.zeros(3))
        turned = pga3.move_point(pga3.motor_from_rotation_vector_translation(turn, np.zeros(3)), origin)
        motor = pga3.motor_from_rotation_vector_translation(turn, origin - turned + motion[3:])
        hand = pga3.normalize_motor(pga3.motor_product(motor, self.hand))
        return replace(self, hand=np.asarray(hand), opening=self.opening * closing)

    def deviation(self) -> tuple[float, float]:
        """Return how far the hand is from its goal, in metres and radians.

        The goal is the pose of the box, or the same turned by half a turn about the axis of the fingers.
        """
        between = pga3.motor_product(pga3.motor_inverse(self.box), self.hand)
        matrix = np.asarray(pga3.motor_to_matrix(between))
        flip = np.diag([1.0, 1.0, 1.0]) if matrix[0, 0] > 0 else np.diag([-1.0, -1.0, 1.0])
        rest = matrix[:3, :3] @ flip
        # Half the norm of the skew part is the sine of the angle, which is small numbers' accurate measure.
        skew = np.array([rest[2, 1] - rest[1, 2], rest[0, 2] - rest[2, 0], rest[1, 0] - rest[0, 1]]) / 2
        return float(np.linalg.norm(matrix[:3, 3])), float(np.arctan2(np.linalg.norm(skew), (np.trace(rest) - 1) / 2))


def random_scene(rng: np.random.Generator, farthest: float = 0.15, turn: float = 0.6) -> VisualScene:
    """Return a scene with random cameras, a random box, and a hand away from it.

    Parameters
    ----------
    rng : numpy.random.Generator
    farthest : float
        The largest distance of the hand from its goal, in metres.
    turn : float
        The largest angle between the hand and its goal, in radians.

    Returns
    -------
    VisualScene
    """
    yaw = rng.uniform(-0.25, 0.25)
    box = pga3.motor_from_rotation_vector_translation([0, 0, yaw], rng.uniform(-0.05, 0.05, 3))
    size = rng.uniform([0.05, 0.05, 0.08], [0.08, 0.08, 0.14])
    cameras = []
    for side in (-1, 1):
        azimuth, height = side * rng.uniform(0.5, 0.9) - np.pi / 2, rng.uniform(0.4, 0.8)
        away = rng.uniform(0.6, 0.9)
        direction = np.array([np.cos(azimuth) * np.cos(height), np.sin(azimuth) * np.cos(height), np.sin(height)])
        focal = rng.uniform(700, 1100) * np.array([1, rng.uniform(0.9, 1.1)])
        target = rng.uniform(-0.04, 0.04, 3)
        centre = rng.uniform([280, 200], [360, 280])
        cameras.append(camera_matrix(away * direction, target, focal, centre, rng.uniform(-0.2, 0.2)))
    axis, way = rng.normal(size=(2, 3))
    way[2] = abs(way[2])
    start = pga3.motor_from_rotation_vector_translation(
        turn * rng.uniform() * axis / np.linalg.norm(axis), farthest * rng.uniform(0.3, 1) * way / np.linalg.norm(way)
    )
    hand = np.asarray(pga3.motor_product(box, start))
    return VisualScene(hand, size[0] + 0.04, 0.06, np.asarray(box), size, np.array(cameras))


@dataclass(frozen=True, eq=False)
class GraspRun:
    """A simulated grasp.

    Attributes
    ----------
    scenes : tuple of VisualScene
        Before each step and after the last.
    steps : tuple of GraspStep
    """

    scenes: tuple[VisualScene, ...]
    steps: tuple[GraspStep, ...]

    @property
    def status(self) -> VisualStatus:
        """OK if the object is held, and otherwise what ended the run."""
        last = self.steps[-1]
        if last.status is VisualStatus.OK and last.state.stage is not GraspStage.DONE:
            return VisualStatus.NOT_CONVERGED
        return last.status


def simulate_grasp(
    scene: VisualScene, settings: GraspSettings, rng: np.random.Generator | None = None, at_most: int = 2000
) -> GraspRun:
    """Run a guided grasp until the object is held, or the images do not allow a step.

    Parameters
    ----------
    scene : VisualScene
    settings : GraspSettings
        The images have its noise.
    rng : numpy.random.Generator, optional
        The source of the noise, which is required if there is any.
    at_most : int
        The largest number of steps, at least 1.

    Returns
    -------
    GraspRun

    Raises
    ------
    ValueError
        If there is noise without a source, or `at_most` is not positive.
    """
    if settings.noise > 0 and rng is None:
        raise ValueError(f"rng: None with a noise of {settings.noise} pixels; expected a source of noise")
    if at_most < 1:
        raise ValueError(f"at_most: {at_most}; expected a positive number of steps")
    scenes, steps, state = [scene], [], GraspState()
    for _ in range(at_most):
        step = grasp_step(state, scene.images(rng, settings.noise), settings)
        steps.append(step)
        state = step.state
        if step.status is not VisualStatus.OK or state.stage is GraspStage.DONE:
            break
        scene = scene.moved(step.motion, step.closing) if step.motion.any() or step.closing != 1 else scene
        scenes.append(scene)
    return GraspRun(tuple(scenes), tuple(steps))
