"""Kinematics of one robot: the loops of `gacompiler.specs.robots`, unrolled and with the robot's constants folded.

Every function takes a `Chain`, followed by the variables and further arguments, which are expressions in a kernel,
sympy symbols or numbers.
"""

from __future__ import annotations

from typing import Any

from ..frontend.expression import lift
from ..frontend.kernel import Kernel
from ..frontend.loop_trace import written_out
from ..frontend.operations import cos, sin
from ..specs import robots as spec
from .chains import Chain
from .exact_tables import MOTOR, motor_of, path_to, rotor_and_place, tables_of_joints
from .folding import Rows, Scalars, folded, need
from .frames import ZERO, directions_and_moments, line_of, origins

_spec: Any = spec  # specs have no types


def forward(chain: Chain, q: Scalars) -> Any:
    """Compute the motor of the end effector, the product of the exponentials of the joints and the tool motor.

    Parameters
    ----------
    chain : Chain
    q : scalars

    Returns
    -------
    multivector
        An even element, which is a unit motor up to the rounding of the constants.
    """
    return folded(motor_of_variables, chain, q=q)


def motor_of_variables(chain: Chain, q: Scalars) -> Any:
    """Compute the motor of the end effector without folding the constants."""
    # A single motor takes fewer operations than the rotor and position used in the loops for a general robot.
    found: Any = lift(1)
    lines, (variables, ratios, offsets) = directions_and_moments(chain), chain.followed
    shift = chain.n_positions - chain.n_variables
    for joint in path_to(chain, chain.tip):
        if chain.kinds[joint] == "floating":
            found = _spec.unit_motor(*q[: len(MOTOR)])
            continue
        half = (ratios[joint] * q[variables[joint] + shift] + offsets[joint]) / 2
        direction, moment = lines[joint]
        if chain.kinds[joint] == "prismatic":
            factor = 1 - half * line_of(ZERO, direction)
        else:
            factor = cos(half) - sin(half) * line_of(direction, moment)
        found = factor if chain.parents[joint] < 0 else found * factor
    return found * motor_of(chain.tool)


def forward_all(chain: Chain, q: Scalars) -> tuple[Any, ...]:
    """Compute the motors of the frames carried by the joints, in the base frame.

    Parameters
    ----------
    chain : Chain
        With `home`.
    q : scalars

    Returns
    -------
    N multivectors
    """
    return folded(_forward_all, chain, q=q)  # type: ignore[no-any-return]


def _forward_all(chain: Chain, q: Scalars) -> Any:
    need(chain, "home")
    homes = zip(chain.home, origins(chain), strict=True)
    rotors, places = zip(*(rotor_and_place(motor_of(home), origin) for home, origin in homes), strict=True)
    tables = tables_of_joints(chain) | {"home_rotors": rotors, "home_places": places}
    return written_out(spec.forward_all, {"q": q, **tables})


def jacobian(chain: Chain, q: Scalars) -> Rows:
    """Compute the geometric Jacobian at the end effector: angular over linear velocity, in the base frame.

    Parameters
    ----------
    chain : Chain
    q : scalars

    Returns
    -------
    6 rows of n scalars
    """
    return folded(_jacobian, chain, q=q)  # type: ignore[no-any-return]


def _jacobian(chain: Chain, q: Scalars) -> Any:
    return _of_end_effector(spec.jacobian, chain, q=q)


def jacobian_rate(chain: Chain, q: Scalars, qd: Scalars) -> Rows:
    """Compute the time derivative of `jacobian` when the variables change at the rates `qd`.

    Parameters
    ----------
    chain : Chain
    q, qd : scalars

    Returns
    -------
    6 rows of n scalars
    """
    return folded(_jacobian_rate, chain, q=q, qd=qd)  # type: ignore[no-any-return]


def _jacobian_rate(chain: Chain, q: Scalars, qd: Scalars) -> Any:
    return _of_end_effector(spec.jacobian_rate, chain, q=q, qd=qd)


def _of_end_effector(definition: Kernel, chain: Chain, **given: Scalars) -> Any:
    path = path_to(chain, chain.tip)
    # A floating base is left out if there are other joints: its row does not move.
    path = path[chain.is_floating :] or path
    if not path:
        return ((0,) * chain.n_variables,) * 6
    _, tip = rotor_and_place(motor_of(chain.tool), origins(chain)[chain.tip])
    return written_out(definition, {**given, **tables_of_joints(chain, path), "tip": tip})
