"""Lie filters and orbit energies: commutators, laws, patterns with known centres, and bad input."""

from __future__ import annotations

import re
from itertools import combinations

import numpy as np
import pytest
import scipy.ndimage

from algorithms.wavelets import key_points, lie_filter, lie_responses, orbit_energies, orbit_energy
from algorithms.wavelets.lie_filters import GENERATORS
from gacompiler.specs.lie_filters import BIVECTORS
from gacompiler.specs.lie_filters import GENERATORS as MATRICES
from gacompiler.structure.general_linear import bivector_of_linear_map, linear_map_of_bivector
from tests.support.all_cases import all_cases

SIZE = 81
Y, X = np.mgrid[:SIZE, :SIZE] - SIZE // 2
R, ANGLE = np.hypot(X, Y), np.arctan2(Y, X)
SPIRAL = {"rotation": 1.0, "dilation": 0.3}
PATTERNS = {
    "x": (np.sin(0.8 * Y), "x"),
    "y": (np.sin(0.8 * X), "y"),
    "circles": (np.sin(0.9 * R), "rotation"),
    "rays": (np.cos(6 * ANGLE), "dilation"),
    "hyperbolas": (np.sin(X * Y / 12.0), "hyperbolic"),
    "hyperbolas45": (np.sin((X**2 - Y**2) / 24.0), "hyperbolic45"),
    # Invariant along (rotation + 0.3 dilation): log r - 0.3 angle is constant on each orbit.
    "spiral": (np.cos(4 * ANGLE - 4 / 0.3 * np.log(R + (R == 0))), SPIRAL),
}


def test_commutators_are_exact() -> None:
    """The commutator products of the bivectors are the commutators of the matrices, over the integers."""
    matrices = [np.array(m, dtype=object) for m in MATRICES]
    for bivector, matrix in zip(BIVECTORS, MATRICES, strict=True):
        assert bivector.terms == bivector_of_linear_map(matrix).terms
    for (a, b), (m, n) in zip(combinations(BIVECTORS, 2), combinations(matrices, 2), strict=True):
        found = linear_map_of_bivector((a * b - b * a) / 2)
        assert (found == m @ n - n @ m).all()
    # In particular [rotation, x] = y for matrices, and the hyperbolic generators close on twice the rotation.
    x, y, rotation, dilation, hyperbolic, hyperbolic45 = BIVECTORS
    assert (rotation * x - x * rotation) / 2 == y and dilation * rotation == rotation * dilation
    assert hyperbolic * hyperbolic45 - hyperbolic45 * hyperbolic == -4 * rotation


def naive_energy(image: np.ndarray, field: np.ndarray, window: int) -> float:
    """Sum over a window about the middle of an image, with scipy's Gaussian derivatives."""
    g = [scipy.ndimage.gaussian_filter(image, 2.0, order, truncate=4) for order in ((0, 1), (1, 0))]
    c, u = SIZE // 2, np.arange(-window, window + 1)
    w = np.exp(-0.5 * (3 * u / window) ** 2)
    w = np.outer(w, w) / w.sum() ** 2
    part = slice(c - window, c + window + 1)
    y, x = np.meshgrid(u, u, indexing="ij")
    point = np.stack([x, y, np.ones_like(x)], -1)
    vx, vy = np.moveaxis(point @ field[:2].T, -1, 0)
    return float((w * (vx * g[0][part, part] + vy * g[1][part, part]) ** 2).sum())


