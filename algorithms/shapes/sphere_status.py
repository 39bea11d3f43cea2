"""Statuses of models of spheres and of their registration."""

from __future__ import annotations

from ..evidence import Status


class BallStatus(Status):
    """Whether balls reach the requested overlap."""

    OK = 0
    LIMIT_REACHED = 1
    """The largest number of balls was reached first, or no further ball is of use."""
    THIN = 2
    """The overlap is reached, but by more numbers than a list of the boundary voxels has: the object is too thin for
    balls."""


class SphereMatchStatus(Status):
    """Whether two models of spheres match."""

    OK = 0
    FEW_MATCHES = 1
    """Chance explains the matches: maps fitted without some balls do not predict where these are, or the map reflects,
    as of mirrored models. The map may be wrong. If balls overlap, it moves the surfaces to each other as little as
    possible."""
    TOO_FEW_BALLS = 2
    """A model has too few balls for the kind of map; the map moves the mean and no more."""
    FLAT = 3
    """The centres of a model are in a plane or on a line and do not determine a map of this kind; it moves the mean and
    no more."""
