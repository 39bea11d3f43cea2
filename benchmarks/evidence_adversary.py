"""Scenes against single estimators for the page of evidence: noise, shapes and structures that are not stated."""

from __future__ import annotations

import numpy as np

from algorithms.estimation import MotorFilter, RotorFilter
from generated import pga3, vga3

from .evidence_scenes import BOUND, Trial, row


def _directions(rng: np.random.Generator, n: int) -> np.ndarray:
    found = rng.normal(size=(n, 3))
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


def _angle(rotor: np.ndarray) -> float:
    return float(2 * np.arccos(min(abs(rotor[0]), 1)))


def _turned_vectors(rng: np.random.Generator, factor: float, rate: float) -> Trial:
    """Twenty updates by two to four vectors, with a multiple of the noise, and a rotation that is not predicted."""
    truth = np.asarray(vga3.rotor_exponential(rng.normal(size=3)))
    start = vga3.rotor_product(vga3.rotor_from_rotation_vector(0.1 * rng.normal(size=3)), truth)
    step = vga3.rotor_from_rotation_vector(rate * _directions(rng, 1)[0])
    noise = rng.uniform(0.01, 0.04)
    follower, status = RotorFilter(start, 0.01 * np.eye(3)), None
    for _ in range(20):
        truth = np.asarray(vga3.rotor_product(step, truth))
        model = _directions(rng, int(rng.integers(2, 5)))
        seen = vga3.rotate_vector(truth, model) + factor * noise * rng.normal(size=model.shape)
        status = follower.update(model, seen, noise)
    off = _angle(np.asarray(vga3.rotor_product(truth, vga3.rotor_inverse(follower.rotor))))
    return Trial(status == 0, off < BOUND * np.sqrt(np.linalg.eigvalsh(follower.covariance)[-1]))


@row("`RotorFilter`", "20 updates by two to four vectors", good=True)
def rotor_of_many_updates(rng: np.random.Generator) -> Trial:
    return _turned_vectors(rng, 1.0, 0.0)


@row("`RotorFilter`", "the same with 1.4 to 3 times the noise that is stated")
def rotor_of_noisy_vectors(rng: np.random.Generator) -> Trial:
    return _turned_vectors(rng, rng.uniform(1.4, 3), 0.0)


@row("`RotorFilter`", "the same with a rotation of 0.01 to 0.05 rad an update that is not predicted")
def rotor_of_turning_vectors(rng: np.random.Generator) -> Trial:
    return _turned_vectors(rng, 1.0, rng.uniform(0.01, 0.05))


def _moved_points(rng: np.random.Generator, factor: float, rate: float, share: float, gate: float) -> Trial:
    """Twenty updates by three to five points, with the same errors, and a share of them on another body."""
    truth, other = (np.asarray(pga3.motor_exponential(rng.normal(size=6))) for _ in range(2))
    start = pga3.motor_product(pga3.motor_exponential(0.03 * rng.normal(size=6)), truth)
    step, noise = pga3.motor_exponential(rate * rng.normal(size=6)), rng.uniform(0.005, 0.03)
    follower, status = MotorFilter(start, 0.01 * np.eye(6), gate=gate), None
    for _ in range(20):
        truth = np.asarray(pga3.motor_product(step, truth))
        model = 2 * rng.normal(size=(int(rng.integers(3, 6)), 3))
        on_other = rng.random((len(model), 1)) < share
        seen = np.where(on_other, pga3.move_point(other, model), pga3.move_point(truth, model))
        status = follower.update_points(model, seen + factor * noise * rng.normal(size=model.shape), noise)
    off = _angle(np.asarray(pga3.motor_product(truth, pga3.motor_inverse(follower.motor))))
    return Trial(status == 0, off < BOUND * np.sqrt(np.linalg.eigvalsh(follower.covariance[:3, :3])[-1]))


@row("`MotorFilter(gate=)`", "20 updates by three to five points", good=True)
def motor_of_points(rng: np.random.Generator) -> Trial:
    return _moved_points(rng, 1.0, 0.0, 0.0, 16.3)


@row("`MotorFilter(gate=)`", "the same with 1.4 to 3 times the noise that is stated, with a gate or without", slow=True)
def motor_of_noisy_points(rng: np.random.Generator) -> Trial:
    return _moved_points(rng, rng.uniform(1.4, 3), 0.0, 0.0, float(rng.choice([16.3, np.inf])))


@row("`MotorFilter(gate=)`", "the same with a motion at each update that is not predicted", slow=True)
def motor_of_moving_points(rng: np.random.Generator) -> Trial:
    return _moved_points(rng, 1.0, rng.uniform(0.003, 0.02), 0.0, float(rng.choice([16.3, np.inf])))


@row("`MotorFilter(gate=)`", "the same, a fifth to two fifths of the points on another body", slow=True)
def motor_of_two_bodies(rng: np.random.Generator) -> Trial:
    return _moved_points(rng, 1.0, 0.0, rng.uniform(0.2, 0.4), 16.3)
