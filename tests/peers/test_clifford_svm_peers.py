"""Clifford support vector machines compared with scikit-learn and with Clarabel."""

from __future__ import annotations

import importlib
import warnings
from typing import Any

import numpy as np
import pytest

from algorithms.learning import CliffordSVC, CliffordSVR, Linear, MachineStatus, Network, train_classifier
from algorithms.learning.blade_signs import blade_signs
from algorithms.learning.gram import expanded
from algorithms.learning.svm_experiments import CovariantKernel, curves, rotor_error, rotor_windows, spirals

pytestmark = pytest.mark.peers
svm = pytest.importorskip("sklearn.svm")
base = pytest.importorskip("sklearn.base")
RANDOM = np.random.default_rng(5)


EQUIVALENCE = {"check_sample_weight_equivalence_on_dense_data", "check_sample_weight_equivalence_on_sparse_data"}
"""With gamma="scale", the kernel depends on the variance of all samples, as that of scikit-learn does; and machines are
right within `tol`, which is greater than the 1e-7 of the checks."""
GIVEN = {"check_positive_only_tag_during_fit", "check_estimators_dtypes"}
"""The checks pass samples that are no kernels, and kernels rounded to whole numbers, which have the eigenvalue -2."""


@pytest.mark.parametrize(
    ("machine", "failing"),
    [
        (CliffordSVC(), EQUIVALENCE),
        (CliffordSVC(gamma=0.1, tol=1e-10), set()),
        (CliffordSVC("linear", tol=1e-10), set()),
        (CliffordSVR(gamma=0.1, tol=1e-9), set()),
        (CliffordSVR("linear", tol=1e-9), set()),
        pytest.param(CliffordSVC("gabor"), EQUIVALENCE, marks=pytest.mark.slow),
        pytest.param(CliffordSVR("gabor"), EQUIVALENCE, marks=pytest.mark.slow),
        pytest.param(CliffordSVC(code="compact"), EQUIVALENCE, marks=pytest.mark.slow),
        pytest.param(CliffordSVC(algebra=(0, 3)), EQUIVALENCE, marks=pytest.mark.slow),
        # Features that are not scaled give kernels up to 1e12, for which the limit of steps is reached.
        pytest.param(CliffordSVC("polynomial", max_iter=3000), EQUIVALENCE, marks=pytest.mark.slow),
        pytest.param(CliffordSVR("polynomial", max_iter=3000), EQUIVALENCE, marks=pytest.mark.slow),
        pytest.param(CliffordSVC("precomputed"), GIVEN, marks=pytest.mark.slow),
        pytest.param(CliffordSVR("precomputed"), GIVEN, marks=pytest.mark.slow),
        # The greatest probability can belong to another class than the least loss.
        pytest.param(CliffordSVC(probability=True), EQUIVALENCE | {"check_classifiers_train"}, marks=pytest.mark.slow),
    ],
)
def test_checks_of_estimators_pass(machine: CliffordSVC | CliffordSVR, failing: set[str]) -> None:
    checks = pytest.importorskip("sklearn.utils.estimator_checks")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = checks.check_estimator(machine, on_fail=None)
    assert len(found) > 40 and {c["check_name"] for c in found if c["status"] == "failed"} == failing


def _dual_objective(machine: Any, gram: np.ndarray, x: np.ndarray) -> float:
    signed = np.zeros(len(x))
    signed[machine.support_] = machine.dual_coef_[0]
    return float(signed @ gram @ signed / 2 - np.abs(signed).sum())


@pytest.mark.parametrize("n", [150, 900])
@pytest.mark.parametrize("weighted", [False, True])
def test_optimum_is_that_of_scikit_learn(n: int, weighted: bool) -> None:
    random = np.random.default_rng(n)
    x = random.normal(size=(n, 4))
    y = (x[:, 0] * x[:, 1] + 0.3 * random.normal(size=n) > 0).astype(int)
    weight = random.uniform(0, 3, n) if weighted else None
    options: dict[str, Any] = {"C": 3.0, "gamma": 0.3, "class_weight": {0: 2.0} if weighted else None}
    ours = CliffordSVC(tol=1e-9, **options).fit(x, y, sample_weight=weight)
    peer = svm.SVC(tol=1e-9, **options).fit(x, y, sample_weight=weight)
    gram = np.exp(-0.3 * ((x[:, None] - x) ** 2).sum(2))
    wanted = _dual_objective(peer, gram, x)
    assert abs(ours.dual_objective_ - wanted) < 1e-9 * abs(wanted)
    # scikit-learn stores kernels in single precision.
    assert np.abs(ours.decision_function(x) - peer.decision_function(x)).max() < 1e-5


