"""Plane-based geometric algebra G(3,0,1) of Euclidean space: points, lines, planes and rigid motions.

Planes are vectors: ``a e1 + b e2 + c e3 + d e0`` is the plane ``a x + b y + c z + d = 0``. Lines are bivectors: the
line of direction ``d`` through ``p`` is ``d1 e23 - d2 e13 + d3 e12 + m1 e01 + m2 e02 + m3 e03``, where ``m = p x d`` is
the moment. Points are trivectors: ``x e032 + y e013 + z e021 + e123``. A trivector without the term ``e123`` is a
direction, which is invariant under translations.

A motor ``m`` moves every element by the same product ``m x ~m``. The motor ``exp(-angle/2 line)`` is the right-handed
rotation about the unit line ``line``, and ``1 - (x e01 + y e02 + z e03)/2`` translates by (x, y, z). The product ``m
n`` applies ``n`` first. ``m`` and ``-m`` represent the same motion. Angles are in radians; lengths are in the units of
the coordinates.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import PGA3, VGA3
from gacompiler.specs.families.motors import motors
from gacompiler.specs.families.plane_based import (
    coordinates,
    direction_of_line,
    dot,
    foot_on_unit_line,
    gap_of_parallels,
    motions,
    points_and_lines,
    products,
    twists,
)
from gacompiler.specs.families.rotations import quaternion_of_matrix, quaternion_of_motion, rotations_of_space

POINT, DIRECTION, LINE, PLANE, TRIVECTOR = PGA3.POINT, PGA3.DIRECTION, PGA3.LINE, PGA3.PLANE, PGA3.TRIVECTOR
MOTOR, ROTOR, TRANSLATOR, EVEN = PGA3.MOTOR, PGA3.ROTOR, PGA3.TRANSLATOR, PGA3.EVEN
UNIT_LINE, UNIT_PLANE, FULL = PGA3.UNIT_LINE, PGA3.UNIT_PLANE, PGA3.full
VECTOR, QUATERNION, MATRIX = array(SCALAR, 3), array(SCALAR, 4), array(SCALAR, 4, 4)
HOMOGENEOUS = array(SCALAR, 4)
BODY = array(SCALAR, 10)
PLANE_OF_EVEN = PGA3.layout("PLANE_OF_EVEN", "e12 e13 e23 e0123")
"""Planes in the even algebra, where lines are bivectors and points are ``1 + I x``."""

ORIGIN = PGA3.multivector({"e123": 1})
AXES = tuple(PGA3.multivector({name: 1}) for name in ("e032", "e013", "e021"))
AXIS_X, AXIS_Z = PGA3.multivector({"e23": 1}), PGA3.multivector({"e12": 1})
PSEUDOSCALAR = PGA3.multivector({"e0123": 1})
NO_TURN = Fraction(1, 10**60)
"""Squared rotation angles up to this value are treated as 0: the motion is a translation."""
PARALLEL = Fraction(1, 10**24)
"""Squared sines up to this value are treated as rounding errors."""
MUCH_SMALLER = Fraction(1, 10**6)
NEARLY_OPPOSITE, ROUNDING = Fraction(1, 10**4), Fraction(1, 10**28)
LOCKED = Fraction(5, 10**15)
"""Sines of half angles up to this value are treated as gimbal lock."""
HALF = Fraction(1, 2)


def _rotor(w, x, y, z):
    """Return the rotor of the quaternion ``w + x i + y j + z k``."""
    return ga.assemble(PGA3, {"1": w, "e12": -z, "e13": y, "e23": -x})


def _translator(v):
    return ga.assemble(PGA3, {"1": 1, "e01": -v[0] / 2, "e02": -v[1] / 2, "e03": -v[2] / 2})


def _trivector(v, weight=0):
    return ga.assemble(PGA3, {"e123": weight, "e032": v[0], "e013": v[1], "e021": v[2]})


def _line(d, m):
    return ga.assemble(PGA3, {"e12": d[2], "e13": -d[1], "e23": d[0], "e01": m[0], "e02": m[1], "e03": m[2]})


def _plane(n, e0):
    return ga.assemble(PGA3, {"e1": n[0], "e2": n[1], "e3": n[2], "e0": e0})


def _foot(p, line):
    """Return the point of a line, of any nonzero norm, that is nearest to the point `p`."""
    foot = ga.inner_product(p, line) ^ line
    return foot / foot["e123"]


def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _rotor_part(m):
    return ga.assemble(PGA3, {name: m[name] for name in ROTOR.blades})


def _study_unit(x):
    """Return `x` times ``(x ~x)**(-1/2)``.

    For even `x`, ``x ~x`` is a dual number ``s + p I``, and so is its power -1/2.
    """
    study = x * ~x
    s = study["1"]
    return x * (1 - study["e0123"] / (2 * s) * PSEUDOSCALAR) / ga.sqrt(s)


PRODUCTS = products(PGA3, hyperplanes="planes")
POINTS_AND_LINES, MOTORS = points_and_lines(PGA3), motors(PGA3, LINE, motion="screw motion")
MOTIONS, TWISTS = motions(PGA3, _translator), twists(PGA3, LINE)
ROTATIONS = rotations_of_space(PGA3, _rotor, AXES, coordinates)


# Products, involutions and duals of general elements.

geometric_product = PRODUCTS.geometric_product
outer_product = PRODUCTS.outer_product
regressive_product = PRODUCTS.regressive_product
inner_product = PRODUCTS.inner_product


@kernel(a=FULL, b=FULL)
def commutator(a, b):
    """Compute the commutator ``(a b - b a) / 2`` of two elements."""
    return ga.commutator(a, b)


reverse = PRODUCTS.reverse
grade_involution = PRODUCTS.grade_involution
clifford_conjugate = PRODUCTS.clifford_conjugate
dual = PRODUCTS.dual
undual = PRODUCTS.undual
norm = PRODUCTS.norm


@kernel(a=FULL)
def ideal_norm(a):
    """Compute the norm of the dual: of a point its distance to the origin, of a direction its length."""
    return ga.norm(ga.dual(a))


# Points, lines and planes.


@kernel(t=TRIVECTOR, returns=POINT)
def point_from_trivector(t):
    """Scale a trivector to the point of weight 1. The weight, the coefficient of e123, must not be 0."""
    return t / t["e123"]


normalize_line = POINTS_AND_LINES.normalize_line.documented(
    "Divide a line by the length of its direction. A line at infinity has length 0 and cannot be normalised."
)


@kernel(plane=PLANE)
def normalize_plane(plane):
    """Divide a plane by the length of its normal. The plane at infinity has length 0 and cannot be normalised."""
    return ga.normalize(plane)


join_points = POINTS_AND_LINES.join_points
join_point_direction = POINTS_AND_LINES.join_point_direction


@kernel(p=POINT, line=LINE)
def join_point_line(p, line):
    """Compute the plane through a point and a line; 0 if the point lies on the line.

    The norm is the distance between them times the norm of the line.
    """
    return p & line


@kernel(a=POINT, b=POINT, c=POINT)
def join_three_points(a, b, c):
    """Compute the plane through three points; 0 if they are collinear.

    The points appear counter-clockwise from the side to which the normal points. The norm is twice the area of the
    triangle.
    """
    return a & b & c


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def join_four_points(a, b, c, d):
    """Compute six times the signed volume ``det[b - a, c - a, d - a]`` of a tetrahedron; 0 for coplanar points.

    It is positive if `d` is on the side of the normal of ``join_three_points(a, b, c)``.
    """
    return a & b & c & d


@kernel(p=PLANE, q=PLANE)
def meet_planes(p, q):
    """Compute the line of intersection of two planes, along the cross product of the normals.

    Parallel planes meet in a line at infinity (direction 0). The result is 0 if the planes coincide.
    """
    return p ^ q


@kernel(line=LINE, plane=PLANE)
def meet_line_plane(line, plane):
    """Compute the weighted point in which a line meets a plane.

    The weight is the inner product of direction and normal. It is 0 (the point is a direction) if they are parallel.
    The whole result is 0 if the line lies in the plane.
    """
    return line ^ plane


@kernel(p=PLANE, q=PLANE, r=PLANE)
def meet_three_planes(p, q, r):
    """Compute the weighted point of intersection of three planes. The weight is the determinant of the normals."""
    return p ^ q ^ r


@kernel(p=POINT, plane=PLANE)
def line_orthogonal_to_plane(p, plane):
    """Compute the line through the point `p` along the normal of a plane, with the norm of the plane."""
    return ga.inner_product(plane, p)


@kernel(p=POINT, line=LINE)
def plane_orthogonal_to_line(p, line):
    """Compute the plane through the point `p` with the direction of a line as normal and with the norm of the line."""
    return ga.inner_product(p, ~line)


@kernel(p=POINT, plane=PLANE)
def plane_through_point(p, plane):
    """Compute the plane through the point `p` that is parallel to a plane, with the same norm."""
    return ga.inner_product(p, plane) * ~p


distance_squared_points = POINTS_AND_LINES.distance_squared_points
distance_points = POINTS_AND_LINES.distance_points


@kernel(p=POINT, plane=UNIT_PLANE)
def signed_distance_point_plane(p, plane):
    """Compute the distance from a point to a normalised plane, positive on the side of the normal."""
    return plane & p


@kernel(p=POINT, line=UNIT_LINE)
def distance_point_line(p, line):
    """Compute the distance from a point to a normalised line."""
    return ga.norm(p & line)


@kernel(line=UNIT_LINE, other=UNIT_LINE)
def mutual_moment(line, other):
    """Compute the distance between two normalised lines times the sine of their angle.

    It is 0 if and only if the lines meet or are parallel. With points p, q and directions d, e it is ``(p - q) . (d x
    e)``.
    """
    return line & other


@kernel(p=UNIT_PLANE, q=UNIT_PLANE)
def angle_between_planes(p, q):
    """Compute the angle between the normals of two normalised planes, in [0, pi]; small angles are accurate."""
    return ga.atan2(ga.norm(p ^ q), ga.scalar_product(p, q))


@kernel(line=UNIT_LINE, other=UNIT_LINE)
def angle_between_lines(line, other):
    """Compute the angle between the directions of two normalised lines, in [0, pi]; small angles are accurate."""
    return ga.atan2(ga.norm(ga.commutator(line, other)), ga.scalar_product(line, ~other))


@kernel(p=POINT, plane=PLANE)
def project_point_on_plane(p, plane):
    """Project the point `p` orthogonally onto a plane of any nonzero norm."""
    return ga.right_contraction(p, plane) * ga.inverse(plane)


@kernel(p=POINT, plane=UNIT_PLANE)
def project_point_on_unit_plane(p, plane):
    """Project the point `p` orthogonally onto a normalised plane."""
    return ga.right_contraction(p, plane) * plane


@kernel(p=POINT, line=LINE)
def project_point_on_line(p, line):
    """Project the point `p` orthogonally onto a line of any nonzero norm.

    The result is the intersection of the line with the plane through `p` orthogonal to it.
    """
    return _foot(p, line)


@kernel(p=POINT, line=UNIT_LINE)
def project_point_on_unit_line(p, line):
    """Project the point `p` orthogonally onto a normalised line."""
    return ga.right_contraction(p, line) * ~line


@kernel(line=LINE, plane=UNIT_PLANE)
def project_line_on_unit_plane(line, plane):
    """Project a line orthogonally onto a normalised plane; at infinity if the line is orthogonal to the plane."""
    return ga.right_contraction(line, plane) * plane


@kernel(p=POINT, plane=UNIT_PLANE)
def reflect_point(p, plane):
    """Reflect the point `p` in a normalised plane."""
    return plane * p * plane


# Conversion of coordinates to lines and planes, and back.


@kernel(d=DIRECTION, m=VECTOR, returns=LINE)
def line_from_direction_moment(d, m):
    """Construct a line from its Pluecker coordinates: direction `d` and moment `m`, ``p x d`` for all p on it.

    Direction and moment must be orthogonal; `plucker_residual` measures the deviation.
    """
    return _line(coordinates(d), m)


@kernel(line=LINE, returns=(DIRECTION, VECTOR))
def line_to_direction_moment(line):
    """Extract the direction and the moment of a line, its Pluecker coordinates."""
    return direction_of_line(line), tuple(line[name] for name in ("e01", "e02", "e03"))


@kernel(b=LINE)
def plucker_residual(b):
    """Compute the inner product of direction and moment of a bivector, ``(b ^ b) / 2``.

    It is 0 for lines, and the pitch times the squared length for screws.
    """
    return (b ^ b)["e0123"] / 2


@kernel(line=LINE, returns=POINT)
def line_support(line):
    """Compute the point of a line, of any nonzero norm, that is nearest to the origin."""
    return _foot(ORIGIN, line)


@kernel(line=UNIT_LINE, t=SCALAR, returns=POINT)
def point_on_line(line, t):
    """Compute the point of a normalised line at the signed distance `t` from its support point, along its direction."""
    return foot_on_unit_line(ORIGIN, line) + t * direction_of_line(line)


@kernel(p=POINT, line=UNIT_LINE, returns=SCALAR)
def position_along_line(p, line):
    """Compute the parameter `t`, as in `point_on_line`, of the point of a normalised line nearest to `p`."""
    x, y, z = coordinates(p)
    return x * line["e23"] - y * line["e13"] + z * line["e12"]


@kernel(normal=DIRECTION, distance=SCALAR, returns=PLANE)
def plane_from_normal(normal, distance):
    """Construct the plane ``normal . x = distance``; for a unit normal, the signed distance from the origin."""
    return _plane(coordinates(normal), -distance)


@kernel(p=POINT, normal=DIRECTION, returns=PLANE)
def plane_from_point_normal(p, normal):
    """Construct the plane through the point `p` with a given normal; the norm of the plane is the normal's length."""
    n = coordinates(normal)
    return _plane(n, -sum(a * b for a, b in zip(coordinates(p), n, strict=True)))


