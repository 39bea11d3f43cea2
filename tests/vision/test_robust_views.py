"""Models of random samples and descents of `robust_views` and `camera_poses`, beside exact scenes and scipy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.optimize

from generated import camera_poses, linear_views, pga3, relative_poses, robust_views

Array = np.ndarray[Any, Any]
K = np.array([[700.0, 3, 320], [0, 690, 240], [0, 0, 1]])
ALL = 1e20


def motion(rng: np.random.Generator) -> Array:
    """A pose [R | t] about six units away."""
    motor = pga3.motor_from_rotation_vector_translation(rng.normal(size=3), rng.normal(loc=(0, 0, 6)))
    return np.asarray(pga3.motor_to_matrix(motor)[:3])


def seen(matrix: Array, places: Array) -> Array:
    """The images of points (n, d) by a matrix (3, d + 1)."""
    moved = places @ matrix[:, :-1].T + matrix[:, -1]
    return np.asarray(moved[:, :2] / moved[:, 2:])


def views(rng: np.random.Generator, n: int) -> tuple[Array, Array, Array]:
    """Directions of points in two cameras, and the essential matrix."""
    one, two = motion(rng), motion(rng)
    places = rng.normal(size=(n, 3))
    turn = two[:, :3] @ one[:, :3].T
    t = two[:, 3] - turn @ one[:, 3]
    cross = np.array([[0, -t[2], t[1]], [t[2], 0, -t[0]], [-t[1], t[0], 0]])
    essential = cross @ turn
    return seen(one, places), seen(two, places), essential / np.linalg.norm(essential)


def up_to_sign(a: Array, b: Array) -> float:
    return float(min(np.abs(a - b).max(), np.abs(a + b).max()))


def test_homographies_of_four_pairs() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        matrix = np.eye(3) + 0.3 * rng.normal(size=(3, 3)) * [[1, 1, 100], [1, 1, 100], [1e-3, 1e-3, 1]]
        first = rng.uniform(0, 600, (4, 2))
        found, is_determined = robust_views.homography_of_four(first, seen(matrix, first))
        if is_determined:
            assert up_to_sign(found, matrix / np.linalg.norm(matrix)) < 1e-7
    line = np.array([[0.0, 0], [1, 1], [3, 3], [0, 2]])
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    assert not robust_views.homography_of_four(line, square)[1]
    assert not robust_views.homography_of_four(square, line)[1]
    assert robust_views.homography_of_four(square, 2 * square)[1]


def test_homographies_of_three_pairs_and_f() -> None:
    """They are those of the planes through three points."""
    rng = np.random.default_rng(11)
    for _ in range(20):
        one, two = motion(rng), motion(rng)
        places = np.c_[rng.normal(size=(20, 2)), np.zeros(20)] @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn = two[:, :3] @ one[:, :3].T
        essential = np.cross(np.eye(3), two[:, 3] - turn @ one[:, 3]).T @ turn
        first, second = (600 * seen(pose, places) + [320, 240] for pose in (one, two))
        back = np.linalg.inv(np.array([[600, 0, 320], [0, 600, 240], [0, 0, 1.0]]))
        found = robust_views.homography_of_three(back.T @ essential @ back, first[:3], second[:3])
        assert np.linalg.norm(found) == pytest.approx(1) and np.abs(seen(found, first) - second).max() < 1e-5


def test_affine_places_and_singular_values_are_those_of_numpy() -> None:
    rng = np.random.default_rng(12)
    first, used = rng.uniform(0, 500, (30, 2)), rng.random(30) < 0.6
    second = first @ rng.normal(size=(2, 2)) + rng.normal(size=(30, 2))
    rows = np.c_[first, np.ones(30)]
    known = rows @ np.linalg.lstsq(rows[used], second[used], rcond=None)[0]
    assert np.allclose(robust_views.affine_places(first, second, used.astype(float)), known, atol=1e-9)
    equations = np.asarray(linear_views.plane_equations(first, second)[0]).reshape(-1, 9)
    values = np.linalg.svd(equations, compute_uv=False) ** 2
    assert np.allclose(robust_views.squares_of_plane(first, second), values[[8, 7, 0]], rtol=1e-3, atol=1e-13)


def test_fundamental_matrices_of_seven_pairs_are_all_singular_ones_that_fit() -> None:
    """Their number is that of the real roots of the determinant in the null space of the equations."""
    rng, numbers = np.random.default_rng(2), set()
    for k in range(60):
        first, second, truth = views(rng, 7)
        if k % 2:
            second = rng.normal(size=(7, 2))
        found, number = robust_views.fundamentals_of_seven(first, second)
        x, y = (np.insert(p, 2, 1, axis=1) for p in (first, second))
        equations = (y[:, :, None] * x[:, None]).reshape(7, 9)
        a, b = np.linalg.svd(equations)[2][7:].reshape(2, 3, 3)
        at = np.array([-1.0, 0, 1, 2])
        cubic = np.linalg.solve(np.vander(at, 4), [np.linalg.det(a + t * b) for t in at])
        assert number == (np.abs(np.roots(cubic).imag) < 1e-7).sum()
        numbers.add(int(number))
        for each in found[: int(number)]:
            assert np.linalg.norm(each) == pytest.approx(1) and abs(np.linalg.det(each)) < 1e-12
            assert np.abs(equations @ each.ravel()).max() < 1e-12
        if not k % 2:
            assert min(up_to_sign(each, truth) for each in found[: int(number)]) < 1e-8
    assert numbers == {1, 3}


def test_poses_of_three_points() -> None:
    """Noise makes double roots of nearly double ones, where the error is the root of that of the coefficients."""
    rng, counts, errors = np.random.default_rng(3), np.zeros(5, int), []
    for _ in range(200):
        pose, places = motion(rng), rng.normal(size=(3, 3))
        directions = seen(pose, places)
        found, is_there = camera_poses.poses_of_three(places, directions)
        good = [each for each in found[is_there > 0] if np.abs(seen(each, places) - directions).max() < 1e-7]
        errors.append(min(np.abs(each - pose).max() for each in good))
        for each in good:
            assert np.abs(each[:, :3] @ each[:, :3].T - np.eye(3)).max() < 1e-12 and np.linalg.det(each[:, :3]) > 0
        counts[len(good)] += 1
    assert counts[2] > 20 and counts[4] > 10
    assert np.median(errors) < 1e-11 and np.quantile(errors, 0.95) < 1e-8 and max(errors) < 1e-4


def minimum(residuals: Callable[[Array], Array], start: Array) -> float:
    found = scipy.optimize.least_squares(residuals, start, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return 2 * float(found.cost)


@pytest.mark.parametrize("seed", range(5))
def test_descents_end_in_the_minima_of_scipy(seed: int) -> None:
    """Wrong pairs count as the limit, and others are those that the minimum explains."""
    rng = np.random.default_rng(seed)
    n, wrong = 60, np.arange(60) < 15
    pose, places = motion(rng), rng.normal(size=(60, 3))
    pixels = seen(K @ pose, places) + rng.normal(size=(n, 2))
    pixels[wrong] += 80
    found, normal, numbers = camera_poses.descend_pose(pose, K, places, pixels, 25.0, 50.0)
    used = camera_poses.pixel_squares(found, K, places, pixels) < 25

    def of_pose(step: Array) -> Array:
        turn = np.asarray(pga3.motor_to_matrix(pga3.motor_from_rotation_vector_translation(step[:3], step[3:])))
        return (seen(K @ (turn @ np.vstack([pose, [0, 0, 0, 1]]))[:3], places[used]) - pixels[used]).ravel()

    known = minimum(of_pose, np.zeros(6)) + 25 * (~used).sum()
    assert numbers[1] and numbers[0] == pytest.approx(known, rel=1e-10) and numbers[3] == pytest.approx(known)
    assert (used == ~wrong).all()
    spread = np.linalg.inv(normal)
    jacobian = scipy.optimize.approx_fprime(np.zeros(6), of_pose, 1e-7)
    assert np.sqrt(np.diag(spread)[:3]) == pytest.approx(
        np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian))[:3]), 0.3
    )

    matrix = np.eye(3) + 0.2 * rng.normal(size=(3, 3)) * [[1, 1, 100], [1, 1, 100], [1e-3, 1e-3, 1]]
    first = rng.uniform(0, 400, (n, 2))
    second = seen(matrix, first) + rng.normal(size=(n, 2))
    second[wrong] += 80
    fitted, numbers = robust_views.descend_homography(matrix, first, second, 25.0, 50.0, 1e-14)
    used = robust_views.transfer_squares(fitted, first, second) < 25
    start = (fitted / fitted[2, 2]).ravel()[:8]
    known = minimum(lambda v: (seen(np.append(v, 1).reshape(3, 3), first[used]) - second[used]).ravel(), start)
    assert numbers[1] and numbers[0] == pytest.approx(known + 25 * (~used).sum(), rel=1e-10)

    x, y, essential = views(rng, n)
    y = y + 1e-3 * rng.normal(size=(n, 2))
    y[wrong] += 0.3
    fitted, numbers = robust_views.descend_fundamental(essential, x, y, 2e-5, 60.0, 1e-14)
    used = relative_poses.squared_distances(fitted, x, y) < 2e-5
    u, s, v = np.linalg.svd(fitted)

    def of_matrix(step: Array) -> Array:
        left, right = (pga3.rotor_to_matrix(pga3.rotor_from_rotation_vector(w)) for w in (step[:3], step[3:6]))
        now = left @ u @ np.diag([1, s[1] / s[0] + step[6], 0]) @ v @ right
        a, b = np.insert(x[used], 2, 1, axis=1), np.insert(y[used], 2, 1, axis=1)
        lines, others = a @ now.T, b @ now
        size = np.sqrt((lines[:, :2] ** 2).sum(1) + (others[:, :2] ** 2).sum(1))
        return np.asarray((b * lines).sum(1) / size)

    known = minimum(of_matrix, np.zeros(7)) + 2e-5 * (~used).sum()
    assert numbers[1] and numbers[0] == pytest.approx(known, rel=1e-8) and abs(np.linalg.det(fitted)) < 1e-15
    assert relative_poses.truncated_squares(fitted, x, y, 2e-5) == pytest.approx(numbers[0])


@pytest.mark.parametrize("seed", range(3))
def test_the_likeliest_fundamental_matrix_is_that_of_scipy(seed: int) -> None:
    """The loss of scipy named for Cauchy is the negative logarithm of the density of Student's distribution."""
    rng = np.random.default_rng(seed)
    x, y, essential = views(rng, 150)
    y = y + 1e-3 * rng.standard_t(2, (150, 2))
    x = x + 1e-3 * rng.standard_t(2, (150, 2))
    start = robust_views.descend_fundamental(essential, x, y, 1e20, 50.0, 1e-14)[0]
    tail = 4e-7
    fitted, (ended, steps) = robust_views.likeliest_fundamental(start, x, y, 1e20, tail, 100.0)
    u, s, v = np.linalg.svd(start)
    a, b = np.insert(x, 2, 1, axis=1), np.insert(y, 2, 1, axis=1)

    def distances(step: Array) -> Array:
        left, right = (pga3.rotor_to_matrix(pga3.rotor_from_rotation_vector(w)) for w in (step[:3], step[3:6]))
        now = left @ u @ np.diag([1, s[1] / s[0] + step[6], 0]) @ v @ right
        lines, others = a @ now.T, b @ now
        size = np.sqrt((lines[:, :2] ** 2).sum(1) + (others[:, :2] ** 2).sum(1))
        return np.asarray((b * lines).sum(1) / size)

    known = scipy.optimize.least_squares(distances, np.zeros(7), loss="cauchy", f_scale=np.sqrt(tail), xtol=1e-12)
    found = tail * np.log1p(np.asarray(relative_poses.squared_distances(fitted, x, y)) / tail).sum()
    assert ended and steps < 100 and abs(np.linalg.det(fitted)) < 1e-15
    assert found == pytest.approx(2 * known.cost, rel=1e-5)
    assert found < 0.999 * tail * np.log1p(np.asarray(relative_poses.squared_distances(start, x, y)) / tail).sum()
    # Pairs beyond the limit have no influence.
    wrong = y + rng.normal(size=y.shape)
    far = np.asarray(relative_poses.squared_distances(fitted, x, wrong)) > 0.02
    more = np.concatenate([x, x[far]]), np.concatenate([y, wrong[far]])
    with_wrong, _ = robust_views.likeliest_fundamental(start, *more, 0.01, tail, 100.0)
    assert far.sum() > 50
    assert up_to_sign(with_wrong, fitted) < 1e-4


