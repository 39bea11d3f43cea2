"""Raster images of scenes, compared with closed forms: areas, conics, hidden surfaces, light, lens and sensor."""

import numpy as np
import pytest

from algorithms.shapes import ColourStatus, segment_colour
from algorithms.vision import Camera, Distortion
from algorithms.vision.objects import ImageSettings, ObjectModel, Scene, SceneCamera, SceneObject, scene_image
from algorithms.vision.objects.scene_images import textured_background
from generated import pga3
from tests.support.grasp_scene import motor
from tests.support.scans import box, scan

SIZE = (160, 120)
CAMERA = Camera.from_intrinsics(200.0, (80.0, 60.0))
WHITE = (1.0, 1.0, 1.0)
RED = (0.8, 0.25, 0.15)
NOTHING = ObjectModel.of(points=[[0, 0, 0]])


def with_lens(k):
    """The camera with a lens of radial distortion k."""
    return Camera(CAMERA.intrinsics, CAMERA.pose, Distortion("brown", (k,)) if k else None)


def seen(*objects, distortion=0.0, **settings):
    settings = {"background": (0.0, 0.0, 0.0), "ambient": 1.0, **settings}
    return scene_image(Scene((SceneCamera(with_lens(distortion), SIZE),), objects), 0, ImageSettings(**settings))


def ball(place, radius, colour=WHITE):
    return SceneObject(
        f"ball{place}", ObjectModel.of(spheres=[[0, 0, 0, radius]]), motor((0, 0, 0), place), colour=colour
    )


def distances_from_silhouette(pixels, place, radius, camera=CAMERA):
    """Distances in pixels from the silhouette of a sphere, by the angles of lines of sight with its centre."""
    sights = np.column_stack([pixels, np.ones(len(pixels))]) @ np.linalg.inv(camera.intrinsics).T
    sights /= np.linalg.norm(sights, axis=1, keepdims=True)
    far = np.linalg.norm(place)
    # On a sphere about the centre of the camera, an angle is seen larger by the square of the secant, radially.
    return (np.arccos(sights @ place / far) - np.arcsin(radius / far)) * camera.intrinsics[0, 0] / sights[:, 2] ** 2


def test_covered_areas_of_a_ball_a_can_and_a_plate() -> None:
    # A sphere on the axis is a disc with the tangent of the cone's half angle as radius.
    radius = 200 * np.tan(np.arcsin(0.1 / 0.7))
    assert abs(seen(ball((0, 0, 0.7), 0.1))[..., 0].sum() - np.pi * radius**2) < 5e-4 * np.pi * radius**2
    # The end of a cylinder along the axis hides its side.
    model = ObjectModel.of(cylinders=[[0, 0, 0.6, 0, 0, 0.9, 0.1]])
    can = SceneObject("can", model, motor((0, 0, 0), (0, 0, 0)), colour=WHITE)
    area = np.pi * (200 * 0.1 / 0.6) ** 2
    assert abs(seen(can)[..., 0].sum() - area) < 5e-4 * area
    # An upright box: a rectangle with sides between pixels.
    plate = SceneObject("plate", NOTHING, motor((0, 0, 0), (0.011, 0.007, 0.605)), *box(0.1, 0.07, 0.01), WHITE)
    area = 200**2 * 0.1 * 0.07 / 0.6**2
    assert abs(seen(plate)[..., 0].sum() - area) < 1e-3 * area


@pytest.mark.parametrize("distortion", [0.0, -0.3, 0.2])
def test_contours_of_spheres_are_the_exact_conics(distortion: float) -> None:
    place = np.array([0.08, -0.05, 0.6])
    for blur, noise in ((0.0, 0.0), (0.8, 0.0), (0.6, 0.02)):
        image = seen(ball(tuple(place), 0.08, RED), distortion=distortion, blur=blur, noise=noise, ambient=0.3,
                     background=(0.4, 0.45, 0.5))  # fmt: skip
        found = segment_colour(image, RED)
        assert found.status == ColourStatus.OK and len(found.contours) == 1
        pixels = with_lens(distortion).undistort(found.contours[0])
        off = distances_from_silhouette(pixels, place, 0.08)
        # Blur moves the contour of a small disc inwards, by about the square of the width over the diameter.
        assert abs(off.mean()) < 0.08 and np.sqrt(np.mean(off**2)) < 0.1 and np.abs(off).max() < 0.35


