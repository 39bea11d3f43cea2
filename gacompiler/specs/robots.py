"""Kinematics and dynamics of any robot: loops over the table of its joints, in link frames and in the base frame.

A robot is a tree of joints, ordered so that parents come first. The frame of a joint is fixed to its link, with the
origin on the joint's axis; if all variables are 0, it is parallel to the base frame. At position x of the joint its
pose in the frame of the parent is the translator of `place` times ``exp(-x / 2 axis)``: the axis of a revolute joint is
a line through the origin, that of a prismatic joint a line at infinity, and both are the joint's twist at unit speed.
Twists, momenta and wrenches are lines; ``twist & wrench`` is a power.

The base may float: then `q` begins with its motor, of any norm and sign, and rates and forces begin with six numbers
in its frame, angular over linear. Its link is a row of the tables with a screw, a ratio and an offset of 0, which
carries all others. Dynamics are computed in the frame of the base, which turns gravity instead of the robot, so they do
not depend on where the base is.

Tables, shared by all configurations of a batch:

    parents     the joint that carries each joint, -1 for the base
    variables   the variable of each joint in `q`: ``x = ratio q[variable] + offset``
    coordinates the place of its rate in `qd`, and of its force
    ratios, offsets
    places      the origin of the frame in that of the parent at x = 0
    screws      the twist of the joint at unit speed in its own frame
    turns       1 for a revolute joint, 0 for a prismatic one
    inertias    mass, mass times centre, and the tensor about the frame's origin, xx xy xz yy yz zz, in the link's frame
    armature    inertia of the motor's rotor, reflected to the joint
    base        the numbers of the base's motor in `q`: one row if it floats, otherwise none
    freedoms    the places of its rates in `qd`, and of its forces
    trunk       its row in the other tables
    units, unit_freedoms, own_freedoms  its twists at unit rates, the freedom of each, and all freedoms for each
    moved       the joints that a floating base carries
    moved_coordinates, moved_freedoms  the coordinates of these joints, and the freedoms of the base, for each
    rates       any m numbers: only their count is used, for results over the coordinates
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
    exp,
    fold,
    gather,
    index,
    kernel,
    log,
    sandwich,
    scan,
    scatter,
    select,
    sin,
    sqrt,
    total,
)
from gacompiler.algebra.catalog import PGA3

LINE, MOTOR, POINT, ROTOR = PGA3.LINE, PGA3.MOTOR, PGA3.POINT, PGA3.ROTOR
VECTOR = array(SCALAR, 3)

POSITIONS, VALUES = array(SCALAR, "k"), array(SCALAR, "m")
PARENTS = index("n")
COORDINATES, RATES = {"coordinates": index("n", into="m")}, {"rates": array(SCALAR, "m", shared=True)}
BASE, FREEDOMS = {"base": index("c", 8, into="k")}, {"freedoms": index("c", 6, into="m")}
TRUNK = {"trunk": index("c", into="n")}
FORCES_ON_BASE = FREEDOMS | TRUNK
OWN = TRUNK | {
    "units": array(LINE, "e", shared=True),
    "unit_freedoms": index("e", into="m"),
    "own_freedoms": index("e", 6, into="m"),
}
MOVED = OWN | {
    "moved": index("f", into="n"),
    "moved_coordinates": index("f", into="m"),
    "moved_freedoms": index("f", 6, into="m"),
}
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


# The base.


def _pose_of_base(*motor):
    """Compute the pose of a floating base from the coefficients of its motor, whose norm and sign do not matter."""
    rotor = assemble(PGA3, dict(zip(("1", "e12", "e13", "e23"), motor[:4], strict=True)))
    ideal = assemble(PGA3, dict(zip(("e01", "e02", "e03", "e0123"), motor[4:], strict=True)))
    size = sum(x * x for x in motor[:4])
    moved = ideal * ~rotor
    return Pose(rotor / sqrt(size), tuple(-2 * moved[name] / size for name in ("e01", "e02", "e03")))


def _base(q, base):
    """Compute the pose of the base in the world, the identity if it is fixed."""
    return fold(lambda _, *motor: _pose_of_base(*motor), Pose(1, (0, 0, 0)), *gather(q, base))


def _turned_base(q, base):
    """Compute the pose of the base relative to its own origin, in the directions of the world."""
    return Pose(fold(lambda _, *motor: _pose_of_base(*motor).rotor, 1, *gather(q, base)), (0, 0, 0))


def _twist_of_base(rates, freedoms):
    """Return the twist of the base in its frame, or its rate of change."""
    return fold(lambda _, *own: _line(own[:3], own[3:]), _NO_LINE, *gather(rates, freedoms))


def _gravity_on_base(q, base, gravity):
    """Compute gravity in the frame of the base."""
    return fold(lambda _, *motor: rotated(~_pose_of_base(*motor).rotor, gravity), tuple(gravity), *gather(q, base))


UNITS = tuple(tuple(int(i == k) for i in range(6)) for k in range(6))


def freedom(k):
    """Return the twist of a floating base in its frame for a unit rate: angular x, y, z, then linear."""
    return _line(UNITS[k][:3], UNITS[k][3:])


def powers_of(wrench):
    """Return the powers of a wrench on the freedoms of the base: torque about its origin over force."""
    return (*_moment(wrench), *_direction(wrench))


def _with_base(found, columns, freedoms, onto):
    """Add six rows of the base, each an array over `freedoms`, to a result over the coordinates."""
    for column, place in zip(columns, freedoms, strict=True):
        found = scatter(column, place, onto, start=found)
    return found


def _with_blocks(found, blocks, onto):
    """Add entries to a matrix over the coordinates: arrays, and the tables of their rows and columns."""
    for entries, rows, columns in blocks:
        found = scatter(entries, (rows, columns), (onto, onto), start=found)
    return found


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
    "variables": index("n", into="k"),
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


def _motion_of_base(q, base, qd, qdd, freedoms, gravity):
    """Return the motion of the base in its frame, relative to free fall."""
    upwards = _upwards(_gravity_on_base(q, base, gravity))
    return Motion(_twist_of_base(qd, freedoms), upwards + _twist_of_base(qdd, freedoms))


def _motions(own, parents, screws, speeds, rates, ratios, start):
    """Compute the motions of the links, each in its own frame, from that of the base."""

    def outward(carrier, pose, axis, speed, rate, ratio):
        own_twist = ratio * speed * axis
        twist = _to_child(pose, carrier.twist) + own_twist
        return Motion(twist, _to_child(pose, carrier.rate) + ratio * rate * axis + commutator(own_twist, twist))

    return scan(outward, start, own, screws, speeds, rates, ratios, parents=parents)


def _inertial_wrench(inertia, motion):
    """Compute the wrench required for a motion of a body: the rate of change of its momentum."""
    return momentum_of(inertia, motion.rate) + commutator(momentum_of(inertia, motion.twist), motion.twist)


@kernel(
    q=POSITIONS, parents=PARENTS, **JOINTS, home_rotors=ROTORS, home_places=VECTORS, **BASE, returns=array(MOTOR, "n")
)
def forward_all(q, parents, variables, ratios, offsets, places, screws, turns, home_rotors, home_places, base):
    """Compute the motors of frames carried by the links, in the world.

    `home_rotors` and `home_places` are their poses in the frames of the joints.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = scan(_after, _base(q, base), own, parents=parents)
    return each(lambda pose, rotor, place: _motor(_after(pose, Pose(rotor, place))), poses, home_rotors, home_places)


