"""Multivectors whose coefficients are sympy expressions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import sympy
from sympy.simplify.fu import TR8

from ..algebra.algebra import Algebra
from ..algebra.immutable import Immutable
from ..algebra.layout import SCALARS, Layout
from ..algebra.multivector import Multivector, added, signed
from ..algebra.operations import BY_NAME, Operation
from ..algebra.products import product
from ..errors import AlgebraError
from ..rings.symbolic import Expanded
from .printing import Printed, plain_text

Terms = Mapping[int, Expanded]
History = tuple[Operation, tuple[Any, ...]] | None


class SymbolicMultivector(Immutable, Multivector):
    """An immutable element of `algebra` with sympy coefficients, created by `symbols`, `multivector` or operations.

    Attributes
    ----------
    name : str or None
        The name given to `symbols`.
    layout : Layout or None
        The layout given to `symbols`. It determines which coefficients are symbols, and its relations hold.
    expressions : mapping of int to sympy expression
        The displayed coefficients, by bitmap of the blade. After `factor` or `simplify` they have the form that sympy
        returned; arithmetic uses the expanded form.
    history : tuple or None
        The operation and the operands that produced this element. `to_kernel` uses it to preserve the structure of the
        derivation. It is dropped by methods that change individual coefficients, such as `subs` and `simplify`.

    Notes
    -----
    The operators are those of `Multivector`. They accept numbers, sympy expressions and multivectors of the same
    algebra on either side. ``x["e12"]`` is a coefficient as a sympy expression.
    """

    __slots__ = ("_in_own_form", "_shown", "history", "layout", "name")

    name: str | None
    layout: Layout | None
    history: History
    _shown: Mapping[int, Any] | None
    _in_own_form: bool
    _run_operation: ClassVar[Callable[..., Any]]
    """Applies an operation of the kernel language by name; supplied by `gacompiler.symbolic.functions`."""

    def __init__(
        self,
        algebra: Algebra,
        terms: Mapping[int, Any],
        *,
        name: str | None = None,
        layout: Layout | None = None,
        shown: Mapping[int, Any] | None = None,
        history: History = None,
    ) -> None:
        self._fill(algebra, {blade: Expanded.of(value) for blade, value in terms.items()}, history, name, layout)
        if shown is not None:
            object.__setattr__(self, "_in_own_form", True)
            object.__setattr__(self, "_shown", MappingProxyType(dict(shown)))

    @classmethod
    def of_ring(cls, algebra: Algebra, terms: Terms, history: History = None) -> SymbolicMultivector:
        """Return the element with coefficients of the ring of expanded expressions, without converting them."""
        result = object.__new__(cls)
        result._fill(algebra, terms, history)
        return result

    def _fill(self, algebra: Algebra, terms: Terms, history: History, name: Any = None, layout: Any = None) -> None:
        set_, blades = object.__setattr__, sorted(terms) if len(terms) > 1 else terms
        set_(self, "algebra", algebra)
        set_(self, "terms", MappingProxyType({blade: value for blade in blades if (value := terms[blade]).terms}))
        set_(self, "name", name)
        set_(self, "layout", layout)
        set_(self, "history", history)
        set_(self, "_in_own_form", False)
        set_(self, "_shown", None)

    @property
    def expressions(self) -> Mapping[int, Any]:
        """Coefficients as sympy expressions, by bitmap of the blade, ordered by grade."""
        if self._shown is None:
            order = sorted(self.terms, key=lambda blade: (blade.bit_count(), blade))
            shown = MappingProxyType({blade: self.terms[blade].expression for blade in order})
            object.__setattr__(self, "_shown", shown)
        assert self._shown is not None
        return self._shown

    @property
    def coefficients(self) -> dict[str, Any]:
        """Nonzero coefficients as sympy expressions, by name of the blade."""
        return {self.algebra.spelling(blade)[1]: self._oriented(blade) for blade in self.expressions}

    def _oriented(self, blade: int) -> Any:
        value = self.expressions[blade]
        return value if self.algebra.spelling(blade)[0] > 0 else -value

    def __getitem__(self, blade: str | int) -> Any:
        """Return the coefficient of a blade, given by any spelling (``"e31"``) or by bitmap, as a sympy expression."""
        sign, bitmap = self.algebra.blade(blade) if isinstance(blade, str) else (1, blade)
        return sign * self.expressions.get(bitmap, sympy.Integer(0))

    @property
    def scalar(self) -> Any:
        """The scalar coefficient as a sympy expression."""
        return self["1"]

    @property
    def free_symbols(self) -> set[Any]:
        """The sympy symbols that occur in the coefficients."""
        return {symbol for value in self.expressions.values() for symbol in value.free_symbols}

    def lift(self, other: Any) -> SymbolicMultivector:
        """Convert a multivector, or a number or sympy expression as a scalar, to a multivector of this algebra."""
        if isinstance(other, SymbolicMultivector) and (other.algebra is self.algebra or other.algebra == self.algebra):
            return other
        if isinstance(other, Multivector):
            terms = other.terms if other.algebra == SCALARS else super().lift(other).terms
            return SymbolicMultivector(self.algebra, terms)
        if getattr(other, "_takes_over_multivector", False) is True:
            raise AlgebraError(
                "operation on a symbolic multivector",
                f"{other} of type {type(other).__name__}",
                "numbers, sympy expressions and symbolic multivectors",
                "convert the formula to a kernel with to_kernel(), and call the kernel",
            )
        return SymbolicMultivector(self.algebra, {0: other})

    def map(self, function: Callable[[Any], Any]) -> SymbolicMultivector:
        """Apply `function` to every coefficient, a sympy expression, and display the result in the returned form.

        Examples
        --------
        ``x.map(sympy.trigsimp)``, ``x.map(lambda c: sympy.limit(c, t, 0))``
        """
        shown = {blade: sympy.sympify(function(value)) for blade, value in self.expressions.items()}
        kept = {blade: value for blade, value in shown.items() if value != 0}
        result = SymbolicMultivector(self.algebra, kept, shown=kept)
        return result if result.terms.keys() == kept.keys() else SymbolicMultivector(self.algebra, result.terms)

    def simplify(self) -> SymbolicMultivector:
        """Simplify every coefficient with `sympy.simplify`."""
        return self.map(sympy.simplify)

    def expand(self) -> SymbolicMultivector:
        """Expand every coefficient."""
        return self.of_ring(self.algebra, self.terms)

    def factor(self) -> SymbolicMultivector:
        """Factor every coefficient with `sympy.factor`; see `factored` for the common factor of all coefficients."""
        return self.map(sympy.factor)

    def collect(self, *variables: Any) -> SymbolicMultivector:
        """Collect the powers of `variables` in every coefficient."""
        return self.map(lambda value: sympy.collect(sympy.expand(value), variables))

    def combine_angles(self) -> SymbolicMultivector:
        """Rewrite products of sines and cosines as sums: ``sin(a) cos(b) = (sin(a + b) + sin(a - b)) / 2``."""
        return self.map(lambda value: sympy.expand(TR8(sympy.expand(value))))

    def subs(self, values: Any, value: Any = None) -> SymbolicMultivector:
        """Replace symbols simultaneously.

        Parameters
        ----------
        values : mapping, Symbol or SymbolicMultivector
            A mapping from symbols, or multivectors made by `symbols`, to their replacements; or a single symbol or
            multivector.
        value
            The replacement of a single symbol or multivector.

        Raises
        ------
        LayoutError
            When a replacement multivector does not fit the layout of the original.
        """
        pairs = list(values.items()) if isinstance(values, Mapping) else [(values, value)]
        replaced: dict[Any, Any] = {}
        for old, new in pairs:
            if isinstance(old, str):
                raise AlgebraError("subs()", f"the name {old!r}", "a symbol, or a multivector made by symbols()")
            if _named(old):
                replaced |= replacements(old, new)
            else:
                replaced[sympy.sympify(old)] = Expanded.of(new).expression
        if self._in_own_form:
            return self.map(lambda each: each.subs(replaced, simultaneous=True))
        return self.of_ring(self.algebra, {b: v.substitute(replaced) for b, v in self.terms.items()})

    def diff(self, *variables: Any) -> SymbolicMultivector:
        """Differentiate with respect to scalar symbols, with the arguments of `sympy.diff`."""
        if len(variables) == 1 and isinstance(variables[0], sympy.Symbol):
            return self.of_ring(self.algebra, {b: v.derivative(variables[0]) for b, v in self.terms.items()})
        return SymbolicMultivector(self.algebra, {b: sympy.diff(v, *variables) for b, v in self.expressions.items()})

    def integrate(self, *variables: Any) -> SymbolicMultivector:
        """Integrate over scalar symbols, with the arguments of `sympy.integrate`: ``x`` or ``(x, 0, 1)``."""
        return self.map(lambda value: sympy.integrate(value, *variables))

    def series(self, variable: Any, about: Any = 0, n: int = 6) -> SymbolicMultivector:
        """Return the Taylor polynomial of degree less than `n` in a scalar symbol, without the remainder."""
        return self.map(lambda value: sympy.series(value, variable, about, n).removeO())

    def numeric(self, digits: int = 15) -> SymbolicMultivector:
        """Evaluate constants such as ``pi`` and ``sqrt(2)`` to floating-point numbers."""
        return self.map(lambda value: value.evalf(digits))

    def factored(self) -> Printed:
        """Return a printable form with the common factor of all coefficients in front."""
        return Printed(self, "factored")

    def by_grade(self) -> Printed:
        """Return a printable form with one line for each grade."""
        return Printed(self, "grade")

    def by_blade(self) -> Printed:
        """Return a printable form with one line for each blade."""
        return Printed(self, "blade")

    def grade(self, *grades: int) -> SymbolicMultivector:
        """Return the part of the given grades."""
        return symbolic(self.keep(lambda blade: blade.bit_count() in grades), Operation.GRADE, self, *grades)

    def keep(self, predicate: Callable[[int], bool]) -> SymbolicMultivector:
        """Return the part on the blades (bitmaps) for which `predicate` holds."""
        return self.of_ring(self.algebra, {blade: value for blade, value in self.terms.items() if predicate(blade)})

    def product(self, name: str, other: Multivector) -> SymbolicMultivector:
        """Return the named product with `other`: the geometric product, a part of its grades, or a commutator."""
        lifted = self.lift(other)
        terms = product(self.algebra, name, self.terms, lifted.terms)
        return self.of_ring(self.algebra, terms, (BY_NAME[name], (self, lifted)))

    def __add__(self, other: Any) -> SymbolicMultivector:
        if _acts(other):
            return NotImplemented
        lifted = self.lift(other)
        return self.of_ring(self.algebra, added(self.terms, lifted.terms), (Operation.ADD, (self, lifted)))

    def __radd__(self, other: Any) -> SymbolicMultivector:
        return self.lift(other) + self

    def __sub__(self, other: Any) -> SymbolicMultivector:
        if _acts(other):
            return NotImplemented
        lifted = self.lift(other)
        terms = added(self.terms, signed(lifted.terms, lambda _: -1))
        return self.of_ring(self.algebra, terms, (Operation.SUBTRACT, (self, lifted)))

    def __rsub__(self, other: Any) -> SymbolicMultivector:
        return self.lift(other) - self

    def __neg__(self) -> SymbolicMultivector:
        return self.of_ring(self.algebra, signed(self.terms, lambda _: -1), (Operation.NEGATE, (self,)))

    def __pos__(self) -> SymbolicMultivector:
        return self

    def __mul__(self, other: Any) -> SymbolicMultivector:
        return NotImplemented if _acts(other) else self.product(Operation.GEOMETRIC_PRODUCT, other)

    def __rmul__(self, other: Any) -> SymbolicMultivector:
        return self.lift(other) * self

    def __xor__(self, other: Any) -> SymbolicMultivector:
        return NotImplemented if _acts(other) else self.product(Operation.OUTER_PRODUCT, other)

    def __rxor__(self, other: Any) -> SymbolicMultivector:
        return self.lift(other) ^ self

    def __or__(self, other: Any) -> SymbolicMultivector:
        return NotImplemented if _acts(other) else self.product(Operation.INNER_PRODUCT, other)

    def __and__(self, other: Any) -> SymbolicMultivector:
        lifted = self.lift(other)
        return symbolic(super().__and__(lifted), Operation.REGRESSIVE_PRODUCT, self, lifted)

    def __rand__(self, other: Any) -> SymbolicMultivector:
        return self.lift(other) & self

    def __truediv__(self, other: Any) -> SymbolicMultivector:
        lifted = self.lift(other)
        if lifted.terms.keys() != {0}:
            quotient = Multivector(self.algebra, self.terms) / Multivector(self.algebra, lifted.terms)
            return symbolic(quotient, Operation.DIVIDE, self, lifted)
        terms = {blade: value / lifted.terms[0] for blade, value in self.terms.items()}
        return self.of_ring(self.algebra, terms, (Operation.DIVIDE, (self, lifted)))

    def __rtruediv__(self, other: Any) -> SymbolicMultivector:
        return self.lift(other) / self

    def __pow__(self, exponent: int) -> SymbolicMultivector:
        return symbolic(super().__pow__(exponent))

    def __invert__(self) -> SymbolicMultivector:
        return self.of_ring(self.algebra, signed(self.terms, self.algebra.reverse_sign), (Operation.REVERSE, (self,)))

    def __eq__(self, other: object) -> bool:
        """Compare the expanded coefficients; the function `equal` of this package also applies identities."""
        try:
            return not (self - self.lift(other)).terms
        except AlgebraError:
            return False

    __hash__ = Multivector.__hash__

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (_rows(self),)

    def _sympy_(self) -> Any:
        raise sympy.SympifyError(
            "a multivector is not a sympy expression; use its methods such as x.simplify(), or x.map(function)"
        )

    def __str__(self) -> str:
        return plain_text(self)

    def _repr_latex_(self) -> str:
        return Printed(self, "line")._repr_latex_()


def _rows(value: SymbolicMultivector) -> list[tuple[Any, ...]]:
    """Return one row for `value` and for each multivector that it was derived from, for pickling.

    A history can be long, and pickling it recursively would exceed the recursion limit. The rows therefore contain no
    references to multivectors: an operand that has its own row is represented by the number of that row.
    """
    places: dict[int, int] = {}
    rows: list[tuple[Any, ...]] = []
    waiting = [value]
    while waiting:
        each = waiting[-1]
        operation, operands = each.history or (None, ())
        before = [x for x in operands if isinstance(x, SymbolicMultivector) and id(x) not in places]
        if before and id(each) not in places:
            waiting += before
            continue
        waiting.pop()
        if id(each) not in places:
            derived = [(isinstance(x, SymbolicMultivector), places.get(id(x), x)) for x in operands]
            shown = dict(each.expressions) if each._in_own_form else None
            places[id(each)] = len(rows)
            rows.append((each.algebra, dict(each.terms), each.name, each.layout, shown, operation, derived))
    return rows


def _restored(rows: list[tuple[Any, ...]]) -> SymbolicMultivector:
    made: list[SymbolicMultivector] = []
    for algebra, terms, name, layout, shown, operation, derived in rows:
        operands = tuple(made[operand] if is_row else operand for is_row, operand in derived)
        history = None if operation is None else (operation, operands)
        made.append(SymbolicMultivector(algebra, terms, name=name, layout=layout, shown=shown, history=history))
    return made[-1]


def symbolic(value: Multivector, operation: Operation | None = None, *operands: Any) -> SymbolicMultivector:
    """Convert `value` to sympy coefficients, and record it as the result of `operation` on `operands` if given."""
    history = None if operation is None else (operation, operands)
    if not isinstance(value, SymbolicMultivector):
        return SymbolicMultivector(value.algebra, value.terms, history=history)
    return value if history is None else value.of_ring(value.algebra, value.terms, history)


def required(where: str, value: Any) -> SymbolicMultivector:
    """Convert `value` to a symbolic multivector. Numbers have no algebra and are rejected."""
    if not isinstance(value, Multivector):
        raise AlgebraError(where, f"{value!r} of type {type(value).__name__}", "a multivector", "use multivector(...)")
    return symbolic(value)


def replacements(old: SymbolicMultivector, new: Any) -> dict[Any, Any]:
    """Return a mapping from the symbol of every stored coefficient of a named multivector to its replacement."""
    assert old.layout is not None
    lifted = old.lift(new)
    names = [old[name] for name in old.layout.blades]
    return {
        name: Expanded.of(value).expression
        for name, value in zip(names, old.layout.coefficients(Multivector(old.algebra, lifted.terms)), strict=True)
    }


def _named(value: Any) -> bool:
    return isinstance(value, SymbolicMultivector) and value.layout is not None


def _acts(other: Any) -> bool:
    """Return whether `other` is an operator on fields, whose own methods define sums and products."""
    # Of the class: for an instance of a multivector without it, similar names of methods would be searched for.
    return getattr(type(other), "acts_on_fields", False) is True
