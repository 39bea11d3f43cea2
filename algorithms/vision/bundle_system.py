"""The linear system of bundle adjustment: which parameters meet in which observations, and the reduced equations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from generated import bundles, pga3

from ..arguments import Reals
from ..evidence.sparse_factors import factorized

N_PINHOLE, BLOCK = 5, 6
_DENSE = 1500
"""A limit on work: systems up to this size are solved as dense matrices, in a second at most."""
_TABLE = 10**7
"""A limit on work: pairs of blocks are numbered by a table of all pairs if these are fewer."""

KERNELS: dict[str, tuple[Any, Any, Any]] = {
    "pinhole": (bundles.pinhole_distances, bundles.pinhole_equations, bundles.pinhole_lens_equations),
    "brown": (bundles.brown_distances, bundles.brown_equations, bundles.brown_lens_equations),
    "fisheye": (bundles.fisheye_distances, bundles.fisheye_equations, bundles.fisheye_lens_equations),
}


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """What is estimated."""

    motors: Reals
    """(c, 8)"""
    lenses: Reals
    """(c, q) fx, fy, cx, cy, the skew and the coefficients of the distortion."""
    points: Reals
    """(m, 3)"""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Observations that are used, and what may move."""

    camera: Reals
    point: Reals
    pixels: Reals
    model: str
    kind: float
    scale: float
    free_cameras: Reals
    """(c,) bool"""
    free_points: Reals
    """(m,) bool"""
    scaled: Reals
    """(s, 2) Cameras whose distance from a second one is held."""
    lens_of: Reals
    """(c,) The number of the lens of each camera."""
    by_parameter: Reals
    """(q, p) The numbers of a lens by its estimated parameters."""

    @property
    def n_lenses(self) -> int:
        """The number of lenses with parameters."""
        return int(self.lens_of.max(initial=-1)) + 1 if self.by_parameter.shape[1] else 0

    def seen(self, state: State) -> tuple[Reals, ...]:
        """Return the arguments of kernels for all observations, up to the weight."""
        take = np.take
        one = np.ones(len(self.camera))
        motors, lenses = take(state.motors, self.camera, 0), take(state.lenses, self.camera, 0)
        return motors, take(state.points, self.point, 0), lenses, self.pixels, one

    def squares(self, state: State) -> tuple[Reals, Reals]:
        """Return squared distances (k,) of pixels, and the depths of their points."""
        squares, depths = KERNELS[self.model][0](*self.seen(state))
        return squares, depths

    def losses(self, squares: Reals) -> Reals:
        """Return the losses of squared distances."""
        if self.kind == 0:
            return squares
        limit = self.scale**2
        if self.kind == 1:
            return np.where(squares > limit, 2 * self.scale * np.sqrt(squares) - limit, squares)
        return np.asarray(limit * np.log1p(squares / limit))

    def influences(self, squares: Reals) -> Reals:
        """Return the derivatives of losses by squared distances."""
        if self.kind == 0:
            return np.ones_like(squares)
        limit = self.scale**2
        if self.kind == 1:
            return self.scale / np.sqrt(np.maximum(squares, limit))
        return np.asarray(limit / (limit + squares))

    def cost(self, state: State) -> float:
        """Return half the sum of losses."""
        with np.errstate(all="ignore"):
            return 0.5 * float(self.losses(self.squares(state)[0]).sum())


