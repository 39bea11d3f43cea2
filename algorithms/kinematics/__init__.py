"""Kinematics of robot arms by motors."""

from .denavit_hartenberg import Row, Table
from .robot import Robot

__all__ = ["Robot", "Row", "Table"]
