"""The mathematics of galgebra's notebooks and example programs: its results, and those of textbooks.

Every formula is written once and computed by both programs. Where the notebook states a result, this is compared too.
Signs of pseudoscalars agree because both programs multiply basis vectors in the same order.
"""

from __future__ import annotations

from typing import Any

import pytest
import sympy
from sympy import Rational, cos, cosh, exp, pi, sin, sinh, sqrt
from test_symbolic_peers import Here, Peer, There, field

from gacompiler import symbolic
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import STA, VGA2, VGA3, orthogonal
from gacompiler.calculus import Chart, LinearFunction, cartesian, linear_function
from gacompiler.symbolic import SymbolicMultivector, multivector, symbols, unknowns

pytestmark = pytest.mark.peers

R, THETA, PHI, S, T, U, V, X, Y, Z = symbols("r theta phi s t u v x y z")
ALPHA, BETA, E, B, K, OMEGA, M = symbols("alpha beta E B k omega m")
SPACE = cartesian(VGA3, "x y z")
SPACETIME = cartesian(STA, "t x y z")


def same(peer: Peer, mine: Any, theirs: Any) -> None:
    assert peer.same(mine, theirs), f"{mine}\n{theirs}"


def vectors(algebra: Algebra) -> list[SymbolicMultivector]:
    return [multivector(algebra, each) for each in algebra.basis()]


def peer_of(chart: Chart) -> Peer:
    return Peer(chart.algebra, tuple(chart.parameters))


def spinor(chart: Chart, name: str) -> SymbolicMultivector:
    terms = {b: sympy.Function(f"{name}{b}")(*chart.parameters) for b in chart.algebra.even.support}
    return SymbolicMultivector(chart.algebra, terms)


@pytest.mark.parametrize("chart", [SPACE, SPACETIME], ids=["space", "spacetime"])
def test_every_product_with_the_vector_derivative(chart: Chart) -> None:
    """products_latex, terminal_check, st4: the five products of the derivative with fields, from both sides."""
    peer = peer_of(chart)
    grad, rgrad = peer.ga.grad, peer.ga.rgrad
    for grade in range(chart.algebra.dimension + 1):
        f = field(chart, grade)
        g = peer.of(f)
        same(peer, chart.grad * f, grad * g)
        same(peer, chart.grad ^ f, grad ^ g)
        same(peer, chart.divergence(f), grad < g)
        same(peer, f * chart.rgrad, g * rgrad)
        same(peer, (chart.grad**2) * f, grad * (grad * g))


def test_maxwell() -> None:
    """Maxwell: the vector part of the derivative is div E and dE/dt - curl B, the other div B and curl E + dB/dt."""
    peer = peer_of(SPACETIME)
    g = vectors(STA)
    I = g[0] * g[1] * g[2] * g[3]  # noqa: E741
    electric, magnetic = (
        sum((sympy.Function(f"{name}{k}")(*SPACETIME.parameters) * g[k] for k in (1, 2, 3)), 0 * g[0]) for name in "EB"
    )
    F = electric * g[0] + I * magnetic * g[0]
    found = SPACETIME.grad * F
    same(peer, found, peer.ga.grad * peer.of(F))
    t, *place = SPACETIME.parameters
    e, b = ([x[1 << k] for k in (1, 2, 3)] for x in (electric, magnetic))
    assert sympy.expand(found[1] - sum(e[k].diff(place[k]) for k in range(3))) == 0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        curl = b[j].diff(place[i]) - b[i].diff(place[j])
        assert sympy.expand(found[1 << (k + 1)] - (curl - e[k].diff(t))) == 0, "J is the curl of B less dE/dt"
    assert sympy.expand(symbolic.scalar_product(found.grade(3), I * g[0])["1"] ** 2
                        - sum(b[k].diff(place[k]) for k in range(3)) ** 2) == 0  # fmt: skip


