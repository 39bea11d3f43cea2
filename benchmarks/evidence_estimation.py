"""Scenes of estimation for the page of evidence: each trial says whether a result is OK, and whether it is right."""

from __future__ import annotations

import numpy as np

from algorithms.estimation import (
    MotorFilter,
    RotorFilter,
    body_eye,
    estimate_orientation,
    stereo_information,
    track_end_effector,
)
from algorithms.kinematics import Robot
from generated import pga3, vga3

from .evidence_scenes import BOUND, Trial, rotation, row


def _vectors(rng: np.random.Generator, n: int) -> np.ndarray:
    found = rng.normal(size=(n, 3))
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


def _rotor(turn: np.ndarray) -> np.ndarray:
    return np.asarray(pga3.rotor_from_matrix(turn))


def _between(a: np.ndarray, b: np.ndarray) -> float:
    """Degrees between two rotations."""
    return float(np.degrees(np.arccos(np.clip((np.trace(a @ b.T) - 1) / 2, -1, 1))))


def _started(rng: np.random.Generator, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """A true rotation, and one that differs from it by an angle between two limits in degrees."""
    truth = rotation(rng, np.pi)
    axis, angle = _vectors(rng, 1)[0], np.radians(rng.uniform(low, high))
    cross = np.cross(np.eye(3), axis)
    return truth, (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross) @ truth


def _filtered(rng: np.random.Generator, noise: float, wrong: bool, off: tuple[float, float], spread: float) -> Trial:
    truth, start = _started(rng, *off)
    gate = 24.0 if wrong else np.inf
    follower = RotorFilter(_rotor(start), spread**2 * np.eye(3), gate=gate)
    status = None
    for _ in range(4):
        model = _vectors(rng, 6 if wrong else int(rng.integers(2, 6)))
        seen = model @ truth.T + rng.normal(0, noise, model.shape)
        if wrong:
            seen[rng.integers(6)] = _vectors(rng, 1)[0]
        status = follower.update(model, seen, max(noise, 0.004))
    found = np.asarray(pga3.rotor_to_matrix(follower.rotor))
    bound = np.degrees(BOUND * np.sqrt(np.linalg.eigvalsh(follower.covariance)[-1]))
    return Trial(status == 0, _between(found, truth) < bound)


@row("`RotorFilter`", "exact vectors, start 100 to 180 degrees off, deviation of 180 degrees", good=True)
def rotor_from_afar(rng: np.random.Generator) -> Trial:
    return _filtered(rng, 0.0, False, (100, 180), np.pi)


@row("`RotorFilter`", "noise of 0.02, a sixth of the vectors wrong, gate, start 0 to 180 degrees off")
def rotor_with_wrong_vectors(rng: np.random.Generator) -> Trial:
    return _filtered(rng, 0.02, True, (0, 180), np.pi)


@row("`RotorFilter`", "noise of 0.02, start up to 20 degrees off, deviation of 12 degrees", good=True)
def rotor_nearby(rng: np.random.Generator) -> Trial:
    return _filtered(rng, 0.02, False, (0, 20), np.radians(12))


@row("`RotorFilter`", "noise of 0.02, start 60 to 180 degrees off, deviation stated as 3 degrees")
def rotor_of_wrong_start(rng: np.random.Generator) -> Trial:
    return _filtered(rng, 0.02, False, (60, 180), np.radians(3))


def _lines(rng: np.random.Generator, n: int) -> np.ndarray:
    return np.asarray(pga3.normalize_line(pga3.join_points(rng.normal(0, 2, (n, 3)), rng.normal(0, 2, (n, 3)))))


def _disturbed(rng: np.random.Generator, lines: np.ndarray, noise: float) -> np.ndarray:
    """Lines through their points next to the origin, displaced, in directions that are turned."""
    points = pga3.line_support(lines) + rng.normal(0, noise, (len(lines), 3))
    directions = pga3.line_to_direction_moment(lines)[0] + rng.normal(0, noise, (len(lines), 3))
    return np.asarray(pga3.normalize_line(pga3.join_point_direction(points, directions)))


def _motor_filtered(
    rng: np.random.Generator,
    noise: float,
    share: float,
    angle: float,
    away: float,
    spread: tuple[float, float],
    per: int,
) -> Trial:
    start = pga3.motor_exponential(rng.normal(size=6))
    turn = np.concatenate([_vectors(rng, 1)[0] * np.radians(angle), _vectors(rng, 1)[0] * away]) / 2
    truth = pga3.motor_product(pga3.motor_exponential(turn), start)
    covariance = np.diag([spread[0] ** 2] * 3 + [spread[1] ** 2] * 3)
    follower, status = MotorFilter(start, covariance, gate=18.5), None
    for _ in range(48 // per):
        model = _lines(rng, per)
        seen = _disturbed(rng, pga3.move_line(truth, model), noise)
        for k in np.flatnonzero(rng.random(per) < share):
            seen[k] = _lines(rng, 1)[0]
        status = follower.update_lines(model, seen, max(noise, 0.003))
    error = pga3.motor_product(truth, pga3.motor_inverse(follower.motor))
    off = np.degrees(2 * np.arccos(min(abs(error[0]), 1)))
    bound = np.degrees(BOUND * np.sqrt(np.linalg.eigvalsh(follower.covariance[:3, :3])[-1]))
    return Trial(status == 0, off < max(bound, 1e-6))


@row(
    "`MotorFilter(gate=)`",
    "exact lines, one to four at a time, up to two stated deviations of 15 to 90 degrees off",
    good=True,
)
def motor_from_afar(rng: np.random.Generator) -> Trial:
    per, spread = int(rng.integers(1, 5)), rng.uniform(0.25, 1.6)
    angle, away = np.degrees(spread * rng.uniform(0, 2)), rng.uniform(0, 8)
    return _motor_filtered(rng, 0.0, 0.0, angle, away, (spread, 5), per)


@row("`MotorFilter(gate=)`", "noise of 0.01, a sixth of the lines wrong, 180 degrees and 8 m off, wide start")
def motor_with_wrong_lines(rng: np.random.Generator) -> Trial:
    return _motor_filtered(rng, 0.01, 1 / 6, rng.uniform(60, 180), rng.uniform(0, 8), (np.pi, 10), 4)


@row("`MotorFilter(gate=)`", "the same, one line at a time")
def motor_by_single_lines(rng: np.random.Generator) -> Trial:
    return _motor_filtered(rng, 0.01, 1 / 6, rng.uniform(60, 180), rng.uniform(0, 8), (np.pi, 10), 1)


@row("`MotorFilter(gate=)`", "noise of 0.01, a start within its stated deviations of 6 degrees and 0.1 m", good=True)
def motor_nearby(rng: np.random.Generator) -> Trial:
    return _motor_filtered(rng, 0.01, 0.0, rng.uniform(0, 8), rng.uniform(0, 0.1), (0.1, 0.1), 4)


@row("`MotorFilter(gate=)`", "noise of 0.01, 30 to 180 degrees off, deviations stated as 1 degree and 2 cm")
def motor_of_wrong_start(rng: np.random.Generator) -> Trial:
    return _motor_filtered(rng, 0.01, 0.0, rng.uniform(30, 180), rng.uniform(0, 8), (0.02, 0.02), 4)


def _tracked(rng: np.random.Generator, far: float, wrong_design: float, informed: bool) -> Trial:
    """A head whose axes do not meet, and points that a stereo camera tracks from random places."""
    focal, baseline, pixel = 640.0, 0.1, 0.25
    directions = np.array([[0, 0, 1.0], [0, 1.0, 0]]) + rng.normal(0, 0.05, (2, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    axes = np.asarray(pga3.join_point_direction(np.array([[0, 0, 0], [0.05, 0, 0.12]]), directions))
    eye = pga3.motor_product(
        pga3.motor_from_rotor_translation(np.eye(4)[0], rng.normal([0.05, 0, 0.2], 0.1)),
        pga3.motor_from_rotor_translation(_rotor(_AHEAD @ rotation(rng, 0.2)), np.zeros(3)),
    )
    n, sweeps = 16, []
    depth = np.where(rng.random(n) < far, 10.0, rng.uniform(0.8, 1.8, n))
    seen = np.stack([rng.uniform(-0.4, 0.4, n) * depth, rng.uniform(-0.3, 0.3, n) * depth, depth], -1)
    points = pga3.move_point(eye, seen)
    for joint, most in ((0, 0.5), (1, 0.35)):
        turns = pga3.motor_from_line(axes[joint], np.linspace(-most, most, 16))
        there = pga3.move_point_back(pga3.motor_product(turns, eye)[:, None], points)
        x, y, z = np.moveaxis(there, -1, 0)
        noise = rng.normal(0, pixel, (3, *x.shape))
        left, right = focal * x / z + noise[0], focal * (x - baseline) / z + noise[1]
        row_of, z = focal * y / z + noise[2] / np.sqrt(2), focal * baseline / (left - right)
        left = np.stack([left, row_of], -1)
        sweeps.append(np.concatenate([left * z[..., None] / focal, z[..., None]], -1))
    if far:
        for each in sweeps:
            lost = rng.random(each.shape[:2]) < 0.2
            each[lost] *= 10 / each[lost][:, 2:]
    if wrong_design:
        tilted = np.cross(np.eye(3), np.cross(directions[0], directions[1]) * wrong_design) + np.eye(3)
        axes[1] = pga3.normalize_line(pga3.join_point_direction(np.array([0.05, 0, 0.12]), tilted @ directions[1]))
    information = [stereo_information(each, focal, baseline, pixel) if informed else None for each in sweeps]
    found = body_eye(sweeps[0], sweeps[1], axes, pan_information=information[0], tilt_information=information[1])
    error = pga3.motor_product(eye, pga3.motor_inverse(found.motor))
    off = np.degrees(2 * np.arccos(min(abs(error[0]), 1)))
    stated = np.degrees(BOUND * np.hypot(found.pan.deviation[0], found.tilt.deviation[0]))
    return Trial(found.status == 0, off < max(stated, 0.2))


_AHEAD = np.array([[0, 0, 1.0], [-1, 0, 0], [0, -1, 0]])
"""The frame of a camera that looks along x, with y down."""


@row("`body_eye`", "16 tracks, noise of 0.25 pixels, a fifth of the points at 10 m, no threshold", slow=True)
def points_far_away(rng: np.random.Generator) -> Trial:
    return _tracked(rng, 0.2, 0.0, True)


@row("`body_eye`", "16 tracks, noise of 0.25 pixels, a design whose angle is wrong by 2 to 6 degrees")
def wrong_design(rng: np.random.Generator) -> Trial:
    return _tracked(rng, 0.0, rng.uniform(0.035, 0.1), True)


@row("`body_eye`", "16 tracks, noise of 0.25 pixels", good=True)
def right_tracks(rng: np.random.Generator) -> Trial:
    return _tracked(rng, 0.0, 0.0, True)


@row(
    "`track_end_effector`",
    "UR5, tool 6 degrees and 4 cm off, three lines, a fifth of them wrong",
)
def end_effector(rng: np.random.Generator) -> Trial:
    return _end_effector(rng, 0.2)


@row("`track_end_effector`", "the same without wrong lines", good=True)
def end_effector_of_right_lines(rng: np.random.Generator) -> Trial:
    return _end_effector(rng, 0.0)


def _end_effector(rng: np.random.Generator, share: float) -> Trial:
    robot, t, noise = _ROBOT, 20, 0.004
    q = rng.uniform(-1, 1, robot.n_joints) + np.linspace(0, 0.8, t)[:, None] * rng.uniform(-1, 1, robot.n_joints)
    poses = robot.forward(q)
    spread = np.array([0.1] * 3 + [0.04] * 3)
    begin = pga3.motor_product(pga3.motor_exponential(-spread * rng.normal(size=6) / 2), poses[0])
    truth = pga3.motor_product(pga3.motor_product(poses, pga3.motor_inverse(poses[0])), begin)
    near, aside = rng.normal(0, 0.15, (2, 3, 3))
    model = np.asarray(pga3.normalize_line(pga3.join_points(near, near + aside)))
    seen = np.stack([_disturbed(rng, pga3.move_line(m, model), noise) for m in truth])
    for k, j in np.argwhere(rng.random((t, 3)) < share):
        seen[k, j] = _disturbed(rng, pga3.move_line(truth[k], _lines(rng, 1)), noise)[0]
    found = track_end_effector(robot, q, model, seen, noise, covariance=spread**2)
    error = pga3.motor_product(truth[-1], pga3.motor_inverse(found.motors[-1]))
    off = 2 * np.arccos(min(abs(error[0]), 1))
    bound = BOUND * np.sqrt(np.linalg.eigvalsh(found.covariances[-1][:3, :3])[-1])
    return Trial(found.status[-1] == 0, off < bound)


_ROBOT = Robot.named("ur5")


def _inertial(rng: np.random.Generator, spoil: str, mag: bool = False) -> Trial:
    """Twenty seconds of a sensor that is turned and moved about by sums of sines, from rest.

    With a magnetometer, headings are those of the earth; without, errors are those since the third second.
    """
    rate, n = 100.0, 2000
    t = np.arange(1, n + 1) / rate
    start = np.clip((t - 2) / 2, 0, 1)[:, None]

    def sines(size: float, low: float, high: float) -> np.ndarray:
        f, phase, a = rng.uniform(low, high, (4, 1, 3)), rng.uniform(0, 6.3, (4, 1, 3)), rng.normal(0, size, (4, 1, 3))
        return np.asarray((a * np.sin(2 * np.pi * f * t[:, None] + phase)).sum(0))

    rates, pushed = start * sines(0.7, 0.1, 0.8), start * sines(0.5, 0.3, 1.2)
    if spoil == "pulled":
        pushed[800:, 0] += rng.uniform(0.5, 3)
    steps = pga3.rotor_from_rotation_vector(rates / rate)
    turns = [np.asarray(pga3.rotor_from_matrix(rotation(rng, 0.5)))]
    for step in steps:
        turns.append(np.asarray(vga3.normalize_rotor(vga3.rotor_product(turns[-1], step))))
    truth = np.array(turns[1:])
    forces = np.asarray(vga3.rotate_vector(vga3.rotor_inverse(truth), pushed + np.array([0, 0, 9.81])))
    gyr, acc = rates + rng.normal(0, 0.003, (n, 3)), forces + rng.normal(0, 0.03, (n, 3))
    if spoil == "no gravity":
        acc = np.zeros_like(acc)
    if spoil == "degrees":
        gyr = np.degrees(gyr)
    if spoil == "gain":
        gyr *= rng.uniform(1.05, 1.3) ** rng.choice([-1, 1])
    if spoil == "late":
        gyr = np.roll(gyr, int(rng.integers(10, 60)), 0)
    if spoil == "saturated":
        limit = max(2.1, rng.uniform(0.5, 0.8) * np.abs(gyr).max())
        gyr = np.clip(gyr, -limit, limit)
    if spoil == "missing":
        first = int(rng.integers(500, 1500))
        gyr[first : first + int(rng.integers(60, 140))] = np.nan
    if spoil == "axes":
        gyr = gyr[:, [(0, 2, 1), (1, 0, 2), (2, 1, 0), (1, 2, 0)][rng.integers(4)]]
    if spoil == "off":
        acc = acc + rng.normal(0, 0.5, 3)
    if spoil == "rate":
        rate *= rng.uniform(1.05, 1.3) ** rng.choice([-1, 1])
    field = None
    if mag:
        near = np.zeros((n, 3))
        if spoil == "iron":
            near[rng.integers(500, 1500) :] = rng.normal(0, 1, 3) * rng.uniform(5, 20)
        field = np.asarray(vga3.rotate_vector(vga3.rotor_inverse(truth), near + np.array([0, 20.0, -40])))
        field = field + rng.normal(0, 0.3, (n, 3))
        if spoil == "iron on it":
            field += rng.normal(0, 1, 3) * rng.uniform(3, 10)
        if spoil == "field axes":
            field = field[:, [1, 0, 2]]
    found = estimate_orientation(gyr, acc, field, rate=rate)
    error = vga3.rotor_product(found.rotors, vga3.rotor_inverse(truth))
    drift = error[-1] if mag else vga3.rotor_product(error, vga3.rotor_inverse(error[299]))[-1]
    off = 2 * np.arccos(min(abs(drift[0]), 1))
    return Trial(bool(found.status == 0), bool(off < max(BOUND * found.deviations[-1].max(), np.radians(3))))


@row(
    "`estimate_orientation`",
    "a sensor turned and moved for 20 s; wrong: off by 3 degrees and the bound",
    good=True,
)
def inertial(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "")


@row("`estimate_orientation`", "the same with accelerations of 0")
def inertial_without_gravity(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "no gravity")


@row("`estimate_orientation`", "the same with rates in degrees per second")
def inertial_in_degrees(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "degrees")


@row("`estimate_orientation`", "the same with a gyroscope that saturates at 50 to 80 % of the largest rate")
def inertial_saturated(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "saturated")


@row("`estimate_orientation`", "the same without rates for 0.6 to 1.4 s")
def inertial_with_a_gap(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "missing")


@row("`estimate_orientation`", "the same with rates that are 5 to 30 % too large or small", slow=True)
def inertial_of_other_gain(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "gain")


@row("`estimate_orientation`", "the same with rates 0.1 to 0.6 s later than accelerations", slow=True)
def inertial_of_late_rates(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "late")


@row("`estimate_orientation`", "the same with an acceleration of 0.5 to 3 m/s2 for the last twelve seconds", slow=True)
def inertial_pulled(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "pulled")


@row("`estimate_orientation`", "the same with exchanged axes of the gyroscope", slow=True)
def inertial_of_other_axes(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "axes")


@row("`estimate_orientation`", "the same with an accelerometer that is off by 0.5 m/s2 along each axis", slow=True)
def inertial_off(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "off")


@row("`estimate_orientation`", "the same with a sample rate that is wrong by 5 to 30 %", slow=True)
def inertial_at_another_rate(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "rate")


@row("`estimate_orientation`", "the same with a magnetometer; wrong: also the heading", good=True, slow=True)
def inertial_magnetic(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "", mag=True)


@row("`estimate_orientation`", "the same with iron near the magnetometer from 5 to 15 s on", slow=True)
def inertial_near_iron(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "iron", mag=True)


@row("`estimate_orientation`", "the same with iron that is turned with the magnetometer", slow=True)
def inertial_with_iron(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "iron on it", mag=True)


@row("`estimate_orientation`", "the same with exchanged axes of the magnetometer", slow=True)
def inertial_of_other_fields(rng: np.random.Generator) -> Trial:
    return _inertial(rng, "field axes", mag=True)
