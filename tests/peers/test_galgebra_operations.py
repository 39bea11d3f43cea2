"""Operations of galgebra's multivectors, beside ours, on the same rational numbers.

Symbols, derivatives and curved spaces are compared in `test_symbolic_peers.py`. Results that differ by convention are
listed in `OTHER` with the reason, and on the page about switching from other libraries.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from random import Random
from typing import Any

import pytest
import sympy

import gacompiler as ga
from gacompiler.algebra.classification import Kind, classify
from gacompiler.algebra.multivector import Multivector
from gacompiler.calculus import LinearFunction
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3, Space

pytestmark = pytest.mark.peers
galgebra = pytest.importorskip("galgebra.ga")

SPACES: dict[str, Any] = {
    "VGA2": VGA2, "VGA3": VGA3, "PGA2": PGA2, "PGA3": PGA3, "CGA2": CGA2, "CGA3": CGA3, "STA": STA,
    "QUATERNIONS": QUATERNIONS, "G(4)": Space(4), "G(2,2)": Space(2, 2),
}  # fmt: skip
PGA, SMALL = ("PGA2", "PGA3"), ("VGA2", "VGA3", "PGA2", "QUATERNIONS")
MOST = 8
"""Number of coefficients of operands, since galgebra takes a millisecond for each pair."""
QUATERNION = "in algebras of numbers ~q is the conjugate, and norms are those of numbers"

OPERATIONS: dict[str, tuple[str, Callable[..., Any], Callable[..., Any]]] = {
    "*": ("a b", lambda a, b: a * b, lambda s, a, b: a * b),
    "^": ("a b", lambda a, b: a ^ b, lambda s, a, b: a ^ b),
    "|": ("a b", lambda a, b: a | b, lambda s, a, b: ga.hestenes_product(a, b)),
    "<": ("a b", lambda a, b: a < b, lambda s, a, b: ga.left_contraction(a, b)),
    ">": ("a b", lambda a, b: a > b, lambda s, a, b: ga.right_contraction(a, b)),
    ">>": ("a b", lambda a, b: a >> b, lambda s, a, b: ga.commutator(a, b)),
    "<<": ("a b", lambda a, b: a << b, lambda s, a, b: ga.anticommutator(a, b)),
    "+": ("a v", lambda a, b: a + b, lambda s, a, b: a + b),
    "-": ("v a", lambda a, b: a - b, lambda s, a, b: a - b),
    "neg": ("a", lambda a: -a, lambda s, a: -a),
    "a + 2": ("a", lambda a: a + 2, lambda s, a: a + 2),
    "3 * a": ("a", lambda a: 3 * a, lambda s, a: 3 * a),
    "a / 2": ("a", lambda a: a / 2, lambda s, a: a / 2),
    "a ** 2": ("a", lambda a: a**2, lambda s, a: a**2),
    "a / v": ("a v", lambda a, v: a / v, lambda s, a, v: a * ga.inverse(v)),
    "rev": ("a", lambda a: a.rev(), lambda s, a: ~a),
    "g_invol": ("a", lambda a: a.g_invol(), lambda s, a: ga.grade_involution(a)),
    "ccon": ("a", lambda a: a.ccon(), lambda s, a: ga.clifford_conjugate(a)),
    "even": ("a", lambda a: a.even(), lambda s, a: ga.even_part(a)),
    "odd": ("a", lambda a: a.odd(), lambda s, a: ga.odd_part(a)),
    "grade": ("a", lambda a: a.grade(2), lambda s, a: a.grade(2)),
    "scalar": ("a", lambda a: a.scalar(), lambda s, a: a.grade(0)),
    "sp": ("a b", lambda a, b: a.sp(b), lambda s, a, b: ga.scalar_product(a, b)),
    "sp, rev": ("a b", lambda a, b: a.sp(b, "rev"), lambda s, a, b: ga.scalar_product(~a, b)),
    "qform": ("a", lambda a: a.qform(), lambda s, a: ga.norm_squared(a)),
    "norm2": ("a", lambda a: a.norm2(), lambda s, a: _absolute(ga.norm_squared(a))),
    "norm": ("n", lambda a: a.norm(), lambda s, a: ga.norm(a)),
    "inv of a vector": ("v", lambda a: a.inv(), lambda s, a: ga.inverse(a)),
    "inv of a versor": ("R", lambda a: a.inv(), lambda s, a: ga.inverse(a)),
    "hitzer_inverse": ("a", lambda a: a.hitzer_inverse(), lambda s, a: ga.inverse(a)),
    "shirokov_inverse": ("a", lambda a: a.shirokov_inverse(), lambda s, a: ga.inverse(a)),
    "dual": ("a", lambda a: a.dual(), lambda s, a: a * _pseudoscalar(s)),
    "project_in_blade": (
        "a P",
        lambda a, p: a.project_in_blade(p),
        lambda s, a, p: ga.left_contraction(a, p) * ga.inverse(p),
    ),
    "reflect_in_blade": ("v P", lambda a, p: a.reflect_in_blade(p), lambda s, a, p: -p * a * ga.inverse(p)),
    "is_blade": ("P", lambda a: a.is_blade(), lambda s, a: classify(a).kind is Kind.BLADE),
    "is_blade of a": ("a", lambda a: a.is_blade(), lambda s, a: classify(a).kind is Kind.BLADE),
    "is_versor": ("R", lambda a: a.is_versor(), lambda s, a: classify(a).is_versor),
    "is_versor of a": ("a", lambda a: a.is_versor(), lambda s, a: classify(a).is_versor),
    "pure_grade": ("P", lambda a: a.pure_grade(), lambda s, a: max(blade.bit_count() for blade in a.terms)),
    "com": ("a b", lambda a, b: a.Ga.com(a, b), lambda s, a, b: ga.commutator(a, b)),
    "I": ("a", lambda a: a.Ga.E(), lambda s, a: _pseudoscalar(s)),
}
"""Operands, galgebra's function and ours."""

