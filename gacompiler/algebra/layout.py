"""Layouts: which coefficients of a multivector are stored, and how the others are determined."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any
from weakref import WeakValueDictionary

from ..errors import LayoutError
from .algebra import Algebra
from .blades import Rational, exact
from .coefficients import Coefficient, is_zero
from .immutable import Immutable
from .multivector import Multivector

Relations = Callable[[Multivector], Multivector | Sequence[Multivector]]
Implication = Callable[[Mapping[str, Coefficient]], Coefficient]


@dataclass(frozen=True, slots=True)
class Slot:
    """A coefficient: the name of its blade, the bitmap, and the sign between the orientations of name and bitmap."""

    name: str
    blade: int
    sign: int


@dataclass(frozen=True)
class Layout(Immutable):
    """A type of multivector.

    Attributes
    ----------
    algebra : Algebra
    name : str
    stored : tuple of Slot
        The coefficients that an array of this layout holds, in order.
    fixed : tuple of (Slot, rational)
        Coefficients that are equal for all elements, such as the weight 1 of a point.
    implied : tuple of (Slot, callable)
        Coefficients that are polynomials in the stored ones, as functions of the mapping name -> stored coefficient.
    unit : bool
        Whether all coefficients of ``x ~x = 1`` hold.
    user_relations : callable, optional
        Function of an element that returns one or more multivectors, all of whose coefficients are zero.
    """

    algebra: Algebra
    name: str
    stored: tuple[Slot, ...]
    fixed: tuple[tuple[Slot, Rational], ...] = ()
    implied: tuple[tuple[Slot, Implication], ...] = ()
    unit: bool = False
    user_relations: Relations | None = None

    @classmethod
    def of(
        cls,
        algebra: Algebra,
        name: str,
        blades: str,
        *,
        fixed: Mapping[str, Rational] | None = None,
        implied: Mapping[str, Implication] | None = None,
        unit: bool = False,
        relations: Relations | None = None,
    ) -> Layout:
        """Create a layout from the names of its blades.

        Raises
        ------
        LayoutError
            If a blade occurs twice.
        AlgebraError
            If a name is not a blade of the algebra.
        """

        def slot(spelling: str) -> Slot:
            sign, blade = algebra.blade(spelling)
            return Slot(spelling, blade, sign)

        layout = cls(
            algebra,
            name,
            tuple(slot(spelling) for spelling in blades.split()),
            tuple((slot(spelling), exact(Fraction(value))) for spelling, value in (fixed or {}).items()),
            tuple((slot(spelling), function) for spelling, function in (implied or {}).items()),
            unit,
            relations,
        )
        seen: dict[int, str] = {}
        for one in (*layout.stored, *(s for s, _ in layout.fixed), *(s for s, _ in layout.implied)):
            if one.blade in seen:
                raise LayoutError(
                    f"layout {name}", f"{one.name} and {seen[one.blade]} are the same blade", "each blade once"
                )
            seen[one.blade] = one.name
        return layout

    @property
    def row(self) -> tuple[Any, ...]:
        """All attributes except the algebra, in order."""
        return self.name, self.stored, self.fixed, self.implied, self.unit, self.user_relations

    def __reduce__(self) -> tuple[Any, ...]:
        if self.algebra.named_layout(self.name) == self:
            return _of_name, (self.algebra, self.name)
        _PICKLED.setdefault((self.algebra, *self.row), self)
        return _restored, (self.algebra, *self.row)

    @cached_property
    def blades(self) -> tuple[str, ...]:
        """Names of the stored coefficients, in order."""
        return tuple(slot.name for slot in self.stored)

    @cached_property
    def size(self) -> int:
        """Number of stored coefficients."""
        return len(self.stored)

    @cached_property
    def is_scalar(self) -> bool:
        """Whether this is `SCALAR`, the layout of numbers, whose arrays have no blade axis.

        A layout of the blade 1 in an algebra is a layout of multivectors, whose arrays have a blade axis of length 1.
        """
        return not self.algebra.dimension and not self.fixed and not self.implied and self.size == 1

    @cached_property
    def support(self) -> frozenset[int]:
        """Bitmaps of all blades that an element can have."""
        slots = (*self.stored, *(slot for slot, value in self.fixed if value), *(slot for slot, _ in self.implied))
        return frozenset(slot.blade for slot in slots)

    @cached_property
    def has_relations(self) -> bool:
        """Whether the stored coefficients are constrained by relations."""
        return self.unit or self.user_relations is not None

    def element(self, coefficients: Sequence[Coefficient]) -> Multivector:
        """Return the multivector with the given stored coefficients, over any ring.

        Raises
        ------
        LayoutError
            If the number of coefficients is not `size`.
        """
        if len(coefficients) != self.size:
            raise LayoutError(
                f"layout {self.name}", f"{len(coefficients)} coefficients", f"{self.size}: {' '.join(self.blades)}"
            )
        terms = {slot.blade: _signed(value, slot) for slot, value in zip(self.stored, coefficients, strict=True)}
        terms |= {slot.blade: _signed(value, slot) for slot, value in self.fixed}
        if self.implied:
            named = dict(zip(self.blades, coefficients, strict=True))
            terms |= {slot.blade: _signed(function(named), slot) for slot, function in self.implied}
        return Multivector(self.algebra, terms)

    def coefficients(self, element: Multivector) -> tuple[Coefficient, ...]:
        """Return the stored coefficients of `element`.

        Raises
        ------
        LayoutError
            If the element has a blade that this layout cannot hold, or if a fixed or implied coefficient has another
            value.
        """
        for blade in element.terms:
            if blade not in self.support:
                name = self.algebra.spelling(blade)[1]
                raise LayoutError(
                    f"layout {self.name}", f"an element with blade {name}", f"only {' '.join(self.blades)}"
                )
        for slot, value in self.fixed:
            if not is_zero(element.terms.get(slot.blade, 0) - _signed(value, slot)):
                raise LayoutError(
                    f"layout {self.name}",
                    f"{slot.name} = {_signed(element.terms.get(slot.blade, 0), slot)}",
                    f"{slot.name} = {value}",
                )
        stored = tuple(_signed(element.terms.get(slot.blade, 0), slot) for slot in self.stored)
        for slot, function in self.implied:
            value, wanted = element.terms.get(slot.blade, 0), function(dict(zip(self.blades, stored, strict=True)))
            if not is_zero(value - _signed(wanted, slot)):
                raise LayoutError(
                    f"layout {self.name}", f"{slot.name} = {_signed(value, slot)}", f"{slot.name} = {wanted}"
                )
        return stored

    def relations(self, element: Multivector) -> tuple[Coefficient, ...]:
        """Return the values of the relations at `element`, which are zero for every element of this layout."""
        zero: list[Coefficient] = []
        if self.unit:
            # In a finite-dimensional algebra each implies the other, but not by polynomials of the same degree.
            zero += (element * ~element - 1).terms.values()
            zero += (~element * element - 1).terms.values()
        return (*zero, *self._values_of_user_relations(element))

    def relations_hold(self, element: Multivector) -> bool:
        """Return whether the relations hold at `element`, whose coefficients are exact numbers."""
        if self.unit and any(value != 0 for value in (element * ~element - 1).terms.values()):
            return False
        return all(value == 0 for value in self._values_of_user_relations(element))

    def _values_of_user_relations(self, element: Multivector) -> list[Coefficient]:
        found = () if self.user_relations is None else self.user_relations(element)
        values = [found] if isinstance(found, Multivector) else found
        return [value for each in values for value in element.lift(each).terms.values()]

    def __str__(self) -> str:
        return f"{self.algebra.name}.{self.name}"

    def _latex(self, printer: object = None) -> str:
        """Return the name in LaTeX, for `sympy.latex`."""
        return rf"\mathrm{{{self}}}".replace("_", r"\_")

    def _repr_latex_(self) -> str:
        return f"${self._latex()}$"


def _of_name(algebra: Algebra, name: str) -> Layout | None:
    return algebra.named_layout(name)


def _signed(value: Coefficient, slot: Slot) -> Coefficient:
    return value if slot.sign > 0 else -value


def _restored(algebra: Algebra, *row: Any) -> Layout:
    return _PICKLED.setdefault((algebra, *row), Layout(algebra, *row))


_PICKLED: WeakValueDictionary[tuple[Any, ...], Layout] = WeakValueDictionary()
"""Unnamed layouts that this process pickled or restored, so that unpickling one returns the same object."""


def _scalar(algebra: Algebra) -> tuple[Layout]:
    return (Layout.of(algebra, "SCALAR", "1"),)


SCALARS = Algebra("scalars", (), (), layouts=_scalar)
SCALAR = SCALARS.SCALAR
