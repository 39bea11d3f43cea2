"""Spacetimes, surfaces and frames with closed forms from textbooks, by charts with metrics and with positions.

Carroll, *Spacetime and Geometry*, 2004, ch. 6 and 8, in the signature (+ - - -), which changes the sign of the scalar
curvature; do Carmo, *Differential Geometry of Curves and Surfaces*, 1976, ch. 3.
"""

from __future__ import annotations

from itertools import combinations
from typing import Any

import pytest
import sympy
from sympy import Function, cos, cosh, exp, sin, sqrt

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import VGA3
from gacompiler.calculus import Chart, cartesian
from gacompiler.symbolic import SymbolicMultivector, multivector, reduce, scalar_product, symbols

T, R, THETA, PHI, X, Y, Z, U, V = symbols("t r theta phi x y z u v")
A, B, H, K, M, Q = symbols("a b H k M Q")
SPHERE = Chart.of_metric([1, sin(THETA) ** 2], THETA, PHI)


def around(f: Any) -> Chart:
    """The static metric about a center with the potential f."""
    return Chart.of_metric([f, -1 / f, -(R**2), -((R * sin(THETA)) ** 2)], T, R, THETA, PHI)


def zero(x: Any) -> bool:
    return bool(sympy.simplify(x) == 0)


def test_expanding_universe() -> None:
    """Friedmann's equations: the Einstein tensor of a homogeneous space with the scale a(t) and the curvature k."""
    a = Function("a")(T)
    rows = [1, -(a**2) / (1 - K * R**2), -((a * R) ** 2), -((a * R * sin(THETA)) ** 2)]
    universe = Chart.of_metric(rows, T, R, THETA, PHI)
    assert zero(universe.einstein[0, 0] - 3 * (a.diff(T) ** 2 + K) / a**2)
    assert zero(universe.ricci[0, 0] + 3 * a.diff(T, 2) / a)
    assert zero(universe.scalar_curvature + 6 * (a.diff(T, 2) / a + a.diff(T) ** 2 / a**2 + K / a**2))


def test_charged_hole_and_de_sitter() -> None:
    charged = around(1 - 2 * M / R + Q**2 / R**2)
    assert zero(charged.scalar_curvature)
    assert zero(charged.kretschmann - (48 * M**2 / R**6 - 96 * M * Q**2 / R**7 + 56 * Q**4 / R**8))
    empty = around(1 - H**2 * R**2)
    assert (empty.ricci + 3 * H**2 * empty.metric).applyfunc(sympy.simplify).is_zero_matrix
    assert zero(empty.kretschmann - 24 * H**4)


def test_spaces_of_constant_curvature() -> None:
    half_plane = Chart.of_metric([1 / Y**2, 1 / Y**2], X, Y)
    assert half_plane.scalar_curvature == -2
    assert zero(half_plane.christoffel[0, 0, 1] + 1 / Y) and zero(half_plane.christoffel[1, 0, 0] - 1 / Y)
    ball = Chart.of_metric([A**2, (A * sin(U)) ** 2, (A * sin(U) * sin(V)) ** 2], U, V, PHI)
    assert zero(ball.scalar_curvature - 6 / A**2)


SURFACES = {
    "catenoid": ([cosh(V) * cos(U), cosh(V) * sin(U), V], -1 / cosh(V) ** 4, True),
    "helicoid": ([U * cos(V), U * sin(V), A * V], -(A**2) / (U**2 + A**2) ** 2, True),
    "spheroid": (
        [A * cos(V) * cos(U), A * cos(V) * sin(U), B * sin(V)],
        B**2 / (A**2 * sin(V) ** 2 + B**2 * cos(V) ** 2) ** 2, False,
    ),
}  # fmt: skip
"""Positions, Gauss's curvature, and whether the mean curvature vanishes."""


@pytest.mark.parametrize("name", SURFACES)
def test_curvature_of_surfaces(name: str) -> None:
    position, gauss, is_minimal = SURFACES[name]
    chart = Chart(multivector(VGA3, dict(zip(("e1", "e2", "e3"), position, strict=True))), U, V)
    assert zero((chart.scalar_curvature - 2 * gauss).rewrite(exp))
    form, inverse = chart.second_fundamental_form, chart.inverse_metric
    mean = sum((inverse[i, j] * form[i][j] for i in range(2) for j in range(2)), 0 * form[0][0])
    assert (mean.simplify() == 0) == is_minimal


