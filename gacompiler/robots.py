"""Kinematics and dynamics of one robot as expressions: the constants of its `Chain` are numbers, and fold away.

Twists and wrenches are lines of G(3,0,1): ``w x p + v`` is the twist with direction `w` and moment `v`; a force `f` at
`p` is the line through `p` along `f`. Their regressive product is a power.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import reduce
from operator import add
from typing import Any

from .algebra.catalog import PGA3
from .algebra.multivector import Multivector
from .errors import SpecError
from .frontend.expression import lift
from .frontend.operations import assemble, commutator, cos, regressive_product, sin
from .robot_chains import (
    ZERO,
    Chain,
    Inertia,
    Vector,
    directions_and_moments,
    exact,
    origins,
    plus,
    regrouped,
    rounded,
    signed,
)

__all__ = [
    "Chain",
    "energies",
    "forward",
    "inverse_dynamics",
    "jacobian",
    "lagrange_equations",
    "mass_matrix",
    "regrouped",
    "row_motor",
    "signed",
]

_LINE = ("e12", "e13", "e23", "e01", "e02", "e03")
_MOTOR = ("1", *_LINE, "e0123")


_E12, _E23, _E01, _E03 = (PGA3.multivector({name: 1}) for name in ("e12", "e23", "e01", "e03"))


def _line(d: Vector, m: Vector) -> Multivector:
    return PGA3.multivector(dict(zip(_LINE, (d[2], -d[1], d[0], *m), strict=True)))


def row_motor(theta: Any = 0, d: Any = 0, a: Any = 0, alpha: Any = 0, convention: str = "standard") -> Any:
    """The motor of a row of a Denavit-Hartenberg table; products of these are a robot in closed form.

    Parameters
    ----------
    theta, d, a, alpha : scalars
        Numbers, expressions in a kernel, or symbols of sympy: with these the motor, and what it moves, is a formula.
    convention : str
        "standard", or "modified" (Craig).

    Returns
    -------
    Expression or Multivector
    """
    if convention not in ("standard", "modified"):
        raise SpecError("row_motor()", f"convention {convention!r}", "'standard' or 'modified'")
    about_z = (1 - _E03 * (d / 2)) * (cos(theta / 2) - _E12 * sin(theta / 2))
    about_x = (1 - _E01 * (a / 2)) * (cos(alpha / 2) - _E23 * sin(alpha / 2))
    return about_z * about_x if convention == "standard" else about_x * about_z


def _turned(x: Any, axis: Multivector, c: Any, s: Any) -> Any:
    """A line turned about an axis through the origin, by an angle with cosine `c` and sine `s`."""
    across = commutator(commutator(axis, x), axis)
    return (x - across) + c * across + s * commutator(x, axis)


class _Motion:
    """What one joint does: from its own frame to the frame of the joint that carries it, and back."""

    def __init__(self, kind: str, d: Vector, offset: Vector, q: Any) -> None:
        self.slides = kind == "prismatic"
        self.direction, self.offset = d, offset
        self.twist = _line(ZERO, d) if self.slides else _line(d, ZERO)
        self._axis, self._shift = _line(d, ZERO), _line(ZERO, offset)
        self._slide = None
        if self.slides:
            self._slide = q * _line(ZERO, d)
        else:
            self._cosine, self._sine = cos(q), sin(q)

    def down(self, x: Any) -> Any:
        """A line of this frame in the frame before."""
        moved = x + commutator(x, self._slide) if self.slides else _turned(x, self._axis, self._cosine, self._sine)
        return moved + commutator(moved, self._shift)

    def up(self, x: Any) -> Any:
        """A line of the frame before in this frame."""
        x = x - commutator(x, self._shift)
        if self.slides:
            return x - commutator(x, self._slide)
        return _turned(x, self._axis, self._cosine, -self._sine)

    def turned(self, v: Sequence[Any]) -> tuple[Any, ...]:
        """A free vector of this frame in the frame before."""
        if self.slides:
            return tuple(v)
        return _parts(_turned(_assembled(v), self._axis, self._cosine, self._sine))[0]

    def position(self, q: Any) -> tuple[Any, ...]:
        """The origin of this frame in the frame before."""
        return (
            tuple(r + q * d for r, d in zip(self.offset, self.direction, strict=True)) if self.slides else self.offset
        )

    def tensor_down(self, t: dict[tuple[int, int], Any]) -> dict[tuple[int, int], Any]:
        """A symmetric tensor of this frame in the directions of the frame before; keys (i, j), i <= j."""
        if self.slides:
            return t
        if sorted(map(abs, self.direction)) != [0, 0, 1]:
            columns = [self.turned([t[min(i, j), max(i, j)] for i in range(3)]) for j in range(3)]
            rows = [self.turned([columns[j][i] for j in range(3)]) for i in range(3)]
            return {(i, j): rows[i][j] for i, j in t}
        # Across the axis a tensor is its trace and a vector that turns by twice the angle.
        k = next(k for k in range(3) if self.direction[k])
        i, j = (k + 1) % 3, (k + 2) % 3
        c, s = self._cosine, self.direction[k] * self._sine

        def entry(a: int, b: int) -> tuple[int, int]:
            return min(a, b), max(a, b)

        mean, half = (t[i, i] + t[j, j]) / 2, (t[i, i] - t[j, j]) / 2
        cc, ss = c * c - s * s, 2 * (c * s)
        turned, mixed = half * cc - t[entry(i, j)] * ss, half * ss + t[entry(i, j)] * cc
        return {
            (i, i): mean + turned,
            (j, j): mean - turned,
            (k, k): t[k, k],
            entry(i, j): mixed,
            entry(i, k): c * t[entry(i, k)] - s * t[entry(j, k)],
            entry(j, k): s * t[entry(i, k)] + c * t[entry(j, k)],
        }


def _motions(chain: Chain, q: Sequence[Any]) -> list[_Motion]:
    points = origins(chain)
    found = []
    for joint, ((d, _), parent) in enumerate(zip(directions_and_moments(chain), chain.parents, strict=True)):
        offset = plus(points[joint], points[parent] if parent >= 0 else ZERO, -1)
        found.append(_Motion(chain.kinds[joint], d, offset, q[joint]))
    return found


def _parts(line: Any) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Direction and moment of a line."""
    return (line["e23"], -line["e13"], line["e12"]), (line["e01"], line["e02"], line["e03"])


