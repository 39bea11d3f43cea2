"""Calls of kernels inside other kernels.

A call is recorded while the outer kernel is traced, because the called kernel is optimised as a kernel of its own
(`gacompiler.passes.compose`). The expressions of the outer kernel do not depend on the record.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from .expression import Expression, lift
from .traced import leaves

K = TypeVar("K")
"""The type of kernels, which are defined on top of this module."""


@dataclass(frozen=True, slots=True)
class Call(Generic[K]):
    """A call of a kernel on expressions.

    Attributes
    ----------
    kernel : Kernel
        The called kernel, without loops.
    arguments, results : tuple of Expression
        The elements of its arguments and results, in the order of its parameters and outputs.
    """

    kernel: K
    arguments: tuple[Expression, ...]
    results: tuple[Expression, ...]


_RECORD: ContextVar[list[Call[Any]] | None] = ContextVar("calls", default=None)


@contextmanager
def recorded_calls() -> Iterator[list[Call[Any]]]:
    """Record the calls of kernels in this context, inner calls before outer ones."""
    calls: list[Call[Any]] = []
    token = _RECORD.set(calls)
    try:
        yield calls
    finally:
        _RECORD.reset(token)


def record_call(kernel: K, arguments: tuple[Any, ...], value: Any) -> None:
    """Record a call if calls are recorded and it has expressions as arguments and results."""
    calls = _RECORD.get()
    if calls is None:
        return
    given, found = list(leaves(arguments)), list(leaves(value))
    if any(isinstance(each, Expression) for each in given) and all(isinstance(each, Expression) for each in found):
        calls.append(Call(kernel, tuple(map(lift, given)), tuple(found)))
