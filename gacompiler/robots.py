"""Kinematics and dynamics of one robot as expressions: the constants of its chain are numbers, and fold away.

A robot is what `Chain` holds, all where every joint variable is 0, in the base frame. Recursions run in frames that are
parallel to the base there, one for each joint, with an origin on the joint's axis: the constants between them are
vectors, and most of their coordinates vanish. Twists and wrenches are lines of G(3,0,1): ``w x p + v`` is the twist
with direction `w` and moment `v`; a force `f` that acts at `p` is the line through `p` along `f`. Their regressive
product is a power.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from math import floor, log10
from operator import add
from textwrap import wrap
from typing import Any

from .algebra.catalog import PGA3
from .algebra.multivector import Multivector
from .errors import SpecError
from .frontend.expression import lift
from .frontend.operations import assemble, commutator, cos, regressive_product, sin

Number = float | Fraction
Vector = tuple[Fraction, Fraction, Fraction]
Inertia = tuple[Fraction, Vector, tuple[Vector, Vector, Vector]]
"""Mass, mass times centre, and the tensor about the origin."""

_ZERO = (Fraction(0),) * 3
_LINE = ("e12", "e13", "e23", "e01", "e02", "e03")
_MOTOR = ("1", *_LINE, "e0123")


@dataclass(frozen=True, slots=True)
class Chain:
    """The constants of a robot, a chain or a tree of joints. Numbers are taken as the decimals that they print as.

    Attributes
    ----------
    kinds : tuple of str
        "revolute" or "prismatic", one for each joint; a joint comes after the one that carries it.
    parents : tuple of int
        The joint that carries each joint, or -1 for the base.
    axes : tuple of 6-tuples
        Unit lines of the joints: e12, e13, e23, e01, e02, e03.
    tip : int
        The joint that carries the end effector.
    tool : 8-tuple
        The motor of the end effector: 1, e12, e13, e23, e01, e02, e03, e0123.
    inertias : tuple of 10-tuples, optional
        Of what each joint carries: mass, centre x y z, and xx, xy, xz, yy, yz, zz of the tensor about the centre.
    gravity : 3-tuple, optional
        Acceleration of free fall.
    armature : tuple, optional
        Inertia of each rotor seen at its joint, kg m² (kg for a slide): it adds to the diagonal of the mass matrix.
    """

    kinds: tuple[str, ...]
    parents: tuple[int, ...]
    axes: tuple[tuple[Number, ...], ...]
    tip: int
    tool: tuple[Number, ...]
    inertias: tuple[tuple[Number, ...], ...] = ()
    gravity: tuple[Number, ...] = (0.0, 0.0, -9.81)
    armature: tuple[Number, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.kinds)
        for name, found, wanted in (
            ("parents", len(self.parents), (n,)),
            ("axes", len(self.axes), (n,)),
            ("inertias", len(self.inertias), (0, n)),
            ("armature", len(self.armature), (0, n)),
        ):
            if found not in wanted:
                raise SpecError("Chain()", f"{found} {name} for {n} joints", "one for each joint")
        for joint, (kind, parent) in enumerate(zip(self.kinds, self.parents, strict=True)):
            if kind not in ("revolute", "prismatic"):
                raise SpecError(f"Chain(): joint {joint}", f"kind {kind!r}", "'revolute' or 'prismatic'")
            if not -1 <= parent < joint:
                raise SpecError(f"Chain(): joint {joint}", f"parent {parent}", "an earlier joint, or -1 for the base")

    @property
    def n_joints(self) -> int:
        """The number of joints."""
        return len(self.kinds)


# Constants: exact rationals of the decimals given.


def _exact(x: Number) -> Fraction:
    return x if isinstance(x, Fraction) else Fraction(repr(float(x)))


def _dot(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _plus(a: Vector, b: Vector, factor: Fraction | int = 1) -> Vector:
    x, y, z = (p + factor * q for p, q in zip(a, b, strict=True))
    return x, y, z


def _rounded(x: Fraction) -> Fraction:
    """What sums of decimals leave behind is below their rounding."""
    return Fraction(round(x * 10**17), 10**17)


def _line(d: Vector, m: Vector) -> Multivector:
    return PGA3.multivector(dict(zip(_LINE, (d[2], -d[1], d[0], *m), strict=True)))


def _directions_and_moments(chain: Chain) -> list[tuple[Vector, Vector]]:
    found: list[tuple[Vector, Vector]] = []
    for axis in chain.axes:
        e12, e13, e23, *m = map(_exact, axis)
        found.append(((e23, -e13, e12), (m[0], m[1], m[2])))
    return found


def _origins(chain: Chain) -> list[Vector]:
    """A point on each axis: the one nearest to the point of the joint before, so that offsets have few coordinates."""
    points: list[Vector] = []
    for (d, m), parent in zip(_directions_and_moments(chain), chain.parents, strict=True):
        before = points[parent] if parent >= 0 else _ZERO
        foot = _plus(_cross(d, m), d, _dot(d, before))
        points.append((_rounded(foot[0]), _rounded(foot[1]), _rounded(foot[2])))
    return points


def _about(inertia: Inertia, r: Vector) -> Inertia:
    """The same body about the point `r`."""
    mass, h, tensor = inertia
    # |p - r|² E - (p - r)(p - r)ᵀ, integrated
    shifted = _plus(h, r, -mass)
    trace = mass * _dot(r, r) - 2 * _dot(r, h)
    rows = tuple(
        tuple(
            tensor[i][j] + (trace if i == j else 0) + h[i] * r[j] + r[i] * h[j] - mass * r[i] * r[j] for j in range(3)
        )
        for i in range(3)
    )
    return mass, shifted, rows  # type: ignore[return-value]


def _sum(a: Inertia, b: Inertia, sign: int = 1) -> Inertia:
    x, y, z = (_plus(p, q, sign) for p, q in zip(a[2], b[2], strict=True))
    return a[0] + sign * b[0], _plus(a[1], b[1], sign), (x, y, z)


def regrouped(chain: Chain, joints: Sequence[int] | None = None) -> list[Inertia]:
    """Inertias about the joints' origins, with what cannot be felt at a joint handed down to the one that carries it.

    A body of mass m with its centre on the axis of a turning joint, with equal moments about the other two axes and
    none about its own, does not change when the joint turns: whether it is carried by the joint or by the one before
    makes no difference (the base parameters of Gautier and Khalil, *IEEE Trans. Robotics Autom.* 6:368, 1990). A slide
    hands down its tensor. What reaches the base is felt nowhere.
    """
    frames = list(zip(_directions_and_moments(chain), _origins(chain), strict=True))
    found: list[Inertia] = []
    for numbers, (_, origin) in zip(chain.inertias, frames, strict=True):
        mass, *centre, xx, xy, xz, yy, yz, zz = map(_exact, numbers)
        tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        x, y, z = (origin[k] - centre[k] for k in range(3))
        found.append(_about((mass, _ZERO, tensor), (x, y, z)))
    for joint in reversed(range(chain.n_joints)):
        (d, _), origin = frames[joint]
        mass, h, tensor = found[joint]
        if chain.kinds[joint] == "revolute":
            along = _dot(d, h)
            x, y, z = d
            # any unit vector across the axis will do; one along a coordinate axis leaves a zero there
            size, across = min((abs(c), k) for k, c in enumerate(d))
            unit = tuple(Fraction(int(k == across)) for k in range(3))
            level = _dot(unit, [_dot(row, unit) for row in tensor]) if size == 0 else Fraction(0)
            rows = tuple(tuple(level * ((i == j) - d[i] * d[j]) for j in range(3)) for i in range(3))
            carried: Inertia = (mass, (along * x, along * y, along * z), rows)  # type: ignore[assignment]
        else:
            carried = (Fraction(0), _ZERO, tensor)
        found[joint] = _sum(found[joint], carried, -1)
        parent = chain.parents[joint]
        if parent >= 0:
            offset = _plus(frames[parent][1], origin, -1)
            found[parent] = _sum(found[parent], _about(carried, offset))
    return [_clean(inertia) for inertia in found]


def _clean(inertia: Inertia) -> Inertia:
    mass, h, tensor = inertia
    x, y, z = (tuple(map(_rounded, row)) for row in tensor)
    return _rounded(mass), tuple(map(_rounded, h)), (x, y, z)  # type: ignore[return-value]


# Expressions.


def _turned(x: Any, axis: Multivector, c: Any, s: Any) -> Any:
    """A line turned about an axis through the origin, by an angle with cosine `c` and sine `s`."""
    across = commutator(commutator(axis, x), axis)
    return (x - across) + c * across + s * commutator(x, axis)


class _Motion:
    """What one joint does: from its own frame to the frame of the joint that carries it, and back."""

    def __init__(self, kind: str, d: Vector, offset: Vector, q: Any) -> None:
        self.slides = kind == "prismatic"
        self.direction, self.offset = d, offset
        self.twist = _line(_ZERO, d) if self.slides else _line(d, _ZERO)
        self._axis, self._shift = _line(d, _ZERO), _line(_ZERO, offset)
        self._slide = None
        if self.slides:
            self._slide = q * _line(_ZERO, d)
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
    origins = _origins(chain)
    found = []
    for joint, ((d, _), parent) in enumerate(zip(_directions_and_moments(chain), chain.parents, strict=True)):
        offset = _plus(origins[joint], origins[parent] if parent >= 0 else _ZERO, -1)
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
    lines = _directions_and_moments(chain)
    product: Any = None
    for joint in _path(chain):
        d, m = lines[joint]
        half = q[joint] / 2
        motion = (
            1 - half * _line(_ZERO, d) if chain.kinds[joint] == "prismatic" else cos(half) - sin(half) * _line(d, m)
        )
        product = motion if product is None else product * motion
    tool = PGA3.multivector(dict(zip(_MOTOR, map(_exact, chain.tool), strict=True)))
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
    motions, origins = _motions(chain, q), _origins(chain)
    # images of the three coordinate directions, and the origin, of each joint's frame
    columns: list[tuple[Any, ...]] = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    position: tuple[Any, ...] = _ZERO
    found: dict[int, tuple[Any, tuple[Any, ...]]] = {}

    def moved(v: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(_total([v[k] * columns[k][i] for k in range(3)]) for i in range(3))

    for joint in _path(chain):
        motion = motions[joint]
        offset = moved(motion.position(q[joint]))
        position = tuple(a + b for a, b in zip(position, offset, strict=True))
        found[joint] = (moved(motion.direction), position)
        columns = [moved(motion.turned([int(k == i) for i in range(3)])) for k in range(3)]
    tip = moved(_plus(_tool_position(chain), origins[chain.tip], -1)) if found else _ZERO
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
    tool = PGA3.multivector(dict(zip(_MOTOR, map(_exact, chain.tool), strict=True)))
    point = tool * PGA3.multivector({"e123": 1}) * ~tool
    x, y, z = (_rounded(Fraction(point[name] / point["e123"])) for name in ("e032", "e013", "e021"))
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
    free_fall = _line(_ZERO, tuple(-_exact(g) for g in chain.gravity))  # type: ignore[arg-type]
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
            torques[joint] = torques[joint] + _exact(chain.armature[joint]) * qdd[joint]
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
            result[joint][joint] = result[joint][joint] + _exact(chain.armature[joint])
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


# The text of a spec.


def spec_text(name: str, chain: Chain, source: str) -> str:
    """A spec of one robot: its constants, and the kernels that they fold into.

    Parameters
    ----------
    name : str
        What readers call it.
    chain : Chain
        Numbers that are within 5e-11 (of their unit; for tensors, of their largest entry) of one with six decimals
        become that: quarter turns are written with eleven digits in many files, and their cosines are meant to vanish.
    source : str
        Where the numbers are from, a sentence or two.
    """
    parts = [
        _literal("kinds", [f'"{kind}"' for kind in chain.kinds]),
        _literal("parents", list(map(repr, chain.parents))),
        _rows("axes", [tuple(map(_nice, row)) for row in chain.axes]),
        f"    tip={chain.tip},\n",
        _literal("tool", [repr(_nice(x)) for x in chain.tool]),
        _rows("inertias", [_nice_body(row) for row in chain.inertias]) if chain.inertias else "",
        _literal("gravity", [repr(float(x)) for x in chain.gravity]),
        _literal("armature", [repr(_nice(x)) for x in chain.armature]) if any(map(_exact, chain.armature)) else "",
    ]
    own = "\n".join(
        (
            f'"""{name}: kinematics and dynamics with its constants folded.',
            "",
            *wrap(source, 118),
            "",
            "Joint variables are radians, or metres where a joint slides.",
            '"""',
            "",
            "from gacompiler import SCALAR, array, kernel, robots",
            "from gacompiler.algebra.catalog import PGA3",
            "",
            "ROBOT = robots.Chain(",
            f"{''.join(parts)})",
            f"JOINTS = array(SCALAR, {chain.n_joints})",
            "",
        )
    )
    return own + _FORWARD + (_DYNAMICS if chain.inertias else "")


