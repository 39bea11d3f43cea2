"""Statuses of rigid registrations."""

from __future__ import annotations

from ..evidence import Status


class RegistrationStatus(Status):
    """Whether clouds or matches determine a rigid motion."""

    OK = 0
    SYMMETRIC = 1
    """Several clearly different poses explain the data equally well; all that were found are in `poses`."""
    FREE_MOTION = 2
    """Some small motion changes nothing, such as a rotation of a cylinder or of a line about itself; it is given in
    `free`. There may be several poses, such as both directions of a cylinder."""
    NO_SUPPORT = 3
    """No pose explains more of the data than chance would; the motor is the identity."""
    TOO_FEW_POINTS = 4
    """Fewer than 20 different points of a cloud, or fewer than 4 matches."""
    COLLINEAR = 5
    """One cloud is on a line and the other one is not. Of matches: the inliers are on a line, and the rotation about it
    is free."""
    COPLANAR = 6
    """One cloud is in a plane and the other one is not flat. Two flat clouds are registered."""
    DIFFERENT_UNITS = 7
    """The clouds differ in size by so much that no rigid motion can align them; units may differ."""
    UNCERTAIN = 8
    """The best pose has support, but at it the surfaces of the clouds coincide less well than that of one cloud with
    itself, or in places they are two surfaces by more than the noise: another pose, which was not found, may be right,
    or the objects differ, as from a mirror image."""
    MIRRORED = 9
    """Of matches: a reflection explains more of them than any motion, as if one cloud had left-handed coordinates. The
    motor is that of the inliers, which are near a plane."""
    DEFORMED = 10
    """Of matches: distances of inliers from the motion are a linear or quadratic function of their places, and more so
    than random, as if the cloud were bent, sheared or scaled. The motor is that of least squares."""
