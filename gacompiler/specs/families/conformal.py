"""Points, flats and rounds of conformal algebras, the same in the plane and in space."""

import gacompiler as ga
from gacompiler import SCALAR, Family, array
from gacompiler.specs.families.conformal_space import dot, length_of
from gacompiler.specs.families.products import products as any_elements


def products(algebra):
    """The products of a conformal algebra."""
    return any_elements(
        algebra,
        regressive_product=": the meet of things that together span everything",
        even_product=": of versors, the one that does `b` first",
        dual=", which needs no metric",
        versor="versor",
    )


def points(space, *, coordinates, coefficients, sphere):
    """Points, flat points and the vectors that are dual to the rounds of highest dimension.

    `sphere` names these rounds; `coordinates` and `coefficients` are the numbers, in words, that a point has.
    """
    family = Family("points", coordinates=coordinates, coefficients=coefficients, sphere=sphere)
    algebra, EINF = space.algebra, space.einf
    POINT, VECTOR, FLAT_POINT = algebra.POINT, algebra.VECTOR, algebra.FLAT_POINT

    @family.kernel(x=array(SCALAR, len(space.axes)), returns=VECTOR)
    def embed_point(x):
        """The point at {coordinates} coordinates, all {coefficients} coefficients: ``x + e0 + x**2/2 einf``."""
        return space.point(*x)

    @family.kernel(x=VECTOR, returns=POINT)
    def extract_point(x):
        """The coordinates of a point of any weight but 0; of a dual {sphere}, its centre."""
        return space.normalized(x)

    @family.kernel(x=VECTOR, returns=VECTOR)
    def normalize_vector(x):
        """The vector divided by its coefficient of e0, so that a point or dual {sphere} has weight 1."""
        return x / space.weight(x)

    @family.kernel(a=POINT, b=POINT)
    def inner_product_of_points(a, b):
        """The inner product of two points: minus half their squared distance."""
        return ga.scalar_product(a, b)

    @family.kernel(a=POINT, b=POINT)
    def distance_squared_points(a, b):
        """The squared distance of two points."""
        return -2 * ga.scalar_product(a, b)

    @family.kernel(a=POINT, b=POINT)
    def distance_points(a, b):
        """The distance of two points: the length of the line through them."""
        line = a ^ b ^ EINF
        return ga.sqrt(ga.scalar_product(line, line))

    @family.kernel(a=VECTOR, b=VECTOR)
    def inner_product_of_vectors(a, b):
        """The inner product of two vectors: for normalised dual {sphere}s ``(r**2 + s**2 - distance**2) / 2``."""
        return ga.scalar_product(a, b)

    @family.kernel(a=VECTOR, b=VECTOR)
    def inversive_distance(a, b):
        """The inversive distance ``-a . b / (|a| |b|)`` of two vectors, which conformal maps keep."""
        return -dot(a, b) / ga.sqrt(dot(a, a) * dot(b, b))

    @family.kernel(p=POINT, s=VECTOR)
    def power_of_point(p, s):
        """Squared distance of a point to the centre of a dual {sphere}, minus the squared radius; negative inside."""
        return -2 * dot(p, s) / space.weight(s)

    @family.kernel(p=POINT, returns=FLAT_POINT)
    def flat_point_from_point(p):
        """The flat point ``p ^ einf``: a point together with infinity."""
        return p ^ EINF

    @family.kernel(flat=FLAT_POINT, returns=POINT)
    def point_from_flat_point(flat):
        """The point of a flat point of any weight but 0."""
        return space.point(*(flat[f"{name}inf"] / flat["e0inf"] for name in space.names))

    return family


