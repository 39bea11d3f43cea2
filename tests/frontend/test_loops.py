"""Kernels with loops: the results of each loop function, against closed forms, and its errors."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from itertools import combinations
from random import Random
from typing import Any, NamedTuple

import numpy as np

import gacompiler
from gacompiler import SCALAR, array, cos, index, kernel, sandwich, sin
from gacompiler.algebra.catalog import CGA2, PGA3
from gacompiler.frontend.loops import accumulate, each, fold, gather, iterate, scan, scatter, total
from gacompiler.frontend.operations import absolute
from gacompiler.frontend.searches import least, pick
from gacompiler.ir.procedure_cost import costs_text
from gacompiler.ir.procedure_text import procedure_text
from gacompiler.ir.run_procedure import run_procedure
from gacompiler.passes.inference import traced_loops
from gacompiler.passes.loop_samples import few_rows, index_tables
from gacompiler.passes.loops import LoopCompilation, compile_loops
from tests.support.all_cases import all_cases

N = array(SCALAR, "n")
M = array(SCALAR, "m")


def loops(**parameters: Any) -> Callable[[Callable[..., Any]], LoopCompilation]:
    """Declare and compile a kernel with loops; compiling proves it."""
    return lambda function: compile_loops(kernel(**parameters)(function))


def results(compiled: LoopCompilation, **arguments: Any) -> list[Any]:
    """Run a procedure on lists of numbers; return a list of rows for arrays, otherwise a number or a list."""
    procedure, lengths, rows = compiled.procedure, dict[str, int](), dict[str, list[list[Any]]]()
    for table in procedure.parameters:
        given = arguments[table.name]
        if table.lengths:
            lengths[table.lengths[0]] = len(given)
            rows[table.name] = [list(row) if table.shape else [row] for row in given]
        else:
            rows[table.name] = [list(given) if table.shape else [given]]
    found = run_procedure(procedure, lengths, rows)
    values = []
    for table in procedure.results:
        flat = [row if table.shape else row[0] for row in found[table.name]]
        values.append(flat if table.lengths else flat[0])
    return values


# Results of the loop functions.


def test_fold() -> None:
    @loops(x=N)
    def polynomial(x: Any) -> Any:
        return fold(lambda s, a: 2 * s + a, 3, x), fold(lambda s, a: 2 * s + a, 3, x, reverse=True)

    assert results(polynomial, x=[5, 7]) == [3 * 4 + 5 * 2 + 7, 3 * 4 + 7 * 2 + 5]
    assert results(polynomial, x=[]) == [3, 3]


def test_scan() -> None:
    @loops(x=N)
    def sums(x: Any) -> Any:
        return scan(lambda s, a: s + a, 1, x), scan(lambda s, a: s + a, 1, x, reverse=True)

    assert results(sums, x=[1, 2, 3]) == [[2, 4, 7], [7, 6, 4]]


def test_scan_along_a_tree() -> None:
    @loops(x=N, parents=index("n"))
    def depths(x: Any, parents: Any) -> Any:
        return scan(lambda s, a: s + a, 100, x, parents=parents)

    assert results(depths, x=[1, 2, 3, 4], parents=[-1, 0, 0, 2]) == [[101, 103, 104, 108]]


def test_each_and_total() -> None:
    @loops(x=N, y=N)
    def products(x: Any, y: Any) -> Any:
        return each(lambda a, b: (a * b, a - b), x, y)[1], total(lambda a, b: (a * b, a), x, y)[0]

    assert results(products, x=[1, 2, 3], y=[4, 5, 6]) == [[-3, -3, -3], 32]


def test_accumulate() -> None:
    @loops(x=N, parents=index("n"))
    def weights(x: Any, parents: Any) -> Any:
        along = accumulate(lambda behind, a: behind + a, 0, x)
        values, kept = accumulate(lambda children, a: (children + a, a * a), 0, x, parents=parents, keep=True)
        return along, values, kept

    x, parents = [1, 2, 3, 4], [-1, 0, 0, 2]
    assert results(weights, x=x, parents=parents) == [[10, 9, 7, 4], [10, 2, 7, 4], [1, 4, 9, 16]]


def test_gather_and_scatter() -> None:
    @loops(x=N, which=index("n", into="m"), y=M)
    def moved(x: Any, which: Any, y: Any) -> Any:
        return gather(y, which), scatter(x, which, y), each(lambda a, b: a * b, x, gather(y, which))

    found = results(moved, x=[1, 2, 3], which=[1, 1, 0], y=[10, 20])
    assert found == [[20, 20, 10], [3, 3], [20, 40, 30]]


def test_rows_without_an_index_are_left_out_of_sums() -> None:
    @loops(x=N, which=index("n", into="m"), y=M)
    def moved(x: Any, which: Any, y: Any) -> Any:
        return scatter(x, which, y)

    assert results(moved, x=[1, 2, 3], which=[-1, 1, -1], y=[10, 20]) == [[0, 2]]


def test_scatter_to_a_matrix() -> None:
    @loops(x=N, i=index("n", into="m"), j=index("n", into="k"), y=M, z=array(SCALAR, "k"))
    def matrix(x: Any, i: Any, j: Any, y: Any, z: Any) -> Any:
        return scatter(x, (i, j), (y, z))

    assert results(matrix, x=[1, 2, 3], i=[0, 1, 1], j=[2, 0, 0], y=[0, 0], z=[0, 0, 0]) == [[0, 0, 1, 5, 0, 0]]


def test_iterate() -> None:
    @loops(x=N, a=SCALAR)
    def root(x: Any, a: Any) -> Any:
        return iterate(lambda r: (r + a / r) / 2, total(lambda b: b, x), lambda old, new: absolute(new - old) < 0.1, 9)

    found, converged, steps = results(root, x=[Fraction(1), Fraction(1)], a=Fraction(2))
    assert (found, converged, steps) == (Fraction(17, 12), 1, 2)

    @loops(x=N)
    def endless(x: Any) -> Any:
        return iterate(lambda r: total(lambda b: b * r, x), 1, lambda old, new: 0, 3)

    assert results(endless, x=[2, 3]) == [125, 0, 3]


def test_least() -> None:
    @loops(x=N)
    def smallest(x: Any) -> Any:
        return least(lambda a: a * a, x)

    assert results(smallest, x=[3, -1, 1, 2]) == [1, 1]
    assert results(smallest, x=[]) == [0, -1]
    assert results(smallest, x=[7]) == [49, 0]


def test_loops_inside_of_bodies() -> None:
    @loops(x=N, y=M)
    def nested(x: Any, y: Any) -> Any:
        def row(a: Any) -> Any:
            products = each(lambda b: a * b, y)
            return total(lambda b: b * b, products), fold(lambda s, b: s * a + b, 1, y)

        return each(row, x)

    assert results(nested, x=[1, 2], y=[3, 4]) == [[25, 100], [1 + 3 + 4, (2 + 3) * 2 + 4]]


def test_loops_inside_of_iterations_see_the_carry() -> None:
    @loops(x=N)
    def nested(x: Any) -> Any:
        return fold(lambda s, a: s + fold(lambda t, b: t + s * b, a, x), 1, x)

    s = 1
    for a in (2, 3):
        s += a + s * 5
    assert results(nested, x=[2, 3]) == [s]


def test_kernels_are_functions_in_kernels_with_loops() -> None:
    @kernel(x=N)
    def squares(x: Any) -> Any:
        return total(lambda a: a * a, x)

    @kernel(a=SCALAR, b=SCALAR)
    def product(a: Any, b: Any) -> Any:
        return a * b + 1

    @loops(y=M)
    def outer(y: Any) -> Any:
        return squares(each(product, y, y)), squares(each(partial(product, 2), y))

    assert results(outer, y=[1, 2]) == [4 + 25, 9 + 25]


class Doubled:
    """A body with internal state."""

    def __call__(self, carry: Any, row: Any) -> Any:
        return 2 * carry + row


def test_bodies_of_every_kind() -> None:
    def with_rest(*arguments: Any) -> Any:
        return arguments[0] + arguments[1]

    @loops(x=N)
    def sums(x: Any) -> Any:
        return fold(Doubled(), 0, x), fold(with_rest, 0, x), fold(partial(with_rest), 0, x)

    assert results(sums, x=[1, 2, 3]) == [4 + 4 + 3, 6, 6]


class State(NamedTuple):
    position: Any
    speed: Any


def test_carries_keep_their_names() -> None:
    @loops(x=N)
    def moved(x: Any) -> Any:
        return fold(lambda s, a: State(s.position + s.speed, s.speed + a), State(0, 1), x)

    assert [table.name for table in moved.procedure.tables] == ["x", "position", "speed"]
    assert results(moved, x=[1, 2]) == [0 + 1 + 2, 4]


def test_values_that_are_swapped() -> None:
    @loops(x=N)
    def swapped(x: Any) -> Any:
        pair = fold(lambda s, a: (s[1], s[0]), (0, 1), x)
        mixed = fold(lambda s, a: (s[1], 0 * a), (3, 4), x)
        return (*pair, *mixed)

    assert results(swapped, x=[1, 2, 3]) == [1, 0, 0, 0]
    assert results(swapped, x=[]) == [0, 1, 3, 4]


@all_cases("start", [2, 0.5, Fraction(1, 3), np.float64(0.25), np.int64(3)])
def test_start_values_and_float_constants(start: Any) -> None:
    @loops(x=N)
    def scaled(x: Any) -> Any:
        return fold(lambda s, a: s * a * 0.1, start, x)

    exact = Fraction(str(start)) if isinstance(start, float) else Fraction(int(start) if start == int(start) else start)
    assert results(scaled, x=[2, 3]) == [exact * 6 / 100]


# Layouts and relations.


def test_the_product_of_unit_motors_is_one() -> None:
    @loops(m=array(PGA3.MOTOR, "n"))
    def product(m: Any) -> Any:
        return fold(lambda c, each: c * each, 1, m)

    ((_, record),) = product.trace.results
    assert record.leaf.layout == PGA3.MOTOR and record.leaf.layout.unit
    assert costs_text(product.costs) == "n * (48 mul, 40 add)"


def test_motions_by_unit_motors_are_cheap() -> None:
    """The sandwich uses that its motor is unit, as in a kernel without loops."""

    @loops(m=array(PGA3.MOTOR, "n"), p=PGA3.POINT)
    def moved(m: Any, p: Any) -> Any:
        return each(lambda c: c * p * ~c, scan(lambda c, each: c * each, 1, m))

    (name, record), *_ = moved.trace.results
    assert (name, record.leaf.layout) == ("out", PGA3.POINT)
    assert moved.costs[0][1].mul == 48 + 21


def test_sums_of_motors_are_not_motors() -> None:
    @loops(m=array(PGA3.MOTOR, "n"), which=index("n", into="k"), y=array(SCALAR, "k"))
    def sums(m: Any, which: Any, y: Any) -> Any:
        return total(lambda each: each, m), scatter(m, which, y)

    for _, record in sums.trace.results:
        assert not record.leaf.layout.has_relations and record.leaf.layout.size == 8


def test_sums_of_points_store_their_weight() -> None:
    @loops(p=array(PGA3.POINT, "n"), which=index("n", into="k"), y=array(SCALAR, "k"))
    def sums(p: Any, which: Any, y: Any) -> Any:
        return total(lambda each: each, p), scatter(p, which, y)

    assert [record.leaf.layout.size for _, record in sums.trace.results] == [4, 4]
    found = results(sums, p=[[1, 2, 3], [4, 5, 6]], which=[0, 0], y=[0])
    assert found[0] == found[1][0] and found[0][0] == 2


def test_conformal_points_keep_implied_coefficients() -> None:
    @loops(p=array(CGA2.POINT, "n"), m=array(CGA2.MOTOR, "n"))
    def moved(p: Any, m: Any) -> Any:
        last = fold(lambda s, point, motor: motor * point * ~motor, CGA2.multivector({"e0": 1}), p, m)
        return each(lambda point, motor: motor * point * ~motor, p, m), last, total(lambda point: point, p)

    layouts = [record.leaf.layout for _, record in moved.trace.results]
    assert layouts[:2] == [CGA2.POINT, CGA2.POINT] and layouts[2].size == 4


def test_carries_grow() -> None:
    @loops(x=array(PGA3.LINE, "n"))
    def grown(x: Any) -> Any:
        return fold(lambda s, line: s * line + line, 1, x)

    ((_, record),) = grown.trace.results
    assert record.leaf.layout.size == 8 and not record.leaf.layout.has_relations


def test_constants_of_an_algebra() -> None:
    e12 = PGA3.multivector({"e12": 1})

    @loops(x=N)
    def turned(x: Any) -> Any:
        return fold(lambda m, angle: m * (cos(angle) + sin(angle) * e12), e12, x)

    ((_, record),) = turned.trace.results
    assert record.leaf.layout.blades == ("1", "e12")


def test_rows_of_a_fixed_shape() -> None:
    @loops(triangles=array(PGA3.POINT, "n", 3))
    def planes(triangles: Any) -> Any:
        return each(lambda t: t[0] & t[1] & t[2], triangles)

    assert planes.procedure.signature == "(n,3,3)->(n,4)"

    @kernel(pairs=array(SCALAR, "n", 2), returns=array(SCALAR, "n", 2))
    def swapped(pairs: Any) -> Any:
        return each(lambda pair: pair[1], pairs), each(lambda pair: pair[0], pairs)

    found = results(compile_loops(swapped), pairs=[[1, 2], [3, 4]])
    assert found == [[[2, 1], [4, 3]]]


# No unnecessary work.


def test_the_text_is_short() -> None:
    @loops(q=N, axes=array(PGA3.LINE, "n", shared=True), tool=PGA3.MOTOR)
    def forward(q: Any, axes: Any, tool: Any) -> Any:
        return fold(lambda m, angle, axis: m * (cos(angle / 2) - sin(angle / 2) * axis), 1, q, axes) * tool

    assert procedure_text(forward.procedure).splitlines() == [
        "forward(q[n], axes[n, 6], tool[8]) -> out[8]",
        "    m = forward_1()",
        "    for i in n:",
        "        m = forward_2(m, q[i], axes[i])",
        "    out = forward_3(tool, m)",
        "work: m[8]",
    ]


def test_results_are_written_directly() -> None:
    @loops(x=N)
    def sums(x: Any) -> Any:
        return total(lambda a: a, x), scan(lambda s, a: s + a, 0, x)

    assert procedure_text(sums.procedure).splitlines()[1:] == [
        "    out_0 = sums_1()",
        "    s_start = sums_3()",
        "    for i in n:",
        "        out_0 = sums_2(out_0, x[i])",
        "        out_1[i] = sums_4(out_1[before i, else s_start], x[i])",
        "work: s_start",
    ]


def test_a_result_may_be_returned_twice() -> None:
    @loops(x=N, a=SCALAR)
    def twice(x: Any, a: Any) -> Any:
        s = fold(lambda s, b: s + b, a, x)
        rows = each(lambda b: b + 1, x)
        return s, s, a, rows, rows, x

    assert results(twice, x=[1, 2], a=5) == [8, 8, 5, [2, 3], [2, 3], [1, 2]]


def test_outer_values_are_computed_once() -> None:
    @loops(x=N, a=SCALAR)
    def scaled(x: Any, a: Any) -> Any:
        return each(lambda v: v * sin(a), x), total(lambda v: v * sin(a), x)

    assert dict(scaled.costs)[""].call == 1 and dict(scaled.costs)["n"].call == 0


def test_names_that_collide() -> None:
    """Parameters with the names of counters and results; bodies with parameters named like lengths and results."""

    @loops(i=N, out=N)
    def named(i: Any, out: Any) -> Any:
        return each(lambda n, j: n * j, i, out), total(lambda out_0: out_0, i), fold(lambda out_1, t: out_1 + t, 0, i)

    names = [table.name for table in named.procedure.tables]
    assert len(set(names)) == len(names) and names[:2] == ["i", "out"]
    assert results(named, i=[1, 2], out=[3, 4]) == [[3, 8], 3, 3]

    @loops(n=N)
    def as_its_length(n: Any) -> Any:
        return total(lambda n: n, n), fold(lambda double, int: double + int, 1, n)

    assert results(as_its_length, n=[1, 2]) == [3, 4]


def test_index_tables_of_proofs_are_valid() -> None:
    @loops(x=N, w=index("n"), v=index("n"), u=index("n"))
    def all_kinds(x: Any, w: Any, v: Any, u: Any) -> Any:
        return scan(lambda s, a: s + a, 0, x, parents=w), gather(x, v), scatter(x, u, x)

    procedure = all_kinds.procedure
    assert (procedure.parent_tables, procedure.read_through) == ({"w"}, {"v"})
    for seed in range(20):
        found = index_tables(procedure, {"n": 4}, Random(seed))
        assert all(-1 <= k < row for row, k in enumerate(found["w"]))
        assert all(0 <= k < 4 for k in found["v"]) and all(-1 <= k < 4 for k in found["u"])


def test_proofs_distinguish_all_lengths() -> None:
    """An array of one length in place of another has a wrong number of rows in at least two of three comparisons."""
    cases = few_rows("abcdefghij")
    for a, b in combinations("abcdefghij", 2):
        assert sum(lengths[a] != lengths[b] for lengths in cases) >= 2
    assert all({lengths[name] for lengths in cases} == {1, 2, 3} for name in "abcdef")


def test_bodies_of_nested_sums_are_traced_twice_for_each_loop() -> None:
    """Once for the layout of the carry, and once for the text."""
    calls = []

    def added(sum: Any, x: Any) -> Any:
        calls.append(x)
        return sum + x

    def summed(depth: int, sum: Any, rows: Any) -> Any:
        body = added if depth == 1 else partial(summed, depth - 1)
        return fold(body, sum, rows)

    @kernel(x=array(SCALAR, "a", "b", "c", "d"))
    def sum_of_all(x: Any) -> Any:
        return summed(4, 0, x)

    traced_loops(sum_of_all)
    assert len(calls) == 2**4


def test_signs_of_outer_values_are_kept_in_the_body() -> None:
    """The reverse of a motor costs nothing; as a separate value it would not be known to be that of the motor."""

    @loops(m=PGA3.MOTOR, p=array(PGA3.POINT, "n"))
    def moved(m: Any, p: Any) -> Any:
        return each(lambda a: m * a * ~m, p)

    @loops(m=PGA3.MOTOR, p=array(PGA3.POINT, "n"))
    def same(m: Any, p: Any) -> Any:
        return each(lambda a: sandwich(m, a), p)

    assert moved.costs == same.costs

    @loops(x=N, a=SCALAR)
    def scaled(x: Any, a: Any) -> Any:
        return each(lambda b: -(a * a) * b, x)

    assert dict(scaled.costs)[""].mul == 1 and dict(scaled.costs)["n"].mul == 1


def test_missing_rows_along_two_axes_have_their_own_values() -> None:
    @kernel(image=array(SCALAR, "n", "m"), r=SCALAR, c=SCALAR)
    def picked_twice(image: Any, r: Any, c: Any) -> Any:
        """A number of an array with two axes."""
        return pick(pick(image, r, 3), c, 7), pick(pick(image, r, 4), c, 4)

    places = np.array([(0, 1), (5, 1), (1, 9), (9, 9), (-1, 0), (1, -1)], float)
    found = gacompiler.compile(picked_twice)(np.arange(6.0).reshape(2, 3), *places.T)
    assert np.array_equal(found, [[1, 3, 7, 7, 3, 7], [1, 4, 4, 4, 4, 4]])


def test_equal_rows_are_read_once() -> None:
    @loops(image=array(SCALAR, "n", "m"), x=SCALAR)
    def difference(image: Any, x: Any) -> Any:
        def at(row: Any, column: Any) -> Any:
            return pick(pick(image, row, 0), column, 0)

        return at(x, 2 * x) * at(x, 2 * x) - at(x, 2 * x + 1)

    text = procedure_text(difference.procedure)
    assert text.count("image[number, else otherwise, ") == 2 and text.endswith("number, otherwise, number_2, number_3")
