"""Symbolic results against galgebra: products, inverses, exponentials, calculus, linear functions, curved spaces."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations, product
from typing import Any

import pytest
import sympy

from gacompiler import symbolic
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import STA, VGA2, VGA3, orthogonal
from gacompiler.calculus import Chart, LinearFunction, cartesian, derivative_by
from gacompiler.symbolic import SymbolicMultivector, multivector, symbols, unknowns

pytestmark = pytest.mark.peers

OBLIQUE = Algebra("OBLIQUE", "u v w", [[2, 1, 0], [1, 3, -1], [0, -1, -1]])
AA, AB, BB, C = symbols("aa ab bb c")
SYMBOLIC = Algebra("SYMBOLIC", "u v", [[AA, AB], [AB, BB]])
CONFORMAL = Algebra("CONFORMAL", "u v w", [[0, C, 0], [C, 0, 0], [0, 0, AA]])
ALGEBRAS = [VGA2, VGA3, STA, OBLIQUE, orthogonal(2, 1, 1), SYMBOLIC, CONFORMAL]


def plain_angles(value: Any) -> Any:
    """Write galgebra's tangents and sines of double angles by sines and cosines of the angles."""
    single = sympy.expand_trig(value) if value.has(sympy.sin, sympy.tan) else value
    return single.replace(sympy.tan, lambda x: sympy.sin(x) / sympy.cos(x))


class Peer:
    """galgebra's algebra of the same vectors."""

    def __init__(self, algebra: Algebra, coordinates: tuple[Any, ...] | None = None) -> None:
        galgebra = pytest.importorskip("galgebra.ga")
        n = algebra.dimension
        metric = [[sympy.sympify(algebra.gram[i][j]) for j in range(n)] for i in range(n)]
        names = " ".join(algebra.vectors)
        self.algebra, self.ga = algebra, galgebra.Ga(names, g=sympy.Matrix(metric).tolist(), coords=coordinates)
        self.blades = {
            sum(1 << k for k in index): self.ga.mv(blade)
            for index, blade in zip(self.ga.indexes.flat, self.ga.blades.flat, strict=True)
        }

    def of(self, x: SymbolicMultivector) -> Any:
        return sum((value * self.blades[blade] for blade, value in x.expressions.items()), self.ga.mv(sympy.Integer(0)))

    def back(self, theirs: Any) -> SymbolicMultivector:
        if not hasattr(theirs, "blade_coefs"):
            return SymbolicMultivector(self.algebra, {0: theirs})
        values = theirs.blade_coefs(list(self.blades.values()))
        return SymbolicMultivector(self.algebra, dict(zip(self.blades, map(plain_angles, values), strict=True)))

    def same(self, mine: Any, theirs: Any) -> bool:
        difference = symbolic.reduce(self.back(theirs) - mine)
        return not difference.terms or not difference.simplify().terms


@pytest.fixture(scope="module", params=ALGEBRAS, ids=lambda algebra: algebra.name)
def peer(request: pytest.FixtureRequest) -> Peer:
    return Peer(request.param)


def elements(algebra: Algebra) -> tuple[SymbolicMultivector, SymbolicMultivector]:
    a, b = unknowns("a", algebra), unknowns("b", algebra)
    return (a, b) if algebra.dimension < 4 else (a.grade(0, 2), b.grade(1, 3))


