"""The loop of a kernel over a block, as LLVM has it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from .llvm import Element, applied, cgutils, intp, intrinsic, ll, number, one_by_one, parallel, pointer, typed, types
from .tiles import Tile

_WIDEST = 5
"""Largest number of components of an element that LLVM itself loads from C order and transposes efficiently."""
_TILES = 2
"""Number of tiles that a loop with sines computes before it checks whether an angle was too large."""


class Loop(NamedTuple):
    """A loop of a kernel or of a form; that of a form runs the preparation if the number of elements is negative."""

    shapes: Sequence[tuple[int, ...]]
    out_shapes: Sequence[tuple[int, ...]]
    real: Any
    function: Element
    near: Element | None
    """The variant of a function with sines or cosines that is valid for angles of limited size."""
    still: tuple[int, ...]
    """Indices of the arguments that are constant and have been replaced by prepared numbers."""
    prepare: tuple[Element, int] | None
    """The function that prepares, and the number of prepared values."""
    dense: bool
    """Whether elements are in C order; otherwise components have unit stride over the elements."""

    @property
    def changing(self) -> list[int]:
        """Indices of the arguments that differ between elements."""
        return [k for k in range(len(self.shapes)) if k not in self.still]


def loop_over(loop: Loop) -> Any:
    """Return the compiled loop, a function of the number of elements, addresses of parts, and inner strides."""
    real = loop.real
    n_prepared = loop.prepare[1] if loop.prepare else 0
    prepared = [(n_prepared,)] if loop.prepare else []
    own = [*prepared, *(loop.shapes[k] for k in loop.changing)]

    @intrinsic
    def run(typing: Any, size: Any, starts: Any, cores: Any) -> Any:
        elements = [loop.function, loop.near] if loop.near else [loop.function]
        signatures = {element: typed(typing, element, own, loop.out_shapes, real) for element in elements}
        first = [loop.shapes[k] for k in loop.still]
        once = typed(typing, loop.prepare[0], first, prepared, real) if loop.prepare else None

        def code(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
            def apply(element: Element, values: Sequence[Any]) -> Any:
                return applied(context, builder, element, signatures[element], own, loop.out_shapes, values)

            size, starts, cores = arguments
            writer = _Writer(loop, context.get_value_type(real), builder, starts, cores, apply)
            if loop.prepare is None:
                writer.run(size)
                return context.get_dummy_value()
            beginning, going, done = map(builder.append_basic_block, ("prepare", "run", "done"))
            builder.cbranch(builder.icmp_signed("<", size, number(0)), beginning, going)
            builder.position_at_end(beginning)
            values = [writer.loaded(writer.part(k)) for k in loop.still]
            (found,) = applied(context, builder, loop.prepare[0], once, first, prepared, values)
            writer.store(found, writer.prepared(n_prepared))
            builder.branch(done)
            builder.position_at_end(going)
            writer.run(size, writer.loaded(writer.prepared(n_prepared)))
            builder.branch(done)
            builder.position_at_end(done)
            return context.get_dummy_value()

        return types.void(types.intp, types.intp, types.intp), code

    return run


def _as_it_is(instruction: Any) -> Any:
    return instruction


class _Writer:
    """Builder of the LLVM code of a loop."""

    def __init__(self, loop: Loop, kind: Any, builder: Any, starts: Any, cores: Any, apply: Any) -> None:
        self._loop, self._kind, self._builder, self._apply = loop, kind, builder, apply
        self._width = loop.real.bitwidth // 8
        self._tile = Tile(builder, kind, self._width)
        self._starts, self._cores = (pointer(builder, table, intp) for table in (starts, cores))
        self._every = [*loop.shapes, *loop.out_shapes]
        self._first_core = [0, *itertools.accumulate(map(len, self._every))]

    def part(self, k: int) -> list[Any]:
        """Return the addresses of the components of a part in the first element."""
        start, shape = self._entry(self._starts, k), self._every[k]
        if self._loop.dense and k not in self._loop.still:
            return self._following(start, math.prod(shape))
        steps = [self._entry(self._cores, self._first_core[k] + axis) for axis in range(len(shape))]
        found = []
        for index in itertools.product(*map(range, shape)):
            address = start
            for n, step in zip(index, steps, strict=True):
                address = self._builder.add(address, self._builder.mul(step, number(n)))
            found.append(pointer(self._builder, address, self._kind))
        return found

    def prepared(self, count: int) -> list[Any]:
        """Return the addresses of the prepared numbers."""
        return self._following(self._entry(self._starts, len(self._every)), count)

    def loaded(self, places: Sequence[Any], mark: Callable[[Any], Any] = _as_it_is) -> list[Any]:
        """Load the numbers at these addresses."""
        return [mark(self._builder.load(place, typ=self._kind, align=self._width)) for place in places]

    def store(self, values: Sequence[Any], places: Sequence[Any], mark: Callable[[Any], Any] = _as_it_is) -> None:
        """Store numbers to these addresses."""
        for value, place in zip(values, places, strict=True):
            mark(self._builder.store(value, place, self._width))

    def run(self, size: Any, fixed: Sequence[Any] | None = None) -> None:
        """Write the loop over all elements, given the prepared numbers."""
        before = [] if fixed is None else [fixed]
        inputs = [self.part(k) for k in self._loop.changing]
        outputs = [self.part(k) for k in range(len(self._loop.shapes), len(self._every))]
        largest = max(map(len, [*inputs, *outputs]))
        if self._loop.near or (self._loop.dense and largest > _WIDEST):
            self._tiles(size, before, inputs, outputs)
            return

        def body(i: Any, mark: Any) -> None:
            self._element(self._loop.function, before, self._at(inputs, i), self._at(outputs, i), mark)

        parallel(self._builder, size, body)

    def _tiles(self, size: Any, before: list[Any], inputs: list[Any], outputs: list[Any]) -> None:
        """Write a loop over groups of tiles, transposing elements in C order.

        The last elements, and groups in which an angle is too large, are computed one by one. Results are kept in
        registers until all angles of a group are known to be in range, because they may overwrite arguments.
        """
        builder, near, dense = self._builder, self._loop.near, self._loop.dense
        tile = self._tile
        span = tile.lanes * (_TILES if near else 1)
        rows_in = [self._rows(len(part), span) for part in inputs] if dense else []
        rows_out = [self._rows(len(part), span) for part in outputs]
        bits = ll.IntType(self._loop.real.bitwidth)
        far = cgutils.alloca_once(builder, bits)

        def alone(i: Any) -> None:
            self._element(self._loop.function, before, self._at(inputs, i), self._at(outputs, i), _as_it_is)

        def run(first: Any) -> None:
            def lane(j: Any, mark: Any) -> None:
                given = self._rows_at(rows_in, j) if dense else self._at(inputs, builder.add(first, j))
                noted = self._element(near or self._loop.function, before, given, self._rows_at(rows_out, j), mark)
                for one in noted:
                    builder.store(builder.or_(builder.load(far), builder.bitcast(one, bits)), far)

            builder.store(bits(0), far)
            parallel(builder, number(span), lane, span)

        def by_tile(parts: Any, rows: Any, first: Any) -> Iterator[tuple[list[Any], list[Any]]]:
            """Yield the addresses of the components of each tile's first element, and its rows."""
            for k in map(number, range(0, span, tile.lanes)):
                yield from zip(self._at(parts, builder.add(first, k)), self._rows_at(rows, k), strict=True)

        def store(first: Any) -> None:
            for places, rows in by_tile(outputs, rows_out, first):
                if dense:
                    tile.store(rows, places[0])
                else:
                    tile.copy(rows, places)

        def whole(first: Any) -> None:
            if dense:
                for places, rows in by_tile(inputs, rows_in, first):
                    tile.load(places[0], rows)
            run(first)
            if near is None:
                store(first)
                return
            is_far = builder.icmp_unsigned("!=", builder.load(far), bits(0))
            with builder.if_else(is_far, likely=False) as (then, otherwise):
                with then:
                    one_by_one(builder, first, builder.add(first, number(span)), 1, alone)
                with otherwise:
                    store(first)

        in_tiles = builder.and_(size, number(-span))
        one_by_one(builder, number(0), in_tiles, span, whole)
        one_by_one(builder, in_tiles, size, 1, alone)

    def _element(
        self, element: Element, before: list[Any], inputs: Sequence[Any], outputs: Sequence[Any], mark: Any
    ) -> Any:
        """Apply the kernel to components at these addresses; return its flag for large angles, if it has one."""
        found = self._apply(element, [*before, *(self.loaded(places, mark) for places in inputs)])
        for values, places in zip(found, outputs, strict=False):
            self.store(values, places, mark)
        return found[len(outputs)] if element.notes else []

    def _at(self, parts: Sequence[Any], i: Any) -> list[list[Any]]:
        """Return the addresses of the components of element `i`, given those of the first."""

        def after(place: Any, size: int) -> Any:
            count = self._builder.mul(i, number(size), flags=["nsw"]) if self._loop.dense else i
            return self._tile.after(place, count)

        return [[after(place, len(part)) for place in part] for part in parts]

    def _rows(self, size: int, length: int) -> list[Any]:
        """Allocate rows of this length as local variables, which LLVM keeps in registers."""
        room = cgutils.alloca_once(self._builder, ll.ArrayType(self._kind, size * length))
        start = self._builder.bitcast(room, self._kind.as_pointer())
        return [self._tile.after(start, number(k * length)) for k in range(size)]

    def _rows_at(self, parts: Sequence[Sequence[Any]], j: Any) -> list[list[Any]]:
        """Return the addresses of the numbers of element `j` in the rows of some parts."""
        return [[self._tile.after(row, j) for row in rows] for rows in parts]

    def _entry(self, table: Any, k: int) -> Any:
        place = self._builder.gep(table, [number(k)], source_etype=intp)
        return self._builder.load(place, typ=intp)

    def _following(self, address: Any, count: int) -> list[Any]:
        start = pointer(self._builder, address, self._kind)
        return [self._tile.after(start, number(k)) for k in range(count)]
