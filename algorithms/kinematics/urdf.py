"""Robots from URDF files: links, joints, inertias, limits, and joints that follow others.

Visual and collision elements and data for controllers are ignored. Lengths are in metres, angles in radians. `rpy`
holds rotations about the fixed axes x, y, z in this order (http://wiki.ros.org/urdf/XML).
One format in one file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import sqrt
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any
from warnings import warn
from xml.etree import ElementTree

import numpy as np

from generated import pga3, vga3

from . import xacro
from .bodies import is_tensor
from .constants import Floats
from .denavit_hartenberg import Joint
from .errors import (
    CyclicTreeError,
    DescriptionError,
    InertiaWarning,
    JointCountError,
    NotFiniteError,
    UnknownJointTypeError,
)
from .masses import fault_of, joined, placed
from .tables import FREEDOMS

_X, _Y, _Z = np.eye(3)
"""The axes of a frame."""
_MOST = np.sqrt(np.finfo(float).max)
UNLIMITED = (-np.inf, np.inf, np.inf, np.inf)
"""Lower and upper limit, velocity and effort of a joint without limits."""
NO_ARGUMENTS: Mapping[str, object] = MappingProxyType({})
"""The arguments of files that declare none."""
TEXT = "text"
"""How errors name a robot that is described by a text rather than a file."""
_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")


@dataclass(slots=True)
class Link:
    """A link as described in the file.

    `body` is the mass, centre and tensor about the centre in the frame of the link, or None. `fault` describes an
    inconsistent tensor.
    """

    name: str
    body: Floats | None
    fault: str = ""


@dataclass(slots=True)
class Connection:
    """A joint as described in the file."""

    name: str
    type: str
    parent: str
    child: str
    origin: Floats
    axis: Floats
    limits: tuple[float, float, float, float]
    mimic: tuple[str, float, float] | None


@dataclass(slots=True)
class _Found:
    """Data collected while the tree is traversed."""

    kinds: list[Joint] = field(default_factory=list)
    axes: list[Floats] = field(default_factory=list)
    home: list[Floats] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    limits: list[tuple[float, float, float, float]] = field(default_factory=list)
    mimics: list[tuple[str, float, float] | None] = field(default_factory=list)
    bodies: list[list[Floats]] = field(default_factory=list)
    without_inertia: list[str] = field(default_factory=list)
    links: dict[str, tuple[int, Floats]] = field(default_factory=dict)
    depths: dict[str, int] = field(default_factory=dict)


def read(
    source: str | Path, tip: str | None, locked: Iterable[str], base: str, arguments: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the fields of a `Model` from a file or its text; see `Robot.from_urdf`."""
    root, where = described(source, arguments)
    links = _links(root, where)
    name = root.get("name", "robot" if where == TEXT else Path(where).stem)
    return fields_of(name, links, _joints(root, links, where), tip, locked, base, where)


def described(source: str | Path, arguments: Mapping[str, Any]) -> tuple[ElementTree.Element, str]:
    """Return the description of a robot without macros, and how to name it in errors."""
    root, where, folder = root_of(source, "robot")
    if arguments or xacro.has_macros(root):
        return xacro.expanded(root, arguments, folder, where), where
    return root, where


def root_of(source: str | Path, *tags: str) -> tuple[ElementTree.Element, str, Path | None]:
    """Return the root element of a file or of a text of XML, how to name it in errors, and the folder of a file."""
    if not isinstance(source, (str, PathLike)):
        raise TypeError(
            f"path: {source!r} of type {type(source).__name__}; expected the name of a file, a Path, or a text of XML"
        )
    is_text = isinstance(source, str) and source.lstrip().startswith("<")
    where = TEXT if is_text else str(source)
    try:
        root = ElementTree.fromstring(str(source).lstrip()) if is_text else ElementTree.parse(source).getroot()
    except ElementTree.ParseError as error:
        raise DescriptionError(f"{where}: not XML ({error})") from None
    if root.tag not in tags:
        raise DescriptionError(f"{where}: <{root.tag}>; expected <{tags[0]}>")
    return root, where, None if is_text else Path(source).parent