class TestProducts:
    def test_geometric_and_outer(self, peer: Peer) -> None:
        a, b = elements(peer.algebra)
        assert peer.same(a * b, peer.of(a) * peer.of(b))
        assert peer.same(b * a, peer.of(b) * peer.of(a))
        assert peer.same(a ^ b, peer.of(a) ^ peer.of(b))

    def test_contractions(self, peer: Peer) -> None:
        a, b = elements(peer.algebra)
        assert peer.same(symbolic.left_contraction(a, b), peer.of(a) < peer.of(b))
        assert peer.same(symbolic.right_contraction(a, b), peer.of(a) > peer.of(b))
        assert peer.same(symbolic.hestenes_product(a, b), peer.of(a) | peer.of(b))

    def test_brackets(self, peer: Peer) -> None:
        a, b = elements(peer.algebra)
        assert peer.same(symbolic.commutator(a, b), peer.of(a) >> peer.of(b))
        assert peer.same(symbolic.anticommutator(a, b), peer.of(a) << peer.of(b))

    def test_involutions_and_grades(self, peer: Peer) -> None:
        a = unknowns("a", peer.algebra)
        assert peer.same(~a, peer.of(a).rev())
        assert peer.same(symbolic.grade_involution(a), peer.of(a).even() - peer.of(a).odd())
        for k in range(peer.algebra.dimension + 1):
            assert peer.same(a.grade(k), peer.of(a).grade(k))

    def test_sandwich(self, peer: Peer) -> None:
        rotor, x = unknowns("r", peer.algebra, 0, 2), unknowns("x", peer.algebra, 1)
        assert peer.same(rotor * x * ~rotor, peer.of(rotor) * peer.of(x) * peer.of(rotor).rev())

    def test_inverse_of_a_vector_and_norms(self, peer: Peer) -> None:
        x = unknowns("x", peer.algebra, 1)
        assert peer.same(symbolic.inverse(x), peer.of(x).inv())
        assert peer.same(symbolic.norm_squared(x), (peer.of(x) * peer.of(x).rev()).scalar())


class Here:
    """The operations of a formula in this package."""

    dot = staticmethod(symbolic.hestenes_product)
    left = staticmethod(symbolic.left_contraction)
    right = staticmethod(symbolic.right_contraction)
    bracket = staticmethod(symbolic.commutator)
    inverse = staticmethod(symbolic.inverse)

    @staticmethod
    def reverse(a: Any) -> Any:
        return ~a

    @staticmethod
    def scalar(a: Any) -> Any:
        return a.grade(0)


class There:
    """The same operations in galgebra."""

    @staticmethod
    def dot(a: Any, b: Any) -> Any:
        return a | b

    @staticmethod
    def left(a: Any, b: Any) -> Any:
        return a < b

    @staticmethod
    def right(a: Any, b: Any) -> Any:
        return a > b

    @staticmethod
    def bracket(a: Any, b: Any) -> Any:
        return a.Ga.com(a, b)

    @staticmethod
    def inverse(a: Any) -> Any:
        return a.inv()

    @staticmethod
    def reverse(a: Any) -> Any:
        return a.rev()

    @staticmethod
    def scalar(a: Any) -> Any:
        return a.scalar()


def gram(names: str, known: dict[str, Any]) -> Algebra:
    """An algebra whose inner products are symbols, such as ``a.b``, except for the known ones."""
    vectors = names.split()
    rows = [
        [known.get(f"{min(x, y)}.{max(x, y)}", sympy.Symbol(f"{min(x, y)}.{max(x, y)}", real=True)) for y in vectors]
        for x in vectors
    ]
    return Algebra(f"gram of {names}", names, rows)


def conformal(o: Any, x: Any, n: Any, m: Any) -> Any:
    """Twice a point of the conformal space with the null vectors `n` and `m`, as galgebra normalises it."""
    return (x * x) * n + 2 * x - m


def circle(o: Any, *vectors: Any) -> Any:
    *points, n, m = vectors
    p, q, r = (conformal(o, each, n, m) for each in points)
    return p ^ q ^ r


def distance(o: Any, x: Any, y: Any, e: Any) -> Any:
    """The bivector of the line through two null points of hyperbolic space."""
    return o.dot(x ^ y ^ e, e)


def turned(o: Any, x: Any, y: Any, e: Any) -> Any:
    rotor = C + AB * distance(o, x, y, e)
    return rotor * x * o.reverse(rotor)


FIVE = gram("a b c d e", {})
NULL = gram("P Q e", {"P.P": 0, "Q.Q": 0, "e.e": 1})
POINTS = gram("p q r n m", {
    **{f"{x}.{y}": 0 for x in "mn" for y in "pqr"}, "n.n": 0, "m.m": 0, "m.n": 2,
})  # fmt: skip
PAIR = gram("P Q a", {"P.P": 0, "Q.Q": 0, "P.Q": -1})
UNIT = gram("u v w", {"u.u": 1, "v.v": 1, "w.w": 1})
TWO = gram("x y", {})

