"""Fourier transforms in any dimension, in three definitions, against direct sums over tables of blades."""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from test_wavelets import quaternions
from test_wavelets_fields import OPPOSITE_TIME, SPACETIME, direct, exponential, field, made, table, times

from algorithms.wavelets import (
    clifford_fft,
    geometric_fft,
    igeometric_fft,
    iproduct_fft,
    ipseudoscalar_fft,
    ivolume_time_fft,
    product_fft,
    pseudoscalar_fft,
    qft,
    real_product_fft,
    spacetime_fft,
    volume_time_fft,
)
from generated import pga3, quaternion, vga2, vga3
from tests.support.all_cases import all_cases


@lru_cache
def spacetime_product() -> Any:
    """A kernel for G(3,1), whose coefficients have the order of those of `spacetime_fft`."""
    return made(3, 1, 0)


def blades(n: int) -> tuple[str, ...]:
    """Blades by grade, then by the last vector, then by the previous one."""
    names = ["".join(each) for grade in range(n + 1) for each in combinations("123456"[:n], grade)]
    return tuple(sorted(names, key=lambda name: (len(name), name[::-1])))


def negative(n: int) -> dict[str, int]:
    return dict.fromkeys("123456"[:n], -1)


def in_sequence(f: np.ndarray, n: int, sign: float = -1) -> np.ndarray:
    """The direct sum of ``f exp(-e1 p1) ... exp(-en pn)``."""
    by, shape, names = table(blades(n), negative(n)), f.shape[:-1], blades(n)
    places = np.indices(shape)
    result = np.empty_like(f)
    for w in np.ndindex(shape):
        terms = f
        for k in range(n):
            turn = exponential(names, str(k + 1), sign * 2 * np.pi * w[k] * places[k] / shape[k])
            terms = times(terms, turn, by)
        result[w] = terms.reshape(-1, len(names)).sum(0)
    return result


@all_cases("size", [(6, 5), (3, 4, 5), (1, 3), (2, 1, 3)])
@all_cases("side", ["left", "right"])
def test_pseudoscalar(size: tuple[int, ...], side: str) -> None:
    n = len(size)
    f, names = field(*size, 2**n), blades(n)
    root = (names[-1], tuple(range(n)))
    truth = direct(f, names, {}, root if side == "left" else None, root if side == "right" else None)
    found = pseudoscalar_fft(f, side)
    assert np.abs(found - truth).max() < 1e-12
    assert np.abs(found - clifford_fft(f, side)).max() < 1e-12
    assert np.abs(ipseudoscalar_fft(found, side) - f).max() < 1e-14
    for norm in ("ortho", "forward"):
        assert np.abs(ipseudoscalar_fft(pseudoscalar_fft(f, side, norm), side, norm) - f).max() < 1e-14


def test_pseudoscalar_in_six_dimensions() -> None:
    """A few frequencies by direct sums; inverse, energy, and both sides, which differ only for odd elements."""
    size, names = (2, 3, 2, 1, 2, 3), blades(6)
    f = field(*size, 64)
    by = table(names, {})
    for side in ("right", "left"):
        found = pseudoscalar_fft(f, side)
        places = np.indices(size)
        for w in ((1, 2, 0, 0, 1, 1), (0, 0, 1, 0, 1, 2)):
            turn = exponential(names, "123456", -2 * np.pi * sum(w[k] * places[k] / size[k] for k in range(6)))
            terms = times(f, turn, by) if side == "right" else times(turn, f, by)
            assert np.abs(found[w] - terms.reshape(-1, 64).sum(0)).max() < 1e-12
        assert np.abs(ipseudoscalar_fft(found, side) - f).max() < 1e-14
        assert np.linalg.norm(pseudoscalar_fft(f, side, "ortho")) == pytest.approx(np.linalg.norm(f), rel=1e-14)
    odd = np.array([len(name) % 2 for name in names])
    assert np.abs((pseudoscalar_fft(f) - pseudoscalar_fft(f, "left")) * (1 - odd)).max() < 1e-14
    assert np.abs((pseudoscalar_fft(f) - pseudoscalar_fft(f, "left")) * odd).max() > 1


@pytest.mark.parametrize("size", [(9,), (6, 5), (3, 4, 5), (2, 3, 2, 3), (1, 4)])
def test_one_vector_per_axis(size: tuple[int, ...]) -> None:
    n = len(size)
    f = field(*size, 2**n)
    truth, found = in_sequence(f, n), product_fft(f)
    assert np.abs(found - truth).max() < 1e-12
    assert np.abs(iproduct_fft(found) - f).max() < 1e-14
    assert np.linalg.norm(product_fft(f, "ortho")) == pytest.approx(np.linalg.norm(f), rel=1e-14)
    assert np.abs(iproduct_fft(product_fft(f, "forward"), "forward") - f).max() < 1e-14
    real = field(*size, seed=3)
    embedded = np.concatenate([real[..., None], np.zeros((*size, 2**n - 1))], -1)
    assert np.abs(real_product_fft(real) - in_sequence(embedded, n)).max() < 1e-12
    assert np.abs(iproduct_fft(real_product_fft(real, norm="ortho"), "ortho") - embedded).max() < 1e-14


