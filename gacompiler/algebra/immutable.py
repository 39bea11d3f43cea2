"""What objects that never change have in common: a copy of one is the object itself."""

from __future__ import annotations

from typing import Self


class Immutable:
    """An object that `copy.copy` and `copy.deepcopy` need not copy."""

    __slots__ = ()

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memory: object) -> Self:
        return self
