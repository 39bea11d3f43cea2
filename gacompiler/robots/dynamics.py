"""Dynamics of one robot as expressions: the constants of its `Chain` are numbers, and fold.

Twists and wrenches are lines, as in `gacompiler.robots.motions`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..frontend.expression import lift
from ..frontend.operations import commutator, regressive_product
from .chains import Chain, exact
from .frames import ZERO, cross
from .inertias import Inertia, regrouped
from .motions import assembled_line, direction_and_moment, line_of, motions_of, total


def inverse_dynamics(chain: Chain, q: Sequence[Any], qd: Sequence[Any], qdd: Sequence[Any]) -> tuple[Any, ...]:
    """Forces and torques of the joints that give accelerations: Newton and Euler, outward and back.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q, qd, qdd : n scalars each
        Joint variables, their rates, and the rates of these.

    Returns
    -------
    n scalars
        N m, or N where the joint slides.
    """
    motions, inertias = motions_of(chain, q), regrouped(chain)
    free_fall = line_of(ZERO, tuple(-exact(g) for g in chain.gravity))  # type: ignore[arg-type]
    twists: list[Any] = []
    rates: list[Any] = []
    wrenches: list[Any] = []
    for joint, motion in enumerate(motions):
        parent = chain.parents[joint]
        own = qd[joint] * motion.twist
        twist = own if parent < 0 else motion.from_parent(twists[parent]) + own
        rate = motion.from_parent(rates[parent] if parent >= 0 else free_fall) + qdd[joint] * motion.twist
        if parent >= 0:
            rate = rate + commutator(own, twist)
        twists.append(twist)
        rates.append(rate)
        wrenches.append(_momentum(inertias[joint], rate) + commutator(_momentum(inertias[joint], twist), twist))
    torques: list[Any] = [0] * chain.n_joints
    for joint in reversed(range(chain.n_joints)):
        motion, parent = motions[joint], chain.parents[joint]
        torques[joint] = regressive_product(motion.twist, wrenches[joint])
        if chain.armature:
            torques[joint] = torques[joint] + exact(chain.armature[joint]) * qdd[joint]
        if parent >= 0:
            wrenches[parent] = wrenches[parent] + motion.to_parent(wrenches[joint])
    return tuple(torques)


def _momentum(inertia: Inertia, twist: Any) -> Any:
    """The momentum of a body, a line like a wrench."""
    mass, h, tensor = inertia
    w, v = direction_and_moment(twist)
    linear = tuple(a + mass * b for a, b in zip(cross(w, h), v, strict=True))
    angular = tuple(
        total([tensor[i][j] * w[j] for j in range(3)]) + b for i, b in zip(range(3), cross(h, v), strict=True)
    )
    return assembled_line(linear, angular)


def mass_matrix(chain: Chain, q: Sequence[Any]) -> tuple[tuple[Any, ...], ...]:
    """The symmetric matrix of the kinetic energy, by composite bodies.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q : n scalars

    Returns
    -------
    n rows of n scalars
    """
    motions, n = motions_of(chain, q), chain.n_joints
    bodies: list[tuple[Any, list[Any], dict[tuple[int, int], Any]]] = [
        (mass, list(h), {(i, j): tensor[i][j] for i in range(3) for j in range(i, 3)})
        for mass, h, tensor in regrouped(chain)
    ]
    result: list[list[Any]] = [[0] * n for _ in range(n)]
    for joint in reversed(range(n)):
        motion, parent = motions[joint], chain.parents[joint]
        mass, h, tensor = bodies[joint]
        full = tuple(tuple(tensor[min(i, j), max(i, j)] for j in range(3)) for i in range(3))
        wrench = _momentum((mass, tuple(h), full), lift(motion.twist))  # type: ignore[arg-type]
        other, ancestor = joint, joint
        while ancestor >= 0:
            if ancestor != joint:
                wrench = motions[other].to_parent(wrench)
            entry = regressive_product(motions[ancestor].twist, wrench)
            result[joint][ancestor] = result[ancestor][joint] = entry
            other, ancestor = ancestor, chain.parents[ancestor]
        if chain.armature:
            result[joint][joint] = result[joint][joint] + exact(chain.armature[joint])
        if parent >= 0:
            turned_h, turned = motion.rotated(h), motion.tensor_to_parent(tensor)
            r = motion.position(q[joint])
            shifted = tuple(a + mass * b for a, b in zip(turned_h, r, strict=True))
            # about the other origin: h and r take part symmetrically through (h + h')/2
            middle = tuple((a + b) / 2 for a, b in zip(turned_h, shifted, strict=True))
            trace = 2 * total([a * b for a, b in zip(r, middle, strict=True)])
            before = bodies[parent]
            for i, j in turned:
                before[2][i, j] = before[2][i, j] + turned[i, j] - (r[i] * middle[j] + middle[i] * r[j])
                if i == j:
                    before[2][i, j] = before[2][i, j] + trace
            bodies[parent] = (before[0] + mass, [a + b for a, b in zip(before[1], shifted, strict=True)], before[2])
    return tuple(map(tuple, result))


def energies(chain: Chain, q: Sequence[Any], qd: Sequence[Any]) -> tuple[Any, Any]:
    """Kinetic and potential energy, J; what no joint can change of the potential energy is left out.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q, qd : n scalars each
        Numbers, expressions in a kernel, or symbols of sympy.

    Returns
    -------
    two scalars
    """
    motions, inertias = motions_of(chain, q), regrouped(chain)
    kinetic: Any = 0
    twists: list[Any] = []
    for joint, motion in enumerate(motions):
        parent, own = chain.parents[joint], qd[joint] * motion.twist
        twists.append(own if parent < 0 else motion.from_parent(twists[parent]) + own)
        momentum = _momentum(inertias[joint], twists[joint])
        kinetic = kinetic + regressive_product(twists[joint], momentum) / 2
    kinetic = kinetic["1"]
    if chain.armature:
        kinetic = kinetic + total([exact(a) * v * v / 2 for a, v in zip(chain.armature, qd, strict=True)])
    masses, firsts = [inertia[0] for inertia in inertias], [list(inertia[1]) for inertia in inertias]
    potential: Any = 0
    for joint in reversed(range(chain.n_joints)):
        motion, parent = motions[joint], chain.parents[joint]
        turned, place = motion.rotated(firsts[joint]), motion.position(q[joint])
        first = [a + masses[joint] * b for a, b in zip(turned, place, strict=True)]
        if parent < 0:
            potential = potential - total([exact(g) * x for g, x in zip(chain.gravity, first, strict=True)])
        else:
            masses[parent] = masses[parent] + masses[joint]
            firsts[parent] = [a + b for a, b in zip(firsts[parent], first, strict=True)]
    return kinetic, potential


def lagrange_equations(chain: Chain, q: Sequence[Any], qd: Sequence[Any], qdd: Sequence[Any]) -> tuple[Any, ...]:
    """Forces of the joints as formulas: ``d/dt dT/dqd - dT/dq + dV/dq`` of the energies, for small chains.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q, qd, qdd : n symbols of sympy each
        Joint variables, their rates, and the rates of these.

    Returns
    -------
    n formulas
        The same as `inverse_dynamics`, which is how to compute them.
    """
    kinetic, potential = energies(chain, q, qd)
    forces = []
    for joint, rate in zip(q, qd, strict=True):
        momentum = kinetic.diff(rate)
        change = total([momentum.diff(x) * v + momentum.diff(v) * a for x, v, a in zip(q, qd, qdd, strict=True)])
        forces.append(change - kinetic.diff(joint) + (potential.diff(joint) if potential else 0))
    return tuple(forces)
