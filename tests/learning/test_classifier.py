"""Classifiers of features, and layers of time-delay networks."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from algorithms.learning import (
    Delays,
    Linear,
    MeanOverTime,
    Network,
    Split,
    confusion_matrix,
    load_classifier,
    train_classifier,
)
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(0)
LABELS = np.arange(120) % 6
CENTRES = RANDOM.normal(size=(6, 6, 2, 4))
SEQUENCES = CENTRES[LABELS] + 0.4 * RANDOM.normal(size=(120, 6, 2, 4))


def samples(kind: str) -> np.ndarray:
    return SEQUENCES if kind == "delays" else SEQUENCES[:, 0]


def test_delays_equal_a_loop() -> None:
    network = Network([Delays(3, 5, 2), MeanOverTime(4)], "H", 10, seed=1)
    x = RANDOM.normal(size=(7, 10, 4))
    linear = Linear(3)
    windows = [linear.value(network.algebra, x[:, 2 * k : 2 * k + 4], network.weights[0]) for k in range(4)]
    assert np.allclose(network.predict(x), np.mean(windows, 0), atol=1e-14)


def test_gradients_by_differences() -> None:
    layers = [Delays(2, 6, 3), Split("tanh"), Delays(2, 4, 2), MeanOverTime(3), Linear(3)]
    network = Network(layers, "H", 12, loss="entropy")
    x, y = RANDOM.normal(size=(5, 12, 4)), np.arange(5) % 3
    gradient, start = network.gradient(x, y)[1], network.parameters.copy()
    for k in range(0, len(start), 7):
        step = np.zeros_like(start)
        step[k] = 1e-5
        network.parameters = start + step
        upper = network.loss(x, y)
        network.parameters = start - step
        assert (upper - network.loss(x, y)) / 2e-5 == pytest.approx(gradient[k], abs=1e-8)


@pytest.mark.parametrize("kind", ["perceptron", "delays", "experts"])
def test_classes_are_learned_and_files_restore_them(kind: str, tmp_path: Path) -> None:
    seen: list[str] = []
    x = samples(kind)
    model = train_classifier(
        x[:60], LABELS[:60], kind, hidden=8, members=2, iterations=60, progress=lambda name, *_: seen.append(name)
    )
    found = model.probabilities(x[60:])
    assert np.allclose(found.sum(1), 1) and (model.predict(x[60:]) == LABELS[60:]).mean() > 0.9
    assert ("gate 2/2" in seen) == (kind == "experts") and "network 1/2" in seen
    model.save(tmp_path / "model.npz")
    assert np.array_equal(load_classifier(tmp_path / "model.npz").probabilities(x[60:]), found)


def test_permuted_labels_are_not_learned() -> None:
    labels = np.random.default_rng(4).permutation(LABELS)
    model = train_classifier(SEQUENCES[:60, 0], labels[:60], members=1, hidden=8, iterations=60)
    assert (model.predict(SEQUENCES[60:, 0]) == labels[60:]).mean() < 0.4


def test_confusion_matrix() -> None:
    assert confusion_matrix(["a", "b", "b"], ["b", "b", "a"], ["a", "b"]).tolist() == [[0, 1], [1, 1]]
    with pytest.raises(ValueError, match="not in classes"):
        confusion_matrix([0, 1], [1, 2], [0, 1])
    with pytest.raises(ValueError, match="twice"):
        confusion_matrix([0, 1], [1], [0, 1])


@all_cases(
    "change, message",
    [
        ({"features": np.full((120, 3), np.nan)}, "finite"),
        ({"features": np.ones(120)}, "expected (n, d)"),
        ({"features": np.ones((0, 3))}, "not empty"),
        ({"labels": LABELS[1:]}, "one for each sample"),
        ({"labels": np.zeros(120, int)}, "at least two"),
        ({"kind": "tree"}, "'tree'"),
        ({"hidden": 0}, "hidden: 0"),
        ({"kind": "delays"}, "at least 5 times"),
    ],
)
def test_bad_arguments(change: dict[str, object], message: str) -> None:
    given = {"features": SEQUENCES[:, 0], "labels": LABELS, "kind": "perceptron"} | change
    with pytest.raises(ValueError, match=re.escape(message)):
        train_classifier(given.pop("features"), given.pop("labels"), **given)  # type: ignore[arg-type]


def test_bad_files_and_shapes(tmp_path: Path) -> None:
    np.savez(tmp_path / "other.npz", a=np.ones(3))
    with pytest.raises(ValueError, match=r"expected a file written by Classifier\.save"):
        load_classifier(tmp_path / "other.npz")
    model = train_classifier(SEQUENCES[:, 0], LABELS, members=1, hidden=2, iterations=2)
    with pytest.raises(ValueError, match=r"expected \(n, 2, 4\)"):
        model.predict(np.ones((3, 2)))
    for layer in (lambda: Delays(1, 2, 3), lambda: Delays(1, 3).output(Network([Linear(1)], "R").algebra, 4),
                  lambda: MeanOverTime(3).output(Network([Linear(1)], "R").algebra, 4)):  # fmt: skip
        with pytest.raises(ValueError, match="expected a"):
            layer()
