"""Robots in a browser: one HTML file with a slider for each joint, computed by emitted JavaScript."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from generated import drawn_robots, pga3

from ..arguments import Reals
from .denavit_hartenberg import Joint
from .model import Model
from .tables import MOTOR, base_of, carried_by, is_floating, joints_of
from .visuals import visuals_of

_TABLES = ("parents", "variables", "ratios", "offsets", "places", "screws", "turns")
_SAMPLES = 200
"""Random configurations whose points the picture must show; more would hardly enlarge it."""
_BONES, _TIP = "#2f7de1", "tip"
_SLIDERS = 8
"""The largest number of sliders that a notebook shows below the picture without scrolling."""
_ROOM = 1.05
"""The picture is larger than what the samples reach by this factor."""
_DIGITS = 9
"""Numbers of the page are rounded to nanometres."""

_PROGRAM = """
const ROBOT = /*ROBOT*/, WORK = new Float64Array(places_of_points_work(ROBOT.k, ROBOT.n, ROBOT.v, ROBOT.c));
function scene(...values) {
  const q = Float64Array.from(ROBOT.q), out = Float64Array.from(ROBOT.still);
  values.forEach((value, k) => { q[ROBOT.sliders[k]] = value; });
  const t = ROBOT.tables;
  const moved = places_of_points(ROBOT.k, ROBOT.n, ROBOT.v, ROBOT.c, q, t.parents, t.variables, t.ratios, t.offsets,
    t.places, t.screws, t.turns, t.owners, t.points, t.base, undefined, WORK);
  ROBOT.moving.forEach((place, k) => { for (let i = 0; i < 3; i++) out[3 * place + i] = moved[3 * k + i]; });
  return out;
}
"""


class JointSlider(NamedTuple):
    """A variable of a robot between two limits, and where it starts."""

    name: str
    low: float
    high: float
    start: float


class _Drawn(NamedTuple):
    """Something drawn: its points, and the joint that carries each, -1 for the base."""

    kind: str
    label: str
    colour: str
    owners: Sequence[int]
    points: Reals
    faces: Any = None


class RobotView:
    """A robot in a page with sliders, as `Robot.view` returns it. A notebook displays it.

    Attributes
    ----------
    sliders : tuple of JointSlider
        One for each variable that its limits leave free, in radians or metres.
    missing : tuple of str
        Files of meshes that were not found, or are neither STL nor OBJ; these links are drawn as lines only.
    """

    def __init__(self, robot: Model, q: Reals, source: str | Path | None, arguments: Mapping[str, Any]) -> None:
        self._robot, self._q = robot, q
        visuals, missing = ([], []) if source is None else visuals_of(source, arguments)
        self.missing = tuple(missing)
        self._items = [*self._bones(), self._end()]
        for visual in visuals:
            if visual.link in robot.links:
                joint, motor = robot.links[visual.link]
                inside = carried_by(robot, joint, motor) if joint >= 0 else motor
                corners = pga3.move_point(inside, visual.corners)
                owners = [joint] * len(corners)
                self._items.append(_Drawn("body", "", visual.colour, owners, corners, visual.faces))
        self._variables, self.sliders = self._free()
        carriers = np.concatenate([np.array(item.owners, np.int64) for item in self._items])
        points = np.concatenate([item.points for item in self._items]).round(_DIGITS)
        self._moving = np.flatnonzero(carriers >= 0)
        self._still = points.copy()
        self._still[self._moving] = 0
        table = joints_of(robot)
        self._tables = {name: getattr(table, name) for name in _TABLES}
        self._tables |= {"base": base_of(robot).base, "owners": carriers[self._moving], "points": points[self._moving]}
        self._kernel = drawn_robots.places_of_points.bind({"k": robot.n_positions}, **self._tables)

    def at(self, /, **values: float) -> tuple[Reals, ...]:
        """Compute in Python what is drawn.

        Parameters
        ----------
        **values : float
            Values of sliders, by default where they start.

        Returns
        -------
        tuple of array, (k, 3)
            The points of each object: the lines of the robot, the axes of the end effector, and bodies.

        Raises
        ------
        ValueError
            If there is no slider of a name.
        """
        names = [slider.name for slider in self.sliders]
        q = self._q.copy()
        for name, value in values.items():
            if name not in names:
                raise ValueError(
                    f"{self._robot.name}: no slider {name!r}; expected one of {', '.join(names) or 'none'}"
                )
            q[self._variables[names.index(name)]] = value
        found = self._still.copy()
        found[self._moving] = self._kernel(q)
        return tuple(np.split(found, np.cumsum([len(item.points) for item in self._items])[:-1]))

    def save(self, path: str | Path) -> None:
        """Write the page to a file, which needs no network.

        Parameters
        ----------
        path : str or Path
            With the ending ``.html``. An existing file is replaced.

        Raises
        ------
        ValueError
            If the ending is another one.
        OSError
            If the file cannot be written.
        """
        target = Path(path)
        if target.suffix.lower() != ".html":
            raise ValueError(f"{target.name}: ending {target.suffix!r}; expected .html")
        target.write_text(self.html(), encoding="utf-8")

    def html(self) -> str:
        """Return the page, with everything that it needs."""
        page, program = (_text("gacompiler", f"objects/live.{ending}") for ending in ("html", "js"))
        inserted = {"KERNEL": self.javascript, "DATA": _json(self._data()), "PROGRAM": program}
        page = page.replace("<title>Live scene</title>", f"<title>{html.escape(self._robot.name)}</title>")
        return re.sub(r"/\*(KERNEL|DATA|PROGRAM)\*/", lambda found: inserted[found[1]], page)

    @property
    def javascript(self) -> str:
        """The emitted kernel, and the function ``scene`` of the values of the sliders."""
        lengths = {"k": self._robot.n_positions, "n": len(self._robot.kinds), "v": len(self._moving)}
        robot = {
            **lengths,
            "c": int(is_floating(self._robot)),
            "q": self._q.tolist(),
            "sliders": self._variables,
            "still": self._still.ravel().tolist(),
            "moving": self._moving.tolist(),
            "tables": {name: np.ravel(table).tolist() for name, table in self._tables.items()},
        }
        kernel = _text(__package__, "drawn_robots.mjs")
        return kernel + _PROGRAM.replace("/*ROBOT*/", _json(robot))

    def _repr_html_(self) -> str:
        height = 440 + 44 * min(len(self.sliders), _SLIDERS)
        page = html.escape(self.html())
        return f'<iframe srcdoc="{page}" title="robot" style="width:100%;height:{height}px;border:0"></iframe>'

    def _data(self) -> dict[str, Any]:
        """Return the data of the page, in the form of live scenes (`gacompiler.objects.view`)."""
        items, start = [], 0
        for item in self._items:
            part = {"label": item.label, "colour": item.colour, "kind": item.kind, "start": start}
            items.append({**part, "size": 3 * len(item.points), "faces": item.faces})
            start += 3 * len(item.points)
        sliders = [slider._asdict() for slider in self.sliders]
        return {
            "dimension": 3,
            "limits": self._limits(),
            "points": [],
            "sliders": sliders,
            "items": items,
            "size": start,
        }

    def _limits(self) -> list[list[float]]:
        """Return the limits of the picture: a cube around what random configurations reach, and the base."""
        rng = np.random.default_rng(0)
        low, high = (np.array([slider[k] for slider in self.sliders]) for k in (1, 2))
        q = np.tile(self._q, (_SAMPLES, 1))
        q[1:, self._variables] = rng.uniform(low, high, (_SAMPLES - 1, len(low)))
        found = np.concatenate([self._kernel(q).reshape(-1, 3), np.zeros((1, 3)), self._still])
        least, most = found.min(0), found.max(0)
        half = _ROOM * max(float((most - least).max()) / 2, 1e-3)
        middle = (least + most) / 2
        return np.stack([middle - half, middle + half], -1).tolist()  # type: ignore[no-any-return]

    def _bones(self) -> list[_Drawn]:
        """Return a line from the frame of each joint to that of the joint that it carries, and to the end effector."""
        robot = self._robot
        places = [self._inside(joint, home) for joint, home in enumerate(robot.home)]
        found = []
        for joint, parent in enumerate(robot.parents):
            start = places[parent] if parent >= 0 else np.zeros(3)
            if parent >= 0 or not is_floating(robot):
                found.append(_Drawn("chain", "", _BONES, (parent, joint), np.array([start, places[joint]])))
        tip = robot.tip
        end = np.array([places[tip], self._inside(tip, robot.tool)])
        return [*found, _Drawn("chain", "", _BONES, (tip, tip), end)]

    def _inside(self, joint: int, motor: Reals) -> Reals:
        """Return the origin of a frame that a joint carries in the frame of the joint; `motor` is its pose at home."""
        place: Reals = pga3.motor_to_rotor_translation(carried_by(self._robot, joint, motor))[1]
        return place

    def _end(self) -> _Drawn:
        """Return the axes of the end effector, a tenth as long as the lines to it."""
        robot = self._robot
        matrix = pga3.motor_to_matrix(carried_by(robot, robot.tip, robot.tool))
        origins = pga3.motor_to_matrix(robot.home[list(robot.path)])[:, :3, 3]
        size = float(np.linalg.norm(np.diff(origins, axis=0), axis=-1).sum()) / 10 or 0.1
        points = [matrix[:3, 3], *(matrix[:3, 3] + size * matrix[:3, k] for k in range(3))]
        return _Drawn("axes", _TIP, _BONES, (robot.tip,) * 4, np.array(points))

    def _free(self) -> tuple[list[int], tuple[JointSlider, ...]]:
        """Return the variables with sliders, and the sliders."""
        robot = self._robot
        shift = robot.n_positions - robot.n_joints
        variables, sliders = [], []
        for coordinate, joint in enumerate(robot.leaders):
            kind, name, variable = robot.kinds[joint], robot.joint_names[joint], coordinate + shift
            if kind is Joint.FLOATING:
                continue
            wide = np.pi if kind is Joint.REVOLUTE else 1.0
            low, high = map(float, robot.limits[coordinate, :2])
            low, high = (
                low if np.isfinite(low) else min(-wide, high - 2 * wide),
                high if np.isfinite(high) else max(wide, low + 2 * wide),
            )
            if low < high:
                self._q[variable] = min(max(float(self._q[variable]), low), high)
                variables.append(variable)
                sliders.append(JointSlider(name, low, high, float(self._q[variable])))
        return variables, tuple(sliders)


def view_of(robot: Model, q: Any, source: str | Path | None, arguments: Mapping[str, Any]) -> RobotView:
    """Return the view of a robot; see `Robot.view`."""
    if q is None:
        start = np.zeros(robot.n_positions)
        if is_floating(robot):
            start[:MOTOR] = np.eye(MOTOR)[0]
    else:
        start = np.array(robot._variables(q, "q")[0], float)
        if start.ndim != 1 or not np.isfinite(start).all():
            raise ValueError(f"{robot.name}: q of shape {start.shape}; expected one configuration of finite numbers")
    return RobotView(robot, start, source, arguments)


def _json(value: Any) -> str:
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c")


def _text(package: str, name: str) -> str:
    return files(package).joinpath(name).read_text(encoding="utf-8")