def _assembled(d: Sequence[Any], m: Sequence[Any] = (0, 0, 0)) -> Any:
    return assemble(PGA3, dict(zip(_LINE, (d[2], -d[1], d[0], *m), strict=True)))


def _total(terms: Sequence[Any]) -> Any:
    return reduce(add, terms) if terms else 0


def _times(a: Sequence[Any], b: Sequence[Any]) -> tuple[Any, ...]:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _path(chain: Chain) -> list[int]:
    """The joints from the base to the end effector."""
    found, joint = [], chain.tip
    while joint >= 0:
        found.append(joint)
        joint = chain.parents[joint]
    return found[::-1]


def forward(chain: Chain, q: Sequence[Any]) -> Any:
    """The motor of the end effector: the product of the joints' exponentials, times the tool.

    Parameters
    ----------
    chain : Chain
    q : n scalars

    Returns
    -------
    Expression
        An even element, a unit motor to the rounding of the constants.
    """
    lines = directions_and_moments(chain)
    product: Any = None
    for joint in _path(chain):
        d, m = lines[joint]
        half = q[joint] / 2
        motion = 1 - half * _line(ZERO, d) if chain.kinds[joint] == "prismatic" else cos(half) - sin(half) * _line(d, m)
        product = motion if product is None else product * motion
    tool = PGA3.multivector(dict(zip(_MOTOR, map(exact, chain.tool), strict=True)))
    return tool * (1 + 0 * q[0]) if product is None else product * tool


