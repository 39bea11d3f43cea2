"""Tokens of C, and the lists and expressions in kernels with loops that consist of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from ..errors import BackendError

_TOKEN = re.compile(r"\s+|\w+|--|\+\+|&&|>=|!=|\+=|\|=|[-+*/<>=?:&()\[\]{},;]")

Tree = str | int | tuple["Tree", ...]
"""A name, a number, or an operation with its operands: ``("+", "q", "i")``."""

_LEVELS: tuple[tuple[str, ...], ...] = (("&&",), (">=", "<", ">", "!="), ("+", "-"), ("*", "/"))
"""Infix operators in order of increasing precedence."""

_ENTRY = re.compile(r"\b(LENGTH|IN|NUMBER|SAME|INDEX|OUT|WORK)\((\d+), ([^()]*)\)")


class Entry(NamedTuple):
    """An entry of a list of tables."""

    kind: str
    fields: tuple[str, ...]


def listed(lines: Sequence[str], start: str) -> list[Entry]:
    """Return the entries of the list defined in the line with this beginning."""
    first = next((k for k, line in enumerate(lines) if line.startswith(start)), None)
    if first is None:
        raise BackendError("C text", f"no line {start!r}", "a file written by gacompiler")
    last = next(k for k in range(first, len(lines)) if not lines[k].endswith("\\"))
    text = " ".join(line.removesuffix("\\").strip() for line in lines[first : last + 1])
    return [Entry(kind, tuple(fields.split(", "))) for kind, _, fields in _ENTRY.findall(text.partition(") ")[2])]


def tokens_of(name: str, text: str) -> list[str]:
    """Split a text of the kernel `name` into tokens."""
    tokens, place = [], 0
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None:
            raise BackendError(f"C text of {name}", f"{text[place]!r}", "a character used by gacompiler")
        place = match.end()
        tokens += [match[0]] if match[0].strip() else []
    return tokens


class Tokens:
    """Parses expressions from a sequence of tokens."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._tokens: list[str] = []
        self._at = 0

    def _expression(self) -> Tree:
        found = self._binary(0)
        if self._next() != "?":
            return found
        self._expect("?")
        chosen = self._expression()
        self._expect(":")
        return ("?", found, chosen, self._expression())

    def _binary(self, level: int) -> Tree:
        if level == len(_LEVELS):
            return self._unary()
        found = self._binary(level + 1)
        while self._next() in _LEVELS[level]:
            operator = self._take()
            found = (operator, found, self._binary(level + 1))
        return found

    def _unary(self) -> Tree:
        token = self._take()
        if token == "&":
            return ("&", self._unary())
        if token == "(" and self._next() == "intptr_t":
            self._expect("intptr_t", ")")
            return ("row", self._unary())
        if token == "(":
            found = self._expression()
            self._expect(")")
        elif token.isdigit():
            found = int(token)
        elif token.isidentifier() and self._next() == "(" and token.startswith(("gac_", "GAC_")):
            found = self._call(token)
        elif token.isidentifier():
            found = token
        else:
            raise self._wrong(token)
        while self._next() == "[":
            self._expect("[")
            found = ("[]", found, self._expression())
            self._expect("]")
        return found

    def _call(self, name: str) -> Tree:
        self._expect("(")
        arguments = [self._expression()]
        while self._next() == ",":
            self._expect(",")
            arguments.append(self._expression())
        self._expect(")")
        return ("()", name, *arguments)

    def _next(self) -> str:
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    def _take(self) -> str:
        self._at += 1
        return self._tokens[self._at - 1] if self._at <= len(self._tokens) else ""

    def _end(self) -> int:
        """Return the index of the end of the statement."""
        if ";" not in self._tokens[self._at :]:
            raise self._wrong("an unterminated statement")
        return self._tokens.index(";", self._at)

    def _expect(self, *tokens: str) -> None:
        for token in tokens:
            found = self._take()
            if found != token:
                raise self._wrong(f"{found!r} instead of {token!r}")

    def _wrong(self, found: str) -> BackendError:
        near = " ".join(self._tokens[max(0, self._at - 8) : self._at + 4])
        return BackendError(f"C text of {self._name}", f"{found} near {near!r}", "a text written by gacompiler")


def factors_of(tree: Tree) -> list[Tree]:
    """Return the factors of a product."""
    match tree:
        case ("*", left, right):
            return [*factors_of(left), right]
    return [tree]
