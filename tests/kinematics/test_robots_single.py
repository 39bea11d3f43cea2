"""Calls of methods of robots: one configuration and many, types of numbers, errors, threads, first calls."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.kinematics import (
    Body,
    DescriptionError,
    JointCountError,
    NotFiniteError,
    Robot,
    UnknownJointTypeError,
)
from gacompiler.gac_runtime.build import STEM
from generated import robots
from tests.support.all_cases import all_cases

ROOT = Path(__file__).resolve().parents[2]

METHODS = {
    "forward": 1,
    "forward_all": 1,
    "pose": 1,
    "jacobian": 1,
    "jacobian_rate": 2,
    "twists_of_joints": 1,
    "velocity": 2,
    "acceleration": 3,
    "inverse_dynamics": 3,
    "gravity": 1,
    "coriolis": 2,
    "coriolis_matrix": 2,
    "mass_matrix": 1,
    "inverse_mass_matrix": 1,
    "forward_dynamics": 3,
    "inverse_dynamics_derivatives": 3,
    "forward_dynamics_derivatives": 3,
    "torque_regressor": 3,
    "centre_of_mass": 1,
    "centroidal_momentum_matrix": 1,
    "centroidal_momentum": 2,
    "kinetic_energy": 2,
    "potential_energy": 1,
}
"""The number of positions, velocities and accelerations that each method takes."""
NAMES = ("q", "qd", "qdd")


def tree() -> Robot:
    """Two branches, a prismatic joint and rotors: the end effector is on the second branch."""
    rng = np.random.default_rng(4)
    rows = [
        {"d": 0.3, "a": 0.2, "alpha": 0.7},
        {"a": 0.4, "alpha": -1.1, "kind": "prismatic"},
        {"a": 0.3, "d": 0.1},
    ] * 2
    bodies = []
    for _ in rows:
        a = rng.normal(size=(3, 3))
        t = np.trace(a @ a.T) * np.eye(3) - a @ a.T
        bodies.append(Body(2.0, tuple(rng.normal(size=3)), tuple(t[np.triu_indices(3)]), 0.3))
    arm = Robot.from_dh(rows, bodies=bodies)
    fields = ("name", "kinds", "axes", "home", "bodies", "armature")
    return Robot(**{name: getattr(arm, name) for name in fields}, parents=(-1, 0, 1, 0, 3, 4), tip=4)


def coupled() -> Robot:
    """The last joint mimics the previous one."""
    coupling = np.eye(6, 7)[:, [0, 1, 2, 3, 4, 6]]
    coupling[5] = 0, 0, 0, 0, -0.5, 0.2
    return replace(tree(), name="coupled", coupling=coupling, limits=np.empty(0))


ROBOTS = {"tree": tree(), "coupled": coupled(), "ur5": Robot.named("ur5"), "puma560": Robot.named("puma560")}


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Robot:
    return ROBOTS[request.param]


def states(robot: Robot, *lead: int) -> np.ndarray:
    """Positions, velocities and accelerations."""
    return np.random.default_rng(1).uniform(-1.5, 1.5, (3, *lead, robot.n_joints))


def parts(found: Any) -> tuple[Any, ...]:
    return found if isinstance(found, tuple) else (found,)


def error(found: Any, expected: Any) -> float:
    """The largest difference, relative to the largest entry."""
    pairs = zip(parts(found), parts(expected), strict=True)
    return max(float(np.abs(a - b).max() / max(1.0, np.abs(b).max())) for a, b in pairs)


@all_cases("name", METHODS)
def test_one_configuration_equals_its_element_of_a_batch(robot: Robot, name: str) -> None:
    method, rows = getattr(robot, name), states(robot, 2, 3)[: METHODS[name]]
    batch, one = method(*rows), method(*rows[:, 1, 2])
    for mine, expected in zip(parts(one), parts(batch), strict=True):
        assert np.shape(mine) == expected.shape[2:] and expected.shape[:2] == (2, 3)
        assert type(mine) is (np.ndarray if np.ndim(mine) else np.float64)
    assert error(one, tuple(part[1, 2] for part in parts(batch))) < 1e-13
    # arguments broadcast
    if len(rows) > 1:
        mixed = method(rows[0], *rows[1:, 1, 2])
        assert error(tuple(part[1, 2] for part in parts(mixed)), one) < 1e-13
    for part in parts(method(*rows[:, :0])):
        assert part.shape[:2] == (0, 3)


@all_cases("name", METHODS)
def test_kinds_of_numbers(robot: Robot, name: str) -> None:
    method, rows = getattr(robot, name), states(robot, 4)[: METHODS[name]]
    expected = method(*rows)
    still = rows.copy()
    still.flags.writeable = False
    for other in (
        rows.tolist(),
        still,
        np.repeat(rows, 2, axis=-1)[..., ::2],
        np.asfortranarray(rows),
        rows.astype(">f8"),
        rows[:, ::-1].copy()[:, ::-1],
    ):
        assert error(method(*other), expected) < 1e-13
    for given in (rows, rows[:, 0]):
        for part, double in zip(parts(method(*given.astype(np.float32))), parts(method(*given)), strict=True):
            assert part.dtype == np.float32 and type(part) is (np.ndarray if np.ndim(double) else np.float32)
            assert np.abs(part - double).max() < 2e-4 * max(1.0, np.abs(double).max())
    whole = np.ones_like(rows, int)
    assert error(method(*whole), method(*whole.astype(float))) == 0.0


@all_cases("name", METHODS)
def test_wrong_arguments_are_rejected_by_name(robot: Robot, name: str) -> None:
    method, rows, count = getattr(robot, name), states(robot, 4), METHODS[name]
    for k in range(count):

        def call(wrong: Any, k: int = k) -> Any:
            return method(*rows[:k], wrong, *rows[k + 1 : count])

        what = f"{robot.name}: ({NAMES[k]}|tau|qdd)"
        for wrong in (rows[k, :, :-1], np.append(rows[k, 0], 0.0), 1.0, []):
            with pytest.raises(ValueError, match=f"{what}: shape.*expected .*{robot.n_joints} joint variables"):
                call(wrong)
        for wrong in (rows[k] + 0j, ["a"] * robot.n_joints):
            with pytest.raises(TypeError, match=f"{what}: dtype"):
                call(wrong)
        if count > 1:
            with pytest.raises(ValueError, match=f"{robot.name}: .*expected leading axes that broadcast"):
                call(rows[k, :3])


@all_cases("name", METHODS)
def test_a_nan_affects_only_its_configuration(robot: Robot, name: str) -> None:
    method, rows = getattr(robot, name), states(robot, 3)[: METHODS[name]]
    expected = parts(method(*rows))
    for value in (np.nan, np.inf):
        spoilt = rows.copy()
        spoilt[0, 1] = value
        with np.errstate(invalid="ignore"):
            found = parts(method(*spoilt))
        for mine, right in zip(found, expected, strict=True):
            assert np.array_equal(mine[[0, 2]], right[[0, 2]])
        assert any(np.isnan(mine[1]).any() for mine in found)


def test_threads_share_a_robot() -> None:
    """Use a new robot, so that whichever thread is first creates the tables."""
    rows = states(ROBOTS["tree"], 50)
    expected = {name: getattr(ROBOTS["tree"], name)(*rows[:count]) for name, count in METHODS.items()}
    for _ in range(3):
        robot = tree()
        with ThreadPoolExecutor(8) as pool:
            jobs = [(name, pool.submit(getattr(robot, name), *rows[:count])) for name, count in METHODS.items()] * 2
            for name, job in jobs:
                assert error(job.result(), expected[name]) == 0.0, name


CALLS = f"""
import sys
import numpy as np
from algorithms.kinematics import Robot
robot = Robot.from_urdf(sys.argv[1]) if len(sys.argv) > 1 else Robot.named("puma560")
for name, count in {METHODS}.items():
    getattr(robot, name)(*np.ones((count, robot.n_joints)))
