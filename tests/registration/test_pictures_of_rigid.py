"""Pictures of clouds before and after, and of joint space."""

import numpy as np
import pytest

from algorithms.registration import register_matches
from generated import pga3

pictures = pytest.importorskip("algorithms.registration.pictures_of_rigid", exc_type=ImportError)
registration_pictures = pytest.importorskip("benchmarks.registration_pictures", exc_type=ImportError)


def test_pictures_show_the_points_and_planes():
    rng = np.random.default_rng(0)
    x = rng.normal(size=(60, 3))
    motor = pga3.motor_exponential([0.3, 0.2, 0.1, 0.5, 0.2, 0.1])
    y = np.array(pga3.move_point(motor, x))
    y[40:] = rng.normal(size=(20, 3))
    found = register_matches(x, y)
    before, after = pictures.draw_clouds(x[:40], y[:40], found.motor).axes
    target, source = after.collections
    assert np.allclose(np.array(source._offsets3d), np.array(target._offsets3d), atol=1e-9)
    assert not np.allclose(np.array(before.collections[1]._offsets3d), np.array(target._offsets3d), atol=0.1)
    axes = pictures.draw_joint_space(x, y, found.inliers, found.motor).axes
    assert len(axes) == 3 and all(len(axis.collections) == 3 for axis in axes)


@pytest.mark.filterwarnings("error")
@pytest.mark.slow
def test_pictures_of_few_points(tmp_path):
    rng = np.random.default_rng(0)
    one, cloud = np.eye(8)[0], rng.normal(size=(5, 3))
    for source in (np.full((3, 3), np.nan), [[1, 2, 3]]):
        pictures.draw_clouds(source, cloud, one).draw_without_rendering()
    # Neither inliers nor outliers.
    pictures.draw_joint_space(np.zeros((0, 3)), np.zeros((0, 3)), [], one).savefig(tmp_path / "a.png", dpi=30)
    with pytest.raises(ValueError, match=r"source: shape \(2, 5, 3\); expected \(n, 3\)"):
        pictures.draw_clouds([cloud, cloud], cloud, one)
    with pytest.raises(ValueError, match=r"motor: shape \(4,\)"):
        pictures.draw_clouds(cloud, cloud, one[:4])
    with pytest.raises(ValueError, match=r"shapes \(5, 3\), \(4, 3\), \(5,\); expected \(n, 3\), \(n, 3\), \(n,\)"):
        pictures.draw_joint_space(cloud, cloud[:4], np.ones(5, bool), one)


@pytest.mark.slow
def test_the_pictures_of_the_page_are_small(tmp_path):
    assert registration_pictures.main(["--out", str(tmp_path)]) == 0
    sizes = {path.name: path.stat().st_size for path in tmp_path.iterdir()}
    assert set(sizes) == {"registration.png", "joint-space.png"}
    assert all(1000 < size <= 80_000 for size in sizes.values())
