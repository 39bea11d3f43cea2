"""Kernels under numba: functions for loops of others, and batches as fast as a C compiler makes them.

A batch is run as in the C files: what lies at unit stride is used where it lies, everything else is moved through rows
of a block, and the loop over a block is vectorised. LLVM does not do that by itself, since it would have to compare the
place of every component of a result with every other. So that loop is not printed, but written as LLVM has it, with the
promise that no element reads what another one writes; who calls it has made copies where that would not hold.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from types import FunctionType, SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from .runtime_functions import _SCALAR, _bound
from .runtime_libraries import _LOCK, _foreign, _pointer
from .runtime_strides import _address, _offsets

_WIDEST = {8: 6, 4: 8}
"""By the bytes of a number, the most in an element that LLVM loads and turns well from C order by itself."""
_ROW, _LEAST_ROW, _SPACE = 64, 16, 24 * 1024
"""Elements of a block if its rows fit into so many bytes, and the fewest in any case."""

# Free names of the functions that follow: the type and the width of a number, and what numba has no words for.
_real: Any = None
_w: Any = None
_call: Any = None
_copy: Any = None
_place: Any = None
_spread: Any = None
_gather: Any = None
_turn_in: Any = None
_turn_out: Any = None
_move_rows: Any = None
_move_part: Any = None


def _numba_move_rows(back: int, x: int, row: int, a: int, s: int, c: int, size: int, n: int) -> None:
    """Rows at `x` of `size` components `c` bytes apart of `n` elements `s` bytes apart at `a`, or back to there."""
    done = 0
    if size == 3 and c == _w and s == 3 * _w:
        if back:
            _gather(a, x, row, n)
        else:
            _spread(x, row, a, n)
        return
    if size >= 4 and c == _w:
        step = 4 if back else 8
        while done + step <= n:
            k = 0
            while k < size:
                first = min(k, size - 4)
                if back:
                    _turn_out(x + (first * row + done) * _w, row * _w, a + done * s + first * _w, s)
                else:
                    _turn_in(a + done * s + first * _w, s, x + (first * row + done) * _w, row * _w)
                k += 4
            done += step
    for k in range(size):
        if back:
            _copy(a + k * c + done * s, s, x + (k * row + done) * _w, _w, n - done)
        else:
            _copy(x + (k * row + done) * _w, _w, a + k * c + done * s, s, n - done)


def _numba_move_part(
    back: int, x: int, row: int, table: Any, at: int, a: int, s: int, strides: Any, first: int, n: int
) -> None:
    """All rows of a part, from the batch or back to it; axes that lie as one are moved as one."""
    count, step, axis = 1, _w, table[at + 1]
    while axis > 0 and (count == 1 or strides[first + axis - 1] == count * step):
        if count == 1:
            step = strides[first + axis - 1]
        count *= table[at + 2 + axis]
        axis -= 1
    for k in range(0, table[at], count):
        offset, rest, outer = 0, k // count, axis - 1
        while outer >= 0:
            offset += rest % table[at + 3 + outer] * strides[first + outer]
            rest //= table[at + 3 + outer]
            outer -= 1
        _move_rows(back, x + k * row * _w, row, a + offset, s, step, count, n)


def _numba_batch(run: int, table: Any, arrays: Any, sizes: Any, strides: Any) -> None:
    """The loop `run` over a batch, in blocks of rows where not all parts lie at unit stride.

    `table` has the numbers of arguments, of parts, of strides in an element and of prepared numbers; then the size of
    each part, its number of axes, whether it is prepared, and its lengths.
    """
    n_inputs, n_parts, n_cores, n_prepared, size = table[0], table[1], table[2], table[3], sizes[0]
    # Where the parts are and what is prepared, the strides in an element, and where the rows are.
    local = np.empty(2 * n_parts + 1 + n_cores, np.intp)
    prepared = np.empty(n_prepared + 1, _real)
    starts, cores, rows = local, local[n_parts + 1 :], local[n_parts + 1 + n_cores :]
    total, n_bytes, at = 0, 0, 4
    for p in range(n_parts):
        starts[p] = arrays[p]
        total += table[at]
        n_bytes += abs(strides[p])
        at += 3 + table[at + 1]
    starts[n_parts] = _place(prepared)
    for core in range(n_cores):
        cores[core] = strides[n_parts + core]
    if n_prepared:
        _call(run, -1, _place(starts), _place(cores))
    row = _ROW if size < (1 << 24) // (n_bytes + 1) else _LEAST_ROW
    while row > _LEAST_ROW and row * total * _w > _SPACE:
        row //= 2
    space = np.empty(row * total, _real)
    x, at, first = _place(space), 4, n_parts
    for p in range(n_parts):
        rank = table[at + 1]
        rows[p] = x
        if strides[p] != _w and table[at + 2] == 0:
            starts[p] = x
            if strides[p] == 0 and p < n_inputs:
                _move_part(0, x, row, table, at, arrays[p], 0, strides, first, min(row, size))
            step = row * _w
            for axis in range(rank - 1, -1, -1):
                cores[first - n_parts + axis] = step
                step *= table[at + 3 + axis]
        x += row * table[at] * _w
        first += rank
        at += 3 + rank
    for i in range(0, size, row):
        n = min(row, size - i)
        at, first = 4, n_parts
        for p in range(n_inputs):
            step = strides[p]
            if step == _w and table[at + 2] == 0:
                starts[p] = arrays[p] + i * _w
            elif step != 0 and table[at + 2] == 0:
                _move_part(0, rows[p], row, table, at, arrays[p] + i * step, step, strides, first, n)
            first += table[at + 1]
            at += 3 + table[at + 1]
        results, first_result = at, first
        for p in range(n_inputs, n_parts):
            if strides[p] == _w:
                starts[p] = arrays[p] + i * _w
        _call(run, n, _place(starts), _place(cores))
        at, first = results, first_result
        for p in range(n_inputs, n_parts):
            step = strides[p]
            if step != _w:
                _move_part(1, rows[p], row, table, at, arrays[p] + i * step, step, strides, first, n)
            first += table[at + 1]
            at += 3 + table[at + 1]


class _Element(NamedTuple):
    """A function on one element under numba: of arrays, the last ones for its results, or of tuples and to tuples."""

    function: Any
    tuples: bool = False


@functools.cache
def _tools() -> Any:
    """What is made of numba; not before it is needed, since that takes long to import."""
    import inspect

    import numba
    from numba.core import cgutils, errors
    from numba.core.compiler import CompilerBase, DefaultPassBuilder
    from numba.core.compiler_machinery import FunctionPass, register_pass
    from numba.core.untyped_passes import IRProcessing
    from numba.extending import intrinsic
    from numba.np.arrayobj import populate_array

    ll: Any = cgutils.ir
    types: Any = numba.types
    intp = ll.IntType(types.intp.bitwidth)

    def widest(found: Sequence[Any]) -> Any:
        """The widest type of real numbers among the types of arguments; double for what is none."""
        types_found = []
        for one in found:
            if isinstance(one, types.BaseTuple):
                types_found.append(widest(list(one)))
            else:
                one = getattr(one, "dtype", one)
                types_found.append(one if isinstance(one, types.Float) else types.float64)
        return types.float64 if types.float64 in types_found or not types_found else types.float32

    @register_pass(mutates_CFG=False, analysis_only=False)
    class Constants(FunctionPass):  # type: ignore[misc]
        """Numbers take the type of the arguments, as in C and with numpy: twice a float32 is a float32."""

        _name = "gac_constants"

        def __init__(self) -> None:
            super().__init__()

        def run_pass(self, state: Any) -> bool:
            real = getattr(np, str(widest(state.args)))
            ir = numba.core.ir
            for block in state.func_ir.blocks.values():
                places = {node.index.name for node in block.body if isinstance(node, ir.SetItem)}
                nodes = [node for node in block.body if isinstance(node, ir.Assign)]
                places |= {node.value.index.name for node in nodes if getattr(node.value, "op", "") == "getitem"}
                tuples = (node.value.items for node in nodes if getattr(node.value, "op", "") == "build_tuple")
                places |= {item.name for items in tuples for item in items}
                for node in nodes:
                    found = node.value.value if isinstance(node.value, ir.Const) else None
                    if type(found) in (int, float) and node.target.name not in places:
                        node.value = ir.Const(real(found), node.value.loc)
            return True

    class Compiler(CompilerBase):  # type: ignore[misc]
        """numba's own, and `Constants`."""

        def define_pipelines(self) -> list[Any]:
            passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
            passes.add_pass_after(Constants, IRProcessing)
            passes.finalize()
            return [passes]

    class Distinct(ll.MDValue):  # type: ignore[misc]
        """A metadata node that is equal to no other; `itself` is its first operand where LLVM wants that."""

        def __init__(self, module: Any, operands: Sequence[Any] = (), itself: bool = False) -> None:
            super().__init__(module, operands, str(len(module.metadata)))
            self.operands: tuple[Any, ...] = (self, *operands) if itself else tuple(operands)

        def descr(self, buf: Any) -> None:
            buf += ("distinct !{", ", ".join(operand.get_reference() for operand in self.operands), "}\n")

        __hash__ = object.__hash__

        def __eq__(self, other: object) -> bool:
            return self is other

    def number(value: int) -> Any:
        return ll.Constant(intp, value)

    def pointer(builder: Any, address: Any, kind: Any) -> Any:
        return builder.inttoptr(address, kind.as_pointer())

    def parallel(builder: Any, size: Any, body: Callable[[Any, Callable[[Any], Any]], None]) -> None:
        """A loop whose turns LLVM may do in any order; `body` marks what it loads and stores."""
        group = Distinct(builder.module)
        before = builder.block
        turn, after = builder.append_basic_block("turn"), builder.append_basic_block("after")
        builder.cbranch(builder.icmp_signed(">", size, number(0)), turn, after)
        builder.position_at_end(turn)
        i = builder.phi(intp)
        i.add_incoming(number(0), before)

        def mark(instruction: Any) -> Any:
            instruction.set_metadata("llvm.access.group", group)
            return instruction

        body(i, mark)
        following = builder.add(i, number(1), flags=["nsw", "nuw"])
        i.add_incoming(following, builder.block)
        branch = builder.cbranch(builder.icmp_signed("<", following, size), turn, after)
        promise = builder.module.add_metadata(["llvm.loop.parallel_accesses", group])
        branch.set_metadata("llvm.loop", Distinct(builder.module, [promise], itself=True))
        builder.position_at_end(after)

    def simple(n_arguments: int) -> Callable[[Callable[..., None]], Any]:
        """A statement on integers, from how LLVM has it."""

        def decorate(write: Callable[..., Any]) -> Any:
            def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                write(builder, *arguments)
                return context.get_dummy_value()

            def typed(typing: Any, *arguments: Any) -> Any:
                return types.void(*[types.intp] * n_arguments), code

            names = ("typing", *(f"a{k}" for k in range(n_arguments)))
            parameters = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in names]
            typed.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
            return intrinsic(typed)

        return decorate

    @intrinsic
    def place(typing: Any, array: Any) -> Any:
        """The address of an array."""

        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
            return builder.ptrtoint(data, intp)

        return types.intp(array), code

    @simple(4)
    def call(builder: Any, run: Any, *values: Any) -> None:
        """A call of a loop at an address."""
        kind = ll.FunctionType(ll.VoidType(), [intp] * len(values))
        builder.call(builder.inttoptr(run, kind.as_pointer()), values)

    def movers(real: Any) -> dict[str, Any]:
        """What moves numbers of one type."""
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

    def nested(kind: Any, shape: tuple[int, ...]) -> Any:
        return types.UniTuple(nested(kind, shape[1:]), shape[0]) if shape else kind

    def typed(typing: Any, element: _Element, shapes: Sequence[Any], out_shapes: Sequence[Any], real: Any) -> Any:
        """The signature of a kernel on arrays that lie in order, or on tuples, and on numbers."""
        function = types.Dispatcher(element.function)
        if not element.tuples:
            arrays = [types.Array(real, len(shape), "C") if shape else real for shape in shapes]
            arrays += [types.Array(real, max(1, len(shape)), "C") for shape in out_shapes]
            return typing.resolve_function_type(function, tuple(arrays), {})
        signature = typing.resolve_function_type(function, tuple(nested(real, shape) for shape in shapes), {})
        found = [signature.return_type] if len(out_shapes) == 1 else list(signature.return_type)
        if len(found) != len(out_shapes) or not all(map(fits, found, out_shapes)):
            name = element.function.__name__
            expected = ", ".join(f"({', '.join(map(str, shape))})" for shape in out_shapes)
            raise errors.TypingError(f"{name} returns {signature.return_type}; expected numbers in shape {expected}")
        return signature

    def fits(found: Any, shape: tuple[int, ...]) -> bool:
        """Whether a type is a number, or tuples of numbers of that shape."""
        if not shape or not isinstance(found, types.BaseTuple):
            return not shape and isinstance(found, types.Number)
        return len(found) == shape[0] and all(fits(entry, shape[1:]) for entry in found)

    def flat(context: Any, builder: Any, kind: Any, value: Any, real: Any) -> list[Any]:
        """The numbers in tuples, or one number."""
        if not isinstance(kind, types.BaseTuple):
            return [context.cast(builder, value, kind, real)]
        parts = [flat(context, builder, one, builder.extract_value(value, k), real) for k, one in enumerate(kind)]
        return list(itertools.chain.from_iterable(parts))

    def packed(context: Any, builder: Any, kind: Any, values: Sequence[Any]) -> Any:
        """Numbers as tuples of a type, or one number."""
        if not isinstance(kind, types.BaseTuple):
            return values[0]
        size = len(values) // len(kind)
        parts = [packed(context, builder, one, values[k * size : (k + 1) * size]) for k, one in enumerate(kind)]
        return context.make_tuple(builder, kind, parts)

    def array_in_order(context: Any, builder: Any, kind: Any, shape: Any, values: Sequence[Any]) -> tuple[Any, Any]:
        """An array among the local variables that holds `values`, and where; LLVM keeps it in registers."""
        shape = shape or (1,)
        real = context.get_value_type(kind.dtype)
        size, width = math.prod(shape), real.get_abi_size(context.target_data)
        data = cgutils.alloca_once(builder, ll.ArrayType(real, size))
        data = builder.bitcast(data, real.as_pointer())
        for k, value in enumerate(values):
            builder.store(value, builder.gep(data, [number(k)], source_etype=real))
        array = context.make_array(kind)(context, builder)
        strides = [width * math.prod(shape[axis + 1 :]) for axis in range(len(shape))]
        populate_array(array, data, list(map(number, shape)), list(map(number, strides)), number(width), None)
        return array._getvalue(), data

    def applied(
        context: Any, builder: Any, element: _Element, signature: Any, shapes: Any, out_shapes: Any, values: Any
    ) -> Any:
        """The components of the results of a kernel, from those of its arguments."""
        call = context.get_function(types.Dispatcher(element.function), signature)
        if element.tuples:
            tuples = [packed(context, builder, *one) for one in zip(signature.args, values, strict=True)]
            found, kind, real = call(builder, tuples), signature.return_type, widest(signature.args)
            if len(out_shapes) == 1:
                return [flat(context, builder, kind, found, real)]
            parts = [builder.extract_value(found, k) for k in range(len(kind))]
            return [flat(context, builder, one, part, real) for one, part in zip(kind, parts, strict=True)]
        arguments, outs = [], []
        for kind, shape, value in zip(signature.args, shapes, values, strict=False):
            arguments.append(array_in_order(context, builder, kind, shape, value)[0] if shape else value[0])
        for kind, shape in zip(signature.args[len(shapes) :], out_shapes, strict=True):
            array, data = array_in_order(context, builder, kind, shape, ())
            arguments.append(array)
            outs.append((data, context.get_value_type(kind.dtype), math.prod(shape)))
        call(builder, arguments)
        return [
            [builder.load(builder.gep(data, [number(k)], source_etype=real), typ=real) for k in range(size)]
            for data, real, size in outs
        ]

    def rows(
        shapes: Any, out_shapes: Any, real: Any, function: Any, same: Sequence[int], prepare: Any, dense: bool
    ) -> Any:
        """The loop of a kernel over a block, or that of a form, which without elements prepares.

        What is dense lies in C order; else elements are at unit stride.
        """
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

    def scalar(kernel: Any, function: Any) -> Any:
        """A kernel on one element: from arrays and tuples to a tuple, or into arrays."""
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
                    return flat(context, builder, kind, value, real)
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
                for kind, part, shape, values in zip(
                    given[n_inputs:], parts[n_inputs:], out_shapes, results, strict=True
                ):
                    array = context.make_array(kind)(context, builder, part)
                    for index, one in zip(itertools.product(*map(range, shape or (1,))), values, strict=True):
                        cast = context.cast(builder, one, real, kind.dtype)
                        context.pack_value(builder, kind.dtype, cast, entry(context, builder, kind, array, index))
                return context.get_dummy_value()

            return returned(values), code

        return apply

    return SimpleNamespace(**{name: value for name, value in locals().items() if not name.startswith("_")})


