"""Euclidean space by plane-based geometric algebra G(3,0,1): points, lines, planes and rigid motions.

Planes are vectors: ``a e1 + b e2 + c e3 + d e0`` is the plane ``a x + b y + c z + d = 0``. Lines are bivectors: that
of direction ``d`` through ``p`` is ``d1 e23 - d2 e13 + d3 e12 + m1 e01 + m2 e02 + m3 e03``, where ``m = p x d`` is the
moment. Points are trivectors: ``x e032 + y e013 + z e021 + e123``. Without the term ``e123`` that is a direction,
which translations leave alone.

A motor ``m`` moves everything by the same product ``m x ~m``. The motor ``exp(-angle/2 line)`` turns by the right-hand
rule about the unit line ``line``, and ``1 - (x e01 + y e02 + z e03)/2`` translates by (x, y, z). ``m n`` does ``n``
first. ``m`` and ``-m`` are the same motion. Angles are in radians; lengths are in the units of the coordinates.
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
from gacompiler.specs.families.rotations import quaternion_of_matrix, rotations_of_space

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
"""Squared angles up to this are 0: what is left is a translation."""
PARALLEL = Fraction(1, 10**24)
"""Squared sines up to this are rounding."""
MUCH_SMALLER = Fraction(1, 10**6)
NEARLY_OPPOSITE, ROUNDING = Fraction(1, 10**4), Fraction(1, 10**28)
LOCKED = Fraction(5, 10**15)
"""Sines of half angles up to this are gimbal lock."""
HALF = Fraction(1, 2)


def _rotor(w, x, y, z):
    """The rotor whose quaternion is ``w + x i + y j + z k``."""
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
    """The point of a line, of any norm but 0, that is nearest to the point `p`."""
    foot = ga.inner_product(p, line) ^ line
    return foot / foot["e123"]


def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _rotor_part(m):
    return ga.assemble(PGA3, {name: m[name] for name in ROTOR.blades})


def _study_unit(x):
    """`x` times ``(x ~x)**(-1/2)``, which is a dual number ``s + p I`` to the power -1/2 because `x` is even."""
    study = x * ~x
    s = study["1"]
    return x * (1 - study["e0123"] / (2 * s) * PSEUDOSCALAR) / ga.sqrt(s)


PRODUCTS = products(PGA3, hyperplanes="planes")
POINTS_AND_LINES, MOTORS = points_and_lines(PGA3), motors(PGA3, LINE, motion="screw motion")
MOTIONS, TWISTS = motions(PGA3, _translator), twists(PGA3, LINE)
ROTATIONS = rotations_of_space(PGA3, _rotor, AXES, coordinates)


# Products, involutions and duals of any two elements.

geometric_product = PRODUCTS.geometric_product
outer_product = PRODUCTS.outer_product
regressive_product = PRODUCTS.regressive_product
inner_product = PRODUCTS.inner_product


@kernel(a=FULL, b=FULL)
def commutator(a, b):
    """``(a b - b a) / 2`` for any two elements."""
    return ga.commutator(a, b)


reverse = PRODUCTS.reverse
grade_involution = PRODUCTS.grade_involution
clifford_conjugate = PRODUCTS.clifford_conjugate
dual = PRODUCTS.dual
undual = PRODUCTS.undual
norm = PRODUCTS.norm


@kernel(a=FULL)
def ideal_norm(a):
    """The norm of the dual of any element: of a point its distance to the origin, of a direction its length."""
    return ga.norm(ga.dual(a))


# Points, lines and planes.


@kernel(t=TRIVECTOR, returns=POINT)
def point_from_trivector(t):
    """The point with weight 1 of a trivector. The weight, the coefficient of e123, must not be 0."""
    return t / t["e123"]


normalize_line = POINTS_AND_LINES.normalize_line.documented(
    "The line divided by the length of its direction. A line at infinity has length 0 and cannot be normalised."
)


@kernel(plane=PLANE)
def normalize_plane(plane):
    """The plane divided by the length of its normal. The plane at infinity has length 0 and cannot be normalised."""
    return ga.normalize(plane)


join_points = POINTS_AND_LINES.join_points
join_point_direction = POINTS_AND_LINES.join_point_direction


@kernel(p=POINT, line=LINE)
def join_point_line(p, line):
    """The plane that contains the point and the line; 0 where the point lies on the line.

    Its norm is the distance of the point times the norm of the line.
    """
    return p & line


@kernel(a=POINT, b=POINT, c=POINT)
def join_three_points(a, b, c):
    """The plane through three points, seen counter-clockwise from where its normal points; 0 if they are on a line.

    Its norm is twice the area of the triangle.
    """
    return a & b & c


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def join_four_points(a, b, c, d):
    """Six times the signed volume ``det[b - a, c - a, d - a]`` of a tetrahedron; 0 where the points lie in one plane.

    It is positive where `d` is on the side of the normal of ``join_three_points(a, b, c)``.
    """
    return a & b & c & d


@kernel(p=PLANE, q=PLANE)
def meet_planes(p, q):
    """The line in which two planes meet, along the vector product of the normals.

    Parallel planes meet in a line at infinity (direction 0); a plane with itself gives 0.
    """
    return p ^ q


@kernel(line=LINE, plane=PLANE)
def meet_line_plane(line, plane):
    """The point, with a weight, in which a line meets a plane.

    The weight is the inner product of direction and normal: 0, a direction, where they are parallel; all is 0 where
    the line lies in the plane.
    """
    return line ^ plane


@kernel(p=PLANE, q=PLANE, r=PLANE)
def meet_three_planes(p, q, r):
    """The point, with a weight, that three planes have in common. The weight is the determinant of the normals."""
    return p ^ q ^ r


@kernel(p=POINT, plane=PLANE)
def line_orthogonal_to_plane(p, plane):
    """The line through the point `p` along the normal of the plane; its norm is that of the plane."""
    return ga.inner_product(plane, p)


@kernel(p=POINT, line=LINE)
def plane_orthogonal_to_line(p, line):
    """The plane through the point `p` whose normal is the direction of the line; its norm is that of the line."""
    return ga.inner_product(p, ~line)


@kernel(p=POINT, plane=PLANE)
def plane_through_point(p, plane):
    """The plane through the point `p` that is parallel to the plane, of the same norm."""
    return ga.inner_product(p, plane) * ~p


distance_squared_points = POINTS_AND_LINES.distance_squared_points
distance_points = POINTS_AND_LINES.distance_points


@kernel(p=POINT, plane=UNIT_PLANE)
def signed_distance_point_plane(p, plane):
    """The distance of a point to a normalised plane, positive on the side of the normal."""
    return plane & p


@kernel(p=POINT, line=UNIT_LINE)
def distance_point_line(p, line):
    """The distance of a point to a normalised line."""
    return ga.norm(p & line)


@kernel(line=UNIT_LINE, other=UNIT_LINE)
def mutual_moment(line, other):
    """Distance times sine of the angle of two normalised lines; 0 exactly where they meet or are parallel.

    With points p, q and directions d, e it is ``(p - q) . (d x e)``.
    """
    return line & other


@kernel(p=UNIT_PLANE, q=UNIT_PLANE)
def angle_between_planes(p, q):
    """The angle between the normals of two normalised planes, in [0, pi], accurate also where it is small."""
    return ga.atan2(ga.norm(p ^ q), ga.scalar_product(p, q))


@kernel(line=UNIT_LINE, other=UNIT_LINE)
def angle_between_lines(line, other):
    """The angle between the directions of two normalised lines, in [0, pi], accurate also where it is small."""
    return ga.atan2(ga.norm(ga.commutator(line, other)), ga.scalar_product(line, ~other))


@kernel(p=POINT, plane=PLANE)
def project_point_on_plane(p, plane):
    """The point of the plane, of any norm but 0, that is nearest to the point `p`."""
    return ga.right_contraction(p, plane) * ga.inverse(plane)


@kernel(p=POINT, plane=UNIT_PLANE)
def project_point_on_unit_plane(p, plane):
    """The point of the normalised plane that is nearest to the point `p`."""
    return ga.right_contraction(p, plane) * plane


@kernel(p=POINT, line=LINE)
def project_point_on_line(p, line):
    """The point of the line that is nearest to the point `p`: where the plane through `p` orthogonal to it meets it.

    The line may have any norm but 0.
    """
    return _foot(p, line)


@kernel(p=POINT, line=UNIT_LINE)
def project_point_on_unit_line(p, line):
    """The point of the normalised line that is nearest to the point `p`."""
    return ga.right_contraction(p, line) * ~line


@kernel(line=LINE, plane=UNIT_PLANE)
def project_line_on_unit_plane(line, plane):
    """The orthogonal projection of a line on a normalised plane; at infinity where the line is orthogonal to it."""
    return ga.right_contraction(line, plane) * plane


@kernel(p=POINT, plane=UNIT_PLANE)
def reflect_point(p, plane):
    """The mirror image of the point `p` in the normalised plane."""
    return plane * p * plane


# Numbers into lines and planes, and back.


@kernel(d=DIRECTION, m=VECTOR, returns=LINE)
def line_from_direction_moment(d, m):
    """The line of Pluecker coordinates `d`, its direction, and `m`, its moment ``p x d`` for all p on it.

    They must be orthogonal, which `plucker_residual` measures.
    """
    return _line(coordinates(d), m)


@kernel(line=LINE, returns=(DIRECTION, VECTOR))
def line_to_direction_moment(line):
    """Direction and moment of a line, its Pluecker coordinates."""
    return direction_of_line(line), tuple(line[name] for name in ("e01", "e02", "e03"))


@kernel(b=LINE)
def plucker_residual(b):
    """Direction times moment of a bivector, ``(b ^ b) / 2``: 0 for lines, pitch times squared length for screws."""
    return (b ^ b)["e0123"] / 2


@kernel(line=LINE, returns=POINT)
def line_support(line):
    """The point of a line, of any norm but 0, that is nearest to the origin."""
    return _foot(ORIGIN, line)


@kernel(line=UNIT_LINE, t=SCALAR, returns=POINT)
def point_on_line(line, t):
    """The point of a normalised line at the signed distance `t` from its support point, along its direction."""
    return foot_on_unit_line(ORIGIN, line) + t * direction_of_line(line)


@kernel(p=POINT, line=UNIT_LINE, returns=SCALAR)
def position_along_line(p, line):
    """The `t` of the point of a normalised line that is nearest to `p`, as in `point_on_line`."""
    x, y, z = coordinates(p)
    return x * line["e23"] - y * line["e13"] + z * line["e12"]


@kernel(normal=DIRECTION, distance=SCALAR, returns=PLANE)
def plane_from_normal(normal, distance):
    """The plane ``normal . x = distance``; for a normal of length 1, that is its signed distance from the origin."""
    return _plane(coordinates(normal), -distance)


@kernel(p=POINT, normal=DIRECTION, returns=PLANE)
def plane_from_point_normal(p, normal):
    """The plane through the point `p` with a normal, whose length is its norm."""
    n = coordinates(normal)
    return _plane(n, -sum(a * b for a, b in zip(coordinates(p), n, strict=True)))


@kernel(p=POINT, d=DIRECTION, e=DIRECTION)
def join_point_directions(p, d, e):
    """The plane through the point `p` along two directions, of normal ``d x e``; 0 where they are parallel."""
    return p & d & e


@kernel(plane=PLANE, returns=(DIRECTION, SCALAR))
def plane_to_normal(plane):
    """The unit normal of a plane, and its signed distance from the origin along it: ``normal . x = distance``."""
    n = [plane[name] for name in ("e1", "e2", "e3")]
    length = ga.sqrt(sum(a * a for a in n))
    return _trivector([a / length for a in n]), -plane["e0"] / length


@kernel(plane=PLANE, returns=POINT)
def plane_support(plane):
    """The point of a plane, of any norm but 0, that is nearest to the origin."""
    return ga.right_contraction(ORIGIN, plane) * ga.inverse(plane)


@kernel(a=POINT, b=POINT, returns=PLANE)
def bisector_plane(a, b):
    """The plane of the points as far from `a` as from `b`, its normal ``b - a``; 0 where they are the same."""
    difference, total = coordinates(b - a), coordinates(a + b)
    return _plane(difference, -sum(x * y for x, y in zip(difference, total, strict=True)) / 2)


@kernel(p=UNIT_PLANE, q=UNIT_PLANE, returns=(PLANE, PLANE))
def bisectors_of_planes(p, q):
    """The planes of equal and of opposite signed distances from two normalised planes: ``p - q`` and ``p + q``.

    Of parallel planes one is the plane half way, the other the plane at infinity; it is 0 where they coincide.
    """
    return p - q, p + q


midpoint = POINTS_AND_LINES.midpoint


# Distances, angles and closest points of all pairs. Where the size of a sine decides, the arguments are normalised
# but not declared so: then ``1 - cosine**2`` cannot take its place.


@kernel(a=LINE, b=LINE, returns=(POINT, POINT))
def closest_points_of_lines(a, b):
    """The point of the normalised line `a` nearest to `b`, and that of `b` nearest to `a`.

    Of parallel lines (the sine of the angle at most 1e-12) all are equally near: the support point of `a` is taken.
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
    """The normalised line that meets two normalised lines at right angles, along ``d x e`` of their directions.

    Of parallel lines (the sine of the angle at most 1e-12) it is that through the support point of `a`, from `a` to
    `b`; not a number where they coincide.
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
    """The distance of two normalised lines, positive where `b` is on the side of ``d x e`` of their directions.

    Of parallel lines (the sine of the angle at most 1e-12) it has no sign and is not negative.
    """
    both = ga.commutator(a, b)
    squared_sine = ga.norm_squared(both)
    parallel = squared_sine <= PARALLEL
    across = ga.sqrt(sum(both[name] * both[name] for name in ("e01", "e02", "e03")))
    return ga.select(parallel, across, -(a & b) / ga.sqrt(ga.select(parallel, 1, squared_sine)))


@kernel(a=LINE, b=LINE, returns=SCALAR)
def distance_lines(a, b):
    """The distance of two normalised lines, parallel ones (the sine of the angle at most 1e-12) included."""
    return ga.absolute(signed_distance_lines(a, b))


@kernel(line=UNIT_LINE, plane=UNIT_PLANE, returns=SCALAR)
def signed_distance_line_plane(line, plane):
    """The signed distance of a normalised line to a normalised plane, positive on the side of the normal.

    It is 0 where they meet: where the sine of the angle is more than 1e-12.
    """
    sine = (line ^ plane)["e123"]
    return ga.select(sine * sine <= PARALLEL, plane & (foot_on_unit_line(ORIGIN, line)), 0)


@kernel(p=PLANE, q=PLANE, returns=SCALAR)
def signed_distance_planes(p, q):
    """How far the normalised plane `q` is from the normalised plane `p` along the normal of `p`.

    It is 0 where they meet: where the sine of the angle is more than 1e-12.
    """
    same = ga.select(ga.scalar_product(p, q) < 0, -1, 1)
    return ga.select(ga.norm_squared(p ^ q) <= PARALLEL, p["e0"] - same * q["e0"], 0)


@kernel(line=UNIT_LINE, plane=UNIT_PLANE, returns=SCALAR)
def signed_angle_line_plane(line, plane):
    """The angle of a normalised line to a normalised plane, in [-pi/2, pi/2], positive where it leaves by the normal.

    Accurate where it is small and where the line is nearly orthogonal to the plane.
    """
    return ga.atan2((line ^ plane)["e123"], ga.norm(ga.inner_product(plane, line)))


@kernel(a=UNIT_LINE, b=UNIT_LINE, axis=DIRECTION, returns=SCALAR)
def signed_angle_between_lines(a, b, axis):
    """The angle between the directions of two normalised lines, in [-pi, pi].

    It is negative where ``d x e`` of the directions is against `axis`, a direction of any length but 0.
    """
    turned = direction_of_line(ga.commutator(b, a))
    against = sum(x * y for x, y in zip(coordinates(turned), coordinates(axis), strict=True)) < 0
    angle = ga.atan2(ga.norm(ga.commutator(a, b)), ga.scalar_product(a, ~b))
    return ga.select(against, -angle, angle)


@kernel(p=UNIT_PLANE, q=UNIT_PLANE, axis=DIRECTION, returns=SCALAR)
def signed_angle_between_planes(p, q, axis):
    """The angle between the normals of two normalised planes, in [-pi, pi].

    It is negative where their vector product is against `axis`, a direction of any length but 0.
    """
    meet = p ^ q
    against = sum(x * y for x, y in zip(coordinates(direction_of_line(meet)), coordinates(axis), strict=True)) < 0
    angle = ga.atan2(ga.norm(meet), ga.scalar_product(p, q))
    return ga.select(against, -angle, angle)


# Joins and meets that may not exist, and how things lie.


@kernel(a=UNIT_LINE, b=UNIT_LINE, returns=PLANE)
def join_lines(a, b):
    """The normalised plane of two normalised lines that meet or are parallel; not a number where they coincide.

    Its normal is along ``d x e`` of the directions; of parallel lines, along the direction of `a` times the way to
    `b`. Of skew lines, which `mutual_moment` tells, it is the plane of `a` that is parallel to `b`.
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
    """The point, with a weight, in which two normalised lines meet; the weight is the squared sine of their angle.

    Of skew lines it is the middle of their common perpendicular. Of parallel lines it is 0.
    """
    axis = direction_of_line(ga.commutator(a, b))
    return ((axis & a) ^ b) / 2 - ((axis & b) ^ a) / 2


