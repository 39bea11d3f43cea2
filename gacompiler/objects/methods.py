"""The methods of all multivectors for numeric objects, which call compiled functions directly."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from ..algebra import methods
from ..algebra.algebra import Algebra
from ..algebra.operations import Operation
from .definitions import BINARY, UNARY, Definition
from .native import extension, extension_is_settled

__all__ = ["Engine", "Operations", "applied", "curried", "run_by", "scalar_of"]


class Engine(NamedTuple):
    """The functions that run operations, supplied by the file that defines the objects with these methods."""

    apply: Callable[..., Any]
    """Takes a definition and its operands."""
    role_type: Callable[..., Any]
    """Returns the type of the extension's object for a definition."""
    scalar_of: Callable[..., Any]
    """Returns a number as the only coefficient of a multivector of an algebra."""


_engine: list[Engine] = []


def run_by(engine: Engine) -> None:
    """Set the engine that runs the methods."""
    _engine[:] = [engine]


def applied(definition: Definition, *operands: Any) -> Any:
    """Apply a definition to multivectors and numbers."""
    return _engine[0].apply(definition, *operands)


def scalar_of(number: float, algebra: Algebra) -> Any:
    """Return a number as the only coefficient of a multivector of an algebra."""
    return _engine[0].scalar_of(number, algebra)


def curried(definition: Definition) -> list[Callable[[Any], Any]]:
    """Return a list with one entry, the operation as a function of its first operand.

    The function returns the result or, if there are two operands, a function of the second. The entry is replaced by an
    object of the extension of generated modules as soon as the extension is available.
    """

    def first(x: Any) -> Any:
        if extension() is not None:
            run[0] = _engine[0].role_type(definition, None)()
        elif extension_is_settled():
            run[0] = partial(_apply_curried, definition)
        else:
            return _apply_curried(definition, x)
        return run[0](x)

    run: list[Callable[[Any], Any]] = [first]
    return run


def _apply_curried(definition: Definition, x: Any) -> Any:
    apply = _engine[0].apply
    return apply(definition, x) if len(definition.parameters) == 1 else lambda y: apply(definition, x, y)


def _unary(operation: str) -> Callable[[Any], Any]:
    run = curried(UNARY[operation])

    def method(self: Any) -> Any:
        return run[0](self)

    return methods.named(method, operation)


def _binary(operation: str) -> Callable[[Any, Any], Any]:
    run = curried(BINARY[operation])

    def method(self: Any, other: Any) -> Any:
        return run[0](self)(other)

    return methods.named(method, operation)


if TYPE_CHECKING:
    from .signatures import Operations
else:

    class Operations(methods.Methods):
        """The operations of the algebra as methods; those with options or checks are defined by each class."""

        __slots__ = ()

        negate = _unary(Operation.NEGATE)

    for _name in vars(methods.Methods).keys() & {*UNARY, *BINARY}:
        setattr(Operations, _name, (_unary if _name in UNARY else _binary)(_name))
