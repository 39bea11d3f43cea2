"""Read the description of a robot and write the spec of its module, for ``gac robot``.

Descriptions are read by `algorithms.kinematics`, which is built on generated modules. This is the only file of the
compiler that imports it. The import takes place when a robot is read, since the compiler itself does not need it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

from ..errors import SpecError
from .chains import Chain
from .kernel_texts import methods_of
from .spec_text import inverse_text, spec_text


def robot_spec(
    robot: str,
    name: str | None,
    tip: str | None,
    locked: Sequence[str],
    methods: Sequence[str] = (),
    base: str = "fixed",
    inverse: bool = False,
) -> tuple[str, str]:
    """Return the name of a robot's module and the text of its spec.

    Parameters
    ----------
    robot : str
        A file of URDF or of MuJoCo (MJCF), or the name of a robot known to `algorithms.kinematics`.
    name : str or None
        The name of the module; by default the name of the robot, with other characters replaced by _.
    tip : str or None
    locked : sequence of str
        The end effector and the locked joints, as for `Robot.from_urdf`.
    methods : sequence of str, optional
        The kernels, as for `methods_of`.
    base : str, optional
        "fixed", "floating" or "euler", as for `Robot.from_urdf`.
    inverse : bool, optional
        Whether to write the kernel `inverse`, too.

    Raises
    ------
    SpecError
        If the file or robot does not exist, or the file is not a valid description, or the inverse kinematics of the
        robot has no closed form.
    """
    from algorithms.kinematics import Robot
    from algorithms.kinematics.inverse.folding import tables_of
    from algorithms.kinematics.named import table_of
    from algorithms.kinematics.tables import followed

    try:
        if robot.endswith((".urdf", ".xml")) or Path(robot).is_file():
            read = Robot.from_mjcf if _root_of(robot) == "mujoco" else Robot.from_urdf
            found, source = read(robot, tip, locked, base), f"From {Path(robot).name}."
        elif tip is not None or locked or base != "fixed":
            raise SpecError(robot, "a robot known by name", "a file for --tip, --lock and --base")
        else:
            found, source = Robot.from_table(table_of(robot)), "From the table of that name in algorithms.kinematics."
    except OSError as error:
        raise SpecError(robot, error.strerror or str(error), "a URDF or MJCF file, or the name of a robot") from None
    except ValueError as error:
        raise SpecError(robot, str(error).removeprefix(f"{Path(robot).name}: ").removeprefix(f"{robot}: ")) from None
    module = name or re.sub(r"\W+", "_", found.name)
    if not module.isidentifier():
        raise SpecError(module, "not a valid module name", "letters, digits and _", "choose another --name")
    lacks = "" if found.bodies.size else "no masses"
    if found.without_inertia:
        lacks = f"no inertia of {', '.join(found.without_inertia)}"
    written = methods_of(methods, robot, lacks)
    variables, ratios, offsets = followed(found) if found.coupling.size else ((), (), ())
    chain = Chain(
        kinds=tuple(kind.value for kind in found.kinds),
        parents=found.parents,
        axes=tuple(tuple(map(float, row)) for row in found.axes),
        tip=found.tip,
        tool=tuple(map(float, found.tool)),
        inertias=() if lacks else tuple(tuple(map(float, row)) for row in found.bodies),
        gravity=tuple(map(float, found.free_fall)),
        armature=tuple(map(float, found.armature)),
        variables=tuple(map(int, variables)),
        ratios=tuple(map(float, ratios)),
        offsets=tuple(map(float, offsets)),
        home=tuple(tuple(map(float, row)) for row in found.home) if "forward_all" in written else (),
    )
    try:
        solver = inverse_text(*tables_of(found), found.joint_names) if inverse else ""
    except ValueError as error:
        raise SpecError(robot, str(error)) from None
    return module, spec_text(module, chain, source, written, solver)


def _root_of(path: str) -> str:
    """Return the name of the root element of a file; empty if it is not XML, which its reader reports."""
    try:
        return ElementTree.parse(path).getroot().tag
    except ElementTree.ParseError:
        return ""
