"""Algebras by base change, in the five lines of Gaalop's ``definition.csv``.

The lines contain the printed basis, the orthogonal vectors in terms of it, the orthogonal basis, its squares, and the
printed vectors in terms of the orthogonal ones::

    1,e1,e2,e3,einf,e0
    ep=0.5*einf-e0,em=0.5*einf+e0
    1,e1,e2,e3,ep,em
    e1=1,e2=1,e3=1,ep=1,em=-1
    e0=0.5*em-0.5*ep,einf=em+ep

Lines 2 and 5 are empty if the bases are the same.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction

from ..algebra.algebra import Algebra
from ..algebra.multivector import Multivector
from ..errors import AlgebraError, SpecError

_TERM = re.compile(r"([+-]?)\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)\s*\*?\s*)?([A-Za-z_]\w*)?\s*")
Combination = Mapping[str, Fraction]
LARGEST_DENOMINATOR = 1000
"""Largest denominator of inner products, which decimals of roots approximate to 1e-9."""


def read_definition(text: str, name: str, where: str) -> tuple[Algebra, dict[str, Multivector]]:
    """Return the algebra of a definition, over the printed basis, and the further orthogonal vectors that it names.

    Parameters
    ----------
    text : str
        The five lines.
    name : str
        Name of the algebra.
    where : str
        Name of the text in error messages.

    Raises
    ------
    SpecError
        If the text does not have this form; the message names the line.
    """
    lines = [line.strip() for line in text.strip("\n").splitlines()]
    lines += [""] * (5 - len(lines))
    printed, orthogonal = _basis(lines[0], f"{where}:1"), _basis(lines[2], f"{where}:3")
    squares = {each: _number(value, f"{where}:4") for each, value in _pairs(lines[3], f"{where}:4")}
    if set(squares) != set(orthogonal):
        raise SpecError(f"{where}:4", f"squares of {' '.join(squares)}", f"one for each of {' '.join(orthogonal)}")
    combinations = {each: _sum(value, orthogonal, f"{where}:5") for each, value in _pairs(lines[4], f"{where}:5")}
    for vector in printed:
        if vector not in combinations and vector not in orthogonal:
            raise SpecError(f"{where}:5", f"nothing for {vector}", f"{vector} = a sum of {' '.join(orthogonal)}")
    rows = [combinations.get(vector, {vector: Fraction(1)}) for vector in printed]
    gram = [[_near(sum((a[v] * b.get(v, 0) * squares[v] for v in a), Fraction(0))) for b in rows] for a in rows]
    try:
        algebra = Algebra(name, printed, gram)
    except AlgebraError as error:
        raise SpecError(f"{where}:1", error.found, error.expected) from error
    further = {}
    vectors = dict(zip(printed, algebra.basis(), strict=True))
    for each, value in _pairs(lines[1], f"{where}:2"):
        terms = _sum(value, printed, f"{where}:2")
        total = algebra.scalar(0)
        for vector, factor in terms.items():
            total = total + vectors[vector] * factor
        further[each] = total
    return algebra, further


def _basis(line: str, where: str) -> list[str]:
    names = [each.strip() for each in line.split(",")]
    if names[0] != "1" or not all(each.isidentifier() for each in names[1:]) or len(set(names)) != len(names):
        raise SpecError(where, repr(line), "1 and the names of basis vectors, 1,e1,e2")
    return names[1:]


def _pairs(line: str, where: str) -> list[tuple[str, str]]:
    found = []
    for part in filter(None, (each.strip() for each in line.split(","))):
        name, equals, value = (each.strip() for each in part.partition("="))
        if not equals or not name.isidentifier() or not value:
            raise SpecError(where, repr(part), "name=value")
        found.append((name, value))
    return found


def _number(text: str, where: str) -> Fraction:
    try:
        return Fraction(text.replace(" ", ""))
    except ValueError as error:
        raise SpecError(where, repr(text), "a number") from error


def _sum(text: str, names: list[str], where: str) -> dict[str, Fraction]:
    terms: dict[str, Fraction] = {}
    position = 0
    while position < len(text):
        match = _TERM.match(text, position)
        if match is None or not match[0].strip() or match[3] not in names or (position and not match[1]):
            raise SpecError(where, repr(text), f"a sum of {' '.join(names)} such as 0.5*{names[0]}-{names[-1]}")
        factor = Fraction(match[2] or 1) * (-1 if match[1] == "-" else 1)
        terms[match[3]] = terms.get(match[3], Fraction(0)) + factor
        position = match.end()
    return terms


def _near(value: Fraction) -> Fraction:
    """Return the simple number nearest to a decimal approximation of a root."""
    simple = value.limit_denominator(LARGEST_DENOMINATOR)
    return simple if abs(simple - value) < Fraction(1, 10**9) else value
