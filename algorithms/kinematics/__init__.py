"""Kinematics and dynamics of robots by motors."""

from .bodies import Body
from .denavit_hartenberg import Row, Table
from .errors import (
    CyclicTreeError,
    DescriptionError,
    FloatingBaseError,
    InertiaWarning,
    JointCountError,
    MissingInertiaError,
    NotFiniteError,
    UnknownJointTypeError,
)
from .floating import FloatingRobot
from .inverse import Solutions, Status, elbow_angle
from .robot import Robot

__all__ = [
    "Body",
    "CyclicTreeError",
    "DescriptionError",
    "FloatingBaseError",
    "FloatingRobot",
    "InertiaWarning",
    "JointCountError",
    "MissingInertiaError",
    "NotFiniteError",
    "Robot",
    "Row",
    "Solutions",
    "Status",
    "Table",
    "UnknownJointTypeError",
    "elbow_angle",
]
