"""Calls by name and with integers, and sums of values, in every generated module."""

from __future__ import annotations

import importlib
import inspect
import pickle
from typing import Any

import numpy as np
import pytest

from gacompiler import compile, kernel
from gacompiler.algebra.catalog import CATALOG, PGA3
from gacompiler.generation.checked_in import own_specs
from generated import arms, cga3, pga3
from tests.support.all_cases import all_cases

MODULES = [path.stem for path in own_specs()]


@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def moved(m: Any, p: Any) -> Any:
    """Move a point."""
    return m * p * ~m


@pytest.fixture(scope="module")
def functions() -> list[Any]:
    return [pga3.move_point, compile(moved, "arrays")]


def test_arguments_by_name(functions: list[Any]) -> None:
    random = np.random.default_rng(0)
    m, p = random.normal(size=8), random.normal(size=(7, 3))
    for function in functions:
        for points in (p, p[0], p[0].tolist(), p[::2]):
            wanted = function(m, points)
            for found in (function(m=m, p=points), function(p=points, m=m), function(m, p=points)):
                np.testing.assert_array_equal(found, wanted)
        out = np.empty((7, 3))
        assert function(p=p, m=m, out=out) is out and function(m=m, p=p, num_threads=2).shape == (7, 3)
        np.testing.assert_array_equal(out, function(m, p))
        assert list(inspect.signature(function).parameters) == ["m", "p", "out", "num_threads"]
        inspect.signature(function).bind(m=m, p=p)
        for given, named, words in (
            ((), {"m": m, "q": p}, "unknown argument q; expected m, p"),
            ((m,), {"m": m, "p": p}, "argument m is passed by position and by name"),
            ((), {"m": m}, "missing argument p; expected m, p"),
            ((), {"p": p}, "missing argument m"),
            ((m, p, p), {}, "3 arguments; expected 2"),
            ((), {}, "0 arguments; expected 2"),
        ):
            with pytest.raises(TypeError, match=words):
                function(*given, **named)


@all_cases("name", MODULES)
def test_every_kernel_takes_names(name: str) -> None:
    module = importlib.import_module(f"generated.{name}")
    for each in list(module.kernels)[::7]:
        function = getattr(module, each)
        if not isinstance(function, module.Kernel):
            continue
        names = list(inspect.signature(function).parameters)[:-2]
        given = [np.ones(shape) for _, shape in function.definition.inputs]
        with np.errstate(all="ignore"):
            wanted = function(*given)
            found = function(**dict(zip(names, given, strict=True)))
        for a, b in zip(_tuple(found), _tuple(wanted), strict=True):
            np.testing.assert_array_equal(a, b)


def _tuple(value: Any) -> tuple[Any, ...]:
    return value if isinstance(value, tuple) else (value,)


@all_cases("kind", ["bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"])
def test_integers_are_cast_as_ufuncs_cast_them(kind: str, functions: list[Any]) -> None:
    """The expected type is that of numpy's `hypot` of the same arrays."""
    p = np.array([[0, 1, 1], [1, 0, 1]]).astype(kind)
    identity = np.eye(8)[0]
    for function in functions:
        for m in (identity, identity.astype(np.float32), identity.astype(kind), identity.astype(np.int16)):
            found = function(m, p)
            wanted = np.hypot(m[:1], p[:, :1])
            same = (
                wanted.dtype if wanted.dtype != np.float16 else np.dtype(np.float32)
            )  # kernels do not support half precision
            assert found.dtype == same and np.array_equal(found, p)
        assert function(identity, p.tolist()).dtype == np.float64
    for wrong in (p.astype(object), np.array([["a", "b", "c"]])):
        with pytest.raises(TypeError, match="argument p has dtype"):
            pga3.move_point(identity, wrong)


