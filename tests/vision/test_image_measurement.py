"""Silhouettes and edges measured in raster images, compared with the true pose and with exact conics and lines."""

from dataclasses import replace

import numpy as np
import pytest
from selection import some_slow

from algorithms.grasping import LoopStatus, guided_grasp, plan_grasps
from algorithms.kinematics import Robot
from algorithms.vision import Camera
from algorithms.vision.objects import (
    ImageStatus,
    ObjectModel,
    PoseStatus,
    estimate_pose,
    measure_edges,
    measure_silhouettes,
    textured_background,
)
from algorithms.vision.objects.pose_models import KINDS, View
from algorithms.vision.objects.predicted_curves import predicted_curves
from generated import pga3
from tests.support.grasp_scene import CORNERS, HOME, MOUNT, TARGET, motor, pose
from tests.support.image_scene import (
    BALL,
    BOX,
    CAN,
    HALF_TURNS,
    NEAR,
    PLACES,
    RED,
    SETTINGS,
    SIZE,
    THINGS,
    TRUTH,
    error,
    imaged,
    in_front,
    plain,
    thing,
)  # fmt: skip
from tests.support.object_views import looking

EXPECTED = {"ball": PoseStatus.SYMMETRIC, "can": PoseStatus.SYMMETRIC, "box": PoseStatus.OK}


def measured(objects, start=None, name="box", n=2, change=lambda image: image, colour=RED, **settings):
    """Measure an object in images of a scene, or of the object alone at the usual pose."""
    cameras, images = imaged(*objects, n=n, settings=replace(SETTINGS, **settings)) if objects else plain(name)
    return measure_silhouettes(THINGS[name][0], cameras[:n], [change(i) for i in images[:n]], start, colour=colour)


@pytest.mark.parametrize("name", ["ball", "can", "box"])
def test_poses_near_the_start_are_found_to_a_tenth_of_a_millimetre(name: str) -> None:
    found = measured([], NEAR, name)
    assert found.status == ImageStatus.OK and found.statuses == (ImageStatus.OK,) * 2
    assert found.estimate.status == EXPECTED[name] and found.estimate.residual < 0.1
    assert error(name, found.estimate.motor, TRUTH) < 0.1 and min(found.shown) > 0.95
    again = estimate_pose(THINGS[name][0], found.views, NEAR)
    assert again.status == EXPECTED[name] and error(name, again.motor, TRUTH) < 0.1


@pytest.mark.parametrize(("objects", "most"), [([], 0.1), ([thing("box")], 0.25)])
def test_measured_pixels_are_on_the_exact_lines_of_a_box(objects, most: float) -> None:
    found = measured(objects, NEAR, background=textured_background(SIZE))
    for view in found.views:
        index, pixels = view.edges
        a, b = (view.camera.project(pga3.move_point(TRUTH, BOX.edges[index, k])) for k in (0, 1))
        along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
        off = pixels - a
        across = off[:, 0] * along[:, 1] - off[:, 1] * along[:, 0]
        assert len(set(index)) >= 4 and np.sqrt(np.mean(across**2)) < most and np.abs(across).max() < 0.7
        # And between the ends of the edge.
        share = np.einsum("ij,ij->i", off, along) / np.linalg.norm(b - a, axis=1)
        assert share.min() > -0.03 and share.max() < 1.03


def test_a_ball_without_a_start() -> None:
    found = measured([], name="ball")
    assert found.status == ImageStatus.OK and error("ball", found.estimate.motor, TRUTH) < 0.1
    # From one image, the distance is uncertain.
    single = measured([], name="ball", n=1)
    assert error("ball", single.estimate.motor, TRUTH) < 2.5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["can", "box"])
def test_poses_without_a_start_and_their_symmetric_copies(name: str) -> None:
    rng = np.random.default_rng(5)
    for k in range(2):
        truth = pose(rng)
        found = measured([thing(name, truth)], name=name)
        assert found.status == ImageStatus.OK and found.estimate.status == EXPECTED[name]
        assert error(name, found.estimate.motor, truth) < 0.2
        # A can may be turned over, and a box by three half turns.
        assert len(found.alternatives) == (1 if name == "can" else 3), k
        assert all(error(name, other, truth) < 0.2 for other in found.alternatives)
        if name == "box":
            every = [found.estimate.motor, *found.alternatives]
            for turn in HALF_TURNS:
                there = pga3.move_point(pga3.motor_product(truth, turn), CORNERS)
                assert min(np.abs(pga3.move_point(p, CORNERS) - there).max() for p in every) < 3e-4


@pytest.mark.parametrize("change", [
    lambda image: (255 * image).astype(np.uint8), lambda image: image.astype(np.float32),
    lambda image: (65535 * image).astype(np.uint16),
])  # fmt: skip
def test_types_of_images(change) -> None:
    assert error("ball", measured([], NEAR, "ball", change=change, n=1).estimate.motor, TRUTH) < 2.5


def with_nan(image):
    image = image.copy()
    image[5, 7, 1] = np.nan
    return image