_run_rows: Any = None
_apply: Any = None


def _numba_rows(size: int, starts: int, cores: int) -> None:
    """The loop of a kernel over a block, under the kernel's name."""
    _run_rows(size, starts, cores)


def _numba_jit(*values: Any) -> Any:
    """A kernel on one element."""
    return _apply(values)


_scalar_names: dict[str, Any] = {}


def _kept(decorate: Callable[..., Any], function: Any, **options: Any) -> Any:
    """`function` under numba, kept on disk beside this file or in the user's cache if either can be written."""
    try:
        return decorate(cache=True, **options)(function)
    except RuntimeError:
        return decorate(**options)(function)


_INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""For functions that only others under numba call."""


def _parameters(function: Any) -> tuple[str, ...]:
    names: tuple[str, ...] = function.__code__.co_varnames
    return names[: function.__code__.co_argcount]


def _numba_element(function: Callable[..., None]) -> Any:
    """A kernel's text under numba: rounding as written, inf and nan instead of exceptions, inlined where it is used."""
    import numba

    options = {"error_model": "numpy", "forceinline": True, "pipeline_class": _tools().Compiler}
    with _LOCK:
        if not _scalar_names:
            for name, scalar in _SCALAR.items():
                plain = isinstance(scalar, FunctionType)
                _scalar_names[name] = _kept(numba.njit, scalar, **options) if plain else scalar
    names = {"__name__": __name__, **_scalar_names}
    return _kept(numba.njit, _bound(function, names), **_INNER, **options)


