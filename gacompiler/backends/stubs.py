"""Print the stub of a Python module, from which type checkers and editors know its kernels and types.

A kernel has an overload for values of the module, one for elements of `gacompiler.objects`, one for arrays and numbers,
and one for arrays of torch, jax and cupy. The text depends on names and layouts only, and not on how kernels compute.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from ..gac_runtime.layout import Layout
from .module import KernelSource, LoopSource, ModuleSource
from .values import combined_types, operator_rows

_HEAD = """\
# mypy: disable-error-code="overload-overlap, override"
from collections.abc import Mapping
from typing import Any, Final, Generic, Literal, NamedTuple, TypeAlias, TypeVar, overload

from .gac_runtime.annotations import E, T, Array, Elements, Numbers, Real
from .gac_runtime.loop_kernel import LoopKernel
from .gac_runtime.module import Kernel as Kernel, Layout as Layout, Value as Value

_R = TypeVar("_R", covariant=True)

backend: str
num_threads: int
kernels: tuple[str, ...]
"""

_WIDTH = 120
_METHODS = {"*": "mul", "^": "xor", "&": "and", "+": "add", "-": "sub", "/": "truediv", "()": "call", "~": "invert"}


@dataclass(frozen=True)
class Stub:
    """The parts of a stub.

    Attributes
    ----------
    module : ModuleSource
    types : mapping of str to (str, Layout)
        The value types by the names of their layouts.
    layouts : mapping of Layout to str
        The layouts with the names of their variables.
    """

    module: ModuleSource
    types: Mapping[str, tuple[str, Layout]]
    layouts: Mapping[Layout, str]

    def text(self) -> str:
        """Return the text below the header of the file."""
        named = [(name, layout) for layout, name in self.layouts.items() if not layout.is_scalar]
        lines = [_HEAD, *(f"{name}: Layout" for name, _ in named), ""]
        for name, layout in named:
            accepted = [_string(each.name) for _, each in self.types.values() if fits(each, layout)]
            if accepted:
                lines.append(f"_{name}: TypeAlias = Value[Literal[{', '.join(dict.fromkeys(accepted))}]]")
        for name, layout in self.types.values():
            lines += ["", *self._type(name, layout)]
        for kernel in self.module.kernels:
            lines += ["", *self._kernel(kernel)]
        for loops in self.module.loops:
            lines += ["", *self._loops(loops)]
        return "\n".join([*(part for line in lines for part in _wrapped(line)), ""])

    @cached_property
    def _by_name(self) -> dict[str, Layout]:
        return dict(self.types.values())

    def _type(self, name: str, layout: Layout) -> list[str]:
        """Print a value type with its coefficients and operators."""
        fields = [_field(blade) for blade in layout.blades]
        fixed = [_field(blade) for blade, value in layout.fixed if value != "implied"]
        lines = [f"class {name}(Value[Literal[{_string(layout.name)}]]):"]
        if len(fields) > 1:
            numbers = ", ".join(f"{field if field != 'self' else 'self_'}: float" for field in fields)
            lines += [
                "    @overload",
                "    def __init__(self, coefficients: Numbers | Elements, /) -> None: ...",
                "    @overload",
                f"    def __init__(self, {numbers}, /) -> None: ...",
            ]
        else:
            lines += ["    def __init__(self, coefficients: Numbers | Elements, /) -> None: ..."]
        lines += [f"    {field}: Final[float]" for field in dict.fromkeys([*fields, *fixed])]
        for symbol, method in _METHODS.items():
            for reflected in (False, True):
                others: dict[str, list[str]] = {}
                for other, result in self._operators(name, symbol, reflected):
                    others.setdefault(result, []).append(other)
                word = f"__r{method}__" if reflected else f"__{method}__"
                for result, kinds in others.items():
                    lines += ["    @overload"] if len(others) > 1 else []
                    operand = f", other: {' | '.join(kinds)}, /" if kinds[0] else ""
                    lines.append(f"    def {word}(self{operand}) -> {result}: ...")
        negative = self._negative(layout)
        return [*lines, f"    def __neg__(self) -> {negative}: ..."] if negative else lines

    def _operators(self, name: str, symbol: str, reflected: bool) -> Iterable[tuple[str, str]]:
        """Return the other operand and the result of an operator, for all operands for which it is defined."""
        if not reflected:
            for operands, result in self._rows.get(symbol, ()):
                if operands[0] == name:
                    yield " ".join(operands[1:]), result
        known = {operands[1] for operands, _ in self._rows.get(symbol, ()) if operands[0] == name and operands[1:]}
        number = Layout("", ("1",))
        if symbol in "+-":
            others = {} if reflected else {each: layout for each, layout in self._by_name.items() if each not in known}
            for other, layout in {**others, "float": number}.items():
                pair = (layout, self._by_name[name]) if reflected else (self._by_name[name], layout)
                found = self._sum(symbol, *pair)
                if found:
                    yield other, found
        elif symbol == "*" or (symbol == "/" and not reflected):
            found = self._multiple(self._by_name[name])
            if found:
                yield "float", found

    @cached_property
    def _rows(self) -> dict[str, list[tuple[tuple[str, ...], str]]]:
        found: dict[str, list[tuple[tuple[str, ...], str]]] = {}
        for symbol, operands, result, _, _ in operator_rows(self.module, self.types):
            found.setdefault(symbol, []).append((operands, result))
        return found

    def _sum(self, symbol: str, a: Layout, b: Layout) -> str | None:
        """Return the type of a sum, as the runtime chooses it; equal fixed coefficients cancel in a difference."""
        stored = {*a.blades, *b.blades}
        one, two = dict(a.fixed), dict(b.fixed)
        rest = {
            blade
            for blade in (one | two)
            if not (symbol == "-" and one.get(blade) == two.get(blade) and one.get(blade) != "implied")
        }
        return self._combined(stored | rest, [each for each in (a, b) if each.name])

    def _multiple(self, layout: Layout) -> str | None:
        return self._combined({*layout.blades, *dict(layout.fixed)}, [layout])

    def _negative(self, layout: Layout) -> str | None:
        own = next(name for name, each in self.types.values() if each == layout)
        return own if layout.unit and not layout.fixed else self._multiple(layout)

    def _combined(self, blades: set[str], values: Sequence[Layout]) -> str | None:
        algebras = {each.name.rpartition(".")[0] for each in values}
        sums = combined_types(self.types)
        own = [name for name, layout in self.types.values() if layout in values and name in sums]
        own.sort(key=lambda name: values.index(self._by_name[name]))
        for name in (*own, *sums):
            layout = self._by_name[name]
            if blades <= set(layout.blades) and algebras == {layout.name.rpartition(".")[0]}:
                return name
        return None

    def _kernel(self, kernel: KernelSource) -> list[str]:
        known = dict(kernel.layouts)
        arguments = [] if kernel.is_constant else list(kernel.program.arguments)
        inputs = [(each.name, known.get(each.name), bool(each.shape), True) for each in arguments]
        results = [(known.get(each.name), bool(each.shape)) for each in kernel.program.results]
        return self._declared(kernel.program.name, "Kernel", kernel.summary, inputs, results, kernel.result_names)

    def _loops(self, loops: LoopSource) -> list[str]:
        known, procedure = dict(loops.layouts), loops.procedure
        # A value is a single element, and not an argument with rows.
        inputs = [(each.name, known.get(each.name), True, not each.lengths) for each in procedure.parameters]
        results = [(known.get(each.name), bool(each.lengths or each.shape)) for each in procedure.results]
        return self._declared(procedure.name, "LoopKernel", loops.summary, inputs, results, ())

    def _declared(
        self,
        name: str,
        base: str,
        summary: str,
        inputs: Sequence[tuple[str, Layout | None, bool, bool]],
        results: Sequence[tuple[Layout | None, bool]],
        fields: Sequence[str],
    ) -> list[str]:
        """Print the class of a kernel and the kernel."""
        names = [each if not keyword.iskeyword(each) and each not in ("self", "out", "num_threads") else f"{each}_"
                 for each, *_ in inputs]  # fmt: skip
        record = f"{_title(name)}Results" if fields else ""
        has_coefficients = [bool(layout is not None and layout.blades) for _, layout, *_ in inputs]
        signatures: list[tuple[list[str], str, str]] = []

        def add(kinds: Sequence[str], result: str, options: str) -> None:
            given = [f"{each}: {kind}" for each, kind in zip(names, kinds, strict=True)]
            signatures.append((given, options, result))

        def returned(coefficients: Sequence[str], numbers: str) -> str:
            parts = [c if layout is not None and layout.blades else "Array" if is_array else numbers
                     for c, (layout, is_array) in zip(coefficients, results, strict=True)]  # fmt: skip
            if record:
                kinds = dict.fromkeys(c for c, (layout, _) in zip(coefficients, results, strict=True)
                                      if layout is not None and layout.blades)  # fmt: skip
                return f"{record}[{' | '.join(kinds)}]" if kinds else record
            return parts[0] if len(parts) == 1 else f"tuple[{', '.join(parts)}]"

        threads = "num_threads: int | None = None"
        aliases = [self._alias(layout) if is_single else "" for _, layout, _, is_single in inputs]
        if any(has_coefficients):
            single = ["float" if not is_array else "Numbers" for _, _, is_array, _ in inputs]
            if all(alias for alias, one in zip(aliases, has_coefficients, strict=True) if one):
                kinds = [alias or number for alias, number in zip(aliases, single, strict=True)]
                add(kinds, returned([self._type_of(layout) for layout, _ in results], "float"), threads)
            kinds = ["E" if one else "Numbers" for one in has_coefficients]
            add(kinds, returned(["E"] * len(results), "Real"), threads)
        out = f"out: {'Array' if len(results) == 1 else 'tuple[Array, ...]'} | None = None, {threads}"
        kinds = [" | ".join(filter(None, ["Numbers", "Elements" * one, alias]))
                 for one, alias in zip(has_coefficients, aliases, strict=True)]  # fmt: skip
        add(kinds, returned(["Array"] * len(results), "Real"), out)
        if inputs and not record:
            add(["T | Numbers"] * len(inputs), "T" if len(results) == 1 else "Any", threads)
        lines = [] if not record else [*self._record(record, fields, results), ""]
        lines += [f"class _{_title(name)}({'' if record else base}):".replace("()", "")]
        first = next(iter(summary.strip().splitlines()), "")
        lines += [f"    {_string(first)}"] if first else []
        if record:
            lines += [f"    kernel: {base}", "    cost: Mapping[str, int]", "    layouts: Mapping[str, Layout]"]
        for given, options, result in signatures:
            lines += ["    @overload"] if len(signatures) > 1 else []
            parts = ", ".join(["self", *given, f"*, {options}"])
            lines.append(f"    def __call__({parts}) -> {result}: ...")
        return [*lines, "", f"{name}: _{_title(name)}"]

    def _record(self, record: str, fields: Sequence[str], results: Sequence[tuple[Layout | None, bool]]) -> list[str]:
        """Print the type of named results, which is generic if some have coefficients."""
        kinds = ["_R" if layout is not None and layout.blades else "Array" if is_array else "Real"
                 for layout, is_array in results]  # fmt: skip
        generic = ", Generic[_R]" if "_R" in kinds else ""
        return [
            f"class {record}(NamedTuple{generic}):",
            *(f"    {field}: {kind}" for field, kind in zip(fields, kinds, strict=True)),
        ]

    def _alias(self, layout: Layout | None) -> str:
        """Return the alias of the values that are accepted for a layout; empty if there are none."""
        if layout is None or not layout.blades or not any(fits(each, layout) for _, each in self.types.values()):
            return ""
        return f"_{self.layouts[layout]}"

    def _type_of(self, layout: Layout | None) -> str:
        """Return the type of a value with this layout; the runtime creates one if the module names none."""
        if layout is None:
            return "Array"
        same = (name for name, each in self.types.values() if _identity(each) == _identity(layout))
        return next(same, f"Value[Literal[{_string(layout.name)}]]")


def fits(own: Layout, wanted: Layout) -> bool:
    """Whether the coefficients of elements can be those of another layout, as the runtime converts them."""
    if own.name.rpartition(".")[0] != wanted.name.rpartition(".")[0]:
        return False
    given, fixed = dict(own.fixed), dict(wanted.fixed)
    kept = {*wanted.blades, *fixed}
    return (
        kept >= {*own.blades, *given}
        and all(blade in own.blades or blade in given for blade in fixed)
        and all(fixed.get(blade, value) in (value, "implied") or value == "implied" for blade, value in given.items())
    )


def _identity(layout: Layout) -> tuple[object, ...]:
    return layout.name.rpartition(".")[0], layout.blades, layout.fixed, layout.implied, layout.unit


def _field(blade: str) -> str:
    """Return the attribute of a coefficient."""
    return "scalar" if blade == "1" else blade.replace("^", "_")


def _wrapped(line: str) -> list[str]:
    """Break a long line after commas and bars, which are within brackets."""
    if len(line) <= _WIDTH or "\n" in line or line.lstrip().startswith('"'):
        return [line]
    indent = " " * (len(line) - len(line.lstrip()) + 4)
    lines = [""]
    for part in re.split(r"(?<=, )|(?<= \| )", line):
        if len(lines[-1]) + len(part.rstrip()) > _WIDTH and lines[-1].strip():
            lines.append(indent)
        lines[-1] += part
    return [each.rstrip() for each in lines]


def _title(name: str) -> str:
    return "".join(word.capitalize() if word.islower() else word for word in name.split("_"))


def _string(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
