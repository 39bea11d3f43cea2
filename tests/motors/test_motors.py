"""Means, interpolation, splines, fits and Euler angles against scipy, closed forms and derivatives by differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp
from toolkit_truth import (
    TINY,
    N,
    along,
    apply,
    close,
    directions,
    dot,
    length,
    line_of,
    plane_of,
    poses,
    turn,
    unit,
    up_to_sign,
)  # fmt: skip

from algorithms.motors import (
    SEQUENCES,
    MotorSpline,
    average_motors,
    bezier,
    matrix_from_euler,
    matrix_to_euler,
    mean_motor,
    motor_from_objects,
    motor_from_points,
    nlerp,
    rotor_from_euler,
    rotor_from_frames,
    rotor_from_vectors,
    rotor_to_euler,
    sclerp,
    similarity_from_points,
    slerp,
)
from generated import cga3, pga3
from tests.support.all_cases import all_cases


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(303)


def rotor_of(rotation: Rotation) -> np.ndarray:
    """1 e12 e13 e23 of scipy's rotations: w, -z, y, -x."""
    x, y, z, w = np.moveaxis(rotation.as_quat(), -1, 0)
    return np.stack([w, -z, y, -x], -1)


def near(rng: np.random.Generator, centre: np.ndarray, spread: float, n: int) -> np.ndarray:
    """Motors about one, with any signs."""
    twists = rng.normal(size=(n, 6)) * spread
    moved = pga3.motor_product(centre, pga3.motor_from_twist(twists))
    return np.asarray(moved * rng.choice([-1.0, 1.0], (n, 1)))


# Means


def test_the_mean_of_rotations_is_that_of_scipy(rng: np.random.Generator) -> None:
    for spread in (1e-6, 0.3, 0.8):
        rotation = Rotation.from_rotvec([0.3, -2, 1]) * Rotation.from_rotvec(rng.normal(size=(50, 3)) * spread)
        weights = rng.uniform(0, 2, 50)
        motors = np.concatenate([rotor_of(rotation), np.zeros((50, 4))], -1) * rng.choice([-1, 1], (50, 1))
        centre = rotor_of(rotation.mean(weights))
        aligned = along(np.sign(motors[:, :4] @ centre), motors[:, :4])
        up_to_sign(average_motors(motors, weights)[:4], unit(weights @ aligned), 1e-14)
        up_to_sign(average_motors(motors, weights)[:4], centre, 5e-2 * spread**2 + 1e-14)
        found = mean_motor(motors, weights)
        assert found.converged and found.iterations < 40
        steps = (Rotation.from_matrix(pga3.rotor_to_matrix(found.motor[:4])).inv() * rotation).as_rotvec()
        close(weights @ steps / weights.sum(), 0, 1e-14)


def test_the_mean_is_equivariant_under_motions_from_both_sides(rng: np.random.Generator) -> None:
    a, b = pga3.motor_from_matrix(poses(rng)[100:102])
    motors = near(rng, a, 0.4, 30)
    weights = rng.uniform(0.1, 1, 30)
    mean = mean_motor(motors, weights).motor
    left = mean_motor(pga3.motor_product(b, motors), weights).motor
    right = mean_motor(pga3.motor_product(motors, b), weights).motor
    up_to_sign(left, pga3.motor_product(b, mean), 1e-13)
    up_to_sign(right, pga3.motor_product(mean, b), 1e-13)
    signs = np.resize([1, -1, -1], (30, 1))
    up_to_sign(mean_motor(signs * motors, weights).motor, mean, 1e-14)
    up_to_sign(average_motors(signs * motors, weights), average_motors(motors, weights), 1e-14)


