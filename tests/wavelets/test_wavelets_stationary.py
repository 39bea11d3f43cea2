"""Stationary transforms and wavelet packets against direct sums, theorems and round trips."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from algorithms.wavelets import (
    discrete_wavelet,
    dwt,
    idwt,
    stationary_wavelet,
    wavelet_filters,
    wavelet_packets,
)
from algorithms.wavelets.discrete import MODES
from tests.support.all_cases import all_cases


def normal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


@pytest.mark.parametrize("size", [32, 21, 12])
def test_stationary_transform_is_the_sum(size: int) -> None:
    """The taps of level l are 2**l samples apart, and wrap around signals of any size."""
    x, filters = normal(size), wavelet_filters("db3")
    found = stationary_wavelet(x, "db3", 3)
    for level in range(3):
        gap = 2**level
        places = np.arange(size)[:, None] + gap * (3 - np.arange(6))
        assert np.abs(found.detail[level]["D"] - x[places % size] @ filters.high).max() < 1e-14
        x = x[places % size] @ filters.low
    assert np.abs(found.approx - x).max() < 1e-14


@all_cases("name", ["haar", "db4", "bior2.6", "rbio5.5", "coif3"])
@all_cases("is_tight", [False, True])
def test_inverse_of_the_stationary_transform(name: str, is_tight: bool) -> None:
    for shape, axes in (((40,), None), ((31,), None), ((17, 24), None), ((5, 6, 9), (0, 1, 2)), ((3, 50, 2), (1,))):
        x = normal(*shape)
        found = stationary_wavelet(x, name, 2, axes, is_tight)
        assert all(band.shape == x.shape for bands in found.detail for band in bands.values())
        assert np.abs(found.inverse() - x).max() < 1e-13
    x = np.asfortranarray(normal(18, 20).astype(np.float32))
    x.flags.writeable = False
    found = stationary_wavelet(x, name, 2, is_tight=is_tight)
    assert found.approx.dtype == found.inverse().dtype == np.float32
    assert np.abs(found.inverse() - x).max() < 1e-5


def test_shifts_and_energy() -> None:
    """Shifted images have shifted coefficients, and the tight transform preserves the energy."""
    x = normal(24, 30)
    found = stationary_wavelet(x, "sym5", 3, is_tight=True)
    moved = stationary_wavelet(np.roll(x, (5, -7), (0, 1)), "sym5", 3, is_tight=True)
    for bands, others in zip(found.detail, moved.detail, strict=True):
        for name in "HVD":
            assert np.abs(np.roll(bands[name], (5, -7), (0, 1)) - others[name]).max() < 1e-14
    energy = (found.approx**2).sum() + sum((band**2).sum() for bands in found.detail for band in bands.values())
    assert energy == pytest.approx((x**2).sum(), rel=1e-13)


def test_stationary_transform_contains_the_discrete_one() -> None:
    x = normal(64)
    found, decimated = stationary_wavelet(x, "db2", 3), discrete_wavelet(x, "db2", 3, "periodization")
    for level in range(3):
        step = 2 ** (level + 1)
        assert np.abs(found.detail[level]["D"][::step] - decimated.detail[level]["D"]).max() < 1e-14


def test_levels_by_default() -> None:
    """The filter of the last level, of 7 * 2**(L - 1) + 1 samples, is no longer than the signal."""
    assert [len(stationary_wavelet(np.ones(n), "db4").detail) for n in (1, 6, 7, 13, 14, 28, 1000)] == [
        0, 0, 1, 1, 2, 3, 8,
    ]  # fmt: skip


@all_cases("mode", MODES)
def test_packets_are_repeated_transforms(mode: str) -> None:
    x = normal(45)
    packets = wavelet_packets(x, "db2", 3, mode)
    assert len(packets.nodes) == 15
    for path in packets.nodes:
        expected = x
        for letter in path:
            expected = dwt(expected, "db2", mode)["ad".index(letter)]
        assert np.array_equal(packets.nodes[path], expected)
    assert np.abs(packets.inverse() - x).max() < 1e-12
    for basis in (("a", "d"), ("aaa", "aad", "ad", "d"), ("a", "daa", "dad", "dd"), ("",)):
        assert np.abs(packets.inverse(basis) - x).max() < 1e-12


def test_bands_of_packets_are_ordered_by_frequency() -> None:
    """A wave in the middle of each eighth of the spectrum has its largest packet there."""
    t = np.arange(1024)
    for k in range(8):
        wave = np.cos((k + 0.5) / 8 * np.pi * t)
        packets = wavelet_packets(wave, "db20", 3, "periodization")
        energies = [(packets.nodes[path] ** 2).sum() for path in packets.paths()]
        assert int(np.argmax(energies)) == k and max(energies) > 0.8 * sum(energies)


def test_best_basis_is_the_least_of_all() -> None:
    """Against all bases of three levels, for the entropy of an orthonormal transform."""
    t = np.arange(256)
    x = np.cos(0.002 * t**2) + normal(256, seed=1) / 3
    packets = wavelet_packets(x, "sym4", 3, "periodization")

    def bases(path: str) -> list[tuple[str, ...]]:
        if len(path) == 3:
            return [(path,)]
        return [(path,), *(low + high for low, high in product(bases(path + "a"), bases(path + "d")))]

    def entropy(basis: tuple[str, ...]) -> float:
        energy = np.concatenate([packets.nodes[path] for path in basis]) ** 2
        share = energy / energy.sum()
        return -(share * np.log(share)).sum()

    every = bases("")
    assert len(every) == 26
    best = packets.best_basis()
    assert best in every and len(best) > 1
    assert entropy(best) == pytest.approx(min(map(entropy, every)), rel=1e-12)
    assert np.abs(packets.inverse(best) - x).max() < 1e-13
    assert packets.best_basis(lambda shares: float(len(shares))) == ("",), "equal costs do not divide"


def test_best_basis_finds_the_parts_of_a_signal() -> None:
    """One coefficient of a packet gives a basis that contains this packet."""
    for path in ("add", "dad", "ad", "d"):
        packets = wavelet_packets(np.zeros(64), "db3", 3, "periodization")
        packets.nodes[path][2] = 1
        level = tuple(name for name in packets.nodes if len(name) == len(path))
        again = wavelet_packets(packets.inverse(level), "db3", 3, "periodization")
        assert path in again.best_basis() and path in again.best_basis("l1")


def test_packets_of_images_and_volumes() -> None:
    x = normal(19, 22)
    packets = wavelet_packets(x, "db2", 2)
    assert len(packets.nodes) == 21 and packets.paths(1) == ("a", "v", "h", "d")
    pyramid = discrete_wavelet(x, "db2", 1)
    assert np.array_equal(packets.nodes["h"], pyramid.detail[0]["H"])
    assert np.abs(packets.inverse(packets.best_basis("l1")) - x).max() < 1e-13
    volume = normal(6, 7, 8)
    packets = wavelet_packets(volume, "haar", 2, axes=(0, 1, 2))
    assert len(packets.nodes) == 73 and "aadddd" in packets.nodes
    assert np.abs(packets.inverse() - volume).max() < 1e-13
    assert packets.band("aadddd") == (1, 1, 2)


@all_cases("mode", MODES)
def test_one_level_of_any_size(mode: str) -> None:
    for size, name in product((1, 2, 3, 8), ("haar", "db4", "bior3.1")):
        x = normal(size)
        low, high = dwt(x, name, mode)
        assert np.abs(idwt(low, high, name, mode, size=size) - x).max() < 1e-12 * 10 ** name.count("b")
    x = normal(4, 9, 3)
    assert np.abs(idwt(*dwt(x, "db3", mode, 1), "db3", mode, 1, 9) - x).max() < 1e-13
    assert idwt(*dwt(x, "db3", mode, 1), "db3", mode, -2).shape == (4, 10, 3)


@all_cases(
    "call, message",
    [
        (lambda x: stationary_wavelet(x, levels=6), "levels: 6; expected at most 5, as 40 numbers have"),
        (lambda x: stationary_wavelet(x * np.nan), "signal: a number is not finite"),
        (lambda x: stationary_wavelet(x, "db99"), "wavelet: 'db99'"),
        (lambda x: stationary_wavelet(x, axes=(1,)), "expected axes of an array of 1"),
        (lambda x: wavelet_packets(x, "db2", 9), "levels: 9; expected at most 3"),
        (lambda x: wavelet_packets(x, "db2", 2).inverse(["a", "da"]), "paths: no packet contains 'dd'"),
        (lambda x: wavelet_packets(x, "db2", 2).inverse(["a", "d", "da"]), "paths: 'da'; expected packets that do not"),
        (lambda x: wavelet_packets(x, "db2", 2).inverse(["a", "d", "x"]), "paths: 'x'; expected"),
        (lambda x: wavelet_packets(x, "db2", 2).best_basis("sum"), "cost: 'sum'; expected a function"),
        (lambda x: dwt(x, axis=1), "axis: 1; expected an axis of an array of 1"),
        (lambda x: dwt(x, mode="round"), "mode: 'round'"),
        (lambda x: dwt(x / 0), "signal: a number is not finite"),
        (lambda x: idwt(x, x[1:]), "rough: shape"),
        (lambda x: idwt(x, x, mode="round"), "mode: 'round'"),
        (lambda x: idwt(x, x, axis=-2), "axis: -2"),
        (lambda x: idwt(x, x, "db4", size=70), "size: 70; expected 74 or 73"),
        (
            lambda x: idwt(x[:3], x[:3], "db4"),
            "smooth: 3 numbers along the axis; expected at least 4, for filters of 8 taps",
        ),
        (lambda x: idwt(x, x * np.inf), "rough: a number is not finite"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide", "ignore:invalid")
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(normal(40))
