"""The number of cycles that one element takes on a processor with fused multiply-add."""

from __future__ import annotations

from collections.abc import Mapping
from heapq import heappop, heappush

from .contraction import contracted
from .program import Line, Program
from .scalar import Op

UNITS = 2
"""Number of instructions that start in one cycle."""
CYCLES: Mapping[Op, int] = {
    Op.ADD: 4, Op.SUBTRACT: 4, Op.MULTIPLY: 4, Op.DIVIDE: 13, Op.SQRT: 18, Op.NEGATE: 0, Op.ABS: 1, Op.SELECT: 2,
    Op.FLOOR: 8, Op.MINIMUM: 4, Op.MAXIMUM: 4, Op.LESS: 4, Op.LESS_EQUAL: 4, Op.EQUAL: 4,
}  # fmt: skip
"""Cycles from the operands to the result of an instruction, about those of x86-64 processors."""
BUSY: Mapping[Op, int] = {Op.DIVIDE: 4, Op.SQRT: 6}
"""Cycles in which no other division or root starts, because a processor has one divider."""
CYCLES_OF_CALL = 50
"""Cycles of a sine or similar function."""


def cycles(program: Program) -> int:
    """Return the cycles of one element on `UNITS` units if instructions on the longest path start first.

    Contracted products are part of the instructions of their sums, and negations take no time. Reading arguments and
    storing results is not included.
    """
    needs = _operands(program)
    latency = {line.target: latency_of(line.op) for line in program.lines if line.target in needs}
    busy = {line.target: BUSY[line.op] for line in program.lines if line.op in BUSY}
    users: dict[str, list[str]] = {target: [] for target in needs}
    for target, operands in needs.items():
        for operand in operands:
            users[operand].append(target)
    remaining: dict[str, int] = {}
    for target in reversed(needs):
        remaining[target] = latency[target] + max((remaining[user] for user in users[target]), default=0)
    waiting = {target: len(operands) for target, operands in needs.items()}
    ready: list[tuple[int, int, str]] = []
    running: list[tuple[int, int, str]] = []
    order = {target: k for k, target in enumerate(needs)}

    def release(target: str) -> None:
        if not waiting[target]:
            heappush(ready, (-remaining[target], order[target], target))

    for target in needs:
        release(target)
    now = end = divider_is_free = 0
    while ready or running:
        started, blocked = 0, list[tuple[int, int, str]]()
        while ready and started < UNITS:
            entry = heappop(ready)
            target = entry[-1]
            if target in busy:
                if divider_is_free > now:
                    blocked.append(entry)
                    continue
                divider_is_free = now + busy[target]
            heappush(running, (now + latency[target], order[target], target))
            started += 1
        now = now + 1 if ready or blocked else max(now + 1, running[0][0])
        for entry in blocked:
            heappush(ready, entry)
        while running and running[0][0] <= now:
            end, _, target = heappop(running)
            for user in users[target]:
                waiting[user] -= 1
                release(user)
    return end


def latency_of(op: Op) -> int:
    """Return the cycles of one instruction."""
    return CYCLES.get(op, CYCLES_OF_CALL)


def _operands(program: Program) -> dict[str, list[str]]:
    """Return, for each instruction, the instructions whose results it uses, with repetition."""
    merged = contracted(program) | {line.target for line in program.lines if line.op is Op.NEGATE}
    lines = {line.target: line for line in program.lines}

    def sources(line: Line) -> list[str]:
        found = []
        for name in line.operands:
            if isinstance(name, str) and name in lines:
                found += sources(lines[name]) if name in merged else [name]
        return found

    return {line.target: sources(line) for line in program.lines if line.target not in merged}