def jacobian(chain: Chain, q: Sequence[Any]) -> tuple[tuple[Any, ...], ...]:
    """The geometric Jacobian at the end effector: angular over linear velocity, in the base frame.

    Parameters
    ----------
    chain : Chain
    q : n scalars

    Returns
    -------
    6 rows of n scalars
    """
    motions = _motions(chain, q)
    # images of the three coordinate directions, and the origin, of each joint's frame
    columns: list[tuple[Any, ...]] = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    position: tuple[Any, ...] = ZERO
    found: dict[int, tuple[Any, tuple[Any, ...]]] = {}

    def moved(v: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(_total([v[k] * columns[k][i] for k in range(3)]) for i in range(3))

    for joint in _path(chain):
        motion = motions[joint]
        offset = moved(motion.position(q[joint]))
        position = tuple(a + b for a, b in zip(position, offset, strict=True))
        found[joint] = (moved(motion.direction), position)
        columns = [moved(motion.turned([int(k == i) for i in range(3)])) for k in range(3)]
    tip = moved(plus(_tool_position(chain), origins(chain)[chain.tip], -1)) if found else ZERO
    position = tuple(a + b for a, b in zip(position, tip, strict=True))
    result = []
    for joint in range(chain.n_joints):
        if joint not in found:
            result.append((0,) * 6)
            continue
        axis, point = found[joint]
        if chain.kinds[joint] == "prismatic":
            result.append((0, 0, 0, *axis))
        else:
            result.append((*axis, *_times(axis, [a - b for a, b in zip(position, point, strict=True)])))
    return tuple(zip(*result, strict=True))


def _tool_position(chain: Chain) -> Vector:
    tool = PGA3.multivector(dict(zip(_MOTOR, map(exact, chain.tool), strict=True)))
    point = tool * PGA3.multivector({"e123": 1}) * ~tool
    x, y, z = (rounded(Fraction(point[name] / point["e123"])) for name in ("e032", "e013", "e021"))
    return x, y, z


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
    motions, inertias = _motions(chain, q), regrouped(chain)
    free_fall = _line(ZERO, tuple(-exact(g) for g in chain.gravity))  # type: ignore[arg-type]
    twists: list[Any] = []
    rates: list[Any] = []
    wrenches: list[Any] = []
    for joint, motion in enumerate(motions):
        parent = chain.parents[joint]
        own = qd[joint] * motion.twist
        twist = own if parent < 0 else motion.up(twists[parent]) + own
        rate = motion.up(rates[parent] if parent >= 0 else free_fall) + qdd[joint] * motion.twist
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
            wrenches[parent] = wrenches[parent] + motion.down(wrenches[joint])
    return tuple(torques)


def _momentum(inertia: Inertia, twist: Any) -> Any:
    """The momentum of a body, a line like a wrench."""
    mass, h, tensor = inertia
    w, v = _parts(twist)
    linear = tuple(a + mass * b for a, b in zip(_times(w, h), v, strict=True))
    angular = tuple(
        _total([tensor[i][j] * w[j] for j in range(3)]) + b for i, b in zip(range(3), _times(h, v), strict=True)
    )
    return _assembled(linear, angular)


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
    motions, n = _motions(chain, q), chain.n_joints
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
                wrench = motions[other].down(wrench)
            entry = regressive_product(motions[ancestor].twist, wrench)
            result[joint][ancestor] = result[ancestor][joint] = entry
            other, ancestor = ancestor, chain.parents[ancestor]
        if chain.armature:
            result[joint][joint] = result[joint][joint] + exact(chain.armature[joint])
        if parent >= 0:
            turned_h, turned = motion.turned(h), motion.tensor_down(tensor)
            r = motion.position(q[joint])
            shifted = tuple(a + mass * b for a, b in zip(turned_h, r, strict=True))
            # about the other origin: h and r take part symmetrically through (h + h')/2
            middle = tuple((a + b) / 2 for a, b in zip(turned_h, shifted, strict=True))
            trace = 2 * _total([a * b for a, b in zip(r, middle, strict=True)])
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
    motions, inertias = _motions(chain, q), regrouped(chain)
    kinetic: Any = 0
    twists: list[Any] = []
    for joint, motion in enumerate(motions):
        parent, own = chain.parents[joint], qd[joint] * motion.twist
        twists.append(own if parent < 0 else motion.up(twists[parent]) + own)
        momentum = _momentum(inertias[joint], twists[joint])
        kinetic = kinetic + regressive_product(twists[joint], momentum) / 2
    kinetic = kinetic["1"]
    if chain.armature:
        kinetic = kinetic + _total([exact(a) * v * v / 2 for a, v in zip(chain.armature, qd, strict=True)])
    masses, firsts = [inertia[0] for inertia in inertias], [list(inertia[1]) for inertia in inertias]
    potential: Any = 0
    for joint in reversed(range(chain.n_joints)):
        motion, parent = motions[joint], chain.parents[joint]
        turned, place = motion.turned(firsts[joint]), motion.position(q[joint])
        first = [a + masses[joint] * b for a, b in zip(turned, place, strict=True)]
        if parent < 0:
            potential = potential - _total([exact(g) * x for g, x in zip(chain.gravity, first, strict=True)])
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
        change = _total([momentum.diff(x) * v + momentum.diff(v) * a for x, v, a in zip(q, qd, qdd, strict=True)])
        forces.append(change - kinetic.diff(joint) + (potential.diff(joint) if potential else 0))
    return tuple(forces)
