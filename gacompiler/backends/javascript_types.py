"""Print the types of a module in JavaScript, a ``.d.mts`` file for TypeScript and for editors."""

from __future__ import annotations

from ..ir.procedure import Table
from .javascript import JAVASCRIPT
from .loop_statements import is_number
from .module import ModuleSource
from .target_loops import loop_comment, loop_names, named_in
from .targets import LanguageNames, comment, function, function_names, render_target

_NOTE = "types of the module with the same name"

_WORK = "work?: Float64Array"


def javascript_types(module: ModuleSource) -> str:
    """Print the types of the functions that `javascript_source` prints, under the same names."""
    wanted = [kernel.program.name for kernel in module.kernels] + [loop.procedure.name for loop in module.loops]
    file_names = LanguageNames(JAVASCRIPT)
    names = function_names(wanted, file_names, "_batch")
    texts = []
    for kernel, (name, over_batch) in zip(module.kernels, names, strict=False):
        printed = function(kernel.program, JAVASCRIPT)
        inputs = [f"{part.name}: {'number' if part.is_scalar else 'Numbers'}" for part in printed.inputs]
        outputs = [f"{part.name}?: R" for part in printed.outputs]
        one = _declaration(name, [*inputs, *outputs], [part.is_scalar for part in printed.outputs])
        inputs = [f"{part.name}: Numbers" for part in printed.inputs]
        batch = _declaration(over_batch, [*inputs, *outputs], [False for _ in printed.outputs])
        texts.append("\n".join([_shown(comment(kernel)), one, batch]))
    for loop, (name, _) in zip(module.loops, names[len(module.kernels) :], strict=True):
        its_names = loop_names(loop.procedure, name, file_names)
        named = named_in(its_names.inside(JAVASCRIPT), loop.procedure)
        lengths = [f"{length}: number" for length in named.lengths]
        tables = [f"{table.name}: {_type(table)}" for table in named.parameters]
        tables += [f"{table.name}?: R" for table in named.results]
        scalars = [not table.lengths and not table.shape for table in named.results]
        size = f"export function {its_names.work}({', '.join(lengths)}): number;"
        own = _declaration(name, [*lengths, *tables, _WORK], scalars)
        texts.append("\n".join([size, "", _shown(loop_comment(loop)), own]))
    return render_target("javascript.d.mts.jinja", module, _NOTE, texts=texts)


def _shown(text: str) -> str:
    """Return a comment as one that editors show."""
    return "/**" + text.removeprefix("/*")


def _type(table: Table) -> str:
    return "number" if is_number(table) else "Numbers"


def _declaration(name: str, parameters: list[str], scalars: list[bool]) -> str:
    """Declare a function that returns one result, or an array of several."""
    results = ["number" if is_scalar else "R" for is_scalar in scalars]
    returned = results[0] if len(results) == 1 else f"[{', '.join(results)}]"
    return f"export function {name}<R extends Results = Float64Array>({', '.join(parameters)}): {returned};"
