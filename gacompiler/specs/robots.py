"""Kinematics and dynamics of any robot: loops over the table of its joints, in link frames and in the base frame.

A robot is a tree of joints, ordered so that parents come first. The frame of a joint is fixed to its link, with the
origin on the joint's axis; if all variables are 0, it is parallel to the base frame. At position x of the joint its
pose in the frame of the parent is the translator of `place` times ``exp(-x / 2 axis)``: the axis of a revolute joint is
a line through the origin, that of a prismatic joint a line at infinity, and both are the joint's twist at unit speed.
Twists, momenta and wrenches are lines; ``twist & wrench`` is a power.

Tables, shared by all configurations of a batch:

    parents     the joint that carries each joint, -1 for the base
    variables   the variable of each joint: ``x = ratio q[variable] + offset``
    ratios, offsets
    places      the origin of the frame in that of the parent at x = 0
    screws      the twist of the joint at unit speed in its own frame
    turns       1 for a revolute joint, 0 for a prismatic one
    inertias    mass, mass times centre, and the tensor about the frame's origin, xx xy xz yy yz zz, in the link's frame
    armature    inertia of the motor's rotor, reflected to the joint
"""

from fractions import Fraction
from typing import Any, NamedTuple

from gacompiler import (
    SCALAR,
    absolute,
    accumulate,
    array,
    assemble,
    commutator,
    cos,
    each,
    fold,
    gather,
    index,
    kernel,
    sandwich,
    scan,
    scatter,
    select,
    sin,
    total,
)
from gacompiler.algebra.catalog import PGA3

LINE, MOTOR, POINT, ROTOR = PGA3.LINE, PGA3.MOTOR, PGA3.POINT, PGA3.ROTOR
VECTOR = array(SCALAR, 3)

VALUES = array(SCALAR, "m")
PARENTS, VARIABLES = index("n"), index("n", into="m")
NUMBERS = array(SCALAR, "n", shared=True)
LINES, VECTORS = array(LINE, "n", shared=True), array(SCALAR, "n", 3, shared=True)
ROTORS = array(ROTOR, "n", shared=True)
BODIES = array(SCALAR, "n", 10, shared=True)

_NO_LINE = PGA3.multivector({})
NO_INERTIA = Fraction(1, 2**44)
"""The relative size of rounding errors in the terms of an inertia, 6e-14."""


class Pose(NamedTuple):
    """A frame relative to another: its rotor, and the coordinates of its origin."""

    rotor: Any
    place: Any


class Motion(NamedTuple):
    """The motion of a link in its own frame: its twist, and the twist's rate of change."""

    twist: Any
    rate: Any


# Vectors, lines and frames.


def _line(direction, moment):
    (x, y, z), (u, v, w) = direction, moment
    return assemble(PGA3, {"e12": z, "e13": -y, "e23": x, "e01": u, "e02": v, "e03": w})


def _direction(line):
    return line["e23"], -line["e13"], line["e12"]


def _moment(line):
    return line["e01"], line["e02"], line["e03"]


def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _plus(a, b):
    return tuple(x + y for x, y in zip(a, b, strict=True))


def _minus(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))


def rotated(rotor, vector):
    """Rotate a vector."""
    return _direction(sandwich(rotor, _line(vector, (0, 0, 0))))


def to_parent(pose, line):
    """Transform a line from a frame to the frame of the parent."""
    turned = sandwich(pose.rotor, line)
    direction = _direction(turned)
    return _line(direction, _plus(_moment(turned), _cross(pose.place, direction)))


def _to_child(pose, line):
    """Transform a line from the parent's frame to this one."""
    direction = _direction(line)
    return sandwich(~pose.rotor, _line(direction, _minus(_moment(line), _cross(pose.place, direction))))


def _after(pose, own):
    """Compose the pose of the parent in the base frame with the pose of a frame in the parent."""
    return Pose(pose.rotor * own.rotor, _plus(pose.place, rotated(pose.rotor, own.place)))


def _motor(pose):
    """Convert a pose to a motor: its translation after its rotation."""
    x, y, z = pose.place
    return assemble(PGA3, {"1": 1, "e01": -x / 2, "e02": -y / 2, "e03": -z / 2}) * pose.rotor


# Joints.


def _pose(q, ratio, offset, place, screw, turn):
    """Compute the pose of a joint's frame in that of its parent."""
    x = ratio * q + offset
    half = turn * x / 2
    axis = _line(_direction(screw), (0, 0, 0))
    return Pose(cos(half) - sin(half) * axis, _plus(place, tuple(x * d for d in _moment(screw))))


