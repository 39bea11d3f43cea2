"""Differences that are computed in both directions: ``b - a`` becomes the negative of ``a - b``."""

from __future__ import annotations

from collections.abc import Sequence

from ..ir.scalar import Op, Scalar


def share_opposites(roots: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """Return the roots with one difference of each opposite pair replaced by the negative of the other.

    Every step removes a subtraction, and no other operation is added: the graph folds a negation into the sums and
    products that use it. Results are the same to the bit, except for the sign of a zero.
    """
    while True:
        replaced = _opposites(_live(roots))
        if not replaced:
            return tuple(roots)
        roots = _rebuilt(roots, replaced)


def _live(roots: Sequence[Scalar]) -> list[Scalar]:
    """Return the nodes that the roots need, arguments first, which is the order of their indices."""
    found = set(roots)
    stack = list(found)
    while stack:
        new = [argument for argument in stack.pop().arguments if argument not in found]
        found.update(new)
        stack += new
    return sorted(found, key=lambda node: node.index)


def _opposites(live: Sequence[Scalar]) -> dict[Scalar, Scalar]:
    """Return the differences whose opposite was built earlier, each with that opposite."""
    first: dict[tuple[Scalar, ...], Scalar] = {}
    found: dict[Scalar, Scalar] = {}
    for node in live:
        if node.op is Op.SUBTRACT:
            opposite = first.get(node.arguments[::-1])
            if opposite is None:
                first[node.arguments] = node
            else:
                found[node] = opposite
    return found


def _rebuilt(roots: Sequence[Scalar], replaced: dict[Scalar, Scalar]) -> tuple[Scalar, ...]:
    new: dict[Scalar, Scalar] = {}
    for node in _live(roots):
        graph = node.graph
        if node in replaced:
            new[node] = graph.negative(new[replaced[node]])
        elif any(new[argument] is not argument for argument in node.arguments):
            arguments = [new[argument] for argument in node.arguments]
            keep = node.op is Op.NEGATE and arguments[0].op is Op.SUBTRACT
            new[node] = graph.negative(*arguments) if keep else graph.apply(node.op, *arguments)
        else:
            new[node] = node
    return tuple(new[root] for root in roots)
