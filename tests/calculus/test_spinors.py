"""Pauli and Dirac spinors, against matrices and columns of complex numbers, closed forms and scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from algorithms.calculus import dirac_columns, dirac_spinors, free_dirac, precess
from generated import spacetime, sta, vga3

SIGMA = np.array([[[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]]])
GAMMA = np.zeros((4, 4, 4), complex)
"""Dirac's matrices with the index up; those of the vectors of the algebra have it down."""
GAMMA[0] = np.diag([1, 1, -1, -1])
for _k in range(3):
    GAMMA[_k + 1, :2, 2:], GAMMA[_k + 1, 2:, :2] = SIGMA[_k], -SIGMA[_k]
LOWER = GAMMA * np.array([1, -1, -1, -1])[:, None, None]
EVEN = [sta.geometric_product.layouts["a"].blades.index(name) for name in sta.even_reverse.layouts["a"].blades]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(14)


def numbers(pairs: np.ndarray) -> np.ndarray:
    return np.asarray(pairs[..., 0] + 1j * pairs[..., 1])


def pairs(z: np.ndarray) -> np.ndarray:
    return np.stack([z.real, z.imag], -1)


def columns(psi: np.ndarray) -> np.ndarray:
    """Of Pauli spinors."""
    return np.stack([numbers(part) for part in spacetime.pauli_to_column(psi)], -1)


def full(psi: np.ndarray) -> np.ndarray:
    out = np.zeros((*psi.shape[:-1], 16))
    out[..., EVEN] = psi
    return out


def test_matrices_of_space(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, 30, 8))
    matrices = [numbers(spacetime.pauli_to_matrix(x)) for x in (a, b, vga3.geometric_product(a, b))]
    np.testing.assert_allclose(matrices[0] @ matrices[1], matrices[2], atol=1e-13)
    np.testing.assert_array_equal(numbers(spacetime.pauli_to_matrix(np.eye(8)[1:4])), SIGMA)
    np.testing.assert_array_equal(numbers(spacetime.pauli_to_matrix(np.eye(8)[7])), 1j * np.eye(2))
    np.testing.assert_allclose(spacetime.pauli_from_matrix(pairs(matrices[0])), a, atol=1e-15)
    any_matrix = rng.normal(size=(30, 2, 2, 2))
    np.testing.assert_allclose(
        spacetime.pauli_to_matrix(spacetime.pauli_from_matrix(any_matrix)), any_matrix, atol=1e-15
    )


def test_columns_of_pauli_spinors(rng: np.random.Generator) -> None:
    psi = rng.normal(size=(20, 4))
    z = columns(psi)
    np.testing.assert_array_equal(spacetime.pauli_from_column(pairs(z[:, 0]), pairs(z[:, 1])), psi)
    whole = np.zeros((20, 8))
    whole[:, [0, 4, 5, 6]] = psi
    e3, i_e3 = np.eye(8)[3], np.eye(8)[4]
    for k in range(3):
        # s_k on the column is e_k psi e3
        acted = vga3.geometric_product(vga3.geometric_product(np.eye(8)[k + 1], whole), e3)
        np.testing.assert_allclose(columns(acted[:, [0, 4, 5, 6]]), z @ SIGMA[k].T, atol=1e-15)
    turned = vga3.geometric_product(whole, i_e3)
    np.testing.assert_allclose(columns(turned[:, [0, 4, 5, 6]]), 1j * z, atol=1e-15)
    np.testing.assert_allclose(spacetime.pauli_density(psi), (np.abs(z) ** 2).sum(1), atol=1e-13)
    spin = np.einsum("ei,kij,ej->ek", z.conj(), SIGMA, z).real
    np.testing.assert_allclose(spacetime.pauli_spin(psi), spin, atol=1e-13)


