"""Matrices of known sizes in kernels, for which the functions of this package are unrolled."""

from __future__ import annotations

from typing import Any

from ..frontend.rows import Unrolled


def fixed(rows: Any) -> Any:
    """Return a vector or matrix of known size as an array whose loops are unrolled.

    Parameters
    ----------
    rows : tuple of scalars, or of tuples of scalars
        As an argument declared by ``array(SCALAR, 3)`` or ``array(SCALAR, 3, 3)``.

    Returns
    -------
    array of scalars
        The functions of this package, `each` and the other loops take it as they take arrays over named lengths.
    """
    return Unrolled(tuple(map(fixed, rows))) if isinstance(rows, (tuple, list)) else rows


def entries(array: Any) -> Any:
    """Return an array of known size as nested tuples of scalars, and all else unchanged; the inverse of `fixed`."""
    return tuple(map(entries, array.elements)) if isinstance(array, Unrolled) else array
