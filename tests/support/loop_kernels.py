"""Kernels with loops for the tests of backends, and modules of them."""

from __future__ import annotations

from functools import cache

from gacompiler import SCALAR, absolute, array, cos, index, kernel, sin
from gacompiler.algebra.catalog import PGA3
from gacompiler.backends.module import LoopSource, ModuleSource
from gacompiler.frontend.expression import lift
from gacompiler.frontend.kernel import Kernel
from gacompiler.frontend.loops import accumulate, each, fold, gather, iterate, least, scan, scatter, total
from gacompiler.passes.loops import compile_loops


@kernel(q=array(SCALAR, "n"), axes=array(PGA3.LINE, "n", shared=True), tool=PGA3.MOTOR)
def forward(q, axes, tool):  # type: ignore[no-untyped-def]
    """Pose of the end effector by the product of exponentials."""
    return fold(lambda m, angle, axis: m * (cos(angle / 2) - sin(angle / 2) * axis), 1, q, axes) * tool


@kernel(x=array(SCALAR, "n"))
def squares(x):  # type: ignore[no-untyped-def]
    """The sum of squares."""
    return total(lambda v: v * v, x)


@kernel(moves=array(PGA3.MOTOR, "n"), points=array(PGA3.POINT, "n"))
def chain(moves, points):  # type: ignore[no-untyped-def]
    """The products of motors up to every row, and the last one by which points are moved."""
    poses = scan(lambda m, move: m * move, 1, moves)
    return poses, each(lambda m, p: m * p * ~m, poses, points)


@kernel(x=array(SCALAR, "n"), scale=SCALAR)
def behind(x, scale):  # type: ignore[no-untyped-def]
    """Running sums from the last row to the first, and sums of the rows behind each."""
    suffix = scan(lambda s, v: s + v * scale, scale, x, reverse=True)
    return suffix, accumulate(lambda c, v: c / 2 + v, 0, x), total(lambda v: v, x)


@kernel(x=array(SCALAR, "n"), parents=index("n"), scale=SCALAR)
def tree(x, parents, scale):  # type: ignore[no-untyped-def]
    """Sums along the branches of a tree, and of them towards its root."""
    up = scan(lambda s, v: s + v * (scale * scale + 1), 0, x, parents=parents)
    return up, accumulate(lambda c, v: c + v, 0, up, parents=parents)


@kernel(x=array(SCALAR, "n"), which=index("n", into="m"), y=array(SCALAR, "m"))
def spread(x, which, y):  # type: ignore[no-untyped-def]
    """Products with the rows of another array, added to them, and the least argument."""
    products = each(lambda a, b: a * b, x, gather(y, which))
    score, row = least(lambda a: a, x)
    return scatter(products, which, y), score, row


@kernel(
    values=array(SCALAR, "k"), rows=index("k", into="n"), columns=index("k", into="m"),
    x=array(SCALAR, "n"), y=array(SCALAR, "m")
)  # fmt: skip
def matrix(values, rows, columns, x, y):  # type: ignore[no-untyped-def]
    """A matrix from its entries, of which some are left out."""
    return scatter(each(lambda v, a: v * a, values, gather(x, rows)), (rows, columns), (x, y))


@kernel(a=array(SCALAR, "n"), weights=array(PGA3.DIRECTION, "m", shared=True), which=index("m", into="n"), start=SCALAR)
def shares(a, weights, which, start):  # type: ignore[no-untyped-def]
    """Sums of a table that all elements share, and a product with it."""
    sums = scatter(weights, which, a)
    return each(lambda p, v: p * v, sums, a), total(lambda p: start * p, weights)


@kernel(h=array(SCALAR, "n", 2, 3), v=array(SCALAR, "n", 3), returns=array(SCALAR, "n", 2))
def rows_of_matrices(h, v):  # type: ignore[no-untyped-def]
    """Each matrix times its vector."""
    products = each(
        lambda h, v: tuple(sum((a * b for a, b in zip(row, v, strict=True)), start=lift(0)) for row in h), h, v
    )
    return products


@kernel(x=array(SCALAR, "n"), a=SCALAR)
def newton(x, a):  # type: ignore[no-untyped-def]
    """A root, times a sum, and whether it was found."""
    s = total(lambda v: v, x)
    root, found, steps = iterate(
        lambda r: (r + a / r) / 2, 1, lambda old, new: absolute(new - old) < 1e-9 * absolute(new), 6
    )
    return root * s, found, steps


EXAMPLES = (forward, squares, chain, behind, tree, spread, matrix, shares, rows_of_matrices, newton)


@cache
def loop_source(definition: Kernel) -> LoopSource:
    """A kernel with loops as modules have it."""
    compiled = compile_loops(definition)
    return LoopSource(compiled.procedure, definition.summary, (), compiled.costs)


def loop_module(name: str, *definitions: Kernel) -> ModuleSource:
    """A module of kernels with loops."""
    loops = tuple(map(loop_source, definitions))
    return ModuleSource(name, "Kernels of the tests.", f"gac generate {name}.py", "0" * 64, (), loops)