def test_a_spin_precesses_about_a_constant_field(rng: np.random.Generator) -> None:
    """Larmor: ``exp(i w . sigma t / 2)`` exactly, however long the step."""
    w, psi = rng.normal(size=3), rng.normal(size=(5, 4))
    times = np.array([0.0, 0.3, 40.0])
    found = precess(psi, lambda _: w, times)
    for t, now in zip(times, found, strict=True):
        turned = expm(0.5j * t * np.einsum("k,kij->ij", w, SIGMA))
        np.testing.assert_allclose(columns(now), columns(psi) @ turned.T, atol=1e-13)
    # along one axis, any cubic in time is exact too
    ramp = precess(psi, lambda t: (1 - 2 * t + t**3) * w, [0.0, 2.0])[1]
    turned = expm(0.5j * (2 - 4 + 4) * np.einsum("k,kij->ij", w, SIGMA))
    np.testing.assert_allclose(columns(ramp), columns(psi) @ turned.T, atol=1e-13)


def test_rabis_oscillation() -> None:
    """A field along e3 and one that rotates about it: ``P(t) = (w1/W)**2 sin(W t/2)**2``."""
    w0, w1 = 5.0, 0.8
    for detuning in (0.0, 0.7):
        drive = w0 - detuning

        def field(t: float, drive: float = drive) -> list[float]:
            # s follows s x w: about e3 it turns with -w0
            return [w1 * np.cos(drive * t), -w1 * np.sin(drive * t), w0]

        times = np.linspace(0, 10, 41)
        history = precess([1.0, 0, 0, 0], field, times, steps=60)
        rate = np.hypot(w1, detuning)
        expected = (w1 / rate) ** 2 * np.sin(rate * times / 2) ** 2
        found = np.abs(columns(history)[:, 1]) ** 2
        np.testing.assert_allclose(found, expected, atol=1e-7)
        np.testing.assert_allclose(spacetime.pauli_density(history), 1, atol=1e-12)
        np.testing.assert_allclose(spacetime.pauli_spin(history)[:, 2], 1 - 2 * expected, atol=2e-7)
        finer = precess([1.0, 0, 0, 0], field, [0.0, 10.0], steps=40 * 120)[-1]
        assert np.abs(columns(finer)[1]) ** 2 == pytest.approx(expected[-1], abs=5e-9)


def test_precession_is_of_fourth_order(rng: np.random.Generator) -> None:
    psi = rng.normal(size=4)

    def field(t: float) -> np.ndarray:
        return np.array([np.sin(3 * t), 1 + t, np.cos(t) ** 2])

    def slope(t: float, z: np.ndarray) -> np.ndarray:
        return np.asarray(0.5j * np.einsum("k,kij->ij", field(t), SIGMA) @ z)

    exact = solve_ivp(slope, (0, 2), columns(psi).astype(complex), method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    errors = [np.abs(columns(precess(psi, field, [0.0, 2.0], steps=n)[1]) - exact).max() for n in (8, 16, 32)]
    assert np.log2(errors[1] / errors[2]) == pytest.approx(4, abs=0.2) and errors[2] < 1e-5


def test_batches_of_spinors_in_separate_fields(rng: np.random.Generator) -> None:
    psi, w = rng.normal(size=(7, 4)), rng.normal(size=(3, 1, 3))
    found = precess(psi, lambda t: (1 + t) * w, [0.0, 1.0, 2.0], steps=2)
    assert found.shape == (3, 3, 7, 4)
    one = precess(psi[4], lambda t: (1 + t) * w[2, 0], [0.0, 1.0, 2.0], steps=2)
    np.testing.assert_allclose(found[:, 2, 4], one, atol=1e-15)


def test_matrices_of_spacetime(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, 20, 16))
    matrices = [numbers(spacetime.dirac_to_matrix(x)) for x in (a, b, sta.geometric_product(a, b))]
    np.testing.assert_allclose(matrices[0] @ matrices[1], matrices[2], atol=1e-13)
    np.testing.assert_array_equal(numbers(spacetime.dirac_to_matrix(np.eye(16)[1:5])), LOWER)
    np.testing.assert_allclose(spacetime.dirac_from_matrix(pairs(matrices[0])), a, atol=1e-14)
    # i is no element of the real algebra
    np.testing.assert_array_equal(spacetime.dirac_from_matrix(pairs(1j * np.eye(4))), np.zeros(16))


