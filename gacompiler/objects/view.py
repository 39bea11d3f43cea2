"""Interactive pictures with plotly, in a notebook or as a self-contained HTML file."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BackendError
from .scene import (
    Arrow,
    Circle,
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


def view(
    *objects: Any,
    labels: Sequence[str] | None = None,
    colours: Sequence[str] | None = None,
    limits: Any = None,
    file: str | Path | None = None,
) -> Any:
    """Create an interactive picture of objects with plotly.

    Parameters
    ----------
    *objects, labels, colours, limits
        As in `draw`; colours are CSS colours.
    file : path, optional
        Write the picture to this HTML file, which can be viewed without a network connection.

    Returns
    -------
    plotly.graph_objects.Figure
        The figure, which a notebook displays.

    Raises
    ------
    BackendError
        If plotly is not installed, or the file cannot be written.
    """
    try:
        graph_objects = importlib.import_module("plotly.graph_objects")
    except ImportError:
        raise BackendError("view", "plotly is not installed", remedy="pip install plotly, or use draw()") from None
    scene = scene_of(objects, labels, colours, limits)
    figure = graph_objects.Figure()
    for item in scene.items:
        for k, shape in enumerate(item.shapes):
            trace = _trace(shape, item, scene)
            if trace is not None:
                kind, what = trace
                named = {"name": item.label, "showlegend": bool(item.label) and k == 0, "legendgroup": item.label}
                figure.add_trace(getattr(graph_objects, kind)(**what, **named))
        if item.label and item.shapes:
            place = anchor(item.shapes[0], scene.limits)
            kind = "Scatter3d" if scene.dimension == 3 else "Scatter"
            text = {"mode": "text", "text": [item.label], "textfont": {"color": item.colour}, "showlegend": False}
            figure.add_trace(getattr(graph_objects, kind)(**_coordinates(place[None]), **text))
    ranges = [{"range": list(map(float, limits))} for limits in scene.limits]
    if scene.dimension == 3:
        axes = dict(zip(("xaxis", "yaxis", "zaxis"), ranges, strict=True))
        figure.update_layout(scene={"aspectmode": "cube", **axes})
    else:
        figure.update_layout(xaxis=ranges[0], yaxis={**ranges[1], "scaleanchor": "x"})
    if file is not None:
        _write(figure, Path(file))
    return figure


def _write(figure: Any, file: Path) -> None:
    from ..generation.files import write

    write({file.name: figure.to_html(include_plotlyjs=True, full_html=True)}, file.parent)


def _coordinates(places: Any) -> dict[str, Any]:
    return dict(zip("xyz", np.asarray(places).T.tolist(), strict=False))


def _trace(shape: Shape, item: Item, scene: Scene) -> tuple[str, dict[str, Any]] | None:
    """Return the kind of a plotly trace and its arguments; None if the shape is outside the limits."""
    scatter = "Scatter3d" if scene.dimension == 3 else "Scatter"

    def lines(places: Any, imaginary: bool = False, mode: str = "lines") -> tuple[str, dict[str, Any]]:
        line = {"color": item.colour, "dash": "dash" if imaginary else "solid"}
        return scatter, {**_coordinates(places), "mode": mode, "line": line, "marker": {"color": item.colour}}

    match shape:
        case Points(places):
            marker = {"color": item.colour, "size": 5 if len(places) < 50 else 2}
            return scatter, {**_coordinates(places), "mode": "markers", "marker": marker}
        case Arrow(direction):
            return lines([np.zeros_like(direction), direction], mode="lines+markers")
        case Line():
            ends = clipped(shape, scene.limits)
            return None if ends is None else lines(ends)
        case PointPair(centre, direction, radius, imaginary):
            return lines(centre + np.outer([-radius, radius], direction), imaginary, "lines+markers")
        case Circle(centre, None, radius, imaginary):
            angle = np.linspace(0, 2 * np.pi, 97)
            return lines(centre + radius * np.stack([np.cos(angle), np.sin(angle)], -1), imaginary)
        case Circle():
            return lines(round_of(shape), shape.is_imaginary)
        case Sphere():
            x, y, z = net_of(shape)
            if shape.is_imaginary:
                meridians = [np.pad(a.T, ((0, 0), (0, 1)), constant_values=np.nan).ravel() for a in (x, y, z)]
                return lines(np.stack(meridians, -1), True)
            one = [[0, item.colour], [1, item.colour]]
            return "Surface", {"x": x, "y": y, "z": z, "opacity": 0.3, "colorscale": one, "showscale": False}
        case Plane():
            corners = polygon(shape, scene.limits)
            if corners is None:
                return None
            n = len(corners)
            fan = {"i": [0] * (n - 2), "j": list(range(1, n - 1)), "k": list(range(2, n))}
            return "Mesh3d", {**_coordinates(corners), **fan, "color": item.colour, "opacity": 0.3}
