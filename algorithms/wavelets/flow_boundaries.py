"""Motion at boundaries: nodes and pixels choose among the motions of neighbours, and hidden pixels are detected."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from generated import images

from ..arguments import Reals
from ..evidence import explains
from .flow_equations import LARGE, enlarged, half_gaussian, outside, widened

_DISTANCE = 3
"""Distance of the candidates in nodes, as in `bends`: about how far averages spread motion across a boundary."""
_ROUNDS = 2
"""A limit on work: how often boundaries move."""
_OTHER = 0.5
"""Squared difference, in pixels, of motions that are worth comparing, and from a motion that is linear there."""
_EDGE = 0.25
"""The same for adjacent nodes, between which pixels choose."""
_REACH = 2
"""Differences of images are averaged over windows that extend by so many pixels: narrow, for sharp boundaries."""
_BETTER = 0.8
"""Another motion must reduce the differences to this fraction."""
_LEAST = 1e-5
"""Lower bound of the median of squared differences, for images of contrast 1."""
_TOLERANCE, _SHARE = 0.5, 0.02
"""Squared difference, in pixels, up to which motions are not different, and fraction of the squared motion added."""

_DOWN, _ACROSS = (part.reshape(-1).astype(np.float32) for part in np.mgrid[-_REACH : _REACH + 1, -_REACH : _REACH + 1])
_HALF = half_gaussian(1.2, _REACH)
"""Half of the weights of a window about a pixel."""
_WEIGHTS = np.outer(*[np.concatenate([_HALF[:0:-1], _HALF])] * 2).reshape(-1)


class Comparison:
    """Squared differences between two images for any motion.

    Parameters
    ----------
    first, second : array, (M, N)
    """

    def __init__(self, first: Reals, second: Reals) -> None:
        # Windows, and the interpolation in the second image, reach beyond the image.
        self._border = _REACH + 1
        self._images = [np.pad(image, self._border, "edge") for image in (first, second)]
        self._last = np.array(first.shape[::-1], np.float32) - 1 + self._border
        self.shape = first.shape

    def at(self, row: NDArray[np.intp], column: NDArray[np.intp], uv: Reals, most: float) -> Reals:
        """Return the differences, averaged over a window, of some pixels (k) with the motion (2, k).

        Each squared difference is clipped to `most`.
        """
        return self._costs(row, column, uv, (_DOWN, _ACROSS, _WEIGHTS), most)

    def noise(self, motion: Reals) -> float:
        """Return the median of the squared differences of the nodes, which have the motion (2, m, n)."""
        row, column = (2 * index.reshape(-1) for index in np.mgrid[: motion.shape[1] : 2, : motion.shape[2] : 2])
        some = np.ascontiguousarray(motion[:, ::2, ::2]).reshape(2, -1)
        here, one = np.zeros(1, np.float32), np.ones(1, np.float32)
        squares = self._costs(row, column, some, (here, here, one), np.inf)
        return max(float(np.median(squares)), _LEAST)

    def _costs(
        self, row: NDArray[np.intp], column: NDArray[np.intp], uv: Reals, window: tuple[Reals, ...], most: float
    ) -> Reals:
        places = ((index + self._border).astype(np.float32) for index in (row, column))
        result: Reals = images.motion_costs(  # type: ignore[call-overload]
            *self._images, *places, *uv, *window, self._last, np.float32(most)
        )
        return result


def _samples(half: Reals, motion: Reals, known: NDArray[np.bool_]) -> tuple[Reals, Reals]:
    """Return values (k) of the second image at the ends of the motion (2, m, n) of known nodes, and of the first.

    Both images (2, m, n) are smoothed before every other pixel is taken, so that no structure is between the nodes.
    Where the motion shrinks areas to less than half, so that pixels seem to explain several others, the value is the
    mean.
    """
    # A limit on work: of many nodes, a quarter.
    step = 2 if known.size > LARGE else 1
    row, column = (step * index for index in np.nonzero(known[::step, ::step]))
    moved = _between(half[1], row + motion[1, row, column] / 2, column + motion[0, row, column] / 2)
    moved = np.where(_shrinks(motion)[row, column], moved.mean() if moved.size else 0, moved)
    return moved, half[0][row, column]


def _between(image: Reals, y: Reals, x: Reals) -> Reals:
    """Return values of an image at any places, by linear interpolation; beyond the edges, those of the last pixels."""
    parts = []
    for places, size in ((y, image.shape[0]), (x, image.shape[1])):
        inside = np.clip(places, 0, size - 1)
        before = np.minimum(inside.astype(np.intp), max(size - 2, 0))
        parts.append((before, np.minimum(before + 1, size - 1), inside - before))
    (top, bottom, down), (left, right, across) = parts
    above, below = (image[i, left] + across * (image[i, right] - image[i, left]) for i in (top, bottom))
    return np.asarray(above + down * (below - above))


def _shrinks(motion: Reals) -> NDArray[np.bool_]:
    """Return where the motion (2, m, n) of nodes, in pixels, shrinks areas to less than half, or turns them over."""
    (ux, vx), (uy, vy) = (np.diff(motion, axis=axis, append=motion.take([-1], axis)) / 2 for axis in (2, 1))
    return np.asarray((1 + ux) * (1 + vy) - uy * vx < 0.5)


def most_of(noise: float) -> float:
    """Return the bound of squared differences: that of outliers of a normal distribution, or of a visible step."""
    return 36 * noise + 0.05


def chosen(comparison: Comparison, motion: Reals) -> Reals:
    """Return the motion, replaced at each node by that of a nearby node where that explains the images better.

    Parameters
    ----------
    comparison : Comparison
    motion : array, (2, m, n)
        The motion of the nodes.

    Returns
    -------
    array, (2, m, n)
    """
    noise = 0.0
    for _ in range(_ROUNDS):
        offers = _offers(motion, comparison.shape)
        if not offers:
            break
        noise = noise or comparison.noise(motion)
        most, columns = most_of(noise), motion.shape[2]
        result = motion.reshape(2, -1).copy()
        flat = np.unique(np.concatenate([places for places, _ in offers]))
        every = [(flat, result[:, flat]), *offers]
        places, uv = (np.concatenate([offer[k] for offer in every], -1) for k in (0, 1))
        costs = comparison.at(*_pixels(places, columns), uv, most)
        of_own, *of_offers = np.split(costs, np.cumsum([len(places) for places, _ in every[:-1]]))
        own: Reals = np.zeros(result.shape[1], np.float32)
        own[flat] = of_own
        best = own.copy()
        for (places, uv), cost in zip(offers, of_offers, strict=True):
            better = (cost + 0.1 * noise < best[places]) & (cost < _BETTER * own[places])
            best[places[better]], result[:, places[better]] = cost[better], uv[:, better]
        motion = result.reshape(motion.shape)
    return motion


def _pixels(places: NDArray[np.intp], columns: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows and columns of the pixels of nodes, which have one number each."""
    row, column = np.divmod(places, columns)
    return 2 * row, 2 * column


