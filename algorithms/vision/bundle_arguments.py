"""Validation of the arguments of bundle adjustment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, as_given, listed, real_array
from ..precision import ROUNDING, SINGLE
from .bundle_results import Observations
from .bundle_scene import SeenLines
from .camera import Camera, matrix_of
from .distortion import Distortion
from .plane_adjustment import N_INTRINSICS

PINHOLE_NAMES = ("fx", "fy", "cx", "cy", "skew")
DISTORTIONS = {
    "pinhole": (),
    "brown": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "fisheye": ("k1", "k2", "k3", "k4"),
}
"""Names of coefficients, in the order of OpenCV."""
LOSSES = {None: 0.0, "huber": 1.0, "cauchy": 2.0}

Cameras = Sequence[Camera] | tuple[ArrayLike, ArrayLike]
Table = Observations | tuple[ArrayLike, ArrayLike, ArrayLike]
LineTable = tuple[ArrayLike, ArrayLike, ArrayLike]


def checked_cameras(cameras: Cameras) -> tuple[Reals, Reals]:
    """Return the matrices K (c, 3, 3) and the motors (c, 8) of cameras."""
    if not isinstance(cameras, (np.ndarray, Sequence)):
        raise TypeError(f"cameras: {type(cameras).__name__}; expected a sequence of Camera objects, or arrays")
    if not isinstance(cameras, np.ndarray) and all(isinstance(each, Camera) for each in cameras):
        matrices = np.array([each.intrinsics for each in cameras]).reshape(-1, 3, 3)  # type: ignore[union-attr]
        motors = np.array([each.pose for each in cameras]).reshape(-1, 8)  # type: ignore[union-attr]
    elif len(cameras) == 2:
        motors = real_array(cameras[1], "cameras[1]", (-1, 8), "motors").astype(np.float64)  # type: ignore[arg-type]
        matrices = real_array(cameras[0], "cameras[0]", (3, 3), "matrices K")  # type: ignore[arg-type]
        if motors.ndim != 2 or matrices.ndim > 3 or (matrices.ndim == 3 and len(matrices) != len(motors)):
            raise ValueError(
                f"cameras: shapes {matrices.shape} and {motors.shape}; expected (c, 3, 3) or (3, 3), and (c, 8)"
            )
        matrices = np.array(np.broadcast_to(matrices, (len(motors), 3, 3)), np.float64)
    else:
        kinds = ", ".join(sorted({type(each).__name__ for each in cameras}))
        raise TypeError(
            f"cameras: {kinds}; expected Camera objects, or a pair of matrices K (c, 3, 3) and motors (c, 8)"
        )
    wrong = ~np.isfinite(matrices).all((1, 2)) | np.tril(matrices, -1).any((1, 2)) | (matrices[:, 2, 2] != 1)
    wrong |= (matrices[:, 0, 0] == 0) | (matrices[:, 1, 1] == 0)
    if wrong.any():
        raise ValueError(
            f"cameras: K of camera {int(wrong.argmax())} is\n{matrices[wrong.argmax()]}\nexpected an upper triangular "
            "matrix with inverse and K[2, 2] = 1"
        )
    finite = np.isfinite(motors).all(1)
    unit = pga3.normalize_motor(np.where(finite[:, None], motors, np.eye(8)[0])) if len(motors) else motors
    scale = np.maximum(1, np.abs(np.where(finite[:, None], motors, 0)).max(1, initial=0))
    off = finite & ~(np.abs(motors - unit).max(1, initial=0) < SINGLE * scale)
    if off.any():
        raise ValueError(f"cameras: the pose of camera {int(off.argmax())} is not a unit motor; expected m ~m = 1")
    return matrices, motors


def checked_table(observations: Table, c: int, m: int) -> tuple[Reals, Reals, Reals]:
    """Return the cameras (k,), points (k,) and pixels (k, 2) of observations of c cameras and m points."""
    if isinstance(observations, Observations):
        parts: tuple[ArrayLike, ...] = observations.camera, observations.point, observations.pixels
    else:
        parts = tuple(listed(observations, "observations", "three arrays: cameras, points, pixels"))
    if len(parts) != 3:
        raise ValueError(f"observations: {len(parts)} arrays; expected 3: cameras (k,), points (k,) and pixels (k, 2)")
    pixels = np.asarray(real_array(parts[2], "observations: pixels", (-1,), "x y"))
    if pixels.ndim == 3 and pixels.shape[1:] == (1, 2):
        pixels = pixels[:, 0]
    if pixels.size == 0:
        pixels = pixels.reshape(-1, 2)
    if pixels.ndim != 2 or pixels.shape[1] != 2:
        raise ValueError(f"observations: pixels of shape {pixels.shape}; expected (k, 2), x y")
    camera, point = _numbers("observations", parts[:2], {"cameras": c, "points": m}, len(pixels))
    return camera, point, pixels.astype(np.float64)


def checked_lines(lines: ArrayLike | None, image_lines: LineTable | None, c: int) -> tuple[Reals, SeenLines]:
    """Return lines (l, 2, 3), and what c cameras see of them: nothing if there are none."""
    if (lines is None) != (image_lines is None):
        raise ValueError("lines, image_lines: one of both; expected lines and where they are seen, or neither")
    if lines is None or image_lines is None:
        lines, image_lines = np.zeros((0, 2, 3)), ([], [], np.zeros((0, 2, 2)))
    ends = real_array(lines, "lines", (2, 3), "two points of each line").astype(np.float64)
    parts = tuple(listed(image_lines, "image_lines", "three arrays: cameras, lines, pixels"))
    if len(parts) != 3:
        raise ValueError(f"image_lines: {len(parts)} arrays; expected 3: cameras (k,), lines (k,), pixels (k, 2, 2)")
    pixels = real_array(parts[2], "image_lines: pixels", (2, 2), "two pixels of each line").astype(np.float64)
    if ends.ndim != 3 or pixels.ndim != 3:
        raise ValueError(f"lines: shapes {ends.shape} and {pixels.shape}; expected (l, 2, 3) and (k, 2, 2)")
    camera, line = _numbers("image_lines", parts[:2], {"cameras": c, "lines": len(ends)}, len(pixels))
    return ends, SeenLines(camera, line, pixels)


def _numbers(where: str, given: tuple[ArrayLike, ...], limits: dict[str, int], k: int) -> list[Reals]:
    """Return the numbers (k,) of cameras and of points or lines, which are less than their limits."""
    tables = []
    for (name, limit), each in zip(limits.items(), given, strict=True):
        table = as_given(each, name)
        if table.size == 0:
            table = np.zeros(table.shape, np.int64)
        if table.dtype.kind not in "iu":
            raise TypeError(f"{where}: {name} of dtype {table.dtype}; expected integers, the numbers of {name}")
        if table.shape != (k,):
            raise ValueError(f"{where}: {name} of shape {table.shape}; expected ({k},), one for each of the pixels")
        if table.size and not (table.min() >= 0 and table.max() < limit):
            raise ValueError(f"{where}: {name} {table.min()} to {table.max()}; expected 0 to {limit - 1}")
        tables.append(np.ascontiguousarray(table, np.int64))
    return tables


def without_distortion(seen: SeenLines, model: str, lenses: Reals, is_estimated: bool) -> SeenLines:
    """Return observations with the pixels of pinhole cameras, for lenses (c, q) that are known.

    Raises
    ------
    ValueError
        If lenses with distortion are estimated: lines are bent in their images.
    """
    if model == "pinhole" or not len(seen.pixels):
        return seen
    if is_estimated:
        raise ValueError("lines: lenses with distortion are estimated; expected intrinsics='fixed', or no distortion")
    bent = np.logical_or(lenses[:, N_INTRINSICS:].any(1), model == "fisheye")
    found = seen.pixels.copy()
    for number in np.unique(seen.camera[bent[seen.camera]]):
        coefficients = tuple(lenses[number, N_INTRINSICS:].tolist())
        lens = Distortion(model, coefficients)  # type: ignore[arg-type]
        own = Camera(matrix_of(lenses[number, :N_INTRINSICS]), np.eye(8)[0], lens)
        here = seen.camera == number
        found[here] = own.undistort(seen.pixels[here])
    return seen._replace(pixels=found)


def checked_fixed(given: ArrayLike | None, n: int, name: str) -> Reals:
    """Return flags (n,) of what is fixed, from numbers or flags."""
    flags = np.zeros(n, bool)
    if given is None:
        return flags
    table = as_given(given, name)
    if table.size == 0:
        return flags
    if table.dtype.kind == "b" and table.shape == (n,):
        return np.array(table)
    if table.dtype.kind not in "iu" or table.ndim != 1:
        raise TypeError(f"{name}: shape {table.shape}, dtype {table.dtype}; expected numbers, or ({n},) flags")
    if not (table.min() >= 0 and table.max() < n):
        raise ValueError(f"{name}: {table.min()} to {table.max()}; expected 0 to {n - 1}")
    flags[table] = True
    return flags


def own_distortion(cameras: Cameras) -> tuple[str, Reals] | None:
    """Return the model and the coefficients (c, q) of the distortion that cameras have themselves, None if none has."""
    lenses = [getattr(each, "distortion", None) for each in cameras]
    models = sorted({"" if each is None else str(each.model) for each in lenses})
    if models in ([], [""]):
        return None
    if "fisheye" in models and len(models) > 1:
        raise ValueError("cameras: fisheye lenses and others; expected one kind")
    model = models[-1]
    full = np.zeros((len(lenses), len(DISTORTIONS[model])))
    for row, lens in zip(full, lenses, strict=True):
        row[:] = 0 if lens is None else np.asarray(lens.coefficients)
    return model, full


def checked_distortion(
    cameras: Cameras, model: str | None, coefficients: ArrayLike | None, c: int
) -> tuple[str, Reals, int]:
    """Return the name of the lens model, its coefficients (c, q), and how many of them were given."""
    own = own_distortion(cameras)
    if own is not None:
        if model is not None or coefficients is not None:
            raise ValueError("distortion: given beside cameras with distortion; expected one of both")
        used = int(np.flatnonzero(own[1].any(0)).max(initial=-1)) + 1
        return *own, max(used, 5 if own[0] == "brown" else 4)
    name = "pinhole" if model is None else model
    if name not in DISTORTIONS or (model == "pinhole"):
        raise ValueError(f"distortion: {model!r}; expected None, 'brown' or 'fisheye'")
    full = np.zeros((c, len(DISTORTIONS[name])))
    if coefficients is None:
        return name, full, 5 if name == "brown" else full.shape[1]
    given = real_array(coefficients, "coefficients", (-1,), "of the distortion")
    if given.ndim > 2 or given.shape[-1] > full.shape[1] or (given.ndim == 2 and len(given) != c):
        raise ValueError(
            f"coefficients: shape {given.shape}; expected (n,) or ({c}, n), with at most {full.shape[1]} for "
            f"distortion={model!r}"
        )
    if not np.isfinite(given).all():
        raise ValueError("coefficients: not finite; expected finite numbers")
    full[:, : given.shape[-1]] = given
    return name, full, given.shape[-1]


def checked_lenses(
    intrinsics: str | ArrayLike, estimated: Sequence[str] | None, lenses: Reals, model: str, n_given: int
) -> tuple[Reals, Reals]:
    """Return the number of the lens of each camera (c,), and the numbers of lenses by the estimated ones (q, p)."""
    c, names = len(lenses), (*PINHOLE_NAMES, *DISTORTIONS[model])
    if isinstance(intrinsics, str):
        tables = {"fixed": np.zeros(c, np.int64), "shared": np.zeros(c, np.int64), "each": np.arange(c)}
        if intrinsics not in tables:
            raise ValueError(
                f"intrinsics: {intrinsics!r}; expected 'fixed', 'shared', 'each', or ({c},) numbers of lenses"
            )
        lens_of = tables[intrinsics]
    else:
        lens_of = as_given(intrinsics, "intrinsics")
        if lens_of.shape != (c,) or lens_of.dtype.kind not in "iu":
            raise ValueError(f"intrinsics: shape {lens_of.shape}, dtype {lens_of.dtype}; expected ({c},) integers")
        lens_of = np.unique(lens_of, return_inverse=True)[1]
    if isinstance(intrinsics, str) and intrinsics == "fixed":
        if estimated:
            raise ValueError(f"estimated: {', '.join(estimated)} with intrinsics='fixed'; expected 'shared' or 'each'")
        return lens_of, np.zeros((len(names), 0))
    for lens in np.unique(lens_of):
        here = lenses[lens_of == lens]
        if np.ptp(here, axis=0).any():
            raise ValueError("intrinsics: cameras that share a lens start with different numbers; expected equal ones")
    wanted = ("f", "cx", "cy", *DISTORTIONS[model][:n_given]) if estimated is None else tuple(estimated)
    for name in wanted:
        if name not in ("f", *names):
            raise ValueError(f"estimated: {name!r}; expected names out of f, {', '.join(names)}")
    if len(set(wanted)) < len(wanted) or ("f" in wanted and {"fx", "fy"} & set(wanted)):
        raise ValueError(f"estimated: {', '.join(wanted)}; expected each number once, and f or fx and fy")
    columns = np.zeros((len(names), len(wanted)))
    for k, name in enumerate(wanted):
        if name == "f" and c:
            ratio = lenses[:, 1] / lenses[:, 0]
            if not np.allclose(ratio, ratio[0], rtol=ROUNDING, atol=0):
                raise ValueError("estimated: f of cameras with different fy / fx; expected fx and fy, or equal ratios")
            columns[:2, k] = 1, ratio[0]
        elif name != "f":
            columns[names.index(name), k] = 1
    return lens_of, columns
