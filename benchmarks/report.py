"""The page that a run writes: the same rows in the same order every time, only the figures differ."""

from __future__ import annotations

from dataclasses import dataclass

from . import comparisons
from .building import Building
from .by_hand import HandTimes
from .features import Features
from .generation import Generation
from .kernels import ORDERS, TYPES, KernelTimes
from .machine import Machine
from .markdown import MISSING, ns, ratio, seconds, table

_BYTES = {"float64": 8, "float32": 4}
TIMES = {"kingdon": 20.0, "clifford": 500.0}
"""How many times as long these libraries are to take at least on batches that a cache holds; others, as long."""
IN_CACHE = 1_000
"""The largest of such batches."""
BUILD = 60.0
"""Seconds that the C build may take on two processors."""
SHARE = 0.8
"""The least share of the memory's speed."""


@dataclass(frozen=True, slots=True)
class Run:
    """All that one run measured."""

    machine: Machine
    generation: Generation
    building: Building | None
    sizes: tuple[int, ...]
    kernels: tuple[KernelTimes, ...]
    hand_sizes: tuple[int, ...]
    by_hand: tuple[HandTimes, ...]
    features: Features
    backends: dict[str, str]
    absent: tuple[str, ...]
    quick: bool
    repeats: int
    figure: str | None


def page(run: Run) -> str:
    """A run as Markdown."""
    sections = [_opening(run), _machine(run), _method(run), _generation(run), _building(run)]
    sections += [_kernels(run, kind) for kind in TYPES]
    sections += [_peers(run), comparisons.by_hand(run.by_hand, run.hand_sizes), *comparisons.features(run.features)]
    sections.append(_bandwidth(run))
    return "\n".join(sections)


def _opening(run: Run) -> str:
    lines = ["# Benchmarks", "", "Written by `make bench`; not edited by hand."]
    if run.quick:
        lines += ["", "**A quick run: to see that everything works. Its figures are not for quoting.**"]
    return "\n".join([*lines, ""])


def _machine(run: Run) -> str:
    return "## Machine\n\n" + table(("what", "is"), run.machine.facts)


def _method(run: Run) -> str:
    ran = "; ".join(f"{module}: {backend}" for module, backend in run.backends.items())
    lines = [
        "## Method",
        "",
        f"- One thread on one processor. Each figure is the median of {run.repeats} measurements after a warm call;",
        "  short calls are repeated until a measurement lasts long enough for the clock.",
        "- A kernel is called from Python with `out=`, so a figure for 1 element is the time of one call.",
        f"- Backend of each module: {ran}.",
        "- Arguments are random. A versor stands beside each element, unless the row says one motor.",
        "- A peer gives the same result from the same numbers; it is compared with the kernel before it is timed. What",
        "  it needs in another form (matrices, its own objects) is made before the clock starts.",
    ]
    if run.absent:
        names = ", ".join(run.absent)
        lines.append(f"- Not installed, so without rows here: {names}. `make .venv/.peers` installs all but pin.")
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
        ("all modules, printing included", seconds(total)),
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
            "From a definition to a proved program with its measured rounding error, as `gac generate` does it.",
            "",
            table(("all kernels", "time"), summary),
            table(("module", "kernels", "time"), modules),
            "The ten slowest kernels:",
            "",
            table(("kernel", "compile and prove", "rounding error", "together"), kernels),
        ]
    )


def _building(run: Run) -> str:
    found = run.building
    if found is None:
        return "## C build\n\nNot measured: no C compiler.\n"
    rows = [(each.module, f"{each.source / 1e6:.2f}", f"{each.library / 1e6:.2f}") for each in found.libraries]
    sums = (sum(each.source for each in found.libraries), sum(each.library for each in found.libraries))
    rows.append(("all", *(f"{each / 1e6:.2f}" for each in sums)))
    return "\n".join(
        [
            "## C build",
            "",
            f"From nothing to all libraries on all processors: {seconds(found.cold)}. Where nothing has changed: "
            f"{seconds(found.again)}.",
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
            "Nanoseconds for each element, by number of elements. C: C order, elements after one another; F: Fortran "
            "order,",
            "which is a structure of arrays.",
            "",
            table(header, rows),
        ]
    )


def _peers(run: Run) -> str:
    header = ("kernel", "peer", "what it computes", *(f"{size:,}" for size in run.sizes))
    rows, slow = [], []
    for kernel in run.kernels:
        for peer in kernel.peers:
            # kingdon holds an array for each coefficient
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
    target = f"on {IN_CACHE:,} elements " + ", ".join(
        f"{name} {times:g} times as long" for name, times in TIMES.items()
    )
    target += "; nowhere is a peer faster"
    return "\n".join(
        [
            "## Peers",
            "",
            "How many times as long the peer takes as the kernel, in the same run: float64; C order for the kernel, "
            "and Fortran",
            f"order beside kingdon, which holds an array for each coefficient. {MISSING}: not tried, for it would take "
            "too long.",
            "clifford works on one element after the other, so its time for each does not depend on their number.",
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
        f"## Share of the memory's speed, {size:,} elements",
        "",
        "Bytes that the kernel must read and write, as a share of those that `numpy.copyto` copies from memory in the "
        "same time.",
        "Above 100 %, the arrays fit in a cache, or stores go past it.",
        "",
        table(header, rows),
        comparisons.missed(f"{100 * SHARE:.0f} % in float64, in the better order", slow),
    ]
    if run.figure:
        text += [f"![Operations in a second over operations for each byte, float64, Fortran order]({run.figure})", ""]
    return "\n".join(text)
