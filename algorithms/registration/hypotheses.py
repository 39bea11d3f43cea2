"""Hypotheses of poses from all rotations and translations: correlation of densities, then descents in a batch."""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy

from generated import pga3
from generated import registration as kernels

from ..arguments import Reals
from .clouds import Cloud
from .weighted_matches import form_about_means

_CELLS, _EXTENT = 24, 5.0
"""Cells of the grid of densities along an axis, and its size as a multiple of the size of a cloud."""
_BATCH, _PEAKS, _KEPT = 50, 2, 150
"""Limits on work: rotations that are correlated at once, maxima of the correlation with each, and motions that are
returned."""
_SHARE = 2 / 3
"""Share of the points, those in the densest places, that are correlated."""
_POINTS, _TABLE = 200, 40
"""Limits on work: points that are compared with the target, and cells along the longest side of the table of
nearest points."""
_SCALES = np.geomspace(0.3, 0.05, 12)
"""Distances, relative to the size, at which neighbours lose three quarters of their weight."""


@cache
def rotation_grid(count: int = 1000) -> Reals:
    """Return rotors (count, 4) spread evenly over all rotations (Alexa, *Super-Fibonacci spirals*, CVPR 2022)."""
    along = np.arange(count) + 0.5
    inner, outer = np.sqrt(along / count), np.sqrt(1 - along / count)
    a, b = 2 * np.pi * along / np.sqrt(2), 2 * np.pi * along / 1.533751168755204288118041
    return np.stack([inner * np.sin(a), inner * np.cos(a), outer * np.sin(b), outer * np.cos(b)], 1)


def _motors(rotors: Reals, source_place: Reals, target_place: Reals) -> Reals:
    return np.asarray(kernels.motor_of_rotor(rotors, source_place, target_place))


def correlated_poses(source: Cloud, target: Cloud) -> Reals:
    """Return motors (k, 8) of the highest correlations of the densities of two clouds, over all motions.

    For each rotation of a grid, one Fourier transform gives the correlation for all translations.
    """
    middle, size = target.centre, min(source.size, target.size)
    cell = _EXTENT * size / _CELLS
    inside = np.floor((target.points - middle) / cell).astype(int) + _CELLS // 2
    kept = ((inside >= 0) & (inside < _CELLS)).all(1)
    density = np.zeros((_CELLS,) * 3, np.float32)
    np.add.at(density, tuple(inside[kept].T), target.weights[kept])
    density = scipy.ndimage.gaussian_filter(density, 1.0)
    density = np.minimum(density, np.quantile(density[density > 0.05 * density.max()], 0.6))
    spectrum = scipy.fft.rfftn(density - density.mean())
    dense = np.argsort(-source.weights, kind="stable")[: max(int(_SHARE * len(source.points)), 10)]
    centre = source.centre
    points, weights = source.points[dense] - centre, source.weights[dense]
    rotors = rotation_grid()
    scores, places, of = [], [], []
    # Cells repeat periodically, as in the Fourier transform.
    reach = int(np.sqrt((points**2).sum(1).max()) / cell) + 2
    wrapped = (np.arange(-reach, reach + 1) + _CELLS // 2) % _CELLS
    zero = np.zeros(3)
    for start in range(0, len(rotors), _BATCH):
        turned = pga3.move_point(_motors(rotors[start : start + _BATCH], zero, zero)[:, None], points)
        cells = wrapped[np.floor(turned * (1 / cell)).astype(np.int32) + reach]
        flat = (cells[..., 0] * _CELLS + cells[..., 1]) * _CELLS + cells[..., 2]
        flat += np.arange(len(turned))[:, None] * _CELLS**3
        count = len(turned) * _CELLS**3
        grid = np.bincount(flat.ravel(), np.broadcast_to(weights, flat.shape).ravel(), count).astype(np.float32)
        of_source = scipy.fft.rfftn(grid.reshape(-1, *density.shape), axes=(1, 2, 3))
        found = scipy.fft.irfftn(spectrum * np.conj(of_source), axes=(1, 2, 3)).reshape(len(turned), -1)
        row = np.arange(len(found))
        for _ in range(_PEAKS):  # two searches for a maximum are faster than a partition
            best = found.argmax(1)
            scores.append(found[row, best])
            places.append(best)
            of.append(start + row)
            found[row, best] = -np.inf
    order = np.argsort(-np.concatenate(scores))[:_KEPT]
    peak = np.stack(np.unravel_index(np.concatenate(places)[order], density.shape), 1)
    shift = np.where(peak >= _CELLS // 2, peak - _CELLS, peak) * cell
    return _motors(rotors[np.concatenate(of)[order]], centre, middle + shift)


def _nearest_table(target: Cloud) -> tuple[Reals, float, Reals, Reals]:
    """Return the corner, cell, shape and rows of a table of the nearest points of a cloud."""
    low, high = target.points.min(0) - 0.2 * target.size, target.points.max(0) + 0.2 * target.size
    cell = float((high - low).max()) / _TABLE
    shape = np.ceil((high - low) / cell).astype(int)
    axes = [low[k] + cell * (np.arange(shape[k]) + 0.5) for k in range(3)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    return low, cell, shape, target.tree.query(places)[1]


def descended(source: Cloud, target: Cloud, motors: Reals) -> tuple[Reals, Reals]:
    """Move all motors to local optima of the robust distance, as a batch, and return them with scores in [0, 1].

    Each step takes the common normal of the joint planes of the points and their current neighbours.
    """
    low, cell, shape, table = _nearest_table(target)
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    dense = np.argsort(-source.weights, kind="stable")[: max(int(_SHARE * len(source.points)), 10)]
    chosen = np.random.default_rng(0).permutation(dense)[:_POINTS]
    points, weights = source.points[chosen], source.weights[chosen]
    size = min(source.size, target.size)
    share = np.zeros(0)
    for scale in [*_SCALES, _SCALES[-1]]:
        moved = pga3.move_point(motors[:, None], points)
        cells = np.clip(((moved - low) / cell).astype(int), 0, shape - 1)
        rows = table[cells @ strides]
        near = target.points[rows]
        square = ((moved - near) ** 2).sum(-1)
        share = weights / (1 + square / (scale * size) ** 2) ** 2
        form, x, y = form_about_means(points, near, share * target.weights[rows])
        last, motors = motors, _motors(np.linalg.eigh(form)[1][:, :, 0], x, y)
    return last, share.sum(1) / weights.sum()
