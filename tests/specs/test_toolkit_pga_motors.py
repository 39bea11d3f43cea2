"""Motors of the generated G(3,0,1) and G(2,0,1) against matrices, scipy and mpmath, where formulas change."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from toolkit_truth import (
    TINY,
    N,
    along,
    angles,
    apply,
    close,
    directions,
    dot,
    hat,
    length,
    line_of,
    perpendicular,
    plane_of,
    pose,
    poses,
    turn,
    up_to_sign,
)

from generated import pga2, pga3


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(302)


def about_line(p: np.ndarray, d: np.ndarray, angle: np.ndarray, shift: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Points x turned about the line through p along d, and shifted along it."""
    return np.asarray(p + Rotation.from_rotvec(along(angle, d)).apply(x - p) + along(shift, d))


def exact_motor(b: np.ndarray) -> np.ndarray:
    """``exp(b)`` of a bivector to 50 digits, by the power series of its matrix of left multiplication, in mpmath."""
    with mpmath.workdps(60):
        u = mpmath.sqrt(sum(mpmath.mpf(float(x)) ** 2 for x in b[:3]))
        z, y, x, *m = (mpmath.mpf(float(value)) for value in b)
        y = -y
        through = x * m[0] + y * m[1] + z * m[2]
        cos, sinc = mpmath.cos(u), mpmath.sinc(u)
        bend = (cos - sinc) / (u * u) if u > mpmath.mpf(10) ** -15 else mpmath.mpf(-1) / 3
        ideal = [sinc * m[k] + bend * through * axis for k, axis in enumerate((x, y, z))]
        return np.array([float(v) for v in (cos, sinc * z, -sinc * y, sinc * x, *ideal, through * sinc)])


def test_exponentials_to_rounding(rng: np.random.Generator) -> None:
    angle = angles()
    d, p = directions(rng), rng.normal(size=(N, 3))
    shift = rng.normal(size=N)
    shift[::3] = 0
    way = np.concatenate([np.zeros((N, 3)), along(shift, d)], -1)
    b = -0.5 * (along(angle, line_of(p, d)) + way)
    exact = np.array([exact_motor(each) for each in b])
    close(pga3.motor_exponential(b), exact, 1e-14)
    moved = pga3.move_point(pga3.motor_exponential(b), p + d)
    close(moved, about_line(p, d, angle, shift, p + d), 1e-13)


def test_exponential_of_logarithm_to_rounding(rng: np.random.Generator) -> None:
    """Angles in [0, 2 pi], 1e-15 ... 1e-2 from 0, pi and 2 pi from both sides, about axes and as screws."""
    angle = angles()
    d, p, shift = directions(rng), rng.normal(size=(N, 3)), rng.normal(size=N)
    shift[::3] = 0
    motors = pga3.motor_from_screw(line_of(p, d), angle, shift)
    back = pga3.motor_exponential(pga3.motor_logarithm(motors))
    up_to_sign(back, motors, 1e-14)
    root = pga3.motor_square_root(motors)
    up_to_sign(pga3.motor_product(root, root), motors, 1e-14)
    third = pga3.motor_power(motors, 1 / 3)
    up_to_sign(pga3.motor_product(third, pga3.motor_product(third, third)), motors, 1e-14)
    near = np.where(angle > np.pi, angle - 2 * np.pi, angle)
    sign = np.where(angle > np.pi, -1, 1)
    clear = np.abs(angle - np.pi) > 1e-12
    part = pga3.motor_from_screw(line_of(p, d), near * 0.3, shift * 0.3)
    close(pga3.motor_power(motors, 0.3)[clear], part[clear], 1e-14)
    up_to_sign(pga3.motor_power(motors, -1.0), pga3.motor_inverse(motors), 1e-14)
    close(pga3.motor_power(motors, 1.0)[clear], along(sign, motors)[clear], 1e-14)


