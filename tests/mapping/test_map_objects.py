"""Objects of maps: distances against closed forms, and fits to simulated scans."""

import numpy as np
import pytest
from scipy.stats import chi2

from algorithms.mapping.floor_plans import FloorPlan
from algorithms.mapping.navigation_status import FitStatus
from algorithms.mapping.objects import MapObject, ObjectKind, ObjectMap, fit_box, fit_circle
from algorithms.mapping.round_fitting import fit_round
from algorithms.mapping.scan_simulation import Scanner, simulate_scan
from generated import navigation as kernels
from generated import pga2

FINE = Scanner(n_beams=1441, noise=0.01)


def pose(x: float, y: float, angle: float = 0.0) -> np.ndarray:
    return np.asarray(pga2.motor_from_angle_translation(angle, np.array([x, y])))


def test_distances_from_objects() -> None:
    box = MapObject.box(pose(1, 1, np.pi / 2), 4.0, 2.0)
    objects = ObjectMap().with_objects([box, MapObject.circle([6, 0], 1.0), MapObject.segment([0, -4], [3, -4])])
    points = [[1, 1], [2.5, 1], [1, 3.5], [3, 4], [6, 0.5], [9, 4], [1, -3.5], [-3, -8]]
    found = objects.distance(points)
    expected = [-1, 0.5, 0.5, np.hypot(1, 1), -0.5, 4, 0.5, 5]
    np.testing.assert_allclose(found.distance, expected, atol=1e-12)
    assert found.row.tolist() == [0, 0, 0, 0, 1, 1, 2, 2]
    assert len(objects) == 3 and len(ObjectMap()) == 0
    nothing = ObjectMap().distance([0.0, 0.0])
    assert np.isinf(nothing.distance) and nothing.row == -1


def test_objects_in_the_frame_of_a_robot() -> None:
    own = MapObject.circle([1.0, 0.0], 0.2, "column")
    (moved,) = ObjectMap().with_objects([own], pose(3, 4, np.pi / 2)).objects
    np.testing.assert_allclose(moved.centre, [3, 5], atol=1e-12)
    assert moved.name == "column" and moved.kind == ObjectKind.CIRCLE
    np.testing.assert_allclose(np.linalg.norm(moved.outline - [3, 5], axis=1), 0.2)


def test_exact_circles_at_any_scale() -> None:
    angle = np.linspace(-0.7, 0.7, 30)
    for scale in (1e-3, 1.0, 1e3):
        points = scale * (np.array([5.0, -3.0]) + 0.4 * np.stack([np.cos(angle), np.sin(angle)], 1))
        found = fit_circle(points, sigma=0.01 * scale)
        assert found.status == FitStatus.OK and found.inliers.all()
        np.testing.assert_allclose(found.fitted.centre, scale * np.array([5.0, -3.0]), rtol=1e-7)
        np.testing.assert_allclose(found.fitted.size[2], scale * 0.4, rtol=1e-6)


def test_circle_is_the_best_geometric_fit() -> None:
    """No circle near the result has a smaller sum of squared distances."""
    rng = np.random.default_rng(4)
    angle = rng.uniform(0, 2.5, 60)
    points = 0.5 * np.stack([np.cos(angle), np.sin(angle)], 1) + rng.normal(scale=0.01, size=(60, 2))
    found = fit_circle(points)
    used = points[found.inliers]

    def cost(x: float, y: float, r: float) -> float:
        return float(((np.hypot(used[:, 0] - x, used[:, 1] - y) - r) ** 2).sum())

    best = *found.fitted.centre, found.fitted.size[2]
    np.testing.assert_allclose(found.residual**2 * len(used), cost(*best), rtol=1e-6)
    for change in 1e-4 * rng.normal(size=(50, 3)):
        assert cost(*(np.array(best) + change)) > cost(*best)


