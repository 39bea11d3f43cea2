"""Statuses of grasps."""

from __future__ import annotations

from ..evidence import Status


class GraspStatus(Status):
    """Whether a hand can hold an object, and if not, why."""

    OK = 0
    """The contacts are on the object, the hand reaches them within its limits, and the grasp has force closure."""
    EMPTY = 1
    """The mesh has no vertices or no faces of positive area."""
    OPEN_MESH = 2
    """The mesh has holes: some edge is not shared by two faces in opposite directions."""
    TOO_THIN = 3
    """The object is thinner than the fingertips can hold, or has no volume."""
    TOO_LARGE = 4
    """The object is larger than the opening of the hand in every direction."""
    NO_CONTACTS = 5
    """No three points of the surface satisfy the conditions of the style."""
    NO_FORCE_CLOSURE = 6
    """Three contacts exist, but the friction is too low for them to hold the object."""
    OUT_OF_REACH = 7
    """The joints of the hand cannot put the fingertips onto any good triple or pair of contacts."""
    COLLISION = 8
    """Every pose of the hand that reaches good contacts intersects the object, or is in space not seen to be free."""
    UNSEEN = 9
    """The sides of the object that are seen have no contacts that surely hold it."""
