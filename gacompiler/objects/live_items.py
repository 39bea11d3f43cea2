"""What a live scene is made of: objects, functions of dragged points and sliders, and sliders."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ..algebra.multivector import Multivector
from ..errors import AlgebraError, LayoutError
from ..frontend.expression import Expression
from .arrays import MultivectorArray


class Named(NamedTuple):
    """An object of a scene with its label."""

    label: str
    value: Any


class Slider(NamedTuple):
    """A number between two limits, and where it starts."""

    name: str
    low: float
    high: float
    start: float


def slider_of(name: str, given: Any) -> Slider:
    """Return a slider of a range ``(low, high)`` or ``(low, high, start)``; it starts at the lower limit by default.

    Raises
    ------
    LayoutError
        If the range is not one of finite numbers in ascending order.
    """
    try:
        low, high, *rest = map(float, given)
        start = rest[0] if rest else low
        is_valid = len(rest) < 2 and low < high and low <= start <= high and math.isfinite(high - low)
    except (TypeError, ValueError):
        is_valid = False
    if not is_valid:
        expected = "(low, high) or (low, high, start), finite numbers with low <= start <= high and low < high"
        raise LayoutError("view", f"the slider {name!r} from {given!r}", expected)
    return Slider(str(name), low, high, start)


def is_element(x: Any) -> bool:
    """Whether a value is a multivector: of numbers, exact, or an expression."""
    return isinstance(x, (MultivectorArray, Multivector, Expression))


class Item:
    """An argument of `view`: an object, which may be a dragged point, or a function that returns objects.

    Attributes
    ----------
    function : callable or None
    point : int or None
        The index of the dragged point that the object is.
    """

    def __init__(self, x: Any, dragged: Sequence[Any], sliders: Sequence[Slider]) -> None:
        self.function: Callable[..., Any] | None = None
        self.point = next((k for k, each in enumerate(dragged) if each is x), None)
        self._object = x
        if not is_element(x):
            if not callable(x):
                raise AlgebraError(
                    "view", f"an object of type {type(x).__name__}", "multivectors, or functions of them"
                )
            self.function = x
            self._bind(x, len(dragged), [each.name for each in sliders])

    def _bind(self, function: Any, count: int, sliders: list[str]) -> None:
        """Find what each parameter of the function is: a slider by its name, or else the next dragged point."""
        parameters = list(inspect.signature(function).parameters.values())
        rest = [each.name for each in parameters if each.name not in sliders and each.default is each.empty]
        if len(rest) != count or any(each.kind in (each.VAR_POSITIONAL, each.VAR_KEYWORD) for each in parameters):
            raise LayoutError(
                "view", f"a function of ({', '.join(map(str, parameters))})",
                f"{count} parameters for the dragged points" + (f", and {', '.join(sliders)}" if sliders else ""),
                "parameters that are not sliders are the dragged points, in order",
            )  # fmt: skip
        self._names = [each.name for each in parameters if each.name in (*sliders, *rest)]
        self._sliders = sliders
        self._rest = rest

    def named(self, points: Sequence[Any], values: Sequence[Any]) -> Iterator[Named]:
        """Return the objects for dragged points and values of sliders."""
        if self.function is None:
            yield Named("", self._object if self.point is None else points[self.point])
            return
        given = dict(zip(self._rest, points, strict=True)) | dict(zip(self._sliders, values, strict=True))
        found = self.function(**{name: given[name] for name in self._names})
        if isinstance(found, Mapping):
            yield from (Named(str(label), x) for label, x in found.items())
        elif isinstance(found, (list, tuple)):
            yield from (Named("", x) for x in found)
        else:
            yield Named("", found)
