"""Thresholds, shrinking and denoising against closed forms, Stein's estimate, and truth that is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.integrate

from algorithms.wavelets import (
    bayes_threshold,
    denoise_wavelet,
    noise_deviation,
    shrink,
    sure_threshold,
    universal_threshold,
)
from algorithms.wavelets.shrinkage import _gains
from tests.support.all_cases import all_cases

NUMBERS = np.array([-3.0, -1, -0.5, 0, 0.5, 1.5, 2, 8])


def test_kinds_of_shrinking() -> None:
    assert np.array_equal(shrink(NUMBERS, 1), [-2, 0, 0, 0, 0, 0.5, 1, 7])
    assert np.array_equal(shrink(NUMBERS, 1, "hard"), [-3, 0, 0, 0, 0, 1.5, 2, 8])
    assert shrink(NUMBERS, 1, "garrote") == pytest.approx(np.array([-8 / 3, 0, 0, 0, 0, 5 / 6, 1.5, 63 / 8]))
    assert shrink(NUMBERS, 1, "firm", 2) == pytest.approx(np.array([-3, 0, 0, 0, 0, 1, 2, 8]))
    assert np.array_equal(shrink(NUMBERS, 1, "firm", 1), shrink(NUMBERS, 1, "hard"))
    assert np.array_equal(shrink(NUMBERS, 0), NUMBERS)


@all_cases("kind, upper", [("soft", None), ("hard", None), ("garrote", None), ("firm", 2.5)])
def test_phases_and_types_are_kept(kind: str, upper: float | None) -> None:
    turned = NUMBERS * np.exp(0.7j)
    expected = shrink(NUMBERS, 1.2, kind, upper) * np.exp(0.7j)
    assert shrink(turned, 1.2, kind, upper) == pytest.approx(expected, abs=1e-15)
    for dtype in (np.float32, np.complex64):
        assert shrink(NUMBERS.astype(dtype), 1.2, kind, upper).dtype == dtype
    rows = shrink(np.stack([NUMBERS, NUMBERS]), [[0.0], [9.0]], kind, 9.5 if upper else None)
    assert np.abs(rows[1]).max() == 0 and np.abs(rows[0]).max() == pytest.approx(8, rel=0.1)


def test_sure_has_the_least_estimate_of_all() -> None:
    """Stein's estimate, written out, at a fine grid of thresholds."""
    rng = np.random.default_rng(1)
    values = rng.normal(size=400) * 0.5 + np.where(rng.random(400) < 0.3, 4.0, 0)
    found = sure_threshold(values, 0.5)

    def risk(t: float) -> float:
        small = np.abs(values) <= t
        return 0.25 * (400 - 2 * small.sum()) + np.minimum(np.abs(values), t).__pow__(2).sum()

    grid = np.linspace(0, universal_threshold(400, 0.5), 5000)
    assert risk(found) <= min(map(risk, grid)) + 1e-9
    assert 0 < found < universal_threshold(400, 0.5)


def test_sure_of_noise_is_universal() -> None:
    noise = np.random.default_rng(2).normal(size=1000)
    assert sure_threshold(noise) == universal_threshold(1000)
    assert universal_threshold(1000, 2.0) == pytest.approx(2 * np.sqrt(2 * np.log(1000)))
    assert universal_threshold(1) == 0


def test_bayes_threshold() -> None:
    """For normal coefficients of variance 4 with noise of variance 1, the threshold is 1 / 2."""
    values = np.random.default_rng(3).normal(size=200000) * np.sqrt(5)
    assert bayes_threshold(values) == pytest.approx(0.5, rel=0.01)
    assert bayes_threshold(0.1 * values) == np.abs(0.1 * values).max()
    assert bayes_threshold(values, 0) == bayes_threshold(np.zeros(4)) == sure_threshold(values, 0) == 0
    assert bayes_threshold(values * 1e200, 1e200) == pytest.approx(0.5e200, rel=0.01)


def test_deviation_of_noise() -> None:
    """The median of absolute normal numbers, by its integral, and a tenth of the coefficients from a signal."""
    noise = np.random.default_rng(4).normal(size=100001) * 3
    assert noise_deviation(noise) == pytest.approx(3, rel=0.01)
    noise[:10000] = 1e6
    assert noise_deviation(noise) == pytest.approx(3.4, rel=0.05)
    half = scipy.integrate.quad(lambda x: np.exp(-x * x / 2) / np.sqrt(2 * np.pi), 0, 1 / noise_deviation([1.0]))[0]
    assert half == pytest.approx(0.25)


