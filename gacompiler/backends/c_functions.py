"""Transcendental functions as C text that compilers vectorise: `functions.c.jinja` filled with constants.

They are at most 2 ulp from the exact values (`tests/backends/test_transcendental.py` measures each), in the loops and
for one element alike, so that an element has the same result in a batch as alone.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..ir.program import Program
from ..ir.scalar import Op
from .approximations import APPROXIMATIONS, FARTHEST, coefficients, numbers

TRANSCENDENTAL = frozenset({Op.SIN, Op.COS, Op.ATAN2, Op.ACOS, Op.EXP, Op.LOG})
"""Operations that `functions.c.jinja` computes."""

TURNS = frozenset({Op.SIN, Op.COS})
"""Those that a loop computes for arguments up to `FARTHEST` only: it does a block with others in it once more."""


def has_turns(program: Program) -> bool:
    """Whether a program computes a sine or a cosine."""
    return any(line.op in TURNS for line in program.lines)


def is_transcendental(program: Program) -> bool:
    """Whether a program computes a sine or one of its kin: much for each number that it reads and writes."""
    return any(line.op in TRANSCENDENTAL for line in program.lines)


def constants() -> dict[str, str]:
    """The constants of both precisions, as C has them."""
    doubles, floats = numbers(double=True), numbers(double=False)
    known = {name: f"PRECISION({value!r}, {floats[name]!r}f)" for name, value in doubles.items()}
    return known | {"farthest": str(FARTHEST)}


def polynomial_lines(module: str) -> list[str]:
    """The polynomials, each as a C function in each precision, in two halves that processors compute side by side."""
    lines: list[str] = []
    for double, real, end in ((True, "double", "f64"), (False, "float", "f32")):
        fma = "fma" if double else "fmaf"
        for name in APPROXIMATIONS:
            texts = [f"{'' if double else '(float)'}{c!r}" for c in coefficients(name, double=double)]
            lines += [
                f"static INLINE {real} {module}_{name}_polynomial_{end}({real} z)",
                "{",
                f"    const {real} y = z * z;",
                f"    const {real} even = {_horner(fma, texts[0::2])};",
                f"    const {real} odd = {_horner(fma, texts[1::2])};",
                f"    return {fma}(z, odd, even);",
                "}",
                "",
            ]
    return lines[:-1]


def _horner(fma: str, texts: Sequence[str]) -> str:
    """A polynomial in ``y``."""
    return texts[0] if len(texts) == 1 else f"{fma}(y, {_horner(fma, texts[1:])}, {texts[0]})"
