"""Continuous wavelets of signals against closed forms, direct sums and PyWavelets."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
import scipy.integrate

from algorithms.wavelets import admissibility, continuous_wavelet
from tests.support.all_cases import all_cases

NAMES = ("mexican_hat", "morlet", "analytic_morlet")
DERIVATIVES = [f"{family}{order}" for family in ("gaus", "cgau") for order in range(1, 9)]
OTHERS = (*DERIVATIVES, "cmor1.5-1.0", "cmor4-.7", "shan1.5-1.0", "fbsp2-1.5-1.0", "fbsp3-1-0.8")


def normal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def wavelet(name: str, t: np.ndarray) -> np.ndarray:
    if found := re.fullmatch("(c?)gau(?:s?)([1-8])", name):
        # The derivatives of exp(-t**2), also about -i / 2, are Hermite polynomials times it, by Rodrigues' formula.
        order, z = int(found[2]), t + 0.5j * bool(found[1])
        fine = np.linspace(-12, 12, 5001) + 0.5j * bool(found[1])
        psi, all_psi = (np.polynomial.Hermite.basis(order)(x) * np.exp(-(x**2)) for x in (z, fine))
        psi = psi / np.sqrt((np.abs(all_psi) ** 2).sum() * 24 / 5000)
        return (-1) ** order * psi if found[1] else ((-1) ** (order + order // 2) * psi).real
    if found := re.fullmatch(r"([a-z]+)(?:(\d)-)?([0-9.]+)-([0-9.]+)", name):
        order, width, wave = int(found[2] or 1), float(found[3]), np.exp(2j * np.pi * float(found[4]) * t)
        if found[1] == "cmor":
            return wave * np.exp(-(t**2) / width) / np.sqrt(np.pi * width)
        return wave * np.sqrt(width) * np.sinc(width * t / order) ** order
    if name == "mexican_hat":
        return 2 / (np.sqrt(3) * np.pi**0.25) * (1 - t**2) * np.exp(-(t**2) / 2)
    return np.cos(5 * t) * np.exp(-(t**2) / 2)


@all_cases("mode", ["zero", "periodic"])
@all_cases("name", ["mexican_hat", "morlet"])
def test_direct_sums(name: str, mode: str) -> None:
    x, scales = normal(75), (4.0, 5.5)
    found = continuous_wavelet(x, scales, name, mode).coefficients
    places = np.arange(75)
    for a, row in zip(scales, found, strict=True):
        for b in (0, 3, 40, 74):
            if mode == "zero":
                expected = (x * wavelet(name, (places - b) / a)).sum()
            else:
                expected = sum((x * wavelet(name, (places + 75 * k - b) / a)).sum() for k in range(-3, 4))
            assert row[b] == pytest.approx(expected / np.sqrt(a), abs=1e-10 if name == "morlet" else 1e-12)


@all_cases("mode", ["zero", "periodic"])
@all_cases("name", OTHERS)
def test_direct_sums_of_derivatives_and_complex_wavelets(name: str, mode: str) -> None:
    """In periodic sums of wavelets that decay as t**-M, terms of opposite sign cancel slowly."""
    is_slow = name[:4] in ("shan", "fbsp")
    if is_slow and mode == "periodic" and not name.startswith("fbsp3"):
        return  # the sum over all periods converges too slowly to be added
    x, scales, turns = normal(60), (6.0, 9.5), range(-60, 61)
    found = continuous_wavelet(x, scales, name, mode).coefficients
    assert np.iscomplexobj(found) == (not name.startswith("gaus"))
    places = np.arange(60)
    for a, row in zip(scales, found, strict=True):
        for b in (0, 7, 59):
            shifts = [0] if mode == "zero" else turns if is_slow else range(-3, 4)
            expected = sum((x * wavelet(name, (places + 60 * k - b) / a).conj()).sum() for k in shifts)
            assert abs(row[b] - expected / np.sqrt(a)) < (1e-4 if len(shifts) > 10 else 1e-11)


def test_bands_of_shannon_wavelets() -> None:
    """A wave within the band, of 10 to 40 cycles, is kept, with a height that follows from the spectrum."""
    t = np.arange(240)
    for cycles, height in ((9, 0), (11, np.sqrt(2)), (39, np.sqrt(2)), (41, 0)):
        found = continuous_wavelet(np.cos(2 * np.pi * cycles / 240 * t), [8.0], "shan1-0.8333333", "periodic")
        expected = height * np.exp(2j * np.pi * cycles / 240 * t)
        assert np.abs(found.coefficients - expected).max() < 1e-12


def test_mexican_hat_of_a_gaussian() -> None:
    """The result is a Mexican hat whose squared width is the sum of the squared widths."""
    x, s = np.arange(-150.0, 151), 6.0
    scales = np.array([2.0, 5.0, 11.0])
    found = continuous_wavelet(np.exp(-(x**2) / (2 * s * s)), scales, "mexican_hat").coefficients
    width = np.hypot(s, scales)[:, None]
    height = s * np.sqrt(8 / 3) * np.pi**0.25 * scales[:, None] ** 2.5 / width**3
    expected = height * (1 - (x / width) ** 2) * np.exp(-((x / width) ** 2) / 2)
    assert np.abs(found - expected).max() < 1e-12


def test_a_ridge_is_at_the_frequency() -> None:
    t = np.arange(1024.0)
    scales = np.geomspace(5, 60, 200)
    chirp = np.cos(0.1 * t + 0.2e-3 * t**2)
    size = np.abs(continuous_wavelet(chirp, scales, "analytic_morlet").coefficients) / np.sqrt(scales)[:, None]
    frequency = 5 / scales[size.argmax(0)]
    assert np.abs(frequency / (0.1 + 0.4e-3 * t) - 1)[150:-150].max() < 0.02
    assert np.abs(size.max(0)[150:-150] / np.sqrt(np.pi / 2) - 1).max() < 0.04  # the chirp blurs the ridge


@pytest.mark.parametrize("name", NAMES)
def test_energy_and_admissibility(name: str) -> None:
    if name != "analytic_morlet":
        spectrum = {
            "mexican_hat": lambda w: np.sqrt(8 / 3) * np.pi**0.25 * w**2 * np.exp(-(w**2) / 2),
            "morlet": lambda w: np.sqrt(np.pi / 2) * (np.exp(-((w - 5) ** 2) / 2) + np.exp(-((w + 5) ** 2) / 2)),
        }[name]
        # In the logarithm of w: Morlet's wavelet has a sum of 1e-5, and its integral diverges slowly.
        integral = scipy.integrate.quad(lambda s: spectrum(np.exp(s)) ** 2, -40, 3, points=(0, 1.6), limit=500)
        truth = 2 * integral[0]
        assert admissibility(name) == pytest.approx(truth, rel=1e-9)
    rng = np.random.default_rng(2)
    t = np.arange(1024)
    x = sum(np.cos(2 * np.pi * k * t / 1024 + rng.uniform(0, 6)) for k in (9, 23, 57, 80))
    step = 1.03
    scales = 0.3 * step ** np.arange(280)
    found = continuous_wavelet(x, scales, name, "periodic").coefficients
    energy = ((np.abs(found) ** 2).sum(-1) / scales).sum() * np.log(step)
    assert energy / (x**2).sum() == pytest.approx(admissibility(name) / 2, rel=0.01)


@all_cases("name", ["gaus3", "cgau2", "cmor2-1", "fbsp2-1-1", "shan1-1"])
def test_admissibility_of_other_wavelets(name: str) -> None:
    """From samples of the wavelet in time, by the discrete Fourier transform."""
    step, count = 0.02, 2**16
    t = (np.arange(count) - count // 2) * step
    spectrum = np.abs(np.fft.fft(wavelet(name, t))) * step
    w = np.abs(2 * np.pi * np.fft.fftfreq(count, step))
    expected = (spectrum[1:] ** 2 / w[1:]).sum() * w[1]
    assert admissibility(name) == pytest.approx(expected, rel=5e-3)


@all_cases("name", [*NAMES, "gaus1", "gaus4", "cgau3", "cmor1.5-1.0", "fbsp2-1.5-1.0"])
@all_cases("mode", ["zero", "periodic"])
def test_inverse_on_the_covered_frequencies(name: str, mode: str) -> None:
    for size in (256, 255):
        x = normal(2, size)
        transform = continuous_wavelet(x, np.geomspace(0.9, 50, 40), name, mode)
        length = transform.padded.shape[-1]
        spectrum = np.fft.fft(x, length) * transform.covered
        expected = np.fft.ifft(spectrum).real[:, :size]
        assert np.abs(transform.inverse() - expected).max() < 1e-10
        if name[:4] in (*(each[:4] for each in NAMES), "gaus"):
            assert not transform.covered[0] and transform.covered.mean() > 0.95
        band = x - x.mean(-1, keepdims=True)
        if name == "mexican_hat" and mode == "periodic":
            assert np.abs(transform.inverse() - band).max() < 1e-10
    half = continuous_wavelet(x.astype(np.float32), [2.0, 4.0], name, mode)
    assert half.padded.real.dtype == half.inverse().dtype == np.float32


@pytest.mark.parametrize("name", ["mexican_hat", "morlet"])
def test_changed_coefficients_affect_the_inverse(name: str) -> None:
    transform = continuous_wavelet(normal(128), np.geomspace(1, 20, 20), name)
    before = transform.inverse()
    transform.coefficients[...] *= 0.5
    transform.padded[..., 128:] *= 0.5
    assert np.abs(transform.inverse() - before / 2).max() < 1e-12


@pytest.mark.parametrize(("name", "peer"), [("mexican_hat", "mexh"), ("morlet", "morl")])
def test_coefficients_equal_those_of_pywavelets(name: str, peer: str) -> None:
    """PyWavelets averages over a sample and is delayed by half a sample; the signal is modified accordingly."""
    pywt = pytest.importorskip("pywt")
    x = np.zeros(1024)
    x[250:-250] = normal(524)
    w = 2 * np.pi * np.fft.fftfreq(1024)
    late = np.fft.ifft(np.fft.fft(x) * np.sinc(w / (2 * np.pi)) * np.exp(-0.5j * w)).real
    scales = [4.0, 9.0, 17.0]
    found = continuous_wavelet(late, scales, name, "periodic").coefficients
    expected = pywt.cwt(x, scales, peer, method="fft", precision=16)[0]
    assert (np.abs(found - expected).max(-1) < 2e-3 * np.abs(expected).max(-1)).all()


@all_cases(
    "call, message",
    [
        (lambda x: continuous_wavelet(x, [1.0], "haar"), "wavelet: 'haar'; expected 'mexican_hat', 'morlet'"),
        (lambda x: continuous_wavelet(x, [1.0], "gaus9"), "wavelet: 'gaus9'"),
        (lambda x: continuous_wavelet(x, [1.0], "cmor0-1"), "wavelet: 'cmor0-1'; .*'cmorB-C'"),
        (lambda x: continuous_wavelet(x, [1.0], "cmor"), "wavelet: 'cmor'; .* as in 'cmor1.5-1.0'"),
        (lambda x: continuous_wavelet(x, [1.0], "fbsp0-1-1"), "wavelet: 'fbsp0-1-1'"),
        (lambda x: admissibility("shan2-1"), "'shan2-1', whose constant is infinite"),
        (lambda x: continuous_wavelet(x, [1.0], mode="full"), "mode: 'full'; expected 'zero' or 'periodic'"),
        (lambda x: continuous_wavelet(x, []), "expected at least one number"),
        (lambda x: continuous_wavelet(x, [1.0, -2.0]), "scales: .*all positive"),
        (lambda x: continuous_wavelet(x, [np.nan]), "scales: nan; expected a finite number"),
        (lambda x: continuous_wavelet(x * np.nan, [1.0]), "signal: a number is not finite"),
        (lambda x: continuous_wavelet(x[:0], [1.0]), "no empty axis"),
        (lambda x: continuous_wavelet(x[0], [1.0]), "signal: shape"),
        (lambda x: admissibility("haar"), "wavelet: 'haar'"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(normal(20))