def _offers(motion: Reals, shape: tuple[int, ...]) -> list[tuple[NDArray[np.intp], Reals]]:
    """Return for each of eight neighbours the nodes that may take its motion, and this motion.

    A neighbour is of interest if its motion differs, and if the motion between it and the opposite neighbour is not
    linear, as in rotations and enlargements.
    """
    d = _DISTANCE
    rows, columns = motion.shape[1:]
    found = []
    for bend, (down, across) in zip(images.bends(*motion), ((0, d), (d, 0), (d, d), (d, -d)), strict=True):
        places = np.flatnonzero(bend > _OTHER)
        if not places.size:
            continue
        row, column = np.divmod(places, columns)
        own = motion[:, row, column]
        for sign in (1, -1):
            i, j = np.clip(row + sign * down, 0, rows - 1), np.clip(column + sign * across, 0, columns - 1)
            uv = motion[:, i, j]
            x, y = 2 * column + uv[0], 2 * row + uv[1]
            inside = (x >= 0) & (x <= shape[1] - 1) & (y >= 0) & (y <= shape[0] - 1)
            wanted = inside & (_squares(uv - own) > _OTHER)
            if wanted.any():
                found.append((places[wanted], uv[:, wanted]))
    return found


def _squares(uv: Reals) -> Reals:
    return np.asarray(uv[0] * uv[0] + uv[1] * uv[1])


