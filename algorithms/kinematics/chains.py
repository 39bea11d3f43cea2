"""Passes over the joints of a block of configurations: every step is one generated kernel over the block."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from generated import pga3

from ..arguments import Reals
from .denavit_hartenberg import Joint
from .model import Model

BLOCK = 1024
"""Configurations that are worked on at once: what is known of their joints stays in the second cache."""


def blocks(count: int) -> Iterator[slice | int]:
    """Slices that cover `count` configurations; or the index of a single one, for which kernels need no batch."""
    if count == 1:
        yield 0
        return
    for start in range(0, count, BLOCK):
        yield slice(start, min(start + BLOCK, count))


def room(width: int, x: Reals) -> Reals:
    """An element for each configuration in `x`, of a block or a single one; kernels run best on columns."""
    return np.empty((width, *x.shape[:-1]), x.dtype).T


def motions(model: Model, x: Reals) -> list[Reals]:
    """What every joint's motion, and all before it, do to what is at home: motors (..., 8), one array for each joint.

    Parameters
    ----------
    model : Model
    x : array, (B, N) or (N,)
        Positions of all joints.
    """
    axes = model.axes.astype(x.dtype)
    found: list[Reals] = []
    for j, (kind, parent) in enumerate(zip(model.kinds, model.parents, strict=True)):
        motor = room(8, x)
        if kind is Joint.REVOLUTE:
            pga3.motor_from_line(axes[j], x[..., j], out=motor)
        else:
            pga3.motor_from_screw(axes[j], 0.0, x[..., j], out=motor)
        if parent >= 0:
            pga3.motor_product(found[parent], motor, out=motor)
        found.append(motor)
    return found


def joint_twists(model: Model, moved: list[Reals]) -> list[Reals]:
    """The twist (..., 6) of each joint at unit speed, where the joints before have put it."""
    twists = model.twists.astype(moved[0].dtype)
    found = []
    for j, parent in enumerate(model.parents):
        twist = room(6, moved[0])
        if parent < 0:
            twist[:] = twists[j]
        else:
            pga3.move_line(moved[parent], twists[j], out=twist)
        found.append(twist)
    return found


def tool_points(model: Model, moved: list[Reals]) -> Reals:
    """Where the end effector is, (..., 3)."""
    return pga3.move_point(moved[model.tip], model.tool_point.astype(moved[0].dtype))  # type: ignore[no-any-return]
