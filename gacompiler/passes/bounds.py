"""Lower bounds for the number of operations of a kernel, whatever its program.

- Every product of two numbers that depend on the inputs makes one new function of them, and results are sums of these
  products, of inputs and of numbers. There are therefore at least as many products as results that are linearly
  independent of each other, of the inputs and of the number 1.
- If the results are linear in an argument, there are at least as many products as columns of its matrix that are
  independent modulo constant columns (Winograd, Comm. Pure Appl. Math. 23, 1970): the rank of the bilinear form.
- An operation has two operands, so there are at least as many operations as inputs that are used, less the results.

Ranks are those at random points modulo a large prime; a rank at points is never above that of the functions.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

from ..errors import InexactError
from ..frontend.kernel import Kernel, Parameter
from ..ir.interpret import Tape
from ..ir.program import Program
from ..rings.residues import PRIME, Residue, rank, residue
from .samples import wide_sample

Row = list[int]


@dataclass(frozen=True, slots=True)
class Bound:
    """Lower bounds for the numbers of products, divisions and functions, and of all operations."""

    products: int
    operations: int


def lower_bound(kernel: Kernel, program: Program) -> Bound | None:
    """Return lower bounds for a kernel, or None if its program has functions or its inputs no rational parametrisation.

    Parameters
    ----------
    kernel : Kernel
        A kernel without loops.
    program : Program
        Any correct program for it.
    """
    values = _Values(kernel, program)
    n = len(values.names) + values.n_results
    try:
        points = [point for _ in range(n + 2) if (point := values.at_random())]
        if not points:
            return None
        products = max(_independent_results(points), *(values.columns(each) for each in kernel.parameters))
    except (ArithmeticError, InexactError):
        return None
    used = {operand for line in program.lines for operand in line.operands if operand in values.names}
    results = {operand for result in program.results for operand in result.operands if isinstance(operand, str)}
    computed = results & {line.target for line in program.lines}
    return Bound(products, max(products, len(computed), len(used) - len(results)))


def _independent_results(points: Sequence[tuple[Row, Row]]) -> int:
    """Return the number of results that are independent modulo the inputs and the number 1."""
    return _rank([1, *inputs, *results] for inputs, results in points) - _rank([1, *inputs] for inputs, _ in points)


class _Values:
    """The values of a program modulo a prime."""

    def __init__(self, kernel: Kernel, program: Program) -> None:
        self._kernel, self._tape, self._random = kernel, Tape(program), Random(3)
        self.names = [name for argument in program.arguments for name in argument.components]
        self.n_results = sum(len(result.operands) for result in program.results)

    def at_random(self) -> tuple[Row, Row] | None:
        """Return inputs and results at a random point that satisfies the relations, or None if there is none."""
        point = wide_sample(self._kernel, self._random)
        return None if point is None else ([residue(point[name]).value for name in self.names], self._at(point))

    def columns(self, parameter: Parameter) -> int:
        """Return the number of independent columns of the matrix of an argument, 0 if results are not linear in it."""
        layout = parameter.layout
        if layout.has_relations or layout.implied:
            return 0
        zero = dict.fromkeys(parameter.components, residue(0))
        units = [zero | {name: residue(1)} for name in parameter.components]
        weights = [Residue(self._random.randrange(PRIME)) for _ in units]
        rows: list[Row] = [[] for _ in units]
        before: list[Row] = []
        for k in range(2 + len(units)):
            point = wide_sample(self._kernel, self._random)
            assert point is not None
            start = self._at(point | zero)
            columns = [_difference(self._at(point | unit), start) for unit in units]
            mixed = dict(zip(parameter.components, weights, strict=True))
            expected = _difference(self._at(point | mixed), start)
            found = [
                sum(w.value * c[j] for w, c in zip(weights, columns, strict=True)) % PRIME for j in range(len(start))
            ]
            if found != expected:
                return 0
            if k == 0:
                before = columns
            else:
                for row, column, first in zip(rows, columns, before, strict=True):
                    row += _difference(column, first)
        return _rank(rows)

    def _at(self, point: Mapping[str, Any]) -> Row:
        found = self._tape.run([point[name] for name in self.names])
        return [(value if isinstance(value, Residue) else residue(value)).value for value in found]


def _difference(a: Row, b: Row) -> Row:
    return [(x - y) % PRIME for x, y in zip(a, b, strict=True)]


def _rank(rows: Iterable[Row]) -> int:
    return rank({k: value for k, value in enumerate(row) if value} for row in rows)
