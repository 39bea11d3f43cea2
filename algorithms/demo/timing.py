"""Cost of generated kernels: operation counts, times and errors."""

from __future__ import annotations

import importlib
import re
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

N_ELEMENTS = 100_000
"""Batch size for timing kernels."""

_REPEATS = 7
"""A limit on work: the number of repetitions, of which the median is reported."""

MAIN_KERNELS: dict[str, tuple[str, ...]] = {
    "pga3": (
        "motor_product",
        "motor_from_denavit_hartenberg",
        "motor_from_line",
        "motor_to_matrix",
        "motor_from_matrix",
        "motor_exponential",
        "motor_logarithm",
        "move_point",
        "move_line",
        "move_plane",
        "join_points",
        "meet_three_planes",
    ),
    "cga3": ("motor_product", "move_point", "move_sphere", "circle_from_points", "sphere_from_points"),
    "vga3": ("geometric_product", "rotor_product", "rotate_vector"),
    "quaternion": ("product", "rotate_vector", "slerp", "pack_two_sided", "unpack_two_sided"),
    "projective3": ("project_point", "fundamental_matrix_from_cameras", "epipolar_line", "triangulate"),
}
"""The kernels in the table, by module."""


@dataclass(frozen=True, slots=True)
class Cost:
    """The cost of one kernel.

    Attributes
    ----------
    module, kernel : str
    multiplications, additions : int
        Per element.
    others : str
        Divisions, roots, function calls and selections per element.
    nanoseconds : float
        Time per element of a batch in C order: the median of repeated calls after a first call.
    error : str
        The error stated in the docstring of the kernel.
    """

    module: str
    kernel: str
    multiplications: int
    additions: int
    others: str
    nanoseconds: float
    error: str


def costs() -> Iterator[Cost]:
    """Yield the costs of `MAIN_KERNELS` one by one."""
    for module_name, names in MAIN_KERNELS.items():
        module = importlib.import_module(f"generated.{module_name}")
        for name in names:
            yield _cost(module, name)


def backends() -> dict[str, str]:
    """Return the backend of each module: c, numba or arrays."""
    return {name: importlib.import_module(f"generated.{name}").backend for name in MAIN_KERNELS}


def median_time(function: Callable[[], object], repeats: int = _REPEATS) -> float:
    """Return the median time of repeated calls after a first call, in seconds."""
    function()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def _cost(module: ModuleType, name: str) -> Cost:
    kernel: Any = getattr(module, name)
    inputs, outputs = (_shapes(part) for part in kernel.signature.split("->"))
    rng = np.random.default_rng(0)
    arrays = [rng.uniform(0.5, 1.5, (N_ELEMENTS, *shape)) for shape in inputs]
    outs = tuple(np.empty((N_ELEMENTS, *shape)) for shape in outputs)
    seconds = median_time(lambda: kernel(*arrays, out=outs if len(outs) > 1 else outs[0]))
    error = re.search(r"Error: ([0-9.e+-]+ \w+)", re.sub(r"\s+", " ", kernel.__doc__))
    others = [f"{count} {key}" for key, count in kernel.cost.items() if key not in ("mul", "add", "fma") and count]
    return Cost(
        module=module.__name__.rpartition(".")[2],
        kernel=name,
        multiplications=kernel.cost["mul"],
        additions=kernel.cost["add"],
        others=", ".join(others),
        nanoseconds=seconds / N_ELEMENTS * 1e9,
        error=error.group(1) if error else "not stated",
    )


def _shapes(text: str) -> list[tuple[int, ...]]:
    """Return the shapes in one half of a signature such as ``(8),(),(4,4)``."""
    return [tuple(int(length) for length in part.split(",") if length) for part in re.findall(r"\(([^)]*)\)", text)]
