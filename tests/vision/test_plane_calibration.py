"""Calibration from planes with distortion: known cameras, photographs with OpenCV's results, and what is refused."""

import numpy as np
import pytest

from algorithms.vision import Camera, Distortion, VisionStatus, calibrate_from_planes
from generated import pga3
from tests.support import chessboard, stereo_boards

GRID = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0)), -1).reshape(-1, 2)
BOARD = np.stack(np.meshgrid(np.arange(11.0) - 5, np.arange(8.0) - 3.5), -1).reshape(-1, 2) * 0.03
SIZE = np.array([640, 480])
RATIONAL = Distortion("brown", (5.0, 2.0, 0, 0, 0.1, 5.4, 3.0, 0.4))
"""Without limit: the distance from the centre grows with an angle of up to 75 degrees."""


def boards(seed, lens, n, focal=600.0, noise=0.3, tilt=0.6, widest=None, board=BOARD):
    """A camera, and its images of a board in random poses near the whole field of view."""
    rng = np.random.default_rng(seed)
    centre = SIZE / 2 + rng.uniform(-10, 10, 2)
    camera = Camera.from_intrinsics((focal, 1.01 * focal), tuple(centre), distortion=lens)
    views, poses = [], []
    while len(views) < n:
        turn = pga3.motor_from_rotation_vector_translation(rng.uniform(-tilt, tilt, 3), np.zeros(3))
        if widest is None:
            depth = rng.uniform(0.3, 0.45)
            place = np.array([*rng.uniform(-0.4, 0.4, 2) * depth * SIZE / focal, depth])
            motor = pga3.motor_product(pga3.motor_from_rotation_vector_translation(np.zeros(3), place), turn)
        else:
            # The board faces the camera from all directions up to an angle from the axis.
            angle, side = rng.uniform(0, widest), rng.uniform(0, 2 * np.pi)
            aside = pga3.motor_from_rotation_vector_translation(
                angle * np.array([-np.sin(side), np.cos(side), 0]), np.zeros(3)
            )
            ahead = pga3.motor_from_rotation_vector_translation(np.zeros(3), np.array([0, 0, rng.uniform(0.15, 0.3)]))
            motor = pga3.motor_product(aside, pga3.motor_product(ahead, turn))
        pixels = camera.project(pga3.move_point(motor, np.insert(board, 2, 0, axis=1)))
        if np.isfinite(pixels).all() and (pixels > 0).all() and (pixels < SIZE).all():
            views.append(pixels + noise * rng.normal(size=pixels.shape))
            poses.append(motor)
    return camera, views, np.array(poses)


def errors(found, camera):
    """The largest relative error of focal lengths, and the largest error of the centre in pixels."""
    k, truth = found.intrinsics, camera.intrinsics
    return np.abs(np.diag(k)[:2] / np.diag(truth)[:2] - 1).max(), np.abs(k[:2, 2] - truth[:2, 2]).max()


def standardised(found, camera):
    """Errors of fx fy cx cy in standard deviations."""
    off = (found.intrinsics - camera.intrinsics)[[0, 1, 0, 1], [0, 1, 2, 2]]
    return off / np.sqrt(np.diag(found.covariance)[:4])


@pytest.mark.parametrize(
    ("lens", "n"),
    [
        (Distortion("brown", (-0.3,)), None),
        (Distortion("brown", (-0.05,)), 1),
        (Distortion("brown", (0.2,)), 2),
        (Distortion("brown", (-0.28, 0.1, 0.003, -0.002, 0.02)), 5),
        (Distortion("fisheye", (-0.02, 0.003)), None),
    ],
)
def test_a_known_lens_with_noise(lens: Distortion, n: int | None) -> None:
    options = {"focal": 250.0, "widest": 0.9} if lens.model == "fisheye" else {}
    camera, views, poses = boards(101, lens, 30, **options)
    found = calibrate_from_planes(BOARD, views, distortion=lens.model, n_coefficients=n)
    assert found.status == VisionStatus.OK and found.inliers.all()
    relative, centre = errors(found, camera)
    assert relative < 0.002 and centre < 0.75 and np.abs(standardised(found, camera)).max() < 3.5
    # Two coordinates of each pixel have the noise, of which the parameters take a little.
    count = n or {"brown": 5, "fisheye": 4}[lens.model]
    freedom = 1 - (4 + count + 6 * 30) / (2 * 88 * 30)
    assert found.residual == pytest.approx(0.3 * np.sqrt(2 * freedom), rel=0.03)
    assert found.view_residuals.shape == (30,) and np.abs(found.view_residuals / found.residual - 1).max() < 0.3
    assert found.parameters[:4] == ("fx", "fy", "cx", "cy") and len(found.parameters) == 4 + count
    off = np.subtract(found.distortion.coefficients, lens.coefficients)[:count]
    assert np.abs(off / np.sqrt(np.diag(found.covariance)[4:])).max() < 4
    moved = pga3.motor_to_matrix(found.poses) - pga3.motor_to_matrix(poses)
    assert np.abs(moved).max() < 0.01
    assert found.camera.distortion == found.distortion


