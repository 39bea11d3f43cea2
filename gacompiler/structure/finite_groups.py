"""Finite groups of versors: the binary polyhedral groups, the rotations of cubes, reflections in roots.

A finite group of rotations has twice as many rotors; they are generated as products of a few of them (Coxeter, *Regular
Polytopes*, 1973; Conway & Smith, *On Quaternions and Octonions*, 2003).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

from ..algebra.algebra import Algebra
from ..algebra.catalog import VGA3, orthogonal
from ..algebra.coefficients import Coefficient
from ..algebra.multivector import Multivector
from ..errors import AlgebraError
from .quadratic import QuadraticNumber

POLYHEDRA = ("tetrahedral", "octahedral", "icosahedral")

_HALF = Fraction(1, 2)


def generated_group(generators: Sequence[Multivector], largest: int = 10_000) -> tuple[Multivector, ...]:
    """Return all products of some invertible elements, exactly; 1 first, shorter products before longer ones.

    Parameters
    ----------
    generators : sequence of Multivector
        Of one algebra, with exact coefficients: integers, fractions or `QuadraticNumber`.
    largest : int
        Maximal number of elements.

    Raises
    ------
    AlgebraError
        For no generator, for floating-point coefficients, which cannot be compared exactly, and if there are more
        products than `largest`.
    """
    if not generators:
        raise AlgebraError("generated_group", "no generator", "at least one")
    if any(isinstance(value, (float, complex)) for x in generators for value in x.terms.values()):
        raise AlgebraError(
            "generated_group", "coefficients that are floats", "exact ones", "use Fraction or QuadraticNumber"
        )
    one = generators[0].lift(1)
    found = {_key(one): one}
    new = [one]
    while new:
        reached = {_key(y): y for x in new for g in generators for y in (x * g,)}
        new = [y for key, y in reached.items() if key not in found]
        found |= {_key(y): y for y in new}
        if len(found) > largest:
            raise AlgebraError("generated_group", f"more than {largest} products", "generators of a finite group")
    return tuple(found.values())


def _key(x: Multivector) -> frozenset[tuple[int, Coefficient]]:
    return frozenset(x.terms.items())


def polyhedral_group(name: str) -> tuple[Multivector, ...]:
    """Return the rotors of a regular polyhedron in G(3): 24 of the tetrahedron, 48 of the cube, 120 of the icosahedron.

    Parameters
    ----------
    name : {"tetrahedral", "octahedral", "icosahedral"}
        The octahedral ones are those of the cube.

    Returns
    -------
    tuple of Multivector
        Of `VGA3`, exact: with coefficients in halves, over ``sqrt(2)`` and over ``sqrt(5)``.
    """
    if name not in POLYHEDRA:
        raise AlgebraError("polyhedral_group", f"no group {name}", "one of " + " ".join(POLYHEDRA))
    e1, e2, e3 = VGA3.basis()
    third = (1 + e1 * e2 + e2 * e3 + e3 * e1) * _HALF
    if name == "octahedral":
        return cube_group(3, VGA3)
    if name == "tetrahedral":
        return generated_group((third, e1 * e2))
    golden = (1 + QuadraticNumber.root(5)) * _HALF
    fifth = ((e1 * e2) * (golden - 1) + e2 * e3 + golden) * _HALF
    return generated_group((third, fifth))


def cube_group(n: int, algebra: Algebra | None = None) -> tuple[Multivector, ...]:
    """Return the ``2**n n!`` rotors of the cube in `n` dimensions: 48 in three, 384 in four.

    They are exact, over ``sqrt(2)``.
    """
    vectors = (algebra or orthogonal(n)).basis()
    half_root = QuadraticNumber.root(2) * _HALF
    return generated_group([(1 + a * b) * half_root for a, b in pairwise(vectors)])


def reflection_group(roots: Sequence[Multivector]) -> tuple[Multivector, ...]:
    """Return the versors of all products of reflections in some unit vectors: a double cover in Pin.

    If the group is finite, it has twice the order of the Coxeter group of the simple roots.
    """
    if any(x.grades != (1,) or x * x not in (1, -1) for x in roots):
        raise AlgebraError("reflection_group", "roots that are not unit vectors", "vectors that square to +1 or -1")
    return generated_group(roots)
