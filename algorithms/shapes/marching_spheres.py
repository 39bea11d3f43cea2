"""Marching spheres: the surface of an object as spheres of the cells that it crosses (section 22.3)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import Reals
from .rasterising import Mask, ball_in_grid, checked_mask, checked_spacing
from .sphere_status import BallStatus

_OVERLAP = 0.952
"""Overlap at which no further spheres are added."""
_ENOUGH = 0.95
"""Overlap of a model whose status is OK."""
_WORTH = 0.2
"""The part of a cell that must be uncovered for a sphere in the first round."""
_GROWTHS = (0.0, 0.2, 0.45)
"""Edges of a voxel by which spheres may reach beyond the nearest outer voxel."""
_SINGLE = (-0.25,)
"""The same for cells of one voxel: the sphere is between the voxel and its neighbours."""
_OUTSIDE = 12
"""Voxels of the object that must be added for each voxel outside."""
_ROUNDS = 20
"""A limit on work: each round may leave half of the voxels of a cell that the previous one has left."""
_LISTED = 3 / 4
"""From counting: a boundary voxel has three numbers and a ball has four, so that with more balls per boundary voxel
a list of these voxels is shorter than the model."""


@dataclass(frozen=True, eq=False)
class MarchedModel:
    """A model of spheres in the cells of a surface, with full cells inside.

    Attributes
    ----------
    balls : array, (k, 4)
        Centres and radii, in the unit of the spacing.
    full : array of bool
        The voxels of cells that the surface does not cross.
    filled : array of bool
        The voxels of the whole model.
    overlap : float
        The voxels in model and mask divided by those in either.
    cells : int
        Number of cells that the surface crosses.
    status : BallStatus
        LIMIT_REACHED if spheres in all cells do not reach an overlap of 0.95. THIN if the cells are larger than a
        voxel, but the model has more numbers than a list of the boundary voxels: the object is thinner than a sphere
        that covers several of them, as cortical bone of one or two voxels is. The overlap is then still right.
    """

    balls: Reals
    full: Mask
    filled: Mask
    overlap: float
    cells: int
    status: BallStatus


def _blocks(volume: Reals, size: int) -> Reals:
    """Return the voxels of each cell as the last axis, with zeros beyond the border."""
    counts = [-(-n // size) for n in volume.shape]
    padded = np.zeros([n * size for n in counts], volume.dtype)
    padded[tuple(map(slice, volume.shape))] = volume
    x, y, z = counts
    cells = padded.reshape(x, size, y, size, z, size).transpose(0, 2, 4, 1, 3, 5)
    return cells.reshape(x, y, z, size**3)


def march(mask: ArrayLike, size: int, spacing: ArrayLike = (1, 1, 1)) -> MarchedModel:
    """Model an object by spheres in cells of its surface, and measure the overlap.

    In each cell that contains boundary voxels the sphere is centred at the voxel of the object farthest from the
    outside, and touches the nearest outer voxel. Starting with the largest one, the sphere of a cell is merged with
    those of its neighbours if they already cover all voxels of the cell. Cells in which most is left uncovered obtain
    further spheres until the overlap is 0.952.

    Parameters
    ----------
    mask : array_like, three axes
        The object, where voxels are not zero. Beyond the border is outside.
    size : int
        The edge of a cell, in voxels.
    spacing : array_like, (3,), optional
        The edges of a voxel.
    """
    inside, edges = checked_mask(mask), checked_spacing(spacing)
    if isinstance(size, bool) or not isinstance(size, (int, np.integer)) or size < 1:
        raise ValueError(f"size: {size!r}; expected the edge of a cell, an integer of at least 1 voxel")
    depth = scipy.ndimage.distance_transform_edt(np.pad(inside, 1), sampling=edges)[1:-1, 1:-1, 1:-1]
    # The nearest outer voxel must not count as inside by rounding of the square of the distance.
    depth *= 1 - 1e-9
    border = inside & ~scipy.ndimage.binary_erosion(inside)
    mixed = _blocks(border, int(size)).any(-1)
    whole = mixed.repeat(size, 0).repeat(size, 1).repeat(size, 2)[tuple(map(slice, inside.shape))]
    full = inside & ~whole
    model = _Growing(inside, full.copy(), edges)
    cells = np.argwhere(mixed) * size
    growths = _SINGLE if size == 1 else _GROWTHS
    _cover(model, cells, _blocks(depth, size)[mixed], size**3 * _WORTH, growths)
    for _ in range(_ROUNDS):
        left = _blocks(np.where(model.covered, 0, depth), size)[mixed]
        most = int(np.count_nonzero(left, axis=1).max())
        if model.overlap() >= _OVERLAP or not most:
            break
        # Half of the largest number of voxels that is left in a cell may remain in each round.
        _cover(model, cells, left, most / 2, growths, _OVERLAP)
    status = BallStatus.OK if model.overlap() >= _ENOUGH else BallStatus.LIMIT_REACHED
    if status == BallStatus.OK and size > 1 and len(model.balls) > _LISTED * np.count_nonzero(border):
        status = BallStatus.THIN
    return MarchedModel(np.array(model.balls).reshape(-1, 4), full, model.covered, model.overlap(), len(cells), status)


@dataclass(eq=False)
class _Growing:
    """A model to which balls are added, with the numbers of its voxels in the object and outside."""

    inside: Mask
    covered: Mask
    edges: Reals
    balls: list[Reals] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.size, self.hits, self.extra = (int(np.count_nonzero(x)) for x in (self.inside, self.covered, ()))

    def overlap(self) -> float:
        return self.hits / (self.size + self.extra)

    def add(self, centre: Reals, radii: list[float]) -> None:
        """Add a ball with that of several radii which adds most voxels of the object, less those outside."""
        best: tuple[int, int, float] = (-1, -1, 0.0)
        for radius in radii:
            part, ball = ball_in_grid(centre, radius, self.covered.shape, self.edges)
            new = ball & ~self.covered[part]
            count, hits = int(np.count_nonzero(new)), int(np.count_nonzero(new & self.inside[part]))
            if hits - _OUTSIDE * (count - hits) > best[0] - _OUTSIDE * (best[1] - best[0]):
                best = hits, count, radius
        hits, count, radius = best
        part, ball = ball_in_grid(centre, radius, self.covered.shape, self.edges)
        self.hits, self.extra = self.hits + hits, self.extra + count - hits
        self.covered[part] |= ball
        self.balls.append(np.array([*centre, radius]))


def _cover(
    model: _Growing, cells: Reals, depth: Reals, least: float, growths: tuple[float, ...], enough: float = np.inf
) -> None:
    """Add the spheres of cells in which at least `least` voxels are not covered, the largest first."""
    size = round(depth.shape[1] ** (1 / 3))
    place, radii = depth.argmax(1), depth.max(1)
    centres = (cells + np.stack(np.unravel_index(place, (size, size, size)), 1)) * model.edges
    for i in np.argsort(-radii, kind="stable"):
        a, b, c = cells[i]
        part = slice(a, a + size), slice(b, b + size), slice(c, c + size)
        open_voxels = np.count_nonzero(model.inside[part] & ~model.covered[part])
        if radii[i] <= 0 or open_voxels < max(least, 1):
            continue
        model.add(centres[i], [radii[i] + growth * model.edges.min() for growth in growths])
        if model.overlap() >= enough:
            return


def marching_spheres(mask: ArrayLike, size: int, spacing: ArrayLike = (1, 1, 1)) -> Reals:
    """Return the spheres of the surface of an object, (k, 4): centres and radii in the unit of the spacing.

    See `march`, which also returns the full cells inside, the overlap, and whether it suffices.
    """
    return march(mask, size, spacing).balls
