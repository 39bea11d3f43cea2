"""Conversion to and from multivectors of ganja.js, and scenes for its viewers.

ganja.js numbers basis vectors from ``e0`` if one of them squares to zero, else from ``e1``: first those with square 0,
then those with square 1, then those with square -1. Its coefficients are ordered by grade, and within a grade by these
numbers. For PGA3 the order is

    1, e0, e1, e2, e3, e01, e02, e03, e12, e13, e23, e012, e013, e023, e123, e0123

and for CGA3 ``1, e1, ... e5, e12, ... e45, e123, ... e12345``; ``e0`` and ``einf`` of this package are
``(e5 - e4) / 2`` and ``e4 + e5``. Another order or orientation can be passed as `basis`, as in ganja.js: the modules
that it generates for other languages use `GENERATED_PGA3`.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, overload

import numpy as np

from ..algebra.algebra import Algebra
from ..errors import AlgebraError, LayoutError, needs
from ..gac_runtime.annotations import Numbers
from ..generation.files import write
from .arrays import MultivectorArray
from .exchange import Matrix, algebra_of, change_of_basis, dense_of, of_dense
from .scene import COLOURS, Frame, shapes_of
from .spaces import M, Space

GENERATED_PGA3 = "1 e0 e1 e2 e3 e01 e02 e03 e12 e31 e23 e021 e013 e032 e123 e0123"
"""The order of the modules for PGA3 that ganja.js generates in C++, Python and other languages."""

_NULL = 1e-9
"""Vectors are points if their square is at most this fraction of the sum of its terms' absolute values."""


def ganja_basis(algebra: Algebra | Space[M]) -> tuple[str, ...]:
    """Return the names of coefficients in ganja.js, in order.

    Parameters
    ----------
    algebra : Algebra or Space
    """
    target = _target(algebra_of(algebra))
    chosen = (each for k in range(target.dimension + 1) for each in combinations(range(target.dimension), k))
    return tuple(target.spelling(sum(1 << i for i in each))[1] for each in chosen)


def to_ganja(x: MultivectorArray, basis: str | Sequence[str] | None = None) -> Matrix:
    """Convert multivectors to coefficients of ganja.js.

    Parameters
    ----------
    x : MultivectorArray
    basis : str or sequence of str, optional
        The blades, by default those of `ganja_basis`.

    Returns
    -------
    array, (..., 2**n)

    Raises
    ------
    AlgebraError
        If the basis vectors are neither orthogonal with squares 0, 1, -1 nor null pairs, or `basis` is not a basis.
    """
    places, signs = _order(x.algebra, basis)
    return np.asarray(
        (dense_of(x) @ change_of_basis(x.algebra, _signature(x.algebra), True))[..., places] * signs + 0.0
    )


@overload
def from_ganja(algebra: Space[M], coefficients: Numbers, basis: str | Sequence[str] | None = None) -> M: ...
@overload
def from_ganja(
    algebra: Algebra, coefficients: Numbers, basis: str | Sequence[str] | None = None
) -> MultivectorArray: ...
def from_ganja(
    algebra: Algebra | Space[M], coefficients: Numbers, basis: str | Sequence[str] | None = None
) -> M | MultivectorArray:
    """Create multivectors from coefficients of ganja.js, ``(..., 2**n)``; they store the blades that occur.

    Raises
    ------
    AlgebraError, LayoutError
        As in `to_ganja`, and if the number of coefficients is not that of the algebra.
    """
    owner = algebra_of(algebra)
    given = np.asarray(coefficients, float)
    if given.ndim == 0 or given.shape[-1] != 1 << owner.dimension:
        raise LayoutError("from_ganja", f"coefficients of shape {given.shape}", f"(..., {1 << owner.dimension})")
    places, signs = _order(owner, basis)
    dense = np.empty_like(given)
    dense[..., places] = given * signs
    return of_dense(owner, dense @ change_of_basis(owner, _signature(owner), False))


