"""Points in single precision that determine nothing: their rounding errors are no information."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.geometry import fit_circle, fit_cone, fit_cylinder, fit_plane, fit_sphere
from algorithms.motors import rotor_from_frames, rotor_from_vectors
from algorithms.vision import DegenerateError, VisionStatus, conic_through_points, fundamental_matrix, homography
from tests.support.all_cases import all_cases

STEPS = np.linspace(0, 1, 20)[:, None]
LINE = STEPS * [1, 2, 0.7] + [1 / 3, 1, 5]
ANGLES = np.linspace(0, 5, 20)
CIRCLE = np.c_[2 * np.cos(ANGLES), 1.2 * np.sin(ANGLES), 1.6 * np.sin(ANGLES)] + [0.1, 0.7, 1 / 3]
TURN = Rotation.from_rotvec([1, 0.5, 0.2]).as_matrix()
SLIGHT = Rotation.from_rotvec([0.1, 0.2, -0.1]).as_matrix()
FRAME = np.array([[1, 0.3, 0.7], [0.2, 1, 0.4], [1.2, 1.3, 1.1]])
"""Three vectors of a plane."""


def single(x: Any) -> Any:
    return np.asarray(x, np.float32)


@all_cases(
    "fit, points",
    [
        (fit_plane, LINE), (fit_circle, LINE), (fit_sphere, LINE), (fit_cylinder, LINE), (fit_cone, LINE),
        (fit_sphere, CIRCLE), (fit_cylinder, CIRCLE), (fit_cone, CIRCLE),
    ],
)  # fmt: skip
@pytest.mark.parametrize("turn", range(3))
def test_points_of_lower_dimension(fit: Callable[[Any], Any], points: Any, turn: int) -> None:
    turned = points @ Rotation.random(random_state=turn).as_matrix().T
    for given in (turned, single(turned)):
        assert not fit(given).determined
    bent = turned + 0.1 * np.random.default_rng(turn).normal(size=points.shape)
    assert fit(single(bent)).determined


def test_vectors_of_one_direction_and_of_a_plane() -> None:
    along = STEPS * [1, 0.3, 0.7]
    assert not rotor_from_vectors(single(along), single(along @ TURN.T)).determined
    assert rotor_from_vectors(single(FRAME), single(FRAME @ TURN.T)).determined
    assert np.isnan(rotor_from_frames(single(FRAME), single(FRAME @ TURN.T))).all()
    assert np.isfinite(rotor_from_frames(single(np.eye(3)), single(TURN.T))).all()


def test_pixels_of_planes_and_of_lines() -> None:
    rng = np.random.default_rng(1)
    for n in (8, 12, 20):
        places = rng.normal([0, 0, 6], size=(n, 3))
        flat = np.c_[places[:, :2], 5 + places[:, :2] @ [0.3, -0.1]]
        for X, is_plane in ((flat, True), (places, False)):
            pixels = [
                single(500 * (h := X @ turn.T + shift)[:, :2] / h[:, 2:] + 320)
                for turn, shift in ((np.eye(3), np.zeros(3)), (SLIGHT, np.array([0.5, 0.1, 0.2])))
            ]
            if is_plane:
                with pytest.raises(DegenerateError):
                    fundamental_matrix(*pixels)
                assert np.isfinite(homography(*pixels)).all()
            else:
                assert np.isfinite(fundamental_matrix(*pixels)).all()
    for k in ([0, 0, 1, 2], range(4)):
        one, two = rng.uniform(0, 600, (2, 4, 2)) if k == [0, 0, 1, 2] else (500 * LINE[:, :2], 300 * LINE[:, 1:])
        with pytest.raises(DegenerateError):
            homography(single(one)[list(k)], single(two)[list(k)])


def test_conics() -> None:
    four = np.r_[STEPS[:4] * [1, 0.3] + [0, 0.7], [[0.3, 2.1]]]
    assert conic_through_points(single(four)).status == VisionStatus.DEGENERATE
    assert conic_through_points(single(np.random.default_rng(0).normal(size=(5, 2)))).status == VisionStatus.OK
