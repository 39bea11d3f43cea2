"""Projective space and cameras in the exterior algebra of homogeneous coordinates.

Points are (x, y, z, w). The three rows of a camera's 3 x 4 matrix are planes through its centre, represented as
vectors; lines are outer products of two of these, and a bracket, the outer product of four, is a determinant. Image
points are (x, y) in the units of the camera's matrix, usually pixels; image lines ``a x + b y + c = 0`` are (a, b, c).
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
    """Compute the determinant of four points, or four planes, as rows; 0 if coplanar, or if they share a point."""
    return (a ^ b ^ c ^ d)["e1234"]


@kernel(a=VECTOR, b=VECTOR, returns=BIVECTOR)
def join_points(a, b):
    """Compute the line through two points: its six Pluecker coordinates ``a ^ b``."""
    return a ^ b


@kernel(a=VECTOR, b=VECTOR, c=VECTOR, returns=VECTOR)
def join_three_points(a, b, c):
    """Compute the plane (n, d) through three points, ``n . x + d = 0``, or the point in which three planes meet."""
    return ga.undual(a ^ b ^ c)


@kernel(camera=CAMERA, place=PLACE, returns=PIXEL)
def project_point(camera, place):
    """Project a point of space to the image; division by 0 in the plane through the camera's centre."""
    x, y, w = (ga.scalar_product(row, _homogeneous(place)) for row in camera)
    return x / w, y / w


@kernel(camera=CAMERA, point=VECTOR, returns=array(SCALAR, 3))
def project_homogeneous_point(camera, point):
    """Project a homogeneous point to the homogeneous image; with a camera of scale 1 the third entry is its depth."""
    return tuple(ga.scalar_product(row, point) for row in camera)


@kernel(camera=CAMERA, returns=VECTOR)
def camera_centre(camera):
    """Compute the homogeneous centre of a camera: the point in which its three planes meet."""
    return ga.undual(camera[0] ^ camera[1] ^ camera[2])


@kernel(camera=CAMERA, pixel=PIXEL, returns=BIVECTOR)
def back_project_pixel(camera, pixel):
    """Compute the line of sight of a pixel: the outer product ``p ^ q`` of two planes that contain it."""
    return (camera[0] - pixel[0] * camera[2]) ^ (camera[1] - pixel[1] * camera[2])


@kernel(first=CAMERA, second=CAMERA, returns=MATRIX)
def fundamental_matrix_from_cameras(first, second):
    """Compute the matrix F with ``x' F x = 0`` for the images x and x' of every point in the first and second camera.

    Its entry (i, j) is the bracket of the two rows of the first camera other than j and the two of the second other
    than i, both in cyclic order. It is 0 if the corresponding lines of sight of the two cameras meet.
    """
    of_first = [first[k] ^ first[m] for k, m in NEXT]
    of_second = [second[k] ^ second[m] for k, m in NEXT]
    return tuple(tuple((a ^ b)["e1234"] for a in of_first) for b in of_second)


@kernel(first=CAMERA, second=CAMERA, returns=array(SCALAR, 3))
def epipole_from_cameras(first, second):
    """Compute the homogeneous image of the first camera's centre in the second camera."""
    centre = ga.undual(first[0] ^ first[1] ^ first[2])
    return tuple(ga.scalar_product(row, centre) for row in second)


@kernel(fundamental=MATRIX, pixel=PIXEL, returns=LINE)
def epipolar_line(fundamental, pixel):
    """Compute the line (a, b, c) in the second image that corresponds to a pixel of the first: ``F (x, y, 1)``."""
    return _epipolar_line(fundamental, pixel)


@kernel(fundamental=MATRIX, pixel=PIXEL, partner=PIXEL)
def distance_to_epipolar_line(fundamental, pixel, partner):
    """Compute the signed distance from a pixel of the second image to the epipolar line of a pixel of the first."""
    a, b, c = _epipolar_line(fundamental, pixel)
    return (a * partner[0] + b * partner[1] + c) / ga.sqrt(a * a + b * b)


