"""The cost of a program: its operation counts, and a weighted total for comparing candidates."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, dataclass

from .program import Program
from .scalar import Op

_CALLS = (Op.SIN, Op.COS, Op.ATAN2, Op.ACOS, Op.EXP, Op.LOG)
WEIGHTS = {"mul": 1, "add": 1, "div": 8, "sqrt": 8, "call": 20, "choice": 1}
"""The cost of each operation, in units of one addition."""

_CHOICES = (Op.ABS, Op.FLOOR, Op.MINIMUM, Op.MAXIMUM, Op.LESS, Op.LESS_EQUAL, Op.EQUAL, Op.SELECT)


@dataclass(frozen=True, slots=True)
class Cost:
    """Operation counts. Negations are free; a multiplication by a constant counts as a multiplication.

    Attributes
    ----------
    mul, add, div, sqrt, call, choice : int
        Products, sums and differences, divisions, square roots, transcendental functions, comparisons and selections.
    fma : int
        Instructions for products and sums on a machine with fused multiply-add. A product is fused if it is used once,
        in a sum.
    """

    mul: int
    add: int
    div: int
    sqrt: int
    call: int
    choice: int
    fma: int

    @property
    def total(self) -> int:
        """The weighted sum by which candidates are compared."""
        return sum(weight * getattr(self, name) for name, weight in WEIGHTS.items())

    def as_dict(self) -> dict[str, int]:
        """The counts by name, for JSON."""
        return asdict(self)

    def __str__(self) -> str:
        rest = [f"{getattr(self, name)} {name}" for name in ("div", "sqrt", "call", "choice") if getattr(self, name)]
        return ", ".join([f"{self.mul} mul", f"{self.add} add", *rest])

    def __add__(self, other: Cost) -> Cost:
        return Cost(*(a + b for a, b in zip(asdict(self).values(), asdict(other).values(), strict=True)))


def cost(program: Program) -> Cost:
    """Count the operations of `program`."""
    count = Counter(line.op for line in program.lines)
    mul, add = count[Op.MULTIPLY], count[Op.ADD] + count[Op.SUBTRACT]
    return Cost(
        mul=mul,
        add=add,
        div=count[Op.DIVIDE],
        sqrt=count[Op.SQRT],
        call=sum(count[op] for op in _CALLS),
        choice=sum(count[op] for op in _CHOICES),
        fma=mul + add - _fusible(program),
    )


def _fusible(program: Program) -> int:
    """Return the number of sums that can be fused with a product that is used only there."""
    uses = Counter(operand for line in program.lines for operand in line.operands if isinstance(operand, str))
    uses.update(operand for result in program.results for operand in result.operands if isinstance(operand, str))
    products = {line.target for line in program.lines if line.op is Op.MULTIPLY and uses[line.target] == 1}
    return sum(
        any(operand in products for operand in line.operands)
        for line in program.lines
        if line.op in (Op.ADD, Op.SUBTRACT)
    )
