"""URDF texts of a parallel gripper, of a gripper with linkages, and of a hand with four fingers.

The texts are our own. Lengths, axes and limits are those of the makers' public descriptions: `franka_description`
(Apache 2.0), `robotiq_2f_85_gripper_visualization` (BSD), and `allegro_hand_description` (BSD), without masses. The
makers' parts are meshes or boxes; here they are cylinders, and spheres at the fingertips.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import asin, atan2, dist

Point = Sequence[float]


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _rod(start: Point, end: Point, radius: float) -> str:
    """Return the collision element of a cylinder between two points; a sphere if they are equal."""
    middle = _numbers((a + b) / 2 for a, b in zip(start, end, strict=True))
    length = dist(start, end)
    if length == 0:
        return f'<collision><origin xyz="{middle}"/><geometry><sphere radius="{radius}"/></geometry></collision>'
    x, y, z = ((b - a) / length for a, b in zip(start, end, strict=True))
    angles = _numbers((asin(-y), atan2(x, z), 0))
    return (
        f'<collision><origin xyz="{middle}" rpy="{angles}"/>'
        f'<geometry><cylinder radius="{radius}" length="{length:.9g}"/></geometry></collision>'
    )


def _link(name: str, *parts: str) -> str:
    return f'<link name="{name}">{"".join(parts)}</link>'


def _joint(
    name: str,
    ends: tuple[str, str],
    place: Point,
    angles: Point = (0, 0, 0),
    axis: Point = (0, 0, 1),
    limits: tuple[float, float] | None = None,
    kind: str = "revolute",
    mimic: tuple[str, float] | None = None,
) -> str:
    """Return a joint; a fixed one without limits."""
    parts = [
        f'<joint name="{name}" type="{kind if limits else "fixed"}">',
        f'<parent link="{ends[0]}"/><child link="{ends[1]}"/>',
        f'<origin xyz="{_numbers(place)}" rpy="{_numbers(angles)}"/><axis xyz="{_numbers(axis)}"/>',
    ]
    if limits:
        parts.append(f'<limit lower="{limits[0]}" upper="{limits[1]}" velocity="1" effort="1"/>')
    if mimic:
        parts.append(f'<mimic joint="{mimic[0]}" multiplier="{mimic[1]}"/>')
    return "".join((*parts, "</joint>"))


def _robot(name: str, *parts: str) -> str:
    return f'<robot name="{name}">{"".join(parts)}</robot>'


def _franka() -> str:
    palm = _link("hand", _rod((0, -0.07, 0.033), (0, 0.07, 0.033), 0.033))
    found = [palm]
    for finger, side in enumerate((1, -1), 1):
        name, tip = f"finger {finger}", f"tip {finger}"
        found += [
            _link(
                name,
                _rod((0, side * 0.0185, 0.008), (0, side * 0.0185, 0.014), 0.011),
                _rod((0, side * 0.0165, 0.018), (0, side * 0.0095, 0.036), 0.0085),
                *(_rod((x, side * 0.0076, 0.042), (x, side * 0.0076, 0.0469), 0.0076) for x in (-0.001, 0.001)),
            ),
            _link(tip, _rod((0, 0, 0), (0, 0, 0), 0.0076)),
            _joint(
                f"slide {finger}", ("hand", name), (0, 0, 0.0584), axis=(0, side, 0), limits=(0.0, 0.04),
                kind="prismatic", mimic=("slide 1", 1) if finger == 2 else None,
            ),
            _joint(f"to {tip}", (name, tip), (0, side * 0.0076, 0.0469)),
        ]  # fmt: skip
    return _robot("franka hand", *found)


def _robotiq() -> str:
    palm = _link(
        "base", _rod((0, -0.012, 0.03), (0, 0.012, 0.03), 0.037), _rod((0, -0.03, 0.055), (0, 0.03, 0.055), 0.011)
    )
    found = [palm]
    for finger, turn in ((1, 3.141592653589793), (2, 0.0)):
        outer, inner, tip = (f"{part} {finger}" for part in ("outer", "inner", "tip"))
        # The fingertip is at the end of the pad, which is 37.5 mm long.
        pad, end = (-0.02202, 0.03242), 0.0155
        found += [
            _link(
                outer,
                _rod((0, 0, 0), (0, 0.0315, -0.0041), 0.009),
                _rod((0, 0.0315, -0.0041), (0, 0.0376, 0.043), 0.008),
            ),
            _link(
                inner,
                _rod((0, -0.002, 0.004), (0, -0.013, 0.032), 0.0075),
                *(
                    _rod((x, pad[0], pad[1] - end), (x, pad[0], pad[1] + end), 0.0032)
                    for x in (-0.0078, -0.0026, 0.0026, 0.0078)
                ),
            ),
            _link(tip, _rod((0, 0, 0), (0, 0, 0), 0.0032)),
            _joint(
                f"knuckle {finger}", ("base", outer), (0, 0.0306011 if turn == 0 else -0.0306011, 0.054904),
                (0, 0, turn), (1, 0, 0), (0.0, 0.81), mimic=("knuckle 1", 1) if finger == 2 else None,
            ),
            _joint(
                f"finger {finger}", (outer, inner), (0, 0.0376, 0.043), (0, 0, 0), (1, 0, 0), (-0.81, 0.0),
                mimic=("knuckle 1", -1),
            ),
            _joint(f"to {tip}", (inner, tip), (0, pad[0], pad[1] + end)),
        ]  # fmt: skip
    return _robot("robotiq 2f-85", *found)


_FINGER = (0.0164, (-0.47, 0.47), (0, 0, 1)), (0.054, (-0.196, 1.61), (0, 1, 0)), \
    (0.0384, (-0.174, 1.709), (0, 1, 0)), (0.0267, (-0.227, 1.618), (0, 1, 0))  # fmt: skip
"""Of each link of a finger of the Allegro hand: its length, and the limits and the axis of its joint."""
_THUMB = (0.0177, (-0.105, 1.163), (0, 0, 1)), (0.0514, (-0.189, 1.644), (0, 1, 0)), \
    (0.0423, (-0.162, 1.719), (0, 1, 0))  # fmt: skip
"""The same of the thumb of the Allegro hand."""
_ROOTS = ((-0.08726646, 0, 0), (0, 0.0435, -0.001542)), ((0, 0, 0), (0, 0, 0.0007)), \
    ((0.08726646, 0, 0), (0, -0.0435, -0.001542))  # fmt: skip
"""Of each finger of the Allegro hand: the angles and the place of its root in the palm."""
_RADIUS, _TIP = 0.0125, 0.012
"""The radii of the links and of the tips of fingers of the Allegro hand, in metres."""


def _chain(
    name: str, parent: str, place: Point, angles: Point, links: Sequence[tuple[float, tuple[float, float], Point]]
) -> list[str]:
    """Return the links and joints of a finger, with a fingertip at its end."""
    found = []
    for number, (length, limits, axis) in enumerate(links):
        own = f"{name} {number}"
        last = number == len(links) - 1
        end = length if not last else length - 0.004
        found += [
            _link(own, _rod((0, 0, 0), (0, 0, end), _RADIUS if not last else _TIP)),
            _joint(f"joint {own}", (parent, own), place, angles, axis, limits),
        ]
        parent, place, angles = own, (0, 0, length), (0, 0, 0)
    tip = f"{name} tip"
    return [*found, _link(tip, _rod((0, 0, 0), (0, 0, 0), _TIP)), _joint(f"to {tip}", (parent, tip), place)]


def _allegro() -> str:
    rods = [_rod((-0.0093, y, -0.0775), (-0.0093, y, -0.0175), 0.0195) for y in (-0.037, -0.0185, 0.0, 0.0185, 0.037)]
    found = [_link("palm", *rods)]
    for number, (angles, place) in enumerate(_ROOTS):
        found += _chain(f"finger {number}", "palm", place, angles, _FINGER)
    found += [
        _link("thumb root", _rod((-0.0179, 0.002, 0.004), (-0.0225, 0.006, 0.03), 0.0165)),
        _joint(
            "joint thumb root", ("palm", "thumb root"), (-0.0182, 0.019333, -0.045987),
            (0, -1.65806278845, -1.5707963259), (-1, 0, 0), (0.263, 1.396),
        ),
        *_chain("thumb", "thumb root", (-0.027, 0.005, 0.0399), (0, 0, 0), _THUMB),
    ]  # fmt: skip
    return _robot("allegro", *found)


FRANKA_HAND = _franka()
"""A parallel gripper: two slides, of which the second follows the first, up to 80 mm apart."""
ROBOTIQ_2F_85 = _robotiq()
"""A gripper whose pads remain parallel: the joint of each pad turns back by the angle of the knuckle, which mimics."""
ALLEGRO = _allegro()
"""The right Allegro hand: three fingers and a thumb of four joints each. Fingers extend along z and close towards x."""
