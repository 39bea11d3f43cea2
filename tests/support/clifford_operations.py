"""Operations of clifford on operands in a file, run as a program without numba, which would compile for minutes.

``python -m clifford_operations operands.pickle results.pickle`` reads coefficients by space and operand, and writes
those of all results. Each space has the Gram matrix of its vectors; clifford's vectors are orthogonal.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

OPERATIONS: dict[str, tuple[str, Callable[..., Any]]] = {
    "a * b": ("a b", lambda a, b: a * b),
    "a ^ b": ("a b", lambda a, b: a ^ b),
    "a | b": ("a b", lambda a, b: a | b),
    "a & b": ("a b", lambda a, b: a & b),
    "a.vee(b)": ("a b", lambda a, b: a.vee(b)),
    "a << b": ("a b", lambda a, b: a << b),
    "a.lc(b)": ("B a", lambda a, b: a.lc(b)),
    "a + b": ("a B", lambda a, b: a + b),
    "a - b": ("v a", lambda a, b: a - b),
    "-a": ("a", lambda a: -a),
    "+a": ("a", lambda a: +a),
    "a + 2": ("B", lambda a: a + 2),
    "2 - a": ("v", lambda a: 2 - a),
    "s * a": ("s a", lambda s, a: s * a),
    "a / s": ("a s", lambda a, s: a / s),
    "a / v": ("a v", lambda a, v: a / v),
    "2 / v": ("v", lambda v: 2 / v),
    "a ^ 2": ("a", lambda a: a ^ 2),
    "a | 2": ("a", lambda a: a | 2),
    "a ** 0": ("a", lambda a: a**0),
    "a ** 2": ("a", lambda a: a**2),
    "a ** 3": ("c", lambda a: a**3),
    "2 ** B": ("small", lambda a: 2**a),
    "~a": ("a", lambda a: ~a),
    "a.adjoint()": ("V", lambda a: a.adjoint()),
    "a.gradeInvol()": ("a", lambda a: a.gradeInvol()),
    "a.conjugate()": ("a", lambda a: a.conjugate()),
    "a.even": ("a", lambda a: a.even),
    "a.odd": ("a", lambda a: a.odd),
    "a(0)": ("a", lambda a: a(0)),
    "a(1)": ("a", lambda a: a(1)),
    "a(1, 2)": ("a", lambda a: a(1, 2)),
    "a.mag2()": ("a", lambda a: a.mag2()),
    "abs(a)": ("a", abs),
    "a.normal()": ("R", lambda a: a.normal()),
    "v.normal()": ("v", lambda a: a.normal()),
    "v.inv()": ("v", lambda a: a.inv()),
    "R.inv()": ("R", lambda a: a.inv()),
    "V.normalInv()": ("V", lambda a: a.normalInv()),
    "a.inv()": ("a", lambda a: a.inv()),
    "a.hitzer_inverse()": ("a", lambda a: a.hitzer_inverse()),
    "a.shirokov_inverse()": ("a", lambda a: a.shirokov_inverse()),
    "a.leftLaInv()": ("a", lambda a: a.leftLaInv()),
    "a.dual()": ("a", lambda a: a.dual()),
    "a.dual(P)": ("a P", lambda a, p: a.dual(p)),
    "a.right_complement()": ("a", lambda a: a.right_complement()),
    "a.left_complement()": ("a", lambda a: a.left_complement()),
    "a.x(b)": ("a b", lambda a, b: a.x(b)),
    "B.commutator(v)": ("B v", lambda a, b: a.commutator(b)),
    "a.anticommutator(b)": ("a b", lambda a, b: a.anticommutator(b)),
    "B.exp()": ("small", lambda a: a.exp()),
    "simple.exp()": ("simple", lambda a: a.exp()),
    "c.exp()": ("c", lambda a: a.exp()),
    "P.project(v)": ("P v", lambda p, v: p.project(v)),
    "P.project(a)": ("P a", lambda p, a: p.project(a)),
    "R a ~R": ("R a", lambda r, a: r * a * ~r),
    "V a* ~V": ("V a", lambda r, a: r * a.gradeInvol() * ~r),
    "join": ("P Q", lambda a, b: a.join(b)),
    "meet": ("P Q", lambda a, b: a.meet(b)),
    "isBlade": ("P", lambda a: a.isBlade()),
    "isBlade of R": ("R", lambda a: a.isBlade()),
    "isVersor": ("V", lambda a: a.isVersor()),
    "isVersor of a": ("a", lambda a: a.isVersor()),
    "grades": ("a", lambda a: sorted(map(int, a.grades()))),
    "grades of R": ("R", lambda a: sorted(map(int, a.grades()))),
    "factorise": ("P", lambda a: a.factorise()),
    "astype": ("a", lambda a: a.astype(np.float32).astype(float)),
    "round": ("a", lambda a: a.round(3)),
    "blades_list": ("a", lambda a: sum(a.blades_list[1:], a.blades_list[0])),
    "a == a": ("a", lambda a: a == a * 1.0),
    "left matrix": ("a b", lambda a, b: a.layout.MultiVector(a.layout.get_left_gmt_matrix(a) @ b.value)),
    "right matrix": ("a b", lambda a, b: a.layout.MultiVector(a.layout.get_right_gmt_matrix(b) @ a.value)),
    "pseudoScalar": ("a", lambda a: a.pseudoScalar),
    "invPS": ("a", lambda a: a.invPS()),
    "Frame.En": ("v w", lambda v, w: _frame(v, w).En),
    "MVArray.sum": ("a b v", lambda *x: _array(*x).sum()),
    "MVArray.gp": ("a b v", lambda *x: _array(*x).gp()),
    "MVArray.op": ("a v w", lambda *x: _array(*x).op()),
}
"""Operands and function of each operation, by clifford's own notation."""