Formula = tuple[str, Algebra, Callable[..., Any]]
FORMULAS: list[Formula] = [
    ("a . (b c)", FIVE, lambda o, a, b, c, d, e: o.dot(a, b * c)),
    ("a . (b ^ c)", FIVE, lambda o, a, b, c, d, e: o.dot(a, b ^ c)),
    ("a . (b ^ c ^ d)", FIVE, lambda o, a, b, c, d, e: o.dot(a, b ^ c ^ d)),
    ("Jacobi", FIVE, lambda o, a, b, c, d, e: o.dot(a, b ^ c) + o.dot(c, a ^ b) + o.dot(b, c ^ a)),
    ("three terms", FIVE, lambda o, a, b, c, d, e: a * (b ^ c) - b * (a ^ c) + c * (a ^ b)),
    ("four terms", FIVE, lambda o, a, b, c, d, e: (
        a * (b ^ c ^ d) - b * (a ^ c ^ d) + c * (a ^ b ^ d) - d * (a ^ b ^ c))),
    ("(a ^ b) . (c ^ d)", FIVE, lambda o, a, b, c, d, e: o.dot(a ^ b, c ^ d)),
    ("((a ^ b) . c) . d", FIVE, lambda o, a, b, c, d, e: o.dot(o.dot(a ^ b, c), d)),
    ("(a ^ b) x (c ^ d)", FIVE, lambda o, a, b, c, d, e: o.bracket(a ^ b, c ^ d)),
    ("(a . (b ^ c)) . (d ^ e)", FIVE, lambda o, a, b, c, d, e: o.dot(o.dot(a, b ^ c), d ^ e)),
    ("of a bivector and a trivector", FIVE, lambda o, a, b, c, d, e: o.left(a ^ b, c ^ d ^ e)),
    ("of a trivector and a bivector", FIVE, lambda o, a, b, c, d, e: o.right(a ^ b ^ c, d ^ e)),
    ("square of a null pair", NULL, lambda o, x, y, e: (x ^ y) * (x ^ y)),
    ("square of a line", NULL, lambda o, x, y, e: (x ^ y ^ e) * (x ^ y ^ e)),
    ("line of two points", NULL, distance),
    ("square of the line", NULL, lambda o, x, y, e: distance(o, x, y, e) * distance(o, x, y, e)),
    ("reflected unit", NULL, lambda o, x, y, e: distance(o, x, y, e) * e * o.reverse(distance(o, x, y, e))),
    ("translated point", NULL, turned),
    ("distance", NULL, lambda o, x, y, e: o.dot(turned(o, x, y, e), y)),
    ("direction of a line", POINTS, lambda o, p, q, r, n, m: (
        o.dot(o.dot(conformal(o, p, n, m) ^ conformal(o, q, n, m) ^ n, n), m))),
    ("plane of a circle", POINTS, lambda o, *v: o.dot(o.dot(circle(o, *v) ^ v[3], v[3]), v[4])),
    ("square of a pair", PAIR, lambda o, p, q, a: (p ^ q) * (p ^ q)),
    ("projection on a pair", PAIR, lambda o, p, q, a: a - (a ^ p ^ q) * (p ^ q)),
    ("points of a pair", PAIR, lambda o, p, q, a: o.dot(a, p ^ q) * (1 + (p ^ q))),
    ("square of the volume", UNIT, lambda o, u, v, w: (u ^ v ^ w) * (u ^ v ^ w)),
    *((f"reciprocal {k}", UNIT, lambda o, *v, k=k: (v[(k + 1) % 3] ^ v[(k + 2) % 3]) * (v[0] ^ v[1] ^ v[2]))
      for k in range(3)),
    ("inverse of the volume", UNIT, lambda o, u, v, w: o.inverse(u ^ v ^ w)),
    ("inverse of a product", UNIT, lambda o, u, v, w: o.inverse(u * v)),
    ("product of three", UNIT, lambda o, u, v, w: u * v * w),
    ("vector and spinor", TWO, lambda o, x, y: o.dot(AA * x + BB * y, C + AB * (x ^ y))),
    ("vector on spinor", TWO, lambda o, x, y: o.left(AA * x + BB * y, C + AB * (x ^ y))),
    ("spinor on vector", TWO, lambda o, x, y: o.right(C + AB * (x ^ y), AA * x + BB * y)),
]  # fmt: skip
"""Formulas of galgebra's tests over metrics with symbols, in its and our words; all results agree."""


