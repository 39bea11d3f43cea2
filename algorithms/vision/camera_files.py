"""Cameras in the YAML files of OpenCV and ROS."""

from __future__ import annotations

import re
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np

from ..arguments import Reals
from .camera import Camera
from .distortion import Distortion

Format = Literal["opencv", "ros"]
Entries = dict[str, dict[str, str] | str]
_MODELS = {"plumb_bob": "brown", "rational_polynomial": "brown", "equidistant": "fisheye", "fisheye": "fisheye"}
"""Models of ROS."""
_MATRIX = ("camera_matrix", "Camera_Matrix", "cameraMatrix", "K")
_COEFFICIENTS = ("distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "D")
_N_BROWN = 8
"""OpenCV's files have up to 14 coefficients: those after the eighth are of thin prisms and a tilted sensor."""
_ENTRY = re.compile(r"(?P<indent> *)(?P<key>[A-Za-z_][\w ]*?)\s*:(?:\s+(?P<value>.*))?$")


def read_camera(path: str | PathLike[str]) -> tuple[Camera, tuple[int, int] | None]:
    """Read a camera from a YAML file of OpenCV (``%YAML:1.0``, ``!!opencv-matrix``) or of ROS (``camera_info``).

    Parameters
    ----------
    path : str or path

    Returns
    -------
    camera : Camera
        In its own frame. Without coefficients, or if all those of the model "brown" are 0, it has no distortion.
    size : (int, int) or None
        Width and height of its images in pixels, if the file has them.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is not such a file, if a matrix is missing or damaged, or if the lens has a model or coefficients that
        `Distortion` does not have. The message names the file and the entry.
    """
    entries = _entries(Path(path))
    matrix = _matrix(entries, _MATRIX, path)
    if matrix is None:
        raise ValueError(f"{path}: no camera_matrix; expected a camera of OpenCV or ROS")
    if matrix.shape != (3, 3) or not matrix[2, 2] or np.tril(matrix, -1).any() or not matrix[0, 0] * matrix[1, 1]:
        raise ValueError(f"{path}: camera_matrix {matrix.tolist()}; expected 3 x 3 numbers fx s cx, 0 fy cy, 0 0 1")
    pose = np.eye(8)[0]
    return Camera(matrix / matrix[2, 2], pose, _distortion(entries, path)), _size(entries, path)


def write_camera(
    path: str | PathLike[str],
    camera: Camera,
    size: tuple[int, int] | None = None,
    *,
    format: Format = "opencv",
    name: str = "camera",
) -> None:
    """Write a camera to a YAML file that OpenCV's FileStorage or ROS reads. Numbers are written exactly.

    Parameters
    ----------
    path : str or path
    camera : Camera
        Its pose is not written.
    size : (int, int), optional
        Width and height of its images in pixels; ROS requires them.
    format : {"opencv", "ros"}
    name : str
        The name of the camera, for ROS.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If the format is unknown, if `size` is missing for ROS or is not positive, or if the name is not one of letters,
        digits, ``_``, ``-``, ``.`` and ``/``.
    """
    if format not in ("opencv", "ros"):
        raise ValueError(f"format: {format!r}; expected 'opencv' or 'ros'")
    if size is None and format == "ros":
        raise ValueError("size: None; expected width and height, which files of ROS have")
    if size is not None and not (len(size) == 2 and all(int(n) == n > 0 for n in size)):
        raise ValueError(f"size: {size}; expected width and height, positive numbers of pixels")
    if not re.fullmatch(r"[\w./-]+", name):
        raise ValueError(f"name: {name!r}; expected letters, digits, _, -, . and /")
    lines = ["%YAML:1.0", "---"] if format == "opencv" else []
    if size is not None:
        lines += [f"image_width: {int(size[0])}", f"image_height: {int(size[1])}"]
    if format == "ros":
        lines.append(f"camera_name: {name}")
    k = np.asarray(camera.intrinsics, np.float64)
    lines += _matrix_lines("camera_matrix", k, format)
    lines += _lens_lines(camera.distortion, format)
    if format == "ros":
        lines += _matrix_lines("rectification_matrix", np.eye(3), format)
        lines += _matrix_lines("projection_matrix", np.insert(k, 3, 0, axis=1), format)
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _lens_lines(lens: Distortion | None, format: Format) -> list[str]:
    coefficients = np.zeros(5) if lens is None else lens.array
    if len(coefficients) == _N_BROWN and not coefficients[5:].any():
        coefficients = coefficients[:5]
    if format == "ros":
        model = {5: "plumb_bob", _N_BROWN: "rational_polynomial", 4: "equidistant"}[len(coefficients)]
        return [
            f"distortion_model: {model}", *_matrix_lines("distortion_coefficients", coefficients[None], format)
        ]  # fmt: skip
    if lens is None:
        return []
    kind = ["fisheye_model: 1"] if lens.model == "fisheye" else []
    return [*kind, *_matrix_lines("distortion_coefficients", coefficients[:, None], format)]


def _matrix_lines(name: str, matrix: Reals, format: Format) -> list[str]:
    indent, tag = ("   ", " !!opencv-matrix") if format == "opencv" else ("  ", "")
    rows, columns = matrix.shape
    found = [f"{name}:{tag}", f"{indent}rows: {rows}", f"{indent}cols: {columns}"]
    if format == "opencv":
        found.append(f"{indent}dt: d")
    return [*found, f"{indent}data: [{', '.join(repr(float(x)) for x in matrix.ravel())}]"]


def _entries(path: Path) -> Entries:
    """Return the entries of the outer block of a file, and of the blocks in them."""
    found: Entries = {}
    inner: dict[str, str] | None = None
    lines = iter(enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1))
    for number, line in lines:
        text = line.split(" #")[0].rstrip()
        if not text or text.startswith(("%", "---", "...", "#")):
            continue
        entry = _ENTRY.match(text)
        if entry is None:
            if found and text.startswith((" ", "-")):
                continue  # Lists of other data.
            raise ValueError(f"{path}: line {number} is {text.strip()[:40]!r}; expected 'key: value'")
        key, value = entry["key"], (entry["value"] or "").strip()
        while value.startswith("[") and not value.endswith("]"):
            following = next(lines, None)
            if following is None:
                raise ValueError(f"{path}: the list {key!r} of line {number} has no end; expected ']'")
            value += " " + following[1].strip()
        if not entry["indent"]:
            inner = {} if value in ("", "!!opencv-matrix") else None
            found[key] = value if inner is None else inner
        elif inner is not None:
            inner[key] = value
    return found


