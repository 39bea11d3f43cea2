"""Discrete wavelets against their defining equations and PyWavelets."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from algorithms.wavelets import discrete_wavelet, dual_tree, dwt, idwt, wavelet_filters
from algorithms.wavelets.discrete import MODES, analysis
from tests.support.all_cases import all_cases

FEW = ("haar", "db2", "db7", "sym5", "coif2", "bior1.3", "bior3.5", "bior6.8")


def signal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


@pytest.mark.parametrize("mode", MODES)
def test_one_level_equals_that_of_pywavelets(mode: str) -> None:
    pywt = pytest.importorskip("pywt")
    for name, size in product((*FEW, "db38", "coif17", "rbio4.4"), (64, 27)):
        x = signal(size)
        expected = pywt.dwt(x, name, mode)
        found = analysis(x, name, mode, 0)
        for one, other in zip(found, expected, strict=True):
            assert one.shape == other.shape, (name, size)
            assert np.abs(one - other).max() < 1e-10 * max(1, np.abs(other).max()), (name, size)


@all_cases("mode", MODES)
@all_cases("name", FEW)
def test_images_equal_those_of_pywavelets(name: str, mode: str) -> None:
    pywt = pytest.importorskip("pywt")
    image = signal(81, 72)
    found = discrete_wavelet(image, name, 2, mode)
    expected = pywt.wavedec2(image, name, mode, 2)
    scale = max(1, np.abs(expected[0]).max())
    assert np.abs(found.approx - expected[0]).max() < 1e-10 * scale
    for level in range(2):
        for key, other in zip("HVD", expected[2 - level], strict=True):
            assert np.abs(found.detail[level][key] - other).max() < 1e-10 * scale


@all_cases("mode", MODES)
@all_cases("name", FEW)
def test_the_inverse_reconstructs_signals_images_and_volumes(name: str, mode: str) -> None:
    for shape, axes in (((131,), None), ((33, 40), None), ((19, 20, 21), (0, 1, 2)), ((3, 64, 2), (1,))):
        x = signal(*shape)
        pyramid = discrete_wavelet(x, name, None, mode, axes)
        back = pyramid.inverse()
        assert back.shape == x.shape
        assert np.abs(back - x).max() < 1e-12


def test_names_of_the_bands() -> None:
    """A horizontal edge is in H, a vertical one in V."""
    step = np.repeat([0.0, 1.0], [15, 17])
    rows = discrete_wavelet(np.outer(step, np.ones(32)), "haar", 1).detail[0]
    assert np.abs(rows["H"]).max() > 0.1 and np.abs(rows["V"]).max() < 1e-14 and np.abs(rows["D"]).max() < 1e-14
    columns = discrete_wavelet(np.outer(np.ones(32), step), "haar", 1).detail[0]
    assert np.abs(columns["V"]).max() > 0.1 and np.abs(columns["H"]).max() < 1e-14
    assert set(discrete_wavelet(signal(16), "haar", 1).detail[0]) == {"D"}
    volume = discrete_wavelet(signal(8, 8, 8), "haar", 1, axes=(0, 1, 2)).detail[0]
    assert set(volume) == {"aad", "ada", "add", "daa", "dad", "dda", "ddd"}


@all_cases("name, moments", [("db1", 1), ("db3", 3), ("db8", 8), ("sym6", 6), ("coif3", 6)])
def test_polynomials_have_no_details(name: str, moments: int) -> None:
    x = np.linspace(-1, 1, 200)
    polynomial = np.polynomial.Polynomial(signal(moments))(x)
    rough = analysis(polynomial, name, "zero", 0)[1]
    inside = len(wavelet_filters(name).low)
    assert np.abs(rough[inside:-inside]).max() < 1e-9


def test_orthogonal_periodic_transforms_preserve_energy() -> None:
    x = signal(64, 96)
    pyramid = discrete_wavelet(x, "sym4", 3, "periodization")
    energy = (pyramid.approx**2).sum() + sum((band**2).sum() for level in pyramid.detail for band in level.values())
    assert energy == pytest.approx((x**2).sum(), rel=1e-13)


def test_types_are_preserved() -> None:
    x = signal(40, 33).astype(np.float32)
    for pyramid in (discrete_wavelet(x, "db2", 2), dual_tree(x, 2)):
        assert pyramid.approx.dtype == pyramid.inverse().dtype == np.float32
        assert np.abs(pyramid.inverse() - x).max() < 1e-5
    assert dual_tree(x).detail[0].dtype == np.complex64
    integers = np.arange(64).reshape(8, 8)
    assert np.abs(dual_tree(integers, 2).inverse() - integers).max() < 1e-12
    assert np.abs(discrete_wavelet(integers, "haar", 2).inverse() - integers).max() < 1e-12


@all_cases(
    "call, error, message",
    [
        (lambda x: discrete_wavelet(x, "db99"), ValueError, "wavelet: 'db99'; expected 'haar', 'db1' to 'db38'"),
        (
            lambda x: discrete_wavelet(x, "db4", 9),
            ValueError,
            "levels: 9; expected at most 2, as 40 numbers have with a filter of 8",
        ),
        (lambda x: discrete_wavelet(x, levels=-1), ValueError, "levels: -1; expected a whole number"),
        (lambda x: discrete_wavelet(x, levels=1.5), ValueError, "levels: 1.5"),
        (lambda x: discrete_wavelet(x, mode="round"), ValueError, "mode: 'round'; expected 'symmetric'"),
        (lambda x: discrete_wavelet(x, axes=(0, 2)), ValueError, "axes: .* expected axes of an array of 2"),
        (lambda x: discrete_wavelet(x, axes=(1, -1)), ValueError, "expected each axis once"),
        (lambda x: discrete_wavelet(x * np.nan), ValueError, "signal: a number is not finite"),
        (lambda x: discrete_wavelet(x[:0]), ValueError, "signal: .*no empty axis"),
        (lambda x: discrete_wavelet(x + 0j), TypeError, "signal: dtype complex128"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide")
def test_bad_input(call: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call(signal(40, 50))


@all_cases("mode", ["symmetric", "periodization", "antireflect"])
@all_cases("shape, axes", [((301, 130), None), ((20000,), None), ((31, 40, 27), (0, 1, 2)), ((3, 90, 91), (1,))])
def test_workers_change_nothing(shape: tuple[int, ...], axes: tuple[int, ...] | None, mode: str) -> None:
    """Threads share arrays in blocks of rows, of columns and of both."""
    signal = np.random.default_rng(0).normal(size=shape)
    reported: list[tuple[int, int]] = []
    alone = discrete_wavelet(signal, "db3", 2, mode, axes)
    for workers in (2, 3, 7):
        shared = discrete_wavelet(signal, "db3", 2, mode, axes, workers, lambda *done: reported.append(done))
        assert np.array_equal(shared.approx, alone.approx)
        for one, other in zip(shared.detail, alone.detail, strict=True):
            assert all(np.array_equal(one[name], other[name]) for name in other)
        assert np.array_equal(alone.inverse(workers, lambda *done: reported.append(done)), alone.inverse())
    assert reported == 6 * [(1, 2), (2, 2)]
    with pytest.raises(ValueError, match="workers: 0; expected"):
        alone.inverse(workers=0)


@pytest.mark.parametrize("wavelet", ["haar", "db4", "db20"])
def test_long_signals_are_filtered_like_their_parts(wavelet: str) -> None:
    """At once by one thread, in parts by two; away from the ends, results are those of a short part."""
    signal = np.random.default_rng(4).normal(size=20_001)
    bands = dwt(signal, wavelet)
    parts = dwt(signal[1000:1200], wavelet)
    length = len(wavelet_filters(wavelet).low)
    for band, shared, part in zip(bands, dwt(signal, wavelet, workers=2), parts, strict=True):
        assert np.array_equal(band, shared)
        assert np.abs(band[500 + length : 580] - part[length:80]).max() < 1e-14
    back = idwt(*bands, wavelet, size=20_001)
    assert np.array_equal(back, idwt(*bands, wavelet, size=20_001, workers=2))
    assert np.abs(back - signal).max() < 1e-9
