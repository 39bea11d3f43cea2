"""Plans of grasps: contacts on the object, wrenches, joints, poses, against closed forms and scipy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from selection import some_slow

from algorithms.grasping import BARRETT_OPENRAVE, GraspStatus, plan_grasps
from benchmarks.force_closure import distances_to_segment, is_closed_by_forces
from generated import pga3
from tests.support.scans import NAMES, box, cylinder, scan, sphere, torus

OK = GraspStatus.OK


def distances_to_mesh(points, vertices, faces):
    """Return the distances of points from triangles by projection, clamped to edges and corners."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    found = []
    for p in points:
        normal = np.cross(b - a, c - a)
        size = np.linalg.norm(normal, axis=1)
        with np.errstate(all="ignore"):
            inside = np.ones(len(a), bool)
            for q, r in ((a, b), (b, c), (c, a)):
                inside &= (np.cross(r - q, p - q) * normal).sum(1) >= 0
            flat = np.where(inside, np.abs(((p - a) * normal).sum(1)) / size, np.inf)
        best = np.nanmin(flat)
        for q, r in ((a, b), (b, c), (c, a)):
            d = r - q
            t = np.clip(((p - q) * d).sum(1) / np.maximum((d * d).sum(1), 1e-30), 0, 1)
            best = min(best, np.linalg.norm(p - q - t[:, None] * d, axis=1).min())
        found.append(best)
    return np.array(found)


def check(plan, vertices, faces, friction=0.5):
    limits = plan.hand.limits
    for grasp in plan:
        assert grasp.status == OK
        assert distances_to_mesh(grasp.contacts, vertices, faces).max() < 1e-9
        assert np.allclose(np.linalg.norm(grasp.normals, axis=1), 1)
        assert is_closed_by_forces(grasp.contacts, grasp.normals, plan.hand.torsion, friction)
        assert (limits[:, 0] <= grasp.joints).all() and (grasp.joints <= limits[:, 1]).all()
        tips = pga3.move_point(grasp.motor, plan.hand.fingertips(grasp.joints)[grasp.fingers])
        radii = plan.hand.tips.radii[grasp.fingers, None]
        assert np.abs(tips - grasp.contacts - radii * grasp.normals).max() < 1e-6
        # No vertex is inside the hand.
        ends = pga3.move_point(grasp.motor, plan.hand.placed_capsules(grasp.joints))
        for (p, q), r in zip(ends, plan.hand.radii, strict=True):
            assert distances_to_segment(vertices, p, q).min() > r - 0.003
    qualities = [grasp.quality for grasp in plan]
    assert qualities == sorted(qualities, reverse=True) and qualities[-1] > 0


def one_style_of_each(names):
    """Names with all styles, of which one is quick for each name, in turn."""
    quick = [(name, 1 + k % 3) for k, name in enumerate(names)]
    cases = [(name, style) for name in names for style in (1, 2, 3)]
    return pytest.mark.parametrize(("name", "style"), some_slow(cases, *(case for case in cases if case not in quick)))


@one_style_of_each(NAMES)
def test_scans(name, style):
    vertices, faces = scan(name)
    check(plan_grasps(vertices, faces, style), vertices, faces)


SHAPES = {
    "sphere": sphere(0.04),
    "box": box(0.05, 0.07, 0.12),
    "cube": box(0.06, 0.06, 0.06),
    "cylinder": cylinder(0.035, 0.11),
    "torus": torus(0.05, 0.015),
}


@one_style_of_each(SHAPES)
def test_shapes(name, style):
    vertices, faces = SHAPES[name]
    check(plan_grasps(vertices, faces, style), vertices, faces)


def test_second_model_of_the_hand():
    vertices, faces = scan("TomatoSoupCan")
    check(plan_grasps(vertices, faces, 1, hand=BARRETT_OPENRAVE), vertices, faces)


@pytest.mark.parametrize("style", [1, 2, 3])
def test_grasps_move_with_the_object(style):
    vertices, faces = scan("Banana")
    rng = np.random.default_rng(style)
    first = plan_grasps(vertices, faces, style)
    turn, shift = Rotation.random(random_state=rng).as_matrix(), rng.uniform(-1, 1, 3)
    second = plan_grasps(vertices @ turn.T + shift, faces, style)
    assert len(first) == len(second)
    for a, b in zip(first, second, strict=True):
        assert np.allclose(b.contacts, a.contacts @ turn.T + shift, atol=1e-8)
        assert np.allclose(a.joints, b.joints, atol=1e-5) and abs(a.quality - b.quality) < 1e-8


def test_normals_of_a_mesh_turned_inside_out():
    vertices, faces = scan("FoamBrick")
    plan = plan_grasps(vertices, faces[:, ::-1])
    check(plan, vertices, faces)


@pytest.mark.parametrize("name", ["sphere", "cube", "cylinder", "torus"])
def test_grasps_of_symmetric_shapes_move_with_them(name):
    vertices, faces = SHAPES[name]
    turn, shift = Rotation.random(random_state=7).as_matrix(), np.array([0.3, 0.2, -0.5])
    first, second = plan_grasps(vertices, faces), plan_grasps(vertices @ turn.T + shift, faces)
    assert np.isclose(second[0].quality, first[0].quality, rtol=1e-6)
    assert np.allclose(second[0].contacts, first[0].contacts @ turn.T + shift, atol=1e-6)
