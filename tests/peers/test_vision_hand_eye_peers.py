"""Hand and eye against the five methods of OpenCV, under noise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.vision import Camera, HandEyeStatus, calibrate_endoscope, hand_eye_from_poses
from generated import pga3

pytestmark = pytest.mark.peers
Array = np.ndarray[Any, Any]
METHODS = ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS")
N_TRIALS = 60


def rigid(rng: np.random.Generator, shape: tuple[int, ...], turn: float, shift: float) -> Array:
    matrices = np.zeros((*shape, 4, 4))
    matrices[..., 3, 3] = 1
    turns = Rotation.from_rotvec(turn * rng.normal(size=(int(np.prod(shape)), 3))).as_matrix()
    matrices[..., :3, :3] = turns.reshape(*shape, 3, 3)
    matrices[..., :3, 3] = shift * rng.normal(size=(*shape, 3))
    return matrices


def by_opencv(cv2: Any, method: str, hands: Array, views: Array) -> Array:
    """The camera on the hand; the identity where OpenCV gives none."""
    turn, shift = cv2.calibrateHandEye(
        hands[:, :3, :3],
        hands[:, :3, 3],
        views[:, :3, :3],
        views[:, :3, 3],
        method=getattr(cv2, f"CALIB_HAND_EYE_{method}"),
    )
    found = np.eye(4)
    if np.isfinite(turn).all() and np.linalg.det(turn) > 0.5:
        found[:3, :3], found[:3, 3] = turn, shift[:, 0]
    return found


def errors(found: Array, truth: Array) -> tuple[float, float]:
    """Root mean squares of angles and of distances."""
    between = Rotation.from_matrix(np.swapaxes(found[:, :3, :3], 1, 2) @ truth[:, :3, :3]).magnitude()
    apart = (found - truth)[:, :3, 3]
    return float(np.sqrt(np.mean(between**2))), float(np.sqrt(np.mean((apart**2).sum(-1))))


@pytest.mark.parametrize("of_hand", [0.0, 1.0], ids=["camera", "hand and camera"])
def test_rotations_and_translations_under_noise(of_hand: float) -> None:
    """Poses, noise of rotations and of translations of the pattern that the camera sees: each pair of three levels."""
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(0)
    best, settings = 0, 0
    noises = (1e-3, 4e-3, 16e-3)
    for level, n_poses in enumerate((4, 8, 20)):
        for of_turn, turn in enumerate(noises):
            shift = noises[(level + of_turn) % 3]
            x, z = rigid(rng, (N_TRIALS,), 1, 0.3), rigid(rng, (N_TRIALS,), 1, 1)
            hands = rigid(rng, (N_TRIALS, n_poses), 0.8, 1)
            eyes = np.linalg.inv(z)[:, None] @ hands @ x[:, None]
            views = np.linalg.inv(eyes) @ rigid(rng, (N_TRIALS, n_poses), turn, shift)
            hands = hands @ rigid(rng, (N_TRIALS, n_poses), of_hand * turn, of_hand * shift)
            found = hand_eye_from_poses(pga3.motor_from_matrix(hands), pga3.motor_from_matrix(np.linalg.inv(views)))
            assert (found.status == HandEyeStatus.OK).all()
            ours = errors(pga3.motor_to_matrix(found.motor), x)
            theirs = {}
            for method in METHODS:
                each = [by_opencv(cv2, method, *pair) for pair in zip(hands, views, strict=True)]
                theirs[method] = errors(np.array(each), x)
            assert ours[0] <= 1.02 * theirs["DANIILIDIS"][0]
            best += ours[1] <= min(shift for _, shift in theirs.values())
            settings += 1
    assert best >= 0.9 * settings


@pytest.mark.parametrize("n_wrong", [1, 3, 5])
def test_wrong_poses_do_no_harm(n_wrong: int) -> None:
    """With wrong poses among 15, rotations are as accurate as without them, and as those of OpenCV without them."""
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(40 + n_wrong)
    x, z, hands = rigid(rng, (N_TRIALS,), 1, 0.3), rigid(rng, (N_TRIALS,), 1, 1), rigid(rng, (N_TRIALS, 15), 0.8, 1)
    views = np.linalg.inv(np.linalg.inv(z)[:, None] @ hands @ x[:, None]) @ rigid(rng, (N_TRIALS, 15), 4e-3, 4e-3)
    views[:, :n_wrong] = rigid(rng, (N_TRIALS, n_wrong), 1, 1)
    one, two = pga3.motor_from_matrix(hands), pga3.motor_from_matrix(np.linalg.inv(views))
    found, alone = hand_eye_from_poses(one, two), hand_eye_from_poses(one[:, n_wrong:], two[:, n_wrong:])
    assert (found.status == HandEyeStatus.OK).all()
    ours, least = (errors(pga3.motor_to_matrix(each.motor), x) for each in (found, alone))
    assert ours[0] <= 1.2 * least[0] and ours[1] <= 1.2 * least[1]
    for method in METHODS:
        pairs = zip(hands[:, n_wrong:], views[:, n_wrong:], strict=True)
        assert ours[0] <= errors(np.array([by_opencv(cv2, method, *pair) for pair in pairs]), x)[0]


def test_an_endoscope_under_a_tracker_sees_points_where_they_are() -> None:
    """Noise of 0.35 mm and 0.2 degrees of the tracker: pixels that both places predict, against OpenCV's best."""
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(1)
    grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0), [0.0]), -1).reshape(-1, 3) * 5
    k = np.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]])
    ours: list[float] = []
    theirs: dict[str, list[float]] = {method: [] for method in METHODS}
    for _ in range(30):
        x, z = rigid(rng, (), 1, 50), rigid(rng, (), 1, 300)
        turns = Rotation.from_rotvec(0.4 * rng.normal(size=(15, 3))).as_matrix()
        eyes = np.tile(np.eye(4), (15, 1, 1))
        eyes[:, :3, :3], eyes[:, :3, 3] = turns, grid.mean(0) - 80 * turns[:, :, 2]
        bodies = z @ eyes @ np.linalg.inv(x)
        noisy = bodies @ rigid(rng, (15,), np.radians(0.2) / np.sqrt(3), 0.35 / np.sqrt(3))
        exact = [Camera(k, pga3.motor_from_matrix(eye)).project(grid) for eye in eyes]
        images = np.stack(exact) + 0.3 * rng.normal(size=(15, 54, 2))
        found = calibrate_endoscope(pga3.motor_from_matrix(noisy), grid, images, k)

        def off(x: Array, z: Array, bodies: Array = bodies, exact: list[Array] = exact) -> float:
            """Root mean square in pixels over what the true body and these places predict."""
            poses = np.linalg.inv(z) @ bodies @ x
            seen = [Camera(k, pga3.motor_from_matrix(pose)).project(grid) for pose in poses]
            return float(np.sqrt(np.mean((np.stack(seen) - np.stack(exact)) ** 2)))

        ours.append(off(pga3.motor_to_matrix(found.motor), pga3.motor_to_matrix(found.world)))
        views = np.tile(np.eye(4), (15, 1, 1))
        for view, image in zip(views, images, strict=True):
            _, turn, shift = cv2.solvePnP(grid, image, k, None)
            view[:3, :3], view[:3, 3] = cv2.Rodrigues(turn)[0], shift[:, 0]
        for method in METHODS:
            there = by_opencv(cv2, method, noisy, views)
            each = noisy @ there @ views
            place = np.eye(4)
            place[:3, :3] = Rotation.from_matrix(each[:, :3, :3]).mean().as_matrix()
            place[:3, 3] = each[:, :3, 3].mean(0)
            theirs[method].append(off(there, place))
    assert np.mean(ours) <= min(float(np.mean(each)) for each in theirs.values())