def test_squares_of_pairs() -> None:
    rng = np.random.default_rng(4)
    pose, places = motion(rng), rng.normal(size=(20, 3))
    pixels = seen(K @ pose, places) + rng.normal(size=(20, 2))
    behind = places - 20 * pose[2, :3]
    squares = camera_poses.pixel_squares(pose, K, np.concatenate([places, behind]), np.tile(pixels, (2, 1)))
    assert squares[:20] == pytest.approx(((seen(K @ pose, places) - pixels) ** 2).sum(1))
    assert (squares[20:] == 1e30).all()
    many = camera_poses.truncated_pixel_squares(np.stack([pose, pose]), K, places, pixels, 1.0)
    assert many == pytest.approx(np.minimum(squares[:20], 1).sum())

    # A pair that fits H, moved along the normals of the surface of such pairs, is as far off as it was moved.
    matrix = np.array([[1.1, 0.2, 30], [-0.1, 0.9, 5], [1e-4, -2e-4, 1]])
    first = rng.uniform(0, 400, (10, 2))
    second = seen(matrix, first)
    for k in range(10):
        jacobian = np.concatenate([scipy.optimize.approx_fprime(first[k], lambda p: seen(matrix, p[None])[0], 1e-4),
                                   -np.eye(2)], 1)  # fmt: skip
        step = 1e-3 * jacobian.T @ np.linalg.solve(jacobian @ jacobian.T, rng.normal(size=2))
        square = robust_views.plane_squares(matrix, (first[k] + step[:2])[None], (second[k] + step[2:])[None])[0]
        assert square == pytest.approx(step @ step, rel=1e-3)
        whole = robust_views.truncated_plane_squares(matrix, first, second + 0.1, 1e-3)
        assert whole == pytest.approx(np.minimum(robust_views.plane_squares(matrix, first, second + 0.1), 1e-3).sum())


