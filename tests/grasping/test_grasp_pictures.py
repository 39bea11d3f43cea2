"""Pictures of grasps."""

import numpy as np
import pytest

from algorithms.grasping import GraspStatus, plan_grasps
from tests.support.scans import box

pictures = pytest.importorskip("algorithms.grasping.pictures", exc_type=ImportError)


def test_the_circle_passes_through_the_contacts():
    contacts = np.random.default_rng(0).normal(size=(3, 3))
    points = pictures.circle_of_contacts(contacts, 4000)
    gaps = np.linalg.norm(points[:, None] - contacts, axis=-1).min(0)
    assert gaps.max() < 0.01


def test_a_grasp_is_drawn_with_its_contacts_and_cones():
    vertices, faces = box(0.05, 0.07, 0.12)
    plan = plan_grasps(vertices, faces)
    axes = pictures.plot_grasp(vertices, faces, plan[0], plan.hand)
    drawn = np.stack(axes.collections[-1]._offsets3d, -1)
    assert np.allclose(np.asarray(drawn, float), plan[0].contacts)
    # Capsules of the fingers and the palm, the circle, and eight edges of three cones.
    assert len(axes.lines) == len(plan.hand.radii) + 1 + 24


def test_without_a_grasp_only_the_object_is_drawn():
    vertices, faces = box(0.6, 0.6, 0.6)
    plan = plan_grasps(vertices, faces)
    axes = pictures.plot_grasp(vertices, faces, plan[0], plan.hand)
    assert not axes.lines and GraspStatus.TOO_LARGE.name in axes.get_title()
