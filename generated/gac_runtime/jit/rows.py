"""Kernels with loops compiled by numba, with the interface of the C functions: lengths, addresses and steps.

Rows of tables are flat in this file: a row is a number, an array with one axis, or a tuple of numbers.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
from numba.extending import overload

from ..boundaries import NAMES, bound_of
from ..foreign import LOCK, foreign
from ..functions import bound
from ..loop_definition import ADD_TO, BOUND, NUMBER, ROW_OR, ROWS_TYPE, SUM, LoopDefinition, Part
from .compiled import callback, element_of, kept
from .llvm import (
    CompilerBase,
    DefaultPassBuilder,
    FunctionPass,
    IRProcessing,
    applied,
    build_definitions,
    cgutils,
    flat,
    intrinsic,
    ir,
    packed,
    register_pass,
    typed,
    types,
)


def on_rows(part: Part, real: Any) -> Any:
    """Compile a straight-line part, a function of rows that returns numbers, tuples of numbers, or a tuple of both."""
    element = element_of(part.function)
    shapes, out_shapes = part.shapes, part.out_shapes

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        components = [
            _numbers(context, builder, kind, value, math.prod(shape), real)
            for kind, value, shape in zip(signature.args, arguments, shapes, strict=True)
        ]
        own = typed(context.typing_context, element, shapes, out_shapes, real)
        found = applied(context, builder, element, own, shapes, out_shapes, components)
        # A part without arguments computes in doubles, since it has no arguments that determine the dtype.
        wide = types.float64 if not shapes else real
        results = [[context.cast(builder, number, wide, real) for number in numbers] for numbers in found]
        kinds = [_row_type(real, shape) for shape in out_shapes]
        tuples = [packed(context, builder, *one) for one in zip(kinds, results, strict=True)]
        return tuples[0] if len(kinds) == 1 else context.make_tuple(builder, signature.return_type, tuples)

    def apply(typing: Any, *given: Any) -> Any:
        typed(typing, element, shapes, out_shapes, real)
        kinds = [_row_type(real, shape) for shape in out_shapes]
        return (kinds[0] if len(kinds) == 1 else types.Tuple(kinds))(*given), code

    names = ("typing", *(f"row_{k}" for k in range(len(shapes))))
    parameters = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in names]
    apply.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return intrinsic(apply)


def _number_as(real: Any) -> Any:
    """Compile a function that returns a number of a table in the type of the kernel."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _numbers(context, builder, signature.args[0], arguments[0], 1, real)[0]

    def number(typing: Any, x: Any) -> Any:
        return real(x), code

    return intrinsic(number)


def _row_type(real: Any, shape: Sequence[int]) -> Any:
    return types.UniTuple(real, math.prod(shape)) if shape else real


def _numbers(context: Any, builder: Any, kind: Any, value: Any, size: int, real: Any) -> list[Any]:
    """Return the numbers of a row."""
    if not isinstance(kind, types.Array):
        return flat(context, builder, kind, value, real)
    array = context.make_array(kind)(context, builder, value)
    found = []
    for k in range(size):
        index = context.get_constant(types.intp, k)
        place = cgutils.get_item_pointer(context, builder, kind, array, [index], wraparound=False)
        found.append(context.cast(builder, context.unpack_value(builder, kind.dtype, place), kind.dtype, real))
    return found


# Operations on rows in the text of a loop. Functions of tuples are generated as text because tuples have fixed lengths.


def _meaning(function: Any) -> Callable[[Callable[..., Any]], None]:
    """Return a decorator for a function that creates the numba implementation from the types of the arguments."""

    def declare(made: Callable[..., Any]) -> None:
        made.__annotations__.clear()  # numba requires that the parameters of both are equal, including annotations
        overload(function, jit_options={"forceinline": True})(made)

    return declare


def _made(head: str, *lines: str) -> Any:
    names: dict[str, Any] = {}
    exec("\n".join([head, *lines]), names)
    return names["run"]


def _row_or(table: Any, k: Any, start: Any) -> Any:
    """Return row k of a table, or `start` if there is no such row."""


def _add_to(table: Any, k: Any, row: Any) -> None:
    """Add to row k of a table if it exists."""


def _sum(a: Any, b: Any) -> Any:
    """Return the sum of two rows."""


def _put(table: Any, k: Any, row: Any) -> None:
    """Write row k of a table, or a whole table."""


def _numbers_in(k: Any) -> tuple[str, str]:
    """Return the condition that a row with the number or the numbers `k` exists, and the text of the numbers."""
    numbers = [f"k[{j}]" for j in range(len(k))] if isinstance(k, types.BaseTuple) else ["k"]
    within = " and ".join(f"0 <= {number} < table.shape[{j}]" for j, number in enumerate(numbers))
    return within, ", ".join(f"int({number})" for number in numbers)


@_meaning(_row_or)
def _typed_row_or(table: Any, k: Any, start: Any) -> Any:
    within, place = _numbers_in(k)
    row = f"table[{place}]"
    if isinstance(start, types.BaseTuple):
        row = f"({''.join(f'table[{place}, {j}], ' for j in range(len(start)))})"
    return _made("def run(table, k, start):", f"    return {row} if {within} else start")


@_meaning(_add_to)
def _typed_add_to(table: Any, k: Any, row: Any) -> Any:
    within, place = _numbers_in(k)
    lines = [f"    if {within}:"]
    if isinstance(row, types.BaseTuple):
        lines += [f"        table[{place}, {j}] += row[{j}]" for j in range(len(row))]
    elif isinstance(row, types.Array):
        lines += ["        for j in range(row.shape[0]):", f"            table[{place}, j] += row[j]"]
    else:
        lines += [f"        table[{place}] += row"]
    return _made("def run(table, k, row):", *lines)


