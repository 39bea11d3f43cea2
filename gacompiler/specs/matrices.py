"""Eigenvectors, null vectors, singular vectors, roots of polynomials and products, for matrices of any size.

The methods are those of `gacompiler.matrices`. Every kernel takes leading axes; batches are computed in vector lanes.
"""

from gacompiler import SCALAR, array, each, kernel, matrices, total, transpose

SQUARE, MATRIX, VECTOR = array(SCALAR, "n", "n"), array(SCALAR, "n", "m"), array(SCALAR, "n")


@kernel(matrix=SQUARE)
def eigenvectors(matrix):
    """Compute the eigenvalues of a symmetric matrix, in ascending order, and eigenvectors as columns.

    Returns
    -------
    values
    vectors
    converged
        1 if the results are valid.
    """
    return matrices.eigenvectors(matrix)


@kernel(matrix=MATRIX)
def singular_vectors(matrix):
    """Compute the singular values of a matrix, in descending order, and the right singular vectors as columns.

    Returns
    -------
    values
    vectors
    converged
        1 if the results are valid.
    """
    return matrices.singular_vectors(matrix)


@kernel(matrix=MATRIX)
def null_vector(matrix):
    """Compute the unit vector x with the smallest norm of ``matrix x``.

    Returns
    -------
    vector
    second, last
        The second smallest and the smallest singular value, divided by the largest.
    """
    return matrices.null_vector(matrix)


@kernel(coefficients=VECTOR)
def polynomial_roots(coefficients):
    """Compute the roots of a real polynomial from the coefficients after the first, which is 1.

    Returns
    -------
    real, imaginary
        The parts of the roots.
    n_real
        The number of real roots.
    converged
        1 if the value of the polynomial at each root is rounding.
    """
    return matrices.roots(coefficients)


@kernel(inverse=SQUARE, by_x=MATRIX, by_y=MATRIX, returns=(MATRIX, MATRIX))
def derivatives_of_solution(inverse, by_x, by_y):
    """Compute the derivatives of the solution v of ``matrix v = right``, for the inverse matrix.

    Parameters
    ----------
    inverse
    by_x, by_y
        The derivatives of ``matrix v - right`` for a constant v.

    Returns
    -------
    two matrices
        The products of the inverse with both, times -1.
    """

    def product(changes):
        columns = transpose(changes)
        return each(lambda row: each(lambda column: -total(lambda x, y: x * y, row, column), columns), inverse)

    return product(by_x), product(by_y)
