"""Print the Python module of a spec: layouts, kernels and value types, which are declared to the runtime."""

from __future__ import annotations

import builtins
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path

from ..errors import BackendError
from ..gac_runtime.definition import INTERFACE, result_names
from ..gac_runtime.layout import Layout
from ..gac_runtime.names import RUNTIME, digest, library_label
from ..ir.cost import Cost
from ..ir.program import Argument, Program, Result
from ..ir.uniform import Uniform
from .c import c_source, environment, standalone_c_source
from .c_batch import C_ENDINGS, FORM_PARTS, form_name
from .documentation import stamp
from .module import KernelSource, LoopSource, ModuleSource
from .printers import C_MACRO_NAMES, Names
from .python_loops import costs_text, kernel_names, loop_text
from .python_text import form_functions, function_text
from .shared_parts import with_shared_parts
from .stubs import Stub
from .values import class_text, combined_types, operator_lines, value_types

PUBLIC = ("Kernel", "Layout", "Value", "backend", "kernels", "num_threads")
"""Public names of every module, in addition to its kernels and types."""

_OWN = ("GeneratedModule", "SCALAR", "annotations", "error")
"""Other names used in the text of every module."""

_WIDTH = 120


def python_source(module: ModuleSource) -> str:
    """Print the ``.py`` file of a module.

    Parameters
    ----------
    module : ModuleSource

    Returns
    -------
    str
        The text. It contains the name of the library that is built from `c_source` of the same module, so that the
        module never loads a different library.
    """
    imports = environment().get_template("import_runtime.py.jinja").render(command=module.command)
    return _python_source(module, imports, library_label(module.name, c_source(module)))


def standalone_python_source(module: ModuleSource) -> str:
    """Print the ``.py`` file of a module that includes the runtime and needs only numpy.

    Its library is built from `standalone_c_source`.
    """
    files = {name: text for name, text in runtime_files().items() if name.endswith(".py")}
    package = f"{RUNTIME}_{digest(*files, *files.values())}"
    texts = []
    for name, text in files.items():
        assert "'''" not in text and not text.endswith("\\"), name
        path = name.removesuffix(".py").removesuffix("/__init__").split("/")
        texts.append((".".join([package, *path[1:]]), text))
    imports = environment().get_template("embed_runtime.py.jinja").render(package=package, texts=texts)
    return _python_source(module, imports, library_label(module.name, standalone_c_source(module)))


def _python_source(module: ModuleSource, imports: str, label: str) -> str:
    """Print a module with the given import statements and the label of its library."""
    check_names(module)
    module = with_shared_parts(module)
    names = _names_of_kernels(module)
    types = value_types(module, {*taken_names(), *names})
    layouts = _layout_names(module, types)
    declared = [_layout(name, layout) for layout, name in layouts.items() if not layout.is_scalar]
    printed: set[str] = set()
    body = (
        environment()
        .get_template("module.py.jinja")
        .render(
            summary=_escaped(module.summary.strip()),
            runtime=imports.rstrip(),
            interface=INTERFACE,
            library=label,
            layouts=declared,
            kernels=[
                "\n".join(lines)
                for lines in (
                    *(_kernel(kernel, layouts) for kernel in module.kernels),
                    *(_loops(kernel, layouts, printed) for kernel in module.loops),
                )
            ],
            types=[class_text(name, layouts[layout]) for name, layout in types.values()],
            operators=_call("_module.operators", operator_lines(module, types), one_each=True),
            sums=", ".join(combined_types(types)),
            public=_call("__all__ = ", ["*kernels", *map(_string, (*(name for name, _ in types.values()), *PUBLIC))]),
        )
    )
    return stamp(body, module, "#")


def python_stub(module: ModuleSource) -> str:
    """Print the ``.pyi`` file of a module, which declares its kernels and types for type checkers and editors."""
    types = value_types(module, {*taken_names(), *_names_of_kernels(module)})
    return stamp(Stub(module, types, _layout_names(module, types)).text(), module, "#")


def _names_of_kernels(module: ModuleSource) -> list[str]:
    """Return the names of all kernels, with the kernels with loops last."""
    return [*(kernel.program.name for kernel in module.kernels), *(kernel.procedure.name for kernel in module.loops)]


@cache
def runtime_files() -> dict[str, str]:
    """Return the texts of the files of the runtime, which are written next to modules, by name."""
    folder = Path(__file__).parents[1] / RUNTIME
    paths = sorted(path for ending in ("py", "typed", "c", "h") for path in folder.rglob(f"*.{ending}"))
    return {f"{RUNTIME}/{path.relative_to(folder).as_posix()}": path.read_text(encoding="utf-8") for path in paths}


