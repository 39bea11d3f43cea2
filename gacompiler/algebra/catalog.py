"""The predefined algebras and their layouts.

Coefficients are ordered by grade and then by the bitmap of the basis vectors, except in layouts with an established
order (the coefficients of a point are x, y, z).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from ..errors import AlgebraError
from .algebra import Algebra
from .coefficients import Coefficient, scale
from .layout import Layout


@dataclass(frozen=True, slots=True)
class HalfSquare:
    """Half the sum of the squares of the given coefficients: the einf coefficient of a conformal point."""

    names: tuple[str, ...]

    def __call__(self, coefficients: Mapping[str, Coefficient]) -> Coefficient:
        return scale(sum(coefficients[name] * coefficients[name] for name in self.names), Fraction(1, 2))


def _numbers(algebra: Algebra) -> Iterable[Layout]:
    yield algebra.layout("NUMBER", f"1 {algebra.vectors[0]}")
    yield algebra.layout("UNIT_NUMBER", f"1 {algebra.vectors[0]}", unit=True)


def _vga2(algebra: Algebra) -> Iterable[Layout]:
    yield algebra.layout("VECTOR", "e1 e2")
    yield algebra.layout("ROTOR", "1 e12", unit=True)
    yield algebra.layout("EVEN", "1 e12")
    yield algebra.layout("BIVECTOR", "e12")
    yield algebra.layout("UNIT_VECTOR", "e1 e2", unit=True)


def _vga3(algebra: Algebra) -> Iterable[Layout]:
    yield algebra.layout("VECTOR", "e1 e2 e3")
    yield algebra.layout("BIVECTOR", "e12 e13 e23")
    yield algebra.layout("ROTOR", "1 e12 e13 e23", unit=True)
    yield algebra.layout("EVEN", "1 e12 e13 e23")
    yield algebra.layout("UNIT_VECTOR", "e1 e2 e3", unit=True)
    yield algebra.layout("PSEUDOSCALAR", "e123")


def _quaternion(algebra: Algebra) -> Iterable[Layout]:
    yield algebra.layout("QUATERNION", "1 e1 e2 e12")
    yield algebra.layout("UNIT_QUATERNION", "1 e1 e2 e12", unit=True)
    yield algebra.layout("VECTOR", "e1 e2 e12")


def _pga2(algebra: Algebra) -> Iterable[Layout]:
    yield algebra.layout("POINT", "e20 e01", fixed={"e12": 1})
    yield algebra.layout("DIRECTION", "e20 e01")
    yield algebra.layout("LINE", "e1 e2 e0")
    yield algebra.layout("UNIT_LINE", "e1 e2 e0", unit=True)
    yield algebra.layout("MOTOR", "1 e12 e20 e01", unit=True)
    yield algebra.layout("ROTOR", "1 e12", unit=True)
    yield algebra.layout("TRANSLATOR", "e20 e01", fixed={"1": 1}, unit=True)
    yield algebra.layout("EVEN", "1 e12 e20 e01")
    yield algebra.layout("BIVECTOR", "e12 e20 e01")


def _pga3(algebra: Algebra) -> Iterable[Layout]:
    yield algebra.layout("POINT", "e032 e013 e021", fixed={"e123": 1})
    yield algebra.layout("DIRECTION", "e032 e013 e021")
    yield algebra.layout("LINE", "e12 e13 e23 e01 e02 e03")
    yield algebra.layout("PLANE", "e1 e2 e3 e0")
    yield algebra.layout("MOTOR", "1 e12 e13 e23 e01 e02 e03 e0123", unit=True)
    yield algebra.layout("ROTOR", "1 e12 e13 e23", unit=True)
    yield algebra.layout("TRANSLATOR", "e01 e02 e03", fixed={"1": 1}, unit=True)
    yield algebra.layout("EVEN", "1 e12 e13 e23 e01 e02 e03 e0123")
    yield algebra.layout("UNIT_LINE", "e12 e13 e23 e01 e02 e03", unit=True)
    yield algebra.layout("UNIT_PLANE", "e1 e2 e3 e0", unit=True)
    yield algebra.layout("IDEAL_LINE", "e01 e02 e03")
    yield algebra.layout("TRIVECTOR", "e123 e032 e013 e021")


def _cga2(algebra: Algebra) -> Iterable[Layout]:
    yield algebra.layout("POINT", "e1 e2", fixed={"e0": 1}, implied={"einf": HalfSquare(("e1", "e2"))})
    yield algebra.layout("VECTOR", "e1 e2 e0 einf")
    yield algebra.layout("POINT_PAIR", " ".join(algebra.spelling(b)[1] for b in algebra.blades(2)))
    yield algebra.layout("CIRCLE", " ".join(algebra.spelling(b)[1] for b in algebra.blades(3)))
    yield algebra.layout("LINE", "e12inf e10inf e20inf")
    yield algebra.layout("ROTOR", "1 e12", unit=True)
    yield algebra.layout("TRANSLATOR", "e1inf e2inf", fixed={"1": 1}, unit=True)
    yield algebra.layout("MOTOR", "1 e12 e1inf e2inf", unit=True)
    yield algebra.layout("DILATOR", "1 e0inf", unit=True)
    yield algebra.layout("TRANSVERSOR", "e10 e20", fixed={"1": 1}, unit=True)
    yield algebra.layout("DUAL_LINE", "e1 e2 einf")
    yield algebra.layout("FLAT_POINT", "e1inf e2inf e0inf")
    yield algebra.layout("DIRECTION", "e1inf e2inf")


def _cga3(algebra: Algebra) -> Iterable[Layout]:
    yield algebra.layout("POINT", "e1 e2 e3", fixed={"e0": 1}, implied={"einf": HalfSquare(("e1", "e2", "e3"))})
    yield algebra.layout("DUAL_PLANE", "e1 e2 e3 einf")
    yield algebra.layout("VECTOR", "e1 e2 e3 e0 einf")
    yield algebra.layout("POINT_PAIR", " ".join(algebra.spelling(b)[1] for b in algebra.blades(2)))
    yield algebra.layout("LINE", "e12inf e13inf e23inf e10inf e20inf e30inf")
    yield algebra.layout("CIRCLE", " ".join(algebra.spelling(b)[1] for b in algebra.blades(3)))
    yield algebra.layout("PLANE", "e123inf e120inf e130inf e230inf")
    yield algebra.layout("SPHERE", " ".join(algebra.spelling(b)[1] for b in algebra.blades(4)))
    yield algebra.layout("ROTOR", "1 e12 e13 e23", unit=True)
    yield algebra.layout("TRANSLATOR", "e1inf e2inf e3inf", fixed={"1": 1}, unit=True)
    yield algebra.layout("MOTOR", "1 e12 e13 e23 e1inf e2inf e3inf e123inf", unit=True)
    yield algebra.layout("DILATOR", "1 e0inf", unit=True)
    yield algebra.layout("TRANSVERSOR", "e10 e20 e30", fixed={"1": 1}, unit=True)
    yield algebra.layout("DUAL_LINE", "e12 e13 e23 e1inf e2inf e3inf")
    yield algebra.layout("FLAT_POINT", "e1inf e2inf e3inf e0inf")
    yield algebra.layout("DIRECTION", "e1inf e2inf e3inf")


def _sta(algebra: Algebra) -> Iterable[Layout]:
    yield algebra.layout("VECTOR", "g0 g1 g2 g3")
    yield algebra.layout("BIVECTOR", "g10 g20 g30 g12 g13 g23")
    yield algebra.layout("ROTOR", "1 g10 g20 g30 g12 g13 g23 g0123", unit=True)
    yield algebra.layout("EVEN", "1 g10 g20 g30 g12 g13 g23 g0123")
    yield algebra.layout("TRIVECTOR", " ".join(algebra.spelling(b)[1] for b in algebra.blades(3)))


def _null_pairs(algebra: Algebra) -> Iterable[Layout]:
    n, vectors = algebra.dimension // 2, algebra.vectors
    yield algebra.layout("NULL_VECTOR", " ".join(vectors[:n]))
    yield algebra.layout("DUAL_NULL_VECTOR", " ".join(vectors[n:]))
    yield algebra.layout("VECTOR", " ".join(vectors))
    yield algebra.layout("BIVECTOR", " ".join(algebra.spelling(b)[1] for b in algebra.blades(2)))


def null_pairs(n: int, name: str | None = None) -> Algebra:
    """Create G(n, n) with a basis of null pairs: ``w_i . v_i = 1``, and every other inner product is 0.

    With orthonormal vectors ``s_i**2 = 1`` and ``t_i**2 = -1``, they are ``w_i = (s_i + t_i) / 2`` and
    ``v_i = s_i - t_i``.
    """
    vectors = [f"w{i + 1}" for i in range(n)] + [f"v{i + 1}" for i in range(n)]
    gram = [[int(abs(i - j) == n) for j in range(2 * n)] for i in range(2 * n)]
    return Algebra(name or f"G{n}{n}", vectors, gram, layouts=_null_pairs)


def orthogonal(p: int, q: int = 0, r: int = 0, name: str | None = None) -> Algebra:
    """Create G(p, q, r) with an orthogonal basis ``e1 ...``: `p` vectors with square +1, `q` with -1, `r` with 0."""
    vectors = [f"e{i + 1}" for i in range(p + q + r)]
    return Algebra(name or f"G({p},{q},{r})", vectors, [1] * p + [-1] * q + [0] * r)


def of_signature(p: int, q: int = 0, r: int = 0) -> Algebra:
    """Return the algebra of the catalog with these squares, with its layouts, or else `orthogonal`."""
    if min(p, q, r) < 0 or p + q + r == 0:
        raise AlgebraError("an algebra", f"{p}, {q} and {r} basis vectors", "natural numbers, not all zero")
    known = {(2, 0, 0): VGA2, (3, 0, 0): VGA3, (2, 0, 1): PGA2, (3, 0, 1): PGA3}
    return known.get((p, q, r)) or orthogonal(p, q, r)


def _null_gram(n: int) -> list[list[int]]:
    """Return the Gram matrix of Euclidean vectors e1..en and the null pair e0, einf with ``einf . e0 = -1``."""
    gram = [[int(i == j and i < n) for j in range(n + 2)] for i in range(n + 2)]
    gram[n][n + 1] = gram[n + 1][n] = -1
    return gram


def _with_null_pairs(name: str, flat: str, null: str, n: int) -> Algebra:
    """Create an algebra of Euclidean vectors and `n` null vectors, followed by their partners in the same order.

    The inner product of partners is -1.
    """
    first = len(flat.split())
    size = first + 2 * n
    gram = [[int(i == j and i < first) for j in range(size)] for i in range(size)]
    for k in range(first, first + n):
        gram[k][k + n] = gram[k + n][k] = -1
    return Algebra(name, f"{flat} {null}", gram)


COMPLEX = Algebra("COMPLEX", "e1", [-1], layouts=_numbers, conjugates=True)
DUAL_NUMBERS = Algebra("DUAL_NUMBERS", "e0", [0], layouts=_numbers, conjugates=True)
DOUBLE_NUMBERS = Algebra("DOUBLE_NUMBERS", "e1", [1], layouts=_numbers, conjugates=True)
QUATERNIONS = Algebra("QUATERNIONS", "e1 e2", [-1, -1], layouts=_quaternion, conjugates=True)
VGA2 = Algebra("VGA2", "e1 e2", [1, 1], layouts=_vga2)
VGA3 = Algebra("VGA3", "e1 e2 e3", [1, 1, 1], layouts=_vga3)
PGA2 = Algebra("PGA2", "e1 e2 e0", [1, 1, 0], "e20 e01 e012", layouts=_pga2)
PGA3 = Algebra("PGA3", "e1 e2 e3 e0", [1, 1, 1, 0], "e01 e02 e03 e021 e013 e032 e0123", layouts=_pga3)
CGA2 = Algebra("CGA2", "e1 e2 e0 einf", _null_gram(2), "e012inf", layouts=_cga2)
CGA3 = Algebra("CGA3", "e1 e2 e3 e0 einf", _null_gram(3), "e0123inf", layouts=_cga3)
STA = Algebra("STA", "g0 g1 g2 g3", [1, -1, -1, -1], "g10 g20 g30", layouts=_sta)
G33 = null_pairs(3)

# Algebras of conics, quadrics, cyclides and cubics, as in Gaalop scripts. They are not in `CATALOG` because their
# blades are too many to list.
GAC = _with_null_pairs("GAC", "e1 e2", "e0p e0m e0c einfp einfm einfc", 3)
QGA = _with_null_pairs("QGA", "e1 e2 e3", "e0x e0y e0z einfx einfy einfz", 3)
DCGA = Algebra(
    "DCGA", "e1 e2 e3 eo1 ei1 e6 e7 e8 eo2 ei2",
    [[_null_gram(3)[i % 5][j % 5] * (i // 5 == j // 5) for j in range(10)] for i in range(10)],
)  # fmt: skip
CCGA = _with_null_pairs("CCGA", "e1 e2", " ".join(f"e{x}{k + 1}" for x in "oi" for k in range(7)), 7)

CATALOG = {
    algebra.name: algebra
    for algebra in (
        COMPLEX, DUAL_NUMBERS, DOUBLE_NUMBERS, QUATERNIONS, VGA2, VGA3, PGA2, PGA3, CGA2, CGA3, STA, G33,
    )
}  # fmt: skip
