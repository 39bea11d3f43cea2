"""Charts with symbolic metrics: connection, curvature, derivatives and operators, against closed forms of textbooks."""

from __future__ import annotations

from itertools import product
from typing import Any

import pytest
import sympy
from sympy import Matrix, Rational, cos, sin, sinh

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import STA, VGA2, VGA3
from gacompiler.calculus import Chart, FieldOperator, LinearFunction, cartesian, cylindrical, spherical
from gacompiler.errors import AlgebraError
from gacompiler.symbolic import (
    SymbolicMultivector,
    commutator,
    inverse,
    multivector,
    polarity,
    reduce,
    symbols,
    unknowns,
)

t, r, theta, phi, u, v, R, x, y = symbols("t r theta phi u v R x y")
M, a = symbols("M a", positive=True)
SIGMA, DELTA = r**2 + a**2 * cos(theta) ** 2, r**2 - 2 * M * r + a**2
SCHWARZSCHILD = Chart.of_metric(
    [1 - 2 * M / r, -1 / (1 - 2 * M / r), -(r**2), -(r**2) * sin(theta) ** 2], t, r, theta, phi
)
TORUS = Chart(
    multivector(VGA3, {"e1": (R + r * cos(u)) * cos(v), "e2": (R + r * cos(u)) * sin(v), "e3": r * sin(u)}), u, v
)


def kerr() -> Chart:
    """The metric in Boyer and Lindquist's coordinates (Misner, Thorne & Wheeler 1973, §33.2), of signature + - - -."""
    s = sin(theta) ** 2
    turn = 2 * M * r * a * s / SIGMA
    round_ = -(r**2 + a**2 + 2 * M * r * a**2 * s / SIGMA) * s
    rows = [[1 - 2 * M * r / SIGMA, 0, 0, turn], [0, -SIGMA / DELTA, 0, 0], [0, 0, -SIGMA, 0], [turn, 0, 0, round_]]
    return Chart.of_metric(Matrix(rows), t, r, theta, phi)


def vanishes(value: Any) -> bool:
    return not reduce(value).terms if isinstance(value, SymbolicMultivector) else sympy.simplify(value) == 0


def field(chart: Chart, *grades: int, name: str = "F") -> SymbolicMultivector:
    """Return a field whose coefficients are arbitrary functions of the parameters."""
    algebra = chart.algebra
    terms = {blade: sympy.Function(f"{name}{blade}")(*chart.parameters) for blade in algebra.blades(*grades)}
    return SymbolicMultivector(algebra, terms)


class TestAlgebrasWithSymbolicMetrics:
    ab, aa, bb = symbols("ab aa bb")
    algebra = Algebra("plane", "a b", [[aa, ab], [ab, bb]])

    def test_products_of_vectors(self) -> None:
        """Lagrange's identity; Dorst, Fontijne & Mann 2007, §3.1."""
        p, q = map(lambda each: multivector(self.algebra, each), self.algebra.basis())
        assert (p * q).scalar == self.ab and p * p == self.aa
        assert (p ^ q) * (p ^ q) == self.ab**2 - self.aa * self.bb
        assert commutator(p, p ^ q) == self.aa * q - self.ab * p
        assert vanishes(inverse(p + q) * (p + q) - 1)
        assert vanishes(polarity(polarity(p)) - p / ((p ^ q) * (p ^ q)).scalar)

    def test_agrees_with_numbers_in_place_of_symbols(self) -> None:
        numbers = Algebra("numbers", "a b", [[2, 3], [3, Rational(1, 2)]])
        values = {self.aa: 2, self.ab: 3, self.bb: Rational(1, 2)}
        for blades in product(range(4), repeat=2):
            there = SymbolicMultivector(self.algebra, {blades[0]: 1}) * SymbolicMultivector(
                self.algebra, {blades[1]: 1}
            )
            here = SymbolicMultivector(numbers, {blades[0]: 1}) * SymbolicMultivector(numbers, {blades[1]: 1})
            assert dict(there.subs(values).terms) == dict(here.terms)

    def test_rational_coefficients_and_brackets(self) -> None:
        half = self.algebra.multivector({"a": Rational(1, 2), "b": 3, "a^b": 1})
        assert multivector(self.algebra, half) * 2 == multivector(self.algebra, {"a": 1, "b": 6, "a^b": 2})
        exact = self.algebra.multivector({"1": 1, "a": 2, "b": 3, "a^b": 4})
        square = multivector(self.algebra, exact * exact)
        assert square == multivector(self.algebra, exact) * multivector(self.algebra, exact)

    def test_outermorphisms(self) -> None:
        f = LinearFunction.of(self.algebra, lambda w: 2 * w)
        assert f.determinant == 4 and vanishes(f.adjoint.matrix[0, 0] - 2) and f.adjoint.matrix[0, 1] == 0


