"""Convolution and correlation of scalar fields against scipy.signal and scipy.ndimage on the same arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.ndimage
import scipy.signal

from algorithms.wavelets import convolve, correlate
from tests.support.all_cases import all_cases

BOUNDARIES = ("reflect", "constant", "nearest", "mirror", "wrap")
SIZES = [
    ((17,), (4,)),
    ((17,), (5,)),
    ((5,), (13,)),
    ((1,), (3,)),
    ((12, 9), (3, 3)),
    ((12, 9), (4, 6)),
    ((3, 4), (9, 8)),
    ((7, 1), (2, 3)),
    ((5, 6, 7), (2, 3, 4)),
]


def normal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def close(found: np.ndarray, expected: np.ndarray, field: np.ndarray, mask: np.ndarray) -> None:
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() < 1e-14 * np.abs(field).max() * np.abs(mask).sum()


@all_cases("method", ["auto", "direct", "fft"])
@all_cases("size, small", SIZES)
def test_scipy(size: tuple[int, ...], small: tuple[int, ...], method: str) -> None:
    field, mask = normal(*size), normal(*small, seed=1)
    for own, signal, image in (
        (convolve, scipy.signal.convolve, scipy.ndimage.convolve),
        (correlate, scipy.signal.correlate, scipy.ndimage.correlate),
    ):
        for mode in ("full", "same", "valid"):
            if mode == "valid" and any(n > m for m, n in zip(size, small, strict=True)):
                continue
            close(own(field, mask, mode, method=method), signal(field, mask, mode, "direct"), field, mask)
        for mode in BOUNDARIES:
            found = own(field, mask, mode, 0.7, method)
            close(found, image(field, mask, mode=mode, cval=0.7), field, mask)


def test_a_small_example() -> None:
    field, mask = [1, 2, 3, 4], [1, 10, 100]
    assert convolve(field, mask).tolist() == [1, 12, 123, 234, 340, 400]
    assert correlate(field, mask).tolist() == [100, 210, 321, 432, 43, 4]
    assert convolve(field, mask, "reflect").tolist() == [112, 123, 234, 344]
    assert convolve(field, mask, "mirror").tolist() == [212, 123, 234, 343]
    assert convolve(field, mask, "wrap").tolist() == [412, 123, 234, 341]
    assert convolve(field, mask, "nearest").tolist() == [112, 123, 234, 344]
    assert convolve(field, mask, "constant", 5).tolist() == [512, 123, 234, 345]


def test_a_correlation_is_the_convolution_with_the_reversed_mask() -> None:
    field, mask = normal(12, 9), normal(3, 5)
    for mode in ("full", "same", "valid", *BOUNDARIES):
        close(correlate(field, mask, mode), convolve(field, mask[::-1, ::-1], mode), field, mask)


def test_stacks_types_and_sizes_of_numbers() -> None:
    stack, mask = normal(2, 3, 12, 9), normal(4, 3)
    for mode in ("full", "wrap"):
        found = convolve(stack, mask, mode)
        for k in np.ndindex(2, 3):
            close(found[k], convolve(stack[k], mask, mode), stack, mask)
        assert np.array_equal(found, convolve(stack, mask, mode, workers=2))
    single = convolve(stack.astype(np.float32), mask.astype(np.float32), "reflect")
    assert single.dtype == np.float32 and np.abs(single - convolve(stack, mask, "reflect")).max() < 1e-5
    frozen = stack.copy()
    frozen.flags.writeable = False
    assert np.array_equal(convolve(frozen, mask), convolve(stack, mask))
    for power in (990, -990):
        for method in ("direct", "fft"):
            large = convolve(np.ldexp(stack, power), np.ldexp(mask, -power), "same", method=method)
            close(large, convolve(stack, mask, "same"), stack, mask)
    with pytest.raises(ValueError, match="so large that results overflow"):
        convolve(np.ldexp(stack, 900), np.ldexp(mask, 900))


@all_cases(
    "call, message",
    [
        (lambda f: convolve(f, f[:3, :3], "edge"), "mode: 'edge'; expected 'full', 'same', 'valid', 'reflect'"),
        (lambda f: convolve(f, f[:3, :3], method="fast"), "method: 'fast'"),
        (lambda f: convolve(f, f[:3, :3], "constant", np.nan), "fill: nan; expected a finite number"),
        (lambda f: convolve(f[0], f), r"field: shape \(8,\); expected \(..., any, any\), as many axes as the mask, 2"),
        (lambda f: correlate(f[:3, :3], f, "valid"), "mask: .* larger than the field"),
        (lambda f: convolve(f, f[:0]), "expected no empty axis"),
        (lambda f: convolve(f, 2.0), "mask: shape"),
        (lambda f: convolve(f * np.nan, f[:3, :3]), "field: a number is not finite"),
        (lambda f: convolve(f, f[:3, :3] * np.inf, "wrap"), "mask: a number is not finite"),
        (lambda f: convolve(np.ma.array(f, mask=f > 0), f[:3, :3]), "field: .* masked numbers"),
        (lambda f: convolve(np.stack([f, f, f], -1), f[:3, :3]), "field: .* looks like RGB"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(normal(7, 8))
