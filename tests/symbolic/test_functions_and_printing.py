"""Functions and predicates of symbolic multivectors, factors of blades, numbers of mpmath, and LaTeX."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy

import gacompiler
from gacompiler import objects
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, PGA3, STA, VGA3, orthogonal
from gacompiler.algebra.multivector import Multivector
from gacompiler.calculus import Chart, LinearFunction
from gacompiler.errors import AlgebraError, InexactError, KernelError, ZeroDivisorError
from gacompiler.symbolic import (
    SymbolicMultivector,
    cos,
    cosh,
    equal,
    exp,
    factorize_blade,
    factorize_versor,
    is_blade,
    is_null,
    is_versor,
    log,
    multivector,
    outer_product,
    outer_tan,
    power,
    reduce,
    sin,
    sinh,
    sqrt,
    symbols,
    tan,
    tanh,
    to_kernel,
    unknowns,
)
from tests.support.all_cases import all_cases

t, r, theta = symbols("t r theta")
a, b = symbols("a b", layout=VGA3.VECTOR)
MOTOR = symbols("m", layout=PGA3.MOTOR)


def numbers(x: SymbolicMultivector, values: dict[Any, Any]) -> dict[int, complex]:
    return {blade: complex(value.subs(values)) for blade, value in x.expressions.items()}


def series(x: Multivector, coefficient: Callable[[int], float], terms: int = 40) -> Multivector:
    """Return a power series of a multivector of numbers."""
    power, total = x.lift(1.0), x.lift(0.0)
    for k in range(terms):
        total = total + power * coefficient(k)
        power = power * x
    return total


SERIES: dict[str, tuple[Any, Callable[[int], float]]] = {
    "sin": (sin, lambda k: (0, 1, 0, -1)[k % 4] / float(mpmath.factorial(k))),
    "cos": (cos, lambda k: (1, 0, -1, 0)[k % 4] / float(mpmath.factorial(k))),
    "sinh": (sinh, lambda k: k % 2 / float(mpmath.factorial(k))),
    "cosh": (cosh, lambda k: (k + 1) % 2 / float(mpmath.factorial(k))),
}


@all_cases("name", list(SERIES))
@all_cases(
    "element",
    [
        multivector(VGA3, {"1": t, "e1": 1, "e3": 2}),
        multivector(VGA3, {"1": t, "e12": 2, "e13": -1}),
        multivector(STA, {"g10": t, "1": 1}),
        multivector(PGA3, {"e01": t, "1": sympy.Rational(1, 2)}),
    ],
)
def test_waves_are_their_power_series(name: str, element: SymbolicMultivector) -> None:
    function, coefficient = SERIES[name]
    value = 0.7
    number = Multivector(element.algebra, {blade: x.real for blade, x in numbers(element, {t: value}).items()})
    known = series(number, coefficient)
    found = numbers(function(element), {t: value})
    for blade in {*known.terms, *found}:
        assert abs(found.get(blade, 0) - known.terms.get(blade, 0)) < 1e-12


def test_identities_of_waves() -> None:
    """Sums of squares, quotients, and Euler's formula with a plane as the imaginary unit."""
    x = 1 + a
    assert not reduce(sin(x) * sin(x) + cos(x) * cos(x) - 1).simplify().terms
    plane = multivector(VGA3, {"e12": 1})
    assert exp(t * plane) == cos(multivector(VGA3, t)) + plane * sin(multivector(VGA3, t))
    assert not reduce(tan(a) * cos(a) - sin(a)).simplify().terms
    assert not reduce(tanh(t * plane) * cosh(t * plane) - sinh(t * plane)).simplify().terms
    assert gacompiler.sin(a) == sin(a)
    assert (sin(t), cosh(t), tan(t), tanh(t)) == (sympy.sin(t), sympy.cosh(t), sympy.tan(t), sympy.tanh(t))
    with pytest.raises(AlgebraError, match="a scalar as its square"):
        sin(unknowns("B", orthogonal(4), 2))
    with pytest.raises(InexactError, match="not rational"):
        gacompiler.sin(VGA3.basis()[0])


def test_predicates() -> None:
    general = unknowns("B", orthogonal(4), 2)
    assert is_blade(a ^ b) and is_blade(a) and is_blade(unknowns("B", VGA3, 2)) and is_blade(0 * a)
    assert not is_blade(a * b) and not is_blade(general)
    pluecker = (general ^ general)[15]
    assert is_blade(general, pluecker)  # the quadric of blades
    assert is_versor(a * b) and is_versor(a) and is_versor(MOTOR, MOTOR)
    assert not is_versor(MOTOR) and not is_versor(1 + a) and not is_versor(0 * a)
    assert not is_versor(unknowns("R", orthogonal(4), 0, 2, 4)) and is_blade(multivector(VGA3, t))
    light, point = multivector(STA, {"g0": 1, "g1": 1}), symbols("p", layout=CGA3.POINT)
    assert is_null(light) and is_null(point, point) and not is_null(a) and not is_versor(light)


