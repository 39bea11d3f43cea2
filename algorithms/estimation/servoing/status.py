"""Stages and statuses of visually guided grasping."""

from __future__ import annotations

from enum import IntEnum

from ...evidence import Status


class GraspStage(IntEnum):
    """What the next motions of a guided grasp are for."""

    PROBING = 0
    """Small motions along all six axes, by which the derivatives are estimated."""
    ORIENTING = 1
    """The fingers and their axis of closing become parallel to the box."""
    CENTRING = 2
    """The hand moves onto the axis of the fingers through the centre of the box."""
    GRASPING = 3
    """The tips move to the centre of the box, on its axis of closing."""
    HOLDING = 4
    """Images of the resting hand are averaged, the last errors are removed, and the fingers close."""
    DONE = 5


class VisualStatus(Status):
    """Whether the images allow a step. With any other status than OK, the hand does not move."""

    OK = 0
    LOST_FEATURE = 1
    """A point is missing (NaN) in an image."""
    BEHIND_CAMERA = 2
    """The image of a rectangle is not convex: a part is behind the camera, or points are confused."""
    DEGENERATE_VIEW = 3
    """A face of the box or the hand is seen from the side, so that its centre is undetermined."""
    DEGENERATE_CAMERAS = 4
    """The images do not determine all six motions, as for two cameras at the same place."""
    HAND_DOES_NOT_MOVE = 5
    """The images do not change when the hand should move."""
    OUT_OF_REACH = 6
    """The robot cannot carry out the next motion."""
    UPSIDE_DOWN = 7
    """The hand is on the wrong side of the box."""
    NOT_CONVERGED = 8
    """The errors do not decrease, or the maximum number of steps is reached."""
