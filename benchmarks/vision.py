"""Compare vision algorithms with OpenCV and PoseLib, for single problems and for batches."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.vision import (
    Camera,
    LandmarkMap,
    OmnidirectionalCamera,
    calibrate_from_planes,
    factorize,
    fundamental_matrices,
    fundamental_matrix,
    hand_eye,
    hand_eye_from_poses,
    homographies,
    homography,
    invariants_3d,
    localizations,
    localize,
    quadrifocal_tensor,
    relative_pose,
    robust_fundamental_matrix,
    robust_homography,
    triangulate,
    trifocal_tensor,
)
from generated import pga3

from . import pages, vision_bundles
from .libraries import installed
from .machine import version
from .markdown import paragraph
from .tasks import OURS, Task, interleaved, others_text, time_text

PAGE = Path("docs/vision-speed.md")
ROUNDS = 15


def tasks(quick: bool) -> list[Task]:
    """Return all problems, with the calls of installed libraries."""
    rng = np.random.default_rng(0)
    cv2: Any = __import__("cv2") if installed("cv2") else None
    poselib: Any = __import__("poselib") if installed("poselib") else None
    views = [*_views(rng, cv2, poselib, quick), *_relative_poses(cv2, poselib, quick)]
    found = [*_hands(rng, cv2, quick), *views, *_many(rng, cv2, quick)]
    return [*found, *vision_bundles.tasks(rng, quick)]


def _poses(rng: np.random.Generator, *shape: int) -> Any:
    turns = rng.normal(size=(*shape, 3))
    turns *= rng.uniform(0.2, 1.4, (*shape, 1)) / np.linalg.norm(turns, axis=-1, keepdims=True)
    return pga3.motor_from_rotation_vector_translation(turns, rng.normal(size=(*shape, 3)))


def _hands(rng: np.random.Generator, cv2: Any, quick: bool) -> list[Task]:
    count = 20 if quick else 1000
    x, z, hands = _poses(rng, count, 1), _poses(rng, count, 1), _poses(rng, count, 20)
    eyes = pga3.motor_product(pga3.motor_product(pga3.motor_inverse(z), hands), x)
    eyes = pga3.motor_product(eyes, pga3.motor_exponential(1e-3 * rng.normal(size=(count, 20, 6))))
    motions = [pga3.motor_product(pga3.motor_inverse(p), np.roll(p, 1, axis=1)) for p in (hands, eyes)]
    one = {OURS: lambda: hand_eye(motions[0][0], motions[1][0])}
    both = {OURS: lambda: hand_eye_from_poses(hands[0], eyes[0])}
    if cv2 is not None:
        a = pga3.motor_to_matrix(hands[0])
        b = pga3.motor_to_matrix(pga3.motor_inverse(eyes[0]))
        for name in ("DANIILIDIS", "PARK"):
            method = getattr(cv2, f"CALIB_HAND_EYE_{name}")
            call = _opencv_hand_eye(cv2, a, b, method)
            one[f"OpenCV {name.title()}"] = both[f"OpenCV {name.title()}"] = call
    return [
        Task("hand-eye calibration from 20 motions (OpenCV: 20 poses)", 1, one),
        Task("hand-eye calibration from 20 poses, including the pose of the target", 1, both),
        Task(f"{count} hand-eye calibrations from 20 motions each", count, {OURS: lambda: hand_eye(*motions)}),
        Task("the same, linear", count, {OURS: lambda: hand_eye(*motions, refine=False)}),
    ]


def _opencv_hand_eye(cv2: Any, a: Any, b: Any, method: int) -> Callable[[], object]:
    return lambda: cv2.calibrateHandEye(a[:, :3, :3], a[:, :3, 3], b[:, :3, :3], b[:, :3, 3], method=method)


def _views(rng: np.random.Generator, cv2: Any, poselib: Any, quick: bool) -> list[Task]:
    cameras = []
    for x in (-1.0, 0.0, 1.0, 0.5):
        pose = pga3.motor_from_rotation_vector_translation(0.1 * rng.normal(size=3), np.array([x, 0.3 * x, -6.0]))
        cameras.append(Camera.from_intrinsics(700.0, (320, 240), pose))
    points = rng.normal(size=(50, 3))
    one, two = (camera.project(points) + 0.5 * rng.normal(size=(50, 2)) for camera in cameras[:2])
    k = cameras[0].intrinsics
    many = rng.normal(size=(60 if quick else 500, 3))
    flat = cameras[1].project(many * [1, 1, 0]) + 0.3 * rng.normal(size=(len(many), 2))
    board = cameras[0].project(many * [1, 1, 0]) + 0.3 * rng.normal(size=(len(many), 2))
    linear = {OURS: lambda: fundamental_matrix(one, two, refine=False)}
    best = {OURS: lambda: fundamental_matrix(one, two)}
    plane = {OURS: lambda: homography(board, flat)}
    pose = {OURS: lambda: localize(points, one, k)}
    if cv2 is not None:
        linear["OpenCV"] = best["OpenCV"] = lambda: cv2.findFundamentalMat(one, two, cv2.FM_8POINT)
        plane["OpenCV"] = lambda: cv2.findHomography(board, flat, 0)
        pose["OpenCV"] = lambda: cv2.solvePnP(points, one, k, None)
    places = rng.normal(size=(100, 3))
    shape = np.stack([_random_camera(rng).project(places) for _ in range(4 if quick else 10)])
    grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0)), -1).reshape(-1, 2) / 4
    boards = [_random_camera(rng).project(np.insert(grid, 2, 0, axis=1)) for _ in range(14)]
    eye = OmnidirectionalCamera.from_intrinsics(400.0, (640, 480), 1.0)
    sights = [rng.normal(size=(10, 2)) / 3 for _ in range(50)]
    rays = [np.insert(each, 2, 1.5, axis=1) @ np.linalg.qr(rng.normal(size=(3, 3)))[0] for each in sights]
    learned = LandmarkMap.learn([each[None] for each in rays])
    return [
        Task("fundamental matrix of two cameras", 1, {OURS: lambda: fundamental_matrix(*cameras[:2])}),
        Task("trifocal tensor of three cameras", 1, {OURS: lambda: trifocal_tensor(*cameras[:3])}),
        Task("quadrifocal tensor of four cameras", 1, {OURS: lambda: quadrifocal_tensor(*cameras)}),
        Task("fundamental matrix from 50 points, linear", 1, linear),
        Task("fundamental matrix from 50 points, least squares (OpenCV: linear)", 1, best),
        Task(f"homography from {len(many)} points", 1, plane),
        Task("pose from 50 points", 1, pose),
        Task(f"factorization of {len(shape)} views of 100 points", 1, {OURS: lambda: factorize(shape)}),
        Task("intrinsics from 14 views of a chessboard", 1, {OURS: lambda: calibrate_from_planes(grid, boards)}),
        Task("recognition of one of 50 landmarks", 1, {OURS: lambda: learned.recognize(rays[7], 1 / 400)}),
        *_robust(cameras[:2], cv2, poselib, quick),
        *_large(rng, cv2, cameras, eye, quick),
    ]


def _robust(cameras: list[Camera], cv2: Any, poselib: Any, quick: bool) -> list[Task]:
    """Return fundamental matrices, homographies and poses from 500 points, with wrong pixels anywhere in the image.

    Every task has ten scenes, since numbers of samples vary, and all libraries have the same confidence.
    """
    rng, n, count = np.random.default_rng(3), 60 if quick else 500, 1 if quick else 10
    found = []
    for what, share in (
        *(("fundamental matrix", each) for each in (0.0, 0.3, 0.5)),
        *(("homography", each) for each in (0.0, 0.3, 0.5, 0.7)),
        *(("pose", each) for each in (0.3, 0.8)),
    ):
        scenes = []
        for _ in range(count):
            points = rng.normal(size=(n, 3)) * [1, 1, what != "homography"]
            a, b = (camera.project(points) + 0.3 * rng.normal(size=(n, 2)) for camera in cameras)
            wrong = rng.random(n) < share
            b[wrong] = rng.uniform(0, [640, 480], (int(wrong.sum()), 2))
            scenes.append((points, b) if what == "pose" else (a, b))
        calls = {}
        for name, call in _robust_calls(what, cameras[0].intrinsics, cv2, poselib).items():
            calls[name] = lambda call=call, scenes=scenes: [call(*scene) for scene in scenes]
        found.append(Task(f"{what} from {n} points, {round(100 * share)} % outliers", count, calls))
    return found


def _robust_calls(what: str, k: Any, cv2: Any, poselib: Any) -> dict[str, Callable[[Any, Any], object]]:
    """Return the functions of all libraries for one scene."""
    model = {"model": "PINHOLE", "width": 640, "height": 480, "params": [700.0, 700.0, 320.0, 240.0]}
    options = {"success_prob": 0.999}
    if what == "fundamental matrix":
        calls: dict[str, Callable[[Any, Any], object]] = {OURS: robust_fundamental_matrix}
        if cv2 is not None:
            calls["OpenCV MAGSAC"] = lambda a, b: cv2.findFundamentalMat(a, b, cv2.USAC_MAGSAC, 1.0, 0.999, 5000)
        if poselib is not None:
            calls["PoseLib"] = lambda a, b: poselib.estimate_fundamental(
                a, b, {"max_epipolar_error": 1.0, **options}, {}
            )
    elif what == "homography":
        calls = {OURS: robust_homography}
        if cv2 is not None:
            calls["OpenCV MAGSAC"] = lambda a, b: cv2.findHomography(a, b, cv2.USAC_MAGSAC, 2.0, None, 5000, 0.999)
        if poselib is not None:
            calls["PoseLib"] = lambda a, b: poselib.estimate_homography(a, b, {"max_reproj_error": 2.0, **options}, {})
    else:
        calls = {OURS: lambda points, b: localize(points, b, k, threshold=2.0)}
        if cv2 is not None:
            sampling = {"iterationsCount": 5000, "reprojectionError": 2.0, "confidence": 0.999}
            calls["OpenCV RANSAC"] = lambda points, b: cv2.solvePnPRansac(points, b, k, None, **sampling)
        if poselib is not None:
            reach = {"max_reproj_error": 2.0, **options}
            calls["PoseLib"] = lambda points, b: poselib.estimate_absolute_pose(b, points, model, reach, {})
    return calls


def _relative_poses(cv2: Any, poselib: Any, quick: bool) -> list[Task]:
    """Return relative poses of ten scenes each, in space and on a plane, with wrong pairs."""
    rng, k, count = np.random.default_rng(1), np.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]]), 1 if quick else 10
    model = {"model": "PINHOLE", "width": 640, "height": 480, "params": [700.0, 700.0, 320.0, 240.0]}
    found = []
    for where in ("space", "a plane"):
        for share in (0.0, 0.3, 0.6, 0.8):
            scenes = [_pairs(rng, k, where == "space", share) for _ in range(count)]

            def ours(scenes: list[Any] = scenes) -> object:
                return [relative_pose(a, b, k, threshold=1.5) for a, b in scenes]

            def opencv(scenes: list[Any] = scenes) -> object:
                return [cv2.findEssentialMat(a, b, k, cv2.USAC_MAGSAC, 0.999, 1.5) for a, b in scenes]

            def theirs(scenes: list[Any] = scenes) -> object:
                options = {"max_epipolar_error": 1.5, "success_prob": 0.999}
                return [poselib.estimate_relative_pose(a, b, model, model, options, {}) for a, b in scenes]

            calls: dict[str, Callable[[], object]] = {OURS: ours}
            if cv2 is not None:
                calls["OpenCV MAGSAC, essential matrix"] = opencv
            if poselib is not None:
                calls["PoseLib"] = theirs
            name = f"relative pose from 200 points of {where}, {round(100 * share)} % outliers"
            found.append(Task(name, count, calls))
    return found


def _pairs(rng: np.random.Generator, k: Any, in_space: bool, share: float) -> tuple[Any, Any]:
    """Return two views of 200 points 4 to 9 baselines away, half a pixel of noise, and wrong pairs."""
    n = 200
    z = rng.uniform(4, 9, n) if in_space else 6 / (1 + 0.4 * rng.normal() * np.linspace(-0.35, 0.35, n))
    points = np.stack([np.linspace(-0.35, 0.35, n) * z, rng.uniform(-0.28, 0.28, n) * z, z], 1)
    shift = rng.normal(size=3)
    turn = rng.normal(size=3)
    motor = pga3.motor_from_rotation_vector_translation(0.1 * turn, shift / np.linalg.norm(shift))
    views = []
    for there in (points, pga3.move_point(motor, points)):
        views.append((there / there[:, 2:] @ k.T)[:, :2] + 0.5 * rng.normal(size=(n, 2)))
    wrong = rng.random(n) < share
    views[1][wrong] = rng.uniform(0, 1, (int(wrong.sum()), 2)) * [640, 480]
    return views[0], views[1]


def _large(
    rng: np.random.Generator, cv2: Any, cameras: list[Camera], eye: OmnidirectionalCamera, quick: bool
) -> list[Task]:
    n = 1000 if quick else 1_000_000
    places = rng.normal(size=(n, 3)) + np.array([0, 0, 3])
    pixels = [camera.project(places) for camera in cameras[:2]]
    image = eye.project(places)
    six = rng.normal(size=(n // 10, 6, 3))
    sights = [camera.project(six) for camera in cameras[:2]]
    matrix = fundamental_matrix(*cameras[:2])
    meets = {OURS: lambda: triangulate(cameras[:2], pixels)}
    if cv2 is not None:
        one, two = (np.ascontiguousarray(x.T) for x in pixels)
        meets["OpenCV"] = lambda: cv2.triangulatePoints(cameras[0].matrix, cameras[1].matrix, one, two)
    return [
        Task(f"triangulation of {n:,} points", n, meets),
        Task(f"omnidirectional projection of {n:,} points", n, {OURS: lambda: eye.project(places)}),
        Task(f"omnidirectional back-projection of {n:,} points", n, {OURS: lambda: eye.directions(image)}),
        Task(f"invariants of {n // 10:,} sets of six points", n // 10, {OURS: lambda: invariants_3d(six)}),
        Task("the same, from two views", n // 10, {OURS: lambda: invariants_3d(*sights, fundamental=matrix)}),
    ]


def _many(rng: np.random.Generator, cv2: Any, quick: bool) -> list[Task]:
    count = 20 if quick else 2000
    k = np.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]])
    views, places = [], rng.normal(size=(count, 12, 3))
    for _ in range(2):
        turns, shifts = 0.2 * rng.normal(size=(count, 3)), rng.normal(size=(count, 3)) + np.array([0, 0, 7.0])
        motors = pga3.motor_from_rotation_vector_translation(turns, shifts)
        there = pga3.move_point(motors[:, None], places)
        views.append(there[..., :2] / there[..., 2:] * 700 + [320, 240] + 0.3 * rng.normal(size=(count, 12, 2)))
    eight, twelve = (
        {OURS: lambda: fundamental_matrices(views[0][:, :8], views[1][:, :8])},
        {OURS: lambda: fundamental_matrices(*views)},
    )
    four, pose = (
        {OURS: lambda: homographies(views[0][:, :4], views[1][:, :4])},
        {OURS: lambda: localizations(places, views[0], k)},
    )
    if cv2 is not None:
        some = range(min(count, 100))

        def each(call: Callable[[int], object], of: int = count) -> Callable[[], object]:
            # A plain Python loop, because OpenCV has no batches.
            return lambda: [call(m % len(some)) for m in range(of)]

        eight["OpenCV"] = each(lambda m: cv2.findFundamentalMat(views[0][m, :8], views[1][m, :8], cv2.FM_8POINT))
        twelve["OpenCV"] = each(lambda m: cv2.findFundamentalMat(views[0][m], views[1][m], cv2.FM_8POINT))
        four["OpenCV"] = each(lambda m: cv2.findHomography(views[0][m, :4], views[1][m, :4], 0))
        pose["OpenCV"] = each(lambda m: cv2.solvePnP(places[m], views[0][m], k, None))
    return [
        Task(f"{count} fundamental matrices from 8 points each", count, eight),
        Task(f"{count} fundamental matrices from 12 points each", count, twelve),
        Task(f"{count} homographies from 4 points each", count, four),
        Task(f"{count} poses from 12 points each", count, pose),
    ]


def _random_camera(rng: np.random.Generator) -> Camera:
    turn = 0.3 * rng.normal(size=3)
    back = pga3.rotor_to_matrix(pga3.rotor_from_rotation_vector(turn))[:, 2] * -6
    return Camera.from_intrinsics(700.0, (320, 240), pga3.motor_from_rotation_vector_translation(turn, back))


def page(found: list[tuple[Task, dict[str, float]]], rounds: int) -> str:
    """Return the page as Markdown."""
    packages = (("OpenCV", "opencv-python-headless"), ("PoseLib", "poselib"))
    peers = " and ".join(f"{name} {version(package)}" for name, package in packages)
    lines = [
        "# Vision compared with OpenCV and PoseLib",
        "",
        paragraph(
            f"`python -m benchmarks vision` writes this page, with {peers} on one thread each.",
            f"Times are microseconds per problem, or per point or problem of a batch: the minimum over {rounds} "
            "rounds, in which the libraries are measured alternately.",
            "Robust methods stop by their own criteria, so their times are for similar results, not for the same "
            "number of steps.",
        ),
        "",
        "| problem | gacompiler | other libraries |",
        "| --- | ---: | --- |",
    ]
    for task, times in found:
        lines.append(f"| {task.name} | {time_text(times[OURS])} | {others_text(times)} |")
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("vision", __doc__, PAGE).parse_args(arguments)
    out: Path = options.out
    rounds = 1 if options.quick else ROUNDS
    found = [(task, interleaved(task, rounds)) for task in tasks(options.quick)]
    return pages.publish("vision", out, page(found, rounds), f"{len(found)} tasks")


if __name__ == "__main__":
    sys.exit(main())
