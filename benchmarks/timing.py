"""One way to time a call, for everything here."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Effort:
    """How long a measurement may take.

    Attributes
    ----------
    repeats : int
        Measurements, of which the median counts.
    span : float
        Seconds that one of them lasts at least; short calls are made in a row.
    patience : float
        Seconds. A peer that would take longer for one call is left out.
    """

    repeats: int
    span: float
    patience: float


FULL = Effort(repeats=7, span=0.01, patience=1.0)
QUICK = Effort(repeats=3, span=0.0005, patience=0.1)


def seconds(call: Callable[[], object], effort: Effort) -> float:
    """Seconds of one warm call: the median of repeats after a call that does not count."""
    call()
    once = max(_timed(call, 1), 1e-9)
    number = max(1, round(effort.span / once))
    repeats = effort.repeats if once < effort.patience else 1
    return statistics.median(_timed(call, number) for _ in range(repeats))


def _timed(call: Callable[[], object], number: int) -> float:
    calls = range(number)
    start = time.perf_counter()
    for _ in calls:
        call()
    return (time.perf_counter() - start) / number
