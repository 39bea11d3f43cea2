"""Names that variables of emitted functions must not have in any target language."""

from __future__ import annotations

import keyword
import re

from .scalar import Op

_C_WORDS = frozenset(
    """
    asm auto bool break case char const constexpr continue default do double else enum extern false float for fortran
    goto if inline int long nullptr register restrict return short signed sizeof static struct switch thread_local true
    typedef typeof union unsigned void volatile while intptr_t uintptr_t linux unix i386
    """.split()  # noqa: SIM905
)
"""Keywords and types. Functions of ``<math.h>`` are not included, since a parameter can shadow a function."""

C_MACRO_NAMES = frozenset(
    """
    REAL WORD NAME FUNCTION PRECISION INLINE ON_v3 ON_v4 HAS_v3 HAS_v4 NAMES_MACHINES LOOP LOOPS WIDTH WIDTHS CHOSEN
    FUSED RUN FMA ANY_ORDER NOT_UNROLLED LANES NLANES CHUNK SPAN TILE PADDED SHUFFLE VECTOR NAN INFINITY NULL WHERE SIGN
    SIGN_BIT SHIFT FRACTION_BITS BIAS LOG_0 LOG_1 LOG_INVERSE QUARTER_0 QUARTER_1 QUARTER_2 QUARTER_INVERSE M_E M_PI
    DBL_MIN FLT_MIN
    """.split()  # noqa: SIM905
)
"""Macros in the headers that the runtime includes. The preprocessor would replace a kernel or variable of this name."""

LIKE_A_MACRO = re.compile(r"[A-Z][A-Z0-9_]+")
"""Names that headers or compiler options may define: FLT_MAX, M_LOG2E, ONLY_F64."""

RESERVED_BY_USE = frozenset({Op.FLOOR})
"""Operations whose names are reserved only in programs that use them, since they are common names of parameters."""

_FUNCTIONS = frozenset({"fabs", *(op.value for op in {*Op} - RESERVED_BY_USE), *(op.value.upper() for op in Op)})

RESERVED = (
    _C_WORDS | C_MACRO_NAMES | {"far"} | _FUNCTIONS | {*keyword.kwlist, *keyword.softkwlist, "range", "len", "empty"}
)
"""Names that a variable of an emitted function must not have in any target language."""


def legal(wanted: str) -> str:
    """Return the name closest to `wanted` that is legal in all target languages."""
    name = re.sub(r"\W", "_", wanted, flags=re.ASCII)
    if not name or name[0].isdigit() or name[0] == "_" or LIKE_A_MACRO.fullmatch(name):
        name = f"v{name}"
    while name in RESERVED:
        name += "_"
    return name
