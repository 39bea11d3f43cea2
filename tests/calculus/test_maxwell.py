"""Electromagnetic fields and Yee's grid, against vector formulas, the wave equation and the dispersion of the grid."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.calculus import Fields, YeeBox, field_seen_by, plane_wave, stress_energy
from generated import spacetime, sta, vga3


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(11)


def transverse(rng: np.random.Generator, k: np.ndarray) -> np.ndarray:
    return np.cross(k, rng.normal(size=k.shape))


def event_grid(shape: tuple[int, int, int, int], lengths: np.ndarray) -> np.ndarray:
    axes = [np.arange(n) * length / n for n, length in zip(shape, lengths, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1)


def partials(values: np.ndarray, lengths: np.ndarray) -> list[np.ndarray]:
    """Derivatives along the first four axes of a periodic array, exact for frequencies that its grid resolves."""
    found = []
    for axis, length in enumerate(lengths):
        n = values.shape[axis]
        k = 2j * np.pi * np.fft.fftfreq(n, length / n)
        shape = [-1 if i == axis else 1 for i in range(values.ndim)]
        found.append(np.fft.ifft(k.reshape(shape) * np.fft.fft(values, axis=axis), axis=axis).real)
    return found


def test_plane_waves_solve_maxwells_equations(rng: np.random.Generator) -> None:
    k = 2 * np.pi * np.array([1.0, 2, -2])
    lengths = np.array([1 / 3, 1, 1, 1])  # |k| = 3 turns in a unit
    e, f = transverse(rng, k), transverse(rng, k)
    events = event_grid((6, 6, 6, 6), lengths)
    wave = plane_wave(k, e, events, f)
    electric, magnetic = sta.field_to_electric_magnetic(wave)
    phase = events @ np.array([np.linalg.norm(k), *-k])
    expected = np.cos(phase)[..., None] * e + np.sin(phase)[..., None] * f
    np.testing.assert_allclose(electric, expected, atol=1e-12)
    np.testing.assert_allclose(magnetic, np.cross(k / np.linalg.norm(k), expected), atol=1e-12)
    vector, trivector = spacetime.field_derivative(*partials(wave, lengths))
    assert np.abs(vector).max() < 1e-11 and np.abs(trivector).max() < 1e-11
    # null: both invariants vanish, energy flows with the speed of light
    first, second = sta.field_invariants(wave)
    np.testing.assert_allclose([first, second], 0, atol=1e-11)
    flow = sta.field_stress_energy(wave, [1, 0, 0, 0])
    np.testing.assert_allclose(flow[..., 1:], flow[..., :1] * k / np.linalg.norm(k), atol=1e-11)


def test_fields_of_potentials_and_their_currents(rng: np.random.Generator) -> None:
    """A potential with arbitrary Fourier modes: D ^ F = 0, and the current is that of vector calculus."""
    shape, lengths = (5, 5, 5, 5), np.array([1.0, 2, 1.5, 1])
    potential = rng.normal(size=(*shape, 4))
    at, ax, ay, az = partials(potential, lengths)
    field = spacetime.field_from_potential(at, ax, ay, az)
    gradient = np.stack([ax[..., 0], ay[..., 0], az[..., 0]], -1)
    electric, magnetic = sta.field_to_electric_magnetic(field)
    np.testing.assert_allclose(electric, -gradient - at[..., 1:], atol=1e-10)
    curl = np.stack([ay[..., 3] - az[..., 2], az[..., 1] - ax[..., 3], ax[..., 2] - ay[..., 1]], -1)
    np.testing.assert_allclose(magnetic, curl, atol=1e-10)
    vector, trivector = spacetime.field_derivative(*partials(field, lengths))
    assert np.abs(trivector).max() < 1e-10 * np.abs(vector).max()
    d = partials(electric, lengths)
    charge = d[1][..., 0] + d[2][..., 1] + d[3][..., 2]
    c = partials(magnetic, lengths)
    turned = np.stack(
        [c[2][..., 2] - c[3][..., 1], c[3][..., 0] - c[1][..., 2], c[1][..., 1] - c[2][..., 0]], -1
    ) - d[0]  # fmt: skip
    np.testing.assert_allclose(vector, np.concatenate([charge[..., None], turned], -1), atol=1e-9)
    # the same in G(3): d F/dt + D F = rho - J with F = E + e123 B
    left = np.zeros((*shape, 8))
    for axis, (de, db) in enumerate(zip(d, c, strict=True)):
        f = np.zeros((*shape, 8))
        f[..., 1:4], f[..., 4], f[..., 5], f[..., 6] = de, db[..., 2], -db[..., 1], db[..., 0]
        left += vga3.geometric_product(np.eye(8)[axis], f)
    right = np.concatenate([charge[..., None], -turned, np.zeros((*shape, 4))], -1)
    np.testing.assert_allclose(left, right, atol=1e-9)


def test_moving_observers_see_the_lorentz_transform(rng: np.random.Generator) -> None:
    e, b = rng.normal(size=(2, 200, 3))
    v = rng.normal(size=(200, 3))
    v *= (rng.uniform(0, 0.99, 200) / np.linalg.norm(v, axis=1))[:, None]
    f = sta.field_from_electric_magnetic(e, b)
    seen = field_seen_by(f, v)
    gamma = 1 / np.sqrt(1 - (v * v).sum(1))[:, None]
    unit = v / np.linalg.norm(v, axis=1, keepdims=True)
    found = sta.field_to_electric_magnetic(seen)
    for got, here, across in zip(found, (e, b), (np.cross(v, b), -np.cross(v, e)), strict=True):
        along = (here * unit).sum(1, keepdims=True) * unit
        np.testing.assert_allclose(got, along + gamma * (here - along + across), atol=1e-12 * gamma.max() ** 2)
    for before, after in zip(sta.field_invariants(f), sta.field_invariants(seen), strict=True):
        np.testing.assert_allclose(before, after, atol=1e-12 * gamma.max() ** 2)
    with pytest.raises(ValueError, match=r"velocity: 1 or more.*the speed of light"):
        field_seen_by(f, [1.0, 0, 0])


def test_stress_energy_is_that_of_the_textbooks(rng: np.random.Generator) -> None:
    e, b = rng.normal(size=(2, 50, 3))
    f = sta.field_from_electric_magnetic(e, b)
    tensor = stress_energy(f)
    density = ((e * e).sum(1) + (b * b).sum(1)) / 2
    np.testing.assert_allclose(tensor[:, 0, 0], density, atol=1e-12)
    np.testing.assert_allclose(tensor[:, 0, 1:], np.cross(e, b), atol=1e-12)
    np.testing.assert_allclose(tensor, np.swapaxes(tensor, 1, 2), atol=1e-12)
    stress = np.einsum("ei,ej->eij", e, e) + np.einsum("ei,ej->eij", b, b) - density[:, None, None] * np.eye(3)
    np.testing.assert_allclose(-tensor[:, 1:, 1:], stress, atol=1e-12)
    # F**4 is (first invariant / 2)**2 + (second)**2: the square of the tensor is that, times the identity
    first, second = sta.field_invariants(f)
    metric = np.diag([1.0, -1, -1, -1])
    square = tensor @ metric @ tensor @ metric
    np.testing.assert_allclose(square, (first**2 / 4 + second**2)[:, None, None] * np.eye(4), atol=1e-11)


def grid_wave(box: YeeBox, turns: tuple[int, int, int], rng: np.random.Generator) -> tuple:
    """A plane wave that solves the equations of differences of a periodic grid, not of space."""
    k, d = 2 * np.pi * np.array(turns) / box.size, np.array(box.spacing)
    slow = 2 * np.sin(k * d / 2) / d
    w = box.dispersion(k)
    fast = 2 * np.sin(w * box.time_step / 2) / box.time_step
    amplitude = transverse(rng, slow)

    def electric(t: float) -> np.ndarray:
        return amplitude * np.cos(box.edge_points() @ k - w * t)

    def magnetic(t: float) -> np.ndarray:
        return np.cross(slow, amplitude) / fast * np.cos(box.face_points() @ k - w * t)

    return electric, magnetic


def test_waves_have_the_dispersion_of_the_grid(rng: np.random.Generator) -> None:
    for shape, turns in (((12, 10, 8), (1, -2, 1)), ((16, 1, 1), (3, 0, 0)), ((9, 7, 1), (2, 3, 0))):
        box = YeeBox(shape, (1.0, 1.2, 0.9), 0.05)
        electric, magnetic = grid_wave(box, turns, rng)
        h = box.time_step
        found = box.run(Fields(electric(0), magnetic(-h / 2)), 500)
        assert found.step == 500 and found.time == pytest.approx(500 * h)
        np.testing.assert_allclose(found.electric, electric(500 * h), atol=1e-11)
        np.testing.assert_allclose(found.magnetic, magnetic(499.5 * h), atol=1e-11)


@pytest.mark.parametrize("walls", ["periodic", "conducting"])
def test_energy_and_charge_are_conserved_over_two_thousand_steps(walls: str, rng: np.random.Generator) -> None:
    box = YeeBox((9, 8, 7), (1, 1, 1), 0.07, walls)
    start = Fields(rng.normal(size=(2, *box.shape, 3)), rng.normal(size=(2, *box.shape, 3)))
    start = box.run(start, 0)
    energies = [box.energy(start)]
    end = box.run(start, 2000, callback=lambda now: energies.append(box.energy(now)), every=40)
    assert len(energies) == 51 and end.step == 2000
    assert energies[0].shape == (2,) and (energies[0] > 0).all()
    assert np.abs(np.array(energies) / energies[0] - 1).max() < 1e-10
    np.testing.assert_allclose(box.divergence(end), box.divergence(start), atol=1e-9)
    # what it is made of changes all the time
    assert np.abs(end.electric - start.electric).max() > 1


def order_of(errors: list[float]) -> float:
    return float(np.log2(errors[-2] / errors[-1]))


def test_plane_waves_converge_at_second_order(rng: np.random.Generator) -> None:
    k = 2 * np.pi * np.array([1.0, 1, 0])
    amplitude = np.array([1.0, -1, 0.5])
    errors = []
    for n in (8, 16, 32):
        box = YeeBox((n, n, 1), (1, 1, 1), 0.4 / n)
        h, w = box.time_step, np.linalg.norm(k)
        magnetic = np.cross(k, amplitude) / w
        start = Fields(
            amplitude * np.cos(box.edge_points() @ k), magnetic * np.cos(box.face_points() @ k + w * h / 2)
        )  # fmt: skip
        end = box.run(start, 2 * n)
        errors.append(np.abs(end.electric - amplitude * np.cos(box.edge_points() @ k - w * end.time)).max())
        centres = box.at_centres(end)
        corners = np.stack(np.meshgrid(np.arange(n) / n, np.arange(n) / n, [0.0], indexing="ij"), -1)
        places = corners + np.array(box.spacing) / 2
        events = np.concatenate([np.full((n, n, 1, 1), end.time), places], -1)
        off = np.abs(centres - plane_wave(k, amplitude, events)).max()
        assert off < 60 / n**2
    assert order_of(errors) == pytest.approx(2, abs=0.1)


def test_a_cavity_rings_at_its_frequency() -> None:
    """TE101 of a conducting box: ``E_y = sin(pi x / a) sin(pi z / c) cos(w t)``, at second order."""
    errors = []
    a, c = 1.0, 1.3
    w = np.pi * np.hypot(1 / a, 1 / c)
    for n in (8, 16, 32):
        box = YeeBox((n, 3, n), (a, 0.5, c), 0.3 / n, "conducting")
        h = box.time_step
        edge, face = box.edge_points()[..., 1, :], box.face_points()

        def mode(x: np.ndarray) -> np.ndarray:
            return np.sin(np.pi * x[..., 0] / a) * np.sin(np.pi * x[..., 2] / c)

        electric, magnetic = np.zeros((*box.shape, 3)), np.zeros((*box.shape, 3))
        electric[..., 1] = mode(edge)
        # dB/dt = -curl E, half a step before
        late = np.sin(-w * h / 2) / w
        x, z = face[..., 0, :], face[..., 2, :]
        magnetic[..., 0] = np.pi / c * np.sin(np.pi * x[..., 0] / a) * np.cos(np.pi * x[..., 2] / c) * late
        magnetic[..., 2] = -np.pi / a * np.cos(np.pi * z[..., 0] / a) * np.sin(np.pi * z[..., 2] / c) * late
        end = box.run(Fields(electric, magnetic), 10 * n)
        errors.append(np.abs(end.electric[..., 1] - mode(edge) * np.cos(w * end.time)).max())
        assert np.abs(end.electric[0, ..., 1:]).max() == 0 and np.abs(end.magnetic[0, ..., 0]).max() == 0
        assert np.abs(box.at_centres(end)[..., [0, 2]]).max() < 1e-12
    assert order_of(errors) == pytest.approx(2, abs=0.1)


def test_currents_make_fields() -> None:
    """A uniform current: ``E = -integral of J``, and a charge that accumulates where a current ends."""
    box = YeeBox((4, 4, 4), (1, 1, 1), 0.1)
    still = Fields(np.zeros((4, 4, 4, 3)), np.zeros((4, 4, 4, 3)))
    end = box.run(still, 50, current=lambda t: np.broadcast_to([0, np.cos(t), 0], (4, 4, 4, 3)))
    # the midpoint rule of the cosine
    expected = -0.1 * np.cos(0.1 * (np.arange(50) + 0.5)).sum()
    np.testing.assert_allclose(end.electric, np.broadcast_to([0, expected, 0], (4, 4, 4, 3)), atol=1e-13)
    wire = np.zeros((4, 4, 4, 3))
    wire[1, 2, 2, 0] = 1.0
    charge = box.divergence(box.run(still, 20, current=lambda _: wire))
    expected_charge = np.zeros((4, 4, 4))
    expected_charge[1, 2, 2], expected_charge[2, 2, 2] = -2.0 * 4, 2.0 * 4
    np.testing.assert_allclose(charge, expected_charge, atol=1e-12)


def test_callbacks_follow_and_end_a_run(rng: np.random.Generator) -> None:
    box = YeeBox((4, 4, 4), (1, 1, 1), 0.1)
    start = Fields(rng.normal(size=(4, 4, 4, 3)), rng.normal(size=(4, 4, 4, 3)), time=3.0, step=7)
    steps: list[int] = []
    end = box.run(start, 25, callback=lambda now: steps.append(now.step), every=10)
    assert steps == [17, 27, 32] and end.step == 32 and end.time == pytest.approx(5.5)
    ended = box.run(start, 25, callback=lambda now: now.step > 10, every=10)
    assert ended.step == 17
    # in two runs as in one, to the bit
    again = box.run(ended, 15)
    np.testing.assert_array_equal(again.electric, end.electric)


def test_courants_limit() -> None:
    """Steps above the limit are rejected, because the fastest oscillation would grow."""
    box = YeeBox((8, 8, 8), (1, 2, 4), 0.1)
    limit = 1 / np.sqrt(8.0**2 + 4**2 + 2**2)
    assert box.courant_limit == pytest.approx(limit)
    with pytest.raises(
        ValueError, match=r"time_step: 0.11; expected more than 0 and less than 0.10910\d, the limit of Cour"
    ):
        YeeBox((8, 8, 8), (1, 2, 4), 0.11)
    assert YeeBox((8, 1, 1), (1, 1, 1), 0.1249).courant_limit == pytest.approx(0.125)
    # the mode that alternates from cell to cell: sin(w dt/2) = dt/limit
    for part in (0.5, 0.999):
        some = YeeBox((8, 8, 8), (1, 2, 4), part * limit)
        highest = some.dispersion(np.pi / np.array(some.spacing))
        assert np.sin(highest * some.time_step / 2) == pytest.approx(part)
    fast = YeeBox((8, 8, 8), (1, 2, 4), 0.999 * limit)
    rng = np.random.default_rng(0)
    start = Fields(rng.normal(size=(8, 8, 8, 3)), np.zeros((8, 8, 8, 3)))
    assert np.abs(fast.run(start, 2000).electric).max() < 1e3
    over = YeeBox((8, 8, 8), (1, 2, 4), 0.999 * limit)
    object.__setattr__(over, "time_step", 1.01 * limit)
    assert np.abs(over.run(start, 400).electric).max() > 1e9


def test_wrong_arguments_are_rejected() -> None:
    with pytest.raises(ValueError, match="walls: 'open'; expected one of periodic, conducting"):
        YeeBox((2, 2, 2), (1, 1, 1), 0.1, "open")
    with pytest.raises(ValueError, match=r"shape: \(2, 0, 2\); expected three numbers of cells"):
        YeeBox((2, 0, 2), (1, 1, 1), 0.1)
    with pytest.raises(ValueError, match="size"):
        YeeBox((2, 2, 2), (1, -1, 1), 0.1)
    box = YeeBox((2, 2, 2), (1, 1, 1), 0.1)
    good = np.zeros((2, 2, 2, 3))
    with pytest.raises(ValueError, match=r"electric: shape \(3,\); expected \(..., 2, 2, 2, 3\)"):
        box.run(Fields(np.zeros(3), good), 1)
    with pytest.raises(ValueError, match="magnetic: nan at"):
        box.run(Fields(good, good * np.nan), 1)
    with pytest.raises(ValueError, match="steps: -1"):
        box.run(Fields(good, good), -1)
    with pytest.raises(ValueError, match="every: 0"):
        box.run(Fields(good, good), 1, every=0)
    with pytest.raises(ValueError, match="electric: not orthogonal to wave_vector"):
        plane_wave([1, 0, 0], [1, 1, 0], np.zeros(4))
    with pytest.raises(ValueError, match="wave_vector: zero"):
        plane_wave([0, 0, 0], [1, 1, 0], np.zeros(4))
