"""Kernels with loops for all tests of loops, a spec as well: examples of every statement, and kernels hard to print.

Those in `HARD` have tables that share places, names that languages reserve, and loops in loops; proofs check them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from gacompiler import (
    SCALAR,
    absolute,
    accumulate,
    array,
    coefficient,
    cos,
    count_rows,
    each,
    equal,
    first_row,
    floor,
    fold,
    gather,
    index,
    iterate,
    kernel,
    least,
    pick,
    random_integer,
    row_numbers,
    scan,
    scatter,
    select,
    sin,
    sqrt,
    total,
    transpose,
    uniform,
    vjp,
    window,
)
from gacompiler.algebra.catalog import CGA3, PGA3
from gacompiler.backends.module import LoopSource, ModuleSource
from gacompiler.backends.python_loops import index_rules
from gacompiler.frontend.expression import lift
from gacompiler.frontend.kernel import Kernel
from gacompiler.gac_runtime.layout import Layout
from gacompiler.ir.procedure import Procedure, Storage, Table
from gacompiler.ir.run_procedure import run_procedure
from gacompiler.passes.loops import compile_loops

N = array(SCALAR, "n")
M = array(SCALAR, "m")
E032 = PGA3.multivector({"e032": 1})


class State(NamedTuple):
    position: object
    speed: object


# Every kind of statement.


@kernel(q=array(SCALAR, "n"), axes=array(PGA3.LINE, "n", shared=True), tool=PGA3.MOTOR)
def forward(q, axes, tool):
    """Pose of the end effector by the product of exponentials."""
    return fold(lambda m, angle, axis: m * (cos(angle / 2) - sin(angle / 2) * axis), 1, q, axes) * tool


@kernel(x=array(SCALAR, "n"))
def squares(x):
    """The sum of squares."""
    return total(lambda v: v * v, x)


@kernel(x=array(SCALAR, "n"), parents=index("n"), scale=SCALAR)
def tree(x, parents, scale):
    """Sums from the root to the leaves of a tree, and sums of these from the leaves to the root."""
    up = scan(lambda s, v: s + v * (scale * scale + 1), 0, x, parents=parents)
    return up, accumulate(lambda c, v: c + v, 0, up, parents=parents)


@kernel(moves=array(PGA3.MOTOR, "n"), points=array(PGA3.POINT, "n"))
def chain(moves, points):
    """The cumulative products of motors; the last product moves points."""
    poses = scan(lambda m, move: m * move, 1, moves)
    return poses, each(lambda m, p: m * p * ~m, poses, points)


@kernel(x=array(SCALAR, "n"), scale=SCALAR)
def behind(x, scale):
    """Running sums from the last row to the first, and sums of the rows behind each."""
    suffix = scan(lambda s, v: s + v * scale, scale, x, reverse=True)
    return suffix, accumulate(lambda c, v: c / 2 + v, 0, x), total(lambda v: v, x)


@kernel(points=array(PGA3.POINT, "n"), n=SCALAR)
def suffixes(points, n):
    """Weighted sums from each point to the last, and a polynomial of them."""
    sums = scan(lambda s, p: s * 2 + p, 0, points, reverse=True)
    return sums, fold(lambda s, p: s * n + p, 0, points, reverse=True)


@kernel(x=array(SCALAR, "n"), y=array(SCALAR, "n", 3), parents=index("n"))
def kept(x, y, parents):
    """Sums towards the root, and the other results of the body."""
    return accumulate(
        lambda c, a, b: ((c[0] + a * b[0], c[1] + b[1]), (a * c[1], b[2])), (0, 0), x, y, parents=parents, keep=True
    )[1]


@kernel(x=array(SCALAR, "n"))
def backwards(x):
    """Sums from the last to the first, without a tree."""
    return accumulate(lambda c, v: c * v + v, 0, x)


@kernel(x=array(SCALAR, "n"), which=index("n", into="m"), y=array(SCALAR, "m"))
def picked(x, which, y):
    """Products gathered and scattered through one table, and the least number with its place."""
    products = each(lambda a, b: a * b, x, gather(y, which))
    lowest, place = least(lambda a: a * a, x)
    return scatter(products, which, y), lowest, place


@kernel(value=array(SCALAR, "n", 3), rows=index("n", into="m"), columns=index("n", into="k"),
        a=array(SCALAR, "m"), b=array(SCALAR, "k"), returns=array(SCALAR, "m", "k", 2))  # fmt: skip
def dense(value, rows, columns, a, b):
    """A matrix stored by rows, from its entries."""
    scaled = each(lambda v: (v[0] * 2, v[1] + v[2]), value)
    return scatter(scaled, (rows, columns), (a, b))


@kernel(
    values=array(SCALAR, "k"), rows=index("k", into="n"), columns=index("k", into="m"),
    x=array(SCALAR, "n"), y=array(SCALAR, "m")
)  # fmt: skip
def matrix(values, rows, columns, x, y):
    """A matrix from its entries, of which some are left out."""
    return scatter(each(lambda v, a: v * a, values, gather(x, rows)), (rows, columns), (x, y))


@kernel(a=array(SCALAR, "n"), weights=array(PGA3.DIRECTION, "m", shared=True), which=index("m", into="n"), start=SCALAR)
def shares(a, weights, which, start):
    """Sums of a table shared by all elements, and a product with it."""
    sums = scatter(weights, which, a)
    return each(lambda p, v: p * v, sums, a), total(lambda p: start * p, weights)


@kernel(h=array(SCALAR, "n", 2, 3), v=array(SCALAR, "n", 3), returns=array(SCALAR, "n", 2))
def rows_of_matrices(h, v):
    """Each matrix times its vector."""
    products = each(
        lambda h, v: tuple(sum((a * b for a, b in zip(row, v, strict=True)), start=lift(0)) for row in h), h, v
    )
    return products


@kernel(x=array(SCALAR, "n"), a=SCALAR)
def newton(x, a):
    """A root, times a sum, and whether it was found."""
    s = total(lambda v: v, x)
    root, found, steps = iterate(
        lambda r: (r + a / r) / 2, 1, lambda old, new: absolute(new - old) < 1e-9 * absolute(new), 6
    )
    return root * s, found, steps


@kernel(x=array(SCALAR, "n"), a=SCALAR)
def scan_in_iteration(x, a):
    """Loops in an iteration."""

    def step(r):
        return (r + total(lambda v: sqrt(v * v + r * r), scan(lambda c, v: c + v, r, x))) * a

    return iterate(step, 1, lambda old, new: absolute(new - old) < 1e-3, 4)


@kernel(m=array(SCALAR, "n", 2, 2), start=array(SCALAR, 2, 2), parents=index("n"),
        returns=array(SCALAR, "n", 2, 2))  # fmt: skip
def matrix_products(m, start, parents):
    """Products of matrices along a tree."""

    def product(a, b):
        return tuple(tuple(sum(a[i][k] * b[k][j] for k in range(2)) for j in range(2)) for i in range(2))

    return scan(product, start, m, parents=parents)


@kernel(a=array(SCALAR, "n", "m"), b=array(SCALAR, "m", "k"), which=index("n", into="n"))
def products(a, b, which):
    """The product of two matrices, with its rows in another order, and the sum of its rows."""

    def row_by_columns(row):
        return each(lambda column: total(lambda x, y: x * y, row, column), transpose(b))

    found = each(row_by_columns, gather(a, which))
    return found, transpose(found), total(lambda row: row, found)


@kernel(a=array(SCALAR, "n", "m"), x=array(SCALAR, "m"))
def recurrence(a, x):
    """Two arrays that are passed from row to row in exchanged places, and all the arrays that are passed."""

    def step(carry, row):
        first, second = carry
        return second, each(lambda p, q: p * q + 1, first, row)

    return *fold(step, (x, x), a), scan(lambda v, row: each(lambda p, q: (p + 1) * q, v, row), x, a)


@kernel(a=array(PGA3.POINT, "n", "m"), moves=array(PGA3.MOTOR, "n"), x=array(SCALAR, "m"))
def moved_rows(a, moves, x):
    """Points moved by the motor of their row, and an iteration over an array."""
    rows = each(lambda move, points: each(lambda p: move * p * ~move, points), moves, a)

    def halved(values):
        return each(lambda v: v / 2, values)

    small = iterate(halved, x, lambda old, new: total(lambda v: v, new) < 1, 3)
    return rows, *small


@kernel(x=array(SCALAR, "n"), bound=SCALAR)
def searched(x, bound):
    """The first row above a bound, how many there are, and a sum that ends early."""
    some = fold(lambda s, v: s + v * bound, 0, x, until=lambda s: s > 2)
    return first_row(lambda v: v > bound, x), count_rows(lambda v: v > bound, x), some


@kernel(x=array(SCALAR, "n"), returns=(array(SCALAR, 2), array(SCALAR, 2)))
def smallest_two(x):
    """The two smallest rows."""
    return least(lambda v: v * v, x, count=2)


@kernel(points=array(PGA3.DIRECTION, "n"), a=array(SCALAR, "m", "k"), at=SCALAR)
def chosen(points, a, at):
    """The row with the smallest coordinate, and a row and a column of a matrix."""
    _, row = least(lambda p: coefficient(p, "e032"), points)
    return pick(points, row + at / 8, lift(0) * E032), pick(a, at * 2, -1), pick(transpose(a), at * 4 - 2, at)


@kernel(x=array(SCALAR, "n"), at=SCALAR)
def bounded(x, at):
    """An iteration whose bound is computed."""
    s = total(lambda v: v, x)
    return iterate(lambda r: (r + s / r) / 2, 1, lambda old, new: new < 0, at * 4)


@kernel(a=array(SCALAR, "n", "n"), b=array(SCALAR, "n"))
def solved(a, b):
    """The solution of linear equations by elimination without pivots."""
    numbers = row_numbers(b)

    def step(carry, k):
        matrix, right = carry
        pivots, own = pick(matrix, k, 0), pick(right, k, 0)
        pivot = pick(pivots, k, 0)

        def eliminated(row, i, value):
            factor = select(equal(i, k), 0, pick(row, k, 0) / pivot)
            return each(lambda x, y: x - factor * y, row, pivots), value - factor * own

        return each(eliminated, matrix, numbers, right)

    diagonal = each(lambda row, i: each(lambda x, j: select(equal(i, j), x + 9, x), row, numbers), a, numbers)
    matrix, right = fold(step, (diagonal, b), numbers)
    return each(lambda row, k, value: value / pick(row, k, 0), matrix, numbers, right)


@kernel(moves=array(PGA3.DIRECTION, "m", shared=True), samples=index("n", 3, into="m"), x=array(SCALAR, "m"))
def triples(moves, samples, x):
    """Sums of triples of directions, and sums of numbers over the first and last of each triple."""
    firsts = each(lambda a: a + 1, gather(x, samples[0]))
    return each(lambda a, b, c: a + 2 * b + c / 2, *gather(moves, samples)), scatter(firsts, samples[2], x)


@kernel(image=array(SCALAR, "n", "m"), rows=array(SCALAR, "k"), columns=array(SCALAR, "k"))
def warped(image, rows, columns):
    """Linear interpolation along columns of an image, at places inside and outside of it."""

    def value(row, column):
        i, j = floor(4 * row - 2), floor(5 * column) - 3
        upper = pick(pick(image, i, 0), j, 0)
        return upper + (4 * row - 2 - i) * (pick(pick(image, i + 1, 0), j, 0) - upper)

    return each(value, rows, columns)


@kernel(x=N, y=M)
def ragged(x, y):
    """Values of some of the rows, from the first or from the last, and one that ends early."""

    def some(a):
        forth = fold(lambda c, v: c * v + a, 1, x, within=(4 * a - 2, 6 * a - 1))
        back = fold(lambda c, v: c * v + a, 1, x, within=(0, 3 * a), reverse=True)
        early = fold(lambda c, v: c + v * v * a, 0, x, until=lambda c: c > 1, within=(a, 9))
        return forth, back, early + total(lambda v: v * v, x, within=(2 * a, 4))

    return each(some, y)


ragged_gradient = vjp(ragged, "x")
"""The transpose of loops with bounds, of which one ends early."""
warped_gradient = vjp(warped, "image")
"""Rows with computed numbers are added to."""


@kernel(points=array(SCALAR, "n", 2), trials=array(SCALAR, "k"), seed=SCALAR)
def sampled(points, trials, seed):
    """Random rows, and random numbers, which differ in single precision."""
    count = count_rows(lambda p: 1, points)

    def pair(trial, number):
        x, _ = pick(points, random_integer(seed * 2**20, number, count), (-1, -1))
        return x, uniform(seed * 2**40, trial * 2**20)

    return each(pair, trials, row_numbers(trials))


@kernel(image=array(SCALAR, "n", "m"))
def blurred(image):
    """Windows with three boundaries, one of them over the result of another."""
    rows = each(lambda row: each(lambda a, b, c: a + 2 * b + c, *row[0]), window(transpose(image), 1, (-4, 0, 1)))
    return each(
        lambda row: each(lambda w: w[0][0] - w[1][2] * w[2][1] / 2, row), window(image, 3, 3, boundary="mirror")
    ), each(lambda row: each(lambda a, b: a * b, *row), window(rows, 2, boundary="wrap"))


@kernel(signal=array(SCALAR, "n"), points=array(PGA3.DIRECTION, "n"))
def differences(signal, points):
    """Windows over single axes, of numbers and multivectors, with a constant outside and with the nearest row."""
    outside = each(lambda a, b: a + b / 2, *window(points, (-2, 3), boundary="constant", value=3 * E032))
    return outside, scan(lambda s, w: s + w[0] * w[2] - w[1], 0, window(signal, 3, boundary="nearest"))


@kernel(image=array(SCALAR, "n", "m"), rows=array(SCALAR, "k"), columns=array(SCALAR, "m"))
def halved(image, rows, columns):
    """Every second pixel of an image, with sums of neighbours, and every third row with a frame of ones."""

    def pixel(w):
        return sum((sum(row, start=lift(0)) for row in w), start=lift(0))

    small = window(image, 3, 3, stride=2, onto=(rows, columns))
    framed = window(image, (-1, 2), 2, boundary="constant", value=1, stride=(3, 1), onto=(rows, columns))
    return each(lambda row: each(pixel, row), small), each(lambda row: each(pixel, row), framed)


# Hard to print.


@kernel(m=array(PGA3.MOTOR, "n"), p=PGA3.POINT)
def motors(m, p):
    """Checked by its proof."""
    c = scan(lambda c, a: c * a, 1, m)
    return each(lambda c: c * p * ~c, c), c


@kernel(x=array(PGA3.POINT, "n"), i=index("n", into="m"), y=M)
def points_sum(x, i, y):
    """Checked by its proof."""
    return scatter(x, i, y), total(lambda a: a, x)


@kernel(x=array(PGA3.MOTOR, "n"), i=index("n", into="m"), j=index("n", into="k"), y=M, z=array(SCALAR, "k"))
def matrices(x, i, j, y, z):
    """Checked by its proof."""
    return scatter((x, each(lambda a: a * 2, x)), (i, j), (y, z))


@kernel(p=array(CGA3.POINT, "n"), m=array(CGA3.MOTOR, "n"))
def conformal(p, m):
    """Checked by its proof."""
    return (
        each(lambda p, m: m * p * ~m, p, m),
        fold(lambda s, p, m: m * p * ~m, CGA3.multivector({"e0": 1}), p, m),
        scan(lambda c, m: c * m, 1, m),
    )


@kernel(x=N)
def nested_iteration(x):
    """Checked by its proof."""

    def row(a):
        r, _, n = iterate(lambda r: (r + (a * a + 1) / r) / 2, 1, lambda o, n: absolute(o - n) < 1e-9, 20)
        return r, n

    return each(row, x)


@kernel(x=N)
def loop_in_iteration(x):
    """Checked by its proof."""
    s = total(lambda a: a * a, x)

    def step(r):
        d = total(lambda a: a * r, x)
        return (r[0] if isinstance(r, tuple) else r) - d / (1 + s) * 0.5

    return iterate(step, 1, lambda a, b: absolute(a - b) < 1e-3, 30)[0]


@kernel(x=N, w=index("n"))
def forward_and_backward(x, w):
    """Checked by its proof."""
    up = scan(lambda s, a: s * 2 + a, 1, x, parents=w)
    v, k = accumulate(lambda c, a: (c + a, (a * c)), 0, up, parents=w, keep=True)
    return v, k, up


@kernel(x=N, w=index("n"))
def gathered(x, w):
    """Checked by its proof."""
    return gather(x, w), gather(each(lambda a: a * a, gather(x, w)), w), scatter(gather(x, w), w, x)


@kernel(x=N)
def reversed_(x):
    """Checked by its proof."""
    return (
        accumulate(lambda s, a: s * 2 + a, 0, x),
        scan(lambda s, a: s * 2 + a, 0, x, reverse=True),
        fold(lambda s, a: s * 2 + a, 0, x, reverse=True),
    )


@kernel(x=N, a=SCALAR)
def copies(x, a):
    """Checked by its proof."""
    s = fold(lambda s, b: s + b, a, x)
    r = each(lambda b: b + 1, x)
    return s, s, a, x, r, r


@kernel(x=array(PGA3.MOTOR, "n"), a=PGA3.MOTOR)
def copies_of_motors(x, a):
    """Checked by its proof."""
    s = fold(lambda s, b: s * b, a, x)
    t = fold(lambda s, b: b, a, x)
    u = fold(lambda s, b: (s[1], b), (a, a), x)
    return s, s, a, x, t, u[0], u[1]


@kernel(x=array(PGA3.POINT, "n", 3), returns=array(PGA3.POINT, "n", 2))
def pairs(x):
    """Checked by its proof."""
    return (each(lambda p: p[0], x), each(lambda p: p[1], x))


@kernel(i=N, out=N, work=SCALAR, q=SCALAR)
def names(i, out, work, q):
    """Checked by its proof."""
    return (
        each(lambda n, j: n * j + work, i, out),
        total(lambda out_0: out_0 * q, i),
        fold(lambda double, int: double + int, 0, i),
        fold(lambda range, t: range * t, 1, i),
    )


@kernel(x=N)
def smallest(x):
    """Checked by its proof."""
    return least(lambda a: a * a, x)


@kernel(x=N, y=M)
def nested(x, y):
    """Checked by its proof."""

    def body(a):
        z = each(lambda b: a * b + 1, y)
        return total(lambda b: b * b, z) * a, fold(lambda s, b: s * sin(a) + b, 1, z)

    return each(body, x)


@kernel(x=N, y=M)
def captured(x, y):
    """Checked by its proof."""
    return each(lambda v: total(lambda w: w * sin(v) + v, y), x), fold(
        lambda s, a: State(s.position + s.speed, s.speed + a), State(0, 1), x
    )[1]


@kernel(x=N)
def unchanged(x):
    """Checked by its proof."""
    return fold(lambda s, a: (s[0], s[1] + a), (5, 1), x)


@kernel(x=N)
def no_effect(x):
    """Checked by its proof."""
    return fold(lambda s, a: s, 5, x)


@kernel(x=array(SCALAR, "n", shared=True), y=N)
def shared(x, y):
    """Checked by its proof."""
    return each(lambda a, b: a * b, x, y), total(lambda a: a * a, x)


@kernel(x=array(SCALAR, "n", shared=True))
def only_shared(x):
    """Checked by its proof."""
    return each(lambda a: a * a, x)


@kernel(x=N, y=M)
def aliasing(x, y):
    """A row that is carried to the next iteration while its table changes."""
    line = PGA3.multivector({"e1": 1})
    return fold(lambda s, a: fold(lambda t, b: b, s, each(lambda b: (b * a) * line + s, y)), line, x)


@kernel(
    m=array(SCALAR, "n", 2, 2),
    parents=index("n"),
    a=SCALAR,
    returns=(array(SCALAR, "n", 2, 2), array(SCALAR, 2, 2), SCALAR),
)
def matrix_sums(m, parents, a):
    """Sums of matrices."""
    zero = ((0, 0), (0, 0))
    s = accumulate(
        lambda c, b: tuple(tuple(c[i][j] + a * b[i][j] for j in range(2)) for i in range(2)), zero, m, parents=parents
    )
    t, _, k = iterate(
        lambda r: tuple(tuple(r[i][j] / 2 + a for j in range(2)) for i in range(2)),
        ((1, 0), (0, 1)),
        lambda o, n: absolute(o[0][0] - n[0][0]) < 1e-3,
        9,
    )
    return s, t, k


EXAMPLES = (
    forward,
    squares,
    tree,
    chain,
    behind,
    suffixes,
    kept,
    backwards,
    picked,
    dense,
    matrix,
    shares,
    rows_of_matrices,
    newton,
    scan_in_iteration,
    matrix_products,
    products,
    recurrence,
    moved_rows,
    searched,
    smallest_two,
    chosen,
    bounded,
    solved,
    blurred,
    differences,
    halved,
    triples,
    warped,
    ragged,
    ragged_gradient,
    warped_gradient,
)
NAMES = tuple(definition.name for definition in EXAMPLES)
HARD = (
    motors,
    points_sum,
    matrices,
    conformal,
    nested_iteration,
    loop_in_iteration,
    forward_and_backward,
    gathered,
    reversed_,
    copies,
    copies_of_motors,
    pairs,
    names,
    smallest,
    nested,
    captured,
    unchanged,
    no_effect,
    shared,
    only_shared,
    aliasing,
    matrix_sums,
    sampled,
)


# The compiled examples and their interpretation.


@cache
def loop_source(definition: Kernel) -> LoopSource:
    """A kernel with loops in the form that modules store, with facts for readers; no cheaper forms are searched."""
    compiled = compile_loops(definition, effort=0)
    layouts = []
    for parameter in definition.parameters:
        layout = getattr(parameter.type, "layout", parameter.type if hasattr(parameter.type, "stored") else None)
        if layout is not None and not layout.is_scalar:
            layouts.append((parameter.name, Layout(str(layout), tuple(s.name for s in layout.stored))))
    return LoopSource(
        compiled.procedure, definition.summary, tuple(layouts), compiled.costs, ("a = a",), "1 ulp, 64 inputs"
    )


@cache
def sources() -> dict[str, LoopSource]:
    """The examples compiled, by name."""
    return {definition.name: loop_source(definition) for definition in EXAMPLES}


def loop_module(name: str, *definitions: Kernel) -> ModuleSource:
    """A module of kernels with loops."""
    return ModuleSource(
        name, "Examples.", f"gac generate {name}.py", "0" * 64, (), tuple(map(loop_source, definitions))
    )


def shape_of(table: Table, lengths: Mapping[str, int]) -> tuple[int, ...]:
    """The shape of a table of one element."""
    return (*(lengths[name] for name in table.lengths), *table.shape)


def arguments(
    procedure: Procedure,
    lengths: Mapping[str, int],
    rng: np.random.Generator | int,
    leading: tuple[int, ...] = (),
    dtype: Any = float,
) -> dict[str, Any]:
    """Random arguments of a procedure, from a generator or a seed; shared ones have no leading axes."""
    rng, rules = np.random.default_rng(rng), index_rules(procedure)
    found: dict[str, Any] = {}
    for table in procedure.parameters:
        if table.storage is Storage.INDEX:
            (length,) = table.lengths
            rule = rules[table.name]
            lowest = -1 if "-1" in rule else 0
            last = [k if "earlier" in rule else lengths[table.into] for k in range(lengths[length])]
            shape = shape_of(table, lengths)
            values = [rng.integers(lowest, end) for end in last for _ in range(table.size)]
            found[table.name] = np.array(values, np.int64).reshape(shape)
        else:
            axes = () if table.shared else leading
            found[table.name] = np.asarray(rng.uniform(0.5, 1.5, axes + shape_of(table, lengths)), dtype)
    return found


def interpreted(
    procedure: Procedure,
    lengths: Mapping[str, int],
    given: Mapping[str, Any],
    number: Callable[[Any], Any] = float,
) -> list[np.ndarray[Any, Any]]:
    """Interpret a procedure for one element, with every operation rounded once."""
    rows: dict[str, Sequence[Sequence[Any]]] = {}
    for table in procedure.parameters:
        kind = int if table.storage is Storage.INDEX else number
        count = math.prod(lengths[name] for name in table.lengths)
        rows[table.name] = [[kind(x) for x in row] for row in np.reshape(given[table.name], (count, table.size))]
    found = run_procedure(procedure, lengths, rows, lambda value: number(float(value)))
    return [
        np.array(found[table.name], np.dtype(number)).reshape(shape_of(table, lengths)) for table in procedure.results
    ]


def element(procedure: Procedure, lengths: Mapping[str, int], given: Mapping[str, Any], k: int) -> dict[str, Any]:
    """Select the arguments of one element of a batch."""
    tables = {table.name: table for table in procedure.parameters}
    return {
        name: array[k] if array.ndim > len(shape_of(tables[name], lengths)) else array for name, array in given.items()
    }
