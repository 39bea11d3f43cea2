"""Kernels that are operators of torch and jax in tests: straight-line, with two results, with a loop, with a table."""

from __future__ import annotations

import functools

import pytest

import gacompiler
from gacompiler import (
    SCALAR,
    array,
    cos,
    differentiable,
    fold,
    gather,
    kernel,
    sandwich,
    scalar_product,
    sin,
    total,
)
from gacompiler.algebra.catalog import PGA3, VGA3
from gacompiler.frontend.parameters import index


@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move_point(m, p):
    """Move a point."""
    return sandwich(m, p)


@kernel(a=VGA3.VECTOR, s=SCALAR)
def two_results(a, s):
    """Return a number and a vector."""
    return s * s * scalar_product(a, a), s * a


@kernel(q=array(SCALAR, "n"), axes=array(VGA3.BIVECTOR, "n"), tool=VGA3.ROTOR)
def arm(q, axes, tool):
    """Return the orientation by the product of exponentials; that of poses is compiled for three times as long."""
    return fold(lambda m, a, axis: m * (cos(a / 2) - sin(a / 2) * axis), 1, q, axes) * tool


@kernel(c=array(SCALAR, "n"), x=SCALAR)
def polynomial(c, x):
    """Return the value of a polynomial by Horner's rule."""
    return fold(lambda s, each: s * x + each, 0, c)


@kernel(x=array(SCALAR, "n", 2), rows=index("m", into="n"))
def picked(x, rows):
    """Return a sum of products over the rows of a table."""
    return total(lambda p: p[0] * p[1], gather(x, rows))


SHAPES = [(move_point, ((3, 8), (2, 1, 3))), (two_results, ((4, 3), (4,))), (two_results, ((3,), (2, 1)))]
"""Kernels with shapes of their arguments, which broadcast."""


def compile_quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile operators without a search for cheaper forms, which takes most of the time and changes no result."""
    monkeypatch.setattr(differentiable, "compile", functools.partial(gacompiler.compile, effort=0))
