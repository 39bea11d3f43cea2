"""Names in kernels with loops: those of tables and symbols come from the parameters of the bodies of loops."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from ..ir.reserved import legal
from .rows import leaves_of


class Names:
    """Names that were given: each is given once."""

    def __init__(self, given: Mapping[str, int] | None = None) -> None:
        self._given = dict(given or {})

    def copy(self) -> Names:
        """The same names, to go on from."""
        return Names(self._given)

    def take(self, name: str) -> None:
        """Reserve a name."""
        self._given.setdefault(name, 1)

    def unique(self, stem: str) -> str:
        """The stem itself where it is free and legal in all languages, else followed by a number."""
        stem = legal(stem.strip("_") or "value")
        while True:
            n = self._given.get(stem, 0) + 1
            self._given[stem] = n
            name = stem if n == 1 else f"{stem}_{n}"
            if n == 1 or name not in self._given:
                self._given.setdefault(name, 1)
                return name


def named_like(body: Callable[..., Any], function: Callable[..., Any], first: Sequence[str] = ()) -> Callable[..., Any]:
    """A function whose parameters have the names in `first`, followed by those of another function."""
    function.__dict__["names_of_parameters"] = [*first, *parameter_names(body)]
    return function


def parameter_names(body: Callable[..., Any]) -> list[str]:
    """The names of the parameters of a body; none where they are not known."""
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
    """Names for the leaves of the structures that a body is called with."""
    names = parameter_names(body)
    return [leaf_names(names[k] if k < len(names) else default, structure) for k, structure in enumerate(structures)]


def result_stems(body: Callable[..., Any], result: Any) -> list[str]:
    """Names for the leaves of what a body returns: its own name, if it has one, and those of its fields."""
    function = body.func if isinstance(body, partial) else body
    name = getattr(function, "name", None) or getattr(function, "__name__", "")
    return leaf_names(name if isinstance(name, str) and name.isidentifier() else "mapped", result)


def leaf_names(stem: str, structure: Any) -> list[str]:
    """Names for the leaves of a structure: the fields of named tuples; `stem` and a number for others."""
    if not isinstance(structure, (tuple, list)):
        return [stem]
    fields = getattr(structure, "_fields", None)
    names = list(fields) if fields else [f"{stem}_{k}" for k in range(len(structure))]
    if fields and len(leaves_of(structure)) > len(fields):
        names = [f"{stem}_{field}" for field in fields]
    return [name for field, part in zip(names, structure, strict=True) for name in leaf_names(field, part)]


def stem_of(name: str) -> str:
    """A name without the numbers of a place in a matrix."""
    return re.sub(r"(_\d+)+(?=(_start)?$)", "", name)
