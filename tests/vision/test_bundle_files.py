"""Problems of bundle adjustment in files: BAL and COLMAP, by their own definitions, round trips and errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundle_scenes import bundle_scene, distorted, disturbed, rotation

from algorithms.vision import (
    BalProblem,
    Camera,
    Observations,
    VisionStatus,
    bundle_adjust,
    read_bal,
    read_colmap,
    write_bal,
    write_colmap,
)

Array = np.ndarray[Any, Any]

BAL = """2 3 4
0 0 1.5 -2.25
1 0     -3.000000e+00 4
0 2 0.1 0.2
1 1 7 8
0.1
0.2
-0.3
1
2
-9
500
-0.1
0.01
-0.2 0.1 0.3 0.5 -1 -8
450 0 0
0.1 0.2 0.3
1 1 1
-1 -0.5 0.25
"""


def bal_residuals(problem: BalProblem) -> Array:
    """The formula of the collection: P = R X + t, p = -P / P.z, f (1 + k1 |p|^2 + k2 |p|^4) p."""
    seen, rows = problem.observations, problem.parameters[problem.observations.camera]
    there = (rotation(rows[:, :3]) @ problem.points[seen.point][:, :, None])[:, :, 0] + rows[:, 3:6]
    p = -there[:, :2] / there[:, 2:]
    s = (p**2).sum(1)
    return (rows[:, 6] * (1 + rows[:, 7] * s + rows[:, 8] * s**2))[:, None] * p - seen.pixels


def test_bal_is_read_as_it_is_defined(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text(BAL)
    found = read_bal(tmp_path / "a.txt")
    assert found.parameters.shape == (2, 9) and found.parameters[1, 6] == 450 and found.points[2, 2] == 0.25
    assert found.observations.camera.tolist() == [0, 1, 0, 1] and found.observations.point.tolist() == [0, 0, 2, 1]
    assert found.observations.pixels[1].tolist() == [-3, 4]
    result = found.problem.adjust(max_steps=0)
    np.testing.assert_allclose(result.residuals, np.linalg.norm(bal_residuals(found), axis=1), rtol=1e-12)


def test_bal_round_trip(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text(BAL)
    found = read_bal(tmp_path / "a.txt")
    noisy = BalProblem(found.parameters + np.pi / 7e5, found.points / 3, found.observations)
    write_bal(tmp_path / "b.txt", noisy)
    again = read_bal(str(tmp_path / "b.txt"))
    for one, two in ((again.parameters, noisy.parameters), (again.points, noisy.points)):
        assert np.array_equal(one, two)
    for name in ("camera", "point", "pixels"):
        assert np.array_equal(getattr(again.observations, name), getattr(noisy.observations, name))


def test_bal_of_cameras(tmp_path: Path) -> None:
    """Cameras of ours, written and read: the same minimum, and cameras that Snavely's formula agrees with."""
    scene = bundle_scene(4, 30, seed=41, noise=0.3, share=1.0)
    square = [Camera.from_intrinsics(600.0, (320, 240), each.pose) for each in scene.cameras]
    pixels = np.concatenate([each.project(scene.points) for each in square]) + 0.3 * scene.rng.normal(size=(120, 2))
    table = Observations(scene.table.camera, scene.table.point, pixels)
    start = disturbed(scene._replace(cameras=square, table=table))
    problem = BalProblem.from_cameras(start[0], start[1], table)
    write_bal(tmp_path / "a.txt", problem)
    read = read_bal(tmp_path / "a.txt")
    before = bundle_adjust(*start, table, max_steps=0)
    np.testing.assert_allclose(np.linalg.norm(bal_residuals(read), axis=1), before.residuals, rtol=1e-9, atol=1e-9)
    result = read.problem.adjust()
    assert result.cost == pytest.approx(bundle_adjust(*start, table).cost, rel=1e-9)
    after = bal_residuals(read.adjusted(result))
    assert 0.5 * float((after**2).sum()) == pytest.approx(result.cost, rel=1e-9)
    with pytest.raises(ValueError, match="expected fx = fy and no skew"):
        BalProblem.from_cameras(scene.cameras, scene.points, scene.table)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("2 3 4", "2 3", r"line 30: \d+ numbers in the file; expected"),
        ("2 3 4", "2 3 four", r"line 1: '2 3 four'; expected the numbers of cameras, points"),
        ("2 3 4", "-2 3 4", r"line 1: -2 3 4; expected numbers that are not negative"),
        ("0 2 0.1 0.2", "0 3 0.1 0.2", r"line 4: camera 0, point 3; expected less than 2 and 3"),
        ("0 2 0.1 0.2", "0 2 x 0.2", r"line 4: 'x 0.2'; expected a camera, a point, x and y"),
        ("0 2 0.1 0.2", "0.5 2 0.1 0.2", r"line 4: '0.5 2'; expected the numbers of a camera and of a point"),
        ("-0.3\n", "nan\n", r"line 8: 'nan'; expected a number of a camera or a point, finite"),
        ("-1 -0.5 0.25\n", "-1 -0.5\n", r"line 19: 45 numbers in the file; expected 46"),
        ("-1 -0.5 0.25\n", "-1 -0.5 0.25\n\n7\n", r"line 21: 47 numbers in the file; expected 46"),
        (BAL, "", r"line 1: ''; expected the numbers"),
    ],
)
def test_bal_errors(tmp_path: Path, old: str, new: str, message: str) -> None:
    (tmp_path / "a.txt").write_text(BAL.replace(old, new))
    with pytest.raises(ValueError, match=r"a\.txt, " + message.replace("line 30", r"line \d+")):
        read_bal(tmp_path / "a.txt")


