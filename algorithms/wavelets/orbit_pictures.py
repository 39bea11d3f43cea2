"""Plots of Lie filters with the orbits of their generators."""

from __future__ import annotations

import numpy as np

from generated import lie_filters

from ..extras import extra
from .lie_filters import GENERATORS, coefficients, lie_filter

with extra("pictures", __name__):
    from matplotlib.figure import Figure


def plot_lie_filters(sigma: float = 6.0) -> Figure:
    """Plot the six Lie filters, with arrows along the orbits of their generators.

    Parameters
    ----------
    sigma : float
        As in `lie_filter`.

    Returns
    -------
    Figure
    """
    figure = Figure((9, 6), layout="constrained")
    for axes, name in zip(figure.subplots(2, 3).flat, GENERATORS, strict=True):
        mask = lie_filter(name, sigma)
        reach = mask.shape[0] // 2
        # The filter of the rotation consists of rounding errors, which a common scale does not show.
        limit = max(float(abs(mask).max()), 1e-9)
        axes.imshow(mask, "RdBu_r", vmin=-limit, vmax=limit, extent=(-reach, reach, reach, -reach))
        grid = np.linspace(-0.8 * reach, 0.8 * reach, 9)
        x, y = np.meshgrid(grid, grid)
        u, v = np.moveaxis(lie_filters.orbit_velocity(coefficients(name), np.stack([x, y], -1)), -1, 0)
        axes.quiver(x, y, u, v, angles="xy")
        axes.set_title(name)
    return figure
