"""``gac record`` writes a spec of the operations of a program, and the generated kernels give the same numbers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from gacompiler.cli import main
from gacompiler.generation.spec_files import load_spec
from gacompiler.runtime import load_module

PROGRAM = '''
import sys
import numpy as np
from gacompiler import Algebra
from gacompiler.objects import CGA3, PGA3, QUATERNIONS, Space

data = {}
def keep(name, inputs, output):
    for k, x in enumerate(inputs):
        data[f"{name}.{k}"] = np.asarray(x, float)
    data[f"{name}.out"] = np.asarray(output, float)
    return output

p = PGA3.point(np.arange(12.0).reshape(4, 3))
axis = PGA3.line(PGA3.point(1, 0, 0), PGA3.direction(0, 0, 1)).normalize()
m = keep("motor_unit_line_scalar_scalar", (axis, 0.5, 2.0), PGA3.motor(axis, 0.5, 2.0))
q = keep("sandwich_motor_point", (m, p), m >> p)
for _ in range(3):
    keep("regressive_product_point_point", (p, q), p & q)
keep("norm_line", (p & q,), (p & q).norm())
keep("sandwich_motor_point_2", (CGA3.motor([0, 0, 1], 1.0, 1, 2, 3), CGA3.point(1, 2, 3)),
     CGA3.motor([0, 0, 1], 1.0, 1, 2, 3) >> CGA3.point(1, 2, 3))
G = Space(Algebra("G(2,1)", "a b c", [[1, 0, 0], [0, 2, 1], [0, 1, "-1/2"]]))
u, v = G.vector(1, 2, 3), G.vector(3, 1, 4)
keep("geometric_product_a_b_c_a_b_c", (u, v), u * v)
keep("grade_2_even", (u * v,), (u * v).grade(2))
i = QUATERNIONS.imaginary(1, 2, 3)
keep("rotate_unit_quaternion_vector", (QUATERNIONS.rotation([0, 0, 1], 1.0), i),
     QUATERNIONS.rotate(QUATERNIONS.rotation([0, 0, 1], 1.0), i))
if len(sys.argv) > 1:
    np.savez(sys.argv[1], **data)
'''  # fmt: skip


def gac(*arguments: Any) -> Result:
    return CliRunner().invoke(main, [str(each) for each in arguments])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("record")
    (folder / "arm.py").write_text(PROGRAM)
    result = gac(
        "record", "--separate", folder / "arm.py", "-o", folder / "arm_kernels.py", "--", folder / "numbers.npz"
    )
    assert result.exit_code == 0, result.output
    assert "kernels; run `gac generate" in result.output
    return folder / "arm_kernels.py", dict(np.load(folder / "numbers.npz"))


@pytest.mark.slow
def test_generated_kernels_reproduce_the_program(recorded: tuple[Path, dict[str, Any]]) -> None:
    spec, numbers = recorded
    names = [kernel.name for kernel in load_spec(spec).kernels]
    assert names.count("regressive_product_point_point") == 1 and len(set(names)) == len(names)
    result = gac("generate", spec, "-o", spec.parent / "out", "--no-build", "--effort", "0")
    assert result.exit_code == 0, result.output
    module = load_module(spec.parent / "out" / f"{spec.stem}.py", "_recorded", "arrays")
    seen = 0
    for name in names:
        if f"{name}.out" in numbers:
            inputs = [numbers[f"{name}.{k}"] for k in range(10) if f"{name}.{k}" in numbers]
            assert np.allclose(getattr(module, name)(*inputs), numbers[f"{name}.out"], rtol=1e-13, atol=1e-13), name
            seen += 1
    assert seen == len([key for key in numbers if key.endswith(".out")]) == 8


def test_the_spec_has_exactly_the_kernels_that_were_used(recorded: tuple[Path, dict[str, Any]]) -> None:
    kernels = load_spec(recorded[0]).kernels
    assert all(kernel.summary.endswith(".") for kernel in kernels)
    names = (
        "regressive_product_point_direction normalize_line outer_product_unit_line_unit_line normalize_unit_line "
        "motor_unit_line_scalar_scalar sandwich_motor_point regressive_product_point_point norm_line "
        "rotor_e1_e2_e3_scalar translator_e1_e2_e3 geometric_product_translator_rotor sandwich_motor_point_2 "
        "geometric_product_a_b_c_a_b_c grade_2_even rotation_vector_scalar rotate_unit_quaternion_vector"
    )
    assert " ".join(k.name for k in kernels) == names
    layouts = {k.name: [str(p.layout) for p in k.parameters] for k in kernels}
    assert layouts["motor_unit_line_scalar_scalar"] == ["PGA3.UNIT_LINE", "scalars.SCALAR", "scalars.SCALAR"]
    assert layouts["sandwich_motor_point_2"] == ["CGA3.MOTOR", "CGA3.POINT"] and layouts["norm_line"] == ["PGA3.LINE"]


def test_form_of_the_text(recorded: tuple[Path, dict[str, Any]]) -> None:
    spec, _ = recorded
    text = spec.read_text()
    assert text.startswith(
        '"""Operations used by arm.py."""\n\nimport gacompiler as ga\nfrom gacompiler import SCALAR, Algebra, kernel\n'
    )
    assert not re.search(r"/tmp|[^\S\n]\n", text) and max(map(len, text.splitlines())) <= 120
    assert not list(spec.parent.glob(".*")), "no partial file is left"


@pytest.mark.parametrize(
    ("program", "message"),
    [
        (None, "no such file"),
        ("x = 1\n", "used no kernel"),
        ("from gacompiler.objects import PGA3\nPGA3.point(1, 2)\n", "program.py:2: LayoutError: .*expected 3"),
        pytest.param("def f():\n    return 1 / 0\nf()\n", r"program.py:2: ZeroDivisionError", marks=pytest.mark.slow),
        pytest.param("def f(:\n", "SyntaxError", marks=pytest.mark.slow),
        pytest.param("import sys\nsys.exit(3)\n", "status 3", marks=pytest.mark.slow),
        pytest.param("import os\nos._exit(4)\n", "status 4", marks=pytest.mark.slow),
    ],
)
def test_error_messages(program: str | None, message: str, tmp_path: Path) -> None:
    script, spec = tmp_path / "program.py", tmp_path / "spec.py"
    if program is not None:
        script.write_text(program)
    result = gac("record", script, "-o", spec)
    assert result.exit_code == 1 and re.search(message, result.output.replace("\n", " ")), result.output
    assert not spec.exists()


def test_a_spec_is_not_overwritten(recorded: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    spec, _ = recorded
    before = spec.read_text()
    result = gac("record", spec.parent / "arm.py", "-o", spec)
    assert result.exit_code == 1 and "already exists" in result.output and spec.read_text() == before
    assert gac("record", spec.parent / "arm.py", "-o", tmp_path / "no-name.py").exit_code == 1
    assert "gac record arm.py" in gac("record", "--help").output
