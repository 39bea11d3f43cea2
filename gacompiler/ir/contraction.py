"""Products that a compiler contracts with sums into fused multiply-adds, if it is allowed to."""

from __future__ import annotations

from collections import Counter

from .program import Operand, Program
from .scalar import Op

SUMS = (Op.ADD, Op.SUBTRACT)


def contracted(program: Program) -> frozenset[str]:
    """Return the products that disappear into fused multiply-adds.

    These are the products that are only used in sums, each of which has no other contracted product. They are selected
    in the order of the lines, as gcc does with ``-ffp-contract=fast``. A product with several uses is computed again in
    each of these sums.
    """
    sums = {line.target for line in program.lines if line.op in SUMS}
    uses: dict[Operand, list[str]] = {}
    for line in program.lines:
        for operand in line.operands:
            uses.setdefault(operand, []).append(line.target)
    stored = Counter(operand for result in program.results for operand in result.operands)
    taken: set[str] = set()
    found = set[str]()
    for line in program.lines:
        users = uses.get(line.target, [])
        is_free = len(set(users)) == len(users) and not stored[line.target]
        if line.op is Op.MULTIPLY and users and is_free and all(user in sums and user not in taken for user in users):
            taken.update(users)
            found.add(line.target)
    return frozenset(found)
