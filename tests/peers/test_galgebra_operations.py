"""Every public operation of galgebra's multivectors that has a counterpart here, on the same rational numbers, exactly.

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
from gacompiler.algebra.factorization import factorize_blade, join_and_meet
from gacompiler.algebra.multivector import Multivector
from gacompiler.calculus import LinearFunction
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3, Space

pytestmark = pytest.mark.peers
galgebra = pytest.importorskip("galgebra.ga")

SPACES: dict[str, Any] = {
    "VGA2": VGA2, "VGA3": VGA3, "PGA2": PGA2, "PGA3": PGA3, "CGA2": CGA2, "CGA3": CGA3, "STA": STA,
    "QUATERNIONS": QUATERNIONS, "G(4)": Space(4), "G(2,2)": Space(2, 2),
}  # fmt: skip
PGA, QUATERNION = ("PGA2", "PGA3"), "in algebras of numbers ~q is the conjugate, and norms are those of numbers"

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
    "dual": ("a", lambda a: a.dual(), lambda s, a: _pseudoscalar(s) * a),
    "project_in_blade": ("a P", lambda a, p: a.project_in_blade(p), lambda s, a, p: ga.left_contraction(a, p) * ga.inverse(p)),
    "reflect_in_blade": ("v P", lambda a, p: a.reflect_in_blade(p), lambda s, a, p: -p * a * ga.inverse(p)),
    "is_blade": ("P", lambda a: a.is_blade(), lambda s, a: _is_blade(a)),
    "is_blade of a": ("a", lambda a: a.is_blade(), lambda s, a: _is_blade(a)),
    "is_zero": ("a", lambda a: (a - a).is_zero(), lambda s, a: not (a - a).terms),
    "pure_grade": ("P", lambda a: a.pure_grade(), lambda s, a: max(blade.bit_count() for blade in a.terms)),
    "com": ("a b", lambda a, b: a.Ga.com(a, b), lambda s, a, b: ga.commutator(a, b)),
    "I": ("a", lambda a: a.Ga.E(), lambda s, a: _pseudoscalar(s)),
}
"""Operands, galgebra's function and ours."""

OTHER: dict[tuple[str, str], str] = {
    **{(name, space): "galgebra computes for more than ten seconds" for name, space in (
        ("hitzer_inverse", "CGA3"), ("shirokov_inverse", "CGA3"))},
    **{(name, space): "galgebra divides its pseudoscalar by its norm, 0" for name in ("dual",) for space in PGA},
    **{(name, "QUATERNIONS"): QUATERNION for name in ("rev", "qform", "norm2", "norm", "sp, rev")},
}  # fmt: skip
"""Results that differ on purpose, by operation and space."""


def _absolute(x: Any) -> Any:
    return abs(x.terms.get(0, 0))


def _pseudoscalar(space: Any) -> Any:
    """The product of the vectors in their order, as galgebra has it; ours may be spelled otherwise."""
    return Multivector(space.algebra, {(1 << space.algebra.dimension) - 1: Fraction(1)})


def _is_blade(x: Any) -> bool:
    try:
        factorize_blade(x)
    except ga.errors.AlgebraError if hasattr(ga, "errors") else Exception:
        return False
    return True
