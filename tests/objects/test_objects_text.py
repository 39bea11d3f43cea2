"""Numeric objects from text: sums of blades in usual notation, and everything that is printed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gacompiler.algebra.algebra import Algebra
from gacompiler.errors import AlgebraError, GacError, LayoutError
from gacompiler.objects import CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA3, MultivectorArray, Space
from tests.support.all_cases import all_cases

OBLIQUE = Space(Algebra("OBLIQUE", "a b ab", [[2, 1, 0], [1, -1, 0], [0, 0, 1]]))  # blades are joined by ^
RANDOM = np.random.default_rng(0)

WRITTEN: dict[str, dict[str, float]] = {
    "1 + 2*e12 - 0.5e01": {"1": 1, "e12": 2, "e01": -0.5},
    "e21": {"e12": -1},
    "-.5 e3^e1 + 2e13": {"e13": 2.5},
    "  - - 3\n* e1 ": {"e1": 3},
    "2e12": {"e12": 2},
    "2e+12e12 - 1E-3 e0": {"e12": 2e12, "e0": -1e-3},
    "3. e032+e123": {"e032": 3, "e123": 1},
    "inf e1 - 2": {"1": -2, "e1": np.inf},
}


@all_cases("text", WRITTEN)
def test_sums_in_usual_notation(text: str) -> None:
    found, wanted = PGA3.parse(text), PGA3.multivector(WRITTEN[text])
    assert found.layout == wanted.layout and np.array_equal(found.values, wanted.values)


def test_a_number_alone_is_a_scalar() -> None:
    assert PGA3.parse("2.5") == 2.5 and isinstance(PGA3.parse("1 + 1"), float)
    assert PGA3.parse("[1, -2]").tolist() == [1, -2]
    assert PGA3.parse("2.5", PGA3.even).layout == PGA3.even


def printed() -> list[Any]:
    return [
        PGA3.point(1, 2, 3),
        PGA3.point([[1, 2, 3], [4, 5, 0]]),
        PGA3.point(np.zeros((0, 3))),
        PGA3.point(np.zeros((2, 3, 3), "f4")),
        PGA2.line(0, -1, 2),
        CGA3.point(1, 2, 3),
        CGA3.sphere([1, 2, 3], 2),
        STA.vector(1, -2, 0, 1e30),
        VGA3.vector(0, 0, 0),
        VGA3.multivector({"e1": 1 + 2j, "e12": -1}),
        VGA3.multivector({"e1": 1e-300, "e2": -1e300}),
        OBLIQUE.multivector({"a^b": 2, "a^ab": -1, "1": 0.5}),
        QUATERNIONS.of(QUATERNIONS.UNIT_QUATERNION, 0.5, 0.5, 0.5, -0.5),
    ]


@all_cases("x", printed())
def test_printed_text_is_read_back(x: MultivectorArray) -> None:
    space = Space(x.algebra)
    again = space.parse(repr(x))
    assert again.layout == x.layout and again.shape == x.shape and np.array_equal(again.values, x.values)
    plain = space.parse(str(x), x.layout)
    assert plain.layout == x.layout and np.array_equal(plain.values, x.reshape(plain.shape).values)


@all_cases("space", [VGA3, PGA3, CGA3, STA, OBLIQUE])
def test_all_digits_round_trip(space: Space) -> None:
    full = space.algebra.full
    for scale in (1.0, 1e-200, 1e200):
        x = space.of(full, scale * RANDOM.normal(size=(5, full.size)))
        assert np.array_equal(space.parse(f"{x:.17g}").values, x.values)


def test_motors_of_six_digits_are_unit_motors() -> None:
    motors = PGA3.motor(RANDOM.normal(size=(5, 3)), RANDOM.normal(size=5), RANDOM.normal(size=5))
    found = PGA3.parse(repr(motors))
    assert found.layout == PGA3.MOTOR and np.all(found.isclose(motors, rtol=1e-5))
    square = (found * ~found).as_layout(PGA3.even).values
    assert np.abs(square - np.eye(8)[0]).max() < 1e-15


REFUSED: dict[str, tuple[type[GacError], str]] = {
    "": (AlgebraError, "character 1 of '': the end; expected a number or a blade"),
    "1 +": (AlgebraError, "character 4 of .*the end"),
    "2e5": (AlgebraError, "character 2 .*'e5', not a blade of PGA3.*exponent of a number with a sign"),
    "e1 + x2": (AlgebraError, "character 6 .*'x2', not a blade"),
    "e12 e13": (AlgebraError, r"character 5 .*'e13'; expected \+, -"),
    "2 *": (AlgebraError, "character 4 .*expected a blade"),
    "e1*2": (AlgebraError, "character 3 "),
    "e11": (AlgebraError, "'e11', not a blade"),
    "[e1 e2]": (AlgebraError, "character 5 .*expected ','"),
    "[e1, e2": (AlgebraError, "character 8 .*the end"),
    "[e1, ..., e2]": (AlgebraError, "all elements.*save"),
    "(1+2) e1": (AlgebraError, "a number or a blade"),
    "(1+*j) e1": (AlgebraError, "a complex number"),
    "PGA2.POINT(e12)": (AlgebraError, "a multivector of PGA2; expected one of PGA3"),
    "PGA3.NONE(e12)": (AlgebraError, "no layout NONE"),
    "PGA3.dimension(e12)": (AlgebraError, "PGA3.dimension; expected a layout of PGA3"),
    "PGA3.POINT(e123": (AlgebraError, r"expected '\)'"),
    "PGA3.POINT of shape (3,):\n[e123]": (AlgebraError, "1 multivectors; expected 3"),
    "PGA3.POINT(e123 + e1)": (LayoutError, "e1 = 1; expected only"),
    "PGA3.MOTOR(2)": (LayoutError, "x ~x - 1"),
}


@all_cases("text", REFUSED)
def test_errors_name_the_position_in_other_text(text: str) -> None:
    kind, words = REFUSED[text]
    with pytest.raises(kind, match=words):
        PGA3.parse(text)


def test_other_arguments_are_rejected() -> None:
    with pytest.raises(AlgebraError, match="of type int; expected text"):
        PGA3.parse(5)  # type: ignore[arg-type]
    with pytest.raises(AlgebraError, match="expected one of PGA3"):
        PGA3.parse("e123", PGA2.POINT)
    with pytest.raises(AlgebraError, match="a multivector of CGA3; expected one of PGA3"):
        PGA3.parse("CGA3.POINT(e123)", PGA3.POINT)
    # A large coefficient does not affect the weight and the other blades.
    for text in ("1000000 e032 + 3 e123", "1000000 e032 + 5 e1 + e123", "1000000 e032"):
        with pytest.raises(LayoutError):
            PGA3.parse(text, PGA3.POINT)
    shortened = PGA3.point(np.zeros((9, 3)))
    with pytest.raises(AlgebraError, match=r"save\(\) and load\(\)"):
        PGA3.parse(repr(shortened))
