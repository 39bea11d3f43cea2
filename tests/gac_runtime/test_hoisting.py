"""Values that depend on uniform arguments only, which the runtime separates from the function of a kernel."""

from __future__ import annotations

import math
from random import Random
from typing import Any

import numpy as np
import pytest

from generated import cga3, grasping, hand_eye, networks, quaternion

pytest.importorskip("numba")

from gacompiler.gac_runtime.definition import Definition, Form
from gacompiler.gac_runtime.functions import SCALAR_FUNCTIONS, bound
from gacompiler.gac_runtime.jit.hoisting import hoisted

MODULES = (cga3, grasping, hand_eye, networks, quaternion)


def separated() -> list[tuple[Definition, Form]]:
    """Forms without functions of some modules."""
    kernels = [getattr(module, name) for module in MODULES for name in module.kernels]
    definitions = [getattr(each, "kernel", each).definition for each in kernels]
    return [(one, form) for one in definitions for form in getattr(one, "forms", ()) if form.apply is None]


def functions(definition: Definition, form: Form) -> tuple[Any, Any, int]:
    """The functions of both steps, with the scalar functions bound, and the number of prepared values."""
    inputs = tuple(definition.inputs)
    prepare, apply, count = hoisted(definition.function, inputs, tuple(definition.out_shapes), frozenset(form.same))
    return bound(prepare, SCALAR_FUNCTIONS), bound(apply, SCALAR_FUNCTIONS), count


def nested(numbers: Any, shape: tuple[int, ...]) -> Any:
    """Numbers in C order in nested tuples."""
    return tuple(nested(numbers, shape[1:]) for _ in range(shape[0])) if shape else next(numbers)


def bits(value: Any) -> Any:
    """The exact numbers of nested tuples; NaN is equal to itself."""
    return tuple(map(bits, value)) if isinstance(value, tuple) else float(value).hex()


def test_both_steps_give_the_bits_of_the_kernel() -> None:
    """The steps together perform the same operations, so that no result is rounded differently."""
    random, tried = Random(4), 0
    for definition, form in separated():
        prepare, apply, count = functions(definition, form)
        for _ in range(3):
            given = {
                name: nested(iter(lambda: random.uniform(0.1, 0.9), None), shape) for name, shape in definition.inputs
            }
            try:
                expected = bound(definition.function, SCALAR_FUNCTIONS)(*given.values())
            except (ValueError, ZeroDivisionError):  # outside of the domain of a root or an arc cosine
                continue
            prepared = prepare(*(value for name, value in given.items() if name in form.same))
            assert len(prepared) == count
            found = apply(prepared, *(value for name, value in given.items() if name not in form.same))
            assert bits(found) == bits(expected), (definition.name, form.same)
            tried += 1
    assert tried > 200


def test_what_is_uniform_is_not_computed_again() -> None:
    """A sine and a cosine of the angle are in the first step; the root of the axis is in the other."""
    definition = quaternion.from_axis_angle.definition
    (form,) = [form for form in definition.forms if form.same == ("angle",)]
    prepare, apply, count = functions(definition, form)
    assert count == 2 and {"sin", "cos"} <= set(prepare.__code__.co_names)
    assert set(apply.__code__.co_names) == {"sqrt"}
    assert prepare(1.0) == (math.sin(0.5), math.cos(0.5))


def test_functions_are_in_the_file_of_the_kernel() -> None:
    """numba stores machine code by the file and the name of a function."""
    definition = quaternion.from_axis_angle.definition
    names = set()
    for form in definition.forms:
        for function in functions(definition, form)[:2]:
            assert function.__code__.co_filename == definition.function.__code__.co_filename
            names.add(function.__name__)
    assert names == {f"_from_axis_angle_{step}_{same}" for step in ("prepare", "apply") for same in ("angle", "axis")}


def test_operations_with_numbers_on_either_side() -> None:
    def function(a: Any, b: Any) -> Any:
        (x, y), w = a, b
        t = 2 - x / 3 - (-y) * 0.5
        return ((1 / t + w, 7), (t * w, 4 * x - 1))

    prepare, apply, count = hoisted(function, (("a", (2,)), ("b", ())), ((2, 2),), frozenset({"a"}))
    prepared = prepare((0.25, 0.5))
    assert count == 3 == len(prepared)
    assert apply(prepared, 3.0) == function((0.25, 0.5), 3.0)
    assert np.array(apply(prepared, 3.0)).shape == (2, 2)
