"""What imports load: modules are counted, since a test cannot measure time."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CHAPTERS = sorted(
    path.parent.name for path in (ROOT / "algorithms").glob("*/__init__.py") if path.parent.name != "demo"
)
LATER = {
    *("gacompiler", "sympy", "mpmath", "jinja2", "numba", "llvmlite", "cffi", "matplotlib", "plotly", "PIL", "skimage"),
    *("scipy.stats", "scipy.linalg", "scipy.special", "scipy.optimize", "scipy.spatial", "scipy.ndimage", "scipy.fft"),
    *("scipy.sparse", "scipy.interpolate", "scipy.integrate", "scipy.signal", "scipy.cluster", "scipy.io", "rich"),
}
"""Packages that are imported where they are used, and not with a module."""


def loaded(code: str) -> list[str]:
    """The names of all modules after a program ran in a new process."""
    program = f"{code}\nimport json, sys\nprint(json.dumps([*sys.modules]))"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    found: list[str] = json.loads(done.stdout.splitlines()[-1])
    return found


@pytest.mark.slow
def test_algorithms_and_generated_modules_import_what_they_use_when_they_use_it() -> None:
    names = loaded(f"import generated.pga3, {', '.join(f'algorithms.{name}' for name in CHAPTERS)}")
    assert LATER.isdisjoint(names), LATER.intersection(names)
    assert len([name for name in names if name.partition(".")[0] == "scipy"]) < 30


@pytest.mark.parametrize(
    ("code", "most"),
    [
        ("from gacompiler.cli import main; main(['--help'], standalone_mode=False)", 7),
        ("import gacompiler", 4),
    ],
    ids=["gac --help", "gacompiler"],
)
def test_the_compiler_loads_few_of_its_modules_until_one_is_needed(code: str, most: int) -> None:
    names = loaded(code)
    assert {"numpy", "rich", "sympy", "mpmath"}.isdisjoint(names)
    assert len([name for name in names if name.partition(".")[0] == "gacompiler"]) <= most
