"""Steps of Kalman filters with any number of states up to twelve, by the kernels of the next larger size.

Smaller problems are padded: additional states have the variance 1 and neither move nor are measured, and additional
numbers of a measurement depend on no state.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from generated import kalman as kernels

from ..arguments import Reals
from ..evidence.triangles import from_triangle, to_triangle

JOINT = {2: 1, 4: 2, 6: 3}
"""The numbers of states of kernels, and how many measured numbers their joint updates take."""
LARGEST = 12
"""The largest number of states."""
OPEN = 1e300
"""A gate that everything passes."""


@dataclass(frozen=True, slots=True, eq=False)
class Whitened:
    """Rows of measured numbers that are combined so that their noise is independent."""

    rows: Reals
    """(m, n)"""
    variances: Reals
    """(m,)"""
    factor: Reals | None
    """The Cholesky factor of the noise, which innovations are divided by; None if they are independent."""

    @classmethod
    def of(cls, rows: Reals, noise: Reals) -> Whitened:
        """Return the rows for a noise (m, m)."""
        diagonal = np.diag(noise)
        if np.array_equal(noise, np.diag(diagonal)):
            return cls(rows, np.ascontiguousarray(diagonal), None)
        factor = np.linalg.cholesky(noise)
        return cls(np.linalg.solve(factor, rows), np.ones(len(noise)), factor)


@dataclass(frozen=True, slots=True, eq=False)
class System:
    """The padded matrices of a linear system, and its kernels."""

    size: int
    """The number of states of the kernels."""
    wide: int
    """How many numbers a joint update takes; 0 if there are more measured numbers."""
    transition: Reals
    process: Reals
    """The triangle of the noise of the process."""
    rows: Reals
    """(wide, size), or (m, size) if there is no joint update."""
    columns: Reals
    """(size, m) The transposed rows of the measured numbers."""
    noise: Reals
    """The triangle of the noise of a joint update."""
    predict: Any
    update: Any
    """The kernel of a joint update, or None."""

    @classmethod
    def of(cls, transition: Reals, process: Reals, rows: Reals, noise: Reals) -> System:
        """Return the padded system."""
        m, n = rows.shape
        size = size_of(n)
        wide = JOINT.get(size, 0)
        wide = wide if m <= wide else 0
        return cls(
            size, wide, padded_square(transition, size), to_triangle(padded_rows(process, size, size)),
            padded_rows(rows, max(wide, m), size), np.ascontiguousarray(padded_rows(rows, m, size).T),
            to_triangle(padded_square(noise, wide)) if wide else noise, getattr(kernels, f"predict_{size}"),
            getattr(kernels, f"update_{size}_{wide}") if wide else None,
        )  # fmt: skip


def predicted(state: Reals, covariance: Reals, transition: Reals, noise: Reals) -> tuple[Reals, Reals]:
    """Return the next states (..., n) and covariances, by the kernel of the next larger size."""
    n, size = state.shape[-1], size_of(state.shape[-1])
    after, triangle = getattr(kernels, f"predict_{size}")(
        padded(state, size), to_triangle(padded_square(covariance, size)), padded_square(transition, size),
        to_triangle(padded_square(noise, size)),
    )  # fmt: skip
    return after[..., :n], from_triangle(triangle, size)[..., :n, :n]


def updated(
    state: Reals, covariance: Reals, innovation: Reals, rows: Reals, noise: Reals, gate: float
) -> tuple[Reals, Reals, Reals, Reals]:
    """Return states, covariances, squared innovations and whether measurements are used.

    `rows` (m, n) are the derivatives of the measured numbers by the state.
    """
    n, m = state.shape[-1], innovation.shape[-1]
    size = size_of(n)
    wide = JOINT.get(size, 0)
    first = padded(state, size), to_triangle(padded_square(covariance, size))
    if m <= wide:
        after, triangle, numbers = getattr(kernels, f"update_{size}_{wide}")(
            *first, padded(innovation, wide), padded_rows(rows, wide, size), to_triangle(padded_square(noise, wide)),
            gate,
        )  # fmt: skip
    else:
        wide_rows = padded_rows(rows, m, size)
        whitened = Whitened.of(wide_rows, noise)
        after, triangle, numbers = updated_in_sequence(*first, innovation, wide_rows, noise, whitened, gate, False)
    return after[..., :n], from_triangle(triangle, size)[..., :n, :n], numbers[..., 0], numbers[..., 1] > 0


def updated_in_sequence(
    state: Reals,
    triangle: Reals,
    innovation: Reals,
    rows: Reals,
    noise: Reals,
    whitened: Whitened,
    gate: float,
    each: bool,
) -> tuple[Reals, Reals, Reals]:
    """Update padded states by one number after the other; the gate applies to each of them, or to all together.

    The result has the triangles of covariances, and the numbers of the kernel: squared innovations, and how many of
    them are used.
    """
    white = innovation
    if whitened.factor is not None:
        seen = np.isfinite(innovation)
        factor = whitened.factor
        if not seen.all():
            # The rest of the numbers has another factor.
            both = seen[..., :, None] & seen[..., None, :]
            factor = np.linalg.cholesky(np.where(both, noise, np.eye(len(noise))))
            whitened = Whitened(np.linalg.solve(factor, rows * seen[..., None]), whitened.variances, factor)
        white = np.linalg.solve(factor, np.where(seen, innovation, 0)[..., None])[..., 0]
        white = np.where(seen, white, np.nan)
    after, spread, numbers = getattr(kernels, f"update_in_sequence_{state.shape[-1]}")(
        state, triangle, white, whitened.rows, whitened.variances, gate if each else OPEN
    )
    used = numbers[..., 0] <= gate
    if each or used.all():
        return after, spread, numbers
    numbers[..., 1] = np.where(used, numbers[..., 1], 0)
    return np.where(used[..., None], after, state), np.where(used[..., None], spread, triangle), numbers


@lru_cache(maxsize=LARGEST)
def size_of(n: int) -> int:
    """Return the number of states of the kernels for n states."""
    return next(size for size in (*JOINT, LARGEST) if n <= size)


def padded(vector: Reals, size: int) -> Reals:
    """Return vectors with zeros appended."""
    more = size - vector.shape[-1]
    return vector if not more else np.concatenate([vector, np.zeros((*vector.shape[:-1], more))], -1)


def padded_rows(rows: Reals, m: int, n: int) -> Reals:
    """Return rows (m, n) with zeros below and to the right."""
    if rows.shape[-2:] == (m, n):
        return rows
    found = np.zeros((*rows.shape[:-2], m, n))
    found[..., : rows.shape[-2], : rows.shape[-1]] = rows
    return found


def padded_square(matrix: Reals, size: int) -> Reals:
    """Return matrices with ones appended to the diagonal: states and measured numbers of their own."""
    n = matrix.shape[-1]
    if n == size:
        return matrix
    found = np.zeros((*matrix.shape[:-2], size, size))
    found[..., range(n, size), range(n, size)] = 1
    found[..., :n, :n] = matrix
    return found
