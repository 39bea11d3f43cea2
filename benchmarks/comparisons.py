"""Sections of the page on hand-written C and on ways of calling; each says which rows miss its target."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

from .by_hand import HandTimes
from .features import Features
from .markdown import MISSING, ns, ratio, table

BY_HAND = 1.1
"""The most that a generated loop may take, in times of the hand-written one."""
TWO_THREADS = 1.5
"""The least that two threads are to gain where there are two processors."""


def by_hand(found: Sequence[HandTimes], sizes: Sequence[int]) -> str:
    """The generated loops beside C that an expert would write."""
    text = [
        "## Beside hand-written C",
        "",
        "Both loops are called from C, so Python costs neither anything. The hand-written one (`benchmarks/by_hand.c`)",
        "is compiled for this very machine, once with vectors as the compiler likes and once with 512 bits; the faster",
        "counts. Structures of arrays: nanoseconds for each element of the generated loop, and how many times as long",
        "it takes as the hand-written one. C: the generated loop on elements after one another, in times of its own on",
        "structures of arrays.",
        "",
    ]
    if not found:
        return "\n".join([*text, "Not measured: no C compiler that takes the flags, or `gac build` was not run.", ""])
    header = ("kernel", "type")
    for columns in ("{:,} ns", "{:,} ratio", "{:,} C"):
        header += tuple(columns.format(size) for size in sizes)
    rows, slow = [], []
    for times in found:
        ratios = [own / hand for own, hand in zip(times.own, times.hand, strict=True)]
        dense = [other / own for other, own in zip(times.interleaved, times.own, strict=True)]
        cells = [*map(ns, times.own), *map(_hundredths, ratios), *map(_hundredths, dense)]
        rows.append((times.title, times.kind, *cells))
        slow += [
            f"{times.title} {times.kind} {size:,} ({_hundredths(value)})"
            for size, value in zip(sizes, ratios, strict=True)
            if round(value, 2) > BY_HAND
        ]
    return "\n".join([*text, table(header, rows), missed(f"a ratio of at most {_hundredths(BY_HAND)}", slow)])


def features(found: Features) -> list[str]:
    """A section for each way of calling."""
    return [_fusion(found), _threads(found), _one_call(found), _same(found), _numba(found)]


def missed(target: str, rows: Iterable[str]) -> str:
    """A line that says what was wanted, and where it was not reached."""
    names = list(rows)
    text = f"Target: {target}. " + (f"Missed: {'; '.join(names)}." if names else "No row misses it.")
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False) + "\n"


def _fusion(found: Features) -> str:
    header = ("elements", "order", "three calls", "three calls, `out=`", "one kernel, `out=`", "times", "times, `out=`")
    rows, slow = [], []
    for row in found.fusion:
        plain, with_out, one = (row.times[name] for name in ("three", "three, out=", "fused, out="))
        rows.append(
            (f"{row.size:,}", row.order, ns(plain), ns(with_out), ns(one), ratio(plain / one), ratio(with_out / one))
        )
        if one > with_out:
            slow.append(f"{row.size:,} {row.order}")
    text = (
        "The product of two motors moves a point, which is joined to another: three kernels, and one that\n"
        "`gacompiler.compile` makes of the same three. Nanoseconds for each element, and how many times as long three\n"
        "calls take.\n"
    )
    return "\n".join(
        ["## Fusion", "", text, table(header, rows), missed("one kernel is faster than three calls", slow)]
    )


def _threads(found: Features) -> str:
    header = ("kernel", "elements", "1 thread", "2 threads", "times")
    rows, slow = [], []
    for row in found.threads:
        one, two = row.times["1"], row.times["2"]
        rows.append((row.title, f"{row.size:,}", ns(one), ns(two), ratio(one / two)))
        if one / two < TWO_THREADS:
            slow.append(f"{row.title} {row.size:,} ({_hundredths(one / two)})")
    text = (
        "Nanoseconds for each element, Fortran order, and how many times as long one thread takes. Here alone the\n"
        f"process may use all processors that it is given: {found.n_processors}.\n"
    )
    target = f"two threads gain {TWO_THREADS:g} times"
    end = missed(target, slow) if found.n_processors > 1 else f"Target: {target}. Not to be had on one processor.\n"
    return "\n".join(["## Threads", "", text, table(header, rows), end])


def _one_call(found: Features) -> str:
    rows, slow = [], []
    for operation in found.one_call:
        best = next(iter(operation.times.values()))
        for name, spent in operation.times.items():
            rows.append((operation.title, name, ns(spent), ratio(spent / best)))
            if name in operation.peers and spent < best:
                slow.append(f"{operation.title}: {name}")
    header = ("operation", "call", "ns", "times")
    text = "Nanoseconds for one element from Python, and in times of the operator of our types (the first row).\n"
    return "\n".join(["## One call", "", text, table(header, rows), missed("no peer is faster", slow)])


def _same(found: Features) -> str:
    header = ("kernel", "elements", "order", "one motor each", "one motor", "times")
    rows, slow = [], []
    for row in found.same:
        each, one = row.times["each"], row.times["one"]
        rows.append((row.title, f"{row.size:,}", row.order, ns(each), ns(one), ratio(each / one)))
        if one > each:
            slow.append(f"{row.title} {row.size:,} {row.order}")
    text = (
        "One motor for all elements, and one for each: nanoseconds for each element, and how many times as long it\n"
        "takes with a motor for each.\n"
    )
    heading = "## Arguments that stay the same"
    return "\n".join([heading, "", text, table(header, rows), missed("one motor is faster than one for each", slow)])


def _numba(found: Features) -> str:
    heading = "## numba beside C"
    if not found.numba:
        return "\n".join([heading, "", "Not measured: C is not built, so numba runs all kernels above.", ""])
    columns = list(dict.fromkeys((row.size, row.order) for row in found.numba))
    ratios = {(row.title, row.size, row.order): row.times["numba"] / row.times["c"] for row in found.numba}
    titles = list(dict.fromkeys(row.title for row in found.numba))
    rows = [(title, *(_cell(ratios.get((title, *column))) for column in columns)) for title in titles]
    slow = [f"{title} {size:,} {order}" for (title, size, order), value in ratios.items() if value < 1]
    text = "How many times as long a kernel takes on numba as in C, float64, called from Python with `out=`.\n"
    header = ("kernel", *(f"{size:,} {order}" for size, order in columns))
    return "\n".join([heading, "", text, table(header, rows), missed("C is not slower than numba", slow)])


def _cell(value: float | None) -> str:
    return MISSING if value is None else ratio(value)


def _hundredths(value: float) -> str:
    return f"{value:.2f}"
