"""Rectification: equal rows, no shear, depths, swapped and vertical pairs, and pairs that have none."""

import numpy as np
import pytest
from rig_scenes import motor

from algorithms.vision import Camera, DegenerateError, Distortion, rectify
from generated import pga3
from tests.support.all_cases import all_cases

LENS = Distortion("brown", (-0.2, 0.05, 1e-3, -2e-3))
FIRST = Camera.from_intrinsics((800.0, 790.0), (640, 400), distortion=LENS)
SIZE = (1280, 800)


def other(shift, turn=(0.05, -0.1, 0.08), lens=None):
    return Camera.from_intrinsics((500.0, 510.0), (320, 240), motor(turn, shift), skew=2.0, distortion=lens)


def points(seed):
    rng = np.random.default_rng(seed)
    return np.c_[rng.uniform(-1, 1, (60, 2)), rng.uniform(4, 8, 60)]


@all_cases("lens", [None, Distortion("fisheye", (0.01, -0.002))])
@all_cases("shift", [(1.0, 0.1, 0.2), (-1.0, 0.0, 0.1), (0.1, 1.0, 0.0), (1e-3, 1e-4, 0), (4e3, 0, 500.0)])
def test_rows_are_equal_and_pixels_are_those_of_the_new_cameras(shift, lens):
    second, scale = other(shift, lens=lens), np.linalg.norm(shift)
    found = rectify(FIRST, second, SIZE, second_size=(640, 480))
    X = scale * points(1)
    one, two = found.points(FIRST.project(X), 0), found.points(second.project(X), 1)
    assert np.nanmax(np.abs(one[:, 1] - two[:, 1])) < 1e-9
    for k, (seen, new) in enumerate(zip((one, two), found.cameras, strict=True)):
        assert np.nanmax(np.abs(seen - new.project(X))) < 1e-9 and np.isfinite(seen).all(1).sum() > 50
        # A rotation, then one focal length in both directions: no shear.
        assert (
            np.allclose(found.rotations[k] @ found.rotations[k].T, np.eye(3)) and np.linalg.det(found.rotations[k]) > 0
        )
        assert new.intrinsics[0, 0] == new.intrinsics[1, 1] and new.intrinsics[0, 1] == 0
    if found.is_swapped:
        with pytest.raises(ValueError, match="second camera is on the left"):
            found.pair()
        found, one, two = rectify(second, FIRST, (640, 480), second_size=SIZE), None, None
        one, two = found.points(second.project(X), 0), found.points(FIRST.project(X), 1)
    depth = found.pair().depth(one[:, 0] - two[:, 0])
    assert np.allclose(depth[np.isfinite(depth)], found.cameras[0].depth(X)[np.isfinite(depth)], rtol=1e-9)


def test_all_of_both_images_is_shown_and_maps_invert_points():
    second = other((1.0, 0.1, 0.2))
    found = rectify(FIRST, second, SIZE, second_size=(640, 480), new_size=(450, 350))
    for k, (camera, (width, height)) in enumerate(((FIRST, SIZE), (second, (640, 480)))):
        corners = np.array([[0.0, 0], [width - 1, 0], [0, height - 1], [width - 1, height - 1]])
        places = found.points(corners, k)
        assert (places > -1e-6).all() and (places < np.array([449, 349]) + 1e-6).all()
        table = found.map(k)
        rows, columns = (np.array([100, 175, 250]), np.array([150, 225, 300]))
        assert np.allclose(found.points(table[rows, columns], k), np.stack([columns, rows], 1), atol=1e-7)
        assert np.isfinite(camera.undistort(table[175, 225])).all()


def test_a_ramp_becomes_the_coordinates_of_the_map():
    """Bilinear interpolation of an image whose value is x or y gives the map itself."""
    found = rectify(FIRST, other((1.0, 0, 0)), SIZE, new_size=(60, 40), second_size=(640, 480))
    x, y = np.meshgrid(np.arange(1280.0), np.arange(800.0))
    image, table = found.image(np.stack([x, y], -1), 0), found.map(0)
    inside = np.isfinite(image).all(-1)
    assert inside.mean() > 0.2 and np.allclose(image[inside], table[inside], atol=1e-9)
    assert found.image(x.astype(np.float32), 0).dtype == np.float32


def test_a_rectified_pair_remains_as_it_is_and_a_focal_length_can_be_given():
    left = Camera.from_intrinsics(600.0, (319.5, 239.5))
    right = Camera.from_intrinsics(600.0, (319.5, 239.5), motor([0, 0, 0], [0.2, 0, 0]))
    found = rectify(left, right, (640, 480), focal_length=600.0)
    assert np.allclose(found.rotations, np.eye(3)) and np.allclose(found.cameras[0].intrinsics, left.intrinsics)
    assert abs(found.pair().baseline - 0.2) < 1e-12 and abs(found.pair().offset) < 1e-9
    away = [Camera(c.intrinsics, pga3.motor_product(motor([0, 0, 0], [1e6] * 3), c.pose)) for c in (left, right)]
    assert np.allclose(rectify(*away, (640, 480)).rotations, np.eye(3), atol=1e-9)


def test_what_has_no_rectification():
    for shift in ((0, 0, 1.0), (0.1, 0, -1.0), (0, 0, 0)):
        with pytest.raises(DegenerateError):
            rectify(FIRST, other(shift, turn=(0, 0, 0)), SIZE)
    with pytest.raises(DegenerateError):
        rectify(FIRST, other((1.0, 0, 0), turn=(0, np.pi, 0)), SIZE)
    with pytest.raises(TypeError, match="second: ndarray"):
        rectify(FIRST, np.eye(3), SIZE)
    with pytest.raises(ValueError, match="focal_length: -1"):
        rectify(FIRST, other((1.0, 0, 0)), SIZE, focal_length=-1)
    with pytest.raises(ValueError, match="which: 2"):
        rectify(FIRST, other((1.0, 0, 0)), SIZE, second_size=(640, 480)).map(2)
    with pytest.raises(ValueError, match="new_size: 1 x 5"):
        rectify(FIRST, other((1.0, 0, 0)), SIZE, new_size=(1, 5))