@kernel(a=LINE, b=LINE, distance=SCALAR, sine=SCALAR, returns=SCALAR)
def relation_of_lines(a, b, distance, sine):
    """How two normalised lines lie: 0 the same, 1 parallel, 2 they meet, 3 skew.

    Distances up to `distance`, and angles with a sine up to `sine`, count as 0. Directions may be opposite.
    """
    parallel = ga.norm_squared(ga.commutator(a, b)) <= sine * sine
    apart = distance < distance_lines(a, b)
    both = ga.commutator(a, b)
    across = sum(both[name] * both[name] for name in ("e01", "e02", "e03"))
    beside = ga.select(distance * distance < across, 1, 0)
    return ga.select(parallel, beside, ga.select(apart, 3, 2))


@kernel(line=UNIT_LINE, plane=UNIT_PLANE, distance=SCALAR, sine=SCALAR, returns=SCALAR)
def relation_of_line_plane(line, plane, distance, sine):
    """How a normalised line lies to a normalised plane: 0 in it, 1 parallel, 2 they meet in a point.

    Distances up to `distance`, of the support point of the line, and angles with a sine up to `sine` count as 0.
    """
    along = ga.absolute((line ^ plane)["e123"]) <= sine
    off = distance < ga.absolute(plane & (foot_on_unit_line(ORIGIN, line)))
    return ga.select(along, ga.select(off, 1, 0), 2)


