"""Mamdani inference compared with scikit-fuzzy."""

from __future__ import annotations

import importlib

import numpy as np
import pytest
from random_rule_bases import degenerate_rule_base, number_of_union, random_inputs, random_rule_base

from algorithms.fuzzy import FuzzyStatus, Mamdani
from benchmarks.scikit_fuzzy import peer_simulation, used_inputs

pytestmark = pytest.mark.peers

BASES, INPUTS = 100, 100


def peer_unions(system: Mamdani, x: np.ndarray) -> tuple[object, list[tuple[np.ndarray, np.ndarray]]]:
    """The values of scikit-fuzzy, and the places and the union that it computes for each input."""
    simulation, variables = peer_simulation(system)
    names = [one.name for one in system.inputs]
    for name in used_inputs(system):
        simulation.input[name] = x[:, names.index(name)]
    # Only with a cache are the strengths kept that the unions are computed from.
    simulation._reset_simulation = lambda: None
    simulation.compute()
    calculator = importlib.import_module("skfuzzy.control.controlsystem").CrispValueCalculator
    own = calculator(variables["y"], simulation)
    return simulation.output["y"], [own.find_memberships_nd((k,)) for k in range(len(x))]


def firing(system: Mamdani, count: int, seed: int) -> np.ndarray:
    """Random inputs for which a rule fires, because scikit-fuzzy fails for arrays with others."""
    rng, rows = np.random.default_rng(seed), np.zeros((0, len(system.inputs)))
    for _ in range(200):
        x = random_inputs(rng, system, count)
        rows = np.concatenate([rows, x[system.evaluate(x).status[:, 0] == FuzzyStatus.OK]])
        if len(rows) >= count:
            break
    return rows[:count]


def limit(system: Mamdani) -> float:
    output = system.outputs[0]
    return 1e-9 * max(1, abs(output.low), abs(output.high))


@pytest.mark.parametrize("first", range(0, BASES, 10))
def test_centroids_agree(first: int) -> None:
    pytest.importorskip("skfuzzy")
    for seed in range(first, first + 10):
        system = random_rule_base(np.random.default_rng(seed))
        x = firing(system, INPUTS, seed)
        if len(x):
            expected, _ = peer_unions(system, x)
            assert np.abs(system.evaluate(x).values[:, 0] - expected).max() <= limit(system)


@pytest.mark.parametrize("method", ["bisector", "mom", "som", "lom"])
def test_other_numbers_agree(method: str) -> None:
    """The numbers of the unions of scikit-fuzzy agree.

    Its own numbers are not exact: rounding errors decide whether the crossings of a set belong to the maximum, and a
    bisector in a nearly level part, or behind a gap, is off by up to an interval of the grid.
    """
    pytest.importorskip("skfuzzy")
    same, count = 0, 0
    for seed in range(30):
        system = random_rule_base(np.random.default_rng(seed), method)
        x = firing(system, INPUTS, seed)
        if not len(x):
            continue
        values, unions = peer_unions(system, x)
        found = system.evaluate(x).values[:, 0]
        for own, (places, union) in zip(found, unions, strict=True):
            assert abs(own - number_of_union(places, union, method)) <= limit(system)
        same += int((np.abs(found - values) <= limit(system)).sum())
        count += len(x)
    assert count > 2000 and same > 0.3 * count
    print(f"{method}: {same} of {count} numbers of scikit-fuzzy are equal")


@pytest.mark.parametrize("method", ["centroid", "bisector", "mom", "som", "lom"])
def test_degenerate_rule_bases_agree(method: str) -> None:
    """Sets of one place, equal sets, corners on places, and rules that conclude several sets."""
    pytest.importorskip("skfuzzy")
    count = 0
    for seed in range(40):
        system = degenerate_rule_base(np.random.default_rng(seed), method)
        x = firing(system, 20, seed)
        if not len(x):
            continue
        values, unions = peer_unions(system, x)
        found = system.evaluate(x).values[:, 0]
        expected = [number_of_union(places, union, method) for places, union in unions]
        assert np.abs(found - expected).max() <= limit(system)
        if method == "centroid":
            assert np.abs(found - values).max() <= limit(system)
        count += len(x)
    assert count > 700
