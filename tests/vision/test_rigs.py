"""Poses of rigs: three points with all solutions, noise, wrong pixels, units, offsets, and what is refused."""

import numpy as np
import pytest
from rig_scenes import motor, offsets, rig, seen_by

from algorithms.vision import Camera, Distortion, VisionStatus, localize, localize_rig
from algorithms.vision.rigs import poses_of_triples
from generated import pga3


def sights(cameras, pixels, which):
    frames = [pga3.motor_to_matrix(cameras[k].pose) for k in which]
    rays = [frame[:3, :3] @ cameras[k].directions(p) for frame, k, p in zip(frames, which, pixels, strict=True)]
    return np.array([frame[:3, 3] for frame in frames]), np.array(rays)


def test_three_points_have_the_true_pose_among_at_most_eight():
    worst = []
    for seed in range(60):
        rng = np.random.default_rng([60, seed])
        cameras, pose = rig(rng), motor(rng.normal(size=3), rng.normal(size=3))
        points, pixels, which, _ = seen_by(rng, cameras, pose, 3, noise=0.0)
        centres, rays = sights(cameras, pixels, which)
        found = poses_of_triples(points[None], centres[None], rays[None])
        truth = np.linalg.inv(pga3.motor_to_matrix(pose))[:3]
        assert 1 <= len(found) <= 8
        worst.append(np.abs(found - truth).max((1, 2)).min())
        for each in found:  # Every solution places the points on their lines of sight, in front.
            off = points @ each[:, :3].T + each[:, 3] - centres
            along = (off * rays).sum(1, keepdims=True)
            assert np.abs(off - along * rays).max() < 1e-6 and (along > 0).all()
    assert np.median(worst) < 1e-12 and np.max(worst) < 1e-7


@pytest.mark.parametrize("n", [4, 6, 40])
def test_errors_are_as_stated(n):
    ratios = []
    for seed in range(12):
        rng = np.random.default_rng([61, n, seed])
        cameras, pose = rig(rng), motor(rng.normal(size=3), 5 * rng.normal(size=3))
        points, pixels, which, _ = seen_by(rng, cameras, pose, n)
        found = localize_rig(points, pixels, cameras, which)
        assert found.status == VisionStatus.OK
        turn, centre = np.linalg.norm(offsets(found.pose, pose).reshape(2, 3), axis=1)
        assert turn < 5 * found.deviation[0] and centre < 5 * found.deviation[1]
        ratios.append(turn / found.deviation[0])
    assert 0.3 < np.median(ratios) < 2


def test_one_camera_or_equal_centres_agree_with_localize():
    rng = np.random.default_rng(62)
    camera = Camera.from_intrinsics(700.0, (320, 240), distortion=Distortion("brown", (-0.1,)))
    pose = motor(rng.normal(size=3), rng.normal(size=3))
    points, pixels, which, _ = seen_by(rng, [camera], pose, 12)
    one, rig_of_one = localize(points, pixels, camera), localize_rig(points, pixels, [camera], which)
    assert np.allclose(one.pose, rig_of_one.pose, atol=1e-6) and np.isclose(one.residual, rig_of_one.residual)
    assert np.allclose(one.deviation, rig_of_one.deviation, rtol=1e-3)
    turned = rig(rng, apart=0.0)
    points, pixels, which, _ = seen_by(rng, turned, pose, 12)
    assert localize_rig(points, pixels, turned, which).status == VisionStatus.OK


@pytest.mark.parametrize("wrong", [0.3, 0.7])
def test_wrong_pixels_are_left_out(wrong):
    rng = np.random.default_rng([63, round(10 * wrong)])
    cameras, pose = rig(rng), motor(rng.normal(size=3), rng.normal(size=3))
    points, pixels, which, bad = seen_by(rng, cameras, pose, 120, wrong=wrong)
    found = localize_rig(points, pixels, cameras, which, threshold=2.0)
    assert found.status == VisionStatus.OK and found.inliers[~bad].mean() > 0.95 and found.inliers[bad].mean() < 0.05
    assert np.abs(offsets(found.pose, pose)).max() < 0.02
    assert localize_rig(points, pixels, cameras, which).status == VisionStatus.NOT_CONVERGED
    random = rng.uniform(0, 480, pixels.shape)
    assert (
        localize_rig(points, random, cameras, which, threshold=2.0, max_samples=500).status == VisionStatus.NO_CONSENSUS
    )


