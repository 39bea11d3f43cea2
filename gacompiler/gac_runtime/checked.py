"""A mode in which kernels check the relations of their arguments, to find the argument that makes results wrong.

Kernels compute with what they get: a motor that is not of unit norm, or a line without Pluecker's relation, gives
numbers without a meaning. The checks take longer than most kernels, so they run only in ``with checked():``, and calls
outside pass no test for it. It is a block and no environment variable, because NaN stands for missing data in correct
programs: the block contains the calls whose arguments must all exist.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np

from .layout import SINGLE, UNIT, Layout, coefficients

Terms = dict[int, float]
"""Coefficients by blades, which are sets of vectors: bit k is vector k."""

_EUCLIDEAN = {f"VGA{n}": (tuple(f"e{k + 1}" for k in range(n)), (1.0,) * n) for n in (2, 3)}
_SQUARES: dict[str, tuple[tuple[str, ...], tuple[float, ...]]] = {
    **_EUCLIDEAN,
    **{f"PGA{n}": ((*(f"e{k + 1}" for k in range(n)), "e0"), (*(1.0,) * n, 0.0)) for n in (2, 3)},
    **{f"CGA{n}": ((*(f"e{k + 1}" for k in range(n)), "e0", "einf"), (*(1.0,) * n, 0.0, 0.0)) for n in (2, 3)},
    "STA": (("g0", "g1", "g2", "g3"), (1.0, -1.0, -1.0, -1.0)),
    "QUATERNIONS": (("e1", "e2"), (-1.0, -1.0)),
}
"""Vectors of the algebras of the catalog, and their squares. In CGA the product of e0 and einf is -1."""
_MATRICES = ("motor_from_matrix", "rotor_from_matrix", "from_matrix")
"""Kernels whose argument `matrix` is a pose, with homogeneous coordinates, or a rotation."""
_WORDS = {"LINE": "line", "DUAL_LINE": "line", "CIRCLE": "circle", "POINT_PAIR": "pair"}
"""Layouts of blades, whose coefficients satisfy a relation, and the word for them in names of arguments and kernels."""

active = 0
"""Number of blocks in which kernels check their arguments."""


@contextmanager
def checked() -> Iterator[None]:
    """Let the kernels of all generated modules check the relations of their arguments in a ``with`` block.

    An argument that contains NaN, an element with ``x ~x`` other than 1 where a unit element is expected, a line,
    circle or point pair that is not an outer product of vectors, and a matrix that is not a pose raise an error.
    Relations may fail by 1e-9, in single precision 8e-6, relative to the squared largest coefficient.

    Raises
    ------
    ValueError
        In the block: names the kernel, the argument, its first wrong row and the residual.

    Notes
    -----
    An argument of the layout of lines may also be a twist or a wrench. It is taken for a line if its name contains
    "line", or has one letter and the name of the kernel contains "line"; likewise circles and pairs. The relations of
    algebras that are not in the catalog are not known here: their arguments are checked for NaN only.

    The block applies to all threads. Not checked are ``kernel.jit``, calls that were prepared by ``bind``, operators of
    values, and arrays of torch, jax and cupy. Coordinates of points are never wrong: points have no further relation.

    Examples
    --------
    >>> from generated import pga3
    >>> with checked():
    ...     pga3.move_point([2.0, 0, 0, 0, 0, 0, 0, 0], [1.0, 2, 3])
    Traceback (most recent call last):
    ...
    ValueError: move_point: argument m has x ~x - 1 = 3; expected a unit PGA3.MOTOR; normalize it
    """
    global active
    active += 1
    try:
        for kernel in _kernels():
            kernel.unbind()
        yield
    finally:
        active -= 1
        if not active:
            for kernel in _kernels():
                kernel.rebind()


class Switched:
    """The methods by which a kernel without loops leaves the extension, and returns to it."""

    _binding: tuple[Any, ...] | None = None
    """Arguments of ``_bind``, once the kernel was called."""
    _bind: Callable[..., Any]

    def rebind(self) -> None:
        """Let the extension run calls, once the kernel was called."""
        if self._binding is not None:
            self._bind(*self._binding)

    def unbind(self) -> None:
        """Let Python handle all calls, also those that the extension could run."""
        if self._binding is not None:
            self._bind((), (), 0, ((0, 0, 0), (0, 0, 0)), 0, 0)


def _kernels() -> Iterator[Any]:
    """Yield the kernels of all modules that are loaded with this runtime."""
    for module in list(sys.modules.values()):
        namespace = getattr(module, "__dict__", {})
        own: Any = namespace.get("_module")
        if type(own).__module__ == f"{__package__}.module":
            for name in own.kernels:
                kernel = namespace.get(name)
                yield getattr(kernel, "kernel", kernel)


def check(
    kernel: str, arguments: Iterable[tuple[str, Any]], layouts: Mapping[str, Layout], indices: Sequence[str] = ()
) -> None:
    """Raise ValueError if an argument of a kernel violates the relations of its layout.

    Parameters
    ----------
    kernel : str
        Its name.
    arguments : iterable of (str, array)
        Names of parameters and arguments, with coefficients along the last axis.
    layouts : mapping of str to Layout
    indices : sequence of str
        Names of tables of indices, which are not checked.
    """
    for name, values in arguments:
        if name in indices:
            continue
        where, layout = f"{kernel}: argument {name}", layouts.get(name)
        bad = np.isnan(values)
        if np.any(bad):
            row = tuple(map(int, np.argwhere(bad)[0]))
            raise ValueError(f"{where} is NaN{f' at index {row}' if row else ''}; expected numbers")
        if layout is None or not layout.blades:
            if name == "matrix" and kernel in _MATRICES:
                residual = _of_matrix(values, values.shape[-1] - (kernel == "motor_from_matrix"))
                _refuse(where, "R^T R - 1 or det R - 1", residual, np.ones(values.shape[:-2]), "a rotation or a pose")
            continue
        largest = np.max(np.abs(values), axis=-1, initial=0.0)
        size = np.maximum(largest, 1.0) ** 2 if layout.unit else largest**2
        if layout.unit:
            _refuse(where, "x ~x - 1", _residual(layout, values, _squared), size, f"a unit {layout.name}; normalize it")
        elif _is_blade(kernel, name, layout):
            expected = f"a {layout.name}, an outer product of vectors"
            _refuse(where, "a Pluecker relation", _residual(layout, values, _wedged), size, expected)


def _refuse(where: str, what: str, residual: Any, size: Any, expected: str) -> None:
    """Raise ValueError if a residual (..., k) is not 0, relative to a size (...)."""
    if residual is None:
        return
    worst = np.max(np.abs(residual), axis=-1, initial=0.0)
    single = np.asarray(residual).dtype == np.float32
    far = ~(worst <= (SINGLE if single else UNIT) * size)
    if np.any(far):
        row = tuple(map(int, np.argwhere(far)[0]))
        place = f", row {row[0] if len(row) == 1 else row}," if row else ""
        raise ValueError(f"{where}{place} has {what} = {float(worst[row]):.3g}; expected {expected}")


def _is_blade(kernel: str, name: str, layout: Layout) -> bool:
    word = _WORDS.get(layout.name.rpartition(".")[2])
    return word is not None and (word in name or (len(name) == 1 and word in kernel))


def _of_matrix(values: Any, n: int) -> Any:
    """Return the entries of ``R^T R - 1`` and ``det R - 1`` of n rows and columns, and the error of the last row."""
    rotation = values[..., :n, :n]
    off = np.swapaxes(rotation, -1, -2) @ rotation - np.eye(n, dtype=values.dtype)
    parts = [off.reshape(*off.shape[:-2], -1), np.linalg.det(rotation)[..., None] - 1]
    if values.shape[-1] > n:
        parts.append(values[..., n, :] - np.eye(n + 1, dtype=values.dtype)[n])
    return np.concatenate(parts, -1)


def _residual(layout: Layout, values: Any, of: Callable[[str, frozenset[int]], Any]) -> Any:
    """Return the residual of a relation, (..., k) by its coefficients; None if the algebra is not known."""
    if layout.algebra not in _SQUARES:
        return None
    names = _SQUARES[layout.algebra][0]
    found: dict[int, Any] = {}
    for blade, value in coefficients(values, layout).items():
        sign, bits = _blade(blade, names)
        found[bits] = sign * value
    total: dict[int, Any] = {}
    for a, b, terms in of(layout.algebra, frozenset(found)):
        for blade, factor in terms.items():
            total[blade] = total.get(blade, 0.0) + factor * found[a] * found[b]
    if of is _squared:
        total[0] = total.get(0, 0.0) - 1.0
    rows = [np.broadcast_to(each, values.shape[:-1]) for each in total.values()]
    return np.stack(rows, -1).astype(values.dtype) if rows else None


def _blade(name: str, vectors: Sequence[str]) -> tuple[float, int]:
    """Return the sign and the bits of a blade, which is spelled by the ends of its vectors: ``e10inf``."""
    sign, bits, rest = 1.0, 0, "" if name == "1" else name[1:]
    while rest:
        k = next(k for k, vector in enumerate(vectors) if rest.startswith(vector[1:]))
        sign, bits, rest = sign * _swaps(bits, 1 << k), bits | 1 << k, rest[len(vectors[k]) - 1 :]
    return sign, bits


def _swaps(a: int, b: int) -> float:
    """Return the sign of the permutation that orders the vectors of one blade and then those of another."""
    count = sum((a >> k + 1).bit_count() for k in range(b.bit_length()) if b >> k & 1)
    return -1.0 if count & 1 else 1.0


@cache
def _squared(algebra: str, blades: frozenset[int]) -> list[tuple[int, int, Terms]]:
    """Return the terms of ``x ~x``, where ~ is the conjugate in QUATERNIONS."""

    def sign(blade: int) -> float:
        k = blade.bit_count() + (algebra == "QUATERNIONS")
        return -1.0 if k & 2 else 1.0

    scaled = [(a, b, sign(b), _product(algebra, a, b)) for a in blades for b in blades]
    return [(a, b, {blade: one * x for blade, x in terms.items()}) for a, b, one, terms in scaled]


@cache
def _wedged(algebra: str, blades: frozenset[int]) -> list[tuple[int, int, Terms]]:
    """Return the terms of ``x ^ x`` for bivectors, and of the same product of complements for their duals."""
    whole = (1 << len(_SQUARES[algebra][0])) - 1
    dual = any(blade.bit_count() != 2 for blade in blades)
    found = []
    for a in blades:
        for b in blades:
            one, two = (whole ^ a, whole ^ b) if dual else (a, b)
            if not one & two:
                sign = _swaps(one, two) * (_swaps(a, one) * _swaps(b, two) if dual else 1.0)
                found.append((a, b, {one | two: sign}))
    return found


@cache
def _product(algebra: str, a: int, b: int) -> Terms:
    """Return the geometric product of two blades: with ``a = v ^ c`` it is ``v (c b) - (v . c) b``."""
    if not a:
        return {b: 1.0}
    k = (a & -a).bit_length() - 1
    rest = a & a - 1
    total: Terms = {}
    for blade, x in _product(algebra, rest, b).items():
        for part, y in (*_contracted(algebra, k, blade).items(), *_joined(k, blade).items()):
            total[part] = total.get(part, 0.0) + x * y
    for blade, x in _contracted(algebra, k, rest).items():
        for part, y in _product(algebra, blade, b).items():
            total[part] = total.get(part, 0.0) - x * y
    return {blade: x for blade, x in total.items() if x}


def _joined(k: int, blade: int) -> Terms:
    return {} if blade >> k & 1 else {blade | 1 << k: _swaps(1 << k, blade)}


def _contracted(algebra: str, k: int, blade: int) -> Terms:
    """Return the left contraction of vector k and a blade."""
    names, squares = _SQUARES[algebra]
    found: Terms = {}
    for j in range(len(names)):
        product = squares[k] if j == k else -1.0 if {names[j], names[k]} == {"e0", "einf"} else 0.0
        if blade >> j & 1 and product:
            found[blade ^ 1 << j] = product * _swaps(1 << j, blade ^ 1 << j)
    return found
