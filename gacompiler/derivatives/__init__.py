"""Derivatives and matrices of kernels, with and without loops, as kernels.

`jvp`, `vjp`, `jacobian`, `hessian_vector` and `matrix_of` return kernels. They are compiled, counted and proved like
other kernels, and can be differentiated again.

Without loops, a derivative is an expression (`rules`). The derivative of a kernel with loops is defined as that of the
unrolled function, for arrays of known lengths. It is compiled from the traced statements of the kernel. There are few
kinds of statements (straight-line parts, addition, copying and clearing of rows, loops), and their derivatives are
statements of the same kinds, so that derivatives can be differentiated. `forward` adds a table of derivatives to every
table. `reverse` runs the loops while it stores values that are overwritten, and then runs the transposed statements in
reverse order. Both record statements like loop functions do (`replay`). As for every kernel with loops, compilation
compares the derivative with its definition.
"""

from .derived_kernels import hessian_vector as hessian_vector
from .derived_kernels import jacobian as jacobian
from .derived_kernels import jvp as jvp
from .derived_kernels import matrix_of as matrix_of
from .derived_kernels import vjp as vjp
from .rules import derivative as derivative