def test_means_of_one_two_and_translations(rng: np.random.Generator) -> None:
    a, b = pga3.motor_from_matrix(poses(rng)[200:202])
    up_to_sign(average_motors(a[None]), a, 1e-15)
    up_to_sign(mean_motor(-a[None]).motor, a, 1e-14)
    once = mean_motor(a[None], max_iterations=1)
    assert once.converged and once.iterations == 1
    up_to_sign(average_motors([a, -b]), pga3.interpolate_motors(a, b, 0.5), 1e-13)
    up_to_sign(mean_motor([a, -b], [3, 1]).motor, pga3.interpolate_motors(a, b, 0.25), 1e-13)
    t = rng.normal(size=(20, 3)) * 1e3
    motors = pga3.motor_from_rotor_translation([1.0, 0, 0, 0], t)
    for mean in (average_motors(motors), mean_motor(motors).motor):
        close(-2 * mean[4:7] * mean[0], t.mean(0), 1e-9)
    batch = near(rng, a, 0.2, 12).reshape(3, 4, 8)
    close(average_motors(batch), [average_motors(each) for each in batch], 1e-15)


def test_a_mean_that_does_not_exist_is_not_claimed(rng: np.random.Generator) -> None:
    """Three thirds of a turn about one axis have no single mean rotation."""
    motors = pga3.motor_from_line(line_of(np.zeros(3), np.array([0.0, 0, 1])), 2 * np.pi / 3 * np.arange(3))
    wobble = pga3.motor_product(motors, pga3.motor_from_twist(rng.normal(size=(3, 6)) * 1e-3))
    assert not mean_motor(wobble, max_iterations=2).converged


def test_means_check_their_arguments() -> None:
    motors = np.tile(np.eye(8)[0], (3, 1))
    for weights in ([1, 1], [1, -1, 1], [0, 0, 0], [1, np.inf, 1]):
        with pytest.raises(ValueError, match="weights"):
            average_motors(motors, weights)
    with pytest.raises(ValueError, match="motors: none"):
        mean_motor(np.zeros((0, 8)))
    with pytest.raises(ValueError, match="one set"):
        mean_motor(motors[None])
    with pytest.raises(ValueError, match="max_iterations"):
        mean_motor(motors, max_iterations=0)
    with pytest.raises(ValueError, match=r"motors: nan at \(1, 0\); expected finite"):
        mean_motor(motors * [[1], [np.nan], [1]])


# Interpolation


def test_slerp_equals_that_of_scipy_and_signs_do_not_matter(rng: np.random.Generator) -> None:
    rotation = Rotation.from_rotvec(along(rng.uniform(0, 3, 40), directions(rng, 40)))
    t = np.linspace(0, 1, 11)
    for k in range(0, 40, 2):
        expected = Slerp([0, 1], rotation[k : k + 2])(t).as_matrix()
        a, b = rotor_of(rotation[k : k + 2])
        for sign in (1, -1):
            close(pga3.rotor_to_matrix(slerp(a, sign * b, t)), expected, 1e-13)


def test_screw_interpolation_is_uniform_and_independent_of_signs(rng: np.random.Generator) -> None:
    first, second = poses(rng), poses(rng)[::-1]
    a, b = pga3.motor_from_matrix(first), pga3.motor_from_matrix(second)
    clear = np.abs(dot(a[:, :4], b[:, :4])) > 1e-6
    for sign in (1, -1):
        close(pga3.motor_to_matrix(sclerp(a, sign * b, 0.0)), first, 1e-13)
        close(pga3.motor_to_matrix(sclerp(a, sign * b, 1.0)), second, 1e-12)
        quarter = np.linalg.inv(first) @ pga3.motor_to_matrix(sclerp(a, sign * b, 0.25))
        done = (first @ quarter @ quarter @ quarter @ quarter)[clear]
        close(done, second[clear], 1e-8)
        up_to_sign(nlerp(a, sign * b, 1.0), b, 1e-13)
        blended = nlerp(a, sign * b, 0.4)
        close(dot(blended[:, :4], blended[:, :4]), 1, 1e-14)
        w, z, y, x, u, v, r, i = blended.T
        close(w * i - z * r + y * v - x * u, 0, 1e-11)