def save_ganja(
    path: str | os.PathLike[str],
    *objects: MultivectorArray,
    labels: Sequence[str] | None = None,
    colours: Sequence[str] | None = None,
) -> None:
    """Write a scene for the viewers of ganja.js: a list of colours, elements and labels, as expected by ``graph``.

    Parameters
    ----------
    path : path
        A JSON file. Colours are numbers, elements are lists of coefficients in the order of `ganja_basis`, and labels
        are strings after their element; the label of an array follows its last element.
    *objects : MultivectorArray
        Blades of one of PGA2, CGA2, PGA3, CGA3, as in `draw`; all elements of an array are written. Vectors of
        conformal algebras that are not null are replaced by their duals, as in `draw`.
    labels, colours : sequence of str, optional
        One for each object; colours as ``#1f77b4`` or as named by matplotlib.

    Raises
    ------
    AlgebraError, LayoutError, BackendError
        If an object cannot be drawn, algebras differ, the number of labels or colours is wrong, or the file cannot be
        written.
    """
    if not objects:
        raise AlgebraError("save_ganja", "no object", "at least one")
    for name, given in (("labels", labels), ("colours", colours)):
        if given is not None and len(given) != len(objects):
            raise LayoutError("save_ganja", f"{len(given)} {name}", f"{len(objects)}, one for each object")
    scene: list[Any] = []
    for k, x in enumerate(objects):
        if any(isinstance(shape, Frame) for shape in shapes_of(x)):
            raise AlgebraError("save_ganja", "a motor", "blades", "save the objects that it moves")
        first, own = objects[0].algebra, x.algebra
        if own != first:
            raise AlgebraError("save_ganja", f"objects of {first.name} and {own.name}", "one algebra")
        scene.append(_colour(colours[k] if colours else COLOURS[k % len(COLOURS)]))
        elements = _elements(x).reshape(-1, 1 << own.dimension).tolist()
        scene += elements
        if labels and labels[k] and elements:
            scene.append(labels[k])
    target = Path(path)
    write({target.name: json.dumps(scene) + "\n"}, target.parent)


def _elements(x: MultivectorArray) -> Matrix:
    """Return the coefficients of all elements; conformal vectors that are not points are replaced by their duals."""
    bits = [slot.blade for slot in x.layout.stored]
    if not x.algebra.null_pairs or any(bit.bit_count() != 1 for bit in bits):
        return to_ganja(x)
    axes = [bit.bit_length() - 1 for bit in bits]
    gram = np.abs(np.array([[float(x.algebra.gram[i][j]) for j in axes] for i in axes]))
    sizes = np.abs(np.asarray(x.values))
    terms = np.einsum("...i,ij,...j", sizes, gram, sizes)
    is_point = np.abs(np.asarray(x.norm_squared())) <= _NULL * terms
    return np.where(is_point[..., None], to_ganja(x), to_ganja(x.polarity()))


def _colour(name: str) -> int:
    with needs("pictures", "save_ganja"):
        from matplotlib.colors import to_rgb

    try:
        red, green, blue = (round(255 * part) for part in to_rgb(name))
    except ValueError:
        raise LayoutError("save_ganja", f"the colour {name!r}", "one of matplotlib, such as #1f77b4 or red") from None
    return red << 16 | green << 8 | blue


def _signature(algebra: Algebra) -> tuple[Any, ...]:
    """Return the squares of ganja's basis vectors: 0, then 1, then -1."""
    paired = {k for pair in algebra.null_pairs for k in pair}
    squares = [algebra.gram[k][k] for k in range(algebra.dimension) if k not in paired]
    if not {0, 1, -1}.issuperset(squares):
        listed = " ".join(map(str, squares))
        raise AlgebraError(str(algebra), f"vectors with squares {listed}", "squares 0, 1, -1, or null pairs")
    return tuple(sorted(squares + [1, -1] * len(algebra.null_pairs), key=(0, 1, -1).index))


def _target(algebra: Algebra) -> Algebra:
    squares = _signature(algebra)
    first = 0 if 0 in squares else 1
    width = 2 if len(squares) > 9 else 1
    return Algebra("ganja", [f"e{first + k:0{width}}" for k in range(len(squares))], squares)


def _order(algebra: Algebra, basis: str | Sequence[str] | None) -> tuple[list[int], Matrix]:
    """Return the bitmaps and the orientations of ganja's coefficients."""
    target = _target(algebra)
    names = basis.split() if isinstance(basis, str) else basis or ganja_basis(algebra)
    blades = [target.blade(name) for name in names]
    places = [blade for _, blade in blades]
    if sorted(places) != list(range(1 << target.dimension)):
        raise AlgebraError("basis", f"{len(set(places))} different blades", f"all {1 << target.dimension}")
    return places, np.array([sign for sign, _ in blades], float)
