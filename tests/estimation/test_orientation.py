"""Orientation of inertial sensors: recordings with optical truth, disturbances, and bad input."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inertial import COMBINED, ROTATION, Recording, errors, product

from algorithms.arguments import Reals
from algorithms.estimation import EstimationStatus, OrientationSettings, estimate_orientation, orientation


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(1)


@pytest.fixture(scope="module", params=[ROTATION, COMBINED])
def recording(request: pytest.FixtureRequest) -> Recording:
    return Recording.of(request.param)


def of(recording: Recording, **settings: float) -> Reals:
    r = recording
    return orientation(r.rates, r.accelerations, r.fields, r.rate, settings=OrientationSettings(**settings))


BOUNDS = {ROTATION: (0.90, 0.70), COMBINED: (2.15, 1.58)}
"""Degrees, total and inclination. VQF 2.1.2 has 1.01, 0.71 and 3.23, 1.59 (tests/peers)."""


@pytest.mark.parametrize("name", [ROTATION, COMBINED])
def test_errors_on_recordings(name: str) -> None:
    found = errors(of(recording := Recording.of(name)), recording)
    assert all(a <= b for a, b in zip(found, BOUNDS[name], strict=True)), found


def test_nominal_rate_suffices(recording: Recording) -> None:
    exact = of(recording)
    nominal = of(replace(recording, rate=285.7))
    assert np.allclose(errors(nominal, recording), errors(exact, recording), atol=0.05)


CHANGES = [
    {name: factor * getattr(OrientationSettings(), name)}
    for name in ("rate_noise", "rate_error", "bias_walk", "velocity", "velocity_ratio", "heading_noise", "disturbance")
    for factor in (0.5, 2)
]


def test_settings_are_not_critical(recording: Recording) -> None:
    """Half or twice a setting changes errors by less than a third: they are not tuned to the recordings."""
    usual = errors(of(recording), recording)
    for change in CHANGES:
        total, inclination = errors(of(recording, **change), recording)
        assert total < 1.34 * usual[0] and inclination < 1.34 * usual[1], change


def test_other_axes_and_signs(recording: Recording) -> None:
    """Turned sensors give the same errors, since nothing prefers an axis of the sensor."""
    turn = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
    r = recording
    rotors = orientation(r.rates @ turn.T, r.accelerations @ turn.T, r.fields @ turn.T, r.rate)
    # Turning the sensor's axes by x -> y -> z -> x is the quaternion (1 + i + j + k) / 2.
    quaternions = np.stack([rotors[:, 0], -rotors[:, 3], rotors[:, 2], -rotors[:, 1]], -1)
    back = product(quaternions, np.full((len(rotors), 4), 0.5))
    again = np.stack([back[:, 0], -back[:, 3], back[:, 2], -back[:, 1]], -1)
    assert np.allclose(errors(again, r), errors(of(r), r), atol=1e-6)


def test_starts_in_motion(recording: Recording) -> None:
    """Without a rest at the beginning, the first seconds still determine the orientation."""
    for start in (4000, 8000, 12000, 16000):
        cut = slice(start, None)
        r = recording
        part = Recording(
            r.rate, r.rates[cut], r.accelerations[cut], r.fields[cut], r.moving[cut], r.truth[start // 4 :]
        )
        total, inclination = errors(of(part), part)
        assert total < 6.5 and inclination < 2


def test_delay_of_the_magnetometer_is_found(recording: Recording) -> None:
    r = recording
    found = estimate_orientation(r.rates, r.accelerations, r.fields, r.rate).delays
    assert abs(found[-1] - 0.010) < 0.001
    late = estimate_orientation(r.rates, r.accelerations, np.roll(r.fields, 1, 0), r.rate).delays
    assert abs(late[-1] - found[-1] - 1 / r.rate) < 0.0015


def test_magnets(recording: Recording) -> None:
    """A magnet that is near from time to time hardly changes the heading, and never the inclination."""
    n = len(recording.rates)
    near = (np.arange(n) // 2857 % 3 == 2)[:, None]
    clean = errors(of(recording), recording)
    for size in (30.0, 80.0):
        disturbed = replace(recording, fields=recording.fields + near * [size, 0, 0])
        total, inclination = errors(of(disturbed), disturbed)
        assert total < 2 * clean[0] + 0.5
        assert abs(inclination - clean[1]) < 0.05


def test_bias_is_found_at_rest_and_in_motion(recording: Recording) -> None:
    r, bias = recording, np.array([0.02, -0.02, 0.02])
    usual = estimate_orientation(r.rates, r.accelerations, r.fields, r.rate).biases[-1]
    found = estimate_orientation(r.rates + bias, r.accelerations, r.fields, r.rate)
    assert np.abs(found.biases[-1] - usual - bias).max() < 2e-3
    assert found.at_rest[1000] and not found.at_rest[8000]


def test_units_of_the_field_do_not_matter(recording: Recording) -> None:
    r = recording
    assert np.abs(of(replace(r, fields=r.fields * 1e-6)) - of(r)).max() < 1e-9


def test_missing_samples_are_skipped(recording: Recording, rng: np.random.Generator) -> None:
    r = recording
    rates, accelerations, fields = r.rates.copy(), r.accelerations.copy(), r.fields.copy()
    for each, share in ((rates, 0.02), (accelerations, 0.3), (fields, 0.5)):
        each[rng.random(len(each)) < share, 1] = np.nan
    accelerations[5000] = np.inf
    found = estimate_orientation(rates, accelerations, fields, r.rate)
    assert found.n_skipped.tolist() == [int((~np.isfinite(x)).any(1).sum()) for x in (rates, accelerations, fields)]
    assert found.status == EstimationStatus.OK and np.isfinite(found.rotors).all()
    assert errors(found.rotors, r)[0] < errors(of(r), r)[0] + 0.7
    # Differences of the field are taken between neighbouring samples only.
    assert abs(found.delays[-1] - 0.010) < 0.002


def test_nothing_is_finite() -> None:
    bad = np.full((50, 3), np.nan)
    found = estimate_orientation(bad, bad, bad)
    assert found.status == EstimationStatus.SKIPPED and np.isfinite(found.rotors).all()
    assert found.n_skipped.tolist() == [50, 50, 50]
    assert estimate_orientation(np.zeros((0, 3)), np.zeros((0, 3))).rotors.shape == (0, 4)


def test_times(recording: Recording) -> None:
    """Decreasing, repeated and missing time stamps are skipped; a gap of 10 s leaves a finite state."""
    n = 6000
    r = recording
    part = [x[:n] for x in (r.rates, r.accelerations, r.fields)]
    times = np.arange(n) / r.rate
    usual = estimate_orientation(*part, r.rate).rotors
    assert np.abs(estimate_orientation(*part, times=times + 1e3).rotors - usual).max() < 1e-6
    wrong = times.copy()
    wrong[3000], wrong[3100], wrong[3200] = wrong[2000], wrong[3099], np.nan
    found = estimate_orientation(*part, times=wrong)
    assert found.n_skipped.tolist() == [3, 3, 3]
    assert np.abs(found.rotors[-1] - usual[-1]).max() < 0.01
    gap = np.where(np.arange(n) < 3000, times, times + 10)
    after = estimate_orientation(*part, times=gap)
    assert np.isfinite(after.rotors).all() and np.abs((after.rotors**2).sum(1) - 1).max() < 1e-12


def test_still_sensor_upside_down() -> None:
    """A sensor at rest in any attitude has the exact orientation: third axis upwards, field to the north."""
    rng = np.random.default_rng(3)
    from generated import vga3

    for truth in [*vga3.rotor_exponential(rng.normal(size=(20, 3))), [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]:
        up, field = (vga3.rotate_vector(vga3.rotor_inverse(truth), np.array(v)) for v in ([0, 0, 9.81], [0, 20.0, -40]))
        n = 2000
        found = orientation(np.zeros((n, 3)), np.tile(up, (n, 1)), np.tile(field, (n, 1)), 100.0)
        assert np.abs(np.abs(found @ truth) - 1).max() < 1e-6


def test_batches(recording: Recording) -> None:
    r, n = recording, 700
    stacks = [np.stack([x[:n], x[n : 2 * n]]) for x in (r.rates, r.accelerations, r.fields)]
    stacks[1][0, 40:45] = np.nan
    both = orientation(*stacks, r.rate)
    for k in range(2):
        assert np.abs(both[k] - orientation(*(x[k] for x in stacks), r.rate)).max() < 1e-9


def test_messages() -> None:
    good = np.zeros((5, 3))
    with pytest.raises(ValueError, match=r"acc: 4 samples; expected 5"):
        orientation(good, good[:4])
    with pytest.raises(ValueError, match=r"rate: -1; expected a positive number"):
        orientation(good, good, rate=-1)
    with pytest.raises(ValueError, match=r"times: shape \(4,\); expected \(5,\)"):
        orientation(good, good, times=np.arange(4.0))
