"""Mutations of emitted kernels: one sign, operation, name, number, pair of parentheses or order is changed."""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Iterator
from typing import NamedTuple


class Mutation(NamedTuple):
    """A mutated text."""

    kind: str
    line: str
    """The original line."""
    changed: str
    text: str


_WORDS = frozenset({"const", "REAL", "void", "return"})
_NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?![\w.])")
_NAME = re.compile(r"(?<![\w.])[A-Za-z]\w*(?![\w(])")


def _bodies(text: str, kernel: str, of_forms: bool) -> list[tuple[int, int]]:
    """Find the statements of a kernel, and of its forms if requested, in C or Python text."""
    if text.startswith("//"):
        more = r"_within|_(?:prepare|apply)_\w+" if of_forms else "_within"
        heads = rf"^(?:static )?INLINE void NAME\({kernel}(?:{more})?\)\([^{{]*?^{{\n(.*?)^}}$"
        return [match.span(1) for match in re.finditer(heads, text, re.DOTALL | re.MULTILINE)]
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []
    for node in ast.parse(text).body:
        name = node.name if isinstance(node, ast.FunctionDef) else ""
        if name == kernel or (of_forms and re.fullmatch(rf"_{kernel}_(prepare|apply)_\w+", name)):
            assert isinstance(node, ast.FunctionDef)
            statements = [statement for statement in node.body if not isinstance(statement, ast.Expr)]
            found.append((starts[statements[0].lineno - 1], starts[statements[-1].end_lineno or 0]))
    return found


def mutations(text: str, kernel: str, of_forms: bool = True) -> Iterator[Mutation]:
    """All single mutations in the bodies of a kernel, and of its forms if requested."""
    for start, end in _bodies(text, kernel, of_forms):
        body = text[start:end]
        for kind, first, last, new in _changes(body, is_c=text.startswith("//")):
            if body[first:last] == new:
                continue
            changed = body[:first] + new + body[last:]
            begin = body.rfind("\n", 0, first) + 1
            old_line, new_line = (part[begin:].partition("\n")[0] for part in (body, changed))
            yield Mutation(kind, old_line, new_line, text[:start] + changed + text[end:])


def _changes(body: str, is_c: bool) -> Iterator[tuple[str, int, int, str]]:
    """Kind, place and replacement."""
    operations = {"+": "-", "-": "+", "*": "+", "/": "*"}
    for match in re.finditer(r"(?<= )[-+*/](?= )", body):
        yield "operation", *match.span(), operations[match[0]]
    names = [match for match in _NAME.finditer(body) if match[0] not in _WORDS]
    every = list(dict.fromkeys(match[0] for match in names))
    for k, match in enumerate(names):
        yield "operand", *match.span(), every[(every.index(match[0]) + 1 + k % max(1, len(every) - 1)) % len(every)]
        yield "sign", *match.span(), f"-{match[0]}"
    for match in _NUMBER.finditer(body):
        yield "number", *match.span(), str(int(float(match[0])) + 1)
    yield from _without_parentheses(body)
    yield from _exchanged(body, r"\[\d+\]" if is_c else r"(?<![\w.])\w+(?=[,)])")


def _without_parentheses(body: str) -> Iterator[tuple[str, int, int, str]]:
    """Remove parentheses around sums that are factors or subtrahends; all others do not change the value."""
    for match in re.finditer(r"(?<=[-*/] )\(", body):
        depth, end = 0, match.start()
        top = ""
        while True:
            depth += {"(": 1, ")": -1}.get(body[end], 0)
            top += body[end] if depth == 1 else ""
            end += 1
            if depth == 0:
                break
        if re.search(r" [-+] ", top):
            yield "parentheses", match.start(), end, body[match.end() : end - 1]


def _exchanged(body: str, pattern: str) -> Iterator[tuple[str, int, int, str]]:
    """Exchange neighbours in a list of components, results or operands of a function."""
    found = list(re.finditer(pattern, body))
    for a, b in itertools.pairwise(found):
        between = body[a.end() : b.start()]
        yield "order", a.start(), b.end(), b[0] + between + a[0]
