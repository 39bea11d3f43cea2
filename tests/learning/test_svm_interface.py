"""Weights, probabilities, sparse samples, given kernels and linear weights of support vector machines."""

from __future__ import annotations

import pickle
import tracemalloc

import numpy as np
import pytest
import scipy

from algorithms.learning import CliffordSVC, CliffordSVR
from algorithms.learning.svm_probabilities import fitted_sigmoid
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(11)
X = RANDOM.normal(size=(90, 4))
Y = (X[:, 0] + 0.8 * RANDOM.normal(size=90) > 0.5).astype(int)


def test_weights_are_repeated_samples() -> None:
    weights = RANDOM.integers(0, 4, 90)
    one = CliffordSVC(gamma=0.3, tol=1e-10).fit(X, Y, sample_weight=weights)
    other = CliffordSVC(gamma=0.3, tol=1e-10).fit(np.repeat(X, weights, 0), np.repeat(Y, weights))
    assert np.abs(one.decision_function(X) - other.decision_function(X)).max() < 1e-7
    assert np.abs(one.decision_function(X) - CliffordSVC(gamma=0.3).fit(X, Y).decision_function(X)).max() > 1e-2
    line = CliffordSVR("linear", tol=1e-10).fit(X, X[:, 0] ** 2, sample_weight=weights)
    repeated = CliffordSVR("linear", tol=1e-10).fit(np.repeat(X, weights, 0), np.repeat(X[:, 0] ** 2, weights))
    assert np.abs(line.predict(X) - repeated.predict(X)).max() < 1e-7


def test_weights_of_classes_multiply_the_penalties_of_their_samples() -> None:
    given = CliffordSVC(gamma=0.3, class_weight={1: 5.0}).fit(X, Y)
    weighted = CliffordSVC(gamma=0.3).fit(X, Y, sample_weight=np.where(Y, 5.0, 1.0))
    assert np.array_equal(given.decision_function(X), weighted.decision_function(X))
    balanced = CliffordSVC(gamma=0.3, class_weight="balanced").fit(X, Y)
    factors = 90 / (2 * np.bincount(Y))
    same = CliffordSVC(gamma=0.3).fit(X, Y, sample_weight=factors[Y])
    assert np.array_equal(balanced.decision_function(X), same.decision_function(X))


@all_cases(
    "weights, text",
    [
        (-np.ones(90), "at least 0"),
        (np.zeros(90), "zero"),
        (np.ones(89), "1D array"),
        (Y.astype(float), "one class"),
        (np.full(90, 1j), "sample_weight: type complex128"),
        (np.full(90, "1"), "sample_weight: type <U1"),
    ],
)
def test_weights_that_cannot_be_used(weights: np.ndarray, text: str) -> None:
    with pytest.raises(ValueError, match=text):
        CliffordSVC().fit(X, Y, sample_weight=weights)


def test_factors_of_unknown_classes_are_refused() -> None:
    for given in ({7: 2.0}, "equal", 3, [0, 1]):
        with pytest.raises(ValueError, match="class_weight"):
            CliffordSVC(class_weight=given).fit(X, Y)


@pytest.mark.parametrize("kernel", ["rbf", "linear"])
def test_sparse_samples_are_those_of_the_dense_array(kernel: str) -> None:
    x = np.where(np.abs(X) > 0.3, X, 0)
    sparse = scipy.sparse.csr_array(x)
    dense = CliffordSVC(kernel).fit(x, Y)
    assert np.array_equal(CliffordSVC(kernel).fit(sparse, Y).decision_function(sparse), dense.decision_function(x))


def test_a_given_kernel_is_that_of_its_samples() -> None:
    gram = np.exp(-0.3 * ((X[:, None] - X) ** 2).sum(2))
    given = CliffordSVC("precomputed", tol=1e-9).fit(gram[:60, :60], Y[:60])
    own = CliffordSVC("rbf", gamma=0.3, tol=1e-9).fit(X[:60], Y[:60])
    assert np.abs(given.decision_function(gram[60:, :60]) - own.decision_function(X[60:])).max() < 1e-7
    again = pickle.loads(pickle.dumps(given))
    assert np.array_equal(again.predict(gram[60:, :60]), given.predict(gram[60:, :60]))
    with pytest.raises(ValueError, match="square"):
        CliffordSVC("precomputed").fit(gram[:60], Y[:60])


def test_kernels_that_are_zero_give_bounds() -> None:
    zero = CliffordSVC(lambda a, b: np.zeros((len(a), len(b)))).fit(X, Y)
    assert zero.dual_objective_ == -2 * min(np.bincount(Y)) and np.abs(zero.dual_coef_).max() == 1


