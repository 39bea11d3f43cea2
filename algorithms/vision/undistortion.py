"""Images without the distortion of a lens."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import images

from ..arguments import Reals, real_array
from .camera import Camera


def undistort_image(
    image: ArrayLike, camera: Camera, target: Camera | None = None, size: tuple[int, int] | None = None
) -> Reals:
    """Return the image that a pinhole camera at the same place would have, by bilinear interpolation.

    Parameters
    ----------
    image : array_like, (h, w) or (h, w, c)
        Pixels (x, y) are at row y and column x.
    camera : Camera
        The camera of the image, with its distortion.
    target : Camera, optional
        The camera whose intrinsic parameters the result has; its pose is not used. The default is ``camera.pinhole``.
        With shorter focal lengths, more of the image of a wide lens remains.
    size : (int, int), optional
        Width and height of the result; the default is those of the image.

    Returns
    -------
    array, (h, w) or (h, w, c)
        float32 or float64. Pixels whose place in the image is outside of it or beyond the range of the lens are NaN.

    Raises
    ------
    TypeError, ValueError
        If `image` is not an image, if `camera` is not a `Camera`, if `target` has distortion, or if `size` is not
        positive.
    """
    array = real_array(image, "image")
    if array.ndim not in (2, 3) or 0 in array.shape:
        raise ValueError(f"image: shape {array.shape}; expected (h, w) or (h, w, c), not empty")
    for one, name in ((camera, "camera"), (target, "target")):
        if not isinstance(one, Camera) and not (one is None and name == "target"):
            raise TypeError(f"{name}: {type(one).__name__}; expected a Camera")
    new = camera.pinhole if target is None else target
    if new.distortion is not None:
        raise ValueError("target: a camera with distortion; expected one without; pass target.pinhole")
    width, height = array.shape[1::-1] if size is None else size
    if not (width > 0 and height > 0):
        raise ValueError(f"size: {width} x {height}; expected positive numbers of pixels")
    pixels = np.stack(np.meshgrid(np.arange(float(width)), np.arange(float(height))), -1)
    if target is not None:
        # The pixels of `camera.pinhole` with the same directions.
        turned = camera.intrinsics @ np.linalg.inv(new.intrinsics)
        pixels = pixels @ turned[:2, :2].T + turned[:2, 2]
    return sampled(array, camera.distort(pixels))


def sampled(image: Reals, places: Reals) -> Reals:
    """Return an image at places (h, w, 2); NaN outside of it."""
    rows, columns = image.shape[:2]
    channels = image.reshape(rows, columns, -1)
    last = np.array([columns, rows]) - 1
    inside = np.asarray(np.isfinite(places).all(-1) & (places >= 0).all(-1) & (places <= last).all(-1))
    known = np.where(inside[..., None], places, 0)
    whole = np.minimum(known.astype(np.intp), np.maximum(last - 1, 0))
    x, y = np.moveaxis((known - whole).astype(image.dtype), -1, 0).reshape(2, -1)
    place = (whole[..., 1] * columns + whole[..., 0]).reshape(-1)
    padded = np.pad(channels, [(0, 1), (0, 1), (0, channels.shape[2] % 2)], "edge")
    found = []
    for k in range(0, padded.shape[2], 2):
        # The kernel interpolates two numbers at once: a channel of a pixel and of the next one, and another channel.
        pair = padded[:, :-1, k], padded[:, 1:, k], padded[:, :-1, k + 1], padded[:, 1:, k + 1]
        table = np.stack(pair, -1).reshape(-1, 4)
        found.append(images.motion_samples(table[:-columns], table[columns:], place, x, y))
    result = np.concatenate(found, -1)[:, : channels.shape[2]].reshape(*places.shape[:2], -1)
    return np.where(inside[..., None], result, np.nan).reshape(*places.shape[:2], *image.shape[2:])
