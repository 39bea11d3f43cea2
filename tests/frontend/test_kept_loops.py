"""Kernels without arrays of variable length that keep their iterations as loops."""

from __future__ import annotations

import ast
from typing import Any

import numpy as np
import pytest

import gacompiler
from gacompiler import SCALAR, absolute, array, iterate, jvp, kernel
from gacompiler.backends.python_loops import loop_text
from gacompiler.frontend.kernel import Kernel
from gacompiler.gac_runtime.extension import extension
from gacompiler.ir.procedure import Repeat
from gacompiler.passes.loops import compile_loops
from generated import lenses

STEPS = 12


def root_of(a: Any) -> Any:
    """Return the square root of a number, and the number of steps."""
    root, _, steps = iterate(lambda r: (r + a / r) / 2, 1, lambda old, new: absolute(new - old) < 1e-14 * new, STEPS)
    return root, steps


KEPT: Kernel = kernel(a=SCALAR, loops=True)(root_of)
UNROLLED: Kernel = kernel(a=SCALAR)(root_of)


def test_the_text_has_one_step() -> None:
    assert KEPT.has_loops and not UNROLLED.has_loops
    procedure = compile_loops(KEPT, effort=0).procedure
    assert procedure.lengths == () and procedure.signature == "()->(),()"
    (repeat,) = [each for each in procedure.body if isinstance(each, Repeat)]
    assert repeat.limit == STEPS
    body = ast.parse("\n".join(["def f():", *loop_text(procedure).body])).body[0]
    assert sum(isinstance(node, ast.For) for node in ast.walk(body)) == 1


def test_results_are_those_of_the_unrolled_kernel() -> None:
    numbers = np.array([[1.0, 2, 9], [0.5, 3.0, 5.0]])
    found = [gacompiler.compile(each, effort=0)(numbers) for each in (KEPT, UNROLLED)]
    assert np.array_equal(found[0][1], found[1][1]) and found[0][1].max() < STEPS
    for root, _ in found:
        assert np.allclose(root, np.sqrt(numbers), rtol=1e-15, atol=0)


def test_single_calls() -> None:
    run = gacompiler.compile(KEPT, effort=0)
    root, steps = run(16)
    assert root == 4 and steps > 3


def test_derivatives_unroll_the_loop() -> None:
    """Three steps of Newton's method from 1, for numbers near 1."""

    @kernel(a=SCALAR, loops=True)
    def near(a):  # type: ignore[no-untyped-def]
        return iterate(lambda r: (r + a / r) / 2, 1, lambda old, new: absolute(new - old) < 1e-14, 3)[0]

    numbers = np.array([1.02, 0.97])
    value, slope = gacompiler.compile(jvp(near, "a"), effort=0)(numbers, np.ones(2))
    assert np.allclose(value, numbers**0.5, rtol=1e-12) and np.allclose(slope, 0.5 / numbers**0.5, rtol=1e-8)


def test_a_parameter_may_have_the_name_of_the_option() -> None:
    @kernel(loops=array(SCALAR, 2))
    def doubled(loops):  # type: ignore[no-untyped-def]
        return tuple(2 * x for x in loops)

    assert not doubled.has_loops and [parameter.name for parameter in doubled.parameters] == ["loops"]


@pytest.mark.skipif(extension is None, reason="the extension is not built")
def test_the_extension_calls_kernels_without_lengths() -> None:
    """A pixel of a lens without distortion is its own place; the fast path takes arrays and numbers."""
    pixel, coefficients = np.array([0.25, -0.5]), np.zeros(8)
    place, is_found = lenses.undistort_brown(pixel, coefficients, 2.0)
    assert np.allclose(place, pixel, rtol=1e-15) and is_found == 1
    if lenses.backend == "c":
        quick = lenses.undistort_brown.attempt(pixel, coefficients, 2.0)
        assert quick is not None and np.array_equal(quick[0], place) and quick[1] == 1
