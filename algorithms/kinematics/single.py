"""One configuration at a time: each pass over the joints is one function under numba, made of generated kernels.

Batches go joint by joint (`chains`), a kernel a step; for a single configuration the calls would cost far more than
what they do. Passes are those of `chains`, `differential`, `dynamics` and `slopes`, and are compiled when they have
been called a few times; results then differ by rounding. A robot is one table of numbers for them; work is one row a
joint. They share their parts, so they are in one file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zlib import crc32

import numpy as np
from numba import njit

from generated import pga3

from .denavit_hartenberg import Joint

if TYPE_CHECKING:
    from .model import Floats, Model

PATIENCE = 32
"""Calls that a pass waits for before it is compiled, which takes seconds, or half of one where numba has kept it."""

_product, _turn, _slide = pga3.motor_product.jit, pga3.motor_from_line.jit, pga3.motor_from_screw.jit
_move_line, _move_point = pga3.move_line.jit, pga3.move_point.jit
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
_TIP, _TOOL, _PLACE, _FALL = 0, slice(1, 9), slice(9, 12), slice(12, 15)
_COLUMNS = 34

# Columns of the work: the motion, the axis it has come to, twist, its rate, wrench, inertia.
_MOTION, _NOW, _MOVES, _RATE, _FORCE, _MASS = (
    slice(0, 8),
    slice(8, 14),
    slice(14, 20),
    slice(20, 26),
    slice(26, 32),
    slice(32, 42),
)
_WORK = 42

_REAL = {1: "f8[::1]", 2: "f8[:, ::1]", 3: "f8[:, :, ::1]"}
_waiting: dict[str, tuple[Any, str]] = {}
"""Passes that are not compiled: by name, with their signature."""
_calls: Counter[str] = Counter()


def table_of(model: Model, gravity: bool = True) -> Floats | None:
    """The numbers of a robot that passes read, or None where joints follow others."""
    if model.coupling.size:
        return None
    count = len(model.kinds)
    table = np.zeros((count + 1, _COLUMNS))
    rows = table[:-1]
    rows[:, _SLIDES] = [kind is Joint.PRISMATIC for kind in model.kinds]
    rows[:, _PARENT] = model.parents
    rows[list(model.path), _ON_PATH] = 1.0
    rows[:, _ARMATURE] = model.armature
    rows[:, _AXIS], rows[:, _TWIST], rows[:, _HOME] = model.axes, model.twists, model.home
    if model.bodies.size:
        rows[:, _BODY] = model.bodies
    table[-1, _TIP], table[-1, _TOOL], table[-1, _PLACE] = model.tip, model.tool, model._tool_point
    table[-1, _FALL] = model.free_fall if gravity else 0.0
    return table


def wanted(name: str, arrays: tuple[Any, ...]) -> None:
    """Count a call that a pass did not take because it is not compiled, and compile it when there were enough."""
    if name not in _waiting or not all(type(a) is np.ndarray and a.ndim == 1 and a.dtype == float for a in arrays):
        return
    _calls[name] += 1
    if _calls[name] > PATIENCE:
        function, signature = _waiting.pop(name)
        # numba keeps what it compiled by this name, and knows nothing of the kernels' text
        function.__qualname__ = f"{name}_{crc32(Path(pga3.__file__).read_bytes()):08x}"
        try:
            run = njit(function, cache=True, error_model="numpy")
        except RuntimeError:  # no folder to keep it in
            run = njit(function, error_model="numpy")
        run.compile(signature)
        run.disable_compile()
        globals()[name] = run


def _pass(*axes: int) -> Callable[[Callable[..., bool]], Any]:
    """A pass over a table and arrays of so many axes, the last its result; it says whether their lengths are right.

    Until it is compiled it refuses its arguments, as it will refuse those of other types then.
    """

    def made(function: Callable[..., bool]) -> Any:
        signature = f"b1({', '.join(_REAL[k] for k in (2, *axes))})"
        _waiting[function.__name__] = function, signature
        return _refuse

    return made


def _refuse(*_: Any) -> bool:
    raise TypeError("not compiled")


_inner = njit(error_model="numpy")


@_pass(1, 1)
def forward(table: Any, q: Any, out: Any) -> bool:
    """The motor of the end effector, (8,)."""
    n = table.shape[0] - 1
    if q.shape[0] != n:
        return False
    m = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for j in range(n):
        row = table[j]
        if row[_ON_PATH] == 0:
            continue
        motion = _turn(row[_AXIS], q[j]) if row[_SLIDES] == 0 else _slide(row[_AXIS], 0.0, q[j])
        m = _product(m, motion)
    _product(m, table[n, _TOOL], out)
    return True


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


@_pass(1, 2)
def forward_all(table: Any, q: Any, out: Any) -> bool:
    """The motors of all frames, (N, 8)."""
    n = table.shape[0] - 1
    if q.shape[0] != n:
        return False
    work = np.empty((n, _WORK))
    _motions(table, q, work)
    for j in range(n):
        _product(work[j, _MOTION], table[j, _HOME], out[j])
    return True


@_inner
def _column(twist: Any, linear: Any, j: int, out: Any) -> None:
    out[0, j], out[1, j], out[2, j] = twist[2], -twist[1], twist[0]
    for k in range(3):
        out[3 + k, j] = linear[k]


@_pass(1, 2)
def jacobian(table: Any, q: Any, out: Any) -> bool:
    """Angular over linear velocities, (6, N)."""
    n = table.shape[0] - 1
    if q.shape[0] != n:
        return False
    work = np.empty((n, _WORK))
    _motions(table, q, work)
    point = _move_point(work[int(table[n, _TIP]), _MOTION], table[n, _PLACE])
    for j in range(n):
        if table[j, _ON_PATH] == 0:
            out[:, j] = 0.0
        else:
            axis = work[j, _NOW]
            _column(axis, _on_point(axis, point), j, out)
    return True


@_pass(1, 1, 2)
def jacobian_rate(table: Any, q: Any, qd: Any, out: Any) -> bool:
    """The rate of `jacobian`, (6, N)."""
    n = table.shape[0] - 1
    if q.shape[0] != n or qd.shape[0] != n:
        return False
    work = np.empty((n, _WORK))
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
    return True


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


@_pass(1, 1, 1, 1)
def inverse_dynamics(table: Any, q: Any, qd: Any, qdd: Any, out: Any) -> bool:
    """Forces of the joints, (N,)."""
    n = table.shape[0] - 1
    if q.shape[0] != n or qd.shape[0] != n or qdd.shape[0] != n:
        return False
    _forces(table, q, qd, qdd, np.empty((n, _WORK)), out)
    return True


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


@_pass(1, 2)
def mass_matrix(table: Any, q: Any, out: Any) -> bool:
    """The mass matrix, (N, N)."""
    n = table.shape[0] - 1
    if q.shape[0] != n:
        return False
    work = np.empty((n, _WORK))
    _motions(table, q, work)
    _composite(table, q, work, out)
    return True


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


@_pass(1, 1, 1, 1)
def forward_dynamics(table: Any, q: Any, qd: Any, tau: Any, out: Any) -> bool:
    """Accelerations of the joints, (N,)."""
    n = table.shape[0] - 1
    if q.shape[0] != n or qd.shape[0] != n or tau.shape[0] != n:
        return False
    work, matrix = np.empty((n, _WORK)), np.empty((n, n))
    _forces(table, q, qd, np.zeros(n), work, out)
    for j in range(n):
        out[j] = tau[j] - out[j]
    _composite(table, q, work, matrix)
    solve_positive(matrix, out)
    return True


@_pass(1, 1, 1)
def solved(matrix: Any, bias: Any, tau: Any, out: Any) -> bool:
    """``matrix⁻¹ (tau - bias)``, (N,); the matrix is overwritten."""
    n = matrix.shape[0]
    if tau.shape[0] != n:
        return False
    for j in range(n):
        out[j] = tau[j] - bias[j]
    solve_positive(matrix, out)
    return True


@_pass(1, 1, 2)
def coriolis_matrix(table: Any, q: Any, qd: Any, out: Any) -> bool:
    """Half the derivative of the Coriolis forces by the speeds, (N, N)."""
    n = table.shape[0] - 1
    if q.shape[0] != n or qd.shape[0] != n:
        return False
    work = np.empty((n, _WORK))
    _motions(table, q, work)
    for j in range(n):
        _twists(table, qd, work, j)
        _inertia(work[j, _MOTION], table[j, _BODY], work[j, _MASS])
    _by_speeds(table, qd, 0.5, work, out)
    return True


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


@_pass(1, 1, 1, 3)
def slopes(table: Any, q: Any, qd: Any, qdd: Any, out: Any) -> bool:
    """Derivatives of the forces by the variables, as `Slopes._fill_slopes`, and by the speeds, (2, N, N)."""
    n = table.shape[0] - 1
    if q.shape[0] != n or qd.shape[0] != n or qdd.shape[0] != n:
        return False
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
    return True


@_pass(1, 1, 1)
def energies(table: Any, q: Any, qd: Any, out: Any) -> bool:
    """Kinetic and potential energy, (2,)."""
    n = table.shape[0] - 1
    if q.shape[0] != n or qd.shape[0] != n:
        return False
    work = np.empty((n, _WORK))
    _motions(table, q, work)
    kinetic, potential, fall = 0.0, 0.0, table[n, _FALL]
    for j in range(n):
        own, body = work[j], table[j, _BODY]
        _twists(table, qd, work, j)
        _inertia(own[_MOTION], body, own[_MASS])
        kinetic += _power(own[_MOVES], _momentum(own[_MASS], own[_MOVES])) / 2
        kinetic += table[j, _ARMATURE] * qd[j] * qd[j] / 2
        # the inertia about the origin holds mass times centre
        potential -= own[33] * fall[0] + own[34] * fall[1] + own[35] * fall[2]
    out[0], out[1] = kinetic, potential
    return True