@kernel(q=POSITIONS, **JOINTS, tool=MOTOR, **BASE)
def forward(q, variables, ratios, offsets, places, screws, turns, tool, base):
    """Compute the motor of the end effector in the world.

    The tables contain the joints from the base to the end effector, and `tool` is the motor of the end effector in the
    frame of the last joint.
    """

    def after(pose, *joint):
        return _after(pose, _pose(*joint))

    joints = (gather(q, variables), ratios, offsets, places, screws, turns)
    return _motor(fold(after, _base(q, base), *joints)) * tool


TO_TIP = {"q": POSITIONS, **JOINTS, **COORDINATES, "tip": VECTOR}


def _poses_and_tip(start, own, tip):
    """Compute the poses of the joints' frames in the base frame, and the place of the end effector."""
    poses = scan(_after, start, own)
    last = fold(lambda _, pose: pose, start, poses)
    return poses, _plus(last.place, rotated(last.rotor, tip))


def _tip_and_axes(start, own, screws, tip):
    """Compute the place of the end effector, and the twists of the joints at unit speed."""
    poses, point = _poses_and_tip(start, own, tip)
    return point, each(to_parent, poses, screws)


@kernel(**TO_TIP, **BASE, **FREEDOMS, **RATES, returns=array(SCALAR, "m", 6))
def jacobian(q, variables, ratios, offsets, places, screws, turns, coordinates, tip, base, freedoms, rates):
    """Compute the angular and linear velocities of the end effector for unit rates of the variables.

    The tables contain the joints from the base to the end effector, and `tip` is the origin of the end effector in the
    frame of the last joint.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses, point = _poses_and_tip(_turned_base(q, base), own, tip)

    def column(pose, screw, ratio):
        axis = sandwich(pose.rotor, screw)
        away = tuple(x - y for x, y in zip(point, pose.place, strict=True))
        linear = _plus(_moment(axis), _cross(_direction(axis), away))
        return tuple(ratio * x for x in (*_direction(axis), *linear))

    def columns_of_base(*motor):
        turned = Pose(_pose_of_base(*motor).rotor, (0, 0, 0))
        return tuple(column(turned, freedom(k), 1) for k in range(6))

    found = scatter(each(column, poses, screws, ratios), coordinates, rates)
    return _with_base(found, each(columns_of_base, *gather(q, base)), freedoms, rates)


@kernel(**TO_TIP, qd=VALUES, **BASE, **FREEDOMS, returns=array(SCALAR, "m", 6))
def jacobian_rate(q, variables, ratios, offsets, places, screws, turns, coordinates, tip, qd, base, freedoms):
    """Compute the time derivative of `jacobian` for the rates `qd` of the variables."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    start = _turned_base(q, base)
    point, axes = _tip_and_axes(start, own, screws, tip)

    def outward(carrier, axis, speed, ratio):
        twist, _ = carrier
        return twist + ratio * speed * axis, commutator(axis, twist)

    first = sandwich(start.rotor, _twist_of_base(qd, freedoms))
    twists, axis_rates = scan(outward, (first, _NO_LINE), axes, gather(qd, coordinates), ratios)
    final = fold(lambda _, twist: twist, first, twists)
    velocity = _plus(_moment(final), _cross(_direction(final), point))

    def column(axis, axis_rate, ratio):
        turning = _direction(axis_rate)
        swept = _plus(_cross(turning, point), _cross(_direction(axis), velocity))
        linear = _plus(_moment(axis_rate), swept)
        return tuple(ratio * x for x in (*turning, *linear))

    def columns_of_base(*motor):
        rotor = _pose_of_base(*motor).rotor
        turned = [sandwich(rotor, freedom(k)) for k in range(6)]
        return tuple(column(axis, commutator(axis, first), 1) for axis in turned)

    found = scatter(each(column, axes, axis_rates, ratios), coordinates, qd)
    return _with_base(found, each(columns_of_base, *gather(q, base)), freedoms, qd)


@kernel(**TO_TIP, qd=VALUES, **BASE, **FREEDOMS, returns=array(SCALAR, 6))
def velocity(q, variables, ratios, offsets, places, screws, turns, coordinates, tip, qd, base, freedoms):
    """Compute the angular and linear velocities of the end effector, with the tables of `jacobian`."""
    own, start = own_poses(q, variables, ratios, offsets, places, screws, turns), _turned_base(q, base)
    point, axes = _tip_and_axes(start, own, screws, tip)
    first = sandwich(start.rotor, _twist_of_base(qd, freedoms))
    final = fold(
        lambda twist, axis, speed, ratio: twist + ratio * speed * axis,
        first, axes, gather(qd, coordinates), ratios,
    )  # fmt: skip
    return (*_direction(final), *_plus(_moment(final), _cross(_direction(final), point)))