@pytest.mark.parametrize("algebra", [FIVE, NULL, POINTS, PAIR, UNIT, TWO], ids=lambda algebra: algebra.name)
def test_formulas_over_symbolic_metrics(algebra: Algebra) -> None:
    """One formula is evaluated with the operations of both packages, beginning with the vectors of both."""
    peer = Peer(algebra)
    mine = [multivector(algebra, each) for each in algebra.basis()]
    theirs = list(map(peer.of, mine))
    formulas = [(name, formula) for name, where, formula in FORMULAS if where is algebra]
    assert formulas
    wrong = [name for name, formula in formulas if not peer.same(formula(Here, *mine), formula(There, *theirs))]
    assert not wrong


@pytest.mark.parametrize("algebra", [UNIT, gram("x y z", {}), gram("s t", {"s.s": 0})], ids=lambda each: each.name)
def test_reciprocal_frames_and_blades(algebra: Algebra) -> None:
    """The reciprocal blades of galgebra have the scalar products 1 and 0 with our blades."""
    peer, blades = Peer(algebra), algebra.blades()
    mine = {blade: SymbolicMultivector(algebra, {blade: sympy.Integer(1)}) for blade in blades}
    for (blade, there), (other, element) in product(zip(blades, peer.ga.blades.flat, strict=True), mine.items()):
        found = peer.back(peer.ga.mv(peer.ga._reciprocal_blade_dict[there]))
        value = (element * found).scalar
        assert sympy.simplify(value - int(blade == other)) == 0


def test_duals_in_space() -> None:
    peer = Peer(VGA3)
    a = unknowns("a", VGA3)
    assert peer.same(symbolic.polarity(a), peer.of(a) * peer.ga.I().inv())


@pytest.mark.parametrize(("algebra", "blade"), [(VGA3, "e12"), (VGA3, "e1"), (STA, "g10"), (STA, "g12")])
def test_exponentials(algebra: Algebra, blade: str) -> None:
    peer, t = Peer(algebra), symbols("t", positive=True)
    generator = multivector(algebra, {blade: t})
    assert peer.same(symbolic.exp(generator), peer.of(generator).exp())


CHARTS = {
    "cartesian": (VGA3, "x y z"),
    "spacetime": (STA, "t x y z"),
    "plane": (VGA2, "x y"),
}


@pytest.mark.parametrize("name", list(CHARTS))
class TestCalculus:
    def setup(self, name: str) -> tuple[Chart, Peer, SymbolicMultivector]:
        algebra, names = CHARTS[name]
        chart = cartesian(algebra, names)
        peer = Peer(algebra, chart.parameters)
        field = multivector(
            algebra,
            {
                algebra.spelling(blade)[1]: sympy.Function(f"F{blade}")(*chart.parameters)
                for blade in algebra.blades(0, 1, 2)
            },
        )
        return chart, peer, field

    def test_vector_derivative(self, name: str) -> None:
        chart, peer, field = self.setup(name)
        assert peer.same(chart.derivative(field), peer.ga.grad * peer.of(field))
        assert peer.same(chart.derivative(field, right=True), peer.of(field) * peer.ga.rgrad)

    def test_curl_and_divergence(self, name: str) -> None:
        chart, peer, field = self.setup(name)
        assert peer.same(chart.curl(field), peer.ga.grad ^ peer.of(field))
        assert peer.same(chart.divergence(field), peer.ga.grad < peer.of(field))

    def test_laplacian(self, name: str) -> None:
        chart, peer, field = self.setup(name)
        assert peer.same(chart.laplacian(field), peer.ga.grad * (peer.ga.grad * peer.of(field)))

    def test_directional_derivative(self, name: str) -> None:
        chart, peer, field = self.setup(name)
        a = unknowns("a", chart.algebra, 1)
        assert peer.same(chart.directional_derivative(a, field), (peer.of(a) | peer.ga.grad) * peer.of(field))


