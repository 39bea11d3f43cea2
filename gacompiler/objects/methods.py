"""The operations of the algebra as methods of numeric objects, one line for each."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, TypeVar

from ..algebra.functions import docstring
from ..algebra.operations import Operation
from .definitions import BINARY, UNARY, Definition
from .native import extension, extension_is_settled

Method = TypeVar("Method", bound=Callable[..., Any])


class Engine(NamedTuple):
    """The functions that run operations, supplied by the file that defines the objects with these methods."""

    apply: Callable[..., Any]
    """Takes a definition and its operands."""
    role_type: Callable[..., Any]
    """Returns the type of the extension's object for a definition."""


_engine: list[Engine] = []


def run_by(engine: Engine) -> None:
    """Set the engine that runs the methods."""
    _engine[:] = [engine]


def run(definition: Definition, *operands: Any) -> Any:
    """Apply a definition to multivectors and numbers."""
    return _engine[0].apply(definition, *operands)


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


def _unary(operation: Operation) -> Callable[[Any], Any]:
    run = curried(UNARY[operation])

    def method(self: Any) -> Any:
        return run[0](self)

    return _named(method, operation, "Here `a` is this object.")


def _binary(operation: Operation) -> Callable[[Any, Any], Any]:
    run = curried(BINARY[operation])

    def method(self: Any, other: Any) -> Any:
        return run[0](self)(other)

    return _named(method, operation, "Here `a` is this object and `b` the other one.")


def _named(method: Method, operation: Operation, operands: str) -> Method:
    method.__name__, method.__qualname__ = operation.value, f"Operations.{operation}"
    method.__doc__ = f"{docstring(operation).rstrip()}\n\n{operands}\n"
    return method


class Operations:
    """The operations of the algebra as methods; `normalize` is defined by each class."""

    __slots__ = ()

    geometric_product = _binary(Operation.GEOMETRIC_PRODUCT)
    outer_product = _binary(Operation.OUTER_PRODUCT)
    regressive_product = _binary(Operation.REGRESSIVE_PRODUCT)
    left_contraction = _binary(Operation.LEFT_CONTRACTION)
    right_contraction = _binary(Operation.RIGHT_CONTRACTION)
    inner_product = _binary(Operation.INNER_PRODUCT)
    hestenes_product = _binary(Operation.HESTENES_PRODUCT)
    scalar_product = _binary(Operation.SCALAR_PRODUCT)
    commutator = _binary(Operation.COMMUTATOR)
    anticommutator = _binary(Operation.ANTICOMMUTATOR)
    sandwich = _binary(Operation.SANDWICH)

    negate = _unary(Operation.NEGATE)
    reverse = _unary(Operation.REVERSE)
    grade_involution = _unary(Operation.GRADE_INVOLUTION)
    clifford_conjugate = _unary(Operation.CLIFFORD_CONJUGATE)
    dual = _unary(Operation.DUAL)
    undual = _unary(Operation.UNDUAL)
    polarity = _unary(Operation.POLARITY)
    inverse = _unary(Operation.INVERSE)
    determinant = _unary(Operation.DETERMINANT)
    norm_squared = _unary(Operation.NORM_SQUARED)
    norm = _unary(Operation.NORM)
