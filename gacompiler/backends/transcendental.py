"""Classify the operations that are transcendental functions, which ``gac_runtime.h`` computes.

Their errors are at most 2 ulp (measured by `tests/backends/test_transcendental.py`). The functions are the same in
loops and for single elements, so that an element has the same result in a batch as on its own.
"""

from __future__ import annotations

from ..ir.program import Program
from ..ir.scalar import Op

TRANSCENDENTAL = frozenset({Op.SIN, Op.COS, Op.ATAN2, Op.ACOS, Op.EXP, Op.LOG})
"""Operations that are computed by branchless polynomials in C, so that compilers can vectorise loops over them."""

TRIGONOMETRIC = frozenset({Op.SIN, Op.COS})
"""Operations that vectorised loops compute only for arguments up to `FARTHEST`; other blocks are computed again."""


def has_trigonometric(program: Program) -> bool:
    """Whether a program computes a sine or a cosine."""
    return any(line.op in TRIGONOMETRIC for line in program.lines)


def is_transcendental(program: Program) -> bool:
    """Whether a program computes a transcendental function, so that computation outweighs memory access."""
    return any(line.op in TRANSCENDENTAL for line in program.lines)