def momentum_of(inertia, twist):
    """Compute the momentum of a body from its inertia and twist, a line like a wrench."""
    mass, hx, hy, hz, xx, xy, xz, yy, yz, zz = inertia
    h, w, v = (hx, hy, hz), _direction(twist), _moment(twist)
    force = _plus(tuple(mass * x for x in v), _cross(w, h))
    tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    return _line(force, _plus(tuple(_dot(row, w) for row in tensor), _cross(h, v)))


def _first_moment(inertia, pose):
    """Compute the mass, and the mass times the centre in the reference frame of the pose."""
    mass, *h = inertia[:4]
    return mass, _plus(rotated(pose.rotor, h), tuple(mass * x for x in pose.place))


def placed(inertia, pose):
    """Transform an inertia about the origin of a frame to the origin of the reference frame of the pose."""
    mass, hx, hy, hz, xx, xy, xz, yy, yz, zz = inertia
    columns = [rotated(pose.rotor, axis) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    rows = list(zip(*columns, strict=True))
    h = tuple(_dot(row, (hx, hy, hz)) for row in rows)
    half = [[_dot(row, column) for row in rows] for column in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))]
    p, moved = pose.place, _plus(h, tuple(mass * x for x in pose.place))
    # About the new origin: |p|^2 E - p p^T for the mass, and likewise for the mixed terms of p and h.
    middle = tuple((x + y) / 2 for x, y in zip(h, moved, strict=True))
    trace = 2 * _dot(p, middle)

    def entry(i, j):
        turned = _dot(rows[i], [each_half[j] for each_half in half])
        return turned - (p[i] * middle[j] + middle[i] * p[j]) + (trace if i == j else 0)

    return (mass, *moved, *(entry(i, j) for i in range(3) for j in range(i, 3)))


JOINTS = {
    "variables": VARIABLES,
    "ratios": NUMBERS,
    "offsets": NUMBERS,
    "places": VECTORS,
    "screws": LINES,
    "turns": NUMBERS,
}


def own_poses(q, variables, ratios, offsets, places, screws, turns):
    """Compute the pose of each joint's frame in that of its parent."""
    return each(_pose, gather(q, variables), ratios, offsets, places, screws, turns)


def in_base(own, parents):
    """Compute the poses of the joints' frames in the base frame from those in the frames of their parents."""
    return scan(_after, Pose(1, (0, 0, 0)), own, parents=parents)


def _upwards(gravity):
    """Return the rate of change of the base's twist: gravity is treated as an upward acceleration."""
    return _line((0, 0, 0), tuple(-g for g in gravity))


def _motions(own, parents, screws, speeds, rates, ratios, gravity):
    """Compute the motions of the links, each in its own frame."""

    def outward(carrier, pose, axis, speed, rate, ratio):
        own_twist = ratio * speed * axis
        twist = _to_child(pose, carrier.twist) + own_twist
        return Motion(twist, _to_child(pose, carrier.rate) + ratio * rate * axis + commutator(own_twist, twist))

    return scan(outward, Motion(_NO_LINE, _upwards(gravity)), own, screws, speeds, rates, ratios, parents=parents)


def _inertial_wrench(inertia, motion):
    """Compute the wrench required for a motion of a body: the rate of change of its momentum."""
    return momentum_of(inertia, motion.rate) + commutator(momentum_of(inertia, motion.twist), motion.twist)


@kernel(q=VALUES, parents=PARENTS, **JOINTS, home_rotors=ROTORS, home_places=VECTORS, returns=array(MOTOR, "n"))
def forward_all(q, parents, variables, ratios, offsets, places, screws, turns, home_rotors, home_places):
    """Compute the motors of frames carried by the links, in the base frame.

    `home_rotors` and `home_places` are their poses in the frames of the joints.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    base = Pose(1, (0, 0, 0))
    poses = scan(_after, base, own, parents=parents)
    return each(lambda pose, rotor, place: _motor(_after(pose, Pose(rotor, place))), poses, home_rotors, home_places)


@kernel(q=VALUES, **JOINTS, tool=MOTOR)
def forward(q, variables, ratios, offsets, places, screws, turns, tool):
    """Compute the motor of the end effector in the base frame.

    The tables contain the joints from the base to the end effector, and `tool` is the motor of the end effector in the
    frame of the last joint.
    """

    def after(pose, *joint):
        return _after(pose, _pose(*joint))

    joints = (gather(q, variables), ratios, offsets, places, screws, turns)
    return _motor(fold(after, Pose(1, (0, 0, 0)), *joints)) * tool


@kernel(q=VALUES, **JOINTS, tip=VECTOR, returns=array(SCALAR, "m", 6))
def jacobian(q, variables, ratios, offsets, places, screws, turns, tip):
    """Compute the angular and linear velocities of the end effector for unit rates of the variables.

    The tables contain the joints from the base to the end effector, and `tip` is the origin of the end effector in the
    frame of the last joint.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = scan(_after, Pose(1, (0, 0, 0)), own)
    last = fold(lambda _, pose: pose, Pose(1, (0, 0, 0)), poses)
    point = _plus(last.place, rotated(last.rotor, tip))

    def column(pose, screw, ratio):
        axis = sandwich(pose.rotor, screw)
        away = tuple(x - y for x, y in zip(point, pose.place, strict=True))
        linear = _plus(_moment(axis), _cross(_direction(axis), away))
        return tuple(ratio * x for x in (*_direction(axis), *linear))

    return scatter(each(column, poses, screws, ratios), variables, q)


