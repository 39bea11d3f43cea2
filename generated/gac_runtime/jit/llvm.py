"""Extensions of numba for kernels: constants of the arguments' dtype, components in registers, parallel loops.

This is the only file that uses internals of numba that may change between releases (`numba.core`).
"""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numba
import numpy as np
from numba.core import cgutils as cgutils
from numba.core import errors as errors
from numba.core.compiler import CompilerBase as CompilerBase
from numba.core.compiler import DefaultPassBuilder as DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass as FunctionPass
from numba.core.compiler_machinery import register_pass as register_pass
from numba.core.ir_utils import build_definitions as build_definitions
from numba.core.untyped_passes import IRProcessing as IRProcessing
from numba.extending import intrinsic as intrinsic

from ..functions import OF_ANGLES


class Element(NamedTuple):
    """A compiled function on one element; arguments and results are numbers, tuples of numbers, and tuples of rows."""

    function: Any
    notes: bool = False
    """Whether its first argument is paired with a pointer to which it writes 1 if an angle is too large."""


ll: Any = cgutils.ir
ir: Any = numba.core.ir
types: Any = numba.types
intp = ll.IntType(types.intp.bitwidth)


def widest(found: Sequence[Any]) -> Any:
    """Return the widest floating-point type among the types of arguments; other types count as double."""
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
    """A pass that gives constants the dtype of the arguments, as in C and numpy: 2 times a float32 is a float32."""

    _name = "gac_constants"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Change the code; true where it has changed."""
        real = getattr(np, str(widest(state.args)))
        nodes = [node for block in state.func_ir.blocks.values() for node in block.body]
        for node in (node for node in nodes if isinstance(node, ir.Assign) and isinstance(node.value, ir.Const)):
            if type(node.value.value) in (int, float):
                node.value = ir.Const(real(node.value.value), node.value.loc)
        return True


@register_pass(mutates_CFG=False, analysis_only=False)
class Notes(FunctionPass):  # type: ignore[misc]
    """A pass that passes the pointer paired with the first argument to sines and cosines, which flag large angles."""

    _name = "gac_notes"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Change the code; true where it has changed."""
        known = state.func_ir
        (block,) = known.blocks.values()
        nodes = [node for node in block.body if isinstance(node, ir.Assign)]
        first = next(node for node in nodes if isinstance(node.value, ir.Arg) and node.value.index == 0)
        pair, place = block.scope.make_temp(first.loc), block.scope.make_temp(first.loc)
        named = [node for node in nodes if isinstance(node.value, ir.Global)]
        turns = {node.target.name for node in named if node.value.name in OF_ANGLES}
        for node in nodes:
            if getattr(node.value, "op", "") == "call" and node.value.func.name in turns:
                node.value.args = [*node.value.args, place]
        entries = [ir.Expr.static_getitem(pair, k, None, first.loc) for k in range(2)]
        found = zip((first.value, *entries), (pair, first.target, place), strict=True)
        k = block.body.index(first)
        block.body[k : k + 1] = [ir.Assign(value, target, first.loc) for value, target in found]
        known._definitions = build_definitions(known.blocks)
        return True


class Compiler(CompilerBase):  # type: ignore[misc]
    """The compiler of numba with the additional pass `Constants`."""

    added: tuple[Any, ...] = (Constants,)

    def define_pipelines(self) -> list[Any]:
        """Return numba's passes with those of this compiler."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        for one in self.added:
            passes.add_pass_after(one, IRProcessing)
        passes.finalize()
        return [passes]


class NotingCompiler(Compiler):
    """The compiler of numba with the additional passes `Constants` and `Notes`."""

    added = Constants, Notes


class Distinct(ll.MDValue):  # type: ignore[misc]
    """A distinct metadata node; if `itself` is true, its first operand is the node, as LLVM requires for loops."""

    def __init__(self, module: Any, operands: Sequence[Any] = (), itself: bool = False) -> None:
        super().__init__(module, operands, str(len(module.metadata)))
        self.operands: tuple[Any, ...] = (self, *operands) if itself else tuple(operands)

    def descr(self, buf: Any) -> None:
        """Add the text of the node to `buf`."""
        buf += ("distinct !{", ", ".join(operand.get_reference() for operand in self.operands), "}\n")

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other


def number(value: int) -> Any:
    """Return a constant integer."""
    return ll.Constant(intp, value)


def pointer(builder: Any, address: Any, kind: Any) -> Any:
    """Convert an address to a pointer to numbers of a type."""
    return builder.inttoptr(address, kind.as_pointer())


def loop(
    builder: Any, first: Any, last: Any, step: int, body: Callable[[Any], None], hints: Sequence[Sequence[Any]]
) -> None:
    """Write a loop with hints for LLVM."""
    before = builder.block
    turn, after = builder.append_basic_block("turn"), builder.append_basic_block("after")
    builder.cbranch(builder.icmp_signed("<", first, last), turn, after)
    builder.position_at_end(turn)
    i = builder.phi(intp)
    i.add_incoming(first, before)
    body(i)
    following = builder.add(i, number(step), flags=["nsw", "nuw"])
    i.add_incoming(following, builder.block)
    branch = builder.cbranch(builder.icmp_signed("<", following, last), turn, after)
    told = [builder.module.add_metadata(hint) for hint in hints]
    branch.set_metadata("llvm.loop", Distinct(builder.module, told, itself=True))
    builder.position_at_end(after)


def hint(what: str, value: int) -> list[Any]:
    """Return a loop hint in LLVM's format."""
    return [f"llvm.loop.{what}", ll.Constant(ll.IntType(32), value)]


