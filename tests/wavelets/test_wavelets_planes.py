"""Transforms in either memory order, with threads and progress, in blocks and in one piece."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from algorithms.wavelets import clifford_fft, iclifford_fft, iqft, ispacetime_fft, qft, rqft, spacetime_fft

TRANSFORMS = [
    (qft, iqft, (30, 21, 4)),
    (qft, iqft, (3, 256, 300, 4)),
    (clifford_fft, iclifford_fft, (2, 20, 33, 4)),
    (clifford_fft, iclifford_fft, (5, 70, 64, 8)),
    (clifford_fft, iclifford_fft, (2, 6, 5, 4, 8)),
    (spacetime_fft, ispacetime_fft, (3, 4, 5, 6, 16)),
]
Transform = Callable[..., np.ndarray]


def coefficients_first(field: np.ndarray) -> np.ndarray:
    return np.moveaxis(np.moveaxis(field, -1, 0).copy(), 0, -1)


@pytest.mark.parametrize(("forth", "back", "shape"), TRANSFORMS)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_memory_orders_and_threads(
    forth: Transform, back: Transform, shape: tuple[int, ...], dtype: type[np.floating]
) -> None:
    field = np.random.default_rng(0).normal(size=shape).astype(dtype)
    expected = forth(field)
    tolerance = 20 * np.finfo(dtype).eps * np.abs(expected).max()
    first = coefficients_first(field)
    for given in (first, np.asfortranarray(field), np.repeat(field, 2, -2)[..., ::2, :], field[::-1][::-1]):
        found = forth(given, workers=2)
        assert found.dtype == dtype and np.abs(found - expected).max() <= tolerance
    assert forth(first).strides == first.strides
    assert expected.flags.c_contiguous
    assert np.abs(back(expected, workers=-1) - field).max() <= 20 * np.finfo(dtype).eps * np.abs(field).max()


def test_complex_transforms_are_contained() -> None:
    """The plane 1, e123 of a volume has a separate complex transform; sizes require several blocks."""
    rng = np.random.default_rng(1)
    field = np.zeros((9, 128, 130, 8))
    z = rng.normal(size=field.shape[:-1]) + 1j * rng.normal(size=field.shape[:-1])
    field[..., 0], field[..., 7] = z.real, z.imag
    found = clifford_fft(field)
    expected = np.fft.fftn(z)
    assert np.abs(found[..., 0] + 1j * found[..., 7] - expected).max() < 1e-12 * np.abs(expected).max()
    assert np.abs(found[..., 1:7]).max() == 0


def test_threads_do_not_change_real_images() -> None:
    image = np.random.default_rng(2).normal(size=(2, 300, 257))
    assert np.array_equal(qft(image, workers=2), qft(image))
    assert np.array_equal(rqft(image, workers=2), rqft(image))


@pytest.mark.parametrize("workers", [None, 2])
def test_progress_reaches_the_total(workers: int | None) -> None:
    field = np.random.default_rng(3).normal(size=(6, 7, 8, 8))
    steps: list[tuple[int, int]] = []
    found = clifford_fft(field, workers=workers, progress=lambda done, total: steps.append((done, total)))
    assert np.abs(found - clifford_fft(field)).max() < 1e-12
    assert [done for done, _ in steps] == list(range(1, len(steps) + 1))
    assert {total for _, total in steps} == {len(steps)}
    steps.clear()
    spacetime_fft(np.ones((2, 3, 2, 3, 16)), progress=lambda done, total: steps.append((done, total)))
    assert steps == [(done, 1 + 8 + 1) for done in range(1, 11)]


@pytest.mark.parametrize("workers", [0, -1000])
def test_impossible_numbers_of_threads_are_rejected(workers: int) -> None:
    with pytest.raises(ValueError, match=f"workers: {workers}; expected 1 or more"):
        qft(np.ones((4, 4, 4)), workers=workers)