SMALL = motor((0, 0, 0), TARGET + 4.8 * (TARGET - PLACES[0]))
FAR = motor((0, 0, 0), TARGET + np.array([0.0, 0.7, 0]))
BEHIND = motor((0, 0, 0), (1.8, 0.2, 1.0))


@pytest.mark.parametrize(("objects", "start", "more", "status"), [
    ([], None, {"colour": (0.1, 0.2, 0.9)}, ImageStatus.NOT_FOUND),
    ([thing("ball", SMALL)], None, {"n": 1}, ImageStatus.TOO_SMALL),
    ([thing("ball", SMALL)], SMALL, {"n": 1}, ImageStatus.TOO_SMALL),
    ([thing("ball", FAR)], FAR, {"n": 1}, ImageStatus.OUTSIDE_IMAGE),
    ([thing("ball", BEHIND)], BEHIND, {"n": 1}, ImageStatus.BEHIND_CAMERA),
    ([], None, {"change": with_nan}, ImageStatus.NOT_FINITE),
    ([thing("ball"), in_front(0.3, 0.0)], NEAR, {"n": 1}, ImageStatus.NOT_FOUND),
    ([thing("ball"), in_front(0.3, -0.04)], NEAR, {"n": 1}, ImageStatus.OCCLUDED),
    ([thing("box")], NEAR, {"n": 1}, ImageStatus.INCONSISTENT),
])  # fmt: skip
def test_the_status_names_the_cause(objects, start, more, status) -> None:
    found = measured(objects, start, "ball", **more)
    assert found.status == status and found.views == ()


def test_half_of_a_ball_is_hidden_or_cut_by_the_border() -> None:
    found = measured([thing("ball"), in_front(0.3, -0.05)], NEAR, "ball")
    assert found.statuses == (ImageStatus.OCCLUDED, ImageStatus.OK) and len(found.views) == 1
    assert 0.4 < found.shown[0] < 0.55 and error("ball", found.estimate.motor, TRUTH) < 0.3
    truth = motor((0, 0, 0), TARGET + np.array([0, 0.27, 0]))
    found = measured([thing("ball", truth)], truth, "ball")
    assert found.views and error("ball", found.estimate.motor, truth) < 0.3
    assert ImageStatus.TOUCHES_BORDER in found.statuses


@pytest.mark.slow
def test_an_object_behind_a_pole_and_one_beside_another_of_its_colour_without_a_start() -> None:
    pole = in_front(0.3, 0.0, (0.01, 0.012, 0.4))
    found = measured([thing("box"), pole])
    assert found.views and found.estimate.status == PoseStatus.OK
    assert error("box", found.estimate.motor, TRUTH) < 0.2
    other = motor((0.5, 0.1, 0.2), TARGET + np.array([0, 0.16, 0]))
    found = measured([thing("box"), replace(thing("box", other), name="other")])
    assert found.status == ImageStatus.SEVERAL
    assert min(error("box", found.estimate.motor, one) for one in (TRUTH, other)) < 0.2


def test_two_objects_of_the_colour() -> None:
    other = thing("can", motor((0.5, 0.1, 0.2), TARGET + np.array([0, 0.15, 0])))
    near = measured([thing("ball"), other], NEAR, "ball", n=1)
    assert near.status == ImageStatus.OK and error("ball", near.estimate.motor, TRUTH) < 2.5
    without = measured([thing("ball"), other], None, "ball", n=1)
    # The larger one is a can.
    assert without.status == ImageStatus.SEVERAL and not without.views


@pytest.mark.parametrize("name", some_slow(["ball", "can", "box"], "can"))
def test_edges_along_normals(name: str) -> None:
    cameras, images = imaged(thing(name), settings=replace(SETTINGS, background=textured_background(SIZE)))
    model = THINGS[name][0]
    exact = measure_edges(model, cameras[0], images[0], TRUTH, reach=4)
    assert exact.status == ImageStatus.OK and exact.shown > 0.9
    # Offsets from the true curves are the errors of measurement.
    assert np.median(np.abs(exact.offsets)) < 0.12 and np.mean(np.abs(exact.offsets) < 0.4) > 0.9
    found = NEAR
    for reach in (8, 4, 3):
        views = [
            measure_edges(model, camera, (255 * image).astype(np.uint8), found, reach=reach).view
            for camera, image in zip(cameras, images, strict=True)
        ]
        found = estimate_pose(model, views, found, noise=reach / 4).motor
    assert error(name, found, TRUTH) < 0.5 < error(name, NEAR, TRUTH)
    grey = measure_edges(model, cameras[0], images[0].mean(2), TRUTH, reach=4)
    assert np.median(np.abs(grey.offsets)) < 0.3


def test_why_there_are_no_edges() -> None:
    cameras, images = plain("box")
    blank = np.full_like(images[0], 0.5)
    for image, start, status in (
        (blank, TRUTH, ImageStatus.NOT_FOUND), (with_nan(images[0]), TRUTH, ImageStatus.NOT_FINITE),
        (images[0], FAR, ImageStatus.OUTSIDE_IMAGE), (images[0], BEHIND, ImageStatus.BEHIND_CAMERA),
    ):  # fmt: skip
        found = measure_edges(BOX, cameras[0], image, start)
        assert found.status == status and len(found.offsets) == 0 and found.view.edges is None


