"""Models of the cost of a program, by which candidates are compared (``gac generate --cost``).

The default counts operations. `latency` and `fma` describe a processor whose arithmetic units add, multiply, or do both
in one instruction, which includes x86-64 from AVX2 on and most 64-bit ARM processors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from ..errors import KernelError
from .contraction import contracted
from .cost import WEIGHTS, cost
from .latency import BUSY, CYCLES, CYCLES_OF_CALL, UNITS, cycles
from .program import Program
from .scalar import Op


@dataclass(frozen=True, slots=True)
class CostModel:
    """A function from programs to numbers. The accurate candidate with the smallest number is selected.

    Attributes
    ----------
    name : str
        The value of ``--cost``.
    unit : str
        What the number counts.
    counted : str
        What is counted, in one sentence.
    of : callable
        The function.
    """

    name: str
    unit: str
    counted: str
    of: Callable[[Program], int]


def _weighted(program: Program) -> int:
    return cost(program).total


def _fused(program: Program) -> int:
    return cost(program).total - len(contracted(program))


def _size(program: Program) -> int:
    return sum(line.op is not Op.NEGATE for line in program.lines)


_WEIGHTS = ", ".join(f"{name} {weight}" for name, weight in WEIGHTS.items())
_MODELS = (
    CostModel("counts", "operations", f"operations, weighted: {_WEIGHTS}; a negation counts nothing", _weighted),
    CostModel(
        "latency",
        "cycles",
        f"cycles of one element on {UNITS} units: {CYCLES[Op.ADD]} for a product, a sum or a fused multiply-add, "
        f"{CYCLES[Op.DIVIDE]} for a division and {CYCLES[Op.SQRT]} for a root, which occupy the only divider for "
        f"{BUSY[Op.DIVIDE]} and {BUSY[Op.SQRT]}, and {CYCLES_OF_CALL} for a call",
        cycles,
    ),
    CostModel(
        "fma",
        "instructions",
        "operations with the same weights, but a product used only in sums is part of their fused multiply-adds",
        _fused,
    ),
    CostModel("size", "instructions", "operations, all with weight 1, as a measure of the size of the code", _size),
)

MODELS: Mapping[str, CostModel] = MappingProxyType({model.name: model for model in _MODELS})
"""The models by name."""
COUNTS = MODELS["counts"]
"""The default."""


def cost_model(name: str) -> CostModel:
    """Return a model by its name.

    Raises
    ------
    KernelError
        If there is no model of this name.
    """
    if not isinstance(name, str) or name not in MODELS:
        raise KernelError("cost", repr(name), "one of " + ", ".join(MODELS))
    return MODELS[name]
