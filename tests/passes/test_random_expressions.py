"""Random expressions in random algebras against matrices, which share no code with the compiler."""

from __future__ import annotations

from functools import cache
from random import Random
from typing import Any

import matrix_algebra
import numpy as np
import pytest
from exact_elements import OBLIQUE
from matrix_algebra import Element, MatrixAlgebra

import gacompiler
from gacompiler import Algebra, kernel
from gacompiler.algebra.catalog import CGA2, CGA3, PGA2, PGA3, STA, VGA3, null_pairs, orthogonal
from gacompiler.algebra.layout import Layout
from gacompiler.ir.interpret import Tape
from gacompiler.passes.pipeline import compile_kernel

ALGEBRAS = (VGA3, PGA2, PGA3, CGA2, CGA3, STA, OBLIQUE, null_pairs(2), *(orthogonal(*s) for s in ((4,), (2, 2), (5,))))
FUNCTIONS = ("inner_product", "left_contraction", "right_contraction", "scalar_product", "commutator")
"""Functions of two elements."""
matrices = cache(lambda algebra: MatrixAlgebra(algebra.gram))


def random_tree(random: Random, leaves: list[str], depth: int) -> Any:
    """A random expression: a name, or an operation with its operands."""
    if depth == 0:
        return random.choice(leaves)
    kind = random.random()
    if kind < 0.15:
        return ("sandwich", "v", random_tree(random, leaves, depth - 1))
    if kind < 0.3:
        return (random.choice(("norm_squared", "~", "grade")), random_tree(random, leaves, depth - 1))
    operation = random.choice((*FUNCTIONS, "^", "^", "^", "*", "+", "-"))
    return (operation, random_tree(random, leaves, depth - 1), random_tree(random, leaves, random.randrange(depth)))


def computed(tree: Any, names: dict[str, Any], functions: Any) -> Any:
    """The value of an expression, of elements of the compiler or of matrices."""
    if isinstance(tree, str):
        return names[tree]
    operation, *operands = tree
    values = [computed(each, names, functions) for each in operands]
    match operation:
        case "^":
            return values[0] ^ values[1]
        case "*":
            return values[0] * values[1]
        case "+":
            return values[0] + values[1]
        case "-":
            return values[0] - values[1]
        case "~":
            return ~values[0]
        case "grade":
            return values[0].grade(0, 1, 3)
    return getattr(functions, operation)(*values)


def unit_versor(random: Random, algebra: Algebra) -> Any:
    """The product of two vectors with a positive square, divided by their lengths, as coefficients by bitmap."""
    engine, found = matrices(algebra), list[Element]()
    while len(found) < 2:
        vector = np.zeros(len(engine.grades))
        vector[engine.grades == 1] = [random.gauss(0, 1) for _ in algebra.vectors]
        square = (Element(engine, vector) * Element(engine, vector)).value[0]
        found += [Element(engine, vector / np.sqrt(square))] if square > 0.3 else []
    return (found[0] * found[1]).value


def coefficients(algebra: Algebra, layout: Layout, stored: Any) -> Any:
    """The coefficients by bitmap of an element with these stored coefficients."""
    value = np.zeros(1 << algebra.dimension)
    for blade, x in layout.element(list(map(float, stored))).terms.items():
        value[blade] = float(x)
    return value


def compare(seed: int) -> bool:
    """Compare one random expression at three points; False if its result is too small to be compared."""
    random = Random(f"expression {seed}")
    algebra = random.choice(ALGEBRAS)
    vector, versor = algebra.layout("vector", " ".join(algebra.vectors)), algebra.UNIT_EVEN
    point = algebra.layouts.get("POINT", vector)
    layouts = {"a": vector, "b": vector, "c": point, "d": point, "v": versor}
    tree = (
        ("norm_squared", random_tree(random, list("abcd"), 2))
        if seed % 4 == 0
        else random_tree(random, list("abcd"), 3)
    )
    if isinstance(tree, str) or (algebra is CGA3 and str(tree).count("sandwich") > 1):
        return False

    def definition(a, b, c, d, v):  # type: ignore[no-untyped-def]
        return computed(tree, {"a": a, "b": b, "c": c, "d": d, "v": v}, gacompiler)

    record = compile_kernel(kernel(**layouts)(definition), forms=False)
    assert record.decision is not None
    (layout,), tape = record.decision.layouts, Tape(record.program)
    for _ in range(3):
        given = {name: [random.gauss(0, 1) for _ in each.blades] for name, each in layouts.items() if name != "v"}
        values = {name: coefficients(algebra, layouts[name], stored) for name, stored in given.items()}
        values["v"] = unit_versor(random, algebra)
        given["v"] = [values["v"][slot.blade] * slot.sign for slot in versor.stored]
        found = coefficients(algebra, layout, tape.run([x for name in layouts for x in given[name]]))
        known = computed(tree, {name: Element(matrices(algebra), x) for name, x in values.items()}, matrix_algebra)
        size = max(1.0, *map(abs, known.value))
        assert np.allclose(found / size, known.value / size, rtol=0, atol=1e-8), (algebra, tree)
    return True


def test_random_expressions_against_matrices() -> None:
    assert all(map(compare, range(9)))


@pytest.mark.slow
@pytest.mark.parametrize("part", range(10))
def test_300_random_expressions_against_matrices(part: int) -> None:
    assert sum(map(compare, range(9 + 35 * part, 44 + 35 * part))) >= 30