def test_kernels_in_single_precision() -> None:
    """Their eigenvalues may be negative by rounding; those of other kernels that are not definite are refused."""
    random = np.random.default_rng(0)
    x = random.normal(size=(300, 3))
    y = (x[:, 0] * x[:, 1] > 0).astype(int)
    gram = np.exp(-0.1 * ((x[:, None] - x) ** 2).sum(2)).astype(np.float32)
    assert np.linalg.eigvalsh(gram.astype(float)).min() < -1e-7
    ours, peer = CliffordSVC("precomputed", C=10.0).fit(gram, y), svm.SVC(kernel="precomputed", C=10.0, tol=1e-6)
    wanted = peer.fit(gram.astype(float), y).decision_function(gram)
    assert ours.status_ is MachineStatus.OK and np.abs(ours.decision_function(gram) - wanted).max() < 1e-5
    gram[0, 1] = gram[1, 0] = 1 + 1e-2
    with pytest.raises(ValueError, match="kernel: not positive definite on these samples, smallest eigenvalue -"):
        CliffordSVC("precomputed").fit(gram, y)


def test_unscaled_linear_machine_is_not_worse_than_that_of_scikit_learn() -> None:
    load = importlib.import_module("sklearn.datasets").load_breast_cancer
    x, y = load(return_X_y=True)
    ours, peer = CliffordSVC("linear").fit(x, y), svm.SVC(kernel="linear", tol=1e-3).fit(x, y)
    assert ours.status_ is MachineStatus.OK
    assert ours.dual_objective_ <= _dual_objective(peer, x @ x.T, x)
    # The conditions of optimality, from the margins alone.
    margin = (2 * y - 1) * (x @ ours.coef_[0] + ours.intercept_[0])
    alpha = np.zeros(len(x))
    alpha[ours.support_] = np.abs(ours.dual_coef_[0])
    assert margin[alpha == 0].min() > 1 - 1e-5 and margin[alpha == 1].max() < 1 + 1e-5
    assert np.abs(margin[(alpha > 0) & (alpha < 1)] - 1).max() < 1e-5


def test_networks_and_classifiers_can_be_cloned() -> None:
    network = Network([Linear(3)], algebra="C", channels=2, seed=5)
    start = network.parameters.copy()
    network.parameters += 1
    clone = base.clone(network)
    assert clone is not network and np.array_equal(clone.parameters, start)
    x = RANDOM.normal(size=(20, 3))
    classifier = train_classifier(x, np.arange(20) % 2, hidden=2, members=1, iterations=2)
    assert np.array_equal(base.clone(classifier).probabilities(x), classifier.probabilities(x))


def test_pipelines_and_cross_validation() -> None:
    load_iris, search_grid, pipeline, scaler = (
        getattr(importlib.import_module(f"sklearn.{module}"), name)
        for module, name in (
            ("datasets", "load_iris"),
            ("model_selection", "GridSearchCV"),
            ("pipeline", "make_pipeline"),
            ("preprocessing", "StandardScaler"),
        )
    )
    x, y = load_iris(return_X_y=True)
    search = search_grid(pipeline(scaler(), CliffordSVC()), {"cliffordsvc__C": [1.0, 10.0]}, cv=3)
    assert search.fit(x, y).best_score_ > 0.93
    assert base.clone(CliffordSVC(C=3.0)).get_params()["C"] == 3.0


def test_components_of_a_scalar_kernel_are_machines_of_scikit_learn() -> None:
    x, y = spirals(32)
    machine = CliffordSVC(C=50.0, gamma=0.05, code="compact").fit(x, y)
    for values, signs in zip(machine.components(x).T, machine.code_.T, strict=True):
        peer = svm.SVC(C=50.0, gamma=0.05, tol=1e-8).fit(x, signs[y])
        assert np.abs(peer.decision_function(x) - values).max() < 1e-5


