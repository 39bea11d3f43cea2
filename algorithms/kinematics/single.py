"""One configuration at a time: each pass over the joints is one function under numba, made of generated kernels.

Batches go joint by joint (`chains`), a kernel a step; for a single configuration the calls would cost far more than
what they do. Passes are those of `chains`, `differential`, `dynamics` and `slopes`, and are compiled when they have
been called a few times (`passes`); results then differ by rounding. A robot is one table of numbers for them; work is
one row a joint. They share their parts, so they are in one file.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from typing import Any

import numpy as np
from numba import njit

from generated import pga3

from .constants import Constants, Floats
from .denavit_hartenberg import Joint
from .passes import COLUMNS, COUNT, Pass, a_pass, as_array, n_joints

_product, _turn, _slide = pga3.motor_product.jit, pga3.motor_from_line.jit, pga3.motor_from_screw.jit
_move_line, _move_point, _join = pga3.move_line.jit, pga3.move_point.jit, pga3.join_point_direction.jit
_move_plane = pga3.move_plane.jit
_on_point, _on_line, _commutator = pga3.twist_on_point.jit, pga3.twist_on_line.jit, pga3.line_commutator.jit
_twist_after, _rate_after = pga3.twist_after_joint.jit, pga3.twist_rate_after_joint.jit
_inertia, _wrench, _momentum, _power = (
    pga3.inertia_of_moved_body.jit,
    pga3.inertial_wrench.jit,
    pga3.momentum.jit,
    pga3.power.jit,
)

# Columns of the table. Its last row is the robot's: the joint of the end effector, its motor, its place, free fall.
_SLIDES, _PARENT, _ON_PATH, _ARMATURE = 0, 1, 2, 3
_AXIS, _TWIST, _BODY, _HOME = slice(4, 10), slice(10, 16), slice(16, 26), slice(26, 34)
_BODY_MASS, _CENTRE, _INERTIA = 16, slice(17, 20), slice(34, 44)
_TIP, _TOOL, _PLACE, _FALL = 0, slice(1, 9), slice(9, 12), slice(12, 15)

# Columns of the work: the motion, the axis it has come to, twist, its rate, wrench, inertia.
_MOTION, _NOW, _MOVES, _RATE, _FORCE, _MASS = (
    slice(0, 8),
    slice(8, 14),
    slice(14, 20),
    slice(20, 26),
    slice(26, 32),
    slice(32, 42),
)
_PLACES, _SPEEDS, _WORK = 14, 20, 42
"""How many of them there are with motions and axes, with twists, and in all."""

_STAYS = np.eye(8)[0]


def table_of(model: Constants, gravity: bool = True) -> Floats | None:
    """The numbers of a robot that passes read, or None where joints follow others."""
    if model.coupling.size:
        return None
    count = len(model.kinds)
    table = np.zeros((count + 1, COLUMNS))
    table[0, COUNT] = count
    rows = table[:-1]
    rows[:, _SLIDES] = [kind is Joint.PRISMATIC for kind in model.kinds]
    rows[:, _PARENT] = model.parents
    rows[list(model.path), _ON_PATH] = 1.0
    rows[:, _ARMATURE] = model.armature
    rows[:, _AXIS], rows[:, _TWIST], rows[:, _HOME] = model.axes, model.twists, model.home
    if model.bodies.size:
        rows[:, _BODY] = model.bodies
        rows[:, _INERTIA] = pga3.inertia_of_moved_body(_STAYS, model.bodies)
    table[-1, _TIP], table[-1, _TOOL], table[-1, _PLACE] = model.tip, model.tool, model.tool_point
    table[-1, _FALL] = model.free_fall if gravity else 0.0
    return table


_inner = njit(error_model="numpy")


@a_pass(lambda n: ((n,), (8,)))
def forward(table: Any, q: Any, out: Any) -> None:
    """The motor of the end effector, (8,)."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (8,))
    q = as_array(q, (n,))
    m, at_base = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), True
    for j in range(n):
        row = table[j]
        if row[_ON_PATH] == 0:
            continue
        motion = _turn(row[_AXIS], q[j]) if row[_SLIDES] == 0 else _slide(row[_AXIS], 0.0, q[j])
        m = motion if at_base else _product(m, motion)
        at_base = False
    _product(m, table[n, _TOOL], out)


