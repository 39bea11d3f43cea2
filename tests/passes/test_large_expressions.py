"""Expressions whose size is that of data are compiled without recursion over it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
import pytest

import gacompiler
from gacompiler import SCALAR, array, kernel, total
from gacompiler.ir.cost import cost
from gacompiler.ir.interpret import interpret
from gacompiler.passes.pipeline import compile_kernel


def horner(x: Any, c: Any) -> Any:
    """The value of a polynomial by Horner's scheme."""
    value = c[0]
    for coefficient in c[1:]:
        value = value * x + coefficient
    return value


def cubics(x: Any) -> Any:
    """A sum of 200 cubic monomials."""
    monomials = list(combinations_with_replacement(x, 3))[:200]
    return sum((n % 7 + 1) * a * b * c for n, (a, b, c) in enumerate(monomials))


def bilinear(x: Any, y: Any) -> Any:
    """A sum of a term for each pair."""
    return sum((1 + i * j % 5) * a * b for i, a in enumerate(x) for j, b in enumerate(y))


@pytest.mark.parametrize(
    ("function", "shapes", "effort", "multiplications"),
    [
        (horner, ((), (200,)), 1, 199),
        (cubics, ((12,),), 0, None),
        pytest.param(cubics, ((12,),), 1, None, marks=pytest.mark.slow),
        (bilinear, ((30,), (30,)), 0, None),
        pytest.param(bilinear, ((100,), (100,)), 0, None, marks=pytest.mark.slow),
    ],
)
def test_large_expressions(
    function: Callable[..., Any], shapes: tuple[tuple[int, ...], ...], effort: int, multiplications: int | None
) -> None:
    names = ("x", "c") if function is horner else ("x", "y")[: len(shapes)]
    types = {name: array(SCALAR, *shape) if shape else SCALAR for name, shape in zip(names, shapes, strict=True)}
    program = compile_kernel(kernel(**types)(function), forms=False, effort=effort).program
    rng = np.random.default_rng(3)
    given = [np.asarray(rng.integers(-2, 3, shape), object) for shape in shapes]
    ((found,),) = interpret(program, dict(zip(names, ([*np.ravel(each)] for each in given), strict=True))).values()
    assert found == function(*(each.tolist() for each in given))
    assert multiplications is None or cost(program).mul == multiplications


def test_deep_rational_expressions_in_loops() -> None:
    """Their exact values are residues modulo a prime, since rational numbers would have too many digits."""

    @kernel(x=array(SCALAR, "n"), a=SCALAR)
    def deep(x: Any, a: Any) -> Any:
        def body(v: Any) -> Any:
            y = v
            for _ in range(9):
                y = (y * v + a) / (y * y + 1)
            return y

        return total(body, x)

    expected = 0.0
    for v in (1.0, 2.0):
        y = v
        for _ in range(9):
            y = (y * v + 0.5) / (y * y + 1)
        expected += y
    assert gacompiler.compile(deep)(np.array([1.0, 2.0]), 0.5) == pytest.approx(expected, rel=1e-14)
