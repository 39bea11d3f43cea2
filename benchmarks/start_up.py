"""Measure imports, the help of the command ``gac``, and first calls of algorithms, each in a new process."""

from __future__ import annotations

import json
import platform
import statistics
import subprocess
import sys
import time
from pathlib import Path

from . import pages
from .machine import version
from .markdown import paragraph, table

PAGE = Path("docs/start-up.md")

IMPORTS = {
    "Python alone": "",
    "numpy": "import numpy",
    "generated.pga3": "import generated.pga3",
    "generated.cga3": "import generated.cga3",
    "algorithms.kinematics": "import algorithms.kinematics",
    "algorithms.vision": "import algorithms.vision",
    "algorithms.mapping": "import algorithms.mapping",
    "algorithms.grasping": "import algorithms.grasping",
    "gacompiler.objects": "import gacompiler.objects",
    "names of gacompiler": "from gacompiler import kernel",
    "gac --help": "from gacompiler.cli import main; main(['--help'], standalone_mode=False)",
}
"""Programs whose processes are measured."""

_CLOCK = "import time; print(time.process_time())"
_FIRST_CALLS = "from benchmarks.start_up import first_calls; first_calls()"


def main(arguments: list[str]) -> int:
    """Measure, and write the page. Return the exit status."""
    options = pages.options("start_up", __doc__, PAGE).parse_args(arguments)
    rounds = 1 if options.quick else 7
    imports = {name: statistics.median(_import(code) for _ in range(rounds)) for name, code in IMPORTS.items()}
    runs = [json.loads(_output(_FIRST_CALLS)) for _ in range(rounds)]
    calls = {name: [statistics.median(run[name][k] for run in runs) for k in (0, 1)] for name in runs[0]}
    return pages.publish("start_up", options.out, page(imports, calls, rounds), "2 tables")


def page(imports: dict[str, float], calls: dict[str, list[float]], rounds: int) -> str:
    """Return the text of the page."""
    return "\n".join(
        [
            "# Start-up",
            "",
            paragraph(
                f"`make bench PAGE=start-up` writes this page; Python {platform.python_version()}, numpy",
                f"{version('numpy')}. Each number is the median of {rounds} new processes, whose files are in memory,",
                "with bytecode and the C libraries built.",
            ),
            "",
            "## Imports",
            "",
            "CPU milliseconds of the whole process.",
            "",
            table(("program", "ms"), [(name, f"{1e3 * value:.0f}") for name, value in imports.items()]),
            "## First calls",
            "",
            paragraph(
                "CPU milliseconds of the first call in a process, which opens libraries and imports parts of scipy,",
                "and of later calls.",
            ),
            "",
            table(
                ("call", "first", "later"),
                [(f"`{name}`", *(f"{1e3 * value:.1f}" for value in pair)) for name, pair in calls.items()],
            ),
        ]
    )


def first_calls() -> None:
    """Print the CPU seconds of the first and of a later call of each algorithm."""
    import numpy as np

    from algorithms.geometry import nearest_on_circles
    from algorithms.vision import LandmarkMap, hand_eye, hand_eye_from_poses
    from algorithms.wavelets import local_phase, optical_flow
    from generated import cga3, pga3

    rng = np.random.default_rng(2)
    hands, place, world = (pga3.motor_exponential(rng.normal(size=shape)) for shape in ((9, 6), (6,), (6,)))
    eyes = pga3.motor_product(pga3.motor_product(pga3.motor_inverse(world), hands), place)
    motions = [pga3.motor_product(pga3.motor_inverse(p[:-1]), p[1:]) for p in (hands, eyes)]
    circles = cga3.circle_from_centre(rng.normal(size=(2, 3)), rng.normal(size=(2, 3)), 1.0)
    views = np.concatenate([rng.normal(size=(1, 10, 2)), np.full((1, 10, 1), 4.0)], -1)
    landmarks = LandmarkMap.learn([views])
    image = rng.normal(size=(64, 64))
    calls = {
        "hand_eye_from_poses": lambda: hand_eye_from_poses(hands, eyes),
        "hand_eye": lambda: hand_eye(*motions),
        "nearest_on_circles": lambda: nearest_on_circles(circles[0], circles[1]),
        "LandmarkMap.recognize": lambda: landmarks.recognize(views[0], 1e-3),
        "optical_flow": lambda: optical_flow(image, image),
        "local_phase": lambda: local_phase(image, (0.1, 0.2)),
    }
    found = {}
    for name, call in calls.items():
        spent = []
        for _ in range(3):
            start = time.process_time()
            call()
            spent.append(time.process_time() - start)
        found[name] = spent[0], min(spent[1:])
    print(json.dumps(found))


def _import(code: str) -> float:
    return float(_output(f"{code}\n{_CLOCK}").splitlines()[-1])


def _output(program: str) -> str:
    command = [sys.executable, "-c", program]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout
