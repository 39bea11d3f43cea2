"""Kinematic tables of the Barrett hand: both public models."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import cos, radians, sin

import numpy as np

from generated import pga3

from ..arguments import Reals
from ..kinematics import Robot
from ..kinematics.denavit_hartenberg import Joint
from .hands import Capsules, Fingertips, Hand, hand_of

_FINGERS = (-1, -1.0, 1.0), (1, 1.0, 1.0), (0, 0.0, -1.0)
"""For each finger, the side of its spread axis, the sense of the spread, and the direction at rest along x."""
_FIXED = 2
"""The finger that does not spread: its root is a part of the palm."""
_PARTS = "knuckle", "link", "tip"


@dataclass(frozen=True, slots=True)
class Cover:
    """A capsule that covers a part of a hand, in its rest position.

    The coordinates x and z are those of a finger that extends along x from its spread axis, at the height of the first
    joints; those of the palm are x, y and z of the hand, above the first joints.
    """

    part: str
    """"palm", "knuckle" (fingers 1 and 2), "link" or "tip"."""
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float
    is_first: bool = True
    """Whether it is among the capsules with which most collisions are found, which are tested first."""


@dataclass(frozen=True, slots=True)
class HandTable:
    """The kinematic table of a Barrett hand, in metres and radians.

    The palm is the plane z = 0, and fingers bent by a right angle extend along z. Fingers 1 and 2 rotate by the spread
    about axes parallel to z; finger 3 is fixed opposite to them.

    Attributes
    ----------
    name : str
    spread_offset : float
        Distance of the spread axes from the centre of the palm, along y.
    root : float
        Distance from there to the first joint of a finger.
    link : float
        Length of the first link.
    shift : float
        Displacement of the last joint from the first link, towards the inner side of the finger.
    coupling : float
        Rotation of the last joint for a rotation of the first one by 1.
    tip, tip_angle : float
        Distance from the last joint to the centre of the fingertip, and the angle of this direction to the first link
        when the finger is open.
    radius, link_radius, palm_radius : float
        Radii of the fingertip, of the links, and of the palm.
    height : float
        Height of the first joints above the palm.
    spread_limit, bend_limit : float
        The largest values of the joints; the smallest are 0.
    covers : tuple of Cover
        Capsules of the real shape. Without them, links are capsules between the joints with the radii above, and the
        palm is two spheres.
    """

    name: str
    spread_offset: float
    root: float
    link: float
    shift: float
    coupling: float
    tip: float
    tip_angle: float
    radius: float
    link_radius: float
    palm_radius: float
    height: float
    spread_limit: float
    bend_limit: float
    covers: tuple[Cover, ...] = ()


BARRETT_OPENRAVE = HandTable(
    "barrett, OpenRAVE", 0.025, 0.050, 0.070, 0.0, 1 / 3, 0.050, radians(50), 0.0095, 0.011, 0.045, 0.0, radians(180),
    radians(140),
)  # fmt: skip
"""The model of `algorithms.kinematics.hands`: the last link is bent by 50 degrees when the finger is open."""

_ROWS = (
    *((y, -0.057, 0.034) for y in (-0.0105, 0.0, 0.0105)),
    *((y, -0.0185, 0.0185) for y in (-0.0315, -0.021, 0.021, 0.0315)),
    *((y, -0.0172, 0.0171) for y in (-0.039, 0.039)),
)
_BH280_COVERS = (
    *(
        Cover("palm", (low, y, -0.0042), (high, y, -0.0042), 0.0085, y in (-0.021, 0.0, 0.021))
        for y, low, high in _ROWS
    ),
    Cover("palm", (0.0, 0.0, -0.0572), (0.0, 0.0, -0.0572), 0.0485, False),
    Cover("palm", (-0.05, 0.0, -0.026), (0.03, 0.0, -0.026), 0.0165, False),
    Cover("palm", (-0.05, 0.0, -0.016), (0.031, 0.0, -0.016), 0.0165, False),
    Cover("palm", (-0.05, -0.003, -0.0005), (-0.05, 0.003, -0.0005), 0.0162),
    Cover("palm", (-0.05, -0.003, -0.016), (-0.05, 0.003, -0.016), 0.0172, False),
    Cover("knuckle", (0.0009, 0.0, -0.0199), (0.0562, 0.0, -0.0192), 0.0181, False),
    Cover("knuckle", (0.0051, 0.0, -0.029), (0.0526, 0.0, 0.0021), 0.0176),
    Cover("link", (0.05, 0.0, 0.0005), (0.1175, 0.0, 0.005), 0.014),
    Cover("tip", (0.119936, 0.0, 0.003), (0.158164, 0.0, 0.033818), 0.0095, False),
    Cover("tip", (0.119636, 0.0, 0.0035), (0.157936, 0.0, 0.0289), 0.0135),
)

BARRETT_BH280 = HandTable(
    "barrett, BH8-280", 0.025, 0.050, 0.069936, 0.003, 0.84 / 2.44, 0.0491, 0.6786, 0.0095, 0.011, 0.045, 0.0,
    3.1416, 2.44, _BH280_COVERS,
)  # fmt: skip
"""The model of the published URDF of the BH8-280. Its z = 0 is the plane of the first joints of the fingers, 0.0754 m
above the base. The fingertip is the sphere that touches the end of the tip's mesh, whose centre is at
(-0.0382, 0.0308) m from the last joint. Its capsules contain the meshes of the palm, of the knuckles and of all links,
except for parts that are less than 3 mm outside."""


def hand_of_table(table: HandTable = BARRETT_BH280) -> Hand:
    """Return the hand of a kinematic table.

    Parameters
    ----------
    table : HandTable

    Returns
    -------
    Hand
        Its variables are the spread and the bends of the fingers. Closing changes the bends.

    Raises
    ------
    TypeError, ValueError
        If `table` is not a `HandTable`, or a number is not finite or a length or a limit is negative.
    """
    if not isinstance(table, HandTable):
        raise TypeError(
            f"hand_of_table: table: {type(table).__name__}; expected a HandTable; hand_from_urdf reads other hands"
        )
    numbers = [getattr(table, name) for name in HandTable.__slots__ if name not in ("name", "covers")]
    if not (np.isfinite(numbers).all() and min(numbers) >= 0 and table.link > 0 and table.radius > 0):
        raise ValueError(f"hand_of_table: {table}; expected finite numbers, none of them negative")
    return _hand(table)


@cache
def _hand(table: HandTable) -> Hand:
    """Return the hand of a valid table; its arrays are read-only."""
    axes: list[Reals] = []
    parents, coupling, tips, carriers, names = [], [], [], [], []
    y, z, variables = np.array([0.0, 1, 0]), np.array([0.0, 0, 1]), np.eye(5)[:4]
    joint_of = {}
    for number, (side, sense, out) in enumerate(_FINGERS):
        spread = np.array([0.0, side * table.spread_offset, table.height])
        root = spread + np.array([out * table.root, 0, 0])
        last = root + np.array([out * table.link, 0, table.shift])
        joint_of[number, "knuckle"] = parent = -1
        rows = [("link", -out * y, root, variables[number + 1]),
                ("tip", -out * y, last, table.coupling * variables[number + 1])]  # fmt: skip
        if number != _FIXED:
            rows.insert(0, ("knuckle", z, spread, sense * variables[0]))
        for part, direction, point, row in rows:
            parents.append(parent)
            joint_of[number, part] = parent = len(axes)
            axes.append(pga3.line_from_direction_moment(direction, np.cross(point, direction)))
            coupling.append(row)
            names.append(f"{part} {number + 1}")
        tips.append(last + table.tip * np.array([out * cos(table.tip_angle), 0, sin(table.tip_angle)]))
        carriers.append(parent)
    limits = np.full((4, 4), np.inf)
    limits[:, :2] = [[0, table.spread_limit], *[[0, table.bend_limit]] * 3]
    robot = Robot(
        table.name,
        (Joint.REVOLUTE,) * len(axes),
        np.array(axes),
        np.tile(np.eye(8)[0], (len(axes), 1)),
        parents=tuple(parents),
        joint_names=tuple(names),
        coupling=np.array(coupling),
        limits=limits,
    )
    ends, owners, radii, first = [], [], [], []
    covers = table.covers or _simple_covers(table)
    for number, (side, _, out) in enumerate(_FINGERS):
        centre = np.array([0.0, side * table.spread_offset, table.height])
        for cover in covers:
            # With covers of the real shape, the knuckle of the third finger is among those of the palm.
            if cover.part == "palm" or (cover.part == "knuckle" and table.covers and number == _FIXED):
                continue
            ends.append([centre + np.array(p) * [out, out, 1] for p in (cover.start, cover.end)])
            owners.append(joint_of[number, cover.part])
            radii.append(cover.radius)
            first.append(cover.is_first)
    for cover in covers:
        if cover.part == "palm":
            ends.append([np.array(p) + np.array([0, 0, table.height]) for p in (cover.start, cover.end)])
            owners.append(-1)
            radii.append(cover.radius)
            first.append(cover.is_first)
    return hand_of(
        robot,
        Fingertips(np.array(carriers), np.array(tips), np.full(3, table.radius)),
        Capsules(np.array(owners), np.array(ends), np.array(radii), np.array(first)),
        closing=np.array([0.0, 1, 1, 1]),
        breakaway=carriers,
    )


def _simple_covers(table: HandTable) -> tuple[Cover, ...]:
    """Return capsules between the joints of a finger, and two spheres below the plane of the joints."""
    root, last = (table.root, 0.0, 0.0), (table.root + table.link, 0.0, table.shift)
    tip = last[0] + table.tip * cos(table.tip_angle), 0.0, last[2] + table.tip * sin(table.tip_angle)
    centres = [(x * table.root, 0.0, -table.palm_radius) for x in (-0.5, 0.5)]
    return (
        Cover("knuckle", (0.0, 0.0, 0.0), root, table.link_radius),
        Cover("link", root, last, table.link_radius),
        Cover("tip", last, tip, table.radius),
        *(Cover("palm", centre, centre, table.palm_radius) for centre in centres),
    )
