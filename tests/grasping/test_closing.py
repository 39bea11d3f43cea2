"""Hands that close until they touch: fingers in a plane by closed forms in small steps, and grippers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.grasping import (
    BARRETT_OPENRAVE,
    FRANKA_HAND,
    ROBOTIQ_2F_85,
    ClosingStatus,
    close_hand,
    hand_from_urdf,
    hand_of_table,
    plan_grasps,
)
from algorithms.kinematics.collisions import capsule_obstacle, mesh_obstacle
from benchmarks.force_closure import distances_to_segment
from generated import pga3
from tests.support.scans import box

STILL = np.eye(8)[0]
TABLE = BARRETT_OPENRAVE
TWO_FINGERS = hand_from_urdf(ROBOTIQ_2F_85, torsion=0.003)


def finger(bend, last):
    """Points (x, z) of finger 3 in the plane y = 0: its first joint, its last joint, and its fingertip."""
    root = np.array([-TABLE.root, 0.0])
    middle = root + TABLE.link * np.array([-np.cos(bend), np.sin(bend)])
    angle = bend + last + TABLE.tip_angle
    return root, middle, middle + TABLE.tip * np.array([-np.cos(angle), np.sin(angle)])


def gaps(bend, last, centre, radius):
    """Distances of the link and of the tip of finger 3 from a ball in its plane."""
    a, b, c = (np.array([p[0], 0, p[1]]) for p in finger(bend, last))
    link = distances_to_segment(centre[None], a, b)[0] - TABLE.link_radius - radius
    return link, distances_to_segment(centre[None], b, c)[0] - TABLE.radius - radius


def stepped(centre, radius, step=5e-4):
    """Positions of both joints of finger 3 by small steps, and which parts touch."""
    bend = last = 0.0
    while min(gaps(bend, last, centre, radius)) > 0 and bend < TABLE.bend_limit:
        bend += step
        last = TABLE.coupling * bend
    link, tip = gaps(bend, last, centre, radius)
    while tip > 0 and last < TABLE.coupling * TABLE.bend_limit:
        last += step
        tip = gaps(bend, last, centre, radius)[1]
    return bend, last, link <= 0, tip <= 0


@pytest.mark.parametrize(
    ("place", "radius", "is_stopped"),
    [((-0.08, 0.05), 0.02, True), ((-0.08, 0.05), 0.03, True), ((-0.05, 0.09), 0.025, False)],
)
def test_the_last_joint_breaks_away_where_the_link_is_stopped(place, radius, is_stopped):
    centre = np.array([place[0], 0.0, place[1]])
    hand = hand_of_table(BARRETT_OPENRAVE)
    found = close_hand(hand, STILL, np.zeros(4), capsule_obstacle(centre, centre, radius))
    bend, last, link, tip = stepped(centre, radius)
    assert link == is_stopped and tip and np.allclose(found.positions[-2:], [bend, last], atol=1.1e-3)
    for joint, touches in ((6, link), (7, tip)):
        assert (found.touches[hand.parts.carriers == joint] == touches).all()
    # Without the clutch, the finger remains where the link is stopped.
    rigid = replace(hand, breakaway=np.zeros(0, np.intp))
    positions = close_hand(rigid, STILL, np.zeros(4), capsule_obstacle(centre, centre, radius)).positions
    assert np.allclose(positions[-2:], [bend, TABLE.coupling * bend], atol=1.1e-3)


def test_a_closed_hand_touches_a_ball_and_does_not_enter_it():
    hand, centre, radius = hand_of_table(), np.array([-0.005, 0.004, 0.07]), 0.034
    ball = capsule_obstacle(centre, centre, radius)
    found = close_hand(hand, STILL, np.zeros(4), ball)
    assert found.status == ClosingStatus.OK
    touched = ~np.isnan(found.contacts[:, 0])
    assert np.abs(np.linalg.norm(found.contacts[touched] - centre, axis=1) - radius).max(initial=0) < 2e-6
    assert np.allclose(found.normals[touched], (found.contacts[touched] - centre) / radius, atol=1e-4)
    # By the joints and capsules at home, moved joint by joint.
    still = hand.at_home[1].copy()
    for row, carrier in enumerate(hand.parts.carriers):
        joint = int(carrier)
        while joint >= 0:
            direction, moment = pga3.line_to_direction_moment(hand.robot.axes[joint])
            turn, point = Rotation.from_rotvec(found.positions[joint] * direction), np.cross(direction, moment)
            still[row] = turn.apply(still[row] - point) + point
            joint = hand.robot.parents[joint]
    away = [
        distances_to_segment(centre[None], *ends)[0] - r - radius for ends, r in zip(still, hand.radii, strict=True)
    ]
    assert min(away) > -1e-8 and np.array_equal(np.array(away) < 1e-6, found.touches) and found.touches.sum() >= 3


def test_a_gripper_closes_on_both_sides_of_a_box():
    vertices, faces = box(0.04, 0.06, 0.05)
    hand = hand_from_urdf(FRANKA_HAND, torsion=0.003)
    found = close_hand(hand, STILL, [0.04], mesh_obstacle(vertices + np.array([0, 0, 0.1053]), faces))
    assert found.status == ClosingStatus.OK and np.abs(found.positions - 0.03).max() < 1e-6
    assert np.abs(found.contacts - [[0, 0.03, 0.1053], [0, -0.03, 0.1053]]).max() < 1e-6
    assert np.abs(found.normals - [[0, 1, 0], [0, -1, 0]]).max() < 1e-6


def test_a_closing_hand_arrives_at_its_plan():
    # Fingertips arrive up to the depth by which other parts may intersect the object, 1.5 mm, and its samples.
    vertices, faces = box(0.05, 0.07, 0.12)
    grasp = plan_grasps(vertices, faces)[0]
    found = close_hand(hand_of_table(), grasp.motor, grasp.open_joints, mesh_obstacle(vertices, faces))
    assert found.status == ClosingStatus.OK
    bends = found.positions[[1, 4, 6]]
    assert (bends < grasp.joints[1:] + 0.02).all() and (bends > grasp.joints[1:] - 0.1).all()


def test_statuses_of_closing_hands():
    hand, far = hand_from_urdf(FRANKA_HAND, torsion=0.003), capsule_obstacle([0, 0, 1.0], [0, 0, 1.0], 0.01)
    missed = close_hand(hand, STILL, [0.04], far)
    assert missed.status == ClosingStatus.MISSED and np.allclose(missed.positions, 0)
    assert np.isnan(missed.contacts).all() and not missed.touches.any()
    inside = close_hand(hand, STILL, [0.04], capsule_obstacle([0, 0.05, 0.1], [0, 0.05, 0.1], 0.01))
    assert inside.status == ClosingStatus.IN_CONTACT and np.allclose(inside.positions, 0.04)
    # Within a cube of 1 m, all parts are far from the surface; the same cube beside the hand is not touched.
    cube, faces = box(1.0, 1.0, 1.0)
    within = close_hand(hand, STILL, [0.04], mesh_obstacle(cube, faces[:, ::-1]))
    assert within.status == ClosingStatus.IN_CONTACT and within.touches.all() and np.allclose(within.positions, 0.04)
    beside = close_hand(hand, STILL, [0.04], mesh_obstacle(cube + np.array([0.7, 0, 0]), faces))
    assert beside.status == ClosingStatus.MISSED and not beside.touches.any()
    with pytest.raises(ValueError, match="joints"):
        close_hand(hand, STILL, [0.04, 0.04], far)
    with pytest.raises(ValueError, match="joints"):
        close_hand(hand, STILL, [np.nan], far)
    for beyond in (0.0401, -1e-6):
        with pytest.raises(ValueError, match=r"joints: .* at 0 is outside of the limits, 0.0 to 0.04"):
            close_hand(hand, STILL, [beyond], far)
    with pytest.raises(ValueError, match="rotor"):
        close_hand(hand, np.eye(8)[7], [0.04], far)
    # Limits of the hand in single precision, and motors of any length.
    single = np.array([0.81], np.float32)
    assert float(single[0]) > 0.81 and close_hand(TWO_FINGERS, STILL, single, far).positions.max() <= 0.81
    ball = capsule_obstacle([0.5, 0.2, 0.1], [0.5, 0.2, 0.1], 0.02)
    moved = pga3.motor_from_rotation_vector_translation([0.0, 0, 0.3], [0.5, 0.2, 0])
    one, other = (close_hand(hand, motor, [0.04], ball) for motor in (moved, -3 * moved))
    assert one.status == other.status == ClosingStatus.OK and np.allclose(one.positions, other.positions, atol=1e-9)
    with pytest.raises(ValueError, match="follows no joint"):
        hand_from_urdf(FRANKA_HAND, torsion=0.003, breakaway=["slide 1"])
    assert hand_from_urdf(FRANKA_HAND, torsion=0.003, breakaway=["slide 2"]).breakaway.tolist() == [1]
