"""Clifford support vector machines: kernels, conditions of optimality, statuses, spirals and point sets."""

from __future__ import annotations

import itertools
import pickle

import numpy as np

from algorithms.learning import CliffordSVC, CliffordSVR, MachineStatus
from algorithms.learning.blade_signs import blade_signs
from algorithms.learning.codes import code_distance, code_of_classes
from algorithms.learning.gram import expanded
from algorithms.learning.svm_experiments import curves, multivectors_of_points, point_sets, spirals
from algorithms.learning.svm_kernels import KernelSettings, kernel_named
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(3)


def _product(p: int, q: int, a: list[int], b: list[int]) -> tuple[int, list[int]]:
    """Multiply lists of basis vectors by swaps, without tables."""
    word, sign = [*a, *b], 1
    for end, k in itertools.product(range(len(word)), range(len(word) - 1)):
        del end
        if word[k] > word[k + 1]:
            word[k], word[k + 1], sign = word[k + 1], word[k], -sign
    k = 0
    while k + 1 < len(word):
        if word[k] == word[k + 1]:
            sign *= 1 if word[k] < p else -1
            del word[k : k + 2]
            k = 0
        else:
            k += 1
    return sign, word


@all_cases("p, q", [(0, 1), (0, 2), (3, 0), (1, 1), (2, 1), (4, 1)])
def test_signs_are_those_of_products_of_vectors(p: int, q: int) -> None:
    table = blade_signs(p, q)
    words = [[k for k in range(p + q) if b >> k & 1] for b in range(table.size)]
    for a, b in itertools.product(range(table.size), repeat=2):
        sign, word = _product(p, q, words[a], words[b])
        assert (sign, word) == (table.sign[a, b], words[a ^ b])


@all_cases("algebra", [(0, 2), (3, 0), (1, 1), (2, 1)])
@all_cases("name", ["linear", "gabor", "scalar"])
def test_gram_matrices_are_symmetric_and_positive_semidefinite(algebra: tuple[int, int], name: str) -> None:
    signs = blade_signs(*algebra)
    x = RANDOM.normal(size=(12, 3, signs.size))
    kernel = kernel_named(name, KernelSettings(0.05, 3, 1.0, np.full(3 * signs.size, 0.3), signs), True)
    matrix = expanded(kernel.values(x, x), signs.size, signs)
    assert np.abs(matrix - matrix.T).max() < 1e-12
    assert np.linalg.eigvalsh(matrix)[0] > -1e-10 * np.abs(matrix).max()
    assert np.allclose(kernel.diagonal(x), np.diag(matrix)[: len(x)])


def test_linear_gram_matrix_is_that_of_products_with_inverse_blades() -> None:
    # <x e_l^-1, y e_j^-1> as coefficients, with right multiplication by an independent matrix of each blade.
    signs = blade_signs(2, 1)
    x = RANDOM.normal(size=(4, 2, 8))
    right = np.zeros((8, 8, 8))
    for blade, a in itertools.product(range(8), repeat=2):
        words = [[k for k in range(3) if b >> k & 1] for b in (a, blade)]
        inverse = _product(2, 1, words[1], words[1])[0]
        right[blade, a ^ blade, a] = inverse * _product(2, 1, *words)[0]
    moved = np.einsum("lca,nda->lndc", right, x).reshape(8 * 4, -1)
    kernel = kernel_named("linear", KernelSettings(1.0, 1, 0.0, np.zeros(16), signs), True)
    assert np.allclose(expanded(kernel.values(x, x), 8, signs), moved @ moved.T)


def _violation(machine: CliffordSVC, x: np.ndarray, y: np.ndarray) -> float:
    """Return how far the conditions of optimality are violated, from predicted values alone."""
    targets = machine.code_[np.searchsorted(machine.classes_, y)]
    signed = np.zeros(targets.shape)
    signed[machine.support_] = machine.dual_coef_.T
    margin = targets * machine.components(x)
    alpha = signed * targets
    assert alpha.min() >= 0 and alpha.max() <= machine.C and np.abs(signed.sum(0)).max() < 1e-8 * machine.C
    short, wide = np.where(alpha < machine.C, 1 - margin, 0), np.where(alpha > 0, margin - 1, 0)
    return float(max(short.max(), wide.max()))


