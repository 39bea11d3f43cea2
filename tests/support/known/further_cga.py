"""Further expressions of 2D and 3D conformal geometric algebra, null basis ``e0, einf`` with ``e0 . einf = -1``.

Spheres are vectors here: weight 1 where their layout fixes it, any weight in `VECTOR`.
"""

from gacompiler import inner_product, kernel, norm_squared, sandwich, scalar_product
from gacompiler.algebra.catalog import CGA2, CGA3

POINT, VECTOR, MOTOR, CIRCLE = CGA3.POINT, CGA3.VECTOR, CGA3.MOTOR, CGA3.CIRCLE
TRANSLATOR, ROTOR, DILATOR = CGA3.TRANSLATOR, CGA3.ROTOR, CGA3.DILATOR
UNIT_SPHERE = CGA3.layout("UNIT_SPHERE", "e1 e2 e3 einf", fixed={"e0": 1})  # normalised weight; any radius
INFINITY = CGA3.multivector({"einf": 1})


@kernel(a=CGA2.POINT, b=CGA2.POINT, c=CGA2.POINT)
def circle_3_points_2d(a, b, c):
    """The circle through three points of the plane."""
    return a ^ b ^ c


@kernel(m=CGA2.MOTOR, x=CGA2.VECTOR)
def motor_circle_2d(m, x):
    """A circle of the plane, as a vector, moved by a motor."""
    return sandwich(m, x)


@kernel(a=POINT, b=POINT)
def point_distance_squared(a, b):
    """The squared distance of two points."""
    return -2 * inner_product(a, b)


@kernel(s=UNIT_SPHERE, x=POINT)
def power_of_point(s, x):
    """The power of a point with respect to a sphere."""
    return -2 * inner_product(s, x)


@kernel(m=MOTOR, s=UNIT_SPHERE, x=POINT)
def power_of_moved_point(m, s, x):
    """The power of a point with respect to a sphere that was moved with it."""
    return -2 * inner_product(sandwich(m, s), sandwich(m, x))


@kernel(s=UNIT_SPHERE, x=POINT)
def invert_point_in_sphere(s, x):
    """Inversion of a point in a sphere, with its weight."""
    return -sandwich(s, x)


@kernel(a=UNIT_SPHERE, b=UNIT_SPHERE)
def meet_of_spheres(a, b):
    """The circle that two spheres share, dual."""
    return a ^ b


@kernel(a=VECTOR, b=VECTOR)
def tangency_of_spheres(a, b):
    """Zero where two spheres touch: the square of their meet."""
    return norm_squared(a ^ b)


@kernel(s=VECTOR)
def radius_squared_of_sphere(s):
    """The squared radius of a sphere of any weight."""
    weight = inner_product(s, INFINITY)
    return inner_product(s, s) / (weight * weight)


@kernel(s=VECTOR)
def centre_of_sphere(s):
    """The centre of a sphere, with its weight: infinity reflected in it."""
    return sandwich(s, INFINITY)


@kernel(a=POINT, b=POINT)
def point_pair_distance(a, b):
    """The square of a point pair: the fourth power of the distance, up to a factor."""
    return norm_squared(a ^ b)


@kernel(m=MOTOR, x=VECTOR)
def motor_sphere(m, x):
    """A sphere, as a vector, moved by a motor."""
    return sandwich(m, x)


@kernel(t=TRANSLATOR, x=VECTOR)
def translator_sphere(t, x):
    """A sphere, as a vector, translated."""
    return sandwich(t, x)


@kernel(m=MOTOR, x=POINT)
def motor_conformal_point(m, x):
    """A point moved by a motor."""
    return sandwich(m, x)


@kernel(m=MOTOR, c=CIRCLE)
def motor_circle(m, c):
    """A circle moved by a motor."""
    return sandwich(m, c)


@kernel(d=DILATOR, m=MOTOR, x=POINT)
def dilator_motor_point(d, m, x):
    """A point moved by a motor, then scaled."""
    return sandwich(d * m, x)


@kernel(t=TRANSLATOR, r=ROTOR)
def rotor_about_point(t, r):
    """A rotation about a point other than the origin."""
    return t * r * ~t


@kernel(m=MOTOR, a=POINT, b=POINT, c=POINT)
def circle_3_moved_points(m, a, b, c):
    """The circle through three points that were moved."""
    return sandwich(m, a) ^ sandwich(m, b) ^ sandwich(m, c)


@kernel(m=MOTOR, a=VECTOR, b=VECTOR)
def inner_product_of_moved_spheres(m, a, b):
    """The inversive product of two spheres that were moved together."""
    return scalar_product(sandwich(m, a), sandwich(m, b))
