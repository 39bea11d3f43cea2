"""Tables of one robot, in exact numbers, for the loop kernels of `gacompiler.specs.robots`."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from ..algebra.catalog import PGA3
from ..algebra.multivector import Multivector
from .chains import FREEDOMS, Chain, exact
from .frames import LENGTHS, ZERO, Vector, directions_and_moments, line_of, origins, plus, rounded
from .inertias import Inertia

Tables = dict[str, Any]

MOTOR = ("1", "e12", "e13", "e23", "e01", "e02", "e03", "e0123")
"""The coefficients of a motor."""
_ONE, _NONE = Fraction(1), Fraction(0)
_AXES = (_ONE, _NONE, _NONE), (_NONE, _ONE, _NONE), (_NONE, _NONE, _ONE)
_UNITS = [(axis, ZERO) for axis in _AXES] + [(ZERO, axis) for axis in _AXES]
"""The directions and moments of the twists of a floating base at unit rates."""


def tables_of_joints(chain: Chain, joints: Sequence[int] | None = None) -> Tables:
    """Return the tables of all joints, or of the given joints, each of which carries the next."""
    points, lines = origins(chain), directions_and_moments(chain)
    taken = range(chain.n_joints) if joints is None else joints
    variables, ratios, offsets = chain.followed
    shift = chain.n_positions - chain.n_variables
    rows = {
        "variables": [variables[k] + shift for k in taken],
        "coordinates": [variables[k] for k in taken],
        "ratios": [ratios[k] for k in taken],
        "offsets": [offsets[k] for k in taken],
        "places": [plus(points[k], points[p] if p >= 0 else ZERO, -1) for k, p in _with_parents(chain, taken)],
        "screws": [_screw(chain.kinds[k], lines[k][0]) for k in taken],
        "turns": [int(chain.kinds[k] == "revolute") for k in taken],
    }
    rates = {"rates": [0] * chain.n_variables}
    return rows | _tables_of_base(chain) | rates | ({"parents": list(chain.parents)} if joints is None else {})


def _screw(kind: str, direction: Vector) -> Multivector:
    """Return the twist of a joint at unit speed, 0 for a floating base."""
    if kind == "revolute":
        return line_of(direction, ZERO)
    return line_of(ZERO, direction if kind == "prismatic" else ZERO)


def _tables_of_base(chain: Chain) -> Tables:
    """Return the tables of a floating base, without rows if the base is fixed."""
    count, freedoms = int(chain.is_floating), list(range(FREEDOMS))
    moved = list(range(1, chain.n_joints)) * count
    return {
        "base": [list(range(len(MOTOR)))] * count,
        "freedoms": [freedoms] * count,
        "trunk": [0] * count,
        "units": [line_of(*twist) for twist in _UNITS] * count,
        "unit_freedoms": freedoms * count,
        "own_freedoms": [freedoms] * count * FREEDOMS,
        "moved": moved,
        "moved_coordinates": [chain.followed[0][joint] for joint in moved],
        "moved_freedoms": [freedoms] * len(moved),
    }


def _with_parents(chain: Chain, joints: Sequence[int]) -> list[tuple[int, int]]:
    return [(joint, chain.parents[joint]) for joint in joints]


def rows_of(inertias: Sequence[Inertia]) -> list[tuple[Any, ...]]:
    """Return inertias as rows of a table: mass, first moment and inertia tensor."""
    return [(mass, *h, *(t[i][j] for i in range(3) for j in range(i, 3))) for mass, h, t in inertias]


def tables_of_pairs(chain: Chain) -> Tables:
    """Return the tables of pairs of each joint with itself and with every joint that carries it."""
    first = int(chain.is_floating)
    pairs = [(joint, carrier) for joint in range(first, chain.n_joints) for carrier in path_to(chain, joint)[first:]]
    variables = chain.followed[0]
    return {
        "lower": [lower for lower, _ in pairs],
        "upper": [upper for _, upper in pairs],
        "lower_coordinates": [variables[lower] for lower, _ in pairs],
        "upper_coordinates": [variables[upper] for _, upper in pairs],
        "is_strict": [int(lower != upper) for lower, upper in pairs],
    }


def path_to(chain: Chain, joint: int) -> list[int]:
    """Return the joints on the path from the base to a joint, which is the last."""
    found = []
    while joint >= 0:
        found.append(joint)
        joint = chain.parents[joint]
    return found[::-1]


def motor_of(numbers: Sequence[Any]) -> Multivector:
    """Return the motor with eight given coefficients."""
    return PGA3.multivector(dict(zip(MOTOR, map(exact, numbers), strict=True)))


def rotor_and_place(motor: Multivector, origin: Vector) -> tuple[Multivector, Vector]:
    """Return the rotor of a frame in the home position, and its origin relative to another origin."""
    point = motor * PGA3.multivector({"e123": 1}) * ~motor
    found = [rounded(point[name] / point["e123"], LENGTHS) for name in ("e032", "e013", "e021")]
    rotor = PGA3.multivector({name: motor[name] for name in MOTOR[:4]})
    x, y, z = (rounded(a - b, LENGTHS) for a, b in zip(found, origin, strict=True))
    return rotor, (x, y, z)
