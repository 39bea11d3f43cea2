"""Problems of bundle adjustment as they are in files: cameras, points, observations and lenses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..arguments import Reals
from .bundle import bundle_adjust
from .bundle_results import BundleAdjustment, Observations
from .camera import Camera


@dataclass(frozen=True, slots=True, eq=False)
class BundleProblem:
    """The arguments of `bundle_adjust`."""

    cameras: tuple[Camera, ...]
    points: Reals
    """(m, 3)"""
    observations: Observations
    distortion: str | None = None
    """None, "brown" or "fisheye"."""
    coefficients: Reals | None = None
    """(c, n) The coefficients of the distortion of each camera."""
    lens_of: Reals | None = None
    """(c,) int. The number of the lens of each camera, for ``intrinsics=problem.lens_of``."""

    def adjust(self, **options: Any) -> BundleAdjustment:
        """Return `bundle_adjust` of the problem, with its further options.

        Raises
        ------
        TypeError, ValueError
            As `bundle_adjust`.
        """
        return bundle_adjust(
            self.cameras, self.points, self.observations, distortion=self.distortion, coefficients=self.coefficients,
            **options,
        )  # fmt: skip


def lines_of(path: str | Path) -> list[str]:
    """Return the lines of a text file; ValueError if it is not text."""
    data = Path(path).read_bytes()
    try:
        return data.decode("utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: byte {error.start} is not UTF-8; expected a text file") from None


def numbers_of(words: list[str], path: str | Path, line: int, expected: str) -> list[float]:
    """Return finite numbers; ValueError with the file, the line, and what is expected there."""
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        raise ValueError(f"{path}, line {line}: {' '.join(words)[:80]!r}; expected {expected}") from None
    if not np.isfinite(numbers).all():
        raise ValueError(f"{path}, line {line}: {' '.join(words)[:80]!r}; expected {expected}, finite")
    return numbers


def integers_of(words: list[str], path: str | Path, line: int, expected: str) -> list[int]:
    """Return integers; ValueError with the file, the line, and what is expected there."""
    try:
        return [int(word) for word in words]
    except ValueError:
        raise ValueError(f"{path}, line {line}: {' '.join(words)[:80]!r}; expected {expected}") from None


def text_of(numbers: Reals) -> str:
    """Return numbers with as many digits as they have, separated by spaces."""
    return " ".join(repr(float(x)) for x in numbers)
