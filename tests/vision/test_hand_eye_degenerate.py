"""The status of motions that do not determine the pose of a camera does not depend on rounding or the processor.

`tests/peers/test_processors.py` runs this file with the kernels of other processors.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.vision import HandEyeStatus, hand_eye, hand_eye_from_poses
from generated import pga3

Array = np.ndarray[Any, Any]

ORIGIN = np.eye(8)[0]
NUMBERS = (2, 3, 4, 6, 10, 21, 40)
N_PROBLEMS = 24


def motors(rng: np.random.Generator, *shape: int, length: float | Array = 1.0) -> Array:
    turns = Rotation.random(int(np.prod(shape)), random_state=rng).as_matrix()
    matrices = np.tile(np.eye(4), (*shape, 1, 1))
    matrices[..., :3, :3] = turns.reshape(*shape, 3, 3)
    matrices[..., :3, 3] = length * rng.normal(size=(*shape, 3))
    return pga3.motor_from_matrix(matrices)


def translations(rng: np.random.Generator, *shape: int, length: float | Array = 1.0) -> Array:
    return pga3.motor_from_rotor_translation(np.eye(4)[0], length * rng.normal(size=(*shape, 3)))


def rotations_about_one_axis(rng: np.random.Generator, *shape: int, length: float | Array = 1.0) -> Array:
    matrices = np.tile(np.eye(4), (*shape, 1, 1))
    angles = rng.uniform(0.2, 2, (int(np.prod(shape)), 1))
    matrices[..., :3, :3] = Rotation.from_rotvec(angles * [0, 0.6, 0.8]).as_matrix().reshape(*shape, 3, 3)
    matrices[..., :3, 3] = length * rng.normal(size=(*shape, 3))
    return pga3.motor_from_matrix(matrices)


def perturbed(rng: np.random.Generator, exact: Array, size: Array) -> Array:
    """Perturb every coefficient by up to `size`, and those of translations relative to the largest as well."""
    far = np.abs(exact[..., 4:7]).max((-1, -2), keepdims=True)
    scale = np.concatenate([np.broadcast_to(size, (*far.shape[:-1], 4)), size * (1 + far) * [1, 1, 1, 0.1]], -1)
    return exact + scale * rng.uniform(-1, 1, exact.shape)


def same_motion_of_camera(hand: Array, place: Array) -> Array:
    return pga3.motor_product(pga3.motor_product(pga3.motor_inverse(place), hand), place)


def expect(found: Any, single: Any, problems: list[Any], status: HandEyeStatus) -> None:
    """Check the status of all problems at once and of one alone; the motor is a unit motor of moderate size."""
    np.testing.assert_array_equal(found.status, status)
    assert found.inliers.all()
    np.testing.assert_allclose((found.motor[..., :4] ** 2).sum(-1), 1, rtol=8 * np.finfo(found.motor.dtype).eps)
    for k in range(0, len(problems[0]), 8):
        assert single(*(each[k] for each in problems)).status == status


@pytest.mark.parametrize("n_motions", NUMBERS)
def test_translations_alone_have_small_angles(n_motions: int) -> None:
    rng = np.random.default_rng(n_motions)
    for size in (0.0, 1e-18, 1e-17, 1e-16, 1e-15, 1e-13):
        lengths = 10.0 ** rng.uniform(-6, 6, (N_PROBLEMS, 1, 1))
        place = motors(rng, N_PROBLEMS, 1, length=lengths)
        hand = translations(rng, N_PROBLEMS, n_motions, length=lengths)
        eye = same_motion_of_camera(hand, place)
        sizes = size * rng.uniform(0.1, 1, (N_PROBLEMS, 1, 1))
        both = [rng.choice([-1.0, 1.0], (N_PROBLEMS, n_motions, 1)) * perturbed(rng, e, sizes) for e in (hand, eye)]
        found = hand_eye(*both)
        expect(found, hand_eye, both, HandEyeStatus.SMALL_ANGLES)
        # Translations in different directions determine the rotation, which is found.
        inner = np.abs(np.einsum("pi,pi->p", found.motor[:, :4], place[:, 0, :4]))
        assert np.median(1 - inner) < 1e-9


@pytest.mark.parametrize("n_motions", NUMBERS)
def test_no_motion_at_all_has_small_angles(n_motions: int) -> None:
    rng = np.random.default_rng(n_motions)
    still = np.tile(ORIGIN, (N_PROBLEMS, n_motions, 1))
    for size in (0.0, 1e-18, 1e-17, 1e-16, 1e-15, 1e-13):
        sizes = np.full((N_PROBLEMS, 1, 1), size)
        # The same perturbation of every coefficient, and a different one of each.
        for both in ([still + size] * 2, [perturbed(rng, still, sizes) for _ in range(2)]):
            expect(hand_eye(*both), hand_eye, both, HandEyeStatus.SMALL_ANGLES)


@pytest.mark.parametrize("n_poses", [3, 4, 6, 9])
def test_poses_of_one_rotation_have_small_angles(n_poses: int) -> None:
    rng = np.random.default_rng(n_poses)
    for size in (0.0, 1e-17, 1e-15, 1e-13):
        lengths = 10.0 ** rng.uniform(-6, 6, (N_PROBLEMS, 1, 1))
        x, z, first = motors(rng, 3, N_PROBLEMS, 1, length=lengths)
        hand = pga3.motor_product(first, translations(rng, N_PROBLEMS, n_poses, length=lengths))
        eye = pga3.motor_product(pga3.motor_product(pga3.motor_inverse(z), hand), x)
        sizes = np.full((N_PROBLEMS, 1, 1), size)
        both = [perturbed(rng, each, sizes) for each in (hand, eye)]
        expect(hand_eye_from_poses(*both), hand_eye_from_poses, both, HandEyeStatus.SMALL_ANGLES)
        same = [np.repeat(each[:, :1], n_poses, 1) for each in both]
        expect(hand_eye_from_poses(*same), hand_eye_from_poses, same, HandEyeStatus.SMALL_ANGLES)


@pytest.mark.parametrize("n_motions", NUMBERS)
def test_rotations_about_one_axis_are_parallel(n_motions: int) -> None:
    """All motions rotate, with exact or noisy translations; or one of them rotates and the others translate."""
    rng = np.random.default_rng(n_motions)
    for size in (0.0, 1e-17, 1e-15, 1e-13):
        for noise in (0.0, 1e-3):
            lengths = 10.0 ** rng.uniform(-6, 6, (N_PROBLEMS, 1, 1))
            place = motors(rng, N_PROBLEMS, 1, length=lengths)
            hand = rotations_about_one_axis(rng, N_PROBLEMS, n_motions, length=lengths)
            if noise == 0:
                cases = [hand, translations(rng, N_PROBLEMS, n_motions, length=lengths)]
                cases[1][:, :1] = hand[:, :1]
            else:
                cases = [hand]
            for moved in cases:
                eye = same_motion_of_camera(moved, place)
                shaken = pga3.motor_product(eye, translations(rng, N_PROBLEMS, n_motions, length=noise * lengths))
                both = [perturbed(rng, each, np.full((N_PROBLEMS, 1, 1), size)) for each in (moved, shaken)]
                expect(hand_eye(*both), hand_eye, both, HandEyeStatus.PARALLEL_AXES)


def test_translations_alone_in_single_precision_have_small_angles() -> None:
    rng = np.random.default_rng(1)
    for length in (1e-3, 1.0, 1e3):
        x, z, first = motors(rng, 3, N_PROBLEMS, 1, length=length)
        hand = pga3.motor_product(first, translations(rng, N_PROBLEMS, 6, length=length))
        eye = pga3.motor_product(pga3.motor_product(pga3.motor_inverse(z), hand), x)
        both = [each.astype(np.float32) for each in (hand, eye)]
        expect(hand_eye_from_poses(*both), hand_eye_from_poses, both, HandEyeStatus.SMALL_ANGLES)


def test_rotations_far_above_rounding_are_not_small() -> None:
    rng = np.random.default_rng(2)
    place = motors(rng, 50, 1)
    for angle in (1e-5, 1e-3):
        bivectors = rng.normal(size=(50, 6, 6)) * ([angle] * 3 + [1] * 3)
        hand = pga3.motor_exponential(bivectors)
        found = hand_eye(hand, same_motion_of_camera(hand, place))
        assert (found.status == HandEyeStatus.OK).all()
        # A camera that rotates while the hand does not contradicts the hand.
        other = translations(rng, 50, 6)
        assert (hand_eye(other, motors(rng, 50, 6)).status == HandEyeStatus.INCONSISTENT).all()
