"""What every backend prints: a module is a name, where it came from, and its kernels."""

from __future__ import annotations

from dataclasses import dataclass

from ..ir.cost import Cost
from ..ir.procedure import Procedure
from ..ir.program import Program
from ..ir.uniform import Uniform

NOTHING = "nothing"
"""The argument of kernels with named results that need none."""


@dataclass(frozen=True, slots=True)
class LayoutText:
    """A layout as a generated module carries it: plain names and numbers."""

    name: str
    """For readers, ``PGA3.MOTOR``."""
    blades: tuple[str, ...]
    """Stored coefficients, in order."""
    fixed: tuple[tuple[str, str], ...] = ()
    """Coefficients that are the same for every element, and their value, ``("e123", "1")``."""
    unit: bool = False
    """Whether ``x ~x = 1`` is assumed."""
    related: bool = False
    """Whether other relations are assumed."""
    implied: tuple[tuple[str, str], ...] = ()
    """Coefficients that follow from the stored ones, and how: ``("einf", "1/2*e1*e1 + 1/2*e2*e2")``."""

    @property
    def is_scalar(self) -> bool:
        """Whether its elements are numbers."""
        return self.name == "SCALAR" and not self.blades

    @property
    def has_meaning(self) -> bool:
        """Whether it constrains its coefficients."""
        return self.unit or self.related


@dataclass(frozen=True, slots=True)
class KernelSource:
    """One kernel, ready to print."""

    program: Program
    summary: str
    """The author's docstring, dedented."""
    layouts: tuple[tuple[str, LayoutText], ...]
    """One for each argument and then for each result, under the program's names of them."""
    cost: Cost
    relations: tuple[str, ...] = ()
    """What the kernel assumes of its inputs, for readers: ``m ~m = 1``."""
    uniform: tuple[Uniform, ...] = ()
    """Forms for batches in which some arguments are the same for every element, the cheapest first."""
    operator: tuple[str, tuple[str, ...]] | None = None
    """The operator on values that the kernel is, ``*`` or ``()``, and the arguments that are its operands, in order."""
    result_names: tuple[str, ...] = ()
    """Names of the results, where a function around the kernel gives them as a named tuple."""
    error: str = ""
    """The measured error, ``1.5 ulp, 64 inputs``; empty while it is being measured."""

    @property
    def is_constant(self) -> bool:
        """Whether its only argument is there because kernels have one."""
        return bool(self.result_names) and [argument.name for argument in self.program.arguments] == [NOTHING]


@dataclass(frozen=True, slots=True)
class LoopSource:
    """One kernel with loops, ready to print.

    Attributes
    ----------
    procedure : Procedure
    summary : str
        The author's docstring, dedented.
    layouts : tuple of (str, LayoutText)
        Those of arguments and results by the names of their tables; index tables have none.
    costs : tuple of (str, Cost)
        Operations, and how often they run: ``""`` once, ``"n"`` for each row, ``"n*m"``.
    relations : tuple of str
        What the kernel assumes of its inputs, for readers.
    error : str
        The measured error, for readers.
    """

    procedure: Procedure
    summary: str
    layouts: tuple[tuple[str, LayoutText], ...]
    costs: tuple[tuple[str, Cost], ...]
    relations: tuple[str, ...] = ()
    error: str = ""


@dataclass(frozen=True, slots=True)
class ModuleSource:
    """All kernels of one spec."""

    name: str
    summary: str
    """The spec's docstring."""
    command: str
    """The command that makes it again."""
    spec_hash: str
    kernels: tuple[KernelSource, ...]
    loops: tuple[LoopSource, ...] = ()
    """Kernels with loops, which are printed behind the others."""
