"""Compositions of motions with rounds, flats and invariants in conformal geometric algebra."""

from gacompiler import commutator, inner_product, kernel, norm_squared, sandwich, scalar_product
from gacompiler.algebra.catalog import CGA2, CGA3

POINT, VECTOR, MOTOR, CIRCLE, LINE = CGA3.POINT, CGA3.VECTOR, CGA3.MOTOR, CGA3.CIRCLE, CGA3.LINE
TRANSLATOR, ROTOR, DILATOR, DUAL_PLANE = CGA3.TRANSLATOR, CGA3.ROTOR, CGA3.DILATOR, CGA3.DUAL_PLANE
POINT_PAIR, DUAL_LINE, TRANSVERSOR = CGA3.POINT_PAIR, CGA3.DUAL_LINE, CGA3.TRANSVERSOR
UNIT_SPHERE = CGA3.layout("UNIT_SPHERE", "e1 e2 e3 einf", fixed={"e0": 1})
INFINITY, INFINITY2 = CGA3.multivector({"einf": 1}), CGA2.multivector({"einf": 1})


@kernel(m=MOTOR, a=POINT, b=POINT)
def distance_squared_of_moved_conformal_points(m, a, b):
    """The squared distance of two points that were moved together."""
    return -2 * inner_product(sandwich(m, a), sandwich(m, b))


@kernel(m=MOTOR, n=MOTOR, a=POINT, b=POINT)
def distance_squared_of_points_of_two_bodies(m, n, a, b):
    """The squared distance of two points, each moved with its own body."""
    return -2 * inner_product(sandwich(m, a), sandwich(n, b))


@kernel(m=MOTOR, x=POINT, s=UNIT_SPHERE)
def moved_point_in_sphere(m, x, s):
    """The power of a moved point with respect to a fixed sphere."""
    return -2 * inner_product(sandwich(m, x), s)


@kernel(m=MOTOR, x=POINT, n=DUAL_PLANE)
def moved_conformal_point_to_plane(m, x, n):
    """The distance of a moved point from a fixed plane."""
    return inner_product(sandwich(m, x), n)


@kernel(m=MOTOR, x=POINT, n=DUAL_PLANE)
def moved_conformal_point_to_moved_plane(m, x, n):
    """The distance of a point from a plane after both were moved."""
    return inner_product(sandwich(m, x), sandwich(m, n))


@kernel(a=POINT, b=POINT)
def line_2_conformal_points(a, b):
    """The line through two points."""
    return a ^ b ^ INFINITY


@kernel(a=POINT, b=POINT, c=POINT)
def plane_3_conformal_points(a, b, c):
    """The plane through three points."""
    return a ^ b ^ c ^ INFINITY


@kernel(m=MOTOR, a=POINT, b=POINT)
def line_2_moved_points(m, a, b):
    """The line through two points that were moved."""
    return sandwich(m, a) ^ sandwich(m, b) ^ INFINITY


@kernel(m=MOTOR, a=POINT, b=POINT, c=POINT)
def plane_3_moved_points(m, a, b, c):
    """The plane through three points that were moved."""
    return sandwich(m, a) ^ sandwich(m, b) ^ sandwich(m, c) ^ INFINITY


@kernel(m=MOTOR, a=POINT, b=POINT)
def pair_of_moved_points(m, a, b):
    """The point pair of two points that were moved."""
    return sandwich(m, a) ^ sandwich(m, b)


@kernel(a=POINT, b=POINT, c=POINT)
def squared_radius_of_circle(a, b, c):
    """The square of the circle through three points."""
    return norm_squared(a ^ b ^ c)


@kernel(a=POINT, b=POINT, c=POINT)
def squared_area_of_triangle(a, b, c):
    """The squared weight of the plane through three points: four times the squared area of the triangle."""
    return norm_squared(a ^ b ^ c ^ INFINITY)


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def squared_sphere_4_points(a, b, c, d):
    """The square of the sphere through four points: the determinant of Cayley and Menger, up to a factor."""
    return norm_squared(a ^ b ^ c ^ d)


@kernel(a=POINT, b=POINT, c=POINT, x=POINT)
def point_on_circle(a, b, c, x):
    """Zero if a point is on the circle through three others."""
    return a ^ b ^ c ^ x


@kernel(a=POINT, b=POINT, c=POINT, d=POINT, x=POINT)
def point_on_sphere(a, b, c, d, x):
    """Zero if a point is on the sphere through four others."""
    return a ^ b ^ c ^ d ^ x


@kernel(a=UNIT_SPHERE, b=UNIT_SPHERE, c=UNIT_SPHERE)
def meet_of_three_spheres(a, b, c):
    """The point pair that three spheres share, dual."""
    return a ^ b ^ c


@kernel(a=UNIT_SPHERE, b=UNIT_SPHERE, c=UNIT_SPHERE)
def discriminant_of_three_spheres(a, b, c):
    """Its sign decides whether three spheres meet: the square of their meet."""
    return norm_squared(a ^ b ^ c)


@kernel(s=UNIT_SPHERE, n=DUAL_PLANE)
def discriminant_of_sphere_and_plane(s, n):
    """Its sign decides whether a sphere meets a plane."""
    return norm_squared(s ^ n)


@kernel(m=MOTOR, a=UNIT_SPHERE, b=UNIT_SPHERE)
def meet_of_moved_spheres(m, a, b):
    """The circle of two spheres after they were moved, dual."""
    return sandwich(m, a) ^ sandwich(m, b)


@kernel(m=MOTOR, a=VECTOR, b=VECTOR)
def tangency_of_moved_spheres(m, a, b):
    """The square of the meet of two spheres after they were moved."""
    return norm_squared(sandwich(m, a) ^ sandwich(m, b))


