"""Descriptors of hands and key points, their behaviour under rotations, recognition, and bad input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from algorithms.gestures import hand_descriptor, mean_of_sequence, point_features, train_hands, turned_descriptor
from algorithms.gestures.experiments import hand_rates, point_rates, random_split, read_hands, read_points, rotated
from tests.support.all_cases import all_cases

DATA = Path(__file__).parents[1] / "data" / "gestures"
IMAGES, LABELS, NUMBERS = read_hands(DATA / "hands.npz")
POINTS, POSES = read_points(DATA / "key_points.npz")


def test_quarter_turns_shift_the_descriptor() -> None:
    found = hand_descriptor(IMAGES[:3])
    # rot90 turns from x to -y, which are rows upwards.
    turned = hand_descriptor(np.rot90(IMAGES[:3], axes=(1, 2)))
    assert np.allclose(turned, turned_descriptor(found, -9), atol=1e-9)
    assert not np.allclose(turned, found, atol=0.1)


def test_contrast_has_no_influence_and_integers_are_exact() -> None:
    found = hand_descriptor(IMAGES[0])
    assert np.allclose(hand_descriptor(100 - 3 * IMAGES[0]), found, atol=1e-9)
    assert np.array_equal(hand_descriptor(IMAGES[0].astype(np.uint8)), found)


def test_points_are_invariant_under_similarities() -> None:
    c, s = np.cos(2.0), np.sin(2.0)
    moved = 7.0 * POINTS[:50] @ np.array([[c, s], [-s, c]]) + [3.0, -1.0]
    found = point_features(POINTS[:50])
    assert found.shape == (50, 40) and np.allclose(point_features(moved), found, atol=1e-12)
    mirrored = point_features(POINTS[:50] * [-1, 1])
    assert np.allclose(mirrored[:, :20], found[:, :20]) and np.allclose(mirrored[:, 20:], -found[:, 20:])


def test_sequences_are_products_of_probabilities() -> None:
    p = np.array([[0.9, 0.1], [0.4, 0.6], [0.8, 0.2]])
    found = mean_of_sequence(p, 2)
    want = np.sqrt(p[0] * p[1])
    assert np.allclose(found[0], np.sqrt(p[0]) / np.sqrt(p[0]).sum()) and np.allclose(found[1], want / want.sum())
    assert found[2].argmax() == 0 and np.allclose(found.sum(1), 1)


def test_rotated_key_points_of_blocks_left_out() -> None:
    single, windows = point_rates(POINTS[::5], POSES[::5], folds=4)
    assert single > 0.9 and windows > 0.9


def test_permuted_labels_are_not_learned() -> None:
    labels = np.random.default_rng(0).permutation(LABELS)
    model = train_hands(IMAGES[::12], labels[::12], largest=0)
    assert (model.predict(IMAGES[3::12]) == labels[3::12]).mean() < 0.25


@pytest.mark.slow
def test_rotated_hands_after_upright_training() -> None:
    upright, turned = hand_rates(IMAGES, LABELS, *random_split(len(LABELS)))
    assert upright >= 0.887 and turned >= 0.85


def test_rotations_in_training_help() -> None:
    train, test = slice(0, None, 12), slice(2, None, 24)
    turned = rotated(IMAGES[test])
    rates = [
        (train_hands(IMAGES[train], LABELS[train], angle).predict(turned) == LABELS[test]).mean() for angle in (0, 40)
    ]
    assert rates[1] > rates[0] + 0.1


@all_cases(
    "image, message",
    [
        (np.ones((20, 20, 3)), "looks like"),
        (np.ones((3, 20, 20)), "the same everywhere"),
        (np.eye(8), "at least 16 x 16"),
        (np.full((20, 20), np.nan), "finite"),
        (np.ones((0, 20)), "no empty axis"),
    ],
)
def test_bad_images(image: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hand_descriptor(image)


def test_other_bad_arguments() -> None:
    with pytest.raises(ValueError, match="at the wrist"):
        point_features(np.ones((21, 2)))
    with pytest.raises(ValueError, match="21 key points"):
        point_features(np.ones((20, 2)))
    with pytest.raises(ValueError, match="finite"):
        point_features(np.full((21, 2), np.inf))
    with pytest.raises(ValueError, match="not negative"):
        mean_of_sequence([[-1.0, 2.0]])
    with pytest.raises(ValueError, match="window: 0"):
        mean_of_sequence([[1.0, 2.0]], 0)
    with pytest.raises(ValueError, match="degrees from 0"):
        train_hands(IMAGES[:2], LABELS[:2], -1)
    with pytest.raises(ValueError, match=r"expected \(n, M, N\)"):
        train_hands(IMAGES[:2], LABELS[:3])
    with pytest.raises(ValueError, match="expected"):
        turned_descriptor(np.ones((3, 3)), 1)
