"""The hand of the maker's own description, compared with Pinocchio and with our text of it."""

import warnings

import numpy as np
import pytest

from algorithms.grasping import ALLEGRO, GraspStatus, hand_from_urdf, plan_grasps
from algorithms.kinematics.errors import InertiaWarning
from benchmarks.force_closure import is_closed_by_forces
from tests.peers.test_robots_peers import described
from tests.support.scans import cylinder

pinocchio = pytest.importorskip("pinocchio")
pytestmark = pytest.mark.peers


@pytest.fixture(scope="module")
def allegro():
    path = str(described("urdf/allegro_right_hand.urdf"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        return path, hand_from_urdf(path, approach=[1, 0, 0])


def test_fingertips_are_those_of_pinocchio(allegro):
    path, hand = allegro
    model = pinocchio.buildModelFromUrdf(path)
    data, own = model.createData(), hand_from_urdf(ALLEGRO, approach=[1, 0, 0])
    order = [model.joints[model.getJointId(name)].idx_q for name in hand.robot.joint_names]
    for q in np.random.default_rng(0).uniform(*hand.limits.T, (10, 16)):
        theirs = np.zeros(16)
        theirs[order] = q
        pinocchio.framesForwardKinematics(model, data, theirs)
        names = "link_3.0_tip", "link_7.0_tip", "link_11.0_tip", "link_15.0_tip"
        tips = [data.oMf[model.getFrameId(name)].translation for name in names]
        assert np.abs(hand.fingertips(q) - tips).max() < 1e-12
        # Our text has rounded angles.
        assert np.abs(own.fingertips(q) - tips).max() < 1e-8


def test_the_hand_of_the_maker_holds_a_can(allegro):
    _, hand = allegro
    plan = plan_grasps(*cylinder(0.035, 0.11), hand=hand)
    assert plan.status == GraspStatus.OK
    for grasp in plan:
        assert is_closed_by_forces(grasp.contacts, grasp.normals)