@kernel(p=POINT, d=DIRECTION, e=DIRECTION)
def join_point_directions(p, d, e):
    """Compute the plane through the point `p` along two directions, with normal ``d x e``; 0 if they are parallel."""
    return p & d & e


@kernel(plane=PLANE, returns=(DIRECTION, SCALAR))
def plane_to_normal(plane):
    """Extract the unit normal of a plane and its signed distance from the origin: ``normal . x = distance``."""
    n = [plane[name] for name in ("e1", "e2", "e3")]
    length = ga.sqrt(sum(a * a for a in n))
    return _trivector([a / length for a in n]), -plane["e0"] / length


@kernel(plane=PLANE, returns=POINT)
def plane_support(plane):
    """Compute the point of a plane, of any nonzero norm, that is nearest to the origin."""
    return ga.right_contraction(ORIGIN, plane) * ga.inverse(plane)


@kernel(a=POINT, b=POINT, returns=PLANE)
def bisector_plane(a, b):
    """Compute the plane equidistant from `a` and `b`, with normal ``b - a``; 0 if the points coincide."""
    difference, total = coordinates(b - a), coordinates(a + b)
    return _plane(difference, -sum(x * y for x, y in zip(difference, total, strict=True)) / 2)


@kernel(p=UNIT_PLANE, q=UNIT_PLANE, returns=(PLANE, PLANE))
def bisectors_of_planes(p, q):
    """Compute the bisector planes ``p - q`` and ``p + q`` of two normalised planes.

    They contain the points of equal and of opposite signed distances. For parallel planes, one is the plane halfway
    between them and the other is the plane at infinity; for coinciding planes, one is 0.
    """
    return p - q, p + q


midpoint = POINTS_AND_LINES.midpoint


# Distances, angles and closest points of all pairs. Where a branch depends on the size of a sine, the arguments are
# normalised but not declared as such, so that the compiler cannot replace the squared sine by ``1 - cosine**2``.


@kernel(a=LINE, b=LINE, returns=(POINT, POINT))
def closest_points_of_lines(a, b):
    """Compute the point of the normalised line `a` nearest to `b`, and the point of `b` nearest to `a`.

    For parallel lines (sine of the angle at most 1e-12) the points are not unique: the support point of `a` is chosen.
    """
    axis = direction_of_line(ga.commutator(a, b))
    on_a, on_b = (axis & b) ^ a, (axis & a) ^ b
    parallel = ga.norm_squared(ga.commutator(a, b)) <= PARALLEL
    start = _foot(ORIGIN, a)
    end = _foot(start, b)
    feet = (on / ga.select(parallel, 1, on["e123"]) for on in (on_a, on_b))
    pairs = [zip(coordinates(x), coordinates(y), strict=True) for x, y in zip((start, end), feet, strict=True)]
    return tuple(_trivector([ga.select(parallel, *pair) for pair in each], 1) for each in pairs)


@kernel(a=LINE, b=LINE, returns=LINE)
def common_perpendicular(a, b):
    """Compute the normalised common perpendicular of two normalised lines, along ``d x e`` of their directions.

    For parallel lines (sine of the angle at most 1e-12), it is the perpendicular through the support point of `a`, from
    `a` to `b`. The result is NaN if the lines coincide.
    """
    both = ga.commutator(b, a)
    squared_sine = ga.norm_squared(both)
    parallel = squared_sine <= PARALLEL
    s = ga.select(parallel, 1, squared_sine)
    study = (both * ~both)["e0123"]
    crossing = (both * (1 - study / (2 * s) * PSEUDOSCALAR)).grade(2) / ga.sqrt(s)
    start = _foot(ORIGIN, a)
    across = start & _foot(start, b)
    apart = ga.norm(across)
    return ga.select(parallel, across / ga.select(parallel, apart, 1), crossing)