CAMERAS = """# Camera list with one line of data per camera:
1 OPENCV 640 480 610.5 600.25 320 240 -0.1 0.02 0.001 -0.002
7 PINHOLE 640 480 600 601 319 241
"""
IMAGES = """# Image list with two lines of data per image:
3 0.9 0.1 -0.2 0.05 0.1 0.2 5.5 1 a photograph.jpg
300.5 200.25 12 1.5 2.5 -1 310 222 40
5 1 0 0 0 -1 0 6 7 b.png

8 0.99 0 0.1 0 1 0 6 7 c.png
305.125 210.5 40 299 199 12
"""
POINTS = """# 3D point list with one line of data per point:
12 0.1 -0.2 0.3 255 0 128 0.75 3 0 8 1
40 0.2 0.1 -0.1 1 2 3 1.25 3 2 8 0
"""


def colmap(folder: Path, cameras: str = CAMERAS, images: str = IMAGES, points: str = POINTS) -> Path:
    for name, text in (("cameras.txt", cameras), ("images.txt", images), ("points3D.txt", points)):
        (folder / name).write_text(text)
    return folder


def test_colmap_is_read_as_it_is_defined(tmp_path: Path) -> None:
    """Pixels by the formula of COLMAP: a quaternion and a translation from world to camera, and OpenCV's lens."""
    model = read_colmap(colmap(tmp_path))
    assert [each.name for each in model.images] == ["a photograph.jpg", "b.png", "c.png"]
    assert model.images[0].point_ids.tolist() == [12, -1, 40] and model.points[0].track.tolist() == [[3, 0], [8, 1]]
    assert model.points[0].colour == (255, 0, 128) and len(model.images[1].pixels) == 0
    problem = model.problem
    assert problem.lens_of is not None and problem.lens_of.tolist() == [0, 1, 1]
    assert problem.observations.camera.tolist() == [0, 0, 2, 2]
    assert problem.observations.point.tolist() == [0, 1, 1, 0]
    result = problem.adjust(max_steps=0)
    w, x, y, z = np.array([0.9, 0.1, -0.2, 0.05]) / np.linalg.norm([0.9, 0.1, -0.2, 0.05])
    v = np.array([x, y, z])
    turn = rotation(2 * np.arccos(w) * v / np.linalg.norm(v))
    there = turn @ [0.1, -0.2, 0.3] + [0.1, 0.2, 5.5]
    k = np.array([-0.1, 0.02, 0.001, -0.002, 0, 0, 0, 0])
    u = distorted(there[0] / there[2], there[1] / there[2], k, "brown")
    off = np.array([610.5 * u[0] + 320 - 300.5, 600.25 * u[1] + 240 - 200.25])
    assert result.residuals[0] == pytest.approx(float(np.linalg.norm(off)), rel=1e-12)


