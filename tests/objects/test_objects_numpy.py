"""numpy's functions on objects, and products that are scalars: element by element against exact sums."""

from __future__ import annotations

import copy
import json
import math
import pickle
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from built_operators import wait_for_operators
from selection import some_slow

import gacompiler as ga
from gacompiler.errors import AlgebraError
from gacompiler.objects import CGA3, PGA2, PGA3, VGA2, VGA3, MultivectorArray
from gacompiler.objects.definitions import UNARY
from gacompiler.objects.operators import operator_of
from tests.support.all_cases import all_cases

RNG = np.random.default_rng(22)
POINTS = PGA3.point(RNG.integers(-8, 9, (3, 4, 3)) / 4)
ROUND_POINTS = CGA3.point(RNG.integers(-8, 9, (3, 4, 3)) / 4)
MOTORS = PGA3.motor(RNG.normal(size=(3, 4, 3)), 0.7, 2)
PLANES = VGA2.vector(RNG.integers(-8, 9, (3, 4, 2)) / 4)
ARRAYS = [POINTS, ROUND_POINTS, MOTORS, PLANES]


def full(x: Any) -> np.ndarray[Any, Any]:
    """All coefficients of an array, indexed by bitmaps."""
    return np.stack([x[x.algebra.spelling(b)[1]] * x.algebra.spelling(b)[0] for b in x.algebra.blades()], -1)


def same(x: Any, values: Any, tolerance: float = 0.0) -> bool:
    found = full(x)
    return found.shape == np.shape(values) and bool(np.allclose(found, values, rtol=0, atol=tolerance))


def test_stacking_keeps_blades() -> None:
    """Regression test: one of two blades was lost."""
    both = np.stack([PGA3.e1, PGA3.e2])
    assert both.shape == (2,) and both[0].isclose(PGA3.e1) and both[1].isclose(PGA3.e2)
    three = np.concatenate([PLANES, VGA2.of(VGA2.full, np.ones((2, 4, 4))), np.full((1, 4), 7.0)])
    assert three.shape == (6, 4) and three[0, 1].isclose(PLANES[0, 1]) and three["e12"][4, 0] == 1
    assert np.array_equal(three["1"][5], [7, 7, 7, 7]) and np.all(three["e1"][5] == 0)


STACKING: list[Callable[..., Any]] = [
    np.stack, lambda x: np.stack(x, axis=1), lambda x: np.stack(x, -1), np.concatenate, lambda x: np.concatenate(x, 1),
    lambda x: np.concatenate(x, axis=-1), np.vstack, np.hstack, np.dstack, lambda x: np.append(*x[:2], axis=0),
    lambda x: np.append(*x[:2]), lambda x: np.where([True, False, True, True], *x[:2]),
    lambda x: np.where(np.eye(3, 4) > 0, *x[:2]),
]  # fmt: skip


@all_cases("k", range(len(STACKING)))
@all_cases("x", ARRAYS)
def test_joining_arrays(x: Any, k: int) -> None:
    """Join arrays of one or several layouts: every coefficient is where numpy places its element."""
    other = x * 2.0 if x is not PLANES else x * VGA2.e12 + 1
    for operands in ([x, x[::-1]], [x, other], [other, x]):
        found = STACKING[k](operands)
        parts = [full(each) for each in operands]
        wanted = np.stack([STACKING[k]([each[..., b] for each in parts]) for b in range(parts[0].shape[-1])], -1)
        assert isinstance(found, MultivectorArray) and same(found, wanted)
    assert STACKING[k]([x, x[::-1]]).layout == x.layout


def test_layouts_are_united() -> None:
    motor, turn, shift = PGA3.motor([0, 0, 1], 1.0, 2.0), PGA3.of(PGA3.ROTOR, 1, 0, 0, 0), PGA3.translator(1, 2, 3)
    assert np.stack([motor, turn, shift]).layout == PGA3.MOTOR, "unit elements remain unit elements"
    assert np.stack([turn, shift]).layout == PGA3.MOTOR
    assert np.stack([motor, 2 * motor]).layout == PGA3.EVEN
    assert np.stack([POINTS[0, 0], POINTS[0, 0] * 2]).layout == PGA3.TRIVECTOR
    assert np.where(True, motor, 1.0).isclose(motor) and np.where(False, motor, 1.0).isclose(1.0)
    with pytest.raises(AlgebraError, match=r"np\.stack: multivectors of PGA3 and CGA3"):
        np.stack([PGA3.point(1, 2, 3), CGA3.point(1, 2, 3)])
    with pytest.raises(AlgebraError, match=r"PGA2 and PGA3"):
        np.concatenate([PGA2.point([[1, 2]]), POINTS[0]])