def test_spherical_coordinates() -> None:
    """galgebra keeps fields in the moving unit frame; ours in the fixed one."""
    from galgebra.ga import Ga

    from gacompiler.calculus import spherical

    chart = spherical()
    r, theta, phi = chart.parameters
    x = [r * sympy.sin(theta) * sympy.cos(phi), r * sympy.sin(theta) * sympy.sin(phi), r * sympy.cos(theta)]
    ga = Ga("r theta phi", g=[1, r**2, r**2 * sympy.sin(theta) ** 2], coords=chart.parameters, norm=True)
    assert [sympy.simplify(chart.position[e] - c) for e, c in zip(("e1", "e2", "e3"), x, strict=True)] == [0, 0, 0]
    f = sympy.Function("f")(r, theta, phi)
    components = [sympy.Function(n)(r, theta, phi) for n in "ABC"]
    frame = ga.mv()
    vector = sum(c * e for c, e in zip(components, frame, strict=True))
    gradient = (ga.grad * ga.mv(f)).blade_coefs(list(frame))
    mine = chart.components(chart.derivative(f))
    assert all(sympy.simplify(a - b) == 0 for a, b in zip(mine, gradient, strict=True))
    divergence = (ga.grad | vector).scalar()
    assert sympy.simplify(chart.divergence(chart.vector(*components))["1"] - divergence) == 0
    laplacian = (ga.grad * (ga.grad * ga.mv(f))).scalar()
    assert sympy.simplify(chart.laplacian(f)["1"] - laplacian) == 0


@pytest.mark.parametrize("algebra", [VGA2, VGA3, OBLIQUE], ids=lambda algebra: algebra.name)
def test_linear_functions(algebra: Algebra) -> None:
    n = algebra.dimension
    peer = Peer(algebra)
    matrix = sympy.Matrix(n, n, lambda i, j: sympy.Symbol(f"f_{i}{j}", real=True))
    mine, theirs = LinearFunction(algebra, matrix), peer.ga.lt(matrix)
    a = unknowns("a", algebra, 1)
    assert peer.same(mine(a), theirs(peer.of(a)))
    blade = unknowns("B", algebra, 2)
    assert peer.same(mine(blade), theirs(peer.of(blade)))
    assert sympy.expand(mine.determinant - theirs.det()) == 0
    assert peer.same((mine @ mine)(blade), (theirs * theirs)(peer.of(blade)))


@pytest.mark.parametrize("algebra", [VGA2, VGA3, STA], ids=lambda algebra: algebra.name)
def test_derivatives_by_a_vector(algebra: Algebra) -> None:
    x, a = unknowns("x", algebra, 1), unknowns("a", algebra)
    peer = Peer(algebra, tuple(x[name] for name in algebra.vectors))
    for function in (x * x, x * a, a * x, x * a * x):
        assert peer.same(derivative_by(x, function), peer.ga.grad * peer.of(function))


R, THETA, PHI, X, Y = symbols("r theta phi x y")
CURVED = {
    "polar": ([[1, 0], [0, R**2]], (R, PHI)),
    "sphere": ([[1, 0], [0, sympy.sin(THETA) ** 2]], (THETA, PHI)),
    "oblique": ([[1 + Y**2, X * Y], [X * Y, 1 + X**2]], (X, Y)),
    "spherical": ([[1, 0, 0], [0, R**2, 0], [0, 0, (R * sympy.sin(THETA)) ** 2]], (R, THETA, PHI)),
}


@pytest.fixture(scope="module", params=list(CURVED))
def curved(request: pytest.FixtureRequest) -> tuple[Chart, Peer]:
    metric, coordinates = CURVED[request.param]
    chart = Chart.of_metric(metric, *coordinates)
    return chart, Peer(chart.algebra, coordinates)


def field(chart: Chart, *grades: int) -> SymbolicMultivector:
    terms = {b: sympy.Function(f"F{b}")(*chart.parameters) for b in chart.algebra.blades(*grades)}
    return SymbolicMultivector(chart.algebra, terms)


U, Z, T, G, M = symbols("u z t G M")
SPACETIMES = {
    "Kerr and Debney": (
        [[0, 0, -sympy.exp(-Z), 0], [0, U**2 * sympy.exp(4 * Z) / 2, 0, 0],
         [-sympy.exp(-Z), 0, 12 * sympy.exp(-2 * Z), U * sympy.exp(-Z)], [0, 0, U * sympy.exp(-Z), U**2 / 2]],
        (U, X, Y, Z),
    ),
    "Schwarzschild": (
        [1 - 2 * G * M / (C**2 * R), -1 / (1 - 2 * G * M / (C**2 * R)), -(R**2), -(R**2) * sympy.sin(THETA) ** 2],
        (T, R, THETA, PHI),
    ),
}  # fmt: skip
"""The metrics of galgebra's notebook on general relativity."""


