"""Eigenvectors, null vectors, singular vectors and roots of polynomials, for matrices of any size.

The methods are those of `gacompiler.matrices`. Every kernel takes leading axes; batches are computed in vector lanes.
"""

from gacompiler import SCALAR, array, kernel, matrices

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