class TestConnection:
    def test_of_schwarzschild(self) -> None:
        """Misner, Thorne & Wheeler 1973, exercise 31.1: the only symbols that differ from zero."""
        f = 1 - 2 * M / r
        known = {
            (0, 0, 1): M / (r**2 * f), (1, 0, 0): M * f / r**2, (1, 1, 1): -M / (r**2 * f), (1, 2, 2): -r * f,
            (1, 3, 3): -r * f * sin(theta) ** 2, (2, 1, 2): 1 / r, (2, 3, 3): -sin(theta) * cos(theta),
            (3, 1, 3): 1 / r, (3, 2, 3): cos(theta) / sin(theta),
        }  # fmt: skip
        for k, i, j in product(range(4), repeat=3):
            expected = known.get((k, min(i, j), max(i, j)), 0)
            assert vanishes(SCHWARZSCHILD.christoffel[k, i, j] - expected)
        assert vanishes(SCHWARZSCHILD.christoffel_first[1, 2, 2] - r)  # the metric is negative for r

    def test_does_not_depend_on_the_embedding(self) -> None:
        assert TORUS.christoffel == TORUS.intrinsic().christoffel
        assert vanishes(TORUS.christoffel[0, 1, 1] - (R + r * cos(u)) * sin(u) / r)

    def test_is_compatible_with_the_metric(self) -> None:
        """``d_k (a . b) = D_k a . b + a . D_k b``, in coordinates that are not orthogonal."""
        sheared = Chart.of_metric([[1 + y**2, x * y], [x * y, 1 + x**2]], x, y)
        one, two = field(sheared, 1), field(sheared, 1, name="G")
        for k in range(2):
            whole = sheared.partial((one | two), k)
            assert vanishes(whole - (sheared.partial(one, k) | two) - (one | sheared.partial(two, k)))


