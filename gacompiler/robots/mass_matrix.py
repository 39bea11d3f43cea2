"""The mass matrix of one robot by the composite-rigid-body algorithm in joint frames (Walker and Orin 1982).

The kernel for a general robot, `gacompiler.specs.robots.mass_matrix`, expresses all bodies in the base frame, so that
momenta need not be transformed to the frames of other joints. With folded constants, transforming from frame to frame
is cheaper: most coordinates of axes and offsets are 0 in joint frames, and the result does not depend on the variable
of the first joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..algebra.multivector import Multivector
from ..frontend.expression import Expression, lift
from ..frontend.operations import cos, regressive_product, sin
from ..frontend.rows import Unrolled
from ..frontend.unrolled import columns_of
from ..specs import robots
from .chains import FREEDOMS, Chain, exact
from .exact_tables import Tables, rows_of, tables_of_joints
from .inertias import base_parameters

Rows = tuple[tuple[Any, ...], ...]

_spec: Any = robots  # specs have no types


def composite_bodies(chain: Chain, q: Sequence[Expression]) -> Rows:
    """Compute the symmetric mass matrix.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q : sequence of expressions
        The variables.

    Returns
    -------
    n rows of n scalars
    """
    tables, parents = tables_of_joints(chain), chain.parents
    variables, ratios, screws = tables["coordinates"], tables["ratios"], tables["screws"]
    poses = _poses(tables, q)
    bodies = rows_of(base_parameters(chain))
    found: list[list[Any]] = [[0] * chain.n_variables for _ in range(chain.n_variables)]
    for joint in reversed(range(chain.n_joints)):
        if chain.kinds[joint] == "floating":
            for column in range(FREEDOMS):
                momentum = _spec.momentum_of(bodies[joint], lift(_spec.freedom(column)))
                for row, power in enumerate(_spec.powers_of(momentum)):
                    found[row][column] = power
            break
        wrench = _spec.momentum_of(bodies[joint], lift(screws[joint]))
        upper, row = joint, variables[joint]
        while upper >= 0:
            if chain.kinds[upper] == "floating":
                for freedom, power in enumerate(_spec.powers_of(wrench)):
                    found[freedom][row] = found[freedom][row] + ratios[joint] * power
                    found[row][freedom] = found[row][freedom] + ratios[joint] * power
                break
            entry = ratios[joint] * ratios[upper] * regressive_product(screws[upper], wrench)["1"]
            column = variables[upper]
            found[row][column] = found[row][column] + entry
            if upper == joint:
                rotor = exact(chain.armature[joint]) if chain.armature else 0
                found[row][row] = found[row][row] + ratios[joint] * ratios[joint] * rotor
            else:
                found[column][row] = found[column][row] + entry
            if parents[upper] >= 0:
                wrench = _spec.to_parent(poses[upper], wrench)
            upper = parents[upper]
        carrier = parents[joint]
        if carrier >= 0:
            x = ratios[joint] * q[tables["variables"][joint]] + tables["offsets"][joint]
            moved = _moved(bodies[joint], poses[joint], screws[joint], x)
            bodies[carrier] = tuple(a + b for a, b in zip(bodies[carrier], moved, strict=True))
    return tuple(map(tuple, found))


def _poses(tables: Tables, q: Sequence[Expression]) -> list[Any]:
    """Return the pose of the frame of each joint in the frame of its parent."""
    variables = Unrolled(tuple(tables["variables"]))
    rows = [columns_of(tables[name]) for name in ("ratios", "offsets", "places", "screws", "turns")]
    rotors, places = _spec.own_poses(Unrolled(tuple(q)), variables, *rows)
    found = zip(rotors.elements, *(coordinate.elements for coordinate in places), strict=True)
    return [_spec.Pose(rotor, (x, y, z)) for rotor, x, y, z in found]


def _moved(body: tuple[Any, ...], pose: Any, screw: Multivector, x: Any) -> tuple[Any, ...]:
    """Transform the inertia of the body carried by a joint to the frame of its parent."""
    direction = [screw[name] for name in ("e23", "e31", "e12")]
    if sorted(map(abs, direction)) != [0, 0, 1]:
        return _spec.placed(body, pose)  # type: ignore[no-any-return]
    k = next(k for k in range(3) if direction[k])
    rotated = _rotated(body[4:], k, cos(x), direction[k] * sin(x))
    # The tensor is rotated above; the other parameters are transformed as those of a body without a tensor.
    return tuple(a + b for a, b in zip(_spec.placed((*body[:4], *(0,) * 6), pose), (0, 0, 0, 0, *rotated), strict=True))


def _rotated(tensor: Sequence[Any], k: int, c: Any, s: Any) -> tuple[Any, ...]:
    """Rotate a symmetric tensor about coordinate axis `k` by the angle with cosine `c` and sine `s`.

    The components orthogonal to the axis change by ``sin(x) (cos(x) a + sin(x) b)``, which avoids the sine and cosine
    of twice the angle.
    """
    places = [(i, j) for i in range(3) for j in range(i, 3)]
    t = dict(zip(places, tensor, strict=True))
    i, j = (k + 1) % 3, (k + 2) % 3

    def at(a: int, b: int) -> tuple[int, int]:
        return min(a, b), max(a, b)

    difference, double = t[i, i] - t[j, j], 2 * t[at(i, j)]
    along = s * (s * difference + c * double)
    found = {
        (i, i): t[i, i] - along,
        (j, j): t[j, j] + along,
        (k, k): t[k, k],
        at(i, j): t[at(i, j)] + s * (c * difference - s * double),
        at(i, k): c * t[at(i, k)] - s * t[at(j, k)],
        at(j, k): s * t[at(i, k)] + c * t[at(j, k)],
    }
    return tuple(found[place] for place in places)
