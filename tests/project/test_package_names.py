"""The packages beside the compiler, under its name: the same modules, also beside a user's own ``algorithms.py``."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

SAME = """
import sys
from gacompiler.algorithms.geometry import distance
import gacompiler.algorithms.evidence, gacompiler.generated.pga3
import algorithms, algorithms.evidence, algorithms.geometry
from generated import pga3
import gacompiler
assert gacompiler.algorithms is algorithms and gacompiler.algorithms.evidence is algorithms.evidence
assert distance is algorithms.geometry.distance and gacompiler.generated.pga3 is pga3
assert algorithms.__name__ == "algorithms" and algorithms.__spec__.name == "algorithms"
assert pga3.__spec__.name == "generated.pga3" and gacompiler.symbolic.__name__ == "gacompiler.symbolic"
modules = {id(module): module for module in list(sys.modules.values())}.values()
files = [module.__file__ for module in modules if getattr(module, "__file__", None)]
own = [file for file in files if "algorithms" in file or "generated" in file]
assert len(own) == len(set(own)), "no file is imported twice"
try:
    import gacompiler.algorithms.nothing
except ModuleNotFoundError as error:
    assert "nothing" in str(error)
else:
    raise AssertionError
"""
SHADOWED = """
import algorithms
assert algorithms.mine == 1
import numpy as np
from gacompiler.algorithms.kinematics import Robot
import gacompiler.algorithms.kinematics as kinematics
assert algorithms.mine == 1 and Robot.__module__.startswith("gacompiler.algorithms.")
assert Robot.named("ur5").pose(np.zeros(6)).shape == (4, 4)
"""


def ran(program: str, folder: Path) -> None:
    (folder / "program.py").write_text(f"import sys\nsys.path.append({str(ROOT)!r})\n{program}")
    done = subprocess.run([sys.executable, "program.py"], cwd=folder, env={"PATH": ""}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_both_names_are_the_same_modules(tmp_path: Path) -> None:
    ran(SAME, tmp_path)


@pytest.mark.slow
def test_a_program_with_algorithms_of_its_own_has_both(tmp_path: Path) -> None:
    """The program's file is found first, before and after the import of the package."""
    (tmp_path / "algorithms.py").write_text("mine = 1\n")
    ran(SHADOWED, tmp_path)
    ran(
        SHADOWED.replace("import algorithms\nassert algorithms.mine == 1\n", "", 1).replace(
            "assert algorithms.mine", "import algorithms\nassert algorithms.mine"
        ),
        tmp_path,
    )