def test_pure_translations(rng: np.random.Generator) -> None:
    t = directions(rng) * np.concatenate([TINY, rng.uniform(0, 100, N - len(TINY))])[:, None]
    motors = np.concatenate([np.ones((N, 1)), np.zeros((N, 3)), -t / 2, np.zeros((N, 1))], -1)
    for m in (motors, -motors):
        close(pga3.motor_logarithm(m), np.concatenate([np.zeros((N, 3)), -t / 2], -1), 0)
        up_to_sign(pga3.motor_square_root(m), motors * np.r_[1, 0, 0, 0, 0.5, 0.5, 0.5, 0], 1e-15)
        axis, angle, distance = pga3.motor_to_screw(m)
        close(angle, 0, 0)
        close(distance, length(t), 1e-13)
        close(along(distance, axis), line_of(np.zeros(3), t), 1e-13)
    close(pga3.motor_to_twist(motors), np.concatenate([np.zeros((N, 3)), t], -1), 0)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_screws_and_motors(rng: np.random.Generator, scale: float) -> None:
    d, p, shift = directions(rng), rng.normal(size=(N, 3)) * scale, rng.normal(size=N) * scale
    angle = np.concatenate([[np.pi - 1e-9, np.pi / 2, 1e-3], rng.uniform(1e-2, np.pi - 1e-6, N - 3)])
    lines = line_of(p, d)
    motors = pga3.motor_from_screw(lines, angle, shift)
    for m in (motors, -motors):
        axis, turned, distance = pga3.motor_to_screw(m)
        close(turned, angle, 1e-14)
        close(distance, shift, 2e-12 * scale)
        close(axis[:, :3], lines[:, :3], 2e-13)
        close(axis[:, 3:], lines[:, 3:], 1e-11 * scale)
        up_to_sign(pga3.motor_from_screw(axis, turned, distance), motors, 1e-14 * max(1, scale))
    axis, turned, distance = pga3.motor_to_screw([1.0, 0, 0, 0, 0, 0, 0, 0])
    assert not axis.any() and turned == 0 and distance == 0
    pitch = shift / angle
    close(pga3.motor_from_screw_pitch(lines, angle, pitch), motors, 1e-15 * max(1, scale) * 4)
    rate = rng.uniform(0.1, 5, N)
    twists = pga3.bivector_from_screw(lines, rate, pitch)
    w, v = pga3.twist_to_velocities(twists)
    close(w, along(rate, d), 1e-15)
    close(v, np.cross(p, along(rate, d)) + along(rate * pitch, d), 1e-12 * scale * 1e2)
    axis, magnitude, found = pga3.bivector_to_screw(twists)
    close(magnitude, rate, 1e-14)
    close(found / np.maximum(1, np.abs(pitch / scale)), pitch / np.maximum(1, np.abs(pitch / scale)), 1e-13 * scale)
    close((axis - lines)[:, 3:] / np.maximum(1, np.abs(pitch / scale))[:, None], 0, 1e-13 * scale)
    with np.errstate(all="ignore"):
        axis, magnitude, found = pga3.bivector_to_screw([0, 0, 0, 3.0, 4.0, 0])
    close(axis, line_of(np.zeros(3), np.array([0.6, 0.8, 0])), 1e-15)
    assert magnitude == 5 and found == np.inf


def test_twists_velocities_and_accelerations(rng: np.random.Generator) -> None:
    w, v, dw, dv, p = rng.normal(size=(5, N, 3))
    w[: len(TINY)] *= TINY[:, None]
    twist, change = pga3.twist_from_velocities(w, v), pga3.twist_from_velocities(dw, dv)
    close(twist, np.column_stack([w[:, 2], -w[:, 1], w[:, 0], v]), 0)
    for found, expected in zip(pga3.twist_to_velocities(twist), (w, v), strict=True):
        close(found, expected, 0)
    close(pga3.twist_on_point(twist, p), np.cross(w, p) + v, 1e-14)
    velocity = np.cross(w, p) + v
    close(pga3.acceleration_of_point(twist, change, p), np.cross(dw, p) + dv + np.cross(w, velocity), 1e-13)
    generator = np.zeros((N, 4, 4))
    generator[:, :3, :3], generator[:, :3, 3] = hat(w), v
    motors = pga3.motor_from_twist(twist)
    close(pga3.motor_to_matrix(motors), expm(generator), 1e-12)
    short = length(w) < 3
    close(pga3.motor_to_twist(motors)[short], twist[short], 1e-12)
    h = 1e-6
    ahead, behind = (pga3.motor_product(pga3.motor_from_twist(s * change), motors) for s in (h, -h))
    rate = (ahead - behind) / (2 * h)
    close(pga3.motor_derivative(motors, change), rate, 1e-8)
    close(pga3.twist_from_motor_derivative(motors, pga3.motor_derivative(motors, change)), change, 1e-13)