@kernel(q=VALUES, **JOINTS, tip=VECTOR, qd=VALUES, returns=array(SCALAR, "m", 6))
def jacobian_rate(q, variables, ratios, offsets, places, screws, turns, tip, qd):
    """Compute the time derivative of `jacobian` for the rates `qd` of the variables."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = scan(_after, Pose(1, (0, 0, 0)), own)
    last = fold(lambda _, pose: pose, Pose(1, (0, 0, 0)), poses)
    point = _plus(last.place, rotated(last.rotor, tip))
    axes = each(to_parent, poses, screws)

    def outward(carrier, axis, speed, ratio):
        twist, _ = carrier
        return twist + ratio * speed * axis, commutator(axis, twist)

    twists, axis_rates = scan(outward, (_NO_LINE, _NO_LINE), axes, gather(qd, variables), ratios)
    final = fold(lambda _, twist: twist, _NO_LINE, twists)
    velocity = _plus(_moment(final), _cross(_direction(final), point))

    def column(axis, axis_rate, ratio):
        turning = _direction(axis_rate)
        swept = _plus(_cross(turning, point), _cross(_direction(axis), velocity))
        linear = _plus(_moment(axis_rate), swept)
        return tuple(ratio * x for x in (*turning, *linear))

    return scatter(each(column, axes, axis_rates, ratios), variables, q)


@kernel(q=VALUES, parents=PARENTS, **JOINTS, returns=array(LINE, "n"))
def twists_of_joints(q, parents, variables, ratios, offsets, places, screws, turns):
    """Compute the twists of the joints at unit speed, as lines in the base frame."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    return each(to_parent, poses, screws)


@kernel(
    q=VALUES, parents=PARENTS, **JOINTS, inertias=BODIES,
    lower=index("p", into="n"), upper=index("p", into="n"), rows=index("p", into="m"), columns=index("p", into="m"),
    mirrored=index("p", into="m"), factors=array(SCALAR, "p", shared=True), armature=array(SCALAR, "p", shared=True),
)  # fmt: skip
def mass_matrix(
    q, parents, variables, ratios, offsets, places, screws, turns, inertias,
    lower, upper, rows, columns, mirrored, factors, armature,
):  # fmt: skip
    """Compute the joint-space mass matrix by the composite rigid body algorithm (Walker and Orin 1982).

    The last seven tables list pairs of a joint `lower` and a joint `upper` that carries it or is the same joint: the
    variables `rows` of the lower joint and `columns` of the upper joint; `mirrored`, which equals `rows`, or -1 if the
    joints are the same; the product of the ratios of both joints; and the rotor inertia if the joints are the same.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    axes = each(to_parent, poses, screws)
    bodies = each(placed, inertias, poses)
    composite = accumulate(lambda carried, body: _plus(carried, body), (0,) * 10, bodies, parents=parents)
    momenta = each(momentum_of, composite, axes)
    entries = each(
        lambda momentum, axis, factor, rotor: factor * ((axis & momentum) + rotor),
        gather(momenta, lower), gather(axes, upper), factors, armature,
    )  # fmt: skip
    return scatter(entries, (columns, mirrored), (q, q), start=scatter(entries, (rows, columns), (q, q)))


@kernel(q=VALUES, parents=PARENTS, **JOINTS, qd=VALUES, tau=VALUES, inertias=BODIES, armature=NUMBERS, gravity=VECTOR)
def forward_dynamics(
    q, parents, variables, ratios, offsets, places, screws, turns, qd, tau, inertias, armature, gravity
):
    """Compute the joint accelerations from joint forces by the articulated body algorithm (Featherstone 1983).

    Each joint must have its own variable. The result is NaN if a joint moves no inertia.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    axes = each(to_parent, poses, screws)
    speeds = each(lambda speed, ratio: speed * ratio, gather(qd, variables), ratios)
    twists = scan(lambda carrier, axis, speed: carrier + speed * axis, _NO_LINE, axes, speeds, parents=parents)

    def inward(carried, pose, body, axis, twist, speed, force, ratio, rotor):
        outer, wrench = carried
        own_body = placed(body, pose)
        apparent = _apparent(outer, own_body, axis, rotor)
        wrench = wrench + commutator(momentum_of(own_body, twist), twist)
        rest = force / ratio - (axis & wrench)
        drag = speed * commutator(axis, twist)
        passed = wrench + _articulated(apparent.left.inertia, drag) + (rest * apparent.size) * apparent.momentum
        return (apparent.left, passed), (apparent.momentum, apparent.size, rest, drag)

    joints = (poses, inertias, axes, twists, speeds, gather(tau, variables), ratios, armature)
    _, (momenta, sizes, rests, drags) = accumulate(inward, (_NOTHING, _NO_LINE), *joints, parents=parents, keep=True)

    def outward(carrier, momentum, size, rest, drag, axis):
        rate, _ = carrier
        rate = rate + drag
        own_rate = size * (rest - (rate & momentum))
        return rate + own_rate * axis, own_rate

    base = (_upwards(gravity), 0)
    _, rates = scan(outward, base, momenta, sizes, rests, drags, axes, parents=parents)
    return scatter(each(lambda rate, ratio: rate / ratio, rates, ratios), variables, q)


