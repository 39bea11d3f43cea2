"""Fourier transforms and convolutions of fields of multivectors against direct sums over tables of blades."""

from __future__ import annotations

from itertools import product as every
from typing import Any

import numpy as np
import pytest
import scipy.signal

from algorithms.wavelets import (
    clifford_convolve,
    clifford_correlate,
    clifford_fft,
    iclifford_fft,
    ispacetime_fft,
    spacetime_fft,
)
from gacompiler import compile as compile_kernel
from gacompiler import kernel
from gacompiler.algebra.catalog import orthogonal
from generated import cga3, pga2, pga3, quaternion, sta, vga2, vga3
from tests.support.all_cases import all_cases

PLANE, SPACE = ("", "1", "2", "12"), ("", "1", "2", "3", "12", "13", "23", "123")
SPACETIME = ("", *"1234", "12", "13", "23", "14", "24", "34", "123", "124", "134", "234", "1234")
OPPOSITE_TIME = {"4": -1}


def table(blades: tuple[str, ...], squares: dict[str, int]) -> np.ndarray:
    """``e_a e_b = sum table[a, b, c] e_c``, by sorting the vectors and counting exchanges."""
    result = np.zeros((len(blades),) * 3)
    for (i, a), (j, b) in every(enumerate(blades), repeat=2):
        vectors, sign = list(a + b), 1
        for end in range(len(vectors), 0, -1):
            for k in range(end - 1):
                if vectors[k] > vectors[k + 1]:
                    vectors[k], vectors[k + 1], sign = vectors[k + 1], vectors[k], -sign
        k = 0
        while k < len(vectors) - 1:
            if vectors[k] == vectors[k + 1]:
                sign *= squares.get(vectors[k], 1)
                del vectors[k : k + 2]
                k = max(k - 1, 0)
            else:
                k += 1
        result[i, j, blades.index("".join(vectors))] += sign
    return result