def _scalar_kernel(kernel: Any) -> Any:
    """What a kernel has for other functions under numba."""
    import numba

    apply = _tools().scalar(kernel, kernel._user or _element_of(kernel._functions[0]))
    bound = _bound(_numba_jit, {"__name__": __name__, "_apply": apply})
    bound.__name__ = bound.__qualname__ = kernel.name
    return numba.njit(bound, error_model="numpy", forceinline=True)


_elements: dict[Callable[..., None], _Element] = {}
_N_KNOWN = 256
"""How many shapes and strides a loop remembers how to run."""


def _element_of(function: Callable[..., None]) -> _Element:
    with _LOCK:
        if function not in _elements:
            _elements[function] = _Element(_numba_element(function))
        return _elements[function]


def _element_of_user(function: Any) -> _Element:
    """A function that was not generated, and is not kept on disk: another one may have its name."""
    import numba

    return _Element(numba.njit(getattr(function, "py_func", function), error_model="numpy", forceinline=True), True)


def _callback(
    function: Any, n_arguments: int, pointers: Sequence[int], name: str, names: dict[str, Any], kept: bool = True
) -> Any:
    """A function that C can call: of integers, and of pointers to integers at those places."""
    import numba

    kinds = [numba.types.CPointer(numba.types.intp) if k in pointers else numba.types.intp for k in range(n_arguments)]
    bound = _bound(function, {"__name__": __name__, "range": range, "min": min, "abs": abs, "np": np, **names})
    bound.__qualname__ = name
    decorate = functools.partial(numba.cfunc, numba.types.void(*kinds), error_model="numpy")
    return _kept(decorate, bound) if kept else decorate()(bound)