def test_a_lens_of_180_degrees() -> None:
    small = BOARD * 0.7
    camera, views, _ = boards(102, Distortion("fisheye", (-0.01, 0.002)), 30, 150.0, widest=1.3, board=small)
    farthest = max(np.linalg.norm(view - camera.intrinsics[:2, 2], axis=1).max() for view in views)
    assert farthest / 150 > np.radians(80)
    found = calibrate_from_planes(small, views, distortion="fisheye")
    assert found.status == VisionStatus.OK and np.abs(standardised(found, camera)).max() < 3.5
    assert errors(found, camera)[0] < 0.004 and errors(found, camera)[1] < 0.5


def test_exact_pixels_give_the_exact_camera() -> None:
    for lens, n, skew in (
        (Distortion("brown", (-0.3, 0.1, 1e-3, -1e-3, 0.02)), None, False),
        (RATIONAL, 8, False),
        (Distortion("fisheye", (-0.02, 0.003, 0.001, -5e-4)), None, True),
    ):
        options = {"focal": 250.0, "widest": 0.9} if lens.model == "fisheye" else {"focal": 200.0 if n else 600.0}
        camera, views, poses = boards(103, lens, 12, noise=0.0, **options)
        found = calibrate_from_planes(BOARD, views, skew, distortion=lens.model, n_coefficients=n)
        assert found.status == VisionStatus.OK and np.abs(found.intrinsics - camera.intrinsics).max() < 1e-6
        assert np.abs(pga3.motor_to_matrix(found.poses) - pga3.motor_to_matrix(poses)).max() < 1e-9


def test_rational_coefficients_that_are_determined_or_not() -> None:
    camera, views, _ = boards(116, RATIONAL, 20, 200.0)
    found = calibrate_from_planes(BOARD, views, distortion="brown", n_coefficients=8)
    assert found.status == VisionStatus.OK and np.abs(standardised(found, camera)).max() < 3.5
    # A common factor of numerator and denominator leaves the coefficients open.
    _, views, _ = boards(117, Distortion("brown", (-0.3, 0.1)), 12, noise=0.0)
    assert calibrate_from_planes(BOARD, views, distortion="brown", n_coefficients=8).status == VisionStatus.DEGENERATE


def test_photographs_have_the_results_of_opencv() -> None:
    left_and_right = np.array(stereo_boards.CORNERS.split(), float).reshape(2, 4, 54, 2)
    sets = [np.array(chessboard.CORNERS.split(), float).reshape(14, 54, 2), *left_and_right]
    for corners, (camera, deviations, coefficients) in zip(
        sets, (chessboard.OPENCV, *stereo_boards.OPENCV), strict=True
    ):
        found = calibrate_from_planes(GRID, corners, distortion="brown")
        assert found.status == VisionStatus.OK and found.inliers.all()
        off = found.intrinsics[[0, 1, 0, 1], [0, 1, 2, 2]] - camera
        assert np.abs(off / deviations).max() < 1e-3
        # OpenCV takes the noise as white; further terms of distortion explain some of it, and raise our deviations.
        ratios = np.sqrt(np.diag(found.covariance)[:4]) / deviations
        assert ratios.min() > 1 - 1e-3
        assert ratios.max() < 10
        assert np.abs(np.subtract(found.distortion.coefficients[:5], coefficients)).max() < 1e-4
        assert calibrate_from_planes(GRID, corners).status == VisionStatus.NOT_CONVERGED


def test_views_of_unequal_numbers_of_points_anywhere_in_the_plane() -> None:
    camera, views, poses = boards(104, Distortion("brown", (-0.3, 0.1)), 14)
    rng = np.random.default_rng(104)
    whole = calibrate_from_planes(BOARD, views, distortion="brown", n_coefficients=2)
    kept = [np.sort(rng.permutation(88)[: rng.integers(20, 89)]) for _ in views]
    shifts = rng.uniform(-20, 20, (14, 2))
    planes = [BOARD[some] + shift for some, shift in zip(kept, shifts, strict=True)]
    parts = [view[some] for view, some in zip(views, kept, strict=True)]
    found = calibrate_from_planes(planes, parts, distortion="brown", n_coefficients=2)
    assert found.status == VisionStatus.OK and np.abs(standardised(found, camera)).max() < 3.5
    back = pga3.motor_from_rotation_vector_translation(np.zeros((14, 3)), np.insert(-shifts, 2, 0, axis=1))
    expected = pga3.motor_to_matrix(pga3.motor_product(poses, back))
    moved = (pga3.motor_to_matrix(found.poses) - expected)[:, :3] @ np.insert(np.insert(shifts, 2, 0, 1), 3, 1, 1)[
        ..., None
    ]
    assert np.abs(moved).max() < 0.01
    # The unit of length and the order of the views do not matter.
    again = calibrate_from_planes(BOARD * 1e4, views[::-1], distortion="brown", n_coefficients=2)
    assert np.abs(again.intrinsics - whole.intrinsics).max() < 1e-5
    lists = calibrate_from_planes(
        BOARD.tolist(), [view.tolist() for view in views], distortion="brown", n_coefficients=2
    )
    assert np.array_equal(lists.intrinsics, whole.intrinsics)