REARRANGING: list[Callable[[Any], Any]] = [
    np.ravel, np.transpose, lambda x: np.transpose(x, (1, 0)), lambda x: x.transpose(), lambda x: x.transpose(1, 0),
    lambda x: np.reshape(x, (2, 6)), lambda x: np.reshape(x, -1), lambda x: np.swapaxes(x, 0, -1),
    lambda x: np.moveaxis(x, -1, 0), lambda x: np.expand_dims(x, -1), lambda x: np.squeeze(x[:1]),
    lambda x: np.broadcast_to(x, (2, 3, 4)), lambda x: np.broadcast_arrays(x, np.zeros((5, 1, 1)))[0],
    lambda x: np.repeat(x, 2, axis=-1), lambda x: np.tile(x, (2, 1)), lambda x: np.take(x, [2, 0], axis=-1),
    lambda x: np.roll(x, 1, axis=1), lambda x: np.flip(x, -1), lambda x: np.array_split(x, 2, axis=-1)[1],
    lambda x: np.split(x, 3)[2], lambda x: np.atleast_2d(x[0]), lambda x: np.delete(x, 1, axis=0), np.copy,
    lambda x: np.flipud(x), lambda x: np.rot90(x),
]  # fmt: skip


@all_cases("k", range(len(REARRANGING)))
@all_cases("x", ARRAYS)
def test_moving_elements(x: Any, k: int) -> None:
    found, parts = REARRANGING[k](x), full(x)
    wanted = np.stack([REARRANGING[k](parts[..., b]) for b in range(parts.shape[-1])], -1)
    assert same(found, wanted) and found.layout == x.layout


SUMS: list[Callable[[Any], Any]] = [
    np.sum, lambda x: np.sum(x, axis=0), lambda x: np.sum(x, axis=-1, keepdims=True), lambda x: np.sum(x, (0, 1)),
    lambda x: x.sum(0), np.mean, lambda x: np.mean(x, axis=1), lambda x: x.mean(), lambda x: np.average(x, axis=0),
    lambda x: np.average(x, axis=1, weights=[1, 2, 3, 2]), lambda x: np.cumsum(x, axis=1), np.diff, np.add.reduce,
]  # fmt: skip


@all_cases("k", range(len(SUMS)))
@all_cases("x", ARRAYS)
def test_sums_and_means(x: Any, k: int) -> None:
    """A sum of points is not a point, but their mean in projective space is; layouts of results remain correct."""
    found, parts = SUMS[k](x), full(x)
    wanted = np.stack([SUMS[k](parts[..., b]) for b in range(parts.shape[-1])], -1)
    assert same(found, wanted, 1e-15 * parts[..., 0].size)
    assert not found.layout.has_relations and not found.layout.implied


def test_layouts_of_sums_and_means() -> None:
    assert POINTS.sum().layout == PGA3.TRIVECTOR and POINTS.mean().layout == PGA3.POINT
    assert ROUND_POINTS.mean().layout == CGA3.VECTOR and MOTORS.mean(0).layout == PGA3.EVEN
    assert np.sum(POINTS[0, 0]).isclose(POINTS[0, 0]) and PGA3.point(np.zeros((0, 3))).sum()["e123"] == 0


def test_products_are_in_order() -> None:
    m = MOTORS[0]
    wanted = m[0].exactly() * m[1].exactly() * m[2].exactly() * m[3].exactly()
    for found in (np.prod(m), np.multiply.reduce(m), np.prod(MOTORS, axis=1)[0]):
        assert found.isclose(PGA3.multivector({PGA3.algebra.spelling(b)[1]: float(c) * PGA3.algebra.spelling(b)[0]
                                               for b, c in wanted.terms.items()}))  # fmt: skip
    assert np.prod(MOTORS, axis=1).layout == PGA3.MOTOR