def test_points_near_lines_and_extents() -> None:
    rng = np.random.default_rng(6)
    points, ends = rng.normal(size=(30, 2)) * [3, 1] + 50, rng.normal(size=(5, 2, 2)) + 50
    along = ends[:, 1] - ends[:, 0]
    normals = np.stack([-along[:, 1], along[:, 0]], 1) / np.linalg.norm(along, axis=1)[:, None]
    near = np.abs(np.einsum("mi,mni->mn", normals, points - ends[:, :1])) < 1.5
    assert (robust_views.count_near_line(ends, points, 1.5) == near.sum(1)).all() and 0 < near.mean() < 1
    assert (robust_views.off_line(ends[2], points, 1.5) == ~near[2]).all()
    assert robust_views.count_near_line(ends[[0, 0], 0], points, 1.5) == 0
    values = np.linalg.svd(points - points.mean(0), compute_uv=False)
    assert robust_views.extents_of_pixels(points) == pytest.approx(values[::-1] ** 2, rel=1e-12)


def thin_views(rng: np.random.Generator, n: int, depth: float, noise: float) -> tuple[Array, Array]:
    """Pixels of points in two images, of which the depths differ little."""
    places = rng.normal(size=(n, 3)) * (1, 1, depth)
    first, second = (seen(K @ motion(rng), places) for _ in range(2))
    return first + noise * rng.normal(size=first.shape), second + noise * rng.normal(size=second.shape)


