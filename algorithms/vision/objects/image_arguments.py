"""Validation of cameras, images, models and meshes that measurements in images have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ...arguments import Reals, as_given, real_array
from ...precision import SINGLE
from .pose_models import ObjectModel
from .predicted_curves import Mesh, surface_of_model
from .scene import SceneCamera


def check_size(camera: SceneCamera, image: ArrayLike) -> None:
    """Raise a ValueError if an image has not the size of its camera, or the camera is mounted on a robot."""
    if camera.is_mounted:
        raise ValueError("camera: mounted on a robot; expected its pose in the world, as from Scene.placed_camera")
    shape = np.shape(image)
    if shape[:2] != camera.size[::-1]:
        raise ValueError(f"image: shape {shape}; expected {(*camera.size[::-1], 3)}, the size of the camera")


def real_image(camera: SceneCamera, image: ArrayLike) -> Reals:
    """Return an image of a camera as (h, w, c) of float64."""
    check_size(camera, image)
    array = real_array(image, "image", (), "rows, columns, and colours").astype(np.float64)
    array = array[..., None] if array.ndim == 2 else array
    if array.ndim != 3 or not array.shape[2]:
        raise ValueError(f"image: shape {array.shape}; expected (h, w) or (h, w, 3)")
    return array


def checked_images(
    model: ObjectModel, cameras: SceneCamera | Sequence[SceneCamera], images: ArrayLike | Sequence[ArrayLike],
    start: ArrayLike | None,
) -> tuple[tuple[SceneCamera, ...], tuple[Any, ...], Reals | None]:  # fmt: skip
    """Return cameras and images as tuples of equal length, and the start as an array."""
    every = (cameras,) if isinstance(cameras, SceneCamera) else tuple(cameras)
    pictures: tuple[Any, ...] = (images,) if isinstance(cameras, SceneCamera) else tuple(cast(Any, images))
    if not every or len(every) != len(pictures):
        raise ValueError(f"images: {len(pictures)} for {len(every)} cameras; expected one for each, and at least one")
    check_outline(model)
    return every, pictures, None if start is None else checked_start(start)


def check_outline(model: ObjectModel) -> None:
    """Raise a ValueError if a model has no outline."""
    if not any(map(len, (model.edges, model.balls, model.tubes))):
        raise ValueError("model: points only; expected edges, spheres or cylinders, which have an outline")


def checked_start(start: ArrayLike) -> Reals:
    """Return a pose as an array; ValueError if it is not a unit motor."""
    given = real_array(start, "start", (8,), "a motor").astype(np.float64)
    if given.ndim != 1 or not np.abs(given - pga3.normalize_motor(given)).max() < SINGLE:
        raise ValueError(f"start: {given}; expected one unit motor of generated.pga3")
    return given


def checked_mesh(model: ObjectModel, mesh: tuple[ArrayLike, ArrayLike] | None) -> Mesh:
    """Return a mesh as arrays; by default that of the model."""
    if mesh is None:
        return surface_of_model(model)
    vertices = real_array(mesh[0], "mesh", (3,), "vertices").astype(np.float64)
    faces = as_given(mesh[1], "mesh")
    if vertices.ndim != 2 or faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise ValueError(
            f"mesh: shapes {vertices.shape} and {faces.shape} of {faces.dtype}; expected vertices (n, 3) and faces "
            "(m, 3) of integers"
        )
    return vertices, faces
