"""Points, flats and rounds of conformal algebras, the same in the plane and in space."""

import gacompiler as ga
from gacompiler import SCALAR, Family, array
from gacompiler.specs.families.conformal_space import dot, length_of
from gacompiler.specs.families.products import products as any_elements


def products(algebra):
    """The products of a conformal algebra."""
    return any_elements(
        algebra,
        regressive_product=": the meet of elements that together span space",
        even_product=": for versors, the composition that applies `b` first",
        dual=", which needs no metric",
        versor="versor",
    )


def points(space, *, coordinates, coefficients, sphere):
    """Declare points, flat points and the vectors that are dual to the rounds of highest dimension.

    `sphere` names these rounds; `coordinates` and `coefficients` are the numbers, in words, of coordinates and
    coefficients of a point.
    """
    family = Family("points", coordinates=coordinates, coefficients=coefficients, sphere=sphere)
    algebra, EINF = space.algebra, space.einf
    POINT, VECTOR, FLAT_POINT = algebra.POINT, algebra.VECTOR, algebra.FLAT_POINT

    @family.kernel(x=array(SCALAR, len(space.axes)), returns=VECTOR)
    def embed_point(x):
        """Construct the point at {coordinates} coordinates, with all {coefficients} coefficients stored.

        It is ``x + e0 + x**2/2 einf``.
        """
        return space.point(*x)

    @family.kernel(x=VECTOR, returns=POINT)
    def extract_point(x):
        """Extract the coordinates of a point of any nonzero weight, or the centre of a dual {sphere}."""
        return space.normalized(x)

    @family.kernel(x=VECTOR, returns=VECTOR)
    def normalize_vector(x):
        """Divide a vector by its coefficient of e0, so that a point or dual {sphere} has weight 1."""
        return x / space.weight(x)

    @family.kernel(a=POINT, b=POINT)
    def inner_product_of_points(a, b):
        """Compute the inner product of two points: minus half their squared distance."""
        return ga.scalar_product(a, b)

    @family.kernel(a=POINT, b=POINT)
    def distance_squared_points(a, b):
        """Compute the squared distance between two points."""
        return -2 * ga.scalar_product(a, b)

    @family.kernel(a=POINT, b=POINT)
    def distance_points(a, b):
        """Compute the distance between two points: the length of the line through them."""
        line = a ^ b ^ EINF
        return ga.sqrt(ga.scalar_product(line, line))

    @family.kernel(a=VECTOR, b=VECTOR)
    def inner_product_of_vectors(a, b):
        """Compute the inner product of two vectors; for unit dual {sphere}s ``(r**2 + s**2 - distance**2) / 2``."""
        return ga.scalar_product(a, b)

    @family.kernel(a=VECTOR, b=VECTOR)
    def inversive_distance(a, b):
        """Compute the inversive distance ``-a . b / (|a| |b|)`` of two vectors, invariant under conformal maps."""
        return -dot(a, b) / ga.sqrt(dot(a, a) * dot(b, b))

    @family.kernel(p=POINT, s=VECTOR)
    def power_of_point(p, s):
        """Compute the power of a point: squared distance to the centre of a dual {sphere} minus squared radius.

        The power is negative inside.
        """
        return -2 * dot(p, s) / space.weight(s)

    @family.kernel(p=POINT, returns=FLAT_POINT)
    def flat_point_from_point(p):
        """Construct the flat point ``p ^ einf``: a point together with infinity."""
        return p ^ EINF

    @family.kernel(flat=FLAT_POINT, returns=POINT)
    def point_from_flat_point(flat):
        """Extract the point of a flat point of any nonzero weight."""
        return space.point(*(flat[f"{name}inf"] / flat["e0inf"] for name in space.names))

    return family


