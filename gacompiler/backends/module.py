"""Data that the backends print: a module with its name, origin and kernels."""

from __future__ import annotations

from dataclasses import dataclass

from ..gac_runtime.layout import Layout
from ..ir.cost import Cost
from ..ir.procedure import Procedure
from ..ir.program import Program
from ..ir.uniform import Uniform

NOTHING = "nothing"
"""The name of the argument of kernels with named results that need no argument."""


@dataclass(frozen=True, slots=True)
class KernelSource:
    """One kernel, ready to print."""

    program: Program
    summary: str
    """The author's docstring, dedented."""
    layouts: tuple[tuple[str, Layout], ...]
    """The layouts of the arguments and then of the results, with their names in the program."""
    cost: Cost
    relations: tuple[str, ...] = ()
    """Relations assumed of the inputs, for documentation: ``m ~m = 1``."""
    uniform: tuple[Uniform, ...] = ()
    """Variants for batches in which some arguments are the same for every element, the cheapest first."""
    operator: tuple[str, tuple[str, ...]] | None = None
    """The operator on values that the kernel implements, such as ``*`` or ``()``, and its operands in order."""
    result_names: tuple[str, ...] = ()
    """Names of the results, if a wrapper of the kernel returns them as a named tuple."""
    error: str = ""
    """The measured error, such as ``1.5 ulp, 64 inputs``; empty while it is being measured."""

    @property
    def is_constant(self) -> bool:
        """Whether its only argument is a placeholder, because kernels need at least one."""
        return bool(self.result_names) and [argument.name for argument in self.program.arguments] == [NOTHING]


@dataclass(frozen=True, slots=True)
class LoopSource:
    """One kernel with loops, ready to print.

    Attributes
    ----------
    procedure : Procedure
    summary : str
        The author's docstring, dedented.
    layouts : tuple of (str, Layout)
        The layouts of arguments and results by the names of their tables; index tables have none.
    costs : tuple of (str, Cost)
        Operations with the number of times they run: ``""`` for once, ``"n"`` for each row, ``"n*m"``.
    relations : tuple of str
        Relations assumed of the inputs, for documentation.
    error : str
        The measured error, for documentation.
    """

    procedure: Procedure
    summary: str
    layouts: tuple[tuple[str, Layout], ...]
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
    """The command that regenerates the module."""
    spec_hash: str
    kernels: tuple[KernelSource, ...]
    loops: tuple[LoopSource, ...] = ()
    """Kernels with loops, which are printed after the others."""
