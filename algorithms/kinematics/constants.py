"""Protocol of the constants of a robot, for the functions that compute tables and digests from them."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .denavit_hartenberg import Joint

Floats = NDArray[np.float64]


class Constants(Protocol):
    """The attributes of `Model`, documented there.

    `Model` computes its tables on construction. The modules that compute them cannot import it, and use this protocol.
    """

    @property
    def name(self) -> str:
        """For error messages."""

    @property
    def kinds(self) -> tuple[Joint, ...]:
        """(N,), revolute or prismatic; joint 0 may be floating."""

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
        """(N, 10), mass, centre and tensor of the body that each joint carries; empty if unknown."""

    @property
    def armature(self) -> Floats:
        """(N,), reflected rotor inertias."""

    @property
    def without_inertia(self) -> tuple[str, ...]:
        """Moving links without inertia."""

    @property
    def free_fall(self) -> Floats:
        """(3,), gravitational acceleration in the base frame."""

    @property
    def coupling(self) -> Floats:
        """(N, n + 1), positions of mimic joints; empty if there are none."""

    @property
    def leaders(self) -> tuple[int, ...]:
        """The joint whose position each variable is."""

    @property
    def module(self) -> Any:
        """Specialised kernels, or None."""

    @property
    def n_joints(self) -> int:
        """The number of rates."""

    @property
    def n_positions(self) -> int:
        """The number of variables."""
