"""Force closure by linear programming, and distances from capsules, without the code under test."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog


def is_closed_by_forces(
    contacts: np.ndarray, normals: np.ndarray, torsion: float = 0.0, friction: float = 0.5, edges: int = 8
) -> bool:
    """Determine whether forces within friction cones, and torques of soft fingers, balance any load.

    This is so if zero is a combination with positive factors of wrenches that span all dimensions.
    """
    rows: list[np.ndarray] = []
    centre, length = contacts.mean(0), np.ptp(contacts, axis=0).max()
    for p, n in zip((contacts - centre) / length, normals, strict=True):
        u = np.linalg.svd(n[None])[2][1:]
        angles = 2 * np.pi * np.arange(edges) / edges
        force = -n + friction * (np.cos(angles)[:, None] * u[0] + np.sin(angles)[:, None] * u[1])
        rows.append(np.hstack([force, np.cross(p, force)]))
        if torsion:
            rows += [np.hstack([-n, np.cross(p, -n) + sign * torsion / length * n])[None] for sign in (1, -1)]
    wrenches = np.concatenate(rows)
    if np.linalg.matrix_rank(wrenches, 1e-6) < 6:
        return False
    count = len(wrenches)
    # The largest t for which all factors are at least t, their sum is 1, and the wrenches add up to 0.
    found = linprog(
        np.r_[np.zeros(count), -1.0],
        A_ub=np.hstack([-np.eye(count), np.ones((count, 1))]),
        b_ub=np.zeros(count),
        A_eq=np.vstack([np.hstack([wrenches.T, np.zeros((6, 1))]), np.r_[np.ones(count), 0.0]]),
        b_eq=np.r_[np.zeros(6), 1.0],
        bounds=[(None, None)] * (count + 1),
    )
    return bool(found.success and -found.fun > 1e-9)


def distances_to_segment(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the distances (n,) of points (n, 3) from a segment."""
    along = end - start
    share = np.clip((points - start) @ along / max(along @ along, 1e-30), 0, 1)
    return np.asarray(np.linalg.norm(points - start - share[:, None] * along, axis=1))
