"""Plots of transforms: spectra, phases, pyramids, scalograms, template matches, optical flow and denoising."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import vga2

from ..arguments import Reals, real_array
from ..extras import extra
from .checks import single_image
from .colours import GREY, to_rgb
from .continuous import ContinuousWavelet
from .discrete import WaveletPyramid, check_finite
from .dual_tree import DualTree
from .flow import Flow
from .phase import quaternion_phase
from .pyramid import QuaternionPyramid
from .quaternion_fourier import qft
from .stereo_matching import Disparity
from .vector_fields import Match

with extra("pictures", __name__):
    from matplotlib.colors import hsv_to_rgb
    from matplotlib.figure import Figure

_ARROWS = 24
"""Number of arrows along the longer side of a field."""


def draw_spectrum(spectrum: ArrayLike) -> Figure:
    """Plot the logarithm of the norms of a spectrum of images, with frequency 0 in the middle.

    Parameters
    ----------
    spectrum : array_like, (M, N, n)
        Result of `qft`, of `clifford_fft` of a plane or of `real_product_fft` of an image.

    Raises
    ------
    TypeError, ValueError
        If `spectrum` is not an array of finite real numbers of this shape.
    """
    array = _checked(spectrum, "spectrum", 3, "a spectrum M N n")
    size = np.fft.fftshift(np.sqrt((array**2).sum(-1)))
    floor = 1e-8 * (size.max() or 1.0)
    figure, (axes,) = _figure(1)
    rows, columns = size.shape
    # The centres of the first and the last pixel are at -1/2 and nearly 1/2.
    extent = (-(columns // 2) - 0.5, columns - columns // 2 - 0.5, rows - rows // 2 - 0.5, -(rows // 2) - 0.5)
    _image(figure, axes, np.log10(np.maximum(size, floor)), "norm, power of ten", extent=extent)
    axes.set(xlabel="v, periods per row", ylabel="u, periods per column")
    return figure


def draw_colours(q: ArrayLike) -> Figure:
    """Plot a colour image and the spectra of its luminance and of its chrominance.

    Parameters
    ----------
    q : array_like, (M, N, 4)
        Pure quaternions, as from `from_rgb`. The largest number is drawn brightest, negative numbers as 0.

    Raises
    ------
    TypeError, ValueError
        If `q` is not an array of finite real numbers of this shape, or has scalar parts.

    Notes
    -----
    The left quaternion Fourier transform with the grey axis keeps two planes separate: the plane of 1 and the grey
    axis, which holds the luminance, and the orthogonal plane, which holds the chrominance.
    """
    array = _checked(q, "q", 3, "quaternions M N 4", 4)
    colours = to_rgb(array)
    spectrum = np.fft.fftshift(qft(array, "left", (GREY, GREY), values="quaternion"), (0, 1))
    along = spectrum[..., 1:] @ np.array(GREY)
    across = spectrum[..., 1:] - along[..., None] * np.array(GREY)
    figure, panels = _figure(3)
    panels[0].imshow(np.clip(colours / (colours.max() or 1.0), 0, 1), interpolation="nearest")
    panels[0].set(title="image", xticks=[], yticks=[])
    sizes = np.hypot(spectrum[..., 0], along), np.sqrt((across**2).sum(-1))
    floor = 1e-8 * (max(size.max() for size in sizes) or 1.0)
    for axes, size, name in zip(panels[1:], sizes, ("luminance", "chrominance"), strict=True):
        _image(figure, axes, np.log10(np.maximum(size, floor)), f"{name}, power of ten")
    return figure


def draw_phases(q: ArrayLike) -> Figure:
    """Plot the amplitude and the three phases of a quaternion image; phases are grey where the amplitude is small.

    Parameters
    ----------
    q : array_like, (M, N, 4)
        For example the result of `gabor_bank`, a band of a pyramid, or the result of `quaternionic_analytic_signal`.

    Raises
    ------
    TypeError, ValueError
        If `q` is not an array of finite real numbers of this shape.
    """
    array = _checked(q, "q", 3, "quaternions M N 4", 4)
    phase = quaternion_phase(array)
    figure, panels = _figure(4)
    _image(figure, panels[0], phase.amplitude, "amplitude")
    small = phase.amplitude < 0.05 * phase.amplitude.max()
    for axes, angle, name, bound in (
        (panels[1], phase.phi, "phi", np.pi),
        (panels[2], phase.theta, "theta", np.pi / 2),
        (panels[3], phase.psi, "psi", np.pi / 4),
    ):
        wheel = "coolwarm" if name == "psi" else "twilight"
        _image(figure, axes, np.ma.array(angle, mask=small), name, cmap=wheel, vmin=-bound, vmax=bound)
        axes.set_facecolor("lightgray")
    return figure


def draw_pyramid(pyramid: QuaternionPyramid | WaveletPyramid | DualTree) -> Figure:
    """Plot the magnitudes of all bands, with one row for each level and one column for each band.

    Parameters
    ----------
    pyramid : QuaternionPyramid, WaveletPyramid or DualTree
        Pyramid of one image, with at least one level.

    Raises
    ------
    ValueError
        If `pyramid` is not the pyramid of one image or has no level.
    """
    levels = []
    for level in pyramid.detail:
        if isinstance(level, dict):
            bands = {name: np.abs(band) for name, band in level.items()}
            if isinstance(pyramid, QuaternionPyramid):
                bands = {name: np.sqrt((band**2).sum(-1)) for name, band in bands.items()}
        else:
            bands = {f"{15 + 30 * k} degrees": np.abs(level[..., k]) for k in range(level.shape[-1])}
        levels.append(bands)
    if not levels or any(band.ndim != 2 for level in levels for band in level.values()):
        raise ValueError("pyramid: expected that of one image, of at least one level")
    count = len(levels[0])
    figure = Figure(figsize=(2.4 * count, 2.4 * len(levels)), layout="constrained")
    for row, bands in enumerate(levels):
        for column, (name, band) in enumerate(bands.items()):
            axes = figure.add_subplot(len(levels), count, row * count + column + 1)
            axes.imshow(band, cmap="magma", interpolation="nearest")
            axes.set(title=f"level {row + 1}, {name}", xticks=[], yticks=[])
    return figure


def draw_scalogram(signal: ArrayLike, scales: Sequence[float], transform: ContinuousWavelet) -> Figure:
    """Plot a signal above the magnitudes of its continuous wavelet transform.

    Parameters
    ----------
    signal : array_like, (N,)
    scales : sequence of float
        The scales of the transform.
    transform : ContinuousWavelet
        The transform of `signal`.

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent.
    """
    values = _checked(signal, "signal", 1, "a signal N")
    size = np.abs(transform.coefficients)
    if size.shape != (len(scales), len(values)):
        raise ValueError(f"transform: {size.shape} coefficients; expected {len(scales)} scales of {len(values)} places")
    figure = Figure(figsize=(7, 5), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1, 3))
    above.plot(values, linewidth=1)
    drawn = below.pcolormesh(np.arange(len(values)), np.asarray(scales, float), size, shading="nearest", cmap="magma")
    below.set(yscale="log", xlabel="sample", ylabel="scale")
    figure.colorbar(drawn, ax=below, label="magnitude")
    return figure


def draw_matches(field: ArrayLike, matches: Sequence[Match] = ()) -> Figure:
    """Plot a vector field in the plane, with the positions and rotations of matched templates.

    Parameters
    ----------
    field : array_like, (M, N, 2)
    matches : sequence of Match
        Results of `match_template`: crosses, with lines that show the rotation of the template.

    Raises
    ------
    TypeError, ValueError
        If `field` is not an array of finite real numbers of this shape.
    """
    array = _checked(field, "field", 3, "a vector field M N 2", 2)
    figure, (axes,) = _figure(1)
    _image(figure, axes, np.hypot(array[..., 0], array[..., 1]), "length", cmap="Blues")
    step = max(1, max(array.shape[:2]) // _ARROWS)
    rows, columns = np.meshgrid(*(np.arange(0, n, step) for n in array.shape[:2]), indexing="ij")
    some = array[::step, ::step]
    # The longest arrow is as long as two steps.
    longest = float(np.hypot(some[..., 0], some[..., 1]).max()) or 1.0
    arrows = {"angles": "xy", "scale_units": "xy", "pivot": "middle", "scale": longest / (2 * step)}
    axes.quiver(columns, rows, some[..., 1], some[..., 0], **arrows)
    for match in matches:
        along = vga2.rotate_vector(match.rotor, np.array([1.0, 0.0], match.rotor.dtype)) * step * 2
        row, column = match.place
        axes.plot(column, row, "+", color="tab:red", markersize=12)
        axes.plot([column, column + along[1]], [row, row + along[0]], "-", color="tab:red")
    return figure


def draw_flow(image: ArrayLike, flow: Flow) -> Figure:
    """Plot an image with motion arrows, and the motion as colours: hue for direction, paler where confidence is low.

    Parameters
    ----------
    image : array_like, (M, N)
        The first image.
    flow : Flow
        Result of `optical_flow`.

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent.
    """
    array = _checked(image, "image", 2, "an image M N")
    if flow.uv.shape != (*array.shape, 2):
        raise ValueError(
            f"flow: shape {flow.uv.shape}; expected that of the image, {array.shape}, with two numbers each"
        )
    figure, (left, right) = _figure(2)
    left.imshow(array, cmap="gray")
    step = max(1, max(array.shape) // _ARROWS)
    rows, columns = np.meshgrid(*(np.arange(0, n, step) for n in array.shape), indexing="ij")
    some = flow.uv[::step, ::step]
    left.quiver(columns, rows, some[..., 0], some[..., 1], angles="xy", scale_units="xy", color="tab:orange")
    u, v = flow.uv[..., 0], flow.uv[..., 1]
    speed = np.hypot(u, v)
    value = speed / (speed.max() or 1.0)
    hue = np.arctan2(v, u) / (2 * np.pi) % 1
    right.imshow(hsv_to_rgb(np.stack([hue, np.clip(flow.confidence, 0, 1), value], -1)))
    for axes, title in ((left, "motion"), (right, f"up to {speed.max():.3g} pixels")):
        axes.set(title=title, xticks=[], yticks=[])
    return figure


def draw_disparity(image: ArrayLike, found: Disparity) -> Figure:
    """Plot the left image, its disparities and their confidence.

    Parameters
    ----------
    image : array_like, (M, N)
    found : Disparity
        Result of `disparity`.

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent.
    """
    array = _checked(image, "image", 2, "an image M N")
    if found.disparity.shape != array.shape:
        raise ValueError(f"found: shape {found.disparity.shape}; expected that of the image, {array.shape}")
    figure, panels = _figure(3)
    panels[0].imshow(array, cmap="gray")
    panels[0].set(title="left image", xticks=[], yticks=[])
    _image(figure, panels[1], found.disparity, "disparity, pixels", cmap="viridis")
    _image(figure, panels[2], found.confidence, "confidence", vmin=0, vmax=1)
    return figure


def draw_denoised(noisy: ArrayLike, clean: ArrayLike) -> Figure:
    """Plot an image before and after `denoise`, and the difference.

    Parameters
    ----------
    noisy, clean : array_like, (M, N)

    Raises
    ------
    TypeError, ValueError
        If `noisy` and `clean` are not finite real images of the same size.
    """
    before, after = (_checked(each, name, 2, "an image M N") for each, name in ((noisy, "noisy"), (clean, "clean")))
    if before.shape != after.shape:
        raise ValueError(f"clean: shape {after.shape}; expected that of the noisy image, {before.shape}")
    figure, panels = _figure(3)
    low, high = before.min(), before.max()
    for axes, image, title in ((panels[0], before, "with noise"), (panels[1], after, "without")):
        axes.imshow(image, cmap="gray", vmin=low, vmax=high)
        axes.set(title=title, xticks=[], yticks=[])
    bound = np.abs(before - after).max() or 1.0
    _image(figure, panels[2], before - after, "taken away", cmap="coolwarm", vmin=-bound, vmax=bound)
    return figure


def draw_textures(features: ArrayLike, labels: Sequence[str]) -> Figure:
    """Plot texture features by their first two principal components, with one colour for each label.

    Parameters
    ----------
    features : array_like, (P, K)
        Results of `texture_features`, at least two distinct ones.
    labels : sequence of P strings

    Raises
    ------
    TypeError, ValueError
        If `features` is not an array of finite real numbers of this shape, or if the number of labels differs.
    """
    array = _checked(features, "features", 2, "features P K")
    if len(labels) != len(array) or min(array.shape) < 2:
        raise ValueError(
            f"labels: {len(labels)} for features of shape {array.shape}; expected one for each, at least two"
        )
    spread = array.std(0)
    scaled = (array - array.mean(0)) / np.where(spread > 0, spread, 1)
    places = scaled @ np.linalg.svd(scaled, full_matrices=False)[2][:2].T
    figure, (axes,) = _figure(1)
    for name in dict.fromkeys(labels):
        some = places[[label == name for label in labels]]
        axes.plot(some[:, 0], some[:, 1], ".", label=name)
    axes.set(xlabel="first component", ylabel="second component")
    axes.legend()
    return figure


def _figure(count: int) -> tuple[Figure, list[Any]]:
    figure = Figure(figsize=(4.2 * count, 4), layout="constrained")
    return figure, [figure.add_subplot(1, count, k + 1) for k in range(count)]


def _image(figure: Figure, axes: Any, values: Any, label: str, cmap: str = "magma", **options: Any) -> None:
    drawn = axes.imshow(values, cmap=cmap, interpolation="nearest", **options)
    axes.set(title=label)
    if "extent" not in options:
        axes.set(xticks=[], yticks=[])
    figure.colorbar(drawn, ax=axes, shrink=0.8)


def _checked(value: ArrayLike, name: str, axes: int, meaning: str, last: int = -1) -> Reals:
    if axes == 2 and meaning.startswith("an image"):
        return single_image(value, name)
    array = real_array(value, name, (*(-1,) * (axes - 1), last), meaning)
    if array.ndim != axes:
        raise ValueError(f"{name}: shape {array.shape}; expected {meaning}")
    check_finite(array, name)
    return array
