"""Print modules as the texts of their files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from ..backends import (
    c_header,
    c_source,
    python_source,
    python_stub,
    standalone_c_source,
    standalone_python_source,
)
from ..backends.cuda import cuda_source
from ..backends.header import header_source
from ..backends.javascript import javascript_source
from ..backends.module import ModuleSource
from ..backends.opencl import opencl_source
from ..backends.rust import rust_source
from ..backends.triton import triton_source

TARGETS: Mapping[str, tuple[str, Callable[[ModuleSource], str]]] = {
    "rust": (".rs", rust_source),
    "javascript": (".mjs", javascript_source),
    "cuda": (".cu", cuda_source),
    "opencl": (".cl", opencl_source),
    "triton": ("_triton.py", triton_source),
}
"""Languages other than C and Python: the end of the file name and the printer."""
WITHOUT_LOOPS = frozenset({"triton"})
"""Languages for which kernels with loops are left out."""


def render(module: ModuleSource) -> dict[str, str]:
    """Return the texts of the files of a module by name."""
    return {
        f"{module.name}.py": python_source(module),
        f"{module.name}.pyi": python_stub(module),
        f"{module.name}.c": c_source(module),
        f"{module.name}.h": c_header(module),
    }


def render_standalone(module: ModuleSource) -> dict[str, str]:
    """Return the texts of the files of a module that includes the runtime, and of its C header, by name."""
    alone = replace(module, command=f"{module.command} --standalone")
    return {
        f"{module.name}.py": standalone_python_source(alone),
        f"{module.name}.c": standalone_c_source(alone),
        f"{module.name}.h": c_header(alone),
    }


def render_header(module: ModuleSource) -> dict[str, str]:
    """Return the text of the header that contains a module's functions of one element, by its name."""
    return {f"{module.name}_inline.h": header_source(replace(module, command=f"{module.command} --header-only"))}


def render_targets(module: ModuleSource, targets: Iterable[str]) -> dict[str, str]:
    """Return the texts of the files of a module in other languages, some of `TARGETS`, by name."""
    files = {}
    for target in targets:
        ending, source = TARGETS[target]
        files[f"{module.name}{ending}"] = source(replace(module, command=f"{module.command} --target {target}"))
    return files
