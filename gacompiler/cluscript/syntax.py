"""The syntax tree of a script: immutable, every node with its place."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

from .tokens import Place


@dataclass(frozen=True, slots=True)
class Number:
    """A literal, exactly."""

    value: Fraction
    place: Place


@dataclass(frozen=True, slots=True)
class Name:
    """An identifier; `is_global` where ``::`` stands before it."""

    text: str
    place: Place
    is_global: bool = False


@dataclass(frozen=True, slots=True)
class Argument:
    """``_P(1)``, an argument of the macro it stands in."""

    index: int
    place: Place


@dataclass(frozen=True, slots=True)
class Unary:
    """``-x``, ``~x`` or ``*x``."""

    operator: str
    operand: Node
    place: Place


@dataclass(frozen=True, slots=True)
class Binary:
    """Two operands and ``+ - * / ^ .`` between them, at whose place it is."""

    operator: str
    left: Node
    right: Node
    place: Place


@dataclass(frozen=True, slots=True)
class Call:
    """A function or a macro with its arguments."""

    name: str
    arguments: tuple[Node, ...]
    place: Place


Node = Number | Name | Argument | Unary | Binary | Call


class Mark(Enum):
    """What stands before an assignment or a name."""

    NONE = ""
    OUTPUT = "?"
    DRAW = ":"
    EVALUATE = "!"


@dataclass(frozen=True, slots=True)
class Assignment:
    """``x = expression;`` with its mark, or ``?x;`` and ``:x;``, whose value is None."""

    target: Name
    value: Node | None
    mark: Mark
    place: Place


@dataclass(frozen=True, slots=True)
class Macro:
    """``Name = { statements expression }``; `arity` is the largest index of ``_P``, and the value may be missing."""

    name: str
    arity: int
    body: tuple[Assignment, ...]
    value: Node | None
    place: Place


@dataclass(frozen=True, slots=True)
class Colour:
    """``:Red;``, ``:Color(r, g, b, a);`` or, for the background, ``_BGColor = Color(r, g, b);``."""

    components: tuple[Node, ...]
    is_background: bool
    place: Place


@dataclass(frozen=True, slots=True)
class NullSpace:
    """``:IPNS;`` or ``:OPNS;``: how what is drawn from here on is meant."""

    name: str
    place: Place


@dataclass(frozen=True, slots=True)
class Declaration:
    """``DefVarsN3();`` of older scripts: the algebra they are written for."""

    name: str
    place: Place


Statement = Assignment | Macro | Colour | NullSpace | Declaration
