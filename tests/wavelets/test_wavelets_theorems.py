"""Theorems of the quaternion and Clifford Fourier transforms in their valid forms, and results of OpenCV."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_wavelets import SIDES, embedded, exponential, product, quaternions
from test_wavelets_fields import OPPOSITE_TIME, PLANE, SPACE, SPACETIME, field, periodic, table, times
from test_wavelets_fields import exponential as turn

from algorithms.wavelets import clifford_fft, iclifford_fft, iqft, qft, spacetime_fft

KNOWN = Path(__file__).parents[1] / "support" / "golden" / "opencv_qdft.npz"
UNITS = np.eye(4)


def mirrored(f: np.ndarray, *axes: int) -> np.ndarray:
    return np.roll(np.flip(f, axes), 1, axes)


def convolved(f: np.ndarray, h: np.ndarray) -> np.ndarray:
    """The circular convolution of quaternion images by direct sums."""
    return sum(product(np.roll(f, y, (0, 1)), np.broadcast_to(h[y], f.shape)) for y in np.ndindex(h.shape[:2]))


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_transform_of_opencv(side: str) -> None:
    axis = tuple(np.full(3, 3**-0.5))
    with np.load(KNOWN) as known:
        image = known["image"]
        assert np.abs(qft(image, side, (axis, axis)) - known[side]).max() < 1e-12
        assert np.abs(iqft(image, side, (axis, axis)) - known[f"{side} inverse"]).max() < 1e-12


@pytest.mark.parametrize("side", SIDES)
def test_linear_over_real_numbers(side: str) -> None:
    f, g = quaternions(6, 5), quaternions(6, 5, seed=1)
    assert np.abs(qft(2 * f - 3 * g, side) - 2 * qft(f, side) + 3 * qft(g, side)).max() < 1e-12


def test_modulation() -> None:
    """Waves on the same sides as the exponentials shift the spectrum."""
    f = quaternions(7, 10)
    x, y = 2 * np.pi * np.arange(7)[:, None] / 7 + np.zeros(10), 2 * np.pi * np.arange(10) / 10 + np.zeros((7, 1))
    wave = product(product(exponential("i", 2 * x), f), exponential("j", 3 * y))
    assert np.abs(qft(wave) - np.roll(qft(f), (2, 3), (0, 1))).max() < 1e-12
    wave = product(exponential("i", 2 * x + 3 * y), f)
    assert np.abs(qft(wave, "left") - np.roll(qft(f, "left"), (2, 3), (0, 1))).max() < 1e-12
    wave = product(f, exponential("j", 2 * x + 3 * y))
    assert np.abs(qft(wave, "right") - np.roll(qft(f, "right"), (2, 3), (0, 1))).max() < 1e-12


@pytest.mark.parametrize("side", SIDES)
def test_dilation(side: str) -> None:
    """Dilate periodic images by factors coprime to the size: 3 along x, 7 along y."""
    f = quaternions(7, 10)
    x, y = (3 * np.arange(7)) % 7, (7 * np.arange(10)) % 10
    assert np.abs(qft(f[x][:, y], side)[x][:, y] - qft(f, side)).max() < 1e-12


def test_parity_and_exchange_of_the_axes() -> None:
    f = quaternions(7, 10)
    for side in SIDES:
        assert np.abs(qft(mirrored(f, 0, 1), side) - mirrored(qft(f, side), 0, 1)).max() < 1e-12
    assert np.abs(qft(mirrored(f, 0)) - mirrored(qft(f), 0)).max() < 1e-12
    # Transposition exchanges the sides of the exponentials; conjugation restores them with opposite phases.
    conjugate = np.array([1, -1, -1, -1])
    expected = mirrored(qft(f * conjugate, axes=("j", "i")), 0, 1) * conjugate
    assert np.abs(qft(np.swapaxes(f, 0, 1)) - np.swapaxes(expected, 0, 1)).max() < 1e-12
    even = f + mirrored(f, 0) + mirrored(f, 1) + mirrored(f, 0, 1)
    assert np.abs(qft(even[..., 0])[..., 1:]).max() < 1e-13


@pytest.mark.parametrize("size", [(7, 9), (8, 6)])
def test_symmetry_of_real_images(size: tuple[int, int]) -> None:
    """``F(-u, v) = -j F j``, ``F(u, -v) = -i F i`` and so ``F(-u, -v) = -k F k``."""
    spectrum = qft(quaternions(*size)[..., 0])
    for axes, unit in (((0,), UNITS[2]), ((1,), UNITS[1]), ((0, 1), UNITS[3])):
        one = np.broadcast_to(unit, spectrum.shape)
        assert np.abs(mirrored(spectrum, *axes) + product(product(one, spectrum), one)).max() < 1e-12


def test_derivatives() -> None:
    """``i u F`` along x and ``F j v`` along y, for an image of few frequencies."""
    x, y = 2 * np.pi * np.arange(17)[:, None] / 17, 2 * np.pi * np.arange(16) / 16
    f, along, across = 0, 0, 0
    for amplitude, u, v in zip(quaternions(5), (1, 0, -3, 5, 2), (2, -4, 1, 0, 3), strict=True):
        f = f + np.cos(u * x + v * y)[..., None] * amplitude
        along = along - u * np.sin(u * x + v * y)[..., None] * amplitude
        across = across - v * np.sin(u * x + v * y)[..., None] * amplitude
    spectrum = qft(f)
    u, v = (np.fft.fftfreq(n, 1 / n) for n in (17, 16))
    left = product(np.broadcast_to(UNITS[1], spectrum.shape), spectrum) * u[:, None, None]
    right = product(spectrum, np.broadcast_to(UNITS[2], spectrum.shape)) * v[:, None]
    assert np.abs(iqft(left) - along).max() < 1e-12
    assert np.abs(iqft(right) - across).max() < 1e-12


@pytest.mark.parametrize("side", SIDES)
def test_scalar_products_are_preserved(side: str) -> None:
    f, g = quaternions(8, 9), quaternions(8, 9, seed=1)
    assert (qft(f, side, norm="ortho") * qft(g, side, norm="ortho")).sum() == pytest.approx((f * g).sum(), rel=1e-12)


def test_convolution_with_real_images() -> None:
    """Each part of the real image's spectrum acts on its own sides: ``CC F - SC i F - CS F j + SS i F j``."""
    f, h = quaternions(5, 6), quaternions(5, 6, seed=1)[..., 0]
    spectrum, other = qft(f), qft(h)
    i, j = np.broadcast_to(UNITS[1], f.shape), np.broadcast_to(UNITS[2], f.shape)
    left, right = product(i, spectrum), product(spectrum, j)
    terms = zip(np.moveaxis(other, -1, 0), (spectrum, left, right, product(left, j)), strict=True)
    expected = sum(weight[..., None] * term for weight, term in terms)
    found = qft(convolved(f, embedded(h)))
    assert np.abs(found - expected).max() < 1e-11
    assert np.abs(found - product(other, spectrum)).max() > 1


