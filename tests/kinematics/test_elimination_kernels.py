"""The kernels of eliminations: zeros, their configurations, and distinct branches."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from arm_tables import random_arm

from algorithms.kinematics import Robot
from algorithms.kinematics.inverse.chain import Chain, apart, chain_of
from algorithms.kinematics.inverse.elimination import Variant
from generated import eliminations, pga3

SLIDES = np.zeros(6, bool)


def chain_and_goals(count: int) -> tuple[Chain, np.ndarray, np.ndarray]:
    chain = chain_of(Robot.from_dh(random_arm(0)).axes, (False,) * 6)
    q = np.random.default_rng(0).uniform(-pi, pi, (count, 6))
    return chain, q, chain.motion_of_all(q)


@pytest.mark.parametrize("after", range(3))
@pytest.mark.parametrize("backwards", [False, True])
def test_each_variant_finds_the_generating_configuration(backwards: bool, after: int) -> None:
    chain, q, goals = chain_and_goals(40)
    variant = Variant.of(chain, backwards, after)
    assert variant is not None
    for sharp in (False, True):
        found, most = variant.candidates(goals, sharp)
        off = apart(found, q[:, None], SLIDES)
        assert np.nanmin(off, axis=-1).max() < 1e-5
        assert (most % 2 == 0).all() and (most >= 2).all() and (most <= np.isfinite(found[..., 0]).sum(-1)).all()
        # A real zero is a configuration before any improvement, unless it nearly coincides with another one.
        close = chain.distance(found, goals[:, None]) < 1e-5
        assert (close.sum(-1) >= most).mean() > 0.9


def test_the_map_of_the_circle_moves_samples_but_not_zeros() -> None:
    chain, _, goals = chain_and_goals(20)
    variant = Variant.of(chain, False, 0)
    assert variant is not None
    goals = goals * np.array([1.0] * 4 + [1 / chain.size] * 4)
    plain, mapped = (variant.zeros(goals, np.full((20, 2), centre))[-1] for centre in (0.0, 0.3))
    assert np.array_equal(plain[..., 2].sum(-1), mapped[..., 2].sum(-1)) and not mapped[..., 3].any()
    for one, other in zip(plain, mapped, strict=True):
        a, b = (zeros[zeros[:, 2] > 0, 0] for zeros in (one, other))
        away = np.abs((a[:, None] - b + pi) % (2 * pi) - pi)
        assert away.min(0).max() < 1e-6 and away.min(1).max() < 1e-6


def test_equal_configurations_are_one_branch() -> None:
    chain, q, _ = chain_and_goals(4)
    rows = np.concatenate([q, q[:1] + 2 * pi, q[1:2] + 1e-7, q[2:3] + 1e-3])
    off = np.array([1e-12, 1e-12, 1e-12, 1e-3, 0.0, 1e-11, 1e-12])
    kept, gap = chain.distinct(rows, off)
    # The copy of the first one is nearer to the goal, that of the second one farther; the fourth one does not reach it.
    assert kept.tolist() == [0, 1, 1, 0, 1, 0, 1] and (gap == 1).all()
    lines = pga3.line_from_direction_moment(np.eye(3)[[0, 1, 2, 0, 1, 2]], np.zeros((6, 3)))
    lines[3:] = pga3.line_from_direction_moment(np.eye(3), np.eye(3)[[1, 2, 0]])
    words: dict[str, Any] = {"turns": np.ones(6), "size": 1.0, "close": 1e-9, "same": 1e-5, "flat": 1e-7}
    assert eliminations.distinct_branches(np.zeros((1, 6)), np.zeros(1), lines, **words)[1] == 1
    lines[5] = lines[4]
    assert eliminations.distinct_branches(np.zeros((1, 6)), np.zeros(1), lines, **words)[1] == 0
