"""Geometric products of Euclidean spaces of any dimension: generated kernels in 2D and 3D, tables otherwise."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import comb
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import vga2, vga3

from ..arguments import real_array, whole_number
from ..subspaces.index_tables import vectors_of
from ..subspaces.products import product_of_terms

Floats = NDArray[np.float64]
Product = Callable[..., Any]
"""Function of two arrays of multivectors, ``(..., 2**n)``, whose leading axes broadcast."""
LARGEST = 8
"""Maximum number of vectors of a space."""


def product_of(n: int) -> Product:
    """Return the geometric product of multivectors of `n` vectors, ``(..., 2**n)`` by grade, each ordered by bitmap.

    Raises
    ------
    ValueError
        If n is not from 1 to 8.
    """
    if not 1 <= whole_number(n, "n") <= LARGEST:
        raise ValueError(f"n: {n}; expected 1 to {LARGEST} vectors")
    kernels: dict[int, Product] = {2: vga2.geometric_product, 3: vga3.geometric_product}
    return kernels.get(n) or _by_table(n)


def embed(coefficients: ArrayLike, n: int, grade: int) -> Floats:
    """Return multivectors ``(..., 2**n)`` of one grade from the coefficients of this grade, ``(..., C(n, grade))``.

    Raises
    ------
    TypeError, ValueError
        If `coefficients` is not an array of that many real numbers.
    """
    whole_number(grade, "grade")
    array = real_array(coefficients, "coefficients", (comb(n, grade),), f"blades of grade {grade} of {n} vectors")
    found = np.zeros((*array.shape[:-1], 1 << n))
    start = sum(comb(n, k) for k in range(grade))
    found[..., start : start + array.shape[-1]] = array
    return found


@cache
def bitmaps_of(n: int) -> NDArray[np.int64]:
    """Return the vectors of each blade, as bit masks, in the order of full layouts: by grade, each ascending."""
    found = np.array([int((1 << row).sum()) for k in range(n + 1) for row in vectors_of(n, k).astype(np.int64)])
    found.setflags(write=False)
    return found


@cache
def _by_table(n: int) -> Product:
    bitmaps = bitmaps_of(n)
    at = np.empty(1 << n, np.int64)
    at[bitmaps] = np.arange(1 << n)
    target = at[bitmaps[:, None] ^ bitmaps]
    swaps = np.zeros(target.shape, np.int64)
    for shift in range(1, n):
        swaps += np.bitwise_count((bitmaps[:, None] >> shift) & bitmaps)
    sign = 1.0 - 2.0 * (swaps & 1)

    places = np.broadcast_to(np.arange(1 << n), target.shape)
    multiply = product_of_terms(places.T, places, sign, target, 1 << n)

    def product(a: ArrayLike, b: ArrayLike) -> Floats:
        one = real_array(a, "a", (1 << n,), f"multivectors of {n} vectors").astype(np.float64, copy=False)
        two = real_array(b, "b", (1 << n,), f"multivectors of {n} vectors").astype(np.float64, copy=False)
        return np.asarray(multiply(one, two))

    return product
