"""Functions of images and volumes with numbers of any size, types, memory orders, few pixels, and wrong arguments."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from algorithms import shapes
from algorithms.shapes import ColourStatus
from algorithms.vision import Camera, Distortion, undistort_image
from tests.support.all_cases import all_cases

ROWS, COLUMNS = np.mgrid[:45, :41]
DISC = 1 / (1 + np.exp(np.hypot(ROWS - 22.0, COLUMNS - 19) - 12))
BALL = np.clip(7 - np.sqrt(sum((axis - 8.0) ** 2 for axis in np.mgrid[:17, :15, :16])), 0, 1)
SOLID = np.where(BALL > 0.5, BALL, 0)
NOISY = 10 * BALL + np.random.default_rng(0).normal(size=BALL.shape) / 10
COLOURED = DISC[..., None] * np.array([0.8, 0.2, 0.1]) + (1 - DISC[..., None]) * np.array([0.2, 0.3, 0.5])
LENS = Camera(np.array([[40.0, 0, 20], [0, 40, 22], [0, 0, 1]]), np.eye(8)[0], Distortion("brown", (-0.1,)))
CENTRE = [8, 7, 8]


def largest(image: Any) -> float:
    return float(np.max(np.real(image), initial=0))


SHAPE_ONLY: dict[str, tuple[Callable[[Any], Any], np.ndarray]] = {
    "contour": (shapes.contour, DISC),
    "fit_balls": (lambda a: shapes.fit_balls(a).balls, SOLID),
    "gradient_vector_flow": (shapes.gradient_vector_flow, DISC),
    "gradient_vector_flow of a volume": (shapes.gradient_vector_flow, BALL),
    "march": (lambda a: shapes.march(a, 4).balls, SOLID),
    "marching_cubes": (lambda a: shapes.marching_cubes(a, largest(a) / 2).points, BALL),
    "neural_gas_of_image": (lambda a: shapes.neural_gas_of_image(a, 20).nodes, DISC),
    "segment": (lambda a: shapes.segment(a, CENTRE).mask, NOISY),
    "segment_colour": (
        lambda a: shapes.segment_colour(a, largest(a) * np.array([1, 0.25, 0.125])).coverage,
        COLOURED,
    ),
    "surface": (lambda a: shapes.surface(a, nodes=64).nodes, SOLID),
    "union_of_spheres": (shapes.union_of_spheres, SOLID),
}
"""Functions whose results do not change with the unit of the image, with valid arguments."""

CASES = {**SHAPE_ONLY, "undistort_image": (lambda a: undistort_image(a, LENS), DISC)}


@all_cases("name", CASES)
@pytest.mark.filterwarnings("error")
def test_units_types_and_memory_orders_change_nothing(name: str) -> None:
    """Powers of 2 and orders in memory give the same results, and numbers of other types those of their values."""
    call, image = CASES[name]
    expected = np.asarray(call(image))
    assert expected.size
    for same in (np.asfortranarray(image), image[::-1].copy()[::-1], np.repeat(image, 2, -1)[..., ::2]):
        same.flags.writeable = False
        assert np.array_equal(call(same), expected, equal_nan=True)
    for power in (500, -500, 90, -90, 40, -40):
        found = np.asarray(call(np.ldexp(image, power)))
        back = found if name in SHAPE_ONLY else np.ldexp(found, -power)
        assert np.array_equal(back, expected, equal_nan=True) or np.allclose(back, expected, 0, 1e-6)
    for kind in (np.float32, np.uint8, np.int64):
        other = (image if kind is np.float32 else np.clip(100 * image, 0, None)).astype(kind)
        found, known = np.asarray(call(other)), np.asarray(call(other.astype(float)))
        assert found.shape == known.shape
        assert np.array_equal(found, known, equal_nan=True) or np.nanmax(np.abs(found - known)) < 1e-4 * known.max()


@all_cases("name", SHAPE_ONLY)
@pytest.mark.filterwarnings("error")
def test_wrong_and_few_numbers_are_named(name: str) -> None:
    """Not finite, empty, few or equal pixels, complex numbers and texts: an error that says what is expected."""
    call, image = SHAPE_ONLY[name]
    if name != "segment_colour":  # which has a status for them
        for value in (np.nan, -np.inf):
            wrong = image.copy()
            wrong[tuple(n // 2 for n in image.shape)] = value
            with pytest.raises(ValueError, match="finite"):
                call(wrong)
    last = (3,) if name == "segment_colour" else ()
    space = image.ndim - len(last)
    for size in ((0,) * space, (0, *(5,) * (space - 1)), (1,) * space, (1, *(9,) * (space - 1)), (2,) * space):
        for numbers in (np.zeros((*size, *last)), np.random.default_rng(1).normal(size=(*size, *last))):
            try:
                call(numbers)
            except ValueError as error:
                assert "expected" in str(error)
    for numbers in (np.ones(image.shape, complex), np.ones(5)):
        with pytest.raises((TypeError, ValueError), match="expected"):
            call(numbers)


@pytest.mark.parametrize("power", [400, -400, 100, -100])
def test_results_in_the_unit_of_the_image(power: int) -> None:
    """Intervals of densities, colours, noise, and moved volumes scale with the image."""
    known, found = (shapes.segment(np.ldexp(NOISY, p), CENTRE).interval for p in (0, power))
    assert np.array_equal(np.ldexp(found, -power), known)
    colour = np.array([0.8, 0.2, 0.1])
    one, other = (shapes.segment_colour(np.ldexp(COLOURED, p), np.ldexp(colour, p)) for p in (0, power))
    assert one.status is other.status is ColourStatus.OK
    assert np.array_equal(np.ldexp(other.colour, -power), one.colour) and np.ldexp(other.noise, -power) == one.noise
    balls = shapes.fit_balls(SOLID, 0.9)
    back = shapes.register_spheres(balls.balls, balls.balls)
    warped, moved = (shapes.warp_volume(np.ldexp(BALL, p), back, BALL.shape) for p in (0, power))
    assert np.array_equal(np.ldexp(moved.astype(float), -power), warped)
    assert np.abs(warped - BALL).max() < 1e-5


def test_colours_without_a_median_are_refused() -> None:
    with pytest.raises(ValueError, match="not black"):
        shapes.segment_colour(COLOURED, np.eye(3))
