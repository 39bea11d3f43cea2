"""Random rule bases, and Mamdani inference written with numpy for one input, as scikit-fuzzy documents it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from algorithms.fuzzy import And, Conclusion, FuzzySet, FuzzyVariable, Is, Mamdani, Not, Or, Rule, Sugeno

Array = np.ndarray[Any, Any]


def random_set(rng: np.random.Generator, name: str, low: float, high: float) -> FuzzySet:
    width = high - low
    kind = str(rng.choice(["triangle", "trapezoid", "gauss", "bell", "sigmoid"]))
    places = np.sort(rng.uniform(low - 0.2 * width, high + 0.2 * width, 4))
    inside = np.sort(rng.uniform(low, high, 4))
    numbers = {
        "triangle": np.sort(np.r_[places[0], inside[1], places[3]]),
        "trapezoid": np.sort(np.r_[places[0], inside[1:3], places[3]]),
        "gauss": [inside[1], width * rng.uniform(0.05, 0.3)],
        "bell": [width * rng.uniform(0.1, 0.3), rng.uniform(1, 4), inside[2]],
        "sigmoid": [inside[1], rng.choice([-1, 1]) * rng.uniform(5, 40) / width],
    }
    return FuzzySet(name, kind, tuple(float(x) for x in numbers[kind]))


def random_variable(rng: np.random.Generator, name: str) -> FuzzyVariable:
    low = float(rng.uniform(-50, 50))
    high = low + float(10 ** rng.uniform(-1, 2))
    sets = tuple(random_set(rng, f"s{k}", low, high) for k in range(rng.integers(2, 6)))
    return FuzzyVariable(name, low, high, int(rng.integers(20, 140)), sets)


def random_condition(rng: np.random.Generator, inputs: tuple[FuzzyVariable, ...], depth: int) -> Any:
    if depth == 0 or rng.uniform() < 0.25:
        variable = inputs[rng.integers(len(inputs))]
        return Is(variable.name, variable.sets[rng.integers(len(variable.sets))].name)
    kind = rng.integers(5)
    if kind == 0:
        return Not(random_condition(rng, inputs, depth - 1))
    sides = [random_condition(rng, inputs, depth - 1) for _ in range(2)]
    return (And if kind < 3 else Or)(*sides)


def random_rule_base(rng: np.random.Generator, method: str = "centroid", **methods: str) -> Mamdani:
    """A rule base of one to three inputs, one output, and two to eight rules with weights."""
    inputs = tuple(random_variable(rng, f"x{k}") for k in range(rng.integers(1, 4)))
    output = random_variable(rng, "y")
    rules = []
    for _ in range(rng.integers(2, 9)):
        name = output.sets[rng.integers(len(output.sets))].name
        weight = 1.0 if rng.uniform() < 0.5 else float(rng.uniform(0.1, 1))
        rules.append(Rule(random_condition(rng, inputs, 3), (Conclusion("y", name, weight),)))
    return Mamdani(inputs, (output,), tuple(rules), method, **methods)


def _degenerate_set(rng: np.random.Generator, name: str, grid: Array) -> FuzzySet:
    p = [float(x) for x in np.sort(rng.choice(grid, 4))]
    choices = [
        ("triangle", (p[0], p[1], p[3])),
        ("trapezoid", tuple(p)),
        ("triangle", (p[0],) * 3),
        ("trapezoid", (p[0], p[0], p[2], p[2])),
        ("triangle", (p[0] - 1, p[0] - 1, p[2] + 1)),
    ]
    kind, parameters = choices[rng.integers(len(choices))]
    return FuzzySet(name, kind, parameters)


def degenerate_rule_base(rng: np.random.Generator, method: str, **methods: str) -> Mamdani:
    """A rule base with corners on few places, sets of one place, equal sets, and rules that conclude several sets."""

    def variable(name: str, count: int) -> FuzzyVariable:
        low, width, samples = float(rng.integers(-5, 5)), float(rng.integers(1, 10)), int(rng.integers(2, 30))
        grid = np.linspace(low, low + width, samples)
        sets = [_degenerate_set(rng, f"s{k}", grid) for k in range(count)]
        if count > 1 and rng.uniform() < 0.3:
            sets[-1] = FuzzySet(f"s{count - 1}", sets[0].kind, sets[0].parameters)
        return FuzzyVariable(name, low, low + width, samples, tuple(sets))

    inputs = tuple(variable(f"x{k}", int(rng.integers(1, 4))) for k in range(rng.integers(1, 3)))
    output = variable("y", int(rng.integers(1, 6)))
    rules = []
    for _ in range(rng.integers(1, 6)):
        names = rng.permutation([one.name for one in output.sets])[: rng.integers(1, len(output.sets) + 1)]
        ends = tuple(Conclusion("y", str(name), float(rng.choice([1, 0.5]))) for name in names)
        rules.append(Rule(random_condition(rng, inputs, 2), ends))
    return Mamdani(inputs, (output,), tuple(rules), method, **methods)


def on_own_places(rng: np.random.Generator, system: Mamdani) -> Mamdani:
    """The same rule base, in which the places of all variables have random distances."""

    def moved(one: FuzzyVariable) -> FuzzyVariable:
        steps = np.cumsum(10 ** rng.uniform(-2, 0, one.samples - 1))
        places = np.r_[one.low, one.low + (one.high - one.low) * steps / steps[-1]]
        places[-1] = one.high
        return FuzzyVariable.at(one.name, places, one.sets)

    return replace(system, inputs=tuple(map(moved, system.inputs)), outputs=tuple(map(moved, system.outputs)))


def random_inputs(rng: np.random.Generator, system: Mamdani | Sugeno, count: int) -> Array:
    low, high = np.array([[one.low, one.high] for one in system.inputs]).T
    return rng.uniform(low, high, (count, len(low)))


def strength(condition: Any, members: dict[tuple[str, str], float], system: Mamdani | Sugeno) -> float:
    if isinstance(condition, Is):
        return members[condition.variable, condition.set]
    if isinstance(condition, Not):
        return 1 - strength(condition.condition, members, system)
    a, b = (strength(side, members, system) for side in (condition.left, condition.right))
    if isinstance(condition, And):
        return min(a, b) if system.conjunction == "min" else a * b
    return max(a, b) if system.disjunction == "max" else a + b - a * b


def reference_union(system: Mamdani, x: Array) -> tuple[Array, Array]:
    """The places and the union of the first output: places of the grid, and crossings of sets with their strengths."""
    members = {}
    for value, variable in zip(x, system.inputs, strict=True):
        for one in variable.sets:
            members[variable.name, one.name] = np.interp(value, variable.places, one.membership(variable.places))
    output = system.outputs[0]
    grid = output.places
    cuts: dict[str, float] = {}
    for rule in system.rules:
        for end in rule.conclusions:
            if end.variable == output.name:
                found = end.weight * strength(rule.condition, members, system)
                cuts[end.set] = max(cuts.get(end.set, 0.0), found)
    heights = {one.name: one.membership(grid) for one in output.sets}
    if system.implication == "product":
        return grid, np.max([cut * heights[name] for name, cut in cuts.items()], axis=0)
    extra = []
    for name, cut in cuts.items():
        m = heights[name]
        for i in np.flatnonzero((m[:-1] >= cut) != (m[1:] >= cut)):
            extra.append(grid[i] + (cut - m[i]) / (m[i + 1] - m[i]) * (grid[i + 1] - grid[i]))
    places = np.unique(np.r_[grid, extra])
    return places, np.max([np.minimum(cut, np.interp(places, grid, heights[name])) for name, cut in cuts.items()], 0)


def number_of_union(x: Array, y: Array, method: str, close: float = 1e-12) -> float:
    """The number of a union; points closer than `close` of the range, and maxima closer than 1e-12, count as equal."""
    width = np.diff(x)
    area = width * (y[:-1] + y[1:]) / 2
    if method == "centroid":
        return float((width * (x[:-1] * (2 * y[:-1] + y[1:]) + x[1:] * (y[:-1] + 2 * y[1:])) / 6).sum() / area.sum())
    if method == "bisector":
        sums = np.r_[0, np.cumsum(area)]
        k = int(np.searchsorted(sums[1:], sums[-1] / 2))
        rest, slope = sums[-1] / 2 - sums[k], (y[k + 1] - y[k]) / width[k]
        roots = np.roots([slope / 2, y[k], -rest]) if abs(slope) > 1e-9 else np.array([rest / y[k]])
        inside = [r.real for r in roots if abs(r.imag) < 1e-9 and -1e-9 <= r.real <= width[k] * (1 + 1e-9)]
        return float(x[k] + inside[0])
    at = x[y >= y.max() - 1e-12]
    at = at[np.r_[True, np.diff(at) > close * (x[-1] - x[0])]]
    return float({"mom": np.mean, "som": np.min, "lom": np.max}[method](at))
