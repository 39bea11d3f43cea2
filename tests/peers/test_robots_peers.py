"""Kinematics and dynamics against Pinocchio and the Robotics Toolbox."""

from __future__ import annotations

from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.kinematics import Robot
from gacompiler.generation.compiling import compile_spec
from gacompiler.generation.files import write
from gacompiler.generation.rendering import render
from gacompiler.generation.spec_files import load_spec
from gacompiler.robots.descriptions import robot_spec
from gacompiler.runtime import load_module
from generated import pga3

pytestmark = pytest.mark.peers

URDFS = {
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "panda": "panda_description/urdf/panda.urdf",
    "xarm7": "xarm_description/urdf/xarm7.urdf",
    "talos arm": "talos_data/robots/talos_left_arm.urdf",
    "talos": "talos_data/robots/talos_reduced.urdf",
    "kinova": "kinova_description/robots/kinova.urdf",
}


def described(name: str) -> Path:
    """A URDF file of the package example-robot-data, by a name of `URDFS` or the end of its path."""
    try:
        files = metadata.files("example-robot-data") or []
    except metadata.PackageNotFoundError:
        pytest.skip("needs the package example-robot-data")
    return next(Path(str(file.locate())) for file in files if str(file).endswith(URDFS.get(name, name)))


def random_tree(folder: Path, seed: int, count: int) -> Path:
    """A robot whose links hang anywhere, by joints of every kind."""
    rng = np.random.default_rng(seed)

    def numbers(x: Any) -> str:
        return " ".join(f"{value:.17g}" for value in np.ravel(x))

    def place() -> str:
        return f'<origin xyz="{numbers(rng.normal(size=3))}" rpy="{numbers(rng.normal(size=3))}"/>'

    parts = ['<robot name="tree"><link name="l0"/>']
    for k in range(1, count + 1):
        a = rng.normal(size=(3, 3))
        t = a @ a.T / 10
        t = np.trace(t) * np.eye(3) - t  # obeys the triangle inequality, as real tensors do
        kind = rng.choice(["revolute", "prismatic", "fixed", "revolute"]) if k > 1 else "revolute"
        parts.append(
            f'<link name="l{k}"><inertial>{place()}'
            f'<mass value="{rng.uniform(0.5, 3)}"/><inertia ixx="{t[0, 0]}" ixy="{t[0, 1]}" ixz="{t[0, 2]}" '
            f'iyy="{t[1, 1]}" iyz="{t[1, 2]}" izz="{t[2, 2]}"/></inertial></link>'
            f'<joint name="j{k:02}" type="{kind}">'
            f'<parent link="l{rng.integers(max(0, k - 3), k)}"/><child link="l{k}"/>'
            f'{place()}<axis xyz="{numbers(rng.normal(size=3))}"/>'
            '<limit lower="-3" upper="3" velocity="1" effort="1"/></joint>'
        )
    path = folder / f"tree{seed}.urdf"
    path.write_text("\n".join([*parts, "</robot>"]))
    return path


def loaded(path: Path) -> tuple[Robot, Any, int]:
    """The robot of a file, Pinocchio's model of it, and the model's frame of the end effector."""
    pin = pytest.importorskip("pinocchio")
    model = pin.buildModelFromUrdf(str(path))
    robot = Robot.from_urdf(path)
    robot = replace(robot, coupling=np.empty(0), limits=np.empty(0))  # Pinocchio gives every joint a variable
    tip = next(name for name, (joint, tool) in robot.links.items() if joint == robot.tip
               and np.array_equal(tool, robot.tool))  # fmt: skip
    return robot, model, model.getFrameId(tip)