def test_sums_and_multiples_of_motors_and_points() -> None:
    random = np.random.default_rng(1)
    a, b = pga3.Motor(random.normal(size=8)), pga3.Motor(random.normal(size=8))
    for found, wanted in (
        (a * 3, 3 * a.values), (3 * a, 3 * a.values), (np.float64(0.5) * a, a.values / 2),
        (a / 2, a.values / 2), (a + b, a.values + b.values), (a - b, a.values - b.values),
        ((a + b) / 2, (a.values + b.values) / 2), (np.int64(2) * a, 2 * a.values),
    ):  # fmt: skip
        assert type(found) is pga3.Even, "a sum of motors is no motor"
        np.testing.assert_array_equal(found.values, wanted)
    assert type(-a) is pga3.Motor and 0 - a == pga3.Even(-a)
    p, q = pga3.Point(1, 2, 3), pga3.Point(0, 0, 1)
    assert type(p - q) is pga3.Direction and (p - q).values.tolist() == [1, 2, 2]
    total = p + q
    assert type(total) is pga3.Trivector and (total.e123, total.e032, total.e021) == (2, 1, 4)
    assert (2 * p).e123 == 2 and (-p).e123 == -1 and (total / 2).e021 == 2 and sum([p, q]) == total
    with pytest.raises(TypeError, match=r"not defined by generated\.pga3"):
        _ = a + np.ones(8)
    with pytest.raises(TypeError):
        _ = a * 1j
    with pytest.raises(TypeError):
        _ = 3 / a
    with pytest.raises(TypeError):
        _ = a + cga3.Motor(*[0] * 8)


def test_values_of_two_modules_have_the_operators_of_both() -> None:
    numbers = [np.cos(0.5), np.sin(0.5), 0, 0, 0, 0, 0, 0]
    motor, other, point = arms.Motor(numbers), pga3.Motor(numbers), pga3.Point(1, 2, 3)
    points = pga3.Point.array(np.eye(3))
    for _ in range(3):  # the first call looks up the kernel, later ones run it
        assert type(motor(point)) is pga3.Point and motor(point) == other(point)
        assert motor * other == other * motor == other * other and (motor(points) == other(points)).all()
        assert (motor + other).values.tolist() == (2 * other).values.tolist()
        for wrong in (lambda: motor * point, lambda: motor * cga3.Motor(*[0] * 8), lambda: point(motor)):
            with pytest.raises(TypeError, match="not defined by"):
                wrong()


def test_conformal_points_have_differences() -> None:
    """The coefficient of ``einf`` is half the squared position: it is not stored, but it contributes."""
    p, q = cga3.Point(1.0, 2, 3), cga3.Point(0.0, 0, 1)
    difference = p - q
    assert (difference.e1, difference.e2, difference.e3, difference.einf) == (1, 2, 2, 7 - 0.5)
    assert (2 * p).einf == 14 and (2 * p).e0 == 2


@all_cases("name", MODULES)
def test_every_type_has_sums(name: str) -> None:
    module = importlib.import_module(f"generated.{name}")
    random = np.random.default_rng(2)
    types = [each for each in vars(module).values() if isinstance(each, type) and issubclass(each, module.Value)]
    for kind in types:
        if kind is module.Value:
            continue
        a, b = (kind(random.normal(size=len(kind.layout.blades))) for _ in range(2))
        for found in (a + b, a - b, 2.0 * a, a / 4, -a):
            assert isinstance(found, module.Value) and not (found.layout.unit and found != -a)
            assert pickle.loads(pickle.dumps(found)) == found
        stored = kind.layout.blades
        for blade in stored:
            field = "scalar" if blade == "1" else blade.replace("^", "_")
            assert getattr(a + b, field) == getattr(a, field) + getattr(b, field)
            assert getattr(a - b, field) == getattr(a, field) - getattr(b, field)
            assert getattr(2.0 * a, field) == 2 * getattr(a, field)
        for blade, text in kind.layout.fixed:
            if text != "implied":
                weight = getattr(a, "scalar" if blade == "1" else blade)
                assert getattr(2.0 * a, "scalar" if blade == "1" else blade) == 2 * weight


def test_implied_coefficients_are_those_of_the_catalog() -> None:
    for algebra in (CATALOG["CGA2"], CATALOG["CGA3"]):
        module = importlib.import_module(f"generated.{algebra.name.lower()}")
        layout = algebra.POINT
        stored = np.random.default_rng(3).normal(size=layout.size)
        element = layout.element(list(stored))
        assert np.isclose((1.0 * module.Point(stored)).einf, element["einf"], rtol=1e-15)