class Articulated(NamedTuple):
    """Articulated inertia of a body and its freely moving descendants, with the sizes of the terms that were summed."""

    inertia: Any
    mass: Any
    spread: Any


class Apparent(NamedTuple):
    """Apparent inertia at a joint: momentum at unit speed, inverse inertia, and the remaining articulated body."""

    momentum: Any
    size: Any
    left: Articulated


_NOTHING = Articulated((0,) * 21, 0, 0)


def _apparent(carried, body, axis, rotor):
    """Compute the apparent inertia at a joint that carries a body and its descendants."""
    inertia = _plus(carried.inertia, _as_matrices(body))
    momentum = _articulated(inertia, axis)
    apparent = (axis & momentum) + rotor
    # The apparent inertia at the joint is a sum that may cancel. If it is not larger than the rounding errors of its
    # terms, or NaN, `size` is 0 / 0.
    mass, spread = carried.mass + body[0], carried.spread + body[4] + body[7] + body[9]
    w, v = _direction(axis), _moment(axis)
    moves = absolute(apparent) > NO_INERTIA * absolute(spread * _dot(w, w) + mass * _dot(v, v) + rotor)
    size = select(moves, 1, 0) / select(moves, apparent, 0)
    return Apparent(momentum, size, Articulated(_without(inertia, momentum, size), mass, spread))


def _as_matrices(inertia):
    """Return an inertia as the blocks of its symmetric matrix on twists: angular 6, mixed 9, linear 6."""
    mass, hx, hy, hz, xx, xy, xz, yy, yz, zz = inertia
    return (xx, xy, xz, yy, yz, zz, 0, -hz, hy, hz, 0, -hx, -hy, hx, 0, mass, 0, 0, mass, 0, mass)


def _symmetric(numbers):
    xx, xy, xz, yy, yz, zz = numbers
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


def _articulated(inertia, twist):
    """Compute the momentum of an articulated body."""
    angular, mixed, linear = _symmetric(inertia[:6]), inertia[6:15], _symmetric(inertia[15:])
    rows = mixed[:3], mixed[3:6], mixed[6:]
    w, v = _direction(twist), _moment(twist)
    force = tuple(_dot(column, w) + _dot(row, v) for column, row in zip(zip(*rows, strict=True), linear, strict=True))
    moment = tuple(_dot(row, w) + _dot(other, v) for row, other in zip(angular, rows, strict=True))
    return _line(force, moment)


def _without(inertia, momentum, size):
    """Subtract a momentum's square from an articulated inertia: the apparent inertia across a free joint."""
    f, m = _direction(momentum), _moment(momentum)
    sf, sm = tuple(size * x for x in f), tuple(size * x for x in m)
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    squares = (
        *(m[i] * sm[j] for i, j in pairs),
        *(m[i] * sf[j] for i in range(3) for j in range(3)),
        *(f[i] * sf[j] for i, j in pairs),
    )
    return tuple(x - y for x, y in zip(inertia, squares, strict=True))