@kernel(a=LINE, b=LINE, returns=SCALAR)
def signed_distance_lines(a, b):
    """Compute the distance between two normalised lines, positive if `b` is on the side of ``d x e``.

    Here d and e are the directions of `a` and `b`. For parallel lines (sine of the angle at most 1e-12) the distance is
    nonnegative.
    """
    both = ga.commutator(a, b)
    squared_sine = ga.norm_squared(both)
    parallel = squared_sine <= PARALLEL
    across = ga.sqrt(sum(both[name] * both[name] for name in ("e01", "e02", "e03")))
    return ga.select(parallel, across, -(a & b) / ga.sqrt(ga.select(parallel, 1, squared_sine)))


@kernel(a=LINE, b=LINE, returns=SCALAR)
def distance_lines(a, b):
    """Compute the distance between two normalised lines, parallel lines (sine of the angle at most 1e-12) included."""
    return ga.absolute(signed_distance_lines(a, b))


@kernel(line=UNIT_LINE, plane=UNIT_PLANE, returns=SCALAR)
def signed_distance_line_plane(line, plane):
    """Compute the signed distance from a normalised plane to a normalised line, positive on the normal's side.

    It is 0 if they meet, that is, if the sine of the angle is more than 1e-12.
    """
    sine = (line ^ plane)["e123"]
    return ga.select(sine * sine <= PARALLEL, plane & (foot_on_unit_line(ORIGIN, line)), 0)


@kernel(p=PLANE, q=PLANE, returns=SCALAR)
def signed_distance_planes(p, q):
    """Compute the signed distance from the normalised plane `p` to the normalised plane `q` along the normal of `p`.

    It is 0 if they meet, that is, if the sine of the angle is more than 1e-12.
    """
    same = ga.select(ga.scalar_product(p, q) < 0, -1, 1)
    return ga.select(ga.norm_squared(p ^ q) <= PARALLEL, p["e0"] - same * q["e0"], 0)


@kernel(line=UNIT_LINE, plane=UNIT_PLANE, returns=SCALAR)
def signed_angle_line_plane(line, plane):
    """Compute the angle between a normalised line and a normalised plane, in [-pi/2, pi/2].

    It is positive if the line points to the side of the normal. The angle is accurate if it is small and if the line is
    nearly orthogonal to the plane.
    """
    return ga.atan2((line ^ plane)["e123"], ga.norm(ga.inner_product(plane, line)))


@kernel(a=UNIT_LINE, b=UNIT_LINE, axis=DIRECTION, returns=SCALAR)
def signed_angle_between_lines(a, b, axis):
    """Compute the signed angle between the directions of two normalised lines, in [-pi, pi].

    It is negative if the inner product of ``d x e``, the cross product of the directions, with `axis` is negative.
    `axis` is a direction of any nonzero length.
    """
    turned = direction_of_line(ga.commutator(b, a))
    against = sum(x * y for x, y in zip(coordinates(turned), coordinates(axis), strict=True)) < 0
    angle = ga.atan2(ga.norm(ga.commutator(a, b)), ga.scalar_product(a, ~b))
    return ga.select(against, -angle, angle)


@kernel(p=UNIT_PLANE, q=UNIT_PLANE, axis=DIRECTION, returns=SCALAR)
def signed_angle_between_planes(p, q, axis):
    """Compute the signed angle between the normals of two normalised planes, in [-pi, pi].

    It is negative if the inner product of their cross product with `axis` is negative. `axis` is a direction of any
    nonzero length.
    """
    meet = p ^ q
    against = sum(x * y for x, y in zip(coordinates(direction_of_line(meet)), coordinates(axis), strict=True)) < 0
    angle = ga.atan2(ga.norm(meet), ga.scalar_product(p, q))
    return ga.select(against, -angle, angle)


# Joins and meets that may not exist, and relative positions.


@kernel(a=UNIT_LINE, b=UNIT_LINE, returns=PLANE)
def join_lines(a, b):
    """Compute the normalised plane of two normalised lines that meet or are parallel; NaN if they coincide.

    The normal is along ``d x e`` of the directions; for parallel lines, along the cross product of the direction of `a`
    with the displacement from `a` to `b`. For skew lines, which `mutual_moment` detects, the result is the plane
    through `a` parallel to `b`.
    """
    by_direction = a & direction_of_line(b)
    start = foot_on_unit_line(ORIGIN, b)
    by_point = a & start
    near = ga.norm_squared(by_point)
    scale = near + ga.norm_squared(start & ORIGIN)
    plane = ga.select(ga.norm_squared(by_direction) * scale < MUCH_SMALLER * near, by_point, by_direction)
    return ga.normalize(plane)


@kernel(a=UNIT_LINE, b=UNIT_LINE, returns=TRIVECTOR)
def meet_lines(a, b):
    """Compute the weighted point in which two normalised lines meet; the weight is the squared sine of their angle.

    For skew lines it is the midpoint of their common perpendicular. For parallel lines it is 0.
    """
    axis = direction_of_line(ga.commutator(a, b))
    return ((axis & a) ^ b) / 2 - ((axis & b) ^ a) / 2


@kernel(a=LINE, b=LINE, distance=SCALAR, sine=SCALAR, returns=SCALAR)
def relation_of_lines(a, b, distance, sine):
    """Classify the relative position of two normalised lines: 0 coincident, 1 parallel, 2 intersecting, 3 skew.

    Distances up to `distance`, and angles with a sine up to `sine`, count as 0. The directions may be opposite.
    """
    parallel = ga.norm_squared(ga.commutator(a, b)) <= sine * sine
    apart = distance < distance_lines(a, b)
    both = ga.commutator(a, b)
    across = sum(both[name] * both[name] for name in ("e01", "e02", "e03"))
    beside = ga.select(distance * distance < across, 1, 0)
    return ga.select(parallel, beside, ga.select(apart, 3, 2))


@kernel(line=UNIT_LINE, plane=UNIT_PLANE, distance=SCALAR, sine=SCALAR, returns=SCALAR)
def relation_of_line_plane(line, plane, distance, sine):
    """Classify a normalised line and a normalised plane: 0 line in the plane, 1 parallel, 2 intersecting.

    Distances of the line's support point up to `distance`, and angles with a sine up to `sine`, count as 0.
    """
    along = ga.absolute((line ^ plane)["e123"]) <= sine
    off = distance < ga.absolute(plane & (foot_on_unit_line(ORIGIN, line)))
    return ga.select(along, ga.select(off, 1, 0), 2)


@kernel(p=PLANE, q=PLANE, distance=SCALAR, sine=SCALAR, returns=SCALAR)
def relation_of_planes(p, q, distance, sine):
    """Classify the relative position of two normalised planes: 0 coincident, 1 parallel, 2 intersecting.

    Distances up to `distance`, and angles with a sine up to `sine`, count as 0. The normals may be opposite.
    """
    same = ga.select(ga.scalar_product(p, q) < 0, -1, 1)
    off = distance < ga.absolute(p["e0"] - same * q["e0"])
    return ga.select(ga.norm_squared(p ^ q) <= sine * sine, ga.select(off, 1, 0), 2)


@kernel(p=PLANE, q=PLANE, r=PLANE, distance=SCALAR, sine=SCALAR, returns=SCALAR)
def relation_of_three_planes(p, q, r, distance, sine):
    """Classify the intersection of three normalised planes: 0 a plane, 1 or 3 empty, 2 a line, 4 a point.

    With 1 all planes are parallel. With 3 two of them meet, and the third is parallel to one of the two or to their
    line of intersection. Distances up to `distance`, and angles with a sine up to `sine`, count as 0.
    """
    pairs = ((p ^ q, r, p, q), (q ^ r, p, q, r), (r ^ p, q, r, p))
    sines = [ga.norm_squared(pair[0]) for pair in pairs]
    widest = ga.maximum(sines[0], ga.maximum(sines[1], sines[2]))
    first, second = widest <= sines[0], widest <= sines[1]
    line = ga.select(first, pairs[0][0], ga.select(second, pairs[1][0], pairs[2][0]))
    other = ga.select(first, r, ga.select(second, p, q))
    length = ga.sqrt(ga.select(widest <= 0, 1, widest))
    common = (line ^ other) / length
    pointed = sine < ga.absolute(common["e123"])
    off = distance < ga.absolute(other & _foot(ORIGIN, ga.select(widest <= 0, AXIS_Z, line)))
    apart = [gap_of_parallels(p, q), gap_of_parallels(q, r), gap_of_parallels(r, p)]
    farthest = ga.maximum(apart[0], ga.maximum(apart[1], apart[2]))
    parallel = ga.select(distance < farthest, 1, 0)
    return ga.select(widest <= sine * sine, parallel, ga.select(pointed, 4, ga.select(off, 3, 2)))