def test_bezier_curves_start_and_end_along_their_controls(rng: np.random.Generator) -> None:
    controls = near(rng, pga3.motor_from_matrix(poses(rng)[300]), 0.5, 4)
    up_to_sign(bezier(controls, 0.0), controls[0], 1e-14)
    up_to_sign(bezier(controls, 1.0), controls[3], 1e-13)
    h = 1e-5
    start = pga3.motor_to_twist(pga3.motor_relative(bezier(controls, 0.0), bezier(controls, h))) / h
    close(start, 3 * pga3.motor_to_twist(pga3.motor_relative(controls[0], controls[1])), 1e-3)
    up_to_sign(bezier(controls[:2], 0.3), sclerp(controls[0], controls[1], 0.3), 1e-14)
    t = rng.normal(size=(4, 3))
    straight = pga3.motor_from_rotor_translation([1.0, 0, 0, 0], t)
    s = np.linspace(0, 1, 7)[:, None]
    weights = np.concatenate([(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s * s * (1 - s), s**3], -1)
    close(-2 * bezier(straight, s[:, 0])[:, 4:7], weights @ t, 1e-14)
    up_to_sign(bezier(controls * [[1], [-1], [-1], [1]], s[:, 0]), bezier(controls, s[:, 0]), 1e-13)
    with pytest.raises(ValueError, match="controls"):
        bezier(np.zeros((0, 8)), 0.5)


def velocity(spline: MotorSpline, t: np.ndarray, h: float) -> np.ndarray:
    return np.asarray(pga3.motor_to_twist(pga3.motor_relative(spline(t), spline(t + h))) / h)


def test_splines_go_through_motors_with_continuous_velocity(rng: np.random.Generator) -> None:
    times = np.cumsum(rng.uniform(0.5, 2, 12))
    steps = pga3.motor_from_twist(rng.normal(size=(12, 6)) * 0.5)
    motors = [np.eye(8)[0]]
    for step in steps[1:]:
        motors.append(pga3.motor_product(motors[-1], step))
    given = np.array(motors)
    signs = rng.choice([-1, 1], (12, 1))
    spline = MotorSpline.through(times, given * signs)
    up_to_sign(spline(times), given, 1e-13)
    t = np.linspace(times[0], times[-1], 200)
    up_to_sign(MotorSpline.through(times, given)(t), spline(t), 1e-13)
    assert (np.einsum("ni,ni->n", spline(t)[:-1, :4], spline(t)[1:, :4]) > 0).all()
    for h, tolerance in ((1e-4, 3e-3), (1e-6, 3e-5)):
        close(velocity(spline, times[1:-1], h), velocity(spline, times[1:-1], -h), tolerance)
        close(velocity(spline, times[1:-1], h), spline.twists[1:-1], tolerance)
    moved = pga3.motor_from_matrix(poses(rng)[400])
    up_to_sign(
        MotorSpline.through(times, pga3.motor_product(moved, given))(t), pga3.motor_product(moved, spline(t)), 1e-12
    )


def test_splines_keep_constant_twists_and_parabolas(rng: np.random.Generator) -> None:
    times = np.cumsum(rng.uniform(0.1, 0.5, 8))
    twist = rng.normal(size=6)
    screw = pga3.motor_from_twist(along(times, twist[None]))
    t = np.linspace(times[0] - 0.1, times[-1] + 0.1, 50)
    up_to_sign(MotorSpline.through(times, screw)(t), pga3.motor_from_twist(along(t, twist[None])), 1e-12)
    up_to_sign(MotorSpline.through(times[:2], screw[:2])(t), pga3.motor_from_twist(along(t, twist[None])), 1e-12)
    c = rng.normal(size=(3, 3))
    shift = pga3.motor_from_rotor_translation([1.0, 0, 0, 0], np.vander(times, 3) @ c)
    close(-2 * MotorSpline.through(times, shift)(t)[:, 4:7], np.vander(t, 3) @ c, 1e-13)
    rates = np.tile(twist, (8, 1))
    up_to_sign(MotorSpline.through(times, screw, rates)(t), pga3.motor_from_twist(along(t, twist[None])), 1e-12)
    with pytest.raises(ValueError, match="increasing"):
        MotorSpline.through(times[::-1], screw)
    with pytest.raises(ValueError, match="n > 1"):
        MotorSpline.through(times[:1], screw[:1])


# Fits


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_clean_vectors_and_points_give_the_motion_back(rng: np.random.Generator, scale: float) -> None:
    matrices = poses(rng, size=scale)
    a = rng.normal(size=(N, 6, 3)) * scale
    turned = np.einsum("nij,nkj->nki", matrices[:, :3, :3], a)
    fit = rotor_from_vectors(a, turned)
    close(pga3.rotor_to_matrix(fit.rotor), matrices[:, :3, :3], 1e-13)
    close(fit.residual, 0, 1e-14 * scale * 10)
    assert fit.determined.all() and np.all(fit.rotor[:, 0] >= 0)
    motion = motor_from_points(a, turned + matrices[:, None, :3, 3])
    close(pga3.motor_to_matrix(motion.motor)[:, :3, :3], matrices[:, :3, :3], 1e-13)
    close(pga3.motor_to_matrix(motion.motor)[:, :3, 3], matrices[:, :3, 3], 1e-13 * scale)
    close(motion.residual, 0, 1e-14 * scale * 10)
    assert motion.determined.all()
    two = rotor_from_vectors(a[:, :2], turned[:, :2])
    assert two.determined.mean() > 0.99
    close(pga3.rotor_to_matrix(two.rotor)[two.determined], matrices[two.determined, :3, :3], 1e-7)


def test_the_form_of_rotations_is_the_product_of_turned_vectors(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, N, 3))
    matrices = poses(rng)
    rotors = rotor_of(Rotation.from_matrix(matrices[:, :3, :3]))
    forms = pga3.rotation_form(a, b)
    close(np.einsum("ni,nij,nj->n", rotors, forms, rotors), dot(b, turn(matrices, a)), 1e-14)
    close(forms, np.swapaxes(forms, -1, -2), 0)


