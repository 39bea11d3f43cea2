"""Python's operators on values: which operations of the kernel language have one."""

from __future__ import annotations

from collections.abc import Mapping

OPERATORS: Mapping[int, Mapping[str, str]] = {
    1: {"reverse": "~", "negate": "-"},
    2: {
        "geometric_product": "*", "outer_product": "^", "regressive_product": "&", "add": "+", "subtract": "-",
        "sandwich": "()",
    },
}  # fmt: skip
"""By number of operands: operation -> Python's operator; ``()`` is the call ``m(x)``."""


def python_operator(operation: str, operands: tuple[str, ...]) -> tuple[str, tuple[str, ...]]:
    """The operator for an operation, with the names of its operands, as `KernelSource` has them."""
    return OPERATORS[len(operands)][operation], operands
