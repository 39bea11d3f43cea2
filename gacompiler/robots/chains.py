"""The constants of a robot, and digests that identify the robot for which kernels were generated.

All quantities in a `Chain` are given in the base frame, with every joint variable equal to 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from hashlib import sha256

from ..errors import SpecError

Number = float | Fraction
FREEDOMS = 6
"""The number of rates of a floating base."""


@dataclass(frozen=True, slots=True)
class Chain:
    """The constants of a robot, a chain or a tree of joints.

    Floating-point numbers stand for the exact decimal numbers that they print as.

    Attributes
    ----------
    kinds : tuple of str
        The kind of each joint, "revolute" or "prismatic". A joint comes after its parent. Joint 0 may be "floating":
        the base, which carries all others and whose axis is not used.
    parents : tuple of int
        The parent of each joint, the joint that carries it, or -1 for the base.
    axes : tuple of 6-tuples
        The axes of the joints as unit lines: e12, e13, e23, e01, e02, e03.
    tip : int
        The joint that carries the end effector.
    tool : 8-tuple
        The motor of the end effector: 1, e12, e13, e23, e01, e02, e03, e0123.
    inertias : tuple of 10-tuples, optional
        The inertia of the body carried by each joint: mass, centre of mass x y z, and the components xx, xy, xz, yy,
        yz, zz of the inertia tensor about the centre of mass.
    gravity : 3-tuple, optional
        Acceleration of free fall.
    armature : tuple, optional
        Reflected rotor inertia of each joint, in kg m² (kg for a prismatic joint). It is added to the diagonal of the
        mass matrix.
    variables : tuple of int, optional
        The variable of each joint, if several joints depend on the same variable: ``x = ratio q[variable] + offset``.
        They are counted as the rates, of which a floating base has the first six.
    ratios, offsets : tuple, optional
        The ratio and the offset of each joint, required with `variables`.
    home : tuple of 8-tuples, optional
        The motor of the frame carried by each joint when all variables are 0, needed by `forward_all`.
    """

    kinds: tuple[str, ...]
    parents: tuple[int, ...]
    axes: tuple[tuple[Number, ...], ...]
    tip: int
    tool: tuple[Number, ...]
    inertias: tuple[tuple[Number, ...], ...] = ()
    gravity: tuple[Number, ...] = (0.0, 0.0, -9.81)
    armature: tuple[Number, ...] = ()
    variables: tuple[int, ...] = ()
    ratios: tuple[Number, ...] = ()
    offsets: tuple[Number, ...] = ()
    home: tuple[tuple[Number, ...], ...] = ()

    def __post_init__(self) -> None:
        n = len(self.kinds)
        for name, found, wanted in (
            ("parents", len(self.parents), (n,)),
            ("axes", len(self.axes), (n,)),
            ("inertias", len(self.inertias), (0, n)),
            ("armature", len(self.armature), (0, n)),
            ("variables", len(self.variables), (0, n)),
            ("ratios", len(self.ratios), (len(self.variables),)),
            ("offsets", len(self.offsets), (len(self.variables),)),
            ("home", len(self.home), (0, n)),
        ):
            if found not in wanted:
                raise SpecError("Chain()", f"{found} {name} for {n} joints", "one for each joint")
        for joint, (kind, parent) in enumerate(zip(self.kinds, self.parents, strict=True)):
            if kind not in ("revolute", "prismatic") and (kind, joint) != ("floating", 0):
                raise SpecError(f"Chain(): joint {joint}", f"kind {kind!r}", "'revolute' or 'prismatic'")
            if not -1 <= parent < joint:
                raise SpecError(f"Chain(): joint {joint}", f"parent {parent}", "an earlier joint, or -1 for the base")
            if self.is_floating and joint and parent < 0:
                raise SpecError(f"Chain(): joint {joint}", "parent -1", "an earlier joint, since the base floats")

    @property
    def n_joints(self) -> int:
        """The number of joints."""
        return len(self.kinds)

    @property
    def n_variables(self) -> int:
        """The number of rates, which is less than the number of joints if joints share variables."""
        if self.variables:
            return max(self.variables) + 1
        return len(self.kinds) + (FREEDOMS - 1 if self.is_floating else 0)

    @property
    def n_positions(self) -> int:
        """The number of variables. A floating base has a motor, which is two numbers more than its rates."""
        return self.n_variables + (2 if self.is_floating else 0)

    @property
    def is_floating(self) -> bool:
        """Whether joint 0 is a floating base."""
        return self.kinds[:1] == ("floating",)

    @property
    def followed(self) -> tuple[Sequence[int], Sequence[Fraction], Sequence[Fraction]]:
        """The variable, counted as the rates, the ratio and the offset of each joint; 0 for a floating base."""
        n = len(self.kinds)
        if not self.variables and self.is_floating:
            own = (0, *range(FREEDOMS, FREEDOMS + n - 1))
            return own, (Fraction(0), *(Fraction(1),) * (n - 1)), (Fraction(0),) * n
        if not self.variables:
            return range(n), (Fraction(1),) * n, (Fraction(0),) * n
        return self.variables, tuple(map(exact, self.ratios)), tuple(map(exact, self.offsets))


def signed(doc: str | None, chain: Chain) -> str:
    """Return the docstring of a spec, with digests of the constants that are folded into its kernels.

    `algorithms.kinematics.folded` computes the digests of a robot by the same rule and compares them. Numbers are
    rounded to 1e-10 of their unit, and inertia tensors to 1e-10 of the decade of their largest entry, since the text of
    a spec may differ from its source by rounding. The digests are computed from the chain, so that they are also
    correct for an edited spec.

    Parameters
    ----------
    doc : str or None
        The docstring of the spec itself.
    chain : Chain
    """
    count = chain.n_joints
    bodies = chain.inertias or ((0.0,) * 10,) * count
    coupled = bool(chain.variables)
    parts: dict[str, list[Sequence[Number | str]]] = {
        "joints": [chain.kinds, chain.parents, *((chain.variables, chain.ratios, chain.offsets) if coupled else ())],
        "axes": list(chain.axes),
        "tool": [(chain.tip,), chain.tool],
        "bodies": [row for body in bodies for row in (body[:4], _in_its_decade(body[4:]))],
        "armature": [chain.armature or (0.0,) * count],
        "gravity": [chain.gravity],
        **({"home": list(chain.home)} if chain.home else {}),
    }
    lines = [f"    {name} {_digest(rows)}" for name, rows in parts.items()]
    return "\n".join(
        [(doc or "").rstrip(), "", "Digests of the constants, for comparison with those of a robot:", *lines]
    )


def _in_its_decade(tensor: Sequence[Number]) -> list[Number]:
    decade = f"{max(abs(float(x)) for x in tensor):.9e}".partition("e")[2]
    return [float(x) / float(f"1e{decade}") for x in tensor]


def _digest(rows: Sequence[Sequence[Number | str]]) -> str:
    texts = [x if isinstance(x, str) else f"{round(float(x), 10) + 0.0:.10f}" for row in rows for x in row]
    return sha256(",".join(texts).encode()).hexdigest()[:12]


def exact(x: Number) -> Fraction:
    """Return the exact rational value of the decimal number that `x` prints as."""
    return x if isinstance(x, Fraction) else Fraction(repr(float(x)))
