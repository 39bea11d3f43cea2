"""How every operation, number and name is written in C and in Python: tables, and nothing that depends on a kernel.

Addition of floating-point numbers is not associative, so parentheses stand wherever a reader would group otherwise. The
Python text is written once, for floats under numba and for array namespaces: its functions are free names that each of
them binds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

from ..errors import BackendError
from ..ir.program import Operand, Program
from ..ir.reserved import C_MACRO_NAMES as C_MACRO_NAMES
from ..ir.reserved import RESERVED as RESERVED
from ..ir.reserved import legal
from ..ir.scalar import LEAVES, Op, Rational

SUM, PRODUCT, SIGN, WHOLE = range(4)
"""How tightly the outermost operation of a text binds: that of a name, a number or a call not at all."""

INFIX: Mapping[Op, tuple[str, int]] = {
    Op.ADD: ("+", SUM),
    Op.SUBTRACT: ("-", SUM),
    Op.MULTIPLY: ("*", PRODUCT),
    Op.DIVIDE: ("/", PRODUCT),
}
"""The operations between their operands, and how they bind; all group from the left."""

MACROS = frozenset(Op) - {*LEAVES, *INFIX, Op.NEGATE}
"""The operations that are calls: in C of macros of ``gac_runtime.h``, named like the operations in capitals."""

_EXACT_INTEGER = 2**53


def number(value: Rational) -> str:
    """`value` as text that C and Python read as the nearest double: ``2``, ``0.5``, ``(1.0 / 3.0)``.

    Numbers that a double holds are written as they are. Others are written as a quotient of two integers that it
    holds: IEEE division rounds that correctly, and an exact reader sees the rational number itself.
    """
    value = Fraction(value)
    top, bottom = value.numerator, value.denominator
    if bottom == 1 and abs(top) < 2**31:
        return str(top)
    try:
        nearest = float(value)
    except OverflowError as error:
        raise BackendError("constant", f"{value} overflows a double", "a smaller number") from error
    if Fraction(nearest) == value:
        return repr(nearest)
    if max(abs(top), bottom) <= _EXACT_INTEGER:
        return f"({top}.0 / {bottom}.0)"
    return repr(nearest)


def as_printed(program: Program) -> Program:
    """The program that a reader of the text of `program` sees: numbers that `number` rounds are rounded."""

    def seen(operand: Operand) -> Operand:
        if isinstance(operand, str):
            return operand
        top, _, bottom = number(operand).strip("()").partition(" / ")
        return Fraction(float(top)) / Fraction(float(bottom or 1))

    return replace(
        program,
        lines=tuple(replace(line, operands=tuple(map(seen, line.operands))) for line in program.lines),
        results=tuple(replace(result, operands=tuple(map(seen, result.operands))) for result in program.results),
    )


class Written(NamedTuple):
    """An expression as text, and how tightly its outermost operation binds."""

    text: str
    binding: int


@dataclass(frozen=True, slots=True)
class Notation:
    """How a language writes expressions.

    Attributes
    ----------
    call : callable
        The name of a function in that language, from the operation's own.
    cast : str
        What stands before every constant.
    """

    call: Callable[[str], str]
    cast: str = ""

    def variable(self, name: str) -> Written:
        """A name."""
        return Written(name, WHOLE)

    def number(self, value: Rational) -> Written:
        """A constant."""
        text = self.cast + number(value)
        return Written(text, SIGN if text[0] == "-" else WHOLE)

    def operation(self, op: Op, operands: Sequence[Written]) -> Written:
        """An operation on expressions, in parentheses where it would not be read as one operand otherwise."""
        if op in INFIX:
            symbol, binding = INFIX[op]
            left, right = _enclosed(operands[0], binding), _enclosed(operands[1], binding + 1)
            return Written(f"{left} {symbol} {right}", binding)
        if op is Op.NEGATE:
            return Written(f"-{_enclosed(operands[0], WHOLE)}", SIGN)
        return Written(f"{self.call(op.value)}({', '.join(operand.text for operand in operands)})", WHOLE)


def _enclosed(expression: Written, least: int) -> str:
    """The text of an operand, in parentheses if it binds less tightly than that."""
    return expression.text if expression.binding >= least else f"({expression.text})"


PYTHON = Notation(str)
"""Functions are free names: those of the operations."""

C = Notation(str.upper, "(REAL)")
"""Functions are macros of the emitted file; constants take the type of the kernel, so nothing is computed in double."""


class Names:
    """The variables of one emitted function, in one language: legal, distinct, as near to the program's as possible."""

    def __init__(self) -> None:
        self._taken: set[str] = set()
        self._variables: dict[str, str] = {}

    def fresh(self, wanted: str) -> str:
        """A legal name that nothing else has."""
        name = legal(wanted)
        while name in self._taken:
            name = legal(f"{name}_")
        self._taken.add(name)
        return name

    def define(self, variable: str, wanted: str = "") -> str:
        """The name of a program's variable from here on."""
        name = self._variables[variable] = self.fresh(wanted or variable)
        return name

    def parameters(self, program: Program) -> list[str]:
        """The names of the arguments of an emitted function; a scalar is its only component."""
        return [
            self.fresh(argument.name) if argument.shape else self.define(argument.components[0])
            for argument in program.arguments
        ]

    def variable(self, variable: str) -> str:
        """The name of a program's variable."""
        return self._variables[variable]
