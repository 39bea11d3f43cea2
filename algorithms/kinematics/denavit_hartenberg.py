"""Denavit-Hartenberg tables: conventions, rows and their validation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from enum import Enum

from ..arguments import finite_number
from .bodies import Body
from .errors import JointCountError, NotFiniteError, UnknownJointTypeError


class Joint(Enum):
    """The type of a joint: revolute about its axis z (radians) or prismatic along it (metres), or a floating base."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    FLOATING = "floating"


_SINGLE = {kind: kind for kind in (Joint.REVOLUTE, Joint.PRISMATIC)}
"""The types of joints with one variable."""


class Convention(Enum):
    """The order in which the parameters of a row move the frame.

    ``STANDARD``: rotate about z by theta, translate along z by d and along x by a, rotate about x by alpha (Denavit and
    Hartenberg, *J. Applied Mechanics* 22:215, 1955). ``MODIFIED``: rotate about x by alpha, translate along x by a,
    rotate about z by theta, translate along z by d (Craig, *Introduction to Robotics*, 1986).
    """

    STANDARD = "standard"
    MODIFIED = "modified"


@dataclass(frozen=True, slots=True)
class Row:
    """One joint and its link.

    Attributes
    ----------
    d, a : float
        Offset along z and length along x, in metres. A prismatic joint adds its variable to `d`.
    alpha, theta : float
        Twist about x and angle about z, in radians. A revolute joint adds its variable to `theta`.
    kind : Joint
    """

    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    theta: float = 0.0
    kind: Joint = Joint.REVOLUTE


@dataclass(frozen=True, slots=True)
class Table:
    """The rows of an arm, base first.

    Attributes
    ----------
    name : str
    convention : Convention
    rows : tuple of Row
    source : str
        The source of the numbers.
    bodies : tuple of Body, optional
        The rigid body of each link, in the frame after its row.
    limits : tuple of pairs, optional
        For each joint: lower limit, upper limit.
    """

    name: str
    convention: Convention
    rows: tuple[Row, ...]
    source: str
    bodies: tuple[Body, ...] = ()
    limits: tuple[tuple[float, float], ...] = ()


_LENGTHS_AND_ANGLES = ("d", "a", "alpha", "theta")
_KEYS = tuple(field.name for field in fields(Row))


def convention_of(name: str) -> Convention:
    """Return the convention of a given name, or raise a `ValueError` that lists the names."""
    try:
        return Convention(name)
    except ValueError:
        expected = " or ".join(repr(convention.value) for convention in Convention)
        raise ValueError(f"convention: {name!r}; expected {expected}") from None


def rows_of(rows: Sequence[Mapping[str, object]]) -> tuple[Row, ...]:
    """Validate rows given as mappings.

    Parameters
    ----------
    rows : sequence of mappings
        Keys d, a, alpha, theta, kind, as in `Row`. Missing numbers are 0; the default kind is revolute.

    Returns
    -------
    tuple of Row

    Raises
    ------
    TypeError, ValueError
        For an unknown key or a value that is not a number; the message names the row, counted from 0, and the key.
        Numbers that are not finite raise a `NotFiniteError`, unknown kinds an `UnknownJointTypeError`, an empty list a
        `JointCountError`.
    """
    if isinstance(rows, (str, Mapping)) or not isinstance(rows, Sequence):
        raise TypeError(f"rows: {type(rows).__name__}; expected a list of mappings, one for each joint")
    if not rows:
        raise JointCountError("rows: none; expected at least one, base first")
    return tuple(_row(row, f"row {index}") for index, row in enumerate(rows))


def _row(row: Mapping[str, object], where: str) -> Row:
    if not isinstance(row, Mapping):
        raise TypeError(f"{where}: {type(row).__name__}; expected a mapping with keys {', '.join(_KEYS)}")
    for key in row:
        if key not in _KEYS:
            raise ValueError(f"{where}: unknown key {key!r}; expected {', '.join(_KEYS)}")
    numbers = {key: _number(row[key], f"{where}: {key}") for key in _LENGTHS_AND_ANGLES if key in row}
    kind = row.get("kind", Joint.REVOLUTE)
    try:
        return Row(**numbers, kind=_SINGLE[Joint(kind)])
    except (ValueError, KeyError):
        expected = " or ".join(repr(joint.value) for joint in _SINGLE)
        raise UnknownJointTypeError(f"{where}: kind {kind!r}; expected {expected}") from None


def _number(value: object, where: str) -> float:
    try:
        return finite_number(value, where)
    except ValueError as error:
        raise NotFiniteError(str(error)) from None
