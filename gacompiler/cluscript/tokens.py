"""The tokens of a script, with their places."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from ..algebra.coefficients import is_representable
from ..errors import SpecError


class Place(NamedTuple):
    """A position in a script: line and column, counted from 1."""

    line: int
    column: int


class ScriptError(SpecError):
    """A script that cannot be read, with the place of the error.

    Attributes
    ----------
    line, column : int
        Counted from 1.
    """

    def __init__(self, script: str, place: Place, found: str, expected: str = "", remedy: str = "") -> None:
        self.line, self.column = place
        super().__init__(f"{script}:{place.line}:{place.column}", found, expected, remedy)


@dataclass(frozen=True, slots=True)
class Token:
    """One token: ``name``, ``number``, ``string``, ``symbol`` or ``end``."""

    kind: str
    text: str
    place: Place

    @property
    def value(self) -> Fraction | None:
        """Return the exact value of a number; None if it is out of the range of doubles."""
        text = self.text.rstrip("fdFD")
        _, _, exponent = text.lower().partition("e")
        if len(text) > _LONGEST_NUMBER or abs(int(exponent or 0)) > _LONGEST_NUMBER:
            return None
        number = Fraction(text)
        return number if is_representable(number) else None

    def __str__(self) -> str:
        return "the end of the script" if self.kind == "end" else repr(self.text)


@dataclass(frozen=True, slots=True)
class Directive:
    """A line ``#pragma NAME REST``, or the same as a comment."""

    name: str
    rest: str
    place: Place


_LONGEST_NUMBER = 1000
"""Largest number of digits of a number, and its largest exponent."""
_EXPONENT = r"[eE][+-]?\d+"
_WORD = re.compile(
    rf"(?P<number>(?:\d+\.\d*|\.\d+)(?:{_EXPONENT})?[fd]?|\d+{_EXPONENT}[fd]?|\d+[fd](?![\w$])|\d+)"
    r"|(?P<name>(?:::)?[A-Za-z_$][\w$]*)"
    r'|(?P<string>"[^"\n]*")'
    r"|(?P<symbol>==|!=|<=|>=|->|&&|\|\||!!|\*\*|[-+*/^.~=;,(){}?:!<>%\[\]])",
    re.ASCII,
)
"""Numbers as in C, with the longest match, so that ``2.e1`` is twenty."""
_SPACE = re.compile(r"\s+")
_DIRECTIVE = re.compile(r"[ \t]*(?://)?#(?P<word>\w*)[ \t]*(?P<rest>.*)")


def words(script: str, text: str) -> tuple[list[Token], list[Directive]]:
    """Return the tokens of a script, including one for its end, and its directives.

    Parameters
    ----------
    script : str
        Name of the script in error messages.
    text : str

    Raises
    ------
    ScriptError
        At a character that begins no token, or a comment that does not end.
    """
    tokens: list[Token] = []
    directives: list[Directive] = []
    position, line, start = 0, 1, 0  # `start` is where the line begins

    def place() -> Place:
        return Place(line, position - start + 1)

    while position < len(text):
        end = text.find("\n", position)
        end = len(text) if end < 0 else end
        if not text[start:position].strip() and (found := _DIRECTIVE.fullmatch(text, position, end)):
            is_comment = text[position:end].lstrip().startswith("//")
            if found["word"] == "pragma":
                directives.append(_directive(script, found["rest"], Place(line, found.start("rest") - start + 1)))
                position = end
                continue
            if not is_comment:
                shown = Place(line, found.start("word") - start)
                raise ScriptError(script, shown, f"a directive #{found['word']}", "#pragma", "write // for a comment")
        if space := _SPACE.match(text, position):
            line += space[0].count("\n")
            if "\n" in space[0]:
                start = position + space[0].rindex("\n") + 1
            position = space.end()
        elif text.startswith("//", position):
            position = end
        elif text.startswith("/*", position):
            close = text.find("*/", position + 2)
            if close < 0:
                raise ScriptError(script, place(), "a comment that does not end", "*/")
            comment = text[position:close]
            if "\n" in comment:
                line += comment.count("\n")
                start = position + comment.rindex("\n") + 1
            position = close + 2
        elif word := _WORD.match(text, position):
            tokens.append(Token(str(word.lastgroup), word[0], place()))
            position = word.end()
        else:
            raise ScriptError(script, place(), f"the character {text[position]!r}", "a word of the language")
    tokens.append(Token("end", "", place()))
    return tokens, directives


def _directive(script: str, rest: str, place: Place) -> Directive:
    name, _, text = rest.strip().partition(" ")
    if not name:
        raise ScriptError(script, place, "a pragma without a name", "#pragma output, range, ...")
    return Directive(name.rstrip(";"), text.strip().rstrip(";").strip(), place)
