"""Algebras of networks: blades, products of all elements, and their transposed tables."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generated import networks as kernels
from generated.gac_runtime.module import Kernel

from .blade_signs import LARGEST
from .representation import representation

Array = NDArray[Any]
_GENERATED = {
    (0, 1, 0): "complex", (0, 2, 0): "quaternion", (2, 0, 0): "g2", (3, 0, 0): "g3", (3, 0, 1): "g301",
    (1, 3, 0): "g13",
}  # fmt: skip
_NAMES = {"R": (0, 0, 0), "C": (0, 1, 0), "H": (0, 2, 0)}


@dataclass(frozen=True)
class Algebra:
    """G(p, q, r) with an orthonormal basis of blades sorted by grade, then by their vectors as a binary number.

    Parameters
    ----------
    p, q, r : int
        The numbers of vectors with the squares 1, -1 and 0, in this order.
    module : module, optional
        A module generated from a spec with `gacompiler.specs.families.layers`, for an algebra that
        `generated.networks` does not contain. Without it, products run over tables of terms.
    """

    p: int
    q: int = 0
    r: int = 0
    module: Any = None

    def __post_init__(self) -> None:
        if min(self.p, self.q, self.r) < 0 or self.n > LARGEST:
            raise ValueError(f"algebra: {self}; expected nonnegative numbers of vectors, {LARGEST} in total at most")

    @classmethod
    def of(cls, name: str | Algebra) -> Algebra:
        """Return the algebra with a name: "R", "C", "H", or "G(p,q,r)" where zeros at the end may be omitted."""
        if isinstance(name, Algebra):
            return name
        if not isinstance(name, str):
            raise TypeError(f'algebra: {name!r}; expected a name like "G(3)", or an Algebra')
        if name in _NAMES:
            return cls(*_NAMES[name])
        found = re.fullmatch(r"G\((\d)(?:,\s*(\d))?(?:,\s*(\d))?\)", name)
        if not found:
            raise ValueError(f'algebra: {name!r}; expected "R", "C", "H" or a name like "G(3)", "G(4,1)" or "G(3,0,1)"')
        return cls(*(int(digit or 0) for digit in found.groups()))

    def __str__(self) -> str:
        return f"G({self.p},{self.q},{self.r})"

    @property
    def signature(self) -> tuple[int, int, int]:
        """The numbers of vectors with the squares 1, -1 and 0."""
        return self.p, self.q, self.r

    @property
    def n(self) -> int:
        """The number of vectors."""
        return self.p + self.q + self.r

    @property
    def size(self) -> int:
        """The number of blades."""
        return 1 << self.n

    @cached_property
    def bitmaps(self) -> Array:
        """(size,) The vectors of each blade, as bits."""
        return np.array(sorted(range(self.size), key=lambda blade: (blade.bit_count(), blade)))

    @cached_property
    def grades(self) -> Array:
        """(size,) The grade of each blade."""
        return np.array([int(blade).bit_count() for blade in self.bitmaps])

    @cached_property
    def targets(self) -> Array:
        """(size, size) The blade of the product of two blades."""
        return np.argsort(self.bitmaps)[self.bitmaps[:, None] ^ self.bitmaps]

    @cached_property
    def signs(self) -> Array:
        """(size, size) The coefficient of the product of two blades: 1, -1 or 0."""
        squares = [1] * self.p + [-1] * self.q + [0] * self.r

        def sign(a: int, b: int) -> int:
            swaps = sum((a >> k & b).bit_count() for k in range(1, self.n + 1))
            common = [squares[k] for k in range(self.n) if a & b & (1 << k)]
            return int((-1) ** swaps * np.prod(common, dtype=int))

        return np.array([[sign(int(a), int(b)) for b in self.bitmaps] for a in self.bitmaps], float)

    @property
    def is_definite(self) -> bool:
        """Whether rotations preserve the sums of squares of the coefficients of each grade."""
        return self.n in (self.p, self.q)

    @cached_property
    def metric(self) -> Array:
        """(size,) The scalar products of basis blades with their reverses, 1, -1 or 0; 1 if it is definite.

        Rotations preserve the sum of squares of the coefficients of each grade with these signs.
        """
        if self.is_definite:
            return np.ones(self.size)
        squares = np.array([1.0] * self.p + [-1.0] * self.q + [0.0] * self.r)
        inside = self.bitmaps[:, None] >> np.arange(self.n) & 1
        return np.asarray(np.where(inside, squares, 1.0).prod(1))

    @cached_property
    def by_grade(self) -> Array:
        """(size, n + 1) 1 where a blade is of a grade, else 0."""
        return np.eye(self.n + 1)[self.grades]

    @cached_property
    def reversal(self) -> Array:
        """(size,) The signs of the reverse."""
        return np.where(self.grades * (self.grades - 1) // 2 % 2, -1.0, 1.0)

    @cached_property
    def principal_reversal(self) -> Array:
        """(size,) The signs of the principal reverse, the adjoint of products: the inverse of each basis blade."""
        if self.r:
            raise ValueError(f"algebra: {self}; expected one without null vectors, whose blades have inverses")
        squares: Array = np.diagonal(self.signs)
        return squares

    @cached_property
    def paths(self) -> Array:
        """(k, 3) The grades of the factors and of a part of their product, where such parts exist."""
        i, j = np.nonzero(self.signs)
        found = np.stack([self.grades[i], self.grades[j], self.grades[self.targets[i, j]]], 1)
        return np.unique(found, axis=0)

    @cached_property
    def spinors(self) -> Array | None:
        """(size, d, d) Matrices of the blades that take fewer multiplications than the table, if there are any."""
        return None if self.r else representation(self.p, self.q, self.bitmaps)

    @cached_property
    def _terms(self) -> dict[str, Array]:
        i, j = np.nonzero(self.signs)
        target = self.targets[i, j]
        rows = {tuple(path): k for k, path in enumerate(self.paths.tolist())}
        grades = zip(self.grades[i], self.grades[j], self.grades[target], strict=True)
        path = np.array([rows[tuple(map(int, row))] for row in grades])
        return {"a": i, "b": j, "w": path, "d": target, "sign": self.signs[i, j]}

    def _kernel(self, name: str) -> Any:
        if self.module is not None:
            return getattr(self.module, name)
        suffix = _GENERATED.get((self.p, self.q, self.r))
        return getattr(kernels, f"{name}_{suffix}") if suffix else None

    @property
    def column_kernels(self) -> tuple[Kernel, Kernel] | None:
        """The kernels of the two columns of `spinors` of an element and of the inverse, where they exist."""
        return (kernels.columns_g3, kernels.elements_g3) if (self.p, self.q, self.r) == (3, 0, 0) else None

    def _by_table(self, order: str, length: int, *factors: Array) -> Array:
        """Sum the terms of a product; `order` names the three factors and the result."""
        terms = {key: np.ascontiguousarray(value) for key, value in self._terms.items()}
        left, right, path, target = (terms[key] for key in order)
        numbers = [np.asarray(factor, float) for factor in factors]
        found = kernels.weighted_by_table(*numbers, left, right, path, terms["sign"], target, np.zeros(length))  # type: ignore[call-overload]
        return np.asarray(found).astype(np.result_type(*factors), copy=False)

    def weighted(self, a: Array, b: Array, weights: Array) -> Array:
        """Compute the parts of products ``a b`` multiplied by the weights of their grades, and their sum."""
        kernel = self._kernel("weighted")
        return np.asarray(kernel(a, b, weights)) if kernel else self._by_table("abwd", self.size, a, b, weights)

    def weighted_pull(self, a: Array, b: Array, weights: Array, d: Array) -> tuple[Array, Array, Array]:
        """Compute the gradients of ``d . weighted(a, b, weights)`` with respect to a, b and the weights."""
        kernel = self._kernel("weighted_pull")
        if kernel:
            return tuple(map(np.asarray, kernel(a, b, weights, d)))  # type: ignore[return-value]
        size, count = self.size, len(self.paths)
        return (
            self._by_table("dbwa", size, d, b, weights),
            self._by_table("adwb", size, a, d, weights),
            self._by_table("abdw", count, a, b, d),
        )

    def product(self, a: Array, b: Array) -> Array:
        """Compute geometric products."""
        kernel = self._kernel("product")
        return np.asarray(kernel(a, b)) if kernel else self.weighted(a, b, np.ones(len(self.paths), a.dtype))

    def product_pull(self, a: Array, b: Array, d: Array) -> tuple[Array, Array]:
        """Compute the gradients of ``d . (a b)`` with respect to a and b."""
        kernel = self._kernel("product_pull")
        if kernel:
            return tuple(map(np.asarray, kernel(a, b, d)))  # type: ignore[return-value]
        return self.weighted_pull(a, b, np.ones(len(self.paths), a.dtype), d)[:2]
