"""Networks of interacting particles: their symmetries, gradients and training, and the simulation of charges."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from algorithms.learning import Interaction, Linear, Network
from algorithms.learning.charges import error_of_places, main, simulate_charges, train_charges
from tests.support.layer_gradients import check_gradient

MOTIONS = simulate_charges(60, 5)


def network(particles: int = 5, **options: object) -> Network:
    found = Network([Interaction(particles, steps=3, hidden=(6, 5))], "G(3)", 2 * particles, **options)  # type: ignore[arg-type]
    found.parameters += 0.3 * np.random.default_rng(1).normal(size=found.parameters.shape)
    return found


def test_predictions_move_with_the_particles() -> None:
    one = network()
    x = MOTIONS.inputs
    before = one.predict(x)[..., 1:4]
    for seed in range(5):
        turn = Rotation.random(random_state=seed).as_matrix() * (-1) ** seed
        shift = np.random.default_rng(seed).normal(size=3)
        moved = x.copy()
        moved[..., 1:4] = x[..., 1:4] @ turn.T
        moved[:, :5, 1:4] += shift
        assert np.abs(one.predict(moved)[..., 1:4] - before @ turn.T - shift).max() < 1e-12


def test_predictions_do_not_depend_on_the_order_of_particles() -> None:
    one, order = network(), np.random.default_rng(2).permutation(5)
    x = MOTIONS.inputs
    assert np.abs(one.predict(x[:, [*order, *order + 5]]) - one.predict(x)[:, order]).max() < 1e-12


def test_messages_keep_the_mean_velocity() -> None:
    one = Interaction(5, steps=4)
    random = np.random.default_rng(3)
    parameters = one.initial(Network([one], "G(3)", 10).algebra, 10, random)
    states, _ = one._states(MOTIONS.inputs, parameters)
    assert np.abs(states[-1][..., 3:].sum(1) - states[0][..., 3:].sum(1)).max() < 1e-12
    assert np.abs(states[-1][..., 3:] - states[0][..., 3:]).max() > 1e-3


@pytest.mark.parametrize("particles", [2, 3])
def test_gradients(particles: int) -> None:
    layer = Interaction(particles, steps=2, hidden=(4,))
    check_gradient(layer, Network([layer], "G(3)", 2 * particles).algebra, 2 * particles)


def test_gradient_of_the_loss_in_single_precision() -> None:
    x, y = MOTIONS.inputs, MOTIONS.targets
    gradients = [network(dtype=dtype).gradient(x, y)[1] for dtype in (np.float64, np.float32)]
    assert gradients[1].dtype == np.float32
    assert np.abs(gradients[1] - gradients[0]).max() < 2e-4 * np.abs(gradients[0]).max()


def test_training_decreases_the_error() -> None:
    one = Network([Interaction(5, steps=4, hidden=(8,))], "G(3)", 10)
    before = error_of_places(one, MOTIONS)
    result = train_charges(one, MOTIONS, MOTIONS, 25)
    assert result.status.name == "OK" and error_of_places(one, MOTIONS) < 0.7 * before
    straight = MOTIONS.inputs[:, :5, 1:4] + 0.73 * MOTIONS.inputs[:, 5:, 1:4]
    assert error_of_places(one, MOTIONS) < np.mean((straight - MOTIONS.targets[..., 1:4]) ** 2)


def test_saved_network_is_equal(tmp_path: Path) -> None:
    one = network()
    one.save(tmp_path / "n.npz")
    assert np.array_equal(Network.load(tmp_path / "n.npz").predict(MOTIONS.inputs), one.predict(MOTIONS.inputs))


def test_simulation_follows_coulombs_law() -> None:
    x = MOTIONS.inputs[:8]
    for inputs, target in zip(x, MOTIONS.targets, strict=False):
        charges, state = inputs[:5, 0], np.concatenate([inputs[:5, 1:4], inputs[5:, 1:4]])

        def slope(_: float, flat: np.ndarray, charges: np.ndarray = charges) -> np.ndarray:
            places, velocities = flat.reshape(2, 5, 3)
            offset = places[:, None] - places
            cube = np.linalg.norm(offset, axis=2) ** 3 + np.eye(5)
            forces = ((charges[:, None] * charges / cube)[..., None] * offset).sum(1)
            return np.concatenate([velocities, forces]).ravel()

        found = solve_ivp(slope, (0, 1), state.ravel(), rtol=1e-9, atol=1e-9)
        distances = found.y.reshape(2, 5, 3, -1)[0]
        nearest = np.linalg.norm(distances[:, None] - distances + 10 * np.eye(5)[..., None, None], axis=2).min()
        if nearest > 0.3:
            assert np.abs(found.y[:15, -1].reshape(5, 3) - target[:, 1:4]).max() < 0.02
    assert np.array_equal(simulate_charges(3, 1).inputs, simulate_charges(3, 1).inputs)


def test_wrong_channels_name_what_is_expected() -> None:
    with pytest.raises(ValueError, match="10 channels: 5 places with charges, then 5 velocities"):
        Network([Interaction(5)], "G(3)", 9)
    with pytest.raises(ValueError, match=r"expected G\(3\)"):
        Network([Interaction(5)], "G(2)", 10)
    with pytest.raises(ValueError, match="at least two particles"):
        Interaction(1)
    with pytest.raises(ValueError, match="clip"):
        Network([Linear(1)], channels=10).fit(MOTIONS.inputs, MOTIONS.inputs[:, :1], clip=-1.0)


def test_command_prints_a_table(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    given = ["--samples", "30", "--tests", "10", "--epochs", "2", "--steps", "2", "--hidden", "4"]
    main([*given, "--save", str(tmp_path / "n.npz")])
    printed = capsys.readouterr()
    assert "| OK | 40 |" in printed.out and "epoch 1: training error" in printed.err
    assert Network.load(tmp_path / "n.npz").parameters.size == 40


@pytest.mark.slow
def test_error_after_a_short_training() -> None:
    train, test = simulate_charges(500, 1), simulate_charges(200, 2)
    one = Network([Interaction(5)], "G(3)", 10, dtype=np.float32)
    train_charges(one, train, test, 15)
    # Seeds 0, 1 and 2 have .018, .022 and .017; the networks start from .120 to .124.
    assert error_of_places(one, test) < 0.03
