"""The macros of a script, and checks of calls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches

from .dialects import Dialect
from .functions import FUNCTIONS
from .syntax import Assignment, Binary, Call, Colour, Macro, Node, Statement, Unary
from .tokens import ScriptError

Macros = Mapping[tuple[str, int], Macro]


def macros_of(script: str, statements: Sequence[Statement]) -> dict[tuple[str, int], Macro]:
    """Return the macros that the statements define.

    Raises
    ------
    ScriptError
        If a macro is defined twice.
    """
    found: dict[tuple[str, int], Macro] = {}
    for statement in statements:
        if isinstance(statement, Macro):
            key = (statement.name, statement.arity)
            if key in found:
                first = found[key].place
                what = f"macro {statement.name} of {statement.arity} arguments is already defined in line {first.line}"
                raise ScriptError(script, statement.place, what, remedy="rename one of them")
            found[key] = statement
    return found


def check_calls(script: str, macros: Macros, statements: Sequence[Statement], dialect: Dialect) -> None:
    """Raise an error for calls of undefined functions and for recursive macros.

    Raises
    ------
    ScriptError
        At such a call.
    """
    calls: dict[tuple[str, int], list[Call]] = {key: [] for key in macros}
    for key, macro in macros.items():
        nodes = [
            *(each.value for each in macro.body if each.value is not None),
            *([macro.value] if macro.value else []),
        ]
        calls[key] = [call for node in nodes for call in _calls(node)]
    outside: list[Call] = []
    for statement in statements:
        if isinstance(statement, Assignment) and statement.value is not None:
            outside += _calls(statement.value)
        elif isinstance(statement, Colour):
            outside += [call for node in statement.components for call in _calls(node)]
    for call in sorted([*outside, *(call for some in calls.values() for call in some)], key=lambda call: call.place):
        _check(script, call, macros, dialect)
    done: set[tuple[str, int]] = set()
    for key in macros:
        _refuse_recursion(script, key, calls, [], done)


def _refuse_recursion(
    script: str, key: tuple[str, int], calls: Mapping[tuple[str, int], list[Call]], path: list[tuple[str, int]],
    done: set[tuple[str, int]],
) -> None:  # fmt: skip
    path.append(key)
    for call in calls[key]:
        called = (call.name, len(call.arguments))
        if called in path:
            raise ScriptError(script, call.place, f"macro {call.name} calls itself", "macros that end")
        if called in calls and called not in done:
            _refuse_recursion(script, called, calls, path, done)
    done.add(path.pop())


def _calls(node: Node) -> list[Call]:
    found: list[Call] = []
    todo = [node]
    while todo:
        each = todo.pop()
        if isinstance(each, Binary):
            todo += [each.left, each.right]
        elif isinstance(each, Unary):
            todo.append(each.operand)
        elif isinstance(each, Call):
            found.append(each)
            todo += each.arguments
    return found


def _check(script: str, call: Call, macros: Macros, dialect: Dialect) -> None:
    n, name = len(call.arguments), call.name
    if (name, n) in macros or (name, n) in dialect.macros:
        return
    known = {**FUNCTIONS, "coefficient": (2, None)}
    if name.lower() in known:
        arity = known[name.lower()][0]
        if n == arity:
            return
        raise ScriptError(script, call.place, f"{name} of {n} arguments", f"{arity}")
    arities = sorted(k for each, k in (*macros, *dialect.macros) if each == name)
    if arities:
        raise ScriptError(script, call.place, f"{name} of {n} arguments", " or ".join(map(str, arities)))
    names = sorted({*(each for each, _ in (*macros, *dialect.macros)), *known})
    near = get_close_matches(name, names, 1)
    hint = f"did you mean {near[0]}?" if near else f"{dialect.algebra.name} has {' '.join(names)}"
    raise ScriptError(script, call.place, f"no macro or function named {name}", "a defined macro", hint)