@_inner
def _places(table: Any, q: Any, work: Any) -> None:
    """Motions of all joints, (N, 8)."""
    for j in range(q.shape[0]):
        row = table[j]
        parent = int(row[_PARENT])
        m = _turn(row[_AXIS], q[j]) if row[_SLIDES] == 0 else _slide(row[_AXIS], 0.0, q[j])
        if parent < 0:
            for k in range(8):
                work[j, k] = m[k]
        else:
            _product(work[parent], m, work[j])


@_inner
def _motions(table: Any, q: Any, work: Any) -> None:
    """Motions of all joints, and what their axes have come to."""
    for j in range(q.shape[0]):
        row, own = table[j], work[j]
        parent = int(row[_PARENT])
        m = _turn(row[_AXIS], q[j]) if row[_SLIDES] == 0 else _slide(row[_AXIS], 0.0, q[j])
        if parent < 0:
            for k in range(8):
                own[k] = m[k]
            own[_NOW] = row[_TWIST]
        else:
            before = work[parent]
            _product(before[_MOTION], m, own[_MOTION])
            _move_line(before[_MOTION], row[_TWIST], own[_NOW])


@a_pass(lambda n: ((n,), (n, 8)))
def forward_all(table: Any, q: Any, out: Any) -> None:
    """The motors of all frames, (N, 8)."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (n, 8))
    q = as_array(q, (n,))
    work = np.empty((n, 8))
    _places(table, q, work)
    for j in range(n):
        _product(work[j], table[j, _HOME], out[j])


@_inner
def _column(twist: Any, linear: Any, j: int, out: Any) -> None:
    out[0, j], out[1, j], out[2, j] = twist[2], -twist[1], twist[0]
    for k in range(3):
        out[3 + k, j] = linear[k]


@a_pass(lambda n: ((n,), (6, n)))
def jacobian(table: Any, q: Any, out: Any) -> None:
    """Angular over linear velocities, (6, N)."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (6, n))
    q = as_array(q, (n,))
    work = np.empty((n, _PLACES))
    _motions(table, q, work)
    point = _move_point(work[int(table[n, _TIP]), _MOTION], table[n, _PLACE])
    for j in range(n):
        if table[j, _ON_PATH] == 0:
            out[:, j] = 0.0
        else:
            axis = work[j, _NOW]
            _column(axis, _on_point(axis, point), j, out)


@a_pass(lambda n: ((n,), (n,), (6, n)))
def jacobian_rate(table: Any, q: Any, qd: Any, out: Any) -> None:
    """The rate of `jacobian`, (6, N)."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (6, n))
    q, qd = as_array(q, (n,)), as_array(qd, (n,))
    work = np.empty((n, _SPEEDS))
    _motions(table, q, work)
    tip = int(table[n, _TIP])
    point = _move_point(work[tip, _MOTION], table[n, _PLACE])
    for j in range(n):
        _twists(table, qd, work, j)
    velocity = _on_point(work[tip, _MOVES], point)
    origin = (0.0, 0.0, 0.0)
    for j in range(n):
        if table[j, _ON_PATH] == 0:
            out[:, j] = 0.0
            continue
        axis, parent = work[j, _NOW], int(table[j, _PARENT])
        carrier = work[parent, _MOVES] if parent >= 0 else np.zeros(6)
        rate = _on_line(carrier, axis)
        linear = _on_point(rate, point)
        if table[j, _SLIDES] == 0:
            moving, still = _on_point(axis, velocity), _on_point(axis, origin)
            linear = (
                linear[0] + moving[0] - still[0],
                linear[1] + moving[1] - still[1],
                linear[2] + moving[2] - still[2],
            )
        _column(rate, linear, j, out)


@_inner
def _twists(table: Any, qd: Any, work: Any, j: int) -> None:
    own, parent = work[j], int(table[j, _PARENT])
    if parent < 0:
        for k in range(6):
            own[14 + k] = qd[j] * own[8 + k]
    else:
        _twist_after(work[parent, _MOVES], own[_NOW], qd[j], own[_MOVES])


@_inner
def _moving(table: Any, q: Any, qd: Any, qdd: Any, work: Any) -> None:
    """Newton and Euler: outward through the joints, and back; as `Dynamics._moving`."""
    n = q.shape[0]
    _motions(table, q, work)
    fall = table[n, _FALL]
    still, base = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, -fall[0], -fall[1], -fall[2])
    for j in range(n):
        own, parent = work[j], int(table[j, _PARENT])
        _twists(table, qd, work, j)
        if parent < 0:
            _rate_after(still, base, own[_NOW], qd[j], qdd[j], own[_RATE])
        else:
            before = work[parent]
            _rate_after(before[_MOVES], before[_RATE], own[_NOW], qd[j], qdd[j], own[_RATE])
        _inertia(own[_MOTION], table[j, _BODY], own[_MASS])
        _wrench(own[_MASS], own[_MOVES], own[_RATE], own[_FORCE])
    for j in range(n - 1, -1, -1):
        parent = int(table[j, _PARENT])
        if parent >= 0:
            for k in range(26, 32):
                work[parent, k] += work[j, k]


@_inner
def _forces(table: Any, q: Any, qd: Any, qdd: Any, work: Any, out: Any) -> None:
    _moving(table, q, qd, qdd, work)
    for j in range(q.shape[0]):
        out[j] = _power(work[j, _NOW], work[j, _FORCE]) + table[j, _ARMATURE] * qdd[j]


@a_pass(lambda n: ((n,), (n,), (n,), (n,)))
def inverse_dynamics(table: Any, q: Any, qd: Any, qdd: Any, out: Any) -> None:
    """Forces of the joints, (N,)."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (n,))
    q, qd, qdd = as_array(q, (n,)), as_array(qd, (n,)), as_array(qdd, (n,))
    _forces(table, q, qd, qdd, np.empty((n, _WORK)), out)