class Layout:
    """Where products of derivatives are added: blocks of six parameters, couplings, and pairs of blocks.

    Blocks are those of the poses of all cameras, followed by those of lenses. Couplings are sorted by points.
    """

    def __init__(self, scene: Scene) -> None:
        c, n_lenses, width = len(scene.free_cameras), scene.n_lenses, scene.by_parameter.shape[1]
        self.scene = scene
        self.n_parts = -(-width // BLOCK)
        self.n_blocks = n = c + self.n_parts * n_lenses
        self.n_points = m = len(scene.free_points)
        self.n_cameras = c
        lens = scene.lens_of[scene.camera]
        self.block_of = [scene.camera, *(c + part * n_lenses + lens for part in range(self.n_parts))]
        met = np.concatenate([scene.point * n + block for block in self.block_of])
        found, self.coupling_of = np.unique(met, return_inverse=True)
        self.point, self.block = found // n, found % n
        # All products of couplings of the same point, each pair once.
        ends = np.searchsorted(self.point, np.arange(m), "right")
        number = np.arange(len(found))
        rest = (ends[self.point] if len(found) else number) - number
        self.first = np.repeat(number, rest)
        self.second = np.arange(len(self.first)) - np.repeat(np.cumsum(rest) - rest, rest) + self.first
        parts = range(self.n_parts + 1)
        self.own = [(g, h) for g in parts for h in parts if g <= h]
        keys = [self.block[self.first] * n + self.block[self.second]]
        keys += [self.block_of[g] * n + self.block_of[h] for g, h in self.own]
        pairs, tables = _numbered(keys, n * n)
        self.pair, self.own_pair = tables[0], tables[1:]
        self.rows, self.columns = pairs // n, pairs % n
        self.diagonal = np.flatnonzero(self.rows == self.columns)
        free = np.zeros((n, BLOCK), bool)
        free[:c] = scene.free_cameras[:, None]
        free[scene.scaled[:, 0], 3] = False
        for part in range(self.n_parts):
            here = slice(c + part * n_lenses, c + (part + 1) * n_lenses)
            free[here, : min(BLOCK, width - part * BLOCK)] = True
        used = np.zeros(n, bool)
        used[self.block] = True
        self.free = free & used[:, None]
        self.position = np.where(self.free, np.cumsum(self.free).reshape(n, BLOCK) - 1, -1)
        self.n_free = int(self.free.sum())
        rows = np.broadcast_to(self.position[self.rows][:, :, None], (len(pairs), BLOCK, BLOCK))
        columns = np.broadcast_to(self.position[self.columns][:, None, :], rows.shape)
        # Diagonal blocks have both triangles; of others, the second is the mirror image.
        keep = (rows >= 0) & (columns >= 0)
        off = keep & (self.rows != self.columns)[:, None, None]
        self._entries = keep, rows[keep], columns[keep], off, rows[off], columns[off]
        self.zero_points, self.zero_blocks = np.zeros(m), np.zeros(n)
        self.zero_couplings, self.zero_pairs = np.zeros(len(found)), np.zeros(len(pairs))

    def matrix(self, blocks: Reals, extra: Reals) -> Any:
        """Return the symmetric matrix of free parameters from blocks (pairs, 6, 6), with an addition to its diagonal.

        It is dense for few parameters and otherwise sparse.
        """
        keep, rows, columns, off, off_rows, off_columns = self._entries
        n = self.n_free
        if n <= _DENSE:
            full = np.zeros((n, n))
            full[rows, columns] = blocks[keep]
            full[off_columns, off_rows] = blocks[off]
            full[np.arange(n), np.arange(n)] += extra
            return full
        values = np.concatenate([blocks[keep], blocks[off], extra])
        places = np.concatenate([rows, off_columns, np.arange(n)]), np.concatenate([columns, off_rows, np.arange(n)])
        return scipy.sparse.csc_array((values, places), shape=(n, n))

    def blocks_of(self, matrix: Reals) -> Reals:
        """Return the blocks (pairs, 6, 6) of a dense matrix of free parameters; 0 for parameters that are held."""
        padded = np.zeros((self.n_free + 1, self.n_free + 1))
        padded[:-1, :-1] = matrix
        rows, columns = self.position[self.rows], self.position[self.columns]
        return np.asarray(padded[rows[:, :, None], columns[:, None, :]])


def _numbered(keys: list[Reals], n: int) -> tuple[Reals, list[Reals]]:
    """Return the distinct keys below n, and the number of the key for each entry of several tables."""
    if n <= _TABLE:
        present = np.zeros(n, bool)
        for each in keys:
            present[each] = True
        number = np.cumsum(present) - 1
        return np.flatnonzero(present), [number[each] for each in keys]
    found = np.unique(np.concatenate([np.unique(each) for each in keys]))
    return found, [np.searchsorted(found, each) for each in keys]


class Equations:
    """The normal equations at a state: of weighed squares, or with up to a part of the curvature of the loss."""

    def __init__(self, layout: Layout, state: State, curved: float = 0.0) -> None:
        scene = layout.scene
        self.layout = layout
        moves = scene.free_points[scene.point].astype(float)
        arguments = (*scene.seen(state), moves, scene.kind, scene.scale, curved)
        if layout.n_parts:
            rest, by_camera, by_point, _, by_lens = KERNELS[scene.model][2](*arguments)
        else:
            rest, by_camera, by_point, _ = KERNELS[scene.model][1](*arguments)
        self.turns = _frames(scene, state)
        for (camera, _), turn in zip(scene.scaled, self.turns, strict=True):
            here = scene.camera == camera
            by_camera[here, :, 3:] = by_camera[here, :, 3:] @ turn
        parts = [by_camera]
        if layout.n_parts:
            by_parameter = by_lens @ scene.by_parameter
            width = by_parameter.shape[2]
            padded = np.zeros((*by_parameter.shape[:2], BLOCK * layout.n_parts))
            padded[:, :, :width] = by_parameter
            parts += [np.ascontiguousarray(each) for each in np.split(padded, layout.n_parts, axis=2)]
        self.rest, self.by_point, self.parts = rest, by_point, parts
        self.squares, self.point_gradient = bundles.point_sums(by_point, rest, scene.point, layout.zero_points)
        self.gradient = sum(
            bundles.block_gradients(part, rest, block, layout.zero_blocks)
            for part, block in zip(parts, layout.block_of, strict=True)
        )
        self.products = sum(
            bundles.block_products(parts[g], parts[h], pair, layout.zero_pairs)
            for (g, h), pair in zip(layout.own, layout.own_pair, strict=True)
        )
        again = len(parts)
        blocks, points = (
            (parts[0], by_point) if again == 1 else (np.concatenate(parts), np.tile(by_point, (again, 1, 1)))
        )
        self.coupling = bundles.coupling_sums(blocks, points, layout.coupling_of, layout.zero_couplings)
        diagonal = np.zeros((layout.n_blocks, BLOCK))
        diagonal[layout.rows[layout.diagonal]] = np.einsum("bii->bi", self.products[layout.diagonal])
        self.diagonal = diagonal[layout.free]

    def eliminated(self, damping: float) -> tuple[Any, Reals, Reals, Reals, Reals]:
        """Return the reduced matrix and gradient, scaled couplings, and the inverse roots and reduced gradients."""
        layout = self.layout
        inverse, reduced = bundles.point_root(self.squares, self.point_gradient, damping)
        scaled = bundles.scaled_coupling(self.coupling, np.take(inverse, layout.point, 0))
        blocks = self.products - bundles.eliminated_points(
            scaled, layout.first, layout.second, layout.pair, layout.zero_pairs
        )
        gradient = self.gradient - bundles.eliminated_gradients(
            scaled, layout.block, layout.point, reduced, layout.zero_blocks
        )
        extra = np.where(self.diagonal > 0, damping * self.diagonal, 1.0)
        return layout.matrix(blocks, extra), gradient[layout.free], scaled, inverse, reduced

    def step(self, damping: float) -> tuple[Reals, Reals, float] | None:
        """Return changes of blocks (b, 6) and points (m, 3), and the decrease of the cost that the equations predict.

        None if the damped matrix is not positive.
        """
        layout = self.layout
        matrix, gradient, scaled, inverse, reduced = self.eliminated(damping)
        change = np.zeros((layout.n_blocks, BLOCK))
        if layout.n_free:
            factor = factorized(matrix)
            if factor is None:
                return None
            change[layout.free] = -factor.solve(gradient)
        points = bundles.point_changes(scaled, layout.block, layout.point, change, reduced, inverse, layout.zero_points)
        damped = damping * float(self.diagonal @ change[layout.free] ** 2)
        damped += damping * float((self.squares[:, [0, 3, 5]] * points**2).sum())
        predicted = 0.5 * (damped - float((self.gradient * change).sum()) - float((self.point_gradient * points).sum()))
        for (camera, _), turn in zip(layout.scene.scaled, self.turns, strict=True):
            change[camera, 3:] = turn @ change[camera, 3:]
        return change, points, predicted


def _frames(scene: Scene, state: State) -> list[Reals]:
    """Return orthogonal matrices whose first columns are the directions that change held distances."""
    found = []
    for camera, other in scene.scaled:
        rows = pga3.motor_to_matrix(state.motors[[camera, other]])
        along = rows[0, :3, :3].T @ (rows[0, :3, 3] - rows[1, :3, 3])
        found.append(np.linalg.qr(np.column_stack([along, np.eye(3)]))[0][:, :3])
    return found


def moved(scene: Scene, state: State, change: Reals, points: Reals) -> State:
    """Return the state after changes of blocks and points; held distances are restored."""
    c = len(state.motors)
    motion = pga3.motor_from_rotation_vector_translation(
        np.ascontiguousarray(change[:c, :3]), np.ascontiguousarray(change[:c, 3:])
    )
    motors = pga3.normalize_motor(pga3.motor_product(state.motors, motion))
    motors = np.where(scene.free_cameras[:, None], motors, state.motors)
    for camera, other in scene.scaled:
        before = pga3.motor_to_matrix(state.motors[[camera, other]])[:, :3, 3]
        quaternion, place = pga3.motor_to_quaternion_translation(motors[camera])
        off = place - before[1]
        length = np.linalg.norm(before[0] - before[1]) / np.linalg.norm(off)
        motors[camera] = pga3.motor_from_quaternion_translation(quaternion, before[1] + length * off)
    lenses = state.lenses
    if scene.n_lenses:
        parts = change[c:].reshape(-1, scene.n_lenses, BLOCK).transpose(1, 0, 2).reshape(scene.n_lenses, -1)
        parts = parts[:, : scene.by_parameter.shape[1]]
        lenses = lenses + np.where((scene.lens_of >= 0)[:, None], parts[scene.lens_of] @ scene.by_parameter.T, 0)
    return State(motors, lenses, state.points + points)
