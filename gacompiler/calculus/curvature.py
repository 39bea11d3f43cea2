"""Connection and curvature of coordinates, from their metric.

The symbols follow Misner, Thorne & Wheeler 1973, §8.6 and §14.1: ``D_i e_j = Gamma^k_ij e_k``, and ``R^h_kij`` is the
component along ``e_h`` of ``(D_i D_j - D_j D_i) e_k``. Spheres have positive curvature. All sums are computed on
expanded expressions with common denominators. Each result is reduced modulo ``sin**2 + cos**2 = 1`` once, without the
searches of `sympy.simplify`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from itertools import combinations
from random import Random
from typing import Any

import sympy

from ..algebra.layout import SCALARS
from ..rings.symbolic import Expanded
from ..symbolic import reduce
from ..symbolic.functions import signless
from ..symbolic.multivector import SymbolicMultivector

Ring = Expanded
_ZERO = Expanded({})
_HALF = sympy.Rational(1, 2)


def tidy(value: Any) -> Expanded:
    """Return a scalar in normal form, as an element of the ring of expanded expressions."""
    found = reduce(SymbolicMultivector(SCALARS, {0: value}))
    return Expanded.of(found.terms.get(0, 0))


@lru_cache(maxsize=512)
def short(value: Any) -> Any:
    """Return a scalar in normal form, as the shortest of a few equal expressions.

    These are the normal form, and its factors with even powers of either sines or cosines replaced. Only sums of up to
    `FEW` terms are factored, so that the time is bounded.
    """
    found = tidy(value)
    if not 1 < len(found.terms) <= FEW:
        return found.expression
    fraction = sympy.fraction(sympy.together(found.expression))
    forms = []
    for circular, hyperbolic in (((sympy.cos, sympy.sin), (sympy.cosh, sympy.sinh)), _REVERSED):
        forms.append([_replaced(_replaced(part, *circular, 1), *hyperbolic, -1) for part in fraction])
    above, below = min(forms, key=lambda parts: sum(len(sympy.Add.make_args(part)) for part in parts))
    return min(found.expression, _with_squares(sympy.factor(above / below)), key=sympy.count_ops)


def _with_squares(value: Any) -> Any:
    """Write factors ``(cos - 1) (cos + 1)`` as ``-sin**2``, and likewise for sines and hyperbolic cosines."""
    powers = value.as_powers_dict()
    for old, (new, sign) in _SQUARES.items():
        for x in {each.args[0] for each in value.atoms(old)}:
            low, high = powers.get(old(x) - 1, 0), powers.get(old(x) + 1, 0)
            n = min(low, high) if low > 0 and high > 0 else max(low, high) if low < 0 and high < 0 else 0
            value = value * (sign * new(x) ** 2) ** n / (old(x) - 1) ** n / (old(x) + 1) ** n if n else value
    return value


_SQUARES = {sympy.cos: (sympy.sin, -1), sympy.sin: (sympy.cos, -1), sympy.cosh: (sympy.sinh, 1)}
_REVERSED = ((sympy.sin, sympy.cos), (sympy.sinh, sympy.cosh))


def _replaced(value: Any, old: Any, new: Any, sign: int) -> Any:
    """Replace even powers: ``old**2`` is ``1 - sign new**2``, or the negative of this for a hyperbolic sine."""
    flipped = -1 if old is sympy.sinh else 1
    for argument in {each.args[0] for each in value.atoms(old)}:
        x = sympy.Dummy("x")
        polynomial = sympy.Poly(sympy.expand(value).subs(old(argument), x), x)
        if not polynomial.is_univariate or polynomial.free_symbols_in_domain & {x}:
            return value
        square = flipped * (1 - sign * new(argument) ** 2)
        value = sympy.Add(*(c * square ** (n // 2) * old(argument) ** (n % 2) for (n,), c in polynomial.terms()))
    return sympy.expand(value)


FEW = 100
"""Number of terms up to which a result is factored, which is a limit on work: factoring takes milliseconds for these,
and seconds for a few hundred terms in five variables."""


def inverse_of(matrix: Any) -> Any:
    """Return the inverse of a symmetric matrix, block by block; the matrix of a degenerate metric gives None."""
    n = matrix.rows
    found = sympy.zeros(n, n)
    for block in _blocks(matrix):
        part = matrix.extract(block, block)
        determinant = short(part.det(method="berkowitz"))
        if determinant == 0:
            return None
        inverse = part.adjugate() / determinant
        for a, i in enumerate(block):
            for b, j in enumerate(block):
                found[i, j] = short(inverse[a, b])
    return found


def _blocks(matrix: Any) -> list[list[int]]:
    """Partition the indices of a symmetric matrix into sets that nonzero entries connect."""
    parts = list(range(matrix.rows))
    for i, j in combinations(range(matrix.rows), 2):
        if matrix[i, j] != 0:
            parts = [parts[i] if each == parts[j] else each for each in parts]
    return [[k for k, each in enumerate(parts) if each == part] for part in sorted(set(parts))]


def _array(n: int, rank: int, entry: Callable[..., Any]) -> Any:
    """Return an array of sympy expressions with `rank` indices."""
    shape = (n,) * rank
    places = [()] if rank == 0 else list(sympy.utilities.iterables.cartes(*[range(n)] * rank))
    return sympy.ImmutableDenseNDimArray([entry(*place) for place in places], shape)


class Curved:
    """Connection and curvature of coordinates with a metric; the base class of `Chart`."""

    parameters: tuple[Any, ...]

    @cached_property
    def metric(self) -> Any:
        """The sympy matrix of ``e_i . e_j``."""
        raise NotImplementedError

    @cached_property
    def inverse_metric(self) -> Any:
        """The sympy matrix of ``e^i . e^j``."""
        return inverse_of(self.metric)

    @cached_property
    def _inverse(self) -> Sequence[Sequence[Ring]]:
        return [[Expanded.of(value) for value in row] for row in self.inverse_metric.tolist()]

    @cached_property
    def _first(self) -> dict[tuple[int, int, int], Ring]:
        n, g, u = len(self.parameters), self.metric, self.parameters
        d = [[[Expanded.of(sympy.diff(g[i, j], p)) for p in u] for j in range(n)] for i in range(n)]
        found = {}
        for k in range(n):
            for i in range(n):
                for j in range(i + 1):
                    symbol = tidy((d[k][i][j] + d[k][j][i] - d[i][j][k]) * _HALF)
                    found[k, i, j] = found[k, j, i] = symbol
        return found

    @cached_property
    def _second(self) -> dict[tuple[int, int, int], Ring]:
        n = len(self.parameters)
        found = {}
        for k in range(n):
            for i in range(n):
                for j in range(i + 1):
                    terms = (self._inverse[k][m] * self._first[m, i, j] for m in range(n) if self._inverse[k][m])
                    found[k, i, j] = found[k, j, i] = tidy(sum(terms, _ZERO))
        return found

    @cached_property
    def christoffel_first(self) -> Any:
        """The Christoffel symbols of the first kind, ``e_k . D_i e_j`` at ``[k, i, j]``, as an array of sympy."""
        return _array(len(self.parameters), 3, lambda *place: short(self._first[place]))

    @cached_property
    def christoffel(self) -> Any:
        """The Christoffel symbols of the second kind, ``Gamma^k_ij = e^k . D_i e_j`` at ``[k, i, j]``."""
        return _array(len(self.parameters), 3, lambda *place: short(self._second[place]))

    @cached_property
    def _riemann(self) -> dict[tuple[int, int, int, int], Ring]:
        """``R_hkij`` for ``h < k``, ``i < j``: all others follow from the symmetries."""
        pairs = list(combinations(range(len(self.parameters)), 2))
        found = {}
        for a, (h, k) in enumerate(pairs):
            for i, j in pairs[: a + 1]:
                found[h, k, i, j] = found[i, j, h, k] = tidy(self._lowered_riemann(h, k, i, j))
        return found

    def _lowered_riemann(self, h: int, k: int, i: int, j: int) -> Ring:
        g, u = self.metric, self.parameters
        total = _ZERO
        for a, b, c, d, sign in ((h, j, k, i, 1), (k, i, h, j, 1), (k, j, h, i, -1), (h, i, k, j, -1)):
            if g[a, b] != 0:
                total = total + Expanded.of(sympy.diff(g[a, b], u[c], u[d])) * (_HALF * sign)
        for m in range(len(u)):
            total = total + self._first[m, k, i] * self._second[m, h, j] - self._first[m, k, j] * self._second[m, h, i]
        return total

    def _component(self, h: int, k: int, i: int, j: int) -> Ring:
        if h == k or i == j:
            return _ZERO
        sign = (1 if h < k else -1) * (1 if i < j else -1)
        return self._riemann[min(h, k), max(h, k), min(i, j), max(i, j)] * sign

    @cached_property
    def riemann_lower(self) -> Any:
        """The curvature ``R_hkij = e_h . (D_i D_j - D_j D_i) e_k`` at ``[h, k, i, j]``."""
        return _array(len(self.parameters), 4, lambda *place: short(self._component(*place)))

    @cached_property
    def _mixed(self) -> dict[tuple[int, int, int, int], Ring]:
        """``R^hk_ij`` for ``h < k``, ``i < j``: the coefficients of bivectors."""
        pairs = list(combinations(range(len(self.parameters)), 2))
        up = self._inverse
        found = {}
        for h, k in pairs:
            factors = {(a, b): up[h][a] * up[k][b] - up[h][b] * up[k][a] for a, b in pairs}
            for i, j in pairs:
                terms = (f * self._riemann[a, b, i, j] for (a, b), f in factors.items() if f)
                found[h, k, i, j] = Expanded.of(short(sum(terms, _ZERO)))
        return found

    @cached_property
    def riemann(self) -> Any:
        """The curvature ``R^h_kij`` at ``[h, k, i, j]``."""
        n = len(self.parameters)

        def entry(h: int, k: int, i: int, j: int) -> Any:
            return short(sum((self._inverse[h][m] * self._component(m, k, i, j) for m in range(n)), _ZERO))

        return _array(n, 4, entry)

    @cached_property
    def ricci(self) -> Any:
        """The matrix of Ricci's tensor, ``R_kj = R^h_khj``."""
        n = len(self.parameters)

        def entry(k: int, j: int) -> Any:
            pairs = ((h, m) for h in range(n) for m in range(n) if self._inverse[h][m])
            return short(sum((self._inverse[h][m] * self._component(m, k, h, j) for h, m in pairs), _ZERO))

        upper = {(k, j): entry(k, j) for k in range(n) for j in range(k, n)}
        return sympy.Matrix(n, n, lambda k, j: upper[min(k, j), max(k, j)])

    @cached_property
    def scalar_curvature(self) -> Any:
        """The scalar curvature, the trace of Ricci's tensor: ``2 / r**2`` for a sphere of radius `r`."""
        return short(2 * sum((value for (h, k, i, j), value in self._mixed.items() if (h, k) == (i, j)), _ZERO))

    @cached_property
    def einstein(self) -> Any:
        """The matrix of Einstein's tensor, ``R_kj - R g_kj / 2``."""
        return (self.ricci - self.scalar_curvature / 2 * self.metric).applyfunc(short)

    @cached_property
    def kretschmann(self) -> Any:
        """Kretschmann's invariant, ``R_hkij R^hkij``."""
        terms = (value * self._mixed[i, j, h, k] for (h, k, i, j), value in self._mixed.items())
        return short(4 * sum(terms, _ZERO))


SIGN_POINTS = 24
"""Number of points that decide a sign. A factor that is positive at a quarter of them is missed once in a thousand."""


def positive_length(root: Any) -> Any:
    """Return a length without the absolute values of its factors, of which none is negative everywhere.

    A factor is negated if it is negative at random positive values of all symbols.
    """
    return sympy.Mul(*map(_usual_sign, sympy.Mul.make_args(signless(root))))


def _usual_sign(factor: Any) -> Any:
    """Return a factor of a length, or its negative if it is negative at random positive values of all symbols."""
    random, names = Random(1), sorted(factor.free_symbols, key=str)
    points = ({name: 10 ** random.uniform(-1, 1) for name in names} for _ in range(SIGN_POINTS))
    return factor if any(not sympy.N(factor.subs(point)).is_negative for point in points) else -factor