@kernel(**TO_TIP, qd=VALUES, qdd=VALUES, **BASE, **FREEDOMS, returns=array(SCALAR, 6))
def acceleration(q, variables, ratios, offsets, places, screws, turns, coordinates, tip, qd, qdd, base, freedoms):
    """Compute the angular acceleration and that of the origin of the end effector, with the tables of `jacobian`."""
    own, start = own_poses(q, variables, ratios, offsets, places, screws, turns), _turned_base(q, base)
    point, axes = _tip_and_axes(start, own, screws, tip)

    def outward(carried, axis, speed, rate, ratio):
        turned = ratio * speed * axis
        twist = carried.twist + turned
        return Motion(twist, carried.rate + ratio * rate * axis + commutator(turned, carried.twist))

    first = Motion(*(sandwich(start.rotor, _twist_of_base(rates, freedoms)) for rates in (qd, qdd)))
    final = fold(outward, first, axes, gather(qd, coordinates), gather(qdd, coordinates), ratios)
    w, turning = _direction(final.twist), _direction(final.rate)
    speed = _plus(_moment(final.twist), _cross(w, point))
    return (*turning, *_plus(_plus(_moment(final.rate), _cross(turning, point)), _cross(w, speed)))


@kernel(q=POSITIONS, parents=PARENTS, **JOINTS, **BASE, returns=array(LINE, "n"))
def twists_of_joints(q, parents, variables, ratios, offsets, places, screws, turns, base):
    """Compute the twists of the joints at unit speed, as lines in the world."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = scan(_after, _base(q, base), own, parents=parents)
    return each(to_parent, poses, screws)


@kernel(
    q=POSITIONS, parents=PARENTS, **JOINTS, inertias=BODIES,
    lower=index("p", into="n"), upper=index("p", into="n"), rows=index("p", into="m"), columns=index("p", into="m"),
    mirrored=index("p", into="m"), factors=array(SCALAR, "p", shared=True), armature=array(SCALAR, "p", shared=True),
    **MOVED, **RATES,
)  # fmt: skip
def mass_matrix(
    q, parents, variables, ratios, offsets, places, screws, turns, inertias,
    lower, upper, rows, columns, mirrored, factors, armature,
    trunk, units, unit_freedoms, own_freedoms, moved, moved_coordinates, moved_freedoms, rates,
):  # fmt: skip
    """Compute the joint-space mass matrix by the composite rigid body algorithm (Walker and Orin 1982).

    Seven tables list pairs of a joint `lower` and a joint `upper` that carries it or is the same joint: the coordinates
    `rows` of the lower joint and `columns` of the upper joint; `mirrored`, which equals `rows`, or -1 if the joints are
    the same; the product of the ratios of both joints; and the rotor inertia if the joints are the same.
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
    both = (rates, rates)
    found = scatter(entries, (columns, mirrored), both, start=scatter(entries, (rows, columns), both))

    def of_joint(momentum, ratio):
        return tuple(ratio * power for power in powers_of(momentum))

    shared = each(of_joint, gather(momenta, moved), gather(ratios, moved))
    blocks = [(power, moved_freedoms[i], moved_coordinates) for i, power in enumerate(shared)]
    blocks += [(power, moved_coordinates, moved_freedoms[i]) for i, power in enumerate(shared)]
    whole = fold(lambda _, body: body, (0,) * 10, gather(composite, trunk))
    own_rows = each(lambda unit: powers_of(momentum_of(whole, unit)), units)
    return _with_blocks(found, blocks + _square(own_rows, own_freedoms, unit_freedoms), rates)


@kernel(
    q=POSITIONS, parents=PARENTS, **JOINTS, **COORDINATES, qd=VALUES, tau=VALUES, inertias=BODIES, armature=NUMBERS,
    gravity=VECTOR, inverse_ratios=NUMBERS, **BASE, **FORCES_ON_BASE,
)  # fmt: skip
def forward_dynamics(
    q, parents, variables, ratios, offsets, places, screws, turns, coordinates, qd, tau, inertias, armature, gravity,
    inverse_ratios, base, freedoms, trunk,
):  # fmt: skip
    """Compute the joint accelerations from joint forces by the articulated body algorithm (Featherstone 1983).

    Each joint must have its own variable. The result is NaN if a joint moves no inertia. `inverse_ratios` are the
    inverses of the ratios, but 0 for the link of a floating base, which must have an armature.
    """
    frames = _frames(q, parents, variables, ratios, offsets, places, screws, turns)
    return _accelerated(
        frames, q, parents, ratios, coordinates, qd, tau, inertias, armature, gravity, inverse_ratios, base, freedoms,
        trunk,
    )[0]  # fmt: skip


def _frames(q, parents, variables, ratios, offsets, places, screws, turns):
    """Compute the poses and the axes of the joints in the base frame."""
    poses = in_base(own_poses(q, variables, ratios, offsets, places, screws, turns), parents)
    return poses, each(to_parent, poses, screws)


def _accelerated(
    frames, q, parents, ratios, coordinates, qd, tau, inertias, armature, gravity, inverse_ratios, base, freedoms, trunk
):
    """Compute `forward_dynamics`, and what its first pass gives `inverse_mass_matrix`."""
    poses, axes = frames
    speeds = each(lambda speed, ratio: speed * ratio, gather(qd, coordinates), ratios)
    first = _twist_of_base(qd, freedoms)
    twists = scan(lambda carrier, axis, speed: carrier + speed * axis, first, axes, speeds, parents=parents)

    def inward(carried, pose, body, axis, twist, speed, force, ratio, rotor):
        outer, wrench = carried
        own_body = placed(body, pose)
        apparent = _apparent(outer, own_body, axis, rotor)
        wrench = wrench + commutator(momentum_of(own_body, twist), twist)
        rest = force * ratio - (axis & wrench)
        drag = speed * commutator(axis, twist)
        passed = wrench + _articulated(apparent.left.inertia, drag) + (rest * apparent.size) * apparent.momentum
        return (apparent.left, passed), (apparent.momentum, apparent.size, rest, drag)

    joints = (poses, inertias, axes, twists, speeds, gather(tau, coordinates), inverse_ratios, armature)
    carried, kept = accumulate(inward, (_NOTHING, _NO_LINE), *joints, parents=parents, keep=True)
    momenta, sizes, rests, drags = kept

    def outward(carrier, momentum, size, rest, drag, axis):
        rate, _ = carrier
        rate = rate + drag
        own_rate = size * (rest - (rate & momentum))
        return rate + own_rate * axis, own_rate

    def rate_of_base(_, body, wrench, *forces):
        rest = [force - power for force, power in zip(forces, powers_of(wrench), strict=True)]
        return _twist_under(_factored(body), rest)

    upwards = _upwards(_gravity_on_base(q, base, gravity))
    start = fold(rate_of_base, upwards, *gather(carried, trunk), *gather(tau, freedoms))
    _, rates = scan(outward, (start, 0), momenta, sizes, rests, drags, axes, parents=parents)
    found = scatter(each(lambda rate, ratio: rate * ratio, rates, inverse_ratios), coordinates, qd)
    # The acceleration of the base is that relative to free fall.
    own_rate = start - upwards
    columns = each(lambda *_: (*_direction(own_rate), *_moment(own_rate)), *gather(tau, freedoms))
    return _with_base(found, columns, freedoms, qd), (carried[0], momenta, sizes)