# Projections, rejections and reflections of all pairs. An element is the sum of its projection and its rejection.


@kernel(p=POINT, plane=UNIT_PLANE)
def reject_point_from_plane(p, plane):
    """Compute the direction from the nearest point of a normalised plane to the point `p`."""
    return (p ^ plane) * plane


@kernel(p=POINT, line=UNIT_LINE, returns=DIRECTION)
def reject_point_from_line(p, line):
    """Compute the direction from the nearest point of a normalised line to the point `p`."""
    return p - foot_on_unit_line(p, line)


@kernel(line=LINE, plane=UNIT_PLANE)
def reject_line_from_plane(line, plane):
    """Compute the rejection of a line from a normalised plane: the line minus its projection.

    It is a line along the normal through the intersection of line and plane. It lies at infinity if they are parallel,
    and is 0 if the line lies in the plane.
    """
    return (line ^ plane) * plane


@kernel(line=LINE, p=POINT, returns=LINE)
def project_line_on_point(line, p):
    """Compute the line through the point `p` that is parallel to a line, with the same norm."""
    return p & direction_of_line(line)


@kernel(plane=PLANE, line=UNIT_LINE)
def project_plane_on_line(plane, line):
    """Project a plane onto a normalised line.

    The result contains the line; its normal is the normal of `plane` minus the component along the line. It is 0, or
    the plane at infinity, if the line is orthogonal to `plane`.
    """
    return ga.inner_product(plane, line) * ~line


@kernel(plane=PLANE, line=UNIT_LINE)
def reject_plane_from_line(plane, line):
    """Compute the rejection of a plane from a normalised line: the plane minus its projection.

    It is orthogonal to the line and passes through the intersection of the line with `plane`.
    """
    return (plane ^ line) * ~line


@kernel(line=LINE, plane=UNIT_PLANE, returns=LINE)
def reflect_line(line, plane):
    """Reflect a line in a normalised plane: its points and its direction are reflected."""
    return -(plane * line * plane)


@kernel(q=PLANE, plane=UNIT_PLANE, returns=PLANE)
def reflect_plane(q, plane):
    """Reflect the plane `q` in a normalised plane: its points and its normal are reflected."""
    return -(plane * q * plane)


@kernel(p=POINT, line=UNIT_LINE)
def reflect_point_in_line(p, line):
    """Rotate the point `p` by a half turn about a normalised line."""
    return line * p * ~line


@kernel(a=LINE, line=UNIT_LINE)
def reflect_line_in_line(a, line):
    """Rotate the line `a` by a half turn about a normalised line."""
    return line * a * ~line


@kernel(plane=PLANE, line=UNIT_LINE)
def reflect_plane_in_line(plane, line):
    """Rotate a plane by a half turn about a normalised line."""
    return line * plane * ~line


@kernel(a=POINT, p=POINT)
def reflect_point_in_point(a, p):
    """Reflect the point `a` in the point `p`, the midpoint of `a` and the result."""
    return -(p * a * p)


@kernel(line=LINE, p=POINT)
def reflect_line_in_point(line, p):
    """Reflect a line in the point `p`; the direction is reversed."""
    return p * line * p


@kernel(plane=PLANE, p=POINT)
def reflect_plane_in_point(plane, p):
    """Reflect a plane in the point `p`; the normal is reversed."""
    return p * plane * p


# Distances from a common line or plane, in the units of the coordinates, and orientations.


@kernel(a=POINT, b=POINT, c=POINT, returns=SCALAR)
def collinearity_residual(a, b, c):
    """Compute the smallest height of a triangle: 0 if three points are collinear or if points coincide."""
    longest = ga.maximum(ga.norm_squared(a & b), ga.maximum(ga.norm_squared(b & c), ga.norm_squared(c & a)))
    return ga.norm(a & b & c) / ga.sqrt(ga.select(longest <= 0, 1, longest))


@kernel(a=POINT, b=POINT, c=POINT, d=POINT, returns=SCALAR)
def coplanarity_residual(a, b, c, d):
    """Compute the smallest height of a tetrahedron: 0 if four points are coplanar.

    It has the sign of `join_four_points`, the orientation: positive if `d` is on the side of the normal of
    ``join_three_points(a, b, c)``.
    """
    faces = [ga.norm_squared(x & y & z) for x, y, z in ((a, b, c), (a, b, d), (a, c, d), (b, c, d))]
    largest = ga.maximum(ga.maximum(faces[0], faces[1]), ga.maximum(faces[2], faces[3]))
    return (a & b & c & d) / ga.sqrt(ga.select(largest <= 0, 1, largest))


# Flags: a point on a line in a plane.


@kernel(p=POINT, line=UNIT_LINE, plane=UNIT_PLANE, returns=(SCALAR, SCALAR, SCALAR))
def flag_residuals(p, line, plane):
    """Compute the distance from point to line, the signed distance to the plane, and the sine of the angle.

    The sine is that of the angle between the line and the plane.
    """
    return ga.norm(p & line), plane & p, (line ^ plane)["e123"]


@kernel(a=POINT, b=POINT, c=POINT, returns=(POINT, LINE, PLANE))
def flag_from_points(a, b, c):
    """Construct a flag: `a`, the normalised line from `a` to `b`, and the normalised plane; NaN if collinear."""
    return a, ga.normalize(a & b), ga.normalize(a & b & c)


@kernel(m=MOTOR, returns=(POINT, LINE, PLANE))
def flag_from_motor(m):
    """Move the flag of origin, x axis and plane ``z = 0`` by the unit motor `m`."""
    return m * ORIGIN * ~m, m * AXIS_X * ~m, m * PGA3.multivector({"e3": 1}) * ~m


@kernel(p=POINT, line=UNIT_LINE, plane=UNIT_PLANE, returns=MOTOR)
def motor_from_flag(p, line, plane):
    """Compute the motor that takes origin, x axis and plane ``z = 0`` to a flag: the inverse of `flag_from_motor`.

    If the residuals of the flag are not 0, the point is reached exactly, then the direction of the line, then the side
    of the plane.
    """
    return _translator(coordinates(p)) * _rotor_of_flag(line, plane)


@kernel(a=POINT, b=POINT, c=POINT, returns=MOTOR)
def motor_from_points(a, b, c):
    """Compute the motor that takes the origin to `a`, the x axis towards `b`, and ``z = 0`` to the plane of all three.

    `c` is on the side of the y axis. The result is NaN if the points are collinear.
    """
    return _translator(coordinates(a)) * _rotor_of_flag(ga.normalize(a & b), ga.normalize(a & b & c))


def _rotor_of_flag(line, plane):
    """Return the rotor that takes the x and z axes to the direction of a line and the normal of a plane through it."""
    x = coordinates(direction_of_line(line))
    y = _cross([plane[name] for name in ("e1", "e2", "e3")], x)
    length = ga.sqrt(dot(y, y))
    y = [a / length for a in y]
    return _rotor_of_matrix(tuple(zip(x, y, _cross(x, y), strict=True)))


# Rays.


@kernel(p=POINT, d=DIRECTION, plane=PLANE, returns=(SCALAR, POINT))
def hit_ray_plane(p, d, plane):
    """Compute the `t` for which ``p + t d`` is on a plane of any nonzero norm, and that point.

    The ray hits the plane if ``t >= 0``. If they are parallel, `t` is infinite, or NaN if the ray lies in the plane.
    """
    t = -(plane & p) / (plane & d)
    return t, p + t * d


@kernel(p=POINT, d=DIRECTION, a=POINT, b=POINT, c=POINT, returns=(SCALAR, VECTOR))
def hit_ray_triangle(p, d, a, b, c):
    """Compute the `t` for which ``p + t d`` is in the plane of a triangle, and the point's barycentric coordinates.

    The ray hits the triangle, from either side, if `t` and all coordinates are nonnegative; a coordinate of 0 is on an
    edge. No result is finite if the ray is parallel to the plane. The coordinates are moments of the ray about the
    edges.
    """
    ray = p & d
    moments = [ray & (b & c), ray & (c & a), ray & (a & b)]
    plane = a & b & c
    along = plane & d
    return -(plane & p) / along, tuple(moment / along for moment in moments)


# Motors.

