"""Operations of kingdon's multivectors, beside ours, on the same numbers.

Results that differ by convention are listed in `OTHER` with the reason, and on the page about switching from other
libraries.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from rival_operands import SPACES, dense, operands

pytestmark = pytest.mark.peers
kingdon = pytest.importorskip("kingdon")

DEGENERATE = ("PGA2", "PGA3")

OPERATIONS: dict[str, tuple[str, Callable[..., Any], Callable[..., Any]]] = {
    "add": ("a B", lambda a, b: a + b, lambda s, a, b: a + b),
    "sub": ("v a", lambda a, b: a - b, lambda s, a, b: a - b),
    "neg": ("a", lambda a: -a, lambda s, a: -a),
    "gp": ("B v", lambda a, b: a * b, lambda s, a, b: a * b),
    "gp of all": ("a b", lambda a, b: a.gp(b), lambda s, a, b: a.geometric_product(b)),
    "op": ("B v", lambda a, b: a ^ b, lambda s, a, b: a ^ b),
    "ip": ("B R", lambda a, b: a | b, lambda s, a, b: a | b),
    "lc": ("v B", lambda a, b: a.lc(b), lambda s, a, b: a.left_contraction(b)),
    "rc": ("B v", lambda a, b: a.rc(b), lambda s, a, b: a.right_contraction(b)),
    "sp": ("B B", lambda a, b: a.sp(b), lambda s, a, b: a.scalar_product(b)),
    "cp": ("B R", lambda a, b: a.cp(b), lambda s, a, b: a.commutator(b)),
    "acp": ("B R", lambda a, b: a.acp(b), lambda s, a, b: a.anticommutator(b)),
    "rp": ("B V", lambda a, b: a & b, lambda s, a, b: a & b),
    "sw of a rotor": ("unit v", lambda a, b: a.sw(b), lambda s, a, b: a >> b),
    "sw of a vector": ("n v", lambda a, b: a >> b, lambda s, a, b: a.sandwich(b)),
    "proj": ("v simple", lambda a, b: (a | b) * b.inv(), lambda s, a, b: a.project(b)),
    "div": ("B v", lambda a, b: a / b, lambda s, a, b: a / b),
    "inv of a vector": ("v", lambda a: a.inv(), lambda s, a: a.inverse()),
    "inv of a rotor": ("R", lambda a: a.inv(), lambda s, a: a.inverse()),
    "reverse": ("a", lambda a: a.reverse(), lambda s, a: a.reverse()),
    "~": ("B", lambda a: ~a, lambda s, a: ~a),
    "involute": ("a", lambda a: a.involute(), lambda s, a: a.grade_involution()),
    "conjugate": ("a", lambda a: a.conjugate(), lambda s, a: a.clifford_conjugate()),
    "normsq": ("R", lambda a: a.normsq(), lambda s, a: a * ~a),
    "norm": ("v", lambda a: (a.normsq() * a.normsq()).sqrt().sqrt(), lambda s, a: a.norm()),
    "normalized": ("n", lambda a: a.normalized(), lambda s, a: a.normalize()),
    "hodge": ("a", lambda a: a.hodge(), lambda s, a: a.dual()),
    "unhodge": ("a", lambda a: a.unhodge(), lambda s, a: a.undual()),
    "dual": ("B", lambda a: a.dual(), lambda s, a: a.dual() if 0 in _squares(s) else a.polarity()),
    "polarity": ("a", lambda a: a.polarity(), lambda s, a: a.polarity()),
    "unpolarity": ("a", lambda a: a.unpolarity(), lambda s, a: a * s.pseudoscalar),
    "outerexp": ("small", lambda a: a.outerexp(), lambda s, a: a.outer_exp()),
    "outersin": ("small", lambda a: a.outersin(), lambda s, a: a.outer_sin()),
    "outercos": ("small", lambda a: a.outercos(), lambda s, a: a.outer_cos()),
    "outertan": ("small", lambda a: a.outertan(), lambda s, a: a.outer_tan()),
    "power 3": ("v", lambda a: a**3, lambda s, a: a**3),
    "power -2": ("R", lambda a: a**-2, lambda s, a: a**-2),
    "grade": ("a", lambda a: a.grade(1, 2), lambda s, a: a.grade(1, 2)),
    "grades": ("V", lambda a: list(a.grades), lambda s, a: [*range(1, s.algebra.dimension + 1, 2)][:2]),
    "getattr": ("a", lambda a: a.e12 - a.e21 + a.e, lambda s, a: _e12(a) + a["1"]),
    "map": ("a", lambda a: a.map(lambda x: 3 * x), lambda s, a: s.of(a.layout, 3 * a.values)),
    "shape": ("a", lambda a: [*a.shape, len(a), a.ndim], lambda s, a: [*a.shape, len(a), a.ndim]),
    "getitem": ("a", lambda a: a[1:], lambda s, a: a[1:]),
    "stack": ("a b", lambda a, b: kingdon.multivector.stack([a, b])[0], lambda s, a, b: np.stack([a, b])[0]),
    "asfullmv": ("B", lambda a: a.asfullmv(), lambda s, a: a.as_layout(s.algebra.full)),
    "number times": ("a", lambda a: 2 * a - 1, lambda s, a: 2 * a - 1),
    "number over": ("v", lambda a: 2 / a, lambda s, a: 2 / a),
}
"""Operands, kingdon's function and ours."""

