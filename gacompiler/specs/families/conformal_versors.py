"""Versors of conformal algebras and what they do to points, flats and rounds, the same in the plane and in space."""

from functools import reduce
from itertools import combinations
from operator import add

import gacompiler as ga
from gacompiler import SCALAR, Family, array
from gacompiler.specs.families.conformal_space import dot, inverse_square_root


def versors(space, *, sphere, coefficients):
    """Translators, dilators, transversors, motors and versors of all conformal maps.

    `sphere` names the rounds of highest dimension, and `coefficients` is the number, in words, that a versor has.
    """
    family = Family("versors", sphere=sphere, coefficients=coefficients)
    algebra, E0, EINF = space.algebra, space.e0, space.einf
    POINT, ROTOR, TRANSLATOR, MOTOR = algebra.POINT, algebra.ROTOR, algebra.TRANSLATOR, algebra.MOTOR
    DILATOR, TRANSVERSOR, EVEN, UNIT_EVEN = algebra.DILATOR, algebra.TRANSVERSOR, algebra.even, algebra.UNIT_EVEN
    n = len(space.axes)
    COORDINATES = array(SCALAR, n)

    @family.kernel(t=COORDINATES, returns=TRANSLATOR)
    def translator_from_vector(t):
        """The translation by a vector: ``1 - t einf/2``."""
        return space.translator(space.vector(t))

    @family.kernel(a=POINT, b=POINT, returns=TRANSLATOR)
    def translator_between_points(a, b):
        """The translation that takes the point `a` to `b`."""
        return space.translator(space.coordinates(b) - space.coordinates(a))

    @family.kernel(scale=SCALAR, returns=DILATOR)
    def dilator_from_scale(scale):
        """The dilation about the origin by a positive factor: ``exp(log(scale)/2 e0inf)``."""
        return space.dilator(scale)

    @family.kernel(d=DILATOR)
    def dilator_to_scale(d):
        """The factor of a dilator: ``exp`` of twice the coefficient of its logarithm."""
        return (d["1"] + d["e0inf"]) ** 2

    @family.kernel(b=COORDINATES, returns=TRANSVERSOR)
    def transversor_from_vector(b):
        """The transversion ``1 + b e0``: inversion in the unit {sphere}, translation by ``-b``, inversion again.

        It takes x to ``(x - x**2 b) / (1 - 2 b . x + b**2 x**2)``.
        """
        return 1 + space.vector(b) * E0

    @family.kernel(r=ROTOR, t=COORDINATES, returns=MOTOR)
    def motor_from_rotor_translation(r, t):
        """The motor that turns by the rotor `r` and then translates by the vector `t`."""
        return space.translator(space.vector(t)) * r

    @family.kernel(m=MOTOR, returns=(ROTOR, COORDINATES))
    def motor_to_rotor_translation(m):
        """The rotor and the vector of the translation after it."""
        planes = [(m[f"e{i + 1}{k + 1}"], space.axes[i], space.axes[k]) for i, k in combinations(range(n), 2)]
        rotor = reduce(add, (number * a * b for number, a, b in planes), m["1"])
        return rotor, space.components(m * E0 * ~m)

    @family.kernel(m=MOTOR, returns=array(SCALAR, n + 1, n + 1))
    def motor_to_matrix(m):
        """The homogeneous matrix of a unit motor, which acts on columns with 1 as last coordinate."""
        columns = [m * axis * ~m for axis in (*space.axes, E0)]
        return (*(tuple(column[name] for column in columns) for name in space.names), (*(0,) * n, 1))

    @family.kernel(b=algebra.POINT_PAIR, returns=UNIT_EVEN)
    def versor_exponential(b):
        """``exp(b)`` of any bivector: motions, dilations, transversions and all other conformal maps near the identity.

        Every sum of a rotation, translation or dilation and a commuting rotation, isoclinic ones among them. Errors are a
        few units of the last place of the largest coefficient of the result or, far from the origin, of ``b b``.
        """  # noqa: E501
        return ga.exp(b)

    @family.kernel(v=UNIT_EVEN)
    def versor_logarithm(v):
        """The bivector of least angles whose exponential is the unit versor `v` or `-v`, the same conformal map.

        Every one has a logarithm. Where the scalar part is 0, at half turns, the two signs are equally near and the result
        jumps.
        """  # noqa: E501
        return ga.log(v)

    @family.kernel(v=UNIT_EVEN, returns=UNIT_EVEN)
    def versor_square_root(v):
        """The unit versor half way to `v` or `-v`: ``exp(log(v) / 2)`` without angles, where that is defined."""
        return ga.sqrt(v)

    @family.kernel(x=EVEN, returns=EVEN)
    def normalize_versor(x):
        """The unit versor nearest to an even element: ``(x ~x)**(-1/2) x``. Sums of versors become versors."""
        return inverse_square_root(x * ~x) * x

    @family.kernel(m=MOTOR, returns=UNIT_EVEN)
    def versor_from_motor(m):
        """A motor with all {coefficients} coefficients of a versor, for products with versors of other kinds."""
        return m

    @family.kernel(d=DILATOR, returns=UNIT_EVEN)
    def versor_from_dilator(d):
        """A dilator with all {coefficients} coefficients of a versor."""
        return d

    @family.kernel(k=TRANSVERSOR, returns=UNIT_EVEN)
    def versor_from_transversor(k):
        """A transversor with all {coefficients} coefficients of a versor."""
        return k

    @family.kernel(x=UNIT_EVEN, returns=(SCALAR, ROTOR, COORDINATES, COORDINATES))
    def versor_decomposition(x):
        """A conformal map as a transversion, then a dilation, a rotation and a translation: scale, rotor, and the vectors
        of the translation and of the transversion.

        ``translator * rotor * dilator * transversor`` is `x` again, its sign in the rotor. A map that takes the origin to
        infinity, or nearly, has no such form: division by 0.
        """  # noqa: E501
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
    """What versors do to points, flats and rounds, and inversions.

    `sphere` and `plane` name the rounds and the flats of highest dimension.
    """
    family = Family("conformal maps", sphere=sphere, plane=plane)
    algebra = space.algebra
    POINT, VECTOR, POINT_PAIR, CIRCLE = algebra.POINT, algebra.VECTOR, algebra.POINT_PAIR, algebra.CIRCLE
    MOTOR, UNIT_EVEN = algebra.MOTOR, algebra.UNIT_EVEN

    @family.kernel(r=algebra.ROTOR, p=POINT, returns=POINT)
    def rotate_point(r, p):
        """The point `p` turned by the unit rotor `r`: ``r p ~r``."""
        return r * p * ~r

    @family.kernel(t=algebra.TRANSLATOR, p=POINT, returns=POINT)
    def translate_point(t, p):
        """The point `p` moved by the translator `t`: ``t p ~t``."""
        return t * p * ~t

    @family.kernel(d=algebra.DILATOR, p=POINT, returns=POINT)
    def dilate_point(d, p):
        """The point `p` scaled about the origin by the dilator `d`: ``d p ~d``, normalised."""
        return space.normalized(d * p * ~d)

    @family.kernel(m=MOTOR, x=VECTOR)
    def move_vector(m, x):
        """A vector, such as a dual {sphere} or dual {plane}, moved by the unit motor `m`: ``m x ~m``."""
        return m * x * ~m

    @family.kernel(m=MOTOR, x=POINT_PAIR)
    def move_point_pair(m, x):
        """A point pair moved by the unit motor `m`: ``m x ~m``."""
        return m * x * ~m

    @family.kernel(m=MOTOR, x=algebra.LINE)
    def move_line(m, x):
        """A line moved by the unit motor `m`: ``m x ~m``."""
        return m * x * ~m

    @family.kernel(m=MOTOR, x=CIRCLE)
    def move_circle(m, x):
        """A circle moved by the unit motor `m`: ``m x ~m``."""
        return m * x * ~m

    @family.kernel(v=UNIT_EVEN, p=POINT, returns=POINT)
    def transform_point(v, p):
        """A point transformed by any unit even versor, a conformal map. What goes to infinity: division by 0."""
        return space.normalized(v * p * ~v)

    @family.kernel(v=UNIT_EVEN, x=VECTOR)
    def transform_vector(v, x):
        """A vector transformed by any unit even versor, a conformal map: ``v x ~v``."""
        return v * x * ~v

    @family.kernel(v=UNIT_EVEN, x=POINT_PAIR)
    def transform_point_pair(v, x):
        """A point pair transformed by any unit even versor: ``v x ~v``."""
        return v * x * ~v

    @family.kernel(v=UNIT_EVEN, x=CIRCLE)
    def transform_circle(v, x):
        """A circle transformed by any unit even versor: ``v x ~v``."""
        return v * x * ~v

    @family.kernel(p=POINT, s=VECTOR, returns=POINT)
    def invert_point(p, s):
        """The inversion of a point in a dual {sphere}: on the same ray from the centre, distances multiply to r**2.

        The centre goes to infinity: division by 0.
        """
        return space.normalized(-(s * p * s))

    @family.kernel(x=VECTOR, s=VECTOR)
    def invert_vector(x, s):
        """A vector, such as a dual {sphere} or dual {plane}, inverted in a dual {sphere} or mirrored in a dual {plane}."""  # noqa: E501
        return (2 * dot(x, s) / dot(s, s)) * s - x

    @family.kernel(x=POINT_PAIR, s=VECTOR)
    def invert_point_pair(x, s):
        """A point pair inverted in a dual {sphere} or mirrored in a dual {plane}: ``s x s**-1``."""
        return s * x * s / dot(s, s)

    @family.kernel(x=CIRCLE, s=VECTOR)
    def invert_circle(x, s):
        """A circle inverted in a dual {sphere} or mirrored in a dual {plane}: ``-s x s**-1``; a line if through its centre."""  # noqa: E501
        return -(s * x * s) / dot(s, s)

    return family
