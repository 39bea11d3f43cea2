"""Write the page of a run; rows and their order are the same in every run."""

from __future__ import annotations

from dataclasses import dataclass

from . import comparisons
from .building import Building
from .by_hand import HandTimes
from .features import Features
from .generation import Generation
from .kernels import ORDERS, TYPES, KernelTimes
from .machine import Machine
from .markdown import MISSING, item, ns, paragraph, ratio, seconds, table

_BYTES = {"float64": 8, "float32": 4}
TIMES = {"kingdon": 20.0, "clifford": 500.0}
"""Minimum time of these libraries on batches that fit in a cache, as a multiple of that of the kernel; others: 1."""
IN_CACHE = 1_000
"""Maximum size of such batches."""
BUILD = 60.0
"""Maximum time of the C build on two processors, in seconds."""
SHARE = 0.8
"""Minimum share of the memory bandwidth."""


@dataclass(frozen=True, slots=True)
class Run:
    """The results of one run."""

    machine: Machine
    generation: Generation
    building: Building | None
    sizes: tuple[int, ...]
    kernels: tuple[KernelTimes, ...]
    hand_sizes: tuple[int, ...]
    by_hand: tuple[HandTimes, ...]
    features: Features
    backends: dict[str, str]
    missing: tuple[str, ...]
    quick: bool
    repeats: int
    figure: str | None


def page(run: Run) -> str:
    """Return the page as Markdown."""
    sections = [_opening(run), _machine(run), _method(run), _generation(run), _building(run)]
    sections += [_kernels(run, kind) for kind in TYPES]
    sections += [_peers(run), comparisons.by_hand(run.by_hand, run.hand_sizes), *comparisons.features(run.features)]
    sections.append(_bandwidth(run))
    return "\n".join(sections)


def _opening(run: Run) -> str:
    lines = ["# Benchmarks", "", "`make bench` writes this page; do not edit it by hand."]
    if run.quick:
        lines += [
            "",
            "**This is a quick run, which only checks that everything works. Its results are not representative.**",
        ]
    return "\n".join([*lines, ""])


def _machine(run: Run) -> str:
    return "## Machine\n\n" + table(("property", "value"), run.machine.facts)


def _method(run: Run) -> str:
    ran = "; ".join(f"{module}: {backend}" for module, backend in run.backends.items())
    lines = [
        "## Method",
        "",
        item(
            "All calls use one thread on one processor.",
            f"Each time is the median of {run.repeats} measurements after a warm-up call; short calls are repeated "
            "within a measurement.",
        ),
        item("Kernels are called from Python with `out=`, so the time for 1 element is that of one call."),
        item(f"The backends of the modules are: {ran}."),
        item("Arguments are random. There is a versor for each element, unless the row says one motor."),
        item(
            "A *peer* is a call of another library that gives the same result from the same numbers.",
            "The results are compared before it is timed.",
            "Arguments in another form (matrices, its own objects) are prepared before the time is measured.",
        ),
    ]
    if run.missing:
        names = ", ".join(run.missing)
        lines.append(
            item(f"Not installed, so without rows: {names}. `make .venv/.peers` installs all of them except pin.")
        )
    return "\n".join([*lines, ""])


def _generation(run: Run) -> str:
    found = run.generation
    slowest = found.slowest[0]
    total = sum(module.total for module in found.modules)
    number = sum(module.n_kernels for module in found.modules)
    summary = [
        ("kernels", str(number)),
        ("median", seconds(found.median)),
        ("slowest", f"{seconds(slowest.total)}, {slowest.module}.{slowest.kernel}"),
        ("above 0.1 s", str(found.above(0.1))),
        ("above 1 s", str(found.above(1.0))),
        ("all modules, including printing", seconds(total)),
    ]
    modules = [(module.module, str(module.n_kernels), seconds(module.total)) for module in found.modules]
    kernels = [
        (f"{time.module}.{time.kernel}", seconds(time.compiling), seconds(time.rounding), seconds(time.total))
        for time in found.slowest
    ]
    return "\n".join(
        [
            "## Generation",
            "",
            "Time from a definition to a proved program with its measured rounding error, as in `gac generate`.",
            "",
            table(("all kernels", "time"), summary),
            table(("module", "kernels", "time"), modules),
            "The ten slowest kernels:",
            "",
            table(("kernel", "compile and prove", "rounding error", "total"), kernels),
        ]
    )


