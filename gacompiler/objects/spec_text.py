"""Generation of the text of a spec whose kernels are operations on objects."""

from __future__ import annotations

import keyword
import re
import textwrap
from collections.abc import Callable, Sequence
from fractions import Fraction

from ..algebra.algebra import Algebra
from ..algebra.catalog import CATALOG
from ..algebra.layout import SCALARS, Layout
from ..errors import SpecError
from .definitions import Applied
from .fusion import Fused

_WIDTH = 116


def spec_text(name: str, used: Sequence[Applied | Fused]) -> str:
    """Return the text of a spec with these operations, or fused ones, as kernels; it depends on nothing else."""
    algebras: dict[Algebra, str] = {}
    layouts: dict[Layout, str] = {}
    definitions: list[str] = []
    kernels: dict[str, str] = {}
    for operator in used:
        write = _fused_kernel if isinstance(operator, Fused) else _kernel
        text = write(operator, algebras, layouts, definitions, kernels)  # type: ignore[arg-type]
        if text not in kernels.values():
            kernels[_name(text)] = text
    catalog = sorted(each for algebra, each in algebras.items() if CATALOG.get(algebra.name) == algebra)
    body = "\n\n\n".join(kernels.values())
    is_scalar = any(re.search(r"\bSCALAR\b", text) for text in kernels.values())
    public = ", ".join([*(["SCALAR"] if is_scalar else []), *(["Algebra"] if len(catalog) < len(algebras) else [])])
    lines = [f'"""Operations used by {name}."""', "", *(["import gacompiler as ga"] if "ga." in body else [])]
    lines.append(f"from gacompiler import {public + ', ' if public else ''}kernel")
    lines += [f"from gacompiler.algebra.catalog import {', '.join(catalog)}"] if catalog else []
    lines += ["", *definitions] if definitions else []
    return "\n".join(lines) + "\n\n\n" + body + "\n"


def _name(text: str) -> str:
    found = re.search(r"^def (\w+)\(", text, re.MULTILINE)
    assert found is not None
    return found[1]


def _kernel(
    operator: Applied,
    algebras: dict[Algebra, str],
    layouts: dict[Layout, str],
    definitions: list[str],
    known: dict[str, str],
) -> str:
    kernel = operator.kernel
    given = {p.name: _layout(p.layout, algebras, layouts, definitions) for p in kernel.parameters}
    algebra = _algebra_of(operator)
    expression = operator.definition.expression(_algebra(algebra, algebras, definitions))
    if kernel.returns is not None:
        given["returns"] = _layout(operator.result, algebras, layouts, definitions)

    def text(name: str) -> str:
        words = operator.definition.name.replace("_", " ")
        about = f"``{expression}``." if len(expression) < 90 else f"The {words} of its arguments."
        head = ", ".join(f"{key}={value}" for key, value in given.items())
        parameters = ", ".join(operator.definition.parameters)
        return "\n".join(
            [f"@kernel({head})", f"def {name}({parameters}):", f'    """{about}"""', *_statement("return ", expression)]
        )

    return _named(kernel.name, text, known)


def _fused_kernel(
    fused: Fused,
    algebras: dict[Algebra, str],
    layouts: dict[Layout, str],
    definitions: list[str],
    known: dict[str, str],
) -> str:
    """Return the text of a kernel with one line for each operation."""
    given = [
        f"{n}={_layout(x, algebras, layouts, definitions)}" for n, x in zip(fused.names, fused.inputs, strict=True)
    ]
    values = [step.text(fused.name_of, _algebra(step.algebra, algebras, definitions)) for step in fused.steps]
    is_last = fused.results == (len(values) - 1,)
    body = [
        line
        for k, value in enumerate(values[: len(values) - is_last])
        for line in _statement(f"{fused.name_of(k)} = ", value)
    ]
    body += _statement("return ", values[-1] if is_last else ", ".join(map(fused.name_of, fused.results)))

    def text(name: str) -> str:
        head = f"@kernel({', '.join(given)})"
        if len(head) > _WIDTH:
            head = "\n".join(["@kernel(", *(f"    {each}," for each in given), ")"])
        return "\n".join([head, f"def {name}({', '.join(fused.names)}):", f'    """{fused.summary}"""', *body])

    return _named(fused.name, text, known)


