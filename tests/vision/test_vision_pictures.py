"""Pictures of views: lines pass through partners, curves are on conics, points are at their positions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from test_views import scene
from test_vision import homogeneous

from algorithms.vision import MOTORCYCLE, OmnidirectionalCamera, conic_value, fundamental_matrix, triangulate
from algorithms.vision.pictures import (
    draw_cloud,
    draw_epipolar_lines,
    draw_matches,
    draw_omnidirectional,
    lines_in_image,
)


def colours_of(figure: Figure, path: Path) -> int:
    """The number of shades of grey in a small copy of the saved picture."""
    figure.savefig(path)
    with Image.open(path) as image:
        return len(set(image.convert("L").resize((120, 120)).tobytes()))


def test_lines_end_at_the_frame() -> None:
    rng = np.random.default_rng(1)
    lines = rng.normal(size=(500, 3)) * [1, 1, 200]
    ends = lines_in_image(lines, 640, 480)
    missed = np.isnan(ends).any((1, 2))
    assert 0 < missed.sum() < 500
    on_line = (homogeneous(ends[~missed]) * lines[~missed, None]).sum(-1)
    assert np.abs(on_line).max() < 1e-9
    x, y = ends[~missed][..., 0], ends[~missed][..., 1]
    on_frame = np.min([np.abs(x + 0.5), np.abs(x - 639.5), np.abs(y + 0.5), np.abs(y - 479.5)], axis=0)
    assert on_frame.max() < 1e-6
    # A line misses the image if all four corners are on one side of it.
    corners = homogeneous(np.array([[-0.5, -0.5], [639.5, -0.5], [-0.5, 479.5], [639.5, 479.5]]))
    sides = corners @ lines.T
    assert np.array_equal(missed, (sides > 0).all(0) | (sides < 0).all(0))
    for pair in ([[3, -0.5], [3, 7.5]], [[-0.5, 3], [9.5, 3]], [[-0.5, -0.5], [9.5, 7.5]], [[-0.5, 7.5], [4, -0.5]]):
        line = np.cross(*homogeneous(np.array(pair)))
        assert np.allclose(sorted(lines_in_image(line, 10, 8).tolist()), pair, atol=1e-12)


@pytest.mark.slow
def test_epipolar_lines_and_matches_of_the_motorcycle(tmp_path: Path) -> None:
    left, right, disparity = pytest.importorskip("skimage.data").stereo_motorcycle()
    pixels, partners = (x[::20000] for x in MOTORCYCLE.correspondences(disparity.astype(float)))
    figure = draw_epipolar_lines(left, right, fundamental_matrix(*MOTORCYCLE.cameras()), pixels, partners)
    for axes, points in zip(figure.axes, (pixels, partners), strict=True):
        segments = np.array(axes.collections[0].get_segments())
        assert len(segments) == len(pixels)
        # Rows of a rectified pair.
        assert np.abs(segments[..., 1] - points[:, 1:]).max() < 1e-9
        assert np.array_equal(axes.collections[1].get_offsets(), points)
    assert colours_of(figure, tmp_path / "lines.png") > 20
    good = np.arange(len(pixels)) % 3 > 0
    figure = draw_matches(left, right, pixels, partners, good)
    segments = np.array(figure.axes[0].collections[0].get_segments())
    assert np.array_equal(segments[:, 0], pixels)
    assert np.array_equal(segments[:, 1], partners + np.array([left.shape[1], 0]))
    red = np.array(figure.axes[0].collections[0].get_colors())[:, 0] > 0.5
    assert np.array_equal(red, ~good)
    assert colours_of(figure, tmp_path / "matches.png") > 20


def test_a_cloud_and_its_cameras(tmp_path: Path) -> None:
    left, _, disparity = pytest.importorskip("skimage.data").stereo_motorcycle()
    pixels, partners = (x[::3000] for x in MOTORCYCLE.correspondences(disparity.astype(float)))
    cameras = MOTORCYCLE.cameras()
    points = triangulate(cameras, (pixels, partners))
    points[3] = np.inf
    x, y = pixels.T.astype(int)
    figure = draw_cloud(points, cameras, left[y, x] / 255)
    (axes,) = figure.axes
    drawn = np.stack(axes.collections[0]._offsets3d, -1)
    assert np.array_equal(drawn, np.delete(points, 3, 0))
    centres = {tuple(np.round(np.array(line.get_data_3d())[:, 0], 9)) for line in axes.lines}
    assert centres == {(0.0, 0.0, 0.0), (193.001, 0.0, 0.0)} and len(axes.lines) == 6
    assert colours_of(figure, tmp_path / "cloud.png") > 10
    with pytest.raises(ValueError, match="colours"):
        draw_cloud(points, (), np.zeros((3, 3)))


@pytest.mark.parametrize("mirror", [0.7, 1.0])
def test_curves_of_lines_are_on_their_conics(mirror: float, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    pose = scene(rng, 1, 3)[0][0].pose
    camera = OmnidirectionalCamera.from_intrinsics(200.0, (320, 240), mirror, pose)
    a, b = rng.normal(size=(2, 6, 3)) * 2
    figure = draw_omnidirectional(camera, a, b, 640, 480)
    assert len(figure.axes[0].lines) == 6
    for k, line in enumerate(figure.axes[0].lines):
        curve = np.stack(line.get_data(), -1)
        curve = curve[np.isfinite(curve).all(-1) & (np.abs(curve) < 5000).all(-1)]
        conic = camera.conic_of_line(a[k], b[k])
        assert len(curve) > 100
        assert np.abs(conic_value(conic, curve) / conic_value(np.abs(conic), np.abs(curve))).max() < 1e-11
    assert colours_of(figure, tmp_path / "curves.png") > 5
    with pytest.raises(ValueError, match="second"):
        draw_omnidirectional(camera, a, b[1:], 640, 480)


def test_wrong_images() -> None:
    points, matrix = np.zeros((3, 2)), np.eye(3)
    with pytest.raises(ValueError, match="first: float64 of shape"):
        draw_epipolar_lines(np.zeros(3), np.zeros((4, 4)), matrix, points, points)
    with pytest.raises(ValueError, match="second: 1 masked numbers"):
        draw_matches(np.zeros((4, 4)), np.ma.array(np.zeros((4, 4)), mask=np.eye(16)[5].reshape(4, 4)), points, points)
    with pytest.raises(ValueError, match="partners: 2 points"):
        draw_matches(np.zeros((4, 4)), np.zeros((4, 4)), points, points[1:])
    with pytest.raises(ValueError, match="inliers"):
        draw_matches(np.zeros((4, 4)), np.zeros((4, 4)), points, points, [True])
