"""Hands of URDF texts: their kinematics, and their grasps by independent checks of contacts, forces and collisions."""

from functools import cache
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from selection import some_slow

from algorithms.grasping import (
    ALLEGRO,
    BARRETT_BH280,
    BARRETT_OPENRAVE,
    FRANKA_HAND,
    ROBOTIQ_2F_85,
    GraspStatus,
    LoopStatus,
    contact_forces,
    grasp_quality,
    guided_grasp,
    hand_from_urdf,
    hand_of_table,
    plan_grasps,
)
from algorithms.kinematics.collisions import capsules_from_urdf, mesh_obstacle, plane_obstacle
from benchmarks.force_closure import distances_to_segment, is_closed_by_forces
from generated import pga3
from tests.support.all_cases import all_cases
from tests.support.grasp_scene import FACES, HOME, MODEL, MOUNT, VERTICES, pose, scene
from tests.support.grasp_shapes import SHAPES
from tests.support.scans import box, cylinder, sphere, torus

SOFT = 0.003
"""The largest torque of a gripper's pad for a force of 1, in metres."""


@cache
def hand(name):
    match name:
        case "bh280":
            return hand_of_table(BARRETT_BH280)
        case "openrave":
            return hand_of_table(BARRETT_OPENRAVE)
        case "franka":
            return hand_from_urdf(FRANKA_HAND, torsion=SOFT)
        case "robotiq":
            return hand_from_urdf(ROBOTIQ_2F_85, torsion=SOFT)
        case "allegro":
            return hand_from_urdf(ALLEGRO, approach=[1, 0, 0])


HANDS = "bh280", "openrave", "franka", "robotiq", "allegro"
TEXTS = {"franka": FRANKA_HAND, "robotiq": ROBOTIQ_2F_85, "allegro": ALLEGRO}


def frame(element):
    matrix = np.eye(4)
    if element is not None:
        numbers = [np.array(element.get(key, "0 0 0").split(), float) for key in ("xyz", "rpy")]
        matrix[:3, 3], matrix[:3, :3] = numbers[0], Rotation.from_euler("xyz", numbers[1]).as_matrix()
    return matrix


def chain(text, positions):
    """Return the poses (4, 4) of all links, from the elements of the text and the position of each leading joint."""
    root = ElementTree.fromstring(text)
    poses = {root.find("link").get("name"): np.eye(4)}
    for joint in root.findall("joint"):
        mimic, moved = joint.find("mimic"), np.eye(4)
        leader = joint.get("name") if mimic is None else mimic.get("joint")
        factor = 1.0 if mimic is None else float(mimic.get("multiplier"))
        axis = np.array(joint.find("axis").get("xyz").split(), float)
        if joint.get("type") == "revolute":
            moved[:3, :3] = Rotation.from_rotvec(factor * positions[leader] * axis).as_matrix()
        elif joint.get("type") == "prismatic":
            moved[:3, 3] = factor * positions[leader] * axis
        before = poses[joint.find("parent").get("link")]
        poses[joint.find("child").get("link")] = before @ frame(joint.find("origin")) @ moved
    return poses


@pytest.mark.parametrize("name", TEXTS)
def test_fingertips_by_matrices(name):
    root = ElementTree.fromstring(TEXTS[name])
    leaders = [j.get("name") for j in root.findall("joint") if j.get("type") != "fixed" and j.find("mimic") is None]
    tips = [link.get("name") for link in root.findall("link") if link.find("collision/geometry/sphere") is not None]
    ours = hand(name)
    assert len(tips) == len(ours.tips.radii) == (4 if name == "allegro" else 2)
    for q in np.random.default_rng(1).uniform(*ours.limits.T, (10, len(leaders))):
        poses = chain(TEXTS[name], dict(zip(leaders, q, strict=True)))
        assert np.abs(ours.fingertips(q) - [poses[tip][:3, 3] for tip in tips]).max() < 1e-9
        # The rods of all links: the ends of their capsules.
        ends = []
        for link in root.findall("link"):
            for element in link.findall("collision"):
                rod = element.find("geometry/cylinder")
                half = 0.0 if rod is None else float(rod.get("length")) / 2
                place = poses[link.get("name")] @ frame(element.find("origin"))
                ends.append([(place @ [0, 0, sign * half, 1])[:3] for sign in (-1, 1)])
        assert np.abs(ours.placed_capsules(q) - ends).max() < 1e-9


