"""The statuses of segmented regions."""

from __future__ import annotations

from ..evidence import Status


class SegmentStatus(Status):
    """Whether the data determine a region."""

    OK = 0
    """Other seeds in the region and, unless it is given, other radii of necks give the region again, with a Dice
    coefficient of at least 0.85."""
    AMBIGUOUS = 1
    """Another seed in the region, or another radius of necks, gives another region: densities of the surroundings are
    too similar, or the region is not uniform. Mark more seeds, or pass a radius."""
    TOO_SMALL = 2
    """The region has less than half of the neighbourhood of the seeds that gave its density, so that this was not its
    density: the seed is beside the region, or the region is smaller than five voxels across."""
    UNBOUNDED = 3
    """Most of the surface of the region is the border of the volume: nothing in the volume limits it."""
    NOTHING = 4
    """No region grows from the seeds; the mask is empty."""
