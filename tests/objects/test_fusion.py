"""``gac record``: the operations of a function or statement become one kernel, with the numbers of the program."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from gacompiler.cli import main
from gacompiler.frontend.kernel import Kernel
from gacompiler.generation.spec_files import load_spec
from gacompiler.runtime import compile as compiled

HELPER = """
def moved(m, p):
    return m >> p
"""
PROGRAM = """
import numpy as np
from gacompiler.objects import PGA3
from helper import moved

def arm(shoulder, elbow, upper, lower, p):
    motor = (shoulder * upper).exp() * (elbow * lower).exp()
    return motor >> p, motor

upper = (PGA3.point(0, 0, 0) & PGA3.direction(0, 0, 1)).normalize()
lower = (PGA3.point(1, 0, 0) & PGA3.direction(0, 1, 1)).normalize()
p = PGA3.point(2, 1, 0)
for angle in (0.1, 0.1, 0.7):
    q, m = arm(angle, 0.1, upper, lower, p)
np.savez(__file__ + ".npz", upper=upper.values, lower=lower.values, p=p.values, q=q.values, m=m.values)

def scaled(x, a, b):
    return a * x + b * x.dual()

for k in (1.5, 2.5):
    u = scaled(PGA3.line(PGA3.point(1, 2, 3), PGA3.point(k, 0, 0)), k, k)

def weighted(p, q):
    line = p & q
    return (line.norm() * 2.0 + 1.0) * line

p, q = PGA3.point(1, 2, 3), PGA3.point(0, 1, 0)
x = weighted(p, q)
kept = []

def kept_line(p, q):
    line = p & q
    kept.append(line)
    return line.normalize()

def unit_line(p, q):
    line = p & q
    return line.normalize()

y, z = kept_line(p, q), unit_line(p, q)

class Hand:
    def close(self, m, points):
        return [moved(m, p) for p in points]

m = PGA3.motor([0, 0, 1], 0.5, 1.0, 2.0, 3.0)
x = Hand().close(m, [p, q])

def walk(m, p):
    for k in range(70):
        p = m >> p
    return p

x = walk(m, p)

def reversed_cloud(p):
    return ~(p & p[::-1])

try:
    reversed_cloud(PGA3.point(np.arange(12.0).reshape(4, 3))) + PGA3.point(1, 2)
except Exception:
    pass
"""


def recorded(folder: Path) -> Path:
    script, spec = folder / "program.py", folder / "spec.py"
    script.write_text(PROGRAM)
    (folder / "helper.py").write_text(HELPER)
    result = CliRunner().invoke(main, ["record", str(script), "-o", str(spec)])
    assert result.exit_code == 0, result.output
    return spec


@pytest.fixture(scope="module")
def spec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("fused"))


@pytest.fixture(scope="module")
def kernels(spec: Path) -> dict[str, Kernel]:
    return {kernel.name: kernel for kernel in load_spec(spec).kernels}


def parameters(kernel: Kernel) -> dict[str, str]:
    return {each.name: str(each.layout) for each in kernel.parameters}


def test_a_function_becomes_a_kernel_with_its_values(spec: Path, kernels: dict[str, Kernel]) -> None:
    arm = kernels["arm"]
    # The angles are equal in two calls of three, so they are two arguments.
    assert list(parameters(arm).values()) == ["scalars.SCALAR", "PGA3.UNIT_LINE"] * 2 + ["PGA3.POINT"]
    known = np.load(spec.parent / "program.py.npz")
    motor, place = compiled(arm, "arrays", effort=0)(0.7, known["upper"], 0.1, known["lower"], known["p"])
    np.testing.assert_allclose(place[-3:], known["q"], rtol=0, atol=1e-14)
    np.testing.assert_allclose(motor, known["m"], rtol=0, atol=1e-14)


def test_numbers_equal_in_every_call_are_one_argument(kernels: dict[str, Kernel]) -> None:
    assert list(parameters(kernels["scaled"])) == ["number", "line"]


def test_a_number_that_may_depend_on_a_result_begins_another_kernel(kernels: dict[str, Kernel]) -> None:
    assert parameters(kernels["weighted"]) == {"point": "PGA3.POINT", "point_2": "PGA3.POINT"}
    assert parameters(kernels["weighted_2"]) == {"number": "scalars.SCALAR", "line": "PGA3.LINE"}


def test_values_that_outlive_the_call_are_results(kernels: dict[str, Kernel]) -> None:
    values = np.array([1.0, 2, 3]), np.array([0.0, 1, 0])
    kept, unit = (compiled(kernels[name], "arrays", effort=0)(*values) for name in ("kept_line", "unit_line"))
    assert [np.shape(each) for each in kept] == [(6,), (6,)] and np.shape(unit) == (6,)


def test_comprehensions_and_helpers_of_other_files_belong_to_their_caller(kernels: dict[str, Kernel]) -> None:
    assert list(parameters(kernels["close"]).values()) == ["PGA3.MOTOR", "PGA3.POINT", "PGA3.POINT"]


def test_long_loops_become_kernels_of_their_statements(kernels: dict[str, Kernel]) -> None:
    assert 1 <= sum(name.startswith("walk") for name in kernels) <= 2
    assert all(len(kernel.parameters) == 2 for name, kernel in kernels.items() if name.startswith("walk"))


def test_arrays_and_programs_that_fail(kernels: dict[str, Kernel]) -> None:
    assert list(parameters(kernels["reversed_cloud"]).values()) == ["PGA3.POINT", "PGA3.POINT"]


@pytest.mark.slow
def test_the_spec_does_not_depend_on_the_run(spec: Path, tmp_path: Path) -> None:
    assert recorded(tmp_path).read_text() == spec.read_text()


def test_every_kernel_has_a_name_and_a_summary(kernels: dict[str, Kernel]) -> None:
    assert all(kernel.summary.endswith(".") for kernel in kernels.values())
    known = "upper arm scaled u weighted weighted_2 kept_line unit_line m close walk walk_2 reversed_cloud"
    assert list(kernels) == known.split()
