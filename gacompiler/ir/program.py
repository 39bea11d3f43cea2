"""Programs: named inputs, lines in single-assignment form, named outputs. All backends print them."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import prod

from .scalar import Op

Operand = str | Fraction
"""A variable by name, or an exact constant."""


@dataclass(frozen=True, slots=True)
class Argument:
    """An input array. `components` are the names of its ``prod(shape)`` entries in C order (one for a scalar)."""

    name: str
    shape: tuple[int, ...]
    components: tuple[str, ...]

    def __post_init__(self) -> None:
        if len(self.components) != prod(self.shape):
            raise ValueError(f"{self.name}: {len(self.components)} components for shape {self.shape}")


@dataclass(frozen=True, slots=True)
class Line:
    """The assignment ``target = op(operands)``."""

    target: str
    op: Op
    operands: tuple[Operand, ...]


@dataclass(frozen=True, slots=True)
class Result:
    """An output array, entry by entry in C order."""

    name: str
    shape: tuple[int, ...]
    operands: tuple[Operand, ...]

    def __post_init__(self) -> None:
        if len(self.operands) != prod(self.shape):
            raise ValueError(f"{self.name}: {len(self.operands)} entries for shape {self.shape}")


@dataclass(frozen=True, slots=True)
class Program:
    """A straight-line function.

    Examples
    --------
    >>> a, b = Argument("a", (), ("a",)), Argument("b", (), ("b",))
    >>> print(Program("f", (a, b), (Line("t0", Op.MULTIPLY, ("a", "b")),), (Result("out", (), ("t0",)),)))
    f(a(), b()) -> out()
      t0 = a * b
      out = t0
    """

    name: str
    arguments: tuple[Argument, ...]
    lines: tuple[Line, ...]
    results: tuple[Result, ...]

    @property
    def signature(self) -> str:
        """The shapes in the notation of generalised ufuncs in numpy: ``(8),(3)->(3)``."""

        def shapes(parts: tuple[Argument, ...] | tuple[Result, ...]) -> str:
            return ",".join("(" + ",".join(map(str, part.shape)) + ")" for part in parts)

        return f"{shapes(self.arguments)}->{shapes(self.results)}"

    @property
    def is_polynomial(self) -> bool:
        """Whether only ring operations occur, so that complex arguments are meaningful."""
        return all(line.op in (Op.ADD, Op.SUBTRACT, Op.MULTIPLY, Op.NEGATE) for line in self.lines)

    @property
    def is_rational(self) -> bool:
        """Whether only ring operations and divisions occur, which are the same for complex arguments."""
        ring = (Op.ADD, Op.SUBTRACT, Op.MULTIPLY, Op.NEGATE, Op.DIVIDE)
        return all(line.op in ring for line in self.lines)

    def __str__(self) -> str:
        def shaped(parts: tuple[Argument, ...] | tuple[Result, ...]) -> str:
            return ", ".join(f"{part.name}({','.join(map(str, part.shape))})" for part in parts)

        text = [f"{self.name}({shaped(self.arguments)}) -> {shaped(self.results)}"]
        text += [f"  {line.target} = {_line(line)}" for line in self.lines]
        for result in self.results:
            for k, operand in enumerate(result.operands):
                place = result.name if not result.shape else f"{result.name}[{k}]"
                text.append(f"  {place} = {operand}")
        return "\n".join(text)


_INFIX = {
    Op.ADD: "+",
    Op.SUBTRACT: "-",
    Op.MULTIPLY: "*",
    Op.DIVIDE: "/",
    Op.LESS: "<",
    Op.LESS_EQUAL: "<=",
    Op.EQUAL: "==",
}


def _line(line: Line) -> str:
    if line.op in _INFIX:
        return f"{line.operands[0]} {_INFIX[line.op]} {line.operands[1]}"
    if line.op is Op.NEGATE:
        return f"-{line.operands[0]}"
    return f"{line.op.value}({', '.join(map(str, line.operands))})"
