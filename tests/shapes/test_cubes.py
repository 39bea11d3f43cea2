"""The generated table of marching cubes, and surfaces beside closed forms and scikit-image."""

import numpy as np
import pytest
from skimage.measure import marching_cubes as peer

from algorithms.shapes.cubes import EDGES, classes, corner_permutations, rotors, table
from algorithms.shapes.marching_cubes import marching_cubes
from tests.support.sphere_scenes import ball_mask, stored_mask


def directed_edges(triangles: np.ndarray) -> np.ndarray:
    return np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def is_closed(triangles: np.ndarray) -> bool:
    """Whether each directed edge occurs as often as its reverse."""
    edges = directed_edges(triangles)
    forward, counts = np.unique(edges, axis=0, return_counts=True)
    backward, reverse = np.unique(edges[:, ::-1], axis=0, return_counts=True)
    return np.array_equal(forward, backward) and np.array_equal(counts, reverse)


def test_the_group_has_24_rotors_and_the_known_numbers_of_classes() -> None:
    assert len(rotors()) == 24
    assert len(set(map(tuple, corner_permutations().tolist()))) == 24
    assert all(sorted(row) == list(range(8)) for row in corner_permutations().tolist())
    # Burnside's lemma gives 23 colourings of corners; 15 is the number of Lorensen and Cline.
    assert len(set(classes(complement=False).tolist())) == 23
    assert len(set(classes(complement=True).tolist())) == 15


def test_triangles_use_the_crossed_edges_and_no_others() -> None:
    rows = table()
    for code in range(256):
        part = rows.triangles[rows.starts[code] : rows.starts[code] + rows.counts[code]]
        crossed = {k for k, (i, j) in enumerate(EDGES) if (code >> i & 1) != (code >> j & 1)}
        assert set(part.reshape(-1).tolist()) == crossed


def test_surface_of_a_ball() -> None:
    grid = np.indices((41, 41, 41)) - 20.2
    mesh = marching_cubes(15.3 - np.sqrt((grid**2).sum(0)), 0.0, (2, 2, 2))
    assert abs(mesh.volume() / (8 * 4 / 3 * np.pi * 15.3**3) - 1) < 0.005
    assert abs(mesh.area() / (4 * 4 * np.pi * 15.3**2) - 1) < 0.005
    assert len(mesh.points) - len(mesh.triangles) // 2 == 2 and is_closed(mesh.triangles)
    assert np.abs(np.linalg.norm(mesh.points / 2 - 20.2, axis=1) - 15.3).max() < 0.02


@pytest.mark.parametrize("seed", range(3))
def test_noise_gives_closed_surfaces_with_the_vertices_of_scikit_image(seed: int) -> None:
    volume = np.pad(np.random.default_rng(seed).normal(size=(14, 15, 16)), 1, constant_values=-9.0)
    mesh = marching_cubes(volume, 0.1, (1, 2, 0.5))
    points, *_ = peer(volume.astype(np.float32), 0.1, spacing=(1, 2, 0.5), method="lorensen")
    assert is_closed(mesh.triangles) and len(mesh.points) == len(points)
    ours, theirs = (x[np.lexsort(np.round(x, 3).T)] for x in (mesh.points, points))
    np.testing.assert_allclose(np.sort(ours, axis=0), np.sort(theirs, axis=0), atol=2e-5)
    assert mesh.volume() > 0


def test_volumes_of_integers_and_of_masks() -> None:
    mask = stored_mask("liver")
    mesh = marching_cubes(mask)
    points, *_ = peer(mask.astype(np.float32), 0.5, method="lorensen")
    assert set(map(tuple, mesh.points.tolist())) == set(map(tuple, points.tolist()))
    for dtype in (np.int8, np.uint16, np.int64, np.float32):
        np.testing.assert_array_equal(marching_cubes(mask.astype(dtype)).triangles, mesh.triangles)
    empty = marching_cubes(np.zeros((4, 4, 4)))
    assert empty.points.shape == (0, 3) and empty.volume() == 0


def test_bad_volumes() -> None:
    with pytest.raises(ValueError, match="three axes of at least 2"):
        marching_cubes(np.zeros((1, 3, 3)))
    with pytest.raises(ValueError, match="volume: nan"):
        marching_cubes(np.full((3, 3, 3), np.nan))
    with pytest.raises(TypeError, match="complex"):
        marching_cubes(np.zeros((3, 3, 3), complex))
    with pytest.raises(ValueError, match="spacing"):
        marching_cubes(ball_mask(4), spacing=(1, 0, 1))
    with pytest.raises(ValueError, match="voxels of shape"):
        marching_cubes(np.broadcast_to(np.uint8(0), (4096, 4096, 4096)))