print(*sorted({{"numba", "llvmlite", "gacompiler"}} & set(sys.modules)))
"""


@pytest.mark.skipif(robots.backend != "c", reason="needs the built library")
def test_first_calls_need_no_numba() -> None:
    done = subprocess.run([sys.executable, "-c", CALLS], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == ""


HIDE_EXTENSION = f"""
from pathlib import Path
exists = Path.exists
Path.exists = lambda path: not path.name.startswith("{STEM}_") and exists(path)
"""
COMPARE = """
import sys
import numpy as np
from algorithms.kinematics import Robot
from generated import robots
from generated.gac_runtime.extension import extension
assert robots.backend == "numba" and extension is None
robot = Robot.named("stanford")
rows = np.load(sys.argv[1])
found = {name: getattr(robot, name)(*rows[:count]) for name, count in (("forward", 1), ("inverse_dynamics", 3))}
found["one"] = robot.inverse_dynamics(*rows[:, 0])
np.savez(sys.argv[2], **found)
"""


@pytest.mark.slow
def test_robots_without_a_c_compiler(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(HIDE_EXTENSION)
    robot = Robot.named("stanford")
    rows = states(robot, 5)
    np.save(tmp_path / "rows.npy", rows)
    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    subprocess.run(
        [sys.executable, "-c", COMPARE, str(tmp_path / "rows.npy"), str(tmp_path / "found.npz")],
        cwd=ROOT, env={**os.environ, "GAC_BACKEND": "numba", "PYTHONPATH": path}, check=True,
    )  # fmt: skip
    found = np.load(tmp_path / "found.npz")
    assert error(found["forward"], robot.forward(rows[0])) < 1e-14
    assert error(found["inverse_dynamics"], robot.inverse_dynamics(*rows)) < 1e-14
    assert error(found["one"], robot.inverse_dynamics(*rows[:, 0])) < 1e-14


@pytest.mark.parametrize("what", ["inverse_dynamics", "forward_dynamics"])
def test_former_names_warn(what: str) -> None:
    robot, rows = ROBOTS["tree"], states(ROBOTS["tree"], 2)
    with pytest.warns(DeprecationWarning, match=f"{what}_slopes is now {what}_derivatives.*in version 0.3") as caught:
        found = getattr(robot, f"{what}_slopes")(*rows)
    assert caught[0].filename == __file__
    assert error(found, getattr(robot, f"{what}_derivatives")(*rows)) == 0.0


def test_a_robot_copies_its_numbers() -> None:
    arm = Robot.named("puma560")
    axes, home, bodies = arm.axes.copy(), arm.home.copy(), arm.bodies.copy()
    robot = Robot("mine", arm.kinds, axes, home, bodies=bodies)
    expected = robot.mass_matrix(np.ones(6)), robot.forward(np.ones(6))
    for given, kept in ((axes, robot.axes), (home, robot.home), (bodies, robot.bodies)):
        assert given.flags.writeable and not kept.flags.writeable
        given[:] = 0.0
        with pytest.raises(ValueError, match="read-only"):
            kept[0] = 0.0
    assert np.array_equal(robot.mass_matrix(np.ones(6)), expected[0])
    assert np.array_equal(robot.forward(np.ones(6)), expected[1])


def test_errors_of_invalid_descriptions() -> None:
    arm = Robot.named("puma560")
    given: dict[str, Any] = {name: getattr(arm, name) for name in ("name", "kinds", "axes", "home", "bodies", "limits")}

    def broken(name: str) -> Any:
        array = given[name].copy()
        array[2, 1] = np.nan
        return array

    cases: tuple[tuple[type[DescriptionError], dict[str, Any]], ...] = (
        (UnknownJointTypeError, {"kinds": ("revolute",) * 6}),
        (JointCountError, {"axes": arm.axes[:5]}),
        (JointCountError, {"kinds": (), "axes": arm.axes[:0]}),
        (JointCountError, {"bodies": arm.bodies[:4]}),
        *((NotFiniteError, {name: broken(name)}) for name in ("axes", "home", "bodies", "limits")),
        (DescriptionError, {"parents": (-1, 0, 1, 5, 3, 4)}),
    )
    for error, change in cases:
        with pytest.raises(error, match="puma560: "):
            Robot(**{**given, **change})
    for error, rows in (
        (UnknownJointTypeError, [{"kind": "ball"}]),
        (NotFiniteError, [{"a": float("nan")}]),
        (JointCountError, []),
    ):
        with pytest.raises(error, match="row"):
            Robot.from_dh(rows)
