"""Poses tracked through rendered sequences, compared with the true motion: occlusion, loss, and recovery."""

from dataclasses import replace

import numpy as np
import pytest

from algorithms.vision.camera import Camera
from algorithms.vision.objects import ImageSettings, ImageStatus, TrackStatus, textured_background, track_pose
from generated import pga3
from tests.support.grasp_scene import TARGET, cameras, motor
from tests.support.image_scene import (
    BALL,
    BOX,
    CAMERAS,
    HALF_TURNS,
    NEAR,
    PLACES,
    RED,
    SETTINGS,
    SIZE,
    THINGS,
    error,
    imaged,
    thing,
    wall,
)  # fmt: skip

START = motor((0.2, 0.3, 0.5), TARGET + np.array([-0.03, -0.04, 0]))
TWIST = motor((0.02, 0.03, 0.05), (0.003, 0.005, 0.001))


def motion(n, start=START):
    found = [start]
    for _ in range(n - 1):
        found.append(pga3.motor_product(found[-1], TWIST))
    return found


def rotation(name, found, truth):
    """The angle in degrees between two rotations, or for a can, between its axes; a ball has none."""
    turn = pga3.motor_to_matrix(pga3.motor_product(pga3.motor_inverse(truth), found))[:3, :3]
    if name == "can":
        return np.degrees(np.arcsin(np.linalg.norm(turn[:2, 2])))
    return 0.0 if name == "ball" else np.degrees(np.arcsin(min(1.0, np.linalg.norm(turn - np.eye(3)) / np.sqrt(8)))) * 2


def shift(name, found, truth):
    """The distance in millimetres of the centre of an object, which is the origin of its frame."""
    return 1e3 * np.linalg.norm(pga3.move_point(found, np.zeros(3)) - pga3.move_point(truth, np.zeros(3)))


@pytest.mark.slow
def test_a_box_that_turns_behind_a_passing_pole() -> None:
    truths = motion(2)
    images = [
        imaged(thing("box", truth), wall(TARGET + np.array([0.15, -0.13 + 0.05 * k, 0.1]), (0.02, 0.02, 0.25)), seed=k)[
            1
        ]
        for k, truth in enumerate(truths)
    ]
    found = list(track_pose(BOX, CAMERAS, images, START, reach=8))
    assert [one.status for one in found] == [TrackStatus.OK] * 2
    # The box is some 50 pixels wide: the focal length is half of that of the larger images below.
    for one, truth in zip(found, truths, strict=True):
        assert shift("box", one.motor, truth) < 0.5 and rotation("box", one.motor, truth) < 0.6
    assert min(one.seen for one in found) < 0.9


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ball", "can", "box"])
def test_larger_images_with_texture(name: str) -> None:
    truths = motion(3)
    settings = ImageSettings(blur=0.6, noise=0.01, background=textured_background((640, 480)))
    images = []
    for k, truth in enumerate(truths):
        pole = wall(TARGET + np.array([0.15, -0.25 + 0.04 * k, 0.1]), (0.02, 0.02, 0.25))
        images.append(imaged(thing(name, truth), pole, settings=settings, seed=k, among=cameras(-0.1))[1])
    for one, truth in zip(track_pose(THINGS[name][0], cameras(-0.1), images, START), truths, strict=True):
        assert one.status == TrackStatus.OK
        assert shift(name, one.motor, truth) < 0.5 and rotation(name, one.motor, truth) < 0.2


@pytest.mark.slow
def test_a_hidden_ball_is_predicted_found_again_or_lost() -> None:
    truths = [pga3.motor_product(motor((0, 0, 0), (0, 0.004 * k, 0)), START) for k in range(5)]
    whole = wall(TARGET + np.array([0.22, 0.04, 0.15]), (0.02, 0.6, 0.6), colour=(0.5, 0.5, 0.5))
    hidden = imaged(thing("ball"), whole)[1]
    images = [imaged(thing("ball", truth), seed=k)[1] for k, truth in enumerate(truths)]
    images[2:4] = [hidden] * 2
    found = list(track_pose(BALL, CAMERAS, images, START, reach=8))
    assert [one.status.is_measured for one in found] == [True] * 2 + [False] * 2 + [True]
    assert {found[2].status, found[3].status} == {TrackStatus.OCCLUDED}
    # The prediction continues the motion.
    assert all(shift("ball", one.motor, truth) < 1.5 for one, truth in zip(found, truths, strict=True))
    assert all(shift("ball", found[k].motor, truths[k]) < 0.5 for k in (0, 1, 4))


