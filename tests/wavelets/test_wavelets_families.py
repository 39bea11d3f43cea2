"""Families of wavelets against closed forms and against the equations that define them."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import scipy.integrate

from algorithms.wavelets import wavelet_filters, wavelet_names
from algorithms.wavelets.families import Filters
from tests.support.all_cases import all_cases

EXACT = [name for name in wavelet_names() if name != "dmey"]
ORTHOGONAL = [name for name in EXACT if name[:4] not in ("bior", "rbio")]


def moments(name: str) -> int:
    """The number of vanishing moments according to the name."""
    if name == "haar":
        return 1
    if name[:4] in ("bior", "rbio"):
        zeros = name[4:].split(".")
        return {"4.4": 4, "5.5": 4, "6.8": 6}.get(name[4:]) or int(zeros[name.startswith("rbio")])
    return int(name.strip("dbsymcoif")) * (2 if name.startswith("coif") else 1)


@all_cases("name", EXACT)
def test_filters_are_dual_to_the_last_digit(name: str) -> None:
    """Even shifts of analysis and synthesis filters are dual, up to the rounding of the taps."""
    filters = wavelet_filters(name)
    low, high, low_back, high_back = (each.astype(np.longdouble) for each in vars(filters).values())
    middle = len(low) // 2 - 1
    for a, b in ((low, low_back), (high, high_back)):
        products = np.convolve(a, b)[1::2]
        rounding = np.finfo(float).eps * np.abs(a).max() * np.abs(b).sum()
        assert np.abs(products - (np.arange(len(products)) == middle)).max() < rounding
    for a, b in ((low, high_back), (high, low_back)):
        assert np.abs(np.convolve(a, b)[1::2]).max() < 1e-17
    assert filters.low.sum() == pytest.approx(np.sqrt(2), rel=4e-16)


@all_cases("name", EXACT)
def test_moments_vanish(name: str) -> None:
    """Legendre polynomials of lower degree than the number of moments, which the name gives, have no details."""
    filters = wavelet_filters(name)
    places = np.linspace(-1, 1, len(filters.low))
    count = moments(name)
    sums = np.polynomial.legendre.legvander(places, count).T @ filters.high
    assert np.abs(sums[:count]).max() < 2e-15
    if name[:2] in ("db", "sy"):
        assert abs(sums[count]) > 1e-14, "one more moment would vanish"


@all_cases("order", range(1, 18))
def test_moments_of_coiflets(order: int) -> None:
    """The moments 1 to 2 K - 1 of the scaling function vanish about tap 2 K."""
    low = wavelet_filters(f"coif{order}").low_back
    places = (np.arange(6 * order) - 2 * order) / (4 * order)
    sums = np.array([(places**k * low).sum() for k in range(2 * order)])
    assert np.abs(sums[1:]).max(initial=0) < 1e-15
    assert sums[0] == pytest.approx(np.sqrt(2), rel=1e-15)


def test_closed_forms() -> None:
    three, seven, two = np.sqrt(3), np.sqrt(7), np.sqrt(2)
    db2 = np.array([1 + three, 3 + three, 3 - three, 1 - three]) / (4 * two)
    assert wavelet_filters("db2").low_back == pytest.approx(db2, rel=1e-14)
    coif1 = np.array([1 - seven, 5 + seven, 14 + 2 * seven, 14 - 2 * seven, 1 - seven, -3 + seven]) / (16 * two)
    assert wavelet_filters("coif1").low_back == pytest.approx(coif1, rel=1e-14)
    assert wavelet_filters("bior2.2").low[1:] == pytest.approx(np.array([-1, 2, 6, 2, -1]) / 8 * two, rel=1e-15)
    assert wavelet_filters("rbio2.2").low == pytest.approx(np.array([0, 0, 1, 2, 1, 0]) / 4 * two, rel=1e-15)
    # Antonini et al., IEEE Trans. Image Processing 1:205, 1992: the filters of JPEG 2000.
    jpeg = [0.602949018236, 0.266864118443, -0.078223266529, -0.016864118443, 0.026748757411]
    assert wavelet_filters("bior4.4").low[5:] / two == pytest.approx(jpeg, abs=1e-12)


@all_cases("order", [3, 10, 22, 38])
def test_zeros_of_daubechies_wavelets(order: int) -> None:
    """The squared response is an integral of sin(w)**(2 N - 1), and the energy comes as early as it can."""
    low = wavelet_filters(f"db{order}").low_back
    w = np.linspace(0, np.pi, 30)
    squared = np.abs(np.exp(-1j * np.outer(w, np.arange(2 * order))) @ low) ** 2
    integral = scipy.integrate.quad(lambda t: np.sin(t) ** (2 * order - 1), 0, np.pi)[0]
    rest = [scipy.integrate.quad(lambda t: np.sin(t) ** (2 * order - 1), each, np.pi)[0] for each in w]
    assert squared == pytest.approx(2 * np.array(rest) / integral, abs=1e-13)
    early = np.cumsum(low**2)
    assert (early >= np.cumsum(low[::-1] ** 2) - 1e-15).all()


@all_cases("order", range(4, 13))
def test_symlets_have_nearly_the_most_linear_phase(order: int) -> None:
    """Of all choices of zeros, at most a few are more symmetric, by at most 15 %."""
    w = np.linspace(0, np.pi, 400)[1:-1]
    wave = np.exp(-1j * w)

    def rest(name: str) -> np.ndarray:
        """The filter without the zeros at -1, which have linear phase."""
        taps = wavelet_filters(name).low_back
        for _ in range(order):
            taps = np.polydiv(taps, [1, 1])[0]
        return taps

    def phase(taps: np.ndarray) -> np.ndarray:
        return np.unwrap(np.angle(np.polyval(taps[::-1], wave)))

    def nonlinear(phases: np.ndarray) -> float:
        return float(((phases - np.round(phases[-1] / np.pi) * w) ** 2).sum())

    zeros = np.roots(rest(f"db{order}"))
    factors = [np.poly([z, z.conjugate()] if z.imag else [z]).real for z in zeros if z.imag >= 0]
    choices = product(*((phase(taps), phase(taps[::-1])) for taps in factors))
    best = min(nonlinear(np.sum(choice, 0)) for choice in choices)
    assert best * (1 - 1e-3) < nonlinear(phase(rest(f"sym{order}"))) < 1.15 * best


def test_meyer_filter() -> None:
    """The taps are integrals of Meyer's filter, whose rest is the error of the inverse."""

    def response(w: float) -> float:
        x = min(max(3 * w / np.pi - 1, 0), 1)
        return np.sqrt(2) * np.cos(np.pi / 2 * x**4 * (35 - 84 * x + 70 * x**2 - 20 * x**3))

    taps = wavelet_filters("dmey").low_back
    assert len(taps) == 62 and taps[-1] == 0
    for k in (0, 1, 2, 7, 30):
        integral = sum(
            scipy.integrate.quad(lambda w, k=k: response(w) * np.cos(k * w), *ends, epsabs=1e-13)[0]
            for ends in ((0, np.pi / 3), (np.pi / 3, 2 * np.pi / 3))
        )
        assert taps[30 + k] == pytest.approx(integral / np.pi, abs=2e-5)
        assert taps[30 + k] == taps[30 - k]


def test_filters_are_kept() -> None:
    filters = wavelet_filters("db4")
    assert wavelet_filters("db4") is filters
    assert isinstance(filters, Filters)
    with pytest.raises(ValueError, match="read-only"):
        filters.low[0] = 1
    assert all(
        np.array_equal(a, b)
        for a, b in zip(vars(wavelet_filters("haar")).values(), vars(wavelet_filters("db1")).values(), strict=True)
    )


@all_cases("name", ["db0", "db39", "sym1", "sym21", "coif18", "bior4.2", "rbio", "", "DB4", "db4 "])
def test_unknown_names(name: str) -> None:
    with pytest.raises(ValueError, match=r"wavelet: '.*'; expected 'haar', 'db1' to 'db38'"):
        wavelet_filters(name)