@kernel(
    q=VALUES, parents=PARENTS, **JOINTS, inertias=BODIES, armature=NUMBERS,
    below=index("p"), carriers=index("p", into="n"), is_own=array(SCALAR, "p", shared=True),
    before=index("r"), joints=index("r", into="n"), pairs=index("r", into="p"),
    is_carrier=array(SCALAR, "r", shared=True), factors=array(SCALAR, "r", shared=True),
    rows=index("r", into="m"), columns=index("r", into="m"), mirrored=index("r", into="m"),
)  # fmt: skip
def inverse_mass_matrix(
    q, parents, variables, ratios, offsets, places, screws, turns, inertias, armature,
    below, carriers, is_own, before, joints, pairs, is_carrier, factors, rows, columns, mirrored,
):  # fmt: skip
    """Compute the inverse of `mass_matrix` by articulated bodies: accelerations under a unit force of each joint.

    Each joint must have its own variable. The result is NaN for the tree of a joint that moves no inertia.

    The three tables over p list each pair of a pushed joint and a joint that carries it or is the same joint: the
    preceding pair, whose joint is carried by this one (-1 if the joint is the pushed one), the joint, and whether it is
    the pushed one. The first pair is joint 0 with itself. The other tables, over r, list each pair of a pushed joint
    and a moved joint of the same tree that does not come after it: the pair of the moved joint's parent, or -1; the
    moved joint; the pair over p of the same joints if the moved joint carries the pushed one (`is_carrier` is 1),
    otherwise any pair; the inverse of the product of their ratios; the variables of the moved and of the pushed joint;
    and `mirrored`, which equals `columns`, or -1 if the joints are the same.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    axes = each(to_parent, poses, screws)

    def inward(carried, pose, body, axis, rotor):
        apparent = _apparent(carried, placed(body, pose), axis, rotor)
        return apparent.left, (apparent.momentum, apparent.size)

    apparent = accumulate(inward, _NOTHING, poses, inertias, axes, armature, parents=parents, keep=True)
    momenta, sizes = apparent[1]

    def push(carried, axis, momentum, size, is_pushed):
        wrench, _ = carried
        rate = size * (is_pushed - (axis & wrench))
        return wrench + rate * momentum, rate

    at_carriers = gather((axes, momenta, sizes), carriers)
    _, pushed = scan(push, (_NO_LINE, 0), *at_carriers, is_own, parents=below)

    def outward(carrier, axis, momentum, size, own_rate, is_pushed):
        twist, _ = carrier
        rate = is_pushed * own_rate - size * (twist & momentum)
        return twist + rate * axis, rate

    at_joints = gather((axes, momenta, sizes), joints)
    _, rates = scan(outward, (_NO_LINE, 0), *at_joints, gather(pushed, pairs), is_carrier, parents=before)
    entries = each(lambda rate, factor: factor * rate, rates, factors)
    return scatter(entries, (rows, columns), (q, q), start=scatter(entries, (mirrored, rows), (q, q)))


@kernel(q=VALUES, parents=PARENTS, **JOINTS, qd=VALUES, qdd=VALUES, inertias=BODIES, armature=NUMBERS, gravity=VECTOR)
def inverse_dynamics(
    q, parents, variables, ratios, offsets, places, screws, turns, qd, qdd, inertias, armature, gravity
):
    """Compute the joint forces for given accelerations by Newton-Euler recursion (Luh, Walker and Paul 1980).

    The forces of revolute joints are torques.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)

    def inward(carried, motion, pose, inertia, axis):
        wrench = _inertial_wrench(inertia, motion) + carried
        return to_parent(pose, wrench), axis & wrench

    motions = _motions(own, parents, screws, gather(qd, variables), gather(qdd, variables), ratios, gravity)
    _, forces = accumulate(inward, _NO_LINE, motions, own, inertias, screws, parents=parents, keep=True)
    joints = each(
        lambda force, inertia, rate, ratio: ratio * (force + inertia * ratio * rate),
        forces, armature, gather(qdd, variables), ratios,
    )  # fmt: skip
    return scatter(joints, variables, q)


