"""Shared parts of the CUDA and OpenCL printers: functions of one element, and loops over a batch for a grid of threads.

An array of a batch has two strides, counted in numbers: from element to element, and from component to component. With
structures of arrays (strides 1 and n), neighbouring threads read neighbouring numbers in memory. Arrays of structures
have the strides size and 1, and arguments that are the same for every element have the strides 0 and 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..ir.scalar import Op
from .targets import Function, Language, LanguageNames

C_WORDS = frozenset(
    """
    auto bool break case char const continue default do double else enum extern false float for goto if inline int long
    register restrict return short signed sizeof static struct switch true typedef union unsigned void volatile while
    NULL NAN INFINITY HUGE_VAL MAXFLOAT M_E M_LOG2E M_LOG10E M_LN2 M_LN10 M_PI M_PI_2 M_PI_4 M_1_PI M_2_PI M_2_SQRTPI
    M_SQRT2 M_SQRT1_2 linux unix i386 errno stdin stdout stderr
    """.split()  # noqa: SIM905
)
"""Keywords of C, and macros that may be defined."""

ARITHMETIC: Mapping[Op, str] = {
    Op.ADD: "{0} + {1}",
    Op.SUBTRACT: "{0} - {1}",
    Op.MULTIPLY: "{0} * {1}",
    Op.DIVIDE: "{0} / {1}",
    Op.NEGATE: "-{0}",
    Op.MINIMUM: "{0} < {1} || {0} != {0} ? {0} : {1}",
    Op.MAXIMUM: "{0} > {1} || {0} != {0} ? {0} : {1}",
}
"""Expressions common to all languages with the operators of C; minimum and maximum are NaN if an operand is NaN."""


def c_operations(real: str) -> dict[Op, str]:
    """Return the expressions of languages with the functions of C, for numbers of the type `real`."""
    return {
        **ARITHMETIC,
        Op.SQRT: "sqrt({0})",
        Op.SIN: "sin({0})",
        Op.COS: "cos({0})",
        Op.ATAN2: "atan2({0}, {1})",
        Op.ACOS: "acos({0})",
        Op.EXP: "exp({0})",
        Op.LOG: "log({0})",
        Op.ABS: "fabs({0})",
        Op.FLOOR: "floor({0})",
        Op.LESS: f"({real})({{0}} < {{1}})",
        Op.LESS_EQUAL: f"({real})({{0}} <= {{1}})",
        Op.EQUAL: f"({real})({{0}} == {{1}})",
        Op.SELECT: "{0} != 0 ? {1} : {2}",
    }


@dataclass(frozen=True, slots=True)
class Element:
    """The function that processes one element in one thread.

    Attributes
    ----------
    parameters : str
        The parameters of the function.
    lines : tuple of str
        The statements.
    """

    parameters: str
    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Batch:
    """The function in which a thread loops over its elements.

    Attributes
    ----------
    parameters : str
        The parameters of the function.
    passed : str
        The names of the parameters, as arguments of a call.
    lines : tuple of str
        The statements.
    """

    parameters: str
    passed: str
    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Grid:
    """Types and expressions of a language that are needed in loops over batches.

    Attributes
    ----------
    real, array, index : str
        The types of a number, of the entries of an array in global memory, and of a count or a stride.
    first, step : str
        The index of the current thread, and the number of threads.
    """

    real: str
    array: str
    index: str
    first: str
    step: str


def element(printed: Function, real: str) -> Element:
    """Print the function for one element."""
    texts = [f"{real} {part.name}" if part.is_scalar else f"const {real} *{part.name}" for part in printed.inputs]
    texts += [f"{real} *{part.name}" for part in printed.outputs]
    unused = [f"(void){name};" for name in printed.unused]
    return Element(", ".join(texts), (*unused, *printed.statements))


def batch(printed: Function, language: Language, name: str, grid: Grid) -> Batch:
    """Print the loop over a batch that calls the function `name` for each element."""
    names = LanguageNames(language)
    names.fresh(name)
    arrays = [names.fresh(part.name) for part in printed.parts]
    strides = [(names.fresh(f"{each}_element"), names.fresh(f"{each}_component")) for each in arrays]
    count, at, component = names.fresh("n"), names.fresh("i"), names.fresh("k")
    local = [names.fresh(f"{each}_i") for each in arrays]

    parameters, passed = [f"{grid.index} {count}"], [count]
    reads, writes, arguments, declared = [], [], [], []
    for k, part in enumerate(printed.parts):
        is_input = k < len(printed.inputs)
        parameters.append(f"{'const ' if is_input else ''}{grid.array} *{arrays[k]}")
        parameters += [f"{grid.index} {stride}" for stride in strides[k]]
        passed += [arrays[k], *strides[k]]
        place = f"{arrays[k]}[{at} * {strides[k][0]}"
        if part.is_scalar and is_input:
            arguments.append(f"{place}]")
            reads.append(f"(void){strides[k][1]};")
            continue
        declared.append(f"{local[k]}[{part.size}]")
        arguments.append(local[k])
        loop = f"for (int {component} = 0; {component} < {part.size}; {component}++)"
        inside, outside = f"{local[k]}[{component}]", f"{place} + {component} * {strides[k][1]}]"
        if is_input:
            reads += [loop, f"    {inside} = {outside};"]
        else:
            writes += [loop, f"    {outside} = {inside};"]
    inner = [f"{grid.real} {', '.join(declared)};", *reads, f"{name}({', '.join(arguments)});", *writes]
    head = f"for ({grid.index} {at} = {grid.first}; {at} < {count}; {at} += {grid.step}) {{"
    return Batch(", ".join(parameters), ", ".join(passed), (head, *(f"    {line}" for line in inner), "}"))
