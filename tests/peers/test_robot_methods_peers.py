"""Every method of robots against Pinocchio: all files of example-robot-data, mimic joints, distant bases."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_robots_peers import described, random_tree

from algorithms.kinematics import DescriptionError, InertiaWarning, MissingInertiaError, Robot
from generated import pga3

pytestmark = pytest.mark.peers

COUNT = 100
SWAP = [3, 4, 5, 0, 1, 2]
"""Pinocchio has linear before angular."""
POSES, DYNAMICS = 3e-14, 2e-13
"""Errors relative to the largest entry of a result; of poses and Jacobians absolute, in metres."""


def urdf_files() -> list[str]:
    try:
        files = metadata.files("example-robot-data") or []
    except metadata.PackageNotFoundError:
        return []
    return sorted("/".join(file.parts[-4:]) for file in files if str(file).endswith(".urdf"))


def robot_of(path: Path, **options: Any) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        return Robot.from_urdf(path, **options)


@dataclass(frozen=True)
class Peer:
    """A model of Pinocchio, which has a variable for each joint, and how these follow the variables of a robot."""

    pin: Any
    model: Any
    robot: Robot
    coupling: np.ndarray
    at: list[int]

    @classmethod
    def of(cls, path: Path, robot: Robot) -> Peer:
        pin = pytest.importorskip("pinocchio")
        model = pin.buildModelFromUrdf(str(path))
        joints = [model.getJointId(name) for name in robot.joint_names]
        assert sorted(joints) == list(range(1, model.njoints))
        coupling = robot.coupling if robot.coupling.size else np.eye(len(joints), len(joints) + 1)
        return cls(pin, model, robot, coupling, [model.idx_vs[joint] for joint in joints])

    def rates(self, v: np.ndarray) -> np.ndarray:
        found = np.zeros(self.model.nv)
        found[self.at] = self.coupling[:, :-1] @ v
        return found

    def place(self, q: np.ndarray) -> np.ndarray:
        angles, found = self.coupling[:, :-1] @ q + self.coupling[:, -1], self.pin.neutral(self.model)
        for name, angle in zip(self.robot.joint_names, angles, strict=True):
            joint = self.model.getJointId(name)
            start, size = self.model.idx_qs[joint], self.model.nqs[joint]
            found[start : start + size] = (np.cos(angle), np.sin(angle)) if size == 2 else angle
        return found

    def columns(self, matrix: Any) -> np.ndarray:
        return np.asarray(matrix[:, self.at] @ self.coupling[:, :-1])

    def rows(self, vector: Any) -> np.ndarray:
        return np.asarray(self.coupling[:, :-1].T @ vector[self.at])

    def square(self, matrix: Any) -> np.ndarray:
        return np.asarray(self.coupling[:, :-1].T @ matrix[np.ix_(self.at, self.at)] @ self.coupling[:, :-1])

    def frame(self, link: str) -> int:
        return int(self.model.getFrameId(link, self.pin.FrameType.BODY))

    def kinematics(self, q: np.ndarray, qd: np.ndarray, link: str) -> dict[str, np.ndarray]:
        pin, model, data = self.pin, self.model, self.model.createData()
        pin.computeJointJacobiansTimeVariation(model, data, self.place(q), self.rates(qd))
        pin.updateFramePlacements(model, data)
        frame, aligned = self.frame(link), pin.LOCAL_WORLD_ALIGNED
        return {
            "pose": data.oMf[frame].homogeneous.copy(),
            "jacobian": self.columns(pin.getFrameJacobian(model, data, frame, aligned)[SWAP]),
            "jacobian rate": self.columns(pin.getFrameJacobianTimeVariation(model, data, frame, aligned)[SWAP]),
        }

    def dynamics(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> dict[str, np.ndarray]:
        pin, model, data = self.pin, self.model, self.model.createData()
        x, v, a = self.place(q), self.rates(qd), self.rates(qdd)
        upper = np.triu(pin.crba(model, data, x))
        by_q, by_qd = (np.copy(part) for part in pin.computeRNEADerivatives(model, data, x, v, a)[:2])
        pin.computeCentroidalMomentum(model, data, x, v)
        momentum = np.concatenate([data.hg.angular, data.hg.linear])
        pin.computeCentroidalMap(model, data, x)
        matrix = self.columns(data.Ag[SWAP])  # which other algorithms overwrite
        return {
            "inverse dynamics": self.rows(pin.rnea(model, data, x, v, a)),
            "mass matrix": self.square(upper + np.triu(upper, 1).T),
            "gravity": self.rows(pin.computeGeneralizedGravity(model, data, x)),
            "coriolis matrix": self.square(pin.computeCoriolisMatrix(model, data, x, v)),
            "by q": self.square(by_q),
            "by qd": self.square(by_qd),
            "centre of mass": np.copy(pin.centerOfMass(model, data, x)),
            "momentum matrix": matrix,
            "momentum": momentum,
        }

    def regressor(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces by the inertias of each joint, and those about the joints' frames, which are another basis."""
        pin, data = self.pin, self.model.createData()
        found = pin.computeJointTorqueRegressor(self.model, data, self.place(q), self.rates(qd), self.rates(qdd))
        return self.rows(found), np.concatenate([body.toDynamicParameters() for body in self.model.inertias[1:]])


