"""Bundle adjustment: minima of scipy, derivatives, exact scenes, losses, gauge and lenses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import scipy
from bundle_scenes import BundleScene, Oracle, bundle_scene, disturbed

from algorithms.vision import BundleAdjustment, Camera, VisionStatus, bundle_adjust, localize
from generated import bundles, pga3

Array = np.ndarray[Any, Any]


def ours(scene: BundleScene, start: tuple[list[Camera], Array], **options: Any) -> BundleAdjustment:
    return bundle_adjust(start[0], start[1], scene.table, **options)


def scipys(oracle: Oracle, c: int, m: int, n_lens: int = 0, **options: Any) -> float:
    """The cost of scipy's minimum over all cameras but the first and all points, without a scale that is held."""
    lens0 = np.zeros(0)
    if n_lens:
        lens0 = np.append(oracle.k[0][[0, 1, 0, 1], [0, 1, 2, 2]], np.zeros(n_lens - 4))

    def residuals(x: Array) -> Array:
        motions = np.concatenate([np.zeros((1, 6)), x[: 6 * (c - 1)].reshape(-1, 6)])
        moves = x[6 * (c - 1) : 6 * (c - 1) + 3 * m].reshape(-1, 3)
        lens = lens0 + x[6 * (c - 1) + 3 * m :] if n_lens else None
        return oracle.residuals(motions, moves, lens).ravel()

    x = np.zeros(6 * (c - 1) + 3 * m + n_lens)
    found = scipy.optimize.least_squares(residuals, x, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac", **options)
    return float(found.cost)


def test_minimum_is_scipys() -> None:
    scene = bundle_scene(4, 12, seed=11, noise=1.0, share=0.9)
    start = disturbed(scene)
    found = ours(scene, start)
    assert found.status == VisionStatus.OK
    seen = np.bincount(scene.table.point, minlength=12) >= 2
    assert np.array_equal(found.point_status == VisionStatus.OK, seen)
    assert seen.all()
    assert found.cost == pytest.approx(scipys(Oracle(*start, scene.table), 4, 12), rel=1e-9)
    again = Oracle(list(found.cameras), found.points, scene.table).residuals(np.zeros((4, 6)), np.zeros((12, 3)))
    np.testing.assert_allclose(found.residuals, np.linalg.norm(again, axis=1), atol=1e-9)
    assert found.cost == pytest.approx(0.5 * float((again**2).sum()), rel=1e-12)


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_robust_minimum_is_scipys(loss: str) -> None:
    """scipy applies its loss to single numbers, so residuals are scaled to the root of the loss of a pixel."""
    scene = bundle_scene(3, 10, seed=12, noise=0.5, share=1.0)
    scene.table.pixels[::17] += 9.0
    start = disturbed(scene, 0.005)
    oracle = Oracle(*start, scene.table)
    plain = oracle.residuals

    def rooted(motions: Array, moves: Array, lens: Array | None = None) -> Array:
        off = plain(motions, moves)
        s = (off**2).sum(1)
        far = 2 * 1.5 * np.sqrt(np.maximum(s, 1.5**2)) - 1.5**2
        losses = np.where(s > 1.5**2, far, s) if loss == "huber" else 1.5**2 * np.log1p(s / 1.5**2)
        return off * np.sqrt(losses / s)[:, None]

    oracle.residuals = rooted  # type: ignore[method-assign]
    found = ours(scene, start, loss=loss, scale=1.5)
    assert found.status == VisionStatus.OK
    assert found.cost == pytest.approx(scipys(oracle, 3, 10), rel=1e-8)
    assert found.weights[::17].max() < 0.5 and np.median(found.weights) > 0.8


@pytest.mark.parametrize("model", ["brown", "fisheye"])
@pytest.mark.slow
def test_lens_minimum_is_scipys(model: str) -> None:
    scene = bundle_scene(4, 25, seed=13, noise=0.3, share=1.0)
    start = disturbed(scene, 0.005)
    n = 8 if model == "brown" else 4
    names = ("fx", "fy", "cx", "cy", *(("k1", "k2", "p1", "p2") if model == "brown" else ("k1", "k2")))
    found = ours(scene, start, distortion=model, intrinsics="shared", estimated=names)
    assert found.status == VisionStatus.OK

    class Part(Oracle):
        def residuals(self, motions: Array, moves: Array, lens: Array | None = None) -> Array:
            assert lens is not None
            return super().residuals(motions, moves, np.append(lens, np.zeros(4 + n - len(lens))))

    expected = scipys(Part(*start, scene.table, model), 4, 25, len(names))
    # With derivatives by differences, scipy stops a little above the minimum, on some processors by more than 1e-9.
    assert found.cost <= (1 + 1e-9) * expected
    assert found.cost == pytest.approx(expected, rel=1e-7)
    assert found.lens_covariance.shape == (1, len(names), len(names))


def lens_of(model: str, rng: np.random.Generator) -> Array:
    n = {"pinhole": 0, "brown": 8, "fisheye": 4}[model]
    return np.concatenate([[600.0, 580.0, 320.0, 240.0, 0.0], 0.05 * rng.normal(size=n)])


@pytest.mark.parametrize("model", ["pinhole", "brown", "fisheye"])
def test_derivatives(model: str) -> None:
    """The columns of the equations against differences of the oracle, in which the camera moves by its own frame."""
    rng = np.random.default_rng(5)
    scene = bundle_scene(1, 6, seed=14, noise=3.0, share=1.0)
    view, table, lens = scene.cameras[0], scene.table, lens_of(model, rng)
    k = len(table.camera)
    seen = np.tile(view.pose, (k, 1)), scene.points[table.point], np.tile(lens, (k, 1)), table.pixels
    kernel = getattr(bundles, f"{model}_lens_equations")
    rest, by_camera, by_point, square, by_lens = kernel(*seen, np.ones(k), np.ones(k), 0.0, 1.0, 0.0)
    short = getattr(bundles, f"{model}_equations")(*seen, np.ones(k), np.ones(k), 0.0, 1.0, 0.0)
    for one, two in zip(short, (rest, by_camera, by_point, square), strict=True):
        np.testing.assert_allclose(one, two, rtol=1e-13, atol=1e-12)

    def residuals(x: Array) -> Array:
        motion = pga3.motor_from_rotation_vector_translation(x[:3], x[3:6])
        moved = Camera(view.intrinsics, pga3.motor_product(view.pose, motion))
        numbers = lens + x[9:]
        moved.intrinsics[0, 1] = 0.0
        oracle = Oracle([moved], scene.points, table, model)
        skewed = np.delete(numbers, 4)
        plain = oracle.residuals(np.zeros((1, 6)), np.tile(x[6:9], (6, 1)), skewed)
        y = (plain[:, 1] + table.pixels[:, 1] - numbers[3]) / numbers[1]
        return plain + np.stack([numbers[4] * y, 0 * y], 1)

    h, n = 1e-6, 9 + len(lens)
    np.testing.assert_allclose(rest, residuals(np.zeros(n)), atol=1e-9)
    np.testing.assert_allclose(square, (rest**2).sum(1), rtol=1e-12)
    columns = [(residuals(h * e) - residuals(-h * e)) / (2 * h) for e in np.eye(n)]
    found = np.concatenate([by_camera, by_point, by_lens], 2)
    for column, expected in zip(np.moveaxis(found, 2, 0), columns, strict=True):
        np.testing.assert_allclose(column, expected, rtol=1e-6, atol=1e-6 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("kind", [1, 2])
@pytest.mark.parametrize("curved", [0.0, 0.5, 0.9])
def test_curvature_of_losses(kind: int, curved: float) -> None:
    """The gradient is that of half the loss; along the residual, its curvature is kept up to a part."""
    scene = bundle_scene(1, 30, seed=45, noise=3.0, share=1.0)
    k, scale = len(scene.table.camera), 2.5
    seen = (np.tile(scene.cameras[0].pose, (k, 1)), scene.points[scene.table.point],
            np.tile([600.0, 610, 320, 240, 0], (k, 1)), scene.table.pixels)  # fmt: skip
    ones = np.ones(k)
    off, _, plain, s = bundles.pinhole_equations(*seen, ones, ones, 0.0, 1.0, 0.0)
    rest, _, rows, _ = bundles.pinhole_equations(*seen, ones, ones, float(kind), scale, curved)
    assert (s > scale**2).any() and (s < scale**2).any()

    def loss(t: Array) -> Array:
        if kind == 2:
            return scale**2 * np.log1p(t / scale**2)
        return np.where(t > scale**2, 2 * scale * np.sqrt(t) - scale**2, t)

    h = 1e-3
    first = (loss(s + h) - loss(s - h)) / (2 * h)
    second = (loss(s + h) - 2 * loss(s) + loss(s - h)) / h**2
    gradient = first[:, None] * np.einsum("kri,kr->ki", plain, off)
    np.testing.assert_allclose(np.einsum("kri,kr->ki", rows, rest), gradient, rtol=1e-6)
    bend = np.minimum(-2 * second * s / first, curved)
    middle = first[:, None, None] * (np.eye(2) - (bend / s)[:, None, None] * off[:, :, None] * off[:, None])
    expected = np.swapaxes(plain, 1, 2) @ middle @ plain
    np.testing.assert_allclose(np.swapaxes(rows, 1, 2) @ rows, expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize(("offset", "unit"), [(0.0, 1.0), (0.0, 1e-3), (0.0, 1e3), (1e6, 1.0)])
def test_exact_scenes_are_recovered(offset: float, unit: float) -> None:
    """The gauge is that of the truth: its first camera, and the distance of the camera whose distance is held."""
    scene = bundle_scene(6, 40, seed=15, noise=0.0, offset=offset, unit=unit)
    cameras, points = disturbed(scene, 0.01, unit)
    cameras[1] = scene.cameras[1]
    found = ours(scene, (cameras, points), fixed_cameras=[0, 1])
    assert found.status == VisionStatus.OK
    error = 1e-9 * unit + 1e-14 * offset * 100
    ok = found.point_status == VisionStatus.OK
    assert ok.sum() > 30
    assert np.abs(found.points - scene.points)[ok].max() < error
    centres = [pga3.motor_to_matrix(np.array([each.pose for each in some]))[:, :3, 3]
               for some in (found.cameras, scene.cameras)]  # fmt: skip
    assert np.abs(centres[0] - centres[1]).max() < error
    assert np.array_equal(found.points[~ok], points[~ok])


def test_default_gauge() -> None:
    """The first camera and the distance of the farthest are not changed, and the minimum does not depend on them."""
    scene = bundle_scene(6, 40, seed=16, noise=0.5)
    start = disturbed(scene)
    found = ours(scene, start)
    assert np.array_equal(found.cameras[0].pose, start[0][0].pose)
    before, after = (pga3.motor_to_matrix(np.array([each.pose for each in some]))[:, :3, 3]
                     for some in (start[0], found.cameras))  # fmt: skip
    distance = np.linalg.norm(before - before[0], axis=1)
    kept = np.isclose(np.linalg.norm(after - after[0], axis=1), distance, rtol=1e-12, atol=0)
    kept[0] = False
    assert kept.sum() == 1
    far = int(kept.argmax())
    assert np.linalg.norm(after[far] - after[0]) == pytest.approx(distance[far], rel=1e-12)
    assert not np.array_equal(after[far], before[far])
    known = np.zeros(40, bool)
    known[np.flatnonzero(found.point_status == VisionStatus.OK)[:5]] = True
    moved = np.where(known[:, None], found.points, start[1])
    other = bundle_adjust(start[0], moved, scene.table, fixed_points=known)
    assert other.cost == pytest.approx(found.cost, rel=1e-9) and np.array_equal(other.points[known], moved[known])
    assert other.camera_covariance[1].max() > 0


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_wrong_observations(loss: str) -> None:
    """Of ten pixels one is wrong by up to 100: with a robust loss the truth is found, without one it is not OK."""
    scene = bundle_scene(8, 60, seed=17, noise=0.3, share=0.8)
    wrong = scene.rng.random(len(scene.table.point)) < 0.1
    scene.table.pixels[wrong] += scene.rng.uniform(-100, 100, (int(wrong.sum()), 2))
    cameras, points = disturbed(scene, 0.01)
    cameras[1] = scene.cameras[1]
    found = bundle_adjust(cameras, points, scene.table, loss=loss, fixed_cameras=[0, 1])
    plain = bundle_adjust(cameras, points, scene.table, fixed_cameras=[0, 1])
    errors = [np.median(np.linalg.norm(each.points - scene.points, axis=1)) for each in (found, plain)]
    assert errors[0] < (0.02 if loss == "huber" else 0.01) and errors[1] > 5 * errors[0]
    assert plain.status == VisionStatus.NOT_CONVERGED
    assert np.median(found.weights[wrong]) < 0.1 and np.median(found.weights[~wrong]) > 0.7


@pytest.mark.parametrize("intrinsics", ["shared", "each", (0, 0, 0, 1, 1, 1)])
def test_lenses_are_recovered(intrinsics: str | tuple[int, ...]) -> None:
    """Lenses of cameras that look at one point are nearly undetermined: with the usual noise, these are not OK."""
    scene = bundle_scene(6, 80, seed=18, noise=0.0, share=1.0)
    numbers = np.tile([590.0, 600.0, 325.0, 236.0, -0.1, 0.02, 0.001, -0.002, 0.0, 0, 0, 0], (6, 1))
    groups = np.arange(6) if intrinsics == "each" else np.zeros(6, int) if intrinsics == "shared" else intrinsics
    numbers[:, 0] += 3.0 * np.asarray(groups)
    oracle = Oracle(scene.cameras, scene.points, replace(scene.table, pixels=0 * scene.table.pixels), "brown")
    pixels = np.zeros_like(scene.table.pixels)
    for i, lens in enumerate(numbers):
        pixels[scene.table.camera == i] = oracle.residuals(np.zeros((6, 6)), np.zeros((80, 3)), lens)[
            scene.table.camera == i
        ]
    cameras, points = disturbed(scene, 0.003)
    names = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
    found = bundle_adjust(
        cameras, points, (scene.table.camera, scene.table.point, pixels), distortion="brown", intrinsics=intrinsics,
        estimated=names, noise=1e-3,
    )  # fmt: skip
    assert found.status == VisionStatus.OK and found.residuals.max() < 1e-9
    k = np.array([each.intrinsics[[0, 1, 0, 1], [0, 1, 2, 2]] for each in found.cameras])
    np.testing.assert_allclose(k, numbers[:, :4], atol=1e-4)
    np.testing.assert_allclose(found.distortion[:, :4], numbers[:, 4:8], atol=1e-6)


def test_a_camera_of_known_points() -> None:
    """Resection is a special case: the minimum is that of `localize`, which is compared with OpenCV's."""
    scene = bundle_scene(1, 20, seed=43, share=1.0)
    start = pga3.motor_product(scene.cameras[0].pose, pga3.motor_from_rotation_vector_translation(
        np.array([0.1, -0.1, 0.05]), np.array([0.2, 0.1, -0.3])
    ))  # fmt: skip
    view = Camera(scene.cameras[0].intrinsics, start)
    found = bundle_adjust([view], scene.points, scene.table, fixed_points=np.ones(20, bool))
    expected = localize(scene.points, scene.table.pixels, view.intrinsics)
    assert found.status == VisionStatus.OK and not found.point_status.any()
    assert found.cost == pytest.approx(0.5 * 20 * expected.residual**2, rel=1e-9)
    np.testing.assert_allclose(
        pga3.motor_to_matrix(found.poses[0]), pga3.motor_to_matrix(expected.pose), rtol=0, atol=1e-6
    )
    deviation = [np.sqrt(np.linalg.eigvalsh(part)[-1]) for part in (found.camera_covariance[0, :3, :3],
                                                                    found.camera_covariance[0, 3:, 3:])]  # fmt: skip
    assert deviation[0] == pytest.approx(float(expected.deviation[0]), rel=0.02)
    assert np.array_equal(found.points, scene.points)


@dataclass(frozen=True, slots=True)
class Bent:
    """The distortion of a lens."""

    model: str
    coefficients: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class BentCamera(Camera):
    """A camera with the distortion of its lens."""

    distortion: Bent | None = None


def test_cameras_with_distortion_of_their_own() -> None:
    """The minimum is that with the distortion as an argument, and cameras keep what was adjusted."""
    scene = bundle_scene(4, 30, seed=44, share=1.0)
    k = (-0.05, 0.01, 0.001, 0.0, 0.0, 0.0, 0.0, 0.0)
    bent = [BentCamera(each.intrinsics, each.pose, Bent("brown", k)) for each in scene.cameras]
    options: dict[str, Any] = dict(intrinsics="shared", estimated=("f", "k1"))
    found = bundle_adjust(bent, scene.points, scene.table, **options)
    expected = bundle_adjust(scene.cameras, scene.points, scene.table, distortion="brown", coefficients=k, **options)
    assert found.cost == expected.cost and np.array_equal(found.distortion, expected.distortion)
    for camera, row in zip(found.cameras, found.distortion, strict=True):
        assert isinstance(camera, BentCamera) and camera.distortion is not None
        assert camera.distortion.coefficients == tuple(row) and row[0] != k[0] and row[1] == k[1]
    with pytest.raises(ValueError, match="given beside cameras with distortion"):
        bundle_adjust(bent, scene.points, scene.table, distortion="brown")
    mixed = [BentCamera(each.intrinsics, each.pose, Bent("fisheye", k[:4])) for each in scene.cameras[:2]]
    with pytest.raises(ValueError, match="fisheye lenses and others"):
        bundle_adjust([*mixed, *bent[2:]], scene.points, scene.table)
