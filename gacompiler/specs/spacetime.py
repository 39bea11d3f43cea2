"""Fields and spinors of space and spacetime: steps of Maxwell's equations, plane waves, Pauli and Dirac spinors.

Space is G(3), spacetime is G(1,3) with ``g0**2 = 1``; ``c = 1`` and ``hbar = 1``. Fields are ``F = E + I B``, with the
layouts and signs of `sta`. A Pauli spinor is an even element of G(3), a Dirac spinor an even element of G(1,3)
(Hestenes); the imaginary unit of column spinors is multiplication by ``I s3`` from the right, with the relative vectors
``sk = gk g0``. Columns and matrices are in the Dirac representation, with complex numbers as (real, imaginary).
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import STA, VGA3

COMPLEX, RELATIVE = array(SCALAR, 2), array(SCALAR, 3)
TWO, FOUR = array(SCALAR, 2, 2, 2), array(SCALAR, 4, 4, 2)

E1, E2, E3 = VGA3.basis()
G0, G1, G2, G3 = STA.basis()
SPIN_PLANE = E1 * E2
SIGMA3 = G3 * G0
I_SIGMA3 = STA.pseudoscalar * SIGMA3

ROOT_3_BY_6 = Fraction("0.28867513459481288225457439")

PAULI = (((0, 1), (1, 0)), ((0, -1j), (1j, 0)), ((1, 0), (0, -1)))
"""The matrices of the vectors of space."""


def _times(a, b):
    """Return the product of two square matrices of numbers."""
    return tuple(
        tuple(sum(x * y for x, y in zip(row, column, strict=True)) for column in zip(*b, strict=True)) for row in a
    )


def _dirac():
    """Return the matrices of g0 to g3, with lower index: ``diag(1, -1)``, and Pauli's off the diagonal, negative above
    it.
    """
    time = tuple(tuple((1 if i < 2 else -1) if i == j else 0 for j in range(4)) for i in range(4))
    upper = [tuple((0, 0, *(-x for x in row)) for row in small) for small in PAULI]
    lower = [tuple((*row, 0, 0) for row in small) for small in PAULI]
    return time, *(above + below for above, below in zip(upper, lower, strict=True))


def _blade_matrices(algebra, generators):
    """Return the matrix of each basis blade, by its name."""
    size = len(generators[0])
    found = {}
    for name in algebra.full.blades:
        ((bitmap, sign),) = algebra.multivector({name: 1}).terms.items()
        matrix = tuple(tuple(int(i == j) * int(sign) for j in range(size)) for i in range(size))
        for k, one in enumerate(generators):
            if bitmap >> k & 1:
                matrix = _times(matrix, one)
        found[name] = matrix
    return found


def _real(z):
    return int(complex(z).real)


def _imaginary(z):
    return int(complex(z).imag)


def _to_matrix(a, matrices, size):
    """Return the matrix of an element, with entries as (real, imaginary)."""
    return tuple(
        tuple(
            tuple(
                sum(part(matrix[i][j]) * a[name] for name, matrix in matrices.items()) for part in (_real, _imaginary)
            )
            for j in range(size)
        )
        for i in range(size)
    )


def _from_matrix(m, algebra, matrices, size):
    """Return the coefficients ``Re tr(blade^H m) / size``; matrices of blades are unitary and mutually orthogonal."""
    places = [(i, j) for i in range(size) for j in range(size)]
    return ga.assemble(
        algebra,
        {
            name: sum(_real(x[i][j]) * m[i][j][0] + _imaginary(x[i][j]) * m[i][j][1] for i, j in places) / size
            for name, x in matrices.items()
        },
    )


PAULI_BLADES, DIRAC_BLADES = _blade_matrices(VGA3, PAULI), _blade_matrices(STA, _dirac())


def _spinor(scalar, x, y, z):
    """Return the even element ``scalar + I (x s1 + y s2 + z s3)`` of spacetime."""
    return scalar + STA.pseudoscalar * (x * G1 + y * G2 + z * G3) * G0


def _in_spacetime(phi):
    """Return a Pauli spinor as an even element of spacetime: e1, e2, e3 are the relative vectors."""
    return _spinor(phi["1"], phi["e23"], -phi["e13"], phi["e12"])


def _turned(phase):
    """Return the imaginary exponential ``exp(-I s3 phase)``."""
    return ga.cos(phase) - ga.sin(phase) * I_SIGMA3


# Electromagnetic fields.


@kernel(e=VGA3.VECTOR, b=VGA3.BIVECTOR, bx=VGA3.BIVECTOR, by=VGA3.BIVECTOR, bz=VGA3.BIVECTOR, ratio=RELATIVE)
def electric_step(e, b, bx, by, bz, ratio):
    """Advance the electric field of a cell of a Yee grid by a step: ``e - ratio_k e_k . (b - b_k)``, no currents.

    `b` is the magnetic bivector ``I B`` of the cell, `bx`, `by`, `bz` are those of the preceding cells along the axes,
    and `ratio` is the time step divided by the space steps.
    """
    before = zip(ratio, (E1, E2, E3), (bx, by, bz), strict=True)
    return e - sum(r * ga.left_contraction(axis, b - other) for r, axis, other in before)


@kernel(b=VGA3.BIVECTOR, e=VGA3.VECTOR, ex=VGA3.VECTOR, ey=VGA3.VECTOR, ez=VGA3.VECTOR, ratio=RELATIVE)
def magnetic_step(b, e, ex, ey, ez, ratio):
    """Advance the magnetic bivector ``I B`` of a cell of a Yee grid by a step: ``b - ratio_k e_k ^ (e_k - e)``.

    `e` is the electric field of the cell, `ex`, `ey`, `ez` are those of the following cells along the axes.
    """
    after = zip(ratio, (E1, E2, E3), (ex, ey, ez), strict=True)
    return b - sum(r * (axis ^ (other - e)) for r, axis, other in after)


@kernel(k=STA.VECTOR, a=STA.VECTOR, b=STA.VECTOR, x=STA.VECTOR)
def electromagnetic_wave(k, a, b, x):
    """Compute the plane wave ``k ^ a cos(k . x) + k ^ b sin(k . x)`` at the event `x`.

    It solves Maxwell's equations if `k` is lightlike and orthogonal to `a` and `b`.
    """
    phase = ga.scalar_product(k, x)
    return (k ^ a) * ga.cos(phase) + (k ^ b) * ga.sin(phase)


@kernel(
    ft=STA.BIVECTOR, fx=STA.BIVECTOR, fy=STA.BIVECTOR, fz=STA.BIVECTOR, returns=(STA.VECTOR, STA.TRIVECTOR)
)  # fmt: skip
def field_derivative(ft, fx, fy, fz):
    """Compute the vector and trivector parts of the derivative ``D F`` of a field, from its four partial derivatives.

    By Maxwell's equation ``D F = J``, the vector part is the current ``(rho + j) g0`` and the trivector part is 0.
    """
    derivative = G0 * ft - G1 * fx - G2 * fy - G3 * fz
    return ga.grade(derivative, 1), ga.grade(derivative, 3)


@kernel(at=STA.VECTOR, ax=STA.VECTOR, ay=STA.VECTOR, az=STA.VECTOR)
def field_from_potential(at, ax, ay, az):
    """Compute the field ``D ^ A`` of a vector potential, from its four partial derivatives."""
    return (G0 ^ at) - (G1 ^ ax) - (G2 ^ ay) - (G3 ^ az)


# Pauli spinors.


@kernel(up=COMPLEX, down=COMPLEX, returns=VGA3.EVEN)
def pauli_from_column(up, down):
    """Convert the column ``(a0 + i a3, -a2 + i a1)`` to the Pauli spinor ``a0 + I (a1 e1 + a2 e2 + a3 e3)``."""
    return ga.assemble(VGA3, {"1": up[0], "e12": up[1], "e13": down[0], "e23": down[1]})


@kernel(psi=VGA3.EVEN, returns=(COMPLEX, COMPLEX))
def pauli_to_column(psi):
    """Convert a Pauli spinor to the upper and the lower number of its column."""
    return (psi["1"], psi["e12"]), (psi["e13"], psi["e23"])


@kernel(a=VGA3.full, returns=TWO)
def pauli_to_matrix(a):
    """Compute the 2 x 2 matrix of an element of G(3): vectors map to Pauli matrices, products to products."""
    return _to_matrix(a, PAULI_BLADES, 2)


@kernel(m=TWO, returns=VGA3.full)
def pauli_from_matrix(m):
    """Convert a complex 2 x 2 matrix to an element of G(3)."""
    return _from_matrix(m, VGA3, PAULI_BLADES, 2)


@kernel(psi=VGA3.EVEN)
def pauli_density(psi):
    """Compute the density ``psi ~psi`` of a Pauli spinor: the squared length of its column."""
    return ga.norm_squared(psi)


@kernel(psi=VGA3.EVEN)
def pauli_spin(psi):
    """Compute the spin vector ``psi e3 ~psi``: the expectation values of the Pauli matrices."""
    return psi * E3 * ~psi


@kernel(psi=VGA3.EVEN, first=VGA3.VECTOR, second=VGA3.VECTOR)
def precession_step(psi, first, second):
    """Advance a Pauli spinor by a step of ``d psi/dt = I w psi / 2``, using the rotor of the Magnus expansion.

    `first` and `second` are the vectors ``w``, times the time step, at the fractions ``1/2 -+ sqrt(3)/6`` of the step.
    The result is exact if they are parallel; otherwise the error of a step is of fifth order in it.
    """
    a, b = (VGA3.pseudoscalar * w / 2 for w in (first, second))
    return ga.exp((a + b) / 2 - ROOT_3_BY_6 * ga.commutator(a, b)) * psi


# Dirac spinors.


@kernel(c0=COMPLEX, c1=COMPLEX, c2=COMPLEX, c3=COMPLEX, returns=STA.EVEN)
def dirac_from_column(c0, c1, c2, c3):
    """Convert a column to the Dirac spinor ``phi + eta s3``; the halves are columns of Pauli spinors phi and eta."""
    phi, eta = _spinor(c0[0], c1[1], -c1[0], c0[1]), _spinor(c2[0], c3[1], -c3[0], c2[1])
    return phi + eta * SIGMA3


@kernel(psi=STA.EVEN, returns=(COMPLEX,) * 4)
def dirac_to_column(psi):
    """Convert a Dirac spinor to the four numbers of its column."""
    upper, lower = (psi + G0 * psi * G0) / 2, (psi - G0 * psi * G0) / 2 * SIGMA3
    return tuple(pair for half in (upper, lower) for pair in ((half["1"], -half["g12"]), (-half["g13"], -half["g23"])))


@kernel(a=STA.full, returns=FOUR)
def dirac_to_matrix(a):
    """Compute the 4 x 4 matrix of an element of G(1,3): vectors map to Dirac matrices, products to products."""
    return _to_matrix(a, DIRAC_BLADES, 4)


@kernel(m=FOUR, returns=STA.full)
def dirac_from_matrix(m):
    """Compute the element of G(1,3) nearest to a complex 4 x 4 matrix; only half of these represent elements."""
    return _from_matrix(m, STA, DIRAC_BLADES, 4)


@kernel(p=STA.VECTOR, spin=VGA3.EVEN, x=STA.VECTOR, returns=STA.EVEN)
def dirac_wave(p, spin, x):
    """Compute the plane wave ``L phi exp(-I s3 p . x)`` of momentum `p`.

    L boosts the rest frame to `p`, and phi is the Pauli spinor at rest. The mass is ``sqrt(p p)``, the energy is
    positive.
    """
    mass = ga.sqrt(ga.scalar_product(p, p))
    boost = (mass + p * G0) / ga.sqrt(2 * mass * (mass + p["g0"]))
    return boost * _in_spacetime(spin) * _turned(ga.scalar_product(p, x))


@kernel(p=STA.VECTOR, spin=VGA3.EVEN, x=STA.VECTOR, returns=STA.EVEN)
def dirac_antiparticle_wave(p, spin, x):
    """Compute the plane wave ``L phi s3 exp(I s3 p . x)`` of an antiparticle of momentum `p`."""
    mass = ga.sqrt(ga.scalar_product(p, p))
    boost = (mass + p * G0) / ga.sqrt(2 * mass * (mass + p["g0"]))
    return boost * _in_spacetime(spin) * SIGMA3 * _turned(-ga.scalar_product(p, x))


@kernel(psi=STA.EVEN, returns=(SCALAR, SCALAR))
def dirac_density(psi):
    """Compute the scalar and the pseudoscalar part of ``psi ~psi = rho exp(I beta)``."""
    square = psi * ~psi
    return square["1"], square["g0123"]


@kernel(psi=STA.EVEN)
def dirac_spin_bivector(psi):
    """Compute the spin bivector ``psi I s3 ~psi`` of a Dirac spinor."""
    return psi * I_SIGMA3 * ~psi


@kernel(
    dt=STA.EVEN, dx=STA.EVEN, dy=STA.EVEN, dz=STA.EVEN, psi=STA.EVEN, a=STA.VECTOR, mass=SCALAR,
    returns=array(SCALAR, 8),
)  # fmt: skip
def dirac_residual(dt, dx, dy, dz, psi, a, mass):
    """Compute the residual ``D psi I s3 - a psi - m psi g0`` of the Dirac equation from partial derivatives of `psi`.

    `a` is the charge times the vector potential. The result contains the coefficients of ``g0 g1 g2 g3 g012 g013 g023
    g123``.
    """
    rest = (G0 * dt - G1 * dx - G2 * dy - G3 * dz) * I_SIGMA3 - a * psi - mass * psi * G0
    return tuple(rest[name] for name in ("g0", "g1", "g2", "g3", "g012", "g013", "g023", "g123"))
