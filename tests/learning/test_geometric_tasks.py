"""Networks of products learn mappings that are products better than real networks of the same size."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.learning.geometric_tasks import attitude, beside_real
from tests.support.selection import some_slow


@pytest.mark.parametrize(
    ("name", "seeds"), some_slow([("similarity", 10), ("quaternions", 1), ("quaternions", 5)], ("quaternions", 5))
)
def test_error_is_at_most_half_of_that_of_a_real_network(name: str, seeds: int) -> None:
    found = [beside_real(name, seed) for seed in range(seeds)]
    assert all(own[1] <= real[1] <= 1.15 * own[1] for own, real in found)
    errors, real_errors = (np.median([row[k][0] for row in found]) for k in (0, 1))
    assert errors <= 0.5 * real_errors


def test_attitudes_are_unit_quaternions() -> None:
    task = attitude(0, 20)
    assert np.allclose(np.linalg.norm(task.train[0].reshape(-1, 4), axis=1), 1, atol=1e-6)
    assert np.array_equal(task.train[0][1:, :4], task.train[0][:-1, 4:])
