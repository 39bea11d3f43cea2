"""The expressions whose operations are counted: those of ``tests/support/known``, with published counts."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from gacompiler.frontend.kernel import Kernel
from gacompiler.generation.spec_files import load_spec

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "tests" / "support" / "known"
PUBLISHED_IN = ("pga3", "cga3")
"""The files of expressions with published counts."""


@dataclass(frozen=True, slots=True)
class Known:
    """One expression.

    Attributes
    ----------
    kernel : Kernel
    published : (int, int) or None
        The best published count of products and sums.
    """

    kernel: Kernel
    published: tuple[int, int] | None

    @property
    def algebra(self) -> str:
        """The name of the algebra of the arguments."""
        return self.kernel.parameters[-1].layout.algebra.name


@cache
def known() -> dict[str, Known]:
    """Return every expression by name, sorted by algebra, those with published counts first."""
    published = _published()
    found = []
    for path in sorted(FOLDER.glob("*.py"), key=lambda path: (path.stem not in PUBLISHED_IN, path.stem)):
        if path.stem == "__init__":
            continue
        for kernel in load_spec(path).kernels:
            found.append(Known(kernel, published[kernel.name] if path.stem in PUBLISHED_IN else None))
    names = [each.kernel.name for each in found]
    if len(set(names)) < len(names):
        raise ValueError(f"{FOLDER}: two expressions have the same name; give them distinct names")
    return {each.kernel.name: each for each in sorted(found, key=lambda each: each.algebra)}


def _published() -> dict[str, tuple[int, int]]:
    """Return the published counts in the table of the tests."""
    folder = str(FOLDER.parent)
    sys.path.insert(0, folder)
    try:
        from known_counts import COUNTS
    finally:
        sys.path.remove(folder)
    return {name: published for name, (published, _) in COUNTS.items()}
