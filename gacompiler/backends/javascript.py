"""JavaScript: a module of functions of one element and over batches, in double; any typed array will do."""

from __future__ import annotations

from ..ir.scalar import Op, Rational
from .devices import ARITHMETIC
from .module import ModuleSource
from .printers import number
from .targets import Function, Language, Part, comment, function, function_names, render_target

_POLICY = "contraction: none in JavaScript (every operation is rounded once)"


def _number(value: Rational) -> str:
    text = number(value)
    return f"({text})" if text.startswith("-") else text


JAVASCRIPT = Language(
    operations={
        **ARITHMETIC,
        Op.SQRT: "Math.sqrt({0})",
        Op.SIN: "Math.sin({0})",
        Op.COS: "Math.cos({0})",
        Op.ATAN2: "Math.atan2({0}, {1})",
        Op.ACOS: "Math.acos({0})",
        Op.EXP: "Math.exp({0})",
        Op.LOG: "Math.log({0})",
        Op.ABS: "Math.abs({0})",
        Op.LESS: "{0} < {1} ? 1 : 0",
        Op.LESS_EQUAL: "{0} <= {1} ? 1 : 0",
        Op.EQUAL: "{0} === {1} ? 1 : 0",
        Op.SELECT: "{0} !== 0 ? {1} : {2}",
    },
    declaration="const {0} = {1};",
    number=_number,
    reserved=frozenset(
        """
        arguments await break case catch class const continue debugger default delete do else enum eval export extends
        false finally for function if implements import in instanceof interface let new null package private protected
        public return static super switch this throw true try typeof undefined var void while with yield
        Math Number NaN Infinity Float64Array RangeError
        """.split()  # noqa: SIM905
    ),
)


def javascript_source(module: ModuleSource) -> str:
    """The ``.mjs`` of a module.

    The function that computes takes arrays and where in them its element begins, ``m`` and ``m$``: no name of a program
    holds a ``$``.
    """
    kernels = []
    wanted = [kernel.program.name for kernel in module.kernels]
    for kernel, (name, over_batch) in zip(module.kernels, function_names(wanted, JAVASCRIPT, "_batch"), strict=True):
        printed = function(kernel.program, JAVASCRIPT, _entry)
        placed = [part.name if part.is_scalar else f"{part.name}, {part.name}$" for part in printed.inputs]
        placed += [f"{part.name}, {part.name}$" for part in printed.outputs]
        kernels.append(
            {
                "comment": comment(kernel),
                "name": name,
                "batch_name": over_batch,
                "parameters": ", ".join(part.name for part in printed.parts),
                "placed": ", ".join(placed),
                "lines": printed.statements,
                "one": _one(printed, name),
                "batch": _batch(printed, name),
            }
        )
    return render_target("javascript.mjs.jinja", module, _POLICY, kernels=kernels)


def _entry(part: Part, k: int) -> str:
    return f"{part.name}[{part.name}$ + {k}]" if k else f"{part.name}[{part.name}$]"


def _returned(texts: list[str]) -> str:
    return f"return {texts[0]};" if len(texts) == 1 else f"return [{', '.join(texts)}];"


def _one(printed: Function, name: str) -> list[str]:
    """The function of one element: results are made where none are given; a scalar one is returned as a number."""
    made = [f"{part.name} = $result({part.name}, {part.size});" for part in printed.outputs]
    passed = [part.name if part.is_scalar else f"{part.name}, 0" for part in printed.inputs]
    passed += [f"{part.name}, 0" for part in printed.outputs]
    returned = [f"{part.name}[0]" if part.is_scalar else part.name for part in printed.outputs]
    return [*made, f"{name}$({', '.join(passed)});", _returned(returned)]


def _batch(printed: Function, name: str) -> list[str]:
    """The function over a batch: an array of one element stands for all elements."""
    counts = [_scaled(f"{part.name}.length", "/", part.size) for part in printed.inputs if part.size]
    passed = []
    for part in printed.inputs:
        place = f"{part.name}.length === {part.size} ? 0 : {_scaled('i$', '*', part.size)}"
        passed.append(f"{part.name}[{place}]" if part.is_scalar else f"{part.name}, {place}")
    passed += [f"{part.name}, {_scaled('i$', '*', part.size)}" for part in printed.outputs]
    return [
        f"const n$ = $elements({', '.join(counts)});",
        *(f"{part.name} = $result({part.name}, {_scaled('n$', '*', part.size)});" for part in printed.outputs),
        "for (let i$ = 0; i$ < n$; i$++) {",
        f"  {name}$({', '.join(passed)});",
        "}",
        _returned([part.name for part in printed.outputs]),
    ]


def _scaled(text: str, operator: str, size: int) -> str:
    return text if size == 1 else f"{text} {operator} {size}"
