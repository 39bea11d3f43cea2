"""Shared parts of the printers of further languages: a table for each language, and the statements of a kernel.

Rust, JavaScript, CUDA and OpenCL print the same programs as C and Python, on contiguous components and with one
operation for each statement. A language is defined by a table of expressions, a notation of numbers and a set of
reserved names; its template contains the rest.

Comparisons return 1 or 0, and 0 if an operand is NaN. Minimum and maximum return NaN if an operand is NaN, and the
second operand if both are zeros. Select returns its last operand if the condition is 0, and the other one if the
condition is NaN.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod

from ..ir.program import Operand, Program
from ..ir.scalar import LEAVES, Op, Rational
from .c import environment
from .documentation import c_comment, stamp
from .module import KernelSource, ModuleSource
from .nesting import used_variables
from .printers import Names

_WIDTH = 116
_KEPT = "\0"
"""Placeholder for a space at which a line is not broken."""


@dataclass(frozen=True, slots=True)
class Language:
    """Notation of the elements of a kernel in one language."""

    operations: Mapping[Op, str]
    """The right-hand side of a statement for each operation."""
    declaration: str
    """A statement that declares a value."""
    number: Callable[[Rational], str]
    reserved: frozenset[str]
    """Names that a variable or a function cannot have."""

    def __post_init__(self) -> None:
        missing = set(Op) - set(LEAVES) - set(self.operations)
        if missing:
            raise ValueError(f"Language(): no text for {', '.join(sorted(op.value for op in missing))}")


class LanguageNames(Names):
    """Legal and distinct names of the variables of one emitted function, or of all functions of a file."""

    def __init__(self, language: Language) -> None:
        super().__init__()
        self._language = language

    def fresh(self, wanted: str) -> str:
        """Return a legal name that is not used yet: `wanted`, with underscores appended if necessary."""
        name = re.sub(r"\W", "_", wanted, flags=re.ASCII)
        if not name or name[0].isdigit() or name[0] == "_":
            name = f"v{name}"
        while name in self._language.reserved or name in self._taken:
            name += "_"
        self._taken.add(name)
        return name

    def text(self, operand: Operand) -> str:
        """Return the text of an operand in the language."""
        return self._variables[operand] if isinstance(operand, str) else self._language.number(operand)


@dataclass(frozen=True, slots=True)
class Part:
    """An argument or a result of an emitted function."""

    name: str
    size: int
    """The count of its numbers."""
    is_scalar: bool
    """Whether it is a number instead of an array; as an argument, it is passed by value."""


@dataclass(frozen=True, slots=True)
class Function:
    """A kernel in one language, as inserted into the template."""

    inputs: tuple[Part, ...]
    outputs: tuple[Part, ...]
    statements: tuple[str, ...]
    unused: tuple[str, ...]
    """Parameters that are not used."""

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parameters in order."""
        return self.inputs + self.outputs


def indexed(part: Part, k: int) -> str:
    """Return the text of a component in most languages."""
    return f"{part.name}[{k}]"


def function(program: Program, language: Language, entry: Callable[[Part, int], str] = indexed) -> Function:
    """Return the parameters and statements of a kernel; `entry` formats a component of an array or a scalar result.

    All components are read before any is written, so that an output may be the same array as an input if the language
    permits it.
    """
    names = LanguageNames(language)
    inputs = tuple(
        Part(
            names.fresh(each.name) if each.shape else names.define(each.components[0]), prod(each.shape), not each.shape
        )
        for each in program.arguments
    )
    outputs = tuple(Part(names.fresh(each.name), prod(each.shape), not each.shape) for each in program.results)
    used = used_variables(program)
    statements, unused = [], []
    for argument, part in zip(program.arguments, inputs, strict=True):
        if not used.intersection(argument.components):
            unused.append(part.name)
        elif not part.is_scalar:
            statements += [
                language.declaration.format(names.define(component), entry(part, k))
                for k, component in enumerate(argument.components)
                if component in used
            ]
    for line in program.lines:
        right = language.operations[line.op].format(*map(names.text, line.operands))
        statements.append(language.declaration.format(names.define(line.target), right))
    for result, part in zip(program.results, outputs, strict=True):
        statements += [f"{entry(part, k)} = {names.text(o)};" for k, o in enumerate(result.operands)]
    return Function(inputs, outputs, tuple(statements), tuple(unused))


def function_names(wanted: Sequence[str], names: LanguageNames, ending: str) -> list[tuple[str, str]]:
    """Return legal and distinct names for all functions of a file, in pairs without and with the suffix."""
    plain = [names.fresh(name) for name in wanted]
    return [(name, names.fresh(f"{name}{ending}")) for name in plain]


def comment(kernel: KernelSource) -> str:
    """Return the comment above a kernel: layouts, cost and error. Uniform variants exist only in C and Python."""
    return c_comment(replace(kernel, uniform=()))


def comment_lines(kernel: KernelSource) -> list[str]:
    """Return the comment above a kernel without comment markers."""
    return [line[3:] for line in comment(kernel).removesuffix(" */").splitlines()]


def about_loops(module: ModuleSource, text: str) -> list[str]:
    """Return the description of kernels with loops for the head of a file, or nothing if it has none."""
    return text.strip().splitlines() if module.loops else []


def joined(functions: Sequence[Sequence[str]]) -> str:
    """Join functions with an empty line between them."""
    return "\n\n".join("\n".join(lines) for lines in functions)


def render_target(template: str, module: ModuleSource, note: str, **values: object) -> str:
    """Render a template, wrap long lines, and add the header."""
    summary = [line.rstrip().replace("*/", "* /") for line in module.summary.strip().splitlines()]
    text = environment().get_template(template).render(name=module.name, summary=summary, **values)
    return stamp("".join(f"{line}\n" for line in _wrapped(text.splitlines())), module, "//", (note,))


def _wrapped(lines: list[str]) -> list[str]:
    """Strip trailing spaces, and break long lines of code after a comma, or before a conditional operator or a sum."""
    wrapped, in_comment = [], False
    for line in map(str.rstrip, lines):
        indent = " " * (len(line) - len(line.lstrip()))
        in_comment = in_comment or line.startswith("/*")
        is_text = in_comment or line.lstrip().startswith("//")
        in_comment = in_comment and not line.endswith("*/")
        if len(line) <= _WIDTH or is_text:
            wrapped.append(line)
            continue
        parts = textwrap.wrap(
            re.sub(r"(?<![,;]) (?!(?:[?:]|\+=) )", _KEPT, line.strip()),
            _WIDTH,
            initial_indent=indent,
            subsequent_indent=f"{indent}    ",
            break_long_words=False,
            break_on_hyphens=False,
        )
        wrapped += [part.replace(_KEPT, " ") for part in parts]
    return wrapped
