"""Differential operators on multivector fields: the vector derivative, and its products and sums.

An operator is a sum of terms, each a coefficient and a sequence of parameters: ``A d_i d_j`` means
``A * (D_i (D_j F))`` with the derivatives `Chart.partial`. Products of operators follow from the product rule
(Hestenes & Sobczyk 1984, §2-1; galgebra has the same forms, but without the derivatives of basis vectors in products).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

from ..algebra.algebra import Algebra
from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..errors import AlgebraError
from ..symbolic import reduce
from ..symbolic.multivector import SymbolicMultivector
from ..symbolic.printing import latex

Word = tuple[int, ...]
"""The numbers of the parameters of a repeated derivative; the last one is applied first."""


class Fields(Protocol):
    """The part of the interface of `gacompiler.calculus.Chart`, which uses this module."""

    algebra: Algebra
    parameters: tuple[Any, ...]

    @property
    def is_flat(self) -> bool:
        """Whether derivatives along coordinates commute."""

    def lift(self, field: Any) -> SymbolicMultivector:
        """Return a field as a symbolic multivector."""

    def partial(self, field: Any, k: int) -> SymbolicMultivector:
        """Return the derivative of a field by parameter `k`."""


class FieldOperator:
    """A differential operator on the fields of a chart, made by `Chart.grad`, `Chart.rgrad` and their products.

    ``D * F``, ``D ^ F`` and ``D | F`` apply an operator to a field, with this product of its coefficients and the
    derivatives of the field. ``F * D``, ``F ^ D`` and ``F | D`` are operators, such as the directional derivative
    ``a | grad``. Products and integer powers of operators are operators. An operator of `Chart.rgrad` applies to fields
    at its left, ``F * D``, and ``D * F`` is an operator. All of this is also available for sums, negatives, and
    multiples by numbers and expressions; a number or field that is added to an operator means multiplication by it.

    In curved coordinates, `*` of operators is associative: ``(D * E) * F == D * (E * F)``. For other products this
    holds where the products of the coefficients are associative.

    Attributes
    ----------
    chart : Chart
    terms : tuple of (SymbolicMultivector, tuple of int)
        Coefficients, and the numbers of the parameters of the derivatives.
    right : bool
        Whether fields are at the left of the operator.
    """

    chart: Fields
    terms: tuple[tuple[SymbolicMultivector, Word], ...]
    right: bool
    __array_ufunc__ = None
    _takes_over_multivector = True
    acts_on_fields = True

    def __init__(self, chart: Fields, terms: Iterable[tuple[Any, Sequence[int]]], *, right: bool = False) -> None:
        found: dict[Word, SymbolicMultivector] = {}
        for coefficient, word in terms:
            # Derivatives along coordinates commute, except in a curved space.
            key = tuple(sorted(word)) if len(word) > 1 and chart.is_flat else tuple(word)
            lifted = chart.lift(coefficient)
            found[key] = found[key] + lifted if key in found else lifted
        reduced = ((reduce(value), word) for word, value in found.items() if value.terms)
        kept = [(value, word) for value, word in reduced if value.terms]
        self.chart, self.right = chart, right
        self.terms = tuple(sorted(kept, key=_order) if len(kept) > 1 else kept)

    def apply(self, product: str, field: Any) -> SymbolicMultivector:
        """Apply the operator to a field with the product `product` of coefficients and derivatives."""
        lifted = self.chart.lift(field)
        found = SymbolicMultivector(self.chart.algebra, {})
        for coefficient, word in self.terms:
            moved = self._derivative(word, lifted)
            if moved.terms:
                sides = (moved, coefficient) if self.right else (coefficient, moved)
                found = found + sides[0].product(product, sides[1])
        return reduce(found)

    def _derivative(self, word: Word, field: SymbolicMultivector) -> SymbolicMultivector:
        for k in reversed(word):
            field = self.chart.partial(field, k)
        return field

    def _times(self, product: str, other: Any) -> Any:
        """Return ``self other``: an operator if `other` is one or must be at the left, else a field."""
        if isinstance(other, FieldOperator):
            self._compatible(other)
            return other._after(product, self, flipped=True) if self.right else self._after(product, other)
        if not self.right:
            return self.apply(product, other)
        lifted = self.chart.lift(other)
        return self._made((coefficient.product(product, lifted), word) for coefficient, word in self.terms)

    def _rtimes(self, product: str, other: Any) -> Any:
        if self.right:
            return self.apply(product, other)
        lifted = self.chart.lift(other)
        return self._made((lifted.product(product, coefficient), word) for coefficient, word in self.terms)

    def _after(self, product: str, inner: FieldOperator, flipped: bool = False) -> FieldOperator:
        """Return this operator applied to the results of `inner`, by the product rule."""
        terms = []
        for a, outer_word in self.terms:
            for b, inner_word in inner.terms:
                for on_coefficient, on_field in _splits(outer_word):
                    moved = self._derivative(on_coefficient, b)
                    if moved.terms:
                        whole = moved.product(product, a) if flipped else a.product(product, moved)
                        terms.append((whole, on_field + inner_word))
        return self._made(terms)

    def _made(self, terms: Iterable[tuple[Any, Sequence[int]]]) -> FieldOperator:
        return FieldOperator(self.chart, terms, right=self.right)

    def _compatible(self, other: FieldOperator) -> None:
        if self.chart != other.chart:
            raise AlgebraError("two operators", "of different charts", "operators of one chart")
        if self.right != other.right:
            raise AlgebraError(
                "two operators", "one for fields at its left and one for fields at its right", "the same side",
                "use grad for both, or rgrad for both",
            )  # fmt: skip

    def __mul__(self, other: Any) -> Any:
        return self._times(Operation.GEOMETRIC_PRODUCT, other)

    def __rmul__(self, other: Any) -> Any:
        return self._rtimes(Operation.GEOMETRIC_PRODUCT, other)

    def __xor__(self, other: Any) -> Any:
        return self._times(Operation.OUTER_PRODUCT, other)

    def __rxor__(self, other: Any) -> Any:
        return self._rtimes(Operation.OUTER_PRODUCT, other)

    def __or__(self, other: Any) -> Any:
        return self._times(Operation.INNER_PRODUCT, other)

    def __ror__(self, other: Any) -> Any:
        return self._rtimes(Operation.INNER_PRODUCT, other)

    def __pow__(self, exponent: int) -> FieldOperator:
        if not isinstance(exponent, int) or exponent < 0:
            raise AlgebraError("power of an operator", f"the exponent {exponent!r}", "an integer of at least 0")
        found: FieldOperator = self._made([(SymbolicMultivector(self.chart.algebra, {0: 1}), ())])
        for _ in range(exponent):
            found = self * found
        return found

    def __truediv__(self, other: Any) -> FieldOperator:
        divisor = self.chart.lift(other)
        if any(divisor.terms):
            raise AlgebraError("quotient of an operator", f"the divisor {divisor}", "a scalar")
        return self._made((coefficient / divisor, word) for coefficient, word in self.terms)

    def __add__(self, other: Any) -> FieldOperator:
        added = other if isinstance(other, FieldOperator) else self._made([(self.chart.lift(other), ())])
        self._compatible(added)
        return self._made([*self.terms, *added.terms])

    __radd__ = __add__

    def __neg__(self) -> FieldOperator:
        return self._made((-coefficient, word) for coefficient, word in self.terms)

    def __sub__(self, other: Any) -> FieldOperator:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> FieldOperator:
        return (-self).__add__(other)

    def __eq__(self, other: object) -> bool:
        """Return whether both operators have the same coefficients; 0 is the operator without terms."""
        if isinstance(other, FieldOperator):
            same = self.chart == other.chart and self.right == other.right
            return same and not (self - other).terms
        if isinstance(other, (int, Multivector)):
            return not (self - other).terms
        return NotImplemented

    def __hash__(self) -> int:
        return hash((self.chart, self.right, self.terms))

    @property
    def is_scalar(self) -> bool:
        """Whether all coefficients are scalars, as those of the Laplacian are."""
        return all(not any(coefficient.terms) for coefficient, _ in self.terms)

    def __str__(self) -> str:
        names = [parameter.name for parameter in self.chart.parameters]
        parts = [f"({coefficient})" + "".join(f"*D_{names[k]}" for k in word) for coefficient, word in self.terms]
        return " + ".join(parts) or "0"

    def __repr__(self) -> str:
        return f"FieldOperator({self})"

    def _latex(self, printer: object = None) -> str:
        """Return LaTeX without dollar signs, for `sympy.latex`."""
        parts = []
        for coefficient, word in self.terms:
            text = coefficient._latex()
            blades = list(coefficient.terms)
            plain = len(blades) == 1 and (blades != [0] or not coefficient.scalar.is_Add)
            parts.append((text if plain else rf"\left({text}\right)") + _derivative_latex(self.chart.parameters, word))
        return " + ".join(parts).replace("+ -", "- ") or "0"

    def _repr_latex_(self) -> str:
        return f"${self._latex()}$"


def _derivative_latex(parameters: Sequence[Any], word: Word) -> str:
    if not word:
        return ""
    power = f"^{{{len(word)}}}" if len(word) > 1 else ""
    below = " ".join(rf"\partial {latex(parameters[k])}" for k in word)
    return rf"\,\frac{{\partial{power}}}{{{below}}}"


def _order(term: tuple[SymbolicMultivector, Word]) -> tuple[int, Word]:
    return len(term[1]), term[1]


def _splits(word: Word) -> list[tuple[Word, Word]]:
    """Return all splits of a word of derivatives of a product into those of its first and of its second factor."""
    found: list[tuple[Word, Word]] = [((), ())]
    for k in word:
        found = [pair for a, b in found for pair in (((*a, k), b), (a, (*b, k)))]
    return found