def joined(comparison: Comparison, motion: Reals, uv: Reals) -> Reals:
    """Return the motion of all pixels, chosen among that of nearby nodes where these are on two sides of a boundary.

    Parameters
    ----------
    comparison : Comparison
    motion : array, (2, m, n)
        The motion of the nodes.
    uv : array, (2, M, N)
        The same, interpolated between the nodes.

    Returns
    -------
    array, (2, M, N)
    """
    edge = _edges(motion)
    if not edge.any():
        return uv
    near = widened(widened(edge, 0), 1)
    row, column = np.nonzero(_each_pixel(near, uv.shape[1:]))
    noise = comparison.noise(motion)
    i, j = (index[:, None] // 2 + np.array(steps) for index, steps in ((row, (-1, -1, 2, 2)), (column, (-1, 2, -1, 2))))
    np.clip(i, 0, motion.shape[1] - 1, out=i)
    np.clip(j, 0, motion.shape[2] - 1, out=j)
    offers = np.concatenate([uv[:, row, column][..., None], motion[:, i, j]], -1)
    count = offers.shape[-1]
    costs = comparison.at(row.repeat(count), column.repeat(count), offers.reshape(2, -1), most_of(noise))
    costs = costs.reshape(-1, count)
    costs[:, 0] = _BETTER * costs[:, 0] - 0.1 * noise
    result = np.take_along_axis(offers, costs.argmin(1)[None, :, None], -1)[..., 0]
    uv = uv.copy()
    uv[:, row, column] = result
    return uv


def _edges(motion: Reals) -> NDArray[np.bool_]:
    """Return at which nodes the motion (2, m, n) is far from linear."""
    edge = np.zeros(motion.shape[1:], bool)
    for inner, bend in (
        (edge[1:-1], motion[:, :-2] + motion[:, 2:] - 2 * motion[:, 1:-1]),
        (edge[:, 1:-1], motion[:, :, :-2] + motion[:, :, 2:] - 2 * motion[:, :, 1:-1]),
    ):
        inner |= _squares(bend) > _EDGE
    return edge


def visible(comparison: Comparison, half: Reals, uv: Reals) -> NDArray[np.bool_]:
    """Return which pixels of the first image are visible in the second one.

    Parameters
    ----------
    comparison : Comparison
    half : array, (2, m, n)
        Every other pixel of both images after smoothing.
    uv : array, (2, M, N)
        The motion from the first image to the second one.

    Notes
    -----
    A pixel is visible if its motion ends inside the image. Near boundaries of the motion, the images must also agree,
    and no pixel with another motion may end at the same place and agree better: it would hide the pixel. If the second
    image, moved, explains less than half of the variance of the first one, no pixel is visible.
    """
    shape = uv.shape[1:]
    inside = ~outside(uv)
    motion = np.ascontiguousarray(uv[:, ::2, ::2])
    if not explains(*_samples(half, motion, inside[::2, ::2])):
        return np.zeros(shape, bool)
    edge = _edges(motion)
    if not edge.any():
        return inside
    near = widened(widened(edge, 0, _DISTANCE + 1), 1, _DISTANCE + 1)
    row, column = np.nonzero(_each_pixel(near, shape) & inside)
    own, most = uv[:, row, column], most_of(comparison.noise(motion))
    cost = comparison.at(row, column, own, most)
    i, j = (
        np.clip(np.rint(index + part).astype(int), 0, size - 1)
        for index, part, size in zip((row, column), own[::-1], shape, strict=True)
    )
    # The pixel of least cost that ends at each place, the last one in this order; then at it or beside it.
    order, ending = np.argsort(-cost, kind="stable"), np.full((shape[0] + 2, shape[1] + 2), -1)
    ending[i[order] + 1, j[order] + 1] = order
    first = ending[i + 1, j + 1]
    for down, across in product((0, 1, 2), repeat=2):
        other = ending[i + down, j + across]
        first = np.where((other >= 0) & (cost[other] < cost[first]), other, first)
    tolerance = _TOLERANCE + _SHARE * _squares(own)
    hidden = (cost[first] < cost) & (_squares(own[:, first] - own) > tolerance)
    inside[row, column] = ~hidden & (cost <= most / 2)
    return inside


def _each_pixel(nodes: NDArray[np.bool_], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return the values of nodes for the pixels at and after them."""
    return np.asarray(nodes.repeat(2, 0).repeat(2, 1)[: shape[0], : shape[1]])


def interpolated(motion: Reals, shape: tuple[int, ...]) -> Reals:
    """Return a field (..., m, n) of the nodes, interpolated between them, for all pixels."""
    return enlarged(motion)[..., : shape[0], : shape[1]]
