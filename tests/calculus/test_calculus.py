"""Geometric calculus: Hestenes's table, sympy.vector's operators, plane waves of Maxwell and Dirac; all exact."""

from __future__ import annotations

from collections.abc import Callable
from math import comb
from typing import Any

import pytest
import sympy
from sympy.vector import CoordSys3D, Vector, gradient
from sympy.vector import curl as sympy_curl
from sympy.vector import divergence as sympy_divergence

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA2, PGA2, STA, VGA2, VGA3, orthogonal
from gacompiler.calculus import (
    Chart,
    LinearFunction,
    cartesian,
    cylindrical,
    derivative_by,
    differential,
    dirac_column,
    dirac_matrices,
    dirac_spinor,
    linear_function,
    pauli_column,
    pauli_matrices,
    pauli_spinor,
    spherical,
)
from gacompiler.errors import AlgebraError, ZeroDivisorError
from gacompiler.symbolic import (
    SymbolicMultivector,
    equal,
    exp,
    inverse,
    left_contraction,
    multivector,
    norm,
    norm_squared,
    reduce,
    reverse,
    scalar_product,
    symbols,
    unknowns,
)

OBLIQUE = Algebra("OBLIQUE", "u v w", [[2, 1, 0], [1, 3, -1], [0, -1, -1]])
METRICS = [VGA2, VGA3, STA, CGA2, orthogonal(4), orthogonal(1, 2), OBLIQUE]


def vector(name: str, algebra: Algebra) -> SymbolicMultivector:
    return unknowns(name, algebra, 1)


def zero(x: SymbolicMultivector) -> bool:
    return not reduce(x).simplify().terms


# The table of Hestenes & Sobczyk 1984, §2-1 and §2-8; Doran & Lasenby 2003, §6.1.


@pytest.mark.parametrize("algebra", METRICS, ids=lambda algebra: algebra.name)
class TestTableOfVectorDerivatives:
    def test_of_linear_and_quadratic_functions(self, algebra: Algebra) -> None:
        n, x, a = algebra.dimension, vector("x", algebra), vector("a", algebra)
        assert derivative_by(x, x) == n
        assert derivative_by(x, x * x) == 2 * x
        assert derivative_by(x, left_contraction(a, x)) == a
        assert derivative_by(x, x ^ a) == (n - 1) * a
        assert derivative_by(x, a * x) == (2 - n) * a
        assert derivative_by(x, x * a) == n * a

    def test_of_products_with_a_blade(self, algebra: Algebra) -> None:
        n, x = algebra.dimension, vector("x", algebra)
        for r in range(1, n + 1):
            blade = unknowns("A", algebra, r)
            assert derivative_by(x, left_contraction(x, blade)) == r * blade
            assert derivative_by(x, x ^ blade) == (n - r) * blade
            assert derivative_by(x, blade * x) == (-1) ** r * (n - 2 * r) * blade


@pytest.mark.parametrize("algebra", [VGA2, VGA3, orthogonal(4)], ids=lambda algebra: algebra.name)
class TestTableOfPowers:
    def test_of_the_length(self, algebra: Algebra) -> None:
        n, x = algebra.dimension, vector("x", algebra)
        r = norm(x)
        assert zero(derivative_by(x, r) - x / r)
        for k in (-3, -1, 2, 3, 4):
            power = r["1"] ** k
            assert zero(derivative_by(x, power) - k * power / r["1"] ** 2 * x)
            assert zero(derivative_by(x, x * power) - (n + k) * power)
        assert zero(derivative_by(x, sympy.log(r["1"])) - inverse(x))
        assert zero(derivative_by(x, x * r["1"] ** -n))  # Cauchy's kernel is monogenic

    def test_of_functions_of_the_length(self, algebra: Algebra) -> None:
        x = vector("x", algebra)
        r = norm(x)["1"]
        f, s = sympy.Function("f"), sympy.Symbol("s", real=True)
        slope = sympy.diff(f(s), s)
        assert zero((derivative_by(x, f(r)) - x / r * slope.subs(s, r)).map(lambda c: c.doit()))

    def test_of_the_exponential_of_a_projection(self, algebra: Algebra) -> None:
        x, a = vector("x", algebra), vector("a", algebra)
        value = sympy.exp(left_contraction(a, x)["1"])
        assert derivative_by(x, value) == value * a


