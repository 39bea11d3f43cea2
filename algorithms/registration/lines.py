"""Registration of clouds on a line: shifts along it in both directions; rotations about it are free."""

from __future__ import annotations

import numpy as np
import scipy

from generated import pga3
from generated import registration as kernels

from ..arguments import Reals
from ..precision import NEGLIGIBLE
from .alignment import Found
from .clouds import cloud_of
from .refinement import Surface
from .rigid_status import RegistrationStatus

_CELLS = 2048
"""Cells along the line, over twice the length of both clouds."""
_POINTS_OF_BLUR = 12.0
"""Points of the smaller cloud within the standard deviation of a smoothed density."""
_LEAST_BLUR = 0.01
"""Least standard deviation of the smoothing, as part of the length."""
_NOISE = 0.3
"""Mean loss of support by the noise of two smoothed uniform densities, times the root of the points of a blur."""
_LEAST_SUPPORT = 0.5
"""Least support of a pose."""
_ALIKE = 3.0
"""Standard errors by which the supports of two poses may differ."""
_PEAK = 2.0
"""Least distance of two peaks, in standard deviations of the smoothed density."""
_ENDS = 6
"""Points at each end whose mean places are compared."""
_PLATEAU = 6.0
"""Length, in standard deviations of the smoothed density, over which equal supports make shifts free."""


def line_registered(source_points: Reals, target_points: Reals) -> Found:
    """Register two clouds of a line in own units.

    The support of a pose is the integral of the smaller one of the two densities along the line.
    """
    mine, my_frame = _along(source_points)
    other, its_frame = _along(target_points)
    length = max(np.ptp(mine), np.ptp(other))
    fewest = min(len(mine), len(other))
    points = max(_POINTS_OF_BLUR, _LEAST_BLUR * fewest)
    blur = length * points / fewest
    cell = 4 * length / _CELLS
    poses = []
    for side in (1.0, -1.0):
        scores, shifts = _supports(side * mine, other, blur, cell)
        poses.append((side, scores, shifts))
    most = max(float(scores.max()) for _, scores, _ in poses)
    # The smaller of two noisy densities is below both, except if the clouds contain the same points.
    level = min(most, 1 - _NOISE / np.sqrt(points))
    bound = level - _ALIKE * np.sqrt(most / fewest)
    wide = max(3, round(2 * _PEAK * blur / cell) | 1)
    sides, found, free_shift = [], [], False
    for side, scores, shifts in poses:
        peaks = np.flatnonzero((scores >= bound) & (scores == scipy.ndimage.maximum_filter1d(scores, wide)))
        if not len(peaks):
            continue
        # A shift by a part of the length leaves at least that part of a cloud without partners.
        equal = shifts[scores >= bound]
        free_shift |= bool(np.ptp(equal) > _PLATEAU * blur + 2 * max(most - bound, 0) * length)
        best = peaks[[int(np.argmax(scores[peaks]))]] if free_shift else peaks
        sides += [side] * len(best)
        found += [_sharpened(side * mine, other, float(shifts[k]), blur) for k in best]
    scores = np.array(
        [_support_at(side * mine, other, shift, blur, cell) for side, shift in zip(sides, found, strict=True)]
    )
    order = np.argsort(-scores, kind="stable")
    motors = np.stack([_motor(my_frame, its_frame, sides[k], found[k]) for k in order])
    direction = np.asarray(pga3.move_direction(its_frame, np.eye(3)[0]))
    turn = np.asarray(kernels.turn_about_line(pga3.move_point(its_frame, np.zeros(3)), direction))
    slide = np.asarray(pga3.move_line(its_frame, np.eye(6)[3]))
    free = np.stack([turn, slide]) if free_shift else turn[None]
    free /= np.linalg.norm(free, axis=1, keepdims=True)
    cloud = cloud_of(target_points)
    n = len(target_points)
    surface = Surface(cloud, np.tile(direction, (n, 1)), np.ones(n), -np.ones(n))
    gate = max(4 * cloud.spacing, 2 * length / fewest)
    moved = np.asarray(pga3.move_point(motors[0], source_points))
    rows = cloud.tree.query(moved)[1]
    off = moved - cloud.points[rows]
    off -= (off @ direction)[:, None] * direction
    residual = float(np.sqrt((off**2).sum(1).mean()))
    back = cloud_of(moved).tree.query(target_points)[0]
    status = RegistrationStatus.FREE_MOTION if most >= _LEAST_SUPPORT else RegistrationStatus.NO_SUPPORT
    lowest = np.minimum(*(scores.min() for _, scores, _ in poses))
    return Found(
        status, motors, scores[order], _covariance(its_frame, free_shift, residual, length, fewest), residual,
        float((back <= gate).mean()), float(1 - lowest / max(most, NEGLIGIBLE)), free, surface, gate,
    )  # fmt: skip


