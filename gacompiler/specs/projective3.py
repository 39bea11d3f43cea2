"""Projective space and cameras in the exterior algebra of homogeneous coordinates.

Points are (x, y, z, w). The three rows of a camera's 3 x 4 matrix are planes through its centre, written as vectors;
lines are outer products of two of these, and a bracket, the outer product of four, is a determinant. Image points are
(x, y) in the units that the camera's matrix gives, pixels as a rule; image lines ``a x + b y + c = 0`` are (a, b, c).
"""

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import orthogonal

PROJECTIVE3 = orthogonal(4, name="PROJECTIVE3")
VECTOR = PROJECTIVE3.layout("VECTOR", "e1 e2 e3 e4")
BIVECTOR = PROJECTIVE3.layout("BIVECTOR", "e12 e13 e23 e14 e24 e34")
CAMERA, MATRIX, LINE = array(VECTOR, 3), array(SCALAR, 3, 3), array(SCALAR, 3)
PLACE, PIXEL = array(SCALAR, 3), array(SCALAR, 2)

NEXT = ((1, 2), (2, 0), (0, 1))


def _homogeneous(place):
    return ga.assemble(PROJECTIVE3, {"e1": place[0], "e2": place[1], "e3": place[2], "e4": 1})


def _epipolar_line(fundamental, pixel):
    return tuple(row[0] * pixel[0] + row[1] * pixel[1] + row[2] for row in fundamental)


@kernel(a=VECTOR, b=VECTOR, c=VECTOR, d=VECTOR)
def bracket(a, b, c, d):
    """The determinant of four points, or of four planes, as rows; 0 where they are in one plane, or meet in a point."""
    return (a ^ b ^ c ^ d)["e1234"]


@kernel(a=VECTOR, b=VECTOR, returns=BIVECTOR)
def join_points(a, b):
    """The line of two points: its six Pluecker coordinates ``a ^ b``."""
    return a ^ b


@kernel(a=VECTOR, b=VECTOR, c=VECTOR, returns=VECTOR)
def join_three_points(a, b, c):
    """The plane (n, d) of three points, all x with ``n . x + d = 0``; the point in which three planes meet."""
    return ga.undual(a ^ b ^ c)


@kernel(camera=CAMERA, place=PLACE, returns=PIXEL)
def project_point(camera, place):
    """The image of a point of space; division by 0 where it is in the plane of the camera's centre."""
    x, y, w = (ga.scalar_product(row, _homogeneous(place)) for row in camera)
    return x / w, y / w


@kernel(camera=CAMERA, point=VECTOR, returns=array(SCALAR, 3))
def project_homogeneous_point(camera, point):
    """The homogeneous image of a homogeneous point of space; the third entry of a camera with scale 1 is its depth."""
    return tuple(ga.scalar_product(row, point) for row in camera)


@kernel(camera=CAMERA, returns=VECTOR)
def camera_centre(camera):
    """The centre of a camera, homogeneous: the point in which its three planes meet."""
    return ga.undual(camera[0] ^ camera[1] ^ camera[2])


@kernel(camera=CAMERA, pixel=PIXEL, returns=BIVECTOR)
def back_project_pixel(camera, pixel):
    """The line of sight of a pixel: the outer product ``p ^ q`` of two planes that meet in it."""
    return (camera[0] - pixel[0] * camera[2]) ^ (camera[1] - pixel[1] * camera[2])


@kernel(first=CAMERA, second=CAMERA, returns=MATRIX)
def fundamental_matrix_from_cameras(first, second):
    """The matrix F with ``x' F x = 0`` for the images x in the first and x' in the second camera of every point.

    Its entry (i, j) is the bracket of the two rows of the first camera other than j and the two of the second other
    than i, both in cyclic order: it says whether a line of sight of either camera meets one of the other.
    """
    of_first = [first[k] ^ first[m] for k, m in NEXT]
    of_second = [second[k] ^ second[m] for k, m in NEXT]
    return tuple(tuple((a ^ b)["e1234"] for a in of_first) for b in of_second)


@kernel(first=CAMERA, second=CAMERA, returns=array(SCALAR, 3))
def epipole_from_cameras(first, second):
    """The homogeneous image in the second camera of the centre of the first."""
    centre = ga.undual(first[0] ^ first[1] ^ first[2])
    return tuple(ga.scalar_product(row, centre) for row in second)


@kernel(fundamental=MATRIX, pixel=PIXEL, returns=LINE)
def epipolar_line(fundamental, pixel):
    """The line (a, b, c) of the second image on which the partner of a pixel of the first lies: ``F (x, y, 1)``."""
    return _epipolar_line(fundamental, pixel)


@kernel(fundamental=MATRIX, pixel=PIXEL, partner=PIXEL)
def distance_to_epipolar_line(fundamental, pixel, partner):
    """The signed distance of a pixel of the second image to the epipolar line of one of the first."""
    a, b, c = _epipolar_line(fundamental, pixel)
    return (a * partner[0] + b * partner[1] + c) / ga.sqrt(a * a + b * b)


@kernel(fundamental=MATRIX, pixel=PIXEL, partner=PIXEL)
def sampson_distance(fundamental, pixel, partner):
    """The distance of a pair of pixels to the nearest pair that fits F, to first order (Sampson's), signed."""
    a, b, c = _epipolar_line(fundamental, pixel)
    d, e, _ = _epipolar_line(tuple(zip(*fundamental, strict=True)), partner)
    return (a * partner[0] + b * partner[1] + c) / ga.sqrt(a * a + b * b + d * d + e * e)


@kernel(first=CAMERA, second=CAMERA, pixel=PIXEL, partner=PIXEL, returns=VECTOR)
def triangulate(first, second, pixel, partner):
    """The homogeneous point of a pixel's line of sight whose image in the second camera is nearest to the partner.

    It is the meet of the line of sight with the plane that the second camera sees as the line through the partner
    orthogonal to the epipolar line. All is 0 where the line of sight goes through the second camera's centre.
    """
    sight = (first[0] - pixel[0] * first[2]) ^ (first[1] - pixel[1] * first[2])
    epipolar_x, epipolar_y = ((sight ^ second[k] ^ second[m])["e1234"] for k, m in NEXT[:2])
    column, row = second[0] - partner[0] * second[2], second[1] - partner[1] * second[2]
    return ga.undual(sight ^ (epipolar_x * row - epipolar_y * column))