def fields_of(
    name: str,
    links: dict[str, Link],
    joints: list[Connection],
    tip: str | None,
    locked: Iterable[str],
    base: str,
    where: str,
) -> dict[str, Any]:
    """Return the fields of a `Model` from links and joints."""
    if base not in ("fixed", "floating", "euler"):
        raise ValueError(f"base: {base!r}; expected 'fixed', 'floating' or 'euler'")
    for link in links.values():
        if link.fault:
            warn(f"{where}: link {link.name!r}: {link.fault}; no rigid body has such an inertia", InertiaWarning, 4)
    held = {locked} if isinstance(locked, str) else set(locked)
    unknown = held - {joint.name for joint in joints}
    if unknown:
        raise DescriptionError(f"{where}: no joint {sorted(unknown)[0]!r} to lock; its joints are {_names(joints)}")
    start = _root_link(links, joints, where)
    first = [joint for joint in joints if joint.parent == start]
    if base != "fixed" and len(first) == 1 and first[0].type == "floating" and first[0].name not in held:
        # the file itself describes a floating base
        start, joints = first[0].child, [joint for joint in joints if joint is not first[0]]
    with np.errstate(over="ignore", invalid="ignore"):  # overflow raises an error below
        found = _walk(start, links, joints, held, base, where)
        bodies = [_together(parts, name, where) for parts, name in zip(found.bodies, found.names, strict=True)]
    if not found.kinds:
        raise JointCountError(f"{where}: no moving joint; expected at least one")
    moving = [name for name, (joint, _) in found.links.items() if joint >= 0]
    last = tip if tip is not None else max(moving, key=lambda name: found.depths[name])
    if last not in found.links:
        raise DescriptionError(f"{where}: no link {last!r}; expected one of {', '.join(found.links)}")
    carrier, tool = found.links[last]
    if carrier < 0:
        raise DescriptionError(f"{where}: link {last!r} does not move; expected an end effector that a joint carries")
    coupling, leaders = _coupling(found, where)
    return {
        "name": name,
        "kinds": tuple(found.kinds),
        "axes": np.array(found.axes),
        "home": np.array(found.home),
        "parents": tuple(found.parents),
        "joint_names": tuple(found.names),
        "tip": carrier,
        "tool": tool,
        "bodies": np.array(bodies),
        "without_inertia": tuple(found.without_inertia),
        "limits": np.array([found.limits[joint] for joint in leaders]),
        "coupling": coupling,
        "leaders": leaders,
        "links": found.links,
    }


def _names(joints: Sequence[Connection]) -> str:
    return ", ".join(joint.name for joint in joints)


def numbers(
    element: ElementTree.Element | None, key: str, default: str | None, count: int, where: str, infinite: bool = False
) -> Floats:
    """Return the numbers of an attribute, or raise an error if they are missing, too few, too many or not finite."""
    text = default if element is None else element.get(key, default)
    if text is None:
        raise DescriptionError(f"{where}: no {key}; expected a number")
    try:
        values = np.array([float(part) for part in text.split()])
    except ValueError:
        raise NotFiniteError(f"{where}: {key}={text!r}; expected {count} numbers") from None
    if len(values) != count:
        raise DescriptionError(f"{where}: {key}={text!r}; expected {count} numbers")
    if np.isnan(values).any() or not (infinite or np.isfinite(values).all()):
        raise NotFiniteError(f"{where}: {key}={text!r}; expected finite numbers")
    return values


def _number(
    element: ElementTree.Element | None, key: str, default: str | None, where: str, infinite: bool = False
) -> float:
    return float(numbers(element, key, default, 1, where, infinite)[0])