def compare(robot: Robot, model: Any, frame: int, count: int) -> None:
    """All quantities in `count` random states, against Pinocchio one state at a time, to 1e-10."""
    pin = pytest.importorskip("pinocchio")
    data = model.createData()
    joints = [model.getJointId(name) for name in robot.joint_names]
    assert sorted(joints) == list(range(1, model.njoints))
    at = [model.idx_vs[j] for j in joints]
    q, qd, qdd = np.random.default_rng(1).uniform(-2, 2, (3, count, robot.n_joints))
    tau = robot.inverse_dynamics(q, qd, qdd)
    mine = {
        "pose": robot.pose(q),
        "jacobian": robot.jacobian(q),
        "jacobian_rate": robot.jacobian_rate(q, qd),
        "inverse dynamics": tau,
        "mass matrix": robot.mass_matrix(q),
        "gravity": robot.gravity(q),
        "coriolis matrix": robot.coriolis_matrix(q, qd),
        "forward dynamics": robot.forward_dynamics(q, qd, tau),
        "slope by q": robot.inverse_dynamics_derivatives(q, qd, qdd)[0],
        "slope by qd": robot.inverse_dynamics_derivatives(q, qd, qdd)[1],
        "forward slope by q": robot.forward_dynamics_derivatives(q, qd, tau)[0],
        "kinetic energy": robot.kinetic_energy(q, qd),
        "potential energy": robot.potential_energy(q),
    }
    worst = dict.fromkeys(mine, 0.0)
    for k in range(count):
        x, v, a, f = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv), np.zeros(model.nv)
        for i, j in enumerate(joints):
            start = model.idx_qs[j]
            x[start : start + model.nqs[j]] = (np.cos(q[k, i]), np.sin(q[k, i])) if model.nqs[j] == 2 else q[k, i]
        v[at], a[at], f[at] = qd[k], qdd[k], tau[k]
        upper = np.triu(pin.crba(model, data, x))
        pin.computeJointJacobiansTimeVariation(model, data, x, v)
        pin.updateFramePlacements(model, data)
        swap = [3, 4, 5, 0, 1, 2]
        aligned = pin.LOCAL_WORLD_ALIGNED
        slopes = pin.computeRNEADerivatives(model, data, x, v, a)
        ahead = pin.computeABADerivatives(model, data, x, v, f)
        energy = pin.computeKineticEnergy(model, data, x, v)
        if model.armature.any():  # of which Pinocchio 4.1 counts a part there, and the whole in its matrix
            energy = v @ (upper + np.triu(upper, 1).T) @ v / 2
        theirs = {
            "slope by q": slopes[0][np.ix_(at, at)],
            "slope by qd": slopes[1][np.ix_(at, at)],
            "forward slope by q": ahead[0][np.ix_(at, at)],
            "pose": data.oMf[frame].homogeneous.copy(),
            "jacobian": pin.getFrameJacobian(model, data, frame, aligned)[swap][:, at],
            "jacobian_rate": pin.getFrameJacobianTimeVariation(model, data, frame, aligned)[swap][:, at],
            "inverse dynamics": pin.rnea(model, data, x, v, a)[at],
            "mass matrix": (upper + np.triu(upper, 1).T)[np.ix_(at, at)],
            "gravity": pin.computeGeneralizedGravity(model, data, x)[at],
            "coriolis matrix": pin.computeCoriolisMatrix(model, data, x, v)[np.ix_(at, at)],
            "forward dynamics": pin.aba(model, data, x, v, f)[at],
            "kinetic energy": energy,
            "potential energy": pin.computePotentialEnergy(model, data, x),
        }
        for name, value in theirs.items():
            worst[name] = max(worst[name], float(np.abs(mine[name][k] - value).max()))
    forward = worst.pop("forward slope by q")  # through the inverse of the mass matrix
    assert max(worst.values()) < 1e-10 and forward < 1e-7, (worst, forward)


@pytest.mark.parametrize(("name", "count"), [(name, 200 if name == "talos" else 1_000) for name in URDFS])
def test_robots_of_example_robot_data(name: str, count: int) -> None:
    compare(*loaded(described(name)), count)


def test_an_end_effector_that_moves() -> None:
    """The link of iris that is most joints from its base is a sensor, which does not."""
    robot = Robot.from_urdf(described("iris_description/robots/iris.urdf"))
    assert robot.n_joints == 4 and "rotor" in robot.joint_names[robot.tip]
    assert np.abs(robot.jacobian(np.zeros(4))).max() == 1.0


@pytest.mark.parametrize("seed", range(5))
def test_random_trees(seed: int, tmp_path: Path) -> None:
    compare(*loaded(random_tree(tmp_path, seed, 9)), 200)


def _se3(motor: Any) -> Any:
    return pytest.importorskip("pinocchio").SE3(pga3.motor_to_matrix(motor))


