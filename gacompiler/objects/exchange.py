"""Storage of objects in files, and conversion to and from other libraries: clifford and kingdon."""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, overload

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.multivector import Multivector
from ..errors import AlgebraError, LayoutError
from ..gac_runtime.annotations import Numbers
from ..generation.files import write
from .arrays import MultivectorArray, of_rows, wrap
from .layouts import layout_of
from .plain_data import packed, unpacked
from .spaces import M, Space

if TYPE_CHECKING:
    from clifford import Layout as CliffordLayout
    from clifford import MultiVector as CliffordMultivector
    from kingdon import Algebra as KingdonAlgebra
    from kingdon import MultiVector as KingdonMultivector

    CliffordMultivectors: TypeAlias = CliffordMultivector | np.ndarray[tuple[int, ...], np.dtype[np.object_]]

Matrix = np.ndarray[Any, Any]


# Files.


def save(path: str | os.PathLike[str], **objects: MultivectorArray | Numbers) -> None:
    """Write named multivectors and numbers to a file.

    Parameters
    ----------
    path : path
        The suffix selects the format: ``.json``, text that other programs can read, or ``.npz``, the format of numpy,
        for large batches.
    **objects : multivectors of any shape, numbers or arrays of real numbers

    Raises
    ------
    LayoutError, ValueError, BackendError
        If the suffix or the type of an object is not supported, or the file cannot be written. An incomplete file is
        never left behind.
    """
    target = Path(path)
    described, arrays = {}, {}
    for name, value in objects.items():
        if isinstance(value, MultivectorArray):
            algebra, layout = packed(value.layout)
            described[name] = {"algebra": algebra, "layout": layout, "blades": list(value.layout.blades)}
            arrays[name] = np.asarray(value.values)
        else:
            arrays[name] = np.asarray(value)
            described[name] = {}
            several = isinstance(value, (list, tuple)) and any(isinstance(each, MultivectorArray) for each in value)
            if arrays[name].dtype.kind not in "fiub" or several:
                kind = type(value).__name__
                raise LayoutError(f"save: {name}", f"an object of type {kind}", "a multivector or real numbers")
    if _ending(target) == ".json":
        whole = {
            name: {**about, "type": str(array.dtype), "shape": array.shape, "values": array.tolist()}
            for (name, about), array in zip(described.items(), arrays.values(), strict=True)
        }
        content = (json.dumps(whole, indent=1) + "\n").encode()
    else:
        named: dict[str, Any] = {f"values.{name}": array for name, array in arrays.items()}
        stream = io.BytesIO()
        np.savez(stream, about=json.dumps(described), **named)
        content = stream.getvalue()
    write({target.name: content}, target.parent)


