"""Canonical sparse polynomials with exact coefficients, which are equal if and only if their terms are.

A variable is an integer. Inputs and named intermediate results are numbered from 0 upward; *atoms* (values of functions
that are not polynomials, such as ``sqrt(x)``) are numbered from -1 downward. A monomial is the sorted tuple of its
variables, with repetition: ``x**2 y`` is ``(x, x, y)``. Monomials are ordered by degree; then variables with smaller
numbers are larger. Hence an atom is larger than its arguments, and the scalar coefficient of a versor, which is the
first in its layout, is larger than the others.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain
from math import lcm
from typing import Any

from ..algebra.blades import Rational, exact
from ..algebra.coefficients import EXACT
from ..errors import InexactError, KernelError, TooLargeError, ZeroDivisorError
from ..ir.scalar import Op

Monomial = tuple[int, ...]
Key = tuple[tuple[Monomial, Rational], ...]


@dataclass(frozen=True, slots=True)
class Atom:
    """The value of a function of polynomials, as a symbol."""

    op: Op
    arguments: tuple[Polynomial, ...]


class PolynomialRing:
    """A polynomial ring, with the names of its variables and its atoms.

    Parameters
    ----------
    budget : int
        Maximum number of terms of a product; more raise `TooLargeError`.
    effort : int
        Maximum total number of pairs of terms that are multiplied; more raise `TooLargeError`.
    """

    def __init__(self, budget: int = 20_000, effort: int = 2_000_000) -> None:
        self.budget = budget
        self.effort = effort
        self.names: list[str] = []
        self.atoms: list[Atom] = []
        self._atom_numbers: dict[tuple[Op, tuple[Key, ...]], int] = {}
        self._relations: list[Polynomial] = []
        self._related_atoms = 0

    def variable(self, name: str) -> Polynomial:
        """Return a new variable."""
        self.names.append(name)
        return Polynomial(self, {(len(self.names) - 1,): 1})

    def constant(self, value: Rational) -> Polynomial:
        """Return a constant polynomial."""
        return Polynomial(self, {(): exact(value)} if value else {})

    def lift(self, value: Any) -> Polynomial:
        """Return `value` as a polynomial of this ring.

        Raises
        ------
        KernelError
            If it is not a polynomial or an exact number.
        """
        if isinstance(value, Polynomial):
            return value
        if type(value) is int or isinstance(value, (int, Fraction)):
            return self.constant(value)
        if isinstance(value, float) and value.is_integer():
            return self.constant(int(value))
        raise KernelError(
            "constant in a kernel",
            f"{value!r} of type {type(value).__name__}",
            "an exact number (int or Fraction)",
            "write a float as the intended Fraction",
        )

    def atom(self, op: Op, *arguments: Polynomial) -> Polynomial:
        """Return the value ``op(arguments)`` as a variable; equal arguments give the same variable."""
        key = (op, tuple(argument.key for argument in arguments))
        number = self._atom_numbers.get(key)
        if number is None:
            self.atoms.append(Atom(op, arguments))
            number = self._atom_numbers[key] = -len(self.atoms)
        return Polynomial(self, {(number,): 1})

    def atom_of(self, variable: int) -> Atom:
        """Return the atom of a negative variable."""
        return self.atoms[-variable - 1]

    def name(self, variable: int) -> str:
        """Return the printed name of a variable."""
        if variable >= 0:
            return self.names[variable]
        atom = self.atom_of(variable)
        return f"{atom.op.value}({', '.join(map(str, atom.arguments))})"

    def atom_relations(self) -> list[Polynomial]:
        """Return the relations of the atoms: ``sqrt(x)**2 = x``, ``(1/x) x = 1``, ``sin**2 + cos**2 = 1``."""
        if self._related_atoms == len(self.atoms):
            return self._relations
        self._related_atoms = len(self.atoms)
        relations = self._relations = list[Polynomial]()
        for k, atom in enumerate(self.atoms):
            value = Polynomial(self, {(-k - 1,): 1})
            if atom.op is Op.SQRT:
                relations.append(value * value - atom.arguments[0])
            elif atom.op is Op.DIVIDE:
                relations.append(value * atom.arguments[1] - atom.arguments[0])
            elif atom.op is Op.SIN:
                number = self._atom_numbers.get((Op.COS, (atom.arguments[0].key,)))
                if number is not None:
                    cosine = Polynomial(self, {(number,): 1})
                    relations.append(value * value + cosine * cosine - 1)
        return relations


class Polynomial:
    """An immutable polynomial; `terms` maps monomials to nonzero exact coefficients."""

    __slots__ = ("_key", "_variables", "ring", "terms")

    def __init__(self, ring: PolynomialRing, terms: Mapping[Monomial, Rational]) -> None:
        self.ring = ring
        self.terms = terms
        self._key: Key | None = None
        self._variables: tuple[int, ...] | None = None

    @property
    def key(self) -> Key:
        """The terms in a canonical order; equal polynomials have equal keys."""
        if self._key is None:
            self._key = tuple(sorted(self.terms.items(), key=lambda term: (-len(term[0]), term[0])))
        return self._key

    @property
    def is_zero(self) -> bool:
        """Whether the polynomial has no terms."""
        return not self.terms

    @property
    def constant_value(self) -> Rational | None:
        """The value of a constant polynomial, or None."""
        if not self.terms:
            return 0
        return self.terms[()] if len(self.terms) == 1 and () in self.terms else None

    @property
    def degree(self) -> int:
        """Total degree; -1 for zero."""
        return max(map(len, self.terms), default=-1)

    @property
    def variables(self) -> tuple[int, ...]:
        """Variables that occur, ascending."""
        if self._variables is None:
            self._variables = tuple(sorted(set(chain.from_iterable(self.terms))))
        return self._variables

    @property
    def leading(self) -> Monomial:
        """The largest monomial."""
        return min(self.terms, key=lambda monomial: (-len(monomial), monomial))

    def __add__(self, other: Any) -> Polynomial:
        if not isinstance(other, _OPERANDS):
            return NotImplemented
        other = self._operand(other)
        if len(self.terms) < len(other.terms):
            self, other = other, self
        terms = dict(self.terms)
        for monomial, value in other.terms.items():
            total = terms.get(monomial, 0) + value
            if total:
                terms[monomial] = exact(total)
            else:
                del terms[monomial]
        return Polynomial(self.ring, terms)

    __radd__ = __add__

    def __neg__(self) -> Polynomial:
        return Polynomial(self.ring, {monomial: -value for monomial, value in self.terms.items()})

    def __sub__(self, other: Any) -> Polynomial:
        if not isinstance(other, _OPERANDS):
            return NotImplemented
        return self + -self._operand(other)

    def __rsub__(self, other: Any) -> Polynomial:
        return -self + self._operand(other)

    def __mul__(self, other: Any) -> Polynomial:
        if not isinstance(other, _OPERANDS):
            return NotImplemented
        other = self._operand(other)
        if len(self.terms) * len(other.terms) > 20 * self.ring.budget:
            raise _too_large(self.ring, f"{len(self.terms)} x {len(other.terms)} terms")
        self.ring.effort -= len(self.terms) * len(other.terms)
        if self.ring.effort < 0:
            raise _too_large(self.ring, "more pairs of terms than the limit")
        if len(self.terms) == len(other.terms) == 1:
            ((m, v),), ((n, w),) = self.terms.items(), other.terms.items()
            return Polynomial(self.ring, {tuple(sorted(m + n)) if m and n else m or n: exact(v * w)})
        terms: dict[Monomial, int] = {}
        get = terms.get
        (left, p), (right, q) = _whole(self.terms), _whole(other.terms)
        for a, x in left:
            for b, y in right:
                monomial = tuple(sorted(a + b)) if a and b else a or b
                terms[monomial] = get(monomial, 0) + x * y
        result: dict[Monomial, Rational] = {}
        if p == q == 1:
            result.update((monomial, value) for monomial, value in terms.items() if value)
        else:
            result.update((monomial, exact(Fraction(value, p * q))) for monomial, value in terms.items() if value)
        if len(result) > self.ring.budget:
            raise _too_large(self.ring, f"{len(result)} terms")
        return Polynomial(self.ring, result)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Polynomial:
        divisor = self._operand(other)
        number = divisor.constant_value
        if number == 0:
            raise ZeroDivisorError("division", "the divisor is identically zero", "a divisor that can differ from zero")
        if number is not None:
            return self * (1 / Fraction(number))
        content = Fraction(divisor.terms[divisor.leading])
        return self * (1 / content) * self.ring.atom(Op.DIVIDE, self.ring.constant(1), divisor * (1 / content))

    def __rtruediv__(self, other: Any) -> Polynomial:
        return self._operand(other) / self

    def __eq__(self, other: object) -> bool:
        if isinstance(other, (int, Fraction)):
            return self.constant_value == other
        return isinstance(other, Polynomial) and self.terms == other.terms

    def __hash__(self) -> int:
        return hash(self.key)

    def scalar_function(self, name: str, arguments: tuple[Any, ...]) -> Polynomial:
        """Apply a scalar function; called by `gacompiler.algebra.coefficients.scalar_function`."""
        lifted = tuple(self.ring.lift(argument) for argument in arguments)
        numbers = [argument.constant_value for argument in lifted]
        if name == "select" and numbers[0] is not None:
            return lifted[1] if numbers[0] else lifted[2]
        if all(number is not None for number in numbers):
            try:
                return self.ring.constant(EXACT[name](*numbers))
            except InexactError:
                pass
        return self.ring.atom(Op(name), *lifted)

    def substitute(self, values: Mapping[int, Polynomial]) -> Polynomial:
        """Replace variables by polynomials."""
        result = self.ring.constant(0)
        kept: dict[Monomial, Rational] = {}
        for monomial, value in self.terms.items():
            if not any(variable in values for variable in monomial):
                kept[monomial] = value
                continue
            product = self.ring.constant(value)
            for variable in monomial:
                product = product * values.get(variable, Polynomial(self.ring, {(variable,): 1}))
            result = result + product
        return result + Polynomial(self.ring, kept)

    def _operand(self, other: Any) -> Polynomial:
        return other if isinstance(other, Polynomial) else self.ring.lift(other)

    def __str__(self) -> str:
        if not self.terms:
            return "0"
        text = " + ".join(_term(self.ring, monomial, value) for monomial, value in self.key)
        return text.replace("+ -", "- ")

    def __repr__(self) -> str:
        return f"Polynomial({self})"


def _too_large(ring: PolynomialRing, found: str) -> TooLargeError:
    error = TooLargeError("product of polynomials", found)
    error.left = max(0, ring.effort)
    return error


def _whole(terms: Mapping[Monomial, Rational]) -> tuple[Sequence[tuple[Monomial, int]], int]:
    """Return terms with integers in place of rational coefficients, and their common denominator.

    Sums of integers are several times faster than sums of fractions.
    """
    denominators = {value.denominator for value in terms.values() if type(value) is not int}
    if not denominators:
        return tuple(terms.items()), 1  # type: ignore[arg-type]
    common = lcm(*denominators)
    return tuple((m, value.numerator * (common // value.denominator)) for m, value in terms.items()), common


_OPERANDS = (Polynomial, int, float, Fraction)
"""Types of operands in arithmetic; other types may define the operation with a polynomial themselves."""


def _term(ring: PolynomialRing, monomial: Monomial, value: Rational) -> str:
    if not monomial:
        return str(value)
    powers: dict[int, int] = {}
    for variable in monomial:
        powers[variable] = powers.get(variable, 0) + 1
    text = "*".join(ring.name(variable) + (f"**{k}" if k > 1 else "") for variable, k in powers.items())
    return text if value == 1 else f"-{text}" if value == -1 else f"{value}*{text}"


def quotient(monomial: Monomial, divisor: Monomial) -> Monomial | None:
    """Return ``monomial / divisor``, or None if it is not a monomial."""
    rest = list(monomial)
    for variable in divisor:
        if variable not in rest:
            return None
        rest.remove(variable)
    return tuple(rest)


def total_terms(polynomials: Iterable[Polynomial]) -> int:
    """Return the total number of terms of several polynomials."""
    return sum(len(polynomial.terms) for polynomial in polynomials)