def _named(wanted: str, text: Callable[[str], str], known: dict[str, str]) -> str:
    """Return the text of a kernel under a name that no other kernel has."""
    name, count = wanted, 2
    while name in known and known[name] != text(name):
        name, count = f"{wanted}_{count}", count + 1
    return text(name)


def _statement(start: str, expression: str) -> list[str]:
    """Return the lines of a statement: ``return`` or an assignment, and an expression."""
    if len(start) + len(expression) + 4 <= _WIDTH:
        return [f"    {start}{expression}"]
    lines = textwrap.wrap(expression, _WIDTH - 8, break_long_words=False, break_on_hyphens=False)
    return [f"    {start}(", *(f"        {line}" for line in lines), "    )"]


def _algebra_of(operator: Applied) -> Algebra:
    return operator.definition.algebra_of(parameter.layout for parameter in operator.kernel.parameters)


def _algebra(algebra: Algebra, algebras: dict[Algebra, str], definitions: list[str]) -> str:
    """Return the name of an algebra in the spec, and add its definition if it is not in the catalog."""
    if algebra == SCALARS:
        return "SCALARS"
    if algebra not in algebras:
        if CATALOG.get(algebra.name) == algebra:
            algebras[algebra] = algebra.name
        else:
            name = _free(_identifier(algebra.name), {*algebras.values(), *CATALOG, "SCALAR", "Algebra", "kernel", "ga"})
            algebras[algebra] = name
            gram = [[str(x) if Fraction(x).denominator > 1 else int(x) for x in row] for row in algebra.gram]
            spelled = " ".join(algebra.spelling(b)[1] for b in algebra.blades() if algebra.spelling(b)[0] < 0)
            more = f', "{spelled}"' if spelled else ""
            definitions.append(f'{name} = Algebra("{algebra.name}", "{" ".join(algebra.vectors)}", {gram}{more})')
    return algebras[algebra]


def _layout(layout: Layout, algebras: dict[Algebra, str], layouts: dict[Layout, str], definitions: list[str]) -> str:
    """Return the text of a layout in the spec: its name in the algebra, or that of an added definition."""
    if layout.is_scalar:
        return "SCALAR"
    algebra = _algebra(layout.algebra, algebras, definitions)
    known = (*layout.algebra.layouts.values(), layout.algebra.full, layout.algebra.even, layout.algebra.UNIT_EVEN)
    if CATALOG.get(layout.algebra.name) == layout.algebra or layout.name in ("full", "even", "UNIT_EVEN"):
        for each in known:
            if each == layout:
                return f"{algebra}.{each.name}"
    if layout not in layouts:
        if layout.implied or layout.user_relations is not None:
            raise SpecError(
                f"layout {layout}", "functions cannot be written as text", "a layout of the catalog, or of blades"
            )
        word = _identifier(layout.name).upper()
        if layout.name.startswith("("):
            word = f"{algebra}_{word}" if len(word) <= 30 else f"{algebra}_{layout.size}_BLADES"
        name = _free(word, {*layouts.values(), *algebras.values()})
        layouts[layout] = name
        fixed = {
            slot.name: str(value) if Fraction(value).denominator > 1 else int(value) for slot, value in layout.fixed
        }
        more = (f", fixed={fixed}" if fixed else "") + (", unit=True" if layout.unit else "")
        definitions.append(f'{name} = {algebra}.layout("{name}", "{" ".join(layout.blades)}"{more})')
    return layouts[layout]


def _identifier(text: str) -> str:
    word = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "ALGEBRA"
    return f"A{word}" if word[0].isdigit() or keyword.iskeyword(word) else word


def _free(word: str, taken: set[str]) -> str:
    name, count = word, 2
    while name in taken:
        name, count = f"{word}_{count}", count + 1
    return name
