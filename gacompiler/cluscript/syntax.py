"""The syntax tree of a script: immutable nodes, each with its place."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

from .tokens import Place


@dataclass(frozen=True, slots=True)
class Number:
    """An exact literal."""

    value: Fraction
    place: Place


@dataclass(frozen=True, slots=True)
class Name:
    """An identifier; `is_global` if it is preceded by ``::``."""

    text: str
    place: Place
    is_global: bool = False


@dataclass(frozen=True, slots=True)
class Argument:
    """``_P(1)``, an argument of the enclosing macro."""

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
    """Two operands with one of the operators ``+ - * / ^ .``, at the place of the operator."""

    operator: str
    left: Node
    right: Node
    place: Place


@dataclass(frozen=True, slots=True)
class Call:
    """A call of a function or a macro with its arguments."""

    name: str
    arguments: tuple[Node, ...]
    place: Place


Node = Number | Name | Argument | Unary | Binary | Call


class Mark(Enum):
    """The mark before an assignment or a name."""

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
    """``:IPNS;`` or ``:OPNS;``: the interpretation of objects drawn from here on."""

    name: str
    place: Place


@dataclass(frozen=True, slots=True)
class Declaration:
    """``DefVarsN3();`` of older scripts: the algebra for which they are written."""

    name: str
    place: Place


Statement = Assignment | Macro | Colour | NullSpace | Declaration
