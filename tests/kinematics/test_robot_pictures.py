"""Pictures of robots show where their frames are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from algorithms.kinematics import Robot
from algorithms.kinematics.hands import barrett_hand
from algorithms.kinematics.pictures import animate, draw, skeleton, workspace
from generated import pga3

Q = np.array([0.3, -0.8, 1.1, 0.4, 0.9, 0.2])


def test_a_skeleton_goes_from_the_base_to_the_end_effector() -> None:
    arm = Robot.named("ur5")
    lines = skeleton(arm, Q)
    assert lines.shape == (7, 2, 3) and np.array_equal(lines[0, 0], np.zeros(3))
    assert np.array_equal(lines[1:, 0], lines[:-1, 1])
    assert np.abs(lines[-1, 1] - arm.pose(Q)[:3, 3]).max() < 1e-15
    lengths = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)
    assert lengths == pytest.approx((0.089459, 0.425, 0.39225, 0.10915, 0.09465, 0.0823, 0), abs=1e-12)
    hand = skeleton(barrett_hand(), np.zeros(4))
    assert np.abs(hand[:8, 0] - hand[:8, 1]).max() > 0.06  # fingers are attached to the palm
    assert np.array_equal(hand[0, 0], np.zeros(3)) and np.array_equal(hand[3, 0], np.zeros(3))


def test_the_drawing_has_these_lines(tmp_path: Path) -> None:
    arm = Robot.named("ur5")
    cloud = workspace(arm, 500)
    figure = draw(arm, Q, cloud)
    drawn = np.array([np.transpose(line.get_data_3d()) for line in figure.axes[0].lines])
    assert np.array_equal(drawn, skeleton(arm, Q))
    figure.savefig(tmp_path / "arm.png")
    with Image.open(tmp_path / "arm.png") as image:
        assert len(set(image.convert("L").resize((100, 100)).tobytes())) > 10


def test_a_workspace_is_within_reach_and_limits() -> None:
    cloud = workspace(Robot.named("ur5"), 2000)
    reach = np.linalg.norm(cloud - [0, 0, 0.089459], axis=1)
    assert 0.85 < reach.max() < 0.425 + 0.39225 + 0.10915 + 0.09465 + 0.0823
    hand = barrett_hand()
    tips = workspace(hand, 300)
    assert np.abs(tips[:, 1]).max() < 1e-15  # the link after the last joint, that of the finger without spread
    slide = pga3.line_from_direction_moment([[1.0, 0, 0]], [[0.0, 0, 0]])
    assert np.abs(workspace(Robot.from_screws(slide, np.eye(8)[0], ["prismatic"]), 200)).max() <= 1


def test_a_motion_as_a_file(tmp_path: Path) -> None:
    arm = Robot.named("ur5")
    path = animate(arm, Q + np.linspace(0, 1, 3)[:, None], tmp_path / "motion.gif", 10)
    with Image.open(path) as image:
        assert image.n_frames == 3  # type: ignore[attr-defined]
    page = animate(arm, Q + np.linspace(0, 1, 2)[:, None], tmp_path / "motion.html").read_text()
    assert page.count("data:image/png;base64") == 2
    with pytest.raises(ValueError, match="configurations"):
        animate(arm, Q[:5], tmp_path / "other.gif")
