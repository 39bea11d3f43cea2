"""How a hand opens before it closes on an object, and how fast its parts move meanwhile."""

from __future__ import annotations

import numpy as np

from generated import pga3

from ..arguments import Reals
from ..kinematics.denavit_hartenberg import Joint
from ..kinematics.tables import followed, path_to
from .hands import Hand

OPENINGS = 0.25, 0.5, 0.9, 3.0
"""How far the variables of a grasp are changed against the direction of closing, in radians. The last one opens the
hand completely; slides, whose variables are in metres, are opened completely by all."""
APPROACH = 0.08
"""The distance of a straight approach in the direction of the hand, in metres."""


def opened(hand: Hand, joints: Reals, by: float) -> Reals:
    """Return the joints (m,) of a hand that is opened, within its limits."""
    return np.clip(joints - by * hand.closing, *hand.limits.T)


def closing_speeds(hand: Hand) -> Reals:
    """Return bounds of the displacement of each capsule for a change of each variable by 1, (k, m)."""
    variables, ratios, _ = followed(hand.robot)
    shares = np.zeros((len(ratios), len(hand.limits)))
    shares[np.arange(len(ratios)), variables] = np.abs(ratios)
    return joint_speeds(hand) @ shares


def joint_speeds(hand: Hand) -> Reals:
    """Return bounds of the displacement of each capsule for a change of the position of each joint by 1, (k, n)."""
    robot = hand.robot
    variables, ratios, offsets = followed(robot)
    positions = np.abs(ratios) * np.abs(hand.limits[variables]).max(1) + np.abs(offsets)
    found = np.zeros((len(hand.radii), len(ratios)))
    for row, (carrier, ends) in enumerate(zip(hand.parts.carriers, hand.parts.ends, strict=True)):
        points, length = ends, np.zeros(2)
        for joint in reversed(path_to(robot, int(carrier))):
            if robot.kinds[joint] is Joint.PRISMATIC:
                found[row, joint] = 1.0
                # A slide displaces the axes that follow it: their distance grows with its position.
                length = length + positions[joint]
                continue
            # A point of an axis is fixed in both links that it connects.
            feet = pga3.project_point_on_line(points, robot.axes[joint])
            length = length + np.linalg.norm(points - feet, axis=1)
            found[row, joint] = length.max()
            points = feet
    return found
