"""Creation of functions from the table of operations, with the names and docstrings of the table."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

from .operations import Operation

Result = TypeVar("Result")
Given = TypeVar("Given", covariant=True)
Function = TypeVar("Function", bound=Callable[..., Any])


class Unary(Protocol[Given]):
    """A function of one operand."""

    def __call__(self, a: Any) -> Given: ...


class Binary(Protocol[Given]):
    """A function of two operands."""

    def __call__(self, a: Any, b: Any) -> Given: ...


def unary(apply: Callable[..., Result], operation: Operation, name: str = "") -> Unary[Result]:
    """Create the function ``a -> apply(operation, a)``, with the operation's name unless `name` is given."""

    def function(a: Any) -> Result:
        return apply(operation, a)

    return _named(function, apply, operation, name)


def binary(apply: Callable[..., Result], operation: Operation, name: str = "") -> Binary[Result]:
    """Create the function ``(a, b) -> apply(operation, a, b)``, with the operation's name unless `name` is given."""

    def function(a: Any, b: Any) -> Result:
        return apply(operation, a, b)

    return _named(function, apply, operation, name)


def docstring(operation: Operation) -> str:
    """Return the docstring of an operation: its summary and details in the table."""
    row = operation.row
    return f"{row.summary}\n\n{row.details}\n" if row.details else row.summary


def _named(function: Function, apply: Callable[..., Any], operation: Operation, name: str) -> Function:
    function.__name__ = function.__qualname__ = name or operation.value
    function.__module__ = apply.__module__
    function.__doc__ = docstring(operation)
    return function
