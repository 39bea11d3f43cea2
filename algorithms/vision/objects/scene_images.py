"""Raster images of scenes: shaded surfaces, hidden surfaces, lens distortion, blur and noise of a sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import pga3

from ...arguments import Reals, finite, finite_number, real_array
from ...precision import TINY
from .predicted_curves import NEAR
from .scene import Scene, SceneObject
from .surface_rays import Surfaces, hit_ball, hit_tube

_STEP = 0.03
"""A pixel is sampled more finely if its neighbours differ by more than this."""
_ON_EDGE, _SAG = 8, 0.5
"""Points of each edge of a triangle that determine which pixels it may cover, and a margin for curved edges."""
_PAIRS = 1 << 19
"""Pairs of samples and triangles in one call of the kernel."""


@dataclass(frozen=True, eq=False)
class ImageSettings:
    """Light, background and sensor of raster images."""

    light: tuple[float, float, float] = (0.4, 0.2, 1.0)
    """The direction to the light, which is far away, in the world."""
    ambient: float = 0.35
    """The part of the brightness that does not depend on the light, from 0 to 1."""
    background: ArrayLike = (0.38, 0.42, 0.48)
    """A colour, (3,), or an image, (h, w, 3)."""
    blur: float = 0.0
    """The standard deviation of the point spread in pixels, in addition to the area of a pixel."""
    noise: float = 0.0
    """The standard deviation of the noise of each value, where 1 is the largest value."""
    samples: int = 6
    """Lines of sight along each side of a pixel, in pixels that surfaces do not cover uniformly."""

    def __post_init__(self) -> None:
        for name in ("ambient", "blur", "noise"):
            if finite_number(getattr(self, name), name) < 0:
                raise ValueError(f"{name}: {getattr(self, name)}; expected at least 0")
        if self.ambient > 1:
            raise ValueError(f"ambient: {self.ambient}; expected at most 1")
        if isinstance(self.samples, bool) or not isinstance(self.samples, int) or self.samples < 1:
            raise ValueError(f"samples: {self.samples!r}; expected an integer of at least 1")
        if not np.linalg.norm(finite(real_array(self.light, "light", (3,), "a direction"), "light")) > 0:
            raise ValueError(f"light: {self.light}; expected a direction that is not 0")


def scene_image(scene: Scene, k: int = 0, settings: ImageSettings | None = None, seed: int = 0) -> Reals:
    """Render what a camera of a scene sees.

    Spheres and cylinders of the models of objects, and their meshes, are matt surfaces (Lambert), each pixel has the
    nearest one, and its value is the mean over its area. The surfaces do not cast shadows. Of edges and points that
    belong to no mesh, nothing is seen.

    Parameters
    ----------
    scene : Scene
    k : int
        The camera.
    settings : ImageSettings, optional
        Light, background and sensor.
    seed : int
        Of the noise.

    Returns
    -------
    array, (h, w, 3)
        Red, green and blue from 0 to 1. Element ``[v, u]`` is the square pixel with the centre (u, v).

    Raises
    ------
    IndexError
        If there is no such camera.
    TypeError, ValueError
        If the background is no colour and no image of the size of the camera.

    Notes
    -----
    The error by finite sampling along the boundary of a pixel's area is below ``1 / samples``; the contour of a sphere
    is traced in the image with a mean error of 0.02 pixels (see `segment_colour`).
    """
    chosen = ImageSettings() if settings is None else settings
    width, height = scene.cameras[k].size
    eye = _Eye(scene, k)
    behind = _background(chosen, (height, width))
    every = np.arange(width * height).reshape(height, width)
    colours, owner = eye.shaded(every, np.zeros((1, 2)), chosen)
    image, owner = colours.reshape(height, width, 3), owner.reshape(height, width)
    image = np.where((owner >= 0)[..., None], image, behind)
    uneven = _range(owner) > 0
    uneven |= scipy.ndimage.binary_dilation(owner >= 0) & (_range(image).max(-1) > _STEP)
    if uneven.any() and chosen.samples > 1:
        offsets = (np.arange(chosen.samples) + 0.5) / chosen.samples - 0.5
        grid = np.stack(np.meshgrid(offsets, offsets), -1).reshape(-1, 2)
        at = np.where(uneven, np.cumsum(uneven).reshape(uneven.shape) - 1, -1)
        colours, owner = eye.shaded(at, grid, chosen)
        image[uneven] = np.where((owner >= 0)[..., None], colours, behind[uneven][:, None]).mean(1)
    if chosen.blur:
        image = scipy.ndimage.gaussian_filter(image, (chosen.blur, chosen.blur, 0))
    if chosen.noise:
        image = image + np.random.default_rng(seed).normal(0, chosen.noise, image.shape)
    return np.asarray(np.clip(image, 0, 1))


def textured_background(size: tuple[int, int], seed: int = 0, contrast: float = 0.1, grain: float = 6.0) -> Reals:
    """Return a background (h, w, 3) with smooth random grey spots.

    Parameters
    ----------
    size : (int, int)
        Width and height in pixels.
    seed : int
    contrast : float
        The standard deviation of the values about their mean 0.45.
    grain : float
        The size of the spots in pixels.
    """
    spots = scipy.ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(size[1], size[0])), grain)
    grey = 0.45 + contrast * spots / max(float(spots.std()), TINY)
    return np.asarray(np.clip(grey[..., None] * [0.97, 1.0, 1.04], 0, 1))


def _background(settings: ImageSettings, shape: tuple[int, int]) -> Reals:
    given = finite(real_array(settings.background, "background", (3,), "red green blue"), "background").astype(float)
    if given.ndim != 1 and given.shape[:-1] != shape:
        raise ValueError(f"background: shape {given.shape}; expected (3,) or {(*shape, 3)}")
    return np.broadcast_to(given, (*shape, 3))


class _Eye:
    """A camera with the surfaces of a scene."""

    def __init__(self, scene: Scene, k: int) -> None:
        self.lens = scene.camera(k)
        self.camera = self.lens.pinhole
        self.origin = self.lens.centre
        self.objects = scene.objects
        self.parts = [_surfaces(one) for one in scene.objects]

    def shaded(self, at: Reals, offsets: Reals, settings: ImageSettings) -> tuple[Reals, Reals]:
        """Return the colours of surfaces (n, s, 3) and numbers of objects (n, s), or -1, at samples of n pixels.

        The image `at` (h, w) has the number of each of the n pixels, and -1 at others; `offsets` (s, 2) are from the
        centres of pixels to samples.
        """
        places = np.argwhere(at >= 0)[:, None, ::-1] + offsets
        n, s = places.shape[:2]
        directions = self.lens.rays(places.reshape(-1, 2))
        directions[~np.isfinite(directions).all(1)] = 0
        depth, owner = np.full(n * s, np.inf), np.full(n * s, -1)
        normal, colour = np.zeros_like(directions), np.zeros_like(directions)
        for number, (one, parts) in enumerate(zip(self.objects, self.parts, strict=True)):
            for hits, rows in ((hit_ball, parts.balls), (hit_tube, parts.tubes)):
                for row in rows:
                    t, normals = hits(self.origin, directions, row)
                    seen = np.flatnonzero((t < depth) & (t > NEAR))
                    depth[seen], normal[seen] = t[seen], normals[seen]
                    colour[seen], owner[seen] = one.colour, number
            if len(parts.faces):
                found = self._faces(at, directions.reshape(n, s, 3), parts, depth)
                seen = np.flatnonzero(found >= 0)
                normal[seen] = _normals(parts)[found[seen]]
                colour[seen], owner[seen] = one.colour, number
        # A triangle is seen from either side.
        normal = np.where(np.einsum("ij,ij->i", normal, directions)[:, None] > 0, -normal, normal)
        light = np.array(settings.light) / np.linalg.norm(settings.light)
        bright = settings.ambient + (1 - settings.ambient) * np.maximum(normal @ light, 0)
        return (bright[:, None] * colour).reshape(n, s, 3), owner.reshape(n, s)

    def _faces(self, at: Reals, directions: Reals, parts: Surfaces, depth: Reals) -> Reals:
        """Return the nearest face at each sample or -1, and reduce its depth."""
        found, s = np.full(len(depth), -1), directions.shape[1]
        corners = parts.vertices[parts.faces]
        low, high = self._boxes(corners, 0.5 if s > 1 else 0.0, at.shape)
        widths, heights = np.maximum(high - low + 1, 0).T
        counts = widths * heights
        firsts = np.concatenate([[0], np.cumsum(counts)])
        start = 0
        while start < len(corners):
            stop = max(int(np.searchsorted(firsts, firsts[start] + _PAIRS // s, side="right")) - 1, start + 1)
            face = np.repeat(np.arange(start, stop), counts[start:stop])
            within = np.arange(len(face)) - (firsts[face] - firsts[start])
            pixel = at[low[face, 1] + within // widths[face], low[face, 0] + within % widths[face]]
            face, pixel = face[pixel >= 0], pixel[pixel >= 0]
            with np.errstate(all="ignore"):
                a, b, c = (corners[face, None, j] for j in range(3))
                t, inside = pga3.hit_ray_triangle(self.origin, directions[pixel], a, b, c)
                pair, sample = np.nonzero((inside >= 0).all(-1) & (t > NEAR))
            ray, t, face = pixel[pair] * s + sample, t[pair, sample], face[pair]
            np.minimum.at(depth, ray, t)
            nearest = t == depth[ray]
            found[ray[nearest]] = face[nearest]
            start = stop
        return found

    def _boxes(self, corners: Reals, margin: float, shape: tuple[int, ...]) -> tuple[Reals, Reals]:
        """Return the first and last columns and rows (m, 2) of pixels that triangles (m, 3, 3) may cover."""
        share = np.linspace(0, 1, _ON_EDGE, endpoint=False)[:, None]
        rim = np.concatenate([a + share * (b - a) for a, b in _sides(corners)], axis=1)
        last = np.array(shape[::-1]) - 1
        with np.errstate(all="ignore"):
            pixels = self.lens.distort(self.camera.project(rim))
            least, most = pixels.min(1), pixels.max(1)
        margin += 0.0 if self.lens.distortion is None else _SAG
        # Of a triangle that is partly behind the camera, the image has no bounds.
        is_cut = ~(self.camera.depth(corners) > NEAR).all(1, keepdims=True) | ~np.isfinite(least + most)
        low = np.where(is_cut, 0, np.ceil(np.clip(least - margin, 0, last + 1)))
        high = np.where(is_cut, last, np.floor(np.clip(most + margin, -1, last)))
        high[~(self.camera.depth(corners) > NEAR).any(1)] = -1
        return low.astype(int), high.astype(int)


def _range(values: Reals) -> Reals:
    """Return the differences of the largest and the least value among the neighbours of each pixel."""
    size = (3, 3, 1)[: values.ndim]
    return np.asarray(scipy.ndimage.maximum_filter(values, size) - scipy.ndimage.minimum_filter(values, size))


def _sides(corners: Reals) -> list[tuple[Reals, Reals]]:
    return [(corners[:, None, a], corners[:, None, (a + 1) % 3]) for a in range(3)]


def _surfaces(one: SceneObject) -> Surfaces:
    return Surfaces.at(one.pose, one.vertices, one.faces, one.model.balls, one.model.tubes)


def _normals(parts: Surfaces) -> Reals:
    a, b, c = (parts.vertices[parts.faces[:, k]] for k in range(3))
    found = np.cross(b - a, c - a)
    return np.asarray(found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), TINY))
