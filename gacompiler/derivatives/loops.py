"""Derivatives of kernels with loops. They are recorded by the recorder of the resulting kernel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..algebra.layout import SCALARS, Layout
from ..errors import KernelError
from ..frontend.expression import Expression, lift
from ..frontend.kernel import Parameter
from ..frontend.loop_trace import LoopTrace
from ..frontend.loops import each
from ..frontend.recorded import Record
from ..frontend.recorder import Recorder
from ..frontend.recording import current
from ..frontend.rows import Rows, leaves_of, nested
from ..ir.procedure import Clear, Place
from ..ir.rows import Row
from ..passes.decide import layout_of
from .directions import Tangents, basis
from .forward import Directions, Forward
from .replay import bound_argument
from .results import Differentiated, free, layout_of_type, lengths_of, multivector, numbers, outer_of, weighted
from .reverse import Reverse
from .tangents import Key, tangent_layouts


def is_recorded(d: Differentiated, arguments: Sequence[Any]) -> bool:
    """Return whether a kernel with loops is called on arrays of unknown lengths."""
    return d.loops is not None and any(isinstance(leaf, Rows) for leaf in leaves_of(tuple(arguments)))


def _traced(d: Differentiated) -> LoopTrace:
    assert d.loops is not None
    return d.loops


def _seeds(d: Differentiated, layout: Layout) -> dict[Key, Layout]:
    record = next(record for record in _traced(d).records if record.name == d.parameter.name)
    return {(record.name, leaf.start): layout for leaf in record.leaves}


def _sample(d: Differentiated, tangents: Tangents) -> tuple[list[Expression], Layout]:
    """Return the tangents of a parameter and the layout that holds them."""
    layout = d.parameter.layout
    sample = tangents(Parameter(d.parameter.name, layout).symbols(), layout)
    blades = {blade for tangent in sample for blade in tangent.blades}
    if layout.algebra == SCALARS or blades == {slot.blade for slot in layout.stored}:
        return sample, free(layout)
    return sample, layout_of(layout.algebra, blades, {})


def forward(d: Differentiated, arguments: Sequence[Any], tangent: Parameter, along: Any) -> list[Any]:
    """Return the values of a kernel with loops and their derivatives along a tangent."""
    recorder, traced = current(), _traced(d)
    layouts = tangent_layouts(traced, _seeds(d, tangent.layout), recorder.inference)
    table = bound_argument(recorder, tangent, along)
    run = Forward(recorder, traced, arguments, layouts, d.parameter.name, table)
    values = run.values()
    derivatives = []
    for value, given, (along_it,) in zip(values, d.results, run.derivatives(), strict=True):
        leaves = [
            _projected(partial, value_leaf, layout_of_type(given))
            for partial, value_leaf in zip(along_it, leaves_of(value), strict=True)
        ]
        derivatives.append(nested(leaves, outer_of(given)))
    return [*values, *derivatives]


def _projected(partial: Any, value: Any, layout: Layout) -> Any:
    """Return the coefficients of `layout` of a derivative, or zeros if the derivative is None."""

    def projected(found: Any) -> Expression:
        return multivector(numbers(lift(found), layout), free(layout))

    if isinstance(value, Rows):
        if partial is None:
            (zeros,) = current().tables(["zeros"], value.lengths, [free(layout)])
            current().append(Clear(zeros.table))
            return zeros
        return partial if partial.leaf.layout == free(layout) else each(projected, partial)
    return projected(0 if partial is None else partial)


def columns(d: Differentiated, arguments: Sequence[Any], tangents: Tangents) -> list[Any]:
    """Return the value of a kernel with loops and its Jacobian with respect to a parameter without named lengths."""
    recorder, traced = current(), _traced(d)
    layout = d.parameter.layout
    sample, of_tangents = _sample(d, tangents)
    layouts = tangent_layouts(traced, _seeds(d, of_tangents), recorder.inference)
    directions: Directions = lambda symbol: tangents(symbol, layout)  # noqa: E731
    run = Forward(recorder, traced, arguments, layouts, d.parameter.name, directions, len(sample))
    (value,), (derivatives,) = run.values(), run.derivatives()
    own = layout_of_type(d.results[0])
    present = [k for k, (partial,) in enumerate(derivatives) if partial is not None]

    def entries(*found: Any) -> tuple[tuple[Any, ...], ...]:
        by = dict(zip(present, found, strict=True))
        matrix = [numbers(lift(by.get(k, 0)), own) for k in range(len(sample))]
        return tuple(zip(*matrix, strict=True))

    given = [derivatives[k][0] for k in present]
    if not lengths_of(d.results[0]):
        return [value, entries(*given)]
    return [value, each(entries, *given) if given else each(lambda row: entries(), value)]


@dataclass(frozen=True, slots=True)
class _Cotangent:
    """The cotangent of a result in a table that is given by the caller."""

    recorder: Recorder
    record: Record

    def numbers(self, leaf: int, layout: Layout, row: Row) -> list[list[Expression]]:
        """Return the coefficients of `layout` of the cotangent."""
        own = self.record.leaves[leaf]
        symbol = self.recorder.symbol(self.record.name, Place(self.record.name, row), own)
        return [_in_layout(numbers(symbol, own.layout), own.layout, layout)]

    def table(self, layouts: Sequence[Layout]) -> Record | None:
        """Return the table if it contains the requested coefficients, else None."""
        own = [[(slot.blade, slot.sign) for slot in leaf.layout.stored] for leaf in self.record.leaves]
        return self.record if own == [[(s.blade, s.sign) for s in layout.stored] for layout in layouts] else None


@dataclass(frozen=True, slots=True)
class _Units:
    """Unit cotangents, one for each coefficient of a result."""

    layout: Layout

    def numbers(self, leaf: int, layout: Layout, row: Row) -> list[list[Expression]]:
        """Return the rows of the identity matrix."""
        size = self.layout.size
        return [_in_layout([lift(int(k == seed)) for k in range(size)], self.layout, layout) for seed in range(size)]

    def table(self, layouts: Sequence[Layout]) -> Record | None:
        """Return None, since unit cotangents are not stored in a table."""
        return None


def _in_layout(given: Sequence[Expression], own: Layout, wanted: Layout) -> list[Expression]:
    """Convert the coefficients of one layout to another layout, with 0 for missing coefficients."""
    by = {slot.blade: value if slot.sign > 0 else -value for slot, value in zip(own.stored, given, strict=True)}
    found = [(slot.sign, by.get(slot.blade, lift(0))) for slot in wanted.stored]
    return [value if sign > 0 else -value for sign, value in found]


def reverse(
    d: Differentiated, arguments: Sequence[Any], cotangents: Sequence[tuple[Parameter, Any]], shape: tuple[int, ...]
) -> list[Any]:
    """Return the values of a kernel with loops and the gradient of their product with cotangents."""
    recorder, traced = current(), _traced(d)
    layouts = tangent_layouts(traced, _seeds(d, free(d.parameter.layout)), recorder.inference)
    seeds = {
        name: _Cotangent(recorder, bound_argument(recorder, parameter, given))
        for (name, _), (parameter, given) in zip(traced.results, cotangents, strict=True)
    }
    run = Reverse(recorder, traced, arguments, layouts, d.parameter.name, seeds)
    return [*run.values(), nested(run.gradient(), shape)]


def matrices(d: Differentiated, arguments: Sequence[Any], tangents: Tangents) -> list[Any]:
    """Return the value of a kernel with loops and its Jacobians with respect to the rows of an array."""
    recorder, traced = current(), _traced(d)
    layout, own = d.parameter.layout, layout_of_type(d.results[0])
    if d.parameter.outer_shape or len(lengths_of(d.parameter.type)) > 1:
        raise KernelError(traced.kernel.where, f"{d.parameter.name} has several axes", "an array of multivectors")
    sample, of_tangents = _sample(d, tangents)
    layouts = tangent_layouts(traced, _seeds(d, of_tangents), recorder.inference)
    ((name, _),) = traced.results
    run = Reverse(recorder, traced, arguments, layouts, d.parameter.name, {name: _Units(own)}, own.size)
    (value,), gradients = run.values(), run.gradient()

    def entries(row: Expression, *found: Expression) -> tuple[tuple[Expression, ...], ...]:
        along = [numbers(lift(tangent), of_tangents) for tangent in tangents(row, layout)]
        return tuple(
            tuple(weighted(column, found[k : k + of_tangents.size]) for column in along)
            for k in range(0, len(found), of_tangents.size)
        )

    if sample == basis(layout):
        return [value, nested(gradients, (own.size, len(sample)))]
    return [value, each(entries, arguments[d.place], *gradients)]
