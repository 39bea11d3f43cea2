"""Tables of the integrals in the votes of balls and plates.

With the sine u of the angle of offset and plane, a stick decays by ``exp(-(l asin(u) / u)**2 - 4 q (u / l)**2)`` at the
distance l in units of sigma, with the weight q of squared curvatures, and by 0 for ``u**2 > 1/2``.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline, RectBivariateSpline

from ..arguments import Reals

REACH = 3.0
"""Tokens farther than this multiple of sigma do not vote."""
CELLS = 1024
"""Of the tables of balls, in equal steps of the distance."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
_GONE = 6.5
"""The root of the exponent at which the decay by curvature has vanished."""
_FEWER, _ROWS = 65, 193
"""Nodes of the tables of plates in the angle, below and above 45 degrees, and in the distance."""


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


def plate_functions(distance: Reals, square: Reals, curvature: float) -> tuple[Reals, Reals]:
    """Return w and d of the vote of a plate at distances, and squared sines of the angle of offset and tangent."""
    low, high = _plate_splines(float(curvature))
    sine = np.sqrt(square)
    steep = square > 0.5
    place = np.sqrt(np.minimum(distance, REACH) / REACH)
    across, excess = np.empty_like(distance), np.empty_like(distance)
    for rows, splines, at in (
        (~steep, low, sine),
        (steep, high, np.arcsin(np.minimum(1 / np.maximum(np.sqrt(2) * sine, 1), 1))),
    ):
        across[rows] = splines[0].ev(place[rows], at[rows])
        excess[rows] = splines[1].ev(place[rows], at[rows])
    return across, excess / np.where(square > 1e-12, square, np.inf)


@lru_cache(maxsize=8)
def _plate_splines(curvature: float) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    """Return splines of w and of the difference of both integrals, for flat and steep offsets."""
    place = np.linspace(0, 1, _ROWS)
    distance = REACH * place[1:, None, None] ** 2
    sine = np.linspace(0, np.sqrt(0.5), _FEWER)
    angle = np.linspace(np.pi / 4, np.pi / 2, _FEWER)
    found = []
    for at, sines, tops in (
        (sine, sine, np.full(_FEWER, np.pi / 2)),
        (angle, np.sqrt(0.5) / np.sin(angle), angle),
    ):
        s = np.maximum(sines, 1e-9)[:, None]
        gone = np.arcsin(np.minimum(1, _GONE * distance / (2 * np.sqrt(curvature) * s)))
        turn, weight = _nodes(np.minimum(tops[:, None], gone))
        decay = 4 / np.pi * _decay(distance, np.minimum(s * np.sin(turn), 1), curvature) * weight
        across = (decay * np.cos(turn) ** 2).sum(-1)
        difference = -(decay * np.cos(2 * turn)).sum(-1)
        first = np.zeros((1, _FEWER))
        found.append(tuple(RectBivariateSpline(place, at, np.concatenate([first, v])) for v in (across, difference)))
    return found[0], found[1]


def _nodes(top: Reals) -> tuple[Reals, Reals]:
    return top * (1 + _NODES) / 2, top * _WEIGHTS / 2


def _decay(distance: Reals, sine: Reals, curvature: float) -> Reals:
    ratio = np.where(sine < 1e-8, 1.0, np.arcsin(sine) / np.maximum(sine, 1e-8))
    return np.asarray(np.exp(-((distance * ratio) ** 2) - 4 * curvature * (sine / distance) ** 2))


def _cubics(distance: Reals, values: Reals, step: float) -> Reals:
    powers = step ** np.arange(3, -1, -1.0)
    return np.asarray((CubicSpline(distance, values).c * powers[:, None])[::-1].T)