@cache
def taken_names() -> frozenset[str]:
    """Return the names that are reserved in every emitted module."""
    return frozenset({*PUBLIC, *_OWN, *dir(builtins)})


def check_names(module: ModuleSource) -> None:
    """Raise `BackendError` if a kernel would hide a name that the emitted module needs."""
    if module.name == "gac" or module.name.startswith("gac_"):
        raise BackendError(
            f"module {module.name}", "names gac and gac_... belong to the runtime", "another", "rename it"
        )
    taken: dict[str, str] = dict.fromkeys(sorted(taken_names()), "the module itself")
    taken |= dict.fromkeys(sorted(C_MACRO_NAMES), "the C headers")
    for kernel in module.kernels:
        name = kernel.program.name
        forms = [form_name(kernel.program, form.same, what) for form in kernel.uniform for what in FORM_PARTS]
        own_names = (name, *(f"{name}{ending}" for ending in C_ENDINGS), *forms)
        for own in (*own_names, *(f"_{form}" for form in forms)):
            if own in taken:
                raise BackendError(
                    f"kernel {name}",
                    f"its name {own} is already used by {taken[own]}",
                    "a different name",
                    "rename the kernel",
                )
            taken[own] = f"kernel {name}"
    for loops in module.loops:
        for own in kernel_names(loops):
            if own in taken:
                raise BackendError(
                    f"kernel {loops.procedure.name}",
                    f"its name {own} is already used by {taken[own]}",
                    "a different name",
                    "rename the kernel",
                )
            taken[own] = f"kernel {loops.procedure.name}"


def _layout_names(module: ModuleSource, types: Mapping[str, tuple[str, Layout]]) -> dict[Layout, str]:
    """Return the layouts of kernels and types, without duplicates, with the names of their variables."""
    taken = {*taken_names(), *_names_of_kernels(module), *(name for name, _ in types.values())}
    names: dict[Layout, str] = {}
    of_kernels = [layout for kernel in module.kernels for _, layout in kernel.layouts]
    of_kernels += [layout for loops in module.loops for _, layout in loops.layouts]
    for layout in (*of_kernels, *(layout for _, layout in types.values())):
        if layout in names:
            continue
        if layout.is_scalar:
            names[layout] = "SCALAR"
            continue
        short = layout.name.rpartition(".")[2]
        name = short.upper() if short.isidentifier() else f"LAYOUT_{len(names)}"
        while name in taken or name in names.values():
            name += "_"
        names[layout] = name
    return names


def _layout(name: str, layout: Layout) -> str:
    """Print the declaration of a layout."""
    implied = dict(layout.implied)
    options = {
        "fixed": _equations((blade, value) for blade, value in layout.fixed if blade not in implied),
        "implied": _equations(layout.implied),
    }
    parts = [_string(layout.name), _string(" ".join(layout.blades))]
    parts += [f"{option}={_string(text)}" for option, text in options.items() if text]
    parts += ["unit=True"] if layout.unit else []
    parts += ["related=True"] if layout.related else []
    return "\n".join(_call(f"{name} = _layout", parts))


def _equations(pairs: Iterable[tuple[str, str]]) -> str:
    return ", ".join(f"{blade} = {value}" for blade, value in pairs)


def _kernel(kernel: KernelSource, layouts: Mapping[Layout, str]) -> list[str]:
    """Print a kernel, the decorated function of one element, and its uniform variants."""
    program, name = kernel.program, kernel.program.name
    text = function_text(program)
    known = dict(kernel.layouts)
    parts: list[Argument | Result] = [*program.arguments, *program.results]
    found = [known.get(part.name) for part in parts]
    lines = [*declaration(kernel, [layouts[layout] if layout else "None" for layout in found]), text[0]]
    lines += [*_documentation(kernel.summary), *text[1:]]
    forms = []
    for form in kernel.uniform:
        lines += [line for function in form_functions(program, form) for line in ("", "", *function)]
        forms += form_text(program, form)
    lines += ["", "", *forms] if forms else []
    if kernel.result_names:
        lines += ["", "", *_call(f"{name} = _module.named", [name, _string(" ".join(kernel.result_names))])]
    return lines