def methods(robot: Robot, q: Any, qd: Any, qdd: Any) -> dict[str, Any]:
    by_q, by_qd = robot.inverse_dynamics_derivatives(q, qd, qdd)
    return {
        "inverse dynamics": robot.inverse_dynamics(q, qd, qdd),
        "mass matrix": robot.mass_matrix(q),
        "gravity": robot.gravity(q),
        "coriolis matrix": robot.coriolis_matrix(q, qd),
        "by q": by_q,
        "by qd": by_qd,
        "centre of mass": robot.centre_of_mass(q),
        "momentum matrix": robot.centroidal_momentum_matrix(q),
        "momentum": robot.centroidal_momentum(q, qd),
    }


def excess(mine: Any, theirs: Any, limit: float) -> float:
    """How many times the limit results differ, relative to the largest entry of all; forces below 1e-5 are rounding."""
    scale = max(float(np.abs(theirs).max(initial=0.0)), 1e-5)
    return float(np.abs(mine - theirs).max(initial=0.0)) / (limit * scale)


def stacked(rows: Iterator[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    found = list(rows)
    return {name: np.array([row[name] for row in found]) for name in found[0]}


def links_of(robot: Robot) -> list[str]:
    """The end effector, and some others."""
    tip = next(name for name, (j, m) in robot.links.items() if j == robot.tip and np.array_equal(m, robot.tool))
    names = list(robot.links)
    return [tip, *names[:: max(1, len(names) // 5)]]


def check(peer: Peer, robot: Robot, count: int = COUNT) -> None:
    q, qd, qdd = np.random.default_rng(1).uniform(-2, 2, (3, count, robot.n_joints))
    found: dict[str, float] = {}
    tip, *others = links_of(robot)
    theirs = stacked(peer.kinematics(a, b, tip) for a, b in zip(q, qd, strict=True))
    mine = {"pose": robot.pose(q), "jacobian": robot.jacobian(q), "jacobian rate": robot.jacobian_rate(q, qd)}
    found |= {name: excess(mine[name], theirs[name], POSES) for name in mine}
    for link in others:
        theirs = stacked(peer.kinematics(a, b, link) for a, b in zip(q[:10], qd[:10], strict=True))
        found[f"pose of {link}"] = excess(pga3.motor_to_matrix(robot.link(link, q[:10])), theirs["pose"], POSES)
        found[f"jacobian of {link}"] = excess(robot.jacobian(q[:10], link=link), theirs["jacobian"], POSES)
    if not robot.without_inertia:
        theirs = stacked(peer.dynamics(*row) for row in zip(q, qd, qdd, strict=True))
        for name, value in methods(robot, q, qd, qdd).items():
            found[name] = excess(value, theirs[name], DYNAMICS)
        regressor, inertias = peer.regressor(q[0], qd[0], qdd[0])
        forces = np.einsum("ijk,jk->i", robot.torque_regressor(q[0], qd[0], qdd[0]), robot.link_inertias)
        found["regressor"] = excess(forces, regressor @ inertias, DYNAMICS)
        inverses(robot, theirs["mass matrix"], q, qd, theirs["inverse dynamics"], qdd, found)
    assert max(found.values()) <= 1, {name: value for name, value in found.items() if value > 1}


def inverses(
    robot: Robot, mass: np.ndarray, q: Any, qd: Any, tau: np.ndarray, qdd: np.ndarray, found: dict[str, float]
) -> None:
    """Errors of inverses grow with the condition number of the mass matrix; those of singular matrices are NaN."""
    inverse, ahead = robot.inverse_mass_matrix(q), robot.forward_dynamics(q, qd, tau)
    regular = np.isfinite(inverse).all((-2, -1))
    if not regular.all():
        # romeo has fingers without inertia
        roots = np.linalg.eigvalsh(mass[~regular])
        assert (roots[:, 0] < 1e-12 * roots[:, -1]).all() and np.isnan(ahead[~regular]).any(-1).all()
    for k in np.flatnonzero(regular):
        condition = float(np.linalg.cond(mass[k]))
        expected = np.linalg.inv(mass[k])
        found["inverse"] = max(found.get("inverse", 0.0), excess(inverse[k], expected, DYNAMICS * condition))
        found["forward"] = max(found.get("forward", 0.0), excess(ahead[k], qdd[k], DYNAMICS * condition))


@pytest.mark.parametrize("name", [name for name in urdf_files() if "tiago_dual" not in name])
def test_all_files(name: str) -> None:
    """All joints, also mimic joints, have separate variables.

    The largest file is left out: its arms are those of `tiago`, and the next test compares it with its mimic joints.
    """
    path = described(name)
    try:
        robot = robot_of(path)
    except DescriptionError as error:
        pytest.skip(str(error)[-100:])
    try:
        peer = Peer.of(path, robot)
    except ValueError as error:
        pytest.skip(str(error)[-100:])
    free = replace(robot, coupling=np.empty(0), limits=np.empty(0))
    check(replace(peer, robot=free, coupling=np.eye(len(robot.kinds), len(robot.kinds) + 1)), free)


COUPLED = ("panda", "baxter_description/urdf/baxter.urdf", "tiago_description/robots/tiago_dual.urdf", "talos")


@pytest.mark.parametrize("name", COUPLED)
def test_joints_that_follow_others(name: str) -> None:
    path = described(name)
    robot = robot_of(path)
    check(Peer.of(path, robot), robot, 30)


@pytest.mark.parametrize("seed", range(3))
def test_random_trees_with_slides(seed: int, tmp_path: Path) -> None:
    path = random_tree(tmp_path, seed + 20, 12)
    robot = robot_of(path)
    check(Peer.of(path, robot), robot, 30)


@pytest.mark.parametrize("distance", [1e3, 1e6])
@pytest.mark.parametrize("name", ["ur5", "panda", "talos"])
def test_far_bases(name: str, distance: float) -> None:
    """Forces equal those of the robot near the origin up to the rounding of its lines."""
    path = described(name)
    robot = robot_of(path)
    peer = Peer.of(path, robot)
    motor = pga3.motor_from_rotation_vector_translation([0.0, 0.0, 0.7], distance * np.array([0.6, -0.48, 0.64]))
    far = robot.with_base(motor)
    q, qd, qdd = np.random.default_rng(1).uniform(-2, 2, (3, 20, robot.n_joints))
    theirs = stacked(peer.dynamics(*row) for row in zip(q, qd, qdd, strict=True))
    limit = DYNAMICS + 2e-15 * distance
    turn = pga3.motor_to_matrix(motor)
    theirs["centre of mass"] = theirs["centre of mass"] @ turn[:3, :3].T + turn[:3, 3]
    both = np.kron(np.eye(2), turn[:3, :3])
    theirs["momentum matrix"], theirs["momentum"] = both @ theirs["momentum matrix"], theirs["momentum"] @ both.T
    found = {name: excess(value, theirs[name], limit) for name, value in methods(far, q, qd, qdd).items()}
    condition = np.linalg.cond(theirs["mass matrix"]).max()
    ahead = far.forward_dynamics(q, qd, theirs["inverse dynamics"])
    found["forward"] = excess(ahead, qdd, limit * condition)
    assert max(found.values()) <= 1, found


@pytest.mark.parametrize("distance", [0.0, 1e3, 1e6])
@pytest.mark.parametrize("name", ["anymal_b_simple_description/robots/anymal.urdf", "talos"])
def test_floating_bases(name: str, distance: float) -> None:
    pin = pytest.importorskip("pinocchio")
    path = described(name)
    robot, model = robot_of(path, base="floating"), pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    data, rng = model.createData(), np.random.default_rng(7)
    joints = [model.getJointId(joint) for joint in robot.joint_names[1:]]
    at = [3, 4, 5, 0, 1, 2, *(model.idx_vs[joint] for joint in joints)]
    rotor = rng.normal(size=4)
    rotor /= np.linalg.norm(rotor)
    shift = distance * np.array([0.6, -0.48, 0.64])
    v, a = rng.normal(size=(2, robot.n_joints))
    q = np.concatenate([pga3.motor_from_rotor_translation(rotor, shift), rng.uniform(-1, 1, len(joints))])
    x, speeds, rates = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    x[:3], x[3:7] = shift, pga3.rotor_to_quaternion_scalar_last(rotor)
    x[[model.idx_qs[joint] for joint in joints]] = q[8:]
    speeds[at], rates[at] = v, a
    near = np.concatenate([np.zeros(3), x[3:]])
    upper = np.triu(pin.crba(model, data, near))
    mass = (upper + np.triu(upper, 1).T)[np.ix_(at, at)]
    condition = float(np.linalg.cond(mass))
    assert excess(robot.inverse_mass_matrix(q), np.linalg.inv(mass), DYNAMICS * condition) <= 1
    centre = pin.centerOfMass(model, data, near) + shift
    assert excess(robot.centre_of_mass(q), centre, DYNAMICS) <= 1
    pin.computeCentroidalMap(model, data, near)
    matrix = data.Ag[SWAP][:, at]
    assert excess(robot.centroidal_momentum_matrix(q), matrix, DYNAMICS) <= 1
    assert excess(robot.centroidal_momentum(q, v), matrix @ v, DYNAMICS) <= 1
    tau = pin.rnea(model, data, near, speeds, rates)[at]
    forces = np.einsum("ijk,jk->i", robot.torque_regressor(q, v, a), robot.link_inertias)
    assert excess(forces, tau, DYNAMICS) <= 1
    for link in links_of(robot):
        jacobian = pin.computeFrameJacobian(
            model, data, near, model.getFrameId(link, pin.FrameType.BODY), pin.LOCAL_WORLD_ALIGNED
        )
        assert excess(robot.jacobian(q, link=link), jacobian[SWAP][:, at], POSES) <= 1, link
        pin.updateFramePlacements(model, data)
        place = data.oMf[model.getFrameId(link, pin.FrameType.BODY)].homogeneous.copy()
        place[:3, 3] += shift
        assert excess(pga3.motor_to_matrix(robot.link(link, q)), place, POSES) <= 1, link


def test_files_without_inertia_are_refused() -> None:
    robot = robot_of(described("human_description/robots/human.urdf"))
    with pytest.raises(MissingInertiaError, match="no inertia of "):
        robot.centre_of_mass(np.zeros(robot.n_joints))
