"""Products, involutions and sandwiches against two other libraries: clifford (numeric) and kingdon."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, PGA3, STA, VGA3, orthogonal
from gacompiler.algebra.duality import regressive_product
from gacompiler.algebra.involutions import clifford_conjugate, grade_involution, reverse
from gacompiler.algebra.multivector import Multivector
from gacompiler.algebra.versors import commutator, inverse, sandwich

pytestmark = pytest.mark.peers

TOLERANCE = 1e-12


def random_element(algebra: Algebra, rng: np.random.Generator, grades: tuple[int, ...] = ()) -> Multivector:
    return Multivector(algebra, {blade: float(rng.normal()) for blade in algebra.blades(*grades)})


def close(mine: dict[int, float], theirs: dict[int, float]) -> bool:
    size = max([1.0, *(abs(value) for value in mine.values())])
    return all(
        abs(mine.get(blade, 0.0) - theirs.get(blade, 0.0)) <= TOLERANCE * size for blade in mine.keys() | theirs.keys()
    )


# clifford


class CliffordPeer:
    """clifford's algebra of the same vectors; conformal null vectors are made of its e4 and e5."""

    def __init__(self, algebra: Algebra) -> None:
        clifford = pytest.importorskip("clifford")
        if algebra is CGA3:
            layout, blades = clifford.Cl(4, 1)
            e4, e5 = blades["e4"], blades["e5"]
            vectors = [blades["e1"], blades["e2"], blades["e3"], 0.5 * (e5 - e4), e4 + e5]
        else:
            squares = [int(algebra.gram[k][k]) for k in range(algebra.dimension)]
            layout = clifford.Layout(squares)
            vectors = layout.basis_vectors_lst
        self.algebra = algebra
        self.blades = {0: layout.scalar}
        for blade in algebra.blades()[1:]:
            low = blade & -blade
            self.blades[blade] = vectors[low.bit_length() - 1] ^ self.blades[blade ^ low]
        self._basis = np.array([self.blades[blade].value for blade in algebra.blades()]).T

    def of(self, x: Multivector) -> Any:
        return sum(float(value) * self.blades[blade] for blade, value in x.terms.items())

    def terms(self, theirs: Any) -> dict[int, float]:
        values = np.linalg.solve(self._basis, theirs.value)
        return dict(zip(self.algebra.blades(), map(float, values), strict=True))


@pytest.mark.parametrize("algebra", [STA, CGA3, orthogonal(0, 3)], ids=lambda a: a.name)
def test_clifford(algebra: Algebra) -> None:
    peer = CliffordPeer(algebra)
    rng = np.random.default_rng(1)
    for _ in range(5):
        x, y = random_element(algebra, rng), random_element(algebra, rng)
        a, b = peer.of(x), peer.of(y)
        for mine, theirs in (
            (x * y, a * b),
            (x ^ y, a ^ b),
            (x.product("left_contraction", y), a.lc(b)),
            (x.product("hestenes_product", y), a | b),
            (reverse(x), ~a),
            (grade_involution(x), a.gradeInvol()),
            (clifford_conjugate(x), a.conjugate()),
            (commutator(x, y), (a * b - b * a) / 2),
            (x.grade(2), a(2)),
        ):
            assert close(dict(mine.terms), peer.terms(theirs))


@pytest.mark.parametrize("algebra", [STA, CGA3], ids=lambda algebra: algebra.name)
def test_clifford_versors(algebra: Algebra) -> None:
    peer = CliffordPeer(algebra)
    rng = np.random.default_rng(2)
    vectors = [random_element(algebra, rng, (1,)) for _ in range(2)]
    rotor = vectors[0] * vectors[1]
    x = random_element(algebra, rng)
    assert close(dict(sandwich(rotor, x).terms), peer.terms(peer.of(rotor) * peer.of(x) * ~peer.of(rotor)))
    odd = sandwich(vectors[0], x)
    assert close(dict(odd.terms), peer.terms(peer.of(vectors[0]) * peer.of(x).gradeInvol() * peer.of(vectors[0])))
    mine = {blade: float(value) for blade, value in inverse(rotor).terms.items()}
    assert close(mine, peer.terms(peer.of(rotor).inv()))


# kingdon


class KingdonPeer:
    """kingdon's algebra of the same signature, with its vectors in our order."""

    def __init__(self, algebra: Algebra) -> None:
        kingdon = pytest.importorskip("kingdon")
        signature = [int(algebra.gram[k][k]) for k in range(algebra.dimension)]
        self._peer = kingdon.Algebra(signature=signature, start_index=1)
        self.algebra = algebra

    def of(self, x: Multivector) -> Any:
        blades = self.algebra.blades()
        return self._peer.multivector(values=[float(x.terms.get(blade, 0.0)) for blade in blades], keys=blades)

    def terms(self, theirs: Any) -> dict[int, float]:
        return {int(key): float(value) for key, value in theirs.items()}


@pytest.mark.parametrize(
    "algebra", [VGA3, PGA3, STA, orthogonal(3, 1), orthogonal(2, 1, 1), orthogonal(4, 1)], ids=lambda a: a.name
)
def test_kingdon(algebra: Algebra) -> None:
    peer = KingdonPeer(algebra)
    rng = np.random.default_rng(3)
    x, y = random_element(algebra, rng), random_element(algebra, rng)
    a, b = peer.of(x), peer.of(y)
    for mine, theirs in (
        (x * y, a * b),
        (x ^ y, a ^ b),
        (x.product("left_contraction", y), a.lc(b)),
        (x.product("right_contraction", y), a.rc(b)),
        (x.product("inner_product", y), a | b),
        (x.product("scalar_product", y), a.sp(b)),
        (commutator(x, y), a.cp(b)),
        (reverse(x), a.reverse()),
        (grade_involution(x), a.involute()),
        (clifford_conjugate(x), a.conjugate()),
        (x.grade(2), a.grade(2)),
        (x - y, a - b),
    ):
        assert close(dict(mine.terms), peer.terms(theirs))


@pytest.mark.parametrize("algebra", [PGA3, VGA3, orthogonal(4, 1)], ids=lambda algebra: algebra.name)
def test_kingdon_versors(algebra: Algebra) -> None:
    peer = KingdonPeer(algebra)
    rng = np.random.default_rng(4)
    versor = random_element(algebra, rng, (1,)) * random_element(algebra, rng, (1,))
    for k in range(1, algebra.dimension):
        x = random_element(algebra, rng, (k,))
        theirs = peer.of(versor) * peer.of(x) * peer.of(versor).reverse()
        assert close(dict(sandwich(versor, x).terms), peer.terms(theirs))


def test_kingdon_joins_points_as_we_do() -> None:
    """The regressive product up to its orientation: which pseudoscalar is positive is a choice of spelling."""
    peer = KingdonPeer(PGA3)
    rng = np.random.default_rng(5)
    x, y = (random_element(PGA3, rng, (3,)) for _ in range(2))
    mine = dict(regressive_product(x, y).terms)
    theirs = peer.terms(peer.of(x) & peer.of(y))
    assert close(mine, theirs) or close({blade: -value for blade, value in mine.items()}, theirs)
