"""Objects as those of ganja.js, and scenes for its viewers.

ganja.js numbers basis vectors from ``e0`` where one squares to zero and from ``e1`` elsewhere: those that square to 0
first, to 1 next, to -1 last. Its coefficients are by grade, and in the order of these numbers within one: for PGA3

    1, e0, e1, e2, e3, e01, e02, e03, e12, e13, e23, e012, e013, e023, e123, e0123

and for CGA3 ``1, e1, ... e5, e12, ... e45, e123, ... e12345``, where ``e0`` and ``einf`` here are ``(e5 - e4) / 2`` and
``e4 + e5``. Another order or orientation can be given as `basis`, as ganja.js takes it: the modules that it generates
for other languages have `GENERATED_PGA3`.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ..algebra.algebra import Algebra
from ..errors import AlgebraError, LayoutError
from ..generation.files import write
from .arrays import MultivectorArray
from .exchange import Matrix, algebra_of, change_of_basis, dense_of, of_dense
from .scene import COLOURS, shapes_of
from .spaces import Space

GENERATED_PGA3 = "1 e0 e1 e2 e3 e01 e02 e03 e12 e31 e23 e021 e013 e032 e123 e0123"
"""The order of the modules for PGA3 that ganja.js generates in C++, Python and other languages."""

_NULL = 1e-9
"""Vectors are points where their square is at most this part of its terms."""


def ganja_basis(algebra: Algebra | Space) -> tuple[str, ...]:
    """The names of ganja.js for its coefficients, in their order.

    Parameters
    ----------
    algebra : Algebra or Space
    """
    target = _target(algebra_of(algebra))
    chosen = (each for k in range(target.dimension + 1) for each in combinations(range(target.dimension), k))
    return tuple(target.spelling(sum(1 << i for i in each))[1] for each in chosen)


def to_ganja(x: MultivectorArray, basis: str | Sequence[str] | None = None) -> Matrix:
    """The coefficients that ganja.js has for multivectors.

    Parameters
    ----------
    x : MultivectorArray
    basis : str or sequence of str, optional
        The blades, where they are others than `ganja_basis` has.

    Returns
    -------
    array, (..., 2**n)

    Raises
    ------
    AlgebraError
        Where the basis vectors are neither orthogonal with squares 0, 1, -1 nor null pairs, or `basis` is no basis.
    """
    places, signs = _order(x.algebra, basis)
    return np.asarray(
        (dense_of(x) @ change_of_basis(x.algebra, _signature(x.algebra), True))[..., places] * signs + 0.0
    )


def from_ganja(algebra: Algebra | Space, coefficients: Any, basis: str | Sequence[str] | None = None) -> Any:
    """Multivectors from coefficients of ganja.js, ``(..., 2**n)``; they store the blades that occur.

    Raises
    ------
    AlgebraError, LayoutError
        As `to_ganja`, and where coefficients are not as many as the algebra has.
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
    *objects: Any,
    labels: Sequence[str] | None = None,
    colours: Sequence[str] | None = None,
) -> None:
    """Write a scene for the viewers of ganja.js: a list of colours, elements and labels, as ``graph`` takes it.

    Parameters
    ----------
    path : path
        A file of JSON. Colours are numbers, elements lists of coefficients by `ganja_basis`, labels text after the
        element that they belong to: the last, of an array.
    *objects : MultivectorArray
        Blades of one of PGA2, CGA2, PGA3, CGA3, as `draw` takes them; of an array, every element. Vectors of conformal
        algebras that are not null stand for what they are the dual of, as in `draw`, and are written so.
    labels, colours : sequence of str, optional
        One for each object; colours as ``#1f77b4`` or as matplotlib names them.

    Raises
    ------
    AlgebraError, LayoutError, BackendError
        Where an object has no picture, algebras differ, labels or colours are not as many, or the file cannot be
        written.
    """
    if not objects:
        raise AlgebraError("save_ganja", "no object", "at least one")
    for name, given in (("labels", labels), ("colours", colours)):
        if given is not None and len(given) != len(objects):
            raise LayoutError("save_ganja", f"{len(given)} {name}", f"{len(objects)}, one for each object")
    scene: list[Any] = []
    for k, x in enumerate(objects):
        shapes_of(x)
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
    """What ganja is given of every element: vectors of conformal algebras as points, or what they are dual to."""
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
    from matplotlib.colors import to_rgb

    try:
        red, green, blue = (round(255 * part) for part in to_rgb(name))
    except ValueError:
        raise LayoutError("save_ganja", f"the colour {name!r}", "one of matplotlib, such as #1f77b4 or red") from None
    return red << 16 | green << 8 | blue


def _signature(algebra: Algebra) -> tuple[Any, ...]:
    """The squares of ganja's basis vectors: 0, then 1, then -1."""
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
    """The bitmaps and the orientations of ganja's coefficients."""
    target = _target(algebra)
    names = basis.split() if isinstance(basis, str) else basis or ganja_basis(algebra)
    blades = [target.blade(name) for name in names]
    places = [blade for _, blade in blades]
    if sorted(places) != list(range(1 << target.dimension)):
        raise AlgebraError("basis", f"{len(set(places))} different blades", f"all {1 << target.dimension}")
    return places, np.array([sign for sign, _ in blades], float)
