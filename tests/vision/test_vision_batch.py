"""Batches of small problems and completion from views, against true cameras and single problems."""

from __future__ import annotations

from fractions import Fraction
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_views import same_pose, scaled, scene
from test_vision import homogeneous, random_camera, same_up_to_scale

from algorithms.vision import (
    DegenerateError,
    VisionStatus,
    camera_centre,
    complete_points,
    fundamental_matrices,
    fundamental_matrix,
    homographies,
    homography,
    localizations,
    localize,
    projective_depths,
)
from generated import projective2, projective3

Array = np.ndarray[Any, Any]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(21)


@pytest.fixture(scope="module")
def views() -> tuple[list[Any], Array, Array, Array]:
    """300 pairs of cameras, and 12 points each in general position."""
    rng = np.random.default_rng(22)
    cameras, points, one, two = [], [], [], []
    for _ in range(300):
        pair, _, places, (a, b) = scene(rng, 2, 12)
        cameras.append(pair)
        points.append(places)
        one.append(a)
        two.append(b)
    return cameras, np.array(points), np.array(one), np.array(two)


def test_fundamental_matrices(views: Any, rng: np.random.Generator) -> None:
    cameras, points, one, two = views
    one, two = one.copy(), two.copy()
    flat = points[:3] * [1, 1, 0]
    for k in range(3):
        one[k], two[k] = (camera.project(flat[k]) for camera in cameras[k])
    one[3, 2, 1], two[4, 0, 0] = np.nan, np.inf
    found = fundamental_matrices(one.reshape(30, 10, 12, 2), two.reshape(30, 10, 12, 2))
    status, models = found.status.ravel(), found.models.reshape(-1, 3, 3)
    assert found.status.shape == (30, 10)
    assert (status[:3] == VisionStatus.DEGENERATE).all() and (status[3:5] == VisionStatus.NOT_FINITE).all()
    assert np.isnan(models[:5]).all() and (status[5:] == VisionStatus.OK).mean() > 0.99
    for k in np.nonzero(status == VisionStatus.OK)[0]:
        assert same_up_to_scale(scaled(models[k]), scaled(fundamental_matrix(*cameras[k]))) < 1e-7
    few = fundamental_matrices(one[:, :7], two[:, :7])
    assert set(few.status.tolist()) == {VisionStatus.TOO_FEW, VisionStatus.NOT_FINITE}
    one_set = fundamental_matrices(one[9], two[9])
    assert one_set.status == VisionStatus.OK and same_up_to_scale(one_set.models, models[9]) < 1e-12
    assert fundamental_matrices(one[:0], two[:0]).models.shape == (0, 3, 3)
    with pytest.raises(ValueError, match="second: 11 points; expected 12"):
        fundamental_matrices(one, two[:, 1:])


def test_planes_of_ten_points_are_reported_if_noise_is_known(views: Any, rng: np.random.Generator) -> None:
    """Residuals of F miss two of a hundred: of many F that nearly fit, one has smaller residuals than the noise."""
    cameras, points, one, two = views
    flat = [
        np.array([pair[m].project(p[:10] * [1, 1, 0]) for pair, p in zip(cameras, points, strict=True)]) for m in (0, 1)
    ]
    flat = [x + 0.5 * rng.normal(size=x.shape) for x in flat]
    scenes = [x[:, :10] + 0.5 * rng.normal(size=(300, 10, 2)) for x in (one, two)]
    reported = fundamental_matrices(*flat, noise=0.5).status == VisionStatus.DEGENERATE
    refused = fundamental_matrices(*scenes, noise=0.5).status == VisionStatus.DEGENERATE
    assert reported.mean() > 0.99 and refused.mean() < 0.02
    assert 0.9 < (fundamental_matrices(*flat).status == VisionStatus.DEGENERATE).mean() <= reported.mean()
    with pytest.raises(DegenerateError):
        fundamental_matrix(flat[0][0], flat[1][0], noise=0.5)
    with pytest.raises(ValueError, match="noise: 0"):
        fundamental_matrix(one[0], two[0], noise=0)


@pytest.mark.parametrize("n", [4, 9])
def test_homographies(n: int, rng: np.random.Generator) -> None:
    matrices = np.eye(3) + 0.2 * rng.normal(size=(500, 3, 3))
    one = rng.normal(size=(500, n, 2))
    two = projective2.transform_point(matrices[:, None], one)
    one[0] = np.outer(np.arange(n), [1.0, 2])
    one[1, 0] = np.nan
    found = homographies(one, two)
    assert found.status[0] == VisionStatus.DEGENERATE and found.status[1] == VisionStatus.NOT_FINITE
    assert (found.status[2:] == VisionStatus.OK).all()
    off = [same_up_to_scale(a, b) for a, b in zip(found.models[2:], matrices[2:], strict=True)]
    assert np.median(off) < 1e-13 and np.max(off) < 1e-8
    assert same_up_to_scale(found.models[5], homography(one[5], two[5])) < 1e-10
    assert (homographies(one[2:, :3], two[2:, :3]).status == VisionStatus.TOO_FEW).all()


