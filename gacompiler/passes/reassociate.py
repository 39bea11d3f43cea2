"""Other orders of the sums of a program, for the cost models `fma` and `latency`.

The terms of a sum are collected through sums that are used once, and added in another order. The number of operations
is the same. The results differ by rounding, so the candidates are checked for accuracy like all others.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..ir.contraction import SUMS
from ..ir.latency import latency_of
from ..ir.program import Line, Operand, Program
from ..ir.scalar import Graph, Op, Scalar

Term = tuple[int, Operand]
"""A sign, and a value of the program."""
_NEAREST = 4
"""Number of terms of each kind among which the next pair of terms is searched."""


def plain_terms_first(program: Program) -> tuple[Scalar, ...]:
    """Return the results with each sum beginning with its terms that cannot be contracted.

    In ``a*b + c*d + x``, only one product is part of a fused multiply-add; in ``x + a*b + c*d``, both are. Products
    with several uses are added last, because such a product is contracted only if every sum has room for it.
    """
    sums = _sums(program)
    flexible = _only_in_sums(program)
    uses = Counter(operand for line in program.lines for operand in line.operands)

    def rank(term: Term) -> tuple[int, int]:
        sign, name = term
        return (uses[name] if name in flexible else 0), -sign

    values = _Values(program)
    for line in program.lines:
        if line.target in sums:
            (first, start), *others = sorted(sums[line.target], key=rank)
            total = (first, values[start])
            for sign, name in others:
                total = _added(total, (sign, values[name]))
            values.store(line, _signed(total))
        elif not _is_inner(line, sums):
            values.compute(line)
    return values.results()


def balanced(program: Program) -> tuple[Scalar, ...]:
    """Return the results with the terms of each sum added in pairs, those available first before the others."""
    sums = _sums(program)
    flexible = _only_in_sums(program)
    lines = {line.target: line for line in program.lines}
    values = _Values(program)
    ready: dict[Operand, int] = {}

    def start(line: Line) -> int:
        return max(ready.get(operand, 0) for operand in line.operands)

    for line in program.lines:
        if line.target in sums:
            waiting = [
                _Waiting(
                    start(lines[str(name)]) if name in flexible else ready.get(name, 0),
                    name in flexible,
                    (sign, values[name]),
                )
                for sign, name in sums[line.target]
            ]
            total = _in_pairs(waiting)
            ready[line.target] = total.time
            values.store(line, _signed(total.term))
        elif not _is_inner(line, sums):
            ready[line.target] = start(line) + latency_of(line.op)
            values.compute(line)
    return values.results()


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A term of a sum, and the time at which it is available. For a product, this is the time of its factors."""

    time: int
    is_product: bool
    term: tuple[int, Scalar]


def _in_pairs(terms: Sequence[_Waiting]) -> _Waiting:
    """Add the two terms whose sum is available first, until one term is left."""
    left = list(terms)
    while len(left) > 1:
        left.sort(key=lambda each: each.time)
        nearest = [k for kind in (False, True) for k in _first(left, kind)]
        pairs = [(i, j) for i in nearest for j in nearest if i < j]
        i, j = min(pairs, key=lambda pair: (_time_of_sum(left[pair[0]], left[pair[1]]), left[pair[0]].is_product))
        a, b = left[i], left[j]
        del left[j], left[i]
        left.append(_Waiting(_time_of_sum(a, b), False, _added(a.term, b.term)))
    return left[0]


def _first(terms: Sequence[_Waiting], is_product: bool) -> list[int]:
    return [k for k, each in enumerate(terms) if each.is_product == is_product][:_NEAREST]


def _time_of_sum(a: _Waiting, b: _Waiting) -> int:
    """Return when the sum of two terms is available. One product is contracted, the other must be complete before."""
    one = latency_of(Op.ADD)
    if a.is_product and b.is_product:
        return max(min(a.time, b.time) + one, max(a.time, b.time)) + one
    return max(a.time, b.time) + one


def _added(a: tuple[int, Scalar], b: tuple[int, Scalar]) -> tuple[int, Scalar]:
    (sign, x), (other, y) = a, b
    if sign == other:
        return sign, x + y
    return (1, x - y) if sign > 0 else (1, y - x)


def _signed(term: tuple[int, Scalar]) -> Scalar:
    sign, value = term
    return value if sign > 0 else -value


def _sums(program: Program) -> dict[str, list[Term]]:
    """Return the terms of every sum that is not itself a term of the only sum that uses it."""
    uses = Counter(operand for line in program.lines for operand in line.operands)
    stored = {operand for result in program.results for operand in result.operands}
    in_sums = {operand for line in program.lines if line.op in (*SUMS, Op.NEGATE) for operand in line.operands}
    inner: dict[Operand, list[Term]] = {}
    found: dict[str, list[Term]] = {}
    for line in program.lines:
        if line.op not in (*SUMS, Op.NEGATE):
            continue
        signs = {Op.ADD: (1, 1), Op.SUBTRACT: (1, -1), Op.NEGATE: (-1,)}[line.op]
        terms = [
            (sign * own, name)
            for sign, operand in zip(signs, line.operands, strict=True)
            for own, name in inner.get(operand, [(1, operand)])
        ]
        if uses[line.target] == 1 and line.target in in_sums and line.target not in stored:
            inner[line.target] = terms
        else:
            found[line.target] = terms
    return found


def _is_inner(line: Line, sums: Mapping[str, object]) -> bool:
    """Return whether a line is part of a sum that is computed as a whole."""
    return line.op in (*SUMS, Op.NEGATE) and line.target not in sums


def _only_in_sums(program: Program) -> frozenset[Operand]:
    """Return the products that are used in sums only, once in each."""
    sums = Counter(name for terms in _sums(program).values() for name in dict.fromkeys(name for _, name in terms))
    uses = Counter(operand for line in program.lines for operand in line.operands)
    uses.update(operand for result in program.results for operand in result.operands)
    products = (line.target for line in program.lines if line.op is Op.MULTIPLY)
    return frozenset(name for name in products if sums[name] == uses[name])


class _Values:
    """The values of a program over a new graph."""

    def __init__(self, program: Program) -> None:
        self._program, self._graph = program, Graph()
        names = [name for argument in program.arguments for name in argument.components]
        self._known: dict[Operand, Scalar] = {name: self._graph.variable(name) for name in names}

    def __getitem__(self, operand: Operand) -> Scalar:
        return self._known[operand] if isinstance(operand, str) else self._graph.constant(operand)

    def store(self, line: Line, value: Scalar) -> None:
        self._known[line.target] = value

    def compute(self, line: Line) -> None:
        self.store(line, self._graph.apply(line.op, *(self[operand] for operand in line.operands)))

    def results(self) -> tuple[Scalar, ...]:
        return tuple(self[operand] for result in self._program.results for operand in result.operands)