def test_oblique_frames() -> None:
    """The divergence and the curl of a field of unknown functions along three oblique vectors, by components."""
    chart = cartesian(Algebra("SKEW", "p q w", [[1, A, 0], [A, 1, B], [0, B, 1]]), "x y z")
    place, frame = chart.parameters, chart.frame
    functions = [Function(name)(*place) for name in "fgh"]
    field = sum((functions[k] * frame[k] for k in range(3)), 0 * frame[0])
    assert zero(chart.divergence(field).scalar - sum(functions[k].diff(place[k]) for k in range(3)))
    lower = [sum(chart.metric[i, j] * functions[j] for j in range(3)) for i in range(3)]
    for i, j in combinations(range(3), 2):
        found = scalar_product(frame[j] ^ frame[i], chart.curl(field)).scalar
        assert zero(found - (lower[j].diff(place[i]) - lower[i].diff(place[j])))
    assert chart.curl(chart.curl(field)) == 0


def test_metrics_with_unknown_functions() -> None:
    """Two curls vanish, and the divergence is that of the density sqrt(g) F."""
    mu = Function("mu")(X, Y)
    chart = Chart.of_metric([[exp(2 * mu), X * Y, 0], [X * Y, 1 + X**2, 0], [0, 0, 1 + Y**2]], X, Y, Z)
    functions = [Function(name)(X, Y, Z) for name in "fgh"]
    field = sum((functions[k] * chart.frame[k] for k in range(3)), 0 * chart.frame[0])
    assert reduce(chart.curl(chart.curl(field))) == 0
    volume = sqrt(chart.metric.det())
    wanted = sum((volume * functions[k]).diff((X, Y, Z)[k]) for k in range(3)) / volume
    assert zero(chart.divergence(field).scalar - wanted)


def combined(first: Any, second: Any) -> SymbolicMultivector:
    return first * SPHERE.frame[0] + second * SPHERE.frame[1]


def test_lie_brackets() -> None:
    """Rotations of the sphere have the brackets of so(3) and preserve its area; brackets obey Jacobi's identity."""
    first = combined(-sin(PHI), -cos(PHI) * cos(THETA) / sin(THETA))
    second = combined(cos(PHI), -sin(PHI) * cos(THETA) / sin(THETA))
    third = SPHERE.frame[1]
    for a, b, c in ((first, second, third), (second, third, first), (third, first, second)):
        assert reduce(SPHERE.bracket(a, b) + c) == 0
        assert reduce(SPHERE.lie_derivative(a, (SPHERE.frame[0] ^ SPHERE.frame[1]) / sin(THETA))) == 0
    fields = [combined(sin(THETA) * PHI, THETA**2), combined(cos(PHI), sin(THETA + PHI)), combined(exp(THETA), PHI)]
    a, b, c = fields
    bracket = SPHERE.bracket
    cyclic = bracket(a, bracket(b, c)) + bracket(b, bracket(c, a)) + bracket(c, bracket(a, b))
    assert reduce(cyclic).simplify() == 0
    assert reduce(SPHERE.lie_derivative(a, b) - bracket(a, b)).simplify() == 0


def test_operators_compose() -> None:
    """``grad (f grad g)`` by the product rule, and derivatives from the right as reverses."""
    f, g = (Function(name)(THETA, PHI) for name in "fg")
    grad = SPHERE.grad
    assert reduce(grad * (f * g) - (grad * f) * g - f * (grad * g)) == 0
    assert reduce((f * grad) * g - f * (grad * g)) == 0
    assert reduce((grad * (f * grad)) * g - ((grad * f) * (grad * g) + f * SPHERE.laplacian(g))).simplify() == 0
    field = combined(sin(THETA) * PHI, THETA**2)
    assert reduce(~(grad * field) - field * SPHERE.rgrad) == 0