OTHER: dict[tuple[str, str], str] = {
    **{("polarity", space): "the pseudoscalar has no inverse" for space in ("PGA2", "PGA3")},
    **{(name, "QUATERNIONS"): "in algebras of numbers ~q is the conjugate, and norms are those of numbers" for name in (
        "reverse", "~", "normsq", "norm", "normalized", "sw of a rotor", "sw of a vector")},
    **{(name, space): "kingdon takes x ~x for positive: its norm of others is NaN" for name in (
        "normalized", "sw of a vector") for space in ("STA", "G(2,2)")},
    **{(name, space): "the complement of a blade depends on the basis, e0 and einf or e4 and e5" for name in (
        "hodge", "unhodge", "getattr") for space in ("CGA2", "CGA3")},
    **{(name, "CGA3"): "kingdon computes for more than a minute" for name in (
        "inv of a rotor", "power -2", "outertan", "proj")},
    **{("getattr", space): "kingdon numbers the null vector as the first" for space in ("PGA2", "PGA3")},
    **{(name, "CGA2"): "kingdon takes x ~x for positive" for name in ("sw of a rotor", "sw of a vector", "normalized")},
}  # fmt: skip
"""Results that differ on purpose, by operation and space."""
NEGATIVE = {"rp", "dual", "polarity", "unpolarity"}
"""Results that have the other sign in CGA2, whose pseudoscalar is e012inf, ``-e1 ^ e2 ^ e3 ^ e4`` of kingdon."""


def _e12(a: Any) -> Any:
    """Twice the coefficient of the first two vectors of kingdon, which are ours too."""
    names = {name: (sign, blade) for name in a.layout.blades for sign, blade in [a.algebra.blade(name)]}
    return 2 * next(sign * a[name] for name, (sign, blade) in names.items() if blade == 3)


def _squares(space: Any) -> list[int]:
    """The squares of orthogonal vectors: in spaces with a null pair, 1 and -1 instead of its squares 0."""
    algebra = space.algebra
    own = [int(algebra.gram[k][k]) for k in range(algebra.dimension)]
    return [*own[:-2], 1, -1] if algebra.null_pairs else own


