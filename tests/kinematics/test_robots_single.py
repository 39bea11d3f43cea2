"""A single configuration takes another way than a batch of them, and gives the same."""

from __future__ import annotations

import os
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from alone import alone

from algorithms.kinematics import (
    Body,
    DescriptionError,
    JointCountError,
    NotFiniteError,
    Robot,
    UnknownJointTypeError,
    passes,
    single,
)
from gacompiler.gac_runtime.build import STEM
from generated import pga3
from generated.gac_runtime.extension import extension

HIDE_EXTENSION = f"""
from pathlib import Path
exists = Path.exists
Path.exists = lambda path: not path.name.startswith("{STEM}_") and exists(path)
"""

METHODS = {
    "forward": 1,
    "forward_all": 1,
    "pose": 1,
    "jacobian": 1,
    "jacobian_rate": 2,
    "velocity": 2,
    "acceleration": 3,
    "inverse_dynamics": 3,
    "gravity": 1,
    "coriolis": 2,
    "coriolis_matrix": 2,
    "mass_matrix": 1,
    "forward_dynamics": 3,
    "kinetic_energy": 2,
    "potential_energy": 1,
    "inverse_dynamics_slopes": 3,
}
"""How many of positions, speeds and accelerations each takes."""
COMPILED_SOON = ("forward", "forward_all", "pose", "jacobian", "velocity", "mass_matrix")
COMPILED_LATE = tuple(name for name in METHODS if name not in COMPILED_SOON)
"""Their passes take numba some seconds, the first time."""


def tree() -> Robot:
    """Two branches, a slide and rotors: the end effector is on the second branch."""
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


@pytest.mark.parametrize(
    "names", [COMPILED_SOON, pytest.param(COMPILED_LATE, marks=pytest.mark.slow)], ids=["soon", "late"]
)
@pytest.mark.parametrize("robot", [tree(), Robot.named("ur5"), Robot.named("puma560")], ids=lambda robot: robot.name)
def test_every_method_gives_what_a_batch_gives(robot: Robot, names: tuple[str, ...]) -> None:
    rows = np.random.default_rng(1).uniform(-1.5, 1.5, (3, 2, robot.n_joints))
    for name, count in ((name, METHODS[name]) for name in names):
        method = getattr(robot, name)
        batch: Any = method(*rows[:count])
        one = [method(*rows[:count, 0]) for _ in range(passes.PATIENCE + 3)]
        for found in (one[0], one[-1]):  # before and after it is compiled
            pairs = zip(found, batch, strict=True) if isinstance(batch, tuple) else [(found, batch)]
            for mine, expected in pairs:
                assert np.shape(mine) == expected.shape[1:]
                assert np.abs(mine - expected[0]).max() < 1e-12 * max(1, np.abs(expected[0]).max()), name


