"""Orientation sample by sample: the same estimates as from the whole recording, and bad samples."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from inertial import COMBINED, ROTATION, Recording

from algorithms.arguments import Reals
from algorithms.estimation import (
    EstimationStatus,
    Orientation,
    OrientationFilter,
    OrientationSettings,
    estimate_orientation,
)

STILL, UP, NORTH = np.zeros(3), np.array([0, 0, 9.81]), np.array([0, 20.0, -40])


@pytest.fixture(scope="module", params=[ROTATION, COMBINED])
def recording(request: pytest.FixtureRequest) -> Recording:
    return Recording.of(request.param)


def compare(filter_: OrientationFilter, batch: Orientation, k: int) -> None:
    """The estimates after a sample are those of the recording."""
    assert np.abs(filter_.rotor - batch.rotors[..., k, :]).max() < 1e-12
    assert np.abs(filter_.bias - batch.biases[..., k, :]).max() < 1e-12
    deviations = np.sqrt(np.diagonal(filter_.covariance, axis1=-2, axis2=-1))
    assert np.allclose(deviations, batch.deviations[..., k, :], rtol=1e-9, atol=1e-14)
    assert np.array_equal(filter_.at_rest, batch.at_rest[..., k])
    assert np.allclose(filter_.delay, batch.delays[..., k], atol=1e-13)
    assert np.allclose(filter_.disturbance, batch.disturbance[..., k], atol=1e-12)


@pytest.mark.parametrize("name", [ROTATION, COMBINED])
def test_equal_to_whole_recordings(name: str) -> None:
    r, n = Recording.of(name), 1500
    times = np.sort(np.random.default_rng(0).uniform(0, n / r.rate, n))
    rates, forces, fields = (x[3000 : 3000 + n].copy() for x in (r.rates, r.accelerations, r.fields))
    fields[::3] = np.nan
    rates[900:1000] = np.nan
    batch = estimate_orientation(rates, forces, fields, times=times)
    one = OrientationFilter()
    for k in range(n):
        one.update(rates[k], forces[k], fields[k] if k % 3 else None, float(times[k]))
        if k > 600 and k % 40 == 0:
            compare(one, batch, k)
            one = pickle.loads(pickle.dumps(one))
    compare(one, batch, n - 1)
    assert np.array_equal(one.n_skipped, batch.n_skipped)


def test_first_seconds_are_those_of_the_recording_so_far() -> None:
    r = Recording.of(COMBINED)
    one = OrientationFilter(r.rate)
    for k in range(700):
        one.update(r.rates[k], r.accelerations[k], r.fields[k])
        if k in (0, 1, 10, 300, 570, 571, 572, 573, 600):
            parts = (x[: max(k + 1, 573)] if k > 572 else x[: k + 1] for x in (r.rates, r.accelerations, r.fields))
            compare(one, estimate_orientation(*parts, r.rate), k)


def test_late_samples_are_left_out() -> None:
    """Times that decrease, repeat or are not numbers: BAD_TIME, as if there had been no such sample."""
    r = Recording.of(ROTATION)
    usual, other = OrientationFilter(), OrientationFilter()
    for k in range(900):
        sample = (r.rates[k], r.accelerations[k], r.fields[k])
        usual.update(*sample, time=k / r.rate)
        other.update(*sample, time=k / r.rate)
        if k in (1, 5, 300, 800):
            for late in (0.0, k / r.rate, float("nan"), float("inf")):
                other.update(100 * np.ones(3), sample[1], sample[2], time=late)
                assert other.status == EstimationStatus.BAD_TIME
    assert np.array_equal(other.rotor, usual.rotor) and other.n_skipped.tolist() == [16] * 3
    assert usual.status is EstimationStatus.OK


def test_several_sensors_at_once() -> None:
    r = Recording.of(ROTATION)
    starts = (0, 2000, 5000)
    both, single = OrientationFilter(r.rate), [OrientationFilter(r.rate) for _ in starts]
    for k in range(800):
        rows = [(r.rates[s + k], r.accelerations[s + k], r.fields[s + k]) for s in starts]
        both.update(*(np.array(part) for part in zip(*rows, strict=True)))
        for each, row in zip(single, rows, strict=True):
            each.update(*row)
    for k, each in enumerate(single):
        assert np.abs(both.rotor[k] - each.rotor).max() < 1e-12
        assert np.allclose(both.covariance[k], each.covariance, rtol=1e-9)
    assert isinstance(both.status, np.ndarray) and both.status.tolist() == [0, 0, 0]


def filled(n: int, gyr: Reals, acc: Reals, mag: Reals | None = None) -> OrientationFilter:
    one = OrientationFilter(100.0)
    for _ in range(n):
        one.update(gyr, acc, mag)
    return one


def test_statuses() -> None:
    assert OrientationFilter().status is EstimationStatus.UNOBSERVED
    assert OrientationFilter().rotor.tolist() == [1, 0, 0, 0]
    nan = np.full(3, np.nan)
    assert filled(3, STILL, nan).status is EstimationStatus.UNOBSERVED
    good = filled(300, STILL, UP, NORTH)
    assert good.status is EstimationStatus.OK and good.at_rest
    narrow = good.covariance.copy()
    good.update(nan, nan, NORTH)
    assert good.status is EstimationStatus.SKIPPED
    for _ in range(100):
        good.update(nan, UP, NORTH)
    assert good.status is EstimationStatus.OK and good.covariance[0, 0] >= narrow[0, 0]
    # Without gravity, or lying, for two seconds.
    assert filled(600, STILL, STILL).status is EstimationStatus.INCONSISTENT
    for _ in range(400):
        good.update(STILL, [20.0, 0, 0], NORTH)
    assert good.status is EstimationStatus.INCONSISTENT


def test_innovations_with_something_in_common() -> None:
    """A wrong scale contradicts a recording at the sample after which it contradicts the filter."""
    r, n = Recording.of(COMBINED), 4000
    rates, forces, fields = (x[6000 : 6000 + n].copy() for x in (r.rates, r.accelerations, r.fields))
    for scale, expected in ((1.0, EstimationStatus.OK), (1.1, EstimationStatus.INCONSISTENT)):
        one, first = OrientationFilter(r.rate), n
        for k in range(n):
            one.update(scale * rates[k], forces[k], fields[k])
            if k > 600 and one.status is not EstimationStatus.OK:
                first = k
                break
        assert estimate_orientation(scale * rates, forces, fields, r.rate).status == expected
        assert (first < n) == (expected is EstimationStatus.INCONSISTENT)
        before = (scale * rates[:first], forces[:first], fields[:first])
        assert estimate_orientation(*before, r.rate).status == EstimationStatus.OK


def test_slow_motions_contradict_small_velocities() -> None:
    """Three metres there in 4 s and back in 4 s, with velocities that are 0 on average and one metre per second."""
    phase = 2 * np.pi * np.arange(3000) / 800
    acc = np.tile(UP, (3000, 1))
    acc[400:, 0] = -1.5 * (2 * np.pi / 8) ** 2 * np.cos(phase[400:])
    found = [
        estimate_orientation(
            np.zeros((3000, 3)), acc, rate=100.0, settings=OrientationSettings(velocity=v, rest_time=60)
        ).status
        for v in (0.1, 3.0)
    ]
    assert found == [EstimationStatus.INCONSISTENT, EstimationStatus.OK]


def test_fields_that_change_turn_the_heading() -> None:
    """Iron that lasts: the deviation of the heading grows to the angle by which it may have turned the field."""
    one = filled(1000, STILL, UP, NORTH)
    narrow = np.sqrt(one.covariance[2, 2])
    for _ in range(3000):
        one.update(STILL, UP, [10.0, 10, -40])
    error = 2 * abs(np.arctan2(one.rotor[1], one.rotor[0]))
    assert error > 4 * narrow
    assert error < 4 * np.sqrt(one.covariance[2, 2])


def test_fields_that_are_not_turned_with_the_sensor(recording: Recording) -> None:
    """Exchanged axes of the magnetometer, or another sign, contradict the rates."""
    cut = slice(3000, 9000)
    rates, forces, fields = (x[cut] for x in (recording.rates, recording.accelerations, recording.fields))
    for changed, expected in (
        (fields, EstimationStatus.OK),
        (fields[:, [1, 0, 2]], EstimationStatus.INCONSISTENT),
        (fields[:, [1, 2, 0]], EstimationStatus.INCONSISTENT),
        (fields * [1, -1, 1], EstimationStatus.INCONSISTENT),
    ):
        assert estimate_orientation(rates, forces, changed, recording.rate).status == expected


def test_a_gyroscope_at_its_limit() -> None:
    """A rate of 5 rad/s that is reported as 4: INCONSISTENT, and the deviation covers the error of a radian."""
    one, turn = OrientationFilter(100.0), 0.0
    for k in range(500):
        rate = 5 * np.sin(0.01 * k) ** 2
        turn += 0.01 * rate
        one.update([0, 0, min(rate, 4.0)], UP)
    angle = 2 * np.arctan2(-one.rotor[1], one.rotor[0])
    error = abs((angle - turn + np.pi) % (2 * np.pi) - np.pi)
    assert one.status is EstimationStatus.INCONSISTENT
    assert 0.2 < error < 3 * np.sqrt(one.covariance[2, 2])


def test_a_magnetometer_that_starts_late_turns_the_heading() -> None:
    """The heading is arbitrary before the first field, whatever its deviation was."""
    one = filled(300, STILL, UP)
    for _ in range(400):
        one.update(STILL, UP, [20.0, 0, -40])  # north is along the x axis of the sensor
    assert 2 * abs(np.arctan2(one.rotor[1], one.rotor[0])) == pytest.approx(np.pi / 2, abs=0.01)
    assert one.covariance[2, 2] < 0.2**2


def test_forms_of_arguments() -> None:
    usual, other = OrientationFilter(100.0), OrientationFilter(100.0)
    narrow = np.asarray(UP, np.float32)
    narrow.flags.writeable = False
    for k in range(250):
        usual.update(STILL, narrow.astype(float), NORTH)
        other.update([0, 0, 0], narrow, (0, 20, -40), time=np.float64(0.01 * k))
    assert np.abs(usual.rotor - other.rotor).max() < 1e-12


def test_messages() -> None:
    one = OrientationFilter()
    with pytest.raises(ValueError, match="rate: 0; expected a positive number"):
        OrientationFilter(0)
    with pytest.raises(ValueError, match="gyr"):
        one.update([0, 0], UP)
    one.update(STILL, UP)
    with pytest.raises(ValueError, match=r"acc: shape \(2, 3\); expected \(3,\), as in the first update"):
        one.update(STILL, np.zeros((2, 3)))
    with pytest.raises(TypeError, match="time: '1'; expected a number of seconds"):
        one.update(STILL, UP, time="1")  # type: ignore[arg-type]
