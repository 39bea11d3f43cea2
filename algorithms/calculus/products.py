"""Geometric products of Euclidean spaces of any dimension: generated kernels in two and three, tables in others."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import comb
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import vga2, vga3

from ..arguments import real_array
from ..subspaces.products import product_of_terms
from ..subspaces.tables import vectors_of

Floats = NDArray[np.float64]
Product = Callable[..., Any]
"""Takes two arrays of multivectors, ``(..., 2**n)``, whose leading axes broadcast."""
LARGEST = 8
"""The most vectors of a space whose product is made."""


def product_of(n: int) -> Product:
    """Return the geometric product of multivectors of `n` vectors, ``(..., 2**n)`` by grades, each ordered by bitmap.

    Raises
    ------
    ValueError
        For no vector, or more than 8.
    """
    if not 1 <= n <= LARGEST:
        raise ValueError(f"n: {n}; expected 1 to {LARGEST} vectors")
    kernels: dict[int, Product] = {2: vga2.geometric_product, 3: vga3.geometric_product}
    return kernels.get(n) or _by_table(n)


def embed(coefficients: ArrayLike, n: int, grade: int) -> Floats:
    """Multivectors of one grade, ``(..., 2**n)``, from the coefficients of that grade, ``(..., C(n, grade))``.

    Raises
    ------
    TypeError, ValueError
        If these are not as many real numbers.
    """
    array = real_array(coefficients, "coefficients", (comb(n, grade),), f"blades of grade {grade} of {n} vectors")
    found = np.zeros((*array.shape[:-1], 1 << n))
    start = sum(comb(n, k) for k in range(grade))
    found[..., start : start + array.shape[-1]] = array
    return found


@cache
def bitmaps_of(n: int) -> NDArray[np.int64]:
    """Return the vectors of each blade, as bits, in the order of full layouts: by grades, each ascending."""
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
