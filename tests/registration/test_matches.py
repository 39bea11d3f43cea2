"""Motions of matches, most of which are wrong, and the planes of joint space."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.registration import (
    RegistrationStatus,
    register,
    register_deformable,
    register_matches,
    separate_motions,
)
from algorithms.registration.weighted_matches import form_about_means
from generated import pga3
from generated import registration as kernels
from tests.support.all_cases import all_cases


def matches(seed, count, right, noise=0.005, scale=1.0):
    """Return matches, the first ones of them right, and the rotations of the groups."""
    rng = np.random.default_rng(seed)
    x, y, turns, row = rng.normal(size=(count, 3)), scale * rng.normal(size=(count, 3)), [], 0
    for k, group in enumerate(right):
        turns.append(Rotation.random(random_state=7 * seed + k).as_matrix())
        rows = slice(row, row + group)
        y[rows] = scale * x[rows] @ turns[-1].T + rng.normal(size=3) + noise * rng.normal(size=(group, 3))
        row += group
    return x, y, turns


def angle(motor, turn):
    return np.degrees(np.linalg.norm(Rotation.from_matrix(pga3.motor_to_matrix(motor)[:3, :3].T @ turn).as_rotvec()))


@pytest.mark.parametrize(("count", "right", "seeds"), [(1000, 100, 2), (300, 30, 4), (100, 10, 12)])
def test_nine_of_ten_matches_are_wrong(count, right, seeds):
    for seed in range(seeds):
        x, y, (turn,) = matches(seed, count, [right])
        found = register_matches(x, y)
        assert found.status == RegistrationStatus.OK and angle(found.motor, turn) < 0.5
        assert found.inliers[:right].mean() > 0.7 and found.inliers[right:].sum() <= 2


@pytest.mark.parametrize("noise", [0, 1e-15, 1e-6, 1e-4, 1e-3])
def test_every_right_match_is_found_whatever_the_noise(noise):
    # Probabilities of a hundred near matches underflow, and rounding errors are no distribution of noise.
    for seed in range(4):
        x, y, _ = matches(seed, 1000, [100], noise=noise)
        found = register_matches(x, y)
        assert found.inliers[:100].sum() >= 95 and found.inliers[100:].sum() <= 2


@pytest.mark.parametrize("similarity", [False, True])
def test_inliers_are_within_the_tolerance(similarity):
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (100, 3))
    y = Rotation.random(random_state=0).apply(x) + 1e-7 * rng.normal(size=x.shape)
    for tolerance in (1e-7, 2e-7):
        found = register_matches(x, y, tolerance=tolerance, similarity=similarity)
        off = np.linalg.norm(pga3.move_point(found.motor, found.scale * x) - y, axis=1)
        assert found.status == RegistrationStatus.OK and found.inliers.sum() > 5
        assert off[found.inliers].max() <= tolerance


def test_wrong_matches_alone_are_no_motion():
    for count, seeds in ((10, 12), (20, 12), (300, 2)):
        for seed in range(seeds):
            x, y, _ = matches(seed, count, [])
            found = register_matches(x, y)
            assert found.status == RegistrationStatus.NO_SUPPORT and not found.inliers.any(), (count, seed)


def test_two_motions_are_separated():
    for seed in range(2):
        x, y, turns = matches(seed, 600, [100, 80])
        found = separate_motions(x, y)
        near = [min(range(2), key=lambda k, m=m: angle(m.motor, turns[k])) for m in found]
        assert sorted(near) == [0, 1], seed
        assert all(angle(m.motor, turns[k]) < 0.5 for m, k in zip(found, near, strict=True)), seed


@pytest.mark.parametrize("scale", [0.4, 2.5])
def test_similarity(scale):
    x, y, (turn,) = matches(3, 250, [60], scale=scale)
    found = register_matches(x, y, similarity=True)
    assert found.status == RegistrationStatus.OK and abs(found.scale / scale - 1) < 0.01
    assert angle(found.motor, turn) < 0.5
    assert scale < 1 or register_matches(x, y).status == RegistrationStatus.NO_SUPPORT


def test_degenerate_matches():
    rng = np.random.default_rng(1)
    assert register_matches(np.zeros((3, 3)), np.zeros((3, 3))).status == RegistrationStatus.TOO_FEW_POINTS
    line = rng.random((50, 1)) * [1.0, 2.0, 2.0]
    assert register_matches(line, line + 1).status in (RegistrationStatus.COLLINEAR, RegistrationStatus.NO_SUPPORT)
    with pytest.raises(ValueError, match="one row per match"):
        register_matches(np.zeros((5, 3)), np.zeros((6, 3)))


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_matches_on_a_line_are_free_about_it_and_those_in_a_plane_are_not(noise):
    rng = np.random.default_rng(1)
    turn, shift = Rotation.random(random_state=2).as_matrix(), np.array([5.0, -1.0, 2.0])
    for dimensions in (1, 2):
        x = rng.normal(size=(60, 3)) * (np.arange(3) < dimensions)
        y = x @ turn.T + shift + noise * rng.normal(size=x.shape)
        found = register_matches(x, y)
        assert np.linalg.norm(pga3.move_point(found.motor, x) - y, axis=1).max() < 5 * noise + 1e-9
        if dimensions == 2:
            assert found.status == RegistrationStatus.OK and angle(found.motor, turn) < 0.2 and not len(found.free)
        else:
            assert found.status == RegistrationStatus.COLLINEAR and found.free.shape == (1, 6)
            other = pga3.motor_product(pga3.motor_exponential(0.8 * found.free[0]), found.motor)
            assert np.linalg.norm(pga3.move_point(other, x) - y, axis=1).max() < 5 * noise + 1e-9
            assert np.allclose(np.linalg.norm(found.free[0, :3]), 1)


@pytest.mark.parametrize("rotation", [0.0, 0.7, np.pi])
def test_matches_of_one_motion_are_on_three_planes_with_one_rotor(rotation):
    rng = np.random.default_rng(5)
    x = rng.normal(size=(20, 3))
    turn, shift = Rotation.from_rotvec([0, 0.6 * rotation, 0.8 * rotation]), np.array([1.0, -2.0, 0.5])
    y = turn.apply(x) + shift
    form, x_mean, y_mean = form_about_means(x, y, np.ones(20))
    assert np.allclose([x_mean, y_mean], [x.mean(0), y.mean(0)], atol=1e-15)
    values, vectors = np.linalg.eigh(form)
    assert abs(values[0]) < 1e-12 * values[3]
    motor = kernels.motor_of_rotor(vectors[:, 0], x_mean, y_mean)
    assert np.allclose(pga3.move_point(motor, x), y, atol=1e-12)
    points, planes = kernels.joint_points(x, y), kernels.joint_planes(motor)
    assert np.allclose(np.einsum("nij,ij->ni", points, planes[:, :3]) + planes[:, 3], 0, atol=1e-12)
    assert np.allclose(kernels.screw_plane_value(x, y, motor), 0, atol=1e-12)
    # Coordinates are a difference and, up to sign, two sums.
    assert np.allclose(np.sort(np.abs(points[:, 0])), np.sort(np.abs(np.stack(
        [y[:, 0] - x[:, 0], y[:, 1] + x[:, 1], y[:, 2] + x[:, 2]], 1
    ))))  # fmt: skip


def test_lengths_of_pairs_are_equal_for_rigid_motions():
    rng = np.random.default_rng(6)
    x = rng.normal(size=(9, 3))
    y = Rotation.random(random_state=1).apply(x) + 3
    one, two = kernels.lengths_of_pairs(x[0], y[0], x, y)
    assert np.allclose(one, np.linalg.norm(x - x[0], axis=1)) and np.allclose(one, two)


@all_cases("scale", [1e200, 1e-200])
@all_cases("function", [register, register_matches, register_deformable])
def test_coordinates_whose_squares_are_no_numbers_are_rejected(function, scale):
    points = np.random.default_rng(8).normal(size=(60, 3))
    with pytest.raises(ValueError, match=r"source: coordinates up to .* expected a unit"):
        function(scale * points, points)


@pytest.mark.parametrize("seed", [20, 21])
def test_five_motions_eight_degrees_apart_do_not_merge(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis *= np.radians(8) / np.linalg.norm(axis)
    x = rng.uniform(-1, 1, (600, 3))
    label = np.repeat(np.arange(5), 120)
    y = np.concatenate([Rotation.from_rotvec(k * axis).apply(x[label == k]) for k in range(5)])
    y += rng.normal(0, 0.005, y.shape) + 0.05 * label[:, None]
    wrong = rng.random(600) < 0.3
    y[wrong] = rng.uniform(-1, 1, (wrong.sum(), 3))
    found = separate_motions(x, y)
    assert len(found) == 5
    assert len({int(np.bincount(label[motion.inliers]).argmax()) for motion in found}) == 5
    assert all(np.bincount(label[motion.inliers]).max() > 0.95 * motion.inliers.sum() for motion in found)


def test_a_full_cloud_with_much_noise_is_not_on_a_line() -> None:
    rng = np.random.default_rng(3)
    x = rng.normal(size=(700, 3)) * [32, 31, 30]
    y = Rotation.random(rng=1).apply(x) + rng.normal(0, 5, x.shape)
    assert register_matches(x, y).status is RegistrationStatus.OK
    line = np.outer(rng.uniform(-1, 1, 60), [10, 20, 20])
    assert register_matches(line, line + rng.normal(0, 0.1, line.shape)).status is RegistrationStatus.COLLINEAR


@pytest.mark.parametrize("levels", [(0.004, 0.004), (0.004, 0.03), (0.002, 0.02)])
def test_levels_of_noise_are_not_motions(levels):
    """Half of the matches of one motion are noisier than the others; a third more are wrong."""
    rng = np.random.default_rng(31)
    x = rng.normal(size=(450, 3))
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    y = x @ turn.T + rng.choice(levels, (450, 1)) * rng.normal(size=(450, 3))
    y[300:] = rng.normal(size=(150, 3))
    (found,) = separate_motions(x, y)
    matrix = pga3.motor_to_matrix(found.motor)
    np.testing.assert_allclose(matrix[:3, :3], turn, atol=0.01)
    assert found.inliers.sum() > 50 and found.inliers[300:].mean() < 0.05


def test_random_matches_of_voxels_are_no_motion_and_right_ones_are_found():
    # The centres of voxels coincide exactly with many others after wrong motions of the lattice.
    rng = np.random.default_rng(31)
    for sites in (5, 9):
        x, y = (rng.integers(0, sites, (150, 3)).astype(float) for _ in range(2))
        assert register_matches(x, y).status == RegistrationStatus.NO_SUPPORT
    x = np.unique(np.round(8 * rng.normal(size=(150, 3)) * [1, 0.8, 0.5]), axis=0)
    turn = Rotation.random(random_state=5).as_matrix()
    y = np.round(x @ turn.T + 3.3)
    y[: len(x) // 3] = rng.permutation(y)[: len(x) // 3]
    found = register_matches(x, y)
    assert found.status == RegistrationStatus.OK and angle(found.motor, turn) < 2
    assert found.inliers[len(x) // 3 :].mean() > 0.9


def test_few_exact_matches_of_a_lattice_determine_the_motion():
    corners = np.stack(np.meshgrid([0.0, 1], [0.0, 1], [0.0, 1]), -1).reshape(-1, 3)
    board = np.stack(np.meshgrid(range(3), range(3), [0]), -1).reshape(-1, 3)
    turn = Rotation.random(random_state=6)
    for points in (corners, board):
        found = register_matches(points, turn.apply(points))
        assert found.status == RegistrationStatus.OK and found.inliers.all()
        assert angle(found.motor, turn.as_matrix()) < 1e-6


def test_exact_matches_of_a_lattice_are_found_among_wrong_ones():
    # Points are several steps apart, or three steps on each side are all that wrong partners can have.
    rng = np.random.default_rng(33)
    cube = np.stack(np.meshgrid(range(3), range(3), range(3)), -1).reshape(-1, 3) * 1.0
    for points, n_wrong in ((rng.integers(-10, 10, (12, 3)) * 0.05, 3), (rng.permutation(cube), 5)):
        for seed in range(3):
            turn = Rotation.random(random_state=seed)
            partners = points.copy()
            partners[:n_wrong] = np.roll(points[:n_wrong], 1, axis=0)
            found = register_matches(points, turn.apply(partners))
            assert found.status == RegistrationStatus.OK and found.inliers.sum() == len(points) - n_wrong
            assert angle(found.motor, turn.as_matrix()) < 1e-6
            unrelated = turn.apply(rng.permutation(points))
            assert register_matches(points, unrelated).status == RegistrationStatus.NO_SUPPORT


def test_a_mirrored_cloud_is_named_and_a_plane_is_not():
    rng = np.random.default_rng(32)
    x = rng.normal(size=(120, 3)) * [1, 0.8, 0.4]
    turn = Rotation.random(random_state=7)
    mirrored = turn.apply(x * [1, 1, -1]) + 0.005 * rng.normal(size=x.shape)
    assert register_matches(x, mirrored).status == RegistrationStatus.MIRRORED
    assert register_matches(x * [1, 1, -1], mirrored).status == RegistrationStatus.OK
    flat = x * [1, 1, 0]
    moved = turn.apply(flat) + 0.005 * rng.normal(size=x.shape)
    moved[:40] = rng.normal(size=(40, 3))
    assert register_matches(flat, moved).status == RegistrationStatus.OK


def test_what_is_bent_has_no_motion() -> None:
    """A cloud on a cylinder, or that is longer in one direction, is DEFORMED; noise alone never is."""
    for k in range(8):
        rng = np.random.default_rng([k, 61])
        x, wrong = rng.normal(size=(250, 3)), rng.random(250) < 0.2
        turn, angle = Rotation.from_rotvec(rng.normal(size=3)), 0.3 * x[:, 0]
        bent = np.stack([np.sin(angle) / 0.3, x[:, 1], x[:, 2] + (1 - np.cos(angle)) / 0.3], 1)
        ok, deformed = RegistrationStatus.OK, RegistrationStatus.DEFORMED
        for there, status in ((x, ok), (x * [1.08, 1, 1], deformed), (bent, deformed)):
            y = turn.apply(there) + rng.normal(0, 0.005, x.shape)
            y[wrong] = rng.normal(size=(int(wrong.sum()), 3))
            assert [each.status for each in separate_motions(x, y)] == [status]


def test_repeated_matches_are_one_match():
    rng = np.random.default_rng(12)
    motor = pga3.motor_exponential(rng.normal(size=6))
    few, many = rng.normal(size=(4, 3)), rng.normal(size=(20, 3))
    for right, status in ((few, RegistrationStatus.NO_SUPPORT), (many, RegistrationStatus.OK)):
        x = np.concatenate([right, rng.normal(size=(40, 3))])
        y = np.concatenate([pga3.move_point(motor, right), rng.normal(size=(40, 3))])
        x, y = (np.repeat(z, 6, 0) + 0.01 * rng.normal(size=(6 * len(z), 3)) for z in (x, y))
        assert register_matches(x, y).status == status


@pytest.mark.parametrize("noise", [0.2, 0.3])
def test_large_noise_of_many_matches_does_not_make_them_copies(noise: float) -> None:
    """Of a thousand matches, a motion is right up to its noise, although many are near others in both clouds."""
    rng = np.random.default_rng(13)
    for _ in range(4):
        motor = pga3.motor_exponential(rng.normal(size=6))
        x = rng.normal(size=(1000, 3))
        y = pga3.move_point(motor, x) + noise * rng.normal(size=x.shape)
        found = register_matches(x, y)
        assert found.status == RegistrationStatus.OK
        assert np.sqrt(np.mean((pga3.move_point(found.motor, x) - pga3.move_point(motor, x)) ** 2)) < 0.1 * noise
