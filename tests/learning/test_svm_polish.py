"""Solutions for all free variables of a support vector machine."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.learning import CliffordSVC, CliffordSVR, MachineStatus
from algorithms.learning.blade_signs import blade_signs
from algorithms.learning.gram import GramRows
from algorithms.learning.smo import Problem, State, minimise
from algorithms.learning.svm_kernels import KernelSettings, kernel_named
from algorithms.learning.svm_polish import descend

RANDOM = np.random.default_rng(0)
X = RANDOM.normal(size=(120, 3))
TARGETS = np.where(X[:, :2].T + 0.7 * RANDOM.normal(size=(2, 120)) > 0, 1.0, -1.0)


def problem(width: float, name: str = "gabor") -> Problem:
    signs = blade_signs(0, 1)
    kernel = kernel_named(name, KernelSettings(0.1, 1, 0.0, np.full(3, 0.5), signs), False)
    bounds = (-10.0, 10.0) if width else (np.where(TARGETS > 0, 0, -10.0), np.where(TARGETS > 0, 10.0, 0))
    lower, upper = (np.broadcast_to(bound, TARGETS.shape) for bound in bounds)
    return Problem(GramRows(kernel, X, 10.0), signs, TARGETS, lower, upper, width)


@pytest.mark.parametrize("width", [0.0, 0.1])
def test_objective_decreases_within_the_bounds(width: float) -> None:
    given = problem(width)
    state = State.start(given)
    minimise(given, state, 1e-6, 400, True)
    before = given.objective(state.signed, state.gradient)
    assert descend(given, state)
    assert given.objective(state.signed, state.gradient) < before
    assert ((state.signed >= given.lower) & (state.signed <= given.upper)).all()
    assert np.abs(state.signed.sum(1)).max() < 1e-9
    assert np.abs(state.gradient - given.gradient(state.signed)).max() < 1e-9
    rise, fall = given.slopes(state.signed)
    slope = np.where((rise == fall) & (state.signed != 0), state.gradient + rise, np.nan)
    # The derivatives of all free variables of a component are equal: the solution on the face.
    assert (np.nanmax(slope, 1) - np.nanmin(slope, 1)).max() < 1e-6


def test_state_without_free_variables_is_unchanged() -> None:
    given = problem(0.0)
    state = State.start(given)
    assert not descend(given, state) and not state.signed.any()


def test_coupled_machine_with_large_penalties_needs_few_steps() -> None:
    bits = TARGETS.T > 0
    machine = CliffordSVC("gabor", C=1000.0, gamma=0.1, code="compact").fit(X, bits @ [1, 2])
    assert machine.status_ is MachineStatus.OK and machine.n_iter_ < 20 * TARGETS.size
    line = CliffordSVR(C=100.0, gamma=2.0, epsilon=0.01).fit(X[:, :1], np.sin(X))
    assert line.status_ is MachineStatus.OK