@pytest.mark.parametrize("name", ["db3", "bior4.4", "rbio3.3"])
def test_gains_are_deviations_of_noise(name: str) -> None:
    """White noise of variance 1 has these deviations, from the spectra of the filters."""
    from algorithms.wavelets import wavelet_filters

    filters, w = wavelet_filters(name), np.linspace(0, 2 * np.pi, 4096, endpoint=False)
    low, high = (np.abs(np.polyval(taps, np.exp(1j * w))) ** 2 for taps in (filters.low, filters.high))
    every = np.arange(4096)
    power = np.ones(4096)
    for level, norms in enumerate(_gains(name, 3, 2)):
        at = every * 2**level % 4096
        a, d = (power * low[at]).mean(), (power * high[at]).mean()
        assert norms == pytest.approx({"H": np.sqrt(d * a), "V": np.sqrt(a * d), "D": d})
        power = power * low[at]


def steps(count: int) -> np.ndarray:
    t = np.arange(count) / count
    return 4 * np.sin(4 * np.pi * t) - np.sign(t - 0.3) - np.sign(0.72 - t)


@all_cases("rule", ["bayes", "sure", "visu"])
@all_cases("name", ["sym6", "bior4.4"])
def test_denoising_reduces_the_error(rule: str, name: str) -> None:
    """Donoho and Johnstone's HeaviSine with noise of 0.4: the error is less than half of it, and less with shifts."""
    clean = steps(1000)
    noisy = clean + 0.4 * np.random.default_rng(5).normal(size=1000)

    def error(**options: Any) -> float:
        return float(np.sqrt(((denoise_wavelet(noisy, name, rule=rule, **options) - clean) ** 2).mean()))

    assert error() < 0.2
    assert error(is_stationary=True) < error()
    assert error(sigma=0.4) == pytest.approx(error(), rel=0.15)
    assert error(kind="garrote") < 0.2


def test_denoising_of_pure_noise_and_of_clean_signals() -> None:
    noise = np.random.default_rng(6).normal(size=(64, 64))
    assert np.abs(denoise_wavelet(noise, "sym4", 3, "visu")).std() < 0.15
    clean = steps(300)
    assert np.abs(denoise_wavelet(clean, sigma=0) - clean).max() < 1e-13
    assert np.abs(denoise_wavelet(np.full(50, 7.0)) - 7).max() < 1e-13
    assert denoise_wavelet(np.ones((40, 40), np.float32)).dtype == np.float32
    single = np.array([3.0])
    result = denoise_wavelet(single)
    assert result == 3 and not np.shares_memory(result, single)
    volume = np.random.default_rng(7).normal(size=(16, 17, 18))
    assert denoise_wavelet(volume, "haar", axes=(0, 1, 2)).std() < 0.6


@all_cases(
    "call, message",
    [
        (lambda x: shrink(x, -1), "threshold: -1.0; expected finite numbers, 0 or more"),
        (lambda x: shrink(x, np.nan), "threshold: nan; expected"),
        (lambda x: shrink(x * np.inf, 1), "coefficients: a number is not finite"),
        (lambda x: shrink(x, 1, "half"), "kind: 'half'; expected 'soft', 'hard', 'garrote', 'firm'"),
        (lambda x: shrink(x, 1, "firm"), "upper: None; expected an upper threshold for 'firm'"),
        (lambda x: shrink(x, 1, "soft", 2), "upper: 2; expected"),
        (lambda x: shrink(x, 2, "firm", 1), "upper: below the threshold"),
        (lambda x: sure_threshold(x[:0]), r"coefficients: shape \(0,\); expected at least one number"),
        (lambda x: bayes_threshold(x * np.nan), "coefficients: a number is not finite"),
        (lambda x: sure_threshold(x, -1.0), "sigma: -1.0; expected 0 or more"),
        (lambda x: universal_threshold(0), "count: 0; expected a whole number, 1 or more"),
        (lambda x: denoise_wavelet(x, rule="all"), "rule: 'all'; expected 'bayes', 'sure', 'visu'"),
        (lambda x: denoise_wavelet(x, kind="firm"), "kind: 'firm'; expected 'soft', 'hard', 'garrote'"),
        (lambda x: denoise_wavelet(x, sigma=-1.0), "sigma: -1.0; expected 0 or more"),
        (lambda x: denoise_wavelet(x * np.nan), "signal: a number is not finite"),
    ],
)
@pytest.mark.filterwarnings("ignore:invalid")
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(np.array([1.0, -2, 3]))