@kernel(fundamental=MATRIX, pixel=PIXEL, partner=PIXEL)
def sampson_distance(fundamental, pixel, partner):
    """Compute the signed first-order (Sampson) distance from a pair of pixels to the nearest pair consistent with F."""
    a, b, c = _epipolar_line(fundamental, pixel)
    d, e, _ = _epipolar_line(tuple(zip(*fundamental, strict=True)), partner)
    return (a * partner[0] + b * partner[1] + c) / ga.sqrt(a * a + b * b + d * d + e * e)


@kernel(first=CAMERA, second=CAMERA, pixel=PIXEL, partner=PIXEL, returns=VECTOR)
def triangulate(first, second, pixel, partner):
    """Compute the homogeneous point on a pixel's line of sight with the second image nearest to the partner.

    It is the meet of the line of sight with the plane that the second camera sees as the line through the partner
    orthogonal to the epipolar line. The result is 0 if the line of sight passes through the second camera's centre.
    """
    sight = (first[0] - pixel[0] * first[2]) ^ (first[1] - pixel[1] * first[2])
    epipolar_x, epipolar_y = ((sight ^ second[k] ^ second[m])["e1234"] for k, m in NEXT[:2])
    column, row = second[0] - partner[0] * second[2], second[1] - partner[1] * second[2]
    return ga.undual(sight ^ (epipolar_x * row - epipolar_y * column))


# Cameras and lines.


@kernel(centre=VECTOR, first=VECTOR, second=VECTOR, third=VECTOR, returns=CAMERA)
def camera_from_image_basis(centre, first, second, third):
    """Construct the camera with a given centre and three basis points of the image plane.

    Row 0 is the plane through the centre and the last two points.
    """
    basis = (first, second, third)
    return tuple(ga.undual(centre ^ basis[k] ^ basis[m]) for k, m in NEXT)


@kernel(camera=CAMERA, returns=array(BIVECTOR, 3))
def line_projection(camera):
    """Compute the 3 x 6 matrix of a camera that maps Pluecker coordinates to the image line (a, b, c)."""
    return tuple(camera[k] ^ camera[m] for k, m in NEXT)


@kernel(camera=CAMERA, line=BIVECTOR, returns=LINE)
def project_line(camera, line):
    """Project a line of space to the image line (a, b, c); 0 if it passes through the camera's centre."""
    return tuple(ga.scalar_product(camera[k] ^ camera[m], ~line) for k, m in NEXT)


@kernel(line=BIVECTOR, plane=VECTOR, returns=VECTOR)
def meet_line_plane(line, plane):
    """Compute the point in which a line meets a plane (n, d); 0 if the line lies in the plane."""
    return ga.left_contraction(plane, line)


@kernel(a=BIVECTOR, b=BIVECTOR)
def meet_lines(a, b):
    """Compute the outer product of two lines, which is 0 if they meet."""
    return (a ^ b)["e1234"]


# Three and four views.


def _product(point, tensor, second, third):
    return sum(point[i] * tensor[i][j][k] * second[j] * third[k] for i in range(3) for j in range(3) for k in range(3))


@kernel(first=CAMERA, second=CAMERA, third=CAMERA, returns=array(SCALAR, 3, 3, 3))
def trifocal_tensor_from_cameras(first, second, third):
    """Compute the tensor T with ``x_i l'_j l''_k T_ijk = 0`` for a point x and lines l', l'' through its partners.

    Entry (i, j, k) is the bracket of the two rows of the first camera other than i, in cyclic order, row j of the
    second and row k of the third. It is 0 if a line of sight and two planes of sight meet.
    """
    sights = [first[k] ^ first[m] for k, m in NEXT]
    return tuple(tuple(tuple((sight ^ b ^ c)["e1234"] for c in third) for b in second) for sight in sights)


@kernel(first=CAMERA, second=CAMERA, third=CAMERA, fourth=CAMERA, returns=array(SCALAR, 3, 3, 3, 3))
def quadrifocal_tensor_from_cameras(first, second, third, fourth):
    """Compute the tensor Q with ``l_i l'_j l''_k l'''_m Q_ijkm = 0`` for lines through images of the same point.

    Entry (i, j, k, m) is the bracket of rows i, j, k and m of the four cameras.
    """
    lines, others = [[a ^ b for b in second] for a in first], [[c ^ d for d in fourth] for c in third]
    return tuple(
        tuple(tuple(tuple((line ^ other)["e1234"] for other in row) for row in others) for line in part)
        for part in lines
    )


