"""Statuses of rigid registrations."""

from __future__ import annotations

from enum import IntEnum


class RegistrationStatus(IntEnum):
    """Whether clouds or matches determine a rigid motion."""

    OK = 0
    SYMMETRIC = 1
    """Several clearly different poses explain the data equally well; all that were found are in `poses`."""
    FREE_MOTION = 2
    """Some small motion changes nothing, such as a rotation of a cylinder; it is given in `free`."""
    NO_SUPPORT = 3
    """No pose explains more of the data than chance would; the motor is the identity."""
    TOO_FEW_POINTS = 4
    """A cloud has too few finite, distinct points, or there are too few finite matches."""
    COLLINEAR = 5
    """The points are on a line, about which any rotation changes nothing."""
    COPLANAR = 6
    """A cloud is in a plane and is refused: turns about axes in the plane are distinguished only by the outline."""
    DIFFERENT_UNITS = 7
    """The clouds differ in size by so much that no rigid motion can align them; units may differ."""
