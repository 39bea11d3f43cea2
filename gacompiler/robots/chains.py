"""The constants of a robot, and the digests by which a robot recognises kernels that were made from them.

Everything in a `Chain` holds where every joint variable is 0, in the base frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from hashlib import sha256

from ..errors import SpecError

Number = float | Fraction


@dataclass(frozen=True, slots=True)
class Chain:
    """The constants of a robot, a chain or a tree of joints. Numbers are taken as the decimals that they print as.

    Attributes
    ----------
    kinds : tuple of str
        "revolute" or "prismatic", one for each joint; a joint comes after its parent.
    parents : tuple of int
        The joint that carries each joint (its parent), or -1 for the base.
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
    variables : tuple of int, optional
        The variable that each joint follows, where joints share some: ``x = ratio q[variable] + offset``.
    ratios, offsets : tuple, optional
        One for each joint, with `variables`.
    home : tuple of 8-tuples, optional
        The motor of the frame that each joint carries, where all variables are 0, for `forward_all`.
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
            if kind not in ("revolute", "prismatic"):
                raise SpecError(f"Chain(): joint {joint}", f"kind {kind!r}", "'revolute' or 'prismatic'")
            if not -1 <= parent < joint:
                raise SpecError(f"Chain(): joint {joint}", f"parent {parent}", "an earlier joint, or -1 for the base")

    @property
    def n_joints(self) -> int:
        """The number of joints."""
        return len(self.kinds)

    @property
    def n_variables(self) -> int:
        """The number of variables, of which joints that follow others have none of their own."""
        return max(self.variables) + 1 if self.variables else len(self.kinds)

    @property
    def followed(self) -> tuple[Sequence[int], Sequence[Fraction], Sequence[Fraction]]:
        """The variable that each joint follows, the ratio and the offset."""
        n = len(self.kinds)
        if not self.variables:
            return range(n), (Fraction(1),) * n, (Fraction(0),) * n
        return self.variables, tuple(map(exact, self.ratios)), tuple(map(exact, self.offsets))


def signed(doc: str | None, chain: Chain) -> str:
    """The docstring of a spec with digests of the constants that its kernels are made from.

    A robot compares them with its own constants (`algorithms.kinematics.folded`, which has the same rule): rows of
    numbers rounded to 1e-10 of their unit, for tensors of the decade of their largest entry, where the text of a
    spec may differ from its source. They are computed from the chain, so that they are true of an edited spec as well.

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
        [(doc or "").rstrip(), "", "Digests of the constants, which a robot compares with its own:", *lines]
    )


def _in_its_decade(tensor: Sequence[Number]) -> list[Number]:
    decade = f"{max(abs(float(x)) for x in tensor):.9e}".partition("e")[2]
    return [float(x) / float(f"1e{decade}") for x in tensor]


def _digest(rows: Sequence[Sequence[Number | str]]) -> str:
    texts = [x if isinstance(x, str) else f"{round(float(x), 10) + 0.0:.10f}" for row in rows for x in row]
    return sha256(",".join(texts).encode()).hexdigest()[:12]


def exact(x: Number) -> Fraction:
    """The rational with the value of the decimal that the number prints as."""
    return x if isinstance(x, Fraction) else Fraction(repr(float(x)))