@all_cases("name", ["scalar", "gabor", "linear"])
@all_cases("C", [0.1, 1.0])
@all_cases("cache_size", [200.0, 0.02])
def test_conditions_of_optimality_hold(name: str, C: float, cache_size: float) -> None:
    random = np.random.default_rng(7)
    x = random.normal(size=(60, 3, 4))
    y = (x[:, 0, 0] + 0.5 * random.normal(size=60) > 0) + 2 * (x[:, 1, 2] > 0)
    machine = CliffordSVC(name, C=C, gamma=0.2, code="compact", algebra=(0, 2), cache_size=cache_size).fit(x, y)
    assert machine.status_ is MachineStatus.OK and machine.gap_ <= 1e-6
    assert _violation(machine, x, y) < 2e-6


def test_shrinking_does_not_change_the_result() -> None:
    random = np.random.default_rng(1)
    x = random.normal(size=(400, 4))
    y = np.sign(x[:, 0] + random.normal(size=400))
    one, two = (CliffordSVC(C=1.0, gamma=0.1, shrinking=s).fit(x, y) for s in (True, False))
    assert abs(one.dual_objective_ - two.dual_objective_) < 1e-6 * abs(two.dual_objective_)
    assert np.abs(one.decision_function(x) - two.decision_function(x)).max() < 1e-4


def test_five_spirals_with_one_machine() -> None:
    machine = CliffordSVC(kernel="scalar", C=1e4, gamma=0.05).fit(*spirals(32))
    points, labels = spirals(317)
    assert len(points) == 1585 and machine.score(points, labels) >= 0.987
    assert machine.score(*spirals(32)) == 1 and machine.status_ is MachineStatus.OK
    assert machine.multivectors(points).shape == (1585, 8)


def test_a_quaternion_codes_sixteen_classes() -> None:
    y = np.arange(64) % 16
    x = np.column_stack([y >> k & 1 for k in range(4)]) + 0.1 * np.random.default_rng(0).normal(size=(64, 4))
    machine = CliffordSVC(C=10.0, code="compact").fit(x, y)
    assert machine.code_.shape == (16, 4) and machine.multivectors(x).shape == (64, 4)
    assert machine.score(x, y) == 1


def test_codes_with_more_components_are_further_apart() -> None:
    classes = np.arange(5)
    assert [code_distance(code_of_classes(m, classes)) for m in (3, 5, 8)] == [1, 2, 4]
    assert code_distance(code_of_classes("one-vs-rest", classes)) == 2


def test_point_sets_are_recognised() -> None:
    train, test, hidden = point_sets(20, 120, 0), point_sets(10, 120, 1), point_sets(10, 120, 2, occluded=0.2)
    machine = CliffordSVC(C=100.0).fit(multivectors_of_points(train).reshape(120, -1), train.labels)
    scores = [machine.score(multivectors_of_points(s).reshape(60, -1), s.labels) for s in (test, hidden)]
    assert scores[0] >= 0.95


def test_curves_are_interpolated() -> None:
    t, dense = np.linspace(0, 1, 20), np.linspace(0, 1, 400)
    machine = CliffordSVR(C=100.0, gamma=100.0, epsilon=0.01).fit(t[:, None], curves(t))
    assert machine.status_ is MachineStatus.OK and np.abs(machine.predict(t[:, None]) - curves(t)).max() < 0.011
    error = machine.predict(dense[:, None]) - curves(dense)
    assert np.sqrt((error**2).mean()) < 0.03


def test_complex_regression_recovers_a_similarity() -> None:
    z, weight = RANDOM.normal(size=(30, 2)), np.array([0.6, -1.2])
    a, b = weight
    y = np.column_stack([1 + a * z[:, 0] - b * z[:, 1], 2 + b * z[:, 0] + a * z[:, 1]])
    machine = CliffordSVR("linear", C=1.0, epsilon=0.01, algebra=(0, 1)).fit(z[:, None], y)
    assert machine.status_ is MachineStatus.OK and np.abs(machine.predict(z[:, None]) - y).max() < 0.011
    assert np.allclose(machine.intercept_, [1, 2], atol=0.02)


def test_a_fitted_machine_can_be_pickled() -> None:
    x, y = spirals(8)
    machine = CliffordSVC("gabor", gamma=0.05).fit(x, y)
    assert np.array_equal(pickle.loads(pickle.dumps(machine)).predict(x), machine.predict(x))