def test_linear_weights_give_the_values() -> None:
    machine = CliffordSVC("linear", gamma="auto").fit(X, Y)
    assert np.allclose(X @ machine.coef_[0] + machine.intercept_[0], machine.components(X)[:, 0])
    assert not hasattr(CliffordSVC("rbf").fit(X, Y), "coef_")


def test_the_name_auto_is_the_inverse_of_the_number_of_features() -> None:
    one, other = (CliffordSVC(gamma=gamma).fit(X, Y).decision_function(X) for gamma in ("auto", 0.25))
    assert np.array_equal(one, other)


def test_a_sigmoid_is_found_again() -> None:
    values = RANDOM.normal(size=20_000)
    drawn = RANDOM.uniform(size=20_000) < 1 / (1 + np.exp(-(2.5 * values - 1)))
    a, b = fitted_sigmoid(values, drawn, np.ones(20_000))
    # Five standard deviations of estimates from 20,000 samples, by the Fisher information.
    p = 1 / (1 + np.exp(-(2.5 * values - 1)))
    rows = np.stack([values, np.ones(20_000)])
    deviation = np.sqrt(np.diag(np.linalg.inv((rows * (p * (1 - p))) @ rows.T)))
    assert abs(a - 2.5) < 5 * deviation[0] and abs(b + 1) < 5 * deviation[1]


@pytest.mark.parametrize("classes", [2, 3])
def test_probabilities_are_better_than_frequencies_on_other_samples(classes: int) -> None:
    random = np.random.default_rng(3)
    x = random.normal(size=(400, 2))
    y = np.minimum((x[:, 0] + 0.7 * random.normal(size=400) > 0) + 1 * (x[:, 1] > 0.5), classes - 1)
    machine = CliffordSVC(gamma=0.5, probability=True).fit(x[:200], y[:200])
    found = machine.predict_proba(x[200:])
    assert found.shape == (200, classes) and np.allclose(found.sum(1), 1) and found.min() >= 0
    frequency = np.bincount(y[:200]) / 200
    loss = -np.log(found[np.arange(200), y[200:]]).mean()
    assert loss < 0.8 * -np.log(frequency[y[200:]]).mean()
    assert not hasattr(CliffordSVC().fit(x, y), "predict_proba")


def test_probabilities_of_given_kernels() -> None:
    gram = np.exp(-0.3 * ((X[:, None] - X) ** 2).sum(2))
    given = CliffordSVC("precomputed", probability=True, tol=1e-9).fit(gram, Y)
    own = CliffordSVC("rbf", gamma=0.3, probability=True, tol=1e-9).fit(X, Y)
    assert np.abs(given.predict_proba(gram) - own.predict_proba(X)).max() < 1e-5


def test_samples_of_a_sigmoid_count_as_often_as_their_weights() -> None:
    weights, values = RANDOM.integers(0, 4, 90), X[:, 0]
    repeated = fitted_sigmoid(np.repeat(values, weights), np.repeat(Y == 1, weights), np.ones(weights.sum()))
    assert np.allclose(fitted_sigmoid(values, Y == 1, weights.astype(float)), repeated, rtol=1e-6)


@pytest.mark.parametrize("kernel", ["rbf", "precomputed"])
def test_samples_without_weight_change_no_probability(kernel: str) -> None:
    given = kernel == "precomputed"
    x, used = np.exp(-0.3 * ((X[:, None] - X) ** 2).sum(2)) if given else X, np.arange(90) % 3 > 0
    one = CliffordSVC(kernel, gamma=0.3, probability=True, tol=1e-9).fit(x, Y, sample_weight=used)
    rest = x[used][:, used] if given else x[used]
    other = CliffordSVC(kernel, gamma=0.3, probability=True, tol=1e-9).fit(rest, Y[used])
    assert np.abs(one.predict_proba(x) - other.predict_proba(x[:, used] if given else x)).max() < 1e-6


def test_a_class_of_one_sample_has_no_probability() -> None:
    with pytest.raises(ValueError, match="class 2 with positive weights: 1;"):
        CliffordSVC(probability=True).fit(X, np.where(np.arange(90) == 3, 2, Y))
    for count in (0, 1):
        weights = np.where(np.arange(90) < 40 + count, 1.0, 0.0)
        with pytest.raises(ValueError, match=f"class 2 with positive weights: {count};"):
            CliffordSVC(probability=True).fit(X, np.where(np.arange(90) < 40, Y, 2), sample_weight=weights)


def test_predictions_are_computed_in_blocks() -> None:
    machine = CliffordSVC(C=0.1).fit(X, Y)
    many = np.zeros((100_000, 4))
    tracemalloc.start()
    machine.predict(many)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # All kernels at once are 8 bytes for each of 100,000 samples and support vectors, 60 of them at least.
    assert len(machine.support_) >= 60 and peak < 8 * 100_000 * 60 / 2
