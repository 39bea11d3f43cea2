"""Pairs of images whose motion is known: one image, sampled twice through splines of fifth order."""

from __future__ import annotations

import numpy as np
import scipy.ndimage

SIZE, MARGIN, BORDER = 224, 40, 24


def pair(image: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two images of 224 x 224 pixels and the motion (u, v) of each pixel of the first one.

    "translation" is by (2.3, -1.6) pixels; "rotation" turns by 2 degrees, enlarges by 2 % and moves by (0.4, -0.7).
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
