"""The parts of compiled kernels that are stored: the data for the printers, and the data for proofs."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..backends.module import KernelSource, LoopSource
from ..frontend.kernel import Kernel
from ..frontend.loop_trace import LoopTrace
from ..ir.procedure import Procedure
from ..ir.program import Program
from ..passes.loops import LoopCompilation
from ..passes.lower import Slot
from ..passes.record import Compilation
from ..passes.truth import Proof
from .sources import kernel_source, loop_source


@dataclass(frozen=True, slots=True)
class Compiled:
    """A kernel whose program was proved.

    Attributes
    ----------
    kernel : Kernel
    source : KernelSource
        The program with its variants for uniform arguments, its cost and its documentation.
    slots : tuple of tuple of Slot
        For each result array, the coefficient and the expression that each entry stores.
    refused : str
        The counts of the cheapest form that was refused, and its error; empty if there is none.
    proof : Proof or None
        What this process proved; None if the kernel was read from the cache.
    """

    kernel: Kernel
    source: KernelSource
    slots: tuple[tuple[Slot, ...], ...]
    refused: str = ""
    proof: Proof | None = field(default=None, repr=False, compare=False)

    @classmethod
    def of(cls, record: Compilation) -> Compiled:
        """Extract the stored parts from the record of a complete compilation."""
        assert record.decision is not None
        refused = f"{record.refused[0].cost}: {record.refusal}" if record.refusal else ""
        return cls(record.kernel, kernel_source(record), record.decision.slots, refused, record.proof)


@dataclass(frozen=True, slots=True)
class CompiledPart:
    """A straight-line part of a kernel with loops.

    Attributes
    ----------
    program : Program
        The program as compiled: its arguments are single multivectors, not rows of tables.
    slots : tuple of tuple of Slot
    proof : Proof or None
        As in `Compiled`.
    """

    program: Program
    slots: tuple[tuple[Slot, ...], ...]
    proof: Proof | None = field(default=None, repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class CompiledLoops:
    """A kernel with loops that was proved.

    Attributes
    ----------
    kernel : Kernel
    source : LoopSource
    trace : LoopTrace
        The traced definition, with which emitted text is verified.
    parts : tuple of CompiledPart
        The straight-line parts in the order of the definition.
    proved : Procedure or None
        The procedure that this process proved; None if the kernel was read from the cache.
    """

    kernel: Kernel
    source: LoopSource
    trace: LoopTrace
    parts: tuple[CompiledPart, ...]
    proved: Procedure | None = field(default=None, repr=False, compare=False)

    @classmethod
    def of(cls, record: LoopCompilation) -> CompiledLoops:
        """Extract the stored parts from the record of a compilation."""
        parts = []
        for part in record.parts:
            assert part.decision is not None
            parts.append(CompiledPart(part.program, part.decision.slots, part.proof))
        return cls(record.kernel, loop_source(record), record.trace, tuple(parts), record.procedure)
