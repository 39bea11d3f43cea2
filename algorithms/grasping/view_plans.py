"""Grasps of an object that one depth camera sees from one side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import as_given, finite_number, real_array
from ..kinematics.collisions.obstacles import Obstacle
from ..vision.camera import Camera
from .barrett import HandTable
from .hand_poses import Others
from .hands import Hand
from .planning import Grasp, GraspPlan, Wanted, any_hand, failed, planned
from .quality import grasp_quality
from .seen_sides import SeenSide, seen_sides
from .status import GraspStatus
from .triples import LEAST_QUALITY

_UNSEEN = (GraspStatus.TOO_THIN, GraspStatus.TOO_LARGE, GraspStatus.NO_CONTACTS, GraspStatus.NO_FORCE_CLOSURE)
"""What cannot be known from one side: the unseen one may have better contacts."""


def plan_grasps_in_view(
    camera: Camera,
    depth: ArrayLike,
    mask: ArrayLike,
    style: int = 1,
    *,
    hand: HandTable | Hand | None = None,
    friction: float = 0.5,
    edges: int = 8,
    count: int = 2,
    obstacles: Sequence[Obstacle] = (),
    margin: float = 0.003,
    noise: float = 0.001,
    symmetric: bool = False,
) -> GraspPlan:
    """Plan grasps of an object of which a depth camera sees one side.

    By default nothing is assumed of the other side: fingertips touch what is seen, and the hand remains where lines of
    sight show that nothing is. Hence all fingers hold the object near its outline, and objects whose opposite sides are
    not both seen, such as boxes, have no grasp, unless they are `symmetric`.

    Parameters
    ----------
    camera : Camera
        With its pose in the world.
    depth : array_like, (h, w)
        The depths, z in the frame of the camera and in metres, at pixels with integer coordinates. Infinite where
        nothing is within range, so that the line of sight is free; NaN, or not positive, where nothing is known.
    mask : array_like of bool, (h, w)
        The pixels of the object.
    style, hand, friction, edges, count, obstacles, margin
        As in `plan_grasps`; obstacles are in the world.
    noise : float
        The standard deviation of depths, in metres.
    symmetric : bool
        Whether the object is symmetric about planes that are parallel to its flat faces, or orthogonal to two of them,
        as boxes are, and nothing else is hidden behind it. Planes follow from where the mirror image of what is seen
        would be in space that is seen to be free. Fingers then touch the hidden side, too; what lies below it, such as
        a table, should be among the obstacles.

    Returns
    -------
    GraspPlan
        In the world, without a mesh. Grasps with the status OK have force closure for all normals and contacts within
        the bounds of their errors, which are exceeded with a probability of one in a thousand. The hand is in space
        that is seen to be free, but for 2 mm at the contacts: in the grasp, while the fingers close, and while the open
        hand approaches. UNSEEN is the status if what is seen has no such contacts. The quality is that about the middle
        of what is seen, with half the angle of friction, less what errors of the contacts may take from it.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong type or shape, or an option is out of its range.
    """
    model = any_hand(hand)
    if not isinstance(camera, Camera):
        raise TypeError(f"plan_grasps_in_view: camera: {type(camera).__name__}; expected a Camera")
    image = real_array(depth, "depth", (-1, -1), "rows and columns").astype(np.float64)
    own = as_given(mask, "plan_grasps_in_view: mask")
    if own.dtype != bool or own.shape != image.shape:
        raise ValueError(f"plan_grasps_in_view: mask: {own.dtype} of shape {own.shape}; expected bool, {image.shape}")
    if not finite_number(noise, "plan_grasps_in_view: noise") > 0:
        raise ValueError(f"plan_grasps_in_view: noise: {noise}; expected a positive number of metres")
    wanted = Wanted.checked("plan_grasps_in_view", style, friction, edges, count, margin)
    sides = seen_sides(camera, image, own, noise, float(np.arctan(friction)) / 2, model, bool(symmetric))
    if isinstance(sides, GraspStatus):
        return GraspPlan((failed(sides, model),), model, friction)
    cause = GraspStatus.UNSEEN
    for side in sides:
        others = Others(side.surface.frame, (*obstacles, side.unseen), margin)
        found = planned(side.surface, side.body, model, wanted, others)
        if isinstance(found, GraspStatus):
            cause = found
            continue
        held = [one for one in found if _is_closed_as_near_as_may_be(side, one, model, wanted)]
        if held:
            return GraspPlan(tuple(held), model, friction)
    return GraspPlan((failed(GraspStatus.UNSEEN if cause in _UNSEEN else cause, model),), model, friction)


def _is_closed_as_near_as_may_be(side: SeenSide, grasp: Grasp, hand: Hand, wanted: Wanted) -> bool:
    """Return whether a grasp has force closure, too, if contacts of a hidden side are as near as they may be."""
    surface = side.surface
    contacts = pga3.move_point_back(surface.frame, grasp.contacts)
    rows = np.square(surface.points - contacts[:, None]).sum(-1).argmin(1)
    friction, _ = surface.certain(rows, wanted.friction)
    quality = grasp_quality(
        side.nearest(rows),
        surface.normals[rows],
        friction,
        wanted.edges,
        length=surface.length,
        torsion=hand.torsion,
    )
    return quality > LEAST_QUALITY