def test_universal_functions_equal_operators_and_methods() -> None:
    m, n, p = PGA3.motor([1, 2, 3], 0.3, 2), PGA3.motor([0, 1, 1], 0.5, 1), PGA3.point(1, 2, 3)
    pairs: list[tuple[Any, Any]] = [
        (np.multiply(m, n), m * n), (np.add(m, n), m + n), (np.subtract(m, 1.0), m - 1), (np.divide(m, 2), m / 2),
        (np.bitwise_and(p, p * 1.0 + PGA3.e021), p & (p * 1.0 + PGA3.e021)), (np.bitwise_xor(m, n), m ^ n),
        (np.right_shift(m, p), m >> p), (np.invert(m), ~m), (np.negative(m), -m), (np.exp(m.log()), m),
        (np.log(m), m.log()), (np.sqrt(m), m.sqrt()), (np.square(m), m * m), (np.reciprocal(m), ~m),
        (np.power(m, 3), m * m * m), (np.positive(m), m),
        (2**VGA3.e12, (np.log(2) * VGA3.e12).exp()), (np.float64(2) * m, m + m),
        (np.multiply(3, m), m * 3), (np.round(m, 2), round(m, 2)),
    ]  # fmt: skip
    for k, (found, wanted) in enumerate(pairs):
        assert np.all(found.isclose(wanted)), k
    assert abs(2 * m) == np.abs(2 * m) and np.isclose(abs(2 * m), 2) and np.absolute(PGA3.e12 * 3) == 3
    assert (np.array([1.0, 2]) * m).shape == (2,) and (m + np.array([1.0, 2])).shape == (2,)
    assert np.isnan(PGA3.point([[1, np.nan, 2], [1, 2, 3]])).tolist() == [True, False]
    assert np.isfinite(PGA3.point([[1, np.inf, 2], [1, 2, 3]])).tolist() == [False, True]
    assert np.allclose(m, m * 1.0) and not np.allclose(m, n) and np.array_equal(m, m) and not np.array_equal(m, n)
    assert np.isclose(POINTS, POINTS).all() and (np.ones(3) == PGA3.e1).tolist() == [False] * 3
    assert np.shape(POINTS) == (3, 4) and np.ndim(POINTS) == 2 and np.size(POINTS) == 12
    assert np.round(POINTS / 3, 1)["e032"].tolist() == np.round(np.asarray(POINTS.values[..., 0]) / 3, 1).tolist()


WRONG: list[tuple[str, Callable[[], Any]]] = [
    ("sort", lambda: np.sort(POINTS)), ("max", lambda: np.max(POINTS)), ("argmin", lambda: np.argmin(POINTS)),
    ("dot", lambda: np.dot(POINTS, POINTS)), ("linalg.norm", lambda: np.linalg.norm(POINTS)),
    ("linalg.inv", lambda: np.linalg.inv(POINTS)), ("sin", lambda: np.sin(POINTS)),
    ("cross", lambda: np.cross(POINTS, POINTS)), ("matmul", lambda: np.matmul(POINTS, POINTS)),
    ("einsum", lambda: np.einsum("ij->i", POINTS)), ("median", lambda: np.median(POINTS)),
    ("std", lambda: np.std(POINTS)), ("clip", lambda: np.clip(POINTS, 0, 1)), ("unique", lambda: np.unique(POINTS)),
    ("zeros_like", lambda: np.zeros_like(POINTS)), ("less", lambda: np.less(POINTS, 1)),
    ("fft.fft", lambda: np.fft.fft(POINTS)), ("conjugate", lambda: np.conjugate(POINTS)),
    ("where", lambda: np.where(POINTS)), ("sum.*out", lambda: np.sum(POINTS, out=np.zeros(3))),
    ("sum.*dtype", lambda: np.sum(POINTS, dtype=np.float32)),
    ("multiply.*out", lambda: np.multiply(POINTS, 2, out=np.zeros(3))),
    ("add.accumulate", lambda: np.add.accumulate(POINTS)),
    ("multiply.outer", lambda: np.multiply.outer(POINTS, POINTS)),
    ("average", lambda: np.average(np.ones((3, 4)), weights=POINTS)), ("maximum", lambda: np.maximum.reduce(POINTS)),
    ("stack", lambda: np.stack([POINTS, "text"])), ("nan_to_num", lambda: np.nan_to_num(POINTS)),
    ("real", lambda: np.real(POINTS)),
]  # fmt: skip


@all_cases("k", range(len(WRONG)))
def test_all_other_functions_are_rejected_by_name(k: int) -> None:
    name, call = WRONG[k]
    with pytest.raises(TypeError, match=rf"np\.{name}"):
        call()


