"""How long filters take for one step, beside VQF and filterpy, with their errors on recordings."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.estimation import (
    ExtendedKalmanFilter,
    KalmanFilter,
    MotorFilter,
    MotorGraph,
    OrientationFilter,
    OrientationSettings,
    filter_lines,
    orientation,
    smooth_motors,
)
from generated import pga3

from . import pages
from .libraries import installed
from .machine import version
from .tasks import OURS, Task, interleaved, others_text, time_text

PAGE = Path("docs/estimation-speed.md")
ROUNDS = 60
RECORDING = Path("tests/data/estimation/broad_06_fast_rotation.npz")


def _recording(quick: bool) -> Task:
    with np.load(RECORDING) as file:
        n = 2000 if quick else len(file["rates"])
        samples = [np.ascontiguousarray(file[k][:n], float) for k in ("rates", "accelerations", "fields")]
        rate = float(file["rate"])
    settings = OrientationSettings()
    calls: dict[str, Any] = {OURS: lambda: orientation(*samples, rate, settings=settings)}
    if installed("vqf"):
        peer = importlib.import_module("vqf")
        calls["VQF"] = lambda: peer.VQF(1 / rate).updateBatch(*samples)
    return Task(f"orientation of an inertial sensor, a sample of {n:,}", n, calls)


def _samples(quick: bool) -> Task:
    """Single updates from Python, after the first seconds."""
    with np.load(RECORDING) as file:
        n = 200 if quick else 2000
        arrays = [np.ascontiguousarray(file[k], float) for k in ("rates", "accelerations", "fields")]
        rate = float(file["rate"])
    rows = [tuple(np.array(x[1000 + k]) for x in arrays) for k in range(n)]
    ours = OrientationFilter(rate)
    for k in range(1000):
        ours.update(*(x[k] for x in arrays))

    def updated(update: Any) -> None:
        for row in rows:
            update(*row)

    calls: dict[str, Any] = {OURS: lambda: updated(ours.update)}
    if installed("vqf"):
        theirs = importlib.import_module("vqf").VQF(1 / rate)
        calls["VQF"] = lambda: updated(theirs.update)
    return Task("the same, one update from Python", n, calls)


def _system(axes: int) -> tuple[Any, ...]:
    """Points that move on axes, of which the positions are measured."""
    dt, n = 0.1, 2 * axes
    move = np.kron(np.eye(axes), [[1, dt], [0, 1]])
    process = np.kron(np.eye(axes), [[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    rows = np.kron(np.eye(axes), [[1.0, 0]])
    return np.zeros(n), np.eye(n), move, process, rows, 0.2 * np.eye(axes)


def _by_filterpy(system: tuple[Any, ...]) -> Any:
    theirs = importlib.import_module("filterpy.kalman").KalmanFilter(dim_x=len(system[0]), dim_z=len(system[4]))
    theirs.x, theirs.P, theirs.F, theirs.Q, theirs.H, theirs.R = system
    return theirs


def _kalman(axes: int, t: int) -> Task:
    rng = np.random.default_rng(axes)
    measurements = np.cumsum(rng.normal(size=(t, axes)), 0)
    system = _system(axes)
    ours = KalmanFilter(*system)
    calls: dict[str, Any] = {OURS: lambda: ours.run(measurements)}
    if installed("filterpy"):
        theirs = _by_filterpy(system)

        def run() -> None:
            for z in measurements:
                theirs.predict()
                theirs.update(z)

        calls["filterpy"] = run
    return Task(f"Kalman filter, {2 * axes} states, {axes} measured, a step of {t:,}", t, calls)


def _steps(axes: int) -> Task:
    """One prediction and update at a time, as a program does that measures as it goes."""
    system = _system(axes)
    ours, z = KalmanFilter(*system), np.ones(axes)

    def run() -> None:
        ours.predict()
        ours.update(z)

    calls: dict[str, Any] = {OURS: run}
    if installed("filterpy"):
        theirs = _by_filterpy(system)

        def their_run() -> None:
            theirs.predict()
            theirs.update(z)

        calls["filterpy"] = their_run
    return Task(f"Kalman filter, {2 * axes} states, {axes} measured, a prediction and an update", 1, calls)


def _extended(axes: int) -> Task:
    """The linear problem by functions that return a value and its derivatives."""
    state, spread, move, process, rows, noise = _system(axes)
    ours, z = ExtendedKalmanFilter(state, spread), np.ones(axes)

    def run() -> None:
        ours.predict(lambda x: (move @ x, move), process)
        ours.update(z, lambda x: (rows @ x, rows), noise)

    calls: dict[str, Any] = {OURS: run}
    if installed("filterpy"):
        theirs = importlib.import_module("filterpy.kalman").ExtendedKalmanFilter(dim_x=2 * axes, dim_z=axes)
        theirs.x, theirs.P, theirs.F, theirs.Q, theirs.R = state, spread, move, process, noise

        def their_run() -> None:
            theirs.predict()
            theirs.update(z, lambda x: rows, lambda x: rows @ x)

        calls["filterpy"] = their_run
    return Task(f"extended Kalman filter, {2 * axes} states, {axes} measured, a prediction and an update", 1, calls)


def _lines(n: int) -> list[Task]:
    rng = np.random.default_rng(1)
    lines = pga3.join_points(rng.normal(size=(n, 3)), rng.normal(size=(n, 3)))
    seen = lines / np.linalg.norm(lines[:, :3], axis=1)[:, None] + 0.01 * rng.normal(size=(n, 6))
    one, prior = np.eye(8)[0], 0.01 * np.eye(6)
    follower = MotorFilter(one, prior, noise=1e-6)

    def update(k: int) -> Any:
        def run() -> None:
            follower.predict(0.01)
            follower.update_lines(lines[:k], seen[:k], 0.01)

        return run

    return [
        Task(f"motor filter, a line of a recording of {n:,}", n,
             {OURS: lambda: filter_lines(one, prior, lines, seen, 0.01, noise=1e-6)}),
        Task("motor filter, a line of 100 of an update", 100, {OURS: update(100)}),
        *(
            Task(f"motor filter, a line of a prediction and an update by {k}", k, {OURS: update(k)})
            for k in (1, 4, 16)
        ),
    ]  # fmt: skip


def _graph(n: int) -> Task:
    """A helix of poses with an edge to the pose one turn above, from a chain of noisy motions."""
    rng = np.random.default_rng(2)
    deviations = np.array([0.02] * 3 + [0.05] * 3)
    edges = np.array([(k, k + 1) for k in range(n - 1)] + [(k, k + 20) for k in range(n - 20)])
    step = pga3.motor_from_rotation_vector_translation([0, 0, np.pi / 10], [1.0, 0, 0.1])
    poses = [np.eye(8)[0]]
    for _ in range(n - 1):
        poses.append(np.asarray(pga3.motor_product(poses[-1], step)))
    first, second = (np.array(poses)[ends] for ends in edges.T)
    noise = deviations * rng.normal(size=(len(edges), 6))
    between = pga3.motor_product(pga3.motor_inverse(first), second)
    motions = pga3.motor_product(between, pga3.motor_from_rotation_vector_translation(noise[:, :3], noise[:, 3:]))
    start = [poses[0]]
    for motion in motions[: n - 1]:
        start.append(np.asarray(pga3.motor_product(start[-1], motion)))

    def smooth() -> Any:
        graph = MotorGraph()
        graph.add_priors(0, start[0], np.full(6, 1e-8))
        graph.add_motions(*edges.T, motions, deviations**2)
        return smooth_motors(graph, np.array(start))

    calls: dict[str, Any] = {OURS: smooth}
    if installed("gtsam"):
        gtsam = importlib.import_module("gtsam")
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        graph.add(gtsam.PriorFactorPose3(0, _pose(gtsam, start[0]), gtsam.noiseModel.Isotropic.Sigma(6, 1e-4)))
        model = gtsam.noiseModel.Diagonal.Sigmas(deviations)
        for (a, b), motion in zip(edges.tolist(), motions, strict=True):
            graph.add(gtsam.BetweenFactorPose3(a, b, _pose(gtsam, motion), model))
        for k, each in enumerate(start):
            values.insert(k, _pose(gtsam, each))
        calls["gtsam"] = lambda: gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
    return Task(f"smoothing of a graph of {n:,} poses, an edge", len(edges), calls)


def _pose(gtsam: Any, motor: Any) -> Any:
    return gtsam.Pose3(np.asarray(pga3.motor_to_matrix(motor)))


def tasks(quick: bool) -> list[Task]:
    """All tasks."""
    t = 50 if quick else 1000
    return [
        _recording(quick),
        _samples(quick),
        *(_kalman(axes, t) for axes in (1, 2, 3, 6)),
        *map(_steps, (1, 2, 3, 4)),
        *map(_extended, (2, 3)),
        *_lines(100 if quick else 10_000),
        _graph(40 if quick else 1000),
    ]


def page(found: list[tuple[Task, dict[str, float]]], rounds: int) -> str:
    """All figures as Markdown."""
    peers = " and ".join(f"{name} {version(name.lower())}" for name in ("VQF", "filterpy"))
    lines = [
        "# How fast filters are",
        "",
        f"Written by `python -m benchmarks estimation`, beside {peers}, one thread each. Microseconds for one",
        f"step: the least of {rounds} rounds in which libraries alternate. VQF is compiled C++; filterpy is Python on",
        "numpy. Extended filters are Python too, apart from the algebra of a step.",
        "",
        "| | here | others | ratio |",
        "| --- | ---: | --- | ---: |",
    ]
    for task, times in found:
        others = {name: spent for name, spent in times.items() if name != OURS}
        ratio = ", ".join(f"{spent / times[OURS]:.1f}" for spent in others.values())
        lines.append(f"| {task.name} | {time_text(times[OURS])} | {others_text(times)} | {ratio} |")
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("estimation", __doc__, PAGE).parse_args(arguments)
    out: Path = options.out
    rounds = 1 if options.quick else ROUNDS
    found = [(task, interleaved(task, rounds)) for task in tasks(options.quick)]
    return pages.publish("estimation", out, page(found, rounds), f"{len(found)} tasks")


if __name__ == "__main__":
    sys.exit(main())
