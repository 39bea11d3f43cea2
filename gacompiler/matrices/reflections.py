"""Householder reflections in kernels."""

from __future__ import annotations

from typing import Any

from ..frontend.functions import sqrt
from ..frontend.loops import each, total
from ..frontend.operations import absolute, equal, select
from .products import dot


def reflector(x: Any, numbers: Any, k: Any, least: Any = 0) -> tuple[Any, Any]:
    """Return the reflection that removes the entries of a vector after the k-th, and keeps those before it.

    Parameters
    ----------
    x, numbers : arrays of scalars, (n)
        The vector, and the numbers of its entries.
    k : scalar
    least : number
        The square of the norm up to which entries are not removed.

    Returns
    -------
    v : array of scalars, (n)
    factor : scalar
        The reflection maps y to ``y - factor (v . y) v``. If there is nothing to remove, the factor is 0.
    """
    rest = total(lambda e, i: select(i > k, e * e, 0), x, numbers)
    lead = total(lambda e, i: select(equal(i, k), e, 0), x, numbers)
    is_done = rest <= least
    size = sqrt(select(is_done, 1, lead * lead + rest))
    factor = select(is_done, 0, 1 / (size * (size + absolute(lead))))
    first = lead + select(lead < 0, -size, size)
    return each(lambda e, i: select(i > k, e, select(equal(i, k), first, 0)), x, numbers), factor


def reflected(row: Any, v: Any, factor: Any) -> Any:
    """Return a vector after a reflection."""
    share = factor * dot(row, v)
    return each(lambda x, y: x - share * y, row, v)


def reflect_columns(matrix: Any, v: Any, factor: Any) -> Any:
    """Return a matrix after a reflection of its columns."""
    shares = total(lambda row, y: each(lambda x: factor * y * x, row), matrix, v)
    return each(lambda row, y: each(lambda x, share: x - share * y, row, shares), matrix, v)
