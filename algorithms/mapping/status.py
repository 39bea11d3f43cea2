"""Statuses of matched scans, relocations and maps."""

from __future__ import annotations

from ..evidence import Status


class MappingStatus(Status):
    """Whether scans determine a motion, and whether they agree with it."""

    OK = 0
    DEGENERATE = 1
    """Some direction of the motion is not determined, such as that along a corridor; the others are."""
    AMBIGUOUS = 2
    """A clearly different motion explains the readings almost as well."""
    NOT_MATCHED = 3
    """No motion explains enough of the readings."""
    TOO_FEW_READINGS = 4
    """A scan has too few valid readings, or a map too few lines; nothing was computed."""
    WEAK = 5
    """Too few readings on walls that both scans show confirm the motion, or they are far from these walls."""
