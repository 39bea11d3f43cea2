"""LLVM code that moves numbers between memory layouts."""

from __future__ import annotations

from typing import Any

from .llvm import ll, number, parallel, pointer, simple
from .tiles import TILE, Tile


def movers_of(real: Any) -> dict[str, Any]:
    """Return the functions that move numbers of one type."""
    width = 8 if isinstance(real, ll.DoubleType) else 4

    @simple(5)
    def copy(builder: Any, to: Any, to_step: Any, origin: Any, step: Any, size: Any) -> None:
        def body(i: Any, mark: Any) -> None:
            source = pointer(builder, builder.add(origin, builder.mul(i, step)), real)
            value = mark(builder.load(source, typ=real, align=width))
            mark(builder.store(value, pointer(builder, builder.add(to, builder.mul(i, to_step)), real), width))

        parallel(builder, size, body)

    def three(builder: Any, x: Any, row: Any, a: Any, size: Any, back: bool) -> None:
        x = pointer(builder, x, real)
        a = pointer(builder, a, real)
        rows = [builder.gep(x, [builder.mul(row, number(k))], source_etype=real) for k in range(3)]

        def body(i: Any, mark: Any) -> None:
            i3 = builder.mul(i, number(3))
            dense = [builder.gep(a, [builder.add(i3, number(k))], source_etype=real) for k in range(3)]
            apart = [builder.gep(start, [i], source_etype=real) for start in rows]
            origin, to = (apart, dense) if back else (dense, apart)
            values = [mark(builder.load(one, typ=real, align=width)) for one in origin]
            for value, one in zip(values, to, strict=True):
                mark(builder.store(value, one, width))

        parallel(builder, size, body)

    @simple(4)
    def spread(builder: Any, x: Any, row: Any, a: Any, size: Any) -> None:
        three(builder, x, row, a, size, False)

    @simple(4)
    def gather(builder: Any, a: Any, x: Any, row: Any, size: Any) -> None:
        three(builder, x, row, a, size, True)

    def block(builder: Any, x: Any, row: Any, a: Any, step: Any, back: bool) -> None:
        tile = Tile(builder, real, width)

        def places(start: Any, between: Any, count: int) -> list[Any]:
            found = [builder.add(start, builder.mul(between, number(k))) for k in range(count)]
            return [pointer(builder, one, real) for one in found]

        rows, elements = places(x, row, tile.half), places(a, step, tile.lanes)
        if back:
            tile.store_block(rows, elements)
        else:
            tile.load_block(elements, rows)

    @simple(4)
    def turn_in(builder: Any, a: Any, step: Any, x: Any, row: Any) -> None:
        """Transpose a block of a tile of elements into rows."""
        block(builder, x, row, a, step, False)

    @simple(4)
    def turn_out(builder: Any, x: Any, row: Any, a: Any, step: Any) -> None:
        block(builder, x, row, a, step, True)

    moves = {"_copy": copy, "_spread": spread, "_gather": gather, "_turn_in": turn_in, "_turn_out": turn_out}
    return moves | {"_LANES": TILE // width, "_HALF": TILE // width // 2}