def test_rotations_in_other_forms(rng: np.random.Generator) -> None:
    matrices = poses(rng)
    rotation, t = Rotation.from_matrix(matrices[:, :3, :3]), matrices[:, :3, 3]
    motors = pga3.motor_from_matrix(matrices)
    rotors = motors[:, :4]
    for sign in (1, -1):
        vectors = pga3.rotor_to_rotation_vector(sign * rotors)
        close(Rotation.from_rotvec(vectors).as_matrix(), matrices[:, :3, :3], 1e-14)
        assert np.all(length(vectors) <= np.pi + 1e-15)
        axis, angle = pga3.rotor_to_axis_angle(sign * rotors)
        close(along(angle, axis), vectors, 1e-14)
        close(length(axis)[angle > 0], 1, 1e-15)
        vectors, translation = pga3.motor_to_rotation_vector_translation(sign * motors)
        close(translation, t, 1e-14)
        up_to_sign(pga3.motor_from_rotation_vector_translation(vectors, translation), motors, 1e-14)
    axis, angle = pga3.rotor_to_axis_angle([1.0, 0, 0, 0])
    assert not axis.any() and angle == 0
    last = rotation.as_quat()
    up_to_sign(pga3.rotor_to_quaternion_scalar_last(rotors), last, 1e-14)
    close(pga3.rotor_from_quaternion_scalar_last(pga3.rotor_to_quaternion_scalar_last(rotors)), rotors, 0)
    first = np.roll(last, 1, -1)
    close(pga3.motor_to_matrix(pga3.motor_from_quaternion_translation(first, t)), matrices, 1e-14)
    quaternion, translation = pga3.motor_to_quaternion_translation(motors)
    up_to_sign(quaternion, first, 1e-14)
    close(translation, t, 1e-14)


def test_dual_quaternions_scalar_last_and_adjoints(rng: np.random.Generator) -> None:
    motors = pga3.motor_from_matrix(poses(rng))
    first = pga3.motor_to_dual_quaternion(motors)
    order = [1, 2, 3, 0, 5, 6, 7, 4]
    close(pga3.motor_to_dual_quaternion_scalar_last(motors), first[:, order], 0)
    close(pga3.motor_from_dual_quaternion_scalar_last(first[:, order]), motors, 0)
    up_to_sign(pga3.motor_from_adjoint(pga3.motor_to_adjoint(motors)), motors, 1e-14)


def test_motors_between_points_frames_and_blends(rng: np.random.Generator) -> None:
    first, second = poses(rng), poses(rng)[::-1]
    a, b = pga3.motor_from_matrix(first), pga3.motor_from_matrix(second)
    p, q = rng.normal(size=(2, N, 3))
    close(pga3.translator_between_points(p, q), (p - q) / 2, 0)
    close(pga3.motor_to_matrix(pga3.motor_between_frames(a, b)), second @ np.linalg.inv(first), 1e-12)
    close(pga3.motor_to_matrix(pga3.motor_relative(a, b)), np.linalg.inv(first) @ second, 1e-12)
    far = np.abs(dot(a[:, :4], b[:, :4])) > 1e-3
    for sign in (1, -1):
        close(pga3.blend_motors(a, sign * b, 0.0), a, 1e-14)
        up_to_sign(pga3.blend_motors(a, sign * b, 1.0), b, 1e-14)
        half = pga3.blend_motors(a, sign * b, 0.5)
        up_to_sign(half[far], pga3.interpolate_motors(a, b, 0.5)[far], 1e-11)
        motor = pga3.blend_motors(a, sign * b, 0.3)
        close(pga3.even_product(motor, pga3.motor_inverse(motor)), np.tile(np.eye(8)[0], (N, 1)), 1e-12)


