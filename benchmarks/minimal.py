"""Prove by exhaustive search that kernels take the fewest possible operations, and write the compiler's table."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path

from gacompiler.frontend.kernel import Kernel
from gacompiler.generation.checked_in import own_specs
from gacompiler.generation.spec_files import load_spec
from gacompiler.ir.scalar import RING
from gacompiler.passes import minimal_counts
from gacompiler.passes.minimal import Problem, problem
from gacompiler.passes.pipeline import compile_kernel

from . import pages
from .exhaustive import exists
from .known import known

TABLE = Path(minimal_counts.__file__)
MOST_INPUTS = 8
"""Maximum number of coefficients of the arguments."""
MOST_FREE = 5
"""Maximum number of intermediate values that are enumerated."""
MOST_SETS = 4e7
"""Maximum estimated number of sets of intermediate values."""


def kernels() -> Iterator[tuple[str, Kernel]]:
    """Yield the kernels without loops of the checked-in modules, and the known expressions, with their names."""
    for path in own_specs():
        for kernel in load_spec(path).kernels:
            if not kernel.has_loops and kernel.parameters:
                yield f"{path.stem}.{kernel.name}", kernel
    for name, each in known().items():
        yield name, each.kernel


def problems(progress: Callable[[str], None]) -> dict[str, tuple[Problem, int, list[str]]]:
    """Return the problems that are small enough, by key, with the count that is to be proved and the kernels' names."""
    found: dict[str, tuple[Problem, int, list[str]]] = {}
    for name, kernel in kernels():
        progress(name)
        if sum(len(parameter.components) for parameter in kernel.parameters) > MOST_INPUTS:
            continue
        program = compile_kernel(kernel, forms=False).program
        if any(line.op not in RING for line in program.lines):
            continue
        count = len([line for line in program.lines if len(line.operands) == 2])
        each = problem(kernel, program)
        if count and each is not None and is_small(each, count):
            known_count = found.get(each.key, (each, count, []))
            found[each.key] = (each, min(count, known_count[1]), [*known_count[2], name])
    return found


def is_small(each: Problem, count: int) -> bool:
    """Return whether the search for fewer than `count` operations is short."""
    free = count - 1 - len(each.results)
    if free > MOST_FREE:
        return False
    sets = 1.0
    for k in range(free - 1):
        n = len(each.inputs) + k + 1
        sets *= 1.5 * n * n / (k + 1)
    return sets <= MOST_SETS


def text(proved: dict[str, tuple[int, list[str]]]) -> str:
    """Return the source of the table."""
    rows = [
        f"    # {', '.join(names)}"[:116].rstrip(", ") + f'\n    "{key}": {count},'
        for key, (count, names) in sorted(proved.items(), key=lambda item: (item[1][1], item[0]))
    ]
    head = '"""Proved minimal numbers of operations, written by ``python -m benchmarks minimal``; do not edit them."""'
    about = '"""The minimum by the key of the problem (`gacompiler.passes.minimal`), with kernels that have it."""'
    lines = [
        head,
        "",
        "from __future__ import annotations",
        "",
        "PROVED: dict[str, int] = {",
        *rows,
        "}",
        about,
    ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Search, and write the table; arguments are those of the command line, or by default of the process."""
    options = _parser().parse_args(arguments)
    proved, open_problems = dict[str, tuple[int, list[str]]](), list[str]()
    with pages.progress() as bar:
        task = bar.add_task("compile", total=None)
        found = problems(lambda name: bar.update(task, advance=1, description=f"compile {name}"))
        task = bar.add_task("search", total=len(found))
        for key, (each, count, names) in found.items():
            bar.update(task, advance=1, description=f"search {names[0]}")
            if count == len(each.results) or not exists(each, count - 1):
                proved[key] = count, names
            else:
                open_problems.append(names[0])
    if open_problems:
        print(f"fewer operations may suffice for {', '.join(open_problems)}")
    n = len({name for _, names in proved.values() for name in names})
    largest = max((count for count, _ in proved.values()), default=0)
    done = f"{len(proved)} minima proved for {n} kernels, of up to {largest} operations"
    return pages.publish("minimal", options.out, text(proved), done)


def _parser() -> argparse.ArgumentParser:
    return pages.options("minimal", __doc__, TABLE, quick=False)