@kernel(tensor=array(SCALAR, 3, 3, 3), pixel=PIXEL, line=LINE, returns=array(SCALAR, 3))
def transfer_point(tensor, pixel, line):
    """Compute the homogeneous image in the third view from a pixel of the first and a line of the second.

    The line passes through the partner of the pixel.
    """
    x = (*pixel, 1)
    return tuple(sum(x[i] * line[j] * tensor[i][j][k] for i in range(3) for j in range(3)) for k in range(3))


@kernel(tensor=array(SCALAR, 3, 3, 3), second=LINE, third=LINE, returns=LINE)
def transfer_line(tensor, second, third):
    """Compute the line in the first view of a line of space from its images in the second and third view."""
    return tuple(sum(second[j] * third[k] * tensor[i][j][k] for j in range(3) for k in range(3)) for i in range(3))


@kernel(tensor=array(SCALAR, 3, 3, 3, 3), first=LINE, second=LINE, third=LINE, returns=array(SCALAR, 3))
def transfer_lines(tensor, first, second, third):
    """Compute the homogeneous image in the fourth view of the point in which three planes of sight meet."""
    pairs = [[first[i] * second[j] for j in range(3)] for i in range(3)]
    inner = [
        [sum(pairs[i][j] * tensor[i][j][k][m] for i in range(3) for j in range(3)) for m in range(3)] for k in range(3)
    ]
    return tuple(sum(third[k] * inner[k][m] for k in range(3)) for m in range(3))


# Equations for tensors, and depths.


@kernel(pixel=PIXEL, partner=PIXEL, returns=array(SCALAR, 9))
def epipolar_equation(pixel, partner):
    """Compute the coefficients of the entries of F, row by row, in ``x' F x``."""
    return tuple(b * a for b in (*partner, 1) for a in (*pixel, 1))


@kernel(fundamental=MATRIX, pixel=PIXEL, partner=PIXEL, returns=MATRIX)
def sampson_distance_gradient(fundamental, pixel, partner):
    """Compute the derivatives of `sampson_distance` with respect to the entries of F."""
    x, y = (*pixel, 1), (*partner, 1)
    line = _epipolar_line(fundamental, pixel)
    back = _epipolar_line(tuple(zip(*fundamental, strict=True)), partner)
    square = line[0] * line[0] + line[1] * line[1] + back[0] * back[0] + back[1] * back[1]
    inverse = 1 / ga.sqrt(square)
    ratio = (line[0] * y[0] + line[1] * y[1] + line[2]) / square
    a, b = (line[0], line[1], 0), (back[0], back[1], 0)
    return tuple(
        tuple(inverse * (y[i] * x[j] - ratio * (a[i] * x[j] + b[j] * y[i])) for j in range(3)) for i in range(3)
    )


@kernel(fundamental=MATRIX, epipole=array(SCALAR, 3), pixel=PIXEL, partner=PIXEL)
def depth_ratio(fundamental, epipole, pixel, partner):
    """Compute the projective depth of a partner divided by that of its pixel, up to a factor common to all points.

    With the epipole e of the second view it is ``(e x x') . F x / (e x x')**2``.
    """
    x = (*partner, 1)
    cross = tuple(epipole[k] * x[m] - epipole[m] * x[k] for k, m in NEXT)
    line = _epipolar_line(fundamental, pixel)
    return sum(a * b for a, b in zip(cross, line, strict=True)) / sum(a * a for a in cross)


@kernel(place=PLACE, returns=array(SCALAR, 2, 6))
def image_derivative(place):
    """Compute the derivatives of the image (x/z, y/z) of a point in the camera's frame.

    The first three columns are with respect to a small rotation vector, the last three to a translation of the point.
    """
    x, y, z = place
    w = 1 / z
    u, v = x * w, y * w
    return (-u * v, 1 + u * u, -v, w, 0, -u * w), (-1 - v * v, u * v, u, 0, w, -v * w)