def lines_and_rounds(space, *, circle_dual, coefficients):
    """Declare lines, point pairs and circles: their construction from points and from duals, and their parameters.

    `circle_dual` is the layout of polarities of circles, and `coefficients` is the number of coefficients, in words, of
    a circle.
    """
    family = Family("lines and rounds", coefficients=coefficients)
    algebra, EINF, PSEUDOSCALAR = space.algebra, space.einf, space.algebra.pseudoscalar
    POINT, LINE, CIRCLE, POINT_PAIR = algebra.POINT, algebra.LINE, algebra.CIRCLE, algebra.POINT_PAIR
    COORDINATES = array(SCALAR, len(space.axes))

    @family.kernel(a=POINT, b=POINT, returns=LINE)
    def line_from_points(a, b):
        """Construct the line ``a ^ b ^ einf`` from `a` to `b`."""
        return a ^ b ^ EINF

    @family.kernel(p=POINT, d=COORDINATES, returns=LINE)
    def line_from_point_direction(p, d):
        """Construct the line through the point `p` along the direction `d`."""
        return p ^ space.vector(d) ^ EINF

    @family.kernel(line=LINE, returns=algebra.DUAL_LINE)
    def line_polarity(line):
        """Compute the dual of a line."""
        return ga.polarity(line)

    @family.kernel(dual=algebra.DUAL_LINE, returns=LINE)
    def line_from_dual(dual):
        """Construct the line with the given polarity."""
        return dual * PSEUDOSCALAR

    @family.kernel(a=POINT, b=POINT)
    def point_pair_from_points(a, b):
        """Construct the point pair ``a ^ b``."""
        return a ^ b

    @family.kernel(centre=POINT, direction=COORDINATES, radius_squared=SCALAR, returns=POINT_PAIR)
    def point_pair_from_centre(centre, direction, radius_squared):
        """Construct the point pair at a given distance from a centre on both sides along a nonzero direction."""
        return space.pair(space.coordinates(centre), space.vector(direction), radius_squared)

    @family.kernel(pair=POINT_PAIR, returns=POINT)
    def point_pair_centre(pair):
        """Compute the midpoint of a point pair."""
        return space.centre(pair)

    @family.kernel(pair=POINT_PAIR)
    def point_pair_radius_squared(pair):
        """Compute the square of half the distance between the points of a pair, negative for an imaginary pair."""
        return space.radius_squared(pair)

    @family.kernel(pair=POINT_PAIR, returns=COORDINATES)
    def point_pair_direction(pair):
        """Compute the unit direction of a point pair; for ``a ^ b`` it points from `a` to `b`."""
        return space.components(ga.normalize(space.pair_direction(pair)))

    @family.kernel(pair=POINT_PAIR)
    def point_pair_weight(pair):
        """Compute the weight of a point pair, the length of its unnormalised direction: for ``a ^ b``, the distance."""
        return length_of(space.pair_direction(pair))

    @family.kernel(pair=POINT_PAIR, returns=LINE)
    def point_pair_line(pair):
        """Compute the line through a point pair: ``pair ^ einf``."""
        return pair ^ EINF

    @family.kernel(a=POINT_PAIR, b=POINT_PAIR)
    def inner_product_of_point_pairs(a, b):
        """Compute the inner product of two point pairs.

        Up to its sign, ``a . b / (|a| |b|)`` is ``(1 + x) / (1 - x)``, where x is the cross-ratio of four points on a
        circle.
        """
        return dot(a, b)

    @family.kernel(a=POINT, b=POINT, c=POINT)
    def circle_from_points(a, b, c):
        """Construct the circle ``a ^ b ^ c`` through three points; a line if they are collinear."""
        return a ^ b ^ c

    @family.kernel(line=LINE, returns=CIRCLE)
    def circle_from_line(line):
        """Convert a line to a circle with all {coefficients} coefficients, for functions of circles."""
        return line

    @family.kernel(circle=CIRCLE, returns=circle_dual)
    def circle_polarity(circle):
        """Compute the dual of a circle."""
        return ga.polarity(circle)

    @family.kernel(dual=circle_dual, returns=CIRCLE)
    def circle_from_dual(dual):
        """Construct the circle with the given polarity."""
        return dual * PSEUDOSCALAR

    @family.kernel(circle=CIRCLE)
    def circle_radius_squared(circle):
        """Compute the squared radius of a circle, negative for an imaginary one. A line has none: division by 0."""
        return space.radius_squared(circle)

    return family
