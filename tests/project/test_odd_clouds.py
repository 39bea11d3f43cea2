"""Clouds of any unit, origin, type and memory order give the same results; odd ones give statuses or clear errors."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from algorithms import registration, shapes
from generated import pga3
from tests.support.all_cases import all_cases

RNG = np.random.default_rng(5)
BODY = RNG.normal(size=(400, 3))
BODY = BODY / np.linalg.norm(BODY, axis=1, keepdims=True) * [1, 0.8, 0.6]
BODY = BODY * (1 + 0.2 * np.sin(3 * BODY[:, :1] + BODY[:, 1:2])) + 0.002 * RNG.normal(size=BODY.shape)
TURN = pga3.motor_to_matrix(pga3.motor_exponential([0.3, -0.2, 0.1, 0, 0, 0]))[:3, :3]
BALLS = RNG.uniform(-10, 10, (40, 3))
STEPS = np.linspace(0, 2 * np.pi, 200, endpoint=False)
CURVE = np.column_stack([np.cos(STEPS), np.sin(2 * STEPS) / 2, np.sin(STEPS) / 3])
FAR = BODY.copy()
FAR[3], FAR[5, 1] = np.nan, np.inf


def rotation(motor: Any) -> Any:
    return pga3.motor_to_matrix(motor)[:3, :3]


def balls(points: Any, unit: float = 1.0) -> Any:
    return np.column_stack([points, np.full(len(points), 0.1 * unit)])


Place = Callable[[Any], Any]
RESULTS: dict[str, Callable[[Place, float], tuple[Any, ...]]] = {
    "estimate_normals": lambda at, unit: (
        (n := registration.estimate_normals(at(BODY))).status, n.normals[:, :, None] * n.normals[:, None],
    ),
    "tensor_vote": lambda at, unit: ((v := registration.tensor_vote(at(BODY))).status, v.eigenvalues),
    "extract_curves": lambda at, unit: ((c := registration.extract_curves(at(CURVE))).status, len(c.pieces)),
    "extract_surface": lambda at, unit: (
        len(registration.extract_surface(at(BODY), sigma=0.4 * unit, spacing=0.2 * unit).pieces),
    ),
    "extract_junctions": lambda at, unit: (
        len(registration.extract_junctions(at(np.concatenate([CURVE, CURVE[:, ::-1]])), sigma=0.2 * unit).points),
    ),
    "register": lambda at, unit: ((r := registration.register(at(BODY @ TURN), at(BODY))).status, rotation(r.motor)),
    "refine": lambda at, unit: (
        rotation(registration.refine(at(BODY + 0.005), at(BODY), np.eye(8)[0], 0.3 * unit).motor),
    ),
    "register_deformable": lambda at, unit: (
        (d := registration.register_deformable(at(BODY), at(BODY + 0.02 * np.sin(2 * BODY[:, [1, 2, 0]])))).status,
        d.correspondences,
    ),
    "register_matches": lambda at, unit: (
        (m := registration.register_matches(at(BODY @ TURN), at(BODY))).status, rotation(m.motor), m.inliers,
    ),
    "separate_motions": lambda at, unit: tuple(
        m.inliers for m in registration.separate_motions(
            at(np.concatenate([BODY[:200] @ TURN, BODY[200:] @ TURN.T])), at(BODY)
        )
    ),
    "neural_gas": lambda at, unit: ((g := shapes.neural_gas(at(BODY), 30)).status, g.betti),
    "register_spheres": lambda at, unit: (
        (s := shapes.register_spheres(balls(at(BALLS), unit), balls(at(BALLS @ TURN), unit))).status, s.match,
    ),
}  # fmt: skip
CLOUDS: dict[str, Callable[[str], Any]] = {
    "estimate_normals": lambda points: registration.estimate_normals(points),
    "tensor_vote": lambda points: registration.tensor_vote(points),
    "extract_curves": lambda points: registration.extract_curves(points),
    "extract_surface": lambda points: registration.extract_surface(points, sigma=0.5),
    "extract_junctions": lambda points: registration.extract_junctions(points, sigma=0.3),
    "register": lambda points: registration.register(points, points),
    "register_deformable": lambda points: registration.register_deformable(points, points),
    "register_matches": lambda points: registration.register_matches(points, points),
    "separate_motions": lambda points: registration.separate_motions(points, points),
    "neural_gas": lambda points: shapes.neural_gas(points, 20),
}  # fmt: skip
ODD = {
    "empty": np.zeros((0, 3)),
    "one": np.ones((1, 3)),
    "two": np.eye(3)[:2],
    "line": np.outer(np.linspace(0, 1, 60), [1, 2, 3.0]),
    "plane": np.random.default_rng(1).random((80, 3)) * [1, 1, 0],
    "copies": np.ones((50, 3)),
    "two places": np.repeat(np.eye(3)[:2], 40, 0),
    "not finite": FAR[:120],
    "all NaN": np.full((30, 3), np.nan),
}
WRONG = {
    "one axis": (np.ones(3), ValueError, "shape"),
    "four columns": (np.ones((20, 4)), ValueError, "shape"),
    "texts": (np.array([["a", "b", "c"]]), TypeError, "dtype"),
    "complex": (BODY + 1j, TypeError, "dtype"),
    "huge": (BODY * 1e200, ValueError, "coordinates"),
}


def frozen(points: Any) -> Any:
    points = points.copy()
    points.flags.writeable = False
    return points


@all_cases("name", RESULTS)
def test_results_depend_neither_on_unit_origin_nor_memory(name: str) -> None:
    expected = RESULTS[name](lambda p: p, 1.0)
    same = [frozen, np.asfortranarray, lambda p: np.repeat(p, 2, 0)[::2], lambda p: p.tolist()]
    for at in same:
        for a, b in zip(expected, RESULTS[name](at, 1.0), strict=True):
            np.testing.assert_array_equal(a, b)
    for unit, origin, rounding in ((1e-6, 0.0, 1e-6), (1e6, 0.0, 1e-6), (1.0, 1e6, 1e-4)):
        moved = RESULTS[name](lambda p: unit * p + origin, unit)  # noqa: B023
        for a, b in zip(expected, moved, strict=True):
            np.testing.assert_allclose(a, b, atol=rounding * np.max(np.abs(a), initial=1e-300))


@all_cases("name", CLOUDS)
def test_odd_clouds_raise_neither_errors_nor_warnings(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for points in ODD.values():
            CLOUDS[name](points)


@all_cases("name", CLOUDS)
def test_errors_name_the_argument(name: str) -> None:
    for points, error, message in WRONG.values():
        with pytest.raises(error, match=rf"^(points|source): .*{message}|^(points|source): {message}"):
            CLOUDS[name](points)


def test_points_on_a_line_have_no_normals() -> None:
    for points in (ODD["line"], ODD["line"] + 1e3, ODD["line"].astype(np.float32)):
        found = registration.estimate_normals(points)
        assert (found.status == registration.VoteStatus.UNDETERMINED).all() and not found.normals.any()


@pytest.mark.parametrize("seed", range(6))
def test_random_tokens_of_the_plane_are_no_curves(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    points = [rng.random((150, 2)), rng.normal(size=(300, 2))][seed % 2]
    assert len(registration.extract_curves(points).pieces) == 0