@pytest.mark.parametrize("algebra", [VGA2, VGA3, orthogonal(1, 1), STA], ids=lambda algebra: algebra.name)
class TestDerivativesByMultivectors:
    def test_of_linear_functions(self, algebra: Algebra) -> None:
        x, a = unknowns("X", algebra), unknowns("A", algebra)
        assert derivative_by(x, scalar_product(x, a)) == a
        assert derivative_by(x, scalar_product(reverse(x), a)) == reverse(a)
        assert derivative_by(x, norm_squared(x)) == 2 * reverse(x)
        assert derivative_by(x, x) == 2**algebra.dimension

    def test_over_one_grade(self, algebra: Algebra) -> None:
        for r in range(1, algebra.dimension + 1):
            x, a = unknowns("X", algebra, r), unknowns("A", algebra)
            assert derivative_by(x, x) == comb(algebra.dimension, r)
            assert derivative_by(x, scalar_product(x, a)) == a.grade(r)

    def test_differential_is_the_slope_along_a_direction(self, algebra: Algebra) -> None:
        x, a = unknowns("X", algebra, 0, 2), unknowns("A", algebra, 0, 2)
        assert differential(x, a, x * x) == x * a + a * x
        v = unknowns("v", algebra, 1)
        b = unknowns("B", algebra, 1)
        assert differential(v, b, v * a * v) == b * a * v + v * a * b
        t = symbols("t")
        cube = (x + t * a) * reverse(x + t * a)
        assert differential(x, a, x * reverse(x)) == cube.diff(t).subs(t, 0)


def test_errors_of_derivatives() -> None:
    m = symbols("m", layout=VGA3.ROTOR)
    with pytest.raises(AlgebraError, match="not free"):
        derivative_by(m, m * m)
    with pytest.raises(AlgebraError, match="symbols"):
        derivative_by(m * m, m)
    with pytest.raises(AlgebraError, match="degenerate"):
        derivative_by(unknowns("x", PGA2, 1), 1)
    with pytest.raises(AlgebraError, match="degenerate"):
        _ = cartesian(PGA2, "x y w").reciprocal_frame
    with pytest.raises(AlgebraError, match="degenerate"):
        t, s = symbols("t s")
        _ = Chart(multivector(VGA3, {"e1": t + s}), t, s).reciprocal_frame
    with pytest.raises(AlgebraError, match="a vector"):
        Chart(multivector(VGA3, {"e12": symbols("t")}), symbols("t"))
    with pytest.raises(AlgebraError, match="VGA2"):
        spherical().derivative(unknowns("x", VGA2))
    with pytest.raises(AlgebraError, match="2 names"):
        cartesian(VGA3, "x y")


# Curvilinear coordinates against sympy.vector


def parabolic() -> Chart:
    u, v, w = symbols("u v w")
    return Chart(multivector(VGA3, {"e1": u * v, "e2": (u**2 - v**2) / 2, "e3": w}), u, v, w)


SYSTEMS: dict[str, tuple[Callable[[], Chart], Any]] = {
    "spherical": (spherical, "spherical"),
    "cylindrical": (cylindrical, "cylindrical"),
    "parabolic": (parabolic, lambda u, v, w: (u * v, (u**2 - v**2) / 2, w)),
}


@pytest.fixture(scope="module", params=list(SYSTEMS))
def system(request: pytest.FixtureRequest) -> tuple[Chart, Any]:
    make, transformation = SYSTEMS[request.param]
    return make(), CoordSys3D("C", transformation=transformation)


def fields(parameters: Any) -> tuple[Any, list[Any]]:
    return sympy.Function("f")(*parameters), [sympy.Function(name)(*parameters) for name in "FGH"]


def peer_field(components: list[Any], peer: Any) -> Any:
    return sum((c * e for c, e in zip(components, peer.base_vectors(), strict=True)), Vector.zero)


def theirs(value: Any, chart: Chart, peer: Any) -> Any:
    return value.subs(dict(zip(peer.base_scalars(), chart.parameters, strict=True)), simultaneous=True).doit()


