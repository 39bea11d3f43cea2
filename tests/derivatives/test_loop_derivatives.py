"""Derivatives of kernels with loops: closed forms, and differences of values that procedures compute.

Compiling a derivative proves that its loops compute the derivative of the same function without loops. What is compared
here shares no code with derivatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache
from random import Random
from typing import Any

import mpmath
import numpy as np
import pytest
from selection import some_slow

from gacompiler import (
    SCALAR,
    absolute,
    array,
    cos,
    hessian_vector,
    jacobian,
    jvp,
    kernel,
    matrix_of,
    norm,
    norm_squared,
    sandwich,
    sin,
    vjp,
)
from gacompiler.algebra.catalog import CGA3, PGA2, PGA3, VGA3
from gacompiler.algebra.multivector import Multivector
from gacompiler.errors import KernelError
from gacompiler.frontend.kernel import Kernel, index
from gacompiler.frontend.loops import accumulate, each, fold, gather, iterate, scan, scatter, total, transpose
from gacompiler.frontend.rows import IndexOf, RowsOf
from gacompiler.frontend.searches import least, pick, row_numbers
from gacompiler.frontend.windows import window
from gacompiler.ir.procedure import Add, Clear, Loop, Place, Procedure, Storage, Table
from gacompiler.ir.rows import Counter, Through
from gacompiler.ir.run_procedure import _Run, run_procedure
from gacompiler.passes.loops import LoopCompilation, compile_loops
from gacompiler.passes.samples import to_mpmath
from gacompiler.rings.points import point

LENGTHS = {"n": 4, "m": 3, "k": 5}
TABLES = {
    "parents": (-1, 0, 0, 2),
    "rows": (3, 1, 1, 0, 2),
    "columns": (2, 2, 0, 1, 0),
    "some": (2, -1, 0, 2, -1),
    "others": (4, 4, 1, 0, 2),
}


@kernel(q=array(SCALAR, "n"), axes=array(PGA3.LINE, "n", shared=True), tool=PGA3.MOTOR)
def arm(q, axes, tool):
    """Pose by the product of exponentials."""
    return fold(lambda m, angle, axis: m * (cos(angle / 2) - sin(angle / 2) * axis), 1, q, axes) * tool


@kernel(x=array(SCALAR, "n"))
def squares(x):
    return total(lambda v: v * v, x)


@kernel(x=array(SCALAR, "n"), parents=index("n"))
def tree_sums(x, parents):
    return accumulate(lambda children, v: children + v, 0, x, parents=parents)


@kernel(x=array(SCALAR, "n"), parents=index("n"), scale=SCALAR)
def up_and_down(x, parents, scale):
    up = scan(lambda s, v: s * v + v * (scale * scale + 1), scale, x, parents=parents)
    down, kept = accumulate(lambda c, v: (c * v + v, (c * c * scale, v)), 0, up, parents=parents, keep=True)
    return down, kept[0]


@kernel(x=array(SCALAR, "n"), start=SCALAR)
def backwards(x, start):
    return scan(lambda c, v: c * v, start, x, reverse=True)


@kernel(x=array(SCALAR, "n"), y=array(SCALAR, "m"), rows=index("k", "n"), columns=index("k", "m"))
def through_two_tables(x, y, rows, columns):
    products = each(lambda a, b: a * b * b, gather(x, rows), gather(y, columns))
    return scatter(products, (rows, columns), (x, y))


@kernel(x=array(SCALAR, "k"), others=index("k"))
def with_another(x, others):
    return each(lambda a, b: a * a * b, x, gather(x, others))


@kernel(z=array(SCALAR, "k"), some=index("k", "m"), y=array(SCALAR, "m"))
def through_a_table_with_gaps(z, some, y):
    return each(lambda a, b: a * a * b, scatter(each(lambda v: v * v, z), some, y), y)


@kernel(x=array(SCALAR, "n"), y=array(SCALAR, "m"), b=SCALAR)
def loops_in_loops(x, y, b):
    def body(c, v):
        sums = scan(lambda d, w: d * w + v, v, y)
        back = accumulate(lambda d, w: d * w + c, 0, sums)
        return c * b + total(lambda p, q: p * q, sums, back)

    return fold(body, b, x)


@kernel(x=array(SCALAR, "n"), y=array(SCALAR, "m"), b=SCALAR)
def carries_used_in_loops(x, y, b):
    return scan(lambda c, v: c + total(lambda w: w * c * c * v, y), b * b, x)


@kernel(x=array(VGA3.VECTOR, "n"))
def nearest(x):
    return least(lambda v: norm_squared(v), x)[0]


@kernel(motors=array(PGA3.MOTOR, "n"), p=PGA3.POINT, parents=index("n"))
def placed(motors, p, parents):
    world = scan(lambda a, b: a * b, 1, motors, parents=parents)
    return each(lambda w: sandwich(w, p), world)


@kernel(m=PGA3.MOTOR, p=array(PGA3.POINT, "n"), q=array(PGA3.POINT, "n"))
def misfit(m, p, q):
    moved = each(lambda a: sandwich(m, a), p)
    return total(lambda a, b: norm_squared(a & b), moved, q)


@kernel(x=array(SCALAR, "n"), a=SCALAR)
def root(x, a):
    s = total(lambda v: v * v, x)
    found, _, _ = iterate(lambda r: (r + a * s / r) / 2, 1 + a * a, lambda old, new: absolute(new - old) < 1e-9, 3)
    return found * s


@kernel(x=array(VGA3.VECTOR, "n", 2), a=SCALAR)
def pairs(x, a):
    return scan(lambda c, v: c + (v[0] ^ c) * a + norm(v[1]) * v[1], 0, x)


@kernel(a=array(SCALAR, "n", "m"), b=array(SCALAR, "m", "k"))
def matrix_product(a, b):
    return each(lambda row: each(lambda c: total(lambda x, y: x * y * y, row, c), transpose(b)), a)


@kernel(a=array(SCALAR, "n", "m"), x=array(SCALAR, "m"))
def arrays_carried(a, x):
    def step(carry, row):
        first, second = carry
        return second, each(lambda p, q: p * q * q + 1, first, row)

    return fold(step, (x, x), a)


@kernel(a=array(SCALAR, "n", "n"), b=array(SCALAR, "n"))
def eliminated(a, b):
    numbers = row_numbers(b)

    def step(right, k, pivots):
        own = pick(right, k, 0)
        return each(lambda row, value: value - pick(row, k, 0) * own / (2 + pick(pivots, k, 0) ** 2), a, right)

    return fold(step, b, numbers, a)


@kernel(x=array(SCALAR, "n"), a=array(SCALAR, "n", "m"))
def ending_early(x, a):
    sum_of = fold(lambda s, v: s + v * v, 0, x, until=lambda s: s > 3)
    return each(lambda row: total(lambda v: v, row) * sum_of, a), pick(x, 2, 1) * pick(x, 2 + 0 * sum_of, sum_of)


@kernel(x=array(SCALAR, "n"), y=array(SCALAR, "m"), a=SCALAR)
def rows_with_numbers(x, y, a):
    """The numbers are overwritten in each row, and one names no row."""

    def step(c, v):
        return c * pick(x, v * v, a * a) + pick(x, v + 1, 3) ** 2

    return fold(step, 1, y)


@kernel(x=array(SCALAR, "n"), y=array(SCALAR, "m"))
def ranges(x, y):
    def row(a):
        ended = fold(lambda c, v: c * v + a, 1, x, until=lambda c: c > 5, within=(a * a - 1, 3))
        return ended + fold(lambda c, v: c * v + a, a, x, within=(a - 1, a + 2), reverse=True)

    return each(row, y)


@kernel(a=array(SCALAR, "n", "m"), b=array(SCALAR, "m", "k"))
def three_loops(a, b):
    """The innermost loop reads a carry that is overwritten after the loops."""
    return fold(lambda c, row: c + total(lambda x, r: total(lambda y: x * y * y * c, r), row, b), 1, a)


@kernel(a=array(SCALAR, "n", "m"), b=array(SCALAR, "m", "k"))
def carried_rows(a, b):
    """Rows of a carried array are read in a loop of their own, before they are overwritten."""
    start = each(lambda row: total(lambda y: y * y, row), b)
    return fold(lambda c, row: each(lambda v, x: v * total(lambda y: y * v * x, row), c, row), start, a)


@kernel(x=array(SCALAR, "m", "k"), s=array(SCALAR, "k"))
def scanned_rows(x, s):
    """The cotangent of the carried array is added to before it is read."""
    return scan(lambda c, row: each(lambda p, q: p * q, c, row), s, x)


@kernel(image=array(SCALAR, "n", "m"), c=SCALAR)
def filtered(image, c):
    """Rows of the first result are read by inner loops."""
    lines = window(image, 3, boundary="mirror")
    low = each(lambda *rows: each(lambda a, b, d: a * b * c + d, *rows), *lines)
    return each(lambda row: each(lambda a, b, d: a * b * c + d, *window(row, 3, boundary="mirror")), low)


CASES: list[tuple[Kernel, str]] = [
    (squares, "x"),
    (arm, "q"),
    (arm, "tool"),
    (tree_sums, "x"),
    (up_and_down, "x"),
    (up_and_down, "scale"),
    (backwards, "x"),
    (backwards, "start"),
    (through_two_tables, "x"),
    (through_two_tables, "y"),
    (through_a_table_with_gaps, "z"),
    (with_another, "x"),
    (loops_in_loops, "x"),
    (loops_in_loops, "y"),
    (loops_in_loops, "b"),
    (carries_used_in_loops, "b"),
    (carries_used_in_loops, "y"),
    (nearest, "x"),
    (placed, "motors"),
    (placed, "p"),
    (misfit, "m"),
    (pairs, "x"),
    (pairs, "a"),
    (matrix_product, "a"),
    (matrix_product, "b"),
    (arrays_carried, "a"),
    (arrays_carried, "x"),
    (eliminated, "a"),
    (eliminated, "b"),
    (ending_early, "a"),
    (ending_early, "x"),
    (rows_with_numbers, "x"),
    (rows_with_numbers, "y"),
    (rows_with_numbers, "a"),
    (ranges, "x"),
    (ranges, "y"),
    (three_loops, "a"),
    (three_loops, "b"),
    (carried_rows, "a"),
    (scanned_rows, "x"),
    (filtered, "image"),
]
FORWARD = [
    (squares, "x"),
    (arm, "q"),
    (tree_sums, "x"),
    (up_and_down, "scale"),
    (backwards, "start"),
    (through_two_tables, "y"),
    (through_a_table_with_gaps, "z"),
    (with_another, "x"),
    (loops_in_loops, "x"),
    (loops_in_loops, "b"),
    (carries_used_in_loops, "b"),
    (nearest, "x"),
    (placed, "p"),
    (misfit, "m"),
    (pairs, "a"),
    (matrix_product, "b"),
    (arrays_carried, "a"),
    (eliminated, "a"),
    (ending_early, "a"),
    (rows_with_numbers, "y"),
    (ranges, "y"),
    (three_loops, "b"),
    (carried_rows, "a"),
    (scanned_rows, "x"),
    (filtered, "image"),
    (root, "a"),
]
"""One argument of each kernel. The number of steps of the last depends on values, which the reverse mode refuses."""
SLOW = [(arm, "q"), (placed, "motors"), (misfit, "m")]
SLOWEST = SLOW[1:]
"""Of motors in rows, and of a motor; another of motors is quick."""
NAMES = [f"{definition.name}-{wrt}" for definition, wrt in CASES]

Values = Mapping[str, Sequence[Sequence[Any]]]


@cache
def compiled(definition: Kernel) -> LoopCompilation:
    """The kernel, compiled and proved without a search for cheaper forms, which other tests compare."""
    return compile_loops(definition, effort=0)


@cache
def derived(make: Any, definition: Kernel, wrt: str, *further: str) -> Kernel:
    """A derivative, cached so that it is compiled once."""
    found: Kernel = make(definition, wrt, *further)
    return found


def arguments_of(definition: Kernel, seed: int = 1) -> dict[str, list[list[Any]]]:
    """Random arguments that satisfy the relations of their layouts, and index tables."""
    random, found = Random(seed), dict[str, list[list[Any]]]()
    for parameter in definition.parameters:
        if isinstance(parameter.type, IndexOf):
            found[parameter.name] = [[k] for k in TABLES[parameter.name]]
            continue
        count, each_row = 1, 1
        for name in parameter.type.lengths if isinstance(parameter.type, RowsOf) else ():
            count *= LENGTHS[name]
        for size in parameter.outer_shape:
            each_row *= size
        found[parameter.name] = [
            [to_mpmath(x) for _ in range(each_row) for x in point(parameter.layout, random)] for _ in range(count)
        ]
    return found


def run(definition: Kernel, arguments: Values) -> list[list[Any]]:
    """The results of the compiled procedure, each as one list of numbers."""
    found = run_procedure(compiled(definition).procedure, LENGTHS, arguments, to_mpmath)
    return [[x for row in rows for x in row] for rows in found.values()]


def slope(definition: Kernel, arguments: Values, wrt: str, along: Sequence[Sequence[Any]]) -> list[list[Any]]:
    """The derivative as a central difference."""
    h = mpmath.mpf(10) ** -20

    def moved(sign: int) -> list[list[Any]]:
        rows = [
            [x + sign * h * t for x, t in zip(*pair, strict=True)] for pair in zip(arguments[wrt], along, strict=True)
        ]
        return run(definition, {**arguments, wrt: rows})

    return [[(a - b) / (2 * h) for a, b in zip(*pair, strict=True)] for pair in zip(moved(1), moved(-1), strict=True)]


def close(found: Sequence[Any], expected: Sequence[Any]) -> bool:
    size = 1 + max(map(abs, expected), default=0)
    return len(found) == len(expected) and all(
        abs(a - b) < size * mpmath.mpf(10) ** -25 for a, b in zip(found, expected, strict=True)
    )


def numbers_like(rows: Sequence[Sequence[Any]], seed: int) -> list[list[Any]]:
    random = Random(seed)
    return [[mpmath.mpf(random.randint(-9, 9)) / 7 for _ in row] for row in rows]


@pytest.fixture(autouse=True)
def many_digits():
    with mpmath.workdps(70):
        yield


# Comparisons with finite differences.


def check_jvp(definition: Kernel, wrt: str) -> None:
    arguments = arguments_of(definition)
    along = tangent_of(definition, wrt, arguments)
    made = derived(jvp, definition, wrt)
    found = run(made, {**arguments, made.parameters[-1].name: along})
    expected = slope(definition, arguments, wrt, along)
    for one, other in zip(found, [*run(definition, arguments), *expected], strict=True):
        assert close(one, other)


def check_vjp(definition: Kernel, wrt: str) -> None:
    arguments = arguments_of(definition)
    along = tangent_of(definition, wrt, arguments)
    made = derived(vjp, definition, wrt)
    further = made.parameters[len(definition.parameters) :]
    weights = {p.name: numbers_like(arguments_of(made)[p.name], 5) for p in further}
    *values, gradient = run(made, {**arguments, **weights})
    for one, other in zip(values, run(definition, arguments), strict=True):
        assert close(one, other)
    expected = slope(definition, arguments, wrt, along)
    flat = [x for p in further for row in weights[p.name] for x in row]
    by_differences = sum(w * x for w, x in zip(flat, [x for each in expected for x in each], strict=True))
    by_gradient = sum(g * t for g, t in zip(gradient, [t for row in along for t in row], strict=True))
    assert close([by_gradient], [by_differences])


@pytest.mark.parametrize(
    ("definition", "wrt"), some_slow(FORWARD, (misfit, "m")), ids=[f"{each.name}-{wrt}" for each, wrt in FORWARD]
)
def test_jvp_is_the_limit_of_differences(definition: Kernel, wrt: str) -> None:
    check_jvp(definition, wrt)


@pytest.mark.parametrize(("definition", "wrt"), some_slow(CASES, *SLOWEST), ids=NAMES)
def test_vjp_is_the_transpose_of_differences(definition: Kernel, wrt: str) -> None:
    check_vjp(definition, wrt)


def tangent_of(definition: Kernel, wrt: str, arguments: Values) -> list[list[Any]]:
    """A tangent of a parameter: along the manifold for motors, whose values are used with their relations."""
    layout = next(p.layout for p in definition.parameters if p.name == wrt)
    if layout is not PGA3.MOTOR:
        return numbers_like(arguments[wrt], 3)
    random, found = Random(3), []
    for row in arguments[wrt]:
        lines = {blade: random.randint(-9, 9) for blade in PGA3.blades(2)}
        moved = Multivector(PGA3, lines) * layout.element(row)
        found.append([slot.sign * moved.terms.get(slot.blade, 0) for slot in layout.stored])
    return found


# Closed forms, exact.


def exact(definition: Kernel, arguments: Mapping[str, Any], **lengths: int) -> dict[str, Any]:
    return run_procedure(compiled(definition).procedure, lengths, arguments)


def test_the_gradient_of_a_sum_of_squares() -> None:
    x = [[Fraction(k, 3)] for k in range(1, 6)]
    found = exact(derived(vjp, squares, "x"), {"x": x, "cotangent": [[Fraction(7)]]}, n=5)
    assert list(found.values()) == [[[Fraction(55, 9)]], [[14 * v] for (v,) in x]]
    along = exact(derived(jvp, squares, "x"), {"x": x, "x_tangent": [[1]] * 5}, n=5)
    assert list(along.values()) == [[[Fraction(55, 9)]], [[Fraction(10)]]]
    assert list(exact(derived(jacobian, squares, "x"), {"x": x}, n=5).values())[1] == [[2 * v] for (v,) in x]


def test_the_gradient_of_no_rows_has_no_rows() -> None:
    found = exact(derived(vjp, backwards, "start"), {"x": [], "start": [[2]], "cotangent": []}, n=0)
    assert list(found.values()) == [[], [[0]]]
    found = exact(derived(vjp, arm, "q"), {"q": [], "axes": [], "tool": [[1, *[0] * 7]], "cotangent": [[1] * 8]}, n=0)
    assert list(found.values()) == [[[1, *[0] * 7]], []]


def test_the_gradient_of_sums_over_subtrees_sums_over_ancestors() -> None:
    parents, weights = TABLES["parents"], [2, 3, 5, 7]
    arguments = {"x": [[1]] * 4, "parents": [[k] for k in parents], "cotangent": [[w] for w in weights]}
    _, gradient = exact(derived(vjp, tree_sums, "x"), arguments, n=4).values()
    expected = []
    for k in range(4):
        above, found = k, 0
        while above >= 0:
            found, above = found + weights[above], parents[above]
        expected.append([found])
    assert gradient == expected


def test_the_second_derivative_of_a_product() -> None:
    x = [2, 3, 5]
    arguments = {"x": [[v] for v in x], "start": [[1]], "cotangent": [[1], [0], [0]], "x_tangent": [[1], [10], [100]]}
    *_, second = exact(derived(hessian_vector, backwards, "x"), arguments, n=3).values()
    assert second == [[10 * 5 + 100 * 3], [1 * 5 + 100 * 2], [1 * 3 + 10 * 2]]


def test_the_left_jacobian_of_a_product_of_motors() -> None:
    """Moving a joint by ``B`` moves the product as ``before B after``: the columns for each row, along ``B m``."""

    @kernel(motors=array(PGA2.MOTOR, "n"))
    def product(motors):
        return fold(lambda a, b: a * b, 1, motors)

    random = Random(2)
    motors = [list(point(PGA2.MOTOR, random)) for _ in range(3)]
    _, matrices = exact(derived(jacobian, product, "motors", "left"), {"motors": motors}, n=3).values()
    elements = [PGA2.MOTOR.element(motor) for motor in motors]
    blades = list(PGA2.blades(2))
    for k, matrix in enumerate(matrices):
        for column, blade in enumerate(blades):
            expected = PGA2.scalar(1)
            for place, element in enumerate(elements):
                expected = expected * (Multivector(PGA2, {blade: 1}) * element if place == k else element)
            entries = [matrix[row * len(blades) + column] for row in range(PGA2.MOTOR.size)]
            assert entries == [slot.sign * expected.terms.get(slot.blade, 0) for slot in PGA2.MOTOR.stored]


@pytest.mark.slow
def test_jacobians_have_the_gradients_as_rows() -> None:
    arguments = arguments_of(arm)
    value, matrices = run(derived(jacobian, arm, "q"), arguments)
    assert close(value, run(arm, arguments)[0])
    for row in range(8):
        unit = [[mpmath.mpf(int(k == row)) for k in range(8)]]
        _, gradient = run(derived(vjp, arm, "q"), {**arguments, "cotangent": unit})
        assert close([matrices[8 * joint + row] for joint in range(4)], gradient)


def test_jacobians_of_rows_have_the_coefficients_of_a_parameter_as_columns() -> None:
    @kernel(r=VGA3.VECTOR, points=array(VGA3.VECTOR, "n"))
    def reflected(r, points):
        return each(lambda a: (r * a * r).grade(1), points)

    r, points = (1, -2, 4), [(3, 1, -5), (0, 7, 2), (1, 1, 1), (-2, 0, 0)]
    _, found = run(derived(jacobian, reflected, "r"), {"r": [r], "points": points})
    for a, matrix in zip(points, np.reshape(np.array(found, float), (-1, 3, 3)), strict=True):
        # The vector r a r is 2 (r.a) r - (r.r) a.
        assert np.array_equal(matrix, 2 * (np.outer(r, a) + np.dot(r, a) * np.eye(3) - np.outer(a, r)))


def test_jacobians_by_a_number_are_the_derivative_along_it() -> None:
    _, columns = run(derived(jacobian, up_and_down_sum, "scale"), arguments_of(up_and_down_sum))
    along = {**arguments_of(up_and_down_sum), "scale_tangent": [[mpmath.mpf(1)]]}
    assert close(columns, run(derived(jvp, up_and_down_sum, "scale"), along)[1])


@kernel(x=array(SCALAR, "n"), parents=index("n"), scale=SCALAR)
def up_and_down_sum(x, parents, scale):
    down, kept = up_and_down(x, parents, scale)
    return each(lambda a, b: a + b, down, kept)


# Twice.

TWICE = [case for case in CASES if case[0] in (squares, backwards, up_and_down, through_two_tables, nearest)]
SLOW_TWICE = [case for case in TWICE if case[0] in (up_and_down, through_two_tables)]


@pytest.mark.parametrize("second", [jvp, vjp])
@pytest.mark.parametrize("first", [jvp, vjp])
@pytest.mark.parametrize(("definition", "wrt"), some_slow(TWICE, *SLOW_TWICE), ids=[f"{d.name}-{w}" for d, w in TWICE])
def test_derivatives_are_differentiated(definition: Kernel, wrt: str, first: Any, second: Any) -> None:
    (check_jvp if second is jvp else check_vjp)(derived(first, definition, wrt), wrt)


@pytest.mark.parametrize("second", [jvp, vjp])
@pytest.mark.parametrize(("definition", "wrt"), some_slow(TWICE, *SLOW_TWICE), ids=[f"{d.name}-{w}" for d, w in TWICE])
def test_gradients_are_differentiated_by_cotangents(definition: Kernel, wrt: str, second: Any) -> None:
    once = derived(vjp, definition, wrt)
    cotangent = once.parameters[len(definition.parameters)].name
    (check_jvp if second is jvp else check_vjp)(once, cotangent)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("definition", "wrt"),
    [
        (arm, "q"),
        (loops_in_loops, "x"),
        (loops_in_loops, "y"),
        (carries_used_in_loops, "b"),
        (misfit, "m"),
        (placed, "p"),
        (ending_early, "x"),
        (rows_with_numbers, "x"),
        (ranges, "x"),
        (three_loops, "a"),
        (carried_rows, "b"),
        (scanned_rows, "x"),
        (filtered, "image"),
    ],
)
def test_derivatives_of_motors_and_of_loops_in_loops_are_differentiated(definition: Kernel, wrt: str) -> None:
    """Gradients have statements that no kernel has; derivatives along a tangent are kernels like their definitions."""
    gradient = derived(vjp, definition, wrt)
    check_jvp(gradient, wrt)
    check_vjp(gradient, wrt)


# Calls inside other kernels.

gradient_of_arm = derived(vjp, arm, "q")
slope_of_squares = jvp(squares, "x")


@kernel(q=array(SCALAR, "n"), axes=array(PGA3.LINE, "n", shared=True), tool=PGA3.MOTOR, c=PGA3.even)
def descent(q, axes, tool, c):
    squared = each(lambda a: a * a, q)
    _, gradient = gradient_of_arm(squared, axes, tool, c * 2)
    return each(lambda a, b: a - b, squared, gradient)


@kernel(x=array(SCALAR, "n"), y=array(SCALAR, "m"))
def slope_in_a_loop(x, y):
    return each(lambda a: slope_of_squares(each(lambda b: a * b, y), y)[1], x)


def test_derivatives_are_called_in_kernels() -> None:
    arguments = arguments_of(descent)
    squared = [[x * x] for (x,) in arguments["q"]]
    cotangent = [[2 * x for x in arguments["c"][0]]]
    called = {name: arguments[name] for name in ("axes", "tool")}
    _, gradient = run(gradient_of_arm, {**called, "q": squared, "cotangent": cotangent})
    (found,) = run(descent, arguments)
    assert close(found, [x - g for (x,), g in zip(squared, gradient, strict=True)])


def test_derivatives_are_called_in_loops() -> None:
    arguments = arguments_of(slope_in_a_loop)
    (found,) = run(slope_in_a_loop, arguments)
    size = sum(y * y for (y,) in arguments["y"])
    assert close(found, [2 * x * size for (x,) in arguments["x"]])
    check_vjp(slope_in_a_loop, "y")


# Properties of procedures.


@pytest.mark.parametrize(
    ("definition", "wrt"), some_slow(dict.fromkeys([*CASES, *FORWARD]), *SLOW), ids=[*NAMES, "root-a"]
)
def test_nothing_is_read_before_it_is_written(definition: Kernel, wrt: str) -> None:
    """Tables of intermediate values are uninitialised."""
    for make in [jvp] * ((definition, wrt) in FORWARD) + [vjp] * ((definition, wrt) in CASES):
        made = derived(make, definition, wrt)
        procedure, arguments = compiled(made).procedure, arguments_of(made)
        running = _Run(procedure, LENGTHS, arguments, to_mpmath, lambda tape, given: tape.run(given, to_mpmath))
        for table in procedure.of(Storage.RESULT, Storage.WORK):
            for row in running._tables[table.name]:
                row[:] = [mpmath.nan] * len(row)
        assert [[x for row in rows for x in row] for rows in running.results().values()] == run(made, arguments)


@pytest.mark.parametrize(("definition", "wrt"), [(arm, "q"), (placed, "motors"), (up_and_down, "x")])
def test_a_gradient_costs_a_constant_for_each_row(definition: Kernel, wrt: str) -> None:
    assert {often for often, _ in compiled(derived(vjp, definition, wrt)).costs} <= {"", "n"}


def test_adding_a_missing_row_does_nothing() -> None:
    tables = (
        Table("x", ("m",), (), Storage.ARGUMENT),
        Table("which", ("n",), (), Storage.INDEX, True, "m"),
        Table("out", ("n",), (), Storage.RESULT),
    )
    add = Add(Place("x", Through("which", "i")), Place("out", Counter("i")))
    procedure = Procedure("gathered", tables, (Clear("out"), Loop("i", "n", False, (add,))))
    arguments = {"x": [[5], [7]], "which": [[1], [-1], [0]]}
    assert run_procedure(procedure, {"n": 3, "m": 2}, arguments) == {"out": [[7], [0], [5]]}


# Errors.


def test_errors_of_kernels_without_a_derivative() -> None:
    with pytest.raises(KernelError, match=r"iterate.*depends on a; .* use jvp"):
        compile_loops(vjp(root, "a"))

    @kernel(x=array(SCALAR, "n"))
    def ending_backwards(x):
        return fold(lambda c, v: c + v, 0, x, until=lambda c: c > 1, reverse=True)

    with pytest.raises(KernelError, match=r"from the last row that ends early.* use jvp"):
        compile_loops(vjp(ending_backwards, "x"))
    with pytest.raises(KernelError, match=r"Jacobian of rows over n by rows over n; .* use jvp"):
        jacobian(backwards, "x")
    with pytest.raises(KernelError, match="parents is an index table"):
        jvp(tree_sums, "parents")
    with pytest.raises(KernelError, match=r"matrix_of.* of a kernel with loops"):
        matrix_of(squares, "x")
    with pytest.raises(KernelError, match="several results"):
        jacobian(up_and_down, "scale")

    @kernel(x=array(CGA3.POINT, "n"), c=CGA3.VECTOR)
    def distances(x, c):
        return total(lambda p: (p * c)["1"], x)

    with pytest.raises(KernelError, match=r"implied coefficients.* rebuild the element inside the kernel"):
        vjp(distances, "x")


def test_an_iteration_that_does_not_change_is_passed_in_reverse() -> None:
    @kernel(x=array(SCALAR, "n"), a=SCALAR)
    def scaled(x, a):
        found, _, _ = iterate(lambda r: (r + a / r) / 2, 1, lambda old, new: absolute(new - old) < 1e-9, 3)
        return total(lambda v: v * v * found, x)

    check_vjp(scaled, "x")
