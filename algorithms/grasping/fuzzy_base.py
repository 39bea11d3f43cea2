"""Rule bases: inputs, outputs, rules and methods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .fuzzy_program import OPERATIONS
from .fuzzy_rules import Rule, parts
from .fuzzy_sets import DEFUZZIFIERS, FuzzyVariable


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
        for name in ("inputs", "outputs", "rules"):
            found = tuple(getattr(self, name))
            if not found:
                raise ValueError(f"{name}: empty; expected at least one")
            object.__setattr__(self, name, found)
        count = len(self.outputs)
        methods = (self.defuzzify,) * count if isinstance(self.defuzzify, str) else tuple(self.defuzzify)
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
            self._check_rule(rule, rule.name or f"rule {k + 1}")

    def _check_rule(self, rule: Rule, where: str) -> None:
        for kind, own, used in (
            ("input", self.inputs, parts(rule.condition)),
            ("output", self.outputs, rule.conclusions),
        ):
            known = {one.name: one for one in own}
            for part in used:
                if part.variable not in known:
                    raise ValueError(f"{where}: no {kind} {part.variable!r}; expected {', '.join(known)}")
                try:
                    known[part.variable].index(part.set)
                except ValueError as error:
                    raise ValueError(f"{where}: {error}") from None
        if not rule.conclusions:
            raise ValueError(f"{where}: no conclusion; expected at least one")
        used_sets = [(one.variable, one.set) for one in rule.conclusions]
        if len(set(used_sets)) < len(used_sets):
            raise ValueError(f"{where}: a conclusion is repeated; expected different sets")


def _one_of(name: str, value: object, choices: Sequence[str]) -> None:
    if value not in choices:
        raise ValueError(f"{name}: {value!r}; expected one of {', '.join(choices)}")
