"""Forces of fingers that balance a load, by linear programming."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite, finite_number, real_array
from ..evidence import Status
from ..precision import SINGLE
from .quality import contact_wrenches

_INFEASIBLE = 2
"""The status of `scipy.optimize.linprog` for equations without a solution."""


class ForceStatus(Status):
    """Whether fingers can balance a load, and if not, why."""

    OK = 0
    """The forces are within the friction cones, and the load and they add up to 0."""
    SLIPS = 1
    """No forces within the friction cones balance the load, however large they are."""
    TOO_WEAK = 2
    """Every balance needs a normal force above the limit. `forces` are those with the least."""
    NOT_SOLVED = 3
    """Rounding errors prevent a solution: the load or the contacts are close to the limit of what can be balanced."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactForces:
    """Result of `contact_forces`."""

    status: ForceStatus
    forces: Reals
    """(c, 3) The force of each finger on the object; NaN unless the status is OK or TOO_WEAK."""
    torques: Reals
    """(c,) The torque of each soft finger about its outward normal."""
    largest: float
    """The largest normal force of a finger; infinite if the load cannot be balanced."""


def contact_forces(
    contacts: ArrayLike,
    normals: ArrayLike,
    load: ArrayLike,
    friction: float = 0.5,
    edges: int = 8,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    torsion: float = 0.0,
    limit: float = np.inf,
) -> ContactForces:
    """Distribute a load over the fingers so that the largest normal force is least.

    Parameters
    ----------
    contacts, normals, friction, edges, centre, torsion
        As in `contact_wrenches`.
    load : array_like, (6,)
        What acts on the object: a force, such as its weight, and a torque about `centre`.
    limit : float
        The largest normal force of which a finger is capable.

    Returns
    -------
    ContactForces
        Since normal forces grow in proportion to the load, a grasp whose fingers push with at most F resists the load
        times ``F / largest``. The cones have flat sides, and are inside of those of friction: forces within them do not
        slip, and `largest` is at most that of round cones with ``cos(pi / edges)`` times the friction, for 8 edges 8 %
        less.

    Raises
    ------
    TypeError, ValueError
        As in `contact_wrenches`, and if `load` is not six finite numbers, or `limit` is not positive.

    Notes
    -----
    The variables of the linear programme are the parts of each row of `contact_wrenches` and the largest normal force
    (Kerr and Roth, 1986). For a load of norm 1, the sum of the wrenches is verified up to 1e-6.
    """
    wrenches = contact_wrenches(contacts, normals, friction, edges, centre, torsion)
    acting = finite(real_array(load, "load", (6,), "a force and a torque"), "load").astype(np.float64)
    if acting.ndim != 1:
        raise ValueError(f"load: shape {acting.shape}; expected (6,), a force and a torque")
    if limit != np.inf and not finite_number(limit, "limit") > 0:
        raise ValueError(f"limit: {limit}; expected a positive number")
    force, moment = (np.asarray(each, np.float64) for each in pga3.line_to_direction_moment(wrenches))
    count, rows = force.shape[:2]
    places = np.asarray(contacts, np.float64) - np.asarray(centre, np.float64)
    length = float(np.linalg.norm(places, axis=1).max(initial=0.0)) or 1.0
    matrix = np.concatenate([force, moment / length], -1).reshape(-1, 6).T
    wanted = -acting / np.array([1, 1, 1, length, length, length])
    size = float(np.linalg.norm(wanted))
    if size == 0:
        return ContactForces(ForceStatus.OK, np.zeros((count, 3)), np.zeros(count), 0.0)
    parts = _least(matrix, wanted / size, count, rows)
    if isinstance(parts, ForceStatus):
        return _without(parts, count)
    if not np.abs(matrix @ parts - wanted / size).max() < SINGLE:
        return _without(ForceStatus.NOT_SOLVED, count)
    shares = size * parts.reshape(count, rows)
    torques = torsion * (shares[:, edges] - shares[:, edges + 1]) if torsion else np.zeros(count)
    largest = float(shares.sum(1).max())
    status = ForceStatus.OK if largest <= limit else ForceStatus.TOO_WEAK
    return ContactForces(status, np.einsum("ij,ijk->ik", shares, force), torques, largest)


def _least(matrix: Reals, wanted: Reals, count: int, rows: int) -> Reals | ForceStatus:
    """Return the parts (count * rows) of wrenches whose sum is wanted, or why there are none."""
    sums = np.hstack([np.kron(np.eye(count), np.ones(rows)), -np.ones((count, 1))])
    found = scipy.optimize.linprog(
        np.append(np.zeros(count * rows), 1.0),
        A_ub=sums,
        b_ub=np.zeros(count),
        A_eq=np.hstack([matrix, np.zeros((6, 1))]),
        b_eq=wanted,
        method="highs",
    )
    if found.status == 0:
        return np.asarray(found.x[:-1])
    return ForceStatus.SLIPS if found.status == _INFEASIBLE else ForceStatus.NOT_SOLVED


def _without(status: ForceStatus, count: int) -> ContactForces:
    return ContactForces(status, np.full((count, 3), np.nan), np.full(count, np.nan), np.inf)
