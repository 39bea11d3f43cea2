"""The pictures of the page on registration: both clouds before and after, and the planes of joint space."""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from algorithms.registration import register, register_matches
from algorithms.registration.pictures_of_rigid import draw_clouds, draw_joint_space
from generated import pga3

from .registration_scenes import scene

FOLDER = Path("docs")
OBJECT, SEED = "PowerDrill", 3
MATCHES, RIGHT = 600, 200
DOTS, COLOURS = 72, 32
"""Dots per inch, and colours, with which each picture has less than 80 kB."""


def saved(figure: Figure, path: Path) -> None:
    """Write a picture with a few colours."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=DOTS)
    Image.open(buffer).convert("RGB").quantize(COLOURS).save(path, optimize=True)


def main(arguments: list[str] | None = None) -> int:
    """Draw both pictures; arguments are those of the command line, or by default of the process."""
    parser = argparse.ArgumentParser("python -m benchmarks.registration_pictures", description=__doc__)
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="FOLDER")
    folder = parser.parse_args(arguments).out
    source, _, target, _ = scene(OBJECT, SEED)
    result = register(source, target)
    saved(draw_clouds(source[result.inliers], target, result.motor), folder / "registration.png")
    rng = np.random.default_rng(0)
    motor = pga3.motor_exponential([0.3, -0.2, 0.4, 0.2, 0.1, 0.3])
    x, y = rng.normal(size=(2, MATCHES, 3))
    y[:RIGHT] = pga3.move_point(motor, x[:RIGHT])
    found = register_matches(x, y)
    saved(draw_joint_space(x, y, found.inliers, found.motor), folder / "joint-space.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
