"""Hand-eye calibration with wrong poses and motions among the data, against matrices of scipy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from selection import some_slow
from test_hand_eye import Array, poses

from algorithms.vision import HandEyeStatus, hand_eye, hand_eye_from_poses
from algorithms.vision.hand_eye_noise import _squared_traces
from generated import pga3

N_POSES = 15


def noisy_poses(rng: np.random.Generator, problems: int, n_poses: int = N_POSES) -> tuple[Array, Array, Array]:
    """X as a matrix, and poses of hand and camera as matrices with noise of some milliradians and millimetres."""
    x, z, hands = poses(rng, problems), poses(rng, problems), poses(rng, problems, n_poses)
    eyes = np.linalg.inv(z)[:, None] @ hands @ x[:, None]
    at_target = poses(rng, problems, n_poses, angle=3e-3, length=2e-3)
    at_camera = poses(rng, problems, n_poses, angle=1e-3, length=1e-3)
    return x, hands, at_target @ eyes @ at_camera


def spoiled(rng: np.random.Generator, eyes: Array, n_wrong: int, kind: str) -> Array:
    """Replace the first poses by wrong ones: random poses, or with a wrong rotation or translation."""
    bad, some = eyes.copy(), eyes[:, :n_wrong].shape[:2]
    if kind == "altogether":
        bad[:, :n_wrong] = poses(rng, *some)
    else:
        off = poses(rng, *some, angle=0.2 if kind == "turned" else 1e-12, length=1e-12 if kind == "turned" else 0.3)
        bad[:, :n_wrong] = bad[:, :n_wrong] @ off
    return bad


def rotation_error(motors: Array, x: Array) -> Array:
    """Angles in radians between found and true rotations."""
    turns = np.swapaxes(pga3.motor_to_matrix(motors)[..., :3, :3], -1, -2) @ x[..., :3, :3]
    return np.asarray(Rotation.from_matrix(turns).magnitude())


@pytest.mark.parametrize("kind", ["altogether", "turned", "shifted"])
@pytest.mark.parametrize("n_wrong", some_slow([1, 3, 5, 7], 1, 3, 5))
def test_wrong_poses_are_rejected(n_wrong: int, kind: str) -> None:
    """The result is that of the correct poses alone, with the same error."""
    rng = np.random.default_rng(n_wrong)
    x, hands, eyes = noisy_poses(rng, 12)
    bad = spoiled(rng, eyes, n_wrong, kind)
    found = hand_eye_from_poses(pga3.motor_from_matrix(hands), -pga3.motor_from_matrix(bad))
    alone = hand_eye_from_poses(pga3.motor_from_matrix(hands[:, n_wrong:]), pga3.motor_from_matrix(bad[:, n_wrong:]))
    assert (found.status == HandEyeStatus.OK).all()
    assert not found.inliers[:, :n_wrong].any()
    assert found.inliers[:, n_wrong:].mean() > 0.99
    error, least = rotation_error(found.motor, x), rotation_error(alone.motor, x)
    assert np.median(error) <= 1.01 * np.median(least)
    assert np.sqrt(np.mean(error**2)) <= 1.1 * np.sqrt(np.mean(least**2))
    assert found.rotation_residual.max() < 0.02 and found.translation_residual.max() < 0.03


@pytest.mark.parametrize("n_wrong", [1, 4])
def test_wrong_poses_are_rejected_from_all_motions_between_poses(n_wrong: int) -> None:
    """If five of 15 poses are wrong, so are most motions between them, yet two thirds of the poses agree."""
    rng = np.random.default_rng(10 + n_wrong)
    x, hands, eyes = noisy_poses(rng, 10)
    bad = spoiled(rng, eyes, n_wrong, "altogether")
    i, j = np.triu_indices(N_POSES, 1)
    a, b = (pga3.motor_from_matrix(np.linalg.inv(each[:, i]) @ each[:, j]) for each in (hands, bad))
    found = hand_eye(a, b)
    assert (found.status == HandEyeStatus.OK).all()
    np.testing.assert_array_equal(found.inliers.all(0), (i >= n_wrong) & (j >= n_wrong))
    assert rotation_error(found.motor, x).max() < 0.01


def test_wrong_motions_are_rejected() -> None:
    rng = np.random.default_rng(20)
    x, a = poses(rng, 40), poses(rng, 40, 12)
    b = np.linalg.inv(x)[:, None] @ a @ x[:, None] @ poses(rng, 40, 12, angle=2e-3, length=2e-3)
    b[:, :4] = poses(rng, 40, 4)
    found = hand_eye(pga3.motor_from_matrix(a), pga3.motor_from_matrix(b))
    assert (found.status == HandEyeStatus.OK).all()
    assert not found.inliers[:, :4].any() and found.inliers[:, 4:].mean() > 0.99
    assert rotation_error(found.motor, x).max() < 0.02


def test_all_correct_poses_are_kept() -> None:
    """No pose is rejected because of noise, also with few poses, or if poses are exact."""
    rng = np.random.default_rng(21)
    for n_poses in (5, 8, 15):
        _, hands, eyes = noisy_poses(rng, 40, n_poses)
        found = hand_eye_from_poses(pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes))
        assert found.inliers.shape == (40, n_poses) and found.inliers.mean() > 0.998
    x, hands = poses(rng, 40), poses(rng, 40, 9)
    exact = hand_eye_from_poses(pga3.motor_from_matrix(hands), pga3.motor_from_matrix(hands @ x[:, None]))
    assert exact.inliers.all() and not exact.status.any()


@pytest.mark.parametrize("n_poses", [6, 15])
def test_poses_without_a_common_solution_are_inconsistent(n_poses: int) -> None:
    rng = np.random.default_rng(22)
    one, two = (pga3.motor_from_matrix(poses(rng, 50, n_poses)) for _ in range(2))
    assert (hand_eye_from_poses(one, two).status == HandEyeStatus.INCONSISTENT).all()
    assert (hand_eye(one, two).status == HandEyeStatus.INCONSISTENT).all()


def test_different_units_of_length_are_inconsistent() -> None:
    """Poses of the camera in millimetres, of the hand in metres: rotations agree, translations do not."""
    rng = np.random.default_rng(23)
    _, hands, eyes = noisy_poses(rng, 50)
    eyes[..., :3, 3] *= 1000
    found = hand_eye_from_poses(pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes))
    assert (found.status == HandEyeStatus.INCONSISTENT).all()


def test_a_batch_equals_single_problems() -> None:
    rng = np.random.default_rng(24)
    _, hands, eyes = noisy_poses(rng, 6)
    eyes[1::2] = spoiled(rng, eyes[1::2], 2, "altogether")
    one, two = pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes)
    whole = hand_eye_from_poses(one, two)
    for k in range(len(one)):
        each: Any = hand_eye_from_poses(one[k], two[k])
        assert each.status == whole.status[k] and np.array_equal(each.inliers, whole.inliers[k])
        np.testing.assert_allclose(each.motor, whole.motor[k], atol=1e-9)
        np.testing.assert_allclose(each.world, whole.world[k], atol=1e-9)


def test_screws_of_conjugate_motions_are_the_same() -> None:
    """Compare with angles and translations along the axis from matrices (Chen's screw congruence)."""
    from generated import hand_eye as kernels

    rng = np.random.default_rng(25)
    a, b = poses(rng, 200), poses(rng, 200)

    def screw(matrices: Array) -> tuple[Array, Array]:
        turn = Rotation.from_matrix(matrices[:, :3, :3]).as_rotvec()
        angle = np.linalg.norm(turn, axis=-1)
        return angle, np.abs(np.einsum("ni,ni->n", turn / angle[:, None], matrices[:, :3, 3]))

    signs = rng.choice([-1.0, 1.0], (2, 200, 1))
    turn, pitch = kernels.screw_misfit(signs[0] * pga3.motor_from_matrix(a), signs[1] * pga3.motor_from_matrix(b))
    (angle, along), (other, beside) = screw(a), screw(b)
    np.testing.assert_allclose(turn, np.sin((angle - other) / 2), atol=1e-12)
    np.testing.assert_allclose(pitch, (along * np.sin(angle / 2) - beside * np.sin(other / 2)) / 2, atol=1e-12)


def test_no_solution_that_few_data_agree_with_is_ok() -> None:
    from algorithms.vision.hand_eye import _tested

    ok, none = np.array([HandEyeStatus.OK]), np.array([False])
    assert _tested(ok, np.zeros((1, 2)), np.ones(1), none, none) == [HandEyeStatus.INCONSISTENT]


def test_the_point_that_motions_move_least() -> None:
    """Rotations about one point, by matrices: least squares of displacements, regularised towards the origin."""
    from algorithms.vision.hand_eye_noise import still_points

    rng = np.random.default_rng(26)
    n_motions, turns, point = 30, 1e-5 * rng.normal(size=(30, 3)), np.array([0.3, -0.8, 0.5])
    matrices = np.tile(np.eye(4), (n_motions, 1, 1))
    matrices[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    matrices[:, :3, 3] = point - matrices[:, :3, :3] @ point
    rest, found = pga3.motor_logarithm(pga3.motor_from_matrix(matrices))[None], np.empty((1, 3))
    still_points(rest, found)
    cross = np.cross(turns[:, None], np.eye(3))
    normal = np.einsum("nki,nkj->ij", cross, cross)
    pull = 2 * np.sum(matrices[:, :3, 3] ** 2) / (3 * n_motions)
    truth = np.linalg.solve(normal + pull * np.eye(3), normal @ point)
    np.testing.assert_allclose(found[0], truth, atol=1e-4)
    assert np.linalg.norm(found[0] - point) < 0.1


@pytest.mark.parametrize("n_wrong", [0, 1])
def test_exact_copies_of_poses_count_once(n_wrong: int) -> None:
    """Five or seven pairs of poses, each four times, give the result of one of each; a copy may have another sign."""
    rng = np.random.default_rng(27)
    _, hands, eyes = noisy_poses(rng, 10, 5 + 2 * n_wrong)
    one, two = pga3.motor_from_matrix(hands), pga3.motor_from_matrix(spoiled(rng, eyes, n_wrong, "altogether"))
    once = hand_eye_from_poses(one, two)
    signs = rng.choice([-1.0, 1.0], (2, 10, 4 * one.shape[1], 1))
    several = hand_eye_from_poses(signs[0] * np.tile(one, (1, 4, 1)), signs[1] * np.tile(two, (1, 4, 1)))
    np.testing.assert_array_equal(several.status, once.status)
    np.testing.assert_array_equal(several.inliers, np.tile(once.inliers, (1, 4)))
    np.testing.assert_allclose(several.deviation, once.deviation, rtol=1e-6)
    np.testing.assert_allclose(several.motor, once.motor, atol=1e-9)


def test_copies_of_two_poses_determine_nothing() -> None:
    rng = np.random.default_rng(28)
    _, hands, eyes = noisy_poses(rng, 10, 2)
    one, two = (np.tile(pga3.motor_from_matrix(each), (1, 5, 1)) for each in (hands, eyes))
    found = hand_eye_from_poses(one, two)
    assert found.status.all() and np.isinf(found.deviation).all() and found.inliers.shape == (10, 10)


def test_few_poses_that_agree_by_chance_are_not_ok() -> None:
    """Four poses of five prove a solution, three do not: also three inverted poses have one, with the same screws."""
    rng = np.random.default_rng(29)
    x, z = poses(rng, 60, length=0.1), poses(rng, 60)
    hands = poses(rng, 60, 6, angle=0.8, length=0.3)
    eyes = np.linalg.inv(z)[:, None] @ hands @ x[:, None] @ poses(rng, 60, 6, angle=3e-3, length=5e-4)
    one, two = pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes)
    for n_wrong in (1, 2):
        bad = pga3.motor_from_matrix(spoiled(rng, eyes[:, :5], n_wrong, "altogether"))
        status = hand_eye_from_poses(one[:, :5], bad).status
        assert (status == (HandEyeStatus.OK if n_wrong == 1 else HandEyeStatus.INCONSISTENT)).all()
    assert (hand_eye_from_poses(one, pga3.motor_inverse(two)).status == HandEyeStatus.INCONSISTENT).all()


def errors(found: Any, x: Array) -> Array:
    """Errors (p, 2) of rotation and translation, in deviations."""
    off = np.linalg.norm(pga3.motor_to_matrix(found.motor)[:, :3, 3] - x[:, :3, 3], axis=1)
    return np.stack([rotation_error(found.motor, x), off], 1) / found.deviation


def test_deviations_of_few_poses_are_those_of_students_distribution() -> None:
    """Errors are above 4.03 deviations in a thousandth, as those of many poses: normal ones are in 4 %."""
    x, hands, eyes = noisy_poses(np.random.default_rng(31), 1500, 4)
    found = hand_eye_from_poses(pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes))
    usual = found.status == HandEyeStatus.OK
    far = (errors(found, x) > 4.03).any(1) & usual
    assert usual.mean() > 0.95 and far.sum() <= 9


