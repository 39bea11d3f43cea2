"""Kernels with the constants of one robot folded, as ``gac robot`` writes them, and which of them belong to a robot.

A module says in its docstring what it was made from: a digest for each part of the robot's description. A kernel is
used where the digests of all parts that it depends on are those of the robot. What a change of the robot concerns is
computed with the generic kernels, however the change was made.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from hashlib import sha256
from pathlib import Path
from typing import Any

from .constants import Constants

GENERIC = "generated.robots"
"""The module that any robot can be computed with."""

_WHERE = ("joints", "axes", "tool")
_DEPENDS: dict[str, tuple[str, ...]] = {
    "forward": _WHERE,
    "jacobian": _WHERE,
    "inverse_dynamics": ("joints", "axes", "bodies", "armature", "gravity"),
    "mass_matrix": ("joints", "axes", "bodies", "armature"),
}
"""The parts of a robot's description that were folded into each kernel."""

_CALLS: dict[str, tuple[str, ...]] = {
    **{name: ("forward",) for name in ("forward", "pose")},
    **{name: ("jacobian",) for name in ("jacobian", "velocity", "manipulability")},
    "acceleration": ("jacobian", "jacobian_rate"),
    "inverse_dynamics": ("inverse_dynamics",),
    "mass_matrix": ("mass_matrix",),
}
"""The kernels that methods call where the robot's own module may have one of them."""

_NEVER_OWN = (
    *("forward_all", "link", "inverse", "jacobian_rate", "twists_of_joints", "gravity", "coriolis", "coriolis_matrix"),
    *("forward_dynamics", "simulate", "kinetic_energy", "potential_energy", "inverse_dynamics_derivatives"),
    *("inverse_mass_matrix", "forward_dynamics_derivatives"),
    *("torque_regressor", "centre_of_mass", "centroidal_momentum", "centroidal_momentum_matrix"),
    *("jacobian_of_point", "jacobian_of_line", "jacobian_of_plane"),
)
"""The other methods."""

_LINE = re.compile(r"^ {4}(\w+) ([0-9a-f]{12})$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Folded:
    """The kernels of a module that belong to a robot; None for those that do not."""

    forward: Any = None
    jacobian: Any = None
    inverse_dynamics: Any = None
    mass_matrix: Any = None


NOTHING = Folded()


def kernels_of(model: Constants) -> Folded:
    """The kernels of the robot's module that were made from the same constants."""
    if model.module is None:
        return NOTHING
    other = differences(model) | ({"bodies"} if model.without_inertia else set())
    kept = {
        name: getattr(model.module, name)
        for name in (entry.name for entry in fields(Folded))
        if hasattr(model.module, name) and not other.intersection(_DEPENDS[name])
    }
    return Folded(**kept)


def differences(model: Constants) -> set[str]:
    """The parts of a robot's description that its module was not made from; all of them where it does not say."""
    signed = dict(_LINE.findall(_docstring(model.module)))
    return {part for part, digest in digests(model).items() if signed.get(part) != digest}


def _docstring(module: Any) -> str:
    """The docstring of a module; from its file where Python runs without docstrings (``-OO``)."""
    text, file = getattr(module, "__doc__", None), getattr(module, "__file__", None)
    if text is None and file is not None:
        text = Path(file).read_text(encoding="utf-8").partition("from __future__")[0]
    return text or ""


def folded_parts(module: Any) -> set[str]:
    """The parts that the kernels of a module depend on."""
    return {part for name, parts in _DEPENDS.items() if hasattr(module, name) for part in parts}


def uses(kernels: Folded, module: Any) -> Mapping[str, str]:
    """For each method the module whose kernels it calls."""
    found = dict.fromkeys(_NEVER_OWN, GENERIC)
    for method, names in _CALLS.items():
        modules = {GENERIC if getattr(kernels, name, None) is None else module.__name__ for name in names}
        found[method] = ", ".join(sorted(modules, key=GENERIC.__eq__))
    return found


def digests(model: Constants) -> dict[str, str]:
    """A digest for each part of a robot's description.

    Of numbers rounded to 1e-10 of their unit, for tensors of the decade of their largest entry: the text that a
    module is made from may differ by as much. The same rule as that of `gacompiler.robots.signed`.
    """
    bodies: list[Iterable[float | str]] = []
    for body in model.bodies if model.bodies.size else ((0.0,) * 10,) * len(model.kinds):
        decade = f"{max(abs(float(x)) for x in body[4:]):.9e}".partition("e")[2]
        bodies += [body[:4], [float(x) / float(f"1e{decade}") for x in body[4:]]]
    return {
        "joints": _digest([[kind.value for kind in model.kinds], model.parents]),
        "axes": _digest(model.axes),
        "tool": _digest([[model.tip], model.tool]),
        "bodies": _digest(bodies),
        "armature": _digest([model.armature]),
        "gravity": _digest([model.free_fall]),
    }


def _digest(rows: Iterable[Iterable[float | str]]) -> str:
    texts = [x if isinstance(x, str) else f"{round(float(x), 10) + 0.0:.10f}" for row in rows for x in row]
    return sha256(",".join(texts).encode()).hexdigest()[:12]