@pytest.mark.slow
def test_a_ball_is_lost_or_found_again_by_its_colour() -> None:
    whole = wall(TARGET + np.array([0.22, 0.04, 0.15]), (0.02, 0.6, 0.6), colour=(0.5, 0.5, 0.5))
    hidden = imaged(thing("ball"), whole)[1]
    images = [imaged(thing("ball", START), seed=k)[1] for k in range(3)]
    lost = list(track_pose(BALL, CAMERAS, images + [hidden] * 8, START))
    assert lost[-1].status == TrackStatus.LOST and np.isnan(lost[-1].motor).all()
    assert not any(one.status.is_measured for one in lost[3:])

    # A ball that jumps is found by its colour only.
    far = motor((0, 0, 0), TARGET + np.array([0.05, 0.07, -0.03]))
    jumped = [*images[:2], imaged(thing("ball", far))[1]]
    assert not list(track_pose(BALL, CAMERAS, jumped, START, reach=4))[-1].status.is_measured
    again = list(track_pose(BALL, CAMERAS, jumped, START, reach=4, colour=RED))[-1]
    assert again.status == TrackStatus.RECOVERED and error("ball", again.motor, far) < 0.5


def test_the_status_names_the_cause() -> None:
    good = imaged(thing("box"))[1]
    broken = [np.full_like(good[0], np.nan)] * 2
    (found,) = track_pose(BOX, CAMERAS, [broken], NEAR)
    assert found.status == TrackStatus.NOT_FINITE and found.statuses == (ImageStatus.NOT_FINITE,) * 2
    # One broken image is no reason to stop.
    (found,) = track_pose(BOX, CAMERAS, [[good[0], broken[0]]], NEAR)
    assert found.status.is_measured or found.status == TrackStatus.UNCERTAIN
    (found,) = track_pose(BOX, CAMERAS, [good], motor((0, 0, 0), (1.8, 0.2, 1.0)))
    assert found.status == TrackStatus.OUTSIDE
    (found,) = track_pose(BALL, CAMERAS, [good], NEAR)
    assert not found.status.is_measured


def test_wrong_arguments_are_refused() -> None:
    good = [np.zeros((*SIZE[::-1], 3))] * 2
    with pytest.raises(ValueError, match="reach"):
        track_pose(BOX, CAMERAS, [good], NEAR, reach=1.0)
    with pytest.raises(ValueError, match="unit motor"):
        track_pose(BOX, CAMERAS, [good], 2 * NEAR)
    with pytest.raises(ValueError, match="placed_camera"):
        track_pose(BOX, [replace(CAMERAS[0], is_mounted=True)], [good], NEAR)
    with pytest.raises(ValueError, match="images: 1 for 2 cameras"):
        list(track_pose(BOX, CAMERAS, [good[:1]], NEAR))
    assert list(track_pose(BOX, CAMERAS, [], NEAR)) == []


def occluded(seed, focal):
    """Return a box, a start, two cameras, and images with up to four other boxes in front of it, some of its colour."""
    rng = np.random.default_rng(seed)
    truth = motor(rng.normal(size=3), TARGET + rng.uniform(-0.03, 0.03, 3))
    turn, shift = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    start = pga3.motor_product(truth, motor(turn * rng.uniform(0, 0.3), shift * rng.uniform(0, 0.015)))
    walls = []
    for k in range(rng.integers(1, 5)):
        place = TARGET + rng.uniform(0.07, 0.5) * (PLACES[rng.integers(2)] - TARGET) + rng.uniform(-0.06, 0.06, 3)
        colour = RED if rng.random() < 0.3 else tuple(rng.uniform(0.05, 0.95, 3))
        one = wall(place, tuple(rng.choice([0.004, 0.01, 0.03, 0.08, 0.2], 3)), colour, rng.normal(size=3))
        if rng.random() < 0.4:
            # Its edges are parallel to those of the box.
            away = place - pga3.move_point(truth, np.zeros(3))
            one = replace(one, pose=pga3.motor_product(motor((0, 0, 0), away), truth))
        walls.append(replace(one, name=f"wall {k}"))
    background = textured_background(SIZE) if rng.random() < 0.6 else None
    among = [replace(one, camera=Camera.from_intrinsics(focal, (160.0, 120.0), one.camera.pose)) for one in CAMERAS]
    settings = SETTINGS if background is None else replace(SETTINGS, background=background)
    return truth, start, *imaged(thing("box", truth), *walls, settings=settings, seed=seed, among=among)


@pytest.mark.parametrize("seeds", [range(1), pytest.param(range(1, 16), marks=pytest.mark.slow)])
def test_no_pose_behind_random_boxes_is_ok_and_wrong(seeds) -> None:
    limits, found_ok = (np.radians(0.5), 1e-3), 0
    for seed in seeds:
        focal = (500.0, 1000.0)[seed % 2]
        truth, start, placed, images = occluded(seed, focal)
        for n, tolerance in ((2, limits), (1, (0.01, 0.003))):
            (one,) = track_pose(BOX, placed[:n], [images[:n]], start, reach=focal / 50 + 2, tolerance=tolerance)
            if one.status == TrackStatus.OK:
                found_ok += 1
                assert shift("box", one.motor, truth) < 1e3 * tolerance[1], seed
                turns = [rotation("box", one.motor, pga3.motor_product(truth, half)) for half in HALF_TURNS]
                assert min(turns) < np.degrees(tolerance[0]), seed
                assert all(bound <= most for bound, most in zip(one.estimate.bounds, tolerance, strict=True))
    assert found_ok >= max(1, len(seeds) // 3)