class TestCurvature:
    def test_of_schwarzschild(self) -> None:
        assert SCHWARZSCHILD.ricci == sympy.zeros(4, 4)
        assert SCHWARZSCHILD.scalar_curvature == 0
        assert vanishes(SCHWARZSCHILD.kretschmann - 48 * M**2 / r**6)
        assert vanishes(SCHWARZSCHILD.riemann_lower[0, 1, 0, 1] - 2 * M / r**3)

    @pytest.mark.slow
    def test_of_kerr(self) -> None:
        assert kerr().ricci == sympy.zeros(4, 4)

    @pytest.mark.slow
    def test_connection_and_kretschmann_of_kerr(self) -> None:
        """Henry, *Astrophys. J.* 535:350, 2000, without charge."""
        chart = kerr()
        known = M * (r**2 + a**2) * (r**2 - a**2 * cos(theta) ** 2) / (SIGMA**2 * DELTA)
        assert vanishes(chart.christoffel[0, 0, 1] - known)
        c = a * cos(theta)
        known = 48 * M**2 * (r**6 - 15 * r**4 * c**2 + 15 * r**2 * c**4 - c**6) / SIGMA**6
        assert vanishes(chart.kretschmann - known)

    def test_of_spheres_and_hyperbolic_planes(self) -> None:
        two = Chart.of_metric([r**2, r**2 * sin(theta) ** 2], theta, phi)
        three = Chart.of_metric([1, sin(x) ** 2, sin(x) ** 2 * sin(theta) ** 2], x, theta, phi)
        hyperbolic = Chart.of_metric([1, sinh(x) ** 2], x, phi)
        assert two.scalar_curvature == 2 / r**2
        assert three.scalar_curvature == 6 and vanishes(three.ricci[2, 2] - 2 * three.metric[2, 2])
        assert hyperbolic.scalar_curvature == -2
        assert two.einstein == sympy.zeros(2, 2)  # in every surface
        assert Chart.of_metric([1 / y**2, 1 / y**2], x, y).scalar_curvature == -2  # Poincare's half plane

    def test_of_an_expanding_universe(self) -> None:
        """Friedmann's equation: Wald 1984, §5.2, for flat space, ``G_00 = 3 (a' / a)**2``."""
        scale = sympy.Function("a")(t)
        z = symbols("z")
        chart = Chart.of_metric([-1, scale**2, scale**2, scale**2], t, x, y, z)
        assert vanishes(chart.einstein[0, 0] - 3 * scale.diff(t) ** 2 / scale**2)

    @pytest.mark.slow
    def test_of_a_torus(self) -> None:
        """Gauss's equation, from the second fundamental form, and the closed form (do Carmo 1976, §3-3)."""
        gauss = cos(u) / (r * (R + r * cos(u)))
        assert vanishes(TORUS.scalar_curvature - 2 * gauss)
        form = TORUS.second_fundamental_form
        second = (form[0][0] | form[1][1]) - (form[0][1] | form[0][1])
        assert vanishes(second.scalar - gauss * TORUS.metric.det())
        assert vanishes(TORUS.riemann_lower[0, 1, 0, 1] - second.scalar)

    def test_vanishes_in_flat_coordinates(self) -> None:
        for chart in (spherical(), cylindrical(), cartesian(STA, "t x y z")):
            assert chart.riemann == sympy.ImmutableDenseNDimArray.zeros(*[len(chart.parameters)] * 4)

    @pytest.mark.parametrize("chart", [TORUS.intrinsic(), TORUS], ids=["metric", "position"])
    def test_commutator_of_covariant_derivatives(self, chart: Chart) -> None:
        """The Ricci identity; Misner, Thorne & Wheeler 1973, equation 11.9."""
        p, q = chart.frame
        f, g = sympy.Function("f")(u, v), sympy.Function("g")(u, v)
        one, two, moved = p * f, q + p * v, p * g + q * u
        d = chart.covariant_derivative
        left = d(one, d(two, moved)) - d(two, d(one, moved)) - d(chart.bracket(one, two), moved)
        assert vanishes(left - commutator(chart.curvature(one, two), moved))
        assert chart.curvature(p, q).terms


