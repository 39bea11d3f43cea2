"""Errors of kernels with loops: one line with file, line and kernel."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from gacompiler import SCALAR, array, index, kernel, select, sin, sqrt
from gacompiler.algebra.catalog import CGA3, PGA3, VGA3
from gacompiler.errors import GacError, KernelError
from gacompiler.frontend.loops import accumulate, each, fold, gather, iterate, scan, scatter, total, transpose
from gacompiler.passes.loops import compile_loops
from gacompiler.passes.pipeline import compile_kernel
from tests.support.all_cases import all_cases

N = array(SCALAR, "n")
M = array(SCALAR, "m")


def refused(function: Callable[..., Any], message: str, **parameters: Any) -> None:
    """Assert that a kernel raises an error with this message and with its place in this file."""
    with pytest.raises(GacError, match=message) as caught:
        compile_loops(kernel(**parameters)(function))
    assert "test_loop_errors.py" in str(caught.value)


def named(function: Callable[..., Any]) -> Callable[..., Any]:
    """A lambda with a valid name for a kernel."""
    function.__name__ = "declared"
    return function


@all_cases(
    "body",
    [
        lambda x: 2 * x,
        lambda x: x + x,
        lambda x: np.float64(2) * x,
        lambda x: PGA3.multivector({"e12": 1}) * x,
        lambda x: -x,
        lambda x: x[0],
        lambda x: sin(x),
        lambda x: sqrt(x),
        lambda x: select(x, 1, 2),
        lambda x: x < 1,
        lambda x: [each for each in x],
        lambda x: 1 if x else 2,
        lambda x: fold(lambda s, a: s * x, 1, x),
    ],
)
def test_arrays_are_not_computed_with(body: Callable[..., Any]) -> None:
    refused(named(body), "an array of rows in an expression", x=N)
    refused(named(lambda x: len(x)), "of an array of rows; expected an expression", x=N)


def test_lengths_differ() -> None:
    refused(named(lambda x, y: fold(lambda s, a, b: s + a * b, 0, x, y)), "arrays of lengths n, m", x=N, y=M)
    refused(named(lambda x, w: scan(lambda s, a: s + a, 0, x, parents=w)), "over m into m", x=N, w=index("m"))
    refused(named(lambda x, w: gather(x, w)), "over n; expected one over m", x=N, w=index("n", into="m"))
    refused(named(lambda x, w: scatter(x, w, x)), "index table over n into n", x=N, w=index("m", into="n"))
    two = array(SCALAR, "n", "m")
    refused(named(lambda x: total(lambda a: a + 1, x)), "an array of rows in an expression", x=two)
    refused(named(lambda x: scatter(x, x, x)), "an array over n, m; expected an array over one length", x=two)
    refused(named(lambda x, y: fold(lambda s, a: y, x, x)), "an array over m; expected an array over n", x=N, y=M)
    refused(named(lambda x: transpose(x)), "an array over n; expected an array over two", x=N)
    tree = named(lambda x, w: scan(lambda s, a: s, x, x, parents=w))
    refused(tree, "from parents to children", x=N, w=index("n"))


STRUCTURES: Mapping[str, tuple[str, Callable[..., Any]]] = {
    "another tuple": ("the body returns a tuple of 2", lambda x: fold(lambda s, a: (s, a), 0, x)),
    "a nested one": ("expected a tuple of 2, the", lambda x: fold(lambda s, a: (s[0], (a, a)), (0, 1), x)),
    "nothing": ("the body returns nothing", lambda x: fold(lambda s, a: None, 0, x)),
    "nothing in each": ("the body returns nothing", lambda x: each(lambda a: None, x)),
    "nothing in total": ("the body returns nothing", lambda x: total(lambda a: None, x)),
    "an empty tuple": ("an empty tuple", lambda x: each(lambda a: (), x)),
    "an empty start": ("an empty tuple to begin with", lambda x: fold(lambda s, a: s, (), x)),
    "no start": ("nothing to begin with", lambda x: fold(lambda s, a: s, None, x)),
    "an array": ("an array where one multivector", lambda x: accumulate(lambda s, a: each(lambda b: b, x), 0, x)),
    "an array to begin with": ("an array where one", lambda x: accumulate(lambda s, a: s, x, x)),
    "an array for a number": ("an array over n; expected a multivector", lambda x: fold(lambda s, a: x, 0, x)),
    "no pair": ("does not return a pair", lambda x: accumulate(lambda s, a: s + a, 0, x, keep=True)),
    "a sum that is not zero": ("zero is 1", lambda x: accumulate(lambda s, a: s + a, 1, x)),
    "no steps": ("at_most=0", lambda x: iterate(lambda r: r, 1, lambda o, n: 1, 0)),
    "a pair of conditions": ("until returns", lambda x: iterate(lambda r: r, 1, lambda o, n: (o, n), 2)),
    "no arrays": ("no array", lambda x: fold(lambda s: s, 0)),
    "an expression for an array": ("Expression; expected arrays", lambda x: each(lambda a: a, total(lambda a: a, x))),
    "too few parameters": ("positional argument", lambda x: fold(lambda s: s, 0, x)),
    "a condition": ("select", lambda x: fold(lambda s, a: s if a < 0 else a, 0, x)),
    "a builtin that compares": ("select", lambda x: fold(max, 0, x)),
    "no result": ("returns nothing", lambda x: None),
    "no results": ("an empty tuple", lambda x: ()),
    "nested results": ("is a nested tuple", lambda x: ((1, 2), 3)),
    "mixed algebras": ("arguments of CGA3 and PGA3", lambda x: fold(
        lambda s, a: s * CGA3.multivector({"e1": 1}) + s * a * PGA3.multivector({"e1": 1}), 1, x)),
    "a zero divisor": ("divides by an expression", lambda x: fold(lambda s, a: s / (a - a), 1, x)),
    "no value anywhere": ("undefined at", lambda x: each(lambda a: sqrt(-1 - a * a), x)),
}  # fmt: skip


@all_cases("name", STRUCTURES)
def test_wrong_bodies(name: str) -> None:
    message, function = STRUCTURES[name]
    refused(named(function), message, x=N)


def test_values_of_loops_that_have_ended() -> None:
    def leaking(x: Any) -> Any:
        kept = []

        def body(s: Any, a: Any) -> Any:
            kept.append(a)
            return s + a

        return fold(body, 0, x) + kept[-1]

    def leaking_arrays(x: Any) -> Any:
        kept = []

        def body(s: Any, a: Any) -> Any:
            kept.append(each(lambda b: a * b, x))
            return s + a

        return fold(body, 0, x) + total(lambda b: b, kept[-1])

    refused(leaking, "of a loop that has ended", x=N)
    refused(leaking_arrays, "of a loop that has ended", x=N)


def test_symbols_of_other_kernels() -> None:
    seen = []

    def first(x: Any, a: Any) -> Any:
        seen.append((x, a))
        return total(lambda b: b, x)

    compile_loops(kernel(x=N, a=SCALAR)(first))
    refused(named(lambda y: total(lambda b: b + seen[0][1], y)), "an input of another kernel", y=N)
    refused(named(lambda y: total(lambda b: b, seen[0][0])), "an array of another kernel", y=N)


def test_a_carry_that_is_always_zero() -> None:
    vectors = array(VGA3.VECTOR, "n")
    refused(named(lambda x: accumulate(lambda c, v: c ^ v, 0, x)), "a carry that is always zero", x=vectors)
    refused(named(lambda x: fold(lambda c, v: c * v, 0, x)), "begin with 1", x=vectors)


def test_undefined_operations_are_named() -> None:
    where = r"sqrt\(\(-1 - \(a \* a\)\)\) is not defined where \(-1 - \(a \* a\)\) = -"
    refused(named(lambda x: total(lambda a: sqrt(-1 - a * a), x)), where, x=N)
    with pytest.raises(GacError, match=r"sqrt\(inner_product\(a, b\)\) is not defined where inner_product\(a, b\) = -"):
        compile_kernel(kernel(a=CGA3.POINT, b=CGA3.POINT)(named(lambda a, b: sqrt(a | b))))


def test_index_tables_are_not_numbers() -> None:
    refused(named(lambda x, w: each(lambda a, b: a, x, w)), "Index, Rows", x=N, w=index("n"))
    refused(named(lambda x, w: w), "is the index table w", x=N, w=index("n"))
    refused(named(lambda x, w: total(lambda a: a * w, x)), "an array of rows", x=N, w=index("n"))
    refused(named(lambda x, w: gather(x, x)), "Rows as index", x=N, w=index("n"))


def test_results_that_returns_does_not_allow() -> None:
    with pytest.raises(KernelError, match="over n; expected one over m"):
        compile_loops(kernel(x=N, y=M, returns=array(SCALAR, "m"))(named(lambda x, y: each(lambda a: a, x))))
    with pytest.raises(KernelError, match="has blade 1"):
        compile_loops(kernel(x=N, returns=PGA3.POINT)(named(lambda x: each(lambda a: a * 2, x))))
    with pytest.raises(KernelError, match="is not an array"):
        compile_loops(kernel(x=N, returns=array(SCALAR, "n"))(named(lambda x: total(lambda a: a, x))))


def test_loops_need_a_kernel_with_arrays() -> None:
    @kernel(a=SCALAR)
    def plain(a: Any) -> Any:
        return fold(lambda s, b: s + b, 0, a)

    with pytest.raises(KernelError, match="expected arrays of rows"):
        compile_kernel(plain)


def test_rows_of_parents_are_not_gathered() -> None:
    """The first row has no parent, so that an index table of parents has a -1, and gather() has no row for it."""
    added = named(lambda x, w: scan(lambda c, a: c + a, 0, gather(x, w), parents=w))
    refused(added, r"gather\(\) reads the rows of parents in w", x=N, w=index("n", into="n"))
