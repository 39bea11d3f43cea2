"""How many guided grasps succeed, and how long steps and fuzzy controllers take, beside scikit-fuzzy."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.estimation.servoing import (
    GraspSettings,
    GraspStage,
    GraspState,
    VisualStatus,
    grasp_step,
    random_scene,
    simulate_grasp,
)
from algorithms.fuzzy import Conclusion, FuzzySet, FuzzyVariable, Is, Mamdani, Or, Rule, grasp_controller

from . import pages
from .libraries import installed
from .machine import version
from .scikit_fuzzy import peer_simulation

PAGE = Path("docs/visual-grasping-speed.md")
STARTS, BATCH, REPEATS = 1000, 2000, 50
METHODS = ("centroid", "bisector", "mom", "som", "lom")
FEATURES = 24
"""Image points of a step."""


def least_time(call: Callable[[], object], rounds: int) -> float:
    """Return the least CPU time of some calls, in seconds."""
    spent = []
    for _ in range(rounds):
        start = time.process_time()
        call()
        spent.append(time.process_time() - start)
    return min(spent)


def grasps(starts: int) -> list[str]:
    """Return table rows: successes, worst errors and numbers of images for random starts."""
    rows = []
    for noise, distance, angle in ((0.0, 1e-6, 1e-6), (0.3, 0.5e-3, np.radians(0.1))):
        found, images = [], []
        for seed in range(starts):
            rng = np.random.default_rng(seed)
            run = simulate_grasp(random_scene(rng), GraspSettings(noise=noise), rng)
            away, turned = run.scenes[-1].deviation()
            found.append((run.status is VisualStatus.OK and away <= distance and turned <= angle, away, turned))
            images.append(len(run.steps))
        good, away, turned = np.array(found).T
        limits = "1e-6 m, 1e-6" if noise == 0 else "0.5 mm, 0.1°"
        rows.append(
            f"| {noise} px | {limits} | {good.sum():.0f} of {starts} | {1e3 * np.median(away):.1g} mm, "
            f"{np.degrees(np.median(turned)):.1g}° | {1e3 * away.max():.1g} mm, {np.degrees(turned.max()):.1g}° "
            f"| {np.median(images):.0f} |"
        )
    return rows


def steps(rounds: int) -> list[str]:
    """Return table rows: microseconds of a step until the hand holds, and per image point."""
    run = simulate_grasp(random_scene(np.random.default_rng(0)), GraspSettings())
    states = [GraspState(), *(step.state for step in run.steps[:-1])]
    given = [(s, c.images()) for s, c in zip(states, run.scenes, strict=False) if s.stage < GraspStage.HOLDING]
    spent = 1e6 * least_time(lambda: [grasp_step(s, x) for s, x in given * 20], rounds) / (20 * len(given))
    return [f"| `grasp_step` | {spent:.0f} µs | {spent / FEATURES:.2f} µs |"]


def tipping(method: str) -> Mamdani:
    """Return the rule base of the first example of scikit-fuzzy, with triangles on 101 places."""

    def variable(name: str, high: float, middle: float, names: tuple[str, str, str]) -> FuzzyVariable:
        corners = (0.0, 0.0, middle), (0.0, middle, high), (middle, high, high)
        sets = tuple(FuzzySet(a, "triangle", b) for a, b in zip(names, corners, strict=True))
        return FuzzyVariable(name, 0, high, 101, sets)

    levels = "poor", "average", "good"
    inputs = variable("quality", 10, 5, levels), variable("service", 10, 5, levels)
    output = variable("tip", 25, 13, ("low", "medium", "high"))

    def concludes(name: str) -> tuple[Conclusion, ...]:
        return (Conclusion("tip", name),)

    rules = (
        Rule(Or(Is("quality", "poor"), Is("service", "poor")), concludes("low")),
        Rule(Is("service", "average"), concludes("medium")),
        Rule(Or(Is("service", "good"), Is("quality", "good")), concludes("high")),
    )
    return Mamdani(inputs, (output,), rules, method)


def _by_peer(system: Mamdani, x: np.ndarray[Any, Any]) -> tuple[float, float]:
    """Return the seconds per element of scikit-fuzzy for an array, and one element at a time."""
    names = [one.name for one in system.inputs]

    def run(simulation: Any, values: Any) -> None:
        for name, value in zip(names, values, strict=True):
            simulation.input[name] = value
        simulation.compute()

    arrays, single = (peer_simulation(system)[0] for _ in range(2))
    batch = least_time(lambda: run(arrays, x.T), 3) / len(x)
    some = x[:200]
    return batch, least_time(lambda: [run(single, row.tolist()) for row in some], 1) / len(some)


def fuzzy(rounds: int, count: int) -> list[str]:
    """Return table rows: microseconds per element in batches, beside scikit-fuzzy with arrays and single inputs."""
    rows = []
    systems = [("tip", tipping(method)) for method in METHODS]
    systems += [("grasp", replace(grasp_controller(), defuzzify=(method,) * 3)) for method in METHODS]
    for name, system in systems:
        low, high = np.array([[one.low, one.high] for one in system.inputs]).T
        x = np.random.default_rng(0).uniform(low, high, (count, len(low)))
        many = np.tile(x, (REPEATS, 1))
        own = least_time(lambda s=system, m=many: s.evaluate(m), rounds) / len(many)  # type: ignore[misc]
        texts = ["", ""]
        if installed("skfuzzy"):
            texts = [f"{1e6 * spent:.0f} ({spent / own:.0f} x)" for spent in _by_peer(system, x)]
        rows.append(f"| {name}, {system.defuzzify[0]} | {1e6 * own:.2f} | {' | '.join(texts)} |")
    return rows


def page(grasp_rows: list[str], step_rows: list[str], fuzzy_rows: list[str]) -> str:
    """All figures as Markdown."""
    lines = [
        "# Success and speed of guided and fuzzy grasping",
        "",
        f"Written by `python -m benchmarks visual_grasping`, beside scikit-fuzzy {version('scikit-fuzzy')}. Times are",
        "processor seconds of one thread.",
        "",
        "## Guided grasps",
        "",
        "Random starts up to 15 cm and 34° away, random boxes, and two cameras with random focal lengths, principal",
        "points and places, which the method does not know. A start succeeds if the status is OK and the hand ends",
        "within the limits of its goal.",
        "",
        "| noise | limits | successes | median error | worst error | median number of images |",
        "| --- | --- | --- | --- | --- | ---: |",
        *grasp_rows,
        "",
        "| | time per step | per image point |",
        "| --- | ---: | ---: |",
        *step_rows,
        "",
        "## Mamdani inference",
        "",
        "Microseconds per element of a batch of 100,000, and of scikit-fuzzy for an array of 2,000 and for single",
        "inputs, with the ratio. `tip` has two inputs, three rules and one output of 101 places; `grasp` is the",
        "controller of section 20.7 with three inputs, eleven rules and three outputs of 201 or 251 places.",
        "",
        "| rule base, method | µs | scikit-fuzzy, array | scikit-fuzzy, single |",
        "| --- | ---: | ---: | ---: |",
        *fuzzy_rows,
    ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("visual_grasping", __doc__, PAGE).parse_args(arguments)
    rounds = 1 if options.quick else 5
    text = page(grasps(5 if options.quick else STARTS), steps(rounds), fuzzy(rounds, 50 if options.quick else BATCH))
    return pages.publish("visual_grasping", options.out, text, "3 tables")


if __name__ == "__main__":
    sys.exit(main())
