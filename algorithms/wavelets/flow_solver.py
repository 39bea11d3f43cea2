"""Solver for the motion that satisfies the equations of all pixels and is smooth except at few places."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from generated import images

from ..arguments import Reals

_KNEE = 0.04**2
"""Squared difference of the motions of neighbours, in pixels, above which the penalty is linear, not quadratic."""
_DEGREES = 4.0
"""Degrees of freedom of the t distribution of residuals: equations that fit badly get small weights."""
_ROUNDS = 3
"""Number of reweightings; each computes the weights from the current motion."""
_SWEEPS = 12
"""Sweeps over all pixels per round; more change the motion little because it is refined from coarse to fine."""
_FILLING = 90
"""Sweeps for hidden pixels, whose motion comes from far away."""


def solved(sums: Reals, uv: Reals, noise: float, bands: int, stiffness: float) -> Reals:
    """Return the motion that best satisfies the equations and the smoothness term.

    Parameters
    ----------
    sums : array, (6, M, N)
        Results of `images.phase_equations`, for a correction of `uv`.
    uv : array, (2, M, N)
        The current motion.
    noise : float
        Squared residual of one band. The larger it is, the larger the region over which the motion is averaged.
    bands : int
        Number of squared residuals in each sum.
    stiffness : float
        Weight of squared differences of neighbours relative to squared residuals in units of the noise.

    Returns
    -------
    array, (2, M, N)

    Notes
    -----
    The motion minimizes ``sum w r / noise + stiffness sum rho(difference of neighbours)``. Here r is the squared
    residual, ``w = 1 / (1 + r / (bands noise degrees))``, and rho is quadratic for small and linear for large
    differences (Charbonnier et al., *IEEE Trans. Image Processing* 6:298, 1997). The method is iteratively reweighted
    least squares with successive overrelaxation in chessboard order, so that the result does not depend on the order
    of the rows.
    """
    sides = np.full((4, *uv.shape[1:]), stiffness, uv.dtype)
    sides[0, :, 0] = sides[1, :, -1] = sides[2, 0] = sides[3, -1] = 0
    board = _Board(sums, uv, sides)
    parameters = np.array([1 / noise, 1 / (bands * noise * _DEGREES), 1 / _KNEE], uv.dtype)
    for _ in range(_ROUNDS):
        board.relax(parameters, _SWEEPS)
    return board.motion()


def filled(uv: Reals, known: Any, image: Reals, contrast: float) -> Reals:
    """Return the motion, with unknown values replaced by those of neighbours of similar brightness.

    Parameters
    ----------
    uv : array, (2, M, N)
    known : array of bool, (M, N)
    image : array, (M, N)
    contrast : float
        The difference of neighbours across which little motion is propagated.

    Returns
    -------
    array, (2, M, N)
    """
    if known.all() or not known.any():
        return uv
    # Boundaries are accurate to a pixel or two, so the nearest pixels may have the motion of the wrong side.
    sure = scipy.ndimage.binary_erosion(known, iterations=2, border_value=1)
    firm = np.where(sure, np.float32(1e6), np.float32(0))
    none = np.zeros_like(firm)
    across, down = (np.exp(-((np.diff(image, axis=axis) / contrast) ** 2) / 2) + 1e-3 for axis in (1, 0))
    sides = np.zeros((4, *image.shape), uv.dtype)
    sides[0, :, 1:] = sides[1, :, :-1] = across
    sides[2, 1:] = sides[3, :-1] = down
    board = _Board(np.stack([firm, none, firm, none, none, none]), uv, sides)
    board.relax(np.array([1, 0, 0], uv.dtype), _FILLING)
    return np.where(known, uv, board.motion())


class _Board:
    """Pixels arranged as the squares of a chessboard, so that a kernel can update all mutually independent pixels.

    The four classes of pixels, with even or odd row and column, are separate lines of numbers: row after row, with a
    zero after each row. The neighbours of a pixel are in other lines. The zeros, including those that pad odd sizes,
    have no stiffness and remain zero.

    Parameters
    ----------
    sums : array, (6, M, N)
    uv : array, (2, M, N)
        The motion that `sums` correct.
    stiffness : array, (4, M, N)
        Between pixels and their neighbours in the west, east, north and south; 0 where there is no neighbour.
    """

    def __init__(self, sums: Reals, uv: Reals, stiffness: Reals) -> None:
        self._shape = uv.shape[1:]
        rows, columns = ((size + 1) // 2 for size in self._shape)
        self._wide = columns + 1
        self._size = rows * self._wide
        self._sums, self._before, self._stiffness = (self._split(images) for images in (sums, uv, stiffness))
        self._lines = np.zeros((4, 2, self._size + 2 * self._wide), uv.dtype)
        self._lines[:, :, self._wide : -self._wide] = self._before
        self._steps = np.empty((4, 10, self._size), uv.dtype)
        self._squares = [self._square(kind) for kind in range(4)]

    def _split(self, images: Reals) -> Reals:
        """Return images (K, M, N) as lines, (4, K, size)."""
        result = np.zeros((4, len(images), self._size), images.dtype)
        grid = result.reshape(4, len(images), -1, self._wide)
        for kind, part in enumerate(_kinds(images)):
            grid[kind, :, : part.shape[1], : part.shape[2]] = part
        return result

    def motion(self) -> Reals:
        """Return the current motion, (2, M, N)."""
        result = np.empty((2, *self._shape), self._lines.dtype)
        grid = self._lines[:, :, self._wide : -self._wide].reshape(4, 2, -1, self._wide)
        for kind, part in enumerate(_kinds(result)):
            part[...] = grid[kind, :, : part.shape[1], : part.shape[2]]
        return result

    def relax(self, parameters: Reals, sweeps: int) -> None:
        """Compute the weights for the current motion, see `images.relaxation_step`, and sweep over all pixels."""
        for sums, before, square, stiffness, step in zip(
            self._sums, self._before, self._squares, self._stiffness, self._steps, strict=True
        ):
            images.relaxation_step(sums.T, before.T, *square, stiffness.T, parameters, out=step.T)  # type: ignore[call-overload]
        calls = [(*self._squares[kind], self._steps[kind].T) for kind in (0, 3, 1, 2)]
        for _ in range(sweeps):
            for call in calls:
                images.relaxed_motion(*call, out=call[0])

    def _square(self, kind: int) -> list[Reals]:
        """Return one class of pixels and their neighbours in the west, east, north and south, each (size, 2)."""
        down, across = divmod(kind, 2)
        beside, above = 2 * down + 1 - across, 2 * (1 - down) + across
        places = [
            (kind, 0),
            (beside, across - 1),
            (beside, across),
            (above, (down - 1) * self._wide),
            (above, down * self._wide),
        ]
        first = self._wide
        return [self._lines[line, :, first + at : first + at + self._size].T for line, at in places]


def _kinds(images: Reals) -> list[Reals]:
    """Return images (K, M, N) at even and odd rows and columns."""
    return [images[:, down::2, across::2] for down in range(2) for across in range(2)]