class TestCurvilinear:
    def test_scale_factors(self, system: tuple[Chart, Any]) -> None:
        chart, peer = system
        for mine, other in zip(chart.lengths, peer.lame_coefficients(), strict=True):
            assert sympy.simplify(mine**2 - theirs(other, chart, peer) ** 2) == 0

    def test_gradient(self, system: tuple[Chart, Any]) -> None:
        chart, peer = system
        mine, other = fields(chart.parameters)[0], fields(peer.base_scalars())[0]
        expected = [theirs(c, chart, peer) for c in gradient(other, peer).to_matrix(peer)]
        assert zero(chart.derivative(mine) - chart.vector(*expected))

    def test_divergence(self, system: tuple[Chart, Any]) -> None:
        chart, peer = system
        mine, other = fields(chart.parameters)[1], fields(peer.base_scalars())[1]
        expected = sympy_divergence(peer_field(other, peer), peer)
        assert zero(chart.divergence(chart.vector(*mine)) - theirs(expected, chart, peer))

    def test_curl(self, system: tuple[Chart, Any]) -> None:
        """Gibbs's curl is ``-I (d ^ F)`` in a right-handed frame; the parabolic one is left-handed."""
        chart, peer = system
        mine, other = fields(chart.parameters)[1], fields(peer.base_scalars())[1]
        found = sympy_curl(peer_field(other, peer), peer)
        expected = [theirs(c, chart, peer) for c in found.to_matrix(peer)]
        a, b, c = chart.unit_frame
        volume = reduce(a ^ b ^ c)
        assert volume * volume == -1
        assert zero(chart.curl(chart.vector(*mine)) - chart.vector(*expected) * volume)

    def test_laplacian(self, system: tuple[Chart, Any]) -> None:
        chart, peer = system
        mine, other = fields(chart.parameters)[0], fields(peer.base_scalars())[0]
        expected = sympy_divergence(gradient(other, peer), peer)
        assert zero(chart.laplacian(mine) - theirs(expected, chart, peer))

    def test_reciprocal_frame_and_position(self, system: tuple[Chart, Any]) -> None:
        chart, _ = system
        for i, up in enumerate(chart.reciprocal_frame):
            for j, down in enumerate(chart.frame):
                assert zero(left_contraction(up, down) - int(i == j))
        assert chart.derivative(chart.position) == 3
        assert chart.curl(chart.position) == 0
        components = [sympy.Function(name)(*chart.parameters) for name in "FGH"]
        for mine, given in zip(chart.components(chart.vector(*components)), components, strict=True):
            assert sympy.simplify(mine - given) == 0

    def test_components_are_those_of_vectors(self, system: tuple[Chart, Any]) -> None:
        chart, _ = system
        curl = chart.curl(chart.vector(*(parameter**2 * chart.parameters[-1] for parameter in chart.parameters)))
        with pytest.raises(AlgebraError, match=r"Chart\.components\(\): a field of grade 2; expected a vector field"):
            chart.components(curl)


@pytest.mark.parametrize("sign", [1, -1])
def test_lengths_are_positive(sign: int) -> None:
    """The root of the metric of bipolar coordinates has a factor that is negative everywhere, or its negative."""
    u, v = symbols("u v")
    denominator = sign * (sympy.cosh(v) - sympy.cos(u))
    chart = Chart(multivector(VGA2, {"e1": sympy.sinh(v) / denominator, "e2": sympy.sin(u) / denominator}), u, v)
    assert all(length.subs({u: 0.4, v: -0.7}) > 0 for length in chart.lengths)
    assert chart.components(chart.frame[0])[0].subs({u: 0.4, v: -0.7}) > 0


@pytest.mark.parametrize("algebra", [STA, OBLIQUE, CGA2], ids=lambda algebra: algebra.name)
def test_operators_in_any_signature(algebra: Algebra) -> None:
    chart = cartesian(algebra, " ".join(f"x{k}" for k in range(algebra.dimension)))
    field = multivector(
        algebra,
        {
            algebra.spelling(blade)[1]: sympy.Function(f"F{blade}")(*chart.parameters)
            for blade in algebra.blades(0, 1, 2)[::3]
        },
    )
    derivative = chart.derivative(field)
    assert derivative == chart.divergence(field) + chart.curl(field)
    assert chart.curl(chart.curl(field)) == 0
    assert chart.divergence(chart.divergence(field)) == 0
    gram = sympy.Matrix(algebra.dimension, algebra.dimension, lambda i, j: sympy.sympify(algebra.gram[i][j])).inv()
    expected = sum(
        (field.diff(a, b) * gram[i, j] for i, a in enumerate(chart.parameters) for j, b in enumerate(chart.parameters)),
        SymbolicMultivector(algebra, {}),
    )
    assert chart.laplacian(field) == expected
    a = vector("a", algebra)
    assert chart.directional_derivative(a, chart.position) == a
    assert chart.derivative(field, right=True) == reverse(chart.derivative(reverse(field)))


