"""The identities of the textbooks, held exactly over random rationals.

Each row names an identity, says where it stands, and gives both its sides for elements drawn at random. Nothing is
compared to a tolerance. Rows that divide by a blade are held in the algebras in which blades have inverses, rows that
use the inverse of the pseudoscalar in those that are not degenerate.

Sources: [HS] Hestenes & Sobczyk, *Clifford Algebra to Geometric Calculus*, 1984. [DFM] Dorst, Fontijne & Mann,
*Geometric Algebra for Computer Science*, 2007. [DL] Doran & Lasenby, *Geometric Algebra for Physicists*, 2003.
[L] Lounesto, *Clifford Algebras and Spinors*, 2nd ed. 2001.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from itertools import permutations
from typing import Any

from exact_elements import ALGEBRAS, NON_DEGENERATE, WITH_VERSORS, Draw, outer

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA3
from gacompiler.algebra.duality import dual, polarity, regressive_product, undual
from gacompiler.algebra.involutions import clifford_conjugate, grade_involution, reverse
from gacompiler.algebra.multivector import Multivector, sum_of
from gacompiler.algebra.versors import anticommutator, commutator, inverse, norm_squared, sandwich
from tests.support.all_cases import all_cases

Sides = tuple[Any, Any]
Identity = tuple[str, str, Callable[[Algebra, Draw], Sides]]


def lc(a: Multivector, b: Multivector) -> Multivector:
    return a.product("left_contraction", b)


def rc(a: Multivector, b: Multivector) -> Multivector:
    return a.product("right_contraction", b)


def dot(a: Multivector, b: Multivector) -> Any:
    return a.product("scalar_product", b).scalar


def hat(a: Multivector) -> Multivector:
    return grade_involution(a)


def meet(a: Multivector, b: Multivector) -> Multivector:
    return regressive_product(a, b)


def half(a: Multivector) -> Multivector:
    return a / 2


def sign(exponent: int) -> int:
    return -1 if exponent % 2 else 1


def determinant(rows: list[list[Any]]) -> Any:
    """By the definition: the sum over permutations."""
    total = Fraction(0)
    for chosen in permutations(range(len(rows))):
        inversions = sum(a > b for i, a in enumerate(chosen) for b in chosen[i + 1 :])
        term = Fraction(sign(inversions))
        for i, j in enumerate(chosen):
            term *= rows[i][j]
        total += term
    return total


def square_by_gram(algebra: Algebra, a: Multivector) -> Any:
    n = algebra.dimension
    return sum(a[1 << i] * a[1 << j] * algebra.gram[i][j] for i in range(n) for j in range(n))


# Everything below takes the algebra and a source of random elements, and returns two sides.


def metric_of_vectors(g: Algebra, r: Draw) -> Sides:
    a = r.vector()
    return a * a, square_by_gram(g, a)


def contraction_of_bivector(g: Algebra, r: Draw) -> Sides:
    a, b, c = r.vectors(3)
    return lc(a, b ^ c), dot(a, b) * c - dot(a, c) * b


def contraction_of_trivector(g: Algebra, r: Draw) -> Sides:
    a, b, c, d = r.vectors(4)
    return lc(a, b ^ c ^ d), dot(a, b) * (c ^ d) - dot(a, c) * (b ^ d) + dot(a, d) * (b ^ c)


def product_of_bivectors(g: Algebra, r: Draw) -> Sides:
    a, b, c, d = r.vectors(4)
    return dot(a ^ b, c ^ d), dot(b, c) * dot(a, d) - dot(a, c) * dot(b, d)


def gram_determinant(g: Algebra, r: Draw) -> Sides:
    k = r.random.randint(1, min(4, g.dimension))
    left, right = r.vectors(k), r.vectors(k)
    return (
        dot(outer(g, left), reverse(outer(g, right))),
        determinant([[dot(a, b) for b in right] for a in left]),
    )


def scalar_part_of_four(g: Algebra, r: Draw) -> Sides:
    a, b, c, d = r.vectors(4)
    return (a * b * c * d).scalar, dot(a, b) * dot(c, d) - dot(a, c) * dot(b, d) + dot(a, d) * dot(b, c)


def vector_part_of_three(g: Algebra, r: Draw) -> Sides:
    a, b, c = r.vectors(3)
    return (a * b * c).grade(1), dot(a, b) * c - dot(a, c) * b + dot(b, c) * a


def symmetric_triple(g: Algebra, r: Draw) -> Sides:
    a, b = r.vectors(2)
    return a * b * a, 2 * dot(a, b) * a - dot(a, a) * b


def lagrange(g: Algebra, r: Draw) -> Sides:
    a, b = r.vectors(2)
    return (a ^ b) * (a ^ b), dot(a, b) ** 2 - dot(a, a) * dot(b, b)


def antisymmetrised(g: Algebra, r: Draw) -> Sides:
    a, b, c = r.vectors(3)
    return a ^ b ^ c, (a * b * c - c * b * a) / 2


def two(f: Callable[..., Sides]) -> Callable[[Algebra, Draw], Sides]:
    """An identity of as many general elements as the function takes, after a vector or bivector where it asks for one.

    The names of the parameters say what is drawn: `a` to `d` vectors, `B` a bivector, `u` and `v` versors, `s` a
    number, everything else a general element.
    """
    names = f.__code__.co_varnames[: f.__code__.co_argcount]

    def drawn(g: Algebra, r: Draw) -> Sides:
        made = []
        for name in names:
            if name in "abcd":
                made.append(r.vector())
            elif name == "B":
                made.append(r.homogeneous(2))
            elif name in "uv":
                made.append(r.versor(r.random.randint(1, 4 if g.dimension <= 5 else 2)))
            elif name == "s":
                made.append(r.number())
            else:
                made.append(r.multivector())
        return f(*made)

    return drawn


def graded(f: Callable[[Algebra, Draw, Multivector, int, Multivector, int], Sides]) -> Callable[[Algebra, Draw], Sides]:
    """An identity of two homogeneous elements and their grades."""

    def drawn(g: Algebra, r: Draw) -> Sides:
        p, q = r.grade_number(), r.grade_number()
        return f(g, r, r.homogeneous(p), p, r.homogeneous(q), q)

    return drawn


def grades_of_product(g: Algebra, r: Draw, x: Multivector, p: int, y: Multivector, q: int) -> Sides:
    allowed = range(abs(p - q), min(p + q, 2 * g.dimension - p - q) + 1, 2)
    return x * y, (x * y).grade(*allowed)


def blade_square(g: Algebra, r: Draw) -> Sides:
    k = r.grade_number()
    blade = r.blade(k)
    return blade * blade, sign(k * (k - 1) // 2) * norm_squared(blade)


def blade_contains(g: Algebra, r: Draw) -> Sides:
    vectors = r.vectors(min(3, g.dimension))
    inside = sum_of(g, [r.number() * v for v in vectors])
    return inside ^ outer(g, vectors), 0


def blade_wedge_itself(g: Algebra, r: Draw) -> Sides:
    blade = r.blade(r.grade_number(1))
    return blade ^ blade, 0


def bivector_keeps_grade(g: Algebra, r: Draw) -> Sides:
    k = r.grade_number()
    moved = commutator(r.homogeneous(2), r.homogeneous(k))
    return moved, moved.grade(k)


def cramer(g: Algebra, r: Draw) -> Sides:
    vectors = r.vectors(g.dimension + 1)
    total = sum_of(
        g,
        [
            sign(k) * (outer(g, vectors[:k] + vectors[k + 1 :])[g.everything] * vector)
            for k, vector in enumerate(vectors)
        ],
    )
    return total, 0


def complement_of_basis_blade(g: Algebra, r: Draw) -> Sides:
    blade = Multivector(g, {r.random.randrange(1 << g.dimension): 1})
    return (blade ^ dual(blade), undual(blade) ^ blade), (g.pseudoscalar, g.pseudoscalar)


def complement_twice(g: Algebra, r: Draw) -> Sides:
    k = r.grade_number()
    x = r.homogeneous(k)
    return dual(dual(x)), sign(k * (g.dimension - k)) * x


def common_factor(g: Algebra, r: Draw) -> Sides:
    n = g.dimension
    c = r.random.randint(0, n)
    a = r.random.randint(0, n - c)
    one, other, shared = (r.blade(k) for k in (a, n - a - c, c))
    return meet(one ^ shared, other ^ shared), meet(one ^ other ^ shared, shared)


def pseudoscalar_commutes(g: Algebra, r: Draw) -> Sides:
    a = r.vector()
    return a * g.pseudoscalar, sign(g.dimension - 1) * (g.pseudoscalar * a)


def split_by_blade(g: Algebra, r: Draw) -> Sides:
    a, blade = r.vector(), r.invertible_blade(r.grade_number(1))
    unit = inverse(blade)
    return lc(a, blade) * unit + (a ^ blade) * unit, a


def project(x: Multivector, blade: Multivector) -> Multivector:
    return lc(lc(x, blade), inverse(blade))


def projection_twice(g: Algebra, r: Draw) -> Sides:
    x, blade = r.multivector(), r.invertible_blade(min(2, g.dimension))
    return project(project(x, blade), blade), project(x, blade)


def projection_symmetric(g: Algebra, r: Draw) -> Sides:
    a, b = r.vectors(2)
    blade = r.invertible_blade(2)
    return dot(a, project(b, blade)), dot(project(a, blade), b)


def projection_outermorphism(g: Algebra, r: Draw) -> Sides:
    a, b = r.vectors(2)
    blade = r.invertible_blade(2)
    return project(a ^ b, blade), project(a, blade) ^ project(b, blade)


def projection_inside(g: Algebra, r: Draw) -> Sides:
    a, blade = r.vector(), r.invertible_blade(2)
    return project(a, blade) ^ blade, 0


def rejection_orthogonal(g: Algebra, r: Draw) -> Sides:
    a, blade = r.vector(), r.invertible_blade(2)
    return lc((a ^ blade) * inverse(blade), blade), 0


def contraction_is_product_inside(g: Algebra, r: Draw) -> Sides:
    vectors = r.vectors(min(3, g.dimension))
    inside = outer(g, vectors[:2])
    blade = outer(g, vectors)
    return lc(inside, blade), inside * blade


def gram_schmidt(g: Algebra, r: Draw) -> Sides:
    """A blade is the geometric product of the rejections of its vectors."""
    vectors = [r.invertible_blade(1)]
    while len(vectors) < min(3, g.dimension):
        candidate = [*vectors, r.vector()]
        if norm_squared(outer(g, candidate)).scalar != 0:
            vectors = candidate
    orthogonal = g.scalar(1)
    blade = g.scalar(1)
    for vector in vectors:
        orthogonal = orthogonal * ((vector ^ blade) * inverse(blade) if blade.grades != (0,) else vector)
        blade = blade ^ vector
    return abs(dot(orthogonal, reverse(orthogonal))), abs(norm_squared(blade).scalar)


def versor_keeps_grade(g: Algebra, r: Draw) -> Sides:
    k = r.grade_number()
    moved = sandwich(r.versor(r.random.randint(1, 3)), r.homogeneous(k))
    return moved, moved.grade(k)


def reflection(g: Algebra, r: Draw) -> Sides:
    a, b = r.vectors(2)
    return sandwich(a, b), dot(a, a) * b - 2 * dot(a, b) * a


def reflected_pseudoscalar(g: Algebra, r: Draw) -> Sides:
    count = r.random.randint(1, 3)
    versor = r.versor(count)
    moved = versor * (hat(g.pseudoscalar) if count % 2 else g.pseudoscalar) * inverse(versor)
    return moved, sign(count) * g.pseudoscalar


def general_inverse(g: Algebra, r: Draw) -> Sides:
    x = r.multivector() if g.dimension <= 5 else r.vector() + r.number()
    if norm_squared(x).scalar == 0 or x.scalar == 0:
        x = x + 11
    found = inverse(x)
    return (x * found, found * x), (1, 1)


def reciprocal(g: Algebra) -> list[Multivector]:
    """``e**i = (-1)**i (e_0 ^ ... omit i ... ^ e_n) E**-1``."""
    basis = list(g.basis())
    unit = inverse(outer(g, basis))
    return [sign(k) * outer(g, basis[:k] + basis[k + 1 :]) * unit for k in range(len(basis))]


def reciprocal_frame(g: Algebra, r: Draw) -> Sides:
    table = [[dot(up, down) for down in g.basis()] for up in reciprocal(g)]
    return table, [[int(i == j) for j in range(g.dimension)] for i in range(g.dimension)]


def components_by_frame(g: Algebra, r: Draw) -> Sides:
    a = r.vector()
    return sum_of(g, [dot(a, up) * down for up, down in zip(reciprocal(g), g.basis(), strict=True)]), a


def over_frame(
    f: Callable[[Multivector, Multivector, Multivector], Multivector], factor: Callable[[int, int], int]
) -> Any:
    def sides(g: Algebra, r: Draw) -> Sides:
        k = r.grade_number()
        x = r.homogeneous(k)
        frames = zip(reciprocal(g), g.basis(), strict=True)
        return sum_of(g, [f(up, down, x) for up, down in frames]), factor(g.dimension, k) * x

    return sides


def meet_by_polarity(g: Algebra, r: Draw) -> Sides:
    """``(X v Y)* = Y* ^ X*`` with the metric dual in place of the complement."""
    k = r.random.randint(0, g.dimension)
    x, y = r.homogeneous(k), r.blade(r.random.randint(g.dimension - k, g.dimension))
    return polarity(meet(x, y)), polarity(y) ^ polarity(x)


ANY_METRIC: tuple[Identity, ...] = (
    ("product is associative", "[HS] 1-1", two(lambda x, y, z: ((x * y) * z, x * (y * z)))),
    ("product distributes from the left", "[HS] 1-1", two(lambda x, y, z: (x * (y + z), x * y + x * z))),
    ("product distributes from the right", "[HS] 1-1", two(lambda x, y, z: ((y + z) * x, y * x + z * x))),
    ("scalars commute", "[HS] 1-1", two(lambda s, x, y: (x * (s * y), s * (x * y)))),
    ("square of a vector is the quadratic form", "[HS] 1-1; [L] 14", metric_of_vectors),
    ("product of vectors is inner plus outer", "[HS] 1-1; [DL] 4.1", two(lambda a, b: (a * b, dot(a, b) + (a ^ b)))),
    ("inner product is the symmetric part", "[HS] 1-1; [DL] 4.1", two(lambda a, b: (dot(a, b), half(a * b + b * a)))),
    ("outer product is the antisymmetric part", "[HS] 1-1; [DL] 4.1", two(lambda a, b: (a ^ b, half(a * b - b * a)))),
    ("outer product is associative", "[DFM] 2", two(lambda x, y, z: ((x ^ y) ^ z, x ^ (y ^ z)))),
    ("outer product of three vectors antisymmetrises", "[DL] 4.1", antisymmetrised),
    ("outer product commutes up to sign", "[DFM] 2", graded(lambda g, r, x, p, y, q: (x ^ y, sign(p * q) * (y ^ x)))),
    ("vector times anything", "[HS] 1-1; [DFM] 6", two(lambda a, x: (a * x, lc(a, x) + (a ^ x)))),
    ("anything times vector", "[HS] 1-1; [DFM] 6", two(lambda a, x: (x * a, rc(x, a) + (x ^ a)))),
    (
        "contraction by a vector from products",
        "[DL] 4.1; [DFM] 6",
        two(lambda a, x: (lc(a, x), half(a * x - hat(x) * a))),
    ),
    (
        "outer product by a vector from products",
        "[DL] 4.1; [DFM] 6",
        two(lambda a, x: (a ^ x, half(a * x + hat(x) * a))),
    ),
    (
        "contraction is an antiderivation of ^",
        "[DFM] 3; [L] 22",
        two(lambda a, x, y: (lc(a, x ^ y), (lc(a, x) ^ y) + (hat(x) ^ lc(a, y)))),
    ),
    (
        "contraction is an antiderivation of the product",
        "[HS] 1-1",
        two(lambda a, x, y: (lc(a, x * y), lc(a, x) * y + hat(x) * lc(a, y))),
    ),
    (
        "contraction of a product through ^",
        "[HS] 1-1",
        two(lambda a, x, y: (lc(a, x * y), (a ^ x) * y - hat(x) * (a ^ y))),
    ),
    ("^ into a product, first factor", "[HS] 1-1", two(lambda a, x, y: (a ^ (x * y), (a ^ x) * y - hat(x) * lc(a, y)))),
    (
        "^ into a product, second factor",
        "[HS] 1-1",
        two(lambda a, x, y: (a ^ (x * y), lc(a, x) * y + hat(x) * (a ^ y))),
    ),
    (
        "contraction by an outer product is repeated",
        "[DFM] 3; [L] 22",
        two(lambda x, y, z: (lc(x ^ y, z), lc(x, lc(y, z)))),
    ),
    (
        "right contraction by an outer product is repeated",
        "[DFM] 3",
        two(lambda x, y, z: (rc(x, y ^ z), rc(rc(x, y), z))),
    ),
    ("contractions from both sides associate", "[DFM] 3", two(lambda x, y, z: (lc(x, rc(y, z)), rc(lc(x, y), z)))),
    ("contraction is adjoint to ^", "[DFM] 3", two(lambda x, y, z: (dot(x ^ y, z), dot(x, lc(y, z))))),
    ("contracting twice by a vector", "[L] 22", two(lambda a, x: (lc(a, lc(a, x)), 0))),
    (
        "left and right contraction of homogeneous elements",
        "[DFM] 3",
        graded(lambda g, r, x, p, y, q: (lc(x, y), sign(p * (q - 1)) * rc(y, x))),
    ),
    (
        "contractions exchange under reversion",
        "[DFM] 3",
        two(lambda x, y: (reverse(lc(x, y)), rc(reverse(y), reverse(x)))),
    ),
    ("scalar product is symmetric", "[HS] 1-1", two(lambda x, y: (dot(x, y), dot(y, x)))),
    ("scalar part is cyclic", "[HS] 1-1; [DL] 4.1", two(lambda x, y, z: ((x * y * z).scalar, (y * z * x).scalar))),
    (
        "scalar product does not see reversion of both",
        "[HS] 1-1",
        two(lambda x, y: (dot(x, y), dot(reverse(x), reverse(y)))),
    ),
    (
        "scalar product keeps equal grades only",
        "[DFM] 3",
        graded(lambda g, r, x, p, y, q: (dot(x, y), dot(x, y) if p == q else 0)),
    ),
    (
        "inner product from contractions",
        "[DFM] B",
        two(lambda x, y: (x.product("inner_product", y), lc(x, y) + rc(x, y) - dot(x, y))),
    ),
    (
        "Hestenes' inner product ignores scalars",
        "[HS] 1-1; [DFM] B",
        two(lambda x, y: (x.product("hestenes_product", y), (x - x.scalar).product("inner_product", y - y.scalar))),
    ),
    ("contraction by a scalar scales", "[DFM] 3", two(lambda s, x: (lc(x * 0 + s, x), s * x))),
    (
        "grades sum to the whole",
        "[HS] 1-1",
        two(lambda x: (sum_of(x.algebra, [x.grade(k) for k in range(x.algebra.dimension + 1)]), x)),
    ),
    ("grades of a product go in steps of two", "[HS] 1-1", graded(grades_of_product)),
    (
        "reversion turns products round",
        "[HS] 1-1; [DFM] 2",
        two(lambda x, y: (reverse(x * y), reverse(y) * reverse(x))),
    ),
    ("reversion turns outer products round", "[DFM] 2", two(lambda x, y: (reverse(x ^ y), reverse(y) ^ reverse(x)))),
    (
        "reversion of homogeneous elements",
        "[HS] 1-1",
        graded(lambda g, r, x, p, y, q: (reverse(x), sign(p * (p - 1) // 2) * x)),
    ),
    ("grade involution keeps products", "[HS] 1-1; [DFM] 2", two(lambda x, y: (hat(x * y), hat(x) * hat(y)))),
    ("grade involution keeps outer products", "[DFM] 2", two(lambda x, y: (hat(x ^ y), hat(x) ^ hat(y)))),
    (
        "Clifford conjugation turns products round",
        "[L] 14",
        two(lambda x, y: (clifford_conjugate(x * y), clifford_conjugate(y) * clifford_conjugate(x))),
    ),
    ("Clifford conjugation is both involutions", "[L] 14", two(lambda x: (clifford_conjugate(x), reverse(hat(x))))),
    (
        "involutions are their own inverses",
        "[L] 14",
        two(lambda x: ((reverse(reverse(x)), hat(hat(x)), clifford_conjugate(clifford_conjugate(x))), (x, x, x))),
    ),
    ("vector into bivector", "[HS] 1-1; [DL] 4.1", contraction_of_bivector),
    ("vector into trivector", "[HS] 1-1", contraction_of_trivector),
    ("scalar product of bivectors", "[HS] 1-1; [DL] 4.1", product_of_bivectors),
    ("scalar product of blades is a determinant", "[HS] 1-4; [DFM] 3", gram_determinant),
    ("scalar part of four vectors", "[HS] 1-1", scalar_part_of_four),
    ("vector part of three vectors", "[HS] 1-1", vector_part_of_three),
    ("aba", "[HS] 1-1", symmetric_triple),
    ("Lagrange's identity", "[HS] 1-1; [DL] 2", lagrange),
    (
        "product is commutator plus anticommutator",
        "[HS] 1-1",
        two(lambda x, y: (x * y, commutator(x, y) + anticommutator(x, y))),
    ),
    (
        "Jacobi's identity",
        "[HS] 1-1; [DL] 11.3",
        two(
            lambda x, y, z: (
                commutator(x, commutator(y, z)) + commutator(y, commutator(z, x)) + commutator(z, commutator(x, y)),
                0,
            )
        ),
    ),
    (
        "commutator is a derivation of the product",
        "[HS] 1-1",
        two(lambda x, y, z: (commutator(x, y * z), commutator(x, y) * z + y * commutator(x, z))),
    ),
    ("commutator with a bivector keeps grades", "[HS] 1-1; [DFM] 8", bivector_keeps_grade),
    ("commutator of bivector and vector", "[HS] 1-1; [DL] 4.1", two(lambda a, B: (commutator(B, a), -lc(a, B)))),
    (
        "commutator with a bivector is a derivation of ^",
        "[HS] 1-1",
        two(lambda B, x, y: (commutator(B, x ^ y), (commutator(B, x) ^ y) + (x ^ commutator(B, y)))),
    ),
    (
        "commutator with a bivector is a derivation of contraction",
        "[HS] 1-1",
        two(lambda B, x, y: (commutator(B, lc(x, y)), lc(commutator(B, x), y) + lc(x, commutator(B, y)))),
    ),
    (
        "bivector times a homogeneous element of grade 2 or more",
        "[HS] 1-1",
        lambda g, r: (lambda b, x: (b * x, lc(b, x) + commutator(b, x) + (b ^ x)))(
            r.homogeneous(2), r.homogeneous(r.random.randint(2, min(4, g.dimension)))
        ),
    ),
    ("square of a blade is a scalar", "[DFM] 6", blade_square),
    ("a vector in a blade's span", "[DFM] 2", blade_contains),
    ("a blade annihilates itself", "[DFM] 2", blade_wedge_itself),
    ("contraction inside a blade is the product", "[DFM] 6", contraction_is_product_inside),
    ("n + 1 vectors are dependent (Cramer's rule)", "[HS] 1-4; [DFM] 2", cramer),
    ("pseudoscalar and vectors", "[HS] 1-2; [DL] 4.1", pseudoscalar_commutes),
    ("complements of basis blades", "[DFM] 3 (duality without metric)", complement_of_basis_blade),
    ("complement and its inverse", "[DFM] 3", two(lambda x: ((undual(dual(x)), dual(undual(x))), (x, x)))),
    ("complement twice", "[DFM] 3", complement_twice),
    ("De Morgan: complement of the meet", "[HS] 1-2; [DFM] 5", two(lambda x, y: (dual(meet(x, y)), dual(x) ^ dual(y)))),
    (
        "De Morgan: complement of the outer product",
        "[HS] 1-2; [DFM] 5",
        two(lambda x, y: (dual(x ^ y), meet(dual(x), dual(y)))),
    ),
    ("meet is associative", "[DFM] 5", two(lambda x, y, z: (meet(meet(x, y), z), meet(x, meet(y, z))))),
    (
        "the pseudoscalar is neutral in a meet",
        "[DFM] 5",
        two(lambda x: ((meet(x.algebra.pseudoscalar, x), meet(x, x.algebra.pseudoscalar)), (x, x))),
    ),
    (
        "meet commutes up to sign",
        "[DFM] 5",
        graded(lambda g, r, x, p, y, q: (meet(x, y), sign((g.dimension - p) * (g.dimension - q)) * meet(y, x))),
    ),
    ("meet has the common factor", "[DFM] 5", common_factor),
    ("reflection in a vector", "[DFM] 7; [DL] 4.2", reflection),
    ("powers", "[HS] 1-1", two(lambda x: (x**3, x * x * x))),
)

VERSORS: tuple[Identity, ...] = (
    ("versor times its reverse is a scalar", "[HS] 3; [DFM] 7", two(lambda v: (v * reverse(v), norm_squared(v)))),
    (
        "norms of versors multiply",
        "[DFM] 7; [L] 17",
        two(lambda u, v: (norm_squared(u * v), norm_squared(u) * norm_squared(v))),
    ),
    ("sandwiches keep grades", "[DFM] 7; [DL] 4.2", versor_keeps_grade),
    ("sandwiches compose", "[DFM] 7; [DL] 4.2", two(lambda u, v, x: (sandwich(u * v, x), sandwich(u, sandwich(v, x))))),
    (
        "sandwiches keep products",
        "[DFM] 7",
        two(lambda v, x, y: (sandwich(v, x) * sandwich(v, y), norm_squared(v) * sandwich(v, x * y))),
    ),
    (
        "sandwiches are outermorphisms",
        "[HS] 3-1; [DFM] 7",
        two(lambda v, x, y: (sandwich(v, x) ^ sandwich(v, y), norm_squared(v) * sandwich(v, x ^ y))),
    ),
    (
        "sandwiches keep contractions",
        "[DFM] 7",
        two(lambda v, x, y: (lc(sandwich(v, x), sandwich(v, y)), norm_squared(v) * sandwich(v, lc(x, y)))),
    ),
    (
        "sandwiches are isometries",
        "[DFM] 7; [L] 17",
        two(lambda v, a, b: (dot(sandwich(v, a), sandwich(v, b)), norm_squared(v).scalar ** 2 * dot(a, b))),
    ),
    ("sandwiches turn the pseudoscalar by their parity", "[DFM] 7", reflected_pseudoscalar),
    (
        "inverse of a vector",
        "[HS] 1-1; [DFM] 6",
        lambda g, r: (lambda a: (inverse(a), a / dot(a, a)))(r.invertible_blade(1)),
    ),
    (
        "inverse of a versor is its reverse over its norm",
        "[DFM] 7",
        two(lambda v: (inverse(v) * norm_squared(v), reverse(v))),
    ),
    ("inverse of a product of versors", "[DFM] 7", two(lambda u, v: (inverse(u * v), inverse(v) * inverse(u)))),
    ("a vector is its projection and its rejection", "[HS] 1-2; [DFM] 6", split_by_blade),
    ("projecting twice", "[HS] 1-2; [DFM] 3", projection_twice),
    ("projection is symmetric", "[HS] 1-2", projection_symmetric),
    ("projection is an outermorphism", "[HS] 1-2; [DFM] 4", projection_outermorphism),
    ("projection lies in the blade", "[HS] 1-2; [DFM] 3", projection_inside),
    ("rejection is orthogonal to the blade", "[HS] 1-2; [DFM] 6", rejection_orthogonal),
    ("orthogonalising keeps the content", "[HS] 1-3; [DFM] 6", gram_schmidt),
)

METRIC: tuple[Identity, ...] = (
    ("polarity of an outer product", "[HS] 1-2; [DFM] 3", two(lambda x, y: (polarity(x ^ y), lc(x, polarity(y))))),
    ("polarity of a contraction", "[HS] 1-2; [DFM] 3", two(lambda x, y: (polarity(lc(x, y)), x ^ polarity(y)))),
    ("polarity and the pseudoscalar", "[HS] 1-2", two(lambda x: (polarity(x) * x.algebra.pseudoscalar, x))),
    (
        "polarity is contraction onto the inverse pseudoscalar",
        "[DFM] 3",
        two(lambda x: (polarity(x), lc(x, inverse(x.algebra.pseudoscalar)))),
    ),
    ("meet by polarity", "[HS] 1-2; [DFM] 5", meet_by_polarity),
    ("reciprocal frame", "[HS] 1-3; [DL] 4.3", reciprocal_frame),
    ("components in a frame", "[HS] 1-3; [DL] 4.3", components_by_frame),
    (
        "frame: sum of e^k ^ (e_k . A)",
        "[HS] 1-3; [DL] 4.3",
        over_frame(lambda up, down, x: up ^ lc(down, x), lambda n, k: k),
    ),
    (
        "frame: sum of e^k . (e_k ^ A)",
        "[HS] 1-3; [DL] 4.3",
        over_frame(lambda up, down, x: lc(up, down ^ x), lambda n, k: n - k),
    ),
    (
        "frame: sum of e_k A e^k",
        "[HS] 1-3; [DL] 4.3",
        over_frame(lambda up, down, x: down * x * up, lambda n, k: sign(k) * (n - 2 * k)),
    ),
    (
        "frame: sum of e_k e^k",
        "[HS] 1-3",
        lambda g, r: (sum_of(g, [d * u for u, d in zip(reciprocal(g), g.basis(), strict=True)]), g.dimension),
    ),
)


def cross(a: Multivector, b: Multivector) -> Multivector:
    return polarity(a ^ b)


def conformal_point(g: Algebra, x: Multivector) -> Multivector:
    basis = g.basis()
    return basis[-2] + x + basis[-1] * (dot(x, x) / Fraction(2))


def euclidean(g: Algebra, r: Draw) -> Multivector:
    return Multivector(g, {1 << k: r.number() for k in range(g.dimension - 2)})


def point_is_null(g: Algebra, r: Draw) -> Sides:
    p = conformal_point(g, euclidean(g, r))
    return p * p, 0


def distance(g: Algebra, r: Draw) -> Sides:
    x, y = euclidean(g, r), euclidean(g, r)
    return dot(conformal_point(g, x), conformal_point(g, y)), -dot(x - y, x - y) / Fraction(2)


def translation(g: Algebra, r: Draw) -> Sides:
    x, t = euclidean(g, r), euclidean(g, r)
    translator = 1 - t * g.basis()[-1] / 2
    return sandwich(translator, conformal_point(g, x)), conformal_point(g, x + t)


def translators_add(g: Algebra, r: Draw) -> Sides:
    s, t = euclidean(g, r), euclidean(g, r)
    einf = g.basis()[-1]
    return (1 - s * einf / 2) * (1 - t * einf / 2), 1 - (s + t) * einf / 2


def sphere_through_points(g: Algebra, r: Draw) -> Sides:
    """The outer product of n + 2 conformal points on a sphere around `c` vanishes; those of n + 1 are the sphere."""
    c, radius = euclidean(g, r), r.number()
    unit = [_rational_direction(g, r) for _ in range(g.dimension)]
    points = [conformal_point(g, c + radius * u) for u in unit]
    dual_sphere = conformal_point(g, c) - g.basis()[-1] * (radius * radius / 2)
    return [outer(g, points), *(dot(p, dual_sphere) for p in points)], [0] * (1 + len(points))


def _rational_direction(g: Algebra, r: Draw) -> Multivector:
    """A unit vector with rational components: e1 reflected in a random vector."""
    v, e1 = euclidean(g, r), g.basis()[0]
    return sandwich(v, e1) / dot(v, v)


def inversion(g: Algebra, r: Draw) -> Sides:
    x = euclidean(g, r)
    e0, einf = g.basis()[-2:]
    sphere = e0 - einf / 2
    moved = sandwich(sphere, conformal_point(g, x))
    return moved, dot(x, x) * conformal_point(g, x / dot(x, x))


def pga_point(g: Algebra, r: Draw) -> tuple[Multivector, list[Fraction]]:
    xs = [r.number() for _ in range(g.dimension - 1)]
    names = ("e20", "e01") if g.dimension == 3 else ("e032", "e013", "e021")
    unit = "e12" if g.dimension == 3 else "e123"
    return g.multivector({unit: 1, **dict(zip(names, xs, strict=True))}), xs


def pga_incidence(g: Algebra, r: Draw) -> Sides:
    """A hyperplane ``n + d e0`` meets a point ``x`` in ``n . x + d``."""
    point, xs = pga_point(g, r)
    plane = r.vector()
    expected = sum(plane[1 << k] * x for k, x in enumerate(xs)) + plane[1 << (g.dimension - 1)]
    return plane ^ point, expected * g.pseudoscalar


def pga_translation(g: Algebra, r: Draw) -> Sides:
    """The product of two reflections in parallel planes at distance t / 2 translates by t."""
    point, _ = pga_point(g, r)
    normal = g.basis()[0]
    e0 = g.basis()[-1]
    t = r.number()
    versor = (normal - t / 2 * e0) * normal
    moved = sandwich(versor, point)
    name = "e20" if g.dimension == 3 else "e032"
    return moved, point + g.multivector({name: t})


def hamilton(g: Algebra, r: Draw) -> Sides:
    i, j = g.basis()
    return [i * i, j * j, (i * j) ** 2, i * j * (i * j)], [-1, -1, -1, -1]


SPECIAL: tuple[tuple[Algebra, str, str, Callable[[Algebra, Draw], Sides]], ...] = (
    (VGA3, "cross product is antisymmetric", "[DL] 2; [L] 3", two(lambda a, b: (cross(a, b), -cross(b, a)))),
    (
        VGA3,
        "double cross product",
        "[DL] 2; [L] 3",
        two(lambda a, b, c: (cross(a, cross(b, c)), dot(a, c) * b - dot(a, b) * c)),
    ),
    (
        VGA3,
        "triple product is the volume",
        "[DL] 2; [L] 3",
        two(lambda a, b, c: (a ^ b ^ c, dot(a, cross(b, c)) * VGA3.pseudoscalar)),
    ),
    (
        VGA3,
        "cross products of cross products",
        "[DL] 2",
        two(lambda a, b, c: (cross(cross(a, b), cross(a, c)), dot(a, cross(b, c)) * a)),
    ),
    (VGA3, "Pauli's relation", "[DL] 2; [L] 4", two(lambda a, b: (a * b, dot(a, b) + VGA3.pseudoscalar * cross(a, b)))),
    (
        VGA3,
        "Hamilton's relations in the even subalgebra",
        "[L] 5; [DL] 1",
        lambda g, r: (lambda i, j, k: ([i * i, j * j, k * k, i * j * k], [-1] * 4))(
            *(-g.pseudoscalar * e for e in g.basis())
        ),
    ),
    (QUATERNIONS, "Hamilton's relations", "[L] 5", hamilton),
    (STA, "a bivector's square", "[DL] 5", lambda g, r: (lambda b: ((b * b).grade(0, 4), b * b))(r.homogeneous(2))),
    (
        STA,
        "the pseudoscalar turns bivectors by a right angle",
        "[DL] 5",
        lambda g, r: (lambda b: (g.pseudoscalar * (g.pseudoscalar * b), -b))(r.homogeneous(2)),
    ),
    (
        STA,
        "a spacetime split",
        "[DL] 5",
        lambda g, r: (lambda a, t: ((a * t) * (t * a), dot(a, a)))(r.vector(), g.basis()[0]),
    ),
    (CGA2, "conformal points are null", "[DFM] 13; [DL] 10", point_is_null),
    (CGA3, "conformal points are null", "[DFM] 13; [DL] 10", point_is_null),
    (CGA2, "inner product is distance", "[DFM] 13; [DL] 10", distance),
    (CGA3, "inner product is distance", "[DFM] 13; [DL] 10", distance),
    (CGA3, "translators translate", "[DFM] 13; [DL] 10", translation),
    (CGA3, "translators add", "[DFM] 13", translators_add),
    (CGA2, "circle through points", "[DFM] 14", sphere_through_points),
    (CGA3, "sphere through points", "[DFM] 14", sphere_through_points),
    (CGA3, "inversion in the unit sphere", "[DFM] 16; [DL] 10", inversion),
    (PGA2, "a line through a point", "[DFM] 11", pga_incidence),
    (PGA3, "a plane through a point", "[DFM] 11", pga_incidence),
    (PGA2, "reflections in parallel lines translate", "[DFM] 11", pga_translation),
    (PGA3, "reflections in parallel planes translate", "[DFM] 11", pga_translation),
)


def rows() -> Iterator[tuple[str, str, Callable[..., Sides], Iterable[Algebra]]]:
    for table, algebras in ((ANY_METRIC, ALGEBRAS), (VERSORS, WITH_VERSORS), (METRIC, NON_DEGENERATE)):
        for name, source, identity in table:
            yield name, source, identity, algebras
    small = [algebra for algebra in WITH_VERSORS if algebra.dimension <= 5]
    yield "inverse", "[HS] 1-1", general_inverse, small
    for algebra, name, source, identity in SPECIAL:
        yield name, source, identity, [algebra]


@all_cases("name, source, identity, algebras", [*rows()])
def test_identity_holds_exactly(
    name: str, source: str, identity: Callable[..., Sides], algebras: Iterable[Algebra]
) -> None:
    for algebra in algebras:
        left, right = identity(algebra, Draw(algebra, f"{algebra.name}: {name}"))
        if isinstance(left, (tuple, list)):
            assert len(left) == len(right)
        assert left == right, f"{name} ({source}) in {algebra.name}: {left} is not {right}"


def test_the_table_is_a_textbook() -> None:
    """Names are distinct, every row has a source, and the acceptance list of algebras is covered."""
    names = [name for table in (ANY_METRIC, VERSORS, METRIC) for name, _, _ in table]
    assert len(names) == len(set(names)) >= 80
    assert all(source.startswith("[") for table in (ANY_METRIC, VERSORS, METRIC) for _, source, _ in table)
    assert {algebra.dimension for algebra in ALGEBRAS} >= {3, 4, 5, 10}
