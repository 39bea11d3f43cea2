"""Networks of multivectors: activations and products of layers, with transposed derivatives.

Kernels whose names end with an algebra are products of all elements in an orthonormal basis, sorted by grade:
`complex` is G(0,1), `quaternion` G(0,2), `g2` G(2), `g3` G(3), `g301` G(3,0,1), where the null vector is last, and
`g13` is G(1,3), where the vector with the square 1 is first.
The products by tables are those of any algebra; their transposed derivatives are the same kernels with exchanged
tables.
Kernels with the suffix `pull` return the gradients for a cotangent.
"""

from fractions import Fraction

from gacompiler import SCALAR, array, each, exp, gather, index, kernel, scatter, sqrt, total, vjp
from gacompiler.algebra.catalog import orthogonal
from gacompiler.specs.families.layers import layers

TINY = Fraction(1, 10**30)
"""Added to squared norms, so that their roots have derivatives; not zero in float32."""
NUMBERS = array(SCALAR, "n")

for _sizes, _name in (((0, 1), "complex"), ((0, 2), "quaternion"), ((2,), "g2"), ((3,), "g3"), ((3, 0, 1), "g301"),
                       ((1, 3), "g13")):  # fmt: skip
    globals().update(layers(orthogonal(*_sizes), f"_{_name}"))


@kernel(
    a=array(SCALAR, "p"), b=array(SCALAR, "q"), w=array(SCALAR, "s"),
    left=index("t", into="p"), right=index("t", into="q"), path=index("t", into="s"),
    sign=array(SCALAR, "t", shared=True), target=index("t", into="r"), zero=array(SCALAR, "r", shared=True),
    returns=array(SCALAR, "r"),
)  # fmt: skip
def weighted_by_table(a, b, w, left, right, path, sign, target, zero):
    """Sum the terms ``sign a[left] b[right] w[path]`` into the coefficients `target`; `zero` contains zeros."""
    terms = each(lambda factor, x, y, z: factor * x * y * z, sign, gather(a, left), gather(b, right), gather(w, path))
    return scatter(terms, target, zero)


COLUMN = array(SCALAR, 4)


@kernel(a=array(SCALAR, 8), returns=(COLUMN, COLUMN))
def columns_g3(a):
    """Compute the columns of the matrix of an element of G(3), in which e1, e2 and e3 are the matrices of Pauli.

    A column is the coefficients of ``a (1 + e3)`` or ``a (1 - e3) e1`` in a left ideal. Its complex numbers are pairs
    of real and imaginary parts.
    """
    s, x, y, z, xy, xz, yz, xyz = a
    return (s + z, xy + xyz, x + xz, y + yz), (x - xz, yz - y, s - z, xyz - xy)


@kernel(first=COLUMN, second=COLUMN, offset=array(SCALAR, 8), returns=array(SCALAR, 8))
def elements_g3(first, second, offset):
    """Compute an offset plus the transpose of `columns_g3`, which is twice its inverse."""
    (a, b, c, d), (e, f, g, h), (s, x, y, z, xy, xz, yz, xyz) = first, second, offset
    return (
        s + (a + g), x + (c + e), y + (d - f), z + (a - g), xy + (b - h), xz + (c - e), yz + (d + f), xyz + (b + h)
    )  # fmt: skip


@kernel(first=COLUMN, second=COLUMN, y=array(SCALAR, 8), returns=(COLUMN, COLUMN))
def tanh_columns_g3(first, second, y):
    """Compute the columns of the gradient of a hyperbolic tangent by coefficient, from its value y.

    `first` and `second` are the columns of the cotangent, as for `elements_g3`.
    """
    cotangent = elements_g3.function(first, second, (0,) * 8)
    return columns_g3.function(tuple(d * (1 - c * c) for d, c in zip(cotangent, y, strict=True)))


@kernel(y=SCALAR, cotangent=SCALAR, returns=SCALAR)
def tanh_pull(y, cotangent):
    """Compute the gradient of ``cotangent * tanh(x)`` from the value y of the hyperbolic tangent."""
    return cotangent * (1 - y * y)


@kernel(x=SCALAR, returns=SCALAR)
def silu(x):
    """Compute x times the logistic function of x."""
    return x / (1 + exp(-x))


@kernel(x=SCALAR, cotangent=SCALAR, returns=SCALAR)
def silu_pull(x, cotangent):
    """Compute the gradient of ``cotangent * silu(x)``."""
    gate = 1 / (1 + exp(-x))
    return cotangent * gate * (1 + x * (1 - gate))


@kernel(x=NUMBERS, slope=SCALAR, bound=SCALAR, returns=NUMBERS)
def bounded(x, slope, bound):
    """Compute ``x / (slope + |x| / bound)``, the activation of Georgiou and Koutsougeras."""
    size = sqrt(total(lambda c: c * c, x) + TINY)
    factor = 1 / (slope + size / bound)
    return each(lambda c: c * factor, x)


bounded_vjp_x = vjp(bounded, "x")