OTHER: dict[tuple[str, str], str] = {
    **{(name, "CGA3"): "galgebra computes for half a second and more" for name in (
        "hitzer_inverse", "project_in_blade", "is_versor", "inv of a versor", ">>")},
    **{("shirokov_inverse", space): "galgebra computes for half a second" for space in SPACES if space not in SMALL},
    **{(name, space): "galgebra divides its pseudoscalar by its norm, 0" for name in ("dual",) for space in PGA},
    **{(name, "QUATERNIONS"): QUATERNION for name in ("rev", "qform", "norm2", "norm", "sp, rev")},
}  # fmt: skip
"""Results that differ on purpose, by operation and space."""


def _absolute(x: Any) -> Any:
    return abs(x.terms.get(0, 0))


def _pseudoscalar(space: Any) -> Any:
    """The product of the vectors in their order, as galgebra has it; ours may be spelled otherwise."""
    return Multivector(space.algebra, {(1 << space.algebra.dimension) - 1: Fraction(1)})


class Peer:
    """galgebra's algebra of the same vectors."""

    def __init__(self, space: str) -> None:
        self.algebra = SPACES[space].algebra
        metric = [[sympy.Integer(int(x)) for x in row] for row in self.algebra.gram]
        coordinates = sympy.symbols(f"x:{len(metric)}", real=True)
        self.ga = galgebra.Ga(" ".join(self.algebra.vectors), g=sympy.Matrix(metric).tolist(), coords=coordinates)
        pairs = zip(self.ga.indexes.flat, self.ga.blades.flat, strict=True)
        self.blades = {sum(1 << k for k in index): self.ga.mv(blade) for index, blade in pairs}

    def of(self, x: Multivector) -> Any:
        terms = (sympy.Rational(v.numerator, v.denominator) * self.blades[blade] for blade, v in x.terms.items())
        return sum(terms, self.ga.mv(sympy.Integer(0)))

    def back(self, theirs: Any) -> dict[int, Any]:
        values = theirs.blade_coefs(list(self.blades.values())) if hasattr(theirs, "blade_coefs") else [theirs]
        return {blade: value for blade, value in zip(self.blades, map(sympy.sympify, values), strict=False) if value}


def operands(space: str) -> dict[str, Multivector]:
    """General elements, a vector, a versor, a blade, and a vector whose norm is rational."""
    algebra, random = SPACES[space].algebra, Random(f"{space}, 2")

    def some(*grades: int) -> Multivector:
        blades = algebra.blades(*grades)
        kept = blades if len(blades) <= MOST else random.sample(blades, MOST)
        return Multivector(
            algebra, {blade: Fraction(random.randint(1, 9) * random.choice([1, -1]), 3) for blade in kept}
        )

    def vector() -> Multivector:
        found = some(1)
        return found if (found * found).terms else vector()

    v, w = vector(), vector()
    return {
        "a": some(),
        "b": some(),
        "v": v,
        "n": 3 * algebra.basis()[1] + 4 * algebra.basis()[-1 if algebra.name == "STA" else 0],
        "R": v * w,
        "P": v ^ w,
    }


def same(peer: Peer, mine: Any, theirs: Any) -> bool:
    if isinstance(theirs, (bool, int)):
        return bool(mine == theirs)
    terms = mine.terms if isinstance(mine, Multivector) else {0: mine}
    found = peer.back(theirs)
    return all(abs(found.get(k, 0) - sympy.sympify(terms.get(k, 0))) < 1e-12 for k in found | terms)


@pytest.mark.parametrize("space", SPACES)
def test_operations(space: str) -> None:
    peer, given, wrong, compared = Peer(space), operands(space), [], 0
    for name, (letters, there, here) in OPERATIONS.items():
        if (name, space) in OTHER:
            continue
        arguments = [given[each] for each in letters.split()]
        mine, theirs = here(SPACES[space], *arguments), there(*map(peer.of, arguments))
        if not same(peer, mine, theirs):
            wrong.append((name, mine, theirs))
        compared += 1
    assert not wrong, wrong[:3]
    assert compared == len(OPERATIONS) - sum(where == space for _, where in OTHER)


@pytest.mark.parametrize("space", ["VGA2", "VGA3", "STA", "G(2,2)"])
def test_linear_functions(space: str) -> None:
    """Determinant, trace and inverse of a matrix of integers; galgebra has no adjoint of it."""
    peer, algebra, random = Peer(space), SPACES[space].algebra, Random(1)
    n = algebra.dimension
    matrix = sympy.Matrix(n, n, lambda i, j: random.randint(-3, 3)) + 4 * sympy.eye(n)
    mine, theirs = LinearFunction(algebra, matrix), peer.ga.lt(matrix)
    assert mine.determinant == theirs.det() and mine.trace == theirs.tr()
    v = operands(space)["v"]
    for here, there in ((mine, theirs), (mine.inverse, theirs.inv())):
        assert same(peer, here(v), there(peer.of(v)))
