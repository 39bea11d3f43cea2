"""Inertias of the bodies of a chain, reduced to the parameters that affect the forces at its joints."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

from .chains import Chain, exact
from .frames import ZERO, Vector, directions_and_moments, dot, origins, plus, rounded

Inertia = tuple[Fraction, Vector, tuple[Vector, Vector, Vector]]
"""Mass, first moment (mass times centre of mass), and inertia tensor about the origin."""


def _about(inertia: Inertia, r: Vector) -> Inertia:
    """Return the inertia of the same body about the point `r`."""
    mass, h, tensor = inertia
    # |p - r|² E - (p - r)(p - r)ᵀ, integrated
    shifted = plus(h, r, -mass)
    trace = mass * dot(r, r) - 2 * dot(r, h)
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


def about_origins(chain: Chain) -> list[Inertia]:
    """Return the inertias of the bodies about the origins of their joint frames."""
    return [_clean(inertia) for inertia in _given(chain)]


def _given(chain: Chain) -> list[Inertia]:
    found: list[Inertia] = []
    for numbers, origin in zip(chain.inertias, origins(chain), strict=True):
        mass, *centre, xx, xy, xz, yy, yz, zz = map(exact, numbers)
        tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        x, y, z = (origin[k] - centre[k] for k in range(3))
        found.append(_about((mass, ZERO, tensor), (x, y, z)))
    return found


def base_parameters(chain: Chain) -> list[Inertia]:
    """Return the inertias about the origins of the joints, reduced to the parameters that affect their forces.

    The other parameters are moved to the parent of the joint.

    A body with its centre of mass on the axis of a revolute joint, no moment of inertia about this axis and equal
    moments about the two others is invariant under rotation of the joint. It gives the same forces whether it is
    carried by the joint or by its parent (the base parameters of Gautier and Khalil, *IEEE Trans. Robotics Autom.*
    6:368, 1990). For a prismatic joint, the whole tensor is moved to the parent. Parameters moved to the base affect no
    joint.
    """
    return list(_base_parameters(chain)[0])


def carried_by_base(chain: Chain) -> Inertia:
    """Return the inertia that `base_parameters` moves to the base, about the origin of the base."""
    return _base_parameters(chain)[1]


@lru_cache(maxsize=64)
def _base_parameters(chain: Chain) -> tuple[tuple[Inertia, ...], Inertia]:
    frames = list(zip(directions_and_moments(chain), origins(chain), strict=True))
    found, base = _given(chain), (Fraction(0), ZERO, (ZERO, ZERO, ZERO))
    for joint in reversed(range(chain.n_joints)):
        (d, _), origin = frames[joint]
        mass, h, tensor = found[joint]
        if chain.kinds[joint] == "revolute":
            along = dot(d, h)
            x, y, z = d
            # Any unit vector orthogonal to the axis is suitable; a coordinate axis gives a zero in the tensor.
            size, across = min((abs(c), k) for k, c in enumerate(d))
            unit = tuple(Fraction(int(k == across)) for k in range(3))
            level = dot(unit, [dot(row, unit) for row in tensor]) if size == 0 else Fraction(0)
            rows = tuple(tuple(level * ((i == j) - d[i] * d[j]) for j in range(3)) for i in range(3))
            carried: Inertia = (mass, (along * x, along * y, along * z), rows)  # type: ignore[assignment]
        else:
            # All parameters of a floating base affect its forces.
            carried = (Fraction(0), ZERO, tensor if chain.kinds[joint] == "prismatic" else (ZERO, ZERO, ZERO))
        found[joint] = _sum(found[joint], carried, -1)
        parent = chain.parents[joint]
        if parent >= 0:
            offset = plus(frames[parent][1], origin, -1)
            found[parent] = _sum(found[parent], _about(carried, offset))
        else:
            base = _sum(base, _about(carried, plus(ZERO, origin, -1)))
    return tuple(_clean(inertia) for inertia in found), _clean(base)


def _clean(inertia: Inertia) -> Inertia:
    mass, h, tensor = inertia
    x, y, z = (tuple(map(rounded, row)) for row in tensor)
    return rounded(mass), tuple(map(rounded, h)), (x, y, z)  # type: ignore[return-value]