def test_dirac() -> None:
    """Dirac.py and dirac_derive: Hestenes's equation, and the commutator of a bivector with an even element."""
    peer = peer_of(SPACETIME)
    g, theirs = vectors(STA), peer.ga.mv()
    psi, A = spinor(SPACETIME, "psi"), field(SPACETIME, 1)
    I, J = g[0] * g[1] * g[2] * g[3], theirs[0] * theirs[1] * theirs[2] * theirs[3]  # noqa: E741
    mine = (SPACETIME.grad * psi) * I * (g[3] * g[0]) - E * A * psi - M * psi * g[0]
    p = peer.of(psi)
    same(peer, mine, (peer.ga.grad * p) * J * (theirs[3] * theirs[0]) - E * peer.of(A) * p - M * p * theirs[0])
    squares = symbols("g0 g1 g2 g3")
    general = Algebra("G", "a b c d", list(squares))
    other = Peer(general)
    even = SymbolicMultivector(general, {b: symbols(f"p{b}") for b in general.even.support})
    turn = unknowns("B", general, 2)
    same(other, turn * even - even * turn, other.of(turn) * other.of(even) - other.of(even) * other.of(turn))


def test_lorentz_transformation() -> None:
    """A boost of t' and x' by the rapidity alpha is the one of textbooks; repeated brackets with a bivector."""
    algebra = Algebra("ST2", "a b", [1, -1])
    a, b = vectors(algebra)
    boost = cosh(ALPHA / 2) + sinh(ALPHA / 2) * (a ^ b)
    found = (boost * (T * a + X * b) * ~boost).map(lambda x: sympy.expand(x.rewrite(exp)))
    wanted = (T * cosh(ALPHA) - X * sinh(ALPHA)) * a + (X * cosh(ALPHA) - T * sinh(ALPHA)) * b
    assert found == wanted.map(lambda x: sympy.expand(x.rewrite(exp)))
    peer = Peer(STA)
    v, turn = unknowns("a", STA, 1), unknowns("B", STA, 2)
    mine, theirs = v, peer.of(v)
    for _ in range(3):
        mine, theirs = Here.dot(mine, turn), There.dot(theirs, peer.of(turn))
        same(peer, mine, theirs)


@pytest.mark.parametrize("wave", [lambda x: exp(sympy.I * x), sin], ids=["complex", "real"])
def test_plane_waves(wave: Any) -> None:
    """linear_EM_waves: in an oblique frame, and if E, B and k are orthogonal, a wave requires B = E = +-k / omega."""
    eb, ek, bk = symbols("eb ek bk")
    gram = [[1, eb, ek, 0], [eb, 1, bk, 0], [ek, bk, 1, 0], [0, 0, 0, -1]]
    algebra = Algebra("EBKT", "e b k t", gram)
    chart = Chart(multivector(algebra, dict(zip("ebkt", (X, Y, Z, T), strict=True))), X, Y, Z, T)
    peer = Peer(algebra, (X, Y, Z, T))
    e, b, k, t = vectors(algebra)
    te, tb, tk, tt = peer.ga.mv()
    phase = symbolic.scalar_product(K * k + OMEGA * t, X * e + Y * b + Z * k + T * t)["1"]
    assert sympy.expand(phase - K * (X * ek + Y * bk + Z) + OMEGA * T) == 0
    amplitude = E * e * t + (e ^ b ^ k ^ t) * B * b * t
    same(peer, amplitude, E * te * tt + (te ^ tb ^ tk ^ tt) * B * tb * tt)
    found = chart.grad * (amplitude * wave(phase))
    same(peer, found, peer.ga.grad * (peer.of(amplitude) * wave(phase)))
    right = found.subs({eb: 0, ek: 0, bk: 0}).subs({B: E, OMEGA: -K})
    left = found.subs({eb: 0, ek: 0, bk: 0}).subs({B: E, OMEGA: K})
    assert (right == 0) != (left == 0), "one of the two directions is that of E, B and k"


