"""Effort levels: how much work the compiler spends on a kernel.

Work is counted in units that depend on the kernel only, such as pairs of terms that are multiplied, so that results are
the same on every machine. Level 0 computes the author's structure with common subexpressions shared. Each further level
keeps the candidates of the level below, so that a higher level never gives a costlier program.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import KernelError


@dataclass(frozen=True, slots=True)
class Effort:
    """The limits of one level.

    Attributes
    ----------
    level : int
    largest : int
        Polynomials with more terms than this are never expanded for factorisation.
    hopeless : int
        Systems with more terms than this multiple of the best cost so far are not factorised. They are unlikely to
        become cheapest, and the time grows with the square of the number of terms of a sum.
    first, more : int
        Maximum number of pairs of terms for comparing systems, and for refining the best systems.
    refined : int
        Number of best systems that are refined by all policies.
    lowering, all_lowering : int
        Maximum number of pairs of terms that are multiplied to expand one choice of named results, and in total. At
        level 1, the best choices of all known kernels require at most 2 200, and are found within the total.
    stages : int
        Up to this number of stages, all sets of named results are tried.
    lines : int
        Maximum total number of lines of the forms of a long script.
    """

    level: int
    largest: int
    hopeless: int
    first: int
    more: int
    refined: int
    lowering: int
    all_lowering: int
    stages: int
    lines: int


LEVELS = (
    Effort(0, 0, 0, 0, 0, 0, 0, 0, 0, 0),
    Effort(1, 1_500, 3, 14_000, 8_000, 3, 10_000, 300_000, 3, 140_000),
    Effort(2, 6_000, 4, 200_000, 120_000, 6, 60_000, 3_000_000, 5, 1_000_000),
    Effort(3, 40_000, 8, 8_000_000, 8_000_000, 24, 600_000, 60_000_000, 9, 10_000_000),
)
"""The limits of each level."""
DEFAULT = 1


def effort_of(level: int) -> Effort:
    """Return the limits of a level.

    Raises
    ------
    KernelError
        If there is no such level.
    """
    if isinstance(level, bool) or not isinstance(level, int) or not 0 <= level < len(LEVELS):
        raise KernelError("effort", repr(level), f"a level from 0 to {len(LEVELS) - 1}")
    return LEVELS[level]
