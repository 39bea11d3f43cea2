"""Tasks of chapter 16: mappings, an encoder and decoder, prediction; and the same task in several algebras."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from .activations import Split
from .algebra import Algebra, Array
from .linear import Linear
from .network import Network


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Inputs and targets, (samples, numbers), for training and for tests."""

    train: tuple[Array, Array]
    test: tuple[Array, Array]


def _moebius(points: Array) -> Array:
    z = points[:, 0] + 1j * points[:, 1]
    w = ((0.6 + 0.2j) * z + 0.1 - 0.3j) / (0.3j * z + 1.2)
    return np.stack([w.real, w.imag], 1)


def moebius(seed: int = 0, samples: int = 60) -> Task:
    """Return the mapping ``(a z + b) / (c z + d)`` of the square with the corners 1+i and -1-i."""
    random = np.random.default_rng(seed)
    x, new = random.uniform(-1, 1, (samples, 2)), random.uniform(-1, 1, (400, 2))
    return Task((x, _moebius(x)), (new, _moebius(new)))


def turned(seed: int = 0, samples: int = 40) -> Task:
    """Return points turned by 60 degrees about (1, 1, 1) and scaled by 0.5; training points are near a plane."""
    random = np.random.default_rng(seed)
    axis, angle = np.ones(3) / np.sqrt(3), np.pi / 3

    def image(x: Array) -> Array:
        along = (x @ axis)[:, None] * axis
        return np.asarray(0.5 * (along + np.cos(angle) * (x - along) + np.sin(angle) * np.cross(axis, x)))

    x, new = random.uniform(-1, 1, (samples, 3)) * [1, 1, 0.1], random.uniform(-1, 1, (400, 3))
    return Task((x, image(x)), (new, image(new)))


def lorenz(seed: int = 0, samples: int = 300) -> Task:
    """Return the prediction of the next state of the Lorenz system after 0.05, states divided by 30."""

    def slope(_: float, s: Array) -> list[float]:
        return [10 * (s[1] - s[0]), s[0] * (28 - s[2]) - s[1], s[0] * s[1] - 8 / 3 * s[2]]

    start = np.array([1.0, 1, 1]) + 0.1 * np.random.default_rng(seed).normal(size=3)
    times = 10 + 0.05 * np.arange(2 * samples + 1)
    states = scipy.integrate.solve_ivp(slope, (0, times[-1]), start, t_eval=times, rtol=1e-9, atol=1e-9).y.T / 30
    states = states - [0, 0, 0.8]
    return Task((states[:samples], states[1 : samples + 1]), (states[samples:-1], states[samples + 1 :]))


TASKS = {"moebius": moebius, "turned": turned, "lorenz": lorenz}


def placed(values: Array, algebra: Algebra) -> Array:
    """Place the numbers of each sample: as a vector if they are as many, else in the first blades, else in channels."""
    count = values.shape[1]
    if count == algebra.n or count > algebra.size:
        start, width = (1, count) if count == algebra.n else (0, algebra.size)
    else:
        start, width = 0, count
    channels = -(-count // width)
    found = np.zeros((len(values), channels, algebra.size))
    padded = np.zeros((len(values), channels * width))
    padded[:, :count] = values
    found[..., start : start + width] = padded.reshape(len(values), channels, width)
    return found


def taken(elements: Array, count: int, algebra: Algebra) -> Array:
    """Return the numbers that `placed` has placed."""
    mask = placed(np.ones((1, count)), algebra)[0].astype(bool)
    return np.asarray(elements[:, mask])


def trained(task: Task, algebra: str | Algebra, parameters: int, seed: int, iterations: int = 300) -> tuple[float, int]:
    """Train a network with one hidden layer; return the root mean square test error and the number of parameters.

    The number of hidden neurons is the one for which the number of real parameters is closest to `parameters`.
    """
    algebra = Algebra.of(algebra)
    (x, y), (new, truth) = task.train, task.test
    inputs, targets = placed(x, algebra), placed(y, algebra)
    cin, cout, size = inputs.shape[1], targets.shape[1], algebra.size
    hidden = max(1, round((parameters / size - cout) / (cin + cout + 1)))
    network = Network([Linear(hidden), Split("tanh"), Linear(cout)], algebra, cin, seed=seed)
    network.fit(inputs, targets, "lbfgs", epochs=iterations, decay=1e-8)
    found = taken(network.predict(placed(new, algebra)), y.shape[1], algebra)
    return float(np.sqrt(np.mean((found - truth) ** 2))), network.parameters.size


def encoder(seed: int, algebra: str = "G(3)") -> tuple[Network, bool]:
    """Train an encoder and decoder of the 8 corners of a cube, as vectors, through one hidden multivector.

    Returns
    -------
    network : Network
    reproduced : bool
        Whether the signs of all coordinates of all corners are reproduced.
    """
    corners = np.stack(np.meshgrid(*[[-0.8, 0.8]] * 3, indexing="ij"), -1).reshape(-1, 3)
    x = placed(corners, Algebra.of(algebra))
    network = Network([Linear(1), Split("tanh"), Linear(1), Split("tanh")], algebra, 1, seed=seed)
    network.fit(x, x, "lbfgs", epochs=500)
    found = taken(network.predict(x), 3, Algebra.of(algebra))
    return network, bool((np.sign(found) == np.sign(corners)).all() and np.abs(found - corners).max() < 0.05)


def compare(name: str, algebras: list[str], parameters: int, seeds: int) -> list[tuple[str, int, float]]:
    """Return the algebra, the number of real parameters and the median test error, for every algebra."""
    rows = []
    for algebra in algebras:
        results = [trained(TASKS[name](seed), algebra, parameters, seed) for seed in range(seeds)]
        rows.append((algebra, results[0][1], float(np.median([error for error, _ in results]))))
    return rows
