"""Statuses of voted tensors, estimated normals, and deformable registration."""

from __future__ import annotations

from ..evidence import Status


class VoteStatus(Status):
    """Whether the votes at a place determine a direction."""

    OK = 0
    ISOLATED = 1
    """No token votes here: the tensor and all saliencies are 0."""
    UNDETERMINED = 2
    """All eigenvalues are equal: the votes prefer no direction, and normal and tangent are arbitrary."""
    NOT_FINITE = 3
    """A coordinate is infinite or NaN: the token neither votes nor receives votes."""


class CurveStatus(Status):
    """Whether curves explain the tokens."""

    OK = 0
    """Tokens on no curve and no surface are nowhere denser than chance makes them."""
    NOTHING = 1
    """No curve was found, and chance explains the tokens, or surfaces do."""
    UNEXPLAINED = 2
    """There are more tokens beside the curves than chance gives: the scale does not suit their noise or spacing, so
    that curves are missing or broken. Repeat with a scale of at least six times the noise."""


class DeformStatus(Status):
    """Whether a deformation was found."""

    OK = 0
    NOT_CONVERGED = 1
    """The displacements still change after the last step."""
    POOR_FIT = 2
    """Too many points have no corresponding place on the target."""
    TOO_FEW_POINTS = 3
    """A cloud has too few finite, distinct points; the source is returned unchanged."""
    INCONSISTENT = 4
    """The displacements of the target onto the source do not lead back: partners are ambiguous or wrong."""
