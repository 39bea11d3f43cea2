"""Versors of conformal algebras and their action on points, flats and rounds, the same in the plane and in space."""

from functools import reduce
from itertools import combinations
from operator import add

import gacompiler as ga
from gacompiler import SCALAR, Family, array
from gacompiler.specs.families.conformal_space import dot, inverse_square_root


def versors(space, *, sphere, coefficients):
    """Declare translators, dilators, transversors, motors and versors of all conformal maps.

    `sphere` names the rounds of highest dimension, and `coefficients` is the number, in words, of coefficients of a
    versor.
    """
    family = Family("versors", sphere=sphere, coefficients=coefficients)
    algebra, E0, EINF = space.algebra, space.e0, space.einf
    POINT, ROTOR, TRANSLATOR, MOTOR = algebra.POINT, algebra.ROTOR, algebra.TRANSLATOR, algebra.MOTOR
    DILATOR, TRANSVERSOR, EVEN, UNIT_EVEN = algebra.DILATOR, algebra.TRANSVERSOR, algebra.even, algebra.UNIT_EVEN
    n = len(space.axes)
    COORDINATES = array(SCALAR, n)

    @family.kernel(t=COORDINATES, returns=TRANSLATOR)
    def translator_from_vector(t):
        """Construct the translation by a vector: ``1 - t einf/2``."""
        return space.translator(space.vector(t))

    @family.kernel(a=POINT, b=POINT, returns=TRANSLATOR)
    def translator_between_points(a, b):
        """Compute the translation that takes the point `a` to `b`."""
        return space.translator(space.coordinates(b) - space.coordinates(a))

    @family.kernel(scale=SCALAR, returns=DILATOR)
    def dilator_from_scale(scale):
        """Construct the dilation about the origin by a positive factor: ``exp(log(scale)/2 e0inf)``."""
        return space.dilator(scale)

    @family.kernel(d=DILATOR)
    def dilator_to_scale(d):
        """Extract the factor of a dilator: ``exp`` of twice the coefficient of its logarithm."""
        return (d["1"] + d["e0inf"]) ** 2

    @family.kernel(b=COORDINATES, returns=TRANSVERSOR)
    def transversor_from_vector(b):
        """Construct the transversion ``1 + b e0``: unit-{sphere} inversion, translation by ``-b``, inversion again.

        It takes x to ``(x - x**2 b) / (1 - 2 b . x + b**2 x**2)``.
        """
        return 1 + space.vector(b) * E0

    @family.kernel(r=ROTOR, t=COORDINATES, returns=MOTOR)
    def motor_from_rotor_translation(r, t):
        """Construct the motor that rotates by the rotor `r` and then translates by the vector `t`."""
        return space.translator(space.vector(t)) * r

    @family.kernel(m=MOTOR, returns=(ROTOR, COORDINATES))
    def motor_to_rotor_translation(m):
        """Extract the rotor of a motor and the vector of the translation that follows it."""
        planes = [(m[f"e{i + 1}{k + 1}"], space.axes[i], space.axes[k]) for i, k in combinations(range(n), 2)]
        rotor = reduce(add, (number * a * b for number, a, b in planes), m["1"])
        return rotor, space.components(m * E0 * ~m)

    @family.kernel(m=MOTOR, returns=array(SCALAR, n + 1, n + 1))
    def motor_to_matrix(m):
        """Compute the homogeneous matrix of a unit motor, which acts on columns with 1 as last coordinate."""
        columns = [m * axis * ~m for axis in (*space.axes, E0)]
        return (*(tuple(column[name] for column in columns) for name in space.names), (*(0,) * n, 1))

    @family.kernel(b=algebra.POINT_PAIR, returns=UNIT_EVEN)
    def versor_exponential(b):
        """Compute ``exp(b)`` of a bivector: motions, dilations, transversions and all conformal maps near 1.

        All combinations of a rotation, translation or dilation with a commuting rotation are supported, including
        isoclinic ones. Errors are a few units in the last place of the largest coefficient of the result or, far from
        the origin, of ``b b``.
        """
        return ga.exp(b)

    @family.kernel(v=UNIT_EVEN)
    def versor_logarithm(v):
        """Compute the bivector of least angles with exponential `v` or `-v`, the same conformal map.

        Every unit versor has such a logarithm. At half turns, where the scalar part is 0, the two signs are equally
        near and the result is discontinuous.
        """
        return ga.log(v)

    @family.kernel(v=UNIT_EVEN, returns=UNIT_EVEN)
    def versor_square_root(v):
        """Compute the unit versor halfway to `v` or `-v`, ``exp(log(v) / 2)``, without angles, where it is defined."""
        return ga.sqrt(v)

    @family.kernel(x=EVEN, returns=EVEN)
    def normalize_versor(x):
        """Compute the unit versor nearest to an even element, such as a sum of versors: ``(x ~x)**(-1/2) x``."""
        return inverse_square_root(x * ~x) * x

    @family.kernel(m=MOTOR, returns=UNIT_EVEN)
    def versor_from_motor(m):
        """Convert a motor to a versor with all {coefficients} coefficients, for products with other versors."""
        return m

    @family.kernel(d=DILATOR, returns=UNIT_EVEN)
    def versor_from_dilator(d):
        """Convert a dilator to a versor with all {coefficients} coefficients."""
        return d

    @family.kernel(k=TRANSVERSOR, returns=UNIT_EVEN)
    def versor_from_transversor(k):
        """Convert a transversor to a versor with all {coefficients} coefficients."""
        return k

    @family.kernel(x=UNIT_EVEN, returns=(SCALAR, ROTOR, COORDINATES, COORDINATES))
    def versor_decomposition(x):
        """Decompose a conformal map into a transversion, a dilation, a rotation and a translation, in this order.

        Returns the scale, the rotor, and the vectors of the translation and of the transversion. The product
        ``translator * rotor * dilator * transversor`` is `x`; the rotor contains its sign. A map that takes the origin
        to infinity, or nearly so, has no such decomposition: division by 0.
        """
        moved, back = (x * E0 * ~x).grade(1), (~x * EINF * x).grade(1)
        weight = space.weight(moved)
        t, b = space.coordinates(moved) / weight, space.coordinates(back) / (2 * weight)
        scale = 1 / weight
        rest = (1 + t * EINF / 2) * x
        factor = 2 * ga.sqrt(scale) / (1 + scale)
        rotor = {name: factor * rest[name] for name in ROTOR.blades}
        return scale, ga.assemble(algebra, rotor), space.components(t), space.components(b)

    return family


