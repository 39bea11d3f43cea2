"""Gradient vector flow against an explicit solver, and streamlines."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.shapes import gradient_vector_flow, streamline_samples
from algorithms.shapes.flow import forces, second_difference
from generated import shapes


@pytest.mark.parametrize("shape", [(24, 30), (12, 14, 13)])
def test_flow_is_the_steady_state_of_an_explicit_solver(shape: tuple[int, ...]) -> None:
    places = np.indices(shape)
    middle = np.array(shape).reshape((-1,) + (1,) * len(shape)) / 2
    image = (((places - middle) ** 2).sum(0) < 16).astype(float)
    force, g = forces(image, 0.3, 1.0, np.ones(len(shape)))
    flow = force.copy()
    for _ in range(3000 if len(shape) == 2 else 500):
        flow += (
            0.9
            / (2 * len(shape) + 1)
            * (g * sum(second_difference(flow, a + 1) for a in range(len(shape))) - (1 - g) * (flow - force))
        )
    found = gradient_vector_flow(image, 0.3, 90)
    assert np.abs(found - flow).max() < 0.02 * np.abs(flow).max()


def test_tridiagonal_systems() -> None:
    rng = np.random.default_rng(0)
    lower, upper, right = rng.normal(size=(3, 5, 9))
    middle = 3 + np.abs(lower) + np.abs(upper)
    found = shapes.solve_tridiagonal(lower, middle, upper, right)
    for k in range(5):
        matrix = np.diag(middle[k]) + np.diag(lower[k, 1:], -1) + np.diag(upper[k, :-1], 1)
        assert np.allclose(matrix @ found[k], right[k])


def test_streamlines_end_on_the_circle() -> None:
    rows, columns = np.indices((64, 64))
    flow = gradient_vector_flow(np.hypot(rows - 32, columns - 32) < 15)
    starts = np.stack(np.meshgrid(np.arange(8, 57, 4.0), np.arange(8, 57, 4.0)), -1).reshape(-1, 2)
    starts = starts[np.hypot(*(starts - 32).T) > 5]
    samples, turned = streamline_samples(flow, starts, 120)
    assert turned.mean() > 0.9
    assert np.abs(np.hypot(*(samples[turned] - 32).T) - 14.6).max() < 1.2