def test_localizations(views: Any, rng: np.random.Generator) -> None:
    cameras, points, one, _ = views
    k = cameras[0][0].intrinsics
    # The same intrinsic parameters for all.
    image = np.array(
        [projective2.transform_point(k @ np.linalg.inv(c[0].intrinsics), x) for c, x in zip(cameras, one, strict=True)]
    )
    places = points.copy()
    places[0] = np.outer(np.arange(12.0), [1, 2, 3])
    places[1, 0] = np.nan
    found = localizations(places, image, k)
    assert found.status[0] == VisionStatus.DEGENERATE and found.status[1] == VisionStatus.NOT_FINITE
    # One camera has a point behind it.
    behind = np.array([pair[0].depth(p).min() < 0 for pair, p in zip(cameras, points, strict=True)])
    assert behind[2:].sum() == 1 and found.models.shape == (300, 8)
    assert (found.status[2:] == np.where(behind[2:], VisionStatus.NOT_CONVERGED, VisionStatus.OK)).all()
    for m in range(2, 300):
        assert behind[m] or same_pose(found.models[m], cameras[m][0].pose) < 1e-8
    noisy = image + 0.5 * rng.normal(size=image.shape)
    many = localizations(points, noisy, k)
    for m in range(0, 300, 15):
        assert same_pose(many.models[m], localize(points[m], noisy[m], k).pose) < 1e-4
    flat = points * [1, 1, 0]
    seen = np.array(
        [
            projective2.transform_point(k @ np.linalg.inv(c[0].intrinsics), c[0].project(p))
            for c, p in zip(cameras, flat, strict=True)
        ]
    )
    on_plane = localizations(flat, seen, k)
    assert (on_plane.status == VisionStatus.OK).mean() > 0.98
    right = on_plane.status == VisionStatus.OK
    off = [same_pose(m, c[0].pose) for m, c, good in zip(on_plane.models, cameras, right, strict=True) if good]
    assert np.quantile(off, 0.98) < 1e-8
    for few in (0, 3):
        assert (localizations(points[:, :few], image[:, :few], k).status == VisionStatus.TOO_FEW).all()


# Depths, completion and self-localisation


def test_the_join_image_with_projective_depths_has_rank_four(rng: np.random.Generator) -> None:
    cameras, _, points, (one, two) = scene(rng, 2, 40)
    matrix = fundamental_matrix(*cameras)
    depths = projective_depths(matrix, one, two)
    join = np.concatenate([homogeneous(one), depths[:, None] * homogeneous(two)], 1)
    values = np.linalg.svd(join / np.abs(join).max(0), compute_uv=False)
    assert values[4] < 1e-12 * values[0] < 1e-6 * values[3]
    # The ratio to Euclidean depths is the same for every point, up to a factor.
    ratio = cameras[1].depth(points) / cameras[0].depth(points) / depths
    assert np.abs(ratio / ratio[0] - 1).max() < 1e-10
    with pytest.raises(ValueError, match="rank"):
        projective_depths(np.eye(3), one, two)


def test_occluded_points_are_completed_by_invariants(rng: np.random.Generator) -> None:
    for _ in range(10):
        cameras, _, _, (one, two, three) = scene(rng, 3, 20)
        matrix = fundamental_matrix(*cameras[:2])
        hidden = rng.permutation(20) < 12
        shown = np.where(hidden[:, None], np.nan, three)
        assert np.abs(complete_points(one, two, shown, matrix) - three).max() < 1e-6
        # With six points alone the camera of the third view is just determined.
        shown[np.nonzero(~hidden)[0][6:]] = np.nan
        assert np.abs(complete_points(one, two, shown, matrix) - three).max() < 1e-4
    shown[np.nonzero(~hidden)[0][5:]] = np.nan
    with pytest.raises(DegenerateError, match="too few") as error:
        complete_points(one, two, shown, matrix)
    assert error.value.status == VisionStatus.TOO_FEW
    with pytest.raises(DegenerateError, match="not finite"):
        complete_points(np.where(hidden[:, None], np.inf, one), two, three, matrix)
    cameras, _, points, _ = scene(rng, 3, 20)
    flat = [camera.project(points * [1, 1, 0]) for camera in cameras]
    with pytest.raises(DegenerateError, match="degenerate"):
        complete_points(*flat, fundamental_matrix(*cameras[:2]))
    with pytest.raises(ValueError, match="third: 19 points"):
        complete_points(one, two, three[1:], matrix)


