"""Compile kernels and print their modules, with a cache.

A compiled kernel is cached under its description and the sources of the compiler; a printed module, under its kernels
and the sources of the printers as well. Only proved results are cached.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..backends.module import ModuleSource
from ..errors import GacError
from ..frontend.kernel import Kernel
from ..ir.cost_models import COUNTS
from ..passes.collection import rare_collection
from ..passes.effort import DEFAULT
from ..passes.inference import traced_loops
from ..passes.interruption import is_interrupted
from ..passes.loops import compile_loops
from ..passes.pipeline import compile_kernel
from .cache import Cache, key_of
from .compiled import Compiled, CompiledLoops
from .fingerprint import PROGRAM_SOURCES, TEXT_SOURCES, fingerprint
from .kernel_key import NotDescribed, description_of
from .plain import packed, unpacked
from .plain_loops import packed_loops, unpacked_loops
from .rendering import render
from .spec_files import Spec

Progress = Callable[[str], None]
"""Called with the name of each kernel before it is compiled."""


AnyCompiled = Compiled | CompiledLoops

Keys = Sequence[str | None]
"""Cache keys of the kernels of a spec; None for kernels that cannot be cached."""


def compile_definition(
    kernel: Kernel, cache: Cache | None = None, effort: int = DEFAULT, cost: str = COUNTS.name
) -> Compiled:
    """Compile a kernel, or return the cached result."""
    return _compiled(kernel, _kernel_key(kernel, effort, cost) if cache else None, cache, effort, cost)


@rare_collection()
def compile_kernels(
    spec: Spec,
    progress: Progress = lambda name: None,
    cache: Cache | None = None,
    effort: int = DEFAULT,
    cost: str = COUNTS.name,
) -> list[AnyCompiled]:
    """Compile every kernel of a spec, or return the cached results."""
    return _all_compiled(spec, _keys(spec, cache, effort, cost), progress, cache, effort, cost)


def source_of(spec: Spec, compiled: Sequence[Compiled | CompiledLoops]) -> ModuleSource:
    """Collect the data that the printers need from the compiled kernels of a spec."""
    kernels = tuple(each.source for each in compiled if isinstance(each, Compiled))
    loops = tuple(each.source for each in compiled if isinstance(each, CompiledLoops))
    return ModuleSource(spec.name, spec.summary, spec.command, spec.digest, kernels, loops)


def compile_spec(
    spec: Spec,
    progress: Progress = lambda name: None,
    cache: Cache | None = None,
    effort: int = DEFAULT,
    cost: str = COUNTS.name,
) -> ModuleSource:
    """Compile every kernel of a spec and return the data for the printers."""
    return source_of(spec, compile_kernels(spec, progress, cache, effort, cost))


@rare_collection()
def render_spec(
    spec: Spec,
    progress: Progress = lambda name: None,
    cache: Cache | None = None,
    effort: int = DEFAULT,
    cost: str = COUNTS.name,
) -> dict[str, str]:
    """Compile every kernel of a spec, and return the texts of the files of its module by name."""
    keys = _keys(spec, cache, effort, cost)
    text_key = _text_key(spec, keys)
    known = _known_text(spec, text_key, cache)
    if known is not None:
        for kernel in spec.kernels:
            progress(f"{spec.name}.{kernel.name}")
        return known
    files = render(source_of(spec, _all_compiled(spec, keys, progress, cache, effort, cost)))
    if cache and text_key and not is_interrupted():
        cache.put(text_key, files)
    return files


def rendered_before(
    spec: Spec, cache: Cache | None, effort: int = DEFAULT, cost: str = COUNTS.name
) -> dict[str, str] | None:
    """Return the files of a spec's module if they are cached, else None; nothing is compiled.

    None is also returned for specs with loops, whose kernels take seconds to trace. `render_spec`, which may run in
    another process, traces them once and finds cached files as well.
    """
    if any(kernel.has_loops for kernel in spec.kernels):
        return None
    return _known_text(spec, _text_key(spec, _keys(spec, cache, effort, cost)), cache)


def _all_compiled(
    spec: Spec, keys: Keys, progress: Progress, cache: Cache | None, effort: int, cost: str
) -> list[AnyCompiled]:
    found: list[AnyCompiled] = []
    for kernel, key in zip(spec.kernels, keys, strict=True):
        progress(f"{spec.name}.{kernel.name}")
        compile_one = _loops_compiled if kernel.has_loops else _compiled
        found.append(compile_one(kernel, key, cache, effort, cost))
    return found


def _compiled(kernel: Kernel, key: str | None, cache: Cache | None, effort: int, cost: str) -> Compiled:
    known = cache.get(key) if cache and key else None
    if known is not None:
        try:
            return unpacked(kernel, known)
        except (GacError, LookupError, TypeError, ValueError):
            pass  # the entry is not a valid kernel: compile it again
    compiled = Compiled.of(compile_kernel(kernel, effort=effort, cost=cost))
    if cache and key and not is_interrupted():
        cache.put(key, packed(compiled))
    return compiled


def _loops_compiled(kernel: Kernel, key: str | None, cache: Cache | None, effort: int, cost: str) -> CompiledLoops:
    traced = traced_loops(kernel)
    known = cache.get(key) if cache and key else None
    if known is not None:
        try:
            return unpacked_loops(kernel, traced, known)
        except (GacError, LookupError, TypeError, ValueError):
            pass  # the entry is not a valid kernel: compile it again
    compiled = CompiledLoops.of(compile_loops(kernel, traced, effort, cost))
    if cache and key and not is_interrupted():
        cache.put(key, packed_loops(compiled))
    return compiled


def _keys(spec: Spec, cache: Cache | None, effort: int, cost: str) -> Keys:
    return [_kernel_key(kernel, effort, cost) if cache else None for kernel in spec.kernels]


def _kernel_key(kernel: Kernel, effort: int, cost: str) -> str | None:
    compiler = fingerprint(PROGRAM_SOURCES)
    if compiler is None:
        return None
    try:
        kind = "procedure" if kernel.has_loops else "program"
        return key_of(kind, compiler, f"effort {effort}", f"cost {cost}", description_of(kernel))
    except (GacError, NotDescribed):
        return None  # if the kernel is invalid, compiling it reports the error


def _text_key(spec: Spec, keys: Keys) -> str | None:
    printers = fingerprint(TEXT_SOURCES)
    if printers is None or None in keys:
        return None
    return key_of("text", printers, spec.name, spec.summary, spec.command, spec.digest, *filter(None, keys))


def _known_text(spec: Spec, key: str | None, cache: Cache | None) -> dict[str, str] | None:
    found = cache.get(key) if cache and key else None
    names = {f"{spec.name}.{ending}" for ending in ("py", "pyi", "c", "h")}
    is_whole = isinstance(found, dict) and found.keys() == names and all(isinstance(x, str) for x in found.values())
    return found if is_whole else None
