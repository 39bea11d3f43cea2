"""LLVM code of kernels on one element."""

from __future__ import annotations

import itertools
from typing import Any

from ..definition import Definition
from .llvm import applied, cgutils, errors, flat, intrinsic, nested, number, packed, typed, types, widest


def call_on_one(definition: Definition, function: Any) -> Any:
    """Return a kernel on one element, which takes arrays and tuples, and returns a tuple or writes to arrays."""
    shapes, out_shapes = definition.shapes, definition.out_shapes
    names = [name for name, _ in (*definition.inputs, *definition.outputs)]

    def fail(k: int, found: Any, expected: str) -> None:
        raise errors.TypingError(f"{definition.name}: argument {names[k]} is {found}; expected {expected}")

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
                f"{definition.name}: {len(given)} arguments; expected {n_inputs}, or {len(names)} with arrays for the "
                f"results ({', '.join(names)})"
            )
        for k, (found, shape) in enumerate(zip(given, shapes, strict=False)):
            check(k, found, shape)
        for k, (found, shape) in enumerate(zip(given[n_inputs:], out_shapes, strict=False), n_inputs):
            if not isinstance(found, types.Array) or found.ndim != max(1, len(shape)) or not found.mutable:
                fail(k, found, f"a writable array with {max(1, len(shape))} axes")
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
            for kind, part, shape, values in zip(given[n_inputs:], parts[n_inputs:], out_shapes, results, strict=True):
                array = context.make_array(kind)(context, builder, part)
                for index, one in zip(itertools.product(*map(range, shape or (1,))), values, strict=True):
                    cast = context.cast(builder, one, real, kind.dtype)
                    context.pack_value(builder, kind.dtype, cast, entry(context, builder, kind, array, index))
            return context.get_dummy_value()

        return returned(values), code

    return apply