def test_derivative_within_a_surface() -> None:
    theta, phi = symbols("theta phi")
    x = {"e1": sympy.sin(theta) * sympy.cos(phi), "e2": sympy.sin(theta) * sympy.sin(phi), "e3": sympy.cos(theta)}
    sphere = Chart(multivector(VGA3, x), theta, phi)
    assert sphere.derivative(sphere.position) == 2
    harmonic = sympy.Ynm(2, 1, theta, phi).expand(func=True)
    assert zero(sphere.divergence(sphere.derivative(harmonic)) + 6 * harmonic)


def test_monogenic_functions_of_the_plane_are_those_of_cauchy_and_riemann() -> None:
    plane = cartesian(VGA2, "x y")
    x, y = plane.parameters
    u, v = (sympy.Function(name)(x, y) for name in "uv")
    derivative = plane.derivative(multivector(VGA2, {"1": u, "e12": v}))
    assert derivative["e1"] == u.diff(x) - v.diff(y)
    assert derivative["e2"] == u.diff(y) + v.diff(x)
    z = multivector(VGA2, {"1": x, "e12": y})
    assert plane.derivative(z**5 - 3 * z) == 0
    assert zero(plane.derivative(inverse(z)))


# Linear functions


@pytest.mark.parametrize("algebra", [VGA2, VGA3, orthogonal(1, 2), OBLIQUE], ids=lambda algebra: algebra.name)
class TestLinearFunctions:
    def test_outermorphism(self, algebra: Algebra) -> None:
        f, g = linear_function("f", algebra), linear_function("g", algebra)
        a, b = vector("a", algebra), vector("b", algebra)
        assert f(a ^ b) == f(a) ^ f(b)
        assert f(algebra.pseudoscalar) == f.matrix.det() * multivector(algebra, algebra.pseudoscalar)
        assert sympy.expand(f.determinant - f.matrix.det()) == 0
        assert (f @ g)(a ^ b) == f(g(a ^ b))
        assert f(3) == 3

    def test_adjoint(self, algebra: Algebra) -> None:
        f = linear_function("f", algebra)
        x, y = unknowns("X", algebra), unknowns("Y", algebra)
        assert scalar_product(f(x), y) == scalar_product(x, f.adjoint(y))
        assert f.adjoint.adjoint == f

    def test_inverse_through_the_adjoint(self, algebra: Algebra) -> None:
        """``f^-1(A) = det(f)^-1 adjoint(A I) I^-1``."""
        n = algebra.dimension
        f = LinearFunction(algebra, sympy.Matrix(n, n, lambda i, j: (i + 2 * j) % 5 + 1))
        assert f.determinant != 0
        x = unknowns("X", algebra)
        pseudoscalar = multivector(algebra, algebra.pseudoscalar)
        assert f.inverse(x) * f.determinant == f.adjoint(x * pseudoscalar) * inverse(pseudoscalar)
        assert f(f.inverse(x)) == x

    def test_derivatives(self, algebra: Algebra) -> None:
        """Doran & Lasenby 2003, §11.1.1."""
        f = linear_function("f", algebra)
        a, b, c = (vector(name, algebra) for name in "abc")
        assert f.derivative(left_contraction(f(b), c), a) == left_contraction(a, b) * c
        assert f.derivative(f.trace, a) == a
        assert zero(f.adjoint(f.derivative(f.determinant, a)) - f.determinant * a)  # det f times adjoint^-1(a)
        plane = unknowns("B", algebra, 2)
        found = f.derivative(scalar_product(f(b ^ c), plane), a)
        assert found == left_contraction(f(left_contraction(a, b ^ c)), plane)


def test_eigenblades() -> None:
    f = LinearFunction(VGA3, [[2, 1, 0], [1, 2, 0], [0, 0, 5]])
    for grade in (1, 2, 3):
        pairs = f.eigenblades(grade)
        assert len(pairs) == comb(3, grade)
        for value, blade in pairs:
            assert f(blade) == value * blade
    assert f.eigenblades(3)[0][0] == f.determinant
    turn = LinearFunction(VGA3, sympy.Matrix([[3, -4, 0], [4, 3, 0], [0, 0, 5]]) / 5)
    planes = dict((str(value), blade) for value, blade in turn.eigenblades(2))
    assert set(planes["1"].terms) == {3} and planes["1"]["e12"].is_real
    assert all(turn(blade) == value * blade for value, blade in turn.eigenblades())
    theta = symbols("theta")
    rotor = exp(-theta / 2 * multivector(VGA3, {"e12": 1}))
    rotation = LinearFunction.of(VGA3, lambda a: reduce(rotor * a * ~rotor))
    assert reduce(rotation(VGA3.multivector({"e12": 1}))) == VGA3.multivector({"e12": 1})
    assert (rotation @ rotation.adjoint) == LinearFunction(VGA3, sympy.eye(3))
    assert reduce(multivector(VGA3, rotation.determinant)) == 1