@pytest.mark.parametrize("name", SPACETIMES)
def test_connections_of_spacetimes(name: str) -> None:
    """Both vacuum metrics have the connection of galgebra and no Ricci tensor; the square of the volume agrees."""
    metric, coordinates = SPACETIMES[name]
    chart = Chart.of_metric(metric, *coordinates)
    peer = Peer(chart.algebra, coordinates)
    assert sympy.simplify(chart.metric.det() - peer.ga.e_sq) == 0
    first, second = (peer.ga.Christoffel_symbols(mode=mode) for mode in (1, 2))
    for i, j, k in product(range(4), repeat=3):
        assert sympy.simplify(chart.christoffel_first[k, i, j] - first[i][j][k]) == 0
        assert sympy.simplify(chart.christoffel[k, i, j] - second[i][j][k]) == 0
    assert chart.ricci == sympy.zeros(4, 4)


V, XI, ETA = symbols("v xi eta", positive=True)
CURVILINEAR = {
    "spherical": (
        [R * sympy.sin(THETA) * sympy.cos(PHI), R * sympy.sin(THETA) * sympy.sin(PHI), R * sympy.cos(THETA)],
        (R, THETA, PHI), [1, R, R * sympy.sin(THETA)],
    ),
    "paraboloidal": (
        [U * V * sympy.cos(PHI), U * V * sympy.sin(PHI), (U**2 - V**2) / 2],
        (U, V, PHI), [sympy.sqrt(U**2 + V**2), sympy.sqrt(U**2 + V**2), U * V],
    ),
    "elliptic": (
        [AA * sympy.cosh(U) * sympy.cos(V), AA * sympy.sinh(U) * sympy.sin(V), Z],
        (U, V, Z), [AA * sympy.sqrt(sympy.sinh(U) ** 2 + sympy.sin(V) ** 2)] * 2 + [1],
    ),
    "prolate": (
        [AA * sympy.sinh(XI) * sympy.sin(ETA) * sympy.cos(PHI), AA * sympy.sinh(XI) * sympy.sin(ETA) * sympy.sin(PHI),
         AA * sympy.cosh(XI) * sympy.cos(ETA)],
        (XI, ETA, PHI),
        [AA * sympy.sqrt(sympy.sinh(XI) ** 2 + sympy.sin(ETA) ** 2)] * 2 + [AA * sympy.sinh(XI) * sympy.sin(ETA)],
    ),
    "bipolar": (
        [AA * sympy.sinh(V) / (sympy.cosh(V) - sympy.cos(U)), AA * sympy.sin(U) / (sympy.cosh(V) - sympy.cos(U)), Z],
        (U, V, Z), [AA / (sympy.cosh(V) - sympy.cos(U))] * 2 + [1],
    ),
    "toroidal": (
        [AA * sympy.sinh(V) * sympy.cos(PHI) / (sympy.cosh(V) - sympy.cos(U)),
         AA * sympy.sinh(V) * sympy.sin(PHI) / (sympy.cosh(V) - sympy.cos(U)),
         AA * sympy.sin(U) / (sympy.cosh(V) - sympy.cos(U))],
        (U, V, PHI), [AA / (sympy.cosh(V) - sympy.cos(U))] * 2 + [AA * sympy.sinh(V) / (sympy.cosh(V) - sympy.cos(U))],
    ),
}  # fmt: skip
"""The orthogonal coordinates of galgebra's notebook: positions, parameters, and lengths of the frame's vectors."""


