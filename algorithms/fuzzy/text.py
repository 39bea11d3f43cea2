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
strongly than ``and``, and ``and`` more strongly than ``or``.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

from .base import RuleBase, check_rule
from .rules import DEEPEST, And, Conclusion, Condition, Is, Not, Or, Rule
from .sets import DEFUZZIFIERS, FuzzySet, FuzzyVariable

_WORD = re.compile(r"[(),:]|[^\s(),:]+")
_RESERVED = ("if", "then", "and", "or", "not", "is", "with", "(", ")", ",", ":")
_NAME = re.compile(r"[^\W\d]\w*")


@dataclass
class _Variable:
    """A variable whose sets are being read."""

    line: int
    kind: str
    name: str
    low: float
    high: float
    samples: int
    method: str
    sets: list[FuzzySet] = field(default_factory=list)

    def finished(self) -> FuzzyVariable:
        return _at(self.line, lambda: FuzzyVariable(self.name, self.low, self.high, self.samples, tuple(self.sets)))


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
        if word in _RESERVED or not _NAME.fullmatch(word):
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


def _method(line: _Line) -> dict[str, str]:
    found = {}
    for word, name, choices in (
        ("and", "conjunction", ("min", "product")),
        ("or", "disjunction", ("max", "sum")),
        ("implication", "implication", ("min", "product")),
    ):
        line.require(word)
        found[name] = line.choice(choices)
    line.end()
    return found


def _variable(line: _Line, kind: str) -> _Variable:
    name = line.name(f"the name of an {kind}")
    line.require("from")
    low = line.number_of("the lower end of the range")
    line.require("to")
    high = line.number_of("the upper end of the range")
    line.require("samples")
    samples = line.number_of("the number of places")
    if not samples.is_integer():
        raise line.fail("a whole number", 1)
    method = "centroid"
    if kind == "output" and line.accept("by"):
        method = line.choice(DEFUZZIFIERS)
    line.end()
    return _Variable(line.number, kind, name, low, high, int(samples), method)


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


def parse(text: str) -> RuleBase:
    """Read a rule base.

    Parameters
    ----------
    text : str

    Returns
    -------
    RuleBase

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
    for number, content in enumerate(text.splitlines(), 1):
        line = _Line(number, content.partition("#")[0])
        if line.peek() is None:
            continue
        word = line.choice(("method", "input", "output", "set", "rule"))
        if word == "method":
            if methods:
                raise ValueError(f"line {number}: a second line 'method'; expected only one")
            methods = _method(line)
        elif word in ("input", "output"):
            variables.append(_variable(line, word))
            if variables[-1].name in {one.name for one in variables[:-1]}:
                raise ValueError(f"line {number}: a second variable {variables[-1].name}; expected different names")
        elif word == "rule":
            rules.append((number, _rule(line)))
        elif variables:
            variables[-1].sets.append(_set(line))
        else:
            raise ValueError(f"line {number}: a set before the first variable; expected an input or output above it")
    return _assembled(methods, variables, rules)


def _assembled(methods: dict[str, str], variables: list[_Variable], rules: list[tuple[int, Rule]]) -> RuleBase:
    found = {kind: tuple(one.finished() for one in variables if one.kind == kind) for kind in ("input", "output")}
    by = tuple(one.method for one in variables if one.kind == "output")
    inputs, outputs = found["input"], found["output"]
    if inputs and outputs:
        for k, (number, rule) in enumerate(rules):
            _at(number, partial(check_rule, rule, rule.name or f"rule {k + 1}", inputs, outputs))
    return RuleBase(inputs, outputs, tuple(rule for _, rule in rules), by, **methods)


def _condition_text(condition: Condition, inside: type | None = None) -> str:
    if isinstance(condition, Is):
        return f"{condition.variable} is {condition.set}"
    if isinstance(condition, Not):
        return f"not {_condition_text(condition.condition, Not)}"
    word = "and" if isinstance(condition, And) else "or"
    # A right operand of the same kind keeps its brackets, so that the text is read as the same tree.
    left = _condition_text(condition.left, type(condition))
    right = _condition_text(condition.right, Not)
    own = f"{left} {word} {right}"
    return own if inside in (None, type(condition)) else f"({own})"


def _number_text(x: float) -> str:
    return str(int(x)) if x == int(x) and abs(x) < 1e15 else repr(float(x))


def write(system: RuleBase) -> str:
    """Write a rule base.

    Raises
    ------
    ValueError
        If a name cannot be read again.
    """
    variables = *system.inputs, *system.outputs
    names = [one.name for one in variables] + [one.name for variable in variables for one in variable.sets]
    for found in names + [rule.name for rule in system.rules if rule.name]:
        if found in _RESERVED or not _NAME.fullmatch(found):
            raise ValueError(f"name {found!r}; expected a letter, followed by letters, digits and underscores")
    lines = [f"method and {system.conjunction} or {system.disjunction} implication {system.implication}"]
    methods = dict(zip((one.name for one in system.outputs), system.defuzzify, strict=True))
    for variable in variables:
        kind = "output" if variable.name in methods else "input"
        by = f" by {methods[variable.name]}" if kind == "output" else ""
        low, high = _number_text(variable.low), _number_text(variable.high)
        lines.append(f"{kind} {variable.name} from {low} to {high} samples {variable.samples}{by}")
        for one in variable.sets:
            lines.append(f"    set {one.name} {one.kind} {' '.join(map(_number_text, one.parameters))}")
    for rule in system.rules:
        ends = []
        for end in rule.conclusions:
            weight = "" if end.weight == 1 else f" with {_number_text(end.weight)}"
            ends.append(f"{end.variable} is {end.set}{weight}")
        name = f" {rule.name}:" if rule.name else ""
        lines.append(f"rule{name} if {_condition_text(rule.condition)} then {', '.join(ends)}")
    return "\n".join(lines) + "\n"