def one_by_one(builder: Any, first: Any, last: Any, step: int, body: Callable[[Any], None]) -> None:
    """Write a loop that LLVM neither vectorises nor unrolls."""
    loop(builder, first, last, step, body, [hint("vectorize.width", 1), ["llvm.loop.unroll.disable"]])


def parallel(builder: Any, size: Any, body: Callable[[Any, Callable[[Any], Any]], None], lanes: int = 0) -> None:
    """Write a loop whose iterations LLVM may execute in any order, or as `lanes` lanes of one vector.

    `body` must mark its loads and stores.
    """
    group = Distinct(builder.module)

    def mark(instruction: Any) -> Any:
        instruction.set_metadata("llvm.access.group", group)
        return instruction

    hints = [["llvm.loop.parallel_accesses", group]]
    if lanes:
        # If LLVM unrolled the loop first, it would not vectorise it.
        hints += [hint("vectorize.width", lanes), hint("interleave.count", 1), ["llvm.loop.unroll.disable"]]
        hints.append(["llvm.loop.vectorize.enable", ll.Constant(ll.IntType(1), 1)])
    loop(builder, number(0), size, 1, lambda i: body(i, mark), hints)


def simple(n_arguments: int) -> Callable[[Callable[..., None]], Any]:
    """Return a decorator that makes an intrinsic statement on integers from a function that writes LLVM code."""

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
    """Return the address of an array."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.ptrtoint(data, intp)

    return types.intp(array), code


@intrinsic
def at(typing: Any, table: Any, k: Any) -> Any:
    """Return the address of an entry of a table of integers."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.ptrtoint(builder.gep(arguments[0], [arguments[1]], source_etype=intp), intp)

    return types.intp(table, types.intp), code


@simple(4)
def call(builder: Any, run: Any, *values: Any) -> None:
    """Call a loop at an address."""
    kind = ll.FunctionType(ll.VoidType(), [intp] * len(values))
    builder.call(builder.inttoptr(run, kind.as_pointer()), values)


def nested(kind: Any, shape: tuple[int, ...]) -> Any:
    """Return the type of nested tuples of a shape."""
    return types.UniTuple(nested(kind, shape[1:]), shape[0]) if shape else kind


def typed(typing: Any, element: Element, shapes: Sequence[Any], out_shapes: Sequence[Any], real: Any) -> Any:
    """Return the signature of a kernel for numbers and tuples of one dtype."""
    kinds = [nested(real, shape) for shape in shapes]
    if element.notes:
        kinds[0] = types.Tuple([kinds[0], types.CPointer(real)])
    signature = typing.resolve_function_type(types.Dispatcher(element.function), tuple(kinds), {})
    found = [signature.return_type] if len(out_shapes) == 1 else list(signature.return_type)
    if len(found) != len(out_shapes) or not all(map(fits, found, out_shapes)):
        name = element.function.__name__
        expected = ", ".join(f"({', '.join(map(str, shape))})" for shape in out_shapes)
        raise errors.TypingError(f"{name} returns {signature.return_type}; expected numbers in shape {expected}")
    return signature


def fits(found: Any, shape: tuple[int, ...]) -> bool:
    """Whether a type is a number, or nested tuples of numbers of this shape."""
    if not shape or not isinstance(found, types.BaseTuple):
        return not shape and isinstance(found, types.Number)
    return len(found) == shape[0] and all(fits(entry, shape[1:]) for entry in found)


def flat(context: Any, builder: Any, kind: Any, value: Any, real: Any) -> list[Any]:
    """Return the numbers in nested tuples, or a single number, as a list."""
    if not isinstance(kind, types.BaseTuple):
        return [context.cast(builder, value, kind, real)]
    parts = [flat(context, builder, one, builder.extract_value(value, k), real) for k, one in enumerate(kind)]
    return list(itertools.chain.from_iterable(parts))


def packed(context: Any, builder: Any, kind: Any, values: Sequence[Any]) -> Any:
    """Return nested tuples of a type from a list of numbers, or a single number."""
    if not isinstance(kind, types.BaseTuple):
        return values[0]
    size = len(values) // len(kind)
    parts = [packed(context, builder, one, values[k * size : (k + 1) * size]) for k, one in enumerate(kind)]
    return context.make_tuple(builder, kind, parts)


def applied(
    context: Any, builder: Any, element: Element, signature: Any, shapes: Any, out_shapes: Any, values: Any
) -> Any:
    """Return the components of a kernel's results from those of its arguments, and its flag if it has one."""
    call = context.get_function(types.Dispatcher(element.function), signature)
    real, returned = widest(signature.args), signature.return_type
    kinds = [nested(real, shape) for shape in shapes]
    tuples = [packed(context, builder, *one) for one in zip(kinds, values, strict=True)]
    if element.notes:
        zero = ll.Constant(context.get_value_type(real), 0)
        place = cgutils.alloca_once(builder, zero.type)
        builder.store(zero, place)
        tuples[0] = context.make_tuple(builder, signature.args[0], [tuples[0], place])
    found = call(builder, tuples)
    if len(out_shapes) == 1:
        outs = [flat(context, builder, returned, found, real)]
    else:
        parts = [builder.extract_value(found, k) for k in range(len(returned))]
        outs = [flat(context, builder, *one, real) for one in zip(returned, parts, strict=True)]
    return [*outs, [builder.load(place)]] if element.notes else outs