def test_errors_of_linear_functions() -> None:
    with pytest.raises(AlgebraError, match="not linear"):
        LinearFunction.of(VGA3, lambda a: a * a["e1"])
    with pytest.raises(AlgebraError, match="a vector"):
        LinearFunction.of(VGA3, lambda a: a * a)
    with pytest.raises(AlgebraError, match=r"LinearFunction\.of"):
        LinearFunction(VGA3, lambda a: 2 * a)
    with pytest.raises(AlgebraError, match="3 x 3"):
        LinearFunction(VGA3, [[1, 2], [3, 4]])
    with pytest.raises(ZeroDivisorError):
        _ = LinearFunction(VGA2, [[1, 2], [2, 4]]).inverse
    with pytest.raises(AlgebraError, match="degenerate"):
        _ = LinearFunction(PGA2, sympy.eye(3)).adjoint
    with pytest.raises(AlgebraError, match="independent symbols"):
        LinearFunction(VGA2, [[1, 2], [2, 4]]).derivative(1, VGA2.basis()[0])
    with pytest.raises(AlgebraError, match="grade 4"):
        LinearFunction(VGA3, sympy.eye(3)).eigenblades(4)


# Maxwell and Dirac


def test_plane_wave_solves_the_equation_of_maxwell() -> None:
    """``d F = 0`` for circular and linear polarisation, exactly where the wave vector is null."""
    spacetime = cartesian(STA, "t x y z")
    t, _, _, z = spacetime.parameters
    omega, alpha, wave_number = symbols("omega alpha k")
    g0, g1, _, g3 = STA.basis()
    wave_vector = omega * (multivector(STA, g0) + g3)
    assert wave_vector * wave_vector == 0
    phase = left_contraction(wave_vector, spacetime.position)["1"]
    pseudoscalar = multivector(STA, STA.pseudoscalar)
    amplitude = wave_vector ^ g1
    for field in (
        amplitude * exp(alpha * pseudoscalar) * exp(phase * pseudoscalar),
        amplitude * sympy.cos(phase + alpha),
        amplitude * sympy.Function("f")(phase),
    ):
        assert spacetime.derivative(field) == 0
        assert field * field == 0  # both invariants of a plane wave vanish
    slow = amplitude * sympy.cos(omega * t - wave_number * z)
    assert spacetime.derivative(slow) != 0
    assert spacetime.derivative(slow).subs(wave_number, omega) == 0


def test_maxwell_in_spacetime_is_gibbs_in_space() -> None:
    """``F = E + I B`` with ``E = E_k g_k g_0``: ``d F`` holds the four equations."""
    spacetime, space = cartesian(STA, "t x y z"), cartesian(VGA3, "x y z")
    t = spacetime.parameters[0]
    electric, magnetic = ([sympy.Function(f"{n}{k}")(*spacetime.parameters) for k in (1, 2, 3)] for n in "EB")
    g = STA.basis()
    sigma = [multivector(STA, g[k] * g[0]) for k in (1, 2, 3)]
    pseudoscalar = STA.pseudoscalar
    nothing = SymbolicMultivector(STA, {})
    field = sum((e * s + b * (pseudoscalar * s) for e, b, s in zip(electric, magnetic, sigma, strict=True)), nothing)
    relative = g[0] * spacetime.derivative(field)  # rho - J, plus trivector parts that vanish
    e, b = space.vector(*electric), space.vector(*magnetic)

    def curl(v: SymbolicMultivector) -> SymbolicMultivector:
        return -VGA3.pseudoscalar * space.curl(v)

    assert relative["1"] == space.divergence(e)["1"]
    for k, s in enumerate(sigma):
        blade = f"e{k + 1}"
        name = f"g{k + 1}g0"
        assert s[name] == 1
        assert relative[name] == (e.diff(t) - curl(b))[blade]
    other = -pseudoscalar * relative  # I times scalar and relative vector turn into these
    assert other["1"] == space.divergence(b)["1"]
    for k in (1, 2, 3):
        assert other[f"g{k}g0"] == (b.diff(t) + curl(e))[f"e{k}"]


