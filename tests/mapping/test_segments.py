"""Segments of scans: exact walls, covariances, corners, and lines compared with a singular value decomposition."""

from __future__ import annotations

import numpy as np
import pytest
from laser_scenes import box, scan_at

from algorithms.mapping import Scan, segments
from generated import mapping as kernels
from tests.support.all_cases import all_cases


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def test_walls_of_a_room(rng: np.random.Generator) -> None:
    """A scanner in a rectangle sees three walls; readings at corners may count for both of their walls."""
    pose = np.array([1.0, 0.5, 0.3])
    found = segments(scan_at(rng, box(0, 0, 8, 6), pose, noise=0.0))
    long = found.lengths > 1
    angles = np.arctan2(*found.normals[long].T[::-1]) + pose[2]
    expected = {0.0: 3.0, np.pi / 2: 2.5, -np.pi / 2: 3.5}
    assert long.sum() == 3
    for angle, offset in zip(angles, found.offsets[long], strict=True):
        nearest = min(expected, key=lambda a: abs(a - angle))
        assert abs(angle - nearest) < 2e-3 and abs(offset - expected[nearest]) < 5e-3
    for normal, offset, ends in zip(found.normals, found.offsets, found.ends, strict=True):
        assert np.abs(ends @ normal - offset).max() < 1e-12


def test_lines_are_those_of_least_squares(rng: np.random.Generator) -> None:
    """The line of a run is that of the singular value decomposition, for every direction of the line."""
    for angle in np.linspace(-np.pi, np.pi, 25):
        across = np.array([np.cos(angle), np.sin(angle)])
        points = 3 * across + rng.normal(size=(20, 1)) * [-across[1], across[0]] + 0.02 * rng.normal(size=(20, 2))
        sums = kernels.prefix_sums(points)
        normal, offset, mean, squares = kernels.line_of_run(np.zeros(5), sums[-1], 20.0)
        _, s, v = np.linalg.svd(points - points.mean(0))
        assert abs(abs(v[1] @ normal) - 1) < 1e-12 and np.abs(mean - points.mean(0)).max() < 1e-12
        assert abs(offset - normal @ points.mean(0)) < 1e-12 and offset > 0
        assert np.abs(np.sqrt(20 * squares) - s[::-1]).max() < 1e-6


def test_covariances_are_those_of_errors(rng: np.random.Generator) -> None:
    """Errors of walls in noise across them, divided by the covariance, have the mean square 2."""
    angles, normalized = np.linspace(-0.3, 0.6, 40), []
    for _ in range(400):
        noise = 0.01 * rng.normal(size=40)
        found = segments(Scan((3 + noise) / np.cos(angles), angles[0], angles[1] - angles[0], 50))
        assert len(found) == 1
        error = np.array([np.arctan2(*found.normals[0][::-1]), found.offsets[0] - 3])
        normalized.append(error @ np.linalg.solve(found.covariances[0], error))
    assert 1.6 < np.mean(normalized) < 2.6


def test_rotating_a_scan_rotates_its_segments(rng: np.random.Generator) -> None:
    scan = scan_at(rng, box(0, 0, 8, 6), np.array([1.0, 0.5, 0.3]))
    one = segments(scan)
    other = segments(Scan(scan.ranges, scan.angle_min + 1, scan.angle_step, scan.max_range))
    c, s = np.cos(1), np.sin(1)
    assert len(one) == len(other) and np.abs(one.normals @ np.array([[c, s], [-s, c]]) - other.normals).max() < 1e-9


@all_cases("ranges", [[], [1.0], [1.0, 2.0], [99.0] * 30, [np.nan] * 30])
def test_scans_without_lines(ranges: list[float]) -> None:
    found = segments(Scan(ranges, 0, 0.01, 50))
    assert len(found) == 0 and found.normals.shape == (0, 2) and found.ends.shape == (0, 2, 2)


def test_bad_parameters() -> None:
    scan = Scan([1.0, 2.0], 0, 0.1, 5)
    for bad in ({"tolerance": 0.0}, {"min_length": -1.0}, {"min_points": 2}):
        with pytest.raises(ValueError, match=next(iter(bad))):
            segments(scan, **bad)
