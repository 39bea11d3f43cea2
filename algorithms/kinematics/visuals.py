"""What the links of a URDF file look like: boxes, cylinders, spheres, and convex hulls of meshes.

Where a mesh cannot be read, a link looks like its <collision> elements.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import scipy

from generated import pga3

from ..arguments import Reals
from .errors import DescriptionError
from .packages import folders_of
from .urdf import described, numbers, origin_of

Faces = Sequence[Sequence[int]]
_SIDES, _RINGS = 20, 9
"""Corners of circles, and circles of latitude of spheres with their poles."""
_HEADER = 84
"""The number of bytes of an STL file before its triangles."""
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("v", "<f4", (3, 3)), ("more", "<u2")])
"""Binary files of STL have a header that ends with the number of triangles."""
_GREY = "#8a939c"
_CORNERS = 120
"""The largest number of corners of a hull: with those of all meshes of a humanoid, a page has less than a megabyte."""
_HEIGHTS = 1 - (2 * np.arange(_CORNERS) + 1) / _CORNERS
"""Heights and"""
_TURNS = np.pi * (3 - np.sqrt(5)) * np.arange(_CORNERS)
"""angles of points that are distributed evenly over a sphere."""
_DIRECTIONS = np.stack([np.cos(_TURNS), np.sin(_TURNS), _HEIGHTS], -1) * np.sqrt(
    np.stack([1 - _HEIGHTS**2, 1 - _HEIGHTS**2, np.ones(_CORNERS)], -1)
)
"""Directions that are spread evenly, on a spiral."""


@dataclass(frozen=True, slots=True, eq=False)
class Visual:
    """A convex body of a link.

    Attributes
    ----------
    link : str
    corners : array, (v, 3)
        In the frame of the link.
    faces : sequence of sequence of int
        The corners of each face, counterclockwise from outside.
    colour : str
        Of CSS.
    """

    link: str
    corners: Reals
    faces: Faces
    colour: str


def visuals_of(source: str | Path, arguments: Mapping[str, Any]) -> tuple[list[Visual], list[str]]:
    """Return the visible bodies of a URDF file or text, and the names of files of meshes that cannot be read.

    Raises
    ------
    DescriptionError
        If the file is not a description of a robot, or numbers of a geometry are missing.
    """
    root, where = described(source, arguments)
    folder = None if str(source).lstrip().startswith("<") else Path(source).resolve().parent
    colours = {each.get("name"): each for each in root.findall("material")}
    found, missing = list[Visual](), list[str]()
    for link in root.findall("link"):
        name = link.get("name", "")
        here = f"{where}: link {name!r}"
        elements = link.findall("visual")
        shapes = [_shape(each.find("geometry"), folder, here) for each in elements]
        if any(isinstance(shape, str) for shape in shapes):
            # Meshes for pictures are often in formats with colours, and those for collisions are STL.
            coarse = [_shape(each.find("geometry"), folder, here) for each in link.findall("collision")]
            if coarse and not any(isinstance(shape, str) for shape in coarse):
                elements, shapes = link.findall("collision"), coarse
        for element, shape in zip(elements, shapes, strict=True):
            if isinstance(shape, str):
                missing.append(shape)
            elif shape is not None:
                corners, faces = shape
                placed = pga3.move_point(origin_of(element.find("origin"), here), corners)
                found.append(Visual(name, placed, faces, _colour(element.find("material"), colours)))
    return found, missing


def _shape(geometry: ElementTree.Element | None, folder: Path | None, where: str) -> tuple[Reals, Faces] | str | None:
    """Return the corners and faces of a geometry, the name of a file that cannot be read, or None."""
    element = None if geometry is None else next(iter(geometry), None)
    if element is None:
        return None

    def number(key: str, count: int = 1) -> Reals:
        return numbers(element, key, None, count, f"{where}: <{element.tag}>")

    match element.tag:
        case "box":
            return _box(number("size", 3) / 2)
        case "cylinder" | "capsule":
            return _turned(np.array([[1, -1], [1, 1]]) * [float(number("radius")[0]), float(number("length")[0]) / 2])
        case "sphere":
            angles = np.linspace(-np.pi / 2, np.pi / 2, _RINGS)[1:-1]
            radius = float(number("radius")[0])
            return _turned(radius * np.stack([np.cos(angles), np.sin(angles)], -1))
        case "mesh":
            name = element.get("filename", "")
            points = _points_of(name, folder)
            scale = numbers(element, "scale", "1 1 1", 3, f"{where}: <mesh>")
            return name if points is None else _hull(points * scale, name)
    return None


def _box(half: Reals) -> tuple[Reals, Faces]:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    return corners, [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def _turned(profile: Reals) -> tuple[Reals, Faces]:
    """Return a body of revolution about z from its radii and heights, lowest first, closed at both ends."""
    angles = 2 * np.pi * np.arange(_SIDES) / _SIDES
    around = np.stack([np.cos(angles), np.sin(angles)], -1)
    rings = [np.concatenate([radius * around, np.full((_SIDES, 1), height)], 1) for radius, height in profile]
    last = (len(rings) - 1) * _SIDES
    faces = [list(range(_SIDES))[::-1], list(range(last, last + _SIDES))]
    for start in range(0, last, _SIDES):
        for k in range(_SIDES):
            a, b = start + k, start + (k + 1) % _SIDES
            faces.append([a, b, b + _SIDES, a + _SIDES])
    return np.concatenate(rings), faces


def _hull(points: Reals, name: str) -> tuple[Reals, Faces] | str:
    """Return the convex hull of a mesh, of its outermost points if it has many; its name if it is flat."""
    if len(points) > _CORNERS:
        points = points[np.unique((points @ _DIRECTIONS.T).argmax(0))]
    try:
        hull = scipy.spatial.ConvexHull(points)
    except (scipy.spatial.QhullError, ValueError):
        return name
    corners = points[hull.vertices]
    place = {int(vertex): k for k, vertex in enumerate(hull.vertices)}
    faces = []
    for simplex, equation in zip(hull.simplices, hull.equations, strict=True):
        a, b, c = (points[k] for k in simplex)
        outward = np.cross(b - a, c - a) @ equation[:3] > 0
        face = [place[int(k)] for k in simplex]
        faces.append(face if outward else face[::-1])
    return corners, faces


def _points_of(name: str, folder: Path | None) -> Reals | None:
    """Return the vertices (v, 3) of a file of STL or OBJ, or None if it is missing or of another format."""
    path = _path_of(name, folder)
    if path is None or path.suffix.lower() not in (".stl", ".obj"):
        return None
    data = path.read_bytes()
    if path.suffix.lower() == ".obj":
        rows = re.findall(rb"^v\s+(\S+)\s+(\S+)\s+(\S+)", data, re.MULTILINE)
    elif data[:5] == b"solid" and b"vertex" in data[:2000]:
        rows = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", data)
    else:
        count = int.from_bytes(data[80:84], "little")
        if len(data) < _HEADER + count * _TRIANGLE.itemsize:
            return None
        return np.frombuffer(data, _TRIANGLE, count, _HEADER)["v"].reshape(-1, 3).astype(float)
    try:
        return np.array([[float(x) for x in row] for row in rows]).reshape(-1, 3)
    except ValueError:
        return None


def _path_of(name: str, folder: Path | None) -> Path | None:
    """Return the file of a name, also of a package above the description, or None if there is none."""
    kind, _, rest = name.rpartition("://")
    if folder is None:
        return None
    candidates: Iterable[Path]
    if kind == "package":
        package, _, inside = rest.partition("/")
        candidates = (place / inside for place in folders_of(package, folder))
    else:
        candidates = [folder / rest]
    return next((path for path in candidates if path.is_file()), None)


def _colour(material: ElementTree.Element | None, named: Mapping[str | None, ElementTree.Element]) -> str:
    """Return the colour of a material, which may be defined elsewhere by its name."""
    if material is None:
        return _GREY
    element = material.find("color")
    if element is None and material.get("name") in named:
        element = named[material.get("name")].find("color")
    try:
        rgba = numbers(element, "rgba", None, 4, "material") if element is not None else None
    except DescriptionError:
        return _GREY
    if rgba is None:
        return _GREY
    return "#" + "".join(f"{round(255 * min(1.0, max(0.0, float(x)))):02x}" for x in rgba[:3])
