"""Rows beyond the ends of an array, in the text of loops: those that boundary modes put there, and bounds of loops.

The functions of numbers are also compiled by numba. They return -1 if there is no row. The modes are those of
``scipy.ndimage``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any


def _reflect(k: Any, n: Any) -> Any:
    """Return row k of an array of n rows that is mirrored about the edges of its ends: ``b a | a b c | c b``."""
    if 0 <= k < n:
        return k
    if n < 1:
        return -1
    k = k % (2 * n)
    return k if k < n else 2 * n - 1 - k


def _mirror(k: Any, n: Any) -> Any:
    """Return row k of an array of n rows that is mirrored about its last rows: ``c b | a b c | b a``."""
    if 0 <= k < n:
        return k
    if n < 2:
        return n - 1
    k = k % (2 * n - 2)
    return k if k < n else 2 * n - 2 - k


def _nearest(k: Any, n: Any) -> Any:
    """Return row k of an array of n rows whose first and last rows are repeated: ``a a | a b c | c c``."""
    return min(max(k, 0), n - 1)


def _wrap(k: Any, n: Any) -> Any:
    """Return row k of an array of n rows that is repeated: ``b c | a b c | a b``."""
    if 0 <= k < n:
        return k
    return k % n if n > 0 else -1


def _constant(k: Any, n: Any) -> Any:
    """Return row k of an array of n rows, without others."""
    return k if 0 <= k < n else -1


def bound_of(x: Any, n: Any) -> Any:
    """Return a computed number as the bound of a loop over n rows."""
    if not x > 0:
        return 0
    return int(x) if x < n else n


NAMES: Mapping[str, Callable[[Any, Any], Any]] = {
    function.__name__: function for function in (_reflect, _mirror, _nearest, _wrap, _constant)
}
"""The functions by their free names in the text of a loop."""
