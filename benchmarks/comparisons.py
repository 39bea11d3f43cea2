"""Write the sections on hand-written C and on methods of calling; each lists the rows that miss its target."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from .by_hand import HandTimes
from .features import Features
from .markdown import ns, paragraph, ratio, table

BY_HAND = 1.15
"""Maximum time of a generated loop in cache, as a multiple of the hand-written loop."""
INTERLEAVED = 1.6
"""Maximum time of the loop in C order in cache, as a multiple of that in Fortran order."""
FUSED = 1.7
"""Minimum speedup of one fused kernel over three calls with ``out=``."""
OPERATOR, CALL = 30e-9, 100e-9
"""Maximum time of an operator, and of a call on arrays with ``out=``, for one element."""
TWO_THREADS = 1.5
"""Minimum speedup of two threads on two processors."""


def by_hand(found: Sequence[HandTimes], sizes: Sequence[int]) -> str:
    """Compare the generated loops with C that an expert would write."""
    text = [
        "## Comparison with hand-written C",
        "",
        paragraph(
            "Both loops are called from C, without overhead of Python.",
            "The hand-written loop (`benchmarks/by_hand.c`) is compiled with `-O3 -march=native`, once with the "
            "default vector width and once with 512 bits, and the faster result is used.",
            "Columns *ns*: nanoseconds per element of the generated loop in Fortran order.",
            "Columns *ratio*: its time divided by that of the hand-written loop.",
            "Columns *C*: the time of the generated loop in C order divided by its time in Fortran order.",
        ),
        "",
    ]
    if not found:
        return "\n".join([*text, "Not measured: no C compiler accepts the flags, or `gac build` was not run.", ""])
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
        missed(f"a ratio of at most {_hundredths(BY_HAND)} on {sizes[0]:,} elements", slow),
        missed(f"C order takes at most {_hundredths(INTERLEAVED)} times as long on {sizes[0]:,} elements", gaps),
    ]
    return "\n".join([*text, table(header, rows), *ends])


def features(found: Features) -> list[str]:
    """Return a section for each method of calling."""
    return [_fusion(found), _threads(found), _one_call(found), _uniform(found)]


def missed(target: str, rows: Iterable[str]) -> str:
    """Return a line with the target, and the rows that miss it."""
    names = list(rows)
    text = f"Target: {target}. " + (f"Missed: {'; '.join(names)}." if names else "All rows meet it.")
    return paragraph(text) + "\n"


def _fusion(found: Features) -> str:
    header = ("elements", "order", "three calls", "three calls, `out=`", "fused, `out=`", "speedup", "speedup, `out=`")
    rows, slow = [], []
    for row in found.fusion:
        plain, with_out, one = (row.times[name] for name in ("three", "three, out=", "fused, out="))
        rows.append(
            (f"{row.size:,}", row.order, ns(plain), ns(with_out), ns(one), ratio(plain / one), ratio(with_out / one))
        )
        if with_out / one < FUSED:
            slow.append(f"{row.size:,} {row.order} ({_hundredths(with_out / one)})")
    text = paragraph(
        "A point is moved by the product of two motors, and joined with another point: by three kernels, and by the "
        "fused kernel that `gacompiler.compile` makes of them.",
        "Nanoseconds per element, and the speedup of the fused kernel over three calls.",
    )
    return "\n".join(
        [
            "## Fusion",
            "",
            text,
            "",
            table(header, rows),
            missed(f"a speedup of at least {FUSED:g} over three calls with `out=`", slow),
        ]
    )


def _threads(found: Features) -> str:
    header = ("kernel", "elements", "1 thread", "2 threads", "speedup")
    rows, slow = [], []
    for row in found.threads:
        one, two = row.times["1"], row.times["2"]
        rows.append((row.title, f"{row.size:,}", ns(one), ns(two), ratio(one / two)))
        if one / two < TWO_THREADS:
            slow.append(f"{row.title} {row.size:,} ({_hundredths(one / two)})")
    text = paragraph(
        "Nanoseconds per element in Fortran order, and the speedup of two threads over one.",
        f"Only in this section, the process uses all available processors: {found.n_processors}.",
    )
    target = f"a speedup of at least {TWO_THREADS:g}"
    end = (
        missed(target, slow)
        if found.n_processors > 1
        else f"Target: {target}. It cannot be reached on one processor.\n"
    )
    return "\n".join(["## Threads", "", text, "", table(header, rows), end])


def _one_call(found: Features) -> str:
    rows, slow = [], []
    for operation in found.one_call:
        operator, call = list(operation.times.values())[:2]
        for name, spent in operation.times.items():
            rows.append((operation.title, name, ns(spent), ratio(spent / operator)))
            if name in operation.peers and spent < call:
                slow.append(f"{operation.title}: {name} is faster than the call")
        for what, spent, most in (("the operator", operator, OPERATOR), ("the call", call, CALL)):
            if spent > most:
                slow.append(f"{operation.title}: {what} takes {ns(spent)} ns")
    header = ("operation", "call", "ns", "ratio")
    text = "Nanoseconds for one element, called from Python, and the ratio to the first row, an operator of values."
    target = (
        f"at most {ns(OPERATOR)} ns for the operator and {ns(CALL)} ns for the call with `out=`, and no faster peer"
    )
    return "\n".join(["## One call", "", text, "", table(header, rows), missed(target, slow)])


def _uniform(found: Features) -> str:
    header = ("kernel", "elements", "order", "one motor each", "uniform motor", "speedup")
    rows, slow = [], []
    for row in found.uniform:
        each, one = row.times["each"], row.times["one"]
        rows.append((row.title, f"{row.size:,}", row.order, ns(each), ns(one), ratio(each / one)))
        if one > each:
            slow.append(f"{row.title} {row.size:,} {row.order}")
    text = paragraph(
        "One motor for each element, and one uniform motor for all elements: nanoseconds per element, and the speedup "
        "of the uniform motor.",
    )
    heading = "## Uniform arguments"
    return "\n".join(
        [
            heading,
            "",
            text,
            "",
            table(header, rows),
            missed("a uniform motor is faster than one motor for each element", slow),
        ]
    )


def _hundredths(value: float) -> str:
    return f"{value:.2f}"
