"""Gradient vector flow against an explicit solver, and streamlines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from algorithms.shapes import gradient_vector_flow, streamline_samples
from algorithms.shapes.flow import forces, second_difference
from generated import shapes


@pytest.mark.parametrize("shape", [(16, 20), (10, 12, 11)])
def test_flow_is_the_steady_state_of_an_explicit_solver(shape: tuple[int, ...]) -> None:
    places = np.indices(shape)
    middle = np.array(shape).reshape((-1,) + (1,) * len(shape)) / 2
    image = (((places - middle) ** 2).sum(0) < 16).astype(float)
    force, g = forces(image, 0.3, 1.0, np.ones(len(shape)))
    flow = force.copy()
    for _ in range(1500 if len(shape) == 2 else 400):
        flow += (
            0.9
            / (2 * len(shape) + 1)
            * (g * sum(second_difference(flow, a + 1) for a in range(len(shape))) - (1 - g) * (flow - force))
        )
    found = gradient_vector_flow(image, 0.3, 90)
    assert np.abs(found - flow).max() < 0.02 * np.abs(flow).max()


@pytest.mark.parametrize("shape", [(60, 150), (140, 120)])
def test_the_default_number_of_sweeps_converges(shape: tuple[int, int]) -> None:
    """The steady state is the solution of linear equations, which scipy solves directly."""
    rows, columns = (np.indices(shape).T - np.array(shape) / 2).T
    image = np.hypot(rows, columns) < 0.3 * min(shape) * (1 + 0.35 * np.cos(5 * np.arctan2(rows, columns)))
    force, g = forces(image.astype(float), 0.05, 1.0, np.ones(2))
    second = [
        sparse.diags([np.ones(n - 1), np.r_[-1, np.full(n - 2, -2), -1], np.ones(n - 1)], [-1, 0, 1]) for n in shape
    ]
    laplacian = sparse.kron(second[0], sparse.eye(shape[1])) + sparse.kron(sparse.eye(shape[0]), second[1])
    solved = sparse.linalg.splu((sparse.diags(g.ravel()) @ laplacian - sparse.diags(1 - g.ravel())).tocsc())
    flow = np.stack([solved.solve(-((1 - g) * part).ravel()).reshape(shape) for part in force])
    assert np.linalg.norm(gradient_vector_flow(image) - flow) < 0.02 * np.linalg.norm(flow)


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


def test_images_without_a_gradient_are_named() -> None:
    for shape in ((1, 1), (5, 1), (1, 4, 4)):
        with pytest.raises(ValueError, match=r"image: shape .*; expected at least 2 elements along each axis"):
            gradient_vector_flow(np.zeros(shape))
