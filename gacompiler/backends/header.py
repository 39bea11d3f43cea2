"""Print modules as one C header: inline functions of one element, valid C99 and C++, without runtime and libraries."""

from __future__ import annotations

from ..errors import BackendError
from ..ir.scalar import Rational
from .devices import C_WORDS, c_operations
from .module import ModuleSource
from .printers import number
from .targets import Function, Language, LanguageNames, comment, function, function_names, render_target

_POLICY = "contraction: that of the C compiler; with -ffp-contract=off every operation is rounded once"


def _number(value: Rational) -> str:
    return f"(GAC_REAL){number(value)}"


HEADER = Language(
    operations=c_operations("GAC_REAL"),
    declaration="const GAC_REAL {0} = {1};",
    number=_number,
    reserved=C_WORDS
    | frozenset(
        """
        GAC_REAL sqrt sin cos atan2 acos exp log fabs floor
        alignas alignof and and_eq asm bitand bitor catch char8_t char16_t char32_t class co_await co_return co_yield
        compl concept const_cast consteval constexpr constinit decltype delete dynamic_cast explicit export friend
        mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected public reinterpret_cast
        requires static_assert static_cast template this thread_local throw try typeid typename using virtual wchar_t
        xor xor_eq
        """.split()  # noqa: SIM905
    ),
)


def header_source(module: ModuleSource) -> str:
    """Print the header ``_inline.h`` of a module, which needs no other file.

    Raises
    ------
    BackendError
        If a kernel has loops, which need the runtime.
    """
    if module.loops:
        name = module.loops[0].procedure.name
        raise BackendError(
            f"{module.name}_inline.h", f"{name}, a kernel with loops", "kernels without loops in a header of its own",
            "select others by --only, or use --standalone",
        )  # fmt: skip
    wanted = [f"{module.name}_{kernel.program.name}" for kernel in module.kernels]
    names = function_names(wanted, LanguageNames(HEADER), "_")
    kernels = []
    for kernel, (name, _) in zip(module.kernels, names, strict=True):
        printed = function(kernel.program, HEADER)
        statements = [*(f"(void){unused};" for unused in printed.unused), *printed.statements]
        kernels.append(
            {"comment": comment(kernel), "name": name, "parameters": _parameters(printed), "lines": statements}
        )
    return render_target("header.h.jinja", module, _POLICY, kernels=kernels)


def _parameters(printed: Function) -> str:
    inputs = [f"GAC_REAL {x.name}" if x.is_scalar else f"const GAC_REAL *{x.name}" for x in printed.inputs]
    return ", ".join([*inputs, *(f"GAC_REAL *{x.name}" for x in printed.outputs)])
