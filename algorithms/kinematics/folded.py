"""Specialised kernels with the constants of one robot folded, as written by ``gac robot``, and their validity.

The docstring of a module contains a digest for each part of the robot's description. A kernel is used if the digests of
all parts that it depends on are those of the robot. After any change of the robot, the affected methods use the generic
kernels.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from .constants import Constants
from .methods import METHODS, PARTS_OF_KERNELS
from .tables import followed

GENERIC = "generated.robots"
"""The module with generic kernels for any robot."""

_LINE = re.compile(r"^ {4}(\w+) ([0-9a-f]{12})$", re.MULTILINE)


def kernels_of(model: Constants) -> Mapping[str, Any]:
    """Return the kernels of the robot's module that were generated from the same constants, by name."""
    if model.module is None:
        return {}
    unknown = {"bodies"} if model.without_inertia or not model.bodies.size else set()
    other = differences(model) | unknown
    return {
        name: getattr(model.module, name)
        for name, parts in PARTS_OF_KERNELS.items()
        if hasattr(model.module, name) and not other.intersection(parts)
    }


def differences(model: Constants) -> set[str]:
    """Return the parts of a robot's description that differ from those of its module. A missing digest differs."""
    signed = dict(_LINE.findall(_docstring(model.module)))
    return {part for part, digest in digests(model).items() if signed.get(part) != digest}


def _docstring(module: Any) -> str:
    """Return the docstring of a module, read from its file if Python runs without docstrings (``-OO``)."""
    text, file = getattr(module, "__doc__", None), getattr(module, "__file__", None)
    if text is None and file is not None:
        text = Path(file).read_text(encoding="utf-8").partition("from __future__")[0]
    return text or ""


def folded_parts(module: Any) -> set[str]:
    """Return the parts that the kernels of a module depend on."""
    return {part for name, parts in PARTS_OF_KERNELS.items() if hasattr(module, name) for part in parts}


def uses(kernels: Mapping[str, Any], module: Any) -> Mapping[str, str]:
    """Return for each method the module whose kernels it calls."""
    found = {}
    for method, row in METHODS.items():
        names = (method,) if row.folds else row.calls
        modules = {module.__name__ if name in kernels else GENERIC for name in names} or {GENERIC}
        found[method] = ", ".join(sorted(modules, key=GENERIC.__eq__))
    return found


def digests(model: Constants) -> dict[str, str]:
    """Return a digest for each part of a robot's description.

    Numbers are rounded to 1e-10 of their unit, tensors relative to the decade of their largest entry, because the text
    that a module is generated from may differ by as much. `gacompiler.robots.signed` applies the same rule.
    """
    bodies: list[Iterable[float | str]] = []
    for body in model.bodies if model.bodies.size else ((0.0,) * 10,) * len(model.kinds):
        decade = f"{max(abs(float(x)) for x in body[4:]):.9e}".partition("e")[2]
        bodies += [body[:4], [float(x) / float(f"1e{decade}") for x in body[4:]]]
    coupled = followed(model) if model.coupling.size else ()
    return {
        "joints": _digest([[kind.value for kind in model.kinds], model.parents, *coupled]),
        "axes": _digest(model.axes),
        "tool": _digest([[model.tip], model.tool]),
        "bodies": _digest(bodies),
        "armature": _digest([model.armature]),
        "gravity": _digest([model.free_fall]),
        "home": _digest(model.home),
    }


def _digest(rows: Iterable[Iterable[float | str]]) -> str:
    texts = [x if isinstance(x, str) else f"{round(float(x), 10) + 0.0:.10f}" for row in rows for x in row]
    return sha256(",".join(texts).encode()).hexdigest()[:12]
