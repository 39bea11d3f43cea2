"""Phases of quaternions, Gabor filters and quaternionic pyramids against closed forms, skimage and dtcwt's numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_wavelets import exponential, product

from algorithms.wavelets import QuaternionPyramid, complex_gabor_bank, dual_tree, gabor_bank, qft, quaternion_phase
from tests.support.all_cases import all_cases

KNOWN = Path(__file__).parents[1] / "support" / "golden" / "dtcwt.npz"


def normal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def recomposed(phase: Any) -> np.ndarray:
    turns = [exponential(axis, angle) for axis, angle in (("i", phase.phi), ("k", phase.psi), ("j", phase.theta))]
    return phase.amplitude[..., None] * product(product(turns[0], turns[1]), turns[2])


def test_phases_reconstruct_the_quaternion() -> None:
    q = normal(20000, 4) * 10 ** normal(20000, 1, seed=1)
    phase = quaternion_phase(q)
    size = np.linalg.norm(q, axis=-1)
    assert (np.abs(recomposed(phase) - q).max(-1) < 4e-15 * size).all()
    assert np.abs(phase.amplitude / size - 1).max() < 1e-15
    for angle, bound in ((phase.phi, np.pi), (phase.theta, np.pi / 2), (phase.psi, np.pi / 4)):
        assert 0.99 * bound < np.abs(angle).max() <= bound
    assert not phase.singular.any()


def test_phases_are_recovered() -> None:
    rng = np.random.default_rng(3)
    phi, theta, psi = rng.uniform(-1, 1, (3, 5000)) * np.array([np.pi, np.pi / 2, 0.24 * np.pi])[:, None]
    q = product(product(exponential("i", phi), exponential("k", psi)), exponential("j", theta))
    found = quaternion_phase(q)
    for one, other in ((found.phi, phi), (found.theta, theta), (found.psi, psi)):
        assert np.abs(one - other).max() < 1e-13


def test_singular_set() -> None:
    """At psi = pi/4 only the difference of phi and theta is determined, at -pi/4 the sum; q is recovered near both."""
    phi, theta = np.random.default_rng(4).uniform(-np.pi / 2, np.pi / 2, (2, 1000))
    for psi in (np.pi / 4, -np.pi / 4):
        for distance in (0.0, 1e-12, 1e-8, 1e-4):
            angle = psi * (1 - distance)
            q = product(product(exponential("i", phi), exponential("k", angle + 0 * phi)), exponential("j", theta))
            found = quaternion_phase(q)
            assert np.abs(recomposed(found) - q).max() < 2e-15
            assert found.singular.all() if distance == 0 else not (found.singular & (distance > 1e-10)).any()
            together = np.exp(1j * (found.phi - np.sign(psi) * found.theta - phi + np.sign(psi) * theta))
            assert np.abs(together - 1).max() < 1e-14
    zero = quaternion_phase(np.zeros(4))
    assert not any(np.any(part) for part in zero)


def test_phases_follow_a_shift() -> None:
    """In the spectrum of a real image, phi and theta change by ``-2 pi u a / M`` and ``-2 pi v b / N``, psi by 0."""
    image, (a, b) = normal(16, 20), (3, 5)
    before, after = quaternion_phase(qft(image)), quaternion_phase(qft(np.roll(image, (a, b), (0, 1))))
    u, v = np.arange(16)[:, None] / 16, np.arange(20)[None] / 20
    regular = np.cos(2 * before.psi) > 1e-3
    regular[[0, 8]], regular[:, [0, 10]] = False, False
    for one, other, shift in ((before.phi, after.phi, u * a), (before.theta, after.theta, v * b)):
        # Both angles together have the period pi.
        turn = np.exp(2j * (other - one + 2 * np.pi * shift))
        assert np.abs(turn - 1)[regular].max() < 1e-9
    assert np.abs(after.psi - before.psi)[regular].max() < 1e-11


def test_gabor_filters_equal_those_of_skimage() -> None:
    filters = pytest.importorskip("skimage.filters")
    impulse = np.zeros((65, 65))
    impulse[32, 32] = 1
    for u, v, sigma in ((0.1, 0.2, 3.0), (0.0, 0.15, 4.0), (0.3, 0.05, 2.0)):
        w, x, y, z = np.moveaxis(gabor_bank(impulse, [(u, v)], sigma)[0], -1, 0)
        for sign, found in ((1, (w - z) + 1j * (x + y)), (-1, (w + z) + 1j * (x - y))):
            frequency, angle = np.hypot(u, v), np.arctan2(u, sign * v)
            kernel = filters.gabor_kernel(frequency, angle, sigma_x=sigma, sigma_y=sigma, n_stds=4)
            kernel = kernel if sign > 0 else kernel.conj()
            rows, columns = kernel.shape
            part = np.zeros((65, 65), complex)
            part[32 - rows // 2 : 33 + rows // 2, 32 - columns // 2 : 33 + columns // 2] = kernel
            found = found if sign > 0 else found.conj()
            inside = np.abs(part) > 0
            # skimage's window is turned and its Gaussian has the norm of the whole plane.
            assert np.abs(found - part)[inside].max() < 2e-4 * np.abs(part).max()


def test_transfer_function_of_a_gabor_filter() -> None:
    """A Gaussian around the frequency, with no imaginary parts."""
    impulse = np.zeros((64, 64))
    impulse[32, 32] = 1
    sigma, u, v = 4.0, 9 / 64, 14 / 64
    spectrum = qft(np.roll(gabor_bank(impulse, [(u, v)], sigma)[0], (-32, -32), (0, 1)))
    f = np.fft.fftfreq(64)
    rows, columns = (np.exp(-2 * np.pi**2 * sigma**2 * (f - w) ** 2) for w in (u, v))
    assert np.abs(spectrum[..., 0] - rows[:, None] * columns).max() < 2e-3
    assert np.abs(spectrum[..., 1:]).max() < 1e-14


@pytest.mark.parametrize(("truncate", "error"), [(4.0, 2e-4), (5.5, 2e-7), (6.0, 1e-8)])
def test_truncation_of_gabor_filters(truncate: float, error: float) -> None:
    """The spectrum of the filter is the Gaussian with its two widths, up to truncation."""
    impulse = np.zeros((100, 100))
    impulse[50, 50] = 1
    sigma, aspect, u, v = 6.0, 1.5, 12 / 100, 20 / 100
    bands = gabor_bank(impulse, [(u, v)], sigma, aspect=aspect, truncate=truncate)[0]
    spectrum = qft(np.roll(bands, (-50, -50), (0, 1)))
    f = np.fft.fftfreq(100)
    rows, columns = (np.exp(-2 * np.pi**2 * width**2 * (f - w) ** 2) for w, width in ((u, sigma), (v, sigma / aspect)))
    found = np.abs(spectrum[..., 0] - rows[:, None] * columns).max()
    assert error / 100 < found < error and np.abs(spectrum[..., 1:]).max() < 1e-14
    complex_band = complex_gabor_bank(impulse, [(u, v)], sigma, aspect, truncate=truncate)[0]
    w, x, y, z = np.moveaxis(bands, -1, 0)
    assert np.abs(complex_band - ((w - z) + 1j * (x + y))).max() < 1e-16


def test_bank_options() -> None:
    image = normal(3, 30, 40) + 100
    both = gabor_bank(image, [(0.1, 0.2), (0.25, 0.0)], (3.0, 2.0), balanced=True)
    assert both.shape == (3, 2, 30, 40, 4)
    assert np.abs(both[1, 1] - gabor_bank(image[1], [(0.25, 0.0)], 2.0, balanced=True)[0]).max() < 1e-13
    assert np.abs(gabor_bank(np.full((30, 40), 7.0), [(0.1, 0.2)], balanced=True)).max() < 1e-13
    assert gabor_bank(image.astype(np.float32), [(0.1, 0.2)]).dtype == np.float32


@pytest.mark.parametrize("kind", ["dual-tree", "gabor"])
@pytest.mark.parametrize("size", [(26, 19), (2, 17, 20)])
def test_pyramids_are_invertible(kind: str, size: tuple[int, ...]) -> None:
    image = normal(*size)
    for levels in (0, 2):
        pyramid = QuaternionPyramid(image, levels, kind)
        assert len(pyramid.detail) == levels
        assert np.abs(pyramid.inverse() - image).max() < (1e-13 if kind == "dual-tree" else 1e-9)
        if levels and len(size) == 3:
            one = QuaternionPyramid(image[1], levels, kind)
            assert np.abs(pyramid.detail[0]["D"][1] - one.detail[0]["D"]).max() < 1e-14
    half = QuaternionPyramid(image.astype(np.float32), 2, "dual-tree")
    assert half.inverse().dtype == half.detail[0]["H"].dtype == np.float32


def test_quaternions_of_the_dual_tree_equal_its_six_bands() -> None:
    """Chan's map: with ``P = (z1 + z2) / 2`` and ``Q = (z2 - z1) / 2``, here with i for rows and j for columns."""
    with np.load(KNOWN) as known:
        image = known["image"]
        six = [known[f"near_sym_b qshift_b {level}"] for level in range(3)]
    pyramid = QuaternionPyramid(image, 3)
    for level in range(3):
        for name, pair in (("H", (0, 5)), ("V", (2, 3)), ("D", (1, 4))):
            one, two = (six[level][..., k] for k in pair)
            p, q = (one + two) / 2, (two - one) / 2
            expected = np.sqrt(2) * np.stack([p.real, -q.imag, p.imag, q.real], -1)
            assert np.abs(pyramid.detail[level][name] - expected).max() < 1e-14