def times(a: np.ndarray, b: np.ndarray, by: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...j,ijk->...k", a, b, by)


def exponential(blades: tuple[str, ...], root: str, angle: np.ndarray) -> np.ndarray:
    result = np.zeros((*angle.shape, len(blades)))
    result[..., 0], result[..., blades.index(root)] = np.cos(angle), np.sin(angle)
    return result


def direct(field: np.ndarray, blades: Any, squares: Any, left: Any, right: Any, sign: float = -1) -> np.ndarray:
    """The sum over all positions; `left` and `right` are a root of -1 and the axes of its phases, or None."""
    by, shape = table(blades, squares), field.shape[:-1]
    places = np.indices(shape)
    result = np.empty_like(field)
    for w in np.ndindex(shape):
        phases = [2 * np.pi * w[k] * places[k] / shape[k] * sign for k in range(len(shape))]
        terms = field
        if left:
            terms = times(exponential(blades, left[0], sum(phases[k] for k in left[1])), terms, by)
        if right:
            terms = times(terms, exponential(blades, right[0], sum(phases[k] for k in right[1])), by)
        result[w] = terms.reshape(-1, len(blades)).sum(0)
    return result


def field(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


@all_cases("size", [(6, 5), (7, 8), (1, 3), (1, 1)])
@all_cases("side", ["left", "right"])
def test_plane(side: str, size: tuple[int, int]) -> None:
    f = field(*size, 4)
    root = ("12", (0, 1))
    truth = direct(f, PLANE, {}, root if side == "left" else None, root if side == "right" else None)
    found = clifford_fft(f, side)
    assert np.abs(found - truth).max() < 1e-12
    assert np.abs(iclifford_fft(found, side) - f).max() < 1e-14
    assert np.abs(clifford_fft(f, side, "forward") * f[..., 0].size - truth).max() < 1e-12
    assert np.linalg.norm(clifford_fft(f, side, "ortho")) == pytest.approx(np.linalg.norm(f), rel=1e-14)


@pytest.mark.parametrize("size", [(3, 4, 5), (2, 3, 2), (1, 1, 4)])
def test_space(size: tuple[int, int, int]) -> None:
    f = field(*size, 8)
    truth = direct(f, SPACE, {}, None, ("123", (0, 1, 2)))
    found = clifford_fft(f)
    assert np.abs(found - truth).max() < 1e-12
    assert np.array_equal(found, clifford_fft(f, "left"))
    assert np.abs(iclifford_fft(found) - f).max() < 1e-14
    assert np.linalg.norm(clifford_fft(f, norm="ortho")) == pytest.approx(np.linalg.norm(f), rel=1e-14)


@pytest.mark.parametrize("size", [(3, 2, 2, 3), (4, 1, 3, 2)])
def test_space_and_time(size: tuple[int, ...]) -> None:
    f = field(*size, 16)
    truth = direct(f, SPACETIME, OPPOSITE_TIME, ("4", (0,)), ("123", (1, 2, 3)))
    found = spacetime_fft(f)
    assert np.abs(found - truth).max() < 1e-12
    assert np.abs(ispacetime_fft(found) - f).max() < 1e-14
    for norm in ("ortho", "forward"):
        assert np.abs(ispacetime_fft(spacetime_fft(f, norm), norm) - f).max() < 1e-14
    assert np.linalg.norm(spacetime_fft(f, "ortho")) == pytest.approx(np.linalg.norm(f), rel=1e-14)


@pytest.mark.parametrize("norm", [None, "ortho", "forward"])
def test_space_and_time_one_after_the_other(norm: str | None) -> None:
    """Parts of time along space, then parts of space along time, and back in the other order."""
    f = field(4, 3, 2, 3, 16)
    in_time = direct(f[:, 1, 0, 2], SPACETIME, OPPOSITE_TIME, ("4", (0,)), None)
    assert np.abs(spacetime_fft(f, along="time")[:, 1, 0, 2] - in_time).max() < 1e-12
    in_space = direct(f[2], SPACETIME, OPPOSITE_TIME, None, ("123", (0, 1, 2)))
    assert np.abs(spacetime_fft(f, along="space")[2] - in_space).max() < 1e-12
    slices = np.concatenate([spacetime_fft(part, norm, along="space") for part in (f[:1], f[1:])])
    columns = [spacetime_fft(part, norm, along="time") for part in (slices[:, :2], slices[:, 2:])]
    found = np.concatenate(columns, 1)
    assert np.abs(found - spacetime_fft(f, norm)).max() < 1e-13
    back = ispacetime_fft(ispacetime_fft(found, norm, along="time"), norm, along="space")
    assert np.abs(back - f).max() < 1e-14


@pytest.mark.parametrize("along", ["time", "space", "both"])
def test_a_number_that_is_not_finite_is_found_along_any_axes(along: str) -> None:
    f = field(2, 3, 2, 2, 16)
    f[1, 2, 1, 0, 5] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        spacetime_fft(f, along=along)
    with pytest.raises(ValueError, match="along: 'length'; expected 'both', 'space' or 'time'"):
        spacetime_fft(f, along="length")


def test_a_travelling_wave_is_in_one_half_of_the_split() -> None:
    """``exp(e4 w t) f0 exp(e123 u x)`` with ``f0 = e4 f0 e123`` has one frequency; it depends on ``u x - w t`` only."""
    by = table(SPACETIME, OPPOSITE_TIME)
    blade = {name: np.eye(16)[k] for k, name in enumerate(SPACETIME)}
    g = field(16)
    half = (g + times(times(blade["4"], g, by), blade["123"], by)) / 2
    t, x = np.meshgrid(np.arange(8), np.arange(6), indexing="ij")
    s, p = 2 * np.pi * 3 * t / 8, 2 * np.pi * x / 6
    wave = times(times(exponential(SPACETIME, "4", s), half, by), exponential(SPACETIME, "123", p), by)
    assert np.abs(wave - times(half, exponential(SPACETIME, "123", p - s), by)).max() < 1e-14
    spectrum = spacetime_fft(wave[:, :, None, None])
    assert np.abs(spectrum[3, 1, 0, 0] - 48 * half).max() < 1e-12
    spectrum[3, 1] = 0
    assert np.abs(spectrum).max() < 1e-12


def periodic(f: np.ndarray, h: np.ndarray, by: np.ndarray) -> np.ndarray:
    """The circular convolution by direct sums."""
    space = tuple(range(f.ndim - 1))
    return sum(times(np.roll(f, y, space), h[y], by) for y in np.ndindex(h.shape[:-1]))


def test_theorems_in_the_plane() -> None:
    """Shift, modulation, and convolution with the two parts of the mask at opposite frequencies."""
    f, h, by = field(5, 6, 4), field(5, 6, 4, seed=1), table(PLANE, {})
    u, v = np.meshgrid(np.arange(5), np.arange(6), indexing="ij")
    turn = exponential(PLANE, "12", -2 * np.pi * (u * 2 / 5 + v * 3 / 6))
    spectrum = clifford_fft(f)
    assert np.abs(clifford_fft(np.roll(f, (2, 3), (0, 1))) - times(spectrum, turn, by)).max() < 1e-12
    wave = exponential(PLANE, "12", 2 * np.pi * (u * 2 / 5 + v * 3 / 6))
    assert np.abs(clifford_fft(times(f, wave, by)) - np.roll(spectrum, (2, 3), (0, 1))).max() < 1e-12
    even, odd = h * [1, 0, 0, 1], h * [0, 1, 1, 0]
    opposite = np.roll(spectrum[::-1, ::-1], 1, (0, 1))
    expected = times(spectrum, clifford_fft(even), by) + times(opposite, clifford_fft(odd), by)
    found = clifford_fft(periodic(f, h, by))
    assert np.abs(found - expected).max() < 1e-11
    assert np.abs(found - times(spectrum, clifford_fft(h), by)).max() > 1


def test_theorems_in_space() -> None:
    """Shift, convolution, and the vector derivative, ``2 pi e123 w F(w)`` of a field of few frequencies."""
    by = table(SPACE, {})
    f, h = field(3, 4, 5, 8), field(3, 4, 5, 8, seed=1)
    expected = times(clifford_fft(f), clifford_fft(h), by)
    assert np.abs(clifford_fft(periodic(f, h, by)) - expected).max() < 1e-11
    x = np.stack(np.meshgrid(*(np.arange(n) / n for n in (7, 8, 9)), indexing="ij"), -1)
    found, amplitudes = 0, field(4, 8)
    derivative = 0
    for amplitude, w in zip(amplitudes, ([1, 2, -3], [0, -1, 4], [3, 3, 0], [-2, 0, 1]), strict=True):
        phase = 2 * np.pi * x @ np.array(w)
        vector = np.zeros(8)
        vector[1:4] = 2 * np.pi * np.array(w)
        found = found + np.cos(phase)[..., None] * amplitude
        derivative = derivative - np.sin(phase)[..., None] * times(vector, amplitude, by)
    w = np.stack(np.meshgrid(*(np.fft.fftfreq(n, 1 / n) for n in (7, 8, 9)), indexing="ij"), -1)
    vectors = np.zeros((7, 8, 9, 8))
    vectors[..., 1:4] = 2 * np.pi * w
    expected = times(times(np.eye(8)[7], vectors, by), clifford_fft(found), by)
    assert np.abs(iclifford_fft(expected) - derivative).max() < 1e-11


def test_batches_precision_and_workers() -> None:
    for transform, inverse, shape in (
        (clifford_fft, iclifford_fft, (6, 5, 4)),
        (clifford_fft, iclifford_fft, (3, 4, 5, 8)),
        (spacetime_fft, ispacetime_fft, (3, 2, 4, 2, 16)),
    ):
        stack = field(2, *shape)
        both = transform(stack, workers=2)
        for k in range(2):
            assert np.abs(both[k] - transform(stack[k])).max() < 1e-13
        assert np.abs(transform(np.asfortranarray(stack)) - both).max() < 1e-13
        single = transform(stack.astype(np.float32))
        assert single.dtype == inverse(single).dtype == np.float32
        assert np.abs(inverse(single) - stack).max() < 2e-6
        assert transform(np.ones(shape, int)).dtype == np.float64
        stack[1][(1,) * len(shape)] = np.nan
        with pytest.raises(ValueError, match="field: a number, or the sum of all, is not finite"):
            transform(stack)


@all_cases(
    "call, message",
    [
        (
            lambda f: clifford_fft(f[..., :3]),
            r"field: shape \(6, 5, 3\); expected fields M N 4 of G\(2\) or fields L M N 8",
        ),
        (lambda f: clifford_fft(field(5, 6, 8)), r"field: shape \(5, 6, 8\); expected \(..., any, any, any, 8\)"),
        (lambda f: clifford_fft(f, "both"), "side: 'both'; expected 'right' or 'left'"),
        (lambda f: clifford_fft(f, norm="unit"), "norm: 'unit'"),
        (lambda f: clifford_fft(f[:0]), "expected no empty axis"),
        (lambda f: spacetime_fft(f), "fields T L M N 16"),
        (lambda f: clifford_convolve(f, f[..., 0], vga2.geometric_product), "mask: shape .*expected as many axes"),
        (lambda f: clifford_convolve(f[:2], f, vga2.geometric_product, "valid"), "larger than the field"),
        (lambda f: clifford_convolve(f, f, vga2.geometric_product, "circular"), "mode: 'circular'; expected 'full'"),
        (lambda f: clifford_convolve(f, f, vga2.geometric_product, method="best"), "method: 'best'"),
        (lambda f: clifford_convolve(f, f, vga2.geometric_product, side="both"), "side: 'both'"),
        (lambda f: clifford_convolve(f * np.nan, f, vga2.geometric_product), "field: a number is not finite"),
        (lambda f: clifford_convolve(f, f[:, :0], vga2.geometric_product), "mask: .*no empty axis"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(field(6, 5, 4))


def made(p: int, q: int, r: int) -> Any:
    """A kernel of an algebra that is not generated."""
    full = orthogonal(p, q, r).full

    @kernel(a=full, b=full)
    def geometric_product(a, b):  # type: ignore[no-untyped-def]
        return a * b

    return compile_kernel(geometric_product)


ALGEBRAS = {
    "vga2": (vga2.geometric_product, 4),
    "vga3": (vga3.geometric_product, 8),
    "pga2": (pga2.geometric_product, 8),
    "pga3": (pga3.geometric_product, 16),
    "sta": (sta.geometric_product, 16),
    "cga3": (cga3.geometric_product, 32),
    "quaternion": (quaternion.product, 4),
    "G(0,0,2)": ((0, 0, 2), 4),
    "G(1,1)": ((1, 1, 0), 4),
    "G(0,1)": ((0, 1, 0), 2),
    "G(1,0,1)": ((1, 0, 1), 4),
}


@all_cases("name", ALGEBRAS)
def test_convolution_in_all_algebras(name: str) -> None:
    """Direct and by Fourier transforms, against sums over a multiplication table of the basis blades."""
    kernel_or_signature, n = ALGEBRAS[name]
    product = made(*kernel_or_signature) if isinstance(kernel_or_signature, tuple) else kernel_or_signature
    by = np.array([[product(a, b) for b in np.eye(n)] for a in np.eye(n)])
    f, h = field(6, 7, n), field(3, 4, n, seed=1)
    full = np.zeros((8, 10, n))
    turned = np.zeros((8, 10, n))
    for y in np.ndindex(3, 4):
        full[y[0] : y[0] + 6, y[1] : y[1] + 7] += times(f, h[y], by)
        turned[2 - y[0] : 8 - y[0], 3 - y[1] : 10 - y[1]] += times(h[y], f, by)
    scale = np.abs(full).max()
    assert np.abs(clifford_convolve(f, h, product, method="auto") - full).max() < 1e-13 * scale
    for method in ("direct", "fft"):
        assert np.abs(clifford_convolve(f, h, product, method=method) - full).max() < 1e-13 * scale
        assert np.abs(clifford_correlate(f, h, product, side="left", method=method) - turned).max() < 1e-13 * scale
        same = clifford_convolve(f, h, product, "same", method=method)
        assert np.abs(same - full[1:7, 1:8]).max() < 1e-13 * scale
        valid = clifford_convolve(f, h, product, "valid", method=method)
        assert np.abs(valid - full[2:6, 3:7]).max() < 1e-13 * scale
        wrapped = clifford_convolve(f, h, product, "wrap", method=method)
        assert np.abs(wrapped - periodic(f, h, by)).max() < 1e-13 * scale


@all_cases("mode", ["full", "same", "valid"])
@all_cases("size", [(3, 3), (2, 4), (1, 5), (6, 5)])
def test_scalars_equal_those_of_scipy(mode: str, size: tuple[int, int]) -> None:
    f, h = field(7, 6, 4) * [1, 0, 0, 0], field(*size, 4, seed=1) * [1, 0, 0, 0]
    for method in ("direct", "fft"):
        found = clifford_convolve(f, h, vga2.geometric_product, mode, method=method)
        assert np.abs(found[..., 0] - scipy.signal.convolve(f[..., 0], h[..., 0], mode)).max() < 1e-13
        found = clifford_correlate(f, h, vga2.geometric_product, mode, method=method)
        assert np.abs(found[..., 0] - scipy.signal.correlate(f[..., 0], h[..., 0], mode)).max() < 1e-13


def test_divergence_and_curl() -> None:
    """The derivative of a Gaussian, as a vector, gives divergence and curl of the smoothed field."""
    x, y = np.meshgrid(np.arange(64) * 2 * np.pi / 64, np.arange(64) * 2 * np.pi / 64, indexing="ij")
    vectors = np.stack([np.sin(x) * np.cos(2 * y), np.cos(3 * x + y)], -1)
    divergence = np.cos(x) * np.cos(2 * y) - np.sin(3 * x + y)
    curl = -3 * np.sin(3 * x + y) + 2 * np.sin(x) * np.sin(2 * y)
    s, r = 2.0, np.arange(-20, 21.0)
    g = np.exp(-(r**2) / (2 * s * s)) / np.sqrt(2 * np.pi) / s
    d = -r / s**2 * g
    mask = np.stack([d[:, None] * g, g[:, None] * d], -1)
    both = clifford_convolve(vectors, mask, vga2.vector_product, "wrap", side="left", method="fft") * 64 / 2 / np.pi
    both = np.roll(both, (-20, -20), (0, 1))

    def smooth(*parts: tuple[float, np.ndarray]) -> np.ndarray:
        """Waves of squared wave numbers w, which the Gaussian of width s pixels attenuates."""
        return sum(np.exp(-((s * 2 * np.pi / 64) ** 2) * w / 2) * part for w, part in parts)

    wave = -np.sin(3 * x + y)
    assert np.abs(both[..., 0] - smooth((5, divergence - wave), (10, wave))).max() < 1e-10
    assert np.abs(both[..., 1] - smooth((5, curl - 3 * wave), (10, 3 * wave))).max() < 1e-10


def test_correlation_of_vectors_gives_position_and_rotation() -> None:
    x, y = np.meshgrid(np.arange(-4, 5.0), np.arange(-4, 5.0), indexing="ij")
    weight = np.exp(-(x * x + y * y) / 6)
    template = np.stack([-y, x], -1) * weight[..., None]
    for angle in (0.3, -1.2, 2.9):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        image = np.zeros((40, 50, 2))
        image[13:22, 24:33] = template @ turn.T
        found = clifford_correlate(image, template, vga2.vector_product, "same", side="left")
        place = np.unravel_index((found**2).sum(-1).argmax(), (40, 50))
        assert place == (17, 28)
        scalar, bivector = found[place]
        assert np.arctan2(bivector, scalar) == pytest.approx(angle, abs=1e-12)


def test_convolution_is_associative_and_does_not_commute() -> None:
    f, g, h = (field(4, 4, 4, 8, seed=k) for k in range(3))
    by = vga3.geometric_product
    left = clifford_convolve(clifford_convolve(f, g, by), h, by)
    right = clifford_convolve(f, clifford_convolve(g, h, by), by)
    assert np.abs(left - right).max() < 1e-12 * np.abs(left).max()
    assert np.abs(clifford_convolve(f, g, by) - clifford_convolve(g, f, by)).max() > 1
