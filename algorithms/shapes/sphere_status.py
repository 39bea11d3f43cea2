"""Statuses of models of spheres and of their registration."""

from __future__ import annotations

from ..evidence import Status


class BallStatus(Status):
    """Whether balls reach the requested overlap."""

    OK = 0
    LIMIT_REACHED = 1
    """The largest number of balls was reached first, or no further ball is of use."""


class SphereMatchStatus(Status):
    """Whether two models of spheres match."""

    OK = 0
    FEW_MATCHES = 1
    """Fewer than half of the balls of the smaller model have a match; the map may be wrong."""
    TOO_FEW_BALLS = 2
    """A model has too few balls for the kind of map; the map moves the mean and no more."""
