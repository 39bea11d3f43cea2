"""How a hand closes on an object: each finger until it touches, with joints that break away."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite, real_array
from ..elements import MOTOR, elements
from ..evidence import Status
from ..geometry.meshes import Flags
from ..kinematics import Robot
from ..kinematics.collisions.obstacles import Obstacle
from ..kinematics.tables import followed, path_to
from .closing import joint_speeds
from .hands import Hand

_TOUCH = 1e-7
"""The distance, in metres, at which a part touches the object."""
_STEPS = 10_000
"""Limit on work: most hands close in some hundred steps."""
_GRADIENT = 1e-5
"""The step for differences of distances, in metres: far above their rounding errors, far below a fingertip."""


class ClosingStatus(Status):
    """How a hand closed."""

    OK = 0
    """Every finger that moves touches the object."""
    MISSED = 1
    """Some finger closed completely without touching the object."""
    IN_CONTACT = 2
    """The open hand touches or intersects the object, or is inside it; it does not move."""
    NOT_SOLVED = 3
    """The limit on the number of steps was reached."""


@dataclass(frozen=True, slots=True, eq=False)
class ClosedHand:
    """Result of `close_hand`."""

    status: ClosingStatus
    positions: Reals
    """(n,) The positions of all joints of the robot of the hand, of which some may no longer follow others."""
    touches: Flags
    """(k,) Whether each capsule touches or intersects the object."""
    contacts: Reals
    """(f, 3) Where each fingertip touches the object; NaN for those that do not."""
    normals: Reals
    """(f, 3) The outward unit normals of the object at the contacts."""


@elements(motor=MOTOR)
def close_hand(hand: Hand, motor: ArrayLike, joints: ArrayLike, body: Obstacle) -> ClosedHand:
    """Close a hand until its parts touch an object, which does not move.

    All variables change at the rates `Hand.closing`. If a part touches, all variables that move it stop, with the
    joints that follow them. Joints of `Hand.breakaway` beyond the part continue, as those of fingers with a clutch do,
    until a part that they move touches, or they are at the end of their range.

    Parameters
    ----------
    hand : Hand
    motor : array_like, (8,)
        The pose of the hand. It is normalised.
    joints : array_like, (m,)
        The variables of the open hand, within `Hand.limits`.
    body : Obstacle
        The object: `mesh_obstacle`, for example.

    Returns
    -------
    ClosedHand

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or is not finite, a variable is outside of its limits, or the rotor of the
        motor is 0.

    Notes
    -----
    The hand moves by steps in which no part can reach the object (conservative advancement), until the distance of
    some part is 1e-7 metres.
    """
    q, pose = _posture(hand, joints, motor)
    robot = hand.robot
    variables, ratios, offsets = followed(robot)
    # Each joint is a variable of its own.
    loose = Robot(robot.name, robot.kinds, robot.axes, robot.home, parents=robot.parents)
    position, rates = ratios * q[variables] + offsets, ratios * hand.closing[variables]
    ranges = np.sort(ratios[:, None] * hand.limits[variables] + offsets[:, None], axis=1)
    moves = np.array([_path(robot, carrier) for carrier in hand.parts.carriers])
    speeds = joint_speeds(hand)

    def axes() -> Reals:
        frames = np.concatenate([loose.forward_all(position), np.eye(8)[:1]])[hand.parts.carriers]
        return np.asarray(pga3.move_point(pose, pga3.move_point(frames[:, None], hand.at_home[1])))

    def gaps() -> Reals:
        return body.clearance(axes(), hand.radii)

    # Parts inside the object may be far from its surface. Parts that are outside remain so while they do not touch it.
    left = np.where(body.contains(axes()[:, 0]), -hand.radii, gaps())
    if not (left > _TOUCH).all():
        return _closed(hand, ClosingStatus.IN_CONTACT, position, left, pose, loose, body)
    status = ClosingStatus.NOT_SOLVED
    began = moves[:, rates != 0].any(1)
    for _ in range(_STEPS):
        room = np.where(rates > 0, ranges[:, 1] - position, position - ranges[:, 0])
        rates = _stopped(hand, np.where(room > 0, rates, 0.0), left <= _TOUCH, moves, variables)
        if not rates.any():
            fingers = [began & ~moves[:, ~_path(robot, carrier)].any(1) for carrier in hand.tips.carriers]
            touched = all((left[own] <= _TOUCH).any() for own in fingers if own.any())
            status = ClosingStatus.OK if touched else ClosingStatus.MISSED
            break
        fast = speeds @ np.abs(rates)
        with np.errstate(divide="ignore", invalid="ignore"):
            least = np.where(fast > 0, left / fast, np.inf).min()
            ends = np.where(rates != 0, room / np.abs(rates), np.inf).min()
        position = position + rates * min(max(least, _TOUCH), ends)
        left = gaps()
    return _closed(hand, status, position, left, pose, loose, body)


def _stopped(hand: Hand, rates: Reals, touches: Flags, moves: Flags, variables: Reals) -> Reals:
    """Return the rates of joints after the touches of parts, of which `moves`, (k, n), says which joints move them."""
    for part in np.flatnonzero(touches & moves[:, rates != 0].any(1)):
        stopped = np.isin(variables, variables[moves[part] & (rates != 0)])
        goes_on = np.isin(np.arange(len(rates)), hand.breakaway) & ~moves[part]
        rates = np.where(stopped & ~goes_on, 0.0, rates)
    return rates


def _posture(hand: Hand, joints: ArrayLike, motor: ArrayLike) -> tuple[Reals, Reals]:
    """Return the variables of a hand and its pose, a unit motor, if they are valid."""
    q = finite(real_array(joints, "joints", (len(hand.limits),), "variables of a hand"), "joints")
    pose = finite(real_array(motor, "motor", (8,), "a motor"), "motor").astype(np.float64)
    if q.ndim != 1 or pose.ndim != 1:
        raise ValueError(
            f"close_hand: joints, motor: shapes {q.shape}, {pose.shape}; expected one posture and one pose"
        )
    # In the precision of the variables, in which limits are rounded as well.
    low, high = hand.limits.T.astype(q.dtype)
    beyond = np.flatnonzero((q < low) | (q > high))
    if len(beyond):
        at = beyond[0]
        raise ValueError(
            f"close_hand: joints: {q[at]} at {at} is outside of the limits, {low[at]} to {high[at]}; expected joints "
            "that the hand reaches"
        )
    if not pose[:4].any():
        raise ValueError(f"close_hand: motor: {pose}; expected a motor, whose rotor is not 0")
    return np.clip(q.astype(np.float64), *hand.limits.T), np.asarray(pga3.normalize_motor(pose))


def _path(robot: Robot, joint: int) -> Flags:
    """Return which joints (n,) are between the base and a link."""
    found = np.zeros(len(robot.kinds), bool)
    found[list(path_to(robot, int(joint)))] = True
    return found


def _closed(
    hand: Hand, status: ClosingStatus, position: Reals, left: Reals, pose: Reals, loose: Robot, body: Obstacle
) -> ClosedHand:
    """Return the hand with the contacts of its fingertips."""
    frames = loose.forward_all(position)[hand.tips.carriers]
    centres = pga3.move_point(pose, pga3.move_point(frames, hand.at_home[0]))
    radii = hand.tips.radii

    def distance(points: Reals) -> Reals:
        return body.clearance(np.repeat(points[..., None, :], 2, -2), np.broadcast_to(radii, points.shape[:-1]))

    steps = _GRADIENT * np.eye(3)[:, None]
    normals = np.moveaxis(distance(centres + steps) - distance(centres - steps), 0, -1)
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        normals = normals / sizes
    contacts = centres - radii[:, None] * normals
    apart = distance(centres) > 10 * _TOUCH
    contacts[apart], normals[apart] = np.nan, np.nan
    return ClosedHand(status, position, left <= _TOUCH, contacts, normals)