@kernel(p=PLANE, q=PLANE, distance=SCALAR, sine=SCALAR, returns=SCALAR)
def relation_of_planes(p, q, distance, sine):
    """How two normalised planes lie: 0 the same, 1 parallel, 2 they meet in a line.

    Distances up to `distance`, and angles with a sine up to `sine`, count as 0. Normals may be opposite.
    """
    same = ga.select(ga.scalar_product(p, q) < 0, -1, 1)
    off = distance < ga.absolute(p["e0"] - same * q["e0"])
    return ga.select(ga.norm_squared(p ^ q) <= sine * sine, ga.select(off, 1, 0), 2)


@kernel(p=PLANE, q=PLANE, r=PLANE, distance=SCALAR, sine=SCALAR, returns=SCALAR)
def relation_of_three_planes(p, q, r, distance, sine):
    """What three normalised planes have in common: 0 a plane, 1 nothing, all parallel, 2 a line, 3 nothing, 4 a point.

    With 3 two of them meet, and the third is parallel to one of the two or to the line in which they meet. Distances
    up to `distance`, and angles with a sine up to `sine`, count as 0.
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


# Projections, rejections and reflections of all pairs. An element is the sum of projection and rejection.


@kernel(p=POINT, plane=UNIT_PLANE)
def reject_point_from_plane(p, plane):
    """The direction from the nearest point of the normalised plane to the point `p`."""
    return (p ^ plane) * plane


@kernel(p=POINT, line=UNIT_LINE, returns=DIRECTION)
def reject_point_from_line(p, line):
    """The direction from the nearest point of the normalised line to the point `p`."""
    return p - foot_on_unit_line(p, line)


@kernel(line=LINE, plane=UNIT_PLANE)
def reject_line_from_plane(line, plane):
    """What `project_line_on_unit_plane` takes away: a line along the normal through where the line meets the plane.

    At infinity where they are parallel; 0 where the line lies in the plane.
    """
    return (line ^ plane) * plane


@kernel(line=LINE, p=POINT, returns=LINE)
def project_line_on_point(line, p):
    """The line through the point `p` along a line, of the same norm: the parallel."""
    return p & direction_of_line(line)


@kernel(plane=PLANE, line=UNIT_LINE)
def project_plane_on_line(plane, line):
    """The plane through a normalised line whose normal is that of `plane` less its part along the line.

    It is 0, or the plane at infinity, where the line is orthogonal to `plane`.
    """
    return ga.inner_product(plane, line) * ~line


@kernel(plane=PLANE, line=UNIT_LINE)
def reject_plane_from_line(plane, line):
    """What `project_plane_on_line` takes away: a plane orthogonal to the normalised line, where it meets `plane`."""
    return (plane ^ line) * ~line


@kernel(line=LINE, plane=UNIT_PLANE, returns=LINE)
def reflect_line(line, plane):
    """The mirror image of a line in the normalised plane: its points and its direction are mirrored."""
    return -(plane * line * plane)


@kernel(q=PLANE, plane=UNIT_PLANE, returns=PLANE)
def reflect_plane(q, plane):
    """The mirror image of the plane `q` in the normalised plane: its points and its normal are mirrored."""
    return -(plane * q * plane)


@kernel(p=POINT, line=UNIT_LINE)
def reflect_point_in_line(p, line):
    """The point `p` after a half turn about the normalised line."""
    return line * p * ~line


@kernel(a=LINE, line=UNIT_LINE)
def reflect_line_in_line(a, line):
    """The line `a` after a half turn about the normalised line."""
    return line * a * ~line


@kernel(plane=PLANE, line=UNIT_LINE)
def reflect_plane_in_line(plane, line):
    """The plane after a half turn about the normalised line."""
    return line * plane * ~line


@kernel(a=POINT, p=POINT)
def reflect_point_in_point(a, p):
    """The point opposite to `a` with `p` in the middle."""
    return -(p * a * p)


@kernel(line=LINE, p=POINT)
def reflect_line_in_point(line, p):
    """The line through the images of its points in `p`, in the opposite direction."""
    return p * line * p


@kernel(plane=PLANE, p=POINT)
def reflect_plane_in_point(plane, p):
    """The plane of the images of its points in `p`; its normal is turned round."""
    return p * plane * p


# How far from a common line or plane, in the units of the coordinates; and which way round.


@kernel(a=POINT, b=POINT, c=POINT, returns=SCALAR)
def collinearity_residual(a, b, c):
    """The smallest height of a triangle: 0 where three points lie on a line, and where points coincide."""
    longest = ga.maximum(ga.norm_squared(a & b), ga.maximum(ga.norm_squared(b & c), ga.norm_squared(c & a)))
    return ga.norm(a & b & c) / ga.sqrt(ga.select(longest <= 0, 1, longest))


@kernel(a=POINT, b=POINT, c=POINT, d=POINT, returns=SCALAR)
def coplanarity_residual(a, b, c, d):
    """The smallest height of a tetrahedron: 0 where four points lie in a plane.

    It has the sign of `join_four_points`, the orientation: positive where `d` is on the side of the normal of
    ``join_three_points(a, b, c)``.
    """
    faces = [ga.norm_squared(x & y & z) for x, y, z in ((a, b, c), (a, b, d), (a, c, d), (b, c, d))]
    largest = ga.maximum(ga.maximum(faces[0], faces[1]), ga.maximum(faces[2], faces[3]))
    return (a & b & c & d) / ga.sqrt(ga.select(largest <= 0, 1, largest))


# Flags: a point on a line in a plane.


@kernel(p=POINT, line=UNIT_LINE, plane=UNIT_PLANE, returns=(SCALAR, SCALAR, SCALAR))
def flag_residuals(p, line, plane):
    """How far the point is from the line, from the plane (signed), and the sine of the angle of line and plane."""
    return ga.norm(p & line), plane & p, (line ^ plane)["e123"]


@kernel(a=POINT, b=POINT, c=POINT, returns=(POINT, LINE, PLANE))
def flag_from_points(a, b, c):
    """The flag of three points: `a`, the normalised line to `b`, the normalised plane of all; NaN if on a line."""
    return a, ga.normalize(a & b), ga.normalize(a & b & c)


@kernel(m=MOTOR, returns=(POINT, LINE, PLANE))
def flag_from_motor(m):
    """The flag of origin, x axis and plane ``z = 0`` moved by the unit motor `m`."""
    return m * ORIGIN * ~m, m * AXIS_X * ~m, m * PGA3.multivector({"e3": 1}) * ~m


@kernel(p=POINT, line=UNIT_LINE, plane=UNIT_PLANE, returns=MOTOR)
def motor_from_flag(p, line, plane):
    """The motor that takes origin, x axis and plane ``z = 0`` to a flag: the inverse of `flag_from_motor`.

    Where the residuals are not 0 the point is kept, then the direction of the line, then the side of the plane.
    """
    return _translator(coordinates(p)) * _rotor_of_flag(line, plane)


@kernel(a=POINT, b=POINT, c=POINT, returns=MOTOR)
def motor_from_points(a, b, c):
    """The motor that takes the origin to `a`, x towards `b`, and the plane ``z = 0`` to that of all three.

    `c` is on the side of y. Not a number where the points are on a line.
    """
    return _translator(coordinates(a)) * _rotor_of_flag(ga.normalize(a & b), ga.normalize(a & b & c))


def _rotor_of_flag(line, plane):
    """The rotor of x axis and z axis, the direction of a line and the normal of a plane that contains it."""
    x = coordinates(direction_of_line(line))
    y = _cross([plane[name] for name in ("e1", "e2", "e3")], x)
    length = ga.sqrt(dot(y, y))
    y = [a / length for a in y]
    return _rotor_of_matrix(tuple(zip(x, y, _cross(x, y), strict=True)))


# Rays.


@kernel(p=POINT, d=DIRECTION, plane=PLANE, returns=(SCALAR, POINT))
def hit_ray_plane(p, d, plane):
    """The `t` for which ``p + t d`` is on the plane, of any norm but 0, and that point.

    The ray hits where ``t >= 0``. Where they are parallel `t` is infinite, or NaN if the ray lies in the plane.
    """
    t = -(plane & p) / (plane & d)
    return t, p + t * d


@kernel(p=POINT, d=DIRECTION, a=POINT, b=POINT, c=POINT, returns=(SCALAR, VECTOR))
def hit_ray_triangle(p, d, a, b, c):
    """The `t` for which ``p + t d`` is in the plane of a triangle, and the barycentric coordinates of that point.

    The ray hits where `t` and the coordinates are all at least 0; a coordinate of 0 is on an edge. Nothing is finite
    where the ray is parallel to the plane. Both sides count. The coordinates are moments of the ray about the edges.
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
    """The unit motor of an even element: ``x (x ~x)**(-1/2)``.

    ``x ~x`` is a dual number ``s + p e0123``, so that both conditions, norm 1 and the Study quadric, hold afterwards,
    and a motor times any dual number gives the motor back. The rotational part must not be 0.
    """
    return _study_unit(x)