def test_columns_of_dirac_spinors(rng: np.random.Generator) -> None:
    psi = rng.normal(size=(20, 8))
    z = dirac_columns(psi)
    np.testing.assert_array_equal(dirac_spinors(z), psi)
    g0 = np.eye(16)[1]
    for vector, matrix in zip(np.eye(16)[1:5], LOWER, strict=True):
        acted = sta.geometric_product(sta.geometric_product(vector, full(psi)), g0)[..., EVEN]
        np.testing.assert_allclose(dirac_columns(acted), z @ matrix.T, atol=1e-15)
    i_s3 = np.zeros(16)
    i_s3[sta.geometric_product.layouts["a"].blades.index("g12")] = -1.0
    acted = sta.geometric_product(full(psi), i_s3)[..., EVEN]
    np.testing.assert_allclose(dirac_columns(acted), 1j * z, atol=1e-15)


def test_observables_of_dirac_spinors(rng: np.random.Generator) -> None:
    psi = rng.normal(size=(20, 8))
    z = dirac_columns(psi)
    bar = z.conj() @ GAMMA[0]
    five = 1j * GAMMA[0] @ GAMMA[1] @ GAMMA[2] @ GAMMA[3]

    def expected(matrix: np.ndarray) -> np.ndarray:
        return np.einsum("ei,ij,ej->e", bar, matrix, z)

    scalar, pseudoscalar = spacetime.dirac_density(psi)
    np.testing.assert_allclose(scalar, expected(np.eye(4)).real, atol=1e-13)
    # g0123, indices down, is i gamma5, and <~psi I psi> = -(the pseudoscalar of psi ~psi)
    np.testing.assert_allclose(pseudoscalar, -expected(1j * five).real, atol=1e-13)
    current = np.stack([expected(g).real for g in GAMMA], -1)
    np.testing.assert_allclose(sta.dirac_current(psi), current, atol=1e-13)
    spin = np.stack([expected(g @ five).real for g in GAMMA], -1)
    np.testing.assert_allclose(sta.dirac_spin(psi), spin, atol=1e-13)
    np.testing.assert_allclose(
        sta.interval(current), scalar**2 + pseudoscalar**2, atol=1e-12 * np.max(current[:, 0]) ** 2
    )
    bivector = spacetime.dirac_spin_bivector(psi)
    names = spacetime.dirac_spin_bivector.layouts["out"].blades
    for name, found in zip(names, bivector.T, strict=True):
        i, j = int(name[1]), int(name[2])
        # along g_i g_j stands <~psi (g^j g^i) psi I s3>
        product = 1j * GAMMA[j] @ GAMMA[i]
        np.testing.assert_allclose(found, expected(product).real, atol=1e-13)


def momenta(rng: np.random.Generator, mass: float) -> np.ndarray:
    k = 2 * np.pi * np.array([1, -1, 1]) / [1.0, 1.3, 0.7]
    return np.array([np.sqrt(k @ k + mass * mass), *k])


def test_plane_waves_solve_diracs_equation(rng: np.random.Generator) -> None:
    mass, spin = 2.0, rng.normal(size=4)
    p = momenta(rng, mass)
    lengths = np.array([2 * np.pi / p[0], 1.0, 1.3, 0.7])
    axes = [np.arange(6) * length / 6 for length in lengths]
    events = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    density = (spin**2).sum()
    for wave, sign in ((spacetime.dirac_wave, 1), (spacetime.dirac_antiparticle_wave, -1)):
        psi = wave(p, spin, events)
        parts = []
        for axis, length in enumerate(lengths):
            k = 2j * np.pi * np.fft.fftfreq(6, length / 6)
            shape = [-1 if i == axis else 1 for i in range(5)]
            parts.append(np.fft.ifft(k.reshape(shape) * np.fft.fft(psi, axis=axis), axis=axis).real)
        left = spacetime.dirac_residual(*parts, psi, np.zeros(4), mass)
        assert np.abs(left).max() < 1e-11
        # with the matrices: i gamma^m d_m z = m z
        z = dirac_columns(psi)
        turned = sum(1j * dirac_columns(part) @ g.T for part, g in zip(parts, GAMMA, strict=True))
        np.testing.assert_allclose(turned, mass * z, atol=1e-11)
        np.testing.assert_allclose(
            sta.dirac_current(psi), np.broadcast_to(density * p / mass, (*psi.shape[:-1], 4)), atol=1e-11
        )
        scalar, pseudoscalar = spacetime.dirac_density(psi)
        np.testing.assert_allclose(scalar, sign * density, atol=1e-11)
        np.testing.assert_allclose(pseudoscalar, 0, atol=1e-11)
        # a constant potential shifts the momentum
        a = rng.normal(size=4)
        shifted = spacetime.dirac_residual(*parts, psi, a, mass)
        alone = spacetime.dirac_residual(*np.zeros((4, 8)), psi, a, 0.0)
        np.testing.assert_allclose(shifted, alone, atol=1e-11)