def test_small_dimensions_are_known_transforms() -> None:
    """In 1D it is the complex transform, in 2D the quaternionic one with both exponentials from the right."""
    signal = field(10, 2)
    truth = np.fft.fft(signal[:, 0] + 1j * signal[:, 1])
    assert np.abs(product_fft(signal) - np.stack([truth.real, truth.imag], -1)).max() < 1e-14
    image = field(6, 7)
    assert np.abs(real_product_fft(image) - qft(image)).max() < 1e-13
    stack = field(2, 6, 7)
    assert np.abs(real_product_fft(stack, 2)[1] - qft(stack[1])).max() < 1e-13
    six = field(2, 2, 2, 2, 3, 2)
    embedded = np.concatenate([six[..., None], np.zeros((*six.shape, 63))], -1)
    assert np.abs(real_product_fft(six) - product_fft(embedded)).max() < 1e-13


@pytest.mark.slow
def test_any_roots() -> None:
    """Two factors on either side in space-time, one of them not a blade."""
    by = table(SPACETIME, OPPOSITE_TIME)
    f = field(3, 4, 2, 3, 16)
    # A bivector rotated by a rotor.
    mixed = times(
        times(exponential(SPACETIME, "12", np.array(0.7)), np.eye(16)[SPACETIME.index("23")], by),
        exponential(SPACETIME, "12", np.array(-0.7)),
        by,
    )
    assert (np.abs(mixed) > 0.1).sum() == 2
    e4, e12 = np.eye(16)[SPACETIME.index("4")], np.eye(16)[SPACETIME.index("12")]
    left, right = [(e4, (0,)), (mixed, (1,))], [(e12, (3,)), (mixed, (2,))]
    places = np.indices(f.shape[:-1])
    found = geometric_fft(f, spacetime_product(), left, right)

    def turn(root: np.ndarray, angle: np.ndarray) -> np.ndarray:
        return np.cos(angle)[..., None] * np.eye(16)[0] + np.sin(angle)[..., None] * root

    for w in ((1, 2, 1, 2), (2, 3, 0, 1), (0, 1, 1, 0)):
        phases = [-2 * np.pi * w[k] * places[k] / f.shape[k] for k in range(4)]
        terms = times(turn(e4, phases[0]), times(turn(mixed, phases[1]), f, by), by)
        terms = times(times(terms, turn(e12, phases[3]), by), turn(mixed, phases[2]), by)
        assert np.abs(found[w] - terms.reshape(-1, 16).sum(0)).max() < 1e-12
    for norm in (None, "ortho", "forward"):
        there = geometric_fft(f, spacetime_product(), left, right, norm)
        assert np.abs(igeometric_fft(there, spacetime_product(), left, right, norm) - f).max() < 1e-13


def test_other_transforms_are_special_cases() -> None:
    q = quaternions(6, 5)
    oblique = np.array([0, 0.6, 0.0, 0.8])
    found = geometric_fft(q, quaternion.product, [(np.eye(4)[1], (0,))], [(oblique, (1,))])
    assert np.abs(found - qft(q, axes=("i", (0.6, 0.0, 0.8)))).max() < 1e-12
    plane, space, time = field(6, 5, 4), field(3, 4, 5, 8), field(2, 3, 2, 2, 16)
    for side in ("left", "right"):
        found = geometric_fft(plane, vga2.geometric_product, **{side: [(np.eye(4)[3], (0, 1))]})
        assert np.abs(found - clifford_fft(plane, side)).max() < 1e-12
    found = geometric_fft(space, vga3.geometric_product, right=[(np.eye(8)[7], (-3, -2, -1))])
    assert np.abs(found - clifford_fft(space)).max() < 1e-12
    e4, e123 = (np.eye(16)[SPACETIME.index(name)] for name in ("4", "123"))
    found = geometric_fft(time, spacetime_product(), [(e4, (0,))], [(e123, (1, 2, 3))])
    assert np.abs(found - spacetime_fft(time)).max() < 1e-12
    for along, left, right in (("time", [(e4, (0,))], []), ("space", [], [(e123, (1, 2, 3))])):
        found = geometric_fft(time, spacetime_product(), left, right)
        assert np.abs(found - spacetime_fft(time, along=along)).max() < 1e-12
    # Axes without a root are not transformed, also in a degenerate algebra.
    euclidean = field(4, 5, 16)
    e12 = np.eye(16)[pga3.geometric_product.layouts["a"].blades.index("e12")]
    found = geometric_fft(euclidean, pga3.geometric_product, right=[(e12, (1,))])
    assert np.abs(found[2] - geometric_fft(euclidean[2], pga3.geometric_product, right=[(e12, (0,))])).max() < 1e-13


