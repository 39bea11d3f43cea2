"""Tests for blades and versors, grades of elements, and factors of blades.

A blade of grade k is the outer product of k vectors. They span the vectors v with ``v ^ blade = 0``, a linear equation
for v whose singular values show how nearly an element is a blade.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..algebra.catalog import QUATERNIONS
from ..errors import AlgebraError
from ..gac_runtime.array_element import Element
from .layouts import layout_of
from .normalizing import is_null, range_exponents
from .shapes import Reals, dense, grades_in, rounding


def half_of_digits(x: Element) -> float:
    """Return the square root of the relative rounding error: the operations before may lose half of the digits."""
    return float(np.sqrt(np.finfo(x.values.dtype).eps))


def _outer_map(coefficients: Reals) -> Reals:
    """Return the matrices (..., 2**n, n) of the linear function v -> ``v ^ x``."""
    count = coefficients.shape[-1]
    n = count.bit_length() - 1
    found = np.zeros((*coefficients.shape, n), coefficients.dtype)
    for vector in range(n):
        for blade in range(count):
            if not blade >> vector & 1:
                # The vector passes the vectors of the blade that precede it.
                sign = -1 if (blade & ((1 << vector) - 1)).bit_count() & 1 else 1
                found[..., blade | 1 << vector, vector] = sign * coefficients[..., blade]
    return found


def are_blades(x: Any) -> Any:
    """Whether each element is a blade, to half of the digits; 0 is a blade."""
    coefficients = dense(x)
    size, limit = np.max(np.abs(coefficients), axis=-1), half_of_digits(x)
    grades = np.array([blade.bit_count() for blade in range(coefficients.shape[-1])])
    matrix = _outer_map(np.where(np.isfinite(coefficients), coefficients, 0.0))
    singular = np.linalg.svd(matrix, compute_uv=False)[..., ::-1]
    found = size == 0
    for k in range(x.algebra.dimension + 1):
        others = np.max(np.abs(coefficients) * (grades != k), axis=-1) <= limit * size
        spans = singular[..., k - 1] <= limit * size if k else np.True_
        found = found | (others & spans)
    found = np.asarray(found & np.all(np.isfinite(coefficients), axis=-1))
    return bool(found) if found.ndim == 0 else found


def are_versors(x: Any) -> Any:
    """Whether each element is a versor, to half of the digits: ``x ~x`` is a number, and ``x v ~x`` are vectors."""
    limit, size = half_of_digits(x), np.max(np.abs(dense(x)), axis=-1) ** 2
    if x.algebra == QUATERNIONS:  # the product of two vectors of space, in which e12 is one of three directions
        return bool(size > 0) if size.ndim == 0 else size > 0
    square = _dense_of(x, x * ~x)
    found = np.abs(square[..., 0]) > limit * size
    found = found & np.all(np.abs(square[..., 1:]) <= limit * size[..., None], axis=-1)
    parity = np.array([blade.bit_count() & 1 for blade in range(square.shape[-1])])
    own = np.abs(dense(x)) ** 2
    found = found & np.any([np.all(own * (parity == k) <= limit * size[..., None], axis=-1) for k in (0, 1)], axis=0)
    vectors = np.array([blade.bit_count() == 1 for blade in range(square.shape[-1])])
    for blade in x.algebra.blades(1):
        vector = x._of_rows(layout_of(x.algebra, {blade}), np.ones(1))
        moved = _dense_of(x, (x * vector) * ~x)
        found = found & np.all(np.abs(moved[..., ~vectors]) <= limit * size[..., None], axis=-1)
    return bool(found) if np.ndim(found) == 0 else found


def are_null(x: Any) -> Any:
    """Whether the scalar part of ``x ~x`` is 0 beside its terms, to half of the digits; 0 is null."""
    exponents = range_exponents(x.layout, x.values)
    values = x.values if exponents is None else np.ldexp(x.values, -exponents[..., None])
    found = is_null(x.layout, values, half_of_digits(x))
    return bool(found) if found.ndim == 0 else found


def _dense_of(x: Any, result: Any) -> Reals:
    """Return the coefficients of a result in the algebra of x, which may be a number."""
    if getattr(result, "algebra", None) == x.algebra:
        return dense(result)
    found = np.zeros((*np.shape(result), 2**x.algebra.dimension))
    found[..., 0] = result
    return found


def factors_of(x: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return the weight and the orthogonal vectors of blades; see `Geometry.factorize`."""
    grades = grades_in(x)
    if len(grades) > 1 or not np.all(are_blades(x)):
        raise AlgebraError(
            "factorize", f"a {x.layout} that is not a blade", "an outer product of vectors", "is_blade() tests this"
        )
    (k,) = grades or (0,)
    coefficients = dense(x)
    if k == 0:
        return coefficients[..., 0][()], ()
    spanning = np.swapaxes(np.linalg.svd(_outer_map(coefficients))[2], -1, -2)[..., -k:]
    gram = np.array(x.algebra.gram, float)
    squares, turn = np.linalg.eigh(np.swapaxes(spanning, -1, -2) @ gram @ spanning)
    # The squares of null vectors are 0 up to the rounding errors of the decompositions, which are of unit vectors.
    null = np.abs(squares) <= 4 * rounding(x) * np.max(np.abs(gram))
    scaled = (spanning @ turn) / np.sqrt(np.where(null, 1.0, np.abs(squares)))[..., None, :]
    product = np.zeros_like(coefficients)
    product[..., 0] = 1.0
    for j in reversed(range(k)):
        product = (_outer_map(product) @ scaled[..., j, None])[..., 0]
    weight = np.sum(coefficients * product, axis=-1) / np.sum(product * product, axis=-1)
    layout = layout_of(x.algebra, x.algebra.blades(1))
    signs = np.array([slot.sign for slot in layout.stored])
    order = [slot.blade.bit_length() - 1 for slot in layout.stored]
    return weight[()], tuple(x._of_rows(layout, scaled[..., order, j] * signs) for j in range(k))
