"""A base class of immutable objects."""

from __future__ import annotations

from typing import Self


class Immutable:
    """An immutable object, which `copy.copy` and `copy.deepcopy` return unchanged."""

    __slots__ = ()

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memory: object) -> Self:
        return self
