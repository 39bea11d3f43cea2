"""Parser for numeric objects: the output of `str`, `repr` and `format`, and handwritten sums of blades."""

from __future__ import annotations

import re
from math import prod
from typing import Any

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.layout import Layout
from ..errors import AlgebraError, LayoutError
from .arrays import MultivectorArray, of_rows
from .layouts import layout_of

PRINTED = 1e-5
"""Tolerance for the constraints of a layout on coefficients that were printed with six digits."""

_SIGNS = re.compile(r"[+-](?:\s*[+-])*")
_NUMBER = re.compile(r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]\d+)?|(?:inf|nan)\b")
_COMPLEX = re.compile(r"\([^()\s]*j\)")
_BLADE = re.compile(r"[A-Za-z_]\w*(?:\^[A-Za-z_]\w*)*")
_HEAD = re.compile(r"([A-Za-z_]\w*)\.(\w+|\([\w^ ]*\))(?: of shape \(([\d, ]*)\):|\()")
_SPACE = re.compile(r"\s*")

Sum = dict[int, Any]
"""Coefficients by the bitmaps of their blades."""


def parse(algebra: Algebra, text: str, layout: Layout | None = None) -> Any:
    """Create multivectors from text; see `Space.parse`."""
    if not isinstance(text, str):
        raise AlgebraError("parse", f"an object of type {type(text).__name__}", 'text, such as "1 + 2 e12"')
    if layout is not None and layout.algebra != algebra:
        raise AlgebraError("parse", f"the layout {layout}", f"one of {algebra.name}")
    reader = _Reader(algebra, text)
    head = reader.take(_HEAD)
    if head:
        named = reader.layout_called(head[1], head[2])
        layout = named if layout is None else layout
    is_array = reader.next() == "["
    sums = reader.array() if is_array else [reader.sum()]
    if head and head[3] is None:
        reader.expect(")")
    if reader.next():
        raise reader.error("+, - or the end")
    shape = tuple(map(int, re.findall(r"\d+", head[3]))) if head and head[3] else (len(sums),) * is_array
    if prod(shape) != len(sums):
        raise AlgebraError("parse", f"{len(sums)} multivectors", f"{prod(shape)} for the shape {shape}")
    blades = {blade for each in sums for blade in each} | (layout.support if layout else set())
    own = layout_of(algebra, blades or {0})
    values = np.array([[each.get(slot.blade, 0.0) * slot.sign for slot in own.stored] for each in sums])
    values = values.reshape(*shape, own.size)
    found = of_rows(own, values)
    return found if layout is None or own.is_scalar else _in_layout(found, layout)


def _in_layout(found: MultivectorArray, layout: Layout) -> Any:
    try:
        return found.as_layout(layout, what="parse")
    except LayoutError:
        # Printing rounds coefficients, so relations between them hold only approximately. Coefficients that the layout
        # does not store are not affected by rounding, and deviations in them are errors.
        fixed = {slot.blade: float(value) * slot.sign for slot, value in layout.fixed}
        known = {slot.blade for slot in layout.stored} | {slot.blade for slot, _ in layout.implied}
        values = np.asarray(found.values)
        for k, slot in enumerate(found.layout.stored):
            wanted = fixed.get(slot.blade, 0.0) * slot.sign
            if slot.blade not in known and np.any(np.abs(values[..., k] - wanted) > PRINTED * abs(wanted)):
                raise
        near = found.as_layout(layout, what="parse", tolerance=PRINTED)
        return near.normalize() if layout.unit else near


class _Reader:
    """A text and the current position in it."""

    def __init__(self, algebra: Algebra, text: str) -> None:
        self.algebra, self.text, self.place = algebra, text, 0

    def next(self) -> str:
        """Skip whitespace and return the next character, without consuming it; empty at the end."""
        found = _SPACE.match(self.text, self.place)
        assert found is not None
        self.place = found.end()
        return self.text[self.place : self.place + 1]

    def take(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        """Match a pattern at the current position, and consume the match."""
        self.next()
        found = pattern.match(self.text, self.place)
        self.place = found.end() if found else self.place
        return found

    def expect(self, mark: str) -> None:
        if self.next() != mark:
            raise self.error(repr(mark))
        self.place += 1

    def error(self, expected: str, found: str = "", remedy: str = "") -> AlgebraError:
        """Return an error with the text that was found and expected at the current position."""
        words = self.text[self.place :].split(maxsplit=1)
        found = found or (repr(words[0][:20]) if words else "the end")
        where = f"parse: character {self.place + 1} of {self.text[:60]!r}"
        return AlgebraError(where, found, expected, remedy)

    def layout_called(self, algebra: str, name: str) -> Layout:
        if algebra != self.algebra.name:
            raise AlgebraError("parse", f"a multivector of {algebra}", f"one of {self.algebra.name}")
        if name.startswith("("):
            return layout_of(self.algebra, {self.algebra.blade(blade)[1] for blade in name[1:-1].split()})
        found = getattr(self.algebra, name)
        if not isinstance(found, Layout):
            raise AlgebraError("parse", f"{algebra}.{name}", f"a layout of {algebra}, such as {algebra}.full")
        return found

    def array(self) -> list[Sum]:
        self.expect("[")
        found: list[Sum] = []
        while self.next() != "]":
            if found:
                self.expect(",")
                self.next()
            if self.text.startswith("...", self.place):
                raise self.error("all elements; long arrays are abbreviated by print", remedy="use save() and load()")
            found.append(self.sum())
        self.place += 1
        return found

    def sum(self) -> Sum:
        found: Sum = {}
        signs = self.take(_SIGNS)
        while True:
            blade, value = self.term()
            value = -value if signs and signs[0].count("-") % 2 else value
            found[blade] = found[blade] + value if blade in found else value
            signs = self.take(_SIGNS)
            if not signs:
                return found

    def term(self) -> tuple[int, Any]:
        """Parse ``2.5``, ``e12``, ``2.5 e12``, ``2.5*e12`` or ``2.5e12`` to a blade and a coefficient."""
        pair = self.take(_COMPLEX)
        number = None if pair else self.take(_NUMBER)
        times = self.next() == "*" and (pair or number)
        self.place += bool(times)
        self.next()
        start = self.place
        name = self.take(_BLADE)
        if not name and (times or not (pair or number)):
            raise self.error("a blade" if times else "a number or a blade")
        sign, blade = 1, 0
        if name:
            try:
                sign, blade = self.algebra.blade(name[0])
            except AlgebraError as error:
                self.place = start
                remedy = "write the exponent of a number with a sign, 2e+12" if number else ""
                raise self.error(error.expected, f"{name[0]!r}, not a blade of {self.algebra.name}", remedy) from None
        try:
            value = complex(pair[0]) if pair else float(number[0]) if number else 1.0
        except ValueError:
            raise self.error("a complex number, (1+2j)", repr(pair[0] if pair else "")) from None
        return blade, sign * value
