"""Compile expressions with kingdon, and count the operations of its generated code.

Each node is translated to an operator of kingdon, which simplifies the result. kingdon supports only orthogonal
vectors. If an algebra has null vectors, an expression is tried in two forms: in the coefficients of gacompiler, with a
change of basis before and after, and, if the layouts allow it, in the coefficients of kingdon. The lower count is used.
The rules for counting are those of gacompiler: negations are free, and a division by a constant is a product.
"""

from __future__ import annotations

import ast
import inspect
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.layout import SCALARS, Layout
from gacompiler.frontend.expression import Expression, topological
from gacompiler.frontend.facts import is_unit, parity
from gacompiler.frontend.kernel import Kernel, trace

Sum = dict[int, Any]
"""Coefficients, with the bitmap of the blade as key."""


@dataclass(frozen=True, slots=True)
class Count:
    """The operations of the code that kingdon generates.

    Attributes
    ----------
    mul, add, div : int
    seconds : float
        Time from symbols to function.
    function : callable
        Takes one sequence of numbers: the inputs in order, each blade in ascending orientation.
    factors : tuple of int
        Factors of the results. They make all coefficients integers, because the simplification requires it.
    """

    mul: int
    add: int
    div: int
    seconds: float
    function: Callable[[Sequence[float]], Sequence[float]]
    factors: tuple[int, ...]


class Unsupported(Exception):
    """An operation that the polynomials of kingdon do not support, such as a square root."""


def count(kernel: Kernel) -> Count:
    """Compile `kernel` with kingdon in each possible form, and return the lowest count.

    Raises
    ------
    Unsupported
        If the expression is not a rational function.
    """
    algebra = _algebra_of(trace(kernel).expressions)
    variants = (False, True) if algebra != SCALARS and Vectors(algebra).are_changed else (False,)
    return min((compile_kernel(kernel, own) for own in variants), key=lambda found: found.mul + found.add + found.div)


def compile_kernel(kernel: Kernel, own: bool = False) -> Count:
    """Compile `kernel` with kingdon, in the coefficients of gacompiler or, with `own`, in its own if possible."""
    from kingdon import Algebra as Peer
    from kingdon.codegen import lambdify

    expressions = trace(kernel).expressions
    vectors = Vectors(_algebra_of(expressions))
    peer = Peer(signature=list(vectors.signature), start_index=1)
    start = time.perf_counter()
    translation = Translation(vectors, peer, own)
    results = [value for expression in expressions for value in translation.results(expression)]
    names = [_symbol(name) for parameter in kernel.parameters for name in parameter.components]
    polynomials, factors = [polynomial for polynomial, _ in results], tuple(factor for _, factor in results)
    function = lambdify({"inputs": names}, polynomials, funcname=kernel.name, cse=True)
    seconds = time.perf_counter() - start
    return Count(*_operations(inspect.getsource(function)), seconds, function, factors)


def _operations(text: str) -> tuple[int, int, int]:
    """Count products, sums and divisions in Python source."""
    mul = add = div = 0
    tree = ast.parse(text)
    numbers = {
        target.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp):
            match node.op:
                case ast.Mult():
                    mul += 1
                case ast.Add() | ast.Sub():
                    add += 1
                case ast.Div() if isinstance(node.right, ast.Constant) or getattr(node.right, "id", "") in numbers:
                    mul += 1
                case ast.Div():
                    div += 1
                case ast.Pow():
                    mul += ast.literal_eval(node.right) - 1
    return mul, add, div


def _algebra_of(expressions: Sequence[Expression]) -> Algebra:
    return next((e.algebra for e in topological(expressions) if e.algebra != SCALARS), SCALARS)


def _symbol(name: str) -> Any:
    from kingdon.polynomial import RationalPolynomial

    return RationalPolynomial.fromname(name)


class Vectors:
    """Change of basis between the vectors of an algebra and orthogonal vectors.

    A null pair ``u . v = g`` is expressed as ``u = (p + n) / 2, v = g (p - n)`` with ``p**2 = 1, n**2 = -1``.
    """

    def __init__(self, algebra: Algebra) -> None:
        self.algebra = algebra
        squares = [algebra.gram[k][k] for k in range(algebra.dimension)]
        theirs: list[Sum] = [{1 << k: 1} for k in range(algebra.dimension)]
        ours: list[Sum] = [{1 << k: 1} for k in range(algebra.dimension)]
        self.are_changed = False
        for i, row in enumerate(algebra.gram):
            for j in range(i + 1, algebra.dimension):
                g = Fraction(row[j])
                if g:
                    if any(squares[k] for k in (i, j)) or sum(map(bool, row)) > 1:
                        raise Unsupported(f"{algebra.name} is neither orthogonal nor made of null pairs")
                    squares[i], squares[j] = 1, -1
                    p, n = 1 << i, 1 << j
                    half = 1 / (2 * g)
                    theirs[i], theirs[j] = {p: 0.5, n: 0.5}, {p: _number(g), n: _number(-g)}
                    ours[i], ours[j] = {p: 1, n: _number(half)}, {p: 1, n: _number(-half)}
                    self.are_changed = True
        self.signature = tuple(int(square) for square in squares)
        self._theirs, self._ours = theirs, ours

    def to_theirs(self, terms: Mapping[int, Any]) -> Sum:
        """Return the coefficients of the blades of orthogonal vectors."""
        return self._change(terms, self._theirs)

    def to_ours(self, terms: Mapping[int, Any]) -> Sum:
        """Return the coefficients of the blades of the algebra."""
        return self._change(terms, self._ours)

    def _change(self, terms: Mapping[int, Any], vectors: Sequence[Sum]) -> Sum:
        if not self.are_changed:
            return dict(terms)
        found: Sum = {}
        for blade, value in terms.items():
            for other, factor in _outer([vectors[k] for k in range(len(vectors)) if blade >> k & 1]).items():
                found[other] = found[other] + value * factor if other in found else value * factor
        return found


