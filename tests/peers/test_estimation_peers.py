"""Estimation compared with filterpy and VQF on the same numbers."""

from __future__ import annotations

import numpy as np
import pytest
from inertial import COMBINED, ROTATION, Recording, errors
from scipy.linalg import block_diag

from algorithms.estimation import KalmanFilter, orientation

pytestmark = pytest.mark.peers


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_kalman_filter_is_that_of_filterpy(axes: int) -> None:
    """Constant velocity on one to three axes: states and covariances agree to 1e-12, smoothed ones to 1e-11."""
    peer = pytest.importorskip("filterpy.kalman")
    rng = np.random.default_rng(axes)
    dt, n, t = 0.1, 2 * axes, 200
    move = block_diag(*[np.array([[1, dt], [0, 1]])] * axes)
    process = block_diag(*[np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])] * axes)
    rows = block_diag(*[np.array([[1.0, 0]])] * axes)
    noise = 0.2 * np.eye(axes) + 0.05
    measurements = np.cumsum(rng.normal(size=(t, axes)), 0)
    ours = KalmanFilter(np.zeros(n), np.eye(n), move, process, rows, noise)
    found = ours.run(measurements)
    theirs = peer.KalmanFilter(dim_x=n, dim_z=axes)
    theirs.x, theirs.P = np.zeros(n), np.eye(n)
    theirs.F, theirs.Q, theirs.H, theirs.R = move, process, rows, noise
    states, covariances = [], []
    for z in measurements:
        theirs.predict()
        theirs.update(z)
        states.append(theirs.x)
        covariances.append(theirs.P)
    scale = np.abs(states).max()
    assert np.abs(found.states - states).max() < 1e-12 * scale
    assert np.abs(found.covariances - covariances).max() < 1e-12
    smoothed, spreads = theirs.rts_smoother(np.array(states), np.array(covariances))[:2]
    own = ours.smooth(found)
    assert np.abs(own.states - smoothed).max() < 1e-11 * scale and np.abs(own.covariances - spreads).max() < 1e-11


@pytest.mark.parametrize("name", [ROTATION, COMBINED])
def test_orientation_is_more_accurate_than_vqf(name: str) -> None:
    """On both recordings, also from a start in motion and at a quarter of the rate."""
    peer = pytest.importorskip("vqf")
    r = Recording.of(name)
    for start, every in ((0, 1), (4000, 1), (8000, 1), (0, 4)):
        cut = slice(start, None)
        samples = [np.ascontiguousarray(x[cut][every - 1 :: every]) for x in (r.rates, r.accelerations, r.fields)]
        if every > 1:
            whole = r.rates[cut][: len(samples[0]) * every]
            samples[0] = np.ascontiguousarray(whole.reshape(-1, every, 3).mean(1))
        part = Recording(r.rate, *(r.rates[cut],) * 3, r.moving[cut][every - 1 :: every], r.truth[start // 4 :])
        q = peer.VQF(every / r.rate).updateBatch(*samples)["quat9D"]
        theirs = np.stack([q[:, 0], -q[:, 3], q[:, 2], -q[:, 1]], -1)
        ours = orientation(*samples, r.rate / every)
        step = 4 // every
        assert all(a < b for a, b in zip(errors(ours, part, every=step), errors(theirs, part, every=step), strict=True))
