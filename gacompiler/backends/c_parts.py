"""Print what a static library needs besides a module, so that programs link only the parts that they call.

The object file of the functions of single elements is that of the module with ``GAC_ONLY_ELEMENTS``. The functions of
batches have an object file of their own, with private copies of the former. The runtime is compiled in parts, and
copies elements of only those sizes that occur.
"""

from __future__ import annotations

from collections.abc import Sequence

from .c import element_prototypes, wrapped
from .c_batch import span_lines
from .module import ModuleSource


def batches_source(module: ModuleSource) -> str:
    """Print the ``.c`` file that compiles the functions of batches of a module, next to its C file."""
    lines = [
        f"// The functions of batches of {module.name}.c. Functions of single elements are static here: a program that",
        f"// calls only these links the object file of {module.name}.c, compiled with GAC_ONLY_ELEMENTS.",
        "#include <stdint.h>",
    ]
    for other, texts in zip(("F32", "F64"), element_prototypes(module), strict=True):
        lines += [f"#ifndef ONLY_{other}", *wrapped([f"static {text}" for text in texts]), "#endif"]
    return "\n".join([*lines, f'#include "{module.name}.c"', ""])


def sizes_source(modules: Sequence[ModuleSource]) -> str:
    """Print ``gac_sizes.h``, which the runtime includes with ``GAC_OWN_SIZES``."""
    programs = [kernel.program for module in modules for kernel in module.kernels]
    return "\n".join(
        ["// The sizes of the arguments and results of kernels, see gac_runtime.c.", *span_lines(programs), ""]
    )
