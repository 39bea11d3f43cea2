"""Prediction of the motion of charges: the simulation, the network, and the command that trains it.

``python -m algorithms.learning.charges`` simulates 3,000 motions of five charges for training and 2,000 each for the
selection of the epoch and for the test, trains a network, and prints the mean squared error of the predicted
coordinates.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from generated import particles as kernels

from .algebra import Array
from .network import Network
from .optimizers import Adam, cosine
from .particles import Interaction
from .training import TrainingResult

PARTICLES = 5
"""The number of particles, as in the experiments of Satorras and others (2021)."""
_STEP, _FIRST, _LAST = 1e-3, 3100, 4100
"""The step of the simulation, and the steps of the input and of the target."""
_SPEED = 0.5
"""The speed of particles at the start."""


@dataclass(frozen=True, slots=True, eq=False)
class Motions:
    """Motions of charges: inputs for `Interaction`, and places after the time 1.

    Attributes
    ----------
    inputs : array, (n, 10, 8)
        Places with charges as scalars, then velocities.
    targets : array, (n, 5, 8)
    """

    inputs: Array
    targets: Array


def simulate_charges(count: int, seed: int) -> Motions:
    """Simulate charges of 1 or -1 that start at normally distributed places with the speed 0.5.

    The input is the state after the time 3.1, the target that after 4.1, as in the experiments with equivariant graph
    networks of Satorras, Hoogeboom and Welling (2021).
    """
    random = np.random.default_rng(seed)
    places, velocities = random.normal(size=(2, count, PARTICLES, 3))
    velocities *= _SPEED / np.linalg.norm(velocities, axis=2, keepdims=True)
    charges = random.choice([-1.0, 1.0], size=(count, PARTICLES))
    first, second = np.triu_indices(PARTICLES, 1)
    state, inputs = np.concatenate([places, velocities], 2), np.zeros((count, 2 * PARTICLES, 8))
    for step in range(1, _LAST + 1):
        state = np.asarray(kernels.charged_step(state, charges, first, second, _STEP))
        if step == _FIRST:
            inputs[:, :PARTICLES, 0], inputs[:, :PARTICLES, 1:4] = charges, state[..., :3]
            inputs[:, PARTICLES:, 1:4] = state[..., 3:]
    targets = np.zeros((count, PARTICLES, 8))
    targets[..., 1:4] = state[..., :3]
    return Motions(inputs, targets)


def error_of_places(network: Network, motions: Motions) -> float:
    """Return the mean squared error of the coordinates."""
    found = network.predict(motions.inputs)[..., 1:4]
    return float(np.mean((found - motions.targets[..., 1:4]) ** 2))


def train_charges(
    network: Network, train: Motions, validation: Motions, epochs: int, *, seed: int = 0, report: bool = False
) -> TrainingResult:
    """Train a network for motions; the parameters of the smallest validation error are kept."""
    start = time.perf_counter()

    def progress(epoch: int, loss: float) -> None:
        if report and (epoch % 10 == 9 or epoch == 0):
            error = 2 * loss / (3 * PARTICLES)
            sys.stderr.write(f"epoch {epoch + 1}: training error {error:.5f}, {time.perf_counter() - start:.0f} s\n")

    return network.fit(
        train.inputs, train.targets, Adam(0.002), epochs=epochs, batch=25, schedule=cosine(epochs), clip=0.75,
        validation=(validation.inputs, validation.targets), seed=seed, progress=progress,
    )  # fmt: skip


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m algorithms.learning.charges", description=__doc__)
    parser.add_argument("--samples", type=int, default=3000, help="motions for training")
    parser.add_argument("--tests", type=int, default=2000, help="motions for the validation and for the test")
    parser.add_argument("--epochs", type=int, default=250)
    parser.add_argument("--steps", type=int, default=10, help="steps of the network")
    parser.add_argument("--hidden", type=int, nargs="+", default=[32, 32], help="widths of its real layers")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--save", type=Path, help="file for the network, in numpy's npz format")
    given = parser.parse_args(arguments)
    start = time.process_time()
    counts = (given.samples, given.tests, given.tests)
    train, validation, test = (simulate_charges(count, 3 * given.seed + k) for k, count in enumerate(counts))
    layer = Interaction(PARTICLES, given.steps, tuple(given.hidden))
    network = Network([layer], "G(3)", 2 * PARTICLES, seed=given.seed, dtype=np.float32)
    result = train_charges(network, train, validation, given.epochs, seed=given.seed, report=True)
    if given.save:
        network.save(given.save)
    errors = " | ".join(f"{error_of_places(network, one):.5f}" for one in (train, validation, test))
    print("| status | parameters | training error | validation error | test error | CPU time |")
    print("|---|---|---|---|---|---|")
    print(f"| {result.status.name} | {network.parameters.size} | {errors} | {time.process_time() - start:.0f} s |")


if __name__ == "__main__":
    main()
