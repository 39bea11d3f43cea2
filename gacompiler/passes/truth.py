"""Points at which programs are compared with definitions, and the record of what was proved there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..ir.program import Program
from .samples import WORKING_DIGITS


@dataclass(frozen=True, slots=True)
class Truth:
    """Inputs of a kernel and the values of its definition there, in the order of the result arrays.

    Exact numbers are rational, or all of them are residues modulo a prime.
    """

    inputs: tuple[tuple[Any, ...], ...]
    results: tuple[tuple[Any, ...], ...]
    is_exact: bool
    n_digits: int = WORKING_DIGITS
    again: Callable[[int], Truth] | None = field(default=None, compare=False)
    """Computes irrational results with another number of digits."""


@dataclass(frozen=True, slots=True)
class Proof:
    """What a compilation proved. A text of the same programs does not have to be evaluated again.

    Attributes
    ----------
    programs : tuple of Program
        The program, and the forms for uniform arguments as whole programs.
    known : tuple of Truth
        The points, and the values of the definition there.
    is_for_all : bool
        Whether the programs were proved for all inputs, in addition to a few points. Other programs need more points.
    """

    programs: tuple[Program, ...]
    known: tuple[Truth, ...]
    is_for_all: bool = False
