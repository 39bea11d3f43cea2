"""Objects that a hand cannot hold, and arguments that are no objects."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.grasping import (
    BARRETT_BH280,
    GraspStatus,
    contact_wrenches,
    grasp_quality,
    hand_of_table,
    plan_grasps,
)
from algorithms.grasping.meshes import surface_of
from benchmarks.evidence_objects import deepest, furniture, placed_boxes
from generated import pga3
from tests.support.all_cases import all_cases
from tests.support.scans import box, scan, sphere

BOX = box(0.05, 0.07, 0.12)


@all_cases(
    "mesh, status",
    [
        (box(0.6, 0.6, 0.6), GraspStatus.TOO_LARGE),
        (sphere(3.0), GraspStatus.TOO_LARGE),
        (box(0.05, 0.07, 0.0005), GraspStatus.TOO_THIN),
        (box(0.05, 0.07, 0.0), GraspStatus.TOO_THIN),
        (box(0.002, 0.002, 0.002), GraspStatus.TOO_THIN),
        ((BOX[0], BOX[1][1:]), GraspStatus.OPEN_MESH),
        ((BOX[0], np.concatenate([BOX[1][:1, ::-1], BOX[1][1:]])), GraspStatus.OPEN_MESH),
        ((scan("Banana")[0], scan("Banana")[1][:-40]), GraspStatus.OPEN_MESH),
        ((BOX[0], np.zeros((0, 3), int)), GraspStatus.EMPTY),
        ((np.zeros((0, 3)), np.zeros((0, 3), int)), GraspStatus.EMPTY),
        ((BOX[0], BOX[1][:, [0, 0, 1]]), GraspStatus.EMPTY),
        ((np.zeros((8, 3)), BOX[1]), GraspStatus.TOO_THIN),
    ],
)
@all_cases("style", [1, 2, 3])
def test_the_status_names_the_cause_and_the_hand_does_not_move(mesh, status, style):
    plan = plan_grasps(*mesh, style)
    assert plan.status == status and len(plan) == 1
    (grasp,) = plan
    assert grasp.quality == 0 and np.array_equal(grasp.motor, np.eye(8)[0]) and not grasp.joints.any()
    assert np.isnan(grasp.contacts).all()


def test_a_smooth_box_slips():
    # Three contacts without friction never resist all torques.
    assert plan_grasps(*BOX, friction=1e-6).status in (GraspStatus.NO_FORCE_CLOSURE, GraspStatus.NO_CONTACTS)


def test_degenerate_faces_and_separate_vertices_change_nothing():
    vertices, faces = BOX
    expected = plan_grasps(vertices, faces)
    with_slivers = plan_grasps(vertices, np.concatenate([faces, [[0, 0, 1], [5, 5, 5]]]))
    assert np.allclose(with_slivers[0].contacts, expected[0].contacts, atol=1e-12)
    soup = plan_grasps(vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3))
    assert soup.status == GraspStatus.OK and np.isclose(soup[0].quality, expected[0].quality, rtol=0.3)


def test_contacts_are_on_the_outside_of_all_solids():
    # A long bar through a ball, whose halves outside of it are larger than those inside.
    for shift in (0.0, 0.02, 0.04):
        bar, ball = box(0.14, 0.03, 0.03), sphere(0.032)
        vertices = np.concatenate([bar[0], ball[0] + [shift, 0.01, 0]])
        for style in (1, 2, 3):
            plan = plan_grasps(vertices, np.concatenate([bar[1], ball[1] + len(bar[0])]), style)
            for grasp in plan:
                assert grasp.status == GraspStatus.OK
                inside_bar = (np.abs(grasp.contacts) < np.array([0.07, 0.015, 0.015]) - 1e-6).all(1)
                inside_ball = np.linalg.norm(grasp.contacts - [shift, 0.01, 0], axis=1) < 0.99 * 0.032
                assert not (inside_bar | inside_ball).any()


def test_the_hand_does_not_enter_boards_with_large_faces():
    held = 0
    for seed in range(24):
        rng = np.random.default_rng([4, seed])
        boxes, turn = furniture(rng), Rotation.random(random_state=seed).as_matrix()
        plan = plan_grasps(*placed_boxes(boxes, turn, np.ones(3)), 1 + seed % 3)
        for grasp in plan if plan.status == GraspStatus.OK else ():
            held += 1
            assert deepest(grasp, plan.hand, boxes, turn, np.ones(3)) < 0.002
    assert held > 15


def test_the_outside_of_two_balls():
    one, two = sphere(0.03), sphere(0.02)
    faces = np.concatenate([one[1], two[1] + len(one[0])])
    surface = surface_of(np.concatenate([one[0], two[0] + [0.03, 0, 0]]), faces)
    places = np.asarray(pga3.move_point(surface.frame, surface.points))
    outer = surface.is_outer(places, pga3.move_direction(surface.frame, surface.normals))
    far = np.linalg.norm(places, axis=1), np.linalg.norm(places - [0.03, 0, 0], axis=1)
    # Half a millimetre, since a mesh is smaller than its ball.
    hidden = (far[0] < 0.0295) | (far[1] < 0.0195)
    clear = (far[0] > 0.0305) | (far[1] > 0.0205)
    assert not outer[hidden].any() and outer[clear & ~hidden].all()
    assert hidden.sum() > 500 and len(surface.outside().points) == outer.sum()


@all_cases("away", [1e3, 1e6])
def test_objects_far_from_the_origin_are_held(away):
    vertices, faces = box(0.04, 0.06, 0.1)
    plan = plan_grasps(vertices + away, faces)
    assert plan.status == GraspStatus.OK
    apart = np.abs(plan[0].contacts - away) - np.array([0.02, 0.03, 0.05])
    assert np.abs(apart.max(1)).max() < 1e-9 * away


def test_unused_vertices_do_not_matter():
    vertices, faces = BOX
    plan = plan_grasps(np.concatenate([vertices, [[9.0, 9, 9]]]), faces)
    assert plan.status == GraspStatus.OK
    assert np.isclose(plan[0].quality, plan_grasps(vertices, faces)[0].quality)


@all_cases(
    "arguments, error, text",
    [
        ((BOX[0] * np.nan, BOX[1]), ValueError, "finite"),
        ((BOX[0] * np.inf, BOX[1]), ValueError, "finite"),
        ((BOX[0][:, :2], BOX[1]), ValueError, "shape"),
        ((BOX[0], BOX[1][:, :2]), ValueError, "three integers"),
        ((BOX[0], BOX[1] + 1), ValueError, "expected 0 to 7"),
        ((BOX[0], BOX[1] - 1), ValueError, "expected 0 to 7"),
        ((BOX[0], BOX[1] * 1.0), TypeError, "integers"),
        ((BOX[0][None], BOX[1]), ValueError, "one mesh"),
        (("a", BOX[1]), TypeError, "real numbers"),
        ((*BOX, 4), ValueError, "style"),
        ((*BOX, True), ValueError, "style"),
        ((*BOX, [1, 2]), ValueError, "style"),
    ],
)
def test_arguments(arguments, error, text):
    with pytest.raises(error, match=text):
        plan_grasps(*arguments)


@all_cases(
    "options, error",
    [
        ({"friction": 0}, ValueError),
        ({"friction": np.nan}, ValueError),
        ({"friction": "0.5"}, TypeError),
        ({"edges": 2}, ValueError),
        ({"count": 0}, ValueError),
        ({"count": 1.5}, ValueError),
        ({"hand": "barrett"}, TypeError),
    ],
)
def test_options(options, error):
    with pytest.raises(error):
        plan_grasps(*BOX, **options)


def test_tables_are_checked():
    from dataclasses import replace

    for change in ({"link": -0.07}, {"tip": np.nan}, {"radius": 0.0}):
        with pytest.raises(ValueError, match="hand_of_table"):
            hand_of_table(replace(BARRETT_BH280, **change))


def test_wrenches_are_checked():
    three = np.eye(3)
    with pytest.raises(ValueError, match="length 0"):
        contact_wrenches(three, np.zeros((3, 3)))
    with pytest.raises(ValueError, match="shapes"):
        contact_wrenches(three, three[:2])
    with pytest.raises(ValueError, match="friction"):
        contact_wrenches(three, three, friction=-1)
    with pytest.raises(ValueError, match="edges"):
        contact_wrenches(three, three, edges=2)
    with pytest.raises(ValueError, match="length"):
        grasp_quality(three, three, length=0)