def test_pads_with_linkages_remain_parallel():
    # The knuckle turns by q and the pad back: the pad moves on a circle, in closed form.
    for q in np.linspace(0, 0.8, 7):
        a, b = hand("robotiq").fingertips([q])
        half = 0.0306011 - 0.02202 + 0.0376 * np.cos(q) - 0.043 * np.sin(q)
        height = 0.054904 + 0.03242 + 0.0155 + 0.0376 * np.sin(q) + 0.043 * np.cos(q)
        assert np.allclose(a, [0, -half, height], atol=1e-9) and np.allclose(b, [0, half, height], atol=1e-9)


@all_cases("name", HANDS)
def test_postures_have_the_given_distances(name):
    ours = hand(name)
    rng = np.random.default_rng(2)
    for shape in ours.preshapes:
        q = shape.joints[rng.choice(len(shape.joints), 50)]
        points = ours.fingertips(q)[:, shape.fingers]
        gaps = points[:, :, None] - points[:, None]
        wanted = np.linalg.norm(gaps, axis=-1)
        sides = wanted[:, [0], [1]] if len(shape.fingers) == 2 else wanted[:, [0, 1, 2], [1, 2, 0]]
        found, errors = shape.reached(sides)
        reached = errors < 1e-7
        assert reached.any(1).mean() > 0.85
        again = ours.fingertips(found)[:, :, shape.fingers]
        again = np.linalg.norm(again[:, :, :, None] - again[:, :, None], axis=-1)
        assert np.abs(again - wanted[:, None])[reached].max() < 1e-7
        assert (found >= ours.limits[:, 0]).all() and (found <= ours.limits[:, 1]).all()


def test_limits_are_those_of_the_file():
    ours = hand_from_urdf(crossed(("3.5", "5")), torsion=SOFT)
    assert ours.limits.tolist() == [[3.5, 5.0]] * 2
    shape = ours.preshapes[0]
    assert (shape.joints >= 3.5).all() and (shape.joints <= 5).all() and np.ptp(shape.joints, 0).min() > 1
    assert shape.largest > 0.1 and (shape.reached(np.array([[0.2]]))[1] < 1e-7).any()
    # The joint whose range does not contain 0 is open at the end of the range.
    parked = hand_from_urdf(crossed(("3.5", "5")), torsion=SOFT, closing={"second": -0.4, "last": 0.4})
    assert (np.abs(parked.preshapes[0].joints - [5.0, 3.5]).max(1) < 1e-12).any()
    # Turning without limits is a full turn, and with one limit a turn from there.
    for free in (crossed().replace('type="revolute"', 'type="continuous"'), crossed(("-1e16", "1e16"))):
        assert np.allclose(hand_from_urdf(free, torsion=SOFT).limits, [[-np.pi, np.pi]] * 2, atol=0)
    wide = hand_from_urdf(crossed(("-10", "10")), torsion=SOFT, closing={"last": 1})
    assert wide.limits.tolist() == [[-10.0, 10.0]] * 2 and (wide.preshapes[0].joints == [0, -10]).all(1).any()
    half = hand_from_urdf(crossed(("2", "inf")), torsion=SOFT)
    assert np.allclose(half.limits, [[2, 2 + 2 * np.pi]] * 2)
    with pytest.raises(ValueError, match=r"'second' slides between -0\.5 and inf"):
        hand_from_urdf(
            crossed(("-0.5", "inf")).replace('"second" type="revolute"', '"second" type="prismatic"'), torsion=1
        )


def test_tips_that_cannot_close_are_refused():
    # The tips of two parallel fingers that turn together.
    twins = crossed().replace('"second" type="revolute"', '"second" type="fixed"')
    for closing in (None, {"last": 1}):
        with pytest.raises(
            ValueError, match="no variable changes the distances of the fingertips at joints 'first', 'l"
        ):
            hand_from_urdf(twins, torsion=SOFT, closing=closing)
    two = {"a": ([0, 0, 0.1], 0.01), "b": ([0.05, 0, 0.1], 0.01)}
    with pytest.raises(ValueError, match="links 'a' and 'b' are both carried by joint 'first'"):
        hand_from_urdf(twins, torsion=SOFT, tips=two)
    tip = '<collision><origin xyz="0 0 0.05"/><geometry><sphere radius="0.01"/></geometry></collision>'
    with pytest.raises(ValueError, match="links 'c' and 'c' are both carried by joint 'last'"):
        hand_from_urdf(crossed().replace('<link name="c">', f'<link name="c">{tip}'), torsion=SOFT)