def test_wrong_views_are_left_out() -> None:
    lens = Distortion("brown", (-0.3, 0.1))
    camera, views, _ = boards(105, lens, 12)
    clean = calibrate_from_planes(BOARD, views, distortion="brown", n_coefficients=2)
    assert clean.inliers.all()
    _, zoomed, _ = boards(106, lens, 2, 800.0)
    wrong = [view.copy() for view in views]
    wrong[3] = np.roll(wrong[3].reshape(8, 11, 2), 1, axis=1).reshape(-1, 2)  # corners of another column
    wrong[5][17] += 60.0  # a corner somewhere else
    wrong[9], wrong[10] = zoomed  # another focal length
    found = calibrate_from_planes(BOARD, wrong, distortion="brown", n_coefficients=2)
    assert found.status == VisionStatus.OK
    # A view from nearly ahead agrees with any focal length.
    assert {3, 5} < set(np.flatnonzero(~found.inliers)) <= {3, 5, 9, 10}
    assert np.abs(standardised(found, camera)).max() < 3.5
    assert (found.view_residuals[~found.inliers] > 2 * found.residual).all()
    straight, plain, _ = boards(107, None, 10)
    plain[2] = np.roll(plain[2].reshape(8, 11, 2), 1, axis=1).reshape(-1, 2)
    found = calibrate_from_planes(BOARD, plain)
    assert found.status == VisionStatus.OK and np.flatnonzero(~found.inliers).tolist() == [2]
    assert np.abs(standardised(found, straight)).max() < 3.5


def test_least_squares_without_distortion() -> None:
    camera, views, poses = boards(108, None, 10)
    found = calibrate_from_planes(BOARD, views)
    assert found.status == VisionStatus.OK and found.distortion is None and abs(found.bending) < 0.02
    assert found.parameters == ("fx", "fy", "cx", "cy") and np.abs(standardised(found, camera)).max() < 3.5
    assert np.abs(pga3.motor_to_matrix(found.poses) - pga3.motor_to_matrix(poses)).max() < 0.01
    # Distances grow in all directions from a minimum: to second order by the information.
    assert found.residual <= np.sqrt(np.mean(np.square(distances(found, views)))) * np.sqrt(2) + 1e-9
    bent = calibrate_from_planes(BOARD, boards(109, Distortion("brown", (-0.2,)), 8)[1])
    assert bent.status == VisionStatus.NOT_CONVERGED and bent.bending == pytest.approx(-0.2, rel=0.3)


def distances(found, views):
    """Distances of both coordinates of all pixels from the images of the points."""
    there = pga3.move_point(found.poses[:, None], np.insert(BOARD, 2, 0, axis=1))
    return found.camera.project(there) - np.array(views)


def test_what_the_views_do_not_determine_has_a_status() -> None:
    lens = Distortion("brown", (-0.3, 0.1))
    _, views, _ = boards(110, lens, 8)
    _, frontal, _ = boards(110, lens, 8, tilt=0.0)
    _, nearly, _ = boards(110, lens, 8, tilt=0.01)
    status = {
        "one": calibrate_from_planes(BOARD, views[:1], distortion="brown"),
        "few": calibrate_from_planes(
            BOARD[[0, 10, 77, 87]], [v[[0, 10, 77, 87]] for v in views[:4]], distortion="brown"
        ),
        "same": calibrate_from_planes(BOARD, views[:1] * 6, distortion="brown"),
        "line": calibrate_from_planes(BOARD[:11], [v[:11] for v in views], distortion="brown"),
        "nan": calibrate_from_planes(BOARD, [*views[1:], views[0] * np.nan], distortion="brown"),
        "none": calibrate_from_planes(BOARD, [], distortion="brown"),
    }
    assert {name: each.status.name for name, each in status.items()} == {
        "one": "TOO_FEW", "few": "TOO_FEW", "same": "DEGENERATE", "line": "DEGENERATE", "nan": "NOT_FINITE",
        "none": "TOO_FEW",
    }  # fmt: skip
    assert all(np.isnan(each.intrinsics).all() and each.distortion is None for each in status.values())
    for some in (frontal, nearly):
        assert calibrate_from_planes(BOARD, some, distortion="brown").status in (
            VisionStatus.DEGENERATE, VisionStatus.NOT_CONVERGED,
        )  # fmt: skip
    rng = np.random.default_rng(110)
    for model in ("brown", "fisheye"):
        noise = [rng.uniform(0, 480, view.shape) for view in views[:4]]
        assert calibrate_from_planes(BOARD, noise, distortion=model).status != VisionStatus.OK


