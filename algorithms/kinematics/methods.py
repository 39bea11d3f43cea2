"""The table of a robot's methods: the kernels that each calls, and what is folded into a robot's own kernels."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

_WHERE = ("joints", "axes", "tool")
_MASSES = ("joints", "axes", "bodies")


class Entry(NamedTuple):
    """One method.

    Attributes
    ----------
    folds : tuple of str
        The parts of the robot's description that are folded into the kernel of the method's name, if `gac robot` can
        write one for a single robot; otherwise empty.
    calls : tuple of str
        The other kernels that the method calls and that the robot's own module may provide.
    has_kernel : bool
        Whether there is a generic kernel of the method's name.
    """

    folds: tuple[str, ...] = ()
    calls: tuple[str, ...] = ()
    has_kernel: bool = False


def _kernel(*folds: str) -> Entry:
    return Entry(folds, (), has_kernel=True)


METHODS: Mapping[str, Entry] = MappingProxyType(
    {
        "forward": _kernel(*_WHERE),
        "forward_all": _kernel("joints", "axes", "home"),
        "jacobian": _kernel(*_WHERE),
        "jacobian_rate": _kernel(*_WHERE),
        "inverse_dynamics": _kernel(*_MASSES, "armature", "gravity"),
        "gravity": _kernel(*_MASSES, "gravity"),
        "coriolis": _kernel(*_MASSES),
        "mass_matrix": _kernel(*_MASSES, "armature"),
        "forward_dynamics": _kernel(*_MASSES, "armature", "gravity"),
        "coriolis_matrix": _kernel(*_MASSES),
        "inverse_dynamics_derivatives": _kernel(*_MASSES, "gravity"),
        "kinetic_energy": _kernel(*_MASSES, "armature"),
        "potential_energy": _kernel(*_MASSES, "gravity"),
        "centre_of_mass": _kernel(*_MASSES),
        "centroidal_momentum_matrix": _kernel(*_MASSES),
        "twists_of_joints": _kernel(),
        "integrate": _kernel(),
        "difference": _kernel(),
        "torque_regressor": _kernel(),
        "inverse_mass_matrix": _kernel(),
        "pose": Entry(calls=("forward",)),
        "velocity": _kernel(),
        "manipulability": Entry(calls=("jacobian",)),
        "acceleration": _kernel(),
        "forward_dynamics_derivatives": _kernel(),
        "simulate": Entry(calls=("forward_dynamics",)),
        "centroidal_momentum": _kernel(),
        "link": Entry(),
        "inverse": Entry(_WHERE),
        "jacobian_of_point": Entry(),
        "jacobian_of_line": Entry(),
        "jacobian_of_plane": Entry(),
    }
)

PARTS_OF_KERNELS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {name: row.folds for name, row in METHODS.items() if row.folds}
)
"""The parts of a robot's description that are folded into each of its own kernels."""


def _nothing(*_values: Any) -> None:
    """Return None, in place of a kernel that is not bound yet."""


class Attempts:
    """For each kernel a fast call, which returns None if the extension cannot execute it directly.

    Looking up a slot takes a few nanoseconds, a `cached_property` ten times as long. Methods look up the slot and call
    it in two statements: Python 3.11 specialises the lookup of a slot, but not as part of a call.
    """

    __slots__ = tuple(name for name, row in METHODS.items() if row.has_kernel)

    def __init__(self) -> None:
        for name in self.__slots__:
            setattr(self, name, _nothing)

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Return the fast call of a kernel."""