@kernel(q=VALUES, parents=PARENTS, **JOINTS, inertias=BODIES, gravity=VECTOR)
def gravity_forces(q, parents, variables, ratios, offsets, places, screws, turns, inertias, gravity):
    """Compute the joint forces and torques that hold the robot at rest."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)

    def inward(carried, pose, inertia, screw, ratio):
        mass, first = _first_moment(inertia, pose)
        force = tuple(-mass * g for g in gravity)
        wrench = carried + _line(force, tuple(-x for x in _cross(first, gravity)))
        return wrench, ratio * (to_parent(pose, screw) & wrench)

    _, forces = accumulate(inward, _NO_LINE, poses, inertias, screws, ratios, parents=parents, keep=True)
    return scatter(forces, variables, q)


# Energies and momenta.


@kernel(q=VALUES, parents=PARENTS, **JOINTS, qd=VALUES, inertias=BODIES, armature=NUMBERS)
def kinetic_energy(q, parents, variables, ratios, offsets, places, screws, turns, qd, inertias, armature):
    """Compute the kinetic energy, including that of the motors' rotors."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)

    def outward(carrier, pose, axis, speed, ratio):
        return _to_child(pose, carrier) + ratio * speed * axis

    speeds = gather(qd, variables)
    twists = scan(outward, _NO_LINE, own, screws, speeds, ratios, parents=parents)

    def energy(twist, inertia, rotor, speed, ratio):
        return ((twist & momentum_of(inertia, twist)) + rotor * (ratio * speed) * (ratio * speed)) / 2

    return total(energy, twists, inertias, armature, speeds, ratios)


@kernel(q=VALUES, parents=PARENTS, **JOINTS, inertias=BODIES, gravity=VECTOR)
def potential_energy(q, parents, variables, ratios, offsets, places, screws, turns, inertias, gravity):
    """Compute the potential energy, which is 0 if all centres of mass are at the origin."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    return total(lambda inertia, pose: -_dot(gravity, _first_moment(inertia, pose)[1]), inertias, poses)


@kernel(q=VALUES, parents=PARENTS, **JOINTS, inertias=BODIES)
def centre_of_mass(q, parents, variables, ratios, offsets, places, screws, turns, inertias):
    """Compute the mass of the moving links and their centre of mass in the base frame."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)

    mass, moment = total(_first_moment, inertias, poses)
    return mass, assemble(
        PGA3, {"e123": 1, **dict(zip(("e032", "e013", "e021"), (x / mass for x in moment), strict=True))}
    )


@kernel(q=VALUES, parents=PARENTS, **JOINTS, inertias=BODIES, returns=(array(SCALAR, "m", 6), VECTOR))
def centroidal_momentum_matrix(q, parents, variables, ratios, offsets, places, screws, turns, inertias):
    """Compute the momenta about the centre of mass for unit rates of the variables, and the centre of mass.

    A row contains an angular momentum about the centre of mass, then a linear momentum.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    bodies = each(placed, inertias, poses)
    composite = accumulate(_plus, (0,) * 10, bodies, parents=parents)
    mass, *moment = total(lambda body: tuple(body[:4]), bodies)
    centre = tuple(x / mass for x in moment)

    def column(body, pose, screw, ratio):
        momentum = momentum_of(body, to_parent(pose, screw))
        force = tuple(ratio * x for x in _direction(momentum))
        about = tuple(ratio * x - y for x, y in zip(_moment(momentum), _cross(centre, force), strict=True))
        return (*about, *force)

    return scatter(each(column, composite, poses, screws, ratios), variables, q), centre


# Derivatives of the joint forces.


class Change(NamedTuple):
    """The motion of a link and of its joint's axis, in the base frame."""

    twist: Any
    rate: Any
    axis_rate: Any
    axis_acceleration: Any


class Composite(NamedTuple):
    """Sums over the bodies that a joint carries: inertia, angular Coriolis map, linear momentum, wrench."""

    inertia: Any
    turning: Any
    momentum: Any
    wrench: Any


class Covectors(NamedTuple):
    """The covectors that are joined with the axes of other joints to obtain derivatives of the forces."""

    of_carriers: Any
    momentum: Any
    coriolis: Any
    by_speed: Any


class Entries(NamedTuple):
    """The matrix entries of a pair of joints: in the upper joint's row (above) and in the lower joint's (below)."""

    above_by_q: Any
    below_by_q: Any
    above_by_qd: Any
    below_by_qd: Any


PAIRS = {
    "lower": index("p", into="n"),
    "upper": index("p", into="n"),
    "lower_variables": index("p", into="m"),
    "upper_variables": index("p", into="m"),
    "is_strict": array(SCALAR, "p", shared=True),
}