def test_factors_without_axes_are_not_steps() -> None:
    f, root, reported = field(3, 4, 4), np.eye(4)[3], list[tuple[int, int]]()
    left, right = [(root, ()), (root, (0,))], [(root, ())]
    found = geometric_fft(f, vga2.geometric_product, left, right, progress=lambda *step: reported.append(step))
    assert np.array_equal(found, geometric_fft(f, vga2.geometric_product, left[1:]))
    assert reported == [(1, 1)]


@pytest.mark.parametrize("size", [(3, 2, 4, 3), (4, 1, 3, 2)])
def test_volume_time_is_a_part_of_space_time(size: tuple[int, ...]) -> None:
    f = field(*size, 4)
    wide = np.zeros((*size, 16))
    places = [SPACETIME.index(name) for name in ("", "4", "123", "1234")]
    wide[..., places] = f
    expected = spacetime_fft(wide)
    found = volume_time_fft(f)
    assert np.abs(found - expected[..., places]).max() < 1e-12
    expected[..., places] = 0
    assert np.abs(expected).max() == 0
    for norm in (None, "ortho", "forward"):
        assert np.abs(ivolume_time_fft(volume_time_fft(f, norm), norm) - f).max() < 1e-14
    for along in ("time", "space"):
        assert np.abs(volume_time_fft(f, along=along) - spacetime_fft(wide, along=along)[..., places]).max() < 1e-12
    assert np.abs(volume_time_fft(volume_time_fft(f, along="space"), along="time") - found).max() < 1e-12
    single = volume_time_fft(f.astype(np.float32))
    assert single.dtype == np.float32 and np.abs(single - found).max() < 1e-4


def test_batches_and_types() -> None:
    for function, shape in (
        (pseudoscalar_fft, (4, 3, 5, 8)),
        (product_fft, (4, 3, 4)),
        (volume_time_fft, (2, 3, 2, 2, 4)),
    ):
        stack = field(2, *shape)
        both = function(stack, workers=2)
        assert np.abs(both[1] - function(stack[1])).max() < 1e-13
        assert np.abs(function(np.asfortranarray(stack)) - both).max() < 1e-13
        components = np.ascontiguousarray(np.moveaxis(stack, -1, 0))
        assert np.abs(function(np.moveaxis(components, 0, -1)) - both).max() < 1e-13
        assert function(stack.astype(np.float32)).dtype == np.float32
        assert function(np.ones(shape, int)).dtype == np.float64
        stack[1][(1,) * len(shape)] = np.nan
        with pytest.raises(ValueError, match="field: a number is not finite"):
            function(stack)


E12 = np.eye(4)[3]


@all_cases(
    "call, message",
    [
        (lambda f: pseudoscalar_fft(f[..., :3]), r"field: shape \(6, 5, 3\); expected n axes of space"),
        (lambda f: pseudoscalar_fft(f[..., :2]), "1 dimensions, where the pseudoscalar has square 1"),
        (lambda f: pseudoscalar_fft(f, "both"), "side: 'both'; expected 'right' or 'left'"),
        (lambda f: pseudoscalar_fft(f, norm="unit"), "norm: 'unit'"),
        (lambda f: product_fft(np.ones((3, 8))), r"field: shape \(3, 8\); expected n axes"),
        (lambda f: product_fft(f[:0]), "expected no empty axis"),
        (lambda f: real_product_fft(f, 4), "dimension: 4; expected 1 to 3"),
        (lambda f: volume_time_fft(f), "fields T L M N 4"),
        (lambda f: geometric_fft(f, vga2.geometric_product, right=[(np.eye(4)[1], (0,))]), "is not -1"),
        (lambda f: geometric_fft(f, vga2.geometric_product, right=[(E12[:2], (0,))]), "right: shape .*a root of -1"),
        (lambda f: geometric_fft(f, vga2.geometric_product, right=[(E12, (2,))]), "each axis of space, 0 to 1"),
        (lambda f: geometric_fft(f, vga2.geometric_product, [(E12, (0,))], [(E12, (0,))]), "at most once"),
        (lambda f: igeometric_fft(f * np.nan, vga2.geometric_product), "spectrum: a number is not finite"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(field(6, 5, 4))
