"""Kernels as LLVM has them: the loop over a block, the call on one element, and moves between orders in memory.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

from .runtime_llvm import _tools


def _numba_movers(real: Any) -> dict[str, Any]:
    """What moves numbers of one type."""
    tools = _tools()
    ll, number, pointer, parallel = tools.ll, tools.number, tools.pointer, tools.parallel
    simple = tools.simple
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

    def vectors(builder: Any, a: Any, step: Any, count: int, length: int) -> list[Any]:
        kind = ll.VectorType(real, length)
        places = [builder.add(a, builder.mul(step, number(k))) for k in range(count)]
        return [builder.load(pointer(builder, one, kind), typ=kind, align=width) for one in places]

    def shuffle(builder: Any, a: Any, b: Any, *which: int) -> Any:
        mask = ll.Constant(ll.VectorType(ll.IntType(32), len(which)), list(which))
        return builder.shuffle_vector(a, b, mask)

    def put(builder: Any, values: list[Any], x: Any, step: Any) -> None:
        for k, value in enumerate(values):
            to = builder.add(x, builder.mul(step, number(k)))
            builder.store(value, pointer(builder, to, value.type), width)

    @simple(4)
    def turn_in(builder: Any, a: Any, step: Any, x: Any, x_step: Any) -> None:
        """Four numbers of each of eight elements as eight numbers in each of four rows."""
        v = vectors(builder, a, step, 8, 4)
        pair = [shuffle(builder, v[k], v[k + 4], *range(8)) for k in range(4)]
        low = [shuffle(builder, *pair[k : k + 2], 0, 8, 1, 9, 4, 12, 5, 13) for k in (0, 2)]
        high = [shuffle(builder, *pair[k : k + 2], 2, 10, 3, 11, 6, 14, 7, 15) for k in (0, 2)]
        ends = (0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)
        put(builder, [shuffle(builder, *half, *end) for half in (low, high) for end in ends], x, x_step)

    @simple(4)
    def turn_out(builder: Any, x: Any, x_step: Any, a: Any, step: Any) -> None:
        """Four numbers in each of four rows as four numbers of each of four elements."""
        v = vectors(builder, x, x_step, 4, 4)
        low = [shuffle(builder, *v[k : k + 2], 0, 4, 2, 6) for k in (0, 2)]
        high = [shuffle(builder, *v[k : k + 2], 1, 5, 3, 7) for k in (0, 2)]
        turned = [shuffle(builder, *half, *end) for end in ((0, 1, 4, 5), (2, 3, 6, 7)) for half in (low, high)]
        put(builder, turned, a, step)

    return {"_copy": copy, "_spread": spread, "_gather": gather, "_turn_in": turn_in, "_turn_out": turn_out}


def _numba_loop_over(
    shapes: Any, out_shapes: Any, real: Any, function: Any, same: Sequence[int], prepare: Any, dense: bool
) -> Any:
    """The loop of a kernel over a block, or that of a form, which without elements prepares.

    What is dense lies in C order; else elements are at unit stride.
    """
    tools = _tools()
    types, intrinsic, number, pointer = tools.types, tools.intrinsic, tools.number, tools.pointer
    parallel, typed, applied, intp = tools.parallel, tools.typed, tools.applied, tools.intp
    every = [*shapes, *out_shapes]
    firsts = list(itertools.accumulate((len(shape) for shape in every), initial=0))
    changing = [k for k in range(len(shapes)) if k not in same]
    n_prepared = 0 if prepare is None else prepare[1]
    own = ([(n_prepared,)] if same else []) + [shapes[k] for k in changing]

    @intrinsic
    def run(typing: Any, size: Any, starts: Any, cores: Any) -> Any:
        signature = typed(typing, function, own, out_shapes, real)
        first = [shapes[k] for k in same]
        once = typed(typing, prepare[0], first, [(n_prepared,)], real) if same else None

        def code(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
            size, starts, cores = arguments
            kind = context.get_value_type(real)
            width = kind.get_abi_size(context.target_data)
            starts, cores = pointer(builder, starts, intp), pointer(builder, cores, intp)

            def entry(table: Any, k: int) -> Any:
                return builder.load(builder.gep(table, [number(k)], source_etype=intp), typ=intp)

            def places(k: int) -> list[Any]:
                """Where the components of a part of the first element are."""
                start, shape = entry(starts, k), every[k]
                steps = [entry(cores, firsts[k] + axis) for axis in range(len(shape))]
                if dense and k not in same:
                    start = pointer(builder, start, kind)
                    numbers = [number(n) for n in range(math.prod(shape))]
                    return [builder.gep(start, [n], source_etype=kind) for n in numbers]
                found = []
                for index in itertools.product(*map(range, shape)):
                    address = start
                    for n, step in zip(index, steps, strict=True):
                        address = builder.add(address, builder.mul(step, number(n)))
                    found.append(pointer(builder, address, kind))
                return found

            def load(one: Any) -> Any:
                return builder.load(one, typ=kind, align=width)

            done = None
            ready: list[Any] = []
            if same:
                at = pointer(builder, entry(starts, len(every)), kind)
                ready = [builder.gep(at, [number(k)], source_etype=kind) for k in range(n_prepared)]
                beginning, going = builder.append_basic_block("prepare"), builder.append_basic_block("run")
                done = builder.append_basic_block("done")
                builder.cbranch(builder.icmp_signed("<", size, number(0)), beginning, going)
                builder.position_at_end(beginning)
                values = [[load(one) for one in places(k)] for k in same]
                (found,) = applied(context, builder, prepare[0], once, first, [(n_prepared,)], values)
                for value, one in zip(found, ready, strict=True):
                    builder.store(value, one, width)
                builder.branch(done)
                builder.position_at_end(going)
            fixed = [load(one) for one in ready]
            inputs = [places(k) for k in changing]
            outputs = [places(k) for k in range(len(shapes), len(every))]

            def body(i: Any, mark: Any) -> None:
                def of_element(part: list[Any]) -> list[Any]:
                    place = builder.mul(i, number(len(part)), flags=["nsw"]) if dense else i
                    return [builder.gep(one, [place], source_etype=kind) for one in part]

                values = [[mark(load(one)) for one in of_element(part)] for part in inputs]
                values = [fixed, *values] if same else values
                found = applied(context, builder, function, signature, own, out_shapes, values)
                for part, results in zip(outputs, found, strict=True):
                    for one, value in zip(of_element(part), results, strict=True):
                        mark(builder.store(value, one, width))

            parallel(builder, size, body)
            if done is not None:
                builder.branch(done)
                builder.position_at_end(done)
            return context.get_dummy_value()

        return types.void(types.intp, types.intp, types.intp), code

    return run


def _numba_call_on_one(kernel: Any, function: Any) -> Any:
    """A kernel on one element: from arrays and tuples to a tuple, or into arrays."""
    tools = _tools()
    types, cgutils, errors, intrinsic = tools.types, tools.cgutils, tools.errors, tools.intrinsic
    widest, number, nested, typed = tools.widest, tools.number, tools.nested, tools.typed
    flat, packed, applied = tools.flat, tools.packed, tools.applied
    shapes, out_shapes = kernel._shapes, kernel._out_shapes
    names = [name for name, _ in (*kernel._inputs, *kernel._outputs)]

    def fail(k: int, found: Any, expected: str) -> None:
        raise errors.TypingError(f"{kernel.name}: argument {names[k]} is {found}; expected {expected}")

    def check(k: int, found: Any, shape: tuple[int, ...]) -> None:
        if not shape:
            if not isinstance(found, types.Number):
                fail(k, found, "a number")
        elif isinstance(found, types.BaseTuple):
            if len(found) != shape[0]:
                fail(k, found, f"{shape[0]} entries")
            for entry in found:
                check(k, entry, shape[1:])
        elif not isinstance(found, types.Array) or found.ndim != len(shape):
            fail(k, found, f"an array with {len(shape)} axes, or a tuple")

    @intrinsic
    def apply(typing: Any, values: Any) -> Any:
        given = list(values)
        n_inputs = len(shapes)
        if len(given) not in (n_inputs, len(names)):
            raise errors.TypingError(
                f"{kernel.name}: {len(given)} arguments; expected {n_inputs}, and {len(out_shapes)} arrays for the "
                f"results or none ({', '.join(names)})"
            )
        for k, (found, shape) in enumerate(zip(given, shapes, strict=False)):
            check(k, found, shape)
        for k, (found, shape) in enumerate(zip(given[n_inputs:], out_shapes, strict=False), n_inputs):
            if not isinstance(found, types.Array) or found.ndim != max(1, len(shape)) or not found.mutable:
                fail(k, found, f"an array with {max(1, len(shape))} axes that can be written")
        real = widest(given[:n_inputs])
        signature = typed(typing, function, shapes, out_shapes, real)
        kinds = [nested(real, shape) for shape in out_shapes]
        returned = types.none if len(given) > n_inputs else kinds[0] if len(kinds) == 1 else types.Tuple(kinds)

        def numbers(context: Any, builder: Any, kind: Any, value: Any, shape: tuple[int, ...]) -> list[Any]:
            if not isinstance(kind, types.Array):
                return flat(context, builder, kind, value, real)  # type: ignore[no-any-return]
            array = context.make_array(kind)(context, builder, value)
            indices = itertools.product(*map(range, shape))
            places = [entry(context, builder, kind, array, index) for index in indices]
            found = [context.unpack_value(builder, kind.dtype, one) for one in places]
            return [context.cast(builder, one, kind.dtype, real) for one in found]

        def entry(context: Any, builder: Any, kind: Any, array: Any, index: tuple[int, ...]) -> Any:
            indices = [number(n) for n in index]
            return cgutils.get_item_pointer(context, builder, kind, array, indices, wraparound=False)

        def code(context: Any, builder: Any, found: Any, arguments: Any) -> Any:
            parts = [builder.extract_value(arguments[0], k) for k in range(len(given))]
            components = [
                numbers(context, builder, kind, part, shape)
                for kind, part, shape in zip(given, parts, shapes, strict=False)
            ]
            results = applied(context, builder, function, signature, shapes, out_shapes, components)
            if len(given) == n_inputs:
                tuples = [packed(context, builder, *one) for one in zip(kinds, results, strict=True)]
                return tuples[0] if len(kinds) == 1 else context.make_tuple(builder, returned, tuples)
            for kind, part, shape, values in zip(given[n_inputs:], parts[n_inputs:], out_shapes, results, strict=True):
                array = context.make_array(kind)(context, builder, part)
                for index, one in zip(itertools.product(*map(range, shape or (1,))), values, strict=True):
                    cast = context.cast(builder, one, real, kind.dtype)
                    context.pack_value(builder, kind.dtype, cast, entry(context, builder, kind, array, index))
            return context.get_dummy_value()

        return returned(values), code

    return apply