@pytest.mark.parametrize(
    ("n", "depth", "noise", "least"), [(8, 1, 0, 1e-5), (20, 1e-3, 0, 1e-7), (50, 1e-2, 0.3, 1e-4)]
)
def test_sums_of_products_have_the_solutions_of_singular_vectors(
    n: int, depth: float, noise: float, least: float
) -> None:
    """Without the corrections, the solution has half of the digits: errors are the square of the condition."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        first, second = thin_views(rng, n, depth, noise)
        similarities, rows = [], []
        for x in (first, second):
            scale = 1 / np.sqrt(x.var(0).mean())
            similarities.append(
                np.array([[scale, 0, -scale * x[:, 0].mean()], [0, scale, -scale * x[:, 1].mean()], [0, 0, 1]])
            )
            rows.append(np.column_stack([scale * (x - x.mean(0)), np.ones(n)]))
        _, values, vectors = np.linalg.svd(np.einsum("ni,nj->nij", rows[1], rows[0]).reshape(n, 9))
        u, s, v = np.linalg.svd(vectors[8].reshape(3, 3))
        wanted = similarities[1].T @ (u[:, :2] * s[:2] @ v[:2]) @ similarities[0]
        wanted /= np.linalg.norm(wanted)
        found = linear_views.fundamental_of_pixels(first, second)
        if values[7] > least * values[0]:
            assert min(np.abs(found - wanted).max(), np.abs(found + wanted).max()) < 1e-13 * values[0] / values[7]


def test_poses_that_cannot_be_likely_are_not_followed() -> None:
    """Other starts reach the minimum of single descents, whichever of them is first."""
    rng = np.random.default_rng(3)
    pose, places = motion(rng), rng.normal(size=(30, 3))
    pixels = seen(K @ pose, places) + rng.normal(size=(30, 2))
    near, far = (pose + spread * rng.normal(size=(3, 4)) for spread in (0.01, 0.5))
    wanted, normal, numbers = camera_poses.descend_pose(near, K, places, pixels, ALL, 201.0)
    for which in range(2):
        starts = np.array([far, far, far])
        starts[which] = near
        # No start leaves less than nothing.
        _, _, reached = camera_poses.follow_poses(starts, K, places, pixels, np.zeros((2, 2)), 25.0, 200.0)
        assert not reached[:, 1].any()
        bounds = np.array([[0.0, 2], [0, 2]])
        found, normals, reached = camera_poses.follow_poses(starts, K, places, pixels, bounds, 25.0, 200.0)
        assert found[0] == pytest.approx(wanted, abs=1e-8) and normals[0] == pytest.approx(normal, rel=1e-5)
        assert reached[0] == pytest.approx(numbers[[0, 1, 3, 4]]) and reached[0, 1] == 1
        assert not reached[1:, 1].any() and (reached[1:, 2] > 2 * reached[0, 0]).all()


def test_poses_are_ordered_by_what_is_in_front_and_by_their_sums() -> None:
    """Poses without a number, and those that points behind the camera fit best, are the last ones."""
    rng = np.random.default_rng(14)
    ahead = np.column_stack([np.eye(3), (0.0, 0, 6)])
    behind = ahead * np.array([[-1.0], [-1], [-1]]) * (-1, -1, 1, 1)
    places = rng.normal(size=(9, 3))
    places -= places.mean(0)
    pixels = seen(K @ ahead, places) + rng.normal(size=(9, 2))
    starts = np.array([np.full((3, 4), np.nan), behind, ahead, *(ahead + 0.3 * rng.normal(size=(3, 3, 4))), ahead])
    no_steps = np.zeros((2, 2))
    for order in (slice(None), [3, 1, 0, 5, 2, 4, 6]):
        found, _, reached = camera_poses.follow_poses(starts[order], K, places, pixels, no_steps, 25.0, 1.0)
        sums, front = reached[:, 0], reached[:, 3] > 0
        assert np.all(np.diff(front.astype(int)) <= 0) and 4 <= front.sum() < 7
        assert np.all(np.diff(sums[front]) >= 0)
        last = sums[~front]
        assert (last < ALL).any() and np.all(np.diff(last[last < ALL]) >= 0) and np.isnan(found[-1]).all()
        of_found = camera_poses.pixel_squares(found[front], K, places, pixels).sum(-1)
        assert of_found == pytest.approx(sums[front], rel=1e-9)


def test_the_last_pose_is_where_the_reversal_of_the_best_one_leads() -> None:
    rng = np.random.default_rng(9)
    places = rng.normal(size=(12, 3)) * (0.1, 0.1, 0)
    places -= places.mean(0)
    pose = motion(rng)
    pixels = seen(K @ pose, places) + 0.1 * rng.normal(size=(12, 2))
    starts = np.array([pose, np.full((3, 4), np.nan)])
    all_of_them = np.array([[1e9, 0], [0, 0]])
    found, _, reached = camera_poses.follow_poses(starts, K, places, pixels, all_of_them, 25.0, 200.0)
    mirrored = linear_views.reversed_pose(found[0], places)
    wanted, _, numbers = camera_poses.descend_pose(mirrored, K, places, pixels, ALL, 201.0)
    assert found[1] == pytest.approx(wanted, abs=1e-6) and reached[1, 0] == pytest.approx(numbers[0], rel=1e-6)
    assert np.abs(found[0] - found[1]).max() > 0.1 and reached[:, 1].all() and reached[:, 3].all()


@pytest.mark.parametrize("thickness", [1e-4, 1e-9])
def test_points_on_a_line_and_repeated_points_leave_a_pose_open(thickness: float) -> None:
    places = np.random.default_rng(4).normal(size=(12, 3)) * (thickness, 1, thickness)
    turned = np.linalg.qr(np.random.default_rng(5).normal(size=(6, 6)))[0]
    for least in (1e-10, 1e-18):
        normal = turned * (least, 1, 2, 3, 4, 5) @ turned.T
        few, is_open = camera_poses.undetermined_pose(places, normal)
        assert not few and bool(is_open) == (thickness < 1e-7 or least < 1e-14)
    for n in (3, 4):
        assert camera_poses.undetermined_pose(np.tile(places[:n], (3, 1)), normal)[0] == (n < 4)


def test_variances_are_those_of_the_inverse_normal_equations() -> None:
    rows = np.random.default_rng(6).normal(size=(20, 6))
    inverse = np.linalg.inv(rows.T @ rows)
    wanted = [np.linalg.eigvalsh(inverse[:3, :3])[-1], np.linalg.eigvalsh(inverse[3:, 3:])[-1]]
    assert camera_poses.largest_variances(rows.T @ rows) == pytest.approx(wanted, rel=1e-12)


def test_the_centre_of_a_camera_is_relative_to_the_points() -> None:
    rng = np.random.default_rng(7)
    pose, centroid = motion(rng), np.array([1e9, 0, -1e9])
    frame = pga3.motor_to_matrix(camera_poses.motor_of_pose(pose, centroid))
    assert frame[:3, :3] == pytest.approx(pose[:, :3].T, abs=1e-14)
    assert frame[:3, 3] == pytest.approx(centroid - pose[:, :3].T @ pose[:, 3], abs=1e-6)