@all_cases("name", GENERATORS)
def test_energy_is_the_sum_over_the_window(name: str) -> None:
    image = np.random.default_rng(1).normal(size=(SIZE, SIZE))
    found = orbit_energy(image, name, 2.0, 9.0)
    want = naive_energy(image, np.array(MATRICES[GENERATORS.index(name)]), 9)
    assert found[SIZE // 2, SIZE // 2] == pytest.approx(want, rel=2e-3)
    assert np.allclose(orbit_energies(image, 2.0, 9.0)[GENERATORS.index(name)], found, rtol=1e-10, atol=1e-14)


def test_energy_of_a_sum_of_generators() -> None:
    image = np.random.default_rng(2).normal(size=(SIZE, SIZE))
    parts = {"x": 0.7, "y": -2.0, "rotation": 1.1, "dilation": 0.4, "hyperbolic": -0.3, "hyperbolic45": 0.6}
    field = sum(c * np.array(MATRICES[GENERATORS.index(n)]) for n, c in parts.items())
    found = orbit_energy(image, parts, 2.0, 9.0)[SIZE // 2, SIZE // 2]
    assert found == pytest.approx(naive_energy(image, np.asarray(field), 9), rel=2e-3)


@all_cases("name", PATTERNS)
def test_centres_of_invariant_patterns(name: str) -> None:
    image, generator = PATTERNS[name]
    energy, c = orbit_energy(image, generator), SIZE // 2
    around = energy[c - 20 : c + 21, c - 20 : c + 21]
    if name in "xy":
        # Lines are invariant everywhere: the energy is compared with that of translations across the lines.
        assert around.max() <= 1e-2 * orbit_energy(image, "y" if name == "x" else "x")[c, c]
        return
    # Rays are singular at their centre, where the Gaussian that smooths the image makes them change along orbits.
    ring, bound = (R > 5) & (R < 15), 1e-1 if name == "rays" else 1e-2
    assert energy[c, c] <= bound * energy[ring].mean()
    assert energy[c, c] == around.min()


def test_energies_of_rays_at_their_centre_fall_with_the_window() -> None:
    """Smoothing bends rays within some sigma of the centre: the share of these pixels falls like (sigma / window)^2."""
    y, x = np.mgrid[:241, :241] - 120
    image, r = np.cos(4 * np.arctan2(y, x)), np.hypot(x, y)
    shares = []
    for sigma, window in ((1.0, 12.0), (1.0, 24.0), (1.0, 44.0), (2.0, 24.0)):
        energy = orbit_energy(image, "dilation", sigma, window)
        shares.append(energy[120, 120] / energy[(r > 5 / 12 * window) & (r < 15 / 12 * window)].mean())
    assert shares[2] <= 1e-2 and shares[0] / shares[1] == pytest.approx(4, rel=0.1)
    assert shares[3] == pytest.approx(shares[0], rel=0.1)


def test_centres_off_the_middle_are_found() -> None:
    y, x = np.mgrid[:120, :160]
    first, second = np.hypot(x - 40, y - 60), np.hypot(x - 115, y - 50)
    image = np.sin(0.9 * first) * np.exp(-((first / 18) ** 2)) + np.sin(0.8 * second) * np.exp(-((second / 18) ** 2))
    found = key_points(image, "rotation", threshold=0.05)
    assert {tuple(p) for p in found.points.tolist()} == {(60, 40), (50, 115)}
    assert (found.energies < 0.05).all() and (np.diff(found.energies) >= 0).all()
    noisy = image + 0.05 * np.random.default_rng(3).normal(size=image.shape)
    best = key_points(noisy, "rotation", threshold=0.2).points[:2]
    assert sorted(map(tuple, best.tolist())) == [pytest.approx((50, 115), abs=1), pytest.approx((60, 40), abs=1)]


def test_edges_and_constants_have_no_key_points() -> None:
    assert len(key_points(np.ones((40, 40)), "rotation").points) == 0
    edge = (np.mgrid[:60, :60][1] > 30).astype(float)
    for name in ("rotation", "dilation"):
        assert len(key_points(edge, name).points) == 0


def test_steering_laws() -> None:
    """A pattern rotated by t is invariant under the hyperbolic generator rotated by 2 t."""
    for t in (0.2, 0.9, -0.5):
        u, v = np.cos(t) * X + np.sin(t) * Y, -np.sin(t) * X + np.cos(t) * Y
        image, c = np.sin(u * v / 20), SIZE // 2
        steered = {"hyperbolic": np.cos(2 * t), "hyperbolic45": np.sin(2 * t)}
        other = {"hyperbolic": -np.sin(2 * t), "hyperbolic45": np.cos(2 * t)}
        assert orbit_energy(image, steered)[c, c] < 1e-2 * orbit_energy(image, other)[c, c]
        lines = np.sin(0.8 * v)
        assert orbit_energy(lines, {"x": np.cos(t), "y": np.sin(t)})[c, c] < 1e-3 * orbit_energy(lines, "y")[c, c]
        # The same laws for filters, against the closed form of the rotated Gaussian derivative.
        sigma, mask = 3.0, lie_filter({"x": np.cos(t), "y": np.sin(t)}, 3.0)
        y, x = np.mgrid[-12:13, -12:13]
        g = np.exp(-(x**2 + y**2) / (2 * sigma**2))
        g /= g.sum()
        assert np.allclose(mask, -(np.cos(t) * x + np.sin(t) * y) / sigma**2 * g, atol=1e-15)
        u, v = np.cos(t) * x + np.sin(t) * y, -np.sin(t) * x + np.cos(t) * y
        assert np.allclose(lie_filter(steered, sigma), (v**2 - u**2) / sigma**2 * g, atol=1e-15)


@all_cases("name", GENERATORS)
def test_scale_law(name: str) -> None:
    small, large = lie_filter(name, 2.0), lie_filter(name, 4.0)
    law = 8 if name in "xy" else 4
    assert np.allclose(large[::2, ::2] * law, small, atol=1e-5, rtol=1e-3)
    assert (abs(small).max() < 1e-17) == (name == "rotation")


@all_cases("k", range(6))
def test_responses_are_convolutions(k: int) -> None:
    image = np.random.default_rng(4).normal(size=(40, 50))
    want = scipy.ndimage.convolve(image, lie_filter(GENERATORS[k], 1.5), mode="reflect")
    assert np.allclose(lie_responses(image, 1.5)[k], want, atol=1e-13)


def test_stacks_types_and_ranges() -> None:
    rng = np.random.default_rng(5)
    image = rng.integers(0, 255, (2, 30, 40)).astype(np.uint8)
    whole = orbit_energy(image, "rotation")
    assert whole.dtype == np.float64 and np.array_equal(whole[1], orbit_energy(image[1].astype(float), "rotation"))
    assert orbit_energy(image.astype(np.float32), "rotation").dtype == np.float32
    assert np.allclose(orbit_energy(1e-200 * image, "rotation"), 0)
    assert np.allclose(orbit_energy(2.0**60 * image, "dilation"), 2.0**120 * orbit_energy(image, "dilation"))
    assert orbit_energies(image).shape == lie_responses(image).shape == (2, 6, 30, 40)
    with pytest.raises(ValueError, match="overflow"):
        orbit_energy(1e200 * image, "x")


@all_cases(
    "change, message",
    [
        ({"image": np.ones((20, 20, 3))}, "looks like"),
        ({"image": np.full((20, 20), np.nan)}, "finite"),
        ({"image": np.ones(20)}, "expected (..., any, any)"),
        ({"image": np.ones((0, 20))}, "no empty axis"),
        ({"generator": "shear"}, "'shear'; expected x, y, rotation"),
        ({"generator": {}}, "all coefficients are 0"),
        ({"generator": {"x": np.inf}}, "generator['x']: inf"),
        ({"sigma": 0.0}, "sigma: 0.0"),
        ({"window": -1.0}, "window: -1.0"),
    ],
)
def test_bad_arguments(change: dict[str, object], message: str) -> None:
    arguments = {"image": np.ones((20, 20)), "generator": "rotation", "sigma": 1.0, "window": 12.0} | change
    with pytest.raises(ValueError, match=re.escape(message)):
        orbit_energy(**arguments)  # type: ignore[arg-type]


def test_other_bad_arguments() -> None:
    with pytest.raises(TypeError, match="generator: 3"):
        lie_filter(3, 1.0)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="complex"):
        orbit_energy(np.ones((20, 20), complex), "x")
    with pytest.raises(ValueError, match="a translation"):
        key_points(np.ones((20, 20)), "x")
    with pytest.raises(ValueError, match="threshold: 2"):
        key_points(np.ones((20, 20)), "rotation", threshold=2)
