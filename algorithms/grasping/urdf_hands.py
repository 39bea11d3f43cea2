"""Hands from URDF files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite, finite_number, real_array
from ..geometry.meshes import Integers
from ..kinematics import Robot, urdf
from ..kinematics.collisions.described import capsules_from_urdf
from ..kinematics.errors import DescriptionError
from .hands import Capsules, Fingertips, Hand, hand_of


def hand_from_urdf(
    path: str | Path,
    *,
    tips: Mapping[str, tuple[Sequence[float], float]] | None = None,
    closing: Mapping[str, float] | None = None,
    approach: ArrayLike = (0.0, 0.0, 1.0),
    torsion: float = 0.0,
    breakaway: Sequence[str] = (),
    arguments: Mapping[str, object] = urdf.NO_ARGUMENTS,
) -> Hand:
    """Return the hand of a URDF file, whose base is the palm.

    Fingers are chains of revolute and prismatic joints, some of which may follow others (mimic). The collision elements
    of the file are what must not touch objects; they become capsules by `capsules_from_urdf`, which rounds boxes.

    Parameters
    ----------
    path : str or Path
        The name of a file, or a text of XML, as in `Robot.from_urdf`. `algorithms.grasping.hand_texts` has some.
    tips : mapping, optional
        For the link of each fingertip the centre of a sphere in its frame, and the radius. By default, the fingertips
        are the spheres in the collision elements of links that carry no other link.
    closing : mapping, optional
        How fast each joint changes while the hand closes, between -1 and 1; 0 for joints that are not named. Joints
        that follow others (mimic) cannot be named. By default, each changes in proportion to the mean rate at which it
        moves fingertips to the middle of all, where there is room for an object between them.
    approach : array_like, (3,)
        The direction in which the hand moves to objects, in the frame of the palm.
    torsion : float
        The largest torque about its normal that a fingertip resists for a normal force of 1, in metres. Two fingers
        hold an object only if it is positive.
    breakaway : sequence of str, optional
        Names of joints that follow another one through a clutch, and continue when the parts before them are stopped.
    arguments : mapping of str, optional
        As in `Robot.from_urdf`, for files of xacro.

    Returns
    -------
    Hand
        For `plan_grasps` and `guided_grasp`. Its fingertips are in the order of the file, or of `tips`.

    Raises
    ------
    OSError, TypeError, ValueError
        If the file does not describe a robot, its collision elements are meshes, or a slide has no limits. If there
        are fewer than two fingertips that move, one joint carries two, or no variable changes their distances. If two
        fingers are hard, or an argument is out of its range.
    """
    robot = Robot.from_urdf(path, arguments=arguments)
    parts = capsules_from_urdf(path, robot, arguments=arguments)
    direction = finite(real_array(approach, "approach", (3,), "a direction"), "approach").astype(np.float64)
    size = float(np.linalg.norm(direction))
    if direction.ndim != 1 or not size > 0:
        raise ValueError(
            f"hand_from_urdf: approach: {direction}; expected a direction, three numbers that are not all 0"
        )
    if not finite_number(torsion, "hand_from_urdf: torsion") >= 0:
        raise ValueError(f"hand_from_urdf: torsion: {torsion}; expected a length of at least 0")
    fingertips = _spheres(path, robot, arguments) if tips is None else _given(tips, robot)
    count = len(fingertips.radii)
    if count < 2 or (fingertips.carriers < 0).any():
        raise DescriptionError(
            f"hand_from_urdf: {robot.name}: {count} fingertips at joints {fingertips.carriers.tolist()}; expected at "
            "least two, each of which a joint moves: spheres of links that carry no other link, or `tips`"
        )
    if count == 2 and torsion == 0:
        raise ValueError(
            f"hand_from_urdf: torsion: 0 of {robot.name}; two fingers need a positive length, of soft tips"
        )
    return hand_of(
        robot,
        fingertips,
        Capsules(parts.carriers, parts.ends, parts.radii, np.ones(len(parts.radii), bool)),
        closing=None if closing is None else _rates(closing, robot),
        approach=direction / size,
        torsion=float(torsion),
        breakaway=_followers(breakaway, robot),
    )


def _spheres(path: str | Path, robot: Robot, arguments: Mapping[str, object]) -> Fingertips:
    """Return the spheres of links that carry no other link."""
    root, where = urdf.described(path, arguments)
    parents = {element.get("link") for joint in root.findall("joint") for element in joint.findall("parent")}
    rows = []
    for link in root.findall("link"):
        name = link.get("name", "")
        if name in parents:
            continue
        for element in link.findall("collision"):
            sphere = element.find("geometry/sphere")
            if sphere is not None:
                here = f"{where}: link {name!r}: collision"
                centre = pga3.move_point(urdf.origin_of(element.find("origin"), here), np.zeros(3))
                rows.append((name, centre, float(urdf.numbers(sphere, "radius", None, 1, here)[0])))
    return _placed(rows, robot)


def _given(tips: Mapping[str, tuple[Sequence[float], float]], robot: Robot) -> Fingertips:
    rows = []
    for name, (centre, radius) in tips.items():
        place = finite(real_array(centre, f"tips: {name}", (3,), "a point"), f"tips: {name}").astype(np.float64)
        if not finite_number(radius, f"tips: {name}") > 0:
            raise ValueError(f"hand_from_urdf: tips: {name}: radius {radius}; expected a positive length")
        rows.append((name, place, float(radius)))
    return _placed(rows, robot)


def _placed(rows: Sequence[tuple[str, Reals, float]], robot: Robot) -> Fingertips:
    found = [(*robot.carrier(name), centre, radius) for name, centre, radius in rows]
    names: dict[int, str] = {}
    for (name, _, _), (carrier, *_) in zip(rows, found, strict=True):
        if carrier in names:
            raise DescriptionError(
                f"hand_from_urdf: {robot.name}: fingertips of links {names[carrier]!r} and {name!r} are both carried "
                f"by joint {robot.joint_names[carrier]!r}; expected one for each finger, or `tips`"
            )
        if carrier >= 0:
            names[carrier] = name
    carriers: Integers = np.array([row[0] for row in found], np.intp)
    centres = np.array([pga3.move_point(motor, centre) for _, motor, centre, _ in found]).reshape(-1, 3)
    return Fingertips(carriers, centres, np.array([row[3] for row in found]))


def _rates(closing: Mapping[str, float], robot: Robot) -> Reals:
    """Return the rates of the variables."""
    names = [robot.joint_names[joint] for joint in robot.leaders]
    unknown = set(closing) - set(names)
    if unknown:
        raise DescriptionError(
            f"hand_from_urdf: closing: {sorted(unknown)[0]!r} is no joint with a variable of {robot.name}; expected "
            f"some of {', '.join(names)}"
        )
    rates = np.array([finite_number(closing.get(name, 0.0), f"closing: {name}") for name in names])
    if not np.abs(rates).max() > 0 or np.abs(rates).max() > 1:
        raise ValueError(f"hand_from_urdf: closing: {dict(closing)}; expected rates between -1 and 1, not all 0")
    return rates


def _followers(names: Sequence[str], robot: Robot) -> list[int]:
    """Return the joints with some names, which must follow others."""
    following = [name for joint, name in enumerate(robot.joint_names) if joint not in robot.leaders]
    for name in names:
        if name not in following:
            raise DescriptionError(
                f"hand_from_urdf: breakaway: {name!r} follows no joint of {robot.name}; expected some of "
                f"{', '.join(following) or 'none'}"
            )
    return [robot.joint_names.index(name) for name in names]
