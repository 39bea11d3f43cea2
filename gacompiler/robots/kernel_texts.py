"""The methods that ``gac robot`` writes kernels for: what they take and return, and the text of their definitions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..errors import SpecError


class Method(NamedTuple):
    """A kernel of one robot.

    Attributes
    ----------
    arguments : str
    returns : str
        The type of the result, as text of a spec.
    doc : str
    has_masses : bool
        Whether inertias are needed.
    """

    arguments: str
    returns: str
    doc: str
    has_masses: bool = True


_SQUARE = "array(SCALAR, ROBOT.n_variables, ROBOT.n_variables)"
_VELOCITIES = "array(SCALAR, 6, ROBOT.n_variables)"

METHODS: dict[str, Method] = {
    "forward": Method(
        "q", "PGA3.MOTOR", "Where the end effector is: the unit motor from its frame to the base frame.", False
    ),
    "forward_all": Method(
        "q", "array(PGA3.MOTOR, ROBOT.n_joints)", "Where the frames that the joints carry are, as unit motors.", False
    ),
    "jacobian": Method(
        "q", _VELOCITIES,
        "Angular over linear velocity of the end effector by the rates of the joints, in the base frame.", False,
    ),
    "jacobian_rate": Method(
        "q, qd", _VELOCITIES, "The rate of change of the Jacobian while the joints move at the rates `qd`.", False
    ),
    "inverse_dynamics": Method(
        "q, qd, qdd", "JOINTS", "Forces and torques of the joints that give accelerations, gravity included."
    ),
    "gravity": Method("q", "JOINTS", "Forces and torques of the joints that hold the robot still."),
    "coriolis": Method("q, qd", "JOINTS", "Forces and torques of centrifugal and Coriolis accelerations."),
    "mass_matrix": Method("q", _SQUARE, "The symmetric matrix of the kinetic energy."),
    "forward_dynamics": Method("q, qd, tau", "JOINTS", "Accelerations under forces and torques of the joints."),
    "coriolis_matrix": Method("q, qd", _SQUARE, "The matrix of Christoffel's symbols."),
    "inverse_dynamics_derivatives": Method(
        "q, qd, qdd", f"({_SQUARE},) * 2", "Derivatives of the forces by the variables and by their rates."
    ),
    "kinetic_energy": Method("q, qd", "SCALAR", "The energy of motion."),
    "potential_energy": Method("q", "SCALAR", "The energy of height."),
    "centre_of_mass": Method("q", "array(SCALAR, 3)", "The centre of mass x, y, z of what moves, in the base frame."),
    "centroidal_momentum_matrix": Method(
        "q", _VELOCITIES, "Angular over linear momentum about the centre of mass by the rates of the joints."
    ),
}  # fmt: skip
"""In the order in which they are written."""

DEFAULT = ("forward", "jacobian", "inverse_dynamics", "gravity", "mass_matrix")
"""Written where no others are asked for: what takes little time to compile, and is called most."""


def methods_of(given: Sequence[str], robot: str, lacks: str) -> tuple[str, ...]:
    """The methods that are written for a robot, in order.

    Parameters
    ----------
    given : sequence of str
        Names, or "all"; where there are none, those of `DEFAULT`.
    robot : str
        Its name, for messages.
    lacks : str
        Why there are no masses; empty where there are.

    Raises
    ------
    SpecError
        Where a method is asked for by name, and needs masses that are not known.
    """
    named = [name for name in given if name != "all"]
    for name in named:
        if lacks and METHODS[name].has_masses:
            possible = ", ".join(name for name, method in METHODS.items() if not method.has_masses)
            raise SpecError(robot, f"{lacks}, which {name} needs", f"one of {possible}")
    asked = set(METHODS if "all" in given else named or DEFAULT)
    return tuple(name for name, method in METHODS.items() if name in asked and not (lacks and method.has_masses))


def kernel_text(name: str) -> str:
    """The definition of a kernel in a spec."""
    method = METHODS[name]
    types = ", ".join(f"{argument}=JOINTS" for argument in method.arguments.split(", "))
    return f'''

@kernel({types}, returns={method.returns})
def {name}({method.arguments}):
    """{method.doc}"""
    return robots.{name}(ROBOT, {method.arguments})
'''