def test_factors_of_blades() -> None:
    c = symbols("c", layout=VGA3.VECTOR)
    for blade in (a, a ^ b, a ^ b ^ c, multivector(PGA3, {"e12": t, "e10": t**2})):
        scale, vectors = factorize_blade(blade)
        product = multivector(blade.algebra, scale)
        for vector in vectors:
            assert vector.grades == (1,)
            product = outer_product(product, vector)
        assert len(vectors) == blade.grades[0] and not reduce(product - blade).terms
    with pytest.raises(AlgebraError, match="factors of a blade"):
        factorize_blade(unknowns("B", orthogonal(4), 2))


def plane(algebra: Algebra, name: str, angle: Any) -> SymbolicMultivector:
    return exp(angle * multivector(algebra, {name: 1}))


NULL = multivector(orthogonal(2, 2), {"e1": 1, "e3": 1}) ^ multivector(orthogonal(2, 2), {"e2": 1, "e4": 1})
VERSORS: list[tuple[SymbolicMultivector, int, tuple[Any, ...]]] = [
    (multivector(VGA3, t), 0, ()),
    (a, 1, ()),
    (a * b, 2, ()),
    (plane(VGA3, "e12", theta), 2, ()),
    (MOTOR, 4, (MOTOR,)),
    (plane(STA, "g10", t) * plane(STA, "g12", r), 2, ()),
    (plane(orthogonal(4), "e12", t) * plane(orthogonal(4), "e34", r), 4, ()),
    (symbols("T", layout=CGA3.TRANSLATOR), 2, ()),
    (1 + t * NULL, 4, ()),  # the exception of Scherk: all vectors of the null plane are null
]


@all_cases("case", VERSORS)
def test_factors_of_versors(case: tuple[SymbolicMultivector, int, tuple[Any, ...]]) -> None:
    versor, number, given = case
    scale, vectors = factorize_versor(versor, *given)
    product = multivector(versor.algebra, scale)
    for vector in vectors:
        assert vector.grades == (1,)
        product = product * vector
    assert len(vectors) == number and equal(product, versor, *given)


def test_elements_without_factors() -> None:
    light = multivector(STA, {"g0": 1, "g1": 1})
    for element in (MOTOR, 0 * a, 1 + a, unknowns("R", orthogonal(4), 0, 2, 4), light):
        with pytest.raises(AlgebraError, match="factors of a versor"):
            factorize_versor(element)


def test_logarithms_and_roots_of_motors() -> None:
    """The exponential of the logarithm is the motor itself, also for more than half a turn."""
    screw = exp(-theta / 2 * multivector(PGA3, {"e12": 1, "e03": t, "e13": 2, "e01": 1}))
    for angle in (0.7, 4.0, 6.1):
        values = {theta: angle, t: 0.3}
        number = screw.subs(values)
        known = numbers(number, {})
        for found in (exp(log(screw)), sqrt(screw) ** 2, power(screw, sympy.Rational(1, 3)) ** 3):
            value = numbers(found, values)
            assert max(abs(value.get(k, 0) - known.get(k, 0)) for k in {*value, *known}) < 1e-12


def test_motors_that_are_not_unit_have_no_logarithm_here() -> None:
    screw = exp(-theta / 2 * multivector(PGA3, {"e12": 1, "e03": t, "e13": 2, "e01": 1}))
    wrong = multivector(PGA3, {"1": 1, "e12": 1, "e03": 1, "e0123": 5})
    for element in (2 * screw, wrong):
        for function in (log, sqrt):
            with pytest.raises(AlgebraError, match="a unit motor"):
                function(element)


def test_logarithms_of_vectors_are_complex() -> None:
    """A vector of Euclidean space has the values ``norm`` and ``-norm``."""
    values = {symbol: k + 1 for k, symbol in enumerate(a.coefficients.values())}
    found = numbers(exp(log(a)), values)
    assert all(abs(found.get(blade, 0) - x) < 1e-12 for blade, x in numbers(a, values).items())
    assert all(abs(x) < 1e-12 for blade, x in found.items() if blade.bit_count() != 1)


def test_functions_of_scalars_and_outer_functions() -> None:
    assert (exp(t), log(t), sqrt(t), power(t, r)) == (sympy.exp(t), sympy.log(t), sympy.sqrt(t), t**r)
    planes = multivector(orthogonal(4), {"e12": t, "e13": 2, "e34": r})
    tangent = planes.outer_tan()
    assert tangent == gacompiler.outer_tan(planes) and equal(tangent * (1 + (planes ^ planes) / 2), planes)
    assert outer_tan(a) == a


