"""Random lines and motors, lines with noise, and errors of motors, in coordinates that share no code with filters."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from algorithms.arguments import Reals
from generated import pga3


def lines(rng: np.random.Generator, n: int, spread: float = 2.0) -> Reals:
    """Unit lines through pairs of random points."""
    found = pga3.join_points(*(spread * rng.normal(size=(2, n, 3))))
    return np.asarray(found / np.linalg.norm(found[:, :3], axis=1)[:, None])


def direction_and_moment(line: Reals) -> tuple[Reals, Reals]:
    return np.stack([line[..., 2], -line[..., 1], line[..., 0]], -1), line[..., 3:]


def moved(motor: Reals, line: Reals) -> tuple[Reals, Reals]:
    """Direction and moment of moved lines, by matrices."""
    matrix = pga3.motor_to_matrix(motor)
    d, m = direction_and_moment(line)
    turned = d @ matrix[:3, :3].T
    return turned, m @ matrix[:3, :3].T + np.cross(matrix[:3, 3], turned)


def seen(rng: np.random.Generator, motor: Reals, line: Reals, sigma: tuple[float, float]) -> Reals:
    """Moved lines with noise of directions, and of moments about the points closest to the origin."""
    d, m = moved(motor, line)
    place = np.cross(d, m)
    e = d + sigma[0] * rng.normal(size=d.shape)
    e /= np.linalg.norm(e, axis=1)[:, None]
    own = sigma[1] * rng.normal(size=d.shape)
    own -= (own * e).sum(1)[:, None] * e
    moment = np.cross(place, e) + own
    return np.concatenate([np.stack([e[:, 2], -e[:, 1], e[:, 0]], -1), moment], 1)


def error(truth: Reals, motor: Reals) -> Reals:
    """The bivector x with ``exp(-x/2) motor = truth``, by the logarithm of rotation matrices."""
    between = pga3.motor_to_matrix(truth) @ np.linalg.inv(pga3.motor_to_matrix(motor))
    w = Rotation.from_matrix(between[:3, :3]).as_rotvec()
    angle = np.linalg.norm(w)
    k = np.cross(np.eye(3), w) * -1
    factor = 1 / 12 if angle < 1e-4 else 1 / angle**2 - (1 + np.cos(angle)) / (2 * angle * np.sin(angle))
    v = (np.eye(3) - k / 2 + factor * k @ k) @ between[:3, 3]
    return np.concatenate([[w[2], -w[1], w[0]], v])


def disturbed(rng: np.random.Generator, motor: Reals, covariance: Reals) -> Reals:
    """A true motor at a random error from an estimate."""
    x = np.linalg.cholesky(covariance) @ rng.normal(size=6)
    return np.asarray(pga3.motor_product(pga3.motor_exponential(-x / 2), motor))


def far_away(rng: np.random.Generator, distance: float = 10.0) -> tuple[Reals, Reals]:
    """Two motors at 180 degrees and this distance from each other."""
    axis, shift = rng.normal(size=(2, 3))
    axis *= np.pi / np.linalg.norm(axis)
    shift *= distance / np.linalg.norm(shift)
    start = pga3.motor_exponential(rng.normal(size=6))
    x = np.array([axis[2], -axis[1], axis[0], *shift])
    return np.asarray(start), np.asarray(pga3.motor_product(pga3.motor_exponential(-x / 2), start))
