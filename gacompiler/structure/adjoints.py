"""Involutions of an algebra as operations on its matrices, such as the effect of reversion on a matrix.

Basis vectors have matrices with one unit in each row, so that the adjoint (transposed, with conjugate entries) of a
vector is its inverse: plus or minus itself. Reversion and Clifford conjugation are that adjoint, conjugated by a blade.
If no such blade exists, for odd dimensions, complex entries are not conjugated, or the halves are exchanged (Porteous
1995, ch. 17; Lounesto 2001, ch. 18).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ..algebra.involutions import clifford_conjugate, grade_involution, reverse
from ..algebra.multivector import Multivector
from ..algebra.versors import inverse
from ..errors import AlgebraError
from .representation import Matrices, Representation

MEANINGS: Mapping[str, Callable[[Multivector], Multivector]] = {
    "reverse": reverse,
    "grade_involution": grade_involution,
    "clifford_conjugate": clifford_conjugate,
}


@dataclass(frozen=True, slots=True)
class MatrixInvolution:
    """``X -> S f(X) S**-1``, where ``f`` is composed of transposition, conjugation and exchange of halves.

    Attributes
    ----------
    representation : Representation
    similarity : Multivector
        The blade ``S``.
    is_transposed : bool
        Whether rows and columns are exchanged: reversion and Clifford conjugation, which reverse products.
    is_conjugated : bool
        Whether i, j and k change their signs.
    is_swapped : bool
        Whether the halves are exchanged.
    """

    representation: Representation
    similarity: Multivector
    is_transposed: bool
    is_conjugated: bool
    is_swapped: bool

    def __call__(self, matrices: Matrices) -> Matrices:
        """Return the matrices of the involution of an element, from its matrices."""
        representation = self.representation
        left = representation.matrix(self.similarity)
        right = representation.matrix(inverse(self.similarity))
        inner = _exchanged(matrices, self.is_transposed, self.is_conjugated, self.is_swapped)
        return representation.product(representation.product(left, inner), right)

    def __str__(self) -> str:
        """Return the formula, with ``S`` given by its blade."""
        inner = "X" + ("^T" if self.is_transposed else "")
        inner = f"conj({inner})" if self.is_conjugated else inner
        inner = f"swap({inner})" if self.is_swapped else inner
        return inner if self.similarity == 1 else f"S {inner} S^-1 with S = {self.similarity}"


def matrix_involution(representation: Representation, name: str) -> MatrixInvolution:
    """Return the operation on matrices that corresponds to an involution.

    Parameters
    ----------
    representation : Representation
        With an orthogonal, nondegenerate basis.
    name : {"reverse", "grade_involution", "clifford_conjugate"}

    Raises
    ------
    AlgebraError
        For another name or another basis.
    """
    algebra = representation.algebra
    if name not in MEANINGS:
        raise AlgebraError("matrix_involution", f"no involution {name}", "one of " + " ".join(MEANINGS))
    if any((i != j) == bool(x) for i, row in enumerate(algebra.gram) for j, x in enumerate(row)):
        raise AlgebraError(
            f"matrix_involution in {algebra.name}",
            "a basis that is degenerate or not orthogonal",
            "squares +1 and -1",
            "use orthogonal(p, q)",
        )
    transposed = name != "grade_involution"
    wanted = MEANINGS[name](algebra.basis()[0])[1] if algebra.dimension else 1
    halves, _, _, parts = representation.shape
    for swapped in (False, True)[:halves]:
        for conjugated in (transposed, not transposed) if parts == 2 else (transposed and parts > 1,):
            signs = []
            for generator in representation.generators:
                image = _exchanged(generator, transposed, conjugated, swapped)
                signs.append(1 if np.array_equal(image, wanted * generator) else -1)
            blade = _similarity(signs)
            if blade is not None:
                return MatrixInvolution(
                    representation, Multivector(algebra, {blade: 1}), transposed, conjugated, swapped
                )
    raise AlgebraError(f"matrix_involution in {algebra.name}", "no blade between the adjoint and the involution")


def _exchanged(matrices: Matrices, transposed: bool, conjugated: bool, swapped: bool) -> Matrices:
    found = matrices.swapaxes(1, 2) if transposed else matrices
    if conjugated:
        found = np.concatenate([found[..., :1], -found[..., 1:]], axis=-1)
    return found[::-1] if swapped else found


def _similarity(signs: list[int]) -> int | None:
    """Return the blade by which conjugation gives every basis vector its sign: ``S e S**-1 = sign e``.

    A vector anticommutes with an even blade that contains it, and with an odd blade that does not.
    """
    minus = sum(1 << k for k, sign in enumerate(signs) if sign < 0)
    plus = (1 << len(signs)) - 1 ^ minus
    if not minus.bit_count() & 1:
        return minus
    return plus if plus.bit_count() & 1 else None
