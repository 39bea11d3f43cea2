"""Kernels of geodesics, against conserved quantities, scipy, closed forms and symmetries."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

import gacompiler
from gacompiler.calculus import Chart, geodesic, geodesic_rates
from gacompiler.errors import AlgebraError, KernelError
from gacompiler.symbolic import symbols, to_kernel

t, r, theta, phi = symbols("t r theta phi")
M = symbols("M", positive=True)
SCHWARZSCHILD = Chart.of_metric(
    [1 - 2 * M / r, -1 / (1 - 2 * M / r), -(r**2), -(r**2) * sympy.sin(theta) ** 2], t, r, theta, phi
)


@pytest.fixture(scope="module")
def orbit() -> Any:
    return gacompiler.compile(geodesic(SCHWARZSCHILD, M))


def test_an_orbit_about_a_black_hole(orbit: Any) -> None:
    """Energy, angular momentum and norm are conserved, and scipy agrees from the equation of the radius.

    ``r'' = -M / r**2 + L**2 / r**3 - 3 M L**2 / r**4`` (Misner, Thorne & Wheeler 1973, §25.5).
    """
    m, radius, momentum, length, n = 1.3, 14.0, 5.4, 600.0, 4000
    f = 1 - 2 * m / radius
    energy = np.sqrt(f * (1 + (momentum / radius) ** 2))
    start = [0.0, radius, np.pi / 2, 0.0, energy / f, 0.0, 0.0, momentum / radius**2]
    time, rho, polar, azimuth, dt, dr, dpolar, dazimuth = orbit(*start, m, np.full(n, length / n))
    f = 1 - 2 * m / rho
    assert np.ptp(rho) > 1 and np.abs(azimuth[-1]) > 2 * np.pi
    assert np.abs(f * dt - energy).max() <= 1e-12 and np.abs(rho**2 * dazimuth - momentum).max() <= 1e-11
    assert np.abs(f * dt**2 - dr**2 / f - (rho * dazimuth) ** 2 - 1).max() <= 1e-11
    assert np.abs(polar - np.pi / 2).max() <= 1e-12 and np.abs(dpolar).max() <= 1e-12

    def known(_: float, y: Any) -> Any:
        a, da = y[1], y[2]
        second = -m / a**2 + momentum**2 / a**3 - 3 * m * momentum**2 / a**4
        return [energy / (1 - 2 * m / a), da, second, momentum / a**2]

    solution = solve_ivp(known, (0, length), [0, radius, 0, 0], method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    np.testing.assert_allclose([time[-1], rho[-1], dr[-1], azimuth[-1]], solution, rtol=1e-8, atol=1e-8)


def test_batches_and_the_order_of_the_error(orbit: Any) -> None:
    """Falling from rest, in a batch of masses; halving the step divides the error by 16.

    The fall has the closed form of a cycloid, ``r = R (1 + cos(x)) / 2`` at the proper time ``sqrt(R**3 / 8 M)
    (x + sin(x))`` (Misner, Thorne & Wheeler 1973, §31.3).
    """
    masses, top, angle = np.array([0.8, 1.0]), 20.0, 1.2
    length = np.sqrt(top**3 / (8 * masses)) * (angle + np.sin(angle))
    errors = []
    for n in (10, 20):
        steps = length[:, None] / np.full(n, n)
        rates = 1 / np.sqrt(1 - 2 * masses / top)
        found = orbit(0.0, top, np.pi / 2, 0.0, rates, 0.0, 0.0, 0.0, masses, steps)
        errors.append(found[1][:, -1] - top * (1 + np.cos(angle)) / 2)
    assert np.all(np.abs(errors[1]) < 1e-4)
    assert np.all(errors[0] / errors[1] > 13) and np.all(errors[0] / errors[1] < 19)


@pytest.mark.slow
def test_great_circles() -> None:
    sphere = Chart.of_metric([1, sympy.sin(theta) ** 2], theta, phi)
    walk = gacompiler.compile(geodesic(sphere, name="great_circle"))
    speed = np.hypot(0.6, 0.3 * np.sin(1.1))
    polar, azimuth, *_ = walk(1.1, 0.2, 0.6, 0.3, np.full(500, 2.0 / 500))

    def point(a: Any, b: Any) -> Any:
        return np.stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)])

    south = np.array([np.cos(1.1) * np.cos(0.2), np.cos(1.1) * np.sin(0.2), -np.sin(1.1)])
    east = np.array([-np.sin(0.2), np.cos(0.2), 0.0])
    tangent = (0.6 * south + 0.3 * np.sin(1.1) * east) / speed
    angles = speed * 2.0 / 500 * np.arange(1, 501)
    known = np.outer(point(1.1, 0.2), np.cos(angles)) + np.outer(tangent, np.sin(angles))
    np.testing.assert_allclose(point(polar, azimuth), known, atol=1e-10)


def test_formulas_of_charts_become_kernels() -> None:
    kernel = to_kernel((SCHWARZSCHILD.kretschmann, SCHWARZSCHILD.christoffel[1, 0, 0]), r, M, name="tidal")
    tidal, pull = gacompiler.compile(kernel)(10.0, 2.0)
    assert tidal == pytest.approx(48 * 4 / 1e6) and pull == pytest.approx(2 * (1 - 0.4) / 100)


def test_connections_and_fields_become_kernels() -> None:
    """All Christoffel symbols of a torus, its metric, and derivatives of a vector field on it, by closed forms."""
    big, small = symbols("R a")
    width = big + small * sympy.cos(theta)
    torus = Chart.of_metric([small**2, width**2], theta, phi)
    field = torus.frame[0] * sympy.sin(phi) + torus.frame[1] * theta
    formulas = (torus.christoffel, torus.metric, torus.divergence(field), torus.grad ^ field)
    run = gacompiler.compile(to_kernel(formulas, theta, phi, big, small, name="torus_connection"))
    x, y, a, b = 0.7, 0.4, 3.0, 1.25
    found = run(x, y, a, b)
    w = a + b * np.cos(x)
    pull = -b * np.sin(x) / w
    symbols_of_torus = [0, 0, 0, w * np.sin(x) / b, 0, pull, pull, 0]
    curl = w**2 * (1 + 2 * x * pull) - b**2 * np.cos(y)
    known = [*symbols_of_torus, b**2, 0, 0, w**2, np.sin(y) * pull, curl / (b**2 * w**2)]
    np.testing.assert_allclose(found, known, rtol=1e-13)


def test_an_orbit_about_a_spinning_black_hole() -> None:
    """Kerr: energy, angular momentum, the norm and Carter's constant are conserved; the orbit leaves the equator."""
    spin = symbols("a")
    sigma, delta = r**2 + spin**2 * sympy.cos(theta) ** 2, r**2 - 2 * M * r + spin**2
    across = sympy.sin(theta) ** 2
    drag = 2 * M * spin * r * across / sigma
    last = -(r**2 + spin**2 + spin * drag) * across
    kerr = Chart.of_metric(
        [[1 - 2 * M * r / sigma, 0, 0, drag], [0, -sigma / delta, 0, 0], [0, 0, -sigma, 0], [drag, 0, 0, last]],
        t, r, theta, phi,
    )  # fmt: skip
    assert kerr.ricci == sympy.zeros(4, 4)
    path = gacompiler.compile(geodesic(kerr, M, spin, name="kerr_orbit"))
    mass, a, start = 1.0, 0.9, (0.0, 10.0, 1.2, 0.0)
    metric = sympy.lambdify((r, theta), kerr.metric.subs({M: mass, spin: a}))

    def constants(place: Any, rates: Any) -> list[float]:
        g = np.array(metric(place[1], place[2]), float)
        energy, _, turning, momentum = g @ rates
        side = a**2 * (1 - energy**2) + momentum**2 / np.sin(place[2]) ** 2
        return [rates @ g @ rates, energy, momentum, turning**2 + np.cos(place[2]) ** 2 * side]

    g = np.array(metric(*start[1:3]), float)
    rates = np.array([0.0, 0.0, 0.02, 0.03])
    half, rest = g[0, 3] * rates[3], rates @ g @ rates - 1
    rates[0] = (-half + np.sqrt(half**2 - g[0, 0] * rest)) / g[0, 0]
    found = np.stack(path(*start, *rates, mass, a, np.full(8000, 0.05)), -1)
    known = constants(np.array(start), rates)
    assert known[0] == pytest.approx(1) and np.ptp(found[:, 2]) > 0.7 and found[-1, 3] > 4 * np.pi
    for row in found[::1000]:
        np.testing.assert_allclose(constants(row[:4], row[4:]), known, rtol=2e-11)


def test_invalid_kernels() -> None:
    with pytest.raises(AlgebraError, match="contains M"):
        geodesic_rates(SCHWARZSCHILD)
    with pytest.raises(KernelError, match="contains M"):
        to_kernel(SCHWARZSCHILD.derivative(r**2), r)
