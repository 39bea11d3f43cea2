"""The linear system of bundle adjustment: which parameters meet in which observations, and the reduced equations."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy

from generated import bundles, pga3

from ..arguments import Reals
from ..evidence.sparse_factors import factorized
from .bundle_scene import KERNELS, LINE_KERNELS, Scene, State

BLOCK = 6
"""The number of parameters of a block: those of a pose."""
_DENSE = 1500
"""A limit on work: systems up to this size are solved as dense matrices, in a second at most."""
_TABLE = 10**7
"""A limit on work: pairs of blocks are numbered by a table of all pairs if these are fewer."""


class Elimination(NamedTuple):
    """Kernels that eliminate points, or lines."""

    sums: Any
    couplings: Any
    root: Any
    scaled: Any
    eliminated: Any
    gradients: Any
    changes: Any
    spread: Any
    diagonal: list[int]
    """Places of the diagonal in the triangles of `sums`."""


POINTS = Elimination(
    bundles.point_sums, bundles.point_couplings, bundles.point_root, bundles.scaled_point_coupling,
    bundles.eliminated_points, bundles.eliminated_point_gradients, bundles.point_changes,
    bundles.spread_of_points, [0, 3, 5],
)  # fmt: skip
LINES = Elimination(
    bundles.line_sums, bundles.line_couplings, bundles.line_root, bundles.scaled_line_coupling,
    bundles.eliminated_lines, bundles.eliminated_line_gradients, bundles.line_changes,
    bundles.spread_of_lines, [0, 4, 7, 9],
)  # fmt: skip


class Couplings:
    """Which points, or lines, meet which blocks of parameters. Couplings are sorted by points."""

    def __init__(self, kernels: Elimination, item: Reals, n_items: int, block_of: list[Reals], n_blocks: int) -> None:
        self.kernels, self.item_of, self.block_of, self.n_items = kernels, item, block_of, n_items
        met = np.concatenate([item * n_blocks + block for block in block_of])
        found, self.coupling_of = np.unique(met, return_inverse=True)
        self.item, self.block = found // n_blocks, found % n_blocks
        # All products of couplings of the same point, each pair once.
        ends = np.searchsorted(self.item, np.arange(n_items), "right")
        number = np.arange(len(found))
        rest = (ends[self.item] if len(found) else number) - number
        self.first = np.repeat(number, rest)
        self.second = np.arange(len(self.first)) - np.repeat(np.cumsum(rest) - rest, rest) + self.first
        parts = range(len(block_of))
        self.own = [(g, h) for g in parts for h in parts if g <= h]
        self.keys = [self.block[self.first] * n_blocks + self.block[self.second]]
        self.keys += [block_of[g] * n_blocks + block_of[h] for g, h in self.own]
        self.zero_items, self.zero = np.zeros(n_items), np.zeros(len(found))
        self.pairs: list[Reals] = []
        """The numbers of pairs of blocks for `keys`."""


class Layout:
    """Where products of derivatives are added: blocks of six parameters, couplings, and pairs of blocks.

    Blocks are those of the poses of all cameras, followed by those of lenses.
    """

    def __init__(self, scene: Scene) -> None:
        c, n_lenses, width = len(scene.free_cameras), scene.n_lenses, scene.by_parameter.shape[1]
        self.scene = scene
        self.n_parts = -(-width // BLOCK)
        self.n_blocks = n = c + self.n_parts * n_lenses
        self.n_points = len(scene.free_points)
        self.n_cameras = c
        self.couplings = [
            Couplings(kernels, item, size, self._blocks_of(camera), n)
            for kernels, camera, item, size in (
                (POINTS, scene.camera, scene.point, self.n_points),
                (LINES, scene.lines.camera, scene.lines.line, len(scene.free_lines)),
            )
            if len(item) or kernels is POINTS
        ]
        pairs, tables = _numbered([key for each in self.couplings for key in each.keys], n * n)
        for each in self.couplings:
            each.pairs, tables = tables[: len(each.keys)], tables[len(each.keys) :]
        self.rows, self.columns = pairs // n, pairs % n
        self.diagonal = np.flatnonzero(self.rows == self.columns)
        free = np.zeros((n, BLOCK), bool)
        free[:c] = scene.free_cameras[:, None]
        free[scene.scaled[:, 0], 3] = False
        for part in range(self.n_parts):
            here = slice(c + part * n_lenses, c + (part + 1) * n_lenses)
            free[here, : min(BLOCK, width - part * BLOCK)] = True
        used = np.zeros(n, bool)
        for each in self.couplings:
            used[each.block] = True
        self.free = free & used[:, None]
        self.position = np.where(self.free, np.cumsum(self.free).reshape(n, BLOCK) - 1, -1)
        self.n_free = int(self.free.sum())
        rows = np.broadcast_to(self.position[self.rows][:, :, None], (len(pairs), BLOCK, BLOCK))
        columns = np.broadcast_to(self.position[self.columns][:, None, :], rows.shape)
        # Diagonal blocks have both triangles; of others, the second is the mirror image.
        keep = (rows >= 0) & (columns >= 0)
        off = keep & (self.rows != self.columns)[:, None, None]
        self._entries = keep, rows[keep], columns[keep], off, rows[off], columns[off]
        self.zero_blocks, self.zero_pairs = np.zeros(n), np.zeros(len(pairs))

    def _blocks_of(self, camera: Reals) -> list[Reals]:
        """Return the blocks on which observations (k,) by cameras depend: those of poses and of parts of lenses."""
        lens = self.scene.lens_of[camera]
        n_lenses = self.scene.n_lenses
        return [camera, *(self.n_cameras + part * n_lenses + lens for part in range(self.n_parts))]

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


class Eliminated(NamedTuple):
    """Points or lines, after elimination."""

    scaled: Reals
    """Their scaled couplings,"""
    inverse: Reals
    """the inverses of the roots of their equations,"""
    reduced: Reals
    """and reduced gradients."""


class Sums:
    """The equations of points or lines: their own parts, and what they add to those of blocks."""

    def __init__(self, layout: Layout, couplings: Couplings, rest: Reals, by_item: Reals, parts: list[Reals]) -> None:
        kernels = couplings.kernels
        self.layout, self.couplings, self.rest, self.by_item, self.parts = layout, couplings, rest, by_item, parts
        self.squares, self.item_gradient = self.gradients(rest)
        self.products = sum(
            bundles.block_products(parts[g], parts[h], pair, layout.zero_pairs)
            for (g, h), pair in zip(couplings.own, couplings.pairs[1:], strict=True)
        )
        again = len(parts)
        blocks, items = (parts[0], by_item) if again == 1 else (np.concatenate(parts), np.tile(by_item, (again, 1, 1)))
        self.coupling = kernels.couplings(blocks, items, couplings.coupling_of, couplings.zero)
        self.gradient = self.block_gradient(rest)

    def gradients(self, rest: Reals) -> tuple[Reals, Reals]:
        """Return sums of squares by points or lines, and their gradients for residuals (k, 2)."""
        found: tuple[Reals, Reals] = self.couplings.kernels.sums(
            self.by_item, rest, self.couplings.item_of, self.couplings.zero_items
        )
        return found

    def block_gradient(self, rest: Reals) -> Reals:
        """Return the gradient (b, 6) by blocks for residuals (k, 2)."""
        return np.asarray(
            sum(
                bundles.block_gradients(part, rest, block, self.layout.zero_blocks)
                for part, block in zip(self.parts, self.couplings.block_of, strict=True)
            )
        )

    def eliminated(self, damping: float) -> Eliminated:
        """Return what remains for blocks after elimination."""
        inverse, reduced = self.couplings.kernels.root(self.squares, self.item_gradient, damping)
        scaled = self.couplings.kernels.scaled(self.coupling, np.take(inverse, self.couplings.item, 0))
        return Eliminated(scaled, inverse, reduced)

    def subtracted(self, found: Eliminated) -> Reals:
        """Return what elimination subtracts from products of blocks (pairs, 6, 6)."""
        of, layout = self.couplings, self.layout
        return np.asarray(of.kernels.eliminated(found.scaled, of.first, of.second, of.pairs[0], layout.zero_pairs))

    def subtracted_gradient(self, scaled: Reals, reduced: Reals) -> Reals:
        """Return what elimination subtracts from the gradient of blocks (b, 6)."""
        of = self.couplings
        return np.asarray(of.kernels.gradients(scaled, of.block, of.item, reduced, self.layout.zero_blocks))

    def changes(self, found: Eliminated, change: Reals, reduced: Reals) -> Reals:
        """Return the changes of points or lines after those of blocks (b, 6)."""
        of = self.couplings
        return np.asarray(
            of.kernels.changes(found.scaled, of.block, of.item, change, reduced, found.inverse, of.zero_items)
        )


class Equations:
    """The normal equations at a state: of weighed squares, or with up to a part of the curvature of the loss."""

    def __init__(self, layout: Layout, state: State, curved: float = 0.0) -> None:
        scene = layout.scene
        self.layout, self.turns = layout, _frames(scene, state)
        loss = scene.kind, scene.scale, curved
        moves = scene.free_points[scene.point].astype(float)
        kernel = KERNELS[scene.model][2 if layout.n_parts else 1]
        self.sums = [self._summed(0, scene.camera, kernel(*scene.seen(state), moves, *loss))]
        if len(layout.couplings) > 1:
            motors, ends, lenses, pixels = scene.of_lines(state)
            across = across_lines(state.lines)[scene.lines.line]
            kernel = LINE_KERNELS[2 if layout.n_parts else 1]
            found = kernel(motors, ends, across, lenses, pixels, 1.0, *loss)
            self.sums.append(self._summed(1, scene.lines.camera, found))
        self.gradient, self.products = (
            sum(getattr(each, name) for each in self.sums) for name in ("gradient", "products")
        )
        diagonal = np.zeros((layout.n_blocks, BLOCK))
        diagonal[layout.rows[layout.diagonal]] = np.einsum("bii->bi", self.products[layout.diagonal])
        self.diagonal = diagonal[layout.free]

    def _summed(self, which: int, camera: Reals, found: tuple[Reals, ...]) -> Sums:
        """Return the sums of observations by cameras (k,): residuals, derivatives, squares, and those by lenses."""
        rest, by_camera, by_item, _, *by_lens = found
        layout, scene = self.layout, self.layout.scene
        for (moved_camera, _), turn in zip(scene.scaled, self.turns, strict=True):
            here = camera == moved_camera
            by_camera[here, :, 3:] = by_camera[here, :, 3:] @ turn
        parts = [by_camera]
        for each in by_lens:
            by_parameter = each @ scene.by_parameter[: each.shape[2]]
            width = by_parameter.shape[2]
            padded = np.zeros((*by_parameter.shape[:2], BLOCK * layout.n_parts))
            padded[:, :, :width] = by_parameter
            parts += [np.ascontiguousarray(part) for part in np.split(padded, layout.n_parts, axis=2)]
        return Sums(layout, layout.couplings[which], rest, by_item, parts)

    def eliminated(self, damping: float) -> tuple[Any, Reals, list[Eliminated]]:
        """Return the reduced matrix and gradient, and what is left of points and lines."""
        layout = self.layout
        found = [each.eliminated(damping) for each in self.sums]
        blocks, gradient = self.products, self.gradient
        for each, part in zip(self.sums, found, strict=True):
            blocks = blocks - each.subtracted(part)
            gradient = gradient - each.subtracted_gradient(part.scaled, part.reduced)
        extra = np.where(self.diagonal > 0, damping * self.diagonal, 1.0)
        return layout.matrix(blocks, extra), gradient[layout.free], found

    def step(self, damping: float) -> tuple[Reals, list[Reals], float] | None:
        """Return changes of blocks (b, 6), of points (m, 3) and of lines (l, 4), and the decrease that is predicted.

        None if the damped matrix is not positive. Without lines, there are no changes of lines.
        """
        layout = self.layout
        matrix, gradient, found = self.eliminated(damping)
        change = np.zeros((layout.n_blocks, BLOCK))
        if layout.n_free:
            factor = factorized(matrix)
            if factor is None:
                return None
            change[layout.free] = -factor.solve(gradient)
        damped = damping * float(self.diagonal @ change[layout.free] ** 2)
        along, moves = float((self.gradient * change).sum()), []
        for each, part in zip(self.sums, found, strict=True):
            moves.append(each.changes(part, change, part.reduced))
            damped += damping * float((each.squares[:, each.couplings.kernels.diagonal] * moves[-1] ** 2).sum())
            along += float((each.item_gradient * moves[-1]).sum())
        for (camera, _), turn in zip(layout.scene.scaled, self.turns, strict=True):
            change[camera, 3:] = turn @ change[camera, 3:]
        return change, moves, 0.5 * (damped - along)


def across_lines(lines: Reals) -> Reals:
    """Return two unit vectors (l, 2, 3) orthogonal to each line (l, 2, 3)."""
    along = lines[:, 1] - lines[:, 0]
    least = np.abs(along).argmin(1)
    first = np.cross(along, np.eye(3)[least])
    with np.errstate(all="ignore"):
        both = np.stack([first, np.cross(along, first)], 1)
        return np.asarray(both / np.linalg.norm(both, axis=2, keepdims=True))


def _frames(scene: Scene, state: State) -> list[Reals]:
    """Return orthogonal matrices whose first columns are the directions that change held distances."""
    found = []
    for camera, other in scene.scaled:
        rows = pga3.motor_to_matrix(state.motors[[camera, other]])
        along = rows[0, :3, :3].T @ (rows[0, :3, 3] - rows[1, :3, 3])
        found.append(np.linalg.qr(np.column_stack([along, np.eye(3)]))[0][:, :3])
    return found


def moved(scene: Scene, state: State, change: Reals, moves: list[Reals]) -> State:
    """Return the state after changes of blocks, and of points and lines; held distances are restored."""
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
    points, *lines = moves
    ends = state.lines
    for each in lines:
        ends = ends + each.reshape(-1, 2, 2) @ across_lines(ends)
    return State(motors, lenses, state.points + points, ends)
