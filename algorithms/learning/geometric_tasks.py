"""Tasks whose mappings are products of multivectors: networks of such products beside real networks of equal size.

All networks of a task are trained by L-BFGS with the same number of iterations, on the same samples. A real network
has one hidden layer, or none where the mapping is linear, and at least as many real parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy

from .activations import Split
from .algebra import Algebra, Array
from .base import Layer
from .equivariant import GradeLinear, GradeProduct
from .experiments import Task, placed, taken
from .linear import Linear, TwoSided
from .network import Network


def similarity(seed: int = 0, samples: int = 20) -> Task:
    """Return points turned and scaled by 1.5, with noise of 0.05; training points are near a plane."""
    random = np.random.default_rng(seed)
    turn = 1.5 * scipy.spatial.transform.Rotation.random(random_state=seed).as_matrix()
    x, new = random.uniform(-1, 1, (samples, 3)) * [1, 1, 0.1], random.uniform(-1, 1, (400, 3))
    return Task((x, x @ turn.T + 0.05 * random.normal(size=x.shape)), (new, new @ turn.T))


def quaternions(seed: int = 0, samples: int = 60) -> Task:
    """Return pairs of quaternions and their products, with noise of 0.05."""
    random, algebra = np.random.default_rng(seed), Algebra.of("H")
    x, new = random.uniform(-1, 1, (samples, 2, 4)), random.uniform(-1, 1, (400, 2, 4))
    y, truth = (algebra.product(one[:, 0], one[:, 1]) for one in (x, new))
    noisy = y + 0.05 * random.normal(size=y.shape)
    return Task((x.reshape(-1, 8), noisy), (new.reshape(-1, 8), truth))


def attitude(seed: int = 0, samples: int = 200) -> Task:
    """Return the prediction of the next attitude of a free rigid body from the last two, as unit quaternions."""
    algebra, inertia = Algebra.of("H"), np.array([1.0, 2, 3])
    random = np.random.default_rng(seed)

    def slope(_: float, state: Array) -> Array:
        spin = state[4:]
        turning = algebra.product(state[:4], np.concatenate([[0], spin])) / 2
        return np.concatenate([turning, np.cross(inertia * spin, spin) / inertia])

    start = np.concatenate([[1, 0, 0, 0], random.normal(size=3)])
    times = 0.3 * np.arange(2 * samples + 2)
    states = scipy.integrate.solve_ivp(slope, (0, times[-1]), start, t_eval=times, rtol=1e-9, atol=1e-9).y[:4].T
    x, y = np.concatenate([states[:-2], states[1:-1]], 1), states[2:]
    return Task((x[:samples], y[:samples]), (x[samples:], y[samples:]))


_PRODUCTS: tuple[Layer, ...] = (GradeLinear(2), GradeProduct(), GradeProduct(), GradeLinear(1))
"""A network of two products."""
GEOMETRIC_TASKS: dict[str, tuple[Callable[..., Task], str, Sequence[Layer]]] = {
    "similarity": (similarity, "G(3)", (TwoSided(1),)),
    "quaternions": (quaternions, "H", (GradeProduct(), GradeLinear(1))),
    "attitude": (attitude, "H", _PRODUCTS),
}
"""The task, the algebra and the layers."""


def beside_real(name: str, seed: int, iterations: int = 300) -> tuple[tuple[float, int], tuple[float, int]]:
    """Return the root mean square test error and the number of parameters of the geometric and of the real network."""
    build, algebra_name, layers = GEOMETRIC_TASKS[name]
    task, found = build(seed), []
    inner, out = task.train[0].shape[1], task.train[1].shape[1]
    geometric = Network(layers, algebra_name, placed(task.train[0][:1], Algebra.of(algebra_name)).shape[1], seed=seed)
    hidden = -(-(geometric.parameters.size - out) // (inner + out + 1))
    real: Sequence[Layer] = (Linear(hidden), Split("tanh"), Linear(out))
    if name == "similarity":
        real = (Linear(out, bias=False),)
    for network in (geometric, Network(real, "R", inner, seed=seed)):
        algebra = network.algebra
        inputs, targets = (placed(one, algebra) for one in task.train)
        network.fit(inputs, targets, "lbfgs", epochs=iterations, decay=1e-6)
        values = taken(network.predict(placed(task.test[0], algebra)), out, algebra)
        found.append((float(np.sqrt(np.mean((values - task.test[1]) ** 2))), network.parameters.size))
    return found[0], found[1]
