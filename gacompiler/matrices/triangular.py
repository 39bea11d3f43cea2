"""Triangular equations in kernels."""

from __future__ import annotations

from typing import Any

from ..frontend.equations import nonzero
from ..frontend.loops import each, fold
from ..frontend.operations import equal, select
from ..frontend.searches import pick, row_numbers


def solve_lower(matrix: Any, right: Any) -> Any:
    """Solve ``L x = b`` by forward substitution.

    Parameters
    ----------
    matrix : array of scalars, (n, n)
        Entries above the diagonal are not used. For a 0 on the diagonal, 1 is used.
    right : array of scalars, (n)

    Returns
    -------
    array of scalars, (n)
    """
    return _substituted(matrix, right, reverse=False)


def solve_upper(matrix: Any, right: Any) -> Any:
    """Solve ``U x = b`` by back substitution.

    Parameters
    ----------
    matrix : array of scalars, (n, n)
        Entries below the diagonal are not used. For a 0 on the diagonal, 1 is used.
    right : array of scalars, (n)

    Returns
    -------
    array of scalars, (n)
    """
    return _substituted(matrix, right, reverse=True)


def _substituted(matrix: Any, right: Any, *, reverse: bool) -> Any:
    numbers = row_numbers(right)

    def step(x: Any, k: Any) -> Any:
        value = pick(x, k, 0) / nonzero(pick(pick(matrix, k, 0), k, 0))

        def reduced(entry: Any, row: Any, i: Any) -> Any:
            is_later = i < k if reverse else i > k
            return select(equal(i, k), value, select(is_later, entry - pick(row, k, 0) * value, entry))

        return each(reduced, x, matrix, numbers)

    return fold(step, right, numbers, reverse=reverse)
