"""Two samples of one surface contradict each other no more often than stated; those of different surfaces do."""

from typing import Any

import numpy as np

from algorithms.evidence import WRONG
from algorithms.registration import RegistrationStatus, register
from algorithms.registration.clouds import cloud_of
from algorithms.registration.contradictions import contradiction

STILL = np.eye(8)[0]


def wave(rng: np.random.Generator, count: int = 1500, noise: float = 0.02) -> Any:
    place = rng.uniform(-2, 2, (count, 2))
    height = 0.3 * np.sin(place[:, 0]) * np.cos(place[:, 1]) + noise * rng.normal(size=count)
    return np.column_stack([place, height])


def test_samples_of_one_surface_agree_with_other_spacing_and_noise_and_missing_parts() -> None:
    rng = np.random.default_rng(5)
    for _ in range(30):
        one, two = wave(rng, int(rng.integers(500, 2000)), rng.choice([0.005, 0.05])), wave(rng)
        one = one[one @ rng.normal(size=3) < 1.0]
        assert contradiction(STILL, cloud_of(one), cloud_of(two)) >= WRONG


def test_noise_as_thick_as_the_distance_of_neighbours_contradicts_nothing() -> None:
    """Places that look flat among others that do not are chosen by their noise."""
    rng = np.random.default_rng(8)
    for _ in range(60):
        one, two = (cloud_of(wave(rng, int(rng.integers(300, 3000)), 0.1)) for _ in range(2))
        assert contradiction(STILL, one, two) >= WRONG


def test_a_bump_of_three_deviations_of_the_noise_is_found() -> None:
    rng = np.random.default_rng(6)
    for _ in range(10):
        one, two = wave(rng), wave(rng)
        two[np.hypot(*two[:, :2].T) < 0.8, 2] += 0.06
        assert contradiction(STILL, cloud_of(one), cloud_of(two)) < WRONG


def test_the_mirror_image_of_an_object_is_refused() -> None:
    rng = np.random.default_rng(7)
    bumps = np.array([[1, 0, 0], [0, 1, 0], [0.3, 0, 0.95]])

    def fruit() -> Any:
        out = rng.normal(size=(2500, 3))
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        near = np.exp(-8 * ((out[:, None] - bumps) ** 2).sum(2))
        return out * (1 + near @ [0.075, 0.125, 0.2])[:, None] * [1, 0.9, 0.8]

    whole = fruit()
    assert register(fruit(), whole).status == RegistrationStatus.OK
    mirrored = register(fruit() * [1, 1, -1], whole)
    assert mirrored.status in (RegistrationStatus.NO_SUPPORT, RegistrationStatus.UNCERTAIN)
