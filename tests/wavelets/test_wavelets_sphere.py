"""The inverse of the wavelets on the sphere, and Parseval's relation against spherical harmonics of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import sph_harm_y

from algorithms.wavelets import isphere_wavelet, sphere_versor, sphere_wavelet
from generated import cga3

DEGREE = 2


def rotors(count: int, seed: int = 0) -> np.ndarray:
    q = np.random.default_rng(seed).normal(size=(count, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def directions(count: int) -> np.ndarray:
    """Return directions on a spiral: no two of them are close."""
    height = 1 - (2 * np.arange(count) + 1) / count
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    around = np.sqrt(1 - height**2)
    return np.stack([around * np.cos(angle), around * np.sin(angle), height], 1)


@pytest.mark.parametrize("is_weighted", [False, True])
def test_images_are_recovered_to_rounding(is_weighted: bool) -> None:
    """To rounding times the condition number of the matrix, whose columns are transforms of unit images."""
    places = directions(20)
    moves = sphere_versor(rotors(80), np.geomspace(0.5, 4, 80))
    shares = np.random.default_rng(3).uniform(0.5, 2, 20) if is_weighted else 4 * np.pi / 20
    image = np.random.default_rng(1).normal(size=20)
    given = sphere_wavelet(image, places, moves, 3.0, 0.5, shares)
    found = isphere_wavelet(given, places, moves, 3.0, 0.5, shares)
    columns = np.stack([sphere_wavelet(unit, places, moves, 3.0, 0.5, shares) for unit in np.eye(20)], 1)
    condition = np.linalg.cond(np.concatenate([columns.real, columns.imag]) / np.sqrt(shares))
    assert found.rank == 20 and condition < 1e3
    assert np.abs(found.image - image).max() < 10 * condition * np.finfo(float).eps * np.abs(image).max()
    # The least-squares solution: no other image has coefficients nearer to changed ones.
    changed = given + np.random.default_rng(2).normal(size=(2, 80)).T @ [1, 1j]
    nearest = isphere_wavelet(changed, places, moves, 3.0, 0.5, shares).image
    left = columns @ nearest - changed
    assert np.abs((columns.conj().T @ left).real).max() < 1e-12 * np.abs(columns).sum()


def test_too_few_versors_give_the_image_of_least_norm() -> None:
    places, moves = directions(40), sphere_versor(rotors(10), np.full(10, 2.0))
    image = np.random.default_rng(1).normal(size=40)
    given = sphere_wavelet(image, places, moves, 3.0, 0.5)
    found = isphere_wavelet(given, places, moves, 3.0, 0.5)
    assert found.rank == 20 and np.linalg.norm(found.image) < np.linalg.norm(image)
    assert np.abs(sphere_wavelet(found.image, places, moves, 3.0, 0.5) - given).max() < 1e-12
    reported: list[tuple[int, int]] = []
    shared = isphere_wavelet(
        given, places, moves, 3.0, 0.5, workers=2, progress=lambda done, total: reported.append((done, total))
    )
    assert np.array_equal(shared.image, found.image) and reported == [(k + 1, 10) for k in range(10)]
    single = isphere_wavelet(given.astype(np.complex64), places.astype(np.float32), moves.astype(np.float32), 3.0, 0.5)
    assert np.abs(single.image - found.image).max() < 1e-3


def test_parsevals_relation_of_each_degree() -> None:
    """The mean of ``|W|**2`` over rotations is ``|f_l|**2 |psi_l|**2 / (2 l + 1)``; the rules are exact here."""
    x, shares = np.polynomial.legendre.leggauss(48)
    angle = 2 * np.pi * np.arange(96) / 96
    theta, phi = (each.ravel() for each in np.meshgrid(np.arccos(x), angle, indexing="ij"))
    places = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], 1)
    areas = np.repeat(shares, 96) * 2 * np.pi / 96
    # The wavelet in closed form: a Gabor function of 2 tan(theta / 2), times the root of the change of area.
    y = 2 * np.tan(theta / 2)
    gauss = np.exp(-2 * y**2) / (2 * np.pi * 0.25)
    psi = gauss * (np.exp(3j * y * np.cos(phi)) - np.exp(-(1.5**2) / 2)) * 2 / (1 + np.cos(theta))
    nodes, masses = np.polynomial.legendre.leggauss(DEGREE + 1)
    turns = np.pi * np.arange(2 * DEGREE + 2) / (DEGREE + 1)
    about, tilt, spin = (each.ravel() for each in np.meshgrid(turns, np.arccos(nodes), turns, indexing="ij"))
    mass = np.broadcast_to(masses[:, None] / 2 / len(turns) ** 2, (len(turns), len(nodes), len(turns))).ravel()
    zero = np.zeros_like(tilt)

    def turn(t: np.ndarray, plane: int) -> np.ndarray:
        q = np.stack([np.cos(t / 2), zero, zero, zero], 1)
        q[:, plane] = -np.sin(t / 2)
        return sphere_versor(q, 1.0)

    moves = cga3.even_product(turn(about, 1), cga3.even_product(turn(tilt, 2), turn(spin, 1)))
    rng = np.random.default_rng(0)
    for degree in range(DEGREE + 1):
        harmonics = np.stack([sph_harm_y(degree, m, theta, phi) for m in range(-degree, degree + 1)])
        image = (rng.normal(size=(2, 2 * degree + 1)).T @ [1, 1j] @ harmonics).real
        power = (np.abs((harmonics.conj() * areas) @ psi) ** 2).sum()
        w = sphere_wavelet(image, places, moves, 3.0, 0.5, areas)
        expected = (areas * image**2).sum() * power / (2 * degree + 1)
        assert (mass * np.abs(w) ** 2).sum() == pytest.approx(expected, rel=1e-12)


def test_bad_input() -> None:
    places, moves = directions(5), sphere_versor(rotors(4), np.ones(4))
    for call, message in (
        (lambda: isphere_wavelet(np.ones(3), places, moves), "one for each of 4 versors"),
        (lambda: isphere_wavelet(np.ones((4, 1)), places, moves), r"coefficients: shape \(4, 1\)"),
        (lambda: isphere_wavelet([1, 1j, np.inf * 1j, 0], places, moves), "coefficients: a number is not finite"),
        (lambda: isphere_wavelet(np.ma.array([1, 1j, 1, 1], mask=[0, 1, 0, 0]), places, moves), "masked"),
        (lambda: isphere_wavelet(np.ones(4), places, moves, weights=0.0), "weights: a number is not positive"),
        (lambda: sphere_wavelet(np.ones(5), places, 0 * moves), "versors: number 0 takes a point .* to infinity"),
        (lambda: isphere_wavelet(np.ones(4), places, 0 * moves), "versors: number 0 takes a point .* to infinity"),
        (lambda: isphere_wavelet(np.ones(4), 2 * places, moves), "directions: not of length 1"),
        (lambda: isphere_wavelet(np.ones(4), places, moves, tolerance=0.0), "tolerance"),
        (lambda: isphere_wavelet(np.ones(0), places, moves), "expected"),
    ):
        with pytest.raises(ValueError, match=message):
            call()
