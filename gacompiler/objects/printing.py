"""Formatting of numeric objects as text and as LaTeX, with the names of their blades."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..gac_runtime.array_element import Element

SHOWN = 6
"""The largest number of elements of an array that are printed; longer arrays are abbreviated to the first and last."""

_SIX_DIGITS = ".6g"


def text_of(x: Element, form: str = _SIX_DIGITS) -> str:
    """Format a multivector as a sum of blades, an array as a list of sums; `form` is the format of numbers."""
    if not x.shape:
        return _sum(terms_of(x), "{} {}", form)
    return "[" + ",\n ".join("..." if each is None else text_of(each, form) for each in _some(x)) + "]"


def repr_of(x: Element) -> str:
    """Format as `text_of` does, with the layout and the shape."""
    if not x.shape:
        return f"{x.layout}({text_of(x)})"
    return f"{x.layout} of shape {x.shape}:\n{text_of(x)}"


def latex_of(x: Element) -> str:
    """Format as `text_of` does, in LaTeX."""
    if not x.shape:
        return f"${_latex(x)}$"
    lines = [r"& \vdots" if each is None else f"& {_latex(each)}" for each in _some(x)]
    return "$" + r"\begin{aligned}" + r" \\ ".join(lines) + r"\end{aligned}" + "$"


def terms_of(x: Element) -> list[tuple[str, Any]]:
    """Return the nonzero coefficients of a multivector by blade, stored and other ones, ordered by grade."""
    layout = x.layout
    slots = (*layout.stored, *(slot for slot, _ in layout.fixed), *(slot for slot, _ in layout.implied))
    ordered = sorted(slots, key=lambda slot: (slot.blade.bit_count(), slot.blade)) if layout.implied else slots
    found = [(slot.name, x[slot.name]) for slot in ordered]
    return [(name, value) for name, value in found if value != 0]


def _some(x: Element) -> Iterator[Any]:
    half, n = SHOWN // 2, x.size
    for k in range(n) if n <= SHOWN else (*range(half), None, *range(n - half, n)):
        yield None if k is None else x[np.unravel_index(k, x.shape)]


def _sum(terms: list[tuple[str, Any]], pattern: str, form: str = _SIX_DIGITS) -> str:
    text = ""
    for name, value in terms:
        negative = not np.iscomplexobj(value) and value < 0
        number = format(-value if negative else value, form)
        number = f"({number})" if np.iscomplexobj(value) else number
        term = number if name == "1" else name if number == "1" else pattern.format(number, name)
        text += (" - " if negative else " + ") + term if text else ("-" if negative else "") + term
    return text or "0"


def _latex(x: Element) -> str:
    text = _sum([(_blade(name), value) for name, value in terms_of(x)], r"{}\,{}")
    return re.sub(r"(\d)e([+-]\d+)", lambda m: f"{m[1]}\\cdot 10^{{{int(m[2])}}}", text)


def _blade(name: str) -> str:
    """Format ``e12inf`` as ``\\mathbf{e}_{12\\infty}``."""
    if name == "1":
        return name
    parts = []
    for part in name.split("^"):
        label = part[1:].replace("inf", r"\infty")
        parts.append(rf"\mathbf{{{part[0]}}}_{{{label}}}" if label else rf"\mathbf{{{part}}}")
    return r"\wedge".join(parts)
