"""Scenes whose data contradict the model for the page of evidence: other cameras, noise, shapes and motions."""

from __future__ import annotations

import numpy as np

from algorithms.estimation import KalmanFilter
from algorithms.mapping import optimise_poses
from algorithms.mapping.objects import fit_circle
from algorithms.vision import Camera, Distortion, Localization, calibrate_from_planes, localize
from generated import pga2, pga3

from .evidence_scenes import BOUND, Trial, rotation, row

_K = np.array([[640.0, 0, 480], [0, 640.0, 400], [0, 0, 1]])
"""A camera that no test uses."""


def _camera(rng: np.random.Generator, n: int, noise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points in space, their pixels, and the pose from the world to the camera."""
    points, turn = rng.uniform(-1, 1, (n, 3)) * [1, 0.8, 0.6], rotation(rng, np.pi)
    place = np.array([*rng.uniform(-0.4, 0.4, 2), rng.uniform(3, 6)])
    pixels = (points @ turn.T + place) @ _K.T
    return points, pixels[:, :2] / pixels[:, 2:] + rng.normal(0, noise, (n, 2)), turn, place


def _located(found: Localization, turn: np.ndarray, place: np.ndarray) -> Trial:
    """Right if rotation and centre are within the stated bounds."""
    if found.status != 0:
        return Trial(False, False)
    own = np.asarray(pga3.motor_to_matrix(found.pose))
    angle = np.arccos(np.clip((np.trace(own[:3, :3] @ turn) - 1) / 2, -1, 1))
    off = np.array([angle, np.linalg.norm(own[:3, 3] + turn.T @ place)])
    return Trial(True, bool((off <= BOUND * found.deviation).all()))


@row("`localize`", "20 to 50 points, a focal length that is wrong by 10 to 50 %, no threshold")
def wrong_focal_length(rng: np.random.Generator) -> Trial:
    points, pixels, turn, place = _camera(rng, int(rng.integers(20, 51)), 0.5)
    factor = rng.uniform(1.1, 1.5) ** rng.choice([-1, 1])
    return _located(localize(points, pixels, _K * [[factor, 1, 1], [1, factor, 1], [1, 1, 1]]), turn, place)


@row("`localize`", "30 to 80 points, a quarter of the pixels wrong, noise of 0.6 to 1.2 thresholds")
def noise_near_the_threshold(rng: np.random.Generator) -> Trial:
    points, pixels, turn, place = _camera(rng, int(rng.integers(30, 81)), rng.uniform(1.2, 2.4))
    wrong = rng.random(len(points)) < 0.25
    pixels[wrong] = rng.uniform(0, 900, (int(wrong.sum()), 2))
    return _located(localize(points, pixels, _K, threshold=2.0), turn, place)


@row("`localize`", "15 to 30 points, each with its pixel two to five times", good=True)
def copied_pixels(rng: np.random.Generator) -> Trial:
    points, pixels, turn, place = _camera(rng, int(rng.integers(15, 31)), 0.5)
    times = int(rng.integers(2, 6))
    return _located(localize(np.tile(points, (times, 1)), np.tile(pixels, (times, 1)), _K, threshold=2.0), turn, place)


@row(
    "`calibrate_from_planes`",
    "10 boards, k1 of 0.005 to 0.02, without distortion; wrong: a parameter off by 4.4 deviations",
    slow=True,
)
def slight_distortion(rng: np.random.Generator) -> Trial:
    board = np.stack(np.meshgrid(np.arange(9.0) - 4, np.arange(7.0) - 3), -1).reshape(-1, 2) / 5
    lens, views = Distortion("brown", (rng.uniform(0.005, 0.02) * rng.choice([-1, 1]),)), []
    for _ in range(10):
        place = np.array([*rng.uniform(-0.5, 0.5, 2), -rng.uniform(3, 5)])
        pose = pga3.motor_from_rotation_vector_translation(rng.uniform(-0.5, 0.5, 3), place)
        seen = Camera(_K, pose, lens).project(np.insert(board, 2, 0, axis=1))
        views.append(seen + rng.normal(0, 0.25, seen.shape))
    found = calibrate_from_planes(board, views)
    if found.status != 0:
        return Trial(False, False)
    off = np.abs(found.intrinsics[[0, 1, 0, 1], [0, 1, 2, 2]] - [640, 640, 480, 400])
    return Trial(True, bool((off < 4.4 * np.sqrt(np.diag(found.covariance)[:4])).all()))


def _graph(rng: np.random.Generator, factor: float, n_wrong: int) -> Trial:
    """A random walk in the plane with closures; wrong edges, or noise that is larger than stated."""
    n, sigma = int(rng.integers(20, 60)), np.array([0.01, 0.03, 0.03])
    truth = [np.eye(4)[0]]
    for _ in range(n - 1):
        step = pga2.motor_from_angle_translation(rng.normal(0, 0.4), np.array([1.0, 0.0]))
        truth.append(np.asarray(pga2.motor_product(truth[-1], step)))
    places = np.array(truth)
    first = rng.integers(0, n - 5, n // 2)
    loops = np.stack([first, [rng.integers(k + 3, n) for k in first]], 1)
    edges = np.concatenate([np.stack([np.arange(n - 1), np.arange(1, n)], 1), loops])
    motions = pga2.motor_product(pga2.motor_inverse(places[edges[:, 0]]), places[edges[:, 1]])
    off = factor * sigma * rng.normal(size=(len(edges), 3))
    if n_wrong:
        off[rng.permutation(len(edges))[:n_wrong]] = rng.normal(size=(n_wrong, 3)) * [0.3, 1, 1]
    motions = np.asarray(pga2.motor_product(motions, pga2.motor_from_angle_translation(off[:, 0], off[:, 1:])))
    start = [truth[0]]
    for k in range(n - 1):
        start.append(np.asarray(pga2.motor_product(start[-1], motions[k])))
    information = np.tile(np.diag(sigma**-2.0), (len(edges), 1, 1))
    found = optimise_poses(np.array(start), edges, motions, information, marginals=[n - 1])
    if found.status != 0:
        return Trial(False, False)
    angle, shift = pga2.motor_to_angle_translation(pga2.motor_product(pga2.motor_inverse(found.motors[-1]), places[-1]))
    step = np.array([float(angle), *np.asarray(shift)])
    # A quantile of 0.999 of the chi-square distribution of three numbers.
    return Trial(True, bool(step @ np.linalg.solve(found.covariances[0], step) < 16.3))


@row("`optimise_poses`", "20 to 60 poses in the plane, one or two edges wrong, none robust")
def wrong_edges(rng: np.random.Generator) -> Trial:
    return _graph(rng, 1.0, int(rng.integers(1, 3)))


@row("`optimise_poses`", "20 to 60 poses in the plane, 1.5 to 3 times the noise that is stated")
def noisy_edges(rng: np.random.Generator) -> Trial:
    return _graph(rng, rng.uniform(1.5, 3), 0)


@row("`optimise_poses`", "20 to 60 poses in the plane", good=True)
def right_edges(rng: np.random.Generator) -> Trial:
    return _graph(rng, 1.0, 0)


@row("`fit_circle`", "corners, arcs of ellipses and waves of 30 to 80 points, noise of 1 cm")
def no_circles(rng: np.random.Generator) -> Trial:
    t, kind = np.linspace(0, 1, int(rng.integers(30, 81))), int(rng.integers(3))
    if kind == 0:
        shape = np.stack([np.maximum(t - 0.5, 0), np.maximum(0.5 - t, 0)], 1) * rng.uniform(0.8, 2)
    elif kind == 1:
        shape = 0.5 * np.stack([np.cos(5 * t), rng.uniform(0.5, 0.8) * np.sin(5 * t)], 1)
    else:
        shape = np.stack([t, 0.07 * np.sin(9 * t)], 1)
    return Trial(fit_circle(shape + rng.normal(0, 0.01, shape.shape)).status == 0, False)


@row("`fit_circle`", "arcs of 1 to 3 of columns of 10 to 50 cm, noise of 1 cm", good=True)
def columns(rng: np.random.Generator) -> Trial:
    """Right if the curvature is off by at most four deviations of points along a chord (Gluckstern 1963)."""
    radius, turn, n = rng.uniform(0.1, 0.5), rng.uniform(1, 3), int(rng.integers(30, 81))
    angles = turn * np.linspace(-0.5, 0.5, n)
    points = radius * np.stack([np.cos(angles), np.sin(angles)], 1) + rng.normal(0, 0.01, (n, 2))
    found = fit_circle(points + 5)
    bound = BOUND * 0.01 / (2 * radius * np.sin(turn / 2)) ** 2 * np.sqrt(720 / (n + 4))
    return Trial(found.status == 0, found.fitted is not None and abs(1 / found.fitted.size[2] - 1 / radius) < bound)


def _recording(rng: np.random.Generator, factor: float, pull: float, share: float) -> Trial:
    """A point of constant velocity whose place is measured 80 times."""
    move, process = np.array([[1, 0.1], [0, 1]]), 0.2 * np.array([[0.1**3 / 3, 0.005], [0.005, 0.1]])
    state, found = rng.normal(size=2), []
    for _ in range(80):
        state = move @ state + np.linalg.cholesky(process) @ rng.normal(size=2) + [0, 0.1 * pull]
        wrong = rng.random() < share
        found.append([rng.uniform(-20, 20) if wrong else state[0] + 0.3 * factor * rng.normal()])
    own = KalmanFilter(np.zeros(2), np.eye(2), move, process, [[1.0, 0.0]], [[0.09]])
    own.run(np.array(found))
    off = own.state - state
    # A quantile of 0.999 of the chi-square distribution of two numbers.
    return Trial(bool(own.status == 0), bool(off @ np.linalg.solve(own.covariance, off) < 13.9))


@row("`KalmanFilter`", "80 measurements; twice the noise that is stated, an acceleration, or a tenth wrong")
def contradicting_recordings(rng: np.random.Generator) -> Trial:
    kind = int(rng.integers(3))
    return _recording(rng, 2.0 if kind == 0 else 1.0, 4.0 if kind == 1 else 0.0, 0.1 if kind == 2 else 0.0)


@row("`KalmanFilter`", "80 measurements of a point of nearly constant velocity", good=True)
def right_recordings(rng: np.random.Generator) -> Trial:
    return _recording(rng, 1.0, 0.0, 0.0)