def test_noisy_vectors_give_the_optimum_of_scipy(rng: np.random.Generator) -> None:
    for _ in range(50):
        a, weights = rng.normal(size=(20, 3)), rng.uniform(0.1, 2, 20)
        angle = rng.choice([np.pi, np.pi - 1e-9, rng.uniform(0, np.pi)])
        b = Rotation.from_rotvec(angle * directions(rng, 7)[-1]).apply(a) + 0.3 * rng.normal(size=(20, 3))
        fit = rotor_from_vectors(a, b, weights)
        truth, distance = Rotation.align_vectors(b, a, weights)
        close(pga3.rotor_to_matrix(fit.rotor), truth.as_matrix(), 1e-12)
        close(fit.residual, distance / np.sqrt(weights.sum()), 1e-12)
        shift = rng.normal(size=3)
        motion = motor_from_points(a, b + shift, weights)
        share = weights / weights.sum()
        centred = Rotation.align_vectors(b - share @ b, a - share @ a, weights)[0].as_matrix()
        matrix = pga3.motor_to_matrix(motion.motor)
        close(matrix[:3, :3], centred, 1e-12)
        close(matrix[:3, 3], share @ b + shift - centred @ (share @ a), 1e-12)


def test_reflected_points_give_a_rotation(rng: np.random.Generator) -> None:
    a = rng.normal(size=(10, 3))
    fit = rotor_from_vectors(a, -a)
    matrix = pga3.rotor_to_matrix(fit.rotor)
    close(np.linalg.det(matrix), 1, 1e-14)
    close(matrix, Rotation.align_vectors(-a, a)[0].as_matrix(), 1e-12)