@kernel(
    q=VALUES, parents=PARENTS, **JOINTS, qd=VALUES, qdd=VALUES, inertias=BODIES, gravity=VECTOR, **PAIRS,
)  # fmt: skip
def inverse_dynamics_derivatives(
    q, parents, variables, ratios, offsets, places, screws, turns, qd, qdd, inertias, gravity,
    lower, upper, lower_variables, upper_variables, is_strict,
):  # fmt: skip
    """Compute the derivatives of the joint forces with respect to the variables and to their rates, two matrices.

    The last five tables list pairs of a joint `lower` and a joint `upper` that carries it or is the same joint: their
    variables, and 1 if the joints are different, otherwise 0. Armatures are omitted, since their forces depend on
    neither.

    The formulas are those of Singh, Russo and Wensing (*IEEE Robotics and Autom. Letters* 7:1635, 2022), whose Coriolis
    map of a body has an angular part only: ``B w = (2 w x P, N w)``.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    axes = each(to_parent, poses, screws)
    speeds = each(lambda speed, ratio: ratio * speed, gather(qd, variables), ratios)
    rates = each(lambda rate, ratio: ratio * rate, gather(qdd, variables), ratios)

    def outward(carrier, axis, speed, rate):
        twist = carrier.twist + speed * axis
        axis_rate = commutator(axis, carrier.twist)
        return Change(
            twist,
            carrier.rate + rate * axis + speed * axis_rate,
            axis_rate,
            commutator(axis, carrier.rate) + commutator(axis_rate, carrier.twist),
        )

    base = Change(_NO_LINE, _upwards(gravity), _NO_LINE, _NO_LINE)
    changes = scan(outward, base, axes, speeds, rates, parents=parents)

    def of_body(body, pose, change):
        inertia = placed(body, pose)
        momentum = momentum_of(inertia, change.twist)
        wrench = momentum_of(inertia, change.rate) + commutator(momentum, change.twist)
        return Composite(inertia, _turning(inertia, change.twist), _direction(momentum), wrench)

    def summed(carried, own_sums):
        return Composite(
            _plus(carried.inertia, own_sums.inertia),
            _plus(carried.turning, own_sums.turning),
            _plus(carried.momentum, own_sums.momentum),
            carried.wrench + own_sums.wrench,
        )

    zero = Composite((0,) * 10, (0,) * 9, (0,) * 3, _NO_LINE)
    composites = accumulate(summed, zero, each(of_body, inertias, poses, changes), parents=parents)

    def of_joint(sums, axis, change):
        inertia, turning, p, wrench = sums
        turned = _coriolis(turning, p, change.axis_rate)
        return Covectors(
            turned + momentum_of(inertia, change.axis_acceleration) + commutator(wrench, axis),
            momentum_of(inertia, axis),
            _coriolis_transposed(turning, p, axis),
            _coriolis(turning, p, axis) + 2 * momentum_of(inertia, change.axis_rate),
        )

    covectors = each(of_joint, composites, axes, changes)

    def of_pair(below, ratio, axis, above, is_lower, other):
        factor = ratio * other
        axis_rate = _direction(above.axis_rate)
        by_lower = axis & below.of_carriers
        by_upper = _dot(below.coriolis, axis_rate) + (above.axis_acceleration & below.momentum)
        speed_lower = axis & below.by_speed
        speed_upper = _dot(below.coriolis, _direction(axis)) + 2 * (above.axis_rate & below.momentum)
        return Entries(
            factor * by_lower, is_lower * factor * by_upper, factor * speed_lower, is_lower * factor * speed_upper
        )

    found = each(
        of_pair, gather(covectors, lower), gather(ratios, lower), gather(axes, upper), gather(changes, upper),
        is_strict, gather(ratios, upper),
    )  # fmt: skip
    above, below = (upper_variables, lower_variables), (lower_variables, upper_variables)
    by_q = scatter(found.below_by_q, below, (q, q), start=scatter(found.above_by_q, above, (q, q)))
    by_qd = scatter(found.below_by_qd, below, (q, q), start=scatter(found.above_by_qd, above, (q, q)))
    return by_q, by_qd


@kernel(q=VALUES, parents=PARENTS, **JOINTS, qd=VALUES, inertias=BODIES, **PAIRS)
def coriolis_matrix(
    q, parents, variables, ratios, offsets, places, screws, turns, qd, inertias,
    lower, upper, lower_variables, upper_variables, is_strict,
):  # fmt: skip
    """Compute the Coriolis matrix of Christoffel symbols: half the derivative of the Coriolis forces by the rates.

    The last five tables are those of `inverse_dynamics_derivatives`.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    axes = each(to_parent, poses, screws)

    def outward(carrier, axis, speed, ratio):
        twist, _ = carrier
        return twist + ratio * speed * axis, commutator(axis, twist)

    twists, axis_rates = scan(outward, (_NO_LINE, _NO_LINE), axes, gather(qd, variables), ratios, parents=parents)

    def of_body(body, pose, twist):
        inertia = placed(body, pose)
        return inertia, _turning(inertia, twist), _direction(momentum_of(inertia, twist))

    def summed(carried, sums):
        return tuple(_plus(a, b) for a, b in zip(carried, sums, strict=True))

    zero = ((0,) * 10, (0,) * 9, (0,) * 3)
    composites = accumulate(summed, zero, each(of_body, inertias, poses, twists), parents=parents)

    def of_joint(sums, axis, axis_rate):
        inertia, turning, p = sums
        momentum = momentum_of(inertia, axis)
        by_speed = (Fraction(1, 2) * _coriolis(turning, p, axis)) + momentum_of(inertia, axis_rate)
        return momentum, tuple(x / 2 for x in _coriolis_transposed(turning, p, axis)), by_speed

    covectors = each(of_joint, composites, axes, axis_rates)

    def of_pair(below, ratio, axis, axis_rate, is_lower, other):
        momentum, coriolis, by_speed = below
        down = _dot(coriolis, _direction(axis)) + (axis_rate & momentum)
        return ratio * other * (axis & by_speed), is_lower * ratio * other * down

    up, down = each(
        of_pair, gather(covectors, lower), gather(ratios, lower), gather(axes, upper), gather(axis_rates, upper),
        is_strict, gather(ratios, upper),
    )  # fmt: skip
    found = scatter(up, (upper_variables, lower_variables), (q, q))
    return scatter(down, (lower_variables, upper_variables), (q, q), start=found)