@pytest.mark.parametrize(("unit", "origin"), [(1e-3, 0.0), (1e3, 0.0), (1.0, 1e6)])
def test_units_and_origins_do_not_matter(unit, origin):
    rng = np.random.default_rng(64)
    cameras, pose = rig(rng), motor(rng.normal(size=3), rng.normal(size=3))
    points, pixels, which, _ = seen_by(rng, cameras, pose, 15)
    plain = localize_rig(points, pixels, cameras, which)
    frames = [pga3.motor_to_matrix(each.pose) for each in cameras]
    for frame in frames:
        frame[:3, 3] *= unit
    scaled = [Camera(c.intrinsics, pga3.motor_from_matrix(f)) for c, f in zip(cameras, frames, strict=True)]
    found = localize_rig(unit * points + origin, pixels, scaled, which)
    expected = pga3.motor_to_matrix(plain.pose)
    expected[:3, 3] = unit * expected[:3, 3] + origin
    assert found.status == VisionStatus.OK
    assert np.allclose(pga3.motor_to_matrix(found.pose), expected, rtol=1e-6, atol=1e-6 * unit)


def test_cameras_that_look_inward_at_points_about_the_origin_of_the_rig():
    """The centroid of the points is at the origin of the rig, where a unit by their distance would be 0."""
    rng = np.random.default_rng(65)
    cameras = [
        Camera.from_intrinsics(
            500.0, (320, 240), pga3.motor_product(motor([0, a, 0], [0, 0, 0]), motor([0, 0, 0], [0, 0, -4.0]))
        )
        for a in (0, 2.1, 4.2)
    ]
    points = rng.normal(size=(20, 3)) * 0.5
    points -= points.mean(0)
    which = np.repeat([0, 1, 2], 20)
    pixels = np.concatenate([camera.project(points) for camera in cameras])
    found = localize_rig(np.tile(points, (3, 1)), pixels + rng.normal(0, 0.3, pixels.shape), cameras, which)
    assert found.status == VisionStatus.OK and np.abs(found.pose - np.eye(8)[0]).max() < 0.01


def test_what_is_refused():
    rng = np.random.default_rng(66)
    cameras, pose = rig(rng), motor(rng.normal(size=3), rng.normal(size=3))
    points, pixels, which, _ = seen_by(rng, cameras, pose, 8)
    assert localize_rig(points[:3], pixels[:3], cameras, which[:3]).status == VisionStatus.TOO_FEW
    assert localize_rig(points[:0], pixels[:0], cameras, which[:0]).status == VisionStatus.TOO_FEW
    assert localize_rig(np.where(points > 1, np.nan, points), pixels, cameras, which).status == VisionStatus.NOT_FINITE
    assert localize_rig(points[[0] * 8], pixels, cameras, which).status == VisionStatus.TOO_FEW
    line = np.linspace(0, 1, 8)[:, None] * [1.0, 0.2, 0.1] + [0, 0, 5]
    seen = cameras[1].project(line)
    assert localize_rig(line, seen, cameras, np.ones(8, int)).status == VisionStatus.DEGENERATE
    with pytest.raises(ValueError, match="camera: numbers from 0 to 3"):
        localize_rig(points, pixels, cameras, np.arange(8) % 4)
    with pytest.raises(ValueError, match=r"camera: shape \(7,\)"):
        localize_rig(points, pixels, cameras, which[:7])
    with pytest.raises(TypeError, match="camera: dtype float64"):
        localize_rig(points, pixels, cameras, which * 1.0)
    with pytest.raises(ValueError, match="cameras: none"):
        localize_rig(points, pixels, [], which)
    with pytest.raises(ValueError, match="threshold: 0"):
        localize_rig(points, pixels, cameras, which, threshold=0)
