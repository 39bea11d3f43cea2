"""Data of experiments with Clifford support vector machines: spirals, point sets, curves in space, and rotors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blade_signs import blade_signs
from .svm_kernels import KernelSettings, kernel_named

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def spirals(n: int, starts: tuple[float, ...] = (1, 10, 20, 30, 40)) -> tuple[Floats, Integers]:
    """Return points on spirals in space (n for each, 3), and the number of the spiral of each point.

    A point at the angle t with the distance z is ``z (cos t sin t, sin t sin t, cos t)``; z grows by 40 along each
    spiral.
    """
    t = np.linspace(0, 2 * np.pi, n)
    points = []
    for start in starts:
        z = 4 * np.linspace(0, 10, n) + start
        points.append(np.column_stack([z * np.cos(t) * np.sin(t), z * np.sin(t) ** 2, z * np.cos(t)]))
    return np.concatenate(points), np.repeat(np.arange(len(starts)), n)


@dataclass(frozen=True, eq=False)
class PointSets:
    """Views of objects in space.

    Attributes
    ----------
    points : array, (views, n, 3)
    labels : array, (views,)
    """

    points: Floats
    labels: Integers


SHAPES = ("sphere", "box", "cylinder", "cone", "torus", "helix")


def point_sets(views: int, n: int, seed: int, noise: float = 0.02, occluded: float = 0.0) -> PointSets:
    """Sample six shapes, in random orientations and sizes, with noise and with a part of each that is not seen.

    Parameters
    ----------
    views : int
        For each shape.
    n : int
        Points of a view.
    seed : int
    noise : float
        Standard deviation of coordinates, relative to the size.
    occluded : float
        The share of points that is cut off by a plane.
    """
    random = np.random.default_rng(seed)
    found = []
    for shape in SHAPES:
        for _ in range(views):
            whole = int(np.ceil(n / (1 - occluded)))
            points = _surface(shape, whole, random) + noise * random.normal(size=(whole, 3))
            axis = random.normal(size=3)
            points = points[np.argsort(points @ axis)[:n]]
            turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
            turn *= np.sign(np.linalg.det(turn))
            found.append(random.uniform(0.5, 2) * points @ turn + random.normal(size=3))
    return PointSets(np.array(found), np.repeat(np.arange(len(SHAPES)), views))


def _surface(shape: str, n: int, random: np.random.Generator) -> Floats:
    u, v, side = random.uniform(0, 2 * np.pi, n), random.uniform(-1, 1, n), random.uniform(size=n)
    circle = np.column_stack([np.cos(u), np.sin(u)])
    if shape == "sphere":
        return np.asarray(np.column_stack([np.sqrt(1 - v * v)[:, None] * circle, v]))
    if shape == "box":
        points = random.uniform(-1, 1, (n, 3))
        points[np.arange(n), random.integers(0, 3, n)] = np.sign(v)
        return points
    if shape == "cylinder":
        cap = side < 0.25
        radius = np.where(cap, np.sqrt(random.uniform(size=n)), 1)
        return np.asarray(np.column_stack([0.5 * radius[:, None] * circle, np.where(cap, np.sign(v), v)]))
    if shape == "cone":
        return np.asarray(np.column_stack([np.sqrt(side)[:, None] * circle, 1 - 2 * np.sqrt(side)]))
    if shape == "torus":
        w = np.pi * v
        return np.asarray(np.column_stack([(1 + 0.35 * np.cos(w))[:, None] * circle, 0.35 * np.sin(w)]))
    return np.column_stack([0.6 * np.cos(2 * u), 0.6 * np.sin(2 * u), u / np.pi - 1])


def multivectors_of_points(sets: PointSets, n: int = 16) -> Floats:
    """Describe point sets by multivectors of G(3,0) that rotations and translations leave unchanged (views, n, 8).

    The points are centred, scaled to the mean distance 1, and turned to their principal axes. A multivector contains a
    quantile of the distances, and those of the coordinates without their signs, and of products of two.
    """
    points = sets.points - sets.points.mean(1, keepdims=True)
    points = points / np.linalg.norm(points, axis=2).mean(1)[:, None, None]
    axes = np.linalg.svd(points, full_matrices=False)[2]
    local = np.abs(points @ axes.transpose(0, 2, 1))
    share = (np.arange(n) + 0.5) / n

    def sorted_of(values: Floats) -> Floats:
        return np.quantile(values, share, axis=1).T

    x, y, z = np.moveaxis(local, 2, 0)
    parts = [np.linalg.norm(local, axis=2), x, y, x * y, z, x * z, y * z, x * y * z]
    return np.ascontiguousarray(np.stack([sorted_of(part) for part in parts], -1))


def curves(t: Floats) -> Floats:
    """Return the coordinates of three curves in space at parameters in [0, 1] (n, 9), as one multivector each.

    The curves are a helix, a knot and a figure of Lissajous.
    """
    a = 2 * np.pi * t
    helix = [np.cos(a), np.sin(a), 2 * t - 1]
    radius = (2 + np.cos(3 * a)) / 3
    knot = [radius * np.cos(2 * a), radius * np.sin(2 * a), np.sin(3 * a) / 2]
    figure = [np.sin(a), np.sin(2 * a), np.cos(3 * a)]
    return np.column_stack([*helix, *knot, *figure])


class CovariantKernel:
    """Gaussian of a window in the frame of the body, times ``~a b`` for the rotors of two samples.

    The first multivector of a sample is the rotor, the others are measurements. If the rotors of all samples are
    multiplied by a rotor from the left, the kernel does not change, so the machine's values are multiplied by it too.

    Parameters
    ----------
    gamma : float
        The factor of squared distances of windows.
    """

    def __init__(self, gamma: float) -> None:
        self.gamma = gamma

    def __call__(self, a: Floats, b: Floats) -> Floats:
        """Return the kernels (n, k, 4) of samples (n, d, 4) and (k, d, 4) of G(0,2)."""
        signs = blade_signs(0, 2)
        settings = KernelSettings(self.gamma, 1, 0.0, np.zeros(4), signs)
        size = kernel_named("scalar", settings, True).values(a[:, 1:], b[:, 1:])
        product = kernel_named("linear", settings, True).values(a[:, :1], b[:, :1])
        return np.ascontiguousarray(np.moveaxis(size * product, 1, 2))


@dataclass(frozen=True, eq=False)
class RotorWindows:
    """Windows of inertial measurements between two orientations.

    Attributes
    ----------
    samples : array, (n, 17, 4)
        The reverse of the first rotor, and the window: eight mean rates, as angles, and eight accelerations in g, as
        quaternions without scalar part.
    rotors : array, (n, 4)
        The reverse of the last rotor, with the sign that is nearer to the first.
    """

    samples: Floats
    rotors: Floats


_STEPS = 16
"""Orientations of the motion capture from the first to the last one of a window, with four readings each."""


def rotor_windows(recording: Mapping[str, Any], n: int, first: int, last: int, seed: int) -> RotorWindows:
    """Choose windows of 64 readings of a recording in `tests/data/estimation` at random, in which the sensor moves.

    Parameters
    ----------
    recording : mapping
    n : int
    first, last : int
        Orientations between which windows begin.
    seed : int
    """
    truth = np.asarray(recording["truth"], float)
    fine = np.isfinite(truth).all(1)
    starts = np.random.default_rng(seed).permutation(np.arange(first, last))
    usable = fine[starts] & fine[starts + _STEPS] & np.asarray(recording["moving"])[4 * starts]
    starts = starts[usable][:n]
    rows = 4 * starts[:, None] + 3 + np.arange(4 * _STEPS)
    window = np.zeros((len(starts), 16, 4))
    rates = np.asarray(recording["rates"], float)[rows].reshape(len(starts), 8, 8, 3).mean(2)
    window[:, :8, 1:] = rates * 8 / float(recording["rate"])
    window[:, 8:, 1:] = np.asarray(recording["accelerations"], float)[rows].reshape(-1, 8, 8, 3).mean(2) / 9.81
    one, two = truth[starts], truth[starts + _STEPS]
    two = two * np.where((one * two).sum(1) < 0, -1, 1)[:, None]
    back = np.array([1, -1, -1, -1])
    return RotorWindows(np.concatenate([(one * back)[:, None], window], 1), two * back)


def rotor_error(found: Floats, truth: Floats) -> float:
    """Return the root mean square of angles between rotors (n, 4), in degrees; `found` is normalised."""
    cosine = np.abs((found * truth).sum(1)) / np.linalg.norm(found, axis=1)
    return float(np.degrees(np.sqrt(np.mean((2 * np.arccos(np.minimum(cosine, 1))) ** 2))))
