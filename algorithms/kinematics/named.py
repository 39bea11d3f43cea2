"""Denavit-Hartenberg tables, inertial parameters and joint limits of predefined robots. Metres, radians, kg."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, radians
from types import MappingProxyType

from . import lengths
from .bodies import Body
from .denavit_hartenberg import Convention, Joint, Row, Table


def _degrees(*limits: tuple[float, float]) -> tuple[tuple[float, float], ...]:
    return tuple((radians(low), radians(high)) for low, high in limits)


def _reflected(rotor: float, ratio: float) -> float:
    """Return the inertia of a geared rotor, reflected at the joint."""
    return rotor * (ratio * ratio)


_TOOLBOX = "Robotics Toolbox for Python (MIT licence), models.DH"

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
    "26.45 inches below the shoulder. Armature is rotor inertia times the gear ratio squared; the toolbox counts it in "
    "`rne` and in `inertia`",
    bodies=(
        Body(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.35, 0.0, 0.0), _reflected(200e-6, 62.6111)),
        Body(17.4, (-0.3638, 0.006, 0.2275), (0.13, 0.0, 0.0, 0.524, 0.0, 0.539), _reflected(200e-6, 107.815)),
        Body(4.8, (-0.0203, -0.0141, 0.070), (0.066, 0.0, 0.0, 0.086, 0.0, 0.0125), _reflected(200e-6, 53.7063)),
        Body(0.82, (0.0, 0.019, 0.0), (1.8e-3, 0.0, 0.0, 1.3e-3, 0.0, 1.8e-3), _reflected(33e-6, 76.0364)),
        Body(0.34, (0.0, 0.0, 0.0), (0.3e-3, 0.0, 0.0, 0.4e-3, 0.0, 0.3e-3), _reflected(33e-6, 71.923)),
        Body(0.09, (0.0, 0.0, 0.032), (0.15e-3, 0.0, 0.0, 0.15e-3, 0.0, 0.04e-3), _reflected(33e-6, 76.686)),
    ),
    limits=_degrees((-160, 160), (-45, 225), (-225, 45), (-110, 170), (-100, 100), (-266, 266)),
)

STANFORD = Table(
    name="stanford",
    convention=Convention.STANDARD,
    rows=(
        Row(d=0.412, alpha=-pi / 2),
        Row(d=0.154, alpha=pi / 2),
        Row(a=0.0203, theta=-pi / 2, kind=Joint.PRISMATIC),
        Row(alpha=-pi / 2),
        Row(alpha=pi / 2),
        Row(),
    ),
    source=f"{_TOOLBOX}.Stanford: Stanford AIM-177, figure 2.3; masses of Paul, Robot Manipulators (1981), as there",
    bodies=(
        Body(9.29, (0.0, 0.0175, -0.1105), (0.276, 0.0, 0.0, 0.255, 0.0, 0.071), 0.953),
        Body(5.01, (0.0, -1.054, 0.0), (0.108, 0.0, 0.0, 0.018, 0.0, 0.100), 2.193),
        Body(4.25, (0.0, 0.0, -6.447), (2.51, 0.0, 0.0, 2.51, 0.0, 0.006), 0.782),
        Body(1.08, (0.0, 0.092, -0.054), (0.002, 0.0, 0.0, 0.001, 0.0, 0.001), 0.106),
        Body(0.63, (0.0, 0.566, 0.003), (0.003, 0.0, 0.0, 0.0004, 0.0, 0.0), 0.097),
        Body(0.51, (0.0, 0.0, 1.554), (0.013, 0.0, 0.0, 0.013, 0.0, 0.0003), 0.020),
    ),
    limits=(*_degrees((-170, 170), (-170, 170)), (0.3048, 1.27), *_degrees((-170, 170), (-90, 90), (-170, 170))),
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
    source=f"{_TOOLBOX}.UR5: the maker's table, masses and centres of mass. The maker gives no tensors: those of the "
    "cylinders of ROS-Industrial's ur_description, along each link",
    bodies=(
        Body(3.7, (0.0, -0.02561, 0.00193), (0.010267495893, 0.0, 0.0, 0.00666, 0.0, 0.010267495893)),
        Body(8.393, (0.2125, 0.0, 0.11336), (0.0151074, 0.0, 0.0, 0.22689067591, 0.0, 0.22689067591)),
        Body(2.33, (0.15, 0.0, 0.0265), (0.004095, 0.0, 0.0, 0.049443313556, 0.0, 0.049443313556)),
        Body(1.219, (0.0, -0.0018, 0.01634), (0.111172755531, 0.0, 0.0, 0.21942, 0.0, 0.111172755531)),
        Body(1.219, (0.0, -0.0018, 0.01634), (0.111172755531, 0.0, 0.0, 0.21942, 0.0, 0.111172755531)),
        Body(0.1897, (0.0, 0.0, -0.001159), (0.0171364731454, 0.0, 0.0, 0.0171364731454, 0.0, 0.033822)),
    ),
    limits=((-2 * pi, 2 * pi),) * 6,
)

PANDA = Table(
    name="panda",
    convention=Convention.MODIFIED,
    rows=(
        Row(d=0.333),
        Row(alpha=-pi / 2),
        Row(d=0.316, alpha=pi / 2),
        Row(a=0.0825, alpha=pi / 2),
        Row(d=0.384, a=-0.0825, alpha=-pi / 2),
        Row(alpha=pi / 2),
        Row(d=0.107, a=0.088, alpha=pi / 2),
    ),
    source=f"{_TOOLBOX}.Panda without its tool: the maker's table, to the flange, and the masses that Gaz and others "
    "identified (IEEE Robotics and Automation Letters 4:4147, 2019)",
    bodies=(
        Body(4.970684, (0.003875, 0.002081, 0.0), (0.70337, -0.000139, 0.006772, 0.70661, 0.019169, 0.009117)),
        Body(0.646926, (-0.003141, -0.02872, 0.003495), (0.007962, -0.003925, 0.010254, 0.02811, 0.000704, 0.025995)),
        Body(3.228604, (0.027518, 0.039252, -0.066502), (0.037242, -0.004761, -0.011396, 0.036155, -0.012805, 0.01083)),
        Body(3.587895, (-0.05317, 0.104419, 0.027454), (0.025853, 0.007796, -0.001332, 0.019552, 0.008641, 0.028323)),
        Body(
            1.225946, (-0.011953, 0.041065, -0.038437), (0.035549, -0.002117, -0.004037, 0.029474, 0.000229, 0.008627)
        ),
        Body(1.666555, (0.060149, -0.014117, -0.010517), (0.001964, 0.000109, -0.001158, 0.004354, 0.000341, 0.005433)),
        Body(
            0.735522, (0.010517, -0.004252, -0.045403), (0.012516, -0.000428, -0.001196, 0.010027, -0.000741, 0.004815)
        ),
    ),
    limits=(
        (-2.8973, 2.8973),
        (-1.7628, 1.7628),
        (-2.8973, 2.8973),
        (-3.0718, -0.0698),
        (-2.8973, 2.8973),
        (-0.0175, 3.7525),
        (-2.8973, 2.8973),
    ),
)

IIWA = Table(
    name="iiwa",
    convention=Convention.STANDARD,
    rows=(
        Row(d=0.34, alpha=-pi / 2),
        Row(alpha=pi / 2),
        Row(d=0.4, alpha=pi / 2),
        Row(alpha=-pi / 2),
        Row(d=0.4, alpha=-pi / 2),
        Row(alpha=pi / 2),
        Row(d=0.126),
    ),
    source="KUKA LBR iiwa 7 R800, the lengths of the maker's data sheet, to the flange; no masses",
    limits=_degrees(*((-170, 170), (-120, 120)) * 3, (-175, 175)),
)

TABLES: Mapping[str, Table] = MappingProxyType(
    {t.name: t for t in (PUMA560, STANFORD, UR5, PANDA, IIWA, *lengths.TABLES)}
)

OTHER_NAMES: Mapping[str, str] = MappingProxyType({"kukaiiwa": "iiwa", "frankapanda": "panda"})
"""Alternative names, in lower case, letters and digits only."""

FOLDED: frozenset[str] = frozenset({"ur5", "panda"})
"""Robots with specialised kernels in `generated`."""


def table_of(name: str) -> Table:
    """Return the table of a predefined robot. Case, spaces and hyphens are ignored.

    Raises
    ------
    TypeError
        If `name` is not a string.
    ValueError
        If the name is unknown.
    """
    if not isinstance(name, str):
        raise TypeError(f"robot {name!r}: {type(name).__name__}; expected one of the names {', '.join(TABLES)}")
    plain = "".join(filter(str.isalnum, name.lower()))
    plain = OTHER_NAMES.get(plain, plain)
    if plain not in TABLES:
        raise ValueError(f"robot {name!r}: unknown; expected one of {', '.join(TABLES)}, or use Robot.from_dh")
    return TABLES[plain]
