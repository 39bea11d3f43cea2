"""The classification of an algebra as text, the output of `gac classify`."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from ..algebra.blades import Rational
from ..algebra.catalog import orthogonal
from ..algebra.multivector import Multivector
from .adjoints import matrix_involution
from .ideals import centre, idempotent_factors, primitive_idempotents
from .matrix_algebras import complex_matrix_algebra, even_subalgebra, matrix_algebra
from .representation import LARGEST_DIMENSION, Matrices, Numbers, Representation


def summary(p: int, q: int = 0, r: int = 0) -> dict[str, str]:
    """Return the classification of ``G(p, q, r)`` by topic, without entries from matrices above 12 vectors."""
    n = p + q + r
    kind = matrix_algebra(p, q, r)
    found = {
        "algebra": f"{_name(p, q, r)}, {1 << n} dimension{'s' if n else ''}",
        "matrices": str(kind),
        "real matrices": f"{kind.real_size} x {kind.real_size}",
        "even elements": str(even_subalgebra(p, q, r)) if p + q else ("R" if not r else f"Λ({r}) of even grades"),
        "p - q mod 8": str((p - q) % 8),
        "same algebra": _same(p, q, r),
    }
    if not r:
        found["complex elements"] = str(complex_matrix_algebra(n))
    if n > LARGEST_DIMENSION:
        return found
    representation = Representation(orthogonal(p, q, r))
    pseudoscalar = representation.algebra.pseudoscalar
    found["pseudoscalar squared"] = str(pseudoscalar * pseudoscalar)
    found["centre"] = ", ".join(map(str, centre(representation.algebra)))
    idempotents = primitive_idempotents(representation)
    found["primitive idempotents"] = f"{len(idempotents)}, such as {_product(idempotents[0])}"
    if not r:
        power = f"^{kind.size}" if kind.size > 1 else ""
        found["spinors"] = f"{kind.numbers}{power}" + (", two kinds" if kind.halves > 1 else "")
        found["reverse"] = str(matrix_involution(representation, "reverse"))
        found["grade involution"] = str(matrix_involution(representation, "grade_involution"))
    return found


def generator_rows(representation: Representation) -> list[list[str]]:
    """Return the matrices of the basis vectors as rows of text: name, square, and one row of the matrices."""
    rows: list[list[str]] = []
    for name, vector, matrices in zip(
        representation.algebra.vectors, representation.algebra.basis(), representation.generators, strict=True
    ):
        lines = matrix_lines(representation.numbers, matrices)
        first = [name, str((vector * vector).scalar)]
        rows += [[*(first if k == 0 else ("", "")), line] for k, line in enumerate(lines)]
    return rows


def matrix_lines(numbers: Numbers, matrices: Matrices) -> list[str]:
    """Return matrices as lines of text, with a dot for zero and the halves side by side."""
    cells = [[[_entry(numbers, entry) for entry in row] for row in half] for half in matrices.tolist()]
    width = max(len(cell) for half in cells for row in half for cell in row)
    halves = [[" ".join(cell.rjust(width) for cell in row) for row in half] for half in cells]
    return ["  |  ".join(parts) for parts in zip(*halves, strict=True)]


def _entry(numbers: Numbers, parts: list[Any]) -> str:
    text = ""
    for value, name in zip(parts, numbers.names, strict=True):
        if value != 0:
            size = abs(value)
            body = _number(size) if name == "1" else name if size == 1 else f"{_number(size)}{name}"
            text += ("-" if value < 0 else "+" if text else "") + body
    return text or "."


def _number(value: Rational | float) -> str:
    return str(value) if isinstance(value, (int, Fraction)) else f"{value:g}"


def _product(idempotent: Multivector) -> str:
    factors = idempotent_factors(idempotent)
    text = " ".join(f"(1 + {g})".replace("+ -1*", "- ") for g in factors)
    return f"{text} / {1 << len(factors)}" if factors else "1"


def _name(p: int, q: int, r: int) -> str:
    return f"G({p},{q},{r})" if r else f"G({p},{q})"


def _same(p: int, q: int, r: int) -> str:
    """Return the other signatures with the same number of vectors and an isomorphic algebra."""
    kind = matrix_algebra(p, q, r)
    others = [(k, p + q - k, r) for k in range(p + q, -1, -1) if k != p]
    return " ".join(_name(*other) for other in others if matrix_algebra(*other) == kind) or "none"