@_inner
def _composite(table: Any, q: Any, work: Any, out: Any) -> None:
    """The mass matrix; motions are known."""
    n = q.shape[0]
    for j in range(n):
        _inertia(work[j, _MOTION], table[j, _BODY], work[j, _MASS])
        for k in range(n):
            out[j, k] = 0.0
    for j in range(n - 1, -1, -1):
        own = work[j]
        wrench = _momentum(own[_MASS], own[_NOW])
        ancestor = j
        while ancestor >= 0:
            out[j, ancestor] = out[ancestor, j] = _power(work[ancestor, _NOW], wrench)
            ancestor = int(table[ancestor, _PARENT])
        out[j, j] += table[j, _ARMATURE]
        parent = int(table[j, _PARENT])
        if parent >= 0:
            for k in range(32, 42):
                work[parent, k] += own[k]


@a_pass(lambda n: ((n,), (n, n)))
def mass_matrix(table: Any, q: Any, out: Any) -> None:
    """The mass matrix, (N, N)."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (n, n))
    q = as_array(q, (n,))
    work = np.empty((n, _WORK))
    _motions(table, q, work)
    _composite(table, q, work, out)


@_inner
def solve_positive(matrix: Any, right: Any) -> None:
    """``right = matrix⁻¹ right`` in place, by L D Lᵀ; the matrix is overwritten. NaN where it is not positive."""
    n = right.shape[0]
    for j in range(n):
        pivot = matrix[j, j]
        for k in range(j):
            pivot -= matrix[j, k] * matrix[j, k] * matrix[k, k]
        matrix[j, j] = pivot if pivot > 0 else np.nan
        for i in range(j + 1, n):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k] * matrix[k, k]
            matrix[i, j] = total / matrix[j, j]
    for i in range(n):
        for k in range(i):
            right[i] -= matrix[i, k] * right[k]
    for i in range(n):
        right[i] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= matrix[k, i] * right[k]


@a_pass(lambda n: ((n,), (n,), (n,), (n,)))
def forward_dynamics(table: Any, q: Any, qd: Any, tau: Any, out: Any) -> None:
    """Accelerations of the joints, (N,)."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (n,))
    q, qd, tau = as_array(q, (n,)), as_array(qd, (n,)), as_array(tau, (n,))
    work, matrix = np.empty((n, _WORK)), np.empty((n, n))
    _forces(table, q, qd, np.zeros(n), work, out)
    for j in range(n):
        out[j] = tau[j] - out[j]
    _composite(table, q, work, matrix)
    solve_positive(matrix, out)


@a_pass(lambda n: ((n, n), (n,), (n,), (n,)))
def solved(table: Any, matrix: Any, bias: Any, tau: Any, out: Any) -> None:
    """``matrix⁻¹ (tau - bias)``, (N,); the matrix is overwritten."""
    n = n_joints(table)
    matrix, out = as_array(matrix, (n, n)), as_array(out, (n,))
    bias, tau = as_array(bias, (n,)), as_array(tau, (n,))
    for j in range(n):
        out[j] = tau[j] - bias[j]
    solve_positive(matrix, out)


