"""Points, lines and motions of plane-based algebras G(n,0,1), the same in the plane and in space."""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, Family, array
from gacompiler.specs.families.products import products as any_elements

HALF = Fraction(1, 2)


def dot(a, b):
    """Return the inner product of two tuples of coordinates."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def coordinates(x):
    """Return the coordinates of a point with weight 1 or of a direction."""
    return tuple(x[name] for name in x.algebra.DIRECTION.blades)


def direction_of_line(line):
    """Return the direction of a line of space, its intersection with the plane at infinity."""
    return line ^ -line.algebra.multivector({"e0": 1})


def foot_on_unit_line(p, line):
    """Return the point of a normalised line of space that is nearest to the point `p`."""
    return (ga.right_contraction(p, line) * ~line).grade(3)


def gap_of_parallels(a, b):
    """Return the distance between two normalised lines of the plane, or planes of space, that are parallel."""
    return ga.absolute(a["e0"] - ga.select(ga.scalar_product(a, b) < 0, -1, 1) * b["e0"])


def products(algebra, hyperplanes):
    """Declare the products of a plane-based algebra with the vectors `hyperplanes`."""
    return any_elements(
        algebra,
        algebra.EVEN,
        outer_product=f": the meet of {hyperplanes}",
        regressive_product=": the join of points",
        even_product=", which need not be motors",
        dual=", which needs no metric",
        norm=", which ignores ``e0``; it is 0 for elements at infinity",
    )


def points_and_lines(algebra):
    """Declare joins of points and distances between them."""
    family = Family("points and lines")
    POINT, LINE = algebra.POINT, algebra.LINE

    @family.kernel(line=LINE)
    def normalize_line(line):
        """Divide a line by its norm, which must not be 0."""
        return ga.normalize(line)

    @family.kernel(a=POINT, b=POINT)
    def join_points(a, b):
        """Compute the line from `a` to `b`; its norm is their distance. It is 0 if the points coincide."""
        return a & b

    @family.kernel(p=POINT, d=algebra.DIRECTION)
    def join_point_direction(p, d):
        """Compute the line through the point `p` along the direction `d`; its norm is the length of `d`."""
        return p & d

    @family.kernel(a=POINT, b=POINT)
    def distance_squared_points(a, b):
        """Compute the squared distance between two points."""
        return ga.norm_squared(a & b)

    @family.kernel(a=POINT, b=POINT)
    def distance_points(a, b):
        """Compute the distance between two points."""
        return ga.norm(a & b)

    @family.kernel(a=POINT, b=POINT, returns=POINT)
    def midpoint(a, b):
        """Compute the midpoint of two points."""
        return (a + b) / 2

    return family


def motions(algebra, translator):
    """Declare the action of motors and motors between objects; `translator` maps coordinates to a translation."""
    family = Family("motions")
    POINT, MOTOR, TRANSLATOR = algebra.POINT, algebra.MOTOR, algebra.TRANSLATOR
    VECTOR = array(SCALAR, algebra.DIRECTION.size)

    @family.kernel(x=algebra.EVEN)
    def even_inverse(x):
        """Compute the inverse of an even element. The rotational part must not be 0."""
        return ga.inverse(x)

    @family.kernel(m=MOTOR, d=algebra.DIRECTION)
    def move_direction(m, d):
        """Rotate the direction `d` by the unit motor `m`: ``m d ~m``. Directions are invariant under translations."""
        return m * d * ~m

    @family.kernel(m=MOTOR, line=algebra.LINE)
    def move_line(m, line):
        """Move a line by the unit motor `m`: ``m line ~m``."""
        return m * line * ~m

    @family.kernel(m=MOTOR, p=POINT)
    def move_point_back(m, p):
        """Move the point `p` by the inverse of the unit motor `m`: ``~m p m``."""
        return ~m * p * m

    @family.kernel(v=VECTOR, returns=TRANSLATOR)
    def translator_from_vector(v):
        """Construct the translation by a vector."""
        return translator(v)

    @family.kernel(a=POINT, b=POINT, returns=TRANSLATOR)
    def translator_between_points(a, b):
        """Compute the translation that takes the point `a` to `b`."""
        return translator(coordinates(b - a))

    @family.kernel(a=MOTOR, b=MOTOR, returns=MOTOR)
    def motor_between_frames(a, b):
        """Compute the motor, in fixed coordinates, from the pose `a` to the pose `b`: ``b ~a``."""
        return b * ~a

    @family.kernel(a=MOTOR, b=MOTOR, returns=MOTOR)
    def motor_relative(a, b):
        """Compute the motor `b` relative to the frame `a`: ``~a b``, so that `a` times the result is `b`."""
        return ~a * b

    return family


def twists(algebra, bivector):
    """Declare velocities of rigid motions; `bivector` is the layout of all bivectors."""
    family = Family("twists")
    MOTOR, EVEN, TWIST = algebra.MOTOR, algebra.EVEN, bivector

    @family.kernel(v=TWIST, p=algebra.POINT)
    def twist_on_point(v, p):
        """Compute the velocity of the point `p` under the twist `v`.

        It is the derivative at 0 of ``m p ~m`` with ``m = exp(-t/2 v)``.
        """
        return ga.commutator(p, v)

    @family.kernel(v=TWIST, line=algebra.LINE)
    def twist_on_line(v, line):
        """Compute the rate of change of a line under the twist `v`, as in `twist_on_point`."""
        return ga.commutator(line, v)

    @family.kernel(v=TWIST, returns=MOTOR)
    def motor_from_twist(v):
        """Compute the motor of a constant twist applied for one unit of time: ``exp(-v/2)``."""
        return ga.exp(-v / 2)

    @family.kernel(m=MOTOR, returns=TWIST)
    def motor_to_twist(m):
        """Compute the constant twist of a unit motor over one unit of time, with an angle in [0, pi]: ``-2 log(m)``."""
        return -2 * ga.log(m)

    @family.kernel(m=MOTOR, v=TWIST)
    def motor_derivative(m, v):
        """Compute the rate of change of a motor under the twist `v`, in fixed coordinates: ``-v m / 2``."""
        return -HALF * v * m

    @family.kernel(m=MOTOR, rate=EVEN, returns=TWIST)
    def twist_from_motor_derivative(m, rate):
        """Compute the twist of a unit motor from its rate of change, in fixed coordinates: ``-2 rate ~m``."""
        return (-2 * rate * ~m).grade(2)

    @family.kernel(m=MOTOR, returns=array(SCALAR, TWIST.size, TWIST.size))
    def motor_to_adjoint(m):
        """Compute the matrix by which a unit motor acts on the coefficients of twists."""
        moved = [m * algebra.multivector({name: 1}) * ~m for name in TWIST.blades]
        return tuple(tuple(column[name] for column in moved) for name in TWIST.blades)

    return family
