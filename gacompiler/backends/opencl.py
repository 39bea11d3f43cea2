"""Print modules as OpenCL C 1.2: functions of one element and batch kernels, in a precision chosen at build time."""

from __future__ import annotations

from ..ir.scalar import Rational
from .device_loops import LoopDialect, element_functions, function_lines, loop_batch, window_functions
from .devices import C_WORDS, Grid, batch, c_operations, element
from .module import LoopSource, ModuleSource
from .printers import number
from .target_loops import LoopNames, loop_comment, loop_names
from .targets import (
    Language,
    LanguageNames,
    about_loops,
    comment,
    function,
    function_names,
    joined,
    render_target,
)

_POLICY = "contraction: #pragma OPENCL FP_CONTRACT OFF (every operation is rounded once)"
_GRID = Grid("REAL", "__global REAL", "long", "get_global_id(0)", "get_global_size(0)")
_VECTORS = ("char", "uchar", "short", "ushort", "int", "uint", "long", "ulong", "half", "float", "double")


def _number(value: Rational) -> str:
    return f"(REAL){number(value)}"


OPENCL = Language(
    operations=c_operations("REAL"),
    declaration="const REAL {0} = {1};",
    number=_number,
    # Names of vectors, images and address spaces are types and keywords in OpenCL; variables would hide functions.
    reserved=C_WORDS
    | frozenset(
        """
        REAL sqrt sin cos atan2 acos exp log fabs floor
        kernel global local constant private generic pipe uniform half quad complex imaginary uchar ushort uint ulong
        size_t ptrdiff_t event_t sampler_t queue_t ndrange_t clk_event_t reserve_id_t cl_mem_fence_flags
        read_only write_only read_write vec_step as_double as_float get_global_id get_global_size
        image1d_t image1d_array_t image1d_buffer_t image2d_t image2d_array_t image3d_t
        """.split()  # noqa: SIM905
    )
    | {f"{kind}{n}" for kind in _VECTORS for n in (2, 3, 4, 8, 16)},
)


_LOOPS = LoopDialect(OPENCL, _GRID, "OpenCL", "void", "", "__global long")
_ABOUT_LOOPS = """
Kernels with loops take the lengths of their tables first. The rows of a table are contiguous; its
strides are to the table of the next element and to the next number. Index tables are shared by all elements and
are not checked. Results and work space must not overlap other arrays. The size of the work space for each work
item, in numbers, is given in the comment of the kernel and does not depend on the number of elements; its strides
are to the space of the next work item and to the next number.
"""


def opencl_source(module: ModuleSource) -> str:
    """Print the ``.cl`` file of a module. Numbers are double unless the program is built with ``-D REAL=float``."""
    kernels, loops = [], window_functions((loop.procedure for loop in module.loops), _LOOPS)
    wanted = [kernel.program.name for kernel in module.kernels] + [loop.procedure.name for loop in module.loops]
    file_names = LanguageNames(OPENCL)
    names = function_names([f"{module.name}_{name}" for name in wanted], file_names, "_batch")
    for kernel, (name, over_batch) in zip(module.kernels, names, strict=False):
        printed = function(kernel.program, OPENCL)
        kernels.append(
            {
                "comment": comment(kernel),
                "name": name,
                "element": element(printed, "REAL"),
                "batch_name": over_batch,
                "batch": batch(printed, OPENCL, name, _GRID),
            }
        )
    for source, (name, over_batch) in zip(module.loops, names[len(module.kernels) :], strict=True):
        its_names = loop_names(source.procedure, name, file_names, f"{module.name}_")
        loops.append(_loop_text(source, its_names, file_names.fresh(f"{name}_strided"), over_batch))
    return render_target(
        "opencl.cl.jinja",
        module,
        _POLICY,
        kernels=kernels,
        loops=loops,
        about_loops=about_loops(module, _ABOUT_LOOPS),
    )


def _loop_text(loop: LoopSource, names: LoopNames, strided: str, over_batch: str) -> str:
    """Print the functions of a kernel with loops."""
    *inner, own = element_functions(loop, names, strided, _LOOPS)
    over_elements = loop_batch(loop, names, strided, _LOOPS)
    batch_lines = function_lines(f"__kernel void {over_batch}", over_elements.declared("REAL"), over_elements.lines)
    return joined([*inner, [*loop_comment(loop).split("\n"), *own], batch_lines])