def _factored(body):
    """Factorise the inertia of a floating base, ``L^T D L``: six inverses of D, and the fifteen entries of L by rows.

    The last freedoms, which are linear, are eliminated first.
    """
    angular, mixed, linear = _symmetric(body.inertia[:6]), body.inertia[6:15], _symmetric(body.inertia[15:])
    rows = [[*angular[i], *mixed[3 * i : 3 * i + 3]] for i in range(3)]
    rows += [[*mixed[i::3], *linear[i]] for i in range(3)]
    sizes, factors = list[Any]([None] * 6), list[Any]([None] * 6)
    for k in reversed(range(6)):
        sizes[k] = _inverse(rows[k][k], body.spread if k < 3 else body.mass)
        factors[k] = [sizes[k] * x for x in rows[k][:k]]
        for i, factor in enumerate(factors[k]):
            for j in range(i + 1):
                rows[i][j] = rows[i][j] - factor * rows[k][j]
    return (*sizes, *(x for row in factors for x in row))


def _twist_under(factored, forces):
    """Compute the rates of a floating base under six forces, as a twist."""
    sizes, factors, found = factored[:6], factored[6:], list(forces)
    rows = [factors[k * (k - 1) // 2 : k * (k + 1) // 2] for k in range(6)]
    for k in reversed(range(6)):
        for i in range(k):
            found[i] = found[i] - rows[k][i] * found[k]
    for k in range(6):
        found[k] = sizes[k] * found[k]
        for i in range(k):
            found[k] = found[k] - rows[k][i] * found[i]
    return _line(found[:3], found[3:])


def _inverse(inertia, terms):
    """Return the inverse of an apparent inertia, a sum that may cancel.

    It is 0 / 0 if the inertia is no larger than the rounding errors of its terms, or NaN.
    """
    moves = absolute(inertia) > NO_INERTIA * absolute(terms)
    return select(moves, 1, 0) / select(moves, inertia, 0)


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
    mass, spread = carried.mass + body[0], carried.spread + body[4] + body[7] + body[9]
    w, v = _direction(axis), _moment(axis)
    size = _inverse(apparent, spread * _dot(w, w) + mass * _dot(v, v) + rotor)
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


PUSHES = {
    "below": index("p"), "carriers": index("p", into="n"), "is_own": array(SCALAR, "p", shared=True),
    "before": index("r"), "joints": index("r", into="n"), "pairs": index("r", into="p"),
    "is_carrier": array(SCALAR, "r", shared=True), "factors": array(SCALAR, "r", shared=True),
    "rows": index("r", into="m"), "columns": index("r", into="m"), "mirrored": index("r", into="m"),
}  # fmt: skip
FIRST_AND_SECOND = {name: index("s", into="m") for name in ("first_rows", "second_rows", "first_mirrored")}


@kernel(
    q=POSITIONS, parents=PARENTS, **JOINTS, inertias=BODIES, armature=NUMBERS,
    **PUSHES, **FORCES_ON_BASE, at_base=index("g", into="p"), moved_coordinates=index("g", into="m"),
    moved_freedoms=index("g", 6, into="m"), moved_factors=array(SCALAR, "g", shared=True),
    first=index("s", into="g"), second=index("s", into="g"), **FIRST_AND_SECOND, **RATES,
)  # fmt: skip
def inverse_mass_matrix(
    q, parents, variables, ratios, offsets, places, screws, turns, inertias, armature,
    below, carriers, is_own, before, joints, pairs, is_carrier, factors, rows, columns, mirrored,
    freedoms, trunk, at_base, moved_coordinates, moved_freedoms, moved_factors,
    first, second, first_rows, second_rows, first_mirrored, rates,
):  # fmt: skip
    """Compute the inverse of `mass_matrix` by articulated bodies: accelerations under a unit force of each joint.

    Each joint must have its own variable. The result is NaN for the tree of a joint that moves no inertia.

    The three tables over p list each pair of a pushed joint and a joint that carries it or is the same joint: the
    preceding pair, whose joint is carried by this one (-1 if the joint is the pushed one), the joint, and whether it is
    the pushed one. The first pair is joint 0 with itself. The other tables, over r, list each pair of a pushed joint
    and a moved joint of the same tree that does not come after it: the pair of the moved joint's parent, or -1; the
    moved joint; the pair over p of the same joints if the moved joint carries the pushed one (`is_carrier` is 1),
    otherwise any pair; the inverse of the product of their ratios; the coordinates of the moved and of the pushed
    joint; and `mirrored`, which equals `columns`, or -1 if the joints are the same.

    A floating base is at rest in these pairs, but has a pair over p with each pushed joint, `at_base`. The trees are
    those of the joints on it, which exchange forces through the base: with its own inverse inertia A and the wrenches W
    on it under unit forces, ``W^T A W`` is added. The tables over g list its joints, with the inverses of their ratios,
    and those over s all pairs of them.
    """
    poses, axes = _frames(q, parents, variables, ratios, offsets, places, screws, turns)

    def inward(carried, pose, body, axis, rotor):
        apparent = _apparent(carried, placed(body, pose), axis, rotor)
        return apparent.left, (apparent.momentum, apparent.size)

    left, (momenta, sizes) = accumulate(inward, _NOTHING, poses, inertias, axes, armature, parents=parents, keep=True)
    return _pushed(
        axes, left, momenta, sizes, below, carriers, is_own, before, joints, pairs, is_carrier, factors, rows, columns,
        mirrored, freedoms, trunk, at_base, moved_coordinates, moved_freedoms, moved_factors,
        first, second, first_rows, second_rows, first_mirrored, rates,
    )  # fmt: skip


def _pushed(
    axes, left, momenta, sizes, below, carriers, is_own, before, joints, pairs, is_carrier, factors, rows, columns,
    mirrored, freedoms, trunk, at_base, moved_coordinates, moved_freedoms, moved_factors,
    first, second, first_rows, second_rows, first_mirrored, rates,
):  # fmt: skip
    """Compute `inverse_mass_matrix` from the articulated bodies."""

    def push(carried, axis, momentum, size, is_pushed):
        wrench, _ = carried
        rate = size * (is_pushed - (axis & wrench))
        return wrench + rate * momentum, rate

    at_carriers = gather((axes, momenta, sizes), carriers)
    wrenches, pushed = scan(push, (_NO_LINE, 0), *at_carriers, is_own, parents=below)

    def outward(carrier, axis, momentum, size, own_rate, is_pushed):
        twist, _ = carrier
        rate = is_pushed * own_rate - size * (twist & momentum)
        return twist + rate * axis, rate

    at_joints = gather((axes, momenta, sizes), joints)
    _, found = scan(outward, (_NO_LINE, 0), *at_joints, gather(pushed, pairs), is_carrier, parents=before)
    entries = each(lambda rate, factor: factor * rate, found, factors)
    both = (rates, rates)
    own_entries = scatter(entries, (rows, columns), both, start=scatter(entries, (mirrored, rows), both))

    factored = fold(lambda _, body: _factored(body), (0,) * 21, gather(left, trunk))

    def response(wrench, factor):
        # The wrench of the joints on the base is opposite to that of the base on the joints.
        wrench = factor * wrench
        return wrench, _twist_under(factored, [-power for power in powers_of(wrench)])

    forces, twists = each(response, gather(wrenches, at_base), moved_factors)
    exchanged = each(lambda wrench, twist: -(twist & wrench), gather(forces, first), gather(twists, second))
    rates_of_base = each(lambda twist: (*_direction(twist), *_moment(twist)), twists)
    blocks = [(exchanged, first_rows, second_rows), (exchanged, second_rows, first_mirrored)]
    for i, entry in enumerate(rates_of_base):
        blocks += [(entry, moved_freedoms[i], moved_coordinates), (entry, moved_coordinates, moved_freedoms[i])]

    def own_block(body):
        # Factors that are taken from outside would be applied to units outside the loop, for a fixed base, too.
        columns = [_twist_under(_factored(body), unit) for unit in UNITS]
        return tuple((*_direction(column), *_moment(column)) for column in columns)

    own = each(own_block, gather(left, trunk))
    blocks += [(x, freedoms[i], freedoms[k]) for k, column in enumerate(own) for i, x in enumerate(column)]
    return _with_blocks(own_entries, blocks, rates)


@kernel(
    q=POSITIONS, parents=PARENTS, **JOINTS, **COORDINATES, qd=VALUES, qdd=VALUES, inertias=BODIES, armature=NUMBERS,
    gravity=VECTOR, **BASE, **FORCES_ON_BASE,
)  # fmt: skip
def inverse_dynamics(
    q, parents, variables, ratios, offsets, places, screws, turns, coordinates, qd, qdd, inertias, armature, gravity,
    base, freedoms, trunk,
):  # fmt: skip
    """Compute the joint forces for given accelerations by Newton-Euler recursion (Luh, Walker and Paul 1980).

    The forces of revolute joints are torques.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)

    def inward(carried, motion, pose, inertia, axis):
        wrench = _inertial_wrench(inertia, motion) + carried
        return to_parent(pose, wrench), axis & wrench

    start = _motion_of_base(q, base, qd, qdd, freedoms, gravity)
    motions = _motions(own, parents, screws, gather(qd, coordinates), gather(qdd, coordinates), ratios, start)
    wrenches, forces = accumulate(inward, _NO_LINE, motions, own, inertias, screws, parents=parents, keep=True)
    joints = each(
        lambda force, inertia, rate, ratio: ratio * (force + inertia * ratio * rate),
        forces, armature, gather(qdd, coordinates), ratios,
    )  # fmt: skip
    return _with_base(scatter(joints, coordinates, qd), each(powers_of, gather(wrenches, trunk)), freedoms, qd)


@kernel(
    q=POSITIONS, parents=PARENTS, **JOINTS, **COORDINATES, inertias=BODIES, gravity=VECTOR, **BASE, **FORCES_ON_BASE,
    **RATES,
)  # fmt: skip
def gravity_forces(
    q, parents, variables, ratios, offsets, places, screws, turns, coordinates, inertias, gravity,
    base, freedoms, trunk, rates,
):  # fmt: skip
    """Compute the joint forces and torques that hold the robot at rest."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    turned = _gravity_on_base(q, base, gravity)

    def inward(carried, pose, inertia, screw, ratio):
        mass, first = _first_moment(inertia, pose)
        force = tuple(-mass * g for g in turned)
        wrench = carried + _line(force, tuple(-x for x in _cross(first, turned)))
        return wrench, ratio * (to_parent(pose, screw) & wrench)

    wrenches, forces = accumulate(inward, _NO_LINE, poses, inertias, screws, ratios, parents=parents, keep=True)
    return _with_base(scatter(forces, coordinates, rates), each(powers_of, gather(wrenches, trunk)), freedoms, rates)


# Energies and momenta.


@kernel(q=POSITIONS, parents=PARENTS, **JOINTS, **COORDINATES, qd=VALUES, inertias=BODIES, armature=NUMBERS, **FREEDOMS)
def kinetic_energy(
    q, parents, variables, ratios, offsets, places, screws, turns, coordinates, qd, inertias, armature, freedoms
):
    """Compute the kinetic energy, including that of the motors' rotors."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)

    def outward(carrier, pose, axis, speed, ratio):
        return _to_child(pose, carrier) + ratio * speed * axis

    speeds = gather(qd, coordinates)
    twists = scan(outward, _twist_of_base(qd, freedoms), own, screws, speeds, ratios, parents=parents)

    def energy(twist, inertia, rotor, speed, ratio):
        return ((twist & momentum_of(inertia, twist)) + rotor * (ratio * speed) * (ratio * speed)) / 2

    return total(energy, twists, inertias, armature, speeds, ratios)


@kernel(q=POSITIONS, parents=PARENTS, **JOINTS, inertias=BODIES, gravity=VECTOR, **BASE)
def potential_energy(q, parents, variables, ratios, offsets, places, screws, turns, inertias, gravity, base):
    """Compute the potential energy, which is 0 if all centres of mass are at the origin."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = scan(_after, _base(q, base), own, parents=parents)
    return total(lambda inertia, pose: -_dot(gravity, _first_moment(inertia, pose)[1]), inertias, poses)


@kernel(q=POSITIONS, parents=PARENTS, **JOINTS, inertias=BODIES, **BASE)
def centre_of_mass(q, parents, variables, ratios, offsets, places, screws, turns, inertias, base):
    """Compute the mass of the moving links and their centre of mass in the world."""
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = scan(_after, _base(q, base), own, parents=parents)

    mass, moment = total(_first_moment, inertias, poses)
    return mass, assemble(
        PGA3, {"e123": 1, **dict(zip(("e032", "e013", "e021"), (x / mass for x in moment), strict=True))}
    )


@kernel(
    q=POSITIONS, parents=PARENTS, **JOINTS, **COORDINATES, inertias=BODIES, **BASE, **FORCES_ON_BASE, **RATES,
    returns=array(SCALAR, "m", 6),
)  # fmt: skip
def centroidal_momentum_matrix(
    q, parents, variables, ratios, offsets, places, screws, turns, coordinates, inertias, base, freedoms, trunk, rates
):
    """Compute the momenta about the centre of mass for unit rates of the variables.

    A row contains an angular momentum about the centre of mass, then a linear momentum.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = scan(_after, _turned_base(q, base), own, parents=parents)
    bodies = each(placed, inertias, poses)
    composite = accumulate(_plus, (0,) * 10, bodies, parents=parents)
    mass, *moment = total(lambda body: tuple(body[:4]), bodies)
    centre = tuple(x / mass for x in moment)

    def column(body, pose, screw, ratio):
        momentum = momentum_of(body, to_parent(pose, screw))
        force = tuple(ratio * x for x in _direction(momentum))
        about = tuple(ratio * x - y for x, y in zip(_moment(momentum), _cross(centre, force), strict=True))
        return (*about, *force)

    def columns_of_base(body, *motor):
        rotor = _pose_of_base(*motor).rotor
        angular = tuple(column(body, Pose(rotor, (0, 0, 0)), freedom(k), 1) for k in range(3))
        linear = [tuple(mass * x for x in rotated(rotor, UNITS[k][:3])) for k in range(3)]
        return (*angular, *((0, 0, 0, *momentum) for momentum in linear))

    found = scatter(each(column, composite, poses, screws, ratios), coordinates, rates)
    return _with_base(found, each(columns_of_base, gather(composite, trunk), *gather(q, base)), freedoms, rates)


@kernel(
    q=POSITIONS, parents=PARENTS, **JOINTS, **COORDINATES, qd=VALUES, inertias=BODIES, **BASE, **FREEDOMS,
    returns=array(SCALAR, 6),
)  # fmt: skip
def centroidal_momentum(
    q, parents, variables, ratios, offsets, places, screws, turns, coordinates, qd, inertias, base, freedoms
):
    """Compute the angular momentum about the centre of mass, then the linear momentum."""
    own, start = own_poses(q, variables, ratios, offsets, places, screws, turns), _turned_base(q, base)
    poses = scan(_after, start, own, parents=parents)
    speeds = gather(qd, coordinates)
    still = sandwich(start.rotor, _twist_of_base(qd, freedoms))

    def outward(carried, pose, screw, speed, ratio):
        return carried + ratio * speed * to_parent(pose, screw)

    twists = scan(outward, still, poses, screws, speeds, ratios, parents=parents)

    def of_body(inertia, pose, twist):
        mass, first = _first_moment(inertia, pose)
        seen = momentum_of(inertia, _to_child(pose, twist))
        return mass, first, to_parent(pose, seen)

    mass, first, momentum = total(of_body, inertias, poses, twists)
    force = _direction(momentum)
    return (*_minus(_moment(momentum), _cross(tuple(x / mass for x in first), force)), *force)


# Motions of configurations.


JOINT_PLACES = {"variables": index("j", into="k"), "coordinates": index("j", into="m")}


def unit_motor(*numbers):
    """Return the unit motor of an even element ``x``: ``x (x ~x)**(-1/2)``, in which ``x ~x`` is a dual number."""
    x = assemble(PGA3, dict(zip(MOTOR.blades, numbers, strict=True)))
    study = x * ~x
    size = study["1"]
    return x * (1 - study["e0123"] / (2 * size) * assemble(PGA3, {"e0123": 1})) / sqrt(size)


@kernel(q=POSITIONS, v=VALUES, **JOINT_PLACES, **BASE, **FREEDOMS)
def integrate(q, v, variables, coordinates, base, freedoms):
    """Compute the configuration reached with constant rates `v` in unit time; a floating base moves along a screw.

    The tables over j list the variables of the joints and their coordinates.
    """
    found = scatter(each(lambda x, rate: x + rate, gather(q, variables), gather(v, coordinates)), variables, q)

    def moved(motor, rates):
        end = unit_motor(*motor) * exp(-_line(rates[:3], rates[3:]) / 2)
        return tuple(unit_motor(*(end[name] for name in MOTOR.blades))[name] for name in MOTOR.blades)

    return _with_base(found, each(moved, gather(q, base), gather(v, freedoms)), base, q)


@kernel(q0=POSITIONS, q1=POSITIONS, **JOINT_PLACES, **BASE, **FREEDOMS, **RATES)
def difference(q0, q1, variables, coordinates, base, freedoms, rates):
    """Compute the constant rates that lead from `q0` to `q1` in unit time, with an angle of the base in [0, pi]."""
    joints = each(lambda start, end: end - start, gather(q0, variables), gather(q1, variables))

    def twist(start, end):
        found = -2 * log(~unit_motor(*start) * unit_motor(*end))
        return (*_direction(found), *_moment(found))

    found = scatter(joints, coordinates, rates)
    return _with_base(found, each(twist, gather(q0, base), gather(q1, base)), freedoms, rates)


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
    "lower_coordinates": index("p", into="m"),
    "upper_coordinates": index("p", into="m"),
    "is_strict": array(SCALAR, "p", shared=True),
}


@kernel(
    q=POSITIONS, parents=PARENTS, **JOINTS, **COORDINATES, qd=VALUES, qdd=VALUES, inertias=BODIES, gravity=VECTOR,
    **PAIRS, **BASE, **FREEDOMS, **MOVED,
)  # fmt: skip
def inverse_dynamics_derivatives(
    q, parents, variables, ratios, offsets, places, screws, turns, coordinates, qd, qdd, inertias, gravity,
    lower, upper, lower_coordinates, upper_coordinates, is_strict,
    base, freedoms, trunk, units, unit_freedoms, own_freedoms, moved, moved_coordinates, moved_freedoms,
):  # fmt: skip
    """Compute the derivatives of the joint forces with respect to the variables and to their rates, two matrices.

    Those with respect to the pose of a floating base are along small motions in its frame.

    Five tables list pairs of a joint `lower` and a joint `upper` that carries it or is the same joint: their
    coordinates, and 1 if the joints are different, otherwise 0. Armatures are omitted, since their forces depend on
    neither.

    The formulas are those of Singh, Russo and Wensing (*IEEE Robotics and Autom. Letters* 7:1635, 2022), whose Coriolis
    map of a body has an angular part only: ``B w = (2 w x P, N w)``.
    """
    frames = _frames(q, parents, variables, ratios, offsets, places, screws, turns)
    return _derivatives(
        frames, q, parents, ratios, coordinates, qd, qdd, inertias, gravity,
        lower, upper, lower_coordinates, upper_coordinates, is_strict,
        base, freedoms, trunk, units, unit_freedoms, own_freedoms, moved, moved_coordinates, moved_freedoms,
    )  # fmt: skip


def _derivatives(
    frames, q, parents, ratios, coordinates, qd, qdd, inertias, gravity,
    lower, upper, lower_coordinates, upper_coordinates, is_strict,
    base, freedoms, trunk, units, unit_freedoms, own_freedoms, moved, moved_coordinates, moved_freedoms,
):  # fmt: skip
    """Compute `inverse_dynamics_derivatives`."""
    poses, axes = frames
    speeds = each(lambda speed, ratio: ratio * speed, gather(qd, coordinates), ratios)
    rates = each(lambda rate, ratio: ratio * rate, gather(qdd, coordinates), ratios)

    def outward(carrier, axis, speed, rate):
        twist = carrier.twist + speed * axis
        axis_rate = commutator(axis, carrier.twist)
        return Change(
            twist,
            carrier.rate + rate * axis + speed * axis_rate,
            axis_rate,
            commutator(axis, carrier.rate) + commutator(axis_rate, carrier.twist),
        )

    upwards = _upwards(_gravity_on_base(q, base, gravity))
    first = _twist_of_base(qd, freedoms)
    start = Change(first, upwards + _twist_of_base(qdd, freedoms), _NO_LINE, _NO_LINE)
    changes = scan(outward, start, axes, speeds, rates, parents=parents)

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
    above, below = (upper_coordinates, lower_coordinates), (lower_coordinates, upper_coordinates)
    by_q = scatter(found.below_by_q, below, (qd, qd), start=scatter(found.above_by_q, above, (qd, qd)))
    by_qd = scatter(found.below_by_qd, below, (qd, qd), start=scatter(found.above_by_qd, above, (qd, qd)))

    # The base is carried by the world, which is at rest and accelerates upwards. Its own axes move with it.
    rises = [commutator(freedom(k), upwards) for k in range(3)]
    turnings = [commutator(freedom(k), first) for k in range(6)]

    def with_base(below, ratio):
        rows = powers_of(below.of_carriers), powers_of(below.by_speed)
        by_place = tuple(rise & below.momentum for rise in rises)
        by_speed = [
            _dot(below.coriolis, UNITS[k][:3]) + (turning & below.momentum) for k, turning in enumerate(turnings)
        ]
        return tuple(tuple(ratio * x for x in part) for part in (*rows, by_place, tuple(by_speed)))

    whole = fold(lambda _, sums: sums, zero, gather(composites, trunk))

    def of_base(unit):
        by_place = momentum_of(whole.inertia, commutator(unit, upwards))
        by_speed = _coriolis(whole.turning, whole.momentum, unit) + momentum_of(whole.inertia, commutator(unit, first))
        return powers_of(by_place), powers_of(by_speed)

    at_moved = gather((covectors, ratios), moved)
    rows_by_q, rows_by_qd, columns_by_q, columns_by_qd = each(with_base, *at_moved)
    own_by_q, own_by_qd = each(of_base, units)
    places = moved_coordinates, moved_freedoms, own_freedoms, unit_freedoms
    by_q = _with_blocks(by_q, _blocks_of_base(rows_by_q, columns_by_q, own_by_q, *places), qd)
    return by_q, _with_blocks(by_qd, _blocks_of_base(rows_by_qd, columns_by_qd, own_by_qd, *places), qd)


@kernel(
    q=POSITIONS, parents=PARENTS, **JOINTS, **COORDINATES, qd=VALUES, tau=VALUES, inertias=BODIES, armature=NUMBERS,
    gravity=VECTOR, inverse_ratios=NUMBERS,
    lower=index("u", into="n"), upper=index("u", into="n"), lower_coordinates=index("u", into="m"),
    upper_coordinates=index("u", into="m"), is_strict=array(SCALAR, "u", shared=True), **PUSHES, **BASE, **FREEDOMS,
    **MOVED, at_base=index("f", into="p"), moved_factors=array(SCALAR, "f", shared=True),
    first=index("s", into="f"), second=index("s", into="f"), **FIRST_AND_SECOND,
)  # fmt: skip
def dynamics_derivatives(
    q, parents, variables, ratios, offsets, places, screws, turns, coordinates, qd, tau, inertias, armature, gravity,
    inverse_ratios, lower, upper, lower_coordinates, upper_coordinates, is_strict,
    below, carriers, is_own, before, joints, pairs, is_carrier, factors, rows, columns, mirrored,
    base, freedoms, trunk, units, unit_freedoms, own_freedoms, moved, moved_coordinates, moved_freedoms,
    at_base, moved_factors, first, second, first_rows, second_rows, first_mirrored,
):  # fmt: skip
    """Compute `inverse_dynamics_derivatives` where joint forces are given, and `inverse_mass_matrix`: three matrices.

    The tables are those of both and of `forward_dynamics`.
    """
    frames = _frames(q, parents, variables, ratios, offsets, places, screws, turns)
    qdd, (left, momenta, sizes) = _accelerated(
        frames, q, parents, ratios, coordinates, qd, tau, inertias, armature, gravity, inverse_ratios, base, freedoms,
        trunk,
    )  # fmt: skip
    by_q, by_qd = _derivatives(
        frames, q, parents, ratios, coordinates, qd, qdd, inertias, gravity,
        lower, upper, lower_coordinates, upper_coordinates, is_strict,
        base, freedoms, trunk, units, unit_freedoms, own_freedoms, moved, moved_coordinates, moved_freedoms,
    )  # fmt: skip
    inverse = _pushed(
        frames[1], left, momenta, sizes, below, carriers, is_own, before, joints, pairs, is_carrier, factors, rows,
        columns, mirrored, freedoms, trunk, at_base, moved_coordinates, moved_freedoms, moved_factors,
        first, second, first_rows, second_rows, first_mirrored, qd,
    )  # fmt: skip
    return by_q, by_qd, inverse


def _square(rows, own_freedoms, unit_freedoms):
    """Return the entries of the block of the base for `_with_blocks`: six rows, each an array over its units."""
    return [(x, own_freedoms[i], unit_freedoms) for i, x in enumerate(rows)]


def _blocks_of_base(rows, columns, own, moved_coordinates, moved_freedoms, own_freedoms, unit_freedoms):
    """Return the entries of a matrix in the rows and columns of the base, for `_with_blocks`."""
    blocks = [(entries, moved_freedoms[i], moved_coordinates) for i, entries in enumerate(rows)]
    blocks += [(entries, moved_coordinates, moved_freedoms[i]) for i, entries in enumerate(columns)]
    return blocks + _square(own, own_freedoms, unit_freedoms)


@kernel(
    q=POSITIONS, parents=PARENTS, **JOINTS, **COORDINATES, qd=VALUES, inertias=BODIES, **PAIRS, **FREEDOMS, **MOVED,
)  # fmt: skip
def coriolis_matrix(
    q, parents, variables, ratios, offsets, places, screws, turns, coordinates, qd, inertias,
    lower, upper, lower_coordinates, upper_coordinates, is_strict,
    freedoms, trunk, units, unit_freedoms, own_freedoms, moved, moved_coordinates, moved_freedoms,
):  # fmt: skip
    """Compute the Coriolis matrix of Christoffel symbols: half the derivative of the Coriolis forces by the rates.

    The tables are those of `inverse_dynamics_derivatives`.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    axes = each(to_parent, poses, screws)

    def outward(carrier, axis, speed, ratio):
        twist, _ = carrier
        return twist + ratio * speed * axis, commutator(axis, twist)

    first = _twist_of_base(qd, freedoms)
    twists, axis_rates = scan(outward, (first, _NO_LINE), axes, gather(qd, coordinates), ratios, parents=parents)

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
    found = scatter(up, (upper_coordinates, lower_coordinates), (qd, qd))
    found = scatter(down, (lower_coordinates, upper_coordinates), (qd, qd), start=found)
    turnings = [commutator(freedom(k), first) for k in range(6)]

    def with_base(below, ratio):
        momentum, coriolis, by_speed = below
        columns = [_dot(coriolis, UNITS[k][:3]) + (turning & momentum) for k, turning in enumerate(turnings)]
        return tuple(ratio * x for x in powers_of(by_speed)), tuple(ratio * x for x in columns)

    inertia, turning, p = fold(lambda _, sums: sums, zero, gather(composites, trunk))

    def of_base(unit):
        return powers_of((Fraction(1, 2) * _coriolis(turning, p, unit)) + momentum_of(inertia, commutator(unit, first)))

    rows, columns = each(with_base, gather(covectors, moved), gather(ratios, moved))
    own_rows = each(of_base, units)
    places = moved_coordinates, moved_freedoms, own_freedoms, unit_freedoms
    blocks = _blocks_of_base(rows, columns, own_rows, *places)
    return _with_blocks(found, blocks, qd)


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
    q=POSITIONS, parents=PARENTS, **JOINTS, **COORDINATES, qd=VALUES, qdd=VALUES, gravity=VECTOR,
    lower=PAIRS["lower"], upper=PAIRS["upper"], upper_coordinates=PAIRS["upper_coordinates"], **BASE, **FREEDOMS,
    moved=index("f", into="n"), moved_freedoms=index("f", 6, into="m"), returns=array(SCALAR, "m", "n", 10),
)  # fmt: skip
def torque_regressor(
    q, parents, variables, ratios, offsets, places, screws, turns, coordinates, qd, qdd, gravity,
    lower, upper, upper_coordinates, base, freedoms, moved, moved_freedoms,
):  # fmt: skip
    """Compute the regressor of the joint forces, ``tau = sum(regressor * inertias)``.

    The inertias are those of the table, ten numbers per joint; forces of armatures are omitted. `moved` are all links
    of a robot whose base floats, that of the base included.
    """
    own = own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = in_base(own, parents)
    axes = each(to_parent, poses, screws)
    start = _motion_of_base(q, base, qd, qdd, freedoms, gravity)
    motions = _motions(own, parents, screws, gather(qd, coordinates), gather(qdd, coordinates), ratios, start)

    def wrenches_of(pose, motion):
        # The wrench is linear in the inertia.
        units = [tuple(int(k == i) for i in range(10)) for k in range(10)]
        return tuple(to_parent(pose, _inertial_wrench(unit, motion)) for unit in units)

    wrenches = each(wrenches_of, poses, motions)

    def entry(axis, ratio, *own_wrenches):
        return tuple(ratio * (axis & wrench) for wrench in own_wrenches)

    entries = each(entry, gather(axes, upper), gather(ratios, upper), *gather(wrenches, lower))
    found = scatter(entries, (upper_coordinates, lower), (qd, parents))

    def rows_of_base(*own_wrenches):
        return tuple(zip(*map(powers_of, own_wrenches), strict=True))

    rows = each(rows_of_base, *gather(wrenches, moved))
    for i, row in enumerate(rows):
        found = scatter(row, (moved_freedoms[i], moved), (qd, parents), start=found)
    return found