def test_plane_waves_solve_the_equation_of_dirac() -> None:
    """``d psi I sigma3 = m psi g0`` for positive and negative energy, any spin and momentum along any direction."""
    spacetime = cartesian(STA, "t x y z")
    g0, g1, g2, g3 = STA.basis()
    mass, rapidity, spin, azimuth = symbols("m a s b")
    boost = exp(rapidity / 2 * multivector(STA, g3 * g0))
    turn = exp(azimuth / 2 * multivector(STA, g2 * g1)) * exp(spin / 2 * multivector(STA, g1 * g3))
    momentum = reduce(mass * (boost * g0 * ~boost))
    assert reduce(momentum * momentum) == mass**2
    i_sigma3 = multivector(STA, g2 * g1)
    phase = left_contraction(momentum, spacetime.position)["1"]
    particle = boost * turn * exp(-phase * i_sigma3)
    assert reduce(spacetime.derivative(particle) * i_sigma3 - mass * particle * g0) == 0
    antiparticle = boost * turn * multivector(STA, STA.pseudoscalar) * exp(phase * i_sigma3)
    assert reduce(spacetime.derivative(antiparticle) * i_sigma3 - mass * antiparticle * g0) == 0
    for state in (particle, antiparticle):
        current = reduce(state * g0 * ~state)
        assert set(current.grades) == {1}
        assert spacetime.divergence(current) == 0
    assert equal(particle * ~particle, 1)
    assert equal(antiparticle * ~antiparticle, -1)


def test_schroedinger_as_pauli_without_a_field() -> None:
    space = cartesian(VGA3, "x y z")
    t, m, p = symbols("t m p")
    i_sigma3 = multivector(VGA3, {"e12": 1})
    wave = exp((p * space.parameters[0] - p**2 / (2 * m) * t) * i_sigma3)
    assert zero(wave.diff(t) * i_sigma3 + space.laplacian(wave) / (2 * m))


def complex_symbols(names: str) -> list[Any]:
    return [symbols(f"{n}_r") + sympy.I * symbols(f"{n}_i") for n in names.split()]


def test_pauli_spinors() -> None:
    column = sympy.Matrix(complex_symbols("a b"))
    psi, e = pauli_spinor(column), VGA3.basis()
    assert (pauli_column(psi) - column).expand() == sympy.zeros(2, 1)
    for k, matrix in enumerate(pauli_matrices()):
        assert pauli_spinor(matrix * column) == e[k] * psi * e[2]
    assert pauli_spinor(sympy.I * column) == psi * e[0] * e[1]
    assert sympy.expand((psi * ~psi)["1"] - (column.H * column)[0]) == 0
    for k, matrix in enumerate(pauli_matrices()):
        assert sympy.expand((psi * e[2] * ~psi)[1 << k] - (column.H * matrix * column)[0]) == 0


def test_dirac_spinors() -> None:
    column = sympy.Matrix(complex_symbols("a b c d"))
    psi, g = dirac_spinor(column), STA.basis()
    matrices = dirac_matrices()
    assert (dirac_column(psi) - column).expand() == sympy.zeros(4, 1)
    for mu, matrix in enumerate(matrices):
        assert dirac_spinor(matrix * column) == g[mu] * psi * g[0]
        for nu, other in enumerate(matrices):
            assert matrix * other + other * matrix == 2 * int(STA.gram[mu][nu]) * sympy.eye(4)
    assert dirac_spinor(sympy.I * column) == psi * g[2] * g[1]
    fifth = -sympy.I * matrices[0] * matrices[1] * matrices[2] * matrices[3]
    assert dirac_spinor(fifth * column) == psi * g[3] * g[0]
    current = psi * g[0] * ~psi
    for mu, matrix in enumerate(matrices):
        component = left_contraction(current, multivector(STA, g[mu]))["1"]
        assert sympy.expand(component - (column.H * matrices[0] * matrix * column)[0]) == 0


def test_errors_of_spinors() -> None:
    with pytest.raises(AlgebraError, match="2 complex numbers"):
        pauli_spinor([1, 2, 3])
    with pytest.raises(AlgebraError, match="even element of VGA3"):
        pauli_column(multivector(VGA3, {"e1": 1}))
    with pytest.raises(AlgebraError, match="even element of STA"):
        dirac_column(multivector(VGA3, {"1": 1}))
