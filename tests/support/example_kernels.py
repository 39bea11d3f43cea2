"""The kernel that docs/architecture.md follows through the compiler."""

from gacompiler import kernel
from gacompiler.algebra.catalog import PGA3


@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move_point(m, p):
    """Move the point `p` by the unit motor `m`: ``m p ~m``."""
    return m * p * ~m
