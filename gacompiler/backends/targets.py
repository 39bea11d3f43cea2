"""What the printers of further languages share: a table for each, and the statements of a kernel written with it.

Rust, JavaScript, CUDA and OpenCL print the programs that C and Python print, on contiguous components, one operation a
statement. A language is a table of expressions, a way to write numbers and names it reserves; its template holds the
rest. Comparisons give 1 or 0 and are 0 where an operand is NaN; minimum and maximum are NaN where either operand is,
and the second of two zeros; select takes its last operand where the condition is 0, so not where it is NaN.
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
"""A blank at which no line ends."""


@dataclass(frozen=True, slots=True)
class Language:
    """How one language writes what a kernel consists of."""

    operations: Mapping[Op, str]
    """The right side of a statement."""
    declaration: str
    """A statement that names a value."""
    number: Callable[[Rational], str]
    reserved: frozenset[str]
    """Names that a variable or a function cannot have."""

    def __post_init__(self) -> None:
        missing = set(Op) - set(LEAVES) - set(self.operations)
        if missing:
            raise ValueError(f"no text for {', '.join(sorted(op.value for op in missing))}")


class LanguageNames(Names):
    """The names of one emitted function, or of all functions of a file, in a language of a table."""

    def __init__(self, language: Language) -> None:
        super().__init__()
        self._language = language

    def fresh(self, wanted: str) -> str:
        """A legal name that nothing else has: `wanted`, with underscores behind it where that is taken."""
        name = re.sub(r"\W", "_", wanted, flags=re.ASCII)
        if not name or name[0].isdigit() or name[0] == "_":
            name = f"v{name}"
        while name in self._language.reserved or name in self._taken:
            name += "_"
        self._taken.add(name)
        return name

    def text(self, operand: Operand) -> str:
        """`operand` as the language writes it."""
        return self._variables[operand] if isinstance(operand, str) else self._language.number(operand)


@dataclass(frozen=True, slots=True)
class Part:
    """An argument or a result of an emitted function."""

    name: str
    size: int
    """How many numbers."""
    is_scalar: bool
    """Whether it is a number and no array; as an argument it is passed by value."""


@dataclass(frozen=True, slots=True)
class Function:
    """A kernel in one language: what its template puts between braces."""

    inputs: tuple[Part, ...]
    outputs: tuple[Part, ...]
    statements: tuple[str, ...]
    unused: tuple[str, ...]
    """Parameters that nothing reads."""

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parameters in order."""
        return self.inputs + self.outputs


def indexed(part: Part, k: int) -> str:
    """A component as most languages write it."""
    return f"{part.name}[{k}]"


def function(program: Program, language: Language, entry: Callable[[Part, int], str] = indexed) -> Function:
    """The parameters and statements of a kernel; `entry` writes a component of an array, or a scalar result.

    All components are read before any is written, so that an output may be an input where the language allows that.
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
    """For each name wanted in a file that name, and that with the ending: legal and distinct."""
    plain = [names.fresh(name) for name in wanted]
    return [(name, names.fresh(f"{name}{ending}")) for name in plain]


def comment(kernel: KernelSource) -> str:
    """The comment above a kernel: layouts, cost and error. The forms for batches are of C and Python."""
    return c_comment(replace(kernel, uniform=()))


def comment_lines(kernel: KernelSource) -> list[str]:
    """The same without the marks of a comment."""
    return [line[3:] for line in comment(kernel).removesuffix(" */").splitlines()]


def about_loops(module: ModuleSource, text: str) -> list[str]:
    """What the head of a file says about kernels with loops, where it has any."""
    return text.strip().splitlines() if module.loops else []


def joined(functions: Sequence[Sequence[str]]) -> str:
    """The text of functions, with a line between them."""
    return "\n\n".join("\n".join(lines) for lines in functions)


def render_target(template: str, module: ModuleSource, note: str, **values: object) -> str:
    """A template filled and stamped, its long lines continued."""
    summary = [line.rstrip().replace("*/", "* /") for line in module.summary.strip().splitlines()]
    text = environment().get_template(template).render(name=module.name, summary=summary, **values)
    return stamp("".join(f"{line}\n" for line in _wrapped(text.splitlines())), module, "//", (note,))


def _wrapped(lines: list[str]) -> list[str]:
    """Lines without blanks at their ends, long ones of code continued behind a comma or before a choice."""
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
            re.sub(r"(?<![,;]) (?![?:] )", _KEPT, line.strip()),
            _WIDTH,
            initial_indent=indent,
            subsequent_indent=f"{indent}    ",
            break_long_words=False,
            break_on_hyphens=False,
        )
        wrapped += [part.replace(_KEPT, " ") for part in parts]
    return wrapped
