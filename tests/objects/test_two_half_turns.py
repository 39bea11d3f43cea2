"""Logarithms, roots and powers of rotations by nearly pi in two planes, whose scalar part has no correct digit."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from many_planes import PI, exact_exp, example, frame, rounded, size, turn

from gacompiler import Cl
from gacompiler.errors import AlgebraError

SIGNATURES = [(4,), (0, 4), (5,), (4, 1), (3, 2)]
LACKS = [("1e-3", "1e-3"), ("1e-8", "1e-8"), ("1e-11", "3e-9"), ("1e-13", "1e-7"), ("0", "1e-10"), ("2e-12", "0.3")]


@pytest.mark.parametrize("signature", SIGNATURES, ids=str)
@pytest.mark.parametrize("lacks", LACKS, ids=str)
def test_two_half_turns(signature: tuple[int, ...], lacks: tuple[str, str]) -> None:
    """The exponential of the logarithm, in 40 digits, is the versor, as are products of roots. Boosts square errors."""
    for sign in (1, -1):
        angles = [PI - mpmath.mpf(lacks[0]), sign * (PI - mpmath.mpf(lacks[1]))]
        versor = example(signature, angles)[1]
        with mpmath.workdps(40):
            power = exact_exp(versor.log().exactly().map(lambda value: mpmath.mpf(value.numerator) / value.denominator))
        found = np.array([float(power[name]) for name in versor.layout.blades])
        assert min(np.abs(found - s * versor.values).max() for s in (1, -1)) <= 2e-15 * size(versor) ** 2
        root, third = versor.sqrt(), versor.power(1 / 3)
        for whole in (root * root, third * third * third):
            assert min(size(whole - versor), size(whole + versor)) <= 2e-15 * size(versor) ** 2


@pytest.mark.parametrize("signature", SIGNATURES, ids=str)
def test_scalar_parts_with_rounding_errors(signature: tuple[int, ...]) -> None:
    """An error of 1e-16 in the scalar part, larger than that part itself, changes the results by as much."""
    versor = example(signature, [PI - mpmath.mpf("1e-9"), PI - mpmath.mpf("2e-9")])[1]
    for error in (1e-16, -1e-16):
        moved = versor + error
        root = moved.sqrt()
        for whole in (root * root, moved.log().exp()):
            assert min(size(whole - moved), size(whole + moved)) <= 2e-15 * size(versor) ** 2


@pytest.mark.parametrize("boost", ["0.1", "1"])
@pytest.mark.parametrize("lack", ["1e-3", "1e-8", "1e-13"])
def test_half_turns_beside_boosts(boost: str, lack: str) -> None:
    """In G(2, 2), half of the rotations of both planes commutes with boosts, which are far larger than its sine."""
    with mpmath.workdps(40):
        algebra = Cl(2, 2).algebra
        angle, size_of_boost = (PI - mpmath.mpf(lack)) / 2, mpmath.mpf(boost)
        turned = turn(algebra, "e12", angle) * turn(algebra, "e34", angle)
        boosted = turn(algebra, "e13", size_of_boost) * turn(algebra, "e24", -size_of_boost)
        assert max(abs(x) for x in (turned * boosted - boosted * turned).terms.values()) < 1e-38
        exact = (frame(algebra) * turned * boosted) * ~frame(algebra)
    versor = rounded(algebra, exact, algebra.even.support)
    logarithm, root, third = versor.log(), versor.sqrt(), versor.power(1 / 3)
    with mpmath.workdps(40):
        power = exact_exp(logarithm.exactly().map(lambda value: mpmath.mpf(value.numerator) / value.denominator))
    found = np.array([float(power[name]) for name in versor.layout.blades])
    limit = 2e-15 * (size(versor) ** 2 + size(logarithm) ** 2)
    assert min(np.abs(found - s * versor.values).max() for s in (1, -1)) <= limit
    for whole in (root * root, third * third * third):
        assert min(size(whole - versor), size(whole + versor)) <= limit


def test_half_turns_beside_rounding_errors() -> None:
    """Rounding errors in planes beside those of the half turns, as products of versors have them, do not grow."""
    versor = example((5,), [PI - mpmath.mpf("1e-12"), PI - mpmath.mpf("2e-12")])[1]
    rng = np.random.default_rng(3)
    for _ in range(20):
        noise = {name: 1e-16 * rng.normal() for name in versor.layout.blades}
        moved = versor + Cl(5).multivector(noise)
        root = moved.sqrt()
        for whole in (root * root, moved.log().exp()):
            assert min(size(whole - moved), size(whole + moved)) <= 4e-15


def test_two_half_turns_have_many_logarithms() -> None:
    with pytest.raises(AlgebraError, match="no logarithm, or many"):
        Cl(4).multivector({"1": 0.0, "e12": 0.0, "e1234": 1.0}).log()


def test_signs_of_spinors_of_boosts() -> None:
    """The negative of a boost turns by 2 pi in a plane that is not determined, also if rounding errors suggest one."""
    for space, names in ((Cl(1, 3), ("e23", "e14")), (Cl(3, 2), ("e12", "e34")), (Cl(4, 1), ("e12", "e35"))):
        turned = space.multivector({names[0]: np.pi, names[1]: 0.7}).exp()
        assert turned["1"] < -1
        with pytest.raises(AlgebraError, match="no logarithm, or many"):
            turned.log(shorter=False)
        half = space.multivector({names[0]: 2.0, names[1]: 0.7}).exp()
        assert half["1"] < 0 and size(half.log(shorter=False).exp() - half) < 1e-14


@pytest.mark.parametrize("signature", [(5, 1), (6, 1)], ids=str)
def test_signs_of_spinors_beside_boosts(signature: tuple[int, ...]) -> None:
    """A large boost does not hide the plane of the largest angle, in which spinors are turned the longer way."""
    n = sum(signature)
    versor = Cl(*signature).multivector({"e12": 2.0, "e34": 0.2, f"e5{n}": 1.5}).exp()
    assert versor["1"] < 0
    assert size(versor.log(shorter=False).exp() - versor) <= 2e-15 * size(versor) ** 2


def test_negative_numbers_beside_vectors_have_no_root() -> None:
    """-2 + 1e-12 e1 is two real numbers, both negative, although the square of its vector is lost beside 4."""
    space = Cl(2)
    numbers = space.multivector({"1": [-2.0, -2.0, 2.0], "e1": [1e-12, 1.0, 1e-12]})
    with pytest.raises(AlgebraError, match="no square root, or many"):
        space.multivector({"1": -2.0, "e1": 1e-12}).sqrt()
    roots = numbers.sqrt()
    assert np.isnan(roots.values[:2]).any(-1).all()
    assert np.abs((roots * roots - numbers).values[2]).max() < 1e-15
