"""What the kernel of inverse kinematics of one robot is made of, for ``gac robot --inverse``."""

from __future__ import annotations

from ..model import Model
from .chain import arm_of
from .closed import Backwards, SphericalWrist, Tables, ThreeParallel, closed_form
from .redundant import ElbowCircle


def tables_of(robot: Model) -> tuple[str, Tables]:
    """Return the function of `gacompiler.robots` that computes all branches of an arm, and the tables that it takes.

    Raises
    ------
    ValueError
        If there is none for the arm.
    """
    chain = arm_of(robot)
    circle, form = ElbowCircle.of(chain), closed_form(chain)
    backwards = {"backwards": True} if isinstance(form, Backwards) else {}
    if isinstance(form, Backwards):
        form = form.forwards
    if circle is not None:
        return "elbow_circle", circle.tables
    if isinstance(form, ThreeParallel):
        return "three_parallel_axes", form.tables | backwards
    if isinstance(form, SphericalWrist) and form.tables:
        return "spherical_wrist", form.tables | backwards
    raise ValueError(
        f"{robot.name}: inverse: another structure; expected six revolute joints with a spherical wrist or shoulder "
        "and two intersecting or parallel axes among the others, six with three parallel axes, or seven with a "
        "spherical shoulder and wrist; use Robot.inverse"
    )
