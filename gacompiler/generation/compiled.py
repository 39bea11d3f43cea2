"""What is kept of a compiled kernel: all that is printed of it, and what its proof needs."""

from __future__ import annotations

from dataclasses import dataclass

from ..backends.module import KernelSource
from ..frontend.kernel import Kernel
from ..passes.lower import Slot
from ..passes.record import Compilation
from .sources import kernel_source


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
