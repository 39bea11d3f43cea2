"""Selection of some kernels of specs: ``gac generate --only a,b``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches

from ..errors import SpecError
from .spec_files import Spec


def select(specs: Sequence[Spec], names: Sequence[str]) -> list[Spec]:
    """Return the specs with only the kernels of these names; specs that define none of them are omitted.

    Parameters
    ----------
    specs : sequence of Spec
    names : sequence of str
        Names of kernels. If there are none, the specs are returned unchanged.

    Raises
    ------
    SpecError
        If no spec defines a kernel of one of the names. The error lists similar names.
    """
    if not names:
        return list(specs)
    known = [kernel.name for spec in specs for kernel in spec.kernels]
    for name in names:
        if name not in known:
            near = get_close_matches(name, known, 5)
            expected = "one of " + " ".join(near or known)
            raise SpecError(", ".join(str(spec.path) for spec in specs), f"it defines no kernel {name!r}", expected)
    chosen = []
    for spec in specs:
        kernels = tuple(kernel for kernel in spec.kernels if kernel.name in names)
        if kernels:
            only = ",".join(kernel.name for kernel in kernels)
            chosen.append(replace(spec, kernels=kernels, command=f"{spec.command} --only {only}"))
    return chosen
