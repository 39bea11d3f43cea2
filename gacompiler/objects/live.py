"""Live scenes: objects that follow dragged points and sliders, recomputed in a browser by emitted JavaScript."""

from __future__ import annotations

import html
import io
import json
import keyword
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.catalog import CGA2, CGA3, PGA2, PGA3
from ..algebra.layout import SCALAR, Layout
from ..errors import AlgebraError, GacError, LayoutError, needs
from ..frontend.expression import Expression, topological
from ..frontend.kernel import Kernel, Parameter, array, trace
from ..passes.decide import decide
from ..passes.rewrite import rewrite
from .drawn import DIMENSIONS, kind_of, numbers_of
from .live_items import Item, Named, is_element, slider_of
from .scene import COLOURS, Points, Scene, scene_of, shapes_of

REMEDY = "pass a function of what is dragged, as in view(lambda p, q: [p, q, p & q], drag=[p, q])"
_NAME = "scene"
_ROOM = 1.25
"""The picture is larger than the objects at the start by this factor, so that there is room to drag them."""


class LiveScene:
    """A scene that is recomputed while points are dragged and sliders are moved; created by `view`.

    Attributes
    ----------
    points : tuple of MultivectorArray
        The points that can be dragged, where they start.
    sliders : tuple of Slider
    labels, colours : tuple of str
        One for each object.
    kernel : Kernel or None
        What is recomputed: its result is an array of the numbers that are drawn. None if only dragged points are drawn.
    """

    def __init__(
        self,
        items: Sequence[Any],
        drag: Any,
        sliders: Mapping[str, Sequence[float]],
        labels: Sequence[str] | None,
        colours: Sequence[str] | None,
        limits: Any,
    ) -> None:
        if not items:
            raise AlgebraError("view", "no object", "at least one", REMEDY)
        dragged = (drag,) if is_element(drag) else tuple(drag)
        self.points = tuple(_point(k, x) for k, x in enumerate(dragged))
        self.sliders = tuple(slider_of(name, given) for name, given in sliders.items())
        self._items = tuple(Item(x, dragged, self.sliders) for x in items)
        self._check_items()
        named = self._named(self.points, [each.start for each in self.sliders])
        self._start = [each.value for each in named]
        for what, given in (("labels", labels), ("colours", colours)):
            if given is not None and len(given) != len(named):
                raise LayoutError("view", f"{len(given)} {what}", f"{len(named)}, one for each object")
        self.labels = tuple(labels or [each.label for each in named])
        self.colours = tuple(colours or [COLOURS[k % len(COLOURS)] for k in range(len(named))])
        self._limits = limits
        self._parts: list[dict[str, Any]] = []
        self.kernel = self._recorded()

    def at(self, *points: Any, **values: float) -> tuple[Any, ...]:
        """Compute the objects of the scene in Python.

        Parameters
        ----------
        *points : MultivectorArray
            The dragged points; by default where they start.
        **values : float
            Values of sliders; by default where they start.

        Returns
        -------
        tuple of MultivectorArray

        Raises
        ------
        LayoutError
            If the number of points is another one, or there is no slider of a name.
        """
        names = [each.name for each in self.sliders]
        for name in values:
            if name not in names:
                raise LayoutError("at", f"the slider {name!r}", f"one of {', '.join(names) or 'none'}")
        if points and len(points) != len(self.points):
            raise LayoutError("at", f"{len(points)} points", f"{len(self.points)}")
        numbers = [float(values.get(each.name, each.start)) for each in self.sliders]
        return tuple(each.value for each in self._named(points or self.points, numbers))

    def save(self, path: Any) -> None:
        """Write the scene to a file.

        Parameters
        ----------
        path : path
            ``.html`` for the live scene, in one file that needs no network. ``.svg`` for a picture by matplotlib and
            ``.gltf`` for a model, both of the scene as it starts.

        Raises
        ------
        LayoutError
            If the ending is another one.
        BackendError
            If the file cannot be written.
        """
        from ..generation.files import write

        target = Path(path)
        writers = {".html": self.html, ".svg": self._svg, ".gltf": self._gltf}
        if target.suffix.lower() not in writers:
            raise LayoutError("save", f"the ending {target.suffix!r} of {target.name}", ".html, .svg or .gltf")
        write({target.name: writers[target.suffix.lower()]()}, target.parent)

    def html(self) -> str:
        """Return the page of the live scene, with everything that it needs."""
        texts = {name: (files(__package__) / f"live.{name}").read_text(encoding="utf-8") for name in ("html", "js")}
        data = json.dumps(self._data(), allow_nan=False).replace("<", "\\u003c")
        inserted = {"KERNEL": self.javascript, "DATA": data, "PROGRAM": texts["js"]}
        return re.sub(r"/\*(KERNEL|DATA|PROGRAM)\*/", lambda found: inserted[found[1]], texts["html"])

    def _repr_html_(self) -> str:
        height = 440 + 44 * len(self.sliders)
        page = html.escape(self.html())
        return f'<iframe srcdoc="{page}" title="live scene" style="width:100%;height:{height}px;border:0"></iframe>'

    @cached_property
    def javascript(self) -> str:
        """The emitted module: its function ``scene`` takes coordinates of the points, and the values of the sliders."""
        if self.kernel is None:
            return ""
        from ..generation.cache import open_cache
        from ..generation.compiling import compile_spec
        from ..generation.rendering import render_targets
        from ..generation.spec_files import Spec

        spec = Spec(_NAME, "gacompiler.objects.view", "A live scene.", "", (self.kernel,), Path())
        (text,) = render_targets(compile_spec(spec, cache=open_cache()), ["javascript"]).values()
        return text

    def _named(self, points: Sequence[Any], values: Sequence[Any]) -> list[Named]:
        return [each for item in self._items for each in item.named(points, values)]

    def _check_items(self) -> None:
        """Refuse fixed objects beside dragged points only: they look as if they would follow."""
        if any(item.function for item in self._items):
            return
        for k, item in enumerate(self._items):
            if item.point is None:
                raise AlgebraError(
                    "view", f"object {k}, whose numbers do not follow what is dragged", "dragged points or functions",
                    REMEDY,
                )  # fmt: skip

    def _check_use(self, found: Sequence[Any], symbols: Sequence[Any]) -> None:
        """Refuse dragged points on which nothing depends, and sliders that no function uses."""
        used = set(topological([x for x in found if isinstance(x, Expression)]))
        count = len(self.points)
        for k, symbol in enumerate(symbols):
            if symbol in used or (k >= count and not any(item.function for item in self._items)):
                continue
            if k < count:
                raise AlgebraError("view", f"no object that depends on drag[{k}]", "an object that follows it", REMEDY)
            name = self.sliders[k - count].name
            raise AlgebraError(
                "view", f"no object that depends on the slider {name!r}", "a function that uses it",
                f"as in view(lambda {name}: [...], sliders=...)",
            )  # fmt: skip

    def _recorded(self) -> Kernel | None:
        """Record the scene as a kernel, and what is drawn of its result."""
        names = [f"point_{k + 1}" for k in range(len(self.points))]
        names += [_parameter(k, each.name) for k, each in enumerate(self.sliders)]
        layouts = [*(x.layout for x in self.points), *(SCALAR for _ in self.sliders)]
        parameters = tuple(Parameter(name, layout) for name, layout in zip(names, layouts, strict=True))
        count = len(self.points)

        def computed(*given: Any) -> list[Any]:
            return [each.value for each in self._named(given[:count], given[count:])]

        symbols = [parameter.symbols() for parameter in parameters]
        found = _traced(self._items, computed, parameters)
        self._check_use(found, symbols)
        moving = [k for k, x in enumerate(found) if isinstance(x, Expression) and x not in symbols[:count]]
        kinds: dict[int, tuple[str, int]] = {}
        if moving:
            chosen = Kernel(_NAME, lambda *given: tuple(computed(*given)[k] for k in moving), parameters, None, "")
            for k, layout in zip(moving, _layouts(chosen), strict=True):
                kinds[k] = kind_of("view", layout), max(blade.bit_count() for blade in layout.support)
        self._parts = [self._part(k, found[k], symbols[:count], kinds) for k in range(len(found))]
        if not moving:
            return None

        def drawn(*given: Any) -> list[Any]:
            values, numbers = computed(*given), []
            for k, (kind, grade) in kinds.items():
                numbers += numbers_of(values[k] if kind == "frame" else values[k].grade(grade), kind, grade)
            return numbers

        count_of_numbers = 0
        for k, (kind, grade) in kinds.items():
            size = len(numbers_of(found[k].grade(grade), kind, grade))
            self._parts[k] |= {"start": count_of_numbers, "size": size}
            count_of_numbers += size
        returns = array(SCALAR, count_of_numbers)
        return Kernel(_NAME, drawn, parameters, returns, "Compute the numbers that a scene draws.")

    def _part(self, k: int, x: Any, symbols: Sequence[Any], kinds: Mapping[int, tuple[str, int]]) -> dict[str, Any]:
        """Return how an object is drawn: as a dragged point, from numbers of the kernel, or as fixed shapes."""
        named = {"label": self.labels[k], "colour": self.colours[k]}
        if isinstance(x, Expression) and x in symbols:
            return {**named, "point": symbols.index(x)}
        if k in kinds:
            return {**named, "kind": kinds[k][0]}
        if not is_element(x):
            raise AlgebraError("view", f"a result of type {type(x).__name__}", "objects", REMEDY)
        if not np.isfinite(x.values).all():
            raise AlgebraError("view", f"object {k} with coefficients that are not finite", "finite ones")
        return {**named, "shapes": [_plain(shape) for shape in shapes_of(x)]}

    @cached_property
    def _scene(self) -> Scene:
        """The objects that can be drawn as they start."""
        rows = list(zip(self._start, self.labels, self.colours, strict=True))
        kept = [row for row in rows if _has_shape(row[0])] or [(x, "", COLOURS[0]) for x in self.points]
        if not kept:
            kept = [(_space(self._start[0].algebra)._origin, "", COLOURS[0])]
        objects, labels, colours = zip(*kept, strict=True)
        return scene_of(objects, labels, colours, self._limits)

    def _data(self) -> dict[str, Any]:
        limits = np.asarray(self._scene.limits)
        if self._limits is None:
            middle = limits.mean(axis=1, keepdims=True)
            limits = middle + _ROOM * (limits - middle)
        return {
            "dimension": self._scene.dimension,
            "limits": limits.tolist(),
            "points": [np.asarray(x.values, float).tolist() for x in self.points],
            "sliders": [each._asdict() for each in self.sliders],
            "items": self._parts,
            "size": self.kernel.returns.shape[0] if self.kernel else 0,  # type: ignore[union-attr]
        }

    def _svg(self) -> str:
        with needs("pictures", "save"):
            from matplotlib import pyplot

        from .draw import draw_scene

        axes = draw_scene(self._scene)
        stream = io.StringIO()
        axes.figure.savefig(stream, format="svg", metadata={"Date": None})
        pyplot.close(axes.figure)
        return stream.getvalue()

    def _gltf(self) -> str:
        from .gltf import gltf_of

        return gltf_of(self._scene)


