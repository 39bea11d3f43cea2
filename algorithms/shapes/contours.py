"""Contours as closed cycles of nodes that carry motors (sections 17.1.2 and 17.2)."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import cga2, shapes

from ..arguments import Reals, finite, real_array
from ..precision import NEGLIGIBLE
from .contour_stability import Stability, stability
from .contour_status import ContourStatus
from .images import checked_image
from .level_lines import level_line
from .objects_of_images import Object, object_of

_FEWEST = 8
"""Nodes of the first stage, and samples of a contour: fewer do not show its shape."""
_NEAR = 8
"""From a probability: of m samples in a random order, each is followed by one of so many neighbours with 8 / m."""
_RATE, _ADAPTATIONS = 0.5, 6
"""Fraction of the error that nodes are moved by, and how often, at the end."""
_MEAN, _MOST = 0.7, 3.0
"""Distances in pixels within which a contour agrees with the boundary."""
_MEAN_SHIFT = 3 * _MEAN
"""The same for changes of the level. They are larger than its error, which is about a third of them."""


@dataclass(frozen=True, eq=False)
class Contour:
    """A closed cycle of nodes. Coordinates are row and column.

    Attributes
    ----------
    path : array, (n, 2)
        Places of the nodes; the last one is joined with the first.
    motors : array, (n, 4)
        Motors of `generated.pga2`, from the origin to the places; they turn the second axis to the normals.
    normals : array, (n, 2)
        Unit normals, outwards.
    curvatures : array, (n,)
        Of the circles through three nodes; positive where the contour is convex.
    samples : array, (m, 2)
        The boundary that the nodes were adapted to, in order.
    status : ContourStatus
    mean_distances, largest_distances : tuple of float
        From the boundary to the contour, and from the contour to the boundary, in pixels.
    curve : array, (k, 3)
        While the cycle grew: nodes, mean and largest distance of the samples.
    n_components : int
        Objects of the image, of which one was chosen.
    stability : Stability
        How much the boundary moves with its level and with the scale. Images of two values and adapted contours are
        not examined.
    """

    path: Reals
    motors: Reals
    normals: Reals
    curvatures: Reals
    samples: Reals
    status: ContourStatus
    mean_distances: tuple[float, float]
    largest_distances: tuple[float, float]
    curve: Reals
    n_components: int
    stability: Stability

    def similarities(self, radius: float = 1e3) -> Reals:
        """Return versors (n, 8) of `generated.cga2` that also scale by the radius of curvature, at most `radius`."""
        scales = 1 / np.maximum(np.abs(self.curvatures), 1 / radius)
        up = np.broadcast_to(np.array([0.0, 1.0]), self.normals.shape)
        return np.asarray(cga2.similarity_between_rounds(np.zeros(2), self.path, up, self.normals, scales))

    def osculating_circles(self, radius: float = 1e3) -> Reals:
        """Transport a unit circle that touches the origin from within: circles (n, 4) that touch the contour."""
        side = np.where(self.curvatures < 0, 1.0, -1.0)
        unit = cga2.circle_from_centre(np.column_stack([np.zeros(len(side)), side]), 1.0)
        return np.asarray(cga2.transform_circle(self.similarities(radius), unit))


def contour(image: ArrayLike, nodes: int = 150, tolerance: float = 0.6, near: tuple[int, int] | None = None) -> Reals:
    """Find the closed contour of the object in an image.

    Parameters
    ----------
    image, nodes, tolerance, near
        As for `trace_contour`.

    Returns
    -------
    array, (n, 2)
        Row and column of the nodes, in order; the last one is joined with the first.

    Raises
    ------
    ValueError
        If there is no object, or its contour does not agree with it; the message states the distances.

    Warns
    -----
    UserWarning
        If the boundary is uncertain: other levels or a smoothed image have another one, or a neck joins two bodies.
    """
    found = trace_contour(image, nodes, tolerance, near)
    if found.status is ContourStatus.UNCERTAIN:
        warnings.warn(
            f"image: UNCERTAIN: {_reason(found.stability)}; pass a mask, or look at the result of trace_contour",
            stacklevel=2,
        )
    elif found.status not in (ContourStatus.OK, ContourStatus.TOUCHES_BORDER):
        raise ValueError(
            f"image: {found.status.name}: {len(found.path)} nodes differ from the boundary by "
            f"{max(found.mean_distances):.2f} pixels on average, {max(found.largest_distances):.1f} at most; expected "
            f"{_MEAN} and {_MOST}; allow more nodes, or use trace_contour"
        )
    return found.path


def trace_contour(
    image: ArrayLike, nodes: int = 150, tolerance: float = 0.6, near: tuple[int, int] | None = None
) -> Contour:
    """Grow a cycle of nodes on the boundary of the object in an image.

    Parameters
    ----------
    image : array_like, (rows, columns)
        A mask or an image of any real type. What most of the border of the image belongs to is the background. In an
        image of more than two values, the boundary is the level line with the largest mean gradient.
    nodes : int, optional
        The most nodes.
    tolerance : float, optional
        Distance in pixels at which the cycle does not grow any more.
    near : tuple of int, optional
        A pixel of the object. By default the object is chosen by its size and by its distance from the centre.

    Returns
    -------
    Contour
    """
    array = checked_image(image, "image", (2,), 2)
    if nodes < _FEWEST:
        raise ValueError(f"nodes: {nodes}; expected at least {_FEWEST}")
    if not tolerance > 0:
        raise ValueError(f"tolerance: {tolerance}; expected a positive number of pixels")
    if near is not None and not (0 <= near[0] < array.shape[0] and 0 <= near[1] < array.shape[1]):
        raise ValueError(f"near: {near} is outside of the image with shape {array.shape}")
    found = object_of(array, near)
    below = found.level - NEGLIGIBLE * float(np.ptp(found.field))
    field = np.where(found.mask, found.field, np.minimum(found.field, below))
    samples = level_line(field, found.level)
    return _contour_of(samples, nodes, tolerance, found, stability(found, samples))


def adapted(shape: Contour, samples: Reals) -> Contour:
    """Adapt a contour to the boundary of a moved shape; each node goes to its nearest place of equal normal.

    Parameters
    ----------
    shape : Contour
    samples : array, (m, 2)
        The boundary of the shape after it moved, in order and in the same direction: `Contour.samples` of another
        image.

    Returns
    -------
    Contour
        Row i of its `motors`, times the inverse of row i before, is the motion of node i.

    Raises
    ------
    ValueError
        If the samples are not points in the plane, or not in order along a closed curve.
    """
    samples = finite(real_array(samples, "samples", (-1, 2), "points").astype(float), "samples")
    if samples.ndim != 2 or len(samples) < _FEWEST:
        raise ValueError(f"samples: shape {samples.shape}; expected (m, 2), at least {_FEWEST} points")
    _check_order(samples)
    size = float(np.ptp(samples, 0).max()) / 10
    normals, _ = _frames(samples, 3)
    tree = scipy.spatial.cKDTree(np.hstack([samples, size * normals]))
    places = shape.path + samples.mean(0) - shape.samples.mean(0)
    _, at = tree.query(np.hstack([places, size * shape.normals]))
    at = _in_order(at, len(samples))
    # The samples begin at the first node, wherever they began before: distances from chords need indices in order.
    samples, at = np.roll(samples, -at[0], 0), (at - at[0]) % len(samples)
    return _result(
        samples, at, samples[at], shape.motors, shape.curve, shape.n_components, False, Stability(0.0, 0.0, 1)
    )


def _check_order(samples: Reals) -> None:
    """Raise ValueError if most samples do not follow one of their nearest ones.

    Along a curve, the next sample is among the nearest two on its side, and among the nearest eight if spacings vary
    or other parts of the curve are near. In a random order, this happens to 8 of m samples.
    """
    count = len(samples)
    distance, _ = scipy.spatial.cKDTree(samples).query(samples, min(_NEAR, count - 1) + 1)
    step = np.linalg.norm(np.roll(samples, -1, 0) - samples, axis=1)
    followed = step <= distance[:, -1]
    if 2 * np.count_nonzero(followed) < count:
        raise ValueError(
            f"samples: {count - np.count_nonzero(followed)} of {count} points are not followed by a neighbour; "
            "expected points in order along a closed curve, such as Contour.samples"
        )


def _is_certain(found: Stability) -> bool:
    return found.mean <= _MEAN_SHIFT and found.largest <= _MOST and found.bodies == 1


def _reason(found: Stability) -> str:
    if found.bodies > 1:
        return f"the object has {found.bodies} bodies with a narrow neck; objects may touch"
    return (
        f"the boundary moves by {found.mean:.1f} pixels on average, {found.largest:.1f} at most, if its level changes "
        f"by a fifth of the contrast or the image is smoothed; expected {_MEAN_SHIFT:.1f} and {_MOST}"
    )


def _in_order(at: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """Return indices that increase cyclically, changed as little as a running maximum does."""
    start = int(at[0])
    relative = np.sort((at - start) % count)
    relative = np.maximum.accumulate(relative + np.arange(len(at))) - np.arange(len(at))
    unique = np.linspace(0, count, len(at), endpoint=False).astype(np.intp)
    doubled = len(np.unique(relative)) < len(relative)
    return (start + (unique if doubled else relative)) % count


def _contour_of(samples: Reals, nodes: int, tolerance: float, found: Object, certain: Stability) -> Contour:
    count = len(samples)
    at = np.unique(np.linspace(0, count, min(_FEWEST, count), endpoint=False).astype(np.intp))
    motors = np.tile([1.0, 0, 0, 0], (len(at), 1))
    curve = []
    while True:
        motors = _moved(motors, samples[at])
        errors, _, _ = _errors(samples, at, samples[at])
        curve.append((len(at), float(errors.mean()), float(errors.max())))
        new = _insertions(errors, at, tolerance, nodes - len(at))
        if not len(new):
            break
        # A new node inherits the motor of the node before it.
        where = np.searchsorted(at, new)
        motors = np.insert(motors, where, motors[where - 1], 0)
        at = np.insert(at, where, new)
    places = _relaxed(samples, at)
    return _result(samples, at, places, motors, np.array(curve), found.components, found.is_cut, certain)


def _insertions(errors: Reals, at: NDArray[np.intp], tolerance: float, room: int) -> NDArray[np.intp]:
    """Return the samples farthest from their chords, of the chords with the largest errors."""
    first = at[0]
    rolled = np.roll(errors, -first)
    starts = at - first
    worst = np.maximum.reduceat(rolled, starts)
    chords = np.flatnonzero(worst > max(tolerance, worst.max() / 2))
    chords = chords[np.argsort(-worst[chords])][: max(room, 0)]
    ends = np.append(starts[1:], len(errors))
    found = [(first + starts[c] + int(np.argmax(rolled[starts[c] : ends[c]]))) % len(errors) for c in chords]
    return np.setdiff1d(np.array(found, np.intp), at)


def _errors(samples: Reals, at: NDArray[np.intp], places: Reals) -> tuple[Reals, NDArray[np.intp], Reals]:
    """Return the distance of each sample from the chord of its two winners, the first of them, and the position."""
    n = len(at)
    first = (np.searchsorted(at, np.arange(len(samples)), side="right") - 1) % n
    square, position = shapes.distances_from_chords(samples, first, (first + 1) % n, places)
    return np.sqrt(square), first, position


def _relaxed(samples: Reals, at: NDArray[np.intp]) -> Reals:
    """Move nodes to reduce the squared distances of the samples, as long as the largest one does not grow."""
    places = samples[at].copy()
    n = len(at)
    errors, first, t = _errors(samples, at, places)
    for _ in range(_ADAPTATIONS):
        rest = samples - (1 - t)[:, None] * places[first] - t[:, None] * places[(first + 1) % n]
        shift, weight = np.zeros_like(places), np.full(n, 1e-9)
        for index, share in ((first, 1 - t), ((first + 1) % n, t)):
            np.add.at(shift, index, share[:, None] * rest)
            np.add.at(weight, index, share)
        moved = places + _RATE * shift / weight[:, None]
        found = _errors(samples, at, moved)
        if (found[0] ** 2).sum() >= (errors**2).sum() or found[0].max() > max(errors.max(), 1.0):
            break
        places, (errors, first, t) = moved, found
    return places


def _frames(points: Reals, reach: int = 1) -> tuple[Reals, Reals]:
    row = np.arange(len(points))
    found = shapes.circles_of_neighbours(points, (row - reach) % len(row), (row + reach) % len(row))
    return np.asarray(found[0]), np.asarray(found[1])


def _moved(motors: Reals, places: Reals) -> Reals:
    return np.asarray(shapes.moved_contour_nodes(motors, places, _frames(places)[0]))


def _result(
    samples: Reals, at: NDArray[np.intp], places: Reals, motors: Reals, curve: Reals, components: int, is_cut: bool,
    certain: Stability,
) -> Contour:  # fmt: skip
    errors, _, _ = _errors(samples, at, places)
    back, _ = scipy.spatial.cKDTree(dense(samples)).query(dense(places))
    mean, most = (float(errors.mean()), float(back.mean())), (float(errors.max()), float(back.max()))
    normals, curvatures = _frames(places)
    status = ContourStatus.OK
    if crosses(places):
        status = ContourStatus.CROSSING
    elif max(mean) > _MEAN or max(most) > _MOST:
        status = ContourStatus.TOO_FAR
    elif not _is_certain(certain):
        status = ContourStatus.UNCERTAIN
    elif is_cut:
        status = ContourStatus.TOUCHES_BORDER
    moved = np.asarray(shapes.moved_contour_nodes(motors, places, normals))
    return Contour(places, moved, normals, curvatures, samples, status, mean, most, curve, components, certain)


def dense(path: Reals, step: float = 0.25) -> Reals:
    """Return points on a closed path, at most a step apart."""
    after = np.roll(path, -1, 0)
    counts = np.maximum(1, np.ceil(np.linalg.norm(after - path, axis=1) / step)).astype(int)
    row = np.repeat(np.arange(len(path)), counts)
    t = (np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[row]
    return np.asarray(path[row] + t[:, None] * (after - path)[row])


def crosses(path: Reals) -> bool:
    """Whether two sides of a closed path that are not neighbours cross."""
    a, b = path, np.roll(path, -1, 0)

    def side(p: Reals, q: Reals, r: Reals) -> Reals:
        return np.asarray(
            np.sign(
                (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])
            )
        )

    one, two = side(a[:, None], b[:, None], a[None]), side(a[:, None], b[:, None], b[None])
    apart = one * two < 0
    return bool((apart & apart.T).any())