@pytest.mark.parametrize("name", CURVILINEAR)
def test_orthogonal_coordinates(name: str) -> None:
    """Gradient, divergence and curl are those of the textbook formulas for orthogonal coordinates, at a point."""
    position, parameters, h = CURVILINEAR[name]
    chart = Chart(multivector(VGA3, dict(zip(("e1", "e2", "e3"), position, strict=True))), *parameters)
    point = {each: sympy.Rational(3 + k, 5) for k, each in enumerate(parameters)} | {AA: 2}

    def near_zero(value: Any) -> bool:
        return bool(abs(sympy.N(sympy.sympify(value).subs(point), 30)) < 1e-20)

    x, y, z = parameters
    f, A = x**2 * y + sympy.sin(z), [x * y, y * z + x, z**2 * x]
    gradient = chart.components(chart.derivative(f))
    assert all(near_zero(g - f.diff(u) / s) for g, u, s in zip(gradient, parameters, h, strict=True))
    volume = sympy.prod(h)
    divergence = sum(((A[k] * volume / h[k]).diff(parameters[k]) for k in range(3)), sympy.Integer(0)) / volume
    vector = chart.vector(*A)
    assert near_zero(chart.divergence(vector)["1"] - divergence)
    frame = [multivector(VGA3, e) for e in chart.unit_frame]
    curl = chart.curl(vector)
    for i, j in combinations(range(3), 2):
        wanted = ((A[j] * h[j]).diff(parameters[i]) - (A[i] * h[i]).diff(parameters[j])) / (h[i] * h[j])
        assert near_zero(symbolic.scalar_product(frame[j] ^ frame[i], curl)["1"] - wanted)


class TestCurvedSpaces:
    def test_christoffel_symbols(self, curved: tuple[Chart, Peer]) -> None:
        chart, peer = curved
        n = len(chart.parameters)
        first, second = (peer.ga.Christoffel_symbols(mode=mode) for mode in (1, 2))
        for i, j, k in product(range(n), repeat=3):
            assert sympy.simplify(chart.christoffel_first[k, i, j] - first[i][j][k]) == 0
            assert sympy.simplify(chart.christoffel[k, i, j] - second[i][j][k]) == 0

    def test_derivatives_of_fields(self, curved: tuple[Chart, Peer]) -> None:
        chart, peer = curved
        whole = field(chart) if len(chart.parameters) == 2 else field(chart, 1)
        there = peer.of(whole)
        assert peer.same(chart.grad * whole, peer.ga.grad * there)
        assert peer.same(chart.grad ^ whole, peer.ga.grad ^ there)
        assert peer.same(chart.divergence(whole), peer.ga.grad < there)
        assert peer.same(whole * chart.rgrad, there * peer.ga.rgrad)

    def test_laplacians_and_directional_derivatives(self, curved: tuple[Chart, Peer]) -> None:
        chart, peer = curved
        scalar, vector = field(chart, 0), field(chart, 1)
        assert peer.same((chart.grad**2) * scalar, peer.ga.grad * (peer.ga.grad * peer.of(scalar)))
        direction = vector | chart.grad
        assert peer.same(direction * scalar, (peer.of(vector) | peer.ga.grad) * peer.of(scalar))

    def test_submanifolds(self) -> None:
        from galgebra.ga import Ga

        a, b = symbols("a b")
        space = Ga("e", g=[1, R**2, R**2 * sympy.sin(THETA) ** 2], coords=(R, THETA, PHI))
        there = space.sm([C, a, b], (a, b))
        chart = Chart.of_metric([1, R**2, R**2 * sympy.sin(THETA) ** 2], R, THETA, PHI)
        here = chart.submanifold([C, a, b], a, b)
        assert (here.metric - sympy.Matrix(there.g)).applyfunc(sympy.simplify) == sympy.zeros(2, 2)


@pytest.mark.parametrize("name", ["cartesian", "plane"])
def test_products_of_operators(name: str) -> None:
    algebra, names = CHARTS[name]
    chart = cartesian(algebra, names)
    peer = Peer(algebra, chart.parameters)
    vector, whole = field(chart, 1), field(chart)
    there = peer.of(vector)
    pairs = [
        (chart.grad * chart.grad, peer.ga.grad * peer.ga.grad),
        (vector * chart.grad, there * peer.ga.grad),
        (vector ^ chart.grad, there ^ peer.ga.grad),
        (chart.grad * chart.grad - chart.grad / 2, peer.ga.grad * peer.ga.grad - peer.ga.grad / 2),
    ]
    for mine, theirs in pairs:
        assert peer.same(mine * whole, theirs * peer.of(whole))