def test_exponentials_of_fields() -> None:
    """new_bug_grad_exp and 4Derr: rotors of symbolic angles in G(1, 4) and over null vectors, and their derivatives."""
    algebra = orthogonal(1, 4)
    chart = cartesian(algebra, "t x y z w")
    t, w = chart.parameters[0], algebra.basis()[4]
    rotor = symbolic.exp(-E * t * multivector(algebra, w))
    assert rotor == cos(E * t) - sin(E * t) * multivector(algebra, w)
    assert (chart.grad * rotor + E * multivector(algebra, algebra.basis()[0]) * w * rotor).simplify() == 0
    null = Algebra("SK4", "a b c d", [[0, 0, 1, 0], [0, 0, 0, 1], [1, 0, 0, 0], [0, 1, 0, 0]])
    a, b, c, d = vectors(null)
    first, second = (a + c) / sqrt(2), (b + d) / sqrt(2)
    plane = first ^ second
    assert symbolic.left_contraction(first, first) == 1 and symbolic.left_contraction(first, second) == 0
    assert (symbolic.exp(-V * plane / 2) - cos(V / 2) + sin(V / 2) * plane).simplify() == 0


def test_reflections() -> None:
    """reflect_test: B a B^-1, in the plane (x = y), in x + y + z = 0 whose normal is turned round, and in axes."""
    peer = Peer(orthogonal(4))
    algebra = peer.algebra
    w, x, y, z = vectors(algebra)
    _, tx, ty, tz = peer.ga.mv()
    a, c = unknowns("a", algebra, 1), unknowns("c", algebra, 1)
    a = a - a[1] * w
    planes = [(x ^ y, tx ^ ty), (z ^ (x + y), tz ^ (tx + ty)), (x, tx), (x ^ y ^ z, tx ^ ty ^ tz)]
    for element in (a, c, w ^ x):
        for blade, theirs in planes:
            k = blade.grades[0]
            inverse = symbolic.inverse(blade)
            mirrored = [(-1) ** (j * (k + 1)) * (blade * element.grade(j) * inverse) for j in element.grades]
            same(peer, sum(mirrored, 0 * w), peer.of(element).reflect_in_blade(theirs))
    plane = (z - y) ^ (x - y)
    normal = x + y + z
    assert -plane * normal * symbolic.inverse(plane) == -normal


def test_linear_functions() -> None:
    """lin_tran_check and lt: determinant, trace, outermorphism, compositions, and a . adjoint(b) = b . f(a).

    galgebra 0.6 refuses its own adjoint with this version of sympy (a matrix of another type).
    """
    uu, uv, vv = symbols("uu uv vv")
    for algebra in (VGA3, STA, Algebra("P", "u v", [[uu, uv], [uv, vv]]), orthogonal(1, 2)):
        peer = Peer(algebra, (X, Y, Z, T)[: algebra.dimension])
        f, g = linear_function("f", algebra), linear_function("g", algebra)
        theirs = peer.ga.lt(f.matrix.as_mutable())
        n = algebra.dimension
        assert sympy.simplify(f.determinant - theirs.det()) == 0 and sympy.simplify(f.trace - theirs.tr()) == 0
        a, b = unknowns("a", algebra, 1), unknowns("b", algebra, 1)
        same(peer, f(a), theirs(peer.of(a)))
        same(peer, f(a ^ b), theirs(peer.of(a)) ^ theirs(peer.of(b)))
        assert (symbolic.scalar_product(a, f.adjoint(b)) - symbolic.scalar_product(b, f(a))).simplify() == 0
        assert ((f @ g)(a) - f(g(a))).simplify() == 0
        if n < 4:
            assert sympy.simplify((f @ g).determinant - f.determinant * g.determinant) == 0


def test_quadratic_forms_of_linear_functions() -> None:
    """diffeq_sys: the gradient of v . A(v) is (A + adjoint A)(v) plus the derivative of A, which varies with v."""
    a, b, c = SPACE.parameters
    matrix = [[X * a * c**2, a * b * c, a**3 * b], [a**2 * b * c, a * b**2 * c, 5 * a * c], [c, 4 * a * b, a**5 * b]]
    f = LinearFunction(VGA3, matrix)
    peer = peer_of(SPACE)
    v = SPACE.position
    assert v is not None
    form = symbolic.scalar_product(v, f(v))
    theirs = peer.ga.lt(sympy.Matrix(matrix).as_mutable())
    tv = peer.of(v)
    same(peer, form, tv | theirs(tv))
    same(peer, SPACE.grad * form["1"], peer.ga.grad * (tv | theirs(tv)))
    same(peer, SPACE.grad * f(v), peer.ga.grad * theirs(tv))