def _loops(kernel: LoopSource, layouts: Mapping[Layout, str], printed: set[str]) -> list[str]:
    """Print a kernel with loops: its parts that are not printed yet, and the decorated function of one element."""
    text, known = loop_text(kernel.procedure), dict(kernel.layouts)
    lines = [line for name, part in text.parts.items() if name not in printed for line in (*part, "", "")]
    printed.update(text.parts)
    tables = (*kernel.procedure.parameters, *kernel.procedure.results)
    found = [known.get(table.name) for table in tables]
    parts = [_string(kernel.procedure.signature), *(layouts[layout] if layout else "None" for layout in found)]
    parts += [f"cost={_string(costs_text(kernel.costs))}", *text.options]
    parts += [f"assumes=({', '.join(map(_string, kernel.relations))},)"] if kernel.relations else []
    parts += [f"error={_string(kernel.error.removesuffix(', 64 inputs'))}"] if kernel.error else []
    return [*lines, *_call("@_module.loops", parts), text.head, *_documentation(kernel.summary), *text.body]


def form_text(program: Program, form: Uniform, names: Sequence[str] = ()) -> list[str]:
    """Print the declaration of a uniform variant, which follows its functions; the runtime finds them by their names.

    A reader, which only knows the arguments by the names of the parameters, passes the declared names as `names`.
    """
    declared = dict(zip((argument.name for argument in program.arguments), names, strict=False))
    once, each = form.costs
    options = {"least": str(form.least(program)), "once": _string(str(once)), "each": _string(str(each))}
    if form_functions(program, form):
        options = {"least": options.pop("least"), "n_prepared": str(form.apply.arguments[0].shape[0]), **options}
    same = _string(" ".join(declared.get(name, name) for name in form.same))
    return _call("_module.form", [program.name, same, *(f"{option}={value}" for option, value in options.items())])


def declaration(kernel: KernelSource, layouts: Sequence[str]) -> list[str]:
    """Print the decorator of a kernel."""
    program, cost = kernel.program, kernel.cost
    arguments, results = ([part.name for part in parts] for parts in (program.arguments, program.results))
    signature = "->".join(",".join(map(_shape, parts)) for parts in (program.arguments, program.results))
    parts = [_string(signature), *layouts, f"cost={_string(cost_text(cost))}"]
    printed = Names(program).parameters(program)
    parts += [f"names={_string(' '.join(arguments))}"] if printed != arguments else []
    parts += [f"results={_string(' '.join(results))}"] if results != result_names(len(results)) else []
    parts += [f"assumes=({', '.join(map(_string, kernel.relations))},)"] if kernel.relations else []
    parts += [f"error={_string(kernel.error.removesuffix(', 64 inputs'))}"] if kernel.error else []
    return _call("@_module.kernel", parts)


def cost_text(cost: Cost) -> str:
    """Format the operation counts that a kernel declares."""
    return f"{cost}, {cost.fma} fma"


def _shape(part: Argument | Result) -> str:
    return f"({','.join(map(str, part.shape))})"


def _documentation(summary: str) -> list[str]:
    """Print the docstring of a function, as written by its author."""
    text = _escaped(summary.strip())
    first, *rest = text.splitlines() or [""]
    lines = [f'    """{first}', *(f"    {line}" if line else "" for line in rest)]
    return [f'{lines[0]}"""'] if not rest else [*lines, '    """']


def _call(function: str, parts: Sequence[str], one_each: bool = False) -> list[str]:
    """Print a call, on one line if it fits, else aligned; return no lines if there are no arguments."""
    if not parts:
        return []
    line = f"{function}({', '.join(parts)})"
    if len(line) <= _WIDTH:
        return [line]
    if one_each:
        return [f"{function}(", *(f"    {part}," for part in parts), ")"]
    inner = " " * len(f"{function}(")
    first, *rest = _filled(parts, _WIDTH - len(inner))
    lines = [f"{function}({first}", *(f"{inner}{line}" for line in rest)]
    return [*lines[:-1], f"{lines[-1].removesuffix(',')})"]


def _filled(items: Sequence[str], width: int = _WIDTH - 4) -> list[str]:
    """Write items followed by commas, as many on a line as fit; an item longer than a line has its own line."""
    lines = [""]
    for item in items:
        if lines[-1] and len(lines[-1]) + len(item) + 2 > width:
            lines.append("")
        lines[-1] += f"{' ' if lines[-1] else ''}{item},"
    return lines


def _string(text: str) -> str:
    quoted = repr(text)
    return f'"{quoted[1:-1]}"' if quoted[0] == "'" and '"' not in quoted else quoted


def _escaped(text: str) -> str:
    text = text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    return text + " " if text.endswith('"') else text
