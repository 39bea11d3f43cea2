"""Denavit-Hartenberg tables of arms of which only lengths and limits are stored, without masses. Metres, radians."""

from __future__ import annotations

from math import pi, radians

from .denavit_hartenberg import Convention, Joint, Row, Table

_TOOLBOX = "Robotics Toolbox for Python, models.DH"
_UNIVERSAL = "Universal Robots, table 'DH parameters for calculations of kinematics and dynamics'"


def _arm(name: str, source: str, rows: tuple[Row, ...], limits: tuple[tuple[float, float], ...] = ()) -> Table:
    return Table(name=name, convention=Convention.STANDARD, rows=rows, source=source, limits=limits)


def _degrees(*limits: tuple[float, float]) -> tuple[tuple[float, float], ...]:
    return tuple((radians(low), radians(high)) for low, high in limits)


def _universal(name: str, source: str, heights: tuple[float, ...], arms: tuple[float, float]) -> Table:
    """Return an arm of Universal Robots from d1, d4, d5, d6 and the lengths of both arms; joints turn a whole turn."""
    one, four, five, six = heights
    rows = (
        Row(d=one, alpha=pi / 2),
        Row(a=-arms[0]),
        Row(a=-arms[1]),
        Row(d=four, alpha=pi / 2),
        Row(d=five, alpha=-pi / 2),
        Row(d=six),
    )
    return _arm(name, source, rows, ((-2 * pi, 2 * pi),) * 6)


def _kinova(name: str, lengths: tuple[float, ...]) -> Table:
    """Return an arm of Kinova with a wrist of 60 degrees."""
    base, arm, offset, forearm, wrist, hand = lengths
    rows = (
        Row(d=base, alpha=pi / 2),
        Row(a=arm, alpha=pi, theta=-pi / 2),
        Row(d=-offset, alpha=pi / 2, theta=pi / 2),
        Row(d=-forearm, alpha=pi / 3),
        Row(d=-wrist, alpha=pi / 3, theta=-pi),
        Row(d=-hand, alpha=pi, theta=radians(100)),
    )
    return _arm(name, f"{_TOOLBOX}.{name.title()}: the maker's table; joint 0 turns the other way here", rows)


TABLES = (
    _universal("ur3", f"{_TOOLBOX}.UR3: the maker's table", (0.1519, 0.11235, 0.08535, 0.0819), (0.24365, 0.21325)),
    _universal("ur10", f"{_TOOLBOX}.UR10: the maker's table", (0.1273, 0.163941, 0.1157, 0.0922), (0.612, 0.5723)),
    _universal("ur3e", _UNIVERSAL, (0.15185, 0.13105, 0.08535, 0.0921), (0.24355, 0.2132)),
    _universal("ur5e", _UNIVERSAL, (0.1625, 0.1333, 0.0997, 0.0996), (0.425, 0.3922)),
    _universal("ur10e", _UNIVERSAL, (0.1807, 0.17415, 0.11985, 0.11655), (0.6127, 0.57155)),
    _universal("ur16e", _UNIVERSAL, (0.1807, 0.17415, 0.11985, 0.11655), (0.4784, 0.36)),
    _universal("ur20", _UNIVERSAL, (0.2363, 0.2010, 0.1593, 0.1543), (0.862, 0.7287)),
    _universal("ur30", _UNIVERSAL, (0.2363, 0.2010, 0.1593, 0.1543), (0.637, 0.5037)),
    _arm(
        "irb140",
        f"{_TOOLBOX}.IRB140: lengths and limits of ABB's data sheet",
        (
            Row(d=0.352, a=0.07, alpha=-pi / 2),
            Row(a=0.36),
            Row(alpha=-pi / 2),
            Row(d=0.38, alpha=pi / 2),
            Row(alpha=-pi / 2),
            Row(d=0.065),
        ),
        _degrees((-180, 180), (-100, 100), (-220, 60), (-200, 200), (-120, 120), (-400, 400)),
    ),
    _arm(
        "kr5",
        f"{_TOOLBOX}.KR5: lengths and limits of KUKA's data sheet of the KR5 arc",
        (
            Row(d=0.4, a=0.18, alpha=-pi / 2),
            Row(a=0.6),
            Row(a=0.12, alpha=pi / 2),
            Row(d=-0.62, alpha=-pi / 2),
            Row(alpha=pi / 2),
            Row(d=-0.115, alpha=pi),
        ),
        _degrees((-155, 155), (-180, 65), (-15, 158), (-350, 350), (-130, 130), (-350, 350)),
    ),
    _arm(
        "cobra600",
        f"{_TOOLBOX}.Cobra600: lengths and limits of Adept's data sheet; the last joint is unlimited",
        (Row(d=0.387, a=0.325), Row(a=0.275, alpha=pi), Row(kind=Joint.PRISMATIC), Row()),
        (*_degrees((-50, 50), (-88, 88)), (0.0, 0.21), (-float("inf"), float("inf"))),
    ),
    _arm(
        "sawyer",
        f"{_TOOLBOX}.Sawyer: the lengths of Rethink's URDF file",
        (
            Row(d=0.317, a=0.081, alpha=-pi / 2),
            Row(d=0.1925, alpha=-pi / 2),
            Row(d=0.4, alpha=-pi / 2),
            Row(d=0.1685, alpha=-pi / 2),
            Row(d=0.4, alpha=-pi / 2),
            Row(d=0.1363, alpha=-pi / 2),
            Row(d=0.13375),
        ),
    ),
    _kinova("jaco", (0.2755, 0.41, 0.0098, 0.2501974, 0.0857937, 0.2115974)),
    _kinova("mico", (0.2755, 0.29, 0.007, 0.1660822, 0.0855635, 0.2027818)),
    _arm(
        "crx10ia",
        "Fanuc CRX-10iA, lengths of the maker's data sheet, to the flange; the base is at the height of the shoulder",
        (
            Row(alpha=-pi / 2),
            Row(a=0.54, alpha=pi),
            Row(alpha=-pi / 2),
            Row(d=-0.54, alpha=pi / 2),
            Row(d=0.15, alpha=-pi / 2),
            Row(d=-0.16),
        ),
    ),
)
