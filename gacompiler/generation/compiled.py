"""What is kept of compiled kernels: all that is printed of them, and what their proof needs."""

from __future__ import annotations

from dataclasses import dataclass

from ..backends.module import KernelSource, LoopSource
from ..frontend.kernel import Kernel
from ..frontend.loop_trace import LoopTrace
from ..ir.program import Program
from ..passes.loops import LoopCompilation
from ..passes.lower import Slot
from ..passes.record import Compilation
from .sources import kernel_source, loop_source


@dataclass(frozen=True, slots=True)
class Compiled:
    """A kernel whose program was proved.

    Attributes
    ----------
    kernel : Kernel
    source : KernelSource
        The program with its forms for uniform arguments, its cost, and what is said of it.
    slots : tuple of tuple of Slot
        For each result array: which coefficient of which expression each entry is.
    """

    kernel: Kernel
    source: KernelSource
    slots: tuple[tuple[Slot, ...], ...]

    @classmethod
    def of(cls, record: Compilation) -> Compiled:
        """What is kept of a kernel that went through the whole pipeline."""
        assert record.decision is not None
        return cls(record.kernel, kernel_source(record), record.decision.slots)


@dataclass(frozen=True, slots=True)
class CompiledPart:
    """A straight-line part of a kernel with loops.

    Attributes
    ----------
    program : Program
        As compiled: its arguments are single multivectors, not rows of tables.
    slots : tuple of tuple of Slot
    """

    program: Program
    slots: tuple[tuple[Slot, ...], ...]


@dataclass(frozen=True, slots=True)
class CompiledLoops:
    """A kernel with loops that was proved.

    Attributes
    ----------
    kernel : Kernel
    source : LoopSource
    trace : LoopTrace
        What its function does, by which emitted text is proved again.
    parts : tuple of CompiledPart
        In the order of the text.
    """

    kernel: Kernel
    source: LoopSource
    trace: LoopTrace
    parts: tuple[CompiledPart, ...]

    @classmethod
    def of(cls, record: LoopCompilation) -> CompiledLoops:
        """What is kept of a kernel with loops that was compiled."""
        parts = []
        for part in record.parts:
            assert part.decision is not None
            parts.append(CompiledPart(part.program, part.decision.slots))
        return cls(record.kernel, loop_source(record), record.trace, tuple(parts))
