"""Sugeno inference compared with exact rational numbers and with numpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from random_rule_bases import on_own_places, random_inputs, random_rule_base, strength

from algorithms.fuzzy import (
    AffineFunction,
    And,
    Conclusion,
    FunctionOutput,
    FuzzySet,
    FuzzyStatus,
    FuzzyVariable,
    Is,
    Mamdani,
    Rule,
    Sugeno,
)
from tests.support.all_cases import all_cases

TEXT = """\
method and product or max
input x from 0 to 1 samples 2
    set low triangle 0 0 1
    set high triangle 0 1 1
input y from 0 to 4 samples 5
    set small triangle 0 0 2
    set middle triangle 1 2 3
output z
    function slow 2
    function fast 1 + 3 x - 0.5 y
output w default 9
    function one 1
rule first: if x is low and y is small then z is slow
rule if x is high then z is fast with 0.5
rule if y is middle and x is high then w is one
"""
X, Y = Fraction(1, 4), Fraction(1, 2)
LOW, HIGH, SMALL = 1 - X, X, 1 - Y / 2
OK, CLIPPED, NOTHING, INVALID = (int(FuzzyStatus[name]) for name in ("OK", "CLIPPED", "NO_RULE_FIRES", "NOT_FINITE"))


def exact(conjunction: str) -> Fraction:
    """The output z at (1/4, 1/2), by hand."""
    first = LOW * SMALL if conjunction == "product" else min(LOW, SMALL)
    second = HIGH / 2
    return (first * 2 + second * (1 + 3 * X - Y / 2)) / (first + second)


@pytest.mark.parametrize("conjunction", ["min", "product"])
def test_two_rules(conjunction: str) -> None:
    system = replace(Sugeno.parse(TEXT), conjunction=conjunction)
    found = system.evaluate([0.25, 0.5])
    assert abs(found.values[0] - float(exact(conjunction))) < 1e-15
    assert found.status.tolist() == [OK, NOTHING] and found.values[1] == 9


def test_statuses_defaults_and_kinds_of_arrays() -> None:
    system = Sugeno.parse(TEXT)
    # Above y = 2 the first rule is silent, and x = 0 silences the second one.
    x = [[0.25, 0.5], [2, 0.5], [0, 3.5], [np.nan, 1], [1, np.inf], [1, 2]]
    found = system.evaluate(x)
    assert found.status.tolist() == [
        [OK, NOTHING], [CLIPPED, NOTHING], [NOTHING, NOTHING], [INVALID, INVALID], [INVALID, INVALID], [OK, OK],
    ]  # fmt: skip
    # At x = 2, replaced by 1, only the function 1 + 3 x - y / 2 counts: also there x is 1.
    expected = [[float(exact("product")), 9], [3.75, 9], [np.nan, 9], [np.nan] * 2, [np.nan] * 2, [3, 1]]
    assert np.allclose(found.values, expected, rtol=0, atol=1e-15, equal_nan=True)
    assert system.evaluate(np.zeros((0, 2))).values.shape == (0, 2)
    assert system.gradient(np.zeros((0, 2))).shape == (0, 2, 2)
    single = np.array(x[0], np.float32)
    for given in (single, {"y": 0.5, "x": 0.25}, np.asfortranarray([x[0]])[0]):
        assert np.array_equal(system.evaluate(given).values, found.values[0])
    with pytest.raises(ValueError, match=r"inputs: shape \(3,\); expected \(\.\.\., 2\)"):
        system.evaluate(np.zeros(3))


def test_one_rule_and_equal_memberships() -> None:
    """One rule gives its function whatever its strength is, and equal strengths give the mean."""
    x = FuzzyVariable("x", -1, 1, 3, (FuzzySet("a", "triangle", (-1, 0, 1)), FuzzySet("b", "triangle", (-1, 0, 1))))
    y = FunctionOutput("y", (AffineFunction("f", 3, (("x", -2),)), AffineFunction("g", 7)))
    rules = Rule(Is("x", "a"), (Conclusion("y", "f"),)), Rule(Is("x", "b"), (Conclusion("y", "g"),))
    for at in (-0.75, 0.0, 0.5, 1 - 2.0**-40):
        assert Sugeno((x,), (y,), rules[:1]).evaluate([at]).values[0] == 3 - 2 * at
        assert Sugeno((x,), (y,), rules).evaluate([at]).values[0] == 5 - at
    # Rules that conclude the same function count twice.
    thrice = Sugeno((x,), (y,), (*rules, rules[1])).evaluate([0.0]).values[0]
    assert abs(thrice - 17 / 3) < 2e-15


def test_tiny_strengths_and_overflow() -> None:
    """Subnormal strengths have a mean, too, and affine functions may overflow."""
    sets = FuzzySet("a", "triangle", (0, 1, 1)), FuzzySet("b", "triangle", (0, 1, 1))
    x, z = (FuzzyVariable(name, 0, 1, 2, sets) for name in "xz")
    functions = AffineFunction("f", 0.3), AffineFunction("g", 0.6), AffineFunction("h", 1e308, (("x", 1e308),))
    end = [(Conclusion("y", name),) for name in "fgh"]
    both = And(Is("x", "a"), Is("z", "a"))
    system = Sugeno((x, z), (FunctionOutput("y", functions),), (Rule(both, end[0]), Rule(both, end[1])), "product")
    # The strengths are the smallest positive numbers, and their products with the functions would be 0.
    assert abs(system.evaluate([2.0**-537, 2.0**-537]).values[0] - 0.45) < 1e-15
    found = replace(system, rules=(Rule(Is("x", "a"), end[2]),)).evaluate([[1.0, 1.0], [0.5, 0.5]])
    assert found.status[:, 0].tolist() == [INVALID, OK] and np.isnan(found.values[0, 0])
    # A rule that does not fire changes nothing, even if its function overflows.
    silent = replace(system, rules=(Rule(Is("x", "a"), end[0]), Rule(Is("z", "a"), end[2])))
    assert silent.evaluate([1.0, 0.0]).values[0] == 0.3


def random_system(rng: np.random.Generator) -> Sugeno:
    """The inputs and conditions of a random rule base for Mamdani inference, with random functions."""
    base: Mamdani = random_rule_base(rng, conjunction=str(rng.choice(["min", "product"])))
    if rng.uniform() < 0.5:
        base = on_own_places(rng, base)
    names = [one.name for one in base.inputs]
    functions = tuple(
        AffineFunction(one.name, rng.normal(), tuple((name, rng.normal()) for name in names if rng.uniform() < 0.6))
        for one in base.outputs[0].sets
    )
    return Sugeno(base.inputs, (FunctionOutput("y", functions),), base.rules, base.conjunction)


def reference(system: Sugeno, x: np.ndarray) -> float | None:
    """The output for one input, with numpy."""
    members = {}
    values = dict(zip((one.name for one in system.inputs), x, strict=True))
    for variable in system.inputs:
        for one in variable.sets:
            heights = one.membership(variable.places)
            members[variable.name, one.name] = np.interp(values[variable.name], variable.places, heights)
    functions = {one.name: one for one in system.outputs[0].functions}
    sums = np.zeros(2)
    for rule in system.rules:
        end = rule.conclusions[0]
        function = functions[end.set]
        value = function.constant + sum(slope * values[name] for name, slope in function.slopes)
        sums += end.weight * strength(rule.condition, members, system) * np.array([1, value])
    return None if sums[0] == 0 else float(sums[1] / sums[0])


def test_random_rule_bases_agree_with_numpy() -> None:
    fired = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        system = random_system(rng)
        x = random_inputs(rng, system, 20)
        found = system.evaluate(x)
        for row, value, status in zip(x, found.values[:, 0], found.status[:, 0], strict=True):
            expected = reference(system, row)
            assert status == (NOTHING if expected is None else OK)
            if expected is not None:
                assert abs(value - expected) <= 1e-12 * (1 + np.abs(row).max())
                fired += 1
    assert fired > 250


def test_long_batches_agree_with_single_inputs() -> None:
    rng = np.random.default_rng(4)
    system = random_system(rng)
    x = random_inputs(rng, system, 5000)
    found, slopes = system.evaluate(x).values, system.gradient(x)
    for k in (0, 1, 2047, 4095, 4096, 4999):
        assert np.array_equal(system.evaluate(x[k]).values, found[k], equal_nan=True)
        assert np.array_equal(system.gradient(x[k]), slopes[k], equal_nan=True)


def test_gradients_by_hand() -> None:
    """The derivatives of the quotient at (1/4, 1/2), with rational numbers."""
    system = Sugeno.parse(TEXT)
    first, second = LOW * SMALL, HIGH / 2
    sum, fast = first + second, 1 + 3 * X - Y / 2
    mean = exact("product")
    by_x = (-SMALL * (2 - mean) + (fast - mean) / 2 + second * 3) / sum
    by_y = (-LOW / 2 * (2 - mean) - second / 2) / sum
    found = system.gradient([[0.25, 0.5], [2.0, 0.5], [0.0, 3.5], [np.nan, 1.0]])
    assert np.allclose(found[0, 0], [float(by_x), float(by_y)], rtol=0, atol=1e-15)
    # Beyond the range of x nothing changes with it; there only the function 1 + 3 x - y / 2 counts.
    assert found[1, 0].tolist() == [0, -0.5]
    assert np.isnan(found[2:]).all() and np.isnan(found[:, 1]).all()


def test_gradients_agree_with_differences() -> None:
    compared = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        system = random_system(rng)
        x = random_inputs(rng, system, 40)
        found = system.gradient(x)[:, 0]
        for k, variable in enumerate(system.inputs):
            step = 1e-6 * (variable.high - variable.low) * np.eye(len(system.inputs))[k]
            sides = [system.evaluate(x + s * step).values[:, 0] for s in (-1, 0, 1)]
            slopes = np.diff(sides, axis=0) / step[k]
            # Between two places and away from corners both differences agree.
            smooth = np.abs(slopes[1] - slopes[0]) < 1e-3 * np.abs(slopes).max(0)
            assert np.allclose(found[smooth, k], slopes.mean(0)[smooth], rtol=1e-3, atol=1e-6)
            compared += int(smooth.sum())
    assert compared > 300


def test_texts_are_read_as_they_were_written() -> None:
    system = Sugeno.parse(TEXT)
    assert system.outputs[0].functions[1] == AffineFunction("fast", 1, (("x", 3), ("y", -0.5)))
    assert system.default == (None, 9.0) and system.conjunction == "product"
    assert Sugeno.parse(system.to_text()) == system
    for seed in range(20):
        system = random_system(np.random.default_rng(seed))
        assert Sugeno.parse(system.to_text()) == system


@all_cases(
    "old, new, message",
    [
        ("slow 2", "slow", "line 9: the end of the line; expected a constant"),
        ("+ 3 x", "3 x", "line 10: '3'; expected one of \\+, -"),
        ("+ 3 x", "+ x 3", "line 10: 'x'; expected a slope, a number"),
        ("+ 3 x", "+ 3 x + 2 x", "line 10: function fast: two slopes of x; expected one"),
        ("+ 3 x", "+ 3 v", "output z: function fast: no input 'v'; expected x, y"),
        ("z is slow", "z is slower", "line 13: first: z has no function 'slower'; expected slow, fast"),
        ("function one 1", "set one triangle 0 0 1", "line 12: a set of the output w; expected a function"),
        ("set low triangle 0 0 1", "function low 1", "line 3: a function of the input x; expected a set"),
        ("output w", "output w from 0 to 1 samples 5", "line 11: 'from'; expected the end of the line"),
        ("or max", "or max implication min", "line 1: 'implication'; expected the end of the line"),
        ("    function one 1\n", "", "line 11: output w: no functions; expected at least one"),
    ],
)
def test_errors_give_the_line(old: str, new: str, message: str) -> None:
    assert TEXT.count(old) == 1
    with pytest.raises(ValueError, match=message):
        Sugeno.parse(TEXT.replace(old, new))


def test_texts_of_the_other_kind_are_refused() -> None:
    with pytest.raises(ValueError, match="line 1: the end of the line; expected 'implication'"):
        Mamdani.parse(TEXT)
    one = "input x from 0 to 1 samples 2\nfunction f 1\n"
    with pytest.raises(ValueError, match="line 2: 'function'; expected one of method, input, output, set, rule"):
        Mamdani.parse(one)


@all_cases(
    "make, message",
    [
        (lambda: AffineFunction("f", "1"), "function f: constant: '1'; expected a number"),
        (lambda: AffineFunction("f", 1, "x"), "function f: slopes 'x'; expected pairs"),
        (lambda: AffineFunction("f", 1, (("x",),)), "function f: slope .* expected an input and a number"),
        (lambda: FunctionOutput("y", ("f",)), "output y: functions: 'f'; expected AffineFunction"),
        (
            lambda: replace(Sugeno.parse(TEXT), outputs=Sugeno.parse(TEXT).inputs),
            "outputs: FuzzyVariable.*; expected FunctionOutput",
        ),
    ],
)
def test_other_types_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(TypeError, match=message):
        make()


def test_rules_that_never_fire() -> None:
    rule = Rule(And(Is("y", "small"), Is("y", "middle")), (Conclusion("z", "slow", 0.0),))
    system = Sugeno.parse(TEXT)
    never = int(FuzzyStatus.RULE_NEVER_FIRES)
    assert replace(system, rules=(*system.rules, rule)).rule_status.tolist() == [0, 0, 0, never]
    fires = replace(rule, conclusions=(Conclusion("z", "slow", 0.1),))
    assert replace(system, rules=(fires,)).rule_status.tolist() == [0]
