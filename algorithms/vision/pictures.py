"""Plots of views: epipolar lines, matches, reconstructed points, and lines seen by omnidirectional cameras."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from ..extras import extra
from .camera import Camera
from .omnidirectional import OmnidirectionalCamera
from .status import check_points
from .two_views import epipolar_lines

with extra("pictures", __name__):
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

_SAMPLES = 400
"""A limit on work: the number of points of a curve."""
_REACH = 50.0
"""Lines in space are drawn up to this multiple of the distance of the two points that define them."""


def lines_in_image(lines: ArrayLike, width: float, height: float) -> Reals:
    """Return the points at which lines enter and leave an image.

    Parameters
    ----------
    lines : array_like, (..., 3)
        (a, b, c) of ``a x + b y + c = 0``.
    width, height : float
        Size of the image in pixels; the centre of the first pixel is (0, 0).

    Returns
    -------
    array, (..., 2, 2)
        Two points (x, y) on the border of the image; NaN for lines that miss it.

    Raises
    ------
    TypeError, ValueError
        If `lines` is not an array of lines.
    """
    array = real_array(lines, "lines", (3,), "a b c").astype(np.float64)
    a, b, c = np.moveaxis(array, -1, 0)
    x0, y0, x1, y1 = -0.5, -0.5, width - 0.5, height - 0.5
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = [np.stack([np.full_like(a, x), -(a * x + c) / b], -1) for x in (x0, x1)]
        ends += [np.stack([-(b * y + c) / a, np.full_like(a, y)], -1) for y in (y0, y1)]
    points = np.stack(ends, -2)
    small = 1e-9 * (width + height)
    inside = ((points >= np.array([x0, y0]) - small) & (points <= np.array([x1, y1]) + small)).all(-1)
    # Take the points on the border that are farthest apart: a line through a corner has three.
    along = np.where(inside, points[..., 0] * b[..., None] - points[..., 1] * a[..., None], np.nan)
    first = np.argmin(np.where(np.isnan(along), np.inf, along), -1)
    last = np.argmax(np.where(np.isnan(along), -np.inf, along), -1)
    found = np.stack([np.take_along_axis(points, k[..., None, None], -2)[..., 0, :] for k in (first, last)], -2)
    return np.asarray(np.where((inside.sum(-1) >= 2)[..., None, None], found, np.nan))


def draw_epipolar_lines(
    first: ArrayLike, second: ArrayLike, fundamental: ArrayLike, pixels: ArrayLike, partners: ArrayLike
) -> Figure:
    """Plot two images side by side, with points of each and the epipolar lines of their partners in the other.

    Parameters
    ----------
    first, second : array_like, (M, N) or (M, N, 3)
        Images.
    fundamental : array_like, (3, 3)
        As returned by `fundamental_matrix`.
    pixels, partners : array_like, (n, 2)
        Points in the first and in the second image.

    Raises
    ------
    TypeError, ValueError
        If `first` and `second` are not images, or if the numbers of points differ.
    """
    one, two = real_array(pixels, "pixels", (2,), "x y"), real_array(partners, "partners", (2,), "x y")
    check_points({"pixels": one, "partners": two}, 0, "points")
    matrix = real_array(fundamental, "fundamental", (3, 3), "a fundamental matrix")
    figure = Figure(figsize=(12, 5), layout="tight")
    colours = _colours(len(one))
    lines = epipolar_lines(matrix.T, two), epipolar_lines(matrix, one)
    for k, (image, points, name) in enumerate(((first, one, "first"), (second, two, "second"))):
        axes = figure.add_subplot(1, 2, k + 1)
        height, width = _show(axes, image, name)
        segments = lines_in_image(lines[k], width, height)
        axes.add_collection(LineCollection(list(segments), colors=colours, linewidths=0.8))
        axes.scatter(points[:, 0], points[:, 1], c=colours, s=14, edgecolors="white", linewidths=0.4)
    return figure


def draw_matches(
    first: ArrayLike,
    second: ArrayLike,
    pixels: ArrayLike,
    partners: ArrayLike,
    inliers: ArrayLike | None = None,
) -> Figure:
    """Plot two images in one row, with a line from each point to its partner; wrong matches are red.

    Parameters
    ----------
    first, second : array_like, (M, N) or (M, N, 3)
        Images.
    pixels, partners : array_like, (n, 2)
        Points in the first and in the second image.
    inliers : array_like of bool, (n,), optional
        The matches that are correct, as in `RobustEstimate`.

    Raises
    ------
    TypeError, ValueError
        If `first` and `second` are not images, or if the numbers of points differ.
    """
    one, two = real_array(pixels, "pixels", (2,), "x y"), real_array(partners, "partners", (2,), "x y")
    check_points({"pixels": one, "partners": two}, 0, "points")
    good = np.ones(len(one), bool) if inliers is None else np.asarray(inliers)
    if good.dtype != bool or good.shape != (len(one),):
        raise ValueError(f"inliers: {good.dtype} of shape {good.shape}; expected bool of shape ({len(one)},)")
    left, right = _image(first, "first"), _image(second, "second")
    height = max(left.shape[0], right.shape[0])
    whole = np.ones((height, left.shape[1] + right.shape[1], 3))
    whole[: left.shape[0], : left.shape[1]] = left
    whole[: right.shape[0], left.shape[1] :] = right
    figure = Figure(figsize=(12, 12 * height / whole.shape[1]), layout="tight")
    axes = figure.add_subplot()
    _show(axes, whole, "images")
    there = two + np.array([left.shape[1], 0])
    colours = np.where(good[:, None], np.array([0.1, 0.8, 0.2]), np.array([0.9, 0.1, 0.1]))
    axes.add_collection(LineCollection(list(np.stack([one, there], 1)), colors=colours.tolist(), linewidths=0.6))
    for points in (one, there):
        axes.scatter(points[:, 0], points[:, 1], c=colours, s=6)
    return figure


def draw_cloud(points: ArrayLike, cameras: Sequence[Camera] = (), colours: ArrayLike | None = None) -> Figure:
    """Plot points in space and the cameras that saw them, each as its centre and the axes of its frame.

    Parameters
    ----------
    points : array_like, (n, 3)
        Points that are not finite are omitted.
    cameras : sequence of Camera
    colours : array_like, (n, 3), optional
        RGB values between 0 and 1; the default is a colour by depth along z.

    Raises
    ------
    TypeError, ValueError
        If `points` is not an array of points, or if the number of colours differs.
    """
    array = real_array(points, "points", (3,), "x y z").reshape(-1, 3)
    seen = np.isfinite(array).all(-1)
    tint = array[:, 2] if colours is None else real_array(colours, "colours", (3,), "red green blue").reshape(-1, 3)
    if len(tint) != len(array):
        raise ValueError(f"colours: {len(tint)} colours; expected {len(array)}, as many as points")
    figure = Figure(figsize=(8, 7))
    axes = figure.add_subplot(projection="3d")
    x, y, z = array[seen].T
    axes.scatter(x, y, z, c=tint[seen], s=2)
    size = 0.2 * max((float(np.ptp(each)) for each in (x, y, z) if len(each)), default=1.0)
    for camera in cameras:
        frame = pga3.motor_to_matrix(camera.pose)
        for axis, colour in zip(frame[:3, :3].T, ("red", "green", "blue"), strict=True):
            ends = np.stack([frame[:3, 3], frame[:3, 3] + size * axis])
            axes.plot(*ends.T, color=colour, linewidth=1.5)
    axes.set_aspect("equal")
    axes.set_xlabel("x")
    axes.set_ylabel("y")
    axes.set_zlabel("z")
    return figure


def draw_omnidirectional(
    camera: OmnidirectionalCamera, first: ArrayLike, second: ArrayLike, width: int, height: int
) -> Figure:
    """Plot lines in space as an omnidirectional camera sees them: conics, or circles for a parabolic mirror.

    Parameters
    ----------
    camera : OmnidirectionalCamera
    first, second : array_like, (n, 3)
        Two points of each line, in world coordinates.
    width, height : int
        Size of the image, in pixels.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points differ.
    """
    one, two = real_array(first, "first", (3,), "x y z"), real_array(second, "second", (3,), "x y z")
    check_points({"first": one, "second": two}, 0, "points")
    # Samples are denser near the two points.
    t = np.tan(np.linspace(-np.arctan(_REACH), np.arctan(_REACH), _SAMPLES))
    curves = camera.project(one[:, None] + t[:, None] * (two - one)[:, None])
    figure = Figure(figsize=(7, 7 * height / width), layout="tight")
    axes = figure.add_subplot()
    for curve, colour in zip(curves, _colours(len(one)), strict=True):
        axes.plot(curve[:, 0], curve[:, 1], color=colour, linewidth=1.2)
    for points in (one, two):
        image = camera.project(points)
        axes.scatter(image[:, 0], image[:, 1], color="black", s=8)
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    axes.set_aspect("equal")
    return figure


def _image(image: ArrayLike, name: str) -> Reals:
    """Return the image in colour, with values between 0 and 1."""
    array, dtype = real_array(image, name), np.asarray(image).dtype
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] not in (3, 4)):
        raise ValueError(f"{name}: {dtype} of shape {array.shape}; expected an image, (M, N), (M, N, 3) or (M, N, 4)")
    numbers = array.astype(np.float64) / (255.0 if dtype.kind in "iu" else 1.0)
    return np.clip(np.repeat(numbers[..., None], 3, -1) if numbers.ndim == 2 else numbers[..., :3], 0, 1)


def _show(axes: Axes, image: ArrayLike, name: str) -> tuple[int, int]:
    array = _image(image, name)
    axes.imshow(array)
    axes.set_axis_off()
    return array.shape[0], array.shape[1]


def _colours(n: int) -> list[tuple[float, float, float]]:
    """Return n distinct colours."""
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False)
    return [(0.5 + 0.5 * np.cos(t), 0.5 + 0.5 * np.cos(t - 2.1), 0.5 + 0.5 * np.cos(t + 2.1)) for t in angles]