@pytest.mark.parametrize("kind", ["its own joints", "joints that follow others"])
def test_energies_of_one_configuration_are_numbers_before_and_after_passes_are_compiled(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = tree()
    if kind == "joints that follow others":  # there are no passes for them
        coupling = np.eye(6)
        coupling[5] = coupling[4]
        robot = replace(robot, coupling=coupling, limits=np.empty(0))
    q = np.random.default_rng(5).uniform(-1, 1, robot.n_joints)
    # As where nothing has called them yet, in this process or in what other tests did in it.
    fresh = single.Passes(
        *(passes.Pass(getattr(single, field.name), robot.n_joints) for field in fields(single.Passes))
    )
    for source in (single.potential_energy, single.kinetic_energy):
        monkeypatch.setattr(source, "_compiled", None)
        monkeypatch.setattr(source, "_calls", 0)
    object.__setattr__(robot, "_passes", fresh)
    for method, given in ((robot.potential_energy, (q,)), (robot.kinetic_energy, (q, q))):
        found = [method(*given) for _ in range(passes.PATIENCE + 3)]
        assert {type(each) for each in found} == {np.float64}
        assert type(method(*(list(each) for each in given))) is np.float64
        assert type(method(*(each.astype(np.float32) for each in given))) is np.float32
        assert method(*(each[None] for each in given)).shape == (1,)
    assert (single.potential_energy._compiled is not None) == (kind == "its own joints")


def test_what_is_no_row_of_doubles_takes_the_other_way() -> None:
    robot = tree()
    q = np.random.default_rng(2).uniform(-1, 1, 6)
    for _ in range(passes.PATIENCE + 2):
        expected = robot.mass_matrix(q)
    still = q.copy()
    still.flags.writeable = False
    for other in (list(q), still, np.repeat(q, 2)[::2], q.astype(">f8")):
        assert np.abs(robot.mass_matrix(other) - expected).max() < 1e-12  # type: ignore[arg-type]
    assert robot.mass_matrix(q.astype(np.float32)).dtype == np.float32
    for wrong in (q[:5], np.append(q, 0.0), 1.0):
        with pytest.raises(ValueError, match="robot: q: shape"):
            robot.mass_matrix(wrong)
    with pytest.raises(TypeError, match="robot: q: dtype"):
        robot.mass_matrix(q + 0j)


def test_a_compiled_pass_takes_one_configuration_in_doubles_and_nothing_else() -> None:
    robot = tree()
    q = np.random.default_rng(3).uniform(-1, 1, 6)
    for _ in range(passes.PATIENCE + 2):
        robot.mass_matrix(q)
    run, table = robot._passes.mass_matrix, robot._heavy
    found = run(table, q)
    assert found.shape == (6, 6) and found.flags.owndata and np.array_equal(found, robot.mass_matrix(q))
    for other in (q[:5], q.astype(np.float32), np.stack([q, q]), np.repeat(q, 2)[::2], list(q), None, "q"):
        assert run(table, other) is None
    assert run(None, q) is None
    assert isinstance(robot.potential_energy(q), float) and isinstance(robot.kinetic_energy(q, q), float)


@pytest.fixture
def without_compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A Python that is started now runs the generated modules as where nothing was built: neither library nor calls."""
    monkeypatch.setenv("GAC_BACKEND", "numba")
    (tmp_path / "sitecustomize.py").write_text(HIDE_EXTENSION)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))


@pytest.mark.slow
@pytest.mark.usefixtures("without_compiler")
@alone
def test_passes_without_a_c_compiler() -> None:
    assert pga3.backend == "numba" and extension is None
    robot = Robot.from_dh(
        [{"a": 0.3}, {"d": 0.2, "alpha": 1.0}], bodies=[Body(1.0, (0.1, 0.2, 0.3), (1, 0, 0, 1, 0, 1))] * 2
    )
    q = np.array([[0.3, -0.8], [1.1, 0.4]])
    still = q[0].copy()
    still.flags.writeable = False
    strided = np.repeat(q[0], 2)[::2]
    for name in ("forward", "mass_matrix", "potential_energy"):
        method, run = getattr(robot, name), getattr(robot._passes, name)
        table = robot._table if name == "forward" else robot._heavy
        batch = method(q)
        assert run(table, q[0]) is None, "not compiled yet"
        one = [method(q[0]) for _ in range(passes.PATIENCE + 2)]
        found = run(table, q[0])
        assert type(found) is (np.float64 if name == "potential_energy" else np.ndarray), "compiled"
        for each in (one[0], one[-1], found, method(still), method(strided)):
            assert np.shape(each) == batch.shape[1:]
            assert np.abs(each - batch[0]).max() <= 1e-14 * np.abs(batch[0]).max()
        for other in (still, strided, np.ones(3), q, None):
            assert run(table, other) is None
        assert run(None, q[0]) is None
        for wrong in (np.ones(3), np.ones(1)):
            with pytest.raises(ValueError, match="robot: q: shape"):
                method(wrong)


def test_a_pass_without_a_file_is_compiled_and_one_that_cannot_be_bound_is_told() -> None:
    names: dict[str, Any] = {}
    exec("def twice(table, q, out):\n    out[0] = 2 * q[0]", {"__name__": "nowhere"}, names)
    source = passes.Source(names["twice"], lambda n: ((n,), ()))
    run, table = passes.Pass(source, 1), np.zeros((2, passes.COLUMNS))
    found = [run(table, np.array([1.5])) for _ in range(passes.PATIENCE + 2)]
    assert found[0] is None and found[-1] == 3.0
    if extension is None:
        return
    long = passes.Source(names["twice"], lambda n: ((1,) * 9, ()))
    run = passes.Pass(long, 1)
    with pytest.raises(RuntimeError, match="too many axes"):
        for _ in range(passes.PATIENCE + 1):
            run(table, np.ones((1,) * 9))


def test_a_robot_keeps_its_numbers_and_leaves_those_of_others_alone() -> None:
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


def test_descriptions_of_no_robot_have_errors_of_their_own() -> None:
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
