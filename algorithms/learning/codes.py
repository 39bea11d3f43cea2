"""Codes of classes: each class is a row of signs, one for each component of a multivector."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

Signs = NDArray[np.int64]
_MOST = 12
"""Components up to which codes are searched."""


def code_of_classes(code: object, classes: NDArray[Any]) -> Signs:
    """Return the signs (classes, components) of classes.

    Parameters
    ----------
    code : {"one-vs-rest", "compact"}, int or mapping
        One component for each class; as few as possible, so that n components have 2^n classes; a number of
        components, whose signs are chosen far apart; or a mapping from classes to rows of signs.
    classes : array

    Raises
    ------
    ValueError
        If a class is outside the code, or two classes have the same signs.
    """
    n = len(classes)
    fewest = max(1, (n - 1).bit_length())
    if isinstance(code, Mapping):
        return _given(code, classes)
    if code == "one-vs-rest":
        return np.array([[-1], [1]]) if n == 2 else 2 * np.eye(n, dtype=np.int64) - 1
    if code == "compact":
        return np.where(np.arange(n)[:, None] >> np.arange(fewest) & 1, 1, -1)
    if isinstance(code, (int, np.integer)) and not isinstance(code, bool):
        if not fewest <= code <= _MOST:
            raise ValueError(f"code: {code} components for {n} classes; expected {fewest} to {_MOST}")
        return _far_apart(int(code), n)
    raise ValueError(f"code: {code!r}; expected 'one-vs-rest', 'compact', a number of components, or a mapping")


def code_distance(signs: Signs) -> int:
    """Return the least number of components in which two classes differ."""
    differ = (signs[:, None] != signs).sum(-1)
    return int(differ[~np.eye(len(signs), dtype=bool)].min())


def losses(components: NDArray[np.float64], signs: Signs) -> NDArray[np.float64]:
    """Return the sum of hinge losses of each class (n, classes) for values of components (n, m)."""
    return np.asarray(np.maximum(0, 1 - components[:, None] * signs).sum(-1))


def _given(code: Mapping[Any, Any], classes: NDArray[Any]) -> Signs:
    missing = [c for c in classes.tolist() if c not in code]
    if missing:
        raise ValueError(f"y: label {missing[0]!r} is outside the code; expected one of {list(code)!r}")
    rows = [np.atleast_1d(np.asarray(code[c])) for c in classes.tolist()]
    if len({row.shape for row in rows}) > 1 or rows[0].ndim != 1 or not all((np.abs(row) == 1).all() for row in rows):
        raise ValueError("code: expected a row of signs 1 and -1 for each class, of equal lengths")
    signs = np.array(rows, np.int64)
    if len(np.unique(signs, axis=0)) < len(signs):
        raise ValueError("code: two classes have the same signs; expected different ones")
    return signs


def _far_apart(m: int, n: int) -> Signs:
    """Choose words greedily with the greatest least distance for which there are enough."""
    words = np.array(list(product((-1, 1), repeat=m)), np.int64)
    for distance in range(m, 0, -1):
        chosen = words[:1]
        for word in words[1:]:
            if ((chosen != word).sum(1) >= distance).all():
                chosen = np.vstack([chosen, word])
            if len(chosen) == n:
                return chosen
    raise ValueError(f"code: no {n} words of {m} signs")
