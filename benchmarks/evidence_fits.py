"""Scenes of fits and poses of objects for the page of evidence: other shapes, wrong points, other cameras and sizes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from algorithms.geometry import FitStatus, fit_circle, fit_line, fit_plane, fit_sphere
from algorithms.vision import Camera, Distortion
from algorithms.vision.objects import ObjectModel, SharedErrors, estimate_pose
from generated import cga3, pga3

from .evidence_objects import _cameras, _judged, _motor, _object, _view
from .evidence_scenes import BOUND, Trial, rotation, row

_FITS = {"line": fit_line, "plane": fit_plane, "circle": fit_circle, "sphere": fit_sphere}


def _shape(rng: np.random.Generator, kind: str, n: int) -> np.ndarray:
    """Points of a line or circle about z, the plane across z, or the cap of a sphere."""
    if kind == "line":
        return np.outer(rng.uniform(-1, 1, n), [0, 0, 1])
    if kind == "plane":
        return np.column_stack([rng.uniform(-1, 1, (n, 2)) * [1, rng.uniform(0.2, 1)], np.zeros(n)])
    angles = rng.uniform(0, rng.uniform(1, 2 * np.pi) if kind == "circle" else 2 * np.pi, n)
    z = np.zeros(n) if kind == "circle" else rng.uniform(rng.uniform(-1, 0.5), 1, n)
    across = np.sqrt(1 - z * z)
    return np.column_stack([across * np.cos(angles), across * np.sin(angles), z])


def _errors(kind: str, found: Any, turn: np.ndarray, place: np.ndarray, middle: np.ndarray, size: float) -> list[float]:
    """Errors in the order of the deviations."""

    def angle(direction: np.ndarray) -> float:
        return float(
            np.arcsin(min(float(np.linalg.norm(np.cross(direction / np.linalg.norm(direction), turn[:, 2]))), 1.0))
        )

    if kind == "line":
        off = float(np.linalg.norm(np.cross(middle - place, turn[:, 2])))
        return [angle(cga3.line_to_direction_moment(found.object)[0]), off]
    if kind == "plane":
        return [angle(cga3.plane_to_normal(found.object)[0]), abs(float((middle - place) @ turn[:, 2]))]
    if kind == "circle":
        radius = float(np.sqrt(cga3.circle_radius_squared(found.object)))
        off = float(np.linalg.norm(cga3.circle_centre(found.object) - place))
        return [off, abs(radius - size), angle(cga3.circle_normal(found.object))]
    radius = float(np.sqrt(cga3.sphere_radius_squared(found.object)))
    return [float(np.linalg.norm(cga3.sphere_centre(found.object) - place)), abs(radius - size)]


def _fitted(rng: np.random.Generator, share: float, jump: float) -> Trial:
    """A fit to points of its kind, of which some are off in random directions, or all by one shift."""
    kind, n = list(_FITS)[int(rng.integers(4))], int(np.exp(rng.uniform(np.log(8), np.log(300))))
    x, noise, size = _shape(rng, kind, n), 10 ** rng.uniform(-3, -1.2), 10 ** rng.uniform(-2, 2)
    wrong = rng.random(n) < share
    x[wrong] += jump * (rng.normal(size=3) if jump > 0 and rng.random() < 0.5 else rng.normal(size=(wrong.sum(), 3)))
    turn, place = rotation(rng, np.pi), size * rng.uniform(-5, 5, 3)
    there = size * (x + noise * rng.normal(size=x.shape)) @ turn.T + place
    found = _FITS[kind](there)
    if found.status != FitStatus.OK:
        return Trial(False, False)
    errors = np.array(_errors(kind, found, turn, place, there.mean(0), size))
    return Trial(True, bool((errors <= BOUND * found.deviations).all()))


@row("`fit_line` and others", "8 to 300 points of lines, planes, arcs and caps, noise of 0.1 to 6 %", good=True)
def fits_good(rng: np.random.Generator) -> Trial:
    return _fitted(rng, 0.0, 0.0)


@row("`fit_line` and others", "the same, 5 to 40 % of the points 0.1 to 1 radius off, in one direction or in any")
def fits_wrong_points(rng: np.random.Generator) -> Trial:
    return _fitted(rng, rng.uniform(0.05, 0.4), 10 ** rng.uniform(-1, 0))


@row(
    "`fit_line` and others", "20 to 300 points of corners, saddles, ellipses, squares, cubes and ellipsoids; wrong: any"
)
def fits_of_others(rng: np.random.Generator) -> Trial:
    n, kind, other = int(rng.integers(20, 300)), int(rng.integers(4)), rng.random() < 0.5
    noise, t = 10 ** rng.uniform(-3, -1.7), rng.uniform(-1, 1, n)
    ball, flat = rng.normal(size=(n, 3)), rng.uniform(-1, 1, (n, 2))
    if kind == 0:
        corner = np.stack([np.minimum(t, 0), np.maximum(t, 0), 0 * t], -1)
        found: Any = fit_line((corner if other else np.stack([t, 0.2 * t * t, 0 * t], -1)) + noise * ball)
    elif kind == 1:
        height = np.abs(flat[:, :1]) if other else 0.3 * flat[:, :1] * flat[:, 1:]
        found = fit_plane(np.concatenate([flat, height], 1) + noise * ball)
    elif kind == 2:
        ring = np.column_stack([np.cos(np.pi * t), np.sin(np.pi * t), 0 * t])
        shape = ring / np.abs(ring).max(1, keepdims=True) if other else ring * [1, rng.uniform(0.6, 0.85), 1]
        found = fit_circle(shape + noise * rng.normal(size=(n, 3)))
    else:
        unit = ball / np.linalg.norm(ball, axis=1, keepdims=True)
        shape = unit / np.abs(unit).max(1, keepdims=True) if other else unit * [1, 1, rng.uniform(0.6, 0.85)]
        found = fit_sphere(shape + noise * rng.normal(size=(n, 3)))
    return Trial(found.status == FitStatus.OK, False)


def _misfit(rng: np.random.Generator, what: str, shared: SharedErrors | None = None) -> Trial:
    """An object seen by one to three cameras; of another size or by a displaced camera, by two or three."""
    model, truth = _object(rng), _motor(rotation(rng, np.pi), rng.uniform(-0.02, 0.02, 3))
    stated = _cameras(rng, int(rng.integers(1 if what in ("focal", "lens") else 2, 4)), 0.5, 1.5)
    there, real = list(stated), model
    if what == "focal":
        f = rng.uniform(1.03, 1.3) ** rng.choice([-1, 1])
        there = [Camera.from_intrinsics((1150.0 * f, 1140.0 * f), (500.0, 390.0), one.pose) for one in stated]
    elif what == "lens":
        lens = Distortion("brown", (rng.choice([-1, 1]) * rng.uniform(0.05, 0.4),))
        there = [Camera(one.intrinsics, one.pose, lens) for one in stated]
    elif what == "camera":
        size = np.exp(rng.uniform(np.log(0.3), np.log(3)))
        step = pga3.motor_from_rotation_vector_translation(size * rng.normal(0, 0.01, 3), size * rng.normal(0, 0.01, 3))
        there[0] = Camera(stated[0].intrinsics, np.asarray(pga3.motor_product(stated[0].pose, step)))
    else:
        s = rng.uniform(1.03, 1.3) ** rng.choice([-1, 1])
        parts = (model.points * s, model.edges * s, model.balls * s)
        real = ObjectModel.of(*(part if len(part) else None for part in parts))
    views = [
        replace(_view(rng, real, truth, one, "stated"), camera=own) for one, own in zip(there, stated, strict=True)
    ]
    found = estimate_pose(model, views, noise=0.4, tolerance=(0.05, 0.2 * model.size), shared=shared)
    return _judged(found, truth, model)


@row("`estimate_pose`", "points, edges and spheres, a focal length that is wrong by 3 to 30 %")
def pose_of_wrong_focal(rng: np.random.Generator) -> Trial:
    return _misfit(rng, "focal")


@row("`estimate_pose`", "the same, stated with a deviation of 15 %")
def pose_of_stated_focal(rng: np.random.Generator) -> Trial:
    return _misfit(rng, "focal", SharedErrors(focal=0.15))


@row("`estimate_pose`", "the same, k1 of 0.05 to 0.4 without distortion")
def pose_of_bent_lens(rng: np.random.Generator) -> Trial:
    return _misfit(rng, "lens")


@row("`estimate_pose`", "the same, k1 stated with a deviation of 0.25")
def pose_of_stated_lens(rng: np.random.Generator) -> Trial:
    return _misfit(rng, "lens", SharedErrors(distortion=0.25))


@row("`estimate_pose`", "two or three cameras, an object that is larger or smaller by 3 to 30 %")
def pose_of_other_size(rng: np.random.Generator) -> Trial:
    return _misfit(rng, "size")


@row("`estimate_pose`", "two or three cameras, one of them 0.2 to 2 degrees and 3 to 30 mm off")
def pose_of_displaced_camera(rng: np.random.Generator) -> Trial:
    return _misfit(rng, "camera")
