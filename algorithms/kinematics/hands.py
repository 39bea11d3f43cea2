"""The Barrett hand: three fingers, four variables. The last joint of each finger follows the preceding one."""

from __future__ import annotations

from math import radians

import numpy as np

from generated import pga3

from .denavit_hartenberg import Joint
from .robot import Robot

SPREAD_OFFSET, PROXIMAL, LINK = 0.025, 0.050, 0.070
"""Distances from the palm's centre to the spread axes, from there to the first finger joint, and from that to the next
joint, in metres (OpenRAVE, ``barretthand.kinbody.xml``)."""
COUPLING, BENT = 1 / 3, radians(50)
"""The last joint rotates by a third of the preceding one, and is bent by 50 degrees when the finger is open."""
TIP = 0.050
"""Distance from the last joint to the fingertip, m, as in papers of the book's author."""
OPEN, CLOSED, SPREAD = 0.0, radians(140), radians(180)
"""Angles of the joints of a Barrett hand: open and closed fingers, and the largest spread."""


def barrett_hand() -> Robot:
    """Return the hand as a tree; the variables are the spread of fingers 1 and 2 and the bend of each finger, in rad.

    The palm is the plane z = 0. Fingers bent by 90 degrees extend along z. Fingers one and two are located at
    (0, ∓0.025, 0) and rotate about z by the spread in opposite directions. Finger three is fixed at (-0.050, 0, 0),
    opposite to them.

    Returns
    -------
    Robot
        n = 4. The poses of the links ``tip 1``, ``tip 2``, ``tip 3`` are given by `Robot.link`. Order of the joints:
        spread 1, bend 1, last 1, spread 2, bend 2, last 2, bend 3, last 3.
    """
    axes, home, parents, names = [], [], [], []
    links = {}
    coupling = []
    z, y = np.array([0.0, 0, 1]), np.array([0.0, 1, 0])
    variables = np.eye(5)

    def add(direction: np.ndarray, point: np.ndarray, parent: int, name: str, row: np.ndarray) -> int:
        axes.append(pga3.line_from_direction_moment(direction, np.cross(point, direction)))
        home.append(_moved_to(point))
        parents.append(parent)
        names.append(name)
        coupling.append(row)
        return len(axes) - 1

    for finger, (sign, y0) in enumerate(((-1.0, -SPREAD_OFFSET), (1.0, SPREAD_OFFSET), (0.0, 0.0)), 1):
        carrier = -1
        # fingers one and two extend along x, the third along -x
        out = -1.0 if finger == 3 else 1.0
        root = np.array([0.0, y0, 0.0])
        if finger < 3:
            carrier = add(z, root, -1, f"spread {finger}", sign * variables[0])
        knuckle = root + np.array([out * PROXIMAL, 0, 0])
        carrier = add(-out * y, knuckle, carrier, f"bend {finger}", variables[finger])
        last = knuckle + np.array([out * LINK, 0, 0])
        bent = COUPLING * variables[finger] + BENT * variables[4]
        carrier = add(-out * y, last, carrier, f"last {finger}", bent)
        links[f"tip {finger}"] = carrier, _moved_to(last + np.array([out * TIP, 0, 0]))
    return Robot(
        "barrett",
        (Joint.REVOLUTE,) * len(axes),
        np.array(axes),
        np.array(home),
        parents=tuple(parents),
        joint_names=tuple(names),
        coupling=np.array(coupling),
        limits=np.array([[0, SPREAD, np.inf, np.inf], *[[OPEN, CLOSED, np.inf, np.inf]] * 3]),
        links=links,
    )


def _moved_to(point: np.ndarray) -> np.ndarray:
    no_turn = np.array([1.0, 0, 0, 0])
    return pga3.motor_from_rotor_translation(no_turn, point)