class Peer:
    """kingdon's algebra of the same vectors, null ones first as in its own PGA; null pairs are sums of e4 and e5."""

    def __init__(self, space: str) -> None:
        owner = SPACES[space].algebra
        self.name, squares = space, _squares(SPACES[space])
        places = sorted(range(len(squares)), key=lambda k: squares[k] != 0)
        self.algebra = kingdon.Algebra(signature=[squares[k] for k in places], start_index=1)
        vectors = [self.algebra.multivector(keys=(1 << places.index(k),), values=[1.0]) for k in range(len(squares))]
        if owner.null_pairs:
            plus, minus = vectors[-2:]
            vectors[-2:] = [(minus - plus) * 0.5, plus + minus]
        rows = []
        for slot in owner.full.stored:
            product = self.algebra.multivector(keys=(0,), values=[float(slot.sign)])
            for k, vector in enumerate(vectors):
                product = product ^ vector if slot.blade >> k & 1 else product
            rows.append(self._row(product, ()))
        self._matrix = np.array(rows)

    def of(self, x: Any) -> Any:
        """Return elements of kingdon with the blades of ours."""
        if not hasattr(x, "layout"):
            return x
        values = dense(self.name, x) @ self._matrix
        keys = [k for k in range(values.shape[-1]) if values[..., k].any()]
        return self.algebra.multivector(keys=tuple(keys), values=[values[..., k] for k in keys])

    def _row(self, theirs: Any, shape: tuple[int, ...]) -> Any:
        found = np.zeros((*shape, len(self.algebra)))
        for key, value in theirs.items():
            found[..., key] = value
        return found

    def rows(self, theirs: Any, shape: tuple[int, ...]) -> Any:
        """Return coefficients in our order; lists and numbers unchanged."""
        if isinstance(theirs, list):
            return theirs
        if not hasattr(theirs, "keys"):
            return dense(self.name, theirs)
        return self._row(theirs, shape) @ np.linalg.inv(self._matrix)


@pytest.fixture(autouse=True)
def without_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAC_BACKEND", "arrays")
    warnings.simplefilter("ignore")


@pytest.mark.parametrize("space", SPACES)
def test_operations(space: str) -> None:
    peer, given, wrong, compared = Peer(space), dict(operands(space)), [], 0
    given["n"] = given["v"] / given["v"].norm()
    for name, (letters, there, here) in OPERATIONS.items():
        if (name, space) in OTHER:
            continue
        arguments = [given[each] for each in letters.split()]
        mine, theirs = here(SPACES[space], *arguments), there(*map(peer.of, arguments))
        rows = peer.rows(theirs, np.shape(mine) if hasattr(mine, "shape") else ())
        found = mine if isinstance(rows, list) else dense(space, mine)
        sign = -1 if name in NEGATIVE and space == "CGA2" else 1
        if np.shape(found) != np.shape(rows) or not np.allclose(found, np.multiply(sign, rows), rtol=1e-9, atol=1e-9):
            wrong.append((name, mine, theirs))
        compared += 1
    assert not wrong, wrong[:3]
    assert compared == len(OPERATIONS) - sum(where == space for _, where in OTHER)


@pytest.mark.parametrize("space", ["VGA2", "VGA3", "PGA2", "PGA3", "STA", "G(2,2)"])
def test_matrices(space: str) -> None:
    """kingdon's matrices have the size of the algebra; our determinant is that of the smallest complex ones."""
    peer, given = Peer(space), operands(space)
    for letter in "aR":
        x, n = given[letter][0], SPACES[space].algebra.dimension
        matrix = np.asarray(peer.of(x).asmatrix(), float)
        degree = 2 ** (n - (n + 1) // 2)
        assert np.linalg.det(matrix) == pytest.approx(float(x.determinant()) ** degree, rel=1e-8, abs=1e-8)
        assert np.trace(matrix) / 2**n == pytest.approx(float(x.grade(0)))
        product = matrix @ np.asarray(peer.of(given["b"][0]).asmatrix(), float)
        back = peer.rows(peer.algebra.mvtype.frommatrix(peer.algebra, product), ())
        np.testing.assert_allclose(back, dense(space, x * given["b"][0]), atol=1e-9)


@pytest.mark.parametrize("space", ["VGA2", "VGA3", "PGA2"])
def test_exponentials_and_roots_of_single_elements(space: str) -> None:
    """kingdon has exponentials of elements whose square is a number, and roots of such elements plus a number."""
    peer, x = Peer(space), 0.3 * operands(space)["simple"][0]
    assert float((x * x).grade(0)) < 0
    theirs = peer.of(x).exp(cosh=np.cos, sinhc=lambda t: np.sinc(t / np.pi), sqrt=lambda t: (-t) ** 0.5)
    np.testing.assert_allclose(peer.rows(theirs, ()), dense(space, x.exp()), atol=1e-12)
    root = peer.of(x.exp()).sqrt()
    np.testing.assert_allclose(peer.rows(root, ()), dense(space, x.exp().sqrt()), atol=1e-12)
