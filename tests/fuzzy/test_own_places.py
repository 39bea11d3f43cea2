"""Variables with given places, and values where no rule fires."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from random_rule_bases import (
    degenerate_rule_base,
    number_of_union,
    on_own_places,
    random_inputs,
    random_rule_base,
    reference_union,
)

from algorithms.fuzzy import Conclusion, FuzzySet, FuzzyStatus, FuzzyVariable, Is, Mamdani, Rule
from tests.support.all_cases import all_cases

METHODS = ("centroid", "bisector", "mom", "som", "lom")
LOW, HIGH = FuzzySet("low", "triangle", (0, 0, 0.4)), FuzzySet("high", "triangle", (0.6, 1, 1))
X = FuzzyVariable("x", 0, 1, 11, (LOW, HIGH))


def compare(system: Mamdani, inputs: np.ndarray, method: str) -> int:
    """Compare values with numpy, and return how many there are."""
    found, compared = system.evaluate(inputs), 0
    output = system.outputs[0]
    for x, value, status in zip(inputs, found.values[:, 0], found.status[:, 0], strict=True):
        places, union = reference_union(system, x)
        if union.max() == 0:
            assert status == FuzzyStatus.NO_RULE_FIRES and np.isnan(value)
            continue
        assert status == FuzzyStatus.OK
        assert abs(value - number_of_union(places, union, method)) <= 1e-9 * max(1, abs(output.low), abs(output.high))
        compared += 1
    return compared


@pytest.mark.parametrize("implication", ["min", "product"])
@pytest.mark.parametrize("method", METHODS)
def test_random_rule_bases_agree_with_numpy(method: str, implication: str) -> None:
    compared = 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        system = on_own_places(rng, random_rule_base(rng, method, implication=implication))
        compared += compare(system, random_inputs(rng, system, 8), method)
    assert compared > 20


@pytest.mark.parametrize("method", METHODS)
def test_degenerate_rule_bases_agree_with_numpy(method: str) -> None:
    """Sets of one place, equal sets, and inputs on places."""
    compared = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        system = on_own_places(rng, degenerate_rule_base(rng, method))
        places = np.stack([rng.choice(one.places, 6) for one in system.inputs], -1)
        compared += compare(system, np.concatenate([random_inputs(rng, system, 6), places]), method)
    assert compared > 20


@all_cases("method", METHODS)
def test_equidistant_places_may_be_given(method: str) -> None:
    rng = np.random.default_rng(5)
    system = random_rule_base(rng, method)
    given = [tuple(FuzzyVariable.at(v.name, v.places, v.sets) for v in own) for own in (system.inputs, system.outputs)]
    other, x = replace(system, inputs=given[0], outputs=given[1]), random_inputs(rng, system, 300)
    found, expected = other.evaluate(x), system.evaluate(x)
    width = system.outputs[0].high - system.outputs[0].low
    assert np.array_equal(found.status, expected.status) and (found.status == FuzzyStatus.OK).sum() > 100
    assert np.allclose(found.values, expected.values, rtol=0, atol=1e-11 * width, equal_nan=True)


def test_a_closed_form() -> None:
    """With the places 0, 1 and 4, a set with its peak at 1 is the triangle over 0, 1, 4, with the centroid 5/3."""
    y = FuzzyVariable.at("y", [0, 1, 4], (FuzzySet("one", "triangle", (0.5, 1, 1.5)),))
    rules = (Rule(Is("x", "low"), (Conclusion("y", "one"),)),)
    found = {method: Mamdani((X,), (y,), rules, method).evaluate([0.0]).values[0] for method in METHODS}
    # The area is 2; it is 1 above the point whose distance d from 4 satisfies d * d / 6 = 1.
    expected = {"centroid": Fraction(5, 3), "bisector": 4 - 6**0.5, "mom": 1, "som": 1, "lom": 1}
    for method, value in expected.items():
        assert abs(found[method] - float(value)) < 1e-14
    # Clipped at 1/2, the maximum is from 1/2 to 5/2, and the mean is that of these points and of the place 1.
    half = Mamdani((X,), (y,), (Rule(Is("x", "low"), (Conclusion("y", "one", 0.5),)),), ("mom",))
    assert abs(half.evaluate([0.0]).values[0] - 4 / 3) < 1e-14


def test_tiny_strengths_on_own_places() -> None:
    """A triangle clipped at a tiny strength is a rectangle, up to the strength, whose centroid is in the middle."""
    y = FuzzyVariable.at("y", [0, 0.1, 1, 3], (FuzzySet("t", "triangle", (0, 0.1, 3)),))
    rules = (Rule(Is("x", "low"), (Conclusion("y", "t", 1e-14),)),)
    assert abs(Mamdani((X,), (y,), rules).evaluate([0.0]).values[0] - 1.5) < 1e-12


def test_long_batches_agree_with_single_inputs() -> None:
    rng = np.random.default_rng(3)
    system = on_own_places(rng, random_rule_base(rng))
    x, some = random_inputs(rng, system, 5000), [0, 1, 2047, 4095, 4096, 4999]
    found = system.evaluate(x).values[some]
    assert np.array_equal(found, [system.evaluate(row).values for row in x[some]], equal_nan=True)
    assert system.evaluate(x[:0]).values.shape == (0, 1)


@all_cases(
    "make, message",
    [
        (lambda: FuzzyVariable.at("x", [0, 2, 1], (LOW,)), "variable x: 1.0 after 2.0 in the grid; expected numbers"),
        (lambda: FuzzyVariable.at("x", [0, 1, 1], (LOW,)), "variable x: 1.0 after 1.0 in the grid; expected numbers"),
        (lambda: FuzzyVariable.at("x", [0], (LOW,)), r"places: shape \(1,\); expected at least 2 numbers"),
        (lambda: FuzzyVariable.at("x", [[0, 1]], (LOW,)), r"places: shape \(1, 2\); expected at least 2 numbers"),
        (lambda: FuzzyVariable.at("x", [0, np.nan], (LOW,)), "variable x: grid: nan; expected a finite number"),
        (lambda: FuzzyVariable.at("x", [0, 1, 1 + 1e-13], (LOW,)), "variable x: places .* apart"),
        (lambda: replace(X, grid=(0, 0.5, 1)), "3 numbers from 0.0 to 1.0 in the grid; expected 11 from 0 to 1"),
        (lambda: defaulted(2.0), "default of y: 2.0; expected a number from -1 to 1"),
        (lambda: defaulted(np.inf), "default of y: inf; expected a finite number"),
        (lambda: defaulted((0.0, 0.0)), "default: 2 numbers; expected one, or one for each of 1 outputs"),
    ],
)
def test_invalid_places_and_defaults_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


def defaulted(default: object) -> Mamdani:
    y = FuzzyVariable("y", -1, 1, 21, (FuzzySet("left", "triangle", (-1, -1, 0)),))
    return Mamdani((X,), (y,), (Rule(Is("x", "low"), (Conclusion("y", "left"),)),), default=default)  # type: ignore[arg-type]


def test_defaults_replace_values_and_not_statuses() -> None:
    x = [[0.0], [0.5], [2.0], [np.nan]]
    none, found = defaulted(None).evaluate(x), defaulted(0.25).evaluate(x)
    fires, nothing, invalid = FuzzyStatus.OK, FuzzyStatus.NO_RULE_FIRES, FuzzyStatus.NOT_FINITE
    assert none.status[:, 0].tolist() == found.status[:, 0].tolist() == [fires, nothing, nothing, invalid]
    assert found.values[1:3, 0].tolist() == [0.25, 0.25] and np.isnan(found.values[3, 0])
    assert np.isnan(none.values[1:, 0]).all() and none.values[0, 0] == found.values[0, 0]
    with pytest.raises(TypeError, match="default of y: 'a'; expected a number"):
        defaulted("a")


def test_places_and_defaults_are_read_and_written() -> None:
    text = """
    input x at -1 0 0.5 10
        set low triangle -1 -1 10
    output y at 0 1 4 by mom default 0.5
        set one triangle 0 1 4
    output z from 0 to 1 samples 11 default 1e-3
        set one triangle 0 1 1
    output w from 0 to 1 samples 11
        set one triangle 0 1 1
    rule if x is low then y is one, z is one, w is one
    """
    system = Mamdani.parse(text)
    assert system.inputs[0].grid == (-1.0, 0.0, 0.5, 10.0) and system.default == (0.5, 1e-3, None)
    assert Mamdani.parse(system.to_text()) == system
    assert np.isnan(system.evaluate([10.0]).values).tolist() == [False, False, True]
    for old, new, message in (
        ("x at -1 0 0.5 10", "x at", "line 2: the end of the line; expected a place"),
        ("x at", "x over", "line 2: 'over'; expected 'from' or 'at'"),
        ("default 0.5", "default 5", "line 4: default of y: 5.0; expected a number from 0.0 to 4.0"),
        ("-1 0 0.5 10", "-1 0 0.5 10 default 0", "line 2: 'default'; expected the end of the line"),
        ("at 0 1 4", "at 0 4 1", "line 4: variable y: 1.0 after 4.0 in the grid"),
    ):
        with pytest.raises(ValueError, match=message):
            Mamdani.parse(text.replace(old, new))


def test_strengths_at_own_places_are_exact() -> None:
    """Rounding errors must not make a rule fire whose set ends at a place."""
    places = 7.3 + np.cumsum(10 ** np.random.default_rng(1).uniform(-2, 0, 31))
    ends = FuzzySet("s", "triangle", tuple(places[[3, 10, 17]]))
    x = FuzzyVariable.at("x", places, (ends, FuzzySet("g", "gauss", (9.0, 0.7))))
    y = FuzzyVariable("y", 0, 1, 3, (FuzzySet("all", "trapezoid", (0, 0, 1, 1)),))
    rules = tuple(Rule(Is("x", name), (Conclusion("y", "all"),)) for name in ("s", "g"))
    assert np.array_equal(Mamdani((x,), (y,), rules).strengths(places[:, None]), x.memberships)
