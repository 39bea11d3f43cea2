"""Robots from MuJoCo's MJCF files: bodies, joints, inertias, limits, defaults, and joints coupled by equality.

Geometry, actuators, tendons, sensors, contacts, dampings and friction are ignored. What would change the motion or the
masses of the robot and is not supported raises an error: closed loops, ball joints, masses that are computed from
geometry or scaled. Angles are in degrees unless the file says otherwise
(https://mujoco.readthedocs.io/en/stable/XMLreference.html).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import count
from math import radians
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from generated import pga3

from .constants import Floats
from .errors import DescriptionError, UnknownJointTypeError
from .masses import fault_of, placed
from .urdf import UNLIMITED, Connection, Link, fields_of, length_of, numbers, root_of

Element = ElementTree.Element
_WORLD = "world"
_STILL: Floats = np.eye(8)[0]
"""The motor that moves nothing."""
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(slots=True)
class _File:
    """What is read from a file."""

    where: str
    degrees: bool
    sequence: str
    always_limited: bool
    classes: dict[str, dict[str, dict[str, str]]]
    links: dict[str, Link] = field(default_factory=dict)
    joints: list[Connection] = field(default_factory=list)
    rotors: dict[str, float] = field(default_factory=dict)
    mimics: dict[str, tuple[str, float, float]] = field(default_factory=dict)
    starts: dict[str, float] = field(default_factory=dict)

    def angle(self, number: float) -> float:
        return radians(number) if self.degrees else number


def read(source: str | Path, tip: str | None, locked: Iterable[str], base: str) -> dict[str, Any]:
    """Return the fields of a `Model` from a file; see `Robot.from_mjcf`."""
    root, where, folder = root_of(source, "mujoco")
    _include(root, folder, where, set())
    compiler = _merged(root, "compiler")
    _need_supported(root, compiler, where)
    file = _File(
        where,
        compiler.get("angle", "degree") == "degree",
        compiler.get("eulerseq", "xyz"),
        compiler.get("autolimits", "true") == "true",
        _classes(root),
    )
    for element in root.findall("equality/joint"):
        _couple(file, element)
    file.links[_WORLD] = Link(_WORLD, None)
    for world in root.findall("worldbody"):
        _children(file, world, _WORLD, _STILL, "main")
    if len(file.links) == 1:
        raise DescriptionError(f"{where}: no body; expected at least one in <worldbody>")
    missing = file.mimics.keys() - {joint.name for joint in file.joints}
    if missing:
        raise DescriptionError(f"{where}: equality of joint {sorted(missing)[0]!r}, which is no joint")
    for joint in file.joints:
        if joint.mimic is not None:
            # The distances from the initial configuration are coupled.
            leader, factor, offset = joint.mimic
            shift = file.starts.get(joint.name, 0.0) - factor * file.starts.get(leader, 0.0)
            joint.mimic = leader, factor, offset + shift
    name = root.get("model", "robot")
    found = fields_of(name, file.links, file.joints, tip, locked, base, where)
    unknown = [
        name for name, link in file.links.items() if link.body is None and found["links"].get(name, (-1,))[0] >= 0
    ]
    found["without_inertia"] = tuple(unknown)
    if "gravity" in (option := _merged(root, "option")):
        found["free_fall"] = numbers(Element("option", option), "gravity", None, 3, where)
    found["armature"] = np.array([file.rotors.get(joint, 0.0) for joint in found["joint_names"]])
    return found


def _merged(root: Element, tag: str) -> dict[str, str]:
    """Return the attributes of all elements of a kind, of which later ones replace earlier ones."""
    found: dict[str, str] = {}
    for element in root.findall(tag):
        found |= element.attrib
    return found


def _need_supported(root: Element, compiler: Mapping[str, str], where: str) -> None:
    """Raise an error for settings that change the robot and are not supported."""
    angle, sequence = compiler.get("angle", "degree"), compiler.get("eulerseq", "xyz")
    if angle not in ("degree", "radian"):
        raise DescriptionError(f"{where}: compiler angle={angle!r}; expected 'degree' or 'radian'")
    if len(sequence) != 3 or not set(sequence.lower()) <= set(_AXES):
        raise DescriptionError(f"{where}: compiler eulerseq={sequence!r}; expected three of the letters xyzXYZ")
    if compiler.get("inertiafromgeom", "auto") == "true":
        raise DescriptionError(f"{where}: compiler inertiafromgeom='true'; expected bodies with <inertial>")
    for key in ("boundmass", "boundinertia", "settotalmass"):
        if key in compiler:
            raise DescriptionError(f"{where}: compiler {key}; expected the masses of the bodies themselves")
    for kind in ("connect", "weld"):
        if root.find(f"equality/{kind}") is not None:
            raise DescriptionError(f"{where}: <equality> with <{kind}>, a closed loop; expected a tree")


def _include(root: Element, folder: Path | None, where: str, seen: set[Path]) -> None:
    """Replace each <include> by the children of the root of its file, whose name is relative to the first file."""
    for parent in list(root.iter()):
        for place, child in reversed(list(enumerate(parent))):
            if child.tag == "include":
                name = child.get("file", "")
                if folder is None:
                    raise DescriptionError(f"{where}: <include file={name!r}> in a text; expected a file")
                path = (folder / name).resolve()
                if path in seen:
                    raise DescriptionError(f"{where}: <include file={name!r}> again; expected each file once")
                inner, there, _ = root_of(folder / name, "mujoco", "mujocoinclude")
                _include(inner, folder, there, seen | {path})
                parent[place : place + 1] = list(inner)


def _classes(root: Element) -> dict[str, dict[str, dict[str, str]]]:
    """Return for each class of defaults the attributes of each kind of element."""
    found: dict[str, dict[str, dict[str, str]]] = {"main": {}}

    def visit(element: Element, inherited: Mapping[str, dict[str, str]], name: str) -> None:
        own = {tag: dict(attributes) for tag, attributes in (found.get(name) or inherited).items()}
        for child in element:
            if child.tag != "default":
                own[child.tag] = own.get(child.tag, {}) | child.attrib
        found[name] = own
        for child in element.findall("default"):
            visit(child, own, child.get("class", "main"))

    for element in root.findall("default"):
        visit(element, found["main"], element.get("class", "main"))
    return found


def _couple(file: _File, element: Element) -> None:
    """Record that a joint follows another one linearly."""
    if element.get("active", "true") != "true":
        return
    follower, leader = element.get("joint1", ""), element.get("joint2")
    here = f"{file.where}: equality of joint {follower!r}"
    offset, factor, *rest = numbers(element, "polycoef", "0 1 0 0 0", 5, here)
    if leader is None or any(rest):
        raise DescriptionError(f"{here}: constant or not linear; expected joint2 and polycoef='a b 0 0 0'")
    file.mimics[follower] = leader, float(factor), float(offset)


def _children(file: _File, element: Element, parent: str, frame: Floats, name: str) -> None:
    """Read the bodies inside an element whose frame is given relative to the link `parent`; `name` is their class."""
    for child in element:
        if child.tag == "frame":
            for tag in ("joint", "freejoint", "inertial"):
                if child.find(tag) is not None:
                    raise DescriptionError(f"{file.where}: <{tag}> in a <frame> of {parent!r}; expected it in the body")
            there = pga3.motor_product(frame, _frame(file, child, f"{file.where}: frame of {parent!r}"))
            _children(file, child, parent, there, child.get("childclass", name))
        elif child.tag == "body":
            _body(file, child, parent, frame, child.get("childclass", name))
        elif child.tag in ("replicate", "attach", "composite", "flexcomp"):
            raise DescriptionError(f"{file.where}: <{child.tag}> inside {parent!r}; expected bodies and joints")


def _body(file: _File, element: Element, parent: str, frame: Floats, name: str) -> None:
    own = element.get("name") or next(free for k in count() if (free := f"body {k}") not in file.links)
    here = f"{file.where}: body {own!r}"
    if own in file.links:
        raise DescriptionError(f"{here}: two bodies of this name; expected different names")
    there = pga3.motor_product(frame, _frame(file, element, here))
    before = parent
    # A joint turns about its own place in the body; links between it and the body have no mass.
    for joint in _joints(file, element, name):
        there, before = _joint(file, joint, own, before, there)
    if before != parent and np.array_equal(there, _STILL):
        file.joints[-1].child = own
        del file.links[before]
    else:
        file.joints.append(Connection(f"{own} fixed", "fixed", before, own, there, np.zeros(3), UNLIMITED, None))
    file.links[own] = _link(file, element, own, here)
    _children(file, element, own, _STILL, name)


def _joints(file: _File, element: Element, name: str) -> Iterator[dict[str, str]]:
    for child in element:
        if child.tag == "freejoint":
            yield {"type": "free", **child.attrib}
        elif child.tag == "joint":
            kind = child.get("class", name)
            if kind not in file.classes:
                raise DescriptionError(f"{file.where}: class {kind!r} of a joint is no <default>")
            yield {"type": "hinge", **file.classes[kind].get("joint", {}), **child.attrib}


def _joint(file: _File, joint: Mapping[str, str], body: str, parent: str, frame: Floats) -> tuple[Floats, str]:
    """Append a joint; return the rest of the way to the frame of the body, and the link that the joint carries."""
    own = joint.get("name", f"{body} joint {len(file.joints)}")
    here = f"{file.where}: joint {own!r}"
    if any(each.name == own for each in file.joints):
        raise DescriptionError(f"{here}: two joints of this name; expected different names")
    attributes = Element("joint", dict(joint))
    kinds = {"hinge": "revolute", "slide": "prismatic", "free": "floating"}
    kind = joint["type"]
    if kind not in kinds:
        raise UnknownJointTypeError(f"{here}: type {kind!r}; expected hinge, slide or free")
    place = np.zeros(3) if kind == "free" else numbers(attributes, "pos", "0 0 0", 3, here)
    axis = numbers(attributes, "axis", "0 0 1", 3, here)
    axis = _unit(axis, here)
    turns = kind == "hinge"
    start = float(numbers(attributes, "ref", "0", 1, here)[0])
    start = file.starts[own] = file.angle(start) if turns else start
    back = _turn(axis, -start, here) if turns else _shift(-start * axis)
    origin = pga3.motor_product(pga3.motor_product(frame, _shift(place)), back)
    link = f"{body} on {own}"
    file.links[link] = Link(link, np.zeros(10))
    if kind != "free":
        file.rotors[own] = float(numbers(attributes, "armature", "0", 1, here)[0])
    limits = _limits(file, attributes, turns, here) if kind != "free" else UNLIMITED
    connection = Connection(own, kinds[kind], parent, link, origin, axis, limits, file.mimics.get(own))
    file.joints.append(connection)
    return _shift(-place), link


def _limits(file: _File, joint: Element, turns: bool, here: str) -> tuple[float, float, float, float]:
    limited = joint.get("limited", "auto")
    if limited == "false" or (limited == "auto" and not (file.always_limited and "range" in joint.attrib)):
        low, high = -np.inf, np.inf
    else:
        low, high = (file.angle(x) if turns else float(x) for x in numbers(joint, "range", "0 0", 2, here))
    effort = np.inf
    if "actuatorfrcrange" in joint.attrib:
        effort = float(np.abs(numbers(joint, "actuatorfrcrange", None, 2, here)).min())
    if low > high:
        raise DescriptionError(f"{here}: range {low} to {high}; expected the lower limit first")
    return low, high, np.inf, effort


def _link(file: _File, element: Element, name: str, here: str) -> Link:
    """Return a link with its <inertial>; without one, bodies with geometry have an unknown inertia."""
    inertial = element.find("inertial")
    if inertial is None:
        return Link(name, None if _has_geometry(element) else np.zeros(10))
    mass = float(numbers(inertial, "mass", None, 1, here)[0])
    if "fullinertia" in inertial.attrib:
        xx, yy, zz, xy, xz, yz = numbers(inertial, "fullinertia", None, 6, here)
    else:
        (xx, yy, zz), (xy, xz, yz) = numbers(inertial, "diaginertia", None, 3, here), (0.0, 0.0, 0.0)
    tensor = [float(x) for x in (xx, xy, xz, yy, yz, zz)]
    if mass < 0 or min(xx, yy, zz) < 0:
        raise DescriptionError(f"{here}: mass {mass}, inertia {tensor}; expected no negative mass, ixx, iyy, izz")
    body = placed(_frame(file, inertial, here), np.array([mass, 0, 0, 0, *tensor]))
    return Link(name, body, fault_of(tensor))


def _has_geometry(element: Element) -> bool:
    """Return whether a body has geometry of its own, which would give it a mass."""
    frames = [child for child in element if child.tag == "frame"]
    return element.find("geom") is not None or any(map(_has_geometry, frames))


def _shift(place: Floats) -> Floats:
    return np.asarray(pga3.motor_from_rotor_translation(np.eye(4)[0], place))


def _frame(file: _File, element: Element, here: str) -> Floats:
    """Return the motor of the pos and the orientation of an element."""
    place = numbers(element, "pos", "0 0 0", 3, here)
    return np.asarray(pga3.motor_product(_shift(place), _rotation(file, element, here)))


def _rotation(file: _File, element: Element, here: str) -> Floats:
    """Return the motor of the orientation of an element."""
    given = [key for key in ("quat", "axisangle", "euler", "xyaxes", "zaxis") if key in element.attrib]
    if len(given) > 1:
        raise DescriptionError(f"{here}: {' and '.join(given)}; expected one orientation")
    match given[0] if given else "":
        case "quat":
            return _of_quaternion(numbers(element, "quat", None, 4, here), here)
        case "axisangle":
            *axis, angle = numbers(element, "axisangle", None, 4, here)
            return _turn(np.array(axis), file.angle(float(angle)), here)
        case "euler":
            whole = _STILL
            for letter, angle in zip(file.sequence, numbers(element, "euler", None, 3, here), strict=True):
                turn = _turn(np.array(_AXES[letter.lower()]), file.angle(float(angle)), here)
                # Small letters are axes that turn with the body, capital letters are fixed ones.
                pair = (whole, turn) if letter.islower() else (turn, whole)
                whole = np.asarray(pga3.motor_product(*pair))
            return np.asarray(whole)
        case "xyaxes":
            first, second = numbers(element, "xyaxes", None, 6, here).reshape(2, 3)
            first = _unit(first, here)
            second = _unit(second - _along(second, first) * first, here)
            rotor = pga3.rotor_from_matrix(np.stack([first, second, np.cross(first, second)], -1))
            return np.asarray(pga3.motor_from_rotor_translation(rotor, np.zeros(3)))
        case "zaxis":
            x, y, z = map(float, _unit(numbers(element, "zaxis", None, 3, here), here))
            aside = length_of(np.array([x, y, 0.0]))
            return _turn(np.array([-y, x, 0.0] if aside else [1.0, 0.0, 0.0]), float(np.arctan2(aside, z)), here)
        case _:
            return _STILL


def _of_quaternion(quaternion: Floats, here: str) -> Floats:
    w, *axis = map(float, quaternion)
    size = length_of(np.array(axis))
    if size == 0 and w == 0:
        raise DescriptionError(f"{here}: quat of length 0; expected a quaternion w x y z")
    return _turn(np.array(axis), 2 * float(np.arctan2(size, w)), here) if size else _STILL


def _turn(axis: Floats, angle: float, here: str) -> Floats:
    rotor = pga3.rotor_from_axis_angle(_unit(axis, here), angle)
    return np.asarray(pga3.motor_from_rotor_translation(rotor, np.zeros(3)))


def _unit(vector: Floats, here: str) -> Floats:
    """Return the unit vector of a direction."""
    length = length_of(vector)
    if length == 0:
        raise DescriptionError(f"{here}: direction of length 0; expected a nonzero direction")
    return vector / length


def _along(a: Floats, b: Floats) -> float:
    """Return the product of vectors, with the same order of summation on every machine."""
    x, y, z = (float(p) * float(q) for p, q in zip(a, b, strict=True))
    return x + y + z
