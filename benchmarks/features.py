"""Measure the effect of fusion, threads, calls on one element, and uniform arguments."""

from __future__ import annotations

import functools
import importlib
import os
import timeit
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import gacompiler
from gacompiler import kernel
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs import pga3 as spec
from generated import pga3

from . import libraries
from .affinity import on_processors
from .cases import CASES
from .kernels import ORDERS, ready
from .timing import Call, Effort, median_times

Array = np.ndarray
Calls = dict[str, Call]

FUSED_SIZES = (1_000, 100_000, 1_000_000)
SIZES = (100_000, 1_000_000)
QUICK_SIZES = (100,)

THREADED = ("move_point", "motor_product", "motor_exponential")
MOVED = {"move_point": 3, "move_line": 6, "move_plane": 4}
"""Kernels that are called with a uniform motor and with one motor per element, and the size of what they move."""


@kernel(a=PGA3.MOTOR, b=PGA3.MOTOR, p=PGA3.POINT, q=PGA3.POINT)
def join_to_moved(a, b, p, q):
    """Return the line to `q` from the point `p` moved by `b` and then by `a`."""
    return spec.join_points(spec.move_point(spec.motor_product(a, b), p), q)


@dataclass(frozen=True, slots=True)
class Compared:
    """The times of several calls with the same result.

    Attributes
    ----------
    title : str
        Name of the computation.
    size : int
        Number of elements; with 1, the arrays have no leading axis.
    order : str
        Memory order of all arrays: C or F.
    times : dict of str to float
        Seconds per element by the name of the call.
    peers : tuple of str
        Names of the calls of other libraries.
    """

    title: str
    size: int
    order: str
    times: dict[str, float]
    peers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Features:
    """All comparisons, in the order of the page."""

    fusion: tuple[Compared, ...]
    threads: tuple[Compared, ...]
    n_processors: int
    one_call: tuple[Compared, ...]
    uniform: tuple[Compared, ...]


def measure(effort: Effort, quick: bool, processors: Collection[int], progress: Callable[[str], None]) -> Features:
    """Measure all comparisons.

    Parameters
    ----------
    effort : Effort
    quick : bool
        Whether to use few elements.
    processors : collection of int
        The processors that threads may use; empty if the system does not report them.
    progress : function of str
        Called with the name of the next step.
    """
    progress("fusion")
    fused = fusion(QUICK_SIZES if quick else FUSED_SIZES, effort)
    progress("threads")
    with on_processors(processors):
        shared = threads(QUICK_SIZES if quick else SIZES, effort)
    progress("one call")
    single = one_call(effort)
    progress("uniform motor")
    uniform = uniform_motor(QUICK_SIZES if quick else SIZES, effort)
    return Features(fused, shared, len(processors) or os.cpu_count() or 1, single, uniform)


def fusion(sizes: Sequence[int], effort: Effort) -> tuple[Compared, ...]:
    """Compare a motor product, a moved point and a join by three kernels with one fused kernel."""
    whole = gacompiler.compile(join_to_moved)
    found = []
    for size in sizes:
        for order in ORDERS:
            a, b, p, q = (np.array(x, order=order) for x in _chain(size))
            m, moved, line, fused = (np.empty((size, n), order=order) for n in (8, 3, 6, 6))

            def with_out(a: Any = a, b: Any = b, p: Any = p, q: Any = q, outs: Any = (m, moved, line)) -> None:
                m, moved, line = outs
                pga3.motor_product(a, b, out=m)
                pga3.move_point(m, p, out=moved)
                pga3.join_points(moved, q, out=line)

            def plain(a: Any = a, b: Any = b, p: Any = p, q: Any = q) -> Array:
                return pga3.join_points(pga3.move_point(pga3.motor_product(a, b), p), q)

            def one(x: Any = (a, b, p, q), out: Any = fused) -> None:
                whole(*x, out=out)

            with_out()
            one()
            _agree("the fused kernel", fused, line)
            calls: Calls = {"three": plain, "three, out=": with_out, "fused, out=": one}
            found.append(_compared("motor product, moved point, join", size, order, calls, effort))
    return tuple(found)


def _chain(size: int) -> tuple[Array, Array, Array, Array]:
    rng = np.random.default_rng(size)
    a, b = (pga3.motor_exponential(0.4 * rng.normal(size=(size, 6))) for _ in range(2))
    return a, b, rng.normal(size=(size, 3)), rng.normal(size=(size, 3))


