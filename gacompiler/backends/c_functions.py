"""Transcendental functions as C text that compilers vectorise: `functions.c.jinja` filled with constants.

They are at most 2 ulp from the exact values (`tests/test_c_functions.py` measures each), in the loops and for one
element alike, so that an element has the same result in a batch as alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import mpmath

from ..ir.program import Program
from ..ir.scalar import Op
from .approximations import APPROXIMATIONS, coefficients, parts, rounded

TRANSCENDENTAL = frozenset({Op.SIN, Op.COS, Op.ATAN2, Op.ACOS, Op.EXP, Op.LOG})
"""Operations that `functions.c.jinja` computes."""

TURNS = frozenset({Op.SIN, Op.COS})
"""Those that a loop computes for arguments up to `FARTHEST` only: it does a block with others in it once more."""

FARTHEST = 65536
"""Sines and cosines of larger arguments are the C library's. A multiple of pi/2 up to there has 16 bits."""

_DIGITS = 50
_SPARE = 53 - 16


def has_turns(program: Program) -> bool:
    """Whether a program computes a sine or a cosine."""
    return any(line.op in TURNS for line in program.lines)


def is_long(program: Program) -> bool:
    """Whether a program computes much for each number that it reads and writes."""
    return any(line.op in TRANSCENDENTAL for line in program.lines)


@cache
def constants() -> dict[str, str]:
    """The values of the constants in the template, by the name they have there."""
    with mpmath.workdps(_DIGITS):
        quarter = parts(mpmath.pi / 2, (_SPARE, _SPARE), double=True)
        known: dict[str, float] = {"turn_inverse": float(2 / mpmath.pi)}
        known |= {f"turn_{k}": part for k, part in enumerate(quarter)}
        for double, end, bits_of_log, bits_of_eighth in ((True, "f64", 41, 48), (False, "f32", 15, 20)):
            known[f"log_inverse_{end}"] = rounded(1 / mpmath.log(2), double=double)
            known[f"log_high_{end}"], known[f"log_low_{end}"] = parts(mpmath.log(2), (bits_of_log,), double=double)
            known[f"eighth_high_{end}"], known[f"eighth_low_{end}"] = parts(
                mpmath.pi / 4, (bits_of_eighth,), double=double
            )
    return {name: repr(value) for name, value in known.items()} | {"farthest": str(FARTHEST)}


def polynomial_lines(module: str) -> list[str]:
    """The polynomials, each as a C function in each precision, in two halves that processors compute side by side."""
    lines: list[str] = []
    for double, real, end in ((True, "double", "f64"), (False, "float", "f32")):
        for name in APPROXIMATIONS:
            texts = [f"{'' if double else '(float)'}{c!r}" for c in coefficients(name, double=double)]
            lines += [
                f"static INLINE {real} {module}_{name}_polynomial_{end}({real} z)",
                "{",
                f"    const {real} y = z * z;",
                f"    const {real} even = {_horner(texts[0::2])};",
                f"    const {real} odd = {_horner(texts[1::2])};",
                "    return even + z * odd;",
                "}",
                "",
            ]
    return lines[:-1]


def _horner(texts: Sequence[str]) -> str:
    """A polynomial in ``y``."""
    return texts[0] if len(texts) == 1 else f"{texts[0]} + y * ({_horner(texts[1:])})"
