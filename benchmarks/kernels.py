"""Time generated kernels, and calls of other libraries on the same arrays in the same run."""

from __future__ import annotations

import functools
import importlib
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import libraries
from .cases import CASES, Case
from .timing import Effort, seconds

SIZES = (1, 1_000, 100_000, 1_000_000)
QUICK_SIZES = (1, 1_000)
TYPES = ("float64", "float32")
ORDERS = ("C", "F")
"""Memory orders: with C, the coefficients of an element are contiguous; with F, each coefficient is contiguous."""

_COMPARED = 40
"""Number of elements on which a peer must agree before it is timed."""


@dataclass(frozen=True, slots=True)
class PeerTimes:
    """Seconds per element of one peer for each size; None if it is too slow to be measured."""

    library: str
    text: str
    times: tuple[float | None, ...]


@dataclass(frozen=True, slots=True)
class KernelTimes:
    """The times of one case.

    Attributes
    ----------
    times : dict of (type, order) to tuple of float
        Seconds per element for each size.
    moved : int
        Number of coefficients read and written per element.
    """

    case: Case
    cost: dict[str, int]
    moved: int
    times: dict[tuple[str, str], tuple[float, ...]]
    peers: tuple[PeerTimes, ...]

    @property
    def operations(self) -> int:
        """Number of operations per element; a square root or a function call counts as one."""
        return sum(self.cost[name] for name in ("mul", "add", "div", "sqrt", "call"))


def backends() -> dict[str, str]:
    """Return the backend of each module."""
    names = dict.fromkeys(case.module for case in CASES)
    return {name: importlib.import_module(f"generated.{name}").backend for name in names}


def measure(case: Case, sizes: Sequence[int], effort: Effort, progress: Callable[[str], None]) -> KernelTimes:
    """Time one kernel in every type and order, and its peers in float64 and C order.

    Raises
    ------
    RuntimeError
        If a peer gives a different result.
    """
    progress(case.title)
    kernel: Any = getattr(importlib.import_module(f"generated.{case.module}"), case.kernel)
    given = {size: case.arguments(np.random.default_rng(size), lead_of(size)) for size in sizes}
    times = {
        (kind, order): tuple(_own(kernel, given[size], lead_of(size), kind, order, effort) / size for size in sizes)
        for kind in TYPES
        for order in ORDERS
    }
    shapes = re.findall(r"\(([^)]*)\)", kernel.signature)
    lengths = [int(np.prod([int(n) for n in shape.split(",") if n], dtype=int)) for shape in shapes]
    sample = case.arguments(np.random.default_rng(1), (2,))
    uniform = [np.ndim(x) == bool(shape) + shape.count(",") for x, shape in zip(sample, shapes, strict=False)]
    moved = sum(length for k, length in enumerate(lengths) if k >= len(uniform) or not uniform[k])
    return KernelTimes(case, dict(kernel.cost), moved, times, tuple(_peers(case, kernel, given, effort)))


def lead_of(size: int) -> tuple[int, ...]:
    """Return the leading shape of arrays of `size` elements; one element has no leading axis."""
    return () if size == 1 else (size,)


def _own(
    kernel: Any, arrays: Sequence[np.ndarray], lead: tuple[int, ...], kind: str, order: str, effort: Effort
) -> float:
    call, _ = ready(kernel, arrays, order, kind)
    return seconds(call, effort)


def ready(
    kernel: Any, arrays: Sequence[np.ndarray], order: str, kind: str = "float64"
) -> tuple[Callable[[], object], Any]:
    """Return a call of a kernel on arrays of an order and type, and the arrays passed to it as ``out``."""
    arguments = [np.array(array, dtype=kind, order=order) for array in arrays]
    results = kernel(*arguments)
    outs = tuple(np.array(result, order=order) for result in (results if isinstance(results, tuple) else (results,)))
    out = outs if len(outs) > 1 else outs[0]
    return functools.partial(kernel, *arguments, out=out), out


def _peers(case: Case, kernel: Any, given: dict[int, tuple[np.ndarray, ...]], effort: Effort) -> list[PeerTimes]:
    found = []
    for peer in case.peers:
        if not libraries.installed(peer.library):
            continue

        def prepare(arrays: Sequence[np.ndarray], peer: Any = peer) -> libraries.Call:
            return libraries.Call(peer.prepare(*arrays), peer.read)

        times = _peer(case, kernel, peer.text, prepare, peer.expect, peer.largest, given, effort)
        found.append(PeerTimes(peer.library, peer.text, times))
    for name, (library, largest) in libraries.LIBRARIES.items():
        if case.formula and libraries.installed(name):

            def prepare(arrays: Sequence[np.ndarray], library: Any = library) -> libraries.Call:
                return library(kernel, case.module, case.formula, arrays)

            text = f"`{libraries.FORMULAS[case.formula]}`"
            times = _peer(case, kernel, name, prepare, np.asarray, largest, given, effort)
            found.append(PeerTimes(name, text, times))
    return found


def _peer(
    case: Case,
    kernel: Any,
    name: str,
    prepare: Callable[[Sequence[np.ndarray]], libraries.Call],
    expect: Callable[[np.ndarray], np.ndarray],
    largest: int,
    given: dict[int, tuple[np.ndarray, ...]],
    effort: Effort,
) -> tuple[float | None, ...]:
    for lead in ((), (_COMPARED,)) if largest > 1 else ((),):
        arrays = case.arguments(np.random.default_rng(7), lead)
        call = prepare(arrays)
        theirs, ours = call.read(call.run()), expect(kernel(*arrays))
        if theirs.shape != ours.shape or not np.allclose(theirs, ours, rtol=1e-8, atol=1e-8):
            raise RuntimeError(f"{case.title}: {name} gives a different result")
    times: list[float | None] = []
    for size, arrays in given.items():
        last = next((time for time in reversed(times) if time is not None), None)
        # The time for one element is mostly call overhead.
        too_slow = last is not None and len(times) > 1 and last * size > effort.patience
        times.append(None if size > largest or too_slow else seconds(prepare(arrays).run, effort) / size)
    return tuple(times)
