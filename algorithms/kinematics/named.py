"""Denavit-Hartenberg tables of robots that are known by name. Metres and radians."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from types import MappingProxyType

from .denavit_hartenberg import Convention, Row, Table

_TOOLBOX = "Robotics Toolbox for Python, models.DH"

PUMA560 = Table(
    name="puma560",
    convention=Convention.STANDARD,
    rows=(
        Row(d=26.45 * 0.0254, alpha=pi / 2),
        Row(a=0.4318),
        Row(d=0.15005, a=0.0203, alpha=-pi / 2),
        Row(d=0.4318, alpha=pi / 2),
        Row(alpha=-pi / 2),
        Row(),
    ),
    source=f"{_TOOLBOX}.Puma560: the table of Corke and Armstrong-Helouvry (ICRA 1994) with the base on the floor, "
    "26.45 inches below the shoulder",
)

UR5 = Table(
    name="ur5",
    convention=Convention.STANDARD,
    rows=(
        Row(d=0.089459, alpha=pi / 2),
        Row(a=-0.425),
        Row(a=-0.39225),
        Row(d=0.10915, alpha=pi / 2),
        Row(d=0.09465, alpha=-pi / 2),
        Row(d=0.0823),
    ),
    source=f"{_TOOLBOX}.UR5: the maker's table",
)

TABLES: Mapping[str, Table] = MappingProxyType({table.name: table for table in (PUMA560, UR5)})
