"""Time calls, for all benchmarks."""

from __future__ import annotations

import random
import statistics
import time
import timeit
from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Effort:
    """The duration of a measurement.

    Attributes
    ----------
    repeats : int
        Number of repeated measurements. The result is their median.
    span : float
        Minimum duration of one measurement in seconds; short calls are repeated.
    patience : float
        Maximum duration of one call of a peer in seconds; slower peers are omitted.
    """

    repeats: int
    span: float
    patience: float


FULL = Effort(repeats=7, span=0.01, patience=1.0)
QUICK = Effort(repeats=3, span=0.0005, patience=0.1)
_PARTS = 3
"""Number of parts of a measurement if several calls are measured alternately."""


Call = Callable[[], object] | timeit.Timer
"""What is timed: a function, or a statement, which has no overhead of a function call."""


def minimum_times(
    calls: Mapping[str, Call], rounds: int, span: float = 0.0, clock: Callable[[], float] = time.perf_counter
) -> dict[str, float]:
    """Return the minimum time of each call in seconds, over rounds that measure all calls one after the other.

    Measuring alternately exposes all calls to the same load of the machine. A measurement lasts about `span` seconds;
    shorter calls are repeated. The first call of each function is not counted.
    """
    counts, spent = {}, {}
    for name, call in calls.items():
        _timed(call, 1, clock)
        counts[name] = max(1, round(span / max(_timed(call, 1, clock), 1e-7))) if span else 1
        spent[name] = float("inf")
    for _ in range(rounds):
        for name, call in calls.items():
            spent[name] = min(spent[name], _timed(call, counts[name], clock))
    return spent


def seconds(call: Callable[[], object], effort: Effort) -> float:
    """Return the median time of a call in seconds, after a first call that is not counted."""
    call()
    once = max(_timed(call, 1), 1e-9)
    number = max(1, round(effort.span / once))
    repeats = effort.repeats if once < effort.patience else 1
    return statistics.median(_timed(call, number) for _ in range(repeats))


def median_times(calls: Mapping[str, Call], effort: Effort) -> dict[str, float]:
    """Return the median times of several calls in seconds, measured alternately in random order.

    Measuring alternately exposes all calls to the same load of the machine. Use this function for short calls.
    """
    numbers = {}
    for name, call in calls.items():
        _timed(call, 1)
        numbers[name] = max(1, round(effort.span / _PARTS / max(_timed(call, 1), 1e-9)))
    spent: dict[str, list[float]] = {name: [] for name in calls}
    shuffled = random.Random(0)
    for _ in range(effort.repeats * _PARTS):
        for name in shuffled.sample(list(calls), len(calls)):
            spent[name].append(_timed(calls[name], numbers[name]))
    return {name: statistics.median(times) for name, times in spent.items()}


def _timed(call: Call, number: int, clock: Callable[[], float] = time.perf_counter) -> float:
    if isinstance(call, timeit.Timer):
        return call.timeit(number) / number
    calls = range(number)
    start = clock()
    for _ in calls:
        call()
    return (clock() - start) / number