class TestDerivatives:
    f = sympy.Function("f")

    def test_laplacians(self) -> None:
        f = self.f(r, theta, phi)
        known = (
            (r**2 * f.diff(r)).diff(r) / r**2
            + (sin(theta) * f.diff(theta)).diff(theta) / (r**2 * sin(theta))
            + f.diff(phi, 2) / (r * sin(theta)) ** 2
        )
        chart = Chart.of_metric([1, r**2, r**2 * sin(theta) ** 2], r, theta, phi)
        assert vanishes(chart.laplacian(f)["1"] - known)
        g = self.f(r, phi)
        polar = Chart.of_metric([1, r**2], r, phi)
        assert vanishes(polar.laplacian(g)["1"] - g.diff(r, 2) - g.diff(r) / r - g.diff(phi, 2) / r**2)

    def test_divergence_and_curl_by_the_volume(self) -> None:
        """``div a = d_k(sqrt(g) a^k) / sqrt(g)``, and a curl without Christoffel symbols, in oblique coordinates."""
        chart = Chart.of_metric([[1 + y**2, x * y], [x * y, 1 + x**2]], x, y)
        one = field(chart, 1)
        volume = sympy.sqrt(chart.metric.det())
        known = sum((volume * one[1 << k]).diff(p) for k, p in enumerate((x, y))) / volume
        assert vanishes(chart.divergence(one)["1"] - known)
        low = [sum(chart.metric[k, i] * one[1 << i] for i in range(2)) for k in range(2)]
        assert vanishes(chart.curl(one)[3] * chart.metric.det() - low[1].diff(x) + low[0].diff(y))
        assert vanishes(chart.curl(chart.curl(one)))

    def test_of_all_grades_do_not_depend_on_the_frame(self) -> None:
        """The derivative of a field of flat space in its fixed basis, and in the frame of polar coordinates."""
        flat, polar = cylindrical("r phi z"), Chart.of_metric([1, r**2, 1], r, phi, symbols("z"))
        back = LinearFunction(VGA3, Matrix([[each[1 << k] for each in flat.frame] for k in range(3)]))
        there = field(polar)
        here = back(SymbolicMultivector(VGA3, there.terms))
        for name in ("derivative", "divergence", "curl"):
            moved = SymbolicMultivector(VGA3, getattr(polar, name)(there).terms)
            assert vanishes(back(moved) - getattr(flat, name)(here))

    def test_lie_derivatives(self) -> None:
        """The metric's Killing field, brackets by components, Leibniz's rule and Jacobi's identity."""
        chart = Chart.of_metric([r**2, r**2 * sin(theta) ** 2], theta, phi)
        e1, e2 = chart.frame
        rotation = sin(phi) * e1 + cos(theta) / sin(theta) * cos(phi) * e2
        assert vanishes(chart.divergence(rotation))
        assert vanishes(chart.lie_derivative(rotation, (e1 ^ e2) / sin(theta)))  # rotations preserve areas
        one, two, three = (field(chart, 1, name=name) for name in "ABC")
        bracket = chart.bracket(one, two)
        for k in range(2):
            component = sum(
                one[1 << i] * two[1 << k].diff(p) - two[1 << i] * one[1 << k].diff(p)
                for i, p in enumerate((theta, phi))
            )
            assert vanishes(bracket[1 << k] - component)
        assert vanishes(chart.lie_derivative(one, two) - bracket)
        whole = chart.lie_derivative(one, two ^ three)
        assert vanishes(whole - (bracket ^ three) - (two ^ chart.bracket(one, three)))
        jacobi = [chart.bracket(p, chart.bracket(q, s)) for p, q, s in ((one, two, e1), (two, e1, one), (e1, one, two))]
        assert vanishes(jacobi[0] + jacobi[1] + jacobi[2])

    def test_submanifolds(self) -> None:
        space = Chart.of_metric([1, r**2, r**2 * sin(theta) ** 2], r, theta, phi)
        sphere = space.submanifold([R, u, v], u, v)
        assert sphere.metric == sympy.diag(R**2, R**2 * sin(u) ** 2) and sphere.scalar_curvature == 2 / R**2
        cone = spherical().submanifold({theta: a, r: u, phi: v}, u, v)
        assert cone.position is not None and vanishes(cone.scalar_curvature)
        equator = SCHWARZSCHILD.submanifold({t: 0, r: u, theta: sympy.pi / 2, phi: v}, u, v)
        assert vanishes(equator.metric[0, 0] + u / (u - 2 * M))

    def test_covariant_derivative_on_a_surface(self) -> None:
        """It is tangential, and agrees with the one of the induced metric."""
        f, g = sympy.Function("f")(u, v), sympy.Function("g")(u, v)
        vector = TORUS.frame[0] * f + TORUS.frame[1] * g
        there = TORUS.intrinsic()
        other = there.frame[0] * f + there.frame[1] * g
        for k in range(2):
            moved = there.covariant_derivative(there.frame[k], other)
            known = TORUS.frame[0] * moved[1] + TORUS.frame[1] * moved[2]
            assert vanishes(TORUS.covariant_derivative(TORUS.frame[k], vector) - known)

    def test_invalid_charts(self) -> None:
        with pytest.raises(AlgebraError, match="determinant zero"):
            Chart.of_metric([[1, 1], [1, 1]], x, y)
        with pytest.raises(AlgebraError, match="symmetric"):
            Chart.of_metric([[1, x], [y, 1]], x, y)
        with pytest.raises(AlgebraError, match="2 squares"):
            Chart.of_metric([1, x, 1], x, y)
        with pytest.raises(AlgebraError, match="one per parameter"):
            SCHWARZSCHILD.submanifold([1, 2], u)


