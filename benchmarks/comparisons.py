"""Sections of the page on hand-written C and on ways of calling; each says which rows miss its target."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

from .by_hand import HandTimes
from .features import Features
from .markdown import ns, ratio, table

BY_HAND = 1.15
"""The most that a generated loop may take in cache, in times of the hand-written one."""
INTERLEAVED = 1.6
"""The most that elements after one another may take in cache, in times of structures of arrays."""
FUSED = 1.7
"""The least that one kernel is to gain over three calls that write to given arrays."""
OPERATOR, CALL = 30e-9, 100e-9
"""The most that an operator, and a call on arrays with `out=`, may take for one element."""
TWO_THREADS = 1.5
"""The least that two threads are to gain where there are two processors."""


def by_hand(found: Sequence[HandTimes], sizes: Sequence[int]) -> str:
    """The generated loops beside C that an expert would write."""
    text = [
        "## Beside hand-written C",
        "",
        "Both loops are called from C, so Python costs neither anything. The hand-written one (`benchmarks/by_hand.c`)",
        "is compiled with -O3 for this very machine, once with vectors as the compiler likes and once with 512 bits;",
        "the faster counts. Structures of arrays: nanoseconds for each element of the generated loop, and how many",
        "times as long it takes as the hand-written one. C: the generated loop on elements after one another, in times",
        "of its own on structures of arrays.",
        "",
    ]
    if not found:
        return "\n".join([*text, "Not measured: no C compiler that takes the flags, or `gac build` was not run.", ""])
    header = ("kernel", "type")
    for columns in ("{:,} ns", "{:,} ratio", "{:,} C"):
        header += tuple(columns.format(size) for size in sizes)
    rows, slow, gaps = [], [], []
    for times in found:
        ratios = [own / hand for own, hand in zip(times.own, times.hand, strict=True)]
        dense = [other / own for other, own in zip(times.interleaved, times.own, strict=True)]
        cells = [*map(ns, times.own), *map(_hundredths, ratios), *map(_hundredths, dense)]
        rows.append((times.title, times.kind, *cells))
        name = f"{times.title} {times.kind}"
        slow += [f"{name} ({_hundredths(ratios[0])})"] if round(ratios[0], 2) > BY_HAND else []
        gaps += [f"{name} ({_hundredths(dense[0])})"] if round(dense[0], 2) > INTERLEAVED else []
    ends = [
        missed(f"at {sizes[0]:,} a ratio of at most {_hundredths(BY_HAND)}", slow),
        missed(f"at {sizes[0]:,} C order takes at most {_hundredths(INTERLEAVED)} times as long", gaps),
    ]
    return "\n".join([*text, table(header, rows), *ends])


def features(found: Features) -> list[str]:
    """A section for each way of calling."""
    return [_fusion(found), _threads(found), _one_call(found), _same(found)]


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
        if with_out / one < FUSED:
            slow.append(f"{row.size:,} {row.order} ({_hundredths(with_out / one)})")
    text = (
        "The product of two motors moves a point, which is joined to another: three kernels, and one that\n"
        "`gacompiler.compile` makes of the same three. Nanoseconds for each element, and how many times as long three\n"
        "calls take.\n"
    )
    return "\n".join(
        [
            "## Fusion",
            "",
            text,
            table(header, rows),
            missed(f"one kernel gains {FUSED:g} times over calls with `out=`", slow),
        ]
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
        operator, call = list(operation.times.values())[:2]
        for name, spent in operation.times.items():
            rows.append((operation.title, name, ns(spent), ratio(spent / operator)))
            if name in operation.peers and spent < call:
                slow.append(f"{operation.title}: {name} is faster than ours")
        for what, spent, most in (("the operator", operator, OPERATOR), ("the call", call, CALL)):
            if spent > most:
                slow.append(f"{operation.title}: {what} takes {ns(spent)}")
    header = ("operation", "call", "ns", "times")
    text = "Nanoseconds for one element from Python, and in times of the operator of our types (the first row).\n"
    target = f"at most {ns(OPERATOR)} for the operator and {ns(CALL)} for the call with `out=`, and no peer is faster"
    return "\n".join(["## One call", "", text, table(header, rows), missed(target, slow)])


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


def _hundredths(value: float) -> str:
    return f"{value:.2f}"
