"""The constants of a robot, as the functions that make tables and digests of them read them."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .denavit_hartenberg import Joint

Floats = NDArray[np.float64]


class Constants(Protocol):
    """What `Model` holds, see there. `Model` makes its tables when it is made, so these cannot depend on it."""

    @property
    def kinds(self) -> tuple[Joint, ...]:
        """(N,), turning or sliding."""

    @property
    def parents(self) -> tuple[int, ...]:
        """(N,), the joint that carries each joint, -1 for the base."""

    @property
    def path(self) -> tuple[int, ...]:
        """The joints from the base to the end effector."""

    @property
    def axes(self) -> Floats:
        """(N, 6), unit lines of the joints."""

    @property
    def home(self) -> Floats:
        """(N, 8), motors of the frames after every joint."""

    @property
    def tip(self) -> int:
        """The joint that carries the end effector."""

    @property
    def tool(self) -> Floats:
        """(8,), the motor of the end effector."""

    @property
    def bodies(self) -> Floats:
        """(N, 10), mass, centre and tensor of what each joint carries; empty where nothing is known."""

    @property
    def armature(self) -> Floats:
        """(N,), inertia of the rotors."""

    @property
    def without_inertia(self) -> tuple[str, ...]:
        """Links that move and have no inertia."""

    @property
    def free_fall(self) -> Floats:
        """(3,), gravity in the base frame."""

    @property
    def coupling(self) -> Floats:
        """(N, n + 1), positions of joints that follow others; empty where there are none."""

    @property
    def module(self) -> Any:
        """Kernels with constants folded, or None."""

    @property
    def n_joints(self) -> int:
        """The number of variables."""