@pytest.mark.parametrize("first", [5, 8, 11])
def test_a_camera_that_slips_on_the_hand_is_noticed(first: int) -> None:
    """By more than noise; the place before or after may be within its deviations otherwise. Signs do not matter."""
    rng = np.random.default_rng(first)
    for size in (0.02, 0.05):
        x, hands, eyes = noisy_poses(rng, 30, 16)
        slip = poses(rng, 30, angle=size, length=0.02)
        eyes[:, first:] = eyes[:, first:] @ slip[:, None]
        signs = rng.choice([-1.0, 1.0], (30, 16, 1))
        found = hand_eye_from_poses(pga3.motor_from_matrix(hands), signs * pga3.motor_from_matrix(eyes))
        right = np.minimum(*(errors(found, each).max(1) for each in (x, x @ slip))) < 4.03
        assert (right | (found.status == HandEyeStatus.INCONSISTENT)).all()


def test_exact_poses_of_single_and_double_precision_are_not_contradicted() -> None:
    """Rounding errors of successive poses may be alike."""
    rng = np.random.default_rng(33)
    x, z, hands = poses(rng, 200), poses(rng, 200), poses(rng, 200, 12)
    eyes = np.linalg.inv(z)[:, None] @ hands @ x[:, None]
    for dtype in (np.float64, np.float32):
        one, two = (pga3.motor_from_matrix(each).astype(dtype) for each in (hands, eyes))
        assert not hand_eye_from_poses(one, two).status.any()


@pytest.mark.parametrize("scales", [np.ones(6), np.array([1, 1, 1, 0.01, 0.01, 0.01]), 1.0 / np.arange(1, 7)])
def test_independent_numbers_of_few_poses_are_counted_without_bias(scales: Array) -> None:
    """The trace of the squared covariance is that of its definition, also if differences share poses."""
    rng, squares = np.random.default_rng(34), (scales**2).sum() ** 2
    for n in (5, 12):
        found = [_squared_traces(np.diff(rng.normal(size=(n, 6)) * scales, axis=0)) for _ in range(4000)]
        whole, parts = np.mean(found, axis=0) / 4
        assert parts == pytest.approx((scales**4).sum(), rel=0.08)
        assert whole == pytest.approx(squares, rel=0.08)
