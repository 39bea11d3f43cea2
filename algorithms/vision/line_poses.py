"""The pose of a camera from points and lines together."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import line_poses

from ..arguments import Reals, real_array
from ..evidence import Freedom, Noise, Problem, all_or_some_sets
from ..evidence.consensus import Indices, without_repeats
from ..evidence.triangles import from_triangle
from ..precision import ROUNDING
from .camera import Camera
from .localization_results import Localization, no_localization
from .pose_agreement import FEWEST, SAMPLES, SIGMAS, agreeing_items
from .pose_refinement import Poses, camera_motors, deviations, growth_of_poses, judged_poses, ordered, pixel_noise
from .pose_starts import reversed_pose
from .robust import ALL, robust_estimate
from .starts import BEST, SETS, STEPS, real_roots
from .status import VisionStatus

_FARTHEST = 1e8
"""From floating point: the distance, in extents of the scene, from which lines have no direction any more."""
_FREEDOM = Freedom(sample_size=3, parameters=6, codimension=2, solutions=8, false_alarms=1e-2)


def line_arrays(lines: ArrayLike, image_lines: ArrayLike, camera: Camera | ArrayLike) -> tuple[Reals, Reals]:
    """Return lines (m, 2, 3) and what is seen of them (m, 2, 2), without distortion, after validation."""
    places = real_array(lines, "lines", (2, 3), "two points of each line").astype(np.float64)
    image = real_array(image_lines, "image_lines", (2, 2), "two pixels of each line").astype(np.float64)
    if places.ndim != 3 or image.ndim != 3:
        raise ValueError(f"lines: shapes {places.shape} and {image.shape}; expected (m, 2, 3) and (m, 2, 2)")
    if len(places) != len(image):
        raise ValueError(f"image_lines: {len(image)} lines; expected {len(places)}, as many as lines has")
    return places, np.asarray(camera.undistort(image) if isinstance(camera, Camera) else image)


def localize_with_lines(
    points: Reals,
    pixels: Reals,
    lines: Reals,
    image_lines: Reals,
    k: Reals,
    threshold: float | None,
    seed: int,
    confidence: float,
    max_samples: int,
    noise: float | None,
) -> Localization:
    """Return what `localize` does for points (n, 3), pixels (n, 2), lines (m, 2, 3) and their images (m, 2, 2)."""
    n, m = len(points), len(lines)
    finite = all(np.isfinite(each).all() for each in (points, pixels, lines, image_lines))
    if not finite or n + m < 4:
        return no_localization(VisionStatus.TOO_FEW if finite else VisionStatus.NOT_FINITE, n, m)
    empty = (lines[:, 0] == lines[:, 1]).all(1) | (image_lines[:, 0] == image_lines[:, 1]).all(1)
    if empty.any():
        return no_localization(VisionStatus.DEGENERATE, n, m)
    scene = _Scene(points, pixels, lines, image_lines, k, noise)
    inliers: Reals = np.ones(n + m, bool)
    starts = np.empty((0, 3, 4))
    if threshold is not None:
        estimate = robust_estimate(scene.problem(), threshold, seed, confidence, max_samples)
        if estimate.status != VisionStatus.OK:
            return no_localization(estimate.status, n, m)
        inliers, starts = estimate.inliers, estimate.model[None]
    found = scene.result(inliers, starts, threshold)
    if threshold is None and n + m >= FEWEST and scene.suspicious(found):
        agreed = scene.without_wrong_items()
        if agreed is None:
            status = VisionStatus.NO_CONSENSUS if found.status == VisionStatus.OK else found.status
            return no_localization(status, n, m)
        return scene.result(agreed, starts, threshold)
    return found


class _Scene:
    """Points and lines relative to the centroid of their points, in units of their extent, and what is seen of them."""

    def __init__(
        self, points: Reals, pixels: Reals, lines: Reals, image_lines: Reals, k: Reals, noise: float | None
    ) -> None:
        self.n_points = len(points)
        both = np.concatenate([points, lines.reshape(-1, 3)])
        self.centroid = both.mean(0)
        self.unit = max(float(np.sqrt(((both - self.centroid) ** 2).sum(1).mean())), np.finfo(float).tiny)
        points, lines = (points - self.centroid) / self.unit, (lines - self.centroid) / self.unit
        ones, nothing = np.ones((len(points), 1)), np.zeros((len(lines), 1))
        self.items = np.concatenate(
            [np.concatenate([points, points, ones], 1), np.concatenate([lines.reshape(-1, 6), nothing], 1)]
        )
        self.pixels = np.concatenate([np.tile(pixels, 2), image_lines.reshape(-1, 4)])
        self.k, self.dual = k, np.linalg.inv(k).T
        self.noise = pixel_noise(k, noise)
        rays = [np.insert(each, 2, 1, axis=1) @ self.dual for each in (self.pixels[:, :2], self.pixels[:, 2:])]
        self.sights = np.where(self.items[:, 6:] > 0, rays[0], np.cross(rays[0], rays[1]))
        """Directions to points, and normals of the planes of lines."""
        self.sights /= np.linalg.norm(self.sights, axis=1, keepdims=True)

    def squares(self, poses: Reals, which: Reals | slice) -> Reals:
        """Return the squared offsets of some of the items in poses."""
        return np.asarray(line_poses.item_squares(poses, self.k, self.dual, self.items[which], self.pixels[which]))

    def of_sets(self, sets: Reals) -> Reals:
        """Return the poses (m, 3, 4) of sets (b, 3) of items."""
        sets = np.sort(sets, axis=1)  # points first
        equations = self._equations(sets)
        coefficients, pencil = line_poses.rotation_polynomial(*np.moveaxis(equations, 1, 0))
        which, roots = real_roots(np.asarray(coefficients))
        rotation = np.asarray(line_poses.rotation_of_root(roots, np.asarray(pencil)[which]))
        poses = self._shifted(rotation, sets[which])
        return np.asarray(poses[np.isfinite(poses).all((1, 2))])

    def _equations(self, sets: Reals) -> Reals:
        """Return three matrices (b, 3, 3, 3) for sets of items whose products with the rotation vanish.

        With the first item at the origin, its camera at ``s`` times the first ray, each number of points among the
        three gives linear equations from which the translation is eliminated.
        """
        found = np.empty((len(sets), 3, 3, 3))
        place, sight = self.items[sets][:, :, :3], self.sights[sets]
        along = self.items[sets][:, :, 3:6] - place
        n_points = (self.items[sets][:, :, 6] > 0).sum(1)
        edge = place - place[:, :1]

        def outer(a: Reals, b: Reals) -> Reals:
            return np.asarray(a[:, :, None] * b[:, None, :])

        def dot(a: Reals, b: Reals) -> Reals:
            return np.asarray((a * b).sum(1)[:, None])

        lines = n_points[:, None] <= np.arange(3)
        for j in range(3):
            rows = lines[:, j]
            found[rows, j] = outer(sight[rows, j], along[rows, j])
        # Two points are in the plane of their rays, and each other item gives the distance s of the first one.
        for count in (1, 2, 3):
            rows = n_points == count
            ray, x, e = sight[rows, 0], sight[rows], edge[rows]
            distances = []
            for j in (1, 2):
                if j < count:
                    normal = np.cross(ray, x[:, j])
                    found[rows, j - 1] = outer(normal, e[:, j])
                    side = np.cross(x[:, j], normal)
                    distances.append((outer(side, e[:, j]), dot(side, ray)))
                else:
                    distances.append((outer(x[:, j], e[:, j]), dot(x[:, j], ray)))
            (one, a), (two, b) = distances
            # With two points, the first equation is theirs, and the last one is that of the line.
            found[rows, {1: 0, 2: 1, 3: 2}[count]] = b[..., None] * one - a[..., None] * two
        with np.errstate(all="ignore"):
            return np.asarray(found / np.linalg.norm(found, axis=(2, 3), keepdims=True))

    def _shifted(self, rotation: Reals, sets: Reals) -> Reals:
        """Return poses with the translations that fit the sights of items best."""
        x, is_line = self.sights[sets], self.items[sets][:, :, 6:, None] == 0
        outer = x[..., :, None] * x[..., None, :]
        projections = np.where(is_line, outer, np.eye(3) - outer)
        turned = rotation[:, None] @ self.items[sets][:, :, :3, None]
        normal, side = projections.sum(1), (projections @ turned).sum(1)
        regular = np.abs(np.linalg.det(normal)) > ROUNDING
        shift = -np.linalg.solve(np.where(regular[:, None, None], normal, np.eye(3)), side)
        shift[~regular | ~(np.abs(shift) < _FARTHEST).all((1, 2))] = np.nan
        return np.concatenate([rotation, shift], 2)

    def problem(self) -> Problem:
        """Return the problem of poses from samples of three items."""
        k, dual = self.k, self.dual

        def distances(models: Reals, items: Reals, pixels: Reals) -> Reals:
            return np.sqrt(line_poses.item_squares(models, k, dual, items, pixels))

        def costs(models: Reals, items: Reals, pixels: Reals, threshold: float) -> Reals:
            return np.asarray(line_poses.truncated_item_squares(models, k, dual, items, pixels, threshold**2))

        def descend(models: Reals, threshold: float, at_most: float) -> Reals:
            found, _, _ = line_poses.descend_item_pose(models, k, dual, self.items, self.pixels, threshold**2, at_most)
            return np.asarray(found)

        return Problem(self.items, self.pixels, _FREEDOM, self.of_sets, distances, costs, descend)

    def suspicious(self, found: Localization) -> bool:
        """Return whether the offsets of all items exceed the usual noise."""
        n = len(self.items)
        if found.status not in (VisionStatus.OK, VisionStatus.AMBIGUOUS):
            return found.status == VisionStatus.NOT_CONVERGED
        return bool(Noise(self.noise.variance).contradicted(np.array(n * found.residual**2), 2 * n - 6))

    def without_wrong_items(self) -> Indices | None:
        """Return which items agree with a pose.

        Unrelated pixels of points are anywhere in the part of the image that pixels cover. What is seen of unrelated
        lines has any place and direction there.
        """
        pixels = self.pixels.reshape(-1, 2)
        extents = np.ptp(pixels, axis=0)
        lengths = np.linalg.norm(self.pixels[:, 2:] - self.pixels[:, :2], axis=1)
        lengths = np.where(self.items[:, 6] > 0, np.hypot(*extents) / np.pi, lengths)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.hypot(*extents) / (np.prod(extents) * lengths)
        once = without_repeats(self.items, self.pixels, SIGMAS * float(np.sqrt(self.noise.variance)))

        def minimum(pose: Reals, inliers: Indices) -> tuple[Reals, Reals]:
            found = self._refined(pose[None], np.flatnonzero(inliers)).at((0, 0))
            return found.matrix, found.cost

        def squares(poses: Reals) -> Reals:
            return self.squares(poses, slice(None))

        poses = self.of_sets(all_or_some_sets(len(self.items), 3, SAMPLES))
        return agreeing_items(poses, squares, minimum, shares, once, self.noise, _FREEDOM)

    def result(self, inliers: Reals, starts: Reals, threshold: float | None) -> Localization:
        """Return the result for some of the items."""
        n, m = self.n_points, len(self.items) - self.n_points
        some = np.flatnonzero(inliers)
        candidates = self.of_sets(some[all_or_some_sets(len(some), 3, SETS)])
        squares = self.squares(candidates, some)
        order = np.argsort(np.median(squares, axis=1) + squares.mean(1) / len(some), kind="stable")
        candidates = np.concatenate([starts, candidates[order[:BEST]]])
        if not len(candidates):
            return no_localization(VisionStatus.DEGENERATE, n, m)
        ends = self.items[some][:, :6].reshape(-1, 3)
        found = self._refined(candidates, some)
        again = np.asarray(reversed_pose(found.matrix[0, :1], (ends - ends.mean(0))[None]))
        found = ordered(joined_poses(found, self._refined(again, some)))
        places = self.items[some][:, :3]
        squares = self.squares(found.matrix[:, 0], some)
        units = np.maximum(np.linalg.norm(found.matrix[..., 3], axis=-1), np.finfo(float).tiny)
        states, rivals = judged_poses(
            found, places[None], squares, np.array([self._spread(some)]), self.noise, units, ends[None]
        )
        status = VisionStatus(int(states[0]))
        if status not in (VisionStatus.OK, VisionStatus.AMBIGUOUS):
            return no_localization(status, n, m)
        rows, growth = found.matrix[0, rivals[0]].copy(), 1.0
        if threshold is not None:
            growth = growth_of_poses(self.squares(rows[:1], np.arange(n + m)), threshold)
        if not np.isfinite(growth):
            return no_localization(VisionStatus.NO_CONSENSUS, n, m)
        rows[..., 3] *= self.unit
        poses = camera_motors(rows, np.broadcast_to(self.centroid, (len(rows), 3)))
        pose = poses[0] if status == VisionStatus.OK else np.full(8, np.nan)
        first = found.at((0, 0))
        size = float(units[0, 0]) * self.unit
        known = deviations(first, len(some), self.noise, size, growth)
        residual = float(np.sqrt(first.cost / len(some)))
        return Localization(pose, status, residual, inliers[:n], poses, known, inliers[n:])

    def _refined(self, starts: Reals, some: Reals) -> Poses:
        """Return the minima (1, s) near starts (s, 3, 4)."""
        found, triangle, numbers = line_poses.descend_item_pose(
            starts, self.k, self.dual, self.items[some], self.pixels[some], ALL, float(STEPS)
        )
        near = np.abs(found[:, :, 3]).max(1) < _FARTHEST
        cost = np.where(near & (numbers[:, 0] < ALL), numbers[:, 0], np.nan)
        in_front = (self.squares(found, some) < ALL).all(1)
        parts = np.asarray(found), cost, from_triangle(np.asarray(triangle), 6), numbers[:, 1] > 0, in_front
        return ordered(Poses(*(np.asarray(each)[None] for each in (*parts, numbers[:, 3]))))

    def _spread(self, some: Reals) -> float:
        """Return the sum of squares of pixels about their centroid; the two pixels of a line count half each."""
        pixels = self.pixels[some].reshape(-1, 2)
        return float(((pixels - pixels.mean(0)) ** 2).sum()) / 2


def joined_poses(one: Poses, two: Poses) -> Poses:
    """Return the poses (1, s) of both."""
    names = ("matrix", "cost", "normal", "converged", "in_front", "lowest")
    return Poses(*(np.concatenate([getattr(one, name), getattr(two, name)], 1) for name in names))
