"""Hand-eye calibration against matrices of scipy that share no code with it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.vision import Camera, HandEyeStatus, calibrate_endoscope, hand_eye, hand_eye_from_poses
from generated import cga3, pga3

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
    # And is the difference of both products everywhere else.
    other = pga3.motor_from_matrix(poses(rng, 1000))
    products = pga3.motor_product(one, other) - pga3.motor_product(other, two)
    np.testing.assert_allclose((pga3.motor_equation(one, two) @ other[..., None])[..., 0], products, atol=1e-13)


@pytest.mark.parametrize("n_motions", [2, 3, 10])
@pytest.mark.parametrize("length", [1e-3, 1, 1e3])
def test_exact_motions_give_the_exact_place(n_motions: int, length: float) -> None:
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


def test_parallel_axes_and_pure_translations_are_told() -> None:
    rng = np.random.default_rng(3)
    x, a = poses(rng), poses(rng, 6)
    a[:, :3, :3] = Rotation.from_rotvec(np.outer(rng.uniform(0.2, 2, 6), [0, 0.6, 0.8])).as_matrix()
    found = hand_eye(*motions(rng, x, a))
    assert found.status == HandEyeStatus.PARALLEL_AXES
    # What is found solves the equations all the same.
    assert found.rotation_residual < 1e-12 and found.translation_residual < 1e-12
    a[:, :3, :3] = np.eye(3)
    assert hand_eye(*motions(rng, x, a)).status == HandEyeStatus.SMALL_ANGLES
    still = np.tile(np.eye(8)[0], (4, 1))
    assert hand_eye(still, still).status == HandEyeStatus.SMALL_ANGLES


@pytest.mark.parametrize("n_motions", [2, 3, 6, 40])
def test_noise_does_not_hide_parallel_axes(n_motions: int) -> None:
    """Of the hand too, and of translations far more than of rotations: never OK, and OK where axes differ."""
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


def test_motions_of_all_pairs_of_poses_are_told() -> None:
    """Noise of few poses is in many motions: weighed as what it is, it does far less."""
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
    mixed = [each[:, ::-1] for each in pairs]  # in another order they are motions like others

    def error(motors: Array) -> float:
        return float(np.sqrt(np.mean((pga3.motor_to_matrix(motors) - x)[:, :3, 3] ** 2)))

    of_poses = hand_eye_from_poses(pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes), noise="camera")
    assert error(found.motor) < 0.9 * error(hand_eye(*mixed).motor)
    assert error(of_poses.motor) < 1.1 * error(found.motor)
    rest = pga3.motor_product(pga3.motor_inverse(pga3.motor_product(found.motor[:, None], pairs[1])), pairs[0])
    rest = pga3.motor_to_matrix(pga3.motor_product(rest, found.motor[:, None]))
    turned = np.linalg.norm(rest[..., :3, :3] - np.eye(3), axis=(-1, -2)) / np.sqrt(2)
    np.testing.assert_allclose(found.rotation_residual, np.sqrt(np.mean(turned**2, -1)), rtol=1e-3)


def test_noise_of_either_end_of_motions_does_the_same() -> None:
    """Of what the camera looks at from where it comes, or from where it goes to: inverse motions swap them."""
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
def test_whose_noise_it_is_need_not_be_said(whose: Any) -> None:
    rng = np.random.default_rng(23)
    x, z, hands = poses(rng, 200), poses(rng, 200), poses(rng, 200, 10)
    eyes = np.linalg.inv(z)[:, None] @ hands @ x[:, None]
    noise = poses(rng, 200, 10, angle=4e-3, length=1e-3)
    if whose == "hand":
        hands = hands @ noise
    else:
        eyes = noise @ eyes
    errors = []
    for told in (whose, "either", "camera" if whose == "hand" else "hand"):
        found = hand_eye_from_poses(pga3.motor_from_matrix(hands), pga3.motor_from_matrix(eyes), noise=told)
        assert not found.status.any()
        errors.append(np.sqrt(np.mean((pga3.motor_to_matrix(found.motor) - x)[:, :3, 3] ** 2)))
    assert errors[1] < 1.1 * errors[0] and 1.5 * errors[1] < errors[2]


def test_degenerate_input_has_a_status_of_its_own() -> None:
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


def test_single_precision_stays_single() -> None:
    rng = np.random.default_rng(6)
    x = poses(rng)
    one, two = motions(rng, x, poses(rng, 8))
    found = hand_eye(one.astype(np.float32), two.astype(np.float32))
    assert found.motor.dtype == np.float32 and found.status == HandEyeStatus.OK
    assert np.abs(pga3.motor_to_matrix(found.motor) - x).max() < 1e-4


def test_two_clean_motions_recover_the_place_to_the_last_digits() -> None:
    """Axes 45 degrees apart and more; the rest of the error is in the motions themselves."""
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
    """Motors of the conformal algebra fulfil ``A X = X B`` there, and go through the same function."""
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


def test_poses_give_both_places() -> None:
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
    assert list(spoiled.status) == [HandEyeStatus.OK, HandEyeStatus.NOT_FINITE, HandEyeStatus.OK]
    assert np.isnan(spoiled.world[1]).all() and np.isfinite(spoiled.world[[0, 2]]).all()
    hands[0] = poses(rng, 1)[0] @ hands[0] * 0 + hands[0, :1]
    still = hand_eye_from_poses(pga3.motor_from_matrix(hands[0]), pga3.motor_from_matrix(eyes[0]))
    assert still.status != HandEyeStatus.OK


def test_refinement_is_the_least_squares_of_its_misfits() -> None:
    """No small motion of X makes the weighed sum less: against derivatives by differences."""
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


def test_small_angles_are_told() -> None:
    rng = np.random.default_rng(15)
    x, a = poses(rng), poses(rng, 8, angle=1e-4)
    one, two = motions(rng, x, a)
    assert hand_eye(one, two).status == HandEyeStatus.OK
    noisy = pga3.motor_product(two, pga3.motor_exponential(1e-3 * rng.normal(size=(8, 6))))
    assert hand_eye(one, noisy).status == HandEyeStatus.SMALL_ANGLES


def test_an_endoscope_under_a_tracker() -> None:
    """Millimetres; 0.35 mm and 0.2 degrees of noise of the tracker, 0.2 pixels of the images."""
    rng = np.random.default_rng(16)
    grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0), [0.0]), -1).reshape(-1, 3) * 5
    camera = Camera.from_intrinsics(700.0, (320, 240))
    x, z = poses(rng, length=50), poses(rng, length=300)
    turns = Rotation.from_rotvec(0.4 * rng.normal(size=(15, 3))).as_matrix()
    eyes = np.tile(np.eye(4), (15, 1, 1))
    eyes[:, :3, :3] = turns
    eyes[:, :3, 3] = grid.mean(0) - 80 * turns[:, :, 2]
    bodies = z @ eyes @ np.linalg.inv(x)
    noise = poses(rng, 15, angle=np.radians(0.2), length=0.35)
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
    assert calibrate_endoscope(motors, grid, views, camera.intrinsics).status == HandEyeStatus.NOT_FINITE
    with pytest.raises(ValueError, match="views: shape"):
        calibrate_endoscope(motors[1:], grid, views, camera.intrinsics)
