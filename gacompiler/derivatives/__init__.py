"""Derivatives and matrices of kernels, with and without loops, as kernels.

`jvp`, `vjp`, `jacobian`, `hessian_vector` and `matrix_of` give kernels, which are compiled, counted and proved like any
other, and can be differentiated again.

Without loops a derivative is an expression (`rules`). For a kernel with loops that defines what its derivative is: the
derivative of the same function written out for arrays of known lengths. What is compiled comes from the statements that
the kernel was traced to. They form a small set (a straight-line part, adding a row to another, copying, clearing,
loops), and derivatives of them are statements of the set again, so derivatives can be differentiated. `forward` gives
every table a second one of derivatives. `reverse` runs the loops, keeping what is overwritten, and then the transposed
statements in reverse order. Both record statements as loop functions do (`replay`), and compiling the derivative
compares them with the definition, as for every kernel with loops.
"""

from .kernels import hessian_vector as hessian_vector
from .kernels import jacobian as jacobian
from .kernels import jvp as jvp
from .kernels import matrix_of as matrix_of
from .kernels import vjp as vjp
from .rules import derivative as derivative
