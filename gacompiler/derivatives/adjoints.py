"""The transposed derivative of one straight-line part: what its results' cotangents give to its arguments."""

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
    """One number of a cotangent: coefficient `slot` of result `target`, of the derivative that comes in at `seed`."""

    symbol: Expression
    target: int
    seed: int
    slot: int


@dataclass(frozen=True, slots=True)
class Entry:
    """What coefficient `slot` of argument `source` is given, an expression of the part's symbols and of weights."""

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
        The arguments of the part whose values occur.
    """

    weights: tuple[Weight, ...]
    entries: tuple[Entry, ...]
    used: frozenset[int]


def adjoint(compute: Compute, layouts: Mapping[Key, Layout], count: int) -> Adjoint:
    """Transpose the derivative of a part, for `count` cotangents at once."""
    values = values_of(compute)
    weights: list[Weight] = []
    active = []
    for k, (place, leaf) in enumerate(compute.targets):
        layout = layouts.get((place.table, leaf.start))
        if layout is not None:
            active.append((k, layout))
            for seed in range(count):
                for slot in range(layout.size):
                    name = f"weight {k} {seed} {slot}"  # not the name of any parameter
                    symbol = Parameter(name, SCALAR).symbols()
                    weights.append(Weight(symbol, k, seed, slot))
    entries: list[Entry] = []
    symbols: tuple[Expression, ...] = compute.kernel.function.symbols  # type: ignore[attr-defined]
    for k, (symbol, source) in enumerate(zip(symbols, compute.sources, strict=True)):
        layout = layouts.get((source.place.table, source.leaf.start))
        for slot, blade in enumerate(basis(layout) if layout is not None else []):
            slopes = without_ones(derivative([values[target] for target, _ in active], {symbol: blade}))
            column = [x for slope, (_, own) in zip(slopes, active, strict=True) for x in _numbers(slope, own)]
            for seed in range(count):
                own_weights = [weight.symbol for weight in weights if weight.seed == seed]
                entries.append(Entry(weighted(own_weights, column), k, seed, slot))
    inputs = {e for e in topological([e.value for e in entries]) if e.operation is Operation.INPUT}
    used = frozenset(k for k, symbol in enumerate(symbols) if symbol in inputs)
    return Adjoint(tuple(weights), tuple(entries), used)


def _numbers(slope: Expression, layout: Layout) -> list[Expression]:
    """The coefficients of a derivative; those that its form excludes are 0, so that nothing is kept for them."""
    blades = slope.blades
    found = zip(layout.stored, numbers(slope, layout), strict=True)
    return [number if slot.blade in blades else lift(0) for slot, number in found]


def grouped(compute: Compute, found: Adjoint) -> dict[Place, list[tuple[Entry, int]]]:
    """The entries by the place that they belong to, each with where its multivector begins."""
    places: dict[Place, list[tuple[Entry, int]]] = {}
    for entry in found.entries:
        source = compute.sources[entry.source]
        places.setdefault(source.place, []).append((entry, source.leaf.start))
    return places
