"""Times of tensor votes, and correspondences of deformed faces beside pycpd."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from algorithms.registration import register_deformable, tensor_vote

from .libraries import installed

FACES = Path("tests/data/faces/faces-600.txt.gz")
TOKENS, NEIGHBOURS = 10_000, 50
BETAS = (2, 30)
ROUNDS = 7
Array = np.ndarray[Any, Any]


def least_time(call: Callable[[], object], rounds: int) -> float:
    """Return the least CPU time of some calls, in seconds."""
    spent = []
    for _ in range(rounds):
        start = time.process_time()
        call()
        spent.append(time.process_time() - start)
    return min(spent)


def times(rounds: int = ROUNDS) -> list[str]:
    """Return table rows: milliseconds of votes of 1e4 random tokens with 50 neighbours, with the tree and spectra."""
    rng = np.random.default_rng(0)
    points, normals = rng.uniform(size=(TOKENS, 3)), rng.normal(size=(TOKENS, 3))
    # Tokens at the boundary have fewer neighbours, so that the radius is that of somewhat more of them.
    sigma = (1.12 * NEIGHBOURS / TOKENS / (4 / 3 * np.pi)) ** (1 / 3) / 3
    calls: dict[str, Callable[[], object]] = {
        "ball votes": lambda: tensor_vote(points, sigma=sigma, passes=1),
        "stick votes": lambda: tensor_vote(points, normals=normals, sigma=sigma),
        "ball votes, then stick and plate votes": lambda: tensor_vote(points, sigma=sigma, passes=2),
        "three passes, the default": lambda: tensor_vote(points, sigma=sigma),
    }
    return [f"| {name} | {1e3 * least_time(call, rounds):.0f} ms |" for name, call in calls.items()]


def deformations() -> list[str]:
    """Return table rows: index error, distance from the true partner, and CPU time, for 600 points of two faces."""
    table = np.loadtxt(FACES)
    source, target = table[:, :3], table[:, 3:]
    calls: dict[str, Callable[[], Array]] = {
        "`register_deformable`": lambda: register_deformable(source, target).points
    }
    if installed("pycpd"):
        peer = importlib.import_module("pycpd").DeformableRegistration

        def by_peer(beta: int) -> Array:
            return np.asarray(peer(X=target, Y=source, alpha=2, beta=beta).register()[0])

        for beta in BETAS:
            calls[f"pycpd, beta = {beta}"] = partial(by_peer, beta)
    rows = []
    for name, call in calls.items():
        spent = least_time(call, 1)
        moved = call()
        partner = target[cKDTree(target).query(moved)[1]]
        index, away = (np.linalg.norm(x - target, axis=1).mean() for x in (partner, moved))
        rows.append(f"| {name} | {index:.3f} | {away:.2f} | {spent:.2f} s |")
    return rows