@kernel(m=MOTOR, a=VECTOR, b=VECTOR)
def inner_product_of_moved_sphere(m, a, b):
    """The inversive product of a moved sphere and a fixed one."""
    return scalar_product(sandwich(m, a), b)


@kernel(m=MOTOR, n=MOTOR, x=POINT)
def two_motors_conformal_point(m, n, x):
    """A point at the end of two links."""
    return sandwich(m * n, x)


@kernel(m=MOTOR, n=MOTOR, x=VECTOR)
def two_motors_sphere(m, n, x):
    """A sphere moved by two motors."""
    return sandwich(m, sandwich(n, x))


@kernel(m=MOTOR, n=MOTOR)
def motor_times_motor(m, n):
    """The pose after two links."""
    return m * n


@kernel(m=MOTOR, line=DUAL_LINE)
def motor_dual_line(m, line):
    """A line, as a bivector, moved by a motor."""
    return sandwich(m, line)


@kernel(m=MOTOR, a=DUAL_LINE, b=DUAL_LINE)
def cosine_between_moved_dual_lines(m, a, b):
    """The inner product of two lines that were moved together."""
    return scalar_product(sandwich(m, a), sandwich(m, b))


@kernel(m=MOTOR, x=POINT)
def displacement_of_conformal_point(m, x):
    """The difference of a moved point and the point."""
    return sandwich(m, x) - x


@kernel(m=MOTOR, x=POINT)
def squared_displacement_of_conformal_point(m, x):
    """The squared length of the displacement of a point."""
    return -2 * inner_product(sandwich(m, x), x)


@kernel(t=TRANSLATOR, r=ROTOR, x=POINT)
def rotor_then_translator_point(t, r, x):
    """A point turned and then translated."""
    return sandwich(t * r, x)


@kernel(t=TRANSLATOR, r=ROTOR, x=POINT)
def conformal_point_turned_about_another(t, r, x):
    """A point turned about an axis through another point than the origin."""
    return sandwich(t * r * ~t, x)


@kernel(t=TRANSLATOR, x=POINT)
def translator_conformal_point(t, x):
    """A point translated."""
    return sandwich(t, x)


@kernel(r=ROTOR, x=VECTOR)
def rotor_sphere(r, x):
    """A sphere turned about the origin."""
    return sandwich(r, x)


@kernel(d=DILATOR, x=VECTOR)
def dilator_sphere(d, x):
    """A sphere scaled."""
    return sandwich(d, x)


@kernel(k=TRANSVERSOR, x=VECTOR)
def transversor_sphere(k, x):
    """A sphere after a special conformal map."""
    return sandwich(k, x)


@kernel(d=DILATOR, t=TRANSLATOR, x=POINT)
def scaled_then_translated_point(d, t, x):
    """A point scaled and then translated."""
    return sandwich(t * d, x)


@kernel(d=DILATOR, a=POINT, b=POINT)
def distance_squared_of_scaled_points(d, a, b):
    """The inner product of two points that were scaled together."""
    return -2 * inner_product(sandwich(d, a), sandwich(d, b))


@kernel(s=UNIT_SPHERE, a=POINT, b=POINT)
def inner_product_of_inverted_points(s, a, b):
    """The inner product of two points inverted in one sphere."""
    return inner_product(sandwich(s, a), sandwich(s, b))


@kernel(a=POINT, b=POINT, x=POINT)
def commutator_of_pair_and_point(a, b, x):
    """The tangent at a point of the loxodrome that a point pair generates."""
    return commutator(a ^ b, x)


@kernel(a=CGA2.POINT, b=CGA2.POINT)
def distance_squared_2d(a, b):
    """The squared distance of two points of the plane."""
    return -2 * inner_product(a, b)


@kernel(m=CGA2.MOTOR, a=CGA2.POINT, b=CGA2.POINT)
def distance_squared_of_moved_conformal_points_2d(m, a, b):
    """The squared distance of two points of the plane that were moved together."""
    return -2 * inner_product(sandwich(m, a), sandwich(m, b))


@kernel(a=CGA2.POINT, b=CGA2.POINT, c=CGA2.POINT)
def squared_circle_2d(a, b, c):
    """The square of the circle through three points of the plane."""
    return norm_squared(a ^ b ^ c)


@kernel(a=CGA2.POINT, b=CGA2.POINT, c=CGA2.POINT, x=CGA2.POINT)
def point_in_circle_2d(a, b, c, x):
    """Its sign decides whether a point is inside the circle through three others, as in Delaunay triangulations."""
    return a ^ b ^ c ^ x


@kernel(m=CGA2.MOTOR, a=CGA2.POINT, b=CGA2.POINT, c=CGA2.POINT)
def circle_3_moved_points_2d(m, a, b, c):
    """The circle through three points of the plane that were moved."""
    return sandwich(m, a) ^ sandwich(m, b) ^ sandwich(m, c)


@kernel(m=CGA2.MOTOR, n=CGA2.MOTOR, x=CGA2.POINT)
def two_motors_conformal_point_2d(m, n, x):
    """A point of the plane at the end of two links."""
    return sandwich(m * n, x)


@kernel(a=CGA2.POINT, b=CGA2.POINT)
def line_2_conformal_points_2d(a, b):
    """The line through two points of the plane."""
    return a ^ b ^ INFINITY2


@kernel(m=CGA2.MOTOR, a=CGA2.VECTOR, b=CGA2.VECTOR)
def inner_product_of_moved_circles_2d(m, a, b):
    """The inversive product of two circles that were moved together."""
    return scalar_product(sandwich(m, a), sandwich(m, b))