def test_a_line_is_a_circle_without_curvature() -> None:
    x = np.linspace(-1, 2, 20)
    points = np.stack([x, 0.5 * x + 1], 1)
    spreads = np.tile([1e-4, 0, 1e-4], (20, 1))
    vector, converged = fit_round(kernels.circle_step, points, spreads, np.array([0.0, 1.0, 0.0, 1.0]), curved=False)
    np.testing.assert_allclose(vector, np.array([-0.5, 1, 0, 1]) / np.hypot(0.5, 1), atol=1e-8)
    assert converged


def test_column_from_two_scans_to_a_centimetre() -> None:
    """At the noise of the laser; beams that miss the column and wrong points are left out."""
    centre, radius, errors = np.array([2.0, 1.0]), 0.25, []
    turn = np.linspace(0, 2 * np.pi, 65)
    ring = centre + radius * np.stack([np.cos(turn), -np.sin(turn)], 1)
    plan = FloorPlan.from_walls(np.stack([ring[:-1], ring[1:]], 1), solid=True)
    for seed in range(6):
        points = []
        for place in (pose(0, 0, 0.3), pose(0.5, 2.5, -0.5)):
            scan = simulate_scan(plan, place, FINE, seed=seed).scan
            points.append(pga2.move_point(place, scan.points()))
        rng = np.random.default_rng(seed)
        wrong = centre + rng.uniform(0.4, 0.8, (10, 2))
        found = fit_circle(np.concatenate([*points, wrong]))
        assert found.status == FitStatus.OK and not found.inliers[-10:].any()
        errors.append([*(found.fitted.centre - centre), found.fitted.size[2] - radius])
    assert np.linalg.norm(np.array(errors)[:, :2], axis=1).max() < 0.01
    assert np.abs(np.array(errors)[:, 2]).max() < 0.01


def test_box_to_a_centimetre() -> None:
    truth = MapObject.box(pose(2.0, 0.3, np.pi / 4 + 0.1), 0.8, 0.5)
    corners = truth.outline[::-1]
    plan = FloorPlan.from_walls(np.stack([corners[:-1], corners[1:]], 1), solid=True)
    for seed in range(3):
        scan = simulate_scan(plan, pose(0, 0), FINE, seed=seed).scan
        found = fit_box(scan.points())
        assert found.status == FitStatus.OK
        assert np.linalg.norm(found.fitted.centre - truth.centre) < 0.01
        np.testing.assert_allclose(np.sort(found.fitted.size), np.sort(truth.size), atol=0.01)
        # A box has four equal poses.
        turn = 4 * np.asarray(pga2.motor_to_angle_translation([truth.motor, found.fitted.motor])[0])
        assert abs(np.exp(1j * turn[0]) - np.exp(1j * turn[1])) < 4 * np.radians(1.5)


def test_degenerate_points() -> None:
    line = np.stack([np.arange(20.0), 2 * np.arange(20.0)], 1)
    assert fit_circle(line).status == FitStatus.DEGENERATE
    noisy = 0.05 * line + np.random.default_rng(0).normal(scale=0.01, size=(20, 2))
    assert fit_circle(noisy).status == FitStatus.DEGENERATE
    assert fit_circle(np.full((9, 2), np.nan)).status == FitStatus.TOO_FEW
    assert fit_circle(np.ones((9, 2))).status == FitStatus.TOO_FEW
    assert fit_circle(np.zeros((0, 2))).status == FitStatus.TOO_FEW
    assert fit_box(np.zeros((0, 2))).status == FitStatus.TOO_FEW
    side = np.stack([np.full(40, 2.0), np.linspace(-1, 1, 40)], 1)
    assert fit_box(side).status == FitStatus.DEGENERATE and fit_box(side).fitted is None
    with pytest.raises(ValueError, match="points"):
        fit_circle(np.zeros((4, 3)))


