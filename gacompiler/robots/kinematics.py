"""Forward kinematics and Jacobian of one robot as expressions: the constants of its `Chain` are numbers, and fold."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from ..algebra.catalog import PGA3
from ..algebra.multivector import Multivector
from ..errors import SpecError
from ..frontend.operations import cos, sin
from .chains import Chain, exact
from .frames import ZERO, Vector, cross, directions_and_moments, origins, plus, rounded
from .motions import LINE, line_of, motions_of, total

_MOTOR = ("1", *LINE, "e0123")
_E12, _E23, _E01, _E03 = (PGA3.multivector({name: 1}) for name in ("e12", "e23", "e01", "e03"))


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
        if chain.kinds[joint] == "prismatic":
            motion = 1 - half * line_of(ZERO, d)
        else:
            motion = cos(half) - sin(half) * line_of(d, m)
        product = motion if product is None else product * motion
    tool = _tool(chain)
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
    motions = motions_of(chain, q)
    # images of the three coordinate directions, and the origin, of each joint's frame
    columns: list[tuple[Any, ...]] = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    position: tuple[Any, ...] = ZERO
    found: dict[int, tuple[Any, tuple[Any, ...]]] = {}

    def moved(v: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(total([v[k] * columns[k][i] for k in range(3)]) for i in range(3))

    for joint in _path(chain):
        motion = motions[joint]
        offset = moved(motion.position(q[joint]))
        position = tuple(a + b for a, b in zip(position, offset, strict=True))
        found[joint] = (moved(motion.direction), position)
        columns = [moved(motion.rotated([int(k == i) for i in range(3)])) for k in range(3)]
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
            result.append((*axis, *cross(axis, [a - b for a, b in zip(position, point, strict=True)])))
    return tuple(zip(*result, strict=True))


def _tool(chain: Chain) -> Multivector:
    return PGA3.multivector(dict(zip(_MOTOR, map(exact, chain.tool), strict=True)))


def _tool_position(chain: Chain) -> Vector:
    tool = _tool(chain)
    point = tool * PGA3.multivector({"e123": 1}) * ~tool
    x, y, z = (rounded(Fraction(point[name] / point["e123"])) for name in ("e032", "e013", "e021"))
    return x, y, z
