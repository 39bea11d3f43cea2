"""CUDA C++: functions of one element for any real type, and kernels over a batch in double and float.

The text includes nothing; it needs the functions of ``<math.h>`` under their global names, which nvcc brings.
"""

from __future__ import annotations

from ..ir.scalar import Op, Rational
from .devices import ARITHMETIC, C_WORDS, Grid, batch, element
from .module import ModuleSource
from .printers import number
from .targets import Language, LanguageNames, comment, function, function_names, render_target

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
    # The functions go by their global names, so that a kernel may be named as one of them.
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


def cuda_source(module: ModuleSource) -> str:
    """The ``.cu`` of a module: templates in its namespace, and ``extern "C"`` kernels over batches."""
    kernels, launched = [], []
    global_names = LanguageNames(CUDA)
    space = global_names.fresh(module.name)
    names = function_names([kernel.program.name for kernel in module.kernels], CUDA, "_batch")
    for kernel, (name, over_batch) in zip(module.kernels, names, strict=True):
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
    return render_target("cuda.cu.jinja", module, _POLICY, space=space, kernels=kernels, launched=launched)