def _frame(*vectors: Any) -> Any:
    import clifford

    return clifford.Frame(list(vectors))


def _array(*elements: Any) -> Any:
    import clifford

    return clifford.MVArray(list(elements))


class Peer:
    """clifford's algebra for a Gram matrix of orthogonal vectors and null pairs."""

    def __init__(self, gram: list[list[int]], blades: list[list[tuple[int, int]]]) -> None:
        import clifford

        n = len(gram)
        pair = next(((i, j) for i in range(n) for j in range(i) if gram[i][j]), None)
        squares = [gram[k][k] for k in range(n)] if pair is None else [*(gram[k][k] for k in range(n - 2)), 1, -1]
        places = sorted(range(n), key=lambda k: squares[k] != 0)  # `clifford.Cl` has null vectors first, too
        layout = clifford.Layout([squares[k] for k in places])
        vectors = [layout.basis_vectors_lst[places.index(k)] for k in range(n)]
        if pair is not None:  # the products are -1
            plus, minus = vectors[-2:]
            vectors[-2:] = [0.5 * (minus - plus), plus + minus]
        products = []
        for factors, sign in blades:
            product = sign * layout.scalar
            for factor in factors:
                product = product ^ vectors[factor]
            products.append(product.value.astype(float))
        self._matrix = np.array(products).T
        self._layout = layout

    def element(self, row: Any) -> Any:
        """Return the element with coefficients in the order of the blades."""
        return self._layout.MultiVector(value=self._matrix @ row)

    def row(self, x: Any) -> Any:
        """Return coefficients of elements, within lists and tuples; anything else unchanged."""
        if hasattr(x, "value") and hasattr(x, "layout"):
            return np.linalg.solve(self._matrix, np.ravel(x.value))
        if isinstance(x, (list, tuple)):
            return [self.row(each) for each in x]
        return x


def main(source: str, target: str) -> None:
    """Compute all results; an exception is the text of its message."""
    with open(source, "rb") as file:
        given = pickle.load(file)
    results: dict[str, dict[str, Any]] = {}
    for space, (gram, blades, operands) in given.items():
        peer = Peer(gram, blades)
        results[space] = {}
        for name, (letters, function) in OPERATIONS.items():
            names = letters.split()
            if any(each not in operands for each in names):
                continue
            found = []
            for k in range(len(operands["a"])):
                arguments = [
                    float(operands[each][k]) if each == "s" else peer.element(operands[each][k]) for each in names
                ]
                try:
                    found.append(peer.row(function(*arguments)))
                except Exception as error:
                    found.append(f"{type(error).__name__}: {error}")
            results[space][name] = found
    with open(target, "wb") as file:
        pickle.dump(results, file)


if __name__ == "__main__":
    assert os.environ.get("NUMBA_DISABLE_JIT") == "1"
    main(*sys.argv[1:])
