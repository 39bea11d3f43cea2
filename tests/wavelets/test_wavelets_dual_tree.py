"""Dual trees of signals, images and volumes against their defining equations and stored results of dtcwt 0.14."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.wavelets import QuaternionPyramid, discrete_wavelet, dual_tree
from algorithms.wavelets.filters import LEVEL_ONE_ANALYSIS, LEVEL_ONE_SYNTHESIS, QSHIFT
from tests.support.all_cases import all_cases

KNOWN = Path(__file__).parents[1] / "support" / "golden" / "dtcwt.npz"
"""Coefficients of random signals, images and a volume, of the dtcwt package run in its own environment."""


def signal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def last(count: int) -> tuple[int, ...]:
    return tuple(range(-count, 0))


@pytest.fixture(scope="module")
def camera() -> np.ndarray:
    return pytest.importorskip("skimage.data").camera().astype(float)


@all_cases("name", QSHIFT)
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


@pytest.mark.parametrize("names", ["near_sym_a qshift_a", "near_sym_b qshift_b", "near_sym_b qshift_d"])
def test_dual_tree_equals_that_of_dtcwt(names: str) -> None:
    with np.load(KNOWN) as known:
        found = dual_tree(known["image"], 3, *names.split())
        assert np.abs(found.approx - known[f"{names} approx"]).max() < 1e-14
        for level in range(3):
            assert np.abs(found.detail[level] - known[f"{names} {level}"]).max() < 1e-14


@all_cases("shape", [(22,), (64,), (13, 22), (6, 10, 8)])
def test_other_sizes_equal_those_of_dtcwt(shape: tuple[int, ...]) -> None:
    """Signals, images of odd size and volumes, alone and along other axes of a stack."""
    with np.load(KNOWN) as known:
        names = [name.removesuffix(" approx") for name in known if name.startswith(f"{shape} ") and "approx" in name]
        x = known[f"{shape}"]
        for name in names:
            levels = 2 if len(shape) == 3 else 3
            tree = dual_tree(x, levels, *name.split()[-2:], axes=last(len(shape)))
            two = dual_tree(np.stack([0 * x, x], -1), levels, *name.split()[-2:], axes=tuple(range(len(shape))))
            expected = [known[f"{name} approx"], *(known[f"{name} {level}"] for level in range(levels))]
            for each, other, stored in zip(
                (tree.approx, *tree.detail), (two.approx, *two.detail), expected, strict=True
            ):
                assert np.abs(each - stored.reshape(each.shape)).max() < 1e-14
                assert np.abs(np.moveaxis(other, len(shape), 0)[1] - each).max() < 1e-14
        assert len(names) == (1 if len(shape) == 3 else 2)


@all_cases("shape", [(7,), (11,), (3, 21), (9, 7), (5, 6, 7)])
def test_odd_sizes_repeat_the_last_number(shape: tuple[int, ...]) -> None:
    axes = last(len(shape)) if shape[0] != 3 else (-1,)
    x = signal(*shape)
    even = np.pad(x, [(0, n % 2 if axis - len(shape) in axes else 0) for axis, n in enumerate(shape)], "edge")
    one, other = dual_tree(x, 2, axes=axes), dual_tree(even, 2, axes=axes)
    assert one.size == tuple(shape[axis] for axis in axes) and np.array_equal(one.approx, other.approx)
    assert all(np.array_equal(*pair) for pair in zip(one.detail, other.detail, strict=True))
    assert np.array_equal(one.inverse(), other.inverse()[tuple(map(slice, shape))])


@pytest.mark.parametrize("count", [1, 2, 3])
def test_trees_of_signals_images_and_volumes_are_invertible(count: int) -> None:
    """To 5e-15 of the largest number, for all numbers of levels and sizes that are padded at some of them."""
    for size in (1, 2, 3, 6, 7, 10, 18, 37 if count < 3 else 19):
        x = signal(2, *[size, 12, 9][:count])
        for first, later in (("near_sym_a", "qshift_06"), ("near_sym_b", "qshift_c")):
            tree = dual_tree(x, None, first, later, axes=last(count))
            assert tree.inverse().shape == x.shape
            assert np.abs(tree.inverse() - x).max() < 5e-15 * np.abs(x).max()
    zero = dual_tree(x, 0, axes=last(count))
    assert zero.detail == () and np.array_equal(zero.inverse(), x)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_layouts_and_types_of_arrays_do_not_matter(count: int) -> None:
    x = signal(2, *[14, 11, 8][:count]).astype(np.float32).astype(float)
    expected = dual_tree(x, 2, axes=last(count))
    kept = x.copy()
    kept.flags.writeable = False
    for other in (np.asfortranarray(x), kept, np.repeat(x, 2, 0)[::2], x[..., ::-1].copy()[..., ::-1], x.tolist()):
        tree = dual_tree(other, 2, axes=last(count))
        assert np.array_equal(tree.approx, expected.approx)
        assert all(np.array_equal(*pair) for pair in zip(tree.detail, expected.detail, strict=True))
    single = dual_tree(x.astype(np.float32), 2, axes=last(count))
    assert single.approx.dtype == single.inverse().dtype == np.float32 and single.detail[0].dtype == np.complex64
    for one, other in zip(single.detail, expected.detail, strict=True):
        assert np.abs(one - other).max() < 40 * np.finfo(np.float32).eps
    alone = dual_tree(x[1], 2, axes=last(count))
    assert all(np.array_equal(one, other[1]) for one, other in zip(alone.detail, expected.detail, strict=True))


def test_volumes_distinguish_directions() -> None:
    """A plane wave is in the band of its octant: four bands of one word are those of four directions of waves."""
    grid = np.stack(np.meshgrid(*3 * [np.arange(32.0)], indexing="ij"))
    for index, signs in enumerate([(1, 1, 1), (1, -1, 1), (-1, 1, 1), (-1, -1, 1)]):
        wave = np.cos(0.55 * np.pi / 2 * np.tensordot(signs, grid, 1))
        tree = dual_tree(wave, 2, "near_sym_b", "qshift_d", axes=(0, 1, 2))
        energy = (np.abs(tree.detail[1]) ** 2).sum((0, 1, 2))
        assert energy.argmax() == 24 + index and energy[24 + index] > 0.9 * energy[24:].sum()


def test_energy_of_signals_hardly_changes_under_shifts() -> None:
    """A pulse of a thousand samples; the energy of the details of a real transform varies ten times as much."""
    pulse = np.zeros(512)
    pulse[200:260] = np.hanning(60) * np.sign(np.arange(60) - 29.5)
    moved = np.stack([np.roll(pulse, k) for k in range(32)])
    tree = dual_tree(moved, 4, "near_sym_b", "qshift_d", axes=(-1,))
    energy = np.array([(np.abs(level) ** 2).sum(-1) for level in tree.detail[1:]])
    real = discrete_wavelet(moved, "db4", 4, "periodization", axes=(-1,))
    others = np.array([(level["D"] ** 2).sum(-1) for level in real.detail[1:]])
    spread, other = (each.std(1) / each.mean(1) for each in (energy, others))
    assert (spread < 0.02).all() and (other > 10 * spread).all(), (spread, other)


@all_cases(
    "call, error, message",
    [
        (lambda x: dual_tree(x[0], 6), ValueError, "levels: 6; expected at most 5, as 50 numbers have"),
        (lambda x: dual_tree(x, 6), ValueError, "levels: 6; expected at most 5, as arrays of 40 x 50 numbers have"),
        (lambda x: dual_tree([3.0], 1), ValueError, "levels: 1; expected at most 0, as 1 numbers have"),
        (lambda x: dual_tree(x, 2, "legall"), ValueError, "first: 'legall'; expected 'near_sym_a'"),
        (lambda x: dual_tree(x, 2, later="db4"), ValueError, "later: 'db4'; expected 'qshift_06'"),
        (lambda x: dual_tree(x * np.nan), ValueError, "signal: a number is not finite"),
        (lambda x: dual_tree(x[:, :0]), ValueError, "signal: .*no empty axis"),
        (lambda x: dual_tree([]), ValueError, "signal: .*no empty axis"),
        (lambda x: dual_tree(3.0), ValueError, "signal: shape"),
        (lambda x: dual_tree(x, axes=(0, 0)), ValueError, "expected each axis once"),
        (lambda x: dual_tree(x[None, None], axes=(0, 1, 2, 3)), ValueError, "expected one, two or three axes"),
        (lambda x: dual_tree(np.ones((9, 9, 3))), ValueError, "looks like"),
    ],
)
def test_bad_input(call: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call(signal(40, 50))


def test_lists_of_numbers_are_signals() -> None:
    tree = dual_tree([1, 2, 3, 4, 5, 6, 7])
    assert [level.shape for level in tree.detail] == [(4,), (2,)] and tree.approx.shape == (4,)
    assert np.abs(tree.inverse() - np.arange(1, 8)).max() < 1e-14
    assert dual_tree([5.0]).approx == [5]


@all_cases("first", LEVEL_ONE_ANALYSIS)
@all_cases("later", QSHIFT)
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
