"""Denavit-Hartenberg tables: what a row means, and how one is read and checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from enum import Enum

from ..arguments import finite_number
from .bodies import Body
from .errors import JointCountError, NotFiniteError, UnknownJointTypeError


class Joint(Enum):
    """What a joint does about its axis z: it turns (radians) or it slides (metres)."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"


class Convention(Enum):
    """In which order a row moves the frame.

    ``STANDARD``: turn about z by theta, move along z by d, along x by a, turn about x by alpha (Denavit and
    Hartenberg, *J. Applied Mechanics* 22:215, 1955). ``MODIFIED``: turn about x by alpha, move along x by a, turn about
    z by theta, move along z by d (Craig, *Introduction to Robotics*, 1986).
    """

    STANDARD = "standard"
    MODIFIED = "modified"


@dataclass(frozen=True, slots=True)
class Row:
    """One joint and the link that goes with it.

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
        Where the numbers are from.
    bodies : tuple of Body, optional
        What each link weighs, in the frame after its row.
    limits : tuple of pairs, optional
        For each joint: lowest, highest.
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
    """The convention of that name, or a `ValueError` that lists them."""
    try:
        return Convention(name)
    except ValueError:
        expected = " or ".join(repr(convention.value) for convention in Convention)
        raise ValueError(f"convention: {name!r}; expected {expected}") from None


def rows_of(rows: Sequence[Mapping[str, object]]) -> tuple[Row, ...]:
    """Rows given as mappings, checked.

    Parameters
    ----------
    rows : sequence of mappings
        Keys d, a, alpha, theta, kind, as in `Row`; what is left out is 0, and revolute.

    Returns
    -------
    tuple of Row

    Raises
    ------
    TypeError, ValueError
        With the row, counted from 0, and the key at fault: an unknown key, what is not a number. What is not finite is
        a `NotFiniteError`, an unknown kind an `UnknownJointTypeError`, no rows a `JointCountError`.
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
        return Row(**numbers, kind=Joint(kind))
    except ValueError:
        expected = " or ".join(repr(joint.value) for joint in Joint)
        raise UnknownJointTypeError(f"{where}: kind {kind!r}; expected {expected}") from None


def _number(value: object, where: str) -> float:
    try:
        return finite_number(value, where)
    except ValueError as error:
        raise NotFiniteError(str(error)) from None