def _outer(factors: Sequence[Sum]) -> Sum:
    product: Sum = {0: 1}
    for factor in factors:
        terms: Sum = {}
        for left, a in product.items():
            for right, b in factor.items():
                if not left & right:
                    sign = -1 if (left & -right).bit_count() & 1 else 1
                    terms[left | right] = terms.get(left | right, 0) + sign * a * b
        product = {blade: value for blade, value in terms.items() if value}
    return product


class Translation:
    """Translates expressions to multivectors of kingdon over its polynomials."""

    def __init__(self, vectors: Vectors, peer: Any, own: bool) -> None:
        self._vectors, self._peer, self._own = vectors, peer, own
        self._memory: dict[Expression, Any] = {}

    def results(self, expression: Expression) -> list[tuple[Any, int]]:
        """Return the nonzero coefficients as rational polynomials over the integers, each with its factor."""
        for each in topological([expression], self._memory):
            arguments = [self._memory[argument] for argument in each.arguments]
            self._memory[each] = self._value(each, arguments)
        terms = dict(self._memory[expression].items())
        if not self._own:
            terms = self._vectors.to_ours(terms)
        return [_integral(value) for value in terms.values() if value != 0]

    def _multivector(self, terms: Mapping[int, Any]) -> Any:
        kept = {blade: _polynomial(value) for blade, value in sorted(terms.items())}
        return self._peer.multivector(values=list(kept.values()) or [0], keys=tuple(kept) or (0,))

    def _value(self, expression: Expression, arguments: list[Any]) -> Any:
        match expression.operation:
            case "input":
                return self._input(expression.data.layout, expression.data.components)
            case "constant":
                return self._multivector(self._vectors.to_theirs(expression.data.terms))
            case "grade":
                return arguments[0].grade(*expression.data)
            case "coefficient":
                sign, blade = expression.data
                terms = self._vectors.to_ours(dict(arguments[0].items()))
                return self._multivector({0: terms.get(blade, 0) * sign})
            case "assemble":
                values = [dict(argument.items()).get(0, 0) for argument in arguments]
                blades = {blade: value * sign for (sign, blade), value in zip(expression.data, values, strict=True)}
                return self._multivector(self._vectors.to_theirs(blades))
            case "sandwich":
                return self._sandwich(expression, *arguments)
            case "regressive_product":
                orientation, _ = self._vectors.algebra.spelling(self._vectors.algebra.everything)
                product = arguments[0] & arguments[1]
                return product if orientation > 0 else -product
            case operation if operation in _OPERATORS:
                return _OPERATORS[operation](*arguments)
            case operation:
                raise Unsupported(f"{operation} is not translated")

    def _input(self, layout: Layout, components: Sequence[str]) -> Any:
        symbols = [_symbol(name) for name in components]
        # kingdon has one orientation of each blade: a symbol is the coefficient in that orientation
        oriented = [symbol * slot.sign for symbol, slot in zip(symbols, layout.stored, strict=True)]
        if self._own and not layout.fixed and not layout.implied:
            support = {blade for slot in layout.stored for blade in self._vectors.to_theirs({slot.blade: 1})}
            if len(support) == layout.size:
                return self._multivector(dict(zip(sorted(support), symbols, strict=True)))
        return self._multivector(self._vectors.to_theirs(layout.element(oriented).terms))

    def _sandwich(self, expression: Expression, versor: Any, x: Any) -> Any:
        """Return the sandwich product; the operator of kingdon requires a versor of norm 1."""
        if is_unit(expression.arguments[0]):
            return versor >> x
        return versor * (x.involute() if parity(expression.arguments[0]) == 1 else x) * ~versor


_OPERATORS: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "negate": lambda a: -a,
    "geometric_product": lambda a, b: a * b,
    "outer_product": lambda a, b: a ^ b,
    "inner_product": lambda a, b: a | b,
    "left_contraction": lambda a, b: a.lc(b),
    "right_contraction": lambda a, b: a.rc(b),
    "scalar_product": lambda a, b: a.sp(b),
    "commutator": lambda a, b: a.cp(b),
    "anticommutator": lambda a, b: a.acp(b),
    "reverse": lambda a: ~a,
    "grade_involution": lambda a: a.involute(),
    "clifford_conjugate": lambda a: a.conjugate(),
    "norm_squared": lambda a: a.sp(~a),
    "inverse": lambda a: a.inv(),
    "divide": lambda a, b: a / b,
}


def _polynomial(value: Any) -> Any:
    """Convert to a rational polynomial, with integer coefficients if they are integral."""
    from kingdon.polynomial import RationalPolynomial

    made = RationalPolynomial(_number(value) if isinstance(value, (int, float, Fraction)) else value)
    parts = ([(_number(term[0]), *term[1:]) for term in part.args] for part in (made.numer, made.denom))
    return RationalPolynomial(*parts)


def _integral(value: Any) -> tuple[Any, int]:
    """Return a rational polynomial times the smallest factor that makes its numerator integral, and the factor."""
    made = _polynomial(value)
    factor = math.lcm(*(Fraction(term[0]).denominator for term in made.numer.args))
    return _polynomial(made * factor), factor


def _number(value: Any) -> Any:
    if isinstance(value, int):
        return value
    return int(value) if value == int(value) else float(value)
