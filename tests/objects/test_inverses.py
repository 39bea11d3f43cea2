"""Inverses, products of elements with many blades, and logarithms, of single elements and of arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gacompiler import inverse, log, sqrt
from gacompiler.algebra.catalog import null_pairs, orthogonal
from gacompiler.errors import AlgebraError, InexactError, ZeroDivisorError
from gacompiler.objects import CGA3, PGA3, QUATERNIONS, STA, VGA2, VGA3, Space
from gacompiler.structure.affine import AffineSpace
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(8)


@all_cases("x", [CGA3.point(1, 2, 3), 1 + VGA3.e1, 0 * VGA3.e1, CGA3.einf, CGA3.e1 + CGA3.einf * CGA3.e1])
def test_elements_without_an_inverse_are_refused_or_nan(x: Any) -> None:
    if x.layout.blades == ("e1", "e1inf"):
        assert (x * x.inverse()).isclose(1)
        return
    with pytest.raises(ZeroDivisorError, match="inverse"):
        x.inverse()
    both = np.stack([x, 2 + VGA3.e1 if x.algebra == VGA3.algebra else CGA3.e1 + CGA3.e2])
    found = both.inverse()
    assert not np.isfinite(found.values[0]).all() and (found[1] * both[1]).isclose(1)


@pytest.mark.parametrize("signature", [(3, 3), (6,), (4, 4)])
@pytest.mark.slow
def test_versors_and_other_elements_of_many_dimensions(signature: tuple[int, ...]) -> None:
    space = Space(orthogonal(*signature))
    n = space.algebra.dimension
    versors = space.vector(RANDOM.normal(size=(20, n)))
    for _ in range(3):
        versors = versors * space.vector(RANDOM.normal(size=(20, n)))
    for x in (versors, space.of(space.algebra.full, RANDOM.normal(size=(20, 1 << n)))):
        found = x.inverse()
        size = np.linalg.norm(x.values, axis=-1) * np.linalg.norm(found.values, axis=-1)
        off = np.abs(np.stack([(x * found - 1)["1"], (found * x - 1)["1"]])) / size
        assert off.max() < 1e-13 and (x * found).isclose(1, atol=1e-9).all()
        assert (x[3].inverse() - found[3]).isclose(0, atol=1e-12 * size[3])
    square = space.e1 * space.e2 * space.pseudoscalar
    if (square * square).isclose(1):
        with pytest.raises(ZeroDivisorError, match="determinant is 0"):
            (1 + square).inverse()


@pytest.mark.slow
def test_products_by_a_table_are_exact() -> None:
    """Integers have exact products, so that every sign and place of the table is compared with the algebra's."""
    for algebra in (orthogonal(5, 2), null_pairs(4)):
        space, full = Space(algebra), algebra.full
        a, b = (space.of(full, RANDOM.integers(-9, 9, full.size).astype(float)) for _ in range(2))
        one, two = a.exactly(), b.exactly()
        for found, expected in ((a * b, one * two), (a ^ b, one ^ two), (a | b, one.product("inner_product", two))):
            assert found.exactly() == expected


@pytest.mark.slow
def test_exact_multivectors_with_doubles() -> None:
    """Affine maps are versors of G(4, 4), whose products with their reverses are numbers up to rounding errors."""
    space, off = AffineSpace(3), []
    for _ in range(200):
        matrix, shift, x = RANDOM.normal(size=(3, 3)), RANDOM.normal(size=3), RANDOM.normal(size=3)
        versor = space.versor(matrix.tolist(), shift.tolist())
        moved = space.coordinates(space.move(versor, space.point(x.tolist())))
        off.append(np.abs(np.array(moved) - (matrix @ x + shift)).max() * np.abs(np.linalg.det(matrix)))
    assert max(off) < 1e-11
    algebra = orthogonal(6)
    many = sum((float(RANDOM.normal()) * e for e in algebra.basis()), algebra.scalar(1.0)) * algebra.basis()[0]
    assert max(map(abs, (many * inverse(many) - 1).terms.values())) < 1e-13
    with pytest.raises(ZeroDivisorError):
        inverse(algebra.scalar(0.1) * 10 + 1.0 * algebra.basis()[2])


LONG = [
    VGA2.rotor(4.0), VGA3.rotor([0, 0, 1], 5.0), VGA3.rotor([1, 2, 2], np.linspace(-6.2, 6.2, 7)),
    PGA3.motor([1, 2, 2], 5.0, 2) * PGA3.translator([1, 2, 3]), PGA3.motor([1, 2, 2], 1.0, 2),
    CGA3.motor([1, 2, 2], 5.0, 2), QUATERNIONS.rotation([1, 2, 3], 5.0), STA.boost(0.5, 0, 0),
]  # fmt: skip


@pytest.mark.parametrize("versor", LONG, ids=lambda x: str(x.layout))
def test_logarithms_of_versors_themselves(versor: Any) -> None:
    """By default, a logarithm is that of the shorter motion, whose exponential may be the negative of the versor."""
    assert np.all(versor.log(shorter=False).exp().isclose(versor, atol=1e-14))
    root = versor.sqrt(shorter=False)
    assert np.all((root * root).isclose(versor, atol=1e-14)) and np.all(versor.power(0.5, shorter=False).isclose(root))
    again = versor.log().exp()
    assert np.all(again.isclose(versor, atol=1e-14) | again.isclose(-versor, atol=1e-14))


