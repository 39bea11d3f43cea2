"""Print modules as JavaScript: functions of one element and over batches, in double, for arrays of any type."""

from __future__ import annotations

from ..ir.scalar import Op, Rational
from .c_windows import needed_by
from .devices import ARITHMETIC
from .javascript_loops import HELPERS, WINDOWS, loop_functions, returned
from .module import ModuleSource
from .printers import number
from .target_loops import loop_names, programs
from .targets import (
    Function,
    Language,
    LanguageNames,
    Part,
    about_loops,
    comment,
    function,
    function_names,
    joined,
    render_target,
)

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
        Op.FLOOR: "Math.floor({0})",
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


_ABOUT_LOOPS = """
Kernels with loops are functions of one element, whose first parameters are the lengths of their tables. A table is
an array of numbers with contiguous rows. Index tables are not checked. Results and work space must not overlap
other arrays. The work space is a Float64Array of at least the length returned by the function _work; it is
allocated if it is omitted.
"""


def javascript_source(module: ModuleSource) -> str:
    """Print the ``.mjs`` file of a module.

    The inner function of a kernel takes arrays with the offset of an element in them, ``m`` and ``m$``. Names in a
    program never contain ``$``.
    """
    kernels, loops, procedures = [], [], [loop.procedure for loop in module.loops]
    wanted = [kernel.program.name for kernel in module.kernels] + [loop.procedure.name for loop in module.loops]
    file_names = LanguageNames(JAVASCRIPT)
    names = function_names(wanted, file_names, "_batch")
    for kernel, (name, over_batch) in zip(module.kernels, names, strict=False):
        printed = function(kernel.program, JAVASCRIPT, _entry)
        kernels.append(
            {
                "comment": comment(kernel),
                "name": name,
                "batch_name": over_batch,
                "parameters": ", ".join(part.name for part in printed.parts),
                "placed": _placed(printed),
                "lines": printed.statements,
                "one": _one(printed, name),
                "batch": _batch(printed, name),
            }
        )
    for source, (name, _) in zip(module.loops, names[len(module.kernels) :], strict=True):
        its_names = loop_names(source.procedure, name, file_names)
        for program in programs(source):
            printed = function(program, JAVASCRIPT, _entry)
            head = f"function {its_names.parts[program.name]}$({_placed(printed)}) {{"
            loops.append([head, *(f"  {line}" for line in printed.statements), "}"])
        loops += loop_functions(source, its_names, JAVASCRIPT)
    return render_target(
        "javascript.mjs.jinja",
        module,
        _POLICY,
        kernels=kernels,
        about_loops=about_loops(module, _ABOUT_LOOPS),
        helpers=[HELPERS.strip(), *needed_by(procedures, WINDOWS)] if procedures else [],
        loops=[joined(loops)] if loops else [],
    )


def _placed(printed: Function) -> str:
    """Return the parameters of the inner function."""
    placed = [part.name if part.is_scalar else f"{part.name}, {part.name}$" for part in printed.inputs]
    return ", ".join([*placed, *(f"{part.name}, {part.name}$" for part in printed.outputs)])


def _entry(part: Part, k: int) -> str:
    return f"{part.name}[{part.name}$ + {k}]" if k else f"{part.name}[{part.name}$]"


def _one(printed: Function, name: str) -> list[str]:
    """Print the function for one element, which allocates omitted results and returns scalar ones as numbers."""
    made = [f'$check("{part.name}", {part.name}, {part.size});' for part in printed.inputs if not part.is_scalar]
    made += [f"{part.name} = $result({part.name}, {part.size});" for part in printed.outputs]
    passed = [part.name if part.is_scalar else f"{part.name}, 0" for part in printed.inputs]
    passed += [f"{part.name}, 0" for part in printed.outputs]
    results = [f"{part.name}[0]" if part.is_scalar else part.name for part in printed.outputs]
    return [*made, f"{name}$({', '.join(passed)});", returned(results)]


def _batch(printed: Function, name: str) -> list[str]:
    """Print the function over a batch, in which an array of one element is used for all elements."""
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
        returned([part.name for part in printed.outputs]),
    ]


def _scaled(text: str, operator: str, size: int) -> str:
    return text if size == 1 else f"{text} {operator} {size}"