def test_regression_of_a_scalar_kernel_is_that_of_scikit_learn() -> None:
    t = np.linspace(0, 1, 20)[:, None]
    y = curves(t[:, 0]) + 0.05 * RANDOM.normal(size=(20, 9))
    machine = CliffordSVR(C=5.0, gamma=30.0, epsilon=0.05).fit(t, y)
    peers = [svm.SVR(C=5.0, gamma=30.0, epsilon=0.05, tol=1e-8).fit(t, column).predict(t) for column in y.T]
    assert np.abs(machine.predict(t) - np.transpose(peers)).max() < 1e-5


def test_coupled_components_predict_rotors_better_than_separate_ones() -> None:
    recording = dict(np.load("tests/data/estimation/broad_06_fast_rotation.npz"))
    train, test = rotor_windows(recording, 200, 0, 2600, 0), rotor_windows(recording, 400, 2700, 5300, 1)
    machine = CliffordSVR(CovariantKernel(0.02), C=30.0, epsilon=0.02, algebra=(0, 2), max_iter=10000)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ours = rotor_error(machine.fit(train.samples, train.rotors).predict(test.samples), test.rotors)
    flat, other = (w.samples.reshape(len(w.samples), -1) for w in (train, test))
    for C, gamma in ((10.0, 0.01), (100.0, 0.003), (100.0, 0.01), (100.0, 0.03)):
        peers = [svm.SVR(C=C, gamma=gamma, epsilon=0.02).fit(flat, c).predict(other) for c in train.rotors.T]
        assert ours < 0.9 * rotor_error(np.transpose(peers), test.rotors)


def _by_clarabel(matrix: np.ndarray, targets: np.ndarray, lower: np.ndarray, upper: np.ndarray, width: float) -> float:
    """Return the least dual objective. Variables are split into their positive and negative parts."""
    clarabel = pytest.importorskip("clarabel")
    from scipy import sparse

    m, n = targets.shape
    split = np.hstack([np.eye(m * n), -np.eye(m * n)])
    linear = np.concatenate([width - targets.ravel(), width + targets.ravel()])
    bounds = np.concatenate([upper.ravel(), -lower.ravel()])
    sums = np.kron(np.eye(m), np.ones(n)) @ split
    rows = np.vstack([sums, np.eye(2 * m * n), -np.eye(2 * m * n)])
    right = np.concatenate([np.zeros(m), bounds, np.zeros(2 * m * n)])
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_rel = settings.tol_gap_abs = settings.tol_feas = 1e-11
    hessian = sparse.triu(sparse.csc_matrix(split.T @ matrix @ split)).tocsc()
    cones = [clarabel.ZeroConeT(m), clarabel.NonnegativeConeT(4 * m * n)]
    solver = clarabel.DefaultSolver(hessian, linear, sparse.csc_matrix(rows), right, cones, settings)
    return float(solver.solve().obj_val)


@pytest.mark.parametrize("name", ["scalar", "gabor", "linear", "polynomial"])
@pytest.mark.parametrize("width", [0.0, 0.1])
def test_dual_objectives_are_those_of_clarabel(name: str, width: float) -> None:
    random = np.random.default_rng(11)
    algebra = (0, 1) if name == "polynomial" else (0, 2)
    size = 2 ** sum(algebra)
    x = random.normal(size=(30, 2, size))
    settings: dict[str, Any] = {"gamma": 0.2, "degree": 2, "algebra": algebra, "C": 2.0}
    machine: CliffordSVC | CliffordSVR
    if width:
        targets = (x[:, 0] + 0.2 * random.normal(size=(30, size))).T
        machine = CliffordSVR(name, epsilon=width, **settings).fit(x, targets.T)
        lower, upper = np.full(targets.shape, -2.0), np.full(targets.shape, 2.0)
    else:
        y = np.arange(30) % 2**size
        machine = classifier = CliffordSVC(name, code="compact", **settings).fit(x, y)
        targets = classifier.code_[y % 2**size].T.astype(float)
        lower, upper = np.where(targets > 0, 0, -2.0), np.where(targets > 0, 2.0, 0)
    matrix = expanded(machine._kernel.values(x, x), len(targets), blade_signs(*algebra))
    truth = _by_clarabel(matrix, targets, lower, upper, width)
    assert abs(machine.dual_objective_ - truth) < 1e-6 * max(1, abs(truth))
