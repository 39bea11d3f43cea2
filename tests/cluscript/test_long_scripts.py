"""Scripts of realistic size: a conformal arm of five joints, and the inverse kinematics of a UR5.

The values of compiled scripts are compared with those of the algebra layer, which evaluates statement by statement.
Independent truth: rotations by truncated exponentials are close to rotations by matrices, and forward kinematics undoes
the inverse.
"""

from __future__ import annotations

import math
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

import gacompiler
from gacompiler import read_cluscript
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.scripts import CallableScript

FOLDER = Path(__file__).parent / "scripts" / "long"
TARGET = {"px": 0.4, "py": 0.2, "pz": 0.3, "ax": 0.1, "ay": math.sqrt(1 - 0.01 - 0.16), "az": 0.4}
WORK = {"arm5": 40_000, "ur5": 7_000}
"""Upper bounds for the number of operations of all candidates; 254 s of work preceded the first result for `arm5`."""


def script(name: str) -> CallableScript:
    return read_cluscript((FOLDER / f"{name}.clu").read_text(), "cga", name, f"{name}.clu")


def compared(one: CallableScript, values: dict[str, float]) -> float:
    """Return the largest error of a compiled script in units of its largest coefficient.

    No cheaper forms are searched, since each is proved to be equal.
    """
    run = gacompiler.compile(one, "arrays", effort=0)
    found, expected, worst = run(**values), one.multivectors(**values), 0.0
    for name in one.outputs:
        array, exact = np.asarray(getattr(found, name)), getattr(expected, name)
        layout = run.layouts[name]
        blades = layout.blades if array.ndim else ["1"]
        assert set(exact.terms) <= {exact.algebra.blade(each)[1] for each in blades} or all(
            abs(value) < 1e-12
            for blade, value in exact.terms.items()
            if blade not in {exact.algebra.blade(each)[1] for each in blades}
        )
        values_of = np.array([float(exact[each]) for each in blades])
        worst = max(worst, float(np.max(np.abs(array.ravel() - values_of)) / (1 + np.max(np.abs(values_of)))))
    return worst


def test_an_arm_of_five_joints() -> None:
    arm, random = script("arm5"), Random(0)
    assert arm.inputs == ("a1", "a2", "a3", "a4", "a5")
    assert arm.outputs == (*(f"{letter}{k}" for k in range(1, 6) for letter in "LR"), "G")
    values = {name: random.uniform(-1, 1) for name in arm.inputs}
    assert compared(arm, values) < 1e-13


def test_small_angles_move_the_gripper_as_matrices_do() -> None:
    """The axes of the script, as screws in matrices; terms of fifth order are neglected by the script."""
    arm, angles = script("arm5"), [0.02, -0.03, 0.01, 0.04, -0.02]
    found = arm.multivectors(**{f"a{k}": angle for k, angle in enumerate(angles, start=1)}).G
    position = np.array([0.9, 0.0, 0.3])
    origins = [(0, 0, 0), (0, 0, 0.3), (0.4, 0, 0.3), (0.7, 0, 0.3), (0.8, 0, 0.3)]
    axes = [(0, 0, 1), (0, 1, 0), (0, 1, 0), (0, 1, 0), (1, 0, 0)]
    first_order = sum(
        angle * np.cross(axis, position - np.array(origin))
        for angle, axis, origin in zip(angles, axes, origins, strict=True)
    )
    moved = np.array([float(found[each]) / float(found["e0"]) for each in ("e1", "e2", "e3")]) - position
    assert min(np.abs(moved - first_order).max(), np.abs(moved + first_order).max()) < 4e-3
    assert np.abs(first_order).max() > 1e-2


@pytest.mark.slow
def test_the_inverse_kinematics_of_a_ur5() -> None:
    assert compared(script("ur5"), TARGET) < 1e-13


def test_forward_kinematics_undoes_the_inverse() -> None:
    """The elbow and the joint before the wrist, from the angles and lengths, in the plane of the arm."""
    one = script("ur5")
    found = one.multivectors(**TARGET)
    angle = {name: float(getattr(found, name).scalar) for name in ("theta1", "theta2", "theta3", "theta4", "theta5")}
    normal = np.array([-math.sin(angle["theta1"]), math.cos(angle["theta1"]), 0.0])
    wrist = np.array([TARGET[f"p{axis}"] - 0.0825 * TARGET[f"a{axis}"] for axis in "xyz"])
    assert abs(abs(normal @ wrist) - 0.1093) < 1e-12 or abs(abs(np.cross(normal, [0, 0, 1]) @ wrist) - 0.1093) < 1e-12
    both = angle["theta2"] + angle["theta3"]
    r = 0.425 * math.cos(angle["theta2"]) + 0.392 * math.cos(both)
    z = 0.0892 + 0.425 * math.sin(angle["theta2"]) + 0.392 * math.sin(both)
    assert abs(z - (wrist[2] + 0.09475)) < 1e-12
    assert abs(math.hypot(r, 0.1093) - math.hypot(wrist[0], wrist[1])) < 1e-12
    assert abs(angle["theta2"] + angle["theta3"] + angle["theta4"]) < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("name", ["arm5", "ur5"])
def test_the_work_on_a_script_is_bounded(name: str) -> None:
    record = compile_kernel(script(name))
    totals = [candidate.cost.total for candidate in record.candidates]
    assert record.cost.total < 0.8 * totals[0]
    assert sum(totals) < WORK[name]


def long_script(seed: int, n: int) -> str:
    """Return a script of `n` statements, each of which uses some of the preceding ones."""
    random = Random(seed)
    lines: list[str] = []

    def one() -> str:
        return f"v{random.randrange(max(0, len(lines) - 12), len(lines))}"

    shapes: list[Any] = [
        lambda: f"{one()} + 2*{one()}", lambda: f"{one()}^{one()}", lambda: f"*({one()})", lambda: f"{one()}.{one()}",
        lambda: f"{one()}*{one()}", lambda: f"{one()}*{one()}*~{one()}",
    ]  # fmt: skip
    for k in range(n):
        point = f"createPoint(x{random.randrange(6)}, x{random.randrange(6)}, x{random.randrange(6)})"
        value = point if k < 4 or random.random() < 0.3 else random.choice(shapes)()
        lines.append(f"v{k} = {value};")
    return "\n".join([*lines, *(f"?v{k};" for k in range(n - 4, n))])


@pytest.mark.slow
def test_a_script_of_200_statements() -> None:
    """Every stage does a bounded amount of work, and says what it leaves out."""
    one = read_cluscript(long_script(1, 200), "cga", "long_script")
    record = compile_kernel(one)
    assert record.cost.total <= record.candidates[0].cost.total
    assert sum(len(candidate.program.lines) for candidate in record.candidates) < 400_000


def test_an_arm_with_roots_whose_values_are_large() -> None:
    """Axes of other lengths than 1 give values above 1e1600 at ordinary points, which decide nothing."""
    arm, angles = script("roots"), dict(zip(("w", "v", "x0", "x1"), (1e-3, -2e-3, 3e-4, 1e-4), strict=True))
    assert set(arm.inputs) == set(angles)
    assert compared(arm, angles) < 1e-13
