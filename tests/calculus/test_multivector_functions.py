"""Functions of complex, double and dual numbers and of multivectors, against mpmath and identities of matrices."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from algorithms.calculus import FUNCTIONS, multivector_function
from generated import vga3
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]
EXACT = {
    "expm1": mp.expm1, "log1p": lambda x: mp.log(1 + x), "reciprocal": lambda x: 1 / x, "square": lambda x: x * x,
    "cube": lambda x: x**3,
}  # fmt: skip


def exact(name: str) -> Any:
    return EXACT.get(name) or getattr(mp, name)


def inside(name: str) -> tuple[float, float]:
    """An interval of real numbers on which the function is smooth, away from poles and branch points."""
    return {
        "asin": (-0.9, 0.9), "acos": (-0.9, 0.9), "atanh": (-0.9, 0.9), "acosh": (1.2, 9), "log": (0.1, 9),
        "sqrt": (0.1, 9), "log1p": (-0.8, 9), "reciprocal": (0.2, 9), "tan": (-1.3, 1.3),
    }.get(name, (-3, 3))  # fmt: skip


@all_cases("name", FUNCTIONS)
def test_numbers(name: str) -> None:
    """In 40 digits: the derivative, the values of two real numbers, the complex value."""
    low, high = inside(name)
    rng = np.random.default_rng(1)
    a = rng.uniform(low, high, 50)
    b = rng.uniform(-1, 1, 50) * np.minimum(a - low, high - a)
    x = np.stack([a, b], -1)
    function = exact(name)
    with mp.workdps(40):
        for square in (0, 1, -1):
            found = multivector_function(name, x, [square])
            for (p, q), (real, part) in zip(x, found, strict=True):
                p, q = mp.mpf(p), mp.mpf(q)
                if square == 0:
                    truth = function(p), mp.diff(function, p) * q
                elif square == 1:
                    one, other = function(p + q), function(p - q)
                    truth = (one + other) / 2, (one - other) / 2
                else:
                    value = function(mp.mpc(p, q))
                    truth = value.real, value.imag
                size = sum(map(abs, truth)) + abs(mp.diff(function, p)) * (abs(p) + abs(q))
                assert max(abs(truth[0] - real), abs(truth[1] - part)) < 2e-15 * size


@cache
def direction() -> tuple[Array, Any, list[Any]]:
    """An element of G(3) of size 1, the eigenvalues of its matrix in 30 digits, and 1 in parts of its eigenvectors."""
    x = np.random.default_rng(2).normal(size=8)
    x /= np.linalg.norm(x)
    left = np.asarray(vga3.geometric_product(x, np.eye(8))).T
    with mp.workdps(30):
        values, vectors = mp.eig(mp.matrix(left.tolist()))
        one = mp.lu_solve(vectors, mp.matrix([1] + [0] * 7))
        return x, values, [vectors[:, k] * one[k] for k in range(8)]


@all_cases("name", FUNCTIONS)
def test_multivectors_of_space(name: str) -> None:
    """A function of ``x`` in 30 digits by the eigenvectors of the matrix that multiplies by ``x``."""
    low, high = inside(name)
    middle, size = (low + high) / 2, 0.3 * min((high - low) / 2, 1)
    function = exact(name)
    x, values, parts = direction()
    found = multivector_function(name, middle * np.eye(8)[0] + size * x)
    with mp.workdps(30):
        whole = sum(
            (function(middle + size * value) * part for value, part in zip(values, parts, strict=True)), mp.zeros(8, 1)
        )
        truth = np.array([complex(each) for each in whole])
    assert np.abs(truth.imag).max() < 1e-8
    np.testing.assert_allclose(found, truth.real, 0, 1e-8 * np.abs(truth).max())


@pytest.mark.parametrize("squares", [(0,), (1,), (-1,), (1, 1), (1, 0), (-1, -1), (1, 1, 1, 0), (1, -1, -1, -1)])
def test_identities(squares: tuple[int, ...]) -> None:
    """In any metric, also for null vectors, functions are inverse to each other, and tan is sin / cos."""
    rng = np.random.default_rng(3)
    x = rng.normal(size=(2, 1 << len(squares)))
    x *= 0.4 / np.abs(x).sum(-1, keepdims=True)

    def f(name: str, value: Array) -> Array:
        return multivector_function(name, value, squares)

    for inverse, function in (("asin", "sin"), ("atan", "tan"), ("asinh", "sinh"), ("atanh", "tanh"), ("log", "exp"),
                              ("log1p", "expm1")):  # fmt: skip
        np.testing.assert_allclose(f(inverse, f(function, x)), x, 0, 2e-12)
    one = np.eye(1 << len(squares))[0]
    np.testing.assert_allclose(f("cos", f("acos", x)), x, 0, 2e-12)
    np.testing.assert_allclose(f("cosh", f("acosh", x + 3 * one)), x + 3 * one, 0, 2e-12)
    np.testing.assert_allclose(f("square", f("sqrt", x + one)), x + one, 0, 2e-12)
    np.testing.assert_allclose(f("reciprocal", f("reciprocal", x + one)), x + one, 0, 2e-12)
    np.testing.assert_allclose(f("square", f("sin", x)) + f("square", f("cos", x)), one * np.ones((2, 1)), 0, 2e-12)
    np.testing.assert_allclose(f("square", f("cosh", x)) - f("square", f("sinh", x)), one * np.ones((2, 1)), 0, 2e-12)


def test_where_there_is_no_value() -> None:
    assert np.isnan(multivector_function("log", [1.0, 2.0], [1])).all()
    assert np.isnan(multivector_function("sqrt", [0.0, 1, 0, 0], [1, 0])).all(), "a vector of square 1 has no real root"
    assert np.isnan(multivector_function("sqrt", [0.0, 0, 1, 0], [1, 0])).all(), "nor has a null vector"
    assert np.isnan(multivector_function("reciprocal", [1.0, 1, 0, 0])).all(), "a divisor of zero"
    for divisor in ([1.0, 1, 0, 0], [2, 1.6, 1.2, 0], [0, 0, 0, 0]):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert np.isnan(multivector_function("log", divisor)).all(), "exp has no divisors of zero as values"
    assert np.isnan(multivector_function("exp", [np.nan, 1, 0, 0])).all()
    minus_one = np.array([-1.0, 0, 0, 0, 0, 0, 0, 0])
    assert np.isnan(multivector_function("sqrt", minus_one)).all(), "roots such as e123 belong to no branch"
    assert multivector_function("exp", np.empty((0, 4))).shape == (0, 4)
    assert multivector_function("exp", np.ones((2, 8), np.float32)).shape == (2, 8)
    frozen = np.ones(4)
    frozen.setflags(write=False)
    assert np.isfinite(multivector_function("sin", frozen)).all()


@all_cases(
    "arguments, message",
    [
        (("sine", [1.0, 2]), "name: 'sine'; expected one of exp"),
        (("sin", [1.0, 2, 3]), "x: shape"),
        (("sin", [1.0, 2], [2]), "squares"),
        (("sin", np.ones(128)), "7 basis vectors; expected 1 to 6"),
    ],
)
def test_errors(arguments: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        multivector_function(*arguments)
    with pytest.raises(TypeError, match="x: dtype"):
        multivector_function("sin", [1j, 2])


def test_elements_have_the_squares_of_their_algebra() -> None:
    from gacompiler.algebra.catalog import DUAL_NUMBERS
    from gacompiler.objects import PGA3, QUATERNIONS, VGA3, Space

    x = 2 + 3 * VGA3.e12
    assert multivector_function("log", x).isclose(np.log(np.sqrt(13)) + np.arctan2(3, 2) * VGA3.e12)
    q = QUATERNIONS.quaternion(1, 2, 3, 4)
    root = multivector_function("sqrt", q)
    assert (root * root).isclose(q, atol=1e-12) and root["1"] > 0
    dual = Space(DUAL_NUMBERS).of(DUAL_NUMBERS.NUMBER, 3.0, 1.0)
    assert multivector_function("square", dual).isclose(dual * dual) and (dual * dual)["e0"] == 6
    with pytest.raises(TypeError, match=r"x is PGA3\.MOTOR; expected an element of VGA2, .*, or an array"):
        multivector_function("log", PGA3.motor([0, 0, 1], 1))
    with pytest.raises(ValueError, match=r"squares: .* expected none beside an element of VGA3"):
        multivector_function("log", x, [1, 1, 1])