move_point = MOTORS.move_point
move_direction = MOTIONS.move_direction
move_line = MOTIONS.move_line.documented(
    "The line, or any bivector such as a twist, moved by the unit motor `m`: ``m line ~m``."
)


@kernel(m=MOTOR, plane=PLANE)
def move_plane(m, plane):
    """The plane moved by the unit motor `m`: ``m plane ~m``."""
    return m * plane * ~m


@kernel(m=MOTOR, n=MOTOR, returns=MOTOR)
def move_motor(m, n):
    """The motion `n` carried along by the unit motor `m`: ``m n ~m``, the same motion about the moved screw axis."""
    return m * n * ~m


move_point_back = MOTIONS.move_point_back


@kernel(axis=VECTOR, angle=SCALAR, returns=ROTOR)
def rotor_from_axis_angle(axis, angle):
    """The rotation about an axis through the origin, right-handed, in radians. The axis may have any length but 0."""
    x, y, z = axis
    factor = ga.sin(angle / 2) / ga.sqrt(x * x + y * y + z * z)
    return _rotor(ga.cos(angle / 2), factor * x, factor * y, factor * z)


@kernel(v=VECTOR, returns=ROTOR)
def rotor_from_rotation_vector(v):
    """The rotation about `v` by its length in radians, through the origin; smooth where the vector is 0."""
    return ga.exp(ga.assemble(PGA3, {"e12": -v[2] / 2, "e13": v[1] / 2, "e23": -v[0] / 2}))


