"""Experiments of chapter 16 with networks, and the page on learning."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from algorithms.learning import Algebra
from algorithms.learning.experiments import encoder, lorenz, moebius, placed, taken, trained
from tests.support.all_cases import all_cases

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("seeds", [range(1), pytest.param(range(1, 10), marks=pytest.mark.slow)])
def test_encoder(seeds: range) -> None:
    assert all(encoder(seed)[1] for seed in seeds)


def test_prediction_of_lorenz_states() -> None:
    assert trained(lorenz(0), "G(3)", 150, 0, iterations=100)[0] <= 0.02


def test_complex_network_learns_a_moebius_map() -> None:
    error, count = trained(moebius(1), "C", 62, 1)
    assert error < 0.02 and count == 62


@all_cases("count", [1, 2, 3, 5, 9])
@all_cases("name", ["R", "C", "G(3)"])
def test_placed_numbers_are_taken_again(name: str, count: int) -> None:
    values = np.random.default_rng(0).normal(size=(4, count))
    assert np.array_equal(taken(placed(values, Algebra.of(name)), count, Algebra.of(name)), values)


def test_blocks_of_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "learning.md").read_text(), re.DOTALL)
    assert len(blocks) >= 2
    exec(compile("\n".join(blocks), "docs/learning.md", "exec"), {"__name__": "learning"})
