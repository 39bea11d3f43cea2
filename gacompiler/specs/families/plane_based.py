"""Points, lines and motions of plane-based algebras G(n,0,1), the same in the plane and in space."""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, Family, array
from gacompiler.specs.families.products import products as any_elements

HALF = Fraction(1, 2)


def dot(a, b):
    """The inner product of two tuples of coordinates."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def coordinates(x):
    """The coordinates of a point with weight 1 or of a direction."""
    return tuple(x[name] for name in x.algebra.DIRECTION.blades)


def direction_of_line(line):
    """The direction of a line of space as a point at infinity: where the line meets the plane at infinity."""
    return line ^ -line.algebra.multivector({"e0": 1})


def foot_on_unit_line(p, line):
    """The point of a normalised line of space that is nearest to the point `p`."""
    return (ga.right_contraction(p, line) * ~line).grade(3)


def gap_of_parallels(a, b):
    """How far apart two normalised lines of the plane, or planes of space, are that are parallel."""
    return ga.absolute(a["e0"] - ga.select(ga.scalar_product(a, b) < 0, -1, 1) * b["e0"])


def products(algebra, hyperplanes):
    """The products of a plane-based algebra, whose vectors are `hyperplanes`."""
    return any_elements(
        algebra,
        algebra.EVEN,
        outer_product=f": the meet of {hyperplanes}",
        regressive_product=": the join of points",
        even_product=", which need not be motors",
        dual=", which needs no metric",
        norm=", which does not see ``e0``; 0 for what lies at infinity",
    )


def points_and_lines(algebra):
    """Joins and distances of points."""
    family = Family("points and lines")
    POINT, LINE = algebra.POINT, algebra.LINE

    @family.kernel(line=LINE)
    def normalize_line(line):
        """The line divided by its norm, which must not be 0."""
        return ga.normalize(line)

    @family.kernel(a=POINT, b=POINT)
    def join_points(a, b):
        """The line from `a` to `b`; its norm is their distance. It is 0 where the points are the same."""
        return a & b

    @family.kernel(p=POINT, d=algebra.DIRECTION)
    def join_point_direction(p, d):
        """The line through the point `p` along the direction `d`; its norm is the length of `d`."""
        return p & d

    @family.kernel(a=POINT, b=POINT)
    def distance_squared_points(a, b):
        """The squared distance of two points."""
        return ga.norm_squared(a & b)

    @family.kernel(a=POINT, b=POINT)
    def distance_points(a, b):
        """The distance of two points."""
        return ga.norm(a & b)

    @family.kernel(a=POINT, b=POINT, returns=POINT)
    def midpoint(a, b):
        """The point half way between two."""
        return (a + b) / 2

    return family


def motions(algebra, translator):
    """What motors do, and motors between things; `translator` gives the translation by a tuple of coordinates."""
    family = Family("motions")
    POINT, MOTOR, TRANSLATOR = algebra.POINT, algebra.MOTOR, algebra.TRANSLATOR
    VECTOR = array(SCALAR, algebra.DIRECTION.size)

    @family.kernel(x=algebra.EVEN)
    def even_inverse(x):
        """The inverse of an even element. Its rotational part must not be 0."""
        return ga.inverse(x)

    @family.kernel(m=MOTOR, d=algebra.DIRECTION)
    def move_direction(m, d):
        """The direction `d` turned by the unit motor `m`: ``m d ~m``. Translations leave directions alone."""
        return m * d * ~m

    @family.kernel(m=MOTOR, line=algebra.LINE)
    def move_line(m, line):
        """The line moved by the unit motor `m`: ``m line ~m``."""
        return m * line * ~m

    @family.kernel(m=MOTOR, p=POINT)
    def move_point_back(m, p):
        """The point `p` moved by the inverse of the unit motor `m`: ``~m p m``."""
        return ~m * p * m

    @family.kernel(v=VECTOR, returns=TRANSLATOR)
    def translator_from_vector(v):
        """The translation by a vector."""
        return translator(v)

    @family.kernel(a=POINT, b=POINT, returns=TRANSLATOR)
    def translator_between_points(a, b):
        """The translation that takes the point `a` to `b`."""
        return translator(coordinates(b - a))

    @family.kernel(a=MOTOR, b=MOTOR, returns=MOTOR)
    def motor_between_frames(a, b):
        """The motor, in fixed coordinates, that takes what `a` moves things to where `b` moves them: ``b ~a``."""
        return b * ~a

    @family.kernel(a=MOTOR, b=MOTOR, returns=MOTOR)
    def motor_relative(a, b):
        """The motor `b` seen from the frame `a`: ``~a b``, so that `a` times it is `b`."""
        return ~a * b

    return family


def twists(algebra, bivector):
    """Velocities of rigid motions; `bivector` is the layout of all bivectors."""
    family = Family("twists")
    MOTOR, EVEN, TWIST = algebra.MOTOR, algebra.EVEN, bivector

    @family.kernel(v=TWIST, p=algebra.POINT)
    def twist_on_point(v, p):
        """The velocity of the point `p` under the twist `v`: the derivative at 0 of ``m p ~m`` with ``m = exp(-t/2 v)``."""  # noqa: E501
        return ga.commutator(p, v)

    @family.kernel(v=TWIST, line=algebra.LINE)
    def twist_on_line(v, line):
        """The rate of change of the line under the twist `v`, as in `twist_on_point`."""
        return ga.commutator(line, v)

    @family.kernel(v=TWIST, returns=MOTOR)
    def motor_from_twist(v):
        """The motor of a twist kept for the unit of time: ``exp(-v/2)``."""
        return ga.exp(-v / 2)

    @family.kernel(m=MOTOR, returns=TWIST)
    def motor_to_twist(m):
        """The twist that does the motion of a unit motor in the unit of time, by an angle in [0, pi]: ``-2 log(m)``."""
        return -2 * ga.log(m)

    @family.kernel(m=MOTOR, v=TWIST)
    def motor_derivative(m, v):
        """The rate of change of a motor under the twist `v`, in fixed coordinates: ``-v m / 2``."""
        return -HALF * v * m

    @family.kernel(m=MOTOR, rate=EVEN, returns=TWIST)
    def twist_from_motor_derivative(m, rate):
        """The twist of a unit motor that changes at a rate, in fixed coordinates: ``-2 rate ~m``."""
        return (-2 * rate * ~m).grade(2)

    @family.kernel(m=MOTOR, returns=array(SCALAR, TWIST.size, TWIST.size))
    def motor_to_adjoint(m):
        """The matrix of a unit motor on twists: on columns of their coefficients."""
        moved = [m * algebra.multivector({name: 1}) * ~m for name in TWIST.blades]
        return tuple(tuple(column[name] for column in moved) for name in TWIST.blades)

    return family