def conformal_maps(space, *, sphere, plane):
    """Declare the action of versors on points, flats and rounds, and inversions.

    `sphere` and `plane` name the rounds and the flats of highest dimension.
    """
    family = Family("conformal maps", sphere=sphere, plane=plane)
    algebra = space.algebra
    POINT, VECTOR, POINT_PAIR, CIRCLE = algebra.POINT, algebra.VECTOR, algebra.POINT_PAIR, algebra.CIRCLE
    MOTOR, UNIT_EVEN = algebra.MOTOR, algebra.UNIT_EVEN

    @family.kernel(r=algebra.ROTOR, p=POINT, returns=POINT)
    def rotate_point(r, p):
        """Rotate the point `p` by the unit rotor `r`: ``r p ~r``."""
        return r * p * ~r

    @family.kernel(t=algebra.TRANSLATOR, p=POINT, returns=POINT)
    def translate_point(t, p):
        """Translate the point `p` by the translator `t`: ``t p ~t``."""
        return t * p * ~t

    @family.kernel(d=algebra.DILATOR, p=POINT, returns=POINT)
    def dilate_point(d, p):
        """Scale the point `p` about the origin by the dilator `d`: ``d p ~d``, normalised."""
        return space.normalized(d * p * ~d)

    @family.kernel(m=MOTOR, x=VECTOR)
    def move_vector(m, x):
        """Move a vector, such as a dual {sphere} or dual {plane}, by the unit motor `m`: ``m x ~m``."""
        return m * x * ~m

    @family.kernel(m=MOTOR, x=POINT_PAIR)
    def move_point_pair(m, x):
        """Move a point pair by the unit motor `m`: ``m x ~m``."""
        return m * x * ~m

    @family.kernel(m=MOTOR, x=algebra.LINE)
    def move_line(m, x):
        """Move a line by the unit motor `m`: ``m x ~m``."""
        return m * x * ~m

    @family.kernel(m=MOTOR, x=CIRCLE)
    def move_circle(m, x):
        """Move a circle by the unit motor `m`: ``m x ~m``."""
        return m * x * ~m

    @family.kernel(v=UNIT_EVEN, p=POINT, returns=POINT)
    def transform_point(v, p):
        """Transform a point by a unit even versor, a conformal map; division by 0 if its image is at infinity."""
        return space.normalized(v * p * ~v)

    @family.kernel(v=UNIT_EVEN, x=VECTOR)
    def transform_vector(v, x):
        """Transform a vector by a unit even versor, a conformal map: ``v x ~v``."""
        return v * x * ~v

    @family.kernel(v=UNIT_EVEN, x=POINT_PAIR)
    def transform_point_pair(v, x):
        """Transform a point pair by a unit even versor: ``v x ~v``."""
        return v * x * ~v

    @family.kernel(v=UNIT_EVEN, x=CIRCLE)
    def transform_circle(v, x):
        """Transform a circle by a unit even versor: ``v x ~v``."""
        return v * x * ~v

    @family.kernel(p=POINT, s=VECTOR, returns=POINT)
    def invert_point(p, s):
        """Invert a point in a dual {sphere}: on the same ray from the centre, the distances multiply to r**2.

        The image of the centre is at infinity: division by 0.
        """
        return space.normalized(-(s * p * s))

    @family.kernel(x=VECTOR, s=VECTOR)
    def invert_vector(x, s):
        """Invert a vector, such as a dual {sphere} or {plane}, in a dual {sphere}, or reflect it in a dual {plane}."""
        return (2 * dot(x, s) / dot(s, s)) * s - x

    @family.kernel(x=POINT_PAIR, s=VECTOR)
    def invert_point_pair(x, s):
        """Invert a point pair in a dual {sphere} or reflect it in a dual {plane}: ``s x s**-1``."""
        return s * x * s / dot(s, s)

    @family.kernel(x=CIRCLE, s=VECTOR)
    def invert_circle(x, s):
        """Invert a circle in a dual {sphere} or reflect it in a dual {plane}: ``-s x s**-1``.

        The inverse of a circle through the centre is a line.
        """
        return -(s * x * s) / dot(s, s)

    return family