def test_convolution_of_quaternion_images() -> None:
    """Left transform: the part of F that commutes with i multiplies H, the other one H at the opposite frequency."""
    f, h = quaternions(5, 6), quaternions(5, 6, seed=1)
    spectrum, other = qft(f, "left"), qft(h, "left")
    along, across = spectrum * [1, 1, 0, 0], spectrum * [0, 0, 1, 1]
    expected = product(along, other) + product(across, mirrored(other, 0, 1))
    found = qft(convolved(f, h), "left")
    assert np.abs(found - expected).max() < 1e-11
    assert np.abs(found - product(spectrum, other)).max() > 1


def test_modulation_dilation_and_parity_in_space() -> None:
    f, by = field(3, 4, 5, 8), table(SPACE, {})
    x = [2 * np.pi * each / n for each, n in zip(np.indices((3, 4, 5)), (3, 4, 5), strict=True)]
    wave = times(f, turn(SPACE, "123", x[0] + 3 * x[1] + 2 * x[2]), by)
    assert np.abs(clifford_fft(wave) - np.roll(clifford_fft(f), (1, 3, 2), (0, 1, 2))).max() < 1e-12
    there = [(k * np.arange(n)) % n for k, n in ((2, 3), (3, 4), (2, 5))]
    back = [np.argsort(each) for each in there]
    dilated = clifford_fft(f[np.ix_(*there)])
    assert np.abs(dilated - clifford_fft(f)[np.ix_(*back)]).max() < 1e-12
    assert np.abs(clifford_fft(mirrored(f, 0, 1, 2)) - mirrored(clifford_fft(f), 0, 1, 2)).max() < 1e-12
    g = field(3, 4, 5, 8, seed=1)
    kept = (clifford_fft(f, norm="ortho") * clifford_fft(g, norm="ortho")).sum()
    assert kept == pytest.approx((f * g).sum(), rel=1e-12)


