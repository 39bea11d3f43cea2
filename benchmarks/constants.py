"""Count the numeric constants of the algorithms, by chapter: ``python -m benchmarks.constants``.

Constants of modules are names that are set to numbers; each should have a sentence that says from what it follows.
Decimals are numbers with a fraction inside functions, other than halves. Tables of coefficients count as one constant.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

ALGORITHMS = Path(__file__).parents[1] / "algorithms"
PLAIN = (
    ast.Name,
    ast.Attribute,
    ast.BinOp,
    ast.UnaryOp,
    ast.Tuple,
    ast.Call,
    ast.operator,
    ast.unaryop,
    ast.expr_context,
)


class Counts(NamedTuple):
    """Constants of modules, those without a sentence, and decimals inside functions."""

    constants: int
    unexplained: int
    decimals: int


def is_number(node: ast.AST) -> bool:
    """Return whether a node is a literal number."""
    return number_of(node) is not None


def number_of(node: ast.AST) -> int | float | None:
    """Return the value of a literal number, or None."""
    value = node.value if isinstance(node, ast.Constant) else None
    return value if isinstance(value, (int, float)) and not isinstance(value, bool) else None


def is_numeric(value: ast.expr | None) -> bool:
    """Return whether an expression consists of numbers, operators and names, with at least one number."""
    nodes = [] if value is None else list(ast.walk(value))
    return any(map(is_number, nodes)) and all(is_number(node) or isinstance(node, PLAIN) for node in nodes)


def is_sentence(node: ast.stmt | None) -> bool:
    """Return whether a statement is a docstring."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def counts_of(text: str) -> Counts:
    """Count the constants of the text of a module."""
    tree = ast.parse(text)
    after = [*tree.body[1:], None]
    named = [
        following
        for node, following in zip(tree.body, after, strict=True)
        if isinstance(node, (ast.Assign, ast.AnnAssign)) and is_numeric(node.value)
    ]
    return Counts(len(named), sum(not is_sentence(node) for node in named), len(set(decimals(tree))))


def decimals(tree: ast.AST) -> Iterator[tuple[int, int]]:
    """Yield the places of numbers with a fraction inside functions, other than halves."""
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            for node in ast.walk(function):
                value = number_of(node)
                if value is not None and isinstance(node, ast.Constant) and (2 * value) % 1:
                    yield node.lineno, node.col_offset


def together(counts: Iterable[Counts]) -> Counts:
    """Return sums of counts."""
    return Counts(*(sum(column) for column in zip(*counts, strict=True)))


def main() -> None:
    """Print a line for each chapter, and the sums."""
    chapters: dict[str, list[Counts]] = {}
    for path in sorted(ALGORITHMS.rglob("*.py")):
        chapter = path.relative_to(ALGORITHMS).parts[0].removesuffix(".py")
        chapters.setdefault(chapter, []).append(counts_of(path.read_text()))
    rows = {name: together(found) for name, found in chapters.items()}
    rows["all"] = together(rows.values())
    print(f"{'chapter':16} {'constants':>10} {'unexplained':>12} {'decimals':>10}")
    for name, row in rows.items():
        if any(row):
            print(f"{name:16} {row.constants:10} {row.unexplained:12} {row.decimals:10}")


if __name__ == "__main__":
    main()
