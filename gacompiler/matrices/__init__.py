"""Matrices in kernels: products, factorizations, eigenvalues, singular values and roots of polynomials.

The functions take arrays of scalars over one or two named lengths, such as ``array(SCALAR, "n", "n")``, and are written
with the loops of kernels. Kernels that use them are proved, counted, differentiated and printed like others, and the
elements of a batch are computed in vector lanes.
"""

from ..frontend.loops import transpose as transpose
from .definite import cholesky as cholesky
from .definite import ldlt as ldlt
from .definite import solve_positive as solve_positive
from .fixed import entries as entries
from .fixed import fixed as fixed
from .orthogonal import determinant as determinant
from .orthogonal import least_squares as least_squares
from .orthogonal import qr as qr
from .polynomials import Complex as Complex
from .polynomials import aberth_step as aberth_step
from .polynomials import complex_product as complex_product
from .polynomials import roots as roots
from .products import dot as dot
from .products import gram as gram
from .products import identity as identity
from .products import product as product
from .products import times as times
from .singular import null_vector as null_vector
from .singular import singular_values as singular_values
from .singular import singular_vectors as singular_vectors
from .symmetric import eigenvalues as eigenvalues
from .symmetric import eigenvectors as eigenvectors
from .three import three_singular_vectors as three_singular_vectors
from .triangular import solve_lower as solve_lower
from .triangular import solve_upper as solve_upper
