"""Rule bases as text.

Each line has one entry; ``#`` begins a comment::

    method and min or max implication min
    input distance from 0 to 300 samples 301
        set near trapezoid 0 0 40 90
        set far sigmoid 120 0.05
    output closing from 0 to 1 samples 101 by centroid
        set slow triangle 0 0 0.6
        set fast gauss 1 0.2
    rule approach: if distance is far and not (angle is large or angle is small) then closing is slow with 0.8
    rule close: if distance is near then closing is fast, force is high

The line ``method`` and the names of rules may be omitted. Sets belong to the variable above them. ``not`` binds more
strongly than ``and``, and ``and`` more strongly than ``or``. A variable with its own places has ``at`` and the places
instead of a range, and an output may have a value where no rule fires, at the end of its line::

    input distance at 0 10 20 40 80 160 300
    output closing at 0 0.1 0.2 0.5 1 by centroid default 0

In rule bases for Sugeno inference, outputs have functions of the inputs instead of a range and sets, and the line
``method`` has no implication::

    method and product or sum
    output closing default 0
        function slow 0.1
        function fast 0.4 + 0.002 distance - 0.01 angle
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

from .base import check_rule, default_of
from .functions import AffineFunction, FunctionOutput
from .rules import DEEPEST, And, Conclusion, Condition, Is, Not, Or, Rule
from .sets import DEFUZZIFIERS, FuzzySet, FuzzyVariable

_WORD = re.compile(r"[(),:]|[^\s(),:]+")
RESERVED = ("if", "then", "and", "or", "not", "is", "with", "(", ")", ",", ":")
NAME = re.compile(r"[^\W\d]\w*")
"""What names of variables, sets, functions and rules look like."""


@dataclass
class _Variable:
    """A variable whose sets or functions are being read."""

    line: int
    kind: str
    name: str
    method: str = "centroid"
    default: float | None = None
    range: tuple[float, float, int] | None = None
    """The lower and the upper end, and the number of places."""
    places: list[float] = field(default_factory=list)
    """Places that are not equidistant."""
    sets: list[FuzzySet] = field(default_factory=list)
    functions: list[AffineFunction] = field(default_factory=list)

    def finished(self) -> FuzzyVariable | FunctionOutput:
        """Return the variable, after a check of its default."""
        found = _at(self.line, self._made)
        _at(self.line, partial(default_of, self.default, found))
        return found

    def _made(self) -> FuzzyVariable | FunctionOutput:
        if self.range is not None:
            return FuzzyVariable(self.name, *self.range, tuple(self.sets))
        if self.places:
            return FuzzyVariable.at(self.name, self.places, tuple(self.sets))
        return FunctionOutput(self.name, tuple(self.functions))


_Made = TypeVar("_Made")


def _at(line: int, make: Callable[[], _Made]) -> _Made:
    """Call a function, and add the number of a line to its errors."""
    try:
        return make()
    except (ValueError, TypeError) as error:
        raise ValueError(f"line {line}: {error}") from None


class _Line:
    """The words of a line, read from left to right."""

    def __init__(self, number: int, text: str) -> None:
        self.number, self._words, self._at = number, _WORD.findall(text), 0
        self.depth = 0

    def fail(self, expected: str, step: int = 0) -> ValueError:
        at = self._at - step
        found = repr(self._words[at]) if at < len(self._words) else "the end of the line"
        return ValueError(f"line {self.number}: {found}; expected {expected}")

    def peek(self) -> str | None:
        return self._words[self._at] if self._at < len(self._words) else None

    def next(self, expected: str) -> str:
        word = self.peek()
        if word is None:
            raise self.fail(expected)
        self._at += 1
        return word

    def accept(self, *words: str) -> bool:
        if self.peek() not in words:
            return False
        self._at += 1
        return True

    def require(self, word: str) -> None:
        if not self.accept(word):
            raise self.fail(repr(word))

    def name(self, what: str) -> str:
        word = self.next(what)
        if word in RESERVED or not NAME.fullmatch(word):
            raise self.fail(what, 1)
        return word

    def choice(self, words: tuple[str, ...]) -> str:
        word = self.next(f"one of {', '.join(words)}")
        if word not in words:
            raise self.fail(f"one of {', '.join(words)}", 1)
        return word

    def number_of(self, what: str) -> float:
        word = self.next(what)
        try:
            return float(word)
        except ValueError:
            raise self.fail(f"{what}, a number", 1) from None

    def end(self) -> None:
        if self.peek() is not None:
            raise self.fail("the end of the line")


def _method(line: _Line, functions: bool) -> dict[str, str]:
    found = {}
    for word, name, choices in (
        ("and", "conjunction", ("min", "product")),
        ("or", "disjunction", ("max", "sum")),
        ("implication", "implication", ("min", "product")),
    ):
        if name != "implication" or not functions:
            line.require(word)
            found[name] = line.choice(choices)
    line.end()
    return found


def _variable(line: _Line, kind: str, functions: bool) -> _Variable:
    found = _Variable(line.number, kind, line.name(f"the name of an {kind}"))
    if kind == "input" or not functions:
        if line.accept("at"):
            while line.peek() not in (None, "by", "default"):
                found.places.append(line.number_of("a place"))
            if not found.places:
                raise line.fail("a place")
        else:
            found.range = _range(line)
        if kind == "output" and line.accept("by"):
            found.method = line.choice(DEFUZZIFIERS)
    if kind == "output" and line.accept("default"):
        found.default = line.number_of("the value where no rule fires")
    line.end()
    return found


def _range(line: _Line) -> tuple[float, float, int]:
    if not line.accept("from"):
        raise line.fail("'from' or 'at'")
    low = line.number_of("the lower end of the range")
    line.require("to")
    high = line.number_of("the upper end of the range")
    line.require("samples")
    samples = line.number_of("the number of places")
    if not samples.is_integer():
        raise line.fail("a whole number", 1)
    return low, high, int(samples)


def _function(line: _Line) -> AffineFunction:
    name, constant = line.name("the name of a function"), line.number_of("a constant")
    slopes = []
    while line.peek() is not None:
        sign = -1.0 if line.choice(("+", "-")) == "-" else 1.0
        slope = sign * line.number_of("a slope")
        slopes.append((line.name("an input"), slope))
    return _at(line.number, lambda: AffineFunction(name, constant, tuple(slopes)))


def _set(line: _Line) -> FuzzySet:
    name, kind = line.name("the name of a set"), line.next("the kind of the set")
    numbers = []
    while line.peek() is not None:
        numbers.append(line.number_of("a parameter"))
    return _at(line.number, lambda: FuzzySet(name, kind, tuple(numbers)))


def _disjunction(line: _Line) -> Condition:
    found = _conjunction(line)
    while line.accept("or"):
        found = Or(found, _conjunction(line))
    return found


def _conjunction(line: _Line) -> Condition:
    found = _negation(line)
    while line.accept("and"):
        found = And(found, _negation(line))
    return found


def _negation(line: _Line) -> Condition:
    line.depth += 1
    if line.depth > DEEPEST:
        raise line.fail(f"a condition that is nested at most {DEEPEST} times")
    found = _factor(line)
    line.depth -= 1
    return found


def _factor(line: _Line) -> Condition:
    if line.accept("not"):
        return Not(_negation(line))
    if line.accept("("):
        found = _disjunction(line)
        line.require(")")
        return found
    variable = line.name("an input, 'not' or '('")
    line.require("is")
    if line.accept("not"):
        return Not(Is(variable, line.name("the name of a set")))
    return Is(variable, line.name("the name of a set"))


def _rule(line: _Line) -> Rule:
    name = ""
    if not line.accept("if"):
        if not line.accept(":"):
            name = line.name("'if' or the name of the rule")
            line.require(":")
        line.require("if")
    condition = _disjunction(line)
    line.require("then")
    conclusions = []
    while True:
        variable = line.name("an output")
        line.require("is")
        target = line.name("the name of a set")
        weight = line.number_of("a weight") if line.accept("with") else 1.0
        conclusions.append(_at(line.number, partial(Conclusion, variable, target, weight)))
        if not line.accept(",", "and"):
            break
    line.end()
    return _at(line.number, partial(Rule, condition, tuple(conclusions), name))


def parse(text: str, functions: bool = False) -> dict[str, Any]:
    """Read a rule base.

    Parameters
    ----------
    text : str
    functions : bool, optional
        Whether rules conclude functions, and not sets.

    Returns
    -------
    dict
        The arguments of `Sugeno` or of `Mamdani`.

    Raises
    ------
    TypeError
        If `text` is not a string.
    ValueError
        With the number of the line, what was found, and what was expected.
    """
    if not isinstance(text, str):
        raise TypeError(f"text: {type(text).__name__}; expected str")
    methods: dict[str, str] = {}
    variables: list[_Variable] = []
    rules: list[tuple[int, Rule]] = []
    words = "method", "input", "output", "set", "rule"
    for number, content in enumerate(text.splitlines(), 1):
        line = _Line(number, content.partition("#")[0])
        if line.peek() is None:
            continue
        word = line.choice((*words, "function") if functions else words)
        if word == "method":
            if methods:
                raise ValueError(f"line {number}: a second line 'method'; expected only one")
            methods = _method(line, functions)
        elif word in ("input", "output"):
            variables.append(_variable(line, word, functions))
            if variables[-1].name in {one.name for one in variables[:-1]}:
                raise ValueError(f"line {number}: a second variable {variables[-1].name}; expected different names")
        elif word == "rule":
            rules.append((number, _rule(line)))
        else:
            _add(line, word, variables, functions)
    return _assembled(methods, variables, rules, functions)


def _add(line: _Line, word: str, variables: list[_Variable], functions: bool) -> None:
    """Add a set or a function to the last variable."""
    if not variables:
        raise ValueError(
            f"line {line.number}: a {word} before the first variable; expected an input or output above it"
        )
    last = variables[-1]
    expected = "function" if functions and last.kind == "output" else "set"
    if word != expected:
        raise ValueError(f"line {line.number}: a {word} of the {last.kind} {last.name}; expected a {expected}")
    if word == "set":
        last.sets.append(_set(line))
    else:
        last.functions.append(_function(line))


def _assembled(
    methods: dict[str, str], variables: list[_Variable], rules: list[tuple[int, Rule]], functions: bool
) -> dict[str, Any]:
    made = [(one.kind, one.finished()) for one in variables]
    inputs = [one for kind, one in made if kind == "input" and isinstance(one, FuzzyVariable)]
    outputs: list[Any] = [one for kind, one in made if kind == "output"]
    if inputs and outputs:
        for k, (number, rule) in enumerate(rules):
            _at(number, partial(check_rule, rule, rule.name or f"rule {k + 1}", inputs, outputs))
    own = [one for one in variables if one.kind == "output"]
    found: dict[str, Any] = {"inputs": tuple(inputs), "outputs": tuple(outputs)}
    found |= {"rules": tuple(rule for _, rule in rules), "default": tuple(one.default for one in own)}
    if not functions:
        found["defuzzify"] = tuple(one.method for one in own)
    return found | methods
