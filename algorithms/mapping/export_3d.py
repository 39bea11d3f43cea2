"""Export of maps in space to PLY, and of their top view to SVG."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from ..arguments import Reals
from .map_3d import Map3D, Solid, SolidKind

_RINGS, _SECTORS = 9, 18
"""The circles of latitude, with both poles, and the meridians of drawn spheres."""
_COLOURS = {SolidKind.PLANE: (160, 160, 170), SolidKind.SPHERE: (200, 90, 60)}
_POINT, _LINE = (40, 110, 180), (30, 140, 60)
"""The colours of points and of lines, in bytes of red, green and blue."""


def write_ply(found: Map3D, path: str | Path) -> Path:
    """Write a map as a PLY file in text form: faces of planes and spheres, edges of segments, and points.

    Coordinates have all digits of double precision.

    Parameters
    ----------
    found : Map3D
    path : str or Path

    Returns
    -------
    Path

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    vertices: list[tuple[Reals, tuple[int, int, int]]] = []
    faces: list[list[int]] = []
    count = 0
    for solid in found.solids:
        places, own = _mesh(solid)
        vertices.append((places, _COLOURS[solid.kind]))
        faces += [[count + k for k in face] for face in own]
        count += len(places)
    edges = []
    for ends in found.lines:
        vertices.append((ends, _LINE))
        edges.append((count, count + 1))
        count += 2
    for cloud in found.clouds:
        vertices.append((cloud, _POINT))
        count += len(cloud)
    head = ["ply", "format ascii 1.0", f"element vertex {count}"]
    head += [f"property double {name}" for name in "xyz"]
    head += [f"property uchar {name}" for name in ("red", "green", "blue")]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    head += [f"element edge {len(edges)}", "property int vertex1", "property int vertex2", "end_header"]
    rows = [f"{x!r} {y!r} {z!r} {' '.join(map(str, colour))}" for part, colour in vertices for x, y, z in part.tolist()]
    rows += [" ".join(map(str, [len(face), *face])) for face in faces]
    rows += [f"{a} {b}" for a, b in edges]
    target = Path(path)
    target.write_text("\n".join(head + rows) + "\n", encoding="ascii")
    return target


def write_svg(found: Map3D, path: str | Path, width: int = 800) -> Path:
    """Write the top view of a map as an SVG file, with y upwards.

    Parameters
    ----------
    found : Map3D
    path : str or Path
    width : int, optional
        In pixels.

    Returns
    -------
    Path

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If the map is empty.
    """
    outlines = [_mesh(solid)[0][:, :2] for solid in found.solids]
    places = [*outlines, *(ends[:, :2] for ends in found.lines), *(cloud[:, :2] for cloud in found.clouds)]
    every = np.concatenate(places) if places else np.zeros((0, 2))
    if not len(every):
        raise ValueError("map: nothing to draw; expected planes, spheres, segments or points")
    low, high = every.min(0) - 0.2, every.max(0) + 0.2
    size = high - low
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{int(width * size[1] / size[0])}" '
        f'viewBox="{low[0]:.3f} {-high[1]:.3f} {size[0]:.3f} {size[1]:.3f}">',
    ]
    for cloud in found.clouds:
        parts += [f'<circle cx="{x:.3f}" cy="{-y:.3f}" r="0.01" fill="rgb{_POINT}"/>' for x, y in cloud[:, :2]]
    for solid, outline in zip(found.solids, outlines, strict=True):
        title = f"<title>{escape(solid.name)}</title>" if solid.name else ""
        if solid.kind == SolidKind.SPHERE:
            x, y = solid.centre[:2]
            shape = f'<circle cx="{x:.3f}" cy="{-y:.3f}" r="{solid.radius:.3f}" fill="none"'
            end = "circle"
        else:
            corners = " ".join(f"{x:.3f},{-y:.3f}" for x, y in outline)
            shape, end = f'<polygon points="{corners}" fill="none"', "polygon"
        parts.append(f'{shape} stroke="rgb{_COLOURS[solid.kind]}" stroke-width="0.03">{title}</{end}>')
    for (x, y, _), (u, v, _) in found.lines:
        parts.append(
            f'<line x1="{x:.3f}" y1="{-y:.3f}" x2="{u:.3f}" y2="{-v:.3f}" stroke="rgb{_LINE}" stroke-width="0.03"/>'
        )
    target = Path(path)
    target.write_text("\n".join([*parts, "</svg>"]) + "\n", encoding="utf-8")
    return target


def _mesh(solid: Solid) -> tuple[Reals, list[list[int]]]:
    """Return vertices (k, 3) and faces of a solid."""
    if solid.kind == SolidKind.PLANE:
        return solid.corners, [list(range(len(solid.corners)))]
    polar, azimuth = np.meshgrid(
        np.linspace(0, np.pi, _RINGS), np.linspace(0, 2 * np.pi, _SECTORS, endpoint=False), indexing="ij"
    )
    unit = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
    places = solid.centre + solid.radius * unit.reshape(-1, 3)
    faces = []
    for ring in range(_RINGS - 1):
        for sector in range(_SECTORS):
            a, b = ring * _SECTORS + sector, ring * _SECTORS + (sector + 1) % _SECTORS
            faces.append([a, a + _SECTORS, b + _SECTORS, b])
    return places, faces
