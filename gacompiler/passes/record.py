"""All that is known of a kernel while it is compiled: one record, filled in from pass to pass."""

from __future__ import annotations

from dataclasses import dataclass

from ..frontend.expression import Expression
from ..frontend.kernel import Kernel, Trace
from ..ir.cost import Cost
from ..ir.program import Program
from ..ir.uniform import Uniform
from .accuracy import Gate
from .decide import Decision
from .search import Candidate


@dataclass(frozen=True, slots=True)
class Compilation:
    """The stages of one kernel; a field is empty until its pass has run."""

    kernel: Kernel
    trace: Trace | None = None
    variants: dict[str, tuple[Expression, ...]] | None = None
    decision: Decision | None = None
    candidates: tuple[Candidate, ...] = ()
    limits: tuple[str, ...] = ()
    """Where the search for candidates stopped short."""
    gate: Gate | None = None
    """What any program of this kernel is measured by."""
    best: Candidate | None = None
    uniform: tuple[Uniform, ...] = ()
    """Forms for batches in which some arguments are the same for every element."""

    @property
    def program(self) -> Program:
        """The program that won."""
        assert self.best is not None
        return self.best.program

    @property
    def cost(self) -> Cost:
        """Its cost."""
        assert self.best is not None
        return self.best.cost
