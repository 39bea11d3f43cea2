"""What the functions for writing kernels accept besides expressions and multivectors: numbers, and numeric objects.

Values of generated modules are accepted as the numeric objects that they are elements of.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, NoReturn

from ..algebra.coefficients import is_array_of_numbers, is_number
from ..algebra.multivector import Multivector
from ..algebra.operations import Kind, Operation
from ..errors import OperandError

EXPECTED = "multivectors, numbers, or expressions of the parameters of a kernel"


def own_operations(operands: tuple[Any, ...]) -> Callable[..., Any] | None:
    """Return the method ``_run_operation`` of the first operand that has one, for example a numeric object.

    Values of generated modules, which have a `family`, run the operations of numeric objects.
    """
    for kind in map(type, operands):
        if hasattr(kind, "_run_operation") or hasattr(kind, "family"):
            run: Callable[..., Any] = getattr(kind, "_run_operation", None) or _objects().run_operation
            return run
    return None


def _objects() -> Any:
    """Return the module of numeric objects, loaded by name because it is in a layer above this one."""
    return import_module(f"{__name__.partition('.')[0]}.objects.calls")


def without_values(where: str, operands: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return operands with values of generated modules as numeric objects."""
    is_found = any(hasattr(type(each), "family") for each in operands)
    return _objects().objects_of(where, operands) if is_found else operands


def is_operand(value: Any) -> bool:
    """Whether a value that is neither an expression nor a multivector can be an operand by itself."""
    return is_number(value) or hasattr(type(value), "_run_operation")


def checked(operation: Operation, operands: tuple[Any, ...]) -> None:
    """Refuse values that the operation would take for scalars although they may be something else.

    An array is a scalar beside a multivector, whose coefficients may be arrays, and for functions of scalars. Alone, it
    may just as well contain the coefficients of a multivector.

    Raises
    ------
    OperandError
        If an operand is none of those of `EXPECTED`.
    """
    arrays = operation.row.kind is Kind.SCALAR or any(isinstance(each, Multivector) for each in operands)
    for value in operands:
        allowed = isinstance(value, Multivector) or is_number(value)
        if not allowed and not (arrays and is_array_of_numbers(value)):
            refuse(f"{operation}()", value)


def check_scalars(where: str, *values: Any) -> None:
    """Refuse values that are not real scalars.

    Raises
    ------
    OperandError
        If a value is neither a real number nor an expression or a multivector that is a scalar.
    """
    for value in values:
        if hasattr(type(value), "norm_squared"):
            blades = value.blades if hasattr(value, "blades") else value.layout.support
            if any(blades):
                raise OperandError(where, f"{value}", "scalars", "use norm() or a coefficient, as in x.e12")
        elif isinstance(value, complex) or not is_operand(value):
            refuse(where, value)


def is_sequence(value: Any) -> bool:
    """Return whether a value is a list, a tuple or an array with axes."""
    return isinstance(value, (list, tuple)) or (is_array_of_numbers(value) and bool(value.shape))


def check_matrix(where: str, matrix: Any, *, is_symmetric: bool = False) -> None:
    """Refuse what is not a list, tuple or array of rows of scalars; of a symmetric matrix, only the lower half is read.

    Raises
    ------
    OperandError
        If it is anything else.
    """
    if not is_sequence(matrix) or not all(map(is_sequence, matrix)):
        raise OperandError(where, f"{type(matrix).__name__}", "a matrix, as a list or tuple of rows of scalars")
    for k, row in enumerate(matrix):
        check_scalars(where, *(row[: k + 1] if is_symmetric else row))


def check_operand(where: str, value: Any) -> None:
    """Refuse what is neither a multivector, a number, an array of numbers, nor an expression.

    Raises
    ------
    OperandError
        If it is anything else.
    """
    if not (is_operand(value) or is_array_of_numbers(value) or hasattr(type(value), "norm_squared")):
        refuse(where, value)


def refuse(where: str, value: Any) -> NoReturn:
    """Raise the error for an operand that is neither a multivector nor a number."""
    if hasattr(value, "__array__"):
        raise OperandError(
            where,
            f"{type(value).__name__}, an array that does not say which blades its entries belong to",
            EXPECTED,
            "call a compiled kernel, or convert it: PGA3.of(PGA3.POINT, array) of gacompiler.objects",
        )
    text = repr(value)
    shown = text if len(text) <= 60 else type(value).__name__
    raise OperandError(where, f"{shown}, of type {type(value).__name__}", EXPECTED)
