"""Denavit-Hartenberg tables of arms, and their poses by products of matrices."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np

Rows = list[dict[str, Any]]
QUARTER = pi / 2

JACO: Rows = [
    {"d": 0.2755, "alpha": QUARTER},
    {"a": 0.41, "alpha": pi},
    {"d": -0.0098, "alpha": QUARTER},
    {"d": -0.2501, "alpha": 1.0472},
    {"d": -0.0856, "alpha": 1.0472},
    {"d": -0.2029, "alpha": pi},
]
"""Kinova's arm with a wrist of 60 degrees (data sheet, classic parameters, rounded)."""
OFFSET_WRIST: Rows = [
    {"d": 0.3, "alpha": QUARTER},
    {"a": 0.4},
    {"a": 0.05, "alpha": QUARTER},
    {"d": 0.4, "alpha": -QUARTER},
    {"a": 0.08, "alpha": QUARTER},
    {"d": 0.1},
]
CRX10: Rows = [
    {"alpha": -QUARTER},
    {"a": 0.54, "alpha": pi},
    {"alpha": -QUARTER},
    {"d": -0.54, "alpha": QUARTER},
    {"d": 0.15, "alpha": -QUARTER},
    {"d": -0.16},
]
"""Fanuc's arm CRX-10iA (lengths of the data sheet)."""

ALMOST_SPHERICAL_WRIST: Rows = [
    {"d": 0.3, "alpha": QUARTER},
    {"a": 0.4, "alpha": 1e-5},
    {"a": 0.05, "alpha": -QUARTER},
    {"d": 0.43, "alpha": QUARTER},
    {"a": 1e-5, "alpha": -QUARTER},
    {"d": 0.1},
]
"""An arm that no closed form applies to, by rounded numbers as those of some URDF files."""


def random_arm(seed: int, *slides: int) -> Rows:
    """Return a table without structure, with the given joints prismatic."""
    rng = np.random.default_rng(seed)
    numbers = rng.uniform((-0.5, -0.5, -pi, -1), (0.5, 0.5, pi, 1), (6, 4))
    rows: Rows = [dict(zip(("d", "a", "alpha", "theta"), map(float, row), strict=True)) for row in numbers]
    for slide in slides:
        rows[slide]["kind"] = "prismatic"
    return rows


def pose_by_matrices(rows: Rows, q: np.ndarray) -> np.ndarray:
    """Return the poses (..., 4, 4) of configurations by products of matrices."""
    pose = np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4))
    for j, row in enumerate(rows):
        slides = row.get("kind") == "prismatic"
        d = row.get("d", 0.0) + (q[..., j] if slides else 0 * q[..., j])
        theta = row.get("theta", 0.0) + (0 * q[..., j] if slides else q[..., j])
        c, s, o = np.cos(theta), np.sin(theta), 0 * d
        about_z = np.stack([c, -s, o, o, s, c, o, o, o, o, o + 1, d, o, o, o, o + 1], -1).reshape(*c.shape, 4, 4)
        ca, sa = np.cos(row.get("alpha", 0.0)), np.sin(row.get("alpha", 0.0))
        about_x = np.array([[1, 0, 0, row.get("a", 0.0)], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]])
        pose = pose @ about_z @ about_x
    return pose