motor_product = MOTORS.motor_product
even_product = PRODUCTS.even_product
motor_inverse = MOTORS.motor_inverse
even_inverse = MOTIONS.even_inverse


@kernel(x=EVEN, returns=MOTOR)
def normalize_motor(x):
    """Compute the unit motor of an even element: ``x (x ~x)**(-1/2)``.

    ``x ~x`` is a dual number ``s + p e0123``. Therefore the result has norm 1 and satisfies the Study condition, and a
    motor times any dual number is mapped to the motor. The rotational part must not be 0.
    """
    return _study_unit(x)


move_point = MOTORS.move_point
move_direction = MOTIONS.move_direction
move_line = MOTIONS.move_line.documented(
    "Move the line, or any bivector such as a twist, by the unit motor `m`: ``m line ~m``."
)


@kernel(m=MOTOR, plane=PLANE)
def move_plane(m, plane):
    """Move a plane by the unit motor `m`: ``m plane ~m``."""
    return m * plane * ~m


@kernel(m=MOTOR, n=MOTOR, returns=MOTOR)
def move_motor(m, n):
    """Conjugate the motion `n` by the unit motor `m`: ``m n ~m``, the same motion about the moved screw axis."""
    return m * n * ~m


move_point_back = MOTIONS.move_point_back


@kernel(axis=VECTOR, angle=SCALAR, returns=ROTOR)
def rotor_from_axis_angle(axis, angle):
    """Construct the right-handed rotation, in radians, about an axis through the origin of any nonzero length."""
    x, y, z = axis
    factor = ga.sin(angle / 2) / ga.sqrt(x * x + y * y + z * z)
    return _rotor(ga.cos(angle / 2), factor * x, factor * y, factor * z)


@kernel(v=VECTOR, returns=ROTOR)
def rotor_from_rotation_vector(v):
    """Construct the rotation about `v` through the origin by its length in radians; smooth at 0."""
    return ga.exp(ga.assemble(PGA3, {"e12": -v[2] / 2, "e13": v[1] / 2, "e23": -v[0] / 2}))


translator_from_vector = MOTIONS.translator_from_vector


