"""Deformations with known correspondences: faces, smooth maps, and bad input."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree
from selection import some_slow

from algorithms.registration import DeformStatus, register_deformable

FACES = np.loadtxt(Path(__file__).parents[1] / "data" / "faces" / "faces-600.txt.gz")
FISH = np.loadtxt(Path(__file__).parents[1] / "data" / "registration" / "fish.txt")


@pytest.mark.slow
def test_points_of_a_face_find_their_partners_and_rows_that_are_not_finite_have_none() -> None:
    source, target = FACES[:, :3].copy(), FACES[:, 3:].copy()
    source[3], target[5] = np.nan, np.inf
    source.setflags(write=False)
    found = register_deformable(source, target)
    assert found.status is DeformStatus.OK
    assert found.correspondences[3] == -1 and np.isinf(found.uncertainties[3])
    assert 5 not in found.correspondences and np.isfinite(np.delete(found.points, 3, 0)).all()
    assert (found.correspondences == np.arange(600)).sum() >= 0.995 * 600
    error, before = (np.linalg.norm(np.delete(x - FACES[:, 3:], 3, 0), axis=1) for x in (found.points, FACES[:, :3]))
    assert error.mean() < 0.3 < before.mean() / 10


@pytest.mark.parametrize("radius", some_slow([None, 0.3, 0.6, 1.2], 0.3, 1.2))
def test_wrong_partners_of_a_fish_are_inconsistent(radius: float | None) -> None:
    found = register_deformable(FISH[:, :2], FISH[:, 2:], radius=radius)
    assert (found.correspondences == np.arange(91)).mean() < 0.9
    assert found.status is DeformStatus.INCONSISTENT and found.closed < 0.9


def test_a_part_of_a_face_is_consistent_with_the_whole() -> None:
    found = register_deformable(FACES[::2, :3], FACES[:, 3:])
    assert found.status is DeformStatus.OK and found.closed > 0.99
    assert (found.correspondences == np.arange(0, 600, 2)).mean() > 0.97


def test_uncertainties_grow_with_noise() -> None:
    rng = np.random.default_rng(0)
    source = rng.uniform(size=(120, 2))
    bent = source + 0.05 * np.sin(3 * source[:, ::-1])
    medians = []
    for noise in (0.0, 0.004):
        found = register_deformable(source, bent + noise * rng.normal(size=bent.shape))
        assert found.status is DeformStatus.OK
        medians.append(np.median(found.uncertainties))
        assert np.median(np.linalg.norm(found.points - bent, axis=1)) < 0.003 + 2 * noise
    assert medians[1] > 1.2 * medians[0]


def test_bad_input_has_a_status_or_an_error() -> None:
    few = register_deformable(np.zeros((9, 3)), FACES[:, :3])
    assert few.status is DeformStatus.TOO_FEW_POINTS and (few.correspondences == -1).all()
    assert register_deformable(np.zeros((0, 3)), FACES[:, :3]).status is DeformStatus.TOO_FEW_POINTS
    apart = register_deformable(FACES[::4, :3], FACES[::4, 3:] + 1e4)
    assert apart.status is not DeformStatus.OK
    with pytest.raises(ValueError, match="target: 2 coordinates"):
        register_deformable(FACES[:, :3], FACES[:, :2])
    with pytest.raises(ValueError, match="stiffness"):
        register_deformable(FACES[:, :3], FACES[:, 3:], stiffness=0.0)


@pytest.mark.parametrize("dimension", [2, 3])
def test_further_points_follow_the_displacements(dimension: int) -> None:
    """Points that are not in the source follow a linear map and a bent one of given form."""
    rng = np.random.default_rng(4)
    cloud = rng.uniform(-1, 1, (900, dimension))
    source, further = cloud[:600], cloud[600:]
    linear = np.eye(dimension) + 0.02 * rng.normal(size=(dimension, dimension))
    found = register_deformable(source, source @ linear)
    assert found.status == DeformStatus.OK
    spacing = np.median(cKDTree(source).query(source, k=2)[0][:, 1])
    own = np.abs(found.points - source @ linear).max()
    assert np.abs(found.warp(further) - further @ linear).max() < own < 0.1 * spacing

    def bent(x: Any) -> Any:
        return x + 0.3 * spacing * np.sin(2 * x[:, ::-1])

    found = register_deformable(source, bent(source))
    inside = further[np.abs(further).max(1) < 0.9]
    assert found.status == DeformStatus.OK
    assert np.linalg.norm(found.warp(inside) - bent(inside), axis=1).mean() < 0.05 * spacing
    np.testing.assert_allclose(found.warp(source), found.points, atol=1e-3 * spacing)
    assert found.warp(np.zeros((0, dimension))).shape == (0, dimension)
    assert np.isnan(found.warp(np.full(dimension, np.nan))).all()
    with pytest.raises(ValueError, match="points: shape"):
        found.warp(np.ones(4))
    few = register_deformable(source[:2], source)
    np.testing.assert_array_equal(few.warp(inside), inside)


def test_further_points_beside_planes() -> None:
    """The nearest points of a plane, or of a face of a box, leave the displacement across it open."""
    rng = np.random.default_rng(3)
    plane = np.column_stack([rng.uniform(0, 8, (150, 2)), np.zeros(150)])
    for source in (plane, np.concatenate([plane, plane[:, [2, 0, 1]] - [0.5, 0, 0]])):
        found = register_deformable(source, source + 0.1 * np.sin(source[:, [0, 0, 0]] / 3))
        assert found.status == DeformStatus.OK
        assert np.abs(found.warp(source) - found.points).max() < 1e-7
        further = rng.uniform(2, 6, (40, 3)) * [1, 1, 0]
        for across in (0.0, 0.01):
            further[:, 2] = across
            moved = found.warp(further) - further
            assert np.abs(moved - 0.1 * np.sin(further[:, :1] / 3)).max() < 0.02
