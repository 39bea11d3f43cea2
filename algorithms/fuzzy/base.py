"""Rule bases: inputs, outputs, rules and methods."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ..arguments import finite_number
from .functions import FunctionOutput
from .program import DEPTH, OPERATIONS, needed_depth
from .rules import Rule, parts
from .sets import FuzzyVariable, instances


class RuleBase:
    """What the rule bases of `Mamdani` and `Sugeno` have in common: the checks of their parts."""

    inputs: tuple[FuzzyVariable, ...]
    outputs: tuple[FuzzyVariable, ...] | tuple[FunctionOutput, ...]
    rules: tuple[Rule, ...]
    conjunction: str
    disjunction: str
    default: float | tuple[float | None, ...] | None

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def _check(self, output: type[FuzzyVariable] | type[FunctionOutput]) -> None:
        """Check the parts, and replace iterables by tuples."""
        for name, kind in (("inputs", FuzzyVariable), ("outputs", output), ("rules", Rule)):
            found = instances(getattr(self, name), kind, name)
            if not found:
                raise ValueError(f"{name}: empty; expected at least one")
            self._set(name, found)
        one_of("conjunction", self.conjunction, [b for a, b in OPERATIONS if a == "and"])
        one_of("disjunction", self.disjunction, [b for a, b in OPERATIONS if a == "or"])
        values = self._checked_defaults()
        # One value for all outputs, however it was given, so that equal rule bases compare equal.
        self._set("default", values if len(set(values)) > 1 else values[0])
        names = [one.name for one in (*self.inputs, *self.outputs)]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"variables: two with the name {name}; expected different names")
        for k, rule in enumerate(self.rules):
            check_rule(rule, rule.name or f"rule {k + 1}", self.inputs, self.outputs)

    @property
    def defaults(self) -> tuple[float | None, ...]:
        """For each output, the value where no rule fires, or None."""
        return self.default if isinstance(self.default, tuple) else (self.default,) * len(self.outputs)

    def _checked_defaults(self) -> tuple[float | None, ...]:
        count, given = len(self.outputs), self.default
        many = not isinstance(given, str) and isinstance(given, Iterable)
        values = tuple(given) if many else (given,) * count  # type: ignore[arg-type]
        if len(values) != count:
            raise ValueError(f"default: {len(values)} numbers; expected one, or one for each of {count} outputs")
        outputs: Sequence[FuzzyVariable | FunctionOutput] = self.outputs
        return tuple(default_of(value, output) for value, output in zip(values, outputs, strict=True))


def default_of(value: object, output: FuzzyVariable | FunctionOutput) -> float | None:
    """Return the value of an output if no rule fires: None, or a finite number in its range.

    Raises
    ------
    TypeError, ValueError
        If it is something else.
    """
    if value is None:
        return None
    number = finite_number(value, f"default of {output.name}")
    if isinstance(output, FuzzyVariable) and not output.low <= number <= output.high:
        raise ValueError(f"default of {output.name}: {number}; expected a number from {output.low} to {output.high}")
    return number


def check_rule(
    rule: Rule,
    where: str,
    inputs: Sequence[FuzzyVariable],
    outputs: Sequence[FuzzyVariable] | Sequence[FunctionOutput],
) -> None:
    """Check that a rule names sets of inputs, and sets or functions of outputs.

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


def one_of(name: str, value: object, choices: Sequence[str]) -> None:
    """Check that a value is one of some words.

    Raises
    ------
    ValueError
        If it is not.
    """
    if value not in choices:
        raise ValueError(f"{name}: {value!r}; expected one of {', '.join(choices)}")