def test_colmap_round_trip(tmp_path: Path) -> None:
    model = read_colmap(colmap(tmp_path))
    write_colmap(tmp_path / "new", model)
    again = read_colmap(tmp_path / "new")
    for one, two in zip(model.cameras, again.cameras, strict=True):
        assert (one.id, one.model, one.width, one.height) == (two.id, two.model, two.width, two.height)
        assert np.array_equal(one.params, two.params)
    for left, right in zip(model.images, again.images, strict=True):
        assert (left.id, left.camera_id, left.name) == (right.id, right.camera_id, right.name)
        for name in ("quaternion", "translation", "pixels", "point_ids"):
            assert np.array_equal(getattr(left, name), getattr(right, name))
    for p, q in zip(model.points, again.points, strict=True):
        assert (p.id, p.colour, p.error) == (q.id, q.colour, q.error)
        assert np.array_equal(p.place, q.place) and np.array_equal(p.track, q.track)
    text = (tmp_path / "new" / "images.txt").read_text()
    write_colmap(tmp_path / "new", again)
    assert (tmp_path / "new" / "images.txt").read_text() == text


def test_colmap_adjusted(tmp_path: Path) -> None:
    """A model of many images: adjusted, written and read, it has the cost of the minimum."""
    scene = bundle_scene(4, 30, seed=42, noise=0.3, share=1.0)
    from algorithms.vision import ColmapCamera, ColmapImage, ColmapModel, ColmapPoint
    from generated import pga3

    quaternions, shifts = pga3.motor_to_quaternion_translation(
        pga3.motor_inverse(np.array([each.pose for each in disturbed(scene)[0]]))
    )
    images = tuple(
        ColmapImage(i + 10, q, t, 5, f"{i}.jpg", scene.table.pixels[scene.table.camera == i], np.arange(30) * 2)
        for i, (q, t) in enumerate(zip(quaternions, shifts, strict=True))
    )
    points = tuple(ColmapPoint(2 * j, x, (0, 0, 0), -1.0, np.zeros((0, 2), int)) for j, x in enumerate(scene.points))
    lens = ColmapCamera(5, "OPENCV", 640, 480, np.array([600.0, 610, 320, 240, 0, 0, 0, 0]))
    model = ColmapModel((lens,), images, points)
    options: dict[str, Any] = dict(intrinsics="shared", estimated=("f", "k1"))
    result = model.problem.adjust(**options)
    assert result.status == VisionStatus.OK
    write_colmap(tmp_path, model.adjusted(result))
    again = read_colmap(tmp_path)
    assert again.cameras[0].params[0] == result.cameras[0].intrinsics[0, 0] != 600
    assert again.cameras[0].params[4] == result.distortion[0, 0] != 0
    assert again.problem.adjust(**options, max_steps=0).cost == pytest.approx(result.cost, rel=1e-9)
    assert again.points[3].error == pytest.approx(float(result.residuals[scene.table.point == 3].mean()))


