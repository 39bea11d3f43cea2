"""The x86-64 level of this machine, which determines the vector instructions used by libraries that are built here."""

from __future__ import annotations

import functools
import os
import sys
from pathlib import Path

PORTABLE = 0
"""The level of libraries that run on every machine: they contain loops for each level and select one at run time."""

_FACTS = Path("/proc/cpuinfo")

_NEEDED = {
    3: "avx avx2 f16c fma abm movbe bmi1 bmi2 popcnt cx16 lahf_lm pni ssse3 sse4_1 sse4_2",
    4: "avx512f avx512bw avx512cd avx512dq avx512vl",
}
"""Processor flags, as Linux names them, that a level requires in addition to those of the previous level."""


@functools.cache
def machine_level() -> int:
    """Return the level of this machine: 4 with AVX-512, 3 with AVX2, or 1; `PORTABLE` if it is unknown.

    The level is known on Linux for x86-64. On other systems libraries are portable. The environment variable GAC_LEVEL
    selects a lower level.

    Raises
    ------
    ImportError
        If GAC_LEVEL is not a level.
    """
    return _limited(_found_level(), os.environ.get("GAC_LEVEL", ""))


def _limited(level: int, text: str) -> int:
    """Return the level, or a lower one that is selected by `text`."""
    if text not in ("", "1", *map(str, _NEEDED)):
        raise ImportError(f"GAC_LEVEL: {text!r}; expected 1, 3 or 4")
    return min(level, int(text)) if text else level


def _found_level() -> int:
    if sys.platform != "linux" or os.uname().machine != "x86_64":
        return PORTABLE
    try:
        with _FACTS.open(encoding="ascii", errors="replace") as facts:
            flags = next((line for line in facts if line.startswith("flags")), "")
    except OSError:
        return PORTABLE
    return level_of(flags.partition(":")[2].split()) if flags else PORTABLE


def level_of(flags: list[str]) -> int:
    """Return the level of a processor with these flags."""
    level = 1
    for next_level, needed in _NEEDED.items():
        if not set(needed.split()) <= set(flags):
            break
        level = next_level
    return level
