"""Contacts and closed loops of a quadruped against Pinocchio's constrained dynamics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.kinematics import Constrained, Robot, contacts
from generated import pga3
from tests.support.described_robots import quadruped

pytestmark = pytest.mark.peers

LEGS = ("lf", "rf", "lh", "rh")
COUNT = 20


@pytest.fixture(scope="module")
def both() -> tuple[Any, Any, Robot, list[int], list[int]]:
    """Pinocchio and its model, the robot, and the places of its rates and joint variables in Pinocchio's."""
    pin = pytest.importorskip("pinocchio")
    model = pin.buildModelFromXML(quadruped(), pin.JointModelFreeFlyer())
    robot = Robot.from_urdf(quadruped(), base="floating")
    joints = [model.getJointId(joint) for joint in robot.joint_names[1:]]
    at = [3, 4, 5, 0, 1, 2, *(model.idx_vs[j] for j in joints)]
    return pin, model, robot, at, [model.idx_qs[j] for j in joints]


def states(both: Any) -> Any:
    """Configurations, rates and forces, and the same for Pinocchio."""
    pin, model, _, at, places = both
    rng = np.random.default_rng(5)
    rotors = pga3.rotor_from_axis_angle([0.48, 0.6, 0.64], rng.uniform(-3, 3, COUNT))
    shifts = rng.normal(size=(COUNT, 3))
    motors = pga3.motor_from_rotor_translation(rotors, shifts)
    q = np.concatenate([motors, rng.uniform(-1, 1, (COUNT, 12))], axis=1)
    v, tau = rng.normal(size=(2, COUNT, 18)) * np.array([1.0, 10.0])[:, None, None]
    for k in range(COUNT):
        x, speeds, forces = pin.neutral(model), *np.zeros((2, 18))
        x[:3], x[3:7], x[places] = shifts[k], pga3.rotor_to_quaternion_scalar_last(rotors[k]), q[k, 8:]
        speeds[at], forces[at] = v[k], tau[k]
        yield q[k], v[k], tau[k], x, speeds, forces


def relative(found: Any, expected: Any) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def test_contacts_of_feet(both: Any) -> None:
    """Accelerations, forces in the world, and impulses of four point contacts."""
    pin, model, robot, at, _ = both
    foot = np.array([0, 0, -0.3])
    held = Constrained(robot, [contacts.point(f"{leg}_shank", foot) for leg in LEGS])
    models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for leg in LEGS:
        joint = model.getJointId(f"{leg}_shank")
        place = pin.SE3(np.eye(3), foot)
        models.append(
            pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, joint, place, pin.LOCAL_WORLD_ALIGNED)
        )
    for each in models:
        datas.append(each.createData())
    data = model.createData()
    pin.initConstraintDynamics(model, data, models, datas)
    for q, v, tau, x, speeds, forces in states(both):
        rates = pin.constraintDynamics(model, data, x, speeds, forces, models, datas)[at]
        found = held.forward_dynamics(q, v, tau)
        assert found.status == 0
        assert relative(found.result, rates) < 1e-10 and relative(found.forces, np.array(data.lambda_c)) < 1e-10
        matrix = np.zeros((12, 18))
        matrix[:, at] = held.matrix(q)
        after = pin.impulseDynamics(model, data, x, speeds, matrix, 0.3)[at]
        impact = held.impact(q, v, restitution=0.3)
        assert relative(impact.result, after) < 1e-10 and relative(impact.forces, np.array(data.impulse_c)) < 1e-10


def test_a_weld_of_two_legs_and_a_sole(both: Any) -> None:
    """Six numbers each: a loop through the body, and a foot on the ground."""
    pin, model, robot, at, _ = both
    turn = pin.exp3(np.array([0.3, -0.2, 0.5]))
    first, second = pin.SE3(turn, np.array([0.1, 0, -0.3])), pin.SE3(np.eye(3), np.array([0, 0.1, 0]))
    held = Constrained(
        robot,
        [
            contacts.weld("lf_shank", first.homogeneous, other="rh_shank", target=second.homogeneous),
            contacts.weld("lh_shank"),
        ],
    )
    models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    kind, joint = pin.ContactType.CONTACT_6D, model.getJointId
    models.append(pin.RigidConstraintModel(kind, model, joint("lf_shank"), first, joint("rh_shank"), second, pin.LOCAL))
    models.append(pin.RigidConstraintModel(kind, model, joint("lh_shank"), pin.SE3.Identity(), pin.LOCAL))
    for each in models:
        datas.append(each.createData())
    data = model.createData()
    pin.initConstraintDynamics(model, data, models, datas)
    for q, v, tau, x, speeds, forces in states(both):
        # Where the loop is not closed, the rates of its angles are defined differently: the legs are at rest.
        rates = pin.constraintDynamics(model, data, x, 0 * speeds, forces, models, datas)[at]
        found = held.forward_dynamics(q, 0 * v, tau)
        assert found.status == 0
        sizes = np.array(data.lambda_c)
        assert relative(found.result, rates) < 1e-8, relative(found.result, rates)
        assert np.linalg.norm(found.forces[6:9]) == pytest.approx(np.linalg.norm(sizes[6:9]), rel=1e-8)
