"""Expanded sympy expressions as a ring: sums of products of powers, multiplied without sympy.

A *generator* is an expression that sympy does not expand: a symbol, ``sin(x)``, ``pi``, the base of a root, a sum whose
reciprocal occurs. A monomial is a tuple of generators with their exponents, which may be negative or fractions. Like
terms are collected in a dictionary, so products of sums are hundreds of times faster than in sympy. Reading, arithmetic
and substitution share the table of generators, and are one file.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction
from functools import cmp_to_key, lru_cache
from math import gcd, isfinite, lcm
from typing import Any

import sympy
from sympy.core.basic import Basic
from sympy.core.function import AppliedUndef
from sympy.core.sorting import default_sort_key

from ..algebra.blades import exact
from ..algebra.coefficients import scalar_function
from ..errors import AlgebraError, ZeroDivisorError

Number = int | Fraction | float
Monomial = tuple[tuple[int, "int | Fraction"], ...]
"""Numbers of generators and their exponents, by number."""

_generators: list[Any] = []
_numbers: dict[Any, int] = {}
_composite: set[int] = set()
"""Generators with relations of their own: numbers, the imaginary unit, sums and products under a root."""
_plain_generators: set[int] = set()
"""Generators whose products and sums sympy only sorts: symbols, most functions, and derivatives."""
_plain_divisors: set[int] = set()
"""Sums whose integer negative powers sympy only stores, and whose products with such powers it only sorts."""


def _generator(base: Any) -> int:
    number = _numbers.get(base)
    if number is None:
        number = _numbers[base] = len(_generators)
        _generators.append(base)
        if base is sympy.I or base.is_Number or base.is_Add or base.is_Mul:
            _composite.add(number)
        if base.is_commutative and _is_only_sorted(base):
            _plain_generators.add(number)
        elif base.is_Add and not base.has(sympy.I):
            _plain_divisors.add(number)
    return number


def _is_only_sorted(base: Any) -> bool:
    if isinstance(base, sympy.Function):
        return type(base)._eval_power is sympy.Expr._eval_power
    return isinstance(base, (sympy.Symbol, sympy.Derivative))


def _restored(rows: list[tuple[Number, list[tuple[Any, int | Fraction]]]]) -> Expanded:
    return Expanded({tuple(sorted((_generator(base), e) for base, e in powers)): value for value, powers in rows})


class Expanded:
    """An immutable expanded expression.

    Attributes
    ----------
    terms : mapping of monomial to number
        Numbers are int, Fraction or float (a sympy Float becomes a float), and never zero. Floats that are short binary
        fractions become fractions: 0.5 becomes 1/2.
    """

    __slots__ = ("_expression", "_reciprocal", "terms")

    def __init__(self, terms: Mapping[Monomial, Number]) -> None:
        self.terms = terms
        self._expression: Any = None
        self._reciprocal: Expanded | None = None

    @classmethod
    def of(cls, value: Any) -> Expanded:
        """Convert `value` to an element of this ring.

        Raises
        ------
        AlgebraError
            If it is not a scalar of sympy: an array, a matrix, a truth value, text, or an infinite number.
        """
        if isinstance(value, Expanded):
            return value
        if type(value) is int:
            return cls({(): value} if value else {})
        if isinstance(value, sympy.Expr) and not value.is_Matrix:
            return _read(value)
        if getattr(value, "shape", None) == () and hasattr(value, "item"):
            value = value.item()
        if isinstance(value, bool):
            raise _refusal(value, "write 0 or 1")
        if isinstance(value, (int, Fraction, float)):
            if isinstance(value, float) and not isfinite(value):
                raise _refusal(value, "")
            return cls({(): _short(value)} if value else {})
        if isinstance(value, complex):
            return cls.of(value.real) + cls.of(value.imag) * cls.of(sympy.I)
        if isinstance(value, (list, tuple)) or getattr(value, "dtype", None) is not None:
            raise _refusal(value, "derive with symbols first, then compile the formula: compiled kernels take arrays")
        remedy = "make a symbol of it: symbols(...)" if isinstance(value, str) else ""
        raise _refusal(value, remedy)

    @property
    def expression(self) -> Any:
        """The sympy expression."""
        if self._expression is None:
            self._expression = _sum_of_terms(self.terms)
        return self._expression

    @property
    def is_zero(self) -> bool:
        """Whether the expression has no terms, and is zero by its form."""
        return not self.terms

    def __bool__(self) -> bool:
        return bool(self.terms)

    def __add__(self, other: Any) -> Expanded:
        if type(other) is not Expanded:
            other = Expanded.of(other)
        if not (self.terms and other.terms):
            return self if self.terms else other
        terms = dict(self.terms)
        for monomial, value in other.terms.items():
            total = terms.get(monomial, 0) + value
            if total:
                terms[monomial] = total
            else:
                del terms[monomial]
        return Expanded(terms)

    __radd__ = __add__

    def __neg__(self) -> Expanded:
        return Expanded({monomial: -value for monomial, value in self.terms.items()})

    def __sub__(self, other: Any) -> Expanded:
        return self + -Expanded.of(other)

    def __rsub__(self, other: Any) -> Expanded:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Expanded:
        factor: Expanded = other if type(other) is Expanded else Expanded.of(other)
        first, second = self.terms, factor.terms
        if len(second) == 1 and () in second:
            return self._multiple(second[()])
        if len(first) == 1 and () in first:
            return factor._multiple(first[()])
        terms: dict[Monomial, Number] = {}
        left: list[Expanded] = []
        get = terms.get
        for a, x in first.items():
            for b, y in second.items():
                monomial, whole = _times(a, b)
                if whole is None:
                    terms[monomial] = get(monomial, 0) + x * y
                else:
                    left.append(whole * _plain(x * y))
        result = Expanded({monomial: _plain(value) for monomial, value in terms.items() if value})
        for each in left:
            result = result + each
        return result

    __rmul__ = __mul__

    def _multiple(self, factor: Number) -> Expanded:
        if type(factor) is int and factor in (1, -1):
            return self if factor == 1 else -self
        products = {monomial: _plain(value * factor) for monomial, value in self.terms.items()}
        return Expanded({monomial: value for monomial, value in products.items() if value})

    def __truediv__(self, other: Any) -> Expanded:
        divisor = Expanded.of(other)
        if not divisor.terms:
            raise ZeroDivisorError("division", f"{self} / 0", "a divisor that can differ from zero")
        if len(divisor.terms) > 1:
            ratio = self._ratio(divisor)
            if ratio is not None:
                return Expanded({(): ratio} if ratio else {})
        elif () in divisor.terms:
            return self._multiple(_quotient(1, divisor.terms[()]))
        return self * divisor.power(-1)

    def __rtruediv__(self, other: Any) -> Expanded:
        return Expanded.of(other) / self

    def _ratio(self, divisor: Expanded) -> Number | None:
        """Return the number by which this is a multiple of `divisor`, or None."""
        if self.terms.keys() != divisor.terms.keys():
            return None
        ratios = {_quotient(value, divisor.terms[monomial]) for monomial, value in self.terms.items()}
        return ratios.pop() if len(ratios) == 1 else None

    def power(self, exponent: int) -> Expanded:
        """Return this element to an integer power, which may be negative."""
        if exponent >= 0:
            result = Expanded({(): 1})
            for _ in range(exponent):
                result = result * self
            return result
        if exponent == -1 and self._reciprocal is not None:
            return self._reciprocal
        found = self._negative_power(exponent)
        if exponent == -1:
            self._reciprocal = found
        return found

    def _negative_power(self, exponent: int) -> Expanded:
        if not self.terms:
            raise ZeroDivisorError("division", "1 / 0", "a divisor that can differ from zero")
        if len(self.terms) == 1:
            ((monomial, value),) = self.terms.items()
            inverted = tuple((g, -e) for g, e in monomial)
            factor = Expanded({(): _quotient(1, value) ** -exponent})
            return term(inverted).power(-exponent) * factor
        common = self._common()
        if common.terms.keys() != {()}:
            return (self * common.power(-1)).power(exponent) * common.power(exponent)
        content, primitive = self._content_and_primitive()
        if primitive.is_Add:
            return Expanded({((_generator(primitive), exponent),): _power_of_number(_number(content), exponent)})
        return _read(primitive).power(exponent) * Expanded.of(content**exponent)

    def _content_and_primitive(self) -> tuple[Any, Any]:
        """Return a rational content and the rest, of which sympy does not extract a minus sign.

        For plain generators this is what `sympy.Expr.as_content_primitive` finds, without its search for factors.
        """
        if not _is_plain(self.terms):
            content, primitive = self.expression.as_content_primitive()
            return (-content, -primitive) if primitive.could_extract_minus_sign() else (content, primitive)
        values = [Fraction(value) for value in self.terms.values()]
        exact_content = Fraction(gcd(*(x.numerator for x in values)), lcm(*(x.denominator for x in values)))
        primitive = self._multiple(exact(1 / exact_content))
        negative = sum(x < 0 for x in values)
        is_tie = 2 * negative == len(values)
        if primitive.expression.could_extract_minus_sign() if is_tie else 2 * negative > len(values):
            exact_content, primitive = -exact_content, -primitive
        return _sympy_number(exact_content), primitive.expression

    def _common(self) -> Expanded:
        """Return the product of powers that divides every term, so that ``1 - 2 m / r`` becomes ``(r - 2 m) / r``.

        The same denominator then has the same form wherever it occurs.
        """
        lowest = dict(next(iter(self.terms)))
        for monomial in self.terms:
            powers = dict(monomial)
            lowest = {g: min(lowest.get(g, 0), powers.get(g, 0)) for g in {**lowest, **powers}}
        found = sorted((g, e) for g, e in lowest.items() if e and g not in _composite)
        return Expanded({tuple(found): 1})

    def substitute(self, values: Mapping[Any, Any]) -> Expanded:
        """Replace symbols by expressions, simultaneously.

        Raises
        ------
        ZeroDivisorError
            If a denominator becomes zero.
        """
        known: dict[tuple[int, Any], Expanded] = {}
        total = Expanded({})
        for monomial, value in self.terms.items():
            product = Expanded({(): value})
            for g, e in monomial:
                if (g, e) not in known:
                    known[g, e] = _substituted(_generators[g], e, values)
                product = product * known[g, e]
            total = total + product
        return total

    def derivative(self, variable: Any) -> Expanded:
        """Return the derivative by a symbol, by the product rule; only generators are differentiated by sympy."""
        total = Expanded({})
        for monomial, value in self.terms.items():
            for k, (g, e) in enumerate(monomial):
                inner = _derivative(_generators[g], variable)
                if not inner.terms:
                    continue
                before, after, factor = monomial[:k], monomial[k + 1 :], _plain(value * e)
                lowered = ((g, exact(e - 1)),) if e != 1 else ()
                if lowered and g in _composite:
                    # Read as a product, since powers of sums and numbers have forms of their own.
                    rest = term(lowered) * Expanded({before + after: factor})
                else:
                    rest = Expanded({before + lowered + after: factor})
                total = total + rest * inner
        return total

    def __eq__(self, other: object) -> bool:
        if type(other) is int:
            return self.terms == ({(): other} if other else {})
        try:
            return dict(self.terms) == dict(Expanded.of(other).terms)
        except AlgebraError:
            return NotImplemented

    def __hash__(self) -> int:
        return hash(self.terms.get((), 0) if self.terms.keys() <= {()} else frozenset(self.terms.items()))

    def __reduce__(self) -> tuple[Any, ...]:
        rows = [(value, [(_generators[g], e) for g, e in monomial]) for monomial, value in self.terms.items()]
        return _restored, (rows,)  # the numbers of generators are valid only in this process

    def scalar_function(self, name: str, arguments: tuple[Any, ...]) -> Expanded:
        """Apply a scalar function; called by `gacompiler.algebra.coefficients.scalar_function`."""
        lifted = [Expanded.of(argument).expression for argument in arguments]
        return Expanded.of(sympy.sympify(scalar_function(name, *lifted)))

    def _sympy_(self) -> Any:
        return self.expression

    def __str__(self) -> str:
        return str(self.expression)

    def __repr__(self) -> str:
        return f"Expanded({self})"


_canonical = cmp_to_key(Basic.compare)
"""The order of the arguments of sums and products in sympy."""


def _sum_of_terms(terms: Mapping[Monomial, Number]) -> Any:
    """Return a sympy expression. Terms without relations are sorted here, since `sympy.Add` would look for them."""
    if not _is_plain(terms, _plain_divisors):
        return sympy.Add(
            *(
                sympy.Mul(_sympy_number(value), *(_power(_generators[g], e) for g, e in monomial))
                for monomial, value in terms.items()
            )
        )
    found = [_plain_product(value, monomial) for monomial, value in terms.items() if monomial]
    if len(found) > 1:
        found.sort(key=_canonical)
    if () in terms:
        found.insert(0, _sympy_number(terms[()]))
    return sympy.Add._from_args(found, is_commutative=True)


def _is_plain(terms: Mapping[Monomial, Any], divisors: Collection[int] = ()) -> bool:
    """Return whether the numbers are exact and all generators plain, or negative powers of `divisors`."""
    for monomial, value in terms.items():
        if type(value) is float:
            return False
        for g, e in monomial:
            if g not in _plain_generators and not (g in divisors and type(e) is int and e < 0):
                return False
    return True


def _plain_product(value: Number, monomial: Monomial) -> Any:
    found = [
        # The integer power of a generator without a value of its own is only stored.
        _generators[g] if e == 1 else sympy.Pow(_generators[g], _sympy_number(e), evaluate=type(e) is not int)
        for g, e in monomial
    ]
    if len(found) > 1:
        found.sort(key=_canonical)
    if value != 1:
        found.insert(0, _sympy_number(value))
    return sympy.Mul._from_args(found, is_commutative=True)


def _power(base: Any, exponent: int | Fraction) -> Any:
    """Return a power of a generator. A power of an exponential multiplies its argument, without a choice of branch."""
    if isinstance(base, sympy.exp):
        return sympy.exp(base.exp * _sympy_number(exponent))
    return sympy.Pow(base, _sympy_number(exponent))


def _substituted(base: Any, exponent: int | Fraction, values: Mapping[Any, Any]) -> Expanded:
    if base.is_Symbol and base not in values:
        return Expanded({((_generator(base), exponent),): 1})
    replaced = values[base] if base in values else base.subs(values, simultaneous=True)
    if isinstance(exponent, int):
        return Expanded.of(replaced).power(exponent)
    if isinstance(base, sympy.exp):
        return Expanded.of(sympy.exp(base.exp.subs(values, simultaneous=True) * _sympy_number(exponent)))
    return Expanded.of(sympy.Pow(replaced, _sympy_number(exponent)))


def generators(*elements: Expanded) -> tuple[int, ...]:
    """Return the numbers of the generators that occur, in ascending order."""
    return tuple(sorted({g for each in elements for monomial in each.terms for g, _ in monomial}))


def generator(number: int) -> Any:
    """Return the sympy expression of a generator."""
    return _generators[number]


def term(monomial: Monomial, value: Number = 1) -> Expanded:
    """Return a number times a product of powers of generators, where powers of numbers and sums are evaluated."""
    found = _evaluated(monomial)
    return Expanded({monomial: value}) if found is None else found._multiple(value)


def _times(a: Monomial, b: Monomial) -> tuple[Monomial, Expanded | None]:
    """Return the product of two monomials, and the element that it reduces to if powers of generators simplify."""
    if not (a and b):
        return a or b, None
    if a[-1][0] < b[0][0]:
        return a + b, None
    if b[-1][0] < a[0][0]:
        return b + a, None
    powers = dict(a)
    for g, e in b:
        total = powers.get(g, 0) + e
        if total:
            powers[g] = exact(total)
        else:
            del powers[g]
    product = tuple(sorted(powers.items()))
    return product, _evaluated(product)


def _evaluated(monomial: Monomial) -> Expanded | None:
    """Return the element that a monomial reduces to if powers of its generators simplify, or None."""
    return _resolved(monomial) if _composite and any(g in _composite for g, _ in monomial) else None


def _resolved(monomial: Monomial) -> Expanded | None:
    """Return a monomial with the powers of its composite generators evaluated, or None if there are none."""
    rest: list[tuple[int, int | Fraction]] = []
    factor = Expanded({(): 1})
    changed = False
    for g, e in monomial:
        base = _generators[g]
        whole = e.numerator // e.denominator
        if g not in _composite:
            rest.append((g, e))
        elif base is sympy.I:
            turn = whole % 4
            changed |= e not in (0, 1)
            factor = factor * (-1 if turn & 2 else 1)
            if turn & 1:
                rest.append((g, 1))
        elif base.is_Number:
            changed |= whole != 0
            factor = factor * _power_of_number(_number(base), whole)
            if e != whole:
                rest.append((g, e - whole))
        elif e == whole and (whole > 0 or base.is_Mul):
            changed = True
            factor = factor * _read(base).power(whole)
        else:
            rest.append((g, e))
    return factor * Expanded({tuple(rest): 1}) if changed else None


def _power_of_number(base: Number, exponent: int) -> Number:
    return _plain(Fraction(base) ** exponent) if isinstance(base, (int, Fraction)) else base**exponent


def _plain(value: Number) -> Number:
    return value if isinstance(value, (int, float)) else exact(value)


def _quotient(a: Number, b: Number) -> Number:
    return _plain(Fraction(a) / b) if isinstance(a, (int, Fraction)) and isinstance(b, (int, Fraction)) else a / b


def _number(value: Any) -> Number:
    if value.is_Rational:
        return exact(Fraction(int(value.p), int(value.q)))
    return _short(float(value))


def _short(value: Number) -> Number:
    """Convert a float that is a short binary fraction, such as 0.5, to an exact number."""
    if isinstance(value, float):
        numerator, denominator = value.as_integer_ratio()
        if denominator <= SHORT and abs(numerator) <= SHORT * SHORT:
            return exact(Fraction(numerator, denominator))
    return value


SHORT = 1024
"""Maximum denominator of floats that are converted to exact fractions."""


def _sympy_number(value: Number) -> Any:
    if type(value) is int:
        return sympy.Integer(value)
    return sympy.Rational(value.numerator, value.denominator) if isinstance(value, Fraction) else sympy.sympify(value)


@lru_cache(maxsize=4096)
def _derivative(generator: Any, variable: Any) -> Expanded:
    if generator == variable:
        return Expanded({(): 1})
    if generator.is_Symbol or variable not in generator.free_symbols:
        return Expanded({})
    if generator.func in _DERIVATIVES:
        function, sign = _DERIVATIVES[generator.func]
        return Expanded.of(function(*generator.args)) * _read(generator.args[0]).derivative(variable) * sign
    if isinstance(generator, sympy.log) and generator.args == (variable,):
        return _read(variable).power(-1)
    unknown = generator.expr if isinstance(generator, sympy.Derivative) else generator
    if isinstance(unknown, AppliedUndef) and _has_distinct_symbols(unknown):
        return Expanded({((_generator(_derivative_of_unknown(unknown, generator, variable)), 1),): 1})
    if generator.is_Add:
        return _read(generator).derivative(variable)
    return Expanded.of(sympy.diff(generator, variable))


_DERIVATIVES = {
    sympy.sin: (sympy.cos, 1), sympy.cos: (sympy.sin, -1), sympy.sinh: (sympy.cosh, 1), sympy.cosh: (sympy.sinh, 1),
    sympy.exp: (sympy.exp, 1),
}  # fmt: skip


def _has_distinct_symbols(unknown: Any) -> bool:
    """Return whether all arguments of an unknown function are different symbols."""
    return all(each.is_Symbol for each in unknown.args) and len(set(unknown.args)) == len(unknown.args)


def _derivative_of_unknown(unknown: Any, generator: Any, variable: Any) -> Any:
    """Return what `sympy.diff` returns, without its search for equal variables: that takes most of its time."""
    counts = dict(generator.variable_count) if generator is not unknown else {}
    counts[variable] = counts.get(variable, 0) + 1
    ordered = sorted(counts, key=default_sort_key) if len(counts) > 1 else counts
    return Basic.__new__(sympy.Derivative, unknown, *(sympy.Tuple(each, counts[each]) for each in ordered))


@lru_cache(maxsize=4096)
def _read(value: Any) -> Expanded:
    """Convert a sympy expression to a sum of products of powers."""
    if value.is_Rational or value.is_Float:
        number = _number(value)
        return Expanded({(): number} if number else {})
    if value in (sympy.nan, sympy.zoo, sympy.oo, -sympy.oo) or not value.is_commutative:
        raise _refusal(value, "")
    if value.is_Add or value.is_Mul:
        parts = map(_read, value.args)
        result = next(parts)
        for part in parts:
            result = result + part if value.is_Add else result * part
        return result
    if isinstance(value, sympy.exp) or value.is_Pow:
        return _read_power(value)
    result = Expanded({((_generator(value), 1),): 1})
    result._expression = value
    return result


def _read_power(value: Any) -> Expanded:
    base, exponent = value.as_base_exp()
    if not exponent.is_Rational:
        return _read_exponential(base, exponent)
    power = exact(Fraction(int(exponent.p), int(exponent.q)))
    if isinstance(power, int):
        return _read(base).power(power)
    if not base.is_Number:
        base = _read(base).expression
        if base.is_Pow or isinstance(base, sympy.exp):
            return Expanded(
                {((_generator(sympy.Pow(base, sympy.Rational(1, power.denominator))), power.numerator),): 1}
            )
    return term(((_generator(base), power),))


def _read_exponential(base: Any, whole: Any) -> Expanded:
    """Convert ``b**(2 u + v)`` to ``(b**u)**2 b**v``, so that exponentials of opposite arguments cancel."""
    result = Expanded({(): 1})
    for part in sympy.Add.make_args(sympy.expand(whole)):
        factor, rest = part.as_coeff_Mul()
        if not (factor.is_Integer or (factor.is_Rational and base is sympy.E)):
            factor, rest = (sympy.Integer(-1), -part) if part.could_extract_minus_sign() else (sympy.Integer(1), part)
        exponent = exact(Fraction(int(factor.p), int(factor.q)))
        result = result * term(((_generator(sympy.Pow(base, rest)), exponent),))
    return result


def _refusal(value: Any, remedy: str) -> AlgebraError:
    shape = getattr(value, "shape", None)
    found = f"an array of shape {shape}" if hasattr(value, "dtype") else f"{value!r} ({type(value).__name__})"
    return AlgebraError("symbolic coefficient", found, "a number or a sympy expression", remedy)