@pytest.mark.parametrize(
    ("algebra", "terms"),
    [
        (orthogonal(4), {"e12": "1", "e34": "1.3", "e13": "0.2"}),
        (orthogonal(5), {"e12": "1", "e34": "1"}),
        (orthogonal(4), {"e12": "1e-20", "e34": "1e-3"}),
        (orthogonal(4), {"e12": "1.5707", "e34": "0.3"}),
        (orthogonal(2, 2), {"e12": "1", "e34": "0.4", "e13": "1"}),
        (PGA3, {"e12": "1", "e01": "2", "e03": "3"}),
    ],
    ids=str,
)
def test_numbers_of_mpmath(algebra: Algebra, terms: dict[str, str]) -> None:
    """Exponentials and logarithms to all digits of mpmath, against the matrix exponential of mpmath."""
    with mpmath.workdps(40):
        x = algebra.multivector({name: mpmath.mpf(value) for name, value in terms.items()})
        versor = gacompiler.exp(x)
        blades = sorted(algebra.even.support)
        columns = [x * Multivector(algebra, {blade: mpmath.mpf(1)}) for blade in blades]
        matrix = mpmath.matrix([[column.terms.get(blade, 0) for column in columns] for blade in blades])
        known = mpmath.expm(matrix)[:, blades.index(0)]
        assert max(abs(versor.terms.get(blade, 0) - known[k]) for k, blade in enumerate(blades)) < 1e-37
        for found in (gacompiler.log(versor, unit=True), gacompiler.power(versor, mpmath.mpf(1), unit=True).log()):
            assert max(map(abs, (found - x).terms.values()), default=0) < 1e-37
        root = gacompiler.sqrt(versor, unit=True)
        assert max(map(abs, (root * root - versor).terms.values()), default=0) < 1e-37


def test_quotients_by_zero() -> None:
    e1, zero = objects.VGA3.vector(1, 0, 0), objects.VGA3.vector(0, 1, 0) | objects.VGA3.vector(1, 0, 0)
    for divisor in (0, 0.0, np.float64(0), zero):
        with pytest.raises(ZeroDivisorError, match="a divisor other than zero"):
            e1 / divisor
    assert (e1 / 2).isclose(objects.VGA3.vector(0.5, 0, 0))
    with np.errstate(all="ignore"):
        assert np.isinf((objects.VGA3.vector(np.ones(2), 0, 0) / 0)["e1"]).all()


def test_kernels_and_metrics_with_symbols() -> None:
    """Scalars of such algebras become kernels, if the symbols of the metric are arguments; numbers have no metric."""
    aa, ab, bb = symbols("aa ab bb")
    algebra = Algebra("plane", "a b", [[aa, ab], [ab, bb]], layouts=lambda each: [each.layout("V", "a b")])
    v, w = symbols("v w", layout=algebra.V)
    inner = gacompiler.compile(to_kernel((v * w).scalar, v, w, aa, ab, bb, name="inner"))
    assert inner([1.0, 2.0], [3.0, -1.0], 2.0, 0.5, 1.0) == 6 + 0.5 * (6 - 1) - 2
    with pytest.raises(KernelError, match="metric has symbols"):
        gacompiler.kernel(v=algebra.V)(lambda v: v)
    with pytest.raises(AlgebraError, match="metric has symbols"):
        gacompiler.Space(algebra)


def test_latex() -> None:
    """Blades of coordinate frames, operators, line elements and linear functions print as in textbooks."""
    sphere = Chart.of_metric([r**2, r**2 * sympy.sin(theta) ** 2], theta, t)
    area = sphere.frame[0] ^ sphere.frame[1]
    assert sympy.latex(area) == r"e_{\theta} \wedge e_{t}" and area._repr_latex_() == rf"${sympy.latex(area)}$"
    assert sympy.latex((2 * r * area + r * sphere.frame[0]).factored()).startswith(r"r\,\left(e_{\theta} + 2\,")
    line = r"\mathrm{d}s^{2} = r^{2}\,\mathrm{d}\theta^{2} + r^{2} \sin^{2}{\left(\theta \right)}\,\mathrm{d}t^{2}"
    assert sympy.latex(sphere) == line
    assert sympy.latex(sphere.frame[0] | sphere.grad) == r"1\,\frac{\partial}{\partial \theta}"
    assert sympy.latex(LinearFunction.of(VGA3, lambda v: 2 * v)) == sympy.latex(2 * sympy.eye(3))
    assert sympy.latex([VGA3, VGA3.VECTOR]) == r"\left[ \mathrm{VGA3}, \  \mathrm{VGA3.VECTOR}\right]"
    oblique = Algebra("O", "u v", [[2, 1], [1, 3]])
    assert sympy.latex(unknowns("x", oblique, 2)) == r"x_{u v}\,u \wedge v"
    assert sympy.latex(multivector(VGA3, {"e12": t + 1, "e1": -1})) == r"-e_{1} + \left(t + 1\right)e_{12}"
    assert sympy.latex(objects.VGA3.vector(1, 2, 3)) == r"\mathbf{e}_{1} + 2\,\mathbf{e}_{2} + 3\,\mathbf{e}_{3}"
