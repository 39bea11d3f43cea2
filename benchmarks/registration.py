"""How many registrations succeed from any rotation, and how long they take, beside small_gicp and pycpd."""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from algorithms.registration import RegistrationStatus, register, register_matches, separate_motions
from generated import pga3

from . import pages, tensor_voting
from .libraries import installed
from .machine import version
from .registration_scenes import OBJECTS, clouds, error, least_error, scene

PAGE = Path("docs/registration-speed.md")
ROUNDS, SLOW_ROUNDS = 10, 1
HEADINGS = 12
Array = np.ndarray[Any, Any]


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """Return a result, and the seconds of processor time that it took."""
    start = time.process_time()
    found = call()
    return found, time.process_time() - start


def by_gicp(source: Array, target: Array) -> Array:
    """Return the matrix by GICP of small_gicp from the centroids and the identity."""
    peer = importlib.import_module("small_gicp")
    start = np.eye(4)
    start[:3, 3] = target.mean(0) - source.mean(0)
    size = float(np.linalg.norm(target.std(0)))
    found = peer.align(
        target, source, start, registration_type="GICP", downsampling_resolution=0.01 * size,
        max_correspondence_distance=0.5 * size, num_threads=1,
    )  # fmt: skip
    return np.asarray(found.T_target_source)


def by_cpd(source: Array, target: Array) -> Array:
    """Return the matrix by rigid coherent point drift of pycpd, with outliers and without a change of scale."""
    peer = importlib.import_module("pycpd")
    _, (_, turn, shift) = peer.RigidRegistration(X=target, Y=source, scale=False, w=0.5).register()
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn.T, shift
    return matrix


def objects(rounds: int) -> list[str]:
    """Return rows of damaged objects: successes and times."""
    rows = []
    peers = {"small_gicp": by_gicp, "pycpd": by_cpd}
    for name in OBJECTS:
        found, spent = 0, []
        others = dict.fromkeys(peers, (0, 0, 0.0))
        for seed in range(rounds):
            source, _, target, matrix = scene(name, 100 + seed, {0: 0.0, 1: np.pi}.get(seed))
            diagonal = np.linalg.norm(np.ptp(target, axis=0))
            result, seconds = timed(lambda s=source, t=target: register(s, t))  # type: ignore[misc]
            spent.append(seconds)
            angle, shift = least_error(result, matrix, source) if len(result.poses.motors) else (np.inf, np.inf)
            found += bool(angle < 0.5 and shift < 0.005 * diagonal)
            for peer, call in peers.items():
                if not installed(peer) or (peer == "pycpd" and seed >= SLOW_ROUNDS):
                    continue
                its, seconds = timed(lambda s=source, t=target, c=call: c(s, t))  # type: ignore[misc]
                angle, shift = error(its, matrix, source.mean(0))
                good, count, total = others[peer]
                others[peer] = good + bool(angle < 0.5 and shift < 0.005 * diagonal), count + 1, total + seconds
        texts = [f"{good} of {n}, {s / max(n, 1):.2f} s" for good, n, s in others.values()]
        rows.append(
            f"| {name} | {found} of {rounds} | {np.median(spent):.2f} | {max(spent):.2f} | {' | '.join(texts)} |"
        )
    return rows


def lidar(headings: int) -> list[str]:
    """Return the row of the lidar pair from all headings."""
    data = clouds()
    source, target, motion = data["outdoor_source"], data["outdoor_target"], data["outdoor_motion"]
    shifts, spent, peer = [], [], 0
    for k in range(headings):
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_euler("z", 2 * np.pi * k / headings).as_matrix()
        turned = source @ turn[:3, :3]
        result, seconds = timed(lambda s=turned: register(s, target))  # type: ignore[misc]
        shifts.append(1e3 * error(pga3.motor_to_matrix(result.motor), motion @ turn, np.zeros(3))[1])
        spent.append(seconds)
        if installed("small_gicp"):
            peer += error(by_gicp(turned, target), motion @ turn, np.zeros(3))[1] < 0.05
    good = int(np.sum(np.array(shifts) <= 50))
    own = f"{good} | {max(shifts):.1f} | {np.median(spent):.2f} | {max(spent):.2f}"
    return [f"| lidar pair, {headings} headings | {own} | {peer} |"]


