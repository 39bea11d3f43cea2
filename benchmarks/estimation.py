"""How long filters take for one step, beside VQF and filterpy, with their errors on recordings."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.estimation import KalmanFilter, MotorFilter, OrientationSettings, filter_lines, orientation
from generated import pga3

from . import pages
from .libraries import installed
from .machine import version
from .vision import OURS, Task, _text, interleaved

PAGE = Path("docs/estimation-speed.md")
ROUNDS = 15
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


def _kalman(axes: int, t: int) -> Task:
    rng = np.random.default_rng(axes)
    dt, n = 0.1, 2 * axes
    move = np.kron(np.eye(axes), [[1, dt], [0, 1]])
    process = np.kron(np.eye(axes), [[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    rows = np.kron(np.eye(axes), [[1.0, 0]])
    noise = 0.2 * np.eye(axes)
    measurements = np.cumsum(rng.normal(size=(t, axes)), 0)
    system = (np.zeros(n), np.eye(n), move, process, rows, noise)
    ours = KalmanFilter(*system)
    calls: dict[str, Any] = {OURS: lambda: ours.run(measurements)}
    if installed("filterpy"):
        peer = importlib.import_module("filterpy.kalman")
        theirs = peer.KalmanFilter(dim_x=n, dim_z=axes)
        theirs.x, theirs.P, theirs.F, theirs.Q, theirs.H, theirs.R = system

        def run() -> None:
            for z in measurements:
                theirs.predict()
                theirs.update(z)

        calls["filterpy"] = run
    return Task(f"Kalman filter, {n} states, {axes} measured, a step of {t:,}", t, calls)


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
        Task("motor filter, prediction and update by one line", 1, {OURS: update(1)}),
    ]  # fmt: skip


def tasks(quick: bool) -> list[Task]:
    """All tasks."""
    t = 50 if quick else 1000
    return [_recording(quick), *(_kalman(axes, t) for axes in (1, 2, 3)), *_lines(100 if quick else 10_000)]


def page(found: list[tuple[Task, dict[str, float]]], rounds: int) -> str:
    """All figures as Markdown."""
    peers = " and ".join(f"{name} {version(name.lower())}" for name in ("VQF", "filterpy"))
    lines = [
        "# How fast filters are",
        "",
        f"Written by `python -m benchmarks estimation`, beside {peers}, one thread each. Microseconds for one",
        f"step: the least of {rounds} rounds in which libraries alternate. VQF is compiled C++; filterpy is Python on",
        "numpy.",
        "",
        "| | here | others | ratio |",
        "| --- | ---: | --- | ---: |",
    ]
    for task, times in found:
        others = {name: spent for name, spent in times.items() if name != OURS}
        text = ", ".join(f"{name} {_text(spent)}" for name, spent in others.items())
        ratio = ", ".join(f"{spent / times[OURS]:.1f}" for spent in others.values())
        lines.append(f"| {task.name} | {_text(times[OURS])} | {text} | {ratio} |")
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page.

    Parameters
    ----------
    arguments : list of str, optional
        Of the command line; left out, those of the process.
    """
    options = pages.options("estimation", __doc__, PAGE).parse_args(arguments)
    out: Path = options.out
    rounds = 1 if options.quick else ROUNDS
    found = [(task, interleaved(task, rounds)) for task in tasks(options.quick)]
    return pages.publish("estimation", out, page(found, rounds), f"{len(found)} tasks")


if __name__ == "__main__":
    sys.exit(main())