def test_data_that_do_not_determine_the_motion_are_reported(rng: np.random.Generator) -> None:
    d = directions(rng, 10)
    s = rng.normal(size=(10, 5))
    parallel = s[..., None] * d[:, None]
    fit = rotor_from_vectors(parallel, parallel[:, :, ::-1])
    assert not fit.determined.any()
    close(fit.residual, 0, 1e-13)
    assert not rotor_from_vectors(np.zeros((3, 3)), np.ones((3, 3))).determined
    motion = motor_from_points(parallel + 1, parallel + 2)
    assert not motion.determined.any()
    close(motion.residual, 0, 1e-13)
    assert not motor_from_points([[1, 2, 3]], [[3, 2, 1]]).determined
    assert rotor_from_vectors(np.eye(3)[:2], np.eye(3)[:2]).determined
    with pytest.raises(ValueError, match="3 and 2 vectors"):
        rotor_from_vectors(np.eye(3), np.eye(3)[:2])
    with pytest.raises(ValueError, match="weights"):
        motor_from_points(np.eye(3), np.eye(3), [-1, 1, 1])


@pytest.mark.parametrize("noise", [0.0, 0.1, 3.0])
def test_similarities_are_those_of_umeyama(rng: np.random.Generator, noise: float) -> None:
    """Singular values, with the sign that gives a rotation; with much noise the optimum would be a reflection."""
    n, count = 1000, 6
    matrices, scales = poses(rng, n), np.exp(rng.normal(size=n))
    a, weights = rng.normal(size=(n, count, 3)), rng.uniform(0.1, 1, (n, count))
    b = scales[:, None, None] * apply(matrices[:, None], a) + noise * rng.normal(size=a.shape)
    fit = similarity_from_points(a, b, weights)
    share = (weights / weights.sum(-1, keepdims=True))[..., None]
    start, end = ((share * x).sum(1, keepdims=True) for x in (a, b))
    left, sizes, right = np.linalg.svd(np.swapaxes(share * (b - end), -1, -2) @ (a - start))
    sizes[:, 2] *= np.sign(np.linalg.det(left) * np.linalg.det(right))
    left[..., 2] *= np.sign(np.linalg.det(left) * np.linalg.det(right))[:, None]
    scale = sizes.sum(-1) / (share * (a - start) ** 2).sum((-1, -2))
    wanted = scale[:, None, None] * (a - start) @ np.swapaxes(left @ right, -1, -2) + end
    assert fit.determined.all()
    close(fit.scale, scale, 1e-12 * scale.max())
    close(cga3.transform_point(fit.versor[:, None], a), wanted, 1e-9)
    close(fit.residual, np.sqrt((share * (b - wanted) ** 2).sum((-1, -2))), 1e-11)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("count", [1, 3, 5, 7, 9999])
def test_no_similarity_of_points_that_are_all_the_same(count: int, dtype: type, rng: np.random.Generator) -> None:
    """Test also points whose mean is rounded, such as that of five times 0.1."""
    other = rng.normal(size=(count, 3)).astype(dtype)
    weights = rng.uniform(0.1, 1, count).astype(dtype)
    for point in ((0.1, 0.3, 1.7), (1e6 + 0.1, -0.7, 1 / 3), (0, 0, 0)):
        same = np.tile(np.array(point, dtype), (count, 1))
        for a, b in ((same, other), (other, same), (same, same)):
            for share in (None, weights):
                fit = similarity_from_points(a, b, share)
                assert not fit.determined and fit.scale == 0 and np.isnan(fit.versor).all()
    # what is far less than their distance from the origin, and yet no rounding, has one
    near = np.array([0.1, 0.3, 1.7]) + 1e-11 * np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3), (1, 1, 1)])
    fit = similarity_from_points(near, 3 * near)
    assert fit.determined and abs(fit.scale - 3) < 1e-3


