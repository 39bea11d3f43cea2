"""The argument forms of constructors, and arguments as they are compared with them."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple


class Form(NamedTuple):
    """A form in which a constructor can be called."""

    constructor: str
    takes: tuple[str, ...]
    """Roles of the arguments: ``point``, ``direction``, ``line``, ``number``, ``radius``, or ``coefficients``."""
    builder: str
    """The method that is called with the arguments converted to their roles: objects, arrays, squared radii."""
    dimension: int | None = None
    """2 for the plane, 3 for space, None for both."""

    def text(self) -> str:
        """Return the text of a call in this form."""
        return f"{self.constructor}({', '.join(self.takes)})"


def _form(constructor: str, takes: str, builder: str, dimension: int | None = None) -> Form:
    return Form(constructor, tuple(takes.split()), builder, dimension)


TABLE = (
    _form("translator", "direction", "_translator"),
    _form("line", "point point", "_flat"),
    _form("line", "point direction", "_flat"),
    _form("line", "line", "_unchanged"),
    _form("line", "coefficients", "_line_of"),
    _form("plane", "point point point", "_flat", 3),
    _form("plane", "line point", "_plane_with", 3),
    _form("plane", "direction number", "_plane_at", 3),
    _form("plane", "plane", "_unchanged", 3),
    _form("plane", "coefficients", "_plane_of", 3),
    _form("point_pair", "point point", "_round"),
    _form("circle", "point radius", "_ball", 2),
    _form("circle", "point direction radius", "_circle", 3),
    _form("circle", "point point point", "_round"),
    _form("sphere", "point radius", "_ball", 3),
    _form("sphere", "point point point point", "_round", 3),
    _form("rotor", "number", "_rotate", 2),
    _form("rotor", "number point", "_rotate", 2),
    _form("rotor", "line number", "_rotate_about", 3),
    _form("rotor", "direction number", "_rotate", 3),
    _form("rotor", "direction number point", "_rotate", 3),
    _form("motor", "number", "_rotate", 2),
    _form("motor", "number direction", "_rotate_and_translate", 2),
    _form("motor", "line number number", "_screw", 3),
    _form("motor", "line number direction", "_rotate_and_translate", 3),
    _form("motor", "direction number number", "_screw_along", 3),
    _form("motor", "direction number direction", "_rotate_and_translate", 3),
)
"""The forms of all constructors; the first matching form is used. A space has those for which it defines a method."""

COEFFICIENTS = {
    ("line", 2): ("a", "b", "c"),
    ("line", 3): ("e12", "e13", "e23", "e01", "e02", "e03"),
    ("plane", 3): ("a", "b", "c", "d"),
}
"""The names of the numbers in the form ``coefficients``."""


@cache
def forms_of(name: str, dimension: int) -> tuple[Form, ...]:
    """Return the forms of a constructor in the plane or in space."""
    return tuple(form for form in TABLE if form.constructor == name and form.dimension in (None, dimension))


class SquaredRadius(NamedTuple):
    """A radius that was specified by its square."""

    value: Any


class Given(NamedTuple):
    """An argument of a constructor: its kind, its value, and its number of axes including that of coordinates."""

    kind: str
    value: Any
    axes: int

    @property
    def look(self) -> tuple[Any, ...]:
        """What the choice of a form depends on."""
        return self.kind, self.axes, self.value.shape[-1] if self.kind == "numbers" and self.axes else 0

    def text(self) -> str:
        """Return a description for error messages."""
        if self.kind != "numbers":
            return self.kind
        return f"numbers of shape {self.value.shape}" if self.axes else "a number"
