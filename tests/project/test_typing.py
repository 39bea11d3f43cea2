"""Mistakes in programs of users that type checkers report, and examples in which they report nothing."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow  # mypy reads numpy and the compiler, which takes half a minute without its cache

ROOT = Path(__file__).parents[2]
MISTAKES = """\
import numpy as np
from algorithms.geometry import distance, project
from gacompiler import Algebra
from gacompiler.objects import CGA3, PGA3, Space
from generated import cga3, pga3

p, q = PGA3.point(1, 2, 3), PGA3.point(0, 0, 1)
m = PGA3.motor(p & q, 0.5, 2)
motor, point = pga3.Motor(m.values), pga3.Point(1, 2, 3)
G = Space(Algebra("G", "a b", [1, -1]))

m.lgo()  # mistake
p + "a"  # mistake
PGA3.pont(1, 2, 3)  # mistake
PGA3.point("x")  # mistake
PGA3.line(p, direktion=[0, 0, 1])  # mistake
PGA3.POITN  # mistake
p.e034  # mistake
p.e032 = 3.0  # mistake
p.distance(1)  # mistake
p.distance(q).foo  # mistake
p & CGA3.point(1, 2, 3)  # mistake
m >> [1, 0, 0]  # mistake
m.log(tolerence=1)  # mistake
CGA3.sphere()  # mistake
G.vector(1, 2).lgo()  # mistake
pga3.move_point(m, "x")  # mistake
pga3.move_point(motor, motor)  # mistake
pga3.move_point(motor, q=point)  # mistake
pga3.move_point(np.ones(8))  # mistake
pga3.move_pont(motor, point)  # mistake
pga3.move_point.cots  # mistake
pga3.Point(1, 2)  # mistake
point[0]  # mistake
point * point  # mistake
PGA3.of(point).lgo()  # mistake
PGA3.of("x")  # mistake
point.e33  # mistake
motor * m  # mistake
cga3.move_point(motor, point)  # mistake
pga3.distance_points(point, point).foo  # mistake
distance("pont", p, "point", q)  # mistake
distance(p, 1)  # mistake
project(p, q).lgo()  # mistake
"""
SETTINGS = """\
[mypy]
python_version = 3.11
allow_redefinition = true
[mypy-cffi.*,clifford.*,elftools.*,jax.*,kingdon.*,matplotlib.*,mirrors.*,mpmath.*,numba.*,plotly.*,scipy.*,sympy.*,torch.*]
follow_imports = skip
ignore_missing_imports = true
[mypy-generated.*,gacompiler.*,algorithms.*]
follow_imports = silent
ignore_errors = true
"""
PAGES = ("README.md", "docs/objects.md", "docs/modules.md", "docs/derivation.md", "docs/tutorials/calling.md",
         "docs/tutorials/deriving.md", "docs/tutorials/generating.md", "docs/tutorials/algorithms.md")  # fmt: skip
"""Pages with programs for users, whose blocks follow each other as in a notebook; those of the README are separate."""


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the mistakes and the examples."""
    folder = tmp_path_factory.mktemp("typing")
    (folder / "mistakes.py").write_text(MISTAKES)
    for page in PAGES:
        blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)
        texts = blocks if page == "README.md" else ["\n".join(blocks)]
        for k, text in enumerate(texts):
            (folder / f"{Path(page).stem.lower()}_{k}.py").write_text(text)
    return folder


@pytest.fixture(scope="module")
def errors_of_mypy(programs: Path) -> dict[str, list[str]]:
    (programs / "mypy.ini").write_text(SETTINGS)
    files = sorted(path.name for path in programs.glob("*.py"))
    command = [sys.executable, "-m", "mypy", "--config-file", "mypy.ini", "--cache-dir", "cache", *files]
    done = subprocess.run(
        command, cwd=programs, env={"MYPYPATH": str(ROOT), "PATH": ""}, capture_output=True, text=True, timeout=600
    )
    assert done.returncode in (0, 1), done.stderr
    found: dict[str, list[str]] = {}
    for name, line in re.findall(r"^(\w+)\.py:(\d+): error", done.stdout, re.MULTILINE):
        found.setdefault(name, []).append(line)
    found["text"] = done.stdout.splitlines()
    return found


def marked() -> set[int]:
    return {k + 1 for k, line in enumerate(MISTAKES.splitlines()) if line.endswith("# mistake")}


def test_mypy_reports_each_mistake_and_nothing_else(errors_of_mypy: dict[str, list[str]]) -> None:
    assert len(marked()) == 33
    assert {int(line) for line in errors_of_mypy["mistakes"]} == marked()


def test_mypy_reports_nothing_in_the_examples(errors_of_mypy: dict[str, list[str]]) -> None:
    shown = [line for line in errors_of_mypy["text"] if ": error" in line and not line.startswith("mistakes")]
    assert not shown


@pytest.mark.parametrize("checker", ["pyright", "basedpyright"])
def test_pyright_reports_each_mistake(checker: str, programs: Path) -> None:
    program = shutil.which(checker)
    if program is None:
        pytest.skip(f"{checker} is not installed")
    settings = {
        "include": ["mistakes.py"], "extraPaths": [str(ROOT)], "typeCheckingMode": "standard",
        "reportUnusedExpression": False,
    }  # fmt: skip
    (programs / "pyrightconfig.json").write_text(json.dumps(settings))
    command = [program, "--outputjson", "--pythonpath", sys.executable, "-p", str(programs)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    errors = [each for each in json.loads(done.stdout)["generalDiagnostics"] if each["severity"] == "error"]
    assert {each["range"]["start"]["line"] + 1 for each in errors} == marked()
