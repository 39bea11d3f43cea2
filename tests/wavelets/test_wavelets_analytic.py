"""Analytic signals against closed forms and scipy's Hilbert transforms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.signal
from test_wavelets import exponential, product

from algorithms.wavelets import (
    analytic_signal,
    monogenic_signal,
    partial_analytic_signal,
    qft,
    quaternion_phase,
    quaternionic_analytic_signal,
    single_orthant_signal,
    total_analytic_signal,
)
from tests.support.all_cases import all_cases

SIZES = ((12, 10), (11, 9), (8, 13), (1, 5))


def normal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def hilbert(image: np.ndarray, axis: int) -> np.ndarray:
    return scipy.signal.hilbert(image, axis=axis).imag


def waves(shape: tuple[int, int], u: int, v: int) -> tuple[np.ndarray, np.ndarray]:
    return 2 * np.pi * u * np.arange(shape[0])[:, None] / shape[0], 2 * np.pi * v * np.arange(shape[1]) / shape[1]


@all_cases("axis", [0, 1, -1, 2])
def test_signals_equal_those_of_scipy(axis: int) -> None:
    x = normal(7, 12, 9)
    assert np.abs(analytic_signal(x, axis) - scipy.signal.hilbert(x, axis=axis)).max() < 1e-14
    single = analytic_signal(x.astype(np.float32), axis)
    assert single.dtype == np.complex64 and np.abs(single - analytic_signal(x, axis)).max() < 1e-5
    assert np.abs(analytic_signal(np.arange(9)) - scipy.signal.hilbert(np.arange(9.0))).max() < 1e-13


@all_cases("size", SIZES)
def test_images_by_hilbert_transforms_along_axes(size: tuple[int, int]) -> None:
    f = normal(*size)
    h1, h2 = hilbert(f, 0), hilbert(f, 1)
    both = hilbert(h1, 1)
    assert np.abs(total_analytic_signal(f) - (f + 1j * both)).max() < 1e-14
    assert np.abs(single_orthant_signal(f) - ((f - both) + 1j * (h1 + h2))).max() < 1e-14
    assert np.abs(quaternionic_analytic_signal(f) - np.stack([f, h1, h2, both], -1)).max() < 1e-14
    assert np.abs(partial_analytic_signal(f) - (f + 1j * h1)).max() < 1e-14
    assert np.abs(partial_analytic_signal(f, np.pi / 2) - (f + 1j * h2)).max() < 1e-14
    assert np.abs(partial_analytic_signal(f, np.pi) - (f - 1j * h1)).max() < 1e-14
    if all(n % 2 for n in size) and min(size) > 1:
        assert np.abs(single_orthant_signal(f) - scipy.signal.hilbert2(f)).max() < 1e-14


def test_waves() -> None:
    """``cos(a) cos(b)`` gives ``exp(i a) exp(j b)``; of a plane wave the half plane of the direction is kept."""
    a, b = waves((16, 21), 3, 5)
    q = quaternionic_analytic_signal(np.cos(a) * np.cos(b))
    assert np.abs(q - product(exponential("i", a + 0 * b), exponential("j", b + 0 * a))).max() < 1e-14
    phase = quaternion_phase(q)
    assert np.abs(phase.amplitude - 1).max() < 1e-14 and np.abs(phase.psi).max() < 1e-13
    wave = np.cos(a - b)
    assert np.abs(quaternion_phase(quaternionic_analytic_signal(wave)).psi - np.pi / 4).max() < 1e-7
    assert np.abs(partial_analytic_signal(wave, -0.3) - np.exp(1j * (a - b))).max() < 1e-13
    assert np.abs(partial_analytic_signal(wave, 2.5) - np.exp(1j * (b - a))).max() < 1e-13
    across = np.arctan2(3 / 16, 5 / 21)
    assert np.abs(partial_analytic_signal(np.cos(a - b), across) - wave).max() < 1e-13
    assert np.abs(single_orthant_signal(wave)).max() < 1e-13
    assert np.abs(single_orthant_signal(np.cos(a + b)) - 2 * np.exp(1j * (a + b))).max() < 1e-13
    assert (
        np.abs(
            total_analytic_signal(np.cos(a) * np.cos(b)) - (np.cos(a) * np.cos(b) + 1j * np.sin(a) * np.sin(b))
        ).max()
        < 1e-14
    )


@pytest.mark.parametrize("size", [(11, 9), (12, 10)])
def test_the_quaternionic_spectrum_is_in_one_quadrant(size: tuple[int, int]) -> None:
    f = normal(*size)
    signs = [np.sign(np.fft.fftfreq(n)) * (np.fft.fftfreq(n) != -0.5) for n in size]
    expected = qft(f) * ((1 + signs[0])[:, None] * (1 + signs[1]))[..., None]
    assert np.abs(qft(quaternionic_analytic_signal(f)) - expected).max() < 1e-12


@pytest.mark.parametrize("size", [(16, 21), (15, 12)])
def test_monogenic_signal_of_waves(size: tuple[int, int]) -> None:
    """A wave ``A cos(p)`` has amplitude A, phase p up to its sign, and the direction of its frequency."""
    a, b = waves(size, 3, -2)
    wave = 0.7 * np.cos(a + b + 0.4)
    found = monogenic_signal(wave)
    direction = np.array([3 / size[0], -2 / size[1]])
    direction /= np.hypot(*direction)
    sine = 0.7 * np.sin(a + b + 0.4)
    expected = np.stack([sine * direction[0], sine * direction[1], wave], -1)
    assert np.abs(found.vector - expected).max() < 1e-14
    assert np.abs(found.amplitude - 0.7).max() < 1e-14
    assert np.abs(np.cos(found.phase) - np.cos(a + b + 0.4)).max() < 1e-13
    turned = np.cos(2 * (found.orientation - np.arctan2(direction[1], direction[0])))
    assert np.abs(turned - 1)[np.abs(sine) > 1e-3].max() < 1e-12


def test_riesz_transforms_preserve_energy_and_are_equivariant() -> None:
    f = normal(9, 9)
    f -= f.mean()
    found = monogenic_signal(f).vector
    assert (found[..., :2] ** 2).sum() == pytest.approx((f**2).sum(), rel=1e-13)
    turned = monogenic_signal(np.rot90(f)).vector
    there = np.rot90(found)
    assert np.abs(turned[..., 2] - there[..., 2]).max() < 1e-14
    assert np.abs(turned[..., 0] + there[..., 1]).max() < 1e-14
    assert np.abs(turned[..., 1] - there[..., 0]).max() < 1e-14


@all_cases(
    "function",
    [
        total_analytic_signal,
        partial_analytic_signal,
        single_orthant_signal,
        quaternionic_analytic_signal,
        lambda f, workers=None: monogenic_signal(f, workers).vector,
    ],
)
def test_stacks_and_types(function: Any) -> None:
    stack = normal(2, 3, 8, 7)
    found = function(stack, workers=2)
    assert np.abs(found[1, 2] - function(stack[1, 2])).max() < 1e-14
    single = function(stack.astype(np.float32))
    assert single.real.dtype == np.float32 and np.abs(single - found).max() < 1e-5
    assert np.array_equal(function(np.arange(12).reshape(3, 4)), function(np.arange(12.0).reshape(3, 4)))


@all_cases(
    "call, message",
    [
        (lambda f: analytic_signal(f, 2), "axis: 2; expected an axis of an array of 2"),
        (lambda f: analytic_signal(f * np.nan), "signal: a number is not finite"),
        (lambda f: analytic_signal(f[0, 0]), "signal: shape"),
        (lambda f: partial_analytic_signal(f, np.inf), "angle: inf; expected a finite number"),
        (lambda f: monogenic_signal(f[0]), "image: shape .*images M N"),
        (lambda f: total_analytic_signal(f[:0]), "expected no empty axis"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(normal(4, 5))
