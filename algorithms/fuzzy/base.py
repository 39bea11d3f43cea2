"""Rule bases: inputs, outputs, rules and methods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .program import DEPTH, OPERATIONS, needed_depth
from .rules import Rule, parts
from .sets import DEFUZZIFIERS, FuzzyVariable, instances


@dataclass(frozen=True)
class RuleBase:
    """A rule base of a fuzzy controller.

    Parameters and errors are those of `Mamdani`, which evaluates it.
    """

    inputs: tuple[FuzzyVariable, ...]
    outputs: tuple[FuzzyVariable, ...]
    rules: tuple[Rule, ...]
    defuzzify: str | tuple[str, ...] = "centroid"
    conjunction: str = "min"
    disjunction: str = "max"
    implication: str = "min"

    def __post_init__(self) -> None:
        for name, kind in (("inputs", FuzzyVariable), ("outputs", FuzzyVariable), ("rules", Rule)):
            found = instances(getattr(self, name), kind, name)
            if not found:
                raise ValueError(f"{name}: empty; expected at least one")
            object.__setattr__(self, name, found)
        count = len(self.outputs)
        by = self.defuzzify
        methods = (by,) * count if isinstance(by, str) else instances(by, str, "defuzzify")
        if len(methods) != count:
            raise ValueError(f"defuzzify: {len(methods)} methods; expected one, or one for each of {count} outputs")
        for method in methods:
            _one_of("defuzzify", method, DEFUZZIFIERS)
        object.__setattr__(self, "defuzzify", methods)
        _one_of("conjunction", self.conjunction, [b for a, b in OPERATIONS if a == "and"])
        _one_of("disjunction", self.disjunction, [b for a, b in OPERATIONS if a == "or"])
        _one_of("implication", self.implication, ("min", "product"))
        names = [one.name for one in (*self.inputs, *self.outputs)]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"variables: two with the name {name}; expected different names")
        for k, rule in enumerate(self.rules):
            check_rule(rule, rule.name or f"rule {k + 1}", self.inputs, self.outputs)


def check_rule(rule: Rule, where: str, inputs: Sequence[FuzzyVariable], outputs: Sequence[FuzzyVariable]) -> None:
    """Check that a rule names sets of inputs and outputs.

    Raises
    ------
    ValueError
        If it does not, if it has no conclusion or repeats one, or if its condition needs too many results at once.
    """
    for kind, own, used in (("input", inputs, parts(rule.condition)), ("output", outputs, rule.conclusions)):
        known = {one.name: one for one in own}
        for part in used:
            if part.variable not in known:
                raise ValueError(f"{where}: no {kind} {part.variable!r}; expected {', '.join(known)}")
            try:
                known[part.variable].index(part.set)
            except ValueError as error:
                raise ValueError(f"{where}: {error}") from None
    depth = needed_depth(rule.condition)
    if depth > DEPTH:
        raise ValueError(
            f"{where}: a condition that needs {depth} results at once; expected at most {DEPTH}; divide the rule"
        )
    if not rule.conclusions:
        raise ValueError(f"{where}: no conclusion; expected at least one")
    used_sets = [(one.variable, one.set) for one in rule.conclusions]
    if len(set(used_sets)) < len(used_sets):
        raise ValueError(f"{where}: a conclusion is repeated; expected different sets")


def _one_of(name: str, value: object, choices: Sequence[str]) -> None:
    if value not in choices:
        raise ValueError(f"{name}: {value!r}; expected one of {', '.join(choices)}")
