"""Lenses with distortion, compared with closed forms: images of points, inverses, derivatives, images, and files."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from algorithms import vision
from algorithms.vision import Camera, Distortion, OmnidirectionalCamera, VisionStatus
from generated import lenses, pga3, projective3

POSE = pga3.motor_from_rotation_vector_translation(np.array([0.1, -0.2, 0.3]), np.array([0.2, -0.1, -5.0]))
BROWN = Distortion("brown", (-0.28, 0.1, 1e-3, -2e-3, 0.02, 0.03, 0.01, -0.005))
FISHEYE = Distortion("fisheye", (-0.03, 0.004, 0.001, -0.0005))
LENSES = [BROWN, Distortion("brown", (-0.3,)), Distortion("brown", (0.2, 0, 0.003, 0.002)), FISHEYE]


def camera(lens=None, focal=600.0, pose=POSE):
    return Camera.from_intrinsics((focal, 1.01 * focal), (330.0, 235.0), pose, 0.4, lens)


def sights(rng, n, widest):
    """Random directions up to an angle from the axis."""
    angle, turn = rng.uniform(0, widest, n), rng.uniform(0, 2 * np.pi, n)
    return np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], -1)


def test_brown_by_exact_rationals() -> None:
    x, y = Fraction(3, 10), Fraction(-1, 5)
    k1, k2, p1, p2, k3, k4, k5, k6 = k = [Fraction(n, 100) for n in (-28, 10, 1, -2, 3, 5, -4, 2)]
    r = x**2 + y**2
    factor = (1 + k1 * r + k2 * r**2 + k3 * r**3) / (1 + k4 * r + k5 * r**2 + k6 * r**3)
    expected = (
        x * factor + 2 * p1 * x * y + p2 * (r + 2 * x**2),
        y * factor + p1 * (r + 2 * y**2) + 2 * p2 * x * y,
    )
    found = Distortion("brown", tuple(map(float, k))).distort([float(x), float(y), 1.0])
    assert np.abs(found - np.array(expected, float)).max() < 1e-15


def test_a_fisheye_lens_with_the_series_of_stereographic_projection() -> None:
    # 2 tan(a / 2) = a + a^3 / 12 + a^5 / 120 + 17 a^7 / 20160 + 31 a^9 / 362880 + ...
    lens = Distortion("fisheye", (1 / 12, 1 / 120, 17 / 20160, 31 / 362880))
    directions = sights(np.random.default_rng(0), 50, 0.25)
    expected = 2 * directions[:, :2] / (1 + directions[:, 2:])
    assert np.abs(lens.distort(7 * directions) - expected).max() < 3e-12


@pytest.mark.parametrize("lens", [None, *LENSES])
def test_lines_of_sight_in_the_world_lead_from_the_centre_to_the_points(lens) -> None:
    eye, matrix = camera(lens), pga3.motor_to_matrix(POSE)
    points = 7 * sights(np.random.default_rng(5), 40, 0.3) @ matrix[:3, :3].T + matrix[:3, 3]
    away = points - matrix[:3, 3]
    assert np.abs(eye.centre - matrix[:3, 3]).max() < 1e-14
    assert np.abs(eye.rays(eye.project(points)) - away / np.linalg.norm(away, axis=1, keepdims=True)).max() < 1e-11


def test_equidistant_images_behind_the_lens() -> None:
    lens = Distortion("fisheye")
    angle = np.array([0, 0.5, np.pi / 2, 3.0])
    directions = np.stack([np.sin(angle), np.zeros(4), np.cos(angle)], -1)
    assert np.abs(lens.distort(directions) - np.stack([angle, np.zeros(4)], -1)).max() < 1e-14
    assert np.abs(lens.undistort(np.stack([angle, np.zeros(4)], -1)) - directions).max() < 1e-14
    assert np.isnan(lens.undistort([3.2, 0.0])).all()
    eye = camera(lens, pose=None)
    pixels = eye.project(5 * directions)
    assert np.isfinite(pixels).all() and np.abs(eye.directions(pixels) - directions).max() < 1e-13
    assert np.isnan(eye.undistort(pixels)).any(1).tolist() == [False, False, True, True]


def test_the_division_model_has_a_closed_inverse() -> None:
    lens = Distortion("brown", (0, 0, 0, 0, 0, 0.4))
    x = np.array([0.1, 0.5, 1.0, 1.5])
    bent = x / (1 + 0.4 * x * x)
    # r = b (1 + 0.4 r^2) has the smaller root (1 - sqrt(1 - 1.6 b^2)) / (0.8 b), up to the turning point r^2 = 1 / 0.4.
    assert lens.limit == pytest.approx(np.sqrt(2.5), rel=1e-12)
    expected = (1 - np.sqrt(1 - 1.6 * bent**2)) / (0.8 * bent)
    found = lens.undistort(np.stack([0 * bent, bent], -1))
    assert np.abs(found[:, 1] - expected).max() < 1e-12 and np.abs(expected - x).max() < 1e-12


@pytest.mark.parametrize("lens", LENSES, ids=lambda lens: f"{lens.model}{len(set(lens.coefficients))}")
def test_undistorted_pixels_are_those_of_the_pinhole(lens: Distortion) -> None:
    rng, one = np.random.default_rng(1), camera(lens)
    points = pga3.move_point(POSE, 4 * sights(rng, 300, 0.6))
    pixels, plain = one.project(points), one.pinhole.project(points)
    assert np.abs(one.undistort(pixels) - plain).max() < 1e-9 and np.abs(one.distort(plain) - pixels).max() < 1e-9
    assert np.abs(pixels - plain).max() > 5
    to_camera = pga3.move_point_back(POSE, points)
    assert np.abs(one.directions(pixels) * np.linalg.norm(to_camera, axis=1)[:, None] - to_camera).max() < 1e-11
    few = points[:4].astype(np.float32)
    assert one.project(few).dtype == one.undistort(few[:, :2]).dtype == np.float32
    assert one.project(np.empty((0, 3))).shape == (0, 2) and one.undistort(np.empty((2, 0, 2))).shape == (2, 0, 2)
    assert one.project(points.tolist()).shape == (300, 2) and one.project(points[::-2].copy()).shape == (150, 2)


def test_results_without_distortion_are_those_of_the_pinhole_to_the_bit() -> None:
    one, points = camera(), np.random.default_rng(2).normal(size=(50, 3))
    assert np.array_equal(one.project(points), projective3.project_point(one.matrix, points))
    pixels = one.project(points)
    assert one.distort(pixels) is pixels and one.undistort(pixels) is pixels and one.pinhole is one


def test_beyond_the_turning_point_there_is_no_image() -> None:
    lens = Distortion("brown", (-0.3,))
    turning = 1 / np.sqrt(0.9)
    assert lens.limit == pytest.approx(turning, rel=1e-12)
    highest = turning * (1 - 0.3 * turning**2)
    assert (
        np.isfinite(lens.distort([0.999 * turning, 0, 1])).all()
        and np.isnan(lens.distort([1.001 * turning, 0, 1])).all()
    )
    assert (
        np.isfinite(lens.undistort([0, 0.999 * highest])).all() and np.isnan(lens.undistort([0, 1.001 * highest])).all()
    )
    wide = camera(lens, pose=None)
    assert np.isnan(wide.project([[2.0, 0, 1], [0.1, 0, -1], [0, 0, 0], [np.nan, 0, 1]])).all()
    assert np.isfinite(wide.project([0.1, 0, 1.0])).all()
    assert Distortion("fisheye", (-0.1,)).limit == pytest.approx(np.sqrt(1 / 0.3))
    assert Distortion("brown", (0.2, 0.1)).limit == np.inf and Distortion("fisheye").limit == np.pi


def test_no_two_directions_within_the_limit_have_the_same_image() -> None:
    rng = np.random.default_rng(3)
    for _ in range(60):
        lens = Distortion("brown", tuple(rng.normal(size=8) * [0.4, 0.2, 0.02, 0.02, 0.1, 0.2, 0.1, 0.05]))
        far, turn = min(lens.limit, 3.0) * np.sqrt(rng.random(200)), rng.uniform(0, 2 * np.pi, 200)
        directions = np.stack([far * np.cos(turn), far * np.sin(turn), np.ones(200)], -1)
        bent = lens.distort(directions)
        found = lens.undistort(bent)
        known = np.isfinite(found).all(1)
        assert np.isfinite(bent).all() and known.mean() > 0.98
        assert np.abs(found - directions)[known].max() < 1e-8 * (1 + far.max())
        # Places all over the plane: what is found is within the limit, and has that image.
        places = rng.uniform(-3, 3, (200, 2))
        there = lens.undistort(places)
        inside = np.isfinite(there).all(1)
        assert (np.hypot(*there[inside, :2].T) <= lens.limit).all()
        assert np.abs(lens.distort(there[inside]) - places[inside]).max(initial=0) < 1e-11


def test_derivatives_are_those_of_differences() -> None:
    rng, intrinsics = np.random.default_rng(4), np.array([600.0, 610.0, 320.0, 240.0, 1.5])
    motor = pga3.motor_inverse(POSE)
    for lens, project, derivatives in (
        (BROWN, lenses.project_brown, lenses.project_brown_derivatives),
        (FISHEYE, lenses.project_fisheye, lenses.project_fisheye_derivatives),
    ):
        place, k = rng.normal(size=3), lens.array

        def image(x, lens=lens, place=place, project=project):
            own, k, b = np.split(x, [5, len(x) - 6])
            moved = pga3.motor_to_matrix(pga3.motor_product(pga3.motor_exponential(b), motor))[:3]
            return project(moved, own, k, lens.limit, place)[0]

        x = np.concatenate([intrinsics, k, np.zeros(6)])
        steps = 1e-6 * np.eye(len(x))
        expected = np.stack([(image(x + h) - image(x - h)) / 2e-6 for h in steps], -1)
        pixel, rows = derivatives(pga3.motor_to_matrix(motor)[:3], intrinsics, k, place)
        assert np.abs(rows - expected).max() < 1e-6 and np.array_equal(pixel, image(x))
    # On the axis of a fisheye lens, where the square root has no derivative.
    _, rows = lenses.project_fisheye_derivatives(np.eye(4)[:3], intrinsics, FISHEYE.array, [0, 0, 2.0])
    # There it is a pinhole: a bivector B turns by twice its size about an axis, and moves by as much along one.
    expected = [[0, 1200, 3, -600, -1.5, 0], [0, 0, 1220, 0, -610, 0]]
    assert np.abs(rows[:, 9:] - expected).max() < 1e-9


def test_poses_and_points_through_a_lens() -> None:
    rng = np.random.default_rng(5)
    points = rng.uniform(-1, 1, (30, 3))
    aside = pga3.motor_from_rotation_vector_translation(np.array([0.0, 0.25, 0.1]), np.array([1.5, 0, -4.5]))
    eyes = camera(BROWN), camera(FISHEYE, 500.0, aside)
    seen = [eye.project(points) for eye in eyes]
    for eye, pixels in zip(eyes, seen, strict=True):
        found = vision.localize(points, pixels, eye)
        assert found.status == VisionStatus.OK
        assert np.abs(pga3.motor_to_matrix(found.pose) - pga3.motor_to_matrix(eye.pose)).max() < 1e-8
        assert vision.localizations(points[None], pixels[None], eye).status[0] == VisionStatus.OK
        assert not vision.localize(points, pixels, eye.intrinsics).residual < 1
    assert np.abs(vision.triangulate(eyes, seen) - points).max() < 1e-8
    noisy = [pixels + 0.3 * rng.normal(size=pixels.shape) for pixels in seen]
    found = vision.triangulation(eyes, noisy, noise=0.3)
    assert (found.status == VisionStatus.OK).all()
    off = np.linalg.norm(found.points - points, axis=1) / found.deviation
    assert np.sqrt(np.mean(off**2)) < 2.5
    assert (vision.triangulation(eyes, (seen[0] + [0, 30.0], seen[1]), 0.3).status == VisionStatus.NO_CONSENSUS).all()
    turned = camera(Distortion("brown", (-0.3,)))
    assert vision.localize(points, seen[0] + 1e5, turned).status == VisionStatus.NOT_FINITE


def test_functions_of_matrices_refuse_lenses() -> None:
    bent, plain = camera(BROWN), camera(pose=None)
    for call in (
        lambda: vision.fundamental_matrix(plain, bent),
        lambda: vision.trifocal_tensor(plain, plain, bent),
        lambda: vision.quadrifocal_tensor(bent, plain, plain, plain),
    ):
        with pytest.raises(ValueError, match="pinhole"):
            call()
    assert vision.fundamental_matrix(plain, bent.pinhole).shape == (3, 3)


@pytest.mark.parametrize("mirror", [0.0, 0.8, 1.0, 1.4])
def test_the_unified_model_with_distortion(mirror: float) -> None:
    """Mei's formulas: the sphere, the plane seen from the pole, Brown's polynomial there, and K."""
    rng = np.random.default_rng(130)
    k1, k2, p1, p2 = -0.2, 0.03, 1e-3, -2e-3
    lens = Distortion("brown", (k1, k2, p1, p2))
    eye = OmnidirectionalCamera.from_intrinsics((300.0, 310.0), (320, 240), mirror, POSE, lens)
    sights = rng.normal(size=(500, 3))
    sights = sights[sights[:, 2] > 0.5 * np.linalg.norm(sights, axis=1)]
    x, y, z = (sights / np.linalg.norm(sights, axis=1, keepdims=True)).T
    x, y = x / (z + mirror), y / (z + mirror)
    square = x * x + y * y
    radial = 1 + k1 * square + k2 * square**2
    bent = [
        x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x),
        y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y,
    ]
    seen = square < 0.9 * lens.limit**2
    pixels = eye.project(pga3.move_point(POSE, 7 * sights))
    assert seen.sum() > 100
    assert np.allclose(pixels[seen], np.transpose(bent)[seen] * [300, 310] + [320, 240], rtol=0, atol=1e-9)
    off = eye.directions(pixels)[seen] - (sights / np.linalg.norm(sights, axis=1, keepdims=True))[seen]
    assert np.abs(off).max() < 1e-9
    with pytest.raises(ValueError, match="distortion"):
        eye.conic_of_line([0, 0, 1], [1, 0, 1])
    with pytest.raises(ValueError, match="fisheye"):
        OmnidirectionalCamera.from_intrinsics(300.0, (320, 240), mirror, distortion=FISHEYE)


def test_invalid_lenses() -> None:
    for arguments, error, text in (
        (("pinhole", ()), ValueError, "expected 'brown' or 'fisheye'"),
        (("fisheye", (1.0,) * 5), ValueError, "at most 4"),
        (("brown", (np.nan,)), ValueError, r"coefficients\[0\]: nan"),
        (("brown", ("a",)), TypeError, "expected a number"),
    ):
        with pytest.raises(error, match=text):
            Distortion(*arguments)
    with pytest.raises(TypeError, match="expected a Distortion"):
        Camera.from_intrinsics(1.0, (0, 0), distortion=-0.3)
    assert Distortion("brown", (-0.1,)) == Distortion("brown", (-0.1, 0.0)) != Distortion("fisheye", (-0.1,))
    assert len({Distortion("brown"), Distortion("brown", (0,))}) == 1


def test_images_without_distortion() -> None:
    # Bilinear interpolation of a linear image is exact: pixels of the result are the place in the image.
    x, y = np.meshgrid(np.arange(160.0), np.arange(120.0))
    lens = Camera.from_intrinsics(100.0, (80.0, 60.0), distortion=Distortion("brown", (-0.3, 0.05, 0.002, 0.001)))
    for image in (x, np.stack([x, y], -1), np.stack([x, y, x + 2 * y], -1), np.stack([x, y], -1).astype(np.float32)):
        found = vision.undistort_image(image, lens)
        expected = lens.distort(np.stack([x, y], -1))
        inside = ((expected >= 0) & (expected <= [159, 119])).all(-1)
        channels = found.reshape(120, 160, -1)
        assert found.dtype == image.dtype and found.shape == image.shape
        assert np.array_equal(np.isfinite(channels).all(-1), inside)
        assert np.abs(channels[..., 0] - expected[..., 0])[inside].max() < (1e-10 if image.dtype == float else 2e-4)
        assert channels.shape[2] == 1 or np.abs(channels[..., 1] - expected[..., 1])[inside].max() < 2e-4
    wide = Camera.from_intrinsics(50.0, (70.0, 60.0))
    found = vision.undistort_image(np.stack([x, y], -1), lens, wide, (140, 110))
    rays = (np.stack(np.meshgrid(np.arange(140.0), np.arange(110.0)), -1) - [70, 60]) / 50
    expected = 100 * lens.distortion.distort(np.insert(rays, 2, 1, axis=-1)) + [80, 60]
    inside = np.isfinite(found).all(-1)
    assert found.shape == (110, 140, 2) and 0.5 < inside.mean() < 1
    assert np.abs(found - expected)[inside].max() < 1e-9
    assert np.array_equal(vision.undistort_image(x[:1, :1], lens.pinhole), x[:1, :1])
    for arguments, text in (((x[0], lens), "image"), ((x, lens, lens), "target"), ((x, lens, None, (0, 3)), "size")):
        with pytest.raises(ValueError, match=text):
            vision.undistort_image(*arguments)
    with pytest.raises(TypeError, match="expected a Camera"):
        vision.undistort_image(x, lens.intrinsics)


@pytest.mark.parametrize("format", ["opencv", "ros"])
@pytest.mark.parametrize("lens", [None, Distortion("brown", (-0.3, 0.1, 1e-3, 2e-4, 1 / 3)), BROWN, FISHEYE])
def test_files_have_the_same_camera(lens, format, tmp_path) -> None:
    path, one = (
        tmp_path / "camera.yaml",
        replace(camera(lens), intrinsics=np.array([[600 / 7, 1 / 3, 0.1], [0, 1e-3, 2 / 9], [0, 0, 1]])),
    )
    vision.write_camera(path, one, (640, 480), format=format)
    found, size = vision.read_camera(path)
    assert np.array_equal(found.intrinsics, one.intrinsics) and found.distortion == lens and size == (640, 480)
    assert found.pose.tolist() == [1, 0, 0, 0, 0, 0, 0, 0]
    assert path.read_text().startswith("%YAML:1.0\n---\n") == (format == "opencv")


OF_OPENCV = """%YAML:1.0
---
calibration_time: "Sat 28 Nov 2026 12:00:00"
nr_of_frames: 2
image_width: 640
image_height: 480
# flags:  +fix_aspectRatio
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 6.5e+02, 0., 3.195e+02, 0.,
       651., 2.395e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.5e-01, 1., 0., 0.,
       1.2e-01 ]