def _along(points: Reals) -> tuple[Reals, Reals]:
    """Return places along the line through points, and the motor from the first axis to this line."""
    centre = points.mean(0)
    axes = np.linalg.svd(points - centre, full_matrices=False)[2]
    axes[2] = np.cross(axes[0], axes[1])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes.T, centre
    return (points - centre) @ axes[0], np.asarray(pga3.motor_from_matrix(matrix))


def _density(places: Reals, blur: float, cell: float) -> Reals:
    rows = np.floor(places / cell).astype(int) + _CELLS // 2
    counts = np.bincount(np.clip(rows, 0, _CELLS - 1), minlength=_CELLS) / len(places)
    return np.asarray(scipy.ndimage.gaussian_filter1d(counts, blur / cell, mode="constant"))


def _supports(mine: Reals, other: Reals, blur: float, cell: float) -> tuple[Reals, Reals]:
    """Return the common part of two densities for all shifts."""
    one, two = _density(mine, blur, cell), _density(other, blur, cell)
    cells = np.arange(-_CELLS // 2, _CELLS // 2)
    table = np.zeros((len(cells), _CELLS))
    padded = np.concatenate([np.zeros(_CELLS // 2), one, np.zeros(_CELLS // 2)])
    windows = np.lib.stride_tricks.sliding_window_view(padded, _CELLS)[:_CELLS]
    np.minimum(windows[::-1], two, out=table[: len(windows)])
    return table.sum(1), (cells + 1) * cell


def _support_at(mine: Reals, other: Reals, shift: float, blur: float, cell: float) -> float:
    return float(np.minimum(_density(mine + shift, blur, cell), _density(other, blur, cell)).sum())


def _sharpened(mine: Reals, other: Reals, shift: float, blur: float) -> float:
    """Return a shift improved by the ends of both clouds, or by their common points."""
    mine, other = np.sort(mine), np.sort(other)
    few = min(_ENDS, len(mine) // 4, len(other) // 4)
    first, last = other[:few].mean() - mine[:few].mean(), other[-few:].mean() - mine[-few:].mean()
    if abs(first - last) < blur and abs((first + last) / 2 - shift) < 2 * blur:
        shift = float(first + last) / 2
    spacing = np.ptp(other) / len(other)
    for gate in (blur, blur / 2, spacing, spacing, spacing / 2, spacing / 2):
        right = np.clip(np.searchsorted(other, mine + shift), 1, len(other) - 1)
        left = other[right - 1] - mine - shift
        off = np.where(np.abs(left) < np.abs(other[right] - mine - shift), left, other[right] - mine - shift)
        near = np.abs(off) < gate
        if near.any() and np.median(np.abs(off)) < 0.1 * spacing:
            shift += float(np.median(off[near]))
    return shift


def _motor(here: Reals, there: Reals, side: float, shift: float) -> Reals:
    matrix = np.diag([side, side, 1.0, 1.0])
    matrix[0, 3] = shift
    inner = pga3.motor_from_matrix(matrix)
    return np.asarray(pga3.motor_product(there, pga3.motor_product(inner, pga3.motor_inverse(here))))


def _covariance(frame: Reals, free_shift: bool, residual: float, length: float, count: int) -> Reals:
    """Return the covariance in the frame of the line, large for free motions."""
    across = max(residual, 1e-12) ** 2 / count
    turned = across * 12 / length**2
    free = 1e12 * max(across, turned)
    along = free if free_shift else (length / count) ** 2
    own = np.diag([turned, turned, free, along, across, across])
    moves = np.asarray(pga3.move_line(frame, np.eye(6))).T
    return np.asarray(moves @ own @ moves.T)
