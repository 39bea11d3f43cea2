"""Figures of the demonstration, written as PNG files. The data are computed in `programs`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..arguments import Reals

_BINS = 140
"""A limit on work: the number of bars of a histogram."""
_RESOLUTION = 150
"""Dots per inch."""


def draw_arms(arms: Mapping[str, tuple[Reals, Reals]], path: Path) -> None:
    """Draw histograms of the positions that the end effectors of arms reach, from above and from the side.

    Parameters
    ----------
    arms : mapping of str to (array (n, 3), array (m, 3))
        For each title the positions of the end effector, and the joint positions of the arm in one pose, base first, in
        metres.
    path : Path
        The PNG file to write.
    """
    figure = Figure(figsize=(5.6 * len(arms), 9.4), layout="constrained")
    figure.suptitle("Positions of the end effector for random joint angles")
    axes = figure.subplots(2, len(arms), squeeze=False)
    for column, (title, (cloud, corners)) in enumerate(arms.items()):
        reach = 1.08 * float(np.abs(cloud[:, :2]).max())
        views = ((1, "y", "from above"), (2, "z", "from the side"))
        for axis, (other, name, view) in zip(axes[:, column], views, strict=True):
            low, high = _limits(cloud[:, other], 2 * reach)
            _, _, _, image = axis.hist2d(
                cloud[:, 0],
                cloud[:, other],
                bins=_BINS,
                range=[[-reach, reach], [low, high]],
                norm=LogNorm(),
                cmap="viridis",
                rasterized=True,
            )
            axis.plot(corners[:, 0], corners[:, other], "-", color="white", linewidth=5)
            axis.plot(corners[:, 0], corners[:, other], "o-", color="crimson", linewidth=2.5, markersize=5)
            axis.set(aspect="equal", xlabel="x (m)", ylabel=f"{name} (m)")
            figure.colorbar(image, ax=axis, label="configurations per cell", shrink=0.85)
            axis.set_title(f"{title}, {view}")
    _save(figure, path)


def draw_stereo(
    images: tuple[NDArray[Any], NDArray[Any]],
    pixels: tuple[Reals, Reals],
    lines: Reals,
    depth: Reals,
    path: Path,
) -> None:
    """Draw points of the left image, their epipolar lines in the right image, and the depth map.

    Parameters
    ----------
    images : (array, array), (M, N, 3)
        Left and right.
    pixels : (array, array), (n, 2)
        Points of the left image, and the corresponding points of the right image.
    lines : array, (n, 3)
        Epipolar lines (a, b, c) in the right image.
    depth : array, (M, N)
        In metres; NaN if unknown.
    path : Path
        The PNG file to write.
    """
    height, width = depth.shape
    figure = Figure(figsize=(13.0, 9.4), layout="constrained")
    grid = figure.add_gridspec(2, 4, height_ratios=(1.0, 1.25))
    left, right = figure.add_subplot(grid[0, :2]), figure.add_subplot(grid[0, 2:])
    colours = [f"C{k}" for k in range(len(lines))]
    for axis, image, points, title in zip(
        (left, right),
        images,
        pixels,
        ("Left image", "Right image, epipolar lines and true matches"),
        strict=True,
    ):
        axis.imshow(image)
        for (x, y), colour in zip(points, colours, strict=True):
            axis.plot(x, y, "o", color=colour, markeredgecolor="white", markersize=7)
        axis.set(title=title, xlabel="x (pixels)", ylabel="y (pixels)")
    for (a, b, c), colour in zip(lines, colours, strict=True):
        across = np.array([0.0, width - 1.0])
        right.plot(across, -(a * across + c) / b, "-", color=colour, linewidth=1.2)
    right.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    axis = figure.add_subplot(grid[1, 1:3])
    axis.set_facecolor("lightgrey")
    shown = axis.imshow(depth, cmap="turbo_r")
    axis.set(title="Depth from the true disparities (grey: unknown)", xlabel="x (pixels)", ylabel="y (pixels)")
    figure.colorbar(shown, ax=axis, label="depth (m)", shrink=0.85)
    _save(figure, path)


def draw_spectrum(image: NDArray[Any], magnitude: Reals, from_phase: Reals, error: Reals, path: Path) -> None:
    """Draw an image, its quaternion spectrum, a reconstruction from the phase only, and the error of the inverse.

    Parameters
    ----------
    image : array, (M, N)
    magnitude : array, (M, N)
        Decimal logarithm of the norm of the transform, frequency 0 at [0, 0].
    from_phase : array, (M, N)
        The inverse of the transform with all norms set to 1.
    error : array, (M, N)
        Absolute difference between the inverse of the transform and the image.
    path : Path
        The PNG file to write.
    """
    height, width = image.shape
    figure = Figure(figsize=(11.0, 9.2), layout="constrained")
    axes = figure.subplots(2, 2)
    _picture(figure, axes[0, 0], image, "Image", "gray", "grey level")
    shown = axes[0, 1].imshow(
        np.fft.fftshift(magnitude),
        cmap="magma",
        extent=(-width / 2 - 0.5, width / 2 - 0.5, height / 2 - 0.5, -height / 2 - 0.5),
        vmin=float(np.quantile(magnitude, 0.001)),
    )
    axes[0, 1].set(
        title="Norm of the quaternion Fourier transform", xlabel="v (cycles per width)", ylabel="u (cycles per height)"
    )
    figure.colorbar(shown, ax=axes[0, 1], label="log10 of the norm", shrink=0.85)
    low, high = np.quantile(from_phase, (0.005, 0.995))
    clipped = np.clip(from_phase, low, high)
    _picture(figure, axes[1, 0], clipped, "Reconstruction from the phases, all norms 1", "gray", "arbitrary units")
    _picture(figure, axes[1, 1], error, "Error of the inverse", "viridis", "grey levels")
    _save(figure, path)


def _picture(figure: Figure, axis: Axes, image: NDArray[Any], title: str, colours: str, label: str) -> None:
    shown = axis.imshow(image, cmap=colours)
    axis.set(title=title, xlabel="column", ylabel="row")
    figure.colorbar(shown, ax=axis, label=label, shrink=0.85)


def _limits(values: Reals, extent: float) -> tuple[float, float]:
    """Return an interval of a given length centred on the values."""
    middle = (float(values.min()) + float(values.max())) / 2
    return middle - extent / 2, middle + extent / 2


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=_RESOLUTION, bbox_inches="tight", pad_inches=0.15)