# Invariants of six points.


_EDGES = ((0, (1, 2)), (1, (0, 2)), (2, (0, 1)))
"""Each coordinate divided by the fourth is a cross-ratio about the edge of the two others."""


def _ratios(value):
    """Yield coordinate k over coordinate 3 of point 5 in the frame of points 0 to 4, by brackets ``value(i, j, k, m)``.

    The brackets are split in pairs so that each pair occurs in the numerator and in the denominator.
    """
    for a, (p, q) in _EDGES:
        above = value(5, p, q, 3) * value(a, q, p, 4)
        yield above / (value(4, p, q, 3) * value(a, q, p, 5))


@kernel(points=array(VECTOR, 6), returns=array(SCALAR, 3))
def invariants_of_points(points):
    """Compute three projective invariants of six points: the last one's coordinates in the frame of the first five.

    Each is a cross-ratio of four planes about an edge of the tetrahedron of the first four points.
    """
    pairs = {}

    def line(i, j):
        if (i, j) not in pairs:
            pairs[i, j] = points[i] ^ points[j]
        return pairs[i, j]

    return tuple(_ratios(lambda i, j, k, m: (line(i, j) ^ line(k, m))["e1234"]))


@kernel(points=array(VECTOR, 6))
def cross_ratio_of_planes(points):
    """Compute the cross-ratio {2, 3; 4, 5} of the planes through points 0 and 1 and each of the other four points."""
    axis = points[0] ^ points[1]

    def bracket_of(i, j):
        return (axis ^ points[i] ^ points[j])["e1234"]

    return bracket_of(2, 4) * bracket_of(3, 5) / (bracket_of(2, 5) * bracket_of(3, 4))


def _cross(a, b):
    return tuple(a[k] * b[m] - a[m] * b[k] for k, m in NEXT)


def _joins(pixels):
    """Return a function that computes the line through two of several image points, each once."""
    found = {}

    def line(i, j):
        if (i, j) not in found:
            found[i, j] = _cross((*pixels[i], 1), (*pixels[j], 1))
        return found[i, j]

    return line


def _crossings(line):
    """Return a function that computes the point in which two joins cross, each once."""
    found = {}

    def point(*pairs):
        if pairs not in found:
            found[pairs] = _cross(line(*pairs[:2]), line(*pairs[2:]))
        return found[pairs]

    return point


@kernel(fundamental=MATRIX, pixels=array(SCALAR, 6, 2), partners=array(SCALAR, 6, 2), returns=array(SCALAR, 3))
def invariants_of_two_views(fundamental, pixels, partners):
    """Compute `invariants_of_points` from two views with fundamental matrix F.

    A bracket [ijkm] is, up to brackets of the centres with i, j and with k, m, the form ``x' F x`` of the points in
    which the joins of i, j and of k, m cross; the factors cancel.
    """
    first, second = _crossings(_joins(pixels)), _crossings(_joins(partners))

    def value(*pairs):
        x, y = first(*pairs), second(*pairs)
        return sum(y[i] * sum(fundamental[i][j] * x[j] for j in range(3)) for i in range(3))

    return tuple(_ratios(value))


@kernel(
    tensor=array(SCALAR, 3, 3, 3),
    second=array(SCALAR, 3),
    third=array(SCALAR, 3),
    pixels=array(SCALAR, 6, 2),
    partners=array(SCALAR, 6, 2),
    others=array(SCALAR, 6, 2),
    returns=array(SCALAR, 3),
)
def invariants_of_three_views(tensor, second, third, pixels, partners, others):
    """Compute `invariants_of_points` from three views with trifocal tensor T.

    `second` and `third` are the images of the first centre in these views: their brackets with the joins replace the
    brackets of the centres.
    """
    one, two, three = _crossings(_joins(pixels)), _joins(partners), _joins(others)

    def value(i, j, k, m):
        x, b, c = one(i, j, k, m), two(i, j), three(k, m)
        scale = sum(e * n for e, n in zip(second, b, strict=True)) * sum(e * n for e, n in zip(third, c, strict=True))
        return _product(x, tensor, b, c) / scale

    return tuple(_ratios(value))