def test_arrays_of_numbers_are_not_changed_to_multivectors_in_place() -> None:
    numbers = np.ones(3)
    with pytest.raises(TypeError, match=r"np\.multiply"):
        numbers *= PGA3.e1
    assert numbers.tolist() == [1, 1, 1]


def results() -> list[Any]:
    e1, v, w = PGA3.e1, VGA3.vector(1, 2, 2), VGA3.vector(3, 0, 4)
    return [
        e1 * e1,
        v | w,
        (v * v).grade(0),
        v.norm(),
        (v ^ w).norm_squared(),
        v**2,
        v.scalar_product(w),
        (v * w).grade(0),
        e1 | e1,
    ]


@pytest.mark.parametrize("times", some_slow([1, 2], 2))
def test_scalars_keep_the_methods_of_multivectors(times: int) -> None:
    """Test results of Python, and of the compiled function when it is available."""
    v = VGA3.vector(1, 2, 2)
    for _ in range(times):
        for x, value in zip(results(), [1, 11, 9, 3, 104, 9, 11, 11, 1], strict=True):
            assert type(x) is type(v | v) and isinstance(x, float) and x == value and hash(x) == hash(float(value))
            assert x.grade(0) == value and x.grade(2) == 0 == x.grade(1, 3) and ~x == x and x.reverse() == value
            assert x.inverse() == 1 / value and x.norm() == abs(value) and x.norm_squared() == value**2
            assert x.grade_involution() == value == x.clifford_conjugate() and x.normalize() == 1
            assert x["1"] == value == x.scalar and x["e12"] == 0 and x.exactly().scalar == Fraction(value)
            assert (x ^ x) == value**2 == (x | x) and (x ^ v).isclose(value * v) and (v ^ x).isclose(value * v)
            assert (x >> v).isclose(value**2 * v) and x(v).isclose(value**2 * v) and (v * x).isclose(x * v)
            assert (x + v).grade(0) == value and (x * v / x).isclose(v) and x.left_contraction(v).isclose(value * v)
            assert np.isclose(x.exp(), math.exp(value)) and np.isclose(x.log(), math.log(value))
            assert np.isclose(x.sqrt(), math.sqrt(value)) and x.isclose(float(value)) and x.shape == ()
            assert not x.isclose(value + 1.0) and not x.isclose(v) and x.values.tolist() == [value] and x.ndim == 0
            assert x.as_layout(VGA3.EVEN).isclose(value) and x.as_layout(VGA3.EVEN).layout == VGA3.EVEN
            for found in (x + 1, 1 + x, x - 1, 1 - x, 2 * x, x * 2, x / 2, 2 / x, -x, +x, abs(x), x + x, x * x):
                assert found.grade(0) == found
            for name in ("dual", "undual", "polarity"):
                with pytest.raises(AlgebraError, match=f"{name}: a number, which belongs to no algebra"):
                    getattr(x, name)()
        if times > 1:
            wait_for_operators(VGA3.algebra)


def test_numbers_are_floats() -> None:
    x = VGA3.vector(1, 2, 2) | VGA3.vector(3, 0, 4)
    assert math.sqrt(x) == math.sqrt(11) and f"{x:.2f}" == "11.00" and repr(x) == "11.0" == str(x) and int(x) == 11
    assert json.dumps(x) == "11.0" and round(x) == 11 and divmod(x, 2) == (5, 1) and x % 3 == 2 and 2**x == 2048
    assert np.array([x, x]).dtype == np.float64 and np.sin(x) == np.sin(11.0) and np.float64(2) * x == 22
    assert sum([x, x]) == 22 and max(x, 12) == 12 and sorted([x, 3.0]) == [3, 11] and x > 10 and {x: 1}[11.0] == 1
    for again in (pickle.loads(pickle.dumps(x)), copy.copy(x), copy.deepcopy(x)):
        assert again == x and type(again) is type(x)
    with pytest.raises(ZeroDivisionError):
        x / 0
    with pytest.raises(TypeError):
        x ^ "text"


