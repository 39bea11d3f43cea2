"""Interactive pictures in a notebook or in one HTML file: fixed objects with plotly, live scenes by emitted code."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from ..errors import needs
from ..gac_runtime.annotations import Numbers
from .arrays import MultivectorArray
from .live_items import is_element
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
    from plotly.graph_objects import Figure

    from .live import LiveScene

_NONE: Mapping[str, Sequence[float]] = MappingProxyType({})


@overload
def view(
    *items: MultivectorArray,
    labels: Sequence[str] | None = None,
    colours: Sequence[str] | None = None,
    limits: Numbers | None = None,
    file: str | Path | None = None,
) -> Figure: ...
@overload
def view(
    *items: MultivectorArray | Callable[..., object],
    drag: MultivectorArray | Sequence[MultivectorArray] = (),
    sliders: Mapping[str, Sequence[float]] = _NONE,
    labels: Sequence[str] | None = None,
    colours: Sequence[str] | None = None,
    limits: Numbers | None = None,
    file: str | Path | None = None,
) -> LiveScene: ...
def view(
    *items: MultivectorArray | Callable[..., object],
    drag: MultivectorArray | Sequence[MultivectorArray] = (),
    sliders: Mapping[str, Sequence[float]] = _NONE,
    labels: Sequence[str] | None = None,
    colours: Sequence[str] | None = None,
    limits: Numbers | None = None,
    file: str | Path | None = None,
) -> LiveScene | Figure:
    """Create an interactive picture of objects, or a live scene of points that can be dragged and of sliders.

    Parameters
    ----------
    *items : MultivectorArray or callable
        Objects, as in `draw`. A function makes the scene live: it takes the dragged points in order, and sliders by the
        names of its parameters, and returns an object, a list of objects, or a dictionary of objects by label. Motors
        are drawn as moved coordinate axes. The function is recorded as a kernel: in place of functions
        of numpy, use those of `gacompiler`, such as `gacompiler.cos`.
    drag : MultivectorArray or sequence of these, optional
        Single points that can be dragged, where they start. Those that are also items are drawn themselves.
    sliders : mapping of str to tuple, optional
        Numbers by name: ``(low, high)`` or ``(low, high, start)``.
    labels, colours, limits
        As in `draw`; colours are CSS colours. Labels replace those of a dictionary.
    file : path, optional
        Write the picture to this HTML file, which can be viewed without a network connection.

    Returns
    -------
    LiveScene or plotly.graph_objects.Figure
        A notebook displays both. A live scene has ``save(path)`` for HTML, SVG and glTF, and needs no other package;
        it is recomputed in the browser by JavaScript that the compiler emits and proves.

    Raises
    ------
    AlgebraError
        If an object cannot be drawn, `drag` has something other than single finite points, or an object, a point or
        a slider has no effect: nothing drawn depends on it.
    LayoutError
        If a range, the number of labels, or the parameters of a function are wrong.
    BackendError
        If plotly is needed and not installed, or the file cannot be written.

    Examples
    --------
    >>> from gacompiler.objects import PGA2, view
    >>> p, q = PGA2.point(0, 0), PGA2.point(2, 1)
    >>> def scene(p, q, angle):
    ...     return {"p": p, "q": q, "line": p & q, "turned": PGA2.rotor(angle, p) >> q}
    >>> live = view(scene, drag=[p, q], sliders={"angle": (0, 6.28)})
    >>> live.at(p, q, angle=0.0)[3].isclose(q)
    True
    """
    if is_element(drag) or len(drag) or sliders or any(callable(x) and not is_element(x) for x in items):
        from .live import LiveScene

        live = LiveScene(items, drag, sliders, labels, colours, limits)
        if file is not None:
            live.save(file)
        return live
    with needs("pictures", "view"):
        graph_objects = importlib.import_module("plotly.graph_objects")
    scene = scene_of(items, labels, colours, limits)
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
        case Frame(places):
            gaps = np.full_like(places[0], np.nan)
            axes = np.concatenate([[places[0], end, gaps] for end in places[1:]])
            colours = np.repeat(AXES[: len(places) - 1], 3).tolist()
            if scene.dimension == 3:
                return scatter, {**_coordinates(axes), "mode": "lines", "line": {"color": colours}}
            return scatter, {**_coordinates(axes), "mode": "lines+markers", "marker": {"color": colours}}
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