_drivers: dict[str, tuple[Any, Any]] = {}


def _numba_driver(dtype: np.dtype[Any]) -> Any:
    """What runs the loops of all kernels over batches of one type."""
    import numba

    real = numba.from_dtype(dtype)
    with _LOCK:
        if str(real) not in _drivers:
            tools = _tools()
            kind = tools.ll.DoubleType() if dtype.itemsize == 8 else tools.ll.FloatType()
            names = {"_w": dtype.itemsize, "_real": real, "_call": tools.call, "_place": tools.place}
            names |= {"_ROW": _ROW, "_LEAST_ROW": _LEAST_ROW, "_SPACE": _SPACE, **tools.movers(kind)}
            plain = {"__name__": __name__, "range": range, "min": min, "abs": abs}
            integer, integers = numba.types.intp, numba.types.CPointer(numba.types.intp)
            for name, function in (("_move_rows", _numba_move_rows), ("_move_part", _numba_move_part)):
                bound = _bound(function, {**plain, **names})
                bound.__qualname__ = f"{name}_{real}"
                # Of that signature only: numba would make one more for each number that it sees.
                kinds = [integers if part in ("table", "strides") else integer for part in _parameters(function)]
                decorate = functools.partial(numba.njit, numba.types.void(*kinds))
                names[name] = _kept(decorate, bound, error_model="numpy", **_INNER)
            function = _callback(_numba_batch, 5, (1, 2, 3, 4), f"_batch_{real}", names)
            types = "intptr_t, void *, void *, void *, void *"
            _drivers[str(real)] = _foreign().cast(f"void(*)({types})", function.address), function
        return _drivers[str(real)][0]


