"""The specs and kernels that arguments of commands name."""

from __future__ import annotations

from pathlib import Path

from ..errors import SpecError
from ..frontend.kernel import Kernel
from ..generation.checked_in import own_specs
from ..generation.compiling import compile_kernels
from ..generation.spec_files import Spec, load_spec
from ..passes.record import Compilation
from .output import progress_bar


def own_modules(names: tuple[str, ...]) -> list[Spec]:
    """The specs of checked-in modules by their names; of all of them where none is named."""
    known = {path.stem: path for path in own_specs()}
    unknown = [name for name in names if name not in known]
    if unknown:
        raise SpecError(unknown[0], "no such module", "one of " + " ".join(known))
    return [load_spec(known[name], f"gac generate --all {name}") for name in (names or known)]


def is_own(spec: Spec) -> bool:
    """Whether a spec is that of a checked-in module."""
    return spec.command.startswith("gac generate --all")


def find_spec(text: str, algebra: str | None = None) -> Spec:
    """A spec by path, or a checked-in module by name."""
    if text in {path.stem for path in own_specs()} and not Path(text).is_file():
        return own_modules((text,))[0]
    return load_spec(Path(text), algebra=algebra)


def find_kernel(target: str, algebra: str | None = None) -> Kernel:
    """A kernel as ``SPEC:KERNEL``, or a script."""
    if target.endswith(".clu"):
        target = f"{target}:{Path(target).stem}"
    path, colon, name = target.rpartition(":")
    if not colon:
        raise SpecError(target, "no kernel named", "SPEC:KERNEL, such as my_kernels.py:move_point")
    kernels = {kernel.name: kernel for kernel in find_spec(path, algebra).kernels}
    if name not in kernels:
        raise SpecError(path, f"no kernel {name}", "one of " + " ".join(kernels))
    return kernels[name]


def compiled_kernels(spec: Spec) -> list[Compilation]:
    """Every kernel of a spec, compiled."""
    with progress_bar(len(spec.kernels)) as advance:
        return compile_kernels(spec, advance)
