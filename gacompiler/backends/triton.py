"""Print modules for Triton: kernels over blocks of elements, and functions of torch that launch them.

Kernels with loops are left out, and named at the end of the file.
"""

from __future__ import annotations

import keyword
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import replace

from ..errors import BackendError
from ..ir.program import Operand, Program
from ..ir.scalar import Op, Rational
from .c import environment
from .documentation import stamp
from .module import ModuleSource
from .nesting import used_variables
from .printers import number
from .targets import Language, LanguageNames, comment_lines, function_names

_POLICY = "contraction: enable_fp_fusion=False (every operation is rounded once)"
_WIDTH = 116


def _number(value: Rational) -> str:
    return number(value).removeprefix("(").removesuffix(")")


TRITON = Language(
    operations={
        Op.ADD: "{0} + {1}",
        Op.SUBTRACT: "{0} - {1}",
        Op.MULTIPLY: "{0} * {1}",
        Op.DIVIDE: "{0} / {1}",
        Op.NEGATE: "{0} * -1.0",  # the operator subtracts from zero, which loses the sign of zeros
        Op.MINIMUM: "tl.where(({0} < {1}) | ({0} != {0}), {0}, {1})",
        Op.MAXIMUM: "tl.where(({0} > {1}) | ({0} != {0}), {0}, {1})",
        Op.SQRT: "tl.sqrt({0})",
        Op.SIN: "tl.sin({0})",
        Op.COS: "tl.cos({0})",
        Op.ATAN2: "libdevice.atan2({0}, {1})",
        Op.ACOS: "libdevice.acos({0})",
        Op.EXP: "tl.exp({0})",
        Op.LOG: "tl.log({0})",
        Op.ABS: "tl.abs({0})",
        Op.FLOOR: "tl.floor({0})",
        Op.LESS: "({0} < {1}).to(REAL)",
        Op.LESS_EQUAL: "({0} <= {1}).to(REAL)",
        Op.EQUAL: "({0} == {1}).to(REAL)",
        Op.SELECT: "tl.where({0} != 0, {1}, {2})",
    },
    declaration="{0} = {1}",
    number=_number,
    reserved=frozenset({*keyword.kwlist, "BLOCK", "REAL", "_launch", "libdevice", "math", "tl", "torch", "triton"}),
)


class _Names(LanguageNames):
    """Names of variables, and of constants: blocks, since numbers in calls would be of single precision."""

    def __init__(self) -> None:
        super().__init__(TRITON)
        self.constants: dict[str, str] = {}

    def text(self, operand: Operand) -> str:
        """Return the name of an operand."""
        if isinstance(operand, str):
            return super().text(operand)
        text = _number(operand)
        if text not in self.constants:
            self.constants[text] = self.fresh("c")
        return self.constants[text]


def triton_source(module: ModuleSource) -> str:
    """Print the Python file of a module, which needs torch and Triton. Precision is that of the tensors.

    Raises
    ------
    BackendError
        If all kernels have loops.
    """
    if module.loops and not module.kernels:
        loops = ", ".join(loop.procedure.name for loop in module.loops)
        raise BackendError(
            module.name,
            f"{loops}: kernels with loops, which are not printed for Triton",
            "a kernel without loops",
            "--target cuda and --target opencl print loops",
        )
    names = function_names([kernel.program.name for kernel in module.kernels], LanguageNames(TRITON), "_kernel")
    kernels = []
    for source, (name, inner) in zip(module.kernels, names, strict=True):
        given, lines = _block(source.program)
        host = LanguageNames(TRITON)
        arguments = [host.fresh(each.name) for each in source.program.arguments]
        block = host.fresh("block")
        shapes, results = (
            _tuple(x.shape for x in source.program.arguments),
            _tuple(x.shape for x in source.program.results),
        )
        call = f"return _launch({inner}, {_tuple(arguments)}, {shapes}, {results}, {block})"
        kernels.append(
            {
                "comment": comment_lines(replace(source, uniform=())),
                "inner": _wrapped(f"def {inner}({', '.join([*given, 'BLOCK: tl.constexpr'])}):"),
                "lines": lines,
                "head": _wrapped(f"def {name}({', '.join([*arguments, f'{block}=256'])}):"),
                "call": _wrapped(call, "    "),
            }
        )
    left_out = [": ".join([loop.procedure.name, *loop.summary.strip().splitlines()[:1]]) for loop in module.loops]
    text = environment().get_template("triton.py.jinja").render(
        name=module.name,
        summary=[line.rstrip() for line in module.summary.strip().splitlines()],
        kernels=kernels,
        left_out=left_out,
    )  # fmt: skip
    body = "\n".join(map(str.rstrip, text.splitlines())) + "\n"
    return stamp(body, module, "#", (_POLICY,))


def _block(program: Program) -> tuple[list[str], list[str]]:
    """Return the parameters and the statements of the kernel that processes a block of elements."""
    names = _Names()
    arrays = [names.fresh(name) for name in [x.name for x in program.arguments] + [x.name for x in program.results]]
    strides = [(names.fresh(f"{each}_element"), names.fresh(f"{each}_component")) for each in arrays]
    count, at, inside = names.fresh("n"), names.fresh("i"), names.fresh("inside")

    def place(k: int, component: int) -> str:
        element, stride = strides[k]
        offset = f" + {component} * {stride}" if component else ""
        return f"{arrays[k]} + {at} * {element}{offset}"

    used = used_variables(program)
    loads = [
        f"{names.define(component)} = tl.load({place(k, j)}, mask={inside})"
        for k, each in enumerate(program.arguments)
        for j, component in enumerate(each.components)
        if component in used
    ]
    steps = []
    for line in program.lines:
        right = TRITON.operations[line.op].format(*map(names.text, line.operands))
        steps.append(f"{names.define(line.target)} = {right}")
    first = len(program.arguments)
    stores = [
        f"tl.store({place(first + k, j)}, {names.text(operand)}, mask={inside})"
        for k, each in enumerate(program.results)
        for j, operand in enumerate(each.operands)
    ]
    statements = [
        f"{at} = tl.program_id(0).to(tl.int64) * BLOCK + tl.arange(0, BLOCK)",
        f"{inside} = {at} < {count}",
        f"REAL: tl.constexpr = {arrays[first]}.dtype.element_ty",
        *(f"{name} = tl.full((BLOCK,), {text}, REAL)" for text, name in names.constants.items()),
        *loads,
        *steps,
        *stores,
    ]
    return [count, *arrays, *(stride for pair in strides for stride in pair)], statements


def _tuple(items: Iterable[object]) -> str:
    texts = list(map(str, items))
    return f"({', '.join(texts)}{',' if len(texts) == 1 else ''})"


def _wrapped(line: str, indent: str = "") -> Sequence[str]:
    return textwrap.wrap(
        line,
        _WIDTH,
        initial_indent=indent,
        subsequent_indent=f"{indent}        ",
        break_long_words=False,
        break_on_hyphens=False,
    )