_Run = Callable[[list[Any], int], None]


def _numba_forms(kernel: Any, dtype: np.dtype[Any]) -> Callable[[int, list[int]], _Run]:
    """For a number of elements and all strides, what runs a batch from the places of its arrays."""
    import numba

    real = numba.from_dtype(dtype)
    names = [name for name, _ in kernel._inputs]
    shapes, n_parts, width = kernel._all_shapes, len(kernel._all_shapes), dtype.itemsize
    firsts = list(itertools.accumulate(map(len, shapes), initial=n_parts))
    ffi = _foreign()
    new, integers, pointers = ffi.new, ffi.typeof("intptr_t[]"), ffi.typeof("void *[]")
    made: dict[tuple[int, bool], tuple[Any, Any]] = {}

    def loop(which: int, dense: bool) -> tuple[Any, Any]:
        """A loop, and what must not go away while it is used."""
        with _LOCK:
            if (which, dense) not in made:
                same, _, n_prepared, parts = kernel._forms[which] if which >= 0 else ((), 0, 0, kernel._functions)
                element, prepare = kernel._user or _element_of(parts[-1]), None
                if same:
                    prepare = _element_of(parts[0]), n_prepared
                still = [names.index(name) for name in same]
                rows = _tools().rows(kernel._shapes, kernel._out_shapes, real, element, still, prepare, dense)
                name = f"{parts[-1].__name__}_{'dense' if dense else 'rows'}_{real}"
                function = _callback(_numba_rows, 3, (), name, {"_run_rows": rows}, not kernel._user)
                made[which, dense] = ffi.cast("void(*)(intptr_t, void *, void *)", function.address), function
            return made[which, dense]

    def chosen(size: int, strides: list[int]) -> _Run:
        which, same, n_prepared = -1, (), 0
        for k, (kept, least, count, _) in enumerate(kernel._forms):
            if size >= least and not any(strides[names.index(name)] for name in kept):
                which, same, n_prepared = k, kept, count
                break
        changing = [k for k in range(n_parts) if k >= len(names) or names[k] not in same]
        in_place = size == 1 or all(strides[k] == width for k in changing)
        dense = (
            not in_place
            and max(math.prod(shapes[k]) for k in changing) <= _WIDEST[width]
            and all(
                [strides[k], *strides[firsts[k] : firsts[k + 1]]]
                == [width * math.prod(shapes[k][axis:]) for axis in range(len(shapes[k]) + 1)]
                for k in changing
            )
        )
        run, kept_alive = loop(which, dense)
        if in_place or dense:
            cores = new(integers, [*strides[n_parts:], 0])

            def direct(starts: list[Any], size: int) -> None:
                if same:
                    prepared = np.empty(n_prepared, dtype)
                    places = new(pointers, [*starts, ffi.from_buffer(prepared)])
                    run(-1, places, cores)
                else:
                    places = new(pointers, starts)
                run(size, places, cores)

            return direct
        table = [len(names), n_parts, firsts[-1] - n_parts, n_prepared]
        for k, shape in enumerate(shapes):
            table += [math.prod(shape), len(shape), int(k not in changing), *shape]
        tables = new(integers, table), new(integers, strides)
        driver, address = _numba_driver(dtype), kept_alive.address

        def in_rows(starts: list[Any], size: int) -> None:
            driver(address, tables[0], new(pointers, starts), new(integers, [size]), tables[1])

        return in_rows

    return chosen