CHARTS = {
    "polar": Chart.of_metric([1, r**2], r, phi),
    "sphere": Chart.of_metric([1, sin(theta) ** 2], theta, phi),
    "oblique": Chart.of_metric([[1, x], [x, 1 + 2 * x**2]], x, y),
}


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("sphere", "oblique")]


@pytest.mark.parametrize("name", ["polar", *SLOW])
class TestOperators:
    def test_application_and_composition(self, name: str) -> None:
        chart = CHARTS[name]
        whole, scalar, vector = field(chart), field(chart, 0, name="s"), field(chart, 1, name="w")
        grad = chart.grad
        assert grad * whole == chart.derivative(whole) and (grad ^ whole) == chart.curl(whole)
        assert vanishes((grad * grad) * whole - grad * (grad * whole))
        assert vanishes((grad * vector * 1) - chart.derivative(vector))
        assert isinstance(vector * grad, FieldOperator)
        assert vanishes((vector * grad) * whole - vector * (grad * whole))
        assert vanishes((grad * (vector * grad)) * whole - grad * (vector * (grad * whole)))
        assert vanishes((vector | grad) * whole - chart.directional_derivative(vector, whole))
        assert vanishes(((grad + scalar) ** 2) * whole - (grad + scalar) * ((grad + scalar) * whole))
        assert vanishes((2 * grad - grad / 2) * whole - grad * whole * Rational(3, 2))

    def test_from_the_right(self, name: str) -> None:
        chart = CHARTS[name]
        whole, vector = field(chart), field(chart, 1, name="w")
        rgrad = chart.rgrad
        assert whole * rgrad == chart.derivative(whole, right=True)
        assert vanishes(whole * (rgrad * rgrad) - (whole * rgrad) * rgrad)
        assert isinstance(rgrad * vector, FieldOperator)
        assert vanishes(whole * (rgrad * vector) - (whole * rgrad) * vector)
        assert vanishes(whole * ((rgrad * vector) * rgrad) - ((whole * rgrad) * vector) * rgrad)
        assert vanishes(~(chart.grad * whole) - ~whole * rgrad)


def test_operators_of_flat_space_are_compared_by_their_coefficients() -> None:
    chart = cartesian(VGA3, "x y z")
    grad, w = chart.grad, unknowns("w", VGA3, 1)
    laplacian = grad * grad
    assert laplacian.is_scalar and not grad.is_scalar
    assert laplacian == grad**2 and laplacian == (grad | grad) and (grad ^ grad) == 0
    assert grad - grad == 0 and grad != laplacian and 1 + grad == grad + 1
    x_ = chart.parameters[0]
    # d_x x - x d_x = 1, and the angular momentum annihilates functions of the radius (Doran & Lasenby 2003, §8.1)
    (dx,) = (FieldOperator(chart, [(1, (0,))]),)
    assert dx * (x_ * grad) - (x_ * dx) * grad == grad
    radius = sympy.sqrt(sum(p**2 for p in chart.parameters))
    assert vanishes((chart.position ^ grad) * sympy.Function("f")(radius))
    assert str(w | grad) == "(w_e1)*D_x + (w_e2)*D_y + (w_e3)*D_z"
    assert sympy.latex(laplacian).count(r"\frac{\partial^{2}}") == 3
    with pytest.raises(AlgebraError, match="the same side"):
        grad + chart.rgrad
    with pytest.raises(AlgebraError, match="different charts"):
        grad * cartesian(VGA3, "u v w").grad
    with pytest.raises(AlgebraError, match="algebra"):
        grad * unknowns("b", VGA2)
