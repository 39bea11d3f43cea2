"""What further terms explain of residuals across the derivatives by the parameters of a model."""

from fractions import Fraction

import gacompiler as ga
from gacompiler import maximum, select, sqrt
from gacompiler.specs.families.covariances import dot
from gacompiler.specs.families.descents import TINY

HELD = Fraction(1, 10**9)
"""What is added to a diagonal of ones, so that terms that the parameters replace have no coefficients."""


def explained_of(sums, n):
    """Return the sum of squares of residuals, the rest across the derivatives, and what all terms and the best explain.

    Parameters
    ----------
    sums
        The matrix of sums of products of `n` derivatives, of the terms, and of the residual.
    """
    last = len(sums) - 1
    n_terms = last - n
    size = [*(1 / sqrt(maximum(sums[i][i], TINY)) for i in range(last)), 1]
    scaled = [[size[i] * size[j] * sums[i][j] for j in range(last + 1)] for i in range(last + 1)]
    own = [[scaled[i][j] + (HELD if i == j else 0) for j in range(n)] for i in range(n)]
    moves, _ = ga.solve_symmetric(own, [row[n:] for row in scaled[:n]])
    rest = [
        [scaled[i][j] - sum((scaled[m][i] * moves[m][j - n] for m in range(n)), 0) for j in range(n, last + 1)]
        for i in range(n, last + 1)
    ]
    side = [row[n_terms] for row in rest[:n_terms]]
    open_ = [[row[j] + (HELD if i == j else 0) for j in range(n_terms)] for i, row in enumerate(rest[:n_terms])]
    found, _ = ga.solve_symmetric(open_, side)
    most = 0
    for i, slope in enumerate(side):
        most = maximum(most, select(rest[i][i] > HELD, slope * slope / maximum(rest[i][i], HELD), 0))
    return sums[last][last], rest[n_terms][n_terms], dot(found, side), most