def test_the_centre_of_a_camera_without_calibration(rng: np.random.Generator) -> None:
    errors = []
    for _ in range(6):
        camera, _ = random_camera(rng)
        points = rng.normal(size=(12, 3))
        centre = projective3.camera_centre(camera.matrix)
        centre = centre[:3] / centre[3]
        pixels = camera.project(points)
        assert np.abs(camera_centre(points, pixels) - centre).max() < 1e-9
        assert np.abs(camera_centre(points[:6], pixels[:6]) - centre).max() < 1e-6
        # The identity of brackets behind it, for the found centre and pixels.
        c, x = np.append(centre, 1), homogeneous(points)
        u = homogeneous(pixels) * [1 / 400, 1 / 400, 1]
        for i, j, k, m, n in list(permutations(range(6), 5))[::97]:
            space = np.linalg.det([c, x[i], x[j], x[k]]) * np.linalg.det([c, x[i], x[m], x[n]])
            space /= np.linalg.det([c, x[i], x[j], x[m]]) * np.linalg.det([c, x[i], x[k], x[n]])
            assert space == pytest.approx(cross(u, i, j, k, m, n), rel=1e-6)
        many = rng.normal(size=(60, 3))
        off = camera_centre(many, camera.project(many) + 0.5 * rng.normal(size=(60, 2))) - centre
        errors.append(np.linalg.norm(off))
    assert np.median(errors) < 0.1
    for bad, status in ((points * [1, 1, 0], "DEGENERATE"), (points[:5], "TOO_FEW"), (points * np.nan, "NOT_FINITE")):
        with pytest.raises(DegenerateError) as error:
            camera_centre(bad, camera.project(points[: len(bad)]))
        assert error.value.status.name == status


def cross(u: Array, i: int, j: int, k: int, m: int, n: int) -> float:
    above = np.linalg.det(u[[i, j, k]]) * np.linalg.det(u[[i, m, n]])
    return float(above / (np.linalg.det(u[[i, j, m]]) * np.linalg.det(u[[i, k, n]])))


@pytest.mark.slow
def test_the_benchmark_writes_its_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    from benchmarks import vision

    out = tmp_path / "page.md"
    assert vision.main(["--quick", "--out", str(out)]) == 0
    rows = [line for line in out.read_text().splitlines() if line.startswith("| ")]
    assert len(rows) == 44 and all(float(row.split(" | ")[1].replace(",", "")) > 0 for row in rows[2:])
    assert vision.main(["--quick", "--out", str(out / "no")]) == 1


@pytest.mark.parametrize("origin", [0, 1000, 10**6])
def test_homographies_of_four_points_are_exact(origin: int) -> None:
    """Rational homographies of whole pixels, by Cramer's rule: weights of three points and of the fourth one."""
    rng = np.random.default_rng(31)
    first, second = rng.integers(0, 600, (2, 40, 4, 2)) + origin
    found = homographies(first, second)
    for model, status, *quads in zip(found.models, found.status, first, second, strict=True):
        (a, p), (b, q) = (_frame([[Fraction(int(x)) for x in (*each, 1)] for each in quad]) for quad in quads)
        if not all(a) or not all(b):
            assert status == VisionStatus.DEGENERATE
            continue
        duals = [_cross(p[j], p[k]) for j, k in ((1, 2), (2, 0), (0, 1))]
        exact = np.array(
            [[float(sum(b[k] / a[k] * q[k][i] * duals[k][j] for k in range(3))) for j in range(3)] for i in range(3)]
        )
        exact /= np.linalg.norm(exact)
        assert status == VisionStatus.OK
        assert min(np.abs(model - exact).max(), np.abs(model + exact).max()) < 1e-12


def _cross(a: list[Fraction], b: list[Fraction]) -> list[Fraction]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _frame(points: list[list[Fraction]]) -> tuple[list[Fraction], list[list[Fraction]]]:
    """The weights of three points whose sum is the fourth, times the determinant of the three, and the three."""
    duals = [_cross(points[j], points[k]) for j, k in ((1, 2), (2, 0), (0, 1))]
    return [sum((x * y for x, y in zip(dual, points[3], strict=True)), Fraction(0)) for dual in duals], points[:3]