def test_symmetry_of_vector_fields() -> None:
    """The spectrum at -w is the reverse: the same vector, the opposite bivector."""
    f = field(4, 3, 5, 8) * [0, 1, 1, 1, 0, 0, 0, 0]
    spectrum = clifford_fft(f)
    reverse = np.array([1, 1, 1, 1, -1, -1, -1, -1])
    assert np.abs(mirrored(spectrum, 0, 1, 2) - spectrum * reverse).max() < 1e-12
    assert np.abs(spectrum[..., [0, 7]]).max() == 0


def test_derivative_in_the_plane() -> None:
    """The vector derivative from the left has the spectrum ``w F(-w) e12``: e12 anticommutes with vectors."""
    by, x = table(PLANE, {}), [2 * np.pi * each / n for each, n in zip(np.indices((9, 8)), (9, 8), strict=True)]
    f, derivative = 0, 0
    for amplitude, w in zip(field(4, 4), ([1, 2], [0, -3], [3, 1], [-2, 0]), strict=True):
        phase = w[0] * x[0] + w[1] * x[1]
        vector = np.array([0, *w, 0.0])
        f = f + np.cos(phase)[..., None] * amplitude
        derivative = derivative - np.sin(phase)[..., None] * times(vector, amplitude, by)
    u, v = np.meshgrid(np.fft.fftfreq(9, 1 / 9), np.fft.fftfreq(8, 1 / 8), indexing="ij")
    vectors = np.stack([0 * u, u, v, 0 * u], -1)
    expected = times(times(vectors, clifford_fft(f), by), np.eye(4)[3], by)
    assert np.abs(iclifford_fft(expected) - derivative).max() < 1e-12


def test_theorems_in_space_and_time() -> None:
    """Shifts and modulations, with time on the left and space on the right; scalar products."""
    f, by = field(3, 4, 2, 5, 16), table(SPACETIME, OPPOSITE_TIME)
    t, *x = [2 * np.pi * each / n for each, n in zip(np.indices(f.shape[:-1]), f.shape[:-1], strict=True)]
    spectrum = spacetime_fft(f)
    moved = spacetime_fft(np.roll(f, (1, 3, 1, 2), (0, 1, 2, 3)))
    left, right = turn(SPACETIME, "4", -t), turn(SPACETIME, "123", -(3 * x[0] + x[1] + 2 * x[2]))
    assert np.abs(moved - times(times(left, spectrum, by), right, by)).max() < 1e-12
    left, right = turn(SPACETIME, "4", 2 * t), turn(SPACETIME, "123", x[0] + x[1] + 3 * x[2])
    wave = spacetime_fft(times(times(left, f, by), right, by))
    assert np.abs(wave - np.roll(spectrum, (2, 1, 1, 3), (0, 1, 2, 3))).max() < 1e-12
    g = field(3, 4, 2, 5, 16, seed=1)
    kept = (spacetime_fft(f, "ortho") * spacetime_fft(g, "ortho")).sum()
    assert kept == pytest.approx((f * g).sum(), rel=1e-12)


def test_convolution_in_space_time_splits() -> None:
    """Real masks act on the two halves ``(f +- e4 f e123) / 2`` as complex numbers do, with opposite times."""
    f, h, by = field(3, 2, 3, 2, 16), field(3, 2, 3, 2, seed=1), table(SPACETIME, OPPOSITE_TIME)
    mask = np.zeros_like(f)
    mask[..., 0] = h
    e4, e123 = (np.eye(16)[SPACETIME.index(name)] for name in ("4", "123"))
    other = times(times(e4, f, by), e123, by)
    spectrum = np.fft.fftn(h)
    expected = 0
    for half, transfer in (((f + other) / 2, mirrored(spectrum, 0)), ((f - other) / 2, spectrum)):
        there = spacetime_fft(half)
        expected = expected + transfer.real[..., None] * there + transfer.imag[..., None] * times(there, e123, by)
    assert np.abs(spacetime_fft(periodic(f, mask, by)) - expected).max() < 1e-11
