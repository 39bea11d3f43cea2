"""Meshes of masks against volumes, Euler numbers and the reader of trimesh's format by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from skimage import measure

from algorithms.shapes.__main__ import main
from algorithms.shapes.boundary_meshes import boundary_mesh, write_mesh

Array = np.ndarray[Any, Any]


def torus() -> Array:
    x, y, z = np.indices((50, 50, 22)) - np.array([25, 25, 11]).reshape(3, 1, 1, 1)
    return np.asarray((np.hypot(x, y) - 15) ** 2 + z**2 < 36)


def enclosed(vertices: Array, faces: Array) -> float:
    p, q, r, s = (vertices[faces[:, k]] for k in range(4))
    return float((np.cross(p, q) * r).sum() + (np.cross(p, r) * s).sum()) / 6


def test_volume_and_euler_number() -> None:
    mask = torus()
    mesh = boundary_mesh(mask, (1, 1, 2), steps=0)
    assert enclosed(*mesh) == pytest.approx(2 * mask.sum())
    edges = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, 1)], -1).reshape(-1, 2), 1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 2).all()
    # The Euler number of the surface is twice that of the solid.
    assert len(mesh.vertices) - len(unique) + len(mesh.faces) == 2 * measure.euler_number(mask, 1) == 0


def test_smooth_surface_is_near_the_torus() -> None:
    mesh = boundary_mesh(torus())
    x, y, z = (mesh.vertices - [25, 25, 11]).T
    distance = np.hypot(np.hypot(x, y) - 15, z) - 6
    assert abs(distance).mean() < 0.3 and abs(distance).max() < 1
    assert enclosed(*mesh) == pytest.approx(2 * np.pi**2 * 15 * 36, rel=0.05)


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_files(tmp_path: Path, suffix: str) -> None:
    mesh = boundary_mesh(np.ones((1, 1, 1), bool), (2, 2, 2), steps=0)
    lines = write_mesh(tmp_path / f"a{suffix}", mesh).read_text().splitlines()
    rows = lines[lines.index("end_header") + 1 :] if suffix == ".ply" else [line[2:] for line in lines]
    assert np.allclose(np.array([row.split() for row in rows[:8]], float), mesh.vertices)
    shift = (1, 0) if suffix == ".ply" else (0, 1)
    faces = np.array([row.split()[shift[0] :] for row in rows[8:]], int) - shift[1]
    assert np.array_equal(faces, mesh.faces) and len(list(tmp_path.iterdir())) == 1


def test_errors() -> None:
    with pytest.raises(ValueError, match="no voxel"):
        boundary_mesh(np.zeros((4, 4, 4), bool))
    with pytest.raises(ValueError, match="expected 3 axes"):
        boundary_mesh(np.ones((4, 4), bool))


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    head = "NDims = 3\nDimSize = 50 50 22\nElementType = MET_SHORT\nElementSpacing = 1 1 1\nElementDataFile = LOCAL\n"
    volume = torus() * 300 + np.random.default_rng(0).normal(size=(50, 50, 22)) * 10
    (tmp_path / "a.mha").write_bytes(head.encode() + volume.astype("<i2").tobytes(order="F"))
    output = tmp_path / "a.ply"
    assert main([str(tmp_path / "a.mha"), "--seed", "40", "25", "11", "-o", str(output)]) == 0
    assert output.read_text().startswith("ply\n")
    assert main([str(tmp_path / "a.mha"), "--seed", "99", "0", "0", "-o", str(tmp_path / "b.ply")]) == 1
    assert "outside of the volume" in capsys.readouterr().err and not (tmp_path / "b.ply").exists()
