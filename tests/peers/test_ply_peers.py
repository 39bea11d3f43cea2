"""PLY files written by trimesh, and what it reads from them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from algorithms.registration import read_ply

pytestmark = pytest.mark.peers


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("normals", [True, False])
def test_files_of_trimesh(encoding: str, normals: bool, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    rng = np.random.default_rng(0)
    mesh = trimesh.creation.icosphere(subdivisions=3)
    mesh.vertices *= rng.uniform(0.5, 2, (len(mesh.vertices), 1))
    mesh.visual.vertex_colors = rng.integers(0, 256, (len(mesh.vertices), 4), np.uint8)
    path = tmp_path / "a.ply"
    mesh.export(path, encoding="ascii" if encoding == "ascii" else "binary", vertex_normal=normals)
    found, expected = read_ply(path), trimesh.load(path, process=False)
    assert encoding.encode() in path.read_bytes()[:60]
    assert np.array_equal(found.points, expected.vertices) and np.array_equal(np.array(found.faces), expected.faces)
    assert np.allclose(found.points, mesh.vertices, rtol=1e-6, atol=1e-6)
    colours = np.stack([found.properties[name] for name in ("red", "green", "blue", "alpha")], 1)
    assert np.array_equal(colours, mesh.visual.vertex_colors)
    assert (found.normals is not None) == normals
    if found.normals is not None:
        assert np.allclose(found.normals, mesh.vertex_normals, rtol=0, atol=1e-6)
