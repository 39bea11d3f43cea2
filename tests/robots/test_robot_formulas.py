"""Robots in closed form: motors over symbols, as the book's program prints them; operations by number of joints."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

import pytest
import sympy
from selection import some_slow
from sympy.simplify.fu import TR8

import gacompiler as ga
from gacompiler import robots
from gacompiler.algebra.catalog import PGA3
from gacompiler.errors import SpecError
from gacompiler.passes.pipeline import compile_kernel

PAGE = Path(__file__).parents[2] / "docs" / "robots.md"
ORIGIN = PGA3.multivector({"e123": 1})


def position(motor: Any) -> list[Any]:
    point = motor * ORIGIN * ~motor
    return [point[name] for name in ("e032", "e013", "e021")]


def test_a_planar_arm_prints_as_in_the_textbook() -> None:
    q1, q2, a1, a2 = sympy.symbols("q1 q2 a1 a2", real=True)
    x, y, z = position(robots.row_motor(q1, a=a1) * robots.row_motor(q2, a=a2))
    x, y, z = (sympy.expand(TR8(sympy.expand(each))) for each in (x, y, z))  # products of sines become sums
    assert x == a1 * sympy.cos(q1) + a2 * sympy.cos(q1 + q2)
    assert y == a1 * sympy.sin(q1) + a2 * sympy.sin(q1 + q2)
    assert z == 0


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_the_stanford_arm_less_the_product_of_matrices_is_zero(convention: str) -> None:
    """Chapter 11.3.1: all lengths and angles are symbols, for which rational lengths, sines and cosines are inserted.

    A polynomial that is not zero is hardly ever zero at random points.
    """
    half = sympy.symbols("h1 h2 h4 k", real=True)
    d1, d2, d3, a = sympy.symbols("d1 d2 d3 a", real=True)
    k = 2 * half[3]
    rows = [
        {"theta": 2 * half[0], "d": d1, "alpha": k},
        {"theta": 2 * half[1], "d": d2, "a": a, "alpha": -k},
        {"d": d3, "a": a},
        {"theta": 2 * half[2], "alpha": k},
    ]
    motor, matrix = ga.geometric_product(PGA3.multivector({"1": 1}), 1), sympy.eye(4)
    for row in rows:
        motor = motor * robots.row_motor(**row, convention=convention)
        theta, alpha, d, x = (row.get(name, sympy.S(0)) for name in ("theta", "alpha", "d", "a"))
        about_z = sympy.eye(4)
        about_z[:2, :2] = [[sympy.cos(theta), -sympy.sin(theta)], [sympy.sin(theta), sympy.cos(theta)]]
        about_z[2, 3] = d
        about_x = sympy.eye(4)
        about_x[1:3, 1:3] = [[sympy.cos(alpha), -sympy.sin(alpha)], [sympy.sin(alpha), sympy.cos(alpha)]]
        about_x[0, 3] = x
        matrix = matrix * (about_z * about_x if convention == "standard" else about_x * about_z)
    points, random = [], Random(1)
    for _ in range(3):
        point = {length: sympy.Rational(random.randint(1, 99), 7) for length in (d1, d2, d3, a)}
        for h in half:
            t = sympy.Rational(random.randint(1, 99), 100)
            s, c = 2 * t / (1 + t * t), (1 - t * t) / (1 + t * t)
            point |= {sympy.sin(h): s, sympy.cos(h): c, sympy.sin(2 * h): 2 * s * c, sympy.cos(2 * h): c * c - s * s}
        points.append(point)

    def vanishes(formula: Any) -> bool:
        values = [formula.xreplace(point) for point in points]
        assert all(value.is_Rational for value in values), values
        return values == [0] * len(points)

    for found, expected in zip(position(motor), matrix[:3, 3], strict=True):
        assert not vanishes(expected + 1) and vanishes(found - expected)


def test_an_unknown_convention() -> None:
    with pytest.raises(SpecError, match="'standard' or 'modified'"):
        robots.row_motor(convention="craig")


def chain(n: int) -> robots.Chain:
    """Axes alternately along z and y, as in most arms."""
    axes = [(1.0, 0, 0, 0, 0, 0) if k % 2 == 0 else (0, 1.0, 0, float(k), 0, -0.3 * k) for k in range(n)]
    body = (1.0, 0.1, 0.2, 0.3, 0.5, 0.01, 0.02, 0.6, 0.03, 0.7)
    return robots.Chain(("revolute",) * n, tuple(range(-1, n - 1)), tuple(axes), n - 1, (1.0, *(0.0,) * 7), (body,) * n)


def products(n: int) -> tuple[int, int]:
    """Operation counts of the mass matrix and of gravity for a chain of n joints."""
    arm, joints = chain(n), ga.array(ga.SCALAR, n)

    @ga.kernel(q=joints, returns=ga.array(ga.SCALAR, n, n))
    def mass_matrix(q):  # type: ignore[no-untyped-def]
        """Mass matrix."""
        return robots.mass_matrix(arm, q)

    @ga.kernel(q=joints, returns=joints)
    def gravity(q):  # type: ignore[no-untyped-def]
        """Gravity."""
        return robots.gravity(arm, q)

    mass, weight = (compile_kernel(kernel).cost.mul for kernel in (mass_matrix, gravity))
    return mass, weight


@pytest.mark.parametrize("n", some_slow([3, 4], 4))
@pytest.mark.slow
def test_gravity_takes_linear_and_the_mass_matrix_quadratic_time(n: int) -> None:
    """Chapter 12.4, by the operations of the kernels; the page shows them for up to ten joints."""
    rows = re.findall(r"^\| (\d+) \| (\d+) \| (\d+) \|", PAGE.read_text(), re.MULTILINE)
    table = {int(n): (int(mass), int(weight)) for n, mass, weight in rows}
    assert sorted(table) == list(range(2, 11))
    assert products(n) == table[n]
    mass, weight = ([table[joints][k] for joints in range(3, 11)] for k in (0, 1))
    assert {b - a for a, b in pairwise(weight[2:])} == {12}
    second = [a - 2 * b + c for a, b, c in zip(mass, mass[1:], mass[2:], strict=False)]
    assert min(second) >= 0 and sum(second) > 30 and max(second) <= 16


def pendulum() -> robots.Chain:
    """Two links that turn about y, of lengths 0.5 and 0.6 along x; armature on the second joint."""
    bodies = (1.0, 0.25, 0, 0, 0, 0, 0, 0.02, 0, 0), (2.0, 0.8, 0, 0, 0, 0, 0, 0.03, 0, 0)
    axes = (0, -1.0, 0, 0, 0, 0), (0, -1.0, 0, 0, 0, 0.5)
    tool = (1.0, *(0.0,) * 7)
    return robots.Chain(("revolute",) * 2, (-1, 0), axes, 1, tool, bodies, armature=(0.0, 0.1))


def test_lagranges_equations_of_two_links_as_in_the_textbook() -> None:
    """Spong, Hutchinson and Vidyasagar, *Robot Modeling and Control* (2006), 6.4."""
    q, qd, qdd = (sympy.symbols(f"{name}1:3", real=True) for name in "qva")
    found = robots.lagrange_equations(pendulum(), q, qd, qdd)
    length, near, far = sympy.Rational(1, 2), sympy.Rational(1, 4), sympy.Rational(3, 10)
    i1, i2, rotor, g = sympy.Rational(1, 50), sympy.Rational(3, 100), sympy.Rational(1, 10), sympy.Rational(981, 100)
    c, s = sympy.cos(q[1]), sympy.sin(q[1])
    d22 = 2 * far**2 + i2
    d12 = d22 + 2 * length * far * c
    d11 = near**2 + i1 + 2 * length**2 + 2 * length * far * c + d12
    h = 2 * length * far * s
    weight = [
        (near + 2 * length) * sympy.cos(q[0]) + 2 * far * sympy.cos(q[0] + q[1]),
        2 * far * sympy.cos(q[0] + q[1]),
    ]
    sign = 1 if found[0].subs({x: 0 for x in (*q, *qd, *qdd)}) > 0 else -1
    expected = (
        d11 * qdd[0] + d12 * qdd[1] - h * (2 * qd[0] * qd[1] + qd[1] ** 2) + sign * g * weight[0],
        d12 * qdd[0] + (d22 + rotor) * qdd[1] + h * qd[0] ** 2 + sign * g * weight[1],
    )
    for mine, truth in zip(found, expected, strict=True):
        assert sympy.simplify(sympy.expand(sympy.expand_trig(mine - truth))) == 0


@pytest.mark.slow
def test_lagranges_equations_are_newtons_and_eulers() -> None:
    """For a spatial chain with a slide, at a rational point of the variables, to 30 digits."""
    arm = chain(3)
    arm = robots.Chain(("revolute", "prismatic", "revolute"), arm.parents, arm.axes, arm.tip, arm.tool, arm.inertias)
    q, qd, qdd = (sympy.symbols(f"{name}1:4", real=True) for name in "qva")
    values = {x: sympy.Rational(k + 1, 7) for k, x in enumerate((*q, *qd, *qdd))}
    newton = [torque["1"] for torque in robots.inverse_dynamics(arm, q, qd, qdd)]
    for a, b in zip(robots.lagrange_equations(arm, q, qd, qdd), newton, strict=True):
        assert abs(sympy.sympify(a - b).subs(values).evalf(40)) < 1e-30