def _with_tool(model: Any, frame: int, motor: Any) -> int:
    pin, own = pytest.importorskip("pinocchio"), model.frames[frame]
    place = own.placement * _se3(motor)
    return int(model.addFrame(pin.Frame("new tool", own.parentJoint, frame, place, pin.FrameType.OP_FRAME)))


def _with_base(model: Any, motor: Any) -> None:
    for joint in range(1, model.njoints):
        if model.parents[joint] == 0:
            model.jointPlacements[joint] = _se3(motor) * model.jointPlacements[joint]


def _with_payload(model: Any, frame: int, mass: float, centre: Any, t: Any) -> None:
    tensor = np.array([[t[0], t[1], t[2]], [t[1], t[3], t[4]], [t[2], t[4], t[5]]])
    body = pytest.importorskip("pinocchio").Inertia(mass, np.array(centre), tensor)
    model.appendBodyToJoint(model.frames[frame].parentJoint, body, model.frames[frame].placement)


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """A small robot, and the module of its own kernels."""
    folder = tmp_path_factory.mktemp("tree")
    path = random_tree(folder, 7, 4)
    name, text = robot_spec(str(path), None, None, ())
    (folder / f"{name}.py").write_text(text)
    write(render(compile_spec(load_spec(folder / f"{name}.py"))), folder / "out")
    return path, load_module(folder / "out" / f"{name}.py", "_tree", "arrays")


@pytest.mark.parametrize("change", ["tool", "base", "gravity", "payload", "armature", "all"])
def test_changed_robots_with_kernels_of_their_own(change: str, tree: tuple[Path, Any]) -> None:
    """Every change with every method, compared with the same change of Pinocchio's model."""
    path, module = tree
    robot, model, frame = loaded(path)
    robot = robot.with_module(module)
    tool = pga3.motor_from_rotation_vector_translation([0.3, -0.2, 0.5], [0.05, 0.1, 0.2])
    base = pga3.motor_from_rotation_vector_translation([1.0, 0.4, -0.7], [0.3, -0.8, 0.5])
    load = 5.0, (0.1, -0.2, 0.3), (0.3, 0.01, -0.02, 0.4, 0.03, 0.2)
    if change in ("payload", "all"):
        robot = robot.with_payload(*load)
        _with_payload(model, frame, *load)
    if change in ("tool", "all"):
        robot, frame = robot.with_tool(tool), _with_tool(model, frame, tool)
    if change in ("base", "all"):
        robot = robot.with_base(base)
        _with_base(model, base)
    if change in ("gravity", "all"):
        robot = robot.with_gravity((1.0, -2.0, 3.0))
        model.gravity.linear = np.array([1.0, -2.0, 3.0])
    if change in ("armature", "all"):
        rotors = np.linspace(0.1, 0.4, len(robot.kinds))
        robot = robot.with_armature(rotors)
        model.armature[[model.idx_vs[model.getJointId(name)] for name in robot.joint_names]] = rotors
    compare(robot, model, frame, 20)


@pytest.mark.parametrize(("name", "theirs"), [("puma560", "Puma560"), ("stanford", "Stanford"), ("panda", "Panda")])
def test_named_robots_weigh_what_those_of_the_toolbox_do(name: str, theirs: str) -> None:
    """With armature, which the toolbox counts in ``rne`` and in ``inertia``."""
    peer = getattr(pytest.importorskip("roboticstoolbox").models.DH, theirs)().nofriction(True, True)
    arm = Robot.named(name)
    n = arm.n_joints
    q, qd, qdd = np.random.default_rng(2).uniform(-2, 2, (3, 50, n))
    frames = np.array([peer.fkine(x).A @ np.linalg.inv(peer.tool.A) for x in q])
    assert np.abs(arm.pose(q) - frames).max() < 1e-12
    expected = np.array([peer.rne(*one) for one in zip(q, qd, qdd, strict=True)])
    assert np.abs(arm.inverse_dynamics(q, qd, qdd) - expected).max() < 1e-10
    assert np.abs(arm.mass_matrix(q) - np.array([peer.inertia(x) for x in q])).max() < 1e-10
    if name == "puma560":
        assert peer.gravload(peer.qn)[1:3] == pytest.approx((31.6399, 6.0351), abs=5e-5)
        assert arm.gravity(peer.qn) == pytest.approx(peer.gravload(peer.qn), abs=1e-12)
