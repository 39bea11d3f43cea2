"""Notation of operations, numbers and names in C and Python, independent of any kernel.

Addition of floating-point numbers is not associative, so parentheses are written wherever the grouping would otherwise
differ. The Python text is the same for numba and for array namespaces: its functions are free names, which each of them
binds to its own functions.
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
from ..ir.reserved import RESERVED_BY_USE, legal
from ..ir.scalar import LEAVES, Op, Rational

SUM, PRODUCT, SIGN, WHOLE = range(4)
"""Precedence of the outermost operation of a text, from the lowest; WHOLE is a name, a number or a call."""

INFIX: Mapping[Op, tuple[str, int]] = {
    Op.ADD: ("+", SUM),
    Op.SUBTRACT: ("-", SUM),
    Op.MULTIPLY: ("*", PRODUCT),
    Op.DIVIDE: ("/", PRODUCT),
}
"""Symbols and precedence of the infix operations, which are all left-associative."""

MACROS = frozenset(Op) - {*LEAVES, *INFIX, Op.NEGATE}
"""The operations written as calls. In C they are macros of ``gac_runtime.h``, named by the operation in capitals."""

_EXACT_INTEGER = 2**53


def number(value: Rational) -> str:
    """Return text that C and Python evaluate to the double nearest to `value`: ``2``, ``0.5``, ``(1.0 / 3.0)``.

    Numbers that are exactly representable as doubles are written directly. Others are written as a quotient of two
    representable integers, if possible: IEEE division is correctly rounded, and an exact reader recovers the rational
    number.
    """
    value = Fraction(value)
    top, bottom = value.numerator, value.denominator
    try:
        nearest = float(value)
    except OverflowError as error:
        raise BackendError("constant", f"{value} overflows a double", "a smaller number") from error
    if Fraction(nearest) != value and max(abs(top), bottom) <= _EXACT_INTEGER:
        return f"({top}.0 / {bottom}.0)"
    # Also a number that is rounded to an integer, so that the text of what is read back is the same.
    return str(int(nearest)) if nearest.is_integer() and abs(nearest) < 2**31 else repr(nearest)


def as_printed(program: Program) -> Program:
    """Return the program that is read back from the text of `program`, with numbers rounded by `number`."""

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
    """An expression as text, with the precedence of its outermost operation."""

    text: str
    binding: int


@dataclass(frozen=True, slots=True)
class Notation:
    """Notation of expressions in a language.

    Attributes
    ----------
    call : callable
        Returns the name of the function for the name of an operation.
    cast : str
        Text written before every constant.
    """

    call: Callable[[str], str]
    cast: str = ""

    def variable(self, name: str) -> Written:
        """Write a variable."""
        return Written(name, WHOLE)

    def number(self, value: Rational) -> Written:
        """Write a constant."""
        text = self.cast + number(value)
        return Written(text, SIGN if text[0] == "-" else WHOLE)

    def operation(self, op: Op, operands: Sequence[Written]) -> Written:
        """Write an operation, with parentheses around operands of lower precedence."""
        if op in INFIX:
            symbol, binding = INFIX[op]
            left, right = _enclosed(operands[0], binding), _enclosed(operands[1], binding + 1)
            return Written(f"{left} {symbol} {right}", binding)
        if op is Op.NEGATE:
            return Written(f"-{_enclosed(operands[0], WHOLE)}", SIGN)
        return Written(f"{self.call(op.value)}({', '.join(operand.text for operand in operands)})", WHOLE)


def _enclosed(expression: Written, least: int) -> str:
    """Return the text of an operand, in parentheses if its precedence is less than `least`."""
    return expression.text if expression.binding >= least else f"({expression.text})"


PYTHON = Notation(str)
"""Functions are free names, the names of the operations."""

C = Notation(str.upper, "(REAL)")
"""Functions are macros; constants are cast to the type of the kernel, so that nothing is computed in double."""


class Names:
    """Legal and distinct names for the variables of one emitted function, as close to the program's as possible.

    Parameters
    ----------
    program : Program, optional
        The program of the function, whose operations may reserve names.
    """

    def __init__(self, program: Program | None = None) -> None:
        used = {line.op.value for line in program.lines if line.op in RESERVED_BY_USE} if program else set()
        self._taken: set[str] = used
        self._variables: dict[str, str] = {}

    def fresh(self, wanted: str) -> str:
        """Return a legal name that is not used yet."""
        name = legal(wanted)
        while name in self._taken:
            name = legal(f"{name}_")
        self._taken.add(name)
        return name

    def define(self, variable: str, wanted: str = "") -> str:
        """Choose the name of a program's variable."""
        name = self._variables[variable] = self.fresh(wanted or variable)
        return name

    def parameters(self, program: Program) -> list[str]:
        """Choose the names of the arguments of an emitted function; a scalar argument is its only component."""
        return [
            self.fresh(argument.name) if argument.shape else self.define(argument.components[0])
            for argument in program.arguments
        ]

    def variable(self, variable: str) -> str:
        """Return the name of a program's variable."""
        return self._variables[variable]
