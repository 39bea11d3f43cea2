"""Wrenches, qualities and the kinematics of hands, against closed forms, scipy and another model."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from algorithms.geometry.meshes import checked_mesh
from algorithms.grasping import BARRETT_BH280, BARRETT_OPENRAVE, contact_wrenches, grasp_quality, hand_of_table
from algorithms.grasping.meshes import surface_of
from algorithms.kinematics.hands import barrett_hand
from generated import grasping, pga3
from tests.support.all_cases import all_cases
from tests.support.grasp_shapes import SHAPES
from tests.support.scans import box, scan, sphere


def ring(count=3):
    angles = 2 * np.pi * np.arange(count) / count
    return np.stack([np.cos(angles), np.sin(angles), 0 * angles], -1)


def test_wrenches_are_forces_with_their_moments():
    rng = np.random.default_rng(0)
    p, n, centre = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)), rng.normal(size=3)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    lines = contact_wrenches(p, n, 0.3, 7, centre)
    direction, moment = pga3.line_to_direction_moment(lines)
    # The force is in the cone, with a unit normal component, and the moment is that about the centre.
    assert np.allclose((direction * n[:, None]).sum(-1), -1)
    assert np.allclose(np.linalg.norm(direction + n[:, None], axis=-1), 0.3)
    assert np.allclose(moment, np.cross((p - centre)[:, None], direction))


def test_quality_by_a_linear_programme():
    # The quality is the least support of the wrenches: no direction can have a lower one.
    contacts, normals = ring() * 0.04, ring()
    quality = grasp_quality(contacts, normals, length=0.05)
    rows = contact_wrenches(contacts, normals).reshape(-1, 6) / [1, 1, 1, 0.05, 0.05, 0.05]
    directions = np.random.default_rng(1).normal(size=(20000, 6))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    supports = (directions @ rows.T).max(1)
    assert 0 < quality <= supports.min()
    # The ball is inside the hull: each of its points is a convex combination.
    for d in directions[:40]:
        found = linprog(
            np.zeros(len(rows)), A_eq=np.vstack([rows.T, np.ones(len(rows))]), b_eq=np.r_[0.999 * quality * d, 1.0]
        )
        assert found.success


@pytest.mark.parametrize("name", ["box large", "die 16", "can tuna", "ball 33"])
def test_quality_by_a_hull_with_merged_facets(name):
    # Facets of regular shapes lie in one plane up to rounding errors, for which the default options of Qhull are made.
    surface = surface_of(*checked_mesh(*SHAPES[name](), "shape"))
    rng = np.random.default_rng(3)
    positive = 0
    for row in rng.choice(len(surface.points), (15, 3)):
        contacts, normals = surface.points[row], surface.normals[row]
        scaled = contact_wrenches(contacts, normals).reshape(-1, 6) / np.array([1, 1, 1, *[surface.length] * 3])
        try:
            expected = max(0.0, -ConvexHull(scaled).equations[:, -1].max())
        except QhullError:
            expected = 0.0
        assert abs(grasp_quality(contacts, normals, length=surface.length) - expected) < 1e-12
        positive += expected > 1e-6
    assert positive > 0


def test_quality_does_not_depend_on_the_frame():
    contacts, normals = ring() * 0.04, ring()
    turn = Rotation.random(random_state=3).as_matrix()
    moved = contacts @ turn.T + [1, 2, 3]
    expected = grasp_quality(contacts, normals, edges=16, length=0.05)
    assert np.isclose(
        grasp_quality(moved, normals @ turn.T, edges=16, centre=(1, 2, 3), length=0.05), expected, rtol=0.03
    )


@all_cases(
    "contacts, normals",
    [
        (ring() * 0.04, np.tile([1.0, 0, 0], (3, 1))),
        (np.zeros((3, 3)), ring()),
        (ring()[:2], ring()[:2]),
        (ring() * 0.04, np.tile([0.0, 0, 1], (3, 1))),
    ],
)
def test_no_force_closure(contacts, normals):
    assert grasp_quality(contacts, normals) == 0


def test_bounds_are_above_the_quality():
    rng = np.random.default_rng(2)
    contacts = rng.normal(size=(200, 3, 3))
    contacts /= np.linalg.norm(contacts, axis=-1, keepdims=True)
    twists = rng.normal(size=(64, 6))
    twists /= np.linalg.norm(twists, axis=1, keepdims=True)
    rough = grasping.quality_bound(contacts, contacts, 0.5, twists)
    shares = 0.5 * 0.965 ** np.arange(100)
    fine = grasping.refined_bound(contacts, contacts, 0.5, twists, shares)
    best = np.argsort(-fine)[:20]
    contacts, rough, fine = contacts[best], rough[best], fine[best]
    exact = np.array([grasp_quality(c, c, edges=12) for c in contacts])
    closed = exact > 0
    assert closed.sum() >= 10
    # A cone with 12 edges is a little smaller than the round one.
    assert (rough[closed] >= exact[closed]).all() and (fine[closed] >= exact[closed]).all()
    assert np.median(fine[closed] / exact[closed]) < 1.4


def test_moments_of_solids():
    for (vertices, faces), volume, square in (
        (box(0.1, 0.2, 0.3), 0.006, 0.006 * np.array([0.1, 0.2, 0.3]) ** 2 / 12),
        (sphere(1.0), 4 / 3 * np.pi, np.full(3, 4 / 15 * np.pi)),
    ):
        areas, found, first, second = grasping.mesh_moments(vertices, *np.ascontiguousarray(faces.T))
        tolerance = 0.03 if len(vertices) > 8 else 1e-12
        assert np.isclose(found, volume, rtol=tolerance) and np.allclose(first, 0, atol=1e-12)
        assert np.allclose(second[[0, 3, 5]], square, rtol=2 * tolerance) and np.allclose(areas.sum(0), 0, atol=1e-12)


def test_fingertips_of_the_first_model():
    hand, robot = hand_of_table(BARRETT_OPENRAVE), barrett_hand()
    for q in np.random.default_rng(4).uniform(0, 2, (20, 4)):
        tips = [pga3.move_point(robot.link(f"tip {k}", q), np.zeros(3)) for k in (1, 2, 3)]
        assert np.allclose(hand.fingertips(q), tips, atol=1e-12)


def test_fingertips_of_the_second_model():
    # The chain of the published URDF for finger 1: its joint frames, in the frame of the base.
    def frame(place, angles):
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = Rotation.from_euler("xyz", angles).as_matrix(), place
        return matrix

    def turned(axis, angle):
        return frame([0, 0, 0], np.array(axis) * angle)

    spread, bend = 0.7, 1.1
    half = np.pi / 2
    chain = frame([0.025, 0, 0.0415], [0, 0, -half]) @ turned([0, 0, -1], spread)
    chain = chain @ frame([-0.05, 0, 0.0339], [half, 0, 0]) @ turned([0, 0, -1], bend)
    chain = chain @ frame([-0.069936, 0.003, 0], [0, 0, 0]) @ turned([0, 0, -1], bend * 0.84 / 2.44)
    tip = (chain @ [-0.0382, 0.0308, 0, 1])[:3]
    own = hand_of_table(BARRETT_BH280).fingertips([spread, bend, 0, 0])
    # Its base is turned about z, and finger 1 is on the other side: compare distances from axis, palm and middle plane.
    expected = [abs(tip[0]), abs(tip[1]), tip[2] - 0.0754]
    assert any(np.allclose([abs(p[1]), abs(p[0]), p[2]], expected, atol=2e-4) for p in own[:2])


def test_fingertips_form_the_given_triangle():
    hand = hand_of_table()
    rng = np.random.default_rng(5)
    q = rng.uniform([0.2, 0.4, 0.4, 0.4], [1.5, 1.4, 1.4, 1.4], (200, 4))

    def sides(p):
        return np.linalg.norm(p - np.roll(p, -1, -2), axis=-1)

    wanted = sides(hand.fingertips(q))
    start = q + rng.normal(0, 0.2, q.shape)
    found, _ = hand.preshapes[0].solve(start, wanted)
    error = np.abs(sides(hand.fingertips(found)) - wanted).max(1)
    assert (error < 1e-9).mean() > 0.95
    assert (found >= hand.limits[:, 0]).all() and (found <= hand.limits[:, 1]).all()


def test_clearance_of_a_sphere_and_a_capsule():
    vertices, _ = sphere(0.05)
    found = grasping.capsule_clearance(vertices, [[0.2, 0, 0], [0.2, 0, -1]], [[0.2, 0, 0], [0.2, 0, 1]], [0.03, 0.03])
    assert np.allclose(found, 0.2 - 0.05 - 0.03, atol=1e-6)


def test_scans_are_closed():
    from algorithms.grasping.meshes import is_closed

    assert is_closed(scan("Banana")[1]) and not is_closed(scan("Banana")[1][1:])
