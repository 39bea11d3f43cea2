"""Exponentials, logarithms and powers over null and oblique bases of six to eight vectors, in kernels with loops."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from many_planes import PI, exact_exp

import gacompiler as ga
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, G33, orthogonal
from gacompiler.algebra.layout import Layout
from gacompiler.errors import KernelError
from gacompiler.frontend.unit_frames import frame_of

ANGLES = {
    "near zero": [1e-9, 2e-9, -1e-9],
    "equal": [1.0, 1.0, 0.5],
    "opposite": [1.0, -1.0, 1.0],
    "nearly equal": [1.0, 1 + 1e-9, 1.0],
    "pi - 1e-3": [PI - mpmath.mpf("1e-3"), 0.3, 0.5],
    "pi - 1e-7": [PI - mpmath.mpf("1e-7"), 2.5, 2.0],
    "pi - 1e-13": [PI - mpmath.mpf("1e-13"), 0.3, 0.5],
    "2 pi - 1e-3": [2 * PI - mpmath.mpf("1e-3"), 0.3, 0.5],
}


def oblique() -> Algebra:
    """Sums of the first vectors of an orthogonal basis."""
    gram = [[sum(Fraction(k <= min(i, j)) for k in range(6)) for j in range(6)] for i in range(6)]
    return Algebra("oblique", " ".join(f"e{k}" for k in range(1, 7)), gram)


@pytest.mark.parametrize("algebra", [G33, oblique()], ids=["null", "oblique"])
def test_frames_are_exact(algebra: Algebra) -> None:
    frame = frame_of(algebra)
    assert frame is not None
    for blade, image in frame.to_frame.items():
        total = algebra.scalar(0)
        for target, factor in image.terms.items():
            total = total + frame.from_frame[target] * factor
        assert dict(total.terms) == {blade: 1}
    # The change of basis preserves products: squares of bivectors are those of their images.
    for blade in algebra.blades(2):
        own = algebra.multivector({algebra.spelling(blade)[1]: 1})
        assert (own * own).scalar == (frame.to_frame[blade] * frame.to_frame[blade]).scalar


def test_degenerate_metrics_have_no_frame() -> None:
    assert frame_of(orthogonal(5, 0, 1)) is None and frame_of(CGA3) is None


def bivectors(algebra: Algebra) -> Layout:
    return algebra.layout("bivectors", " ".join(algebra.spelling(blade)[1] for blade in algebra.blades(2)))


def null_basis(n_pairs: int, n_unit: int) -> Algebra:
    """Pairs of null vectors with various inner products, and unit vectors."""
    products = [Fraction(1), Fraction(1, 2), Fraction(-2), Fraction(3)][:n_pairs]
    n = 2 * n_pairs + n_unit
    gram = [[Fraction(int(i == j >= 2 * n_pairs)) for j in range(n)] for i in range(n)]
    for k, value in enumerate(products):
        gram[k][n_pairs + k] = gram[n_pairs + k][k] = value
    return Algebra(f"null{n}", " ".join(f"n{k}" for k in range(1, n + 1)), gram)


def planes_of(algebra: Algebra, n_pairs: int) -> list[Any]:
    """Commuting planes: two of rotations, and one of a boost for each further pair, or of a rotation with a vector."""
    vectors = algebra.basis()
    plus, minus = [], []
    for w, v in zip(vectors[:n_pairs], vectors[n_pairs : 2 * n_pairs], strict=True):
        half = 1 / (2 * Fraction((w * v).scalar))
        plus.append(w + v * half)
        minus.append(w - v * half)
    turned = [plus[2] * vector for vector in vectors[2 * n_pairs :]]
    return [plus[0] * plus[1], minus[0] * minus[1], *(turned or [plus[k] * minus[k] for k in range(2, n_pairs)])]


def example(angles: list[Any], algebra: Algebra = G33, n_pairs: int = 3) -> tuple[Any, Any]:
    """Return a bivector and its exponential, with 40 digits: two rotations and boosts, moved by a versor."""
    with mpmath.workdps(40):
        vectors = algebra.basis()
        mover = exact_exp(((vectors[0] ^ vectors[4]) + (vectors[1] ^ vectors[2])).map(lambda x: mpmath.mpf(x) / 7))
        mover = exact_exp((vectors[2] ^ vectors[3]).map(lambda x: mpmath.mpf(x) / 5)) * mover
        b, versor = algebra.scalar(0), algebra.scalar(mpmath.mpf(1))
        for plane, angle in zip(planes_of(algebra, n_pairs), angles, strict=False):
            half = mpmath.mpf(angle) / 2
            square = plane * plane
            assert abs(square.scalar) == 1 and set(square.terms) == {0}
            even, odd = (mpmath.cos, mpmath.sin) if square.scalar < 0 else (mpmath.cosh, mpmath.sinh)
            b = b + plane.map(lambda x, half=half: x * half)
            sine = odd(half)
            versor = versor * (algebra.scalar(even(half)) + plane.map(lambda x, sine=sine: x * sine))
        return (mover * b * ~mover).grade(2), mover * versor * ~mover


def values(x: Any, layout: Layout) -> np.ndarray:
    return np.array([slot.sign * float(x.terms.get(slot.blade, 0)) for slot in layout.stored])


def compiled(algebra: Algebra) -> list[Any]:
    """Compile logarithms of unit versors and exponentials of bivectors."""

    @ga.kernel(r=algebra.UNIT_EVEN, loops=True)
    def logarithm(r: Any) -> Any:
        return ga.log(r)

    @ga.kernel(b=bivectors(algebra), loops=True)
    def exponential(b: Any) -> Any:
        return ga.exp(b)

    return [ga.compile(each, "arrays", effort=0) for each in (logarithm, exponential)]


@pytest.mark.slow
def test_accuracy() -> None:
    """Errors are at most 1e-13 of the largest coefficient; null bivectors have the exponential 1 + b.

    A power is the exponential of a multiple of the logarithm, as in other bases.
    """
    layout = bivectors(G33)
    log, exp = compiled(G33)
    for name, angles in ANGLES.items():
        b, versor = example(angles)
        r = values(versor, G33.UNIT_EVEN)
        size = np.abs(r).max()
        error = np.abs(exp(values(b, layout)) - values(versor, G33.even)).max()
        assert error <= 1e-13 * size, name
        shorter = [x - 2 * PI if x > PI else x for x in map(mpmath.mpf, angles)]
        known = values(example(shorter)[0], layout)
        assert np.abs(log(r) - known).max() <= 1e-13 * np.abs(known).max() * size**2, name
    null = np.zeros(layout.size)
    null[layout.blades.index("w12")] = 0.75
    known = np.zeros(G33.even.size)
    known[[G33.even.blades.index("1"), G33.even.blades.index("w12")]] = 1, 0.75
    assert np.abs(exp(null) - known).max() < 1e-15
    assert np.abs(log(known) - null).max() < 1e-15


@pytest.mark.slow
@pytest.mark.parametrize(("n_pairs", "n_unit"), [(3, 1), (4, 0)], ids=["seven", "eight"])
def test_accuracy_over_seven_and_eight_vectors(n_pairs: int, n_unit: int) -> None:
    """Errors are at most 1e-14 of the largest coefficient, also near half and whole turns beside other planes."""
    algebra = null_basis(n_pairs, n_unit)
    layout = bivectors(algebra)
    log, exp = compiled(algebra)
    for name, angles in ANGLES.items():
        b, versor = example([*angles, 0.7], algebra, n_pairs)
        r = values(versor, algebra.UNIT_EVEN)
        size = np.abs(r).max()
        error = np.abs(exp(values(b, layout)) - values(versor, algebra.even)).max()
        assert error <= 1e-14 * size, name
        shorter = [x - 2 * PI if x > PI else x for x in map(mpmath.mpf, [*angles, 0.7])]
        known = values(example(shorter, algebra, n_pairs)[0], layout)
        assert np.abs(log(r) - known).max() <= 1e-14 * np.abs(known).max() * size**2, name


def test_what_is_refused_says_what_to_do() -> None:
    def logarithm(r: Any) -> Any:
        return ga.log(r)

    with pytest.raises(KernelError, match="loops=True"):
        ga.compile(ga.kernel(r=G33.UNIT_EVEN)(logarithm))
    with pytest.raises(KernelError, match=r"e0 = e\+ \+ e-"):
        ga.compile(ga.kernel(r=orthogonal(5, 0, 1).UNIT_EVEN, loops=True)(logarithm))
