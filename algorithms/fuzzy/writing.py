"""Rule bases written as text, in the format of `algorithms.fuzzy.text`."""

from __future__ import annotations

from collections.abc import Sequence

from .base import RuleBase
from .functions import AffineFunction, FunctionOutput
from .rules import And, Condition, Is, Not
from .sets import FuzzyVariable
from .text import NAME, RESERVED


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


def _function_text(function: AffineFunction) -> str:
    slopes = [f" {'-' if slope < 0 else '+'} {_number_text(abs(slope))} {name}" for name, slope in function.slopes]
    return f"    function {function.name} {_number_text(function.constant)}{''.join(slopes)}"


def _variable_lines(variable: FuzzyVariable | FunctionOutput, kind: str, ending: str) -> list[str]:
    """Return the lines of a variable; the first one ends with its method and default."""
    if isinstance(variable, FunctionOutput):
        return [f"{kind} {variable.name}{ending}", *map(_function_text, variable.functions)]
    low, high = _number_text(variable.low), _number_text(variable.high)
    places = f"at {' '.join(map(_number_text, variable.grid))}"
    if not variable.grid:
        places = f"from {low} to {high} samples {variable.samples}"
    sets = [f"    set {one.name} {one.kind} {' '.join(map(_number_text, one.parameters))}" for one in variable.sets]
    return [f"{kind} {variable.name} {places}{ending}", *sets]


def write(system: RuleBase, methods: Sequence[str], implication: str | None) -> str:
    """Write a rule base.

    Parameters
    ----------
    system : RuleBase
    methods : sequence of str
        One of `DEFUZZIFIERS` for each output, or nothing.
    implication : str or None

    Raises
    ------
    ValueError
        If a name cannot be read again.
    """
    names = [one.name for one in (*system.inputs, *system.outputs)] + [rule.name for rule in system.rules if rule.name]
    for variable in (*system.inputs, *system.outputs):
        names += [one.name for one in (variable.sets if isinstance(variable, FuzzyVariable) else variable.functions)]
    for found in names:
        if found in RESERVED or not NAME.fullmatch(found):
            raise ValueError(f"name {found!r}; expected a letter, followed by letters, digits and underscores")
    ending = f" implication {implication}" if implication else ""
    lines = [f"method and {system.conjunction} or {system.disjunction}{ending}"]
    for variable in system.inputs:
        lines += _variable_lines(variable, "input", "")
    outputs: Sequence[FuzzyVariable | FunctionOutput] = system.outputs
    for k, (output, default) in enumerate(zip(outputs, system.defaults, strict=True)):
        by = f" by {methods[k]}" if methods else ""
        lines += _variable_lines(output, "output", by if default is None else f"{by} default {_number_text(default)}")
    for rule in system.rules:
        ends = []
        for end in rule.conclusions:
            weight = "" if end.weight == 1 else f" with {_number_text(end.weight)}"
            ends.append(f"{end.variable} is {end.set}{weight}")
        name = f" {rule.name}:" if rule.name else ""
        lines.append(f"rule{name} if {_condition_text(rule.condition)} then {', '.join(ends)}")
    return "\n".join(lines) + "\n"
