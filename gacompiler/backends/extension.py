"""The C of the extension that calls kernels: one text for all modules, which it knows nothing of.

A generated module works without it. With it, a call on one element, or on a batch that one loop does, goes from
Python's interpreter to the kernel without a line of Python between them, and values of a layout have operators.
"""

from __future__ import annotations

from functools import cache
from itertools import product

from .c import environment

MAX_INPUTS, MAX_OUTPUTS = 4, 2
"""One element of a kernel with more goes through its loop."""

MAX_ARRAYS, MAX_AXES, MAX_LEADING = 16, 3, 8
"""Kernels with more arguments and results, elements with more axes, and batches with more are called from Python."""

STEM = "calls"
"""The name of the extension; its file has a digest besides."""

BINARY = (
    ("*", "multiply"), ("^", "xor"), ("&", "and"), ("|", "or"), ("+", "add"), ("-", "subtract"),
    ("/", "true_divide"), (">>", "rshift"),
)  # fmt: skip
UNARY = (("~", "invert"), ("-", "negative"))
"""Python's operators, and its C names for them."""

CALL = ("()", "call")
"""Of ``m(x)``."""


@cache
def extension_source() -> str:
    """The text of the extension."""
    operators = (*BINARY, CALL, *UNARY)
    return (
        environment()
        .get_template("extension.c.jinja")
        .render(
            max_arrays=MAX_ARRAYS,
            max_axes=MAX_AXES,
            max_leading=MAX_LEADING,
            invokers="\n\n".join(map(_invoker, _kinds())).splitlines(),
            invoker_table=[f'{{"{kinds}", invoke_{kinds}}},' for kinds in _kinds()],
            symbols=[f'"{symbol}"' for symbol, _ in operators],
            symbol_names=[f"SYMBOL_{name.upper()}" for _, name in operators],
            n_operands=[2] * (len(BINARY) + 1) + [1] * len(UNARY),
            operators="\n\n".join(_operator(operator) for operator in (*BINARY, *UNARY)).splitlines(),
            operator_slots=[f"{{Py_nb_{name}, value_{name}}}," for _, name in (*BINARY, *UNARY)],
        )
    )


def _kinds() -> list[str]:
    """Every order of arrays (a) and numbers (n), before results (r)."""
    return [
        "".join(inputs) + "r" * n_outputs
        for n_inputs in range(1, MAX_INPUTS + 1)
        for inputs in product("an", repeat=n_inputs)
        for n_outputs in range(1, MAX_OUTPUTS + 1)
    ]


def _invoker(kinds: str) -> str:
    """A call through a pointer of the right type: C has no call whose parameters are known only when it runs."""
    types = {"a": "const double *", "n": "double", "r": "double *"}
    counts = {"arrays": 0, "numbers": 0}
    arguments = []
    for kind in kinds:
        where = "numbers" if kind == "n" else "arrays"
        arguments.append(f"{where}[{counts[where]}]")
        counts[where] += 1
    parameters = ", ".join(types[kind] for kind in kinds)
    unused = [] if counts["numbers"] else ["    (void)numbers;"]
    return "\n".join(
        [
            f"static void invoke_{kinds}(Function function, double *const *arrays, const double *numbers)",
            "{",
            *unused,
            f"    typedef void (*Kernel)({parameters});",
            f"    ((Kernel)function)({', '.join(arguments)});",
            "}",
        ]
    )


def _operator(operator: tuple[str, str]) -> str:
    _, name = operator
    n = 1 if operator in UNARY else 2
    operands = ["a", "b"][:n]
    parameters = ", ".join(f"PyObject *{operand}" for operand in operands)
    call = f"operate_{('one', 'two')[n - 1]}(SYMBOL_{name.upper()}, {', '.join(operands)})"
    return f"static PyObject *value_{name}({parameters})\n{{\n    return {call};\n}}"