def test_motors_between_lines_and_planes_that_are_opposite(rng: np.random.Generator) -> None:
    """Opposite exactly, and to within 1e-15 ... 1e-2, at lines that coincide, are parallel or skew."""
    d, p, q = directions(rng), rng.normal(size=(N, 3)), rng.normal(size=(N, 3))
    q[::4] = p[::4]
    off = np.resize(TINY, N)
    e = -along(np.cos(off), d) + along(np.sin(off), perpendicular(d))
    first, second = line_of(p, d), line_of(q, e)
    motors = pga3.motor_between_lines(first, second)
    close(pga3.move_line(motors, first), second, 1e-13)
    one, other = plane_of(d, p), plane_of(e, q)
    motors = pga3.motor_between_planes(one, other)
    close(pga3.move_plane(motors, one), other, 1e-13)
    for m in (pga3.motor_between_lines(first, second), motors):
        close(dot(m[:, :4], m[:, :4]), 1, 1e-14)
    angle = 2 * np.arccos(np.clip(np.abs(motors[:, 0]), 0, 1))
    close(angle, np.pi - off, 1e-7)


def test_inverses_and_renormalisation(rng: np.random.Generator) -> None:
    motors = pga3.motor_from_matrix(poses(rng))
    even = motors + 1e-3 * rng.normal(size=motors.shape)
    identity = np.tile(np.eye(8)[0], (N, 1))
    close(pga3.even_product(even, pga3.even_inverse(even)), identity, 1e-13)
    found = pga3.normalize_motor(even * rng.uniform(0.1, 10, (N, 1)))
    close(pga3.even_product(found, pga3.motor_inverse(found)), identity, 1e-14)
    close(pga3.normalize_motor(found), found, 1e-14)
    drifted = np.tile(np.eye(8)[0], (1, 1))
    step = pga3.motor_from_screw(line_of(np.ones(3), np.array([0.6, 0, 0.8])), 0.01, 1e-3)
    for _ in range(1000):
        drifted = pga3.normalize_motor(pga3.even_product(step, drifted))
    up_to_sign(drifted, pga3.motor_from_screw(line_of(np.ones(3), np.array([0.6, 0, 0.8])), 10.0, 1.0)[None], 1e-12)


# The plane


def test_motors_of_the_plane_in_other_forms(rng: np.random.Generator) -> None:
    angle = np.concatenate([angles(), -angles()])[: 2 * N : 2] / 2.0001
    c, t, x = rng.normal(size=(3, N, 2))
    rotation = np.moveaxis(np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]), -1, 0)
    motors = pga2.motor_from_point(c, angle)
    close(pga2.move_point(motors, x), c + np.einsum("nij,nj->ni", rotation, x - c), 1e-13)
    centre, found = pga2.motor_to_point(motors)
    close(found, np.abs(angle), 1e-14)
    up_to_sign(pga2.motor_exponential(-0.5 * along(found, centre)), motors, 1e-14)
    clear = np.abs(angle) > 1e-3
    close(pga2.point_from_bivector(centre)[clear], c[clear], 1e-11)
    close(np.abs(centre[clear][:, 0]), 1, 1e-15)
    shift = pga2.motor_from_angle_translation(np.zeros(N), t)
    centre, found = pga2.motor_to_point(shift)
    close(found, 0, 0)
    close(centre, np.column_stack([np.zeros(N), -t[:, 1], t[:, 0]]), 0)
    w = rng.normal(size=N)
    twist = pga2.twist_from_velocities(w, t)
    close(pga2.twist_on_point(twist, x), along(w, np.stack([-x[:, 1], x[:, 0]], -1)) + t, 1e-14)
    for got, expected in zip(pga2.twist_to_velocities(twist), (w, t), strict=True):
        close(got, expected, 0)
    generator = np.zeros((N, 3, 3))
    generator[:, 1, 0], generator[:, 0, 1], generator[:, :2, 2] = w, -w, t
    moving = pga2.motor_from_twist(twist)
    close(pga2.motor_to_matrix(moving), expm(generator), 1e-12)
    short = np.abs(w) < 3
    close(pga2.motor_to_twist(moving)[short], twist[short], 1e-13)
    close(pga2.twist_from_motor_derivative(moving, pga2.motor_derivative(moving, twist)), twist, 1e-14)
    line = rng.normal(size=(N, 3))
    h = 1e-6
    ahead, behind = (pga2.move_line(pga2.motor_from_twist(s * twist), line) for s in (h, -h))
    rate = (ahead - behind) / (2 * h)
    close(pga2.twist_on_line(twist, line), rate, 1e-8)
    matrix = pga2.motor_to_matrix(moving)
    moved = matrix @ generator @ np.linalg.inv(matrix)
    expected = np.stack([moved[:, 1, 0], -moved[:, 1, 2], moved[:, 0, 2]], -1)
    close(np.einsum("nij,nj->ni", pga2.motor_to_adjoint(moving), twist), expected, 1e-12)


