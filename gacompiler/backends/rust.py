"""Print modules as Rust: functions of one element and of slices of elements, generic over ``f64`` and ``f32``."""

from __future__ import annotations

from ..ir.scalar import Op, Rational
from .c_windows import needed_by
from .module import ModuleSource
from .printers import number
from .rust_loops import HELPERS, WINDOWS, loop_functions
from .target_loops import loop_names, programs
from .targets import (
    Function,
    Language,
    LanguageNames,
    Part,
    about_loops,
    comment_lines,
    function,
    function_names,
    indexed,
    joined,
    render_target,
)

_POLICY = "contraction: none in Rust (every operation is rounded once)"


def _number(value: Rational) -> str:
    text = number(value).removeprefix("(").removesuffix(")")
    return f"T::number({text}.0)" if text.lstrip("-").isdigit() else f"T::number({text})"


RUST = Language(
    operations={
        Op.ADD: "{0} + {1}",
        Op.SUBTRACT: "{0} - {1}",
        Op.MULTIPLY: "{0} * {1}",
        Op.DIVIDE: "{0} / {1}",
        Op.NEGATE: "-{0}",
        Op.SQRT: "{0}.sqrt()",
        Op.SIN: "{0}.sin()",
        Op.COS: "{0}.cos()",
        Op.ATAN2: "{0}.atan2({1})",
        Op.ACOS: "{0}.acos()",
        Op.EXP: "{0}.exp()",
        Op.LOG: "{0}.ln()",
        Op.ABS: "{0}.abs()",
        Op.FLOOR: "{0}.floor()",
        Op.MINIMUM: "{0}.minimum({1})",
        Op.MAXIMUM: "{0}.maximum({1})",
        Op.LESS: "T::truth({0} < {1})",
        Op.LESS_EQUAL: "T::truth({0} <= {1})",
        Op.EQUAL: "T::truth({0} == {1})",
        Op.SELECT: "{0}.select({1}, {2})",
    },
    declaration="let {0} = {1};",
    number=_number,
    reserved=frozenset(
        """
        abstract as async await become box break const continue crate do dyn else enum extern false final fn for gen if
        impl in let loop macro match mod move mut override priv pub ref return self Self static struct super trait true
        try type typeof unsafe unsized use virtual where while yield
        Some None Ok Err Real T at check
        """.split()  # noqa: SIM905
    ),
)


_ABOUT_LOOPS = """
Kernels with loops are functions of one element, whose first parameters are the lengths of their tables. A table is
a slice of rows. An index table that refers to a row that does not exist causes a panic. The work space must have
at least the size, in numbers, that is returned by the function _work.
"""


def rust_source(module: ModuleSource) -> str:
    """Print the ``.rs`` file of a module, for use as a module of a crate: ``mod pga3;``. It needs no other crate."""
    kernels, loops, procedures = [], [], [loop.procedure for loop in module.loops]
    wanted = [kernel.program.name for kernel in module.kernels] + [loop.procedure.name for loop in module.loops]
    file_names = LanguageNames(RUST)
    names = function_names(wanted, file_names, "_batch")
    for kernel, (name, over_batch) in zip(module.kernels, names, strict=False):
        printed = function(kernel.program, RUST, _entry)
        kernels.append(
            {
                "comment": comment_lines(kernel),
                "name": name,
                "parameters": _parameters(printed),
                "lines": printed.statements,
                "batch_name": over_batch,
                "batch": _batch(printed, name),
            }
        )
    for source, (name, _) in zip(module.loops, names[len(module.kernels) :], strict=True):
        its_names = loop_names(source.procedure, name, file_names)
        for program in programs(source):
            printed = function(program, RUST, _entry)
            head = f"fn {its_names.parts[program.name]}<T: Real>({_parameters(printed, '')}) {{"
            loops.append(["#[inline]", head, *(f"    {line}" for line in printed.statements), "}"])
        loops += loop_functions(source, its_names, RUST)
    return render_target(
        "rust.rs.jinja",
        module,
        _POLICY,
        kernels=kernels,
        precisions=("f64", "f32"),
        methods=("sqrt", "sin", "cos", "acos", "exp", "ln", "abs", "floor"),
        about_loops=about_loops(module, _ABOUT_LOOPS),
        helpers=[HELPERS.strip(), *needed_by(procedures, WINDOWS)] if procedures else [],
        loops=[joined(loops)] if loops else [],
    )


def _entry(part: Part, k: int) -> str:
    return f"*{part.name}" if part.is_scalar else indexed(part, k)


def _parameters(printed: Function, borrowed: str = "&") -> str:
    """Return the parameters of a function of one element, whose arguments are borrowed or passed by value."""
    inputs = [
        f"{part.name}: T" if part.is_scalar else f"{part.name}: {borrowed}{_type(part)}" for part in printed.inputs
    ]
    return ", ".join([*inputs, *(f"{part.name}: &mut {_type(part)}" for part in printed.outputs)])


def _type(part: Part) -> str:
    return "T" if part.is_scalar else f"[T; {part.size}]"


def _batch(printed: Function, name: str) -> dict[str, str]:
    """Return the values for the loop over a batch in the template; a slice of one element is used for all elements."""
    names = LanguageNames(RUST)
    names.fresh(name)
    slices = [names.fresh(part.name) for part in printed.parts]
    inputs, outputs = slices[: len(printed.inputs)], slices[len(printed.inputs) :]
    count, i = names.fresh("n"), names.fresh("i")
    declared = [f"{each}: &[{_type(part)}]" for each, part in zip(inputs, printed.inputs, strict=True)]
    declared += [f"{each}: &mut [{_type(part)}]" for each, part in zip(outputs, printed.outputs, strict=True)]
    arguments = [
        f"{'*' if part.is_scalar else ''}at({each}, {i})" for each, part in zip(inputs, printed.inputs, strict=True)
    ]
    arguments += [f"&mut {each}[{i}]" for each in outputs]
    return {
        "parameters": ", ".join(declared),
        "inputs": ", ".join(f"{each}.len()" for each in inputs),
        "outputs": ", ".join(f"{each}.len()" for each in outputs),
        "first": outputs[0],
        "count": count,
        "i": i,
        "arguments": ", ".join(arguments),
    }
