"""Operations that are known from an earlier call take shorter paths, which give the same results."""

from __future__ import annotations

import operator

import numpy as np
import pytest
from built_operators import wait_for_operators

from gacompiler import Algebra
from gacompiler.errors import OperandError
from gacompiler.objects import PGA3, VGA3, Space
from generated.pga3 import Point

RNG = np.random.default_rng(7)
POINTS = PGA3.point(RNG.normal(size=(6, 5, 3)))
MOTORS = PGA3.motor(PGA3.line(RNG.normal(size=(6, 5, 3)), RNG.normal(size=(6, 5, 3))), RNG.normal(size=(6, 5)))


def compiled(*names: str) -> None:
    wait_for_operators(PGA3.algebra, VGA3.algebra, names=names)


def test_powers_are_products_before_and_after_they_are_compiled() -> None:
    m, v = PGA3.motor([0, 0, 1], 0.3, 1, 2, 3), VGA3.vector(1, 2, 3)
    first = [m**2, m**3, v**2, v**3]
    compiled("power_2", "power_3")
    for _ in range(3):
        found = [m**2, m**3, v**2, v**3]
        assert found == first and all(type(a) is type(b) for a, b in zip(found, first, strict=True))
    assert (m**2).isclose(m * m) and (m**3).isclose(m * m * m) and v**2 == 14 and (v**3).isclose(14 * v)
    assert m**0 == 1 and m**1 == m and (m**4).isclose(m * m * m * m) and (m**-2).isclose(~(m * m))
    assert (m**2.0).isclose(m * m) and (2**v).isclose((np.log(2) * v).exp())
    assert (np.float64(2) ** v).isclose(2**v) and (np.array([1.0, 2]) ** v)[1].isclose(2**v)
    turn = VGA3.rotor([0, 0, 1], 1.0)
    assert (turn**1001).isclose(VGA3.rotor([0, 0, 1], 1001.0), atol=1e-10) and (turn ** (1 << 40)).layout.unit
    with pytest.raises(OperandError):
        m ** "2"
    with pytest.raises(TypeError, match="Point"):  # whose class has no powers
        Point(1, 2, 3) ** m


def test_equality_and_order_of_single_elements() -> None:
    m, n = PGA3.motor([0, 0, 1], 0.3), PGA3.motor([0, 0, 1], 0.4)
    same, one = PGA3.motor([0, 0, 1], 0.3), 1
    assert operator.eq(m, same) and not operator.ne(m, same) and operator.ne(m, n) and not operator.eq(m, n)
    assert m != PGA3.point(1, 2, 3) and m != one and one != m
    for compare in (lambda: m < n, lambda: m <= n, lambda: m > n, lambda: m >= n, lambda: m < one, lambda: one < m):
        with pytest.raises(OperandError, match="no order"):
            compare()


def test_elements_by_names_of_blades_keep_signs_and_order() -> None:
    other = Space(Algebra("PGA3", "e1 e2 e3 e0", [1, 1, -1, 0]))
    for _ in range(3):
        x = PGA3.multivector({"e31": 2, "1": 5.0, "e21": np.float64(3)})
        assert (x.scalar, x.e13, x.e12, x.e31) == (5, -2, -3, 2) and x.algebra == PGA3.algebra
        assert PGA3.multivector({"1": 5.0, "e21": 3, "e31": 2}) == x
        assert PGA3.multivector({"e12": 1, "e21": 3}).e12 == -2
        assert other.multivector({"e31": 2, "1": 5.0, "e21": 3}).algebra == other.algebra
        assert PGA3.multivector({"e31": [2, 4], "1": 5.0, "e21": 3}).shape == (2,)
        assert type(PGA3.multivector({"1": 2.0})) is type(VGA3.e1 | VGA3.e1)


