"""Problems that are solved by several libraries, and their times as text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from .timing import minimum_times

OURS = "gacompiler"
_SPAN = 0.005
"""Minimum duration of a measurement in seconds; short calls are repeated."""


@dataclass(frozen=True, slots=True)
class Task:
    """One problem, and its calls by library."""

    name: str
    elements: int
    """Number of problems or points per call. Times are divided by it."""
    calls: dict[str, Callable[[], object]]


def interleaved(task: Task, rounds: int) -> dict[str, float]:
    """Return the minimum times in microseconds per element, over rounds that measure all calls alternately."""
    return {name: 1e6 * spent / task.elements for name, spent in minimum_times(task.calls, rounds, _SPAN).items()}


def time_text(spent: float) -> str:
    """Return a time in microseconds with three significant digits, or in whole microseconds."""
    if spent >= 100:
        return f"{spent:,.0f}"
    return f"{spent:.1f}" if spent >= 10 else f"{spent:.2f}" if spent >= 1 else f"{spent:.3f}"


def others_text(times: dict[str, float]) -> str:
    """Return the times of other libraries, separated by commas."""
    return ", ".join(f"{name} {time_text(spent)}" for name, spent in times.items() if name != OURS)
