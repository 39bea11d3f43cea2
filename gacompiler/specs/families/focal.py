"""The equations of fundamental matrices of two cameras with the same unknown focal length."""

from itertools import product

from gacompiler.specs.families.essential import Polynomial, sum_of

MONOMIALS = ((3, 0), (2, 1), (1, 2), (0, 3), (2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0))
"""The powers of x and y."""


def products_of_views(basis):
    """Return the coefficients of ``1, w, w^2`` of ten equations of ``x X + y Y + Z``, each of ten monomials.

    They are the determinant and the entries of ``2 F Q F' Q F - tr(F Q F' Q) F`` with ``Q = diag(1, 1, w)``.
    """
    powers = [(1, 0, 0), (0, 1, 0), (0, 0, 0)]
    f = [
        [Polynomial({p: b[3 * i + j] for p, b in zip(powers, basis, strict=True)}) for j in range(3)] for i in range(3)
    ]
    w = Polynomial({(0, 0, 1): 1})
    outer = {}
    for i, j in product(range(3), repeat=2):
        if i <= j:
            outer[i, j] = f[i][0] * f[j][0] + f[i][1] * f[j][1] + w * f[i][2] * f[j][2]
    trace = outer[0, 0] + outer[1, 1] + w * outer[2, 2]
    table = [[outer[min(i, j), max(i, j)] for j in range(3)] for i in range(3)]
    found = []
    for i, j in product(range(3), repeat=2):
        cubic = table[i][0] * f[0][j] + table[i][1] * f[1][j] + w * table[i][2] * f[2][j]
        found.append(cubic.times(2) - trace * f[i][j])
    minors = [f[1][a] * f[2][b] - f[1][b] * f[2][a] for a, b in ((1, 2), (2, 0), (0, 1))]
    found.append(sum_of(f[0][k] * minors[k] for k in range(3)))
    return tuple(
        tuple(tuple(each.terms.get((*powers, k), 0) for powers in MONOMIALS) for each in found) for k in range(3)
    )
