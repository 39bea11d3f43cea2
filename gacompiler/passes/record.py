"""The record of the compilation of a kernel, which the passes fill in."""

from __future__ import annotations

from dataclasses import dataclass

from ..frontend.expression import Expression
from ..frontend.kernel import Kernel, Trace
from ..ir.cost import Cost
from ..ir.cost_models import COUNTS, CostModel
from ..ir.program import Program
from ..ir.uniform import Uniform
from .accuracy import Gate
from .candidate import Candidate
from .decide import Decision
from .effort import DEFAULT, LEVELS, Effort
from .truth import Proof


@dataclass(frozen=True, slots=True)
class Compilation:
    """The stages of the compilation of one kernel. A field is empty until its pass has run."""

    kernel: Kernel
    trace: Trace | None = None
    variants: dict[str, tuple[Expression, ...]] | None = None
    decision: Decision | None = None
    candidates: tuple[Candidate, ...] = ()
    limits: tuple[str, ...] = ()
    """Descriptions of what was not tried: the limits at which the search for candidates stopped."""
    gate: Gate | None = None
    """The accuracy criterion for programs of this kernel."""
    best: Candidate | None = None
    uniform: tuple[Uniform, ...] = ()
    """Forms for batches in which some arguments are the same for every element."""
    effort: Effort = LEVELS[DEFAULT]
    """The level of effort, with its limits."""
    model: CostModel = COUNTS
    """The cost model by which the program is selected."""
    proof: Proof | None = None
    """What was proved; None if there are fewer points than `gac verify` requires."""

    @property
    def program(self) -> Program:
        """The selected program."""
        assert self.best is not None
        return self.best.program

    @property
    def cost(self) -> Cost:
        """The cost of the selected program."""
        assert self.best is not None
        return self.best.cost

    @property
    def refused(self) -> tuple[Candidate, ...]:
        """The candidates that are cheaper than the selected one, but lose digits, the cheapest first."""
        assert self.best is not None
        least = self.value(self.best)
        cheaper = [candidate for candidate in self.candidates if self.value(candidate) < least]
        return tuple(sorted(cheaper, key=self.value))

    @property
    def refusal(self) -> str:
        """The error for which the cheapest of `refused` was not selected, and what is accepted; "" if there is none."""
        return self.refused[0].refusal(self.gate) if self.refused and self.gate else ""

    def value(self, candidate: Candidate) -> int:
        """Return the cost of a candidate in the cost model."""
        return candidate.cost.total if self.model is COUNTS else self.model.of(candidate.program)
