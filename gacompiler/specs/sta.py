"""Spacetime algebra G(1,3): vectors, fields and Lorentz transformations, with ``g0**2 = 1`` and ``c = 1``.

A bivector ``E1 g10 + E2 g20 + E3 g30 - B3 g12 + B2 g13 - B1 g23`` is the electromagnetic field ``E + I B``, with ``I =
g0123`` and the relative vectors ``gk g0`` of the observer g0. A rotor transforms every element by ``r x ~r``:
``exp(rapidity/2 gk0)`` boosts g0 along gk, and ``exp(angle/2 g12)`` rotates g1 towards g2. The product ``r s`` applies
``s`` first, and ``r`` and ``-r`` represent the same transformation. Angles are in radians, velocities are fractions of
the speed of light.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import STA, orthogonal
from gacompiler.specs.families.euclidean import rotors, vectors
from gacompiler.specs.families.products import products

VECTOR, BIVECTOR, ROTOR, EVEN = STA.VECTOR, STA.BIVECTOR, STA.ROTOR, STA.EVEN
RELATIVE = array(SCALAR, 3)

G0, G1, G2, G3 = STA.basis()
PRODUCTS = products(STA, EVEN, even_product=", such as spinors", versor="rotor")
VECTORS, ROTORS = vectors(STA), rotors(STA)


def _relative(x):
    """Return the relative vector ``x1 g10 + x2 g20 + x3 g30``."""
    return ga.assemble(STA, {"g10": x[0], "g20": x[1], "g30": x[2]})


def _unit(x):
    """Return ``x (x ~x)**(-1/2)``, with the root of positive real part of the complex number ``x ~x = s + p I``."""
    square = x * ~x
    s, p = square["1"], square["g0123"]
    size = ga.sqrt(s * s + p * p)
    real = ga.sqrt((size + s) / 2)
    return x * (real - p / (2 * real) * STA.pseudoscalar) / size


# Products, involutions and duals of general elements.

geometric_product = PRODUCTS.geometric_product
outer_product = PRODUCTS.outer_product
regressive_product = PRODUCTS.regressive_product
inner_product = PRODUCTS.inner_product
even_product = PRODUCTS.even_product
reverse = PRODUCTS.reverse
grade_involution = PRODUCTS.grade_involution
dual = PRODUCTS.dual
polarity = PRODUCTS.polarity
even_reverse = PRODUCTS.even_reverse


# Vectors.

vector_product = VECTORS.vector_product.documented(
    "Compute the geometric product of two vectors: their inner product plus the bivector ``a ^ b``."
)
dot_product = VECTORS.dot_product.documented("Compute the inner product ``a0 b0 - a1 b1 - a2 b2 - a3 b3``.")
wedge_vectors = VECTORS.wedge_vectors


@kernel(v=VECTOR)
def interval(v):
    """Compute the square of a vector: positive if timelike, negative if spacelike, 0 if lightlike."""
    return v * v


@kernel(v=VECTOR, returns=(SCALAR, RELATIVE))
def spacetime_split(v):
    """Split a vector into time and position for the observer g0: scalar and relative vector of ``v g0``."""
    split = v * G0
    return split["1"], (split["g10"], split["g20"], split["g30"])


@kernel(velocity=RELATIVE)
def proper_velocity(velocity):
    """Compute the proper velocity ``(1 + v) g0 / sqrt(1 - v**2)`` of a velocity slower than light."""
    x, y, z = velocity
    return (G0 + x * G1 + y * G2 + z * G3) / ga.sqrt(1 - x * x - y * y - z * z)


# Lorentz transformations.

rotor_product = ROTORS.rotor_product
rotor_inverse = ROTORS.rotor_inverse


@kernel(x=EVEN, returns=ROTOR)
def normalize_rotor(x):
    """Normalise an even element to a unit rotor: ``x (x ~x)**(-1/2)``, principal root of ``x ~x = s + p I``.

    Undefined if ``x ~x`` is 0 or a negative number.
    """
    return _unit(x)


@kernel(r=ROTOR, v=VECTOR)
def transform_vector(r, v):
    """Transform a vector by a unit rotor: ``r v ~r``."""
    return r * v * ~r


@kernel(r=ROTOR, f=BIVECTOR)
def transform_bivector(r, f):
    """Transform a bivector, such as a field, by a unit rotor: ``r f ~r``."""
    return r * f * ~r


@kernel(direction=RELATIVE, rapidity=SCALAR, returns=ROTOR)
def boost_from_rapidity(direction, rapidity):
    """Construct the boost along a nonzero direction that gives g0 the speed ``tanh(rapidity)``."""
    x, y, z = direction
    grown, shrunk = ga.exp(rapidity / 2), ga.exp(-rapidity / 2)
    factor = (grown - shrunk) / 2 / ga.sqrt(x * x + y * y + z * z)
    return (grown + shrunk) / 2 + factor * _relative(direction)


@kernel(velocity=RELATIVE, returns=ROTOR)
def boost_from_velocity(velocity):
    """Construct the boost of g0 to a velocity slower than light: ``1 + u g0``, normalised.

    u is the proper velocity.
    """
    x, y, z = velocity
    gamma = 1 / ga.sqrt(1 - x * x - y * y - z * z)
    return (1 + gamma + gamma * _relative(velocity)) / ga.sqrt(2 * (1 + gamma))


@kernel(a=VECTOR, b=VECTOR, returns=ROTOR)
def boost_between_velocities(a, b):
    """Compute the boost in the plane of two proper velocities that takes `a` to `b`: ``1 + b a``, normalised."""
    return (1 + b * a) / ga.sqrt(2 * (1 + ga.scalar_product(a, b)))


@kernel(axis=RELATIVE, angle=SCALAR, returns=ROTOR)
def rotor_from_axis_angle(axis, angle):
    """Construct the right-handed rotation of space, in radians, about an axis of any nonzero length."""
    x, y, z = axis
    factor = ga.sin(angle / 2) / ga.sqrt(x * x + y * y + z * z)
    return ga.cos(angle / 2) - factor * STA.pseudoscalar * _relative(axis)


rotor_exponential = ROTORS.rotor_exponential.documented(
    """Compute ``exp(b)`` of a bivector: rotation, boost, null rotation, or rotation and boost in commuting planes.

    Rapidities of up to 1400 do not overflow; errors are a few units in the last place of the largest coefficient.
    """
)
rotor_logarithm = ROTORS.rotor_logarithm.documented(
    """Compute the bivector of least angle with exponential `r` or `-r`, the same transformation.

    Every rotor has such a logarithm, including rotations, boosts and null rotations. At half turns, where the scalar
    part is 0, the two signs are equally near and the result is discontinuous.
    """
)
rotor_square_root = ROTORS.rotor_square_root.documented(
    "Compute the square root of `r` or `-r`, by the smaller angle; a half turn's sign decides."
)
rotor_power = ROTORS.rotor_power.documented(
    """Compute the power ``exp(t log(r))`` of a rotor, or of ``-r`` if the scalar part is negative.

    `t` is any real number: 0 gives the identity, 1 the transformation itself, -1 its inverse. The result is
    discontinuous at half turns.
    """
)
interpolate_rotors = ROTORS.interpolate_rotors.documented(
    "Interpolate between `a` (``t = 0``) and `b` or `-b` (``t = 1``) with a constant generator."
)


@kernel(r=ROTOR, returns=array(SCALAR, 4, 4))
def rotor_to_matrix(r):
    """Compute the 4 x 4 Lorentz matrix of a unit rotor, which acts on columns (t, x, y, z)."""
    columns = [r * axis * ~r for axis in (G0, G1, G2, G3)]
    return tuple(tuple(column[name] for column in columns) for name in ("g0", "g1", "g2", "g3"))


# Electromagnetism and spinors.


@kernel(e=RELATIVE, b=RELATIVE)
def field_from_electric_magnetic(e, b):
    """Construct the field ``E + I B`` from the electric and magnetic field measured by the observer g0."""
    return _relative(e) + STA.pseudoscalar * _relative(b)


@kernel(f=BIVECTOR, returns=(RELATIVE, RELATIVE))
def field_to_electric_magnetic(f):
    """Extract the electric and the magnetic field measured by the observer g0."""
    return (f["g10"], f["g20"], f["g30"]), (-f["g23"], f["g13"], -f["g12"])


@kernel(f=BIVECTOR, returns=(SCALAR, SCALAR))
def field_invariants(f):
    """Compute the invariants ``E**2 - B**2`` and ``E . B`` of a field, from ``F F = E**2 - B**2 + 2 I E . B``."""
    square = f * f
    return square["1"], square["g0123"] / 2


@kernel(f=BIVECTOR, u=VECTOR)
def lorentz_force(f, u):
    """Compute the rate of change of momentum of a unit charge of proper velocity `u` in the field `f`: ``F . u``."""
    return ga.right_contraction(f, u)


@kernel(f=BIVECTOR, n=VECTOR)
def field_stress_energy(f, n):
    """Compute the flux ``-F n F / 2`` of energy and momentum through the hypersurface with normal `n`.

    For ``n = g0`` it contains the energy density ``(E**2 + B**2)/2`` and the Poynting vector ``E x B``.
    """
    return -(f * n * f) / 2


@kernel(psi=EVEN)
def dirac_current(psi):
    """Compute the current ``psi g0 ~psi`` of a spinor."""
    return psi * G0 * ~psi


@kernel(psi=EVEN)
def dirac_spin(psi):
    """Compute the spin vector ``psi g3 ~psi`` of a spinor."""
    return psi * G3 * ~psi


# Fields of spacetime with the opposite signature, G(3,1): e4 is the time, with square -1 like the volume e123.

SPACETIME = orthogonal(3, 1, name="SPACETIME")
FIELD, COMPLEX = array(SCALAR, 16), array(SCALAR, 2)
ONE = SPACETIME.multivector({"1": 1})
*SPACE, TIME = SPACETIME.basis()
VOLUME = SPACE[0] * SPACE[1] * SPACE[2]


def _quaternion_basis(blade):
    """Return ``b``, ``b e123``, ``e4 b`` and ``e4 b e123``: the products of a blade with e4 on the left and e123 on the
    right.
    """
    return blade, blade * VOLUME, TIME * blade, TIME * blade * VOLUME


def _coordinate(f, blade):
    """Return the coefficient of `f` along plus or minus a basis blade."""
    ((bitmap, sign),) = blade.terms.items()
    return sign * f[SPACETIME.full.blades.index(SPACETIME.spelling(bitmap)[1])]


@kernel(f=FIELD, returns=(COMPLEX,) * 8)
def pack_spacetime(f):
    """Extract the eight complex numbers of an element of G(3,1), by blades of increasing grade; real parts first.

    The first four represent ``(f + e4 f e123)/2``, the last four ``(f - e4 f e123)/2``. The transform ``exp(-e4 s) f
    exp(-e123 t)`` multiplies the first by ``exp(-i (t - s))`` and the others by ``exp(-i (t + s))``.
    """
    plus, minus = [], []
    for blade in (ONE, *SPACE):
        a, b, c, d = (_coordinate(f, each) for each in _quaternion_basis(blade))
        plus.append((a + d, b - c))
        minus.append((a - d, b + c))
    return (*plus, *minus)


@kernel(p0=COMPLEX, p1=COMPLEX, p2=COMPLEX, p3=COMPLEX, m0=COMPLEX, m1=COMPLEX, m2=COMPLEX, m3=COMPLEX, returns=FIELD)
def unpack_spacetime(p0, p1, p2, p3, m0, m1, m2, m3):
    """Construct an element of G(3,1) from eight complex numbers: the inverse of `pack_spacetime`."""
    f = SPACETIME.multivector({})
    for blade, plus, minus in zip((ONE, *SPACE), (p0, p1, p2, p3), (m0, m1, m2, m3), strict=True):
        blades = _quaternion_basis(blade)
        parts = (plus[0] + minus[0], plus[1] + minus[1], minus[1] - plus[1], plus[0] - minus[0])
        f = f + sum(part / 2 * each for part, each in zip(parts, blades, strict=True))
    return tuple(f[name] for name in SPACETIME.full.blades)