def _space(algebra: Algebra) -> Any:
    from . import conformal, projective

    spaces = {PGA2: projective.PGA2, PGA3: projective.PGA3, CGA2: conformal.CGA2, CGA3: conformal.CGA3}
    return spaces[algebra]


def _point(k: int, x: Any) -> Any:
    """Return a dragged point in the layout of points.

    Raises
    ------
    AlgebraError
        If it is not a single finite point.
    """
    shapes = shapes_of(x) if is_element(x) and getattr(x, "algebra", None) in DIMENSIONS and x.shape == () else []
    match shapes:
        case [Points(places)] if np.isfinite(places).all():
            return _space(x.algebra).point(*map(float, places[0]))
    what = x.explain() if is_element(x) and hasattr(x, "explain") else f"{type(x).__name__}"
    raise AlgebraError("view", f"drag[{k}] is {what}", "a single finite point of PGA2, PGA3, CGA2 or CGA3")


def _has_shape(x: Any) -> bool:
    """Whether an object has a picture where the scene starts; the line through a point and itself has none."""
    try:
        return bool(shapes_of(x))
    except AlgebraError:
        return False


def _parameter(k: int, name: str) -> str:
    return (
        name if name.isidentifier() and not keyword.iskeyword(name) and not name.startswith("point_") else f"slider_{k}"
    )


