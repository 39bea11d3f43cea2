"""Scans: points, valid beams, and errors that name what is wrong."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from algorithms.mapping import Scan
from generated import mapping as kernels
from tests.support.all_cases import all_cases


def test_points_are_those_of_valid_beams() -> None:
    scan = Scan([1.0, np.nan, 2.0, np.inf, 0.0, -1.0, 50.0, 3.0], 0.0, np.pi / 4, 50.0)
    assert scan.beams.tolist() == [0, 2, 7] and len(scan) == 8
    assert np.abs(scan.points() - [[1, 0], [0, 2], [3 / np.sqrt(2), -3 / np.sqrt(2)]]).max() < 1e-15
    assert np.array_equal(kernels.beam_point(scan.ranges[scan.beams], scan.angles[scan.beams]), scan.points())


def test_a_scanner_upside_down_has_a_negative_step() -> None:
    up, down = Scan([1.0, 2.0, 3.0], -0.5, 0.5, 9.0), Scan([3.0, 2.0, 1.0], 0.5, -0.5, 9.0)
    assert np.abs(up.points() - down.points()[::-1]).max() < 1e-15


def test_scans_are_constant_and_do_not_share_memory() -> None:
    ranges = np.ones(4, np.float32)
    scan = Scan(ranges, 0, 0.1, np.inf)
    ranges[0] = 9
    assert scan.ranges.dtype == np.float64 and scan.ranges[0] == 1
    for array in (scan.ranges, scan.points(), scan.valid, scan.angles):
        assert not array.flags.writeable
    with pytest.raises(dataclasses.FrozenInstanceError):
        scan.max_range = 1.0  # type: ignore[misc]


def test_empty_scans() -> None:
    assert Scan([], 0, 0.1, 5).points().shape == (0, 2)
    assert Scan([5.0, 6.0], 0, 0.1, 5).points().shape == (0, 2)


@all_cases(
    "arguments, message",
    [
        (([[1.0]], 0, 0.1, 5), "ranges: shape"),
        (([1.0, 2.0], 0, 0.0, 5), "angle_step"),
        (([1.0] * 8, 0, 1.0, 5), "angle_step"),
        (([1.0], np.nan, 0.1, 5), "angle_min"),
        (([1.0], 0, 0.1, 0), "max_range"),
        (([1.0], 0, 0.1, np.nan), "max_range"),
    ],
)
def test_bad_arguments(arguments: tuple[object, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Scan(*arguments)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="ranges"):
        Scan(["a"], 0, 0.1, 5)


def test_the_limit_that_a_scanner_reports_is_no_wall():
    rng = np.random.default_rng(5)
    angles = np.linspace(-np.pi / 2, np.pi / 2, 181)
    wall = 3 / np.maximum(np.cos(angles), 1e-9) + 0.01 * rng.normal(size=181)
    limited = Scan(np.minimum(wall, 8.0), angles[0], angles[1] - angles[0], 30.0)
    assert (limited.valid == (wall < 8)).all()
    # Walls in steps of readings have equal neighbours as well, also the farthest one; so has a round room.
    steps = np.round(np.minimum(wall, 4 / np.maximum(np.abs(np.sin(angles)), 1e-9)), 1)
    assert Scan(steps, angles[0], angles[1] - angles[0], 30.0).valid.all()
    assert Scan(np.full(181, 2.0), angles[0], angles[1] - angles[0], 30.0).valid.all()
