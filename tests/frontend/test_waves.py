"""Circular and hyperbolic functions of multivectors, against matrix functions of scipy, and 40 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
import scipy.linalg

import gacompiler as ga
from gacompiler import SCALAR, Cl, kernel
from gacompiler.errors import KernelError

WAVES = ("sin", "cos", "tan", "sinh", "cosh", "tanh")
GRADES = {
    (3,): [(0, 1), (0, 2), (1, 2)],
    (4,): [(2,), (0, 2)],
    (1, 3): [(2,)],
    (4, 1): [(2,)],
    (2, 0, 1): [(2,), (0, 1)],
}
CASES = [(signature, grades) for signature, rows in GRADES.items() for grades in rows]


def matrix_of(space: Any, x: Any) -> Any:
    """The matrix of the product with `x` from the left, from products of basis blades."""
    blades = space.algebra.full.blades
    rows = [[float((x * space.multivector({name: 1.0}))[row]) for name in blades] for row in blades]
    return np.array(rows)


@pytest.mark.parametrize(("signature", "grades"), CASES, ids=str)
def test_equal_to_matrix_functions(signature: tuple[int, ...], grades: tuple[int, ...]) -> None:
    space, rng = Cl(*signature), np.random.default_rng(7)
    names = [space.algebra.spelling(blade)[1] for k in grades for blade in space.algebra.blades(k)]
    x = space.multivector({name: 0.6 * rng.normal() for name in names})
    given, blades = matrix_of(space, x), space.algebra.full.blades
    for name in WAVES:
        wanted = getattr(scipy.linalg, f"{name}m")(given)[:, blades.index("1")]
        found = getattr(x, name)()
        np.testing.assert_allclose([float(found[row]) for row in blades], wanted, atol=2e-13 * np.abs(wanted).max())


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1.0, 30.0])
def test_equal_to_40_digits(size: float) -> None:
    """Small arguments keep their digits, and sines of large bivectors have those of the argument."""
    space = Cl(4)
    values = {"e12": 0.7 * size, "e34": -0.2 * size, "e13": 0.4 * size}
    x = space.multivector(values)
    with mpmath.workdps(40):
        exact = space.algebra.multivector({name: mpmath.mpf(value) for name, value in values.items()})
        for name in ("sin", "cos", "sinh", "cosh"):
            wanted = getattr(ga, name)(exact)
            found = getattr(x, name)()
            error = max(abs(float(wanted.terms.get(b, 0)) - float(found[space.algebra.spelling(b)[1]]))
                        for b in space.algebra.even.support)  # fmt: skip
            largest = max(abs(float(value)) for value in wanted.terms.values())
            assert error <= 4e-15 * largest * max(1.0, size)


def test_numbers_in_kernels() -> None:
    @kernel(w=SCALAR, returns=(SCALAR,) * 4)
    def hyperbolic(w):  # type: ignore[no-untyped-def]
        return ga.tan(w), ga.sinh(w), ga.cosh(w), ga.tanh(w)

    w = np.array([-800.0, -3.0, -1e-12, 0.0, 1e-5, 0.4, 25.0, 800.0])
    with np.errstate(over="ignore"):
        found = ga.compile(hyperbolic, backend="arrays", effort=0)(w)
        wanted = [np.tan(w), np.sinh(w), np.cosh(w), np.tanh(w)]
    for each, other in zip(found, wanted, strict=True):
        finite = np.isfinite(other)
        np.testing.assert_allclose(np.asarray(each)[finite], other[finite], rtol=1e-14)


@pytest.mark.parametrize("size", [0.1, 3.0, 19.9, 20.1, 400.0, 900.0, 1e120])
def test_tangents_of_long_boosts(size: float) -> None:
    """Also where the hyperbolic cosine, or its square, overflows."""
    space = Cl(3)
    for values in ({"e1": size}, {"e1": 0.6 * size, "e2": -0.8 * size}, {"e1": 1.25 * size, "e12": 0.75 * size}):
        found = ga.tanh(space.multivector(values))
        for name, value in values.items():
            np.testing.assert_allclose(float(found[name]), np.tanh(size) * value / size, rtol=4e-14)


def test_elements_of_other_forms_are_refused() -> None:
    space = Cl(3)
    with pytest.raises(KernelError, match="sin"):
        ga.sin(space.algebra.multivector({"e1": 1.0, "e12": 1.0, "e23": 0.5, "e123": 2.0, "e3": 1.0}))


def test_null_elements() -> None:
    """Also those whose squares overflow; elements with NaN are not null, and arrays give arrays."""
    space = Cl(1, 1)
    found = space.multivector({"e1": [0.0, 1.0, 1e200, 1.0, np.nan, 1.0], "e2": [0.0, 1.0, -1e200, 1.001, 1.0, 0.0]})
    assert found.is_null().tolist() == [True, True, True, False, False, False]
    assert space.multivector({"e1": np.zeros((0, 2))}).is_null().shape == (0, 2)
    single = space.multivector({"e1": np.float32([0.1]), "e2": np.float32([0.1])})
    assert single.is_null().all() and not space.basis()[0].is_null()