translator_from_vector = MOTIONS.translator_from_vector


@kernel(line=UNIT_LINE, angle=SCALAR, returns=MOTOR)
def motor_from_line(line, angle):
    """The right-handed rotation about a normalised line: ``exp(-angle/2 line)``."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) * line


@kernel(line=UNIT_LINE, angle=SCALAR, distance=SCALAR, returns=MOTOR)
def motor_from_screw(line, angle, distance):
    """The screw motion about a normalised line: right-handed by `angle`, along it by `distance`."""
    rotation = ga.cos(angle / 2) - ga.sin(angle / 2) * line
    return (1 + distance / 2 * PSEUDOSCALAR * line) * rotation


@kernel(r=ROTOR, v=VECTOR, returns=MOTOR)
def motor_from_rotor_translation(r, v):
    """The motor that turns by the rotor `r` and then translates by the vector `v`."""
    return _translator(v) * r


@kernel(m=MOTOR, returns=(ROTOR, VECTOR))
def motor_to_rotor_translation(m):
    """The rotor and the translation vector of a unit motor: what `motor_from_rotor_translation` puts together."""
    rotor = ga.assemble(PGA3, {name: m[name] for name in ROTOR.blades})
    return rotor, coordinates(m * ORIGIN * ~m)


rotor_from_quaternion = ROTATIONS.rotor_from_quaternion
rotor_to_quaternion = ROTATIONS.rotor_to_quaternion


@kernel(q=array(SCALAR, 8), returns=MOTOR)
def motor_from_dual_quaternion(q):
    """The motor of a unit dual quaternion ``r + eps d``, stored as (r_w, r_x, r_y, r_z, d_w, d_x, d_y, d_z).

    Scalars first, and ``d = t r / 2`` for a translation by `t` after the rotation `r`. The dual unit eps is -e0123.
    """
    return _rotor(*q[:4]) - PSEUDOSCALAR * _rotor(*q[4:])


@kernel(m=MOTOR, returns=array(SCALAR, 8))
def motor_to_dual_quaternion(m):
    """The unit dual quaternion of a motor as (r_w, r_x, r_y, r_z, d_w, d_x, d_y, d_z), scalars first.

    The inverse of `motor_from_dual_quaternion`: ``d = t r / 2`` for a translation by `t` after the rotation `r`.
    """
    return m["1"], -m["e23"], m["e13"], -m["e12"], -m["e0123"], -m["e01"], -m["e02"], -m["e03"]


@kernel(m=MOTOR, returns=MATRIX)
def motor_to_matrix(m):
    """The homogeneous 4 x 4 matrix of a unit motor, which acts on columns (x, y, z, 1)."""
    columns = [coordinates(m * axis * ~m) for axis in AXES] + [coordinates(m * ORIGIN * ~m)]
    return (*zip(*columns, strict=True), (0, 0, 0, 1))


rotor_to_matrix = ROTATIONS.rotor_to_matrix


@kernel(matrix=MATRIX, returns=MOTOR)
def motor_from_matrix(matrix):
    """The motor of a homogeneous 4 x 4 matrix of a rigid motion, the one of two whose scalar part is not negative.

    The largest of the four squares of the quaternion's coefficients, which is at least 1/4, says which row of
    products of coefficients is divided by its length (Shepperd, *J. Guidance and Control* 1:223, 1978), so that all
    rotations, half turns among them, are equally accurate and the result is a unit motor also where the matrix is
    orthogonal only nearly. The last row of the matrix is not looked at. At an exact half turn both signs are right.
    """
    return _translator([matrix[i][3] for i in range(3)]) * _rotor_of_matrix(matrix)


rotor_from_matrix = ROTATIONS.rotor_from_matrix


def _rotor_of_matrix(matrix):
    return _rotor(*quaternion_of_matrix(matrix))


@kernel(theta=SCALAR, d=SCALAR, a=SCALAR, alpha=SCALAR, returns=MOTOR)
def motor_from_denavit_hartenberg(theta, d, a, alpha):
    """The motor of a row of a standard Denavit-Hartenberg table.

    Turn about z by `theta`, move along z by `d`, along the new x by `a`, and turn about it by `alpha`.
    """
    turn_z = _rotor(ga.cos(theta / 2), 0, 0, ga.sin(theta / 2))
    turn_x = _rotor(ga.cos(alpha / 2), ga.sin(alpha / 2), 0, 0)
    return turn_z * _translator([a, 0, d]) * turn_x


@kernel(theta=SCALAR, d=SCALAR, a=SCALAR, alpha=SCALAR, returns=MOTOR)
def motor_from_modified_denavit_hartenberg(theta, d, a, alpha):
    """The motor of a row of a modified (Craig's) Denavit-Hartenberg table.

    Turn about x by `alpha`, move along x by `a`, turn about the new z by `theta`, and move along it by `d`.
    """
    turn_z = _rotor(ga.cos(theta / 2), 0, 0, ga.sin(theta / 2))
    turn_x = _rotor(ga.cos(alpha / 2), ga.sin(alpha / 2), 0, 0)
    return turn_x * _translator([a, 0, d]) * turn_z


motor_exponential = MOTORS.motor_exponential.documented(
    "``exp(b)`` of any bivector; ``exp(-angle/2 line)`` is a rotation. Smooth at 0 and for pure translations."
)
motor_logarithm = MOTORS.motor_logarithm
motor_square_root = MOTORS.motor_square_root
motor_power = MOTORS.motor_power
interpolate_motors = MOTORS.interpolate_motors


@kernel(a=LINE, b=LINE, returns=MOTOR)
def motor_between_lines(a, b):
    """The motor that takes the normalised line `a` to `b` about their common perpendicular by the smaller angle.

    Where the directions are opposite to within 0.01 radians, it is the product of two half turns instead: about the
    middle of `a` and the reversed `b`, and about a line across the support point of `b`, so that exactly opposite
    lines give a half turn about some line orthogonal to both, and a shift along `b` where they are not in a plane.
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
    """The motor that takes the normalised plane `a` to `b`: a rotation about their meet, or a translation.

    Where the normals are opposite to within 0.01 radians, it is the product of two reflections instead: in the middle
    of `a` and the reversed `b`, and in a plane orthogonal to `b`, so that exactly opposite planes give a half turn
    about some line between them.
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
    """The unit vector orthogonal to the unit vector n nearest to v, or where v is unusable, to the flattest axis."""
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
    "The 6 x 6 matrix of a unit motor on lines and twists: on columns of their coefficients in a line's order."
)


@kernel(a=MOTOR, b=MOTOR, returns=array(SCALAR, 8, 8))
def motor_equation(a, b):
    """The 8 x 8 matrix of ``x -> a x - x b`` on the coefficients of a motor.

    Where motors `a` and `b` are the same motion seen from two places, the motor between the places is a null vector,
    and so is its product with the pseudoscalar.
    """
    basis = [PGA3.multivector({name: 1}) for name in MOTOR.blades]
    columns = [a * one - one * b for one in basis]
    return tuple(tuple(column[name] for column in columns) for name in MOTOR.blades)


# Screws, twists and motors in other forms.


@kernel(b=LINE, returns=(LINE, SCALAR, SCALAR))
def bivector_to_screw(b):
    """The screw of a twist or wrench: its normalised axis, its magnitude, and its pitch along the axis.

    ``b = magnitude (1 - pitch I) axis``: of a twist, angular velocity, and translation per radian. At infinity (pure
    translations, couples) the magnitude is that of the translation, the axis goes through the origin, the pitch is
    infinite. Of 0 the axis is 0 and the pitch is not a number.
    """
    axis, length, along = _screw(b)
    return axis, ga.select(length <= 0, along, length), along / length


@kernel(axis=UNIT_LINE, magnitude=SCALAR, pitch=SCALAR, returns=LINE)
def bivector_from_screw(axis, magnitude, pitch):
    """The twist or wrench of a screw with a normalised axis: ``magnitude (1 - pitch I) axis``, `pitch` finite."""
    return magnitude * (axis - pitch * PSEUDOSCALAR * axis)


@kernel(m=MOTOR, returns=(LINE, SCALAR, SCALAR))
def motor_to_screw(m):
    """The screw motion of a unit motor: its normalised axis, angle in [0, pi], and distance along the axis.

    What `motor_from_screw` puts together, up to the sign of the motor. Of a translation the angle is 0 and the axis
    goes through the origin; where nothing moves the axis is 0, too. At half turns the sense of the axis jumps.
    """
    axis, angle, distance = _screw(-2 * ga.log(m))
    return axis, angle, distance


def _screw(b):
    """Axis, length and what is along the axis of a bivector; a bivector at infinity is along an axis at the origin."""
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
    """The screw motion about a normalised line: right-handed by `angle`, along it by `pitch` for each radian."""
    rotation = ga.cos(angle / 2) - ga.sin(angle / 2) * line
    return (1 + pitch * angle / 2 * PSEUDOSCALAR * line) * rotation


motor_from_twist = TWISTS.motor_from_twist
motor_to_twist = TWISTS.motor_to_twist


@kernel(w=VECTOR, v=VECTOR, returns=LINE)
def twist_from_velocities(w, v):
    """The twist of an angular velocity, and the velocity of the point that is at the origin: ``w x p + v`` at p."""
    return _line(w, v)


@kernel(twist=LINE, returns=(VECTOR, VECTOR))
def twist_to_velocities(twist):
    """Angular velocity of a twist, and the velocity of the point that is at the origin."""
    return coordinates(direction_of_line(twist)), tuple(twist[name] for name in ("e01", "e02", "e03"))


motor_derivative = TWISTS.motor_derivative
twist_from_motor_derivative = TWISTS.twist_from_motor_derivative


@kernel(v=LINE, a=LINE, p=POINT)
def acceleration_of_point(v, a, p):
    """The acceleration of the point `p` under the twist `v`, whose own rate of change is `a`."""
    return ga.commutator(p, a) + ga.commutator(ga.commutator(p, v), v)


@kernel(r=ROTOR, returns=VECTOR)
def rotor_to_rotation_vector(r):
    """The rotation vector of a rotor, axis times angle in [0, pi]; the inverse of `rotor_from_rotation_vector`."""
    b = -2 * ga.log(r)
    return b["e23"], -b["e13"], b["e12"]


@kernel(r=ROTOR, returns=(VECTOR, SCALAR))
def rotor_to_axis_angle(r):
    """The unit axis of a rotor and its angle in [0, pi]; where nothing turns, the axis is 0."""
    sign = ga.select(r["1"] < 0, -1, 1)
    v = [-sign * r["e23"], sign * r["e13"], -sign * r["e12"]]
    sine = ga.sqrt(dot(v, v))
    factor = 1 / ga.select(sine <= 0, 1, sine)
    return tuple(factor * a for a in v), 2 * ga.atan2(sine, ga.absolute(r["1"]))


@kernel(v=VECTOR, t=VECTOR, returns=MOTOR)
def motor_from_rotation_vector_translation(v, t):
    """The motor that turns by the rotation vector `v` about the origin and then translates by the vector `t`."""
    return _translator(t) * ga.exp(_line(v, (0, 0, 0)) * -HALF)


@kernel(m=MOTOR, returns=(VECTOR, VECTOR))
def motor_to_rotation_vector_translation(m):
    """Rotation vector, of an angle in [0, pi], and translation of a unit motor, which rotates first."""
    b = -2 * ga.log(_rotor_part(m))
    return (b["e23"], -b["e13"], b["e12"]), coordinates(m * ORIGIN * ~m)


@kernel(q=QUATERNION, t=VECTOR, returns=MOTOR)
def motor_from_quaternion_translation(q, t):
    """The motor that turns by a unit quaternion (w, x, y, z) and then translates by the vector `t`."""
    return _translator(t) * _rotor(*q)


@kernel(m=MOTOR, returns=(QUATERNION, VECTOR))
def motor_to_quaternion_translation(m):
    """The unit quaternion (w, x, y, z) and the translation of a unit motor, which rotates first."""
    return (m["1"], -m["e23"], m["e13"], -m["e12"]), coordinates(m * ORIGIN * ~m)


@kernel(q=QUATERNION, returns=ROTOR)
def rotor_from_quaternion_scalar_last(q):
    """The rotor of a unit quaternion (x, y, z, w), scalar last."""
    return _rotor(q[3], q[0], q[1], q[2])


@kernel(r=ROTOR, returns=QUATERNION)
def rotor_to_quaternion_scalar_last(r):
    """The unit quaternion (x, y, z, w), scalar last, of a rotor."""
    return -r["e23"], r["e13"], -r["e12"], r["1"]


@kernel(q=array(SCALAR, 8), returns=MOTOR)
def motor_from_dual_quaternion_scalar_last(q):
    """The motor of a unit dual quaternion (r_x, r_y, r_z, r_w, d_x, d_y, d_z, d_w), scalars last."""
    return _rotor(q[3], *q[:3]) - PSEUDOSCALAR * _rotor(q[7], *q[4:7])


@kernel(m=MOTOR, returns=array(SCALAR, 8))
def motor_to_dual_quaternion_scalar_last(m):
    """The unit dual quaternion (r_x, r_y, r_z, r_w, d_x, d_y, d_z, d_w) of a motor, scalars last."""
    return -m["e23"], m["e13"], -m["e12"], m["1"], -m["e01"], -m["e02"], -m["e03"], -m["e0123"]


@kernel(matrix=array(SCALAR, 6, 6), returns=MOTOR)
def motor_from_adjoint(matrix):
    """The motor of a 6 x 6 matrix that moves lines and twists: the inverse of `motor_to_adjoint`, up to the sign.

    Where the matrix is nearly of that form, so is the motion; the block that must be 0 is not looked at.
    """
    places = ((2, 1), (1, -1), (0, 1))
    turn = tuple(tuple(s * u * matrix[i][j] for j, u in places) for i, s in places)
    shift = tuple(tuple(u * matrix[3 + i][j] for j, u in places) for i in range(3))
    cross = [[dot(shift[i], turn[j]) for j in range(3)] for i in range(3)]
    t = [HALF * (cross[2][1] - cross[1][2]), HALF * (cross[0][2] - cross[2][0]), HALF * (cross[1][0] - cross[0][1])]
    return _translator(t) * _rotor_of_matrix(turn)


translator_between_points = MOTIONS.translator_between_points
motor_between_frames = MOTIONS.motor_between_frames
motor_relative = MOTIONS.motor_relative


@kernel(a=MOTOR, b=MOTOR, t=SCALAR, returns=MOTOR)
def blend_motors(a, b, t):
    """``(1 - t) a + t b`` as a unit motor, or with ``-b`` where that is nearer: the way of NLERP, without angles.

    It is `a` at 0 and `b` or ``-b`` at 1; between, the axis and the speed are not constant. Rotations half a turn
    apart have no blend at ``t = 1/2``.
    """
    near = ga.select(ga.scalar_product(a, ~b) < 0, -t, t)
    return _study_unit((1 - t) * a + near * b)


@kernel(a=DIRECTION, b=DIRECTION, returns=MATRIX)
def rotation_form(a, b):
    """The symmetric matrix K with ``r K r = b . (r a ~r)`` for rotors r as columns 1 e12 e13 e23.

    The rotor that turns many vectors `a` nearest to `b` is the eigenvector of the largest eigenvalue of the sum.
    """
    parts = [PGA3.multivector({name: 1}) for name in ROTOR.blades]
    x = coordinates(b)
    return tuple(
        tuple(HALF * dot(coordinates(one * a * ~other + other * a * ~one), x) for other in parts) for one in parts
    )


@kernel(a=VECTOR, b=VECTOR, c=VECTOR, angles=VECTOR, returns=ROTOR)
def rotor_from_euler_angles(a, b, c, angles):
    """Turns by three angles about three unit axes, each as the turns before it leave it (intrinsic): ``A B C``.

    In the order c, b, a and with the angles turned round it is the same about fixed axes (extrinsic).
    """
    first, second, third = (
        _rotor(ga.cos(angle / 2), *(ga.sin(angle / 2) * x for x in axis))
        for axis, angle in zip((a, b, c), angles, strict=True)
    )
    return first * second * third


@kernel(r=ROTOR, a=VECTOR, b=VECTOR, returns=VECTOR)
def rotor_to_proper_euler_angles(r, a, b):
    """The angles about the axes a, b, a (intrinsic) of a rotor, for orthonormal `a` and `b`: zxz and its kin.

    The first and third in [-pi, pi], the second in [0, pi]. Where that is 0 or pi to 1e-14, the first and third turn
    about the same line and the third is 0. By half the sum and half the difference of two angles (Bernardes and
    Viollet, *PLoS ONE* 17(11):e0276302, 2022).
    """
    w, v = r["1"], (-r["e23"], r["e13"], -r["e12"])
    first, third, sine, cosine = _euler_angles(w, dot(v, a), dot(v, b), dot(v, _cross(a, b)))
    return first, 2 * ga.atan2(sine, cosine), third


@kernel(r=ROTOR, a=VECTOR, b=VECTOR, returns=VECTOR)
def rotor_to_tait_bryan_angles(r, a, b):
    """The angles about the axes a, b, ``a x b`` (intrinsic) of a rotor, for orthonormal `a` and `b`: xyz and its kin.

    The first and third in [-pi, pi], the second in [-pi/2, pi/2]. Where that is +-pi/2 to 1e-14, the first and third
    turn about the same line and the third is 0. About ``-(a x b)``, the third is minus that.
    """
    w, v = r["1"], (-r["e23"], r["e13"], -r["e12"])
    x, y, z = dot(v, a), dot(v, b), dot(v, _cross(a, b))
    first, third, lower, upper = _euler_angles(w - y, z - x, w + y, -x - z)
    return -first, ga.atan2(2 * (w * y + x * z), lower * upper), third


def _euler_angles(a, b, c, d):
    """First and third angle, and the lengths whose angle is half the second, of the four numbers of both halves.

    ``a + b i`` and ``c + d i`` have the angles half the sum and half the difference of the two; in gimbal lock one of
    them is 0, and the other is taken for both.
    """
    upper, lower = ga.sqrt(a * a + b * b), ga.sqrt(c * c + d * d)
    level, upside_down = lower <= LOCKED, upper <= LOCKED
    sine = ga.select(level, 2 * a * b, ga.select(upside_down, 2 * c * d, b * c + a * d))
    cosine = ga.select(level, a * a - b * b, ga.select(upside_down, c * c - d * d, a * c - b * d))
    third = ga.atan2(b * c - a * d, a * c + b * d)
    locked = ga.maximum(ga.select(level, 1, 0), ga.select(upside_down, 1, 0))
    return ga.atan2(sine, cosine), ga.select(locked, 0, third), lower, upper


# Other algebras: vectors of space, four homogeneous coordinates, and the even algebra alone.


@kernel(line=LINE, returns=(VGA3.VECTOR, VGA3.BIVECTOR))
def line_to_vector_algebra(line):
    """A line in G(3,0): its direction `d`, a vector, and its moment ``x ^ d`` for all x on it, a bivector."""
    x, y, z = coordinates(direction_of_line(line))
    moment = {"e12": line["e03"], "e13": -line["e02"], "e23": line["e01"]}
    return ga.assemble(VGA3, {"e1": x, "e2": y, "e3": z}), ga.assemble(VGA3, moment)


@kernel(d=VGA3.VECTOR, m=VGA3.BIVECTOR, returns=LINE)
def line_from_vector_algebra(d, m):
    """The line of a direction and the bivector ``x ^ d`` of G(3,0)."""
    return _line((d["e1"], d["e2"], d["e3"]), (m["e23"], -m["e13"], m["e12"]))


@kernel(plane=PLANE, returns=(VGA3.BIVECTOR, VGA3.PSEUDOSCALAR))
def plane_to_vector_algebra(plane):
    """A plane in G(3,0): its directions as a bivector B, dual to the normal, and ``x ^ B`` for all x on it."""
    directions = {"e12": plane["e3"], "e13": -plane["e2"], "e23": plane["e1"]}
    return ga.assemble(VGA3, directions), ga.assemble(VGA3, {"e123": -plane["e0"]})


@kernel(b=VGA3.BIVECTOR, t=VGA3.PSEUDOSCALAR, returns=PLANE)
def plane_from_vector_algebra(b, t):
    """The plane of the directions `b` for whose points ``x ^ b = t`` in G(3,0)."""
    return _plane((b["e23"], -b["e13"], b["e12"]), -t["e123"])


@kernel(p=POINT, returns=HOMOGENEOUS)
def point_to_projective(p):
    """The homogeneous coordinates (x, y, z, 1) of a point."""
    return (*coordinates(p), 1)


@kernel(d=DIRECTION, returns=HOMOGENEOUS)
def direction_to_projective(d):
    """The homogeneous coordinates (x, y, z, 0) of a direction, a point at infinity."""
    return (*coordinates(d), 0)


@kernel(x=HOMOGENEOUS, returns=TRIVECTOR)
def trivector_from_projective(x):
    """The trivector, a point with a weight or a direction, of homogeneous coordinates (x, y, z, w)."""
    return _trivector(x[:3], x[3])


@kernel(line=LINE, returns=array(SCALAR, 6))
def line_to_projective(line):
    """Pluecker coordinates e12 e13 e23 e14 e24 e34 of a line: of points with w = 1 on it, ``a ^ b`` of four-vectors."""
    x, y, z = coordinates(direction_of_line(line))
    return line["e03"], -line["e02"], line["e01"], -x, -y, -z


@kernel(x=array(SCALAR, 6), returns=LINE)
def line_from_projective(x):
    """The line of Pluecker coordinates e12 e13 e23 e14 e24 e34, as `line_to_projective` gives them."""
    return _line((-x[3], -x[4], -x[5]), (x[2], -x[1], x[0]))


@kernel(plane=PLANE, returns=HOMOGENEOUS)
def plane_to_projective(plane):
    """The plane (a, b, c, d) of the points with ``a x + b y + c z + d w = 0``."""
    return tuple(plane[name] for name in ("e1", "e2", "e3", "e0"))


@kernel(x=HOMOGENEOUS, returns=PLANE)
def plane_from_projective(x):
    """The plane of (a, b, c, d): ``a x + b y + c z + d = 0``."""
    return _plane(x[:3], x[3])


@kernel(p=POINT, returns=TRANSLATOR)
def point_to_motor_algebra(p):
    """The point x as ``1 + I x`` in the even algebra, where ``I = e0123`` and x is ``x e23 - y e13 + z e12``."""
    return 1 + PSEUDOSCALAR * _spatial(coordinates(p))


@kernel(x=TRANSLATOR, returns=POINT)
def point_from_motor_algebra(x):
    """The point of ``1 + I x``."""
    return _trivector([-x[name] for name in ("e01", "e02", "e03")], 1)


@kernel(line=LINE, returns=(VECTOR, VECTOR))
def line_to_motor_algebra(line):
    """The vectors of the spatial bivectors n and m of a line ``n + I m`` in the even algebra: `m` is ``-(p x n)``.

    The line itself is the same element in both; the sign is that of ``I = e0123``.
    """
    return coordinates(direction_of_line(line)), tuple(-line[name] for name in ("e01", "e02", "e03"))


@kernel(n=VECTOR, m=VECTOR, returns=LINE)
def line_from_motor_algebra(n, m):
    """The line ``n + I m`` of two spatial bivectors, given as vectors, with ``I = e0123``."""
    return _spatial(n) + PSEUDOSCALAR * _spatial(m)


@kernel(plane=PLANE, returns=PLANE_OF_EVEN)
def plane_to_motor_algebra(plane):
    """The plane ``n . x = d`` as ``n - I d`` in the even algebra: n is a spatial bivector, ``I = e0123``."""
    return _spatial([plane[name] for name in ("e1", "e2", "e3")]) + plane["e0"] * PSEUDOSCALAR


@kernel(x=PLANE_OF_EVEN, returns=PLANE)
def plane_from_motor_algebra(x):
    """The plane of ``n - I d``."""
    return _plane((x["e23"], -x["e13"], x["e12"]), x["e0123"])


@kernel(m=MOTOR, x=TRANSLATOR, returns=TRANSLATOR)
def move_point_of_motor_algebra(m, x):
    """The point ``1 + I x`` moved within the even algebra: ``m x`` times the reverse of `m` with its dual part negated.

    Lines ``n + I m`` move as in `move_line`.
    """
    return m * x * ~_dual_conjugate(m)


@kernel(m=MOTOR, x=PLANE_OF_EVEN, returns=PLANE_OF_EVEN)
def move_plane_of_motor_algebra(m, x):
    """The plane ``n - I d`` moved within the even algebra: ``m x`` times the reverse of `m`, its dual part negated."""
    return m * x * ~_dual_conjugate(m)


def _spatial(v):
    return ga.assemble(PGA3, {"e12": v[2], "e13": -v[1], "e23": v[0]})


def _dual_conjugate(x):
    """The element with its part in e0 negated: ``R + I R'`` as ``R - I R'``."""
    return ga.assemble(PGA3, {name: -x[name] if "0" in name else x[name] for name in EVEN.blades})


# Velocities.


@kernel(a=LINE, b=LINE)
def line_commutator(a, b):
    """The commutator ``(a b - b a) / 2`` of two lines, twists or wrenches: the Lie bracket of the motor group."""
    return ga.commutator(a, b)


twist_on_point = TWISTS.twist_on_point
twist_on_line = TWISTS.twist_on_line


@kernel(v=LINE, plane=PLANE)
def twist_on_plane(v, plane):
    """The rate of change of the plane under the twist `v`, as in `twist_on_point`."""
    return ga.commutator(plane, v)


# Bodies that move. A force at a point is the line through it along the force; momenta are lines, too.


@kernel(v=LINE, f=LINE)
def power(v, f):
    """The power of a wrench `f` on a body that has the twist `v`: angular velocity times moment, plus v times force."""
    return v & f


@kernel(m=MOTOR, body=BODY, returns=BODY)
def inertia_of_moved_body(m, body):
    """The inertia about the origin of a body that was moved by the motor `m`.

    `body` is its mass, its centre x y z, and xx, xy, xz, yy, yz, zz of the tensor about the centre, before it moved.
    The result is the mass, mass times centre, and the tensor about the origin: these of several bodies add up.
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
    """The momentum of a body with the twist `v`; `inertia` is about the origin, as `inertia_of_moved_body` gives it."""
    return _momentum(inertia, v)


@kernel(inertia=BODY, v=LINE, a=LINE, returns=LINE)
def inertial_wrench(inertia, v, a):
    """The wrench that a body needs to have the twist `v` with the rate of change `a`: the rate of its momentum."""
    return _momentum(inertia, a) + ga.commutator(_momentum(inertia, v), v)


@kernel(v=LINE, axis=LINE, speed=SCALAR)
def twist_after_joint(v, axis, speed):
    """The twist of what a joint carries; `v` is that of what carries the joint.

    `axis` is the twist of the joint at unit speed, where it is now.
    """
    return v + speed * axis


@kernel(v=LINE, a=LINE, axis=LINE, speed=SCALAR, acceleration=SCALAR, returns=LINE)
def twist_rate_after_joint(v, a, axis, speed, acceleration):
    """The rate of change of `twist_after_joint`; `a` is the rate of `v`, and the axis is dragged along."""
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
