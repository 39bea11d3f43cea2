"""Scenes against single estimators for the page of evidence: noise, shapes and structures that are not stated."""

from __future__ import annotations

import numpy as np

from algorithms.estimation import MotorFilter, RotorFilter
from algorithms.mapping import SolidKind, fit_box, fit_circle, fit_solid
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


@row("`RotorFilter`", "the same with 1.4 to 3 times the noise that is stated", slow=True)
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


def _surface(rng: np.random.Generator, kind: str) -> np.ndarray:
    """From 60 to 250 points on a part of a surface of about a metre."""
    n = int(rng.integers(60, 250))
    u, v = rng.uniform(-1, 1, (2, n))
    if kind == "plane":
        return np.column_stack([u, rng.uniform(0.3, 1) * v, 0 * u])
    if kind == "saddle":
        return np.column_stack([u, v, rng.uniform(0.05, 0.3) * u * v])
    if kind == "cylinder":
        return np.column_stack([np.cos(0.9 * u), np.sin(0.9 * u), v])
    out = rng.normal(size=(4 * n, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    out = out[out[:, 2] > rng.uniform(-0.2, 0.5)][:n]
    scale = {"sphere": 1.0, "ellipsoid": rng.uniform(0.5, 0.85)}.get(kind)
    if scale is not None:
        return np.asarray(rng.uniform(0.2, 0.6) * out * [1, scale, 1])
    # A cube, of which a corner is seen.
    return np.asarray((0.5 * out / np.abs(out).max(1, keepdims=True))[out.min(1) > -0.5])


def _solid(rng: np.random.Generator, kind: str, solid: SolidKind, factor: float) -> Trial:
    """Right if the normal or the centre is within the stated bound."""
    shape, sigma = _surface(rng, kind), rng.uniform(0.005, 0.015)
    points = shape + factor * sigma * rng.normal(size=shape.shape)
    spreads = np.tile(sigma**2 * np.array([1.0, 0, 0, 1, 0, 1]), (len(points), 1))
    found = fit_solid(points + 2, spreads, solid)
    if found.solid is None:
        return Trial(False, False)
    if kind not in ("plane", "sphere"):
        return Trial(True, False)
    if solid == SolidKind.PLANE:
        off = float(np.linalg.norm(found.solid.plane[:2]))
    else:
        off = float(np.linalg.norm(found.solid.centre - 2))
    return Trial(True, off < BOUND * found.deviation)


@row("`fit_solid`", "planes and spheres, points in no order", good=True)
def right_solids(rng: np.random.Generator) -> Trial:
    kind = SolidKind(int(rng.integers(2)))
    return _solid(rng, kind.name.lower(), kind, 1.0)


@row("`fit_solid`", "the same with 1.5 to 3 times the noise that is stated")
def noisy_solids(rng: np.random.Generator) -> Trial:
    kind = SolidKind(int(rng.integers(2)))
    return _solid(rng, kind.name.lower(), kind, rng.uniform(1.5, 3))


@row("`fit_solid`", "planes of cylinders and saddles, spheres of ellipsoids and corners of cubes; wrong: any object")
def solids_of_other_shapes(rng: np.random.Generator) -> Trial:
    kind = str(rng.choice(["cylinder", "saddle", "ellipsoid", "cube"]))
    return _solid(rng, kind, SolidKind.PLANE if kind in ("cylinder", "saddle") else SolidKind.SPHERE, 1.0)


@row("`fit_box`", "half of the outline of columns, ellipses and hexagons of 0.2 to 0.6 m; wrong: any box", slow=True)
def boxes_of_other_shapes(rng: np.random.Generator) -> Trial:
    angle = rng.uniform(0, 2 * np.pi) + np.linspace(-1.5, 1.5, int(rng.integers(30, 90)))
    side = np.pi / 3
    radius = 1 / np.cos((angle % side) - side / 2) if rng.random() < 0.3 else np.ones_like(angle)
    place = np.stack([np.cos(angle), np.sin(angle)], 1)
    shape = rng.uniform(0.2, 0.6) * radius[:, None] * place * [1, rng.choice([1, rng.uniform(0.5, 0.9)])]
    eye = 3 * place[len(place) // 2]
    return Trial(fit_box(shape + 0.01 * rng.normal(size=shape.shape), 0.01, eye).status == 0, False)


@row("`fit_circle`", "3 to 40 points at random in a square, or each of five eight times; wrong: any circle")
def circles_of_random_points(rng: np.random.Generator) -> Trial:
    points = rng.uniform(-1, 1, (int(rng.integers(3, 41)), 2))
    points = np.repeat(points[:5], 8, axis=0) if rng.random() < 0.3 else points
    return Trial(fit_circle(points, 0.02).status == 0, False)
