"""Mamdani inference compared with numpy, and statuses of inputs and rules."""

from __future__ import annotations

import numpy as np
import pytest
from random_rule_bases import (
    degenerate_rule_base,
    number_of_union,
    random_inputs,
    random_rule_base,
    reference_union,
)

from algorithms.grasping import (
    And,
    Conclusion,
    FuzzySet,
    FuzzyStatus,
    FuzzyVariable,
    Is,
    Mamdani,
    Not,
    Or,
    Rule,
    grasp_controller,
)

METHODS = ("centroid", "bisector", "mom", "som", "lom")


def compare(system: Mamdani, inputs: np.ndarray, method: str) -> int:
    """Compare values, and return how many there are."""
    found = system.evaluate(inputs)
    compared = 0
    for x, value, status in zip(inputs, found.values[:, 0], found.status[:, 0], strict=True):
        places, union = reference_union(system, x)
        if union.max() == 0:
            assert status == FuzzyStatus.NO_RULE_FIRES and np.isnan(value)
            continue
        assert status == FuzzyStatus.OK
        expected = number_of_union(places, union, method)
        output = system.outputs[0]
        assert abs(value - expected) <= 1e-9 * max(1, abs(output.low), abs(output.high))
        compared += 1
    return compared


def compare_random(seed: int, method: str, count: int, **methods: str) -> int:
    rng = np.random.default_rng(seed)
    system = random_rule_base(rng, method, **methods)
    return compare(system, random_inputs(rng, system, count), method)


def compare_degenerate(seed: int, method: str, **methods: str) -> int:
    """Compare values for random inputs and for places of the grid, where sets begin, end and coincide."""
    rng = np.random.default_rng(seed)
    system = degenerate_rule_base(rng, method, **methods)
    places = np.stack([rng.choice(one.places, 4) for one in system.inputs], -1)
    return compare(system, np.concatenate([random_inputs(rng, system, 4), places]), method)


@pytest.mark.parametrize("method", METHODS)
def test_random_rule_bases_agree_with_numpy(method: str) -> None:
    assert sum(compare_random(seed, method, 12) for seed in range(25)) > 200


@pytest.mark.parametrize("method", METHODS)
def test_products_and_sums_agree_with_numpy(method: str) -> None:
    other = {"conjunction": "product", "disjunction": "sum", "implication": "product"}
    assert sum(compare_random(seed, method, 12, **other) for seed in range(100, 112)) > 100


@pytest.mark.parametrize("implication", ["min", "product"])
@pytest.mark.parametrize("method", METHODS)
def test_degenerate_rule_bases_agree_with_numpy(method: str, implication: str) -> None:
    assert sum(compare_degenerate(seed, method, implication=implication) for seed in range(25)) > 60


@pytest.mark.parametrize("method", METHODS)
def test_long_batches_agree_with_single_inputs(method: str) -> None:
    """Elements do not depend on the part of the batch in which they are computed."""
    rng = np.random.default_rng(3)
    system = random_rule_base(rng, method)
    x = random_inputs(rng, system, 5000)
    found, some = system.evaluate(x), [0, 1, 7, 2047, 2048, 4095, 4096, 4999]
    single = [system.evaluate(row) for row in x[some]]
    assert np.array_equal(found.values[some], [one.values for one in single], equal_nan=True)
    assert np.array_equal(found.status[some], [one.status for one in single])


def small(rules: tuple[Rule, ...], **methods: str) -> Mamdani:
    x = FuzzyVariable(
        "x", 0, 1, 11, (FuzzySet("low", "triangle", (0, 0, 0.4)), FuzzySet("high", "triangle", (0.6, 1, 1)))
    )
    y = FuzzyVariable(
        "y", -1, 1, 21, (FuzzySet("left", "triangle", (-1, -1, 0)), FuzzySet("right", "triangle", (0, 1, 1)))
    )
    return Mamdani((x,), (y,), rules, **methods)  # type: ignore[arg-type]


BOTH = (Rule(Is("x", "low"), (Conclusion("y", "left"),)), Rule(Is("x", "high"), (Conclusion("y", "right"),)))


