"""Pictures of grasps: the object, the capsules of the hand, the contacts and their friction cones."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3, pga3

from ..arguments import Reals
from ..extras import extra
from ..geometry.meshes import checked_mesh
from .hands import Hand
from .planning import Grasp
from .quality import contact_wrenches
from .status import GraspStatus

with extra("pictures", __name__):
    from matplotlib.figure import Figure

_FACES = 4000
"""A limit on work: the number of drawn triangles."""
_CONE = 0.03
"""The length of the drawn forces, in metres."""


def circle_of_contacts(contacts: ArrayLike, count: int = 60) -> Reals:
    """Compute points of the conformal circle through three contacts.

    Parameters
    ----------
    contacts : array_like, (3, 3)
        Points that are not collinear.
    count : int, optional
        The number of points.

    Returns
    -------
    array, (count, 3)
        The first and the last are the first contact.
    """
    a, b, c = np.asarray(contacts, float)
    circle = cga3.circle_from_points(a, b, c)
    centre, normal = cga3.circle_centre(circle), cga3.circle_normal(circle)
    first = a - centre
    second = np.cross(normal / np.linalg.norm(normal), first)
    angles = np.linspace(0, 2 * np.pi, count)[:, None]
    return centre + np.cos(angles) * first + np.sin(angles) * second  # type: ignore[no-any-return]


def plot_grasp(
    vertices: ArrayLike, faces: ArrayLike, grasp: Grasp, hand: Hand, friction: float = 0.5, axes: Any = None
) -> Any:
    """Draw an object and a hand that holds it.

    Parameters
    ----------
    vertices, faces : array_like
        The mesh, as in `plan_grasps`.
    grasp : Grasp
        If its status is not OK, only the object is drawn, and the status is the title.
    hand : Hand
        The hand of the plan.
    friction : float
        The coefficient of friction, for the cones.
    axes : matplotlib axes in three dimensions, optional
        A new figure by default.

    Returns
    -------
    axes
    """
    points, numbers = checked_mesh(vertices, faces, "plot_grasp")
    axes = Figure(figsize=(6, 6)).add_subplot(projection="3d") if axes is None else axes
    if len(numbers):
        shown = numbers[:: -(-len(numbers) // _FACES)]
        axes.plot_trisurf(*points.T, triangles=shown, color="0.8", alpha=0.5, linewidth=0)
    axes.set_title(f"{grasp.status.name}, quality {grasp.quality:.3f}")
    if grasp.status != GraspStatus.OK:
        return axes
    ends = pga3.move_point(grasp.motor, hand.placed_capsules(grasp.joints))
    for (start, end), carrier in zip(ends, hand.parts.carriers, strict=True):
        width, alpha = (5, 0.7) if carrier >= 0 else (3, 0.4)
        axes.plot(*np.stack([start, end], -1), color="tab:blue", linewidth=width, alpha=alpha)
    if len(grasp.contacts) == 3:
        axes.plot(*circle_of_contacts(grasp.contacts).T, color="tab:orange")
    axes.scatter(*grasp.contacts.T, color="tab:red")
    forces, _ = pga3.line_to_direction_moment(contact_wrenches(grasp.contacts, grasp.normals, friction))
    for contact, edges in zip(grasp.contacts, forces, strict=True):
        # The cones are drawn outside the object, where the fingers push.
        for edge in edges:
            axes.plot(*np.stack([contact, contact - _CONE * edge], -1), color="tab:green", linewidth=0.7)
    axes.set_aspect("equal")
    return axes
