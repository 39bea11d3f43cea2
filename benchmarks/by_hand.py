"""Compare generated loops with hand-written C; both are called from C on the same arrays."""

from __future__ import annotations

import ctypes
import functools
import importlib
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gacompiler.backends.build import FLAGS, build_module, find_compiler

from .cases import CASES
from .timing import Effort, median_times

Array = np.ndarray

SOURCE = Path(__file__).with_suffix(".c")
SIZES = (992, 100_000, 1_000_000)
QUICK_SIZES = (992,)
KERNELS = (
    ("pga3", "motor_product"),
    ("pga3", "move_point"),
    ("pga3", "move_line"),
    ("pga3", "move_plane"),
    ("pga3", "join_points"),
    ("pga3", "meet_three_planes"),
    ("vga3", "rotate_vector"),
    ("quaternion", "product"),
)
REALS = {"float64": ("double", "f64"), "float32": ("float", "f32")}
"""The name of each type in C, and the suffix of the generated loops for it."""

NATIVE = ("-O3", "-march=native")
"""All optimisations for this machine, except fused multiply-adds, which the generated kernels do not use either."""
WIDTHS = {"the compiler's default": (), "512 bits": ("-mprefer-vector-width=512",)}
"""Vector widths that the hand-written loops are compiled for; the faster result is used."""

_COMPARED = 200
_ULPS = 64
_CACHE_LINE = 64


@dataclass(frozen=True, slots=True)
class HandTimes:
    """Seconds per element for each size, of one kernel in one type.

    Attributes
    ----------
    own, hand : tuple of float
        The generated loop and the faster hand-written one, in Fortran order (structure of arrays).
    interleaved : tuple of float
        The generated loop in C order (array of structures).
    """

    title: str
    kind: str
    own: tuple[float, ...]
    hand: tuple[float, ...]
    interleaved: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Batch:
    """The arguments of a loop: addresses of the arrays, the number of elements, and strides in bytes."""

    arrays: tuple[Array, ...]
    arguments: tuple[Any, Any, Any]


def measure(sizes: Sequence[int], effort: Effort, progress: Callable[[str], None]) -> tuple[HandTimes, ...]:
    """Time every kernel in both types.

    The result is empty if no C compiler accepts the flags, or if the library is not built.

    Raises
    ------
    RuntimeError
        If hand-written code gives a different result.
    """
    found = []
    with tempfile.TemporaryDirectory() as folder:
        libraries = {kind: build(Path(folder), kind) for kind in REALS}
        for module, kernel in KERNELS:
            progress(f"{module}.{kernel} by hand")
            for kind, hands in libraries.items():
                own = own_loop(module, kernel, kind)
                if hands and own is not None:
                    found.append(_measure(module, kernel, kind, own, hands, sizes, effort))
    return tuple(found)


def build(folder: Path, kind: str) -> tuple[ctypes.CDLL, ...]:
    """Compile the hand-written loops for one type, once for each vector width that the compiler supports."""
    compiler = find_compiler()
    if compiler is None:
        return ()
    built = []
    for k, width in enumerate(WIDTHS.values()):
        target = folder / f"by_hand-{kind}-{k}.so"
        flags = (*FLAGS, *NATIVE, *width, f"-DREAL={REALS[kind][0]}", "-shared")
        if subprocess.run([*compiler, *flags, str(SOURCE), "-o", str(target)], capture_output=True).returncode == 0:
            built.append(ctypes.CDLL(str(target)))
    return tuple(built)


def own_loop(module: str, kernel: str, kind: str) -> Any:
    """Return the loop of a generated module, or None if its library cannot be built."""
    file = importlib.import_module(f"generated.{module}").__file__
    assert file is not None
    path = build_module(Path(file).with_suffix(".c"), REALS[kind][1])
    if path is None:
        return None
    return getattr(ctypes.CDLL(str(path)), f"{module}_{kernel}_loop_{REALS[kind][1]}")


def batch(inputs: Sequence[Array], result: Array, kind: str, order: str) -> Batch:
    """Return the inputs and an array for the result, in one type and order, aligned to cache lines."""
    arrays = tuple(_aligned(array, kind, order) for array in (*inputs, result))
    steps = [array.strides[0] for array in arrays] + [array.strides[1] for array in arrays]
    addresses = [array.ctypes.data for array in arrays]
    numbers = (ctypes.c_ssize_t * 1)(len(result)), (ctypes.c_ssize_t * len(steps))(*steps)
    return Batch(arrays, ((ctypes.c_void_p * len(addresses))(*addresses), *numbers))


def _aligned(array: Array, kind: str, order: str) -> Array:
    size = array.size * np.dtype(kind).itemsize
    room = np.empty(size + _CACHE_LINE, np.uint8)
    first = -room.ctypes.data % _CACHE_LINE
    aligned: Array = np.ndarray(array.shape, kind, room[first : first + size], order=order)
    aligned[...] = array
    return aligned


def _measure(
    module: str,
    name: str,
    kind: str,
    own: Any,
    hands: Sequence[ctypes.CDLL],
    sizes: Sequence[int],
    effort: Effort,
) -> HandTimes:
    case = next(case for case in CASES if (case.module, case.kernel, case.note) == (module, name, ""))
    kernel = getattr(importlib.import_module(f"generated.{module}"), name)
    loops = [getattr(hand, f"{module}_{name}") for hand in hands]
    inputs = case.arguments(np.random.default_rng(0), (_COMPARED,))
    expected = kernel(*inputs)
    for loop in (own, *loops):
        given = batch(inputs, np.full_like(expected, np.nan), kind, "F")
        loop(*given.arguments)
        _compare(f"{module}.{name}", given.arrays[-1], expected)
    rows = []
    for size in sizes:
        inputs = case.arguments(np.random.default_rng(size), (size,))
        blank = np.zeros((size, expected.shape[1]))
        rows_of, dense = (batch(inputs, blank, kind, order) for order in "FC")
        calls = {"own": (own, rows_of), "interleaved": (own, dense)}
        calls |= {f"hand {k}": (loop, rows_of) for k, loop in enumerate(loops)}
        rows.append(_times(hands[0].repeat, calls, effort, size))
    own_times, dense_times = (tuple(row[key] for row in rows) for key in ("own", "interleaved"))
    hand_times = tuple(min(spent for key, spent in row.items() if key.startswith("hand")) for row in rows)
    return HandTimes(f"{module}.{name}", kind, own_times, hand_times, dense_times)


def _times(repeat: Any, calls: dict[str, tuple[Any, Batch]], effort: Effort, size: int) -> dict[str, float]:
    """Return the seconds per element. One call from Python covers so many elements that its cost is negligible."""
    times = max(1, 100_000 // size)
    prepared = {
        key: functools.partial(repeat, loop, *given.arguments, ctypes.c_ssize_t(times))
        for key, (loop, given) in calls.items()
    }
    return {key: spent / (times * size) for key, spent in median_times(prepared, effort).items()}


def _compare(title: str, found: Array, expected: Array) -> None:
    limit = _ULPS * np.finfo(found.dtype).eps * np.abs(expected).max()
    error = np.abs(found - expected).max()
    if not error <= limit:
        raise RuntimeError(f"{title}: the error of hand-written C is {error:.1e}; expected at most {limit:.1e}")
