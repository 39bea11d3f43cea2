"""Loops in vectors, in kernels whose rows have computed numbers, against sums and searches of numpy."""

from __future__ import annotations

import numpy as np
import pytest

import gacompiler
from gacompiler import SCALAR, array, each, fold, iterate, kernel, pick, select
from gacompiler.backends.c import c_body
from gacompiler.backends.c_vectors import vector_loops
from gacompiler.passes.loops import compile_loops

pytestmark = pytest.mark.slow

BLOCKS = array(SCALAR, "blocks", "lanes")


@kernel(rows=array(SCALAR, "n", "blocks", "lanes"), x=BLOCKS, lanes=array(SCALAR, "lanes"), first=SCALAR, n=SCALAR)
def moved(rows, x, lanes, first, n):
    """Add rows, of which some may not exist, to x, and find the least number of each lane after each of n steps."""

    def step(state):
        x, number, least_yet = state
        new = each(lambda *block: each(lambda a, b: a + b, *block), x, pick(rows, number, 100))

        def smaller(carry, block):
            return each(lambda old, value: select(value < old, value, old), carry, block)

        return new, number + 1, fold(smaller, least_yet, new)

    (x, _, found), _, _ = iterate(step, (x, first, each(lambda k: 1000, lanes)), lambda old, new: 0, n)
    return x, found


@kernel(x=BLOCKS, n=SCALAR)
def running(x, n):
    """Sums of rows, in which each lane needs the one before."""

    def step(x):
        return each(lambda row: gacompiler.scan(lambda sum, value: sum + value, pick(row, 0, 0), row), x)

    return iterate(step, x, lambda old, new: 0, n)[0]


@pytest.mark.parametrize("lanes", [1, 5, 16, 37, 64])
@pytest.mark.parametrize("first", [0, 2, -1, 3])
def test_blocks_of_lanes_and_the_rest(lanes: int, first: int) -> None:
    random = np.random.default_rng(lanes)
    rows, x = random.integers(-50, 50, (4, 3, lanes)).astype(float), random.integers(-9, 9, (3, lanes)).astype(float)
    found, least = gacompiler.compile(moved)(rows, x, np.zeros(lanes), float(first), 3.0)
    wanted, smallest = x, np.full(lanes, 1000.0)
    for number in range(first, first + 3):
        wanted = wanted + (rows[number] if 0 <= number < 4 else 100)
        smallest = np.minimum(smallest, wanted.min(0))
    assert np.array_equal(found, wanted) and np.array_equal(least, smallest)


def test_loops_whose_iterations_need_each_other_do_not_run_in_vectors() -> None:
    assert len(vector_loops(compile_loops(moved).procedure)) >= 2
    assert "GAC_VECTORS(" in c_body("m", [], [compile_loops(moved).procedure])
    assert "Previous(" not in str(vector_loops(compile_loops(running).procedure))
    x = np.arange(6.0).reshape(2, 3)
    wanted = np.cumsum(x, 1) + x[:, :1]
    assert np.array_equal(gacompiler.compile(running)(x, 1.0), wanted)
