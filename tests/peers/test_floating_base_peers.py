"""Free flyers and planar joints against Pinocchio: near the origin and far from it, at any attitude."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np
import pytest
from test_robots_peers import described

from algorithms.kinematics import InertiaWarning, Robot
from generated import pga3

pytestmark = pytest.mark.peers

ROBOTS = {
    "g1": "g1_description/urdf/g1_29dof_rev_1_0.urdf",
    "talos": "talos_data/robots/talos_reduced.urdf",
    "anymal": "anymal_b_simple_description/robots/anymal.urdf",
    "solo12": "solo_description/robots/solo12.urdf",
}
DISTANCES = (0.0, 1e3, 1e6)
COUNT = 12
LIMIT = 1e-12


def attitudes(rng: np.random.Generator) -> np.ndarray:
    """Rotors at random, of yaw with a pitch of a quarter turn, of half turns, and of none."""
    unit = rng.normal(size=(COUNT, 3))
    angles = np.array([*rng.uniform(-np.pi, np.pi, COUNT - 6), 0.0, 1e-9, np.pi, np.pi - 1e-9, np.pi / 2, -np.pi / 2])
    unit[-2:] = 0, 1, 0
    return pga3.rotor_from_axis_angle(unit / np.linalg.norm(unit, axis=1, keepdims=True), angles)


def worst(mine: Any, theirs: Any) -> float:
    """Relative to the largest entry of each element."""
    axes = tuple(range(1, np.ndim(theirs)))
    return float((np.abs(mine - theirs).max(axes) / np.abs(theirs).max(axes)).max())


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("name", ROBOTS)
def test_dynamics_of_free_flyers(name: str, distance: float) -> None:
    pin = pytest.importorskip("pinocchio")
    path = described(ROBOTS[name])
    model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    with catch_warnings():  # ANYmal's base, without mass, has one moment of inertia
        simplefilter("ignore", InertiaWarning)
        robot = Robot.from_urdf(path, base="floating")
    data = model.createData()
    rng = np.random.default_rng(4)
    joints = [model.getJointId(joint) for joint in robot.joint_names[1:]]
    at = [3, 4, 5, 0, 1, 2, *(model.idx_vs[j] for j in joints)]  # Pinocchio has linear before angular
    places = [model.idx_qs[j] for j in joints]
    frame = model.getFrameId(next(n for n, (j, m) in robot.links.items() if j == robot.tip and (m == robot.tool).all()))
    direction = np.array([1.0, -2.0, 0.5]) / np.linalg.norm([1.0, -2.0, 0.5])
    rotors, shift = attitudes(rng), distance * direction
    q = np.empty((COUNT, robot.n_positions))
    q[:, :8], q[:, 8:] = pga3.motor_from_rotor_translation(rotors, shift), rng.uniform(-1, 1, (COUNT, len(joints)))
    v, a = rng.normal(size=(2, COUNT, robot.n_joints))
    tau = rng.normal(size=v.shape) * 20
    theirs: dict[str, list[Any]] = {}
    aligned = pin.LOCAL_WORLD_ALIGNED
    for k in range(COUNT):
        x, speeds, rates, forces = pin.neutral(model), *np.zeros((3, model.nv))
        x[:3], x[3:7], x[places] = shift, pga3.rotor_to_quaternion_scalar_last(rotors[k]), q[k, 8:]
        speeds[at], rates[at], forces[at] = v[k], a[k], tau[k]
        # in matrices that do not depend on where the base is, Pinocchio loses digits with the distance
        near = np.concatenate([np.zeros(3), x[3:]])
        slopes = pin.computeRNEADerivatives(model, data, near, speeds, rates)
        upper = np.triu(pin.crba(model, data, x))
        for what, value in {
            "inverse dynamics": pin.rnea(model, data, x, speeds, rates)[at],
            "forward dynamics": pin.aba(model, data, x, speeds, forces)[at],
            "mass matrix": (upper + np.triu(upper, 1).T)[np.ix_(at, at)],
            "gravity": pin.computeGeneralizedGravity(model, data, x)[at],
            "bias": pin.nonLinearEffects(model, data, x, speeds)[at],
            "coriolis matrix": pin.computeCoriolisMatrix(model, data, near, speeds)[np.ix_(at, at)],
            "by q": slopes[0][np.ix_(at, at)],
            "by qd": slopes[1][np.ix_(at, at)],
            "jacobian": pin.computeFrameJacobian(model, data, near, frame, aligned)[[3, 4, 5, 0, 1, 2]][:, at],
            "kinetic energy": pin.computeKineticEnergy(model, data, x, speeds),
            "integrate": pin.XYZQUATToSE3(pin.integrate(model, x, speeds)[:7]).homogeneous,
        }.items():  # fmt: skip
            theirs.setdefault(what, []).append(np.copy(value))
    found = {
        "inverse dynamics": worst(robot.inverse_dynamics(q, v, a), theirs["inverse dynamics"]),
        "forward dynamics": worst(robot.forward_dynamics(q, v, tau), theirs["forward dynamics"]),
        "mass matrix": worst(robot.mass_matrix(q), theirs["mass matrix"]),
        "gravity": worst(robot.gravity(q), theirs["gravity"]),
        "bias": worst(robot.coriolis(q, v) + robot.gravity(q), theirs["bias"]),
        "coriolis matrix": worst(robot.coriolis_matrix(q, v), theirs["coriolis matrix"]),
        "by q": worst(robot.inverse_dynamics_derivatives(q, v, a)[0], theirs["by q"]),
        "by qd": worst(robot.inverse_dynamics_derivatives(q, v, a)[1], theirs["by qd"]),
        "jacobian": worst(robot.jacobian(q), theirs["jacobian"]),
        "kinetic energy": worst(robot.kinetic_energy(q, v), theirs["kinetic energy"]),
        "integrate": worst(pga3.motor_to_matrix(robot.integrate(q, v)[:, :8]), theirs["integrate"]),
    }
    assert max(found.values()) <= LIMIT, {what: f"{error:.1e}" for what, error in found.items()}


PLANE = """<robot name="cart"><link name="world"/>
<link name="cart"><inertial><origin xyz="0.1 -0.2 0.3" rpy="0.2 0.1 -0.4"/><mass value="3"/>
<inertia ixx="0.3" ixy="0.01" ixz="-0.02" iyy="0.4" iyz="0.03" izz="0.2"/></inertial></link>
<link name="arm"><inertial><origin xyz="0.3 0.1 0"/><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.2"/></inertial></link>
<joint name="plane" type="planar"><parent link="world"/><child link="cart"/>
<origin xyz="1 2 3" rpy="0.3 -0.2 0.5"/><axis xyz="0 0 1"/></joint>
<joint name="turn" type="continuous"><parent link="cart"/><child link="arm"/>
<origin xyz="0 0.2 0.1" rpy="0.1 0 0"/><axis xyz="0 1 0"/></joint></robot>"""


def test_planar_joints(tmp_path: Path) -> None:
    """Both move along x, then y. Pinocchio's velocities are those in the frame of the moved link."""
    pin = pytest.importorskip("pinocchio")
    path = tmp_path / "cart.urdf"
    path.write_text(PLANE)
    robot, model = Robot.from_urdf(path, tip="arm"), pin.buildModelFromUrdf(str(path))
    data = model.createData()
    assert robot.joint_names == ("plane.x", "plane.y", "plane.turn", "turn")
    for q, v, a in np.random.default_rng(8).normal(size=(10, 3, 4)):
        c, s = np.cos(q[2]), np.sin(q[2])
        back = np.eye(4)
        back[:2, :2] = [[c, s], [-s, c]]
        x = np.array([q[0], q[1], c, s, np.cos(q[3]), np.sin(q[3])])
        speeds, rates = back @ v, back @ a
        rates[:2] += v[2] * np.array([speeds[1], -speeds[0]])
        tau = back.T @ pin.rnea(model, data, x, speeds, rates)
        assert worst(robot.inverse_dynamics(q, v, a)[None], tau[None]) < 1e-14
        pin.framesForwardKinematics(model, data, x)
        assert np.abs(robot.pose(q) - data.oMf[model.getFrameId("arm")].homogeneous).max() < 1e-14