def test_free_spinors_evolve_by_their_hamiltonian(rng: np.random.Generator) -> None:
    mass, size, shape = 1.3, np.array([1.0, 1.3, 0.7]), (5, 4, 3)
    psi = rng.normal(size=(*shape, 8))
    after = free_dirac(psi, size, mass, 0.37)
    spectrum, turned = (np.fft.fftn(dirac_columns(x), axes=(0, 1, 2)) for x in (psi, after))
    for index in np.ndindex(*shape):
        k = [2 * np.pi * np.fft.fftfreq(n, length / n)[i] for n, length, i in zip(shape, size, index, strict=True)]
        hamiltonian = GAMMA[0] @ (np.einsum("k,kij->ij", k, GAMMA[1:]) + mass * np.eye(4))
        np.testing.assert_allclose(expm(-0.37j * hamiltonian) @ spectrum[index], turned[index], atol=1e-11)
    total = [sta.dirac_current(x)[..., 0].sum() for x in (psi, after)]
    assert total[1] == pytest.approx(total[0], rel=1e-14)
    still = np.broadcast_to(rng.normal(size=8), (1, 1, 1, 8))
    np.testing.assert_allclose(free_dirac(still, size, 0.0, 5.0), still, atol=1e-14)


def test_free_waves_move_as_plane_waves_do(rng: np.random.Generator) -> None:
    mass, size, shape = 2.0, np.array([1.0, 1.3, 0.7]), (6, 5, 4)
    p, spin = momenta(rng, mass), rng.normal(size=4)
    axes = [np.arange(n) * length / n for n, length in zip(shape, size, strict=True)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    for wave in (spacetime.dirac_wave, spacetime.dirac_antiparticle_wave):
        now, later = (wave(p, spin, np.concatenate([np.full((*shape, 1), t), places], -1)) for t in (0.0, 0.4))
        np.testing.assert_allclose(free_dirac(now, size, mass, 0.4), later, atol=1e-12)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match=r"psi: shape \(3,\); expected \(..., 4\), Pauli spinors"):
        precess([1.0, 0, 0], lambda _: [0, 0, 1], [0.0, 1.0])
    with pytest.raises(ValueError, match="times"):
        precess([1.0, 0, 0, 0], lambda _: [0, 0, 1], [0.0, np.nan])
    with pytest.raises(ValueError, match="steps: 0"):
        precess([1.0, 0, 0, 0], lambda _: [0, 0, 1], [0.0, 1.0], steps=0)
    with pytest.raises(ValueError, match="angular_velocity"):
        precess([1.0, 0, 0, 0], lambda _: [0, 1], [0.0, 1.0])
    with pytest.raises(ValueError, match=r"columns: shape \(3,\)"):
        dirac_spinors([1, 2, 3])
    with pytest.raises(ValueError, match=r"psi: shape \(1, 1, 8\)"):
        free_dirac(np.zeros((1, 1, 8)), [1, 1, 1], 1.0, 1.0)
    with pytest.raises(ValueError, match="size"):
        free_dirac(np.zeros((1, 1, 1, 8)), [1, 0, 1], 1.0, 1.0)
