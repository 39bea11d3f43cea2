"""Which operations of a program are transcendental functions, which ``gac_runtime.h`` computes.

They are at most 2 ulp from the exact values (`tests/backends/test_transcendental.py` measures each), in the loops and
for one element alike, so that an element has the same result in a batch as alone.
"""

from __future__ import annotations

from ..ir.program import Program
from ..ir.scalar import Op

TRANSCENDENTAL = frozenset({Op.SIN, Op.COS, Op.ATAN2, Op.ACOS, Op.EXP, Op.LOG})
"""Operations that are polynomials without branches in C, so that compilers vectorise loops over them."""

TURNS = frozenset({Op.SIN, Op.COS})
"""Those that a loop computes for arguments up to `FARTHEST` only: it does a block with others in it once more."""


def has_turns(program: Program) -> bool:
    """Whether a program computes a sine or a cosine."""
    return any(line.op in TURNS for line in program.lines)


def is_transcendental(program: Program) -> bool:
    """Whether a program computes a sine or one of its kin: much for each number that it reads and writes."""
    return any(line.op in TRANSCENDENTAL for line in program.lines)
