"""Print modules as CUDA C++: functions of one element for any real type, and batch kernels in double and float.

The text has no include directives. It uses the functions of ``<math.h>`` by their global names, which nvcc provides.
"""

from __future__ import annotations

from ..ir.scalar import Op, Rational
from .device_loops import LoopDialect, element_functions, function_lines, loop_batch, window_functions
from .devices import ARITHMETIC, C_WORDS, Grid, batch, element
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

_POLICY = "contraction: -fmad=false, on the host -ffp-contract=off (every operation is rounded once)"
_PRECISIONS = (("double", "f64"), ("float", "f32"))
_GRID = Grid(
    "real",
    "{real}",
    "long long",
    "(long long)blockIdx.x * blockDim.x + threadIdx.x",
    "(long long)gridDim.x * blockDim.x",
)


def _number(value: Rational) -> str:
    return f"real({number(value).removeprefix('(').removesuffix(')')})"


CUDA = Language(
    # Functions are called by their global names, so that a kernel may have the same name.
    operations={
        **ARITHMETIC,
        Op.SQRT: "::sqrt({0})",
        Op.SIN: "::sin({0})",
        Op.COS: "::cos({0})",
        Op.ATAN2: "::atan2({0}, {1})",
        Op.ACOS: "::acos({0})",
        Op.EXP: "::exp({0})",
        Op.LOG: "::log({0})",
        Op.ABS: "::fabs({0})",
        Op.FLOOR: "::floor({0})",
        Op.LESS: "real({0} < {1})",
        Op.LESS_EQUAL: "real({0} <= {1})",
        Op.EQUAL: "real({0} == {1})",
        Op.SELECT: "{0} != 0 ? {1} : {2}",
    },
    declaration="const real {0} = {1};",
    number=_number,
    reserved=C_WORDS
    | frozenset(
        """
        alignas alignof and and_eq asm bitand bitor catch char8_t char16_t char32_t class co_await co_return co_yield
        compl concept const_cast consteval constexpr constinit decltype delete dynamic_cast explicit export friend
        mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected public reinterpret_cast
        requires static_assert static_cast template this thread_local throw try typeid typename using virtual wchar_t
        xor xor_eq std real blockIdx blockDim threadIdx gridDim warpSize
        """.split()  # noqa: SIM905
    ),
)


_LOOPS = LoopDialect(
    CUDA,
    _GRID,
    "CUDA",
    "template <typename real>\n__host__ __device__ inline void",
    "__host__ __device__ inline",
    "long long",
)
_ABOUT_LOOPS = """
Kernels with loops take the lengths of their tables first. The rows of a table are contiguous; its
strides are to the table of the next element and to the next number. Index tables are shared by all elements and
are not checked. Results and work space must not overlap other arrays. The size of the work space for each thread,
in numbers, is returned by the function _work and does not depend on the number of elements; its strides are to the
space of the next thread and to the next number.
"""


def cuda_source(module: ModuleSource) -> str:
    """Print the ``.cu`` file of a module: templates in a namespace, and ``extern "C"`` kernels over batches."""
    kernels, loops, launched = [], window_functions((loop.procedure for loop in module.loops), _LOOPS), []
    global_names = LanguageNames(CUDA)
    space = global_names.fresh(module.name)
    local_names = LanguageNames(CUDA)
    wanted = [kernel.program.name for kernel in module.kernels] + [loop.procedure.name for loop in module.loops]
    names = function_names(wanted, local_names, "_batch")
    for kernel, (name, over_batch) in zip(module.kernels, names, strict=False):
        printed = function(kernel.program, CUDA)
        loop = batch(printed, CUDA, name, _GRID)
        kernels.append(
            {
                "comment": comment(kernel),
                "name": name,
                "element": element(printed, "real"),
                "batch_name": over_batch,
                "batch": loop,
                "batch_parameters": loop.parameters.format(real="real"),
            }
        )
        launched += [
            {
                "name": global_names.fresh(f"{module.name}_{kernel.program.name}_{suffix}"),
                "parameters": loop.parameters.format(real=real),
                "call": f"{over_batch}<{real}>({loop.passed});",
            }
            for real, suffix in _PRECISIONS
        ]
    for source, (name, over_batch) in zip(module.loops, names[len(module.kernels) :], strict=True):
        its_names, strided = loop_names(source.procedure, name, local_names), local_names.fresh(f"{name}_strided")
        loops.append(_loop_text(source, its_names, strided, over_batch))
        over_elements = loop_batch(source, its_names, strided, _LOOPS)
        launched += [
            {
                "name": global_names.fresh(f"{module.name}_{source.procedure.name}_{suffix}"),
                "parameters": over_elements.declared(real),
                "call": f"{over_batch}<{real}>({over_elements.passed});",
            }
            for real, suffix in _PRECISIONS
        ]
    return render_target(
        "cuda.cu.jinja",
        module,
        _POLICY,
        space=space,
        kernels=kernels,
        loops=loops,
        launched=launched,
        about_loops=about_loops(module, _ABOUT_LOOPS),
    )


def _loop_text(loop: LoopSource, names: LoopNames, strided: str, over_batch: str) -> str:
    """Print the functions of a kernel with loops."""
    *inner, own = element_functions(loop, names, strided, _LOOPS)
    over_elements = loop_batch(loop, names, strided, _LOOPS)
    head = f"template <typename real>\n__device__ inline void {over_batch}"
    batch_lines = function_lines(head, over_elements.declared("real"), over_elements.lines)
    commented = [*loop_comment(loop).split("\n"), *own]
    return joined([*inner, commented, batch_lines])