def load(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a file written by `save` and return its objects by name, with their layouts.

    Raises
    ------
    LayoutError, ValueError
        If the file was not written by `save`.

    Notes
    -----
    The file cannot contain code, so that reading an untrusted file is safe.
    """
    source = Path(path)
    try:
        if _ending(source) == ".json":
            whole = json.loads(source.read_text(encoding="utf-8"))
            described = {
                name: (about, np.asarray(about["values"], about["type"]).reshape(about["shape"]))
                for name, about in whole.items()
            }
        else:
            with source.open("rb") as content, zipfile.ZipFile(content):  # numpy takes other files for pickles
                pass
            with np.load(source, allow_pickle=False) as file:
                about = json.loads(str(file["about"]))
                described = {name: (each, file[f"values.{name}"]) for name, each in about.items()}
        return {name: _restored(about, values) for name, (about, values) in described.items()}
    except (KeyError, TypeError, AttributeError, ValueError, zipfile.BadZipFile) as error:
        raise ValueError(f"{source}: not a file of objects ({error}); expected a file written by save()") from error


def _restored(about: Mapping[str, Any], values: Matrix) -> Any:
    if "layout" in about:
        return wrap(unpacked(about["algebra"], about["layout"]), values)
    return values.item() if values.ndim == 0 else values


def _ending(path: Path) -> str:
    if path.suffix not in (".json", ".npz"):
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected .json or .npz")
    return path.suffix


# Other libraries.


def to_clifford(x: MultivectorArray, layout: CliffordLayout) -> CliffordMultivectors:
    """Convert multivectors to a layout of clifford.

    Parameters
    ----------
    x : MultivectorArray
    layout : clifford.Layout
        A layout with the same signature. Vectors are mapped to vectors with the same square, in order. A null pair,
        such as ``e0, einf`` of conformal space, is mapped to ``(e- - e+) / 2, e- + e+``, which are clifford's
        ``eo, einf``.

    Returns
    -------
    clifford.MultiVector or array of them
        With the shape of `x`.

    Raises
    ------
    AlgebraError
        If the signature differs, or the basis of the algebra does not consist of orthogonal vectors and null pairs.
    """
    values = dense_of(x) @ change_of_basis(x.algebra, _signature(layout.sig), True)[:, _places(layout)]
    found = np.empty(x.shape, object)
    for place in np.ndindex(x.shape):
        found[place] = layout.MultiVector(value=values[place])
    return found[()]


@overload
def from_clifford(algebra: Space[M], found: CliffordMultivectors) -> M: ...
@overload
def from_clifford(algebra: Algebra, found: CliffordMultivectors) -> MultivectorArray: ...
def from_clifford(algebra: Algebra | Space[M], found: CliffordMultivectors) -> M | MultivectorArray:
    """Convert multivectors of clifford to an algebra with the same signature.

    Parameters
    ----------
    algebra : Algebra or Space
        For example ``CGA3`` of `gacompiler.objects`.
    found : clifford.MultiVector or array of them

    Returns
    -------
    MultivectorArray
        Multivectors that store the blades that occur; `as_layout` converts them to spheres, for example.
    """
    owner = algebra_of(algebra)
    one = hasattr(found, "layout")
    shape = () if one else np.shape(found)
    listed: list[Any] = [found] if one else list(np.ravel(found))
    if not listed:
        raise AlgebraError("from_clifford", "an empty array", "at least one multivector")
    layout = listed[0].layout
    values = np.stack([np.asarray(each.value, float) for each in listed])
    dense = values @ change_of_basis(owner, _signature(layout.sig), False)[_places(layout)]
    return of_dense(owner, dense.reshape(*shape, -1))


def to_kingdon(x: MultivectorArray, algebra: KingdonAlgebra) -> KingdonMultivector:
    """Convert multivectors to an algebra of kingdon.

    Parameters
    ----------
    x : MultivectorArray
    algebra : kingdon.Algebra
        An algebra with the same signature; vectors are mapped as in `to_clifford`.

    Returns
    -------
    kingdon.MultiVector
        A multivector with the blades that occur. Coefficients are numbers or arrays with the shape of `x`.
    """
    values = dense_of(x) @ change_of_basis(x.algebra, _signature(algebra.signature), True)
    keys = [k for k in range(values.shape[-1]) if values[..., k].any()] or [0]
    return algebra.multivector(keys=tuple(keys), values=[values[..., k][()] for k in keys])


@overload
def from_kingdon(algebra: Space[M], found: KingdonMultivector) -> M: ...
@overload
def from_kingdon(algebra: Algebra, found: KingdonMultivector) -> MultivectorArray: ...
def from_kingdon(algebra: Algebra | Space[M], found: KingdonMultivector) -> M | MultivectorArray:
    """Convert a multivector of kingdon to an algebra with the same signature; see `from_clifford`."""
    owner = algebra_of(algebra)
    parts = np.broadcast_arrays(*(np.asarray(value, float) for value in found.values()))
    values = np.zeros((*parts[0].shape, 1 << owner.dimension))
    for key, part in zip(found.keys(), parts, strict=True):
        values[..., key] = part
    return of_dense(owner, values @ change_of_basis(owner, _signature(found.algebra.signature), False))


def algebra_of(algebra: Algebra | Space[M]) -> Algebra:
    """Return the algebra of a space; an algebra is returned unchanged."""
    return algebra.algebra if isinstance(algebra, Space) else algebra


def _signature(squares: Sequence[Any]) -> tuple[int, ...]:
    return tuple(map(int, squares))


def _places(layout: Any) -> list[int]:
    """Return the bitmaps of clifford's blades, in its order."""
    names = [blade[0] for blade in layout.bladeTupList if len(blade) == 1]
    return [sum(1 << names.index(name) for name in blade) for blade in layout.bladeTupList]


def dense_of(x: MultivectorArray) -> Matrix:
    """Return all coefficients, each at the index given by the bitmap of its blade."""
    full = x.algebra.full
    values = np.asarray(x.as_layout(full).values)
    dense = np.zeros((*x.shape, 1 << x.algebra.dimension), values.dtype)
    for k, slot in enumerate(full.stored):
        dense[..., slot.blade] = values[..., k] * slot.sign
    return dense


def of_dense(algebra: Algebra, dense: Matrix) -> Any:
    """Create multivectors from the result of `dense_of`, with the blades that are not 0 everywhere."""
    layout = layout_of(algebra, [k for k in range(dense.shape[-1]) if dense[..., k].any()] or [0])
    return of_rows(layout, np.stack([dense[..., slot.blade] * slot.sign for slot in layout.stored], -1))


@cache
def change_of_basis(algebra: Algebra, signature: tuple[int, ...], there: bool) -> Matrix:
    """Return the matrix that converts rows of coefficients to those for orthogonal vectors of these squares, or back.

    If `there` is true, the matrix converts from `algebra` to the orthogonal vectors.
    """
    target = Algebra("orthogonal", [f"v{k}_" for k in range(len(signature))], list(signature))
    forth, back = _images(algebra, target)
    own, images = (algebra, forth) if there else (target, back)
    other = target if there else algebra
    rows = np.zeros((1 << own.dimension, 1 << other.dimension))
    for blade in own.blades():
        image = Multivector(other, {0: Fraction(1)})
        for k in range(own.dimension):
            if blade >> k & 1:
                image = image ^ images[k]
        for place, value in image.terms.items():
            rows[blade, place] = float(value)
    return rows


def _images(algebra: Algebra, target: Algebra) -> tuple[list[Multivector], list[Multivector]]:
    """Return the images of an algebra's vectors in the orthogonal algebra, and the images of the inverse map."""
    free: dict[int, list[int]] = {1: [], -1: [], 0: []}
    for k in range(target.dimension):
        free[int(target.gram[k][k])].append(k)
    forth: dict[int, Multivector] = {}
    back: dict[int, Multivector] = {}
    gram, size, pairs = algebra.gram, algebra.dimension, algebra.null_pairs
    own, other = _vectors(algebra), _vectors(target)
    for k in range(size):
        if any(k in pair for pair in pairs):
            continue
        if any(gram[k][j] for j in range(size) if j != k):
            raise AlgebraError(str(algebra), "an oblique basis", "orthogonal vectors and null pairs")
        place = _taken(free, gram[k][k], algebra, target)
        forth[k], back[place] = other(place), own(k)
    for k, j in pairs:
        product = gram[k][j]
        plus, minus = _taken(free, 1, algebra, target), _taken(free, -1, algebra, target)
        forth[k], forth[j] = (other(minus) - other(plus)) * Fraction(-product, 2), other(minus) + other(plus)
        half, part = own(j) * Fraction(1, 2), own(k) * (1 / Fraction(-product))
        back[minus], back[plus] = half + part, half - part
    if len(back) != target.dimension:
        raise _unlike(algebra, target)
    return [forth[k] for k in range(size)], [back[k] for k in range(target.dimension)]


def _vectors(algebra: Algebra) -> Callable[[int], Multivector]:
    return lambda k: Multivector(algebra, {1 << k: Fraction(1)})


def _taken(free: dict[int, list[int]], square: Any, algebra: Algebra, target: Algebra) -> int:
    if not free.get(square):
        raise _unlike(algebra, target)
    return free[square].pop(0)


def _unlike(algebra: Algebra, target: Algebra) -> AlgebraError:
    squares = " ".join(str(target.gram[k][k]) for k in range(target.dimension))
    return AlgebraError(str(algebra), f"vectors of squares {squares} in the other library", "the same signature")
