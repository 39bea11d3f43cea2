"""Rows beyond the ends of an array: the meaning of the boundary modes, which are those of ``scipy.ndimage``."""

from __future__ import annotations

BOUNDARIES = ("reflect", "mirror", "nearest", "wrap", "constant")
"""``b a | a b c | c b``, ``c b | a b c | b a``, ``a a | a b c | c c``, ``b c | a b c | a b``, and no further rows."""


def row_near(boundary: str, k: int, n: int) -> int | None:
    """Return the row that a boundary mode puts at the number k of an axis of n rows, or None if there is none."""
    if 0 <= k < n:
        return k
    if n == 0 or boundary == "constant":
        return None
    if boundary == "nearest":
        return 0 if k < 0 else n - 1
    if boundary == "wrap":
        return k % n
    period, last = (2 * n, 2 * n - 1) if boundary == "reflect" else (max(2 * n - 2, 1), 2 * n - 2)
    place = k % period
    return place if place < n else last - place
