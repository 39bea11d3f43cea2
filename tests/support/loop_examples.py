"""Kernels with loops that use every statement there is, and runs of their procedures by the interpreter."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from gacompiler import SCALAR, absolute, array, cos, index, kernel, sin, sqrt
from gacompiler.algebra.catalog import PGA3
from gacompiler.backends.module import LayoutText, LoopSource, ModuleSource
from gacompiler.backends.python_loops import index_rules
from gacompiler.frontend.loops import accumulate, each, fold, gather, iterate, least, scan, scatter, total
from gacompiler.ir.procedure import Procedure, Storage
from gacompiler.ir.run_procedure import run_procedure
from gacompiler.passes.loops import compile_loops


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
    """Sums towards the leaves of a tree, and sums of them towards its root."""
    up = scan(lambda s, v: s + v * (scale * scale + 1), 0, x, parents=parents)
    return up, accumulate(lambda c, v: c + v, 0, up, parents=parents)


@kernel(points=array(PGA3.POINT, "n"), n=SCALAR)
def suffixes(points, n):
    """Weighted sums from each point to the last, and a polynomial of them."""
    sums = scan(lambda s, p: s * 2 + p, 0, points, reverse=True)
    return sums, fold(lambda s, p: s * n + p, 0, points, reverse=True)


@kernel(x=array(SCALAR, "n"), y=array(SCALAR, "n", 3), parents=index("n"))
def kept(x, y, parents):
    """Sums towards the root, and what else the body gives."""
    return accumulate(
        lambda c, a, b: ((c[0] + a * b[0], c[1] + b[1]), (a * c[1], b[2])), (0, 0), x, y, parents=parents, keep=True
    )[1]


@kernel(x=array(SCALAR, "n"))
def chain(x):
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
    """A matrix of rows from its entries."""
    scaled = each(lambda v: (v[0] * 2, v[1] + v[2]), value)
    return scatter(scaled, (rows, columns), (a, b))


@kernel(x=array(SCALAR, "n"), a=SCALAR)
def newton(x, a):
    """A root by Newton's method, times a sum."""
    s = total(lambda v: v, x)
    r, converged, steps = iterate(lambda r: (r + a / r) / 2, 1, lambda old, new: absolute(new - old) < 1e-9, 6)
    return r * s, converged, steps


@kernel(x=array(SCALAR, "n"), a=SCALAR)
def nested(x, a):
    """Loops in an iteration."""

    def step(r):
        return (r + total(lambda v: sqrt(v * v + r * r), scan(lambda c, v: c + v, r, x))) * a

    return iterate(step, 1, lambda old, new: absolute(new - old) < 1e-3, 4)


@kernel(m=array(SCALAR, "n", 2, 2), start=array(SCALAR, 2, 2), parents=index("n"),
        returns=array(SCALAR, "n", 2, 2))  # fmt: skip
def matrices(m, start, parents):
    """Products of matrices along a tree."""

    def product(a, b):
        return tuple(tuple(sum(a[i][k] * b[k][j] for k in range(2)) for j in range(2)) for i in range(2))

    return scan(product, start, m, parents=parents)


KERNELS = (forward, squares, tree, suffixes, kept, chain, picked, dense, newton, nested, matrices)
NAMES = tuple(k.name for k in KERNELS)


@cache
def sources() -> dict[str, LoopSource]:
    """The examples compiled, by name."""
    found = {}
    for each_kernel in KERNELS:
        compiled = compile_loops(each_kernel)
        layouts = []
        for parameter in each_kernel.parameters:
            layout = getattr(parameter.type, "layout", parameter.type if hasattr(parameter.type, "stored") else None)
            if layout is not None and not layout.is_scalar:
                layouts.append((parameter.name, LayoutText(str(layout), tuple(s.name for s in layout.stored))))
        found[each_kernel.name] = LoopSource(
            compiled.procedure, each_kernel.summary, tuple(layouts), compiled.costs, ("a = a",), "1 ulp, 64 inputs"
        )
    return found


def module_source(name: str = "loops", names: Sequence[str] = NAMES) -> ModuleSource:
    """A module of examples."""
    return ModuleSource(name, "Examples.", "gac", "00", (), tuple(sources()[each] for each in names))


def arguments(
    procedure: Procedure, lengths: Mapping[str, int], rng: np.random.Generator, leading: tuple[int, ...] = ()
) -> dict[str, Any]:
    """Random arguments of a procedure; shared ones have no leading axes."""
    rules = index_rules(procedure)
    found: dict[str, Any] = {}
    for table in procedure.parameters:
        if table.storage is Storage.INDEX:
            (length,) = table.lengths
            rule = rules[table.name]
            least = -1 if "-1" in rule else 0
            last = [k if "earlier" in rule else lengths[table.into] for k in range(lengths[length])]
            found[table.name] = np.array([rng.integers(least, end) for end in last], int)
        else:
            core = (*(lengths[name] for name in table.lengths), *table.shape)
            found[table.name] = rng.uniform(0.5, 1.5, (() if table.shared else leading) + core)
    return found


def expected(procedure: Procedure, lengths: Mapping[str, int], given: Mapping[str, Any]) -> list[Any]:
    """The results of one element by the interpreter, in floats."""
    rows = {}
    for table in procedure.parameters:
        count = math.prod(lengths[name] for name in table.lengths)
        kind = int if table.storage is Storage.INDEX else float
        rows[table.name] = [[kind(x) for x in row] for row in np.reshape(given[table.name], (count, table.size))]
    found = run_procedure(procedure, lengths, rows, lambda value: float(Fraction(value)))
    return [
        np.array(found[table.name], float).reshape((*(lengths[name] for name in table.lengths), *table.shape))
        for table in procedure.results
    ]
