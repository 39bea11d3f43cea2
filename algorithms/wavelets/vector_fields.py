"""Vector fields: divergence and curl by one mask, and detection of templates in any position and rotation."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product as every
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import vga2, vga3

from ..arguments import Reals, positive_number, real_array, whole_number
from ..scaling import in_range
from .checks import TRUNCATE
from .convolution import clifford_convolve, clifford_correlate
from .discrete import check_finite

_PRODUCTS: dict[int, Callable[..., Any]] = {2: vga2.vector_product, 3: vga3.vector_product}
_ROTATIONS: dict[int, Callable[..., Any]] = {2: vga2.rotate_vector, 3: vga3.rotate_vector}
_STEPS = 100
"""A limit on work: the number of steps of a refinement,"""
_CANDIDATES = 8
"""Number of rotations with the best scores that are refined by a few steps each, before the best one is refined."""
_FIRST_STEPS = 4
"""and of steps before candidates are compared."""
_MOVES = 3
"""Number of times that the position may move to a neighbour while the rotation is refined."""
_LARGEST_STEP = 0.3
"""A limit on work: the largest angle of a step, in rad, for which fields are nearly linear."""
_ORDER = 5
"""The order of splines between samples."""
_INITIAL = 12
"""Number of initial rotations of a template in the plane, 30 degrees apart."""
_SMALL = 1e-4
"""Angle in radians for finite differences with respect to the rotation."""
_WORDS = ("values", "whole")

Rotation = Callable[[Reals], Reals]
"""Function that rotates the template by a rotor."""


class Match(NamedTuple):
    """A position of a template in a field.

    Attributes
    ----------
    place : tuple of int
        The position of the template's centre, ``(n - 1) // 2`` along each axis.
    rotor : array, (2,) or (4,)
        The rotation of the template: 1 e12, or 1 e12 e13 e23.
    similarity : float
        The cosine between the rotated template and the field at this position, at most 1.
    """

    place: tuple[int, ...]
    rotor: Reals
    similarity: float


def derivative_mask(dimension: int, sigma: float = 1.0, truncate: float = TRUNCATE) -> Reals:
    """Return the vector derivative of a Gaussian, as a mask of vectors for `clifford_convolve`.

    Parameters
    ----------
    dimension : int
        2 or 3.
    sigma : float
        Standard deviation of the Gaussian, in pixels.
    truncate : float
        Truncation of the mask in standard deviations, rounded up to a pixel. For waves of up to 1 / sigma radians per
        pixel, and sigma from 1 to 4, derivatives agree with those of the whole Gaussian to 1e-3 for 4, and 1e-6 for
        5.5.

    Returns
    -------
    array, (n, ..., n, dimension)
        With n = 2 ceil(truncate sigma) + 1. Derivatives of linear fields are exact.

    Raises
    ------
    TypeError, ValueError
        If `dimension` is not 2 or 3, or if `sigma` or `truncate` is not positive.
    """
    if whole_number(dimension, "dimension") not in _PRODUCTS:
        raise ValueError(f"dimension: {dimension!r}; expected 2 or 3")
    width = positive_number(sigma, "sigma")
    reach = int(np.ceil(positive_number(truncate, "truncate") * width))
    x = np.arange(-reach, reach + 1.0)
    g = np.exp(-(x**2) / (2 * width**2))
    g /= g.sum()
    derivative = -x * g / (x**2 * g).sum()
    mask = np.empty((*(x.size,) * dimension, dimension))
    for k in range(dimension):
        lines = [derivative if k == n else g for n in range(dimension)]
        mask[..., k] = np.einsum("a,b->ab" if dimension == 2 else "a,b,c->abc", *lines)
    return mask


def divergence_and_curl(
    field: ArrayLike,
    sigma: float = 1.0,
    mode: str = "same",
    workers: int | None = None,
    truncate: float = TRUNCATE,
) -> Reals:
    """Compute the divergence and the curl of a smoothed vector field: the two parts of its vector derivative.

    Parameters
    ----------
    field : array_like, (M, N, 2) or (L, M, N, 3)
        Vectors; e1 points along the first axis.
    sigma : float
        Standard deviation of the Gaussian used for smoothing, in pixels.
    mode : str
        "same", with zeros outside, or "wrap" for periodic fields.
    workers : int, optional
        As in `scipy.fft`.
    truncate : float
        As in `derivative_mask`.

    Returns
    -------
    array, (M, N, 2) or (L, M, N, 4)
        Coefficients 1 e12, or 1 e12 e13 e23, for each pixel, per pixel: the divergence and the curl.

    Raises
    ------
    TypeError, ValueError
        If `field` does not have this form or is not finite, or if an option is unknown.
    """
    array, dimension = _vectors(field, "field")
    if mode not in ("same", "wrap"):
        raise ValueError(f"mode: {mode!r}; expected 'same' or 'wrap'")
    mask = derivative_mask(dimension, sigma, truncate).astype(array.dtype)
    reach = mask.shape[0] // 2
    if mode == "wrap":
        array = np.pad(array, [(reach, reach)] * dimension + [(0, 0)], "wrap")
    result = clifford_convolve(array, mask, _PRODUCTS[dimension], "same", "left", workers=workers)
    if mode == "wrap":
        inside = (slice(reach, -reach),) * dimension
        result = np.ascontiguousarray(result[inside])
    return result


def match_template(
    field: ArrayLike, template: ArrayLike, turned: str = "whole", count: int = 1, workers: int | None = None
) -> list[Match]:
    """Find a template of vectors in a vector field, in any position and rotation.

    Parameters
    ----------
    field : array_like, (M, N, 2) or (L, M, N, 3)
        Vectors; e1 points along the first axis.
    template : array_like, (m, n, 2) or (l, m, n, 3)
        Template of odd sizes, at most those of the field.
    turned : str
        "values": each vector is rotated in place. "whole": positions are rotated too, about the centre; only pixels
        within the largest ball inside the template are used.
    count : int
        Number of positions, at least half a template apart, best first.
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    list of Match

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real numbers of these shapes, if the template is 0 or does not fit, or if an option
        is unknown.

    Notes
    -----
    The sum of the geometric products of the field with the template has a scalar part, which measures agreement, and a
    bivector part, which describes the rotation of the field relative to the template (Ebling and Scheuermann, *IEEE
    Trans. Visualization and Computer Graphics* 11:469, 2005). Values rotated in the plane are found by one correlation;
    in space, the rotor that makes the bivector part vanish is found by iteration (Bujack et al., *Adv. Appl. Clifford
    Algebras* 24:395, 2014). With "whole", templates in 12 or 24 rotations are correlated, and the best ones are refined
    by least squares; for smooth templates of 15 pixels, angles are found to 1.5e-3 radians.
    """
    if turned not in _WORDS:
        raise ValueError(f"turned: {turned!r}; expected 'values' or 'whole'")
    values, dimension = _vectors(field, "field")
    mask, own = _vectors(template, "template")
    if own != dimension or any(n % 2 == 0 or n > m for n, m in zip(mask.shape[:-1], values.shape[:-1], strict=False)):
        raise ValueError(
            f"template: shape {mask.shape} for a field of shape {values.shape}; expected odd sizes that fit into it"
        )
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1:
        raise ValueError(f"count: {count!r}; expected a whole number, 1 or more")
    values, mask = (in_range(each, tuple(range(each.ndim)))[0] for each in (values, mask))
    mask = mask.astype(values.dtype)
    window = _ball(mask.shape[:-1]) if turned == "whole" else np.ones(mask.shape[:-1])
    rotated = _rotation_of(mask, turned, window)
    search = _Search(values, window, rotated, _by_correlation if turned == "values" else _by_least_squares)
    rotors = _initial_rotors(dimension, turned)
    scores = search.scores(rotors, turned, workers)
    half = [n // 2 for n in window.shape]
    matches: list[Match] = []
    while len(matches) < count and np.isfinite(scores.max()):
        middle = np.unravel_index(scores.max(0).argmax(), scores.shape[1:])
        near = tuple(slice(max(int(k) - n, 0), int(k) + n + 1) for k, n in zip(middle, half, strict=True))
        around = scores[(slice(None), *near)]
        best = np.argsort(around.reshape(len(rotors), -1).max(1))[: -_CANDIDATES - 1 : -1]
        candidates = []
        for which in best:
            offset = np.unravel_index(around[which].argmax(), around.shape[1:])
            corner = [int(k) + piece.start for k, piece in zip(offset, near, strict=True)]
            candidates.append(search.refined(corner, rotors[which]))
        _, corner, rotor = max(candidates, key=lambda each: each[0])
        rotor = search.improved(corner, rotor, _STEPS)
        place = tuple(k + n for k, n in zip(corner, half, strict=True))
        matches.append(Match(place, rotor, search.similarity(corner, rotor)))
        around[:] = -np.inf
    return matches


class _Search(NamedTuple):
    """A field, the pixels of a template that are used, its rotation, and a method that improves rotors."""

    values: Reals
    window: Reals
    rotated: Rotation
    improve: Callable[[Rotation, Reals, Reals, int], Reals]

    def scores(self, rotors: Reals, turned: str, workers: int | None) -> Reals:
        """Return the agreement of the field with the template in each rotation at each position."""
        energy = clifford_correlate(
            (self.values**2).sum(-1, keepdims=True),
            self.window[..., None],
            lambda a, b: a * b,
            "valid",
            workers=workers,
        )[..., 0]
        # In empty regions, rounding errors would agree with anything.
        kind = np.finfo(self.values.dtype)
        energy = np.maximum(energy, kind.eps * energy.max() + kind.tiny)
        scores = np.empty((len(rotors), *energy.shape))
        for k, rotor in enumerate(rotors):
            piece = self.rotated(rotor)
            size = float((piece**2).sum())
            if size == 0:
                raise ValueError("template: all vectors are 0; expected some that are not")
            found = clifford_correlate(self.values, piece, _PRODUCTS[self.window.ndim], "valid", workers=workers)
            # The magnitude of the product does not depend on a rotation of values; the bivector part gives the angle.
            agreement = np.sqrt((found**2).sum(-1)) if turned == "values" else found[..., 0]
            scores[k] = agreement / np.sqrt(size * energy)
        return scores

    def improved(self, corner: list[int], rotor: Reals, steps: int) -> Reals:
        """Return a rotor for the template at a corner after some steps."""
        return self.improve(self.rotated, _window(self.values, corner, self.window), rotor, steps)

    def similarity(self, corner: list[int], rotor: Reals) -> float:
        """Return the cosine between the field and the rotated template at a corner."""
        return _cosine(_window(self.values, corner, self.window), self.rotated(rotor))

    def refined(self, corner: list[int], rotor: Reals) -> tuple[float, list[int], Reals]:
        """Return similarity, corner and rotor after a few steps, in which the corner may move to neighbours."""
        for _ in range(_MOVES):
            rotor = self.improved(corner, rotor, _FIRST_STEPS)
            moved = _moved(self.values, corner, self.rotated(rotor), self.window)
            if moved == corner:
                break
            corner = moved
        return self.similarity(corner, rotor), corner, rotor


def _window(values: Reals, corner: list[int], window: Reals) -> Reals:
    inside = tuple(slice(k, k + n) for k, n in zip(corner, window.shape, strict=True))
    return np.asarray(values[inside] * window[..., None].astype(values.dtype))


def _moved(values: Reals, corner: list[int], piece: Reals, window: Reals) -> list[int]:
    """Return the corner, or its neighbour, at which the field is most similar to a rotated template."""
    near = [
        [k + step for step in (-1, 0, 1) if 0 <= k + step <= m - n]
        for k, m, n in zip(corner, values.shape, window.shape, strict=False)
    ]
    return list(max(every(*near), key=lambda each: _cosine(_window(values, list(each), window), piece)))


def _cosine(a: Reals, b: Reals) -> float:
    sizes = float(np.sqrt((a**2).sum() * (b**2).sum()))
    return float((a * b).sum()) / sizes if sizes else 0.0


def _by_correlation(rotated: Rotation, there: Reals, rotor: Reals, steps: int) -> Reals:
    """Return the rotor for which the products of the field with the rotated template sum to a scalar."""
    dimension = there.shape[-1]
    for _ in range(steps):
        total = _PRODUCTS[dimension](there, rotated(rotor)).sum(tuple(range(dimension)))
        size = np.linalg.norm(total)
        if size == 0 or (np.abs(total[1:]).max() <= 4 * np.finfo(total.dtype).eps * size and total[0] > 0):
            break
        # field template = |.| (cosine + sine B): the rotor has half of that angle.
        half = total / size
        half[0] += 1
        length = np.linalg.norm(half)
        # For an angle of pi the plane is undetermined, and any plane serves to leave this point.
        half = half / length if length > 1e-8 else np.eye(len(total))[1]
        rotor = _composed(half, rotor)
    return rotor


def _by_least_squares(rotated: Rotation, there: Reals, rotor: Reals, steps: int) -> Reals:
    """Return the rotor of the rotated and scaled template that is nearest to the field."""
    planes = len(rotor) - 1
    last = np.inf
    for _ in range(steps):
        pieces = [rotated(rotor)]
        for k in range(planes):
            forth, back = (rotated(_composed(_small(planes, k, sign * _SMALL), rotor)) for sign in (1, -1))
            pieces.append((forth - back) / (2 * _SMALL))
        matrix = np.stack([piece.ravel() for piece in pieces], 1).astype(float)
        solution = np.linalg.lstsq(matrix, there.ravel().astype(float), rcond=None)[0]
        angles = solution[1:] / solution[0] if solution[0] > 0 else np.zeros(planes)
        size = float(np.linalg.norm(angles))
        if size < 1e-9 or size > 2 * last:
            break
        # Limit the step far from the solution.
        last = min(size, _LARGEST_STEP)
        for k in range(planes):
            rotor = _composed(_small(planes, k, float(angles[k]) * last / size), rotor)
    return rotor


def _small(planes: int, k: int, angle: float) -> Reals:
    rotor = np.zeros(planes + 1)
    rotor[0], rotor[1 + k] = np.cos(angle / 2), -np.sin(angle / 2)
    return rotor


def _composed(second: Reals, first: Reals) -> Reals:
    """Return the composition of two rotors in the precision of the first one."""
    kernel = vga2.rotor_product if len(first) == 2 else vga3.rotor_product
    product = kernel(second.astype(first.dtype), first)
    return np.asarray(product / np.linalg.norm(product), first.dtype)


def _rotation_of(mask: Reals, how: str, window: Reals) -> Rotation:
    """Return a function that computes ``R m(~R x R) ~R`` in the window by splines, or rotates only the values."""
    rotate = _ROTATIONS[mask.shape[-1]]
    if how == "values":
        return lambda rotor: np.asarray(rotate(rotor.astype(mask.dtype), mask))
    middle = np.array([(n - 1) / 2 for n in mask.shape[:-1]])
    places = np.moveaxis(np.indices(mask.shape[:-1]), 0, -1) - middle
    inside = window > 0
    splines = [scipy.ndimage.spline_filter(mask[..., k], _ORDER, float) for k in range(mask.shape[-1])]

    def rotated(rotor: Reals) -> Reals:
        back = rotor * np.array([1.0, *(-1.0,) * (len(rotor) - 1)])
        there = (rotate(back, places[inside]) + middle).T
        parts = [
            scipy.ndimage.map_coordinates(spline, there, order=_ORDER, mode="mirror", prefilter=False)
            for spline in splines
        ]
        result = np.zeros(mask.shape, mask.dtype)
        result[inside] = rotate(rotor, np.stack(parts, -1))
        return result

    return rotated


def _ball(shape: tuple[int, ...]) -> Reals:
    """Return 1 inside the largest ball that fits, 0 outside."""
    places = np.indices(shape) - np.array([(n - 1) / 2 for n in shape]).reshape(-1, *(1,) * len(shape))
    return np.asarray((np.sqrt((places**2).sum(0)) <= (min(shape) - 1) / 2 + 1e-9) * 1.0)


def _initial_rotors(dimension: int, turned: str) -> Reals:
    if dimension == 2:
        count = 1 if turned == "values" else _INITIAL
        return np.asarray(vga2.rotor_from_angle(np.arange(count) * 2 * np.pi / count))
    halves = np.eye(4)
    if turned == "values":
        return halves
    quarter = np.sqrt(0.5)
    # The 24 rotations of a cube: four by pi, times those by 2 pi / 3 about a diagonal, and by pi / 2.
    thirds = np.array([[1, 0, 0, 0], [0.5, 0.5, 0.5, 0.5], [0.5, -0.5, -0.5, -0.5]])
    quarters = np.array([[1, 0, 0, 0], [quarter, quarter, 0, 0]])
    group = vga3.rotor_product(vga3.rotor_product(halves[:, None, None], thirds[:, None]), quarters)
    return np.asarray(group.reshape(-1, 4))


def _vectors(value: ArrayLike, name: str) -> tuple[Reals, int]:
    array = real_array(value, name, (-1, -1, -1), "vector fields M N 2 or L M N 3")
    dimension = array.shape[-1]
    if dimension not in _PRODUCTS or array.ndim != dimension + 1:
        raise ValueError(f"{name}: shape {array.shape}; expected a vector field M N 2 or L M N 3")
    check_finite(array, name)
    return array, dimension
