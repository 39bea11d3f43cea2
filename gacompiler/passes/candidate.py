"""Candidate programs for a kernel."""

from __future__ import annotations

from dataclasses import dataclass

from ..ir.cost import Cost
from ..ir.program import Program
from .accuracy import Gate

PARTS = " parts"
"""End of the step of a composition."""
WORSE_OF_PARTS = 2.0
"""Maximum error of a composition, as a multiple of that of other candidates."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A candidate program for a kernel.

    Attributes
    ----------
    steps : tuple of str
        The transformations that were applied, starting with the rewriting.
    program : Program
    cost : Cost
    """

    steps: tuple[str, ...]
    program: Program
    cost: Cost

    @property
    def origin(self) -> str:
        """The steps in one line."""
        return ", ".join(self.steps)

    @property
    def is_composed(self) -> bool:
        """Whether the candidate is a composition of parts, or was made from one."""
        return any(step.endswith(PARTS) for step in self.steps)

    def is_accurate(self, gate: Gate) -> bool:
        """Return whether the error of the program is accepted."""
        return not self.refusal(gate)

    def refusal(self, gate: Gate) -> str:
        """Return why the program is not accepted, or "".

        Errors of parts that were accepted one by one add up, so compositions have a limit of their own.
        """
        return gate.refusal(self.program, WORSE_OF_PARTS if self.is_composed else 1.0)
