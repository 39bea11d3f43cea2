"""``gac record``: the operations of a function or statement become one kernel, with the numbers of the program."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from gacompiler.cli import main
from gacompiler.frontend.kernel import Kernel
from gacompiler.generation.spec_files import load_spec
from gacompiler.runtime import compile

HEAD = "import numpy as np\nfrom gacompiler.objects import PGA3\n"


def recorded(program: str, folder: Path, *options: str) -> dict[str, Kernel]:
    script, spec = folder / "program.py", folder / "spec.py"
    script.write_text(HEAD + program)
    result = CliRunner().invoke(main, ["record", str(script), "-o", str(spec), *options])
    assert result.exit_code == 0, result.output
    return {kernel.name: kernel for kernel in load_spec(spec).kernels}


def parameters(kernel: Kernel) -> dict[str, str]:
    return {each.name: str(each.layout) for each in kernel.parameters}


ARM = """
def arm(shoulder, elbow, upper, lower, p):
    motor = (shoulder * upper).exp() * (elbow * lower).exp()
    return motor >> p, motor

upper = (PGA3.point(0, 0, 0) & PGA3.direction(0, 0, 1)).normalize()
lower = (PGA3.point(1, 0, 0) & PGA3.direction(0, 1, 1)).normalize()
p = PGA3.point(2, 1, 0)
for angle in (0.1, 0.1, 0.7):
    q, m = arm(angle, 0.1, upper, lower, p)
"""


def test_a_function_becomes_a_kernel_with_its_values(tmp_path: Path) -> None:
    save = "np.savez('{}', upper=upper.values, lower=lower.values, p=p.values, q=q.values, m=m.values)\n"
    kernels = recorded(ARM + save.format(tmp_path / "numbers.npz"), tmp_path)
    assert set(kernels) == {"upper", "arm"}
    arm = kernels["arm"]
    # The angles are equal in two calls of three, so they are two arguments.
    assert list(parameters(arm).values()) == ["scalars.SCALAR", "PGA3.UNIT_LINE"] * 2 + ["PGA3.POINT"]
    known = np.load(tmp_path / "numbers.npz")
    motor, place = compile(arm)(0.7, known["upper"], 0.1, known["lower"], known["p"])
    np.testing.assert_allclose(place[-3:], known["q"], rtol=0, atol=1e-14)
    np.testing.assert_allclose(motor, known["m"], rtol=0, atol=1e-14)


def test_numbers_equal_in_every_call_are_one_argument(tmp_path: Path) -> None:
    kernels = recorded(
        "def scaled(x, a, b):\n    return a * x + b * x.dual()\n"
        "for k in (1.5, 2.5):\n    u = scaled(PGA3.point(1, 2, 3) & PGA3.point(k, 0, 0), k, k)\n",
        tmp_path,
    )
    assert list(parameters(kernels["scaled"])) == ["number", "line"]


def test_a_number_that_may_depend_on_a_result_begins_another_kernel(tmp_path: Path) -> None:
    kernels = recorded(
        "def f(p, q):\n    line = p & q\n    return (line.norm() * 2.0 + 1.0) * line\n"
        "x = f(PGA3.point(1, 2, 3), PGA3.point(0, 1, 0))\n",
        tmp_path,
    )
    assert parameters(kernels["f"]) == {"point": "PGA3.POINT", "point_2": "PGA3.POINT"}
    assert parameters(kernels["f_2"]) == {"number": "scalars.SCALAR", "line": "PGA3.LINE"}


def test_values_that_outlive_the_call_are_results(tmp_path: Path) -> None:
    kernels = recorded(
        "kept = []\n"
        "def f(p, q):\n    line = p & q\n    kept.append(line)\n    return line.normalize()\n"
        "def g(p, q):\n    line = p & q\n    return line.normalize()\n"
        "x = f(PGA3.point(1, 2, 3), PGA3.point(0, 1, 0))\n"
        "y = g(PGA3.point(1, 2, 3), PGA3.point(0, 1, 0))\n",
        tmp_path,
    )
    values = np.array([1.0, 2, 3]), np.array([0.0, 1, 0])
    assert [np.shape(each) for each in compile(kernels["f"])(*values)] == [(6,), (6,)]
    assert np.shape(compile(kernels["g"])(*values)) == (6,)


def test_comprehensions_and_helpers_of_other_files_belong_to_their_caller(tmp_path: Path) -> None:
    (tmp_path / "helper.py").write_text("def moved(m, p):\n    return m >> p\n")
    kernels = recorded(
        "from helper import moved\n"
        "class Hand:\n"
        "    def close(self, m, points):\n        return [moved(m, p) for p in points]\n"
        "m = PGA3.motor([0, 0, 1], 0.5, 1.0, 2.0, 3.0)\n"
        "x = Hand().close(m, [PGA3.point(1, 2, 3), PGA3.point(3, 2, 1)])\n",
        tmp_path,
    )
    assert list(parameters(kernels["close"]).values()) == ["PGA3.MOTOR", "PGA3.POINT", "PGA3.POINT"]


def test_long_loops_become_kernels_of_their_statements(tmp_path: Path) -> None:
    kernels = recorded(
        "def walk(m, p):\n    for k in range(100):\n        p = m >> p\n    return p\n"
        "x = walk(PGA3.motor([0, 0, 1], 0.5, 1.0, 2.0, 3.0), PGA3.point(1, 2, 3))\n",
        tmp_path,
    )
    assert sum(name.startswith("walk") for name in kernels) <= 2
    assert all(len(kernel.parameters) == 2 for name, kernel in kernels.items() if name.startswith("walk"))


def test_arrays_and_programs_that_fail(tmp_path: Path) -> None:
    kernels = recorded(
        "cloud = PGA3.point(np.arange(12.0).reshape(4, 3))\n"
        "def f(p):\n    return (p & p[::-1]).norm()\n"
        "try:\n    f(cloud) + PGA3.point(1, 2)\nexcept Exception:\n    pass\n",
        tmp_path,
    )
    assert list(parameters(kernels["f"]).values()) == ["PGA3.POINT", "PGA3.POINT"]


def test_the_spec_does_not_depend_on_the_run(tmp_path: Path) -> None:
    texts = []
    for k in range(2):
        folder = tmp_path / str(k)
        folder.mkdir()
        recorded(ARM, folder)
        texts.append((folder / "spec.py").read_text())
    assert texts[0] == texts[1]


@pytest.mark.parametrize("options", [(), ("--separate",)])
def test_every_kernel_has_a_name_and_a_summary(options: tuple[Any, ...], tmp_path: Path) -> None:
    kernels = recorded(ARM, tmp_path, *options)
    assert all(kernel.summary.endswith(".") for kernel in kernels.values())
    assert ("sandwich_unit_even_point" in kernels or "sandwich_motor_point" in kernels) == bool(options)
