"""Updates of a rotor from wide predictions: further starts, and all vectors since the beginning."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from generated import vga3

from ..arguments import Reals
from ..evidence import Noise, all_or_some_sets, differ, likely, minima
from ..evidence.least_squares import STEPS
from ..motors.recovery import rotor_from_vectors

_SAMPLES = 60
"""A limit on work: the number of pairs of vectors from which rotors are computed. If half of many vectors are wrong, 15
pairs contain no wrong one."""
_EXACT = 1e-20
"""From floating point: squared residuals, in units of the noise, below this are rounding."""


class Fit(NamedTuple):
    """The best rotor of a prediction and all vectors since."""

    rotor: Reals
    covariance: Reals
    square: float
    """The sum of squares of the error of the prediction and of the vectors that are used."""
    used: Reals
    """(n,) bool. The vectors within the gate."""
    ambiguous: bool
    """Whether another rotor is likely too."""


@dataclass(frozen=True, slots=True, eq=False)
class Beginning:
    """A wide prediction and all vectors measured since, from which the rotor is estimated again with each update."""

    rotor: Reals
    covariance: Reals
    vectors: Reals
    """(n, 3) Of the model,"""
    seen: Reals
    """(n, 3) and measured."""
    deviations: Reals
    """(n,) Of each coordinate."""

    def with_vectors(self, vectors: Reals, seen: Reals, sigma: float) -> Beginning:
        """Return the beginning with further vectors, of which those that are not finite are left out."""
        good = np.isfinite(vectors).all(1) & np.isfinite(seen).all(1)
        more = zip(("vectors", "seen"), (vectors[good], seen[good]), strict=True)
        joined = {name: np.concatenate([getattr(self, name), rows]) for name, rows in more}
        return replace(self, **joined, deviations=np.concatenate([self.deviations, np.full(int(good.sum()), sigma)]))

    def moved(self, step: Reals, covariance: Reals) -> Beginning:
        """Return the beginning after a rotation in the moving frame, with a covariance that is larger."""
        rotor = np.asarray(vga3.normalize_rotor(vga3.rotor_product(self.rotor, step)))
        vectors = np.asarray(vga3.rotate_vector(vga3.rotor_inverse(step), self.vectors))
        return replace(self, rotor=rotor, vectors=vectors, covariance=self.covariance + covariance)

    def best(self, gate: float) -> Fit:
        """Return the rotor with the least squares, in which vectors outside the gate cost as much as the gate."""
        prior = np.linalg.inv(np.linalg.cholesky(self.covariance))
        back = vga3.rotor_inverse(self.rotor)

        def parts(rotors: Reals) -> tuple[Reals, Reals, Reals]:
            moved = np.asarray(vga3.rotate_vector(rotors[:, None], self.vectors))
            off = (moved - self.seen) / self.deviations[:, None]
            return moved, off, (off**2).sum(-1) <= gate

        def equations(rotors: Reals, _: Reals) -> tuple[Reals, Reals]:
            moved, off, used = parts(rotors)
            error = np.asarray(vga3.rotor_to_rotation_vector(vga3.rotor_product(rotors, back)))
            outside = np.zeros(3)
            outside[0] = np.sqrt(min(gate, 1e300))
            residual = np.where(used[..., None], off, outside).reshape(len(rotors), -1)
            # A rotation w moves R v by w x R v, a column for each axis of w.
            rows = np.cross(np.eye(3), moved[:, :, None]).swapaxes(-1, -2) / self.deviations[:, None, None]
            rows = np.where(used[..., None, None], rows, 0).reshape(len(rotors), -1, 3)
            own = prior @ _left_jacobian_inverse(error)
            return np.concatenate([residual, error @ prior.T], 1), np.concatenate([rows, own], 1)

        def step(change: Reals, rotors: Reals, _: Reals) -> Reals:
            turn = vga3.rotor_from_rotation_vector(np.ascontiguousarray(change))
            return np.asarray(vga3.normalize_rotor(vga3.rotor_product(turn, rotors)))

        starts = self._starts()
        found = minima(starts, equations, step, np.full(len(starts), _EXACT), STEPS)
        order = np.argsort(np.where(np.isfinite(found.cost), found.cost, np.inf))
        rotor, cost, normal = found.state[order[0]], found.cost[order], found.normal[order[0]]
        used = parts(rotor[None])[2][0]
        offsets = vga3.rotor_to_rotation_vector(vga3.rotor_product(found.state[order], vga3.rotor_inverse(rotor)))
        rivals = likely(cost, 3 * len(used) + 3, 3 * len(used), Noise(1.0))
        rivals &= differ(np.asarray(offsets), normal, np.ones(1))
        square = float(cost[0] - gate * (~used).sum()) if not used.all() else float(cost[0])
        return Fit(rotor, np.linalg.inv(normal), square, used, bool(rivals.any()))

    def _starts(self) -> Reals:
        """Return the prediction, turns of it by 2 radians about the axes, and the rotors of pairs of vectors."""
        turns = vga3.rotor_from_rotation_vector(2.0 * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)]))
        starts = [np.asarray(vga3.rotor_product(turns, self.rotor))]
        n = len(self.vectors)
        if n >= 2:
            pairs = all_or_some_sets(n, 2, _SAMPLES)
            fits = rotor_from_vectors(self.vectors[pairs], self.seen[pairs])
            starts.append(np.asarray(fits.rotor)[np.asarray(fits.determined)])
        return np.concatenate(starts)


def _left_jacobian_inverse(error: Reals) -> Reals:
    """Return the derivatives (b, 3, 3) of rotation vectors (b, 3) by a small rotation that follows."""
    angle = np.linalg.norm(error, axis=-1)
    small = angle < 1e-4
    safe = np.where(small, 1.0, np.minimum(angle, np.pi - 1e-6))
    factor = np.where(small, 1 / 12, 1 / safe**2 - 1 / (2 * safe * np.tan(safe / 2)))
    cross = np.cross(error[:, None], np.eye(3)).swapaxes(-1, -2)
    return np.asarray(np.eye(3) - cross / 2 + factor[:, None, None] * cross @ cross)
