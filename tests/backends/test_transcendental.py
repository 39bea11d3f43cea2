"""The transcendental functions of kernels against mpmath at 50 digits; special numbers against the C library."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import mpmath
import numpy as np
import pytest
from backend_programs import bits, load, module_source, traced, write
from scalar_loops import scalar_loops

from gacompiler.backends.approximations import APPROXIMATIONS, FARTHEST, coefficients
from gacompiler.backends.build import build_library
from gacompiler.backends.transcendental import TRANSCENDENTAL, TRIGONOMETRIC
from gacompiler.gac_runtime.functions import OF_ANGLES
from gacompiler.gac_runtime.jit.transcendental import FORMULAS
from gacompiler.ir.scalar import Op
from tests.support.all_cases import all_cases

FUNCTIONS: dict[str, tuple[Op, Callable[..., Any], Callable[..., Any]]] = {
    "sine": (Op.SIN, mpmath.sin, np.sin),
    "cosine": (Op.COS, mpmath.cos, np.cos),
    "exponential": (Op.EXP, mpmath.exp, np.exp),
    "logarithm": (Op.LOG, mpmath.log, np.log),
    "angle": (Op.ATAN2, mpmath.atan2, np.arctan2),
    "arc": (Op.ACOS, mpmath.acos, np.arccos),
}
MOST_ULP = 2


def _program(name: str, op: Op) -> Any:
    shapes: dict[str, tuple[int, ...]] = {"y": (), "x": ()} if op is Op.ATAN2 else {"x": ()}
    return traced(name, shapes, lambda *x: x[0].graph.apply(op, *x), {"out": ()})


@pytest.fixture(scope="module")
def modules(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    """A module with the functions as kernels, by backend."""
    folder = tmp_path_factory.mktemp("functions")
    programs = [_program(name, op) for name, (op, _, _) in FUNCTIONS.items()]
    programs.append(
        traced("turned", {"v": (2,)}, lambda v: [v[0] * v[0].graph.apply(Op.COS, v[1]), v[1]], {"out": (2,)})
    )
    c_path = write(module_source("functions", *programs), folder)
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        if build_library(c_path):
            patch.setenv("GAC_BACKEND", "c")
            found["c"] = load(folder / "functions.py", "functions_c")
        patch.setenv("GAC_BACKEND", "numba")
        found["numba"] = load(folder / "functions.py", "functions_numba")
    return found


@pytest.fixture(name="module", params=["c", "numba"])
def module_fixture(request: pytest.FixtureRequest, modules: dict[str, ModuleType]) -> ModuleType:
    if request.param not in modules:
        pytest.skip("no C compiler")
    return modules[request.param]


def _arguments(name: str, dtype: Any) -> list[np.ndarray[Any, Any]]:
    """Arguments where the functions are hard: small, large, near multiples of pi/2, near roots."""
    rng = np.random.default_rng(5)
    info = np.finfo(dtype)
    signs = rng.choice([-1, 1], 600)
    spread = signs * np.exp(rng.uniform(np.log(1e-12), np.log(1e4), 600))
    wide = np.exp(rng.uniform(np.log(info.tiny), np.log(info.max), 600))
    if name in ("sine", "cosine"):
        near = (np.arange(1, 601) * 68 * np.pi / 2).astype(dtype)
        return [np.concatenate([spread, rng.uniform(-8, 8, 600), near, np.nextafter(near, dtype(0))]).astype(dtype)]
    if name == "exponential":
        most = math.log(info.max)
        return [np.concatenate([spread[abs(spread) < most], rng.uniform(-most, most, 900)]).astype(dtype)]
    if name == "logarithm":
        near = 1 + signs * np.exp(rng.uniform(np.log(info.eps), np.log(0.5), 600))
        return [np.concatenate([wide, near, info.smallest_subnormal * np.arange(1, 99)]).astype(dtype)]
    if name == "arc":
        near = signs * (1 - np.exp(rng.uniform(np.log(info.eps), 0, 600)))
        return [np.concatenate([near, rng.uniform(-1, 1, 600), [-1, -0.5, 0.5, 1]]).astype(dtype)]
    slopes = np.concatenate([np.linspace(0.45, 0.6, 300), np.linspace(0.9, 1.1, 301)])
    y = np.concatenate([spread, rng.normal(size=600), wide * signs, slopes]).astype(dtype)
    x = np.concatenate([rng.permutation(spread), rng.normal(size=600), wide, np.ones(601)]).astype(dtype)
    return [y, x]


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_is_within_two_ulp(name: str, dtype: Any, modules: dict[str, ModuleType]) -> None:
    """Test one backend; for these arguments both give the same bits."""
    arguments = _arguments(name, dtype)
    found = getattr(modules.get("c", modules["numba"]), name)(*arguments)
    assert found.dtype == dtype
    smallest = float(np.finfo(dtype).smallest_subnormal)
    worst = mpmath.mpf(0)
    with mpmath.workdps(50):
        for y, *x in zip(found, *arguments, strict=True):
            exact = FUNCTIONS[name][1](*map(mpmath.mpf, map(float, x)))
            unit = max(float(np.spacing(abs(dtype(float(exact))))), smallest)
            worst = max(worst, abs(mpmath.mpf(float(y)) - exact) / unit)
    assert worst < MOST_ULP


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_special_values_equal_those_of_the_c_library(name: str, dtype: Any, module: ModuleType) -> None:
    info = np.finfo(dtype)
    numbers = [0.0, 1.0, 2.0, info.max, info.tiny, info.smallest_subnormal, np.inf, 710.0, 1e-30]
    special = np.array([*numbers, *(-x for x in numbers), np.nan], dtype)
    arguments = list(zip(*itertools.product(special, repeat=1 + (name == "angle")), strict=True))
    arrays = [np.array(argument, dtype) for argument in arguments]
    found = getattr(module, name)(*arrays)
    with np.errstate(all="ignore"):
        known = FUNCTIONS[name][2](*arrays)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(known))
    np.testing.assert_array_equal(np.signbit(found[~np.isnan(known)]), np.signbit(known[~np.isnan(known)]))
    units = np.where(np.isfinite(known), np.maximum(np.spacing(abs(known)), info.smallest_subnormal), 1)
    with np.errstate(invalid="ignore"):
        difference = np.where(found == known, 0, abs(found - known) / units)
    assert np.nanmax(difference) <= 3


@all_cases("dtype", [np.float64, np.float32])
@all_cases("name", ["sine", "cosine"])
def test_one_large_angle_in_a_batch_is_as_exact_as_the_others(name: str, dtype: Any, module: ModuleType) -> None:
    function, known = getattr(module, name), FUNCTIONS[name][2]
    for n in (1, 15, 16, 64, 65, 200, 1000):
        x = np.linspace(-3, 3, n).astype(dtype)
        x[n // 2] = 1e6
        x[-1] = -np.float32(3e38)
        out = function(x)
        np.testing.assert_allclose(out, known(x.astype(float)).astype(dtype), rtol=0, atol=2 * np.finfo(dtype).eps)
        written = x.copy()
        np.testing.assert_array_equal(function(written, out=written), out)
        # Large angles do not affect the other results, nor does overwriting the angles.
        x[[n // 2, -1]] = FARTHEST, 0
        alone = np.array([function(one) for one in x])
        np.testing.assert_array_equal(function(x), alone)
        np.testing.assert_array_equal(function(x, out=x), alone)


@pytest.mark.parametrize("order", ["C", "F"])
def test_results_may_overwrite_arguments_with_large_angles(order: Any, module: ModuleType) -> None:
    v = np.asarray(np.random.default_rng(1).normal(size=(300, 2)), order=order)
    v[::70, 1] = 1e9
    expected = np.stack([v[:, 0] * np.cos(v[:, 1]), v[:, 1]], -1)
    written = v.copy(order)
    module.turned(written, out=written)
    np.testing.assert_allclose(written, expected, rtol=1e-15)


@pytest.fixture(name="both")
def both_fixture(modules: dict[str, ModuleType]) -> tuple[ModuleType, ModuleType]:
    if "c" not in modules:
        pytest.skip("no C compiler")
    return modules["c"], modules["numba"]


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_both_backends_give_the_same_bits(name: str, dtype: Any, both: tuple[ModuleType, ModuleType]) -> None:
    rng = np.random.default_rng(3)
    given = _arguments(name, dtype)
    special = np.array([0.0, -0.0, FARTHEST, np.nextafter(FARTHEST, np.inf), 1e9, -3e38, np.inf, np.nan, 1e-45], dtype)
    # Large angles among the others, and some tiles without them.
    places = rng.choice(len(given[0]) // 2, (len(given), 9))
    for argument, place in zip(given, places, strict=True):
        argument[place] = special
    right, found = (getattr(module, name)(*given) for module in both)
    assert bits(found) == bits(right)
    alone = [getattr(both[1], name).jit(*one) for one in zip(*given, strict=True)]
    assert bits(np.array(alone, dtype)) == bits(right)
    getattr(both[1], name)(*given, out=given[0])
    assert bits(given[0]) == bits(right)


@all_cases("dtype", [np.float64, np.float32])
@all_cases("order", ["C", "F"])
@all_cases("size", [1, 7, 8, 9, 31, 100])
def test_both_backends_overwrite_arguments_with_the_same_bits(
    size: int, order: Any, dtype: Any, both: tuple[ModuleType, ModuleType]
) -> None:
    v = np.random.default_rng(size).normal(size=(size, 2)).astype(dtype, order)
    v[size // 2, 1] = 1e9
    right = both[0].turned(v)
    both[1].turned(v, out=v)
    assert bits(v) == bits(right)


def test_both_backends_have_the_functions_of_angles(modules: dict[str, ModuleType]) -> None:
    assert {op.value for op in TRIGONOMETRIC} == OF_ANGLES
    assert {op.value for op in TRANSCENDENTAL} == FORMULAS.keys()


@pytest.mark.slow
def test_gcc_vectorises_every_loop(both: tuple[ModuleType, ModuleType], tmp_path: Path) -> None:
    assert scalar_loops(Path(str(both[0].__file__)).with_suffix(".c"), tmp_path, "F64") == []


@pytest.mark.parametrize("double", [True, False], ids=["double", "float"])
@pytest.mark.parametrize("name", APPROXIMATIONS)
def test_errors_of_polynomials_are_below_a_quarter_of_an_ulp(name: str, double: bool) -> None:
    """The leading terms are at least 1, and the error of a polynomial is multiplied by a power of the square."""
    power, middle = (2 if name in ("cos", "exp") else 1), (0.5 if name == "atan" else 0)
    unit = mpmath.mpf(2) ** (-53 if double else -24)
    with mpmath.workdps(40):
        low, high = map(mpmath.mpf, APPROXIMATIONS[name].interval())
        for k in range(101):
            z = low + (high - low) * k / 100
            polynomial = mpmath.polyval([mpmath.mpf(c) for c in reversed(coefficients(name, double=double))], z)
            assert abs((polynomial - APPROXIMATIONS[name].function(z)) * (z + middle) ** power) < unit / 2


def test_polynomials_approximate_the_functions() -> None:
    with mpmath.workdps(40):
        r = mpmath.mpf("0.3")
        z = r * r
        values = {
            "sin": (mpmath.sin(r) / r - 1) / z,
            "cos": (mpmath.cos(r) - 1 + z / 2) / z**2,
            "exp": (mpmath.exp(z) - 1 - z) / z**2,
            "log": (mpmath.log((1 + r) / (1 - r)) / r - 2) / z,
            "atan": (mpmath.atan(r) / r - 1) / z,
            "asin": (mpmath.asin(r) / r - 1) / z,
        }
        assert values.keys() == APPROXIMATIONS.keys()
        for name, value in values.items():
            found = APPROXIMATIONS[name].function(z - 0.5 if name == "atan" else z)
            assert abs(found - value) < mpmath.mpf(10) ** -35