def threads(sizes: Sequence[int], effort: Effort) -> tuple[Compared, ...]:
    """Compare one thread with two, in Fortran order."""
    found = []
    for name in THREADED:
        case = next(case for case in CASES if (case.module, case.kernel, case.note) == ("pga3", name, ""))
        for size in sizes:
            arrays = case.arguments(np.random.default_rng(size), (size,))
            calls = {
                str(n): ready(functools.partial(getattr(pga3, name), num_threads=n), arrays, "F")[0] for n in (1, 2)
            }
            found.append(_compared(case.title, size, "F", calls, effort))
    return tuple(found)


def one_call(effort: Effort) -> tuple[Compared, ...]:
    """Time the product of two motors, and a moved point, for one element each, as statements without call overhead."""
    rng = np.random.default_rng(0)
    a, b = (pga3.motor_exponential(0.4 * rng.normal(size=6)) for _ in range(2))
    p, motor_out, point_out = rng.normal(size=3), np.empty(8), np.empty(3)
    m, n, point = pga3.Motor(*a), pga3.Motor(*b), pga3.Point(*p)
    first, second = pga3.motor_to_matrix(a), pga3.motor_to_matrix(b)
    turn, shift, matrix_out = first[:3, :3].copy(), first[:3, 3].copy(), np.empty((4, 4))
    names = dict(locals(), pga3=pga3, np=np)

    def statement(text: str) -> timeit.Timer:
        return timeit.Timer(text, globals=names)

    own: tuple[Calls, Calls] = (
        {
            "`motor * motor`": statement("m * n"),
            "`motor_product(a, b, out=out)`": statement("pga3.motor_product(a, b, out=motor_out)"),
            "`motor_product(a, b)`": statement("pga3.motor_product(a, b)"),
        },
        {
            "`motor(point)`": statement("m(point)"),
            "`move_point(m, p, out=out)`": statement("pga3.move_point(a, p, out=point_out)"),
            "`move_point(m, p)`": statement("pga3.move_point(a, p)"),
        },
    )
    products: Calls = {
        "numpy, 4 × 4 `matmul(a, b, out=out)`": statement("np.matmul(first, second, out=matrix_out)"),
        "numpy, 4 × 4 `a @ b`": statement("first @ second"),
    }
    moves: Calls = {"numpy, `turn @ p + shift`": statement("turn @ p + shift")}
    for name, (library, _) in libraries.LIBRARIES.items():
        if libraries.installed(name):
            products[f"{name}, `a * b`"] = library(pga3.motor_product, "pga3", "product", (a, b)).run
            moves[f"{name}, `m p ~m`"] = library(pga3.move_point, "pga3", "sandwich", (a, p)).run
    if libraries.installed("pin"):
        pin: Any = importlib.import_module("pinocchio")
        names |= {"left": pin.SE3(first), "right": pin.SE3(second)}
        products["pin, `SE3 * SE3`"] = statement("left * right")
        moves["pin, `SE3.act(p)`"] = statement("left.act(p)")
    return tuple(
        Compared(title, 1, "C", median_times({**ours, **theirs}, effort), tuple(theirs))
        for title, ours, theirs in zip(("motor product", "moved point"), own, (products, moves), strict=True)
    )


def uniform_motor(sizes: Sequence[int], effort: Effort) -> tuple[Compared, ...]:
    """Compare a uniform motor with one motor per element, in both orders."""
    found = []
    for name, n_coefficients in MOVED.items():
        for size in sizes:
            rng = np.random.default_rng(size)
            motors, x = (
                pga3.motor_exponential(0.4 * rng.normal(size=(size, 6))),
                rng.normal(size=(size, n_coefficients)),
            )
            for order in ORDERS:
                variants = {"each": motors, "one": motors[0]}
                calls = {key: ready(getattr(pga3, name), (motor, x), order)[0] for key, motor in variants.items()}
                found.append(_compared(f"pga3.{name}", size, order, calls, effort))
    return tuple(found)


def _agree(title: str, found: Any, expected: Any) -> None:
    if not np.allclose(found, expected, rtol=1e-9, atol=1e-9):
        raise RuntimeError(
            f"{title}: gives a different result; largest difference {np.abs(found - expected).max():.1e}"
        )


def _compared(title: str, size: int, order: str, calls: Calls, effort: Effort) -> Compared:
    times = {name: spent / size for name, spent in median_times(calls, effort).items()}
    return Compared(title, size, order, times)