def test_rotors_of_two_planes_with_a_common_vector() -> None:
    """groups: S**2 - B**2 of the product of two rotors is 1, for all squares of three vectors (a . b is alpha)."""
    na, nb, nm, ca, cb, sa, sb = symbols("na nb nm ca cb sa sb")
    algebra = Algebra("ABM", "a m b", [[na, 0, ALPHA], [0, nm, 0], [ALPHA, 0, nb]])
    a, m, b = vectors(algebra)
    product = (ca + sa * a * m) * (cb + sb * m * b)
    peer = Peer(algebra)
    ta, tm, tb = peer.ga.mv()
    same(peer, product, (ca + sa * ta * tm) * (cb + sb * tm * tb))
    assert set(product.grades) <= {0, 2}
    turn = product.grade(2)
    norm = sympy.expand(product["1"] ** 2 - (turn * turn)["1"])
    for x in (1, -1):
        for y in (1, -1):
            for z in (1, -1):
                first = (cos(U), sin(U)) if x * z > 0 else (cosh(U), sinh(U))
                second = (cos(V), sin(V)) if y * z > 0 else (cosh(V), sinh(V))
                values = {na: x, nb: y, nm: z, ca: first[0], sa: first[1], cb: second[0], sb: second[1]}
                assert sympy.simplify(norm.subs(values) - 1) == 0


def test_tangents_of_the_sphere() -> None:
    """manifold and christoffel_symbols: the sphere by two maps, its operators, a circle of latitude and any curve."""
    space = Chart.of_metric([1, R**2, (R * sin(THETA)) ** 2], R, THETA, PHI)
    sphere = space.submanifold([1, U, V], U, V)
    embedded = SPACE.submanifold([sin(U) * cos(V), sin(U) * sin(V), cos(U)], U, V)
    for chart in (sphere, embedded):
        assert chart.metric == sympy.diag(1, sin(U) ** 2)
        assert sympy.simplify(chart.christoffel_first[0, 1, 1] + sin(2 * U) / 2) == 0
        assert sympy.simplify(chart.christoffel[1, 0, 1] - 1 / sympy.tan(U)) == 0
    peer = Peer(sphere.algebra, (U, V))
    f, g = field(sphere, 1), field(sphere, 0)
    same(peer, sphere.grad * f, peer.ga.grad * peer.of(f))
    same(peer, sphere.grad * g, peer.ga.grad * peer.of(g))
    a = SymbolicMultivector(sphere.algebra, {1: ALPHA, 2: BETA})
    for element in (f, *sphere.frame):
        same(peer, sphere.covariant_derivative(a, element), (peer.of(a) | peer.ga.grad) * peer.of(element))
    h, us, vs = (sympy.Function(name)(S) for name in ("h", "us", "vs"))
    circle = sphere.submanifold([pi / 8, S], S)
    assert sympy.simplify(circle.metric[0, 0] - (Rational(1, 2) - sqrt(2) / 4)) == 0
    assert sympy.simplify((circle.grad * h)[1] - (4 + 2 * sqrt(2)) * h.diff(S)) == 0
    assert circle.divergence(h * circle.frame[0]) == h.diff(S)
    curve = sphere.submanifold([us, vs], S)
    speed = us.diff(S) ** 2 + sin(us) ** 2 * vs.diff(S) ** 2
    assert sympy.simplify(curve.metric[0, 0] - speed) == 0
    assert sympy.simplify((curve.grad * h)[1] - h.diff(S) / speed) == 0
    wanted = h.diff(S) + h * speed.diff(S) / (2 * speed)
    assert sympy.simplify(curve.divergence(h * curve.frame[0])["1"] - wanted) == 0