def _traced(items: Sequence[Item], computed: Callable[..., list[Any]], parameters: tuple[Parameter, ...]) -> list[Any]:
    """Call the functions of a scene on symbols; errors name the line of the function."""
    found: list[Any] = []

    def called(*given: Any) -> Any:
        found[:] = computed(*given)
        return given[0]

    if not parameters:
        return computed()
    try:
        trace(Kernel(_NAME, partial(called), parameters, None, ""))  # partial: no file and line, which are not here
    except GacError as error:
        origin = error.__cause__ or error.__context__ or error
        places = [Kernel(_NAME, item.function, (), None, "").place_of(origin) for item in items if item.function]
        raise error.at(next(filter(None, places), "view").partition(": kernel")[0]) from origin
    return found


def _layouts(kernel: Kernel) -> tuple[Layout, ...]:
    traced = trace(kernel)
    return decide(traced, tuple(rewrite(traced.expressions).values())).layouts


def _plain(shape: Any) -> dict[str, Any]:
    """Return a shape for the page: the names of its fields are those of the classes of `scene`."""
    fields = {name: getattr(shape, name) for name in shape.__dataclass_fields__}
    plain = {name: x.tolist() if isinstance(x, np.ndarray) else x for name, x in fields.items()}
    return {"type": type(shape).__name__, **{name.removeprefix("is_"): x for name, x in plain.items()}}
