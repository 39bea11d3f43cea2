"""Read the description of a robot and write the spec of its module: the work of ``gac robot``.

Descriptions are read by `algorithms.kinematics`, which is built on generated modules. This is the one file of the
compiler that imports it; the compiler itself never needs it, so it is loaded only when a robot is read.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ..errors import SpecError
from .chains import Chain
from .kernel_texts import methods_of
from .spec_text import spec_text


def robot_spec(
    robot: str, name: str | None, tip: str | None, locked: Sequence[str], methods: Sequence[str] = ()
) -> tuple[str, str]:
    """The name of a robot's module, and the text of its spec.

    Parameters
    ----------
    robot : str
        A URDF file, or the name of a robot that `algorithms.kinematics` knows.
    name : str or None
        Of the module; else it is the robot's, in letters, digits and _.
    tip : str or None
    locked : sequence of str
        As `Robot.from_urdf` has them.
    methods : sequence of str, optional
        As `methods_of` has them.

    Raises
    ------
    SpecError
        Where there is no such file or robot, or it describes none.
    """
    from algorithms.kinematics import Robot
    from algorithms.kinematics.named import table_of
    from algorithms.kinematics.tables import followed

    try:
        if robot.endswith((".urdf", ".xml")) or Path(robot).is_file():
            found, source = Robot.from_urdf(robot, tip, locked), f"From {Path(robot).name}."
        elif tip is not None or locked:
            raise SpecError(robot, "a robot known by name", "a URDF file for --tip and --lock")
        else:
            found, source = Robot.from_table(table_of(robot)), "From the table of that name in algorithms.kinematics."
    except OSError as error:
        raise SpecError(robot, error.strerror or str(error), "a URDF file, or the name of a robot") from None
    except ValueError as error:
        raise SpecError(robot, str(error)) from None
    module = name or re.sub(r"\W+", "_", found.name)
    if not module.isidentifier():
        raise SpecError(module, "cannot name a module", "letters, digits and _", "give another --name")
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
    return module, spec_text(module, chain, source, written)