image_points: !!opencv-matrix
   rows: 1
   cols: 2
   dt: "2f"
   data: [ 1., 2., 3., 4. ]
names:
   - "a.jpg"
"""


def test_damaged_files_are_named(tmp_path) -> None:
    path = tmp_path / "camera.yml"
    path.write_text(OF_OPENCV)
    found, size = vision.read_camera(path)
    assert size == (640, 480) and found.intrinsics.tolist() == [[650, 0, 319.5], [0, 651, 239.5], [0, 0, 1]]
    assert found.distortion == Distortion("brown", (-0.25, 1, 0, 0, 0.12))
    for old, new, text in (
        ("camera_matrix", "matrix", "no camera_matrix"),
        ("   cols: 3\n", "   cols: 4\n", "9 numbers; expected 3 x 4"),
        ("   rows: 3\n", "", "expected rows, cols and data"),
        ("651.", "six", "expected numbers"),
        ("651.", ".Nan", "expected numbers|not finite"),
        ("651.", "0.", "expected 3 x 3 numbers"),
        ("image_height: 480", "image_height: high", "image_height"),
        ("names:", "distortion_model: cubic\nnames:", "distortion_model 'cubic'"),
        ("names:", "fisheye_model: 1\nnames:", "expected 4"),
        ("%YAML:1.0\n---\n", "no yaml at all\n", "line 1"),
        ('4. ]\nnames:\n   - "a.jpg"\n', "4.", "no end"),
    ):
        assert old in OF_OPENCV
        path.write_text(OF_OPENCV.replace(old, new))
        with pytest.raises(ValueError, match=text) as caught:
            vision.read_camera(path)
        assert str(path) in str(caught.value)
    prisms = OF_OPENCV.replace("rows: 5", "rows: 12").replace("1.2e-01 ]", "1.2e-01, 0, 0, 0, 1, 0, 0, 0 ]")
    path.write_text(prisms)
    with pytest.raises(ValueError, match="thin prisms"):
        vision.read_camera(path)
    with pytest.raises(FileNotFoundError):
        vision.read_camera(tmp_path / "none.yml")
    for options, text in (({"format": "xml"}, "format"), ({"format": "ros"}, "size"), ({"name": "a b"}, "name")):
        with pytest.raises(ValueError, match=text):
            vision.write_camera(path, camera(), **options)
    with pytest.raises(ValueError, match="size"):
        vision.write_camera(path, camera(), (640, -1))
