"""Rust: functions of one element and over slices of elements, generic over ``f64`` and ``f32``; no crate is needed."""

from __future__ import annotations

from ..ir.scalar import Op, Rational
from .module import ModuleSource
from .printers import number
from .targets import (
    Function,
    Language,
    LanguageNames,
    Part,
    comment_lines,
    function,
    function_names,
    indexed,
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


def rust_source(module: ModuleSource) -> str:
    """The ``.rs`` of a module, to be a module of a crate: ``mod pga3;``."""
    kernels = []
    wanted = [kernel.program.name for kernel in module.kernels]
    for kernel, (name, over_batch) in zip(module.kernels, function_names(wanted, RUST, "_batch"), strict=True):
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
    precisions, methods = ("f64", "f32"), ("sqrt", "sin", "cos", "acos", "exp", "ln", "abs")
    return render_target("rust.rs.jinja", module, _POLICY, kernels=kernels, precisions=precisions, methods=methods)


def _entry(part: Part, k: int) -> str:
    return f"*{part.name}" if part.is_scalar else indexed(part, k)


def _parameters(printed: Function) -> str:
    inputs = [f"{part.name}: T" if part.is_scalar else f"{part.name}: &{_type(part)}" for part in printed.inputs]
    return ", ".join([*inputs, *(f"{part.name}: &mut {_type(part)}" for part in printed.outputs)])


def _type(part: Part) -> str:
    return "T" if part.is_scalar else f"[T; {part.size}]"


def _batch(printed: Function, name: str) -> dict[str, str]:
    """What the template needs for the loop over a batch; a slice of one element stands for all elements."""
    names = LanguageNames(RUST)
    names.fresh(name)
    slices = [names.fresh(part.name) for part in printed.parts]
    inputs, outputs = slices[: len(printed.inputs)], slices[len(printed.inputs) :]
    count, i = names.fresh("n"), names.fresh("i")
    parameters = [f"{each}: &[{_type(part)}]" for each, part in zip(inputs, printed.inputs, strict=True)]
    parameters += [f"{each}: &mut [{_type(part)}]" for each, part in zip(outputs, printed.outputs, strict=True)]
    arguments = [
        f"{'*' if part.is_scalar else ''}at({each}, {i})" for each, part in zip(inputs, printed.inputs, strict=True)
    ]
    arguments += [f"&mut {each}[{i}]" for each in outputs]
    return {
        "parameters": ", ".join(parameters),
        "inputs": ", ".join(f"{each}.len()" for each in inputs),
        "outputs": ", ".join(f"{each}.len()" for each in outputs),
        "first": outputs[0],
        "count": count,
        "i": i,
        "arguments": ", ".join(arguments),
    }
