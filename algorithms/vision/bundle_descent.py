"""Levenberg and Marquardt's iterations of bundle adjustment, and what the equations at their end determine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from generated import bundles

from ..arguments import Reals
from ..evidence.sparse_factors import Factor, factorized, least_directions
from ..precision import CONVERGED, EIGENVALUE, ROUNDING, SQUARED
from .bundle_system import BLOCK, Equations, Layout, State, moved

_FIRST, _LEAST, _MOST = 1e-4, 1e-14, 1e12
"""Limits on work: the damping relative to the diagonal at the start, below which it has no effect, and from which steps
are shorter than rounding."""
_FASTEST = 0.01
"""A limit on work: the damping decreases to this part at most after a step."""
_CURVED = 0.9
"""A limit on work: the part of the curvature of robust losses in the equations. With all of it, a far pixel would be
one equation instead of two, and points seen twice undetermined."""
_NEAR = 1e-4
"""A limit on work: weighed squares decrease losses fast, down to relative decreases of about this. The curvature makes
the last steps fast, but not those from afar."""
_CHUNK = 300
"""A limit on work: the columns of the inverse of a sparse system that are computed at a time."""
_PRODUCTS = 10**6
"""A limit on memory: the products of couplings that are spread to points at a time."""


@dataclass(frozen=True, slots=True)
class BundleStep:
    """A step of `bundle_adjust`, passed to its `progress`."""

    number: int
    cost: float
    """Half the sum of losses after the step."""
    decrease: float
    """The decrease of the cost; 0 if the step was rejected."""
    damping: float
    """The damping of the step."""


@dataclass(frozen=True, slots=True, eq=False)
class Descent:
    """The end of the iterations."""

    state: State
    cost: float
    steps: int
    converged: bool


def descended(layout: Layout, state: State, max_steps: int, progress: Callable[[BundleStep], object] | None) -> Descent:
    """Take steps until the equations predict no further decrease of the cost."""
    scene = layout.scene
    cost, damping, raise_by = scene.cost(state), _FIRST, 2.0
    exact = 0.5 * SQUARED * float((scene.pixels**2).sum())
    converged, equations, step, curved = cost <= exact, None, 0, 0.0
    while step < max_steps and not converged and np.isfinite(cost) and damping < _MOST:
        step += 1
        equations = equations or Equations(layout, state, curved)
        found, used, before = equations.step(damping), damping, cost
        new_cost, predicted = np.inf, np.nan
        if found is not None:
            change, points, predicted = found
            trial = moved(scene, state, change, points)
            new_cost = scene.cost(trial)
        decrease = cost - new_cost
        gain = decrease / predicted if predicted > 0 else -1.0
        converged = damping <= CONVERGED and predicted <= max(ROUNDING * cost, exact)
        # Close to a minimum, rounding errors of the cost hide its decrease, but the prediction is precise.
        rounding = 2 * np.sqrt(cost * exact)
        hidden = predicted <= rounding and abs(decrease) <= rounding
        if decrease >= 0 or hidden:
            state, cost, equations = trial, new_cost, None
            damping = max(damping * (_FASTEST if hidden else max(_FASTEST, 1 - (2 * gain - 1) ** 3)), _LEAST)
            raise_by = 2.0
            converged |= cost <= exact
            curved = _CURVED if scene.kind and decrease <= _NEAR * cost else curved
        elif curved:
            curved, equations = 0.0, None
        else:
            damping, raise_by = damping * raise_by, 2 * raise_by
        if progress is not None:
            progress(BundleStep(step, cost, max(before - cost, 0.0), used))
    return Descent(state, cost, step, bool(converged))


class Information:
    """The undamped equations at the end of the iterations: what they determine, and covariances."""

    def __init__(self, layout: Layout, state: State) -> None:
        self.layout = layout
        self.equations = Equations(layout, state)
        self.matrix, _, self.scaled, self.inverse, _ = self.equations.eliminated(0.0)
        self._factor: Factor | None = None

    @property
    def factor(self) -> Factor | None:
        """The factors of the reduced matrix, or None if it is singular."""
        if self._factor is None:
            self._factor = factorized(self.matrix)
        return self._factor

    def moves(self, rests: Reals) -> tuple[Reals, Reals, Reals, Reals] | None:
        """Return products (t, b, 6), (t, m, 3) of derivatives with numbers (t, k, 2) for residuals, and their steps.

        None if the equations are singular.
        """
        layout, equations = self.layout, self.equations
        factor = self.factor if layout.n_free else None
        if factor is None and layout.n_free:
            return None
        slopes, change = np.zeros((2, len(rests), layout.n_blocks, BLOCK))
        of_points, points = np.zeros((2, len(rests), layout.n_points, 3))
        roots, gradients = [], np.zeros((layout.n_free, len(rests)))
        for i, rest in enumerate(rests):
            _, of_points[i] = bundles.point_sums(equations.by_point, rest, layout.scene.point, layout.zero_points)
            slopes[i] = sum(
                bundles.block_gradients(part, rest, block, layout.zero_blocks)
                for part, block in zip(equations.parts, layout.block_of, strict=True)
            )
            _, reduced = bundles.point_root(equations.squares, of_points[i], 0.0)
            gradient = slopes[i] - bundles.eliminated_gradients(
                self.scaled, layout.block, layout.point, reduced, layout.zero_blocks
            )
            roots.append(reduced)
            gradients[:, i] = gradient[layout.free]
        if factor is not None:
            change[:, layout.free] = -factor.solve(gradients).T
        for i, reduced in enumerate(roots):
            points[i] = bundles.point_changes(
                self.scaled, layout.block, layout.point, change[i], reduced, self.inverse, layout.zero_points
            )
        return np.where(layout.free, slopes, 0), of_points, change, points

    def variances(self) -> Reals:
        """Return the variances (b, 6) of blocks for residuals of variance 1; of sparse systems, the largest part.

        Directions that change no residual have the variance of rounding errors, which is larger than any other.
        """
        layout = self.layout
        found = np.zeros((layout.n_blocks, BLOCK))
        if not layout.n_free:
            return found
        # Elimination subtracts numbers of the size of the unreduced diagonal, whose rounding is the yardstick.
        diagonal = self.equations.diagonal
        scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1))
        if isinstance(self.matrix, np.ndarray):
            values, vectors = np.linalg.eigh(_finite(self.matrix) * np.outer(scale, scale))
        else:
            values, vectors = least_directions(self.matrix, scale, EIGENVALUE)
        spread = ((scale[:, None] * vectors) ** 2 / np.maximum(values, EIGENVALUE)).sum(1)
        found[layout.free] = np.where(diagonal > 0, spread, np.inf)
        return found

    def point_variances(self) -> Reals:
        """Return the variance (m,) of points in their least certain direction, for known cameras."""
        xx, xy, xz, yy, yz, zz = self.equations.squares.T
        full = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], 1).reshape(-1, 3, 3)
        values = np.linalg.eigvalsh(np.where(np.isfinite(full), full, 0))
        return np.asarray(1 / np.maximum(values[:, 0], EIGENVALUE * values[:, 2] + 1e-300))

    def covariances(self, with_points: bool) -> tuple[Reals, Reals, Reals] | None:
        """Return covariances of cameras (c, 6, 6), lenses (l, 6 n, 6 n) and points (m, 3, 3), for a variance of 1.

        None if the equations are singular. Without points, these are NaN.
        """
        layout = self.layout
        pairs = self._inverse_blocks()
        if pairs is None:
            return None
        cameras = np.zeros((layout.n_blocks, BLOCK, BLOCK))
        cameras[layout.rows[layout.diagonal]] = pairs[layout.diagonal]
        for (camera, _), turn in zip(layout.scene.scaled, self.equations.turns, strict=True):
            both = np.eye(BLOCK)
            both[3:, 3:] = turn
            cameras[camera] = both @ cameras[camera] @ both.T
        points = np.full((layout.n_points, 3, 3), np.nan)
        if with_points:
            points = self._spread(pairs)
        return cameras[: layout.n_cameras], self._of_lenses(pairs), points

    def _of_lenses(self, pairs: Reals) -> Reals:
        """Return the covariances (l, 6 n, 6 n) of the n blocks of each lens."""
        layout, parts = self.layout, self.layout.n_parts
        n, keys = layout.scene.n_lenses, layout.rows * layout.n_blocks + layout.columns
        found = np.zeros((n, parts, BLOCK, parts, BLOCK))
        first = layout.n_cameras + np.arange(n)
        for g in range(parts):
            for h in range(g, parts):
                wanted = (first + g * n) * layout.n_blocks + first + h * n
                at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
                block = np.where((keys[at] == wanted)[:, None, None], pairs[at], 0)
                found[:, g, :, h], found[:, h, :, g] = block, np.swapaxes(block, 1, 2)
        return found.reshape(n, parts * BLOCK, parts * BLOCK)

    def _inverse_blocks(self) -> Reals | None:
        layout, n = self.layout, self.layout.n_free
        if not n:
            return np.zeros((len(layout.rows), BLOCK, BLOCK))
        factor = self.factor
        if factor is None:
            return None
        if isinstance(self.matrix, np.ndarray):
            return layout.blocks_of(factor.solve(np.eye(n)))
        found = np.zeros((len(layout.rows), BLOCK, BLOCK))
        for start in range(0, layout.n_blocks, _CHUNK // BLOCK):
            self._some_columns(factor, start, found)
        return found

    def _some_columns(self, factor: Factor, start: int, found: Reals) -> None:
        """Set the blocks of the inverse whose columns belong to some blocks."""
        layout, n = self.layout, self.layout.n_free
        stop = min(start + _CHUNK // BLOCK, layout.n_blocks)
        here = layout.position[start:stop].ravel()
        right = np.zeros((n + 1, len(here)))
        right[here, np.arange(len(here))] = here >= 0
        columns = np.vstack([factor.solve(right[:-1]), np.zeros((1, len(here)))])
        pairs = np.flatnonzero((layout.columns >= start) & (layout.columns < stop))
        rows = layout.position[layout.rows[pairs]]
        of = (layout.columns[pairs, None] - start) * BLOCK + np.arange(BLOCK)
        found[pairs] = columns[rows[:, :, None], of[:, None, :]]

    def _spread(self, pairs: Reals) -> Reals:
        layout = self.layout
        sums = np.zeros((layout.n_points, 6))
        for start in range(0, len(layout.first), _PRODUCTS):
            part = slice(start, start + _PRODUCTS)
            first, second = layout.first[part], layout.second[part]
            share = np.where(first == second, 1.0, 2.0)
            sums += bundles.spread_of_points(
                self.scaled, first, second, layout.pair[part], layout.point[first], share, pairs, layout.zero_points
            )
        middle = sums[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3) + np.eye(3)
        root = np.zeros((layout.n_points, 3, 3))
        root[:, [0, 1, 1, 2, 2, 2], [0, 0, 1, 0, 1, 2]] = self.inverse
        return np.asarray(np.swapaxes(root, 1, 2) @ middle @ root)


def _finite(matrix: Reals) -> Reals:
    return np.asarray(np.where(np.isfinite(matrix), matrix, 0))
