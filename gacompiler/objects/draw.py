"""Pictures with matplotlib: points, lines, planes, circles and spheres of projective and conformal algebras."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import AlgebraError, needs
from ..gac_runtime.annotations import Numbers
from .arrays import MultivectorArray
from .scene import (
    AXES,
    Arrow,
    Circle,
    Frame,
    Item,
    Line,
    Plane,
    PointPair,
    Points,
    Scene,
    Shape,
    Sphere,
    anchor,
    clipped,
    net_of,
    polygon,
    round_of,
    scene_of,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw(
    *objects: MultivectorArray,
    labels: Sequence[str] | None = None,
    colours: Sequence[str] | None = None,
    limits: Numbers | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw objects of PGA2, CGA2, PGA3 or CGA3 with matplotlib.

    Parameters
    ----------
    *objects : MultivectorArray
        Blades: points, directions, lines, planes, point pairs, circles, spheres. An array of points is drawn as a
        cloud, and a motor as the axes that it moves, in red, green and blue. Vectors of conformal algebras are drawn as
        their dual rounds or flats.
    labels, colours : sequence of str, optional
        One for each object; colours as in matplotlib.
    limits : optional
        Lower and upper limit for all axes, ``(-2, 2)``, or for each axis. By default all points and rounds are visible.
    ax : matplotlib.axes.Axes, optional
        The axes to draw in, with the projection ``3d`` for space; by default those of a new figure.

    Returns
    -------
    matplotlib.axes.Axes
        Imaginary rounds are dashed; the square of their drawn radius is minus the squared radius.

    Raises
    ------
    AlgebraError
        If an object cannot be drawn: a motor, a screw, a plane at infinity.

    Examples
    --------
    >>> from gacompiler.objects import CGA2, draw
    >>> c = CGA2.circle([0, 0], 2)
    >>> ax = draw(c, CGA2.point(1, 1), labels=["c", "p"])
    >>> ax.figure.savefig("picture.png")    # doctest: +SKIP
    """
    return draw_scene(scene_of(objects, labels, colours, limits), ax)


def draw_scene(scene: Scene, ax: Any = None) -> Any:
    """Draw a scene with matplotlib, as `draw` does, and return the axes."""
    if ax is None:
        with needs("pictures", "draw"):
            from matplotlib import pyplot

        kind = {"projection": "3d"} if scene.dimension == 3 else {}
        ax = pyplot.figure(figsize=(6, 6)).add_subplot(**kind)
    elif (getattr(ax, "name", "") == "3d") != (scene.dimension == 3):
        raise AlgebraError("draw", f"axes of projection {ax.name}", "3d for space, none for the plane")
    for item in scene.items:
        for shape in item.shapes:
            (_in_space if scene.dimension == 3 else _in_plane)(ax, shape, item, scene)
        if item.label and item.shapes:
            ax.text(*anchor(item.shapes[0], scene.limits), f" {item.label}", color=item.colour)
    ax.set_xlim(*scene.limits[0])
    ax.set_ylim(*scene.limits[1])
    if scene.dimension == 3:
        ax.set_zlim(*scene.limits[2])
        ax.set_box_aspect((1, 1, 1))
    else:
        ax.set_aspect("equal")
    return ax


def _in_plane(ax: Any, shape: Shape, item: Item, scene: Scene) -> None:
    from matplotlib.patches import Circle as Round

    match shape:
        case Circle(centre, _, radius, imaginary):
            ax.add_patch(Round(tuple(centre), radius, fill=False, edgecolor=item.colour, linestyle=_dashes(imaginary)))
        case Arrow(direction):
            ax.annotate("", direction, (0, 0), arrowprops={"arrowstyle": "->", "color": item.colour})
        case _:
            _in_both(ax, shape, item, scene)


def _in_space(ax: Any, shape: Shape, item: Item, scene: Scene) -> None:
    Poly3DCollection = importlib.import_module("mpl_toolkits.mplot3d.art3d").Poly3DCollection

    match shape:
        case Circle():
            ax.plot(*round_of(shape).T, color=item.colour, linestyle=_dashes(shape.is_imaginary))
        case Sphere():
            net = net_of(shape)
            if shape.is_imaginary:
                ax.plot_wireframe(*net, color=item.colour, linestyle="--", linewidth=0.5)
            else:
                ax.plot_surface(*net, color=item.colour, alpha=0.25, linewidth=0)
        case Plane():
            corners = polygon(shape, scene.limits)
            if corners is not None:
                ax.add_collection3d(
                    Poly3DCollection([corners], facecolor=item.colour, edgecolor=item.colour, alpha=0.2)
                )
        case Arrow(direction):
            ax.quiver(0, 0, 0, *direction, color=item.colour)
        case _:
            _in_both(ax, shape, item, scene)


def _in_both(ax: Any, shape: Shape, item: Item, scene: Scene) -> None:
    match shape:
        case Points(places):
            ax.scatter(*places.T, color=item.colour, s=30 if len(places) < 50 else 4)
        case Line():
            ends = clipped(shape, scene.limits)
            if ends is not None:
                ax.plot(*ends.T, color=item.colour)
        case Frame(places):
            for end, colour in zip(places[1:], AXES, strict=False):
                ax.plot(*np.array([places[0], end]).T, color=colour)
        case PointPair(centre, direction, radius, imaginary):
            ends = centre + np.outer([-radius, radius], direction)
            ax.plot(*ends.T, color=item.colour, marker="o", linewidth=1, linestyle=_dashes(imaginary))


def _dashes(imaginary: bool) -> str:
    return "--" if imaginary else "-"