def test_arrays_in_any_order_of_memory() -> None:
    views = [
        (MOTORS, POINTS), (MOTORS[::-2, 1:], POINTS[::2, :-1]), (MOTORS[:, :1], POINTS), (MOTORS[0, 0], POINTS),
        (MOTORS.transpose(), POINTS.transpose()), (MOTORS[2], POINTS[3, 3]), (MOTORS[:1, :1], POINTS[:1, :1]),
    ]  # fmt: skip
    columns = PGA3.of(PGA3.POINT, np.asfortranarray(POINTS.values))
    for _ in range(2):
        for m, p in (*views, (MOTORS, columns)):
            moved, product, reverse = m >> p, m * p, ~p
            assert moved.layout == PGA3.POINT and reverse.shape == p.shape
            for index in np.ndindex(moved.shape):
                one, other = (x[tuple(np.minimum(index[-x.ndim :], np.array(x.shape) - 1))] if x.ndim else x
                              for x in (m, p))  # fmt: skip
                np.testing.assert_allclose(moved[index].values, (one >> other).values, rtol=1e-13, atol=1e-13)
                np.testing.assert_allclose(product[index].values, (one * other).values, rtol=1e-13, atol=1e-13)
        compiled("sandwich", "geometric_product", "reverse")


def test_arrays_that_the_extension_does_not_read() -> None:
    wanted = (MOTORS >> POINTS).values
    compiled("sandwich", "reverse")
    for _ in range(2):
        assert (MOTORS[:0] >> POINTS[:0]).shape == (0, 5)
        single = PGA3.of(PGA3.POINT, POINTS.values.astype(np.float32))
        np.testing.assert_allclose((MOTORS >> single).values, wanted, rtol=1e-5, atol=1e-5)
        assert (~single).values.dtype == np.float32
        many = POINTS.reshape(1, 1, 1, 1, 1, 1, 1, 6, 5)
        np.testing.assert_allclose((MOTORS >> many).values.reshape(6, 5, 3), wanted, rtol=1e-13)
        with pytest.raises(ValueError, match="do not broadcast"):
            MOTORS >> POINTS[:4]


def test_numbers_beside_arrays() -> None:
    values = POINTS.values
    for _ in range(2):
        for two in (2, 2.0):
            np.testing.assert_array_equal((two * POINTS).values, (POINTS * two).values)
            np.testing.assert_array_equal((two * POINTS)["e032"], 2 * values[..., 0])
            np.testing.assert_array_equal((two * POINTS)["e123"], np.full((6, 5), 2.0))
            np.testing.assert_array_equal((POINTS / two)["e013"], values[..., 1] / 2)
            assert (two ^ POINTS).isclose(two * POINTS).all() and (POINTS - two)["1"].max() == -2
        assert np.isinf((POINTS / 0)["e123"]).all() and (POINTS.reshape(30) / 4)[7] == POINTS[1, 2] / 4
        for many in (np.arange(5.0), np.arange(5), np.arange(5, dtype=np.float32)):
            np.testing.assert_allclose((many * POINTS)["e021"], values[..., 2] * many, rtol=1e-6)
            np.testing.assert_allclose((POINTS * many)["e123"], np.tile(many, (6, 1)), rtol=1e-6)
            np.testing.assert_allclose((many * POINTS[0, 0]).values[:, 1:], many[:, None] * values[0, 0], rtol=1e-6)
            with pytest.raises(OperandError):
                many ^ POINTS
        assert (np.array(2.0) ^ POINTS).isclose(2 * POINTS).all()
        compiled("divide", "geometric_product", "outer_product", "subtract")


def test_long_integers_beside_arrays() -> None:
    """They are doubles, as beside single elements, before and after an operation is known."""
    points = Space(Algebra("LONG", "e1 e2", [1, 1])).vector(RNG.normal(size=(4, 2)))
    for _ in range(2):
        found = [points * 10**30, 10**30 * points, points + 10**30, points / 10**30]
        expected = [points * 1e30, 1e30 * points, points + 1e30, points / 1e30]
        assert all((a.values == b.values).all() for a, b in zip(found, expected, strict=True))
        for x in (points, points[0]):
            with pytest.raises(OverflowError, match="too large"):
                x * 10**400


def test_blades_and_layouts_of_spaces_with_equal_names() -> None:
    other = Space(Algebra("PGA3", "e1 e2 e3 e0", [1, 1, -1, 0]))
    for _ in range(2):
        assert (PGA3.e3 * PGA3.e3, other.e3 * other.e3, PGA3.e21.e12) == (1, -1, -1)
        assert PGA3.POINT == PGA3.algebra.POINT and not hasattr(other, "POINT")
