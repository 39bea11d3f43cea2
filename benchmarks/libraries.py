"""Calls of kingdon on arrays, and of clifford on one element at a time.

Both libraries use orthogonal vectors. If an algebra of gacompiler has null vectors, coefficients are converted by the
matrix of the change of basis before the time is measured.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Vector = dict[int, float]
"""Coefficients, with the bitmap of orthogonal vectors as key."""

_CGA3 = {"e1": {1: 1.0}, "e2": {2: 1.0}, "e3": {4: 1.0}, "e0": {8: -0.5, 16: 0.5}, "einf": {8: 1.0, 16: 1.0}}
_PGA3 = {"e1": {1: 1.0}, "e2": {2: 1.0}, "e3": {4: 1.0}, "e0": {8: 1.0}}

ALGEBRAS: dict[str, tuple[tuple[int, ...], dict[str, Vector]]] = {
    "pga3": ((1, 1, 1, 0), _PGA3),
    "cga3": ((1, 1, 1, 1, -1), _CGA3),
    "vga3": ((1, 1, 1), {name: _PGA3[name] for name in ("e1", "e2", "e3")}),
}
"""For each module: the squares of the orthogonal vectors, and the basis vectors of the module as sums of them."""

FORMULAS = {"product": "a * b", "sandwich": "a x ~a", "outer": "a ^ b ^ c"}
"""The formulas of kernels, in the notation of the pages."""


@dataclass(frozen=True, slots=True)
class Call:
    """A call to time, and the function that converts its result to coefficients of the kernel."""

    run: Callable[[], Any]
    read: Callable[[Any], np.ndarray]


Peer = Callable[[Any, str, str, Sequence[np.ndarray]], Call]
"""A function that prepares a call, given a kernel, its module, its formula and its arguments."""


IMPORTED = {"numpy-quaternion": "quaternion", "pin": "pinocchio"}
"""Module names of packages that are imported by another name."""


def installed(name: str) -> bool:
    """Return whether a package can be imported."""
    try:
        importlib.import_module(IMPORTED.get(name, name))
    except ImportError:
        return False
    return True


def kingdon(kernel: Any, module: str, formula: str, arrays: Sequence[np.ndarray]) -> Call:
    """Prepare a call of kingdon, on multivectors whose coefficients are arrays."""
    squares, _ = ALGEBRAS[module]
    algebra = _memo(("kingdon", module), lambda: _module("kingdon").Algebra(signature=list(squares), start_index=1))
    arguments = []
    for layout, array in zip(kernel.layouts.values(), arrays, strict=False):
        matrix, constant = _blades(module, layout)
        values = array @ matrix.T + constant
        keys = [k for k in range(len(constant)) if matrix[k].any() or constant[k]]
        values = [values[..., k].copy() for k in keys]
        arguments.append(algebra.multivector(values=values, keys=tuple(keys)))
    run = _formula(formula, arguments, lambda a, x: a >> x)

    def read(result: Any) -> np.ndarray:
        terms = dict(result.items())
        shape = np.broadcast_shapes(*(np.shape(value) for value in terms.values()))
        return _own(kernel, module, [np.broadcast_to(terms.get(k, 0.0), shape) for k in range(1 << len(squares))])

    return Call(run, read)


def clifford(kernel: Any, module: str, formula: str, arrays: Sequence[np.ndarray]) -> Call:
    """Prepare calls of clifford, in a Python loop over multivectors of all coefficients, one for each element."""
    squares, _ = ALGEBRAS[module]
    layout = _memo(("clifford", module), lambda: _module("clifford").Layout(list(squares)))
    bitmaps = [sum(1 << (k - 1) for k in names) for names in layout.bladeTupList]
    shape = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
    columns = []
    for own, array in zip(kernel.layouts.values(), arrays, strict=False):
        matrix, constant = _blades(module, own)
        values = (array @ matrix.T + constant)[..., bitmaps]
        made = [layout.MultiVector(value) for value in values.reshape(-1, len(bitmaps))]
        columns.append(made * (int(np.prod(shape)) // len(made)))
    one = [_formula(formula, arguments, lambda a, x: a * x * ~a) for arguments in zip(*columns, strict=True)]

    def read(results: Any) -> np.ndarray:
        values = np.empty((len(results), len(bitmaps)))
        values[:, bitmaps] = [result.value for result in results]
        return _own(kernel, module, list(values.T)).reshape(*shape, -1)

    return Call(lambda: [each() for each in one], read)


LIBRARIES: dict[str, tuple[Peer, int]] = {"kingdon": (kingdon, 10**9), "clifford": (clifford, 1000)}
"""For each library: the peer, and its maximum number of elements.

clifford computes one element at a time, so its time per element does not depend on the number of elements.
"""


def _formula(name: str, arguments: Sequence[Any], sandwich: Callable[[Any, Any], Any]) -> Callable[[], Any]:
    if name == "sandwich":
        a, x = arguments
        return lambda: sandwich(a, x)
    if name == "product":
        a, b = arguments
        return lambda: a * b
    a, b, c = arguments
    return lambda: a ^ b ^ c


def _own(kernel: Any, module: str, theirs: list[np.ndarray]) -> np.ndarray:
    """Convert coefficients by bitmap to those of the result of a kernel; the last axis is that of the blades."""
    matrix, constant = _blades(module, list(kernel.layouts.values())[-1])
    return (np.stack(theirs, -1) - constant) @ np.linalg.pinv(matrix).T


def _blades(module: str, layout: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the stored blades of a layout as columns of a matrix, and the sum of its fixed blades."""
    squares, vectors = ALGEBRAS[module]
    matrix = np.zeros((1 << len(squares), len(layout.blades)))
    constant = np.zeros(len(matrix))
    for column, blade in enumerate(layout.blades):
        for bitmap, value in _outer(vectors, blade).items():
            matrix[bitmap, column] = value
    for blade, value in layout.fixed:
        for bitmap, coefficient in _outer(vectors, blade).items():
            constant[bitmap] += float(value) * coefficient
    return matrix, constant


def _outer(vectors: dict[str, Vector], blade: str) -> Vector:
    """Return the outer product of the vectors in a blade's name, such as e12inf."""
    product: Vector = {0: 1.0}
    for index in re.findall(r"inf|\d", blade[1:]):
        terms: Vector = {}
        for left, a in product.items():
            for right, b in vectors[f"e{index}"].items():
                if not left & right:
                    sign = -1 if (left & -right).bit_count() & 1 else 1
                    terms[left | right] = terms.get(left | right, 0.0) + sign * a * b
        product = terms
    return product


_made: dict[tuple[str, str], Any] = {}


def _memo(key: tuple[str, str], make: Callable[[], Any]) -> Any:
    if key not in _made:
        _made[key] = make()
    return _made[key]


def _module(name: str) -> Any:
    return importlib.import_module(name)
