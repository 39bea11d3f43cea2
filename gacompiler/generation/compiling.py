"""Compiling the kernels of a spec."""

from __future__ import annotations

from collections.abc import Callable

from ..backends.module import ModuleSource
from ..passes.pipeline import compile_kernel
from ..passes.record import Compilation
from .sources import source_of
from .spec_files import Spec

Progress = Callable[[str], None]
"""Called with the name of each kernel before it is compiled."""


def compile_kernels(spec: Spec, progress: Progress = lambda name: None) -> list[Compilation]:
    """Compile every kernel of a spec."""
    records = []
    for kernel in spec.kernels:
        progress(f"{spec.name}.{kernel.name}")
        records.append(compile_kernel(kernel))
    return records


def compile_spec(spec: Spec, progress: Progress = lambda name: None) -> ModuleSource:
    """Compile every kernel of a spec, as data for the printers."""
    return source_of(spec, compile_kernels(spec, progress))
