"""Tables of the integrals in the votes of balls and plates.

With the sine u of the angle of offset and plane, a stick decays by ``exp(-(l asin(u) / u)**2 - 4 q (u / l)**2)`` at the
distance l in units of sigma, with the weight q of squared curvatures, and by 0 for ``u**2 > 1/2``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arguments import Reals
from ..precision import TINY

Integers = NDArray[np.int64]

REACH = 3.0
"""Tokens farther than this multiple of sigma do not vote."""
CELLS = 1024
"""Of the tables of balls, in equal steps of the distance."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
"""Places and weights of Gauss and Legendre's rule: a limit on work, 48 points for each integral."""
_GONE = 6.5
"""The root of the exponent at which the decay by curvature has vanished."""
ROWS, COLUMNS = 192, 64
"""Cells of the tables of plates in the root of the distance, and in the angle below and above 45 degrees."""


@lru_cache(maxsize=32)
def ball_cubics(curvature: float, dimension: int) -> Reals:
    """Return cubics (cells, 8) of a and b in ``a I + b u u``, the vote of a ball with the unit offset u."""
    distance = np.linspace(0, REACH, CELLS + 1)
    safe = distance[1:, None]
    top = np.minimum(np.sqrt(0.5), _GONE * safe / (2 * np.sqrt(curvature)))
    sine, weight = _nodes(top)
    decay = _decay(safe, sine, curvature) * weight
    if dimension == 3:
        along, across = 3 * sine**2, 1.5 * (1 - sine**2)
    else:
        # In the plane, the integral over the angle: d angle = d sine / cosine.
        cosine = np.sqrt(1 - sine**2)
        along, across = 4 / np.pi * sine**2 / cosine, 4 / np.pi * cosine
    a = np.append(0.0, (decay * across).sum(-1))
    b = np.append(0.0, (decay * along).sum(-1)) - a
    step = REACH / CELLS
    rows = [_cubics(distance, values, step) for values in (a, b)]
    table = np.ascontiguousarray(np.concatenate(rows, 1))
    table.setflags(write=False)
    return table


@dataclass(frozen=True, eq=False)
class PlateTable:
    """Bicubic polynomials of w and e, the functions in the vote of a plate.

    Attributes
    ----------
    spread : float
        The ratio of the distance to the sine of the angle of offset and tangent, in units of its value at 45 degrees,
        where w falls off most steeply near a token. Columns are narrow there.
    cubics : array, (rows * columns, 32)
        Coefficients in each cell of w and then of e, of the powers of the column for each power of the row.
    """

    spread: float
    cubics: Reals

    def cells(self, root: Reals, column: Reals) -> tuple[Integers, Reals, Reals]:
        """Return cells, and the places in them from 0 to 1.

        Parameters
        ----------
        root : array
            Roots of distances. It is overwritten.
        column : array
            From 0 to 2, see `generated.tensor_voting.vote_places`. It is overwritten.
        """
        root *= ROWS / np.sqrt(REACH)
        column *= COLUMNS
        rows, columns = root.astype(np.int64), column.astype(np.int64)
        np.minimum(rows, ROWS - 1, out=rows)
        np.minimum(columns, 2 * COLUMNS - 1, out=columns)
        root -= rows
        column -= columns
        rows *= 2 * COLUMNS
        rows += columns
        return rows, root, column


@lru_cache(maxsize=8)
def plate_table(curvature: float) -> PlateTable:
    """Tabulate the votes of plates: with the vote in `stick_and_plate_votes`, the integrals w and e."""
    spread = 1 / np.sqrt(2 * curvature)
    root = np.linspace(0, 1, ROWS + 1)
    root[0] = 1e-6  # The limit of distance 0 for each column.
    distance = REACH * root[:, None, None] ** 2
    column = np.linspace(0, 1, COLUMNS + 1)
    # The inverse of s (1 + t) / (s + t), and the sine in units of that at 45 degrees.
    near = spread * distance[..., 0]
    flat = np.sqrt(0.5) * column * near / np.maximum(1 + near - column, near)
    sharp = np.sqrt(1 / (2 - column**2))
    kinds = (
        (flat, np.full_like(flat, np.pi / 2)),
        (np.broadcast_to(sharp, flat.shape), np.arcsin(np.sqrt(0.5) / sharp)),
    )
    found = []
    for sine, top in kinds:
        s = np.maximum(sine, TINY)[..., None]
        gone = np.arcsin(np.minimum(1, _GONE * distance / (2 * np.sqrt(curvature) * s)))
        turn, weight = _nodes(np.minimum(np.broadcast_to(top, flat.shape)[..., None], gone))
        decay = 4 / np.pi * _decay(distance, np.minimum(s * np.sin(turn), 1), curvature) * weight
        across = (decay * np.cos(turn) ** 2).sum(-1)
        excess = -(decay * np.cos(2 * turn)).sum(-1)
        found.append(np.concatenate([_bicubics(across), _bicubics(excess)], -1))
    table = np.ascontiguousarray(np.concatenate(found, 1).reshape(-1, 32))
    table.setflags(write=False)
    return PlateTable(spread, table)


def _bicubics(values: Reals) -> Reals:
    """Return coefficients (rows, columns, 16) of the spline through values at equally spaced nodes."""
    along = scipy.interpolate.CubicSpline(np.arange(values.shape[1]), values, axis=1).c[::-1]
    both = scipy.interpolate.CubicSpline(np.arange(values.shape[0]), along, axis=2).c[::-1]
    return np.asarray(both.transpose(1, 3, 0, 2).reshape(*both.shape[1:2], both.shape[3], 16))


def _nodes(top: Reals) -> tuple[Reals, Reals]:
    return top * (1 + _NODES) / 2, top * _WEIGHTS / 2


def _decay(distance: Reals, sine: Reals, curvature: float) -> Reals:
    ratio = np.where(sine < 1e-8, 1.0, np.arcsin(sine) / np.maximum(sine, 1e-8))
    return np.asarray(np.exp(-((distance * ratio) ** 2) - 4 * curvature * (sine / distance) ** 2))


def _cubics(distance: Reals, values: Reals, step: float) -> Reals:
    powers = step ** np.arange(3, -1, -1.0)
    return np.asarray((scipy.interpolate.CubicSpline(distance, values).c * powers[:, None])[::-1].T)
