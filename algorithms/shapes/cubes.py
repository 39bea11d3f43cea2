"""The table of marching cubes, generated from the 24 rotors of the cube.

Corner i of the unit cube has the coordinates of the bits of i, x first. A code has bit i if corner i is inside. Rotors
map codes to codes; of each class of codes, one is triangulated, and rotors take the triangles to the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generated import vga3

from ..arguments import Reals
from ..precision import NEGLIGIBLE

Integers = NDArray[np.integer[Any]]
CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
EDGES = tuple((i, i | 1 << axis) for axis in range(3) for i in range(8) if not i >> axis & 1)
"""The corners of the twelve edges; four edges along x, then y, then z."""


@cache
def rotors() -> Reals:
    """Return the 24 rotors (24, 4) of the cube, of either sign: the products of quarter turns about the axes."""
    quarters = np.eye(4)[0] / np.sqrt(2) + np.eye(4)[1:] / np.sqrt(2)
    found = [np.eye(4)[0]]
    for rotor in found:
        for quarter in quarters:
            product = np.asarray(vga3.rotor_product(quarter, rotor))
            if not any(abs(abs(product @ other) - 1) < NEGLIGIBLE for other in found):
                found.append(product)
    return np.array(found)


@cache
def corner_permutations() -> Integers:
    """Return to which corner each rotor takes each corner, (24, 8)."""
    arms = CORNERS - 0.5
    moved = np.asarray(vga3.rotate_vector(rotors()[:, None, :], arms)) + 0.5
    return np.asarray(np.rint(moved).astype(int) @ np.array([1, 2, 4]))


@cache
def _images() -> Integers:
    """Return the code to which each rotor takes each code, (24, 256)."""
    bits = np.arange(256)[:, None] >> np.arange(8) & 1
    return np.asarray((bits[None] << corner_permutations()[:, None, :]).sum(-1))


def classes(*, complement: bool) -> Integers:
    """Return the least code of the class of each of the 256 codes.

    Parameters
    ----------
    complement : bool
        Whether codes whose inside and outside are exchanged are in one class: there are 15 such classes, and 23 under
        rotations alone.
    """
    least = _images().min(0)
    return np.asarray(np.minimum(least, least[::-1]) if complement else least)


def _faces() -> list[list[int]]:
    """Return the corners of each face, counterclockwise for an observer outside."""
    result = []
    for axis in range(3):
        u, v = 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
        result.append([0, v, u | v, u])
        result.append([corner | 1 << axis for corner in (0, u, u | v, v)])
    return result


def _loops(code: int) -> list[list[int]]:
    """Return the polygons of a code as cycles of edges.

    On each face, a segment separates each run of inside corners from the others. A face with two opposite inside
    corners has two segments, each of which cuts off one of them; the cell on the other side decides in the same way,
    so that the surface is closed.
    """
    number = {frozenset(edge): i for i, edge in enumerate(EDGES)}
    following: dict[int, int] = {}
    for face in _faces():
        inside = [code >> corner & 1 for corner in face]
        for k in range(4):
            if inside[k] and not inside[(k + 1) % 4]:
                j = k
                while inside[j]:
                    j = (j - 1) % 4
                leaving = number[frozenset((face[k], face[(k + 1) % 4]))]
                following[leaving] = number[frozenset((face[j], face[(j + 1) % 4]))]
    result = []
    while following:
        loop = [next(iter(following))]
        while (edge := following.pop(loop[-1])) != loop[0]:
            loop.append(edge)
        result.append(loop)
    return result


@dataclass(frozen=True, eq=False)
class Table:
    """The triangles of all codes.

    Attributes
    ----------
    counts, starts : array of int, (256,)
        The number of triangles of a code, and the row of the first one.
    triangles : array of int, (n, 3)
        Edges of the cube, counterclockwise for an observer outside.
    """

    counts: Integers
    starts: Integers
    triangles: Integers


@cache
def table() -> Table:
    """Return the triangles of all codes: those of one code of each class, moved by rotors."""
    number = {frozenset(edge): i for i, edge in enumerate(EDGES)}
    permutations = corner_permutations()
    edges = np.array([[number[frozenset((int(p[i]), int(p[j])))] for i, j in EDGES] for p in permutations])
    least, images = classes(complement=False), _images()
    parts = []
    for code in range(256):
        loops = _loops(int(least[code]))
        fans = [[loop[0], b, a] for loop in loops for a, b in pairwise(loop[1:])]
        rotor = int(np.argmax(images[:, least[code]] == code))
        parts.append(edges[rotor][np.array(fans, int).reshape(-1, 3)])
    counts = np.array([len(part) for part in parts])
    return Table(counts, np.cumsum(counts) - counts, np.vstack(parts))