_chosen: dict[Any, Callable[[int, list[int]], _Run]] = {}


def _numba_chosen(kernel: Any, dtype: np.dtype[Any]) -> Callable[[int, list[int]], _Run]:
    with _LOCK:
        if (kernel, dtype) not in _chosen:
            _chosen[kernel, dtype] = _numba_forms(kernel, dtype)
        return _chosen[kernel, dtype]


def _numba_loop(kernel: Any, dtype: np.dtype[Any]) -> Callable[..., None]:
    chosen = _numba_chosen(kernel, dtype)
    known: dict[tuple[int, ...], _Run] = {}

    def run(arrays: list[Any], sizes: list[int], steps: list[tuple[int, ...]], inner: int) -> None:
        depth, size = len(sizes), sizes[inner]
        flat = [step[inner] for step in steps]
        for step in steps:
            flat += step[depth:]
        key = (size, *flat)
        loop = known.get(key)
        if loop is None:
            if len(known) >= _N_KNOWN:
                known.clear()
            loop = known[key] = chosen(size, flat)
        if depth == 1:
            loop([_pointer(array) for array in arrays], size)
            return
        addresses = [_address(array) for array in arrays]
        for offsets in _offsets(sizes, steps, inner):
            starts = [address + offset for address, offset in zip(addresses, offsets, strict=True)]
            loop([_foreign().cast("void *", start) for start in starts], size)

    return run


def _numba_plan(
    kernel: Any, dtype: np.dtype[Any], size: int, steps: list[tuple[int, ...]]
) -> Callable[[list[Any]], None]:
    """One call of a loop, complete but for the pointers."""
    flat = [step[0] for step in steps] + [stride for step in steps for stride in step[1:]]
    loop = _numba_chosen(kernel, dtype)(size, flat)

    def run(starts: list[Any]) -> None:
        loop(starts, size)

    return run
