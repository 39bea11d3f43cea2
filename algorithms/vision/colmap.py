"""Reader and writer of models of COLMAP as text: ``cameras.txt``, ``images.txt`` and ``points3D.txt``.

Quaternions (w, x, y, z) and translations are those from world to camera, cameras look along z with y down, and the
centre of the upper left pixel is at (0.5, 0.5). Pixels and principal points are left in these coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from generated import pga3

from ..arguments import Reals
from .bundle_arguments import DISTORTIONS
from .bundle_problem import BundleProblem, integers_of, lines_of, numbers_of, text_of
from .bundle_results import BundleAdjustment, Observations
from .camera import Camera

_MODELS = {
    "SIMPLE_PINHOLE": ("f", "cx", "cy"),
    "PINHOLE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL": ("f", "cx", "cy", "k1"),
    "RADIAL": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"),
    "FULL_OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "SIMPLE_RADIAL_FISHEYE": ("f", "cx", "cy", "k1"),
    "RADIAL_FISHEYE": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV_FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"),
}
"""The numbers of the lens models that `bundle_adjust` has."""
_OTHERS = {"FOV": 5, "THIN_PRISM_FISHEYE": 12, "RAD_TAN_THIN_PRISM_FISHEYE": 16}
"""How many numbers other models of COLMAP have, which are read and written only."""


@dataclass(frozen=True, slots=True, eq=False)
class ColmapCamera:
    """A line of ``cameras.txt``."""

    id: int
    model: str
    width: int
    height: int
    params: Reals


@dataclass(frozen=True, slots=True, eq=False)
class ColmapImage:
    """Two lines of ``images.txt``."""

    id: int
    quaternion: Reals
    """(4,) w, x, y, z from world to camera."""
    translation: Reals
    """(3,)"""
    camera_id: int
    name: str
    pixels: Reals
    """(n, 2)"""
    point_ids: Reals
    """(n,) int; -1 for pixels without a point."""


@dataclass(frozen=True, slots=True, eq=False)
class ColmapPoint:
    """A line of ``points3D.txt``."""

    id: int
    place: Reals
    """(3,)"""
    colour: tuple[int, int, int]
    error: float
    track: Reals
    """(n, 2) int. Ids of images, and rows of their pixels."""


@dataclass(frozen=True, slots=True, eq=False)
class ColmapModel:
    """A model in the conventions of COLMAP, so that reading and writing changes no number."""

    cameras: tuple[ColmapCamera, ...]
    images: tuple[ColmapImage, ...]
    points: tuple[ColmapPoint, ...]

    @property
    def problem(self) -> BundleProblem:
        """The problem of bundle adjustment: a camera for each image, and an observation for each pixel with a point.

        Raises
        ------
        ValueError
            If lens models are not those of `bundle_adjust`, or if some are fisheye lenses and others not.
        """
        numbers = {camera.id: k for k, camera in enumerate(self.cameras)}
        lens_of = np.array([numbers[image.camera_id] for image in self.images], np.int64)
        lenses = [_lens(camera) for camera in self.cameras]
        kinds = {kind for kind, _, _ in lenses}
        if "fisheye" in kinds and len(kinds) > 1:
            raise ValueError("cameras: fisheye lenses and others; expected one kind, as in separate models")
        kind = next(iter(kinds - {"pinhole"}), "pinhole")  # Brown's lens without distortion is a pinhole.
        width = len(DISTORTIONS[kind])
        bent = np.zeros((len(lenses), width))
        for row, (_, _, k) in zip(bent, lenses, strict=True):
            row[: len(k)] = k
        poses = np.zeros((0, 8))
        if self.images:
            poses = pga3.motor_inverse(
                pga3.motor_from_quaternion_translation(
                    np.array([each.quaternion / np.linalg.norm(each.quaternion) for each in self.images]),
                    np.array([each.translation for each in self.images]),
                )
            )
        cameras = tuple(Camera(lenses[lens][1], pose) for lens, pose in zip(lens_of, poses, strict=True))
        rows = {point.id: k for k, point in enumerate(self.points)}
        tables = [np.flatnonzero(image.point_ids != -1) for image in self.images]
        camera = np.repeat(np.arange(len(self.images)), [len(table) for table in tables])
        seen = [
            rows[i] for image, table in zip(self.images, tables, strict=True) for i in image.point_ids[table].tolist()
        ]
        pixels = [image.pixels[table] for image, table in zip(self.images, tables, strict=True)]
        return BundleProblem(
            cameras,
            np.array([point.place for point in self.points]).reshape(-1, 3),
            Observations(camera, np.array(seen, np.int64), np.concatenate([np.zeros((0, 2)), *pixels])),
            None if kind == "pinhole" else kind,
            None if kind == "pinhole" else bent[lens_of],
            lens_of,
        )

    def adjusted(self, result: BundleAdjustment) -> ColmapModel:
        """Return the model with the cameras, lenses and points of a result of ``problem.adjust``.

        Lenses keep their model; coefficients that it lacks must not have been estimated. Errors of points are the mean
        distances of their pixels.
        """
        used = {image.camera_id: k for k, image in reversed(list(enumerate(self.images)))}
        cameras = tuple(
            replace(each, params=_params(each, result, used[each.id])) if each.id in used else each
            for each in self.cameras
        )
        images = self.images
        if images:
            quaternions, places = pga3.motor_to_quaternion_translation(pga3.motor_inverse(result.poses))
            images = tuple(
                replace(each, quaternion=q, translation=t)
                for each, q, t in zip(images, quaternions, places, strict=True)
            )
        table = self.problem.observations.point
        count = np.maximum(np.bincount(table, minlength=len(self.points)), 1)
        errors = np.bincount(table, np.nan_to_num(result.residuals), minlength=len(self.points)) / count
        points = tuple(
            replace(each, place=place, error=float(error))
            for each, place, error in zip(self.points, result.points, errors, strict=True)
        )
        return ColmapModel(cameras, images, points)


def _lens(camera: ColmapCamera) -> tuple[str, Reals, Reals]:
    """Return the kind of a lens, the matrix K, and the coefficients of the distortion."""
    if camera.model not in _MODELS:
        raise ValueError(f"camera {camera.id}: model {camera.model}; expected one of {', '.join(_MODELS)}")
    given = dict(zip(_MODELS[camera.model], camera.params.tolist(), strict=True))
    fx, fy = (given.get(name, given.get("f")) for name in ("fx", "fy"))
    kind = "fisheye" if "FISHEYE" in camera.model else "brown" if "k1" in given else "pinhole"
    k = np.array([given.get(name, 0.0) for name in DISTORTIONS[kind]])
    return kind, np.array([[fx, 0, given["cx"]], [0, fy, given["cy"]], [0, 0, 1]], np.float64), k


def _params(camera: ColmapCamera, result: BundleAdjustment, number: int) -> Reals:
    k = result.cameras[number].intrinsics
    kind = _lens(camera)[0]
    found = {"f": k[0, 0], "fx": k[0, 0], "fy": k[1, 1], "cx": k[0, 2], "cy": k[1, 2]}
    found |= dict(zip(DISTORTIONS[kind], result.distortion[number], strict=False))
    return np.array([found[name] for name in _MODELS[camera.model]])


def read_colmap(folder: str | Path) -> ColmapModel:
    """Read a sparse model of COLMAP, as exported by ``model_converter --output_type TXT``.

    Parameters
    ----------
    folder : path
        The folder of ``cameras.txt``, ``images.txt`` and ``points3D.txt``.

    Returns
    -------
    ColmapModel
        Its `problem` has the arguments of `bundle_adjust`.

    Raises
    ------
    OSError, ValueError
        If a file cannot be read, or a line is not as expected: the message names file, line, and what is expected.
    """
    cameras = tuple(_camera(words, path, n) for path, n, words in _rows(Path(folder) / "cameras.txt"))
    points = tuple(_point(words, path, n) for path, n, words in _rows(Path(folder) / "points3D.txt"))
    known, ids = {camera.id for camera in cameras}, {point.id for point in points}
    path, images = Path(folder) / "images.txt", []
    lines = [(n, line) for n, line in enumerate(lines_of(path), 1) if not line.startswith("#")]
    while lines and not lines[-1][1].strip() and len(lines) % 2:
        lines.pop()
    for (n, first), (m, second) in zip(
        lines[::2], [*lines[1::2], (lines[-1][0] + 1 if lines else 1, "")], strict=False
    ):
        images.append(_image(first, n, second, m, path, known, ids))
    for name, rows in (("cameras.txt", cameras), ("images.txt", images), ("points3D.txt", points)):
        all_ids = [row.id for row in rows]
        twice = next((i for i in all_ids if all_ids.count(i) > 1), None) if len(set(all_ids)) < len(all_ids) else None
        if twice is not None:
            raise ValueError(f"{Path(folder) / name}: id {twice} appears twice; expected each id once")
    return ColmapModel(cameras, tuple(images), points)


def _rows(path: Path) -> list[tuple[Path, int, list[str]]]:
    found = [(path, n, line.split()) for n, line in enumerate(lines_of(path), 1) if not line.startswith("#")]
    return [row for row in found if row[2]]


def _camera(words: list[str], path: Path, line: int) -> ColmapCamera:
    expected = "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]"
    if len(words) < 5:
        raise ValueError(f"{path}, line {line}: {' '.join(words)[:80]!r}; expected {expected}")
    (number,) = integers_of(words[:1], path, line, expected)
    size = integers_of(words[2:4], path, line, expected)
    model = words[1]
    if model not in _MODELS and model not in _OTHERS:
        raise ValueError(f"{path}, line {line}: model {model!r}; expected {', '.join((*_MODELS, *_OTHERS))}")
    wanted = len(_MODELS[model]) if model in _MODELS else _OTHERS[model]
    if len(words) != 4 + wanted:
        raise ValueError(f"{path}, line {line}: {len(words) - 4} parameters of {model}; expected {wanted}")
    return ColmapCamera(number, model, size[0], size[1], np.array(numbers_of(words[4:], path, line, expected)))


def _point(words: list[str], path: Path, line: int) -> ColmapPoint:
    expected = "POINT3D_ID X Y Z R G B ERROR and pairs IMAGE_ID POINT2D_IDX"
    if len(words) < 8 or len(words) % 2:
        raise ValueError(f"{path}, line {line}: {' '.join(words)[:80]!r}; expected {expected}")
    number, red, green, blue, *track = integers_of([words[0], *words[4:7], *words[8:]], path, line, expected)
    *place, error = numbers_of([*words[1:4], words[7]], path, line, expected)
    return ColmapPoint(number, np.array(place), (red, green, blue), error, np.array(track, np.int64).reshape(-1, 2))


def _image(first: str, n: int, second: str, m: int, path: Path, cameras: set[int], points: set[int]) -> ColmapImage:
    expected = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"
    words = first.split(maxsplit=9)
    if len(words) != 10:
        raise ValueError(f"{path}, line {n}: {first[:80]!r}; expected {expected}")
    number, camera = integers_of([words[0], words[8]], path, n, expected)
    pose = np.array(numbers_of(words[1:8], path, n, expected))
    if not np.any(pose[:4]):
        raise ValueError(f"{path}, line {n}: a quaternion of length 0; expected a rotation")
    if camera not in cameras:
        raise ValueError(f"{path}, line {n}: camera {camera}; expected one of cameras.txt")
    row, expected = second.split(), "triples X Y POINT3D_ID"
    if len(row) % 3:
        raise ValueError(f"{path}, line {m}: {len(row)} numbers; expected {expected}")
    ids = np.array(integers_of(row[2::3], path, m, expected), np.int64)
    xy = [word for k, word in enumerate(row) if k % 3 < 2]
    unknown = set(ids.tolist()) - points - {-1}
    if unknown:
        raise ValueError(f"{path}, line {m}: point {min(unknown)}; expected one of points3D.txt, or -1")
    pixels = np.array(numbers_of(xy, path, m, expected)).reshape(-1, 2)
    return ColmapImage(number, pose[:4], pose[4:], camera, words[9].rstrip(), pixels, ids)


def write_colmap(folder: str | Path, model: ColmapModel) -> None:
    """Write a model as COLMAP does, with as many digits as its numbers have.

    Parameters
    ----------
    folder : path
        It is created if it does not exist; files in it are replaced.
    model : ColmapModel
        Of `read_colmap` or `ColmapModel.adjusted`.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    cameras = ["# Camera list with one line of data per camera:", "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"]
    cameras += [f"{each.id} {each.model} {each.width} {each.height} {text_of(each.params)}" for each in model.cameras]
    images = ["# Image list with two lines of data per image:"]
    images += ["#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME", "#   POINTS2D[] as (X, Y, POINT3D_ID)"]
    for image in model.images:
        pose = text_of(np.concatenate([image.quaternion, image.translation]))
        images.append(f"{image.id} {pose} {image.camera_id} {image.name}")
        rows = zip(image.pixels, image.point_ids.tolist(), strict=True)
        images.append(" ".join(f"{text_of(pixel)} {number}" for pixel, number in rows))
    points = ["# 3D point list with one line of data per point:"]
    points.append("#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)")
    for point in model.points:
        track = " ".join(str(x) for x in point.track.ravel().tolist())
        colour = " ".join(map(str, point.colour))
        points.append(f"{point.id} {text_of(point.place)} {colour} {point.error!r} {track}".rstrip())
    for name, lines in (("cameras.txt", cameras), ("images.txt", images), ("points3D.txt", points)):
        (target / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
