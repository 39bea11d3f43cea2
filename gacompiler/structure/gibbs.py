"""A dictionary from Gibbs' vector algebra to geometric algebra whose entries can be evaluated.

The cross product is the polar vector of a plane: ``a x b = -I (a ^ b)`` (Hestenes, *New Foundations for Classical
Mechanics*, 1999, ch. 2). Functions accept and return triples of numbers, and are exact for exact input.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import Any

from ..algebra.catalog import VGA3
from ..algebra.coefficients import divide, scalar_function
from ..algebra.duality import polarity
from ..algebra.multivector import Multivector
from ..algebra.versors import commutator, inverse, sandwich
from ..errors import AlgebraError

Triple = Sequence[Any]


@dataclass(frozen=True, slots=True)
class Entry:
    """One line of a dictionary.

    Attributes
    ----------
    name : str
    theirs : str
        The formula in the other language.
    ours : str
        The same formula in geometric algebra.
    function : callable
        The computation by geometric algebra.
    """

    name: str
    theirs: str
    ours: str
    function: Callable[..., Any]

    def __call__(self, *arguments: Any) -> Any:
        """Evaluate the entry."""
        return self.function(*arguments)


def table(dictionary: Mapping[str, Entry]) -> list[list[str]]:
    """Return a dictionary as rows of text: name, formula there, formula here."""
    return [[entry.name, entry.theirs, entry.ours] for entry in dictionary.values()]


def vector(triple: Triple) -> Multivector:
    """Convert a triple to a vector of G(3)."""
    if len(triple) != 3:
        raise AlgebraError("vector of Gibbs", f"{len(triple)} numbers", "3")
    return Multivector(VGA3, {1 << k: value for k, value in enumerate(triple)})


def triple(x: Multivector) -> tuple[Any, Any, Any]:
    """Convert a vector of G(3) to a triple."""
    return x[1], x[2], x[4]


def _dot(a: Triple, b: Triple) -> Any:
    return vector(a).product("scalar_product", vector(b)).scalar


def _cross(a: Triple, b: Triple) -> Any:
    return triple(polarity(vector(a) ^ vector(b)))


def _triple_product(a: Triple, b: Triple, c: Triple) -> Any:
    return polarity(vector(a) ^ vector(b) ^ vector(c)).scalar


def _double_cross(a: Triple, b: Triple, c: Triple) -> Any:
    return triple(-vector(a).product("left_contraction", vector(b) ^ vector(c)))


def _cross_dot_cross(a: Triple, b: Triple, c: Triple, d: Triple) -> Any:
    return -(vector(a) ^ vector(b)).product("scalar_product", vector(c) ^ vector(d)).scalar


def _cross_cross_cross(a: Triple, b: Triple, c: Triple, d: Triple) -> Any:
    return triple(VGA3.pseudoscalar * commutator(vector(a) ^ vector(b), vector(c) ^ vector(d)))


def _projection(a: Triple, n: Triple) -> Any:
    return triple(vector(a).product("left_contraction", vector(n)) * inverse(vector(n)))


def _rejection(a: Triple, n: Triple) -> Any:
    return triple((vector(a) ^ vector(n)) * inverse(vector(n)))


def _reflection(a: Triple, n: Triple) -> Any:
    return triple(-vector(n) * vector(a) * inverse(vector(n)))


def _rotation(a: Triple, n: Triple, angle: float) -> Any:
    axis = vector(n)
    axis = axis / scalar_function("sqrt", float((axis * axis).scalar))
    rotor = cos(angle / 2) - VGA3.pseudoscalar * axis * sin(angle / 2)
    return triple(sandwich(rotor, vector(a)).grade(1))


def _quaternion_product(a: Sequence[Any], b: Sequence[Any]) -> Any:
    x, y = (q[0] - VGA3.pseudoscalar * vector(q[1:]) for q in (a, b))
    product = x * y
    return product.scalar, *triple(VGA3.pseudoscalar * product.grade(2))


def _reciprocal(a: Triple, b: Triple, c: Triple) -> Any:
    volume = vector(a) ^ vector(b) ^ vector(c)
    pairs = ((b, c), (c, a), (a, b))
    return tuple(triple((vector(x) ^ vector(y)) * inverse(volume)) for x, y in pairs)


def _area(a: Triple, b: Triple, c: Triple) -> Any:
    bivector = (vector(b) - vector(a)) ^ (vector(c) - vector(a))
    return divide(scalar_function("sqrt", float((bivector * ~bivector).scalar)), 2)


def _named(entries: Iterable[Entry]) -> Mapping[str, Entry]:
    return {entry.name: entry for entry in entries}


GIBBS: Mapping[str, Entry] = _named((
    Entry("dot product", "a . b", "(a b + b a) / 2", _dot),
    Entry("cross product", "a x b", "-I (a ^ b)", _cross),
    Entry("triple product", "a . (b x c)", "-I (a ^ b ^ c)", _triple_product),
    Entry("double cross product", "a x (b x c)", "-a . (b ^ c)", _double_cross),
    Entry("product of areas", "(a x b) . (c x d)", "-(a ^ b) . (c ^ d)", _cross_dot_cross),
    Entry("line of two planes", "(a x b) x (c x d)", "I ((a ^ b) x (c ^ d)), x the commutator", _cross_cross_cross),
    Entry("projection", "(a . n) n / n**2", "(a . n) n**-1", _projection),
    Entry("rejection", "n x (a x n) / n**2", "(a ^ n) n**-1", _rejection),
    Entry("reflection", "a - 2 (a . n) n / n**2", "-n a n**-1", _reflection),
    Entry(
        "rotation", "a cos t + n x a sin t + n (n . a) (1 - cos t)", "R a ~R, R = cos(t/2) - I n sin(t/2)", _rotation
    ),
    Entry(
        "quaternion product", "(s t - a . b, s b + t a + a x b)", "(s - I a) (t - I b)", _quaternion_product
    ),
    Entry("reciprocal frame", "b x c / (a . (b x c)), ...", "(b ^ c) (a ^ b ^ c)**-1, ...", _reciprocal),
    Entry("area of a triangle", "|(b - a) x (c - a)| / 2", "|(b - a) ^ (c - a)| / 2", _area),
))  # fmt: skip
"""Gibbs' vector algebra, entry by entry."""
