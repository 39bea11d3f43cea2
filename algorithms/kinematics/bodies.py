"""Rigid bodies: mass, centre of mass and inertia tensor of links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generated import pga3

from .errors import DescriptionError, NotFiniteError

_LEAST = -1e-12
"""Lower bound of moments of inertia, kg m². Some files contain rounding errors instead of 0."""


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
        Rotor inertia reflected at the joint, kg m² (kg for prismatic joints): rotor inertia times the gear ratio
        squared.

    Raises
    ------
    DescriptionError, NotFiniteError
        For a negative mass, moment of inertia or armature, a wrong number of coordinates, or non-finite numbers.
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
    """Return whether xx, yy and zz of a tensor xx, xy, xz, yy, yz, zz are not negative."""
    return min(tensor[0], tensor[3], tensor[5]) >= _LEAST


def about_centre(inertia: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the row of a body (mass, centre, tensor about the centre) from its inertia about the origin.

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
    # The order of summation must be the same on every machine, which BLAS does not guarantee: `gac robot` writes these
    # numbers into specs.
    row[4:] += np.array(
        [h[i] * c[j] if i != j else -(h[i - 2] * c[i - 2] + h[i - 1] * c[i - 1]) for i in range(3) for j in range(i, 3)]
    )
    return row


def moved(motor: NDArray[np.float64], bodies: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Merge several bodies, all moved by the same motor, into one body (10,)."""
    total = np.zeros(10)
    for body in bodies:
        total += pga3.inertia_of_moved_body(motor, body)
    return about_centre(total)