def test_nearer_surfaces_hide_others_and_a_cylinder_has_ends() -> None:
    near, far = ball((0, 0, 0.5), 0.02, (1, 0, 0)), ball((0, 0, 0.8), 0.1, (0, 1, 0))
    for pair in ((near, far), (far, near)):
        image = seen(*pair)
        assert image[60, 80].tolist() == [1, 0, 0] and image[60, 95].tolist() == [0, 1, 0]
    # A mesh in front of a sphere, and one behind the camera that is not seen.
    plate = SceneObject("plate", NOTHING, motor((0, 0, 0), (0, 0, 0.3)), *box(0.01, 0.01, 0.01), (0, 0, 1.0))
    behind = SceneObject("behind", NOTHING, motor((0, 0, 0), (0, 0, -0.3)), *box(0.1, 0.1, 0.1), (0, 0, 1.0))
    assert seen(far, plate)[60, 80].tolist() == [0, 0, 1] and seen(behind).max() == 0


def test_light_by_the_cosine_of_its_angle() -> None:
    tilt = 0.4
    plate = SceneObject("plate", NOTHING, motor((tilt, 0, 0), (0, 0, 0.6)), *box(0.2, 0.2, 0.01), (0.8, 0.4, 0.2))
    image = seen(plate, ambient=0.25, light=(0, 0, -1.0))
    assert np.allclose(image[60, 80], np.array([0.8, 0.4, 0.2]) * (0.25 + 0.75 * np.cos(tilt)), atol=1e-12)
    away = seen(plate, ambient=0.25, light=(0, 0, 1.0))
    assert np.allclose(away[60, 80], 0.25 * np.array([0.8, 0.4, 0.2]))


def test_sensor_and_background() -> None:
    texture = textured_background(SIZE, seed=3)
    assert texture.shape == (120, 160, 3) and np.array_equal(seen(background=texture), texture)
    image = seen(background=(0.5, 0.5, 0.5), noise=0.02)
    assert abs(image.std() - 0.02) < 5e-4 and abs(image.mean() - 0.5) < 5e-4
    sharp, blurred = (seen(ball((0, 0, 0.6), 0.1), blur=b)[60, :, 0] for b in (0.0, 1.5))
    # The largest slope of a blurred step is the height of the Gaussian, together with the width of the pixel.
    assert abs(np.diff(blurred).max() - 1 / np.sqrt(2 * np.pi * (1.5**2 + 1 / 12))) < 0.02 < np.diff(sharp).max()


def test_a_scan_covers_what_rays_hit() -> None:
    from algorithms.geometry.meshes import hit_mesh

    vertices, faces = scan("Banana")
    thing = SceneObject("scan", NOTHING, motor((0.4, 0.2, 0.1), (0, 0, 0.5)), vertices, faces, WHITE)
    image = seen(thing, samples=1)
    rng = np.random.default_rng(1)
    rows, columns = rng.integers(20, 100, 60), rng.integers(30, 130, 60)
    sights = np.column_stack([columns, rows, np.ones(60)]) @ np.linalg.inv(CAMERA.intrinsics).T
    hits = hit_mesh(np.zeros(3), sights, pga3.move_point(thing.pose, vertices), faces).hits
    assert 5 < hits.sum() < 55 and np.array_equal(image[rows, columns, 0] > 0, hits)


def test_wrong_settings_are_refused() -> None:
    for settings, text in (({"noise": -1.0}, "noise"), ({"samples": 0}, "samples"), ({"light": (0, 0, 0)}, "light"),
                           ({"ambient": 2.0}, "ambient")):  # fmt: skip
        with pytest.raises(ValueError, match=text):
            ImageSettings(**settings)
    with pytest.raises(ValueError, match=r"background: shape .*expected \(3,\) or \(120, 160, 3\)"):
        seen(background=np.zeros((5, 5, 3)))
    with pytest.raises(IndexError):
        scene_image(Scene((), ()), 0)
