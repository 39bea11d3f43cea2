"""Mamdani inference compared with numpy, and statuses of inputs and rules."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from random_rule_bases import (
    degenerate_rule_base,
    number_of_union,
    random_inputs,
    random_rule_base,
    reference_union,
)

from algorithms.fuzzy import (
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
from tests.support.all_cases import all_cases

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
    assert sum(compare_random(seed, method, 12) for seed in range(6)) > 48


@pytest.mark.parametrize("method", METHODS)
def test_products_and_sums_agree_with_numpy(method: str) -> None:
    other = {"conjunction": "product", "disjunction": "sum", "implication": "product"}
    assert sum(compare_random(seed, method, 12, **other) for seed in range(100, 106)) > 50


@pytest.mark.parametrize("implication", ["min", "product"])
@pytest.mark.parametrize("method", METHODS)
def test_degenerate_rule_bases_agree_with_numpy(method: str, implication: str) -> None:
    assert sum(compare_degenerate(seed, method, implication=implication) for seed in range(6)) > 14


@all_cases("method", METHODS)
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


@all_cases(
    "condition, fires",
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
    with pytest.raises(ValueError, match=r"inputs: shapes distance \(2,\), angle \(3,\), force \(\); expected shapes"):
        system.evaluate({"distance": np.zeros(2), "angle": np.zeros(3), "force": 0.0})


def test_names_of_variables_do_not_matter() -> None:
    """Arrays for intermediate results are kept by names."""
    x = np.linspace(0, 1, 9)[:, None]
    for method in METHODS:
        system = small(BOTH, defuzzify=method)
        for name in ("input", "inputs", "points", ""):
            rules = tuple(Rule(one.condition, (Conclusion(name, one.conclusions[0].set),)) for one in BOTH)
            outputs = replace(system.outputs[0], name=name), replace(system.outputs[0], name=f"{name} left")
            other = replace(system, outputs=outputs, rules=rules, defuzzify=method)
            found = other.evaluate(x)
            assert np.array_equal(found.values[:, :1], system.evaluate(x).values, equal_nan=True)
            assert (found.status[:, 1] == FuzzyStatus.NO_RULE_FIRES).all()


def test_kinds_of_arrays() -> None:
    system = grasp_controller()
    x = np.random.default_rng(0).uniform(0, 5, (20, 3)).astype(np.float32)
    expected = system.evaluate(x.astype(float)).values
    x.flags.writeable = False
    wide = np.repeat(x, 2, axis=1)[:, ::2]
    for given in (x, x.tolist(), np.asfortranarray(x), wide, {"distance": x[:, 0], "angle": x[:, 1], "force": x[:, 2]}):
        assert np.array_equal(system.evaluate(given).values, expected)
    with pytest.raises(TypeError, match="inputs: dtype complex128; expected real numbers"):
        system.evaluate(x.astype(complex))


def test_strengths_at_places_are_exact() -> None:
    """Rounding errors of coordinates must not make a rule fire whose set ends at a place."""
    for low, width in ((0.0, 1.0), (-7.3, 0.1), (1e5, 3.3)):
        places = np.linspace(low, low + width, 31)
        corners = tuple(places[k] for k in (3, 10, 17))
        x = FuzzyVariable("x", low, low + width, 31, (FuzzySet("s", "triangle", corners),))
        system = Mamdani((x,), (x_as_output(),), (Rule(Is("x", "s"), (Conclusion("y", "all"),)),))
        assert np.array_equal(system.strengths(places[:, None])[:, 0], x.memberships[:, 0])
        fires = system.evaluate(places[:, None]).status[:, 0] == FuzzyStatus.OK
        assert np.array_equal(fires, (np.arange(31) > 3) & (np.arange(31) < 17))


def x_as_output() -> FuzzyVariable:
    return FuzzyVariable("y", 0, 1, 11, (FuzzySet("all", "trapezoid", (0, 0, 1, 1)),))


@all_cases("method", METHODS)
def test_sets_between_two_places_are_empty(method: str) -> None:
    sets = FuzzySet("narrow", "triangle", (0.55, 0.55, 0.55)), FuzzySet("wide", "triangle", (0, 0.5, 1))
    x, y = (FuzzyVariable(name, 0, 1, 11, sets) for name in "xy")
    rules = tuple(Rule(Is("x", a), (Conclusion("y", b),)) for a, b in (("wide", "narrow"), ("narrow", "wide")))
    system = Mamdani((x,), (y,), rules, method)
    assert system.rule_status.tolist() == [FuzzyStatus.RULE_NEVER_FIRES] * 2
    found = system.evaluate([[0.5], [0.55], [2.0], [np.nan]])
    assert np.isnan(found.values).all()
    assert found.status[:, 0].tolist() == [FuzzyStatus.NO_RULE_FIRES] * 3 + [FuzzyStatus.NOT_FINITE]


def test_a_set_of_one_place() -> None:
    """A set that is 1 at a place and 0 at the others is a triangle of the width of two intervals."""
    sets = (FuzzySet("one", "triangle", (0.5, 0.5, 0.5)),)
    y = FuzzyVariable("y", 0, 1, 11, sets)
    for method in METHODS:
        system = Mamdani((small(BOTH).inputs[0],), (y,), (Rule(Is("x", "low"), (Conclusion("y", "one"),)),), method)
        expected = {"som": [0.5, 0.45], "lom": [0.5, 0.55]}.get(method, [0.5, 0.5])
        assert np.allclose(system.evaluate([[0.0], [0.2]]).values[:, 0], expected, rtol=0, atol=1e-14)


def test_large_conditions_are_decided_quickly() -> None:
    """The disjunctive normal form has 2**40 conjunctions."""
    low, high = Is("x", "low"), Is("x", "high")
    condition = And(low, high)
    for _ in range(40):
        condition = And(condition, Or(low, Not(high)))
    assert small((*BOTH, Rule(condition, (Conclusion("y", "left"),)))).rule_status[2] == FuzzyStatus.RULE_NEVER_FIRES


def balanced(depth: int) -> Is | And | Or:
    if depth == 0:
        return Is("x", "low")
    return (And if depth % 2 else Or)(balanced(depth - 1), balanced(depth - 1))


def test_conditions_of_many_results_at_once_are_refused() -> None:
    x = np.linspace(0, 1, 7)[:, None]
    for condition in (balanced(5), Or(balanced(5), Is("x", "high"))):
        rules = (*BOTH, Rule(condition, (Conclusion("y", "left"),)))
        expected = small(BOTH).strengths(x)
        expected = expected[:, 0] if condition == balanced(5) else expected.max(1)
        assert np.allclose(small(rules).strengths(x)[:, 2], expected, rtol=0, atol=1e-15)
    with pytest.raises(ValueError, match="rule 3: a condition that needs 6 results at once; expected at most 5"):
        small((*BOTH, Rule(balanced(6), (Conclusion("y", "left"),))))


@all_cases(
    "make, message",
    [
        (lambda: FuzzyVariable("x", 0, 1, 5, ("a",)), "variable x: sets: 'a'; expected FuzzySet"),
        (lambda: FuzzySet("a", "triangle", None), "set a: parameters None; expected triangle left peak right"),
        (lambda: FuzzySet("a", "triangle", ("l", 0, 1)), "set a: left: 'l'; expected a number"),
        (lambda: Rule("x is low", ()), "rule: 'x is low' in the condition; expected Is, Not, And or Or"),
        (
            lambda: Rule(Is("x", "low"), Conclusion("y", "left")),
            "rule: conclusions: .*; expected a tuple of Conclusion",
        ),
        (lambda: small(("r",)), "rules: 'r'; expected Rule"),
        (lambda: small(BOTH, defuzzify=None), "defuzzify: None; expected a tuple of str"),
    ],
)
def test_other_types_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(TypeError, match=message):
        make()


def test_ranges_whose_places_coincide_are_refused() -> None:
    for low, high in ((-1e308, 1e308), (1.0, 1 + 1e-12)):
        with pytest.raises(ValueError, match=r"variable x: places .* apart from .*; expected distances of more than"):
            FuzzyVariable("x", low, high, 11, (FuzzySet("a", "triangle", (0, 0, 1)),))


def test_narrow_and_steep_sets_have_no_invalid_memberships() -> None:
    sets = (
        FuzzySet("gauss", "gauss", (0.5, 1e-200)),
        FuzzySet("sigmoid", "sigmoid", (0.5, 1e308)),
        FuzzySet("bell", "bell", (1e-300, 1e3, 0.5)),
    )
    found = FuzzyVariable("x", 0, 1, 11, sets).memberships.T
    place = np.arange(11)
    assert np.array_equal(found, [place == 5, np.select([place < 5, place == 5], [0, 0.5], 1), place == 5])
