"""Levenberg and Marquardt's iterations of bundle adjustment, and what the equations at their end determine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..arguments import Reals
from ..evidence.sparse_factors import Factor, factorized, least_directions
from ..evidence.triangles import from_triangle
from ..precision import CONVERGED, EIGENVALUE, ROUNDING, SQUARED, TINY
from .bundle_scene import State
from .bundle_system import BLOCK, Equations, Layout, moved

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
    exact = 0.5 * SQUARED * float((scene.pixels**2).sum() + (scene.lines.pixels**2).sum())
    converged, equations, step, curved = cost <= exact, None, 0, 0.0
    while step < max_steps and not converged and np.isfinite(cost) and damping < _MOST:
        step += 1
        equations = equations or Equations(layout, state, curved)
        found, used, before = equations.step(damping), damping, cost
        new_cost, predicted = np.inf, np.nan
        if found is not None:
            change, moves, predicted = found
            trial = moved(scene, state, change, moves)
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


class Moves(NamedTuple):
    """What residuals would move."""

    slopes: Reals
    """(t, b, 6) Products of them with the derivatives by blocks,"""
    of_items: list[Reals]
    """and by points (t, m, 3) and lines (t, l, 4)."""
    blocks: Reals
    """(t, b, 6) Steps of blocks,"""
    items: list[Reals]
    """of points (t, m, 3) and of lines (t, l, 4)."""


class Information:
    """The undamped equations at the end of the iterations: what they determine, and covariances."""

    def __init__(self, layout: Layout, state: State) -> None:
        self.layout = layout
        self.equations = Equations(layout, state)
        self.matrix, _, self.parts = self.equations.eliminated(0.0)
        self._factor: Factor | None = None

    @property
    def factor(self) -> Factor | None:
        """The factors of the reduced matrix, or None if it is singular."""
        if self._factor is None:
            self._factor = factorized(self.matrix)
        return self._factor

    def moves(self, rests: list[Reals]) -> Moves | None:
        """Return what numbers for the residuals of points (t, k, 2), and of lines (t, kl, 2), would move.

        None if the equations are singular.
        """
        layout, sums = self.layout, self.equations.sums
        factor = self.factor if layout.n_free else None
        if factor is None and layout.n_free:
            return None
        t = len(rests[0])
        slopes, change = np.zeros((2, t, layout.n_blocks, BLOCK))
        of_items, items = ([np.zeros((t, *part.reduced.shape)) for part in self.parts] for _ in range(2))
        reduced, gradients = [np.zeros_like(each) for each in items], np.zeros((layout.n_free, t))
        for i in range(t):
            gradient = np.zeros((layout.n_blocks, BLOCK))
            for k, (own, part) in enumerate(zip(sums, self.parts, strict=True)):
                _, of_items[k][i] = own.gradients(rests[k][i])
                slopes[i] += own.block_gradient(rests[k][i])
                _, reduced[k][i] = own.couplings.kernels.root(own.squares, of_items[k][i], 0.0)
                gradient -= own.subtracted_gradient(part.scaled, reduced[k][i])
            gradients[:, i] = (slopes[i] + gradient)[layout.free]
        if factor is not None:
            change[:, layout.free] = -factor.solve(gradients).T
        for k, (own, part) in enumerate(zip(sums, self.parts, strict=True)):
            for i in range(t):
                items[k][i] = own.changes(part, change[i], reduced[k][i])
        return Moves(np.where(layout.free, slopes, 0), of_items, change, items)

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

    def item_variances(self) -> list[Reals]:
        """Return the variances of points (m,), and of lines (l,) if there are any, for known cameras.

        They are those in the least certain direction, in which one end of a line moves across it.
        """
        found = []
        for each in self.equations.sums:
            n = each.item_gradient.shape[1]
            values = np.linalg.eigvalsh(from_triangle(np.where(np.isfinite(each.squares), each.squares, 0), n))
            found.append(np.asarray(1 / np.maximum(values[:, 0], EIGENVALUE * values[:, -1] + TINY)))
        return found

    def covariances(self, with_items: bool) -> tuple[Reals, Reals, list[Reals]] | None:
        """Return covariances of cameras (c, 6, 6), lenses (n, 6 p, 6 p), points and lines, for a variance of 1.

        Those of points (m, 3, 3) and of lines (l, 4, 4), if there are any, are only computed if requested. None if the
        equations are singular.
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
        items = [self._spread(which, pairs) for which in range(len(self.parts))] if with_items else []
        return cameras[: layout.n_cameras], self._of_lenses(pairs), items

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

    def _spread(self, which: int, pairs: Reals) -> Reals:
        """Return the covariances of points (m, 3, 3), or of lines (l, 4, 4)."""
        of, found, n = self.layout.couplings[which], self.parts[which], self.parts[which].reduced.shape[1]
        sums = np.zeros((of.n_items, n * (n + 1) // 2))
        for start in range(0, len(of.first), _PRODUCTS):
            part = slice(start, start + _PRODUCTS)
            first, second = of.first[part], of.second[part]
            share = np.where(first == second, 1.0, 2.0)
            sums += of.kernels.spread(
                found.scaled, first, second, of.pairs[0][part], of.item[first], share, pairs, of.zero_items
            )
        root = np.zeros((of.n_items, n, n))
        root[:, *np.tril_indices(n)] = found.inverse
        return np.asarray(np.swapaxes(root, 1, 2) @ (from_triangle(sums, n) + np.eye(n)) @ root)


def _finite(matrix: Reals) -> Reals:
    return np.asarray(np.where(np.isfinite(matrix), matrix, 0))
