"""Bundle adjustment: cameras, points, lines and lenses that agree best with where the points and lines are seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, check_pixels, finite_number, real_array
from ..evidence import Noise, largest_ratio
from .bundle_arguments import (
    LOSSES,
    Cameras,
    LineTable,
    Table,
    checked_cameras,
    checked_distortion,
    checked_fixed,
    checked_lenses,
    checked_lines,
    checked_table,
    without_distortion,
)
from .bundle_descent import BundleStep, Descent, Information, descended
from .bundle_misfits import BundleMisfit, bundle_misfit
from .bundle_parts import Parts, parts_of
from .bundle_results import BundleAdjustment
from .bundle_scene import Scene, State
from .bundle_system import BLOCK, Layout, across_lines
from .camera import Camera, intrinsics_of, matrix_of
from .plane_adjustment import N_INTRINSICS
from .pose_refinement import pixel_noise
from .status import VisionStatus


def bundle_adjust(
    cameras: Cameras,
    points: ArrayLike,
    observations: Table,
    *,
    lines: ArrayLike | None = None,
    image_lines: LineTable | None = None,
    distortion: str | None = None,
    coefficients: ArrayLike | None = None,
    intrinsics: str | ArrayLike = "fixed",
    estimated: Sequence[str] | None = None,
    loss: str | None = None,
    scale: float = 1.0,
    noise: float | None = None,
    fixed_cameras: ArrayLike | None = None,
    fixed_points: ArrayLike | None = None,
    max_steps: int = 100,
    covariance: str | None = "cameras",
    progress: Callable[[BundleStep], object] | None = None,
) -> BundleAdjustment:
    """Adjust cameras, points and lines by least squares of distances in the images.

    This is the last step of structure from motion: bundle adjustment as in COLMAP's ``bundle_adjuster``, Ceres,
    ``cv2.detail.BundleAdjusterReproj`` and gtsam's ``GeneralSFMFactor``. The minimum of the reprojection errors near
    the given cameras and points is found by Levenberg and Marquardt's method on the manifold of motors. Points and
    lines are eliminated from its equations (Schur complement).

    Parameters
    ----------
    cameras : sequence of Camera, or a pair of array_like, (c, 3, 3) and (c, 8)
        The start: cameras, or matrices K and unit motors from the frames of cameras to that of the world.
    points : array_like, (m, 3)
        The start: world coordinates.
    observations : Observations, or three of array_like, (k,), (k,) and (k, 2)
        Numbers of cameras, numbers of points, and pixels. Pixels that are NaN count as not seen.
    lines : array_like, (l, 2, 3), optional
        The start of lines: two points of each, about as far apart as the part of it that is seen. There may be lines
        without points, with shapes (0, 3) and three empty arrays.
    image_lines : three of array_like, (k,), (k,) and (k, 2, 2), optional
        Numbers of cameras, numbers of lines, and two pixels of each image of a line, as far apart as it is seen; they
        need not be those of the points of `lines`. Their distances from the image of the line count as those of pixels.
        The distortion of lenses is removed from them first, so that lenses with distortion cannot be estimated.
    distortion : {None, "brown", "fisheye"}
        The model of the lens, as in OpenCV.
    coefficients : array_like, (n,) or (c, n), optional
        Coefficients at the start, in OpenCV's order: ``k1 k2 p1 p2 k3 k4 k5 k6`` for "brown", ``k1 k2 k3 k4`` for
        "fisheye". Those left out at the end are 0, the default for all. Cameras with a distortion of their own need
        neither of both, and the adjusted cameras have theirs.
    intrinsics : {"fixed", "shared", "each"} or array_like, (c,) of int
        Whether lenses are estimated: not at all, one for all cameras, one for each, or one for all cameras with the
        same number.
    estimated : sequence of str, optional
        Which numbers of lenses are estimated: of ``f`` (fx and fy in their ratio), ``fx fy cx cy skew`` and the names
        of coefficients. By default ``f cx cy`` and all given coefficients, or if none are given k1 to k3 with p1 and
        p2, or k1 to k4 of "fisheye".
    loss : {None, "huber", "cauchy"}
        How squared distances count. The default suits observations without wrong ones.
    scale : float
        The distance, in pixels, at which a robust loss begins to grow slower.
    noise : float, optional
        The standard deviation of pixels. By default it follows from the residuals and a prior: about a thousandth of
        the focal length, as well known as by four residuals.
    fixed_cameras, fixed_points : array_like of int or of bool, optional
        Numbers or flags of poses and points that are held. By default, the first camera is held, unless three points
        are. If one camera and no point is held, so is the scale: the distance of the farthest camera from it, out of
        those that see at least half as many of its points as any other does.
    max_steps : int
        Maximum number of steps, accepted or not.
    covariance : {"cameras", "points", None}
        Which marginal covariances are computed: those of poses and lenses, or those of points and lines in addition.
    progress : callable, optional
        Called after each step with a `BundleStep`.

    Returns
    -------
    BundleAdjustment
        The status OK guarantees that a minimum was reached, that the observations determine all cameras, and that the
        residuals do not contradict the noise: neither their sum of squares nor, without a robust loss, the largest. If
        a camera is not adjusted or not determined, its status is that of the whole, see `camera_status`. The status is
        NOT_CONVERGED after `max_steps`, or if residuals are larger than noise, or if structure in them is more than the
        rest: what another focal length, centre or radial distortion of all cameras explains, what residuals have in
        common with those of the nearest points in the same camera, and what a part of the points with a motion of its
        own in each camera has. Less of it makes covariances larger. Points and lines have statuses of their own.

    Raises
    ------
    TypeError, ValueError
        If shapes or types differ from these, if an observation names a camera or point that does not exist, if K is
        not upper triangular and regular, if a pose is not a unit motor, or if an option has none of its values.

    Notes
    -----
    A robust loss is minimised with the equations of squares, weighed by the derivative of the loss by the squared
    distance (iteratively reweighted least squares), which lead near a minimum in few steps. There, Triggs' correction
    subtracts the curvature of the loss, of which a tenth is kept: with all of it, far pixels would be one equation
    instead of two, and points with two of them undetermined.

    The minimum is that of scipy's `least_squares` to 1e-9 of the cost. Derivatives are derived by the compiler. Time
    and memory grow with the number of pairs of pixels of the same point, and from 250 cameras on systems are sparse.

    Covariances are inverses of the weighed normal equations times the variance of pixels, with held parameters known
    exactly. With a robust loss they are approximations. Triggs et al., *Bundle Adjustment, a Modern Synthesis*, 2000.
    """
    _check_options(loss, scale, noise, max_steps, covariance)
    whole, start = _checked(
        cameras, points, observations, lines, image_lines, distortion, coefficients, intrinsics, estimated
    )
    whole = replace(whole, kind=LOSSES[loss], scale=float(scale))
    c, m = len(start.motors), len(start.points)
    held_points = checked_fixed(fixed_points, m, "fixed_points")
    held = None if fixed_cameras is None else checked_fixed(fixed_cameras, c, "fixed_cameras")
    parts = _parts(whole, start, held, held_points)
    scene = _adjusted_part(whole, start, parts, held_points)
    layout = Layout(scene)
    places = np.concatenate([start.points[np.unique(scene.point)], start.lines[scene.free_lines].reshape(-1, 3)])
    centroid = places.mean(0) if len(places) else np.zeros(3)
    end = descended(layout, _about(start, centroid), int(max_steps), progress)
    information = Information(layout, end.state) if parts.used.any() and np.isfinite(end.cost) else None
    judged = _Judged(scene, layout, end, parts, pixel_noise(_mean_matrix(start.lenses), noise), information)
    camera_status, item_status = judged.statuses()
    state = _with_adjusted(start, _about(end.state, -centroid), scene)
    with np.errstate(all="ignore"):
        # Distances are computed about the centroid, which preserves digits far from the origin.
        squares = whole.all_squares(_about(state, centroid))[0]
        weights, residuals = np.where(parts.used, whole.influences(squares), 0), np.sqrt(squares)
    k = len(whole.point)
    return BundleAdjustment(
        tuple(_camera(cameras, i, state) for i in range(c)),
        state.points, state.lenses[:, N_INTRINSICS:], judged.status(camera_status, item_status), camera_status,
        item_status[:m], end.cost, residuals[:k], weights[:k], end.steps, state.lines, item_status[m:], residuals[k:],
        weights[k:], *judged.covariances(covariance),
    )  # fmt: skip


def _adjusted_part(whole: Scene, start: State, parts: Parts, held_points: Reals) -> Scene:
    """Return the observations that are used, and what of cameras, points and lines is free."""
    of_points, of_lines = np.split(parts.used, [len(whole.point)])
    some = whole.lines.some(of_lines)
    seen, free_lines = np.zeros(len(start.points), bool), np.zeros(len(start.lines), bool)
    seen[whole.point[of_points]], free_lines[some.line] = True, True
    free_cameras = (parts.camera_status == VisionStatus.OK) & ~parts.fixed_cameras
    return replace(
        whole, camera=whole.camera[of_points], point=whole.point[of_points], pixels=whole.pixels[of_points],
        free_cameras=free_cameras, free_points=seen & ~held_points, lines=some, free_lines=free_lines,
        scaled=parts.scaled,
    )  # fmt: skip


def _with_adjusted(start: State, final: State, scene: Scene) -> State:
    """Return the final state where the scene is free, and the start elsewhere, to the bit."""
    return State(
        np.where(scene.free_cameras[:, None], final.motors, start.motors),
        final.lenses,
        np.where(scene.free_points[:, None], final.points, start.points),
        np.where(scene.free_lines[:, None, None], final.lines, start.lines),
    )


def _checked(
    cameras: Cameras, points: ArrayLike, observations: Table, lines: ArrayLike | None, image_lines: LineTable | None,
    distortion: str | None, coefficients: ArrayLike | None, intrinsics: str | ArrayLike,
    estimated: Sequence[str] | None,
) -> tuple[Scene, State]:  # fmt: skip
    """Return all observations, and the start."""
    matrices, motors = checked_cameras(cameras)
    c = len(motors)
    places = real_array(points, "points", (-1, 3) if np.size(points) else (-1,), "x y z").astype(np.float64)
    places = places.reshape(-1, 3) if places.size == 0 else places
    if places.ndim != 2:
        raise ValueError(f"points: shape {places.shape}; expected (m, 3)")
    camera, point, pixels = checked_table(observations, c, len(places))
    model, bent, n_given = checked_distortion(cameras, distortion, coefficients, c)
    lenses = np.concatenate([intrinsics_of(matrices), bent], 1)
    lens_of, by_parameter = checked_lenses(intrinsics, estimated, lenses, model, n_given)
    ends, seen = checked_lines(lines, image_lines, c)
    straight = without_distortion(seen, model, lenses, bool(by_parameter.shape[1]))
    whole = Scene(
        camera, point, pixels, model, 0.0, 1.0, np.ones(c, bool), np.ones(len(places), bool), straight,
        np.ones(len(ends), bool), np.zeros((0, 2), np.int64), lens_of, by_parameter,
    )  # fmt: skip
    return whole, State(motors, lenses, places, ends)


def _parts(whole: Scene, start: State, held: Reals | None, held_points: Reals) -> Parts:
    """Return what can be adjusted. Pixels of points in the plane of a camera's centre count as not seen.

    Nor do lines through the centre of a camera. Two cameras that see a line say nothing of each other.
    """
    with np.errstate(all="ignore"):
        squares = whole.all_squares(start)[0]
    is_own = np.unique(whole.lens_of).size == len(whole.lens_of)
    n_parameters = 6 + whole.by_parameter.shape[1] * is_own
    n_lines = len(start.lines)
    valid_cameras = np.asarray(np.isfinite(start.motors).all(1))
    ends = start.lines
    valid_lines = np.isfinite(ends).all((1, 2)) & (ends[:, 0] != ends[:, 1]).any(1)
    valid = np.concatenate([np.isfinite(start.points).all(1), valid_lines])
    places = np.concatenate([start.points, ends.mean(1)])
    motors = np.where(valid_cameras[:, None], start.motors, np.eye(8)[0])
    return parts_of(
        *whole.tables, np.isfinite(squares), valid_cameras, valid, motors, places[valid], held,
        np.append(held_points, np.zeros(n_lines, bool)), np.repeat([2, 3], [len(start.points), n_lines]),
        -(-n_parameters // 2),
    )  # fmt: skip


def _check_options(loss: str | None, scale: float, noise: float | None, max_steps: int, covariance: str | None) -> None:
    if loss not in LOSSES:
        raise ValueError(f"loss: {loss!r}; expected None, 'huber' or 'cauchy'")
    if finite_number(scale, "scale") <= 0:
        raise ValueError(f"scale: {scale}; expected more than 0 pixels")
    check_pixels(noise, "noise")
    if isinstance(max_steps, bool) or not isinstance(max_steps, (int, np.integer)) or max_steps < 0:
        raise ValueError(f"max_steps: {max_steps!r}; expected an integer, 0 or more")
    if covariance not in (None, "cameras", "points"):
        raise ValueError(f"covariance: {covariance!r}; expected 'cameras', 'points' or None")


def _about(state: State, centre: Reals) -> State:
    """Return a state in coordinates about a point of the world."""
    translation = pga3.motor_from_rotation_vector_translation(np.zeros(3), -centre)
    motors = np.asarray(pga3.motor_product(translation, state.motors))
    return State(motors, state.lenses, state.points - centre, state.lines - centre)


def _mean_matrix(lenses: Reals) -> Reals:
    """Return a matrix K with the mean focal lengths."""
    return np.diag([*lenses[:, :2].mean(0), 1.0]) if len(lenses) else np.eye(3)


def _camera(cameras: Cameras, number: int, state: State) -> Camera:
    """Return an adjusted camera, with the distortion of its lens if it has one of its own."""
    matrix, motor = matrix_of(state.lenses[number, :N_INTRINSICS]), state.motors[number]
    start = cameras[number] if number < len(cameras) else None
    lens: Any = getattr(start, "distortion", None)
    if not isinstance(start, Camera) or lens is None:
        return Camera(matrix, motor)
    adjusted: dict[str, Any] = {
        "distortion": replace(lens, coefficients=tuple(state.lenses[number, N_INTRINSICS:].tolist()))
    }
    return replace(start, intrinsics=matrix, pose=motor, **adjusted)


class _Judged:
    """The end of the iterations, with what the observations say about it."""

    def __init__(
        self, scene: Scene, layout: Layout, end: Descent, parts: Parts, known: Noise, information: Information | None
    ) -> None:
        self.scene, self.layout, self.end, self.parts = scene, layout, end, parts
        self.known, self.information = known, information
        with np.errstate(all="ignore"):
            self.squares, self.depths = scene.all_squares(end.state)
        self.camera, self.item = scene.tables
        self.free_items = np.concatenate([scene.free_points, scene.free_lines])
        weights = scene.influences(self.squares)
        self.weighed = float((weights * self.squares).sum())
        k, is_finite = len(scene.point), np.isfinite(self.weighed)
        of_lines = 4 * int(scene.free_lines.sum())
        n_parameters = layout.n_free + 3 * int(scene.free_points.sum()) + of_lines
        self.freedom = max(int(2 * weights.sum()) - n_parameters, 0) if is_finite else 0
        self.misfit: BundleMisfit | None = None
        of_points = max(int(2 * weights[:k].sum()) - n_parameters + of_lines, 0) if is_finite else 0
        if information is not None and self.freedom and end.converged:
            self.misfit = bundle_misfit(scene, end.state, information, weights, self.freedom, of_points, known)

    def statuses(self) -> tuple[Reals, Reals]:
        """Return the statuses of cameras (c,), and of points and lines (m + l,)."""
        scene, c = self.scene, self.layout.n_cameras
        cameras, items = self.parts.camera_status.copy(), self.parts.item_status.copy()
        if self.information is None:
            return cameras, items
        near, far = self._distances()
        # Noise moves a parameter by more than the root of this with the probability `WRONG`.
        variance = largest_ratio(1) * float(self.known.raised(np.asarray(self.weighed), self.freedom))
        spread = np.zeros(len(items))
        found = np.concatenate(self.information.item_variances())
        spread[: len(found)] = variance * found
        items[self.free_items & ~(spread < near**2)] = VisionStatus.DEGENERATE
        spread = variance * self.information.variances()
        loose = ~(spread[:c, :3].sum(1) < 1) | ~(spread[:c, 3:].sum(1) < far**2)
        if self.layout.n_parts:
            by_lens = spread[c:].reshape(self.layout.n_parts, scene.n_lenses, 6).transpose(1, 0, 2)
            by_lens = by_lens.reshape(scene.n_lenses, -1)[:, : scene.by_parameter.shape[1]]
            # Numbers in pixels are compared with the focal length.
            pixels = by_lens[scene.lens_of][:, scene.by_parameter[:4].any(0)]
            loose |= ~(pixels < self.end.state.lenses[:, :1] ** 2).all(1)
        cameras[(cameras == VisionStatus.OK) & loose] = VisionStatus.DEGENERATE
        if scene.kind:
            # The scale is the noise or more, so one correct pixel in 90 is three times that far.
            far = ~(self.squares <= (3 * scene.scale) ** 2)
            self._mark(cameras, items, far, VisionStatus.NO_CONSENSUS)
        if scene.model != "fisheye":
            behind = ~(self.depths > 0)
            self._mark(cameras, items, behind, VisionStatus.BEHIND)
            items[(items == VisionStatus.OK) & (np.bincount(self.item[behind], minlength=len(items)) > 0)] = (
                VisionStatus.BEHIND
            )
        return cameras, items

    def _mark(self, cameras: Reals, items: Reals, wrong: Reals, status: VisionStatus) -> None:
        """Give a status to the cameras, points and lines of which half of the observations or more are wrong."""
        for found, table in ((cameras, self.camera), (items, self.item)):
            n = np.bincount(table, minlength=len(found))
            n_wrong = np.bincount(table[wrong], minlength=len(found))
            found[(found == VisionStatus.OK) & (2 * n_wrong >= n) & (n > 0)] = status

    def _distances(self) -> tuple[Reals, Reals]:
        """Return the distances of points and lines from the nearest camera, and sizes of the scene for cameras (c,).

        Those are the mean distance of the points of a camera, or the distance of the nearest fixed camera if that is
        more: the errors of a long chain of cameras grow with its length.
        """
        state = self.end.state
        centres = pga3.motor_to_matrix(state.motors)[:, :3, 3]
        places = np.concatenate([state.points, state.lines.mean(1)])
        distances = np.linalg.norm(places[self.item] - centres[self.camera], axis=1)
        near = np.full(len(places), np.inf)
        np.minimum.at(near, self.item, distances)
        count = np.maximum(np.bincount(self.camera, minlength=len(centres)), 1)
        far = np.bincount(self.camera, distances, minlength=len(centres)) / count
        fixed = centres[self.parts.fixed_cameras]
        if len(fixed):
            away = [np.linalg.norm(centres - centre, axis=1) for centre in fixed]
            far = np.maximum(far, np.minimum.reduce(away))
        return near, np.where(far > 0, far, np.inf)

    def status(self, cameras: Reals, items: Reals) -> VisionStatus:
        """Return the status of the whole."""
        if not len(self.camera):
            return VisionStatus(int(cameras.max(initial=0))) or VisionStatus.TOO_FEW
        if not (items[self.item] == VisionStatus.OK).any():
            return VisionStatus(int(items[self.item[0]]))
        for status in (VisionStatus.NOT_FINITE, VisionStatus.DISCONNECTED, VisionStatus.DEGENERATE,
                       VisionStatus.TOO_FEW, VisionStatus.NO_CONSENSUS, VisionStatus.BEHIND):  # fmt: skip
            if (cameras == status).any():
                return status
        if not self.end.converged or self.known.contradicted(np.asarray(self.weighed), self.freedom):
            return VisionStatus.NOT_CONVERGED
        others = self.weighed - self.squares
        if self.misfit is not None and self.misfit.refused:
            return VisionStatus.NOT_CONVERGED
        if not self.scene.kind and self.known.outlying(self.squares, 2, others, self.freedom - 2).any():
            return VisionStatus.NOT_CONVERGED
        return VisionStatus.OK

    def covariances(self, wanted: str | None) -> tuple[Reals, Reals, Reals, Reals]:
        """Return covariances of cameras (c, 6, 6), lenses (n, p, p), points (m, 3, 3) and lines (l, 6, 6)."""
        layout, scene, width = self.layout, self.scene, self.scene.by_parameter.shape[1]
        m, of_items = layout.n_points, wanted == "points"
        cameras = np.full((layout.n_cameras, 6, 6), np.nan)
        lenses = np.full((scene.n_lenses, width, width), np.nan)
        points, lines = np.full((m, 3, 3), np.nan), np.full((len(scene.free_lines), 6, 6), np.nan)
        found = None
        if wanted is not None and self.information is not None:
            found = self.information.covariances(of_items)
        if found is None:
            return cameras, lenses, points, lines
        variance = float(self.known.raised(self.weighed, self.freedom))
        variance *= 1.0 if self.misfit is None else self.misfit.growth
        parts = [variance * each for each in (*found[:2], *found[2])]
        if self.misfit is not None and len(self.misfit.spread):
            steps, c, n = self.misfit.cameras, layout.n_cameras, scene.n_lenses
            by_lens = steps[:, c:].reshape(len(steps), layout.n_parts, n, BLOCK).swapaxes(1, 2)
            moved = [steps[:, :c], by_lens.reshape(len(steps), n, layout.n_parts * BLOCK)]
            for part, each in zip(parts, (*moved, *self.misfit.items), strict=False):
                part += np.einsum("tbi,tu,ubj->bij", each, self.misfit.spread, each, optimize=True)
        usable = self.parts.camera_status == VisionStatus.OK
        cameras[usable] = parts[0][usable]
        lenses[:] = parts[1][:, :width, :width]
        if of_items:
            points[scene.free_points] = parts[2][scene.free_points]
            points[(self.parts.item_status[:m] == VisionStatus.OK) & ~scene.free_points] = 0
        if len(parts) > 3:
            across = np.zeros((len(lines), 4, 6))
            across[:, :2, :3] = across[:, 2:, 3:] = across_lines(self.end.state.lines)
            ends = np.swapaxes(across, 1, 2) @ parts[3] @ across
            lines[scene.free_lines] = ends[scene.free_lines]
        return cameras, lenses, points, lines
