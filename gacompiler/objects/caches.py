"""Caches that distinguish algebras and layouts that are equal but have other names.

Elements of equal algebras may be combined, whatever the algebras are called. The layout of a result has the names of
the algebra of its operands, and not those of an equal algebra that this process used before.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from ..algebra.algebra import Algebra
from ..algebra.layout import Layout
from .definitions import Definition

_NAMED = (Algebra, Layout, Definition)
Function = TypeVar("Function", bound=Callable[..., Any])


def key_of(x: Any) -> Any:
    """Return a key that is equal for things that are equal with all their names."""
    if isinstance(x, Algebra):
        return x.arguments
    if isinstance(x, Layout):
        return x.algebra.arguments, x.row
    if isinstance(x, Definition):
        return x, x.algebra and x.algebra.arguments
    return tuple(map(key_of, x)) if isinstance(x, tuple) else x


def cached_by_name(function: Function) -> Function:
    """Cache a function of algebras, layouts and definitions, first by their identity: comparing them is slow."""
    by_identity: dict[tuple[Any, ...], tuple[Any, tuple[Any, ...]]] = {}
    by_key: dict[tuple[Any, ...], Any] = {}

    @wraps(function)
    def run(*arguments: Any) -> Any:
        identity = tuple([id(x) if isinstance(x, _NAMED) else x for x in arguments])
        known = by_identity.get(identity)
        if known is None:
            key = key_of(arguments)
            if key not in by_key:
                by_key[key] = function(*arguments)
            known = by_identity[identity] = by_key[key], arguments  # the entry keeps them alive
        return known[0]

    return run  # type: ignore[return-value]
