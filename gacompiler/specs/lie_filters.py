"""Generators of the affine plane as bivectors of G(3,3), and the energies of the derivatives along their orbits.

A generator is the bivector ``sum a_ij w_i ^ v_j`` of the matrix that moves homogeneous points ``x w1 + y w2 + w3``, as
in `gacompiler.structure.general_linear`; the gradient of an image is the vector ``p v1 + q v2`` of the other null cone.
Generators are passed by six coefficients in the order of `GENERATORS`: translations along x and y, rotation, dilation,
and the hyperbolic generators ``x d/dx - y d/dy`` and ``y d/dx + x d/dy``.

Moments are sums over a window of the products pp, pq, qq of the components of the gradient, in this order, each times
xx, xy, x, yy, y, 1, in this order.
"""

from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import null_pairs

PLANE = null_pairs(3)
GENERATORS = (
    ((0, 0, 1), (0, 0, 0), (0, 0, 0)),
    ((0, 0, 0), (0, 0, 1), (0, 0, 0)),
    ((0, -1, 0), (1, 0, 0), (0, 0, 0)),
    ((1, 0, 0), (0, 1, 0), (0, 0, 0)),
    ((1, 0, 0), (0, -1, 0), (0, 0, 0)),
    ((0, 1, 0), (1, 0, 0), (0, 0, 0)),
)
BASIS = PLANE.basis()
BIVECTORS = tuple(
    sum((a * (BASIS[i] ^ BASIS[3 + j]) for i, row in enumerate(matrix) for j, a in enumerate(row) if a), start=0)
    for matrix in GENERATORS
)
SIX, PAIR = array(SCALAR, 6), array(SCALAR, 2)
WEIGHTS = array(SCALAR, 3, 6)


def _generator(coefficients):
    return sum((c * b for c, b in zip(coefficients, BIVECTORS, strict=True)), start=0)


def _velocity(bivector, point):
    """Return the components of the commutator product of a bivector with a vector of the first null cone."""
    moved = (bivector * point - point * bivector) / 2
    return moved["w1"], moved["w2"]


def _columns(bivector):
    return [_velocity(bivector, PLANE.multivector({name: 1})) for name in ("w1", "w2", "w3")]


def _pairs(product):
    """Return the coefficients of xx, xy, x, yy, y, 1 of a bilinear form of homogeneous points."""
    return tuple(product(i, j) if i == j else product(i, j) + product(j, i) for i in range(3) for j in range(i, 3))


def _weights(bivector):
    """Return what `orbit_weights` computes."""
    c = _columns(bivector)
    both = _pairs(lambda i, j: c[i][0] * c[j][1])
    return _pairs(lambda i, j: c[i][0] * c[j][0]), tuple(2 * b for b in both), _pairs(lambda i, j: c[i][1] * c[j][1])


@kernel(generator=SIX, point=PAIR, returns=PAIR)
def orbit_velocity(generator, point):
    """Compute the velocity of a point along its orbit, the commutator product of the generator with the point."""
    x, y = point
    return _velocity(_generator(generator), PLANE.multivector({"w3": 1}) + x * PLANE.multivector({"w1": 1})
                     + y * PLANE.multivector({"w2": 1}))  # fmt: skip


@kernel(generator=SIX, point=PAIR, gradient=PAIR, returns=SCALAR)
def orbit_derivative(generator, point, gradient):
    """Compute the derivative along the orbit of a point: the velocity times the gradient."""
    velocity = orbit_velocity.function(generator, point)
    return velocity[0] * gradient[0] + velocity[1] * gradient[1]


@kernel(generator=SIX, returns=WEIGHTS)
def orbit_weights(generator):
    """Compute the weights of the moments in the orbit energy, the sum of squares of `orbit_derivative`."""
    return _weights(_generator(generator))


@kernel(generator=SIX, returns=WEIGHTS)
def bound_weights(generator):
    """Compute the weights of the moments in the sum of squared velocities times squared gradients.

    The orbit energy is at most this sum, and half of it if gradients have all directions.
    """
    pp, _, qq = _weights(_generator(generator))
    squares = tuple(a + b for a, b in zip(pp, qq, strict=True))
    return squares, (0,) * 6, squares


@kernel(moments=array(SCALAR, 7), returns=SIX)
def six_orbit_energies(moments):
    """Compute the orbit energies of the six generators.

    Parameters
    ----------
    moments
        ``pp``, ``qq``, ``pp xx``, ``pp yy``, ``pq xy``, ``qq xx`` and ``qq yy``: the others have the weight 0.
    """
    pp, qq, pp_xx, pp_yy, pq_xy, qq_xx, qq_yy = moments
    found = (pp_xx, 0, 0, pp_yy, 0, pp), (0, pq_xy, 0, 0, 0, 0), (qq_xx, 0, 0, qq_yy, 0, qq)

    def energy(bivector):
        rows = zip(_weights(bivector), found, strict=True)
        return sum(w * m for weights, row in rows for w, m in zip(weights, row, strict=True))

    return tuple(energy(bivector) for bivector in BIVECTORS)