@all_cases(
    "kinds",
    [
        *("points", "lines", "planes", "spheres", "circles"),
        *("points lines", "points planes", "lines planes", "points spheres", "planes circles", "all"),
    ],
)
def test_motors_from_objects_of_all_kinds(rng: np.random.Generator, kinds: str) -> None:
    """Exact objects, moved by matrices: points by them, lines by two points, planes by their normal and a point."""
    chosen = ["points", "lines", "planes", "spheres", "circles"] if kinds == "all" else kinds.split()
    n, count = 200, 4
    matrices = poses(rng, n)
    p, q, d = rng.normal(size=(3, n, count, 3))
    moved, there = (apply(matrices[:, None], x) for x in (p, q))
    radii = rng.uniform(0.1, 4, size=(n, count))
    pairs = {
        "points": (p, moved),
        "lines": (line_of(p, q - p), line_of(moved, there - moved)),
        "planes": (plane_of(d, p), plane_of(turn(matrices[:, None], d), moved)),
        "spheres": tuple(cga3.sphere_from_centre_radius_squared(x, radii) for x in (p, moved)),
        "circles": tuple(
            cga3.circle_from_centre(x, normal, radii) for x, normal in ((q, d), (there, turn(matrices[:, None], d)))
        ),
    }
    found = motor_from_objects(**{name: pairs[name] for name in chosen})
    assert found.determined.all()
    close(found.residual, 0.0, 1e-11)
    close(pga3.motor_to_matrix(found.motor), matrices, 1e-9)


def test_motors_from_noisy_points_and_objects_that_are_too_few(rng: np.random.Generator) -> None:
    a = rng.normal(size=(50, 12, 3))
    b = a @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + 0.1 * rng.normal(size=a.shape)
    one, two = motor_from_objects(points=(a, b)), motor_from_points(a, b)
    close(one.motor, two.motor, 1e-11)
    close(one.residual, two.residual, 1e-11)
    line = line_of(a[:, :1], b[:, :1])
    assert not motor_from_objects(lines=(line, line)).determined.any(), "it may slide along and turn about itself"
    plane = plane_of(a[:, :2], b[:, :2])
    assert not motor_from_objects(planes=(plane, plane)).determined.any(), "two planes slide along their line"
    with pytest.raises(ValueError, match="none; expected at least one object"):
        motor_from_objects()
    one = cga3.circle_from_centre(a[:, :1], b[:, :1], np.ones((50, 1)))
    assert not motor_from_objects(circles=(one, one)).determined.any(), "it may turn about its axis"
    for call in (rotor_from_vectors, motor_from_points, lambda *ends: motor_from_objects(points=ends)):
        with pytest.raises(ValueError, match=r"nan at .*expected finite"):
            call(a[0], b[0] * [1, np.nan, 1])
    with pytest.raises(ValueError, match="lines: 1 and 2 objects"):
        motor_from_objects(lines=(np.ones((1, 6)), np.ones((2, 6))))


def test_rotors_from_oblique_frames(rng: np.random.Generator) -> None:
    matrices = poses(rng)[:, :3, :3]
    frames = np.eye(3) + 0.4 * rng.normal(size=(N, 3, 3))
    good = np.linalg.cond(frames) < 50
    frames, matrices = frames[good], matrices[good]
    rotors = rotor_from_frames(frames, np.einsum("nij,nkj->nki", matrices, frames))
    close(pga3.rotor_to_matrix(rotors), matrices, 1e-13)
    assert good.sum() > 800
    assert np.isnan(rotor_from_frames([[1, 0, 0], [0, 1, 0], [1, 1, 0]], np.eye(3))).all()


# Euler angles


@all_cases("fixed_axes", [False, True])
@all_cases("sequence", SEQUENCES)
def test_euler_angles_are_those_of_scipy(rng: np.random.Generator, sequence: str, fixed_axes: bool) -> None:
    name = sequence if fixed_axes else sequence.upper()
    proper = sequence[0] == sequence[2]
    first, third = rng.uniform(-np.pi, np.pi, (2, N))
    second = rng.uniform(0.01, np.pi - 0.01, N) - (0 if proper else np.pi / 2)
    given = np.stack([first, second, third], -1)
    rotation = Rotation.from_euler(name, given)
    rotors = rotor_from_euler(sequence, given, fixed_axes=fixed_axes)
    up_to_sign(rotors, rotor_of(rotation), 1e-14)
    close(matrix_from_euler(sequence, given, fixed_axes=fixed_axes), rotation.as_matrix(), 1e-14)
    for sign in (1, -1):
        close(rotor_to_euler(sequence, sign * rotors, fixed_axes=fixed_axes), given, 1e-13)
    close(matrix_to_euler(sequence, rotation.as_matrix(), fixed_axes=fixed_axes), given, 3e-13)
    close(rotor_to_euler(sequence, rotors, fixed_axes=fixed_axes), rotation.as_euler(name), 1e-12)