_FORWARD = '''

@kernel(q=JOINTS, returns=PGA3.MOTOR)
def forward(q):
    """Where the end effector is: the unit motor from its frame to the base frame."""
    return robots.forward(ROBOT, q)


@kernel(q=JOINTS, returns=array(SCALAR, 6, ROBOT.n_joints))
def jacobian(q):
    """Angular over linear velocity of the end effector by the rates of the joints, in the base frame."""
    return robots.jacobian(ROBOT, q)
'''
_DYNAMICS = '''

@kernel(q=JOINTS, qd=JOINTS, qdd=JOINTS, returns=JOINTS)
def inverse_dynamics(q, qd, qdd):
    """Forces and torques of the joints that give accelerations, gravity included."""
    return robots.inverse_dynamics(ROBOT, q, qd, qdd)


@kernel(q=JOINTS, returns=array(SCALAR, ROBOT.n_joints, ROBOT.n_joints))
def mass_matrix(q):
    """The symmetric matrix of the kinetic energy."""
    return robots.mass_matrix(ROBOT, q)
'''


def _literal(name: str, entries: Sequence[str], indent: int = 4) -> str:
    """A tuple on one line where it fits, else one entry a line, as formatters have it."""
    head, space = (f"{name}=" if name else ""), " " * indent
    line = f"{space}{head}({', '.join(entries)}{',' if len(entries) == 1 else ''}),\n"
    if len(line) <= 121:
        return line
    return "".join([f"{space}{head}(\n", *(f"{space}    {entry},\n" for entry in entries), f"{space}),\n"])


def _rows(name: str, rows: Sequence[tuple[Number, ...]]) -> str:
    return "".join([f"    {name}=(\n", *(_literal("", list(map(repr, row)), 8) for row in rows), "    ),\n"])


def _nice(x: Number, unit: float = 1.0) -> float:
    near = round(float(x) / unit, 6) * unit
    near = round(near, 6 - floor(log10(unit)))
    return (near if abs(float(x) - near) <= 5e-11 * unit else float(x)) + 0.0


def _nice_body(row: tuple[Number, ...]) -> tuple[float, ...]:
    largest = max(map(abs, map(float, row[4:])))
    unit = 10.0 ** floor(log10(largest)) if largest else 1.0
    return (float(row[0]), *map(_nice, row[1:4]), *(_nice(x, unit) for x in row[4:]))
