"""Guided grasps in simulated scenes, errors at the goal, and statuses of images that allow no step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from algorithms.estimation.servoing import (
    GraspSettings,
    GraspStage,
    GraspState,
    VisualStatus,
    grasp_step,
    random_scene,
    simulate_grasp,
    visual_error,
)
from algorithms.estimation.servoing.scene import VisualScene, camera_matrix
from generated import pga3

NOISY = GraspSettings(noise=0.3)


def at_goal(seed: int) -> VisualScene:
    scene = random_scene(np.random.default_rng(seed))
    return replace(scene, hand=scene.box, opening=float(scene.size[0]))


def succeeds(seed: int, settings: GraspSettings, distance: float, angle: float) -> bool:
    rng = np.random.default_rng(seed)
    run = simulate_grasp(random_scene(rng), settings, rng)
    away, turned = run.scenes[-1].deviation()
    held = abs(run.scenes[-1].opening / run.scenes[-1].size[0] - 1) < (1e-6 if settings.noise == 0 else 0.02)
    return run.status is VisualStatus.OK and away <= distance and turned <= angle and held


def test_grasps_without_noise_are_exact() -> None:
    assert all(succeeds(seed, GraspSettings(), 1e-6, 1e-6) for seed in range(20))


def test_grasps_with_noise_are_accurate() -> None:
    assert all(succeeds(seed, NOISY, 5e-4, np.radians(0.1)) for seed in range(2000, 2002))


@pytest.mark.slow
def test_grasps_of_many_random_starts() -> None:
    assert all(succeeds(seed, GraspSettings(), 1e-6, 1e-6) for seed in range(40))
    assert all(succeeds(seed, NOISY, 5e-4, np.radians(0.1)) for seed in range(3000, 3015))


def test_the_errors_are_0_at_the_goal_only() -> None:
    for seed in range(20):
        scene = at_goal(seed)
        found = visual_error(scene.images())
        assert found.status is VisualStatus.OK and found.upright
        rows = found.rows[:, [0, 1, 2, 4, 5, 6]]
        assert np.abs(rows).max() < 1e-9 and np.allclose(found.ratio, 1, rtol=0, atol=1e-12)
        for k in range(6):
            motion = np.zeros(6)
            motion[k] = 0.01
            assert np.abs(visual_error(scene.moved(motion).images()).rows[:, [1, 2, 4, 5, 6]]).max() > 0.1


def test_the_errors_do_not_depend_on_the_motion_of_the_image() -> None:
    scene = random_scene(np.random.default_rng(3))
    images = scene.images()
    found = visual_error(images).rows
    c, s = np.cos(0.7), np.sin(0.7)
    turned = images @ np.array([[c, -s], [s, c]]).T + [30, -20]
    assert np.allclose(visual_error(turned).rows, found, rtol=0, atol=1e-8 * np.abs(found).max())
    assert np.allclose(visual_error(2.5 * images).rows, 2.5 * found, rtol=1e-9, atol=1e-9)


def test_stages_follow_each_other() -> None:
    run = simulate_grasp(random_scene(np.random.default_rng(5)), GraspSettings())
    stages = [step.state.stage for step in run.steps]
    assert stages == sorted(stages) and set(stages) == set(GraspStage)
    lengths = [np.linalg.norm(step.motion[3:]) for step in run.steps]
    assert max(lengths) <= GraspSettings().largest * (1 + 1e-9)


def first_step(images: np.ndarray) -> tuple[VisualStatus, np.ndarray]:
    step = grasp_step(GraspState(), images)
    return step.status, step.motion


def test_a_lost_feature_stops_the_hand() -> None:
    scene = random_scene(np.random.default_rng(1))
    images = scene.images()
    images[1, 7] = np.nan
    found = visual_error(images)
    assert (found.status, found.image, found.point) == (VisualStatus.LOST_FEATURE, 1, 7)
    status, motion = first_step(images)
    assert status is VisualStatus.LOST_FEATURE and not motion.any()
    # The same state goes on with the next complete images.
    state = GraspState()
    for _ in range(10):
        step = grasp_step(state, scene.images())
        state, scene = step.state, scene.moved(step.motion)
    lost = grasp_step(state, images)
    assert lost.state is state and not lost.motion.any()
    assert grasp_step(state, scene.images()).status is VisualStatus.OK


def test_a_grasp_goes_on_after_images_with_lost_features() -> None:
    rng = np.random.default_rng(3)
    scene, state, lost, images_used = random_scene(np.random.default_rng(0)), GraspState(), 0, 0
    while state.stage is not GraspStage.DONE and images_used < 200:
        images, images_used = scene.images(), images_used + 1
        drops = rng.uniform() < 0.3
        if drops:
            camera, point = rng.integers(2), rng.integers(12)
            images[camera, point, rng.integers(2)] = np.nan
            found = visual_error(images)
            assert (found.image, found.point) == (camera, point)
        step = grasp_step(state, images)
        assert step.status is (VisualStatus.LOST_FEATURE if drops else VisualStatus.OK)
        if drops:
            assert step.state is state and not step.motion.any() and step.closing == 1
            lost += 1
        state, scene = step.state, scene.moved(step.motion, step.closing)
    away, turned = scene.deviation()
    assert lost > 5 and state.stage is GraspStage.DONE and away < 1e-9 and turned < 1e-9


def test_confused_points_count_as_behind_the_camera() -> None:
    images = random_scene(np.random.default_rng(1)).images()
    images[0, [4, 5]] = images[0, [5, 4]]
    status, motion = first_step(images)
    assert status is VisualStatus.BEHIND_CAMERA and not motion.any()


def test_a_part_behind_the_camera_stops_the_hand() -> None:
    scene = random_scene(np.random.default_rng(1))
    camera = scene.cameras[0]
    points = np.c_[scene.points(), np.ones(12)]
    # The plane where the depth is 0 now divides the box.
    depth = points[4:] @ camera[2]
    behind = camera.copy()
    behind[2, 3] -= np.median(depth)
    seen = points @ behind.T
    images = scene.images()
    images[0] = seen[:, :2] / seen[:, 2:]
    assert visual_error(images).status in (VisualStatus.BEHIND_CAMERA, VisualStatus.DEGENERATE_VIEW)
    assert np.isnan(replace(scene, cameras=np.stack([behind, scene.cameras[1]])).images()).any()


def test_a_face_seen_from_the_side_stops_the_hand() -> None:
    scene = random_scene(np.random.default_rng(1))
    # The camera is in the plane of the face at the end 0 of the first axis.
    side = -scene.size[0] / 2
    place, target = pga3.move_point(scene.box, np.array([[side, -0.6, 0.4], [side, 0, 0]]))
    camera = camera_matrix(place, target, np.array([800.0, 800.0]), np.array([320.0, 240.0]))
    status, motion = first_step(replace(scene, cameras=np.stack([camera, scene.cameras[1]])).images())
    assert status is VisualStatus.DEGENERATE_VIEW and not motion.any()


def run_to_status(scene: VisualScene, moves: bool = True) -> tuple[VisualStatus, int]:
    state = GraspState()
    for k in range(300):
        step = grasp_step(state, scene.images(), GraspSettings())
        if step.status is not VisualStatus.OK or step.state.stage is GraspStage.DONE:
            assert step.status is VisualStatus.OK or not step.motion.any()
            return step.status, k
        state = step.state
        scene = scene.moved(step.motion, step.closing) if moves else scene
    raise AssertionError("no end")


def test_cameras_at_the_same_place_are_reported() -> None:
    scene = random_scene(np.random.default_rng(1))
    same = replace(scene, cameras=np.stack([scene.cameras[0], scene.cameras[0]]))
    assert run_to_status(same) == (VisualStatus.DEGENERATE_CAMERAS, 6)


def test_a_hand_that_does_not_move_is_reported() -> None:
    assert run_to_status(random_scene(np.random.default_rng(1)), moves=False) == (VisualStatus.HAND_DOES_NOT_MOVE, 1)


def test_a_hand_that_is_upside_down_is_reported() -> None:
    scene = at_goal(2)
    turned = scene.moved(np.r_[np.pi * np.array([1.0, 0, 0]), 0, 0, 0.01])
    assert run_to_status(turned)[0] in (VisualStatus.UPSIDE_DOWN, VisualStatus.NOT_CONVERGED)


def test_motions_out_of_reach_are_not_made() -> None:
    scene = random_scene(np.random.default_rng(1))
    asked = []

    def reachable(motion: np.ndarray) -> bool:
        asked.append(motion)
        return bool(np.linalg.norm(motion[3:]) < 0.004)

    step = grasp_step(GraspState(), scene.images(), reachable=reachable)
    assert step.status is VisualStatus.OK and step.motion[:3].any()
    state = step.state
    for _ in range(2):
        scene = scene.moved(step.motion)
        step = grasp_step(state, scene.images(), reachable=reachable)
        state = step.state
    refused = grasp_step(state, scene.moved(step.motion).images(), reachable=reachable)
    assert refused.status is VisualStatus.OUT_OF_REACH and not refused.motion.any() and len(asked) == 4


def test_arguments_are_checked() -> None:
    with pytest.raises(ValueError, match=r"images: shape \(2, 8, 2\)"):
        visual_error(np.zeros((2, 8, 2)))
    with pytest.raises(ValueError, match="noise: -1"):
        GraspSettings(noise=-1)
    with pytest.raises(ValueError, match="frames: 0; expected a positive integer"):
        GraspSettings(frames=0)
    with pytest.raises(TypeError, match="state: NoneType, settings: NoneType; expected GraspState, GraspSettings"):
        grasp_step(None, np.zeros((2, 12, 2)))  # type: ignore[arg-type]
    scene = random_scene(np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"rng: None with a noise of 0\.3 pixels"):
        simulate_grasp(scene, NOISY)
    with pytest.raises(ValueError, match="at_most: 0; expected a positive number"):
        simulate_grasp(scene, GraspSettings(), at_most=0)
    with pytest.raises(ValueError, match="place and target: both"):
        camera_matrix(np.zeros(3), np.zeros(3), np.ones(2), np.zeros(2))


def test_a_camera_that_looks_down() -> None:
    matrix = camera_matrix(np.array([0, 0, 2.0]), np.zeros(3), np.array([800.0, 400.0]), np.array([320.0, 240.0]))
    points = np.array([[0, 0, 0, 1], [1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1.0]])
    seen = points @ matrix.T
    assert np.allclose(seen[:, 2], [2, 2, 2, 1])
    assert np.allclose(seen[:, :2] / seen[:, 2:], [[320, 240], [720, 240], [320, 40], [320, 240]])


def test_kinds_of_arrays() -> None:
    images = random_scene(np.random.default_rng(0)).images()
    expected = visual_error(images).rows
    images.flags.writeable = False
    assert np.array_equal(visual_error(images).rows, expected)
    assert np.array_equal(visual_error(images.tolist()).rows, expected)
    single = visual_error(images.astype(np.float32))
    assert single.status is VisualStatus.OK and np.allclose(single.rows, expected, rtol=0, atol=1e-3)
    for scale, status in ((1e100, VisualStatus.OK), (1e300, VisualStatus.DEGENERATE_VIEW)):
        assert visual_error(scale * images).status is status
