"""Paths of an arm with a hand: no collisions by an independent model, also between rows, or a status with the cause."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.geometry.meshes import _RAYS as RAYS
from algorithms.geometry.meshes import winding_numbers
from algorithms.grasping import GraspStatus, LoopStatus, guided_grasp, hand_of_table, plan_grasps, scene_obstacles
from algorithms.kinematics import Robot
from algorithms.kinematics.collisions import (
    UR5_CAPSULES,
    ArmCapsules,
    arm_capsules,
    capsule_obstacle,
    mesh_obstacle,
    plane_obstacle,
)
from algorithms.kinematics.collisions.arm_paths import find_path, resampled
from algorithms.kinematics.collisions.clear_motion import is_clear
from algorithms.vision.objects import SceneObject
from generated import collisions, pga3
from tests.support.grasp_scene import FACES, HOME, MODEL, TARGET, VERTICES, motor, scene
from tests.support.grasp_shapes import SHAPES
from tests.support.scan_scene import MOUNT, TABLE, grasps_of, scene_of, standing
from tests.support.scans import NAMES, box, eight, scan, sphere

BARRETT = Path(__file__).parents[1] / "data" / "grasping" / "barrett.npz"


@cache
def parts():
    with np.load(BARRETT) as file:
        return {name: file[name] / 1e5 for name in file.files}


def placed(turn, shift):
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = Rotation.from_euler("xyz", turn).as_matrix(), shift
    return whole


def rotated(angle):
    return placed((0, 0, angle), (0, 0, 0))


def hand_mesh(joints):
    """Return points of the meshes of the hand by the numbers of its URDF file, in the frame of the project."""
    spread, *bends = joints
    found = [(np.eye(4), "palm")]
    for x, sense, bend in ((0.025, -1, bends[0]), (-0.025, 1, bends[1])):
        base = placed((0, 0, -np.pi / 2), (x, 0, 0.0415)) @ rotated(sense * spread)
        first = base @ placed((np.pi / 2, 0, 0), (-0.05, 0, 0.0339)) @ rotated(-bend)
        last = first @ placed((0, 0, 0), (-0.069936, 0.003, 0)) @ rotated(-bend * 0.84 / 2.44)
        found += [(base, "knuckle"), (first, "link"), (last, "tip")]
    first = placed((np.pi / 2, 0, np.pi / 2), (0, -0.05, 0.0754)) @ rotated(-bends[2])
    found += [
        (first, "link"),
        (first @ placed((0, 0, 0), (-0.069936, 0.003, 0)) @ rotated(-bends[2] * 0.84 / 2.44), "tip"),
    ]
    to_hand = np.array([[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, -0.0754], [0, 0, 0, 1]])
    return np.concatenate([parts()[name] @ (to_hand @ m)[:3, :3].T + (to_hand @ m)[:3, 3] for m, name in found])


def ur5_frames(q):
    """Return the matrices of the frames after the joints by the table of the maker."""
    rows = ((0.089459, 0, np.pi / 2), (0, -0.425, 0), (0, -0.39225, 0), (0.10915, 0, np.pi / 2),
            (0.09465, 0, -np.pi / 2), (0.0823, 0, 0))  # fmt: skip
    found = [np.eye(4)]
    for angle, (d, a, alpha) in zip(q, rows, strict=True):
        found.append(found[-1] @ placed((0, 0, angle), (0, 0, d)) @ placed((alpha, 0, 0), (a, 0, 0)))
    return found[1:]


def moved(matrix, points):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def apart(a, b, steps=60):
    """Return the distance of two segments (2, 3) by samples."""
    t = np.linspace(0, 1, steps)[:, None]
    x, y = a[0] + t * (a[1] - a[0]), b[0] + t * (b[1] - b[0])
    return np.linalg.norm(x[:, None] - y, axis=-1).min()


def distances(points, start, end):
    along = end - start
    t = np.clip((points - start) @ along / max(along @ along, 1e-30), 0, 1)
    return np.linalg.norm(points - start - t[:, None] * along, axis=1)


def arm_at(q):
    """Return the axes (c, 2, 3) of the capsules of the UR5 by matrices."""
    homes, frames = ur5_frames(np.zeros(6)), ur5_frames(q)
    return np.array(
        [
            ends if carrier < 0 else moved(frames[carrier] @ np.linalg.inv(homes[carrier]), ends)
            for carrier, ends in zip(UR5_CAPSULES.carriers, UR5_CAPSULES.ends, strict=True)
        ]
    )


def check_path(found, points, others=(), per_row=3, table=True):
    """Check a motion at its rows and between them: points of the object, others, the table, and the arm itself."""
    path = found.path
    shares = np.arange(per_row) / per_row
    dense = np.concatenate([path[:-1, None] + shares[:, None] * np.diff(path, axis=0)[:, None]]).reshape(-1, 6)
    mesh = hand_mesh(found.open_joints)
    mount = np.asarray(pga3.motor_to_matrix(MOUNT))
    for q in np.concatenate([dense, path[-1:]]):
        frames, axes = ur5_frames(q), arm_at(q)
        hand = moved(frames[-1] @ mount, mesh)
        if table:
            assert hand[:, 2].min() > 0
        for (start, end), radius, carrier in zip(axes, UR5_CAPSULES.radii, UR5_CAPSULES.carriers, strict=True):
            if carrier < 0:
                continue
            assert not table or min(start[2], end[2]) > radius
            for cloud in (points, *others):
                assert distances(cloud, start, end).min() > radius - 0.002
            if carrier <= 3:
                assert distances(hand, start, end).min() > radius - 1e-6
        for i, j in ((0, 3), (0, 5), (1, 4), (1, 6), (2, 5), (2, 6), (2, 7), (4, 7)):
            if UR5_CAPSULES.carriers[j] - UR5_CAPSULES.carriers[i] > 1:
                assert apart(axes[i], axes[j]) > UR5_CAPSULES.radii[i] + UR5_CAPSULES.radii[j] - 1e-6


def loop_on_scan(name, seed, **more):
    grasps, target = grasps_of(name)
    truth = standing(scan(name)[0], np.random.default_rng(seed))
    built, model = scene_of(name, truth)
    options = {"mount": MOUNT, "obstacles": [TABLE], "target": target} | more
    return guided_grasp(built.robot, HOME, model, built.render(name, 0.3, seed), grasps, **options), truth


@pytest.mark.slow
def test_a_scan_on_a_table():
    found, truth = loop_on_scan("MustardBottle", 3)
    assert found.status == LoopStatus.OK
    assert np.linalg.norm(found.contacts - pga3.move_point(truth, found.grasp.contacts), axis=1).max() < 1e-3
    check_path(found, pga3.move_point(truth, scan("MustardBottle")[0][::20]), per_row=1)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES[::2])
def test_scans_on_a_table(name):
    found, truth = loop_on_scan(name, NAMES.index(name) % 4)
    assert found.status == LoopStatus.OK
    assert np.linalg.norm(found.contacts - pga3.move_point(truth, found.grasp.contacts), axis=1).max() < 1e-3
    points = pga3.move_point(truth, scan(name)[0])
    check_path(found, points[::5])
    # The fingers close along their paths: no vertex is deep inside a capsule at any moment.
    hand = hand_of_table()
    tool = pga3.motor_product(Robot.named("ur5").forward(found.path[-1]), MOUNT)
    for share in np.linspace(0, 1, 20):
        joints = found.open_joints + share * (found.grasp.joints - found.open_joints)
        ends = pga3.move_point(tool, hand.placed_capsules(joints))
        for (start, end), radius in zip(ends, hand.radii, strict=True):
            assert distances(points, start, end).min() > radius - 0.0025


def test_steps_are_bounded_and_the_arm_arrives():
    found, _ = loop_on_scan("FoamBrick", 1)
    assert found.status == LoopStatus.OK and (found.path[0] == HOME).all()
    assert np.abs(np.diff(found.path, axis=0)).max() < 0.5
    assert np.abs(np.diff(found.path[: found.approach_at + 1], axis=0)).max() < 0.1 + 1e-9
    hands = pga3.motor_product(Robot.named("ur5").forward(found.path[[found.approach_at, -1]]), MOUNT)
    wanted = pga3.motor_product(found.estimate.motor, found.grasp.motor)
    places = pga3.move_point(wanted, np.array([[0, 0, -0.08], [0, 0, 0]]))
    assert np.allclose(pga3.move_point(hands, np.zeros(3)), places, atol=1e-8)


def test_a_wall_in_the_way_is_avoided_or_named():
    truth = motor((0, 0, 0.4), TARGET)
    wall = SceneObject("wall", MODEL, motor((0, 0, 0), (0.2, -0.25, 0.2)), *box(0.02, 0.3, 0.5))
    built = scene(truth, [wall])
    _, views = robot_and_views()
    obstacles = scene_obstacles(built, without="box")
    found = guided_grasp(built.robot, HOME, MODEL, views, plans_of_box(), mount=MOUNT, obstacles=obstacles)
    assert found.status == LoopStatus.OK
    rng = np.random.default_rng(0)
    cloud = pga3.move_point(wall.pose, rng.uniform(-0.5, 0.5, (500, 3)) * [0.02, 0.3, 0.5])
    check_path(found, pga3.move_point(truth, VERTICES), [cloud], per_row=1, table=False)


def still(found):
    return len(found.path) == 1 and (found.path == HOME).all() and np.isnan(found.contacts).all()


@cache
def plans_of_box():
    return plan_grasps(VERTICES, FACES, style=1, count=2)


@cache
def robot_and_views():
    built = scene(motor((0, 0, 0.4), TARGET))
    return built.robot, built.render("box", 0.3)


def looped(obstacles, **more):
    robot, views = robot_and_views()
    return guided_grasp(robot, HOME, MODEL, views, plans_of_box(), mount=MOUNT, obstacles=obstacles, **more)


def test_an_object_in_a_cage_has_no_approach():
    shell = mesh_obstacle(*sphere(0.11), motor((0, 0, 0), TARGET))
    found = looped([shell])
    assert found.status == LoopStatus.COLLISION and still(found)


def test_an_arm_that_touches_something_now_does_not_move():
    elbow = arm_at(HOME)[2].mean(0)
    found = looped([capsule_obstacle(elbow, elbow, 0.05)])
    assert found.status == LoopStatus.COLLISION and still(found)


def test_an_arm_inside_a_body_does_not_move():
    # The surface is far from all links.
    found = looped([mesh_obstacle(*box(4.0, 4.0, 4.0))], trials=0)
    assert found.status == LoopStatus.COLLISION and still(found)


def test_an_arm_that_walls_enclose_has_no_path():
    # The hand is behind the plane x = 0, the object in front of it; only a hole around the base is open.
    sides = [mesh_obstacle(*box(0.02, 2.0, 3.0), motor((0, 0, 0), (0, y, 0))) for y in (-1.25, 1.25)]
    found = looped([*sides, mesh_obstacle(*box(0.02, 4.0, 2.0), motor((0, 0, 0), (0, 0, 1.4)))], trials=8)
    assert found.status == LoopStatus.NO_PATH and still(found)


@pytest.mark.parametrize(
    ("more", "error"),
    [({"margin": -1.0}, ValueError), ({"trials": -1}, ValueError), ({"trials": 1.5}, ValueError)],
)
def test_options_are_checked(more, error):
    with pytest.raises(error):
        looped([], **more)


def test_obstacles_are_checked():
    with pytest.raises(ValueError, match="length 0"):
        plane_obstacle([0, 0, 0], [0, 0, 0])
    with pytest.raises(ValueError, match="finite"):
        plane_obstacle([0, 0, np.nan], [0, 0, 0])
    with pytest.raises(ValueError, match="radius"):
        capsule_obstacle([0, 0, 0], [0, 0, 1], 0.0)
    with pytest.raises(ValueError, match="none"):
        mesh_obstacle(np.zeros((0, 3)), np.zeros((0, 3), int))
    with pytest.raises(ValueError, match="radius"):
        arm_capsules(Robot.named("panda"), -1)
    with pytest.raises(ValueError, match="shapes"):
        ArmCapsules(np.array([0]), np.zeros((2, 2, 3)), np.ones(1))


def test_capsules_of_the_hand_contain_its_meshes():
    hand = hand_of_table()
    for joints in ([0, 0, 0, 0], [0.7, 0.4, 1.2, 2.0], [3.1, 2.4, 0.3, 1.0]):
        ends = hand.placed_capsules(joints)
        mesh = hand_mesh(joints)
        outside = np.min([distances(mesh, *e) - r for e, r in zip(ends, hand.radii, strict=True)], axis=0)
        assert outside.max() < 0.003


@pytest.mark.parametrize("name", ["ur5", "panda", "iiwa", "puma560"])
def test_capsules_between_joint_frames_are_rigid(name):
    robot = Robot.named(name)
    found = arm_capsules(robot, 0.05)
    assert (np.diff(found.carriers) >= 0).all() and np.allclose(found.ends[1:, 0], found.ends[:-1, 1])
    assert np.allclose(found.ends[-1, 1], pga3.move_point(robot.tool, np.zeros(3)))


def test_clearances_of_capsules():
    rng = np.random.default_rng(0)
    p, q, r, s = rng.normal(size=(4, 80, 3))
    q[:20], s[10:30] = p[:20], r[10:30]
    q[30:40] = p[30:40] + 2 * (s[30:40] - r[30:40])
    found = collisions.capsule_pair_clearance(p, q, r, s, 0.0)
    sampled = [apart((p[k], q[k]), (r[k], s[k]), 200) for k in range(80)]
    assert (found <= np.array(sampled) + 1e-12).all() and np.abs(found - sampled).max() < 0.02


def test_clearances_of_triangles_are_exact():
    # A capsule through a face, one beside an edge, one above a corner, and one that is parallel to a face.
    vertices, faces = box(2.0, 2.0, 2.0)
    cases = [((0, 0, 0.5), (0, 0, 3), 0), ((2, 2, -3), (2, 2, 3), np.sqrt(2)), ((2, 2, 2), (3, 3, 3), np.sqrt(3)),
             ((-0.5, 0.2, 1.3), (0.4, 0.3, 1.3), 0.3), ((0, 0, 0), (0.1, 0, 0), 0.9)]  # fmt: skip
    for start, end, distance in cases:
        ends = np.array([start, end], float)
        assert np.isclose(mesh_obstacle(vertices, faces).clearance(ends, np.array(0.1)), distance - 0.1)
    fine = SHAPES["box sugar"]()
    obstacle = mesh_obstacle(*fine, motor((0.3, 0.2, 0.1), (0.1, 0.2, 0.3)))
    rng = np.random.default_rng(1)
    ends = pga3.move_point(obstacle.pose, rng.uniform(-0.15, 0.15, (300, 2, 3)))
    coarse = mesh_obstacle(*box(0.038, 0.089, 0.175), obstacle.pose)
    found, exact = obstacle.clearance(ends, np.full(300, 0.01)), coarse.clearance(ends, np.full(300, 0.01))
    assert (found <= exact + 1e-12).all() and np.allclose(found[exact < 0.003], exact[exact < 0.003])
    inside = coarse.contains(np.concatenate([ends[:, 0], ends[:, 1]]))
    local = pga3.move_point_back(obstacle.pose, np.concatenate([ends[:, 0], ends[:, 1]]))
    assert np.array_equal(inside, (np.abs(local) < [0.019, 0.0445, 0.0875]).all(1))


def solid_angles(points, triangles):
    """Return the solid angles of a mesh from points, in full spheres, by the formula of Van Oosterom and Strackee."""
    corners = triangles - points[:, None, None]
    a, b, c = np.moveaxis(corners, 2, 0)
    x, y, z = np.moveaxis(np.linalg.norm(corners, axis=-1), 2, 0)
    below = x * y * z + (a * b).sum(-1) * z + (b * c).sum(-1) * x + (c * a).sum(-1) * y
    return np.arctan2((a * np.cross(b, c)).sum(-1), below).sum(1) / (2 * np.pi)


def test_points_in_several_solids_and_in_a_surface_that_intersects_itself():
    rng = np.random.default_rng(3)
    bar, ball = box(2.0, 0.5, 0.5), sphere(0.5)
    both = np.concatenate([bar[0], ball[0] + np.array([0.3, 0.1, 0])])
    solids = both, np.concatenate([bar[1], ball[1] + len(bar[0])])
    for vertices, corners in (solids, eight(1.0, 0.2)):
        triangles = vertices[corners]
        points = rng.uniform(vertices.min(0), vertices.max(0), (150, 3))
        turns = solid_angles(points, triangles)
        assert np.allclose(turns, winding_numbers(points, vertices, corners), atol=1e-9) and turns.max() > 1.5
        for order in (corners, corners[:, ::-1]):
            assert np.array_equal(mesh_obstacle(vertices, order).contains(points), turns > 0.5)


def test_rays_through_edges_are_counted_once():
    vertices, faces = box(2.0, 2.0, 2.0)
    triangles = vertices[faces]
    rng = np.random.default_rng(4)
    share, far = rng.random((100, 1)), rng.uniform(0.01, 4, (100, 1))
    for ray in RAYS:
        start, end, _ = triangles[rng.integers(len(faces), size=100)].swapaxes(0, 1)
        points = start + share * (end - start) - far * ray
        assert np.array_equal(
            winding_numbers(points, vertices, faces),
            (np.abs(points) < 1).all(1),
        )


def test_a_thin_wall_between_two_samples_is_found():
    def clearances(q):
        return np.abs(q - 0.5) - 0.001

    assert not is_clear(np.array([[0.0], [1.0]]), clearances, np.ones((1, 1)))
    assert is_clear(np.array([[0.0], [0.4]]), clearances, np.ones((1, 1)))


def test_paths_around_a_disc():
    def free(path):
        return is_clear(path, lambda q: np.linalg.norm(q, axis=-1, keepdims=True) - 1, np.full((1, 2), 1.0))

    start, goal = np.array([-2.0, 0.1]), np.array([2.0, 0.0])
    limits = np.array([[-3.0, 3], [-3, 3]])
    path = find_path(start, goal, limits, free, 500)
    assert (path[0] == start).all() and (path[-1] == goal).all() and free(path)
    rows = resampled(path, 0.05)
    assert np.abs(np.diff(rows, axis=0)).max() <= 0.05 + 1e-9 and np.linalg.norm(rows, axis=1).min() > 1
    assert np.array_equal(find_path(start, goal, limits, free, 500), path)
    assert find_path(start, goal, limits, free, 0) is None
    closed = find_path(np.zeros(2), goal, limits, lambda p: free(p) or np.linalg.norm(p, axis=1).max() < 0.5, 30)
    assert closed is None


def test_grasps_beside_a_table_are_above_it():
    vertices, faces = scan("MustardBottle")
    height = vertices[:, 2].min()
    table = plane_obstacle([0, 0, 1], [0, 0, height])
    plan = plan_grasps(vertices, faces, style=1, obstacles=[table])
    assert plan.status == GraspStatus.OK
    for grasp in plan:
        for joints in (grasp.joints, grasp.open_joints):
            assert pga3.move_point(grasp.motor, hand_mesh(joints))[:, 2].min() > height
    buried = plane_obstacle([0, 0, 1], [0, 0, vertices[:, 2].max() + 0.1])
    assert plan_grasps(vertices, faces, style=1, obstacles=[buried]).status == GraspStatus.COLLISION