def test_fingers_close_by_their_bends():
    # Bending brings fingertips together; spreading and opening do not.
    closing = hand("allegro").closing
    assert (closing[[1, 2, 3, 5, 6, 7, 9, 10, 11]] > 0.1).all()
    assert np.allclose(np.abs(hand("franka").closing), 1) and hand("franka").closing[0] < 0 < hand("robotiq").closing[0]
    ours = hand_from_urdf(FRANKA_HAND, torsion=SOFT, closing={"slide 1": -0.5})
    assert ours.closing.tolist() == [-0.5]


def crossed(limits=("-0.5", "0.5")):
    """Return a hand whose first joint in the file follows the last one, at the ratio 1, and two tips in the plane."""
    low, high = limits
    tip = '<collision><origin xyz="0 0 0.1"/><geometry><sphere radius="0.01"/></geometry></collision>'
    links = "".join(f'<link name="{name}">{body}</link>' for name, body in (("a", ""), ("b", tip), ("c", tip)))

    def joint(name, parent, child, place, more=""):
        return (
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><axis xyz="0 1 0"/>'
            f'<origin xyz="{place} 0 0"/><limit lower="{low}" upper="{high}" effort="1" velocity="1"/>{more}</joint>'
        )

    first = joint("first", "palm", "a", "0.05", '<mimic joint="last" multiplier="1"/>')
    joints = first + joint("second", "a", "b", "0") + joint("last", "palm", "c", "-0.05")
    return f'<robot name="crossed"><link name="palm"/>{links}{joints}</robot>'


def test_rates_belong_to_the_joints_that_are_named():
    for name, moving in (("second", [1]), ("last", [0, 2])):
        ours = hand_from_urdf(crossed(), torsion=SOFT, closing={name: -1})
        # The positions of the joints, by the angles of their tips before and after a small motion.
        assert ours.closing @ ours.closing == 1
        turned = ours.robot.forward_all(0.1 * ours.closing) - ours.robot.forward_all(0 * ours.closing)
        angles = -0.1 * np.array([0 in moving, (0 in moving) + (1 in moving), 2 in moving])
        assert np.allclose(2 * np.arcsin(np.linalg.norm(turned[:, 1:4], axis=1)), np.abs(angles), atol=1e-12)
    with pytest.raises(ValueError, match="'first' is no joint with a variable of crossed; expected some of second, la"):
        hand_from_urdf(crossed(), torsion=SOFT, closing={"first": 1})
    assert hand_from_urdf(crossed(), torsion=SOFT, breakaway=["first"]).breakaway.tolist() == [0]
    with pytest.raises(ValueError, match="'last' follows no joint"):
        hand_from_urdf(crossed(), torsion=SOFT, breakaway=["last"])


@pytest.mark.parametrize("size", [(0.03, 0.2, 0.1), (0.05, 0.05, 0.05), (0.02, 0.021, 0.2)])
def test_capsules_of_boxes_are_a_fifth_of_the_thickness_off(size):
    text = f"""<robot name="r"><link name="a"/><link name="b"><collision><origin xyz="1 2 3" rpy="0.3 0.2 0.1"/>
    <geometry><box size="{" ".join(map(str, size))}"/></geometry></collision></link><joint name="j" type="revolute">
    <parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint></robot>"""
    found, most = capsules_from_urdf(text), 0.2072 * min(size)
    place = frame(ElementTree.fromstring('<origin xyz="1 2 3" rpy="0.3 0.2 0.1"/>'))
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(size) / 2
    local = np.concatenate([np.random.default_rng(3).uniform(-0.5, 0.5, (2000, 3)) * size, corners])
    points = local @ place[:3, :3].T + place[:3, 3]
    rods = list(zip(found.ends, found.radii, strict=True))
    outside = np.min([distances_to_segment(points, *ends) - r for ends, r in rods], axis=0)
    assert 0.9 * most < outside.max() < most and (found.carriers == 0).all()
    for ends, radius in rods:
        axis = (ends - place[:3, 3]) @ place[:3, :3]
        assert (np.abs(axis).max(0) + radius - np.array(size) / 2).max() < most + 1e-9


