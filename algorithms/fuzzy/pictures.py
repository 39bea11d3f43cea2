"""Plots of fuzzy sets and of control surfaces."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..extras import extra
from .mamdani import Mamdani
from .sugeno import Sugeno

with extra("pictures", __name__):
    from matplotlib.figure import Figure


def plot_memberships(system: Mamdani, size: float = 9.0) -> Figure:
    """Plot the sets of all inputs (first row) and outputs (second row).

    Parameters
    ----------
    system : Mamdani
    size : float, optional
        The width of the figure in inches.

    Returns
    -------
    matplotlib.figure.Figure
    """
    groups = system.inputs, system.outputs
    columns = max(map(len, groups))
    figure = Figure(figsize=(size, 0.45 * size), layout="constrained")
    axes = figure.subplots(2, columns, squeeze=False)
    for row, group in zip(axes, groups, strict=True):
        for axis in row[len(group) :]:
            axis.set_axis_off()
        for axis, variable in zip(row, group, strict=False):
            for one, heights in zip(variable.sets, variable.memberships.T, strict=True):
                axis.plot(variable.places, heights, label=one.name)
            axis.set(title=variable.name, xlim=(variable.low, variable.high), ylim=(0, 1.05))
            axis.legend(fontsize="x-small")
    return figure


def plot_control_surface(
    system: Mamdani | Sugeno,
    x: str,
    y: str,
    output: str,
    fixed: Mapping[str, float] | None = None,
    samples: int = 61,
    size: float = 6.0,
) -> Figure:
    """Plot an output over two inputs; places where no rule fires are left out.

    Parameters
    ----------
    system : Mamdani or Sugeno
    x, y, output : str
        The names of the inputs and of the output.
    fixed : mapping, optional
        Values of other inputs; by default the middles of their ranges.
    samples : int, optional
        The number of values of each input, at least 2.
    size : float, optional
        The width of the figure in inches.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If a name is unknown, `x` and `y` are equal, one of them is fixed, or there are fewer than 2 samples.
    """
    inputs = {one.name: one for one in system.inputs}
    outputs = [one.name for one in system.outputs]
    values = dict(fixed or {})
    for name in (x, y, *values):
        if name not in inputs:
            raise ValueError(f"no input {name!r}; expected {', '.join(inputs)}")
    if x == y:
        raise ValueError(f"x and y: both {x}; expected two inputs")
    for name in (x, y):
        if name in values:
            raise ValueError(f"fixed: {name}, which the surface is plotted over; expected other inputs")
    if samples < 2:
        raise ValueError(f"samples: {samples}; expected at least 2")
    if output not in outputs:
        raise ValueError(f"no output {output!r}; expected {', '.join(outputs)}")
    ranges = [np.linspace(inputs[name].low, inputs[name].high, samples) for name in (x, y)]
    first, second = np.meshgrid(*ranges)
    middle = {name: (one.low + one.high) / 2 for name, one in inputs.items()}
    found = system.evaluate(middle | values | {x: first, y: second}).values[..., outputs.index(output)]
    figure = Figure(figsize=(size, 0.75 * size), layout="constrained")
    axis = figure.add_subplot(projection="3d")
    axis.plot_surface(first, second, found, cmap="viridis", linewidth=0, rcount=samples, ccount=samples)
    axis.set(xlabel=x, ylabel=y, zlabel=output)
    return figure
