"""Describe the machine, and measure its limits."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gacompiler.backends.build import FLAGS, compiler_flags, find_compiler

from .timing import Effort, seconds

PACKAGES = ("numpy", "numba", "scipy", "kingdon", "clifford", "pytransform3d", "numpy-quaternion", "pin")
"""Packages whose versions affect the results."""

IN_CACHE = 128 << 10
OUT_OF_CACHE = 256 << 20
"""Sizes of the copied arrays in bytes."""


@dataclass(frozen=True, slots=True)
class Machine:
    """A machine, and its limits on one thread.

    Attributes
    ----------
    facts : tuple of (str, str)
        Properties of hardware and software, in the order of the page.
    copy_cached, copy_memory : float
        Bytes per second that ``numpy.copyto`` reads and writes, in cache and from memory.
    peak : float
        Operations per second of the matrix product of numpy in float64.
    """

    facts: tuple[tuple[str, str], ...]
    copy_cached: float
    copy_memory: float
    peak: float


def machine(effort: Effort, quick: bool) -> Machine:
    """Return the properties of this machine, and measure its limits."""
    memory = 8 << 20 if quick else OUT_OF_CACHE
    cached, uncached = _copy(IN_CACHE, effort), _copy(memory, effort)
    peak = _peak(128 if quick else 768, effort)
    facts = (
        ("processor", processor()),
        ("processors, one of which is used", str(_n_processors())),
        ("system", f"{platform.system()} {platform.machine()}"),
        ("C compiler", _compiler()),
        ("flags", " ".join(compiler_flags(compiler) if (compiler := find_compiler()) else FLAGS)),
        ("Python", platform.python_version()),
        *((name, version(name) or "not installed") for name in PACKAGES),
        (f"copy, {IN_CACHE >> 10} KiB", f"{cached / 1e9:.1f} GB/s read and written"),
        (f"copy, {memory >> 20} MiB", f"{uncached / 1e9:.1f} GB/s read and written"),
        ("matrix product, float64", f"{peak / 1e9:.1f} GFLOP/s"),
    )
    return Machine(facts, cached, uncached, peak)


def version(package: str) -> str | None:
    """Return the installed version of a package, or None if it is not installed."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _n_processors() -> int:
    return os.cpu_count() or 1


def processor() -> str:
    """Return the name of the processor."""
    table = Path("/proc/cpuinfo")
    if table.is_file():
        for line in table.read_text().splitlines():
            name, _, value = line.partition(":")
            if name.strip() in ("model name", "Model", "Processor"):
                return value.strip()
    return platform.processor() or platform.machine()


def _compiler() -> str:
    command = find_compiler()
    if command is None:
        return "none (kernels run on numba)"
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, errors="replace")
    return done.stdout.partition("\n")[0].strip() or " ".join(command)


def _copy(size: int, effort: Effort) -> float:
    """Return the bytes per second that are read and written when arrays of `size` bytes are copied."""
    source, target = np.ones(size // 8), np.zeros(size // 8)
    return 2 * size / seconds(lambda: np.copyto(target, source), effort)


def _peak(n: int, effort: Effort) -> float:
    a, b, c = np.ones((n, n)), np.ones((n, n)), np.empty((n, n))
    return 2 * n**3 / seconds(lambda: np.matmul(a, b, out=c), effort)
