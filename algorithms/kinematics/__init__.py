"""Kinematics and dynamics of robots by motors."""

from . import contacts, tasks
from .bodies import Body
from .constrained import Constrained, ConstraintStatus, Response
from .contacts import Constraint
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
from .inverse import SelfMotion, Solutions, Status, elbow_angle
from .reaching import Reached, Reaching, ReachStatus
from .retiming import RetimingStatus, TimedPath, retime
from .robot import Robot
from .tasks import Task
from .view import RobotView

__all__ = [
    "Body",
    "Constrained",
    "Constraint",
    "ConstraintStatus",
    "CyclicTreeError",
    "DescriptionError",
    "FloatingBaseError",
    "FloatingRobot",
    "InertiaWarning",
    "JointCountError",
    "MissingInertiaError",
    "NotFiniteError",
    "ReachStatus",
    "Reached",
    "Reaching",
    "Response",
    "RetimingStatus",
    "Robot",
    "RobotView",
    "Row",
    "SelfMotion",
    "Solutions",
    "Status",
    "Table",
    "Task",
    "TimedPath",
    "UnknownJointTypeError",
    "contacts",
    "elbow_angle",
    "retime",
    "tasks",
]
