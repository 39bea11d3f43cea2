"""Discrete wavelets and dual trees against their defining equations, PyWavelets, and stored results of dtcwt 0.14."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.wavelets import QuaternionPyramid, discrete_wavelet, dual_tree, wavelet_filters
from algorithms.wavelets.discrete import MODES, analysis
from algorithms.wavelets.filters import LEVEL_ONE_ANALYSIS, LEVEL_ONE_SYNTHESIS, QSHIFT

KNOWN = Path(__file__).parents[1] / "support" / "golden" / "dtcwt.npz"
"""Coefficients of a random image of 16 x 24 pixels, of the dtcwt package run in its own environment."""

FEW = ("haar", "db2", "db7", "sym5", "coif2", "bior1.3", "bior3.5", "bior6.8")


def signal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


@pytest.fixture(scope="module")
def camera() -> np.ndarray:
    return pytest.importorskip("skimage.data").camera().astype(float)


@pytest.mark.parametrize("name", QSHIFT)
def test_trees_are_orthogonal_and_half_a_sample_apart(name: str) -> None:
    """Kingsbury's equations: orthogonal filters with a delay of nearly a quarter of a sample from the centre."""
    low = np.array(QSHIFT[name])
    n = len(low)
    for k in range(n // 2):
        assert (low[2 * k :] * low[: n - 2 * k]).sum() == pytest.approx(float(k == 0), abs=1e-14)
    assert low.sum() == pytest.approx(np.sqrt(2), abs=1e-10)
    w = np.linspace(0.01, 0.3, 30)
    response = np.exp(-1j * np.outer(w, np.arange(n) - (n - 1) / 2)) @ low
    if len(low) > 10:
        assert np.abs(np.angle(response) / w - 0.25).max() < 0.08


@pytest.mark.parametrize("name", LEVEL_ONE_ANALYSIS)
def test_filters_of_the_first_level(name: str) -> None:
    """The filters are symmetric, have sum 1 and a halfband product."""
    low, back = np.array(LEVEL_ONE_ANALYSIS[name]), np.array(LEVEL_ONE_SYNTHESIS[name])
    for taps in (low, back):
        assert np.array_equal(taps, taps[::-1])
        assert taps.sum() == pytest.approx(1, abs=1e-14)
    product = np.convolve(low, back)
    middle = len(product) // 2
    assert product[middle] == pytest.approx(0.5, abs=1e-14)
    assert np.abs(product[middle % 2 :: 2][np.arange(middle % 2, len(product), 2) != middle]).max() < 1e-14


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


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", FEW)
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


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", FEW)
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


@pytest.mark.parametrize(("name", "moments"), [("db1", 1), ("db3", 3), ("db8", 8), ("sym6", 6), ("coif3", 6)])
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


@pytest.mark.parametrize("names", ["near_sym_a qshift_a", "near_sym_b qshift_b", "near_sym_b qshift_d"])
def test_dual_tree_equals_that_of_dtcwt(names: str) -> None:
    with np.load(KNOWN) as known:
        found = dual_tree(known["image"], 3, *names.split())
        assert np.abs(found.approx - known[f"{names} approx"]).max() < 1e-14
        for level in range(3):
            assert np.abs(found.detail[level] - known[f"{names} {level}"]).max() < 1e-14


@pytest.mark.parametrize("first", LEVEL_ONE_ANALYSIS)
@pytest.mark.parametrize("later", QSHIFT)
def test_dual_tree_is_invertible(first: str, later: str) -> None:
    for shape in ((64, 64), (50, 67), (3, 33, 20)):
        image = signal(*shape)
        assert np.abs(dual_tree(image, 4, first, later).inverse() - image).max() < 1e-13
    single = dual_tree(image[1], 4, first, later)
    assert np.abs(dual_tree(image, 4, first, later).detail[2][1] - single.detail[2]).max() < 1e-14
    assert np.abs(dual_tree(image, 0).inverse() - image).max() == 0


def test_energy_hardly_changes_under_shifts(camera: np.ndarray) -> None:
    """Standard deviation over 16 shifts of a windowed part of the image; the real transform's is ten times as large."""
    window = np.hanning(258)[1:-1]
    part = np.zeros((320, 320))
    part[32:288, 32:288] = (camera[100:356, 100:356] - camera.mean()) * np.outer(window, window)
    complex_energies, real_energies = [], []
    for k in range(16):
        moved = np.roll(part, (k, k), (0, 1))
        tree = dual_tree(moved, 4, "near_sym_b", "qshift_d")
        complex_energies.append([(np.abs(level) ** 2).sum() for level in tree.detail])
        real = discrete_wavelet(moved, "db4", 4, "periodization")
        real_energies.append([sum((band**2).sum() for band in level.values()) for level in real.detail])
    spread = np.std(complex_energies, 0) / np.mean(complex_energies, 0)
    assert spread.max() < 0.003, spread
    assert (np.std(real_energies, 0) / np.mean(real_energies, 0) > 10 * spread)[1:].all()


@pytest.mark.parametrize("later", ["qshift_b", "qshift_d"])
def test_bands_are_nearly_analytic(later: str) -> None:
    """A wavelet of the third level has frequencies of one sign along each axis, except for a percent of its energy."""
    tree = dual_tree(np.zeros((128, 128)), 3, "near_sym_b", later)
    for band in (1, 4):
        parts = []
        for unit in (1.0, 1j):
            for level in tree.detail:
                level[...] = 0
            tree.detail[2][8, 8, band] = unit
            parts.append(tree.inverse())
        energy = np.abs(np.fft.fft2(parts[0] - 1j * parts[1])) ** 2
        quadrants = [
            energy[rows, columns].sum()
            for rows in (slice(1, 64), slice(65, 128))
            for columns in (slice(1, 64), slice(65, 128))
        ]
        assert max(quadrants) > 0.98 * energy.sum()


@pytest.mark.parametrize(
    ("call", "error", "message"),
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
        (lambda x: dual_tree(x[0]), ValueError, "image: shape .*images M N"),
        (lambda x: dual_tree(x, 6), ValueError, "levels: 6; expected at most 5, as images of 40 x 50 pixels have"),
        (lambda x: dual_tree(x, 2, "legall"), ValueError, "first: 'legall'; expected 'near_sym_a'"),
        (lambda x: dual_tree(x, 2, later="db4"), ValueError, "later: 'db4'; expected 'qshift_06'"),
        (lambda x: dual_tree(x / 0), ValueError, "image: a number is not finite"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide")
def test_bad_input(call: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call(signal(40, 50))


@pytest.mark.parametrize("mode", ["symmetric", "periodization", "antireflect"])
@pytest.mark.parametrize(
    ("shape", "axes"), [((301, 130), None), ((20000,), None), ((31, 40, 27), (0, 1, 2)), ((3, 90, 91), (1,))]
)
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


@pytest.mark.parametrize("size", [(300, 257), (2, 160, 170)])
def test_workers_change_nothing_in_trees(size: tuple[int, ...]) -> None:
    image = np.random.default_rng(0).normal(size=size)
    reported: list[tuple[int, int]] = []
    alone, shared = dual_tree(image, 3), dual_tree(image, 3, workers=3, progress=lambda *done: reported.append(done))
    assert np.array_equal(alone.approx, shared.approx)
    assert all(np.array_equal(*pair) for pair in zip(alone.detail, shared.detail, strict=True))
    assert np.array_equal(alone.inverse(), shared.inverse(3, lambda *done: reported.append(done)))
    assert reported == 2 * [(1, 3), (2, 3), (3, 3)]
    quaternions = QuaternionPyramid(image, 3), QuaternionPyramid(image, 3, workers=3)
    for one, other in zip(*(pyramid.detail for pyramid in quaternions), strict=True):
        assert all(np.array_equal(one[name], other[name]) for name in "HVD")
    assert np.array_equal(quaternions[0].inverse(), quaternions[1].inverse(workers=3))
    for each in (*quaternions, QuaternionPyramid(image, 1, "gabor")):
        with pytest.raises(ValueError, match="workers: 0; expected"):
            each.inverse(workers=0)
