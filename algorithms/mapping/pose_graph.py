"""Optimisation of graphs of poses: Gauss-Newton on motors with sparse matrices of scipy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import line_maps, motor_graphs, pga2

from ..arguments import Reals, as_given, finite, real_array
from ..estimation.matrices import as_definite
from ..estimation.motor_factors import MOTION, Factors, States
from ..estimation.motor_problem import REJECTED, MotorProblem, SmoothingStatus
from ..estimation.smoothing import checked_states, smoothed
from ..evidence import Noise, Status, gate_of, is_lost
from ..evidence.descent import Descent, descended
from ..evidence.normal_equations import NormalEquations, Parts, blocks_of_inverse
from ..evidence.sampling import without_copies
from ..precision import NEGLIGIBLE, ROUNDING

_ROUNDS = 20
"""A limit on work: how often robust edges that agree are added; each round takes half of them."""


class GraphStatus(Status):
    """Result of an optimisation of a graph of poses."""

    OK = 0
    NOT_CONVERGED = 1
    """The steps were still large after the last iteration; the poses are the best that were found."""
    DISCONNECTED = 2
    """Some poses are not connected to the first one by edges; they were not changed."""
    CONTRADICTED = 3
    """Most of the robust edges have lost three quarters of their weight: they contradict the others or each other."""
    UNDETERMINED = 4
    """The information of the edges leaves some direction of the poses undetermined. It is tested in space."""
    INCONSISTENT = 5
    """Misfits are larger than the information leaves with a probability of 0.001."""


@dataclass(frozen=True, slots=True, eq=False)
class OptimisedPoses:
    """Result of `optimise_poses`."""

    motors: Reals
    """(n, 4) or (n, 8) The poses. The first one is not changed."""
    status: GraphStatus
    misfits: Reals
    """(m, 3) or (m, 6) Of each edge: the angle, or rotation vector, and the translation of ``~motion ~a b``."""
    weights: Reals
    """(m,) 1 for edges that are not robust, and between 0 and 1 for robust ones."""
    cost: float
    """The sum over edges of half of their squared misfits by their information, robust ones bounded."""
    steps: int
    covariances: Reals
    """(k, 3, 3) or (k, 6, 6) Of the perturbations, rotation and translation in their own frames, of the poses
    `marginals`, relative to the first pose; infinite for poses that are not connected to it."""


def optimise_poses(
    motors: ArrayLike,
    edges: ArrayLike,
    motions: ArrayLike,
    information: ArrayLike,
    robust: ArrayLike | None = None,
    bound: float = 4.0,
    tolerance: float = 1e-13,
    marginals: ArrayLike = (),
) -> OptimisedPoses:
    """Find the poses that agree best with measured motions between them.

    Parameters
    ----------
    motors : array_like, (n, 4) or (n, 8)
        Unit motors of `generated.pga2`, or in space of `generated.pga3`, from the frame of each pose to that of the
        map: the start. The first one is fixed.
    edges : array_like, (m, 2) of int
        Pairs (a, b) of poses.
    motions : array_like, (m, 4) or (m, 8)
        The measured pose b in the frame of pose a.
    information : array_like, (m, 3, 3) or (m, 6, 6)
        The inverse covariances of the angle, or rotation vector, and the translation of the misfit ``~motion ~a b``, in
        this order.
    robust : array_like, (m,) of bool, optional
        Edges with a bounded influence (Geman and McClure's function), such as closures of loops that may be wrong. By
        default none.
    bound : float, optional
        The misfit, in standard deviations, at which the weight of a robust edge is a quarter.
    tolerance : float, optional
        The relative decrease of the cost at which the steps end.
    marginals : array_like, (k,) of int, optional
        Poses whose marginal covariances are computed. Each takes three solutions with the factors of the last step.

    Returns
    -------
    OptimisedPoses

    Raises
    ------
    TypeError, ValueError
        If arguments have other shapes or types, are not finite, or name poses that do not exist.

    Notes
    -----
    Each step solves the sparse normal equations, narrow bands by LAPACK and others by SuperLU, with the damping of
    Levenberg and Marquardt. If robust edges are rejected, the poses are computed again from those that agree with the
    other edges within the covariance of these (the test of innovations of filters), and the result with the smaller
    cost is returned. Exact copies of an edge, such as those of a file that was read twice, count once. Graphs in space
    are smoothed as by `algorithms.estimation.smooth_motors`; translations of misfits are those of logarithms.
    """
    width = 8 if np.shape(motors)[-1:] == (8,) else 4
    poses = finite(real_array(motors, "motors", (-1, width)).astype(float), "motors")
    given = _checked_edges(edges, motions, information, robust, len(poses), width)
    if not bound > 0:
        raise ValueError(f"bound: {bound}; expected a positive number of standard deviations")
    wanted = checked_states(marginals, len(poses), "marginals")
    kept, again = given.without_copies()
    reached = _reached(len(poses), kept.ends)
    if width == 8:
        found = _in_space(poses, kept, reached, bound**2, tolerance, wanted)
    else:
        rows = _Rows(len(poses), kept.ends, reached)
        found = _Graph(*kept, bound**2, tolerance, reached, rows).optimised(poses, wanted)
    return replace(found, misfits=found.misfits[again], weights=found.weights[again])


class _Edges(NamedTuple):
    ends: Reals
    motions: Reals
    information: Reals
    robust: Reals

    def without_copies(self) -> tuple[_Edges, Reals]:
        """Return edges that are no exact copies of others, and the number of each edge among these."""
        table = self.information.reshape(len(self.ends), self.information.shape[1] ** 2)
        kept, again = without_copies(self.motions, self.ends, table, self.robust[:, None])
        return _Edges(*(array[kept] for array in self)), again


def _checked_edges(
    edges: ArrayLike, motions: ArrayLike, information: ArrayLike, robust: ArrayLike | None, n: int, width: int
) -> _Edges:
    """Return valid edges between n poses."""
    pairs = as_given(edges, "edges")
    pairs = pairs if pairs.size else pairs.reshape(-1, 2)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or (pairs.size and pairs.dtype.kind not in "iu"):
        raise ValueError(f"edges: shape {pairs.shape}, dtype {pairs.dtype}; expected (m, 2) integers")
    pairs = pairs.astype(np.int64)
    if pairs.size and not (pairs.min() >= 0 and pairs.max() < n):
        raise ValueError(f"edges: poses {pairs.min()} to {pairs.max()}; expected 0 to {n - 1}")
    m, freedoms = len(pairs), 3 if width == 4 else 6
    measured = finite(real_array(motions, "motions", (m, width)).astype(float), "motions")
    weights = finite(real_array(information, "information", (m, freedoms, freedoms)).astype(float), "information")
    if not as_definite(weights)[1]:
        raise ValueError("information: not symmetric positive semidefinite; expected inverses of covariances")
    bounded = np.zeros(m, bool) if robust is None else as_given(robust, "robust").astype(bool)
    if bounded.shape != (m,):
        raise ValueError(f"robust: shape {bounded.shape}; expected ({m},), one for each edge")
    return _Edges(pairs, measured, weights, bounded)


def _in_space(
    poses: Reals, given: _Edges, reached: Reals, bound: float, tolerance: float, wanted: Reals
) -> OptimisedPoses:
    """Smooth a graph in space; the first pose and those without a connection to it are held."""
    n = len(poses)
    values, vectors = np.linalg.eigh((given.information + np.swapaxes(given.information, 1, 2)) / 2)
    if (values[:, 0] < -NEGLIGIBLE * values[:, -1]).any():
        raise ValueError("information: an eigenvalue is negative; expected inverse covariances")
    roots = np.sqrt(np.maximum(values, 0))[:, :, None] * np.swapaxes(vectors, 1, 2)
    factors = Factors(MOTION, given.ends, (given.motions,), roots, given.robust)
    held = np.flatnonzero(~reached | (np.arange(n) == 0))
    start = States(poses, np.zeros((n, 3)), np.zeros((n, 6)))
    found = smoothed(MotorProblem([factors], n, held, bound), start, wanted, tolerance)
    status = _STATUSES.get(found.status, GraphStatus.OK) if reached.all() else GraphStatus.DISCONNECTED
    spreads = np.where(reached[wanted][:, None, None], found.covariances, np.inf)
    a, b = (found.motors[ends] for ends in given.ends.T)
    misfits = np.asarray(motor_graphs.relative_motion(a, b, given.motions)[0])
    return OptimisedPoses(found.motors, status, misfits, found.weights, found.cost, found.steps, spreads)


_STATUSES = {
    SmoothingStatus.NOT_CONVERGED: GraphStatus.NOT_CONVERGED,
    SmoothingStatus.UNDETERMINED: GraphStatus.UNDETERMINED,
    SmoothingStatus.CONTRADICTED: GraphStatus.CONTRADICTED,
    SmoothingStatus.INCONSISTENT: GraphStatus.INCONSISTENT,
}


@dataclass(frozen=True, slots=True, eq=False)
class _Graph:
    edges: Reals
    motions: Reals
    information: Reals
    robust: Reals
    scale: float
    """The squared misfit at which the weight of a robust edge is a quarter."""
    tolerance: float
    reached: Reals
    rows: _Rows

    def misfits(self, poses: Reals) -> tuple[Reals, Reals, Reals]:
        """Return the misfits (m, 3) and their derivatives (m, 3, 3) by the two poses."""
        a, b = poses[self.edges[:, 0]], poses[self.edges[:, 1]]
        return line_maps.edge_of_poses(a, b, self.motions)

    def squares(self, misfits: Reals) -> Reals:
        """Return squared misfits by the information of edges."""
        return np.asarray(np.einsum("mi,mij,mj->m", misfits, self.information, misfits))

    def weighed(self, squares: Reals, widened: float) -> tuple[float, Reals]:
        """Return the cost, and the weights of edges."""
        scale = widened * self.scale
        share = scale / (scale + squares)
        cost = np.where(self.robust, share * squares, squares)
        return 0.5 * float(cost.sum()), np.where(self.robust, share**2, 1.0)

    def optimised(self, poses: Reals, wanted: Reals) -> OptimisedPoses:
        """Take steps until they are small, again from another start if robust edges disagree with the first result."""
        found = self._descended(poses)
        if (found.weights[self.robust] < REJECTED).any():
            start = self._gated(poses)
            other = None if start is None else self._descended(start, lowered=False)
            # Sums of bounded squares at minima can be compared, as those of likelihoods with foreign measurements.
            if other is not None and (other.settled, -other.cost) > (found.settled, -found.cost):
                found = other
        status = GraphStatus.OK if found.settled else GraphStatus.NOT_CONVERGED
        used = ~self.robust | (found.weights >= REJECTED)
        if found.settled and is_lost(int(used[self.robust].sum()), int(self.robust.sum())):
            status = GraphStatus.CONTRADICTED
        elif found.settled and self.reached.all() and self._is_inconsistent(found.squares, used):
            status = GraphStatus.INCONSISTENT
        if not self.reached.all():
            status = GraphStatus.DISCONNECTED
        misfits, by_a, by_b = found.equations
        spreads = self.rows.covariances(by_a, by_b, found.weights[:, None, None] * self.information, wanted)
        motors = np.asarray(pga2.normalize_motor(found.state))
        return OptimisedPoses(motors, status, misfits, found.weights, found.cost, found.steps, spreads)

    def _is_inconsistent(self, squares: Reals, used: Reals) -> bool:
        """Return whether the squared misfits of some edges are larger than their information leaves.

        Edges that measure all three numbers determine the poses that they connect; the others may determine no more.
        """
        values = np.linalg.eigvalsh(self.information)
        numbers = (values > NEGLIGIBLE * values[:, -1:]).sum(1)
        whole = used & (numbers == 3)
        n_parts = 1 if whole.all() else _components(len(self.reached), self.edges[whole])[0]
        freedom = int(numbers[used].sum()) - 3 * (len(self.reached) - n_parts)
        return bool(Noise(1.0).contradicted(np.asarray(squares[used].sum()), freedom))

    def linearised(self, poses: Reals) -> tuple[Reals, tuple[Reals, Reals, Reals]]:
        """Return squared misfits, and the misfits with their derivatives."""
        found = self.misfits(poses)
        return self.squares(found[0]), found

    def step(
        self, poses: Reals, equations: tuple[Reals, Reals, Reals], weights: Reals, damping: float, reused: bool
    ) -> tuple[Reals, Reals] | None:
        """Return the damped Gauss-Newton step (n, 3), and the moved poses."""
        change = self.rows.solved(*equations, weights[:, None, None] * self.information, damping, reused)
        if change is None:
            return None
        moved = pga2.motor_product(poses, pga2.motor_from_angle_translation(change[:, 0], change[:, 1:]))
        return change, np.asarray(moved)

    def _descended(self, poses: Reals, *, lowered: bool = True) -> Descent:
        """Take steps until they are small."""
        if not len(self.edges):
            squares, equations = self.linearised(poses)
            return Descent(poses, squares, equations, np.ones(0), 0.0, True, 0)
        farthest = float(self.linearised(poses)[0][self.robust].max(initial=0.0)) if lowered else 0.0
        return descended(self, poses, self.tolerance, max(1.0, farthest / self.scale))

    def _gated(self, poses: Reals) -> Reals | None:
        """Return poses by the other edges and the robust ones that agree with them, or None if these do not suffice.

        Robust edges are taken as filters take measurements: if the covariance of the misfit, from that of the poses by
        the edges so far and that of the edge, explains it. Each round takes half of those that agree, which makes the
        others more certain.
        """
        taken = ~self.robust
        if not (_reached(len(poses), self.edges[taken]) == self.reached).all():
            return None
        for _ in range(_ROUNDS):
            part = replace(
                self,
                edges=self.edges[taken],
                motions=self.motions[taken],
                information=self.information[taken],
                robust=np.zeros(int(taken.sum()), bool),
                rows=_Rows(len(poses), self.edges[taken], self.reached),
            )
            found = part._descended(poses)
            poses, (_, by_a, by_b) = found.state, found.equations
            squares = self._innovations(poses, part.rows, by_a, by_b, part.information)
            agrees = ~self.robust | (squares <= gate_of(3))
            new = agrees & ~taken
            # Half of the new ones, those that agree best, so that a wrong one among them is found by the others.
            limit = np.median(squares[new]) if new.any() else 0.0
            again = (taken & agrees) | (new & (squares <= limit))
            if (again == taken).all():
                break
            taken = again
        return poses

    def _innovations(self, poses: Reals, rows: _Rows, by_a: Reals, by_b: Reals, information: Reals) -> Reals:
        """Return the squared misfits (m,) of robust edges, divided by their covariances with that of the poses."""
        misfits, left, right = self.misfits(poses)
        squares = np.zeros(len(misfits))
        chosen = np.flatnonzero(self.robust)
        between = rows.between(by_a, by_b, information, self.edges[chosen], left[chosen], right[chosen])
        spread = between + np.linalg.pinv(self.information[chosen], hermitian=True)
        squares[chosen] = np.einsum(
            "mi,mi->m", misfits[chosen], np.linalg.solve(spread, misfits[chosen][..., None])[..., 0]
        )
        return squares


class _Rows:
    """The sparse equations of a graph."""

    def __init__(self, n: int, edges: Reals, reached: Reals) -> None:
        free = reached.copy()
        free[:1] = False
        self._free = np.repeat(free, 3)
        self._position = np.where(self._free, np.cumsum(self._free) - 1, -1).reshape(n, 3)
        columns = self._position[edges].reshape(len(edges), 6)
        self._equations = NormalEquations([columns], np.flatnonzero(self._free) // 3)

    def solved(
        self, misfits: Reals, by_a: Reals, by_b: Reals, information: Reals, damping: float, reused: bool
    ) -> Reals | None:
        """Return the damped Gauss-Newton step (n, 3), or None if the equations are singular."""
        found = self._equations.step(_parts(misfits, by_a, by_b, information), damping, reused, ROUNDING)
        if found is None:
            return None
        change = np.zeros(len(self._free))
        change[self._free] = found
        return change.reshape(-1, 3)

    def covariances(self, by_a: Reals, by_b: Reals, information: Reals, wanted: Reals) -> Reals:
        """Return the marginal covariances (k, 3, 3) of some poses."""
        found = np.where((self._position[wanted, 0] >= 0)[:, None, None], np.zeros((3, 3)), np.inf)
        found[wanted == 0] = 0
        inside = np.flatnonzero(self._position[wanted, 0] >= 0)
        if len(inside):
            factor = self._equations.factor(_parts(by_a[:, :, 0], by_a, by_b, information), least=ROUNDING)
            places = self._position[wanted[inside]]
            found[inside] = np.inf if factor is None else blocks_of_inverse(factor, places, self._equations.n)
        return np.asarray(found)

    def between(self, by_a: Reals, by_b: Reals, information: Reals, edges: Reals, left: Reals, right: Reals) -> Reals:
        """Return the covariances (k, 3, 3) of misfits of edges, whose derivatives by both poses are given."""
        found, n = np.zeros((len(edges), 3, 3)), self._equations.n
        if not n:
            return found
        factor = self._equations.factor(_parts(by_a[:, :, 0], by_a, by_b, information), least=ROUNDING)
        if factor is None:
            return np.full(found.shape, np.inf)
        for k, pair in enumerate(edges.tolist()):
            column = np.zeros((n, 3))
            for pose, rows in zip(pair, (left[k], right[k]), strict=True):
                places = self._position[pose]
                if places[0] >= 0:
                    column[places] += rows.T
            found[k] = column.T @ factor.solve(column)
        return found


def _parts(misfits: Reals, by_a: Reals, by_b: Reals, information: Reals) -> Parts:
    rows = np.concatenate([by_a, by_b], 2)
    return [(misfits, rows, information @ rows)]


def _reached(n: int, edges: Reals) -> Reals:
    """Return which poses are connected to the first one."""
    labels = _components(n, edges)[1]
    return np.asarray(labels == labels[0] if n else np.zeros(0, bool))


def _components(n: int, edges: Reals) -> tuple[int, Reals]:
    """Return the number of parts of poses that edges connect, and the part (n,) of each pose."""
    if not n:
        return 0, np.zeros(0, int)
    links = scipy.sparse.csc_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n))
    found = scipy.sparse.csgraph.connected_components(links, directed=False)
    return int(found[0]), np.asarray(found[1])