def length_of(vector: Floats) -> float:
    """Return the length of a vector, with the same order of summation on every machine.

    `gac robot` writes the results into specs.
    """
    x, y, z = map(float, vector)
    return sqrt(x * x + y * y + z * z)


def origin_of(element: ElementTree.Element | None, where: str) -> Floats:
    """Return the motor of an <origin>."""
    r, p, y = numbers(element, "rpy", "0 0 0", 3, where)
    rotors = [pga3.rotor_from_axis_angle(axis, angle) for axis, angle in ((_Z, y), (_Y, p), (_X, r))]
    motors = [pga3.motor_from_rotor_translation(rotor, np.zeros(3)) for rotor in rotors]
    motors[0] = pga3.motor_from_rotor_translation(rotors[0], numbers(element, "xyz", "0 0 0", 3, where))
    return pga3.motor_product(pga3.motor_product(motors[0], motors[1]), motors[2])  # type: ignore[no-any-return]


def _links(root: ElementTree.Element, where: str) -> dict[str, Link]:
    found: dict[str, Link] = {}
    for element in root.findall("link"):
        name = element.get("name", "")
        if name in found:
            raise DescriptionError(f"{where}: two links {name!r}; expected different names")
        found[name] = _link(name, element.find("inertial"), f"{where}: link {name!r}")
    if not found:
        raise DescriptionError(f"{where}: no link; expected at least one")
    return found


