"""Scenes of cameras on hands for the page of evidence."""

from __future__ import annotations

import numpy as np

from algorithms.vision import HandEyeStatus, hand_eye_from_poses
from generated import pga3

from .evidence_scenes import Trial, is_within, row


def _motions(rng: np.random.Generator, turn: float, length: float, *count: int) -> np.ndarray:
    """Motors with normal rotation vectors and translations."""
    parts = turn * rng.normal(size=(*count, 3)), length * rng.normal(size=(*count, 3))
    return np.asarray(pga3.motor_from_rotation_vector_translation(*parts))


def _recorded(
    rng: np.random.Generator, n: int, slip: float = 0.0, hand: float = 0.0, is_of_target: bool = False, n_wrong: int = 0
) -> Trial:
    """Right if the error is within its bounds; if the camera moves on the hand, that of one of both places."""
    places, world = [_motions(rng, 0.7, 0.08)], _motions(rng, 1.0, 0.8)
    hands = pga3.motor_product(_motions(rng, 1.0, 0.5), _motions(rng, rng.uniform(0.2, 0.8), 0.25, n))
    moved = pga3.motor_product(places[0], _motions(rng, np.radians(slip), 0.005 * slip))
    late = np.arange(n) >= rng.integers(n // 4, 3 * n // 4)
    cameras, worlds = np.tile(places[0], (n, 1)), np.tile(world, (n, 1))
    if is_of_target:
        worlds[late] = pga3.motor_product(world, _motions(rng, np.radians(slip), 0.005 * slip))
    elif slip:
        cameras[late] = moved
        places.append(moved)
    eyes = pga3.motor_product(pga3.motor_product(pga3.motor_inverse(worlds), hands), cameras)
    noise = np.radians(rng.uniform(0.02, 0.2)), rng.uniform(2e-4, 2e-3)
    eyes = pga3.motor_product(eyes, _motions(rng, *noise, n))
    eyes[:n_wrong] = pga3.motor_product(eyes[:n_wrong], _motions(rng, 0.15, 0.05, n_wrong))
    hands = pga3.motor_product(hands, _motions(rng, np.radians(hand), 0.01 * hand, n))
    found = hand_eye_from_poses(hands, eyes)
    if found.status != HandEyeStatus.OK:
        return Trial(False, False)
    return Trial(True, any(is_within(found.motor, place, found.deviation) for place in places))


@row("`hand_eye_from_poses`", "6 to 19 poses with noise of the camera", good=True)
def hand_eyes(rng: np.random.Generator) -> Trial:
    return _recorded(rng, int(rng.integers(6, 20)))


@row("`hand_eye_from_poses`", "the same, with noise of the hand of 0.05 degrees and 0.5 mm in addition", good=True)
def hand_eyes_of_both(rng: np.random.Generator) -> Trial:
    return _recorded(rng, int(rng.integers(6, 20)), hand=0.05)


@row("`hand_eye_from_poses`", "four poses", good=True)
def hand_eyes_of_four(rng: np.random.Generator) -> Trial:
    return _recorded(rng, 4)


@row("`hand_eye_from_poses`", "6 to 19 poses, of which one is off by 9 degrees and 5 cm on average")
def hand_eyes_with_one_wrong(rng: np.random.Generator) -> Trial:
    return _recorded(rng, int(rng.integers(6, 20)), n_wrong=1)


@row("`hand_eye_from_poses`", "the camera slips on the hand by 0.3 to 6 degrees; wrong: neither place")
def hand_eyes_that_slip(rng: np.random.Generator) -> Trial:
    return _recorded(rng, int(rng.integers(6, 20)), slip=float(np.exp(rng.uniform(np.log(0.2), np.log(4)))))


@row("`hand_eye_from_poses`", "the target moves by 0.3 to 6 degrees")
def hand_eyes_of_moved_targets(rng: np.random.Generator) -> Trial:
    slip = float(np.exp(rng.uniform(np.log(0.2), np.log(4))))
    return _recorded(rng, int(rng.integers(6, 20)), slip=slip, is_of_target=True)