def contact_error(name, at, planned):
    """The largest coordinate in metres by which contacts differ from planned ones, in the frame of the object."""
    if name == "ball":
        return np.abs(np.linalg.norm(at, axis=1) - np.linalg.norm(planned, axis=1)).max()
    if name == "can":
        radial = np.hypot(*at[:, :2].T) - np.hypot(*planned[:, :2].T)
        return max(np.abs(radial).max(), np.abs(np.abs(at[:, 2]) - np.abs(planned[:, 2])).max())
    return min(np.abs(at - pga3.move_point(turn, planned)).max() for turn in HALF_TURNS)


@pytest.mark.parametrize("name", ["ball", pytest.param("can", marks=pytest.mark.slow),
                                  pytest.param("box", marks=pytest.mark.slow)])  # fmt: skip
def test_from_raster_images_to_a_grasp(name: str) -> None:
    model, vertices, faces = THINGS[name]
    plans, robot = plan_grasps(vertices, faces, style=1), Robot.named("ur5")
    rng = np.random.default_rng(3)
    reached = 0
    for _ in range(1 if name == "ball" else 2):
        truth = pose(rng)
        found = measured([thing(name, truth)], name=name)
        grasp = guided_grasp(robot, HOME, model, found.views, plans, mount=MOUNT)
        if grasp.status == LoopStatus.OUT_OF_REACH:
            continue
        assert grasp.status == LoopStatus.OK
        at = pga3.move_point_back(truth, grasp.contacts)
        assert contact_error(name, at, grasp.grasp.contacts) < 1e-3
        reached += 1
    assert reached


def test_wrong_arguments_are_refused() -> None:
    cameras, images = plain("ball")
    good = (BALL, cameras[0], images[0])
    with pytest.raises(ValueError, match=r"image: shape \(240, 320\); expected .*red green blue"):
        measure_silhouettes(BALL, cameras[0], images[0][..., 0], colour=RED)
    with pytest.raises(ValueError, match=r"image: shape \(10, 320, 3\); expected \(240, 320, 3\), the size"):
        measure_silhouettes(BALL, cameras[0], images[0][:10], colour=RED)
    with pytest.raises(ValueError, match="images: 1 for 2 cameras"):
        measure_silhouettes(BALL, cameras, images[:1], colour=RED)
    with pytest.raises(ValueError, match="colour"):
        measure_silhouettes(*good, colour=(0, 0, 0))
    with pytest.raises(TypeError, match="complex"):
        measure_silhouettes(BALL, cameras[0], images[0] * 1j, colour=RED)
    with pytest.raises(ValueError, match="points only"):
        measure_silhouettes(ObjectModel.of(points=CORNERS), cameras[0], images[0], colour=RED)
    with pytest.raises(ValueError, match="one unit motor"):
        measure_silhouettes(*good, 2 * TRUTH, colour=RED)
    with pytest.raises(ValueError, match="reach"):
        measure_edges(*good, TRUTH, reach=1.0)
    with pytest.raises(ValueError, match="mesh"):
        measure_edges(*good, TRUTH, mesh=(np.zeros((3, 3)), np.zeros((1, 4), int)))


def test_a_mounted_camera_is_refused_until_it_is_placed() -> None:
    cameras, images = plain("ball")
    mounted = type(cameras[0])(cameras[0].camera, SIZE, is_mounted=True)
    with pytest.raises(ValueError, match="placed_camera"):
        measure_silhouettes(BALL, mounted, images[0], colour=RED)


def test_a_view_is_what_estimate_pose_takes() -> None:
    found = measured([], NEAR, "can")
    assert all(isinstance(view, View) for view in found.views)
    assert set(np.unique(found.views[0].rims[0])) == {0, 1} and len(CAN.tubes) == 1


@pytest.mark.parametrize("height", [0.3, -0.3])
def test_the_end_of_a_can_that_faces_the_camera_is_seen(height: float) -> None:
    """All of its rim is seen, and of the other one the half on the side of the camera."""
    centre = np.array([0.2, 0.1, height])
    camera = Camera([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]], looking(np.zeros(3), centre))
    mesh = np.zeros((0, 3)), np.zeros((0, 3), int)
    found = predicted_curves(CAN, np.eye(8)[0], camera, mesh)
    for end, z in enumerate((-0.05, 0.05)):
        rim = found.part((found.kinds == KINDS.index("rims")) & (found.elements == end))
        rays = camera.rays(rim.pixels)
        places = centre + rays * ((z - height) / rays[:, 2:])
        assert np.allclose(np.linalg.norm(places[:, :2], axis=1), 0.033)
        towards = (places[:, :2] * (centre - places)[:, :2]).sum(1)
        clear = np.abs(towards) > 1e-3
        seen = np.full(len(rays), True) if z * height > 0 else towards > 0
        assert clear.sum() > 20 and np.array_equal(rim.is_visible[clear], seen[clear])