def test_objects_are_added_and_scaled() -> None:
    """`Motor * 3`, `Motor + Motor`, `Point - Point`, against the algebra over rationals."""
    m, n, p, q = (
        PGA3.motor([1, 2, 3], 0.3, 2),
        PGA3.motor([0, 1, 0], 1.3, 1),
        PGA3.point(1, 2, 3),
        PGA3.point(3, 1, 0.5),
    )
    pairs: list[tuple[Any, ga.Multivector]] = [
        (m * 3, m.exactly() * 3), (3 * m, m.exactly() * 3), (m / 4, m.exactly() / 4), (p * 2, p.exactly() * 2),
        (m - 1, m.exactly() - PGA3.algebra.scalar(Fraction(1))), (p + q, p.exactly() + q.exactly()),
        (p - q, p.exactly() - q.exactly()),
    ]  # fmt: skip
    for found, wanted in pairs:
        assert found.isclose(PGA3.of(found.layout, [float(c) for c in found.layout.coefficients(wanted)]))
    assert np.allclose((m + n).values, m.values + n.values) and (m - n).layout == PGA3.EVEN
    assert (p - q).layout == PGA3.DIRECTION and (m * 3).layout == PGA3.EVEN and (m + n).layout == PGA3.EVEN


@all_cases("x", [VGA3.vector(1, 2, 3), PGA3.point(1, 2, 3), VGA3.e12, CGA3.e0])
def test_conversion_keeps_elements_unless_numbers_are_asked_for(x: Any) -> None:
    y = 2 * x
    for found in (np.array([x, y]), np.asarray((x, y)), np.array([[x, y]])[0], np.array([x, y], object)):
        assert found.dtype == object and found.shape == (2,) and found[0] is x and found[1] is y
    assert np.sum([x, y]).isclose(x + y) and np.mean([x, y]).isclose(1.5 * x)
    assert np.prod([x, y]).isclose(x * y)
    random = np.random.default_rng(3)
    chosen = (*random.permutation([x, y]), *random.choice([x, y], 3))
    assert {str(each.layout) for each in chosen} <= {str(x.layout), str(y.layout)}
    assert np.array_equal(np.asarray(x, float), x.values) and np.array([x, x], np.float32).shape == (2, x.layout.size)
    for numbers in (np.isnan, np.min, np.sort):
        with pytest.raises(TypeError):
            numbers([x, y])
    with pytest.raises(ValueError, match="values"):
        np.asarray(x, copy=False)
    several = np.stack([x, y])
    assert np.asarray(several).shape == (2,) and np.asarray(several)[1].isclose(y)
    assert np.shares_memory(np.asarray(several, float), several.values)


def test_columns_of_results_are_each_in_one_piece() -> None:
    """The next operation of numpy reads them so; columns that are apart take it up to six times as long."""
    rows = np.arange(150.0).reshape(50, 3)
    found = operator_of(UNARY["negate"], (PGA3.algebra.DIRECTION,))._in_python([rows], (50,))
    np.testing.assert_array_equal(found, -rows)
    assert found.strides[0] == found.itemsize


def test_arrays_that_numpy_made_of_elements_are_operands() -> None:
    """The result for each element, for layouts that are equal or not."""
    p, q, m = PGA3.point(1, 2, 3), PGA3.point(0, 0, 1), PGA3.motor([0, 0, 1], 0.5, 1, 2, 3)
    operators: dict[str, Any] = {
        ">>": lambda a, b: m >> b, "()": lambda a, b: m(b), "+": lambda a, b: a + b, "-": lambda a, b: a - b,
        "&": lambda a, b: a & b, "|": lambda a, b: a | b, "*": lambda a, b: a * b, "/": lambda a, b: b / m,
        "add": np.add, "commutator": lambda a, b: m.commutator(b), "outer": lambda a, b: p.outer_product(b),
    }  # fmt: skip
    for pair in ([p, q], [p, m], [[p, q], [q, m]]):
        made = np.array(pair)
        assert made.dtype == object
        for name, run in operators.items():
            for one, two in ((q, made), (made, q)):
                if isinstance(two, np.ndarray) or name in ("+", "-", "&", "|", "*"):
                    found = run(one, two)
                    for index in np.ndindex(made.shape):
                        wanted = run(*(x[index] if isinstance(x, np.ndarray) else x for x in (one, two)))
                        part = found[index] if np.shape(found) == made.shape else found
                        assert np.all(abs(wanted - part) < 1e-12) if np.isscalar(wanted) else wanted.isclose(part), name
    made = np.array([p, q])
    assert (made == q).tolist() == (q == made).tolist() == [False, True]
    assert (made != q).tolist() == (q != made).tolist() == [True, False]
    assert p.isclose(made).tolist() == [True, False]
