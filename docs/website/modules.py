"""Write a page for each generated module: algebra, layouts, types, operators and kernels."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterator
from types import ModuleType
from typing import Any

from gacompiler.algebra.catalog import CATALOG
from gacompiler.gac_runtime.definition import COUNTS

from .markdown import code, directive, first_sentence, table
from .places import ROOT

_KERNELS_IN_COLUMNS = ("mul", "add", "div", "sqrt")
"""Operations with separate columns; the others share a column."""


def names() -> list[str]:
    """Return the names of the generated modules."""
    return sorted(path.stem for path in (ROOT / "generated").glob("*.py") if path.stem != "__init__")


def page(name: str) -> str:
    """Return the page of a generated module."""
    module = importlib.import_module(f"generated.{name}")
    kernels = {kernel: getattr(module, kernel) for kernel in module.kernels}
    parts = [
        f"# {name}\n",
        f"`from generated import {name}`: {len(kernels)} kernels, generated from `gacompiler/specs/{name}.py`.\n",
        directive("automodule", module.__name__),
        *_algebra_part(module),
        "## Layouts\n",
        "Coefficients are stored in this order. The elements of a unit layout satisfy `x ~x = 1`.\n",
        table(("layout", "stored coefficients, in order", "fixed coefficients", "unit", "type"), _layout_rows(module)),
    ]
    operators = list(_operator_rows(module))
    if operators:
        about = "Operators act on single elements of the types above. Sums and multiples are defined for all types.\n"
        parts += ["## Operators\n", about, table(("expression", "result", "kernel"), operators)]
    parts += [
        "## Kernels\n",
        "Operation counts are per element. The error is measured, in ulp of the largest coefficient.\n",
        table(("kernel", "signature", *_KERNELS_IN_COLUMNS, "other", "error"), map(_kernel_row, kernels.values())),
    ]
    forms = [row for kernel in kernels.values() for row in _form_rows(kernel)]
    if forms:
        about = (
            "If some arguments are the same for all elements of a batch, a second form of the kernel computes "
            "everything that depends only on them once. It is selected by strides of 0 if the batch has the minimum "
            "size.\n"
        )
        parts += ["## Forms for uniform arguments\n", about]
        parts.append(table(("kernel", "uniform arguments", "minimum size", "once", "per element"), forms))
    parts += ["## Documentation of the kernels\n"]
    parts += [directive("autofunction", f"{module.__name__}.{kernel}") for kernel in kernels]
    return "\n".join(parts)


def summary(name: str) -> str:
    """Return the summary of a generated module."""
    return first_sentence(importlib.import_module(f"generated.{name}").__doc__ or "")


def _layouts(module: ModuleType) -> dict[str, Any]:
    """Return the layouts of a module by name."""
    return {name: value for name, value in vars(module).items() if isinstance(value, module.Layout) and value.blades}


def _algebra_part(module: ModuleType) -> Iterator[str]:
    """Yield the algebras of the layouts, with their basis vectors and metric."""
    algebras = sorted({layout.name.partition(".")[0] for layout in _layouts(module).values()} & set(CATALOG))
    for name in algebras:
        algebra = CATALOG[name]
        products = [
            f"{a} · {b} = {algebra.gram[j][k]}"
            for j, a in enumerate(algebra.vectors)
            for k, b in enumerate(algebra.vectors)
            if j <= k and (j == k or algebra.gram[j][k])
        ]
        yield f"## The algebra {name}\n"
        yield f"Basis vectors {', '.join(map(code, algebra.vectors))}; inner products that are not 0:\n"
        yield "```text\n" + ",  ".join(products) + "\n```\n"


def _layout_rows(module: ModuleType) -> Iterator[tuple[str, ...]]:
    types = {value.layout: name for name, value in vars(module).items() if _is_value_type(module, value)}
    for name, layout in _layouts(module).items():
        formulas = dict(layout.implied)
        fixed = ", ".join(f"`{blade} = {formulas.get(blade, value)}`" for blade, value in layout.fixed)
        yield (
            code(name),
            code(" ".join(layout.blades)),
            fixed,
            "yes" if layout.unit else "",
            code(types.get(layout, "")),
        )


def _is_value_type(module: ModuleType, value: Any) -> bool:
    return isinstance(value, type) and issubclass(value, module.Value) and value is not module.Value


def _operator_rows(module: ModuleType) -> Iterator[tuple[str, str, str]]:
    family = importlib.import_module(f"{module.Value.__module__}").families[module.__name__]
    for (symbol, kinds), (kernel, result, _) in family.operators.items():
        operands = [kind.__name__ for kind in kinds]
        if symbol == "()":
            text = f"{operands[0]}({', '.join(operands[1:])})"
        else:
            text = f"{operands[0]} {symbol} {operands[1]}" if len(operands) == 2 else symbol + operands[0]
        yield code(text), code(result.__name__), _link(kernel)


def _kernel_row(kernel: Any) -> tuple[str, ...]:
    counts = _counts(kernel)
    shown = [str(counts.get(name, 0)) for name in _KERNELS_IN_COLUMNS]
    rest = [
        f"{counts[name]} {name}" for name in COUNTS if name not in (*_KERNELS_IN_COLUMNS, "fma") and counts.get(name)
    ]
    return _link(kernel), code(kernel.signature), *shown, ", ".join(rest), _error(kernel)


def _counts(kernel: Any) -> dict[str, Any]:
    """Return the operation counts of a kernel; empty for kernels with loops, whose counts depend on lengths."""
    cost = kernel.cost
    return dict(cost) if all(name in cost for name in COUNTS) else {}


def _error(kernel: Any) -> str:
    """Return the measured error in the documentation of the kernel."""
    text = " ".join((kernel.__doc__ or "").split())
    found = re.search(r"Error: ([\d.e+-]+ ulp) of", text)
    return found[1] if found else ""


def _form_rows(kernel: Any) -> Iterator[tuple[str, ...]]:
    for form in getattr(kernel.definition, "forms", ()):
        yield _link(kernel), ", ".join(map(code, form.same)), str(form.least), form.once, form.each


def _link(kernel: Any) -> str:
    return "{py:obj}`" + f"{kernel.name} <{kernel.__module__}.{kernel.name}>" + "`"
