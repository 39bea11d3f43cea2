"""The transposed derivative of a straight-line part, which maps cotangents of results to those of arguments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..algebra.layout import SCALAR, Layout
from ..algebra.operations import Operation
from ..frontend.expression import Expression, lift, topological
from ..frontend.kernel import Parameter
from ..frontend.recorded import Compute
from ..ir.procedure import Place
from .directions import basis
from .replay import values_of
from .results import numbers, weighted
from .rules import derivative, without_ones
from .tangents import Key


@dataclass(frozen=True, slots=True)
class Weight:
    """An entry of a cotangent: coefficient `slot` of result `target`, for cotangent number `seed`."""

    symbol: Expression
    target: int
    seed: int
    slot: int


@dataclass(frozen=True, slots=True)
class Entry:
    """A contribution to coefficient `slot` of argument `source`, in terms of the part's symbols and the weights."""

    value: Expression
    source: int
    seed: int
    slot: int


@dataclass(frozen=True, slots=True)
class Adjoint:
    """The transposed derivative of a part.

    Attributes
    ----------
    weights : tuple of Weight
    entries : tuple of Entry
    used : frozenset of int
        The indices of the arguments whose values occur.
    """

    weights: tuple[Weight, ...]
    entries: tuple[Entry, ...]
    used: frozenset[int]


def adjoint(compute: Compute, layouts: Mapping[Key, Layout], count: int) -> Adjoint:
    """Return the transposed derivative of a part, for `count` cotangents at once."""
    values = values_of(compute)
    weights: list[Weight] = []
    active = []
    for k, (place, leaf) in enumerate(compute.targets):
        layout = layouts.get((place.table, leaf.start))
        if layout is not None:
            active.append((k, layout))
            for seed in range(count):
                for slot in range(layout.size):
                    name = f"weight {k} {seed} {slot}"  # Contains spaces, so it differs from all parameter names.
                    symbol = Parameter(name, SCALAR).symbols()
                    weights.append(Weight(symbol, k, seed, slot))
    entries: list[Entry] = []
    symbols: tuple[Expression, ...] = compute.kernel.function.symbols  # type: ignore[attr-defined]
    for k, (symbol, source) in enumerate(zip(symbols, compute.sources, strict=True)):
        layout = layouts.get((source.place.table, source.leaf.start))
        for slot, blade in enumerate(basis(layout) if layout is not None else []):
            derivatives = without_ones(derivative([values[target] for target, _ in active], {symbol: blade}))
            column = [x for partial, (_, own) in zip(derivatives, active, strict=True) for x in _numbers(partial, own)]
            for seed in range(count):
                own_weights = [weight.symbol for weight in weights if weight.seed == seed]
                entries.append(Entry(weighted(own_weights, column), k, seed, slot))
    inputs = {e for e in topological([e.value for e in entries]) if e.operation is Operation.INPUT}
    used = frozenset(k for k, symbol in enumerate(symbols) if symbol in inputs)
    return Adjoint(tuple(weights), tuple(entries), used)


def _numbers(partial: Expression, layout: Layout) -> list[Expression]:
    """Return the coefficients of a derivative, with the constant 0 for blades that do not occur."""
    blades = partial.blades
    found = zip(layout.stored, numbers(partial, layout), strict=True)
    return [number if slot.blade in blades else lift(0) for slot, number in found]


def grouped(compute: Compute, found: Adjoint) -> dict[Place, list[tuple[Entry, int]]]:
    """Group the entries by place, each with the position of the first number of its multivector."""
    places: dict[Place, list[tuple[Entry, int]]] = {}
    for entry in found.entries:
        source = compute.sources[entry.source]
        places.setdefault(source.place, []).append((entry, source.leaf.start))
    return places
