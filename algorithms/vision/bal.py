"""Reader and writer of Bundle Adjustment in the Large: the text format of Snavely's problems.

Its cameras look along their negative z axis, with y up; pixels are relative to the centre of the image. A camera is a
rotation vector and a translation from world to camera, the focal length, and k1 and k2 of the radial distortion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite, real_array
from .bundle_arguments import checked_table
from .bundle_problem import BundleProblem, integers_of, lines_of, numbers_of, text_of
from .bundle_results import BundleAdjustment, Observations
from .camera import Camera

_NUMBERS = 9
"""Numbers of a camera: rotation vector, translation, focal length and two coefficients."""
_FLIP = np.array([1.0, -1.0, -1.0])
"""The axes of a camera of the format, in those of `Camera`."""


@dataclass(frozen=True, slots=True, eq=False)
class BalProblem:
    """The numbers of a file, in its own conventions, so that reading and writing changes none of them."""

    parameters: Reals
    """(c, 9) Rotation vector and translation from world to camera, focal length, k1, k2."""
    points: Reals
    """(m, 3)"""
    observations: Observations
    """Pixels relative to the centre of the image, with y up."""

    @property
    def problem(self) -> BundleProblem:
        """The problem with cameras that look along z, and pixels with y down."""
        rows, seen = self.parameters, self.observations
        to_camera = pga3.motor_from_rotation_vector_translation(
            np.ascontiguousarray(rows[:, :3]), np.ascontiguousarray(rows[:, 3:6])
        )
        turn = pga3.motor_from_rotation_vector_translation(np.array([np.pi, 0.0, 0.0]), np.zeros(3))
        motors = pga3.motor_inverse(pga3.motor_product(turn, to_camera)) if len(rows) else np.zeros((0, 8))
        cameras = tuple(Camera(np.diag([row[6], row[6], 1.0]), motor) for row, motor in zip(rows, motors, strict=True))
        table = Observations(seen.camera, seen.point, seen.pixels * _FLIP[:2])
        return BundleProblem(cameras, self.points, table, "brown", rows[:, 7:9], np.arange(len(rows)))

    @classmethod
    def from_cameras(
        cls,
        cameras: Sequence[Camera],
        points: ArrayLike,
        observations: Observations,
        coefficients: ArrayLike | None = None,
    ) -> BalProblem:
        """Return the problem of cameras that look along z, whose principal point is subtracted from the pixels.

        Parameters
        ----------
        cameras : sequence of Camera
            With square pixels and without skew.
        points : array_like, (m, 3)
        observations : Observations
        coefficients : array_like, (c, 2) or (2,), optional
            k1 and k2 of the distortion; 0 by default.

        Raises
        ------
        TypeError, ValueError
            If a camera has pixels that are not square, or a skew, or if arguments have other shapes.
        """
        places = finite(real_array(points, "points", (-1, 3), "points"), "points").astype(np.float64)
        camera, point, pixels = checked_table(observations, len(cameras), len(places))
        k = np.zeros(2) if coefficients is None else real_array(coefficients, "coefficients", (2,), "k1 k2")
        matrices = np.array([each.intrinsics for each in cameras]).reshape(-1, 3, 3)
        wrong = (matrices[:, 0, 0] != matrices[:, 1, 1]) | (matrices[:, 0, 1] != 0)
        if wrong.any():
            raise ValueError(
                f"cameras: K of camera {int(wrong.argmax())} is\n{matrices[wrong.argmax()]}\n"
                "expected fx = fy and no skew"
            )
        turn = pga3.motor_from_rotation_vector_translation(np.array([-np.pi, 0.0, 0.0]), np.zeros(3))
        rows = np.zeros((len(cameras), _NUMBERS))
        if len(cameras):
            motors = pga3.motor_inverse(np.array([each.pose for each in cameras]))
            rows[:, :3], rows[:, 3:6] = pga3.motor_to_rotation_vector_translation(pga3.motor_product(turn, motors))
        rows[:, 6], rows[:, 7:] = matrices[:, 0, 0], k
        centred = (pixels - matrices[camera][:, :2, 2]) * _FLIP[:2]
        return cls(rows, places, Observations(camera, point, centred))

    def adjusted(self, result: BundleAdjustment) -> BalProblem:
        """Return the problem with the cameras, lenses and points of a result of ``problem.adjust``."""
        found = BalProblem.from_cameras(
            result.cameras, result.points, self.problem.observations, result.distortion[:, :2]
        )
        return BalProblem(found.parameters, found.points, self.observations)


def read_bal(path: str | Path) -> BalProblem:
    """Read a problem of the collection *Bundle Adjustment in the Large* (Agarwal, Snavely, Seitz and Szeliski, 2010).

    Parameters
    ----------
    path : path
        A text file: numbers of cameras, points and observations; an observation in each line, with the numbers of its
        camera and point and its x and y; nine numbers of each camera; three of each point.

    Returns
    -------
    BalProblem

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, ends early, continues after the last point, or has something else in a line. The
        message names the line and what is expected there.
    """
    words: list[str] = []
    lines: list[int] = []
    for number, line in enumerate(lines_of(path), 1):
        here = line.split()
        words += here
        lines += [number] * len(here)
    last = lines[-1] if lines else 1
    if len(words) < 3:
        raise ValueError(
            f"{path}, line 1: {' '.join(words)!r}; expected the numbers of cameras, points and observations"
        )
    c, m, k = integers_of(words[:3], path, lines[0], "the numbers of cameras, points and observations")
    if min(c, m, k) < 0:
        raise ValueError(f"{path}, line {lines[0]}: {c} {m} {k}; expected numbers that are not negative")
    wanted = 3 + 4 * k + _NUMBERS * c + 3 * m
    if len(words) != wanted:
        at = last if len(words) < wanted else lines[wanted]
        raise ValueError(
            f"{path}, line {at}: {len(words)} numbers in the file; expected {wanted}: 3, 4 for each of {k} "
            f"observations, {_NUMBERS} for each of {c} cameras and 3 for each of {m} points"
        )
    table = np.zeros((k, 2), np.int64)
    pixels = np.zeros((k, 2))
    for i in range(k):
        at = 3 + 4 * i
        table[i] = integers_of(words[at : at + 2], path, lines[at], "the numbers of a camera and of a point")
        if not (0 <= table[i, 0] < c and 0 <= table[i, 1] < m):
            raise ValueError(
                f"{path}, line {lines[at]}: camera {table[i, 0]}, point {table[i, 1]}; expected less than {c} and {m}"
            )
        pixels[i] = numbers_of(words[at + 2 : at + 4], path, lines[at], "a camera, a point, x and y")
    numbers = _all_numbers(words, lines, 3 + 4 * k, path)
    parameters, places = numbers[: _NUMBERS * c].reshape(c, _NUMBERS), numbers[_NUMBERS * c :].reshape(m, 3)
    return BalProblem(parameters, places, Observations(table[:, 0], table[:, 1], pixels))


def _all_numbers(words: list[str], lines: list[int], start: int, path: str | Path) -> Reals:
    try:
        found = np.array(words[start:], np.float64)
    except ValueError:
        found = np.full(1, np.nan)
    if not np.isfinite(found).all():
        for word, line in zip(words[start:], lines[start:], strict=True):
            numbers_of([word], path, line, "a number of a camera or a point")
    return found


def write_bal(path: str | Path, problem: BalProblem) -> None:
    """Write a problem in the format of `read_bal`, with as many digits as its numbers have.

    Parameters
    ----------
    path : path
    problem : BalProblem
        Of `BalProblem.from_cameras`, `BalProblem.adjusted` or `read_bal`.

    Raises
    ------
    OSError, ValueError
        If the file cannot be written, or a number is not finite.
    """
    seen = problem.observations
    for name, array in (("parameters", problem.parameters), ("points", problem.points), ("pixels", seen.pixels)):
        finite(array, name)
    lines = [f"{len(problem.parameters)} {len(problem.points)} {len(seen.camera)}"]
    lines += [
        f"{camera} {point} {text_of(pixel)}"
        for camera, point, pixel in zip(seen.camera, seen.point, seen.pixels, strict=True)
    ]
    lines += [repr(float(x)) for x in problem.parameters.ravel()] + [repr(float(x)) for x in problem.points.ravel()]
    Path(path).write_text("\n".join(lines) + "\n")