def lines_and_rounds(space, *, circle_dual, coefficients):
    """Lines, point pairs and circles: by points, by their polarities, and what they are made of.

    `circle_dual` is the layout of polarities of circles, and `coefficients` the number, in words, that a circle has.
    """
    family = Family("lines and rounds", coefficients=coefficients)
    algebra, EINF, PSEUDOSCALAR = space.algebra, space.einf, space.algebra.pseudoscalar
    POINT, LINE, CIRCLE, POINT_PAIR = algebra.POINT, algebra.LINE, algebra.CIRCLE, algebra.POINT_PAIR
    COORDINATES = array(SCALAR, len(space.axes))

    @family.kernel(a=POINT, b=POINT, returns=LINE)
    def line_from_points(a, b):
        """The line ``a ^ b ^ einf`` from `a` to `b`."""
        return a ^ b ^ EINF

    @family.kernel(p=POINT, d=COORDINATES, returns=LINE)
    def line_from_point_direction(p, d):
        """The line through the point `p` along the direction `d`."""
        return p ^ space.vector(d) ^ EINF

    @family.kernel(line=LINE, returns=algebra.DUAL_LINE)
    def line_polarity(line):
        """The dual line of a line."""
        return ga.polarity(line)

    @family.kernel(dual=algebra.DUAL_LINE, returns=LINE)
    def line_from_dual(dual):
        """The line whose polarity is given."""
        return dual * PSEUDOSCALAR

    @family.kernel(a=POINT, b=POINT)
    def point_pair_from_points(a, b):
        """The point pair ``a ^ b``."""
        return a ^ b

    @family.kernel(centre=POINT, direction=COORDINATES, radius_squared=SCALAR, returns=POINT_PAIR)
    def point_pair_from_centre(centre, direction, radius_squared):
        """The pair of points at one distance from a centre, before and behind it along a direction of any length but 0."""  # noqa: E501
        return space.pair(space.coordinates(centre), space.vector(direction), radius_squared)

    @family.kernel(pair=POINT_PAIR, returns=POINT)
    def point_pair_centre(pair):
        """The point midway between the points of a pair."""
        return space.centre(pair)

    @family.kernel(pair=POINT_PAIR)
    def point_pair_radius_squared(pair):
        """The square of half the distance of the points of a pair, negative for an imaginary one."""
        return space.radius_squared(pair)

    @family.kernel(pair=POINT_PAIR, returns=COORDINATES)
    def point_pair_direction(pair):
        """The unit direction of a point pair, for ``a ^ b`` from `a` to `b`."""
        return space.components(ga.normalize(space.pair_direction(pair)))

    @family.kernel(pair=POINT_PAIR)
    def point_pair_weight(pair):
        """The length of the direction that the coefficients of a pair contain: for two points, their distance."""
        return length_of(space.pair_direction(pair))

    @family.kernel(pair=POINT_PAIR, returns=LINE)
    def point_pair_line(pair):
        """The line through a point pair: ``pair ^ einf``."""
        return pair ^ EINF

    @family.kernel(a=POINT_PAIR, b=POINT_PAIR)
    def inner_product_of_point_pairs(a, b):
        """The inner product of two point pairs. By those of `a` and of `b` with themselves, ``a . b / (|a| |b|)``
        is ``(1 + x) / (1 - x)``, up to its sign, by the cross-ratio x of four points on a circle."""
        return dot(a, b)

    @family.kernel(a=POINT, b=POINT, c=POINT)
    def circle_from_points(a, b, c):
        """The circle ``a ^ b ^ c`` through three points; a line where they are on one."""
        return a ^ b ^ c

    @family.kernel(line=LINE, returns=CIRCLE)
    def circle_from_line(line):
        """A line as the circle that it is, all {coefficients} coefficients, for what is written for circles."""
        return line

    @family.kernel(circle=CIRCLE, returns=circle_dual)
    def circle_polarity(circle):
        """The dual circle of a circle."""
        return ga.polarity(circle)

    @family.kernel(dual=circle_dual, returns=CIRCLE)
    def circle_from_dual(dual):
        """The circle whose polarity is given."""
        return dual * PSEUDOSCALAR

    @family.kernel(circle=CIRCLE)
    def circle_radius_squared(circle):
        """The squared radius of a circle, negative for an imaginary one. A line has none: division by 0."""
        return space.radius_squared(circle)

    return family