def _link(name: str, element: ElementTree.Element | None, where: str) -> Link:
    """Return a link with its <inertial>, or without a body if that, its mass or its tensor is missing."""
    if element is None or element.find("mass") is None or element.find("inertia") is None:
        return Link(name, None)
    mass = _number(element.find("mass"), "value", None, where)
    tensor = [_number(element.find("inertia"), key, None, where) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")]
    if mass < 0 or not is_tensor(tensor):
        raise DescriptionError(f"{where}: mass {mass}, inertia {tensor}; expected no negative mass, ixx, iyy, izz")
    place = origin_of(element.find("origin"), where)
    with np.errstate(over="ignore", invalid="ignore"):
        body = _known(placed(place, np.array([mass, 0, 0, 0, *tensor])), f"{where}: its inertia")
    return Link(name, body, fault_of(tensor))


def _known(numbers: Floats, what: str) -> Floats:
    """Return `numbers`, or raise an error if they or their products overflow."""
    if not np.isfinite(np.square(numbers)).all():
        raise NotFiniteError(
            f"{what} has numbers beyond {_MOST:.0e}; expected lengths and masses whose products do not overflow"
        )
    return numbers


def _together(parts: Sequence[Floats], joint: str, where: str) -> Floats:
    """Return all bodies that a joint carries as one body."""
    return _known(joined(parts), f"{where}: the inertia that joint {joint!r} carries")


def _joints(root: ElementTree.Element, links: dict[str, Link], where: str) -> list[Connection]:
    found: list[Connection] = []
    carried: dict[str, str] = {}
    for element in root.findall("joint"):
        name, type_ = element.get("name", ""), element.get("type", "")
        here = f"{where}: joint {name!r}"
        if type_ not in _TYPES:
            raise UnknownJointTypeError(f"{here}: type {type_!r}; expected one of {', '.join(_TYPES)}")
        if any(joint.name == name for joint in found):
            raise DescriptionError(f"{where}: two joints {name!r}; expected different names")
        ends = []
        for tag in ("parent", "child"):
            end = element.find(tag)
            link = "" if end is None else end.get("link", "")
            if link not in links:
                raise DescriptionError(f"{here}: {tag} {link!r} is no link; expected one of {', '.join(links)}")
            ends.append(link)
        if ends[1] in carried:
            raise CyclicTreeError(
                f"{here}: link {ends[1]!r} is carried by {carried[ends[1]]!r} already; expected a tree"
            )
        carried[ends[1]] = name
        axis = numbers(element.find("axis"), "xyz", "1 0 0", 3, here)
        length = length_of(axis)
        if type_ not in ("fixed", "floating") and length == 0:
            raise DescriptionError(f"{here}: axis of length 0; expected a nonzero direction")
        mimic = element.find("mimic")
        found.append(
            Connection(
                name,
                type_,
                ends[0],
                ends[1],
                origin_of(element.find("origin"), here),
                axis / (length or 1.0),
                _limits(element.find("limit"), type_, here),
                None
                if mimic is None
                else (
                    mimic.get("joint", ""),
                    _number(mimic, "multiplier", "1", here),
                    _number(mimic, "offset", "0", here),
                ),
            )
        )
    return found


def _limits(element: ElementTree.Element | None, type_: str, where: str) -> tuple[float, float, float, float]:
    if element is None or type_ == "fixed":  # limits of fixed joints are meaningless
        return UNLIMITED
    free = type_ in ("continuous", "floating", "planar")
    low = -np.inf if free else _number(element, "lower", "0", where, infinite=True)
    high = np.inf if free else _number(element, "upper", "0", where, infinite=True)
    if low > high:
        raise DescriptionError(f"{where}: limits {low} to {high}; expected the lower limit first")
    speed, effort = (_number(element, key, "inf", where, infinite=True) for key in ("velocity", "effort"))
    for key, most in (("velocity", speed), ("effort", effort)):
        if most < 0:
            raise DescriptionError(f"{where}: {key} {most}; expected a limit that is not negative")
    return low, high, speed, effort


def _root_link(links: dict[str, Link], joints: Sequence[Connection], where: str) -> str:
    children = {joint.child for joint in joints}
    roots = [name for name in links if name not in children]
    if not roots:
        raise CyclicTreeError(f"{where}: every link is carried by another; expected one that is the base")
    reached, todo, carried = set(), list(roots), _carried(joints)
    while todo:
        name = todo.pop()
        reached.add(name)
        todo += [joint.child for joint in carried.get(name, ())]
    ring = [name for name in links if name not in reached]
    if ring:
        raise CyclicTreeError(f"{where}: links {', '.join(ring)} carry each other; expected a tree")
    if len(roots) > 1:
        raise DescriptionError(f"{where}: no joint carries any of {', '.join(roots)}; expected one base")
    return roots[0]


def _carried(joints: Sequence[Connection]) -> dict[str, list[Connection]]:
    """Return the joints on each link, in the order of the file."""
    found: dict[str, list[Connection]] = {}
    for joint in joints:
        found.setdefault(joint.parent, []).append(joint)
    return found


def _walk(
    start: str, links: dict[str, Link], joints: Sequence[Connection], held: set[str], base: str, where: str
) -> _Found:
    """Traverse the tree depth first, in the order of the file."""
    found = _Found()
    identity = np.eye(8)[0]

    def add(kind: Joint, name: str, frame: Floats, axis: Floats, parent: int, connection: Connection | None) -> int:
        at_origin = np.array([axis[2], -axis[1], axis[0], 0.0, 0.0, 0.0])
        found.kinds.append(kind)
        found.axes.append(_known(pga3.move_line(frame, at_origin), f"{where}: joint {name!r}: its axis"))
        found.home.append(frame)
        found.parents.append(parent)
        found.names.append(name)
        single = connection is not None and connection.type in ("revolute", "continuous", "prismatic")
        found.limits.append(connection.limits if single and connection is not None else UNLIMITED)
        found.mimics.append(connection.mimic if single and connection is not None else None)
        found.bodies.append([])
        return len(found.kinds) - 1

    def several(name: str, frame: Floats, parts: Sequence[tuple[str, Joint, Floats]], parent: int) -> int:
        for end, kind, axis in parts:
            parent = add(kind, f"{name}.{end}", frame, axis, parent, None)
        return parent

    def place(link: str, frame: Floats, carrier: int, depth: int) -> None:
        found.links[link], found.depths[link] = (carrier, frame), depth
        body = links[link].body
        if carrier >= 0 and body is not None:
            found.bodies[carrier].append(_known(placed(frame, body), f"{where}: link {link!r}: its inertia"))
        todo.extend((joint, frame, carrier, depth + 1) for joint in reversed(carried.get(link, ())))

    carried, todo = _carried(joints), list[tuple[Connection, Floats, int, int]]()
    carrier = -1
    if base == "floating":
        carrier = add(Joint.FLOATING, "base", identity, np.zeros(3), -1, None)
    elif base == "euler":
        carrier = several("base", identity, _FREE, -1)
    place(start, identity, carrier, 0)
    while todo:
        joint, frame, carrier, depth = todo.pop()
        there = _known(pga3.motor_product(frame, joint.origin), f"{where}: link {joint.child!r}: its place")
        match "fixed" if joint.name in held else joint.type:
            case "fixed":
                own = carrier
            case "floating":
                own = several(joint.name, there, _FREE, carrier)
            case "planar":
                own = several(joint.name, there, _in_plane(joint.axis), carrier)
            case type_:
                kind = Joint.PRISMATIC if type_ == "prismatic" else Joint.REVOLUTE
                own = add(kind, joint.name, there, joint.axis, carrier, joint)
        if own != carrier and links[joint.child].body is None:
            found.without_inertia.append(joint.child)
        place(joint.child, there, own, depth)
    return found


_FREE = (
    *((name, Joint.PRISMATIC, axis) for name, axis in zip("xyz", (_X, _Y, _Z), strict=True)),
    *((name, Joint.REVOLUTE, axis) for name, axis in (("yaw", _Z), ("pitch", _Y), ("roll", _X))),
)
"""Six joints that together allow any motion. At a pitch of 90 degrees the axes of yaw and roll coincide."""


def _in_plane(axis: Floats) -> list[tuple[str, Joint, Floats]]:
    """Return the joints of a plane: x, y and the turn about the axis, which is z turned by the shortest way.

    For the axis z these are the coordinates of Pinocchio, which has no other axes.
    """
    turn = vga3.rotor_between_vectors(_Z, axis)
    first, second = (np.asarray(vga3.rotate_vector(turn, each)) for each in (_X, _Y))
    return [("x", Joint.PRISMATIC, first), ("y", Joint.PRISMATIC, second), ("turn", Joint.REVOLUTE, axis)]


def _coupling(found: _Found, where: str) -> tuple[Floats, tuple[int, ...]]:
    """Return the coupling matrix of mimic joints, empty if there are none, and the joints that follow no other."""
    # A floating base, which is joint 0, has six rates.
    more = FREEDOMS - 1 if found.kinds[:1] == [Joint.FLOATING] else 0
    free = [k for k, mimic in enumerate(found.mimics) if mimic is None]
    leaders = (0,) * more + tuple(free)
    if len(free) == len(found.kinds):
        return np.empty(0), leaders
    rows = np.zeros((len(found.kinds), more + len(free) + 1))
    for joint in range(1 if more else 0, len(found.kinds)):
        factor, offset, leader, seen = 1.0, 0.0, joint, [joint]
        while (mimic := found.mimics[leader]) is not None:
            if mimic[0] not in found.names:
                raise DescriptionError(
                    f"{where}: joint {found.names[leader]!r} mimics {mimic[0]!r}, which does not move"
                )
            offset += factor * mimic[2]
            factor *= mimic[1]
            leader = found.names.index(mimic[0])
            if leader in seen:
                raise CyclicTreeError(f"{where}: joints {', '.join(found.names[k] for k in seen)} mimic each other")
            seen.append(leader)
        rows[joint, more + free.index(leader)], rows[joint, -1] = factor, offset
    return rows, leaders
