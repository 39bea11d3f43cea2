"""How calls are timed, in all benchmarks."""

from __future__ import annotations

import random
import statistics
import time
import timeit
from collections.abc import Callable, Mapping
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
_TURNS = 3
"""Parts of a measurement where calls take turns."""


Call = Callable[[], object] | timeit.Timer
"""What is timed: a function, or a statement, which costs no call around it."""


def least(calls: Mapping[str, Call], rounds: int, span: float = 0.0) -> dict[str, float]:
    """The least seconds of each call, of rounds in which they take turns: other work on the machine strikes all alike.

    A turn lasts about `span`: calls that are shorter are made in a row. What comes first does not count.
    """
    counts, spent = {}, {}
    for name, call in calls.items():
        _timed(call, 1)
        counts[name] = max(1, round(span / max(_timed(call, 1), 1e-7))) if span else 1
        spent[name] = float("inf")
    for _ in range(rounds):
        for name, call in calls.items():
            spent[name] = min(spent[name], _timed(call, counts[name]))
    return spent


def seconds(call: Callable[[], object], effort: Effort) -> float:
    """Seconds of one warm call: the median of repeats after a call that does not count."""
    call()
    once = max(_timed(call, 1), 1e-9)
    number = max(1, round(effort.span / once))
    repeats = effort.repeats if once < effort.patience else 1
    return statistics.median(_timed(call, number) for _ in range(repeats))


def in_turn(calls: Mapping[str, Call], effort: Effort) -> dict[str, float]:
    """Seconds of warm calls by name: as `seconds`, but they take short turns, each time in another order.

    What is compared meets the same busy moments then; it is for calls that do not take long.
    """
    numbers = {}
    for name, call in calls.items():
        _timed(call, 1)
        numbers[name] = max(1, round(effort.span / _TURNS / max(_timed(call, 1), 1e-9)))
    spent: dict[str, list[float]] = {name: [] for name in calls}
    shuffled = random.Random(0)
    for _ in range(effort.repeats * _TURNS):
        for name in shuffled.sample(list(calls), len(calls)):
            spent[name].append(_timed(calls[name], numbers[name]))
    return {name: statistics.median(times) for name, times in spent.items()}


def _timed(call: Call, number: int) -> float:
    if isinstance(call, timeit.Timer):
        return call.timeit(number) / number
    calls = range(number)
    start = time.perf_counter()
    for _ in calls:
        call()
    return (time.perf_counter() - start) / number