@pytest.mark.parametrize("model", ["SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "FULL_OPENCV", "OPENCV_FISHEYE"])
def test_colmap_lenses(tmp_path: Path, model: str) -> None:
    n = {"SIMPLE_PINHOLE": 3, "SIMPLE_RADIAL": 4, "RADIAL": 5, "FULL_OPENCV": 12, "OPENCV_FISHEYE": 8}[model]
    numbers = 500 + np.arange(n)
    other = "OPENCV_FISHEYE 640 480 600 601 319 241 0 0 0 0" if "FISH" in model else "PINHOLE 640 480 600 601 319 241"
    line = f"1 {model} 640 480 {' '.join(map(str, numbers))}\n7 {other}\n"
    problem = read_colmap(colmap(tmp_path, cameras=line)).problem
    k = problem.cameras[0].intrinsics
    single = model in ("SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL")
    assert [k[0, 0], k[1, 1], k[0, 2], k[1, 2]] == ([500, 500, 501, 502] if single else [500, 501, 502, 503])
    assert problem.distortion == {"SIMPLE_PINHOLE": None, "OPENCV_FISHEYE": "fisheye"}.get(model, "brown")
    if problem.coefficients is not None:
        found = problem.coefficients[0].tolist()
        assert found == (list(range(503, 500 + n)) if single else list(range(504, 500 + n))) + (
            [0] * (len(found) - (n - (3 if single else 4)))
        )
        assert not problem.coefficients[1].any()


@pytest.mark.parametrize(
    ("which", "old", "new", "message"),
    [
        (
            "cameras",
            "7 PINHOLE 640 480 600 601 319 241",
            "7 PINHOLE 640 480 600",
            r"cameras\.txt, line 3: 1 parameters",
        ),
        ("cameras", "7 PINHOLE", "7 LENS", r"cameras\.txt, line 3: model 'LENS'; expected SIMPLE_PINHOLE"),
        ("cameras", "7 PINHOLE", "1 PINHOLE", r"images\.txt, line 4: camera 7; expected one of cameras\.txt"),
        ("cameras", "600 601", "600 abc", r"cameras\.txt, line 3: '600 abc 319 241'; expected CAMERA_ID MODEL"),
        ("images", "5 1 0 0 0 -1", "5 0 0 0 0 -1", r"images\.txt, line 4: a quaternion of length 0"),
        ("images", " b.png", "", r"images\.txt, line 4: '5 1 0 0 0 -1 0 6 7'; expected IMAGE_ID QW"),
        ("images", "1.5 2.5 -1", "1.5 -1", r"images\.txt, line 3: 8 numbers; expected triples X Y POINT3D_ID"),
        ("images", "222 40", "222 41", r"images\.txt, line 3: point 41; expected one of points3D\.txt, or -1"),
        ("images", "8 0.99", "5 0.99", r"images\.txt: id 5 appears twice"),
        ("points", "12 0.1", "12 inf", r"points3D\.txt, line 2: 'inf -0.2 0.3 0.75'; expected POINT3D_ID"),
        ("points", "8 1\n", "8\n", r"points3D\.txt, line 2: .*; expected POINT3D_ID X Y Z"),
    ],
)
def test_colmap_errors(tmp_path: Path, which: str, old: str, new: str, message: str) -> None:
    texts = {"cameras": CAMERAS, "images": IMAGES, "points": POINTS}
    assert old in texts[which]
    with pytest.raises(ValueError, match=message):
        read_colmap(colmap(tmp_path, **{**texts, which: texts[which].replace(old, new)}))


def test_lenses_that_bundle_adjustment_lacks(tmp_path: Path) -> None:
    line = "1 FOV 640 480 600 600 320 240 0.5\n7 PINHOLE 640 480 600 601 319 241\n"
    model = read_colmap(colmap(tmp_path, cameras=line))
    with pytest.raises(ValueError, match="camera 1: model FOV; expected one of SIMPLE_PINHOLE"):
        _ = model.problem
    fisheye = "OPENCV_FISHEYE 640 480 600 601 319 241 0 0 0 0"
    for both in (
        CAMERAS.replace("PINHOLE 640 480 600 601 319 241", fisheye),
        f"1 {fisheye}\n7 PINHOLE 640 480 600 601 319 241\n",
    ):
        with pytest.raises(ValueError, match="fisheye lenses and others"):
            _ = read_colmap(colmap(tmp_path, cameras=both)).problem
