"""Simulated tracking with noise, delay and dropped frames."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.estimation import (
    Prediction,
    Sensor,
    Tracker,
    TrackingStatus,
    calibrated_head,
    pan_tilt_head,
    simulate_tracking,
)
from algorithms.estimation.body_eye import body_eye
from generated import pga3

Array = np.ndarray[Any, Any]
POOR = Sensor(delay=0.06, noise=5e-4, depth_noise=0.01, drop=0.2)


def swing(time: float) -> Array:
    return np.array([2.0, 0.8 * np.sin(1.2 * time), 0.4 * np.cos(0.9 * time)])


def uniform(time: float) -> Array:
    return np.array([2.0, -0.8 + 0.4 * time, 0.3])


def late_errors(**more: Any) -> Array:
    """Distances of the image from the goal after the first second of four."""
    found = simulate_tracking(Tracker(pan_tilt_head(), gain=6.0), [0.1, 0.1], more.pop("target", swing), 4.0, **more)
    return np.asarray(np.linalg.norm(found.error[len(found.times) // 4 :], axis=1))


def test_still_target_decays_as_designed() -> None:
    """With small steps the error is the exponential function of the continuous controller."""
    tracker = Tracker(pan_tilt_head(), gain=4.0)
    found = simulate_tracking(tracker, [0.3, -0.2], lambda _: [2.0, 0.0, 0.1], 1.0)
    expected = found.error[0] * np.exp(-4 * found.times[:, None])
    assert np.abs(found.error - expected).max() < 1e-3 and (found.status == TrackingStatus.OK).all()
    assert found.n_frames == 30 and found.n_dropped == 0


@pytest.mark.slow
def test_delay_and_dropped_frames_are_compensated() -> None:
    """For a constant velocity the prediction leaves the errors of noise only."""
    assert late_errors(target=uniform, sensor=Sensor(delay=0.1, drop=0.3), seed=1).max() < 3e-3
    worst = late_errors(sensor=POOR).max()
    assert worst < 0.03
    assert late_errors(sensor=POOR, control_time=2e-3, by_forces=True).max() < 0.08
    assert late_errors(motor_time=0.02).max() < 0.02
    without = Prediction(alpha=1.0, longest=1e-9)
    assert late_errors(sensor=POOR, prediction=without).max() > 2 * worst


def test_a_target_that_vanishes() -> None:
    """While nothing is measured the predicted place stands still, and the head does not diverge."""

    def hidden(time: float) -> Array:
        return uniform(time) if time < 1 or time > 2.5 else np.full(3, np.nan)

    found = simulate_tracking(Tracker(pan_tilt_head(), gain=6.0), [0.0, 0.0], hidden, 4.0)
    assert np.isfinite(found.q).all() and np.abs(found.rates).max() <= 4
    assert 40 < found.n_dropped < 50
    assert np.linalg.norm(found.error[-1]) < 0.01
    never = simulate_tracking(Tracker(pan_tilt_head()), [0.1, 0.2], lambda _: [np.nan] * 3, 0.5)
    assert np.array_equal(never.q[-1], [0.1, 0.2]) and (never.status == TrackingStatus.NOT_FINITE).all()
    braked = simulate_tracking(Tracker(pan_tilt_head()), [0.1, 0.2], lambda _: [np.nan] * 3, 0.5, by_forces=True)
    assert np.abs(braked.q - [0.1, 0.2]).max() < 1e-6


def test_limits_of_joints_stop_the_head() -> None:
    found = simulate_tracking(Tracker(pan_tilt_head(), gain=6.0), [0.0, 0.9], lambda _: [0.05, 0.0, 2.0], 3.0)
    assert found.q[:, 1].max() <= 1.4 and found.q[-1, 1] == 1.4 and np.isfinite(found.error).all()


def test_prediction() -> None:
    filter_ = Prediction()
    assert np.isnan(filter_.at(0.0)[0]).all() and not filter_.at(0.0)[1].any()
    speed = np.array([1.0, -2.0, 0.5])
    for time in np.arange(0, 2, 0.05):
        filter_.add(time, time * speed)
    filter_.add(1.5, np.ones(3))
    filter_.add(2.1, np.array([np.nan, 0, 0]))
    assert filter_.n_skipped == 2
    place, velocity = filter_.at(2.1)
    assert np.allclose(place, 2.1 * speed, atol=1e-6) and np.allclose(velocity, speed, atol=1e-6)
    place, velocity = filter_.at(9.0)
    assert np.allclose(place, (1.95 + 0.5) * speed, atol=1e-6) and not velocity.any()


def test_calibrated_head_tracks_as_the_true_one() -> None:
    """The chain that body-eye calibration measures is that of the head."""
    axes = pan_tilt_head().axes.copy()
    axes[1] = pga3.normalize_line(pga3.join_points([0.03, 0.0, 0.1], [0.04, -1.0, 0.12]))
    eye = pga3.motor_product(pga3.motor_from_rotation_vector_translation([0.05, 0.1, -0.1], [0.05, 0.02, 0.15]),
                             pan_tilt_head().tool)  # fmt: skip
    head = pan_tilt_head(axes, eye)
    points = pga3.move_point(head.tool, np.random.default_rng(0).uniform([-0.7, -0.5, 0.7], [0.7, 0.5, 2], (12, 3)))
    sweeps = []
    for joint, reach in ((0, 0.5), (1, 0.4)):
        q = np.zeros((15, 2))
        q[:, joint] = np.linspace(-reach, reach, 15)
        sweeps.append(pga3.move_point_back(head.forward(q)[:, None], points))
    measured = calibrated_head(body_eye(*sweeps, axes))
    q = np.array([0.4, -0.3])
    assert np.abs(measured.pose(q) - head.pose(q)).max() < 1e-12


def test_wrong_arguments() -> None:
    tracker = Tracker(pan_tilt_head())
    with pytest.raises(ValueError, match="duration 0"):
        simulate_tracking(tracker, [0, 0], swing, 0.0)
    with pytest.raises(ValueError, match="drop -1"):
        Sensor(drop=-1.0)
    with pytest.raises(ValueError, match="q: shape"):
        simulate_tracking(tracker, [0.0], swing, 1.0)
