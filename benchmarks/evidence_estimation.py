"""Scenes of estimation for the page of evidence: each trial says whether a result is OK, and whether it is right."""

from __future__ import annotations

import numpy as np

from algorithms.estimation import MotorFilter, RotorFilter
from generated import pga3

from .evidence_scenes import BOUND, Trial, rotation, row


def _vectors(rng: np.random.Generator, n: int) -> np.ndarray:
    found = rng.normal(size=(n, 3))
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


def _rotor(turn: np.ndarray) -> np.ndarray:
    return np.asarray(pga3.rotor_from_matrix(turn))


def _between(a: np.ndarray, b: np.ndarray) -> float:
    """Degrees between two rotations."""
    return float(np.degrees(np.arccos(np.clip((np.trace(a @ b.T) - 1) / 2, -1, 1))))


def _started(rng: np.random.Generator, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """A true rotation, and one that differs from it by an angle between two limits in degrees."""
    truth = rotation(rng, np.pi)
    axis, angle = _vectors(rng, 1)[0], np.radians(rng.uniform(low, high))
    cross = np.cross(np.eye(3), axis)
    return truth, (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross) @ truth


def _filtered(rng: np.random.Generator, noise: float, wrong: bool, off: tuple[float, float], spread: float) -> Trial:
    truth, start = _started(rng, *off)
    gate = 24.0 if wrong else np.inf
    follower = RotorFilter(_rotor(start), spread**2 * np.eye(3), gate=gate)
    status = None
    for _ in range(4):
        model = _vectors(rng, 6 if wrong else int(rng.integers(2, 6)))
        seen = model @ truth.T + rng.normal(0, noise, model.shape)
        if wrong:
            seen[rng.integers(6)] = _vectors(rng, 1)[0]
        status = follower.update(model, seen, max(noise, 0.004))
    found = np.asarray(pga3.rotor_to_matrix(follower.rotor))
    bound = np.degrees(BOUND * np.sqrt(np.linalg.eigvalsh(follower.covariance)[-1]))
    return Trial(status == 0, _between(found, truth) < bound)


@row("`RotorFilter`", "exact vectors, start 100 to 180 degrees off, deviation of 180 degrees", good=True)
def rotor_from_afar(rng: np.random.Generator) -> Trial:
    return _filtered(rng, 0.0, False, (100, 180), np.pi)


@row("`RotorFilter`", "noise of 0.02, a sixth of the vectors wrong, gate, start 0 to 180 degrees off")
def rotor_with_wrong_vectors(rng: np.random.Generator) -> Trial:
    return _filtered(rng, 0.02, True, (0, 180), np.pi)


@row("`RotorFilter`", "noise of 0.02, start up to 20 degrees off, deviation of 12 degrees", good=True)
def rotor_nearby(rng: np.random.Generator) -> Trial:
    return _filtered(rng, 0.02, False, (0, 20), np.radians(12))


@row("`RotorFilter`", "noise of 0.02, start 60 to 180 degrees off, deviation stated as 3 degrees")
def rotor_of_wrong_start(rng: np.random.Generator) -> Trial:
    return _filtered(rng, 0.02, False, (60, 180), np.radians(3))


def _lines(rng: np.random.Generator, n: int) -> np.ndarray:
    return np.asarray(pga3.normalize_line(pga3.join_points(rng.normal(0, 2, (n, 3)), rng.normal(0, 2, (n, 3)))))


def _disturbed(rng: np.random.Generator, lines: np.ndarray, noise: float) -> np.ndarray:
    """Lines through their points next to the origin, displaced, in directions that are turned."""
    points = pga3.line_support(lines) + rng.normal(0, noise, (len(lines), 3))
    directions = pga3.line_to_direction_moment(lines)[0] + rng.normal(0, noise, (len(lines), 3))
    return np.asarray(pga3.normalize_line(pga3.join_point_direction(points, directions)))


def _motor_filtered(
    rng: np.random.Generator,
    noise: float,
    share: float,
    angle: float,
    away: float,
    spread: tuple[float, float],
    per: int,
) -> Trial:
    start = pga3.motor_exponential(rng.normal(size=6))
    turn = np.concatenate([_vectors(rng, 1)[0] * np.radians(angle), _vectors(rng, 1)[0] * away]) / 2
    truth = pga3.motor_product(pga3.motor_exponential(turn), start)
    covariance = np.diag([spread[0] ** 2] * 3 + [spread[1] ** 2] * 3)
    follower, status = MotorFilter(start, covariance, gate=18.5), None
    for _ in range(48 // per):
        model = _lines(rng, per)
        seen = _disturbed(rng, pga3.move_line(truth, model), noise)
        for k in np.flatnonzero(rng.random(per) < share):
            seen[k] = _lines(rng, 1)[0]
        status = follower.update_lines(model, seen, max(noise, 0.003))
    error = pga3.motor_product(truth, pga3.motor_inverse(follower.motor))
    off = np.degrees(2 * np.arccos(min(abs(error[0]), 1)))
    bound = np.degrees(BOUND * np.sqrt(np.linalg.eigvalsh(follower.covariance[:3, :3])[-1]))
    return Trial(status == 0, off < max(bound, 1e-6))


@row(
    "`MotorFilter(gate=)`",
    "exact lines, one to four at a time, up to two stated deviations of 15 to 90 degrees off",
    good=True,
)
def motor_from_afar(rng: np.random.Generator) -> Trial:
    per, spread = int(rng.integers(1, 5)), rng.uniform(0.25, 1.6)
    angle, away = np.degrees(spread * rng.uniform(0, 2)), rng.uniform(0, 8)
    return _motor_filtered(rng, 0.0, 0.0, angle, away, (spread, 5), per)


@row("`MotorFilter(gate=)`", "noise of 0.01, a sixth of the lines wrong, 180 degrees and 8 m off, wide start")
def motor_with_wrong_lines(rng: np.random.Generator) -> Trial:
    return _motor_filtered(rng, 0.01, 1 / 6, rng.uniform(60, 180), rng.uniform(0, 8), (np.pi, 10), 4)


@row("`MotorFilter(gate=)`", "the same, one line at a time")
def motor_by_single_lines(rng: np.random.Generator) -> Trial:
    return _motor_filtered(rng, 0.01, 1 / 6, rng.uniform(60, 180), rng.uniform(0, 8), (np.pi, 10), 1)


@row("`MotorFilter(gate=)`", "noise of 0.01, a start within its stated deviations of 6 degrees and 0.1 m", good=True)
def motor_nearby(rng: np.random.Generator) -> Trial:
    return _motor_filtered(rng, 0.01, 0.0, rng.uniform(0, 8), rng.uniform(0, 0.1), (0.1, 0.1), 4)


@row("`MotorFilter(gate=)`", "noise of 0.01, 30 to 180 degrees off, deviations stated as 1 degree and 2 cm")
def motor_of_wrong_start(rng: np.random.Generator) -> Trial:
    return _motor_filtered(rng, 0.01, 0.0, rng.uniform(30, 180), rng.uniform(0, 8), (0.02, 0.02), 4)
