"""Parser from the tokens of a script to its syntax tree.

Precedence follows Gaalop's grammar, from the loosest: ``+``, ``-``, ``*``, ``/``, ``.``, ``^``, then the prefixes.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from .syntax import (
    Argument,
    Assignment,
    Binary,
    Call,
    Colour,
    Declaration,
    Macro,
    Mark,
    Name,
    Node,
    NullSpace,
    Number,
    Statement,
    Unary,
)
from .tokens import Place, ScriptError, Token

PRIORITIES = {"+": 1, "-": 2, "*": 3, "/": 4, ".": 5, "^": 6}
"""Binary operators; all group to the left."""

COLOURS: dict[str, tuple[int | Fraction, ...]] = {
    "Black": (0, 0, 0), "Blue": (0, 0, 1), "Cyan": (0, 1, 1), "Green": (0, 1, 0), "Magenta": (1, 0, 1),
    "Orange": (1, Fraction(7, 10), 0), "Red": (1, 0, 0), "White": (1, 1, 1), "Yellow": (1, 1, 0),
}  # fmt: skip
NULL_SPACES = ("IPNS", "OPNS")
DECLARATIONS = ("DefVarsE2", "DefVarsE3", "DefVarsC2", "DefVarsN3")
CONTROL = ("if", "else", "loop", "break", "while", "for", "continue", "return", "switch")
UNSUPPORTED = {"Slider": "sliders", "unroll": "loops", "count": "loops", "range": "ranges outside of #pragma range"}
_MARKS = {mark.value: mark for mark in Mark if mark.value}
_NO_OPERATORS = ("%", "==", "!=", "<=", ">=", "<", ">", "&&", "||", "!!", "!", "->")


def parse(script: str, tokens: Sequence[Token]) -> tuple[Statement, ...]:
    """Return the statements of a script.

    Raises
    ------
    ScriptError
        At syntax that is not part of the language.
    """
    reader = _Reader(script, tokens)
    statements: list[Statement] = []
    while reader.token.kind != "end":
        statements += reader.statement()
    return tuple(statements)


class _Reader:
    """A reader that passes through the tokens once, from left to right."""

    def __init__(self, script: str, tokens: Sequence[Token]) -> None:
        self._script, self._tokens, self._at = script, tokens, 0
        self._arguments: list[int] | None = None  # indices of `_P` in the current macro

    @property
    def token(self) -> Token:
        """The next token."""
        return self._tokens[self._at]

    def fail(self, place: Place, found: str, expected: str = "", remedy: str = "") -> ScriptError:
        """Return an error to raise."""
        return ScriptError(self._script, place, found, expected, remedy)

    def _is(self, text: str) -> bool:
        return self.token.kind == "symbol" and self.token.text == text

    def _next(self) -> Token:
        token = self.token
        self._at += token.kind != "end"
        return token

    def _take(self, text: str, after: str) -> Token:
        if not self._is(text):
            self._refuse_operators()
            raise self.fail(self.token.place, f"{self.token} {after}", repr(text))
        return self._next()

    def _peek(self, text: str, ahead: int = 1) -> bool:
        token = self._tokens[min(self._at + ahead, len(self._tokens) - 1)]
        return token.kind == "symbol" and token.text == text

    def statement(self) -> list[Statement]:
        """Parse one statement; return None for a lone semicolon."""
        token = self.token
        if self._is(";"):
            self._next()
            return []
        if token.kind == "name" and token.text in CONTROL:
            raise self.fail(
                token.place,
                f"{token.text!r}: a script has no control flow",
                "assignments",
                "write one script for each case",
            )
        if token.kind == "name" and token.text in UNSUPPORTED:
            raise self.fail(token.place, f"{token.text!r}: scripts have no {UNSUPPORTED[token.text]}")
        if self._is(":") and (special := self._drawing()) is not None:
            return [special]
        if token.kind == "name" and token.text in DECLARATIONS and self._peek("("):
            return [self._declaration(token.place)]
        if token.kind == "name" and token.text == "_BGColor" and self._peek("="):
            self._at += 2
            if self.token.text != "Color":
                raise self.fail(self.token.place, f"{self.token} after _BGColor =", "Color(r, g, b)")
            return [self._colour(token.place, True)]
        if token.kind == "name" and self._peek("=") and self._peek("{", 2):
            return [self._macro()]
        return [self._assignment()]

    def _drawing(self) -> Statement | None:
        """Parse ``:Red;``, ``:Color(...);``, ``:IPNS`` or ``:DefVarsN3();``."""
        place, name = self.token.place, self._tokens[self._at + 1].text
        plain = name.removeprefix("N3_")
        if name == "Color" and self._peek("(", 2):
            self._next()
            return self._colour(place, False)
        if name in DECLARATIONS and self._peek("(", 2):
            self._next()
            return self._declaration(place)
        if (name not in COLOURS and plain not in NULL_SPACES) or self._peek("=", 2):
            return None
        self._at += 2
        if plain in NULL_SPACES:
            if self._is(";"):
                self._next()
            return NullSpace(plain, place)
        self._take(";", f"after :{name}")
        return Colour(tuple(Number(Fraction(value), place) for value in (*COLOURS[name], 1)), False, place)

    def _declaration(self, place: Place) -> Declaration:
        name = self._next().text
        self._take("(", f"after {name}")
        self._take(")", f"after {name}(")
        self._take(";", f"after {name}()")
        return Declaration(name, place)

    def _colour(self, place: Place, is_background: bool) -> Colour:
        self._next()
        components = self._call_arguments("Color")
        if len(components) not in (3, 4):
            raise self.fail(place, f"Color with {len(components)} components", "red, green, blue, and perhaps alpha")
        self._take(";", "after Color(...)")
        return Colour(
            components if len(components) == 4 else (*components, Number(Fraction(1), place)), is_background, place
        )

    def _macro(self) -> Macro:
        name = self._next()
        self._at += 2
        if self._arguments is not None:
            raise self.fail(name.place, f"macro {name.text} inside a macro", "macros that are not nested")
        if name.text.startswith("::") or name.text in (*COLOURS, *NULL_SPACES, "Color", "_P"):
            raise self.fail(name.place, f"{name.text} is not a valid macro name", "another name")
        self._arguments = []
        body: list[Assignment] = []
        value = None
        while not self._is("}"):
            if self.token.kind == "end":
                raise self.fail(name.place, f"macro {name.text} does not end", "'}'")
            if self._begins_value():
                value = self._expression()
                if self._is(";"):
                    self._next()
                if not self._is("}"):
                    raise self.fail(
                        self.token.place, f"{self.token} after the value of macro {name.text}", "'}'",
                        "the value comes last, and assignments end with ;",
                    )  # fmt: skip
                break
            for statement in self.statement():
                if not isinstance(statement, Assignment):
                    raise self.fail(statement.place, f"this in macro {name.text}", "assignments and an expression")
                body.append(statement)
        self._take("}", f"in macro {name.text}")
        arity = max(self._arguments, default=0)
        self._arguments = None
        return Macro(name.text, arity, tuple(body), value, name.place)

    def _begins_value(self) -> bool:
        """Return whether the next tokens are the value of a macro rather than an assignment or a mark."""
        if self._is("?") or self._is(":") or self._is("!") or self._is(";"):
            return False
        if self.token.kind == "name" and self.token.text in (*CONTROL, *UNSUPPORTED):
            return False
        return not (self.token.kind == "name" and self._peek("="))

    def _is_operand(self) -> bool:
        """Return whether the next token begins an expression and cannot continue one."""
        return self.token.kind in ("name", "number")

    def _assignment(self) -> Assignment:
        start = self.token
        mark = _MARKS.get(start.text, Mark.NONE) if start.kind == "symbol" else Mark.NONE
        if mark is not Mark.NONE:
            self._next()
        target = self.token
        if target.kind != "name" or target.text == "_P":
            raise self.fail(target.place, f"{target} where a statement begins", "a name, or one of ? : ! before it")
        self._name_is_free(target)
        self._next()
        name = Name(target.text.removeprefix("::"), target.place, target.text.startswith("::"))
        if mark in (Mark.OUTPUT, Mark.DRAW) and self._is(";"):
            self._next()
            return Assignment(name, None, mark, start.place)
        if self._is("(") and mark is Mark.NONE:
            raise self.fail(target.place, f"a call of {target.text} as a statement", "x = " + target.text + "(...);")
        self._take("=", f"after {target.text}")
        value = self._expression()
        if self._arguments is None or self._is(";") or not self._is_operand() or not self._begins_value():
            self._take(";", "after an expression")  # optional before the value of a macro
        return Assignment(name, value, mark, start.place)

    def _name_is_free(self, token: Token) -> None:
        if token.text in (*COLOURS, *NULL_SPACES, "Color", "_BGColor"):
            raise self.fail(token.place, f"{token.text} is a word of the language", "another name")
        if token.text in CONTROL or token.text in UNSUPPORTED:
            what = UNSUPPORTED.get(token.text, "control flow")
            raise self.fail(token.place, f"{token.text!r}: scripts have no {what}", "an expression")

    def _expression(self, least: int = 1) -> Node:
        left = self._prefixed()
        while self.token.kind == "symbol":
            operator = self._next_operator()
            if operator is None or PRIORITIES[operator] < least:
                return left
            place = self._next().place
            left = Binary(operator, left, self._expression(PRIORITIES[operator] + 1), place)
        return left

    def _next_operator(self) -> str | None:
        if self._is("**"):
            raise self.fail(
                self.token.place, "'**' between operands", "one of + - * / ^ .", "write x * x, or a * (*b) for a dual"
            )
        self._refuse_operators()
        return self.token.text if self.token.text in PRIORITIES else None

    def _refuse_operators(self) -> None:
        if self.token.kind == "symbol" and self.token.text in _NO_OPERATORS:
            what = "comparisons and conditions" if self.token.text != "%" else "remainders"
            raise self.fail(self.token.place, f"{self.token.text!r}: scripts have no {what}", "one of + - * / ^ .")
        if self.token.kind == "symbol" and self.token.text == "[":
            raise self.fail(self.token.place, "'[': scripts have no lists", "coefficient(x, e1) for a coefficient")

    def _prefixed(self) -> Node:
        token = self.token
        if self._is("**"):
            self._next()
            inner = Place(token.place.line, token.place.column + 1)
            return Unary("*", Unary("*", self._prefixed(), inner), token.place)
        for operator in ("-", "~", "*"):
            if self._is(operator):
                self._next()
                return Unary(operator, self._prefixed(), token.place)
        return self._primary()

    def _primary(self) -> Node:
        token = self._next()
        if token.kind == "number":
            if token.value is None:
                found = f"{token.text[:20]}, which is out of the range of doubles"
                raise self.fail(token.place, found, "a number up to 1.8e308")
            return Number(token.value, token.place)
        if token.kind == "symbol" and token.text == "(":
            inner = self._expression()
            self._take(")", "in brackets")
            return inner
        if token.kind == "name" and token.text == "_P":
            return self._argument(token)
        if token.kind == "name":
            if not self._is("("):
                self._name_is_free(token)
                return Name(token.text.removeprefix("::"), token.place, token.text.startswith("::"))
            if token.text in UNSUPPORTED or token.text in CONTROL:
                self._name_is_free(token)
            return Call(token.text.removeprefix("::"), self._call_arguments(token.text), token.place)
        self._at -= token.kind != "end"
        self._refuse_operators()
        what = "strings are not in the language" if token.kind == "string" else f"{token}"
        raise self.fail(token.place, what, "a number, a name, a bracket or one of - ~ *")

    def _argument(self, token: Token) -> Argument:
        if self._arguments is None:
            raise self.fail(token.place, "_P outside of a macro", "a name")
        self._take("(", "after _P")
        index = self._next()
        if index.kind != "number" or not index.text.isdigit() or int(index.text) < 1:
            raise self.fail(index.place, f"_P({index.text})", "the number of an argument, from 1 on")
        self._take(")", "after the number of an argument")
        self._arguments.append(int(index.text))
        return Argument(int(index.text), token.place)

    def _call_arguments(self, name: str) -> tuple[Node, ...]:
        self._take("(", f"after {name}")
        arguments: list[Node] = []
        if not self._is(")"):
            arguments.append(self._expression())
            while self._is(","):
                self._next()
                arguments.append(self._expression())
        self._take(")", f"in the arguments of {name}")
        return tuple(arguments)