def _building(run: Run) -> str:
    found = run.building
    if found is None:
        return "## C build\n\nNot measured, because there is no C compiler.\n"
    rows = [(each.module, f"{each.source / 1e6:.2f}", f"{each.library / 1e6:.2f}") for each in found.libraries]
    sums = (sum(each.source for each in found.libraries), sum(each.library for each in found.libraries))
    rows.append(("all", *(f"{each / 1e6:.2f}" for each in sums)))
    return "\n".join(
        [
            "## C build",
            "",
            paragraph(
                f"Building all libraries from scratch on all processors takes {seconds(found.cold)}.",
                f"If nothing has changed, it takes {seconds(found.again)}.",
            ),
            "",
            table(("module", "C, MB", "library, MB"), rows),
            comparisons.missed(f"at most {seconds(BUILD)}", [seconds(found.cold)] if found.cold > BUILD else []),
        ]
    )


def _kernels(run: Run, kind: str) -> str:
    columns = [(size, order) for size in run.sizes for order in (ORDERS if size > 1 else ORDERS[:1])]
    header = ("kernel", "mul", "add", "others")
    header += tuple(f"{size:,}" + (f" {order}" if size > 1 else "") for size, order in columns)
    rows = []
    for kernel in run.kernels:
        others = ", ".join(f"{kernel.cost[name]} {name}" for name in ("div", "sqrt", "call") if kernel.cost[name])
        times = [ns(kernel.times[kind, order][run.sizes.index(size)]) for size, order in columns]
        rows.append((kernel.case.title, str(kernel.cost["mul"]), str(kernel.cost["add"]), others, *times))
    return "\n".join(
        [
            f"## Kernels, {kind}",
            "",
            paragraph(
                "Nanoseconds per element, by number of elements and memory order.",
                "C: C order, in which the coefficients of an element are contiguous.",
                "F: Fortran order, in which each coefficient is contiguous (structure of arrays).",
            ),
            "",
            table(header, rows),
        ]
    )


def _peers(run: Run) -> str:
    header = ("kernel", "peer", "what it computes", *(f"{size:,}" for size in run.sizes))
    rows, slow = [], []
    for kernel in run.kernels:
        for peer in kernel.peers:
            # kingdon stores an array for each coefficient
            own = kernel.times["float64", "F" if peer.library == "kingdon" else "C"]
            found = dict(zip(run.sizes, zip(peer.times, own, strict=True), strict=True))
            ratios = {size: theirs / ours for size, (theirs, ours) in found.items() if theirs is not None}
            slow += [
                f"{kernel.case.title} {size:,} ({peer.library}, {ratio(times)})"
                for size, times in ratios.items()
                if times < (TIMES.get(peer.library, 1.0) if 1 < size <= IN_CACHE else 1.0)
            ]
            cells = [ratio(ratios[size]) if size in ratios else MISSING for size in run.sizes]
            rows.append((kernel.case.title, peer.library, peer.text, *cells))
    target = f"on {IN_CACHE:,} elements, " + " and ".join(
        f"{name} takes {times:g} times as long" for name, times in TIMES.items()
    )
    target += "; no peer is faster"
    return "\n".join(
        [
            "## Peers",
            "",
            paragraph(
                "The time of the peer divided by that of the kernel, in float64 and the same run.",
                "The kernel runs in C order, and in Fortran order for the comparison with kingdon, which stores "
                "an array for each coefficient.",
                f"{MISSING}: not measured, because it takes too long, or because the peer only accepts single "
                "elements. clifford computes one element at a time, so its time per element does not depend on "
                "the number of elements.",
            ),
            "",
            table(header, rows),
            comparisons.missed(target, slow),
        ]
    )


def _bandwidth(run: Run) -> str:
    size = run.sizes[-1]
    header = ("kernel", "coefficients", *(f"{kind} {order}" for kind in TYPES for order in ORDERS))
    rows, slow = [], []
    for kernel in run.kernels:
        shares = {}
        for kind in TYPES:
            for order in ORDERS:
                speed = kernel.moved * _BYTES[kind] / kernel.times[kind, order][-1]
                shares[kind, order] = speed / run.machine.copy_memory
        rows.append((kernel.case.title, str(kernel.moved), *(f"{100 * share:.0f} %" for share in shares.values())))
        best = max(shares["float64", order] for order in ORDERS)
        slow += [f"{kernel.case.title} ({100 * best:.0f} %)"] if best < SHARE else []
    text = [
        f"## Share of the memory bandwidth, {size:,} elements",
        "",
        paragraph(
            "Bytes that the kernel must read and write, as a share of the bytes that `numpy.copyto` reads and "
            "writes in memory in the same time.",
            "Shares above 100 % are possible if arrays fit in a cache, or if stores bypass it.",
        ),
        "",
        table(header, rows),
        comparisons.missed(f"at least {100 * SHARE:.0f} % in float64, in the better order", slow),
    ]
    if run.figure:
        text += [f"![Operations per second by operations per byte, float64, Fortran order]({run.figure})", ""]
    return "\n".join(text)
