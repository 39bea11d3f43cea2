"""Programs of operations on disk, so that a process does not trace again what an earlier one has traced.

An entry is found by the definition, the layouts of the operands, and the sources of the compiler. Operations on layouts
with functions that have no name, such as the implied coefficients of an own layout, are traced in each process.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..algebra.algebra import Algebra
from ..algebra.catalog import CATALOG
from ..algebra.layout import SCALAR, Layout
from ..errors import BackendError, GacError
from ..generation.cache import Cache, key_of, open_cache
from ..generation.fingerprint import PROGRAM_SOURCES, stamp
from ..generation.plain import packed_program, program_of
from ..ir.program import Program
from .definitions import Definition
from .layouts import layout_of
from .plain_data import packed

_SOURCES = (*PROGRAM_SOURCES, "objects", "symbolic", "calculus")
"""What determines the program of an operation."""


class Kept(NamedTuple):
    """What an operation needs to run."""

    program: Program
    result: Layout
    declares: bool
    """Whether the kernel of the operation declares the layout of its result."""


class Place(NamedTuple):
    """Where the program of an operation is kept."""

    cache: Cache
    key: str
    algebra: Algebra
    """The algebra of the result, which has its named layouts."""

    def get(self) -> Kept | None:
        """Return what was kept; None if there is no entry, or it is not of the expected form."""
        found = self.cache.get(self.key)
        if found is None:
            return None
        try:
            program, layout, declares = found
            result = self._restored(layout)
            return None if result is None else Kept(program_of(program), result, bool(declares))
        except (GacError, LookupError, TypeError, ValueError):
            return None

    def put(self, kept: Kept) -> None:
        """Keep a program, unless its layout could not be restored."""
        name = None if kept.result.is_scalar else [kept.result.name, *kept.result.blades]
        if self._restored(name) is kept.result:
            self.cache.put(self.key, [packed_program(kept.program), name, kept.declares])

    def _restored(self, name: Any) -> Layout | None:
        """Return the layout of a result by its name and blades; None if the algebra has no such layout."""
        if name is None:
            return SCALAR
        found = self.algebra.named_layout(name[0])
        if found is None:
            found = layout_of(self.algebra, [self.algebra.blade(each)[1] for each in name[1:]])
        return found if [found.name, *found.blades] == list(name) else None


def place_of(definition: Definition, layouts: Sequence[Layout]) -> Place | None:
    """Return where the program of an operation is kept; None without a cache, or if the operands have no name."""
    sources = stamp(_SOURCES)
    try:
        folder = open_cache()
    except BackendError:  # operations do not need a cache
        folder = None
    if folder is None or sources is None:
        return None
    unit, algebra = definition.unit, definition.algebra_of(layouts)
    try:
        operands = [(_described(each.algebra), packed(each)[1]) for each in layouts]
        described = _described(algebra)
    except (GacError, TypeError, ValueError):
        return None
    what = (definition.name, definition.parameters, definition.text, definition.keeps)
    checked = unit and (unit.__module__, unit.__qualname__)
    return Place(folder, key_of("operation", sources, repr((what, checked, described, operands))), algebra)


def _described(algebra: Algebra) -> Any:
    """Return what distinguishes an algebra, with the names of its layouts, which results have."""
    if CATALOG.get(algebra.name) is algebra:
        return algebra.name
    gram = [[str(x) for x in row] for row in algebra.gram]
    spellings = [algebra.spelling(blade)[1] for blade in algebra.blades()]
    named = [packed(each)[1] for each in algebra.layouts.values()]
    return algebra.name, algebra.vectors, gram, spellings, repr(algebra.conjugates), named
