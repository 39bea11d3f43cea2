"""Rule bases as control systems of scikit-fuzzy."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from algorithms.fuzzy import And, FuzzySet, Is, Mamdani, Not

Array = np.ndarray[Any, Any]


def peer_membership(fuzzy: Any, one: FuzzySet, x: Array) -> Array:
    """The membership by the function of the same kind."""
    p = one.parameters
    if one.kind in ("triangle", "trapezoid"):
        return np.asarray((fuzzy.trimf if one.kind == "triangle" else fuzzy.trapmf)(x, p))
    return np.asarray({"gauss": fuzzy.gaussmf, "bell": fuzzy.gbellmf, "sigmoid": fuzzy.sigmf}[one.kind](x, *p))


def peer_condition(condition: Any, variables: dict[str, Any]) -> Any:
    """The condition over terms."""
    if isinstance(condition, Is):
        return variables[condition.variable][condition.set]
    if isinstance(condition, Not):
        return ~peer_condition(condition.condition, variables)
    a, b = (peer_condition(side, variables) for side in (condition.left, condition.right))
    return a & b if isinstance(condition, And) else a | b


def peer_simulation(system: Mamdani) -> tuple[Any, dict[str, Any]]:
    """A simulation, and the variables by name."""
    fuzzy, control = importlib.import_module("skfuzzy"), importlib.import_module("skfuzzy.control")
    used = {(end.variable, end.set) for rule in system.rules for end in rule.conclusions}
    variables: dict[str, Any] = {}
    for variable in system.inputs:
        variables[variable.name] = control.Antecedent(variable.places, variable.name)
    for variable, method in zip(system.outputs, system.defuzzify, strict=True):
        variables[variable.name] = control.Consequent(variable.places, variable.name, defuzzify_method=method)
    for variable in (*system.inputs, *system.outputs):
        for one in variable.sets:
            # scikit-fuzzy fails for arrays if no rule concludes a set.
            if variable in system.inputs or (variable.name, one.name) in used:
                variables[variable.name][one.name] = peer_membership(fuzzy, one, variable.places)
    rules = []
    for k, rule in enumerate(system.rules):
        ends = [variables[end.variable][end.set] % float(end.weight) for end in rule.conclusions]
        rules.append(control.Rule(peer_condition(rule.condition, variables), ends, label=f"rule {k}"))
    return control.ControlSystemSimulation(control.ControlSystem(rules), lenient=True), variables


def used_inputs(system: Mamdani) -> list[str]:
    """The inputs that rules name; scikit-fuzzy does not know others."""
    from algorithms.fuzzy.rules import parts

    return sorted({part.variable for rule in system.rules for part in parts(rule.condition)})