@a_pass(lambda n: ((n,), (n,), (n, n)))
def coriolis_matrix(table: Any, q: Any, qd: Any, out: Any) -> None:
    """Half the derivative of the Coriolis forces by the speeds, (N, N)."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (n, n))
    q, qd = as_array(q, (n,)), as_array(qd, (n,))
    work = np.empty((n, _WORK))
    _motions(table, q, work)
    for j in range(n):
        _twists(table, qd, work, j)
        _inertia(work[j, _MOTION], table[j, _BODY], work[j, _MASS])
    _by_speeds(table, qd, 0.5, work, out)


@_inner
def _by_speeds(table: Any, qd: Any, factor: float, work: Any, out: Any) -> None:
    """The derivative of the forces by the speeds, times a factor; motions, twists and inertias are known."""
    n = qd.shape[0]
    momenta, change, rates, carried = np.empty((n, 6)), np.empty((n, 6)), np.empty((n, 6)), np.empty(n, np.bool_)
    for j in range(n):
        _momentum(work[j, _MASS], work[j, _MOVES], momenta[j])
    for j in range(n):
        axis, carrier = work[j, _NOW], int(table[j, _PARENT])
        for k in range(n):
            parent = int(table[k, _PARENT])
            carried[k] = k == j or (k > j and parent >= j and carried[parent])
            if not carried[k]:
                continue
            own = work[k]
            if k > j:
                drag = _on_line(axis, own[_NOW])
                for i in range(6):
                    rates[k, i] = rates[parent, i] + qd[k] * drag[i]
            elif carrier >= 0:
                _on_line(work[carrier, _MOVES], axis, rates[k])
            else:
                rates[k] = 0.0
            inertial = _momentum(own[_MASS], rates[k])
            turning = _commutator(_momentum(own[_MASS], axis), own[_MOVES])
            turned = _commutator(momenta[k], axis)
            for i in range(6):
                change[k, i] = inertial[i] + turning[i] + turned[i]
        for k in range(n - 1, j - 1, -1):
            if carried[k]:
                out[k, j] = _power(work[k, _NOW], change[k]) * factor
                if k > j:
                    change[int(table[k, _PARENT])] += change[k]
            else:
                out[k, j] = 0.0
        for k in range(j):
            out[k, j] = 0.0
        while carrier >= 0:
            out[carrier, j] = _power(work[carrier, _NOW], change[j]) * factor
            carrier = int(table[carrier, _PARENT])


@a_pass(lambda n: ((n,), (n,), (n,), (2, n, n)))
def slopes(table: Any, q: Any, qd: Any, qdd: Any, out: Any) -> None:
    """Derivatives of the forces by the variables, as `Slopes._fill_slopes`, and by the speeds, (2, N, N)."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (2, n, n))
    q, qd, qdd = as_array(q, (n,)), as_array(qd, (n,)), as_array(qdd, (n,))
    work = np.empty((n, _WORK))
    _moving(table, q, qd, qdd, work)
    _by_speeds(table, qd, 1.0, work, out[1])
    momenta, change, carried = np.empty((n, 6)), np.empty((n, 6)), np.empty(n, np.bool_)
    for j in range(n):
        _momentum(work[j, _MASS], work[j, _MOVES], momenta[j])
    twist, rate, away, way = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    back, back_rate = np.empty(6), np.empty(6)
    for j in range(n):
        axis, carrier = work[j, _NOW], int(table[j, _PARENT])
        if carrier >= 0:
            twist[:], rate[:] = work[carrier, _MOVES], work[carrier, _RATE]
        else:
            twist[:], rate[:] = 0.0, 0.0
            rate[3:] = -table[n, _FALL]
        _on_line(axis, twist, back)
        _on_line(axis, rate, back_rate)
        for i in range(6):
            back[i], back_rate[i] = -back[i], -back_rate[i]
        for k in range(j, n):
            parent = int(table[k, _PARENT])
            carried[k] = k == j or (parent >= j and carried[parent])
            if not carried[k]:
                continue
            own = work[k]
            for i in range(6):
                away[i] = own[14 + i] - twist[i]
            turn = _commutator(away, back)
            for i in range(6):
                way[i] = back_rate[i] + turn[i]
            inertial = _momentum(own[_MASS], way)
            turning = _commutator(_momentum(own[_MASS], back), own[_MOVES])
            turned = _commutator(momenta[k], back)
            for i in range(6):
                change[k, i] = inertial[i] + turning[i] + turned[i]
        for k in range(n - 1, j - 1, -1):
            if carried[k]:
                out[0, k, j] = _power(work[k, _NOW], change[k])
                if k > j:
                    change[int(table[k, _PARENT])] += change[k]
            else:
                out[0, k, j] = 0.0
        for k in range(j):
            out[0, k, j] = 0.0
        drag = _on_line(axis, work[j, _FORCE])
        for i in range(6):
            change[j, i] += drag[i]
        while carrier >= 0:
            out[0, carrier, j] = _power(work[carrier, _NOW], change[j])
            carrier = int(table[carrier, _PARENT])


