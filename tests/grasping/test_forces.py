"""Forces of fingers against closed forms, the equations of balance, and the dual linear programme."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from algorithms.grasping import ForceStatus, contact_forces, contact_wrenches, grasp_quality
from generated import pga3
from tests.support.all_cases import all_cases

GRIPPER = np.array([[0.02, 0, 0], [-0.02, 0, 0]]), np.array([[1.0, 0, 0], [-1, 0, 0]])
"""Two fingers that press a box from both sides."""


def balance(found, contacts, normals, load, centre=(0, 0, 0)):
    """The sum of all forces and torques."""
    torque = np.cross(contacts - np.array(centre), found.forces).sum(0) + found.torques @ normals
    return np.concatenate([found.forces.sum(0), torque]) + load


@pytest.mark.parametrize("friction", [0.2, 0.5, 1.0])
def test_a_gripper_holds_a_weight_with_the_force_of_coulombs_law(friction) -> None:
    for weight in (0.1, 3.0, 500.0):
        load = np.array([0, -weight, 0, 0, 0, 0])
        found = contact_forces(*GRIPPER, load, friction)
        assert found.status == ForceStatus.OK and abs(found.largest / (weight / 2 / friction) - 1) < 1e-6
        assert np.abs(balance(found, *GRIPPER, load)).max() < 1e-5 * weight
        inward = -(found.forces * GRIPPER[1]).sum(1)
        across = np.linalg.norm(found.forces + inward[:, None] * GRIPPER[1], axis=1)
        assert (across <= friction * inward * (1 + 1e-6)).all()
        weak = contact_forces(*GRIPPER, load, friction, limit=0.99 * found.largest)
        assert weak.status == ForceStatus.TOO_WEAK and weak.largest == found.largest


def test_soft_fingers_resist_the_torque_about_their_line() -> None:
    # Hard fingers at two points resist no torque about the line through them.
    load = np.array([0, -2.0, 0, 0.03, 0, 0])
    assert grasp_quality(*GRIPPER, length=0.02) == 0
    hard = contact_forces(*GRIPPER, load)
    assert hard.status == ForceStatus.SLIPS and np.isnan(hard.forces).all() and hard.largest == np.inf
    torsion = 0.004
    assert grasp_quality(*GRIPPER, length=0.02, torsion=torsion) > 0.01
    found = contact_forces(*GRIPPER, load, torsion=torsion)
    # Each finger bears half: parts of its normal force hold the weight, and others the torque.
    assert found.status == ForceStatus.OK and abs(found.largest / (2 / 2 / 0.5 + 0.03 / 2 / torsion) - 1) < 1e-6
    assert np.abs(balance(found, *GRIPPER, load)).max() < 1e-6
    inward = -(found.forces * GRIPPER[1]).sum(1)
    across = np.linalg.norm(found.forces + inward[:, None] * GRIPPER[1], axis=1)
    # The ellipsoid at which soft fingers slip (Howe and Cutkosky).
    assert ((across / 0.5 / inward) ** 2 + (found.torques / torsion / inward) ** 2 <= 1 + 1e-6).all()


def test_the_quality_of_soft_fingers_is_that_of_their_wrenches() -> None:
    quality = grasp_quality(*GRIPPER, length=0.02, torsion=0.004)
    force, moment = pga3.line_to_direction_moment(contact_wrenches(*GRIPPER, torsion=0.004))
    assert force.shape == (2, 10, 3) and np.allclose(force[:, 8:], -GRIPPER[1][:, None])
    rows = np.concatenate([force, moment / 0.02], -1).reshape(-1, 6)
    for axis, sign in ((k, s) for k in range(6) for s in (1, -1)):
        # How far the hull reaches along an axis; about the line of the fingers it is the torsion.
        goal = sign * np.eye(6)[axis]
        found = linprog(
            [*np.zeros(len(rows)), -1],
            A_eq=np.vstack([np.c_[rows.T, -goal], [*np.ones(len(rows)), 0]]),
            b_eq=[*np.zeros(6), 1],
        )
        assert -found.fun >= quality * (1 - 1e-9)
        if axis == 3:
            assert abs(-found.fun - 0.004 / 0.02) < 1e-9


@pytest.mark.parametrize("torsion", [0.0, 0.006])
def test_the_largest_force_is_that_of_the_dual(torsion) -> None:
    rng = np.random.default_rng(4)
    slips = 0
    for _ in range(12):
        angles = rng.uniform(0, 0.4, 4) + np.arange(4) * np.pi / 2
        contacts = np.c_[0.03 * np.cos(angles), 0.03 * np.sin(angles), rng.uniform(-0.01, 0.01, 4)]
        normals = contacts * [1, 1, 0] + rng.normal(0, 0.004, (4, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        turn, centre = Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3)
        contacts, normals = contacts @ turn.T + centre, normals @ turn.T
        load = rng.normal(size=6) * [1, 1, 1, 0.02, 0.02, 0.02]
        found = contact_forces(contacts, normals, load, 0.4, 10, centre, torsion)
        force, moment = pga3.line_to_direction_moment(contact_wrenches(contacts, normals, 0.4, 10, centre, torsion))
        wrenches = np.concatenate([force, moment / 0.03], -1)
        # Of all twists for which the supports of the contacts add up to at most 1, the largest power of the load.
        n = len(contacts)
        upper = np.vstack([np.c_[each, np.tile(-np.eye(n)[k], (len(each), 1))] for k, each in enumerate(wrenches)])
        upper = np.vstack([upper, [*np.zeros(6), *np.ones(n)]])
        bound = linprog(
            [*(load / [1, 1, 1, 0.03, 0.03, 0.03]), *np.zeros(n)],
            A_ub=upper,
            b_ub=[*np.zeros(len(upper) - 1), 1],
            bounds=[(None, None)] * 6 + [(0, None)] * n,
        )
        slips += found.status == ForceStatus.SLIPS
        if found.status == ForceStatus.OK:
            assert abs(found.largest + bound.fun) < 1e-6 * found.largest
            assert np.abs(balance(found, contacts, normals, load, centre)).max() < 1e-5
        else:
            assert bound.status == 3
    assert slips < 6


def test_no_load_needs_no_force_and_one_finger_slips() -> None:
    found = contact_forces(*GRIPPER, np.zeros(6))
    assert found.status == ForceStatus.OK and not found.forces.any() and found.largest == 0
    one = GRIPPER[0][:1], GRIPPER[1][:1]
    assert contact_forces(*one, [0, -1, 0, 0, 0, 0]).status == ForceStatus.SLIPS
    assert contact_forces(*one, [1, 0, 0, 0, 0, 0]).status == ForceStatus.OK
    assert contact_forces(np.zeros((0, 3)), np.zeros((0, 3)), [1, 0, 0, 0, 0, 0]).status == ForceStatus.SLIPS


@all_cases(
    "more, error, text",
    [
        ({"load": np.zeros(5)}, ValueError, "load"),
        ({"load": np.zeros((2, 6))}, ValueError, r"load: shape \(2, 6\)"),
        ({"load": [np.nan] * 6}, ValueError, "load"),
        ({"load": ["a"] * 6}, TypeError, "load"),
        ({"limit": 0.0}, ValueError, "limit: 0.0; expected a positive number"),
        ({"limit": np.nan}, ValueError, "limit"),
        ({"torsion": -1.0}, ValueError, "torsion: -1.0; expected a length of at least 0"),
        ({"friction": 0.0}, ValueError, "friction"),
    ],
)
def test_arguments_are_checked(more, error, text) -> None:
    with pytest.raises(error, match=text):
        contact_forces(*GRIPPER, **{"load": np.zeros(6), **more})
