"""Closed quadrilateral meshes of masks, smoothed within half a voxel, and files of meshes."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals
from .images import checked_image, checked_spacing

_INWARDS, _OUTWARDS = 0.6, -0.64
"""Parts of the way to the mean of neighbours, alternately (Taubin). The sum of their reciprocals, 0.10, is the
frequency that passes."""


class Mesh(NamedTuple):
    """Vertices (n, 3), and faces (m, 4) or (m, 3) by indices, counter-clockwise seen from outside."""

    vertices: Reals
    faces: NDArray[np.intp]


def boundary_mesh(mask: ArrayLike, spacing: ArrayLike = (1, 1, 1), steps: int = 10) -> Mesh:
    """Construct the boundary of a mask as a closed mesh of quadrilaterals.

    Faces separate voxels inside from voxels outside. Vertices move to the mean of their neighbours and back a
    number of times (`steps`), but remain within half a voxel of the corners of voxels along each axis.

    Raises
    ------
    ValueError
        If the mask is empty, has not three axes, or the spacing is not positive.
    """
    inside = checked_image(mask, "mask", (3,)) > 0
    step = checked_spacing(spacing, 3)
    if not inside.any():
        raise ValueError(f"mask: no voxel of {inside.shape} is inside; expected a region")
    padded = np.pad(inside, 1)
    corners = []
    for axis in range(3):
        low = np.moveaxis(padded, axis, 0)
        for out, first in ((True, low[:-1] & ~low[1:]), (False, ~low[:-1] & low[1:])):
            at = np.argwhere(first)
            place = np.insert(at[:, 1:], axis, at[:, 0], 1)
            one, two = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
            base = place + np.eye(3, dtype=int)[axis]
            quad = np.stack([base, base + one, base + one + two, base + two], 1)
            corners.append(quad if out else quad[:, ::-1])
    quads = np.concatenate(corners)
    shape = np.array(padded.shape) + 1
    keys = np.ravel_multi_index(tuple(quads.reshape(-1, 3).T), tuple(shape))
    unique, faces = np.unique(keys, return_inverse=True)
    start = np.stack(np.unravel_index(unique, tuple(shape)), 1) - 1.5
    faces = faces.reshape(-1, 4)
    return Mesh(_relaxed(start, faces, steps) * step, faces)


def _relaxed(start: Reals, faces: NDArray[np.intp], steps: int) -> Reals:
    a, b = faces.ravel(), np.roll(faces, -1, 1).ravel()
    count = np.bincount(a, minlength=len(start))
    places = start.astype(float)
    for k in range(2 * steps):
        # Steps inwards and outwards alternate (Taubin), so that the volume is kept. Every edge belongs to
        # two faces, in opposite directions, so that each neighbour is added once.
        mean = np.stack([np.bincount(a, places[b, axis], len(start)) for axis in range(3)], 1) / count[:, None]
        rate = _OUTWARDS if k % 2 else _INWARDS
        places = np.clip(places + rate * (mean - places), start - 0.5, start + 0.5)
    return places


def write_mesh(path: str | Path, mesh: Mesh) -> Path:
    """Write a mesh as a .ply or .obj file. An existing file is replaced when the new one is complete.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If the suffix is another one.
    """
    target = Path(path)
    if target.suffix == ".ply":
        head = ["ply", "format ascii 1.0", f"element vertex {len(mesh.vertices)}"]
        head += [f"property float {name}" for name in "xyz"]
        head += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices", "end_header"]
        rows = [f"{x:.7g} {y:.7g} {z:.7g}" for x, y, z in mesh.vertices.tolist()]
        rows += [" ".join(map(str, [len(face), *face])) for face in mesh.faces.tolist()]
    elif target.suffix == ".obj":
        head = [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in mesh.vertices.tolist()]
        rows = ["f " + " ".join(str(k + 1) for k in face) for face in mesh.faces.tolist()]
    else:
        raise ValueError(f"{target}: unknown format; expected .ply or .obj")
    partial = target.with_name(target.name + ".part")
    try:
        partial.write_text("\n".join(head + rows) + "\n", encoding="ascii")
        os.replace(partial, target)
    finally:
        partial.unlink(missing_ok=True)
    return target
