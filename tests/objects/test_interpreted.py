"""Operations on arrays before they are compiled: the same bits as the compiled function, for all memory orders."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from gacompiler.errors import ZeroDivisorError
from gacompiler.ir.program import Argument, Line, Program, Result
from gacompiler.ir.scalar import Op
from gacompiler.objects import CGA3, PGA3, STA, VGA3
from gacompiler.objects.definitions import BINARY, UNARY
from gacompiler.objects.interpreted import Interpreted, flat_form, is_interpreted
from gacompiler.objects.native import extension as find_extension
from gacompiler.objects.operators import operator_of

extension = find_extension()
pytestmark = pytest.mark.skipif(extension is None, reason="needs the extension")

SIZES = (1, 2, 63, 64, 65, 200)
PAIRS = (
    (PGA3.MOTOR, PGA3.PLANE), (PGA3.EVEN, PGA3.LINE), (CGA3.POINT, CGA3.POINT), (VGA3.VECTOR, VGA3.BIVECTOR),
    (STA.EVEN, STA.VECTOR), (PGA3.POINT, PGA3.POINT),
)  # fmt: skip


def in_orders(rows: np.ndarray[Any, Any]) -> Iterator[np.ndarray[Any, Any]]:
    """Yield equal arrays: in C order, as columns, and with gaps."""
    yield rows
    yield np.asfortranarray(rows)
    gaps = np.zeros((*(2 * n for n in rows.shape),))
    gaps[(slice(None, None, 2),) * rows.ndim] = rows
    yield gaps[(slice(None, None, 2),) * rows.ndim]


def test_all_operations_have_the_values_of_exact_numbers() -> None:
    """Quarters are exact, so that sums, products and comparisons are those of rational numbers."""
    x, y, z, third = "x0", "x1", "x2", Fraction(3, 4)
    lines = (
        Line("t0", Op.ADD, (x, y)), Line("t1", Op.SUBTRACT, (x, third)), Line("t2", Op.MULTIPLY, (y, z)),
        Line("t3", Op.DIVIDE, (z, Fraction(2))), Line("t4", Op.NEGATE, (x,)), Line("t5", Op.ABS, (y,)),
        Line("t6", Op.MINIMUM, (x, z)), Line("t7", Op.MAXIMUM, (x, z)), Line("t8", Op.LESS, (x, y)),
        Line("t9", Op.LESS_EQUAL, (x, x)), Line("t10", Op.EQUAL, (y, z)), Line("t11", Op.SELECT, ("t8", y, z)),
        Line("t12", Op.MULTIPLY, (x, x)), Line("t13", Op.SQRT, ("t12",)), Line("t14", Op.MULTIPLY, (x, z)),
        Line("t15", Op.SUBTRACT, ("t14", "t0")), Line("t16", Op.SUBTRACT, ("t0", "t2")),
        Line("t17", Op.MULTIPLY, (x, "t3")), Line("t18", Op.ADD, ("t17", "t5")),
    )  # fmt: skip
    names = [f"t{k}" for k in (0, 1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 16, 18)]
    program = Program("f", (Argument("x", (3,), (x, y, z)),), lines, (Result("out", (15,), (*names,)),))
    assert is_interpreted(program, extension)
    rng = np.random.default_rng(5)
    rows = rng.integers(-9, 9, (130, 3)) / 4
    found = Interpreted(program, extension).attempt(rows)
    for (a, b, c), row in zip(rows, found, strict=True):
        p, q, r = map(Fraction, (a, b, c))
        expected = [
            p + q, p - third, r / 2, -p, abs(q), min(p, r), max(p, r), p < q, True, q == r, q if p < q else r,
            abs(p), p * r - (p + q), p + q - q * r, p * r / 2 + abs(q),
        ]  # fmt: skip
        assert row.tolist() == [float(each) for each in expected]


@pytest.mark.parametrize("name", ["geometric_product", "add", "subtract", "outer_product"])
def test_interpreted_products_are_those_of_the_compiled_function(name: str) -> None:
    rng = np.random.default_rng(7)
    for layouts in PAIRS:
        operator = operator_of(BINARY[name], layouts)
        assert is_interpreted(operator.program, extension)
        interpreted = Interpreted(operator.program, extension)
        for n in SIZES:
            a, b = (rng.normal(size=(n, layout.size)) for layout in layouts)
            expected = operator._in_python([a, b], (n,))
            for one, two in zip(in_orders(a), in_orders(b), strict=True):
                assert np.array_equal(interpreted.attempt(one, two), expected)
            single = interpreted.attempt(a[:1], b)  # broadcasts
            assert np.array_equal(single, operator._in_python([np.repeat(a[:1], n, 0), b], (n,)))
        operator.wait()
        assert np.array_equal(operator([a, b]), expected)


def test_sums_multiples_and_signs_take_whole_arrays() -> None:
    rng = np.random.default_rng(9)
    m = PGA3.of(PGA3.EVEN, rng.normal(size=(130, 8)))
    reverse = operator_of(UNARY["reverse"], (PGA3.EVEN,))
    signs = flat_form(reverse.program, extension)
    assert signs is not None
    for n in SIZES[1:]:
        rows = rng.normal(size=(n, 8))
        assert np.array_equal(signs(rows), rows * [1, -1, -1, -1, -1, -1, -1, 1])
        assert signs(np.asfortranarray(rows)) is None
    other = m.values[::-1]
    for found, expected in (
        (m + PGA3.of(PGA3.EVEN, other), m.values + other), (m - PGA3.of(PGA3.EVEN, other), m.values - other),
        (2.5 * m, 2.5 * m.values), (m / 3, m.values / 3), (-m, -m.values), (m + m[:1], m.values + m.values[:1]),
        (np.arange(130.0) * m, np.arange(130.0)[:, None] * m.values),
    ):  # fmt: skip
        assert np.array_equal(found.values, expected)


def test_inverses_of_arrays_of_vectors_are_checked_one_by_one_if_one_is_extreme() -> None:
    rng = np.random.default_rng(11)
    for space in (VGA3, STA, CGA3):
        layout = space.VECTOR
        rows = rng.normal(size=(40, layout.size))
        for bad, value in (((3,), 0.0), ((5,), np.nan)):
            damaged = rows.copy()
            damaged[bad] = value
            found = space.of(layout, damaged).inverse()
            good = np.delete(np.arange(40), bad)
            assert np.isnan(found.values[bad]).all()
            assert (space.of(layout, damaged[good]) * found[good]).isclose(1).all()
        for scale in (1e-180, 1e180):
            scaled = rows.copy()
            scaled[7] *= scale
            product = space.of(layout, scaled) * space.of(layout, scaled).inverse()
            assert product.isclose(1, rtol=1e-8).all()
    null = np.array([[1.0, 1.0, 0.0, 0.0], [1.0, 0.5, 0.0, 0.0]])
    assert np.isnan(STA.of(STA.VECTOR, null).inverse().values[0]).all()
    with pytest.raises(ZeroDivisorError):
        STA.of(STA.VECTOR, null[0]).inverse()
