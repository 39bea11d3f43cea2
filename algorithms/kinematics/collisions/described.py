"""Capsules for the collision geometry of a URDF file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import ceil, sqrt
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from generated import pga3

from ...arguments import Reals
from .. import Robot, urdf
from ..errors import DescriptionError
from .arm_capsules import ArmCapsules

_ROUND = (1 + sqrt(2)) / 2
"""The radius of capsules relative to half of the thinnest edge of a box: they are as far outside of its faces as inside
of its edges."""
_INSET = ((2 * _ROUND) ** 2 - 2) / (4 * _ROUND)
"""How much shorter axes are than the box, relative to the thinnest edge: capsules are as far outside of the faces at
their ends as inside of the corners."""


def capsules_from_urdf(
    path: str | Path, robot: Robot | None = None, *, arguments: Mapping[str, Any] = urdf.NO_ARGUMENTS
) -> ArmCapsules:
    """Return capsules for the spheres, cylinders and boxes of a URDF file's collision elements.

    Parameters
    ----------
    path : str or Path
        As in `Robot.from_urdf`.
    robot : Robot, optional
        That of the same file; by default, it is read again.
    arguments : mapping of str, optional
        As in `Robot.from_urdf`, for files of xacro.

    Returns
    -------
    ArmCapsules
        A sphere is a capsule of length 0. The axis of a cylinder is that of the capsule that contains it. A box becomes
        parallel capsules along its longest edge. They are outside of its faces and inside of its edges and corners by
        at most 21 % of its shortest edge; keep a corresponding distance from obstacles.

    Raises
    ------
    OSError, TypeError, DescriptionError
        As `Robot.from_urdf`, and if a geometry is a mesh, there is none at all, or a size is not positive.
    """
    model = Robot.from_urdf(path, arguments=arguments) if robot is None else robot
    root, where = urdf.described(path, arguments)
    carriers, ends, radii = [], [], []
    for link in root.findall("link"):
        name = link.get("name", "")
        carrier, motor = model.carrier(name)
        for element in link.findall("collision"):
            here = f"{where}: link {name!r}: collision"
            place = pga3.motor_product(motor, urdf.origin_of(element.find("origin"), here))
            for start, end, radius in _covers(element, here):
                carriers.append(carrier)
                ends.append(pga3.move_point(place, np.array([start, end])))
                radii.append(radius)
    if not radii:
        raise DescriptionError(f"{where}: no collision element; expected spheres, cylinders or boxes")
    return ArmCapsules(np.array(carriers), np.array(ends), np.array(radii))


def _covers(element: ElementTree.Element, where: str) -> Iterator[tuple[Reals, Reals, float]]:
    """Generate the ends of the axes and the radii of the capsules of one collision element."""
    geometry = element.find("geometry")
    kinds = [] if geometry is None else list(geometry)
    if len(kinds) != 1 or kinds[0].tag not in ("sphere", "cylinder", "box"):
        found = ", ".join(f"<{kind.tag}>" for kind in kinds) or "nothing"
        raise DescriptionError(f"{where}: {found}; expected a sphere, a cylinder or a box")
    shape = kinds[0]
    names = {"sphere": ("radius",), "cylinder": ("radius", "length"), "box": ("size",)}[shape.tag]
    sizes = np.concatenate([urdf.numbers(shape, name, None, 3 if name == "size" else 1, where) for name in names])
    if not (sizes > 0).all():
        raise DescriptionError(f"{where}: sizes {sizes}; expected positive numbers")
    if shape.tag != "box":
        half = np.array([0, 0, sizes[1] / 2]) if shape.tag == "cylinder" else np.zeros(3)
        yield -half, half, float(sizes[0])
        return
    thin, wide, long = np.argsort(sizes, kind="stable")
    count = 1 + ceil((sizes[wide] - sizes[thin]) / sizes[thin])
    for place in np.linspace(-0.5, 0.5, count) if count > 1 else (0.0,):
        middle, half = np.zeros(3), np.zeros(3)
        middle[wide] = place * (sizes[wide] - sizes[thin])
        half[long] = (sizes[long] - _INSET * sizes[thin]) / 2
        yield middle - half, middle + half, _ROUND * sizes[thin] / 2
