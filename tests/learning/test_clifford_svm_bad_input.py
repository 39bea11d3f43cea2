"""Errors and warnings of Clifford support vector machines."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.learning import CliffordSVC, CliffordSVR, MachineStatus
from algorithms.learning.estimators import ContradictionWarning
from tests.support.all_cases import all_cases

X = np.random.default_rng(0).normal(size=(20, 3))
Y = (X[:, 0] > 0).astype(int)
M = np.random.default_rng(1).normal(size=(20, 2, 4))


@all_cases(
    "x, y, text",
    [
        (np.where(np.arange(60).reshape(20, 3) == 4, np.nan, X), Y, "nan at \\(1, 1\\)"),
        (X, np.zeros(20), "greater than one"),
        (np.ones((20, 3)), Y, "all features are constant"),
        (X[:0], Y[:0], "0 sample"),
        (X[:, :0], Y, "0 feature"),
        (X[:, 0], Y, "Expected 2D array"),
        (M, Y, "algebra=\\(p, q\\)"),
        (X, Y[:5], "one label for each of 20"),
        (X, np.where(Y, np.nan, 1.0), "NaN"),
        (X + 0j, Y, "Complex data not supported"),
    ],
)
def test_samples_that_cannot_be_used(x: np.ndarray, y: np.ndarray, text: str) -> None:
    with pytest.raises(ValueError, match=text):
        CliffordSVC().fit(x, y)


@all_cases(
    "parameters, text",
    [
        ({"kernel": "sigmoid"}, "kernel: 'sigmoid'"),
        ({"C": 0}, "C: 0"),
        ({"gamma": "automatic"}, "gamma: 'automatic'"),
        ({"frequency": [1.0]}, "frequency"),
        ({"algebra": (3, 0, 1)}, "square 0"),
        ({"algebra": (4, 4)}, "at most 6"),
        ({"algebra": (0, 0), "code": 2}, "at least 2"),
        ({"kernel": "gabor", "algebra": (1, 0)}, "square -1"),
        ({"code": {0: [1, 1]}}, "label 1 is outside the code"),
        ({"code": {0: [1], 1: [1]}}, "same signs"),
        ({"code": "gray"}, "code: 'gray'"),
        ({"max_iter": -2}, "max_iter"),
    ],
)
def test_parameters_that_cannot_be_used(parameters: dict[str, Any], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        CliffordSVC(**parameters).fit(X, Y)


def test_multivectors_of_another_algebra() -> None:
    with pytest.raises(ValueError, match="8 basis blades"):
        CliffordSVC(algebra=(3, 0)).fit(M, Y)
    with pytest.raises(TypeError, match="signature"):
        CliffordSVC(algebra="G3").fit(M, Y)


def test_kernels_that_are_not_definite_are_refused_with_their_eigenvalue() -> None:
    with pytest.raises(ValueError, match=r"smallest eigenvalue -") as caught:
        CliffordSVC(lambda a, b: -np.exp(-((a[:, None] - b) ** 2).sum(2))).fit(X, Y)
    found = float(str(caught.value).split("smallest eigenvalue ")[1].split(";")[0])
    truth = np.linalg.eigvalsh(-np.exp(-((X[:, None] - X) ** 2).sum(2)))[0]
    assert abs(found - truth) < 1e-2 * abs(truth)
    with pytest.raises(ValueError, match="smallest eigenvalue"):
        CliffordSVC("polynomial", algebra=(3, 0), code=4).fit(np.random.default_rng(2).normal(size=(20, 2, 8)), Y)


@pytest.mark.parametrize(("kernel", "gamma"), [("rbf", 1.0), ("rbf", "scale"), ("gabor", 1.0), ("linear", 1.0)])
@pytest.mark.filterwarnings("ignore:.*encountered in:RuntimeWarning")
def test_features_whose_squares_overflow_are_named(kernel: str, gamma: Any) -> None:
    with pytest.raises(ValueError, match="not finite; expected finite numbers; scale the features"):
        CliffordSVC(kernel, gamma=gamma).fit(1e200 * X, Y)


def test_the_limit_of_the_check_is_that_of_the_matrix() -> None:
    labels = np.arange(600) % 10
    assert (CliffordSVC("precomputed").fit(np.eye(600), labels).predict(np.eye(600)) == labels).all()
    with pytest.raises(ValueError, match="6000 variables are too many"):
        CliffordSVC(lambda a, b: np.ones((len(a), len(b), 16))).fit(np.arange(600.0)[:, None], labels)


def test_contradictory_labels_are_reported_and_bounded() -> None:
    with pytest.warns(ContradictionWarning, match="20 samples"):
        machine = CliffordSVC().fit(np.vstack([X, X]), np.concatenate([Y, 1 - Y]))
    assert machine.status_ is MachineStatus.OK and np.abs(machine.dual_coef_).max() <= machine.C


def test_machines_that_have_not_converged() -> None:
    random = np.random.default_rng(4)
    x, y = random.normal(size=(700, 3)), random.integers(0, 2, 700)
    with pytest.warns(UserWarning, match="has not converged after 3 steps"):
        machine = CliffordSVC(C=100.0, max_iter=3).fit(x, y)
    assert machine.status_ is MachineStatus.NOT_CONVERGED and machine.n_iter_ == 3 and machine.gap_ > 1e-6


def test_other_types_of_arrays_and_constant_features() -> None:
    whole = np.round(10 * X)
    wanted = CliffordSVC(gamma=0.01).fit(whole, Y).decision_function(whole)
    frozen = whole.copy()
    frozen.flags.writeable = False
    for x in (whole.astype(int), whole.astype(np.float32), frozen, np.asfortranarray(whole)):
        assert np.array_equal(CliffordSVC(gamma=0.01).fit(x, Y).decision_function(x), wanted)
    wide = np.column_stack([whole, np.full(20, 7.0)])
    assert np.allclose(CliffordSVC(gamma=0.01).fit(wide, Y).decision_function(wide), wanted)


def test_labels_of_text() -> None:
    names = np.array(["no", "yes"])[Y]
    assert set(CliffordSVC(C=100.0).fit(X, names).predict(X)) == {"no", "yes"}


@pytest.mark.parametrize("machine", [CliffordSVC(), CliffordSVR()])
def test_methods_before_fit(machine: CliffordSVC | CliffordSVR) -> None:
    with pytest.raises(ValueError, match="not fitted yet"):
        machine.predict(X)


def test_predictions_for_other_samples() -> None:
    machine = CliffordSVC().fit(X, Y)
    with pytest.raises(ValueError, match="expecting 3 features"):
        machine.predict(X[:, :2])
    with pytest.raises(ValueError, match="Invalid parameter 'c'"):
        machine.set_params(c=2)


@all_cases("y", [np.full(20, np.nan), np.ones((20, 2, 2)), np.ones(19), None])
def test_targets_of_regression(y: object) -> None:
    with pytest.raises(ValueError, match="y:"):
        CliffordSVR().fit(X, y)


@all_cases(
    "parameters, text",
    [
        ({"C": None}, "C: None"),
        ({"gamma": None}, "gamma: None"),
        ({"frequency": np.nan}, "frequency: nan; expected finite numbers"),
        ({"frequency": "high"}, "frequency: 'high'; expected finite numbers"),
    ],
)
def test_parameters_of_a_wrong_type_are_named(parameters: dict[str, Any], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        CliffordSVC("gabor", **parameters).fit(X, Y)


def test_width_and_labels_of_a_wrong_type_are_named() -> None:
    with pytest.raises(ValueError, match="epsilon: 'a'"):
        CliffordSVR(epsilon="a").fit(X, X)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="types NoneType, str; expected labels of one type"):
        CliffordSVC().fit(X, np.array(["a", None] * 10, object))
