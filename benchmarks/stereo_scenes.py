"""Random stereo pairs with known disparities, on which the costs of `algorithms.wavelets.disparity` were chosen.

`python -m benchmarks.stereo_scenes` prints the share of wrong disparities for other costs. Measured pairs, such as
Motorcycle, are left for tests.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray

from algorithms.wavelets import disparity, stereo_matching

Array = NDArray[np.float64]
PICTURES = (
    "astronaut", "brick", "camera", "chelsea", "coffee", "coins", "grass", "gravel", "immunohistochemistry", "rocket",
)  # fmt: skip
"""Pictures of scikit-image that lie in its package."""
ROWS, COLUMNS, LARGEST, FINER = 150, 240, 48, 3
LENGTH, STEEPEST = 1.2 * COLUMNS, np.radians(80)
LEAST, MOST = 5.0, 100.0
"""Focal length in pixels, and the largest angle between the optical axis and the normal of a plane; radii of planes."""
CHANGES, OF_HIDDEN = (0.5, 1.0, 2.0, 4.0, 8.0), (0.5, 1.0, 2.0)
"""Costs of changes of the disparity, and of hidden pixels."""


class Scene(NamedTuple):
    """Two images (M, N) of 8 bits, and the disparities of the left one."""

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    truth: Array


class _Plane(NamedTuple):
    """A textured plane within an ellipse or a rectangle; without bounds if `radii` are infinite."""

    base: float
    slopes: Array
    centre: Array
    radii: Array
    turn: float
    is_round: bool
    picture: Array
    map: Array
    origin: Array
    light: float

    def contains(self, x: Array, y: Array) -> NDArray[np.bool_]:
        c, s = np.cos(self.turn), np.sin(self.turn)
        x, y = x - self.centre[0], y - self.centre[1]
        u, v = (c * x + s * y) / self.radii[0], (c * y - s * x) / self.radii[1]
        return np.asarray(u * u + v * v < 1 if self.is_round else np.maximum(np.abs(u), np.abs(v)) < 1)


def scene(seed: int) -> Scene:
    """Return slanted planes at random depths, which cover the image once, seen by cameras of different brightness.

    The sizes are those of dead leaves, of which the images are statistically the same at all scales, as photographs are
    (Lee, Mumford and Huang, *Int. J. Computer Vision* 41:35, 2001).
    """
    rng = np.random.default_rng(seed)
    near = rng.uniform(4, LARGEST - 6, round(ROWS * COLUMNS / (2 * np.pi * LEAST**2 * np.log(MOST / LEAST))))
    planes = [_plane(rng, base, k == 0) for k, base in enumerate([rng.uniform(2, 12), *near])]
    (left, truth), (right, _) = (_seen(planes, moved) for moved in (False, True))
    right = rng.uniform(0.85, 1.2) * 255 * (right / 255) ** rng.uniform(0.9, 1.1) + rng.uniform(-10, 10)
    noise = rng.choice([0.5, 1, 2, 4])
    left, right = (image + noise * rng.normal(size=image.shape) for image in (left, right))
    left, right = (np.clip(np.rint(image), 0, 255).astype(np.uint8) for image in (left, right))
    return Scene(left, right, truth)


def _plane(rng: np.random.Generator, base: float, is_last: bool) -> _Plane:
    picture = _picture(PICTURES[rng.integers(len(PICTURES))])
    radius = (LEAST**-2.0 - rng.uniform() * (LEAST**-2.0 - MOST**-2.0)) ** -0.5
    longer = 2 ** rng.uniform(-1, 1)
    angle, scale = rng.uniform(-0.5, 0.5), rng.uniform(0.5, 1.2)
    c, s = scale * np.cos(angle), scale * np.sin(angle)
    # Surfaces in all directions alike, of which cameras see the projected area. Disparities are linear in the image.
    slant, towards = np.arcsin(np.sqrt(rng.uniform(0, np.sin(STEEPEST) ** 2))), rng.uniform(0, 2 * np.pi)
    return _Plane(
        base,
        base / LENGTH * np.tan(slant) * np.array([np.cos(towards), np.sin(towards)]),
        rng.uniform(0, (COLUMNS, ROWS)),
        np.full(2, np.inf) if is_last else radius * np.array([longer, 1 / longer]),
        rng.uniform(0, np.pi),
        bool(rng.integers(2)),
        picture,
        np.array([[-s, c], [c, s]]),
        rng.uniform(0, picture.shape),
        rng.uniform(0.5, 1),
    )


@lru_cache(maxsize=len(PICTURES))
def _picture(name: str) -> Array:
    from skimage import data

    picture = np.asarray(getattr(data, name)(), float)
    return picture.mean(-1) if picture.ndim == 3 else picture


def _seen(planes: list[_Plane], moved: bool) -> tuple[Array, Array]:
    """Return the image of one camera, averaged from finer pixels, and the disparities at the middles of pixels."""
    x, y = np.meshgrid(*((np.arange(size * FINER) + 0.5) / FINER - 0.5 for size in (COLUMNS, ROWS)))
    whole = x, y, np.zeros(x.shape), np.zeros(x.shape)
    for plane in planes:
        near = np.flatnonzero(np.abs(whole[1][:, 0] - plane.centre[1]) < 1.5 * plane.radii.max())
        if not near.size:
            continue
        x, y, image, depth = (part[near[0] : near[-1] + 1] for part in whole)
        level = plane.base - plane.slopes @ (COLUMNS / 2, ROWS / 2) + plane.slopes[1] * y
        own = (x + level) / (1 - plane.slopes[0]) if moved else x
        number = level + plane.slopes[0] * own
        front = plane.contains(own, y) & (number > depth) & (number < LARGEST)
        places = plane.origin[:, None] + plane.map @ [own[front], y[front]]
        image[front] = plane.light * scipy.ndimage.map_coordinates(plane.picture, places, order=1, mode="mirror")
        depth[front] = number[front]
    _, _, image, depth = whole
    middle = slice(FINER // 2, None, FINER)
    return image.reshape(ROWS, FINER, COLUMNS, FINER).mean((1, 3)), depth[middle, middle]


def wrong(scenes: list[Scene], **constants: float) -> tuple[float, float]:
    """Return the shares of disparities that are wrong by more than a pixel, of all and of those with confidence."""
    before = {name: getattr(stereo_matching, name) for name in constants}
    try:
        for name, value in constants.items():
            setattr(stereo_matching, name, value)
        found = [disparity(left, right, LARGEST) for left, right, _ in scenes]
    finally:
        for name, value in before.items():
            setattr(stereo_matching, name, value)
    error = np.array([np.abs(own.disparity - each.truth) > 1 for own, each in zip(found, scenes, strict=True)])
    sure = np.array([own.confidence > 0 for own in found])
    return float(error.mean()), float(error[sure].mean()) if sure.any() else 0.0


def lines(scenes: list[Scene]) -> Iterator[str]:
    """Return a line for each choice of the three costs."""
    for small, large in combinations(CHANGES, 2):
        for hidden in OF_HIDDEN:
            of_all, of_sure = wrong(scenes, _SMALL=small, _LARGE=large, _HIDDEN=hidden)
            yield f"{small:g}, {large:g}, {hidden:g}: {of_all:.1%} wrong, {of_sure:.1%} of those with confidence"


if __name__ == "__main__":
    print("\n".join(lines([scene(seed) for seed in range(40)])))
