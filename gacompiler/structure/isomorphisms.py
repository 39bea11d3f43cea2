"""Isomorphisms between geometric algebras, given by exact images of the generators.

All are given by blades of the target that anticommute and have the squares of the source's vectors (Lounesto 2001, ch.
16; Porteous 1995, ch. 15). If the target is larger, the remaining factor consists of 2 x 2 matrices or quaternions that
commute with the image: ``G(p + 1, q + 1) = G(p, q) (x) R(2)``, and so on up to the period of eight.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from ..algebra.algebra import Algebra
from ..algebra.blades import Rational
from ..algebra.catalog import orthogonal
from ..algebra.multivector import Multivector
from ..errors import AlgebraError


@dataclass(frozen=True)
class Isomorphism:
    """An injective homomorphism of algebras onto the elements that commute with `factor`.

    Attributes
    ----------
    source, target : Algebra
    images : tuple of Multivector
        Images of the source's basis vectors: plus or minus blades of the target.
    factor : tuple of Multivector
        Anticommuting elements of the target that commute with every image; empty if the image is the whole algebra or
        its even elements.
    factor_name : str
        The algebra that they generate: ``R(2)``, ``H``, ``R(16)``, or an empty string.
    """

    source: Algebra
    target: Algebra
    images: tuple[Multivector, ...]
    factor: tuple[Multivector, ...] = ()
    factor_name: str = ""

    def __call__(self, x: Multivector) -> Multivector:
        """Return the image of an element: sums map to sums and products to products."""
        if x.algebra != self.source:
            raise AlgebraError(
                f"isomorphism of {self.source.name}", f"an element of {x.algebra.name}", f"one of {self.source.name}"
            )
        terms: dict[int, object] = {}
        for blade, value in x.terms.items():
            image, sign = self._blades[blade]
            terms[image] = value if sign > 0 else -value
        return Multivector(self.target, terms)

    def inverse(self, y: Multivector) -> Multivector:
        """Return the element with a given image.

        Raises
        ------
        AlgebraError
            For an element outside the image.
        """
        terms: dict[int, object] = {}
        for blade, value in y.terms.items():
            if blade not in self._back:
                raise AlgebraError(
                    f"isomorphism of {self.source.name}",
                    f"blade {self.target.spelling(blade)[1]} of {self.target.name}",
                    "an element of the image",
                )
            source, sign = self._back[blade]
            terms[source] = value if sign > 0 else -value
        return Multivector(self.source, terms)

    @cached_property
    def _blades(self) -> Mapping[int, tuple[int, Rational]]:
        """Return the image of every blade of the source, with its sign."""
        found: dict[int, tuple[int, Rational]] = {0: (0, 1)}
        for blade in range(1, 1 << self.source.dimension):
            k = blade.bit_length() - 1
            before, sign = found[blade ^ 1 << k]
            ((vector, own),) = self.images[k].terms.items()
            ((image, product),) = self.target.blade_product(before, vector).items()
            found[blade] = image, sign * own * product
        return found

    @cached_property
    def _back(self) -> Mapping[int, tuple[int, Rational]]:
        return {image: (blade, sign) for blade, (image, sign) in self._blades.items()}


def even_isomorphism(p: int, q: int = 0, r: int = 0) -> Isomorphism:
    """Return ``G(q, p - 1, r)``, or ``G(p, q - 1, r)`` if `p` is 0, onto the even elements of ``G(p, q, r)``."""
    if p + q == 0:
        raise AlgebraError(f"even elements of G({p}, {q}, {r})", "no vector that has an inverse", "p + q > 0")
    target = orthogonal(p, q, r)
    vectors = target.basis()
    pivot = 0 if p else q - 1
    others = [x for k, x in enumerate(vectors) if k != pivot]
    negative = p - 1 if p else 0  # number of products with the pivot that square to -1: they come last
    ordered = [*others[negative : p + q - 1], *others[:negative], *others[p + q - 1 :]]
    source = orthogonal(q, p - 1, r) if p else orthogonal(p, q - 1, r)
    return _checked(Isomorphism(source, target, tuple(x * vectors[pivot] for x in ordered)))


def add_hyperbolic_plane(p: int, q: int = 0) -> Isomorphism:
    """Return ``G(p + 1, q + 1) = G(p, q) (x) R(2)``."""
    target = orthogonal(p + 1, q + 1)
    *positive, a = target.basis()[: p + 1]
    *negative, b = target.basis()[p + 1 :]
    return _beside(orthogonal(p, q), target, [*positive, *negative], a, b, "R(2)")


def add_positive_plane(p: int, q: int = 0) -> Isomorphism:
    """Return ``G(p + 2, q) = G(q, p) (x) R(2)``: the signature is exchanged."""
    target = orthogonal(p + 2, q)
    *positive, a, b = target.basis()[: p + 2]
    return _beside(orthogonal(q, p), target, [*target.basis()[p + 2 :], *positive], a, b, "R(2)")


def add_negative_plane(p: int, q: int = 0) -> Isomorphism:
    """Return ``G(p, q + 2) = G(q, p) (x) H``: the signature is exchanged."""
    target = orthogonal(p, q + 2)
    *negative, a, b = target.basis()[p:]
    return _beside(orthogonal(q, p), target, [*negative, *target.basis()[:p]], a, b, "H")


def exchange(p: int, q: int = 0) -> Isomorphism:
    """Return ``G(p, q) = G(q + 1, p - 1)`` for ``p > 0``: all vectors but one times that one."""
    if p < 1:
        raise AlgebraError(f"exchange in G({p}, {q})", "no vector with square +1", "p > 0")
    target = orthogonal(p, q)
    first, *rest = target.basis()
    images = [first, *(x * first for x in [*rest[p - 1 :], *rest[: p - 1]])]
    return _checked(Isomorphism(orthogonal(q + 1, p - 1), target, tuple(images)))


def shift_four(p: int, q: int = 0) -> Isomorphism:
    """Return ``G(p, q + 4) = G(p + 4, q)``: four vectors times their product change the signs of their squares."""
    target = orthogonal(p, q + 4)
    *negative, a, b, c, d = target.basis()[p:]
    product = a * b * c * d
    four = [x * product for x in (a, b, c, d)]
    return _checked(Isomorphism(orthogonal(p + 4, q), target, (*target.basis()[:p], *four, *negative)))


def add_eight(p: int, q: int = 0, positive: bool = True) -> Isomorphism:
    """Return ``G(p + 8, q) = G(p, q) (x) R(16) = G(p, q + 8)``: the period of eight.

    The added vectors generate the factor.
    """
    target = orthogonal(p + 8, q) if positive else orthogonal(p, q + 8)
    first, last = (p, p + 8) if positive else (p + q, p + q + 8)
    added = target.basis()[first:last]
    product = target.scalar(1)
    for x in added:
        product = product * x
    others = [*target.basis()[:first], *target.basis()[last:]]
    images = tuple(x * product for x in others)
    return _checked(Isomorphism(orthogonal(p, q), target, images, added, "R(16)"))


def _beside(
    source: Algebra, target: Algebra, others: Sequence[Multivector], a: Multivector, b: Multivector, name: str
) -> Isomorphism:
    """Return the remaining vectors times the plane of two vectors, which then commute with both."""
    return _checked(Isomorphism(source, target, tuple(x * (a * b) for x in others), (a, b), name))


def _checked(found: Isomorphism) -> Isomorphism:
    """Return the isomorphism after checking its relations: ``f_i f_j + f_j f_i = 2 g_ij``, and the factor commutes."""
    gram = found.source.gram
    for i, x in enumerate(found.images):
        for j, y in enumerate(found.images[: i + 1]):
            if x * y + y * x != 2 * gram[i][j]:
                raise AlgebraError(
                    f"isomorphism of {found.source.name}", f"images {x} and {y}", f"2 g = {2 * gram[i][j]}"
                )
        if any(x * y != y * x for y in found.factor):
            raise AlgebraError(f"isomorphism of {found.source.name}", f"image {x}", "one that commutes with the factor")
    return found