def test_functions_of_motors_of_the_plane_to_rounding(rng: np.random.Generator) -> None:
    """Angles in [0, 2 pi] as in space, and translations."""
    angle = angles()
    c, t = rng.normal(size=(2, N, 2))
    motors = pga2.motor_from_point(c, angle)
    half = angle / 2
    exact = np.column_stack([np.cos(half), -np.sin(half), -along(np.sin(half), c)])
    close(pga2.motor_exponential(-along(half, np.column_stack([np.ones(N), c]))), exact, 1e-15)
    close(motors, exact, 1e-15)
    shift = pga2.motor_from_angle_translation(np.zeros(N), t)
    close(pga2.motor_logarithm(shift), np.column_stack([np.zeros(N), t[:, 1] / 2, -t[:, 0] / 2]), 0)
    for m in (motors, shift):
        up_to_sign(pga2.motor_exponential(pga2.motor_logarithm(m)), m, 1e-14)
        root, third = pga2.motor_square_root(m), pga2.motor_power(m, 1 / 3)
        up_to_sign(pga2.even_product(root, root), m, 1e-14)
        up_to_sign(pga2.even_product(third, pga2.even_product(third, third)), m, 1e-14)
    close(pga2.rotor_from_angle(angle), exact[:, :2], 1e-15)


def test_more_motors_of_the_plane(rng: np.random.Generator) -> None:
    angle, other = rng.uniform(-np.pi, np.pi, (2, N))
    t, s, p = rng.normal(size=(3, N, 2))
    a, b = pga2.motor_from_angle_translation(angle, t), pga2.motor_from_angle_translation(other, s)
    first, second = pga2.motor_to_matrix(a), pga2.motor_to_matrix(b)
    close(pga2.motor_to_matrix(pga2.motor_between_frames(a, b)), second @ np.linalg.inv(first), 1e-13)
    close(pga2.motor_to_matrix(pga2.motor_relative(a, b)), np.linalg.inv(first) @ second, 1e-13)
    close(pga2.translator_between_points(t, s), np.stack([(s - t)[:, 1], (t - s)[:, 0]], -1) / 2, 0)
    even = rng.normal(size=(N, 4))
    close(pga2.even_product(even, pga2.even_inverse(even)), np.tile(np.eye(4)[0], (N, 1)), 1e-10)
    clear = np.abs(np.cos((angle - other) / 2)) > 1e-3
    for sign in (1, -1):
        close(pga2.blend_motors(a, sign * b, 0.0), a, 1e-14)
        up_to_sign(pga2.blend_motors(a, sign * b, 0.5)[clear], pga2.interpolate_motors(a, b, 0.5)[clear], 1e-12)
    z = along(rng.uniform(0.1, 9, N), np.stack([np.cos(angle), np.sin(angle)], -1))
    rotors = pga2.rotor_from_complex(z)
    up_to_sign(rotors, pga2.rotor_from_angle(angle), 1e-15)
    close(pga2.rotor_to_complex(rotors), np.stack([np.cos(angle), np.sin(angle)], -1), 1e-15)
    off = np.resize(TINY, N)
    for turned in (angle, np.pi - off, off, np.full(N, np.pi)):
        n = np.stack([np.cos(other), np.sin(other)], -1)
        m = np.stack([np.cos(other + turned), np.sin(other + turned)], -1)
        one, two = plane_of(n, p), plane_of(m, s)
        close(pga2.move_line(pga2.motor_between_lines(one, two), one), two, 1e-10)


def test_poses_of_this_file(rng: np.random.Generator) -> None:
    """Test the poses of this file: they include translations, half turns and the identity."""
    matrices = poses(rng)
    still = np.abs(matrices - np.eye(4)).max((1, 2))
    assert still.min() < 1e-15 and np.sum(np.trace(matrices, axis1=1, axis2=2) < 1e-12) >= 4
    p = rng.normal(size=(N, 3))
    close(apply(matrices, p), turn(matrices, p) + matrices[:, :3, 3], 0)
    close(pose(Rotation.identity(2), np.zeros((2, 3))), np.tile(np.eye(4), (2, 1, 1)), 0)
