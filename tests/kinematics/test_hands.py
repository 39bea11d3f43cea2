"""The Barrett hand against products of the 4 x 4 matrices of its table."""

from __future__ import annotations

from math import cos, pi, radians, sin

import numpy as np
import pytest

from algorithms.kinematics import Robot
from algorithms.kinematics.hands import barrett_hand
from generated import pga3


def turned_z(angle: float) -> np.ndarray:
    return np.array([[cos(angle), -sin(angle), 0, 0], [sin(angle), cos(angle), 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def lifted(angle: float) -> np.ndarray:
    """A rotation from x towards z."""
    return np.array([[cos(angle), 0, -sin(angle), 0], [0, 1, 0, 0], [sin(angle), 0, cos(angle), 0], [0, 0, 0, 1.0]])


def shifted(x: float, y: float = 0.0) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:2, 3] = x, y
    return matrix


def tip(spread: float, bend: float, finger: int) -> np.ndarray:
    """The table of OpenRAVE, row by row; the third finger has no spread and is rotated by half a turn."""
    foot = {1: shifted(0, -0.025) @ turned_z(-spread), 2: shifted(0, 0.025) @ turned_z(spread), 3: turned_z(pi)}[finger]
    finger_alone = shifted(0.05) @ lifted(bend) @ shifted(0.07) @ lifted(bend / 3 + radians(50)) @ shifted(0.05)
    return (foot @ finger_alone)[:3, 3]


def test_fingertips() -> None:
    hand = barrett_hand()
    assert hand.n_joints == 4 and len(hand.joint_names) == 8
    low, high = hand.limits[:, 0], hand.limits[:, 1]
    for q in np.random.default_rng(0).uniform(low, high, (50, 4)):
        for finger in (1, 2, 3):
            found = pga3.motor_to_matrix(hand.link(f"tip {finger}", q))[:3, 3]
            assert np.abs(found - tip(q[0], q[finger], finger)).max() < 1e-15


def test_fingers_meet_when_they_close() -> None:
    """Without spread all tips are in planes y = const, and fingers one and three approach each other."""
    hand = barrett_hand()
    tips = [pga3.motor_to_matrix(hand.link(f"tip {k}", [0, 0.9, 0.9, 0.9]))[:3, 3] for k in (1, 2, 3)]
    assert tips[0][1] == pytest.approx(-0.025) and tips[1][1] == pytest.approx(0.025) and tips[2][1] == pytest.approx(0)
    assert tips[0][[0, 2]] == pytest.approx(tips[2][[0, 2]] * [-1, 1])
    turned = pga3.motor_to_matrix(hand.link("tip 1", [pi, 0.9, 0.9, 0.9]))[:3, 3]
    assert turned[0] == pytest.approx(-tips[0][0])


def test_the_last_joint_is_coupled() -> None:
    """The Jacobian of a tip with respect to the bend, by differences: both joints of the finger contribute."""
    hand = barrett_hand()
    assert isinstance(hand, Robot)
    q, h = np.array([0.4, 0.7, 0.3, 1.1]), 1e-6
    by_bend = hand.jacobian(q)[3:, 3]  # the end effector is the link after the last joint
    ahead, behind = (hand.pose(q + s * h * np.eye(4)[3])[:3, 3] for s in (1, -1))
    assert np.abs(by_bend - (ahead - behind) / (2 * h)).max() < 1e-9
    assert np.abs(hand.jacobian(q)[:, :3]).max() == 0