def of_matches(rounds: int) -> list[str]:
    """Return rows of matches, of which nine of ten are wrong, and of two motions."""
    rows = []
    for count in (100, 1000):
        good, spent = 0, []
        for seed in range(rounds):
            x, y, turns = matched(seed, count, [count // 10])
            found, seconds = timed(lambda x=x, y=y: register_matches(x, y))  # type: ignore[misc]
            spent.append(1e3 * seconds)
            good += found.status == RegistrationStatus.OK and turned_by(found.motor, turns[0]) < 0.5
        own = f"{good} of {rounds} | {np.median(spent):.1f} | {max(spent):.1f}"
        rows.append(f"| {count} matches, 90 % wrong | {own} |")
    good, spent = 0, []
    for seed in range(rounds):
        x, y, turns = matched(seed, 600, [100, 80])
        motions, seconds = timed(lambda x=x, y=y: separate_motions(x, y))  # type: ignore[misc]
        spent.append(1e3 * seconds)
        good += len(motions) == 2 and all(min(turned_by(m.motor, turn) for m in motions) < 0.5 for turn in turns)
    own = f"{good} of {rounds} | {np.median(spent):.1f} | {max(spent):.1f}"
    rows.append(f"| two motions, 100 and 80 of 600 | {own} |")
    return rows


def matched(seed: int, count: int, groups: list[int], noise: float = 0.005) -> tuple[Array, Array, list[Array]]:
    """Return random matches, of which the first groups are right, and the rotations of the groups."""
    rng = np.random.default_rng(seed)
    x, y, row, turns = rng.normal(size=(count, 3)), rng.normal(size=(count, 3)), 0, []
    for k, group in enumerate(groups):
        turns.append(Rotation.random(random_state=7 * seed + k).as_matrix())
        rows = slice(row, row + group)
        y[rows] = x[rows] @ turns[-1].T + rng.normal(size=3) + noise * rng.normal(size=(group, 3))
        row += group
    return x, y, turns


def turned_by(motor: Array, turn: Array) -> float:
    """Return the angle in degrees between a motor and a rotation."""
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    return error(pga3.motor_to_matrix(motor), matrix, np.zeros(3))[0]


def page(
    object_rows: list[str], lidar_rows: list[str], match_rows: list[str], vote_rows: list[str], face_rows: list[str]
) -> str:
    """All figures as Markdown."""
    lines = [
        "# How many registrations succeed, and how fast",
        "",
        f"Written by `python -m benchmarks registration`, beside small_gicp {version('small_gicp')} and pycpd",
        f"{version('pycpd')}. Times are processor seconds of one thread.",
        "",
        "The objects are those of `tests/data/registration/rigid.npz`. A plane cuts 30 % off the source, and as many",
        "uniform outliers as points are left are added in its bounding box. The target is an independent sample, or",
        "for the bunny the same points. Rotations are random, the first is 0 and the second 180°. It succeeds if",
        "a reported pose is within 0.5° and 0.5 % of the diagonal; for the can up to a rotation about its axis, which",
        "is reported as free. Poses of peers count as they are, also for the can. GICP starts at the centroids,",
        "without rotation; pycpd runs once for each object, with the rotation 0.",
        "",
        "| | success | median s | worst s | small_gicp | pycpd |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
        *object_rows,
        "",
        "Scans of a lidar, thinned to 6,000 points; the given motion is itself uncertain by about 10 mm. Success is",
        "an error within 50 mm.",
        "",
        "| | success | worst mm | median s | worst s | success of small_gicp |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
        *lidar_rows,
        "",
        "Given matches, with noise of 0.5 % of the spread:",
        "",
        "| | success | median ms | worst ms |",
        "| --- | ---: | ---: | ---: |",
        *match_rows,
        "",
        "Votes of 10,000 random tokens with 50 neighbours, with the k-d tree and the spectra:",
        "",
        "| | least time |",
        "| --- | ---: |",
        *vote_rows,
        "",
        "600 points of two faces that deform, in the units of the scan. The index error is the distance between the",
        "partner that was found and the true one.",
        "",
        "| | index error | distance from the true partner | time |",
        "| --- | ---: | ---: | ---: |",
        *face_rows,
    ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("registration", __doc__, PAGE).parse_args(arguments)
    rounds = 1 if options.quick else ROUNDS
    text = page(
        objects(rounds), lidar(1 if options.quick else HEADINGS), of_matches(5 * rounds),
        tensor_voting.times(1 if options.quick else tensor_voting.ROUNDS), tensor_voting.deformations(),
    )  # fmt: skip
    return pages.publish("registration", options.out, text, "5 tables")


if __name__ == "__main__":
    sys.exit(main())