MACRO = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="radius" default="0.01"/>
<xacro:macro name="finger" params="n side"><link name="tip${n}"><collision><origin xyz="0 0 0.05"/>
<geometry><sphere radius="$(arg radius)"/></geometry></collision></link><joint name="j${n}" type="prismatic">
<parent link="palm"/><child link="tip${n}"/><origin xyz="${side * 0.05} 0 0"/><axis xyz="${side} 0 0"/>
<limit lower="-0.03" upper="0" velocity="1" effort="1"/></joint></xacro:macro><link name="palm"><collision><geometry>
<sphere radius="0.03"/></geometry></collision></link><xacro:finger n="1" side="1"/><xacro:finger n="2" side="-1"/>
</robot>"""


def test_fingers_of_macros_have_capsules_and_tips():
    """The spheres of two macros are at the ends of the fingers, with the radius that the file is given."""
    found = capsules_from_urdf(MACRO, arguments={"radius": 0.02})
    assert found.carriers.tolist() == [-1, 0, 1] and found.radii.tolist() == [0.03, 0.02, 0.02]
    assert np.allclose(found.ends[1:, 0], [[0.05, 0, 0.05], [-0.05, 0, 0.05]])
    ours = hand_from_urdf(MACRO, torsion=SOFT, arguments={"radius": 0.02})
    assert ours.tips.carriers.tolist() == [0, 1] and ours.tips.radii.tolist() == [0.02, 0.02]
    assert ours.parts.carriers.tolist() == [-1, 0, 1] and ours.parts.radii.tolist() == [0.03, 0.02, 0.02]


def _box_distance(half):
    def distance(p):
        q = np.abs(p) - half
        return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0)

    return distance


def _cylinder_distance(radius, half):
    def distance(p):
        q = np.stack([np.hypot(p[..., 0], p[..., 1]) - radius, np.abs(p[..., 2]) - half], -1)
        return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0)

    return distance


OBJECTS = {
    "ball": (sphere(0.03), lambda p: np.linalg.norm(p, axis=-1) - 0.03, 2e-4),
    "box": (box(0.04, 0.06, 0.11), _box_distance(np.array([0.02, 0.03, 0.055])), 1e-9),
    "can": (cylinder(0.03, 0.1), _cylinder_distance(0.03, 0.05), 1e-4),
    "ring": (
        torus(0.045, 0.013),
        lambda p: np.hypot(np.hypot(p[..., 0], p[..., 1]) - 0.045, p[..., 2]) - 0.013,
        3e-4,
    ),
}
"""A mesh, the signed distance from the shape in closed form, and how far the mesh is from the shape."""


def checked(plan, vertices, distance, flat):
    ours = plan.hand
    for grasp in plan:
        assert grasp.status == GraspStatus.OK
        assert np.abs(distance(grasp.contacts)).max() < flat
        assert np.allclose(np.linalg.norm(grasp.normals, axis=1), 1)
        # Outside of the surface along the normal, and inside against it.
        assert (distance(grasp.contacts + 0.002 * grasp.normals) > 0.0015).all()
        assert is_closed_by_forces(grasp.contacts, grasp.normals, ours.torsion)
        for joints in (grasp.joints, grasp.open_joints):
            assert (ours.limits[:, 0] <= joints).all() and (joints <= ours.limits[:, 1]).all()
        tips = pga3.move_point(grasp.motor, ours.fingertips(grasp.joints)[grasp.fingers])
        assert np.abs(tips - grasp.contacts - ours.tips.radii[grasp.fingers, None] * grasp.normals).max() < 1e-6
        ends = pga3.move_point(grasp.motor, ours.placed_capsules(grasp.joints))
        for (start, end), radius in zip(ends, ours.radii, strict=True):
            assert distances_to_segment(vertices, start, end).min() > radius - 0.003


CASES = [(name, thing) for name in HANDS[2:] for thing in OBJECTS]
QUICK = [("franka", "box"), ("robotiq", "ring"), ("allegro", "can")]


@pytest.mark.parametrize(("name", "thing"), some_slow(CASES, *(case for case in CASES if case not in QUICK)))
def test_grasps_of_shapes(name, thing):
    (vertices, faces), distance, flat = OBJECTS[thing]
    checked(plan_grasps(vertices, faces, hand=hand(name)), vertices, distance, flat)


@cache
def scissors():
    """Two blades that cross, and two handles: four flat bars of 8 mm that overlap, which lie on the plane z = 0."""
    solids = []
    for sign in (1, -1):
        for place, angle, size in (
            ((0.0, 0.045, 0.004), 0.12 * sign, (0.012, 0.1, 0.008)),
            ((0.022 * sign, -0.04, 0.004), 0.45 * sign, (0.014, 0.09, 0.008)),
        ):
            corners, faces = box(*size)
            turn = Rotation.from_rotvec([0, 0, angle]).as_matrix()
            solids.append((corners @ turn.T + place, faces))
    vertices = np.concatenate([corners for corners, _ in solids])
    return vertices, np.concatenate([faces + 8 * k for k, (_, faces) in enumerate(solids)])


TABLE = plane_obstacle(normal=[0, 0, 1], point=[0, 0, 0])
FLAT = {
    "scissors": scissors,
    "flat Y": lambda: (SHAPES["scissors"]()[0] + [0, 0, 0.004], SHAPES["scissors"]()[1]),
    "plate": lambda: (box(0.06, 0.1, 0.012)[0] + [0, 0, 0.006], box(0.06, 0.1, 0.012)[1]),
}


@pytest.mark.parametrize(("name", "thing"), [("robotiq", "scissors"), ("franka", "plate"), ("robotiq", "flat Y")])
def test_flat_objects_on_a_table_are_held(name, thing):
    vertices, faces = FLAT[thing]()
    plan = plan_grasps(vertices, faces, hand=hand(name), obstacles=[TABLE], margin=0.0005)
    assert plan.status == GraspStatus.OK
    for grasp in plan:
        assert is_closed_by_forces(grasp.contacts, grasp.normals, SOFT)
        assert (grasp.contacts[:, 2] > 0).all() and (grasp.contacts[:, 2] < 0.013).all()
        for joints in (grasp.joints, grasp.open_joints):
            ends = pga3.move_point(grasp.motor, plan.hand.placed_capsules(joints))
            assert (ends[..., 2].min(1) > plan.hand.radii).all()


def test_nothing_is_held_inside_an_obstacle():
    thing, ours = box(0.04, 0.06, 0.11), hand("franka")
    cube, faces = box(2.0, 2.0, 2.0)
    within = plan_grasps(*thing, hand=ours, obstacles=[mesh_obstacle(cube, faces)])
    assert within.status == GraspStatus.COLLISION
    # In a room, the space between its walls is outside of the obstacle.
    room = [mesh_obstacle(np.concatenate([2 * cube, cube]), np.concatenate([faces, faces[:, ::-1] + len(cube)]))]
    assert plan_grasps(*thing, hand=ours, obstacles=room).status == GraspStatus.OK


def test_a_hand_cannot_hold_what_it_cannot_reach():
    large = plan_grasps(*box(0.2, 0.2, 0.2), hand=hand("franka"))
    assert large.status == GraspStatus.TOO_LARGE and large[0].contacts.shape == (2, 3)
    assert np.isnan(large[0].contacts).all() and large[0].joints.tolist() == [0]
    empty = plan_grasps(np.zeros((0, 3)), np.zeros((0, 3), int), hand=hand("allegro"))
    assert empty.status == GraspStatus.EMPTY and empty[0].joints.shape == (16,)


def test_descriptions_of_hands_are_checked():
    with pytest.raises(ValueError, match="torsion"):
        hand_from_urdf(FRANKA_HAND)
    with pytest.raises(ValueError, match="torsion"):
        hand_from_urdf(FRANKA_HAND, torsion=np.nan)
    with pytest.raises(ValueError, match="approach"):
        hand_from_urdf(ALLEGRO, approach=[0, 0, 0])
    with pytest.raises(ValueError, match="at least two"):
        hand_from_urdf(FRANKA_HAND, torsion=SOFT, tips={"tip 1": ([0, 0, 0], 0.01)})
    with pytest.raises(ValueError, match="no link"):
        hand_from_urdf(FRANKA_HAND, torsion=SOFT, tips={"thumb": ([0, 0, 0], 0.01)})
    with pytest.raises(ValueError, match="radius"):
        hand_from_urdf(FRANKA_HAND, torsion=SOFT, tips={"tip 1": ([0, 0, 0], 0)})
    with pytest.raises(ValueError, match="no joint"):
        hand_from_urdf(FRANKA_HAND, torsion=SOFT, closing={"slide 2": 1})
    with pytest.raises(ValueError, match="rates"):
        hand_from_urdf(FRANKA_HAND, torsion=SOFT, closing={"slide 1": 2})
    with pytest.raises(ValueError, match="sphere, a cylinder or a box"):
        hand_from_urdf(FRANKA_HAND.replace('<sphere radius="0.0076"/>', '<mesh filename="a"/>'), torsion=SOFT)
    with pytest.raises(TypeError, match="path"):
        hand_from_urdf(3)


def test_grasps_withstand_displaced_contacts():
    ball = sphere(0.03)
    near = plan_grasps(*ball, friction=0.3, displacement=0.004)
    assert near.status == GraspStatus.OK
    rng = np.random.default_rng(4)
    for grasp in near:
        assert grasp.quality < grasp_quality(grasp.contacts, grasp.normals, 0.3, length=0.03)
        # Contacts of a ball, turned by less than the displacement, by a linear programme.
        for _ in range(30):
            turns = Rotation.from_rotvec(rng.uniform(-1, 1, (3, 3)) * 0.003 / 0.03 / np.sqrt(3))
            contacts = turns.apply(grasp.contacts)
            assert is_closed_by_forces(contacts, contacts / 0.03, friction=0.3)


@pytest.mark.slow
def test_contacts_that_move_by_more_than_friction_allows_hold_nothing():
    ball = sphere(0.03)
    assert plan_grasps(*ball, friction=0.05).status == GraspStatus.OK
    assert plan_grasps(*ball, friction=0.05, displacement=0.02).status == GraspStatus.NO_FORCE_CLOSURE


def test_an_arm_with_a_gripper_reaches_an_object_that_cameras_see():
    truth = pose(np.random.default_rng(1))
    built, plans = scene(truth), plan_grasps(VERTICES, FACES, hand=hand("robotiq"), count=6)
    found = guided_grasp(built.robot, HOME, MODEL, built.render("box", 0.3, 1), plans, mount=MOUNT)
    assert found.status == LoopStatus.OK
    # The pads by matrices, with the arm's pose at the end of the path.
    reached = pga3.motor_to_matrix(pga3.motor_product(built.robot.forward(found.path[-1]), MOUNT))
    poses = chain(ROBOTIQ_2F_85, {"knuckle 1": found.grasp.joints[0]})
    tips = np.array([(reached @ poses[f"tip {1 + k}"])[:3, 3] for k in found.grasp.fingers])
    contacts = pga3.move_point(truth, found.grasp.contacts)
    normals = pga3.move_direction(truth, found.grasp.normals)
    assert np.linalg.norm(tips - contacts - 0.0032 * normals, axis=1).max() < 1e-3
    assert np.linalg.norm(found.contacts - contacts, axis=1).max() < 1e-3
    # Without a grasp, results have the shapes of the same hand.
    large = plan_grasps(*box(0.2, 0.2, 0.2), hand=hand("robotiq"))
    failed = guided_grasp(built.robot, HOME, MODEL, built.render("box", 0.3, 1), large, mount=MOUNT)
    assert failed.status == LoopStatus.NO_GRASP and failed.open_joints.tolist() == [0] and failed.approach_at == 0
    assert failed.contacts.shape == found.contacts.shape and np.isnan(failed.contacts).all()


def test_grasps_for_a_load_push_least():
    # Each of two contacts bears a half of the weight, by friction of half of its normal force, and soft fingers its
    # torque about the line between them. The cones have eight edges, so that the force is up to 8 % larger.
    weight = [[0, 0, -2.0, 0, 0, 0]]
    plan = plan_grasps(*box(0.04, 0.06, 0.11), hand=hand("franka"), loads=weight, count=4)
    forces = [grasp.largest for grasp in plan]
    assert forces == sorted(forces)
    for grasp in plan:
        lever = distances_to_segment(np.zeros((1, 3)), *grasp.contacts)[0]
        assert 2 - 1e-6 < grasp.largest < 1.1 * (2 + lever / SOFT)
        held = contact_forces(grasp.contacts, grasp.normals, weight[0], torsion=SOFT)
        assert abs(held.largest - grasp.largest) < 1e-6
    assert np.isnan(plan_grasps(*box(0.04, 0.06, 0.11), hand=hand("franka"))[0].largest)
    with pytest.raises(ValueError, match="loads"):
        plan_grasps(*box(0.04, 0.06, 0.11), loads=[[0, 0, np.nan, 0, 0, 0]])
    with pytest.raises(ValueError, match="displacement"):
        plan_grasps(*box(0.04, 0.06, 0.11), displacement=-1)