def test_second_derivatives() -> None:
    """second_derivative: the wave equation of a potential, and the derivative of the projection of its field."""
    peer = peer_of(SPACETIME)
    potential = field(SPACETIME, 1)
    F = SPACETIME.grad * potential
    g, theirs = vectors(STA), peer.ga.mv()
    t, *place = SPACETIME.parameters
    wave = SPACETIME.grad * F
    for k in range(4):
        value = potential[1 << k]
        assert wave[1 << k] == value.diff(t, 2) - sum(value.diff(u, 2) for u in place)
    plane = g[0] ^ g[1]
    part = symbolic.left_contraction(F.grade(2), plane) * symbolic.inverse(plane)
    other = theirs[0] ^ theirs[1]
    there = (peer.of(F.grade(2)) < other) * other.inv()
    same(peer, part, there)
    same(peer, SPACETIME.grad * part, peer.ga.grad * there)


def test_inverses_of_fields() -> None:
    """st4: inverses of fields of grades 1 and 3, and of a product."""
    peer = peer_of(SPACETIME)
    for grade in (1, 3):
        f = field(SPACETIME, grade)
        same(peer, symbolic.inverse(f), peer.of(f).inv())
        assert symbolic.reduce(f * symbolic.inverse(f)) == 1
    e = vectors(VGA3)
    v = 2 * e[0] + 3 * e[1] + 4 * e[2]
    assert v**-1 == v / 29 and v**-3 == v / 841 and (2 * e[0]) ** -16 == Rational(1, 65536)


def test_stereographic_projection() -> None:
    """Smith sphere: the plane onto the sphere and back, and the reflection coefficient (z - 1) / (z + 1)."""
    r, x, s = vectors(VGA3)
    a, b = symbols("a b")
    z = a * r + b * x

    def up(p: SymbolicMultivector) -> SymbolicMultivector:
        return s + 2 * symbolic.inverse(p * p + 1) * (p - s)

    def down(p: SymbolicMultivector, n: SymbolicMultivector) -> SymbolicMultivector:
        return -(n ^ p) * symbolic.inverse(n - n * symbolic.scalar_product(n, p)["1"])

    p = up(z)
    size = a**2 + b**2
    assert symbolic.reduce(p - (2 * z + (size - 1) * s) / (size + 1)) == 0 and symbolic.reduce(p * p) == 1
    assert symbolic.reduce(down(p, s) - z) == 0
    ratio = symbolic.reduce((z - r) * symbolic.inverse(z + r))
    below = size + 2 * a + 1
    assert symbolic.reduce(ratio - ((size - 1) - 2 * b * (r ^ x)) / below) == 0
    turned = symbolic.sandwich(symbolic.exp(-pi / 4 * (r ^ s)), p)
    assert symbolic.reduce(turned - (2 * a * s + 2 * b * x + (1 - size) * r) / (size + 1)).simplify() == 0


@pytest.mark.parametrize("n", [3, 4])
def test_duals_of_flats(n: int) -> None:
    """chap11: duals of offset flats in the homogeneous model with e0 e0 = -1, and the support vector of a line."""
    algebra = Algebra("H", " ".join(f"e{k}" for k in range(n)), [-1] + [1] * (n - 1))
    e = vectors(algebra)
    everything = e[0]
    for each in e[1:]:
        everything = everything ^ each
    inverse0 = symbolic.inverse(e[0])
    space = symbolic.left_contraction(inverse0, everything)
    assert e[0] ^ space == everything and e[0] * space == everything
    p = e[0] + sum((symbols(f"p{k}") * e[k] for k in range(1, n)), 0 * e[0])
    flat = sum((symbols(f"q{k}") * e[k] for k in range(1, n)), 0 * e[0])
    for k in range(1, n):
        dual = symbolic.left_contraction(p ^ flat, symbolic.inverse(everything))
        assert dual == symbolic.left_contraction(p, symbolic.left_contraction(flat, symbolic.inverse(everything)))
        inner = symbolic.left_contraction(flat, symbolic.inverse(space))
        assert dual == symbolic.left_contraction(p, inner * inverse0)
        flat = flat ^ sum((symbols(f"{'abc'[k - 1]}{j}") * e[j] for j in range(1, n)), 0 * e[0])
    if n == 4:
        line = (e[1] + 2 * e[2] - e[3]) ^ (e[0] + e[1] - 3 * e[2])
        ahead = symbolic.left_contraction(inverse0, e[0] ^ line)
        support = ahead * symbolic.inverse(symbolic.left_contraction(inverse0, line))
        assert symbolic.norm_squared(support) == Rational(35, 6)


