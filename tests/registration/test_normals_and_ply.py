"""Normals of surfaces with known normals, and PLY files in all three forms."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from algorithms.registration import VoteStatus, estimate_normals, read_ply


def test_normals_of_a_torus_point_outwards() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.uniform(0, 2 * np.pi, (2, 2500))
    outwards = np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], 1)
    points = np.stack([np.cos(a), np.sin(a), 0 * a], 1) + 0.4 * outwards
    found = estimate_normals(points)
    dots = (found.normals * outwards).sum(1)
    assert (dots > 0).mean() > 0.999 and np.degrees(np.arccos(np.clip(dots, -1, 1))).mean() < 4
    assert found.confidence.min() >= 0 and np.median(found.confidence) > 0.6


def test_normals_of_a_circle_and_of_nothing() -> None:
    turn = np.random.default_rng(1).uniform(0, 2 * np.pi, 300)
    points = np.stack([np.cos(turn), np.sin(turn)], 1)
    found = estimate_normals(points)
    assert ((found.normals * points).sum(1) > 0.98).all()
    assert len(estimate_normals(np.zeros((0, 3))).normals) == 0
    lonely = estimate_normals([[0, 0, 0], [1, 1, np.nan]])
    assert lonely.status.tolist() == [VoteStatus.ISOLATED, VoteStatus.NOT_FINITE] and not lonely.normals.any()


HEAD = """ply
format {} 1.0
comment by hand
element vertex 3
property float x
property float y
property float z
property float nx
property float ny
property float nz
property uchar red
element face 1
property list uchar int vertex_indices
end_header
"""
ROWS = [(0, 0, 0, 0, 0, 1, 7), (1, 0, 0, 0, 0, 1, 8), (0, 1.5, 0, 0, 0, 1, 255)]
TEXT = "\n".join(" ".join(map(str, row)) for row in [*ROWS, (3, 0, 1, 2)]) + "\n"


def _binary(order: str) -> bytes:
    return b"".join(struct.pack(order + "6fB", *row) for row in ROWS) + struct.pack(order + "B3i", 3, 0, 1, 2)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_all_forms_give_the_same_numbers(form: str, tmp_path: Path) -> None:
    body = TEXT.encode() if form == "ascii" else _binary("<" if "little" in form else ">")
    path = tmp_path / "a.ply"
    path.write_bytes(HEAD.format(form).encode() + body)
    found = read_ply(path)
    assert found.points.tolist() == [list(row[:3]) for row in ROWS]
    assert found.normals is not None and found.normals.tolist() == [[0, 0, 1]] * 3
    assert [face.tolist() for face in found.faces] == [[0, 1, 2]]
    assert found.properties["red"].tolist() == [7, 8, 255]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"plx\n", "line 1: 'plx'; expected 'ply'"),
        (b"ply\nformat ascii 1.0\n", "line 3: the file ends in the header"),
        (b"ply\nformat odd 1.0\nend_header\n", "line 2: 'format odd 1.0'"),
        (b"ply\nend_header\n", "no format"),
        (b"ply\nformat ascii 1.0\nend_header\n", "no element vertex"),
        (HEAD.format("ascii").encode() + TEXT.replace("1.5", "1.x").encode(), "line 17: '0 1.x 0"),
        (HEAD.format("ascii").encode() + TEXT[:30].encode(), "2 rows of vertex; expected 3|line"),
        (HEAD.format("ascii").encode() + TEXT.replace("3 0 1 2", "3 0 1 9").encode(), "corner 9"),
        (HEAD.format("binary_little_endian").encode() + _binary("<")[:50], "bytes left; expected 75"),
        (HEAD.format("binary_little_endian").encode() + _binary("<")[:-2], "expected 3 numbers"),
    ],
)
def test_errors_state_the_place(data: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.ply"
    path.write_bytes(data)
    with pytest.raises(ValueError, match=message):
        read_ply(path)


def _principal(points: np.ndarray, count: int) -> np.ndarray:
    near = cKDTree(points).query(points, count + 1)[1]
    offsets = points[near] - points[near].mean(1, keepdims=True)
    return np.asarray(np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))[1][:, :, 0])


@pytest.mark.parametrize(("noise", "outliers"), [(0.003, 0), (0.02, 0), (0.005, 800)])
def test_normals_are_better_than_principal_axes(noise: float, outliers: int) -> None:
    """A tilted ellipsoid, whose normals are those of its gradient."""
    rng = np.random.default_rng(outliers + 7)
    sphere = rng.normal(size=(800, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    axes = np.array([1.0, 0.8, 0.5])
    truth = sphere / axes
    truth /= np.linalg.norm(truth, axis=1, keepdims=True)
    points = np.concatenate([sphere * axes + noise * rng.normal(size=(800, 3)), rng.uniform(-1, 1, (outliers, 3))])

    def error(normals: np.ndarray) -> float:
        cosine = np.abs((normals[:800] * truth).sum(1))
        return float(np.arccos(np.minimum(cosine, 1)).mean())

    assert error(estimate_normals(points).normals) <= min(error(_principal(points, k)) for k in (10, 20, 50))


def test_refined_normals_keep_to_one_of_two_sheets() -> None:
    rng = np.random.default_rng(5)
    points = np.column_stack([rng.uniform(-1, 1, (2000, 2)), 0.3 * (rng.random(2000) < 0.5)])
    inner = (np.abs(points[:, :2]) < 0.8).all(1)
    assert np.abs(estimate_normals(points, sigma=0.08).normals[inner, 2]).min() > 0.999
