"""Elements as samples and targets: networks and machines store coefficients of all blades, in orders of their own."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated.gac_runtime.annotations import Stored
from generated.gac_runtime.arrays import element_of, entries_of
from generated.gac_runtime.layout import coefficients, layout

Array = NDArray[Any]
Signature = tuple[int, int, int]


class Sparse(Protocol):
    """A sparse matrix of scipy."""

    def toarray(self) -> Array:
        """Return the same matrix with its zeros."""


Targets: TypeAlias = ArrayLike | Stored | Sequence[Stored]
"""Numbers, elements, or a list of elements."""
Samples: TypeAlias = Targets | Sparse

_SIGNATURES: dict[str, Signature] = {
    "COMPLEX": (0, 1, 0), "DOUBLE_NUMBERS": (1, 0, 0), "DUAL_NUMBERS": (0, 0, 1), "QUATERNIONS": (0, 2, 0),
    "VGA2": (2, 0, 0), "VGA3": (3, 0, 0), "PGA2": (2, 0, 1), "PGA3": (3, 0, 1), "STA": (1, 3, 0),
}  # fmt: skip
"""Algebras with an orthonormal basis whose vectors have the squares 1, -1 and 0 in this order."""
_VECTORS = {"PGA2": "120", "PGA3": "1230", "STA": "0123", "DUAL_NUMBERS": "0"}
"""The last letters of their basis vectors, where these are not 1, 2, 3, ..."""


def with_all_blades(value: Any, name: str, signature: Sequence[int], bitmaps: Array) -> Any:
    """Return elements as arrays (..., blades), and all else unchanged.

    Parameters
    ----------
    value : element, list or array of elements, or other object
    name : str
        The argument, for error messages.
    signature : (int, int, int)
        Of the algebra of the network or machine.
    bitmaps : array, (size,)
        The blades of the result, as bits of their vectors.

    Raises
    ------
    TypeError
        If an element is of an algebra with another signature or without an orthonormal basis.
    """
    value, is_list = entries_of(value)
    if is_list:
        return np.stack([with_all_blades(each, f"{name}[{k}]", signature, bitmaps) for k, each in enumerate(value)])
    stored = getattr(value, "stored", None)
    if stored is None:
        return value
    values, own = stored
    if _signature(own.algebra) != tuple(signature):
        text = ",".join(map(str, signature))
        raise TypeError(f"{name} is {own.name}; expected elements of G({text}) with an orthonormal basis, or arrays")
    if np.iscomplexobj(values):
        raise TypeError(f"{name} has complex coefficients; expected real ones")
    place = {int(bitmap): k for k, bitmap in enumerate(bitmaps)}
    vectors = _vectors(own.algebra, len(bitmaps))
    found = np.zeros((*values.shape[:-1], len(bitmaps)), values.dtype)
    for blade, coefficient in coefficients(values, own).items():
        sign, bitmap = _blade(blade, vectors)
        found[..., place[bitmap]] += sign * coefficient
    return found


def restorer(value: Any, signature: Sequence[int], bitmaps: Array) -> Callable[[Array], Any]:
    """Return the function that returns arrays (..., blades) as elements of the kind of `value`, or unchanged.

    They remain arrays if `value` has no elements, or elements of another signature.
    """
    element = element_of(value)
    if element is None:
        return lambda array: array
    like, algebra = element.like, element.stored[1].algebra
    if _signature(algebra) != tuple(signature):
        return lambda array: array
    vectors = _vectors(algebra, len(bitmaps))
    letter = "g" if algebra == "STA" else "e"
    names = ["".join(v for k, v in enumerate(vectors) if int(bitmap) >> k & 1) for bitmap in bitmaps]
    every = layout(f"{algebra}.all", " ".join(letter + each if each else "1" for each in names))
    return lambda array: like(every, array)


def _signature(algebra: str) -> Signature | None:
    found = re.fullmatch(r"G\((\d),(\d),(\d)\)", algebra)
    if found:
        p, q, r = map(int, found.groups())
        return p, q, r
    return _SIGNATURES.get(algebra)


def _vectors(algebra: str, size: int) -> str:
    return _VECTORS.get(algebra, "123456"[: size.bit_length() - 1])


def _blade(name: str, vectors: str) -> tuple[int, int]:
    """Return the sign and the bitmap of a blade, ``e31``, in the order of the vectors."""
    places = [] if name == "1" else [vectors.index(letter) for letter in name[1:]]
    swaps = sum(a > b for a, b in combinations(places, 2))
    return -1 if swaps % 2 else 1, sum(1 << place for place in places)
