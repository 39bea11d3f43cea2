"""Pictures of transforms show the right numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from algorithms.wavelets import (
    Disparity,
    Flow,
    QuaternionPyramid,
    continuous_wavelet,
    discrete_wavelet,
    dual_tree,
    match_template,
    qft,
    quaternion_phase,
)
from algorithms.wavelets.pictures import (
    draw_denoised,
    draw_disparity,
    draw_flow,
    draw_matches,
    draw_phases,
    draw_pyramid,
    draw_scalogram,
    draw_spectrum,
    draw_textures,
)
from tests.support.all_cases import all_cases


def normal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def shown(figure: Any, panel: int = 0) -> np.ndarray:
    """The data of the image in a panel."""
    panels = [axes for axes in figure.axes if axes.images]
    return np.ma.getdata(panels[panel].images[0].get_array())


def saved(figure: Any, path: Path) -> None:
    """The figure can be saved and does not have a single colour."""
    figure.set_layout_engine("none")  # which takes longer than drawing
    figure.savefig(path / "figure.png", dpi=40)
    with Image.open(path / "figure.png") as image:
        assert len(set(image.convert("L").resize((100, 100)).tobytes())) > 10


def test_spectrum(tmp_path: Path) -> None:
    x, y = np.arange(16)[:, None], np.arange(20)
    spectrum = qft(np.cos(2 * np.pi * (3 * x / 16 + 4 * y / 20)) + 0.5)
    figure = draw_spectrum(spectrum)
    values = shown(figure)
    places = {tuple(map(int, each)) for each in np.argwhere(values > 1)}
    assert places == {(8, 10), *((8 + a, 10 + b) for a in (-3, 3) for b in (-4, 4))}
    left, right, bottom, top = figure.axes[0].images[0].get_extent()
    assert (left + right, bottom + top) == (-1, -1) and right - left == 20
    saved(figure, tmp_path)


def test_phases(tmp_path: Path) -> None:
    q = normal(12, 14, 4)
    figure, phase = draw_phases(q), quaternion_phase(q)
    for panel, expected in enumerate((phase.amplitude, phase.phi, phase.theta, phase.psi)):
        assert np.array_equal(shown(figure, panel), expected)
    saved(figure, tmp_path)


def test_pyramids(tmp_path: Path) -> None:
    image = normal(32, 40)
    quaternions, real, tree = QuaternionPyramid(image, 2), discrete_wavelet(image, "haar", 2), dual_tree(image, 2)
    figure = draw_pyramid(quaternions)
    assert len(figure.axes) == 6
    assert np.abs(shown(figure, 4) - quaternions.amplitude()[1]["V"]).max() < 1e-14
    assert np.abs(shown(draw_pyramid(real), 2) - np.abs(real.detail[0]["D"])).max() == 0
    figure = draw_pyramid(tree)
    assert len(figure.axes) == 12 and figure.axes[8].get_title() == "level 2, 75 degrees"
    assert np.abs(shown(figure, 8) - np.abs(tree.detail[1][..., 2])).max() == 0
    saved(figure, tmp_path)


def test_scalogram(tmp_path: Path) -> None:
    signal, scales = normal(100), np.geomspace(1, 20, 12)
    transform = continuous_wavelet(signal, scales)
    figure = draw_scalogram(signal, scales, transform)
    assert np.array_equal(figure.axes[0].lines[0].get_ydata(), signal)
    drawn = np.asarray(figure.axes[1].collections[0].get_array()).reshape(12, 100)
    assert np.array_equal(drawn, np.abs(transform.coefficients))
    saved(figure, tmp_path)


def test_matches(tmp_path: Path) -> None:
    field = normal(24, 30, 2)
    matches = match_template(field, field[4:9, 10:17], "values")
    figure = draw_matches(field, matches)
    cross, line = figure.axes[0].lines
    assert (cross.get_xdata()[0], cross.get_ydata()[0]) == (13, 6)
    # Not rotated: along e1, which points down in the picture.
    assert np.abs(np.diff(line.get_xdata())).max() < 1e-12 and np.diff(line.get_ydata())[0] > 0
    saved(figure, tmp_path)


def test_flow_and_disparity(tmp_path: Path) -> None:
    image, uv = normal(20, 25), np.zeros((20, 25, 2))
    uv[..., 0] = 2.0
    figure = draw_flow(image, Flow(uv, np.ones((20, 25))))
    # Full speed to the right with high confidence is red.
    assert np.array_equal(shown(figure, 1), np.broadcast_to([1.0, 0, 0], (20, 25, 3)))
    assert np.array_equal(shown(figure), image)
    saved(figure, tmp_path)
    found = Disparity(normal(20, 25, seed=1), np.linspace(0, 1, 500).reshape(20, 25))
    figure = draw_disparity(image, found)
    assert np.array_equal(shown(figure, 1), found.disparity) and np.array_equal(shown(figure, 2), found.confidence)
    saved(figure, tmp_path)


def test_denoised_and_textures(tmp_path: Path) -> None:
    noisy, clean = normal(20, 25), normal(20, 25, seed=1)
    figure = draw_denoised(noisy, clean)
    assert np.array_equal(shown(figure, 2), noisy - clean)
    saved(figure, tmp_path)
    features = np.concatenate([normal(10, 6), normal(10, 6, seed=1) + 8])
    figure = draw_textures(features, ["grass"] * 10 + ["brick"] * 10)
    first, second = (line.get_xdata() for line in figure.axes[0].lines)
    assert max(first) < min(second) or max(second) < min(first)
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["grass", "brick"]
    saved(figure, tmp_path)


@all_cases(
    "call, message",
    [
        (lambda f: draw_spectrum(f), "spectrum: shape"),
        (lambda f: draw_phases(np.full((3, 4, 4), np.nan)), "q: a number is not finite"),
        (lambda f: draw_pyramid(QuaternionPyramid(f, 0)), "of one image, of at least one level"),
        (lambda f: draw_pyramid(discrete_wavelet(f[0], "haar", 1)), "of one image"),
        (
            lambda f: draw_scalogram(f[0], [1.0], continuous_wavelet(f[0], [1.0, 2.0])),
            r"transform: \(2, 9\) coefficients",
        ),
        (lambda f: draw_matches(f), "field: shape"),
        (lambda f: draw_flow(f, Flow(np.zeros((2, 2, 2)), f)), "flow: shape"),
        (lambda f: draw_disparity(f, Disparity(f[:2], f)), "found: shape"),
        (lambda f: draw_denoised(f, f[:2]), "clean: shape"),
        (lambda f: draw_textures(f, ["a"]), "labels: 1 for features of shape"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(normal(8, 9))
