"""The Python module of a spec: runtime, layouts, kernels, in one file that needs numpy and nothing of this package."""

from __future__ import annotations

import ast
import builtins
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path

from ..errors import BackendError
from ..ir.program import Argument, Program, Result
from ..ir.uniform import Uniform
from .approximations import APPROXIMATIONS, FARTHEST, coefficients, numbers
from .build import FOLDER, extension_name, library_name
from .c import c_source, environment
from .c_batch import C_ENDINGS, C_HELPERS, FORM_PARTS, form_name
from .documentation import docstring, stamp
from .module import KernelSource, LayoutText, ModuleSource
from .named import named_lines
from .numba import function_text
from .values import class_text, combined_types, operator_lines, value_types

PUBLIC = ("Kernel", "Layout", "Value", "backend", "kernels", "num_threads")
"""What a module offers besides its kernels and types."""

_RUNTIME = (
    *("functions", "strides", "layout", "extension", "threads", "libraries", "batches"),
    *("llvm", "terms", "transcendental", "tiles", "movers", "loops", "intrinsics", "numba", "kernel", "value"),
)
"""The runtime files, each before what uses it."""

_WIDTH = 120


def python_source(module: ModuleSource) -> str:
    """The ``.py`` of a module.

    Parameters
    ----------
    module : ModuleSource
        What to print.

    Returns
    -------
    str
        The text. It carries the name of the library that `c_source` of the same module builds into, so that the module
        never loads another.
    """
    check_names(module)
    names = [kernel.program.name for kernel in module.kernels]
    types = value_types(module, {*taken_names(), *names})
    layouts = _layout_names(module, types)
    body = (
        environment()
        .get_template("module.py.jinja")
        .render(
            name=module.name,
            summary=_escaped(module.summary.strip()),
            runtime=runtime_text(),
            folder=FOLDER,
            library=library_name(module.name, c_source(module)),
            layouts=[_layout(name, layout) for layout, name in layouts.items()],
            kernels=[_kernel(kernel, layouts) for kernel in module.kernels],
            types=["\n".join(class_text(name, layout, layouts[layout])) for name, layout in types.values()],
            operators=operator_lines(module, types),
            combined=combined_types(types),
            names=_tuple(names),
            public=_list([*names, *(name for name, _ in types.values()), *PUBLIC]),
        )
    )
    return stamp(body, module, "#")


@cache
def runtime_text() -> str:
    """What every module holds before its kernels: the runtime files as one, with their imports together."""
    modules: set[str] = set()
    names: dict[str, set[str]] = {}
    bodies = []
    for part in _RUNTIME:
        text = (Path(__file__).parent / "templates" / f"runtime_{part}.py").read_text(encoding="utf-8")
        nodes = [node for node in ast.parse(text).body if isinstance(node, (ast.Import, ast.ImportFrom))]
        bodies.append("\n".join(text.splitlines()[nodes[-1].end_lineno or 0 :]).strip("\n"))
        for node in nodes:
            if isinstance(node, ast.Import):
                modules.update(ast.unparse(node).splitlines())
            elif not node.level and node.module != "__future__":
                names.setdefault(str(node.module), set()).update(alias.name for alias in node.names)
    modules.remove("import numpy as np")
    lines = sorted(modules) + [f"from {module} import {', '.join(sorted(names[module]))}" for module in sorted(names)]
    text = "\n".join([*lines, "", "import numpy as np", *(f"\n\n{body}" for body in bodies)])
    values = {
        '_EXTENSION = ""': f'"{extension_name()}"',
        '_EXTENSION_FOLDER = ""': f'"{FOLDER}"',
        "_FARTHEST = 0": str(FARTHEST),
        "_CONSTANTS: dict[str, dict[str, float]] = {}": _constants(),
        "_POLYNOMIALS: dict[str, dict[str, tuple[float, ...]]] = {}": _polynomials(),
    }
    for line, value in values.items():
        text = text.replace(f"\n{line}\n", f"\n{line.partition(' = ')[0]} = {value}\n")
    return text


def _constants() -> str:
    """The constants of transcendental functions, by type."""
    return _by_type(lambda double: [f'"{name}": {value!r},' for name, value in numbers(double=double).items()])


def _polynomials() -> str:
    """The polynomials of transcendental functions, by type."""

    def lines(double: bool) -> Iterator[str]:
        for name in APPROXIMATIONS:
            terms = [f"{c!r}," for c in coefficients(name, double=double)]
            yield f'"{name}": ('
            yield from (f"    {' '.join(terms[k : k + 4])}" for k in range(0, len(terms), 4))
            yield "),"

    return _by_type(lines)


def _by_type(lines: Callable[[bool], Iterable[str]]) -> str:
    text = ["{"]
    for double, kind in ((True, "float64"), (False, "float32")):
        text += [f'    "{kind}": {{', *(f"        {line}" for line in lines(double)), "    },"]
    return "\n".join([*text, "}"])


@cache
def _runtime_names() -> frozenset[str]:
    names: set[str] = {"backend", "kernels"}
    for node in ast.parse(runtime_text()).body:
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            names.update((alias.asname or alias.name).partition(".")[0] for alias in node.names)
        elif isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            names.add(node.name)
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names.update(name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name))
    return frozenset(names)


