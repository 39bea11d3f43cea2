"""Pairs of images whose motion is known: images sampled twice through splines of fifth order."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import scipy.ndimage

SIZE, MARGIN, BORDER = 224, 40, 24
SMALL = 200
NAMES = ("chelsea", "coins", "astronaut", "coffee", "camera", "moon", "rocket", "brick")
SQUARES = {
    "square": ((5.3, -3.6), (0.0, 0.0), 64),
    "square, moving background": ((-3.4, 2.2), (1.3, -0.6), 72),
    "fast square": ((9.0, 4.0), (-1.2, 0.7), 80),
}
"""Motion of the square, motion of the background, and the size of the square; pixels."""


class Pair(NamedTuple):
    """Two images of 200 x 200 pixels, the motion (u, v) and whether the pixels of the first are seen in the second."""

    first: np.ndarray
    second: np.ndarray
    motion: np.ndarray
    visible: np.ndarray

    def noisy(self, sigma: float) -> Pair:
        """Both images as bytes, with added white noise of this standard deviation."""
        rng = np.random.default_rng(7)
        images = [image + sigma * rng.normal(size=image.shape) for image in self[:2]]
        first, second = (np.rint(image).clip(0, 255).astype(np.uint8) for image in images)
        return Pair(first, second, self.motion, self.visible)

    def error(self, uv: np.ndarray) -> float:
        """The mean distance to the motion of visible pixels."""
        return float(np.linalg.norm(uv - self.motion, axis=-1)[self.visible].mean())


@cache
def spline(name: str) -> np.ndarray:
    """The coefficients of one of scikit-image's images, grey, from 0 to 255."""
    from skimage import color, data

    image = getattr(data, name)()
    return scipy.ndimage.spline_filter(255 * color.rgb2gray(image) if image.ndim == 3 else image.astype(float), 5)


def about_middle(name: str, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Sample an image at offsets in pixels from its centre."""
    rows, columns = spline(name).shape
    places = [y + rows // 2, x + columns // 2]
    return scipy.ndimage.map_coordinates(spline(name), places, order=5, prefilter=False, mode="mirror")


def warped(name: str, kind: str) -> Pair:
    """ "rotation" rotates by 1 degree and moves by (2.3, -1.6); "zoom" enlarges by 2 % and moves by (0.7, -0.4)."""
    angle, scale, shift = {
        "rotation": (np.deg2rad(1), 1.0, np.array([2.3, -1.6])),
        "zoom": (0.0, 1.02, np.array([0.7, -0.4])),
    }[kind]
    matrix = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    middle = (SMALL - 1) / 2
    y, x = np.indices((SMALL, SMALL)) - middle
    places = np.stack([x, y], -1)
    motion = places @ matrix.T + shift - places
    before = (places - shift) @ np.linalg.inv(matrix).T
    first, second = (about_middle(name, p[..., 0], p[..., 1]) for p in (places, before))
    return Pair(first, second, motion, (np.abs(places + motion) <= middle).all(-1))


def moving_square(name: str, kind: str) -> Pair:
    """A square with the texture of another image moves over a background, as in `SQUARES`."""
    motion, background, size = SQUARES[kind]
    other = NAMES[(NAMES.index(name) + 3) % len(NAMES)]
    y, x = np.indices((SMALL, SMALL)) - (SMALL - 1) / 2

    def inside(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return (np.abs(u) < size / 2) & (np.abs(v) < size / 2)

    first = np.where(inside(x, y), about_middle(other, x, y), about_middle(name, x, y))
    there = x - motion[0], y - motion[1]
    behind = about_middle(name, x - background[0], y - background[1])
    second = np.where(inside(*there), about_middle(other, *there), behind)
    uv = np.where(inside(x, y)[..., None], motion, background)
    to = x + uv[..., 0], y + uv[..., 1]
    covered = ~inside(x, y) & inside(to[0] - motion[0], to[1] - motion[1])
    seen = (np.abs(to) <= (SMALL - 1) / 2).all(0) & ~covered
    return Pair(first, second, uv, seen)


def pair(image: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two images of 224 x 224 pixels and the motion (u, v) of each pixel of the first one.

    "translation" is by (2.3, -1.6) pixels; "rotation" rotates by 2 degrees, enlarges by 2 % and moves by (0.4, -0.7).
    """
    y, x = np.meshgrid(np.arange(SIZE, dtype=float), np.arange(SIZE, dtype=float), indexing="ij")
    middle = (SIZE - 1) / 2
    if kind == "translation":
        matrix, shift = np.eye(2), np.array([2.3, -1.6])
    else:
        angle = np.deg2rad(2)
        matrix = 1.02 * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        shift = np.array([0.4, -0.7])
    places = np.stack([x, y], -1) - middle
    motion = places @ matrix.T + shift - places
    before = (places - shift) @ np.linalg.inv(matrix).T + middle
    spline = scipy.ndimage.spline_filter(image.astype(float), 5)
    first, second = (
        scipy.ndimage.map_coordinates(spline, [p[..., 1] + MARGIN, p[..., 0] + MARGIN], order=5, prefilter=False)
        for p in (places + middle, before)
    )
    return first, second, motion


def mean_error(uv: np.ndarray, motion: np.ndarray) -> float:
    """The mean distance of two motions in pixels, away from the border."""
    inside = slice(BORDER, -BORDER)
    return float(np.linalg.norm(uv - motion, axis=-1)[inside, inside].mean())