@kernel(line=UNIT_LINE, angle=SCALAR, returns=MOTOR)
def motor_from_line(line, angle):
    """Construct the right-handed rotation about a normalised line: ``exp(-angle/2 line)``."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) * line


@kernel(line=UNIT_LINE, angle=SCALAR, distance=SCALAR, returns=MOTOR)
def motor_from_screw(line, angle, distance):
    """Construct the screw motion about a normalised line: right-handed by `angle`, translating by `distance`."""
    rotation = ga.cos(angle / 2) - ga.sin(angle / 2) * line
    return (1 + distance / 2 * PSEUDOSCALAR * line) * rotation


@kernel(r=ROTOR, v=VECTOR, returns=MOTOR)
def motor_from_rotor_translation(r, v):
    """Construct the motor that rotates by the rotor `r` and then translates by the vector `v`."""
    return _translator(v) * r


@kernel(m=MOTOR, returns=(ROTOR, VECTOR))
def motor_to_rotor_translation(m):
    """Extract the rotor and the translation vector of a unit motor, the inverse of `motor_from_rotor_translation`."""
    rotor = ga.assemble(PGA3, {name: m[name] for name in ROTOR.blades})
    return rotor, coordinates(m * ORIGIN * ~m)


rotor_from_quaternion = ROTATIONS.rotor_from_quaternion
rotor_to_quaternion = ROTATIONS.rotor_to_quaternion


@kernel(q=array(SCALAR, 8), returns=MOTOR)
def motor_from_dual_quaternion(q):
    """Convert a unit dual quaternion, stored as (r_w, r_x, r_y, r_z, d_w, d_x, d_y, d_z), to a motor.

    Scalars come first, and ``d = t r / 2`` for a translation by `t` after the rotation `r`. The dual unit eps is
    -e0123.
    """
    return _rotor(*q[:4]) - PSEUDOSCALAR * _rotor(*q[4:])


@kernel(m=MOTOR, returns=array(SCALAR, 8))
def motor_to_dual_quaternion(m):
    """Convert a motor to a unit dual quaternion (r_w, r_x, r_y, r_z, d_w, d_x, d_y, d_z), scalars first.

    The inverse of `motor_from_dual_quaternion`: ``d = t r / 2`` for a translation by `t` after the rotation `r`.
    """
    return m["1"], -m["e23"], m["e13"], -m["e12"], -m["e0123"], -m["e01"], -m["e02"], -m["e03"]


@kernel(m=MOTOR, returns=MATRIX)
def motor_to_matrix(m):
    """Compute the homogeneous 4 x 4 matrix of a unit motor, which acts on columns (x, y, z, 1)."""
    columns = [coordinates(m * axis * ~m) for axis in AXES] + [coordinates(m * ORIGIN * ~m)]
    return (*zip(*columns, strict=True), (0, 0, 0, 1))


rotor_to_matrix = ROTATIONS.rotor_to_matrix


@kernel(matrix=MATRIX, returns=MOTOR)
def motor_from_matrix(matrix):
    """Convert a homogeneous 4 x 4 matrix of a rigid motion to the motor with nonnegative scalar part.

    The largest squared coefficient of the quaternion, which is at least 1/4, selects the row of coefficient products
    that is normalised (Shepperd, *J. Guidance and Control* 1:223, 1978). All rotations, including half turns, are
    therefore equally accurate, and the result is a unit motor even if the matrix is only nearly orthogonal. It is NaN
    if the determinant is not positive, as that of a reflection. The last row of the matrix is not read. At an exact
    half turn both signs are correct.
    """
    return _translator([matrix[i][3] for i in range(3)]) * _rotor(*quaternion_of_motion(matrix))


rotor_from_matrix = ROTATIONS.rotor_from_matrix


def _rotor_of_matrix(matrix):
    return _rotor(*quaternion_of_matrix(matrix))


@kernel(theta=SCALAR, d=SCALAR, a=SCALAR, alpha=SCALAR, returns=MOTOR)
def motor_from_denavit_hartenberg(theta, d, a, alpha):
    """Construct the motor of a row of a standard Denavit-Hartenberg table.

    Rotate about z by `theta`, translate along z by `d`, translate along the new x by `a`, and rotate about it by
    `alpha`.
    """
    turn_z = _rotor(ga.cos(theta / 2), 0, 0, ga.sin(theta / 2))
    turn_x = _rotor(ga.cos(alpha / 2), ga.sin(alpha / 2), 0, 0)
    return turn_z * _translator([a, 0, d]) * turn_x


@kernel(theta=SCALAR, d=SCALAR, a=SCALAR, alpha=SCALAR, returns=MOTOR)
def motor_from_modified_denavit_hartenberg(theta, d, a, alpha):
    """Construct the motor of a row of a modified (Craig's) Denavit-Hartenberg table.

    Rotate about x by `alpha`, translate along x by `a`, rotate about the new z by `theta`, and translate along it by
    `d`.
    """
    turn_z = _rotor(ga.cos(theta / 2), 0, 0, ga.sin(theta / 2))
    turn_x = _rotor(ga.cos(alpha / 2), ga.sin(alpha / 2), 0, 0)
    return turn_x * _translator([a, 0, d]) * turn_z


motor_exponential = MOTORS.motor_exponential.documented(
    "Compute ``exp(b)`` of a bivector; ``exp(-angle/2 line)`` is a rotation. Smooth at 0 and for pure translations."
)
motor_logarithm = MOTORS.motor_logarithm
motor_square_root = MOTORS.motor_square_root
motor_power = MOTORS.motor_power
interpolate_motors = MOTORS.interpolate_motors


@kernel(a=LINE, b=LINE, returns=MOTOR)
def motor_between_lines(a, b):
    """Compute the motor that takes the normalised line `a` to `b` about their common perpendicular.

    It rotates by the smaller angle. If the directions are opposite to within 0.01 radians, the motor is instead the
    product of two half turns: about the bisector of `a` and the reversed `b`, and about a line orthogonal to `b`
    through its support point. Exactly opposite lines thus give a half turn about some line orthogonal to both, combined
    with a translation along `b` if they are not coplanar.
    """
    squared = ga.norm_squared(a + b)
    opposite = squared < NEARLY_OPPOSITE
    support = _foot(ORIGIN, b)
    towards = _across(coordinates(direction_of_line(a + b)), coordinates(direction_of_line(b)), squared < ROUNDING)
    middle = ga.select(opposite, a - b, AXIS_Z)
    turns = (support & _trivector(towards)) * _study_unit(middle)
    half = ga.select(opposite, 1, 1 + b * ~a)
    return ga.select(opposite, turns, _study_unit(half))


@kernel(a=PLANE, b=PLANE, returns=MOTOR)
def motor_between_planes(a, b):
    """Compute the motor that takes the normalised plane `a` to `b`: a rotation about their meet, or a translation.

    If the normals are opposite to within 0.01 radians, the motor is instead the product of two reflections: in the
    bisector of `a` and the reversed `b`, and in a plane orthogonal to `b`. Exactly opposite planes thus give a half
    turn about some line between them.
    """
    squared = ga.norm_squared(a + b)
    opposite = squared < NEARLY_OPPOSITE
    names = ("e1", "e2", "e3")
    towards = _across([(a + b)[name] for name in names], [b[name] for name in names], squared < ROUNDING)
    across = _plane(towards, 0)
    middle = ga.select(opposite, a - b, PGA3.multivector({"e1": 1}))
    half = ga.select(opposite, 1, 1 + b * a)
    return ga.select(opposite, across * ga.normalize(middle), _study_unit(half))


def _across(v, n, unusable):
    """Return the unit vector orthogonal to the unit vector `n` nearest to `v`.

    If `v` is unusable, return the one nearest to the coordinate axis of the smallest component of `n`.
    """
    x, y, z = (ga.absolute(a) for a in n)
    first, second = x <= ga.minimum(y, z), y <= z
    axis = [ga.select(first, a, ga.select(second, b, c)) for a, b, c in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    start = [ga.select(unusable, a, b) for a, b in zip(axis, v, strict=True)]
    along = dot(start, n)
    rest = [a - along * b for a, b in zip(start, n, strict=True)]
    squared = dot(rest, rest)
    length = ga.sqrt(ga.select(squared <= 0, 1, squared))
    return [a / length for a in rest]


motor_to_adjoint = TWISTS.motor_to_adjoint.documented(
    "Compute the 6 x 6 matrix by which a unit motor acts on lines and twists, in the coefficient order of a line."
)


@kernel(a=MOTOR, b=MOTOR, returns=array(SCALAR, 8, 8))
def motor_equation(a, b):
    """Compute the 8 x 8 matrix of ``x -> a x - x b`` on the coefficients of a motor.

    If the motors `a` and `b` are the same motion seen from two frames, the motor between the frames is a null vector of
    the matrix, and so is its product with the pseudoscalar.
    """
    basis = [PGA3.multivector({name: 1}) for name in MOTOR.blades]
    columns = [a * one - one * b for one in basis]
    return tuple(tuple(column[name] for column in columns) for name in MOTOR.blades)


# Screws, twists and motors in other forms.


@kernel(b=LINE, returns=(LINE, SCALAR, SCALAR))
def bivector_to_screw(b):
    """Decompose a twist or wrench into a screw: normalised axis, magnitude, and pitch along the axis.

    ``b = magnitude (1 - pitch I) axis``. For a twist, the magnitude is the angular velocity and the pitch is the
    translation per radian. At infinity (pure translations, couples) the magnitude is the length of the translation, the
    axis passes through the origin, and the pitch is infinite. For ``b = 0`` the axis is 0 and the pitch is NaN.
    """
    axis, length, along = _screw(b)
    return axis, ga.select(length <= 0, along, length), along / length


@kernel(axis=UNIT_LINE, magnitude=SCALAR, pitch=SCALAR, returns=LINE)
def bivector_from_screw(axis, magnitude, pitch):
    """Construct the twist or wrench ``magnitude (1 - pitch I) axis`` of a normalised axis and a finite `pitch`."""
    return magnitude * (axis - pitch * PSEUDOSCALAR * axis)


@kernel(m=MOTOR, returns=(LINE, SCALAR, SCALAR))
def motor_to_screw(m):
    """Decompose a unit motor into a screw: normalised axis, angle in [0, pi], and distance along the axis.

    The inverse of `motor_from_screw`, up to the sign of the motor. For a translation the angle is 0 and the axis passes
    through the origin; for the identity the axis is 0, too. At half turns the orientation of the axis is discontinuous.
    """
    axis, angle, distance = _screw(-2 * ga.log(m))
    return axis, angle, distance


def _screw(b):
    """Return axis, length and axial component of a bivector; a bivector at infinity gets an axis through the origin."""
    squared = ga.norm_squared(b)
    turning = squared > NO_TURN
    s = ga.select(turning, squared, 1)
    length = ga.sqrt(s)
    study = (b * ~b)["e0123"]
    finite = (b * (1 - study / (2 * s) * PSEUDOSCALAR)).grade(2) / length
    shift = [b[name] for name in ("e01", "e02", "e03")]
    shifted = ga.sqrt(dot(shift, shift))
    factor = 1 / ga.select(shifted <= 0, 1, shifted)
    axis = ga.select(turning, finite, _line([factor * a for a in shift], (0, 0, 0)))
    return axis, ga.select(turning, length, 0), ga.select(turning, -study / (2 * length), shifted)


@kernel(line=UNIT_LINE, angle=SCALAR, pitch=SCALAR, returns=MOTOR)
def motor_from_screw_pitch(line, angle, pitch):
    """Construct the screw motion about a normalised line: right-handed by `angle`, with `pitch` per radian."""
    rotation = ga.cos(angle / 2) - ga.sin(angle / 2) * line
    return (1 + pitch * angle / 2 * PSEUDOSCALAR * line) * rotation


motor_from_twist = TWISTS.motor_from_twist
motor_to_twist = TWISTS.motor_to_twist


@kernel(w=VECTOR, v=VECTOR, returns=LINE)
def twist_from_velocities(w, v):
    """Construct a twist from an angular velocity and the velocity at the origin: ``w x p + v`` at p."""
    return _line(w, v)


@kernel(twist=LINE, returns=(VECTOR, VECTOR))
def twist_to_velocities(twist):
    """Extract the angular velocity of a twist and the velocity of the point at the origin."""
    return coordinates(direction_of_line(twist)), tuple(twist[name] for name in ("e01", "e02", "e03"))


motor_derivative = TWISTS.motor_derivative
twist_from_motor_derivative = TWISTS.twist_from_motor_derivative


@kernel(v=LINE, a=LINE, p=POINT)
def acceleration_of_point(v, a, p):
    """Compute the acceleration of the point `p` under the twist `v` with rate of change `a`."""
    return ga.commutator(p, a) + ga.commutator(ga.commutator(p, v), v)


@kernel(r=ROTOR, returns=VECTOR)
def rotor_to_rotation_vector(r):
    """Compute the rotation vector of a rotor, axis times angle in [0, pi]; inverse of `rotor_from_rotation_vector`."""
    b = -2 * ga.log(r)
    return b["e23"], -b["e13"], b["e12"]


@kernel(r=ROTOR, returns=(VECTOR, SCALAR))
def rotor_to_axis_angle(r):
    """Compute the unit axis and the angle in [0, pi] of a rotor; the axis is 0 for the identity."""
    sign = ga.select(r["1"] < 0, -1, 1)
    v = [-sign * r["e23"], sign * r["e13"], -sign * r["e12"]]
    sine = ga.sqrt(dot(v, v))
    factor = 1 / ga.select(sine <= 0, 1, sine)
    return tuple(factor * a for a in v), 2 * ga.atan2(sine, ga.absolute(r["1"]))


@kernel(v=VECTOR, t=VECTOR, returns=MOTOR)
def motor_from_rotation_vector_translation(v, t):
    """Construct the motor that rotates about the origin by the rotation vector `v`, then translates by `t`."""
    return _translator(t) * ga.exp(_line(v, (0, 0, 0)) * -HALF)


@kernel(m=MOTOR, returns=(VECTOR, VECTOR))
def motor_to_rotation_vector_translation(m):
    """Extract the rotation vector, with angle in [0, pi], and the translation of a unit motor, which rotates first."""
    b = -2 * ga.log(_rotor_part(m))
    return (b["e23"], -b["e13"], b["e12"]), coordinates(m * ORIGIN * ~m)


@kernel(q=QUATERNION, t=VECTOR, returns=MOTOR)
def motor_from_quaternion_translation(q, t):
    """Construct the motor that rotates by a unit quaternion (w, x, y, z) and then translates by the vector `t`."""
    return _translator(t) * _rotor(*q)


@kernel(m=MOTOR, returns=(QUATERNION, VECTOR))
def motor_to_quaternion_translation(m):
    """Extract the unit quaternion (w, x, y, z) and the translation of a unit motor, which rotates first."""
    return (m["1"], -m["e23"], m["e13"], -m["e12"]), coordinates(m * ORIGIN * ~m)


@kernel(q=QUATERNION, returns=ROTOR)
def rotor_from_quaternion_scalar_last(q):
    """Convert a unit quaternion (x, y, z, w), scalar last, to a rotor."""
    return _rotor(q[3], q[0], q[1], q[2])


@kernel(r=ROTOR, returns=QUATERNION)
def rotor_to_quaternion_scalar_last(r):
    """Convert a rotor to a unit quaternion (x, y, z, w), scalar last."""
    return -r["e23"], r["e13"], -r["e12"], r["1"]


@kernel(q=array(SCALAR, 8), returns=MOTOR)
def motor_from_dual_quaternion_scalar_last(q):
    """Convert a unit dual quaternion (r_x, r_y, r_z, r_w, d_x, d_y, d_z, d_w), scalars last, to a motor."""
    return _rotor(q[3], *q[:3]) - PSEUDOSCALAR * _rotor(q[7], *q[4:7])


@kernel(m=MOTOR, returns=array(SCALAR, 8))
def motor_to_dual_quaternion_scalar_last(m):
    """Convert a motor to a unit dual quaternion (r_x, r_y, r_z, r_w, d_x, d_y, d_z, d_w), scalars last."""
    return -m["e23"], m["e13"], -m["e12"], m["1"], -m["e01"], -m["e02"], -m["e03"], -m["e0123"]


@kernel(matrix=array(SCALAR, 6, 6), returns=MOTOR)
def motor_from_adjoint(matrix):
    """Convert a 6 x 6 matrix that acts on lines and twists to a motor: inverse of `motor_to_adjoint`, up to sign.

    A matrix that is nearly of this form gives a motion that is nearly correct; a reflection of space gives NaN. The
    block that must be 0 is not read.
    """
    places = ((2, 1), (1, -1), (0, 1))
    turn = tuple(tuple(s * u * matrix[i][j] for j, u in places) for i, s in places)
    shift = tuple(tuple(u * matrix[3 + i][j] for j, u in places) for i in range(3))
    cross = [[dot(shift[i], turn[j]) for j in range(3)] for i in range(3)]
    t = [HALF * (cross[2][1] - cross[1][2]), HALF * (cross[0][2] - cross[2][0]), HALF * (cross[1][0] - cross[0][1])]
    return _translator(t) * _rotor(*quaternion_of_motion(turn))


translator_between_points = MOTIONS.translator_between_points
motor_between_frames = MOTIONS.motor_between_frames
motor_relative = MOTIONS.motor_relative


@kernel(a=MOTOR, b=MOTOR, t=SCALAR, returns=MOTOR)
def blend_motors(a, b, t):
    """Normalise ``(1 - t) a + t b``, or with ``-b`` if that is nearer, to a unit motor (NLERP).

    It is `a` at 0 and `b` or ``-b`` at 1; in between, axis and speed are not constant. The blend at ``t = 1/2`` is not
    defined for rotations that are half a turn apart.
    """
    near = ga.select(ga.scalar_product(a, ~b) < 0, -t, t)
    return _study_unit((1 - t) * a + near * b)


@kernel(a=DIRECTION, b=DIRECTION, returns=MATRIX)
def rotation_form(a, b):
    """Compute the symmetric matrix K with ``r K r = b . (r a ~r)`` for rotors r as columns 1 e12 e13 e23.

    The rotor that best aligns many vectors `a` with vectors `b` is the eigenvector of the largest eigenvalue of the sum
    of their matrices.
    """
    parts = [PGA3.multivector({name: 1}) for name in ROTOR.blades]
    x = coordinates(b)
    return tuple(
        tuple(HALF * dot(coordinates(one * a * ~other + other * a * ~one), x) for other in parts) for one in parts
    )


@kernel(a=VECTOR, b=VECTOR, c=VECTOR, angles=VECTOR, returns=ROTOR)
def rotor_from_euler_angles(a, b, c, angles):
    """Compose the rotations by three angles about three unit axes (intrinsic): ``A B C``.

    Each axis is rotated by the preceding rotations. With the axes in the order c, b, a and the angles reversed, the
    same rotor describes rotations about fixed axes (extrinsic).
    """
    first, second, third = (
        _rotor(ga.cos(angle / 2), *(ga.sin(angle / 2) * x for x in axis))
        for axis, angle in zip((a, b, c), angles, strict=True)
    )
    return first * second * third


@kernel(r=ROTOR, a=VECTOR, b=VECTOR, returns=VECTOR)
def rotor_to_proper_euler_angles(r, a, b):
    """Compute the intrinsic angles of a rotor about the axes a, b, a (such as zxz) for orthonormal `a` and `b`.

    The first and third angle are in [-pi, pi], the second in [0, pi]. If the second is 0 or pi to within 1e-14, the
    first and third rotate about the same line and the third is set to 0. The method uses half the sum and half the
    difference of two angles (Bernardes and Viollet, *PLoS ONE* 17(11):e0276302, 2022).
    """
    w, v = r["1"], (-r["e23"], r["e13"], -r["e12"])
    first, third, sine, cosine = _euler_angles(w, dot(v, a), dot(v, b), dot(v, _cross(a, b)))
    return first, 2 * ga.atan2(sine, cosine), third


@kernel(r=ROTOR, a=VECTOR, b=VECTOR, returns=VECTOR)
def rotor_to_tait_bryan_angles(r, a, b):
    """Compute the intrinsic angles of a rotor about the axes a, b, ``a x b`` (such as xyz), `a` and `b` orthonormal.

    The first and third angle are in [-pi, pi], the second in [-pi/2, pi/2]. If the second is +-pi/2 to within 1e-14,
    the first and third rotate about the same line and the third is set to 0. For the third axis ``-(a x b)``, negate
    the third angle.
    """
    w, v = r["1"], (-r["e23"], r["e13"], -r["e12"])
    x, y, z = dot(v, a), dot(v, b), dot(v, _cross(a, b))
    first, third, lower, upper = _euler_angles(w - y, z - x, w + y, -x - z)
    return -first, ga.atan2(2 * (w * y + x * z), lower * upper), third


def _euler_angles(a, b, c, d):
    """Return the first and third angle, and the two lengths that determine half of the second.

    ``a + b i`` and ``c + d i`` have half the sum and half the difference of the two angles as arguments. In gimbal lock
    one of them is 0, and the other is used for both.
    """
    upper, lower = ga.sqrt(a * a + b * b), ga.sqrt(c * c + d * d)
    level, upside_down = lower <= LOCKED, upper <= LOCKED
    sine = ga.select(level, 2 * a * b, ga.select(upside_down, 2 * c * d, b * c + a * d))
    cosine = ga.select(level, a * a - b * b, ga.select(upside_down, c * c - d * d, a * c - b * d))
    third = ga.atan2(b * c - a * d, a * c + b * d)
    locked = ga.maximum(ga.select(level, 1, 0), ga.select(upside_down, 1, 0))
    return ga.atan2(sine, cosine), ga.select(locked, 0, third), lower, upper


# Conversion to other algebras: G(3,0), four homogeneous coordinates, and the even subalgebra.


@kernel(line=LINE, returns=(VGA3.VECTOR, VGA3.BIVECTOR))
def line_to_vector_algebra(line):
    """Convert a line to G(3,0): its direction `d`, a vector, and its moment ``x ^ d`` for all x on it, a bivector."""
    x, y, z = coordinates(direction_of_line(line))
    moment = {"e12": line["e03"], "e13": -line["e02"], "e23": line["e01"]}
    return ga.assemble(VGA3, {"e1": x, "e2": y, "e3": z}), ga.assemble(VGA3, moment)


@kernel(d=VGA3.VECTOR, m=VGA3.BIVECTOR, returns=LINE)
def line_from_vector_algebra(d, m):
    """Construct the line of a direction and a moment bivector ``x ^ d`` of G(3,0)."""
    return _line((d["e1"], d["e2"], d["e3"]), (m["e23"], -m["e13"], m["e12"]))


@kernel(plane=PLANE, returns=(VGA3.BIVECTOR, VGA3.PSEUDOSCALAR))
def plane_to_vector_algebra(plane):
    """Convert a plane to G(3,0): a bivector B of its directions, dual to the normal, and ``x ^ B`` for all x on it."""
    directions = {"e12": plane["e3"], "e13": -plane["e2"], "e23": plane["e1"]}
    return ga.assemble(VGA3, directions), ga.assemble(VGA3, {"e123": -plane["e0"]})


@kernel(b=VGA3.BIVECTOR, t=VGA3.PSEUDOSCALAR, returns=PLANE)
def plane_from_vector_algebra(b, t):
    """Construct the plane with directions `b` and points ``x ^ b = t`` in G(3,0)."""
    return _plane((b["e23"], -b["e13"], b["e12"]), -t["e123"])


@kernel(p=POINT, returns=HOMOGENEOUS)
def point_to_projective(p):
    """Convert a point to homogeneous coordinates (x, y, z, 1)."""
    return (*coordinates(p), 1)


@kernel(d=DIRECTION, returns=HOMOGENEOUS)
def direction_to_projective(d):
    """Convert a direction, a point at infinity, to homogeneous coordinates (x, y, z, 0)."""
    return (*coordinates(d), 0)


@kernel(x=HOMOGENEOUS, returns=TRIVECTOR)
def trivector_from_projective(x):
    """Convert homogeneous coordinates (x, y, z, w) to a trivector, a weighted point or a direction."""
    return _trivector(x[:3], x[3])


@kernel(line=LINE, returns=array(SCALAR, 6))
def line_to_projective(line):
    """Convert a line to Pluecker coordinates e12 e13 e23 e14 e24 e34.

    For points a and b with w = 1 on the line, these are the coefficients of ``a ^ b`` of four-vectors.
    """
    x, y, z = coordinates(direction_of_line(line))
    return line["e03"], -line["e02"], line["e01"], -x, -y, -z


@kernel(x=array(SCALAR, 6), returns=LINE)
def line_from_projective(x):
    """Convert Pluecker coordinates e12 e13 e23 e14 e24 e34, as returned by `line_to_projective`, to a line."""
    return _line((-x[3], -x[4], -x[5]), (x[2], -x[1], x[0]))


@kernel(plane=PLANE, returns=HOMOGENEOUS)
def plane_to_projective(plane):
    """Convert a plane to (a, b, c, d), where ``a x + b y + c z + d w = 0`` for its points."""
    return tuple(plane[name] for name in ("e1", "e2", "e3", "e0"))


@kernel(x=HOMOGENEOUS, returns=PLANE)
def plane_from_projective(x):
    """Convert (a, b, c, d) to the plane ``a x + b y + c z + d = 0``."""
    return _plane(x[:3], x[3])


@kernel(p=POINT, returns=TRANSLATOR)
def point_to_motor_algebra(p):
    """Convert a point x to ``1 + I x`` in the even algebra, with ``I = e0123`` and x as ``x e23 - y e13 + z e12``."""
    return 1 + PSEUDOSCALAR * _spatial(coordinates(p))


@kernel(x=TRANSLATOR, returns=POINT)
def point_from_motor_algebra(x):
    """Convert ``1 + I x`` of the even algebra to a point."""
    return _trivector([-x[name] for name in ("e01", "e02", "e03")], 1)


@kernel(line=LINE, returns=(VECTOR, VECTOR))
def line_to_motor_algebra(line):
    """Extract the spatial bivectors n and m, as vectors, of a line ``n + I m`` in the even algebra.

    `m` is ``-(p x n)``. The line is the same element in both algebras; the sign is that of ``I = e0123``.
    """
    return coordinates(direction_of_line(line)), tuple(-line[name] for name in ("e01", "e02", "e03"))


@kernel(n=VECTOR, m=VECTOR, returns=LINE)
def line_from_motor_algebra(n, m):
    """Construct the line ``n + I m`` from two spatial bivectors, given as vectors, with ``I = e0123``."""
    return _spatial(n) + PSEUDOSCALAR * _spatial(m)


@kernel(plane=PLANE, returns=PLANE_OF_EVEN)
def plane_to_motor_algebra(plane):
    """Convert the plane ``n . x = d`` to ``n - I d`` in the even algebra: n is a spatial bivector, ``I = e0123``."""
    return _spatial([plane[name] for name in ("e1", "e2", "e3")]) + plane["e0"] * PSEUDOSCALAR


@kernel(x=PLANE_OF_EVEN, returns=PLANE)
def plane_from_motor_algebra(x):
    """Convert ``n - I d`` of the even algebra to a plane."""
    return _plane((x["e23"], -x["e13"], x["e12"]), x["e0123"])


@kernel(m=MOTOR, x=TRANSLATOR, returns=TRANSLATOR)
def move_point_of_motor_algebra(m, x):
    """Move the point ``1 + I x`` within the even algebra by the motor `m`.

    The result is ``m x`` times the reverse of `m` with its dual part negated. Lines ``n + I m`` move as in `move_line`.
    """
    return m * x * ~_dual_conjugate(m)


@kernel(m=MOTOR, x=PLANE_OF_EVEN, returns=PLANE_OF_EVEN)
def move_plane_of_motor_algebra(m, x):
    """Move the plane ``n - I d`` within the even algebra by the motor `m`.

    The result is ``m x`` times the reverse of `m` with its dual part negated.
    """
    return m * x * ~_dual_conjugate(m)


def _spatial(v):
    return ga.assemble(PGA3, {"e12": v[2], "e13": -v[1], "e23": v[0]})


def _dual_conjugate(x):
    """Negate the part of an element that contains e0: ``R + I R'`` becomes ``R - I R'``."""
    return ga.assemble(PGA3, {name: -x[name] if "0" in name else x[name] for name in EVEN.blades})


# Velocities.


@kernel(a=LINE, b=LINE)
def line_commutator(a, b):
    """Compute the commutator ``(a b - b a) / 2`` of lines, twists or wrenches: the Lie bracket of the motor group."""
    return ga.commutator(a, b)


twist_on_point = TWISTS.twist_on_point
twist_on_line = TWISTS.twist_on_line


@kernel(v=LINE, plane=PLANE)
def twist_on_plane(v, plane):
    """Compute the rate of change of a plane under the twist `v`, as in `twist_on_point`."""
    return ga.commutator(plane, v)


# Dynamics of rigid bodies. A force at a point is the line through it along the force; momenta are lines, too.


@kernel(v=LINE, f=LINE)
def power(v, f):
    """Compute the power of a wrench `f` on a body with the twist `v`.

    It is the angular velocity times the moment plus the linear velocity times the force.
    """
    return v & f


@kernel(m=MOTOR, body=BODY, returns=BODY)
def inertia_of_moved_body(m, body):
    """Compute the inertia about the origin of a body that was moved by the motor `m`.

    `body` contains the mass, the centre of mass x y z, and the entries xx, xy, xz, yy, yz, zz of the inertia tensor
    about that centre, all before the motion. The result contains the mass, mass times centre, and the tensor about the
    origin; the inertias of several bodies can be added.
    """
    mass, *centre, xx, xy, xz, yy, yz, zz = body
    c = coordinates(m * _trivector(centre, 1) * ~m)
    rows = _matrix_of_rotor(_rotor_part(m))
    columns = [[dot(row, column) for row in rows] for column in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))]
    h = [mass * x for x in c]
    tensor = [[dot(rows[i], [column[j] for column in columns]) - c[i] * h[j] for j in range(3)] for i in range(3)]
    trace = dot(c, h)
    return (mass, *h, *(tensor[i][j] + (trace if i == j else 0) for i in range(3) for j in range(i, 3)))


@kernel(inertia=BODY, v=LINE, returns=LINE)
def momentum(inertia, v):
    """Compute the momentum of a body with the twist `v`.

    `inertia` is taken about the origin, as returned by `inertia_of_moved_body`.
    """
    return _momentum(inertia, v)


@kernel(inertia=BODY, v=LINE, a=LINE, returns=LINE)
def inertial_wrench(inertia, v, a):
    """Compute the wrench required for the twist `v` with rate of change `a`: the rate of the body's momentum."""
    return _momentum(inertia, a) + ga.commutator(_momentum(inertia, v), v)


@kernel(v=LINE, axis=LINE, speed=SCALAR)
def twist_after_joint(v, axis, speed):
    """Compute the twist of the link that a joint carries from the twist `v` of the link that carries the joint.

    `axis` is the twist of the joint at unit speed, at its current position.
    """
    return v + speed * axis


@kernel(v=LINE, a=LINE, axis=LINE, speed=SCALAR, acceleration=SCALAR, returns=LINE)
def twist_rate_after_joint(v, a, axis, speed, acceleration):
    """Compute the rate of change of `twist_after_joint`.

    `a` is the rate of change of `v`, and the axis moves with the carrying link.
    """
    return a + acceleration * axis + speed * ga.commutator(axis, v)


def _momentum(inertia, v):
    mass, hx, hy, hz, xx, xy, xz, yy, yz, zz = inertia
    h, w, linear = (hx, hy, hz), coordinates(direction_of_line(v)), [v[name] for name in ("e01", "e02", "e03")]
    force = [mass * x + y for x, y in zip(linear, _cross(w, h), strict=True)]
    tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    return _line(force, [dot(row, w) + x for row, x in zip(tensor, _cross(h, linear), strict=True)])


def _matrix_of_rotor(r):
    columns = [coordinates(r * axis * ~r) for axis in AXES]
    return [[column[i] for column in columns] for i in range(3)]
