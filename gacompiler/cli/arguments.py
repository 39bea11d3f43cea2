"""Find, compile and print the specs and kernels named by command-line arguments."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path

from ..errors import SpecError
from ..frontend.kernel import Kernel
from ..generation.cache import Cache
from ..generation.checked_in import own_specs
from ..generation.compiling import AnyCompiled, compile_kernels, render_spec, rendered_before
from ..generation.spec_files import Spec, load_spec
from ..generation.workers import each_spec
from ..ir.cost_models import COUNTS
from ..passes.effort import DEFAULT
from .output import progress_bar, searching


def own_modules(names: tuple[str, ...]) -> list[Spec]:
    """Load the specs of the checked-in modules with these names, or of all of them if no name is given."""
    known = {path.stem: path for path in own_specs()}
    unknown = [name for name in names if name not in known]
    if unknown:
        raise SpecError(unknown[0], "no checked-in module of this name", "one of " + " ".join(known))
    return [load_spec(known[name], f"gac generate --all {name}") for name in (names or known)]


def is_own(spec: Spec) -> bool:
    """Whether a spec belongs to a checked-in module."""
    return spec.command.startswith("gac generate --all")


def find_spec(text: str, algebra: str | None = None) -> Spec:
    """Load a spec by its path, or the spec of a checked-in module by its name."""
    if text in {path.stem for path in own_specs()} and not Path(text).is_file():
        return own_modules((text,))[0]
    return load_spec(Path(text), algebra=algebra)


def find_kernel(target: str, algebra: str | None = None) -> Kernel:
    """Find a kernel given as ``SPEC:KERNEL``, or as a script."""
    if target.endswith(".clu"):
        target = f"{target}:{Path(target).stem}"
    if ":" not in target:
        raise SpecError(target, "it names no kernel", "SPEC:KERNEL, such as my_kernels.py:move")
    (kernel,) = find_kernels(target, algebra).kernels
    return kernel


def find_kernels(target: str, algebra: str | None = None) -> Spec:
    """Load a spec, given as in `find_spec`, or with one of its kernels only, given as ``SPEC:KERNEL``."""
    path, colon, name = target.rpartition(":")
    if not colon or Path(target).exists():
        return find_spec(target, algebra)
    spec = find_spec(path, algebra)
    kernels = {kernel.name: kernel for kernel in spec.kernels}
    if name not in kernels:
        raise SpecError(path, f"it defines no kernel {name}", "one of " + " ".join(kernels))
    return replace(spec, kernels=(kernels[name],))


def compiled_kernels(
    spec: Spec, cache: Cache | None, effort: int = DEFAULT, model: str = COUNTS.name, keep_best: bool = False
) -> list[AnyCompiled]:
    """Compile every kernel of a spec, with a progress bar; `model` is the name of a cost model.

    If `keep_best` is true, an interrupt ends searches with their best results so far.
    """
    with progress_bar(len(spec.kernels)) as advance, searching(advance) if keep_best else nullcontext():
        return compile_kernels(spec, advance, cache, effort, model)


def rendered(
    specs: Sequence[Spec],
    jobs: int,
    cache: Cache | None,
    effort: int = DEFAULT,
    model: str = COUNTS.name,
    keep_best: bool = False,
) -> list[dict[str, str]]:
    """Return the files of the module of each spec; modules that are not in the cache are compiled in parallel.

    See `compiled_kernels` for `model` and `keep_best`.
    """
    with (
        progress_bar(sum(len(spec.kernels) for spec in specs)) as advance,
        searching(advance) if keep_best else nullcontext(),
    ):
        files = [rendered_before(spec, cache, effort, model) for spec in specs]
        for spec, known in zip(specs, files, strict=True):
            for kernel in spec.kernels if known is not None else ():
                advance(f"{spec.name}.{kernel.name}")
        missing = [k for k, known in enumerate(files) if known is None]
        render = partial(render_spec, cache=cache, effort=effort, cost=model)
        made = each_spec(render, [specs[k] for k in missing], advance, jobs)
    for k, texts in zip(missing, made, strict=True):
        files[k] = texts
    return [texts for texts in files if texts is not None]
