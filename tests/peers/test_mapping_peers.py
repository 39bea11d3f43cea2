"""Motions between real scans beside ICP of small_gicp, from the identity and from the truth."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.mapping import MappingStatus
from benchmarks.mapping import NEAR, TURNED, by_icp, by_lines, errors, pairs

pytestmark = pytest.mark.peers
Array = np.ndarray[Any, Any]


def _found(table: list[tuple[float, float]]) -> Array:
    shift, turn = np.array(table).T
    return np.asarray((shift < NEAR) & (turn < TURNED))


def test_without_a_prior_as_often_as_icp_from_the_truth() -> None:
    """The success is that of ICP started at the truth less 2.5 points; ICP from the identity is far below."""
    pytest.importorskip("small_gicp")
    chosen = pairs()
    results = [by_lines(pair) for pair in chosen]
    ours = _found([errors(motion, pair.motion) for (motion, _), pair in zip(results, chosen, strict=True)])
    best = _found([errors(by_icp(pair, pair.motion), pair.motion) for pair in chosen])
    blind = _found([errors(by_icp(pair, np.zeros(3)), pair.motion) for pair in chosen])
    assert ours.mean() >= best.mean() - 0.025
    assert ours.mean() >= blind.mean() + 0.2
    certain = np.array([status is MappingStatus.OK for _, status in results])
    assert ours[certain].mean() >= 0.99
