"""Linear layers with hyperbolic tangents between them, computed together."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from algorithms.learning import Algebra, Layer, Linear, Network, Split
from algorithms.learning.chains import Chain, joined
from tests.support.all_cases import all_cases
from tests.support.layer_gradients import check_gradient

RANDOM = np.random.default_rng(0)
TANH = Split("tanh")


@pytest.fixture(autouse=True)
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("algorithms.learning.linear.LEAST_WIDTH", 0)


@all_cases("bias", [True, False])
@all_cases("widths", [(3, 4), (5, 2, 3)])
def test_gradients(widths: tuple[int, ...], bias: bool) -> None:
    check_gradient(Chain(tuple(Linear(width, bias=bias) for width in widths)), Algebra(3))


@pytest.mark.parametrize("dtype, tolerance", [(np.float64, 1e-13), (np.float32, 1e-5)])
def test_network_equals_its_layers_one_by_one(dtype: Any, tolerance: float, monkeypatch: pytest.MonkeyPatch) -> None:
    layers = [Linear(6), TANH, Linear(5, bias=False), TANH, Linear(2), Split("sigmoid"), Linear(3)]
    x, y = RANDOM.normal(size=(30, 4, 8)), RANDOM.normal(size=(30, 3, 8))
    together = Network(layers, "G(3)", 4, dtype=dtype)
    assert [count for _, count in together._plan] == [5, 1, 1]
    loss, gradient = together.gradient(x, y)
    monkeypatch.setattr("algorithms.learning.linear.LEAST_WIDTH", np.inf)
    apart = Network(layers, "G(3)", 4, dtype=dtype)
    assert [count for _, count in apart._plan] == [1] * 7
    expected, other = apart.gradient(x, y)
    assert loss == pytest.approx(expected, rel=tolerance)
    assert gradient.dtype == dtype and np.abs(gradient - other).max() < tolerance * np.abs(other).max()
    assert np.abs(together.predict(x) - apart.predict(x)).max() < 10 * tolerance


def test_repeated_gradients_of_changing_batches_are_equal() -> None:
    one = Network([Linear(6), TANH, Linear(2)], "G(3)", 4)
    x, y = RANDOM.normal(size=(9, 4, 8)), RANDOM.normal(size=(9, 2, 8))
    parts = [one.gradient(x[a:b], y[a:b])[1] * (b - a) for a, b in pairwise((0, 4, 5, 9))]
    assert np.allclose(sum(parts) / 9, one.gradient(x, y)[1], atol=1e-14)
    with one._workspace.used():  # Another use of the workspace, as by another thread.
        assert np.array_equal(one.gradient(x, y)[1], one.gradient(x, y)[1])


@all_cases("layers, counts", [
    ([Linear(3), TANH, Linear(2)], [3]),
    ([Linear(3), TANH], [1, 1]),
    ([Linear(3), Linear(2)], [1, 1]),
    ([TANH, Linear(3), TANH, Linear(2), TANH], [1, 3, 1]),
    ([Linear(3), Split("relu"), Linear(2)], [1, 1, 1]),
    ([Linear(3), TANH, Linear(2, side="right")], [1, 1, 1]),
    ([Linear(3), TANH, Linear(2, grades=(0,))], [1, 1, 1]),
])  # fmt: skip
def test_what_is_joined(layers: list[Layer], counts: list[int]) -> None:
    assert [count for _, count in joined(layers, Algebra(3), 2)] == counts
    assert [count for _, count in joined(layers, Algebra(3, 0, 1), 2)] == [1] * len(layers)
