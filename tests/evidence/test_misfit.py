"""Structure in residuals: terms that a model lacks, and what neighbours have in common."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from algorithms.evidence import Noise
from algorithms.evidence.misfit import anisotropy, coherence, dominance, exceeds_noise, misfit


def _sums(rng: np.random.Generator, lacking: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Sums of products of three parameters, two terms and residuals, the parameters, and what one is off by."""
    columns = rng.normal(size=(60, 5))
    columns[:, 3] += 2 * columns[:, 0]
    numbers = columns[:, 3] * lacking + rng.normal(size=60)
    found = np.linalg.lstsq(columns[:, :3], numbers, rcond=None)[0]
    whole = np.column_stack([columns, numbers - columns[:, :3] @ found])
    return whole.T @ whole, columns, float(found[0])


def test_terms_are_compared_with_fishers_quantile() -> None:
    quantile = scipy.stats.f.isf(1e-3, 4, 30)
    for factor, expected in ((0.999, False), (1.001, True)):
        explained = 4 * factor * quantile * 2.0
        assert exceeds_noise(explained, explained + 30 * 2.0, 4, 30, 0.0) is expected
    known = 4 * 0.3 * scipy.stats.chi2.isf(1e-3, 4) / 4
    for factor, expected in ((0.999, False), (1.001, True)):
        assert exceeds_noise(known * factor, known * factor + 1.0, 4, 30, 0.0, noise=Noise(0.3)) is expected


def test_noise_is_rarely_taken_for_terms() -> None:
    """Both tests are made with a probability of a thousandth: seven of 2,000 are rarer than one in a hundred."""
    certain = 0
    for k in range(1000):
        sums, _, _ = _sums(np.random.default_rng([k, 5]), 0.0)
        certain += misfit(sums, 3, 57).is_certain
    assert certain <= scipy.stats.binom.isf(1e-3, 1000, 2e-3)


@pytest.mark.parametrize("lacking", [0.8, 2.0])
def test_bounds_include_what_a_term_moves(lacking: float) -> None:
    """A parameter is off by twice the coefficient of a term; without the test, by tens of its deviations."""
    ratios, bare = [], []
    for k in range(200):
        sums, columns, off = _sums(np.random.default_rng([k, 6]), lacking)
        found = misfit(sums, 3, 57)
        assert found.more is not None and (found.contradicts or lacking < 2)
        own = sums[5, 5] / 57 * np.linalg.inv(columns[:, :3].T @ columns[:, :3])[0, 0]
        bare.append(abs(off) / np.sqrt(own))
        ratios.append(abs(off) / np.sqrt(own + found.more[0, 0]))
    assert max(ratios) < 2 and np.median(bare) > 4


def test_neighbours_share_what_is_correlated() -> None:
    rng = np.random.default_rng(7)
    own = rng.normal(size=4000)
    smooth = own[1:] + own[:-1]
    share = coherence(float(smooth @ smooth), float(smooth[1:] @ smooth[:-1]), len(smooth), 0)
    assert share == pytest.approx(0.5, abs=0.05)
    alone = [rng.normal(size=40) for _ in range(2000)]
    found = sum(coherence(float(x @ x), float(x[1:] @ x[:-1]), 40, 0) > 0 for x in alone)
    assert found <= scipy.stats.binom.isf(1e-3, 2000, 1e-3)


def test_tables_of_noise_have_no_dominant_part() -> None:
    """Of 2,000 tables, also with entries missing, four more than expected are rarer than one in a thousand."""
    rng, found = np.random.default_rng(8), 0
    for k in range(2000):
        table = rng.normal(size=(50, 12)) * (rng.random((50, 12)) < (1.0 if k % 2 else 0.6))
        found += dominance(np.linalg.norm(table, 2) ** 2, (table**2).sum(), table.shape, 1.0) > 0
    assert found <= scipy.stats.binom.isf(1e-3, 2000, 1e-3)
    part = np.outer(np.arange(50) < 15, rng.normal(size=12))
    values = np.linalg.svd(4 * part + rng.normal(size=(50, 12)), compute_uv=False) ** 2
    assert dominance(values[0], values.sum(), (50, 12), 1.0) == pytest.approx(values[0] / values.sum())


def _directed(x: np.ndarray, away: np.ndarray) -> tuple[float, float, float, float]:
    """Sums of squares, of those along and across, and along `away`, by complex numbers."""
    square = (x[:, 0] + 1j * x[:, 1]) ** 2
    axis = (away[:, 0] + 1j * away[:, 1]) ** 2
    radial = (square * axis.conj() / np.abs(axis)).real.sum()
    return float((x**2).sum()), float(square.sum().real), float(square.sum().imag), float(radial)


def test_noise_has_no_direction() -> None:
    """Both tests are exact: their probability is met."""
    rng, found = np.random.default_rng(9), np.zeros(2, int)
    for _ in range(3000):
        x, away = rng.normal(size=(2, 20, 2))
        squares, along, across, radial = _directed(x, away)
        found += (
            anisotropy(squares, along, across, 0.0, 20, 0.05) > 0,
            anisotropy(squares, 0.0, 0.0, radial, 20, 0.05) > 0,
        )
    low, high = scipy.stats.binom.isf([1 - 1e-3, 1e-3], 3000, 0.05)
    assert ((low <= found) & (found <= high)).all()
    moved = rng.normal(size=(40, 2)) + np.where(np.arange(40)[:, None] < 15, away[0] / np.linalg.norm(away[0]) * 6, 0)
    assert anisotropy(*_directed(moved, rng.normal(size=(40, 2))), 40) > 0.5
