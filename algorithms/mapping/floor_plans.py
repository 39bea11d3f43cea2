"""Floor plans: walls as segments, from a grid of occupied cells or given, and rays that are cast to them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import navigation as kernels
from generated import pga2

from ..arguments import Reals, finite, finite_number, real_array
from ..precision import TINY
from .segments import Segments

_PROBES = np.array([0.1234, 1.987, 3.456, 5.03])
"""Directions of rays, in rad, that test whether a place is within a wall; no wall has exactly one of them."""


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """Walls as directed segments.

    Attributes
    ----------
    starts, ends : array, (n, 2)
        Of the walls, in metres. The free space is on the left.
    solid : bool
        Whether the walls bound solid matter on their right, so that places can be within a wall. Otherwise walls are
        thin and are seen from both sides.
    """

    starts: Reals
    ends: Reals
    solid: bool = False

    def __len__(self) -> int:
        """Return the number of walls."""
        return len(self.starts)

    @classmethod
    def from_walls(cls, walls: ArrayLike, solid: bool = False) -> FloorPlan:
        """Construct a plan from segments (n, 2, 2); those without length are left out.

        Raises
        ------
        TypeError, ValueError
            If the walls have a different shape or type, or are not finite.
        """
        array = finite(real_array(walls, "walls", (2, 2), "starts and ends"), "walls").astype(float).reshape(-1, 2, 2)
        array = array[(array[:, 0] != array[:, 1]).any(1)]
        return cls(array[:, 0], array[:, 1], bool(solid))

    @classmethod
    def from_grid(cls, grid: ArrayLike, cell: float, *, tolerance: float = 0.75, smallest: float = 0.0) -> FloorPlan:
        """Construct a plan from the outlines of occupied cells.

        Cell (i, j) covers x from ``j cell`` to ``(j + 1) cell`` and y from ``i cell`` to ``(i + 1) cell``. Occupied
        cells that touch in a corner are connected. Staircases become oblique walls.

        Parameters
        ----------
        grid : array_like, (rows, columns)
            Occupied cells are not 0.
        cell : float
            Metres per cell.
        tolerance : float
            Corners that are at most this number of cells away from a straight wall are left out.
        smallest : float
            Outlines shorter than this, in metres, are left out.

        Raises
        ------
        TypeError, ValueError
            If an argument has a different shape or type, or `cell` is not positive.
        """
        array = real_array(grid, "grid", (-1, -1), "rows and columns")
        if array.ndim != 2:
            raise ValueError(f"grid: shape {array.shape}; expected (rows, columns)")
        if finite_number(cell, "cell") <= 0 or finite_number(tolerance, "tolerance") < 0:
            raise ValueError(f"cell, tolerance: {cell}, {tolerance}; expected positive numbers")
        outlines = [_simplified(outline, tolerance) for outline in _outlines(np.nan_to_num(array) != 0)]
        closed = [np.stack([outline, np.roll(outline, -1, 0)], 1) * cell for outline in outlines]
        long = [walls for walls in closed if np.linalg.norm(walls[:, 1] - walls[:, 0], axis=1).sum() >= smallest]
        return cls.from_walls(np.concatenate(long) if long else np.zeros((0, 2, 2)), solid=True)

    @property
    def segments(self) -> Segments:
        """The walls as exactly known lines of a map; normals point into the wall, away from whoever sees them."""
        along = self.ends - self.starts
        length = np.linalg.norm(along, axis=1)
        normals = np.stack([along[:, 1], -along[:, 0]], 1) / length[:, None]
        offsets = np.einsum("ij,ij->i", normals, self.starts)
        n = len(length)
        pairs = np.stack([self.starts, self.ends], 1)
        none = np.zeros(n, int)
        return Segments(normals, offsets, pairs, np.zeros((n, 2, 2)), none, np.zeros(n), none)

    def cast(self, poses: ArrayLike, angles: ArrayLike) -> tuple[Reals, Reals]:
        """Return the distances to the first walls along beams, and the indices of the walls.

        Parameters
        ----------
        poses : array_like, (..., 4)
            Motors of `generated.pga2`.
        angles : array_like, (m,)
            Of the beams, from the x axis of each pose.

        Returns
        -------
        distances : array, (..., m)
            Infinite where a beam meets no wall.
        walls : array of int, (..., m)
            -1 where a beam meets no wall.
        """
        motors = real_array(poses, "poses", (4,), "motors").astype(float)
        beams = real_array(angles, "angles", (-1,), "angles")
        heading, place = pga2.motor_to_angle_translation(motors)
        turned = np.asarray(heading)[..., None] + beams
        directions = np.stack([np.cos(turned), np.sin(turned)], -1)
        distances, walls = kernels.cast_ray(np.asarray(place)[..., None, :], directions, self.starts, self.ends)
        found = np.asarray(walls).astype(int)
        return np.where(found < 0, np.inf, distances), found

    def is_within_wall(self, poses: ArrayLike) -> Reals:
        """Return whether poses (..., 4) are within a wall; False everywhere if walls are not solid."""
        motors = real_array(poses, "poses", (4,), "motors").astype(float)
        if not self.solid or not len(self):
            return np.zeros(motors.shape[:-1], bool)
        _, walls = self.cast(motors, _PROBES)
        place = np.asarray(pga2.motor_to_angle_translation(motors)[1])[..., None, :]
        along = self.ends[walls] - self.starts[walls]
        off = place - self.starts[walls]
        # A wall that is hit from its right is hit from within; most of the rays decide, as one may graze a corner.
        behind = (along[..., 0] * off[..., 1] < along[..., 1] * off[..., 0]) & (walls >= 0)
        return np.asarray(behind.sum(-1) * 2 > len(_PROBES))


def load_floor_plan(path: str | Path, cell: float, name: str = "floorplan", **options: float) -> FloorPlan:
    """Load a floor plan from a grid in a MATLAB file.

    Parameters
    ----------
    path : str or Path
    cell : float
        Metres per cell.
    name : str
        Of the variable.
    **options
        As for `FloorPlan.from_grid`.

    Raises
    ------
    OSError
        If the file cannot be read.
    KeyError
        If it has no variable of that name.
    """
    found = scipy.io.loadmat(path)
    if name not in found:
        raise KeyError(f"{path}: variables {sorted(k for k in found if not k.startswith('__'))}; expected {name}")
    return FloorPlan.from_grid(found[name], cell, **options)


class RecallPrecision(NamedTuple):
    """How much of the walls was found, and how much of what was found is a wall."""

    recall: float
    precision: float
    n_walls: int
    """The number of samples of walls that were seen."""


def wall_recall_precision(
    walls: ArrayLike,
    found: ArrayLike,
    seen: ArrayLike | None = None,
    *,
    distance: float = 0.1,
    angle: float = np.radians(10.0),
    step: float = 0.02,
    n_hits: int = 1,
) -> RecallPrecision:
    """Compare found segments with walls, by samples along both.

    A sample of one set counts as found if a segment of the other set is within `distance` of it and differs in
    direction by less than `angle`.

    Parameters
    ----------
    walls, found : array_like, (n, 2, 2) and (m, 2, 2)
    seen : array_like, (k, 2), optional
        Points where beams met walls. Samples of walls with fewer than `n_hits` such points within 5 steps are left out.
    distance, angle, step : float
        In metres, rad, and metres between samples.
    n_hits : int

    Returns
    -------
    RecallPrecision
        Fractions of the length; NaN if there is nothing to compare.
    """
    sets = [real_array(x, name, (2, 2), "starts and ends").astype(float).reshape(-1, 2, 2)
            for x, name in ((walls, "walls"), (found, "found"))]  # fmt: skip
    samples, directions = zip(*(_sampled(x, step) for x in sets), strict=True)
    keep = np.ones(len(samples[0]), bool)
    if seen is not None:
        hits = real_array(seen, "seen", (2,), "points").astype(float).reshape(-1, 2)
        keep = _nearest(samples[0], hits, n_hits) <= 5 * step
    recalled = _covered(samples[0][keep], directions[0][keep], sets[1], distance, angle)
    precise = _covered(samples[1], directions[1], sets[0], distance, angle)
    recall, precision = (float(x.mean()) if len(x) else np.nan for x in (recalled, precise))
    return RecallPrecision(recall, precision, int(keep.sum()))


def _sampled(segments: Reals, step: float) -> tuple[Reals, Reals]:
    """Return samples in the middle of equal parts of segments, and their directions."""
    places, directions = [np.zeros((0, 2))], [np.zeros((0, 2))]
    for start, end in segments:
        length = float(np.linalg.norm(end - start))
        n = int(np.ceil(length / step))
        places.append(start + (end - start) * ((np.arange(n) + 0.5) / max(n, 1))[:, None])
        directions.append(np.broadcast_to((end - start) / max(length, TINY), (n, 2)))
    return np.concatenate(places), np.concatenate(directions)


def _nearest(points: Reals, others: Reals, k: int) -> Reals:
    """Return the distances from points to the k-th nearest of other points."""
    if len(others) < k or not len(points):
        return np.full(len(points), np.inf)
    return np.asarray(scipy.spatial.cKDTree(others).query(points, k=[k])[0][:, 0])


def _covered(points: Reals, directions: Reals, segments: Reals, distance: float, angle: float) -> Reals:
    covered = np.zeros(len(points), bool)
    for start, end in segments:
        length = np.linalg.norm(end - start)
        if not length > 0:
            continue
        along = (end - start) / length
        aside = np.array([-along[1], along[0]])
        position, off = (points - start) @ along, np.abs((points - start) @ aside)
        beyond = np.maximum(np.maximum(-position, position - length), 0)
        covered |= (np.hypot(off, beyond) <= distance) & (np.abs(directions @ aside) <= np.sin(angle))
    return covered


def _outlines(occupied: Reals) -> list[Reals]:
    """Return the closed outlines (k, 2) of occupied cells as corners x, y, with occupied cells on the right."""
    padded = np.pad(occupied, 1)
    inner = padded[1:-1, 1:-1]
    following: dict[tuple[int, int], list[tuple[int, int]]] = {}
    # The neighbour that must be free, and the corners from which to which the edge runs, as offsets of the cell.
    sides = (
        (padded[:-2, 1:-1], (0, 1), (0, 0)),
        (padded[2:, 1:-1], (1, 0), (1, 1)),
        (padded[1:-1, :-2], (0, 0), (1, 0)),
        (padded[1:-1, 2:], (1, 1), (0, 1)),
    )
    for neighbour, begin, end in sides:
        for i, j in np.argwhere(inner & ~neighbour).tolist():
            following.setdefault((i + begin[0], j + begin[1]), []).append((i + end[0], j + end[1]))
    outlines = []
    while following:
        first = next(iter(following))
        here = following[first][0]
        begin = step = here[0] - first[0], here[1] - first[1]
        _remove(following, first, here)
        corners = []
        while here != first or (here in following and _left(step, here, following[here]) is not None):
            choices = following[here]
            # Where two outlines meet, the left turn connects cells that touch in a corner.
            after = choices[0] if len(choices) == 1 else (_left(step, here, choices) or choices[0])
            turned = after[0] - here[0], after[1] - here[1]
            if turned != step:
                corners.append(here)
            _remove(following, here, after)
            here, step = after, turned
        if step != begin:
            corners.append(first)
        outlines.append(np.array([(j, i) for i, j in corners], float))
    return outlines


def _left(step: tuple[int, int], here: tuple[int, int], choices: list[tuple[int, int]]) -> tuple[int, int] | None:
    """Return the choice that turns left, with rows upwards."""
    left = here[0] + step[1], here[1] - step[0]
    return left if left in choices else None


def _remove(
    following: dict[tuple[int, int], list[tuple[int, int]]], here: tuple[int, int], to: tuple[int, int]
) -> None:
    following[here].remove(to)
    if not following[here]:
        del following[here]


def _simplified(outline: Reals, tolerance: float) -> Reals:
    """Return the corners of a closed outline that remain after straightening it (Douglas and Peucker)."""
    far = int(np.argmax(((outline - outline[0]) ** 2).sum(1)))
    closed = np.concatenate([outline, outline[:1]])
    keep = np.zeros(len(closed), bool)
    keep[[0, far, -1]] = True
    parts = [(0, far), (far, len(closed) - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        inner = closed[first + 1 : last] - closed[first]
        chord = closed[last] - closed[first]
        length = float(np.hypot(*chord))
        if length > 0:
            # Where an outline turns back, the distance is that from the chord, not from its line.
            t = np.clip(inner @ chord / length**2, 0, 1)
            away = np.hypot(*(inner - t[:, None] * chord).T)
        else:
            away = np.hypot(*inner.T)
        worst = int(np.argmax(away))
        if away[worst] > tolerance:
            keep[first + 1 + worst] = True
            parts += [(first, first + 1 + worst), (first + 1 + worst, last)]
    return closed[:-1][keep[:-1]]
