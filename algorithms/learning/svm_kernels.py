"""Kernels of Clifford support vector machines: scalar, linear, polynomial and Clifford-Gabor.

A kernel maps two samples x and y to a multivector ``K(x, y)`` with ``K(y, x) = K(x, y)^+``, where ``^+`` replaces each
basis blade by its inverse: the reverse in Euclidean algebras. The Gram matrix of components j and l is
``<e_j K(x, y) e_l^+>``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generated import clifford_svm

from ..subspaces.products import product_of_terms
from .blade_signs import Signs

Floats = NDArray[np.float64]
Function = Callable[[Floats, Floats], Floats]
_NEAR = 1 << 17
"""Number of kernels that are computed at a time, so that they remain in a near cache."""
NAMES = ("scalar", "rbf", "linear", "gabor", "polynomial", "precomputed")


@dataclass(frozen=True, eq=False)
class KernelSettings:
    """Parameters of the kernels, with the names that they have in `CliffordSVC`."""

    gamma: float
    degree: int
    coef0: float
    frequency: Floats
    signs: Signs


@dataclass(frozen=True, eq=False)
class Kernel:
    """A kernel as a function of arrays of samples.

    Attributes
    ----------
    values : callable
        ``values(a, b)`` maps ``(n, ...)`` and ``(k, ...)`` to ``(n, size, k)``, where size is 1 or that of the algebra.
    size : int
    is_definite : bool
        Whether the Gram matrix is positive semidefinite for all samples.
    diagonal : callable
        The scalar parts of ``K(x, x)``.
    is_linear : bool
        Whether the values are the inner products of real samples.
    into : callable, optional
        Stores the values in an array.
    """

    values: Function
    size: int
    is_definite: bool
    diagonal: Callable[[Floats], Floats]
    is_linear: bool = False
    into: Callable[[Floats, Floats, Floats], None] | None = None

    def fill(self, a: Floats, b: Floats, found: Floats) -> None:
        """Store the values in an array of their shape."""
        if self.into:
            self.into(a, b, found)
            return
        span = max(1, _NEAR // found[0].size)
        for start in range(0, len(a), span):
            found[start : start + span] = self.values(a[start : start + span], b)


def kernel_named(name: object, settings: KernelSettings, is_multivector: bool) -> Kernel:
    """Return the kernel of a name, or of a function of two arrays of samples.

    Raises
    ------
    ValueError
        If there is no kernel of this name.
    """
    if callable(name):
        return _of_function(name, settings.signs.size)
    if name in ("scalar", "rbf"):
        return _gaussian_kernel(settings.gamma)
    if name == "gabor":
        return Kernel(lambda a, b: _gabor(a, b, settings), settings.signs.size, True, lambda a: np.ones(len(a)))
    if name == "linear":
        if not is_multivector:
            return Kernel(lambda a, b: (a @ b.T)[:, None], 1, True, _squares, True)
        return Kernel(lambda a, b: _linear(a, b, settings.signs), settings.signs.size, True, _squares)
    if name == "polynomial":
        g, c, d = settings.gamma, settings.coef0, settings.degree
        if not is_multivector:
            return Kernel(
                lambda a, b: (g * (a @ b.T)[:, None] + c) ** d, 1, c >= 0, lambda a: (g * _squares(a) + c) ** d
            )
        return Kernel(
            lambda a, b: _polynomial(a, b, settings), settings.signs.size, c >= 0 and settings.signs.size == 1,
            lambda a: np.concatenate([_polynomial(x[None], x[None], settings)[:, 0, 0] for x in a]),
        )  # fmt: skip
    raise ValueError(f"kernel: {name!r}; expected one of {', '.join(map(repr, NAMES))}, or a function of two arrays")


def precomputed_kernel(gram: Floats) -> Kernel:
    """Return the kernel of samples that are the numbers (n, 1) of rows of a Gram matrix."""

    def numbers(a: Floats) -> NDArray[np.intp]:
        return np.asarray(a[:, 0], np.intp)

    return Kernel(
        lambda a, b: gram[np.ix_(numbers(a), numbers(b))][:, None], 1, False, lambda a: gram.diagonal()[numbers(a)]
    )


def _flat(a: Floats) -> Floats:
    return a.reshape(len(a), -1)


def _squares(a: Floats) -> Floats:
    flat = _flat(a)
    return np.asarray(np.einsum("ij,ij->i", flat, flat))


def _distances(a: Floats, b: Floats) -> Floats:
    """Return squared distances of samples, after a shift that reduces rounding errors."""
    one, two = _flat(a), _flat(b)
    middle = two.mean(0)
    one, two = one - middle, two - middle
    return np.asarray(np.maximum(_squares(one)[:, None] + _squares(two) - 2 * one @ two.T, 0))


def _gaussian_kernel(gamma: float) -> Kernel:
    """Return the kernel ``exp(-gamma s)`` of squared distances s, which are parts of one product of matrices."""

    def into(a: Floats, b: Floats, found: Floats) -> None:
        one, two = _flat(a), _flat(b)
        middle = two.mean(0)
        one, two = one - middle, two - middle
        left = np.column_stack([2 * gamma * one, -gamma * _squares(one), np.ones(len(one))])
        right = np.column_stack([two, np.ones(len(two)), -gamma * _squares(two)]).T
        span = max(1, _NEAR // len(two))
        for start in range(0, len(one), span):
            block = found[start : start + span, 0]
            np.matmul(left[start : start + span], right, out=block)
            np.minimum(block, 0, out=block)
            np.exp(block, out=block)

    def values(a: Floats, b: Floats) -> Floats:
        found = np.empty((len(a), 1, len(b)))
        into(a, b, found)
        return found

    return Kernel(values, 1, True, lambda a: np.ones(len(a)), into=into)


def _gabor(a: Floats, b: Floats, settings: KernelSettings) -> Floats:
    phases = (_flat(a) @ settings.frequency)[:, None] - _flat(b) @ settings.frequency
    real, imaginary = clifford_svm.gabor_values(_distances(a, b), phases, settings.gamma)
    found = np.zeros((len(a), settings.signs.size, len(b)))
    found[:, 0], found[:, settings.signs.imaginary_unit()] = real, imaginary
    return found


def _linear(a: Floats, b: Floats, signs: Signs) -> Floats:
    """Return the sums of ``x^+ y`` over features, as one product of matrices."""
    left, right = np.indices((signs.size, signs.size))
    factor = signs.square[left] * signs.sign[left, left ^ right]
    # The coefficient C of e_A^-1 e_B is nonzero for B = A xor C.
    expanded = b[:, :, left ^ right] * factor
    found = _flat(a) @ expanded.transpose(1, 2, 3, 0).reshape(a.shape[1] * signs.size, -1)
    return np.asarray(found.reshape(len(a), signs.size, len(b)))


def _polynomial(a: Floats, b: Floats, settings: KernelSettings) -> Floats:
    base = settings.gamma * np.moveaxis(_linear(a, b, settings.signs), 1, 2)
    base[..., 0] += settings.coef0
    left, right = np.indices((settings.signs.size,) * 2)
    product = product_of_terms(left, right, settings.signs.sign, left ^ right, settings.signs.size)
    power = base
    for _ in range(settings.degree - 1):
        power = product(power, base)
    return np.ascontiguousarray(np.moveaxis(power, 2, 1))


def _of_function(function: Callable[[Floats, Floats], Floats], size: int) -> Kernel:
    def values(a: Floats, b: Floats) -> Floats:
        found = np.asarray(function(a, b), np.float64)
        if found.shape == (len(a), len(b)):
            return found[:, None]
        if found.shape != (len(a), len(b), size):
            raise ValueError(
                f"kernel: returned the shape {found.shape}; expected {(len(a), len(b))} or {(len(a), len(b), size)}"
            )
        return np.ascontiguousarray(np.moveaxis(found, 2, 1))

    def diagonal(a: Floats) -> Floats:
        return np.array([values(x[None], x[None])[0, 0, 0] for x in a])

    return Kernel(values, 0, False, diagonal)