def _coriolis(turning, p, twist):
    """Return twice the Coriolis map of bodies applied to a twist, a wrench."""
    w = _direction(twist)
    rows = turning[:3], turning[3:6], turning[6:]
    return _line(tuple(2 * x for x in _cross(w, p)), tuple(_dot(row, w) for row in rows))


def _coriolis_transposed(turning, p, twist):
    """Return the transposed map; only the angular part, which multiplies angular velocities."""
    columns = turning[::3], turning[1::3], turning[2::3]
    w, v = _direction(twist), _moment(twist)
    return _plus(tuple(_dot(column, w) for column in columns), tuple(2 * x for x in _cross(p, v)))


def _turning(inertia, twist):
    """Return the angular part of the Coriolis map of a body, a matrix: ``w -> -2 W x (S w) - 2 h x (V x w)``.

    S are the second moments, and W and V the angular and linear parts of the body's twist.
    """
    _, hx, hy, hz, xx, xy, xz, yy, yz, zz = inertia
    half = (xx + yy + zz) / 2
    seconds = ((half - xx, -xy, -xz), (-xy, half - yy, -yz), (-xz, -yz, half - zz))
    h, w, v = (hx, hy, hz), _direction(twist), _moment(twist)
    columns = []
    for k in range(3):
        unit = tuple(int(i == k) for i in range(3))
        turned = _plus(_cross(w, seconds[k]), _cross(h, _cross(v, unit)))
        columns.append([-2 * x for x in turned])
    return tuple(columns[j][i] for i in range(3) for j in range(3))


# Identification.


@kernel(
    q=VALUES, parents=PARENTS, **JOINTS, qd=VALUES, qdd=VALUES, gravity=VECTOR, lower=PAIRS["lower"],
    upper=PAIRS["upper"], upper_variables=PAIRS["upper_variables"], returns=array(SCALAR, "m", "n", 10),
)  # fmt: skip
def torque_regressor(
    q, parents, variables, ratios, offsets, places, screws, turns, qd, qdd, gravity, lower, upper, upper_variables
):
    """Compute the regressor of the joint forces, ``tau = sum(regressor * inertias)``.

    The inertias are those of the table, ten numbers per joint; forces of armatures are omitted.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    axes = each(to_parent, poses, screws)

    motions = _motions(own, parents, screws, gather(qd, variables), gather(qdd, variables), ratios, gravity)

    def entry(axis, pose, motion, ratio):
        # The wrench is linear in the inertia; this is its power on the axis, in the link's frame.
        seen = _to_child(pose, axis)
        units = [tuple(int(k == i) for i in range(10)) for k in range(10)]
        return tuple(ratio * (seen & _inertial_wrench(unit, motion)) for unit in units)

    entries = each(entry, gather(axes, upper), gather(poses, lower), gather(motions, lower), gather(ratios, upper))
    return scatter(entries, (upper_variables, lower), (q, parents))
