"""Kernels over arrays with several axes, and rows that are searched or selected by a number, against numpy."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, reduce
from random import Random
from typing import Any

import numpy as np
import pytest
from exact_runs import run_exactly

import gacompiler
from benchmarks.loops import kalman
from gacompiler import (
    SCALAR,
    all_rows,
    any_row,
    array,
    count_rows,
    each,
    equal,
    first_row,
    fold,
    gather,
    index,
    iterate,
    kernel,
    least,
    pick,
    row_numbers,
    scan,
    select,
    sqrt,
    total,
    transpose,
    vjp,
)  # fmt: skip
from gacompiler.algebra.catalog import CGA3
from gacompiler.errors import KernelError
from gacompiler.frontend.kernel import Kernel
from gacompiler.ir.procedure import Procedure, Storage, statements
from gacompiler.ir.procedure_text import procedure_text
from gacompiler.passes.loops import compile_loops
from tests.support.all_cases import all_cases

N, M, MATRIX = array(SCALAR, "n"), array(SCALAR, "m"), array(SCALAR, "n", "m")
LENGTHS = {"n": 3, "m": 4, "k": 2}


def exact(definition: Kernel, **given: Any) -> list[np.ndarray[Any, Any]]:
    """Compile a kernel, which proves it, and run it on integers."""
    return run_exactly(compile_loops(definition, effort=0).procedure, given)


def integers(seed: int, *shape: int) -> np.ndarray[Any, Any]:
    return np.random.default_rng(seed).integers(-4, 5, shape).astype(object)


# Random kernels. Each value is described once for the kernel and once for numpy.


@dataclass
class Value:
    """An array over named axes, as a function of the parameters for kernels and for numpy."""

    axes: tuple[str, ...]
    build: Callable[[dict[str, Any]], Any]
    expect: Callable[[dict[str, Any]], Any]


ELEMENTWISE: list[tuple[Callable[[Any, Any], Any], Callable[[Any, Any], Any]]] = [
    (lambda p, q: p * q + 1, lambda p, q: p * q + 1),
    (lambda p, q: p - 2 * q, lambda p, q: p - 2 * q),
    (lambda p, q: select(p < q, p + q, 3), lambda p, q: np.where(p < q, p + q, 3)),
]


def mapped(function: Callable[..., Any], axes: int, *arrays: Any) -> Any:
    """Apply a function to every element of arrays with so many axes."""
    return each(lambda *rows: mapped(function, axes - 1, *rows), *arrays) if axes else function(*arrays)


def random_value(random: Random, axes: tuple[str, ...], depth: int) -> Value:
    """A random array over the given axes."""
    if depth == 0 or random.random() < 0.1:
        name = "_".join(axes) or "s"
        return Value(axes, lambda env: env[name], lambda env: env[name])
    made, wanted = random.choice(ELEMENTWISE)
    other = random.choice([name for name in LENGTHS if name not in axes] or ["n"])
    choices: list[Callable[[], Value]] = []

    def elementwise() -> Value:
        a, b = random_value(random, axes, depth - 1), random_value(random, axes, depth - 1)
        return Value(axes, lambda e: mapped(made, len(axes), a.build(e), b.build(e)),
                     lambda e: wanted(a.expect(e), b.expect(e)))  # fmt: skip

    def summed() -> Value:
        a = random_value(random, (other, *axes), depth - 1)
        return Value(axes, lambda e: total(lambda row: row, a.build(e)), lambda e: a.expect(e).sum(axis=0))

    def folded() -> Value:
        a, b = random_value(random, (other, *axes), depth - 1), random_value(random, axes, depth - 1)
        return Value(
            axes,
            lambda e: fold(lambda v, row: mapped(made, len(axes), v, row), b.build(e), a.build(e)),
            lambda e: reduce(wanted, a.expect(e), b.expect(e)),
        )

    def picked() -> Value:
        a, k = random_value(random, (other, *axes), depth - 1), random.randrange(-1, 5)
        inside = 0 <= k < LENGTHS[other]
        return Value(
            axes,
            lambda e: pick(a.build(e), e["s"] * 0 + k, 7),
            lambda e: a.expect(e)[k] if inside else np.full(tuple(LENGTHS[n] for n in axes), 7, object),
        )

    def ranged() -> Value:
        a, b = random_value(random, (other, *axes), depth - 1), random_value(random, axes, depth - 1)
        first, end, step = random.randrange(-1, 4), random.randrange(-1, 6), random.choice([1, -1])
        some = slice(max(first, 0), max(end, 0))
        return Value(
            axes,
            lambda e: fold(
                lambda v, row: mapped(made, len(axes), v, row), b.build(e), a.build(e),
                within=(e["s"] * 0 + first, e["s"] * 0 + end), reverse=step < 0,
            ),
            lambda e: reduce(wanted, a.expect(e)[some][::step], b.expect(e)),
        )  # fmt: skip

    choices += [elementwise, *([summed, folded, picked, ranged] if len(axes) < len(LENGTHS) else [])]

    def scanned() -> Value:
        a, b = random_value(random, axes, depth - 1), random_value(random, axes[1:], depth - 1)

        def expect(e: dict[str, Any]) -> Any:
            last, found = b.expect(e), []
            for row in a.expect(e):
                last = wanted(last, row)
                found.append(last)
            return np.array(found, object)

        return Value(
            axes, lambda e: scan(lambda v, r: mapped(made, len(axes) - 1, v, r), b.build(e), a.build(e)), expect
        )

    def outer() -> Value:
        a, b = random_value(random, axes[:1], depth - 1), random_value(random, axes[1:], depth - 1)
        inner = len(axes) - 1
        return Value(
            axes,
            lambda e: each(lambda p: mapped(lambda q: made(p, q), inner, b.build(e)), a.build(e)),
            lambda e: np.array([wanted(p, b.expect(e)) for p in a.expect(e)], object),
        )

    def gathered() -> Value:
        a = random_value(random, axes, depth - 1)
        return Value(axes, lambda e: gather(a.build(e), e["w"]), lambda e: a.expect(e)[e["w"].astype(int)])

    def exchanged() -> Value:
        a = random_value(random, (axes[1], axes[0], *axes[2:]), depth - 1)
        return Value(axes, lambda e: transpose(a.build(e)), lambda e: np.swapaxes(a.expect(e), 0, 1))

    if axes:
        choices += [scanned, outer]
    if axes[:1] == ("n",):
        choices.append(gathered)
    if len(axes) > 1:
        choices.append(exchanged)
    return random.choice(choices)()


def shapes() -> list[tuple[str, ...]]:
    names = list(LENGTHS)
    pairs = [(a, b) for a in names for b in names if a != b]
    triples = [(a, b, c) for a, b in pairs for c in names if c not in (a, b)]
    return [(), *((a,) for a in names), *pairs, *triples]


def random_kernel(seed: int) -> tuple[Kernel, Value, dict[str, Any]]:
    """A random kernel, what it computes, and arguments."""
    random = Random(seed)
    axes = random.choice([("n",), ("m",), ("n", "m"), ("m", "k"), ("k", "n"), ("n", "k", "m")])
    value = random_value(random, axes, 3)
    names = ["_".join(each_axes) or "s" for each_axes in shapes()]
    types = [array(SCALAR, *each_axes) if each_axes else SCALAR for each_axes in shapes()]
    env = {
        name: integers(seed + j, *(LENGTHS[length] for length in each_axes))
        for j, (name, each_axes) in enumerate(zip(names, shapes(), strict=True))
    }
    env["w"] = np.array([random.randrange(LENGTHS["n"]) for _ in range(LENGTHS["n"])], object)

    def function(*given: Any) -> Any:
        return value.build(dict(zip([*names, "w"], given, strict=True)))

    function.__signature__ = _signature([*names, "w"])  # type: ignore[attr-defined]
    function.__name__ = "random_kernel"
    return kernel(**dict(zip(names, types, strict=True)), w=index("n"))(function), value, env


@pytest.mark.parametrize("seed", [*range(12), *(pytest.param(k, marks=pytest.mark.slow) for k in range(12, 72))])
def test_random_kernels_equal_numpy(seed: int) -> None:
    definition, value, env = random_kernel(seed)
    (found,) = exact(definition, **env)
    assert np.array_equal(found, np.broadcast_to(value.expect(env), found.shape))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(7))
def test_gradients_of_gradients_of_random_kernels_are_those_of_unrolled_loops(seed: int) -> None:
    """Compiling proves it. The reverse mode stores what loops in loops overwrite; unrolled loops overwrite nothing."""
    definition, _, env = random_kernel(seed)
    procedure = compile_loops(definition, effort=0).procedure
    sources = [getattr(each, "inputs", None) or [getattr(each, "source", None)] for each in statements(procedure.body)]
    read = {place.table for places in sources for place in places if place is not None}
    name = next(name for name in env if name in read and name != "w")
    compile_loops(vjp(vjp(definition, name), name), effort=0)


def _signature(names: list[str]) -> Any:
    return inspect.Signature([inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in names])


# Single functions.


@kernel(a=MATRIX, b=array(SCALAR, "m", "k"))
def matrix_product(a: Any, b: Any) -> Any:
    """The product of two matrices."""
    return each(lambda row: each(lambda c: total(lambda x, y: x * y, row, c), transpose(b)), a)


def test_rows_and_columns_are_read_in_place() -> None:
    compiled = compile_loops(matrix_product, effort=0)
    assert not compiled.procedure.of(Storage.WORK) or all(not t.lengths for t in compiled.procedure.of(Storage.WORK))
    a, b = integers(1, 3, 4), integers(2, 4, 5)
    assert np.array_equal(run_exactly(compiled.procedure, {"a": a, "b": b})[0], a @ b)
    assert compiled.procedure.signature == "(n,m),(m,k)->(n,k)"


def test_searches() -> None:
    @kernel(x=N, bound=SCALAR)
    def searches(x: Any, bound: Any) -> Any:
        is_above: Callable[[Any], Any] = lambda v: v > bound  # noqa: E731
        return first_row(is_above, x), any_row(is_above, x), all_rows(is_above, x), count_rows(is_above, x)

    compiled = compile_loops(searches, effort=0)
    for values, bound in [([1, 5, 2, 7], 4), ([1, 2], 4), ([], 4), ([5, 6], 4), ([0], 0)]:
        above = [value > bound for value in values]
        wanted = [above.index(True) if any(above) else -1, any(above), all(above), sum(above)]
        assert [int(found) for found in run_exactly(compiled.procedure, {"x": values, "bound": bound})] == wanted
    assert "until" in procedure_text(compiled.procedure)


@cache
def smallest_three() -> Procedure:
    @kernel(x=N, returns=(array(SCALAR, 3), array(SCALAR, 3)))
    def smallest(x: Any) -> Any:
        return least(lambda v: v, x, count=3)

    return compile_loops(smallest, effort=0).procedure


@all_cases("values", [[], [4], [2, 2, 1, 2, 0], [3, 1, 2], [1, 2, 3, 4, 5]])
def test_the_rows_with_the_smallest_scores(values: list[int]) -> None:
    order = sorted(range(len(values)), key=lambda k: (values[k], k))[:3]
    missing = 3 - len(order)
    scores, rows = run_exactly(smallest_three(), {"x": values})
    assert scores.tolist() == [values[k] for k in order] + [0] * missing
    assert rows.tolist() == order + [-1] * missing


def test_a_fold_that_ends_early_reads_no_further_rows() -> None:
    @kernel(x=N)
    def some(x: Any) -> Any:
        return fold(lambda s, v: s + sqrt(v), 0, x, until=lambda s: s > 2)

    run = gacompiler.compile(some)
    assert run(np.array([1.0, 4.0, np.nan, np.nan])) == 3 and run(np.array([1.0])) == 1 and run(np.empty(0)) == 0


@pytest.mark.parametrize("backend", ["c", "numba", "arrays"])
def test_rows_within_bounds(backend: str) -> None:
    @kernel(x=N, first=M, end=M)
    def groups(x: Any, first: Any, end: Any) -> Any:
        def one(a: Any, b: Any) -> Any:
            forth = fold(lambda c, v: 10 * c + v, 0, x, within=(a, b))
            back = fold(lambda c, v: 10 * c + v, 0, x, within=(a, b), reverse=True)
            return forth, back, total(lambda v: v * v, x, within=(a, b))

        return each(one, first, end)

    def row(bound: float) -> int:
        return int(min(max(bound, 0), 6)) if bound == bound else 0

    x = np.array([np.nan, 1, 2, 3, 4, -1])
    bounds = [(1, 5), (2, 2), (3, 2), (1.9, 4.9), (1, np.nan), (4, 4.5), (5, -np.inf), (9, 1e300), (2, 5)]
    run = gacompiler.compile(groups, backend=backend)
    rows = [[int(v) for v in x[row(a) : row(b)]] for a, b in bounds]
    forth, back, squares = run(x, *np.array(bounds).T)
    assert forth.tolist() == [reduce(lambda c, v: 10 * c + v, each, 0) for each in rows]
    assert back.tolist() == [reduce(lambda c, v: 10 * c + v, each[::-1], 0) for each in rows]
    assert squares.tolist() == [sum(v * v for v in each) for each in rows]
    assert run(np.array([7.0]), [np.nan, -3], [1.5, 8])[0].tolist() == [7, 7] and run(np.empty(0), [0], [3])[0] == 0


def test_errors_of_bounds() -> None:
    def compiled(within: Any) -> None:
        @kernel(x=N)
        def some(x: Any) -> Any:
            return total(lambda v: v, x, within=within)

        compile_loops(some)

    for within in (3, (1,), (1, 2, 3), (0, CGA3.multivector({"e1": 1}))):
        with pytest.raises(KernelError, match=r"within=.*; expected the numbers of the first row and"):
            compiled(within)


@kernel(a=MATRIX, k=SCALAR)
def row_and_column(a: Any, k: Any) -> Any:
    return pick(a, k, -1), pick(transpose(a), k, k)


@all_cases("number", [0, 2, 2.75, 3, -0.25, -1, np.nan, np.inf, 1e300])
@all_cases("backend", ["c", "arrays"])
def test_rows_with_a_computed_number(number: float, backend: str) -> None:
    a = np.arange(12.0).reshape(3, 4)
    run = gacompiler.compile(row_and_column, backend=backend)
    row, column = run(a, number)
    assert np.array_equal(row, a[int(number)] if 0 <= number < 3 else np.full(4, -1.0))
    assert np.array_equal(column, a[:, int(number)] if 0 <= number < 4 else np.full(3, number), equal_nan=True)
    batch = run(np.stack([a, a]), np.array([1.0, number]))
    assert np.array_equal(batch[0], [a[1], row]) and np.array_equal(batch[1], [a[:, 1], column], equal_nan=True)


def test_numbers_of_rows_select_rows_without_a_check() -> None:
    @kernel(a=array(SCALAR, "n", "n"))
    def diagonal(a: Any) -> Any:
        return each(lambda row, k: pick(row, k, 0), a, row_numbers(a))

    compiled = compile_loops(diagonal)
    a = integers(3, 4, 4)
    assert np.array_equal(run_exactly(compiled.procedure, {"a": a})[0], a.diagonal())
    assert not compiled.procedure.repeats  # A batch is computed in lanes.


@kernel(x=N, bound=SCALAR)
def root(x: Any, bound: Any) -> Any:
    s = total(lambda v: v, x)
    return iterate(lambda r: (r + s / r) / 2, 1, lambda old, new: equal(old, new), bound)


@all_cases("bound", [0, 1, 3, 50, -2, 2.5, np.nan])
def test_the_bound_of_an_iteration_may_be_computed(bound: float) -> None:
    value, steps, found = 1.0, 0, False
    while steps < bound and not found:
        following = (value + 2 / value) / 2
        value, steps, found = following, steps + 1, following == value
    assert gacompiler.compile(root)(np.array([2.0]), bound) == (value, found, steps)


@pytest.mark.parametrize(("n", "m"), [(1, 1), (5, 2), (12, 6)])
@pytest.mark.slow
def test_a_kalman_filter_of_any_size(n: int, m: int) -> None:
    rng = np.random.default_rng(n)
    half, noise, h, x, z = (rng.normal(size=shape) for shape in [(n, n), (m, m), (m, n), (n,), (m,)])
    p, r = half @ half.T + np.eye(n), noise @ noise.T + np.eye(m)
    gain = p @ h.T @ np.linalg.inv(h @ p @ h.T + r)
    mean, covariance = gacompiler.compile(kalman, "arrays", effort=0)(x, p, h, r, z)
    assert np.allclose(mean, x + gain @ (z - h @ x), rtol=1e-10, atol=1e-12)
    assert np.allclose(covariance, (np.eye(n) - gain @ h) @ p, rtol=1e-10, atol=1e-10)


@pytest.mark.slow
def test_arrays_that_are_iterated() -> None:
    @kernel(a=array(SCALAR, "n", "n"), x=N)
    def dominant(a: Any, x: Any) -> Any:
        def step(v: Any) -> Any:
            moved = each(lambda row: total(lambda p, q: p * q, row, v), a)
            size = sqrt(total(lambda p: p * p, moved))
            return each(lambda p: p / size, moved)

        return iterate(step, x, lambda old, new: total(lambda p, q: (p - q) * (p - q), old, new) < 1e-28, 200)

    b = np.random.default_rng(5).normal(size=(6, 6))
    a = b @ b.T
    found, converged, _ = gacompiler.compile(dominant, effort=0)(a, np.ones(6))
    wanted = np.linalg.eigh(a)[1][:, -1]
    assert converged and np.abs(found * np.sign(found[0]) - wanted * np.sign(wanted[0])).max() < 1e-12


def test_arrays_that_are_exchanged_or_shared_by_a_step() -> None:
    @kernel(x=N, y=N)
    def exchanged(x: Any, y: Any) -> Any:
        def step(carry: Any) -> Any:
            a, b, _, _ = carry
            sums = each(lambda p, q: p + q, a, b)
            return b, sums, sums, a

        carry, converged, steps = iterate(step, (x, y, x, x), lambda _, new: total(lambda p: p, new[2]) > 300, 20)
        return *carry, converged, steps

    x, y = integers(1, 4) + 5, integers(2, 4) + 5
    wanted, steps = (x, y, x, x), 0
    while wanted[2].sum() <= 300 or not steps:
        a, b, _, _ = wanted
        wanted, steps = (b, a + b, a + b, a), steps + 1
    *found, converged, n_steps = exact(exchanged, x=x, y=y)
    assert converged and n_steps == steps > 2
    for one, other in zip(found, wanted, strict=True):
        assert np.array_equal(one, other)