def test_amplitudes_and_phases() -> None:
    image = normal(32, 40)
    pyramid = QuaternionPyramid(image, 2)
    for level, (sizes, phases) in enumerate(zip(pyramid.amplitude(), pyramid.phases(), strict=True)):
        for name in "HVD":
            q = pyramid.detail[level][name]
            assert np.abs(sizes[name] - np.linalg.norm(q, axis=-1)).max() < 1e-14
            phi, theta, psi = np.moveaxis(phases[name], -1, 0)
            again = product(product(exponential("i", phi), exponential("k", psi)), exponential("j", theta))
            assert np.abs(sizes[name][..., None] * again - q).max() < 1e-14


@all_cases("axis", [0, 1])
@all_cases("kind", ["dual-tree", "gabor"])
def test_phases_of_waves_follow_a_small_shift(kind: str, axis: int) -> None:
    """The phase of the second level's wave changes by frequency times shift: phi along x, theta along y."""
    frequency = 2 * np.pi * 19 / 128 if kind == "dual-tree" else 2 * np.pi * 18 / 128
    t = np.arange(128.0)
    changes = []
    for shift in (0.0, 0.25):
        image = np.cos(frequency * (t - shift))[:, None] * np.ones(128)
        pyramid = QuaternionPyramid(image if axis == 0 else image.T, 3, kind)
        changes.append(pyramid.phases()[1]["H" if axis == 0 else "V"][6:-6, 6:-6, axis])
    change = np.abs((np.diff(changes, axis=0) + np.pi / 2) % np.pi - np.pi / 2)
    assert np.abs(change / (frequency * 0.25) - 1).mean() < (0.03 if kind == "dual-tree" else 0.05)


@all_cases(
    "call, message",
    [
        (lambda x: QuaternionPyramid(x, 6), "levels: 6; expected at most 5, as images of 40 x 50 pixels have"),
        (lambda x: QuaternionPyramid(x, kind="haar"), "kind: 'haar'; expected 'dual-tree' or 'gabor'"),
        (lambda x: QuaternionPyramid(x[0]), "image: shape .* images M N"),
        (lambda x: QuaternionPyramid(x * np.nan), "image: a number is not finite"),
        (lambda x: gabor_bank(x, [(0.6, 0.0)]), "frequencies: 0.6; expected cycles per pixel from 0 to 0.5"),
        (lambda x: gabor_bank(x, [(0.1, 0.0)], -1.0), "sigma: -1.0; expected a positive number"),
        (lambda x: gabor_bank(x, [(0.1, 0.0)], (1.0, 2.0)), "sigma: 2 for 1 frequencies"),
        (lambda x: gabor_bank(x * np.nan, [(0.1, 0.0)]), "image: a number is not finite"),
        (lambda x: quaternion_phase(x), r"q: shape \(40, 50\); expected \(..., 4\), quaternions"),
        (lambda x: dual_tree(x[:0]), "no empty axis"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(normal(40, 50))
