"""Hand-eye calibration against matrices of scipy that share no code with it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.vision import Camera, HandEyeStatus, calibrate_endoscope, hand_eye, hand_eye_from_poses
from algorithms.vision import hand_eye_noise as noises
from generated import cga3, pga3
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]


def poses(rng: np.random.Generator, *shape: int, angle: float | None = None, length: float = 1.0) -> Array:
    """Rigid motions as 4 x 4 matrices, of any angle or of one."""
    axes = rng.normal(size=(*shape, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    angles = rng.uniform(0.1, 3, (*shape, 1)) if angle is None else angle
    matrices = np.zeros((*shape, 4, 4))
    matrices[..., :3, :3] = Rotation.from_rotvec((axes * angles).reshape(-1, 3)).as_matrix().reshape(*shape, 3, 3)
    matrices[..., :3, 3] = length * rng.normal(size=(*shape, 3))
    matrices[..., 3, 3] = 1
    return matrices


def motions(rng: np.random.Generator, x: Array, a: Array) -> tuple[Array, Array]:
    """Motors of the hand and of the camera, with any signs."""
    b = np.linalg.inv(x)[..., None, :, :] @ a @ x[..., None, :, :]
    signs = rng.choice([-1.0, 1.0], (2, *a.shape[:-2], 1))
    return signs[0] * pga3.motor_from_matrix(a), signs[1] * pga3.motor_from_matrix(b)


def test_the_equation_vanishes_on_the_motor_between_both_places() -> None:
    rng = np.random.default_rng(1)
    x, a = poses(rng, 1000), poses(rng, 1000)
    one, two = pga3.motor_from_matrix(a), pga3.motor_from_matrix(np.linalg.inv(x) @ a @ x)
    same = np.where(np.einsum("ni,ni->n", one[:, [0, 7]], two[:, [0, 7]]) < 0, -1, 1)[:, None]
    motor = pga3.motor_from_matrix(x)
    matrix = pga3.motor_equation(one, same * two)
    assert np.abs(matrix @ motor[..., None]).max() < 1e-12
    # Elsewhere it is the difference of both products.
    other = pga3.motor_from_matrix(poses(rng, 1000))
    products = pga3.motor_product(one, other) - pga3.motor_product(other, two)
    np.testing.assert_allclose((pga3.motor_equation(one, two) @ other[..., None])[..., 0], products, atol=1e-13)


@all_cases("n_motions", [2, 3, 10])
@all_cases("length", [1e-3, 1, 1e3])
def test_exact_motions_give_the_exact_pose(n_motions: int, length: float) -> None:
    rng = np.random.default_rng(n_motions)
    x, a = poses(rng, 500, length=length), poses(rng, 500, n_motions, length=length)
    found = hand_eye(*motions(rng, x, a))
    assert found.motor.shape == (500, 8) and not found.status.any()
    error = np.abs(pga3.motor_to_matrix(found.motor) - x)
    error[..., :3, 3] /= length
    # Axes of two motions may be nearly parallel: the error is that of the equations.
    bound = 1e-14 * found.singular_values[:, 0] / found.singular_values[:, 5]
    assert (error.max((-1, -2)) < 10 * bound).all() and np.median(error.max((-1, -2))) < 1e-14
    assert found.rotation_residual.max() < 1e-12 and (found.translation_residual / length).max() < 1e-12
    assert (found.motor[:, 0] >= 0).all()


def test_half_turns_take_their_signs_from_the_others() -> None:
    rng = np.random.default_rng(2)
    x = poses(rng, 300)
    a = np.concatenate([poses(rng, 300, 3), poses(rng, 300, 4, angle=np.pi)], 1)
    found = hand_eye(*motions(rng, x, a))
    assert not found.status.any()
    assert np.abs(pga3.motor_to_matrix(found.motor) - x).max() < 1e-10
    alone = hand_eye(*motions(rng, x, a[:, 3:]))
    assert (alone.status == HandEyeStatus.AMBIGUOUS_SIGNS).all()


def test_parallel_axes_and_pure_translations_are_reported() -> None:
    rng = np.random.default_rng(3)
    x, a = poses(rng), poses(rng, 6)
    a[:, :3, :3] = Rotation.from_rotvec(np.outer(rng.uniform(0.2, 2, 6), [0, 0.6, 0.8])).as_matrix()
    found = hand_eye(*motions(rng, x, a))
    assert found.status == HandEyeStatus.PARALLEL_AXES
    # The result solves the equations nevertheless.
    assert found.rotation_residual < 1e-12 and found.translation_residual < 1e-12
    a[:, :3, :3] = np.eye(3)
    assert hand_eye(*motions(rng, x, a)).status == HandEyeStatus.SMALL_ANGLES
    still = np.tile(np.eye(8)[0], (4, 1))
    assert hand_eye(still, still).status == HandEyeStatus.SMALL_ANGLES


@pytest.mark.parametrize("n_motions", [2, 3, 6, 40])
def test_noise_does_not_hide_parallel_axes(n_motions: int) -> None:
    """With noise also of the hand, mainly in translations, parallel axes are never OK, and different axes are."""
    rng = np.random.default_rng(21)
    x, a = poses(rng, 300), poses(rng, 300, n_motions)
    for parallel in (True, False):
        if parallel:
            turns = rng.uniform(0.2, 2, (300 * n_motions, 1)) * np.array([0, 0.6, 0.8])
            a[..., :3, :3] = Rotation.from_rotvec(turns).as_matrix().reshape(300, n_motions, 3, 3)
        one, two = motions(rng, x, a)
        for each in (one, two):
            noise = rng.normal(size=(*each.shape[:-1], 6)) * [1e-3, 1e-3, 1e-3, 1e-2, 1e-2, 1e-2]
            each[:] = pga3.motor_product(each, pga3.motor_exponential(noise))
        status = hand_eye(one, two).status
        assert (status != HandEyeStatus.OK).all() if parallel else (status == HandEyeStatus.OK).mean() > 0.97
        a = poses(rng, 300, n_motions)


@pytest.mark.slow
def test_motions_of_all_pairs_of_poses_are_recognised() -> None:
    """Noise of few poses is in many motions: correct weights reduce its effect."""
    rng = np.random.default_rng(22)
    x, hands = poses(rng, 200), poses(rng, 200, 8)
    eyes = poses(rng, 200, 8, angle=4e-3, length=5e-4) @ poses(rng, 200, 1) @ hands @ x[:, None]
    i, j = np.triu_indices(8, 1)
    signs = rng.choice([-1.0, 1.0], (2, 200, 28, 1))
    pairs = [
        sign * pga3.motor_from_matrix(np.linalg.inv(each[:, i]) @ each[:, j])
        for sign, each in zip(signs, (hands, eyes), strict=True)
    ]
    found = hand_eye(*pairs)
    assert not found.status.any()
    mixed = [each[:, ::-1] for each in pairs]  # in a different order they are not recognised as motions of all pairs

    def error(motors: Array) -> float:
        return float(np.sqrt(np.mean((pga3.motor_to_matrix(motors) - x)[:, :3, 3] ** 2)))

    of_poses = hand_eye_from_poses(pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes), noise="camera")
    assert error(found.motor) < 0.9 * error(hand_eye(*mixed).motor)
    assert error(of_poses.motor) < 1.1 * error(found.motor)
    rest = pga3.motor_product(pga3.motor_inverse(pga3.motor_product(found.motor[:, None], pairs[1])), pairs[0])
    rest = pga3.motor_to_matrix(pga3.motor_product(rest, found.motor[:, None]))
    turned = np.linalg.norm(rest[..., :3, :3] - np.eye(3), axis=(-1, -2)) / np.sqrt(2)
    np.testing.assert_allclose(found.rotation_residual, np.sqrt(np.mean(turned**2, -1)), rtol=1e-3)


def test_noise_of_either_end_of_motions_is_treated_equally() -> None:
    """Noise at the start or at the end of motions: inverse motions exchange the two."""
    rng = np.random.default_rng(24)
    x, a = poses(rng, 300), poses(rng, 300, 12)
    b = np.linalg.inv(x)[:, None] @ a @ x[:, None]
    noise = poses(rng, 300, 12, angle=4e-3, length=1e-3)

    def error(one: Array, two: Array) -> float:
        found = hand_eye(pga3.motor_from_matrix(one), pga3.motor_from_matrix(two))
        return float(np.sqrt(np.mean((pga3.motor_to_matrix(found.motor) - x)[:, :3, 3] ** 2)))

    after = b @ noise
    assert error(np.linalg.inv(a), np.linalg.inv(after)) == pytest.approx(error(a, after), rel=1e-3)
    assert error(a, noise @ b) < 1.3 * error(a, after)


@pytest.mark.parametrize("whose", ["hand", "camera"])
def test_the_source_of_noise_is_optional(whose: Any) -> None:
    rng = np.random.default_rng(23)
    x, z, hands = poses(rng, 80), poses(rng, 80), poses(rng, 80, 10)
    eyes = np.linalg.inv(z)[:, None] @ hands @ x[:, None]
    noise = poses(rng, 80, 10, angle=4e-3, length=1e-3)
    if whose == "hand":
        hands = hands @ noise
    else:
        eyes = noise @ eyes
    errors = []
    for given in (whose, "either", "camera" if whose == "hand" else "hand"):
        found = hand_eye_from_poses(pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes), noise=given)
        assert not found.status.any()
        errors.append(np.sqrt(np.mean((pga3.motor_to_matrix(found.motor) - x)[:, :3, 3] ** 2)))
    assert errors[1] < 1.1 * errors[0] and 1.5 * errors[1] < errors[2]


def test_degenerate_input_has_a_separate_status() -> None:
    rng = np.random.default_rng(4)
    x, a = poses(rng, 3), poses(rng, 3, 5)
    one, two = motions(rng, x, a)
    one[1, 2, 3] = np.nan
    found = hand_eye(one, two)
    assert list(found.status) == [HandEyeStatus.OK, HandEyeStatus.NOT_FINITE, HandEyeStatus.OK]
    assert np.isnan(found.motor[1]).all() and np.isfinite(found.motor[[0, 2]]).all()
    few = hand_eye(one[0, :1], two[0, :1])
    assert few.status == HandEyeStatus.TOO_FEW and np.isnan(few.motor).all()
    assert hand_eye(one[:, :0], two[:, :0]).status.shape == (3,)
    with pytest.raises(ValueError, match="b: 4 motions; expected 5"):
        hand_eye(one, two[:, :4])
    with pytest.raises(ValueError, match=r"a: shape \(3, 5, 7\); expected"):
        hand_eye(one[..., :7], two)
    two[2, 1] *= 2
    with pytest.raises(ValueError, match=r"b\[2, 1\]: not a unit motor"):
        hand_eye(one, two)
    one[2, 4, 7] += 1
    with pytest.raises(ValueError, match=r"a\[2, 4\]: not a unit motor"):
        hand_eye_from_poses(one, one)
    still = np.tile(np.eye(8)[0], (4, 1)) + 1e-17
    assert hand_eye(still, still).status == HandEyeStatus.SMALL_ANGLES


def test_noise_shrinks_with_the_number_of_motions_and_shows_in_the_residuals() -> None:
    rng = np.random.default_rng(5)
    x = poses(rng, 200)
    errors = []
    for n_motions in (4, 64):
        a = poses(rng, 200, n_motions)
        one, two = motions(rng, x, a)
        two = pga3.motor_product(two, pga3.motor_exponential(1e-4 * rng.normal(size=(*two.shape[:-1], 6))))
        found = hand_eye(one, two)
        assert not found.status.any()
        assert 5e-5 < np.median(found.rotation_residual) < 5e-4
        errors.append(np.median(np.abs(pga3.motor_to_matrix(found.motor) - x).max((-1, -2))))
    assert errors[1] < errors[0] / 2 and errors[0] < 2e-3


@pytest.mark.parametrize("length", [1e-8, 1e8])
def test_units_of_length_do_not_matter(length: float) -> None:
    rng = np.random.default_rng(25)
    x, z, hands = poses(rng, 300), poses(rng, 300), poses(rng, 300, 3)
    eyes = np.linalg.inv(z)[:, None] @ hands @ x[:, None] @ poses(rng, 300, 3, angle=0.1, length=0.1)
    found = []
    for size in (1.0, length):
        for each in (hands, eyes):
            each[..., :3, 3] *= size
        found.append(hand_eye_from_poses(pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes)))
    assert (found[0].status == found[1].status).all() and (found[0].status == HandEyeStatus.OK).mean() > 0.5
    np.testing.assert_allclose(found[0].motor[:, :4], found[1].motor[:, :4], atol=1e-7)
    np.testing.assert_allclose(found[0].motor[:, 4:], found[1].motor[:, 4:] / length, atol=1e-6)


def test_single_precision_is_preserved() -> None:
    rng = np.random.default_rng(6)
    x = poses(rng)
    one, two = motions(rng, x, poses(rng, 8))
    found = hand_eye(one.astype(np.float32), two.astype(np.float32))
    assert found.motor.dtype == np.float32 and found.status == HandEyeStatus.OK
    assert np.abs(pga3.motor_to_matrix(found.motor) - x).max() < 1e-4


def test_two_clean_motions_recover_the_pose_to_the_last_digits() -> None:
    """Axes are at least 45 degrees apart; the remaining error is that of the motions."""
    rng = np.random.default_rng(11)
    x, a = poses(rng, 2000), poses(rng, 2000, 2)
    axes = np.stack([Rotation.from_matrix(a[:, k, :3, :3]).as_rotvec() for k in (0, 1)])
    sines = np.linalg.norm(np.cross(*axes), axis=-1) / np.linalg.norm(axes, axis=-1).prod(0)
    apart = (sines > 0.7) & (np.linalg.norm(axes, axis=-1).min(0) > 0.5)
    one, two = motions(rng, x[apart], a[apart])
    found = hand_eye(one, two)
    error = np.abs(pga3.motor_to_matrix(found.motor) - x[apart]).max((-1, -2))
    assert len(error) > 500 and error.max() < 1e-14


def test_the_conformal_form_has_the_same_coefficients() -> None:
    """Motors of the conformal algebra satisfy ``A X = X B`` and are accepted by the same function."""
    rng = np.random.default_rng(12)
    x, a = poses(rng), poses(rng, 6)
    b = np.linalg.inv(x) @ a @ x
    one, two = (
        cga3.motor_from_rotor_translation(
            pga3.motor_to_rotor_translation(pga3.motor_from_matrix(each))[0], each[:, :3, 3]
        )
        for each in (a, b)
    )
    found = hand_eye(one, two)
    left, right = cga3.motor_product(one, found.motor), cga3.motor_product(found.motor, two)
    assert np.minimum(np.abs(left - right).max(-1), np.abs(left + right).max(-1)).max() < 1e-14
    assert np.abs(cga3.motor_to_matrix(found.motor) - x).max() < 1e-14


def test_poses_determine_both_transformations() -> None:
    rng = np.random.default_rng(13)
    x, z, hands = poses(rng, 100), poses(rng, 100), poses(rng, 100, 5)
    eyes = np.linalg.inv(z)[:, None] @ hands @ x[:, None]
    signs = rng.choice([-1.0, 1.0], (2, 100, 5, 1))
    found = hand_eye_from_poses(signs[0] * pga3.motor_from_matrix(hands), signs[1] * pga3.motor_from_matrix(eyes))
    assert not found.status.any()
    assert np.abs(pga3.motor_to_matrix(found.motor) - x).max() < 1e-12
    assert np.abs(pga3.motor_to_matrix(found.world) - z).max() < 1e-12
    assert found.rotation_residual.max() < 1e-14 and found.translation_residual.max() < 1e-13
    few = hand_eye_from_poses(pga3.motor_from_matrix(hands[0, :2]), pga3.motor_from_matrix(eyes[0, :2]))
    assert few.status == HandEyeStatus.TOO_FEW and np.isnan(few.world).all()
    bad = pga3.motor_from_matrix(hands[:3])
    bad[1, 2, 0] = np.inf
    spoiled = hand_eye_from_poses(bad, pga3.motor_from_matrix(eyes[:3]))
    assert not spoiled.status.any() and not spoiled.inliers[1, 2] and spoiled.inliers.sum() == 14
    assert np.abs(pga3.motor_to_matrix(spoiled.motor) - x[:3]).max() < 1e-12
    bad[1, 3:, 5] = np.nan
    spoiled = hand_eye_from_poses(bad, pga3.motor_from_matrix(eyes[:3]))
    assert list(spoiled.status) == [HandEyeStatus.OK, HandEyeStatus.NOT_FINITE, HandEyeStatus.OK]
    assert np.isnan(spoiled.world[1]).all() and np.isfinite(spoiled.world[[0, 2]]).all()
    hands[0] = poses(rng, 1)[0] @ hands[0] * 0 + hands[0, :1]
    still = hand_eye_from_poses(pga3.motor_from_matrix(hands[0]), pga3.motor_from_matrix(eyes[0]))
    assert still.status != HandEyeStatus.OK


def test_refinement_minimises_the_sum_of_squares() -> None:
    """The gradient of the weighted sum along motions of X vanishes, by finite differences."""
    rng = np.random.default_rng(14)
    x, a = poses(rng), poses(rng, 12)
    one, two = motions(rng, x, a)
    two = pga3.motor_product(two, pga3.motor_exponential(1e-3 * rng.normal(size=(12, 6))))
    found = hand_eye(one, two)
    weight = (found.rotation_residual / found.translation_residual) ** 2

    def cost(b: Array) -> float:
        there = pga3.motor_product(found.motor, pga3.motor_exponential(b))
        left, right = pga3.motor_product(one, there), pga3.motor_product(there, two)
        rest = pga3.motor_product(pga3.motor_inverse(right), left)
        return float((rest[:, 1:4] ** 2).sum() + weight * (rest[:, 4:7] ** 2).sum())

    slope = np.array([(cost(1e-5 * e) - cost(-1e-5 * e)) / 2e-5 for e in np.eye(6)])
    curve = np.array([(cost(1e-3 * e) + cost(-1e-3 * e) - 2 * cost(0 * e)) / 1e-6 for e in np.eye(6)])
    assert np.abs(slope / np.sqrt(curve * cost(np.zeros(6)))).max() < 0.02
    linear = hand_eye(one, two, refine=False)
    assert np.abs(found.motor - linear.motor).max() > 1e-6


def test_small_angles_are_reported() -> None:
    rng = np.random.default_rng(15)
    x, a = poses(rng), poses(rng, 8, angle=1e-4)
    one, two = motions(rng, x, a)
    assert hand_eye(one, two).status == HandEyeStatus.OK
    noisy = pga3.motor_product(two, pga3.motor_exponential(1e-3 * rng.normal(size=(8, 6))))
    assert hand_eye(one, noisy).status == HandEyeStatus.SMALL_ANGLES


def test_an_endoscope_with_a_tracker() -> None:
    """Millimetres; 0.35 mm and 0.2 degrees of noise of the tracker, 0.2 pixels of the images."""
    rng = np.random.default_rng(16)
    grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0), [0.0]), -1).reshape(-1, 3) * 5
    camera = Camera.from_intrinsics(700.0, (320, 240))
    x, z = poses(rng, length=50), poses(rng, length=300)
    turns = Rotation.from_rotvec(0.4 * rng.normal(size=(9, 3))).as_matrix()
    eyes = np.tile(np.eye(4), (9, 1, 1))
    eyes[:, :3, :3] = turns
    eyes[:, :3, 3] = grid.mean(0) - 80 * turns[:, :, 2]
    bodies = z @ eyes @ np.linalg.inv(x)
    noise = poses(rng, 9, angle=np.radians(0.2), length=0.35)
    motors = pga3.motor_from_matrix(bodies)
    views = np.stack([Camera(camera.intrinsics, pga3.motor_from_matrix(eye)).project(grid) for eye in eyes])
    clean = calibrate_endoscope(motors, grid, views, camera.intrinsics)
    assert clean.status == HandEyeStatus.OK
    assert np.abs(pga3.motor_to_matrix(clean.motor) - x).max() < 1e-7
    assert np.abs(pga3.motor_to_matrix(clean.world) - z).max() < 1e-7
    views = views + 0.2 * rng.normal(size=views.shape)
    found = calibrate_endoscope(pga3.motor_from_matrix(bodies @ noise), grid, views, camera.intrinsics)
    moved = pga3.motor_to_matrix(found.motor)
    assert found.status == HandEyeStatus.OK and np.linalg.norm((moved - x)[:3, 3]) < 1.0
    assert Rotation.from_matrix(moved[:3, :3].T @ x[:3, :3]).magnitude() < np.radians(0.3)
    views[3] = np.nan
    assert calibrate_endoscope(motors[1:4], grid, views[1:4], camera.intrinsics).status == HandEyeStatus.NOT_FINITE
    views[0, 5], lost = np.nan, pga3.motor_from_matrix(bodies @ noise)
    lost[1] = np.nan
    rest = calibrate_endoscope(lost, grid, views, camera.intrinsics)
    assert rest.status == HandEyeStatus.OK and not rest.inliers[[1, 3]].any() and rest.inliers[0]
    assert np.linalg.norm((pga3.motor_to_matrix(rest.motor) - x)[:3, 3]) < 1.0
    with pytest.raises(ValueError, match="views: shape"):
        calibrate_endoscope(motors[1:], grid, views, camera.intrinsics)


def test_a_batch_equals_single_problems() -> None:
    """Three closing motions, three that do not close, one not finite, and closing ones of 10000 times the length."""
    rng = np.random.default_rng(26)
    x, hands = poses(rng, 6), poses(rng, 6, 3)
    eyes = hands @ x[:, None] @ poses(rng, 6, 3, angle=1e-2, length=1e-2)
    i, j = np.triu_indices(3, 1)
    one, two = (pga3.motor_from_matrix(np.linalg.inv(each[:, i]) @ each[:, j]) for each in (hands, eyes))
    two[[1, 4]] = pga3.motor_product(two[[1, 4]], pga3.motor_exponential(1e-3 * rng.normal(size=(2, 3, 6))))
    two[2, 1, 5] = np.nan
    for each in (one, two):
        each[3, :, 4:] *= 1e4
    found = hand_eye(one, two)
    assert (found.status == HandEyeStatus.NOT_FINITE).tolist() == [False, False, True, False, False, False]
    for k in range(6):
        alone = hand_eye(one[k], two[k])
        assert alone.status == found.status[k]
        np.testing.assert_allclose(found.motor[k], alone.motor, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found.residual[k], alone.residual, rtol=1e-8)
    # All three measured motions contribute if they do not close.
    moved = two.copy()
    moved[1, 2] = pga3.motor_product(two[1, 2], pga3.motor_exponential(1e-3 * rng.normal(size=6)))
    assert np.abs(hand_eye(one, moved).motor[1] - found.motor[1]).max() > 1e-5


@pytest.mark.parametrize("length", [1e-8, 1e8])
@pytest.mark.parametrize("closed", [True, False])
def test_motions_in_other_units_of_length_give_the_same(closed: bool, length: float) -> None:
    rng = np.random.default_rng(27)
    x, hands = poses(rng, 100), poses(rng, 100, 3)
    eyes = hands @ x[:, None] @ poses(rng, 100, 3, angle=1e-2, length=1e-2)
    i, j = np.triu_indices(3, 1)
    one, two = (pga3.motor_from_matrix(np.linalg.inv(each[:, i]) @ each[:, j]) for each in (hands, eyes))
    if not closed:
        # Noise of translations only: 1e-4 of them, far below 1e-6 in the larger unit.
        two = pga3.motor_product(two, pga3.motor_exponential(1e-4 * rng.normal(size=(100, 3, 6)) * [0, 0, 0, 1, 1, 1]))
    unit = np.repeat([1.0, length], 4)
    here, there = hand_eye(one, two), hand_eye(one * unit, two * unit)
    assert (here.status == there.status).all()
    np.testing.assert_allclose(there.motor / unit, here.motor, atol=1e-6)
    np.testing.assert_allclose(there.residual / [1, length], here.residual, rtol=1e-4)
    wrong = one.copy()
    wrong[7, 1, 7] += 0.5
    for size in (1.0, length):
        with pytest.raises(ValueError, match=r"a\[7, 1\]: not a unit motor"):
            hand_eye(wrong * np.repeat([1.0, size], 4), two * np.repeat([1.0, size], 4))


def test_motors_that_are_not_unit_are_reported_next_to_far_larger_ones() -> None:
    rng = np.random.default_rng(28)
    one, two = motions(rng, poses(rng, 2), poses(rng, 2, 4))
    one[0, :, 4:] *= 1e6
    two[0, :, 4:] *= 1e6
    one[1, 3, 7] += 0.5
    with pytest.raises(ValueError, match=r"a\[1, 3\]: not a unit motor"):
        hand_eye(one, two)


def test_residuals_are_those_of_the_better_end_for_every_method() -> None:
    """Compare with matrices, for closing motions, for others, and without refinement."""
    rng = np.random.default_rng(29)
    x, hands = poses(rng, 20), poses(rng, 20, 4)
    eyes = hands @ x[:, None] @ poses(rng, 20, 4, angle=0.05, length=1e-3)
    i, j = np.triu_indices(4, 1)
    a, b = (np.linalg.inv(each[:, i]) @ each[:, j] for each in (hands, eyes))
    a, b = np.concatenate([a, np.linalg.inv(a)]), np.concatenate([b, np.linalg.inv(b)])
    one, two = pga3.motor_from_matrix(a), pga3.motor_from_matrix(b)
    for order, refine in ((slice(None), True), (slice(None, None, -1), True), (slice(None), False)):
        found = hand_eye(one[:, order], two[:, order], refine)
        place = pga3.motor_to_matrix(found.motor)[:, None]
        ends = []
        for left, right in ((a, b), (np.linalg.inv(a), np.linalg.inv(b))):
            rest = np.linalg.inv(place @ right) @ left @ place
            ends.append(np.sqrt(np.mean(np.sum(rest[..., :3, 3] ** 2, -1), -1)))
            turned = np.sqrt(np.mean(np.sum((rest[..., :3, :3] - np.eye(3)) ** 2, (-1, -2)) / 2, -1))
            np.testing.assert_allclose(found.rotation_residual, turned, rtol=0.01)
        assert (np.abs(ends[0] / ends[1] - 1) > 0.05).any()
        np.testing.assert_allclose(found.translation_residual, np.minimum(*ends), rtol=0.02)


def test_a_step_that_increases_the_residual_is_reverted(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(30)
    x, hands = poses(rng, 4), poses(rng, 4, 6)
    eyes = hands @ x[:, None] @ poses(rng, 4, 6, angle=1e-2, length=1e-2)
    one, two = pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes)
    right, start = hand_eye_from_poses(one, two), hand_eye_from_poses(one, two, refine=False)
    steps = noises.likely_steps

    def wrong_for_one(*arrays: Any) -> bool:
        done = steps(*arrays)
        arrays[-2][1] *= -20
        return done

    monkeypatch.setattr(noises, "likely_steps", wrong_for_one)
    found = hand_eye_from_poses(one, two)
    np.testing.assert_allclose(found.motor[1], start.motor[1], atol=1e-14)
    np.testing.assert_allclose(found.residual[1], start.residual[1], rtol=1e-9)
    np.testing.assert_allclose(found.motor[[0, 2, 3]], right.motor[[0, 2, 3]], atol=1e-14)
    assert np.abs(start.motor[1] - right.motor[1]).max() > 1e-6


def test_residuals_of_poses_are_root_mean_squares() -> None:
    """Compare with matrices: the angle of ``~(Z B) A X`` and the translation of the origin of the camera."""
    rng = np.random.default_rng(12)
    x, z, hands = poses(rng), poses(rng), poses(rng, 12)
    eyes = np.linalg.inv(z) @ hands @ x @ poses(rng, 12, angle=1e-3, length=1e-3)
    found = hand_eye_from_poses(pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes), refine=False)
    place, world = (pga3.motor_to_matrix(motor) for motor in (found.motor, found.world))
    rest = np.linalg.inv(world @ eyes) @ hands @ place
    angles = Rotation.from_matrix(rest[:, :3, :3]).magnitude()
    wanted = [np.sqrt(np.mean(angles**2)), np.sqrt(np.mean(np.sum(rest[:, :3, 3] ** 2, -1)))]
    np.testing.assert_allclose(found.residual, wanted, rtol=1e-4)


def test_singular_or_non_finite_sums_do_not_affect_the_batch() -> None:
    rng = np.random.default_rng(31)
    turns, shifts = rng.normal(size=(2, 4, 5, 3, 13))
    hand, seen = rng.normal(size=(4, 3)), rng.normal(size=(4, 5, 3))

    def steps(rows: Any) -> tuple[Array, Array]:
        count = len(turns[rows])
        moving, step = np.ones(count, np.bool_), np.empty((count, 12))
        room = np.ones((count, 3)), np.empty((count, 3)), np.empty(count), step, np.empty((count, 2))
        noises.likely_steps(turns[rows], shifts[rows], hand[rows], seen[rows], moving, True, *room)
        return step, moving

    alone = steps(slice(0, 1))[0][0]
    turns[1, 2, 1, 4] = np.nan
    turns[2], shifts[2] = 0.0, 0.0
    shifts[3, ..., :12] = np.inf
    step, moving = steps(slice(None))
    np.testing.assert_array_equal(step[0], alone)
    assert alone.any() and not step[1:].any() and moving[0] and not moving[[1, 3]].any()
    points = np.empty((3, 3))
    rest = rng.normal(size=(3, 4, 6))
    rest[1], rest[2, 0, 0] = 0.0, np.nan
    noises.still_points(rest, points)
    assert np.isfinite(points[0]).all() and not points[1].any() and np.isnan(points[2]).any()
