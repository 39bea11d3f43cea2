"""Plots of electromagnetic fields in a box and of precessing spins."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import spacetime, sta

from ..arguments import real_array
from ..extras import extra
from .yee import Fields, YeeBox

with extra("pictures", __name__):
    from matplotlib.figure import Figure


def draw_energy(box: YeeBox, fields: Fields, axis: int = 2, layer: int | None = None) -> Figure:
    """Plot the energy density ``(E**2 + B**2)/2`` in a layer of cells, with arrows of the Poynting vector ``E x B``.

    Parameters
    ----------
    box : YeeBox
    fields : Fields
        Fields of one box, without leading axes.
    axis : int, optional
        Axis perpendicular to the layer.
    layer : int, optional
        Index of the layer along this axis; the default is the middle.

    Raises
    ------
    ValueError
        If the fields are a batch, or if the layer is out of range.
    """
    if fields.electric.ndim != 4:
        raise ValueError(f"fields: electric of shape {fields.electric.shape}; expected those of one box")
    if axis not in (0, 1, 2):
        raise ValueError(f"axis: {axis!r}; expected 0, 1 or 2")
    at = box.shape[axis] // 2 if layer is None else layer
    if not 0 <= at < box.shape[axis]:
        raise ValueError(f"layer: {at}; expected 0 to {box.shape[axis] - 1}")
    flow = sta.field_stress_energy(box.at_centres(fields).take(at, axis), [1.0, 0.0, 0.0, 0.0])
    first, second = (k for k in range(3) if k != axis)
    figure = Figure(figsize=(5, 4), layout="constrained")
    axes = figure.add_subplot()
    extent = (0.0, box.size[first], 0.0, box.size[second])
    image = axes.imshow(flow[..., 0].T, origin="lower", extent=extent, cmap="magma")
    figure.colorbar(image, ax=axes, label="energy density")
    step = max(1, max(flow.shape[:2]) // 20)
    x, y = (
        (np.arange(box.shape[k])[::step] + 0.5) * box.spacing[k] for k in (first, second)
    )  # fmt: skip
    arrows = flow[::step, ::step, 1:]
    if arrows.any():
        axes.quiver(x, y, arrows[..., first].T, arrows[..., second].T, color="white")
    axes.set(xlabel="xyz"[first], ylabel="xyz"[second], title=f"t = {fields.time:.3g}")
    return figure


def draw_spin(history: ArrayLike) -> Figure:
    """Plot the path of the spin vector of a Pauli spinor on the sphere.

    Parameters
    ----------
    history : array_like, (T, 4)
        As returned by `precess`.

    Raises
    ------
    TypeError, ValueError
        If the shape is wrong, or if a spinor is zero.
    """
    psi = real_array(history, "history", (4,), "Pauli spinors")
    if psi.ndim != 2:
        raise ValueError(f"history: shape {psi.shape}; expected (T, 4), one spinor at T times")
    density = spacetime.pauli_density(psi)[:, None]
    if not (density > 0).all():
        raise ValueError("history: a spinor that is zero; expected a direction of its spin")
    x, y, z = (spacetime.pauli_spin(psi) / density).T
    figure = Figure(figsize=(4.5, 4.5), layout="constrained")
    axes = figure.add_subplot(projection="3d")
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 37), np.linspace(0, np.pi, 19))
    axes.plot_wireframe(np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v), color="0.85", linewidth=0.5)
    axes.plot(x, y, z, color="tab:red")
    axes.scatter(x[:1], y[:1], z[:1], color="black")
    axes.set(xlabel="e1", ylabel="e2", zlabel="e3", box_aspect=(1, 1, 1))
    return figure