@pytest.mark.parametrize("share, status", [(0.97, FitStatus.OK), (1.03, FitStatus.UNEXPLAINED)])
def test_a_box_leaves_three_degrees_of_freedom_less(share: float, status: FitStatus) -> None:
    """Offsets whose sums, slopes and curvatures vanish are all residuals: noise leaves as much in one of 1,000 fits."""
    signs = np.array([1, -1, -1, 1, -1, 1, 1, -1.0])
    along, off = 1.1 + 0.05 * np.arange(8), 0.01 * np.sqrt(share * chi2.isf(1e-3, 16 - 3) / 16) * signs
    sides = np.concatenate([np.stack([1 + off, along], 1), np.stack([along, 1 + off], 1)])
    found = fit_box(sides, 0.01)
    assert found.status == status and found.inliers.all()


def test_bounds_of_boxes_contain_their_sizes() -> None:
    """Seen at any angle, each size of a box is within its bound, and a side of few points gives no box."""
    rng = np.random.default_rng(5)
    n_found = 0
    for turn in np.radians([0, 4, 10, 30, 45]):
        truth = MapObject.box(pose(2.5, 0.1, turn), 0.9, 0.5)
        corners = truth.outline[::-1]
        plan = FloorPlan.from_walls(np.stack([corners[:-1], corners[1:]], 1), solid=True)
        scan = simulate_scan(plan, pose(0, 0), Scanner(n_beams=721, noise=0.01), seed=int(rng.integers(100))).scan
        found = fit_box(scan.points())
        if found.status == FitStatus.OK:
            n_found += 1
            off = [np.abs(found.fitted.size[:2] - 2 * truth.size[order] / 2) * 2 for order in ([0, 1], [1, 0])]
            assert any((each <= found.bounds).all() for each in off)
        else:
            assert turn < 0.2 and found.fitted is None and np.isnan(found.bounds).all()
    assert n_found >= 2


def test_shapes_that_are_no_circles_are_rarely_fitted() -> None:
    """Corners of walls, ellipses, points at random, and a column at a wall; columns themselves are fitted."""
    turn, step, fitted = np.linspace(0.2, 3.4, 70), np.linspace(0, 1, 35), {}
    column = 0.3 * np.stack([np.cos(turn), np.sin(turn)], 1)
    shapes = {
        "column": column,
        "corner": np.concatenate([np.stack([step[::-1], 0 * step], 1), np.stack([0 * step, step], 1)]) * 0.6,
        "ellipse": np.stack([0.45 * np.cos(2 * turn), 0.3 * np.sin(2 * turn)], 1),
        "random": np.zeros((40, 2)),
        "wall": np.concatenate([column, column[:1] + np.stack([0 * step, -step], 1)]),
    }
    for name, shape in shapes.items():
        fitted[name] = 0
        for seed in range(50):
            rng = np.random.default_rng(seed)
            points = rng.uniform(0, 1.2, shape.shape) if name == "random" else shape
            found = fit_circle(points + rng.normal(0, 0.008, shape.shape) + 3, 0.008)
            right = name == "wall" and found.fitted is not None and abs(found.fitted.size[2] - 0.3) < 0.015
            fitted[name] += found.status == FitStatus.OK and not right
    assert fitted["column"] >= 49
    assert max(n for name, n in fitted.items() if name != "column") <= 4


def test_short_arcs_have_the_right_circle_or_none() -> None:
    """Arcs of 6 to 15 cm of columns of 25 to 50 cm; a fifth was fitted by whole circles of 3 cm."""
    wrong = 0
    for seed in range(150):
        rng = np.random.default_rng(seed)
        radius, n = rng.uniform(0.25, 0.5), int(rng.integers(20, 70))
        turn = rng.uniform(0.06, 0.15) / radius * np.linspace(-0.5, 0.5, n)
        points = radius * np.stack([np.cos(turn), np.sin(turn)], 1) + rng.normal(0, 0.01, (n, 2))
        found = fit_circle(points, 0.01)
        wrong += found.fitted is not None and found.fitted.size[2] < 0.1
    assert wrong <= 5
