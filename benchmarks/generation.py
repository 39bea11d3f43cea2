"""Measure the time to generate each kernel of every spec, and each module."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from gacompiler.backends.module import ModuleSource
from gacompiler.generation.checked_in import own_specs
from gacompiler.generation.rendering import render
from gacompiler.generation.sources import kernel_source
from gacompiler.generation.spec_files import load_spec
from gacompiler.passes.pipeline import compile_kernel

QUICK_MODULES = ("vga2",)
"""Modules that a quick run generates."""


@dataclass(frozen=True, slots=True)
class KernelTime:
    """Times in seconds to compile and prove one kernel, and to measure its rounding error."""

    module: str
    kernel: str
    compiling: float
    rounding: float

    @property
    def total(self) -> float:
        """The sum of both times."""
        return self.compiling + self.rounding


@dataclass(frozen=True, slots=True)
class ModuleTime:
    """Time in seconds to generate one module, including printing."""

    module: str
    n_kernels: int
    total: float


@dataclass(frozen=True, slots=True)
class Generation:
    """The times of all kernels and modules."""

    kernels: tuple[KernelTime, ...]
    modules: tuple[ModuleTime, ...]

    @property
    def median(self) -> float:
        """The median time of a kernel in seconds."""
        return statistics.median(time.total for time in self.kernels)

    @property
    def slowest(self) -> tuple[KernelTime, ...]:
        """The ten slowest kernels, slowest first."""
        return tuple(sorted(self.kernels, key=lambda time: (-time.total, time.module, time.kernel))[:10])

    def above(self, limit: float) -> int:
        """Return the number of kernels that took longer than `limit` seconds."""
        return sum(time.total > limit for time in self.kernels)


def specs(quick: bool) -> list[Path]:
    """Return the spec files that are generated."""
    return [path for path in own_specs() if not quick or path.stem in QUICK_MODULES]


def generation(paths: Iterable[Path], progress: Callable[[str], None]) -> Generation:
    """Generate every kernel of these specs once, as ``gac generate`` does; `progress` is called with each name."""
    kernels, modules = [], []
    for path in paths:
        begin = time.perf_counter()
        spec = load_spec(path)
        sources = []
        for kernel in spec.kernels:
            progress(f"{spec.name}.{kernel.name}")
            start = time.perf_counter()
            record = compile_kernel(kernel)
            compiled = time.perf_counter()
            sources.append(kernel_source(record))
            done = time.perf_counter()
            kernels.append(KernelTime(spec.name, kernel.name, compiled - start, done - compiled))
        render(ModuleSource(spec.name, spec.summary, spec.command, spec.digest, tuple(sources)))
        modules.append(ModuleTime(spec.name, len(sources), time.perf_counter() - begin))
    return Generation(tuple(kernels), tuple(modules))
