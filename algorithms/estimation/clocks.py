"""The offset between the clocks of two devices on one rigid body, from the poses that both record.

The angular velocities of the devices, each in its own frame, differ only by a constant rotation. The offset is the one
at which their correlation is largest, for the best rotation: the sum of the singular values of a 3 x 3 matrix.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from ..evidence import Status
from ..precision import TINY

_FEWEST = 8
"""The smallest number of usable poses of a stream."""
_STILL = 1e-6
"""Root mean squares of angular velocities below this, in radians per second, are rounding errors."""
_OVERLAP = 0.25
"""Offsets at which the streams share less than this part of the motion of either are not considered."""
_RELATED = 0.5
"""Streams with a smaller correlation do not belong to one rigid body."""
_SAME = 0.99
"""A second maximum of the correlation that reaches this part of the first makes the offset ambiguous."""
_GAP = 5.0
"""Gaps longer than the window, and than this multiple of the usual step, are not interpolated."""


class ClockStatus(Status):
    """Whether two streams of poses determine the offset of their clocks."""

    OK = 0
    TOO_FEW = 1
    """A stream has fewer than eight usable poses, or is shorter than two windows."""
    NO_MOTION = 2
    """A stream does not rotate."""
    UNRELATED = 3
    """The correlation of the angular velocities is below 0.5 for all offsets."""
    AMBIGUOUS = 4
    """Different offsets fit equally well, as for a periodic or uniform motion."""


@dataclass(frozen=True, slots=True, eq=False)
class ClockOffset:
    """Result of `clock_offset`."""

    offset: float
    """The time of clock a minus that of clock b at the same instant, in seconds; 0 if there is none."""
    status: ClockStatus
    correlation: float
    """The correlation of the angular velocities at the offset, from 0 to 1."""
    deviation: float
    """The standard deviation of the offset, in seconds, estimated from the residual; infinite if there is none."""
    rotor: Reals
    """(4,) The rotor of `generated.pga3` from directions in frame b to frame a."""
    n_skipped: tuple[int, int]
    """How many poses of each stream were not used, because they are not finite or repeat a time stamp."""


@dataclass(frozen=True, slots=True, eq=False)
class _Stream:
    times: Reals
    motors: Reals
    skipped: int

    @property
    def step(self) -> float:
        return float(np.median(np.diff(self.times)))


def clock_offset(
    times_a: ArrayLike, a: ArrayLike, times_b: ArrayLike, b: ArrayLike, window: float = 0.6, largest: float = np.inf
) -> ClockOffset:
    """Estimate the offset between the clocks of two streams of poses of devices on one rigid body.

    A pose of b with the time stamp t was taken when the clock of a showed ``t + offset``. The poses need not be taken
    at the same times, nor need the transformation between the devices be known. Time stamps are sorted first, and of
    equal ones the first pose is used.

    Parameters
    ----------
    times_a, times_b : array_like, (n,) and (m,)
        Time stamps in seconds.
    a, b : array_like, (n, 8) and (m, 8)
        Unit motors from the frame of each device to a fixed frame of its own: a hand in its base, and a camera in its
        target.
    window : float, optional
        Angular velocities are differences over this time, in seconds. It is a compromise between noise and resolution.
    largest : float, optional
        The largest absolute value of the offset.

    Returns
    -------
    ClockOffset

    Raises
    ------
    TypeError, ValueError
        If arguments have different lengths, or shapes and types that are not those of poses, or if `window` or
        `largest` is not positive.

    Notes
    -----
    The maximum is located on a grid by fast Fourier transforms of all nine products of components, and then refined by
    Brent's method with interpolated poses.
    """
    if not window > 0 or not largest > 0:
        raise ValueError(f"window {window}, largest {largest}: expected positive numbers of seconds")
    one, two = _stream(times_a, a, "a"), _stream(times_b, b, "b")
    skipped = one.skipped, two.skipped

    def nothing(status: ClockStatus) -> ClockOffset:
        return ClockOffset(0.0, status, 0.0, np.inf, np.eye(4)[0], skipped)

    if min(len(one.times), len(two.times)) < _FEWEST:
        return nothing(ClockStatus.TOO_FEW)
    if min(float(np.ptp(each.times)) for each in (one, two)) < 2 * window:
        return nothing(ClockStatus.TOO_FEW)
    step = max(min(one.step, two.step), min(float(np.ptp(each.times)) for each in (one, two)) / 2**17)
    grids = [np.arange(each.times[0] + window / 2, each.times[-1] - window / 2, step) for each in (one, two)]
    rates = [_rates(stream, grid, window) for stream, grid in zip((one, two), grids, strict=True)]
    if min(float(np.sqrt(np.mean(each**2))) for each in rates) < _STILL:
        return nothing(ClockStatus.NO_MOTION)
    lags, scores = _correlation(*rates)
    offsets = lags * step + grids[0][0] - grids[1][0]
    scores = np.where(np.abs(offsets) <= largest, scores, -np.inf)
    best = int(np.argmax(scores))
    if scores[best] < _RELATED:
        return nothing(ClockStatus.UNRELATED)
    longest = max(float(np.ptp(grid)) for grid in grids)
    status = ClockStatus.AMBIGUOUS if _is_ambiguous(scores, best, step, longest) else ClockStatus.OK
    offset = float(np.clip(_refined(one, grids[1], rates[1], float(offsets[best]), step, window), -largest, largest))
    moved = _rates(one, grids[1] + offset, window)
    correlation, rotation = _alignment(moved, rates[1])
    deviation = _deviation(moved, rates[1], rotation, step, window)
    rotor = np.asarray(pga3.rotor_from_matrix(rotation))
    return ClockOffset(offset, status, float(correlation), deviation, rotor, skipped)


def _is_ambiguous(scores: Reals, best: int, step: float, longest: float) -> bool:
    """Return whether other offsets fit as well: those of another maximum, or of a wide one."""
    left, right = _hill(scores, best)
    same = _SAME * scores[best]
    rest = np.concatenate([scores[:left], scores[right:]])
    if rest.size and rest.max() >= same:
        return True
    is_wide = (right - left) * step > 0.5 * longest
    return bool(is_wide and (scores[left] > same or scores[right - 1] > same))


def _refined(stream: _Stream, at: Reals, fixed: Reals, offset: float, step: float, window: float) -> float:
    """Return the offset near another at which the rates of a stream are most like `fixed`, those of the other."""

    def misfit(change: float) -> float:
        return -_alignment(_rates(stream, at + offset + change, window), fixed)[0]

    reach = max(2 * step, 0.05 * window)
    found = scipy.optimize.minimize_scalar(
        misfit, bounds=(-reach, reach), method="bounded", options={"xatol": 1e-3 * step}
    )
    return offset + float(found.x)


def poses_at(times: ArrayLike, motors: ArrayLike, at: ArrayLike, largest_gap: float = np.inf) -> Reals:
    """Interpolate a stream of poses by screw motions.

    Parameters
    ----------
    times : array_like, (n,)
        Time stamps in any order. Poses that are not finite or repeat a time stamp are left out.
    motors : array_like, (n, 8)
    at : array_like, (m,)
        The times of the results.
    largest_gap : float, optional
        The largest time between two poses that are interpolated.

    Returns
    -------
    array, (m, 8)
        NaN before the first and after the last pose, in gaps, and where fewer than two poses are usable.

    Raises
    ------
    TypeError, ValueError
        If the shapes or types of arguments are not those of poses.
    """
    stream = _stream(times, motors, "motors")
    wanted = real_array(at, "at", (-1,), "times").astype(np.float64)
    if len(stream.times) < 2:
        return np.full((len(wanted), 8), np.nan)
    return _at(stream, wanted, largest_gap)


def _stream(times: ArrayLike, motors: ArrayLike, name: str) -> _Stream:
    stamps = real_array(times, f"times of {name}", (-1,), "times").astype(np.float64)
    poses = real_array(motors, name, (-1, 8), "motors").astype(np.float64)
    if stamps.ndim != 1 or poses.ndim != 2 or len(stamps) != len(poses):
        raise ValueError(f"{name}: {poses.shape} motors and {stamps.shape} times; expected (n, 8) and (n,)")
    usable = np.isfinite(stamps) & np.isfinite(poses).all(-1)
    stamps_usable, poses_usable = stamps[usable], poses[usable]
    stamps_usable, first = np.unique(stamps_usable, return_index=True)
    return _Stream(stamps_usable, poses_usable[first], len(stamps) - len(first))


def _at(stream: _Stream, at: Reals, largest_gap: float) -> Reals:
    times = stream.times
    row = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    step = times[row + 1] - times[row]
    share = (at - times[row]) / step
    found = np.asarray(pga3.interpolate_motors(stream.motors[row], stream.motors[row + 1], share))
    found[~((share >= 0) & (share <= 1) & (step <= largest_gap))] = np.nan
    return found


def _rates(stream: _Stream, at: Reals, window: float) -> Reals:
    """Return mean angular velocities (n, 3) over windows, in the frame of the device; 0 where they are unknown."""
    gap = max(window, _GAP * stream.step)
    before, after = (_at(stream, at + sign * window / 2, gap) for sign in (-1, 1))
    twists = pga3.motor_to_twist(pga3.motor_product(pga3.motor_inverse(before), after))
    return np.asarray(np.nan_to_num(pga3.twist_to_velocities(twists)[0] / window))


def _correlation(a: Reals, b: Reals) -> tuple[Reals, Reals]:
    """Return lags and the correlations (k,) of ``a[i + lag]`` with ``b[i]`` for the best rotations."""
    size = scipy.fft.next_fast_len(len(a) + len(b), real=True)

    def products(p: Reals, q: Reals) -> Reals:
        spectra = np.fft.rfft(p, size, axis=0)[:, :, None] * np.fft.rfft(q, size, axis=0)[:, None, :].conj()
        return np.asarray(np.fft.irfft(spectra, size, axis=0))

    squares_a, squares_b = (a**2).sum(-1, keepdims=True), (b**2).sum(-1, keepdims=True)
    # The energy of each stream while the other is known too.
    energy_a = products(squares_a, (squares_b > 0).astype(float))[:, 0, 0]
    energy_b = products((squares_a > 0).astype(float), squares_b)[:, 0, 0]
    enough = (energy_a > _OVERLAP * squares_a.sum()) & (energy_b > _OVERLAP * squares_b.sum())
    found = _alignments(products(a, b))
    scale = np.sqrt(np.maximum(energy_a * energy_b, TINY))
    scores = np.where(enough, found / scale, -np.inf)
    lags = np.arange(size)
    lags = np.where(lags >= len(a), lags - size, lags)
    order = np.argsort(lags)
    return lags[order], scores[order]


def _alignments(tables: Reals) -> Reals:
    """Return the largest traces of the products of matrices (k, 3, 3) with rotations."""
    values = np.linalg.svd(tables, compute_uv=False)
    return np.asarray(values[:, 0] + values[:, 1] + np.sign(np.linalg.det(tables)) * values[:, 2])


def _alignment(a: Reals, b: Reals) -> tuple[float, Reals]:
    """Return the correlation of vectors (n, 3) for the best rotation from b to a, and the rotation."""
    left, values, right = np.linalg.svd(a.T @ b)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    known = (a**2).any(-1) & (b**2).any(-1)
    size = np.sqrt((a[known] ** 2).sum() * (b[known] ** 2).sum())
    return float((signs * values).sum() / max(size, TINY)), np.asarray(left * signs @ right)


def _hill(scores: Reals, best: int) -> tuple[int, int]:
    """Return the range of indices around a maximum within which scores decrease monotonically."""
    left = right = best
    while left > 0 and scores[left - 1] <= scores[left] and np.isfinite(scores[left - 1]):
        left -= 1
    while right + 1 < len(scores) and scores[right + 1] <= scores[right] and np.isfinite(scores[right + 1]):
        right += 1
    return left, right + 1


def _deviation(a: Reals, b: Reals, rotation: Reals, step: float, window: float) -> float:
    """Return the standard deviation of the offset, from residuals that are independent after a window."""
    known = a.any(-1) & b.any(-1)
    rest, slopes = (a - b @ rotation.T)[known], np.gradient(a, step, axis=0)[known]
    independent = max(len(rest) * step / window, 1.0)
    return float(np.sqrt((rest**2).sum() / max((slopes**2).sum(), TINY) / independent))
