"""Mamdani inference compared with scikit-fuzzy, and Sugeno inference with simpful."""

from __future__ import annotations

import importlib

import numpy as np
import pytest
from random_rule_bases import (
    degenerate_rule_base,
    number_of_union,
    on_own_places,
    random_inputs,
    random_rule_base,
)

from algorithms.fuzzy import FuzzyStatus, Mamdani, Sugeno
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


def test_centroids_on_own_places_agree() -> None:
    pytest.importorskip("skfuzzy")
    count = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        system = on_own_places(rng, random_rule_base(rng))
        x = firing(system, 20, seed)
        if len(x):
            expected, _ = peer_unions(system, x)
            assert np.abs(system.evaluate(x).values[:, 0] - expected).max() <= limit(system)
            count += len(x)
    assert count > 300


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


SUGENO = """
method and {conjunction} or max
input x from 0 to 10 samples 11
    set low triangle 0 0 10
    set high triangle 0 10 10
input y from 0 to 8 samples 9
    set small trapezoid 0 0 2 6
    set large triangle 2 8 8
output z
    function one 3
    function two 1 + 0.5 x - 2 y
    function three -4 + 1 y
rule if x is low and y is small then z is one
rule if x is high and y is not small then z is two
rule if x is high or y is large then z is three
"""


@pytest.mark.parametrize("conjunction", ["min", "product"])
def test_sugeno_inference_agrees(conjunction: str) -> None:
    simpful = pytest.importorskip("simpful")
    peer = simpful.FuzzySystem(show_banner=False, operators=["AND_PRODUCT"] if conjunction == "product" else None)
    corners = {
        "x": {"low": [[0, 1], [10, 0]], "high": [[0, 0], [10, 1]]},
        "y": {"small": [[0, 1], [2, 1], [6, 0]], "large": [[2, 0], [8, 1]]},
    }
    for variable, sets in corners.items():
        own = [simpful.FuzzySet(points=points, term=name) for name, points in sets.items()]
        peer.add_linguistic_variable(variable, simpful.LinguisticVariable(own))
    peer.set_crisp_output_value("one", 3)
    peer.set_output_function("two", "1 + 0.5 * x - 2 * y")
    peer.set_output_function("three", "-4 + y")
    peer.add_rules([
        "IF (x IS low) AND (y IS small) THEN (z IS one)",
        "IF (x IS high) AND (NOT (y IS small)) THEN (z IS two)",
        "IF (x IS high) OR (y IS large) THEN (z IS three)",
    ])  # fmt: skip
    x = np.random.default_rng(0).uniform(0, [10, 8], (100, 2))
    found = Sugeno.parse(SUGENO.format(conjunction=conjunction)).evaluate(x)
    for row, value in zip(x, found.values[:, 0], strict=True):
        for name, number in zip("xy", row, strict=True):
            peer.set_variable(name, number)
        assert abs(peer.Sugeno_inference(["z"])["z"] - value) < 1e-12
    assert not found.status.any()
