"""Rule bases are read from text and written, and errors give the line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from random_rule_bases import random_rule_base

from algorithms.fuzzy import And, Conclusion, Is, Mamdani, Not, Or, Rule, grasp_controller
from tests.support.all_cases import all_cases

TEXT = """\
# a comment
method and min or max implication min
input x from 0 to 1 samples 11   # another
    set low triangle 0 0 0.5
    set high gauss 1 0.2
output y from 0 to 10 samples 21 by mom
    set small trapezoid 0 0 2 5
    set large bell 2 3 8
rule first: if x is low and not (x is high or x is low) then y is small with 0.5
rule if x is not low or x is high and x is low then y is large and y is small
"""


def test_conditions_are_read_with_their_precedence() -> None:
    first, second = Mamdani.parse(TEXT).rules
    low, high = Is("x", "low"), Is("x", "high")
    assert first.condition == And(low, Not(Or(high, low))) and first.name == "first"
    assert first.conclusions[0].weight == 0.5
    assert second.condition == Or(Not(low), And(high, low))
    assert [(one.set, one.weight) for one in second.conclusions] == [("large", 1.0), ("small", 1.0)]


def test_texts_are_read_as_they_were_written() -> None:
    for seed in range(40):
        system = random_rule_base(np.random.default_rng(seed), "bisector", conjunction="product")
        assert Mamdani.parse(system.to_text()) == system
    assert Mamdani.parse(grasp_controller().to_text()) == grasp_controller()


@all_cases(
    "old, new, message",
    [
        ("x is low and", "x is lo and", "line 9: first: x has no set 'lo'; expected low, high"),
        ("x is high or", "z is high or", "line 9: first: no input 'z'; expected x"),
        ("or x is low)", "or x is low", "line 9: 'then'; expected '\\)'"),
        ("with 0.5", "with 1.5", "line 9: weight of y is small: 1.5; expected a number from 0 to 1"),
        ("with 0.5", "with half", "line 9: 'half'; expected a weight, a number"),
        ("with 0.5", "often", "line 9: 'often'; expected the end of the line"),
        ("by mom", "by mean", "line 6: 'mean'; expected one of centroid, bisector, mom, som, lom"),
        ("triangle 0 0 0.5", "triangle 0 0.5", "line 4: set low: 2 parameters; expected triangle left peak right"),
        ("triangle 0 0 0.5", "triangle 0 1 0.5", "line 4: set low: parameters .*; expected numbers in ascending"),
        ("triangle 0 0 0.5", "cone 0 0 0.5", "line 4: set low: kind 'cone'; expected triangle"),
        ("gauss 1 0.2", "gauss 1 0", "line 5: set high: sigma 0.0; expected a positive number"),
        ("from 0 to 1 ", "from 1 to 0 ", "line 3: variable x: range from 1.0 to 0.0; expected an ascending range"),
        ("samples 11", "samples 1", "line 3: variable x: 1 samples; expected an integer of at least 2"),
        ("samples 11", "samples 2.5", "line 3: '2.5'; expected a whole number"),
        ("samples 11", "samples inf", "line 3: 'inf'; expected a whole number"),
        ("samples 11", "samples nan", "line 3: 'nan'; expected a whole number"),
        (
            "from 0 to 1 ",
            "from 1e6 to 1000000.0000001 ",
            "line 3: variable x: places 1.*e-08 apart .*; expected distan",
        ),
        ("output y", "output x", "line 6: a second variable x; expected different names"),
        ("# a comment", "method and min or max implication min", "line 2: a second line 'method'; expected only one"),
        ("if x is low and", f"if {'not ' * 300} x is low and", "line 9: 'not'; expected a condition .* at most 200"),
        ("if x is low and", f"if {'x is low or ' * 300} x is low and", "line 9: first: .* nested more than 200 times"),
        ("y is large and", "y is huge and", "line 10: rule 2: y has no set 'huge'; expected small, large"),
        ("input x", "inputs x", "line 3: 'inputs'; expected one of method, input, output, set, rule"),
        ("input x", "input if", "line 3: 'if'; expected the name of an input"),
        ("implication min", "implication", "line 2: the end of the line; expected one of min, product"),
        ("rule if x", "rule when x", "line 10: 'x'; expected ':'"),
    ],
)
def test_errors_give_the_line(old: str, new: str, message: str) -> None:
    assert TEXT.count(old) == 1
    with pytest.raises(ValueError, match=message):
        Mamdani.parse(TEXT.replace(old, new))


def test_missing_parts_are_reported() -> None:
    with pytest.raises(ValueError, match="line 1: a set before the first variable"):
        Mamdani.parse("set low triangle 0 0 1")
    with pytest.raises(ValueError, match="rules: empty"):
        Mamdani.parse("\n".join(line for line in TEXT.splitlines() if not line.startswith("rule")))
    with pytest.raises(ValueError, match="inputs: empty"):
        Mamdani.parse("")
    with pytest.raises(ValueError, match="line 3: variable x: two sets low"):
        Mamdani.parse(TEXT.replace("set high", "set low"))


def test_other_types_are_refused() -> None:
    with pytest.raises(TypeError, match="text: bytes; expected str"):
        Mamdani.parse(TEXT.encode())  # type: ignore[arg-type]


def test_files_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "own.rules"
    path.write_bytes(b"\xef\xbb\xbf" + TEXT.replace("\n", "\r\n").encode())
    assert Mamdani.read(path) == Mamdani.parse(TEXT)


@all_cases("name", ["two words", "if", "3x", "a:b", ""])
def test_names_that_cannot_be_read_are_not_written(name: str) -> None:
    system = Mamdani.parse(TEXT)
    inputs = (replace(system.inputs[0], name=name),)
    rules = (Rule(Is(name, "low"), (Conclusion("y", "small"),)),)
    with pytest.raises(ValueError, match=f"name {name!r}; expected a letter"):
        replace(system, inputs=inputs, rules=rules).to_text()