@pytest.mark.parametrize("space", [Space(orthogonal(4)), PGA3, STA, CGA3, Space(orthogonal(5))], ids=str)
def test_logarithms_of_versors_in_two_planes(space: Space) -> None:
    """Only the plane with the larger angle is turned the longer way, by up to a whole turn."""
    size = len(space.algebra.blades(2))
    versors = space.bivector(np.random.default_rng(3).uniform(-2, 2, (200, size))).exp()
    found = versors.log(shorter=False)
    known = np.isfinite(found.values).all(-1)
    negative = versors["1"] < 0
    assert negative.any() and known[~negative].all() and known.mean() > 0.9
    scale = np.abs(versors.values).max(-1)
    off = np.abs((found.exp() - versors).values).max(-1)[known] / scale[known]
    assert off.max() < 1e-8 and np.median(off) < 1e-14


def test_logarithms_that_are_not_determined() -> None:
    four = Space(orthogonal(4))
    for versor in (four.e12 * four.e34, four.of(four.algebra.UNIT_EVEN, np.eye(8)[-1])):
        with pytest.raises(AlgebraError, match="log: e1234, which has no logarithm, or many"):
            versor.log()
    for divisor in (1 + VGA2.e1, CGA3.point(1, 2, 3)):
        with pytest.raises(AlgebraError, match=r"log: .*, which has no logarithm, or many"):
            divisor.log()
    for null in (CGA3.point(1, 2, 3), STA.vector(1, 0, 0, 1), VGA2.of(VGA2.full, [-1.0, 1, 0, 1])):
        with pytest.raises(AlgebraError, match=r"sqrt: .*, which has no square root, or many"):
            null.sqrt()


NEARLY = [
    VGA3.multivector({"1": 0.1 * 3, "e1": 0.3}), STA.vector(0.1 * 3, 0.3, 0, 0),
    PGA3.multivector({"1": 1e-17, "e01": 1.0, "e0123": 2.0}) * PGA3.e03, CGA3.multivector({"1": 0.1 * 3, "e1": 0.3}),
]  # fmt: skip


@all_cases("x", NEARLY)
def test_elements_without_an_inverse_up_to_rounding(x: Any) -> None:
    """Their inverses would be made of rounding errors only; translators of any length have exact ones."""
    with pytest.raises(ZeroDivisorError, match=r"determinant is 0 up to rounding.*in an array, such elements give NaN"):
        x.inverse()
    with pytest.raises(ZeroDivisorError, match="determinant is 0"):
        inverse(x)
    found = np.stack([x, x]).inverse()
    assert found.shape == (2,) and np.isnan(found.values).all()


@pytest.mark.slow
def test_inverses_against_exact_ones() -> None:
    """Also of elements whose squares are outside the range of doubles, and of long translators of any weight."""
    given = [
        VGA3.vector(1e-200, 2e-200, 0), VGA3.vector(3e250, 0, 1e250), PGA3.translator([1e9, 2, 3]) * 2,
        CGA3.translator([1e9, 2, 3]) * 2, PGA3.translator([1e9, 2, 3]) + 1, STA.vector(1, 0.5, 1e-3, 0),
        *(space.of(space.algebra.full, RANDOM.normal(size=space.algebra.full.size)) for space in (VGA3, PGA3, CGA3)),
        *(space.of(space.algebra.even, RANDOM.normal(size=space.algebra.even.size)) for space in (VGA3, STA, CGA3)),
    ]  # fmt: skip
    for x in given:
        exact, found = inverse(x.exactly()), x.inverse()
        size = max(abs(value) for value in exact.terms.values())
        assert max(map(abs, ((found.exactly() - exact) / size).terms.values()), default=0) < 1e-11


def test_layouts_of_inverses_do_not_depend_on_coefficients() -> None:
    space = Space(orthogonal(6))
    layout = space.algebra.layout("PLANES", "1 e12 e34 e56")
    versor, other = space.of(layout, 1.0, 2, 0, 0), space.of(layout, 1.0, 2, 3, 4)
    assert versor.inverse().layout == other.inverse().layout == np.stack([versor, other]).inverse().layout
    assert versor.inverse().isclose(0.2 - 0.4 * space.e12)
    vector = space.vector(1.0, 2, 3, 4, 5, 6)
    assert vector.inverse().layout == vector.layout and vector.inverse().isclose(vector / 91)


def test_functions_that_are_not_determined() -> None:
    """A single element raises an error that names it; in an array it is NaN."""
    four = Space(orthogonal(4))
    turns = four.e12 * four.e34
    for run in (lambda x: x.log(), lambda x: x.sqrt(), lambda x: x.power(0.3)):
        with pytest.raises(AlgebraError, match=r": e1234, which has no .*, or many; expected .*; in an array"):
            run(turns)
        found = run(np.stack([turns, (four.e12 + four.e34).exp()]))
        assert np.isnan(found.values[0]).all() and np.isfinite(found.values[1]).all()
    number = VGA3.e1 * VGA3.e1
    assert (4 * number).inverse() == 0.25
    with pytest.raises(ZeroDivisorError, match="the number 0"):
        (0 * number).inverse()
    both = four.algebra.pseudoscalar
    with pytest.raises(AlgebraError, match="e1234, which has no logarithm, or many"):
        log(1.0 * both, unit=True)
    with pytest.raises(InexactError, match="is not rational"):  # neither are the logarithms of other exact rotors
        log(both, unit=True)
    for each in (both, 1.0 * both):
        with pytest.raises(AlgebraError, match="e1234, which has no square root, or many"):
            sqrt(each, unit=True)
    isoclinic = (0.4 * (four.e12 + four.e34)).exp()
    assert isoclinic.log().isclose(0.4 * (four.e12 + four.e34))
    with pytest.raises(AlgebraError, match="no logarithm, or many"):
        (-1 * isoclinic).log(shorter=False)
