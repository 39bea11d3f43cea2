"""Hand-eye calibration against matrices of scipy that share no code with it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.vision import HandEyeStatus, hand_eye
from generated import pga3

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


def test_single_precision_stays_single() -> None:
    rng = np.random.default_rng(6)
    x = poses(rng)
    one, two = motions(rng, x, poses(rng, 8))
    found = hand_eye(one.astype(np.float32), two.astype(np.float32))
    assert found.motor.dtype == np.float32 and found.status == HandEyeStatus.OK
    assert np.abs(pga3.motor_to_matrix(found.motor) - x).max() < 1e-4
