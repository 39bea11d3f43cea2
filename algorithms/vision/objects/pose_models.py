"""Models of objects for pose estimation, and what cameras see of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ...arguments import Reals, finite, finite_number, real_array
from ..camera import Camera, camera_matrix

KINDS = ("points", "edges", "balls", "tubes", "rims")
"""Points, straight edges, silhouettes of spheres, straight sides of cylinders, and circles, such as their ends."""
_EQUATIONS = {"points": 2, "edges": 1, "balls": 1, "tubes": 1, "rims": 1}


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """Elements of a rigid object, in its own frame, by which images determine its pose.

    Attributes
    ----------
    points : array, (n, 3)
    edges : array, (k, 2, 3)
        The end points of straight edges.
    balls : array, (k, 4)
        Centres and radii of spheres.
    tubes : array, (k, 7)
        The centres of both ends of cylinders, and their radii.
    rims : array, (k, 7)
        The centres, unit normals and radii of circles.
    """

    points: Reals
    edges: Reals
    balls: Reals
    tubes: Reals
    rims: Reals

    @classmethod
    def of(
        cls,
        points: ArrayLike | None = None,
        edges: ArrayLike | None = None,
        spheres: ArrayLike | None = None,
        cylinders: ArrayLike | None = None,
    ) -> ObjectModel:
        """Return a model; each cylinder also contributes the circles of its two ends.

        Parameters
        ----------
        points : array_like, (n, 3), optional
        edges : array_like, (k, 2, 3), optional
            End points of straight edges.
        spheres : array_like, (k, 4), optional
            Centres and radii.
        cylinders : array_like, (k, 7), optional
            Centres of the two ends, and radii.

        Raises
        ------
        TypeError, ValueError
            If shapes differ, numbers are not finite, a radius is not positive, two ends coincide, or the model is
            empty.
        """
        place = _rows(points, "points", (3,))
        lines = _rows(edges, "edges", (2, 3))
        balls, tubes = _rows(spheres, "spheres", (4,)), _rows(cylinders, "cylinders", (7,))
        for name, found in (("spheres", balls), ("cylinders", tubes)):
            if not (found[:, -1] > 0).all():
                raise ValueError(f"{name}: a radius that is not positive; expected positive radii in the last column")
        along = tubes[:, 3:6] - tubes[:, :3]
        for name, found in (("edges", lines[:, 1] - lines[:, 0]), ("cylinders", along)):
            if not np.linalg.norm(found, axis=1).all():
                raise ValueError(f"{name}: two ends coincide; expected distinct ends")
        if not any(map(len, (place, lines, balls, tubes))):
            raise ValueError("ObjectModel: no element; expected points, edges, spheres or cylinders")
        unit = along / np.linalg.norm(along, axis=1, keepdims=True) if len(tubes) else along
        ends = [np.hstack([tubes[:, at], unit, tubes[:, 6:]]) for at in (slice(0, 3), slice(3, 6))]
        return cls(place, lines, balls, tubes, np.concatenate(ends))

    @cached_property
    def tables(self) -> dict[str, Reals]:
        """The elements of each kind as rows of the kernels."""
        edges = pga3.join_points(*np.ascontiguousarray(np.swapaxes(self.edges, 0, 1)))
        axes = pga3.normalize_line(pga3.join_points(self.tubes[:, :3].copy(), self.tubes[:, 3:6].copy()))
        return {
            "points": self.points,
            "edges": edges,
            "balls": self.balls,
            "tubes": np.hstack([axes, self.tubes[:, 6:]]),
            "rims": self.rims,
        }

    @cached_property
    def samples(self) -> Reals:
        """(n, 3) Points of all elements, which represent the extent of the object."""
        around = [self.points, self.edges.reshape(-1, 3), self.tubes[:, :6].reshape(-1, 3)]
        for centre, radius in ((self.balls[:, :3], self.balls[:, 3:]), (self.rims[:, :3], self.rims[:, 6:])):
            around += [centre + sign * radius * axis for axis in np.eye(3) for sign in (-1, 1)]
        return np.concatenate(around)

    @cached_property
    def centre(self) -> Reals:
        """(3) The mean of the samples."""
        return np.asarray(self.samples.mean(0))

    @cached_property
    def axes(self) -> tuple[Reals, Reals]:
        """The principal directions of the samples as rows, longest first, and the lengths in these directions."""
        _, lengths, directions = np.linalg.svd(self.samples - self.centre, full_matrices=False)
        whole = np.vstack([directions[:2], np.cross(directions[0], directions[min(1, len(directions) - 1)])[None]])
        return whole, lengths / np.sqrt(len(self.samples))

    @cached_property
    def lever(self) -> Reals:
        """(3, 3) The matrix L with ``w @ L`` the cross product of w and the centre."""
        return np.cross(np.eye(3), self.centre)

    @cached_property
    def half_turns(self) -> Reals:
        """(3, 8) The motors of half turns about the principal axes through the centre."""
        turns = np.zeros((3, 8))
        turns[:, 1:7] = pga3.line_from_direction_moment(self.axes[0], np.cross(self.centre, self.axes[0]))
        return turns

    @cached_property
    def size(self) -> float:
        """The root mean square distance of the samples from their centre, or of a model of one point, one."""
        return float(np.sqrt(np.square(self.samples - self.centre).sum(1).mean())) or 1.0


@dataclass(frozen=True, eq=False)
class View:
    """The measured pixels of one object in the image of one camera, without lens distortion.

    Attributes
    ----------
    camera : Camera
    points : array, (n, 2), optional
        The pixel of each point of the model; NaN for those that are not seen.
    edges, balls, tubes, rims : (array of int, (k,), array, (k, 2)), optional
        The index of an element of the model for each pixel, and pixels on its edge or silhouette.
    """

    camera: Camera
    points: ArrayLike | None = None
    edges: tuple[ArrayLike, ArrayLike] | None = None
    balls: tuple[ArrayLike, ArrayLike] | None = None
    tubes: tuple[ArrayLike, ArrayLike] | None = None
    rims: tuple[ArrayLike, ArrayLike] | None = None


@dataclass(frozen=True, slots=True)
class SharedErrors:
    """How well the cameras and the model are known: standard deviations of errors that all pixels share.

    One camera whose focal length is wrong sees an object at another distance, with nearly the same image. Only who
    states how well the focal length is known has bounds that hold.
    """

    focal: float = 0.0
    """Of the focal lengths of all cameras, which are too large by the same factor: of its logarithm."""
    distortion: float = 0.0
    """Of the coefficient k1 of the lenses."""
    size: float = 0.0
    """Of the extents of the object along each of its axes: of their logarithms."""

    def __post_init__(self) -> None:
        """Refuse deviations that are negative or not finite."""
        for name, value in zip(self.__slots__, astuple(self), strict=True):
            if finite_number(value, f"SharedErrors: {name}") < 0:
                raise ValueError(f"SharedErrors: {name}: {value}; expected a standard deviation, zero or positive")


EXACT = SharedErrors()
"""Cameras and models without errors."""


class Pixels(NamedTuple):
    """Pixels of one kind of element: the first four arrays are arguments of the kernels."""

    elements: Reals
    """The row of the kernels of the element of each pixel."""
    pixels: Reals
    """(n, 2)"""
    cameras: Reals
    """(n) The index of the camera."""
    weights: Reals
    """(n) One, or zero for pixels that are left out."""
    rows: Reals
    """(n) The index of the element in the model."""


class Measurements(NamedTuple):
    """All pixels of all views."""

    cameras: tuple[Camera, ...]
    matrices: Reals
    """(v, 3, 4) Of the cameras."""
    of: dict[str, Pixels]
    """By kind of element."""
    kinds: tuple[str, ...]
    """Those of which there are pixels."""
    n_pixels: int
    n_equations: int
    n_missing: int
    """Points of the model that a view does not show."""
    is_finite: bool
    arguments: tuple[Reals, ...]
    """The arguments of the kernels after the motor."""

    @property
    def lenses(self) -> Reals:
        """(v, 3) Of each camera the pixel of its axis, and the inverse of its focal length."""
        found = []
        for camera in self.cameras:
            (f, _, x), (_, g, y), _ = np.asarray(camera.intrinsics).tolist()
            found.append((x, y, 2 / (f + g)))
        return np.array(found)


def _constant(values: Reals) -> Reals:
    values.flags.writeable = False
    return values


_ABSENT = {
    kind: Pixels(*map(_constant, (np.zeros((0, n)), np.zeros((0, 2)), np.zeros(0, int), np.zeros(0), np.zeros(0, int))))
    for kind, n in {"points": 3, "edges": 6, "balls": 4, "tubes": 7, "rims": 7}.items()
}


def measurements(model: ObjectModel, views: tuple[View, ...]) -> Measurements:
    """Collect the pixels of all views; ValueError if there is none, or indices or shapes disagree with the model."""
    if not views:
        raise ValueError("views: none; expected at least one View")
    found = dict(_ABSENT)
    missing, count, equations, present, is_finite = 0, 0, 0, [], True
    arguments: list[Reals] = [
        np.array([camera_matrix(view.camera, f"views[{k}].camera") for k, view in enumerate(views)])
    ]
    for kind in KINDS:
        parts = []
        table = model.tables[kind]
        for k, view in enumerate(views):
            seen = getattr(view, kind)
            if seen is None:
                missing += len(model.points) if kind == "points" else 0
                continue
            index, image = _numbered(kind, seen, len(table))
            if not np.isfinite(image).all():
                if kind == "points":
                    shown = np.asarray(~np.isnan(image).any(1))
                    missing += int(shown.size - shown.sum())
                    index, image = index[shown], image[shown]
                is_finite = is_finite and bool(np.isfinite(image).all())
            n = len(image)
            if n:
                elements = table if n == len(table) and kind == "points" else table[index]
                owner = np.zeros(n, int)
                owner += k
                parts.append((elements, image, owner, np.ones(n), index))
        if parts:
            present.append(kind)
            one = Pixels(*(parts[0] if len(parts) == 1 else map(np.concatenate, zip(*parts, strict=True))))
            found[kind] = one
            count += len(one.rows)
            equations += _EQUATIONS[kind] * len(one.rows)
        arguments += found[kind][:4]
    cameras, counts = tuple(view.camera for view in views), (count, equations, missing)
    return Measurements(cameras, arguments[0], found, tuple(present), *counts, is_finite, tuple(arguments))


def fullest_camera(seen: Measurements, kinds: Sequence[str]) -> int:
    """Return the index of the camera that sees most pixels of some kinds."""
    if len(seen.cameras) == 1:
        return 0
    return int(np.bincount(np.concatenate([seen.of[kind].cameras for kind in kinds]), minlength=1).argmax())


def points_of_camera(seen: Measurements, k: int) -> tuple[Reals, Reals]:
    """Return the points (n, 3) of the object that a camera sees, and their pixels (n, 2)."""
    one = seen.of["points"]
    if len(seen.cameras) == 1:
        return one.elements, one.pixels
    own = one.cameras == k
    return one.elements[own], one.pixels[own]


def with_weights(seen: Measurements, weights: dict[str, Reals]) -> Measurements:
    """Return measurements with weights, zeros and ones, for some kinds of elements."""
    found = {kind: one._replace(weights=weights.get(kind, one.weights)) for kind, one in seen.of.items()}
    counts = {kind: int(one.weights.sum()) for kind, one in found.items()}
    arguments = (seen.matrices, *(part for kind in KINDS for part in found[kind][:4]))
    equations = sum(_EQUATIONS[kind] * n for kind, n in counts.items())
    return seen._replace(of=found, n_pixels=sum(counts.values()), n_equations=equations, arguments=arguments)


def _numbered(kind: str, seen: Any, n: int) -> tuple[Reals, Reals]:
    if kind == "points":
        image = real_array(seen, "View: points", (n, 2), "a pixel for each point of the model")
        if image.ndim != 2:
            raise ValueError(f"View: points: shape {image.shape}; expected ({n}, 2), the pixels of one image")
        return np.arange(n), image.astype(np.float64, copy=False)
    index, image = seen
    rows = np.asarray(index)
    pixels = real_array(image, f"View: {kind}", (2,), "x y").astype(np.float64).reshape(-1, 2)
    is_table = rows.shape == (len(pixels),) and (not rows.size or rows.dtype.kind in "iu")
    if not is_table or (rows.size and not 0 <= int(rows.min()) <= int(rows.max()) < n):
        raise ValueError(f"View: {kind}: indices {rows}; expected for each of {len(pixels)} pixels one below {n}")
    return rows.astype(np.int64), pixels


def _rows(values: ArrayLike | None, name: str, shape: tuple[int, ...]) -> Reals:
    if values is None:
        return np.zeros((0, *shape))
    found = finite(real_array(values, name, shape), name).astype(np.float64)
    return found.reshape(-1, *shape)