def test_closed_forms() -> None:
    # At x = 0 the set is the triangle from -1 to 0 with the peak at -1, whose centroid is at -2/3.
    assert np.isclose(small(BOTH).evaluate([0.0]).values[0], -2 / 3, rtol=0, atol=1e-14)
    assert np.isclose(small(BOTH, defuzzify="bisector").evaluate([1.0]).values[0], np.sqrt(0.5), rtol=0, atol=1e-14)
    # At x = 0.2 it is clipped at 1/2, so that it is largest from -1 to -1/2.
    found = [small(BOTH, defuzzify=method).evaluate([0.2]).values[0] for method in ("som", "lom")]
    assert np.allclose(found, [-1, -0.5], rtol=0, atol=1e-14)


def test_statuses_of_inputs() -> None:
    found = small(BOTH).evaluate([[0.5], [1.5], [np.nan], [0.1]])
    assert found.status[:, 0].tolist() == [
        FuzzyStatus.NO_RULE_FIRES, FuzzyStatus.CLIPPED, FuzzyStatus.NOT_FINITE, FuzzyStatus.OK,
    ]  # fmt: skip
    assert np.isnan(found.values[[0, 2], 0]).all()
    assert np.isclose(found.values[1, 0], 2 / 3, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("condition", "fires"),
    [
        (And(Is("x", "low"), Is("x", "high")), False),
        (And(Is("x", "low"), Not(Is("x", "high"))), True),
        (Not(Or(Not(Is("x", "low")), Not(Is("x", "high")))), False),
        (And(Not(Is("x", "low")), Not(Is("x", "high"))), True),
        (Or(And(Is("x", "low"), Is("x", "high")), Is("x", "high")), True),
    ],
)
def test_rules_that_never_fire(condition: And | Or | Not, fires: bool) -> None:
    system = small((*BOTH, Rule(condition, (Conclusion("y", "right"),))))
    expected = FuzzyStatus.OK if fires else FuzzyStatus.RULE_NEVER_FIRES
    assert system.rule_status.tolist() == [FuzzyStatus.OK, FuzzyStatus.OK, expected]
    strengths = system.strengths(np.linspace(0, 1, 501)[:, None])
    assert (strengths[:, 2] > 0).any() == fires


def test_the_grasp_controller_closes_aligns_and_holds() -> None:
    system = grasp_controller()
    assert not system.rule_status.any()
    inputs = {"distance": [100, 1, 0, 100], "angle": [0, 0, 0, -60], "force": [0, 0.2, 9, 0]}
    speed, grip, turn = system.evaluate(inputs).values.T
    assert speed[0] > 1 > speed[1] > 0.2 and abs(speed[2]) < 0.01
    assert grip[1] > 0.5 and abs(grip[2]) < 0.02
    assert turn[3] > 0.4 and np.allclose(turn[:3], 0, rtol=0, atol=1e-12)
    assert system.evaluate(inputs).status.max() == FuzzyStatus.OK


def test_the_controller_is_mirrored() -> None:
    rng = np.random.default_rng(0)
    x = rng.uniform([0, -90, 0], [120, 90, 10], (200, 3))
    turn = grasp_controller().evaluate(x).values[:, 2]
    assert np.allclose(turn, -grasp_controller().evaluate(x * [1, -1, 1]).values[:, 2], rtol=0, atol=1e-12)


def test_shapes_and_empty_batches() -> None:
    system = grasp_controller()
    assert system.evaluate(np.zeros((2, 3, 3))).values.shape == (2, 3, 3)
    assert system.evaluate(np.zeros((0, 3))).values.shape == (0, 3)
    assert system.strengths(np.zeros((4, 3))).shape == (4, 11)
    with pytest.raises(ValueError, match=r"inputs: shape \(4,\); expected \(\.\.\., 3\)"):
        system.evaluate(np.zeros(4))
    with pytest.raises(ValueError, match="inputs: distance; expected distance, angle, force"):
        system.evaluate({"distance": 0.0})