@all_cases("fixed_axes", [False, True])
@all_cases("sequence", SEQUENCES)
def test_euler_angles_in_gimbal_lock(rng: np.random.Generator, sequence: str, fixed_axes: bool) -> None:
    """In gimbal lock the third angle of moving axes is 0, as in scipy; near it the rotation has an error of 1e-14."""
    name = sequence if fixed_axes else sequence.upper()
    ends = np.array([0, np.pi]) - (0 if sequence[0] == sequence[2] else np.pi / 2)
    first, third = rng.uniform(-np.pi, np.pi, (2, N))
    inward = np.resize(TINY, N) * np.where(np.arange(N) % 2, -1, 1)
    second = ends[np.arange(N) % 2] + inward
    rotation = Rotation.from_euler(name, np.stack([first, second, third], -1))
    found = rotor_to_euler(sequence, rotor_of(rotation), fixed_axes=fixed_axes)
    close(Rotation.from_euler(name, found).as_matrix(), rotation.as_matrix(), 2e-14)
    close(found[:, 1], second, 1e-14)
    assert np.all(np.abs(found[:, ::2]) <= np.pi)
    locked = np.resize(TINY, N) == 0
    assert np.all(found[locked, 0 if fixed_axes else 2] == 0)
    with pytest.warns(UserWarning, match="[Gg]imbal"):
        expected = rotation[locked].as_euler(name)
    turned = Rotation.from_euler(name, expected).as_matrix()
    close(Rotation.from_euler(name, found[locked]).as_matrix(), turned, 1e-13)


def test_euler_angles_about_any_orthogonal_axes(rng: np.random.Generator) -> None:
    frames = np.swapaxes(poses(rng)[:, :3, :3], -1, -2)
    a, b, c = frames[:, 0], frames[:, 1], frames[:, 2]
    first, third = rng.uniform(-np.pi, np.pi, (2, N))
    second = rng.uniform(0.01, np.pi - 0.01, N)
    for axes, kernel, middle in (
        ((a, b, a), pga3.rotor_to_proper_euler_angles, second),
        ((a, b, c), pga3.rotor_to_tait_bryan_angles, second - np.pi / 2),
    ):
        given = np.stack([first, middle, third], -1)
        turns = [Rotation.from_rotvec(along(angle, axis)) for angle, axis in zip(given.T, axes, strict=True)]
        rotors = pga3.rotor_from_euler_angles(*axes, given)
        up_to_sign(rotors, rotor_of(turns[0] * turns[1] * turns[2]), 1e-14)
        close(kernel(rotors, a, b), given, 1e-13)


def test_euler_sequences_are_checked() -> None:
    with pytest.raises(ValueError, match="sequence: 'xxy'; expected one of xyz"):
        rotor_from_euler("xxy", [0, 0, 0])
    with pytest.raises(ValueError, match="angles: shape"):
        rotor_from_euler("xyz", [0, 0])


def test_helpers_of_this_file(rng: np.random.Generator) -> None:
    """Test `rotor_of` by the action of its rotors on vectors."""
    matrices = poses(rng)
    p = rng.normal(size=(N, 3))
    rotors = rotor_of(Rotation.from_matrix(matrices[:, :3, :3]))
    motors = pga3.motor_from_rotor_translation(rotors, matrices[:, :3, 3])
    close(pga3.move_point(motors, p), apply(matrices, p), 1e-13)
    close(length(turn(matrices, p)), length(p), 1e-14)
