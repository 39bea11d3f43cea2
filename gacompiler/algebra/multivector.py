"""Multivectors as mappings from basis blade to coefficient, over any ring."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import reduce
from operator import mul
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NoReturn

from ..errors import AlgebraError, OperandError, ZeroDivisorError
from .blades import grade, reordering_sign
from .coefficients import Coefficient, divide, is_zero
from .latex import constant
from .methods import WithCoefficients
from .products import product

if TYPE_CHECKING:
    from .algebra import Algebra


class Multivector(WithCoefficients):
    """An immutable element of a geometric algebra.

    Parameters
    ----------
    algebra : Algebra
    terms : mapping of int to coefficient
        Coefficient of each basis blade, given by its bitmap. Missing blades have the coefficient zero.

    Notes
    -----
    Operators: ``+ -``, ``*`` geometric product, ``^`` outer product, ``&`` regressive product, ``|`` inner product,
    ``>>`` sandwich product, ``~`` reverse, ``/`` by a scalar or an element with an inverse, and ``**``. In Python
    ``^ & | >>`` have a lower precedence than ``+``: use parentheses. The methods are those of all multivectors, see
    `gacompiler.algebra.methods`, and ``x.e12`` is a coefficient.
    """

    __slots__ = ("algebra", "terms")
    _takes_over_multivector = False
    __array_ufunc__ = None  # so that an array as the left operand defers to the multivector

    algebra: Algebra
    terms: Mapping[int, Coefficient]

    def __init__(self, algebra: Algebra, terms: Mapping[int, Coefficient]) -> None:
        if type(terms) is not dict and not isinstance(terms, Mapping):
            raise AlgebraError("Multivector()", type(terms).__name__, "a mapping from blades to coefficients")
        object.__setattr__(self, "algebra", algebra)
        if len(terms) > 1:
            kept = {blade: value for blade in sorted(terms) if not is_zero(value := terms[blade])}
        else:
            kept = {blade: value for blade, value in terms.items() if not is_zero(value)}
        object.__setattr__(self, "terms", MappingProxyType(kept))

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a Multivector is immutable; cannot set {name}")

    def __getitem__(self, blade: str | int) -> Coefficient:
        """Return the coefficient of a blade, given in any spelling (``"e31"``) or by bitmap."""
        sign, bitmap = self.algebra.blade(blade) if isinstance(blade, str) else (1, blade)
        value = self.terms.get(bitmap, 0)
        return value if sign > 0 else -value

    def coefficient_at(self, bitmap: int) -> Coefficient:
        """Return the coefficient of a blade, given by its bitmap, as of expressions, whose indices are names."""
        return self[bitmap]

    def __iter__(self) -> NoReturn:
        raise OperandError("a multivector", "it cannot be iterated", remedy='use a coefficient, x["e12"], or x.terms')

    @property
    def grades(self) -> tuple[int, ...]:
        """The grades that occur, ascending."""
        return tuple(sorted({grade(blade) for blade in self.terms}))

    @property
    def blades(self) -> frozenset[int]:
        """Bitmaps of the blades that occur."""
        return frozenset(self.terms)

    @property
    def scalar(self) -> Coefficient:
        """The coefficient of 1."""
        return self.terms.get(0, 0)

    def grade(self, *grades: int) -> Multivector:
        """Return the part of the given grades."""
        return self.keep(lambda blade: grade(blade) in grades)

    def keep(self, predicate: Callable[[int], bool]) -> Multivector:
        """Return the part on the blades for whose bitmaps `predicate` holds."""
        return Multivector(self.algebra, {blade: value for blade, value in self.terms.items() if predicate(blade)})

    def map(self, function: Callable[[Coefficient], Coefficient]) -> Multivector:
        """Apply `function` to every coefficient."""
        return Multivector(self.algebra, {blade: function(value) for blade, value in self.terms.items()})

    def with_signs(self, sign_of_grade: Callable[[int], int]) -> Multivector:
        """Multiply every coefficient by a sign that depends on the grade; all involutions are of this form."""
        return Multivector(self.algebra, signed(self.terms, sign_of_grade))

    def complement(self, sign: Callable[[int, int], int]) -> Multivector:
        """Replace every blade by its complement, the blade of all other vectors; `sign` is called with both."""
        everything = self.algebra.everything
        orientation, _ = self.algebra.spelling(everything)
        terms = {}
        for blade, value in self.terms.items():
            other = everything ^ blade
            terms[other] = value if sign(blade, other) * orientation > 0 else -value
        return Multivector(self.algebra, terms)

    def product(self, name: str, other: Multivector) -> Multivector:
        """Return the product `name`, which selects grades of the geometric product or is a bracket of it."""
        return Multivector(self.algebra, product(self.algebra, name, self.terms, other.terms))

    def lift(self, other: Any) -> Multivector:
        """Return `other` as a multivector of this algebra; a value that is not a multivector becomes a scalar.

        Raises
        ------
        AlgebraError
            If `other` is a multivector of another algebra.
        """
        if isinstance(other, Multivector):
            if other.algebra != self.algebra:
                raise AlgebraError(
                    "operation on two multivectors",
                    f"algebras {self.algebra.name} and {other.algebra.name}",
                    "the same algebra",
                    "convert one of them by its coefficients",
                )
            return other
        return Multivector(self.algebra, {0: other})

    def __add__(self, other: Any) -> Multivector:
        if _defers(other):
            return NotImplemented
        return Multivector(self.algebra, added(self.terms, self.lift(other).terms))

    def __radd__(self, other: Any) -> Multivector:
        return self.__add__(other)

    def __neg__(self) -> Multivector:
        return self.map(lambda value: -value)

    def __pos__(self) -> Multivector:
        return self

    def __sub__(self, other: Any) -> Multivector:
        return NotImplemented if _defers(other) else self + -self.lift(other)

    def __rsub__(self, other: Any) -> Multivector:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Multivector:
        return NotImplemented if _defers(other) else self.product("geometric_product", self.lift(other))

    def __rmul__(self, other: Any) -> Multivector:
        return self.lift(other).product("geometric_product", self)

    def __xor__(self, other: Any) -> Multivector:
        return NotImplemented if _defers(other) else self.product("outer_product", self.lift(other))

    def __rxor__(self, other: Any) -> Multivector:
        return self.lift(other).product("outer_product", self)

    def __and__(self, other: Any) -> Multivector:
        if _defers(other):
            return NotImplemented
        left, right = self.complement(reordering_sign), self.lift(other).complement(reordering_sign)
        return left.product("outer_product", right).complement(lambda blade, other: reordering_sign(other, blade))

    def __truediv__(self, other: Any) -> Multivector:
        if _defers(other):
            return NotImplemented
        divisor = self.lift(other)
        if not divisor.terms:
            raise ZeroDivisorError("division", f"{self} / 0", "a divisor other than zero")
        if any(divisor.terms):
            return self * divisor.inverse()  # type: ignore[no-any-return]
        return self.map(lambda value: divide(value, divisor.scalar))

    def __rtruediv__(self, other: Any) -> Multivector:
        return NotImplemented if _defers(other) else self.lift(other) / self

    def __pow__(self, exponent: Any) -> Multivector:
        """Return a product of equal factors, a power of the inverse, or `power` for any other exponent."""
        return integer_power(self, exponent, self.lift(1))  # type: ignore[no-any-return]

    def __invert__(self) -> Multivector:
        return self.with_signs(self.algebra.reverse_sign)

    def __eq__(self, other: object) -> bool:
        """Return whether all coefficients are exactly equal."""
        if isinstance(other, Multivector) and other.algebra != self.algebra:
            return False
        try:
            difference = self - self.lift(other)
        except TypeError:
            return NotImplemented
        return all(bool(value == 0) for value in difference.terms.values())

    def __hash__(self) -> int:
        """Return the hash; a scalar multivector has the hash of its number."""
        return hash((self.algebra, frozenset(self.terms.items()))) if any(self.terms) else hash(self.scalar)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.algebra, dict(self.terms))

    def __str__(self) -> str:
        if not self.terms:
            return "0"
        parts = []
        for blade in sorted(self.terms, key=lambda blade: (grade(blade), blade)):
            sign, name = self.algebra.spelling(blade)
            value = self.terms[blade] if sign > 0 else -self.terms[blade]
            text = f"{value}" if blade == 0 else name if _is_one(value) else f"{_bracket(str(value))}*{name}"
            parts.append(text)
        return " + ".join(parts).replace("+ -", "- ")

    def __repr__(self) -> str:
        return f"{self.algebra.name}: {self}"

    def _repr_latex_(self) -> str:
        return f"${constant(self)}$"


def added(a: Mapping[int, Coefficient], b: Mapping[int, Coefficient]) -> dict[int, Coefficient]:
    """Return the coefficients of a sum of multivectors, which may contain zeros."""
    terms = dict(a)
    for blade, value in b.items():
        terms[blade] = terms[blade] + value if blade in terms else value
    return terms


def signed(a: Mapping[int, Coefficient], sign_of_grade: Callable[[int], int]) -> dict[int, Coefficient]:
    """Return coefficients times a sign that depends on the grade of the blade."""
    return {blade: value if sign_of_grade(grade(blade)) > 0 else -value for blade, value in a.items()}


def integer_power(x: Any, exponent: Any, one: Any) -> Any:
    """Return a power of any multivector, whose exponent need not be an integer."""
    if not isinstance(exponent, int):
        return x.power(exponent)
    if exponent < 0:
        return integer_power(x.inverse(), -exponent, one)
    return reduce(mul, [x] * exponent) if exponent else one


def _defers(other: object) -> bool:
    """Return whether `other` is an expression of the frontend, whose operators apply to constant multivectors."""
    return getattr(other, "_takes_over_multivector", False) is True


def _is_one(value: Coefficient) -> bool:
    return isinstance(value, int) and value == 1


def _bracket(text: str) -> str:
    return f"({text})" if " " in text else text


def sum_of(algebra: Algebra, parts: Iterable[Multivector]) -> Multivector:
    """Return the sum of `parts`, zero for an empty iterable."""
    total = Multivector(algebra, {})
    for part in parts:
        total = total + part
    return total
