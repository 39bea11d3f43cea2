"""The constants of a robot as exact rationals: what its chain is, and what of its masses can be felt.

A robot is what `Chain` holds, all where every joint variable is 0, in the base frame. Frames are parallel to the base
there, one for each joint, with an origin on the joint's axis: most coordinates of the vectors between them vanish.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from hashlib import sha256

from .errors import SpecError

Number = float | Fraction
Vector = tuple[Fraction, Fraction, Fraction]
Inertia = tuple[Fraction, Vector, tuple[Vector, Vector, Vector]]
"""Mass, mass times centre, and the tensor about the origin."""

ZERO = (Fraction(0),) * 3


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


def signed(doc: str | None, chain: Chain) -> str:
    """The docstring of a spec with digests of the constants that its kernels are made from, for those who load them.

    A robot compares them with its own constants (`algorithms.kinematics.folded`, which has the same rule): rows of
    numbers rounded to 1e-10 of their unit, for tensors of the decade of their largest entry, where the text of a
    spec may differ from its source. They are computed from the chain, so that they are true of an edited spec as well.

    Parameters
    ----------
    doc : str or None
        What the spec says of itself.
    chain : Chain
    """
    count = chain.n_joints
    bodies = chain.inertias or ((0.0,) * 10,) * count
    parts: dict[str, list[Sequence[Number | str]]] = {
        "joints": [chain.kinds, chain.parents],
        "axes": list(chain.axes),
        "tool": [(chain.tip,), chain.tool],
        "bodies": [row for body in bodies for row in (body[:4], _in_its_decade(body[4:]))],
        "armature": [chain.armature or (0.0,) * count],
        "gravity": [chain.gravity],
    }
    lines = [f"    {name} {_digest(rows)}" for name, rows in parts.items()]
    return "\n".join(
        [(doc or "").rstrip(), "", "Digests of the constants, which a robot compares with its own:", *lines]
    )


def _in_its_decade(tensor: Sequence[Number]) -> list[Number]:
    decade = f"{max(abs(float(x)) for x in tensor):.9e}".partition("e")[2]
    return [float(x) / float(f"1e{decade}") for x in tensor]


def _digest(rows: Sequence[Sequence[Number | str]]) -> str:
    texts = [x if isinstance(x, str) else f"{round(float(x), 10) + 0.0:.10f}" for row in rows for x in row]
    return sha256(",".join(texts).encode()).hexdigest()[:12]


# Constants: exact rationals of the decimals given.


def exact(x: Number) -> Fraction:
    """The rational that a decimal says."""
    return x if isinstance(x, Fraction) else Fraction(repr(float(x)))


def _dot(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def plus(a: Vector, b: Vector, factor: Fraction | int = 1) -> Vector:
    """``a + factor b``."""
    x, y, z = (p + factor * q for p, q in zip(a, b, strict=True))
    return x, y, z


def rounded(x: Fraction) -> Fraction:
    """What sums of decimals leave behind is below their rounding."""
    return Fraction(round(x * 10**17), 10**17)


def directions_and_moments(chain: Chain) -> list[tuple[Vector, Vector]]:
    """Direction and moment of each joint's axis."""
    found: list[tuple[Vector, Vector]] = []
    for axis in chain.axes:
        e12, e13, e23, *m = map(exact, axis)
        found.append(((e23, -e13, e12), (m[0], m[1], m[2])))
    return found


def origins(chain: Chain) -> list[Vector]:
    """A point on each axis: the one nearest to the point of the joint before, so that offsets have few coordinates."""
    points: list[Vector] = []
    for (d, m), parent in zip(directions_and_moments(chain), chain.parents, strict=True):
        before = points[parent] if parent >= 0 else ZERO
        foot = plus(_cross(d, m), d, _dot(d, before))
        points.append((rounded(foot[0]), rounded(foot[1]), rounded(foot[2])))
    return points


def _about(inertia: Inertia, r: Vector) -> Inertia:
    """The same body about the point `r`."""
    mass, h, tensor = inertia
    # |p - r|² E - (p - r)(p - r)ᵀ, integrated
    shifted = plus(h, r, -mass)
    trace = mass * _dot(r, r) - 2 * _dot(r, h)
    rows = tuple(
        tuple(
            tensor[i][j] + (trace if i == j else 0) + h[i] * r[j] + r[i] * h[j] - mass * r[i] * r[j] for j in range(3)
        )
        for i in range(3)
    )
    return mass, shifted, rows  # type: ignore[return-value]


def _sum(a: Inertia, b: Inertia, sign: int = 1) -> Inertia:
    x, y, z = (plus(p, q, sign) for p, q in zip(a[2], b[2], strict=True))
    return a[0] + sign * b[0], plus(a[1], b[1], sign), (x, y, z)


def regrouped(chain: Chain, joints: Sequence[int] | None = None) -> list[Inertia]:
    """Inertias about the joints' origins, with what cannot be felt at a joint handed down to the one that carries it.

    A body of mass m with its centre on the axis of a turning joint, with equal moments about the other two axes and
    none about its own, does not change when the joint turns: whether it is carried by the joint or by the one before
    makes no difference (the base parameters of Gautier and Khalil, *IEEE Trans. Robotics Autom.* 6:368, 1990). A slide
    hands down its tensor. What reaches the base is felt nowhere.
    """
    frames = list(zip(directions_and_moments(chain), origins(chain), strict=True))
    found: list[Inertia] = []
    for numbers, (_, origin) in zip(chain.inertias, frames, strict=True):
        mass, *centre, xx, xy, xz, yy, yz, zz = map(exact, numbers)
        tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        x, y, z = (origin[k] - centre[k] for k in range(3))
        found.append(_about((mass, ZERO, tensor), (x, y, z)))
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
            carried = (Fraction(0), ZERO, tensor)
        found[joint] = _sum(found[joint], carried, -1)
        parent = chain.parents[joint]
        if parent >= 0:
            offset = plus(frames[parent][1], origin, -1)
            found[parent] = _sum(found[parent], _about(carried, offset))
    return [_clean(inertia) for inertia in found]


def _clean(inertia: Inertia) -> Inertia:
    mass, h, tensor = inertia
    x, y, z = (tuple(map(rounded, row)) for row in tensor)
    return rounded(mass), tuple(map(rounded, h)), (x, y, z)  # type: ignore[return-value]
