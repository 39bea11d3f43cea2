"""Models of scenes as glTF 2.0, in one JSON text with its numbers embedded.

The format is that of the Khronos Group's specification 2.0. The y axis of glTF points up, so the node of the scene
turns the z axis upwards.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from itertools import repeat
from typing import Any

import numpy as np

from ..errors import needs
from .scene import (
    AXES,
    Arrow,
    Circle,
    Frame,
    Line,
    Plane,
    PointPair,
    Points,
    Scene,
    Shape,
    Sphere,
    clipped,
    net_of,
    polygon,
    round_of,
)

_POINTS, _LINES, _TRIANGLES = 0, 3, 4
"""Modes of primitives; lines are strips."""
_FLOAT, _UNSIGNED, _PLACES, _INDICES = 5126, 5125, 34962, 34963

Part = tuple[int, Any, Any]
"""The mode, the places (n, 3), and the corners of triangles (m, 3) or None."""


def gltf_of(scene: Scene) -> str:
    """Return the text of a model of a scene; the plane is the plane z = 0 of the model.

    Notes
    -----
    Points and lines are primitives of these kinds, one pixel wide in most viewers, except single points, which are
    small spheres. Spheres and planes are translucent.
    """
    radius = 0.012 * float(np.max(scene.limits[:, 1] - scene.limits[:, 0]))
    found: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "gacompiler"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"rotation": [-(0.5**0.5), 0.0, 0.0, 0.5**0.5], "children": []}],
        "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "buffers": [],
    }  # fmt: skip
    data = bytearray()
    for item in scene.items:
        primitives = []
        for shape in item.shapes:
            colours = AXES if isinstance(shape, Frame) else repeat(item.colour)
            for (mode, places, corners), colour in zip(_parts(shape, scene, radius), colours, strict=False):
                primitive = {"attributes": {"POSITION": _stored(found, data, _in_space(places), _PLACES)}, "mode": mode}
                if corners is not None:
                    primitive["indices"] = _stored(found, data, corners, _INDICES)
                is_thin = isinstance(shape, (Sphere, Plane))
                primitives.append({**primitive, "material": _material(found, colour, 0.3 if is_thin else 1.0)})
        if primitives:
            found["nodes"][0]["children"].append(len(found["nodes"]))
            name = {"name": item.label} if item.label else {}
            found["nodes"].append({"mesh": len(found["meshes"]), **name})
            found["meshes"].append({"primitives": primitives})
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    found["buffers"] = [{"byteLength": len(data), "uri": uri}]
    return json.dumps(found) + "\n"


def _parts(shape: Shape, scene: Scene, radius: float) -> Iterator[Part]:
    match shape:
        case Points(places) if len(places) < 50:
            yield from (_ball(_in_space(place[None])[0], radius) for place in places)
        case Points(places):
            yield _POINTS, places, None
        case Arrow(direction):
            yield _LINES, np.array([np.zeros_like(direction), direction]), None
        case Line():
            ends = clipped(shape, scene.limits)
            if ends is not None:
                yield _LINES, ends, None
        case Plane():
            corners = polygon(shape, scene.limits)
            if corners is not None:
                n = len(corners)
                yield _TRIANGLES, corners, np.array([[0, k, k + 1] for k in range(1, n - 1)])
        case Frame(places):
            yield from ((_LINES, np.array([places[0], end]), None) for end in places[1:])
        case PointPair(centre, direction, half, _):
            ends = centre + np.outer([-half, half], direction)
            yield _LINES, ends, None
            yield from (_ball(_in_space(end[None])[0], radius) for end in ends)
        case Circle(centre, None, size, _):
            angle = np.linspace(0, 2 * np.pi, 97)
            yield _LINES, centre + size * np.stack([np.cos(angle), np.sin(angle)], -1), None
        case Circle():
            yield _LINES, round_of(shape), None
        case Sphere(centre, size, _):
            yield _ball(centre, size, 33)


def _ball(centre: Any, radius: float, n: int = 9) -> Part:
    x, y, z = net_of(Sphere(centre, radius, False), n)
    rows, columns = x.shape
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    corners = np.stack([first, first + columns, first + 1, first + 1, first + columns, first + columns + 1], -1)
    return _TRIANGLES, np.stack([x, y, z], -1).reshape(-1, 3), corners.reshape(-1, 3)


def _in_space(places: Any) -> Any:
    return np.pad(places, ((0, 0), (0, 3 - places.shape[-1])))


def _stored(found: dict[str, Any], data: bytearray, numbers: Any, target: int) -> int:
    """Append an array to the data, and return the index of its description."""
    is_places = target == _PLACES
    array = np.ascontiguousarray(numbers, "<f4") if is_places else np.ascontiguousarray(numbers, "<u4").ravel()
    found["bufferViews"].append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes, "target": target})
    data += array.tobytes()
    entry = {
        "bufferView": len(found["bufferViews"]) - 1, "count": len(array),
        "componentType": _FLOAT if is_places else _UNSIGNED, "type": "VEC3" if is_places else "SCALAR",
    }  # fmt: skip
    if is_places:
        entry |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
    found["accessors"].append(entry)
    return len(found["accessors"]) - 1


def _material(found: dict[str, Any], colour: str, opacity: float) -> int:
    with needs("pictures", "save"):
        from matplotlib.colors import to_rgb

    linear = [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in to_rgb(colour)]  # sRGB, IEC 61966
    material = {
        "pbrMetallicRoughness": {"baseColorFactor": [*linear, opacity], "metallicFactor": 0.0},
        "doubleSided": True,
    }
    if opacity < 1:
        material["alphaMode"] = "BLEND"
    if material not in found["materials"]:
        found["materials"].append(material)
    return int(found["materials"].index(material))
