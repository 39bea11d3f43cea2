"""Versors as products of vectors: the multiplicative form, for up to 30 dimensions, in any metric."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import real_array
from ..precision import ROUNDING, TINY
from .blade import LARGEST, FactoredBlade, Floats, _finite, _made, check_dimension, flat
from .duals import metric_factors
from .gram import gram_matrix, nullity
from .reflections import reflection_matrix, reflections_of


@dataclass(frozen=True, slots=True, eq=False)
class FactoredVersor:
    """Versors as ``scale`` times a geometric product of vectors: k n numbers instead of up to 2^n.

    Parameters
    ----------
    vectors : array_like, (..., k, n)
        Vectors that are neither null nor zero; `n` is at most 30.
    gram : array_like, (n,) or (n, n), optional
        Squares, or all inner products, of the basis vectors. Euclidean by default.
    scale : array_like, (...)

    Raises
    ------
    TypeError, ValueError
        If shapes are incompatible, numbers are not finite or overflow, or a vector has no inverse.

    Notes
    -----
    Products, inverses and maps are available in any metric. `reduced`, which limits products to n vectors, is computed
    from the map of vectors. It requires a metric whose null space has at most one dimension (as in PGA), and maps with
    entries up to some thousands: rotations, motors and moderate boosts.
    """

    vectors: Floats
    gram: Floats
    scale: Floats

    def __init__(self, vectors: ArrayLike, gram: ArrayLike | None = None, scale: ArrayLike = 1.0) -> None:
        rows = _finite(real_array(vectors, "vectors", (-1, -1), "vectors of a versor"), "vectors")
        n = rows.shape[-1]
        check_dimension(n, LARGEST)
        matrix = gram_matrix(gram, n)
        lengths = np.linalg.norm(rows, axis=-1)
        with np.errstate(over="ignore"):
            volume = lengths.prod(-1)
        unit = rows / np.where(lengths > 0, lengths, 1.0)[..., None]
        squares = np.abs((unit @ matrix * unit).sum(-1))
        bad = squares <= ROUNDING * max(np.abs(matrix).max(), TINY)
        if bad.any():
            at = tuple(int(i) for i in np.argwhere(bad)[0])
            raise ValueError(f"vectors: the vector at {at} is null or zero; expected vectors that have inverses")
        numbers = _finite(real_array(scale, "scale"), "scale")
        shape = np.broadcast_shapes(rows.shape[:-2], numbers.shape)
        object.__setattr__(self, "vectors", np.broadcast_to(unit, shape + rows.shape[-2:]))
        object.__setattr__(self, "gram", matrix)
        object.__setattr__(self, "scale", np.broadcast_to(_finite(numbers * volume, "scale"), shape))

    @classmethod
    def of_blade(cls, blade: FactoredBlade, gram: ArrayLike | None = None) -> FactoredVersor:
        """Return a blade as a versor, a product of vectors that are orthogonal in the metric; null blades fail."""
        vectors, _ = metric_factors(blade, gram_matrix(gram, blade.n))
        scale = blade.scale if blade.grade == 0 else 1.0
        return cls(vectors, gram, scale)

    @property
    def shape(self) -> tuple[int, ...]:
        """The leading axes."""
        return self.scale.shape

    @property
    def n(self) -> int:
        """The number of basis vectors."""
        return int(self.vectors.shape[-1])

    @property
    def n_vectors(self) -> int:
        """The number of factors."""
        return int(self.vectors.shape[-2])

    def matrix(self) -> Floats:
        """Return the orthogonal maps ``x -> v grade_involution(x) v**-1`` of vectors, ``(..., n, n)``."""
        each = reflection_matrix(self.vectors, self.gram)
        start = np.broadcast_to(np.eye(self.n), (*self.shape, self.n, self.n))
        return np.asarray(reduce(np.matmul, (each[..., i, :, :] for i in range(self.n_vectors)), start))

    def norm_squared(self) -> Floats:
        """Return ``v ~v``."""
        squares = (self.vectors @ self.gram * self.vectors).sum(-1)
        return np.asarray(self.scale**2 * squares.prod(-1))

    def reverse(self) -> FactoredVersor:
        """Return the reverse: the product in the opposite order."""
        return FactoredVersor(self.vectors[..., ::-1, :], self.gram, self.scale)

    def inverse(self) -> FactoredVersor:
        """Return the inverse ``~v / (v ~v)``."""
        return FactoredVersor(self.vectors[..., ::-1, :], self.gram, self.scale / self.norm_squared())

    def geometric_product(self, other: FactoredVersor) -> FactoredVersor:
        """Return the product with another versor. Products of more than n vectors are simplified by `reduced`.

        If `reduced` fails, because the null space of the metric has two or more dimensions or because the map of a
        strong boost has no accurate reflections, the product keeps all its vectors. It is equally accurate.

        Raises
        ------
        TypeError, ValueError
            If `other` is not a FactoredVersor of the same metric.
        """
        if not isinstance(other, FactoredVersor):
            raise TypeError(f"other: {type(other).__name__}; expected FactoredVersor")
        if self.gram.shape != other.gram.shape or np.abs(self.gram - other.gram).max() > 0:
            raise ValueError("other: a versor of another metric; expected the same algebra")
        shape = np.broadcast_shapes(self.shape, other.shape)
        parts = [np.broadcast_to(v.vectors, shape + v.vectors.shape[-2:]) for v in (self, other)]
        product = FactoredVersor(np.concatenate(parts, -2), self.gram, self.scale * other.scale)
        if product.n_vectors <= self.n:
            return product
        try:
            return product.reduced()
        except ValueError:
            return product

    def apply(self, x: FactoredBlade) -> FactoredBlade:
        """Return ``v x v**-1`` for blades (with the grade involution for odd versors), computed vector by vector."""
        if not isinstance(x, FactoredBlade) or x.n != self.n:
            raise ValueError(f"x: {type(x).__name__}; expected FactoredBlade of {self.n} vectors")
        moved = FactoredBlade.of_vectors(x.vectors @ np.swapaxes(self.matrix(), -1, -2))
        return _made(moved.vectors, moved.scale * x.scale)

    def reduced(self) -> FactoredVersor:
        """Return the same versors with as few vectors as their maps require, the same number for the whole batch.

        The vectors are computed by `reflections_of`. The magnitude of the scale follows from ``v ~v``, its sign from
        the scalar part of the product of the old vectors and the reversed new vectors, a Pfaffian of inner products.

        Raises
        ------
        ValueError
            If the null space of the metric has more than one dimension, where a versor is not determined by its map, or
            if `reflections_of` fails.
        """
        if nullity(self.gram) > 1:
            raise ValueError("reduced: two or more dimensions are orthogonal to all; expected one at most")
        maps, old = flat(self.matrix(), self.shape, 2), flat(self.vectors, self.shape, 2)
        scale = self.scale.reshape(-1)
        lists = [reflections_of(one, self.gram) for one in maps]
        count = max((len(one) for one in lists), default=0)
        unit = self._some_vector()
        vectors, scales = np.empty((len(maps), count, self.n)), np.empty(len(maps))
        for e, new in enumerate(lists):
            pad = np.broadcast_to(unit, (count - len(new), self.n))
            whole = np.concatenate([new, pad])
            scales[e] = scale[e] * _ratio(old[e], whole, self.gram)
            vectors[e] = whole
        return FactoredVersor(vectors.reshape(*self.shape, count, self.n), self.gram, scales.reshape(self.shape))

    def _some_vector(self) -> Floats:
        squares, axes = np.linalg.eigh(self.gram)
        return np.asarray(axes[:, int(np.argmax(np.abs(squares)))])


def _ratio(old: Floats, new: Floats, gram: Floats) -> float:
    """Return the ratio of two products of vectors with the same map."""
    squares = [(v @ gram * v).sum(-1) for v in (old, new)]
    size = float(np.exp((np.log(np.abs(squares[0])).sum() - np.log(np.abs(squares[1])).sum()) / 2))
    both = np.concatenate([old, new[::-1]])
    return size * float(np.sign(_pfaffian(both @ gram @ both.T)) * np.sign(np.prod(squares[1])))


def _pfaffian(products: Floats) -> float:
    """Return the sign of the scalar part of a geometric product of vectors, from the upper triangle of inner products.

    The method is elimination with pivoting, two rows at a time (Parlett & Reid 1970).
    """
    a = np.triu(products, 1)
    a = a - a.T
    sign = 1.0
    while len(a):
        if len(a) & 1:
            return 0.0
        at = int(np.argmax(np.abs(a[0])))
        if a[0, at] == 0.0:
            return 0.0
        if at != 1:
            a[[1, at]] = a[[at, 1]]
            a[:, [1, at]] = a[:, [at, 1]]
            sign = -sign
        sign *= float(np.sign(a[0, 1]))
        rest = a[2:, 2:]
        outer = np.outer(a[0, 2:], a[1, 2:]) / a[0, 1]
        a = rest + (outer.T - outer)
    return sign
