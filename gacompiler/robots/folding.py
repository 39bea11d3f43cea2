"""Trace methods of one robot with symbols, fold the constants, and substitute arguments of any type."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

from ..algebra.layout import SCALAR
from ..errors import SpecError
from ..frontend.expression import lift
from ..frontend.kernel import Parameter, array
from ..frontend.rows import Unrolled, leaves_of, like
from ..frontend.traced import Traced
from .chains import Chain
from .constants import with_constants_folded
from .whole_angles import by_whole_angles

Scalars = Sequence[Any]
Rows = tuple[tuple[Any, ...], ...]


@lru_cache(maxsize=64)
def _traced(method: Callable[..., Any], chain: Chain, names: tuple[str, ...]) -> Traced:
    """Trace a method with symbols, and fold the constants in its result."""
    lengths = [chain.n_positions if name == "q" else chain.n_variables for name in names]
    symbols = tuple(
        Parameter(name, array(SCALAR, length)).symbols() for name, length in zip(names, lengths, strict=True)
    )
    value = _plain(method(chain, *symbols))
    folded = with_constants_folded([lift(leaf) for leaf in leaves_of(value)])
    return Traced(symbols, like(value, with_constants_folded(by_whole_angles(folded))))


def _plain(value: Any) -> Any:
    """Return a value with tuples in place of arrays."""
    if isinstance(value, Unrolled):
        value = value.elements
    return tuple(map(_plain, value)) if isinstance(value, tuple) else value


def folded(method: Callable[..., Any], chain: Chain, **given: Scalars) -> Any:
    """Evaluate a method for given arguments, which may be expressions, sympy symbols or numbers."""
    return _traced(method, chain, tuple(given))(*map(tuple, given.values()))


def need(chain: Chain, name: str) -> None:
    """Raise `SpecError` if a chain does not have the constants that a method needs."""
    if not getattr(chain, name):
        raise SpecError("Chain()", f"no {name}, which this method needs", "one row for each joint")
