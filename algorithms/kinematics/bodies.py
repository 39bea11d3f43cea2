"""Rigid bodies: what a link weighs, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generated import pga3

from .errors import DescriptionError, NotFiniteError

_LEAST = -1e-12
"""Moments of inertia are not below this, kg m²: some files have rounding instead of 0."""


@dataclass(frozen=True, slots=True)
class Body:
    """A rigid body in the frame of its link.

    Attributes
    ----------
    mass : float
        kg.
    centre : 3 floats
        Centre of mass, m.
    tensor : 6 floats
        Moments of inertia about the centre, xx, xy, xz, yy, yz, zz, kg m².
    armature : float
        Inertia of the motor's rotor as it is felt at the joint, kg m² (kg for a slide): rotor inertia times the gear
        ratio squared.

    Raises
    ------
    DescriptionError, NotFiniteError
        For a negative mass, moment of inertia or armature, a wrong number of coordinates, what is not finite.
    """

    mass: float = 0.0
    centre: tuple[float, ...] = (0.0, 0.0, 0.0)
    tensor: tuple[float, ...] = (0.0,) * 6
    armature: float = 0.0

    def __post_init__(self) -> None:
        if len(self.centre) != 3 or len(self.tensor) != 6:
            found = f"{len(self.centre)} coordinates of the centre, {len(self.tensor)} of the tensor"
            raise DescriptionError(f"body: {found}; expected 3 and 6")
        if not np.isfinite(self.row).all() or not np.isfinite(self.armature):
            raise NotFiniteError(f"body: {self}; expected finite numbers")
        if self.mass < 0 or self.armature < 0:
            raise DescriptionError(f"body: mass {self.mass}, armature {self.armature}; expected no negative number")
        if not is_tensor(self.tensor):
            raise DescriptionError(f"body: tensor {self.tensor}; expected no negative xx, yy, zz")

    @property
    def row(self) -> NDArray[np.float64]:
        """Mass, centre and tensor as ten numbers."""
        return np.array([self.mass, *self.centre, *self.tensor], float)


def is_tensor(tensor: Sequence[float]) -> bool:
    """Whether no moment of inertia xx, yy, zz of a tensor xx, xy, xz, yy, yz, zz is negative."""
    return min(tensor[0], tensor[3], tensor[5]) >= _LEAST


def about_centre(inertia: NDArray[np.float64]) -> NDArray[np.float64]:
    """The row of a body (mass, centre, tensor about it) from its inertia about the origin, as the kernels add it up.

    Parameters
    ----------
    inertia : array, (10,)
        Mass, mass times centre, tensor about the origin.

    Returns
    -------
    array, (10,)
    """
    mass, h, row = inertia[0], inertia[1:4], inertia.copy()
    if mass == 0:
        return row
    c = h / mass
    row[1:4] = c
    # Sums in one order on every machine, which BLAS does not promise: `gac robot` writes these numbers into specs.
    row[4:] += np.array(
        [h[i] * c[j] if i != j else -(h[i - 2] * c[i - 2] + h[i - 1] * c[i - 1]) for i in range(3) for j in range(i, 3)]
    )
    return row


def moved(motor: NDArray[np.float64], bodies: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """One body (10,) for several that are rigidly joined, all moved by a motor."""
    total = np.zeros(10)
    for body in bodies:
        total += pga3.inertia_of_moved_body(motor, body)
    return about_centre(total)