def test_conformal_objects() -> None:
    """Conformal points (p p n + 2 p - nbar) / 2: circle, line, sphere and plane, and the directions within them."""
    gram = [[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 1, 0, 0], [0, 0, 0, 0, 2], [0, 0, 0, 2, 0]]
    algebra = Algebra("C3", "e1 e2 e3 n m", gram)
    e1, e2, e3, n, m = vectors(algebra)

    def point(p: Any) -> Any:
        return ((p * p) * n + 2 * p - m) / 2

    a, b, c, d = point(e1), point(e2), point(-e1), point(e3)
    x = point(X * e1 + Y * e2 + Z * e3)
    circle, line = a ^ b ^ c ^ x, a ^ b ^ n ^ x
    assert circle.subs({Z: 0, X: cos(U), Y: sin(U)}).simplify() == 0 and line.subs({X: U, Y: 1 - U, Z: 0}) == 0
    sphere, plane = a ^ b ^ c ^ d ^ x, a ^ b ^ n ^ d ^ x
    assert sphere.subs({X: sin(U) * cos(V), Y: sin(U) * sin(V), Z: cos(U)}).simplify() == 0 and sphere != 0
    assert plane.subs({Z: 1 - X - Y}) == 0 and plane != 0
    distance = symbolic.scalar_product(point(X * e1), point(Y * e1))["1"]
    assert sympy.expand(distance + (X - Y) ** 2 / 2) == 0, "half of the squared distance"


SQUARES = [[1] * 3, [2] * 3, [1, -1, -1, -1], [1] * 4, [1] * 4 + [-1], [2] * 4 + [-2]]


@pytest.mark.parametrize("squares", SQUARES, ids=str)
def test_signs_of_pseudoscalars(squares: list[int]) -> None:
    """signature_test, and test_gsg_undual_etc: squares of the pseudoscalar, involutions, scalar products and norms."""
    algebra = Algebra("I", " ".join(f"e{k}" for k in range(len(squares))), squares)
    peer = Peer(algebra)
    everything = vectors(algebra)[0]
    for each in vectors(algebra)[1:]:
        everything = everything ^ each
    n = len(squares)
    assert everything * everything == (-1) ** (n * (n - 1) // 2) * sympy.prod(squares)
    a = unknowns("A", algebra) if n < 4 else unknowns("A", algebra, 0, 2)
    b = unknowns("B", algebra) if n < 4 else unknowns("B", algebra, 2, 3)
    x, y = peer.of(a), peer.of(b)
    same(peer, symbolic.grade_involution(a), x.g_invol())
    same(peer, symbolic.clifford_conjugate(a), x.ccon())
    same(peer, symbolic.scalar_product(a, b), peer.ga.mv(x.sp(y)))
    same(peer, symbolic.norm_squared(a), peer.ga.mv(x.qform()))
    same(peer, Here.dot(a, b), There.dot(x, y))
    same(peer, symbolic.commutator(a, b), x >> y)
    assert symbolic.undual(symbolic.dual(a)) == a


def test_planes_by_spinors() -> None:
    """simple_check: contractions of vectors and even elements of a plane with any inner products."""
    xx, xy, yy = symbols("xx xy yy")
    algebra = Algebra("Q", "u v", [[xx, xy], [xy, yy]])
    peer = Peer(algebra)
    v, a = unknowns("X", algebra, 1), unknowns("A", algebra, 0, 2)
    tv, ta = peer.of(v), peer.of(a)
    same(peer, Here.dot(v, a), There.dot(tv, ta))
    same(peer, symbolic.left_contraction(v, a), tv < ta)
    same(peer, symbolic.right_contraction(a, v), ta > tv)
    same(peer, symbolic.right_contraction(v, a), tv > ta)
    plane = Peer(VGA2)
    w, b = unknowns("X", VGA2, 1), unknowns("A", VGA2, 0, 2)
    same(plane, w * b - b * w, plane.of(w) * plane.of(b) - plane.of(b) * plane.of(w))
