"""Draw a roofline plot: the speed of kernels, and the limits set by memory and arithmetic."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from .kernels import KernelTimes
from .machine import Machine


def draw(path: Path, machine: Machine, sizes: Sequence[int], kernels: Sequence[KernelTimes]) -> None:
    """Write the picture, for float64 and Fortran order and all sizes except 1."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    axis = figure.subplots()
    intensity = np.geomspace(0.01, 20, 200)
    for speed, name, style in ((machine.copy_cached, "copy in cache", "--"), (machine.copy_memory, "copy", "-")):
        roof = np.minimum(speed * intensity, machine.peak) / 1e9
        axis.plot(intensity, roof, style, color="black", linewidth=1, label=f"{name} and matrix product")
    shown = [k for k, size in enumerate(sizes) if size > 1]
    for marker, k in zip("ov^sD", shown, strict=False):
        counted = [kernel for kernel in kernels if kernel.operations]
        x = [kernel.operations / (8 * kernel.moved) for kernel in counted]
        y = [kernel.operations / kernel.times["float64", "F"][k] / 1e9 for kernel in counted]
        axis.plot(x, y, marker, markersize=6, alpha=0.8, label=f"{sizes[k]:,} elements")
        if k == shown[0]:
            for kernel, across, up in zip(counted, x, y, strict=True):
                title = kernel.case.title.replace("one motor, many points", "one motor")
                axis.annotate(title, (across, up), fontsize=7, xytext=(4, 3), textcoords="offset points")
    axis.set(
        xscale="log",
        yscale="log",
        xlabel="operations per byte read or written",
        ylabel="10⁹ operations per second",
        title="Generated kernels, float64, Fortran order, one thread",
    )
    axis.grid(alpha=0.3)
    axis.legend(loc="lower right", fontsize=8)
    figure.savefig(path, dpi=110, metadata={"Software": None})
