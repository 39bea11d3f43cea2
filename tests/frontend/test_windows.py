"""Windows in kernels against scipy.ndimage, finite differences and sums over slices of numpy arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.ndimage

import gacompiler
from gacompiler import SCALAR, array, each, exp, kernel, scan, total, transpose, vjp, window
from gacompiler.algebra.catalog import PGA3
from gacompiler.backends.c import c_body
from gacompiler.errors import KernelError
from gacompiler.passes.loops import compile_loops
from tests.support.all_cases import all_cases

IMAGE = array(SCALAR, "n", "m")
MODES = ("reflect", "mirror", "nearest", "wrap", "constant")
WEIGHTS = np.array([[2, 0, 0, 0, -3], [0, 1, 0, 0, 0], [0, 0, 5, 4, 0], [7, 0, 0, 0, 6]])
"""Few are not zero, so that kernels are small."""
SIZES = ((6, 9), (1, 1), (2, 40), (40, 1), (3, 2))
Array = np.ndarray[Any, Any]


def weighted(rows: Any) -> Any:
    """The sum of a window of numbers with integer weights."""
    pairs = [pair for own, row in zip(WEIGHTS, rows, strict=True) for pair in zip(own, row, strict=True)]
    return sum(int(w) * v for w, v in pairs if w)


@kernel(image=IMAGE)
def correlated(image):
    """Correlations with all boundary modes."""
    return tuple(
        each(lambda row: each(weighted, row), window(image, 4, 5, boundary=mode, value=3 * (mode == "constant")))
        for mode in MODES
    )


@kernel(image=IMAGE, rows=array(SCALAR, "h"), columns=array(SCALAR, "w"))
def sampled(image, rows, columns):
    """Correlations at every second row and every third column."""
    both = [window(image, 4, 5, mode, 7, stride=(2, 3), onto=(rows, columns)) for mode in ("mirror", "constant")]
    return tuple(each(lambda row: each(weighted, row), one) for one in both)


@kernel(image=IMAGE)
def smoothed(image):
    """A bilateral filter, the columns of which are then accumulated from row to row."""

    def pixel(w):
        weights = [[exp(-(v - w[1][1]) * (v - w[1][1])) for v in row] for row in w]
        pairs = [(k, v) for own, row in zip(weights, w, strict=True) for k, v in zip(own, row, strict=True)]
        return sum(k * v for k, v in pairs) / sum(k for k, _ in pairs)

    found = each(lambda row: each(pixel, row), window(image, 3, 3))
    return each(lambda row: scan(lambda s, w: s / 2 + w[0] - w[2], 0, window(row, 3, boundary="nearest")), found)


def image(shape: tuple[int, ...], seed: int = 1) -> Array:
    return np.random.default_rng(seed).integers(-99, 100, shape).astype(float)


def correlation(x: Array, mode: str, outside: float) -> Array:
    return np.asarray(scipy.ndimage.correlate(x, WEIGHTS, mode=mode, cval=outside))


@pytest.mark.parametrize("backend", ["c", pytest.param("numba", marks=pytest.mark.slow), "arrays"])
def test_windows_equal_scipy(backend: str) -> None:
    run, some = (gacompiler.compile(each, backend=backend, effort=0) for each in (correlated, sampled))
    for shape in SIZES:
        x = image(shape)
        for mode, found in zip(MODES, run(x), strict=True):
            assert np.array_equal(found, correlation(x, mode, 3)), (shape, mode)
        rows, columns = np.zeros(-(-shape[0] // 2)), np.zeros(-(-shape[1] // 3))
        for mode, found in zip(("mirror", "constant"), some(x, rows, columns), strict=True):
            assert np.array_equal(found, correlation(x, mode, 7)[::2, ::3]), (shape, mode)
        assert run(x.astype(np.float32))[0].dtype == np.float32


@pytest.mark.parametrize("backend", ["c", pytest.param("numba", marks=pytest.mark.slow), "arrays"])
def test_empty_images_have_empty_results_or_the_value_outside(backend: str) -> None:
    run, some = (gacompiler.compile(each, backend=backend, effort=0) for each in (correlated, sampled))
    for shape in ((0, 5), (5, 0), (0, 0)):
        assert all(found.shape == shape for found in run(np.zeros(shape)))
        for found in some(np.zeros(shape), np.zeros(3), np.zeros(2)):
            assert np.array_equal(found, np.full((3, 2), 7.0 * WEIGHTS.sum())), shape


def test_more_rows_than_the_image_has_are_beyond_its_end() -> None:
    x = image((3, 4))
    mirrored, constant = gacompiler.compile(sampled, effort=0)(x, np.zeros(4), np.zeros(3))
    for found, padded in ((mirrored, np.pad(x, 12, mode="reflect")), (constant, np.pad(x, 12, constant_values=7))):
        assert np.array_equal(found, correlation(padded, "mirror", 0)[12:20:2, 12:21:3])


@pytest.mark.slow
def test_batches_and_other_layouts_of_images_give_the_same_results() -> None:
    run, batch = gacompiler.compile(smoothed), np.random.default_rng(2).normal(size=(21, 5, 6))
    found = run(batch)
    for k in range(len(batch)):
        np.testing.assert_allclose(found[k], run(batch[k]), rtol=1e-13, atol=1e-15)
    assert np.array_equal(run(np.asfortranarray(batch[0])), run(batch[0]))
    assert np.array_equal(run(np.repeat(batch[0], 2, axis=1)[:, ::2]), run(batch[0]))
    assert np.array_equal(run(batch[0].tolist()), run(batch[0]))
    x = batch[0].copy()
    assert np.array_equal(run(x, out=x), run(batch[0]))  # The result replaces the image.


def test_a_pixel_that_is_nan_changes_only_its_neighbours() -> None:
    x = image((9, 11))
    x[4, 5] = np.nan
    wanted = scipy.ndimage.correlate(np.isnan(x).astype(int), (WEIGHTS != 0).astype(int)) > 0
    assert np.array_equal(np.isnan(gacompiler.compile(correlated, effort=0)(x)[0]), wanted)


def test_windows_of_multivectors_rows_and_transposes() -> None:
    @kernel(points=array(PGA3.DIRECTION, "n", "m"))
    def seconds(points):
        """Second differences along both axes."""
        along = each(lambda row: each(lambda a, b, c: a - 2 * b + c, *row), window(points, 3, boundary="wrap"))
        across = each(lambda row: each(lambda a, b, c: a - 2 * b + c, *window(row, 3, boundary="wrap")), points)
        return along, across, each(lambda row: row[1], window(transpose(points), (-1, 1), boundary="nearest"))

    x = image((5, 4, 3))
    along, across, turned = gacompiler.compile(seconds, effort=0)(x)
    assert np.array_equal(along, np.roll(x, 1, 0) - 2 * x + np.roll(x, -1, 0))
    assert np.array_equal(across, np.roll(x, 1, 1) - 2 * x + np.roll(x, -1, 1))
    assert np.array_equal(turned, x.swapaxes(0, 1)[[1, 2, 3, 3]])


def test_windows_of_windows() -> None:
    @kernel(x=array(SCALAR, "n"))
    def far(x):
        """Neighbours of neighbours, of which each has its own value outside."""
        (near,) = window(x, (1,), boundary="constant", value=5)
        (further,) = window(near, (2,), boundary="constant", value=9)
        return each(lambda a, b: 100 * a + b, near, further)

    x = np.arange(5.0)
    assert np.array_equal(gacompiler.compile(far, effort=0)(x), 100 * np.r_[x[1:], 5] + np.r_[x[3:], 5, 9, 9])


@kernel(image=IMAGE, weights=IMAGE)
def energy(image, weights):
    """A sum over three windows, one of which has another number of rows."""

    def row(first, second, third, w):
        def pixel(a, b, c, w):
            return w * a[0][0] * b[1][2] * a[2][2] + b[2][0] * c[0][1] * c[1][1]

        return total(pixel, first, second, third, w)

    mirrored, constant = window(image, 3, (-2, 0, 1)), window(image, 3, 3, boundary="constant", value=2)
    strided = window(image, 2, 2, boundary="wrap", stride=2, onto=weights)
    return total(row, mirrored, constant, strided, weights)


@pytest.mark.parametrize("shape", [(4, 5), (1, 1), (2, 1)])
def test_the_gradient_equals_finite_differences(shape: tuple[int, ...]) -> None:
    run, gradient = (gacompiler.compile(one, effort=0) for one in (energy, vjp(energy, "image")))
    random, step = np.random.default_rng(3), 1e-5
    x, w = random.normal(size=shape), random.normal(size=shape)
    _, found = gradient(x, w, 1.0)
    for place in np.ndindex(shape):
        moved = np.zeros(shape)
        moved[place] = step
        difference = (run(x + moved, w) - run(x - moved, w)) / (2 * step)
        assert abs(found[place] - difference) < 1e-8 * (1 + abs(difference))


def test_exponentials_of_differences_that_vanish_in_one_pixel_are_proved() -> None:
    @kernel(x=array(SCALAR, "n"), width=SCALAR)
    def averaged(x, width):
        """An average with weights that are exact where all neighbours are the same pixel."""

        def pixel(*w):
            weights = [exp(-((v - w[1]) ** 2) - k * k / width**2) for k, v in zip((-1, 0, 1), w, strict=True)]
            return sum(a * b for a, b in zip(weights, w, strict=True)) / sum(weights)

        return each(pixel, *window(x, 3))

    compile_loops(averaged)


def test_loops_that_carry_values_are_not_split() -> None:
    """The borders of a split loop are computed before its interior."""
    text = c_body("m", [], [compile_loops(smoothed, effort=0).procedure])
    plain = text[text.index("void NAME(smoothed_within)") :]
    assert plain.count("GAC_WINDOWS(") == 1
    assert "GAC_WINDOWS" not in c_body("m", [], [compile_loops(_sum_of_squares, effort=0).procedure])


@kernel(x=array(SCALAR, "n"))
def _sum_of_squares(x):
    """A kernel without windows."""
    return total(lambda v: v * v, x)


@all_cases(
    "made, message",
    [
        (lambda x: window(x, 3, 3, boundary="edge"), "boundary='edge'"),
        (lambda x: window(x, 3, 3, stride=2), "without lengths of the result"),
        (lambda x: window(x, 3, 3, stride=0, onto=x), "stride=0"),
        (lambda x: window(x, 0), "rows=0"),
        (lambda x: window(x, 3, 1.5), "columns=1.5"),
        (lambda x: window(each(lambda row: total(lambda v: v, row), x), 3, 3), "an array over 1 lengths"),
        (lambda x: window(x, 3, boundary="constant", value=total(lambda r: total(lambda v: v, r), x)), "value="),
        (lambda x: window(x, 3, 3, onto=(x, x, x)), "3 arrays as onto"),
        (lambda x: window(3, 3), "int"),
    ],
)
def test_errors_name_the_argument(made: Callable[[Any], Any], message: str) -> None:
    @kernel(x=IMAGE)
    def wrong(x):
        """A window that does not exist."""
        made(x)
        return 1

    with pytest.raises(KernelError, match="window") as error:
        compile_loops(wrong)
    assert message in str(error.value)