@cache
def taken_names() -> frozenset[str]:
    """Names that every emitted module needs for something else."""
    return _runtime_names() | set(dir(builtins))


def check_names(module: ModuleSource) -> None:
    """Raise `BackendError` where a kernel would hide a name that the emitted module needs."""
    taken: dict[str, str] = dict.fromkeys(sorted(taken_names()), "the module itself")
    for kernel in module.kernels:
        name = kernel.program.name
        forms = [form_name(kernel.program, form, what) for form in kernel.uniform for what in FORM_PARTS]
        own_names = (name, f"_{name}", *(f"{name}{ending}" for ending in C_ENDINGS), *forms)
        for own in (*own_names, *(f"_{form}" for form in forms)):
            if own in taken or C_HELPERS.fullmatch(own):
                taken.setdefault(own, "the C file itself")
                raise BackendError(
                    f"kernel {name}",
                    f"its name {own} belongs to {taken[own]}",
                    "a name that is free",
                    "rename the kernel",
                )
            taken[own] = f"kernel {name}"


def _layout_names(module: ModuleSource, types: Mapping[str, tuple[str, LayoutText]]) -> dict[LayoutText, str]:
    """The layouts of kernels and types, once each, under short private names."""
    names: dict[LayoutText, str] = {}
    of_kernels = [layout for kernel in module.kernels for _, layout in kernel.layouts]
    for layout in (*of_kernels, *(layout for _, layout in types.values())):
        if layout not in names:
            short = "".join(c if c.isalnum() else "_" for c in layout.name.rpartition(".")[2]).upper()
            name = f"_LAYOUT_{short}"
            while name in names.values():
                name += "_"
            names[layout] = name
    return names


def _layout(name: str, layout: LayoutText) -> str:
    fixed = _tuple_of(f"({_string(blade)}, {_string(value)})" for blade, value in layout.fixed)
    lines = [f"{name} = Layout(", f"    name={_string(layout.name)},", "    blades=("]
    line = "       "
    for blade in layout.blades:
        text = f" {_string(blade)},"
        if len(line) + len(text) > _WIDTH:
            lines.append(line)
            line = "       "
        line += text
    lines += [line, "    ),"] if layout.blades else ["    ),"]
    lines += [f"    fixed={fixed},", f"    unit={layout.unit},"]
    if layout.implied:
        implied = _tuple_of(f"({_string(blade)}, {_string(text)})" for blade, text in layout.implied)
        lines.append(f"    implied={implied},")
    return "\n".join([*lines, ")"])


def _kernel(kernel: KernelSource, layouts: dict[LayoutText, str]) -> dict[str, object]:
    program = kernel.program
    return {
        "name": program.name,
        "function": "\n".join(function_text(program, kernel.uniform)),
        "doc": f'"""{_escaped(docstring(kernel))}\n"""',
        "inputs": _parts(program.arguments),
        "outputs": _parts(program.results),
        "layouts": [f"{_string(name)}: {layouts[layout]}" for name, layout in kernel.layouts],
        "cost": "{" + ", ".join(f"{_string(name)}: {count}" for name, count in kernel.cost.as_dict().items()) + "}",
        "polynomial": program.is_polynomial,
        "ending": kernel_ending(program, kernel.uniform),
        "named": named_lines(kernel),
    }


def kernel_ending(program: Program, forms: Sequence[Uniform], names: Sequence[str] = ()) -> list[str]:
    """The last lines of a kernel object: its functions, and its forms.

    A reader knows the names of the arguments only as they are printed, and gives what they are besides as `names`.
    """
    names = names or [argument.name for argument in program.arguments]
    lines = [f"    functions=(_{program.name},),"]
    if forms:
        lines += ["    forms=(", *(f"        {_form(program, form, names)}," for form in forms), "    ),"]
    return [*lines, ")"]


def _form(program: Program, form: Uniform, names: Sequence[str]) -> str:
    """A form as the kernel object takes it: which arguments stay, from how many elements on, and its functions."""
    each = zip(names, program.arguments, strict=True)
    same = _tuple_of(_string(name) for name, argument in each if argument.name in form.same)
    functions = [f"_{form_name(program, form, what)}" for what in ("prepare", "apply")]
    return f"({same}, {form.least(program)}, {form.apply.arguments[0].shape[0]}, ({', '.join(functions)}))"


def _parts(parts: tuple[Argument, ...] | tuple[Result, ...]) -> list[str]:
    return [f"({_string(part.name)}, {part.shape})" for part in parts]


def _tuple_of(texts: Iterable[str]) -> str:
    items = list(texts)
    return "(" + ", ".join(items) + ("," if len(items) == 1 else "") + ")"


def _string(text: str) -> str:
    quoted = repr(text)
    return f'"{quoted[1:-1]}"' if quoted[0] == "'" and '"' not in quoted else quoted


def _tuple(names: list[str]) -> str:
    return "(\n" + "".join(f"    {_string(name)},\n" for name in names) + ")"


def _list(names: list[str]) -> str:
    return "[\n" + "".join(f"    {_string(name)},\n" for name in names) + "]"


def _escaped(text: str) -> str:
    text = text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    return text + " " if text.endswith('"') else text