@_meaning(_sum)
def _typed_sum(a: Any, b: Any) -> Any:
    if isinstance(a, types.BaseTuple):
        return _made("def run(a, b):", f"    return ({''.join(f'a[{j}] + b[{j}], ' for j in range(len(a)))})")
    return _made("def run(a, b):", "    return a + b")


@_meaning(_put)
def _typed_put(table: Any, k: Any, row: Any) -> Any:
    if isinstance(k, types.SliceType):
        if not isinstance(row, types.BaseTuple):
            return _made("def run(table, k, row):", "    table[:] = row")
        places = [f"table[{j}]" for j in range(len(row))]
    elif isinstance(k, types.BaseTuple) and not len(k):
        places = ["table[0]"]
    else:
        _, place = _numbers_in(k)
        is_tuple = isinstance(row, types.BaseTuple)
        places = [f"table[{place}, {j}]" for j in range(len(row))] if is_tuple else [f"table[{place}]"]
    values = [f"row[{j}]" for j in range(len(row))] if isinstance(row, types.BaseTuple) else ["row"]
    lines = [f"    {place} = {value}" for place, value in zip(places, values, strict=True)]
    return _made("def run(table, k, row):", *lines)


@register_pass(mutates_CFG=False, analysis_only=False)
class _Writes(FunctionPass):  # type: ignore[misc]
    """A pass that replaces assignments to rows by `_put`, because numba checks the shapes of tuples at run time."""

    _name = "gac_writes"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Change the code; true where it has changed."""
        known = state.func_ir
        for block in known.blocks.values():
            body = []
            for node in block.body:
                if not isinstance(node, ir.SetItem):
                    body.append(node)
                    continue
                function, result = block.scope.make_temp(node.loc), block.scope.make_temp(node.loc)
                body.append(ir.Assign(ir.Global("_put", _put, node.loc), function, node.loc))
                called = ir.Expr.call(function, [node.target, node.index, node.value], (), node.loc)
                body.append(ir.Assign(called, result, node.loc))
            block.body = body
        known._definitions = build_definitions(known.blocks)
        return True


class _Compiler(CompilerBase):  # type: ignore[misc]
    """The compiler of numba with the additional pass `_Writes`."""

    def define_pipelines(self) -> list[Any]:
        """Return numba's passes with that of this compiler."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_Writes, IRProcessing)
        passes.finalize()
        return [passes]


@intrinsic
def _pointer_to(typing: Any, address: Any, like: Any) -> Any:
    """Convert an address to a pointer to numbers with the dtype of `like`."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

    return types.CPointer(like.dtype)(types.intp, like), code


_BOUNDARIES = {name: numba.njit(function) for name, function in NAMES.items()}
_BOUND = numba.njit(bound_of)


class LoopRows:
    """A compiled kernel with loops over batches of one dtype.

    It is called with pointers to lengths, addresses and steps, and the number of elements, like the C function
    ``_rows_``. The addresses of the intermediate tables over lengths follow those of the results.
    """

    def __init__(self, definition: LoopDefinition, dtype: np.dtype[Any]) -> None:
        real = numba.from_dtype(dtype)
        with LOCK:
            names: dict[str, Any] = {name: on_rows(part, real) for name, part in definition.parts.items()}
            names |= {"__name__": __name__, "range": range, ROW_OR: _row_or, ADD_TO: _add_to, SUM: _sum}
            names |= {**_BOUNDARIES, BOUND: _BOUND, NUMBER: _number_as(real)}
            chosen = bound(definition.function, names)
            chosen.__qualname__ = f"{definition.name}_{real}"
            inner = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "forceinline": True}
            element = kept(numba.njit, chosen, pipeline_class=_Compiler, error_model="numpy", **inner)
            driver = _made("def run(lengths, starts, steps, count):", *_driver_lines(definition))
            integer, integers = types.intp, types.CPointer(types.intp)
            used = {
                "_element": element,
                "_pointer_to": _pointer_to,
                "_real": np.empty(0, dtype),
                "_integer": np.empty(0, np.int64),
                "carray": numba.carray,
            }
            self._function = callback(
                driver,
                types.int32(integers, integers, integers, integer),
                f"{definition.name}_rows_{real}",
                used,
                file=definition.function.__code__.co_filename,
            )
            self.address: int = self._function.address
        self.call = foreign().cast(ROWS_TYPE, self.address)


def _driver_lines(definition: LoopDefinition) -> list[str]:
    """Return the text of a loop over elements."""
    lengths = {name: f"n{k}" for k, name in enumerate(definition.lengths)}
    lines = [f"    {n} = lengths[{k}]" for k, n in enumerate(lengths.values())]
    arguments = list(lengths.values())
    for k, table in enumerate((*definition.parameters, *definition.results, *definition.work)):
        sizes = [lengths[name] for name in table.lengths]
        sizes += [str(math.prod(table.shape))] if table.shape or not sizes else []
        start = f"_pointer_to(starts[{k}] + k * steps[{k}], {'_integer' if table.is_index else '_real'})"
        is_number = not table.lengths and not table.shape and k < len(definition.parameters)
        arguments.append(f"carray({start}, ({', '.join(sizes)},)){'[0]' if is_number else ''}")
    lines += ["    for k in range(count):", "        _element("]
    return [*lines, *(f"            {argument}," for argument in arguments), "        )", "    return 0"]
