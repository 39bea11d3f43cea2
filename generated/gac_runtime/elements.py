"""Elements as arguments and results of kernels.

An element is an object that has `stored`, its coefficients and their layout, and `like`, which creates an element of
the same kind from a layout and coefficients. A kernel returns elements if all arguments with coefficients are elements.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from .arrays import element_of, plain
from .layout import Layout


def element_among(arguments: Sequence[Any], layouts: Sequence[Layout | None]) -> Any:
    """Return an element if all arguments with coefficients are elements, or lists of them; else None."""
    found = None
    for argument, layout in zip(arguments, layouts, strict=True):
        if layout is not None and layout.blades:
            found = element_of(argument)
            if found is None:
                return None
    return found


def without_elements(name: str, arguments: Iterable[Any], parameters: Iterable[tuple[str, Layout | None]]) -> list[Any]:
    """Return the arguments of a kernel as arrays and numbers.

    Raises
    ------
    TypeError
        If an element cannot be converted to the layout of its parameter.
    """
    return [
        plain(f"{name}: argument {parameter}", argument, layout)
        for argument, (parameter, layout) in zip(arguments, parameters, strict=True)
    ]


def as_elements(like: Callable[[Layout, Any], Any], results: Any, layouts: Sequence[Layout | None]) -> Any:
    """Return the results of a kernel with those that have coefficients as elements."""
    if len(layouts) > 1:
        return tuple(as_elements(like, result, [layout]) for result, layout in zip(results, layouts, strict=True))
    return like(layouts[0], results) if layouts[0] is not None and layouts[0].blades else results