@_inner
def _back(row: Any, q: float) -> Any:
    """The inverse of a joint's own motion: what is carried stays as it is at home, and what carries it moves."""
    return _turn(row[_AXIS], -q) if row[_SLIDES] == 0 else _slide(row[_AXIS], 0.0, -q)


@a_pass(lambda n: ((n,), (n,), ()))
def kinetic_energy(table: Any, q: Any, qd: Any, out: Any) -> None:
    """The energy of motion, from twists as bodies see them that stay at home."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (1,))
    q, qd = as_array(q, (n,)), as_array(qd, (n,))
    twists = np.empty((n, 6))
    energy = 0.0
    for j in range(n):
        row, own = table[j], twists[j]
        parent = int(row[_PARENT])
        if parent < 0:
            for k in range(6):
                own[k] = qd[j] * row[10 + k]
        else:
            _twist_after(_move_line(_back(row, q[j]), twists[parent]), row[_TWIST], qd[j], own)
        energy += _power(own, _momentum(row[_INERTIA], own)) + row[_ARMATURE] * qd[j] * qd[j]
    out[0] = energy / 2


@a_pass(lambda n: ((n,), ()))
def potential_energy(table: Any, q: Any, out: Any) -> None:
    """The energy of height: of distances from the plane of the base as bodies see it that stay at home."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (1,))
    q = as_array(q, (n,))
    planes = np.empty((n, 4))
    energy, fall = 0.0, table[n, _FALL]
    ground = (-fall[0], -fall[1], -fall[2], 0.0)
    for j in range(n):
        row, own = table[j], planes[j]
        parent, back = int(row[_PARENT]), _back(row, q[j])
        if parent < 0:
            _move_plane(back, ground, own)
        else:
            _move_plane(back, planes[parent], own)
        # mass times centre is in the inertia about the origin
        energy += own[3] * row[_BODY_MASS] + own[0] * row[35] + own[1] * row[36] + own[2] * row[37]
    out[0] = energy


@a_pass(lambda n: ((n,), (n,)))
def gravity(table: Any, q: Any, out: Any) -> None:
    """Forces of the joints that hold the robot still, (N,): each body is held at its centre against its weight."""
    n = n_joints(table)
    table, out = as_array(table, (n + 1, COLUMNS)), as_array(out, (n,))
    q = as_array(q, (n,))
    work = np.empty((n, _WORK))
    _motions(table, q, work)
    fall = table[n, _FALL]
    for j in range(n):
        own, mass = work[j], table[j, _BODY_MASS]
        force = (-mass * fall[0], -mass * fall[1], -mass * fall[2])
        _join(_move_point(own[_MOTION], table[j, _CENTRE]), force, own[_FORCE])
    for j in range(n - 1, -1, -1):
        out[j] = _power(work[j, _NOW], work[j, _FORCE])
        parent = int(table[j, _PARENT])
        if parent >= 0:
            for k in range(26, 32):
                work[parent, k] += work[j, k]


@dataclass(frozen=True, slots=True)
class Passes:
    """The passes for robots of so many joints."""

    forward: Pass
    forward_all: Pass
    jacobian: Pass
    jacobian_rate: Pass
    inverse_dynamics: Pass
    gravity: Pass
    mass_matrix: Pass
    coriolis_matrix: Pass
    forward_dynamics: Pass
    solved: Pass
    slopes: Pass
    kinetic_energy: Pass
    potential_energy: Pass


@cache
def passes(count: int) -> Passes:
    """The same for all robots of so many joints."""
    return Passes(*(Pass(globals()[field.name], count) for field in fields(Passes)))
