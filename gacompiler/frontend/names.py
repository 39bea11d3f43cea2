"""Names of tables and symbols in kernels with loops, taken from the parameters of the loop bodies."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from ..ir.reserved import legal
from .rows import leaves_of


class Names:
    """A collection of unique names."""

    def __init__(self, given: Mapping[str, int] | None = None) -> None:
        self._given = dict(given or {})

    def copy(self) -> Names:
        """Return a copy of the collection."""
        return Names(self._given)

    def take(self, name: str) -> None:
        """Reserve a name."""
        self._given.setdefault(name, 1)

    def unique(self, stem: str) -> str:
        """Return and reserve the stem, made legal in all target languages, or the stem followed by a number."""
        stem = legal(stem.strip("_") or "value")
        while True:
            n = self._given.get(stem, 0) + 1
            self._given[stem] = n
            name = stem if n == 1 else f"{stem}_{n}"
            if n == 1 or name not in self._given:
                self._given.setdefault(name, 1)
                return name


def named_like(body: Callable[..., Any], function: Callable[..., Any], first: Sequence[str] = ()) -> Callable[..., Any]:
    """Give a function the parameter names in `first`, followed by those of `body`, and return it."""
    function.__dict__["names_of_parameters"] = [*first, *parameter_names(body)]
    return function


def parameter_names(body: Callable[..., Any]) -> list[str]:
    """Return the names of the parameters of a body, or an empty list if they are not known."""
    known = getattr(body, "names_of_parameters", None)
    if known is not None:
        return list(known)
    parameters = getattr(body, "parameters", None)
    if isinstance(parameters, tuple):
        return [parameter.name for parameter in parameters]  # of a kernel
    try:
        return [p.name for p in inspect.signature(body).parameters.values() if p.kind is not p.VAR_POSITIONAL]
    except (TypeError, ValueError):
        return []


def stems_of(body: Callable[..., Any], structures: Sequence[Any], default: str = "row") -> list[list[str]]:
    """Return names for the leaves of the structures that a body is called with."""
    names = parameter_names(body)
    return [leaf_names(names[k] if k < len(names) else default, structure) for k, structure in enumerate(structures)]


def result_stems(body: Callable[..., Any], result: Any) -> list[str]:
    """Return names for the leaves of the result of a body: its own name, if it has one, and those of its fields."""
    function = body.func if isinstance(body, partial) else body
    name = getattr(function, "name", None) or getattr(function, "__name__", "")
    return leaf_names(name if isinstance(name, str) and name.isidentifier() else "mapped", result)


def leaf_names(stem: str, structure: Any) -> list[str]:
    """Return names for the leaves of a structure: the fields of named tuples, or `stem` with a number."""
    if not isinstance(structure, (tuple, list)):
        return [stem]
    fields = getattr(structure, "_fields", None)
    names = list(fields) if fields else [f"{stem}_{k}" for k in range(len(structure))]
    if fields and len(leaves_of(structure)) > len(fields):
        names = [f"{stem}_{field}" for field in fields]
    return [name for field, part in zip(names, structure, strict=True) for name in leaf_names(field, part)]


def stem_of(name: str) -> str:
    """Return a name without the indices of an entry of a matrix."""
    return re.sub(r"(_\d+)+(?=(_start)?$)", "", name)


def found_in(module: str, name: str) -> Any:
    """Return the object of this name in a module of this process, or None."""
    value: Any = sys.modules.get(module)
    for part in name.split("."):
        value = getattr(value, part, None)
    return value