@pytest.mark.slow
def test_a_model_that_does_not_bend_enough_is_contradicted() -> None:
    _, views, _ = boards(111, Distortion("brown", (-0.35, 0.25, 0, 0, -0.1)), 12, 450.0, noise=0.1)
    found = calibrate_from_planes(BOARD, views, distortion="brown", n_coefficients=1)
    assert found.status == VisionStatus.NOT_CONVERGED and np.isfinite(found.intrinsics).all()
    assert calibrate_from_planes(BOARD, views, distortion="brown").status == VisionStatus.OK
    _, wide, _ = boards(112, Distortion("fisheye", (0.05, -0.01)), 14, 160.0, noise=0.1, widest=1.2, board=BOARD * 0.7)
    assert calibrate_from_planes(BOARD * 0.7, wide, distortion="brown").status != VisionStatus.OK


def test_invalid_options() -> None:
    _, views, _ = boards(113, None, 3)
    for options, error, text in (
        ({"distortion": "cubic"}, ValueError, "expected 'brown', 'fisheye' or None"),
        ({"n_coefficients": 2}, ValueError, "without a model"),
        ({"distortion": "fisheye", "n_coefficients": 5}, ValueError, "expected 1 to 4"),
        ({"distortion": "brown", "n_coefficients": 2.0}, TypeError, "expected a whole number"),
    ):
        with pytest.raises(error, match=text):
            calibrate_from_planes(BOARD, views, **options)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["brown", "fisheye"])
def test_errors_are_those_of_the_covariance(model: str) -> None:
    rng, off, flagged = np.random.default_rng(114), [], 0
    for seed in range(150):
        if model == "brown":
            lens, focal, widest = Distortion("brown", (rng.uniform(-0.4, 0.2), rng.uniform(-0.05, 0.15))), 600.0, None
        else:
            lens, focal, widest = (
                Distortion("fisheye", tuple(rng.normal(size=4) * [0.03, 0.01, 0.003, 0.001])),
                250.0,
                0.9,
            )
        camera, views, _ = boards(
            5000 + seed, lens, int(rng.integers(5, 16)), focal, rng.uniform(0.1, 1), widest=widest
        )
        found = calibrate_from_planes(BOARD, views, distortion=model)
        assert found.status == VisionStatus.OK
        flagged += not found.inliers.all()
        off.append(standardised(found, camera))
    assert flagged <= 2
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1, abs=0.12) and np.abs(off).max() < 5


def test_a_slight_distortion_that_is_not_estimated_raises_the_covariance() -> None:
    """A coefficient of 0.015 moves focal lengths by many deviations of the noise, and residuals by little of it.

    The errors of lenses without it are as likely as the covariance says.
    """
    board = np.stack(np.meshgrid(np.arange(8.0) - 3.5, np.arange(8.0) - 3.5), -1).reshape(-1, 2) / 5
    right, means = 0, []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        bent = seed < 20
        lens = Distortion("brown", ((0.015 if seed % 2 else -0.015) * bent,))
        views = []
        for _ in range(10):
            turn, place = rng.uniform(-0.45, 0.45, 3), np.array([*rng.uniform(-0.6, 0.6, 2), -rng.uniform(3, 5)])
            pose = pga3.motor_from_rotation_vector_translation(turn, place)
            seen = Camera.from_intrinsics((880.0, 870.0), (610.0, 380.0), pose, 0.0, lens).project(
                np.insert(board, 2, 0, axis=1)
            )
            views.append(seen + rng.normal(0, 0.25, seen.shape))
        found = calibrate_from_planes(board, views)
        if bent and found.status == VisionStatus.NOT_CONVERGED:
            right += 1
            continue
        assert found.status == VisionStatus.OK
        off = found.intrinsics[[0, 1, 0, 1], [0, 1, 2, 2]] - [880, 870, 610, 380]
        square = off @ np.linalg.solve(found.covariance, off)
        if bent:
            right += square < 18.5  # a quantile of 0.999 of the chi-square distribution of four numbers
        else:
            means.append(square)
    assert right >= 19
    assert 2.5 < np.mean(means) < 5.5
