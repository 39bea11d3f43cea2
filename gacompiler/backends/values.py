"""The value types of a module, one for each named layout, and the operators that its kernels implement."""

from __future__ import annotations

import keyword
from collections.abc import Collection, Mapping
from itertools import product

from ..gac_runtime.layout import Layout
from .module import ModuleSource


def value_types(module: ModuleSource, taken: Collection[str]) -> dict[str, tuple[str, Layout]]:
    """Return the value types of a module by the names of their layouts, as pairs of a type name and a layout.

    Parameters
    ----------
    module : ModuleSource
    taken : collection of str
        Names that the module uses for other purposes.
    """
    layouts: dict[str, Layout] = {}
    for kernel in module.kernels:
        for _, layout in kernel.layouts:
            known = layouts.get(layout.name)
            if layout.blades and (known is None or (layout.unit and not known.unit)):
                layouts[layout.name] = layout
    found: dict[str, tuple[str, Layout]] = {}
    names = set(taken)
    for layout in (*layouts.values(), *_sums(layouts.values())):
        name = _type_name(layout.name.rpartition(".")[2])
        if not name.isidentifier() or keyword.iskeyword(name):
            continue
        while name in names:
            name += "_"
        names.add(name)
        found[layout.name] = name, layout
    return found


def _sums(layouts: Collection[Layout]) -> list[Layout]:
    """Return layouts for sums and multiples of elements, such as motors or points of weight 1, if none exists yet."""
    plain = {(_algebra(layout), frozenset(layout.blades)) for layout in layouts if is_plain(layout)}
    found = []
    for layout in layouts:
        blades = (*layout.blades, *(blade for blade, _ in layout.fixed))
        if not is_plain(layout) and (_algebra(layout), frozenset(blades)) not in plain:
            plain.add((_algebra(layout), frozenset(blades)))
            found.append(Layout(f"{layout.name}_SUM", blades))
    return found


def is_plain(layout: Layout) -> bool:
    """Whether any coefficients form an element, so that sums of elements are elements too."""
    return not layout.has_meaning and not layout.fixed


def combined_types(types: Mapping[str, tuple[str, Layout]]) -> list[str]:
    """Return the types that sums and multiples may have, in order of their number of coefficients."""
    plain = [(name, layout) for name, layout in types.values() if is_plain(layout)]
    return [name for name, layout in sorted(plain, key=lambda each: len(each[1].blades))]


def _algebra(layout: Layout) -> str:
    return layout.name.rpartition(".")[0]


def _type_name(name: str) -> str:
    """Convert the name of a layout to that of a type: ``UNIT_LINE`` to ``UnitLine``."""
    return "".join(part[:1].upper() + (part[1:].lower() if part.isupper() else part[1:]) for part in name.split("_"))


def class_text(name: str, variable: str) -> str:
    """Return the line that defines a type; `variable` is the name of its layout."""
    return f"class {name}(Value, layout={variable}): __slots__ = ()"


def operator_rows(
    module: ModuleSource, types: Mapping[str, tuple[str, Layout]]
) -> list[tuple[str, tuple[str, ...], str, str, bool]]:
    """Return the rows of the operator table: symbol, operands, result, kernel, and whether to swap operands."""
    rows: dict[tuple[str, tuple[str, ...]], tuple[str, str, bool]] = {}
    widened: dict[tuple[str, tuple[str, ...]], tuple[str, str, bool]] = {}
    for kernel in module.kernels:
        if kernel.operator is None:
            continue
        symbol, operands = kernel.operator
        layouts = dict(kernel.layouts)
        result = _result_type(layouts[kernel.program.results[0].name], types)
        if result is None or not all(layouts[name].name in types for name in operands):
            continue
        swapped = operands != tuple(argument.name for argument in kernel.program.arguments)
        meant = tuple(types[layouts[name].name][0] for name in operands)
        for chosen in product(*(_accepted_types(layouts[name], types) for name in operands)):
            (rows if chosen == meant else widened).setdefault((symbol, chosen), (result, kernel.program.name, swapped))
    rows |= {key: row for key, row in widened.items() if key not in rows}
    return [(*key, *row) for key, row in rows.items()]


def operator_lines(module: ModuleSource, types: Mapping[str, tuple[str, Layout]]) -> list[str]:
    """Return the text of `operator_rows`."""
    return [
        f'("{symbol}", ({", ".join(operands)}{"," if len(operands) == 1 else ""}), {result}, {kernel}, {swapped})'
        for symbol, operands, result, kernel, swapped in operator_rows(module, types)
    ]


def _result_type(layout: Layout, types: Mapping[str, tuple[str, Layout]]) -> str | None:
    """Return the type of a result: that of its layout, or of one with the same coefficients and no relations."""
    if not layout.blades:
        return "float"
    if layout.name in types:
        return types[layout.name][0]
    return next((name for name, other in types.values() if _same(layout, other) and not other.has_meaning), None)


def _accepted_types(layout: Layout, types: Mapping[str, tuple[str, Layout]]) -> list[str]:
    """Return the types whose values belong to a layout: its own, and more specific ones if it has no relations."""
    own = types[layout.name][0]
    if layout.has_meaning:
        return [own]
    return [
        own,
        *(name for name, other in types.values() if name != own and other.has_meaning and _same(layout, other)),
    ]


def _same(a: Layout, b: Layout) -> bool:
    return _algebra(a) == _algebra(b) and (a.blades, a.fixed) == (b.blades, b.fixed)