def _matrix(entries: Entries, names: tuple[str, ...], path: object) -> Reals | None:
    """Return the first of the matrices that is there."""
    name = next((name for name in names if name in entries), None)
    if name is None:
        return None
    block = entries[name]
    if isinstance(block, str) or not {"rows", "cols", "data"} <= set(block):
        raise ValueError(f"{path}: {name} is not a matrix; expected rows, cols and data")
    numbers = [part.strip() for part in block["data"].strip("[] ").split(",") if part.strip()]
    try:
        shape = int(block["rows"]), int(block["cols"])
        values = np.array([float(number) for number in numbers])
    except ValueError as error:
        raise ValueError(f"{path}: {name}: {error}; expected numbers") from None
    if min(shape) < 0 or len(values) != shape[0] * shape[1]:
        raise ValueError(f"{path}: {name}: {len(values)} numbers; expected {shape[0]} x {shape[1]}")
    if not np.isfinite(values).all():
        raise ValueError(f"{path}: {name}: a number that is not finite; expected finite numbers")
    return values.reshape(shape)


def _size(entries: Entries, path: object) -> tuple[int, int] | None:
    found = []
    for name in ("image_width", "image_height"):
        value = entries.get(name)
        if value is None:
            return None
        if isinstance(value, dict) or not value.isdigit() or not int(value):
            raise ValueError(f"{path}: {name} is {value!r}; expected a positive number of pixels")
        found.append(int(value))
    return found[0], found[1]


def _distortion(entries: Entries, path: object) -> Distortion | None:
    matrix = _matrix(entries, _COEFFICIENTS, path)
    named = entries.get("distortion_model", "")
    name = "" if isinstance(named, dict) else named.strip("\"'")
    if name not in {*_MODELS, ""}:
        raise ValueError(f"{path}: distortion_model {name!r}; expected one of {sorted(_MODELS)}")
    is_fisheye = entries.get("fisheye_model", "0") not in ("0", "false")
    numbers = np.zeros(0) if matrix is None else matrix.ravel()
    if _MODELS.get(name, "fisheye" if is_fisheye else "brown") == "fisheye":
        if len(numbers) != 4:
            raise ValueError(f"{path}: distortion_coefficients: {len(numbers)} of a fisheye lens; expected 4")
        return Distortion("fisheye", tuple(map(float, numbers)))
    if numbers[_N_BROWN:].any():
        raise ValueError(
            f"{path}: distortion_coefficients of thin prisms or a tilted sensor; expected 0 after the eighth number"
        )
    return Distortion("brown", tuple(map(float, numbers[:_N_BROWN]))) if numbers.any() else None
